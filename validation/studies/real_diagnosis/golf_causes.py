"""Single causes on the golf throws: what each explains once every stated number may move within its uncertainty.

A plain fit beside ``discsim diagnose``, for throws of which only a plan view and a release are known: the release
and the wind as measured, each with its prior, and one cause that all throws share. Heights were not filmed, but a track
ends where the disc comes down, and that counts as a height of zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.effects.aero import SpinDrag, SpinLift, SpinPitchingMoment, SpinSideForce
from discsim.effects.air import Density, GroundEffect, WindShear
from discsim.effects.catalogue import Effect, catalogued, effect_of
from discsim.environment import Environment
from discsim.model_file import Model, ModelEffect
from discsim.recording import Recording
from discsim.trajectory import predict_many
from validation.importing.throw import MeasuredThrow
from validation.studies.golf_throws.prediction import drawn
from validation.studies.real_diagnosis.golf_flight import Flown, flown

__all__ = ["CAUSES", "NONE", "Cause", "CauseFit", "CauseHeldOut", "Throw", "fit_cause", "held_out", "without_cause"]

#: what is left to what no cause here describes, m, and between what times it is taken to be independent, s
LEFT, APART = 0.5, 0.2
#: what the track's end says of the height there, m
GROUND = 0.5
#: columns of the inputs of a throw that are its own (release), and those that all share (wind)
OWN, WIND = 9, 3
#: difference of an input, in its sigmas
DIFFERENCE = 0.02
ITERATIONS = 60


@dataclass(frozen=True)
class Cause:
    """A change of the model by one number x: ``apply`` returns the disc and the effects that go with it.

    ``step`` is the size by which it is tried, zero for a cause that is not fitted; beyond ``most`` it makes no sense.
    """

    name: str
    step: float
    apply: Callable[[Disc, float], tuple[Disc, tuple[Effect, ...]]]
    most: float = np.inf


def _of_table(
    column: str, change: Callable[[FloatArray, float], FloatArray]
) -> Callable[[Disc, float], tuple[Disc, tuple[Effect, ...]]]:
    def apply(disc: Disc, x: float) -> tuple[Disc, tuple[Effect, ...]]:
        assert disc.aero_table is not None
        table = replace(disc.aero_table, **{column: change(getattr(disc.aero_table, column), x)})
        return replace(disc, aero_table=table), ()

    return apply


def _of_catalogue(what: str, step: float, effect: Callable[[float], Any], most: float = np.inf) -> Cause:
    """Return an effect of the catalogue as a cause; ``what`` is its size in words, behind its id."""
    name = f"{catalogued(type(effect(0.0))).id}, {what}"
    return Cause(name, step, lambda disc, x: (disc, (effect_of(effect(x)),)), most)


NONE = Cause("none", 0.0, lambda disc, x: (disc, ()))
CAUSES: Sequence[Cause] = (
    NONE,
    Cause("lift of the table, change", 0.01, _of_table("CL", lambda c, x: c * (1.0 + x))),
    Cause("drag of the table, change", 0.01, _of_table("CD", lambda c, x: c * (1.0 + x))),
    Cause("pitching moment of the table, offset", 0.001, _of_table("CM", lambda c, x: c + x)),
    _of_catalogue("ratio less 1", 0.01, lambda x: Density(1.0 + x)),
    _of_catalogue("north, m/s", 0.1, lambda x: WindShear(w_north_m_s=x, exponent=0.25)),
    _of_catalogue("CLr", 0.002, SpinLift),
    _of_catalogue("CDrr", 0.002, SpinDrag),
    _of_catalogue("CYr", 0.002, SpinSideForce),
    _of_catalogue("CMr", 0.0002, SpinPitchingMoment),
    _of_catalogue("k", 0.05, GroundEffect, 2.0),
)  # fmt: skip


@dataclass(frozen=True)
class Throw:
    """A throw: its track as a recording, and its release as it was measured."""

    recording: Recording
    measured: MeasuredThrow

    @property
    def kept(self) -> FloatArray:
        """Rows of the track that count: every `APART` s, and the last."""
        t = self.recording.need("track").t
        step = max(round(APART / float(np.median(np.diff(t)))), 1)
        return np.unique(np.append(np.arange(step, t.size, step), t.size - 1))


@dataclass(frozen=True)
class CauseFit:
    """A cause fitted to some throws.

    Attributes
    ----------
    cause : Cause
        Which.
    x, sd : float
        Its size and standard deviation.
    merit : float
        Squares of residuals and of moves of what is stated, in their sigmas.
    paths : mapping
        By throw: the fitted flight at the times that count, (m, 3) m, straight on below the ground.
    rms : mapping
        By throw: root mean square distance in plan between the fitted flight and the track, m.
    moves : mapping
        By throw: the largest move of a release condition, in its sigmas.
    wind : (3,) array
        Move of the wind in its sigmas.
    model : Model
        Disc, wind and cause as fitted.
    inputs : (p,) array
        Moves of all that is stated, in sigmas: the releases of the throws in turn, then the wind.
    """

    cause: Cause
    x: float
    sd: float
    merit: float
    paths: Mapping[str, FloatArray]
    rms: Mapping[str, float]
    moves: Mapping[str, float]
    wind: FloatArray
    model: Model
    inputs: FloatArray


def fit_cause(cause: Cause, throws: Mapping[str, Throw], start: CauseFit | None = None) -> CauseFit:
    """Fit one cause, the releases and the wind to throws: least squares, stated uncertainties as priors.

    The fit goes on from the releases and the wind of ``start``, a fit of the same throws; else from what is stated.
    """
    names = list(throws)
    free, stated = int(cause.step > 0.0), OWN * len(throws) + WIND
    prior = np.eye(stated, stated + free)
    last: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def both(u: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return residuals and derivatives, those of what is stated last; kept, for they are asked for in turn."""
        key = u.tobytes()
        if key not in last:
            last.clear()
            e, J = _linearised(cause, throws, u)
            last[key] = np.append(-e, prior @ u), np.vstack((J, prior))
        return last[key]

    def residuals(u: FloatArray) -> FloatArray:
        return both(u)[0]

    def derivatives(u: FloatArray) -> FloatArray:
        return both(u)[1]

    reach = np.append(np.full(stated, np.inf), np.full(free, cause.most / (cause.step or 1.0)))
    begin = np.zeros(reach.size) if start is None else np.append(start.inputs, np.zeros(free))
    solved = least_squares(residuals, begin, derivatives, bounds=(-reach, reach), ftol=1e-6, max_nfev=ITERATIONS)
    u, merit = solved.x, 2.0 * float(solved.cost)
    J = derivatives(u)
    covariance = np.linalg.inv(J.T @ J)
    paths, rms = {}, {}
    for k, (name, throw) in enumerate(throws.items()):
        path = paths[name] = _positions(cause, throw, _inputs(u, k, free)[None], _size(cause, u))[0]
        apart = (path - throw.recording.need("track").value[throw.kept])[:, :2]
        rms[name] = float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))
    moves = {name: float(np.max(np.abs(_inputs(u, k, free)[:OWN]))) for k, name in enumerate(names)}
    wind = u[OWN * len(names) : OWN * len(names) + WIND]
    first = throws[names[0]].recording
    assert first.disc is not None
    disc, effects = cause.apply(first.disc, _size(cause, u))
    sigma = _wind_sigma(first.environment)
    environment = replace(first.environment, wind=first.environment.wind + sigma * wind)
    sd = cause.step * float(np.sqrt(covariance[-1, -1])) if free else 0.0
    model = Model(environment, disc, effects=tuple(ModelEffect(one) for one in effects))
    return CauseFit(cause, _size(cause, u), sd, merit, paths, rms, moves, wind, model, u[:stated])


