"""A disc's path as cameras saw it, in tables without a sensor of motion. Takes them; gives the lines of a map."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, scatter_of
from discsim.errors import InputError
from discsim.files import model_names
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.clock import Clock, seconds
from discsim.validation.importing.sniffing.decision import Decision, Sureness
from discsim.validation.importing.sniffing.groups import Numbers
from discsim.validation.importing.sniffing.names import Name, is_time_name, read_name, words_of

__all__ = ["SPIN", "WOBBLE", "ProposedTrack", "coordinates_of", "track_of"]

#: Rows of a track: fewer are no path.
_FEWEST = 8
#: A disc that is thrown flies at 3 to 40 m/s (Ultimate's slowest throws, distance records); cameras see it from the
#: hand to the grass. Sizes of coordinates that make the median speed another are in another unit.
_SPEEDS = (1.0, 60.0)
#: Columns that are a path under names that say nothing (x, y, z) follow a polynomial of fifth order to this share of
#: their range: a throw does to a hundredth, what a sensor reads as a disc turns does not.
_ORDER, _SMOOTH = 5, 0.05
#: Rooms for motion capture are known to a tenth of a millimetre (their makers state 0.1 to 0.2 mm).
_FINEST = 1e-4
#: The disc that is taken where none is stated: that of Ultimate.
_DISC = "ultrastar"
#: What throws are like, one sigma, rad/s: rates across the axis at release (an allowance, as that of the golf throws'
#: map, for nobody measures them), and the spin to either side (Ultimate's 30 to 90, golf's 90 to 160).
WOBBLE, SPIN = 5.0, 100.0
_PLACES = {"position", "pos", "point", "track", "trajectory", "location", "coord", "mass", "marker", "disc", "center"}
_PIXELS = re.compile(r"[\s_.(\[]+(?:px|pix(?:el)?s?)(?:$|[\s_.)\]]+)", re.IGNORECASE)


class ProposedTrack(NamedTuple):
    """A camera's track: its columns, their unit (a map's), what becomes north, east and down, and its noise, m."""

    numbers: Numbers
    columns: tuple[str, ...]
    unit: str
    axes: tuple[str, str, str]
    noise: float
    of_columns: Decision
    of_unit: Decision
    of_axes: Decision
    of_disc: Decision
    notes: tuple[str, ...]

    @property
    def decisions(self) -> tuple[Decision, ...]:
        """Every decision, in the order of the map."""
        return self.of_columns, self.of_unit, self.of_axes, self.of_disc


def coordinates_of(names: Sequence[str]) -> list[dict[int, int]]:
    """Return the columns of each point by axis, two or three of them, those first of which three are there.

    >>> coordinates_of(["t", "x", "y"]), coordinates_of(["time", "Position X (m)", "Position Y (m)", "Position Z (m)"])
    ([{0: 1, 1: 2}], [{0: 1, 1: 2, 2: 3}])
    >>> coordinates_of(["t", "ax", "ay", "az"])
    []
    """
    points: dict[tuple[str, str], dict[int, int]] = defaultdict(dict)
    for k, name in enumerate(names):
        read = read_name(_PIXELS.sub("", re.sub(r"\.\d+$", "", name)))
        if read.axis is not None and not is_time_name(name) and _is_place(read, name):
            points[read.base, read.unit].setdefault(read.axis, k)
    found = [axes for axes in points.values() if 0 in axes and len(axes) > 1]
    return sorted(found, key=len, reverse=True)


def _is_place(read: Name, name: str) -> bool:
    """Tell whether a column is called a coordinate: by a unit of length, a word for a place, or its axis alone."""
    if read.unit:
        return read.unit.lower() in UNITS["m"] or _PIXELS.search(name) is not None
    return not read.base or bool(words_of(name) & _PLACES) or _PIXELS.search(name) is not None


def track_of(tables: Sequence[Numbers], clock: Clock) -> ProposedTrack | None:
    """Return the first table's track; None where none holds a path.

    Raises `InputError` where it is in pixels, or nothing tells the time of its rows.
    """
    for numbers in tables:
        points = coordinates_of(numbers.names)
        for axes in points:
            if (track := _track(numbers, axes, clock, len(points) - 1)) is not None:
                return track
    return None


def _track(numbers: Numbers, axes: dict[int, int], clock: Clock, others: int) -> ProposedTrack | None:
    """Return a point's track, beside which there are so many ``others``; None where it goes along no path."""
    order = sorted(axes)
    columns = [axes[axis] for axis in order]
    names = [numbers.names[k] for k in columns]
    read = read_name(names[0])
    values = numbers.values[:, columns]
    seen = np.isfinite(values).all(axis=1)
    told = bool(read.unit) or bool(words_of(names[0]) & _PLACES)
    if np.count_nonzero(seen) < _FEWEST or not (told or _is_path(values[seen])):
        return None
    written = tuple(numbers.table.columns[k] for k in columns)
    listed = ", ".join(f"'{name}'" for name in written)
    if any(map(_PIXELS.search, names)):
        what = f"{listed} are in pixels; write them in m, or state the size of a pixel in a map of your own"
        raise InputError.at(numbers.path, None, f"{what} (scale, docs/importing.md)")
    if clock.decision.sure == "guess" and (clock.column is None or clock.column in written):
        what = f"{listed} are a path, and no column tells the time of its rows"
        raise InputError.at(
            numbers.path, None, f"{what}; write the rate above the names (# 240 Hz) or a column of times"
        )
    time = seconds(clock, numbers)
    seen &= np.isfinite(time)
    unit, of_unit = _unit(read, time[seen], values[seen])
    metres = values[seen] * UNITS["m"][unit]
    turned, of_axes = _turned(len(order))
    sure: Sureness = "certain" if told else "guess"
    why = "its names say so" if told else "three or two columns under the names of axes that go along a smooth path"
    of_columns = Decision("track", ", ".join(written), sure, why)
    notes = (f"left out: {others} more tracked points: the first is taken for the disc's centre",) * bool(others)
    noise = max(scatter_of(metres), _FINEST)
    told_noise = float(f"{noise:.2g}")
    return ProposedTrack(numbers, written, unit, turned, told_noise, of_columns, of_unit, of_axes, _disc(), notes)


