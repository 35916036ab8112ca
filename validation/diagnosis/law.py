"""None of these: the force, moment or sensor term that no effect of the catalogue accounts for, as a formula.

One linearisation with a constant force and moment in each direction answers, piece by piece, what any function of the
state would explain: its value in a piece weighs that piece's part of the column. The best few are then fitted by output
error, their exponents free, and believed only where recordings that took no part are explained by them, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import exp, log

import numpy as np

from discsim.arrays import FloatArray
from discsim.law import WRENCH_TARGETS
from discsim.recording import Recording
from validation.diagnosis.answer import Law, ParameterValue
from validation.diagnosis.board import Answer, Board, column_of
from validation.diagnosis.fitting import (
    Fit,
    Parameter,
    linearised,
    linearised_columns,
    local_step,
    mapped,
    reduce,
    refit,
    shared_step,
)
from validation.diagnosis.noise import GroupNoise, NoiseModel, log_likelihood
from validation.diagnosis.readings import to_body
from validation.diagnosis.relaxed import NO_JUMPS
from validation.diagnosis.selection import ENTRY, PER_PARAMETER, Hypothesis, Tied, noise_of, scored, tied_fit
from validation.diagnosis.trajectory_pieces import Chain, Column, Linear, recut

__all__ = ["FoundLaw", "Term", "find_law"]

#: exponents that are tried first; the fit leaves them
_RIG_POWERS = (-1.0, 0.0, 0.5, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)
_AIR_POWERS = {"V": (0.0, 1.0, 2.0, 3.0), "r": (0.0, 1.0, 2.0), "alpha": (0.0, 1.0, 2.0)}
#: half the differences in force and moment, N and N m; in an exponent
_FORCE_STEP, _MOMENT_STEP, _RIG_STEP, _POWER_STEP = 2e-2, 2e-4, 2e-5, 1e-3
#: an exponent is sought within this of where it starts, and one less certain than the second stays where it starts
_POWER_SIGMA, _UNCERTAIN = 3.0, 0.5
#: candidates that are fitted, terms of a law at most, sums of exponents beyond which no physics goes
_FITTED, _TERMS, _HIGHEST = 3, 2, 5.0
#: share of the excess that a law must explain, and twice the log likelihood it must gain on held-out recordings
_SHARE, _HELD_OUT = 0.5, 12.0


@dataclass(frozen=True)
class Term:
    """One product of powers about motion: ``target = c |x|^n ...``, keeping the signs of the symbols in ``odd``.

    ``powers`` are pairs of symbol and exponent; ``decay`` (1/s) makes it die away in time.
    """

    target: str
    powers: tuple[tuple[str, float], ...] = ()
    odd: tuple[str, ...] = ()
    decay: float = 0.0

    def weight(self, state: Mapping[str, FloatArray], at: Mapping[str, float]) -> FloatArray:
        """Return the term at states (k,) for a coefficient of one, symbols taken in units of ``at``."""
        value = np.exp(-self.decay * state["t"])
        for symbol, power in self.powers:
            value = value * (np.abs(state[symbol]) / at[symbol]) ** power
        for symbol in self.odd:
            value = value * np.sign(state[symbol])
        return np.asarray(value)


@dataclass(frozen=True)
class FoundLaw:
    """A law that holds on recordings that took no part.

    ``gain`` is twice the log likelihood gained over the fit without any effect, ``heldout`` the log likelihood gained
    by recording while it took no part, ``share`` the part of the excess of chi2 that it explains. ``reference`` says
    the same law in another way: its value at an ordinary state, which is known better than its coefficients, whose
    errors hang together with those of the exponents.
    """

    law: Law
    gain: float
    heldout: Mapping[int, float]
    share: float
    reference: str
    tied: Tied
    also: tuple[Law, ...] = field(default_factory=tuple)


# ------------------------------------------------------------------------------------------------- screening


def state_of(chain: Chain, values: Mapping[tuple[str, str], float]) -> dict[str, FloatArray]:
    """Return the symbols of a law, each (k,), in the middle of every piece."""
    middle = 0.5 * (chain.edges[1:] + chain.edges[:-1])
    there = recut(chain, values, np.append(middle, chain.edges[-1])).states
    zero = np.zeros(middle.size)
    if chain.recording.plant != "flight":
        return {"t": middle, "r": there[:, 1], "h": zero, "V": zero, "alpha": zero, "p_H": zero, "q_H": zero}
    rows = np.zeros((middle.size, 19))
    rows[:, 9:13] = there[:, 6:10]
    wind = np.array(chain.recording.environment.wind, dtype=float)
    wind[:2] += [values.get(("air.wind", f"w_{way}_m_s"), 0.0) for way in ("north", "east")]
    u, v, w = to_body(rows, there[:, 3:6] - wind).T
    return {
        "t": middle,
        "h": np.maximum(-there[:, 2], 0.02),
        "V": np.sqrt(u * u + v * v + w * w),
        "alpha": np.arctan2(w, np.hypot(u, v)),
        "r": there[:, 12],
    }


def reference_of(states: Sequence[Mapping[str, FloatArray]]) -> dict[str, float]:
    """Return an ordinary size of each symbol: its root mean square over all recordings."""
    sizes = {}
    for symbol in states[0]:
        size = float(np.sqrt(np.mean(np.concatenate([state[symbol] for state in states]) ** 2)))
        sizes[symbol] = float(f"{size:.2g}") if size > 0 else 1.0
    return sizes


def library(plant: str) -> list[Term]:
    """Return the terms about motion that are asked for first."""
    if plant == "spin_down":
        terms = [Term("moment_z_N_m", (("r", n),) if n else (), ("r",)) for n in _RIG_POWERS]
        # friction that changes with time, as a bearing warms
        return terms + [Term("moment_z_N_m", (("r", 1.0),), ("r",), 1.0 / tau) for tau in (2.0, 4.0, 8.0, 16.0)]
    if plant != "flight":
        return []
    terms = []
    for target in WRENCH_TARGETS:
        for powers in product(*_AIR_POWERS.values()):
            named = tuple((symbol, n) for symbol, n in zip(_AIR_POWERS, powers, strict=True) if n)
            odd = tuple(symbol for symbol, n in named if symbol != "V" and n == 1.0)
            if sum(powers) <= _HIGHEST:
                terms.append(Term(target, named, odd))
        if target == "moment_z_N_m":
            terms += [Term(target, (("r", n),), ("r",)) for n in (1.5, 2.0, 2.5, 3.0, 4.0)]
    return terms


def _step(target: str, plant: str) -> float:
    if plant != "flight":
        return _RIG_STEP
    return _FORCE_STEP if target.endswith("_N") else _MOMENT_STEP


def _constant(target: str, plant: str, term: int = 0) -> Column:
    """Return the column of a constant force or moment."""
    return Column(
        "law",
        f"{term}.coefficient",
        _step(target, plant),
        ((f"{term}.target", float(WRENCH_TARGETS.index(target))),),
    )


def _weighed(linear: Linear, first: int, targets: Sequence[int], weights: FloatArray) -> Linear:
    """Return a linearisation with terms for its last columns, made of those of constants.

    ``first`` is the place of the first constant among the shared columns, ``targets`` (m,) which of them a term
    weighs, ``weights`` (m, k) its value in each piece.
    """
    local, (k, d) = linear.unknowns, linear.moves.shape[:2]
    own = linear.own[:, [d + first + j for j in targets]] * weights[:, linear.piece].T
    moves = np.zeros((k, d, len(targets)))
    for i in range(k - 1):
        before, after = linear.moves[i], linear.moves[i + 1]
        Phi = np.linalg.solve(before[:, :d].T, after[:, :d].T).T
        constants = after[:, local + first :] - Phi @ before[:, local + first :]
        moves[i + 1] = Phi @ moves[i] + constants[:, targets] * weights[:, i]
    return replace(
        linear,
        own=np.hstack([linear.own[:, : d + first], own]),
        moves=np.concatenate([linear.moves[:, :, : local + first], moves], axis=2),
    )


def board_of_terms(
    fit: Fit, terms: Sequence[Term], states: Sequence[Mapping[str, FloatArray]], at: Mapping[str, float]
) -> Board:
    """Return the board of a fit's own parameters and terms, pieces hanging together."""
    plant = fit.chains[0].recording.plant
    targets = list(dict.fromkeys(term.target for term in terms))
    place_of = [targets.index(term.target) for term in terms]
    taken = len({int(q.name.partition(".")[0]) for q in fit.parameters if q.group == "law"})
    own = [column_of(q) for q in fit.parameters]
    jumps = NO_JUMPS[plant]
    bare = linearised_columns(
        replace(fit, jumps=jumps), [*own, *(_constant(target, plant, taken) for target in targets)]
    )
    linears = [
        _weighed(linear, len(own), place_of, np.array([term.weight(state, at) for term in terms]))
        for linear, state in zip(bare, states, strict=True)
    ]
    reduced = mapped(lambda linear, chain: reduce(linear, chain, fit.noise, jumps), linears, fit.chains)
    columns = (*own, *(Column("law", f"{j}.candidate", 1.0) for j in range(len(terms))))
    grams = np.stack([r.gram for r in reduced])
    for i, G in enumerate(grams):
        away = np.zeros(len(columns))
        for j, (q, number) in enumerate(zip(fit.parameters, fit.at, strict=True)):
            if q.acts_in(i):
                away[j] = number - q.stated
        e, chi2 = G[:-1, -1].copy(), float(G[-1, -1])
        G[-1, -1] = chi2 + float(2.0 * away @ e + away @ G[:-1, :-1] @ away)
        G[:-1, -1] = G[-1, :-1] = e + G[:-1, :-1] @ away
    return Board(columns, grams, {column: j for j, column in enumerate(columns)}, tuple(linears), tuple(reduced))


