"""Units from the size of readings. Takes a triple's readings; gives the unit, its worth, how sure it is and why.

What is known beforehand: gravity at rest, the earth's field of 22 to 67 uT (World Magnetic Model, the whole earth),
and the full scales that parts have.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.import_map import G0, UNITS
from discsim.validation.importing.sniffing.decision import Decision, Sureness
from discsim.validation.importing.sniffing.units import COUNTS, Reading

__all__ = [
    "PER_DEG_S",
    "Unit",
    "accelerometer_unit",
    "counts_per_g",
    "field_size",
    "gravity_norm",
    "gyroscope_unit",
    "magnetometer_unit",
    "rest_norm",
]

#: How far gravity at rest may be off: a part's zero-g offset, 60 to 80 mg an axis (MPU-9250), and 3 % of scale.
REST = 0.12
#: Windows of 16 rows without which single rows tell: four are 4 s at 16 rows a second.
FEW = 4
#: The earth's field, uT, and what a hard iron of its size makes of the readings' norm.
FIELD = (22.0, 67.0)
FIELD_WITH_IRON = (10.0, 150.0)
#: About the middle of the earth's field, uT: from it sizes are counted on a logarithmic scale.
MIDDLE = 45.0
#: Readings without a unit are shares of the field (Xsens, x-io and Shimmer calibrate so) where their size is nearer to
#: one than to the largest field in gauss, 0.67, on a logarithmic scale.
SHARES = (0.67**0.5, 0.67**-0.5)
#: Counts per g of usual parts: 16 bits over 2, 4, 8, 16 g; 12, 10 and 8 bits of older parts. A factor of 2 apart.
PER_G = (16384.0, 8192.0, 4096.0, 2048.0, 1024.0, 512.0, 256.0, 64.0)
#: Counts per g and per deg/s of a part that nobody has set (MPU-6050, ICM-20948: 2 g and 250 deg/s).
AT_FIRST = (16384.0, 131.072)
#: Counts per deg/s over 250, 500, 1000, 2000 deg/s (InvenSense, Bosch) and 245 to 4000 deg/s (ST).
PER_DEG_S = (131.072, 65.536, 32.768, 16.384, 8.192, 114.286, 57.143, 28.571, 14.286, 7.143)
#: mdeg/s a count of ST's parts over 2000 to 125 deg/s (LSM6DSO, LSM9DS1), which their drivers multiply with.
MDPS = (70.0, 35.0, 17.5, 8.75, 4.375)
#: Counts per uT: AK8963 (16, 14 bit), LIS3MDL at 4 to 16 G, HMC5883L, QMC5883L (2, 8 G), MMC5983 (16, 18 bit), IST8310.
PER_UT = {
    "AK8963": 1 / 0.15,
    "AK8963 at 14 bit": 1 / 0.6,
    "LIS3MDL at 4 G": 68.42,
    "LIS3MDL at 8 G": 34.21,
    "LIS3MDL at 12 G": 22.81,
    "LIS3MDL at 16 G": 17.11,
    "HMC5883L": 10.9,
    "QMC5883L at 2 G": 120.0,
    "QMC5883L at 8 G": 30.0,
    "MMC5983": 40.96,
    "MMC5983 at 18 bit": 163.84,
    "IST8310": 1 / 0.3,
}
#: With whole numbers of what drivers give in the place of counts, where the field tells which.
PER_UT_READ = {**PER_UT, "magnetometer read in mgauss": 10.0, "magnetometer read in nT": 1000.0}
#: Ranges of a part lie a factor of 4/3 apart and more (LIS3MDL at 12 and 16 G): nearer than half of that tells which.
APART = (4 / 3) ** 0.5
#: No rate gyroscope that a log of motion holds shows more than 100 rad/s (5730 deg/s; the widest common part has 4000).
LARGEST_RAD_S = 100.0
#: What headers state in each other's place: most drivers give one of them, and an example of the other is copied.
MISTAKEN = {"deg/s", "rad/s"}
#: What no gyroscope's driver gives unasked: without a header only a clock that is certain tells it.
ASKED_FOR = {"rpm", "Hz"}
#: The range of most parts, 2000 deg/s along each axis, in rad/s.
FASTEST = 60.0
_RAD = np.pi / 180


class Shares(NamedTuple):
    """A magnetometer's readings that are shares of the field: their size, and what was taken for it."""

    size: float
    what: str

    def unit(self, field: float | None = None) -> Unit:
        """Return their unit in a ``field``, uT; None where that is not known."""
        why = (
            f"no unit in the header; {self.size:.4g} ({self.what}) is the earth's field in none, but that of readings "
            "which were calibrated to the field's size"
        )
        if field is not None:
            sure: Sureness = "likely"
            why = f"{why}: that of the place is taken"
        else:
            sure = "guess"
            why = f"{why}; how large that was is open: give --place and --date, or write it as scale"
        scale = float(f"{field or MIDDLE:.4g}")
        told = _said("magnetometer", f"shares of a field of {scale:g} uT", sure, why)
        return Unit("uT", scale, told, self)


