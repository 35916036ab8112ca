"""A free spin whose wobble a fit has left beside its optimum is begun anew by itself, and no other is touched."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from support.made import MODULE

from discsim.disc import Disc, Release
from discsim.effects.catalogue import effect
from discsim.engine import fly
from discsim.environment import Environment
from discsim.recording import Plant, Recording
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc
from discsim.validation.diagnosis.candidates.begun_anew import begun_anew
from discsim.validation.diagnosis.first_trajectory import begun_again_in_true_time, first_trajectory
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.identification.competing_effects import Competing
from discsim.validation.identification.gauss_newton import Fit, refit
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants.free_spin import FREE_SPIN

BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)
#: velocities north and east, m/s, roll and pitch, rad, and spin, rad/s, of three throws that wobble by 2 rad/s
THROWS = ((-15.9, -18.5, 0.12, 0.02, 69.0), (19.5, -5.6, -0.08, 0.17, 73.8), (-12.2, 19.9, -0.06, -0.16, 62.4))
#: how the wobble of one of them turned where a fit of all had ended beside its optimum
BESIDE = {"turn_1_s": -5.0, "turn_1_s2": 43.0, "along_1_s": 4.8, "along_1_s2": -38.0, "turn_1_s3": -36.0}


def recorded(disc: Disc, field: Environment, module: Instruments, plant: Plant, stated: Disc) -> list[Recording]:
    """The three throws of a disc as a module measures them, in recordings that state a disc."""
    found = []
    for k, (north, east, roll, pitch, spin) in enumerate(THROWS):
        release = Release(
            np.array([0.0, 0.0, -1.3]), np.array([north, east, -4.0]), roll, pitch, np.arctan2(east, north),
            np.array([0.3, 0.3, spin]),
        )  # fmt: skip
        motion, rng = fly(disc, field, release, duration=2.0), np.random.default_rng(k)
        found.append(record(motion, module, rng, plant=plant, name=f"{k + 1:02d}", disc=stated))
    return found


@cache
def settled() -> tuple[Fit, Fit]:
    """The relaxed fit of three free spins of a disc with tables, and the fit with continuous segments."""
    disc, field = load_disc("cd1")
    bare = replace(disc, aero=None, aero_table=None, yaw_damping_table=None, sigma={})
    spins = recorded(disc, field, BLIND, "free_spin", bare)
    first = relaxed(spins)
    own = unknowns(spins)
    fit = Fit(first.trajectories, own, np.zeros(len(own)), first.continuous_defects, first.noise)
    return first, begun_anew(refit(fit, iterations=FREE_SPIN.base_steps), first.trajectories)


def beside(fit: Fit, recording: int) -> Fit:
    """The fit with the wobble of one recording where it turns too fast at first and too slowly later."""
    at = [
        BESIDE.get(q.name, v) if q.acts_in(recording) else v
        for q, v in zip(fit.parameters, fit.at.tolist(), strict=True)
    ]
    return refit(replace(fit, at=np.array(at)), iterations=1)


@pytest.mark.slow
def test_a_wobble_beside_its_optimum_is_brought_there_and_no_other_is_moved():
    first, fit = settled()
    stuck = beside(fit, 1)
    assert stuck.merit > fit.merit + 1000.0
    found = begun_anew(stuck, first.trajectories)
    assert abs(found.merit - fit.merit) < 0.01 * fit.merit
    for q, v, was in zip(found.parameters, found.at, fit.at, strict=True):
        if not q.acts_in(1):
            assert abs(v - was) < 0.5 * q.sigma, q.name


def test_a_fit_at_its_optimum_is_returned_as_it_is():
    first, fit = settled()
    assert begun_anew(fit, first.trajectories) is fit
    assert_array_equal(begun_anew(fit, first.trajectories).at, fit.at)


def test_a_recording_of_which_another_fit_leaves_as_much_is_not_begun_anew():
    first, fit = settled()
    stuck = beside(fit, 1)
    assert begun_anew(stuck, first.trajectories, stuck.linears) is stuck


def test_a_motion_that_readings_tell_is_not_begun_anew():
    first, fit = settled()
    alone = replace(fit, trajectories=fit.trajectories[:1], linears=fit.linears[:1])
    assert begun_anew(alone, first.trajectories) is alone


def flights(ratio: float) -> tuple[Fit, Fit]:
    """The relaxed fit of three flights whose magnetometer's clock is wrong, and the fit that knows it."""
    disc, field = load_disc("cd1")
    module = MODULE.with_effects([effect("mag.clock_rate", ratio=ratio)])
    throws = recorded(disc, field, module, "flight", disc)
    first = relaxed(throws)
    clock = Parameter("mag.clock_rate", "ratio", 1.0, 1e-6, 0.03)
    fit = Fit(first.trajectories, (clock,), np.array([ratio]), first.continuous_defects, first.noise)
    return first, refit(fit, iterations=12)


@pytest.mark.slow
def test_a_flight_begun_in_the_time_of_a_wrong_clock_is_brought_to_its_data():
    """Its spin is at half of what it is for a while: so a start may end that knows nothing of a clock 2 % slow."""
    first, fit = flights(0.98)
    states = first.trajectories[1].states.copy()
    states[2:, -1] *= 0.5
    astray = replace(first.trajectories[1], states=states)
    begun = (first.trajectories[0], astray, first.trajectories[2])
    stuck = refit(replace(fit, trajectories=(fit.trajectories[0], astray, fit.trajectories[2])), iterations=1)
    assert stuck.merit > 10.0 * fit.merit
    found = begun_anew(stuck, begun)
    assert found.merit < 1.01 * fit.merit


@pytest.mark.slow
def test_a_flight_that_is_begun_in_true_time_keeps_what_was_found_of_its_readings():
    """Those that were left out, which effects compete, and samples that were lost."""
    one = flights(0.98)[0].trajectories[0]
    kept = tuple(readings for readings in one.readings if readings.sensor != "gyroscope")
    competing = Competing()
    known = replace(one, readings=kept, effects=competing, lost={"accelerometer": np.ones(3)})
    again = begun_again_in_true_time(known, 0.98)
    assert again.readings is known.readings
    assert again.effects is competing
    assert again.lost is known.lost
    assert_array_equal(again.nodes, first_trajectory(one.recording).nodes / 0.98)
