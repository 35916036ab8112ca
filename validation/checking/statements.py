"""What ``recording.toml`` states, against what a disc, a place on Earth and a throw can be."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

from discsim.disc import Aero, AeroTable, Disc, Release
from discsim.environment import Environment
from discsim.glitches import FASTEST_SPIN
from discsim.recording import Recording
from discsim.validation.checking.finding import Finding, Severity, doubts_of

__all__ = ["FIELD", "statement_findings", "unlikely_flight"]

#: the Earth's field at the ground, uT: 22 (south Atlantic) to 67 (near the southern magnetic pole), with a margin
FIELD = (20.0, 70.0)
#: gravity at the ground, m/s^2: 9.764 (Huascaran) to 9.834 (north pole)
GRAVITY = (9.76, 9.84)
#: air, kg/m^3: 0.8 at 3500 m and 25 degC, 1.45 at sea level and -30 degC
AIR = (0.75, 1.5)
#: masses of discs, kg: 0.1 (dog and children's discs) to 0.2 (the rules of disc golf allow 0.2)
MASS = (0.08, 0.22)
#: diameters, m: the rules of disc golf ask for 0.21 to 0.3
DIAMETER = (0.18, 0.32)
#: height of a disc over its diameter: 0.012/0.21 to 0.035/0.27
HEIGHT = 1 / 6
#: a fast throw is 36 m/s (the distance record is of 40); with a margin
FASTEST = 45.0
#: angle of attack of the least drag, rad: published ones are -0.17 (-CL0/CLa of Hummel, 2003) to 0.07
ZERO_LIFT = 0.3
#: slopes of lift and pitching moment, per rad, and of drag, per rad^2, that are published of discs (docs/physics.md),
#: from Hummel (2003) and the papers that she compares to Crowther and Potts (2007)
SLOPES = {"CLa": (1.9, 3.1), "CDa": (0.7, 3.3), "CMa": (0.057, 0.43)}
#: a disc may leave these by half; degrees would by a factor of 57
WITHIN = 1.5
#: the lift of a table is a line this far from zero, rad: 6 deg, where discs fly
NEAR = 0.1
#: a storm, m/s
WIND = 30.0
#: output rates of parts are within this share of what their sheets state (BMI160, MPU-9250)
RATE = 0.01


def statement_findings(recording: Recording) -> Iterator[Finding]:
    """Yield what cannot be, or is unlikely, among the stated numbers of a recording."""
    yield from _environment(recording.environment, seen="magnetometer" in recording)
    if recording.disc is not None:
        yield from _disc(recording.disc, thrown=recording.plant == "flight")
    if recording.release is not None:
        yield from _release(recording.release)
    yield from _position(recording)
    yield from _row_spacing(recording)


def unlikely_flight(disc: Disc | None, environment: Environment, *releases: Release) -> list[str]:
    """Return what cannot be, or is unlikely, about a disc, its surroundings and throws of it, a sentence each."""
    found = [*_environment(environment, seen=False)]
    if disc is not None:
        found += _disc(disc, thrown=True)
    for release in releases:
        found += _release(release)
    return list(dict.fromkeys(doubts_of(found)))


def _outside(value: float, limits: tuple[float, float]) -> bool:
    return not limits[0] <= value <= limits[1]


def _environment(there: Environment, *, seen: bool) -> Iterator[Finding]:
    """Yield what is wrong with gravity, field, air and wind; a field of zero where a magnetometer has ``seen`` it."""
    if _outside(there.gravity, GRAVITY):
        guess = "in g? write 9.81" if 0.9 < there.gravity < 1.1 else "write the place's, 9.81 will do"
        yield Finding(
            "site.gravity",
            "error" if _outside(there.gravity, (9.7, 9.9)) else "warning",
            "[environment]",
            f"gravity_m_s2 is {there.gravity:g}",
            f"{GRAVITY[0]} to {GRAVITY[1]} on Earth",
            guess,
        )
    size = float(np.linalg.norm(there.magnetic_field))
    if size == 0 and seen:
        yield Finding(
            "site.field",
            "warning",
            "[environment]",
            "magnetic_field_ned_uT is zero: the field is not known",
            f"{FIELD[0]:g} to {FIELD[1]:g} uT",
            "state it, or latitude, longitude and date in the map of the import; diagnose needs it",
        )
    elif size and _outside(size, FIELD):
        guess = _power(size / 50, {-5: "T", -3: "mT (10 per 10 000 uT)", -2: "gauss", 1: "mG", 3: "nT"})
        yield Finding(
            "site.field",
            "error",
            "[environment]",
            f"the stated field is of {size:.4g} uT",
            f"{FIELD[0]:g} to {FIELD[1]:g} uT on Earth",
            guess or "take the World Magnetic Model's",
        )
    if there.air_density is not None and _outside(there.air_density, AIR):
        yield Finding(
            "air.density",
            "error" if _outside(there.air_density, (0.3, 2.0)) else "warning",
            "[environment]",
            f"air_density_kg_m3 is {there.air_density:g}",
            f"{AIR[0]} to {AIR[1]}",
            "in g/m^3?" if there.air_density > 300 else "1.2 at sea level and 20 degC",
        )
    if np.linalg.norm(there.wind) > WIND:
        speed = float(np.linalg.norm(there.wind))
        yield Finding(
            "air.wind", "warning", "[environment]", f"the stated wind is {speed:.3g} m/s", f"up to {WIND:g} m/s"
        )


def _power(ratio: float, names: dict[int, str]) -> str:
    """Return "in UNIT?" for the unit whose power of ten is nearest to a ratio, empty where none is near."""
    power = round(float(np.log10(ratio))) if ratio > 0 else 0
    return f"in {names[power]}?" if power in names else ""


def _disc(disc: Disc, *, thrown: bool) -> Iterator[Finding]:
    """Yield what is wrong with mass, diameter and moments of inertia; of what is no thrown disc it is only a note."""
    where = "[disc]"
    unusual: Severity = "warning" if thrown else "note"
    remedy = "" if thrown else "no matter if this is no disc"
    mass_ok, diameter_ok = not _outside(disc.mass, MASS), not _outside(disc.diameter, DIAMETER)
    if not mass_ok:
        grams = MASS[0] <= disc.mass / 1000 <= MASS[1]
        yield Finding(
            "disc.mass",
            "error" if grams else unusual,
            where,
            f"mass_kg is {disc.mass:g}",
            f"{MASS[0]} to {MASS[1]} kg",
            f"that is a disc in grams: write {disc.mass / 1000:g}" if grams else remedy,
        )
    if not diameter_ok:
        scale = next((k for k in (1000, 100, 39.37) if DIAMETER[0] <= disc.diameter / k <= DIAMETER[1]), None)
        unit = {1000: "mm", 100: "cm", 39.37: "inches"}.get(scale or 0, "")
        radius = DIAMETER[0] <= 2 * disc.diameter <= DIAMETER[1]
        guess = f"that is a disc in {unit}: write {disc.diameter / scale:.4g}" if scale else remedy
        yield Finding(
            "disc.diameter",
            "error" if scale else unusual,
            where,
            f"diameter_m is {disc.diameter:g}",
            f"{DIAMETER[0]} to {DIAMETER[1]} m",
            "is it the radius?" if radius else guess,
        )
    if mass_ok and diameter_ok:  # bounds of inertia need both
        yield from _inertia(disc, unusual, remedy)
    if disc.aero is not None:
        yield from _aero(disc.aero)
        yield from _slopes(disc.aero, disc.aero_table)


def _aero(aero: Aero) -> Iterator[Finding]:
    """Yield a yaw damping of the wrong sign, and an angle that is in degrees."""
    if aero.CNr > 0:
        yield Finding(
            "disc.CNr",
            "warning",
            "[disc.aero]",
            f"CNr is {aero.CNr:g}",
            "at most zero",
            "a positive one drives what it should damp",
        )
    if abs(aero.alpha0) > ZERO_LIFT:
        yield Finding(
            "disc.alpha0",
            "error",
            "[disc.aero]",
            f"alpha0_rad is {aero.alpha0:g}",
            f"within +-{ZERO_LIFT} rad",
            f"in degrees? write {np.radians(aero.alpha0):.4g}",
        )


def _slopes(aero: Aero, table: AeroTable | None) -> Iterator[Finding]:
    """Yield slopes that are per degree, or times the factor of degrees, and a table whose angles are degrees.

    A lift slope is never small by a factor of 57: that is an error. A drag slope is only likely wrong then, and a
    pitching moment's may be small, as it is of a disc that is nearly neutral: it is doubted beside a lift slope alone.
    """
    stated = {"CLa": aero.CLa} if table is not None else {"CLa": aero.CLa, "CDa": aero.CDa, "CMa": aero.CMa}
    factors = {name: _degrees_in(name, value) for name, value in stated.items()}
    for name, factor in factors.items():
        if factor == 1.0 or (name == "CMa" and factor > 1.0 and factors["CLa"] <= 1.0):
            continue
        low, high = SLOPES[name]
        unit, times = "per rad^2" if name == "CDa" else "per rad", f"{max(factor, 1 / factor):.4g}"
        yield Finding(
            f"disc.{name}",
            "error" if name == "CLa" else "warning",
            "[disc.aero]",
            f"{name} is {stated[name]:g}, {times} times too {'small' if factor > 1 else 'large'} for a disc",
            f"{low} to {high} {unit}",
            f"{'per degree' if factor > 1 else 'multiplied by 180/pi'}? write {stated[name] * factor:.4g}",
        )
    if table is not None:
        near = NEAR * np.array([-1.0, 1.0])
        slope = float(np.diff(np.interp(near, table.alpha, table.CL))[0] / np.diff(near)[0])
        if _degrees_in("CLa", slope) > 1.0:
            low, high = (float(np.radians(table.alpha[end])) for end in (0, -1))
            yield Finding(
                "disc.alpha",
                "error",
                "[disc.aero_table]",
                f"CL rises by {slope:.3g} per rad about alpha_rad = 0, 57.3 times too little for a disc",
                "{} to {} per rad".format(*SLOPES["CLa"]),
                f"is alpha_rad in degrees? Multiply by 0.0174533: {low:.4g} to {high:.4g}",
            )


def _degrees_in(name: str, slope: float) -> float:
    """Return the factor of degrees that brings a slope to what discs have; 1 where it needs none or none does.

    Drag grows with the square of the angle: its factor may be that of one angle or of two.
    """
    low, high = SLOPES[name][0] / WITHIN, SLOPES[name][1] * WITHIN
    one = float(np.degrees(1.0))
    powers = (1, -1, 2, -2) if name == "CDa" else (1, -1)
    return next((one**power for power in powers if low <= slope * one**power <= high), 1.0)


def _inertia(disc: Disc, unusual: Severity, remedy: str) -> Iterator[Finding]:
    """Yield what is wrong with the moments of inertia.

    Of a body of revolution with mass m, diameter d and height h, all mass lies within d/2 of the axis: Izz is at most
    m d^2/4 (all of it in the rim). A flat uniform disc has m d^2/8; a flying disc has more in its rim; where half of
    the mass is a board in the middle half of m d^2/8 is left, m d^2/16, which is taken for the least. About a diameter
    Ixx = Izz/2 + sum of m z^2, the sum being at most m (h/2)^2, and h at most d/6: between Izz/2 and Izz/2 + m d^2/144.
    """
    where = "[disc]"
    unit_inertia = disc.mass * disc.diameter**2
    least, most = unit_inertia / 16, unit_inertia / 4
    if _outside(disc.Izz, (least, most)):
        guess = _power(
            disc.Izz / (0.15 * unit_inertia), {3: "g m^2", 4: "kg cm^2", 6: "kg mm^2", 7: "g cm^2", 9: "g mm^2"}
        )
        yield Finding(
            "disc.Izz",
            "error" if guess else unusual,
            where,
            f"Izz_kg_m2 is {disc.Izz:.4g}",
            f"{least:.3g} to {most:.3g} for its mass and diameter (m d^2/16 to m d^2/4)",
            guess or remedy,
        )
    elif _outside(disc.Ixx, (disc.Izz / 2 * (1 - 1e-9), disc.Izz / 2 + unit_inertia * HEIGHT**2 / 4)):
        yield Finding(
            "disc.Ixx",
            unusual,
            where,
            f"Ixx_kg_m2 is {disc.Ixx:.4g}, Izz_kg_m2 {disc.Izz:.4g}",
            f"Ixx of {disc.Izz / 2:.4g} to {disc.Izz / 2 + unit_inertia * HEIGHT**2 / 4:.4g} for a flat disc",
            "Ixx sets how fast it nutates",
        )


def _release(release: Release) -> Iterator[Finding]:
    where = "[release]"
    if release.velocity is not None and (speed := float(np.linalg.norm(release.velocity))) > FASTEST:
        guess = "in km/h?" if FASTEST < speed < 3.6 * FASTEST else ""
        yield Finding(
            "release.speed", "warning", where, f"it is thrown at {speed:.4g} m/s", f"up to {FASTEST:g}", guess
        )
    if release.body_rate is not None and (rate := float(np.linalg.norm(release.body_rate))) > FASTEST_SPIN:
        yield Finding(
            "release.spin",
            "error",
            where,
            f"it spins at {rate:.4g} rad/s",
            f"up to {FASTEST_SPIN:g} rad/s",
            "in deg/s?",
        )
    for name, angle, limit in (
        ("roll", release.roll, pi),
        ("pitch", release.pitch, pi / 2),
        ("yaw", release.yaw, 2 * pi),
    ):
        if angle is not None and abs(angle) > limit * (1 + 1e-9):
            yield Finding(
                "release.angle", "error", where, f"{name}_rad is {angle:g}", f"within +-{limit:.3g} rad", "in degrees?"
            )
    if release.position is not None and release.position[2] > 0:
        yield Finding(
            "release.height",
            "warning",
            where,
            f"it is released {release.position[2]:g} m below the ground",
            "a negative third component of position_ned_m (down is positive)",
        )


def _position(recording: Recording) -> Iterator[Finding]:
    sheet = recording.sheets.get("accelerometer")
    if sheet is None or sheet.position is None:
        return
    reach = float(np.linalg.norm(sheet.position))
    disc = recording.disc
    radius = disc.diameter / 2 if disc is not None and not _outside(disc.diameter, DIAMETER) else None
    limit = 0.5 if radius is None else radius
    across = float(np.linalg.norm(sheet.position[:2]))
    if (across if radius is not None else reach) > limit:
        yield Finding(
            "accel.position",
            "error" if reach > 1 or radius is not None else "warning",
            "[sensors.accelerometer]",
            f"position_m is {reach:.4g} m from the centre",
            f"less than {limit:.3g} m" + " (the disc's radius)" * (radius is not None),
            "in mm?" if reach > 1 else "",
        )


def _row_spacing(recording: Recording) -> Iterator[Finding]:
    """Yield where rows have no times of their own, and what stands for them is a guess or told from readings."""
    off = max((sheet.rate_uncertainty for sheet in recording.sheets.values()), default=0.0)
    if off > RATE:
        yield Finding(
            "sensors.row_spacing",
            "warning",
            "[sensors]",
            f"rate_hz is stated to be off by {100 * off:.2g} % (one sd): no column of the log tells the times of rows",
            f"{100 * RATE:g} %, as parts are",
            "spin rates are off by as much, and lengths told from an acceleration by twice that; where the step is "
            "known, write step_s into the map of the import, without step_sigma_s",
        )
