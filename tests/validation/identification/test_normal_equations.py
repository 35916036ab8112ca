"""Normal equations: what nothing shows stays out, and what recordings have of their own gives way."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from discsim import validation
from discsim.validation.identification.linear import Channel, Linear
from discsim.validation.identification.noise import GroupNoise, whitened
from discsim.validation.identification.normal_equations import (
    CUT_OFF,
    Reduced,
    common_step,
    inverse_of,
    local_covariance,
)
from discsim.validation.identification.parameters import Parameter, values_of


def sums_of_squares(size: int, rows: int = 40) -> np.ndarray:
    columns = np.random.default_rng(3).standard_normal((rows, size))
    return columns.T @ columns


def test_a_system_that_is_wholly_known_is_inverted():
    H = sums_of_squares(5)
    np.testing.assert_allclose(inverse_of(H) @ H, np.eye(5), atol=1e-12)


@pytest.mark.parametrize(("share", "kept"), [(10.0 * CUT_OFF, True), (0.1 * CUT_OFF, False)])
def test_a_combination_of_which_nothing_is_known_stays_where_it_is(share, kept):
    """Its eigenvalue is the cut-off times ten, and a tenth of it."""
    directions, _ = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))
    inverse = inverse_of((directions * [1.0, 0.5, share]) @ directions.T)
    expected = 1.0 / share if kept else 0.0
    assert directions[:, 2] @ inverse @ directions[:, 2] == pytest.approx(expected, rel=1e-4, abs=1e-3)
    assert directions[:, 0] @ inverse @ directions[:, 0] == pytest.approx(1.0, rel=1e-4)


def test_what_readings_say_nothing_of_is_as_uncertain_as_it_was_beforehand():
    """Two numbers of which only the sum shows: it is known by the readings, the difference by the priors alone."""
    q = [Parameter("effect", name, 0.0, 1.0, 20.0) for name in "ab"]
    gram = 1e12 * np.array([[1.0, 1.0, 3.0], [1.0, 1.0, 3.0], [3.0, 3.0, 10.0]])
    step, covariance, _ = common_step(gram, q, np.zeros(2))
    apart, both = np.array([1.0, -1.0]), np.ones(2)
    assert step @ both == pytest.approx(3.0)
    assert step @ apart == pytest.approx(0.0, abs=1e-6)
    assert apart @ covariance @ apart == pytest.approx(2.0 * 20.0**2)
    assert both @ covariance @ both == pytest.approx(1e-12, rel=1e-6, abs=1e-11)


def test_the_covariance_of_a_recording_s_own_unknowns_is_that_of_all_together():
    """The blocks of the inverse of the whole normal matrix, by elimination and at once."""
    H, own = sums_of_squares(6), 4
    scale = 1.0 / np.sqrt(np.diag(H)[:own])
    factor = np.linalg.cholesky(H[:own, :own] * np.outer(scale, scale))
    cross = np.hstack([H[:own, own:], np.zeros((own, 1))]) * scale[:, None]
    whole = np.linalg.inv(H)
    reduced = Reduced(np.zeros((3, 3)), (factor, scale), cross, 40)
    np.testing.assert_allclose(local_covariance(reduced, whole[own:, own:]), whole[:own, :own], rtol=1e-9)


def test_a_level_relative_to_what_is_stated_weighs_each_reading_by_its_own_deviation():
    n = 6
    stated, rows = np.linspace(0.1, 0.6, n), np.arange(1.0, n + 1.0)[:, None]
    channel = Channel("track", "north_m", "track", slice(0, n), np.arange(n))
    none, column = np.empty(0), np.zeros((0, 0))
    linear = Linear(
        rows[:, 0], column, np.zeros(n, int), column, none, stated, (channel,), none, none, none,
        np.zeros((1, 0, 0)), column, column, column, np.zeros(n),
    )  # fmt: skip
    white = whitened(linear, {"track": GroupNoise(2.0, relative=True)}, rows)
    np.testing.assert_allclose(white[:, 0], rows[:, 0] / (2.0 * stated), rtol=1e-14)
    absolute = whitened(linear, {"track": GroupNoise(2.0)}, rows)
    np.testing.assert_allclose(absolute, rows / 2.0, rtol=1e-14)


def test_recordings_that_state_a_number_differently_move_it_by_as_much():
    wind = Parameter("environment", "wind_north", 1.0, 0.01, 0.5, offsets=(0.0, -2.5))
    at = np.array([1.3])
    assert values_of([wind], at, 0, {}) == {wind.key: 1.3}
    assert values_of([wind], at, 1, {}) == {wind.key: pytest.approx(-1.2)}


#: where `eigh` and `pinv` serve something else than normal equations that may lack a direction
NO_NORMAL_EQUATIONS = {
    "identification/normal_equations.py": "the solver itself, and the root of a matrix that rounding made indefinite",
    "identification/initial/spin_phase.py": "the axes of an ellipse",
    "diagnosis/setup/rotation.py": "the axis about which a sensor turns",
    "diagnosis/signals/relations.py": "the error of one of three coefficients of a regression",
}


def test_symmetric_systems_are_solved_in_one_place():
    room = Path(validation.__file__).parent
    sources = [path for name in ("identification", "diagnosis", "yaw_damping") for path in (room / name).rglob("*.py")]
    found = {str(path.relative_to(room)) for path in sources if re.search(r"\b(eigh|pinv)\(", path.read_text("utf-8"))}
    assert found == set(NO_NORMAL_EQUATIONS)
