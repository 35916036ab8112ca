"""What is concealed in a case: effects of the catalogue, or physics that is in none."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from discsim.effects.catalogue import Effect, row
from discsim.errors import InputError
from discsim.validation.challenge.cases.case import Case, Concealed
from discsim.validation.challenge.cases.conceal import run_time
from discsim.validation.challenge.cases.off_catalogue import OFF_CATALOGUE, OffCatalogue
from discsim.validation.challenge.cases.setups import draw_fault, possible_faults
from discsim.validation.challenge.cases.sizes import (
    LATEST,
    ON_REQUEST,
    conceivable,
    draw_effect,
    earlier,
    ordinary,
)

__all__ = ["can_act", "choose", "choose_secret", "hide", "possible"]


def hide(case: Case, effects: Sequence[str], rng: np.random.Generator) -> Case:
    """Choose and size what is concealed: ``effects`` where given.

    Raises `InputError` where they cannot act on the plant, or not both at once.
    """
    if case.kind == "off_catalogue":
        return replace(case, secret=choose_secret(case, rng, *effects))
    if case.kind not in ("one", "two", "setup"):
        return case
    for number, id in enumerate(effects):
        if case.plant not in row(id).plants:
            raise InputError(f"{id}: acts on {', '.join(row(id).plants)}; this is a {case.plant}")
        for other in effects[:number]:
            if not _goes_with(id, other):
                raise InputError(f"{id} and {other}: cannot be told apart in one answer; expected another pair")
    if case.kind == "setup":
        return replace(case, concealed=_faulty_setup(case, effects, rng))
    concealed: list[Concealed] = []
    for number in range(max(len(effects), 2 if case.kind == "two" else 1)):
        asked = effects[number] if number < len(effects) else None
        concealed.append(choose(case, rng, concealed, asked))
    return replace(case, concealed=tuple(concealed))


def _faulty_setup(case: Case, effects: Sequence[str], rng: np.random.Generator) -> tuple[Concealed, ...]:
    """Draw one fault of the setup, and beside it one physical effect of ordinary size in half of the cases.

    With ``effects`` these alone. Raises `InputError` where a fault cannot act, or cannot show, in the case.
    """
    faults = [id for id in effects if row(id).setup]
    if len(faults) > 1:
        raise InputError(f"{' and '.join(faults)}: expected one fault of the setup in a case")
    there = possible_faults(case)
    id = faults[0] if faults else str(rng.choice([id for id in there if id not in ON_REQUEST]))
    if id not in there:
        raise InputError(f"{id}: does not show on a {case.plant} with {', '.join(case.instruments.sensors)}")
    fault = Concealed(draw_fault(id, case, rng))
    physical = [other for other in effects if other != id]
    if not physical and (effects or rng.random() < 0.5):
        return (fault,)
    beside = choose(case, rng, [fault], *physical)
    while not ordinary(beside.effect, case.plant):
        beside = choose(case, rng, [fault], beside.effect.id)
    return fault, beside


def _place_known(id: str, case: Case) -> bool:
    """Tell whether the place is stated at which a gyroscope feels what it takes for a rate: the accelerometer's chip's.

    Where it is not, that grows with the square of the rate by any factor, and no fit tells the sensitivity.
    """
    return id != "gyro.g_sensitivity" or "accelerometer" in case.instruments.sensors


def choose(
    case: Case, rng: np.random.Generator, beside: Sequence[Concealed], id: str | None = None, *, largest: bool = False
) -> Concealed:
    """Draw one effect that goes with those ``beside`` it (or take the one of ``id``), its size or its ``largest``."""
    if id is None:
        others = [item.effect.id for item in beside]
        there = [id for id in possible(case) if id not in ON_REQUEST]
        fit = [id for id in there if all(_goes_with(id, other) for other in others)]
        while id is None or not _place_known(id, case):
            id = str(rng.choice(fit))
    only = int(rng.integers(len(case.runs))) if row(id).event else None
    drawn = draw_effect(id, case.plant, rng, case.recorded, largest=largest)
    return Concealed(drawn if only is None else _in_its_run(drawn, case, only), only)


def _in_its_run(event: Effect, case: Case, number: int) -> Effect:
    """Return an event as late in a run as it is drawn in an ordinary one, where it would come when that is over."""
    lasts = run_time(case, number)
    late = event.sizes["t_s"] > LATEST * lasts
    return earlier(event, lasts / case.recorded) if late else event


def choose_secret(case: Case, rng: np.random.Generator, name: str | None = None) -> OffCatalogue:
    """Draw physics of no catalogue that can act on the case (of a ``name`` where given)."""
    sensors = tuple(case.instruments.sensors)
    names = [name for name, kind in OFF_CATALOGUE.items() if case.plant in kind.plants and _present(name, sensors)]
    name = name or str(rng.choice(names))
    if name not in names:
        raise InputError(f"{name}: cannot act on a {case.plant}; expected one of {', '.join(names)}")
    secret = OFF_CATALOGUE[name].drawn(case.plant, rng)
    while not _on_board(secret, sensors):
        secret = OFF_CATALOGUE[name].drawn(case.plant, rng)
    return secret


def can_act(secret: OffCatalogue, case: Case) -> bool:
    """Tell whether the sensor that a secret acts on, if any, is on board."""
    sensors = tuple(case.instruments.sensors)
    name = next(name for name, kind in OFF_CATALOGUE.items() if isinstance(secret, kind))
    return _present(name, sensors) and _on_board(secret, sensors)


def possible(case: Case) -> list[str]:
    """Return the ids of the catalogue that can act, and show, in a case."""
    ids = conceivable(case.plant, tuple(case.instruments.sensors))
    accelerometer = case.instruments.sensors.get("accelerometer")
    if accelerometer is not None and accelerometer.range < 100.0:  # type: ignore[union-attr]
        ids.remove("accel.saturation")  # it clips by its sheet before it could by a fault
    return ids


def _present(name: str, sensors: tuple[str, ...]) -> bool:
    needed = {
        "rotating_magnet": ("magnetometer",),
        "mains_field": ("magnetometer",),
        "sensor_hysteresis": ("accelerometer",),
    }
    if name == "warming":
        return "accelerometer" in sensors or "gyroscope" in sensors
    return all(sensor in sensors for sensor in needed.get(name, ()))


def _on_board(secret: OffCatalogue, sensors: tuple[str, ...]) -> bool:
    """Tell whether the sensor that was drawn for a secret, if any was, is on board."""
    return getattr(secret, "sensor", sensors[0]) in sensors


def _goes_with(id: str, other: str) -> bool:
    """Tell whether two effects can be told apart when both are there, and have no parameter's name in common."""
    a, b = row(id), row(other)
    if id == other or set(a.parameters) & set(b.parameters) or (a.event and b.event):
        return False
    if other in _ALIKE.get(id, ()) or id in _ALIKE.get(other, ()):
        return False
    clocks = [item for item in (id, other) if "clock" in item or item.endswith(_LATE)]
    return len(clocks) < 2


_LATE = ("lag", "latency", "dropped_samples", "time_offset")
#: fault of the setup -> effects that are nearly the same thing in some recordings
_ALIKE: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "board.rotation": ("accel.position_offset", "accel.cross_axis", "rig.axis_tilt"),
        "site.field": ("mag.hard_iron", "mag.soft_iron", "mag.stray_field"),
    }
)
