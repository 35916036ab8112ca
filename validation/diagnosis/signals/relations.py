"""What sound sensors of a spinning disc must say of one another, as plain equations between slow signals.

In a frame S that turns with the field's phase, M = (a, 0, b) is the field and W = <(p + i q) exp(i psi)> the transverse
rate. Then, whatever the air does:

- ``precession``: db/dt = a Im W, from dm/dt = -w x m;
- ``spin rate``: r = d(psi)/dt + b Re W / a (the gyroscope's own z; where it clips, its sign);
- ``specific force and field``: f . m = (a_path - g) . B at every instant;
- ``specific force and path``: |f| = |a_path - g|;
- ``pull to the axis``: <f_x + i f_y> = -r^2 (d_x + i d_y), Eq. (7), d the accelerometer's stated place;
- ``lever arm``: <f_z exp(i psi)> = r (d_x - i d_y) W, from w x (w x d) + dw/dt x d under slow precession;
- ``lift``: the mean of f_z is negative, for most discs fly the right way up: weak, as some do not;
- on a rig ``angle``: psi is the sum of the reference's rate; ``ramps``: f_x + i f_y over d is -r^2 + i dr/dt;
- ``spin axis``: the field turns, and the mean rate points, along z;
- ``height``: a path stays above ground; ``release``: it starts with the stated velocity.

Each says in one number how far a hypothesis about the columns is from it, in units of what ordinary errors of parts
(scale 5 %, place 3 mm, iron, a wind in the path's curvature) leave.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.validation.diagnosis.signals.spin_signals import STEP, STILL, Locked, SpinSignals
from discsim.validation.identification.ordinary_errors import ordinary_sigma
from discsim.validation.identification.plants import plant_of

__all__ = ["Columns", "Misfit", "misfit", "misfits", "wanted_force"]

#: neighbours within the averaging share their errors: so many instants of the grid are one independent statement
_TOGETHER = 6.0
#: the same of what is averaged as standing still in the body: 2 sqrt(pi) of its sigma, in steps of the grid
_OF_STILL = 2.0 * np.sqrt(np.pi) * STILL / STEP
#: what ordinary errors leave: field along the axis uT; spin rad/s and share; f . m in m/s^2 times |B|; |f| m/s^2; share
#: of the pull and of the lever arm, m/s^2; height m; release m/s
_ALONG, _ALONG_SHARE = 0.4, 0.12
_SPIN, _SPIN_SHARE = 1.5, 0.05
_FORCE, _SIZE, _PULL, _PULL_SHARE, _LEVER, _LEVER_SHARE = 0.3, 1.2, 1.5, 0.25, 0.12, 0.5
_HEIGHT, _RELEASE = 1.5, 2.0
#: how far the axis of turning may be off z, rad: soft iron of 10 % bends a magnetometer's, a gyroscope's cross-axis its
#: own; and the weight of that
_TILT: Mapping[str, float] = {"magnetometer": 0.07, "gyroscope": 0.04}
_TILT_WEIGHT = 8.0
#: the mean specific force along z of a disc that flies the right way up is about -g; hammers are few, m/s^2
_LIFT = 1.5
#: degree of the polynomial that a rate runs down along
_SMOOTH = 4
#: of a rig: what precession-free phases leave, rad; the share of a ramp that may be another's, and its weight
_ANGLE, _RAMP, _RAMP_WEIGHT = 0.2, 0.3, 10.0
#: of a rig: hard iron along the axis, uT; a bias, m/s^2; a ramp over which clocks matter, rad/s^2
_IRON, _GRAVITY, _STEADY = ordinary_sigma("setup of a rig"), 1.5, 5.0


@dataclass(frozen=True)
class Columns:
    """A hypothesis: true axes = matrix (3, 3) times written columns, written = true time + offset; a field in N.

    ``rival`` holds physics that is no fault of the setup and may look like one: "SENSOR.lag" s, "SENSOR.clock" (written
    over true time, less one), "iron" along the axis, uT.
    """

    axes: Mapping[str, FloatArray] = field(default_factory=dict)
    offset: Mapping[str, float] = field(default_factory=dict)
    site: FloatArray | None = None
    rival: Mapping[str, float] = field(default_factory=dict)

    def of(self, sensor: str) -> FloatArray:
        """Return the matrix of a sensor, the unit matrix where nothing is supposed."""
        return self.axes.get(sensor, np.eye(3))


@dataclass(frozen=True)
class Misfit:
    """How far one relation of one recording is from holding: mean square over the ordinary one, and its weight."""

    relation: str
    sensors: tuple[str, ...]
    ratio: float
    weight: float

    @property
    def cost(self) -> float:
        """Twice the log likelihood lost, of a noise whose size is unknown above the ordinary."""
        return self.weight * float(np.log1p(self.ratio))


def misfit(signals: Sequence[SpinSignals], columns: Columns) -> tuple[FloatArray, float, float]:
    """Return the costs (k,) of recordings, the sum of all weights, and the cost per weight of the worst relation.

    The slope of a slow run-down is mostly noise: ramps count among the costs, and never as the worst.
    """
    found = [misfits(one, columns) for one in signals]
    costs = np.array([sum(item.cost for item in own) for own in found])
    everything = [item for own in found for item in own]
    of: dict[str, list[Misfit]] = {}
    for item in everything:
        if item.relation != "ramps":
            of.setdefault(item.relation, []).append(item)
    each = [sum(one.cost for one in own) / sum(one.weight for one in own) for own in of.values()]
    return costs, sum(item.weight for item in everything), max(each, default=0.0)


def misfits(signals: SpinSignals, columns: Columns) -> list[Misfit]:
    """Return the relations that a recording allows, each with how far a hypothesis is from it."""
    M = columns.of("magnetometer")
    across = M[:2, :2]
    mirrored = signals.measured and float(np.linalg.det(across)) < 0
    angle = complex(across[0, 0], across[1, 0])
    # psi of the true columns is that of the written ones, backwards where they are mirrored, less an angle
    rate = -signals.rate if mirrored else signals.rate
    along = float(M[2, 2]) * signals.along - columns.rival.get("iron", 0.0)
    speed = np.nan_to_num(rate)

    def turning(locked: Locked, matrix: FloatArray, sensor: str) -> ComplexArray:
        own = np.conj(locked.turning) if mirrored else locked.turning
        late = columns.offset.get(sensor, 0.0) - columns.offset.get("magnetometer", 0.0)
        drift = columns.rival.get(f"{sensor}.clock", 0.0) - columns.rival.get("magnetometer.clock", 0.0)
        shifted = own * np.conj(angle) * np.exp(-1j * speed * (late + drift * signals.grid))[:, None]
        # what stands still in N turns at -rate in B: a lag leaves 1/(1 - i rate tau) of it
        for name, sign in ((sensor, -1.0), ("magnetometer", 1.0)):
            lag = 1.0 + sign * 1j * speed * columns.rival.get(f"{name}.lag", 0.0)
            shifted = shifted * (lag if name == sensor else np.conj(lag) / np.abs(lag))[:, None]
        return np.asarray(_times(shifted, matrix))

    found = _of_axes(signals, columns)
    W: ComplexArray | None = None
    if signals.gyro is not None:
        matrix = columns.of("gyroscope")
        w = turning(signals.gyro, matrix, "gyroscope")
        W = w[:, 0] + 1j * w[:, 1]
        found += _of_gyroscope(signals, W, rate, along, matrix)
    if signals.force is not None:
        matrix = columns.of("accelerometer")
        mean = np.real(_times(signals.force.mean, matrix))
        turned = turning(signals.force, matrix, "accelerometer")
        found += _of_force(signals, mean, turned, rate, W)
        if signals.path is not None:
            F = turned[:, 0] + 1j * turned[:, 1]
            found += _of_force_and_path(signals, F, mean[:, 2], along, columns)
        if plant_of(signals.recording).airborne:
            lift = float(np.nanmean(mean[:, 2])) if np.any(np.isfinite(mean[:, 2])) else 0.0
            found.append(Misfit("lift", ("accelerometer",), max(lift / _LIFT, 0.0) ** 2, 2.0))
    if signals.path is not None:
        found += _of_path(signals, columns.of("gps"))
    if not plant_of(signals.recording).airborne:
        found += _of_rig(signals, columns, rate, along)
    return found


def _times(columns: ComplexArray | FloatArray, matrix: FloatArray) -> ComplexArray:
    """Return matrix times each row of columns (n, 3); a NaN column spoils only the axes that it enters."""
    out = np.zeros(columns.shape, dtype=complex)
    for i in range(3):
        for j in range(3):
            if abs(matrix[i, j]) > 1e-6:
                out[:, i] += matrix[i, j] * columns[:, j]
    return out


def _of_axes(signals: SpinSignals, columns: Columns) -> list[Misfit]:
    """Return how far each sensor's own axis of turning is from z; a sensor whose axis is another has its weight."""
    found = []
    for sensor, axis in signals.axes.items():
        tilt = float(np.arccos(np.clip(abs((columns.of(sensor) @ axis)[2]), 0.0, 1.0)))
        found.append(Misfit("spin axis", (sensor,), (tilt / _TILT[sensor]) ** 2, _TILT_WEIGHT))
    return found


