"""Readings that stand at a sensor's limit, known from what is stated and from the readings themselves.

A clipped reading says only that the motion was beyond the limit. Noise is added before a sensor clips, so readings at a
limit are equal to the last digit, time after time, and nothing lies beyond them. That is told from

- the stated range, reached to within one and a half steps of resolution (16 bits end a step below their range);
- the ends of a 16-bit number, 32764 to 32768 steps;
- the largest reading of an axis, of either sign, where it comes more often, or longer on end, than the sensor's own
  noise lets any reading come. Where the noise does not show, because the resolution is coarser or there is none, a
  steady motion stands still as well and nothing is concluded.
"""

from __future__ import annotations

import weakref
from math import erf
from threading import Lock
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.threads import side_by_side

if TYPE_CHECKING:
    from discsim.recording import Recording

__all__ = [
    "SAME",
    "Limits",
    "at_range",
    "clipped",
    "clipping_notes",
    "constant_axes",
    "dead_axes",
    "equal_largest",
    "limits",
    "step_of",
]

#: Fewest equal readings that are taken for a limit, how many times as many as in the steps below it, and how many
#: steps those are: of a Gaussian with a sd of a step the best case has 3.7 times, of a sine at rest on its crest 1.8.
FEWEST, DENSER, BELOW = 6, 4.0, 3
#: Fewest equal readings on end, where equal ones are next to impossible.
SHORTEST = 4
#: Chance at which equal readings are no chance, over a whole recording.
CHANCE = 1e-6
#: A limit is at least this share of the sensor's largest reading: one at rest stands still at zero or gravity.
NEAR_LARGEST = 0.5
#: Least noise, in steps, with which a constant input visibly toggles: at 0.2 it leaves a step once in 80 readings.
TOGGLING = 0.2
#: Neighbouring fourth differences of white noise correlate by -0.8, give or take 0.1 over 32; those of motion above 0.
ALTERNATING = -0.4
#: Largest noise, as a share of the limit: what scatters more from reading to reading is motion (the noisiest of common
#: sensors, a magnetometer of 5 uT in 1000 uT, has half a per cent).
NOISIEST = 0.02
#: What rounding alone leaves in fourth differences, in steps: 1/sqrt(12), and what 32 readings scatter by.
ROUNDING = 0.33
#: Loudest noise, in steps, that toggling between two numbers looks like: to and fro with every reading gives 0.96.
LOUDEST_TOGGLING = 1.0
#: Readings over which the noise is looked at, and the share of such windows that are quieter than what counts: the
#: quietest of all would be so by chance.
WINDOW, QUIETEST = 32, 0.05
#: Windows that are looked at together: memory does not grow with a recording.
PIECE = 1 << 17
#: Fewest readings that tell a constant axis.
LEAST = 16
#: A step is no step where more than this share of the small spacings are no multiples of it.
UNEVEN = 0.1
#: Two equal numbers differ by less than this, relative to the largest: conversions between units, single precision.
SAME = 1e-6
#: A stated range is taken as reached from at most this share below it: what eight bits step by.
LARGEST_MARGIN = 0.01
#: Full scale of 16 bits, in steps; some converters stop three short of it.
FULL_SCALE = (32763.5, 32768.5)


class Limits(NamedTuple):
    """Where a sensor's axes clip, each (k,) in the sensor's unit: NaN where they do not."""

    lower: FloatArray
    upper: FloatArray

    @property
    def largest(self) -> float:
        """The largest size of any, NaN where there is none."""
        sizes = np.abs(np.concatenate([self.lower, self.upper]))
        return float(np.nanmax(sizes)) if np.any(np.isfinite(sizes)) else float("nan")


#: What `clipped` told of the last read-only arrays: a dozen callers ask the same of the same readings.
_KNOWN: dict[int, tuple[weakref.ref[FloatArray], tuple[float | None, float | None], BoolArray]] = {}
#: sensors of a recording, as read, made usable, and corrected
_MOST_KNOWN = 16
#: readings from which on sensors are looked at side by side: a second of work, and threads begin in a millisecond
LARGE = 1 << 20
_LOCK = Lock()


def clipped(value: FloatArray, stated_range: float | None, resolution: float | None) -> BoolArray:
    """Tell which of a sensor's readings, (n, k) or (n,), stand at its limit, stated or found.

    A whole sensor's readings are wanted: what its other axes and times show of its noise is part of the judgement.
    """
    if value.flags.writeable or value.base is not None:
        return clipped_anew(value, stated_range, resolution)
    known = _KNOWN.get(id(value))
    if known is not None and known[0]() is value and known[1] == (stated_range, resolution):
        return known[2]
    found = clipped_anew(value, stated_range, resolution)
    found.flags.writeable = False
    with _LOCK:  # recordings are looked at side by side
        for key in [key for key, (array, _, _) in _KNOWN.items() if array() is None]:
            del _KNOWN[key]
        while len(_KNOWN) >= _MOST_KNOWN:
            del _KNOWN[next(iter(_KNOWN))]
        _KNOWN[id(value)] = (weakref.ref(value), (stated_range, resolution), found)
    return found


