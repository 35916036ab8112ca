"""A gyroscope's unit by the pull to the centre. Takes both sensors' readings; gives the arm, and a unit that fits it.

An accelerometer d from the axis reads r^2 d across it, Eq. (12): what a log in a wrong unit shows is an arm that no
thrown thing has.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.import_map import G0, UNITS
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.magnitudes import Unit
from discsim.validation.importing.sniffing.spin_axis import Reading3

__all__ = ["arm", "doubted", "steady_arm", "unit_by_pull"]

#: Fewest rows, and how much the rate changes over them (ninth tenth over first): the pull must follow its square.
ROWS, CHANGES = 30, 1.15
#: Median share by which the pull may miss the square: at 16 mm and 40 rad/s it is 26 m/s^2, and a wobble of 5 degrees
#: brings 0.8 m/s^2 of gravity across the axis.
MISSES = 0.1
#: A pull that follows no change of the rate is one where it is steadily by this factor more than gravity could read.
BEYOND = 1.2
#: ... and then a wobble may bring this share of it.
WOBBLES = 0.3
#: Arms in m that a disc, a wheel or a phone on a table can have, and from which on none has.
POSSIBLE, IMPOSSIBLE = (0.002, 0.5), 3.0
#: ... and down to which none has: chips are 3 mm wide, and nobody glues one to a twentieth of that.
NEAREST = 1.5e-4
#: Rates that a thing may have in rad/s (573 to 5730 deg/s) and, slowly turned by hand, in deg/s as well.
DOUBTED = (10.0, 100.0)


def arm(gyro: Reading3, accel: Reading3) -> float | None:
    """Return how far from the axis an accelerometer (m/s^2) sits by a gyroscope (rad/s), m; None where none shows."""
    size, across = _fast_rows(gyro, accel)
    if size.size < ROWS or not np.percentile(size, 90) > CHANGES * np.percentile(size, 10):
        return None
    return _by_square(size, across, MISSES)


def steady_arm(gyro: Reading3, accel: Reading3) -> float | None:
    """Return the same of a rate that hardly changes, as a throw's by itself; None where gravity could read as much."""
    size, across = _fast_rows(gyro, accel)
    if size.size < ROWS or not np.percentile(across, 5) > BEYOND * G0:
        return None
    return _by_square(size, across, WOBBLES)


def _fast_rows(gyro: Reading3, accel: Reading3) -> tuple[FloatArray, FloatArray]:
    """Return rates (n,) rad/s and forces across their axis (n,) m/s^2 where it turns fast; none where rows are few."""
    sound, there = np.isfinite(gyro.value).all(axis=1), np.isfinite(accel.value).all(axis=1)
    if sound.sum() < ROWS or there.sum() < ROWS:
        return np.zeros(0), np.zeros(0)
    rate = np.column_stack([np.interp(accel.t[there], gyro.t[sound], column) for column in gyro.value[sound].T])
    size = np.linalg.norm(rate, axis=1)
    fast = size > 0.5 * float(np.percentile(size, 99.5))
    force, axis = accel.value[there][fast], rate[fast] / size[fast, None]
    return size[fast], np.linalg.norm(force - np.sum(force * axis, axis=1)[:, None] * axis, axis=1)


def _by_square(size: FloatArray, across: FloatArray, misses: float) -> float | None:
    """Return the arm, m, by which forces across follow the square of the rate; None where they miss it by more."""
    arms = across / size**2
    middle = float(np.median(arms))
    return middle if np.median(np.abs(arms / middle - 1)) < misses else None


def unit_by_pull(unit: Unit, seen: float | None) -> Unit | None:
    """Return the unit by which the arm is possible where it is not by the one stated; None where nothing tells.

    One that was a guess gives way as soon as by it the arm is none that a disc can have, and is no guess where it is.
    """
    guessed = unit.decision.sure == "guess"
    if seen is None or (NEAREST < seen < IMPOSSIBLE and not guessed):
        return None
    shown = "the pull to the centre is that of {:.3g} mm from the axis"
    if guessed and unit.scale == 1.0 and POSSIBLE[0] < seen < POSSIBLE[1]:
        return unit._replace(decision=unit.decision._replace(sure="likely", why=shown.format(1000 * seen)))
    worths = UNITS["rad_s"]
    for one in ("rad/s", "deg/s"):
        size = seen * (worths[unit.unit] * unit.scale / worths[one]) ** 2
        if one != unit.unit and POSSIBLE[0] < size < POSSIBLE[1]:
            other = f"by {unit.unit} it would be {seen:.2g} m"
            if not guessed:
                other = f"although the header says {unit.unit}, by which it would be {seen:.2g} m"
            why = f"{shown.format(1000 * size)}, {other}"
            return Unit(one, 1.0, Decision("gyroscope unit", one, "likely", why))
    return None


def doubted(unit: Unit, peak: float, seen: float | None) -> Unit:
    """Return a gyroscope's unit in rad/s with the doubt that it may be deg/s, of a log in which nothing turns to tell.

    ``peak`` is its largest reading as written; ``seen`` the arm of the accelerometer in m, None where it does not show.
    """
    if (unit.unit, unit.scale, unit.decision.sure) != ("rad/s", 1.0, "certain") or not DOUBTED[0] < peak < DOUBTED[1]:
        return unit
    if seen is not None and POSSIBLE[0] < seen < POSSIBLE[1]:
        return unit
    why = (
        f"{unit.decision.why}; whether it is deg/s, up to {peak:.0f} deg/s, nothing here tells: no field and no "
        "gravity that turns, no pull to the centre"
    )
    return unit._replace(decision=unit.decision._replace(sure="likely", why=why))
