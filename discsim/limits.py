"""Limits that no sane input meets: what lies beyond is a slip of the pen, a wrong unit or damage, and is refused.

They are wide on purpose: they judge no measurement, they keep what cannot be one from the computations. Readers apply
them, so that no code behind a reader meets a recording of ten years or a disc of 1e300 m. docs/recording-format.md
shows the tables, and a test compares the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray

__all__ = [
    "ANY_NUMBER",
    "BY_KEY",
    "BY_UNIT",
    "FASTEST_SPIN",
    "GRID_PER_ROW",
    "GRID_ROWS",
    "LARGEST_READING",
    "LATEST",
    "LONGEST_RUN",
    "LONGEST_SPAN",
    "MOST_ROWS",
    "SHORTEST_STEP",
    "Limit",
    "in_another_unit",
    "limit_of",
    "reading_fault",
    "time_fault",
    "written_time_fault",
]


class Limit(NamedTuple):
    """Smallest and largest magnitude of a number, and where these come from.

    The smallest one is for what cannot be negative (masses, times, noise, uncertainties): such numbers divide others.
    Any other may be zero, and so as small as rounding leaves it.
    """

    smallest: float
    largest: float
    origin: str

    def fault(self, value: float, *, divides: bool) -> str:
        """Return what was expected of a value, empty where it is within the limits; ``divides``: see the class."""
        if abs(value) > self.largest:
            return f"expected at most {self.largest:g} in size"
        if divides and 0 < abs(value) < self.smallest:
            return f"expected at least {self.smallest:g}"
        return ""


#: any number that no other limit is for; its square and the inverse of that are numbers, too
ANY_NUMBER = Limit(1e-30, 1e30, "the fourth power and its inverse are numbers of double precision")

#: by the unit that ends a key
BY_UNIT: Mapping[str, Limit] = MappingProxyType(
    {
        "kg": Limit(1e-6, 1e3, "a milligram; a car"),
        "kg_m2": Limit(1e-12, 1e4, "a milligram of 1 mm; a car's wheelbase"),
        "kg_m3": Limit(1e-6, 1e3, "air 95 km up; water"),
        "m": Limit(1e-12, 1e8, "below an atom; twice around the Earth"),
        "m_s": Limit(1e-9, 1e5, "a plate tectonic drift; nine times the Earth's escape velocity"),
        "m_s2": Limit(1e-9, 1e9, "as the largest reading, above"),
        "m_s3": Limit(1e-9, 1e9, "as of m_s2, in one second"),
        "uT": Limit(1e-9, 1e9, "a quantum magnetometer's noise; as the largest reading, above"),
        "rad_s": Limit(1e-12, 1e9, "a turn in 200 000 years; as the largest reading, above"),
        "deg_s": Limit(1e-9, 1e9, "as of rad_s"),
        "rad": Limit(1e-12, 1e6, "far below any sensor; 160 000 turns"),
        "deg": Limit(1e-9, 1e6, "as of rad"),
        "s": Limit(1e-9, 1e5, "the finest unit of loggers' clocks; as the longest recording, above"),
        "hz": Limit(1e-6, 1e5, "one reading in twelve days; the widest analogue accelerometers"),
        "N_m": Limit(1e-15, 1e6, "a millionth of a nanonewton metre; a ship's propeller"),
        "N_m_s": Limit(1e-15, 1e3, "the smallest torque at 1 rad/s; the largest at 1000 rad/s"),
        "N_m_s2": Limit(1e-18, 1.0, "as of N_m_s, at 1000 rad/s"),
    }
)

#: a disc, a rotor or a table turns no faster, rad/s: a thrown disc has 1.5e2, a rate table 1e2, a router's bit 3e3
FASTEST_SPIN = 5e3

#: a run is simulated for no longer, s; a profile of an hour takes half a minute
LONGEST_RUN = 3600.0

#: by the whole key, where the unit's limit would be too wide
BY_KEY: Mapping[str, Limit] = MappingProxyType(
    {
        "gravity_m_s2": Limit(1e-6, 1e3, "a drop tower; forty times Jupiter's"),
        "air_density_kg_m3": Limit(1e-6, 1e2, "air 95 km up; Venus has 65"),
        "magnetic_field_ned_uT": Limit(0.0, 1e7, "10 T, a tomograph's magnet"),
        "wind_ned_m_s": Limit(0.0, 1e3, "three times the speed of sound; a tornado has 135"),
        "diameter_m": Limit(1e-3, 1e2, "a grain; a stadium's roof"),
        "velocity_ned_m_s": Limit(0.0, 1e4, "the Earth's escape velocity is 1.1e4"),
        "body_rate_rad_s": Limit(0.0, FASTEST_SPIN, "as the fastest spin, below"),
        "rate_rad_s": Limit(0.0, FASTEST_SPIN, "as the fastest spin, below"),
        "rates_deg_s": Limit(0.0, float(np.degrees(FASTEST_SPIN)), "as the fastest spin, below"),
        "duration_s": Limit(1e-3, LONGEST_RUN, "a step of a simulation; as the longest run, below"),
        "hold_s": Limit(1e-3, LONGEST_RUN, "as of duration_s"),
        "ramp_s": Limit(1e-3, LONGEST_RUN, "as of duration_s"),
        "ratio": Limit(1e-2, 1e2, "of a clock's rate, of air and fields to those stated: a wrong unit is 60 or 1000"),
        **{
            name: Limit(0.0, 1e3, "the slope of a thin wing's lift is 2 pi, drag of a plate across the flow 1.2")
            for name in ("CL0", "CLa", "CD0", "CDa", "CM0", "CMa", "CMq", "CRr", "CRp", "CNr", "CL", "CD", "CM", "CR")
        },
    }
)

#: rows of one sensor: a day at 200 Hz are 1.7e7
MOST_ROWS = 20_000_000
#: no time stamp is further from the recording's start, s: seconds since 1970 (1.7e9) are no time of a recording
LATEST = 1e6
#: no sensor records for longer, s: a day has 8.6e4
LONGEST_SPAN = 1e5
#: the usual spacing of rows is no shorter, s: that of 100 kHz, the widest analogue accelerometers
SHORTEST_STEP = 1e-5
#: At its usual spacing a sensor's span has room for this many rows and `GRID_PER_ROW` for each that it holds: a burst
#: of some seconds at 100 Hz may be followed by another hours later; a clock that jumped by years leaves only room.
GRID_ROWS, GRID_PER_ROW = 1_000_000, 100
#: no reading is larger, in its sensor's unit: the Moon is 4e8 m away, and no sensor shows a thousandth of it in uT,
#: m/s^2 or rad/s
LARGEST_READING = 1e9


#: units in which a clock may have been written as if they were seconds
_UNITS = (1e-3, 1e-6)
#: a step of so many usual ones is a jump of the clock
_A_JUMP = 10.0
#: fewest rows whose spacing shows a unit: of two or three any time between them is one
_SHOWS_ITS_UNIT = 10


#: other units in which disc and air are often written, and how much of the key's unit one of them is
_ALSO_WRITTEN = MappingProxyType({"diameter_m": ("mm", 1e-3), "kg_m2": ("g cm2", 1e-7), "kg_m3": ("g/m3", 1e-3)})


def in_another_unit(key: str, value: float) -> str:
    """Return the question whether a number that is too large is in another unit, empty where none makes it sane.

    >>> in_another_unit("diameter_m", 212.0)
    '; in mm? that is 0.212'
    """
    for written, (unit, size) in _ALSO_WRITTEN.items():
        if key.endswith(written) and abs(value) > limit_of(key).largest >= abs(value * size):
            return f"; in {unit}? that is {value * size:.6g}"
    return ""


def limit_of(key: str) -> Limit:
    """Return the limits of a key: its own, its unit's, or those of any number.

    >>> limit_of("mass_kg").largest, limit_of("noise_rms_m_s2").largest, limit_of("exponent").largest
    (1000.0, 1000000000.0, 1e+30)
    """
    if key in BY_KEY:
        return BY_KEY[key]
    parts = key.split("_")
    # the longest unit counts: viscous_N_m_s is no speed
    units = ("_".join(parts[first:]) for first in range(1, len(parts)))
    return next((BY_UNIT[unit] for unit in units if unit in BY_UNIT), ANY_NUMBER)


def time_fault(t: FloatArray) -> tuple[int, str] | None:
    """Return the row (from 0) at which ascending, finite time stamps (n,) s leave the limits, and what is wrong."""
    if t.size > MOST_ROWS:
        return MOST_ROWS, f"{t.size} rows; expected at most {MOST_ROWS}: cut it into recordings"
    for row in (0, t.size - 1):
        if abs(t[row]) > LATEST:
            return row, f"time is {t[row]:.9g} s; expected seconds from the start of the recording, at most {LATEST:g}"
    span = float(t[-1] - t[0])
    if span > LONGEST_SPAN:
        steps = np.diff(t)
        row = int(np.argmax(steps)) + 1
        jumps = steps[row - 1] > _A_JUMP * np.median(steps)
        cause = "does the clock jump here?" if jumps else "are the times in seconds?"
        return row, f"the rows span {span:.6g} s; expected at most {LONGEST_SPAN:g} s ({cause})"
    if t.size < 2:
        return None
    steps = np.diff(t)
    usual = float(np.median(steps))
    if usual < SHORTEST_STEP:
        return 1, f"rows are {usual:.3g} s apart (median); expected {SHORTEST_STEP:g} s at least: is time in seconds?"
    room = GRID_ROWS + GRID_PER_ROW * t.size
    if span > room * usual:
        row = int(np.argmax(steps)) + 1
        return row, (
            f"{t.size} rows {usual:.3g} s apart span {span:.6g} s, room for {span / usual:.3g} of them; expected room "
            f"for at most {room:.3g} (does the clock jump by {steps[row - 1]:.6g} s here?)"
        )
    return None


def written_time_fault(t: FloatArray, *, among_others: bool = False) -> tuple[int, str] | None:
    """As `time_fault`, of times as they stand in a file: milliseconds or microseconds written as seconds are let pass.

    That is a fault of the setup (clock.units), which is found and said where a recording is used. A few rows show no
    unit, unless what stands beside them (``among_others``) does.
    """
    fault = time_fault(t)
    if fault is None or (t.size < _SHOWS_ITS_UNIT and not among_others):
        return fault
    return None if any(time_fault(unit * t) is None for unit in _UNITS) else fault


def reading_fault(value: FloatArray) -> tuple[int, int, str] | None:
    """Return row and column (from 0) of the first reading of (n, k) beyond the limit, and what is wrong with it."""
    with np.errstate(invalid="ignore"):
        wild = np.abs(value) > LARGEST_READING
    if not np.any(wild):
        return None
    row, column = (int(index) for index in np.argwhere(wild)[0])
    return row, column, f"is {value[row, column]:.6g}, expected at most {LARGEST_READING:g} in size, or an empty cell"
