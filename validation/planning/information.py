"""What recordings tell: the normal equations of the diagnosis' screening, and the questions put to them.

Each recording's own unknowns are eliminated (Schur complement); what is left is the Fisher information of the numbers
that recordings share. The gain in chi-squared that an effect of size s brings on average is its noncentrality
``s^T I s``, with I the information that is left once all that may move besides has taken its part.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Aero
from discsim.errors import InputError
from discsim.recording import Recording
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, available, candidates_for, free_candidate
from discsim.validation.diagnosis.candidates.screening import columns_about
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.identification.gauss_newton import Fit, linearised, linearised_columns
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import GroupNoise, NoiseModel, stated_noise
from discsim.validation.identification.normal_equations import reduce
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.stated_parameters import stated_parameters

__all__ = ["Information", "Questions", "information_of", "inverse", "questions_of"]

#: half the difference by which the slope in a coefficient is taken: this share of an ordinary size of it
_STEP = 0.01
_ORDINARY = {"CL0": 0.1, "CLa": 2.0, "CD0": 0.06, "CDa": 1.0, "alpha0": 0.05, "CM0": 0.01, "CMa": 0.1, "CMq": 0.1,
             "CRr": 3e-3, "CRp": 0.1, "CNr": 4e-3}  # fmt: skip
#: a gust that is asked about lasts so long, s; what comes at an instant comes in the middle of the first recording
_GUST_S = 0.3


@dataclass(frozen=True)
class Questions:
    """What is asked of recordings: numbers that are stated with a sigma, coefficients of the disc, and effects.

    ``silent`` are effects that no linear question foretells.
    """

    known: tuple[Parameter, ...]
    coefficients: tuple[Parameter, ...]
    candidates: tuple[CandidateEffect, ...]
    silent: tuple[str, ...]

    @property
    def columns(self) -> tuple[Column, ...]:
        """The columns of all that is asked, each once."""
        asked = [_column(q) for q in (*self.known, *self.coefficients)]
        return tuple(
            dict.fromkeys((*asked, *(column for candidate in self.candidates for column in candidate.columns)))
        )


def questions_of(recordings: Sequence[Recording], instant: float) -> Questions:
    """Return what can be asked of recordings; events happen at ``instant`` (s) of the first of them."""
    one = recordings[0]
    known = stated_parameters(recordings)
    coefficients: tuple[Parameter, ...] = ()
    if one.disc is not None and one.disc.aero is not None and one.environment.air_density is not None:
        coefficients = tuple(
            Parameter("aero", name, float(getattr(one.disc.aero, name)), _STEP * _ORDINARY[name])
            for name in Aero._fields
        )
    candidates = [candidate for candidate in candidates_for(recordings) if all(map(_in_reach, candidate.columns))]
    silent = []
    for row in available(recordings):
        shape = {"t_s": instant, "width_s": _GUST_S, "order": 1.0, "phase_rad": 0.0}
        given = tuple((name, shape[name]) for name in row.parameters if name in shape)
        if row.event or row.per_turn:
            candidate = free_candidate(row.id, given)
            candidates.append(replace(candidate, recordings=frozenset([0])) if row.event else candidate)
        elif not any(candidate.id == row.id for candidate in candidates):
            silent.append(row.id)
    return Questions(known, coefficients, tuple(candidates), tuple(silent))


def _in_reach(column: Column) -> bool:
    return column.step > 0.0


def _column(q: Parameter) -> Column:
    return Column(q.group, q.name, q.step)


@dataclass(frozen=True)
class Information:
    """The information of planned recordings.

    Attributes
    ----------
    questions : Questions
    grams : (n, c, c) array
        What each recording says of the columns of the questions, its own unknowns eliminated.
    noise : mapping
        Noise of each group of readings.
    trajectories, linears
        The recordings and how their readings depend on everything, to ask again in other noise.
    """

    questions: Questions
    grams: FloatArray
    noise: NoiseModel
    trajectories: tuple[Trajectory, ...]
    linears: tuple[Linear, ...]

    def times(self, count: int) -> Information:
        """Return the information of each recording made ``count`` times."""
        return replace(self, grams=np.concatenate([self.grams] * count))

    def plus(self, gram: FloatArray) -> Information:
        """Return the information with one more recording's (c, c)."""
        return replace(self, grams=np.concatenate([self.grams, gram[None]]))

    def quieter(self, factors: Mapping[str, float]) -> Information:
        """Return the information of the same recordings with the noise of groups multiplied by ``factors``."""
        noise = {name: GroupNoise(item.sd * factors.get(name, 1.0)) for name, item in self.noise.items()}
        grams = [
            _gram(linear, one, noise, self.questions)
            for linear, one in zip(self.linears, self.trajectories, strict=True)
        ]
        repeats = len(self.grams) // len(grams)
        return replace(self, grams=np.concatenate([np.stack(grams)] * repeats), noise=noise)

    def places(self, columns: Sequence[Column]) -> list[int]:
        """Return where columns stand in the matrices."""
        place = {column: k for k, column in enumerate(self.questions.columns)}
        return [place[column] for column in columns]

    def summed(self) -> FloatArray:
        """Return the matrix (c, c) of all recordings; what happens in one of them only is asked of that one."""
        total = np.sum(self.grams, axis=0)
        for candidate in self.questions.candidates:
            if candidate.recordings is not None:
                some = self.places(candidate.columns)
                only = np.sum(self.grams[sorted(candidate.recordings)], axis=0)
                total[some], total[:, some] = only[some], only[:, some]
        return np.asarray(total)

    def left(self, free: Sequence[Parameter], *, held: bool = True) -> FloatArray:
        """Return the matrix (c, c) once ``free`` have taken their part, each ``held`` by its sigma or not at all."""
        H = self.summed()
        some = self.places([_column(q) for q in free])
        if not some:
            return H
        prior = np.array([q.sigma**-2.0 if held and np.isfinite(q.sigma) else 0.0 for q in free])
        A = H[np.ix_(some, some)] + np.diag(prior)
        return np.asarray(H - H[:, some] @ inverse(A) @ H[some])


