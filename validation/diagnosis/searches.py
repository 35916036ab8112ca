"""Searches for effects that one linear question about whole recordings does not find: events, gusts, ripples, slips.

Each returns proposals with values to start from; fits with all parameters free decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from validation.diagnosis.fitting import Fit, Parameter, linearised, mapped, reduce, refit, unknown_prior
from validation.diagnosis.noise import NoiseModel, whitened
from validation.diagnosis.plateau import equal_beyond_chance, plateau
from validation.diagnosis.readings import delay
from validation.diagnosis.relaxed import NO_JUMPS, relaxed
from validation.diagnosis.selection import Hypothesis, Proposal, Tied, fitted_parameters
from validation.diagnosis.slips import first_yaw, lost_along, phase_counts, repaired
from validation.diagnosis.trajectory_pieces import (
    WOBBLE,
    Chain,
    Column,
    IntArray,
    Linear,
    linearise,
    recut,
    shown,
    undone,
)
from validation.diagnosis.trials import Trial, available

__all__ = [
    "EARLIEST",
    "Asked",
    "Shifted",
    "asked_of",
    "dropped_accelerometer",
    "dropped_magnetometer",
    "events",
    "gusts",
    "ripple",
    "saturation",
    "searched",
]

#: spacing of the boundaries at which a jump is asked for, s
_FINE = 0.1
#: directions of the state in which an event jumps, by plant
_IMPULSE = (3, 4, 5)
_SPIN = {"flight": (11,), "free_spin": (11,), "spin_down": (1,)}
#: how far about the best boundary the instant of an event is looked for, s
_NEAR = {"flight": 0.09, "free_spin": 0.2, "spin_down": 0.12}
#: an event of a free spin before this instant, s, is not told from where the spin and its decay started
EARLIEST = {"flight": 0.0, "free_spin": 0.1, "spin_down": 0.0}
#: how many recordings and kinds of event are followed up at a time: the strongest, the others come after them
_FOLLOWED = 3
#: widths of gusts tried, s, and the spacing of their instants
_WIDTHS, _EVERY = (0.1, 0.2, 0.4, 0.8), 0.1
_WIND = (("air.wind", "w_north_m_s"), ("air.wind", "w_east_m_s"))
#: fewest steps of the magnetometer's phase, over all recordings, that are followed up
_FEWEST_STEPS = 3
#: orders of a speed ripple looked for, and the angle (rad) within which readings are taken together
_ORDERS, _BIN = (0.1, 40.0), 0.02


# ------------------------------------------------------------------------------- questions to one recording


@dataclass(frozen=True)
class _Ground:
    """One recording, linearised: what any further column would explain once all its unknowns have had their say.

    ``white`` (n, m) are whitened columns of the first state and the parameters, ``left`` (n,) the whitened residual;
    ``inverse`` (m, m) and ``right`` (m,) the normal equations with what is known from elsewhere.
    """

    chain: Chain
    linear: Linear
    noise: NoiseModel
    piece: IntArray
    white: FloatArray
    left: FloatArray
    inverse: FloatArray
    right: FloatArray

    def whiten(self, columns: FloatArray) -> FloatArray:
        """Return columns (n, c) whitened as the residual is."""
        return whitened(self.linear, self.noise, columns)

    def explained(self, own: FloatArray, cross: FloatArray, pull: FloatArray) -> tuple[float, FloatArray]:
        """Return gain and values (c,) of columns with products own (c, c), cross (m, c) and pull (c,)."""
        H = own - cross.T @ self.inverse @ cross
        b = pull - cross.T @ self.inverse @ self.right
        size = np.sqrt(np.maximum(np.diag(own), 0.0))
        scale = np.divide(1.0, size, out=np.zeros_like(size), where=size > 1e-100)
        w, V = np.linalg.eigh(H * np.outer(scale, scale))
        # what is left of a column once the unknowns have had their say may be nothing
        kept = w > 1e-6
        if not np.any(kept):
            return 0.0, np.zeros(b.size)
        value = scale * (V[:, kept] @ ((V[:, kept].T @ (scale * b)) / w[kept]))
        return float(b @ value), np.asarray(value)

    def ask(self, columns: FloatArray) -> tuple[float, FloatArray]:
        """Return gain and values (c,) of whitened columns (n, c)."""
        return self.explained(columns.T @ columns, self.white.T @ columns, columns.T @ self.left)


def _fine_edges(chain: Chain) -> FloatArray:
    """Return boundaries about `_FINE` apart, those of the chain among them."""
    parts = [
        np.linspace(a, b, max(1, round((b - a) / _FINE)) + 1)[:-1]
        for a, b in zip(chain.edges[:-1], chain.edges[1:], strict=True)
    ]
    return np.concatenate([*parts, chain.edges[-1:]])


@dataclass(frozen=True)
class Asked:
    """A fit made ready for questions: each recording's ground, and where the columns of a steady wind are in it."""

    fit: Fit
    taken: tuple[Trial, ...]
    grounds: Mapping[int, _Ground]
    wind: tuple[int, ...]

    def has(self, id: str, recording: int) -> bool:
        """Tell whether an effect already acts in a recording."""
        return any(t.id == id and (t.recordings is None or recording in t.recordings) for t in self.taken)


