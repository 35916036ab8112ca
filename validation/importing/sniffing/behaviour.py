"""What sensor a triple without a telling name is. Takes triples and time; gives each one's sensor, how sure and why."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Triple
from discsim.validation.importing.sniffing.magnitudes import FIELD, PER_G, REST, field_size, gravity_norm, rest_norm
from discsim.validation.importing.sniffing.turning import best_worth, steps_between

__all__ = [
    "STILL",
    "TELLING",
    "WORTHS",
    "by_behaviour",
    "gyroscopes_alike",
    "lines_of_a_record",
    "looks_like",
    "rests_aslant",
]

#: What one reading of a gyroscope may be worth, rad/s: rad/s, deg/s, mdeg/s, and counts of 16 bits over 2000 deg/s.
WORTHS = (1.0, np.pi / 180, np.pi / 180e3, np.pi / 180 / 16.384)
#: What a gyroscope leaves of the changes of the field, or of gravity, at most (a ratio) where it is believed by it.
TELLING = 0.35
#: At rest a gyroscope reads its offset, below 20 deg/s, and in a spin hundreds: less than a tenth of its largest.
STILL = 0.1
#: Records over so many lines, and in what share of pairs of records one line's readings are larger than another's:
#: among `RECORDS` records of one sensor that happens with a chance of 3e-5 (Mann and Whitney, 1947). `MOST` tell it.
LINES, LARGER, RECORDS, MOST = (2, 3, 4), 0.98, 12, 200
#: Means over 16 rows of one size, to 5 %, most of which lie this far aslant to others (cosine of 20 degrees) are
#: gravity's: what turns steadily, and so reads a steady rate, keeps its axis.
ALIKE, ASLANT = 0.05, np.cos(np.radians(20.0))
#: What is an accelerometer's reading less gravity changes from row to row as it does, noise and all: on each axis with
#: a correlation near 1, as gravity turns slowly. Two sensors' noise has none, and a twentieth of it in 500 rows.
GOES_AS = 0.9


def by_behaviour(triples: Sequence[Triple], times: Sequence[FloatArray]) -> list[tuple[Triple, str, Decision]]:
    """Return triples with the sensors that their readings show; those that show none are left out.

    A gyroscope is near zero at rest and explains how another triple, the magnetometer, turns; an accelerometer reads
    gravity at rest. ``times`` are the seconds of each triple's rows.
    """
    found: list[tuple[Triple, str, Decision]] = []
    left = [k for k, one in enumerate(triples) if _moves(one.values) and not lines_of_a_record(one.values)]
    for k in list(left):
        why = _gravity(triples[k].values) if k in left else ""
        if why and not any(sensor == "accelerometer" for _, sensor, _ in found):
            found.append((triples[k], "accelerometer", _said("accelerometer", triples[k], why)))
            left = _clear_of(triples, [k], left)
    pair = _turning_pair(triples, times, left)
    if pair is not None:
        gyro, field, ratio = pair
        why = f"it says how {triples[field].label} turns ({100 * ratio:.0f} % of the changes left)"
        found.append((triples[gyro], "gyroscope", _said("gyroscope", triples[gyro], why)))
        sensor, why = "magnetometer", f"it turns as {triples[gyro].label} says"
        if (weight := _weight(triples[field].values)[0]) and not any(known == "accelerometer" for _, known, _ in found):
            sensor, why = "accelerometer", f"{why}, and {weight} is gravity, no field of the earth's"
        found.append((triples[field], sensor, _said(sensor, triples[field], why)))
        left = _clear_of(triples, [gyro, field], left)
    found += _at_rest(triples, left, found)
    left = _clear_of(triples, [triples.index(triple) for triple, _, _ in found], left)
    left = _not_derived(triples, left, found)
    if len(gyroscopes_alike([triples[k] for k in left])) > 1:
        left = [k for k in left if _alone(triples[k].values)[0] != "gyroscope"]  # either may be the gyroscope
    for k in list(left):
        sensor, why = _alone(triples[k].values) if k in left else ("", "")
        if sensor and not any(known == sensor for _, known, _ in found):
            found.append((triples[k], sensor, _guess(sensor, triples[k], why)))
            left = _clear_of(triples, [k], left)
    return found


def _at_rest(
    triples: Sequence[Triple], left: Sequence[int], found: Sequence[tuple[Triple, str, Decision]]
) -> list[tuple[Triple, str, Decision]]:
    """Return an accelerometer that does nothing but rest, and the gyroscope beside one, as loggers write the two.

    Both are guesses: three numbers that rest at 1 may be anything, and what stands beside an accelerometer mostly is
    its gyroscope.
    """
    told = {sensor: triple for triple, sensor, _ in found}
    guessed: list[tuple[Triple, str, Decision]] = []
    if "accelerometer" not in told:
        weights = {k: _weight(triples[k].values) for k in left}
        resting = [k for k in left if weights[k][0] and any(_beside(triples[k], triples[other]) for other in left)]
        if resting:
            best = min(resting, key=lambda k: (weights[k][1], k))
            why = f"{weights[best][0]} throughout is gravity; nothing moves it"
            guessed.append((triples[best], "accelerometer", _guess("accelerometer", triples[best], why)))
            told["accelerometer"] = triples[best]
    if "accelerometer" in told and "gyroscope" not in told:
        own = _not_derived(triples, left, [(told["accelerometer"], "accelerometer", None)])
        behind = [triples[k] for k in own if _beside(told["accelerometer"], triples[k])]
        if behind:
            why = "the three columns beside the accelerometer's"
            guessed.append((behind[0], "gyroscope", _guess("gyroscope", behind[0], why)))
    return guessed


def _not_derived(
    triples: Sequence[Triple], left: Sequence[int], found: Sequence[tuple[Triple, str, Decision | None]]
) -> list[int]:
    """Return those of ``left`` that do not go as an accelerometer found: an acceleration without gravity does."""
    accels = [triple for triple, sensor, _ in found if sensor == "accelerometer"]
    return [k for k in left if not any(_goes_as(triples[k], accel) for accel in accels)]


def _goes_as(one: Triple, other: Triple) -> bool:
    """Tell whether a triple changes from row to row as another one of its rows does, axis by axis."""
    if one.numbers is not other.numbers or one.where != other.where:
        return False
    both = np.column_stack([one.values, other.values])
    steps = np.diff(both[np.isfinite(both).all(axis=1)], axis=0)
    if len(steps) < RECORDS or not np.all(np.ptp(steps, axis=0) > 0):
        return False
    return bool(min(np.corrcoef(steps[:, k], steps[:, k + 3])[0, 1] for k in range(3)) > GOES_AS)


def gyroscopes_alike(triples: Sequence[Triple], accel: Triple | None = None) -> list[Triple]:
    """Return the triples that share no column and read as a gyroscope does, by their size alone.

    What goes as an accelerometer ``accel`` is none of them.
    """
    alike: list[Triple] = []
    for triple in triples:
        moves = _moves(triple.values) and not any(_overlap(triple, one) for one in alike)
        derived = accel is not None and _goes_as(triple, accel)
        if moves and not derived and _alone(triple.values)[0] == "gyroscope":
            alike.append(triple)
    return alike


def _beside(one: Triple, other: Triple) -> bool:
    """Tell whether the columns of a triple are the next ones behind another's, or else those before it."""
    same = one.numbers is other.numbers and one.where == other.where
    return same and other.columns[0] - one.columns[0] in (3, -3)


