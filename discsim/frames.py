"""Frames and rotations: roll-pitch-yaw order (A1), heading frame (A2), and MuJoCo's axes.

N is North-East-Down, B is body (x forward, y right, z down through the disc), H is B turned by beta so that x_H
holds the projected relative wind. MuJoCo is z-up: it works in North-West-Up and forward-left-up, and
``diag(1, -1, -1)`` maps both ways. Only this module knows both.

A quaternion is (w, x, y, z) with w first and rotates body components into N: ``v_N = C_NB v_B``.
"""

from __future__ import annotations

from math import atan2, cos, sin, sqrt

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import FloatArray
from discsim.compiled import compiled

__all__ = [
    "C1",
    "C2",
    "C3",
    "FLIP",
    "attitude_matrix",
    "body_to_ned",
    "euler_angles",
    "flip_yz",
    "heading_angles",
    "multiply",
    "nearest_rotations",
    "quaternion_from_euler",
    "quaternion_from_matrix",
    "rotation_error",
    "rotation_vector",
    "to_body",
    "turn",
]

#: (x, y, z) -> (x, -y, -z): North-East-Down <-> North-West-Up, and forward-right-down <-> forward-left-up
FLIP = np.array([1.0, -1.0, -1.0])
FLIP.setflags(write=False)


def C1(angle: float) -> FloatArray:
    """Rotation about x, (A1), (3, 3); angle in rad."""
    c, s = cos(angle), sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def C2(angle: float) -> FloatArray:
    """Rotation about y, (A1), (3, 3); angle in rad."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def C3(angle: float) -> FloatArray:
    """Rotation about z, (A1), (3, 3); angle in rad."""
    c, s = cos(angle), sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def attitude_matrix(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return C_BN = C3(yaw) C2(pitch) C1(roll): N components to B components, (3, 3)."""
    return C3(yaw) @ C2(pitch) @ C1(roll)


def quaternion_from_matrix(C_NB: ArrayLike) -> FloatArray:
    """Return the unit quaternion (4,) of a body-to-N matrix (3, 3)."""
    m = np.asarray(C_NB, dtype=float)
    # the largest of the four candidates keeps the divisor away from zero
    squares = np.array(
        [
            1 + m[0, 0] + m[1, 1] + m[2, 2],
            1 + m[0, 0] - m[1, 1] - m[2, 2],
            1 - m[0, 0] + m[1, 1] - m[2, 2],
            1 - m[0, 0] - m[1, 1] + m[2, 2],
        ]
    )
    k = int(np.argmax(squares))
    q = np.empty(4)
    q[k] = squares[k]
    if k == 0:
        q[1], q[2], q[3] = m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    elif k == 1:
        q[0], q[2], q[3] = m[2, 1] - m[1, 2], m[1, 0] + m[0, 1], m[0, 2] + m[2, 0]
    elif k == 2:
        q[0], q[1], q[3] = m[0, 2] - m[2, 0], m[1, 0] + m[0, 1], m[2, 1] + m[1, 2]
    else:
        q[0], q[1], q[2] = m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[2, 1] + m[1, 2]
    return np.asarray(q / np.linalg.norm(q))


def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Return the quaternion (4,) of an attitude given in the paper's order."""
    return quaternion_from_matrix(attitude_matrix(roll, pitch, yaw).T)


def body_to_ned(q: FloatArray) -> FloatArray:
    """Return C_NB (..., 3, 3) of quaternions (..., 4)."""
    w, x, y, z = (q[..., i] for i in range(4))
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def to_body(q: FloatArray, v_ned: ArrayLike) -> FloatArray:
    """Return v_B (..., 3) of N vectors (3,) or (..., 3) at attitudes q (..., 4)."""
    v = np.asarray(v_ned, dtype=float)
    w, x, y, z = (q[..., i] for i in range(4))
    a, b, c = (v[..., i] for i in range(3))
    # v' = v + 2 w (v x q) + 2 q x (q x v), the inverse turn
    tx, ty, tz = 2 * (b * z - c * y), 2 * (c * x - a * z), 2 * (a * y - b * x)
    return np.stack(
        [a + w * tx + (ty * z - tz * y), b + w * ty + (tz * x - tx * z), c + w * tz + (tx * y - ty * x)], axis=-1
    )


