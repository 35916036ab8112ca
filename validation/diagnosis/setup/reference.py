"""Whether a rate reference, or a command, can be the truth of the sensors beside it: its unit, sign, clock and time.

Every other relation of a rig starts from it, so a mistake there reads as a mistake of each sensor: a reversed encoder
as three sensors with mixed-up axes. It is asked first, by the rates that the sensors show themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray
from discsim.limits import time_fault
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.setup.spin_signals import FEWEST, spin_signals, usable
from discsim.validation.identification.plants import plant_of

__all__ = ["ReferenceDoubt", "reference_doubts"]

#: what sensors show of a rate that is told in another unit than rad/s
_UNITS: Mapping[float, str] = MappingProxyType(
    {np.pi / 180.0: "deg/s", np.pi / 30.0: "rpm", 2.0 * np.pi: "turns per second"}
)
#: a rate is such a multiple within this share of it: scales and crooked mounts are off by some per cent, an
#: accelerometer's place by some mm, and the nearest units (rpm and deg/s) by a factor of six
_NEAR = 0.15
#: what is told that lasts so many times as long as the sensors, or as short, has another unit of time
_LONGER = 100.0
#: lags that are tried, s, and the step between them
_LAGS, _STEP = 10.0, 0.05
#: a lag is told from this on, s, where it leaves less than this share of the rms without it in each of two sensors or
#: more, whose lags are this alike, s: one sensor alone may itself be late
_SHORTEST, _LEFT, _ALIKE = 0.1, 0.25, 0.03
#: readings by which a lag is looked for
_VALUES = 4000
#: pull towards the axis from which an accelerometer shows a rate, m/s^2; gravity that tells which way up a board is
_PULL, _UPRIGHT = 5.0, 5.0


@dataclass(frozen=True)
class ReferenceDoubt:
    """What cannot be true of a file of rates: its ``kind`` (units, clock, sign, late), and parts of a sentence."""

    kind: str
    file: str
    what: str
    expected: str
    remedy: str

    @property
    def sentence(self) -> str:
        """The doubt in one line."""
        return f"{self.file} {self.what}; expected {self.expected}; {self.remedy}"


@dataclass(frozen=True)
class _Shown:
    """A rate that a sensor shows: times (n,) s, rates (n,) rad/s, whether their sign is known."""

    t: FloatArray
    rate: FloatArray
    signed: bool

    def beside(self, told: Samples) -> tuple[FloatArray, FloatArray]:
        """Return the rates (m,) while something was told, and what was told then (m,)."""
        inside = (self.t >= told.t[0]) & (self.t <= told.t[-1])
        return self.rate[inside], np.interp(self.t[inside], told.t, told.value)


def reference_doubts(recording: Recording) -> Iterator[ReferenceDoubt]:
    """Yield what is wrong with a recording's rate reference, or with its command where it has none: at most one thing.

    A unit is told by any sensor of which no other disagrees, a sign by all of a rig that lies upright, a lag by two.
    Nothing is told where times are none.
    """
    if any(len(one) and time_fault(one.t) is not None for one in recording.samples.values()):
        return
    samples = recording.get("rate_reference")
    file = "command.csv" if samples is None else "rate_reference.csv"
    told = _known(samples if samples is not None else recording.command)
    if told is None:
        return
    ends = [float(one.t[-1]) for name, one in recording.samples.items() if name != "rate_reference" and len(one)]
    if not ends:
        return
    lasts, others = float(told.t[-1]), max(ends)
    if samples is not None and not 1.0 / _LONGER < lasts / max(others, 1e-9) < _LONGER:
        what = f"ends at {lasts:.6g} s, the sensors at {others:.6g} s"
        yield ReferenceDoubt("clock", file, what, "one clock, in seconds", "are the times of one of them milliseconds?")
        return
    shown = _shown(recording)
    doubt = _unit(file, shown, told) or _sign(file, recording, shown, told) or _late(file, recording, shown, told)
    if doubt is not None:
        yield doubt


def _known(samples: Samples | None) -> Samples | None:
    """Return the readings that were taken; None where there are too few, or nothing turns by them."""
    if samples is None:
        return None
    known = np.isfinite(samples.value)
    if np.count_nonzero(known) < 2 or not np.any(samples.value[known]):
        return None
    return Samples(samples.t[known], samples.value[known])


def _shown(recording: Recording) -> dict[str, _Shown]:
    """Return the rates that sensors show by themselves, each while it does not clip."""
    shown: dict[str, _Shown] = {}
    signals = spin_signals(recording) if "magnetometer" in recording else None
    if signals is not None and signals.measured:
        shown["magnetometer"] = _Shown(signals.grid, signals.rate, signed=True)
    if (found := usable(recording, "gyroscope")) is not None:
        shown["gyroscope"] = _Shown(found[0], found[1][:, 2], signed=True)
    place = recording.sheets["accelerometer"].position if "accelerometer" in recording else None
    arm = 0.0 if place is None else float(np.hypot(place[0], place[1]))
    if arm > 0.0 and (found := usable(recording, "accelerometer")) is not None:
        pull = np.hypot(found[1][:, 0], found[1][:, 1])
        shown["accelerometer"] = _Shown(found[0], np.sqrt(np.where(pull > _PULL, pull, np.nan) / arm), signed=False)
    alive = {name: np.isfinite(one.rate) for name, one in shown.items()}
    return {
        name: _Shown(one.t[alive[name]], one.rate[alive[name]], one.signed)
        for name, one in shown.items()
        if np.count_nonzero(alive[name]) >= FEWEST
    }


def _all(names: Iterable[str]) -> str:
    """Return names as a sentence lists them."""
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last


def _multiple(read: FloatArray, told: FloatArray, multiples: Sequence[float]) -> float | None:
    """Return which of some multiples of what was told (n,) a sensor read (n,); None for none of them."""
    square = float(told @ told)
    if not square > 0.0:
        return None
    for multiple in multiples:
        rest = read / multiple - told
        if abs(float(read @ told) / (multiple * square) - 1.0) < _NEAR and float(rest @ rest) < _NEAR * square:
            return multiple
    return None


def _unit(file: str, shown: Mapping[str, _Shown], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told in another unit, where some sensor says so and none that it is rad/s."""
    sizes = {name: [np.abs(side) for side in one.beside(told)] for name, one in shown.items()}
    multiples = {name: _multiple(read, said, (1.0, *_UNITS)) for name, (read, said) in sizes.items()}
    saying = [name for name, multiple in multiples.items() if multiple in _UNITS]
    if not saying or 1.0 in multiples.values():
        return None
    factor = multiples[saying[0]]
    assert factor is not None
    what = f"is in {_UNITS[factor]}, by {_all(saying)}"
    return ReferenceDoubt("units", file, what, "rad/s under the name rate_rad_s", f"multiply its rates by {factor:.6g}")


