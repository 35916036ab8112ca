"""`Replay`: a motion to look at, with what of it is known in words, from a flight, a truth file or a recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray, readonly
from discsim.engine import RELEASE_HEIGHT
from discsim.errors import InputError
from discsim.estimators.methods import best
from discsim.frames import body_to_ned, conjugate, multiply, rotation_vector, turn
from discsim.motion import Motion
from discsim.recording import COMMAND_HEADER, Recording, Samples, read_csv
from discsim.validation.reporting.truth import FLIGHT_HEADER

__all__ = ["Replay", "replay_motion", "replay_recording"]

#: spacing of an attitude integrated from a rate, s: at 7000 deg/s a quarter of a radian, which interpolation follows
INTEGRATION_STEP = 2e-3
DRIVER_DIAMETER = 0.212


@dataclass(frozen=True)
class Replay:
    """Where a disc or a rate table is seen over time, and what of it was known.

    Attributes
    ----------
    model : str
        The drawing in ``models/``.
    t : (n,) array
        Ascending times, s.
    position : (n, 3) array
        Of the geometric centre, in N, m.
    attitude : (n, 4) array
        Quaternion that turns B components into N; less than half a turn between neighbours.
    rate : (n,) array
        Rate about z_B as told to the viewer, rad/s; NaN where nothing tells it.
    diameter : float
        Of the disc, m.
    notes : tuple of str
        Where the motion comes from, and what of it is not known; shown with every picture.
    """

    model: Literal["disc.xml", "rate_table.xml"]
    t: FloatArray
    position: FloatArray
    attitude: FloatArray
    rate: FloatArray
    diameter: float
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in ("t", "position", "attitude", "rate"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def start(self) -> float:
        """First instant, s."""
        return float(self.t[0])

    @property
    def end(self) -> float:
        """Last instant, s."""
        return float(self.t[-1])

    @property
    def travels(self) -> bool:
        """Whether the motion goes anywhere: more than a metre."""
        return bool(np.linalg.norm(np.ptp(self.position, axis=0)) > 1.0)

    def position_at(self, t: FloatArray) -> FloatArray:
        """Return positions (m, 3) in N at instants t (m,), the nearest known outside."""
        return np.column_stack([np.interp(t, self.t, axis) for axis in self.position.T])

    def attitude_at(self, t: FloatArray) -> FloatArray:
        """Return the attitudes (m, 4) at instants t (m,), along the shortest turn between their neighbours."""
        t = np.clip(t, self.start, self.end)
        k = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, self.t.size - 2)
        share = ((t - self.t[k]) / (self.t[k + 1] - self.t[k]))[:, None]
        between = rotation_vector(multiply(conjugate(self.attitude[k]), self.attitude[k + 1]))
        return multiply(self.attitude[k], turn(share * between))

    def rate_at(self, t: FloatArray) -> FloatArray:
        """Return the rates about z_B (m,) at instants t (m,), rad/s."""
        return np.interp(t, self.t, self.rate)

    def between(self, start: float, stop: float) -> Replay:
        """Return the replay from start to stop, s; raises `InputError` where it does not reach that far."""
        if not self.start <= start < stop <= self.end:
            raise InputError(
                f"no motion from {start:g} to {stop:g} s; expected a span in {self.start:g}:{self.end:.6g}"
            )
        inner = self.t[(self.t > start) & (self.t < stop)]
        t = np.array([start, *inner, stop])
        return replace(self, t=t, position=self.position_at(t), attitude=self.attitude_at(t), rate=self.rate_at(t))


def replay_motion(motion: Motion, diameter: float, note: str) -> Replay:
    """Return a flight in MuJoCo as a replay of the disc's geometric centre."""
    offset = np.einsum("nij,j->ni", body_to_ned(motion.attitude), motion.centre_of_mass)
    position = motion.position - offset
    return Replay("disc.xml", motion.t, position, motion.attitude, motion.rate[:, 2], diameter, (note,))


def replay_recording(recording: Recording) -> Replay:
    """Return what a recording tells of its motion: the truth beside it, else what its sensors saw.

    ``truth.csv`` gives a flight whole and a rig's rate, which is integrated. Without it a rig turns by its
    rate_reference, its command, or its estimated rate; a flight moves along its track or gps, drawn level because
    attitude is unknown, and turns by its estimated rate. Raises `InputError` where nothing tells the motion.
    """
    truth = None if recording.path is None else recording.path / "truth.csv"
    rig = recording.plant in ("rate_table", "spin_down")
    if truth is not None and truth.exists():
        return _true_rig(truth) if rig else _true_flight(truth, _diameter(recording))
    return _measured_rig(recording) if rig else _measured_flight(recording)


def _diameter(recording: Recording) -> float:
    return recording.disc.diameter if recording.disc is not None else DRIVER_DIAMETER


def _true_flight(path: Path, diameter: float) -> Replay:
    truth = read_csv(path, FLIGHT_HEADER, gaps_allowed=False)
    _need_two(truth, str(path))
    roll, pitch, yaw = truth.value[:, 6:9].T
    x, y, z = np.eye(3)
    # C_NB = C1(roll)' C2(pitch)' C3(yaw)', (A1)
    tilt = multiply(turn(roll[:, None] * x), turn(pitch[:, None] * y))
    attitude = multiply(tilt, turn(yaw[:, None] * z))
    notes = (f"true motion of {path.parent.name or path.parent}",)
    return Replay("disc.xml", truth.t, truth.value[:, :3], attitude, truth.value[:, 11], diameter, notes)


