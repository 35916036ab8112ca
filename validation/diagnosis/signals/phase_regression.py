"""Phase regression: how far each sensor's signal turns in the time that the recording writes.

Takes a recording; gives each signal's turn against the angle that a sensor of the rate makes. The field, which stands
still in N, turns backwards in B; the wobble of a disc turns forwards, (Izz - Ixx)/Ixx times as fast as it spins. Each
is followed in short segments whose amplitude and phase are free: a sensor that turns further than that angle says that
the time, or the rate, is wrong.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import BSpline

from discsim.arrays import ComplexArray, FloatArray, readonly, sd_by_median
from discsim.recording import Recording, Samples
from discsim.sensors.accelerometer import force_at

__all__ = [
    "Signal",
    "Tone",
    "angle_turned",
    "centripetal",
    "centripetal_of",
    "explained",
    "left_of",
    "rate_of",
    "rest_of",
    "retimed",
    "signal_of",
    "signals_of",
    "slow_columns",
    "slow_count",
    "slow_sum",
    "steps",
    "still_part",
    "tone",
]


#: length of a segment, s, which is longer where a logger is slow, and the fewest readings of one
SEGMENT, FEWEST = 0.8, 24
#: degrees in time of what does not turn, and of the amplitude of what does (a wobble dies), within a segment
_STILL = 1
_CHANGES = {"field": 0, "wobble": 2}
#: how far a ratio of turns is looked for, in its logarithm, and in which steps
REACH, STEP = 0.4, 0.01
#: blocks by which the error of a ratio is judged
_BLOCKS = 10
#: of the angle between two readings: how far backwards noise may turn it, rad
BACKWARDS = 0.35 * np.pi
#: a rate is known if this share of its readings is neither clipped nor missing
_KNOWN = 0.9
#: fewest turns of a recording about its axis
_FEWEST_TURNS = 4.0
#: an accelerometer nearer to the axis than this, m, shows no spin
_OFF_AXIS = 1e-3


@dataclass(frozen=True)
class Signal:
    """A complex signal x + i y of a sensor: t (n,) written s, value (n,); turns ``order`` times the angle turned."""

    name: str
    sensor: str
    t: FloatArray
    value: ComplexArray
    order: float


@dataclass(frozen=True)
class Tone:
    """How far a signal turns over the angle turned, with its error, and the share of it that does."""

    ratio: float
    sd: float
    share: float


def _usable(recording: Recording, sensor: str) -> tuple[FloatArray, FloatArray] | None:
    """Return times (n,) and readings (n, k) of a sensor, NaN where clipped; None where there are too few."""
    samples = recording.get(sensor)
    if samples is None:
        return None
    value = np.where(recording.sheets[sensor].clipped(samples.value), np.nan, samples.value)
    value = value if value.ndim == 2 else value[:, None]
    return (samples.t, value) if len(samples) >= FEWEST else None


def rate_of(recording: Recording) -> tuple[str, FloatArray, FloatArray] | None:
    """Return the sensor that shows the spin itself, its times (n,) and rates (n,) rad/s, or None for want of one."""
    for sensor, column in (("rate_reference", 0), ("gyroscope", 2)):
        found = _usable(recording, sensor)
        if found is None:
            continue
        t, r = found[0], found[1][:, column]
        good = np.isfinite(r)
        if np.count_nonzero(good) >= _KNOWN * r.size and np.trapezoid(np.abs(r[good]), t[good]) > (
            2.0 * np.pi * _FEWEST_TURNS
        ):
            return sensor, t[good], r[good]
    return None


def angle_turned(recording: Recording, at: FloatArray) -> FloatArray:
    """Return the angle (m,) that the sensor of the rate has turned through by the written times ``at`` (m,)."""
    known = rate_of(recording)
    assert known is not None
    _, t, r = known
    psi = cumulative_trapezoid(r, t, initial=0)
    return np.asarray(
        np.interp(at, t, psi) + np.where(at < t[0], (at - t[0]) * r[0], np.maximum(at - t[-1], 0) * r[-1])
    )


def signals_of(recording: Recording) -> list[Signal]:
    """Return what a recording's sensors show turning with its spin."""
    found: list[Signal] = []

    def add(name: str, sensor: str, t: FloatArray, x: FloatArray, y: FloatArray, order: float) -> None:
        good = np.isfinite(x) & np.isfinite(y)
        if np.count_nonzero(good) >= 2 * FEWEST:
            found.append(Signal(name, sensor, t[good], x[good] + 1j * y[good], order))

    if (field := _usable(recording, "magnetometer")) is not None:
        add("field", "magnetometer", field[0], field[1][:, 0], field[1][:, 1], -1.0)
    disc = recording.disc
    if disc is not None and disc.Izz > disc.Ixx and (rates := _usable(recording, "gyroscope")) is not None:
        t, w = rates
        add("wobble", "gyroscope", t, w[:, 0], w[:, 1], (disc.Izz - disc.Ixx) / disc.Ixx)
    return found


