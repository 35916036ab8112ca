"""Effects of how one sensor sits on its board: its axes turned in it, or, of a gyroscope, not square to one another.

A whole board that is turned is `board.rotation` (`discsim.effects.setup`).
"""

from __future__ import annotations

from typing import NamedTuple

from discsim.arrays import FloatArray
from discsim.effects.kind import EVERYWHERE, Row, with_article
from discsim.effects.sensors import CrossAxis, Scale, sensitivity
from discsim.effects.setup import BoardRotation, on_board
from discsim.motion import State

__all__ = ["ROWS", "Mount", "gyroscope_cross_axis", "turned_in_board"]


class Mount(NamedTuple):
    """One sensor's axes turned in the board by a rotation vector (mag.mount, gyro.mount, accel.mount)."""

    rx_rad: float = 0.0
    ry_rad: float = 0.0
    rz_rad: float = 0.0


def turned_in_board(effect: Mount, readings: FloatArray, t: FloatArray, motion: State) -> FloatArray:
    """Return readings (n, 3) along the axes of the turned sensor, ``C^T v``."""
    del t, motion
    return on_board(BoardRotation(*effect), readings)


def gyroscope_cross_axis(effect: CrossAxis, readings: FloatArray, t: FloatArray, motion: State) -> FloatArray:
    """Return rates (n, 3) rad/s of which each axis shows a share of the others, as in Eq. (4)."""
    del t, motion
    return readings @ sensitivity(Scale(), effect).T


def _mount(prefix: str, sensor: str) -> Row:
    return Row(
        f"{prefix}.mount",
        Mount,
        sensor,
        EVERYWHERE,
        (1e-3, 1e-3, 1e-3),
        title=f"{with_article(sensor)} turned in its board",
        form="v → Cᵀ v, C the rotation by ({rx_rad}, {ry_rad}, {rz_rad}), of this sensor alone",
        grows_with="reading on another axis",
        trace="one sensor's axes are not those of the others",
        bounds=dict.fromkeys(Mount._fields, (-0.5, 0.5)),
        apply=turned_in_board,
        in_all=True,
    )


ROWS = (
    _mount("mag", "magnetometer"),
    _mount("gyro", "gyroscope"),
    _mount("accel", "accelerometer"),
    Row(
        "gyro.cross_axis",
        CrossAxis,
        "gyroscope",
        EVERYWHERE,
        (0.0005,) * 6,
        title="cross-axis sensitivity of the gyroscope",
        form="ω → (I + S) ω, S: xy {sxy}, xz {sxz}, yx {syx}, yz {syz}, zx {szx}, zy {szy}",
        grows_with="rate about another axis",
        trace="one axis shows a share of another",
        in_percent=True,
        apply=gyroscope_cross_axis,
        in_all=True,
    ),
)
