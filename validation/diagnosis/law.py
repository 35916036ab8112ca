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
from scipy.interpolate import CubicHermiteSpline, CubicSpline

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
from validation.diagnosis.noise import GroupNoise, NoiseModel, chi_squared, log_likelihood, whitened
from validation.diagnosis.readings import to_body
from validation.diagnosis.relaxed import NO_JUMPS
from validation.diagnosis.rest import remainders
from validation.diagnosis.selection import BOUNDS, ENTRY, PER_PARAMETER, Hypothesis, Tied, noise_of, scored, tied_fit
from validation.diagnosis.trajectory_pieces import Chain, Column, IntArray, Linear, moved, recut

__all__ = ["FoundLaw", "Term", "find_law"]

#: exponents that are tried first; the fit leaves them
_RIG_POWERS = (-1.0, 0.0, 0.5, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0)
_AIR_POWERS = {"V": (0.0, 1.0, 2.0, 3.0), "r": (0.0, 1.0, 2.0), "alpha": (0.0, 1.0, 2.0)}
#: half the differences in force and moment, N and N m; in an exponent
_FORCE_STEP, _MOMENT_STEP, _RIG_STEP, _POWER_STEP = 2e-2, 2e-4, 2e-5, 1e-3
#: an exponent is sought within this of where it starts
_POWER_SIGMA = 3.0
#: candidates that are fitted, sums of exponents beyond which no physics goes
_FITTED, _HIGHEST = 2, 5.0
#: share of the best candidate's gain below which another is not fitted
_WORTH = 0.7
#: share of the excess that a law must explain, and twice the log likelihood it must gain on held-out recordings
_SHARE, _HELD_OUT = 0.5, 12.0
#: share of the excess beyond which no other candidate is fitted
_ALL = 0.98


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
    by recording while it took no part, ``chi2`` its chi-squared there before and after in the noise of the fit with the
    law, ``share`` the part of the excess of chi2 that it explains. ``tied`` is that fit. ``reference`` says
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
    chi2: Mapping[int, tuple[float, float]] = field(default_factory=dict)


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
    places = [d + first + j for j in targets]
    own = linear.own[:, places] * weights[:, linear.piece].T
    passes = linear.passes[:, :, places] * weights.T[: k - 1, None, :]
    moves = np.zeros((k, d, len(targets)))
    for i in range(k - 1):
        moves[i + 1] = linear.passes[i, :, :d] @ moves[i] + passes[i]
    return replace(
        linear,
        own=np.hstack([linear.own[:, : d + first], own]),
        moves=np.concatenate([linear.moves[:, :, : local + first], moves], axis=2),
        passes=np.concatenate([linear.passes[:, :, : d + first], passes], axis=2),
    )


def board_of_terms(
    fit: Fit, terms: Sequence[Term], states: Sequence[Mapping[str, FloatArray]], at: Mapping[str, float]
) -> Board:
    """Return the board of a fit's own parameters and terms, its pieces jumping as they may."""
    plant, jumps = fit.chains[0].recording.plant, fit.jumps
    targets = list(dict.fromkeys(term.target for term in terms))
    place_of = [targets.index(term.target) for term in terms]
    taken = len({int(q.name.partition(".")[0]) for q in fit.parameters if q.group == "law"})
    own = [column_of(q) for q in fit.parameters]
    bare = linearised_columns(fit, [*own, *(_constant(target, plant, taken) for target in targets)])
    linears = [
        _weighed(linear, len(own), place_of, np.array([term.weight(state, at) for term in terms]))
        for linear, state in zip(bare, states, strict=True)
    ]
    reduced = mapped(lambda linear, chain: reduce(linear, chain, fit.noise, jumps), linears, fit.chains)
    columns = (*own, *(Column("law", f"{j}.candidate", 1.0) for j in range(len(terms))))
    grams = _to_baseline(np.stack([r.gram for r in reduced]), fit)
    return Board(columns, grams, {column: j for j, column in enumerate(columns)}, tuple(linears), tuple(reduced))


