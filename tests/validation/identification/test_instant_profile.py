"""The instant of an event: its error covers the truth where noise has many dips, and is the curvature's where one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import FIELD, MODULE, RIG, throws

from discsim.effects import Effect, effect
from discsim.motion import Motion
from discsim.rig import spin_down
from discsim.sensors import record
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification.gauss_newton import Fit, linearised, merit_of, refit
from discsim.validation.identification.instant_profile import instant_profile, instants_of, with_errors_of_instants
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.noise import stated_noise
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import Trajectory

STEP, WHEN = "event.spin_step", 2.03
#: a kick in 4 s of a gyroscope of 2.2 mrad/s at 250 Hz: chi-squared grows by 60 for each second beside it
SMALL, LARGE = 1.1e-3, 0.3
PARAMETERS = tuple(Parameter(STEP, name, 0.0, 1e-3, recordings=frozenset([0])) for name in ("t_s", "dr_rad_s"))


@cache
def kicked(size: float) -> Motion:
    return spin_down(RIG, FIELD, 25.0, 4.0, [effect(STEP, t_s=WHEN, dr_rad_s=size)], yaw=0.5)


def fitted(size: float, seed: int) -> Fit:
    """A run-down that was kicked, fitted from the true instant and size."""
    rng, module = np.random.default_rng(seed), MODULE.without("gps")
    recording = record(kicked(size), module, rng, plant="spin_down", name=f"run-{seed}", rig=RIG)
    return fit_of(first_trajectory(recording), size)


def fit_of(trajectory: Trajectory, size: float) -> Fit:
    at, defects = np.array([WHEN, size]), plant_of(trajectory.recording).continuous_defects([trajectory.recording])
    fit = Fit((trajectory,), PARAMETERS, at, defects, {})
    return refit(replace(fit, noise=stated_noise(linearised(fit, ()))), iterations=8)


def error_and_deviations(fit: Fit) -> tuple[float, float, float]:
    """How far the instant is off, once it is where chi-squared is least, its curvature's deviation, and its own."""
    profile = instant_profile(fit, 0)
    assert profile is not None
    fit = refit(profile.at_least(), iterations=2)
    own = with_errors_of_instants(fit)
    return float(fit.at[0]) - WHEN, float(np.sqrt(fit.covariance[0, 0])), float(np.sqrt(own.covariance[0, 0]))


@pytest.mark.slow
def test_a_small_step_lies_within_two_standard_deviations_as_often_as_it_should():
    """Of twenty about nineteen; by the curvature of the dip that a fit stands in, fourteen."""
    error, curved, own = np.array([error_and_deviations(fitted(SMALL, seed)) for seed in range(20)]).T
    assert np.count_nonzero(np.abs(error) < 2.0 * own) >= 17
    assert np.max(np.abs(error) / own) < 3.5
    # a change point scatters by the root of 26 over what chi-squared grows by per second (Yao, 1987): by 0.085 s
    assert np.sqrt(np.mean(own**2)) == pytest.approx(0.085, rel=0.3)
    assert np.count_nonzero(np.abs(error) < 2.0 * curved) < 15


def test_a_large_step_keeps_the_deviation_that_the_curvature_tells():
    fit = fitted(LARGE, 0)
    weighed = with_errors_of_instants(fit)
    np.testing.assert_allclose(np.sqrt(np.diag(weighed.covariance)), np.sqrt(np.diag(fit.covariance)), rtol=0.01)
    assert weighed.covariance[0, 1] == pytest.approx(fit.covariance[0, 1], rel=0.02, abs=0.02 * fit.covariance[1, 1])


def with_another(size: float) -> Fit:
    """Two run-downs of one rig, the first one kicked, whose friction is not known."""
    still = spin_down(RIG, FIELD, 20.0, 4.0, yaw=1.5)
    trajectories = tuple(
        first_trajectory(record(motion, MODULE, np.random.default_rng(3), plant="spin_down", name=name, rig=RIG))
        for name, motion in (("kicked", kicked(size)), ("still", still))
    )
    viscous = Parameter("rig", "viscous", RIG.viscous, 1e-8, 2e-7)
    fit = replace(fit_of(trajectories[0], size), trajectories=trajectories, parameters=(viscous, *PARAMETERS))
    return refit(replace(fit, at=np.array([RIG.viscous, WHEN, size])), iterations=8)


