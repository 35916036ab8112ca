"""A rate table: it turns as it is commanded. A state is yaw and the angle turned since the start, rad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled, compiled_nogil
from discsim.effects.rig import speed_ripple
from discsim.recording import Recording, Samples
from discsim.toml_table import TomlTable
from discsim.validation.identification.dynamics import physics_of
from discsim.validation.identification.initial.spin_phase import rig_initial_states
from discsim.validation.identification.parameters import AllowedDefects
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
from discsim.validation.identification.plants.rig import LEAN, YAW, leaning, read_lean, rig_row_within
from discsim.validation.identification.readings import Readings

__all__ = ["RATE_TABLE"]

#: where the numbers of a state stand
_YAW, _TURNED = 0, 1
#: a state moves by turning further, and by having started elsewhere: only the first moves the table in its ripple, so
#: that slopes that pass from one segment to the next have to keep them apart
_MOVES = ((1.0, 1.0), (1.0, 0.0))
#: the angle turned is zero at the start by definition: held there, rad, far within what readings tell of a phase
_AT_START = 1e-7

# ---------------------------------------------------------------------------------------------------- its motion

#: longest step of the integrator, s, and in radians of the table's ripple
_STEP, _RIPPLE = 0.01, 0.3


def _longest_step(given: Given, state: FloatArray, start: float, stop: float) -> float:
    del state
    # the fastest the table turns in this segment
    inside = np.interp([start, stop], *given.knots)
    within = given.knots[1, (given.knots[0] > start) & (given.knots[0] < stop)]
    turning = float(np.max(np.abs(np.concatenate([inside, within]))))
    return min(_STEP, _RIPPLE / max(given.order * turning, 1.0))


def _corners(given: Given, start: float, stop: float) -> list[float]:
    return [float(t) for t in given.knots[0] if start < t < stop]


def _consistent(states: FloatArray) -> FloatArray:
    """Return states (k, 2) whose angle turned so far goes along with the yaw."""
    new = states.copy()
    new[:, _TURNED] = states[:, _YAW] - states[0, _YAW]
    return new


@compiled
def _commanded(p: Any, knots: FloatArray, t: float, psi: float) -> tuple[float, float]:
    """Rate (rad/s) and angular acceleration of a table at time t that has turned by psi; knots (2, n)."""
    n = knots.shape[1]
    k = min(max(np.searchsorted(knots[0], t, side="right") - 1, 0), n - 2)
    slope = (knots[1, k + 1] - knots[1, k]) / (knots[0, k + 1] - knots[0, k])
    command = knots[1, k] + (min(max(t, knots[0, 0]), knots[0, n - 1]) - knots[0, k]) * slope
    if t < knots[0, 0] or t > knots[0, n - 1]:
        slope = 0.0
    if command == 0.0 and slope == 0.0:
        return 0.0, 0.0
    ripple, _ = speed_ripple(p.rig_speed_ripple, psi, 0.0)
    r = command + ripple
    return r, slope + speed_ripple(p.rig_speed_ripple, psi, r)[1]


@compiled_nogil
def table_segments(
    flats: FloatArray,
    knots: FloatArray,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Turn a table along its command knots (2, n); of states (c, 13) the yaw and the angle turned so far count.

    ``times`` should hold the knots within the segment. Else as `flight_segments`.
    """
    n = times.size
    turned, r, slope = np.empty(n), np.empty(n), np.empty(n)
    for c in range(states.shape[0]):
        p = physics_of(flats[c])
        turned[0] = states[c, 1]
        yaw = states[c, 0] - states[c, 1]
        for k in range(n - 1):
            h = times[k + 1] - times[k]
            inside = 1e-9 * h  # a step that starts on a knot belongs to the segment after it
            first, slope[k] = _commanded(p, knots, times[k] + inside, turned[k])
            r[k] = first
            second, _ = _commanded(p, knots, times[k] + 0.5 * h, turned[k] + 0.5 * h * first)
            third, _ = _commanded(p, knots, times[k] + 0.5 * h, turned[k] + 0.5 * h * second)
            end, _ = _commanded(p, knots, times[k + 1] - inside, turned[k] + h * third)
            turned[k + 1] = turned[k] + h / 6.0 * (first + 2.0 * second + 2.0 * third + end)
        r[n - 1], slope[n - 1] = _commanded(p, knots, times[n - 1] + 1e-12, turned[n - 1])
        for j in range(out.size):
            k = min(max(np.searchsorted(times, out[j], side="right") - 1, 0), n - 2)
            h = times[k + 1] - times[k]
            # the end's rate as this step sees it: a ramp may end there
            end, end_slope = _commanded(p, knots, times[k + 1] - 1e-9 * h, turned[k + 1])
            rig_row_within(p, yaw, turned[k], (r[k], slope[k], end, end_slope), h, out[j] - times[k], rows[c, j])
        ends[c] = 0.0
        ends[c, 0], ends[c, 1] = yaw + turned[last], turned[last]


