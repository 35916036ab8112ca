"""Single causes on the golf throws: what each explains once every stated number may move within its uncertainty.

A plain fit beside ``discsim diagnose``, for throws of which only a plan view and a release are known: the release
and the wind as measured, each with its prior, and one cause that all throws share. Heights were not filmed, but a track
ends where the disc comes down, and that counts as a height of zero.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.effects.catalogue import Effect, effect
from discsim.environment import Environment
from discsim.model_file import Model, ModelEffect
from discsim.recording import Recording
from discsim.trajectory import predict_many
from validation.golf_throws.prediction import drawn
from validation.importing.throw import MeasuredThrow
from validation.real_diagnosis.golf_flight import Flown, flown

__all__ = ["CAUSES", "NONE", "Cause", "CauseFit", "CauseHeldOut", "Throw", "fit_cause", "held_out"]

#: what is left to what no cause here describes, m, and between what times it is taken to be independent, s
LEFT, APART = 0.5, 0.2
#: what the track's end says of the height there, m
GROUND = 0.5
#: columns of the inputs of a throw that are its own (release), and those that all share (wind)
OWN, WIND = 9, 3
#: difference of an input, in its sigmas
DIFFERENCE = 0.02
ITERATIONS = 20


@dataclass(frozen=True)
class Cause:
    """A change of the model by one number x: ``apply`` returns the disc and the effects that go with it.

    ``step`` is the size by which it is tried, zero for a cause that is not fitted.
    """

    name: str
    step: float
    apply: Callable[[Disc, float], tuple[Disc, tuple[Effect, ...]]]


def _of_table(
    column: str, change: Callable[[FloatArray, float], FloatArray]
) -> Callable[[Disc, float], tuple[Disc, tuple[Effect, ...]]]:
    def apply(disc: Disc, x: float) -> tuple[Disc, tuple[Effect, ...]]:
        assert disc.aero_table is not None
        table = replace(disc.aero_table, **{column: change(getattr(disc.aero_table, column), x)})
        return replace(disc, aero_table=table), ()

    return apply


def _of_catalogue(id: str, name: str, **others: float) -> Callable[[Disc, float], tuple[Disc, tuple[Effect, ...]]]:
    return lambda disc, x: (disc, (effect(id, **{name: x, **others}),))


NONE = Cause("none", 0.0, lambda disc, x: (disc, ()))
CAUSES: Sequence[Cause] = (
    NONE,
    Cause("lift of the table, change", 0.01, _of_table("CL", lambda c, x: c * (1.0 + x))),
    Cause("drag of the table, change", 0.01, _of_table("CD", lambda c, x: c * (1.0 + x))),
    Cause("pitching moment of the table, offset", 0.001, _of_table("CM", lambda c, x: c + x)),
    Cause("air.density, ratio less 1", 0.01, lambda disc, x: (disc, (effect("air.density", ratio=1.0 + x),))),
    Cause("air.wind_shear, north, m/s", 0.1, _of_catalogue("air.wind_shear", "w_north_m_s", exponent=0.25)),
    Cause("aero.spin_lift, CLr", 0.002, _of_catalogue("aero.spin_lift", "CLr")),
    Cause("aero.spin_drag, CDrr", 0.002, _of_catalogue("aero.spin_drag", "CDrr")),
    Cause("aero.spin_side_force, CYr", 0.002, _of_catalogue("aero.spin_side_force", "CYr")),
    Cause("aero.spin_pitching_moment, CMr", 0.0002, _of_catalogue("aero.spin_pitching_moment", "CMr")),
    Cause("air.ground_effect, k", 0.05, _of_catalogue("air.ground_effect", "k")),
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


def fit_cause(cause: Cause, throws: Mapping[str, Throw]) -> CauseFit:
    """Fit one cause, the releases and the wind to throws: least squares, stated uncertainties as priors."""
    names = list(throws)
    free = int(cause.step > 0.0)
    count = OWN * len(names) + WIND + free
    u = np.zeros(count)  # inputs and wind in sigmas, the cause in steps
    merit = np.inf
    covariance: FloatArray = np.zeros((count, count))
    share, before = 1.0, u
    for _ in range(ITERATIONS):
        e, J = _linearised(cause, throws, u)
        prior = np.append(np.ones(count - free), np.zeros(free))
        now = float(e @ e + u @ (prior * u))
        if not now < merit:  # too far, or lost: half of the way
            share *= 0.5
            if share < 0.1:
                u = before
                break
            u = before + share * (u - before)
            continue
        if merit - now < 1e-3 * now:
            merit = now
            break
        H = J.T @ J + np.diag(prior)
        covariance = np.asarray(np.linalg.inv(H), dtype=np.float64)
        merit, before, share = now, u, 1.0
        u = u + covariance @ (J.T @ e - prior * u)
    paths, rms = {}, {}
    for k, (name, throw) in enumerate(throws.items()):
        path = paths[name] = _positions(cause, throw, _inputs(u, k)[None], _size(cause, u))[0]
        apart = (path - throw.recording.need("track").value[throw.kept])[:, :2]
        rms[name] = float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))
    moves = {name: float(np.max(np.abs(_inputs(u, k)[:OWN]))) for k, name in enumerate(names)}
    wind = u[OWN * len(names) : OWN * len(names) + WIND]
    first = throws[names[0]].recording
    assert first.disc is not None
    disc, effects = cause.apply(first.disc, _size(cause, u))
    sigma = _wind_sigma(first.environment)
    environment = replace(first.environment, wind=first.environment.wind + sigma * wind)
    sd = cause.step * float(np.sqrt(covariance[-1, -1])) if free else 0.0
    model = Model(environment, disc, effects=tuple(ModelEffect(one) for one in effects))
    return CauseFit(cause, _size(cause, u), sd, merit, paths, rms, moves, wind, model)


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


def held_out(cause: Cause, throws: Mapping[str, Throw]) -> CauseHeldOut:
    """Fit a cause to all throws, and to all but each; fly the one left out from its stated release."""
    others = {name: fit_cause(cause, {k: one for k, one in throws.items() if k != name}) for name in throws}
    alone = {name: {name: throw} for name, throw in throws.items()}
    return CauseHeldOut(
        fit_cause(cause, throws),
        others,
        {name: flown(throw.recording, others[name].model) for name, throw in throws.items()},
        {
            name: fit_cause(NONE, alone[name]).merit - fit_cause(known(others[name]), alone[name]).merit
            for name in throws
        },
    )


def _size(cause: Cause, u: FloatArray) -> float:
    return cause.step * float(u[-1]) if cause.step else 0.0


def _inputs(u: FloatArray, throw: int) -> FloatArray:
    """Return the inputs (12,) of a throw in sigmas, the shared wind last."""
    own = u[OWN * throw : OWN * (throw + 1)]
    free = u.size % OWN - WIND
    return np.concatenate((own, u[u.size - free - WIND : u.size - free]))


def _wind_sigma(environment: Environment) -> FloatArray:
    return np.broadcast_to(np.asarray(environment.sigma.get("wind_ned_m_s", 0.0), dtype=float), 3)


def _linearised(cause: Cause, throws: Mapping[str, Throw], u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return residuals (m,) in sigmas, and the derivatives (m, p) of what the model says."""
    residuals, rows = [], []
    for k, throw in enumerate(throws.values()):
        z = _inputs(u, k)
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
