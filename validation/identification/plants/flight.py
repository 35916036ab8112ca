"""A throw: a disc flies through the air, its whole motion unknown.

A state is position and velocity in N, attitude and body rates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice, product
from math import asin, atan2, cos, degrees, radians, sin
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_nogil
from discsim.disc import Release
from discsim.dormand_prince import evaluate, interpolant, step
from discsim.effects.air import Wind
from discsim.effects.catalogue import catalogued
from discsim.effects.kind import BOARD
from discsim.errors import InputError
from discsim.flight_equations import copied, derivative, in_body, incidence
from discsim.frames import body_to_ned, multiply, quaternion_from_matrix, to_body, turn
from discsim.law import AIR_SHARE, WRENCH_TARGETS
from discsim.parameters import Tables
from discsim.recording import Recording
from discsim.step_ends import share_to_kink
from discsim.toml_table import TomlTable
from discsim.validation.identification.dynamics import FASTEST, SIZE, acting_tables, physics_of
from discsim.validation.identification.initial.flight import (
    InitialStates,
    begins_open,
    flight_initial_states,
    flight_starts,
)
from discsim.validation.identification.parameters import AllowedDefects, Values
from discsim.validation.identification.plants.flight_neighbours import SLOWEST, add_neighbours
from discsim.validation.identification.plants.law_terms import Term
from discsim.validation.identification.plants.plan import Plan, towards, turns
from discsim.validation.identification.plants.plant import (
    Design,
    Durations,
    Dynamics,
    Given,
    Initial,
    Layout,
    MotionLaws,
    Plant,
    Sizes,
    even_nodes,
    propagated_by,
)

__all__ = ["FLIGHT"]

#: where the numbers of a state stand
_POSITION, _VELOCITY, _ATTITUDE, _RATE, _SPIN = slice(0, 3), slice(3, 6), slice(6, 10), slice(10, 13), 12

# ---------------------------------------------------------------------------------------------------- its motion

#: longest step of the integrator, s, and in radians of nutation
_STEP, _NUTATION = 0.01, 1.2
#: and where an uneven body makes the motion follow the spin
_UNEVEN = 0.6
#: parts that a step is cut into at kinks of the coefficients at most, and tries to have a part end on its kink
_PARTS, _TRIES = 25, 8
#: a step this short, s, is not cut
_SHORTEST = 1e-7


def _longest_step(given: Given, state: FloatArray, start: float, stop: float) -> float:
    del start, stop
    disc = given.recording.disc
    assert disc is not None
    spin = min(abs(float(state[_SPIN])), FASTEST)
    nutation = max(spin * disc.Izz / disc.Ixx, spin, 1.0)
    # a path shows no nutation: 0.04 mm off after 2.5 s at 138 rad/s, by tables and with a wobble of 2 rad/s
    if BOARD.isdisjoint(given.recording.samples):
        return min(_STEP, _NUTATION / nutation)
    return min(_STEP, (_UNEVEN if given.uneven else _NUTATION) / nutation)


@compiled
def _begun(state: FloatArray, y: FloatArray) -> None:
    """Write a state of a segment (13,) as one of the equations of motion (14,), its angle turned being zero."""
    for i in range(13):
        y[i] = state[i]
    y[13] = 0.0


@compiled
def _flown_to_kinks(
    p: Any, tables: Tables, state: FloatArray, times: FloatArray, last: int
) -> tuple[FloatArray, int, FloatArray, FloatArray]:
    """Fly from a state (13,) in the steps ``times`` (n,), each cut where the coefficients have a kink.

    Returns the steps as they were taken (m,), the place of ``last`` in them, the states there (m, 14) and their dense
    output (m - 1, 7, 14). Where there is no kink, as without a table, the steps are those given.
    """
    kinked = tables.static.columns.shape[1] > 0 or tables.static.rolling.shape[1] > 1 or p.aero_stall.k != 0.0
    parts = _PARTS if kinked else 1
    most = (times.size - 1) * parts + 1
    ends, path, dense = np.empty(most), np.empty((most, 14)), np.empty((most - 1, 7, 14))
    K, work = np.empty((16, 14)), np.empty(14)
    n, place, alpha = 0, 0, 0.0
    ends[0] = times[0]
    _begun(state, path[0])
    derivative(p, tables, times[0], path[0], K[0])
    if kinked:
        alpha = incidence(p, tables, times[0], path[0])
    for k in range(1, times.size):
        h, part, tries = times[k] - ends[n], 1, 0
        while True:
            t, y, new = ends[n], path[n], path[n + 1]
            whole = h >= times[k] - t - _SHORTEST
            end = times[k] if whole else t + h
            step(p, tables, t, y, h, K, new)
            derivative(p, tables, end, new, K[12])
            interpolant(p, tables, t, y, h, K, new, dense[n])
            if kinked:
                alpha_new = incidence(p, tables, end, new)
                if part < parts and tries < _TRIES:
                    share = share_to_kink(p, tables, t, y, h, dense[n], alpha, alpha_new, work)
                    if share < 1.0 and share * h > _SHORTEST:
                        h *= share
                        tries += 1
                        continue
                alpha = alpha_new
            copied(K[12], K[0])
            n += 1
            ends[n] = end
            if whole:
                break
            h, part, tries = times[k] - end, part + 1, 0
        if k == last:
            place = n
    return ends[: n + 1], place, path[: n + 1], dense[:n]


@compiled_nogil
def flight_segments(
    flats: FloatArray,
    tables: Tables,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Fly from states (c, 13), each with its row of flats (c, k), in the steps ``times`` (n,).

    Writes rows (c, m, 19) at instants out (m,) and ends (c, 13), the states at ``times[last]``. All states but the
    first are its neighbours, which count by how they part from it. Steps are cut where the first meets a kink of the
    coefficients, as at the corners of a table: a step across one is in error by up to twice a good gyroscope's noise.
    """
    given = tables
    p = physics_of(flats[0])
    turning = abs(states[0, _SPIN]) * p.disc.Izz / p.disc.Ixx > SLOWEST
    times, last, path, dense = _flown_to_kinks(p, acting_tables(given, flats[0]), states[0], times, last)
    K = np.empty((16, 14))
    for c in range(1 if turning else states.shape[0]):
        tables = acting_tables(given, flats[c])
        if c > 0:
            p = physics_of(flats[c])
            _begun(states[c], path[0])
            derivative(p, tables, times[0], path[0], K[0])
            for k in range(times.size - 1):
                h = times[k + 1] - times[k]
                step(p, tables, times[k], path[k], h, K, path[k + 1])
                derivative(p, tables, times[k + 1], path[k + 1], K[12])
                interpolant(p, tables, times[k], path[k], h, K, path[k + 1], dense[k])
                copied(K[12], K[0])
        rows[c] = in_body(flats[c][:SIZE], tables, out, evaluate(times, path, dense, out))
        end = in_body(flats[c][:SIZE], tables, times[last : last + 1], path[last : last + 1])[0]
        ends[c, :6] = end[:6]
        ends[c, 6:10] = end[9:13]
        ends[c, 10:13] = end[13:16]
    if turning and states.shape[0] > 1:
        add_neighbours(flats, given, states, times[0], times[last], times[-1], out, rows, ends)