def _states(recording: Recording, t: FloatArray, ratio: float) -> FloatArray:
    del ratio
    yaw, _ = rig_initial_states(recording, t)
    return np.stack([yaw, yaw - yaw[0]], axis=1)


def _lacks(recording: Recording) -> str | None:
    if recording.command is not None:
        return None
    return "a rate_table needs command.csv, the rate that was asked for; add it"


# ------------------------------------------------------------------------------------------------ what it observes

#: a table turns a corner of its command within some of the time constants of its speed loop, s
_CORNER = 4e-3


def _observed(recording: Recording, readings: Readings) -> Sequence[Readings]:
    if readings.sensor != "accelerometer" or recording.command is None:
        return (readings,)
    # there a real table's angular acceleration is neither that before the knot nor that after it
    apart = np.abs(readings.t[:, None] - recording.command.t[None, :])
    return (replace(readings, good=readings.good & (np.min(apart, axis=1, initial=np.inf)[:, None] > _CORNER)),)


# ------------------------------------------------------------------------------------------- its next recordings

#: rates are not asked for beyond this share of those in hand
_FASTER = 1.5


def _about(recording: Recording, base: FloatArray, end: float, longest: float) -> list[Plan]:
    del base, end, longest
    command = recording.command
    assert command is not None
    t, rate = np.array(command.t), np.array(command.value)
    top, end = float(np.max(np.abs(rate))), float(t[-1])
    most = _most(rate)
    ramp = min(1.0, 0.1 * end)
    steps = np.array([0.0, ramp, 0.25 * end, 0.25 * end + ramp, 0.5 * end, 0.5 * end + 2 * ramp, 0.75 * end, end])

    def plan(text: str, t: FloatArray, rate: FloatArray, lean: tuple[float, float] = (0.0, 0.0)) -> Plan:
        knots = Samples(t, rate)
        return Plan(text + leaning(lean), _at_rest(), float(t[-1]), knots, lean)

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
        plan(f"{end:.0f} s at a steady {turns(0.1 * top)}", t[[0, -1]], np.full(2, 0.1 * top)),
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


def _at_rest() -> FloatArray:
    return np.array([YAW, 0.0])


def _most(rate: FloatArray) -> str:
    return turns(float(np.max(np.abs(rate)))).split(" clockwise")[0]


def _read(table: TomlTable) -> Plan:
    text, t, rate, lean = table.text("text", required=False), *_knots(table), read_lean(table)
    table.finish()
    words = f"a profile of {t.size} knots up to {_most(rate)}"
    return Plan(text or words + leaning(lean), _at_rest(), float(t[-1]), Samples(t, rate), lean)


def _knots(table: TomlTable) -> tuple[FloatArray, FloatArray]:
    t, rate = table.numbers("time_s"), table.numbers("rate_rad_s")
    assert t is not None
    assert rate is not None
    if t.size != rate.size or t.size < 2:
        raise table.error("rate_rad_s", f"{t.size} times and {rate.size} rates; expected as many, at least 2")
    if t[0] != 0.0 or np.any(np.diff(t) <= 0):
        raise table.error("time_s", "expected times that ascend from 0 s, the start of the recording")
    return t, rate


RATE_TABLE = Plant(
    name="rate_table",
    motion="run of the table",
    layout=Layout(2, yaw=_YAW, moves=_MOVES),
    dynamics=Dynamics(
        propagated_by(table_segments, lambda given, own: given.knots), _longest_step, _corners, _consistent
    ),
    initial=Initial(_states),
    sizes=Sizes(  # rad
        differences=np.array([1e-5, 1e-5]),
        unknown=np.array([_AT_START, 1e6]),
        continuous=AllowedDefects(np.zeros(2)),
        relaxed=AllowedDefects(np.array([0.5, 0.0])),
    ),
    # ten minutes of a rig; the plateaus of a profile for its setup
    durations=Durations(segment=1.0, first_look=30.0, window=1.0, longest=600.0, setup=300.0),
    lacks=_lacks,
    observed=_observed,
    commanded=True,
    design=Design(_about, _read),
)
