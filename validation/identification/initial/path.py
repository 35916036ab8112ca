"""The path, and the specific force along it: what position fixes and an accelerometer say of a throw's first states.

Takes fixes and specific force on a grid; gives position and velocity at given instants. Cubics are fitted to fixes
within a window about each instant (local polynomial regression, Cleveland 1979); where fixes end, specific force is
integrated (dead reckoning).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import BoolArray, FloatArray, IntArray
from discsim.frames import body_to_ned, multiply, turn
from discsim.recording import Recording
from discsim.sensors.accelerometer import force_at
from discsim.validation.identification.initial.attitude import VECTOR_SIGMA, Attitude
from discsim.validation.identification.initial.smoothing import FEWEST, median_of, readings_for

__all__ = [
    "Fixes",
    "SpecificForce",
    "compared",
    "dead_reckoning",
    "in_ned",
    "integrated",
    "local_cubics",
    "normals_of",
    "path_fixes",
    "path_states",
    "specific_force_by",
]

#: half a window of the path's fit, s: 9 fixes at 10 Hz
PATH_HALF = 0.45


#: a throw of which nothing is known: height and speed to the north, m and m/s
GUESSED_HEIGHT, GUESSED_SPEED = 1.3, 20.0


class Fixes(NamedTuple):
    """Fixes of a path: t (n,) s, position and velocity (n, 3) in N, the latter NaN where unknown, and their noise."""

    t: FloatArray
    position: FloatArray
    velocity: FloatArray
    position_sd: float
    velocity_sd: float


class SpecificForce(NamedTuple):
    """Specific force in S at the start, (n, 3) on ``grid`` (n,), and its first and second integral from the start."""

    grid: FloatArray
    force: FloatArray
    gained: FloatArray
    moved: FloatArray

    def integrals_at(self, t: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the second and the first integral (k, 3) at t, the force standing still outside the grid."""
        inside = np.clip(t, self.grid[0], self.grid[-1])
        outside = (t - inside)[:, None]
        force, gained, moved = (
            np.column_stack([np.interp(inside, self.grid, column) for column in part.T])
            for part in (self.force, self.gained, self.moved)
        )
        return moved + gained * outside + 0.5 * force * outside**2, gained + force * outside


def _force_in_start(recording: Recording, frame: Attitude, grid: FloatArray, sigma: float) -> FloatArray | None:
    """Return the specific force of the centre, smoothed, in S at the start, (n, 3); None where it cannot be told.

    Around each instant, by least squares, f_x + i f_y = c + F exp(-i psi): c is what the sensor's place and bias make
    and stands still in B, F what stands still in S. So a clipped axis leaves the other one to tell F.
    """
    samples = recording.get("accelerometer")
    if samples is None:
        return None
    sheet = recording.sheets["accelerometer"]
    lost = sheet.clipped(samples.value) | ~np.isfinite(samples.value) | _stuck(samples.value, sheet.resolution or 0.0)
    x, y, z = np.where(lost, 0.0, samples.value).T
    seen = (~lost).astype(float)
    if np.count_nonzero(seen[:, 2]) < FEWEST or np.count_nonzero(seen[:, 0] + seen[:, 1]) < FEWEST:
        return None
    t = samples.t
    c, s = np.cos(frame.psi_at(t)), np.sin(frame.psi_at(t))
    one, zero = np.ones(t.size), np.zeros(t.size)
    rows = (np.stack([one, zero, c, s], axis=1), np.stack([zero, one, -s, c], axis=1))
    products = [
        np.concatenate([(a[:, :, None] * a[:, None, :]).reshape(-1, 16), a * value[:, None]], axis=1) * weight[:, None]
        for a, value, weight in zip(rows, (x, y), (seen[:, 0], seen[:, 1]), strict=True)
    ]
    sums = _sums(t, np.column_stack([products[0] + products[1], z, seen[:, 2]]), grid, sigma)
    r = np.interp(grid, frame.grid, frame.r)
    place = np.zeros(2) if sheet.position is None else sheet.position[:2]
    still = -(r**2)[:, None] * place
    # prior of c: a sixth of the centripetal share (1.5 mm in 16) and a bias of 1 m/s^2; of F: 20 m/s^2
    precision = 1 / (1.0 + 0.15 * np.linalg.norm(still, axis=1)) ** 2
    information = sums[:, :16].reshape(-1, 4, 4) + 1e-3 * np.eye(4)
    information[:, 0, 0] += precision
    information[:, 1, 1] += precision
    pull = sums[:, 16:20].copy()
    pull[:, :2] += precision[:, None] * still
    solution = np.linalg.solve(information, pull[:, :, None])[:, :, 0]
    along = sums[:, 20] / np.maximum(sums[:, 21], 1e-9)
    vector = np.column_stack([solution[:, 2:], along])
    vector[sums[:, 21] < 2.0] = 0.0  # nothing read here: a vector without length has no weight
    return np.asarray(np.einsum("nij,nj->ni", body_to_ned(frame.D_at(grid)), vector))