def _states(recording: Recording, t: FloatArray, ratio: float) -> FloatArray:
    return _rows(flight_initial_states(recording, np.minimum(t * ratio, recording.end)), ratio)


def _rows(starts: InitialStates, ratio: float) -> FloatArray:
    states = np.hstack([starts.position, starts.velocity, starts.attitude, starts.rate])
    states[:, _SPIN] *= ratio
    return states


def _other_attitudes(recording: Recording) -> tuple[FloatArray, ...]:
    if begins_open(recording):
        return ()  # how its path bends tells how it stood
    return flight_initial_states(recording, np.zeros(1)).ambiguous


def _other_states(recording: Recording, t: FloatArray, ratio: float) -> tuple[FloatArray, ...]:
    starts = flight_starts(recording, np.minimum(t * ratio, recording.end))
    return tuple(_rows(one, ratio) for one in islice(starts, 1, None))


def _path_alone(recording: Recording) -> bool:
    """Tell a flight that no sensor flew along with: its release is stated in full, or its path tells how it begins."""
    if begins_open(recording):
        return True
    release = recording.release
    if release is None or not BOARD.isdisjoint(recording.samples):
        return False
    return all(one is not None for one in (release.position, release.velocity, release.roll, release.pitch))


def _nodes(recording: Recording, segment: float) -> FloatArray:
    """Return the nodes (k + 1,) of segments, s: a path tells no turning, and so not how segments go on."""
    nodes = even_nodes(recording, segment)
    return nodes[[0, -1]] if _path_alone(recording) else nodes


def _lacks(recording: Recording) -> str | None:
    if recording.disc is not None and recording.environment.air_density is not None:
        return None
    return "a flight needs [disc] and air_density_kg_m3; add them to recording.toml"