def lines_of_a_record(value: FloatArray) -> int:
    """Return over how many rows a record of several sensors goes in readings (n, 3), 0 where each row is one.

    In such a record the readings of one row are larger than those of another in nearly all records.
    """
    size = np.linalg.norm(value[np.isfinite(value).all(axis=1)][: max(LINES) * MOST], axis=1)
    for lines in LINES:
        records = min(len(size) // lines, MOST)
        if records < RECORDS:
            return 0
        each = size[: records * lines].reshape(records, lines).T
        larger = [np.mean(one[:, None] > other) for one, other in permutations(each, 2)]
        if max(larger) > LARGER:
            return lines
    return 0


def looks_like(value: FloatArray) -> tuple[str, str]:
    """Return what sensor readings (n, 3) as written are by their size alone, and why; empty where that does not tell.

    An accelerometer's quietest readings and those that it shares most are both gravity: a gyroscope on a table that
    turns at 1000 deg/s for long shares 1000, but is quietest at nothing.
    """
    sound = value[np.isfinite(value).all(axis=1)]
    why = _gravity(sound)
    if why and abs(rest_norm(sound) / gravity_norm(sound) - 1) < REST:
        return "accelerometer", why
    return _alone(sound)


def rests_aslant(value: FloatArray) -> str:
    """Return why readings (n, 3) are gravity's although in no usual unit; empty where they do not show it."""
    sound = value[np.isfinite(value).all(axis=1)]
    count = len(sound) // 16
    means = sound[: count * 16].reshape(count, 16, 3).mean(axis=1)
    size = np.linalg.norm(means, axis=1)
    shared = float(np.median(size)) if count else 0.0
    alike = (np.abs(size - shared) < ALIKE * shared) & (size > 0)
    resting = means[alike] / size[alike, None]
    if len(resting) < max(4, count / 2) or np.min(resting @ resting.T) > ASLANT:
        return ""
    return f"it reads {shared:.4g} most of the time, in directions that differ"


def _clear_of(triples: Sequence[Triple], taken: Sequence[int], left: Sequence[int]) -> list[int]:
    """Return those of ``left`` that share no column with the triples taken: a column is one sensor's."""
    return [k for k in left if not any(_overlap(triples[k], triples[one]) for one in taken)]


def _overlap(a: Triple, b: Triple) -> bool:
    return a.numbers is b.numbers and a.where == b.where and bool(set(a.columns) & set(b.columns))


def _said(sensor: str, triple: Triple, why: str) -> Decision:
    return Decision(sensor, triple.label, "likely", why)


def _guess(sensor: str, triple: Triple, why: str) -> Decision:
    return Decision(sensor, triple.label, "guess", why)


def _moves(value: FloatArray) -> bool:
    """Tell three components of a vector: each moves, and no two are copies, as prices of one day are."""
    sound = value[np.isfinite(value).all(axis=1)]
    if not np.all(np.ptp(sound, axis=0) > 0):
        return False
    return bool(np.abs(np.corrcoef(sound.T))[np.triu_indices(3, 1)].min() < 0.9)


def _gravity(value: FloatArray) -> str:
    """Return why a triple is an accelerometer; empty where it is none that this shows."""
    sound = value[np.isfinite(value).all(axis=1)]
    rest = gravity_norm(sound)
    peak = float(np.percentile(np.linalg.norm(sound, axis=1), 99.9))
    near = [one for one in _weights(sound, PER_G) if abs(rest / one - 1) < REST]
    # a field of 10 or 1000 in some unit stays what it is when the thing is thrown; a specific force does not
    return f"{rest:.4g} at rest is gravity, and it reaches {peak:.3g}" if near and peak > 1.5 * rest else ""


def _weights(value: FloatArray, per_g: Sequence[float]) -> tuple[float, ...]:
    """Return what gravity may be in readings (n, 3): whole numbers are mg or counts, as m/s^2 are too coarse."""
    return (1000.0, *per_g) if np.all(value == np.round(value)) else (9.80665, 1.0, 1000.0)


def _weight(value: FloatArray) -> tuple[str, float]:
    """Return the size of readings (n, 3) that is gravity's in most rows, and by what share it is off; empty of others.

    Gravity is in m/s^2, g, mg, or in counts where all numbers are whole.
    """
    sound = value[np.isfinite(value).all(axis=1)]
    size = np.linalg.norm(sound, axis=1)
    shared = float(np.median(size))
    off = min(abs(shared / one - 1) for one in _weights(sound, PER_G[:4]))
    near = off < REST and np.mean(np.abs(size - shared) < REST * shared) > 0.5
    return (f"{shared:.4g}", off) if near else ("", off)


def _turning_pair(
    triples: Sequence[Triple], times: Sequence[FloatArray], left: Sequence[int]
) -> tuple[int, int, float] | None:
    best = None
    for gyro, field in permutations(left, 2):
        if _overlap(triples[gyro], triples[field]):
            continue
        steps = steps_between(times[gyro], triples[gyro].values, times[field], triples[field].values)
        fit = best_worth(steps, WORTHS)
        if fit is not None and fit.ratio < TELLING and (best is None or fit.ratio < best[2]):
            best = (gyro, field, fit.ratio)
    return best


def _alone(value: FloatArray) -> tuple[str, str]:
    sound = value[np.isfinite(value).all(axis=1)]
    norm = np.linalg.norm(sound, axis=1)
    rest, peak = rest_norm(sound), float(np.percentile(norm, 99.5))
    if rest < STILL * peak:
        return "gyroscope", f"{rest:.3g} at rest, up to {peak:.3g}"
    size, what = field_size(sound)
    steady = float(np.percentile(norm, 90)) < 3 * float(np.percentile(norm, 10))
    if steady and any(FIELD[0] <= size * factor <= FIELD[1] for factor in (1.0, 0.1, 100.0, 1e-3)):
        return "magnetometer", f"{size:.4g} ({what}) is the earth's field, and its size hardly changes"
    return "", ""
