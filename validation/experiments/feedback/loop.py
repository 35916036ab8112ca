"""The loop closed on the throws of `discsim validate`: C_Nr from each method, and the flights that it predicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discsim.disc import Disc
from discsim.environment import Environment
from validation.experiments.feedback.experiment import Flown
from validation.experiments.feedback.scoring import dampings, feed_back, feedback_checks
from validation.reporting.scores import Score, at_most
from validation.scenarios.throws import MOUNT_ERROR, ThrowResult
from validation.yaw_damping import Compared, Fit, PaperTable, Source, fit_yaw_damping, observe, paper_table
from validation.yaw_damping.observations import Throw

__all__ = ["Loop", "close_loop"]

#: methods whose C_Nr is fed back; the accelerometer of these throws is off its place
SOURCES = (Source("best"), Source("fft"), Source("accelerometer", MOUNT_ERROR))
#: so many throws are predicted, from the first
PREDICTED = 2


@dataclass(frozen=True)
class Loop:
    """Scores, the throws by the best spin with their fit and table, C_Nr by every source, and the predictions."""

    scores: tuple[Score, ...]
    throws: tuple[Throw, ...]
    fit: Fit
    paper: PaperTable
    found: tuple[Compared, ...]
    flown: tuple[Flown, ...]


def close_loop(results: Sequence[ThrowResult], disc: Disc, environment: Environment) -> Loop:
    """Fit C_Nr to all throws and predict the first two; the limits are the project's goals.

    1 % of C_Nr; three of its own standard deviations, which a right one exceeds in 0.3 % of runs; errors of at most a
    fifth of those with the accelerometer 1 mm off, where there is one.
    """
    assert disc.aero is not None
    sources = [source for source in SOURCES if all(source.method in result.rates for result in results)]
    observed = {
        source.label: [observe(result.recording, source.method, result.rates[source.method]) for result in results]
        for source in sources
    }
    found, start = [], None
    for source in sources:
        fit = fit_yaw_damping(observed[source.label], start)
        start = [throw.state for throw in fit.throws] if start is None else start
        found.append(Compared(source, fit, paper_table(observed[source.label])))
    best, paper = found[0].fit, found[0].paper
    assert best is not None
    assert paper is not None

    flown = []
    for number, result in enumerate(results[:PREDICTED]):
        seen = {label: throws[number] for label, throws in observed.items()}
        predicted = feed_back(result.motion, result.throw.release, disc, environment, dampings(found), seen)
        flown.append(Flown(result.throw.name, result.motion, tuple(predicted)))

    scores = [
        at_most("C_Nr: error with the best spin", 100 * (best.CNr / disc.aero.CNr - 1), "%", 1.0),
        at_most("C_Nr: error over its standard deviation", (best.CNr - disc.aero.CNr) / best.sd, "1", 3.0),
    ]
    compared = SOURCES[2] in sources
    ratios = [feedback_checks(item.name, item.predicted) for item in flown] if compared else []
    for what, column in zip(("landing", "track"), zip(*ratios, strict=True), strict=compared):
        worst = float(np.max([score.value for score in column]))
        limit = column[0].tolerance
        scores.append(
            at_most(f"feedback: worst {what} error of best over that of accelerometer, 1 mm", worst, "1", limit)
        )
    return Loop(tuple(scores), tuple(observed["best"]), best, paper, tuple(found), tuple(flown))