def slow_columns(t: FloatArray, end: float, knots_s: float) -> FloatArray:
    """Return cubic splines (n, p) at times (n,) s, for what is slow from 0 to ``end``: a knot each ``knots_s``."""
    return np.asarray(slow_sum(t, end, knots_s, np.eye(slow_count(end, knots_s))))


def slow_count(end: float, knots_s: float) -> int:
    """Return how many splines `slow_columns` has."""
    return int(_knots(end, knots_s).size) - 4


def slow_sum(t: FloatArray, end: float, knots_s: float, x: Any, *, slope: bool = False) -> Any:
    """Return what the splines of `slow_columns` with coefficients ``x`` (p, ...) add up to at times of any shape.

    Or the ``slope`` of that, in 1/s.
    """
    each = BSpline.construct_fast(_knots(end, knots_s), x, 3)
    return each(np.clip(t, 0.0, end * (1.0 - 1e-12)), 1 if slope else 0)


@lru_cache(maxsize=64)
def _knots(end: float, knots_s: float) -> FloatArray:
    return readonly(np.concatenate([np.zeros(3), np.linspace(0.0, end, 2 + int(end / knots_s)), np.full(3, end)]))


def signal_of(recording: Recording, name: str) -> Signal | None:
    """Return one of `signals_of` by its name, "field" or "wobble"; None where it is not shown."""
    return next((signal for signal in signals_of(recording) if signal.name == name), None)