def _sign(file: str, recording: Recording, shown: Mapping[str, _Shown], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told with the other sign, where a rig lies upright and every sensor with a sign says so.

    A board upside down turns the other way, too: its accelerometer tells.
    """
    force = recording.get("accelerometer")
    if plant_of(recording).airborne or force is None or len(force) == 0:
        return None
    if not np.nanmedian(force.value[:, 2]) < -_UPRIGHT:
        return None
    signed = {name: _multiple(*one.beside(told), (1.0, -1.0)) for name, one in shown.items() if one.signed}
    if len(signed) < 2 or any(multiple != -1.0 for multiple in signed.values()):
        return None
    what = f"turns the other way than {_all(signed)}, and the accelerometer shows the board the right way up"
    return ReferenceDoubt(
        "sign", file, what, "rates positive about the body's z axis, which points down", "turn the sign of its rates"
    )


def _late(file: str, recording: Recording, shown: Mapping[str, _Shown], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told late or early beside two sensors, on a rig whose rate does not just run down.

    Where it runs down by a share of itself a second, late is no other than a scale.
    """
    if plant_of(recording).airborne or not plant_of(recording).commanded or file == "command.csv":
        return None
    # a place that is off reads as a scale, which moves the lag of an accelerometer by a tenth of a second
    lags = {name: lag for name, one in shown.items() if one.signed and (lag := _lag(one, told)) is not None}
    if len(lags) < 2 or float(np.ptp(list(lags.values()))) > _ALIKE:
        return None
    lag = float(np.mean(list(lags.values())))
    what = f"is {abs(lag):.2f} s {'late' if lag > 0 else 'early'} beside {_all(lags)}"
    remedy = f"subtract {lag:.3f} s from its times" if lag > 0 else f"add {-lag:.3f} s to its times"
    return ReferenceDoubt("late", file, what, "one clock", remedy)


def _lag(one: _Shown, told: Samples) -> float | None:
    """Return by how much what is told is late beside a sensor, s; None where no lag makes them agree."""
    few = slice(None, None, max(1, one.t.size // _VALUES))
    t, read = one.t[few], one.rate[few]

    def rms(lag: float) -> float:
        return float(np.sqrt(np.mean((read - np.interp(t + lag, told.t, told.value)) ** 2)))

    coarse = np.arange(-_LAGS, _LAGS + _STEP / 2.0, _STEP)
    near = coarse[int(np.argmin([rms(lag) for lag in coarse]))]
    lag = min((near + np.linspace(-_STEP, _STEP, 41)).tolist(), key=rms)
    return lag if abs(lag) > _SHORTEST and rms(lag) < _LEFT * rms(0.0) else None
