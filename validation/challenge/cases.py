"""Draw a case from a seed: plant, throws or runs, sensors and their noise, what is stated, and what is concealed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Aero, Disc, Release, Rig
from discsim.effects.catalogue import CATALOGUE, row
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import Plant, Samples
from discsim.sensors import (
    Accelerometer,
    Gps,
    Gyroscope,
    Instruments,
    Magnetometer,
    Noise,
    RateReference,
    Sampling,
    Tracker,
)
from discsim.sensors.instruments import Sensor
from discsim.shipped import load_disc
from validation.challenge.case import Case, Coast, Concealed, Kind, Mask, Run, Turning
from validation.challenge.physics import OFF_CATALOGUE, log_uniform
from validation.challenge.sizes import conceivable, draw_effect, scaled
from validation.challenge.strength import sizes
from validation.throws import Throw

__all__ = ["KINDS", "PLANT_SHARES", "draw_case"]

#: lengths of what a ``short`` case records, s
SHORT_FLIGHT_S, SHORT_RUN_S = 1.5, 6.0
#: shares of the kinds of case: nothing hidden in a third (plain, other noise than stated, coefficients within their
#: stated sigma, or beyond it), one effect in a third, two in a sixth, physics of no catalogue in a sixth
KINDS: Mapping[Kind, float] = {
    "nothing": 1 / 9,
    "noise": 1 / 9,
    "within_sigma": 1 / 18,
    "beyond_sigma": 1 / 18,
    "one": 1 / 3,
    "two": 1 / 6,
    "off_catalogue": 1 / 6,
}
PLANT_SHARES: Mapping[Plant, float] = {"flight": 0.49, "rate_table": 0.17, "spin_down": 0.17, "free_spin": 0.17}

#: coefficients that an ordinary flight determines far better than a sigma of some per cent
_WELL_KNOWN = ("CL0", "CLa", "CD0", "CDa", "CM0", "CMa", "CNr")
#: effects that moving the coefficients within a few per cent cannot imitate
_BESIDE_COEFFICIENTS = ("air.wind", "aero.spin_side_force", "event.", "mag.", "accel.", "gyro.", "gps.")


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
    rng = np.random.default_rng(seed)
    drawn_plant: Plant = rng.choice(list(PLANT_SHARES), p=list(PLANT_SHARES.values()))
    drawn_kind: Kind = rng.choice(list(KINDS), p=list(KINDS.values()))
    plant, kind = plant or _plant_of(effects, str(drawn_plant)), kind or _kind_of(effects, str(drawn_kind))
    if kind in ("within_sigma", "beyond_sigma") and plant in ("rate_table", "free_spin"):
        kind = "nothing"  # nothing stated there has a sigma
    loosely = mask == "stated_loosely" or kind in ("within_sigma", "beyond_sigma")
    if plant in ("rate_table", "spin_down"):
        case = _bench(seed, plant, kind, rng)
    else:
        case = _throws(seed, plant, kind, rng, linear=loosely)
    case = _with_sensors(case, _sensors_wanted(effects), rng, mask)
    case = _shortened(case, mask)
    case = _hide(case, effects, rng, doubled=mask == "second_effect")
    case = _stated(_noisy(case, rng, everywhere=mask == "coloured_noise"), rng, loosely=loosely)
    return _near_limit(case, rng) if mask == "near_limit" else case


#: how far from its detection limit an effect is that lies near it, in limits
_NEAR = (0.4, 4.0)
#: effects that have no limit to scale to: what they change in readings does not grow with their size
_NOT_SCALED = ("accel.saturation",)


def _near_limit(case: Case, rng: np.random.Generator) -> Case:
    """Draw the sizes of what is concealed anew, near the case's own detection limits."""
    limits, near = sizes(case), []
    for item in case.concealed:
        size = limits[item.effect.id]
        if size > 0.0 and item.effect.id not in _NOT_SCALED:
            item = replace(item, effect=scaled(item.effect, log_uniform(rng, *_NEAR) / size, case.plant))
        near.append(item)
    return replace(case, concealed=tuple(near))


