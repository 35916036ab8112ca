"""A disc in the air whose path nobody recorded: what its wobble, its gyroscope and its first moments may say."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import DRIVER, FIELD, MODULE, flight, release_of, rows_of, throws

from discsim.arrays import FloatArray
from discsim.disc import Release
from discsim.effects import effect
from discsim.engine import fly
from discsim.recording import Recording
from discsim.sensors import record
from discsim.shipped import load_disc
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.score_tests import hinted
from discsim.validation.diagnosis.detectors.dropped_samples import dropped_magnetometer
from discsim.validation.diagnosis.detectors.events import events
from discsim.validation.diagnosis.detectors.local_problem import local_problems
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.diagnosis.selection import refitted_out_of_balance as of_balance
from discsim.validation.diagnosis.selection import stepwise
from discsim.validation.diagnosis.selection.next_effect import joined
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, possible, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.identification.gauss_newton import (
    NO_BARS,
    Fit,
    GaussNewtonStep,
    linearised,
    linearised_columns,
    refit,
)
from discsim.validation.identification.noise import estimate_noise, stated_noise, whitened
from discsim.validation.identification.normal_equations import reduce
from discsim.validation.identification.parameters import AllowedDefects, Parameter
from discsim.validation.identification.plants import PLANTS
from discsim.validation.identification.plants.free_spin import FREE_SPIN
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.sensor_model import predicted

#: numbers of a gyroscope's and a magnetometer's module without a path
BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)


#: a throw nose down: the angle of attack goes from -5 degrees to zero in 0.3 s, over corners of a table
NOSE_DOWN = Release(
    np.array([0.0, 0.0, -1.2]), np.array([0.0, -23.7, -4.0]), 0.08, -0.28, -1.6, np.array([0.0, 0.4, -55.0])
)


def spin_of_tables(name: str, release: Release) -> Recording:
    """Return a free spin of a disc whose coefficients are tables over the angle of attack, wobbling at 2.5 rad/s."""
    disc, field = load_disc(name)
    motion = fly(disc, field, release, duration=1.2)
    bare = replace(disc, aero=None, aero_table=None, yaw_damping_table=None, sigma={})
    return record(motion, BLIND, np.random.default_rng(3), plant="free_spin", name="tables", disc=bare)


def left_by(fit: Fit) -> float:
    """Return chi-squared per reading of the gyroscope's x and y, in stated noise, of segments that are continuous."""
    own = unknowns([trajectory.recording for trajectory in fit.trajectories])
    noise = estimate_noise(fit.linears, [linear.residual for linear in fit.linears], coloured=False)
    start = {(q.key, q.recordings): float(v) for q, v in zip(fit.parameters, fit.at, strict=True)}
    fitted = continuous_fit(fit, Hypothesis(), own, noise, start, polish=0)
    linear = fitted.fit.linears[0]
    stated = {
        group: level._replace(sd=float(linear.sd[c.rows][0]), correlation=0.0)
        for group, level in noise.items()
        for c in linear.channels
        if c.group == group
    }
    white: FloatArray = whitened(linear, stated, fitted.residuals[0][:, None])[:, 0]
    turning = [white[c.rows] for c in linear.channels if c.sensor == "gyroscope" and c.axis != "z_rad_s"]
    return float(np.mean(np.concatenate(turning) ** 2))


def test_what_damps_the_rolling_turns_the_spin_where_a_disc_flies_aslant(monkeypatch):
    """Its moment is square to the wind, not to the disc: 0.008 rad/s passed for a gyroscope's cross-axis error."""
    thrown = recordings(draw_case(695244))[2]  # its wobble dies by 25 1/s, at 9 degrees nose down

    def spin_s_noise() -> float:
        fit = relaxed([thrown])
        own, noise = unknowns([thrown]), stated_noise(fit.linears)
        start = {(q.key, q.recordings): float(v) for q, v in zip(fit.parameters, fit.at, strict=True)}
        linear = continuous_fit(fit, Hypothesis(), own, noise, start, polish=0, iterations=16).fit.linears[0]
        (spin,) = (c for c in linear.channels if c.axis == "z_rad_s")
        return float(np.sqrt(np.mean((linear.residual / linear.sd)[spin.rows] ** 2)))

    assert spin_s_noise() < 1.1  # 686 readings: 1 +- 0.03
    monkeypatch.setitem(PLANTS, FREE_SPIN.name, replace(FREE_SPIN, own=without_moments_aslant()))
    assert spin_s_noise() > 1.2


