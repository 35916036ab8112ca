"""How the sensors' axes lie in the body. Takes readings in SI; gives each sensor's axes for a map, and why.

Body z is the spin axis, down through the disc. Three steps: which axis turns, which way it points (gravity at rest,
lift in flight), and how the magnetometer lies on the gyroscope (`turning`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.estimators.fusion import FASTEST_THROW
from discsim.validation.importing.import_map import G0
from discsim.validation.importing.sniffing.decision import Decision, Sureness
from discsim.validation.importing.sniffing.spin_axis import (
    MOST_LIFT,
    Reading3,
    along_spin,
    lying_axis,
    odd_one,
    resting,
    spin_axis,
    while_spinning,
)
from discsim.validation.importing.sniffing.turning import Fit, best_axes, steps_between

__all__ = ["BodyAxes", "body_axes", "letters"]

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
#: Share of steps in which the field goes round one way, where it spins and does not tumble.
ONE_WAY = 0.9
AS_WRITTEN = "as the gyroscope's"
#: Ways to lay the axes are told apart where one leaves this much less than the other, in the ratio's own size.
APART = 0.8
#: A gyroscope is mirrored where that leaves less than this share of what the best axes of a field leave: 0.74 and 0.82
#: where an axis is reversed, 1.7 and more where it is the magnetometer's, and noise ranks them by 2 %.
FEWER = 0.9
#: Noise alone ranks ways that leave no more than this times the least, in a log of 300 rows and more.
SAME = 1.02
#: How magnetometers lie on the gyroscope of their package by its data sheet: in an ICM-20948, in an MPU-9250.
OF_PARTS = ("x -y -z", "y x -z")
#: Share of the field that must be along the vertical for its sign to tell anything: a dip of 12 degrees.
UP = 0.2
#: Said where a magnetometer lies as the gyroscope and its field points up at rest.
UPWARD = (
    "the field points up while the log lies still: it was made south of the equator, or the accelerometer shows "
    "gravity itself (-1 g along the axis that points up, as iPhones do; then the spin is of the other sense: turn the "
    "sign of its scale in the map, and up and down of all axes), or the magnetometer is reversed; --place tells"
)
#: Share of the readings in a spin that stand at one limit, above which a gyroscope tells no rate but that it is faster.
CLIPPED = 0.5


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


def body_axes(sensors: Mapping[str, Reading3], field_down: float | None = None) -> BodyAxes:
    """Return how the sensors present lie in the body.

    ``field_down`` is the share of the field that points down at the place, None where that is not known.
    """
    odd = odd_one(sensors)
    if odd is not None and odd.sensor == "magnetometer" and (fits := _compared(sensors)) and fits[0].ratio <= EXPLAINED:
        odd = None  # step by step it shows how it lies
    straight = sensors if odd is None else odd.straightened(sensors)
    axis, found = spin_axis(straight)
    spins = axis is not None
    if axis is None:
        axis, found = lying_axis(straight, found.why)
    both = "gyroscope" in sensors and "magnetometer" in sensors
    lies = _laid(straight, axis if spins else None, field_down) if both else None
    if axis is None:
        base = np.eye(3)
        decisions = [found]
    else:
        down, why = _downward(axis, straight, flies=spins)
        if "accelerometer" not in sensors and "magnetometer" in sensors:
            down, why = _downward_by_field(axis, straight["magnetometer"], lies, field_down, why)
        base = _towards_z(axis, down)
        decisions = [found, why]
    matrix = {sensor: base for sensor in sensors}
    notes = [] if odd is None else [odd.note]
    if lies is not None:
        if odd is not None and odd.sensor == "gyroscope":
            matrix["gyroscope"] = base @ lies.matrix.T  # the magnetometer lies as the accelerometer does
        else:
            matrix["gyroscope"], matrix["magnetometer"] = base @ lies.gyro, base @ lies.matrix
        decisions.append(lies.decision)
        notes += [lies.note] if lies.note and odd is None else []
    if odd is not None and odd.sensor is not None:
        matrix[odd.sensor] = matrix[odd.sensor] @ odd.matrix(odd.sensor)
        named = " ".join(letters(matrix[odd.sensor]))
        decisions.append(
            Decision(f"{odd.sensor} axes", f"{named} of its own", "guess", "the others have another spin axis")
        )
    return BodyAxes(matrix, tuple(decisions), axis, tuple(notes))


def _towards_z(axis: int, down: bool) -> FloatArray:
    """Return the rotation that makes a sensor's axis (or its opposite, where that points up) the body's z."""
    cyclic = np.roll(np.eye(3), axis - 2, axis=1)
    return cyclic if down else np.asarray(np.diag([1.0, -1.0, -1.0]) @ cyclic)


# ---------------------------------------------------------------------------------------------- which end is down


def _downward(axis: int, sensors: Mapping[str, Reading3], *, flies: bool) -> tuple[bool, Decision]:
    """Tell whether the sensor's axis points down: at rest it then reads -g, in flight lift is against it."""
    what, name = "body z", "xyz"[axis]
    accel = sensors.get("accelerometer")
    if accel is None:
        why = "no accelerometer to tell up from down, so the direction of spin is open"
        return True, Decision(what, f"along {name}", "guess", why)
    along = accel.value[:, axis]
    still = resting(accel, sensors.get("gyroscope"))
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


