"""Laws on the motion: terms of force and moment, screened by score tests and fitted by output error."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.law import MOTION_TARGETS, WIND_TARGETS
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, noise_of, scored
from discsim.validation.diagnosis.candidates.evidence import BOUNDS
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.screening import NormalEquations, ScoreTest, column_of
from discsim.validation.diagnosis.candidates.to_stated import to_baseline
from discsim.validation.diagnosis.first_trajectory import beginning
from discsim.validation.identification.gauss_newton import Fit, linearised_columns, mapped, refit
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.normal_equations import reduce
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import Plant
from discsim.validation.identification.plants.law_terms import Term
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import Trajectory, resegmented

__all__ = ["PLACE", "candidate_laws", "fitted_law"]

#: names of the parameters of a place
PLACE = ("north", "east", "size")


#: half the difference in an exponent
_POWER_STEP = 1e-3


#: an ordinary wind about a place, m/s, as a light or gentle breeze (Beaufort 2 and 3 are 1.6 to 5.4): without it one
#: whose outermost skirt alone meets a path, at tens of m/s, passes for what a throw starts with
_WIND_SIGMA = 3.0


#: an exponent is sought within this of where it starts
_POWER_SIGMA = 3.0


def state_of(trajectory: Trajectory, values: Mapping[tuple[str, str], float]) -> dict[str, FloatArray]:
    """Return the symbols of a law, each (k,), in the middle of every segment."""
    middle = 0.5 * (trajectory.nodes[1:] + trajectory.nodes[:-1])
    there = resegmented(trajectory, values, np.append(middle, trajectory.nodes[-1])).states
    return trajectory.plant.laws.symbols(trajectory.recording, middle, there, values)


def reference_of(states: Sequence[Mapping[str, FloatArray]]) -> dict[str, float]:
    """Return an ordinary size of each symbol: its root mean square over all recordings."""
    sizes = {}
    for symbol in states[0]:
        size = float(np.sqrt(np.mean(np.concatenate([state[symbol] for state in states]) ** 2)))
        sizes[symbol] = float(f"{size:.2g}") if size > 0 else 1.0
    return sizes


def _constant(target: str, plant: Plant, term: int = 0) -> Column:
    """Return the column of a constant force or moment."""
    return Column(
        "law",
        f"{term}.coefficient",
        plant.laws.step(target),
        ((f"{term}.target", float(MOTION_TARGETS.index(target))),),
    )


def _wave(term: Term, phase: float, plant: Plant, place: int) -> Column:
    """Return the column of what repeats in a turn, at a phase."""
    constant = _constant(term.target, plant, place)
    return constant._replace(given=(*constant.given, (f"{place}.order", float(term.order)), (f"{place}.phase", phase)))


def _weighed(linear: Linear, nodes: FloatArray, first: int, targets: Sequence[int], weights: FloatArray) -> Linear:
    """Return a linearisation with terms for its last columns, made of those of constants.

    ``nodes`` (k + 1,) bound the segments, ``first`` is the place of the first constant among the shared columns,
    ``targets`` (m,) which of them a term weighs, ``weights`` (m, k) its value in each segment. A reading that hangs on
    several segments takes that of its own time.
    """
    local, (k, d) = linear.unknowns, linear.sensitivities.shape[:2]
    places = [d + first + j for j in targets]
    own = linear.own[:, places] * weights[:, linear.segment].T
    passes = linear.transitions[:, :, places] * weights.T[: k - 1, None, :]
    several = np.clip(np.searchsorted(nodes, linear.t[linear.segment < 0], side="right") - 1, 0, k - 1)
    whole = linear.whole[:, [local + first + j for j in targets]] * weights[:, several].T if linear.whole.size else None
    moves = np.zeros((k, d, len(targets)))
    for i in range(k - 1):
        moves[i + 1] = linear.transitions[i, :, :d] @ moves[i] + passes[i]
    return replace(
        linear,
        own=np.hstack([linear.own[:, : d + first], own]),
        whole=linear.whole if whole is None else np.hstack([linear.whole[:, : local + first], whole]),
        sensitivities=np.concatenate([linear.sensitivities[:, :, : local + first], moves], axis=2),
        transitions=np.concatenate([linear.transitions[:, :, : d + first], passes], axis=2),
    )


def normal_equations_of_terms(
    fit: Fit, terms: Sequence[Term], states: Sequence[Mapping[str, FloatArray]], at: Mapping[str, float]
) -> NormalEquations:
    """Return the board of a fit's own parameters and terms, its segments jumping as they may.

    What repeats in a turn is too quick to be weighed by segments: it has two columns, of its cosine and its sine, which
    come before those of all others.
    """
    plant, defects = fit.plant, fit.defects
    slow = [term for term in terms if not term.order]
    targets = list(dict.fromkeys(term.target for term in slow))
    place_of = [targets.index(term.target) for term in slow]
    taken = len({int(q.name.partition(".")[0]) for q in fit.parameters if q.group == "law"})
    own = [column_of(q) for q in fit.parameters]
    waves = [_wave(term, phase, plant, taken) for term in terms if term.order for phase in (0.0, -0.5 * np.pi)]
    bare = linearised_columns(fit, [*own, *waves, *(_constant(target, plant, taken) for target in targets)])
    first = len(own) + len(waves)
    linears = [
        _weighed(linear, trajectory.nodes, first, place_of, np.array([term.weight(state, at) for term in slow]))
        for linear, trajectory, state in zip(bare, fit.trajectories, states, strict=True)
    ]
    reduced = mapped(
        lambda linear, trajectory: reduce(linear, trajectory, fit.noise, defects), linears, fit.trajectories
    )
    columns = (*own, *(Column("law", f"{j}.candidate", 1.0) for j in range(len(waves) + len(slow))))
    grams = to_baseline(np.stack([r.gram for r in reduced]), fit)
    return NormalEquations(columns, grams, {column: j for j, column in enumerate(columns)})


def _asked(
    equations: NormalEquations, own: Sequence[Parameter], terms: Sequence[Term]
) -> Iterator[tuple[float, float, Term]]:
    """Yield what each term would gain in chi2, its coefficient, and the term, with its phase where it repeats."""
    taken = [(column_of(q), q) for q in own]
    base = equations.solve(taken).chi2
    quick = 2 * sum(term.order > 0 for term in terms)
    places = {True: iter(range(quick)), False: iter(range(quick, quick + len(terms)))}
    for term in terms:
        mine = [next(places[term.order > 0]) for _ in range(2 if term.order else 1)]
        free = [Column("law", f"{j}.candidate", 1.0) for j in mine]
        sigma = _WIND_SIGMA if term.target in WIND_TARGETS else np.inf
        answer: ScoreTest = equations.solve([*taken, *((c, Parameter("law", c.name, 0.0, 1.0, sigma)) for c in free)])
        if term.order:
            a, b = (float(x) for x in answer.value[-2:])
            yield base - answer.chi2, float(np.hypot(a, b)), replace(term, phase=float(np.arctan2(-b, a)))
        else:
            yield base - answer.chi2, float(answer.value[-1]), term


def _parameters(
    terms: Sequence[Term], coefficients: Sequence[float], plant: Plant
) -> tuple[tuple[Parameter, ...], FloatArray]:
    """Return the parameters of terms for a fit and where they start, (p,)."""
    found, start = [], []
    for i, (term, coefficient) in enumerate(zip(terms, coefficients, strict=True)):
        size = max(abs(coefficient), 1e-3 * plant.laws.step(term.target))
        found.append(Parameter("law", f"{i}.coefficient", 0.0, 0.02 * size, 1e4 * size))
        start.append(coefficient)
        for symbol, n in term.powers:
            found.append(Parameter("law", f"{i}.power_{symbol}", n, _POWER_STEP, _POWER_SIGMA))
            start.append(n)
        if term.decay:
            found.append(Parameter("law", f"{i}.decay", term.decay, 0.01 * term.decay, 2.0 * term.decay))
            start.append(term.decay)
        if term.order:
            found.append(Parameter("law", f"{i}.phase", term.phase, 1e-3, np.pi))
            start.append(term.phase)
        if term.place is not None:
            width = term.place[2]
            for name, value in zip(PLACE, term.place, strict=True):
                found.append(Parameter("law", f"{i}.{name}", value, 0.01 * width, 2.0 * width))
                start.append(value)
    return tuple(found), np.array(start)


def _fixed(terms: Sequence[Term], at: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """Return the numbers of terms that a fit leaves alone."""
    fixed = {}
    for i, term in enumerate(terms):
        fixed["law", f"{i}.target"] = float(MOTION_TARGETS.index(term.target))
        fixed |= {("law", f"{i}.odd_{symbol}"): 1.0 for symbol in term.odd}
        fixed |= {("law", f"{i}.at_{symbol}"): at[symbol] for symbol, _ in term.powers}
        if term.order:
            fixed["law", f"{i}.order"] = float(term.order)
    return fixed


def _with_places_held(fit: Fit, iterations: int) -> Fit:
    """Return a fit where it comes to while the places that its terms are about are held; without such it stays.

    While segments do not hang together yet, no step that moves the place of a wind at once makes the fit better.
    """
    held = np.array([q.group == "law" and q.name.endswith(PLACE) for q in fit.parameters])
    if not np.any(held):
        return fit
    places = {q.key: float(v) for q, v, h in zip(fit.parameters, fit.at, held, strict=True) if h}
    free = tuple(q for q, h in zip(fit.parameters, held, strict=True) if not h)
    there = refit(
        replace(fit, parameters=free, at=fit.at[~held], fixed={**fit.fixed, **places}),
        iterations=iterations,
        bounds=BOUNDS,
    )
    at = fit.at.copy()
    at[~held] = there.at
    return replace(fit, trajectories=there.trajectories, at=at)


#: the beginning to which what repeats in a turn is fitted first, s: some turns of a rig; each next one is twice as long
_FIRST_LOOK = 2.5


def _longer_and_longer(fit: Fit, iterations: int, bounds: Mapping[tuple[str, str], tuple[float, float]]) -> Fit:
    """Return a fit of a rig where fits to longer and longer beginnings come to, each carried on by what it found.

    A torque that hangs on the rig's angle has neighbouring motions part from segment to segment as at random while
    these do not hang together yet, and no step serves for long; along a motion of its own they part slowly.
    """
    longest = max(float(one.nodes[-1]) for one in fit.trajectories)
    doublings = max(int(np.ceil(np.log2(longest / _FIRST_LOOK))), 0)

    def begun(look: float, known: Fit | None) -> Fit:
        some = [beginning(one, look) if look < one.nodes[-1] else one for one in fit.trajectories]
        if known is None:
            return replace(fit, trajectories=tuple(some))
        pairs = enumerate(zip(known.trajectories, some, strict=True))
        carried = tuple(_carried_on(before, known.values(i), one) for i, (before, one) in pairs)
        return replace(fit, trajectories=carried, at=known.at)

    known: Fit | None = None
    for look in (_FIRST_LOOK * 2.0 ** np.arange(doublings)).tolist():
        known = refit(begun(look, known), iterations=iterations, bounds=bounds)
    return begun(longest, known)


def _carried_on(before: Trajectory, values: Mapping[tuple[str, str], float], longer: Trajectory) -> Trajectory:
    """Return a longer trajectory of a recording along the motion that a shorter one leads to."""
    known = replace(longer, nodes=before.nodes, states=before.states)
    return replace(longer, states=resegmented(known, values, longer.nodes).states)


def fitted_law(
    start: Fit,
    own: Sequence[Parameter],
    own_at: FloatArray,
    terms: Sequence[Term],
    coefficients: Sequence[float],
    at: Mapping[str, float],
    *,
    iterations: int = 8,
) -> ContinuousFit:
    """Fit terms and own parameters by output error, segments hanging together."""
    plant = start.plant
    parameters, first = _parameters(terms, coefficients, plant)
    fit = Fit(
        start.trajectories,
        (*own, *parameters),
        np.concatenate([own_at, first]),
        plant.sizes.continuous,
        start.noise,
        _fixed(terms, at),
    )
    bounds = dict(BOUNDS)
    bounds |= {q.key: (-4.0, 8.0) for q in parameters if ".power_" in q.name}
    bounds |= {q.key: (0.01 * q.stated, 50.0 * q.stated) for q in parameters if q.name.endswith(".decay")}
    bounds |= {q.key: (0.1 * q.stated, 10.0 * q.stated) for q in parameters if q.name.endswith(".size")}
    if not plant.airborne and any(term.order for term in terms):
        fit = _longer_and_longer(fit, iterations, bounds)
    fit = refit(_with_places_held(fit, iterations), iterations=iterations, bounds=bounds)
    for _ in range(2):
        fit = refit(replace(fit, noise=noise_of(fit)), iterations=3, bounds=bounds)
    return scored(Hypothesis(), fit)


def candidate_laws(
    fit: Fit, own: Sequence[Parameter], terms: Sequence[Term], at: Mapping[str, float]
) -> list[tuple[float, float, Term]]:
    """Return gain, coefficient and term, best first, the best few of each target."""
    states = [state_of(trajectory, fit.values(i)) for i, trajectory in enumerate(fit.trajectories)]
    equations = normal_equations_of_terms(fit, terms, states, at)
    return sorted(_asked(equations, own, terms), key=lambda item: -item[0])