def _shortened(case: Case, mask: Mask | None) -> Case:
    if mask == "few_recordings":
        return replace(case, runs=case.runs[:2])
    if mask != "short":
        return case
    runs = [replace(run, duration=SHORT_RUN_S) if isinstance(run, Coast) else run for run in case.runs]
    return replace(case, runs=tuple(runs), longest=SHORT_FLIGHT_S)


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
    if effects:
        return "one" if len(effects) == 1 else "two"
    return drawn  # type: ignore[return-value]


def _sensors_wanted(effects: Sequence[str]) -> set[str]:
    acting = {CATALOGUE[id].acts_on for id in effects if id in CATALOGUE}
    if "rotating_magnet" in effects:
        acting.add("magnetometer")
    return acting - {"motion", "clock"}


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


# ---------------------------------------------------------------------------------------------- sensors


def _with_sensors(case: Case, wanted: set[str], rng: np.random.Generator, mask: Mask | None) -> Case:
    """Put sensors on board; all of ``wanted`` are there."""
    sensors = _module(case.plant, rng)
    for name in sorted(_missing(case.plant, rng) - wanted):
        sensors.pop(name, None)
    if "track" not in wanted and case.plant == "flight" and "gps" in sensors and rng.random() < 0.8:
        sensors.pop("track")
    if mask == "magnetometer_only":
        if others := wanted - {"magnetometer"}:
            raise InputError(f"mask {mask}: leaves no {', '.join(sorted(others))} to conceal anything in")
        sensors = {"magnetometer": _module(case.plant, rng)["magnetometer"]}
    instruments = Instruments(sensors)
    if mask == "clipped":
        for name, limit in (("accelerometer", 78.4532), ("gyroscope", 8.7266)):
            if name in sensors:
                instruments = instruments.fitted(name, range=limit)
    return replace(case, instruments=instruments, sheets_of=instruments)


def _missing(plant: Plant, rng: np.random.Generator) -> set[str]:
    """Draw which sensors are not there: none in two thirds."""
    if rng.random() < 2 / 3:
        return set()
    if plant == "flight":
        choices = [{"gps"}, {"gyroscope"}, {"accelerometer"}, {"magnetometer"}]
        return choices[int(rng.choice(4, p=[0.35, 0.35, 0.15, 0.15]))]
    if plant == "free_spin":
        return set()
    choices = [{"gyroscope"}, {"rate_reference"}, {"magnetometer"}, {"accelerometer"}]
    return choices[int(rng.integers(4))]


def _module(plant: Plant, rng: np.random.Generator) -> dict[str, Sensor]:
    fast = float(rng.choice([200.0, 200.0, 100.0, 400.0 if plant in ("flight", "free_spin") else 250.0]))
    wide = 104.72 if rng.random() < (0.8 if plant == "free_spin" else 0.25) else 34.9066
    position = [-0.0161, 0.0, 0.0]
    if rng.random() < 0.4:
        position = np.round(rng.uniform([-0.0175, -0.004, -0.002], [-0.009, 0.004, 0.002]), 4).tolist()
    module: dict[str, Sensor] = {
        "magnetometer": Magnetometer(
            Sampling(float(rng.choice([100.0, 100.0, 100.0, 80.0, 50.0]))),
            noise=Noise(round(float(rng.uniform(0.3, 0.9)), 2)),
            resolution=float(rng.choice([0.15, 0.15, 0.6])),
            range=4912.0,
        ),
        "accelerometer": Accelerometer(
            Sampling(fast),
            position=readonly(position),
            noise=Noise(round(float(rng.uniform(0.03, 0.12)), 3)),
            resolution=0.0047884,
            range=156.9064,
        ),
        "gyroscope": Gyroscope(
            Sampling(fast), noise=Noise(round(float(rng.uniform(0.002, 0.006)), 4)), resolution=0.0010653, range=wide
        ),
    }
    if plant == "flight":
        module["gps"] = Gps(
            Sampling(float(rng.choice([10.0, 10.0, 5.0, 18.0]))),
            position_noise=Noise(round(float(rng.uniform(0.08, 0.3)), 2)),
            velocity_noise=Noise(round(float(rng.uniform(0.04, 0.1)), 3)),
        )
        module["track"] = Tracker(
            Sampling(float(rng.choice([30.0, 60.0]))),
            Noise(round(float(rng.uniform(0.02, 0.08)), 3)),
            unseen=float(rng.choice([0.0, 0.05])),
        )
    if plant in ("rate_table", "spin_down"):
        module["rate_reference"] = RateReference(Sampling(100.0), noise=Noise(0.0006))
    return module


