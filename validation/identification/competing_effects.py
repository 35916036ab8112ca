"""The effects that compete in a diagnosis: the catalogue's, and the user's own for as long as one call lasts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from types import MappingProxyType

from discsim.effects.catalogue import CATALOGUE, Effect, Row, effect
from discsim.effects.own import UserEffect

__all__ = ["applied_on", "competing", "row_of", "rows", "user_effect"]

#: rows of the catalogue that engines and sensors do not know by name
_CALLED = tuple(effect(row.id) for row in CATALOGUE.values() if row.apply is not None)
_NONE: Mapping[str, UserEffect] = MappingProxyType({})
#: a context's own, so that diagnoses side by side do not see one another's; threads take it over in `fitting.mapped`
_OWN: ContextVar[Mapping[str, UserEffect]] = ContextVar("user_effects", default=_NONE)


@contextmanager
def competing(effects: Sequence[UserEffect]) -> Iterator[None]:
    """Let effects of the user's own compete within the block."""
    token = _OWN.set(MappingProxyType({effect.id: effect for effect in effects}))
    try:
        yield
    finally:
        _OWN.reset(token)


def row_of(id: str) -> Row | None:
    """Return the row of an effect that competes, None for any other name."""
    if id in CATALOGUE:
        return CATALOGUE[id]
    own = _OWN.get().get(id)
    return None if own is None else own.row


def rows() -> tuple[Row, ...]:
    """Return the rows of all effects that compete, the catalogue's first."""
    return (*CATALOGUE.values(), *(effect.row for effect in _OWN.get().values()))


def user_effect(id: str) -> UserEffect | None:
    """Return an effect of the user's own by its id, None for any other name."""
    return _OWN.get().get(id)


def applied_on(target: str) -> tuple[Effect, ...]:
    """Return the effects on a sensor or on "motion" that are called by their row, at their baseline, as they act."""
    return (
        *(one for one in _CALLED if one.row.acts_on == target),
        *(own.sized({}) for own in _OWN.get().values() if own.row.acts_on == target),
    )
