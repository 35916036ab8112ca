"""Options that several commands share, parsed into what the code works with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
import typer

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Release, Rig
from discsim.effects.catalogue import Effect, by_id, effect, row
from discsim.effects.own import UserEffect
from discsim.environment import FIELD_MODEL_SIGMA, Environment, world_magnetic_field
from discsim.errors import InputError
from discsim.law import MOTION_TARGETS, Law
from discsim.limits import limit_of
from discsim.model_file import Model, read_model
from discsim.module import Module
from discsim.recording import PLANTS, Plant
from discsim.shipped import load_disc, load_site
from discsim.validation.reporting.coordinates import coordinates

__all__ = [
    "DateOption",
    "EffectOption",
    "ModelOption",
    "ModuleOption",
    "OutOption",
    "PlaceOption",
    "SeedOption",
    "SiteOption",
    "WithOption",
    "all_effects",
    "at_place",
    "at_site",
    "at_wind",
    "disc_to_fly",
    "flight_effects",
    "given_files",
    "known_plant",
    "laws_upon",
    "parse_effects",
    "parse_module",
    "parse_sizes",
    "parse_vector",
    "rig_of",
    "say_note",
    "throw_as_said",
]

_DEG, _RPM = float(np.radians(1.0)), 2.0 * np.pi / 60.0
#: a storm that nobody throws in: Beaufort 12 starts at 32.7 m/s
_STRONGEST_WIND = 33.0

OutOption: TypeAlias = Annotated[Path, typer.Option("--out", help="Folder to write into; created where absent.")]
SeedOption: TypeAlias = Annotated[int, typer.Option("--seed", min=0, help="Seed of everything random.")]
EffectOption: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--effect",
        help="An effect of the catalogue, ID:name=value,name=value; may repeat. Examples: air.wind:w_north_m_s=1.5, "
        "'mag.axes:axes=x -y z'",
    ),
]

SiteOption: TypeAlias = Annotated[
    str | None, typer.Option("--site", help="A shipped place's name or a TOML file: its magnetic field is taken.")
]

PlaceOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--place",
        metavar="LAT,LON",
        help="Where it was recorded, degrees north and east (47.4,8.5): looks the magnetic field up (WMM).",
    ),
]
DateOption: TypeAlias = Annotated[
    str | None, typer.Option("--date", metavar="YYYY-MM-DD", help="When it was recorded, with --place.")
]

ModelOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--model",
        help="A model file: surroundings, disc, law, and effects; those of named recordings act where --out has that "
        "name.",
    ),
]

ModuleOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        "--module",
        metavar="mass_kg=M,...",
        help="A module that adds to the disc's mass and inertia: mass_kg=M,x_m=X,y_m=Y,radius_m=A; place and radius "
        "are 0 by default. Without it the disc's mass holds all.",
    ),
]

WithOption: TypeAlias = Annotated[
    list[Path] | None,
    typer.Option("--with", help="A Python file with an effect of your own that --model or --effect names; may repeat."),
]


def say_note(text: str) -> None:
    """Say what a reader must know of the input, where results do not go: on the standard error."""
    typer.echo(f"note: {text}", err=True)


def disc_to_fly(
    disc: str | None, model: Path | None, own: Sequence[UserEffect] = ()
) -> tuple[Disc, Environment, Model | None]:
    """Return the disc of ``--disc`` (by default the driver) or of ``--model``, where it flies, and the model if any.

    ``own`` are the effects of ``--with``.
    """
    if model is None:
        return *load_disc(disc or "driver"), None
    if disc is not None:
        raise InputError(f"--disc {disc} and --model {model} both name a disc; expected one of them")
    given = read_model(model, own)
    if given.disc is None:
        raise InputError(f"{model}: has no [disc]; expected the model of a disc")
    return given.disc, given.environment, given


def given_files(*names: str | Path | None) -> list[Path]:
    """Return the files among what was given: paths, and names that end in .toml (others are shipped ones)."""
    return [Path(name) for name in names if name is not None and (isinstance(name, Path) or name.endswith(".toml"))]


def all_effects(
    model: Model | None,
    texts: Sequence[str] | None,
    plant: Plant,
    sensors: Sequence[str],
    recording: str | None,
    own: Sequence[UserEffect] = (),
) -> tuple[list[Effect], list[str]]:
    """Return the effects of a model and of ``--effect`` upon a recording, and one line for each that is passed over.

    A model holds for more than one plant and more sensors, so what cannot act here is passed over; of ``--effect`` it
    is refused. Raises `InputError` for an effect given twice.
    """
    effects, notes = [], []
    for given in model.effects_in(recording) if model is not None else ():
        if problem := _cannot_act(given, plant, sensors):
            notes.append(f"the model's {given.id} is passed over: {problem}")
        else:
            effects.append(given)
    effects += parse_effects(texts, plant, sensors, own)
    by_id(effects)
    return effects, notes


def flight_effects(
    model: Model | None, texts: Sequence[str] | None
) -> tuple[list[Effect], dict[tuple[str, str], float], list[str]]:
    """Return the effects of a model and of ``--effect`` upon a flight, one sigma of the model's by (id, parameter).

    Beside them a line for each that is passed over. Raises `InputError` for a model with a law about the motion, which
    the flights of many throws do not know.
    """
    if model is not None and any(law.target in MOTION_TARGETS for law in model.laws):
        raise InputError("the model has a law about the motion; expected one without (discsim fly takes it)")
    effects, notes = all_effects(model, texts, "flight", (), None)
    held = () if model is None else model.effects
    sigma = {
        (item.effect.id, name): size
        for item in held
        if item.effect in effects and item.effect.own is None and item.effect.row.apply is None
        for name, size in item.sigma.items()
        if size > 0.0
    }
    return effects, sigma, notes


def laws_upon(model: Model | None, plant: Plant, sensors: Sequence[str]) -> tuple[list[Law], list[str]]:
    """Return a model's laws that act on a plant with these sensors, and one line for each that is passed over."""
    acting, notes = [], []
    for law in () if model is None else model.laws:
        passed = f"the model's law about {law.target} is passed over"
        sensor = law.target.partition(".")[0]
        if law.target in MOTION_TARGETS and plant == "rate_table":
            notes.append(f"{passed}: a rate table turns as commanded, whatever acts on it")
        elif law.target not in MOTION_TARGETS and sensor not in sensors:
            notes.append(f"{passed}: there is no {sensor} on board, only {', '.join(sensors)}")
        else:
            acting.append(law)
    return acting, notes


