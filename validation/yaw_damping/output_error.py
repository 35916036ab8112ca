"""C_Nr by output error: the model flight is fitted to the path and to the spin of every throw at once.

The spin obeys (19) with (23): ``Izz rdot = Q A d (gamma C_Nr + C_R sin(alpha))``, R sin(alpha) included. Airspeed and
angle of attack in it are those of the standalone model's flight, whose release state is fitted to the fixes, so that
what the fixes leave open of V and alpha reaches the standard error of C_Nr. One C_Nr is shared by all throws; every
throw has its own release: position, velocity, tilt, p, q, r. What is stated with a sigma (coefficients, inertia,
density, wind) is a parameter with that prior and is shared too; what is stated without one is exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Aero, Disc, aero_key
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.frames import euler_angles, multiply, turn
from discsim.parameters import flight_parameters, parameter_index, tables
from discsim.sensitivity import sensitivities
from discsim.trajectory import Flight, integrate
from validation.yaw_damping.observations import SHARED_S, Throw
from validation.yaw_damping.paper_table import damping_by_26
from validation.yaw_damping.start import release_candidates
from validation.yaw_damping.whiteness import Whiteness, whiteness

__all__ = ["Fit", "FittedThrow", "Shared", "fit_yaw_damping"]

#: the ground is no part of a fit: flights start this much higher, so that a trial does not end before its data do, m
LIFT = 1000.0
#: tolerance of the integration: errors of 1e-5 m and less (docs/trajectory.md) beside fixes of centimetres
TOLERANCE = 1e-7
#: wobble of a disc that leaves a hand, where none is stated: one sigma of p and q, rad/s
WOBBLE = 2.0
#: what is stated without a sigma is exact: it may move by this (SI)
EXACT = 1e-6
#: a position that nobody saw does not matter in still air, but a normal matrix needs to know it, m
ANYWHERE = 100.0
#: columns of `RELEASE_COLUMNS` that are fitted: a turn about z_B changes nothing that is observed
_FREE = np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 10, 11])
_SPIN_ROW = 11
_MOST_STEPS = 40
#: a fit ends where a step lowers chi^2 by less: a tenth of a standard deviation, and the step after is far smaller
_CONVERGED = 0.01
#: a single throw is only a start for all of them, and may end sooner
_STARTED = 10.0
#: a start is good enough, and the next is not tried, where it ends at residuals of so many stated deviations (rms)
_NEAR = 3.0


@dataclass(frozen=True)
class Shared:
    """A parameter that all throws share: where it stands in the physics, its start and its prior's sigma (or none)."""

    group: str
    name: str
    value: float
    sigma: float | None

    @property
    def label(self) -> str:
        """Name for people and files."""
        return self.name if self.group == "aero" else f"{self.group}.{self.name}"


@dataclass(frozen=True)
class FittedThrow:
    """One throw of a fit.

    Attributes
    ----------
    name : str
        The recording's.
    state : (14,) array
        Release state, as `discsim.trajectory.release_state` gives it.
    flight : Flight
        The model flight from the fitted release, `LIFT` above its true height.
    release_sd : (11,) array
        Standard deviations of position and velocity in N, tilt about x_B and y_B (rad), body rates.
    speed, speed_sd : (n,) arrays
        Airspeed at the spin rates, m/s, and its standard deviation from the release alone.
    spin_residual : (n,) array
        Spin less the model's, rad/s.
    path_residual : (m, 6) array
        Fixes less the model's, m and m/s.
    spin_z, path_z : arrays
        The same in stated standard deviations.
    """

    name: str
    state: FloatArray
    flight: Flight
    release_sd: FloatArray
    speed: FloatArray
    speed_sd: FloatArray
    spin_residual: FloatArray
    path_residual: FloatArray
    spin_z: FloatArray
    path_z: FloatArray