def _to_baseline(grams: FloatArray, fit: Fit) -> FloatArray:
    """Return reduced matrices (recordings, p + 1, p + 1) with a fit's parameters, the first columns, as stated."""
    for i, G in enumerate(grams):
        away = np.zeros(G.shape[0] - 1)
        for j, (q, number) in enumerate(zip(fit.parameters, fit.at, strict=True)):
            if q.acts_in(i):
                away[j] = number - q.stated
        e, chi2 = G[:-1, -1].copy(), float(G[-1, -1])
        G[-1, -1] = chi2 + float(2.0 * away @ e + away @ G[:-1, :-1] @ away)
        G[:-1, -1] = G[-1, :-1] = e + G[:-1, :-1] @ away
    return grams


def _asked(board: Board, own: Sequence[Parameter], terms: int) -> Iterator[tuple[float, float]]:
    """Yield what each term would gain in chi2, and its coefficient."""
    taken = [(column_of(q), q) for q in own]
    base = board.ask(taken).chi2
    for j in range(terms):
        column = Column("law", f"{j}.candidate", 1.0)
        answer: Answer = board.ask([*taken, (column, Parameter("law", column.name, 0.0, 1.0))])
        yield base - answer.chi2, float(answer.value[-1])


# ----------------------------------------------------------------------------------------------- about a sensor


@dataclass(frozen=True)
class SensorTerm:
    """What a sensor's axes read beside the motion, each with coefficients of its own and one ``shape`` in common.

    ==========  ============================================  ======================
    kind        form                                          shape
    ==========  ============================================  ======================
    warming     c - c exp(-t/tau)                             tau in s
    drift       c t^n                                         n
    rate        c |r|^n sign(r)                               n
    reading     c |x|^n sign(x), x the axis's own reading     n
    turning     a cos(k psi) + b sin(k psi)                   k
    ==========  ============================================  ======================
    """

    sensor: str
    kind: str
    shape: float
    #: what powers are taken in units of
    unit: float = 1.0

    @property
    def size(self) -> int:
        """Number of coefficients of an axis."""
        return 2 if self.kind == "turning" else 1

    def basis(self, t: FloatArray, r: FloatArray, psi: FloatArray, x: FloatArray, shape: float) -> FloatArray:
        """Return what coefficients of one add to readings, (n, size), at t, spin r, angle psi, reading x."""
        if self.kind == "warming":
            return np.asarray(-np.expm1(-t / shape))[:, None]
        if self.kind == "turning":
            return np.stack([np.cos(shape * psi), np.sin(shape * psi)], axis=1)
        y = {"drift": t, "rate": r, "reading": x}[self.kind]
        return np.asarray(np.sign(y) * np.abs(y / self.unit) ** shape)[:, None]


#: half the difference by which the slope in a shape is taken, as a share of it
_SHAPE_STEP = 1e-4
#: shapes that are tried first; those of what turns with the disc come from the spectrum of the residuals
_SHAPES = {
    "warming": tuple(0.5 * 2.0**k for k in range(6)),
    "drift": (1.0, 2.0),
    "rate": (1.0, 2.0, 3.0),
    "reading": (2.0, 3.0),
}
#: kinds of law that a sensor can have
_SENSORS = {
    "magnetometer": ("warming", "drift", "rate", "turning"),
    "accelerometer": ("warming", "drift", "rate", "reading", "turning"),
    "gyroscope": ("warming", "drift", "rate", "reading", "turning"),
}
#: orders of the spin that are looked at, peaks of the spectrum that are tried
_ORDERS, _PEAKS = (0.15, 4.0), 3


@dataclass(frozen=True)
class Turned:
    """Spin and the angle turned since the recording began, as functions of time."""

    rate: CubicSpline | CubicHermiteSpline
    angle: CubicSpline | CubicHermiteSpline


