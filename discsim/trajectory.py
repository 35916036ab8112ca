"""The standalone model of 12 states, (18)-(23): the same physics as the MuJoCo truth, another integrator.

`discsim.flight_equations` holds the equations of motion, `discsim.dormand_prince` one step of the Runge-Kutta pair of
order 8(5,3) with its dense output, `discsim.step_ends` where a step has to end.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import nan
from typing import Any, NamedTuple

import numpy as np

from discsim.aerodynamics import outside_table, wind
from discsim.arrays import FloatArray, readonly
from discsim.compiled import compiled_nogil
from discsim.disc import Disc, Release
from discsim.dormand_prince import EXTENDED, POWER, STAGES, evaluate, interpolant, step, step_error, within
from discsim.effects.body import centre_of_mass
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.errors import InputError, require_number
from discsim.flight_equations import WIDTH, copied, derivative, in_body, incidence
from discsim.frames import euler_angles, quaternion_from_matrix
from discsim.law import Law
from discsim.limits import FASTEST_SPIN
from discsim.motion import Motion, State
from discsim.parameters import PARAMETERS, Tables, flight_parameters, tables
from discsim.step_ends import land, lowest_point, share_to_kink, up_to_events

__all__ = ["ATOL", "RTOL", "Flight", "Landings", "integrate", "predict", "predict_many", "release_state"]

#: default tolerances; docs/trajectory.md says what they are worth
RTOL, ATOL = 1e-8, 1e-8
#: longest flight unless another is asked for, s
LONGEST = 30.0

#: a step this short (s) is taken whatever its error: what is left is a jump of the force, which no step resolves
SHORTEST_STEP = 1e-7
#: nothing in a flight is this fast (s) but a jump that is met again and again: wind along the axis, kept there by the
#: air, has a direction that turns ever faster. Steps below may be short for a while only: the least that is taken
#: whatever its error grows with the time spent, until a long one is taken again, so that a flight ends
CHATTER_STEP, CHATTER_SHARE, CHATTER_END = 1e-4, 1.0 / 32.0, 2e-3
#: tries to end a step on a kink of the coefficients
KINK_TRIES = 8
FIRST_STEP = 5e-3
#: how a flight ended
_LEFT, _TOUCHED, _LOST = 0, 1, 2


@compiled_nogil
def integrate(
    flat: FloatArray,
    tables: Tables,
    state: FloatArray,
    t_start: float,
    t_end: float,
    rtol: float,
    atol: float,
    keep: bool,
) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """Fly from a state (14,) at t_start until the ground or t_end.

    Returns how it ended (0 at t_end, 1 on the ground, 2 where the physics gave no finite number, as outside a C_Nr
    table), the times (n,) of the steps, the states (n, 14), and the dense output (n - 1, 7, 14) for `evaluate`. Where
    ``keep`` is false only the first and the last state are returned, and no dense output.
    """
    p = flat.view(PARAMETERS)[0]
    size = 256 if keep else 2
    times, states = np.empty(size), np.empty((size, WIDTH))
    dense = np.empty((size if keep else 0, POWER, WIDTH))
    K, F = np.empty((EXTENDED, WIDTH)), np.empty((POWER, WIDTH))
    y, new, work = state.copy(), np.empty(WIDTH), np.empty(WIDTH)
    t, h, n, ended = t_start, FIRST_STEP, 0, _LEFT
    tabulated = tables.static.columns.shape[1] > 0 or tables.static.rolling.shape[1] > 1
    kinked = tabulated or p.aero_stall.k != 0.0
    alpha, alpha_new, tries = 0.0, 0.0, 0
    shortest, chatter = SHORTEST_STEP, np.inf
    times[0] = t
    copied(y, states[0])
    derivative(p, tables, t, y, K[0])
    if kinked:
        alpha = incidence(p, tables, t, y)
    wished = h
    while t < t_end:
        h = min(up_to_events(p, t, h), t_end - t)
        whole = h >= t_end - t
        step(p, tables, t, y, h, K, new)
        derivative(p, tables, t + h, new, K[STAGES])
        error = step_error(h, K, y, rtol, atol, F)
        if not np.isfinite(error):
            if h <= SHORTEST_STEP:
                ended = _LOST
                break
            h = wished = max(0.2 * h, SHORTEST_STEP)
            continue
        if kinked:
            alpha_new = incidence(p, tables, t + h, new)
            if tries < KINK_TRIES and h > shortest:
                interpolant(p, tables, t, y, h, K, new, F)
                share = share_to_kink(p, tables, t, y, h, F, alpha, alpha_new, work)
                if share < 1.0:
                    h = max(h * share, shortest)
                    tries += 1
                    continue
        if error > 1.0 and h > shortest:
            h = wished = max(h * max(0.2, 0.9 * error ** (-1.0 / 8.0)), shortest)
            continue
        tries = 0
        if h < CHATTER_STEP:
            chatter = min(chatter, t)
            shortest = min(max(CHATTER_SHARE * (t + h - chatter), SHORTEST_STEP), CHATTER_STEP)
        elif h > CHATTER_END:
            shortest, chatter = SHORTEST_STEP, np.inf

        if new[2] < 0.0 and y[5] > 0.0 > new[5]:
            # between its ends the step may touch the ground and leave it
            interpolant(p, tables, t, y, h, K, new, F)
            share = lowest_point(F, y)
            if within(F, y, share, 2) >= 0.0:
                h *= share
                step(p, tables, t, y, h, K, new)
        if new[2] >= 0.0:
            h = land(p, tables, t, y, h, K, new, work)
            derivative(p, tables, t + h, new, K[STAGES])
            ended = _TOUCHED

        if keep:
            if n + 2 > times.size:
                more = 2 * times.size
                longer_times, longer_states = np.empty(more), np.empty((more, WIDTH))
                longer_dense = np.empty((more, POWER, WIDTH))
                for k in range(n + 1):
                    longer_times[k] = times[k]
                    copied(states[k], longer_states[k])
                for k in range(n):
                    for row in range(POWER):
                        copied(dense[k, row], longer_dense[k, row])
                times, states, dense = longer_times, longer_states, longer_dense
            interpolant(p, tables, t, y, h, K, new, dense[n])
            n += 1
        else:
            n = 1
        t = t_end if whole and ended == _LEFT else t + h
        times[n] = t
        copied(new, states[n])
        if ended == _TOUCHED:
            break
        copied(new, y)
        copied(K[STAGES], K[0])
        alpha = alpha_new
        grown = max(h * min(5.0, 0.9 * error ** (-1.0 / 8.0)), shortest) if error > 0.0 else 5.0 * h
        # a step cut short for an event or a kink says little about the next one
        h = wished = max(grown, wished) if h < wished else grown
    return ended, times[: n + 1].copy(), states[: n + 1].copy(), dense[: n if keep else 0].copy()


def release_state(release: Release) -> FloatArray:
    """Return the state (14,) of a release; S and B coincide there. Raises `InputError` where something is unknown."""
    Release.require(release)
    position, velocity, C_NB, rate = release.start()
    return np.concatenate([position, velocity, quaternion_from_matrix(C_NB), rate, [0.0]])


@dataclass(frozen=True)
class Flight:
    """A predicted flight: the integrator's own steps and the dense output between them.

    Attributes
    ----------
    t : (n,) array
        Times of the steps, s; the last is touch-down where ``touched_down``.
    state : (n, 14) array
        Position and velocity in N, quaternion of S, rates P, Q in S and r, spin angle psi.
    dense : (n - 1, 7, 14) array
        Dense output of each step, for `evaluate`.
    parameters, tables
        What it was flown with.
    environment : Environment
        Where it happened.
    touched_down : bool
        Whether it ends on the ground.
    """

    t: FloatArray
    state: FloatArray
    dense: FloatArray
    parameters: FloatArray
    tables: Tables
    environment: Environment
    touched_down: bool

    @property
    def end(self) -> float:
        """Last instant, s."""
        return float(self.t[-1])

    @property
    def touch_down(self) -> float:
        """Time at which the centre of mass reaches the ground, s; NaN where it does not."""
        return self.end if self.touched_down else nan

    @property
    def landing(self) -> FloatArray:
        """Position at touch-down, (3,) in N, m; NaN where it does not land."""
        return np.array(self.state[-1, :3]) if self.touched_down else np.full(3, nan)

    def at(self, t: FloatArray | float) -> State:
        """Return the motion at instants t (m,) s, to the order of the dense output; raises ValueError outside."""
        t = np.atleast_1d(np.asarray(t, dtype=np.float64))
        if t.size and not (self.t[0] - 1e-12 <= t.min() and t.max() <= self.end + 1e-12):
            raise ValueError(f"flight runs from {self.t[0]:g} to {self.end:g} s, asked for {t.min():g} to {t.max():g}")
        inside = np.clip(t, self.t[0], self.end)
        rows = in_body(self.parameters, self.tables, inside, evaluate(self.t, self.state, self.dense, inside))
        return State(t, rows[:, :3], rows[:, 3:6], rows[:, 6:9], rows[:, 9:13], rows[:, 13:16], rows[:, 16:19])

    def euler_angles(self, t: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return roll, pitch, yaw (m,) in rad at instants t, in the paper's order."""
        return euler_angles(self.at(t).attitude)

    def motion(self, timestep: float = 1e-3) -> Motion:
        """Return the motion on a grid of ``timestep`` s, with the end of the flight as its last row."""
        count = max(int(np.ceil((self.end - self.t[0]) / timestep - 1e-6)), 1)
        grid = np.append(self.t[0] + timestep * np.arange(count), self.end)
        at = self.at(grid)
        return Motion(
            t=at.t,
            position=at.position,
            velocity=at.velocity,
            acceleration=at.acceleration,
            attitude=at.attitude,
            rate=at.rate,
            angular_acceleration=at.angular_acceleration,
            environment=self.environment,
            centre_of_mass=readonly(centre_of_mass(self.parameters.view(PARAMETERS)[0]["body_mass_imbalance"])),
            touched_down=self.touched_down,
        )


