"""Attitude from field, specific force and transverse rates in a frame that does not spin.

Takes a recording and the phase of its spin; gives the attitude on a grid. Two directions seen in two frames are matched
locally in time by the eigenvector of a 4 x 4 matrix: Wahba's problem (SIAM Review 7, 1965) by Davenport's q-method.
"""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import ComplexArray, FloatArray
from discsim.compiled import compiled
from discsim.disc import Release
from discsim.frames import (
    attitude_matrix,
    body_to_ned,
    multiply,
    nearest_rotations,
    quaternion_from_matrix,
    rotation_vector,
    turn,
)
from discsim.recording import Recording
from discsim.validation.identification.initial.smoothing import (
    GRID,
    SLOW,
    TUMBLING,
    Readings,
    median_of,
    readings_for,
    smoothed,
)
from discsim.validation.identification.initial.spin_phase import (
    PHASE_SIGMA,
    RATE_SIGMA,
    Spin,
    centripetal_rate,
    direction_of_spin,
    expected_rate,
    gaussian_kernel,
    phase_spin,
)
from discsim.validation.identification.ordinary_errors import ordinary_sigma

__all__ = ["Attitude", "field_in_start", "frame_of", "other_attitudes", "states_from", "turned_to_ned", "windowed"]

#: of the smoothing of field and specific force in S, s
VECTOR_SIGMA = 0.15


#: over which a local attitude is averaged after the gyroscope's turning is taken out, s
ATTITUDE_SIGMA = 0.4


#: prior standard deviation of hard iron along the spin axis, uT, and of the field's gain
IRON_SD, GAIN_SD = ordinary_sigma("attitude at the start"), 0.06


class Attitude(NamedTuple):
    """The frame that does not spin: ``psi`` and ``r`` on ``grid``; ``D`` (n, 4) turns S into S at the start.

    ``transverse`` (n,) is p + i q of the gyroscope, ``field`` the magnetometer's readings in B less the iron across
    the axis; both None where they are missing. ``tumbling`` tells that all three rates are the gyroscope's.
    """

    grid: FloatArray
    psi: FloatArray
    r: FloatArray
    D: FloatArray
    transverse: ComplexArray | None
    field: Readings | None
    tumbling: bool = False

    def psi_at(self, t: FloatArray) -> FloatArray:
        """Return psi (k,) at t (k,), which runs on at the last rate outside."""
        inside = np.clip(t, self.grid[0], self.grid[-1])
        ends = np.where(t < self.grid[0], self.r[0], self.r[-1])
        return np.asarray(np.interp(inside, self.grid, self.psi) + ends * (t - inside))

    def D_at(self, t: FloatArray) -> FloatArray:
        """Return the relative attitudes (k, 4) of S at t (k,)."""
        return _between(self.grid, self.D, t)


def _between(grid: FloatArray, q: FloatArray, t: FloatArray) -> FloatArray:
    """Return quaternions at t between neighbours (n, 4) that are close together."""
    k = np.clip(np.searchsorted(grid, t) - 1, 0, grid.size - 2)
    x = np.clip((t - grid[k]) / (grid[k + 1] - grid[k]), 0.0, 1.0)[:, None]
    mixed = (1 - x) * q[k] + x * q[k + 1]
    return np.asarray(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))


@compiled
def _composed(step: FloatArray) -> FloatArray:
    """Return attitudes (n + 1, 4) after rotation vectors (n, 3), each in the frame reached, from the identity."""
    out = np.empty((step.shape[0] + 1, 4))
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    out[0] = np.array([w, x, y, z])
    for i in range(step.shape[0]):
        a, b, c = step[i, 0], step[i, 1], step[i, 2]
        angle = sqrt(a * a + b * b + c * c)
        f = sin(0.5 * angle) / angle if angle > 1e-9 else 0.5
        s, a, b, c = cos(0.5 * angle), f * a, f * b, f * c
        w, x, y, z = (
            w * s - x * a - y * b - z * c,
            w * a + x * s + y * c - z * b,
            w * b - x * c + y * s + z * a,
            w * c + x * b - y * a + z * s,
        )
        out[i + 1, 0], out[i + 1, 1], out[i + 1, 2], out[i + 1, 3] = w, x, y, z
    return out