class Counts(NamedTuple):
    """A magnetometer's readings that are whole numbers: their size, and what was taken for it."""

    size: float
    what: str

    @property
    def parts(self) -> dict[str, float]:
        """The parts of which so many counts are the earth's field, with their counts per uT."""
        return {part: per for part, per in PER_UT.items() if FIELD[0] <= self.size / per <= FIELD[1]}

    def unit(self, field: float | None = None) -> Unit:
        """Return their unit in a ``field``, uT; None where that is not known: then about the middle of the earth's."""
        if field is None:
            fits = self.parts
            if not fits and FIELD_WITH_IRON[0] <= 1e-3 * self.size <= FIELD_WITH_IRON[1]:
                why = f"{self.size:.4g} ({self.what}) is the earth's field with iron near the sensor"
                why += ", and no part counts so finely"
                return Unit("nT", 1.0, _said("magnetometer", "nT", "guess", why), self)
        else:
            fits = {part: per for part, per in PER_UT_READ.items() if self._off(per, field) < np.log(APART)}
        known = fits or PER_UT
        part = min(known, key=lambda part: self._off(known[part], field or MIDDLE))
        per = known[part]
        others = ", ".join(other for other in fits if other != part)
        sure: Sureness = "likely" if len(fits) == 1 else "guess"
        why = f"whole numbers; of a {part} {self.size:.0f} ({self.what}) would be {self.size / per:.0f} uT"
        why += "" if field is None else f", and the field of the place is of {field:.0f} uT"
        why += f"; it may be a {others} as well" if others else ""
        why += ": --place and --date would tell" if others and field is None else ""
        return Unit("uT", 1 / per, _said("magnetometer", f"{1 / per:.4g} uT a count", sure, why), self)

    def _off(self, per: float, field: float) -> float:
        """Return how far ``per`` counts per uT are from a field, on a logarithmic scale."""
        return float(abs(np.log(self.size / per / field)))


class Unit(NamedTuple):
    """A unit of the map and the worth of one reading in it, as `[sensors.NAME]` writes them, and the decision.

    ``open`` is what a magnetometer reads where the size of the field at its place tells the worth of a reading.
    """

    unit: str
    scale: float
    decision: Decision
    open: Shares | Counts | None = None

    def factor(self, sensor_unit: str) -> float:
        """Return what turns a reading into the recording's unit."""
        return UNITS[sensor_unit][self.unit] * self.scale

    def in_field(self, field: float | None) -> Unit:
        """Return it at a place with a ``field`` of so many uT; as it is where that is not known."""
        return self if self.open is None or field is None else self.open.unit(field)