def _noisy(case: Case, rng: np.random.Generator, *, everywhere: bool) -> Case:
    """Let some sensors of a ``noise`` case be louder, quieter or slower than stated; ``everywhere`` all are slower."""
    if case.kind != "noise" and not everywhere:
        return case
    instruments = case.instruments
    names = list(instruments.sensors)
    some = len(names) if everywhere else int(rng.integers(1, min(3, len(names)) + 1))
    for name in rng.choice(names, size=some, replace=False).tolist():
        fields = ("position_noise", "velocity_noise") if name == "gps" else ("noise",)
        coloured, louder = everywhere or rng.random() < 0.5, rng.random() < 0.6
        factor = float(rng.uniform(1.3, 3.0) if louder else rng.uniform(0.4, 0.75))
        correlation = float(np.exp(rng.uniform(np.log(0.03), np.log(1.5))))
        for item in fields:
            white = getattr(instruments.sensors[name], item).white
            noise = Noise(white, white * rng.uniform(0.5, 1.5), correlation) if coloured else Noise(white * factor)
            instruments = instruments.fitted(name, **{item: noise})
    return replace(case, instruments=instruments)


# ---------------------------------------------------------------------------------------------- concealing


def _hide(case: Case, effects: Sequence[str], rng: np.random.Generator, *, doubled: bool) -> Case:
    """Choose and size what is concealed: ``effects`` where given; ``doubled``: and another of its largest size."""
    sensors = tuple(case.instruments.sensors)
    if case.kind == "off_catalogue":
        possible = [
            name for name, kind in OFF_CATALOGUE.items() if case.plant in kind.plants and _present(name, sensors)
        ]
        name = effects[0] if effects else str(rng.choice(possible))
        if name not in possible:
            raise InputError(f"{name}: cannot act on a {case.plant}; expected one of {', '.join(possible)}")
        secret = OFF_CATALOGUE[name].drawn(case.plant, rng)
        while getattr(secret, "sensor", sensors[0]) not in sensors:
            secret = OFF_CATALOGUE[name].drawn(case.plant, rng)
        return replace(case, secret=secret)
    if case.kind not in ("one", "two"):
        return case
    for id in effects:
        if case.plant not in row(id).plants:
            raise InputError(f"{id}: acts on {', '.join(row(id).plants)}; this is a {case.plant}")
    possible = conceivable(case.plant, sensors)
    if "accelerometer" in sensors and case.instruments.sensors["accelerometer"].range < 100.0:  # type: ignore[union-attr]
        possible.remove("accel.saturation")  # it clips by its sheet before it could by a fault
    if doubled:
        case = replace(case, kind="two")
    count = max(len(effects), 2 if case.kind == "two" else 1)
    concealed: list[Concealed] = []
    for number in range(count):
        others = [item.effect.id for item in concealed]
        free = [id for id in possible if all(_goes_with(id, other) for other in others)]
        id = effects[number] if number < len(effects) else str(rng.choice(free))
        only = int(rng.integers(len(case.runs))) if row(id).event else None
        largest = doubled and number == count - 1
        concealed.append(Concealed(draw_effect(id, case.plant, rng, case.recorded, largest=largest), only))
    return replace(case, concealed=tuple(concealed))


def _present(name: str, sensors: tuple[str, ...]) -> bool:
    needed = {"rotating_magnet": ("magnetometer",), "sensor_hysteresis": ("accelerometer",)}
    if name == "warming":
        return "accelerometer" in sensors or "gyroscope" in sensors
    return all(sensor in sensors for sensor in needed.get(name, ()))


