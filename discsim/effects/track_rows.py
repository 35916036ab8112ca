"""What a track from a camera gets wrong: a picture from above puts what flies too far out (parallax).

Takes positions; gives where a plan drawn from the picture has them.
"""

from __future__ import annotations

from math import inf
from typing import NamedTuple, TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.kind import FLIGHT, Regular, Row

__all__ = ["ROWS", "Camera", "Parallax", "camera_of", "parallax_of", "pictured"]

#: of the camera's height, what is at least left between it and the disc: nearer to it, and above, there is no picture
NEAREST = 0.05
#: curvature that stands for a camera at infinity, 1/m: one at 1000 km
_FARTHEST = 1e-6


class Camera(NamedTuple):
    """A camera at a height above ground, above the place (north, east), whose pictures became a plan (track.camera)."""

    height_m: float = inf
    north_m: float = 0.0
    east_m: float = 0.0


class Parallax(NamedTuple):
    """The same in numbers that are regular where the camera is far away: (1, north_m, east_m) / height_m."""

    curvature_1_m: float = 0.0
    north: float = 0.0
    east: float = 0.0


#: either of the two: sensors hold the one, fits move the other
Picture: TypeAlias = Camera | Parallax


def parallax_of(camera: Camera) -> Parallax:
    """Return a camera in the numbers that a fit moves."""
    return Parallax(1.0 / camera.height_m, camera.north_m / camera.height_m, camera.east_m / camera.height_m)


def camera_of(parallax: Parallax) -> Camera:
    """Return the camera of numbers that a fit has moved; a negative curvature stands for one far away."""
    height = 1.0 / max(parallax.curvature_1_m, _FARTHEST)
    return Camera(height, parallax.north * height, parallax.east * height)


def pictured(effect: Picture, position: FloatArray) -> FloatArray:
    """Return the positions (..., 3) m in N that a plan from the picture has of ``position``.

    What is at height h above ground stands at ``nadir + (true - nadir) / (1 - h / height_m)`` there, nadir the point
    under the camera. A height that another camera has measured stays.
    """
    if effect == type(effect)():
        return position
    curvature, north, east = effect if isinstance(effect, Parallax) else parallax_of(effect)
    h = -position[..., 2:]
    outward = h / np.maximum(1.0 - curvature * h, NEAREST)
    moved: FloatArray = np.array(position, dtype=np.float64)
    moved[..., :2] += outward * (curvature * position[..., :2] - np.array([north, east]))
    return moved


ROWS = (
    Row(
        "track.camera",
        Camera,
        "track",
        FLIGHT,
        (60.0, 10.0, 10.0),
        setup=True,
        title="a camera that sees what flies too far out (parallax)",
        form="plan = nadir + (true − nadir) / (1 − h / {height_m}), nadir {north_m} north, {east_m} east; h the height",
        grows_with="height times distance from the camera's foot",
        trace="the track runs outward from the point under the camera, more so the higher the disc flies",
        bounds={"curvature_1_m": (-0.01, 0.1)},
        sign={"curvature_1_m": 1.0},
        positive=("height_m",),
        regular=Regular(Parallax, (1e-4, 5e-3, 5e-3), camera_of),
    ),
)
