"""`check` and what it gives: all findings on some recordings, as a table, as JSON, as a file."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from rich.console import Console

from discsim.effects.setup import ClockUnit
from discsim.files import write_text
from discsim.result import Result
from discsim.threads import one_thread
from discsim.validation.checking.check import Check, check_recording
from discsim.validation.checking.failed_readings import without_failed
from discsim.validation.checking.table import print_checks
from discsim.validation.diagnosis.setup import find_setup_faults, suspected_fault
from discsim.validation.reporting.figures import COLOURS, new_figure
from discsim.validation.reporting.run import json_text
from discsim.validation.running.given import Given, given_recordings
from discsim.written import corrected

__all__ = ["Checked", "check"]


@dataclass(frozen=True, repr=False)
class Checked(Result):
    """What was found in recordings: a `Check` of each, in their order."""

    checks: tuple[Check, ...]

    def __repr__(self) -> str:
        errors, warnings = (sum(len(one.of(severity)) for one in self.checks) for severity in ("error", "warning"))
        return f"<Checked: {len(self.checks)} recordings, {errors} errors, {warnings} warnings>"

    @property
    def ok(self) -> bool:
        """Whether no error was found."""
        return not any(one.of("error") for one in self.checks)

    def table(self) -> dict[str, list[Any]]:
        """Return a row for each finding: recording, severity, id, where, sentence."""
        rows = [(one.name, found) for one in self.checks for found in one.findings]
        return {
            "recording": [name for name, _ in rows],
            **{key: [getattr(found, key) for _, found in rows] for key in ("severity", "id", "where", "sentence")},
        }

    def plot(self) -> Figure:
        """Return a figure of the span that each sensor of each recording covers, with its silences left out."""
        rows = [(one, sensor) for one in self.checks for sensor in one.sensors]
        figure, axes = new_figure(width=9.0, height=1.2 + 0.3 * len(rows))
        for row, (one, sensor) in enumerate(rows):
            ends = [0.0, *(edge for start, length in sensor.silent for edge in (start, start + length)), one.duration]
            bars = [(start, stop - start) for start, stop in zip(ends[::2], ends[1::2], strict=True)]
            axes.broken_barh(bars, (row - 0.35, 0.7), color=COLOURS["accelerometer"])
        axes.set_yticks(range(len(rows)), [f"{one.name}: {sensor.sensor}" for one, sensor in rows])
        axes.invert_yaxis()
        axes.set_xlabel("time (s)")
        return figure

    def to_json(self) -> dict[str, Any]:
        """Return the content of check.json."""
        return {"recordings": [one.to_json() for one in self.checks]}

    def summary(self, width: int = 120) -> str:
        """Return the text that ``discsim check`` prints, in lines of at most ``width`` characters."""
        text = io.StringIO()
        print_checks(self.checks, Console(file=text, width=width))
        return text.getvalue()

    def report(self, folder: Path | str) -> Path:
        """Write check.json into ``folder``; return its path."""
        file = Path(folder) / "check.json"
        write_text(file, json_text(self.to_json()))
        return file


@one_thread
def check(recordings: Given) -> Checked:
    """Say what recordings hold, what is wrong with them, and what they can tell. Nothing is fitted.

    ``recordings`` is a recording, a folder of one or of a data set, or a sequence of these; setup faults (axes, units,
    offsets in time) are looked for in all of them together.

    >>> import numpy as np, discsim
    >>> t = np.arange(0, 2, 0.01)
    >>> field = 40 * np.column_stack([np.cos(30 * t), -np.sin(30 * t), 0 * t])
    >>> check(discsim.recording_from_arrays({"magnetometer": (t, field)})).checks[0].sensors[0].rows
    200
    """
    found = given_recordings(recordings)
    setup = find_setup_faults([without_failed(recording) for recording in found])
    faults = [*setup.faults, *filter(None, [suspected_fault(setup)])]
    # in another unit of time every rate, path and noise looks wrong as well
    clock = [fault.effect for fault in setup.faults if isinstance(fault.effect.value, ClockUnit)]
    return Checked(tuple(check_recording(corrected(recording, clock), faults) for recording in found))