@dataclass(frozen=True)
class Fit:
    """A fitted C_Nr: value, standard error, what it leaves.

    ``others`` are the shared parameters that had a sigma, by label: fitted value and standard deviation. The scales
    are by how much the residuals of spin and path exceed what is stated of them; where above one, standard deviations
    were raised by them. ``by_26`` is what the paper's (26) gives with these flights' own r, V and rdot: mean over the
    throws of the C_Nr at the mean rate and airspeed of each. ``covariance`` is that of C_Nr and of ``others`` in their
    order.
    """

    CNr: float
    sd: float
    method: str
    throws: tuple[FittedThrow, ...]
    others: Mapping[str, tuple[float, float]]
    spin_scale: float
    path_scale: float
    spin_whiteness: Whiteness
    path_whiteness: Whiteness
    by_26: float
    covariance: FloatArray


def fit_yaw_damping(throws: Sequence[Throw], start: Sequence[FloatArray] | None = None) -> Fit:
    """Fit one C_Nr to all throws; ``start`` may give release states (14,) of an earlier fit of the same throws.

    Raises `InputError` where the throws are not of one disc, nothing tells how a disc was released, or no model flight
    comes near the path.
    """
    if not throws:
        raise InputError("no throws to fit; expected at least one flight")
    shared = _shared(throws)
    theta = np.array([item.value for item in shared])
    states = [_first_state(throw, shared, theta) for throw in throws] if start is None else list(start)
    first = _point(throws, shared, states, theta)
    if first is None:
        raise InputError("no flight from where the throws seem released; expected a disc that can fly")
    point, slopes = _gauss_newton(throws, shared, first, Weights())
    weights = _excesses(throws, point)
    point, slopes = _gauss_newton(throws, shared, point, weights, slopes=slopes)
    return _result(throws, shared, point, slopes, weights)


# ------------------------------------------------------------------------------------------------- parameters


def _shared(throws: Sequence[Throw]) -> list[Shared]:
    """Return C_Nr and what is stated with a sigma; C_Nr starts from the spin's own decay with V of the path."""
    disc, environment = throws[0].disc, throws[0].recording.environment
    for throw in throws[1:]:
        if _comparable(throw.disc) != _comparable(disc):
            raise InputError(
                f"{throw.recording.name}: states another disc than {throws[0].recording.name}; expected throws of one"
            )
    if disc.aero is None or environment.air_density is None:
        raise InputError(f"{throws[0].recording.name}: C_Nr needs [disc.aero] and air_density_kg_m3; expected both")
    found = [Shared("aero", "CNr", _first_damping(throws), None)]
    flat = flight_parameters(disc, environment)
    for key, group, name, axis in _stated_keys():
        sigma = disc.sigma.get(key, environment.sigma.get(key))
        if sigma is None:
            continue
        size = float(np.broadcast_to(np.asarray(sigma, dtype=float), 3)[axis])
        if size > 0.0:
            found.append(Shared(group, name, float(flat[parameter_index(group, name)]), size))
    return found


def _comparable(disc: Disc) -> tuple[object, ...]:
    given = [vars(table) for table in (disc.aero_table, disc.rolling_table) if table is not None]
    tabulated = [(name, None if value is None else value.tolist()) for table in given for name, value in table.items()]
    return (disc.mass, disc.diameter, disc.Ixx, disc.Izz, disc.aero and disc.aero._replace(CNr=0.0), tabulated)


def _stated_keys() -> Iterator[tuple[str, str, str, int]]:
    """Yield key in the file, group and name in the physics, and the axis of a vector's sigma."""
    for name in Aero._fields:
        if name != "CNr":  # what is sought is free whatever is stated of it
            yield aero_key(name), "aero", name, 0
    yield from (("mass_kg", "disc", "mass", 0), ("diameter_m", "disc", "d", 0))
    yield from (("Ixx_kg_m2", "disc", "Ixx", 0), ("Izz_kg_m2", "disc", "Izz", 0))
    yield from (("gravity_m_s2", "environment", "gravity", 0), ("air_density_kg_m3", "environment", "air_density", 0))
    for axis, name in enumerate(("wind_north", "wind_east", "wind_down")):
        yield "wind_ned_m_s", "environment", name, axis


