"""What a recording's sensors observed, in the form that a fit takes: usable readings, noise, limits."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.recording import SENSORS, Recording
from validation.identification.clipping import plateau
from validation.identification.initial.flight import spin_starts

__all__ = ["Readings", "group_of", "readings_of"]

#: a table turns a corner of its command within some of the time constants of its speed loop, s
CORNER = 4e-3


@dataclass(frozen=True)
class Readings:
    """The usable readings of one sensor of a recording.

    t (n,) written times; value (n, k); good (n, k) tells which readings count; sd (k,) the stated noise with rounding
    (NaN where nothing is stated); clipped (n, k) stand at the limit, which is the range unless readings stand still
    below it.
    """

    sensor: str
    t: FloatArray
    value: FloatArray
    good: BoolArray
    clipped: BoolArray
    sd: FloatArray
    axes: tuple[str, ...]
    #: the range that clips them, as stated or lower; None where there is none
    limit: float | None = None
    #: written times and weights (w, n) of the samples that each reading is a mean of; None where it is one sample
    taken: FloatArray | None = None
    weights: FloatArray | None = None

    def at(self, chosen: BoolArray) -> Readings:
        """Return some of the readings, ``chosen`` (n,)."""
        return replace(
            self,
            t=self.t[chosen],
            value=self.value[chosen],
            good=self.good[chosen],
            clipped=self.clipped[chosen],
            taken=None if self.taken is None else self.taken[:, chosen],
            weights=None if self.weights is None else self.weights[:, chosen],
        )


def readings_of(recording: Recording) -> tuple[Readings, ...]:
    """Return the usable readings of all sensors: gaps, and readings that stand at a limit, take no part."""
    found = []
    for sensor in SENSORS:
        samples = recording.get(sensor)
        if samples is None or len(samples) == 0:
            continue
        sheet = recording.sheets[sensor]
        measured = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        if sensor == "gps":
            sd = np.repeat([_or_nan(sheet.noise_rms or None), _or_nan(sheet.velocity_noise_rms or None)], 3)
            clipped, limit = np.zeros(measured.shape, dtype=np.bool_), None
        else:
            level = np.hypot(_or_nan(sheet.noise_rms), (sheet.resolution or 0.0) / np.sqrt(12.0))
            # a noise of zero is none: nobody knows it
            sd = np.full(measured.shape[1], level if level > 0.0 else np.nan)
            clipped, limit = sheet.clipped(measured), sheet.range
            lower = plateau(recording) if sensor == "accelerometer" else None
            if lower is not None:
                clipped, limit = np.abs(measured) >= lower - 1e-9 * lower, lower
        good = np.isfinite(measured) & ~clipped
        if sensor == "accelerometer" and recording.plant == "rate_table" and recording.command is not None:
            # there a real table's angular acceleration is neither that before the knot nor that after it
            apart = np.abs(samples.t[:, None] - recording.command.t[None, :])
            good &= np.min(apart, axis=1, initial=np.inf)[:, None] > CORNER
        axes = tuple(SENSORS[sensor].columns)
        t, m = samples.t, measured
        one = Readings(sensor, t, m, good, clipped, sd, axes, limit)
        if recording.plant == "free_spin" and sensor == "accelerometer":
            found += _over_turns(recording, one)
        else:
            found.append(one)
    return tuple(found)


#: a reading of a turn's mean is a mean over this many turns, weighted as if a turn's mean were taken three times: what
#: turns once per turn is not seen, nor its slope, nor its curvature
_TURNS = 3.0


def _over_turns(recording: Recording, one: Readings) -> list[Readings]:
    """Return the means over turns of an accelerometer on a disc whose path is unknown.

    Translation and gravity turn with the spin and average out; what remains of x and y is centripetal.
    """
    grid = np.linspace(0.0, recording.end, max(int(recording.end / 0.05), 2))
    rate = spin_starts(recording, grid).rate[:, 2]
    phase = np.interp(one.t, grid, np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(grid))]))
    phase = np.abs(phase) / (2.0 * np.pi)
    centres = np.arange(phase[0] + _TURNS / 2, phase[-1] - _TURNS / 2, _TURNS / 2)
    first, last = np.searchsorted(phase, centres - _TURNS / 2), np.searchsorted(phase, centres + _TURNS / 2)
    if centres.size < 4 or np.any(np.diff(phase) < 0) or np.min(last - first) < 8:
        return []
    width = int(np.max(last - first))
    place = np.minimum(first[None, :] + np.arange(width)[:, None], one.t.size - 1)
    inside = np.arange(width)[:, None] < (last - first)[None, :]
    usable = np.all(one.good[:, :2], axis=1)
    off = np.abs(phase[place] - centres)
    bell = np.where(off < 0.5, 0.75 - off**2, 0.5 * np.maximum(_TURNS / 2 - off, 0.0) ** 2)
    weights = np.where(inside & usable[place], bell, 0.0)
    # where samples are missing, what turns with the spin does not average out
    whole = np.sum(inside & ~usable[place], axis=0) == 0
    weights = weights / np.maximum(np.sum(weights, axis=0), 1e-12)
    values = np.einsum("wn,wnk->nk", weights, np.nan_to_num(one.value)[place])
    good = np.repeat(whole[:, None], 3, axis=1)
    good[:, 2] = False
    t = np.einsum("wn,wn->n", weights, one.t[place])
    sd = one.sd * float(np.sqrt(np.median(np.sum(weights**2, axis=0))))
    clipped = np.zeros(values.shape, dtype=np.bool_)
    return [Readings(one.sensor, t, values, good, clipped, sd, one.axes, None, one.t[place], weights)]


def _or_nan(number: float | None) -> float:
    return np.nan if number is None else number


def group_of(sensor: str, axis: int) -> str:
    """Return the name under which an axis shares its noise with others."""
    if sensor == "gps":
        return "gps.position" if axis < 3 else "gps.velocity"
    return sensor