def _downward_by_field(
    axis: int, field: Reading3, lies: _Laid | None, field_down: float | None, unknown: Decision
) -> tuple[bool, Decision]:
    """Tell by the field of the place whether the sensor's axis points down; ``unknown`` where it does not tell.

    ``lies`` is how the magnetometer lies on the gyroscope, None of one alone.
    """
    known = abs(field_down or 0.0) > UP and (lies is None or lies.decision.sure != "guess")
    value = field.value if lies is None else field.value @ lies.matrix.T
    along = float(np.nanmedian(value[:, axis]))
    if field_down is None:
        return True, unknown._replace(why=f"{unknown.why}; --place and --date would tell it by the field there")
    if not known or abs(along) < UP * _size(field, np.zeros(3)):
        return True, unknown
    down, way = along * field_down > 0, "down" if field_down > 0 else "up"
    why = f"the field points {way} there, and it reads {along:+.3g} uT along it; flown upright is assumed"
    return down, Decision(unknown.what, _points("xyz"[axis], down), "likely", why)


def _points(name: str, down: bool) -> str:
    return f"along {name}, which points {'down' if down else 'up and is reversed'}"


def _lift(axis: int, sensors: Mapping[str, Reading3]) -> float:
    """Return the specific force along the axis in a fast spin, m/s^2; 0 where it is below a third of g, or no lift."""
    mean = along_spin(axis, sensors)
    # lift carries at least about a third of the weight over a flight; less may be a centripetal pull that leaks
    return mean if G0 / 3 < abs(mean) <= MOST_LIFT else 0.0


# ----------------------------------------------------------------------------- magnetometer on gyroscope


class _Laid(NamedTuple):
    """The matrix from the magnetometer's axes to the gyroscope's, what was decided, and a note ("" for none).

    ``gyro`` is the one from the gyroscope's columns to its axes, where these are mirrored.
    """

    matrix: FloatArray
    decision: Decision
    note: str = ""
    gyro: FloatArray = np.eye(3)


def _compared(sensors: Mapping[str, Reading3]) -> list[Fit]:
    """Return how well the gyroscope explains the field in each of 48 ways, the best first; none of too few turns."""
    gyro, field = sensors["gyroscope"], sensors["magnetometer"]
    return best_axes(steps_between(gyro.t, gyro.value, field.t, field.value), 1.0)