def _first_damping(throws: Sequence[Throw]) -> float:
    """Return the mean of (26) over the throws, with each one's mean speed over ground, or 15 m/s where not seen."""
    found = []
    for throw in throws:
        slope = np.polyfit(throw.spin_t, np.log(np.maximum(np.abs(throw.spin), 1e-3)), 1)[0]
        seen = throw.path[np.isfinite(throw.path).all(axis=1), 3:]
        V = float(np.linalg.norm(seen, axis=1).mean()) if seen.size else 15.0
        density = throw.recording.environment.air_density or 1.2
        found.append(float(damping_by_26(throw.disc, density, slope, 1.0, V)))
    return float(np.mean(found))


# ---------------------------------------------------------------------------------------------- model flights


def _model(throw: Throw, shared: Sequence[Shared], theta: FloatArray, state: FloatArray) -> Flight | None:
    """Fly a throw from a release state with the shared parameters' values; None where it cannot be flown."""
    disc = replace(throw.disc, yaw_damping_table=None)
    environment: Environment = throw.recording.environment
    flat, lookup = flight_parameters(disc, environment), tables(disc)
    for item, value in zip(shared, theta, strict=True):
        place = parameter_index(item.group, item.name)
        # a throw keeps what it states itself, and moves by as much as all do
        flat[place] = value if item.sigma is None else flat[place] + value - item.value
    lifted = state.copy()
    lifted[2] -= LIFT
    ended, t, states, dense = integrate(flat, lookup, lifted, 0.0, throw.end + 1e-6, TOLERANCE, TOLERANCE, True)
    return Flight(t, states, dense, flat, lookup, environment, False) if ended == 0 else None


@dataclass(frozen=True)
class Weights:
    """Factors by which stated standard deviations of spin and path are raised."""

    spin: float = 1.0
    path: float = 1.0


@dataclass(frozen=True)
class Misses:
    """What a model flight leaves of a throw, in stated standard deviations: spin (n,), path (m, 6), priors (k,)."""

    spin: FloatArray
    path: FloatArray
    prior: FloatArray
    prior_jacobian: FloatArray

    def rows(self, throw: Throw) -> FloatArray:
        """Return what is known of it as one column: path, spin, priors."""
        return np.concatenate((self.path[np.isfinite(throw.path)], self.spin, self.prior))

    def factors(self, throw: Throw, weights: Weights) -> FloatArray:
        """Return what the rows count: spins share data, and deviations may be raised."""
        path = np.full(int(np.isfinite(throw.path).sum()), 1.0 / weights.path)
        spin = throw.spin_sd / throw.spin_weight_sd / weights.spin
        return np.concatenate((path, spin, np.ones(self.prior.size)))

    def weighted(self, throw: Throw, weights: Weights) -> FloatArray:
        """Return the rows of the least squares problem."""
        return self.rows(throw) * self.factors(throw, weights)


def _misses(throw: Throw, flight: Flight, state: FloatArray) -> Misses:
    seen = flight.at(np.maximum(throw.path_t, 0.0))
    height = np.array([0.0, 0.0, LIFT])
    path = (throw.path - np.hstack((seen.position + height, seen.velocity))) / throw.path_sd
    spin = (throw.spin - flight.at(np.maximum(throw.spin_t, 0.0)).rate[:, 2]) / throw.spin_sd
    return Misses(spin, path, *_prior(throw, state))


def _prior(throw: Throw, state: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what is stated of the release less the state's, in sigmas (k,), and its negative Jacobian (k, 11)."""
    release = throw.recording.release
    rows: list[tuple[float, FloatArray]] = []

    def add(miss: float, sigma: float, direction: FloatArray) -> None:
        rows.append((miss / sigma, direction / sigma))

    unit = np.eye(_FREE.size)
    stated = {} if release is None else dict(release.sigma)
    for name, key, first in (
        ("position", "position_ned_m", 0),
        ("velocity", "velocity_ned_m_s", 3),
        ("body_rate", "body_rate_rad_s", 8),
    ):
        value = None if release is None else getattr(release, name)
        places = slice(first, first + 3) if first < 8 else slice(10, 13)
        now = state[places]
        if value is not None:
            sigma = np.maximum(np.broadcast_to(np.asarray(stated.get(key, 0.0), dtype=float), 3), EXACT)
            for axis in range(3):
                add(value[axis] - now[axis], float(sigma[axis]), unit[first + axis])
        elif name == "body_rate":
            for axis in range(2):
                add(-now[axis], WOBBLE, unit[first + axis])
        elif name == "position":
            for axis in range(3):
                add(0.0, ANYWHERE, unit[first + axis])
    if release is not None and (release.roll is not None or release.pitch is not None):
        now_angles = np.array(euler_angles(state[None, 6:10]))[:2, 0]
        slopes = np.zeros((2, _FREE.size))
        for column in (6, 7):
            changed = _changed(state, 1e-6 * unit[column])
            slopes[:, column] = (np.array(euler_angles(changed[None, 6:10]))[:2, 0] - now_angles) / 1e-6
        for k, (angle, key) in enumerate(((release.roll, "roll_rad"), (release.pitch, "pitch_rad"))):
            if angle is not None:
                miss = (angle - now_angles[k] + np.pi) % (2 * np.pi) - np.pi
                add(float(miss), max(float(np.max(stated.get(key, 0.0))), EXACT), slopes[k])
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows]).reshape(-1, _FREE.size)