def rest_norm(value: FloatArray) -> float:
    """Return the median norm of the readings (n, 3) in the quietest twentieth of windows of 16 rows; NaN without."""
    size = 16  # 0.16 s at 100 Hz: shorter than any rest, longer than a turn that would look still
    count = len(value) // size
    if count == 0:
        return float(np.median(np.linalg.norm(value, axis=1)))
    windows = value[: count * size].reshape(count, size, 3)
    restless = np.nan_to_num(np.linalg.norm(windows.std(axis=1), axis=1), nan=np.inf)
    quiet = np.argsort(restless)[: max(1, count // 20)]
    return float(np.median(np.linalg.norm(np.median(windows[quiet], axis=1), axis=1)))


def gravity_norm(value: FloatArray) -> float:
    """Return the norm of the readings (n, 3) that most steady windows share: where a thing lies, it lies long.

    Steady is a window of 16 rows that scatters by less than 3 % of its norm: MEMS noise is 0.3 % of g, and what a hand
    holds trembles by a per cent or two. Without any it is `rest_norm`.
    """
    count = len(value) // 16
    windows = value[: count * 16].reshape(count, 16, 3)
    norm = np.linalg.norm(windows.mean(axis=1), axis=1)
    steady = norm[np.linalg.norm(windows.std(axis=1), axis=1) < 0.03 * norm]
    if steady.size == 0:
        sizes = np.linalg.norm(value, axis=1)
        middle = float(np.median(sizes))
        # a slow log has hardly a window: most of its rows lie still by themselves
        alone = count <= FEW and np.mean(np.abs(sizes - middle) < REST * middle) > 0.5
        return middle if alone else rest_norm(value)
    ordered = np.sort(steady)
    alike = np.searchsorted(ordered, 1.05 * ordered) - np.arange(ordered.size)
    first = int(np.argmax(alike))
    return float(np.median(ordered[first : first + alike[first]]))


def _whole(value: FloatArray) -> bool:
    return bool(np.all(np.abs(value - np.round(value)) < 1e-9)) and float(np.ptp(value)) > 50


def _said(sensor: str, text: str, sure: Sureness, why: str) -> Decision:
    return Decision(f"{sensor} unit", text, sure, why)


def accelerometer_unit(value: FloatArray, stated: Reading | None) -> Unit:
    """Return an accelerometer's unit from gravity at rest, checked against the unit that stands in the header."""
    rest = gravity_norm(value)
    name = "accelerometer"
    worth = {"m/s^2": rest / G0, "g": rest, "mg": rest / 1000}
    fits = next((unit for unit, size in worth.items() if abs(size - 1) < REST), None)
    if stated is not None and stated.unit != COUNTS:
        size = worth[stated.unit] * stated.scale
        if abs(size - 1) < REST:
            why = f"the header says so, and {rest:.4g} at rest is gravity"
            return Unit(stated.unit, stated.scale, _said(name, stated.unit, "certain", why))
        if fits is not None:
            why = f"{rest:.4g} at rest is gravity in {fits}, although the header says {stated.unit}"
            return Unit(fits, 1.0, _said(name, fits, "likely", why))
        why = f"the header says so; nothing in it rests ({size:.2g} g where it is quietest)"
        return Unit(stated.unit, stated.scale, _said(name, stated.unit, "likely", why))
    if fits is not None and not (stated is not None and stated.unit == COUNTS):
        sure: Sureness = "likely" if fits == "mg" else "certain"
        return Unit(fits, 1.0, _said(name, fits, sure, f"{rest:.4g} at rest is gravity"))
    per_g = min(PER_G, key=lambda counts: abs(np.log(rest / counts)) if rest > 0 else 1.0)
    if abs(rest / per_g - 1) < REST:
        whole = _whole(value)
        why = f"{'whole' if whole else 'averaged or calibrated'} numbers, {rest:.0f} of them at rest"
        why += f": counts of a part with {per_g:.0f} per g"
        return Unit("g", 1 / per_g, _said(name, f"1/{per_g:.0f} g a count", "likely" if whole else "guess", why))
    why = f"no unit in the header, and {rest:.4g} where it is quietest is no gravity in any usual unit"
    return Unit("m/s^2", 1.0, _said(name, "m/s^2", "guess", why))


def counts_per_g(unit: Unit | None) -> float | None:
    """Return what an accelerometer of a unit counts per g; None where it does not count, or is none."""
    counts = unit is not None and unit.unit == "g" and "a count" in unit.decision.choice
    return 1.0 / unit.scale if unit is not None and counts else None


def field_size(value: FloatArray) -> tuple[float, str]:
    """Return the size of the field in readings (n, 3): a sphere's radius where they go round one, else their norm."""
    sound = value[np.isfinite(value).all(axis=1)]
    sound = sound[:: max(1, len(sound) // 20000)]
    median = float(np.median(np.linalg.norm(sound, axis=1)))
    # one reading of each direction, so that a long rest does not outweigh the turns
    grid = np.round(sound / (np.ptp(sound, axis=0).max() / 15 or 1.0)).astype(int)
    sound = sound[np.unique(grid, axis=0, return_index=True)[1]]
    if len(sound) < 10:
        return median, "median norm"
    centred = sound - sound.mean(axis=0)
    scale = float(np.abs(centred).max()) or 1.0
    design = np.column_stack([2 * centred / scale, np.ones(len(sound))])
    solution, *_ = np.linalg.lstsq(design, np.sum((centred / scale) ** 2, axis=1), rcond=None)
    radius = float(np.sqrt(max(0.0, solution[3] + solution[:3] @ solution[:3]))) * scale
    left = np.linalg.norm(centred / scale - solution[:3], axis=1) * scale
    # a sphere is known where the readings spread over 0.3 of its radius in every direction and lie on it within 15 %
    narrowest = float(np.sqrt(max(0.0, np.linalg.eigvalsh(np.cov((centred / scale).T))[0]))) * scale
    if radius > 0 and narrowest > 0.3 * radius and float(np.std(left)) < 0.15 * radius:
        return radius, "radius of the sphere through the readings"
    return median, "median norm"


def magnetometer_unit(value: FloatArray, stated: Reading | None, *, counts: bool = False) -> Unit:
    """Return a magnetometer's unit from the size of the earth's field, checked against the header's.

    ``counts`` tells that another sensor of the log is written in counts, so that whole numbers are counts here as well.
    """
    size, what = field_size(value)
    name = "magnetometer"
    factors = {"uT": 1.0, "mgauss": 0.1, "gauss": 100.0, "nT": 1e-3, "mT": 1e3}
    fits = [unit for unit, factor in factors.items() if FIELD[0] <= size * factor <= FIELD[1]]
    if stated is not None and stated.unit != COUNTS:
        field = size * UNITS["uT"][stated.unit] * stated.scale
        if FIELD[0] <= field <= FIELD[1]:
            why = f"the header says so, and {field:.0f} uT ({what}) is the earth's field"
            return Unit(stated.unit, stated.scale, _said(name, stated.unit, "certain", why))
        if FIELD_WITH_IRON[0] <= field <= FIELD_WITH_IRON[1]:
            why = f"the header says so; {field:.3g} uT ({what}) is the earth's field with iron near the sensor"
            return Unit(stated.unit, stated.scale, _said(name, stated.unit, "likely", why))
        with_iron = [unit for unit in factors if FIELD_WITH_IRON[0] <= size * factors[unit] <= FIELD_WITH_IRON[1]]
        if fits:
            why = f"{size:.4g} ({what}) is the earth's field in {fits[0]}, although the header says {stated.unit}"
            return Unit(fits[0], 1.0, _said(name, fits[0], "likely", why))
        if with_iron:
            near = min(with_iron, key=lambda unit: abs(np.log(size * factors[unit] / MIDDLE)))
            why = f"{size:.4g} ({what}) is the earth's field with iron near the sensor in {near}"
            return Unit(near, 1.0, _said(name, near, "guess", f"{why}, although the header says {stated.unit}"))
        why = f"the header says so, but {field:.3g} uT ({what}) is not the earth's field, nor is it in another unit"
        return Unit(stated.unit, stated.scale, _said(name, stated.unit, "guess", why))
    counted = stated is not None and stated.unit == COUNTS
    if fits and not counted and not (_whole(value) and (counts or fits[0] == "nT")):
        why = f"{size:.4g} ({what}) is the earth's field"
        return Unit(fits[0], 1.0, _said(name, fits[0], "likely", why))
    counted_as = Counts(size, what)
    if fits == ["nT"] and not counted and not counted_as.parts:
        why = f"{size:.4g} ({what}) is the earth's field, and no part counts so finely"
        return Unit("nT", 1.0, _said(name, "nT", "likely", why))
    if _whole(value):
        return counted_as.unit()
    if SHARES[0] <= size <= SHARES[1] and not counted:
        return Shares(size, what).unit()
    unit = min(factors, key=lambda unit: abs(np.log(max(size, 1e-12) * factors[unit] / MIDDLE)))
    why = f"no unit in the header; {size:.4g} ({what}) is nearest to the earth's field in it"
    return Unit(unit, 1.0, _said(name, unit, "guess", why))


def gyroscope_unit(
    value: FloatArray,
    stated: Reading | None,
    turned: float | None,
    by: str = "the field",
    *,
    clock: Sureness = "certain",
    beside: Unit | None = None,
) -> Unit:
    """Return a gyroscope's unit.

    ``turned`` is how many rad/s one of its readings is worth by the turning of ``by`` (the field, gravity) in the same
    log, None where that does not tell. A header's unit stands against all but that, and against that as well where the
    ``clock`` by which it turns is a guess, or a likely one and the unit is none that headers are wrong by (`MISTAKEN`);
    without one, size and steps decide, and the unit of an accelerometer ``beside`` it: a chip that counts per g counts
    both.
    """
    name = "gyroscope"
    peak = float(np.nanmax(np.linalg.norm(value, axis=1)))
    worths = {"rad/s": 1.0, "deg/s": _RAD, "mdeg/s": _RAD / 1000, "rpm": np.pi / 30, "Hz": 2 * np.pi}
    worths |= {"mrad/s": 1e-3} if stated is not None and stated.unit == "mrad/s" else {}
    near = None
    if turned is not None:
        near = min(worths, key=lambda unit: abs(np.log(turned / worths[unit])))
        # a clock that is off by 30 % is the worst known; units lie a factor of 6 and more apart
        near = near if abs(np.log(turned / worths[near])) < np.log(1.5) else None
    if stated is not None and stated.unit != COUNTS:
        worth = worths[stated.unit] * stated.scale
        if near == stated.unit:
            why = f"the header says so, and {by} turns as fast"
            return Unit(stated.unit, stated.scale, _said(name, stated.unit, "certain", why))
        mistaken = clock == "likely" and {near, stated.unit} == MISTAKEN
        if near is not None and (clock == "certain" or mistaken):
            why = f"{by} turns as fast as {near} would, although the header says {stated.unit}"
            return Unit(near, 1.0, _said(name, near, "likely", why))
        if peak * worth > LARGEST_RAD_S and peak * _RAD < LARGEST_RAD_S and stated.unit == "rad/s":
            why = f"the header says rad/s, but {peak:.0f} rad/s is beyond any gyroscope"
            return Unit("deg/s", 1.0, _said(name, "deg/s", "likely", why))
        why = f"the header says so; up to {np.degrees(peak * worth):.0f} deg/s"
        return Unit(stated.unit, stated.scale, _said(name, stated.unit, "certain", why))
    if near is not None and stated is None and (clock == "certain" or near not in ASKED_FOR):
        return Unit(near, 1.0, _said(name, near, "likely", f"{by} turns as fast in this unit"))
    if peak > 5000 and stated is None and beside is not None and beside.unit == "mg":
        steps = next((one for one in MDPS if np.all(np.abs(value / one - np.rint(value / one)) < 1e-6)), None)
        if steps is not None:
            why = f"multiples of {steps:g}, an ST part's step in it, beside an accelerometer in mg; up to {peak:.4g}"
            return Unit("mdeg/s", 1.0, _said(name, "mdeg/s", "likely", why))
    if (_whole(value) and (peak > 5000 or stated is not None)) or peak * _RAD > LARGEST_RAD_S:
        return _gyroscope_counts(turned, by, "whole numbers" if _whole(value) else "beyond any gyroscope in deg/s")
    if _whole(value) and (per_g := counts_per_g(beside)) is not None:
        told = f"whole numbers beside {per_g:.0f} counts per g"
        return _gyroscope_counts(turned, by, told, at_first=per_g == AT_FIRST[0])
    return _by_size(value, peak, beside)


def _gyroscope_counts(turned: float | None, by: str, told: str, *, at_first: bool = False) -> Unit:
    name = "gyroscope"
    if turned is not None:
        per = min(PER_DEG_S, key=lambda per: abs(np.log(turned / (_RAD / per))))
        why = f"{told}; by the turning of {by} one count is 1/{_RAD / turned:.4g} deg/s"
        return Unit("deg/s", 1 / per, _said(name, f"1/{per:.5g} deg/s a count", "likely", why))
    if at_first:
        why = f"{told}; taken as 16 bits over 250 deg/s, as a part is switched on that counts so"
        return Unit("deg/s", 1 / AT_FIRST[1], _said(name, f"1/{AT_FIRST[1]:.5g} deg/s a count", "guess", why))
    why = f"{told}; taken as 16 bits over 2000 deg/s, the usual range of a fast motion"
    return Unit("deg/s", 1 / 16.384, _said(name, "1/16.384 deg/s a count", "guess", why))


def _by_size(value: FloatArray, peak: float, beside: Unit | None) -> Unit:
    name = "gyroscope"
    if peak > LARGEST_RAD_S:
        return Unit(
            "deg/s", 1.0, _said(name, "deg/s", "likely", f"{peak:.0f} rad/s would be beyond any gyroscope's range")
        )
    steps = np.abs(np.diff(value, axis=0))
    steps = steps[steps > 1e-9]
    noise = float(np.median(steps)) if steps.size else 0.0
    # data sheets state 0.05 to 0.3 deg/s of noise and steps of 0.004 to 0.14 deg/s: 57 times less in rad/s
    still = float(np.percentile(steps, 5)) if steps.size else 0.0
    written = float(steps.min()) if steps.size else 0.0
    si = beside is not None and (beside.unit, beside.decision.sure) == ("m/s^2", "certain")
    if still > 0.004 and still < 1.5 * written and si and peak < FASTEST:
        why = (
            f"written in steps of {written:.2g}, so that its noise tells nothing; the accelerometer is in SI units, too"
        )
        return Unit("rad/s", 1.0, _said(name, "rad/s", "guess", why))
    if still > 0.004:
        why = f"up to {peak:.3g}, and steps of {noise:.2g} from row to row are a gyroscope's in deg/s"
        return Unit("deg/s", 1.0, _said(name, "deg/s", "guess", why))
    why = f"up to {peak:.3g}, and steps of {noise:.2g} from row to row are a gyroscope's in rad/s"
    return Unit("rad/s", 1.0, _said(name, "rad/s", "guess", why))