def clipped_anew(value: FloatArray, stated_range: float | None, resolution: float | None) -> BoolArray:
    table = value if value.ndim == 2 else value[:, None]
    step = resolution or step_of(table)
    found = at_range(table, stated_range, step)
    lower, upper = limits(table, resolution, step)
    tolerance = np.maximum(0.5 * step, SAME * np.fmax(np.abs(lower), np.abs(upper)))
    with np.errstate(invalid="ignore"):
        found |= (table >= upper - tolerance) | (table <= lower + tolerance)
    return found.reshape(value.shape)


def at_range(value: FloatArray, stated_range: float | None, step: float) -> BoolArray:
    """Tell which readings stand at the stated range: to within steps of resolution, and the last digit it is stated to.

    16 bits end a step below their range, and a range of 34.907 rad/s may be one of 34.90659.
    """
    if stated_range is None:
        return np.zeros(value.shape, dtype=np.bool_)
    exponential = "e" in repr(float(stated_range))
    decimals = len(repr(float(stated_range)).partition(".")[2])
    written = 0.0 if exponential else 0.5 * 10.0**-decimals
    margin = min(max(1.5 * step, written), LARGEST_MARGIN * stated_range) + 1e-9 * stated_range
    return np.asarray(np.abs(value) >= stated_range - margin)


def limits(value: FloatArray, resolution: float | None = None, step: float | None = None) -> Limits:
    """Return the limits that a sensor's readings, (n, k), show by themselves; ``step`` is their `step_of` if known."""
    lower, upper = np.full(value.shape[1], np.nan), np.full(value.shape[1], np.nan)
    rows = _not_held(value)
    known = np.isfinite(rows)
    largest = float(np.max(np.abs(rows[known]), initial=0.0))
    if largest == 0:
        return Limits(lower, upper)
    if step is None or (resolution is None and rows is not value):
        step = resolution or step_of(rows)
    quiet = _Noise(value, rows, max(step, SAME * largest))
    for axis in range(value.shape[1]):
        for sign, out in ((1.0, upper), (-1.0, lower)):
            column = sign * rows[:, axis]
            top = float(np.max(column[known[:, axis]], initial=-np.inf))
            if top >= NEAR_LARGEST * largest and _is_limit(column, axis, top, step, quiet):
                out[axis] = sign * top
    return Limits(lower, upper)


def step_of(value: FloatArray) -> float:
    """Return the smallest spacing of distinct readings (n, k), or 0 where their spacings have no common measure."""
    steps = [_axis_step(value[:, axis]) for axis in range(value.shape[1])]
    found = [step for step in steps if step > 0]
    return min(found) if found else 0.0


def constant_axes(value: FloatArray, least: int = LEAST) -> BoolArray:
    """Tell of which axes of readings (n, k) every single one is the same number: a dead axis, or one at its limit.

    Of fewer than ``least`` readings nothing is told.
    """
    table = value if value.ndim == 2 else value[:, None]
    known = np.isfinite(table)
    top = np.max(np.where(known, table, -np.inf), axis=0, initial=-np.inf)
    bottom = np.min(np.where(known, table, np.inf), axis=0, initial=np.inf)
    return np.asarray((np.count_nonzero(known, axis=0) >= least) & (top == bottom))


def dead_axes(value: FloatArray) -> BoolArray:
    """Tell which axes of readings (n, k) never change though others scatter as a real sensor's do, and are not large.

    One that never changes at the largest size there is may stand at its limit.
    """
    constant = constant_axes(value)
    size = np.max(np.where(np.isfinite(value), np.abs(value), 0.0), axis=0, initial=0.0)
    scatter = [_quietest(value[:, i]) > 1e-9 * size[i] for i in np.flatnonzero(~constant)]
    return constant & (size < NEAR_LARGEST * np.max(size)) if any(scatter) else np.zeros_like(constant)


def equal_largest(value: FloatArray, resolution: float | None = None) -> tuple[int, float]:
    """Return how many of readings (n, k) have the largest size there is, and how many would by those just below."""
    size = np.abs(value[np.isfinite(value)])
    top = float(np.max(size, initial=0.0))
    return _equal(size, top, max(resolution or step_of(value), SAME * top))


def _equal(column: FloatArray, top: float, step: float) -> tuple[int, float]:
    equal = int(np.count_nonzero(column > top - 0.5 * step))
    below = int(np.count_nonzero(column > top - (0.5 + BELOW) * step)) - equal
    return equal, max(below / BELOW, 0.5)