def asked_of(fit: Fit, noise: NoiseModel, own: Sequence[Parameter], hypothesis: Hypothesis) -> Asked:
    """Return a fit, relaxed or tied, ready for questions: cut finely, hanging together, under a hypothesis.

    Parameters of the fit that the hypothesis does not have are taken back to where they stand without it.
    """
    plant = fit.chains[0].recording.plant
    free = fitted_parameters(hypothesis, own)
    wind: tuple[int, ...] = ()
    if plant == "flight":
        # a wind without a prior would swallow a gust: where none is supposed, it is there for its columns alone
        keys = [q.key for q in free if q.recordings is None]
        free = (*free, *(Parameter(*key, 0.0, 0.05, 1e-9) for key in _WIND if key not in keys))
        wind = tuple(next(j for j, q in enumerate(free) if q.key == key and q.recordings is None) for key in _WIND)
    mine = {(q.key, q.recordings) for q in free}
    every = (*free, *(q for q in fit.parameters if (q.key, q.recordings) not in mine))
    place = {(q.key, q.recordings): number for q, number in zip(fit.parameters, fit.at, strict=True)}
    at = np.array([place.get((q.key, q.recordings), q.stated) for q in every])
    tied = replace(fit, parameters=every, at=at, jumps=NO_JUMPS[plant], noise=noise)
    if plant != "free_spin":  # its pieces are short, and what it does not model wanders by the piece
        chains = tuple(recut(chain, tied.values(i), _fine_edges(chain)) for i, chain in enumerate(tied.chains))
        tied = replace(tied, chains=chains)
    return Asked(tied, hypothesis.trials, _grounds(tied, len(free)), wind)


def _grounds(fit: Fit, f: int) -> dict[int, _Ground]:
    """Return the grounds of all recordings; the first ``f`` parameters are free, the others taken back."""
    parameters, noise, at = fit.parameters[:f], fit.noise, fit.at
    linears = linearised(fit)
    away = np.concatenate([np.zeros(f), at[f:] - np.array([q.stated for q in fit.parameters[f:]])])
    grams = []
    for linear, chain in zip(linears, fit.chains, strict=True):
        G = reduce(linear, chain, noise, fit.jumps).gram
        back = G[:-1, -1] + G[:-1, :-1] @ away
        grams.append((G[:f, :f], back[:f]))
    total = np.sum([g for g, _ in grams], axis=0)
    pulled = np.sum([b for _, b in grams], axis=0)
    prior = np.array([q.sigma**-2.0 if np.isfinite(q.sigma) else 0.0 for q in parameters])
    off = prior * (np.array([q.stated for q in parameters]) - at[:f])
    found = {}
    for i, (linear, chain) in enumerate(zip(linears, fit.chains, strict=True)):
        residual = linear.residual + linear.shared @ away
        own = linear.unknowns
        columns = np.hstack([linear.local, linear.shared[:, :f], residual[:, None]])
        white = whitened(linear, noise, columns)
        A, e = white[:, :-1], white[:, -1]
        H, right = A.T @ A, A.T @ e
        known, pull, _ = unknown_prior(linear, chain, fit.jumps)
        H[:own, :own] += known
        right[:own] += pull
        H[own:, own:] += total - grams[i][0] + np.diag(prior)
        right[own:] += pulled - grams[i][1] + off
        scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
        w, V = np.linalg.eigh(H * np.outer(scale, scale))
        kept = w > 1e-11 * w[-1]
        inverse = ((V[:, kept] / w[kept]) @ V[:, kept].T) * np.outer(scale, scale)
        piece = np.clip(np.searchsorted(chain.edges, linear.t, side="right") - 1, 0, len(chain.states) - 1)
        found[i] = _Ground(chain, linear, noise, np.where(linear.piece < 0, piece, linear.piece), A, e, inverse, right)
    return found