def specific_force_by(recording: Recording, frame: Attitude) -> SpecificForce | None:
    """Return the specific force in S at the start and its integrals over the recording."""
    if frame.tumbling:
        return _specific_force_tumbling(recording, frame)
    # as local as a turn allows: the integrals average it anyway
    sigma = float(np.clip(3.0 / max(median_of(frame.r), 0.1), 0.03, VECTOR_SIGMA))
    grid = np.arange(0.0, recording.end + sigma, sigma)
    force = _force_in_start(recording, frame, grid, sigma)
    return None if force is None else integrated(grid, force)


def _specific_force_tumbling(recording: Recording, frame: Attitude) -> SpecificForce | None:
    """Return the force of a disc whose three rates are known: each reading less what the sensor's place makes."""
    readings = readings_for(recording, "accelerometer")
    if readings is None or frame.transverse is None:
        return None
    place = recording.sheets["accelerometer"].position
    d = np.zeros(3) if place is None else np.asarray(place)
    w = np.column_stack([frame.transverse.real, frame.transverse.imag, frame.r])
    w = np.column_stack([np.interp(readings.t, frame.grid, column) for column in w.T])
    # (1): what is left of the reading at the centre
    force = force_at(-d, readings.value, w, np.gradient(w, readings.t, axis=0))
    about = frame.psi_at(readings.t)[:, None] * np.array([0.0, 0.0, 1.0])
    C = body_to_ned(multiply(frame.D_at(readings.t), turn(about)))
    return integrated(readings.t, np.einsum("nij,nj->ni", C, force))


def integrated(grid: FloatArray, force: FloatArray) -> SpecificForce:
    """Return a force (n, 3) on a grid (n,) with its first and second integrals."""
    step = np.diff(grid)[:, None]
    gained = cumulative_trapezoid(force, grid, axis=0, initial=0)
    # trapezoids of the first integral, with the parabola that a straight force makes
    steps = gained[:-1] * step + (2 * force[:-1] + force[1:]) * step**2 / 6
    return SpecificForce(grid, force, gained, np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)]))


def nearest_places(grid: FloatArray, t: FloatArray) -> IntArray:
    """Return the places (k,) on an even grid (n,) that are nearest to instants (k,)."""
    return np.asarray(np.clip(np.rint((t - grid[0]) / (grid[1] - grid[0])).astype(int), 0, grid.size - 1))


def in_ned(force_felt: SpecificForce, grid: FloatArray, G: FloatArray, gravity: float) -> SpecificForce:
    """Return the acceleration in N, and its integrals, that attitudes G (n, 3, 3) on ``grid`` make of a force felt."""
    nearest = nearest_places(grid, force_felt.grid)
    # a wrong reading must not carry the disc away: the specific force of a throw is below 4 g
    size = np.linalg.norm(force_felt.force, axis=1, keepdims=True)
    force = force_felt.force * np.minimum(1.0, 40.0 / np.maximum(size, 1e-9))
    return integrated(force_felt.grid, np.einsum("nij,nj->ni", G[nearest], force) + np.array([0.0, 0.0, gravity]))


def _stuck(value: FloatArray, resolution: float) -> BoolArray:
    """Tell which readings (n, k) stand at an axis's own extreme again and again: it clips below its stated range."""
    top = np.nanmax(np.where(np.isfinite(value), np.abs(value), 0.0), axis=0)
    at_top = np.abs(value) >= top - 0.5 * resolution - 1e-9
    # of noisy readings that are rounded only a few share the largest value
    return np.asarray(at_top & (np.count_nonzero(at_top, axis=0) > max(8, 0.02 * len(value))))


def _sums(t: FloatArray, columns: FloatArray, at: FloatArray, sigma: float) -> FloatArray:
    """Return sums (m, k) of columns (n, k) with Gaussian weights around the instants (m,)."""
    lo, hi = np.searchsorted(t, at - 3.5 * sigma), np.searchsorted(t, at + 3.5 * sigma)
    out = np.zeros((at.size, columns.shape[1]))
    for i, instant in enumerate(at):
        x = (t[lo[i] : hi[i]] - instant) / sigma
        out[i] = np.exp(-0.5 * x * x) @ columns[lo[i] : hi[i]]
    return out