def _goes_with(id: str, other: str) -> bool:
    """Tell whether two effects can be told apart when both are there, and have no parameter's name in common."""
    a, b = row(id), row(other)
    if id == other or set(a.parameters) & set(b.parameters) or (a.event and b.event):
        return False
    clocks = [item for item in (id, other) if "clock" in item or item.endswith(("lag", "latency", "dropped_samples"))]
    return len(clocks) < 2


# ---------------------------------------------------------------------------------------------- what is stated


def _stated(case: Case, rng: np.random.Generator, *, loosely: bool) -> Case:
    """Turn what is drawn so far (the stated numbers) into stated ones with a sigma, and true ones that differ."""
    if case.plant == "spin_down":
        case = _stated_rig(case, rng, loosely)
    elif case.plant == "flight":
        case = _stated_coefficients(case, rng, loosely)
        if rng.random() < 0.25:
            case = replace(case, stated_releases=tuple(_stated_release(run, rng) for run in case.runs))
    return case


def _within(rng: np.random.Generator, size: int, largest: float) -> FloatArray:
    """Draw standard deviates (size,) none of which exceeds ``largest``."""
    z = rng.standard_normal(size)
    while np.any(far := np.abs(z) > largest):
        z[far] = rng.standard_normal(int(np.count_nonzero(far)))
    return z


def _beyond(rng: np.random.Generator) -> float:
    return float(rng.uniform(4.5, 8.0) * (1.0 if rng.random() < 0.5 else -1.0))


def _stated_rig(case: Case, rng: np.random.Generator, loosely: bool) -> Case:
    uncertain = rng.random() < 0.5
    if not (uncertain or loosely):
        return case
    assert case.stated_rig is not None
    viscous = case.stated_rig.viscous
    sigma = float(f"{0.1 * viscous:.3g}")
    z = _beyond(rng) if case.kind == "beyond_sigma" else float(_within(rng, 1, 2.2)[0])
    true = float(f"{viscous + z * sigma:.6g}")
    stated = replace(case.stated_rig, sigma={"viscous_N_m_s": sigma})
    return replace(case, stated_rig=stated, rig=Rig(stated.Izz, true), moved={"viscous_N_m_s": true})


def _stated_coefficients(case: Case, rng: np.random.Generator, loosely: bool) -> Case:
    beside = all(item.effect.id.startswith(_BESIDE_COEFFICIENTS) for item in case.concealed)
    competing = case.kind == "one" and beside and rng.random() < 0.15
    disc = case.stated_disc
    assert disc is not None
    assert disc.aero is not None
    if not (competing or loosely) or disc.aero_table is not None:
        return case
    share = float(rng.choice([0.02, 0.03, 0.04]))
    names = [name for name in disc.aero._fields if name != "alpha0"]
    z = dict(zip(names, _within(rng, len(names), 1.5 if case.kind == "beyond_sigma" else 2.2), strict=True))
    if case.kind == "beyond_sigma":
        z[str(rng.choice(_WELL_KNOWN))] = _beyond(rng)
    stated = disc.aero._asdict()
    sigma = {name: float(f"{abs(share * stated[name]):.6g}") for name in names}
    true = {name: float(f"{stated[name] + float(z[name]) * sigma[name]:.7g}") for name in names}
    return replace(
        case,
        disc=replace(disc, aero=disc.aero._replace(**true)),
        stated_disc=replace(disc, sigma=sigma),
        moved=true,
    )


def _stated_release(run: Run, rng: np.random.Generator) -> Release:
    """State a release as a hand-held camera would see it."""
    assert isinstance(run, Release)
    assert run.velocity is not None
    assert run.body_rate is not None
    sigma: dict[str, float | FloatArray] = {"velocity_ned_m_s": 0.6, "body_rate_rad_s": 2.0}
    velocity = np.round(run.velocity + 0.6 * rng.standard_normal(3), 2)
    body_rate = np.round(run.body_rate + 2.0 * rng.standard_normal(3), 2)
    return Release(velocity=velocity, body_rate=body_rate, sigma=sigma)
