"""The catalogue: one row per effect that a baseline leaves out.

Engines, sensors, model files, documentation and diagnosis all know the effects through these rows: a new row is a new
term, a new hypothesis and a new line of the docs. Forms and parameters are those of docs/physics.md.
"""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from discsim.effects import setup
from discsim.effects.kind import Row
from discsim.effects.motion_rows import MOTION_ROWS
from discsim.effects.sensor_rows import SENSOR_ROWS
from discsim.effects.setup_rows import SETUP_ROWS
from discsim.errors import InputError

if TYPE_CHECKING:
    from discsim.effects.own import UserEffect

__all__ = ["CATALOGUE", "Effect", "Row", "effect", "row"]

CATALOGUE: Mapping[str, Row] = MappingProxyType({row.id: row for row in (*MOTION_ROWS, *SENSOR_ROWS, *SETUP_ROWS)})


def row(id: str) -> Row:
    """Return the row of an effect; raises `InputError` naming the nearest ids."""
    if id not in CATALOGUE:
        near = difflib.get_close_matches(id, CATALOGUE, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        raise InputError(f"unknown effect '{id}'{hint} (expected one of {', '.join(CATALOGUE)})")
    return CATALOGUE[id]


@dataclass(frozen=True)
class Effect:
    """An effect with its size: an id of the catalogue and a value of that row's type; or one of the user's ``own``."""

    id: str
    value: Any
    own: UserEffect | None = None

    @property
    def row(self) -> Row:
        """What the catalogue, or the user's file, says of it."""
        return row(self.id) if self.own is None else self.own.row

    @property
    def sizes(self) -> dict[str, float]:
        """Its parameters, by name."""
        return {name: getattr(self.value, name) for name in self.row.parameters}

    @property
    def setting(self) -> dict[str, str]:
        """Its settings, by name; empty for most effects."""
        return {name: getattr(self.value, name) for name in self.row.settings}

    def __post_init__(self) -> None:
        kind = self.row
        if type(self.value) is not kind.type:
            raise InputError(f"{self.id}: got {type(self.value).__name__}, expected {kind.type.__name__}")
        try:
            object.__setattr__(self, "value", setup.checked(self.value))
        except InputError as error:
            raise InputError(f"{self.id}: {error}") from None
        for name, size in self.sizes.items():
            if not isfinite(size) and size != kind.sizes[name]:
                raise InputError(f"{self.id}: {name} is not finite ({size}); expected a finite number")
            if name in kind.positive and size <= 0:
                raise InputError(f"{self.id}: {name} is {size:g}; expected a number above zero")


def effect(id: str, **given: float | str) -> Effect:
    """Return an effect by id, parameters and settings; those left out stay at the baseline.

    >>> effect("air.wind", w_north_m_s=1.1).value
    Wind(w_north_m_s=1.1, w_east_m_s=0.0)
    >>> effect("mag.axes", axes="x -y z").value
    Axes(axes='x -y z')
    """
    kind = row(id)
    for name, value in given.items():
        if name not in (*kind.parameters, *kind.settings):
            what = "parameter" if kind.parameters else "setting"
            raise InputError(f"{id}: unknown {what} '{name}'; expected {', '.join((*kind.parameters, *kind.settings))}")
        if isinstance(value, str) != (name in kind.settings):
            expected = "a text" if name in kind.settings else "a number"
            raise InputError(f"{id}: {name} is {value!r}, expected {expected}")
    return Effect(
        id, kind.type(**{name: value if isinstance(value, str) else float(value) for name, value in given.items()})
    )


def by_id(effects: Sequence[Effect]) -> dict[str, Any]:
    """Return the values by id; raises `InputError` where one id appears twice."""
    values: dict[str, Any] = {}
    for item in effects:
        if item.id in values:
            raise InputError(f"effect '{item.id}' is given twice; expected each at most once in one recording")
        values[item.id] = item.value
    return values
