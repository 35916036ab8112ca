"""Release conditions as disc-golf literature measures them, turned into roll and pitch of the paper.

The words are those of K.E.T. Giljarhus, M.T. Gooding, J. Njaerheim, Sports Engineering 25:26 (2022) and of the
authors' program. All angles are seen by the thrower, with x down range, y left, z up:

- pitch: launch angle, of the velocity above the horizon;
- yaw: heading of the velocity to the left of down range, which turns the whole throw about the vertical;
- roll: positive with the left edge low;
- nose: nose up against the flight direction, so zero lets the velocity lie in the disc's plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Release
from discsim.toml_table import TomlTable

__all__ = ["MeasuredThrow"]


@dataclass(frozen=True)
class MeasuredThrow:
    """A throw as measured at release, SI and radians; ``sigma`` has the one-sigma of each, in the same order.

    Attributes
    ----------
    conditions : (5,) array
        Speed, pitch, yaw, roll, nose.
    sigma : (5,) array
        Their one-sigma uncertainties.
    spin, spin_sigma : float
        Rate about the disc's axis, clockwise seen from above if positive.
    wobble_sigma : float
        One-sigma of the two other body rates, which were not measured; they are taken as zero.
    height, height_sigma : float
        Of the centre of mass above ground.
    """

    conditions: FloatArray
    sigma: FloatArray
    spin: float
    spin_sigma: float
    wobble_sigma: float
    height: float
    height_sigma: float

    @classmethod
    def from_toml(cls, table: TomlTable) -> MeasuredThrow:
        """Read a ``[throws.STEM]`` table; every quantity needs its sigma, as none of them is exact."""
        keys = (("speed", "m_s"), ("pitch", "deg"), ("yaw", "deg"), ("roll", "deg"), ("nose", "deg"))
        values = [table.need(stem, unit) for stem, unit in keys]
        spin, height = table.need("spin", "rad_s"), table.need("height", "m", positive=True)
        wobble_sigma = table.need("wobble_sigma", "rad_s", minimum=0.0)
        table.finish()
        for stem, unit in (*keys, ("spin", "rad_s"), ("height", "m")):
            if f"{stem}_{unit}" not in table.sigma:
                raise table.error(None, f"missing key '{stem}_sigma_{unit}' in [{table.name}]; expected a number")
        sigma = {key: float(np.max(value)) for key, value in table.sigma.items()}
        to_si = np.array([1.0, *[np.pi / 180] * 4])
        return cls(
            readonly(to_si * values),
            readonly(to_si * [sigma[f"{stem}_{unit}"] for stem, unit in keys]),
            spin,
            sigma["spin_rad_s"],
            wobble_sigma,
            height,
            sigma["height_m"],
        )

    def release(self, north: float, east: float, horizontal_sigma: float) -> Release:
        """Return the release at a place in the plan, with the uncertainties carried over to first order.

        Correlations between velocity and attitude (the yaw angle is in both) are lost: a recording states
        one-sigma figures only. The spin phase, which the paper calls yaw, stays unknown.
        """
        state = _state(self.conditions)
        step = 1e-6
        slopes = [
            (_state(self.conditions + step * unit) - _state(self.conditions - step * unit)) / (2 * step)
            for unit in np.eye(5)
        ]
        sigma = np.sqrt(np.sum([(s * slope) ** 2 for s, slope in zip(self.sigma, slopes, strict=True)], axis=0))
        return Release(
            position=readonly([north, east, -self.height]),
            velocity=readonly(state[:3]),
            roll=float(state[3]),
            pitch=float(state[4]),
            yaw=None,
            body_rate=readonly([0.0, 0.0, self.spin]),
            sigma={
                "position_ned_m": readonly([horizontal_sigma, horizontal_sigma, self.height_sigma]),
                "velocity_ned_m_s": readonly(sigma[:3]),
                "roll_rad": float(sigma[3]),
                "pitch_rad": float(sigma[4]),
                "body_rate_rad_s": readonly([self.wobble_sigma, self.wobble_sigma, self.spin_sigma]),
            },
        )


def _state(conditions: FloatArray) -> FloatArray:
    """Return velocity North-East-Down (m/s), roll and pitch (rad) of (A1), as one (5,) array; north is down range.

    The source's program tilts the disc by phi about x (left edge down), then by theta about its own left-hand axis
    (nose up), with theta = nose + pitch cos(roll) and phi = roll + pitch sin(roll) sin(nose), and turns the throw by
    yaw afterwards. Its disc's axis, up, is n = (-sin theta, sin phi cos theta, cos phi cos theta) before that turn.
    In (A1) the axis z_B, down, is (sin theta, -cos theta sin phi, cos theta cos phi) in North-East-Down, from which
    pitch and roll follow.
    """
    speed, pitch, yaw, roll, nose = conditions
    level, turned = np.cos(pitch), (np.cos(yaw), np.sin(yaw))
    velocity = speed * np.array([level * turned[0], -level * turned[1], -np.sin(pitch)])
    theta = nose + pitch * np.cos(roll)
    phi = roll + pitch * np.sin(roll) * np.sin(nose)
    ahead, left, up = -np.sin(theta), np.sin(phi) * np.cos(theta), np.cos(phi) * np.cos(theta)
    axis_north, axis_west = turned[0] * ahead - turned[1] * left, turned[1] * ahead + turned[0] * left
    z_B = np.array([-axis_north, axis_west, up])
    return np.array([*velocity, np.arctan2(-z_B[1], z_B[2]), np.arcsin(np.clip(z_B[0], -1, 1))])