def frame_of(recording: Recording) -> Attitude:
    """Return psi, r and the relative attitude of the frame that does not spin over the whole recording."""
    expected = expected_rate(recording)
    gyroscope = readings_for(recording, "gyroscope", slice(0, 2))
    if gyroscope is not None and expected is not None:
        own = expected(gyroscope.t)
        wobble = median_of(np.hypot(*gyroscope.value.T))
        if median_of(own) < SLOW or median_of(own) < min(2 * wobble, TUMBLING):
            return _slow_frame(recording, gyroscope, own)
    spin = phase_spin(recording, "magnetometer", expected, steady=False)
    field = None
    if spin is not None:
        full = readings_for(recording, "magnetometer")
        if full is not None:
            across = np.interp(full.t, spin.t, spin.plane.real), np.interp(full.t, spin.t, spin.plane.imag)
            field = Readings(full.t, np.column_stack([*across, full.value[:, 2]]))
    else:
        spin = phase_spin(recording, "accelerometer", expected, steady=False)
    if gyroscope is not None:
        grid = gyroscope.t
    else:
        grid = spin.grid if spin is not None else np.arange(0.0, max(recording.end, 1.0), 0.01)
    if spin is None:
        r = np.zeros(grid.size) if expected is None else expected(grid)
        if expected is None and (centripetal := centripetal_rate(recording)) is not None:
            r = direction_of_spin(recording) * centripetal(grid)
        psi = cumulative_trapezoid(r, grid, initial=0)
    else:
        psi, r = -spin.phase_at(grid), -np.interp(grid, spin.grid, spin.turning)
    if gyroscope is None:
        identity = np.tile([1.0, 0.0, 0.0, 0.0], (grid.size, 1))
        return Attitude(grid, psi, _calm(grid, r), identity, None, field)
    w = gyroscope.value[:, 0] + 1j * gyroscope.value[:, 1]
    if abs(psi[-1] - psi[0]) > 10 * np.pi:
        w = w - np.mean(w)  # over many turns p and q average to the sensor's bias
    if field is not None and spin is not None:
        psi, r = _without_precession(recording, spin, grid, psi, r, w)
        if expected is not None:
            # what the field adds to the gyroscope's own angle is slow: its gain and its clock
            coarse, own = np.linspace(grid[0], grid[-1], max(2, int((grid[-1] - grid[0]) / 0.05))), expected(grid)
            added = smoothed(grid, psi - cumulative_trapezoid(own, grid, initial=0), coarse, 0.3)
            psi = cumulative_trapezoid(own, grid, initial=0) + np.interp(grid, coarse, added)
            r = own + np.interp(grid, coarse, np.gradient(added, coarse))
    return Attitude(grid, psi, _calm(grid, r), _despun(grid, psi, w), w, field)


