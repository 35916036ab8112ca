"""What the sensors of a spinning body show in the frame that turns with the field's phase.

Takes a recording whose magnetometer has its spin axis along z; gives slow signals on an even grid: the field across and
along the axis, and each other sensor multiplied by the field's phase and averaged over some turns (synchronous
detection, as a lock-in amplifier does it). Physics between sensors (`discsim.validation.diagnosis.signals.relations`)
are plain equations between these signals, whatever the columns of a sensor are called.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import ComplexArray, FloatArray
from discsim.recording import Recording
from discsim.validation.diagnosis.signals.phase_regression import rate_of
from discsim.validation.identification.initial.path import Fixes, local_cubics, path_fixes
from discsim.validation.identification.initial.spin_phase import field_spin
from discsim.validation.identification.plants import plant_of

__all__ = ["FlightPath", "Locked", "SpinSignals", "averages", "mean_readings", "spin_signals", "turning_line", "usable"]


#: spacing of the grid, and the one sigma of the averaging, s: a turn or more at 50 rad/s, slow beside precession
STEP, SIGMA = 0.05, 0.12
#: the same of what stands still in the body, s
STILL = 0.3
#: what still turns below the averaging's band is no spin: slowest rate, rad/s, that is looked at
SLOWEST = 12.0
#: fewest instants of the grid
FEWEST = 12


@dataclass(frozen=True)
class Locked:
    """A sensor's three columns: averages of each (n, 3), and of each times exp(i psi) once its average is taken off.

    NaN where a column clips or is silent.
    """

    mean: FloatArray
    turning: ComplexArray


@dataclass(frozen=True)
class FlightPath:
    """What the fixes say, in their written columns: acceleration, velocity, position (n, 3) each."""

    acceleration: FloatArray
    velocity: FloatArray
    position: FloatArray


@dataclass(frozen=True)
class SpinSignals:
    """Slow signals of one recording on a grid (n,); None for a sensor that is absent.

    ``angle`` (n,) is psi, how far the body has turned by the field's phase, rad, ``rate`` (n,) its slope, rad/s, NaN
    where too slow; ``measured`` tells that the field shows it, and not the sum of another sensor's rate. ``across`` and
    ``along`` (n,) are the field across and along the axis, uT; ``gyro_sign`` (3,) the sign of each column of the
    gyroscope; ``axes`` the lines (3,) about which magnetometer and gyroscope show the body turning; ``reference`` times
    (m,) s, and the angle and the rate there by a rig's rate reference or command.
    """

    recording: Recording
    grid: FloatArray
    angle: FloatArray
    measured: bool
    rate: FloatArray
    across: FloatArray
    along: FloatArray
    gyro: Locked | None = None
    gyro_sign: FloatArray | None = None
    force: Locked | None = None
    path: FlightPath | None = None
    axes: Mapping[str, FloatArray] = field(default_factory=dict)
    reference: tuple[FloatArray, FloatArray, FloatArray] | None = None


def usable(recording: Recording, sensor: str) -> tuple[FloatArray, FloatArray] | None:
    """Return times (n,) and readings (n, 3) of a sensor, NaN where clipped; None where it is absent."""
    samples = recording.get(sensor)
    if samples is None or len(samples) < FEWEST:
        return None
    return samples.t, np.where(recording.sheets[sensor].clipped(samples.value), np.nan, samples.value)


def turning_axis(t: FloatArray, y: FloatArray) -> tuple[FloatArray, float] | None:
    """Return the axis (3,) about which a vector y (n, 3) turns right-handedly, and how pure that turning is (0 to 1).

    Sums the cross products of successive differences: what stands still in the sensor (hard iron) drops out. None
    where there are too few neighbours.
    """
    d, gap = np.diff(y, axis=0), np.diff(t)
    near = gap < 1.5 * float(np.median(gap))
    both = near[1:] & near[:-1] & np.all(np.isfinite(d[1:]), axis=1) & np.all(np.isfinite(d[:-1]), axis=1)
    if np.count_nonzero(both) < FEWEST:
        return None
    turned = np.cross(d[:-1][both], d[1:][both])
    total = np.sum(turned, axis=0)
    size = float(np.linalg.norm(total))
    whole = float(np.sum(np.linalg.norm(turned, axis=1)))
    return (total / size, size / whole) if size > 0.0 else None


#: a path whose way is shorter than its velocities' by this factor is in degrees, or in km, and holds nothing against
#: other sensors: what a receiver smooths, or a velocity in km/h, is within 4
_UNIT = 10.0
#: no path of a second is shorter, m
_STANDS = 0.1
#: a turning less pure than this has no axis worth the name; sound throws have 0.9 and more
PURE = 0.4


def turning_line(recording: Recording, sensor: str) -> FloatArray | None:
    """Return the unit vector (3,) in written columns along which the body turns, of either sign.

    By a magnetometer, about which its field turns; by a gyroscope, of its mean rate: of one that clips only on a rig,
    whose axis stands still, while it turns slowly enough. None where nothing turns.
    """
    found = usable(recording, sensor)
    if found is None:
        return None
    if sensor == "magnetometer":
        turned = turning_axis(*found)
        return None if turned is None or turned[1] < PURE else turned[0]
    rates = found[1]
    if not plant_of(recording).airborne:
        rates = rates[np.all(np.isfinite(rates), axis=1)]
        if len(rates) < FEWEST:
            return None
    axis = np.mean(rates, axis=0)
    size = float(np.linalg.norm(axis))
    return np.asarray(axis / size) if np.isfinite(size) and size > 1.0 else None


def averages(t: FloatArray, value: ComplexArray | FloatArray, grid: FloatArray, sigma: float = SIGMA) -> ComplexArray:
    """Return Gaussian averages of values (n,) at the instants of an even grid (m,); NaN where there are none."""
    good = np.isfinite(value)
    fine = STEP / 10.0
    first = grid[0] - 4.0 * sigma
    slots = int(np.ceil((grid[-1] - grid[0] + 8.0 * sigma) / fine)) + 1
    slot = np.rint((t[good] - first) / fine).astype(int)
    inside = (slot >= 0) & (slot < slots)
    x, slot = np.asarray(value)[good][inside], slot[inside]
    count = np.bincount(slot, minlength=slots).astype(float)
    total = np.bincount(slot, np.real(x), slots) + 1j * np.bincount(slot, np.imag(x), slots)
    half = int(np.ceil(3.5 * sigma / fine))
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) * fine / sigma) ** 2)
    at = np.rint((grid - first) / fine).astype(int)
    weight = np.convolve(count, kernel, "same")[at]
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.convolve(total, kernel, "same")[at] / np.where(weight > 0.5, weight, np.nan)
    return np.asarray(mean)


def mean_readings(t: FloatArray, value: FloatArray, grid: FloatArray, sigma: float) -> FloatArray:
    """Return Gaussian averages of readings (n, 3) at the instants of an even grid (m, 3); NaN where there are none."""
    return np.column_stack([np.real(averages(t, column, grid, sigma)) for column in value.T])


def spin_signals(recording: Recording) -> SpinSignals | None:
    """Return the slow signals of a recording; None where nothing shows a spin fast enough, nor is there a path.

    The phase is the field's; without a magnetometer the angle of what shows the rate (a reference, a command, an
    unclipped gyroscope). Without any a path still tells by itself which way is up, and where it starts.
    """
    found = _phase(recording)
    if found is None:
        return _path_alone(recording)
    source, phase, start, stop = found
    if stop - start < FEWEST * STEP + 0.2:
        return None
    grid = np.arange(start + 0.1, stop - 0.1, STEP)
    angle = -phase(grid)
    rate = np.gradient(angle, STEP)
    fast = np.abs(rate) > SLOWEST
    if grid.size < FEWEST or np.count_nonzero(fast) < FEWEST:
        return None
    nothing = np.full(grid.size, np.nan)
    across, along = nothing, nothing
    known = usable(recording, "magnetometer")
    if known is not None and source == "magnetometer":
        t, m = known
        across = np.abs(averages(t, (m[:, 0] + 1j * m[:, 1]) * np.exp(-1j * phase(t)), grid))
        along = np.real(averages(t, m[:, 2], grid))

    def locked(sensor: str) -> Locked | None:
        found = usable(recording, sensor)
        if found is None:
            return None
        t, y = found
        factor = np.exp(-1j * phase(t))
        coarse = np.arange(t[0], t[-1] + STEP, STEP)
        turning = []
        for column in y.T:
            still = np.real(averages(t, column, coarse, STILL))
            known = np.isfinite(still)
            still = np.interp(t, coarse[known], still[known]) if known.any() else np.full(t.size, np.nan)
            turning.append(averages(t, (column - still) * factor, grid))
        mean = [np.real(averages(t, column, grid, STILL)) for column in y.T]
        return Locked(np.column_stack(mean), np.column_stack(turning))

    gyroscope = recording.get("gyroscope")
    return SpinSignals(
        recording,
        grid,
        angle,
        source == "magnetometer",
        np.where(fast, rate, np.nan),
        across,
        along,
        locked("gyroscope"),
        None if gyroscope is None else _signs(gyroscope.value),
        locked("accelerometer"),
        _path(recording, grid),
        {name: axis for name in ("magnetometer", "gyroscope") if (axis := turning_line(recording, name)) is not None},
        _reference(recording, float(grid[-1])),
    )


def _path_alone(recording: Recording) -> SpinSignals | None:
    """Return the signals of a recording in which no sensor shows the spin: its path; None where there is none."""
    fixes = path_fixes(recording)
    if fixes is None:
        return None
    grid = np.arange(float(fixes.t[0]) + 0.1, float(fixes.t[-1]) - 0.1, STEP)
    path = _path(recording, grid) if grid.size >= FEWEST else None
    silent = np.full(grid.size, np.nan)
    return None if path is None else SpinSignals(recording, grid, silent, False, silent, silent, silent, path=path)


def _reference(recording: Recording, end: float) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return times (m,) s, and the angle and the rate there, of what shows or orders a rig's rate."""
    samples = recording.get("rate_reference") or recording.command
    if samples is None or not np.any(known := np.isfinite(samples.value)):
        return None
    t, r = samples.t[known], samples.value[known]
    # between knots a rate is linear and the angle quadratic: summed on a fine grid
    fine = np.arange(t[0], max(end, float(t[-1])) + 1.0, 0.2 * STEP)
    rate = np.interp(fine, t, r)
    return fine, cumulative_trapezoid(rate, dx=0.2 * STEP, initial=0), rate