def known(found: CauseFit) -> Cause:
    """Return a cause that has the size at which it was found, and is fitted no more."""
    return replace(found.cause, step=0.0, apply=lambda disc, _: found.cause.apply(disc, found.x))


@dataclass(frozen=True)
class CauseHeldOut:
    """A cause judged by throws that took no part: ``others`` are the fits to the rest, ``landings`` the flights.

    ``gains`` are by how much the merit of each throw alone, its own release and the wind fitted to it, is better with
    the cause as the others have it than without.
    """

    together: CauseFit
    others: Mapping[str, CauseFit]
    landings: Mapping[str, Flown]
    gains: Mapping[str, float]


def held_out(cause: Cause, throws: Mapping[str, Throw], plain: Mapping[tuple[str, ...], CauseFit]) -> CauseHeldOut:
    """Fit a cause to all throws, and to all but each; fly the one left out from its stated release.

    ``plain`` are the fits `without_cause`, from which these go on.
    """
    rest = {name: {k: one for k, one in throws.items() if k != name} for name in throws}
    others = {name: fit_cause(cause, rest[name], plain[tuple(rest[name])]) for name in throws}
    gains = {}
    for name, throw in throws.items():
        itself = plain[name,]
        gains[name] = itself.merit - fit_cause(known(others[name]), {name: throw}, itself).merit
    landings = {name: flown(throw.recording, others[name].model) for name, throw in throws.items()}
    return CauseHeldOut(fit_cause(cause, throws, plain[tuple(throws)]), others, landings, gains)


