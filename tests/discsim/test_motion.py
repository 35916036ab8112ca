from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.flights import DRIVER, FIELD, throw

from discsim.engine import fly
from discsim.frames import body_to_ned, rotation_error
from discsim.motion import Motion

SPIN, WOBBLE, AXIAL = 70.0, 2.0, 65.0


def precessing(t: np.ndarray) -> Motion:
    """A motion whose every quantity is known at any instant: a circle with a growing fall, and a torque-free top.

    The top's angular velocity is h in N plus -AXIAL z in B, and h leans by WOBBLE over SPIN from z_B.
    """
    t = np.asarray(t, dtype=float)
    angle = 3.0 * t
    position = np.column_stack((np.cos(angle), np.sin(angle), -20.0 + t**3))
    velocity = np.column_stack((-3 * np.sin(angle), 3 * np.cos(angle), 3 * t**2))
    acceleration = np.column_stack((-9 * np.cos(angle), -9 * np.sin(angle), 6 * t))
    h = np.array([WOBBLE, 0.0, SPIN + AXIAL])
    C_NB = Rotation.from_rotvec(np.outer(t, h)) * Rotation.from_rotvec(np.outer(-AXIAL * t, [0.0, 0.0, 1.0]))
    turning = AXIAL * t
    rate = np.column_stack((WOBBLE * np.cos(turning), WOBBLE * np.sin(turning), np.full(t.size, SPIN)))
    angular = AXIAL * np.column_stack((-WOBBLE * np.sin(turning), WOBBLE * np.cos(turning), np.zeros(t.size)))
    return Motion(t, position, velocity, acceleration, C_NB.as_quat(scalar_first=True), rate, angular, FIELD)


def errors(steps: int) -> dict[str, float]:
    """Largest error of each quantity between the points of a grid of so many steps in 1 s, edges included."""
    grid = np.linspace(0.0, 1.0, steps + 1)
    between = np.sort(np.concatenate([grid[:-1] + share / steps for share in (0.2, 0.5, 0.8)]))
    state, exact = precessing(grid).at(between), precessing(between)
    found = {
        name: float(np.abs(getattr(state, name) - getattr(exact, name)).max())
        for name in ("position", "velocity", "acceleration", "rate", "angular_acceleration")
    }
    found["attitude"] = float(rotation_error(state.attitude, exact.attitude).max())
    return found


def test_the_example_is_a_consistent_motion():
    """Attitude turns at the stated rates: central differences of 1e-5 s err by their square times w^3, 1e-4/s."""
    t, h = 0.4, 1e-5
    motion = precessing(np.array([t - h, t, t + h]))
    step = Rotation.from_quat(motion.attitude[[0, 2]], scalar_first=True)
    mean_rate = (step[0].inv() * step[1]).as_rotvec() / (2 * h)
    np.testing.assert_allclose(mean_rate, motion.rate[1], atol=1e-3)


@pytest.mark.parametrize("name", ["position", "velocity", "acceleration", "rate", "angular_acceleration", "attitude"])
def test_between_grid_points_the_error_is_of_fourth_order(name):
    """Halving the step divides the error by 2^4, within 0.2 of the exponent for the order after.

    The path bends at 3 rad/s and is at rounding with the steps of 4 to 1 ms that resolve the spin.
    """
    counts = (25, 50, 100) if name in ("position", "velocity", "acceleration") else (250, 500, 1000)
    slopes = -np.diff(np.log2([errors(steps)[name] for steps in counts]))
    np.testing.assert_allclose(slopes, 4.0, atol=0.2)


def test_at_1_khz_interpolation_adds_less_than_the_engine_errs():
    """The engine keeps attitude to 2e-5 deg over 3 s; between its points nothing like that is lost."""
    assert np.degrees(errors(1000)["attitude"]) < 2e-5


def test_on_grid_points_it_is_the_grid():
    motion = fly(DRIVER, FIELD, throw(wobble=(2.0, 1.0)), duration=0.5)
    state = motion.at(motion.t)
    for name in ("position", "velocity", "acceleration", "rate", "angular_acceleration"):
        np.testing.assert_allclose(getattr(state, name), getattr(motion, name), rtol=1e-13, atol=1e-12)
    assert rotation_error(state.attitude, motion.attitude).max() < 1e-14


@given(t=st.lists(st.floats(0.0, 1.0), min_size=1, max_size=5))
def test_attitudes_between_are_rotations(t):
    q = precessing(np.linspace(0.0, 1.0, 101)).at(np.array(t)).attitude
    np.testing.assert_allclose(np.linalg.norm(q, axis=1), 1.0, atol=1e-14)


def test_instants_may_come_in_any_order_and_twice():
    motion = precessing(np.linspace(0.0, 1.0, 101))
    t = np.array([0.9, 0.1, 0.105, 0.9, 1.0, 0.0])
    state, one_by_one = motion.at(t), [motion.at(np.array([x])) for x in t]
    np.testing.assert_array_equal(state.position, np.concatenate([s.position for s in one_by_one]))
    np.testing.assert_array_equal(state.attitude, np.concatenate([s.attitude for s in one_by_one]))


def test_no_instants_are_no_error():
    assert precessing(np.linspace(0.0, 1.0, 11)).at(np.array([])).position.shape == (0, 3)


@pytest.mark.parametrize("t", [-1e-3, 1.001])
def test_outside_its_time_a_motion_has_no_state(t):
    with pytest.raises(ValueError, match="motion runs from 0 to 1 s"):
        precessing(np.linspace(0.0, 1.0, 101)).at(np.array([0.5, t]))


def test_a_state_gives_vectors_in_body_axes():
    motion = precessing(np.linspace(0.0, 1.0, 101))
    state = motion.at(np.array([0.3, 0.7]))
    field = np.array([30.0, -4.0, 39.0])
    expected = [body_to_ned(q).T @ field for q in state.attitude]
    np.testing.assert_allclose(state.in_body(field), expected, rtol=1e-14)
    rows = np.array([field, 2 * field])
    np.testing.assert_allclose(state.in_body(rows), expected * np.array([[1.0], [2.0]]), rtol=1e-14)


def test_touch_down_shortens_the_last_step_without_spoiling_it():
    """The last interval of a flight may be any fraction of a step: states there still join up."""
    motion = fly(DRIVER, FIELD, throw(speed=15.0, climb_deg=0.0))
    assert motion.touched_down
    assert motion.t[-1] - motion.t[-2] < 1e-3
    inside = np.linspace(motion.t[-2], motion.end, 5)
    state = motion.at(inside)
    straight = motion.position[-2] + np.outer(inside - inside[0], motion.velocity[-2])
    np.testing.assert_allclose(state.position, straight, atol=0.5 * 15.0 * 1e-6)  # half a t^2, a below 15 m/s^2


class TestShape:
    motion = precessing(np.linspace(0.0, 1.0, 11))

    def test_arrays_are_read_only_copies(self):
        with pytest.raises(ValueError, match="read-only"):
            self.motion.position[0, 0] = 1.0

    @pytest.mark.parametrize("name", ["position", "attitude", "rate"])
    def test_an_array_of_another_length_is_refused(self, name):
        with pytest.raises(ValueError, match=rf"motion {name}: got \(10, \d\), expected \(11, \d\)"):
            dataclasses.replace(self.motion, **{name: getattr(self.motion, name)[:-1]})

    def test_time_must_ascend(self):
        t = self.motion.t.copy()
        t[5] = t[4]
        with pytest.raises(ValueError, match="ascending"):
            dataclasses.replace(self.motion, t=t)