def _cannot_act(given: Effect, plant: Plant, sensors: Sequence[str]) -> str:
    """Return why an effect cannot act on a plant with these sensors; empty where it can."""
    kind = given.row
    if plant not in kind.plants:
        return f"acts on {', '.join(kind.plants)}; this is a {plant}"
    if not kind.acts_with(sensors):
        absent = "magnetometer, accelerometer or gyroscope" if kind.acts_on == "board" else kind.acts_on
        return f"there is no {absent} on board, only {', '.join(sensors)}"
    return ""


def at_site(environment: Environment, site: str | None) -> Environment:
    """Return the environment with the magnetic field of a place, or as it is where none is named."""
    if site is None:
        return environment
    return replace(environment, magnetic_field=load_site(site).environment.magnetic_field)


def at_wind(environment: Environment, wind: str | None) -> Environment:
    """Return the environment with the steady wind of ``--wind SPEED,FROM`` (m/s, deg from north), or as it is."""
    if wind is None:
        return environment
    try:
        speed, origin = (float(part) for part in wind.split(","))
    except ValueError:
        raise InputError(f"--wind {wind}: expected SPEED,FROM in m/s and deg, such as 3,270 from the west") from None
    if not 0.0 <= speed <= _STRONGEST_WIND:
        raise InputError(f"--wind {wind}: expected a speed from 0 to {_STRONGEST_WIND:g} m/s")
    towards = np.radians(origin + 180.0)
    return replace(environment, wind=np.array([speed * np.cos(towards), speed * np.sin(towards), 0.0]))


def throw_as_said(throw: Release, said: Mapping[str, float | None]) -> Release:
    """Return a throw with what was said of it, in people's units, in the place of its own; as it is for nothing."""
    given = {name: value for name, value in said.items() if value is not None}
    if not given:
        return throw
    from discsim.launch import launch_of, released

    units = {"launch": _DEG, "heading": _DEG, "hyzer": _DEG, "nose": _DEG, "spin": _RPM}
    words = {name: value * units.get(name, 1.0) for name, value in given.items()}
    return released(launch_of(throw)._replace(**words), throw)


def at_place(environment: Environment, place: str | None, day: str | None) -> Environment:
    """Return the environment with the World Magnetic Model's field at ``--place`` on ``--date``, or as it is.

    Raises `InputError` for one without the other, and for what is no place or no date.
    """
    if place is None and day is None:
        return environment
    if place is None or day is None:
        raise InputError("--place LAT,LON and --date YYYY-MM-DD belong together: the field changes with the years")
    found = coordinates(place)
    if found is None:
        raise InputError(f"--place {place}: expected LAT,LON, degrees north and east, such as 52.52,13.41")
    latitude, longitude = found
    try:
        when = date.fromisoformat(day)
    except ValueError:
        raise InputError(f"--date {day}: expected YYYY-MM-DD, such as 2025-08-31") from None
    if abs(latitude) > 90.0 >= abs(longitude):
        raise InputError(
            f"--place {place}: no place at latitude {latitude:g}; expected LAT,LON, degrees north and east: are they "
            f"swapped? Then --place {longitude:g},{latitude:g}"
        )
    field = world_magnetic_field(latitude, longitude, when)
    sigma = {**environment.sigma, "magnetic_field_ned_uT": FIELD_MODEL_SIGMA}
    return replace(environment, magnetic_field=field, sigma=sigma)


