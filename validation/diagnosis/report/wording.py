"""The effects of the catalogue as a person reads them: a name, a formula, values with units.

The forms are those of docs/physics.md. In a formula ``{name}`` is the place of a parameter: of its symbol in the
general form, of its value and unit in the form that was found.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from math import atan2, degrees, floor, hypot, log10
from types import MappingProxyType
from typing import NamedTuple

from discsim.effects.catalogue import CATALOGUE
from validation.diagnosis.result import Confusion, ParameterValue

__all__ = [
    "FORMULAE",
    "Formula",
    "everyday",
    "form",
    "found",
    "law_text",
    "name_of",
    "plus_minus",
    "symbol",
    "target_in_words",
    "telling_apart",
    "unit",
    "wind_in_words",
    "with_unit",
]

_NO_SETTING: Mapping[str, str] = MappingProxyType({})


class Formula(NamedTuple):
    """What an effect is called and its form as HTML, parameters in braces."""

    name: str
    form: str


_LAG = "{tau_s} ẏ = x − y, y the reading"
_CLOCK = "written time = {ratio} × true time, of {clock}"
_DROPPED = "a share of {fraction} of the {sensor}'s samples is lost, the rest written as if none were"
_AXES = "columns x, y, z hold {axes} of the body"
_UNIT = "numbers are written in {written_in}"
_OFFSET = "written time = true time + {offset_s}"

FORMULAE: Mapping[str, Formula] = MappingProxyType(
    {
        "air.wind": Formula(
            "a steady wind", "V is relative to a wind of {w_north_m_s} to the north and {w_east_m_s} to the east"
        ),
        "air.wind_shear": Formula(
            "a wind that grows with height",
            "w(h) = ({w_north_m_s} north, {w_east_m_s} east) · (h / 10 m)<sup>{exponent}</sup>",
        ),
        "air.gust": Formula(
            "a gust",
            "w(t) = ({w_north_m_s} north, {w_east_m_s} east) · exp(−½ ((t − {t_s}) / {width_s})<sup>2</sup>)",
        ),
        "air.density": Formula("another air density", "ρ → {ratio} · ρ"),
        "air.ground_effect": Formula(
            "ground effect", "C<sub>L</sub> → C<sub>L</sub> · (1 + {k} · exp(−h / 2d)), h the height"
        ),
        "aero.spin_side_force": Formula("a side force of the spin", "C<sub>Y</sub> = {CYr} · γ"),
        "aero.spin_lift": Formula("lift that grows with spin", "C<sub>L</sub> += {CLr} · |γ|"),
        "aero.spin_drag": Formula("drag that grows with spin", "C<sub>D</sub> += {CDrr} · γ<sup>2</sup>"),
        "aero.spin_pitching_moment": Formula("a pitching moment of the spin", "C<sub>M</sub> += {CMr} · γ"),
        "aero.stall": Formula(
            "a stall",
            "C<sub>L</sub> −= {k} · CLa · (α − {alpha_stall_rad}) where α is above {alpha_stall_rad}",
        ),
        "aero.yaw_reynolds": Formula(
            "yaw damping that changes with airspeed", "CNr → CNr · (V / 15 m/s)<sup>{exponent}</sup>"
        ),
        "aero.yaw_quadratic": Formula("yaw damping that grows with spin", "C<sub>N</sub> += {CNrr} · γ |γ|"),
        "aero.yaw_alpha": Formula(
            "yaw damping that grows with angle of attack", "C<sub>N</sub> += {CNraa} · γ α<sup>2</sup>"
        ),
        "body.mass_imbalance": Formula(
            "a centre of mass off the middle", "centre of mass at ({ex_m}, {ey_m}, 0) in body axes"
        ),
        "body.inertia_asymmetry": Formula("unequal transverse inertia", "Iyy = Ixx + {dIyy_kg_m2}"),
        "event.impulse": Formula(
            "a touch that changed the velocity",
            "Δv = ({dv_north_m_s} north, {dv_east_m_s} east, {dv_down_m_s} down) at t = {t_s}",
        ),
        "event.spin_step": Formula("a kick that changed the spin", "Δr = {dr_rad_s} at t = {t_s}"),
        "rig.coulomb_friction": Formula("dry friction in the bearing", "torque −{torque_N_m} · sign(r)"),
        "rig.quadratic_drag": Formula("air drag on the rig", "torque −{coefficient_N_m_s2} · r |r|"),
        "rig.axis_tilt": Formula("a tilted axis", "axis along ({tilt_north_rad} north, {tilt_east_rad} east, 1 down)"),
        "rig.speed_ripple": Formula(
            "a ripple of the table's speed",
            "r = r<sub>command</sub> + {amplitude_rad_s} · sin({order} ψ + {phase_rad}), ψ the angle turned",
        ),
        "mag.hard_iron": Formula("a magnet on board (hard iron)", "m → m + ({bx_uT}, {by_uT}, {bz_uT}) in body axes"),
        "mag.soft_iron": Formula(
            "iron on board that bends the field (soft iron)",
            "m → (I + S) m, S symmetric: xx {sxx}, xy {sxy}, xz {sxz}, yy {syy}, yz {syz}, zz {szz}",
        ),
        "mag.lag": Formula("a magnetometer that lags", _LAG),
        "mag.stray_field": Formula(
            "a stray magnetic field near the ground",
            "m += ({bn_uT} north, {be_uT} east, {bd_uT} down) · exp(−h / {height_m})",
        ),
        "mag.clock_rate": Formula("a wrong clock of the magnetometer", _CLOCK.replace("{clock}", "the magnetometer")),
        "mag.dropped_samples": Formula(
            "lost samples of the magnetometer", _DROPPED.replace("{sensor}", "magnetometer")
        ),
        "accel.lag": Formula("an accelerometer that lags", _LAG),
        "accel.clock_rate": Formula(
            "a wrong clock of the accelerometer", _CLOCK.replace("{clock}", "the accelerometer")
        ),
        "accel.dropped_samples": Formula(
            "lost samples of the accelerometer", _DROPPED.replace("{sensor}", "accelerometer")
        ),
        "accel.position_offset": Formula(
            "an accelerometer that sits elsewhere than stated", "position = stated + ({dx_m}, {dy_m}, {dz_m})"
        ),
        "accel.bias": Formula("a bias of the accelerometer", "f → f + ({bx_m_s2}, {by_m_s2}, {bz_m_s2})"),
        "accel.bias_drift": Formula(
            "a drifting bias of the accelerometer", "f → f + ({bx_m_s3}, {by_m_s3}, {bz_m_s3}) · t"
        ),
        "accel.scale": Formula(
            "a scale error of the accelerometer",
            "f<sub>i</sub> → (1 + s<sub>i</sub>) f<sub>i</sub>, s = ({sx}, {sy}, {sz})",
        ),
        "accel.cross_axis": Formula(
            "cross-axis sensitivity of the accelerometer",
            "f → (I + S) f, S: xy {sxy}, xz {sxz}, yx {syx}, yz {syz}, zx {szx}, zy {szy}",
        ),
        "accel.saturation": Formula(
            "an accelerometer that clips below its range", "|f<sub>i</sub>| is cut at {limit_m_s2}"
        ),
        "gyro.lag": Formula("a gyroscope that lags", _LAG),
        "gyro.clock_rate": Formula("a wrong clock of the gyroscope", _CLOCK.replace("{clock}", "the gyroscope")),
        "gyro.bias": Formula("a bias of the gyroscope", "ω → ω + ({bx_rad_s}, {by_rad_s}, {bz_rad_s})"),
        "gyro.scale": Formula(
            "a scale error of the gyroscope",
            "ω<sub>i</sub> → (1 + s<sub>i</sub>) ω<sub>i</sub>, s = ({sx}, {sy}, {sz})",
        ),
        "gyro.g_sensitivity": Formula(
            "a gyroscope that feels acceleration",
            "ω<sub>i</sub> → ω<sub>i</sub> + k<sub>i</sub> f<sub>i</sub>, k = ({kx}, {ky}, {kz})",
        ),
        "gps.clock_rate": Formula("a wrong clock of the GPS", _CLOCK.replace("{clock}", "the GPS")),
        "gps.latency": Formula("GPS fixes that come late", "a fix stamped t shows the state at t − {delay_s}"),
        "clock.rate": Formula("a wrong clock of the recorder", _CLOCK.replace("{clock}", "all sensors")),
        "mag.axes": Formula("a magnetometer whose axes are mixed up", _AXES),
        "accel.axes": Formula("an accelerometer whose axes are mixed up", _AXES),
        "gyro.axes": Formula("a gyroscope whose axes are mixed up", _AXES),
        "gps.axes": Formula(
            "a GPS in other directions than stated", "columns north, east, down, and their velocities, hold {axes}"
        ),
        "mag.units": Formula("a magnetometer in another unit", _UNIT),
        "accel.units": Formula("an accelerometer in another unit", _UNIT),
        "gyro.units": Formula("a gyroscope in another unit", _UNIT),
        "mag.time_offset": Formula("times of the magnetometer that are shifted", _OFFSET),
        "accel.time_offset": Formula("times of the accelerometer that are shifted", _OFFSET),
        "gyro.time_offset": Formula("times of the gyroscope that are shifted", _OFFSET),
        "board.rotation": Formula(
            "a sensor board that is turned in the disc",
            "readings = C<sup>T</sup> (true vector), C the rotation by ({rx_rad}, {ry_rad}, {rz_rad})",
        ),
        "site.field": Formula(
            "another magnetic field than stated",
            "stated field turned about down by {declination_rad}, dipped further by {inclination_rad}, times {ratio}",
        ),
        "clock.units": Formula("times in another unit", "times of all sensors are written in {written_in}"),
    }
)

#: ending of a parameter's name -> unit; the first that fits holds
_UNITS = (
    ("_N_m_s2", "N m s²"),
    ("_N_m_s", "N m s"),
    ("_N_m", "N m"),
    ("_kg_m2", "kg m²"),
    ("_kg_m3", "kg/m³"),
    ("_m_s3", "m/s³"),
    ("_m_s2", "m/s²"),
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_uT", "µT"),
    ("_rad", "rad"),
    ("_kg", "kg"),
    ("_N", "N"),
    ("_m", "m"),
    ("_s", "s"),
)
_OTHER_UNITS = MappingProxyType({("gyro.g_sensitivity", name): "rad/s per m/s²" for name in ("kx", "ky", "kz")})
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def name_of(id: str) -> str:
    """Return what an effect is called; an effect of the user's own goes by its id."""
    return FORMULAE[id].name if id in FORMULAE else id