# ---------------------------------------------------------------------------------------------------- events


def _jumps(ground: _Ground, directions: Sequence[int]) -> FloatArray:
    """Return what a jump of the state in some directions at each boundary (k - 1,) would gain."""
    d = ground.chain.tangent
    k = len(ground.chain.states)
    moves = ground.linear.moves[:, :, :d]
    A = np.hstack([ground.white, ground.left[:, None]])
    # products of the rows after each boundary with the first state's columns
    products = np.zeros((k, d, A.shape[1]))
    for i in range(k):
        rows = A[ground.piece == i]
        products[i] = rows[:, :d].T @ rows
    after = np.cumsum(products[::-1], axis=0)[::-1]
    gain = np.zeros(max(k - 1, 0))
    for j in range(1, k):
        back = undone(moves[j], np.eye(d)[:, list(directions)])
        own = back.T @ after[j][:, :d] @ back
        cross = (back.T @ after[j]).T
        gain[j - 1], _ = ground.explained(own, cross[:-1], cross[-1])
    return gain


def _events_at(ground: _Ground, fit: Fit, recording: int, trial: Trial, instants: FloatArray) -> list[Proposal]:
    """Return an event at each of some instants as a proposal, by its true columns."""
    columns = [Column(c.group, c.name, c.step, (("t_s", float(t)),)) for t in instants for c in trial.columns]
    values = fit.values(recording)
    linear = linearise(ground.chain, values, columns, NO_JUMPS[ground.chain.recording.plant].allowed)
    white = ground.whiten(linear.shared)
    width = len(trial.columns)
    found = []
    for n, t in enumerate(instants):
        part = slice(n * width, (n + 1) * width)
        gain, value = ground.ask(white[:, part])
        shaped = replace(trial, columns=tuple(columns[part]), recordings=frozenset([recording]))
        start = {((c.group, c.name), shaped.recordings): float(v) for c, v in zip(shaped.columns, value, strict=True)}
        start[(trial.id, "t_s"), shaped.recordings] = float(t)
        found.append(Proposal(shaped, gain, start))
    return found


def _peaks(gain: FloatArray, count: int) -> list[int]:
    """Return the places of the highest local maxima."""
    padded = np.concatenate([[-np.inf], gain, [-np.inf]])
    tops = np.flatnonzero((gain >= padded[:-2]) & (gain >= padded[2:]))
    return [int(j) for j in tops[np.argsort(gain[tops])[::-1][:count]]]


def events(asked: Asked, least: float = 25.0) -> list[Proposal]:
    """Return events, at most one of each kind per recording, that would gain more than ``least``, best first.

    A jump of velocity or spin is asked for at every boundary of finely cut motion, which costs no simulation; the
    instant is then read off the event's true signature, in which a pulse of 10 ms is a needle.
    """
    recordings = [chain.recording for chain in asked.fit.chains]
    plant = recordings[0].plant
    first = EARLIEST[plant]
    there = available(recordings)
    kinds: list[tuple[str, Sequence[int], tuple[str, ...]]] = []
    if "event.impulse" in there:
        kinds.append(("event.impulse", _IMPULSE, ("dv_north_m_s", "dv_east_m_s", "dv_down_m_s")))
    if "event.spin_step" in there:
        kinds.append(("event.spin_step", _SPIN[plant], ("dr_rad_s",)))

    def scanned(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]]) -> FloatArray:
        i, (id, directions, _) = task
        return np.zeros(0) if asked.has(id, i) else _jumps(asked.grounds[i], directions)

    def one(task: tuple[int, tuple[str, Sequence[int], tuple[str, ...]]], gain: FloatArray) -> Proposal | None:
        i, (id, _, names) = task
        ground = asked.grounds[i]
        trial = Trial(id, tuple(Column(id, name, 0.02) for name in names))
        inner, end = ground.chain.edges[1:-1], float(ground.chain.edges[-1])
        near = np.concatenate([inner[j] + _NEAR[plant] * np.linspace(-1.0, 1.0, 13) for j in _peaks(gain, 2)])
        near = np.unique(near.round(4))
        near = near[(near > max(0.01, first)) & (near < end)]
        if near.size == 0:
            return None
        best = max(_events_at(ground, asked.fit, i, trial, near), key=_gain)
        about = best.trial.shapes["t_s"] + np.linspace(-0.012, 0.012, 7)
        best = max([best, *_events_at(ground, asked.fit, i, trial, about[(about > first) & (about < end)])], key=_gain)
        return best if best.gain > least else None

    tasks = [(i, kind) for i in asked.grounds for kind in kinds]
    gains = mapped(scanned, tasks)
    promising = [(t, g) for t, g in zip(tasks, gains, strict=True) if g.size and g.max() >= least - 10.0]
    promising = sorted(promising, key=lambda item: -float(item[1].max()))[:_FOLLOWED]
    found = mapped(one, [t for t, _ in promising], [g for _, g in promising])
    return sorted((p for p in found if p is not None), key=_gain, reverse=True)


