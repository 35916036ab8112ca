"""One thing that is wrong, or worth knowing, about a recording."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Literal

__all__ = ["SEVERITIES", "Finding", "Severity", "doubts_of"]

#: an error makes results wrong, a warning may, a note does not
Severity = Literal["error", "warning", "note"]
SEVERITIES: tuple[Severity, ...] = ("error", "warning", "note")


@dataclass(frozen=True)
class Finding:
    """What was found, where, what was expected, and what to do.

    Attributes
    ----------
    id : str
        A short name that stays the same from recording to recording (``disc.mass``).
    severity : str
        `Severity`.
    where : str
        A sensor, or a table of ``recording.toml``.
    what, expected, remedy : str
        Parts of a sentence; ``expected`` and ``remedy`` may be empty.
    """

    id: str
    severity: Severity
    where: str
    what: str
    expected: str = ""
    remedy: str = ""

    @property
    def sentence(self) -> str:
        """The finding in one line."""
        expected = f"; expected {self.expected}" if self.expected else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{self.where}: {self.what}{expected}{remedy}"

    def to_json(self) -> dict[str, str]:
        """Return the JSON object."""
        return {**asdict(self), "sentence": self.sentence}


def doubts_of(findings: Iterable[Finding]) -> list[str]:
    """Return the sentences of findings that are more than notes: what makes results wrong, or may."""
    return [finding.sentence for finding in findings if finding.severity != "note"]