def telling_apart(id: str, other: Confusion) -> str:
    """Return a sentence on what would tell an effect from one that it is confused with; empty where nothing is said."""
    if not other.next_recording:
        return ""
    return f"To tell {name_of(id)} from {name_of(other.id)}: {other.next_recording}"


def unit(id: str, name: str) -> str:
    """Return the unit of an effect's parameter; empty where it has none."""
    if (id, name) in _OTHER_UNITS:
        return _OTHER_UNITS[id, name]
    before, per, after = name.rpartition("_per_")
    if per:
        return f"{unit(id, before)} per {unit(id, f'_{after}')}".strip()
    return next((text for ending, text in _UNITS if name.endswith(ending)), "")


def symbol(name: str) -> str:
    """Return a parameter's name without its unit; an event's instant is told from time itself."""
    if name == "t_s":
        return "t<sub>0</sub>"
    ending = next((ending for ending, _ in _UNITS if name.endswith(ending)), "")
    return name.removesuffix(ending) or name


def _power(size: float) -> int:
    """Return the power of ten to write before a number; 0 where it reads well without one."""
    power = floor(log10(size)) if size > 0 else 0
    return 0 if -4 <= power <= 5 else power


def _times(text: str, power: int) -> str:
    """Return the text with its power of ten and true minus signs."""
    return (f"{text} × 10{str(power).translate(_RAISED)}" if power else text).replace("-", "−")