def _gain(proposal: Proposal) -> float:
    return proposal.gain


# ----------------------------------------------------------------------------------------------------- gusts


def gusts(asked: Asked, least: float = 25.0) -> list[Proposal]:
    """Return gusts, at most one per recording, that would gain more than ``least``, best first.

    A gust is a sum of winds that blow for one piece of motion each, so any instant and width is asked for by algebra.
    """
    if "air.gust" not in available([chain.recording for chain in asked.fit.chains]):
        return []

    def one(i: int) -> Proposal | None:
        return None if asked.has("air.gust", i) else _gust(asked.grounds[i], i, asked.wind)

    found = [p for p in mapped(one, list(asked.grounds)) if p is not None and p.gain > least]
    return sorted(found, key=_gain, reverse=True)


def _gust(ground: _Ground, recording: int, wide: Sequence[int]) -> Proposal | None:
    """Return the gust in a recording that would gain most; ``wide`` are the places of a steady wind's columns."""
    linear, piece, edges = ground.linear, ground.piece, ground.chain.edges
    d, own, k = ground.chain.tangent, linear.unknowns, len(ground.chain.states)
    first = linear.local[:, :d]
    # u: the change of the first state that a wind up to each boundary amounts to
    u = np.stack([undone(m[:, :d], m[:, [own + w for w in wide]]) for m in linear.moves])
    within = linear.shared[:, list(wide)] - np.einsum("nd,ndw->nw", first, u[piece])
    push = np.diff(u, axis=0)
    middle = 0.5 * (edges[:-1] + edges[1:])
    best: Proposal | None = None
    for width in _WIDTHS:
        for t in np.arange(0.0, edges[-1], max(_EVERY, 0.4 * width)):
            weight = np.exp(-(((middle - t) / width) ** 2) / 2.0)
            before = np.zeros((k, d, len(wide)))
            before[1:] = np.cumsum(weight[:-1, None, None] * push, axis=0)
            columns = np.einsum("nd,ndw->nw", first, before[piece]) + weight[piece, None] * within
            gain, value = ground.ask(ground.whiten(columns))
            if best is None or gain > best.gain:
                given = (("t_s", float(t)), ("width_s", width))
                trial = Trial(
                    "air.gust",
                    tuple(Column("air.gust", name, 0.05, given) for _, name in _WIND),
                    frozenset([recording]),
                )
                sizes = zip((name for _, name in _WIND), value.tolist(), strict=True)
                start = {(("air.gust", name), trial.recordings): number for name, number in (*sizes, *given)}
                best = Proposal(trial, gain, start)
    return best


# ----------------------------------------------------------------------------------------------- lost samples


@dataclass(frozen=True)
class Shifted:
    """A proposal that changes what the readings mean: the chains to fit it from, instead of the loose fit's.

    ``proposal.gain`` is in chi-squared where the search stood, less the price of each sample that it takes for lost.
    ``cost`` is that price: twice the logarithm of the ways to lose as many.
    """

    proposal: Proposal
    chains: tuple[Chain, ...]
    cost: float = 0.0