def turned(chain: Chain) -> Turned:
    """Return how a chain turns, from the states at the starts of its pieces."""
    plant, t, states = chain.recording.plant, chain.edges[:-1], chain.states
    if plant == "rate_table":
        command = chain.recording.command
        assert command is not None
        # piecewise linear, so its integral is exact on its knots and parabolas between
        grid = np.union1d(np.linspace(0.0, chain.edges[-1], 20 * t.size), np.clip(command.t, 0.0, chain.edges[-1]))
        r = np.interp(grid, command.t, command.value)
        psi = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(grid) * (r[1:] + r[:-1]))])
        rate = CubicHermiteSpline(grid, r, np.gradient(r, grid))
        return Turned(rate, CubicHermiteSpline(grid, psi, r))
    r = states[:, 1] if plant == "spin_down" else states[:, 12]
    if t.size < 3:
        t, r = np.append(t, chain.edges[-1]), np.append(r, r[-1])
    rate = CubicSpline(t, r)
    return Turned(rate, rate.antiderivative())


def _seen(linear: Linear, chain: Chain, term: SensorTerm, shape: float) -> list[tuple[slice, int, FloatArray]]:
    """Return rows, axis and basis (n, size) of a term on each of its sensor's axes."""
    spin = turned(chain)
    found = []
    axes = next((readings.axes for readings in chain.readings if readings.sensor == term.sensor), ())
    for channel in linear.channels:
        if channel.sensor == term.sensor:
            t = linear.t[channel.rows]
            x = _reading(linear, chain, channel.rows, channel.index, term.sensor, axes.index(channel.axis))
            basis = term.basis(t, spin.rate(t), spin.angle(t), x, shape)
            found.append((channel.rows, axes.index(channel.axis), basis))
    return found


def _reading(linear: Linear, chain: Chain, rows: slice, index: IntArray, sensor: str, axis: int) -> FloatArray:
    """Return what the model expects an axis to read, (n,), the closing of gaps included."""
    readings = next(r for r in chain.readings if r.sensor == sensor)
    return np.asarray(readings.value[index, axis] - linear.residual[rows])


def _columns_of(linear: Linear, chain: Chain, term: SensorTerm, shape: float) -> FloatArray:
    """Return the columns (n, axes size) of a sensor term's coefficients."""
    axes = len(_axes(chain, term.sensor))
    columns = np.zeros((linear.raw.size, axes * term.size))
    for rows, axis, basis in _seen(linear, chain, term, shape):
        columns[rows, axis * term.size : (axis + 1) * term.size] = basis
    return columns


def _axes(chain: Chain, sensor: str) -> tuple[str, ...]:
    return next((readings.axes for readings in chain.readings if readings.sensor == sensor), ())


def _widened(linear: Linear, columns: FloatArray) -> Linear:
    """Return a linearisation with more shared columns (n, c), of the readings alone."""
    more = columns.shape[1]
    return replace(
        linear,
        own=np.hstack([linear.own, columns]),
        moves=np.concatenate([linear.moves, np.zeros((*linear.moves.shape[:2], more))], axis=2),
        passes=np.concatenate([linear.passes, np.zeros((*linear.passes.shape[:2], more))], axis=2),
    )


def orders(fit: Fit, sensor: str) -> list[float]:
    """Return the orders of the spin at which a sensor's residuals of a loose fit have their highest lines."""
    length = 0.0
    parts = []
    for linear, chain in zip(fit.linears, fit.chains, strict=True):
        spin = turned(chain)
        for channel in linear.channels:
            if channel.sensor == sensor:
                psi = spin.angle(linear.t[channel.rows])
                e = linear.residual[channel.rows]
                parts.append((psi, e - e.mean()))
                length = max(length, float(np.ptp(psi)))
    if length < 20.0:
        return []
    step = 1.0 / length
    tried = np.arange(_ORDERS[0], _ORDERS[1], step)
    power = np.zeros(tried.size)
    for psi, e in parts:
        turning, by = np.exp(-1j * tried[0] * psi), np.exp(-1j * step * psi)
        for j in range(tried.size):
            power[j] += abs(np.sum(e * turning)) ** 2 / e.size
            turning = turning * by
    found: list[float] = []
    for j in np.argsort(power)[::-1]:
        if all(abs(tried[j] - other) > 12.0 * step for other in found):
            found.append(float(tried[j]))
        if len(found) == _PEAKS:
            break
    return found