def path_fixes(recording: Recording) -> Fixes | None:
    """Return the fixes of GPS, or else of a track, or None where there are fewer than four."""
    for sensor in ("gps", "track"):
        samples = recording.get(sensor)
        if samples is None:
            continue
        good = np.asarray(np.all(np.isfinite(samples.value[:, :3]), axis=1))
        if np.count_nonzero(good) < 4:
            continue
        sheet, value = recording.sheets[sensor], samples.value[good]
        velocity = value[:, 3:6] if value.shape[1] >= 6 else np.full((len(value), 3), np.nan)
        return Fixes(samples.t[good], value[:, :3], velocity, sheet.noise_rms or 0.2, sheet.velocity_noise_rms or 0.1)
    return None


def local_cubics(fixes: Fixes, t: FloatArray) -> FloatArray:
    """Fit a cubic to the fixes around each instant t (m,); return its value and three derivatives, (m, 4, 3)."""
    nothing = np.zeros((fixes.t.size, 0))
    return _local_cubics(fixes, t, nothing, nothing)


def _local_cubics(fixes: Fixes, t: FloatArray, moved: FloatArray, gained: FloatArray) -> FloatArray:
    """Fit a cubic to the fixes around each instant t (m,); return its value and three derivatives, (m, 4, 3 + k).

    ``moved`` and ``gained`` (n, k) are positions and velocities of something else at the times of the fixes, to which
    the very same fit is made; the fixes alone decide the weights, and outliers lose theirs step by step.
    """
    moving = np.asarray(np.all(np.isfinite(fixes.velocity), axis=1))
    x, v = np.concatenate([fixes.position, moved], axis=1), np.concatenate([fixes.velocity, gained], axis=1)
    out = np.empty((t.size, 4, x.shape[1]))
    # a throw's acceleration is below 3 g, its change a few g per second: keeps few fixes from inventing more
    ridge = np.diag([1e-9, 1e-9, 1.0 / 30.0**2, 1.0 / 40.0**2])
    for i, instant in enumerate(t):
        centre = float(np.clip(instant, fixes.t[0] + PATH_HALF, max(fixes.t[-1] - PATH_HALF, fixes.t[0] + PATH_HALF)))
        half = PATH_HALF + 1e-9
        while np.count_nonzero(np.abs(fixes.t - centre) <= half) < min(7, fixes.t.size):
            half *= 1.3
        chosen = np.abs(fixes.t - centre) <= half
        quick = moving[chosen]
        tau = fixes.t[chosen] - instant
        one, zero = np.ones(tau.size), np.zeros(tau.size)
        A = np.concatenate(
            [
                np.column_stack([one, tau, tau**2 / 2, tau**3 / 6]) / fixes.position_sd,
                np.column_stack([zero, one, tau, tau**2 / 2])[quick] / fixes.velocity_sd,
            ]
        )
        y = np.concatenate([x[chosen] / fixes.position_sd, v[chosen][quick] / fixes.velocity_sd])
        weighted = A
        solution = _solved(A.T @ A + ridge, A.T @ y)
        for scale in (30.0, 10.0, 4.0, 3.0):
            misfit = np.linalg.norm(y[:, :3] - A @ solution[:, :3], axis=1)
            # noise may be larger than stated: outliers are told by the others' median
            usual = max(1.0, float(np.median(misfit)) / 1.5)
            if float(np.max(misfit)) < usual * 4.0:
                break
            weighted = A * (1 / (1 + (misfit / (scale * usual)) ** 2) ** 2)[:, None]
            solution = _solved(weighted.T @ A + ridge, weighted.T @ y)
        out[i] = solution
    return out


def _solved(normal: FloatArray, right: FloatArray) -> FloatArray:
    """Solve normal equations; the smallest of their solutions where rounding leaves no single one.

    So it is where the clock of the fixes jumped by hours: seconds to the sixth power hide the other numbers.
    """
    try:
        return np.asarray(np.linalg.solve(normal, right))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(normal, right)[0])


