"""C_Nr by output error: the model flight is fitted to the path and to the spin of every throw at once.

The spin obeys (19) with (23): ``Izz rdot = Q A d (gamma C_Nr + C_R sin(alpha))``, R sin(alpha) included. Airspeed and
angle of attack in it are those of the standalone model's flight, whose release state is fitted to the fixes, so that
what the fixes leave open of V and alpha reaches the standard error of C_Nr. One C_Nr is shared by all throws; every
throw has its own release: position, velocity, attitude, p, q, r. What is stated with a sigma (coefficients, inertia,
density, wind) is a parameter with that prior and is shared too; what is stated without one is exact.

To `discsim.validation.identification` a throw is one segment of the plant `FLIGHT` with two sensors: fixes, and a spin
rate whose noise is known reading by reading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Release
from discsim.errors import InputError
from discsim.parameters import flight_parameters, parameter_index, tables
from discsim.recording import SENSORS, Recording, SensorSheet
from discsim.sensitivity import sensitivities
from discsim.trajectory import Flight, integrate
from discsim.validation.identification.gauss_newton import Bars, polished, refit
from discsim.validation.identification.gauss_newton import Fit as Solution
from discsim.validation.identification.noise import GroupNoise, NoiseModel
from discsim.validation.identification.normal_equations import Reduced, local_covariance
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants.flight import FLIGHT
from discsim.validation.identification.propagation import FLAT_ENVIRONMENT
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.residual_tests import Whiteness, whiteness
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.stated_parameters import stated_parameters
from discsim.validation.yaw_damping.observations import SHARED_S, Throw
from discsim.validation.yaw_damping.paper_table import damping_by_26
from discsim.validation.yaw_damping.start import release_candidates

__all__ = ["Fit", "FittedThrow", "fit_yaw_damping"]

#: the ground is no part of a fit: its flights start this much higher, so that none ends before its data do, m
LIFT = 1000.0
#: tolerance of their integration: errors of 1e-5 m and less (docs/trajectory.md) beside fixes of centimetres
TOLERANCE = 1e-7
#: wobble of a disc that leaves a hand, where none is stated: one sigma of p and q, rad/s
WOBBLE = 2.0
#: half the difference in C_Nr, as a share of it: the spin is all but linear in it
_STEP = 1e-4
_MOST_STEPS = 40
#: a fit ends where a step would lower chi^2 by less: a tenth of a standard deviation
_CONVERGED = 0.01
#: a single throw is only a start for all of them, and may end sooner
_STARTED = 10.0
#: a start is good enough, and the next is not tried, where it ends at residuals of so many stated deviations (rms)
_NEAR = 3.0
#: a turn of the release about z_B, with p and q turned back, changes nothing that is observed, and is held
_TURN = 8


@dataclass(frozen=True)
class FittedThrow:
    """One throw of a fit.

    Attributes
    ----------
    name : str
        The recording's.
    state : (13,) array
        Release state: position and velocity in N, attitude, body rates.
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
    """Fit one C_Nr to all throws; ``start`` may give release states (13,) of an earlier fit of the same throws.

    Raises `InputError` where the throws are not of one disc, nothing tells how a disc was released, or no model flight
    comes near the path.
    """
    if not throws:
        raise InputError("no throws to fit; expected at least one flight")
    parameters = _parameters(throws)
    at = np.array([parameter.stated for parameter in parameters])
    states = [_first_state(throw, float(at[0])) for throw in throws] if start is None else start
    segments = tuple(_segment(throw, state) for throw, state in zip(throws, states, strict=True))
    fit = Solution(segments, parameters, at, FLIGHT.sizes.continuous, _noise())
    fit, _ = polished(refit(fit, iterations=_MOST_STEPS, tolerance=_CONVERGED))
    if not np.isfinite(fit.merit):
        raise InputError("no flight from where the throws seem released; expected a disc that can fly")
    fit = replace(fit, noise=_excesses(throws, fit))
    return _result(throws, *polished(refit(fit, iterations=_MOST_STEPS, tolerance=_CONVERGED)))


# ------------------------------------------------------------------------------------------- what is fitted to what