def sensor_library(fit: Fit) -> list[SensorTerm]:
    """Return the terms about sensors that are asked for first."""
    terms = []
    length = 0.5 * max(float(chain.edges[-1]) for chain in fit.chains)
    spin = max(float(np.max(np.abs(turned(chain).rate(chain.edges[:-1])))) for chain in fit.chains)
    for sensor in _SENSORS:
        values = [r.value[r.good] for chain in fit.chains for r in chain.readings if r.sensor == sensor]
        if not values or not any(v.size for v in values):
            continue
        units = {"drift": length, "rate": spin, "reading": float(np.std(np.concatenate(values)))}
        for kind in _SENSORS[sensor]:
            shapes = orders(fit, sensor) if kind == "turning" else _SHAPES[kind]
            unit = float(f"{max(units.get(kind, 1.0), 1e-6):.1g}")
            terms += [SensorTerm(sensor, kind, shape, unit) for shape in shapes]
    return terms


def _asked_of_sensors(fit: Fit, own: Sequence[Parameter], terms: Sequence[SensorTerm]) -> list[float]:
    """Return what each sensor term would gain in chi2, pieces jumping as they may."""
    if not terms:
        return []
    bare, jumps = linearised(fit), fit.jumps
    wide, places, at = [], [], len(fit.parameters)
    for term in terms:
        width = max(len(_axes(chain, term.sensor)) for chain in fit.chains) * term.size
        places.append(range(at, at + width))
        at += width
    for linear, chain in zip(bare, fit.chains, strict=True):
        parts = [
            _columns_of(linear, chain, term, term.shape)
            if _axes(chain, term.sensor)
            else np.zeros((linear.raw.size, len(place)))
            for term, place in zip(terms, places, strict=True)
        ]
        wide.append(_widened(linear, np.hstack(parts)))
    reduced = mapped(lambda linear, chain: reduce(linear, chain, fit.noise, jumps), wide, fit.chains)
    columns = (*map(column_of, fit.parameters), *(Column("term", str(j), 1.0) for j in range(at - len(fit.parameters))))
    board = Board(
        columns,
        _to_baseline(np.stack([r.gram for r in reduced]), fit),
        {column: j for j, column in enumerate(columns)},
        tuple(wide),
        tuple(reduced),
    )
    taken = [(column_of(q), q) for q in own]
    base = board.ask(taken).chi2
    gains = []
    for place in places:
        chosen = [(columns[j], Parameter("term", columns[j].name, 0.0, 1.0)) for j in place]
        gains.append(base - board.ask([*taken, *chosen]).chi2)
    return gains


