"""Exports of motion capture as text: Motive (OptiTrack), Nexus (Vicon), QTM (Qualisys) and TRC (Cortex, OpenSim).

Their names, axes and units stand in lines of their own, and the rate of frames in place of times. As a table rows had
no names; the points of QTM were taken for an accelerometer's and a magnetometer's readings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.validation.importing.cell_texts import number
from discsim.validation.importing.sniffing.other_forms.markers import middle_of
from discsim.validation.importing.sniffing.other_forms.written import (
    all_rows,
    comma_separated,
    first_lines,
    read_and_left,
)

__all__ = ["begins", "write_tables"]

Cells: TypeAlias = Sequence[str]
#: How the point is called that the markers of one body turn about.
_MIDDLE = "middle"
_METRES = {"meters": "m", "centimeters": "cm", "millimeters": "mm"}


class _Points(NamedTuple):
    """What an export tracks: where each point's x, y and z stand in a row, by its name, their unit, and the frames.

    ``up_is_y``: the frame's y axis is the vertical. ``time`` is the column of times, s; without it ``frame`` counts
    them, ``rate`` a second.
    """

    columns: dict[str, tuple[int, int, int]]
    unit: str
    rows: list[Cells]
    time: int | None = None
    frame: int | None = None
    rate: float = 0.0
    up_is_y: bool = False


def begins(path: Path) -> bool:
    """Tell an export of one of these programs by its first line."""
    return _reader(path) is not None


def _reader(path: Path) -> Callable[[list[Cells]], _Points] | None:
    _, lines = first_lines(path)
    first = next((line.strip() for line in lines if line.strip()), "")
    if first.startswith("Format Version,"):
        return _motive
    if first in ("Trajectories", "Devices", "Joints", "Model Outputs") and "Frame,Sub Frame" in "\n".join(lines):
        return _vicon
    if first.startswith("PathFileType"):
        return _trc
    return _qualisys if first.startswith("NO_OF_FRAMES\t") else None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table of times and of each point's place, x, y, z with z up; return what to say.

    Raises `InputError` where the export holds no point.
    """
    read = _reader(raw)
    assert read is not None
    encoding, _ = first_lines(raw)
    rows = all_rows(raw, encoding, "\t" if read in (_qualisys, _trc) else ",")
    try:
        points = read([[cell.strip() for cell in row] for row in rows])
        if points.time is None and not 0.0 < points.rate < np.inf:
            raise ValueError(f"{points.rate:g} frames a second")
    except (ValueError, LookupError, StopIteration) as error:
        what = f"is a motion capture's export that breaks off in its head ({error or type(error).__name__})"
        raise InputError.at(raw, None, f"{what}; expected its lines of names and rates, and rows below") from None
    if not points.columns:
        raise InputError.at(
            raw, None, "holds no position of a rigid body or marker; export positions, in a global frame"
        )
    names, table = list(points.columns), [[time, *_place(points, row)] for time, row in _timed(points)]
    turned = "; its y axis is up: here z is that, and y its -z" * points.up_is_y
    said = [read_and_left(raw, "a motion capture's export", f"{', '.join(names)}{turned}", ())]
    if len(names) > 2 and (middle := middle_of(_numbers(table))) is not None:
        names = [_MIDDLE, *names]
        table = [
            [time, *("" if np.isnan(cell) else f"{cell:.9g}" for cell in place), *cells]
            for (time, *cells), place in zip(table, middle.path, strict=True)
        ]
        arm = f"{middle.arm:.4g} {points.unit} from {names[1]}"
        said.append(f"{raw.name}: its points are one body; what they turn about is '{_MIDDLE}', {arm}")
    columns = [f"{name} {axis} ({points.unit})" for name in names for axis in "xyz"]
    target.write_text(comma_separated([["time_s", *columns], *table]), encoding="utf-8")
    return said


def _numbers(table: Sequence[Cells]) -> FloatArray:
    """Return the places (n, m, 3) of rows of a time and cells; NaN where one was not seen."""
    return np.array([[_value(cell) for cell in row[1:]] for row in table]).reshape(len(table), -1, 3)


def _timed(points: _Points) -> Iterator[tuple[str, Cells]]:
    """Yield the time of each row, s, as text, and the row; what is no row of numbers is left out."""
    for count, row in enumerate(points.rows):
        if points.time is not None:
            time = row[points.time] if len(row) > points.time else ""
        else:
            frame = row[points.frame] if points.frame is not None and len(row) > points.frame else str(count)
            time = f"{float(frame) / points.rate:.6f}" if frame.isdecimal() else ""
        if time:
            yield time, row


