"""How a sensor board is turned in the body: the axis that its sensors spin about, and the pull towards that axis.

All that turns in a magnetometer turns about the true z; what an accelerometer reads in proportion to the square of the
rate points from its stated place to the axis. Two directions make an attitude (TRIAD, Black 1964). The sign of the
spin stays open where nothing states it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from discsim.arrays import FloatArray
from discsim.recording import Recording
from discsim.validation.diagnosis.setup.axis_by_pull import OFF_AXIS, axis_by_pull, pointing_out
from discsim.validation.diagnosis.signals.spin_signals import mean_readings, turning_line, usable

__all__ = ["board_turns", "spin_axis"]


def spin_axis(recordings: Sequence[Recording], sensor: str) -> FloatArray | None:
    """Return the axis (3,) in written columns about which what a sensor shows turns; its larger part is positive.

    ``sensor`` is the magnetometer or the gyroscope (None where that clips). None where nothing turns.
    """
    total = np.zeros((3, 3))
    for recording in recordings:
        axis = turning_line(recording, sensor)
        if axis is not None:
            total += np.outer(axis, axis)
    if not np.any(total):
        return None
    return pointing_out(np.linalg.eigh(total)[1][:, 2])


def _pull(recordings: Sequence[Recording], axis: FloatArray) -> FloatArray | None:
    """Return what an accelerometer reads across an axis (3,), in written columns, m/s^2: the pull towards the axis."""
    total = np.zeros(3)
    for recording in recordings:
        found = usable(recording, "accelerometer")
        if found is None:
            continue
        t, f = found
        grid = np.arange(t[0] + 0.3, t[-1] - 0.3, 0.1)
        if grid.size == 0:
            continue
        mean = mean_readings(t, f, grid, 0.2)
        across = mean - np.outer(mean @ axis, axis)
        total += np.nansum(across[np.all(np.isfinite(mean), axis=1)], axis=0)
    return total if float(np.linalg.norm(total)) > 0.0 else None


def board_turns(recordings: Sequence[Recording]) -> list[FloatArray]:
    """Return matrices (3, 3) that take written columns to body axes if the whole board is turned, both signs of spin.

    The smaller turn comes first. Empty where the sensors do not show the axis. Without an accelerometer off the axis
    the turn about the axis is not known: the least one is taken.
    """
    axis = spin_axis(recordings, "gyroscope")
    if axis is None:
        axis = spin_axis(recordings, "magnetometer")
    if axis is None:
        axis = axis_by_pull(recordings)
    if axis is None:
        return []
    pull = _pull(recordings, axis)
    sheet = recordings[0].sheets.get("accelerometer")
    place = None if sheet is None else sheet.position
    found = []
    for sign in (1.0, -1.0):
        z = sign * axis
        if pull is None or place is None or np.hypot(place[0], place[1]) < OFF_AXIS:
            found.append(_least(z))
            continue
        x = pull / np.linalg.norm(pull)
        towards = np.array([-place[0], -place[1], 0.0]) / np.hypot(place[0], place[1])
        written = np.column_stack([x, np.cross(z, x), z])
        body = np.column_stack([towards, np.cross([0.0, 0.0, 1.0], towards), [0.0, 0.0, 1.0]])
        found.append(np.asarray(body @ written.T))
    return sorted(found, key=lambda matrix: float(np.linalg.norm(Rotation.from_matrix(matrix).as_rotvec())))


def _least(z: FloatArray) -> FloatArray:
    """Return the least rotation (3, 3) that takes a unit vector to (0, 0, 1)."""
    turn = np.cross(z, [0.0, 0.0, 1.0])
    size = float(np.linalg.norm(turn))
    if size < 1e-9:
        return np.eye(3) if z[2] > 0 else np.diag([1.0, -1.0, -1.0])
    return np.asarray(Rotation.from_rotvec(turn / size * np.arctan2(size, z[2])).as_matrix())
