"""Where a search begins: a relaxed fit at a wrong minimum is begun again from the baseline."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support.made import throws

from discsim.frames import multiply, turn
from discsim.recording import Recording
from discsim.sensors import Instruments
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.astray import from_other_flights
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.identification.gauss_newton import Fit, linearised, merit_of
from discsim.validation.identification.segments import Trajectory


def astray(fit: Fit) -> Fit:
    """Return a relaxed fit whose segments after the first stand half a radian about z from where they are."""

    def turned(one: Trajectory) -> Trajectory:
        states, attitude = one.states.copy(), one.plant.layout.attitude
        about_z = np.broadcast_to(turn(np.array([0.0, 0.0, 0.5])), (len(states) - 1, 4))
        states[1:, attitude] = multiply(states[1:, attitude], about_z)
        return replace(one, states=states)

    there = replace(fit, trajectories=tuple(turned(one) for one in fit.trajectories))
    there = replace(there, linears=linearised(there))
    return replace(there, merit=merit_of(there, there.linears))


def test_a_relaxed_fit_that_leaves_more_than_the_baseline_is_begun_again_from_there():
    recordings = throws([], [])
    right = relaxed(recordings)
    wrong = astray(right)
    assert wrong.merit > 3.0 * right.merit
    found = screened(SearchProblem(recordings, followed=wrong))
    assert merit_of(right, found.relaxed_fit.linears) < 1.02 * right.merit


def test_a_relaxed_fit_at_its_best_stays():
    recordings = throws([], [])
    right = relaxed(recordings)
    found = screened(SearchProblem(recordings, followed=right))
    for mine, given in zip(found.relaxed_fit.trajectories, right.trajectories, strict=True):
        np.testing.assert_array_equal(mine.states, given.states)


def read_by_a_magnetometer(seconds: float) -> list[Recording]:
    """Return two throws of which a magnetometer alone tells: nothing says how fast they flew, and which way."""
    module = Instruments.from_parts("mpu9250").without("accelerometer", "gyroscope")
    return [replace(one, release=None) for one in throws(module=module, seconds=seconds)]


def test_flights_that_a_magnetometer_alone_has_read_need_no_physics_that_is_not_there():
    """Among the flights that explain its readings about as well, those are found that explain them fully."""
    diagnosis = diagnose([read_by_a_magnetometer(4.0)], ["throws"]).diagnosis
    assert (diagnosis.verdict, diagnosis.effects) == ("consistent", ())


def test_a_flight_that_the_baseline_took_for_another_is_begun_anew():
    """Of two throws the second begins where it flew backwards: it alone changes, and leaves what it left before."""
    right = screened(SearchProblem(read_by_a_magnetometer(3.0))).base.fit
    first, second = right.trajectories
    states, velocity = second.states.copy(), second.plant.layout.velocity
    states[:, velocity] *= -1.0
    wrong = replace(right, trajectories=(first, replace(second, states=states)))
    wrong = replace(wrong, linears=linearised(wrong))
    wrong = replace(wrong, merit=merit_of(wrong, wrong.linears))
    assert wrong.merit > 3.0 * right.merit
    found = from_other_flights(wrong)
    assert found.merit < 1.02 * right.merit
    assert from_other_flights(right) is right
