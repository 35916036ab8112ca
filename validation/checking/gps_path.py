"""What a GPS's positions and velocities say against each other, and fixes that are none."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from discsim.arrays import BoolArray, FloatArray, scatter_of
from discsim.effects.catalogue import catalogued
from discsim.effects.setup import GpsAxes
from discsim.recording import Recording
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.path_points import out_of_reach, rows_in_words, standing
from discsim.validation.checking.statements import FASTEST
from discsim.validation.importing.import_map import SPEEDS
from discsim.validation.rows.held import find_held

__all__ = ["FARTHEST", "elsewhere", "gps_findings"]

#: the farthest throw of a disc was of 338 m (D. Wiggins, 2016); with a margin
FARTHEST = 500.0
#: height of a release above the ground that its heights count from, m: a hand's, or that of who stands on a tower
_HIGH = 100.0
#: change of a GPS's position over its velocity times the time, where one of them is in another unit
_PATHS = {
    1000.0: "the position in mm",
    100.0: "the position in cm",
    3.28: "the position in feet",
    0.514: "the velocity in knots",
    0.447: "the velocity in mph",
    0.305: "the velocity in ft/s",
    0.278: "the velocity in km/h",
    0.01: "the velocity in cm/s",
    0.001: "the velocity in mm/s, or the position in km",
}
#: ... and how an import map says the unit of a velocity
_LINES = {float(f"{worth:.3g}"): unit for unit, worth in SPEEDS.items()}
#: that ratio is believed where position and velocity correlate so, and is of another unit beyond these: a velocity
#: that a receiver smooths, or positions that are off by metres, move it by some per cent
_GO_TOGETHER, _ONE = 0.9, (0.7, 1.4)
#: metres of a degree of latitude, 110 574 to 111 694 on WGS 84, and of 1e-7 degrees as receivers send them
_DEGREES = {"degrees": 1 / 111.2e3, "1e-7 degrees": 1e7 / 111.2e3, "radians": 1 / 6.371e6}
#: the ratio is a degree's within this share: five decimals are steps of a metre
_AS_DEGREES = 0.15
#: no flight covers less than this in plan (m); as degrees it is 2 km
_SHORT = 0.02
#: degrees of a place are so many times what a throw covers in them: 1 degree off the equator it is 300 times
_AWAY = 100.0
#: a receiver's fix leaps by some metres where the satellites that it sees change
_CHANGE = 10.0
_AS_GAPS = "make these cells empty: they are no fixes"
_IN_DEGREES = (
    'import the raw log with unit = "deg" below [sensors.gps] of the map, and columns = [latitude, longitude, height]'
)


def gps_findings(recording: Recording) -> Iterator[Finding]:
    """Yield what a GPS's positions and velocities say against each other, and fixes that are none."""
    gps = recording.get("gps")
    if gps is None:
        return
    placed = np.all(np.isfinite(gps.value[:, :2]), axis=1)
    t, value = gps.t[placed], gps.value[placed]
    if len(value) < 6:
        return
    no_fix = _no_fix(t, value[:, :3])
    sound = ~no_fix
    if recording.plant == "flight":
        if np.any(no_fix):
            yield Finding(
                "gps.no_fix",
                "error",
                "gps",
                f"rows hold 0, 0, 0 ({np.count_nonzero(no_fix)} of {len(value)}): at {rows_in_words(t, no_fix)}",
                "the place where the disc is",
                f"zeros stand where the receiver had no fix; {_AS_GAPS}",
            )
        for found, rows in _held(t, value, sound):
            sound = sound & ~rows
            yield found
    if np.count_nonzero(sound) < 6:
        return
    t, value = t[sound], value[sound]
    moved, told = _changes(t, value)
    if degrees := _in_degrees(value, moved, told, flies=recording.plant == "flight"):
        yield degrees
        return
    unit = _path_unit(moved, told)
    if unit is not None and _path_unit(moved, told / (gps.interval * recording.sheets["gps"].rate_hz)) is None:
        # a clock that is off by the same factor, by the rate that is stated, is told itself
        return
    if unit is not None:
        yield unit
    yield from _position_and_velocity(value, moved, told, flies=recording.plant == "flight" and unit is None)
    if recording.plant == "flight" and unit is None:
        noise = max(recording.sheets["gps"].noise_rms or 0.0, scatter_of(np.nan_to_num(value[:, :3])))
        yield from _leaps(t, value, noise)
        yield from elsewhere("gps", value[0, :3])


