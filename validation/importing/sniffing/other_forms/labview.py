"""LabVIEW's measurement files (.lvm): two headers above the names, units and steps by column in the second.

Written anew they are a table: times in s, names with their units. A file without a column of times states its rate.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

from discsim.validation.importing.sniffing.other_forms.written import (
    comma_separated,
    first_bytes,
    first_lines,
    rewrite_lines,
)

__all__ = ["begins", "write_tables"]

_FIRST, _END = "LabVIEW Measurement", "***End_of_Header***"
_CHANNELS, _TIME, _COMMENT = "Channels", "X_Value", "Comment"


def begins(path: Path) -> bool:
    """Tell such a file by its first line."""
    return first_bytes(path, len(_FIRST) + 3).removeprefix(b"\xef\xbb\xbf").startswith(_FIRST.encode())


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write its channels as a table, and return what to say of it; raises `InputError` where it cannot be read."""
    _, lines = first_lines(raw)
    stated = _stated(lines[: lines.index(_END)] if _END in lines else lines)
    rewrite_lines(raw, target, lambda every: _table(every, stated))
    return [f"{raw.name}: a measurement file of LabVIEW; read: its channels as a table"]


def _stated(lines: Iterable[str]) -> dict[str, str]:
    """Return what the first header states, by its keys; its cells are parted by tabs or commas, whichever it says."""
    pairs = [re.split(r"[\t,;]", line.strip(), maxsplit=1) for line in lines]
    return {pair[0]: pair[1].strip() for pair in pairs if len(pair) == 2}


def _table(lines: Iterable[str], stated: Mapping[str, str]) -> Iterator[str]:
    """Yield the lines of a table: its rate where no column is a time, its names, and its rows.

    Several headers one below the other (Multi_Headings) are of one measurement that goes on.
    """
    separator = "," if stated.get("Separator", "Tab").casefold() == "comma" else "\t"
    comma = stated.get("Decimal_Separator", ".") == ","
    header: dict[str, list[str]] = {}
    place, kept = "file", list[int]()
    for line in lines:
        cells = [cell.strip() for cell in line.split(separator)]
        if cells[0] == _CHANNELS:
            place = "channels"
        if cells[0] == _END:
            place = "channels" if place == "file" else "rows"
        elif place == "file" or not any(cells):
            continue
        elif place == "channels":
            header[cells[0]] = cells[1:]
        elif _TIME in cells or (not kept and _COMMENT in cells) or not any(map(_number, cells)):
            if not kept:
                kept = _columns(cells, stated)
                yield from _heading(cells, kept, header)
        else:
            row = [cells[k] if k < len(cells) else "" for k in kept]
            yield comma_separated([[cell.replace(",", ".") for cell in row] if comma else row]).rstrip("\n")


def _columns(names: Sequence[str], stated: Mapping[str, str]) -> list[int]:
    """Return the columns that are read: one of times at most, of what is a column of times before each channel."""
    timed = stated.get("X_Columns", "One").casefold() != "no"
    times = [k for k, name in enumerate(names) if name == _TIME]
    channels = [k for k, name in enumerate(names) if name and name not in (_TIME, _COMMENT)]
    return [*(times[:1] if timed else []), *channels]


def _heading(names: Sequence[str], kept: Sequence[int], header: Mapping[str, list[str]]) -> Iterator[str]:
    """Yield the line of names with their units, below a line that states the rate where no column is a time."""
    steps = {float(cell.replace(",", ".")) for cell in header.get("Delta_X", []) if _number(cell)}
    timed = any(names[k] == _TIME for k in kept)
    if not timed and len(steps) == 1 and (step := steps.pop()) > 0.0:
        yield f"# Sampling rate: {1 / step:.9g} Hz, by Delta_X"
    units, channels = header.get("Y_Unit_Label", []), [k for k in kept if names[k] != _TIME]
    named = {k: f"{names[k]} ({unit})" if unit else names[k] for k, unit in zip(channels, units, strict=False)}
    yield comma_separated([[("time_s" if names[k] == _TIME else named.get(k, names[k])) for k in kept]]).rstrip("\n")


def _number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True
