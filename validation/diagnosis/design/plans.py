"""Recordings that could be made next: throws, profiles, run-downs about those in hand, or a person's own list."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import asin, atan2, cos, degrees, hypot, pi, radians, sin
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Release
from discsim.errors import InputError
from discsim.frames import body_to_ned, multiply, quaternion_from_euler, quaternion_from_matrix, turn
from discsim.recording import Plant, Samples
from discsim.toml_table import TomlTable, read_toml
from validation.identification.segments import Chain

__all__ = ["Plan", "plans_about", "read_plans"]

#: how far a rig's axis is leant, rad; far enough for gravity to show in the disc's plane, and easily done
LEAN = radians(10.0)
#: rates of a table and a rig are not asked for beyond these shares of those in hand
_FASTER = 1.5
#: a rig turns its candidates from this yaw, rad: any
_YAW = 0.3
_WINDS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


@dataclass(frozen=True)
class Plan:
    """A recording that could be made.

    ``text`` says in words what to do, ``state`` (13,) is where its motion starts, as a piece's (see
    `validation.identification.dynamics`; of a free spin without what the air does), ``duration`` its length in s; a
    flight ends on the ground at the latest.
    ``command`` are a rate table's knots; ``lean`` how far a rig's axis is leant to north and east, rad, known to the
    person roughly and to the diagnosis not at all.
    """

    text: str
    state: FloatArray
    duration: float
    command: Samples | None = None
    lean: tuple[float, float] = (0.0, 0.0)


def plans_about(chain: Chain, longest: float) -> list[Plan]:
    """Return recordings about one in hand: first the same again, then others.

    ``longest`` is the length in s of the longest recording in hand.
    """
    return _PLANS[chain.recording.plant](chain, longest)


# ------------------------------------------------------------------------------------------------ flights


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


def _flights(chain: Chain, longest: float) -> list[Plan]:
    base = chain.states[0]
    again = Plan(f"the same again: {_throw_in_words(base)}", base, float(chain.edges[-1]))
    thrown = [_thrown(base, throw) for throw in _THROWS]
    return [again, *(Plan(_throw_in_words(state), state, 1.5 * longest) for state in thrown)]


def _thrown(state: FloatArray, throw: _Throw) -> FloatArray:
    """Return the state (13,) of another throw: turned as a whole, but for the bank, which turns the disc alone."""
    new = state.copy()
    heading = atan2(new[4], new[3])
    forward, right = np.array([cos(heading), sin(heading), 0.0]), np.array([-sin(heading), cos(heading), 0.0])
    q, velocity = new[6:10], throw.speed * new[3:6]
    if throw.spin < 0:  # as the other hand throws it: the disc leans to the other side, the wobble keeps its size
        down = body_to_ned(q)[:, 2]
        q = multiply(_between(down, down - 2.0 * (down @ right) * right), q)
    q = multiply(turn(radians(throw.bank) * forward), q)
    whole = multiply(turn(np.array([0.0, 0.0, radians(throw.heading)])), turn(radians(throw.up) * right))
    new[3:6], new[6:10] = body_to_ned(whole) @ velocity, multiply(whole, q)
    new[12] *= throw.spin
    return new


def _between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the quaternion (4,) of the least turn that takes unit vector a (3,) to b."""
    across = np.cross(a, b)
    size = float(np.linalg.norm(across))
    return turn(across * (atan2(size, float(a @ b)) / size if size > 0 else 0.0))


def _throw_in_words(state: FloatArray) -> str:
    velocity, down = state[3:6], body_to_ned(state[6:10])[:, 2]
    speed, heading = float(np.linalg.norm(velocity)), atan2(velocity[1], velocity[0])
    up = degrees(asin(-velocity[2] / max(speed, 1e-9)))
    lean = degrees(atan2(-down @ np.array([-sin(heading), cos(heading), 0.0]), down[2]))
    climb = f"{abs(up):.0f}° {'up' if up >= 0 else 'down'}"
    side = f"its {'right' if lean > 0 else 'left'} edge {abs(lean):.0f}° down" if abs(lean) >= 0.5 else "level"
    return f"a throw at {speed:.0f} m/s with {_turns(state[12])}, {climb}, {side}, {_towards(heading)}"


def _turns(rate: float) -> str:
    way = "clockwise" if rate >= 0 else "anticlockwise"
    return f"{abs(rate) / (2 * pi):.1f} turns a second {way} seen from above"


def _towards(heading: float) -> str:
    angle = degrees(heading) % 360.0
    return f"towards {_WINDS[round(angle / 45.0) % 8]} ({angle:.0f}°)"


# --------------------------------------------------------------------------------------------------- rigs


