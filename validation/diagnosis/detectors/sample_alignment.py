"""Samples that were lost without a trace: the rest are written at the nominal spacing, so time slips by whole samples.

Takes a sensor's samples and a motion; gives how many were lost before each. A sample written as the k-th was taken at
(k + c)/rate, where c never falls: the likeliest course of c is found by dynamic programming (Viterbi, 1967). Where the
disc spins, a lost sample is a step in the phase; elsewhere only a motion known from other sensors tells.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import ComplexArray, FloatArray, IntArray, sd_by_median, within_half_turn
from discsim.compiled import compiled_nogil
from discsim.recording import Recording, Samples
from discsim.validation.identification.circle import circle_through
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import Values, delay

__all__ = [
    "ROOM",
    "alignment_of",
    "first_yaw",
    "lost_along",
    "lost_and_turned",
    "lost_in_own_noise",
    "phase_counts",
    "repaired",
    "told_of",
    "viterbi_counts",
]

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
#: noises in which counts are found, in that of their sensor: a motion is not known exactly
_MARGIN = 2.0
#: times by which a noise to start from is quieter than the one before
_QUIETER = 3.0
#: share of the loudest noise below which none is tried: a motion with a misfit of a thousand noises is none
_QUIETEST = 1e-3
#: most rounds in which counts and noise follow from one another, and the share to which a noise has settled
_LEVELS, _SETTLED = 8, 0.95
#: rounds in which samples far off a line lose their weight, and how far that is, in what half of them leave
_TRIMMED, _FAR_OFF = 3, 4.0
#: losses that a fit may have overlooked by turning all, and rounds in which counts and the turn follow from one another
_OVERLOOKED, _TURNS = (0.0, 1.0, -1.0, 2.0, -2.0), 4
#: share of a sensor's samples that may have been lost, and how many samples by counts a table holds (100 MB), but so
#: many counts at least: a sensor that stopped early would ask for one of all that might be missing
_SHARE, _CELLS, _FEWEST_LOST = 0.25, 4_000_000, 64
#: share of a motion's end at which samples do not count where it ends before they do: as many may be lost
ROOM = 0.1


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
    off = within_half_turn(steps[:, None] - expected[:, None] * (1.0 + extra))
    price = np.minimum((off / scatter[:, None]) ** 2, 1e6) + extra * 1.5 * _COST
    seen = (np.abs(expected) > _SEEN * scatter) & (count > _NEIGHBOURS)
    stepped = np.where(seen, np.argmin(price, axis=1), 0)
    # a step counts where the whole turn explains it, not merely better than none
    fits = np.abs(off[np.arange(steps.size), stepped]) < np.maximum(5.0 * scatter, 0.15 * np.abs(expected))
    after = np.zeros(usable.size)
    after[1 + at] = np.where(fits, stepped, 0)
    lost[usable] = after
    return np.cumsum(lost)


def _centre(z: ComplexArray) -> complex:
    """Return the centre of the circle nearest to points (n,), or zero where they lie on no circle."""
    centre, radius = circle_through(z)
    turned = np.abs(np.sum(np.exp(1j * np.angle(z - centre)))) / z.size
    return centre if abs(centre) < 2.0 * radius and turned < 0.5 else 0j


@dataclass(frozen=True)
class Losses:
    """Samples that a sensor lost in one recording: counts before each (n,), their gain, and the noise they leave (k,).

    The gain is in chi-squared in that noise over losing none, less the price of each loss.
    """

    counts: FloatArray
    gain: float
    noise: FloatArray


@dataclass(frozen=True)
class Alignment:
    """A sensor's samples (n, k) and what a motion shows on the grid of its clock (g, k), on which they may lie.

    Sample j lies at ``place[j]`` plus as many as were lost before it, at most ``most``. ``missing`` are how many more
    samples there were, at least and at most, if all sensors were stopped together: the others tell when to within one
    of their intervals. None lies in that range where that is not known.
    """

    measured: FloatArray
    shown: FloatArray
    place: IntArray
    most: int
    missing: range

    def left(self, counts: IntArray, line: FloatArray) -> FloatArray:
        """Return what samples leave (n, k) at their counts (n,), of the motion by a line (2, k): factor and offset."""
        return np.asarray(self.measured - line[1] - line[0] * self.shown[self.place + counts])

    def line(self, counts: IntArray) -> FloatArray:
        """Return factor and offset (2, k) by which the motion is nearest to the samples, robust against a few."""
        line = np.empty((2, self.measured.shape[1]))
        for axis in range(line.shape[1]):
            y, x = self.measured[:, axis], self.shown[self.place + counts, axis]
            kept = known = np.isfinite(y)
            line[:, axis] = 1.0, 0.0
            for _ in range(_TRIMMED if known.any() else 0):
                columns = np.stack([x[kept], np.ones(np.count_nonzero(kept))], axis=1)
                line[:, axis] = np.linalg.lstsq(columns, y[kept], rcond=None)[0]
                off = np.abs(y - line[1, axis] - line[0, axis] * x)
                kept = known & (off <= _FAR_OFF * np.median(off[known]))
        return line

    def price(self, line: FloatArray, sd: FloatArray) -> FloatArray:
        """Return what each sample (n,) says against each count (c,) in a noise (k,): a limited chi-squared."""
        counts = np.arange(self.most + 1)
        expected = line[1] + line[0] * self.shown
        off = (self.measured[:, None, :] - expected[self.place[:, None] + counts]) / sd
        return _limited(off)

    def turned(self, turn: float) -> Alignment:
        """Return the alignment with a motion whose yaw is larger by a turn, rad, of a sensor that turns with it."""
        z = (self.shown[:, 0] + 1j * self.shown[:, 1]) * np.exp(-1j * turn)
        return replace(self, shown=np.column_stack([z.real, z.imag, self.shown[:, 2:]]))

    def misfit(self, counts: IntArray, line: FloatArray, sd: FloatArray) -> float:
        """Return what all samples at their counts (n,) say against a line (2, k) in a noise (k,), each as `price`."""
        return float(_limited(self.left(counts, line) / sd).sum())


def _limited(off: FloatArray) -> FloatArray:
    """Return the chi-squared of samples (..., k), each limited to what one may say."""
    return np.asarray(np.minimum(np.nansum(off**2, axis=-1), _MOST))


def alignment_of(
    current: Trajectory, values: Values, readings: Readings, rate_hz: float, *, cut: bool = False
) -> Alignment:
    """Return readings (n, k) of a sensor beside what a trajectory's motion shows of it.

    Of a trajectory that is ``cut``, which ends before the readings do, those count that lie before its last part: as
    much of it as may be lost lies behind each.
    """
    sensor, end = readings.sensor, float(current.nodes[-1])
    last = len(readings.t) if not cut else int(np.searchsorted(readings.t, (1.0 - ROOM) * end))
    t, good, value = readings.t[:last], readings.good[:last], readings.value[:last]
    place = np.asarray(np.round((t - t[0]) * rate_hz), dtype=np.int64)
    if cut:
        most, missing = max(int((end - t[-1]) * rate_hz), 0), range(0)
    else:
        first = max(int((end - t[-1]) * rate_hz + 1e-3), 0)
        missing = range(
            first, max(int(np.ceil((_stopped(current.recording, sensor, end) - t[-1]) * rate_hz)), first + 1)
        )
        most = missing.stop
    most = min(most, int(_SHARE * place[-1]) + 8, max(_CELLS // len(place), _FEWEST_LOST))
    grid = t[0] + np.arange(place[-1] + most + 1) / rate_hz
    expected = shown(current, values, sensor, grid - delay(values, sensor, grid))
    if readings.limit is not None:
        expected = np.clip(expected, -readings.limit, readings.limit)
    return Alignment(np.where(good, value, np.nan), expected, place, most, missing)


def _stopped(recording: Recording, sensor: str, end: float) -> float:
    """Return when at the latest, s, the others stopped of which the last was read at ``end``: no other reading came."""
    others = [
        float(own.t[-1]) + 1.0 / recording.sheets[name].rate_hz
        for name, own in recording.samples.items()
        if name != sensor and len(own) and recording.sheets[name].rate_hz > 0.0
    ]
    return max(min(others, default=end), end)


def _as_it_is(sd: FloatArray) -> FloatArray:
    """Return the line (2, k) that leaves a motion as it is: a factor of one and no offset for each axis of ``sd``."""
    return np.stack([np.ones_like(sd), np.zeros_like(sd)])


def _likeliest(own: Alignment, line: FloatArray, sd: FloatArray) -> tuple[IntArray, float]:
    """Return the likeliest counts (n,) in a noise (k,), and their gain over none, as the readings alone tell it."""
    cost = own.price(line, sd)
    # loggers mostly stop all their sensors together: then as many as are missing at the end were lost before, and
    # where the readings do not tell the place of one, there are so many places that it costs nothing
    believed = cost.copy()
    if own.missing and own.missing[0] <= own.most:
        # lost after the last sample: none of them shows where
        after = np.maximum(own.missing[0] - np.arange(min(own.missing[-1], own.most) + 1), 0)
        believed[-1] += _TOGETHER + _COST * own.missing[0]
        believed[-1, : after.size] = cost[-1, : after.size] + _COST * after
    gaps = np.diff(own.place, prepend=own.place[0])
    path, _ = viterbi_counts(believed, gaps)
    _, least = viterbi_counts(cost, gaps)
    return path, float(cost[:, 0].sum()) - least


def lost_along(own: Alignment, sd: FloatArray) -> Losses:
    """Return the likeliest losses of a sensor by a motion as it is, in a noise of its axes, ``sd`` (k,)."""
    plain = _as_it_is(sd)
    path, gain = _likeliest(own, plain, _MARGIN * sd)
    return Losses(path.astype(float), gain, sd)


def told_of(own: Alignment, counts: IntArray, sd: FloatArray) -> int:
    """Return how many of the first samples are such that one more loss before each would show, at counts (n,).

    It shows where it speaks for itself by more than a loss costs, in a noise of the axes ``sd`` (k,). Where a rate is
    held to the end nothing tells of what was lost meanwhile.
    """
    plain = _as_it_is(sd)
    cost = own.price(plain, _MARGIN * sd)
    k = np.arange(counts.size)
    one_more = cost[k, np.minimum(counts + 1, own.most)] - cost[k, np.minimum(counts, own.most)]
    shows = np.flatnonzero((np.cumsum(one_more[::-1])[::-1] > _COST) | (counts >= own.most))
    return int(shows[-1]) + 1 if shows.size else 0


def lost_and_turned(own: Alignment, sd: FloatArray) -> tuple[Losses, float]:
    """Return the likeliest losses of a magnetometer in a noise (k,) and by how much the motion's yaw must grow, rad.

    Nothing but the magnetometer tells a rig's yaw. Where a loss was overlooked, a fit turns all by half of its step,
    and by that motion it would be overlooked again.
    """
    plain = _as_it_is(sd)
    z = own.shown[:, 0] + 1j * own.shown[:, 1]
    step = float(np.median(np.angle(z[1:] * np.conj(z[:-1]))))
    best: tuple[float, Losses, float] | None = None
    for begun in _OVERLOOKED:
        turn = begun * step
        for _ in range(_TURNS):
            turned = own.turned(turn)
            path, gain = _likeliest(turned, plain, _MARGIN * sd)
            price = turned.misfit(path, plain, _MARGIN * sd) + _COST * float(path[-1])
            if best is None or price < best[0]:
                best = price, Losses(path.astype(float), gain, sd), turn
            shown = turned.shown[turned.place + path]
            ahead = (shown[:, 0] + 1j * shown[:, 1]) * np.conj(own.measured[:, 0] + 1j * own.measured[:, 1])
            turn += float(np.nanmedian(np.angle(ahead)))
    assert best is not None
    return best[1], best[2]


def lost_in_own_noise(own: Alignment, stated: FloatArray, loudest: FloatArray) -> Losses:
    """Return the likeliest losses of a sensor by a motion that is known to a line only, in the noise that they leave.

    Air and place of a sensor are known to a few parts in a hundred: of what a motion shows of each axis a factor and an
    offset are free. What it does not tell yet is noise, which lies between a ``stated`` and a ``loudest`` one (k,) and
    follows from the counts as they do from it. Of the noises and lines to start from, that whose counts leave least
    holds.
    """
    stated = np.maximum(stated, _QUIETEST * loudest)
    loudest = np.maximum(loudest, stated)
    found: Losses | None = None
    for line in _first_lines(own, stated):
        start = loudest
        while True:
            losses = _settled_losses(own, line, start, stated, loudest)
            if found is None or np.sum(np.log(losses.noise)) < np.sum(np.log(found.noise)):
                found = losses
            if np.all(start <= stated):
                break
            start = np.maximum(start / _QUIETER, stated)
    assert found is not None
    return found


def _first_lines(own: Alignment, sd: FloatArray) -> list[FloatArray]:
    """Return the lines (2, k) that counts start about: past the median of what none lost leaves, and the motion itself.

    About none lost the factor of an axis that turns with the disc would vanish where samples slip, so it is one. What
    dies away slips to one side, and that median is no offset then. Within the noise ``sd`` (k,) both are one.
    """
    itself = _as_it_is(sd)
    left = own.left(np.zeros(len(own.measured), dtype=np.int64), itself)
    median = np.array([np.median(x[np.isfinite(x)]) if np.isfinite(x).any() else 0.0 for x in left.T])
    beside = np.stack([itself[0], median])
    return [beside, itself] if np.any(np.abs(median) > sd) else [beside]


def _settled_losses(
    own: Alignment, line: FloatArray, start: FloatArray, stated: FloatArray, loudest: FloatArray
) -> Losses:
    """Return the losses whose noise and line follow from them, from a line (2, k) and a noise ``start`` (k,) on."""
    none = np.zeros(len(own.measured), dtype=np.int64)
    level = start
    for _ in range(_LEVELS):
        path, _ = _likeliest(own, line, _MARGIN * level)
        line = own.line(path)
        lower = np.clip(_robust(own.left(path, line)), stated, loudest)
        settled = bool(np.all((lower > _SETTLED * level) & (level > _SETTLED * lower)))
        level = lower
        if settled:
            break
    path, _ = _likeliest(own, line, _MARGIN * level)
    gain = own.misfit(none, own.line(none), _MARGIN * level) - own.misfit(path, line, _MARGIN * level)
    return Losses(path.astype(float), gain - _COST * float(path[-1]), level)


def _robust(left: FloatArray) -> FloatArray:
    """Return a robust standard deviation of each axis (k,) of readings (n, k); without end where none is known."""
    known = [axis[np.isfinite(axis)] for axis in left.T]
    return np.array([sd_by_median(axis) if axis.size else np.inf for axis in known])


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