def _slow_frame(recording: Recording, gyroscope: Readings, r: FloatArray) -> Attitude:
    """Return the frame of a disc that turns slowly, from the gyroscope alone; iron from a field that stands still."""
    grid, w = gyroscope.t, gyroscope.value[:, 0] + 1j * gyroscope.value[:, 1]
    psi = cumulative_trapezoid(r, grid, initial=0)
    frame = Attitude(grid, psi, r, _despun(grid, psi, w), w, None, tumbling=True)
    readings = readings_for(recording, "magnetometer")
    if readings is None:
        return frame
    strength = float(np.linalg.norm(recording.environment.magnetic_field))
    about = frame.psi_at(readings.t)[:, None] * np.array([0.0, 0.0, 1.0])
    C = body_to_ned(multiply(frame.D_at(readings.t), turn(about)))
    # C (m - b) = m_0: linear in b and m_0, whose length is drawn to the field's
    iron, still = np.zeros(3), np.mean(np.einsum("nij,nj->ni", C, readings.value), axis=0)
    rows = np.concatenate([C, np.broadcast_to(np.eye(3), C.shape)], axis=2).reshape(-1, 6)
    target = np.einsum("nij,nj->ni", C, readings.value).ravel()
    share = len(rows) / 60.0  # the gyroscope's drift makes errors of readings nearby the same
    for _ in range(5):
        n = still / max(float(np.linalg.norm(still)), 1e-9)
        information = rows.T @ rows / (share * (0.06 * strength) ** 2)
        pull = rows.T @ target / (share * (0.06 * strength) ** 2)
        information[:3, :3] += np.eye(3) / IRON_SD**2
        information[3:, 3:] += np.outer(n, n) / (0.05 * strength) ** 2 + 1e-9 * np.eye(3)
        pull[3:] += n * strength / (0.05 * strength) ** 2
        solution = np.linalg.solve(information, pull)
        iron, still = solution[:3], solution[3:]
    return frame._replace(field=Readings(readings.t, readings.value - iron))


def _calm(grid: FloatArray, r: FloatArray) -> FloatArray:
    """Return a rate (n,) without its changes within a tenth of a second."""
    coarse = np.linspace(grid[0], grid[-1], max(2, int((grid[-1] - grid[0]) / 0.05)))
    return np.asarray(np.interp(grid, coarse, smoothed(grid, r, coarse, RATE_SIGMA)))


def _despun(grid: FloatArray, psi: FloatArray, w: ComplexArray) -> FloatArray:
    """Return the relative attitudes (n, 4) of S from p + i q (n,)."""
    W = w * np.exp(1j * psi)
    middle = 0.5 * (W[1:] + W[:-1]) * np.diff(grid)
    return _composed(np.column_stack([middle.real, middle.imag, np.zeros(middle.size)]))