def _rounded(value: float, sd: float | None) -> tuple[str, str]:
    """Return value and spread as texts; the spread has two digits that count, the value as many places."""
    if not sd:
        return f"{value:.4g}", "0"
    decimals = max(0, 1 - floor(log10(sd)))
    return f"{value:.{decimals}f}", f"{sd:.{decimals}f}"


def plus_minus(value: float, sd: float | None) -> str:
    """Return ``value ± sd`` with the digits that the standard deviation gives a meaning.

    >>> plus_minus(-0.712345, 0.0213)
    '−0.712 ± 0.021'
    >>> plus_minus(3.12e-6, 2e-8)
    '(3.120 ± 0.020) × 10⁻⁶'
    >>> plus_minus(0.5, None)
    '0.5 (not determined)'
    """
    power = _power(max(abs(value), sd or 0.0))
    middle, spread = _rounded(value / 10.0**power, None if sd is None else sd / 10.0**power)
    if sd is None:
        return f"{_times(middle, power)} (not determined)"
    both = f"{middle} ± {spread}"
    return _times(f"({both})" if power else both, power)


def with_unit(id: str, name: str, item: ParameterValue) -> str:
    """Return a parameter's value with its unit, to the digits that its standard deviation leaves."""
    power = _power(max(abs(item.value), item.sd or 0.0))
    middle, _ = _rounded(item.value / 10.0**power, None if item.sd is None else item.sd / 10.0**power)
    return " ".join(filter(None, (_times(middle, power), unit(id, name))))


