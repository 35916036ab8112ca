"""Samples that were lost without a trace: the rest are written at the nominal spacing, so time slips by whole samples.

Takes a sensor's samples and a motion; gives how many were lost before each. A sample written as the k-th was taken at
(k + c)/rate, where c never falls: the likeliest course of c is found by dynamic programming (Viterbi, 1967). Where the
disc spins, a lost sample is a step in the phase; elsewhere only a motion known from other sensors tells.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.arrays import ComplexArray, FloatArray, IntArray, sd_by_median
from discsim.compiled import compiled_nogil
from discsim.recording import Recording, Samples
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import Values, delay

__all__ = ["circle_through", "first_yaw", "lost_along", "phase_counts", "repaired", "viterbi_counts"]

#: most samples lost in a row that are looked for
_IN_A_ROW = 4
#: what a lost sample costs in chi-squared, for a share lost of about one in a hundred
_COST = 2.0 * np.log(100.0)
#: a reading cannot speak against a count by more than this
_MOST = 50.0
#: what speaks, in chi-squared, for a sensor that ends when the others do
_TOGETHER = 20.0
#: neighbours by which the ordinary turn from sample to sample is judged, on either side
_NEIGHBOURS = 12
#: first samples, by which the phase at the start is told
_FIRST = 12
#: smallest step of phase, in its own noise, that is told from none
_SEEN = 4.5


def viterbi_counts(cost: FloatArray, gaps: IntArray, each: float = _COST) -> tuple[IntArray, float]:
    """Return the never-falling counts (n,) of least cost (n, c) and their cost; a lost sample costs ``each``.

    ``gaps`` (n,) is by how many sampling intervals a sample follows the one before: more than one may be lost in a row
    only within `_IN_A_ROW` of each.
    """
    counts = np.zeros(cost.shape[0], dtype=np.int64)
    least = _walk(np.ascontiguousarray(cost), np.asarray(gaps, dtype=np.int64), float(each), counts)
    return counts, float(least)


@compiled_nogil
def _walk(cost: FloatArray, gaps: IntArray, each: float, counts: IntArray) -> float:
    """Write `viterbi_counts` into counts (n,) and return their cost (Viterbi)."""
    n, c = cost.shape
    best, new = cost[0] + each * np.arange(c), np.empty(c)
    came = np.zeros((n, c), dtype=np.int64)
    for k in range(1, n):
        reach = min(_IN_A_ROW * max(gaps[k], 1), c - 1)
        for i in range(c):
            least = best[i]
            for j in range(1, min(reach, i) + 1):
                if best[i - j] + each * j < least:
                    least, came[k, i] = best[i - j] + each * j, j
            new[i] = least + cost[k, i]
        best, new = new, best
    counts[n - 1] = np.argmin(best)
    for k in range(n - 1, 0, -1):
        counts[k - 1] = counts[k] - came[k, counts[k]]
    return float(best.min())


def grid_of(samples: Samples, rate_hz: float) -> IntArray:
    """Return the places (n,) of samples on the sensor's nominal grid, the first at zero."""
    return np.asarray(np.round((samples.t - samples.t[0]) * rate_hz), dtype=np.int64)


def phase_counts(recording: Recording) -> FloatArray:
    """Return how many samples were lost before each of the magnetometer's (n,), by the steps of its phase.

    A step counts where it is a whole number of ordinary turns between samples, judged by its neighbours, so that
    neither a wrong clock nor a changing spin is taken for losses; where the phase hardly turns none are found.
    """
    samples = recording.samples["magnetometer"]
    rate_hz = recording.sheets["magnetometer"].rate_hz
    lost = np.zeros(len(samples))
    usable = np.flatnonzero(np.all(np.isfinite(samples.value[:, :2]), axis=1))
    if usable.size < 4 * _NEIGHBOURS:
        return lost
    z = samples.value[usable, 0] + 1j * samples.value[usable, 1]
    z = z - _centre(z)
    place = grid_of(samples, rate_hz)[usable]
    turn = np.angle(z[1:] * np.conj(z[:-1]))
    plain = np.diff(place) == 1
    if np.count_nonzero(plain) < 2 * _NEIGHBOURS:
        return lost
    at = np.flatnonzero(plain)
    steps = turn[at]
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(steps, _NEIGHBOURS, mode="reflect"), 2 * _NEIGHBOURS + 1)
    usual = np.median(windows, axis=1)
    # a straight line through the neighbours that turned as usual: the spin changes, and so does a tilted field
    scatter = np.maximum(sd_by_median(windows - usual[:, None], axis=1), 1e-4)
    offset = np.arange(-_NEIGHBOURS, _NEIGHBOURS + 1)
    near = (np.abs(windows - usual[:, None]) < 4.0 * scatter[:, None]) & (offset != 0)
    weight = near.astype(float)
    count, first, second = weight.sum(1), weight @ offset, weight @ offset**2.0
    sums, moments = np.sum(weight * windows, axis=1), np.sum(weight * windows * offset, axis=1)
    expected = (second * sums - first * moments) / np.maximum(count * second - first**2, 1e-9)
    extra = np.arange(_IN_A_ROW + 1)
    off = steps[:, None] - expected[:, None] * (1.0 + extra)
    off = np.remainder(off + np.pi, 2.0 * np.pi) - np.pi
    price = np.minimum((off / scatter[:, None]) ** 2, 1e6) + extra * 1.5 * _COST
    seen = (np.abs(expected) > _SEEN * scatter) & (count > _NEIGHBOURS)
    stepped = np.where(seen, np.argmin(price, axis=1), 0)
    # a step counts where the whole turn explains it, not merely better than none
    fits = np.abs(off[np.arange(steps.size), stepped]) < np.maximum(5.0 * scatter, 0.15 * np.abs(expected))
    after = np.zeros(usable.size)
    after[1 + at] = np.where(fits, stepped, 0)
    lost[usable] = after
    return np.cumsum(lost)