def _changed(state: FloatArray, change: FloatArray) -> FloatArray:
    """Return a release state (14,) changed by position, velocity, tilt and body rates (11,)."""
    new = state.copy()
    new[:6] += change[:6]
    new[6:10] = multiply(state[6:10], turn(np.array([change[6], change[7], 0.0])))
    new[6:10] /= np.linalg.norm(new[6:10])
    new[10:13] += change[8:11]
    return new


@dataclass(frozen=True)
class Slopes:
    """Derivatives of what is observed of a throw, in stated sigmas.

    By its own release (rows, 11) and by the shared parameters (rows, k); and of its airspeed by its release (n, 11).
    """

    own: FloatArray
    common: FloatArray
    speed: FloatArray


def _slopes(throw: Throw, shared: Sequence[Shared], flight: Flight, misses: Misses) -> Slopes:
    t = np.maximum(np.concatenate((throw.path_t, throw.spin_t)), 0.0)
    every = sensitivities(flight, [(item.group, item.name) for item in shared], t).derivative
    columns = np.concatenate((_FREE, 12 + np.arange(len(shared))))
    m = throw.path_t.size
    path = (every[:m, :6][:, :, columns] / throw.path_sd[:, :, None])[np.isfinite(throw.path)]
    spin = every[m:, _SPIN_ROW][:, columns] / throw.spin_sd[:, None]
    prior = np.hstack((misses.prior_jacobian, np.zeros((misses.prior.size, len(shared)))))
    whole = np.vstack((path, spin, prior))
    relative = _relative_velocity(throw, flight)
    along = relative / np.linalg.norm(relative, axis=1)[:, None]
    speed = np.einsum("ni,nij->nj", along, every[m:, 3:6][:, :, _FREE])
    return Slopes(whole[:, : _FREE.size], whole[:, _FREE.size :], speed)


def _relative_velocity(throw: Throw, flight: Flight) -> FloatArray:
    """Return the velocity (n, 3) m/s against the air at the spin rates."""
    wind = [flight.parameters[parameter_index("environment", f"wind_{axis}")] for axis in ("north", "east", "down")]
    return np.asarray(flight.at(np.maximum(throw.spin_t, 0.0)).velocity - wind)


# ------------------------------------------------------------------------------------------------ least squares


@dataclass(frozen=True)
class Point:
    """Values of all parameters, the flights that they make and what those leave."""

    states: tuple[FloatArray, ...]
    theta: FloatArray
    flights: tuple[Flight, ...]
    misses: tuple[Misses, ...]

    def chi2(self, throws: Sequence[Throw], shared: Sequence[Shared], weights: Weights) -> float:
        """Return the weighted sum of squares."""
        total = sum(((item.value - value) / item.sigma) ** 2 for item, value in _with_prior(shared, self.theta))
        for throw, misses in zip(throws, self.misses, strict=True):
            total += float(np.sum(misses.weighted(throw, weights) ** 2))
        return float(total)


def _with_prior(shared: Sequence[Shared], theta: FloatArray) -> list[tuple[Any, float]]:
    return [(item, float(value)) for item, value in zip(shared, theta, strict=True) if item.sigma is not None]