def predict(
    disc: Disc,
    environment: Environment,
    release: Release,
    effects: Sequence[Effect] = (),
    *,
    rtol: float = RTOL,
    atol: float = ATOL,
    duration: float = LONGEST,
    law: Law | Sequence[Law] | None = None,
) -> Flight:
    """Fly a disc by the standalone model, until its centre of mass reaches the ground or for ``duration`` s.

    rtol is of the size of velocity, attitude and rates, atol in SI units: estimated errors of one step. Raises
    `InputError` for a release that lacks something, where a C_Nr table does not reach, and above `FASTEST_SPIN`.
    """
    for name, value, unit in (("rtol", rtol, "relative"), ("atol", atol, "SI"), ("duration", duration, "s")):
        require_number(value, name, unit, positive=True)
    flat, lookup = flight_parameters(disc, environment, effects), tables(disc, law, effects)
    state = release_state(release)
    ended, t, states, dense = integrate(flat, lookup, state, 0.0, float(duration), rtol, atol, True)
    if ended == _LOST:
        raise _lost(flat, lookup, float(t[-1]), states[-1])
    fastest = float(np.sqrt(np.max(np.sum(states[:, 10:13] ** 2, axis=1))))
    if fastest > FASTEST_SPIN:  # its nutation needs steps as short as those that are taken whatever their error
        raise InputError(f"the disc turns at {fastest:.4g} rad/s; expected at most {FASTEST_SPIN:g} rad/s")
    return Flight(t, states, dense, flat, lookup, environment, ended == _TOUCHED)


