"""Whether a rate reference can be the truth of the sensors beside it: its clock, its unit, its sign, its time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.recording import Recording, Samples
from discsim.validation.estimating.scored import multiple_of
from discsim.validation.scenarios.rate_table import papers_rates

__all__ = ["rates_beside_reference", "reference_notes"]

#: sensors that show a spin
_SHOWING = ("magnetometer", "accelerometer", "gyroscope")
#: what sensors read of a reference in another unit than rad/s
_UNITS: Mapping[float, str] = MappingProxyType(
    {np.pi / 180.0: "deg/s", np.pi / 30.0: "rpm", 2.0 * np.pi: "turns per second"}
)
#: a reference that lasts so many times as long as the sensors, or as short, has another unit of time
_LONGER = 100.0
#: lags that are tried, s, and the step between them: a tenth of the paper's window
_LAGS, _STEP = 10.0, 0.128
#: a lag is told where it leaves less than this share of the rms without it, and is longer than a window: the methods'
#: own delays are shorter, and a reference that is off by a share or a constant keeps most of its rms at any lag
_LEFT, _SHORTEST = 0.2, 0.5
#: values by which a lag is looked for
_VALUES = 4000


def rates_beside_reference(recording: Recording, profile: Samples) -> dict[str, YawRate]:
    """Return the rates that a recording's sensors give by the paper's methods, whose truth its reference can be.

    ``profile`` is the reference, t (n,) s and rate (n,) rad/s. Raises `InputError` where the recording shows no spin,
    or the reference has another unit of time or of rate.
    """
    where = recording.path or recording.name
    ends = [float(recording.need(name).t[-1]) for name in _SHOWING if name in recording]
    if not ends:
        shown = ", ".join(_SHOWING)
        raise InputError(f"{where}: no sensor that shows a spin beside its rate reference; expected some of {shown}")
    lasts, shorter = float(profile.t[-1]), max(ends)
    if not 1.0 / _LONGER < lasts / max(shorter, 1e-9) < _LONGER:
        raise InputError(
            f"{where}: rate_reference.csv ends at {lasts:.6g} s, the sensors at {shorter:.6g} s; expected one clock, "
            "in seconds (are the times of one of them milliseconds?)"
        )
    rates = papers_rates(recording)
    beside = dict(_beside(rates, profile))
    units = {name: _UNITS.get(multiple_of(*both) or 0.0) for name, both in beside.items()}
    saying = [name for name, unit in units.items() if unit is not None]
    if saying and not any(_agree(*both) for both in beside.values()):
        raise InputError(
            f"{where}: rate_reference.csv is in {units[saying[0]]}, by {', '.join(saying)}; expected rad/s under the "
            "name rate_rad_s"
        )
    return rates


def reference_notes(rates: Mapping[str, YawRate], profile: Samples) -> list[str]:
    """Return what looks wrong in a reference beside rates that sensors gave: a sign, or another zero of its time."""
    if not (beside := dict(_beside(rates, profile))):
        return []
    turned = [name for name, both in beside.items() if multiple_of(*both) == -1.0]
    if turned:
        return [f"the rate reference has the other sign than {', '.join(turned)}; turn one of them round"]
    lags = {name: _lag(rates[name], profile) for name in beside}
    best = min(lags, key=lambda name: lags[name][1])
    lag, left = lags[best]
    if abs(lag) < _SHORTEST or left > _LEFT:
        return []
    way = "late" if lag > 0 else "early"
    return [
        f"the rate reference is {abs(lag):.2f} s {way} beside {best}: with its times so corrected {100 * left:.0f} % "
        "of the rms error is left; put both on one clock"
    ]


def _beside(rates: Mapping[str, YawRate], profile: Samples) -> Iterator[tuple[str, tuple[FloatArray, FloatArray]]]:
    """Yield each rate that is known with the reference at its times, both as magnitudes where it has no sign."""
    for name, rate in rates.items():
        inside = np.isfinite(rate.rate) & (rate.t >= profile.t[0]) & (rate.t <= profile.t[-1])
        told = np.interp(rate.t[inside], profile.t, profile.value)
        if inside.any():
            yield name, (rate.rate[inside], told) if rate.signed else (np.abs(rate.rate[inside]), np.abs(told))


def _agree(read: FloatArray, told: FloatArray) -> bool:
    """Tell whether two rates (n,) are alike to a tenth, as by a crooked mount or a scale that is off."""
    return abs(float(read @ told) - float(told @ told)) < 0.1 * float(told @ told)


def _lag(rate: YawRate, profile: Samples) -> tuple[float, float]:
    """Return by how much a reference is late (s), and the share of the rms that is left with it so corrected."""
    known = np.flatnonzero(np.isfinite(rate.rate))
    known = known[:: max(1, known.size // _VALUES)]
    t, read = rate.t[known], rate.rate[known]
    lags = np.arange(-_LAGS, _LAGS + _STEP / 2, _STEP)

    def errs(lag: float) -> float:
        told = np.interp(t + lag, profile.t, profile.value)
        return float(np.sqrt(np.mean((read - (told if rate.signed else np.abs(told))) ** 2)))

    rms = np.array([errs(lag) for lag in lags])
    fine = lags[int(np.argmin(rms))] + np.linspace(-_STEP, _STEP, 33)
    best = min(fine.tolist(), key=errs)
    return best, errs(best) / max(errs(0.0), 1e-12)
