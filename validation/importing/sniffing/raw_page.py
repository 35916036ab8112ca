"""``raw.html``: all traces of a log, the throws in it, and the map with its reasons. Takes them; writes one page."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from discsim.arrays import FloatArray
from discsim.recording import SENSORS
from discsim.validation.importing.conversion import RawReadings
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.stretches import Stretch
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.html import Section, write_report

__all__ = ["envelope", "write_raw_page"]

#: Columns of a figure that a trace is drawn in: a figure is 1650 points wide, two values (least, largest) each.
BINS = 1650
#: Throws drawn by themselves; a figure is below 300 kB, so the page stays below 5 MB whatever the log's length.
CLOSE_UPS = 12
_COLOURS = ("#d55e00", "#0072b2", "#009e73")
_UNITS = {"uT": "uT", "m_s2": "m/s^2", "rad_s": "deg/s", "m": "m"}


def envelope(t: FloatArray, value: FloatArray, bins: int = BINS) -> tuple[FloatArray, FloatArray]:
    """Return a trace of at most ``2 bins`` points with the least and largest of each bin of (n,) s and (n,) values.

    No peak is lost, however long the log is. A bin without a number is NaN, which breaks the line.
    """
    if t.size <= 2 * bins:
        return t, value
    edges = np.linspace(0, t.size, bins + 1).astype(int)[:-1]
    low = np.fmin.reduceat(value, edges)
    high = np.fmax.reduceat(value, edges)
    return np.repeat(t[edges], 2), np.column_stack([low, high]).reshape(-1)


def write_raw_page(
    path: Path, name: str, read: RawReadings, throws: Sequence[Stretch], decisions: Sequence[Decision]
) -> None:
    """Write the page; without decisions (a shipped or own map) it has the traces and throws alone."""
    zero = min(float(found.time[0]) for found in read.readings.values())
    end = max(float(found.time[-1]) for found in read.readings.values()) - zero
    with tempfile.TemporaryDirectory() as place:
        whole = Path(place) / "whole.png"
        _draw(whole, read, zero, (0.0, end), throws)
        close = []
        for number, throw in enumerate(throws[:CLOSE_UPS], start=1):
            margin = max(0.3, 0.3 * (throw.end - throw.start))
            file = Path(place) / f"{number}.png"
            _draw(file, read, zero, (throw.start - margin, throw.end + margin), [throw], number)
            close.append((f"Throw {number}: {throw.text}. The shaded rows are taken by --throw {number}.", file))
        sections = [Section("The whole log", figures=[("All traces, in body axes and SI units.", whole)])]
        if decisions:
            sections.append(
                Section(
                    "How the columns were understood",
                    ["A guess wants your eye: correct it in the map and import again with --map."],
                    ["what", "decided", "how sure", "why"],
                    [list(decision) for decision in decisions],
                )
            )
        sections.append(_throws(throws, close))
        text = read.import_map.path.read_text(encoding="utf-8")
        sections.append(Section("The map", header=["", read.import_map.path.name], rows=_numbered(text)))
        notes = " ".join(read.notes)
        lead = f"{_described(read, end)} {notes}".strip()
        write_report(path, f"{name}: what is in it", lead, sections)


def _described(read: RawReadings, end: float) -> str:
    parts = [f"{sensor} {found.time.size} rows" for sensor, found in read.readings.items()]
    return f"{end:.1f} s; {', '.join(parts)}."


def _throws(throws: Sequence[Stretch], close: Sequence[tuple[str, Path]]) -> Section:
    if not throws:
        text = ["No stretch of free spin (a turn a second or faster, about one axis, for 0.3 s and two turns)."]
        return Section("Throws", text)
    rows = [
        [
            str(number),
            f"{throw.start:.2f}",
            f"{throw.end:.2f}",
            f"{throw.first}:{throw.stop}",
            f"{'more than ' * throw.at_least}{np.degrees(throw.spin):.0f}",
        ]
        for number, throw in enumerate(throws, start=1)
    ]
    header = ["throw", "from, s", "to, s", "rows", "spin, deg/s"]
    more = [f"The first {CLOSE_UPS} are drawn."] if len(throws) > CLOSE_UPS else []
    return Section("Throws", more, header, rows, close)


def _numbered(text: str) -> list[list[str]]:
    return [[str(k), line] for k, line in enumerate(text.splitlines(), start=1)]


def _draw(
    path: Path,
    read: RawReadings,
    zero: float,
    span: tuple[float, float],
    throws: Sequence[Stretch],
    first: int = 1,
) -> None:
    shown = list(read.readings)
    figure, axes = new_figure(len(shown), 1, width=11.0, height=2.2 * len(shown) + 0.6, sharex=True, squeeze=False)
    for panel, sensor in zip(axes[:, 0], shown, strict=True):
        found = read.readings[sensor]
        inside = (found.time - zero >= span[0]) & (found.time - zero <= span[1])
        _traces(panel, sensor, found.time[inside] - zero, found.value[inside])
        for number, throw in enumerate(throws, start=first):
            panel.axvspan(throw.start, throw.end, color="#e69f00", alpha=0.18, lw=0)
            if panel is axes[0, 0]:
                panel.annotate(str(number), (throw.start, 1.0), xycoords=("data", "axes fraction"), va="top")
    axes[-1, 0].set_xlabel("time from the log's first sample, s")
    axes[-1, 0].set_xlim(*span)
    save_figure(figure, path)


def _traces(panel: Axes, sensor: str, t: FloatArray, value: FloatArray) -> None:
    unit = SENSORS[sensor].unit
    columns = value if value.ndim == 2 else value[:, None]
    shown = np.degrees(columns) if unit == "rad_s" else columns
    for k in range(shown.shape[1]):
        panel.plot(
            *envelope(t, shown[:, k]), color=_COLOURS[k % 3], lw=0.8, label=SENSORS[sensor].columns[k].partition("_")[0]
        )
    panel.set_ylabel(f"{sensor}, {_UNITS.get(unit, 'm and m/s')}")
    panel.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=7)
