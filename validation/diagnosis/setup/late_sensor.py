"""A sensor whose clock differs from another's by a tenth of a second and more, as the spins that both show tell.

Files of a phone's export may each count from their own start, and two loggers were not set alike. Takes a recording;
gives which sensor is early or late against which. Shorter offsets are told by the phase (`.hypotheses`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, runs
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.setup.shown_rates import ORDINARY, ShownRate, shown_rates

__all__ = ["LEFT", "SHORTEST", "Lag", "LateSensor", "best_lag", "late_sensor"]

#: a lag is told from this on, s, where it leaves less than this share of the rms without it
SHORTEST, LEFT = 0.1, 0.25
#: lags are tried at which more than this share of the shorter of two spans, s, is seen together
_SHARED = 0.5
#: the step between lags that are tried, s, and how many readings are compared
_STEP, _VALUES = 0.05, 4000
#: blocks by which a lag's error is judged, as many as for a ratio of turns
_BLOCKS = 10
#: a lag that leaves less than so many times what the best one leaves is as likely: a profile that repeats has several
_ALIKE = 2.0
#: a rate that ranges over less than this share of its largest tells no lag: a scale would leave as much without one
_RANGES = ORDINARY / LEFT


class Lag(NamedTuple):
    """By how much a told rate is late beside a shown one, with its standard deviation, s.

    ``left`` and ``as_written`` are the rms of the difference with the lag and without it, rad/s, the latter with the
    likeliest factor between the two; ``alone`` tells that no other lag leaves nearly as little.
    """

    lag: float
    sd: float
    left: float
    as_written: float
    alone: bool

    @property
    def told(self) -> bool:
        """Whether it is a lag, and neither none nor a factor."""
        return abs(self.lag) > SHORTEST and self.left < LEFT * self.as_written


@dataclass(frozen=True)
class LateSensor:
    """A sensor whose times are ``late`` against another's, s (negative: early), with the standard deviation of that.

    ``left`` and ``as_written`` are what the two rates differ by (rms) as shares of the largest, moved and as they are;
    ``gain`` is twice the log likelihood of the offset. ``third`` is a sensor that bears it out; without one either of
    the two may be off. Unless ``alone`` another offset is as likely.
    """

    sensor: str
    against: str
    late: float
    sd: float
    left: float
    as_written: float
    gain: float
    third: str = ""
    alone: bool = True

    @property
    def what(self) -> str:
        """Which sensor is off against which, by how much, and how sure that is."""
        way = "late" if self.late > 0 else "early"
        return f"the {self.sensor}'s times are {self.text} s {way} against the {self.against}'s"

    @property
    def text(self) -> str:
        """The size of the offset with its standard deviation."""
        return f"{abs(self.late):.3f} +- {self.sd:.3f}"

    @property
    def why(self) -> str:
        """By what that is known."""
        said = (
            f"so moved the spins that both show differ by {100 * self.left:.1f} % of the largest (rms), as written by "
            f"{100 * self.as_written:.0f} %"
        )
        said += f", and the {self.third} bears it out" if self.third else f"; the {self.against} may be what is off"
        return said if self.alone else f"{said}; the spin repeats, and another offset is as likely"


def best_lag(one: ShownRate, told: Samples, lags: tuple[float, float]) -> Lag:
    """Return the lag from one to another of ``lags``, s, at which what is told leaves least beside what is shown."""
    few = slice(None, None, max(1, one.t.size // _VALUES))
    t, read = one.t[few], one.rate[few]

    def left(lag: float) -> FloatArray:
        return np.asarray(read - np.interp(t + lag, told.t, told.value))

    def rms(lag: float) -> float:
        return float(np.sqrt(np.mean(left(lag) ** 2)))

    coarse = np.arange(np.floor(lags[0] / _STEP), np.ceil(lags[1] / _STEP) + 1.0) * _STEP
    tried = np.array([rms(lag) for lag in coarse.tolist()])
    near = coarse[int(np.argmin(tried))]
    lag = min((near + np.linspace(-_STEP, _STEP, 41)).tolist(), key=rms)
    slope = (left(lag + _STEP) - left(lag - _STEP)) / (2.0 * _STEP)
    alone = len(runs(tried < _ALIKE * rms(lag))) <= 1
    said = np.interp(t, told.t, told.value)
    factor = float(read @ said) / max(float(said @ said), 1e-300)
    as_written = min(rms(0.0), float(np.sqrt(np.mean((read - factor * said) ** 2))))
    return Lag(lag, _sd(left(lag), slope), rms(lag), as_written, alone)


def _sd(left: FloatArray, slope: FloatArray) -> float:
    """Return the standard deviation of a lag by what is left (n,) and its slope over the lag, leaving out blocks."""
    products = np.array([float(block.sum()) for block in np.array_split(left * slope, _BLOCKS)])
    squares = np.array([float(block.sum()) for block in np.array_split(slope**2, _BLOCKS)])
    rest = np.sum(squares) - squares
    without = -(np.sum(products) - products) / np.where(rest > 0.0, rest, np.inf)
    return float(np.sqrt((_BLOCKS - 1) / _BLOCKS * np.sum((without - np.mean(without)) ** 2)))


def late_sensor(recording: Recording, shortest: float = SHORTEST) -> LateSensor | None:
    """Return the sensor whose times are off by more than ``shortest`` s; None where none is, or nothing tells.

    Magnetometer and accelerometer are held against the gyroscope, which shows every rate. Where both are off alike,
    it is the gyroscope. A rate that only runs down by a share of itself tells nothing: late is no other than a factor.
    """
    gyroscope = recording.get("gyroscope")
    if gyroscope is None or not ({"magnetometer", "accelerometer"} & set(recording.samples)):
        return None
    if _ranges(gyroscope.value[:, 2]) < _RANGES:
        return None
    shown = shown_rates(recording)
    if (known := shown.pop("gyroscope", None)) is None:
        return None
    lags = {name: lag for name, one in shown.items() if (lag := _beside(one, known)) is not None}
    off = {name: lag for name, lag in lags.items() if lag.told and abs(lag.lag) > shortest}
    if not off:
        return None
    name = next(name for name in ("magnetometer", "accelerometer") if name in off)
    found, largest = off[name], float(np.max(np.abs(known.rate)))
    slots = known.slots()[0].size
    told = LateSensor(
        name,
        "gyroscope",
        -found.lag,
        found.sd,
        found.left / largest,
        found.as_written / largest,
        2.0 * slots * float(np.log(found.as_written / max(found.left, 1e-300))),
        alone=found.alone,
    )
    other = next((one for one in lags if one != name), "")
    if not other:
        return told
    if other in off and abs(off[other].lag - found.lag) < SHORTEST:
        return replace(told, sensor="gyroscope", against=name, late=found.lag, third=other)
    return told if other in off else replace(told, third=other)


def _ranges(rate: FloatArray) -> float:
    """Return over which share of its largest a rate (n,) ranges, but for a hundredth of its readings at either end."""
    sizes = np.abs(rate[np.isfinite(rate)])
    if not sizes.size or not np.any(sizes):
        return 0.0
    low, high = np.quantile(sizes, (0.01, 0.99))
    return float((high - low) / max(high, 1e-300))


def _beside(one: ShownRate, known: ShownRate) -> Lag | None:
    """Return the lag of a gyroscope beside another sensor, whichever way that one lies; None of too short ones."""
    together = _SHARED * min(float(np.ptp(one.t)), float(np.ptp(known.t)))
    if together < SHORTEST:
        return None
    # what shows in a part alone may be late by more than that part
    lags = (float(known.t[0] - one.t[-1]) + together, float(known.t[-1] - one.t[0]) - together)
    told = Samples(known.t, known.rate)
    if not one.signed:
        return best_lag(one, Samples(known.t, np.abs(known.rate)), lags)
    return min((best_lag(each, told, lags) for each in (one, replace(one, rate=-one.rate))), key=lambda lag: lag.left)
