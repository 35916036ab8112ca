"""The registry of plants: each is one file of this folder and one name here."""

from __future__ import annotations

from discsim.recording import Recording
from discsim.validation.identification.plants.flight import FLIGHT
from discsim.validation.identification.plants.free_spin import FREE_SPIN
from discsim.validation.identification.plants.plant import Plant
from discsim.validation.identification.plants.rate_table import RATE_TABLE
from discsim.validation.identification.plants.spin_down import SPIN_DOWN

__all__ = ["PLANTS", "Plant", "plant_of"]

PLANTS: dict[str, Plant] = {plant.name: plant for plant in (FLIGHT, FREE_SPIN, SPIN_DOWN, RATE_TABLE)}


def plant_of(recording: Recording) -> Plant:
    """Return the plant of a recording."""
    return PLANTS[recording.plant]