def without_cause(throws: Mapping[str, Throw]) -> dict[tuple[str, ...], CauseFit]:
    """Fit releases and wind alone, with no cause, to all throws, to all but each and to each, by their names."""
    sets = [tuple(throws), *(tuple(k for k in throws if k != name) for name in throws), *((name,) for name in throws)]
    return {names: fit_cause(NONE, {name: throws[name] for name in names}) for names in sets}


def _size(cause: Cause, u: FloatArray) -> float:
    return cause.step * float(u[-1]) if cause.step else 0.0


def _inputs(u: FloatArray, throw: int, free: int) -> FloatArray:
    """Return the inputs (12,) of a throw in sigmas, the shared wind last; behind it ``free`` sizes of a cause."""
    own = u[OWN * throw : OWN * (throw + 1)]
    return np.concatenate((own, u[u.size - free - WIND : u.size - free]))


def _wind_sigma(environment: Environment) -> FloatArray:
    return np.broadcast_to(np.asarray(environment.sigma.get("wind_ned_m_s", 0.0), dtype=float), 3)


def _linearised(cause: Cause, throws: Mapping[str, Throw], u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return residuals (m,) in sigmas, and the derivatives (m, p) of what the model says."""
    residuals, rows = [], []
    for k, throw in enumerate(throws.values()):
        z = _inputs(u, k, int(cause.step > 0.0))
        moved = np.vstack((z, z + DIFFERENCE * np.eye(OWN + WIND)))
        x = _size(cause, u)
        said = _positions(cause, throw, moved, x)
        track = throw.recording.need("track").value[throw.kept]
        left = np.append((track - said[0])[:, :2].ravel() / LEFT, said[0][-1, 2] / -GROUND)
        slopes = (said[1:] - said[0]) / DIFFERENCE
        if cause.step:
            more = _positions(cause, throw, z[None], x + cause.step)
            slopes = np.concatenate((slopes, more - said[0]))
        J = np.zeros((left.size, u.size))
        columns = np.concatenate(
            (
                np.arange(OWN * k, OWN * (k + 1)),
                np.arange(OWN * len(throws), u.size),
            )
        )
        J[:-1, columns] = slopes[:, :, :2].reshape(len(slopes), -1).T / LEFT
        J[-1, columns] = slopes[:, -1, 2] / GROUND
        residuals.append(left)
        rows.append(J)
    return np.concatenate(residuals), np.concatenate(rows)


def _positions(cause: Cause, throw: Throw, z: FloatArray, x: float) -> FloatArray:
    """Return positions (n, m, 3) at the times that count, of flights with inputs z (n, 12); straight on below 0 m."""
    recording = throw.recording
    assert recording.disc is not None
    track, rows = recording.need("track"), throw.kept
    disc, effects = cause.apply(recording.disc, x)
    environment = recording.environment
    place = track.value[0, :2]
    states, flats = drawn(throw.measured, disc, environment, place, _wind_sigma(environment), z, effects)
    t = np.maximum(track.t[rows], 0.0)
    flown = predict_many(disc, environment, states, parameters=flats, times=t)
    beyond = np.maximum(t[None] - flown.end[:, None], 0.0)[:, :, None]
    after = flown.state[:, None, :3] + flown.state[:, None, 3:6] * beyond
    return np.where(beyond > 0.0, after, flown.track[:, :, :3])