def _lost(flat: FloatArray, lookup: Tables, t: float, state: FloatArray) -> InputError:
    """Return the error of a flight whose physics gave no finite number after time t."""
    if lookup.rate.size == 0:
        return InputError(f"at {t:.3f} s the motion is no longer finite; expected parameters of a disc that can fly")
    w = wind(flat.view(PARAMETERS)[0], lookup, t, float(state[0]), float(state[1]), -float(state[2]))
    return outside_table(lookup, t, float(state[12]), float(np.linalg.norm(state[3:6] - w)))


class Landings(NamedTuple):
    """How many flights ended: end (n,) s, state there (n, 14), touched_down (n,), and track (n, m, 14) if asked for.

    Rows of a track after the end of its flight are NaN, and so is all of a flight that left its C_Nr table.
    """

    end: FloatArray
    state: FloatArray
    touched_down: np.ndarray[Any, np.dtype[np.bool_]]
    track: FloatArray


@compiled_nogil
def _integrate_range(
    flats: FloatArray,
    tables: Tables,
    states: FloatArray,
    duration: float,
    rtol: float,
    atol: float,
    t: FloatArray,
    end: FloatArray,
    last: FloatArray,
    touched: Any,
    track: FloatArray,
) -> None:
    """Fly the rows of states (n, 14), each with its row of flats, and write what became of them."""
    for k in range(states.shape[0]):
        flat = flats[k] if flats.shape[0] > 1 else flats[0]
        ended, times, path, dense = integrate(flat, tables, states[k], 0.0, duration, rtol, atol, t.size > 0)
        if ended == _LOST:
            end[k], touched[k] = np.nan, False
            for i in range(WIDTH):
                last[k, i] = np.nan
                for instant in range(t.size):
                    track[k, instant, i] = np.nan
            continue
        end[k], touched[k] = times[-1], ended == _TOUCHED
        copied(path[-1], last[k])
        if t.size > 0:
            found = evaluate(times, path, dense, t)
            for instant in range(t.size):
                copied(found[instant], track[k, instant])