def _losses(id: str, chains: Sequence[Chain], sensor: str) -> tuple[Trial, float]:
    """Return the trial of lost samples as chains hold them, and the price of where they are."""
    lost = sampled = 0.0
    cost = 0.0
    for chain in chains:
        counts = chain.lost.get(sensor)
        if counts is None:
            continue
        n, gone = float(counts.size), float(counts[-1])
        lost, sampled = lost + gone, sampled + n + gone
    share = lost / sampled
    # where each one is lost is chosen: twice the logarithm of the choices
    if lost:
        cost = 2.0 * lost * (1.0 - np.log(share))
    sd = float(np.sqrt(max(share * (1.0 - share), 1.0 / sampled) / sampled))
    return Trial(id, (), None, (("fraction", share, sd),)), cost


def dropped_magnetometer(
    fit: Fit, known: Sequence[Parameter], taken: Sequence[Trial] = (), least: float = 40.0
) -> list[Shifted]:
    """Return lost samples of the magnetometer as a proposal where its phase shows steps.

    The motion of a loose fit follows the magnetometer; with steps found it is fitted anew with the samples at their
    own times, and the counts are then read once more off the motion that all sensors agree on.
    """
    chains = fit.chains
    id, sensor = "mag.dropped_samples", "magnetometer"
    if any(trial.id == id for trial in taken):
        return []
    counts = [
        phase_counts(chain.recording) if chain.recording.get(sensor) is not None else np.zeros(0) for chain in chains
    ]
    steps = sum(float(c[-1]) for c in counts if c.size)
    if steps < _FEWEST_STEPS:
        return []
    fixed = [
        repaired(chain.recording, sensor, c) if c.size else chain.recording
        for chain, c in zip(chains, counts, strict=True)
    ]
    anew = relaxed(fixed, known)
    gain = fit.merit - anew.merit
    if gain < least:
        return []
    new = tuple(_own_times(one, chain, {sensor: c}) for one, chain, c in zip(anew.chains, chains, counts, strict=True))
    # what was lost while the phase stood still shows in what comes after, by a motion that hangs together
    plant = chains[0].recording.plant
    found = replace(anew, chains=new)
    if plant == "rate_table":
        whole = tuple(
            _begun(replace(c, edges=c.edges[[0, -1]], states=c.states[:1]), anew, i) for i, c in enumerate(new)
        )
        counted, _ = _counted(replace(found, chains=whole), sensor, _stated_sd(found, sensor, anew.noise))
        standing = tuple(
            recut(one, found.values(i), chain.edges) for i, (one, chain) in enumerate(zip(whole, new, strict=True))
        )
        found = _with_losses(replace(found, chains=standing), counted, sensor)
    for _ in range(2):
        tied = refit(replace(found, jumps=NO_JUMPS[plant]), iterations=4)
        counted, _ = _counted(tied, sensor, _stated_sd(found, sensor, anew.noise))
        same = all(
            np.array_equal(a.lost.get(sensor, 0.0), b.lost.get(sensor, 0.0))
            for a, b in zip(found.chains, counted.chains, strict=True)
        )
        found = _with_losses(tied, counted, sensor)
        if same:
            break
    trial, cost = _losses(id, found.chains, sensor)
    return [Shifted(Proposal(trial, gain - cost, {}), found.chains, cost)]


def _begun(whole: Chain, fit: Fit, i: int) -> Chain:
    """Return a table's motion in one piece from the yaw that its first readings show."""
    if whole.recording.get("magnetometer") is None:
        return whole
    states = whole.states.copy()
    states[0, :2] = 0.0
    whole = replace(whole, states=states)
    turned = states.copy()
    turned[0, 0] = first_yaw(whole, fit.values(i))
    return replace(whole, states=turned)


def _with_losses(fit: Fit, counted: Fit, sensor: str) -> Fit:
    """Return a fit with the losses that the chains of another hold."""
    chains = tuple(
        replace(chain, lost={**chain.lost, sensor: other.lost[sensor]}) if sensor in other.lost else chain
        for chain, other in zip(fit.chains, counted.chains, strict=True)
    )
    return replace(fit, chains=chains)


def _own_times(anew: Chain, old: Chain, lost: Mapping[str, FloatArray]) -> Chain:
    """Return the pieces of a fit to repaired recordings as pieces of the recording itself, its losses beside it."""
    some = {sensor: counts for sensor, counts in lost.items() if counts.size}
    written = {readings.sensor: readings.t for readings in old.readings}
    readings = tuple(replace(r, t=written[r.sensor]) for r in anew.readings)
    return replace(anew, recording=old.recording, readings=readings, lost={**old.lost, **some})


