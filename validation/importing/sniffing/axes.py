"""How the sensors' axes lie in the body. Takes readings in SI; gives each sensor's axes for a map, and why.

Body z is the spin axis, down through the disc. Three steps: which axis turns, which way it points (gravity at rest,
lift in flight), and how the magnetometer lies on the gyroscope (`turning`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.importing.import_map import G0
from discsim.validation.importing.sniffing.decision import Decision, Sureness
from discsim.validation.importing.sniffing.turning import Fit, best_axes, steps_between

__all__ = ["BodyAxes", "Reading3", "body_axes", "letters"]

#: A turn a second: slower than any throw, faster than a hand turns a thing about one axis for long.
FAST = 2 * np.pi
#: Share of the rate's square on one axis that makes it the spin axis: an axis tilted by 25 degrees still has 0.82.
ONE_AXIS = 0.8
#: What is left of the field's changes (a ratio) where the gyroscope explains them; a wrong axis leaves 1 and more.
EXPLAINED = 0.5
#: ... and where it explains all but a tenth of their power.
CLEARLY = 0.3
#: Said where only mirrored axes lay the magnetometer on the gyroscope. All three reversed fit as well, and are told
#: apart by the field's dip: south of the equator ordinary axes look mirrored.
MIRRORED = (
    "gyroscope and magnetometer are mirror images of one another, if the field points down, as north of the equator: "
    "one of them has an axis reversed, or two swapped, unless their data sheets draw them so; which one is open, and "
    "with it the sign of the spin"
)
#: Ways to lay the axes are told apart where one leaves this much less than the other, in the ratio's own size.
APART = 0.8


@dataclass(frozen=True)
class Reading3:
    """A sensor's time (n,) s and values (n, 3) in SI (field in uT), in the axes that the log has."""

    t: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class BodyAxes:
    """Per sensor the matrix from its axes to the body's, what was decided, and the spin axis (None: no spin seen).

    ``notes`` are what a user should know besides.
    """

    matrix: Mapping[str, FloatArray]
    decisions: tuple[Decision, ...]
    spin_axis: int | None
    notes: tuple[str, ...] = ()


def letters(matrix: FloatArray) -> list[str]:
    """Return a signed permutation as a map writes it: body x, y, z from the sensor's axes."""
    return [f"{'-' if row[(k := int(np.argmax(np.abs(row))))] < 0 else ''}{'xyz'[k]}" for row in matrix]


def body_axes(sensors: Mapping[str, Reading3]) -> BodyAxes:
    """Return how the sensors present lie in the body."""
    axis, found = _spin_axis(sensors)
    spins = axis is not None
    if axis is None:
        axis, found = _lying_axis(sensors, found)
    if axis is None:
        base = np.eye(3)
        decisions = [found]
    else:
        down, why = _downward(axis, sensors, flies=spins)
        base = _towards_z(axis, down)
        decisions = [found, why]
    matrix = {sensor: base for sensor in sensors}
    gyro, field = sensors.get("gyroscope"), sensors.get("magnetometer")
    if gyro is not None and field is not None:
        laid, decision = _laid(gyro, field, sensors.get("accelerometer"))
        matrix["magnetometer"] = base @ laid
        decisions.append(decision)
        if np.linalg.det(laid) < 0:
            return BodyAxes(matrix, tuple(decisions), axis, (MIRRORED,))
    return BodyAxes(matrix, tuple(decisions), axis)


def _towards_z(axis: int, down: bool) -> FloatArray:
    """Return the rotation that makes a sensor's axis (or its opposite, where that points up) the body's z."""
    cyclic = np.roll(np.eye(3), axis - 2, axis=1)
    return cyclic if down else np.asarray(np.diag([1.0, -1.0, -1.0]) @ cyclic)


# ------------------------------------------------------------------------------------------------- spin axis


def _spin_axis(sensors: Mapping[str, Reading3]) -> tuple[int | None, Decision]:
    gyro = sensors.get("gyroscope")
    if gyro is not None:
        fast = _fast(gyro.value)
        if fast.sum() < 5:
            return None, _kept("no spin of a turn a second in it")
        share = np.nanmean(gyro.value[fast] ** 2, axis=0)
        share = share / share.sum()
        axis = int(np.argmax(share))
        if share[axis] < ONE_AXIS:
            return None, _kept(
                f"its fast motion has no one axis ({100 * share[axis]:.0f} % of the rate in the largest)"
            )
        sure: Sureness = "certain" if share[axis] > 0.9 else "likely"
        return axis, _said(axis, sure, f"{100 * share[axis]:.0f} % of the rate's square is on it where it spins")
    field = sensors.get("magnetometer")
    if field is None:
        return None, _kept("neither gyroscope nor magnetometer to show an axis")
    return _still_axis(field)