def _segments(t: FloatArray) -> list[slice]:
    # of a slow logger a segment lasts as long as its readings are enough
    count = max(1, min(round((t[-1] - t[0]) / SEGMENT), t.size // (FEWEST + 1)))
    cuts = np.searchsorted(t, np.linspace(t[0], t[-1], count + 1)[1:-1])
    edges = [0, *cuts.tolist(), t.size]
    return [slice(a, b) for a, b in pairwise(edges) if b - a >= FEWEST]


def rest_of(signal: Signal, psi: FloatArray, ratio: float = 1.0) -> tuple[float, float, int]:
    """Return the squares left of a signal that turns with the angle psi (n,), those of what may turn, and how many.

    Numbers count as real ones, less those that amplitudes and what stands still take.
    """
    left = total = 0.0
    count = 0
    for part in _segments(signal.t):
        t, y = signal.t[part], signal.value[part]
        x = (t - t.mean()) / max(0.5 * (t[-1] - t[0]), 1e-9)
        still = np.vander(x, _STILL + 1).astype(complex)
        turning = (
            np.vander(x, _CHANGES[signal.name] + 1)
            * np.exp(1j * ratio * signal.order * (psi[part] - psi[part][0]))[:, None]
        )
        for columns, only_still in ((still, True), (np.hstack([still, turning]), False)):
            Q, _ = np.linalg.qr(columns)
            e = y - Q @ (Q.conj().T @ y)
            squares = float(np.sum(np.abs(e) ** 2))
            if only_still:
                total += squares
            else:
                left += squares
        count += 2 * (t.size - _STILL - _CHANGES[signal.name] - 2)
    return left, total, count


def left_of(signal: Signal, psi: FloatArray, ratio: float = 1.0) -> float | None:
    """Return the rms of what does not turn with the angle psi (n,), in the sensor's unit, for one axis.

    None where there are too few readings to tell.
    """
    left, _, count = rest_of(signal, psi, ratio)
    return float(np.sqrt(left / count)) if count else None


def _still_part(signal: Signal, psi: FloatArray) -> ComplexArray:
    """Return what stands still (n,) while the rest turns so many times the angle psi (n,) as leaves least."""
    guess = min(
        np.exp(np.arange(-REACH, REACH + 0.5 * STEP, STEP)), key=lambda ratio: rest_of(signal, psi, float(ratio))[0]
    )
    return still_part(signal, psi, float(guess))


def still_part(signal: Signal, psi: FloatArray, ratio: float) -> ComplexArray:
    """Return what of a signal (n,) stands still in B while the rest turns with the angle psi (n,)."""
    still = np.full(signal.t.size, np.mean(signal.value))
    for part in _segments(signal.t):
        t = signal.t[part]
        x = (t - t.mean()) / max(0.5 * (t[-1] - t[0]), 1e-9)
        plain = np.vander(x, _STILL + 1).astype(complex)
        turning = (
            np.vander(x, _CHANGES[signal.name] + 1)
            * np.exp(1j * ratio * signal.order * (psi[part] - psi[part][0]))[:, None]
        )
        weights = np.linalg.lstsq(np.hstack([plain, turning]), signal.value[part], rcond=None)[0]
        still[part] = plain @ weights[: _STILL + 1]
    return still


def explained(signal: Signal, psi: FloatArray, ratio: float = 1.0) -> float:
    """Return the share of what may turn that does turn with the angle psi (n,); 0 of too few readings to tell."""
    left, total, count = rest_of(signal, psi, ratio)
    return 1.0 - left / max(total, 1e-300) if count else 0.0


def steps(signal: Signal, psi: FloatArray, centre: complex | None = None) -> tuple[FloatArray, FloatArray]:
    """Return how far a signal turns from reading to reading over what the angle psi (n,) makes of it, and weights.

    Both are (n - 1,). A step may be several times the expected one, where rows were lost, or a little backwards. What
    stands still in B is a ``centre`` where that is known, else what does not turn with the angle.
    """
    turning = signal.value - (_still_part(signal, psi) if centre is None else centre)
    expected = signal.order * np.diff(psi)
    angle = np.angle(turning[1:] * np.conj(turning[:-1])) * np.sign(expected)
    angle = np.where(angle < -BACKWARDS, angle + 2.0 * np.pi, angle)
    # every step of a field counts alike, so that they add up to its turns; a wobble dies and counts by its size
    size = np.abs(turning) if signal.name == "wobble" else np.ones(turning.size)
    weight = np.minimum(size[1:], size[:-1]) ** 2 * (np.abs(expected) > 1e-6)
    return np.asarray(angle / np.maximum(np.abs(expected), 1e-6)), np.asarray(weight)


def tone(signal: Signal, psi: FloatArray) -> Tone:
    """Return how far a signal turns over the angle psi (n,), step by step, with an error from the scatter of blocks.

    Steps that differ, as those between rows that were lost do, add up to the whole angle all the same.
    """
    ratios, weight = steps(signal, psi)
    weight = weight * np.abs(np.diff(psi))
    ratio = float(np.sum(weight * ratios) / max(float(np.sum(weight)), 1e-300))
    blocks = np.array_split(np.arange(ratios.size), _BLOCKS)
    without = [
        float(np.sum(np.delete(weight * ratios, block)) / max(float(np.sum(np.delete(weight, block))), 1e-300))
        for block in blocks
    ]
    sd = float(np.sqrt((_BLOCKS - 1) / _BLOCKS * np.sum((np.array(without) - np.mean(without)) ** 2)))
    return Tone(ratio, sd, explained(signal, psi, ratio))


def centripetal_of(recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return times (n,) and the accelerometer's x and y (n, 2), measured and as the spin alone would make them.

    None without an accelerometer off the axis or a sensor of the rate; what is clipped or missing is NaN.
    """
    felt, known = _usable(recording, "accelerometer"), rate_of(recording)
    place = recording.sheets["accelerometer"].position if felt is not None else None
    if felt is None or known is None or place is None or np.hypot(*place[:2]) < _OFF_AXIS:
        return None
    t, f = felt
    w = np.zeros((t.size, 3))
    gyro = recording.get("gyroscope") if known[0] == "gyroscope" else None
    if gyro is not None:
        w[:, :2] = np.column_stack([np.interp(t, gyro.t, np.nan_to_num(gyro.value[:, k])) for k in range(2)])
    w[:, 2] = np.interp(t, known[1], known[2])
    return t, f[:, :2], force_at(place, np.zeros(3), w, np.zeros_like(w))[:, :2]


def centripetal(recording: Recording) -> Tone | None:
    """Return the rate by the accelerometer's pull towards the axis over that by the gyroscope: no time enters it."""
    found = centripetal_of(recording)
    if found is None:
        return None
    t, f, pull = found
    good = np.all(np.isfinite(f), axis=1)
    turned = np.abs(angle_turned(recording, t)) / (2.0 * np.pi)
    # whole turns: what turns with the spin averages out
    block = np.floor(turned / 2.0).astype(int)
    ratios = []
    order = np.argsort(block, kind="stable")
    for mine in np.split(order, np.searchsorted(block[order], np.arange(1, int(block.max()) + 1)))[:-1]:
        if mine.size >= 8 and np.all(good[mine]):
            square = float(np.sum(f[mine] * pull[mine]) / np.sum(pull[mine] ** 2))
            if square > 0:
                ratios.append(np.sqrt(square))
    if len(ratios) < 3:
        return None
    middle = float(np.median(ratios))
    scatter = float(sd_by_median(np.array(ratios) - middle))
    return Tone(middle, 1.25 * scatter / np.sqrt(len(ratios)), 1.0)


def retimed(recording: Recording, written: FloatArray, true: FloatArray) -> Recording:
    """Return a recording whose samples stand at the true times (n,) of the written ones (n,)."""

    def moved(samples: Samples) -> Samples:
        inside = np.interp(samples.t, written, true)
        slope = (true[-1] - true[0]) / (written[-1] - written[0])
        before, after = np.minimum(samples.t - written[0], 0.0), np.maximum(samples.t - written[-1], 0.0)
        return Samples(inside + slope * (before + after), samples.value)

    return replace(recording, samples={name: moved(samples) for name, samples in recording.samples.items()})
