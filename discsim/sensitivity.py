"""How a predicted flight depends on its release and on any parameter: derivatives of the state over time.

Each column is a central difference of two flights that take the very steps of the unperturbed one. With the steps
frozen a flight is a smooth function of its release and parameters, so the difference shows no noise of step control.
Variational equations would cost the same, one right-hand side per column and stage, and need a Jacobian of the air,
which tables and effects do not offer; a one-sided difference costs half but errs by 1e-5 and more where the flight is
curved.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled_nogil
from discsim.dormand_prince import evaluate, interpolant, step
from discsim.effects.catalogue import CATALOGUE
from discsim.errors import InputError
from discsim.flight_equations import WIDTH, copied, derivative, in_body
from discsim.frames import conjugate, multiply, rotation_vector, turn
from discsim.parameters import PARAMETERS, Tables, parameter_index
from discsim.trajectory import Flight

__all__ = ["RELEASE_COLUMNS", "Sensitivity", "sensitivities"]

#: release state, in the order of the rows of a derivative: N, N, small rotation in B, body rates in B
RELEASE_COLUMNS = (
    *(f"position_{axis}" for axis in "ned"),
    *(f"velocity_{axis}" for axis in "ned"),
    *(f"attitude_{axis}" for axis in "xyz"),
    *("p", "q", "r"),
)
#: longest step of a neighbour, in radians of nutation: a flight that does not wobble takes steps in which one that
#: does would blow up
NUTATION_STEP = 1.0
#: half the width of a difference: m, m/s, rad, rad/s, and per unit of a parameter's size; ten times more leaves 1e-4
#: of curvature in some columns, ten times less shows rounding
_RELEASE_STEPS = np.repeat([1e-3, 1e-4, 1e-5, 1e-4], 3)
_PARAMETER_STEP = 1e-5
#: least size of a parameter without a scale in the catalogue: wind m/s, coefficients
_SIZES = {"environment": 1.0, "aero": 0.01, "disc": 0.0}


@compiled_nogil
def _fly_in_steps(flat: FloatArray, tables: Tables, times: FloatArray, state: FloatArray, t: FloatArray) -> FloatArray:
    """Return the state (m, 14) at instants t of the flight from ``state`` (14,) in given steps: times (n,)."""
    p = flat.view(PARAMETERS)[0]
    n = times.size
    states, dense, K = np.empty((n, WIDTH)), np.empty((n - 1, 7, WIDTH)), np.empty((16, WIDTH))
    states[0] = state
    derivative(p, tables, times[0], states[0], K[0])
    for k in range(n - 1):
        h = times[k + 1] - times[k]
        step(p, tables, times[k], states[k], h, K, states[k + 1])
        derivative(p, tables, times[k + 1], states[k + 1], K[12])
        interpolant(p, tables, times[k], states[k], h, K, states[k + 1], dense[k])
        copied(K[12], K[0])
    return evaluate(times, states, dense, t)


class Sensitivity(NamedTuple):
    """Derivatives of the 12 states over time, (m, 12, k).

    Rows are position and velocity in N, small rotation in B (rad), body rates; columns the release state in the same
    order and then the parameters asked for, by name in ``columns``.
    """

    t: FloatArray
    derivative: FloatArray
    columns: tuple[str, ...]

    def landing(self, flight: Flight) -> FloatArray:
        """Return derivatives (4, k) of north, east, down and time of touch-down; the last instant must be that.

        The ground is met when down = 0: a column that lifts the path by some metres also delays its end.
        """
        if not (flight.touched_down and self.t.size and self.t[-1] == flight.end):
            raise ValueError(f"expected sensitivities whose last instant is the touch-down at {flight.touch_down} s")
        velocity = flight.state[-1, 3:6]
        delay = -self.derivative[-1, 2] / velocity[2]
        return np.vstack([self.derivative[-1, :3] + np.outer(velocity, delay), delay])


def sensitivities(
    flight: Flight, parameters: Sequence[tuple[str, str]] = (), t: FloatArray | None = None
) -> Sensitivity:
    """Return how the state at instants t (m,) s, by default the flight's steps, depends on release and parameters.

    ``parameters`` are (group, name) as for `parameter_index`: ("aero", "CNr"), ("air.wind", "w_north_m_s"). Raises
    `InputError` where a perturbed flight leaves its C_Nr table.
    """
    t = flight.t if t is None else np.ascontiguousarray(t, dtype=np.float64)
    start, times, columns = flight.state[0], _steps(flight), []
    for k, size in enumerate(_RELEASE_STEPS):
        columns.append(
            _column(flight, *(_released(start, k, sign * size) for sign in (1, -1)), times=times, t=t, step=size)
        )
    for group, name in parameters:
        place = parameter_index(group, name)
        size = _PARAMETER_STEP * _size(group, name, flight.parameters[place])
        flats = [flight.parameters.copy() for _ in range(2)]
        flats[0][place] += size
        flats[1][place] -= size
        columns.append(_column(flight, start, start, times=times, t=t, step=size, flats=flats))
    names = (*RELEASE_COLUMNS, *(f"{group}.{name}" for group, name in parameters))
    return Sensitivity(t, np.stack(columns, axis=-1), names)


def _steps(flight: Flight) -> FloatArray:
    """Return the times of the flight's steps, divided where they are long against the nutation."""
    p = flight.parameters.view(PARAMETERS)[0]
    nutation = np.maximum(np.abs(flight.state[:-1, 12]), 1.0) * p["disc"]["Izz"] / p["disc"]["Ixx"]
    parts = np.ceil(np.diff(flight.t) * nutation / NUTATION_STEP).astype(int)
    pieces = [np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(flight.t), parts, strict=True)]
    return np.append(np.concatenate(pieces), flight.t[-1])


def _size(group: str, name: str, value: float) -> float:
    """Return the size of a parameter by which its change is measured."""
    if group in CATALOGUE:
        row = CATALOGUE[group]
        return max(abs(value), 10.0 * row.scale[row.parameters.index(name)])
    return max(abs(value), _SIZES[group])


def _released(state: FloatArray, column: int, change: float) -> FloatArray:
    """Return a release state (14,) with one of its 12 numbers changed; S and B coincide at release."""
    changed = state.copy()
    if 6 <= column < 9:
        changed[6:10] = multiply(state[6:10], turn(change * np.eye(3)[column - 6]))
    else:
        changed[column + (1 if column >= 9 else 0)] += change
    return changed


def _column(
    flight: Flight,
    plus: FloatArray,
    minus: FloatArray,
    *,
    times: FloatArray,
    t: FloatArray,
    step: float,
    flats: Sequence[FloatArray] | None = None,
) -> FloatArray:
    """Return (m, 12): half the difference of two flights over the step."""
    rows = []
    for flat, state in zip(flats or (flight.parameters,) * 2, (plus, minus), strict=True):
        path = _fly_in_steps(flat, flight.tables, times, state, t)
        if not np.all(np.isfinite(path)):
            raise InputError(
                f"sensitivities need the flight's neighbours, and one of them leaves the C_Nr table before "
                f"{flight.end:.3f} s; expected a table with some room around the flight"
            )
        rows.append(in_body(flat, flight.tables, t, path))
    difference = np.empty((t.size, 12))
    difference[:, :6] = rows[0][:, :6] - rows[1][:, :6]
    difference[:, 6:9] = rotation_vector(multiply(conjugate(rows[1][:, 9:13]), rows[0][:, 9:13]))
    difference[:, 9:] = rows[0][:, 13:16] - rows[1][:, 13:16]
    return np.asarray(difference / (2.0 * step))
