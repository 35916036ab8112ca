"""A run-down: a body on a bearing, spun up and left alone. A state is yaw psi (rad) and rate r (rad/s)."""

from __future__ import annotations

from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.bearing import bearing_torque
from discsim.compiled import compiled, compiled_nogil
from discsim.effects.events import spin_step
from discsim.parameters import Tables
from discsim.recording import Recording
from discsim.toml_table import TomlTable
from discsim.validation.identification.dynamics import acting_tables, physics_of
from discsim.validation.identification.initial.spin_phase import rig_initial_states
from discsim.validation.identification.parameters import AllowedDefects, Values
from discsim.validation.identification.plants.law_terms import Term
from discsim.validation.identification.plants.plan import Plan, turns
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
    propagated_by,
)
from discsim.validation.identification.plants.rig import LEAN, YAW, leaning, read_lean, rig_row_within

__all__ = ["SPIN_DOWN"]

#: where the numbers of a state stand
_YAW, _SPIN = 0, 1

# ---------------------------------------------------------------------------------------------------- its motion


#: longest step of the integrator, s, and in radians of what repeats in a turn
_STEP, _REPEATED = 0.01, 0.3


def _longest_step(given: Given, state: FloatArray, start: float, stop: float) -> float:
    del start, stop
    return min(_STEP, _REPEATED / max(given.order * abs(float(state[_SPIN])), 1.0))


@compiled
def _friction(p: Any, tables: Tables, t: float, psi: float, r: float) -> float:
    """Angular acceleration of a rig that runs down, rad/s^2."""
    return float(bearing_torque(p, tables, t, psi, r) / p.rig.Izz + spin_step(p.event_spin_step, t, r))


@compiled_nogil
def spin_down_segments(
    flats: FloatArray,
    tables: Tables,
    states: FloatArray,
    times: FloatArray,
    last: int,
    out: FloatArray,
    rows: FloatArray,
    ends: FloatArray,
) -> None:
    """Let a rig run down from states (c, 13) of which psi and r count; else as `flight_segments`."""
    n = times.size
    psi, r, slope = np.empty(n), np.empty(n), np.empty(n)
    for c in range(states.shape[0]):
        p, acting = physics_of(flats[c]), acting_tables(tables, flats[c])
        psi[0], r[0] = states[c, 0], states[c, 1]
        slope[0] = _friction(p, acting, times[0], psi[0], r[0])
        for k in range(n - 1):
            t, h = times[k], times[k + 1] - times[k]
            k1 = slope[k]
            r2 = r[k] + 0.5 * h * k1
            k2 = _friction(p, acting, t + 0.5 * h, psi[k] + 0.5 * h * r[k], r2)
            r3 = r[k] + 0.5 * h * k2
            k3 = _friction(p, acting, t + 0.5 * h, psi[k] + 0.5 * h * r2, r3)
            k4 = _friction(p, acting, t + h, psi[k] + h * r3, r[k] + h * k3)
            r[k + 1] = r[k] + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            psi[k + 1] = psi[k] + h * r[k] + h * h / 6.0 * (k1 + k2 + k3)
            slope[k + 1] = _friction(p, acting, times[k + 1], psi[k + 1], r[k + 1])
        _between(p, times, psi, r, slope, out, rows[c])
        ends[c] = 0.0
        ends[c, 0], ends[c, 1] = psi[last], r[last]


@compiled
def _between(
    p: Any, times: FloatArray, psi: FloatArray, r: FloatArray, slope: FloatArray, out: FloatArray, rows: FloatArray
) -> None:
    """Write rows (m, 19) at instants out by Hermite's cubics through the steps."""
    for j in range(out.size):
        k = min(max(np.searchsorted(times, out[j], side="right") - 1, 0), times.size - 2)
        ends = r[k], slope[k], r[k + 1], slope[k + 1]
        rig_row_within(p, 0.0, psi[k], ends, times[k + 1] - times[k], out[j] - times[k], rows[j])