def dropped_accelerometer(
    fit: Fit, noise: NoiseModel, taken: Sequence[Trial] = (), least: float = 40.0
) -> list[Shifted]:
    """Return lost samples of the accelerometer as a proposal where the motion tells that its readings slip."""
    id, sensor = "accel.dropped_samples", "accelerometer"
    if sensor not in {r.sensor for chain in fit.chains for r in chain.readings}:
        return []
    if any(trial.id == id for trial in taken):
        return []
    sd = _stated_sd(fit, sensor, noise)
    if _counted(fit, sensor, sd)[1] < least:
        return []
    # what is lost has bent the motion: once more without the sensor in question
    without = replace(
        fit, chains=tuple(replace(c, readings=tuple(r for r in c.readings if r.sensor != sensor)) for c in fit.chains)
    )
    free = refit(without, iterations=4)
    whole = replace(
        free, chains=tuple(replace(c, readings=old.readings) for c, old in zip(free.chains, fit.chains, strict=True))
    )
    whole, gain = _counted(whole, sensor, sd)
    if gain < least:
        return []
    again = refit(replace(whole, noise=noise), iterations=3)
    again, _ = _counted(again, sensor, sd)
    trial, cost = _losses(id, again.chains, sensor)
    if trial.told[0][1] == 0.0:
        return []
    return [Shifted(Proposal(trial, gain, {}), again.chains, cost)]


def _stated_sd(fit: Fit, sensor: str, noise: NoiseModel) -> FloatArray:
    """Return the noise of a sensor's axes: as stated, or where nothing is stated as a fit shows it."""
    readings = next(r for chain in fit.chains for r in chain.readings if r.sensor == sensor)
    return np.where(np.isfinite(readings.sd), readings.sd, noise[sensor].sd)


def _counted(fit: Fit, sensor: str, sd: FloatArray) -> tuple[Fit, float]:
    """Return a fit whose chains hold the likeliest losses of a sensor by its motion, and their gain."""

    def one(i: int) -> tuple[Chain, float]:
        chain = fit.chains[i]
        if all(r.sensor != sensor for r in chain.readings):
            return chain, 0.0
        counts, gain = lost_along(chain, fit.values(i), sensor, 2.0 * sd)
        return replace(chain, lost={**chain.lost, sensor: counts}), gain

    done = mapped(one, range(len(fit.chains)))
    return replace(fit, chains=tuple(chain for chain, _ in done)), float(sum(gain for _, gain in done))


# ------------------------------------------------------------------------------------------------- saturation


def saturation(fit: Fit, noise: NoiseModel, taken: Sequence[Trial] = ()) -> list[Proposal]:
    """Return an accelerometer's limit below its range as a proposal where readings stand still at it.

    Such readings take no part in any fit. Gained is what the fit's motion asks for beyond the limit: readings that
    should have been larger, and that noise alone would have had to hold at one size. On a disc whose path is unknown
    the motion asks for nothing, and what counts is how many readings are equal.
    """
    if any(trial.id == "accel.saturation" for trial in taken):
        return []
    gain, limits = 0.0, {}
    steps = [0.0]
    for i, chain in enumerate(fit.chains):
        readings = next((r for r in chain.readings if r.sensor == "accelerometer"), None)
        limit = plateau(chain.recording)
        if readings is None or limit is None:
            continue
        limits[i] = limit
        steps.append(chain.recording.sheets["accelerometer"].resolution or 0.0)
        if chain.recording.plant == "free_spin":
            gain += equal_beyond_chance(chain.recording)
            continue
        at, axis = np.nonzero(readings.clipped)
        values = {key: v for key, v in fit.values(i).items() if key[0] != "accel.saturation"}
        moved = readings.t - _lateness(chain, values, readings.t)
        expected = shown(chain, values, "accelerometer", moved)[at, axis]
        beyond = expected * np.sign(readings.value[at, axis]) - limit
        sd = np.where(np.isfinite(readings.sd), readings.sd, noise["accelerometer"].sd)[axis]
        gain += float(np.sum((np.maximum(beyond, 0.0) / sd) ** 2))
    if not limits:
        return []
    limit = float(np.median(list(limits.values())))
    above = [i for i, chain in enumerate(fit.chains) if i not in limits and _largest(chain) > limit + max(steps)]
    recordings = None if not above else frozenset(limits)
    # the readings are the limit, to within a step of the converter
    trial = Trial("accel.saturation", (), recordings, (("limit_m_s2", limit, max(max(steps), 1e-6) / 12.0**0.5),))
    return [Proposal(trial, gain, {})]


