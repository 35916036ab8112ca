"""A free spin: a disc turns in the air and nothing tells its path, as with sensors of one board alone.

==========  ============================================================================================================
numbers     meaning
==========  ============================================================================================================
0, 1        transverse angular acceleration that is no rigid-body motion, in B at the segment's start (x, y), rad/s^2
2, 3        its slope, rad/s^3
4, 5        rdot/r, 1/s, and its slope, 1/s^2
6 to 9      attitude
10 to 12    body rates, rad/s
13          how much faster the wobble turns than by its course, rad/s
14, 15      how the stiffness of the air bends (x, y), 1/rad
16, 17      transverse angular acceleration that is fixed in the body (x, y), rad/s^2; of a body out of balance alone
==========  ============================================================================================================
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import atan2, degrees, hypot, radians

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.effects.kind import BOARD
from discsim.frames import body_to_ned, multiply, quaternion_from_euler, turn
from discsim.recording import Recording
from discsim.toml_table import TomlTable
from discsim.validation.identification.dynamics import FASTEST
from discsim.validation.identification.initial.flight import spin_initial_states
from discsim.validation.identification.parameters import AllowedDefects, Parameter
from discsim.validation.identification.plants.free_spin_motion import free_spin_segments
from discsim.validation.identification.plants.plan import Plan, turns
from discsim.validation.identification.plants.plant import (
    Design,
    Durations,
    Dynamics,
    Given,
    Initial,
    Layout,
    Plant,
    Sizes,
    propagated_by,
)
from discsim.validation.identification.readings import Readings

__all__ = ["FREE_SPIN"]

_NAME = "free_spin"
#: where the numbers of a state stand; the last two are a moment fixed in the body, which only one out of balance has
_DECAY, _ATTITUDE, _RATE, _SPIN = 4, slice(6, 10), slice(10, 13), 12
_SIZE = 18

# ---------------------------------------------------------------------------------------------------- its motion

#: longest step, s: the moments of the air change within 20 ms of release; and in radians of nutation: over 0.2 s at
#: 120 rad/s a wobble of 3.6 rad/s is 1.2e-4 rad/s off, a thirtieth of a good gyroscope's noise
_STEP, _NUTATION = 0.005, 0.22


def _longest_step(given: Given, state: FloatArray, start: float, stop: float) -> float:
    del given, start, stop
    return min(_STEP, _NUTATION / max(min(abs(float(state[_SPIN])), FASTEST) * 2.0, 1.0))


#: how the wobble dies (1/s) and turns (rad/s), how that differs along and across the wind, and their slopes in time:
#: what the air may do at ordinary stiffness, one sigma; and how much of what damps the rolling turns the spin, by rates
#: about the north and the east: Ixx/Izz times the decay times the angle of attack, 0.5 * 5 1/s * 0.4 rad
_WOBBLE = (
    *(
        Parameter(_NAME, f"{name}_{unit}", 0.0, 1e-3, sigma)
        for name, sigma in (("decay", 5.0), ("turn", 10.0), ("along", 2.0), ("across", 2.0))
        for unit in ("1_s", "1_s2")
    ),
    Parameter(_NAME, "decay_1_s3", 0.0, 1e-3, 5.0),
    Parameter(_NAME, "turn_1_s3", 0.0, 1e-3, 10.0),
    *(
        Parameter(_NAME, f"spun_by_{axis}_{unit}", 0.0, 1e-3, sigma)
        for axis in ("north", "east")
        for unit, sigma in (("1_s", 1.0), ("1_s2", 2.0))
    ),
)


#: what a lagging accelerometer holds of the hand that threw, m/s^2: releases of a disc reach 100 m/s^2 and more
_HELD = tuple(Parameter(_NAME, f"held_{axis}_m_s2", 0.0, 0.1, 100.0) for axis in "xyz")

#: what a magnetometer's zero wanders between recordings of a logger that switches nothing off between them, uT: the
#: centres of the circles that the field of an instrumented disc runs, four throws of a day from 26 to 34 degC, lie 0.6
#: and 1.2 uT about their mean along x and y (FlatBall's log, its MMC5983MA)
_ZEROS = tuple(Parameter(_NAME, f"zero_{axis}_uT", 0.0, 0.01, 1.0) for axis in "xyz")


def _nodes(recording: Recording, segment: float) -> FloatArray:
    """Return the nodes (k + 1,) of segments, s: just after release the moments of the air change fast."""
    end = max(recording.end, 1e-3) + 1e-6
    first = np.concatenate([np.arange(0.0, 0.2, 0.025), np.arange(0.2, 0.4, 0.05), np.arange(0.4, 0.8, 0.1)])
    if end < 0.9:
        return np.append(first[first < end - 0.02], end)
    return np.concatenate([first, np.linspace(0.8, end, max(1, round((end - 0.8) / segment)) + 1)])


def _states(recording: Recording, t: FloatArray, ratio: float) -> FloatArray:
    starts = spin_initial_states(recording, np.minimum(t * ratio, recording.end))
    states = np.zeros((t.size, _SIZE))
    states[:, _ATTITUDE], states[:, _RATE] = starts.attitude, starts.rate
    states[:, _SPIN] *= ratio
    r = starts.rate[:, 2]
    if r.size > 1:
        np.divide(np.gradient(r, t), r, out=states[:, _DECAY], where=r != 0.0)
    return states


def _other_attitudes(recording: Recording) -> tuple[FloatArray, ...]:
    return spin_initial_states(recording, np.zeros(1)).ambiguous


def _lacks(recording: Recording) -> str | None:
    """Refuse what was seen from outside alone: nothing of it would be compared, and so nothing would seem missing."""
    if not recording.samples or not BOARD.isdisjoint(recording.samples):
        return None
    return (
        "a free spin needs a sensor on board that shows it turning (magnetometer, gyroscope or accelerometer); "
        'a path alone is told as plant = "flight", with [disc] and air_density_kg_m3'
    )


def _grows_with(t: FloatArray, states: FloatArray) -> dict[str, FloatArray]:
    transverse = states[:, _RATE][:, :2]
    return {
        "time": t,
        "spin": np.abs(states[:, _SPIN]),
        "wobble": np.hypot(transverse[:, 0], transverse[:, 1]),
    }


# ------------------------------------------------------------------------------------------------ what it observes


def _observed(recording: Recording, readings: Readings) -> Sequence[Readings]:
    return _over_turns(recording, readings) if readings.sensor == "accelerometer" else (readings,)


#: a reading of a turn's mean is a mean over this many turns, weighted as if a turn's mean were taken three times: what
#: turns once per turn is not seen, nor its slope, nor its curvature
_TURNS = 3.0
#: what lift that changes within a turn leaves in the first mean, just after release, m/s^2 on each axis: 0.0038 rms and
#: 0.014 in 99 of 100 of 266 throws of drawn discs, noise left out; in later ones it is below their noise
_JUST_RELEASED = 0.0045


def _over_turns(recording: Recording, one: Readings) -> list[Readings]:
    """Return the means over turns of an accelerometer on a disc whose path is unknown.

    Translation and gravity turn with the spin and average out; what remains of x and y is centripetal.
    """
    grid = np.linspace(0.0, recording.end, max(int(recording.end / 0.05), 2))
    rate = spin_initial_states(recording, grid).rate[:, 2]
    phase = np.interp(one.t, grid, cumulative_trapezoid(rate, grid, initial=0))
    phase = np.abs(phase) / (2.0 * np.pi)
    centres = np.arange(phase[0] + _TURNS / 2, phase[-1] - _TURNS / 2, _TURNS / 2)
    first, last = np.searchsorted(phase, centres - _TURNS / 2), np.searchsorted(phase, centres + _TURNS / 2)
    if centres.size < 4 or np.any(np.diff(phase) < 0) or np.min(last - first) < 8:
        return []
    width = int(np.max(last - first))
    place = np.minimum(first[None, :] + np.arange(width)[:, None], one.t.size - 1)
    inside = np.arange(width)[:, None] < (last - first)[None, :]
    usable = np.all(one.good[:, :2], axis=1)
    off = np.abs(phase[place] - centres)
    bell = np.where(off < 0.5, 0.75 - off**2, 0.5 * np.maximum(_TURNS / 2 - off, 0.0) ** 2)
    weights = np.where(inside & usable[place], bell, 0.0)
    # where samples are missing, what turns with the spin does not average out
    whole = np.sum(inside & ~usable[place], axis=0) == 0
    weighed = np.sum(weights, axis=0) > 0.0
    if not weighed.any() and not one.clipped.any():
        return []
    weights = weights / np.maximum(np.sum(weights, axis=0), 1e-12)
    good = np.repeat(whole[:, None], 3, axis=1)
    good[:, 2] = False
    t = np.einsum("wn,wn->n", weights, one.t[place])
    # one that stands at its limit throughout keeps its place, to be located there
    taken = weights[:, whole if whole.any() else weighed] if weighed.any() else weights
    sd = one.sd * float(np.sqrt(np.median(np.sum(taken**2, axis=0))))
    weights[:, 0] *= _trust_in_first(sd[:2])
    values = np.einsum("wn,wnk->nk", weights, np.nan_to_num(one.value)[place])
    clipped = np.zeros(values.shape, dtype=np.bool_)
    return [Readings(one.sensor, t, values, good, clipped, sd, one.axes, None, one.t[place], weights)]


def _trust_in_first(sd: FloatArray) -> float:
    """Return the factor that brings the first mean over turns, louder by what is left of lift, to the sd of the others.

    What it predicts and what it says are scaled alike. ``sd`` are those of the means, NaN where nothing is stated.
    """
    usual = float(np.max(sd))
    return usual / hypot(usual, _JUST_RELEASED) if np.isfinite(usual) else 1.0


# ------------------------------------------------------------------------------------------- its next recordings


def _about(recording: Recording, base: FloatArray, end: float, longest: float) -> list[Plan]:
    del recording
    start = base.copy()
    start[: _ATTITUDE.start] = 0.0

    def plan(spin: float, wobble: float, tip: float = 0.0, duration: float = longest, before: str = "") -> Plan:
        state = start.copy()
        attitude = state[_ATTITUDE]
        state[_ATTITUDE] = multiply(turn(np.array([0.0, radians(tip), 0.0])), attitude)
        state[_RATE] *= np.array([wobble, wobble, spin])
        return Plan(before + _in_words(state, duration), state, duration)

    return [
        plan(1.0, 1.0, duration=end, before="the same again: "),
        *(plan(spin, 1.0) for spin in (0.5, 0.75, 1.5, -1.0, -0.5)),
        *(plan(spin, wobble) for spin, wobble in ((1.0, 0.3), (1.0, 3.0), (0.5, 3.0), (-1.0, 3.0))),
        *(plan(spin, 1.0, tip) for spin, tip in ((1.0, 45.0), (1.0, 90.0), (-1.0, 90.0))),
        plan(1.0, 1.0, duration=2.0 * longest),
    ]


def _in_words(state: FloatArray, duration: float) -> str:
    down = body_to_ned(state[_ATTITUDE])[:, 2]
    tip = degrees(atan2(hypot(down[0], down[1]), down[2]))
    p, q, r = state[_RATE]
    pose = f"its axis {tip:.0f}° off the vertical"
    return f"a free spin at {turns(r)}, {pose}, wobbling at {degrees(hypot(p, q)):.0f}°/s, for {duration:.1f} s"


def _read(table: TomlTable) -> Plan:
    text, duration = table.text("text", required=False), table.need("duration", "s", positive=True)
    angles = [table.number(name, "rad", required=False) or 0.0 for name in ("roll", "pitch", "yaw")]
    rate = table.vector("body_rate", "rad_s")
    assert rate is not None
    table.finish()
    state = np.zeros(_SIZE)
    state[_ATTITUDE], state[_RATE] = quaternion_from_euler(*angles), rate
    return Plan(text or _in_words(state, duration), state, duration)


def _as_in_hand(planned: FloatArray, states: FloatArray) -> FloatArray:
    """Return a planned state (s,) whose spin dies at the pace that it had in a recording in hand."""
    state = planned.copy()
    state[_DECAY] = float(np.mean(states[:, _DECAY]))
    return state


#: how the slopes of what is not modelled change from segment to segment, rad/s^3 and 1/s^2, and how much faster stiffer
#: air turns the wobble, rad/s, and how its stiffness bends, 1/rad; for good
_WANDER = np.array([0, 0, 300.0, 300.0, 0, 0.02, 0, 0, 0, 0, 0, 0, 0.5, 0.5, 0.5])
#: what a moment of the air with two lobes, which turns with twice the spin in the air and once in the body, adds to the
#: transverse rates in a segment, rad/s: near Izz/Ixx = 2 that is in step with the wobble, so that it grows or dies. A
#: twentieth of C_M = 0.012 at 15 m/s, 1.2e-3 N m on a disc of 1.2e-3 kg m^2, is 1 rad/s^2, for 0.2 s, on two axes
_LOBES = 0.14
_COUNTED = _WANDER.copy()
_COUNTED[9:11] = _LOBES
_RELAXED = _WANDER.copy()
_RELAXED[6:9], _RELAXED[9:12] = 0.05, 0.3
#: half the differences by which slopes are taken, and what is known of a state without any reading
_DIFFERENCES = np.array([1e-2, 1e-2, 1e-2, 1e-2, 1e-4, 1e-4, *[1e-5] * 3, *[1e-4] * 3, 1e-3, 3e-3, 3e-3])
_UNKNOWN = np.array([100.0, 100.0, 100.0, 100.0, 3.0, 3.0, *[30.0] * 3, *[1e3] * 3, 0.01, 0.5, 0.5])
#: a moment fixed in the body, rad/s^2, at release and how it changes from segment to segment: the lift of a disc that
#: flies level, 1.7 N, about a centre of mass 1 mm beside the middle turns 7e-4 kg m^2 by 2.5 rad/s^2; most of it may
#: come within a segment, with what moves out
_IN_BODY, _CHANGES = 5.0, 2.0
#: how the slope of the spin's decay changes then, 1/s^2: 7 g that move 35 mm out slow 1.2e-3 kg m^2 by 0.7 % in 0.3 s
_SLOWED = 0.2

_BALANCED = Plant(
    name=_NAME,
    motion="free spin",
    layout=Layout(_SIZE, attitude=_ATTITUDE, rate=_RATE, spin=_SPIN, per_time=(_DECAY, _SPIN), still=2),
    dynamics=Dynamics(propagated_by(free_spin_segments, lambda given, own: own), _longest_step),
    initial=Initial(_states, _other_attitudes),
    sizes=Sizes(
        differences=_DIFFERENCES,
        unknown=_UNKNOWN,
        continuous=AllowedDefects(_WANDER),
        relaxed=AllowedDefects(_RELAXED),
        counted=AllowedDefects(_COUNTED),
        # where a table of moments has a corner, a wobble across it bends within a segment: 1 and 2 % of one of 0.3 to
        # 0.9 rad/s, for a turn and a half, of a disc as stated
        of_wobble=0.03,
    ),
    # its beginning follows anything, or nothing before it is fitted whole: it is looked at for the figures of the
    # answer alone, once spin rates are apart. Just after release the wobble is largest, and what the air does to it is
    # not modelled in every detail; an event so early is not told from where the spin and its decay started
    durations=Durations(
        segment=0.2,
        first_look=0.3,
        window=0.4,
        longest=20.0,
        setup=60.0,
        event_near=0.2,
        event_from=0.1,
        settled=0.4,
    ),
    nodes=_nodes,
    own=_WOBBLE,
    held=_HELD,
    zeros=_ZEROS,
    hardware=("disc",),
    lacks=_lacks,
    observed=_observed,
    path_known=False,
    weakly_identified=True,
    base_steps=16,
    grows_with=_grows_with,
    design=Design(_about, _read, _as_in_hand),
)


def _and_in_body(sizes: FloatArray, in_body: float) -> FloatArray:
    return np.append(sizes, [in_body, in_body])


def _and_moves_out(defects: FloatArray) -> AllowedDefects:
    found = _and_in_body(defects, _CHANGES)
    found[_DECAY + 1] = _SLOWED
    return AllowedDefects(found)


FREE_SPIN = replace(
    _BALANCED,
    unbalanced=replace(
        _BALANCED,
        layout=replace(_BALANCED.layout, still=0),
        sizes=replace(
            _BALANCED.sizes,
            differences=_and_in_body(_DIFFERENCES, 1e-2),
            unknown=_and_in_body(_UNKNOWN, _IN_BODY),
            continuous=_and_moves_out(_WANDER),
            relaxed=_and_moves_out(_RELAXED),
            counted=_and_moves_out(_COUNTED),
        ),
    ),
)