def _lying_axis(sensors: Mapping[str, Reading3], kept: Decision) -> tuple[int | None, Decision]:
    """Return the axis along gravity at rest: a disc lies on its axis, a rocket stands on it."""
    accel = sensors.get("accelerometer")
    if accel is None:
        return None, kept
    norm = np.linalg.norm(accel.value, axis=1)
    still = _still(accel, sensors.get("gyroscope")) & (np.abs(norm - G0) < 0.15 * G0)
    upright = np.abs(accel.value[still]) > 0.9 * norm[still, None]  # within 25 degrees
    share = upright.mean(axis=0) if len(upright) >= 10 else np.zeros(3)
    axis = int(np.argmax(share))
    if share[axis] < 0.5:
        return None, kept
    return axis, _said(axis, "guess", f"{kept.why}; gravity lies along it at rest")


def _still_axis(field: Reading3) -> tuple[int | None, Decision]:
    """Return the axis along which the field stands still while it goes round in the other two."""
    value = field.value[np.isfinite(field.value).all(axis=1)]
    size = max(16, len(value) // 200)
    windows = value[: len(value) // size * size].reshape(-1, size, 3)
    spread = windows.var(axis=1) if len(windows) else value.var(axis=0)[None]
    # the windows where the field turns most, which a swing alone does not fill in two axes
    turning = np.sort(spread, axis=1)[:, 1]
    busy = spread[turning >= 0.5 * turning.max()].mean(axis=0)
    axis = int(np.argmin(busy))
    others = np.delete(busy, axis).min()
    if others < 4 * busy[axis]:
        return None, _kept("the field stands still along no axis while it turns")
    sure: Sureness = "likely" if others > 10 * busy[axis] else "guess"
    return axis, _said(axis, sure, "the field goes round in the other two and moves least along it")


def _fast(rate: FloatArray) -> BoolArray:
    """Return the rows of at least half the largest rate that is kept for more than a few rows, (n,)."""
    norm = np.linalg.norm(rate, axis=1)
    norm = np.where(np.isfinite(norm), norm, 0.0)
    top = np.sort(norm)[-min(norm.size, max(5, norm.size // 200))]
    return np.asarray((norm >= 0.5 * top) & (norm > FAST))


def _kept(why: str) -> Decision:
    return Decision("spin axis", "none, axes stay as written", "guess", why)


def _said(axis: int, sure: Sureness, why: str) -> Decision:
    return Decision("spin axis", f"the board's {'xyz'[axis]}", sure, why)


# ---------------------------------------------------------------------------------------------- which end is down


def _downward(axis: int, sensors: Mapping[str, Reading3], *, flies: bool) -> tuple[bool, Decision]:
    """Tell whether the sensor's axis points down: at rest it then reads -g, in flight lift is against it."""
    what, name = "body z", "xyz"[axis]
    accel = sensors.get("accelerometer")
    if accel is None:
        why = "no accelerometer to tell up from down, so the direction of spin is open"
        return True, Decision(what, f"along {name}", "guess", why)
    along, norm = accel.value[:, axis], np.linalg.norm(accel.value, axis=1)
    still = _still(accel, sensors.get("gyroscope")) & (np.abs(norm - G0) < 0.15 * G0)
    upright = still & (np.abs(along) > 0.7 * G0)  # within 45 degrees
    rest = float(np.sign(along[upright]).mean()) if upright.sum() >= 10 else 0.0
    flight = _lift(axis, sensors) if flies else 0.0
    if abs(rest) > 0.8 and not flight * rest < 0:
        sure: Sureness = "certain" if upright.sum() > 0.5 * still.sum() else "likely"
        why = f"at rest it reads {np.median(along[upright]):+.3g} m/s^2; lying upright is assumed"
        return rest < 0, Decision(what, _points(name, rest < 0), sure, why)
    if flight != 0:
        why = f"in flight it reads {flight:+.2g} m/s^2, and lift is upward; flown upright is assumed"
        return flight < 0, Decision(what, _points(name, flight < 0), "likely", why)
    if rest != 0:
        why = f"it lies {100 * max(1 + rest, 1 - rest) / 2:.0f} % of its rest this way up"
        return rest < 0, Decision(what, _points(name, rest < 0), "guess", why)
    why = "gravity is never along it at rest, so the direction of spin is open"
    return True, Decision(what, f"along {name}", "guess", why)


def _points(name: str, down: bool) -> str:
    return f"along {name}, which points {'down' if down else 'up and is reversed'}"


def _still(accel: Reading3, gyro: Reading3 | None) -> BoolArray:
    """Return the rows without a jump (5 % of g from the row before) and without turning, (n,)."""
    step = np.linalg.norm(np.diff(accel.value, axis=0, prepend=accel.value[:1]), axis=1)
    still = step < 0.05 * G0
    if gyro is not None:
        rate = np.interp(accel.t, gyro.t, np.nan_to_num(np.linalg.norm(gyro.value, axis=1), nan=np.inf))
        still &= rate < 1.0  # rad/s: centripetal pull at 0.1 m is then 1 % of g
    return np.asarray(still)


def _lift(axis: int, sensors: Mapping[str, Reading3]) -> float:
    """Return the mean specific force along the axis while it spins fast, m/s^2; 0 where it is below a third of g."""
    accel, gyro = sensors["accelerometer"], sensors.get("gyroscope")
    if gyro is None:
        return 0.0
    fast = np.interp(accel.t, gyro.t, _fast(gyro.value).astype(float)) > 0.99
    if fast.sum() < 20:
        return 0.0
    mean = float(np.nanmedian(accel.value[fast, axis]))
    # lift carries at least about a third of the weight over a flight; less may be a centripetal pull that leaks
    return mean if abs(mean) > G0 / 3 else 0.0


# ----------------------------------------------------------------------------- magnetometer on gyroscope


def _laid(gyro: Reading3, field: Reading3, accel: Reading3 | None) -> tuple[FloatArray, Decision]:
    """Return the matrix from the magnetometer's axes to the gyroscope's, and why."""
    what = "magnetometer axes"
    steps = steps_between(gyro.t, gyro.value, field.t, field.value)
    fits = best_axes(steps, 1.0)
    if not fits:
        return np.eye(3), Decision(what, "as the gyroscope's", "guess", "too few turns to compare them")
    best = fits[0]
    if best.ratio > EXPLAINED:
        why = f"the gyroscope leaves {100 * best.ratio:.0f} % of the field's changes whichever way they lie"
        return np.eye(3), Decision(what, "as the gyroscope's", "guess", why)
    alike = [fit for fit in fits if fit.overall * APART <= best.overall]
    if any(np.array_equal(fit.axes, np.eye(3)) for fit in alike):
        same = fits[[np.array_equal(fit.axes, np.eye(3)) for fit in fits].index(True)]
        sure: Sureness = "certain" if len(alike) <= 2 and same.ratio < CLEARLY else "likely"
        why = f"so the field turns as the gyroscope says ({100 * same.ratio:.0f} % of its changes left)"
        why += "" if len(alike) <= 2 else f"; {len(alike) - 1} other ways fit as well"
        return np.eye(3), Decision(what, "as the gyroscope's", sure, why)
    chosen, by = _of_two(alike, field, accel)
    named = " ".join(letters(chosen.axes))
    left = next(f.ratio for f in fits if np.array_equal(f.axes, np.eye(3)))
    why = f"{100 * chosen.ratio:.0f} % of the field's changes are left, {100 * left:.0f} % if they lay as written{by}"
    return chosen.axes, Decision(what, f"{named} in the gyroscope's", "likely" if len(alike) <= 2 else "guess", why)


def _of_two(alike: list[Fit], field: Reading3, accel: Reading3 | None) -> tuple[Fit, str]:
    """Choose among ways that fit alike: all three axes reversed fit as well, and the field's dip tells them apart.

    North of the equator, where nine people of ten live, the field points down.
    """
    ranked = sorted(
        alike, key=lambda fit: (round(fit.overall, 2), np.linalg.det(fit.axes) < 0, -float(np.trace(fit.axes)))
    )
    best = min(ranked, key=lambda fit: fit.overall * (1.0 if np.linalg.det(fit.axes) > 0 else 1.001))
    pair = [fit for fit in ranked if np.array_equal(fit.axes, best.axes) or np.array_equal(fit.axes, -best.axes)]
    if accel is None or len(pair) < 2:
        return best, ""
    still = _still(accel, None) & (np.abs(np.linalg.norm(accel.value, axis=1) - G0) < 0.15 * G0)
    if still.sum() < 10:
        return best, ""
    t, up = accel.t[still], accel.value[still] / G0
    there = np.column_stack([np.interp(t, field.t, field.value[:, k]) for k in range(3)])
    upward = [float(np.median(np.sum((there @ fit.axes.T - fit.offset) * up, axis=1))) for fit in pair]
    return pair[int(np.argmin(upward))], "; of this and all three reversed, this has the field point down at rest"