def _states(recording: Recording, t: FloatArray, ratio: float) -> FloatArray:
    del ratio
    return np.stack(rig_initial_states(recording, t), axis=1)


def _lacks(recording: Recording) -> str | None:
    if recording.rig is not None:
        return None
    return "a spin_down needs [rig] with Izz_kg_m2 and viscous_N_m_s; add it to recording.toml"


def _grows_with(t: FloatArray, states: FloatArray) -> dict[str, FloatArray]:
    return {"time": t, "spin": np.abs(states[:, _SPIN])}


# --------------------------------------------------------------------------------------- unknown laws about it

#: exponents that are tried first; the fit leaves them
_POWERS = (-1.0, 0.0, 0.5, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)
_TERMS = (
    *(Term("moment_z_N_m", (("r", n),) if n else (), ("r",)) for n in _POWERS),
    # friction that changes with time, as a bearing warms
    *(Term("moment_z_N_m", (("r", 1.0),), ("r",), 1.0 / tau) for tau in (2.0, 4.0, 8.0, 16.0)),
    # places of a turn in which it holds, as poles or balls do
    *(Term("moment_z_N_m", order=order) for order in range(1, 9)),
)


def _symbols(recording: Recording, t: FloatArray, states: FloatArray, values: Values) -> dict[str, FloatArray]:
    del recording, values
    return {"t": t, "r": states[:, _SPIN]}


# ------------------------------------------------------------------------------------------- its next recordings


def _about(recording: Recording, base: FloatArray, end: float, longest: float) -> list[Plan]:
    del recording
    rate = float(base[_SPIN])

    def plan(factor: float, duration: float, lean: tuple[float, float] = (0.0, 0.0), before: str = "") -> Plan:
        state = np.array([YAW, factor * rate])
        return Plan(before + _in_words(factor * rate, duration, lean), state, duration, lean=lean)

    return [
        plan(1.0, end, before="the same again: "),
        *(plan(factor, longest) for factor in (0.25, 0.5, 1.5, 2.0)),
        *(plan(factor, longest) for factor in (-0.5, -1.0, -2.0)),
        *(plan(factor, 3.0 * longest) for factor in (0.5, 1.0, 2.0)),
        *(plan(factor, longest, (LEAN, 0.0)) for factor in (0.5, 1.0, 2.0, -1.0)),
        plan(1.0, longest, (0.0, LEAN)),
    ]


def _in_words(rate: float, duration: float, lean: tuple[float, float]) -> str:
    return f"a run-down from {turns(rate)}, for {duration:.0f} s{leaning(lean)}"


def _read(table: TomlTable) -> Plan:
    text, rate = table.text("text", required=False), table.need("rate", "rad_s")
    duration, lean = table.need("duration", "s", positive=True), read_lean(table)
    table.finish()
    return Plan(text or _in_words(rate, duration, lean), np.array([YAW, rate]), duration, lean=lean)


SPIN_DOWN = Plant(
    name="spin_down",
    motion="run",
    layout=Layout(2, spin=_SPIN, yaw=_YAW),
    dynamics=Dynamics(propagated_by(spin_down_segments), _longest_step),
    initial=Initial(_states),
    sizes=Sizes(  # rad, rad/s
        differences=np.array([1e-5, 1e-4]),
        unknown=np.array([1e6, 1e3]),
        continuous=AllowedDefects(np.zeros(2)),
        relaxed=AllowedDefects(np.array([0.5, 0.5])),
    ),
    # ten minutes of a rig
    durations=Durations(segment=0.5, first_look=10.0, window=1.0, longest=600.0, setup=300.0, event_near=0.12),
    hardware=("rig",),
    lacks=_lacks,
    grows_with=_grows_with,
    laws=MotionLaws(_TERMS, _symbols),
    design=Design(_about, _read),
)
