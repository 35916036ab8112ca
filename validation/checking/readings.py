"""What the readings show, against gravity, the Earth's field, and what a thrown disc does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from discsim.arrays import BoolArray
from discsim.effects.catalogue import catalogued, effect_of
from discsim.effects.sensors import Scale
from discsim.effects.setup import AccelerometerUnit, Axes, GyroscopeUnit, MagnetometerUnit, axes_of
from discsim.glitches import FASTEST_SPIN, beyond_spin, glitches
from discsim.recording import SENSORS, Recording, Samples
from discsim.spin_axis import ONE_AXIS, axis_shares
from discsim.validation.checking.finding import Finding, Severity
from discsim.validation.checking.paths import path_findings
from discsim.validation.checking.statements import FIELD
from discsim.validation.diagnosis.setup.reference import ReferenceDoubt
from discsim.validation.diagnosis.setup.remedy import remedy
from discsim.validation.importing.sniffing.full_scale import full_scale
from discsim.validation.importing.sniffing.spin_axis import Reading3, spin_axis, while_spinning

__all__ = ["at_rest", "reading_findings"]

#: a body rests where it turns slower than this (rad/s: above a gyroscope's bias) ...
TURNS = 0.25
#: ... and the specific force stands within this share over half a second
STANDS = 0.03
STRETCH = 0.5
#: the field of a body at rest scatters by less than this (uT): the noise of the cheapest parts is 1 per axis
STILL_FIELD = 2.0
#: |f| at rest may be off by this share: zero-g offsets of cheap parts are 0.08 g, scales 3 %
REST = 0.12
#: |m| may be off by this share of the field for want of calibration; more is iron on board
IRON = 0.4
#: what |f| of a body at rest reads in other units, over m/s^2
FORCES = {"g": 1 / 9.80665, "mg": 1e3 / 9.80665, "cm/s^2": 100.0}
#: what a field of uT reads in other units
FIELDS = {"T": 1e-6, "mT": 1e-3, "gauss": 1e-2, "mG": 10.0, "nT": 1e3}


def reading_findings(recording: Recording, doubts: Sequence[ReferenceDoubt]) -> Iterator[Finding]:
    """Yield what the readings of a recording show that cannot be, or is unlikely; ``doubts`` are of its told rates."""
    yield from _force(recording)
    yield from _field(recording)
    yield from _spin(recording)
    yield from _full_scale(recording)
    doubted = []
    for doubt in doubts:
        where = doubt.file.removesuffix(".csv")
        severity: Severity = "error" if doubt.sure else "warning"
        yield Finding(f"{where}.{doubt.kind}", severity, where, f"it {doubt.what}", doubt.expected, doubt.remedy)
        doubted.append(where)
    yield from _rate(recording, [name for name in ("gyroscope", "rate_reference") if name not in doubted])
    yield from path_findings(recording)


def at_rest(recording: Recording) -> BoolArray:
    """Tell which accelerometer readings (n,) were taken while the body rested, all False where nothing tells.

    A steady spin has a steady force, too: a gyroscope, or the field, must show that there is none.
    """
    force = recording.samples["accelerometer"]
    rest = np.zeros(len(force), dtype=np.bool_)
    width = int(np.ceil(STRETCH / force.interval)) if force.interval > 0 else 0
    if width < 5 or len(force) < 2 * width:
        return rest
    size = np.linalg.norm(force.value, axis=1)
    for start in range(0, len(force) - width + 1, width):
        part = force.value[start : start + width]
        if not np.all(np.isfinite(part)) or not np.any(part):
            continue
        mean = float(np.mean(size[start : start + width]))
        still = float(np.linalg.norm(np.std(part, axis=0))) < STANDS * mean
        if still and _slow(recording, float(force.t[start]), float(force.t[start + width - 1])):
            rest[start : start + width] = True
    return rest


def _slow(recording: Recording, start: float, stop: float) -> bool:
    """Tell whether the gyroscope, or the field where there is none, shows that the body does not turn."""
    gyroscope, field = recording.get("gyroscope"), recording.get("magnetometer")
    if gyroscope is not None:
        rate = gyroscope.between(start, stop).value
        return rate.size > 0 and bool(np.median(np.linalg.norm(np.nan_to_num(rate), axis=1)) < TURNS)
    if field is None:
        return False
    seen = field.between(start, stop).value
    return len(seen) > 3 and float(np.linalg.norm(np.nanstd(seen, axis=0))) < STILL_FIELD


def _force(recording: Recording) -> Iterator[Finding]:
    if "accelerometer" not in recording:
        return
    value = recording.samples["accelerometer"].value[at_rest(recording)]
    if len(value) == 0:
        return
    g = recording.environment.gravity
    sizes = np.linalg.norm(value, axis=1)
    resting = np.abs(sizes / g - 1) <= REST
    size = float(np.median(sizes))
    # a body that falls without turning stands still, too: then some stretch lies at gravity, or the sizes differ
    if np.mean(resting) < 0.2:
        if np.quantile(sizes, 0.9) > 1.2 * np.quantile(sizes, 0.1):
            return
        unit = next((name for name, factor in FORCES.items() if abs(size / (9.81 * factor) - 1) < REST), None)
        yield Finding(
            catalogued(AccelerometerUnit).id if unit else catalogued(Scale, "accelerometer").id,
            "error" if unit else "warning",
            "accelerometer",
            f"at rest it reads {size:.4g} m/s^2",
            f"gravity, {g:.4g} m/s^2",
            f"it is written in {unit}" if unit else "its scale or its zero is off, or it is clipped",
        )
        return
    down = value[resting, 2] / g
    # a body that lies upright at some time has z down, whichever way it lies later
    if np.mean(down > 0.8) > 0.5 and np.mean(down < -0.8) < 0.1:
        yield Finding(
            "accel.upside_down",
            "warning" if recording.plant != "free_spin" else "note",
            "accelerometer",
            f"at rest z reads {np.median(down) * g:+.3g} m/s^2: the body lies upside down, or z points up",
            f"{-g:.3g} m/s^2 with z down",
            'if z points up, import with axes = ["x", "-y", "-z"] for all sensors: the spin changes sign',
        )


def _spin(recording: Recording) -> Iterator[Finding]:
    """Yield a sensor whose axis of the spin is not z, where no stated field tells how axes lie (a setup fault then)."""
    gyro, field = recording.get("gyroscope"), recording.get("magnetometer")
    if gyro is None or (field is not None and np.any(recording.environment.magnetic_field)):
        return
    share = axis_shares(gyro.value)
    if share is None or np.max(share) < ONE_AXIS:
        return
    axis = int(np.argmax(share))
    if axis != 2:
        what = f"{100 * share[axis]:.0f} % of the rate's square is on {'xyz'[axis]}: it spins about that axis"
        yield _swapped("gyroscope", axis, what)
    elif field is not None:
        turning = while_spinning(Reading3(field.t, field.value), Reading3(gyro.t, gyro.value))
        still, decision = spin_axis({"magnetometer": turning})
        if still not in (None, 2) and decision.sure != "guess":
            what = (
                f"the field stands still along {'xyz'[still]} and turns in the other two, the gyroscope turns about z"
            )
            yield _swapped("magnetometer", still, what)


def _full_scale(recording: Recording) -> Iterator[Finding]:
    """Yield that a gyroscope of no stated range stands at a full scale, where its noise does not show that it clips.

    A table may be told to turn at just such a rate.
    """
    gyro = recording.get("gyroscope")
    if gyro is None or recording.plant == "rate_table" or recording.sheets["gyroscope"].range is not None:
        return
    found = full_scale(Reading3(gyro.t, gyro.value))
    if found is None or np.any(recording.sheets["gyroscope"].clipped(gyro.value)):
        return
    limit, told = found
    yield Finding(
        "gyroscope.range",
        "warning",
        "gyroscope",
        f"{told.choice} is {told.why}: it is clipped, and the spin faster",
        "a range that is stated, or a rate that changes",
        f"write range_rad_s = {limit:.9g} below [sensors.gyroscope] of recording.toml, or of the map of the import",
    )


def _swapped(sensor: str, axis: int, what: str) -> Finding:
    """Return what is said of a sensor that shows the spin about x or y (0 or 1)."""
    swapped = np.eye(3)
    swapped[[axis, 2]] = swapped[[2, axis]]
    effect = effect_of(Axes(axes_of(swapped)), sensor)
    mended = f"{remedy(effect)}, or swap these columns of {sensor}.csv"
    if sensor == "gyroscope":
        turned = ["xyz"[(axis + 1 + body) % 3] for body in range(3)]
        mended += "; where the whole board lies so, give every sensor " + f"axes = {turned}".replace("'", '"')
    return Finding(
        effect.id,
        "warning",
        sensor,
        what,
        "a spin about z, the axis of disc, rig and table",
        f"{mended}; in a map that has axes there, exchange those of body {'xyz'[axis]} and z",
    )


def _field(recording: Recording) -> Iterator[Finding]:
    if "magnetometer" not in recording:
        return
    value = recording.samples["magnetometer"].value
    value = value[np.all(np.isfinite(value), axis=1)]
    if len(value) < 10:
        return
    size = np.linalg.norm(value, axis=1)
    middle = float(np.median(size))
    swing = float(np.max(np.quantile(value, 0.99, axis=0) - np.quantile(value, 0.01, axis=0))) / 2
    stated = float(np.linalg.norm(recording.environment.magnetic_field))
    expected = f"{stated:.3g} uT" if stated else f"{FIELD[0]:g} to {FIELD[1]:g} uT"
    unit = next(
        (name for name, f in FIELDS.items() if FIELD[0] * f < middle < FIELD[1] * f and swing < FIELD[1] * f), None
    )
    # a field turned in any way swings by its size at most, whatever iron is on board
    if unit in ("T", "mT", "gauss") or (unit in ("mG", "nT") and swing > FIELD[1]):
        yield Finding(
            catalogued(MagnetometerUnit).id,
            "error",
            "magnetometer",
            f"it reads {middle:.3g} uT",
            expected,
            f"it is written in {unit}",
        )
    elif swing > 1.3 * FIELD[1]:
        yield Finding(
            "mag.scale",
            "warning",
            "magnetometer",
            f"an axis swings by +-{swing:.3g} uT",
            f"at most the field, {expected}",
            "is its unit right? A magnet or a current near by would do it, too",
        )
    elif (stated and abs(middle / stated - 1) > IRON) or not FIELD[0] * (1 - IRON) < middle < FIELD[1] * (1 + IRON):
        yield Finding(
            "mag.iron",
            "note",
            "magnetometer",
            f"it reads {middle:.3g} uT (median size), an axis swings by +-{swing:.3g} uT",
            expected,
            "iron or a magnet on board, most likely (hard iron), or a wrong scale",
        )


def _rate(recording: Recording, sensors: Sequence[str]) -> Iterator[Finding]:
    for sensor in sensors:
        samples = recording.get(sensor)
        if samples is None:
            continue
        alone = glitches(sensor, samples.value)
        table = np.where(alone, np.nan, samples.value).reshape(len(samples), -1)
        size = np.linalg.norm(np.nan_to_num(table), axis=1)
        fastest = float(np.quantile(size, 0.99)) if np.any(np.isfinite(table)) else 0.0
        if fastest > FASTEST_SPIN:
            yield Finding(
                f"{sensor}.units" if sensor != "gyroscope" else catalogued(GyroscopeUnit).id,
                "error",
                sensor,
                f"it reads {fastest:.4g} rad/s ({np.degrees(fastest):,.0f} deg/s)",
                f"up to {FASTEST_SPIN:g} rad/s, the fastest throws spin at 200",
                "it is written in deg/s" if fastest < 100 * FASTEST_SPIN else "its unit is wrong",
            )
        else:
            yield from _wild_rates(sensor, samples, alone)


def _wild_rates(sensor: str, samples: Samples, alone: BoolArray) -> Iterator[Finding]:
    """Yield, of each axis, the few readings that are beyond what a throw has; ``alone``: which are glitches."""
    beyond = beyond_spin(sensor, samples.value).reshape(len(samples), -1)
    for axis, column in enumerate(SENSORS[sensor].columns):
        rows = np.flatnonzero(beyond[:, axis])
        if rows.size == 0:
            continue
        single = bool(np.all(alone.reshape(beyond.shape)[rows, axis]))
        name = f" of {column[0]}" if beyond.shape[1] > 1 else ""
        count = f"{rows.size} readings{name} are" if rows.size > 1 else f"1 reading{name} is"
        yield Finding(
            f"{sensor}.glitch",
            "warning" if single else "error",
            sensor,
            f"{count} beyond {FASTEST_SPIN:g} rad/s, the first at {samples.t[rows[0]]:.3f} s, the largest "
            f"{np.max(np.abs(samples.value.reshape(beyond.shape)[rows, axis])):.4g}",
            "none: the fastest throws spin at 200",
            "glitches of the log, three rows on end at most: `estimate` leaves them out; make them gaps"
            if single
            else "more than three rows on end are no glitch, and `estimate` uses them; make them gaps",
        )