def _without_precession(
    recording: Recording, spin: Spin, grid: FloatArray, psi: FloatArray, r: FloatArray, w: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Return psi and r without the turning of the field's phase by p and q: m_z (p m_x + q m_y)/(m_x^2 + m_y^2)."""
    axial = readings_for(recording, "magnetometer", 2)
    if axial is None:
        return psi, r
    across = np.interp(grid, spin.grid, spin.amplitude)
    strength = float(np.linalg.norm(recording.environment.magnetic_field))
    along = smoothed(axial.t, axial.value, spin.grid[::10], 0.1)
    m_z = np.clip(np.interp(grid, spin.grid[::10], along), -strength, strength)
    # below a tenth of the field the phase is noise and the term has a pole
    eta = (w * np.exp(1j * psi)).real * m_z / np.maximum(across, 0.1 * strength)
    added = cumulative_trapezoid(eta, grid, initial=0)
    step = float(np.median(np.diff(grid)))
    kernel = gaussian_kernel(PHASE_SIGMA, step)
    if kernel.size < grid.size:
        eta = np.convolve(eta, kernel, "same") / np.convolve(np.ones(eta.size), kernel, "same")
    return psi + added, r + eta


def turned_to_ned(
    recording: Recording,
    frame: Attitude,
    grid: FloatArray,
    pair: tuple[FloatArray, FloatArray | None] | None,
    normals: FloatArray | None,
) -> tuple[FloatArray, bool]:
    """Return C (n, 3, 3) from S at the start to N, found locally at the instants of ``grid``, and if it is unique.

    With a perfect gyroscope all would be the same matrix. ``pair`` holds the specific force in N and in S at the start,
    ``normals`` (n, 3) what the path says of the spin axis, which stands in for a sensor that is missing.
    """
    field = recording.environment.magnetic_field
    force, force_felt = (None, None) if pair is None else pair
    # a turn or so, except that at a slow spin nothing needs to average out
    fast = median_of(frame.r)
    sigma = float(np.clip(3.0 / max(fast, 0.1), VECTOR_SIGMA, 0.4)) if fast > SLOW else VECTOR_SIGMA
    axis = body_to_ned(frame.D_at(grid))[:, :, 2]
    magnetic = None if frame.field is None else field_in_start(frame.field, frame, grid, sigma)
    if magnetic is not None:
        wandering = frame.transverse is None
        magnetic = _without_axial_iron(magnetic, axis, field, force_felt, force, wandering=wandering)
    sigma = ATTITUDE_SIGMA if frame.transverse is not None else GRID
    if force_felt is not None and force is not None:
        if magnetic is None and normals is not None:
            return _fitted_turns(axis, force_felt, normals, force, sigma), False
        return _fitted_turns(magnetic, force_felt, field, force, sigma), magnetic is not None
    if normals is not None:
        # the lift's size on both sides weighs its direction
        lift = np.linalg.norm(normals, axis=1, keepdims=True)
        return _fitted_turns(magnetic, axis * lift, field, normals, sigma), False
    if magnetic is None:
        return _level(recording, frame, grid), False
    # one direction: in S at the start the field stands still, so all instants share it
    turns = np.array([_level_about(mean, field, axis[0]) for mean in windowed(magnetic, 1.0)])
    return _stated_turn(recording, frame, _connected(turns, field), field), False


def _fitted_turns(
    m: FloatArray | None, f: FloatArray, field: FloatArray, force: FloatArray, sigma: float
) -> FloatArray:
    """Return the rotations (n, 3, 3) that take m and f to field and force, each averaged over ``sigma`` s.

    An instant whose force departs from its neighbours' rotation (a knock, an end of the path) loses its say.
    """
    say = np.ones(len(f))
    turns = np.empty((0, 3, 3))
    for width in (3 * sigma, 2 * sigma, sigma):
        K = _pairs(m, f, field, force, say)
        whole = nearest_rotations(np.sum(K, axis=0, keepdims=True))
        # the force alone leaves a turn about itself, which only its motion over the whole flight tells
        turns = nearest_rotations(windowed(K, width) + (0.05 * whole if m is None else 1e-6 * whole))
        turned = np.einsum("nij,nj->ni", turns, f)
        apart = np.linalg.norm(np.cross(turned, force), axis=1) / np.maximum(
            np.linalg.norm(f, axis=1) * np.linalg.norm(force, axis=1), 1e-9
        )
        say = 1 / (1 + (apart / max(0.05, 2 * float(np.median(apart)))) ** 2)
    return turns


def field_in_start(field: Readings, frame: Attitude, grid: FloatArray, sigma: float) -> FloatArray:
    """Return the field, smoothed, in S at the start, (n, 3)."""
    t, value = field
    plane = (value[:, 0] + 1j * value[:, 1]) * np.exp(1j * frame.psi_at(t))
    C = body_to_ned(frame.D_at(t))
    vector = np.einsum("nij,nj->ni", C, np.column_stack([plane.real, plane.imag, value[:, 2]]))
    return smoothed(t, vector, grid, sigma)


def _without_axial_iron(
    m: FloatArray,
    axis: FloatArray,
    field: FloatArray,
    force_felt: FloatArray | None,
    force: FloatArray | None,
    *,
    wandering: bool,
) -> FloatArray:
    """Return the field (n, 3) without the hard iron along the axis, which no turning shows.

    Least squares over that iron and a gain: the field has its stated length, makes its stated angle with the specific
    force, and stands still (not where the frame wanders for want of a gyroscope).
    """
    strength = float(np.linalg.norm(field))
    x = np.array([0.0, 1.0])
    known = None
    if force_felt is not None and force is not None:
        f = force_felt / np.maximum(np.linalg.norm(force_felt, axis=1, keepdims=True), 1e-6)
        g = force / np.maximum(np.linalg.norm(force, axis=1, keepdims=True), 1e-6)
        # a small force has no direction worth the name
        known = f, g @ field, np.minimum(np.linalg.norm(force, axis=1) / 5.0, 1.0)
    scale = 1 / sqrt(len(m) / 8.0)  # neighbours share their errors: about eight are independent

    def errors(x: FloatArray) -> FloatArray:
        u = x[1] * (m - x[0] * axis)
        parts = [(np.linalg.norm(u, axis=1) - strength) / (0.04 * strength) * scale]
        if known is not None:
            parts.append((np.einsum("ni,ni->n", u, known[0]) - known[1]) / (0.08 * strength) * known[2] * scale)
        if not wandering:
            parts.append(((u - np.mean(u, axis=0)) / (0.06 * strength) * scale).ravel())
        parts.append(np.array([x[0] / IRON_SD, (x[1] - 1.0) / GAIN_SD]))
        return np.concatenate(parts)

    for _ in range(6):
        e = errors(x)
        J = np.column_stack([(errors(x + h) - e) / np.sum(h) for h in (np.array([1e-3, 0.0]), np.array([0.0, 1e-5]))])
        x = x - np.linalg.solve(J.T @ J, J.T @ e)
        x = np.clip(x, [-0.8 * strength, 0.5], [0.8 * strength, 2.0])
    return np.asarray(x[1] * (m - x[0] * axis))


def _pairs(m: FloatArray | None, f: FloatArray, field: FloatArray, force: FloatArray, say: FloatArray) -> FloatArray:
    """Return the matrices (n, 3, 3) of Wahba's problem for m and f (n, 3) to be taken to field and force.

    The specific force counts where felt and path agree on its size, and is large enough to have a direction, times
    ``say`` (n,).
    """

    def unit(v: FloatArray) -> FloatArray:
        return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-9))

    size, other = np.linalg.norm(force, axis=1), np.linalg.norm(f, axis=1)
    agreement = 1 / (1 + ((size - other) / (1.0 + 0.1 * size)) ** 2)
    strong = say * np.minimum(np.minimum(size, other) / 5.0, 1.0) ** 2 * agreement**2 + 1e-3 * (other > 0)
    K = np.einsum("n,ni,nj->nij", strong, unit(force), unit(f))
    if m is not None:
        K += 0.3 * np.einsum("ni,nj->nij", unit(np.broadcast_to(field, m.shape)), unit(m))
        K += np.einsum("n,ni,nj->nij", 0.1 * strong, unit(np.cross(field, force)), unit(np.cross(m, f)))
    return np.asarray(K)


