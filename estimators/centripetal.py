"""The centripetal part of the specific force, told from what turns with the spin by least squares over whole turns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, ComplexArray, FloatArray
from discsim.recording import Samples, SensorSheet

__all__ = ["LEAST_RESIDUAL", "MISFIT", "Centripetal", "centripetal"]

#: A block of the accelerometer that leaves this many times the residual of most blocks does not show the model.
MISFIT = 4.0
#: Residual from which on blocks are compared, m/s^2: a few steps of a 16-bit sensor's scale.
LEAST_RESIDUAL = 0.02


@dataclass(frozen=True)
class Centripetal:
    """The part of the specific force that stays in the body: t (n,) s, value (n, 2) m/s^2 and sd per axis (n,).

    It is ``(-r^2 + i r') (d_x + i d_y) + bias`` as a complex number.
    """

    t: FloatArray
    value: FloatArray
    sd: FloatArray


def centripetal(
    accelerometer: Samples,
    sheet: SensorSheet,
    t: FloatArray,
    rate: FloatArray,
    *,
    turns: float = 2.0,
    shortest: float = 0.1,
) -> Centripetal:
    """Separate the centripetal force from what turns with the spin, block by block.

    In each block of ``turns`` turns, at least ``shortest`` s, ``a_x + i a_y = c + c' t + (f + f' t) exp(-i psi)``
    is solved by least squares: c is the centripetal part, f gravity and translation, fixed in N and so turning in B.
    psi is the angle turned by ``rate`` (m,) rad/s given at times ``t``. Blocks with a clipped reading, or outside
    the known rate, are left out, and so are those that leave more than `MISFIT` times the residual of most and
    their neighbours: there the sensor does not show this (one that recovers from a throw's jerk drifts for some tenths
    of a second).
    """
    blocks: list[_Solved] = []
    if (readings := _readings(accelerometer, sheet, t, rate)) is not None:
        chosen = _blocks(readings, accelerometer.interval, turns, shortest)
        solved = (_solved(readings, block, accelerometer.interval) for block in chosen)
        blocks = [one for one in solved if one is not None]
    stated = float(np.hypot(sheet.noise_rms or 0.0, (sheet.resolution or 0.0) / np.sqrt(12)))
    return _agreeing(blocks, stated)


class _Readings(NamedTuple):
    """Readings a_x + i a_y (n,) of both axes at times t (n,), whether in range, and the rate r (n,) there.

    r is NaN where unknown; ``psi`` (n,) is the angle turned, ``turned`` (n,) the same without its sign, rad.
    """

    t: FloatArray
    a: ComplexArray
    good: BoolArray
    r: FloatArray
    psi: FloatArray
    turned: FloatArray


def _readings(accelerometer: Samples, sheet: SensorSheet, t: FloatArray, rate: FloatArray) -> _Readings | None:
    """Return the readings with the angles turned between them; None of fewer than eight, or with no known rate."""
    known = np.isfinite(rate)
    present = np.all(np.isfinite(accelerometer.value[:, :2]), axis=1)
    times, value = accelerometer.t, accelerometer.value[:, :2]
    good = ~np.any(sheet.clipped(accelerometer.value)[:, :2], axis=1)
    if not present.all():  # else nothing is copied: a log of hours has a hundred MB of it
        times, value, good = times[present], value[present], good[present]
    if np.count_nonzero(known) < 2 or times.size < 8:
        return None
    at = t[known]
    r = np.interp(times, at, rate[known], left=np.nan, right=np.nan)
    # a hole in the known rate is no rate
    for hole in np.flatnonzero(np.diff(at) > 0.5):
        before, after = np.searchsorted(times, at[hole : hole + 2], side="right")
        r[before if hole else 0 : after] = np.nan
    a = np.empty(times.size, dtype=np.complex128)
    a.real, a.imag = value[:, 0], value[:, 1]
    return _Readings(times, a, good, r, _angle(times, r), _angle(times, np.abs(r)))


def _angle(t: FloatArray, r: FloatArray) -> FloatArray:
    """Return the angle (n,) turned at rates r (n,) by the trapezoidal rule, where they are known."""
    angle = np.zeros(t.size)
    np.multiply(np.diff(t) * 0.5, np.nan_to_num(r[1:] + r[:-1], copy=False), out=angle[1:])
    return np.cumsum(angle, out=angle)


def _blocks(readings: _Readings, interval: float, turns: float, shortest: float) -> Iterator[slice]:
    """Yield the blocks of whole turns that have all their readings, every one in range and with a known rate."""
    times, r, turned = readings.t, readings.r, readings.turned
    start = 0
    while start < times.size:
        if not np.isfinite(r[start]) or abs(r[start]) < 1e-3:
            start += 1
            continue
        # by the angle turned, not by the rate at a block's start: one that starts at rest would last for minutes
        goal = turned[start] + turns * 2 * np.pi
        stop = max(int(np.searchsorted(turned, goal)), int(np.searchsorted(times, times[start] + shortest - 1e-9)))
        if stop >= times.size and turned[-1] < goal - 0.1 * turns * 2 * np.pi:
            return
        chosen = slice(start, min(stop, times.size))
        size = chosen.stop - start
        length = float(times[chosen.stop - 1] - times[start]) + interval
        whole = length >= 0.9 * shortest and size >= 0.8 * length / interval
        if size >= 8 and whole and np.all(readings.good[chosen]) and np.all(np.isfinite(r[chosen])):
            yield chosen
        start = max(stop, start + 1)


class _Solved(NamedTuple):
    """A block: its centre, s, c and that one's sd over the noise's; squares that are left, degrees of freedom."""

    t: float
    value: complex
    share: float
    squares: float
    freedom: int


def _solved(readings: _Readings, block: slice, interval: float) -> _Solved | None:
    """Fit what stays and what turns to one block; None where the readings cannot tell them apart."""
    times, a = readings.t[block], readings.a[block]
    length = float(times[-1] - times[0]) + interval
    centre = float(np.mean(times))
    tau = (times - centre) / length
    turning = np.exp(-1j * (readings.psi[block] - readings.psi[block][0]))
    columns = np.column_stack([np.ones_like(turning), tau, turning, tau * turning])
    normal = columns.conj().T @ columns
    if np.linalg.cond(normal) > 1e6:
        return None
    inverse = np.linalg.inv(normal)
    solution = inverse @ (columns.conj().T @ a)
    squares = float(np.sum(np.abs(a - columns @ solution) ** 2))
    return _Solved(centre, solution[0], float(np.sqrt(inverse[0, 0].real)), squares, 2 * times.size - 8)


def _agreeing(blocks: Sequence[_Solved], stated: float) -> Centripetal:
    """Return the blocks that show the model, with the noise that they leave, m/s^2, or that which is stated."""
    empty = Centripetal(np.zeros(0), np.zeros((0, 2)), np.zeros(0))
    if not blocks:
        return empty
    t, values, share, squares, freedoms = (np.array(column) for column in zip(*blocks, strict=True))
    left = np.sqrt(squares / freedoms)
    misfit = left > MISFIT * max(float(np.median(left)), stated, LEAST_RESIDUAL)
    # the blocks beside may hold the tail of whatever it was
    fits = ~(misfit | np.append(misfit[1:], False) | np.append(False, misfit[:-1]))
    if not np.any(fits):
        return empty
    noise = max(float(np.sqrt(squares[fits].sum() / freedoms[fits].sum())), stated)
    return Centripetal(t[fits], np.column_stack([values[fits].real, values[fits].imag]), noise * share[fits])
