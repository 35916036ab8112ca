"""Scores: a figure, what it should be, how far it may be off, and whether it is; as a table, JSON and JUnit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from xml.etree import ElementTree

from discsim.errors import printable
from discsim.files import write_bytes

__all__ = ["Score", "at_most", "score", "write_junit"]


@dataclass(frozen=True)
class Score:
    """One figure of a validation run; ok where it lies within ``tolerance`` of ``expected``."""

    name: str
    value: float
    unit: str
    expected: float
    tolerance: float
    ok: bool

    def as_dict(self) -> dict[str, object]:
        """Return the entry of ``scores.json``."""
        return asdict(self)

    @property
    def goal(self) -> str:
        """What is asked of the value, one-sided where it can only be off to one side."""
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        if self.expected == 0.0 and self.value >= 0.0:
            return f"<= {self.tolerance:g}{unit}"
        if self.expected == 1.0 and self.unit in ("", "1") and self.value <= 1.0:
            return f">= {self.expected - self.tolerance:g}"
        return f"{self.expected:g} ± {self.tolerance:g}{unit}"

    @property
    def shown(self) -> str:
        """The value with its unit, where it has one, for a table."""
        return f"{self.value:.5g}" if self.unit in ("", "1") else f"{self.value:.5g} {self.unit}"

    @property
    def text(self) -> str:
        """One line for a log."""
        verdict = "ok  " if self.ok else "FAIL"
        value = f"{self.value:.6g}" + ("" if self.unit in ("", "1") else f" {self.unit}")
        return printable(f"{verdict} {self.name}: {value} (expected {self.goal})".replace("±", "+-"))


def score(name: str, value: float, unit: str, expected: float, tolerance: float) -> Score:
    """Return a score that is ok where |value - expected| <= tolerance; NaN never is."""
    return Score(name, float(value), unit, float(expected), float(tolerance), bool(abs(value - expected) <= tolerance))


def at_most(name: str, value: float, unit: str, limit: float) -> Score:
    """Return a score of an error that should be zero and may reach ``limit``."""
    return score(name, value, unit, 0.0, limit)


def write_junit(path: Path, scores: Sequence[Score], duration_s: float, *, suite: str = "discsim validate") -> None:
    """Write the scores as a JUnit XML file: one test case each, a failure where one is outside tolerance."""
    failures = sum(not item.ok for item in scores)
    tests = ElementTree.Element(
        "testsuite",
        name=suite,
        tests=str(len(scores)),
        failures=str(failures),
        errors="0",
        skipped="0",
        time=f"{duration_s:.3f}",
    )
    for item in scores:
        group, _, name = printable(item.name).partition(": ")
        case = ElementTree.SubElement(tests, "testcase", classname=f"discsim.{group}", name=name or group, time="0")
        if not item.ok:
            failure = ElementTree.SubElement(case, "failure", message=item.text, type="OutsideTolerance")
            failure.text = item.text
        ElementTree.SubElement(case, "system-out").text = item.text
    root = ElementTree.Element("testsuites", tests=str(len(scores)), failures=str(failures))
    root.append(tests)
    ElementTree.indent(root)
    write_bytes(path, ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
