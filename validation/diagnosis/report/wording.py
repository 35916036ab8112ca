"""The effects of the catalogue as a person reads them: a name, a formula, values with units.

The forms are those of the catalogue's rows. In a formula ``{name}`` is the place of a parameter: of its symbol in the
general form, of its value and unit in the form that was found.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from html import escape
from math import atan2, degrees, floor, hypot, log10
from types import MappingProxyType

from discsim.effects.catalogue import CATALOGUE
from discsim.validation.diagnosis.result import Confusion, ParameterValue

__all__ = [
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
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def name_of(id: str) -> str:
    """Return what an effect is called; an effect of the user's own goes by its id."""
    return CATALOGUE[id].title if id in CATALOGUE else id


def telling_apart(id: str, other: Confusion) -> str:
    """Return a sentence on what would tell an effect from one that it is confused with; empty where nothing is said."""
    if not other.next_recording:
        return ""
    return f"To tell {name_of(id)} from {name_of(other.id)}: {other.next_recording}"


def unit(id: str, name: str) -> str:
    """Return the unit of an effect's parameter; empty where it has none."""
    if id in CATALOGUE and name in CATALOGUE[id].units:
        return CATALOGUE[id].units[name]
    before, per, after = name.rpartition("_per_")
    if per:
        return f"{unit(id, before)} per {unit(id, f'_{after}')}".strip()
    return next((text for ending, text in _UNITS if name.endswith(ending)), "")


def symbol(name: str) -> str:
    """Return a parameter's name without its unit; an event's instant is told from time itself."""
    if name == "t_s":
        return "t<sub>0</sub>"
    before, per, _ = name.rpartition("_per_")
    if per:
        return symbol(before)
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
    return _filled(id, {}) if id in CATALOGUE else ""


def found(id: str, parameters: Mapping[str, ParameterValue], setting: Mapping[str, str] = _NO_SETTING) -> str:
    """Return an effect's form with the values found, as HTML; what is not among them is at its baseline."""
    if id not in CATALOGUE:
        return ", ".join(f"{escape(name)} = {with_unit(id, name, item)}" for name, item in parameters.items())
    values = {name: f"{size:g}" for name, size in CATALOGUE[id].sizes.items()}
    values |= {name: f"<b>{escape(text).replace('-', '−')}</b>" for name, text in setting.items()}
    values |= {name: f"<b>{with_unit(id, name, item)}</b>" for name, item in parameters.items()}
    return _filled(id, values)


def _filled(id: str, values: Mapping[str, str]) -> str:
    return re.sub(
        r"\{(\w+)\}",
        lambda place: values.get(place[1], f"<i>{symbol(place[1])}</i>"),
        CATALOGUE[id].form,
    )


_TARGETS = MappingProxyType(
    {
        "force_x_N": "force along the wind's direction in the disc's plane (x of H), N",
        "force_y_N": "force across the wind in the disc's plane (y of H), N",
        "force_z_N": "force along the disc's axis, N",
        "moment_x_N_m": "rolling moment (x of H), N m",
        "moment_y_N_m": "pitching moment (y of H), N m",
        "moment_z_N_m": "moment about the spin axis, N m",
        "wind_north_m_s": "wind to the north beside the known one, m/s",
        "wind_east_m_s": "wind to the east beside the known one, m/s",
        "wind_up_m_s": "wind upwards beside the known one, m/s",
        "air_share": "share by which the air's force and moment are larger than modelled (or the disc lighter)",
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
    elif name == "fraction" or (id in CATALOGUE and CATALOGUE[id].in_percent):
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
