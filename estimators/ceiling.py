"""A gyroscope's limit behind which noise is added or a filter sits: its readings scatter about it and none is equal.

`discsim.clipping` knows a limit by equal readings. Here it is known by a level that stays where the motion cannot: a
free spin slows down, and other sensors say more. A rate table's steady rate stays as well, and is none.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs, sd_by_median
from discsim.clipping import step_of
from discsim.recording import Recording, Samples

__all__ = ["Ceiling", "ceiling"]

#: Blocks of readings whose means are looked at: a tenth of a second, and eight readings at least, whose mean is normal.
BLOCK, LEAST_READINGS = 0.1, 8
#: Fewest blocks on end of a level: a line through six leaves four degrees of freedom for its scatter.
LEAST_BLOCKS = 6
#: Largest share of readings at a stated range that scatter about it: half of them are beyond it, and a few more.
MOST_EQUAL = 0.6
#: Standard deviations beyond which a block is none of a level, or a slope is shown: 6e-5 of normal ones.
SURE = 4.0
#: A free spin slows down by this share of itself a second at least: air gives a disc 1/60 to 1/15.
SLOWING = 0.005
#: Full scales of gyroscopes, deg/s, as data sheets state them; 16 bits of 70 mdps end at 2294 (ST's "2000").
FULL_SCALES = (2000.0, 2294.0, 4000.0)
#: The lower ranges of the same parts: where a table may be set as well, another sensor has to say more.
LOWER_SCALES = (125.0, 143.4, 250.0, 286.7, 500.0, 573.4, 1000.0, 1147.0)
#: A part's full scale is off by its scale error: 3 % over parts and temperature, mostly less than one.
SCALE = 0.015
#: Another sensor says more from this share on: beyond the scale of any gyroscope (3 %), and a radius 1 mm off at 16 mm.
MORE_BY_FIELD, MORE_BY_PULL = 0.05, 0.15
#: The field's line says nothing from this share of half its sampling rate on, where it may be folded.
UNFOLDED = 0.9
#: Turns, at a level, in which the field's line is sought, and the spacing of what is tried, in turns in that time: a
#: tenth of three turns is 3 %, less than what counts as more.
TURNS, FINE = 3.0, 0.1
#: A line is one that holds this share of the field's change across z: noise of 5 uT in 20 leaves 0.9.
LINE = 0.5
#: A steady level below this share of the highest, and above this, is a dwell of a table: a free spin has none.
DWELL = (0.1, 0.9)


class Ceiling(NamedTuple):
    """The limit of a gyroscope's z, rad/s; the size from which on a reading is of it; and what shows it."""

    level: float
    least: float
    why: str


class _Plateau(NamedTuple):
    level: float
    sigma: float
    start: float
    stop: float
    falls: bool


def ceiling(recording: Recording) -> Ceiling | None:
    """Return the limit about which the readings of a gyroscope's z scatter, or None where nothing shows one."""
    gyroscope = recording.get("gyroscope")
    if gyroscope is None or gyroscope.value.ndim != 2 or len(gyroscope) < LEAST_BLOCKS * LEAST_READINGS:
        return None
    sheet = recording.sheets["gyroscope"]
    clipped = sheet.clipped(gyroscope.value)[:, 2]
    if np.mean(clipped) > MOST_EQUAL or (sheet.range is None and np.any(clipped)):
        return None  # it shows its limit by equal readings
    found = _plateau(gyroscope.t, np.abs(gyroscope.value[:, 2]), gyroscope.interval)
    if found is None or not (why := _why(recording, found, gyroscope)):
        return None
    return Ceiling(found.level, found.level - SURE * found.sigma, why)


def _plateau(t: FloatArray, z: FloatArray, interval: float) -> _Plateau | None:
    """Return the highest level at which sizes z (n,) at times t stay, or None where they stay at none or at several."""
    width = max(round(BLOCK / interval), LEAST_READINGS)
    count = z.size // width
    blocks, times = z[: count * width].reshape(count, width), t[: count * width].reshape(count, width)
    mean, middle = np.mean(blocks, axis=1), np.mean(times, axis=1)  # NaN where a reading is missing
    known = np.isfinite(mean)
    if np.count_nonzero(known) < LEAST_BLOCKS:
        return None
    top = float(np.quantile(mean[known], 0.9))
    scatter = float(np.median(np.std(blocks[known & (mean > DWELL[1] * top)], axis=1)))
    with np.errstate(invalid="ignore"):
        near = np.abs(mean - top) < max(2.0 * SURE * scatter / np.sqrt(width), SLOWING * top)
    first, after = max(runs(near), key=lambda run: run[1] - run[0], default=(0, 0))
    if after - first < LEAST_BLOCKS or _dwells(mean, top, scatter):
        return None
    level, slope, off = _line(middle[first:after], mean[first:after])
    falls = slope < -SURE * off or SURE * off > SLOWING * level or abs(slope) > SLOWING * level
    readings = blocks[first:after].ravel()
    sigma = max(float(sd_by_median(readings - np.median(readings))), 1e-4 * level)
    return _Plateau(level, sigma, float(times[first, 0]), float(times[after - 1, -1]), bool(falls))