def _fitted_sensor(start: Fit, own: Sequence[Parameter], own_at: FloatArray, term: SensorTerm) -> Tied | None:
    """Fit a sensor term and own parameters by output error, pieces hanging together.

    The chains keep their readings; what the term takes off them is part of the residual.
    """
    plant = start.chains[0].recording.plant
    axes = max((_axes(chain, term.sensor) for chain in start.chains), key=len)
    names = [(axis, j) for axis in axes for j in range(term.size)]
    noise, chains, shape = start.noise, start.chains, term.shape
    at = np.concatenate([own_at, np.zeros(len(names)), [shape]])
    parameters = (
        *own,
        *(Parameter("term", f"{axis}.{j}", 0.0, 1.0) for axis, j in names),
        Parameter("term", "shape", shape, _SHAPE_STEP * shape, 0.3 * shape if term.kind != "turning" else 0.01),
    )
    p = len(own)
    fit = Fit(chains, parameters, at, NO_JUMPS[plant], noise)
    for round in range(12):
        bare = linearised(replace(fit, parameters=tuple(own), at=fit.at[:p]))
        linears = []
        shape, c = float(fit.at[-1]), fit.at[p:-1]
        for linear, chain in zip(bare, fit.chains, strict=True):
            if not _axes(chain, term.sensor):
                linears.append(_widened(linear, np.zeros((linear.raw.size, len(names) + 1))))
                continue
            here = _columns_of(linear, chain, term, shape)
            h = _SHAPE_STEP * shape
            slope = (_columns_of(linear, chain, term, shape + h) - _columns_of(linear, chain, term, shape - h)) @ c
            less = replace(linear, raw=linear.raw - here @ c)
            linears.append(_widened(less, np.hstack([here, slope[:, None] / (2.0 * h)])))
        fit = replace(fit, linears=tuple(linears))
        merit = sum(_squares(fit, i) for i in range(len(linears)))
        reduced = mapped(lambda linear, chain, f=fit: reduce(linear, chain, f.noise, f.jumps), linears, fit.chains)
        gram = np.sum([r.gram for r in reduced], axis=0)
        free = [*range(p + len(names))] if not np.any(c) else [*range(len(parameters))]
        some = [*free, len(parameters)]
        step, covariance, expected = shared_step(gram[np.ix_(some, some)], [parameters[j] for j in free], fit.at[free])
        full = np.zeros(len(parameters))
        full[free] = step
        if len(free) == len(parameters):
            # a shape moves by a third of itself at most, an order of the spin by less than its line is wide
            full[-1] = float(np.clip(full[-1], -0.3 * shape, 0.3 * shape))
            fit = replace(fit, covariance=covariance)
        if round > 2 and fit.merit - merit < 1e-3 * abs(fit.merit - expected) + 0.05 and merit - expected < 0.5:
            break
        if round == 11 or not np.all(np.isfinite(full)):
            break
        fit = replace(
            fit,
            merit=merit,
            noise=noise_of(fit) if round > 3 else fit.noise,
            chains=tuple(
                moved(chain, linear, local_step(r, full), full)
                for chain, linear, r in zip(fit.chains, linears, reduced, strict=True)
            ),
            at=fit.at + full,
        )
    return scored(Hypothesis(), fit) if np.all(np.isfinite(fit.at)) and fit.covariance.size else None


def _squares(fit: Fit, i: int) -> float:
    linear = fit.linears[i]
    white = whitened(linear, fit.noise, linear.residual[:, None])
    return float(np.sum(white**2))


def _as_sensor_laws(term: SensorTerm, fit: Fit, heldout: float | None) -> tuple[tuple[Law, ...], str]:
    """Return a sensor term as laws, that of the strongest axis first, and its shape in words."""
    C, place = fit.covariance, {q.name: j for j, q in enumerate(fit.parameters) if q.group == "term"}
    s = place["shape"]
    shape, shape_sd = float(fit.at[s]), float(np.sqrt(C[s, s]))
    axes = list(dict.fromkeys(name.partition(".")[0] for name in place if name != "shape"))
    ranked = []
    for axis in axes:
        js = [place[f"{axis}.{j}"] for j in range(term.size)]
        values, block = fit.at[js], C[np.ix_(js, js)]
        if not np.any(np.diag(block) > 0):
            continue
        z2 = float(values @ np.linalg.pinv(block) @ values)
        sds = np.sqrt(np.diag(block))
        if term.kind == "turning":
            text = "a * cos(k * psi) + b * sin(k * psi)"
            coefficients = {
                "a": ParameterValue(float(values[0]), float(sds[0])),
                "b": ParameterValue(float(values[1]), float(sds[1])),
                "k": ParameterValue(shape, shape_sd),
            }
        elif term.kind == "warming":
            text = "c - c * exp(-t/tau)"
            coefficients = {
                "c": ParameterValue(float(values[0]), float(sds[0])),
                "tau": ParameterValue(shape, shape_sd),
            }
        else:
            symbol = {"drift": "t", "rate": "r", "reading": axis.partition("_")[0]}[term.kind]
            scale = term.unit**-shape
            c = float(values[0])
            row = np.array([scale, -c * scale * log(term.unit)])
            pair = C[np.ix_([js[0], s], [js[0], s])]
            text = f"c * |{symbol}|^n" + (f" * sign({symbol})" if symbol != "t" else "")
            coefficients = {
                "c": ParameterValue(c * scale, float(np.sqrt(row @ pair @ row))),
                "n": ParameterValue(shape, shape_sd),
            }
        ranked.append((z2, Law(text, f"{term.sensor}.{axis}", coefficients, heldout)))
    ranked.sort(key=lambda item: -item[0])
    laws = tuple(law for z2, law in ranked if z2 > PER_PARAMETER * 4.0 or law is ranked[0][1])
    return laws, f"{term.kind} of the {term.sensor}, {shape:.4g} ± {shape_sd:.2g}"


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
    iterations: int = 8,
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
    bounds = dict(BOUNDS)
    bounds |= {q.key: (-4.0, 8.0) for q in parameters if ".power_" in q.name}
    bounds |= {q.key: (0.01 * q.stated, 50.0 * q.stated) for q in parameters if q.name.endswith(".decay")}
    fit = refit(fit, iterations=iterations, bounds=bounds)
    for _ in range(2):
        fit = refit(replace(fit, noise=noise_of(fit)), iterations=3, bounds=bounds)
    return scored(Hypothesis(), fit)