def _not_held(value: FloatArray) -> FloatArray:
    """Return the rows (m, k) that differ from the one before: a faster log repeats a slow sensor's readings."""
    if value.shape[1] == 1 or len(value) < 2:
        return value
    held = np.all((value[1:] == value[:-1]) | (np.isnan(value[1:]) & np.isnan(value[:-1])), axis=1)
    return np.asarray(value[np.concatenate([[True], ~held])]) if np.any(held) else value


def _axis_step(column: FloatArray) -> float:
    distinct = np.unique(column[np.isfinite(column)])
    spacing = np.diff(distinct)
    # conversions leave noise in the last digits
    spacing = spacing[spacing > 1e-9 * np.max(np.abs(distinct), initial=0.0)]
    if spacing.size == 0:
        return 0.0
    least = float(np.min(spacing))
    small = spacing[spacing < 5.5 * least]
    for whole in range(1, 5):  # where few readings are there, none may be a step apart
        step = least / whole
        if np.mean(np.abs(small / step - np.rint(small / step)) > 0.1) <= UNEVEN:
            return step
    return 0.0


class _Noise:
    """The least noise that a sensor shows over `WINDOW` readings, on any of its axes.

    ``value`` (n, k) are all readings and ``rows`` (m, k) those that differ from the one before; readings of little
    noise repeat without being held, so both are looked at.
    """

    def __init__(self, value: FloatArray, rows: FloatArray, step: float) -> None:
        self.rows, self.step = rows, step
        moving = np.flatnonzero(~constant_axes(rows))
        each = [rows] if rows is value else [value, rows]
        self.each = {i: min(_quietest(one[:, i], step) for one in each) for i in moving.tolist()}

    def steps(self, axis: int, without: BoolArray) -> float:
        """Return it in steps for the readings of an axis that are not ``without`` (n,), or else of the other axes.

        NaN where there are too few readings, or they show motion alone.
        """
        own = _quietest(np.where(without, np.nan, self.rows[:, axis]), self.step)
        others = [noise for other, noise in self.each.items() if other != axis]
        found = [noise for noise in (own, *others) if np.isfinite(noise)]
        if not found:
            return float("nan")
        return float(np.sqrt(max((min(found) / self.step) ** 2 - ROUNDING**2, 0.0)))


def _quietest(column: FloatArray, step: float = np.inf) -> float:
    """Return the noise of the quietest windows of readings (n,), NaN where no window shows any.

    Windows that stand still say nothing of a sensor whose others are louder than toggling between two numbers, a
    ``step`` apart, can be: a log may write zeros, or hold one reading, while the body is at rest.

    From fourth differences, which have sqrt(70) times white noise and next to nothing of smooth motion. Those of white
    noise alternate, neighbours correlating by -0.8; where they do not, they are motion and say nothing.
    """
    rough = np.diff(column, 4)
    if not np.all(finite := np.isfinite(rough)):
        rough = rough[finite]
    if rough.size < WINDOW // 2:
        return float("nan")
    width = min(WINDOW, rough.size)
    # scaled first: a reading of 1e300 has no square
    scale = max(float(np.max(rough)), -float(np.min(rough))) or 1.0
    total = float(np.sum((rough / scale) ** 2))
    white = [
        _white_windows(rough[start : start + PIECE + width], width, scale, total)
        for start in range(0, rough.size - width + 1, PIECE)
    ]
    squares, changing = np.concatenate(white, axis=1)

    def noise(windows: FloatArray) -> float:
        return scale * float(np.sqrt(np.quantile(windows, QUIETEST) / width / 70.0)) if windows.size else float("nan")

    loud = noise(squares[changing > width / 2])
    return loud if loud > LOUDEST_TOGGLING * step else noise(squares)


def _white_windows(rough: FloatArray, width: int, scale: float, total: float) -> FloatArray:
    """Return of the first windows of ``rough`` (n,) that hold white noise the sums of squares, over ``scale`` squared.

    The second row of (2, m) counts how many of a window's differences are not zero. ``total`` is the sum over all of a
    sensor's readings: what running sums leave of a window of zeros is below it.
    """
    products = np.stack([(rough / scale) ** 2, np.append(rough[1:] * (rough[:-1] / scale / scale), 0.0), rough != 0])
    sums = np.cumsum(np.concatenate([np.zeros((3, 1)), products], axis=1), axis=1)
    squares, neighbours, changing = (sums[:, width:] - sums[:, :-width])[:, :PIECE]
    squares = np.where(squares < 1e-13 * max(total, 1e-300), 0.0, squares)
    return np.asarray(np.stack([squares, changing])[:, neighbours <= ALTERNATING * squares])