def test_chi_squared_at_an_instant_is_that_of_a_fit_with_the_event_there():
    fit = with_another(SMALL)
    assert list(instants_of(fit)) == [1]
    profile = instant_profile(fit, 1)
    assert profile is not None
    for k in np.linspace(0, profile.instants.size - 1, 5).astype(int):
        held = {(STEP, "t_s"): float(profile.instants[k])}
        others = (fit.parameters[0], fit.parameters[2])
        there = refit(replace(fit, parameters=others, at=fit.at[[0, 2]], fixed=held), iterations=8, tolerance=1e-3)
        assert profile.chi2[k] == pytest.approx(there.merit - fit.merit, abs=0.05)


def test_a_fit_goes_to_the_least_chi_squared_with_all_that_follows_the_instant():
    fit = with_another(SMALL)
    profile = instant_profile(fit, 1)
    assert profile is not None
    lower = replace(profile, chi2=np.where(profile.instants > fit.at[1] + 0.05, -1.0, 0.0))
    there = lower.at_least()
    assert there.at[1] == profile.instants[np.argmin(lower.chi2)] > fit.at[1] + 0.05
    expected = profile.chi2[np.argmin(lower.chi2)]
    assert merit_of(there, linearised(there)) - fit.merit == pytest.approx(expected, abs=0.05)


def test_a_push_in_a_flight_has_an_instant_too():
    """The first throw of two; what pushes it is felt for some milliseconds, so that the instant is sharp."""
    push = effect("event.impulse", t_s=0.8, dv_north_m_s=0.3, dv_east_m_s=-0.2, dv_down_m_s=0.1)
    trajectory = first_trajectory(throws([push], only=0)[0])
    fit = pushed_fit(trajectory, push)
    assert list(instants_of(fit)) == [0]
    weighed = with_errors_of_instants(fit)
    assert np.sqrt(weighed.covariance[0, 0]) == pytest.approx(np.sqrt(fit.covariance[0, 0]), rel=0.05)
    assert abs(fit.at[0] - 0.8) < 3.0 * np.sqrt(weighed.covariance[0, 0])


def pushed_fit(trajectory: Trajectory, push: Effect) -> Fit:
    values = push.value._asdict()
    parameters = tuple(Parameter(push.id, name, 0.0, 1e-3, recordings=frozenset([0])) for name in values)
    defects = plant_of(trajectory.recording).continuous_defects([trajectory.recording])
    fit = Fit((trajectory,), parameters, np.array([*values.values()]), defects, {})
    return refit(replace(fit, noise=stated_noise(linearised(fit, ()))), iterations=12)


def test_a_neighbour_with_an_event_elsewhere_parts_from_the_motion_at_both_instants():
    """That with the event gone parts where it was, that with it elsewhere there, too, segments away from it."""
    fit = fitted(LARGE, 0)
    trajectory, away = fit.trajectories[0], 1.0
    column = Column(STEP, "dr_rad_s", 1e-3, (("t_s", float(fit.at[0]) + away),))
    linear = linearise(trajectory, fit.values(0), [column], fit.defects.allowed, central=False)
    jumps = linear.transitions[:, :, -1] * column.step
    spin = trajectory.plant.layout.directions_of(trajectory.plant.layout.spin)[0]
    was, there = (int(trajectory.segment_of(np.array(t))) for t in (fit.at[0], fit.at[0] + away))
    assert there - was > 1
    assert jumps[was, spin] == pytest.approx(-LARGE, rel=0.05)
    assert jumps[there, spin] == pytest.approx(LARGE, rel=0.05)
    assert np.count_nonzero(np.abs(jumps[:, spin]) > 0.01 * LARGE) == 2


def test_an_event_that_hardly_shows_may_have_been_at_any_time_of_its_recording():
    """Of a tenth of the size chi-squared grows by 0.6 per second: it is nearly as likely at any time."""
    fit = fitted(0.1 * SMALL, 1)
    profile = instant_profile(fit, 0)
    assert profile is not None
    assert profile.instants[[0, -1]] == pytest.approx([0.0, fit.trajectories[0].nodes[-1]])
    assert 0.5 < np.sqrt(with_errors_of_instants(fit).covariance[0, 0]) < 4.0