def _judged(
    relation: str, sensors: tuple[str, ...], left: FloatArray | ComplexArray, usual: FloatArray
) -> list[Misfit]:
    good = np.isfinite(left)
    count = int(np.count_nonzero(good))
    if count < _TOGETHER:
        return []
    ratio = float(np.mean(np.abs(left[good]) ** 2 / np.broadcast_to(usual, left.shape)[good] ** 2))
    return [Misfit(relation, sensors, ratio, count / _TOGETHER)]


def _of_gyroscope(
    signals: SpinSignals, W: ComplexArray, rate: FloatArray, along: FloatArray, matrix: FloatArray
) -> list[Misfit]:
    assert signals.gyro is not None
    assert signals.gyro_sign is not None
    both = ("magnetometer", "gyroscope")
    slope = signals.across * np.imag(W)
    found = []
    good = np.isfinite(slope) & np.isfinite(along)
    if not np.any(np.isfinite(signals.gyro.mean)):  # clipped readings of a turned board say nothing of any axis
        return []
    if not np.any(np.isfinite(W)):  # the column that clips is none of the transverse ones
        found.append(Misfit("transverse rates", ("gyroscope",), 1e4, signals.grid.size / _TOGETHER))
    elif np.count_nonzero(good) > _TOGETHER:
        # where the spin is too slow to be followed nothing is said: the sum goes on as if nothing had turned there
        step = np.where(good[1:] & good[:-1], 0.5 * (slope[1:] + slope[:-1]) * STEP, 0.0)
        grown = np.concatenate([[0.0], np.cumsum(step)])
        x = signals.grid[good] - signals.grid[good].mean()
        basis, _ = np.linalg.qr(np.column_stack([np.ones(x.size), x]))  # iron, and a bias of the gyroscope
        left, size = (v - basis @ (basis.T @ v) for v in ((along - grown)[good], along[good]))
        found += _judged("precession", both, left, np.hypot(_ALONG, _ALONG_SHARE * np.std(size)) * np.ones(1))
    axial = np.real(_times(signals.gyro.mean, matrix)[:, 2])
    expected = rate + along * np.real(W) / np.maximum(signals.across, 0.2 * np.hypot(signals.across, along))
    known = np.isfinite(axial)
    if np.count_nonzero(known) < 0.5 * known.size:  # clipped: the sign alone
        column = int(np.argmax(np.abs(matrix[2])))
        if signals.gyro_sign[column] == 0.0:  # not even that
            return found
        axial = np.where(known, axial, matrix[2, column] * signals.gyro_sign[column] * np.abs(expected))
    return found + _judged("spin rate", both, axial - expected, _SPIN + _SPIN_SHARE * np.abs(rate))


