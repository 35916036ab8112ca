"""What a gyroscope says of how the magnetometer's field turns, by kinematics alone: no law of motion, no free body.

Takes a recording; gives iron, bias and lateness that reconcile the two, and what is left on the half that took no part.
In a field that stands still ``m(t2) - b = R (m(t1) - b)``, R the turn that the gyroscope's rates make between the two,
whatever hand, motor or air turns the body; b is what is magnetised with it (hard iron).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from discsim.arrays import BoolArray, FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import GyroscopeBias, HardIron
from discsim.effects.setup import TimeOffset
from discsim.recording import Recording
from discsim.validation.diagnosis.answer.named import ParameterValue
from discsim.validation.diagnosis.answer.partly import PartlyExplained

__all__ = ["TurnedField", "turned_field"]

#: a window holds a turn of so many rad at the usual rate, within so many s: iron shows by turning, drift by time
_TURN, _SHORTEST, _LONGEST = 2.0, 0.1, 3.0
#: windows that are compared, at most; and fewest that say anything
_WINDOWS, _FEWEST = 1500, 60
#: lateness that is tried first, s: up to the longest of a first setup
_LATE = np.arange(-0.06, 0.0601, 0.008)
#: blocks of time of which each is left out in turn, for standard deviations
_BLOCKS = 8
#: a number this many of its standard deviations from nothing is told; by chance one in 16 000
_SURE = 4.0
#: scales of the numbers fitted: uT, rad/s, s
_SCALE = np.array([*[10.0] * 3, *[0.02] * 3, 0.005])
_NAMES = (
    *((catalogued(HardIron).id, name) for name in HardIron._fields),
    *((catalogued(GyroscopeBias).id, name) for name in GyroscopeBias._fields),
    (catalogued(TimeOffset, "magnetometer").id, *TimeOffset._fields),
)


@dataclass(frozen=True)
class TurnedField:
    """What reconciles gyroscope and magnetometer.

    ``found`` are the effects whose size is sure; ``field`` is the field's size, ``before`` and ``after`` what windows
    leave as read and with all three, uT (medians), ``heldout`` the same of each half with the other's numbers.
    """

    found: tuple[PartlyExplained, ...]
    field: float
    before: float
    after: float
    heldout: tuple[tuple[float, float], ...]

    @property
    def holds(self) -> bool:
        """Whether each half is reconciled by what the other says: less than half of the squares is left."""
        return all(2.0 * after**2 <= before**2 for before, after in self.heldout)

    @property
    def text(self) -> str:
        """A sentence for the reader."""
        halves = " and ".join(f"{before:.2g} become {after:.2g} uT" for before, after in self.heldout)
        if self.holds:
            sizes = "; ".join(
                f"{one.id} "
                + ", ".join(f"{name} = {v.value:.3g} ± {v.sd or 0.0:.1g}" for name, v in one.parameters.items())
                for one in self.found
            )
            return (
                "Whatever turns the body, gyroscope and magnetometer agree on how it turns in a field of "
                f"{self.field:.0f} uT once these are allowed for: {sizes or 'nothing'}. With the numbers of the other "
                f"half of the log {halves} between two readings."
            )
        if self.before <= _AGREE * self.field:
            return (
                f"Whatever turns the body, gyroscope and magnetometer agree on how it turns: {self.before:.2g} uT of "
                f"{self.field:.0f} uT are left between two readings."
            )
        return (
            "Gyroscope and magnetometer do not turn as one rigid body in one still field does, whatever turns it: of "
            f"{self.field:.0f} uT {self.before:.2g} are left between two readings, and no constant iron, bias or "
            f"lateness holds (with the numbers of the other half of the log {halves}): the field around it changes, or "
            "columns and units are not what they say."
        )


#: two sensors agree where less than this share of the field is left
_AGREE = 0.05


def turned_field(recording: Recording) -> TurnedField | None:
    """Return what reconciles a recording's gyroscope and magnetometer; None where they do not show it.

    Rows at a range take no part, nor does a body that hardly turns.
    """
    windows = _windows(recording)
    if windows is None:
        return None
    half = windows.t < np.median(windows.t)
    x = windows.fit(np.ones(half.size, dtype=bool))
    sd = windows.spread(x)
    heldout = tuple((windows.left(np.zeros(7), some), windows.left(windows.fit(~some), some)) for some in (half, ~half))
    names = ("first half", "second half")
    squares = {name: (before**2, after**2) for name, (before, after) in zip(names, heldout, strict=True)}
    every = np.ones(half.size, dtype=bool)
    size = float(np.median(np.linalg.norm(windows.m - x[:3], axis=1)))
    return TurnedField(_sure(x, sd, squares), size, windows.left(np.zeros(7), every), windows.left(x, every), heldout)


def _sure(x: FloatArray, sd: FloatArray, squares: Mapping[str, tuple[float, float]]) -> tuple[PartlyExplained, ...]:
    """Return the effects of which a number is surely not nothing."""
    found = []
    for id in dict.fromkeys(id for id, _ in _NAMES):
        places = [k for k, name in enumerate(_NAMES) if name[0] == id]
        if any(abs(x[k]) > _SURE * sd[k] for k in places):
            values = {_NAMES[k][1]: ParameterValue(float(x[k]), float(sd[k])) for k in places}
            found.append(PartlyExplained(id, values, squares))
    return tuple(found)


@dataclass(frozen=True)
class _Windows:
    """Pairs of readings of a field, (n,) each at ``t`` and ``t + length`` s, and the rates between."""

    t: FloatArray
    length: float
    m: FloatArray
    later: FloatArray
    rate_t: FloatArray
    rate: FloatArray

    def fit(self, some: BoolArray) -> FloatArray:
        """Return iron (3,) uT, bias (3,) rad/s and lateness (s) that reconcile some of the windows best."""
        tried = [self._iron(late, some) for late in _LATE]
        best = int(np.argmin([left for _, left in tried]))
        start = np.concatenate([tried[best][0], np.zeros(3), [_LATE[best]]])
        apart = max(self.left(start, some), 1e-3)

        def left(u: FloatArray) -> FloatArray:
            return self._apart(u * _SCALE, some).ravel() / apart

        solved = least_squares(left, start / _SCALE, loss="soft_l1", max_nfev=6)
        x: FloatArray = solved.x * _SCALE
        return x

    def spread(self, x: FloatArray) -> FloatArray:
        """Return standard deviations (7,) of a fit to all windows: the jackknife over blocks of time, linearised."""
        every = np.ones(self.t.size, dtype=bool)
        e = self._apart(x, every)
        step = 0.1 * _SCALE
        J = np.stack([(self._apart(x + d, every) - e) for d in np.diag(step)], axis=-1) / step
        # the weights of the loss that the fit goes by
        weight = 1.0 / np.sqrt(1.0 + np.sum(e**2, axis=1) / max(self.left(x, every), 1e-3) ** 2)
        block = np.searchsorted(np.quantile(self.t, np.linspace(0.0, 1.0, _BLOCKS + 1))[1:-1], self.t)
        H = np.stack([np.einsum("n,nij,nik->jk", weight * (block == k), J, J) for k in range(_BLOCKS)])
        b = np.stack([np.einsum("n,nij,ni->j", weight * (block == k), J, e) for k in range(_BLOCKS)])
        without = np.stack([np.linalg.lstsq(H.sum(axis=0) - H[k], b.sum(axis=0) - b[k])[0] for k in range(_BLOCKS)])
        off = without - without.mean(axis=0)
        sd: FloatArray = np.sqrt(np.sum(off**2, axis=0) * (_BLOCKS - 1.0) / _BLOCKS)
        return sd

    def left(self, x: FloatArray, some: BoolArray) -> float:
        """Return the median of what windows leave, uT."""
        return float(np.median(np.linalg.norm(self._apart(x, some), axis=1)))

    def _iron(self, late: float, some: BoolArray) -> tuple[FloatArray, float]:
        """Return the iron (3,) uT by least squares where the magnetometer is late by so much, and what is left."""
        turn = self._turns(np.zeros(3), late, some)
        A = (np.eye(3) - turn).reshape(-1, 3)
        y = (self.later[some] - np.einsum("nij,nj->ni", turn, self.m[some])).ravel()
        iron: FloatArray = np.linalg.lstsq(A, y)[0]
        return iron, float(np.median(np.abs(y - A @ iron)))

    def _apart(self, x: FloatArray, some: BoolArray) -> FloatArray:
        """Return what the windows leave (n, 3) uT with iron, bias and lateness x (7,)."""
        turn = self._turns(x[3:6], float(x[6]), some)
        apart: FloatArray = self.later[some] - x[:3] - np.einsum("nij,nj->ni", turn, self.m[some] - x[:3])
        return apart

    def _turns(self, bias: FloatArray, late: float, some: BoolArray) -> FloatArray:
        """Return the turns (n, 3, 3) of body vectors over some of the windows by the rates less a bias."""
        step = np.diff(self.rate_t)[:, None] * (0.5 * (self.rate[1:] + self.rate[:-1]) - bias)
        attitude = _product(np.vstack([np.zeros(3), step]))

        def at(t: FloatArray) -> Rotation:
            k = np.clip(np.searchsorted(self.rate_t, t) - 1, 0, self.rate_t.size - 2)
            rest = (t - self.rate_t[k])[:, None] * (self.rate[k] - bias)
            return Rotation.from_quat(attitude[k]) * Rotation.from_rotvec(rest)

        t = self.t[some] - late
        turns: FloatArray = (at(t + self.length).inv() * at(t)).as_matrix()
        return turns


def _product(steps: FloatArray) -> FloatArray:
    """Return quaternions (n, 4) of the running product of turns by steps (n, 3) rad, by doubling."""
    q = Rotation.from_rotvec(steps)
    shift = 1
    while shift < len(steps):
        q = Rotation.concatenate([q[:shift], q[:-shift] * q[shift:]])
        shift *= 2
    product: FloatArray = q.as_quat()
    return product


def _windows(recording: Recording) -> _Windows | None:
    """Return pairs of the field's readings with whole rates between, None where there are too few."""
    gyroscope, magnetometer = recording.get("gyroscope"), recording.get("magnetometer")
    if gyroscope is None or magnetometer is None:
        return None
    sheet = recording.sheets["gyroscope"]
    bad = np.asarray(~np.isfinite(gyroscope.value).all(axis=1) | sheet.clipped(gyroscope.value).any(axis=1))
    good = np.isfinite(magnetometer.value).all(axis=1)
    if np.count_nonzero(~bad) < _FEWEST or np.count_nonzero(good) < _FEWEST:
        return None
    rate = np.where(bad[:, None], 0.0, np.nan_to_num(gyroscope.value))
    size = np.linalg.norm(rate, axis=1)
    usual = float(np.median(size[size > 0.1 * np.max(size)])) if np.any(size > 0.0) else 0.0
    length = float(np.clip(_TURN / max(usual, 1e-6), _SHORTEST, _LONGEST))
    t, m = magnetometer.t[good], magnetometer.value[good]
    k = np.searchsorted(t, t + length)
    inside = (k < t.size) & (t > gyroscope.t[0] + 0.07) & (t + length < gyroscope.t[-1] - 0.07)
    first = np.flatnonzero(inside)
    # a window whose end falls between two readings is as long as to the next one: only those of one length take part
    regular = np.abs(t[k[first]] - t[first] - length) <= 0.51 * magnetometer.interval
    first = first[regular]
    gone = np.concatenate([[0.0], np.cumsum(bad.astype(float))])
    from_, to = (np.searchsorted(gyroscope.t, t[first] + shift) for shift in (-0.07, length + 0.07))
    turned = np.concatenate([[0.0], np.cumsum(size[:-1] * np.diff(gyroscope.t))])
    by = np.interp(t[first] + length, gyroscope.t, turned) - np.interp(t[first], gyroscope.t, turned)
    first = first[(gone[np.minimum(to, bad.size)] == gone[from_]) & (by > 0.25 * _TURN)]
    if first.size < _FEWEST:
        return None
    first = first[:: max(1, first.size // _WINDOWS)]
    later = np.stack([np.interp(t[first] + length, t, column) for column in m.T], axis=1)
    return _Windows(t[first], length, m[first], later, gyroscope.t, rate)
