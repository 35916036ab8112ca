"""What an answer measures: places of the mismatch, noise, the fit before and after, recordings held out, outliers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from discsim.validation.diagnosis.answer.checked import Told, finite, not_negative, plain

__all__ = ["FitFigures", "HeldOut", "Located", "NoiseNote", "Outlier"]


@dataclass(frozen=True)
class Located:
    """A place where the recordings part from the baseline.

    ``recording``, ``sensor`` and ``axis`` may be "all"; the axis is a column of the sensor's file. The times are
    seconds of the recording; ``share_of_excess`` (0 to 1) is its part of the excess of chi2 over its expectation;
    ``grows_with`` names the state that the mismatch grows with, where there is one.
    """

    recording: str
    sensor: str
    axis: str
    from_s: float
    to_s: float
    share_of_excess: float
    text: str
    grows_with: str | None = None

    def __post_init__(self) -> None:
        finite("located", from_s=self.from_s, to_s=self.to_s)
        if self.to_s < self.from_s:
            raise ValueError(f"located: from {self.from_s:g} to {self.to_s:g} s; expected ascending times")
        if not 0.0 <= self.share_of_excess <= 1.0:
            raise ValueError(f"located: share_of_excess is {self.share_of_excess:g}, expected 0 to 1")

    def covers(self, recording: str, sensor: str, axis: str) -> bool:
        """Tell whether this place is on the named recording, sensor and axis."""
        named = ((self.recording, recording), (self.sensor, sensor), (self.axis, axis))
        return all(mine in ("all", other) for mine, other in named)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "sensor": self.sensor,
            "axis": self.axis,
            "from_s": plain(self.from_s),
            "to_s": plain(self.to_s),
            "share_of_excess": plain(self.share_of_excess),
            "grows_with": self.grows_with,
            "text": self.text,
        }


@dataclass(frozen=True)
class NoiseNote(Told):
    """A sensor's noise as stated and as it is, in the sensor's unit; "gps.position" and "gps.velocity" are apart."""

    sensor: str
    stated_rms: float | None
    observed_rms: float
    correlation_s: float = 0.0

    def __post_init__(self) -> None:
        not_negative(
            f"noise of {self.sensor}",
            stated_rms=self.stated_rms,
            observed_rms=self.observed_rms,
            correlation_s=self.correlation_s,
        )


@dataclass(frozen=True)
class FitFigures(Told):
    """chi2 per scalar reading of a model, in the fit and on held-out recordings (None: nothing held out)."""

    chi2_per_sample: float
    heldout_chi2_per_sample: float | None

    def __post_init__(self) -> None:
        not_negative("fit", chi2_per_sample=self.chi2_per_sample, heldout=self.heldout_chi2_per_sample)


@dataclass(frozen=True)
class HeldOut:
    """One recording while it took no part: chi2 per scalar reading before and after, log likelihood gained.

    ``chosen`` are the effects that the other recordings choose; None where the choice saw all of them, as a law's does.
    """

    recording: str
    baseline: float
    final: float
    delta_log_likelihood: float
    chosen: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        not_negative(f"held out {self.recording}", baseline=self.baseline, final=self.final)
        finite(f"held out {self.recording}", delta_log_likelihood=self.delta_log_likelihood)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "baseline_chi2_per_sample": plain(self.baseline),
            "final_chi2_per_sample": plain(self.final),
            "delta_log_likelihood": plain(self.delta_log_likelihood),
            "chosen_by_others": None if self.chosen is None else list(self.chosen),
        }


@dataclass(frozen=True)
class Outlier(Told):
    """A reading that was weighed down: ``deviation`` is its residual in standard deviations of the noise."""

    recording: str
    sensor: str
    axis: str
    t_s: float
    deviation: float

    def __post_init__(self) -> None:
        finite("outlier", t_s=self.t_s, deviation=self.deviation)