def _line(t: FloatArray, mean: FloatArray) -> tuple[float, float, float]:
    """Return the level of means (n,) at times t, their slope a second, and what that may be off by."""
    slope, level = np.polyfit(t - np.mean(t), mean, 1)
    left = mean - level - slope * (t - np.mean(t))
    off = np.sqrt(np.sum(left**2) / (t.size - 2) / np.sum((t - np.mean(t)) ** 2))
    return float(level), float(slope), float(off)


def _dwells(mean: FloatArray, top: float, scatter: float) -> bool:
    """Tell whether the means of blocks (n,) stay at a lower level, too, as those of a table do."""
    with np.errstate(invalid="ignore"):
        lower = (mean > DWELL[0] * top) & (mean < DWELL[1] * top)
        still = np.abs(np.diff(mean)) < max(SURE * scatter / np.sqrt(LEAST_READINGS), 0.1 * SLOWING * top)
    steady = lower[1:] & lower[:-1] & still
    return any(after - first >= LEAST_BLOCKS for first, after in runs(steady))


def _why(recording: Recording, found: _Plateau, gyroscope: Samples) -> str:
    """Say what shows that a level is a limit; empty where nothing does."""
    stated, level = recording.sheets["gyroscope"].range, float(np.degrees(found.level))
    if stated is not None and abs(found.level - stated) < SURE * found.sigma:
        return "the range that is stated"
    if not _among(level, (*FULL_SCALES, *LOWER_SCALES)):
        return ""
    others = [other for other in (_by_field(recording, found), _by_pull(recording, found)) if other is not None]
    if (sensor := next((name for name, more in others if more), None)) is not None:
        return f"a full scale of gyroscopes, and the {sensor} shows more"
    if others or found.falls or recording.plant not in ("flight", "free_spin"):
        return ""
    own = float(np.degrees(step_of(gyroscope.value))) * 2**15
    wider = 1e3 < own < 1e4 and not _among(level, (own,))
    if wider or not _among(level, FULL_SCALES):
        return ""
    return 'a full scale of gyroscopes, and no free spin stays as fast (on a table state plant = "rate_table")'


def _among(level: float, scales: tuple[float, ...]) -> bool:
    return any(abs(level / scale - 1.0) < SCALE for scale in scales)


def _within(samples: Samples, found: _Plateau) -> BoolArray:
    return np.asarray((samples.t >= found.start) & (samples.t <= found.stop))


def _by_field(recording: Recording, found: _Plateau) -> tuple[str, bool] | None:
    """Tell whether the field turns faster than a level, or None where it does not tell."""
    samples = recording.get("magnetometer")
    if samples is None or len(samples) < 2:
        return None
    inside = _within(samples, found)
    t, m = samples.t[inside], samples.value[inside, 0] + 1j * samples.value[inside, 1]
    t, m = t[np.isfinite(m)], m[np.isfinite(m)]
    highest = UNFOLDED * np.pi / samples.interval
    if t.size < 3 * LEAST_READINGS or found.level > highest:
        return None
    # a spin that slows leaves a line in a few turns, and none in many
    some = t < t[0] + max(TURNS * 2.0 * np.pi / found.level, LEAST_BLOCKS * BLOCK)
    t, about = t[some], m[some] - np.mean(m[some])
    turns = np.arange(-highest, highest, FINE * 2.0 * np.pi / float(t[-1] - t[0]))
    power = np.abs(np.exp(-1j * np.outer(turns, t)) @ about) ** 2
    best = int(np.argmax(power))
    if power[best] < LINE * t.size * float(np.sum(np.abs(about) ** 2)):
        return None
    return "magnetometer", bool(abs(turns[best]) > (1.0 + MORE_BY_FIELD) * found.level)


def _by_pull(recording: Recording, found: _Plateau) -> tuple[str, bool] | None:
    """Tell whether an accelerometer in a known place is pulled by more than a level makes, or None without one."""
    samples = recording.get("accelerometer")
    if samples is None or (place := recording.sheets["accelerometer"].position) is None:
        return None
    radius = float(np.hypot(*place[:2]))
    across = samples.value[_within(samples, found), :2]
    across = across[np.all(np.isfinite(across), axis=1)]
    if not radius > 0.005 or len(across) < LEAST_READINGS:
        return None
    rate = float(np.sqrt(np.hypot(*np.mean(across, axis=0)) / radius))
    return "accelerometer", rate > (1.0 + MORE_BY_PULL) * found.level
