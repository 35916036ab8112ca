"""The catalogue: one row per effect that a baseline leaves out.

Engines, sensors, model files, documentation and diagnosis all know the effects through these rows: a new row is a new
term, a new hypothesis and a new line of the docs. Rows are the ``ROWS`` of each module of this folder whose name ends
in ``_rows``: a new effect is one such file (docs/architecture.md). docs/effects.md is made from them.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from math import isfinite
from numbers import Real
from pkgutil import iter_modules
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from discsim.effects import setup
from discsim.effects.applied import Applied, applied_row
from discsim.effects.kind import Row
from discsim.errors import InputError, require_type

if TYPE_CHECKING:
    from discsim.effects.own import UserEffect

__all__ = ["CATALOGUE", "Effect", "Row", "catalogued", "effect", "effect_of", "row"]

#: what comes first, in this order; modules of single effects follow by name
_FIRST = ("motion_rows", "sensor_rows", "mount_rows", "timing_rows", "setup_rows")


def _rows() -> Iterator[Row]:
    names = {module.name for module in iter_modules(import_module(__package__).__path__)}
    others = sorted(name for name in names if name.endswith("_rows") and name not in _FIRST)
    for name in (*_FIRST, *others):
        yield from import_module(f"{__package__}.{name}").ROWS


def _checked(rows: Sequence[Row]) -> dict[str, Row]:
    """Return rows by id; raises `ValueError` where two share an id, or a type on what it acts on."""
    by_id = {row.id: row for row in rows}
    if len(by_id) < len(rows) or len({(row.type, row.acts_on) for row in rows}) < len(rows):
        raise ValueError("two rows of the catalogue have the same id, or the same type on the same sensor")
    return by_id


CATALOGUE: Mapping[str, Row] = MappingProxyType(_checked(tuple(_rows())))
_APPLIED: Mapping[str, Applied] = MappingProxyType(
    {row.id: applied_row(row) for row in CATALOGUE.values() if row.apply is not None}
)
_BY_TYPE: Mapping[tuple[type[Any], str], Row] = MappingProxyType(
    {(row.type, row.acts_on): row for row in CATALOGUE.values()}
)


def catalogued(kind: type[Any], acts_on: str | None = None) -> Row:
    """Return the row of an effect by its type; ``acts_on`` tells the sensor where several have one like it.

    Ids are for files and people; code that speaks of one effect names its type. Raises `KeyError` where there is none.

    >>> from discsim.effects.sensors import Lag
    >>> catalogued(Lag, "gyroscope").id
    'gyro.lag'
    """
    if acts_on is not None:
        return _BY_TYPE[kind, acts_on]
    found = [row for row in CATALOGUE.values() if row.type is kind]
    if len(found) != 1:
        raise KeyError(f"{kind.__name__} is the type of {len(found)} effects; expected what it acts on beside it")
    return found[0]


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
    def applied(self) -> Applied | None:
        """What calls it where engines and sensors do not know its type: the user's own, and rows with ``apply``."""
        return _APPLIED.get(self.id) if self.own is None else self.own

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
    require_type(id, str, "an effect's id", "a text such as 'air.wind'")
    kind = row(id)
    for name, value in given.items():
        if name not in (*kind.parameters, *kind.settings):
            what = "parameter" if kind.parameters else "setting"
            raise InputError(f"{id}: unknown {what} '{name}'; expected {', '.join((*kind.parameters, *kind.settings))}")
        allowed, expected = (str, "a text") if name in kind.settings else (Real, "a number")
        if not isinstance(value, allowed):
            raise InputError(f"{id}: {name} is {value!r}, expected {expected}")
    return Effect(
        id, kind.type(**{name: value if isinstance(value, str) else float(value) for name, value in given.items()})
    )


def effect_of(value: Any, acts_on: str | None = None) -> Effect:
    """Return an effect of the catalogue with a value of its type; ``acts_on`` as for `catalogued`.

    >>> from discsim.effects.air import Density
    >>> effect_of(Density(1.1)).id
    'air.density'
    """
    return effect(catalogued(type(value), acts_on).id, **value._asdict())


def by_id(effects: Sequence[Effect]) -> dict[str, Any]:
    """Return the values by id; raises `InputError` where one id appears twice."""
    require_type(effects, Iterable, "effects", 'a list of effects: [effect("air.density", ratio=1.1)]')
    values: dict[str, Any] = {}
    for item in effects:
        require_type(item, Effect, "one of effects", 'an effect as effect("air.density", ratio=1.1) makes it')
        if item.id in values:
            raise InputError(f"effect '{item.id}' is given twice; expected each at most once in one recording")
        values[item.id] = item.value
    return values
