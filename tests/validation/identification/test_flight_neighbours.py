"""Neighbours of a flight part from it as flights of their own do."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.effects.catalogue import CATALOGUE
from discsim.parameters import flight_parameters, tables
from discsim.shipped import load_disc
from discsim.validation.identification.dynamics import ROW
from discsim.validation.identification.plants.flight import flight_segments
from discsim.validation.identification.propagation import place_in_flat

#: the numbers of a row that an instrument shows: acceleration, attitude, rates; and place and velocity
SHOWN = {"a": slice(6, 9), "q": slice(9, 13), "w": slice(13, 16), "dw": slice(16, 19)}
TIMES, LAST = np.linspace(0.3, 0.86, 281), 248


def flown(disc_name: str, changes, state, spin: float = 75.0):
    """Return rows (c, m, 19) and ends (c, 13) of neighbours: as such, and each flown by itself."""
    disc, environment = load_disc(disc_name)
    state = state.copy()
    state[12] = spin
    flat = np.array(flight_parameters(disc, environment))
    flat[place_in_flat("event.impulse", "t_s")] = 0.5
    flats, states = np.repeat(flat[None], 1 + len(changes), axis=0), np.repeat(state[None], 1 + len(changes), axis=0)
    for row, (where, size) in enumerate(changes, 1):
        if isinstance(where, tuple):
            flats[row, place_in_flat(*where)] += size
        else:
            states[row, where] += size
    states[:, 6:10] /= np.linalg.norm(states[:, 6:10], axis=1)[:, None]
    out = np.sort(np.random.default_rng(1).uniform(TIMES[0], TIMES[-1], 90))
    together = np.empty((len(states), out.size, ROW)), np.empty(states.shape)
    flight_segments(flats, tables(disc), states, TIMES, LAST, out, *together)
    alone = np.empty_like(together[0]), np.empty_like(together[1])
    for c in range(len(states)):
        one = slice(c, c + 1)
        flight_segments(flats[one], tables(disc), states[one], TIMES, LAST, out, alone[0][one], alone[1][one])
    return together, alone


def released(wobble: float = 2.0):
    q = np.array([0.97, 0.05, 0.12, 0.2])
    return np.concatenate([[3.0, -1.0, -2.0], [20.0, 4.0, -1.5], q / np.linalg.norm(q), [wobble, -0.4, 75.0]])


CHANGES = [
    *((place, 1e-3) for place in range(3, 6)),
    *((place, 1e-5) for place in range(7, 10)),
    (10, 1e-4),
    (11, 1e-4),
    (12, 1e-4),
    (("aero", "CMa"), 1e-4),
    (("aero", "CLa"), 1e-3),
    (("aero", "CRr"), 1e-5),
    (("aero.spin_side_force", "CYr"), 1e-4),
    (("air.wind", "w_north_m_s"), 1e-3),
    (("air.ground_effect", "k"), 1e-2),
    (("event.impulse", "dv_north_m_s"), 1e-3),
    (("body.mass_imbalance", "ex_m"), 1e-6),
]


@pytest.mark.parametrize("disc", ["driver", "ultrastar", "cd1"])
@pytest.mark.parametrize("spin", [75.0, -40.0, 120.0])
def test_neighbours_part_from_a_flight_as_flights_of_their_own(disc, spin):
    """To some hundredths at each instant and to some thousandths at the end, of how far they have parted.

    The slopes of a table jump at its corners: there neighbours part as much as a tenth otherwise.
    """
    at_each, at_end = (0.12, 0.08) if disc == "cd1" else (0.08, 0.01)
    (rows, ends), (alone, ends_alone) = flown(disc, CHANGES, released(), spin)
    np.testing.assert_array_equal(rows[0], alone[0])
    np.testing.assert_array_equal(ends[0], ends_alone[0])
    for c, change in enumerate(CHANGES, 1):
        for name, some in SHOWN.items():
            parted, truly = rows[c][:, some] - rows[0][:, some], alone[c][:, some] - alone[0][:, some]
            assert np.linalg.norm(parted - truly) <= at_each * np.linalg.norm(truly), (change, name)
        parted, truly = ends[c] - ends[0], ends_alone[c] - ends_alone[0]
        scale = np.repeat([1e-3, 1e-3, 1e-5, 1e-4], [3, 3, 4, 3])
        assert np.linalg.norm((parted - truly) / scale) <= at_end * np.linalg.norm(truly / scale), change


def test_neighbours_of_a_body_that_hardly_turns_are_flown_as_it_is():
    (rows, ends), (alone, ends_alone) = flown("driver", CHANGES[:6], released(), spin=4.0)
    np.testing.assert_array_equal(rows, alone)
    np.testing.assert_array_equal(ends, ends_alone)


def test_a_law_and_tables_reach_the_neighbours():
    """Effects that a baseline has none of act in the row of flats alone that has them."""
    keys = [(row.id, name) for row in CATALOGUE.values() if row.id.startswith("aero.") for name in row.parameters]
    changes = [(key, 1e-3) for key in keys if key[1] not in ("alpha_stall_rad",)]
    (rows, _), (alone, _) = flown("driver", changes, released())
    for c, change in enumerate(changes, 1):
        parted, truly = (
            rows[c][:, SHOWN["dw"]] - rows[0][:, SHOWN["dw"]],
            alone[c][:, SHOWN["dw"]] - alone[0][:, SHOWN["dw"]],
        )
        assert np.linalg.norm(parted - truly) <= 0.08 * np.linalg.norm(truly), change


@pytest.mark.parametrize("spin", [56.0, -31.0])
def test_steps_end_on_the_corners_of_a_table(spin):
    """Whatever the steps: across corners they left up to some mrad/s, as loud as a good gyroscope's noise."""
    disc, environment = load_disc("cd1")
    assert disc.aero_table is not None
    state = released(wobble=2.5)
    state[12] = spin
    flats, states = np.array(flight_parameters(disc, environment))[None], state[None]
    out = np.linspace(0.0, 0.5, 101)
    flights = []
    for count in (51, 5001):
        rows, ends = np.empty((1, out.size, ROW)), np.empty((1, 13))
        flight_segments(flats, tables(disc), states, np.linspace(0.0, 0.5, count), count - 1, out, rows, ends)
        np.testing.assert_allclose(ends[0, 10:13], rows[0, -1, SHOWN["w"]], atol=1e-9)
        flights.append(rows[0])
    coarse, fine = flights
    np.testing.assert_allclose(coarse[:, SHOWN["w"]], fine[:, SHOWN["w"]], atol=1e-5)
