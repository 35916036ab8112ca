from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.flights import DRIVER, FIELD, attitude, throw

from discsim.engine import FlyingDisc, fly
from discsim.frames import (
    C1,
    C2,
    C3,
    FLIP,
    attitude_matrix,
    body_to_ned,
    conjugate,
    euler_angles,
    flip_yz,
    heading_angles,
    multiply,
    quaternion_from_euler,
    quaternion_from_matrix,
    rotate_by_quaternion,
    rotation_error,
    rotation_vector,
    to_body,
    turn,
)

#: a product of three rotation matrices rounds to a few units in the last place
ROUNDING = 1e-14

angles = st.floats(-np.pi, np.pi)
components = st.floats(-1.0, 1.0)
#: quaternions, (w, x, y, z), from four numbers that are not all tiny
quaternions = (
    st.tuples(components, components, components, components)
    .map(np.array)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: q / np.linalg.norm(q))
)
vectors = st.tuples(components, components, components).map(np.array)


def scipy_rotation(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


@given(roll=angles, pitch=angles, yaw=angles)
def test_attitude_is_roll_then_pitch_then_yaw(roll, pitch, yaw):
    """(A1): C_BN = C3 C2 C1 is the transpose of intrinsic turns about x, then y, then z."""
    expected = Rotation.from_euler("XYZ", [roll, pitch, yaw]).as_matrix().T
    np.testing.assert_allclose(attitude_matrix(roll, pitch, yaw), expected, atol=ROUNDING)


def test_the_elementary_rotations_take_n_components_to_turned_axes():
    """A frame turned clockwise (north to east) by 90 deg sees north on its left, -y."""
    north, east, down = np.eye(3)
    quarter = np.pi / 2
    np.testing.assert_allclose(C3(quarter) @ north, -east, atol=ROUNDING)
    np.testing.assert_allclose(C2(quarter) @ north, down, atol=ROUNDING)  # nose up: ahead is now below
    np.testing.assert_allclose(C1(quarter) @ east, -down, atol=ROUNDING)  # right side down: right is now above


@given(q=quaternions)
def test_a_matrix_gives_its_quaternion_back(q):
    back = quaternion_from_matrix(body_to_ned(q))
    np.testing.assert_allclose(back * np.sign(back @ q), q, atol=1e-14)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1]])
def test_a_half_turn_has_a_quaternion_without_its_first_part(axis):
    """There the trace is -1 and the usual formula divides by zero."""
    q = quaternion_from_matrix(Rotation.from_rotvec(np.pi * np.array(axis)).as_matrix())
    np.testing.assert_allclose(np.abs(q), [0, *axis], atol=ROUNDING)


@given(roll=angles, pitch=st.floats(-1.5, 1.5), yaw=angles)
def test_euler_angles_come_back_from_the_quaternion(roll, pitch, yaw):
    """To 1e-13: pitch within 1.5 rad, so cos(pitch) magnifies rounding at most 14 times."""
    got = np.array(euler_angles(quaternion_from_euler(roll, pitch, yaw)))
    np.testing.assert_allclose(np.sin((got - [roll, pitch, yaw]) / 2), 0.0, atol=1e-13)


@given(a=quaternions, b=quaternions, v=vectors)
def test_a_product_turns_first_by_the_second_factor(a, b, v):
    np.testing.assert_allclose(body_to_ned(multiply(a, b)) @ v, body_to_ned(a) @ (body_to_ned(b) @ v), atol=ROUNDING)
    np.testing.assert_allclose(scipy_rotation(multiply(a, b)).apply(v), body_to_ned(a) @ body_to_ned(b) @ v, atol=1e-14)


@given(q=quaternions, v=vectors)
def test_n_and_body_components_are_each_others_inverse(q, v):
    np.testing.assert_allclose(to_body(q, body_to_ned(q) @ v), v, atol=ROUNDING)
    np.testing.assert_allclose(body_to_ned(conjugate(q)), body_to_ned(q).T, atol=ROUNDING)


@given(q=quaternions, v=vectors)
def test_the_compiled_rotation_is_the_matrix(q, v):
    np.testing.assert_allclose(rotate_by_quaternion(*q, *v), body_to_ned(q) @ v, atol=ROUNDING)


@given(v=vectors, length=st.floats(0.0, 3.14))
def test_a_rotation_vector_survives_the_way_through_its_quaternion(v, length):
    """Up to half a turn, where the vector stops being unique; tiny ones included."""
    norm = np.linalg.norm(v)
    phi = np.zeros(3) if norm < 0.1 else v / norm * length
    np.testing.assert_allclose(rotation_vector(turn(phi)), phi, atol=1e-12)
    np.testing.assert_allclose(body_to_ned(turn(phi)), Rotation.from_rotvec(phi).as_matrix(), atol=ROUNDING)