def _weights(n: int, sigma: float) -> FloatArray:
    index = GRID * np.arange(n)
    W = np.exp(-0.5 * ((index[:, None] - index[None, :]) / sigma) ** 2)
    return np.asarray(W / W.sum(axis=1, keepdims=True))


def windowed(value: FloatArray | ComplexArray, sigma: float) -> FloatArray:
    """Return Gaussian means of values (n, ...) on a grid of `GRID` s; ``sigma`` in s."""
    return np.asarray(np.tensordot(_weights(len(value), sigma), value, axes=1))


def _level_about(v: FloatArray, reference: FloatArray, axis: FloatArray) -> FloatArray:
    """Return the rotation (3, 3) that takes v to reference and, of all those, ``axis`` nearest to straight down."""
    down = np.array([0.0, 0.0, 1.0])
    K = np.outer(reference, v) / (np.linalg.norm(reference) * max(float(np.linalg.norm(v)), 1e-9))
    # the cross products decide the turn about v and leave v itself alone
    a, b = np.cross(reference, down), np.cross(v, axis)
    K = K + 1e-3 * np.outer(a, b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-9)
    return np.asarray(nearest_rotations(K[None] + 1e-9 * np.eye(3))[0])


def _connected(turns: FloatArray, field: FloatArray) -> FloatArray:
    """Return rotations that change from instant to instant by no turn about the field."""
    out = turns.copy()
    n = np.asarray(field / np.linalg.norm(field))
    for i in range(1, len(out)):
        q = quaternion_from_matrix(out[i - 1] @ out[i].T)
        angle = 2 * np.arctan2(q[1:] @ n, q[0])
        out[i] = body_to_ned(turn(angle * n)) @ out[i]
    return out