def _of_force(
    signals: SpinSignals, mean: FloatArray, turned: ComplexArray, rate: FloatArray, W: ComplexArray | None
) -> list[Misfit]:
    place = signals.recording.sheets["accelerometer"].position
    if place is None or np.hypot(place[0], place[1]) < 2e-3:
        return []
    d = complex(place[0], place[1])
    pull = mean[:, 0] + 1j * mean[:, 1] + rate**2 * d
    usual = _PULL + _PULL_SHARE * abs(d) * rate**2
    found = _judged("pull to the axis", ("magnetometer", "accelerometer"), pull, usual)
    if W is not None:
        arm = rate * np.conj(d) * W
        usual = np.hypot(_LEVER, _LEVER_SHARE * np.abs(arm))
        found += _judged("lever arm", ("gyroscope", "accelerometer"), turned[:, 2] - arm, usual)
    return found


def _of_force_and_path(
    signals: SpinSignals, F: ComplexArray, axial: FloatArray, along: FloatArray, columns: Columns
) -> list[Misfit]:
    B = signals.recording.environment.magnetic_field if columns.site is None else columns.site
    wanted = wanted_force(signals, columns.of("gps"))
    sensors = ("magnetometer", "accelerometer", "gps")
    felt = signals.across * np.real(F) + along * axial
    found = _judged("specific force and field", sensors, felt - wanted @ B, _FORCE * np.linalg.norm(B) * np.ones(1))
    size = np.hypot(np.abs(F), axial) - np.linalg.norm(wanted, axis=1)
    return found + _judged("specific force and path", ("accelerometer", "gps"), size, _SIZE * np.ones(1))


def wanted_force(signals: SpinSignals, matrix: FloatArray) -> FloatArray:
    """Return the specific force (n, 3) in N that a path asks for, its columns taken to N by a matrix (3, 3)."""
    assert signals.path is not None
    gravity = np.array([0.0, 0.0, signals.recording.environment.gravity])
    return np.asarray(signals.path.acceleration @ matrix.T - gravity)


