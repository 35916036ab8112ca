"""What both rigs share: a body that turns about a fixed axis, and how a person leans it."""

from __future__ import annotations

from math import atan2, cos, degrees, hypot, radians, sin, sqrt
from typing import Any

from discsim.arrays import FloatArray
from discsim.compiled import compiled
from discsim.effects.rig import axis
from discsim.toml_table import TomlTable
from discsim.validation.identification.plants.plan import towards

__all__ = ["LEAN", "YAW", "leaning", "read_lean", "rig_row_within"]

#: how far a rig's axis is leant, rad; far enough for gravity to show in the disc's plane, and easily done
LEAN = radians(10.0)
#: a rig turns its candidates from this yaw, rad: any
YAW = 0.3


@compiled
def rig_row(p: Any, psi: float, r: float, dr: float, row: FloatArray) -> None:
    """Write a row (19,) of a rig at yaw psi, rate r: z along the axis, turned the short way from straight down."""
    n, e, d = axis(p.rig_axis_tilt)
    row[:9] = 0.0
    # the short way from (0, 0, 1) to the axis: (1 + d, -e, n, 0)
    length = sqrt((1.0 + d) ** 2 + e * e + n * n)
    w, x, y = (1.0 + d) / length, -e / length, n / length
    c, s = cos(0.5 * psi), sin(0.5 * psi)
    row[9], row[10], row[11], row[12] = w * c, x * c + y * s, y * c - x * s, w * s
    row[13], row[14], row[15] = 0.0, 0.0, r
    row[16], row[17], row[18] = 0.0, 0.0, dr


@compiled
def rig_row_within(
    p: Any,
    yaw: float,
    turned: float,
    ends: tuple[float, float, float, float],
    h: float,
    x: float,
    row: FloatArray,
) -> None:
    """Write a row (19,) of a rig x s into a step of h s: Hermite's cubic of the rate, and its integral.

    ``ends`` are rate and slope at the step's start, then at its end; the rig's yaw at the start is yaw + turned.
    """
    a, first, b, last = ends
    s, da, db = x / h, h * first, h * last
    second, third = 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db
    rate = a + s * (da + s * (second + s * third))
    angle = turned + x * (a + s * (da / 2.0 + s * (second / 3.0 + s * third / 4.0)))
    rig_row(p, yaw + angle, rate, (da + s * (2.0 * second + 3.0 * s * third)) / h, row)


def leaning(lean: tuple[float, float]) -> str:
    """Return in words how far a rig is leant to north and east, rad; nothing where it is not."""
    size = hypot(*lean)
    if size == 0.0:
        return ""
    return (
        f", the rig leant so that its axis points {degrees(size):.0f}° off the vertical, {towards(atan2(*lean[::-1]))}"
    )


def read_lean(table: TomlTable) -> tuple[float, float]:
    """Return how far a rig of a person's own plan is leant to north and east, rad."""
    north, east = (table.number(f"tilt_{way}", "rad", required=False) or 0.0 for way in ("north", "east"))
    return north, east