def _is_limit(column: FloatArray, axis: int, top: float, step: float, quiet: _Noise) -> bool:
    """Tell whether the largest readings of a column (n,) are at a limit."""
    at_step = step > 0 and FULL_SCALE[0] <= top / step <= FULL_SCALE[1]
    if at_step:
        return True
    step = max(step, SAME * top)
    with np.errstate(invalid="ignore"):
        at_top = column > top - 0.5 * step
    count = int(np.count_nonzero(at_top))
    if count < SHORTEST:
        return False
    noise = quiet.steps(axis, at_top)
    if noise >= NOISIEST * top / step:
        return _stands_out(column[np.isfinite(column)], top, step)
    if not noise >= TOGGLING:
        return False
    # the best chance that a constant input has of one reading, and of that one before any larger
    chance = max(erf(1.0 / (2.0 * np.sqrt(2.0) * noise)), 1e-12)
    longest = max((after - first for first, after in runs(at_top)), default=0)
    if longest >= SHORTEST and longest * np.log(chance) + np.log(column.size) < np.log(CHANCE):
        return True
    equal, _, often = _often(column[np.isfinite(column)], top, step)
    by_chance = equal * np.log(2.0 * chance / (1.0 + chance))
    return noise >= 1.0 and often and by_chance < np.log(CHANCE)


def _stands_out(column: FloatArray, top: float, step: float) -> bool:
    """Tell whether the largest of readings (n,) comes more often than a rough motion that ends there by chance.

    One that goes on past no limit thins out towards its largest reading: that comes no more often than those below.
    """
    equal, mean, often = _often(column, top, step)
    # how often a Poisson count of this mean comes that often, from above
    return often and bool(equal * (1.0 - np.log(equal / mean)) - mean < np.log(CHANCE))


def _often(column: FloatArray, top: float, step: float) -> tuple[int, float, bool]:
    """Return how many of readings (n,) are the largest, how many a crest may have, and if they are more than that."""
    equal, expected = _equal(column, top, step)
    most = DENSER * expected
    return equal, most, equal >= FEWEST and equal > max(most, _most_frequent(column, top, step))


def _most_frequent(column: FloatArray, top: float, step: float) -> int:
    """Return how often the most frequent of the other large readings comes.

    A noiseless turning sensor whose turn is a whole number of readings repeats every one of them.
    """
    others = column[(column > NEAR_LARGEST * top) & (column < top - (0.5 + BELOW) * step)]
    if others.size == 0:
        return 0
    return int(np.max(np.unique(np.rint((top - others) / step), return_counts=True)[1]))


# ---------------------------------------------------------------------------------------------------- in words

#: how a person reads a sensor's unit: its name, and what a unit of it is worth
_READ = {"rad_s": ("deg/s", float(np.degrees(1.0))), "m_s2": ("m/s^2", 1.0), "uT": ("uT", 1.0)}
_SENSORS = {"magnetometer": "uT", "accelerometer": "m_s2", "gyroscope": "rad_s", "rate_reference": "rad_s"}


def clipping_notes(recording: Recording) -> list[str]:
    """Say of each sensor which axes stand at a limit and for how long, and which never change."""
    there = {s: samples for s in _SENSORS if (samples := recording.get(s)) is not None and len(samples)}

    def found(sensor: str) -> BoolArray:
        sheet, value = recording.sheets[sensor], there[sensor].value
        return clipped(value if value.ndim == 2 else value[:, None], sheet.range, sheet.resolution)

    # sorting millions of readings lets other threads run; for fewer it is not worth to begin them
    large = sum(len(samples) for samples in there.values()) > LARGE
    at_limits = side_by_side(found, list(there)) if large else [found(sensor) for sensor in there]
    notes = []
    for sensor, at_limit in zip(there, at_limits, strict=True):
        unit, samples = _SENSORS[sensor], there[sensor]
        table = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        constant = constant_axes(table)
        name, worth = _READ[unit]
        if constant.all() and sensor != "rate_reference":
            notes.append(
                f"{sensor}: all {len(samples)} readings are the same; it is dead, and nothing is taken from it"
            )
            continue
        for axis in np.flatnonzero(np.any(at_limit, axis=0)):
            known = max(int(np.count_nonzero(np.isfinite(table[:, axis]))), 1)
            share = 100 * int(np.count_nonzero(at_limit[:, axis])) / known
            level = float(np.median(np.abs(table[at_limit[:, axis], axis]))) * worth
            place = "" if table.shape[1] == 1 else f" {'xyz'[axis]}"
            stand = "every one of its readings stands" if share == 100 else f"{share:.2g} % of its readings stand"
            notes.append(f"{sensor}{place}: {stand} at a limit of {level:.6g} {name}: clipped, and not used")
    return notes
