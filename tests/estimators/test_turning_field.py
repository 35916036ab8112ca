"""Sums over readings that cost no more than the readings: the same as by whole derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.estimators.precession import transverse_rates
from discsim.estimators.tone import turns
from discsim.estimators.tracking import Segment, TrackingSettings
from discsim.estimators.tracking.problem import Problem
from discsim.recording import Samples


def test_turns_are_cosine_and_sine_to_the_last_digit():
    """Two units of the last digit of one, at angles up to a million."""
    angle = np.concatenate(
        [np.linspace(-400.0, 400.0, 20001), np.linspace(-1e6, 1e6, 1001), np.arange(-8, 9) * np.pi / 4]
    )
    cosine, sine = np.empty_like(angle), np.empty_like(angle)
    turns(angle, cosine, sine)
    np.testing.assert_allclose(cosine, np.cos(angle), rtol=0, atol=4.5e-16)
    np.testing.assert_allclose(sine, np.sin(angle), rtol=0, atol=4.5e-16)


def differences(problem: Problem, x: np.ndarray) -> np.ndarray:
    """Return the derivative (3 n, m) of the model's field by central differences."""
    columns = []
    for j in range(x.size):
        step = np.zeros(x.size)
        step[j] = 1e-4
        up, down = problem.evaluate(x + step).residual, problem.evaluate(x - step).residual
        columns.append((down - up).ravel() / 2e-4)
    return np.stack(columns, axis=1)


@pytest.mark.parametrize(
    "case", ["no gyroscope", "gyroscope", "gyroscope whose noise counts", "a hole", "fixed axis", "fast readings"]
)
def test_normal_equations_are_those_of_the_whole_derivative(case):
    """Central differences err by the third derivative: 1e-8/6 of the field's turning, here below 1e-6 of an entry.

    The midpoint rule is differentiated to first order in a sub-step's turning, 0.25 rad at most: without a gyroscope
    exactly, with one to a few 1e-3 where the axis moves within it.
    """
    rng = np.random.default_rng(3)
    # of fast readings more fall between two knots than are multiplied at once
    t = np.cumsum(rng.uniform(0.0008, 0.0012, 400) if case == "fast readings" else rng.uniform(0.008, 0.012, 150))
    if case == "a hole":
        t[70:] += 0.83
    m = 30 * np.stack([np.cos(20 * t), -np.sin(20 * t), 0 * t + 1.2], axis=1) + rng.normal(0, 0.3, (t.size, 3))
    at = np.arange(-0.5, t[-1] + 0.5, 0.005)
    gyroscope = Samples(at, rng.normal(0, 0.1, (at.size, 3))) if case.startswith("gyroscope") else None
    walk = 0.01 if "counts" in case else 0.0
    segment = Segment(t, m, TrackingSettings(), gyroscope, fixed_axis=case == "fixed axis", walk=walk)
    problem = Problem(segment, top_rate=20.0, typical_rate=20.0)
    x = rng.normal(0, 0.02, problem.size)
    x[problem.parts[0]] += 20 + rng.normal(0, 1, problem.spline.size)
    if problem.read:  # the derivatives are those at no gain and nothing unread: of second order, as both are small
        x[problem.parts[1]] = 0.0
    x[problem.parts[2]] = 28.0, -3.0, 36.0
    scale = rng.uniform(0.5, 2.0, t.size)
    information, right = np.zeros((problem.size, problem.size)), np.zeros(problem.size)
    found = problem.evaluate(x)
    problem.add_field(x, found, scale, information, right)
    J = differences(problem, x) * np.repeat(scale, 3)[:, None]
    expected = J.T @ J
    size = np.sqrt(np.diag(expected)) + 1e-30
    close = 5e-3 if gyroscope is not None else 1e-6
    np.testing.assert_allclose(information / np.outer(size, size), expected / np.outer(size, size), atol=close)
    pull = J.T @ (found.residual * scale[:, None]).ravel()
    np.testing.assert_allclose(right / size, pull / size, atol=close * np.abs(pull / size).max())


def test_transverse_rates_of_a_piece_are_those_of_the_whole_log():
    """A spline of fifth degree forgets by 0.43 per knot; gaps of the gyroscope count as they do in the whole."""
    rng = np.random.default_rng(4)
    t = 0.005 * np.arange(8000)
    value = rng.normal(0, 1, (t.size, 3))
    value[3900:3960] = np.nan
    whole = Samples(t, value)
    at = 0.0099 * np.arange(4000) + 0.002
    every, substeps = transverse_rates(whole, at)
    piece, same = transverse_rates(whole, at[1900:2100])
    assert same == substeps
    np.testing.assert_allclose(piece, every[1900:2099], rtol=0, atol=1e-9)
    assert np.any(np.isnan(piece))
    assert np.any(np.isfinite(piece))
