"""Draw a case from a seed: plant, throws or runs, sensors and their noise, what is stated, and what is concealed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from discsim.disc import Aero, Disc, Release, Rig
from discsim.effects.catalogue import CATALOGUE, row
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import Plant, Samples
from discsim.sensors import Instruments
from discsim.shipped import load_disc
from discsim.validation.challenge.cases.case import Case, Coast, Kind, Mask, Run, Turning
from discsim.validation.challenge.cases.hiding import hide
from discsim.validation.challenge.cases.like_real import check_asked, like_real
from discsim.validation.challenge.cases.masking import masked
from discsim.validation.challenge.cases.off_catalogue import OFF_CATALOGUE
from discsim.validation.challenge.cases.sensor_kits import sensors_wanted, with_sensors
from discsim.validation.challenge.cases.stating import noisy, stated
from discsim.validation.scenarios.throws import Throw

__all__ = ["KINDS", "PLANT_SHARES", "draw_case"]

#: shares of the kinds of case: nothing hidden in a third (plain, other noise than stated, coefficients within their
#: stated sigma, or beyond it), one effect in a third, two in a sixth, physics of no catalogue in a sixth; a fault of
#: the setup, and what a real logger did, only where it is asked for
KINDS: Mapping[Kind, float] = {
    "nothing": 1 / 9,
    "noise": 1 / 9,
    "within_sigma": 1 / 18,
    "beyond_sigma": 1 / 18,
    "one": 1 / 3,
    "two": 1 / 6,
    "off_catalogue": 1 / 6,
    "setup": 0.0,
    "like_real": 0.0,
}
PLANT_SHARES: Mapping[Plant, float] = {"flight": 0.49, "rate_table": 0.17, "spin_down": 0.17, "free_spin": 0.17}


def draw_case(
    seed: int,
    plant: Plant | None = None,
    effects: Sequence[str] = (),
    kind: Kind | None = None,
    mask: Mask | None = None,
) -> Case:
    """Draw the case of a seed; a plant, a kind, or effects (ids, or names of off-catalogue physics) may be asked for.

    A ``mask`` is put over it (`MASKS`). Raises `InputError` where what is asked for does not go together.
    """
    if kind == "like_real":
        check_asked(plant, effects, mask)
        own = np.random.default_rng([seed, 2])
        return like_real(seed, _place(own), own)
    rng = np.random.default_rng(seed)
    drawn_plant: Plant = rng.choice(list(PLANT_SHARES), p=list(PLANT_SHARES.values()))
    drawn_kind: Kind = rng.choice(list(KINDS), p=list(KINDS.values()))
    if mask is not None and (kind == "setup" or any(id in CATALOGUE and row(id).setup for id in effects)):
        raise InputError(f"mask {mask}: hides physical effects alone; expected no mask with a fault of the setup")
    plant, kind = plant or _plant_of(effects, str(drawn_plant)), kind or _kind_of(effects, str(drawn_kind))
    if kind in ("within_sigma", "beyond_sigma") and plant in ("rate_table", "free_spin"):
        kind = "nothing"  # nothing stated there has a sigma
    loosely = kind in ("within_sigma", "beyond_sigma")
    if plant in ("rate_table", "spin_down"):
        case = _bench(seed, plant, kind, rng)
    else:
        case = _throws(seed, plant, kind, rng, linear=loosely)
    case = hide(with_sensors(case, sensors_wanted(effects), rng), effects, rng)
    case = stated(noisy(case, rng, everywhere=False), rng, loosely=loosely)
    return masked(case, mask, effects) if mask is not None else case


def _plant_of(effects: Sequence[str], drawn: str) -> Plant:
    for id in effects:
        plants = OFF_CATALOGUE[id].plants if id in OFF_CATALOGUE else row(id).plants
        if drawn not in plants:
            return plants[0]  # type: ignore[return-value]
    return drawn  # type: ignore[return-value]


def _kind_of(effects: Sequence[str], drawn: str) -> Kind:
    if any(id in OFF_CATALOGUE for id in effects):
        if len(effects) > 1:
            raise InputError("off-catalogue physics is concealed alone; expected one name, or ids of the catalogue")
        return "off_catalogue"
    if any(row(id).setup for id in effects):
        return "setup"
    if effects:
        return "one" if len(effects) == 1 else "two"
    return drawn  # type: ignore[return-value]


# ---------------------------------------------------------------------------------------------- plants


def _place(rng: np.random.Generator) -> Environment:
    """Draw a place: half of the time the shipped discs', else anywhere between the tropics and the polar circle."""
    _, home = load_disc("driver")
    if rng.random() < 0.5:
        return home
    level, turned = rng.uniform(17.0, 33.0), np.radians(rng.uniform(-12.0, 12.0))
    down = rng.uniform(20.0, 50.0) * (1.0 if rng.random() < 0.85 else -1.0)
    b_field = np.round([level * np.cos(turned), level * np.sin(turned), down], 1)
    return Environment(round(float(rng.uniform(9.78, 9.83)), 3), b_field, round(float(rng.uniform(1.05, 1.27)), 3))