def inverse(H: FloatArray) -> FloatArray:
    """Return the inverse of an information matrix; what nothing shows takes no part."""
    scale = np.where(np.diag(H) > 0.0, 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300)), 0.0)
    w, V = np.linalg.eigh(H * np.outer(scale, scale))
    kept = w > 1e-9 * max(float(w[-1]), 1e-300)
    return np.asarray(((V[:, kept] / w[kept]) @ V[:, kept].T) * np.outer(scale, scale))


def information_of(
    trajectories: Sequence[Trajectory], questions: Questions, noise: NoiseModel | None = None
) -> Information:
    """Return what recordings tell where their trajectories stand; ``noise`` is by default that of their sheets.

    Raises `InputError` where the readings' slopes are not finite.
    """
    own = unknowns([trajectories[0].recording])
    linears, grams = [], []
    for one in trajectories:
        parameters = tuple(replace(q, recordings=None) for q in own)
        fit = Fit((one,), parameters, np.array([q.stated for q in parameters]), one.plant.sizes.continuous, {})
        if noise is None:
            noise = stated_noise(linearised(fit, ()))
        # the columns start with the recording's own unknowns; the rest stands in the order of the questions
        (linear,) = linearised_columns(fit, columns_about(fit, _asked(questions)))
        linears.append(linear)
        grams.append(_gram(linear, one, noise, questions))
    assert noise is not None
    if not np.all(np.isfinite(grams)):
        raise InputError("a planned recording leaves what is finite; expected throws that a disc can fly")
    return Information(questions, np.stack(grams), noise, tuple(trajectories), tuple(linears))


def _asked(questions: Questions) -> list[CandidateEffect]:
    """Return candidates that hold the columns of all questions in their order."""
    return [CandidateEffect("", questions.columns)]


def _gram(linear: Linear, one: Trajectory, noise: NoiseModel, questions: Questions) -> FloatArray:
    """Return what one recording says of the questions (c, c), its states and own unknowns eliminated."""
    G = reduce(linear, one, noise, one.plant.sizes.continuous).gram[:-1, :-1]
    own = unknowns([one.recording])
    n = len(own)
    if len(G) != n + len(questions.columns):
        raise ValueError(f"a matrix over {len(G)} columns; expected {n + len(questions.columns)}")
    prior = np.array([q.sigma**-2.0 if np.isfinite(q.sigma) else 0.0 for q in own])
    mine = inverse(G[:n, :n] + np.diag(prior)) if n else np.zeros((0, 0))
    return np.asarray(G[n:, n:] - G[n:, :n] @ mine @ G[:n, n:])