def _no_fix(t: FloatArray, position: FloatArray) -> BoolArray:
    """Tell which rows (n,) are zeros to the last digit because there was no fix.

    Positions that count from the first fix begin with zeros as long as nothing moves: the next one is in reach then.
    """
    zero = np.all(np.nan_to_num(position) == 0.0, axis=1)
    if not np.any(zero) or np.all(zero):
        return np.zeros_like(zero)
    moves = int(np.argmin(zero))
    reach = FASTEST * (t[moves] - t[moves - 1]) + _CHANGE
    if zero[0] and float(np.linalg.norm(np.nan_to_num(position[moves]))) <= reach:
        zero[:moves] = False
    return np.asarray(zero)


def _held(t: FloatArray, value: FloatArray, sound: BoolArray) -> Iterator[tuple[Finding, BoolArray]]:
    """Yield each stretch in which the same fix is written again and again, and its rows but the first, (n,)."""
    rows = np.flatnonzero(sound)
    if rows.size < 6 or find_held(value[rows]) is not None:
        return
    for first, after in standing(t[rows], np.nan_to_num(value[rows, :3])):
        repeats = np.zeros(t.size, dtype=np.bool_)
        repeats[rows[first + 1 : after]] = True
        yield (
            Finding(
                "gps.frozen",
                "error",
                "gps",
                f"it shows one place in {after - first} rows, from {t[rows[first]]:.3f} to {t[rows[after - 1]]:.3f} s",
                "a place that changes while the disc flies",
                "an old fix is repeated, or the disc lies: leave these rows out, they are no fixes of a flight",
            ),
            repeats,
        )


