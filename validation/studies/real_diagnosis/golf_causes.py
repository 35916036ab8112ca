"""Causes on the golf throws: what each explains once every stated number may move within its uncertainty.

A plain fit beside ``discsim diagnose``, for throws of which only a plan view and a release are known: the release
and the wind as measured, each with its prior, and a cause that all throws share. Heights were not filmed, but a track
ends where the disc comes down, and that counts as a height of zero. A cause is judged on the throw that took no part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.optimize import least_squares

from discsim.arrays import FloatArray
from discsim.environment import Environment
from discsim.recording import Recording
from discsim.trajectory import predict_many
from discsim.validation.importing.throw import MeasuredThrow
from discsim.validation.studies.golf_throws.prediction import drawn
from discsim.validation.studies.real_diagnosis.golf_worlds import INPUTS, NONE, Cause, World

__all__ = [
    "OWN",
    "CauseFit",
    "CauseHeldOut",
    "Throw",
    "fit_cause",
    "held_out",
    "known",
    "likely_pairs",
    "positions",
    "without_cause",
]

#: what is left to what no cause here describes, m, and between what times it is taken to be independent, s
LEFT, APART = 0.2, 0.2
#: a point that counts is the middle of a parabola through the rows so near, s; clicks that are this many robust
#: deviations off it are left out (by chance one in 3000)
NEAR, OFF = 0.12, 4.0
#: what the track's end says of the height there, m
GROUND = 0.5
#: columns of the inputs of a throw that are its own (release), and those that all share (wind)
OWN, WIND = 9, 3
#: the release is where a parabola through the track's first so many seconds begins: the first click alone may be stale
BEGINNING = 0.3
#: shares of the rms without a cause: what counts as no change, and what is left by a cause that helps
SAME, LITTLE = 0.005, 0.5
#: difference of an input, in its sigmas
DIFFERENCE = 0.02
ITERATIONS = 12
#: a fit has come down where a step lowers the squares by less than this share: a tenth of what one sigma is worth
SETTLED = 1e-3
#: tolerance of the flights, below a millimetre at the touch-down
TOLERANCE = 1e-5


@dataclass(frozen=True)
class Throw:
    """A throw: its track as a recording, and its release as it was measured."""

    recording: Recording
    measured: MeasuredThrow

    @cached_property
    def kept(self) -> FloatArray:
        """Rows of the track that count: every `APART` s, and the last."""
        t = self.recording.need("track").t
        step = max(round(APART / float(np.median(np.diff(t)))), 1)
        return np.unique(np.append(np.arange(step, t.size, step), t.size - 1))

    @cached_property
    def plan(self) -> FloatArray:
        """The points (m, 2) m that count, freed of single bad clicks."""
        track = self.recording.need("track")
        return np.stack([_smoothed(track.t, track.value[:, :2], k) for k in self.kept])

    @cached_property
    def place(self) -> FloatArray:
        """Where the track begins, (2,) m, as its first rows have it together."""
        track = self.recording.need("track")
        return _smoothed(track.t, track.value[:, :2], 0, BEGINNING)


def _smoothed(t: FloatArray, plan: FloatArray, row: int, near_by: float = NEAR) -> FloatArray:
    """Return where a parabola through the rows beside one has it, (2,) m; those far off take no part."""
    near = np.flatnonzero(np.abs(t - t[row]) <= near_by)
    for _ in range(2):
        A = np.vander(t[near] - t[row], 3)
        fit = np.linalg.lstsq(A, plan[near])[0]
        off = np.linalg.norm(plan[near] - A @ fit, axis=1)
        good = off <= OFF * max(float(np.median(off)) / 1.1774, 1e-9)  # the median of a length in plan is 1.18 sigma
        if np.count_nonzero(good) < 4:
            break
        near = near[good]
    smooth: FloatArray = fit[2]
    return smooth


@dataclass(frozen=True)
class CauseFit:
    """A cause fitted to some throws.

    Attributes
    ----------
    cause : Cause
        Which.
    x, sd : (k,) arrays
        Its numbers and their standard deviations.
    merit : float
        Squares of residuals and of moves of what is stated, in their sigmas.
    paths : mapping
        By throw: the fitted flight at the times that count, (m, 3) m, straight on below the ground.
    seen : mapping
        By throw: the plan (m, 2) m that the camera has of it there.
    rms : mapping
        By throw: root mean square distance in plan between what the camera sees of the flight and the track, m.
    touch_down : mapping
        By throw: distance in plan between the fitted flight's touch-down and the track's end, m.
    moves : mapping
        By throw: the largest move of a release condition, in its sigmas.
    wind : (3,) array
        Move of the wind in its sigmas.
    inputs : (p,) array
        Moves of all that is stated, in sigmas: the releases of the throws in turn, then the wind.
    """

    cause: Cause
    x: FloatArray
    sd: FloatArray
    merit: float
    paths: Mapping[str, FloatArray]
    seen: Mapping[str, FloatArray]
    rms: Mapping[str, float]
    touch_down: Mapping[str, float]
    moves: Mapping[str, float]
    wind: FloatArray
    inputs: FloatArray


def fit_cause(cause: Cause, throws: Mapping[str, Throw], start: CauseFit | None = None) -> CauseFit:
    """Fit one cause, the releases and the wind to throws: least squares, stated uncertainties as priors.

    The fit goes on from the releases and the wind of ``start``, a fit of the same throws; else from what is stated.
    """
    free, stated = len(cause.steps), OWN * len(throws) + WIND
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

    reach = np.hstack([np.tile([[-np.inf], [np.inf]], stated), cause.bounds / np.array(cause.steps)])
    begin = np.zeros(stated + free)
    if start is not None:
        begin[:stated] = start.inputs
    solved = least_squares(
        residuals, begin, derivatives, bounds=(reach[0], reach[1]), ftol=SETTLED, max_nfev=ITERATIONS
    )
    J = derivatives(solved.x)
    covariance = np.linalg.pinv(J.T @ J)
    sd = np.array(cause.steps) * np.sqrt(np.diag(covariance)[stated:])
    return _described(cause, throws, solved.x, sd, 2.0 * float(solved.cost))


def _described(cause: Cause, throws: Mapping[str, Throw], u: FloatArray, sd: FloatArray, merit: float) -> CauseFit:
    """Return what a fit found at ``u`` says."""
    free, stated = len(cause.steps), OWN * len(throws) + WIND
    x = np.array(cause.steps) * u[stated:]
    paths, seen, rms, landed, moves = {}, {}, {}, {}, {}
    for k, (name, throw) in enumerate(throws.items()):
        own = _inputs(u, k, free)
        world = cause.apply(_world(throw), x)
        path = paths[name] = positions(throw, world, own[None])[0]
        seen[name] = world.seen(path, throw.place)
        apart = seen[name] - throw.plan
        rms[name] = float(np.sqrt(np.mean(np.sum(apart**2, axis=1))))
        landed[name] = float(np.linalg.norm(world.seen(_landing(world, path), throw.place) - throw.plan[-1]))
        moves[name] = float(np.max(np.abs(own[:OWN])))
    wind = u[stated - WIND : stated]
    return CauseFit(cause, x, sd, merit, paths, seen, rms, landed, moves, wind, u[:stated])


def _landing(world: World, path: FloatArray) -> FloatArray:
    """Return where a path (m, 3) first crosses its ground, by the line through the two points beside that, (3,) m."""
    above = world.above(path)
    below = np.flatnonzero(above[1:] <= 0.0)
    k = int(below[0]) + 1 if below.size else above.size - 1
    fallen = above[k - 1] - above[k]
    landing: FloatArray = path[k] + (path[k] - path[k - 1]) * above[k] / (fallen if abs(fallen) > 1e-6 else 1e-6)
    return landing


def known(found: CauseFit) -> Cause:
    """Return a cause that has the size at which it was found, and is fitted no more."""
    return Cause(found.cause.name, (), lambda world, _: found.cause.apply(world, found.x))


@dataclass(frozen=True)
class CauseHeldOut:
    """A cause judged by throws that took no part.

    ``others`` are the fits to the rest by the throw left out; ``tried`` fits of that throw alone, its own release and
    the wind free as stated, with the cause as the others have it; ``plain`` the same without it.
    """

    together: CauseFit
    others: Mapping[str, CauseFit]
    tried: Mapping[str, CauseFit]
    plain: Mapping[str, CauseFit]

    @property
    def gains(self) -> dict[str, float]:
        """By how much the merit of each throw is better with the cause as the others have it than without."""
        return {name: self.plain[name].merit - one.merit for name, one in self.tried.items()}

    @property
    def left(self) -> dict[str, float]:
        """What is left along each track with the cause as the others have it, as a share of what is left without."""
        return {name: one.rms[name] / self.plain[name].rms[name] for name, one in self.tried.items()}

    @property
    def worsens(self) -> bool:
        """Whether what two throws say of it leaves more of the third than no cause does."""
        return any(left > 1.0 + SAME for left in self.left.values())

    @property
    def helps(self) -> bool:
        """Whether it leaves little of each throw."""
        return all(left <= LITTLE for left in self.left.values())


def held_out(cause: Cause, throws: Mapping[str, Throw], plain: Mapping[tuple[str, ...], CauseFit]) -> CauseHeldOut:
    """Fit a cause to all throws, and to all but each; try that on the one left out.

    ``plain`` are the fits `without_cause`, from which these go on.
    """
    rest = {name: {k: one for k, one in throws.items() if k != name} for name in throws}
    alone = {name: plain[name,] for name in throws}
    if not cause.steps:
        others = {name: plain[tuple(rest[name])] for name in throws}
        return CauseHeldOut(plain[tuple(throws)], others, alone, alone)
    others = {name: fit_cause(cause, rest[name], plain[tuple(rest[name])]) for name in throws}
    tried = {name: fit_cause(known(others[name]), {name: one}, alone[name]) for name, one in throws.items()}
    return CauseHeldOut(fit_cause(cause, throws, plain[tuple(throws)]), others, tried, alone)


def without_cause(throws: Mapping[str, Throw]) -> dict[tuple[str, ...], CauseFit]:
    """Fit releases and wind alone, with no cause, to all throws, to all but each and to each, by their names."""
    sets = [tuple(throws), *(tuple(k for k in throws if k != name) for name in throws), *((name,) for name in throws)]
    return {names: fit_cause(NONE, {name: throws[name] for name in names}) for names in sets}


# ------------------------------------------------------------------------------------------------------- pairs


@dataclass(frozen=True)
class Likely:
    """Two causes, and what algebra about the fit without a cause expects them to leave of each track held out, m."""

    causes: tuple[Cause, Cause]
    left: Mapping[str, float]


def likely_pairs(causes: Sequence[Cause], throws: Mapping[str, Throw], none: CauseFit) -> list[Likely]:
    """Return every two causes with what they leave of each throw held out, to first order, the best worst first.

    ``none`` is the fit of all throws without a cause.
    """
    blocks = {}
    for k, (name, throw) in enumerate(throws.items()):
        own = np.concatenate([none.inputs[OWN * k : OWN * (k + 1)], none.inputs[-WIND:]])
        e, J = _of_throw(NONE, throw, own, np.zeros(0))
        columns = [_of_throw(one, throw, own, np.zeros(len(one.steps)))[1][:, INPUTS:] for one in causes]
        blocks[name] = _Block(own, e, J, tuple(columns))
    found = [
        Likely((causes[a], causes[b]), left)
        for a, b in combinations(range(len(causes)), 2)
        if (left := _left_by(blocks, (a, b), np.hstack([causes[a].bounds, causes[b].bounds]), causes)) is not None
    ]
    return sorted(found, key=lambda one: max(one.left.values()))


@dataclass(frozen=True)
class _Block:
    """One throw about a fit: its inputs (12,), residuals, their slopes by the inputs and by each cause."""

    inputs: FloatArray
    e: FloatArray
    J: FloatArray
    columns: tuple[FloatArray, ...]


def _left_by(
    blocks: Mapping[str, _Block], chosen: tuple[int, int], reach: FloatArray, causes: Sequence[Cause]
) -> dict[str, float] | None:
    """Return what two causes leave of each throw held out, m; None where algebra asks for what makes no sense."""
    steps = np.concatenate([causes[k].steps for k in chosen])
    left = {}
    for name, block in blocks.items():
        x = _shared([one for other, one in blocks.items() if other != name], chosen)
        if np.any(steps * x < reach[0]) or np.any(steps * x > reach[1]):
            return None
        e = block.e - np.hstack([block.columns[k] for k in chosen]) @ x
        A, b = np.vstack([block.J, np.eye(INPUTS)]), np.append(e, -block.inputs)
        rest = e - block.J @ np.linalg.lstsq(A, b)[0]
        left[name] = LEFT * float(np.sqrt(np.sum(rest[:-1] ** 2) / ((rest.size - 1) // 2)))
    return left


def _shared(blocks: Sequence[_Block], chosen: tuple[int, int]) -> FloatArray:
    """Return the numbers (k,) in steps of causes that throws share, releases and wind free within what is stated."""
    n, width = len(blocks), sum(blocks[0].columns[k].shape[1] for k in chosen)
    rows, right = [], []
    for place, one in enumerate(blocks):
        row = np.zeros((one.e.size, OWN * n + WIND + width))
        row[:, OWN * place : OWN * (place + 1)] = one.J[:, :OWN]
        row[:, OWN * n : OWN * n + WIND] = one.J[:, OWN:]
        row[:, OWN * n + WIND :] = np.hstack([one.columns[k] for k in chosen])
        rows.append(row)
        right.append(one.e)
    stated = np.concatenate([*(one.inputs[:OWN] for one in blocks), blocks[0].inputs[OWN:]])
    rows.append(np.eye(stated.size, stated.size + width))
    solved: FloatArray = np.linalg.lstsq(np.vstack(rows), np.concatenate([*right, -stated]))[0]
    return solved[stated.size :]


# ------------------------------------------------------------------------------------------------------ flights


def _world(throw: Throw) -> World:
    assert throw.recording.disc is not None
    return World(throw.recording.disc)


def _inputs(u: FloatArray, throw: int, free: int) -> FloatArray:
    """Return the inputs (12,) of a throw in sigmas, the shared wind last; behind it ``free`` sizes of a cause."""
    own = u[OWN * throw : OWN * (throw + 1)]
    return np.concatenate((own, u[u.size - free - WIND : u.size - free]))


def _wind_sigma(environment: Environment) -> FloatArray:
    return np.broadcast_to(np.asarray(environment.sigma.get("wind_ned_m_s", 0.0), dtype=float), 3)


def _linearised(cause: Cause, throws: Mapping[str, Throw], u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return residuals (m,) in sigmas, and the derivatives (m, p) of what the model says."""
    residuals, rows, free = [], [], len(cause.steps)
    x = np.array(cause.steps) * u[u.size - free :]
    for k, throw in enumerate(throws.values()):
        left, slopes = _of_throw(cause, throw, _inputs(u, k, free), x)
        J = np.zeros((left.size, u.size))
        J[:, [*range(OWN * k, OWN * (k + 1)), *range(OWN * len(throws), u.size)]] = slopes
        residuals.append(left)
        rows.append(J)
    return np.concatenate(residuals), np.concatenate(rows)