def _held_out(before: Fit, after: Fit) -> tuple[dict[int, float], dict[int, tuple[float, float]]]:
    """Return what each recording gains in log likelihood while it took no part in either fit, and its chi-squared then.

    The shared parameters are those of the other recordings, by one step of the fit without it; the recording's own
    unknowns follow. chi-squared is in the levels of noise of the fit after.
    """
    count = len(before.chains)
    if count < 2:
        return {}, {}
    levelled = {group: noise._replace(correlation=0.0) for group, noise in after.noise.items()}
    sides, squares = [], []
    for fit in (before, after):
        linears = fit.linears
        reduced = mapped(lambda linear, chain, f=fit: reduce(linear, chain, f.noise, f.jumps), linears, fit.chains)
        levels, squared = [], []
        for i in range(count):
            others = np.sum([r.gram for j, r in enumerate(reduced) if j != i], axis=0)
            step, _, _ = shared_step(others, fit.parameters, fit.at)
            acting = np.array([q.acts_in(i) for q in fit.parameters], dtype=bool)
            step = np.where(acting, step, 0.0)
            left = linears[i].after(local_step(reduced[i], step), step)
            levels.append(log_likelihood(linears[i], fit.noise, left))
            squared.append(chi_squared(linears[i], levelled, left))
        sides.append(levels)
        squares.append(squared)
    gains = {i: 0.5 * (sides[0][i] - sides[1][i]) for i in range(count)}
    return gains, {i: (squares[0][i], squares[1][i]) for i in range(count)}


# --------------------------------------------------------------------------------------------------- a formula


def _factor(symbol: str, power: str) -> str:
    return f"|{symbol}|^{power}"


def _as_laws(
    terms: Sequence[Term], fit: Fit, at: Mapping[str, float], heldout: float | None
) -> tuple[tuple[Law, ...], str]:
    """Return a fit's terms as laws, one for each target, and as values at the reference state."""
    by_target: dict[str, list[int]] = {}
    for i, term in enumerate(terms):
        by_target.setdefault(term.target, []).append(i)
    found = [_as_law({i: terms[i] for i in mine}, fit, at, heldout) for mine in by_target.values()]
    return tuple(law for law, _ in found), "; ".join(note for _, note in found)


def _as_law(terms: Mapping[int, Term], fit: Fit, at: Mapping[str, float], heldout: float | None) -> tuple[Law, str]:
    """Return a fit's terms about one target, by their number, as a law of plain SI coefficients, and as values.

    The coefficient of |x|^n is that at x = 1, far from where a disc ever is; its standard deviation holds the
    exponent's share, ln(x / 1) times its own.
    """
    place = {q.name: j for j, q in enumerate(fit.parameters) if q.group == "law"}
    C = fit.covariance
    coefficients, parts, notes = {}, [], []
    for i, term in terms.items():
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
    target = next(iter(terms.values())).target
    return Law(" + ".join(parts), target, coefficients, heldout), "; ".join(notes)


