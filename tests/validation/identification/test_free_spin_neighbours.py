"""Neighbours of a free spin part from it as free spins of their own do."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.parameters import flight_parameters
from discsim.shipped import load_disc
from discsim.validation.identification.dynamics import ROW
from discsim.validation.identification.plants.free_spin_motion import free_spin_segments
from discsim.validation.identification.propagation import place_in_flat

#: the numbers of a row that an instrument shows, and how far of their parting they may be off
SHOWN = {"q": (slice(9, 13), 0.01), "w": (slice(13, 16), 0.01), "dw": (slice(16, 19), 0.03)}
#: how the wobble dies and turns, and what it does to the spin
WOBBLE = np.array([1.5, -0.5, -4.0, 1.0, 0.5, 0.2, -0.3, 0.1, 0.2, 0.3, 0.8, -1.5, -0.4, 1.0])
#: differences in each number of a state
SIZES = [1e-2, 1e-2, 1e-2, 1e-2, 1e-4, 1e-4, 0.0, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4, 1e-3, 3e-3, 3e-3, 1e-2, 1e-2]


def neighbours(spin: float, kick_s: float | None = None):
    """Return flats, wobbles and states of a spin and its neighbours: in each number of its state and of its wobble."""
    disc, environment = load_disc("ultrastar")
    state = np.array([3.0, -2, 20, -10, -0.1, 0.01, 0.93, 0.1, 0.05, 0.34, 4.0, -2.0, spin, 0.3, 0.02, 0.05, 2.0, -1.5])
    size = state.size
    count = 1 + size + WOBBLE.size
    states, wobbles = np.repeat(state[None], count, axis=0), np.repeat(WOBBLE[None], count, axis=0)
    states[1 : 1 + size] += np.diag(SIZES)
    wobbles[1 + size :] += 1e-3 * np.eye(WOBBLE.size)
    states[:, 6:10] /= np.linalg.norm(states[:, 6:10], axis=1)[:, None]
    flats = np.repeat(np.array(flight_parameters(disc, environment))[None], count, axis=0)
    if kick_s is not None:
        flats[:, place_in_flat("event.spin_step", "t_s")] = kick_s
        flats[3, place_in_flat("event.spin_step", "dr_rad_s")] = 0.1
    return flats, wobbles, states


def spun(flats, wobbles, states, spin: float, finer: int = 1):
    """Return rows and ends of states that are run together."""
    steps = finer * int(np.ceil(0.2 * 2.0 * abs(spin) / 0.22))
    times, out = np.linspace(0.3, 0.5, steps + 1), np.sort(np.random.default_rng(1).uniform(0.3, 0.5, 60))
    rows, ends = np.empty((len(states), out.size, ROW)), np.empty(states.shape)
    free_spin_segments(flats, wobbles, states, times, times.size - 1, out, rows, ends)
    return rows, ends


def alone(flats, wobbles, states, spin: float, finer: int = 1):
    """Return the same of each run by itself."""
    each = [spun(*(part[c : c + 1] for part in (flats, wobbles, states)), spin, finer) for c in range(len(states))]
    return np.concatenate([rows for rows, _ in each]), np.concatenate([ends for _, ends in each])


@pytest.mark.parametrize("spin", [60.0, -35.0, 110.0])
def test_neighbours_part_from_a_spin_as_spins_of_their_own(spin):
    (rows, ends), (truly, true_ends) = (run(*neighbours(spin), spin) for run in (spun, alone))
    np.testing.assert_array_equal(rows[0], truly[0])
    np.testing.assert_array_equal(ends[0], true_ends[0])
    scale = np.array([1.0] * 4 + [1e-2] * 2 + [1e-3] * 4 + [1e-2] * 3 + [1e-1] * 3 + [1.0] * 2)
    for c in [c for c in range(1, len(rows)) if c != 7]:
        for name, (some, bar) in SHOWN.items():
            parted, wanted = rows[c][:, some] - rows[0][:, some], truly[c][:, some] - truly[0][:, some]
            assert np.linalg.norm(parted - wanted) <= bar * np.linalg.norm(wanted) + 1e-12, (c, name)
        parted, wanted = (ends[c] - ends[0]) / scale, (true_ends[c] - true_ends[0]) / scale
        assert np.linalg.norm(parted - wanted) <= 0.01 * np.linalg.norm(wanted), c


def test_neighbours_of_a_kick_are_run_as_the_spin_itself():
    together, by_themselves = (run(*neighbours(60.0, kick_s=0.4), 60.0) for run in (spun, alone))
    for some, wanted in zip(together, by_themselves, strict=True):
        np.testing.assert_array_equal(some, wanted)


@pytest.mark.parametrize("spin", [60.0, 110.0])
def test_nutation_costs_no_accuracy(spin):
    """Rates are good to 2e-6 rad/s of a wobble of 4.5, where plain steps of the same length are off by 3e-5."""
    case = tuple(part[:1] for part in neighbours(spin))
    (rows, ends), (fine, fine_ends) = spun(*case, spin), spun(*case, spin, finer=8)
    assert np.max(np.abs(ends[0, 10:13] - fine_ends[0, 10:13])) < 2e-6
    assert np.max(np.abs(rows[0, :, 13:16] - fine[0, :, 13:16])) < 5e-6
    assert np.max(np.abs(ends[0, 6:10] - fine_ends[0, 6:10])) < 1e-7


def test_the_air_s_moment_turns_each_axis_by_its_own_inertia():
    """With one rate for both axes dIyy of a free spin came out seven to nineteen times too large."""
    flats, wobbles, states = (part[:1] for part in neighbours(60.0))
    disc, _ = load_disc("ultrastar")
    moments = []
    for dIyy in (0.0, 0.1 * disc.Ixx):
        flats[:, place_in_flat("body.inertia_asymmetry", "dIyy_kg_m2")] = dIyy
        rows, ends = np.empty((1, 1, ROW)), np.empty(states.shape)
        times = np.linspace(0.3, 0.31, 20)
        free_spin_segments(flats, wobbles, states, times, times.size - 1, times[:1], rows, ends)
        w, dw = rows[0, 0, 13:16], rows[0, 0, 16:19]
        inertia = np.array([disc.Ixx, disc.Ixx + dIyy, disc.Izz])
        moments.append(inertia * dw + np.cross(w, inertia * w))
    assert np.linalg.norm(moments[0][:2]) > 1e-3
    np.testing.assert_allclose(moments[1][:2], moments[0][:2], rtol=1e-9)