def _of_throw(cause: Cause, throw: Throw, z: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return residuals (m,) of a throw in sigmas and the slopes (m, 12 + k) of what a cause of size x says.

    The last residual is the height of the track's end.
    """
    world = cause.apply(_world(throw), x)
    moved = np.vstack((z, z + DIFFERENCE * np.eye(INPUTS)))
    said = [_said(throw, world, path) for path in positions(throw, world, moved)]
    slopes = [(one - said[0]) / DIFFERENCE for one in said[1:]]
    for place, step in enumerate(cause.steps):
        other = x.copy()
        other[place] += step
        further = cause.apply(_world(throw), other)
        slopes.append(_said(throw, further, positions(throw, further, z[None])[0]) - said[0])
    measured = np.append(throw.plan.ravel() / LEFT, 0.0)
    return measured - said[0], np.stack(slopes, axis=1)


def _said(throw: Throw, world: World, path: FloatArray) -> FloatArray:
    """Return what a world says of a path (m, 3): its plan, and the height of its end, in sigmas."""
    return np.append(world.seen(path, throw.place).ravel() / LEFT, world.above(path)[-1] / GROUND)


def positions(throw: Throw, world: World, z: FloatArray) -> FloatArray:
    """Return positions (n, m, 3) at the times that count, of flights with inputs z (n, 12); straight on below 0 m."""
    recording = throw.recording
    environment = recording.environment
    place = world.true(throw.place, throw.measured.height)
    states, flats = drawn(
        throw.measured, world.disc, environment, place, _wind_sigma(environment), z + world.bias, world.effects
    )
    t = world.instants(recording.need("track").t[throw.kept])
    flown = predict_many(world.disc, environment, states, parameters=flats, times=t, tolerance=TOLERANCE)
    beyond = np.maximum(t[None] - flown.end[:, None], 0.0)[:, :, None]
    after = flown.state[:, None, :3] + flown.state[:, None, 3:6] * beyond
    return np.where(beyond > 0.0, after, flown.track[:, :, :3])