def _point(
    throws: Sequence[Throw], shared: Sequence[Shared], states: Sequence[FloatArray], theta: FloatArray
) -> Point | None:
    """Fly all throws; None where one cannot be flown."""
    flights, misses = [], []
    for throw, state in zip(throws, states, strict=True):
        flight = _model(throw, shared, theta, state)
        if flight is None:
            return None
        flights.append(flight)
        misses.append(_misses(throw, flight, state))
    return Point(tuple(states), theta, tuple(flights), tuple(misses))


class Normal(NamedTuple):
    """Normal equations of the shared parameters, (k, k) and (k,), each throw's release eliminated; and the way back."""

    matrix: FloatArray
    right: FloatArray
    back: list[tuple[FloatArray, FloatArray, FloatArray]]


def _normal(
    throws: Sequence[Throw],
    shared: Sequence[Shared],
    point: Point,
    slopes: Sequence[Slopes],
    weights: Weights,
    damping: float,
) -> Normal:
    prior = np.array([0.0 if item.sigma is None else 1.0 / item.sigma**2 for item in shared])
    C = np.diag(prior * (1.0 + damping))
    c = prior * (np.array([item.value for item in shared]) - point.theta)
    back = []
    for throw, misses, slope in zip(throws, point.misses, slopes, strict=True):
        factor = misses.factors(throw, weights)
        residual, own, common = misses.rows(throw) * factor, slope.own * factor[:, None], slope.common * factor[:, None]
        A = own.T @ own
        inverse = np.linalg.inv(A + damping * np.diag(np.diag(A))).astype(np.float64)
        B, right = own.T @ common, own.T @ residual
        C = C + common.T @ common + damping * np.diag(np.sum(common**2, axis=0)) - B.T @ inverse @ B
        c = c + common.T @ residual - B.T @ inverse @ right
        back.append((inverse, right, B))
    return Normal(C, c, back)


def _step(normal: Normal) -> tuple[list[FloatArray], FloatArray]:
    """Return the step of each release (11,) and of the shared parameters (k,)."""
    size = np.sqrt(np.diag(normal.matrix))
    common = np.linalg.solve(normal.matrix / np.outer(size, size), normal.right / size) / size
    return [inverse @ (right - B @ common) for inverse, right, B in normal.back], common


def _all_slopes(throws: Sequence[Throw], shared: Sequence[Shared], point: Point) -> list[Slopes]:
    return [_slopes(*each) for each in zip(throws, [shared] * len(throws), point.flights, point.misses, strict=True)]


def _gauss_newton(
    throws: Sequence[Throw],
    shared: Sequence[Shared],
    point: Point,
    weights: Weights,
    enough: float = _CONVERGED,
    slopes: list[Slopes] | None = None,
) -> tuple[Point, list[Slopes]]:
    """Return the point of least chi^2 by the method of Levenberg and Marquardt, and the slopes there.

    Ends where a step gains less than ``enough``; slopes are kept while steps gain less than `_STARTED`.
    """
    slopes = _all_slopes(throws, shared, point) if slopes is None else slopes
    damping, chi2 = 1e-6, point.chi2(throws, shared, weights)
    for _ in range(_MOST_STEPS):
        own, common = _step(_normal(throws, shared, point, slopes, weights, damping))
        states = [_changed(state, change) for state, change in zip(point.states, own, strict=True)]
        tried = _point(throws, shared, states, point.theta + common)
        new = np.inf if tried is None else tried.chi2(throws, shared, weights)
        if tried is not None and new <= chi2:
            gain, point, chi2 = chi2 - new, tried, new
            damping = max(damping / 10.0, 1e-9)
            if gain > _STARTED:
                slopes = _all_slopes(throws, shared, point)
            if gain < enough:
                break
        else:
            if new - chi2 < enough or damping > 1e8:
                break
            damping = max(10.0 * damping, 1e-4)
    return point, slopes