def _run_downs(chain: Chain, longest: float) -> list[Plan]:
    rate, end = float(chain.states[0, 1]), float(chain.edges[-1])

    def plan(factor: float, duration: float, lean: tuple[float, float] = (0.0, 0.0), before: str = "") -> Plan:
        state = _rig_state(factor * rate)
        return Plan(before + _run_down_in_words(factor * rate, duration, lean), state, duration, lean=lean)

    return [
        plan(1.0, end, before="the same again: "),
        *(plan(factor, longest) for factor in (0.25, 0.5, 1.5, 2.0)),
        *(plan(factor, longest) for factor in (-0.5, -1.0, -2.0)),
        *(plan(factor, 3.0 * longest) for factor in (0.5, 1.0, 2.0)),
        *(plan(factor, longest, (LEAN, 0.0)) for factor in (0.5, 1.0, 2.0, -1.0)),
        plan(1.0, longest, (0.0, LEAN)),
    ]


def _rig_state(rate: float) -> FloatArray:
    state = np.zeros(13)
    state[:2] = _YAW, rate
    return state


def _run_down_in_words(rate: float, duration: float, lean: tuple[float, float]) -> str:
    return f"a run-down from {_turns(rate)}, for {duration:.0f} s{_leaning(lean)}"


def _leaning(lean: tuple[float, float]) -> str:
    size = hypot(*lean)
    if size == 0.0:
        return ""
    return (
        f", the rig leant so that its axis points {degrees(size):.0f}° off the vertical, {_towards(atan2(*lean[::-1]))}"
    )


def _table_runs(chain: Chain, longest: float) -> list[Plan]:
    command = chain.recording.command
    assert command is not None
    t, rate = np.array(command.t), np.array(command.value)
    top, end = float(np.max(np.abs(rate))), float(t[-1])
    most = _turns(top).split(" clockwise")[0]
    ramp = min(1.0, 0.1 * end)
    steps = np.array([0.0, ramp, 0.25 * end, 0.25 * end + ramp, 0.5 * end, 0.5 * end + 2 * ramp, 0.75 * end, end])

    def plan(text: str, t: FloatArray, rate: FloatArray, lean: tuple[float, float] = (0.0, 0.0)) -> Plan:
        knots = Samples(t, rate)
        state = np.zeros(13)
        state[0] = _YAW
        return Plan(text + _leaning(lean), state, float(t[-1]), knots, lean)

    back = np.concatenate([t, end + ramp + t])
    pointed = end * np.array([0.0, 0.25, 0.75, 1.0])
    return [
        plan("the same profile again", t, rate),
        plan("the same profile in the other direction", t, -rate),
        plan("the same profile at half the rates", t, 0.5 * rate),
        plan(f"the same profile at {_FASTER:g} times the rates", t, _FASTER * rate),
        plan("the same profile, everything taking three times as long", 3.0 * t, rate),
        plan("the same profile in one direction and then in the other", back, np.concatenate([rate, -rate])),
        plan(f"{end:.0f} s at rest", t[[0, -1]], np.zeros(2)),
        plan(f"{end:.0f} s at a steady {most}", t[[0, -1]], np.full(2, top)),
        plan(f"{end:.0f} s at a steady {_turns(0.1 * top)}", t[[0, -1]], np.full(2, 0.1 * top)),
        plan(
            f"up to {most}, evenly through rest to as many in the other direction, and back, within {end:.0f} s",
            pointed,
            top * np.array([0.0, 1.0, -1.0, 0.0]),
        ),
        plan(
            f"plateaus of {end / 4:.0f} s at {most} in one direction, at rest, and in the other",
            steps,
            top * np.array([0.0, 1.0, 1.0, 0.0, 0.0, -1.0, -1.0, 0.0]),
        ),
        plan("the same profile", t, rate, (LEAN, 0.0)),
        plan("the same profile in the other direction", t, -rate, (LEAN, 0.0)),
        plan("the same profile at half the rates", t, 0.5 * rate, (0.0, LEAN)),
    ]


# --------------------------------------------------------------------------------------------- free spins


def _free_spins(chain: Chain, longest: float) -> list[Plan]:
    start, end = np.concatenate([np.zeros(6), chain.states[0, 6:]]), float(chain.edges[-1])

    def plan(spin: float, wobble: float, tip: float = 0.0, duration: float = longest, before: str = "") -> Plan:
        state = start.copy()
        state[6:10] = multiply(turn(np.array([0.0, radians(tip), 0.0])), state[6:10])
        state[10:12] *= wobble
        state[12] *= spin
        return Plan(before + _spin_in_words(state, duration), state, duration)

    return [
        plan(1.0, 1.0, duration=end, before="the same again: "),
        *(plan(spin, 1.0) for spin in (0.5, 0.75, 1.5, -1.0, -0.5)),
        *(plan(spin, wobble) for spin, wobble in ((1.0, 0.3), (1.0, 3.0), (0.5, 3.0), (-1.0, 3.0))),
        *(plan(spin, 1.0, tip) for spin, tip in ((1.0, 45.0), (1.0, 90.0), (-1.0, 90.0))),
        plan(1.0, 1.0, duration=2.0 * longest),
    ]