def _asked(board: Board, own: Sequence[Parameter], terms: int) -> Iterator[tuple[float, float]]:
    """Yield what each term would gain in chi2, and its coefficient."""
    taken = [(column_of(q), q) for q in own]
    base = board.ask(taken).chi2
    for j in range(terms):
        column = Column("law", f"{j}.candidate", 1.0)
        answer: Answer = board.ask([*taken, (column, Parameter("law", column.name, 0.0, 1.0))])
        yield base - answer.chi2, float(answer.value[-1])


# --------------------------------------------------------------------------------------------------- fitting


def _parameters(
    terms: Sequence[Term], coefficients: Sequence[float], plant: str
) -> tuple[tuple[Parameter, ...], FloatArray]:
    """Return the parameters of terms for a fit and where they start, (p,)."""
    found, start = [], []
    for i, (term, coefficient) in enumerate(zip(terms, coefficients, strict=True)):
        size = max(abs(coefficient), 1e-3 * _step(term.target, plant))
        found.append(Parameter("law", f"{i}.coefficient", 0.0, 0.02 * size, 1e4 * size))
        start.append(coefficient)
        for symbol, n in term.powers:
            found.append(Parameter("law", f"{i}.power_{symbol}", n, _POWER_STEP, _POWER_SIGMA))
            start.append(n)
        if term.decay:
            found.append(Parameter("law", f"{i}.decay", term.decay, 0.01 * term.decay, 2.0 * term.decay))
            start.append(term.decay)
    return tuple(found), np.array(start)