def _grows_with(t: FloatArray, states: FloatArray) -> dict[str, FloatArray]:
    spin, speed = np.abs(states[:, _SPIN]), np.linalg.norm(states[:, _VELOCITY], axis=1)
    return {
        "time": t,
        "spin": spin,
        "speed": speed,
        "height": -states[:, _POSITION][:, 2],
        "advance ratio (spin over speed)": spin / np.maximum(speed, 0.1),
    }


# --------------------------------------------------------------------------------------- unknown laws about it

#: exponents that are tried first; the fit leaves them
_POWERS = {"V": (0.0, 1.0, 2.0, 3.0), "r": (0.0, 1.0, 2.0), "alpha": (0.0, 1.0, 2.0)}
#: sums of exponents beyond which no physics goes
_HIGHEST = 5.0


def _terms() -> tuple[Term, ...]:
    terms = []
    for target in WRENCH_TARGETS:
        for powers in product(*_POWERS.values()):
            named = tuple((symbol, n) for symbol, n in zip(_POWERS, powers, strict=True) if n)
            odd = tuple(symbol for symbol, n in named if symbol != "V" and n == 1.0)
            if sum(powers) <= _HIGHEST:
                terms.append(Term(target, named, odd))
        if target == "moment_z_N_m":
            terms += [Term(target, (("r", n),), ("r",)) for n in (1.5, 2.0, 2.5, 3.0, 4.0)]
    # all that the air does: of a disc that dries or sheds mass, and in air that is another one higher up
    terms += [Term(AIR_SHARE, decay=1.0 / tau) for tau in (0.25, 0.5, 1.0, 2.0)]
    terms.append(Term(AIR_SHARE, (("h", 1.0),)))
    return tuple(terms)


#: the wind of a place that is sought: one along the ground passes for what a throw starts with, which GPS alone tells
_UPWARDS = "wind_up_m_s"
#: widths (m) of air that moves about a place, between a hedge's lee and more than a throw crosses; middles are tried
#: one width apart, as far from a path as its wind is still a third of that in the middle
_WIDTHS, _FAR = (10.0, 20.0, 40.0), 1.5


def _places(states: Sequence[Mapping[str, FloatArray]]) -> tuple[Term, ...]:
    path = np.concatenate([np.column_stack([state["north"], state["east"]]) for state in states])
    terms = []
    for width in _WIDTHS:
        ways = (
            np.arange(np.floor(low / width) - 1.0, np.ceil(high / width) + 2.0)
            for low, high in zip(path.min(axis=0), path.max(axis=0), strict=True)
        )
        for middle in product(*ways):
            at = width * np.array(middle)
            if np.min(np.linalg.norm(path - at, axis=1)) <= _FAR * width:
                terms.append(Term(_UPWARDS, place=(float(at[0]), float(at[1]), width)))
    return tuple(terms)


#: an unknown steady wind
_WIND = catalogued(Wind).id


def _symbols(recording: Recording, t: FloatArray, states: FloatArray, values: Values) -> dict[str, FloatArray]:
    wind = np.array(recording.environment.wind, dtype=float)
    wind[:2] += [values.get((_WIND, name), 0.0) for name in Wind._fields]
    u, v, w = to_body(states[:, _ATTITUDE], states[:, _VELOCITY] - wind).T
    return {
        "t": t,
        "north": states[:, _POSITION][:, 0],
        "east": states[:, _POSITION][:, 1],
        "h": np.maximum(-states[:, _POSITION][:, 2], 0.02),
        "V": np.sqrt(u * u + v * v + w * w),
        "alpha": np.arctan2(w, np.hypot(u, v)),
        "r": states[:, _SPIN],
    }


# ------------------------------------------------------------------------------------------- its next recordings


@dataclass(frozen=True)
class _Throw:
    """How a throw differs from one in hand: factors of speed and spin, turns in degrees."""

    speed: float = 1.0
    spin: float = 1.0
    up: float = 0.0
    bank: float = 0.0
    heading: float = 0.0


_THROWS = (
    _Throw(speed=0.6),
    _Throw(speed=0.8),
    _Throw(speed=1.2),
    _Throw(spin=0.5),
    _Throw(spin=1.4),
    _Throw(spin=-1.0),
    _Throw(up=15.0),
    _Throw(up=-8.0),
    _Throw(bank=25.0),
    _Throw(bank=-25.0),
    _Throw(heading=90.0),
    _Throw(heading=180.0),
    _Throw(heading=270.0),
    _Throw(speed=0.6, spin=0.5),
    _Throw(speed=0.6, heading=180.0),
    _Throw(spin=-0.6, heading=180.0),
    _Throw(speed=0.7, up=30.0),
)


