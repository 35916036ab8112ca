"""What the compiled motions of all plants share: rows of motion, rows of parameters, laws and effects of a user's own.

A row of motion holds 19 numbers: position, velocity and acceleration in N, attitude (quaternion from B to N), body
rates and their derivatives in B. A row of parameters ("flat") holds those of the physics, then the sizes of the user's
own effects, then the terms of a law.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, inlined
from discsim.law import LAW_WIDTH, SYMBOLS
from discsim.parameters import PARAMETERS, Tables

__all__ = ["FASTEST", "LAW_PLACES", "ROW", "SIZE", "acting_tables", "physics_of"]

#: numbers of a row of motion
ROW = 19
#: a fit that has gone astray to faster spins, rad/s, is not followed with ever shorter steps
FASTEST = 400.0
#: numbers of the physics; what a row of flats holds beyond are those of the user's own effects and the terms of a law
SIZE = PARAMETERS.itemsize // 8
#: names of the numbers of a law's term: those of a row of `discsim.law`, and per symbol where its power is one
LAW_PLACES = (
    "target",
    "coefficient",
    *(f"power_{symbol}" for symbol in SYMBOLS),
    *(f"odd_{symbol}" for symbol in SYMBOLS),
    "decay",
    "order",
    "phase",
    "play",
    "swing",
    "north",
    "east",
    "size",
    *(f"at_{symbol}" for symbol in SYMBOLS),
)
_PLACES, _COUNT = len(LAW_PLACES), len(SYMBOLS)


@inlined
def physics_of(flat: FloatArray) -> Any:
    """Return the parameters of the physics that a row of flats (k,) holds, as a record.

    Compiled code frees an array after its last use, and a record does not keep the array that it lies in: of a copy it
    would soon read what something else has written there. So it lies in the row itself, which the caller keeps.
    """
    return flat[:SIZE].view(PARAMETERS)[0]


@compiled
def _law(flat: FloatArray, first: int) -> FloatArray:
    """Return the rows (terms, LAW_WIDTH) of the law that stands in a row of flats from place ``first`` on."""
    terms = (flat.size - first) // _PLACES
    rows = np.zeros((terms, LAW_WIDTH))
    for i in range(terms):
        given = flat[first + i * _PLACES : first + (i + 1) * _PLACES]
        rows[i] = given[:LAW_WIDTH]
        for k in range(_COUNT):
            if given[LAW_WIDTH + k] > 0.0:
                rows[i, 1] /= given[LAW_WIDTH + k] ** given[2 + k]
    return rows


@compiled
def acting_tables(given: Tables, flat: FloatArray) -> Tables:
    """Return tables with a law and the user's own effects as a row of flats has them."""
    own = given.own_sizes.size
    sizes = flat[SIZE : SIZE + own].copy().reshape(given.own_sizes.shape)
    return Tables(given.static, given.rate, given.speed, given.spline, _law(flat, SIZE + own), given.own_calls, sizes)