def compared(
    fixes: Fixes, force_felt: SpecificForce | None, grid: FloatArray, gravity: float
) -> tuple[FloatArray, FloatArray | None]:
    """Return the specific force (n, 3) in N from the path, and that felt in S at the start, over the same windows.

    Both go through the same cubics: as path and velocity that the force felt would make. So a force that changes
    within a window does not turn one against the other. A delay of the fixes is looked for where the sizes of both
    disagree, for it would.
    """
    inside = np.clip(grid, fixes.t[0], fixes.t[-1])
    down = np.array([0.0, 0.0, gravity])
    if force_felt is None:
        return local_cubics(fixes, inside)[:, 2, :] - down, None
    found = []
    for delay in (0.0, 0.1, 0.2, 0.3):
        both = _local_cubics(fixes, inside[::3] if delay else inside, *force_felt.integrals_at(fixes.t - delay))[
            :, 2, :
        ]
        force, other = both[:, :3] - down, both[:, 3:]
        apart = np.linalg.norm(force, axis=1) - np.linalg.norm(other, axis=1)
        # whatever both differ in all the time is a bias
        misfit = float(np.median(np.abs(apart - np.median(apart))))
        found.append((misfit, delay, force, other))
        if delay == 0.0 and misfit < 0.5:
            break
    best = min(found, key=lambda entry: entry[0])
    if best[1] == 0.0 or best[0] > 0.5 * found[0][0]:
        return found[0][2], found[0][3]
    both = _local_cubics(fixes, inside, *force_felt.integrals_at(fixes.t - best[1]))[:, 2, :]
    return both[:, :3] - down, both[:, 3:]


def path_states(fixes: Fixes, force_felt: SpecificForce | None, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity (k, 3) at t: what the acceleration in N makes, and local cubics for the rest."""
    nothing = np.zeros((fixes.t.size, 0))
    inside = np.clip(t, fixes.t[0], fixes.t[-1])
    outside = (t - inside)[:, None]
    if force_felt is None:
        cubic = local_cubics(fixes, inside)
        x, v, a = cubic[:, 0], cubic[:, 1], cubic[:, 2]
        return x + v * outside + 0.5 * a * outside**2, v + a * outside
    moved, gained = force_felt.integrals_at(fixes.t)
    rest = fixes._replace(position=fixes.position - moved, velocity=fixes.velocity - gained)
    cubic = _local_cubics(rest, inside, nothing, nothing)
    moved, gained = force_felt.integrals_at(t)
    return cubic[:, 0] + cubic[:, 1] * outside + moved, cubic[:, 1] + gained


def dead_reckoning(
    recording: Recording, force_felt: SpecificForce | None, t: FloatArray, told: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity (k, 3) at t from the stated release and the acceleration in N.

    A velocity that is not stated is the one that is ``told`` otherwise (3,) m/s, or a guess.
    """
    release = recording.release
    position = np.array([0.0, 0.0, -GUESSED_HEIGHT])
    velocity = np.array([GUESSED_SPEED, 0.0, 0.0]) if told is None else told
    if release is not None and release.position is not None:
        position = np.array(release.position)
    if release is not None and release.velocity is not None:
        velocity = np.array(release.velocity)
    if force_felt is None:
        return position + velocity * t[:, None], np.tile(velocity, (t.size, 1))
    moved, gained = force_felt.integrals_at(t)
    return position + velocity * t[:, None] + moved, velocity + gained


def normals_of(recording: Recording, velocity: FloatArray, force: FloatArray) -> FloatArray | None:
    """Return the spin axis in N (n, 3), as long as the lift's share of the specific force (n, 3), from a path alone.

    Lift is across the airspeed, in its plane with the axis, and its size tells the angle of attack, (20), (21). Lift
    is taken to point away from z_B. None where the disc's aerodynamics are unknown.
    """
    disc, density = recording.disc, recording.environment.air_density
    if disc is None or disc.aero is None or density is None:
        return None
    relative = velocity - recording.environment.wind
    speed = np.maximum(np.linalg.norm(relative, axis=1, keepdims=True), 1.0)
    along = relative / speed
    across = force - np.sum(force * along, axis=1, keepdims=True) * along
    lift = np.linalg.norm(across, axis=1, keepdims=True)
    alpha = np.linspace(-0.3, 0.6, 181)
    CL = disc.aero.CL0 + disc.aero.CLa * alpha
    if disc.aero_table is not None:
        CL = np.interp(alpha, disc.aero_table.alpha, disc.aero_table.CL)
    needed = lift * disc.mass / (0.5 * density * speed**2 * disc.area)
    found = alpha[np.argmin(np.abs(CL[None, :] - needed), axis=1)][:, None]
    z = -np.cos(found) * across / np.maximum(lift, 1e-6) + np.sin(found) * along
    return np.asarray(z * np.minimum(lift, 20.0))