def _about(recording: Recording, base: FloatArray, end: float, longest: float) -> list[Plan]:
    del recording
    again = Plan(f"the same again: {_in_words(base)}", base, end)
    thrown = [_thrown(base, throw) for throw in _THROWS]
    return [again, *(Plan(_in_words(state), state, 1.5 * longest) for state in thrown)]


def _thrown(state: FloatArray, throw: _Throw) -> FloatArray:
    """Return the state (13,) of another throw: turned as a whole, but for the bank, which turns the disc alone."""
    new = state.copy()
    north, east, _ = new[_VELOCITY]
    heading = atan2(east, north)
    forward, right = np.array([cos(heading), sin(heading), 0.0]), np.array([-sin(heading), cos(heading), 0.0])
    q, velocity = new[_ATTITUDE], throw.speed * new[_VELOCITY]
    if throw.spin < 0:  # as the other hand throws it: the disc leans to the other side, the wobble keeps its size
        down = body_to_ned(q)[:, 2]
        q = multiply(_between(down, down - 2.0 * (down @ right) * right), q)
    q = multiply(turn(radians(throw.bank) * forward), q)
    whole = multiply(turn(np.array([0.0, 0.0, radians(throw.heading)])), turn(radians(throw.up) * right))
    new[_VELOCITY], new[_ATTITUDE] = body_to_ned(whole) @ velocity, multiply(whole, q)
    new[_SPIN] *= throw.spin
    return new


def _between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the quaternion (4,) of the least turn that takes unit vector a (3,) to b."""
    across = np.cross(a, b)
    size = float(np.linalg.norm(across))
    return turn(across * (atan2(size, float(a @ b)) / size if size > 0 else 0.0))


def _in_words(state: FloatArray) -> str:
    velocity, down = state[_VELOCITY], body_to_ned(state[_ATTITUDE])[:, 2]
    speed, heading = float(np.linalg.norm(velocity)), atan2(velocity[1], velocity[0])
    up = degrees(asin(-velocity[2] / max(speed, 1e-9)))
    lean = degrees(atan2(-down @ np.array([-sin(heading), cos(heading), 0.0]), down[2]))
    climb = f"{abs(up):.0f}° {'up' if up >= 0 else 'down'}"
    side = f"its {'right' if lean > 0 else 'left'} edge {abs(lean):.0f}° down" if abs(lean) >= 0.5 else "level"
    return f"a throw at {speed:.0f} m/s with {turns(float(state[_SPIN]))}, {climb}, {side}, {towards(heading)}"


#: a throw ends on the ground, at the latest after this long, s
_LONGEST_THROW = 15.0


def _read(table: TomlTable) -> Plan:
    text, duration = table.text("text", required=False), table.number("duration", "s", required=False, positive=True)
    state = _release_state(table, Release.from_toml(table))
    return Plan(text or _in_words(state), state, duration or _LONGEST_THROW)


def _release_state(table: TomlTable, release: Release) -> FloatArray:
    try:
        position, velocity, C_NB, rate = release.start()
    except InputError as error:
        raise table.error(None, str(error)) from None
    return np.concatenate([position, velocity, quaternion_from_matrix(C_NB), rate])


FLIGHT = Plant(
    name="flight",
    motion="flight",
    layout=Layout(13, _POSITION, _VELOCITY, _ATTITUDE, _RATE, _SPIN, per_time=(_SPIN,)),
    dynamics=Dynamics(propagated_by(flight_segments), _longest_step),
    initial=Initial(_states, _other_attitudes, _other_states),
    sizes=Sizes(  # m, m/s, rad, rad/s
        differences=np.repeat([1e-3, 1e-3, 1e-5, 1e-4], 3),
        unknown=np.repeat([1e4, 300.0, 30.0, 1e3], 3),
        continuous=AllowedDefects(np.zeros(12)),
        relaxed=AllowedDefects(np.repeat([0.1, 0.5, 0.05, 0.3], 3)),
        of_path=np.array([*[1e4] * 3, *[300.0] * 3, 30.0, 30.0, 1e-6, *[1e3] * 3]),
    ),
    # twice the longest throw; a first look of two segments
    durations=Durations(segment=0.5, first_look=1.0, window=0.5, longest=20.0, setup=60.0, event_near=0.09),
    hardware=("disc", "aero"),
    lacks=_lacks,
    grows_with=_grows_with,
    laws=MotionLaws(_terms(), _symbols, moment_step=2e-4, places=_places),
    design=Design(_about, _read),
    nodes=_nodes,
    path_alone=_path_alone,
)