def _stated_turn(recording: Recording, frame: Attitude, turns: FloatArray, field: FloatArray) -> FloatArray:
    """Return the rotations turned about the field so that they meet a stated release as well as they can."""
    stated = _stated_attitude(recording.release)
    if stated is None:
        return turns
    found = turns[0] @ body_to_ned(frame.D_at(np.zeros(1)))[0] @ _z_turn(float(frame.psi_at(np.zeros(1))[0]))
    n = np.asarray(field / np.linalg.norm(field))
    q = quaternion_from_matrix(stated @ found.T)
    angle = 2 * np.arctan2(q[1:] @ n, q[0])
    return np.asarray(body_to_ned(turn(angle * n)) @ turns)


def _stated_attitude(release: Release | None) -> FloatArray | None:
    if release is None or release.roll is None or release.pitch is None or release.yaw is None:
        return None
    return attitude_matrix(release.roll, release.pitch, release.yaw).T


def _z_turn(angle: float) -> FloatArray:
    return np.array([[cos(angle), -sin(angle), 0.0], [sin(angle), cos(angle), 0.0], [0.0, 0.0, 1.0]])


def _level(recording: Recording, frame: Attitude, grid: FloatArray) -> FloatArray:
    """Return the rotation of a disc that starts as its release states, or level."""
    stated = _stated_attitude(recording.release)
    first = np.eye(3) if stated is None else stated @ _z_turn(float(-frame.psi_at(np.zeros(1))[0]))
    return np.tile(first, (grid.size, 1, 1))


def states_from(
    recording: Recording, frame: Attitude, grid: FloatArray, G: FloatArray, t: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return attitudes (k, 4) and body rates (k, 3) at t."""
    turns = np.array([quaternion_from_matrix(C) for C in G])
    for i in range(1, len(turns)):
        if turns[i] @ turns[i - 1] < 0:
            turns[i] = -turns[i]
    psi = frame.psi_at(t)
    slow = multiply(_between(grid, turns, t), frame.D_at(t))
    attitude = multiply(slow, turn(psi[:, None] * np.array([0.0, 0.0, 1.0])))
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    r = np.interp(t, frame.grid, frame.r)
    if frame.transverse is not None:
        # in the frame that does not spin p and q change least between readings
        W = frame.transverse * np.exp(1j * frame.psi)
        w = (np.interp(t, frame.grid, W.real) + 1j * np.interp(t, frame.grid, W.imag)) * np.exp(-1j * psi)
    else:
        reach = 2 * GRID
        before, after = _between(grid, turns, t - reach), _between(grid, turns, t + reach)
        inverse = before * np.array([1.0, -1.0, -1.0, -1.0])
        W3 = rotation_vector(multiply(inverse, after)) / (2 * reach)
        w = (W3[:, 0] + 1j * W3[:, 1]) * np.exp(-1j * psi)
        # at the ends half of the span is missing and the rate comes out half as large: no harm to a start
    rate = np.column_stack([w.real, w.imag, r])
    return attitude, rate


def other_attitudes(recording: Recording, attitude: FloatArray) -> tuple[FloatArray, ...]:
    """Return attitudes (4,) that the field alone cannot tell from one: turned about it by quarters of a turn."""
    field = recording.environment.magnetic_field
    n = np.asarray(field / max(float(np.linalg.norm(field)), 1e-9))
    return tuple(multiply(turn(angle * n), attitude) for angle in (np.pi / 2, -np.pi / 2, np.pi))