def _laid(sensors: Mapping[str, Reading3], spin: int | None, field_down: float | None) -> _Laid:
    """Return how the magnetometer lies on the gyroscope; ``spin`` is the axis of the spin, None where nothing spins."""
    what, fits = "magnetometer axes", _compared(sensors)
    if not fits:
        return _by_sense(sensors, spin, "too few turns to compare them one by one")
    best = fits[0]
    if best.ratio > EXPLAINED:
        why = f"the gyroscope leaves {100 * best.ratio:.0f} % of the field's changes whichever way they lie"
        return _by_sense(sensors, spin, why)
    alike = [fit for fit in fits if fit.overall * APART <= best.overall]
    others = "" if len(alike) <= 2 else f"; {len(alike) - 1} other ways fit as well"
    if any(np.array_equal(fit.axes, np.eye(3)) for fit in alike):
        same = fits[[np.array_equal(fit.axes, np.eye(3)) for fit in fits].index(True)]
        sure: Sureness = "certain" if len(alike) <= 2 and same.ratio < CLEARLY else "likely"
        why = f"so the field turns as the gyroscope says ({100 * same.ratio:.0f} % of its changes left){others}"
        up = _upward(sensors["magnetometer"], sensors.get("accelerometer"), same.offset)
        # where the place is known the import looks at all of the rest, and warns
        note = UPWARD if field_down is None and up > UP * _size(sensors["magnetometer"], same.offset) else ""
        return _Laid(np.eye(3), Decision(what, AS_WRITTEN, sure, why), note)
    if (mirrored := _mirrored_gyroscope(sensors, spin, best)) is not None:
        return mirrored
    chosen, by = _of_two(alike, sensors["magnetometer"], sensors.get("accelerometer"), field_down)
    named = " ".join(letters(chosen.axes))
    left = next(f.ratio for f in fits if np.array_equal(f.axes, np.eye(3)))
    why = f"{100 * chosen.ratio:.0f} % of the field's changes are left, {100 * left:.0f} % if they lay as written{by}"
    why += others
    decision = Decision(what, f"{named} in the gyroscope's", "likely" if len(alike) <= 2 else "guess", why)
    return _Laid(chosen.axes, decision, MIRRORED if np.linalg.det(chosen.axes) < 0 else "")


def _mirrored_gyroscope(sensors: Mapping[str, Reading3], spin: int | None, best: Fit) -> _Laid | None:
    """Return the gyroscope's columns mirrored, where the field turns as they say and by no axes of a field does so.

    A rate is no arrow: whichever way the magnetometer's axes are laid, mirrored or not, they are those of a gyroscope
    that is turned. One axis of it that is reversed leaves rates about the spin axis and a wobble the wrong way round;
    ``best`` is what is left then.
    """
    gyro = sensors["gyroscope"]
    over = np.diag([1.0, 1.0, -1.0])
    fits = _compared({**sensors, "gyroscope": Reading3(gyro.t, gyro.value @ over)})
    if not fits or fits[0].overall > FEWER * best.overall:
        return None
    # a magnetometer laid by L in the axes of a gyroscope is one as written beside a gyroscope laid by det(L) L^T
    laid = fits[0].axes
    columns = np.linalg.det(laid) * laid.T @ over
    if spin is not None and abs(columns[spin, spin]) < 0.5:
        return None
    named = " ".join(letters(columns))
    why = (
        f"{100 * fits[0].ratio:.0f} % of the field's changes are left, {100 * best.ratio:.0f} % by the best axes of a "
        "magnetometer beside the gyroscope as written"
    )
    return _Laid(np.eye(3), Decision("gyroscope axes", f"{named} of its own", "likely", why), MIRRORED, columns)


def _by_sense(sensors: Mapping[str, Reading3], spin: int | None, why: str) -> _Laid:
    """Return how the magnetometer lies by the way that its field goes round alone, where a gyroscope clips.

    Where the field goes round the wrong way and points up at rest, the magnetometer lies upside down; where it points
    down, an axis of one of the two is reversed.
    """
    what, same = "magnetometer axes", np.eye(3)
    sense = 0 if spin is None else _sense(sensors["gyroscope"], sensors["magnetometer"], spin)
    if spin is None or sense == 0:
        return _Laid(same, Decision(what, AS_WRITTEN, "guess", why))
    if sense > 0:
        return _Laid(same, Decision(what, AS_WRITTEN, "likely", f"{why}, but the field goes round as it says"))
    if _upward(sensors["magnetometer"], sensors.get("accelerometer")) > 0:
        over = -same
        over[(spin + 1) % 3, (spin + 1) % 3] = 1.0
        why += "; the field goes round the other way and points up at rest: it lies upside down"
        return _Laid(over, Decision(what, f"{' '.join(letters(over))} in the gyroscope's", "guess", why))
    why += "; the field goes round the other way"
    return _Laid(same, Decision(what, AS_WRITTEN, "guess", why), MIRRORED)