def _true_rig(path: Path) -> Replay:
    truth = read_csv(path, COMMAND_HEADER, gaps_allowed=False)
    _need_two(truth, str(path))
    return _turning(truth, f"true rate of {path.parent.name or path.parent}, integrated; angle at the start unknown")


def _measured_rig(recording: Recording) -> Replay:
    angle = "integrated; angle at the start unknown"
    if (reading := recording.get("rate_reference")) is not None:
        known = np.isfinite(reading.value)
        samples = Samples(reading.t[known], reading.value[known])
        _need_two(samples, f"{recording.path or recording.name}: rate_reference")
        return _turning(samples, f"rate_reference of {recording.name}, {angle}")
    if recording.command is not None:
        _need_two(recording.command, f"{recording.path or recording.name}: command")
        return _turning(recording.command, f"command of {recording.name} (not a measurement), {angle}")
    spin, note = _estimated_rate(recording)
    if spin is None:
        raise InputError(f"{recording.path or recording.name}: nothing tells how the rig turns ({note})")
    return _turning(spin, f"{note}, {angle}")


def _turning(rate: Samples, note: str) -> Replay:
    t = _grid(float(rate.t[0]), float(rate.t[-1]))
    known, attitude = _integrated(rate, t)
    return Replay("rate_table.xml", t, np.zeros((t.size, 3)), attitude, known, DRIVER_DIAMETER, (note,))


def _measured_flight(recording: Recording) -> Replay:
    sensor = next((name for name in ("track", "gps") if _axes_seen(recording, name)), None)
    spin, how = _estimated_rate(recording)
    if sensor is None and spin is None:
        lacks = [_lack(recording, name) for name in ("track", "gps")]
        raise InputError(
            f"{recording.path or recording.name}: nothing tells the motion ({', '.join(lacks)}); expected two "
            f"points of an axis of a track or gps, or {how}"
        )
    if sensor is None:
        assert spin is not None
        empty = [f" ({_lack(recording, name)})" for name in ("track", "gps") if name in recording]
        where = f"position unknown: drawn in one place{''.join(empty)}"
        t = _grid(float(spin.t[0]), float(spin.t[-1]))
        position = np.tile([0.0, 0.0, -RELEASE_HEIGHT], (t.size, 1))
    else:
        t, position, where = _seen_path(recording, sensor)
    rate, attitude = np.full(t.size, np.nan), np.tile([1.0, 0.0, 0.0, 0.0], (t.size, 1))
    if spin is not None:
        rate, attitude = _integrated(spin, t)
    notes = (where, "attitude unknown: drawn level", how if spin is not None else "spin unknown: not drawn")
    return Replay("disc.xml", t, position, attitude, rate, _diameter(recording), notes)


def _axes_seen(recording: Recording, sensor: str) -> list[int]:
    """Return the axes north, east, down (0, 1, 2) of which a sensor has two readings or more."""
    samples = recording.get(sensor)
    if samples is None:
        return []
    return [axis for axis in range(3) if np.count_nonzero(np.isfinite(samples.value[:, axis])) >= 2]


def _lack(recording: Recording, sensor: str) -> str:
    """Return in words why a sensor shows no path."""
    return f"no {sensor}" if sensor not in recording else f"no two numbers in a column of {sensor}.csv"


def _seen_path(recording: Recording, sensor: str) -> tuple[FloatArray, FloatArray, str]:
    """Return times (n,), positions (n, 3) m along the axes that a sensor has seen, and what of them is unknown.

    Each axis runs straight over its own gaps. One that was not seen stays at zero, a height at that of a release.
    """
    samples, axes = recording.samples[sensor], _axes_seen(recording, sensor)
    known = samples.t[np.any(np.isfinite(samples.value[:, axes]), axis=1)]
    t = _grid(float(known[0]), float(known[-1]))
    position = np.tile([0.0, 0.0, -RELEASE_HEIGHT], (t.size, 1))
    for axis in axes:
        there = np.isfinite(samples.value[:, axis])
        position[:, axis] = np.interp(t, samples.t[there], samples.value[there, axis])
    where = f"position: {sensor} of {recording.name}"
    unseen = [name for axis, name in enumerate(("north", "east", "height")) if axis not in axes]
    if not unseen:
        return t, position, where
    drawn = f"drawn {RELEASE_HEIGHT:g} m above ground" if unseen == ["height"] else "drawn at 0"
    return t, position, f"{where}; {' and '.join(unseen)} not seen: {drawn}"


def _estimated_rate(recording: Recording) -> tuple[Samples | None, str]:
    """Return the recording's spin rate where it is known, and how; None and the reason where no method can tell."""
    try:
        spin = best(recording)
    except InputError as error:
        return None, str(error)
    known = np.isfinite(spin.rate)
    if np.count_nonzero(known) < 2:
        return None, f"{spin.method} knows the rate nowhere"
    note = f"spin: {spin.method}" + ("" if spin.signed else ", direction unknown")
    if not known.all():
        note += f", {100 * np.mean(~known):.0f} % of it bridged"
    return Samples(spin.t[known], spin.rate[known]), note


def _integrated(rate: Samples, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return rates (n,) at t, the nearest known outside, and attitudes (n, 4) turned by them about z_B."""
    known = np.interp(t, rate.t, rate.value)
    angle = cumulative_trapezoid(known, t, initial=0)
    return known, turn(angle[:, None] * np.array([0.0, 0.0, 1.0]))


def _grid(start: float, end: float) -> FloatArray:
    return np.linspace(start, end, max(2, int(np.ceil((end - start) / INTEGRATION_STEP)) + 1))


def _need_two(samples: Samples, what: str) -> None:
    if len(samples) < 2:
        raise InputError(f"{what}: {len(samples)} row of numbers, expected at least two")