def parse_effects(
    texts: Sequence[str] | None, plant: Plant, sensors: Sequence[str], own: Sequence[UserEffect] = ()
) -> list[Effect]:
    """Return the effects of ``--effect ID:name=value,...``; raises `InputError` saying what was expected.

    An effect that cannot act is refused: one of another plant, or of a sensor that is not among ``sensors``.
    """
    effects = []
    for text in texts or ():
        id, _, rest = text.partition(":")
        mine = next((one for one in own if one.id == id.strip()), None)
        kind = row(id.strip()) if mine is None else mine.row
        sizes: dict[str, float] = {}
        setting: dict[str, str] = {}
        for item in filter(None, rest.split(",")):
            name, _, value = (part.strip() for part in item.partition("="))
            if name in kind.settings:
                setting[name] = value
                continue
            try:
                sizes[name] = float(value)
            except ValueError:
                raise InputError(f"--effect {text}: '{item}' is no name=number; expected ID:name=number,...") from None
            if beyond := limit_of(name).fault(sizes[name], divides=name in kind.positive):
                raise InputError(f"--effect {text}: '{item}', {beyond}")
        given = effect(id.strip(), **sizes, **setting) if mine is None else mine.sized(sizes)
        if mine is None and not sizes and not setting and given.value == kind.baseline:
            raise InputError(f"--effect {text}: does nothing without a size; expected {id.strip()}:{kind.example}")
        if problem := _cannot_act(given, plant, sensors):
            raise InputError(f"--effect {given.id}: {problem}")
        effects.append(given)
    return effects


def parse_module(text: str) -> Module:
    """Return the module of ``--module mass_kg=M,x_m=X,y_m=Y,radius_m=A``.

    Raises `InputError` for another key, for what is no number, and for a module without a mass.
    """
    keys = {"mass_kg": "mass", "x_m": "x", "y_m": "y", "radius_m": "radius"}
    sizes: dict[str, float] = {}
    for item in filter(None, text.split(",")):
        name, _, value = (part.strip() for part in item.partition("="))
        try:
            sizes[keys[name]] = float(value)
        except (KeyError, ValueError):
            raise InputError(f"--module {text}: '{item}' is not one of {', '.join(keys)} with a number") from None
    if "mass" not in sizes:
        raise InputError(f"--module {text}: has no mass; expected mass_kg=NUMBER, such as mass_kg=0.015")
    return Module(**sizes)


def known_plant(text: str) -> Plant:
    """Return the plant of that name; raises `InputError` where there is none."""
    for plant in PLANTS:
        if plant == text:
            return plant
    raise InputError(f"--plant {text}: unknown; expected one of {', '.join(PLANTS)}")


def rig_of(model: Path | None, plant: Plant) -> Rig | None:
    """Return the rig of ``--model`` for a run-down, None for other plants; raises `InputError` where it has none."""
    if plant != "spin_down":
        return None
    rig = None if model is None else read_model(model).rig
    if rig is None:
        raise InputError("--plant spin_down: needs a rig; expected --model with [rig] (Izz_kg_m2, viscous_N_m_s)")
    return rig


def parse_sizes(text: str, option: str) -> dict[str, float]:
    """Return the numbers of NAME=NUMBER,NAME=NUMBER; raises `InputError` for what is none, and for a name twice."""
    sizes: dict[str, float] = {}
    for item in filter(None, text.split(",")):
        name, _, value = (part.strip() for part in item.partition("="))
        if name in sizes:
            raise InputError(f"{option} {text}: '{name}' stands there twice; expected each name once")
        try:
            sizes[name] = float(value)
        except ValueError:
            raise InputError(f"{option} {text}: '{item}' is no NAME=NUMBER; expected NAME=NUMBER,...") from None
    return sizes


def parse_vector(text: str, option: str, unit: str, largest: float) -> FloatArray:
    """Return three numbers separated by commas, (3,); refuses what is larger than ``largest`` as a wrong unit."""
    try:
        values = [float(item) for item in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 3:
        raise InputError(f"{option} {text}: expected three numbers separated by commas, in {unit}")
    if not all(abs(value) <= largest for value in values):  # NaN is no more than anything
        raise InputError(
            f"{option} {text}: expected at most {largest:g} {unit} along each axis (are these millimetres?)"
        )
    return readonly(values)