# ----------------------------------------------------------------------------------------------------- finding


def _own_at(loose: Fit, own: Sequence[Parameter]) -> FloatArray:
    """Return where own parameters start: those that stand for a recording alone, where the loose fit has them."""
    known = {(q.key, q.recordings): number for q, number in zip(loose.parameters, loose.at, strict=True)}
    return np.array([known.get((q.key, q.recordings), q.stated) if q.recordings else q.stated for q in own])


def _white(noise: NoiseModel) -> dict[str, GroupNoise]:
    return {group: GroupNoise(item.sd, min(item.correlation, 0.9)) for group, item in noise.items()}


def _beside(loose: Fit, own: Sequence[Parameter], own_at: FloatArray, noise: NoiseModel) -> Fit:
    """Return a fit without errors of the sensors whose motion stays beside the data, to ask from.

    In the air its pieces jump as those of the loose fit do, for what hides turns a whole flight too far from a line; a
    rig's hang together.
    """
    plant = loose.chains[0].recording.plant
    fit = refit(Fit(loose.chains, tuple(own), own_at, loose.jumps, _white(noise)), iterations=5)
    levels: dict[str, list[float]] = {}
    for linear in fit.linears:
        for channel in linear.channels:
            levels.setdefault(channel.group, []).append(_quick(linear.residual[channel.rows]))
    quick = {group: float(np.sqrt(np.mean(np.square(found)))) for group, found in levels.items()}
    sure = {
        g: GroupNoise(min(item.sd, max(quick[g], 0.1 * item.sd)), item.correlation)
        for g, item in fit.noise.items()
        if g in quick
    }
    return replace(fit, noise=sure, jumps=fit.jumps if plant == "flight" else NO_JUMPS[plant])


def _quick(e: FloatArray) -> float:
    """Return the noise that differences of neighbours show, whatever drifts below it."""
    return float(np.sqrt(0.5 * np.mean(np.diff(e) ** 2))) if e.size > 1 else 0.0


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
    if plant == "free_spin":
        return None  # what a free spin does not model takes up any further moment
    base = best if not best.hypothesis.trials else tied_fit(loose, Hypothesis(), own, noise, {}, iterations=6, polish=1)
    own_at = _own_at(loose, own)
    start = _beside(loose, own, own_at, noise)
    states = [state_of(chain, start.values(i)) for i, chain in enumerate(start.chains)]
    at = reference_of(states)
    motion = library(plant)
    about = sensor_library(start)
    ranked: list[tuple[float, float, Term | SensorTerm]] = []
    if motion:
        ranked += _candidates(start, own, motion, at)
    ranked += [(gain, 0.0, term) for gain, term in zip(_asked_of_sensors(start, own, about), about, strict=True)]
    ranked.sort(key=lambda item: -item[0])
    found: tuple[Tied, Term | SensorTerm] | None = None
    for _, coefficient, term in _spread(ranked):
        tied: Tied | None
        if isinstance(term, SensorTerm):
            tied = _fitted_sensor(start, own, own_at, term)
        else:
            tied = _fitted(start, own, own_at, [term], [coefficient], at)
        if tied is None:
            continue
        if found is None or _priced(tied) < _priced(found[0]):
            found = tied, term
        if _share(base.fit, tied.fit, start.noise) > _ALL:
            break
    if found is None:
        return None
    tied, term = found
    if isinstance(term, SensorTerm):
        return _believed(tied, term, base, best, at, start.noise)
    return _believed(*_more_terms(start, own, own_at, tied, term, at), base, best, at, start.noise)


