"""Every equation and step of the paper, with the functions that implement it; that they cite it is checked."""

from __future__ import annotations

import inspect
import re
from importlib import import_module
from typing import Any, NamedTuple

__all__ = ["EQUATIONS", "STEPS", "Row", "find", "summary"]


class Row(NamedTuple):
    """An equation or step of the paper, what it says, our functions by full name, and where they depart from it."""

    number: str
    says: str
    names: tuple[str, ...]
    departs: str = ""


_FLIGHT = "discsim.flight_equations.derivative"
_AIR = "discsim.aerodynamics.air_wrench"
_METHOD = "discsim.estimators.accelerometer.accelerometer"
_KNOWN = "discsim.estimators.accelerometer.rate_with_known_terms"
_ENVELOPE = "discsim.estimators.accelerometer.envelope"
_SENSOR = "discsim.sensors.accelerometer.Accelerometer"
_BY_26 = "discsim.validation.yaw_damping.paper_table.damping_by_26"

EQUATIONS = (
    Row(
        "1",
        "acceleration at the sensor",
        ("discsim.sensors.accelerometer.specific_force",),
        "the paper adds g; an accelerometer reads a - g, so f_z = -g at rest",
    ),
    Row("2", "place with installation error", (_KNOWN,), ""),
    Row("3", "reading with nonlinearity, cross-axis, bias, noise", (_SENSOR,), "then rounding and clipping as well"),
    Row("4", "sensitivity matrix S_T", ("discsim.effects.sensors.sensitivity",)),
    Row("5", "reading by S_T", (_SENSOR,), "noise comes after lag, and before rounding"),
    Row("6", "its x component", ("discsim.sensors.accelerometer.specific_force",), "sign of g as in (1)"),
    Row("7", "fast spin about z alone", (_METHOD,), "an estimator assumes it; the simulation keeps every term"),
    Row("8", "rate with all error terms", (_KNOWN,), "specific force of the origin in place of R'' + g"),
    Row("9", "the same, errors gathered", (_METHOD, "discsim.validation.sweeps.mounts.closed_form")),
    Row("10", "the numerator's error, axis vertical", (_ENVELOPE,), "g enters by S_xz alone, as printed"),
    Row("11", "bounds of the rate", (_ENVELOPE,), "S_Ax has one sign in e_n and e_d; the paper takes each worst"),
    Row("12", "rate from centripetal acceleration", (_METHOD,), "also for a sensor off the x axis"),
    Row("13", "worst S_T of an MPU-9250", ("discsim.estimators.accelerometer.AccelerometerErrors",)),
    Row("14", "forces and moments by coefficients", (_AIR,), "V relative to the air; C_Y may be other than 0"),
    Row("15", "advance ratio", ("discsim.aerodynamics.advance_ratio",)),
    Row("16", "rolling moment", ("discsim.aerodynamics.rolling_coefficient",), "p in H; constants or tables"),
    Row("17", "yawing moment", (_AIR,), "C_Nr a constant, or the table (28)"),
    Row("18", "force equation in N", (_FLIGHT,), "F = m (dV/dt - g); the paper has + g"),
    Row("19", "moment equation in B", (_FLIGHT,), "MuJoCo integrates the whole turning body, this is the second route"),
    Row("20", "air's force and moment in W", (_AIR,), "a side force Y may be stated"),
    Row("21", "from W into N and B", (_AIR,), "prints the transpose of C2(-alpha), which is C2(alpha): equal to (23)"),
    Row("22", "body rates and Euler angles", (_FLIGHT,), "a quaternion: no angle is singular"),
    Row("23", "from W into N and B by lambda", (_AIR, _FLIGHT), "axes that never turn about z_B, as lambda has it"),
    Row("24", "C_N by C_Nr", (_BY_26,)),
    Row("25", "yawing moment by C_Nr", (_BY_26,)),
    Row("26", "C_Nr by the spin's decay", (_BY_26,), "leaves R sin(alpha) out, which (23) has about z_B"),
    Row("27", "table of one throw", ("discsim.validation.yaw_damping.paper_table.paper_table",)),
    Row(
        "28",
        "mean of the tables",
        ("discsim.validation.yaw_damping.paper_table.paper_table", "discsim.aerodynamics.yaw_damping"),
        "outside its nodes an error; the paper does not say what it does there",
    ),
    Row("A1", "rotations about x, y, z", ("discsim.frames.C1", "discsim.frames.C2", "discsim.frames.C3")),
    Row(
        "A2", "heading frame, angle of attack", ("discsim.frames.heading_angles",), "relative wind, not ground velocity"
    ),
)

_FFT = "discsim.estimators.fft.fft"
_SETTINGS = "discsim.estimators.fft.FftSettings"
STEPS = (
    Row("P-1", "window of 128 samples at 100 Hz", (_SETTINGS,)),
    Row("P-2", "2^14 - n zeros", (_SETTINGS,)),
    Row("P-3", "padded window", (_FFT,)),
    Row(
        "P-4", "transform, amplitudes", ("discsim.estimators.fft_fast.highest",), "only the orders above the threshold"
    ),
    Row("PE1", "frequencies", (_FFT,), "prints n + k + 1 of them for n + k amplitudes; the last has no meaning"),
    Row("P-5", "order of the greatest amplitude", ("discsim.estimators.fft_fast.highest",), "must be a local maximum"),
    Row("P-6", "rate by (PE2)", (_FFT,)),
    Row("PE2", "rate by frequency", (_FFT,)),
    Row("P-7", "shift the window", (_SETTINGS, _FFT), "unknown where the line does not stand out"),
)


def find(name: str) -> Any:
    """Return what a full name stands for; raises where there is no such thing."""
    module, _, own = name.rpartition(".")
    return getattr(import_module(module), own)


def summary(name: str) -> str:
    """Return the first sentence of a function's docstring."""
    thing = find(name)
    text = " ".join((inspect.getdoc(getattr(thing, "py_func", thing)) or "").split("\n\n")[0].split())
    return re.split(r"(?<=[a-z)\]])[.;] (?=[A-Z`])", text)[0].rstrip(".")