def _parameters(throws: Sequence[Throw]) -> tuple[Parameter, ...]:
    """Return C_Nr and what is stated with a sigma; C_Nr starts from the spin's own decay with V of the path.

    A throw keeps what it states itself, and moves by as much as all do.
    """
    first = throws[0].recording
    for throw in throws[1:]:
        if _comparable(throw.disc) != _comparable(throws[0].disc):
            raise InputError(f"{throw.recording.name}: states another disc than {first.name}; expected throws of one")
    if throws[0].disc.aero is None or first.environment.air_density is None:
        raise InputError(f"{first.name}: C_Nr needs [disc.aero] and air_density_kg_m3; expected both")
    flats = [flight_parameters(throw.disc, throw.recording.environment) for throw in throws]
    CNr = _first_damping(throws)
    found = [Parameter("aero", "CNr", CNr, _STEP * abs(CNr))]
    for q in stated_parameters([first]):
        # what is sought is free whatever is stated of it; the field and the sensors are no part of a flight
        if (q.group in FLIGHT.hardware or q.key in FLAT_ENVIRONMENT) and q.key != found[0].key:
            place = parameter_index(q.group, q.name)
            found.append(replace(q, offsets=tuple(float(flat[place] - flats[0][place]) for flat in flats)))
    return tuple(found)


def _comparable(disc: Disc) -> tuple[object, ...]:
    given = [vars(table) for table in (disc.aero_table, disc.rolling_table) if table is not None]
    tabulated = [(name, None if value is None else value.tolist()) for table in given for name, value in table.items()]
    return (disc.mass, disc.diameter, disc.Ixx, disc.Izz, disc.aero and disc.aero._replace(CNr=0.0), tabulated)


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


def _segment(throw: Throw, state: FloatArray) -> Trajectory:
    """Return a throw as one segment from its release on: fixes and the spin rate with the noise of each."""
    readings = (
        _readings("gps", throw.path_t, throw.path, throw.path_sd),
        _readings("rate_reference", throw.spin_t, throw.spin[:, None], throw.spin_weight_sd[:, None]),
    )
    recording = replace(
        throw.recording,
        disc=replace(throw.disc, yaw_damping_table=None),
        release=_release(throw.recording),
        sheets={item.sensor: SensorSheet(1.0) for item in readings},
        samples={},
    )
    nodes = np.array([0.0, throw.end + 1e-6])
    return Trajectory(recording, readings, nodes, state[None], trust_radius=FLIGHT.sizes.of_path)


def _readings(sensor: str, t: FloatArray, value: FloatArray, sd: FloatArray) -> Readings:
    return Readings(sensor, t, value, np.isfinite(value), np.zeros(value.shape, np.bool_), sd, SENSORS[sensor].columns)


def _release(recording: Recording) -> Release:
    """Return what is stated of a release but its turn about z_B, and of a wobble, else, what hands make of it."""
    stated = replace(recording.release or Release(), yaw=None)
    if stated.body_rate is not None:
        return stated
    wobble = np.array([WOBBLE, WOBBLE, np.inf])
    return replace(stated, body_rate=np.zeros(3), sigma={**stated.sigma, "body_rate_rad_s": wobble})


def _first_state(throw: Throw, CNr: float) -> FloatArray:
    """Return the release state (13,) that fits one throw with a C_Nr and all else as stated."""
    best: FloatArray | None = None
    least = np.inf
    for candidate in release_candidates(throw):
        segment = _segment(throw, candidate)
        alone = Solution((segment,), (), np.empty(0), FLIGHT.sizes.continuous, _noise(), {("aero", "CNr"): CNr})
        fit = refit(alone, iterations=_MOST_STEPS, tolerance=_STARTED, bars=Bars(least))
        if fit.merit < least:
            best, least = fit.trajectories[0].states[0], fit.merit
        if least < _NEAR**2 * fit.count:
            break
    if best is None:
        span = float(throw.spin_t[-1] - throw.spin_t[0])
        raise InputError(
            f"{throw.recording.name}: no flight from where it seems released, by a spin known at {throw.spin_t.size} "
            f"instants over {span:.3g} s; expected a disc that can fly, and readings of the whole throw"
        )
    return best


# ------------------------------------------------------------------------------------------------------- noise


def _noise(spin: float = 1.0, path: float = 1.0) -> NoiseModel:
    """Return noise that is so many times as large as stated."""
    fixes = GroupNoise(path, relative=True)
    return {"gps.position": fixes, "gps.velocity": fixes, "rate_reference": GroupNoise(spin, relative=True)}


def _excesses(throws: Sequence[Throw], fit: Solution) -> NoiseModel:
    """Return by how much residuals of spin and path exceed their stated deviations, at least one.

    Each throw's own parameters are taken off the count: two of its spin (rate, decay), eight of its path. Spins count
    as one per `SHARED_S`.
    """
    total, left = {True: 0.0, False: 0.0}, {True: 0.0, False: 0.0}
    for throw, linear in zip(throws, fit.linears, strict=True):
        spin = np.zeros(linear.t.size, np.bool_)
        for channel in linear.channels:
            spin[channel.rows] = channel.sensor == "rate_reference"
        independent = float(np.sum((throw.spin_sd / throw.spin_weight_sd) ** 2))
        z = linear.residual / linear.sd
        for of_spin, count in ((True, independent - 2.0), (False, np.count_nonzero(~spin) - 8.0)):
            total[of_spin] += float(np.sum(z[spin == of_spin] ** 2))
            left[of_spin] += max(count, 0.0)
    return _noise(*(_excess(total[which], left[which]) for which in (True, False)))