def without_moments_aslant() -> tuple[Parameter, ...]:
    """Return the numbers of a wobble of which those that act on the spin stay at nothing."""
    return tuple(replace(q, sigma=1e-9) if q.name.startswith("spun_by") else q for q in FREE_SPIN.own)


@pytest.mark.slow
def test_air_that_is_stiffer_at_some_angles_of_attack_leaves_noise_alone(monkeypatch):
    release = replace(release_of(0.4, 70.0), body_rate=np.array([2.0, -1.5, 70.0]))
    assert left_by(relaxed([spin_of_tables("cd1", release)])) < 1.2  # 700 readings: 1 +- 0.05
    fit = relaxed([spin_of_tables("dd2", NOSE_DOWN)])
    assert left_by(fit) < 1.4  # what is sharper than a segment is not followed
    for places in ([12], [13, 14]):  # one course in time is not enough, nor is one bend
        held = FREE_SPIN.sizes.continuous.sd.copy()
        held[places] = 0.0
        with monkeypatch.context() as patch:
            patch.setitem(
                PLANTS,
                FREE_SPIN.name,
                replace(FREE_SPIN, sizes=replace(FREE_SPIN.sizes, continuous=AllowedDefects(held))),
            )
            assert left_by(fit) > 3.0


def test_a_gyroscope_that_feels_force_feels_all_of_it_where_the_path_is_unknown():
    motion = flight(seconds=0.5)
    faked = effect("gyro.g_sensitivity", kx=2e-3, ky=-3e-3)
    module = BLIND.with_effects([faked])
    recording = record(motion, module, np.random.default_rng(4), plant="free_spin", name="faked", disc=DRIVER)
    t, sd = recording.samples["gyroscope"].t, recording.sheets["gyroscope"].noise_rms
    values = {("gyro.g_sensitivity", "kx"): 2e-3, ("gyro.g_sensitivity", "ky"): -3e-3}
    rows = rows_of(motion, t)
    left = recording.samples["gyroscope"].value - predicted("gyroscope", recording, values, t, rows)
    # gravity and lift, 10 m/s^2 that turn with the spin, would leave seven times the noise on each axis
    assert np.std(left[:, :2], axis=0) == pytest.approx(sd, rel=0.25)


def test_a_clock_that_algebra_has_run_backwards_begins_where_the_relaxed_fit_has_it():
    """From such a start a motion grew to 1e77 rad/s, and the score of the fit was 1e156."""
    recording = record(
        flight(seconds=0.4), BLIND, np.random.default_rng(7), plant="free_spin", name="clock", disc=DRIVER
    )
    scale = Parameter("clock.rate", "ratio", 1.0, 1e-6, 5e-3)
    fit = relaxed([recording], [scale])
    own = (scale, *unknowns([recording]))
    noise = estimate_noise(fit.linears, [linear.residual for linear in fit.linears])
    at = {(q.key, q.recordings): float(v) for q, v in zip(fit.parameters, fit.at, strict=True)}
    wild = at | {(scale.key, None): -2.8e75}
    sane, begun = (continuous_fit(fit, Hypothesis(), own, noise, start, polish=0) for start in (at, wild))
    assert begun.score == sane.score
    assert begun.fit.merit < 3.0 * begun.fit.count


def test_a_wobble_of_one_recording_moves_no_other():
    recordings = [
        record(flight(seconds=0.4), BLIND, np.random.default_rng(k), plant="free_spin", name=f"{k}", disc=DRIVER)
        for k in range(2)
    ]
    fit = Fit(tuple(first_trajectory(r) for r in recordings), (), np.empty(0), FREE_SPIN.sizes.continuous, {})
    columns = [Column(*FREE_SPIN.own_keys[0], 1e-3, (("recording", float(k)),)) for k in range(2)]
    first, second = linearised_columns(fit, columns)
    assert np.any(first.common[:, 0])
    assert not np.any(first.common[:, 1])
    assert not np.any(second.common[:, 0])
    assert np.any(second.common[:, 1])


