"""Force and moment of the air on a free joint of MuJoCo, and the same as a C function that needs no Python.

On a free joint force is in world axes and acts at the body's origin, the geometric centre here; moment is in body axes
about it.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from discsim.aerodynamics import total_wrench, wind
from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_address, inlined
from discsim.effects.body import centre_of_mass
from discsim.effects.events import impulse, spin_step
from discsim.frames import norm3, rotate_by_quaternion
from discsim.law import LAW_WIDTH
from discsim.native import FORCE_SIGNATURE, NativeForce, at, carray
from discsim.parameters import PARAMETERS, AngleTables, Tables

__all__ = ["LOST", "flight_force", "native_force"]

_WIDTH = PARAMETERS.itemsize // 8


@inlined
def _flow(
    p: Any, tables: Tables, t: float, qpos: FloatArray, qvel: FloatArray
) -> tuple[float, float, float, float, float, float, float]:
    """Height of the centre of mass, its velocity relative to the air in B, and the body rates, of a free joint."""
    # MuJoCo's axes to N and B: (x, y, z) -> (x, -y, -z)
    qw, qx, qy, qz = qpos[3], qpos[4], -qpos[5], -qpos[6]
    P, Q, r = qvel[3], -qvel[4], -qvel[5]
    ex, ey, ez = centre_of_mass(p.body_mass_imbalance)
    cn, ce, cd = rotate_by_quaternion(qw, qx, qy, qz, ex, ey, ez)
    h = qpos[2] - cd
    sn, se, sd = rotate_by_quaternion(qw, qx, qy, qz, Q * ez - r * ey, r * ex - P * ez, P * ey - Q * ex)
    wn, we, wd = wind(p, tables, t, qpos[0] + cn, -qpos[1] + ce, h)
    u, v, w = rotate_by_quaternion(qw, -qx, -qy, -qz, qvel[0] + sn - wn, -qvel[1] + se - we, -qvel[2] + sd - wd)
    return h, u, v, w, P, Q, r


@compiled
def airspeed(flat: FloatArray, tables: Tables, t: float, qpos: FloatArray, qvel: FloatArray) -> float:
    """Speed of the centre of mass through the air, m/s."""
    _, u, v, w, _, _, _ = _flow(flat.view(PARAMETERS)[0], tables, t, qpos, qvel)
    return float(norm3(u, v, w))


@inlined
def flight_force(
    flat: FloatArray, tables: Tables, t: float, qpos: FloatArray, qvel: FloatArray, qfrc: FloatArray
) -> bool:
    """Add the air and the events to a free joint's forces (6,); return False where a C_Nr table does not reach."""
    p = flat.view(PARAMETERS)[0]
    h, u, v, w, P, Q, r = _flow(p, tables, t, qpos, qvel)
    Fx, Fy, Fz, Mx, My, Mz = total_wrench(p, tables, t, h, u, v, w, P, Q, r)

    # a push through the centre of mass; about the geometric centre it has a moment
    qw, qx, qy, qz = qpos[3], qpos[4], -qpos[5], -qpos[6]
    ex, ey, ez = centre_of_mass(p.body_mass_imbalance)
    an, ae, ad = impulse(p.event_impulse, t)
    bx, by, bz = rotate_by_quaternion(qw, -qx, -qy, -qz, an, ae, ad)
    m = p.disc.mass
    Fx, Fy, Fz = Fx + m * bx, Fy + m * by, Fz + m * bz
    Mx, My, Mz = Mx + m * (ey * bz - ez * by), My + m * (ez * bx - ex * bz), Mz + m * (ex * by - ey * bx)
    Mz += p.disc.Izz * spin_step(p.event_spin_step, t, r)

    Fn, Fe, Fd = rotate_by_quaternion(qw, qx, qy, qz, Fx, Fy, Fz)
    qfrc[0] += Fn
    qfrc[1] -= Fe
    qfrc[2] -= Fd
    qfrc[3] += Mx
    qfrc[4] -= My
    qfrc[5] -= Mz
    return not np.isnan(Mz)


#: places of the record of a native force: its own address, those of the flat parameters and of the fields of `Tables`,
#: each followed by its lengths where they are not fixed
_SELF, _FLAT, _COLUMNS, _ANGLES, _ROLLING, _RATIOS, _ROLLED, _RATE, _RATES, _SPEED, _SPEEDS, _SPLINE = range(12)
_LAW, _TERMS, _CALLS, _OWN, _SIZES, _SIZED, _LOST, _RECORD = range(12, 20)
#: what a force leaves behind where it had no finite answer, the first time: 1, and time s, spin rad/s, airspeed m/s
LOST = 4


def _force(record: int, t: float, qpos: int, qvel: int, qfrc: int) -> int:
    """Be a function of `FORCE_SIGNATURE`: rebuild the arrays from their addresses and call `flight_force`."""
    word = carray(at(record), (_RECORD,), np.int64)
    flat = carray(at(word[_FLAT]), (_WIDTH,), np.float64)
    nr, nv = word[_RATES], word[_SPEEDS]
    static = AngleTables(
        carray(at(word[_COLUMNS]), (4, word[_ANGLES]), np.float64),
        carray(at(word[_ROLLING]), (word[_RATIOS], word[_ROLLED]), np.float64),
    )
    tables = Tables(
        static,
        carray(at(word[_RATE]), (nr,), np.float64),
        carray(at(word[_SPEED]), (nv,), np.float64),
        carray(at(word[_SPLINE]), (max(nr - 1, 0), max(nv - 1, 0), 4, 4), np.float64),
        carray(at(word[_LAW]), (word[_TERMS], LAW_WIDTH), np.float64),
        carray(at(word[_CALLS]), (word[_OWN],), np.int64),
        carray(at(word[_SIZES]), (word[_OWN], word[_SIZED]), np.float64),
    )
    pose, speed = carray(at(qpos), (7,), np.float64), carray(at(qvel), (6,), np.float64)
    if flight_force(flat, tables, t, pose, speed, carray(at(qfrc), (6,), np.float64)):
        return 1
    lost = carray(at(word[_LOST]), (LOST,), np.float64)
    if lost[0] == 0.0:
        lost[0], lost[1], lost[2], lost[3] = 1.0, t, speed[5], airspeed(flat, tables, t, pose, speed)
    return 0


@cache
def _force_address() -> int:
    return compiled_address(_force, FORCE_SIGNATURE)


def native_force(flat: FloatArray, tables: Tables, lost: FloatArray) -> NativeForce:
    """Return the force of a flight for MuJoCo's callback, with the flat parameters as they are when it is called.

    ``lost`` (LOST,) says afterwards whether and where it had no finite answer.
    """
    arrays = (flat, *tables.static, *tables[1:], lost)
    _, columns, rolling, rate, speed, _, law, calls, sizes, _ = arrays
    start = [array.ctypes.data for array in arrays]
    record = np.array(
        [
            _force_address(),
            start[0],
            *(start[1], columns.shape[1]),
            *(start[2], *rolling.shape),
            *(start[3], rate.size),
            *(start[4], speed.size),
            start[5],
            *(start[6], law.shape[0]),
            *(start[7], calls.size),
            *(start[8], sizes.shape[1]),
            start[9],
        ],
        dtype=np.int64,
    )
    return NativeForce(record, arrays)