def _excess(total: float, left: float) -> float:
    return max(1.0, float(np.sqrt(total / left))) if left > 0 else 1.0


# ------------------------------------------------------------------------------------------------------ results


def _flight(throw: Throw, fit: Solution, number: int) -> Flight:
    """Fly a throw as it was fitted, `LIFT` above its true height."""
    environment = throw.recording.environment
    disc = replace(throw.disc, yaw_damping_table=None)
    flat, lookup = flight_parameters(disc, environment), tables(disc)
    for key, value in fit.values(number).items():
        flat[parameter_index(*key)] = value
    state = np.append(fit.trajectories[number].states[0], 0.0)
    state[2] -= LIFT
    ended, t, states, dense = integrate(flat, lookup, state, 0.0, throw.end + 1e-6, TOLERANCE, TOLERANCE, True)
    if ended != 0:
        raise InputError(f"{throw.recording.name}: no model flight comes near its path; expected a disc that can fly")
    return Flight(t, states, dense, flat, lookup, environment, False)


def _fitted(throw: Throw, fit: Solution, number: int, covariance: FloatArray) -> FittedThrow:
    """Return what a fit says of one throw; ``covariance`` (12, 12) is that of its release."""
    flight = _flight(throw, fit, number)
    seen, spun = flight.at(np.maximum(throw.path_t, 0.0)), flight.at(t := np.maximum(throw.spin_t, 0.0))
    path = throw.path - np.hstack((seen.position + np.array([0.0, 0.0, LIFT]), seen.velocity))
    spin = throw.spin - spun.rate[:, 2]
    wind = [flight.parameters[parameter_index("environment", f"wind_{axis}")] for axis in ("north", "east", "down")]
    relative = spun.velocity - wind
    speed = np.linalg.norm(relative, axis=1)
    slope = np.einsum("ni,nij->nj", relative / speed[:, None], sensitivities(flight, (), t).derivative[:, 3:6])
    return FittedThrow(
        throw.recording.name,
        readonly(fit.trajectories[number].states[0]),
        flight,
        readonly(np.delete(np.sqrt(np.diag(covariance)), _TURN)),
        readonly(speed),
        readonly(np.sqrt(np.einsum("ni,ij,nj->n", slope, covariance, slope))),
        readonly(spin),
        readonly(path),
        readonly(spin / throw.spin_sd),
        readonly(path / throw.path_sd),
    )


def _result(throws: Sequence[Throw], fit: Solution, reduced: Sequence[Reduced]) -> Fit:
    covariance = fit.covariance
    fitted = [
        _fitted(throw, fit, number, local_covariance(one, covariance))
        for number, (throw, one) in enumerate(zip(throws, reduced, strict=True))
    ]
    sd = np.sqrt(np.diag(covariance))
    return Fit(
        CNr=float(fit.at[0]),
        sd=float(sd[0]),
        method=" and ".join(sorted({throw.method for throw in throws})),
        throws=tuple(fitted),
        others={
            q.name if q.group == "aero" else f"{q.group}.{q.name}": (float(value), float(spread))
            for q, value, spread in zip(fit.parameters[1:], fit.at[1:], sd[1:], strict=True)
        },
        spin_scale=fit.noise["rate_reference"].sd,
        path_scale=fit.noise["gps.position"].sd,
        spin_whiteness=whiteness([_thinned(throw, one.spin_z) for throw, one in zip(throws, fitted, strict=True)]),
        path_whiteness=whiteness([column for one in fitted for column in one.path_z.T]),
        by_26=float(np.mean([_by_26(throw, one.speed) for throw, one in zip(throws, fitted, strict=True)])),
        covariance=readonly(covariance),
    )


def _by_26(throw: Throw, speed: FloatArray) -> float:
    """Return C_Nr by (26) at the mean rate and airspeed, with the slope of a straight line."""
    density = throw.recording.environment.air_density
    assert density is not None
    size = np.abs(throw.spin)
    slope = np.polyfit(throw.spin_t, size, 1)[0]
    return float(damping_by_26(throw.disc, density, slope, float(size.mean()), float(speed.mean())))


def _thinned(throw: Throw, z: FloatArray) -> FloatArray:
    """Return one residual per `SHARED_S`: the mean of those that share data."""
    cells = np.floor((throw.spin_t - throw.spin_t[0]) / SHARED_S).astype(int)
    return np.array([z[cells == cell].mean() for cell in np.unique(cells)])