def _changes(t: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return changes of the position over two rows (n, 3), and velocities times the time that they took; 0 for gaps."""
    moved: FloatArray = value[2:, :3] - value[:-2, :3]
    told = (value[2:, 3:] + value[1:-1, 3:] + value[:-2, 3:]) / 3 * (t[2:] - t[:-2])[:, None]
    both = np.isfinite(moved) & np.isfinite(told)
    return np.where(both, moved, 0.0), np.where(both, told, 0.0)


def _in_degrees(value: FloatArray, moved: FloatArray, told: FloatArray, *, flies: bool) -> Finding | None:
    """Return that north and east are a latitude and a longitude, None where they are not.

    Velocities tell the unit where there are any; without them that nothing which flies covers so little, far from 0.
    """
    middle = np.median(value[:, :2], axis=0)
    spans = np.ptp(value[:, :2], axis=0)
    on_earth = abs(middle[0]) <= 90.0 and abs(middle[1]) <= 180.0
    squares, others = np.sum(told[:, :2] ** 2, axis=0), np.sum(moved[:, :2] ** 2, axis=0)
    both = np.sum(moved[:, :2] * told[:, :2], axis=0)
    unit = ""
    for axis in np.flatnonzero((squares > 1.0) & (both > _GO_TOGETHER * np.sqrt(squares * others))):
        for name, ratio in _DEGREES.items():
            latitude = middle[0] * {"degrees": 1.0, "1e-7 degrees": 1e-7}.get(name, 180 / np.pi)
            due = ratio / (np.cos(np.radians(latitude)) if axis == 1 else 1.0)
            unit = name if abs(both[axis] / squares[axis] / due - 1) < _AS_DEGREES else unit
    # of metres from the place of release, the middle is within what they span
    far = float(np.max(np.abs(middle))) > _AWAY * float(np.max(spans))
    if not unit and flies and on_earth and float(np.max(spans)) < _SHORT and not np.any(squares > 1.0):
        unit = "degrees"
    if not unit or not far:
        return None
    return Finding(
        "gps.degrees",
        "error",
        "gps",
        f"north_m and east_m hold {middle[0]:.10g} and {middle[1]:.10g} and change by {spans[0]:.2g} and {spans[1]:.2g}"
        f": a latitude and a longitude in {unit}",
        "metres from the place of release",
        _IN_DEGREES if unit == "degrees" else f"write them in degrees; then {_IN_DEGREES}",
    )


def _position_and_velocity(value: FloatArray, moved: FloatArray, told: FloatArray, *, flies: bool) -> Iterator[Finding]:
    """Yield an axis that is reversed in position or velocity, and a speed that is no throw's."""
    speed = float(np.nanmax(np.linalg.norm(np.nan_to_num(value[:, 3:]), axis=1)))
    if flies and speed > 60:
        yield Finding(
            "gps.speed", "warning", "gps", f"it goes at {speed:.3g} m/s", f"up to {FASTEST:g} m/s", "in km/h?"
        )
    for axis, name in enumerate(("north", "east", "down")):
        far = np.sum(moved[:, axis] ** 2) + np.sum(told[:, axis] ** 2)
        # the share of its own motion that an axis's velocity explains: 1 where both agree, -1 where a sign is wrong
        if far > 1.0 and 2 * float(moved[:, axis] @ told[:, axis]) / far < 0:
            yield Finding(
                catalogued(GpsAxes).id,
                "warning",
                "gps",
                f"its {name} position and velocity go opposite ways",
                "the velocity to be the position's change",
                "is one of them written east-north-up?",
            )


def _path_unit(moved: FloatArray, told: FloatArray) -> Finding | None:
    """Return that position and velocity are in units that do not belong together, None where they are not.

    ``moved`` are changes of the position (n, 3), ``told`` the velocities times the time that they took.
    """
    squares, other, both = float(np.sum(told**2)), float(np.sum(moved**2)), float(np.sum(moved * told))
    if squares * other == 0.0 or both < _GO_TOGETHER * np.sqrt(squares * other):
        return None
    ratio = both / squares
    if _ONE[0] <= ratio <= _ONE[1]:
        return None
    near = min(_PATHS, key=lambda known: abs(np.log(ratio / known)))
    told_near = abs(np.log(ratio / near)) < np.log(1.1)
    line = f'; then write velocity_unit = "{_LINES.get(near)}" below [sensors.gps] of the import map' * (near in _LINES)
    return Finding(
        "gps.unit",
        "error",
        "gps",
        f"its position changes {ratio:.3g} times as fast as its velocity says",
        "metres and m/s, once as fast",
        f"{_PATHS[near]}?{line}" if told_near else "one of the two is in another unit",
    )


def _leaps(t: FloatArray, value: FloatArray, noise: float) -> Iterator[Finding]:
    """Yield fixes that no throw could reach from those before and after; where most are such, their unit is another."""
    axes = np.isfinite(value[:, :3]).all(axis=0)
    out = out_of_reach(t, value[:, :3][:, axes], _CHANGE + 6.0 * noise)
    if np.any(out) and np.mean(out) < 0.5:
        yield Finding(
            "gps.leap",
            "warning",
            "gps",
            f"fixes leap ({np.count_nonzero(out)} of {t.size}): at {rows_in_words(t, out)}",
            f"a path that is nowhere faster than {FASTEST:g} m/s",
            _AS_GAPS,
        )


def elsewhere(sensor: str, first: FloatArray) -> Iterator[Finding]:
    """Yield that a path, (3,) m its first point, counts from another place than the one of release, on the ground."""
    plan, high = float(np.linalg.norm(np.nan_to_num(first[:2]))), abs(float(np.nan_to_num(first[2])))
    if plan <= FARTHEST and high <= _HIGH:
        return
    what = [f"at north {first[0]:.10g}, east {first[1]:.10g} m"] if plan > FARTHEST else []
    what += [f"{high:.6g} m {'above' if first[2] < 0 else 'below'} the ground"] if high > _HIGH else []
    yield Finding(
        f"{sensor}.origin",
        "warning",
        sensor,
        f"it begins {', '.join(what)}",
        "positions from the place of release on the ground, which heights count from",
        "subtract the place of release from north_m and east_m, and the ground's down from down_m",
    )
