"""How fast a gyroscope's log turns by what stands still in the room: the field, or gravity while a hand holds it.

Takes the readings of both; gives what one reading of the gyroscope is worth, and what that says of the clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.behaviour import TELLING, WORTHS
from discsim.validation.importing.sniffing.clock import Clock, written_unit
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Triple
from discsim.validation.importing.sniffing.magnitudes import PER_DEG_S, Unit, gravity_norm
from discsim.validation.importing.sniffing.pull import POSSIBLE
from discsim.validation.importing.sniffing.turning import Fit, best_worth, left_by, steps_between

__all__ = ["OFF_FITTED", "OFF_LOOSE", "SeenTurns", "clock_note", "rate_note", "seen_turns", "ticking"]

#: A hand holds it where the specific force is gravity to this share: it moves what it turns by less than 1 m/s^2.
HELD = 0.1
#: What a step from the gyroscope's rate and the field's turning may be off by, a share (one sigma): a gyroscope's scale
#: (3 % over parts and temperature), and what was found on four measured logs (1 to 6 %, rms 3 %).
OFF_FITTED = 0.04
#: ... and where small turns alone tell it: made logs, clipped for most of a throw, were 11 to 26 % off.
OFF_LOOSE = 0.2
#: How often too large a step of the stamps may be: a tick of 0.1 ms, 10 ms or 100 us that is taken for another unit.
TICKS = (10.0, 0.1, 100.0, 0.01, 1000.0, 0.001)
#: A ratio is a power of ten where it is one to this factor: a clock that is off by 30 % is the worst known.
POWER = 1.3
#: Rows a second that are stated, and those of the stamps, contradict from this factor on: an oscillator is off by some
#: per cent, and a logger that loses a tenth of its rows is common.
CONTRADICTS = 1.25
#: ... and a gyroscope's unit from this one on: units lie a factor of 6 and more apart.
CONTRADICTS_UNIT = 1.5


class SeenTurns(NamedTuple):
    """What one reading of a gyroscope is worth, rad/s, by the turning of ``by`` ("the field", "gravity")."""

    worth: float
    by: str


def seen_turns(found: Mapping[str, Triple], times: Mapping[str, FloatArray], fit: Fit | None) -> SeenTurns | None:
    """Return how fast the log turns by the field (``fit``: of the usual worths), else by gravity; None: none tells.

    ``times`` (n,) s are those of each sensor's rows. Stamps may be wrong by a power of ten: that is tried, too.
    """
    if fit is not None and fit.ratio < TELLING:
        return SeenTurns(fit.worth, "the field")
    if "gyroscope" not in found:
        return None
    gyro, t = found["gyroscope"], times["gyroscope"]
    if "magnetometer" in found:
        steps = steps_between(t, gyro.values, times["magnetometer"], found["magnetometer"].values)
        seen = best_worth(steps, [worth * tick for worth in WORTHS[:2] for tick in TICKS])
        if seen is not None and seen.ratio < TELLING:
            return SeenTurns(seen.worth, "the field")
    if "accelerometer" not in found:
        return None
    worth = _by_gravity(t, gyro.values, times["accelerometer"], found["accelerometer"].values)
    return None if worth is None else SeenTurns(worth, "gravity")


def _by_gravity(t: FloatArray, gyro: FloatArray, t_accel: FloatArray, accel: FloatArray) -> float | None:
    """Return what a reading of a gyroscope is worth, rad/s, by how gravity turns while a hand holds it; None of none.

    An accelerometer lies as the gyroscope of its chip does, and its offset is small (80 mg): neither is fitted.
    """
    held = np.abs(np.linalg.norm(accel, axis=1) / gravity_norm(_sound(accel)) - 1) < HELD
    steps = steps_between(t, gyro, t_accel, np.where(held[:, None], accel, np.nan))
    tried = [worth * tick for worth in WORTHS for tick in (1.0, *TICKS)]
    left = {worth: seen for worth in tried if (seen := left_by(steps, worth)) is not None}
    if not left or min(left.values()) > TELLING:
        return None
    best = min(left, key=lambda worth: left[worth])
    near = [float(best * factor) for factor in np.geomspace(1 / POWER, POWER, 13)]
    return min(near, key=lambda worth: left_by(steps, worth) or np.inf)


def _sound(value: FloatArray) -> FloatArray:
    return value[np.isfinite(value).all(axis=1)]


def clock_note(clock: Clock, unit: Unit, turns: SeenTurns | None, pull: float | None) -> str | None:
    """Return a warning where the log turns ten times (a power of it) as fast as its gyroscope and its stamps say.

    ``pull`` is the arm of the accelerometer by the gyroscope alone, m (`arm`), which tells the two apart; None where
    it does not show.
    """
    if clock.column is None or turns is None:
        return None
    ratio = turns.worth / unit.factor("rad_s")
    power = 10.0 ** round(float(np.log10(ratio)))
    if power == 1.0 or not 1 / POWER < ratio / power < POWER:
        return _uncertain_note(clock, unit, turns.by, ratio)
    rows = f"the rows are {power:g} times as far apart as '{clock.column}' in {clock.unit} says"
    scale = f"the gyroscope's readings are worth {power:g} times as much as {unit.unit}"
    why = "which of the two is open"
    if pull is not None:
        stamps, readings = (POSSIBLE[0] < one < POSSIBLE[1] for one in (pull, pull / power**2))
        if stamps != readings:
            why = f"the pull to the centre shows that {rows if stamps else scale}"
    return (
        f"WARNING: {turns.by} turns {ratio:.3g} times as fast as the gyroscope says: {rows}, or {scale}; {why}: "
        "mend the column, or every rate from the field, or every time, is wrong by that"
    )


def ticking(
    clock: Clock,
    unit: Unit,
    turns: SeenTurns | None,
    pull: float | None,
    found: Mapping[str, Triple],
    times: Mapping[str, FloatArray],
) -> Clock | None:
    """Return a clock of ticks whose unit is a guess with what a tick is worth by the field, None where that is open.

    The gyroscope's unit has to be stated, the stamps have to contradict it, and the pull to the centre must not show
    that they are right. Where the unit is likely, as that of whole numbers under a name of time, the pull must show
    that the gyroscope is. A count that is near a power of ten is taken for it.
    """
    if clock.column is None or clock.unit == "iso" or clock.scale != 1.0 or unit.decision.sure != "certain":
        return None
    if clock.decision.sure != "guess" and not _may_count(clock, turns, unit, pull, found["gyroscope"]):
        return None
    if turns is None or turns.by != "the field" or (pull is not None and not POSSIBLE[0] < pull < POSSIBLE[1]):
        return None
    stated = unit.factor("rad_s")
    if 1 / CONTRADICTS_UNIT < turns.worth / stated < CONTRADICTS_UNIT:
        return None
    # about powers of ten alone it was looked for: the best may lie between two of them
    gyro, field = (found[sensor].values for sensor in ("gyroscope", "magnetometer"))
    steps = steps_between(times["gyroscope"], gyro, times["magnetometer"], field)
    seen = best_worth(steps, [float(turns.worth * factor) for factor in np.geomspace(10**-0.5, 10**0.5, 9)])
    if seen is None or seen.ratio > TELLING:
        return None
    ratio = seen.worth / stated
    power = 10.0 ** round(float(np.log10(ratio)))
    whole = abs(ratio / power - 1) < 2 * OFF_FITTED
    scale = power if whole else float(f"{ratio:.3g}")
    why = (
        f"{clock.decision.why}; but with {scale:g} {clock.unit} a count the field turns as fast as the gyroscope says "
    )
    why += f"({unit.unit})" + f", to {100 * OFF_FITTED:.0f} %: write what a count is worth" * (not whole)
    told = Decision("time", f"'{clock.column}' in counts of {scale:g} {clock.unit}", "likely", why)
    return replace(clock, scale=scale, decision=told, off=0.0 if whole else OFF_FITTED)


def _may_count(clock: Clock, turns: SeenTurns | None, unit: Unit, pull: float | None, gyro: Triple) -> bool:
    """Tell whether whole numbers in no stated unit may be ticks: the pull is that of a gyroscope in its stated unit.

    By any unit as which the field would turn the pull has to be none that a disc can have.
    """
    numbers = gyro.numbers
    if clock.decision.sure != "likely" or turns is None or pull is None or clock.column not in numbers.table.columns:
        return False
    k = numbers.table.columns.index(clock.column)
    stamps, stated = numbers.values[:, k], unit.factor("rad_s")
    if written_unit(numbers.names[k]) is not None or np.any(stamps[np.isfinite(stamps)] % 1 != 0):
        return False
    worths = [*UNITS["rad_s"].values(), *(UNITS["rad_s"]["deg/s"] / per for per in PER_DEG_S)]
    other = any(1 / CONTRADICTS_UNIT < turns.worth / worth < CONTRADICTS_UNIT for worth in worths)
    by_it = pull * (stated / turns.worth) ** 2
    return POSSIBLE[0] < pull < POSSIBLE[1] and not (other and POSSIBLE[0] < by_it < POSSIBLE[1])


def _uncertain_note(clock: Clock, unit: Unit, by: str, ratio: float) -> str | None:
    """Return a warning where a clock that is not certain and a gyroscope's unit contradict by no power of ten."""
    if clock.decision.sure == "certain" or 1 / CONTRADICTS_UNIT < ratio < CONTRADICTS_UNIT:
        return None
    return (
        f"WARNING: {by} turns {ratio:.3g} times as fast as the gyroscope says: the rows are {ratio:.3g} times as far "
        f"apart as '{clock.column}' in {clock.unit} says, or the gyroscope is not in {unit.unit}; {unit.unit} is "
        f"believed: state the unit of '{clock.column}' in its name or in the map"
    )


def rate_note(clock: Clock, time: FloatArray, stated: tuple[float, str] | None) -> str | None:
    """Return a warning where the stamps (n,) s make other rows a second than ``stated`` (and the line that does)."""
    steps = np.diff(time[np.isfinite(time)])
    if clock.column is None or stated is None or not np.any(steps > 0):
        return None
    rate = 1 / float(np.median(steps[steps > 0]))
    if 1 / CONTRADICTS < rate / stated[0] < CONTRADICTS:
        return None
    return (
        f"WARNING: '{clock.column}' in {clock.unit} makes {rate:.4g} rows a second, but '{stated[1][:60]}' says "
        f"{stated[0]:.6g}: if that is the rate of this log, the column is in another unit; the column is believed"
    )
