"""The torque of a bearing on a rig that runs down: called by MuJoCo's rig and by what identifies one."""

from __future__ import annotations

from typing import Any

from discsim.compiled import inlined
from discsim.effects.rig import coulomb_friction, quadratic_drag
from discsim.law import law_wrench
from discsim.own_wrench import own_wrench
from discsim.parameters import Tables

__all__ = ["bearing_torque"]


@inlined
def bearing_torque(p: Any, tables: Tables, t: float, yaw: float, r: float) -> float:
    """Torque about the axis, N m: ``-viscous r`` and what a baseline leaves out but events, at t s, rad and rad/s."""
    torque = -p.rig.viscous * r + coulomb_friction(p.rig_coulomb_friction, r)
    torque += quadratic_drag(p.rig_quadratic_drag, r)
    if tables.law.shape[0] > 0:
        torque += law_wrench(tables.law, t, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, r, yaw)[5]
    if tables.own_calls.size > 0:
        torque += own_wrench(tables.own_calls, tables.own_sizes, t, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, r)[5]
    return float(torque)
