"""The effects that compete in a diagnosis: the catalogue's, and the user's own that it was asked with."""

from __future__ import annotations

from dataclasses import dataclass

from discsim.effects.catalogue import CATALOGUE, Effect, Row, effect
from discsim.effects.own import UserEffect

__all__ = ["CATALOGUED", "Competing"]

#: rows of the catalogue that engines and sensors do not know by name
_CALLED = tuple(effect(row.id) for row in CATALOGUE.values() if row.apply is not None)


@dataclass(frozen=True)
class Competing:
    """The catalogue's effects and those of the user's ``own``: part of the motion that a fit supposes."""

    own: tuple[UserEffect, ...] = ()

    @property
    def rows(self) -> tuple[Row, ...]:
        """The rows of all effects, the catalogue's first."""
        return (*CATALOGUE.values(), *(effect.row for effect in self.own))

    def row(self, id: str) -> Row | None:
        """Return the row of an effect, None for any other name."""
        own = self.user_effect(id)
        return CATALOGUE.get(id) if own is None else own.row

    def user_effect(self, id: str) -> UserEffect | None:
        """Return an effect of the user's own by its id, None for any other name."""
        return next((effect for effect in self.own if effect.id == id), None)

    def called_on(self, target: str) -> tuple[Effect, ...]:
        """Return the effects on a sensor or on "motion" that are called by their row, at their baseline."""
        return (
            *(one for one in _CALLED if one.row.acts_on == target),
            *(own.sized({}) for own in self.own if own.row.acts_on == target),
        )


#: the catalogue's alone
CATALOGUED = Competing()
