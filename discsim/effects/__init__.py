"""What a baseline leaves out: each effect is one small type and one function, listed in the catalogue."""

from discsim.effects.catalogue import CATALOGUE, Effect, Row, effect

__all__ = ["CATALOGUE", "Effect", "Row", "effect"]