def form(id: str) -> str:
    """Return an effect's form with its symbols, as HTML; empty where the catalogue has none."""
    return _filled(id, {}) if id in FORMULAE else ""


def found(id: str, parameters: Mapping[str, ParameterValue], setting: Mapping[str, str] = _NO_SETTING) -> str:
    """Return an effect's form with the values found, as HTML; what is not among them is at its baseline."""
    if id not in FORMULAE:
        return ", ".join(f"{escape(name)} = {with_unit(id, name, item)}" for name, item in parameters.items())
    values = {name: f"{size:g}" for name, size in CATALOGUE[id].sizes.items()}
    values |= {name: f"<b>{text.replace('-', '−')}</b>" for name, text in setting.items()}
    values |= {name: f"<b>{with_unit(id, name, item)}</b>" for name, item in parameters.items()}
    return _filled(id, values)


def _filled(id: str, values: Mapping[str, str]) -> str:
    return re.sub(
        r"\{(\w+)\}",
        lambda place: values.get(place[1], f"<i>{symbol(place[1])}</i>"),
        FORMULAE[id].form,
    )


_TARGETS = MappingProxyType(
    {
        "force_x_N": "force along the wind's direction in the disc's plane (x of H), N",
        "force_y_N": "force across the wind in the disc's plane (y of H), N",
        "force_z_N": "force along the disc's axis, N",
        "moment_x_N_m": "rolling moment (x of H), N m",
        "moment_y_N_m": "pitching moment (y of H), N m",
        "moment_z_N_m": "moment about the spin axis, N m",
    }
)
_SYMBOLS = MappingProxyType({"alpha": "α", "p_H": "p<sub>H</sub>", "q_H": "q<sub>H</sub>"})


def target_in_words(target: str) -> str:
    """Return what a law gives, with its unit."""
    sensor, _, column = target.partition(".")
    return _TARGETS.get(target) or f"reading of the {sensor.replace('_', ' ')}, {column}"


def law_text(text: str) -> str:
    """Return the formula of a law as HTML: exponents raised, products with a dot."""
    raised = re.sub(
        r"(?:\^|\*\*)\s*(?:\(([^)]*)\)|([-+]?[\w.]+))", lambda e: f"<sup>{e[1] or e[2]}</sup>", escape(text)
    )
    raised = re.sub(r"\b(alpha|p_H|q_H)\b", lambda word: _SYMBOLS[word[0]], raised)
    return raised.replace(" * ", " · ").replace("*", " · ").replace("-", "−")


def everyday(id: str, name: str, item: ParameterValue) -> str:
    """Return a parameter in degrees, mm, ms or per cent; empty where its own unit reads as well."""
    value, sd = item.value, item.sd
    scaled = None
    if name == "ratio":
        value, scaled = value - 1.0, (100.0, "%")
    elif name == "fraction" or id.endswith((".scale", ".cross_axis", ".soft_iron")):
        scaled = (100.0, "%")
    elif name.endswith("_rad"):
        scaled = (degrees(1.0), "°")
    elif name.endswith("_rad_s"):
        scaled = (degrees(1.0), "°/s")
    elif unit(id, name) == "m" and abs(value) < 0.1:
        scaled = (1000.0, "mm")
    elif unit(id, name) == "s" and abs(value) < 0.1:
        scaled = (1000.0, "ms")
    if scaled is None:
        return ""
    factor, shown = scaled
    text = plus_minus(factor * value, None if sd is None else factor * sd)
    return f"({text}) {shown}" if sd is not None else f"{text} {shown}"


def wind_in_words(parameters: Mapping[str, ParameterValue]) -> str:
    """Return "1.30 m/s, blowing towards 327°" for the two components of a wind; empty where they are not there."""
    if not {"w_north_m_s", "w_east_m_s"} <= set(parameters):
        return ""
    north, east = parameters["w_north_m_s"].value, parameters["w_east_m_s"].value
    return f"{hypot(north, east):.2f} m/s, blowing towards {degrees(atan2(east, north)) % 360.0:.0f}°"
