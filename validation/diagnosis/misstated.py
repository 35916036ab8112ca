"""Numbers that recordings state as exact, and that would explain them were they others: a mass without its module's.

Takes a search that leaves more than noise; gives the stated numbers that leave nothing but noise once they are free. A
number without a sigma is exact and moves in no answer. But a disc is weighed before its board is on, and a reader wants
to know.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from discsim.validation.diagnosis.answer.misstated import Misstated
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit, standard_errors
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.early_verdict import contradiction_in
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, chi2_in, hopeless, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.stated_parameters import STATED_NAMES, exact_numbers, stated_parameters

__all__ = ["misstated", "reconciling"]

#: how far a stated number is off, as a share of it: a board of 30 g on a disc of 140 g; other units are told by a check
_WIDTH = 0.3
#: ratios Izz/Ixx that are tried, 4 % apart: 1.85 to 2 of bare discs as measured, less with a board in the middle. In
#: half a second at 50 rad/s a ratio that is 2 % off turns the wobble by a radian
_RATIOS = (1.93, 1.85, 1.78, 1.71)
#: a number that is this many of its standard errors off has moved, as a recalibrated one has
_MOVED = 3.0


def misstated(found: Search, explains: Callable[[Search], bool]) -> tuple[tuple[Misstated, ...], ...]:
    """Return sets of numbers of which each explains recordings where they are free, no effect beside them.

    All that the plant's hardware has are free at first: where these do not explain, none of them does. Then those alone
    that moved, and where none did by much, each alone. ``explains`` tells whether a search's final fit leaves nothing
    but noise.
    """
    every = [_free(key, size) for key, size in exact_numbers(found.recordings).items()]
    together = _explaining(found, every, explains) if every else ()
    if len(every) < 2 or not together:
        return (together,) if together else ()
    pairs = zip(every, together, strict=True)
    moved = [q for q, one in pairs if abs(one.value - one.stated) > _MOVED * one.sd]
    fewer = _explaining(found, moved, explains) if 0 < len(moved) < len(every) else ()
    if fewer:
        return (fewer,)
    alone = [_explaining(found, [one], explains) for one in every]
    return tuple(one for one in alone if one) or (together,)


def reconciling(problem: SearchProblem, explains: Callable[[Search], bool]) -> tuple[Misstated, ...]:
    """Return the moment of inertia under which recordings are explained whose sensors contradict one another as stated.

    A wrong ratio of the two has a disc wobble at another rate than its gyroscope shows, by radians within a segment, so
    that no step leads to the right one: those of discs are tried.
    """
    numbers = exact_numbers(problem.as_stated or problem.recordings)
    disc = problem.recordings[0].disc
    if disc is None or ("disc", "Ixx") not in numbers:
        return ()
    for ratio in _RATIOS:
        others = {"Ixx": disc.Izz / ratio, "Izz": disc.Ixx * ratio}
        for place, size in others.items():
            if ("disc", place) not in numbers:
                continue
            free = _free(("disc", place), size)
            recordings = [replace(one, disc=replace(disc, **{place: size})) for one in problem.recordings]  # type: ignore[arg-type]
            if contradiction_in(recordings, (*stated_parameters(recordings), *problem.free, free)) is not None:
                break
            found = screened(replace(problem, recordings=recordings, free=(*problem.free, free)))
            if explains(found):
                return tuple(replace(one, stated=numbers["disc", place]) for one in _moved(found.base, [free]))
    return ()


def _free(key: tuple[str, str], size: float) -> Parameter:
    """Return a number that is stated as exact as a parameter that may move."""
    return Parameter(*key, size, 1e-3 * _WIDTH * size, _WIDTH * size)


def _explaining(found: Search, free: Sequence[Parameter], explains: Callable[[Search], bool]) -> tuple[Misstated, ...]:
    """Return numbers as they are where they are free, if nothing but noise is left then; else none."""
    base, noise = found.base, found.relaxed_noise
    weak = found.relaxed_fit.plant.weakly_identified
    fitted = continuous_fit(
        base.fit if weak else found.relaxed_fit,
        Hypothesis(),
        (*found.own, *free),
        noise,
        values_of_fit(base) if weak else {},
        bars=hopeless(chi2_in(base, noise), base.fit.count),
    )
    if not np.isfinite(fitted.score) or not explains(replace(found, final=fitted)):
        return ()
    return _moved(fitted, free)


def _moved(fitted: ContinuousFit, free: Sequence[Parameter]) -> tuple[Misstated, ...]:
    """Return numbers where a fit has them, with their standard errors; none where these are not known."""
    fit = fitted.fit
    places = {q.key: k for k, q in enumerate(fit.parameters)}
    some = [places[q.key] for q in free]
    values, sd = fit.at[some], standard_errors(fitted)[some]
    if not np.all(np.isfinite([values, sd])):
        return ()
    triples = zip(free, values.tolist(), sd.tolist(), strict=True)
    return tuple(Misstated(STATED_NAMES[q.key], q.stated, value, error) for q, value, error in triples)
