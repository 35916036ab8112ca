"""All parameters of the physics in one flat array, and names for its places.

Both engines, and later every fit, hand the compiled physics one float64 array. `PARAMETERS` gives its structure: the
environment, the disc, the rig, and one group per catalogued effect on motion that the physics knows by name, all at
their baseline unless changed.
Inside compiled code ``array.view(PARAMETERS)[0]`` is a record whose fields read like the equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, IntArray
from discsim.disc import Aero, Disc, Rig
from discsim.effects.catalogue import CATALOGUE, Effect, by_id
from discsim.environment import Environment
from discsim.errors import InputError, require_type
from discsim.law import LAW_WIDTH, MOTION_TARGETS, Law

__all__ = ["PARAMETERS", "AngleTables", "Tables", "flight_parameters", "parameter_index", "parameters", "tables"]


#: effects that the compiled physics knows by name; others are called by address
_MOTION = tuple(row for row in CATALOGUE.values() if row.acts_on == "motion" and row.apply is None)


def _group(names: Sequence[str]) -> np.dtype[np.void]:
    return np.dtype([(name, np.float64) for name in names])


PARAMETERS = np.dtype(
    [
        ("environment", _group(("gravity", "air_density", "wind_north", "wind_east", "wind_down"))),
        ("disc", _group(("mass", "d", "Ixx", "Izz"))),
        ("aero", _group(Aero._fields)),
        ("rig", _group(("Izz", "viscous"))),
        *((row.key, _group(row.parameters)) for row in _MOTION),
    ]
)


def _places() -> dict[str, slice]:
    """Return where in the flat array each group stands."""
    starts = {name: PARAMETERS.fields[name][1] // 8 for name in PARAMETERS.names or ()}  # type: ignore[index]
    return {name: slice(start, start + PARAMETERS[name].itemsize // 8) for name, start in starts.items()}


_PLACES = _places()
#: no environment, disc or rig, and every effect at its baseline
_BASELINE = np.zeros(PARAMETERS.itemsize // 8)
for _row in _MOTION:
    _BASELINE[_PLACES[_row.key]] = _row.baseline


def parameter_index(group: str, name: str) -> int:
    """Return the place of ``group.name`` in the flat array; group is an effect's id or environment, disc, aero, rig."""
    key = group.replace(".", "_")
    try:
        offset = PARAMETERS.fields[key][1] + PARAMETERS[key].fields[name][1]  # type: ignore[index]
    except KeyError:
        raise KeyError(f"no parameter '{name}' of '{group}'") from None
    return offset // 8


def parameters(
    environment: Environment, disc: Disc | None = None, rig: Rig | None = None, effects: Sequence[Effect] = ()
) -> FloatArray:
    """Return the flat array (PARAMETERS.itemsize / 8,) of a baseline with effects on it.

    Effects on sensors are passed over: they belong to the sensors. So are those that are called by their row's
    function: they stand in `tables`. Raises `InputError` for an effect given twice.
    """
    flat = _BASELINE.copy()
    density = environment.air_density
    flat[_PLACES["environment"]] = (
        environment.gravity,
        0.0 if density is None else density,
        *environment.wind.tolist(),
    )
    if disc is not None:
        flat[_PLACES["disc"]] = (disc.mass, disc.diameter, disc.Ixx, disc.Izz)
        flat[_PLACES["aero"]] = disc.aero or Aero()
    if rig is not None:
        flat[_PLACES["rig"]] = (rig.Izz, rig.viscous)
    by_id(effects)
    for item in effects:
        if item.own is None and (place := _PLACES.get(item.row.key)) is not None:
            flat[place] = item.value
    if not np.all(np.isfinite(flat)):
        raise InputError("a parameter of the physics is not finite; expected finite numbers only")
    return flat


def flight_parameters(disc: Disc, environment: Environment, effects: Sequence[Effect] = ()) -> FloatArray:
    """Return the flat array of a flight; raises `InputError` where the disc has no coefficients or the place no air."""
    require_type(disc, Disc, "disc", "a Disc: load_disc(NAME) returns a disc and its environment, a pair")
    require_type(environment, Environment, "environment", "an Environment, the second of what load_disc(NAME) returns")
    if disc.aero is None:
        raise InputError("a flight needs the disc's aerodynamic coefficients; expected [disc.aero]")
    if environment.air_density is None:
        raise InputError("a flight needs air; expected air_density_kg_m3 in [environment]")
    return parameters(environment, disc, effects=effects)