def circle_through(z: ComplexArray) -> tuple[complex, float]:
    """Return the centre and the radius of the circle nearest to points x + i y (n,), by algebraic least squares."""
    A = np.stack([2.0 * z.real, 2.0 * z.imag, np.ones(z.size)], axis=1)
    (a, b, c), *_ = np.linalg.lstsq(A, z.real * z.real + z.imag * z.imag, rcond=None)
    return complex(a, b), float(np.sqrt(max(c + a * a + b * b, 0.0)))


def _centre(z: ComplexArray) -> complex:
    """Return the centre of the circle nearest to points (n,), or zero where they lie on no circle."""
    centre, radius = circle_through(z)
    turned = np.abs(np.sum(np.exp(1j * np.angle(z - centre)))) / z.size
    return centre if abs(centre) < 2.0 * radius and turned < 0.5 else 0j


def lost_along(
    current: Trajectory, values: Values, sensor: str, sd: FloatArray, *, about: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """Return the likeliest counts lost before each sample (n,) of a sensor by a trajectory's motion, and their gain.

    ``sd`` (k,) is the noise of its axes. The gain is that in chi-squared over losing none, or over the counts
    ``about``, less the price of each loss.
    """
    recording = current.recording
    samples = recording.samples[sensor]
    readings = next(r for r in current.readings if r.sensor == sensor)
    rate_hz = recording.sheets[sensor].rate_hz
    place = grid_of(samples, rate_hz)
    end = float(current.nodes[-1])
    most = max(int((end - samples.t[-1]) * rate_hz) + 1, 0)
    most = min(most, int(0.25 * place[-1]) + 8)
    if about is not None:
        most = max(most, int(about[-1]))
    grid = samples.t[0] + np.arange(place[-1] + most + 1) / rate_hz
    expected = shown(current, values, sensor, grid - delay(values, sensor, grid))
    if sensor == "accelerometer" and readings.limit is not None:
        expected = np.clip(expected, -readings.limit, readings.limit)
    counts = np.arange(most + 1)
    measured = np.where(readings.good[:, None, :], samples.value[:, None, :], np.nan)
    off = (measured - expected[place[:, None] + counts]) / sd
    cost = np.minimum(np.nansum(off**2, axis=2), _MOST)
    # loggers mostly stop all their sensors together: then as many as are missing at the end were lost before, and
    # where the readings do not tell the place of one, there are so many places that it costs nothing
    missing = max(int((end - samples.t[-1]) * rate_hz + 1e-3), 0)
    believed = cost.copy()
    if missing <= most:
        believed[-1] += _TOGETHER + _COST * missing
        believed[-1, missing] = cost[-1, missing]
    gaps = np.diff(place, prepend=place[0])
    path, _ = viterbi_counts(believed, gaps)
    # the gain is what the readings say alone
    _, least = viterbi_counts(cost, gaps)
    was = np.zeros(len(samples), dtype=np.int64) if about is None else about.astype(np.int64)
    before = float(cost[np.arange(len(samples)), was].sum()) + _COST * float(was[-1])
    return path.astype(float), before - least


def first_yaw(current: Trajectory, values: Values) -> float:
    """Return by how much the first segment's yaw must grow for the first magnetometer samples to agree with it, rad."""
    samples = current.recording.samples["magnetometer"]
    lost = current.lost.get("magnetometer", np.zeros(len(samples)))
    some = np.flatnonzero(np.all(np.isfinite(samples.value), axis=1))[:_FIRST]
    if some.size == 0:
        return 0.0
    t = samples.t[some] + lost[some] / current.recording.sheets["magnetometer"].rate_hz
    expected = shown(current, values, "magnetometer", t - delay(values, "magnetometer", t))
    measured = samples.value[some]
    ahead = (expected[:, 0] + 1j * expected[:, 1]) * np.conj(measured[:, 0] + 1j * measured[:, 1])
    return float(np.angle(np.sum(ahead / np.maximum(np.abs(ahead), 1e-12))))


def repaired(recording: Recording, sensor: str, lost: FloatArray) -> Recording:
    """Return a recording with the samples of a sensor written at the times its clock had when they were taken."""
    samples = recording.samples[sensor]
    moved = Samples(samples.t + lost / recording.sheets[sensor].rate_hz, samples.value)
    return replace(recording, samples={**recording.samples, sensor: moved})
