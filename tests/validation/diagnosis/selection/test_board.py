"""The board: what algebra answers for any choice of columns is what least squares over all rows would."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import RIG, coasts

from discsim.arrays import FloatArray
from discsim.effects import effect
from discsim.validation.diagnosis.candidates.candidate import candidates_for
from discsim.validation.diagnosis.candidates.screening import (
    NormalEquations,
    column_of,
    free_columns,
    normal_equations_of,
)
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification.gauss_newton import Fit, linearised, linearised_columns, refit
from discsim.validation.identification.noise import stated_noise, whitened
from discsim.validation.identification.normal_equations import unknown_prior
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants.spin_down import SPIN_DOWN
from discsim.validation.identification.propagation import Column

VISCOUS = Parameter("rig", "viscous", RIG.viscous, 1e-8, 2e-7)
TORQUE = 1.5e-4


@cache
def fitted() -> tuple[Fit, NormalEquations]:
    """Three run-downs with friction, fitted without it, and the board of every effect."""
    recordings = coasts([effect("rig.coulomb_friction", torque_N_m=TORQUE)], rates=(60.0, 45.0, 30.0), seconds=1.5)
    trajectories = tuple(first_trajectory(recording) for recording in recordings)
    fit = Fit(trajectories, (VISCOUS,), np.array([RIG.viscous]), SPIN_DOWN.sizes.continuous, {})
    fit = refit(replace(fit, noise=stated_noise(linearised(fit, ()))), iterations=10)
    return fit, normal_equations_of(fit, candidates_for(recordings), fit.noise, fit.defects)


def chosen(*ids: str) -> list[tuple[Column, Parameter]]:
    fit, _ = fitted()
    candidates = {
        candidate.id: candidate
        for candidate in candidates_for([trajectory.recording for trajectory in fit.trajectories])
    }
    return [(column_of(VISCOUS), VISCOUS), *(pair for id in ids for pair in free_columns(candidates[id]))]


def direct(parameters: Sequence[tuple[Column, Parameter]], only: Sequence[int]) -> tuple[float, FloatArray, FloatArray]:
    """Chi-squared, values and covariance of least squares over all rows: unknowns of each recording, then columns."""
    fit, board = fitted()
    linears = linearised_columns(fit, board.columns)
    d, f = linears[0].sensitivities.shape[1], len(parameters)
    width = len(only) * d + f
    A, b = [], []
    for k, i in enumerate(only):
        linear = linears[i]
        columns = np.stack([linear.common[:, board.place[c]] * float(q.acts_in(i)) for c, q in parameters], axis=1)
        # the fit's own parameter stands off its stated value; the board counts from there
        away = linear.common[:, board.place[column_of(VISCOUS)]] * (fit.at[0] - VISCOUS.stated)
        rows = np.zeros((linear.raw.size, width))
        rows[:, k * d : (k + 1) * d], rows[:, len(only) * d :] = linear.nuisance, columns
        both = whitened(linear, fit.noise, np.hstack([rows, (linear.residual + away)[:, None]]))
        A.append(both[:, :-1])
        b.append(both[:, -1])
        H, _, _ = unknown_prior(linear, fit.trajectories[i], fit.defects)
        prior = np.zeros((d, width))
        prior[:, k * d : (k + 1) * d] = np.sqrt(H)
        A.append(prior)
        b.append(np.zeros(d))
    priors = np.zeros((f, width))
    for j, (_, q) in enumerate(parameters):
        if np.isfinite(q.sigma):
            priors[j, len(only) * d + j] = 1.0 / q.sigma
    A.append(priors)
    b.append(np.zeros(f))
    rows, right = np.vstack(A), np.concatenate(b)
    size = np.maximum(np.linalg.norm(rows, axis=0), 1e-300)
    x, *_ = np.linalg.lstsq(rows / size, right, rcond=None)
    left = right - rows / size @ x
    inverse = np.linalg.pinv((rows / size).T @ (rows / size)) / np.outer(size, size)
    return float(left @ left), (x / size)[len(only) * d :], inverse[-f:, -f:]


@pytest.mark.parametrize(
    ("ids", "only"),
    [
        ((), None),
        (("rig.coulomb_friction",), None),
        (("rig.coulomb_friction", "accel.bias"), None),
        (("mag.hard_iron", "rig.quadratic_drag"), (0, 2)),
        (("accel.position_offset",), (1,)),
    ],
)
def test_an_answer_is_that_of_least_squares_over_all_rows(ids: tuple[str, ...], only: tuple[int, ...] | None):
    _, board = fitted()
    parameters = chosen(*ids)
    answer = board.solve(parameters, only)
    chi2, value, covariance = direct(parameters, range(3) if only is None else only)
    sd = np.sqrt(np.diag(covariance))
    assert answer.chi2 == pytest.approx(chi2, rel=1e-7, abs=1e-3)
    assert np.max(np.abs(answer.value - value) / sd) < 1e-2
    assert np.sqrt(np.diag(answer.covariance)) == pytest.approx(sd, rel=1e-3)


def test_a_column_of_one_recording_is_free_there_alone():
    _, board = fitted()
    column, q = chosen("rig.coulomb_friction")[1]
    there = replace(q, recordings=frozenset([2]))
    answer = board.solve([(column, there)])
    chi2, value, _ = direct([(column, there)], range(3))
    assert answer.chi2 == pytest.approx(chi2, rel=1e-7)
    assert answer.value == pytest.approx(value, rel=1e-4)


def test_with_nothing_free_the_board_holds_the_stated_baseline():
    _, board = fitted()
    nothing = board.solve([])
    own = board.solve([(column_of(VISCOUS), VISCOUS)])
    assert nothing.value.size == 0
    assert own.chi2 < nothing.chi2


def test_the_cause_gains_most_and_the_step_towards_it_is_nearly_all_of_it():
    """Readings bend with the friction: algebra about the wrong motion gets the size to some percent."""
    _, board = fitted()
    base = board.solve(chosen()).chi2
    gains = {}
    for id in ("rig.coulomb_friction", "rig.quadratic_drag", "mag.hard_iron", "accel.bias", "clock.rate"):
        gains[id] = base - board.solve(chosen(id)).chi2
    assert max(gains, key=lambda id: gains[id]) == "rig.coulomb_friction"
    assert board.solve(chosen("rig.coulomb_friction")).value[1] == pytest.approx(TORQUE, rel=0.1)


def test_freeing_more_never_explains_less():
    _, board = fitted()
    one = board.solve(chosen("mag.hard_iron")).chi2
    two = board.solve(chosen("mag.hard_iron", "mag.soft_iron")).chi2
    assert two <= one
