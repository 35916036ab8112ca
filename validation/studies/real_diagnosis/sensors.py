"""What a sensor's own readings and sheet lack for a diagnosis, without a model of the motion."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from discsim.arrays import FloatArray, sd_by_median
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.importing import ImportMap, find_map, import_recording, read_map

__all__ = [
    "Checked",
    "Iron",
    "Linear",
    "against_cameras",
    "check",
    "checked_log",
    "field_in_body",
    "iron_of",
    "lost_samples",
    "quiet_noise",
    "repeated_share",
    "rest_of",
]

#: sensors of a log that are looked at, in the order of the table
LOOKED_AT = ("magnetometer", "accelerometer", "gyroscope")
#: length of the stretch in which noise and rest are looked for, s
QUIET = 1.0
#: a body is at rest where no axis of the first of these that it carries scatters by more, in the sensor's unit
STILL = {"gyroscope": float(np.radians(1.0)), "accelerometer": 0.15, "magnetometer": 1.0}
#: a step longer than this many of the usual ones has lost samples
LOST = 1.5
#: what is worth a remark: shares of repeated rows, of the rate, of gravity, of the field; rad/s of a gyroscope's bias
REPEATED, RATE_OFF, REST_OFF, IRON_OFF, BIAS = 0.02, 0.01, 0.02, 0.05, float(np.radians(0.5))
#: a sphere covered less than this has a centre that is known across the plane of its readings only
FLAT = 0.1
#: a row can be told to repeat the one before where the readings on both sides change by this many resolutions
MOVING = 4.0
#: third differences of white noise have this many times its variance
THIRD = 20.0


@dataclass(frozen=True)
class Iron:
    """A sphere through a magnetometer's readings: centre (3,) and radius, uT, and the scatter of the field's size.

    ``before`` and ``after`` are standard deviations of the size over the radius, as read and about the centre;
    ``reach`` tells how much of the sphere is covered: the least eigenvalue of the directions' covariance, times 3,
    which is 1 where all directions are equally frequent and 0 where they lie in a plane.
    """

    centre: FloatArray
    radius: float
    before: float
    after: float
    reach: float


@dataclass(frozen=True)
class Checked:
    """One sensor of one log.

    Attributes
    ----------
    log, sensor : str
        Which.
    rows : int
        Samples that were read.
    rate : float
        Median rate of the time stamps, Hz.
    longest : float
        Longest step, s.
    lost : int
        Samples missing by the time stamps.
    repeated : float
        Share of rows equal to the row before, of those on both sides of which the readings change.
    clipped : int
        Single readings at the stated range.
    noise : float
        Scatter in the quietest second, in the sensor's unit.
    stated_noise : float or None
        What the sheet says.
    lacks : tuple of str
        What a diagnosis has to do without, or must find for itself.
    """

    log: str
    sensor: str
    rows: int
    rate: float
    longest: float
    lost: int
    repeated: float
    clipped: int
    noise: float
    stated_noise: float | None
    lacks: tuple[str, ...]


def lost_samples(t: FloatArray) -> int:
    """Return how many samples the time stamps (n,) leave out, at the usual step."""
    steps = np.diff(t)
    if not steps.size:
        return 0
    count = steps / np.median(steps)
    return int(np.sum(np.round(count[count > LOST]) - 1.0))


def quiet_noise(samples: Samples) -> float:
    """Return the noise of a sensor where it moves least: third differences, by their median, in the quietest second.

    The root mean square over the axes. A step of the resolution that hides the noise gives zero.
    """
    value = samples.value.reshape(len(samples), -1)
    count = max(round(QUIET / samples.interval), 12)
    if len(samples) < count + 3:
        return float("nan")
    third = np.diff(value, 3, axis=0)
    found = [
        np.sqrt(np.mean(sd_by_median(third[k : k + count], axis=0) ** 2 / THIRD))
        for k in range(0, len(third) - count + 1, count // 4)
    ]
    return float(np.min(found))


def repeated_share(value: FloatArray, least: float) -> float:
    """Return the share of rows of (n, k) readings that repeat the one before, where they change by more than ``least``.

    Only rows count whose neighbours before and after have changed, so that a body at rest repeats nothing.
    """
    change = np.max(np.abs(np.diff(value, axis=0)), axis=1)
    moving = (change[:-2] > least) & (change[2:] > least)
    return float(np.mean(change[1:-1][moving] == 0.0)) if moving.any() else 0.0


def rest_of(recording: Recording) -> tuple[float, float] | None:
    """Return the quietest second of a log, (start, stop) s, or None where the body is never at rest."""
    for sensor, still in STILL.items():
        samples = recording.get(sensor)
        if samples is None:
            continue
        count = max(round(QUIET / samples.interval), 8)
        starts = np.arange(0, max(len(samples) - count, 0) + 1, max(count // 4, 1))
        scatter = np.array([np.max(np.std(samples.value[k : k + count], axis=0)) for k in starts])
        best = int(np.argmin(scatter))
        if scatter[best] > still:
            return None
        first = int(starts[best])
        return float(samples.t[first]), float(samples.t[min(first + count, len(samples)) - 1])
    return None


def iron_of(field: FloatArray) -> Iron:
    """Fit a sphere to readings (n, 3) uT of a field, by algebra."""
    size = np.linalg.norm(field, axis=1)
    scale = float(np.mean(size))
    A = np.column_stack((2.0 * field / scale, np.ones(len(field))))
    centre, rest = np.split(np.linalg.lstsq(A, (size / scale) ** 2, rcond=None)[0], [3])
    about = field - centre * scale
    around = np.linalg.norm(about, axis=1)
    directions = about / around[:, None]
    reach = 3.0 * float(np.linalg.eigvalsh(np.cov(directions.T, bias=True))[0])
    radius = scale * float(np.sqrt(max(float(rest[0] + centre @ centre), 0.0)))
    return Iron(centre * scale, radius, float(np.std(size)) / radius, float(np.std(around)) / radius, reach)


def check(log: str, recording: Recording, *, stamps: bool = True) -> list[Checked]:
    """Look at each sensor of a log; ``stamps`` tells whether its file has times of its own."""
    rest = rest_of(recording)
    return [_checked(log, recording, sensor, rest, stamps=stamps) for sensor in LOOKED_AT if sensor in recording]


def checked_log(log: str, raw: Path, map_name: str, rows: slice | None = None) -> tuple[list[Checked], int]:
    """Import a log by a shipped map and look at it; return that, and how many repairs it took.

    Raises `InputError` as importing does.
    """
    shipped: ImportMap = read_map(find_map(map_name))
    imported = import_recording(raw, shipped, rows)
    return check(log, imported.recording, stamps=shipped.time.column is not None), len(imported.repairs)


def _checked(log: str, recording: Recording, sensor: str, rest: tuple[float, float] | None, *, stamps: bool) -> Checked:
    samples, sheet = recording.samples[sensor], recording.sheets[sensor]
    noise = quiet_noise(samples)
    lost, clipped = lost_samples(samples.t), int(np.count_nonzero(sheet.clipped(samples.value)))
    repeated = repeated_share(samples.value, MOVING * (sheet.resolution or 0.0))
    rate, longest = 1.0 / samples.interval, float(np.max(np.diff(samples.t)))
    lacks = [] if stamps else ["no time stamps: a step is assumed"]
    if stamps and abs(rate / sheet.rate_hz - 1.0) > RATE_OFF:
        lacks.append(f"stamps say {rate:.4g} Hz, the sheet {sheet.rate_hz:g} Hz")
    if lost:
        lacks.append(f"{lost} sample{'s' * (lost > 1)} lost, the longest step is {1000.0 * longest:.0f} ms")
    if repeated > REPEATED:
        lacks.append(f"{100.0 * repeated:.0f} % of rows repeat the one before")
    if sheet.noise_rms is None:
        lacks.append("noise not stated")
    if sheet.range is None:
        lacks.append("range not stated: clipping is told by the readings alone")
    elif clipped:
        lacks.append(f"{clipped} readings at the range")
    lacks += _of_its_kind(recording, sensor, samples, sheet, rest)
    return Checked(
        log, sensor, len(samples), rate, longest, lost, repeated, clipped, noise, sheet.noise_rms, tuple(lacks)
    )


def _of_its_kind(
    recording: Recording, sensor: str, samples: Samples, sheet: SensorSheet, rest: tuple[float, float] | None
) -> list[str]:
    """Return what one kind of sensor alone can lack."""
    quiet = None if rest is None else samples.between(*rest).value
    lacks = []
    if sensor == "magnetometer":
        iron = iron_of(samples.value)
        if iron.before > IRON_OFF:
            centre = ", ".join(f"{each:.0f}" for each in iron.centre)
            about = f"a sphere of {iron.radius:.0f} uT about ({centre}) uT leaves {100.0 * iron.after:.0f} %"
            flat = "" if iron.reach > FLAT else ", but its directions lie nearly in a plane"
            lacks.append(f"not calibrated: the field's size scatters by {100.0 * iron.before:.0f} %; {about}{flat}")
    elif sensor == "accelerometer":
        if sheet.position is None:
            lacks.append("where it sits is not stated: no rate from it")
        if quiet is not None and len(quiet):
            ratio = float(np.linalg.norm(np.mean(quiet, axis=0))) / recording.environment.gravity
            if abs(ratio - 1.0) > REST_OFF:
                lacks.append(f"reads {ratio:.2f} g at rest")
    elif quiet is not None and len(quiet):
        bias = np.mean(quiet, axis=0)
        if float(np.max(np.abs(bias))) > BIAS:
            lacks.append(f"reads ({', '.join(f'{each:+.1f}' for each in np.degrees(bias))}) deg/s at rest")
    if sensor != "magnetometer" and quiet is None:
        lacks.append("never at rest: no bias can be read off")
    return lacks


# ----------------------------------------------------------------------------------------- against cameras


#: samples by which a sensor is tried to be late against the cameras
LATENESS = np.arange(-12, 13)


@dataclass(frozen=True)
class Linear:
    """A sensor as a linear function of what cameras say it should read: ``matrix`` (3, 3) and ``offset`` (3,).

    ``late`` is by how much its readings are late against the cameras where that leaves least, s; ``apart`` the root
    mean square of readings less what they should be, ``left`` of what matrix and offset leave, ``at_once`` of what
    they leave with no lateness; all in the sensor's unit.
    """

    matrix: FloatArray
    offset: FloatArray
    late: float
    apart: float
    left: float
    at_once: float


def against_cameras(reading: FloatArray, expected: FloatArray, interval: float) -> Linear:
    """Fit a linear sensor, possibly late, to what cameras say: ``reading`` and ``expected`` (n, 3), NaN unknown."""
    edge = int(LATENESS[-1])
    middle = slice(edge, len(reading) - edge)
    tried = []
    for late in LATENESS:
        x, y = expected[edge - late : len(expected) - edge - late], reading[middle]
        known = np.all(np.isfinite(x), axis=1)
        matrix, offset, rest = _linear(x[known], y[known])
        tried.append((_rms(rest), late * interval, matrix, offset))
    left, late_s, matrix, offset = min(tried, key=lambda one: one[0])
    known = np.all(np.isfinite(expected), axis=1)
    apart = _rms(reading[known] - expected[known])
    return Linear(matrix, offset, late_s, apart, left, tried[int(np.flatnonzero(LATENESS == 0)[0])][0])


def field_in_body(field: FloatArray, attitude: FloatArray) -> FloatArray:
    """Return a field (3,) in North-East-Down in the body, (n, 3); ``attitude`` (n, 4), w first, to East-North-Up."""
    up = np.array([field[1], field[0], -field[2]])
    return np.asarray(Rotation.from_quat(attitude[:, [1, 2, 3, 0]]).inv().apply(up))


def _linear(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return matrix (3, 3) and offset (3,) of y = M x + b by least squares, and what they leave (n, 3)."""
    A = np.column_stack((x, np.ones(len(x))))
    solution: FloatArray = np.linalg.lstsq(A, y, rcond=None)[0].astype(np.float64)
    return np.asarray(solution[:3].T), np.asarray(solution[3]), np.asarray(y - A @ solution)


def _rms(rows: FloatArray) -> float:
    """Return the root mean square length of rows (n, 3)."""
    return float(np.sqrt(np.mean(np.sum(rows**2, axis=1))))