def _is_path(values: FloatArray) -> bool:
    """Tell whether points (n, k) go along a smooth path, and not to and fro."""
    at = np.linspace(-1.0, 1.0, len(values))
    left = values - np.polynomial.polynomial.polyval(at, np.polynomial.polynomial.polyfit(at, values, _ORDER)).T
    span = float(np.linalg.norm(np.ptp(values, axis=0)))
    return span > 0.0 and float(np.sqrt(np.mean(np.sum(left**2, axis=1)))) < _SMOOTH * span


def _unit(read: Name, time: FloatArray, values: FloatArray) -> tuple[str, Decision]:
    if read.unit.lower() in UNITS["m"]:
        unit = read.unit.lower()
        return unit, Decision("track unit", unit, "certain", "the header says so")
    step = np.linalg.norm(np.diff(values, axis=0), axis=1) / np.diff(time)
    speed = float(np.median(step[np.isfinite(step)]))
    for unit in ("m", "mm"):
        if _SPEEDS[0] <= speed * UNITS["m"][unit] <= _SPEEDS[1]:
            why = f"no unit in the header; {speed * UNITS['m'][unit]:.3g} m/s (median) is a thrown disc's speed"
            return unit, Decision("track unit", unit, "likely", why)
    return "m", Decision(
        "track unit", "m", "guess", f"no unit in the header; {speed:.3g} m/s (median) is no throw's speed"
    )


def _turned(count: int) -> tuple[tuple[str, str, str], Decision]:
    """Return what becomes north, east and down, and why: x is taken as down range, z or the second of two as up.

    The path tells neither: a disc may rise for a second, and be lifted by more than its weight.
    """
    if count == 2:
        why = "two coordinates: a view from the side, the second upwards; from above it is ['x', '-y', 'none']"
        return ("x", "none", "-y"), Decision("track axes", "north x, east not seen, up y", "guess", why)
    why = "z is up as is usual, x is taken as down range; with z downwards it is ['x', 'y', 'z']"
    return ("x", "-y", "-z"), Decision("track axes", "north x, west y, up z", "likely", why)


def _disc() -> Decision:
    others = ", ".join(name for name in model_names("discs") if name != _DISC)
    return Decision("disc", _DISC, "guess", f"a flight needs a disc, and a track tells none; others shipped: {others}")