class AngleTables(NamedTuple):
    """Coefficients tabulated over the angle of attack, rad, each empty where the linear form holds.

    columns is (4, n): alpha, C_L, C_D, C_M. rolling (2 + ng, 1 + na) are the tables of the rolling moment (16) in one
    array, for each array that is passed costs a step of the truth a microsecond: behind the first column stand alpha,
    C_Rp (NaN where it is no table) and C_Rr at each of the advance ratios of that column, which start with zero.
    """

    columns: FloatArray
    rolling: FloatArray


class Tables(NamedTuple):
    """What compiled code needs beside the flat parameters: tabulated coefficients, empty where the linear forms hold.

    static are those over the angle of attack. rate (nr,) rad/s and speed (nv,) m/s are the knots of C_Nr, and spline
    (nr - 1, nv - 1, 4, 4) its bicubic coefficients, highest powers first. law (terms, LAW_WIDTH) are the rows of a
    `discsim.law.Law`. own_calls (m,) int64 are the addresses of effects on motion that are called, and own_sizes (m, k)
    their parameters, for `discsim.own_wrench`.
    """

    static: AngleTables
    rate: FloatArray
    speed: FloatArray
    spline: FloatArray
    law: FloatArray
    own_calls: IntArray
    own_sizes: FloatArray


def _angle_tables(disc: Disc | None) -> AngleTables:
    columns, rolling = np.empty((4, 0)), np.full((2, 1), np.nan)
    if disc is not None and (lookup := disc.aero_table) is not None:
        columns = np.stack([lookup.alpha, lookup.CL, lookup.CD, lookup.CM])
    if disc is not None and (table := disc.rolling_table) is not None:
        rows = [table.alpha, np.full(table.alpha.size, np.nan) if table.CRp is None else table.CRp]
        heads = [np.nan, np.nan]
        if table.CR is not None and table.advance_ratio is not None:
            rows += [np.zeros(table.alpha.size), *table.CR.T]
            heads += [0.0, *table.advance_ratio]
        rolling = np.column_stack([heads, rows])
    return AngleTables(columns, np.ascontiguousarray(rolling))


def tables(disc: Disc | None, law: Law | Sequence[Law] | None = None, effects: Sequence[Effect] = ()) -> Tables:
    """Return the tables of a disc, of a law or laws about motion (not of those about a sensor), and of own effects."""
    static = _angle_tables(disc)
    rate, speed, spline = np.empty(0), np.empty(0), np.empty((0, 0, 4, 4))
    if disc is not None and (damping := disc.yaw_damping_table) is not None:
        from scipy.interpolate import CubicSpline  # loads in a third of a second, and few discs have this table

        rate, speed = np.array(damping.rate), np.array(damping.speed)
        along_rate = CubicSpline(rate, damping.CNr, axis=0).c  # (4, nr - 1, nv)
        along_both = CubicSpline(speed, along_rate, axis=2).c  # (4, nv - 1, 4, nr - 1)
        spline = np.ascontiguousarray(np.transpose(along_both, (3, 1, 2, 0)))
    laws = [law] if isinstance(law, Law) else law or ()
    for each in laws:
        require_type(each, Law, "law", "a Law(text, target, coefficients), or a list of them")
    if disc is not None and any(each.about_a_rig for each in laws):
        raise InputError("law: yaw is the angle of a rig; expected none of it in a law upon a disc in the air")
    rows = np.concatenate([np.empty((0, LAW_WIDTH)), *(each.rows for each in laws if each.target in MOTION_TARGETS)])
    own = [(one.address, item.value) for item in effects if item.row.acts_on == "motion" and (one := item.applied)]
    sizes = np.zeros((len(own), max((len(value) for _, value in own), default=0)))
    for place, (_, value) in zip(sizes, own, strict=True):
        place[: len(value)] = value
    calls = np.array([address for address, _ in own], dtype=np.int64)
    return Tables(static, rate, speed, spline, rows, calls, sizes)