def euler_angles(q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll, pitch, yaw (...,) in rad of quaternions (..., 4), order C3(yaw) C2(pitch) C1(roll).

    Pitch lies in -pi/2..pi/2; at its ends roll and yaw are not unique and roll is given as found.
    """
    C = np.swapaxes(body_to_ned(q), -1, -2)
    # C_BN[2] = (sin(pitch), -cos(pitch) sin(roll), cos(pitch) cos(roll)); C_BN[:2, 0] = cos(pitch) (cos, -sin)(yaw)
    pitch = np.arctan2(C[..., 2, 0], np.hypot(C[..., 2, 1], C[..., 2, 2]))
    roll = np.arctan2(-C[..., 2, 1], C[..., 2, 2])
    yaw = np.arctan2(-C[..., 1, 0], C[..., 0, 0])
    return roll, pitch, yaw


def multiply(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the quaternion product a b (..., 4): first b, then a, on body components."""
    aw, ax, ay, az = (a[..., i] for i in range(4))
    bw, bx, by, bz = (b[..., i] for i in range(4))
    product = np.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        axis=-1,
    )
    return np.asarray(product)


def turn(vector: FloatArray) -> FloatArray:
    """Return the quaternion (..., 4) of a rotation vector (..., 3) in rad."""
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    # np.sinc(x) = sin(pi x)/(pi x), finite at zero
    return np.asarray(np.concatenate([np.cos(angle / 2), 0.5 * np.sinc(angle / (2 * np.pi)) * vector], axis=-1))


def rotation_vector(q: FloatArray) -> FloatArray:
    """Return the rotation vector (..., 3), rad, of length <= pi, of quaternions (..., 4)."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., :1])
    factor = np.where(sine > 1e-12, 2 * half / np.where(sine > 1e-12, sine, 1.0), 2.0)
    return np.asarray(factor * q[..., 1:])


def conjugate(q: FloatArray) -> FloatArray:
    """Return the inverse of unit quaternions (..., 4)."""
    return np.multiply(q, [1.0, -1.0, -1.0, -1.0])


def nearest_rotations(K: FloatArray) -> FloatArray:
    """Return the rotations (..., 3, 3) nearest to matrices (..., 3, 3), sums of outer products a b: they take b to a.

    So Wahba's problem (SIAM Review 7, 1965) is solved by singular values (Kabsch, Acta Crystallogr. A32:922, 1976).

    >>> nearest_rotations(2.0 * np.eye(3)) @ np.array([1.0, 2.0, 3.0])
    array([1., 2., 3.])
    """
    U, _, Vt = np.linalg.svd(K)
    U[..., 2] *= np.linalg.det(U @ Vt)[..., None]
    return np.asarray(U @ Vt)


def rotation_error(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the angle (...,) in rad between attitudes a and b (..., 4)."""
    return np.asarray(np.linalg.norm(rotation_vector(multiply(conjugate(a), b)), axis=-1))


def flip_yz(v: ArrayLike) -> FloatArray:
    """Map vectors (..., 3) between N or B and MuJoCo's axes; of a quaternion pass its vector part."""
    return np.asarray(np.multiply(v, FLIP), dtype=np.float64)


@compiled
def heading_angles(u: float, v: float, w: float) -> tuple[float, float, float]:
    """Return cos(beta), sin(beta), alpha of a relative velocity (u, v, w) in a frame with z = z_B, (A2).

    ``beta = atan2(v, u)`` and ``alpha = atan2(w_H, u_H)`` with u_H = hypot(u, v) >= 0, so alpha runs from -pi/2 to
    pi/2. Where the wind is along z_B, beta is undefined and taken as zero: x_H is then x.
    """
    across = sqrt(u * u + v * v)
    if across < 1e-12 * (abs(w) + 1e-300):
        return 1.0, 0.0, atan2(w, 0.0)
    return u / across, v / across, atan2(w, across)


@compiled
def rotate_by_quaternion(
    qw: float, qx: float, qy: float, qz: float, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return C_NB v: components (x, y, z) in B to N."""
    tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + qw * tx + qy * tz - qz * ty,
        y + qw * ty + qz * tx - qx * tz,
        z + qw * tz + qx * ty - qy * tx,
    )


@compiled
def norm3(x: float, y: float, z: float) -> float:
    """Length of a vector."""
    return sqrt(x * x + y * y + z * z)