def _more_terms(
    start: Fit, own: Sequence[Parameter], own_at: FloatArray, tied: Tied, first: Term, at: Mapping[str, float]
) -> tuple[Tied, tuple[Term, ...]]:
    """Return the fit of a law with one more term where the first leaves more than noise, and its terms.

    The further term is asked for beside the first from where the motion is beside the data, and must gain its price and
    held-out likelihood over the law without it.
    """
    terms: tuple[Term, ...] = (first,)
    if not remainders(tied.fit.linears, tied.residuals, tied.fit.noise):
        return tied, terms
    plant = start.chains[0].recording.plant
    held = tuple(q for q in tied.fit.parameters if q.group == "law")
    beside = Fit(start.chains, (*own, *held), tied.fit.at, start.jumps, start.noise, tied.fit.fixed)
    beside = refit(beside, iterations=3)
    coefficient = float(tied.fit.at[[q.name for q in tied.fit.parameters].index("0.coefficient")])
    powers = {q.name: float(v) for q, v in zip(tied.fit.parameters, tied.fit.at, strict=True) if q.group == "law"}
    settled = replace(first, powers=tuple((s, powers.get(f"0.power_{s}", n)) for s, n in first.powers))
    others = [term for term in library(plant) if _key(term) != _key(first)]
    best, chosen = tied, terms
    for _, further, term in _spread(_candidates(beside, (*own, *held), others, at)):
        assert isinstance(term, Term)
        both = _fitted(start, own, own_at, [settled, term], [coefficient, further], at)
        if _priced(both) + ENTRY > _priced(best):
            continue
        gains, _ = _held_out(tied.fit, both.fit)
        if gains and (2.0 * sum(gains.values()) < _HELD_OUT or np.mean(np.array([*gains.values()]) > 0.0) < 0.5):
            continue
        best, chosen = both, (settled, term)
    return best, chosen


def _key(term: Term | SensorTerm) -> tuple[object, ...]:
    if isinstance(term, SensorTerm):
        return term.sensor, term.kind
    return term.target, frozenset(symbol for symbol, _ in term.powers), bool(term.decay)


def _spread(ranked: Sequence[tuple[float, float, Term | SensorTerm]]) -> list[tuple[float, float, Term | SensorTerm]]:
    """Return the best few of a ranking, one of each set of symbols: the exponents are the fit's business."""
    chosen: dict[tuple[object, ...], tuple[float, float, Term | SensorTerm]] = {}
    for item in ranked:
        if item[0] > max(ENTRY, _WORTH * ranked[0][0]):
            chosen.setdefault(_key(item[2]), item)
    return list(chosen.values())[:_FITTED]


def _share(base: Fit, fit: Fit, noise: NoiseModel) -> float:
    """Return the part of the excess of chi2 over the number of readings that a fit takes away."""
    before, after = (
        sum(float(np.sum(whitened(linear, noise, linear.residual[:, None]) ** 2)) for linear in one.linears)
        for one in (base, fit)
    )
    return (before - after) / max(before - base.count, 1.0)


def _priced(tied: Tied) -> float:
    """Return a fit's score with what the numbers of its law cost: of laws that do as well the simpler one is taken."""
    return tied.score + PER_PARAMETER * sum(q.group in ("law", "term") for q in tied.fit.parameters)


def _believed(
    tied: Tied, terms: tuple[Term, ...] | SensorTerm, base: Tied, best: Tied, at: Mapping[str, float], noise: NoiseModel
) -> FoundLaw | None:
    """Return the law if it gains what it costs, explains most of the excess, and recordings that took no part."""
    if _priced(tied) + ENTRY > min(base.score, best.score):
        return None
    share = _share(base.fit, tied.fit, noise)
    heldout, chi2 = _held_out(base.fit, tied.fit)
    if heldout and (2.0 * sum(heldout.values()) < _HELD_OUT or np.mean(np.array([*heldout.values()]) > 0.0) < 0.5):
        return None
    if share < _SHARE:
        return None
    total = sum(heldout.values()) if heldout else None
    if isinstance(terms, SensorTerm):
        laws, reference = _as_sensor_laws(terms, tied.fit, total)
    else:
        laws, reference = _as_laws(terms, tied.fit, at, total)
    return FoundLaw(laws[0], base.score - tied.score, heldout, share, reference, tied, laws[1:], chi2)