def _lateness(chain: Chain, values: Mapping[tuple[str, str], float], written: FloatArray) -> FloatArray:
    late = delay(values, "accelerometer", written)
    lost = chain.lost.get("accelerometer")
    return late if lost is None else late - lost / chain.recording.sheets["accelerometer"].rate_hz


def _largest(chain: Chain) -> float:
    samples = chain.recording.get("accelerometer")
    return 0.0 if samples is None else float(np.nanmax(np.abs(samples.value), initial=0.0))


# ------------------------------------------------------------------------------------------------ speed ripple


def ripple(fit: Fit, noise: NoiseModel, taken: Sequence[Trial] = (), least: float = 25.0) -> list[Proposal]:
    """Return ripples of a table's speed as proposals, best first: several orders where they are near in gain.

    The rate's residual (rate reference, else gyroscope, else the magnetometer's phase) is transformed over the angle
    turned; the best orders are then refined by least squares. The gain is less what so many orders gain by chance.
    """
    recordings = [chain.recording for chain in fit.chains]
    if recordings[0].plant != "rate_table" or any(trial.id == "rig.speed_ripple" for trial in taken):
        return []
    told = [_rate_residual(fit, i, noise) for i in range(len(fit.chains))]
    parts = [part for part in told if part is not None]
    if not parts:
        return []
    psi, e, weight = (np.concatenate([part[j] for part in parts]) for j in range(3))
    width = float(np.ptp(psi))
    if psi.size < 32 or width < 2.0 * np.pi:
        return []
    bins = int(width / _BIN) + 1
    size = 1 << int(np.ceil(np.log2(4 * bins)))
    place = ((psi - psi.min()) / _BIN).astype(np.int64)
    spectrum = np.fft.rfft(np.bincount(place, weight * e, minlength=size)[:size], size)
    order = 2.0 * np.pi * np.fft.rfftfreq(size, _BIN)
    power = 2.0 * np.abs(spectrum) ** 2 / weight.sum()
    inside = (order > max(_ORDERS[0], 4.0 * np.pi / width)) & (order < _ORDERS[1])
    chance = 2.0 * np.log(max(_ORDERS[1] * width / (2.0 * np.pi), 1.0))
    power = np.where(inside, power, 0.0)
    found: list[Proposal] = []
    for top in _peaks(power, 6):
        best = max(
            (_sine(psi, e, weight, o) for o in order[top] + np.linspace(-1.5, 1.5, 61) * np.pi / width),
            key=lambda sine: sine[0],
        )
        best = max(
            (_sine(psi, e, weight, best[1] + step) for step in np.linspace(-0.03, 0.03, 25) * np.pi / width),
            key=lambda sine: sine[0],
        )
        gain, o, amplitude, phase = best
        if gain - chance > least:
            id, shape = "rig.speed_ripple", (("order", o), ("phase_rad", phase))
            trial = Trial(id, (Column(id, "amplitude_rad_s", 0.005, shape),))
            start: dict[tuple[tuple[str, str], frozenset[int] | None], float] = {
                ((id, name), None): number for name, number in (*shape, ("amplitude_rad_s", amplitude))
            }
            if all(abs(o - p.trial.shapes["order"]) > np.pi / width for p in found):
                found.append(Proposal(trial, gain - chance, start))
    found.sort(key=_gain, reverse=True)
    return [p for p in found if p.gain > 0.8 * found[0].gain][:3]


def _sine(psi: FloatArray, e: FloatArray, weight: FloatArray, order: float) -> tuple[float, float, float, float]:
    """Return gain, order, amplitude and phase of the best amplitude sin(order psi + phase)."""
    s, c = np.sin(order * psi), np.cos(order * psi)
    ss, cc, sc = (weight * s) @ s, (weight * c) @ c, (weight * s) @ c
    es, ec = (weight * e) @ s, (weight * e) @ c
    det = ss * cc - sc * sc
    a, b = (cc * es - sc * ec) / det, (ss * ec - sc * es) / det
    return float(a * es + b * ec), float(order), float(np.hypot(a, b)), float(np.arctan2(b, a))


