"""The spin rates that sensors show by themselves, beside a rate that is told: a reference's, or a command's.

Takes a recording; gives a rate of each sensor that shows one, and by what factor, and how surely, it is another than
the rate that is told.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, sd_by_median
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import PositionOffset, Scale
from discsim.errors import InputError
from discsim.estimators.tracking import tracking
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.signals.spin_signals import FEWEST, spin_signals, usable
from discsim.validation.identification.ordinary_errors import ordinary_errors

__all__ = ["FEWEST_SLOTS", "ORDINARY", "Multiple", "ShownRate", "shown_rates"]

#: ordinary errors by which an accelerometer's pull tells a rate wrongly
_PLACE, _SCALE = catalogued(PositionOffset).id, catalogued(Scale, "accelerometer").id
#: pull towards the axis from which an accelerometer shows a rate, m/s^2
_PULL = 5.0
#: how much of a run a magnetometer is followed through where the place's field is not stated, s
_FOLLOWED = 60.0
#: rates are compared by their means over so many s: five turns at 20 rad/s, and an encoder's steps average out
_SLOT = 0.25
#: fewest of these, and the share of the largest rate from which they count: a slow table shows an offset, not a factor
FEWEST_SLOTS, _QUARTER = 8, 0.25
#: a sensor shows a factor where its ratio scatters by no more than a third of what the factor is off one
_STEADY = 1.0 / 3.0
#: standard deviations from which a difference is one: chance makes it once in 370
_SIGMAS = 3.0
#: what a ratio may be off one without a word: above a gyroscope's scale (3 % over parts and temperature, as in
#: discsim.estimators.methods) and the readings that a magnetometer loses unnoticed (5 %)
ORDINARY = 0.05


@dataclass(frozen=True)
class Multiple:
    """What a sensor shows over what is told: the factor, what it may ordinarily be off, and whether it is constant.

    ``tolerance`` is a share: the sensor's ordinary error, or three standard deviations of the factor where noise makes
    that more.
    """

    factor: float
    tolerance: float
    constant: bool

    def is_near(self, factor: float) -> bool:
        """Tell whether the sensor may show such a factor, within its tolerance."""
        return abs(float(np.log(self.factor / factor))) <= self.tolerance


@dataclass(frozen=True)
class ShownRate:
    """A rate that a sensor shows: times (n,) s, rates (n,) rad/s, whether their sign is known, and its own errors.

    ``ordinary`` is what the sensor's rate may be off as a share; ``limit`` the rate above which it shows another one.
    """

    t: FloatArray
    rate: FloatArray
    signed: bool
    ordinary: float = ORDINARY
    limit: float = np.inf

    def beside(self, told: Samples) -> tuple[FloatArray, FloatArray]:
        """Return the rates (m,) while something was told, and what was told then (m,)."""
        inside = (self.t >= told.t[0]) & (self.t <= told.t[-1])
        return self.rate[inside], np.interp(self.t[inside], told.t, told.value)

    def slots(self) -> tuple[FloatArray, FloatArray]:
        """Return the mean times (k,) s and the mean sizes (k,) of the rate over slots of time."""
        return _over_slots(self.t, self.t, np.abs(self.rate))

    def means(self, told: Samples) -> tuple[FloatArray, FloatArray]:
        """Return the means (k,) of the sizes of both over slots of time, each while both are there."""
        inside = (self.t >= told.t[0]) & (self.t <= told.t[-1])
        read, said = self.beside(told)
        return _over_slots(self.t[inside], np.abs(read), np.abs(said))

    def multiple(self, told: Samples) -> Multiple | None:
        """Return by what factor the rate that is shown is another than the one told; None where too little turns."""
        read, said = self.means(told)
        fast = said > _QUARTER * np.max(said, initial=0.0)
        if np.count_nonzero(fast) < FEWEST_SLOTS:
            return None
        ratios = read[fast] / said[fast]
        factor = float(np.median(ratios))
        if not factor > 0.0 or float(np.max(read[fast])) > self.limit:
            return None
        scatter = float(sd_by_median(ratios - factor))
        # of a median, whose variance is pi / 2 of a mean's
        sd = float(np.sqrt(np.pi / 2.0 / ratios.size)) * scatter / factor
        return Multiple(factor, max(self.ordinary, _SIGMAS * sd), scatter <= _STEADY * abs(factor - 1.0))


def _over_slots(t: FloatArray, one: FloatArray, other: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the means (k,) of two series (n,) at times t (n,) s over slots of time."""
    _, place, count = np.unique(np.floor(t / _SLOT), return_inverse=True, return_counts=True)
    return np.bincount(place, one) / count, np.bincount(place, other) / count