def _of_path(signals: SpinSignals, matrix: FloatArray) -> list[Misfit]:
    assert signals.path is not None
    down = (signals.path.position @ matrix.T)[:, 2]
    found = []
    if plant_of(signals.recording).follows_path:  # other logs begin anywhere, on a hill or on a roof
        found = _judged("height", ("gps",), np.maximum(down, 0.0), _HEIGHT * np.ones(1))
    release = signals.recording.release
    if release is not None and release.velocity is not None:
        sigma = float(np.max(release.sigma.get("velocity_ned_m_s", 0.0)))
        apart = (signals.path.velocity[:4] @ matrix.T).mean(axis=0) - release.velocity
        ratio = float(np.mean(apart**2)) / (_RELEASE**2 + sigma**2)
        found.append(Misfit("release", ("gps",), ratio, 4.0))
    return found


def _of_rig(signals: SpinSignals, columns: Columns, rate: FloatArray, along: FloatArray) -> list[Misfit]:
    """Return what a rig's axis, straight down, and its command or rate reference add."""
    recording, found = signals.recording, []
    B = recording.environment.magnetic_field
    found += _judged("field along the axis", ("magnetometer",), along - B[2], _IRON * np.ones(1))
    if signals.force is not None:
        axial = np.real(_times(signals.force.mean, columns.of("accelerometer")))[:, 2]
        found += _judged("gravity", ("accelerometer",), axial + recording.environment.gravity, _GRAVITY * np.ones(1))
    if signals.force is not None:
        mean = np.real(_times(signals.force.mean, columns.of("accelerometer")))
        found += _of_ramps(signals, mean[:, 0] + 1j * mean[:, 1], rate)
    if signals.reference is not None:
        if signals.measured:
            late = columns.offset.get("magnetometer", 0.0)
            found += _of_angle(signals, -1.0 if rate is not signals.rate else 1.0, late)
        own = np.interp(signals.grid, signals.reference[0], signals.reference[2])
        steady = np.abs(np.gradient(own, signals.grid)) < _STEADY
        apart = np.where(steady, rate - own, np.nan)
        found += _judged("spin rate", ("magnetometer",), apart, _SPIN + _SPIN_SHARE * np.abs(own))
        if signals.gyro is not None:
            axial = np.real(_times(signals.gyro.mean, columns.of("gyroscope")))[:, 2]
            apart = np.where(steady, axial - own, np.nan)
            found += _judged("spin rate", ("gyroscope",), apart, _SPIN + _SPIN_SHARE * np.abs(own))
    return found


def _of_angle(signals: SpinSignals, sign: float, late: float) -> list[Misfit]:
    """Compare the angle that the field shows with that of a rate's sum; a phase and a clock's rate are free."""
    assert signals.reference is not None
    t, angle, rate = signals.reference
    at = signals.grid - late
    there = np.interp(at, t, angle)
    basis, _ = np.linalg.qr(np.column_stack([np.ones(there.size), signals.grid * np.interp(at, t, rate)]))
    left = sign * signals.angle - there
    left = left - basis @ (basis.T @ left)
    return _judged("angle", ("magnetometer",), left, _ANGLE * np.ones(1))


def _of_ramps(signals: SpinSignals, pull: ComplexArray, rate: FloatArray) -> list[Misfit]:
    """Compare what an accelerometer reads along its path with the rate's change: f/d = -r^2 + i dr/dt on a rig."""
    place = signals.recording.sheets["accelerometer"].position
    if place is None or np.hypot(place[0], place[1]) < 2e-3:
        return []
    along = np.imag(pull / complex(place[0], place[1]))
    known = np.isfinite(along) & np.isfinite(rate)
    if np.count_nonzero(known) < 4 * _TOGETHER:
        return []
    # the slope of a noisy rate would bend the relation: a run-down is smooth, a table does as it is told
    if signals.recording.command is not None:
        own = np.interp(signals.grid, signals.recording.command.t, signals.recording.command.value)
    else:
        x = signals.grid - signals.grid.mean()
        own = np.polynomial.Polynomial.fit(x[known], rate[known], _SMOOTH)(x)
    change, good = np.gradient(own, STEP), known
    # a place that is off to the side adds a share of r^2, a bias a constant
    A = np.column_stack([np.ones(along.size), rate**2, change])[good]
    x, *_ = np.linalg.lstsq(A, along[good], rcond=None)
    left = along[good] - A @ x
    error = float(np.sqrt(_OF_STILL * np.mean(left**2) * np.linalg.pinv(A.T @ A)[2, 2]))
    # the weight is of what is sure: a slope that noise leaves unknown says no more than its error lets it
    ratio = (float(x[2]) - 1.0) ** 2 / (_RAMP**2 + _RAMP_WEIGHT * error**2)
    return [Misfit("ramps", ("accelerometer",), ratio, _RAMP_WEIGHT)]