def _place(points: _Points, row: Cells) -> Iterator[str]:
    for columns in points.columns.values():
        x, y, z = (row[k] if k < len(row) else "" for k in columns)
        if points.up_is_y:
            y, z = (z[1:] if z.startswith("-") else f"-{z}" if z else ""), y
        yield from (x, y, z)


def _motive(rows: list[Cells]) -> _Points:
    """Return the rigid bodies of a take, or its markers where there is none; its y axis is up."""
    head = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    below = next(k for k, row in enumerate(rows) if row and row[0] == "Frame")
    above = {row[1]: row for row in rows[1:below] if len(row) > 2 and row[1]}
    kinds, names, axes = rows[below - 1], above["Name"], rows[below]
    types = above.get("Type", names)
    bodies: dict[str, dict[str, int]] = {}
    markers: dict[str, dict[str, int]] = {}
    for k in range(2, len(axes)):
        if k < len(kinds) and kinds[k] == "Position" and axes[k] in ("X", "Y", "Z"):
            (bodies if types[k] == "Rigid Body" else markers).setdefault(names[k], {})[axes[k]] = k
    found = {
        name: (own["X"], own["Y"], own["Z"]) for name, own in (bodies or markers).items() if set(own) == {"X", "Y", "Z"}
    }
    unit = _METRES.get(head.get("Length Units", "").lower(), "m")
    return _Points(found, unit, rows[below + 1 :], time=1, up_is_y=True)


def _vicon(rows: list[Cells]) -> _Points:
    """Return the markers of the section "Trajectories"."""
    start = next(k for k, row in enumerate(rows) if row and row[0] == "Trajectories")
    rate = float(rows[start + 1][0])
    names, axes, units = rows[start + 2 : start + 5]
    found = {
        name: (k, k + 1, k + 2)
        for k, name in enumerate(names)
        if name and [axis.upper() for axis in axes[k : k + 3]] == ["X", "Y", "Z"]
    }
    unit = next((cell for cell in units if cell), "mm")
    end = next((k for k in range(start + 5, len(rows)) if np.isnan(_value(rows[k][0]))), len(rows))
    return _Points(found, unit, rows[start + 5 : end], frame=0, rate=rate)


def _qualisys(rows: list[Cells]) -> _Points:
    """Return the markers of a file of QTM, in mm; three noughts are a marker that was not seen."""
    head = {row[0]: row[1:] for row in islice(rows, 40) if row and np.isnan(_value(row[0]))}
    names = [name for name in head["MARKER_NAMES"] if name]
    first = next(k for k, row in enumerate(rows) if row and not np.isnan(_value(row[0])))
    table = rows[first:]
    lead = 2 if len([cell for cell in table[0] if cell]) == 3 * len(names) + 2 or "Frame" in head else 0
    found = {name: (lead + 3 * k, lead + 3 * k + 1, lead + 3 * k + 2) for k, name in enumerate(names)}
    seen = [_seen(row, list(found.values())) for row in table]
    rate = float(head["FREQUENCY"][0])
    return _Points(found, "mm", seen, time=1 if lead else None, rate=rate)


def _trc(rows: list[Cells]) -> _Points:
    """Return the markers of a TRC file, whose names stand over the first of three columns each."""
    head = dict(zip(rows[1], rows[2], strict=False))
    above = next(k for k, row in enumerate(rows) if row and row[0].startswith("Frame"))
    found = {name: (k, k + 1, k + 2) for k, name in enumerate(rows[above]) if k > 1 and name}
    table = [row for row in rows[above + 1 :] if row and not np.isnan(_value(row[0]))]
    unit = head["Units"]
    return _Points(found, _METRES.get(unit.lower(), unit), table, time=1)


def _seen(row: Cells, places: Sequence[tuple[int, int, int]]) -> Cells:
    cells = list(row)
    for columns in places:
        if all(k < len(cells) and _value(cells[k]) == 0.0 for k in columns):
            for k in columns:
                cells[k] = ""
    return cells


def _value(cell: str) -> float:
    """Return a cell's number, NaN where it holds none."""
    value = number(cell)
    return float("nan") if value is None else value