def _signs(value: FloatArray) -> FloatArray:
    """Return the sign (k,) of most readings of each column; 0 for a column without any."""
    some = np.any(np.isfinite(value), axis=0)
    return np.array(
        [np.sign(np.nanmedian(column)) if there else 0.0 for column, there in zip(value.T, some, strict=True)]
    )


def _phase(recording: Recording) -> tuple[str, Callable[[FloatArray], FloatArray], float, float] | None:
    """Return what shows the phase of a vector fixed in N seen from B, the phase over time, and from when to when.

    A magnetometer does where the field is stated: against its size iron is told from what turns.
    """
    if "magnetometer" in recording and recording.environment.field_known:
        spin = field_spin(recording, steady=not plant_of(recording).airborne)
        return None if spin is None else ("magnetometer", spin.phase_at, float(spin.grid[0]), float(spin.grid[-1]))
    known = rate_of(recording)
    if known is None and recording.command is not None:
        known = "command", recording.command.t, recording.command.value
    if known is None:
        return None
    source, t, r = known
    psi = cumulative_trapezoid(r, t, initial=0)
    return source, lambda at: -np.interp(at, t, psi), float(t[0]), float(t[-1])


def _in_metres(fixes: Fixes) -> bool:
    """Tell whether the plan's positions change by what the velocities say, within a factor of `_UNIT`.

    Without velocities: whether they change at all, where they are not at the origin.
    """
    told = 0.5 * (fixes.velocity[1:, :2] + fixes.velocity[:-1, :2]) * np.diff(fixes.t)[:, None]
    both = np.all(np.isfinite(told), axis=1)
    way = float(np.sum(np.linalg.norm(told[both], axis=1)))
    steps = np.linalg.norm(np.diff(fixes.position[:, :2], axis=0), axis=1)
    if way < 1.0:
        return bool(np.sum(steps) > _STANDS or np.max(np.abs(fixes.position[:, :2])) < 1.0)
    return bool(np.sum(steps[both]) > way / _UNIT)


def _path(recording: Recording, grid: FloatArray) -> FlightPath | None:
    fixes = path_fixes(recording)
    if fixes is None or fixes.t[-1] - fixes.t[0] < 1.0 or not _in_metres(fixes):
        return None
    cubic = local_cubics(fixes, np.clip(grid, fixes.t[0] + 0.2, fixes.t[-1] - 0.2))
    return FlightPath(cubic[:, 2], cubic[:, 1], cubic[:, 0])