def _rate_residual(fit: Fit, i: int, noise: NoiseModel) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return angle turned, residual of the rate and its weight (n,) of a recording, from the sensor that tells best."""
    linear, chain = fit.linears[i], fit.chains[i]
    command = chain.recording.command
    assert command is not None
    for sensor, axis in (("rate_reference", None), ("gyroscope", "z_rad_s"), ("magnetometer", None)):
        channels = [c for c in linear.channels if c.sensor == sensor and axis in (None, c.axis)]
        if not channels:
            continue
        t = np.concatenate([linear.t[c.rows] for c in channels])
        t = t - delay(fit.values(i), sensor, t)
        rate = np.interp(t, command.t, command.value)
        psi = _turned(command.t, command.value, t)
        e = np.concatenate([linear.residual[c.rows] for c in channels])
        sd = np.concatenate([np.full(c.index.size, noise[c.group].sd) for c in channels])
        moving = np.abs(rate) > 0.5
        if sensor != "magnetometer":
            e = e - np.mean(e)
            return psi[moving], e[moving], sd[moving] ** -2.0
        slope = np.concatenate([linear.own[c.rows, 0] for c in channels])
        ok = moving & (np.abs(slope) > 3.0 * sd)
        # the rate that a slip of phase amounts to is its slope in time: differences of one axis at a time
        return _phase_rate(t[ok], psi[ok], e[ok] / slope[ok], sd[ok] / np.abs(slope[ok]))
    return None


def _phase_rate(
    t: FloatArray, psi: FloatArray, slip: FloatArray, sd: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return angle, rate and weight from slips of phase: averaged per instant, then their differences."""
    instants, inverse = np.unique(t, return_inverse=True)
    if instants.size < 8:
        return None
    w = np.bincount(inverse, sd**-2.0)
    mean = np.bincount(inverse, slip * sd**-2.0) / w
    angle = np.bincount(inverse, psi) / np.bincount(inverse)
    gap = np.diff(instants)
    near = gap < 2.5 * np.median(gap)
    rate = np.diff(mean) / gap
    weight = gap**2 / (1.0 / w[1:] + 1.0 / w[:-1])
    return 0.5 * (angle[1:] + angle[:-1])[near], rate[near], weight[near]


def _turned(t: FloatArray, rate: FloatArray, at: FloatArray) -> FloatArray:
    """Return the angle (n,) that a table has turned at instants by its command's knots."""
    until = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(t))])
    inside = np.clip(at, t[0], t[-1])
    k = np.clip(np.searchsorted(t, inside, side="right") - 1, 0, t.size - 2)
    x = inside - t[k]
    slope = (rate[k + 1] - rate[k]) / (t[k + 1] - t[k])
    outside = (at - inside) * np.where(at > t[-1], rate[-1], rate[0])
    return np.asarray(until[k] + x * (rate[k] + 0.5 * slope * x) + outside)


# ---------------------------------------------------------------------------------------------------- all of it


def searched(
    loose: Fit, tied: Tied, own: Sequence[Parameter], noise: NoiseModel, least: float = 25.0
) -> list[Proposal | Shifted]:
    """Return what all searches propose upon a hypothesis, best first.

    ``loose`` is the relaxed fit with its ``noise``, ``tied`` the fit under the hypothesis so far, ``own`` the stated
    parameters and each recording's unknowns. Without a hypothesis what is missing may have bent the tied fit, and
    events are looked for from the relaxed one.
    """
    taken = tied.hypothesis.trials
    fit, level = (loose, noise) if not taken else (tied.fit, tied.fit.noise)
    found: list[Proposal | Shifted] = []
    if loose.chains[0].recording.plant != "rate_table":
        asked = asked_of(fit, level, own, tied.hypothesis)
        found += events(asked, least)
        found += gusts(asked, least)
    found += ripple(tied.fit, tied.fit.noise, taken, least)
    known = [q for q in own if q.key not in WOBBLE]
    found += dropped_magnetometer(loose, known, taken)
    found += saturation(tied.fit, tied.fit.noise, taken)
    if loose.chains[0].recording.plant != "free_spin":  # there an accelerometer counts by its means over turns
        found += dropped_accelerometer(loose, noise, taken)
    return sorted(found, key=lambda p: p.proposal.gain if isinstance(p, Shifted) else p.gain, reverse=True)
