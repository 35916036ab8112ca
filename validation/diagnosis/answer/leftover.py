"""What is left of a sensor in one recording: by the baseline, by effects with the others' numbers, by no physics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from discsim.validation.diagnosis.answer.checked import plain

__all__ = ["Leftover"]


@dataclass(frozen=True)
class Leftover:
    """Root mean squares of an axis of a sensor in one recording, in its unit.

    ``baseline`` is what the baseline leaves, ``left`` what the effects leave with the others' numbers, ``pure`` what a
    motion so flexible that it knows no physics leaves of the same rows; None where that is not known.
    """

    recording: str
    sensor: str
    baseline: float
    left: float
    pure: float | None

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "sensor": self.sensor,
            "baseline_rms": plain(self.baseline),
            "left_rms": plain(self.left),
            "pure_error_rms": None if self.pure is None else plain(self.pure),
        }