def _sense(gyro: Reading3, field: Reading3, spin: int) -> int:
    """Tell whether the field goes round as the gyroscope says (1), the other way (-1), or that neither is clear (0).

    A body's turning makes the field turn by as much the other way in its axes. Beyond half a turn from reading to
    reading the way is not seen; a gyroscope that clips may show half of the spin.
    """
    rate = while_spinning(gyro, gyro).value[:, spin]
    seen = while_spinning(field, gyro)
    value = seen.value[:, [(spin + 1) % 3, (spin + 2) % 3]]
    fresh = np.asarray(np.all(np.isfinite(value), axis=1))
    fresh[1:] &= np.any(np.diff(value, axis=0) != 0, axis=1)
    if fresh.sum() < 16:
        return 0
    x, y = (value[fresh] - value[fresh].mean(axis=0)).T
    angle = np.angle((x[1:] + 1j * y[1:]) * (x[:-1] - 1j * y[:-1]))
    step, least = float(np.median(np.diff(seen.t[fresh]))), float(np.nanmedian(rate))
    # at a limit it spins faster than it says, and perhaps by more than half a turn between two readings of the field
    limited = np.mean(np.abs(rate) > 0.999 * np.nanmax(np.abs(rate))) > CLIPPED
    seldom = FASTEST_THROW * step > np.pi if limited else abs(least) * step > np.pi / 2
    clear = np.mean(np.sign(angle) == np.sign(np.median(angle))) > ONE_WAY and not seldom
    return -int(np.sign(np.median(angle)) * np.sign(least)) if clear else 0


def _upward(field: Reading3, accel: Reading3 | None, offset: FloatArray | float = 0.0) -> float:
    """Return the field's component against gravity at rest, uT, less an offset (3,); 0 where no rest is known."""
    rest = _at_rest(field, accel)
    return 0.0 if rest is None else float(np.nanmedian(np.sum((rest[0] - offset) * rest[1], axis=1)))


def _at_rest(field: Reading3, accel: Reading3 | None) -> tuple[FloatArray, FloatArray] | None:
    """Return the field (n, 3) uT and the upward direction (n, 3) of the rows at rest; None where no rest is known."""
    if accel is None:
        return None
    still = resting(accel, None)
    if still.sum() < 10:
        return None
    t = accel.t[still]
    return np.column_stack([np.interp(t, field.t, field.value[:, k]) for k in range(3)]), accel.value[still] / G0


def _size(field: Reading3, offset: FloatArray) -> float:
    """Return the usual size of a field without its offset (3,), uT."""
    return float(np.nanmedian(np.linalg.norm(field.value - offset, axis=1)))


def _of_two(alike: list[Fit], field: Reading3, accel: Reading3 | None, field_down: float | None) -> tuple[Fit, str]:
    """Choose among ways that fit alike: all three axes reversed fit as well, and the field's dip tells them apart.

    North of the equator, where nine people of ten live, the field points down; ``field_down`` tells what it does.
    """
    least = min(fit.overall for fit in alike)
    same = [fit for fit in alike if fit.overall <= SAME * least]
    best = min(
        same,
        key=lambda fit: (np.linalg.det(fit.axes) < 0, " ".join(letters(fit.axes)) not in OF_PARTS, -np.trace(fit.axes)),
    )
    pair = [fit for fit in alike if np.array_equal(fit.axes, best.axes) or np.array_equal(fit.axes, -best.axes)]
    rest = _at_rest(field, accel)
    if rest is None or len(pair) < 2:
        return best, ""
    there, up = rest
    upward = [float(np.median(np.sum((there @ fit.axes.T - fit.offset) * up, axis=1))) for fit in pair]
    down = field_down or 0.0
    sign, way = (-1.0, "up") if down <= -UP else (1.0, "down")
    by = f"; of this and all three reversed, this has the field point {way} at rest"
    return pair[int(np.argmin(sign * np.array(upward)))], by + ", as it does there" * (abs(down) >= UP)