@pytest.mark.parametrize(("instant", "told"), [(0.04, False), (0.6, True)])
def test_a_knock_at_the_very_start_is_not_told_from_where_the_spin_started(instant, told):
    recording = record(
        fly(DRIVER, FIELD, release_of(0.4, 70.0), duration=0.3),
        BLIND,
        np.random.default_rng(5),
        plant="free_spin",
        name="start",
        disc=DRIVER,
    )
    q = Parameter("event.spin_step", "t_s", instant, 1e-3, recordings=frozenset([0]))
    trajectories = (first_trajectory(recording),)
    fit = Fit(trajectories, (q,), np.array([instant]), FREE_SPIN.sizes.continuous, {}, covariance=np.full((1, 1), 1e-6))
    assert possible(ContinuousFit(Hypothesis(), fit, 0.0)) is told


def test_a_recording_that_a_step_leads_astray_takes_less_of_it_and_the_other_all():
    recordings = [
        record(flight(seconds=0.4), BLIND, np.random.default_rng(k), plant="free_spin", name=f"{k}", disc=DRIVER)
        for k in range(2)
    ]
    fit = Fit(tuple(first_trajectory(r) for r in recordings), (), np.empty(0), FREE_SPIN.sizes.continuous, {})
    fit = replace(fit, noise=stated_noise(linearised(fit)))
    for _ in range(3):  # near enough that a whole step leads nearer
        fit, _ = going(fit, 1.0).with_own_fractions()
    for too_far, shortened in ((1.0, [False, False]), (1e3, [True, False])):
        taken, astray = going(fit, too_far).with_own_fractions()
        assert taken is not None
        assert astray.tolist() == shortened
        # what is not led astray goes as far as by itself
        alone, _ = going(fit, 1.0).with_own_fractions()
        np.testing.assert_array_equal(taken.trajectories[1].states, alone.trajectories[1].states)


def going(fit: Fit, too_far: float) -> GaussNewtonStep:
    """Return the next step of a fit that in the first recording goes so many times as far as it should."""
    fit = replace(fit, linears=linearised(fit))
    reduced = [
        reduce(linear, trajectory, fit.noise, fit.defects)
        for linear, trajectory in zip(fit.linears, fit.trajectories, strict=True)
    ]
    reduced[0] = replace(reduced[0], cross=too_far * reduced[0].cross)
    return GaussNewtonStep(fit, reduced, np.empty(0), {}, fit.merit)


@cache
def biased() -> Search:
    """Return where a search begins in two free spins whose gyroscope has a bias of twenty times its noise."""
    bias = effect("gyro.bias", bx_rad_s=0.05, by_rad_s=-0.02, bz_rad_s=0.02)
    return screened(SearchProblem(throws([], [bias], module=BLIND, plant="free_spin")))


def fitted_with(*ids: str) -> ContinuousFit:
    """Return the fit of effects from where the baseline of these has ended."""
    base = biased().base
    hypothesis = Hypothesis(tuple(free_candidate(id) for id in ids))
    return continuous_fit(base.fit, hypothesis, biased().own, biased().relaxed_noise, values_of_fit(base))


def test_a_fit_goes_on_from_segments_that_a_whole_step_would_part():
    """A whole step parts them for good; the fit stayed where it was then, without the effect."""
    with_bias = fitted_with("gyro.bias")
    assert biased().base.score - with_bias.score > 1000.0
    at = {q.name: v for q, v in zip(with_bias.fit.parameters, with_bias.fit.at, strict=True) if q.group == "gyro.bias"}
    assert at["bx_rad_s"] == pytest.approx(0.05, abs=2e-3)
    assert at["by_rad_s"] == pytest.approx(-0.02, abs=2e-3)
    assert at["bz_rad_s"] == pytest.approx(0.02, abs=2e-3)