def _disc(rng: np.random.Generator, linear: bool) -> Disc:
    """Draw a disc: the driver with other coefficients, or (unless ``linear``) a shipped one with tables."""
    if not linear and rng.random() < 0.3:
        return load_disc(str(rng.choice(["cd1", "cd5", "dd2", "fd2", "ultrastar"])))[0]
    driver, _ = load_disc("driver")
    if rng.random() < 0.4:
        return driver
    assert driver.aero is not None
    spread = dict(zip(driver.aero._fields, rng.uniform(0.85, 1.15, len(driver.aero)), strict=True))
    aero = Aero(*(float(f"{value * spread[name]:.4g}") for name, value in driver.aero._asdict().items()))
    Ixx = driver.Ixx * rng.uniform(0.95, 1.1)
    Izz = Ixx * rng.uniform(1.85, 1.92)
    mass = driver.mass * rng.uniform(0.95, 1.05)
    return replace(driver, aero=aero, Ixx=float(f"{Ixx:.4g}"), Izz=float(f"{Izz:.4g}"), mass=round(mass, 4))


def _throw(number: int, count: int, disc: Disc, start: float, rng: np.random.Generator) -> Release:
    """Draw a throw; headings go round the compass, every third spins the other way."""
    spin = rng.uniform(2900.0, 5200.0) * (-1.0 if number % 3 == 1 else 1.0)
    slow = disc.diameter > 0.25 or rng.random() < 0.1
    throw = Throw(
        speed=rng.uniform(14.0, 19.0) if slow else rng.uniform(18.0, 27.0),
        heading_deg=start + 360.0 * number / count + rng.normal(0.0, 12.0),
        spin_deg_s=spin * (0.6 if slow else 1.0),
        elevation_deg=rng.uniform(7.0, 14.0),
        bank_deg=-np.sign(spin) * rng.uniform(4.0, 16.0),
        nose_deg=rng.uniform(3.0, 10.0),
        height=rng.uniform(1.1, 1.6),
    )
    wobble = rng.normal(0.0, 0.3, 2)
    release = throw.release
    assert release.body_rate is not None
    return replace(release, body_rate=release.body_rate + np.array([*wobble, 0.0]))


def _throws(seed: int, plant: Plant, kind: Kind, rng: np.random.Generator, *, linear: bool) -> Case:
    environment = _place(rng)
    if plant == "flight" and rng.random() < 0.15:
        environment = replace(environment, wind=np.append(rng.normal(0.0, 1.5, 2).round(1), 0.0))
    disc = _disc(rng, linear=linear)
    count = int(rng.integers(3, 9))
    start = rng.uniform(0.0, 360.0)
    runs = tuple(_throw(number, count, disc, start, rng) for number in range(count))
    bare = Instruments()
    return Case(seed, plant, kind, environment, runs, bare, bare, disc=disc, stated_disc=disc)


def _bench(seed: int, plant: Plant, kind: Kind, rng: np.random.Generator) -> Case:
    environment = replace(_place(rng), air_density=None)
    bare = Instruments()
    if plant == "spin_down":
        count = int(rng.integers(3, 6))
        rates = rng.uniform(40.0, 95.0, count) * np.where(np.arange(count) % 3 == 2, -1.0, 1.0)
        duration = float(rng.choice([25.0, 30.0, 40.0]))
        runs: tuple[Run, ...] = tuple(Coast(float(rate), float(rng.uniform(-np.pi, np.pi)), duration) for rate in rates)
        Izz = float(f"{1.1e-3 * rng.uniform(0.75, 1.35):.4g}")
        viscous = float(f"{3e-5 * rng.uniform(0.6, 1.5):.3g}")
        rig = Rig(Izz, viscous)
        return Case(seed, plant, kind, environment, runs, bare, bare, rig=rig, stated_rig=rig)
    count = int(rng.integers(3, 5))
    runs = tuple(Turning(_profile(number, rng), float(rng.uniform(-np.pi, np.pi))) for number in range(count))
    return Case(seed, plant, kind, environment, runs, bare, bare)


def _profile(number: int, rng: np.random.Generator) -> Samples:
    """Draw a table's profile: up through plateaus to 5000 deg/s or so, some then down; every third turns left."""
    up = np.sort(rng.uniform(5.0, 92.0, int(rng.integers(3, 6))))
    down = rng.uniform(10.0, 60.0, int(rng.integers(0, 3)))
    plateaus = np.concatenate(([0.0] if rng.random() < 0.7 else [], up, down)) * (-1.0 if number % 3 == 2 else 1.0)
    hold = float(rng.choice([3.0, 4.0, 5.0]))
    t, rate = [0.0], [float(plateaus[0])]
    for index, plateau in enumerate(plateaus.tolist()):
        if index:
            t.append(t[-1] + 1.0)
            rate.append(plateau)
        t.append(t[-1] + hold)
        rate.append(plateau)
    # no table starts on the loggers' grid
    return Samples(np.array([0.0, *(np.array(t[1:]) + 0.00225)]), np.array(rate))