def predict_many(
    disc: Disc,
    environment: Environment,
    releases: Sequence[Release] | FloatArray,
    effects: Sequence[Effect] = (),
    *,
    parameters: FloatArray | None = None,
    times: FloatArray | None = None,
    tolerance: float = RTOL,
    threads: int | None = None,
) -> Landings:
    """Fly n throws on all cores, for `LONGEST` s at the most; the number of threads does not change the result.

    releases may be states (n, 14). ``parameters`` (n, k) are flat arrays, one per throw, in the place of those of disc,
    environment and effects (of which the tables remain). ``times`` (m,) s asks for tracks; ``tolerance`` is rtol and
    atol of `predict`. Raises `InputError` as that does, but a flight that leaves its C_Nr table becomes NaN and the
    others fly on.
    """
    states = releases if isinstance(releases, np.ndarray) else np.array([release_state(each) for each in releases])
    states = np.ascontiguousarray(states, dtype=np.float64).reshape(-1, WIDTH)
    flats = flight_parameters(disc, environment, effects)[None] if parameters is None else parameters
    flats = np.ascontiguousarray(flats, dtype=np.float64)
    n = states.shape[0]
    width = PARAMETERS.itemsize // 8
    if flats.ndim != 2 or flats.shape[0] not in (1, n) or flats.shape[1] != width:
        raise ValueError(f"parameters: got {flats.shape}, expected ({n}, {width})")
    lookup = tables(disc, None, effects)
    t = np.empty(0) if times is None else np.ascontiguousarray(times, dtype=np.float64)
    end, last, touched = np.empty(n), np.empty((n, WIDTH)), np.empty(n, dtype=np.bool_)
    track = np.empty((n, t.size, WIDTH))

    def fly(some: slice) -> None:
        own = flats[some] if flats.shape[0] > 1 else flats
        out = (end[some], last[some], touched[some], track[some])
        _integrate_range(own, lookup, states[some], LONGEST, tolerance, tolerance, t, *out)

    count = threads or len(os.sched_getaffinity(0))
    # a few pieces for each thread, for flights differ in length
    edges = np.linspace(0, n, min(n, 4 * count) + 1).astype(int)
    pieces = [slice(a, b) for a, b in itertools.pairwise(edges) if b > a]
    if count == 1 or len(pieces) == 1:
        fly(slice(0, n))
    else:
        with ThreadPoolExecutor(count) as pool:
            list(pool.map(fly, pieces))
    return Landings(end, last, touched, track)