def _spin_in_words(state: FloatArray, duration: float) -> str:
    down = body_to_ned(state[6:10])[:, 2]
    tip = degrees(atan2(hypot(down[0], down[1]), down[2]))
    wobble = degrees(hypot(state[10], state[11]))
    pose = f"its axis {tip:.0f}° off the vertical"
    return f"a free spin at {_turns(state[12])}, {pose}, wobbling at {wobble:.0f}°/s, for {duration:.1f} s"


_PLANS: Mapping[Plant, Callable[[Chain, float], list[Plan]]] = {
    "flight": _flights,
    "spin_down": _run_downs,
    "rate_table": _table_runs,
    "free_spin": _free_spins,
}

# ------------------------------------------------------------------------------------------ a person's own


def read_plans(path: Path, plant: Plant) -> list[Plan]:
    """Read the recordings that a person could make: an array of tables ``[[recording]]`` in a TOML file.

    Each may have a ``text``, which the report shows; the other keys are those of a throw file (flight; of a free spin
    without position and velocity), ``rate_rad_s`` (spin_down) or ``time_s`` and ``rate_rad_s`` (rate_table), and
    ``duration_s``; a rig may be leant by ``tilt_north_rad`` and ``tilt_east_rad``. Raises `InputError`.
    """
    file = read_toml(path)
    tables = file.tables("recording")
    if not tables:
        raise file.error(None, "no recording named; expected one or more tables [[recording]]")
    file.finish()
    return [_READ[plant](table) for table in tables]


#: a throw ends on the ground, at the latest after this long, s
_LONGEST_THROW = 15.0


def _read_throw(table: TomlTable) -> Plan:
    text, duration = table.text("text", required=False), table.number("duration", "s", required=False, positive=True)
    state = _release_state(table, Release.from_toml(table))
    return Plan(text or _throw_in_words(state), state, duration or _LONGEST_THROW)


def _release_state(table: TomlTable, release: Release) -> FloatArray:
    try:
        position, velocity, C_NB, rate = release.start()
    except InputError as error:
        raise table.error(None, str(error)) from None
    return np.concatenate([position, velocity, quaternion_from_matrix(C_NB), rate])


def _read_run_down(table: TomlTable) -> Plan:
    text, rate = table.text("text", required=False), table.need("rate", "rad_s")
    duration, lean = table.need("duration", "s", positive=True), _read_lean(table)
    table.finish()
    return Plan(text or _run_down_in_words(rate, duration, lean), _rig_state(rate), duration, lean=lean)


def _read_lean(table: TomlTable) -> tuple[float, float]:
    north, east = (table.number(f"tilt_{way}", "rad", required=False) or 0.0 for way in ("north", "east"))
    return north, east


def _read_table_run(table: TomlTable) -> Plan:
    text, t, rate, lean = table.text("text", required=False), *_knots(table), _read_lean(table)
    table.finish()
    words = f"a profile of {t.size} knots up to {_turns(float(np.max(np.abs(rate)))).split(' clockwise')[0]}"
    state = np.zeros(13)
    state[0] = _YAW
    return Plan(text or words + _leaning(lean), state, float(t[-1]), Samples(t, rate), lean)


def _knots(table: TomlTable) -> tuple[FloatArray, FloatArray]:
    t, rate = table.numbers("time_s"), table.numbers("rate_rad_s")
    assert t is not None
    assert rate is not None
    if t.size != rate.size or t.size < 2:
        raise table.error("rate_rad_s", f"{t.size} times and {rate.size} rates; expected as many, at least 2")
    if t[0] != 0.0 or np.any(np.diff(t) <= 0):
        raise table.error("time_s", "expected times that ascend from 0 s, the start of the recording")
    return t, rate


def _read_free_spin(table: TomlTable) -> Plan:
    text, duration = table.text("text", required=False), table.need("duration", "s", positive=True)
    angles = [table.number(name, "rad", required=False) or 0.0 for name in ("roll", "pitch", "yaw")]
    rate = table.vector("body_rate", "rad_s")
    assert rate is not None
    table.finish()
    state = np.concatenate([np.zeros(6), quaternion_from_euler(*angles), rate])
    return Plan(text or _spin_in_words(state, duration), state, duration)


_READ: Mapping[Plant, Callable[[TomlTable], Plan]] = {
    "flight": _read_throw,
    "spin_down": _read_run_down,
    "rate_table": _read_table_run,
    "free_spin": _read_free_spin,
}