def test_what_gained_only_by_where_the_fit_before_it_stood_is_named_no_more(monkeypatch):
    monkeypatch.setattr(stepwise, "rivals_of", lambda _: {})
    final = fitted_with("gyro.bias", "accel.bias")
    # steps that lead astray are refused by what they leave, as in a search
    with np.errstate(over="ignore", invalid="ignore"):
        (left,) = stepwise.settled(replace(biased(), final=final)).final.hypothesis.candidates
    assert left.id == "gyro.bias"


def test_what_stood_for_moments_fixed_in_the_body_is_named_no_more_once_they_are_free(monkeypatch):
    """In measured throws an asymmetry of inertia stayed, without which the fit was better by 250."""
    rest = iter([0.1, 1.0])
    monkeypatch.setattr(of_balance, "left_across", lambda _: next(rest))
    final = fitted_with("gyro.bias", "body.inertia_asymmetry")
    left = of_balance.refitted_out_of_balance(replace(biased(), final=final)).final
    assert all(trajectory.unbalanced for trajectory in left.fit.trajectories)
    assert [candidate.id for candidate in left.hypothesis.candidates] == ["gyro.bias"]


@pytest.mark.parametrize(("id", "near"), [("gyro.bias", True), ("mag.hard_iron", False)])
def test_far_from_the_data_a_refit_begins_with_segments_that_are_joined_and_counts_where_it_comes_near(id, near):
    far_away = hinted(effect(id))
    fitted = joined(biased(), biased().base, far_away, NO_BARS)
    assert (fitted is not None) is near


def test_means_over_turns_go_by_the_turns_that_a_repaired_magnetometer_shows() -> None:
    """With the lost samples at their own times an accelerometer has one mean fewer: its times had stayed as many."""
    lost = effect("mag.dropped_samples", fraction=0.03)
    fit = relaxed(throws((), (lost,), module=BLIND, plant="free_spin"))
    (found,) = dropped_magnetometer(fit, ())
    before, after = ({r.sensor: r for r in one.readings} for one in (fit.trajectories[0], found.trajectories[0]))
    assert after["accelerometer"].t.size < before["accelerometer"].t.size
    for readings in after.values():
        assert readings.t.size == readings.value.shape[0]
    assert np.isfinite(refit(replace(fit, trajectories=found.trajectories), iterations=1).merit)


@pytest.mark.parametrize(("instant", "size"), [(0.62, 0.016), (0.65, 0.012)])
def test_a_kick_between_the_boundaries_of_a_wandering_motion_is_found_at_its_instant(
    instant: float, size: float
) -> None:
    """At the boundaries, where the motion may wander as it is, a kick that gains 130 promised nothing."""
    kick = effect("event.spin_step", t_s=instant, dr_rad_s=size)
    fit = relaxed(throws((kick,), only=1, module=BLIND, plant="free_spin"))
    noise = estimate_noise(fit.linears, [linear.residual for linear in fit.linears])
    own = unknowns([trajectory.recording for trajectory in fit.trajectories])
    found = events(local_problems(fit, noise, own, Hypothesis()))
    assert [event.candidate.recordings for event in found] == [frozenset({1})]
    start = {key[1]: value for (key, _), value in found[0].start.items()}
    assert start["t_s"] == pytest.approx(instant, abs=0.03)
    assert start["dr_rad_s"] == pytest.approx(size, rel=0.4)


@pytest.mark.slow
def test_lift_that_changes_within_the_first_turn_moves_no_accelerometer():
    """It left five times the noise in the first mean of one throw: a place of 0.1 mm was named."""
    case = draw_case(597283, "free_spin", (), "nothing")
    assert stepwise.search(SearchProblem(recordings(case))).final.hypothesis.candidates == ()


@pytest.mark.slow
def test_a_gyroscope_that_leans_with_the_pull_is_no_body_out_of_balance():
    """What goes with the pull is the same in all throws, and its own effect."""
    hidden = [effect("gyro.g_sensitivity", kx=2e-3, ky=-3e-3, kz=0.0)]
    made = throws(errors=hidden, module=BLIND, plant="free_spin")
    assert not any(one.unbalanced for one in relaxed(made).trajectories)