def _first_state(throw: Throw, shared: Sequence[Shared], theta: FloatArray) -> FloatArray:
    """Return the release state (14,) that fits one throw with the shared parameters as they start."""
    best, least = None, np.inf
    frozen = [replace(item, sigma=EXACT * max(abs(item.value), EXACT)) for item in shared]
    for candidate in release_candidates(throw):
        start = _point([throw], frozen, [candidate], theta)
        if start is None:
            continue
        point, _ = _gauss_newton([throw], frozen, start, Weights(), _STARTED)
        chi2 = point.chi2([throw], frozen, Weights())
        if chi2 < least:
            best, least = point.states[0], chi2
        if least < _NEAR**2 * (np.isfinite(throw.path).sum() + throw.spin.size):
            break
    if best is None:
        raise InputError(
            f"{throw.recording.name}: no flight from where it seems released; expected a disc that can fly"
        )
    return best


def _excesses(throws: Sequence[Throw], point: Point) -> Weights:
    """Return by how much residuals of spin and path exceed their stated deviations, at least one.

    Each throw's own parameters are taken off the count: two of its spin (rate, decay), eight of its path. Spins count
    as one per `SHARED_S`.
    """
    spin_sum, spin_left, path_sum, path_left = 0.0, 0.0, 0.0, 0.0
    for throw, misses in zip(throws, point.misses, strict=True):
        independent = throw.spin.size * float(np.mean((throw.spin_sd / throw.spin_weight_sd) ** 2))
        spin_sum += independent * float(np.mean(misses.spin**2))
        spin_left += max(independent - 2.0, 0.0)
        path = misses.path[np.isfinite(throw.path)]
        path_sum += float(path @ path)
        path_left += max(path.size - 8.0, 0.0)
    return Weights(_excess(spin_sum, spin_left), _excess(path_sum, path_left))


def _excess(total: float, left: float) -> float:
    return max(1.0, float(np.sqrt(total / left))) if left > 0 else 1.0


# ------------------------------------------------------------------------------------------------------ results


def _result(
    throws: Sequence[Throw], shared: Sequence[Shared], point: Point, slopes: Sequence[Slopes], weights: Weights
) -> Fit:
    normal = _normal(throws, shared, point, slopes, weights, 0.0)
    covariance = np.linalg.inv(normal.matrix)
    fitted, by_26 = [], []
    for k, throw in enumerate(throws):
        inverse, _, B = normal.back[k]
        own = inverse + inverse @ B @ covariance @ B.T @ inverse
        misses, slope = point.misses[k], slopes[k].speed
        speed = np.linalg.norm(_relative_velocity(throw, point.flights[k]), axis=1)
        fitted.append(
            FittedThrow(
                throw.recording.name,
                point.states[k],
                point.flights[k],
                readonly(np.sqrt(np.diag(own))),
                readonly(speed),
                readonly(np.sqrt(np.einsum("ni,ij,nj->n", slope, own, slope))),
                readonly(misses.spin * throw.spin_sd),
                readonly(misses.path * throw.path_sd),
                readonly(misses.spin),
                readonly(misses.path),
            )
        )
        r_dot = np.polyfit(throw.spin_t, np.abs(throw.spin), 1)[0]
        density = throw.recording.environment.air_density
        assert density is not None
        mean_rate = float(np.abs(throw.spin).mean())
        by_26.append(float(damping_by_26(throw.disc, density, r_dot, mean_rate, float(speed.mean()))))
    sd = np.sqrt(np.diag(covariance))
    return Fit(
        CNr=float(point.theta[0]),
        sd=float(sd[0]),
        method=" and ".join(sorted({throw.method for throw in throws})),
        throws=tuple(fitted),
        others={
            item.label: (float(value), float(spread))
            for item, value, spread in zip(shared[1:], point.theta[1:], sd[1:], strict=True)
        },
        spin_scale=weights.spin,
        path_scale=weights.path,
        spin_whiteness=whiteness([_thinned(throw, one.spin_z) for throw, one in zip(throws, fitted, strict=True)]),
        path_whiteness=whiteness([column for one in fitted for column in one.path_z.T]),
        by_26=float(np.mean(by_26)),
        covariance=readonly(covariance),
    )


def _thinned(throw: Throw, z: FloatArray) -> FloatArray:
    """Return one residual per `SHARED_S`: the mean of those that share data."""
    cells = np.floor((throw.spin_t - throw.spin_t[0]) / SHARED_S).astype(int)
    return np.array([z[cells == cell].mean() for cell in np.unique(cells)])
