"""A check on the terminal: a table of the sensors, the findings, and what the recording can tell."""

from __future__ import annotations

from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

from discsim.recording import SENSORS
from discsim.validation.checking.check import Check
from discsim.validation.checking.sensors import SensorCheck

__all__ = ["print_checks"]

_COLOURS = {"error": "bold red", "warning": "yellow", "note": "dim"}


def print_checks(checks: Sequence[Check], console: Console | None = None) -> None:
    """Print a table for each recording; what is found alike in several is said at the first and counted."""
    console = console or Console()
    said: dict[str, int] = {}
    lacks: set[tuple[str, ...]] = set()
    for check in checks:
        console.print(_table(check))
        for finding in check.findings:
            key = f"{finding.id} {finding.where}"
            said[key] = said.get(key, 0) + 1
            if said[key] == 1 or finding.severity == "error":
                colour = _COLOURS[finding.severity]
                console.print(f"[{colour}]{finding.severity}[/]  {escape(finding.sentence)}", highlight=False)
        again = [f.id for f in check.findings if said[f"{f.id} {f.where}"] > 1 and f.severity != "error"]
        if again:
            console.print(f"as in a recording above: {', '.join(dict.fromkeys(again))}", highlight=False)
        can = (*check.methods, *check.not_told)
        if can not in lacks:
            lacks.add(can)
            console.print(f"estimate can use: {', '.join(check.methods) or 'no method'}", highlight=False)
            for name, reason in check.methods_left_out.items():
                if not reason.startswith("no "):
                    console.print(f"  not {name}: {escape(reason)}", highlight=False)
            for line in check.not_told:
                console.print(f"  {escape(line)}", highlight=False)
    errors, warnings = (sum(len(check.of(severity)) for check in checks) for severity in ("error", "warning"))
    counts = f"{_count(errors, 'error')}, {_count(warnings, 'warning')} in {_count(len(checks), 'recording')}"
    console.print(counts, highlight=False)


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + "s" * (number != 1)


def _table(check: Check) -> Table:
    title = f"{check.name}: {check.plant}, {check.duration:.2f} s"
    first = Column("sensor", no_wrap=True, min_width=max((len(found.sensor) for found in check.sensors), default=0))
    columns = [Column(name, justify="right") for name in ("Hz", "rows", "step", "noise (stated)")]
    table = Table(first, *columns, "unit", "of its rows", title=title)
    for found in check.sensors:
        rate = f"{found.rate_hz:.4g}"
        stated = f"{found.stated_rate_hz:.4g}"
        table.add_row(
            found.sensor,
            rate if rate == stated else f"{rate} (stated {stated})",
            f"{found.rows}",
            _number(found.resolution),
            f"{_number(found.noise) or '?'} ({_number(found.stated_noise) or '-'})",
            SENSORS[found.sensor].unit.replace("_", "/"),
            _rows(found),
        )
    return table


def _rows(found: SensorCheck) -> str:
    """Return what is not as it should be about a sensor's rows."""
    counts = {"held": found.held, "late": found.late, "lost": found.lost, "twice": found.doubled}
    said = [f"{count} {name}" for name, count in counts.items() if count]
    said += [f"{found.gaps} empty cells"] if found.gaps else []
    said += [f"{100 * found.clipped_share:.3g} % clipped"] if found.clipped_share else []
    # stamps of a rule tell no lateness
    even = "exactly even" if found.even else "even"
    return ", ".join(said) or even


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2g}"
