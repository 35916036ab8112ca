"""Least squares over recordings: elimination against dense algebra, steps against scipy, fits against the truth."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from support.made import RIG, coasts, flight, release_of, states_of, tables, throws

from discsim.arrays import FloatArray
from discsim.effects import effect
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification import gauss_newton, normal_equations
from discsim.validation.identification.gauss_newton import (
    Bars,
    Fit,
    GaussNewtonStep,
    discontinuous,
    linearised,
    merit_of,
    refit,
)
from discsim.validation.identification.noise import stated_noise, whitened
from discsim.validation.identification.normal_equations import (
    common_step,
    normal_matrix,
    nuisance_step,
    reduce,
    unknown_prior,
)
from discsim.validation.identification.parameters import AllowedDefects, Parameter, values_of
from discsim.validation.identification.plants.flight import FLIGHT
from discsim.validation.identification.plants.spin_down import SPIN_DOWN
from discsim.validation.identification.release_prior import release_rows
from discsim.validation.identification.segments import Trajectory, stepped, trajectory_of

FRICTION = Parameter("rig.coulomb_friction", "torque_N_m", 0.0, 1e-6)
VISCOUS = Parameter("rig", "viscous", RIG.viscous, 1e-8, 2e-7)
HARD = Parameter("mag.hard_iron", "bx_uT", 0.0, 0.05, 10.0, frozenset([1]))


@cache
def relaxed_fit() -> Fit:
    """Two run-downs in segments that may jump, beside the data and not yet fitted."""
    trajectories = tuple(first_trajectory(recording) for recording in coasts(seconds=2.0))
    parameters = (VISCOUS, FRICTION, HARD)
    fit = Fit(trajectories, parameters, np.array([RIG.viscous, 1e-5, 0.3]), SPIN_DOWN.sizes.relaxed, {})
    linears = linearised(fit)
    noise = {group: level._replace(correlation=0.3) for group, level in stated_noise(linears).items()}
    return replace(fit, linears=linears, noise=noise)


def dense(fit: Fit, white: bool = False) -> tuple[FloatArray, FloatArray]:
    """All rows of all recordings over [locals of each | shared], priors as rows; and the right-hand side."""
    noise = {g: n._replace(correlation=0.0) for g, n in fit.noise.items()} if white else fit.noise
    sizes = [linear.unknowns for linear in fit.linears]
    width = sum(sizes) + len(fit.parameters)
    A, b = [], []
    for k, (linear, current) in enumerate(zip(fit.linears, fit.trajectories, strict=True)):
        start, u = sum(sizes[:k]), sizes[k]
        rows = np.zeros((linear.raw.size, width))
        rows[:, start : start + u], rows[:, sum(sizes) :] = linear.nuisance, linear.common
        both = whitened(linear, noise, np.hstack([rows, linear.residual[:, None]]))
        A.append(both[:, :-1])
        b.append(both[:, -1])
        H, right, _ = unknown_prior(linear, current, fit.defects)
        prior = np.zeros((u, width))
        prior[:, start : start + u] = np.sqrt(H)  # diagonal: nothing is stated of a rig's release
        A.append(prior)
        b.append(right / np.sqrt(np.diag(H)))
    for j, (q, at) in enumerate(zip(fit.parameters, fit.at, strict=True)):
        row = np.zeros((1, width))
        if np.isfinite(q.sigma):
            row[0, sum(sizes) + j] = 1.0 / q.sigma
            A.append(row)
            b.append(np.array([(q.stated - at) / q.sigma]))
    return np.vstack(A), np.concatenate(b)


def white(fit: Fit) -> Fit:
    return replace(fit, noise={g: n._replace(correlation=0.0) for g, n in fit.noise.items()})


def test_eliminating_each_recording_gives_the_step_of_the_whole_system():
    fit = white(relaxed_fit())
    A, b = dense(fit)
    size = np.linalg.norm(A, axis=0)
    whole, *_ = np.linalg.lstsq(A / size, b, rcond=None)
    whole = whole / size
    reduced = [reduce(*each, fit.noise, fit.defects) for each in zip(fit.linears, fit.trajectories, strict=True)]
    step, covariance, expected = common_step(np.sum([r.gram for r in reduced], axis=0), fit.parameters, fit.at)
    p = len(fit.parameters)
    assert step == pytest.approx(whole[-p:], rel=1e-5, abs=1e-9 * np.max(np.abs(whole[-p:])))
    assert expected == pytest.approx(float(np.sum((b - A @ whole) ** 2)), rel=1e-8)
    inverse = np.linalg.inv((A / size).T @ (A / size))[-p:, -p:] / np.outer(size[-p:], size[-p:])
    assert np.sqrt(np.diag(covariance)) == pytest.approx(np.sqrt(np.diag(inverse)), rel=1e-4)
    start = 0
    for r, linear in zip(reduced, fit.linears, strict=True):
        u = linear.unknowns
        sd = 1.0 / np.linalg.norm(A[:, start : start + u], axis=0)
        assert np.max(np.abs(nuisance_step(r, step) - whole[start : start + u]) / sd) < 1e-3
        start += u


def test_the_normal_matrix_of_long_chains_is_that_of_the_full_rows():
    fit = white(relaxed_fit())
    for linear in fit.linears:
        assert linear.unknowns > linear.sensitivities.shape[1]
        A = whitened(linear, fit.noise, np.hstack([linear.nuisance, linear.common, linear.residual[:, None]]))
        G = A.T @ A
        size = np.sqrt(np.maximum(np.diag(G), 1e-300))
        assert np.max(np.abs(normal_matrix(linear, fit.noise) - G) / np.outer(size, size)) < 1e-10


def test_correlated_noise_weighs_tied_pieces_by_their_dense_covariance():
    fit = replace(relaxed_fit(), defects=SPIN_DOWN.sizes.continuous)
    linear = linearised(fit)[0]
    A = np.hstack([linear.nuisance, linear.common, linear.residual[:, None]])
    G = np.zeros((A.shape[1],) * 2)
    for channel in linear.channels:
        sd, phi, *_ = fit.noise[channel.group]
        C = sd**2 * phi ** np.abs(channel.index[:, None] - channel.index[None, :])
        G += A[channel.rows].T @ np.linalg.solve(C, A[channel.rows])
    size = np.sqrt(np.maximum(np.diag(G), 1e-300))
    assert np.max(np.abs(normal_matrix(linear, fit.noise) - G) / np.outer(size, size)) < 1e-8


def test_a_shared_step_obeys_priors_and_leaves_alone_what_no_reading_shows():
    rng = np.random.default_rng(1)
    A, b = rng.standard_normal((40, 3)), rng.standard_normal(40)
    A[:, 2] = 0.0
    gram = np.hstack([A, b[:, None]]).T @ np.hstack([A, b[:, None]])
    parameters = (Parameter("a", "x", 2.0, 1.0, 0.05), Parameter("a", "y", 0.0, 1.0), Parameter("a", "z", 0.0, 1.0))
    at = np.array([1.0, 0.0, 0.0])
    step, _, expected = common_step(gram, parameters, at)
    rows = np.vstack([A, [1.0 / 0.05, 0.0, 0.0]])
    right = np.append(b, (2.0 - 1.0) / 0.05)
    direct = lsq_linear(rows[:, :2], right)
    assert step[:2] == pytest.approx(direct.x)
    assert step[2] == 0.0
    assert expected == pytest.approx(2.0 * direct.cost)


@pytest.mark.parametrize(
    "gram", [np.full((2, 2), np.nan), np.array([[-1.0, 1e200, 0.0], [1e200, 1.0, 0.0], [0.0, 0.0, 1.0]])]
)
def test_a_step_from_predictions_that_are_not_finite_is_no_number(gram):
    parameters = (FRICTION, FRICTION)[: len(gram) - 1]
    step, covariance, expected = common_step(gram, parameters, np.zeros(len(parameters)))
    assert np.isnan(step).all()
    assert np.isnan(covariance).all()
    assert np.isnan(expected)


def test_sums_that_rounding_has_made_indefinite_still_have_a_root():
    """As those of segments whose motion grows without bounds: what is lost counts as not known."""
    columns = np.random.default_rng(1).standard_normal((5, 3))
    H = columns @ columns.T - 1e-10 * np.eye(5)
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(H)
    L = normal_equations.lower_root(H)
    assert np.array_equal(L, np.tril(L))
    np.testing.assert_allclose(L @ L.T, H, atol=1e-9)
    sound = H + np.eye(5)
    np.testing.assert_array_equal(normal_equations.lower_root(sound), np.linalg.cholesky(sound))
    assert np.all(np.isnan(normal_equations.lower_root(np.full((2, 2), np.inf))))


def test_values_hold_in_the_recordings_of_their_parameter():
    at = np.array([4e-5, 1e-4, 2.0])
    assert values_of((VISCOUS, FRICTION, HARD), at, 0, {}) == {VISCOUS.key: 4e-5, FRICTION.key: 1e-4}
    assert values_of((VISCOUS, FRICTION, HARD), at, 1, {})[HARD.key] == 2.0


def test_a_column_of_one_recording_is_zero_in_the_others():
    first, second = relaxed_fit().linears
    assert not first.common[:, 2].any()
    assert second.common[:, 2].any()


def test_the_merit_is_what_the_dense_system_leaves_without_a_step():
    fit = relaxed_fit()
    _, b = dense(fit)
    first = sum(float(np.sum(linear.defect[linear.defect_kind < 0] ** 2)) for linear in fit.linears)
    assert first == 0.0
    assert merit_of(fit, fit.linears) == pytest.approx(float(b @ b), rel=1e-10)


def test_a_fit_of_tied_pieces_finds_the_friction_with_an_honest_error():
    """From segments started by the data; closed, the trajectory is one motion."""
    hidden = [effect("rig.coulomb_friction", torque_N_m=1.5e-4)]
    trajectories = tuple(first_trajectory(recording) for recording in coasts(hidden, seconds=2.0))
    fit = Fit(trajectories, (FRICTION,), np.zeros(1), SPIN_DOWN.sizes.continuous, {})
    fit = refit(replace(fit, noise=stated_noise(linearised(fit, ()))), iterations=12)
    sd = float(np.sqrt(fit.covariance[0, 0]))
    assert fit.at[0] == pytest.approx(1.5e-4, abs=4.0 * sd)
    assert sd < 1e-5
    assert fit.merit / fit.count == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / fit.count))
    for linear in fit.linears:
        assert np.max(np.abs(linear.mismatch)) < 1e-3
        assert linear.residual == pytest.approx(linear.raw, abs=1e-2)
    # where a fit stands there is nothing left to step
    reduced = [reduce(*each, fit.noise, fit.defects) for each in zip(fit.linears, fit.trajectories, strict=True)]
    still = np.zeros(1)
    for linear, each in zip(fit.linears, reduced, strict=True):
        after = linear.after(nuisance_step(each, still), still)
        assert np.sum(after**2) == pytest.approx(np.sum(linear.residual**2), rel=1e-4)


def stated(seconds: float = 0.5) -> Trajectory:
    """A throw of which the release is stated, and a trajectory that starts elsewhere."""
    release = release_of(0.4, 70.0)
    sigma = {"velocity_ned_m_s": 0.5, "roll_rad": 0.02, "pitch_rad": 0.02, "body_rate_rad_s": 0.1}
    recording = replace(throws(seconds=seconds)[0], release=replace(release, sigma=sigma))
    state = states_of(flight(seconds=seconds), np.zeros(1))
    off = np.array([0.01, -0.02, 0.03, 0.4, -0.3, 0.2, 0.03, -0.02, 0.5, 0.05, -0.02, 0.3])
    return trajectory_of(recording, np.array([0.0, seconds]), FLIGHT.layout.moved(state, off))


def test_a_stated_release_pulls_the_first_state_by_its_sigmas():
    current = stated()
    residual, rows = release_rows(current)
    assert residual.size == 12
    assert residual[3] == pytest.approx(-0.4 / 0.5)
    # rows against differences
    h = 1e-5
    for k in range(12):
        moved = [
            release_rows(replace(current, states=FLIGHT.layout.moved(current.states, s * h * np.eye(12)[k])))[0]
            for s in (1.0, -1.0)
        ]
        slope = (moved[1] - moved[0]) / (2.0 * h)
        assert rows[:, k] == pytest.approx(slope, rel=1e-4, abs=1e-4 * max(1.0, float(np.max(np.abs(rows[:, k])))))


def test_a_rig_states_no_release():
    current = first_trajectory(tables()[0])
    residual, rows = release_rows(current)
    assert residual.size == 0
    # upon turning further, and upon having started elsewhere
    assert rows.shape == (0, 2)


def test_a_tied_fit_of_a_throw_comes_down_to_the_noise():
    trajectories = tuple(first_trajectory(recording) for recording in throws(seconds=1.0))
    fit = Fit(trajectories, (), np.empty(0), AllowedDefects(np.zeros(12)), {})
    fit = refit(replace(fit, noise=stated_noise(linearised(fit))), iterations=12)
    # 24 unknowns of some 3000 readings
    assert fit.merit / fit.count == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / fit.count))


def test_a_fit_that_ends_with_its_pieces_apart_goes_back_to_where_they_hung_together(monkeypatch):
    """Gaps are counted to first order only: what opens them may seem to gain."""
    trajectories = tuple(first_trajectory(recording) for recording in coasts(seconds=2.0))
    fit = Fit(trajectories, (VISCOUS,), np.array([RIG.viscous]), SPIN_DOWN.sizes.continuous, {})
    fit = refit(replace(fit, noise=stated_noise(linearised(fit))))
    assert not discontinuous(fit)

    def apart(self: GaussNewtonStep) -> Fit:
        first, *others = self.fit.trajectories
        tangents = np.zeros((len(first.states), first.plant.layout.directions))
        tangents[-1, -1] = 1.0
        trial = replace(self.fit, trajectories=(stepped(first, tangents), *others))
        return replace(trial, linears=linearised(trial), merit=0.9 * self.fit.merit)

    assert discontinuous(apart(GaussNewtonStep(fit, (), np.empty(0), {}, fit.merit)))
    monkeypatch.setattr(GaussNewtonStep, "with_one_fraction", apart)
    again = refit(fit, iterations=3, tolerance=-np.inf)
    assert not discontinuous(again)
    for before, after in zip(fit.trajectories, again.trajectories, strict=True):
        np.testing.assert_array_equal(after.states, before.states)


def test_a_fit_that_will_stay_above_a_bar_is_left_where_it_stands():
    fit = replace(white(relaxed_fit()), defects=SPIN_DOWN.sizes.continuous)
    fit = replace(fit, at=np.array([5.0 * RIG.viscous, 1e-3, 0.3]))
    whole = refit(fit)
    assert refit(fit, bars=Bars(2.0 * whole.merit)).merit == whole.merit
    given_up = refit(fit, bars=Bars(0.5 * whole.merit))
    assert given_up.iterations < whole.iterations
    assert given_up.merit > whole.merit


def test_residuals_by_a_chord_are_those_of_a_full_linearisation():
    """Readings are predicted as they are; the slopes stay those of the point where they were worked out."""
    fit = relaxed_fit()
    moved = replace(fit, trajectories=tuple(stepped(c, np.full((len(c.states), 2), 1e-4)) for c in fit.trajectories))
    full = linearised(moved)
    for linear, chord, before in zip(full, gauss_newton.repredicted(moved), fit.linears, strict=True):
        np.testing.assert_allclose(chord.residual, linear.residual, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(chord.defect, linear.defect, atol=1e-12)
        assert chord.own is before.own


def test_there_is_no_chord_where_other_readings_take_part():
    """A clipped reading counts where the motion would not clip: its row has no slopes."""
    fit = relaxed_fit()
    first = fit.trajectories[0].readings[0]
    good = first.good.copy()
    good[5:8] = False
    fewer = replace(fit.trajectories[0], readings=(replace(first, good=good), *fit.trajectories[0].readings[1:]))
    assert gauss_newton.repredicted(replace(fit, trajectories=(fewer, *fit.trajectories[1:]))) is None


def test_short_steps_by_chords_end_where_full_ones_do(monkeypatch):
    """Within a hundredth of a standard deviation, with fewer motions run."""
    start = replace(relaxed_fit(), defects=SPIN_DOWN.sizes.continuous)
    runs = []
    run = gauss_newton.linearised
    monkeypatch.setattr(gauss_newton, "linearised", lambda *given, **named: runs.append(1) or run(*given, **named))

    def ended(chord: float) -> tuple[Fit, int]:
        monkeypatch.setattr(gauss_newton, "CHORD", chord)
        runs.clear()
        fit = refit(start, iterations=10, tolerance=1e-6)
        return refit(replace(fit, noise=dict(fit.noise)), iterations=4, tolerance=1e-9, relinearise=False), len(runs)

    (full, often), (chord, seldom) = ended(0.0), ended(10.0)
    assert seldom < often
    sd = np.sqrt(np.diag(full.covariance))
    assert np.all(np.abs(full.at - chord.at) < 0.01 * sd)
    assert chord.merit == pytest.approx(full.merit, abs=1e-3)