def _fixed(terms: Sequence[Term], at: Mapping[str, float]) -> dict[tuple[str, str], float]:
    """Return the numbers of terms that a fit leaves alone."""
    fixed = {}
    for i, term in enumerate(terms):
        fixed["law", f"{i}.target"] = float(WRENCH_TARGETS.index(term.target))
        fixed |= {("law", f"{i}.odd_{symbol}"): 1.0 for symbol in term.odd}
        fixed |= {("law", f"{i}.at_{symbol}"): at[symbol] for symbol, _ in term.powers}
    return fixed


def _fitted(
    start: Fit,
    own: Sequence[Parameter],
    own_at: FloatArray,
    terms: Sequence[Term],
    coefficients: Sequence[float],
    at: Mapping[str, float],
    *,
    iterations: int = 10,
) -> Tied:
    """Fit terms and own parameters by output error, pieces hanging together."""
    plant = start.chains[0].recording.plant
    parameters, first = _parameters(terms, coefficients, plant)
    fit = Fit(
        start.chains,
        (*own, *parameters),
        np.concatenate([own_at, first]),
        NO_JUMPS[plant],
        start.noise,
        _fixed(terms, at),
    )
    bounds = {q.key: (-4.0, 8.0) for q in parameters if ".power_" in q.name}
    bounds |= {q.key: (0.01 * q.stated, 50.0 * q.stated) for q in parameters if q.name.endswith(".decay")}
    fit = refit(fit, iterations=iterations, bounds=bounds)
    for _ in range(2):
        fit = refit(replace(fit, noise=noise_of(fit)), iterations=3, bounds=bounds)
    return scored(Hypothesis(), fit)