@given(q=quaternions, angle=st.floats(1e-9, 3.0))
def test_the_angle_between_two_attitudes_is_found_down_to_a_nanoradian(q, angle):
    """An arc cosine would stop near 1e-8 rad; the sine keeps a relative error of rounding over the angle."""
    turned = multiply(q, turn(np.array([0.0, angle, 0.0])))
    assert rotation_error(q, turned) == pytest.approx(angle, rel=1e-12, abs=1e-15)
    assert rotation_error(q, -turned) == pytest.approx(angle, rel=1e-12, abs=1e-15)


@given(u=st.floats(-30, 30), v=st.floats(-30, 30), w=st.floats(-30, 30))
def test_the_heading_frame_holds_the_projected_wind_on_its_x_axis(u, v, w):
    """(A2): V_H = C3(beta) V_B has no y part and u_H >= 0; alpha = atan2(w_H, u_H)."""
    speed = np.linalg.norm([u, v, w])
    assume(speed > 1e-6)  # slower air does nothing
    cos_beta, sin_beta, alpha = heading_angles(u, v, w)
    assert np.hypot(cos_beta, sin_beta) == pytest.approx(1.0, abs=1e-15)
    V_H = C3(np.arctan2(sin_beta, cos_beta)) @ [u, v, w]
    assert abs(V_H[1]) <= 1e-12 * speed
    assert V_H[0] >= -1e-12 * speed
    np.testing.assert_allclose(speed * np.array([np.cos(alpha), np.sin(alpha)]), V_H[[0, 2]], atol=1e-12 * speed)


@pytest.mark.parametrize(("w", "alpha"), [(5.0, np.pi / 2), (-5.0, -np.pi / 2), (0.0, 0.0)])
def test_wind_along_the_axis_leaves_the_heading_frame_on_the_body(w, alpha):
    assert heading_angles(0.0, 0.0, w) == (1.0, 0.0, alpha)


@given(q=quaternions, v=vectors)
def test_mujocos_axes_are_reached_by_two_routes(q, v):
    """Turn in N and flip, or flip everything and let MuJoCo turn: the same vector."""
    by_mujoco = np.empty(3)
    mujoco.mju_rotVecQuat(by_mujoco, flip_yz(v), np.array([q[0], *flip_yz(q[1:])]))
    np.testing.assert_allclose(by_mujoco, flip_yz(body_to_ned(q) @ v), atol=ROUNDING)


def test_mujocos_body_frame_is_the_release_attitude():
    release = throw(roll_deg=-31.0, pitch_deg=17.0, yaw_deg=112.0)
    flying = FlyingDisc(DRIVER, FIELD)
    flying.release(release)
    mujoco.mj_kinematics(flying.model, flying.data)
    matrix = flying.data.body("disc").xmat.reshape(3, 3)
    np.testing.assert_allclose(np.diag(FLIP) @ matrix @ np.diag(FLIP), attitude(release), atol=ROUNDING)


def test_mujocos_magnetometer_reads_the_field_in_body_axes():
    """The sensor is at rest with the disc at the release, so being one step old does not matter."""
    release = throw(roll_deg=-31.0, pitch_deg=17.0, yaw_deg=112.0)
    flying = FlyingDisc(DRIVER, FIELD)
    flying.release(release)
    mujoco.mj_forward(flying.model, flying.data)
    reading = flip_yz(flying.data.sensor("magnetometer").data)
    np.testing.assert_allclose(reading, attitude(release).T @ FIELD.magnetic_field, rtol=1e-13)


def test_the_quaternion_keeps_its_length_over_a_flight():
    """Thousands of steps at 70 rad/s; MuJoCo renormalises, so only rounding is left."""
    motion = fly(DRIVER, FIELD, throw(), duration=2.0)
    np.testing.assert_allclose(np.linalg.norm(motion.attitude, axis=1), 1.0, atol=1e-14)


def test_flipping_twice_changes_nothing():
    v = np.array([1.0, -2.0, 3.0])
    np.testing.assert_array_equal(flip_yz(flip_yz(v)), v)
    with pytest.raises(ValueError, match="read-only"):
        FLIP[0] = 2.0


def test_a_release_in_euler_angles_is_the_attitude_mujoco_starts_from():
    motion = fly(DRIVER, FIELD, throw(roll_deg=-31.0, pitch_deg=17.0, yaw_deg=112.0), duration=0.002)
    np.testing.assert_allclose(np.degrees([a[0] for a in motion.euler_angles]), [-31.0, 17.0, 112.0], atol=1e-12)
