"""The record of a row's parameters stays what it is, whatever compiled code writes elsewhere meanwhile."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled
from discsim.parameters import flight_parameters
from discsim.shipped import load_disc
from discsim.validation.identification.dynamics import SIZE, physics_of


@compiled
def mass_among_other_arrays(flats: FloatArray) -> tuple[float, float]:
    """Return a row's mass after arrays of its size were made and filled, and a number of theirs."""
    p = physics_of(flats[0])
    one, two = np.full(SIZE, -7.0), np.full(SIZE, -8.0)
    return p.disc.mass, one[0] + two[0]


def test_a_record_is_not_written_over():
    disc, environment = load_disc("driver")
    flats = np.array(flight_parameters(disc, environment))[None]
    assert mass_among_other_arrays(flats) == (disc.mass, -15.0)
