"""Profiles of a rate table by their shape: trapezoids, a sine, a sweep, each read from a small TOML file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray
from discsim.limits import LONGEST_RUN
from discsim.recording import Samples
from discsim.toml_table import TomlTable, read_toml

__all__ = ["read_shape", "sine", "sweep", "trapezoids"]

#: knots in one period: lines between them leave 1.2e-4 of a sine's amplitude, (2 pi / 200)^2 / 8
KNOTS = 200
#: knots are no closer than the table's own steps, s
SHORTEST = 1e-3


def trapezoids(rates: FloatArray, hold: float, ramp: float) -> Samples:
    """Return a profile that holds each of rates (n,) rad/s for ``hold`` s, with ramps of ``ramp`` s between them."""
    starts = np.arange(rates.size) * (hold + ramp)
    t = np.stack([starts, starts + hold], axis=1).ravel()
    return Samples(t, np.repeat(rates, 2))


def sine(mean: float, amplitude: float, frequency: float, duration: float) -> Samples:
    """Return ``mean + amplitude sin(2 pi frequency t)``, rad/s, as knots over ``duration`` s."""
    t = _grid(duration, frequency)
    return Samples(t, mean + amplitude * np.sin(2 * np.pi * frequency * t))


def sweep(mean: float, amplitude: float, first: float, last: float, duration: float) -> Samples:
    """Return a sine whose frequency grows exponentially from ``first`` to ``last`` Hz over ``duration`` s."""
    t = _grid(duration, max(first, last))
    growth = np.log(last / first)
    cycles = first * duration * (np.expm1(growth * t / duration) / growth if growth else t / duration)
    return Samples(t, mean + amplitude * np.sin(2 * np.pi * cycles))


def _grid(duration: float, frequency: float) -> FloatArray:
    step = max(1.0 / (KNOTS * frequency), SHORTEST)
    return np.linspace(0.0, duration, max(2, int(np.ceil(duration / step)) + 1))


def read_shape(path: Path) -> Samples:
    """Read a profile's shape (docs/rate-table.md); raises `InputError` naming key, line and what was expected."""
    table = read_toml(path)
    shape = table.text("shape", choices=tuple(_SHAPES))
    assert shape is not None
    profile = _SHAPES[shape](table)
    table.finish()
    return profile


def _trapezoids(table: TomlTable) -> Samples:
    rates = table.numbers("rates_deg_s")
    assert rates is not None
    hold, ramp = table.need("hold", "s", positive=True), table.need("ramp", "s", positive=True)
    if (length := rates.size * (hold + ramp)) > LONGEST_RUN:
        raise table.error("rates_deg_s", f"the profile takes {length:.6g} s, expected at most {LONGEST_RUN:g} s")
    return trapezoids(np.radians(rates), hold, ramp)


def _swing(table: TomlTable) -> tuple[float, float, float]:
    mean = table.number("mean", "deg_s", required=False) or 0.0
    amplitude = table.need("amplitude", "deg_s", positive=True)
    return float(np.radians(mean)), float(np.radians(amplitude)), table.need("duration", "s", positive=True)


def _frequency(table: TomlTable, stem: str) -> float:
    """Take a frequency that knots a step of the table apart still show as a sine."""
    value = table.need(stem, "hz", positive=True)
    if value > (fastest := 1.0 / (20 * SHORTEST)):
        raise table.error(
            f"{stem}_hz", f"'{stem}_hz' is {value:g}, expected at most {fastest:g}: 20 steps of the table"
        )
    return value


def _sine(table: TomlTable) -> Samples:
    mean, amplitude, duration = _swing(table)
    return sine(mean, amplitude, _frequency(table, "frequency"), duration)


def _sweep(table: TomlTable) -> Samples:
    mean, amplitude, duration = _swing(table)
    return sweep(mean, amplitude, _frequency(table, "first"), _frequency(table, "last"), duration)


_SHAPES: Mapping[str, Callable[[TomlTable], Samples]] = MappingProxyType(
    {"trapezoids": _trapezoids, "sine": _sine, "sweep": _sweep}
)