def shown_rates(recording: Recording) -> dict[str, ShownRate]:
    """Return the rates that sensors show by themselves, each while it does not clip; what needs no scale first."""
    shown: dict[str, ShownRate] = {}
    if (turning := _turning_field(recording)) is not None:
        shown["magnetometer"] = turning
    if (found := usable(recording, "gyroscope")) is not None and _turns_about_z(recording.samples["gyroscope"].value):
        shown["gyroscope"] = ShownRate(found[0], found[1][:, 2], signed=True)
    place = recording.sheets["accelerometer"].position if "accelerometer" in recording else None
    arm = 0.0 if place is None else float(np.hypot(place[0], place[1]))
    if arm > 0.0 and (found := usable(recording, "accelerometer")) is not None:
        pull = np.hypot(found[1][:, 0], found[1][:, 1])
        rate = np.sqrt(np.where(pull > _PULL, pull, np.nan) / arm)
        shown["accelerometer"] = ShownRate(found[0], rate, signed=False, ordinary=_off_its_place(arm))
    alive = {name: np.isfinite(one.rate) for name, one in shown.items()}
    return {
        name: replace(one, t=one.t[alive[name]], rate=one.rate[alive[name]])
        for name, one in shown.items()
        if np.count_nonzero(alive[name]) >= FEWEST
    }


def _turns_about_z(rate: FloatArray) -> bool:
    """Tell whether the spin is about a gyroscope's z (n, 3); of a board that lies on its side z shows a share of it.

    Such a share, of 1/57 by chance, was taken for a reference in deg/s.
    """
    size = [float(np.median(one[np.isfinite(one)])) if np.isfinite(one).any() else 0.0 for one in np.abs(rate).T]
    return size[2] >= max(size)


def _turning_field(recording: Recording) -> ShownRate | None:
    """Return the rate at which the field turns; where the place's is not stated, by the readings' own circle."""
    field = recording.get("magnetometer")
    if field is None or len(field) < FEWEST:
        return None
    # half the sampling rate, less what the phase is smoothed over
    limit = 0.9 * np.pi / field.interval
    if recording.environment.field_known:
        # the field turns by itself; a command whose times are none would be summed over weeks
        signals = spin_signals(replace(recording, command=None))
        known = signals is not None and signals.measured
        return ShownRate(signals.grid, signals.rate, signed=True, limit=limit) if signals and known else None
    own = {"magnetometer": _most_turning(field)}
    try:
        found = tracking(replace(recording, samples=own))
    except InputError:
        return None
    return ShownRate(found.t, found.rate, signed=True, limit=limit)


def _most_turning(field: Samples) -> Samples:
    """Return the stretch of a field, `_FOLLOWED` s long, in which it changes most; all of a shorter one."""
    if field.t[-1] - field.t[0] <= _FOLLOWED:
        return field
    changes = np.concatenate([[0.0], np.cumsum(np.nansum(np.diff(field.value, axis=0) ** 2, axis=1))])
    ends = np.searchsorted(field.t, field.t + _FOLLOWED, side="right") - 1
    first = int(np.argmax(changes[ends] - changes))
    return field.between(float(field.t[first]), float(field.t[ends[first]]))


def _off_its_place(arm: float) -> float:
    """Return what an accelerometer's rate may be off as a share, for its place and its scale, at ``arm`` m.

    A rate goes with the square root of either.
    """
    sigmas: Mapping[tuple[str, str], float] = {
        (error.effect, error.name): error.sigma for error in ordinary_errors("relaxed fit")
    }
    place, scale = sigmas[_PLACE, "dx_m"] / arm, sigmas[_SCALE, "sx"]
    return _SIGMAS * 0.5 * float(np.hypot(place, scale))