def _held_out(before: Fit, after: Fit) -> dict[int, float]:
    """Return the log likelihood gained by each recording while it took no part in either fit.

    The shared parameters are those of the other recordings, by one step of the fit without it; the recording's own
    unknowns follow.
    """
    count = len(before.chains)
    if count < 2:
        return {}
    sides = []
    for fit in (before, after):
        linears = fit.linears or linearised(fit)
        reduced = mapped(lambda linear, chain, f=fit: reduce(linear, chain, f.noise, f.jumps), linears, fit.chains)
        levels = []
        for i in range(count):
            others = np.sum([r.gram for j, r in enumerate(reduced) if j != i], axis=0)
            step, _, _ = shared_step(others, fit.parameters, fit.at)
            acting = np.array([q.acts_in(i) for q in fit.parameters], dtype=bool)
            step = np.where(acting, step, 0.0)
            left = linears[i].after(local_step(reduced[i], step), step)
            levels.append(log_likelihood(linears[i], fit.noise, left))
        sides.append(levels)
    return {i: 0.5 * (sides[0][i] - sides[1][i]) for i in range(count)}


# --------------------------------------------------------------------------------------------------- a formula


def _factor(symbol: str, power: str) -> str:
    return f"|{symbol}|^{power}" if symbol != "V" else f"V^{power}"


def _as_law(terms: Sequence[Term], fit: Fit, at: Mapping[str, float], heldout: float | None) -> tuple[Law, str]:
    """Return a fit's terms as a law of plain SI coefficients, and as values at the reference state.

    The coefficient of |x|^n is that at x = 1, far from where a disc ever is; its standard deviation holds the
    exponent's share, ln(x / 1) times its own.
    """
    place = {q.name: j for j, q in enumerate(fit.parameters) if q.group == "law"}
    C = fit.covariance
    coefficients, parts, notes = {}, [], []
    for i, term in enumerate(terms):
        mark = "" if len(terms) == 1 else str(i + 1)
        j = place[f"{i}.coefficient"]
        c = float(fit.at[j])
        row = np.zeros(len(fit.parameters))
        row[j] = 1.0 / c if c else 0.0
        logarithm, factors, where = 0.0, [], []
        for symbol, n in term.powers:
            name = f"{i}.power_{symbol}"
            own = "n" if len(term.powers) == 1 else f"n_{symbol}"
            if name in place:
                power = float(fit.at[place[name]])
                row[place[name]] -= log(at[symbol])
                coefficients[own + mark] = ParameterValue(power, float(np.sqrt(C[place[name], place[name]])))
                factors.append(_factor(symbol, own + mark))
            else:
                power = n
                factors.append(_factor(symbol, f"{n:g}"))
            logarithm -= power * log(at[symbol])
            where.append(f"|{symbol}| = {at[symbol]:g}")
        factors += [f"sign({symbol})" for symbol in term.odd]
        if term.decay:
            name = f"{i}.decay"
            decay = float(fit.at[place[name]])
            sd = float(np.sqrt(C[place[name], place[name]]))
            coefficients["tau" + mark] = ParameterValue(1.0 / decay, sd / decay**2)
            factors.append(f"exp(-t/tau{mark})")
        scale = exp(logarithm)
        sd = abs(c) * scale * float(np.sqrt(max(float(row @ C @ row), 0.0)))
        coefficients["c" + mark] = ParameterValue(c * scale, sd)
        parts.append(" * ".join(["c" + mark, *factors]))
        notes.append(
            f"{c:.4g} ± {float(np.sqrt(C[j, j])):.2g} {'N' if term.target.endswith('_N') else 'N m'}"
            + (f" at {', '.join(where)}" if where else "")
        )
    return Law(" + ".join(parts), terms[0].target, coefficients, heldout), "; ".join(notes)


# ----------------------------------------------------------------------------------------------------- finding


def _own_at(loose: Fit, own: Sequence[Parameter]) -> FloatArray:
    """Return where own parameters start: those that stand for a recording alone, where the loose fit has them."""
    known = {(q.key, q.recordings): number for q, number in zip(loose.parameters, loose.at, strict=True)}
    return np.array([known.get((q.key, q.recordings), q.stated) if q.recordings else q.stated for q in own])


def _white(noise: NoiseModel) -> dict[str, GroupNoise]:
    return {group: GroupNoise(item.sd, min(item.correlation, 0.9)) for group, item in noise.items()}


def _candidates(
    fit: Fit, own: Sequence[Parameter], terms: Sequence[Term], at: Mapping[str, float]
) -> list[tuple[float, float, Term]]:
    """Return gain, coefficient and term, best first, the best few of each target."""
    states = [state_of(chain, fit.values(i)) for i, chain in enumerate(fit.chains)]
    board = board_of_terms(fit, terms, states, at)
    found = [(gain, c, term) for (gain, c), term in zip(_asked(board, own, len(terms)), terms, strict=True)]
    return sorted(found, key=lambda item: -item[0])


def find_law(
    loose: Fit, best: Tied, own: Sequence[Parameter], noise: NoiseModel, recordings: Sequence[Recording]
) -> FoundLaw | None:
    """Return the law that explains what the catalogue does not, or None where none holds on held-out recordings.

    ``loose`` is the relaxed fit, ``best`` the best fit with effects of the catalogue (or without any), ``own`` the
    parameters that the recordings leave open without any effect, ``noise`` that of the relaxed fit.
    """
    plant = recordings[0].plant
    base = best if not best.hypothesis.trials else tied_fit(loose, Hypothesis(), own, noise, {}, iterations=6, polish=1)
    terms = library(plant)
    if not terms:
        return None
    start = replace(loose, noise=_white(noise))
    states = [state_of(chain, start.values(i)) for i, chain in enumerate(start.chains)]
    at = reference_of(states)
    found: tuple[Tied, tuple[Term, ...]] | None = None
    for gain, coefficient, term in _spread(_candidates(start, own, terms, at)):
        if gain < ENTRY:
            continue
        tied = _fitted(start, own, _own_at(loose, own), [term], [coefficient], at)
        if found is None or tied.score < found[0].score:
            found = tied, (term,)
    if found is None:
        return None
    return _believed(found[0], found[1], base, best, at)


def _spread(ranked: Sequence[tuple[float, float, Term]]) -> list[tuple[float, float, Term]]:
    """Return the best of a ranking, no two of which differ by exponents next to one another alone."""
    chosen: list[tuple[float, float, Term]] = []
    for item in ranked:
        near = [
            other
            for _, _, other in chosen
            if other.target == item[2].target
            and {s for s, _ in other.powers} == {s for s, _ in item[2].powers}
            and all(abs(a - b) <= 1.0 for (_, a), (_, b) in zip(other.powers, item[2].powers, strict=True))
            and bool(other.decay) == bool(item[2].decay)
        ]
        if not near:
            chosen.append(item)
        if len(chosen) == _FITTED:
            break
    return chosen


def _believed(tied: Tied, terms: tuple[Term, ...], base: Tied, best: Tied, at: Mapping[str, float]) -> FoundLaw | None:
    """Return the law if it gains what it costs, and on recordings that took no part."""
    size = sum(q.group == "law" for q in tied.fit.parameters)
    if tied.score + ENTRY + PER_PARAMETER * size > min(base.score, best.score):
        return None
    heldout = _held_out(base.fit, tied.fit)
    if heldout and (2.0 * sum(heldout.values()) < _HELD_OUT or np.mean(np.array([*heldout.values()]) > 0.0) < 0.5):
        return None
    law, reference = _as_law(terms, tied.fit, at, sum(heldout.values()) if heldout else None)
    return FoundLaw(law, base.score - tied.score, heldout, 1.0, reference, tied)
