"""The loop closed on the throws of `discsim validate`: C_Nr from each method, and the flights that it predicts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.disc import Disc
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.trajectory import predict
from discsim.validation.experiments.feedback.experiment import INSIDE, Flown
from discsim.validation.experiments.feedback.scoring import dampings, feed_back, feedback_checks
from discsim.validation.reporting.scores import Score, at_most
from discsim.validation.scenarios.throws import MOUNT_ERROR, ThrowResult
from discsim.validation.yaw_damping import Compared, Fit, PaperTable, Source, fit_yaw_damping, observe, paper_table
from discsim.validation.yaw_damping.observations import Throw

__all__ = ["Loop", "close_loop", "fly_by_table"]

#: methods whose C_Nr is fed back; the accelerometer of these throws is off its place
SOURCES = (Source("best"), Source("fft"), Source("accelerometer", MOUNT_ERROR))
#: so many throws are predicted, from the first
PREDICTED = 2
#: instants of a flight that a line through its true spin is fitted to
TRUE_INSTANTS = 500


@dataclass(frozen=True)
class Loop:
    """Scores, the throws by the best spin with their fit and table, C_Nr by every source, and the predictions.

    ``by_table`` says by source how far a throw that stays inside the table (28) lands off the truth, m, flown with the
    source's table and the true release; empty for a disc whose flight leaves the table.
    """

    scores: tuple[Score, ...]
    throws: tuple[Throw, ...]
    fit: Fit
    paper: PaperTable
    found: tuple[Compared, ...]
    flown: tuple[Flown, ...]
    by_table: Mapping[str, float]


def close_loop(results: Sequence[ThrowResult], disc: Disc, environment: Environment) -> Loop:
    """Fit C_Nr to all throws and predict the first two; the limits are the project's goals.

    1 % of C_Nr, and of the slopes that table (28) is made of; three of its own standard deviations, which a right one
    exceeds in 0.3 % of runs; errors of at most a fifth of those with the accelerometer 1 mm off, where there is one. A
    throw that stays inside the table must land nearer to the truth by it than without any damping.
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
    by_table = fly_by_table(found, disc, environment)
    scores.append(
        at_most("C_Nr: slopes of table (28) against those of the true spin", _slopes(results, paper), "%", 1.0)
    )
    if by_table:
        undamped = _lands_off(replace(disc, aero=disc.aero._replace(CNr=0.0)), disc, environment)
        name = "feedback: landing error by table (28), a throw inside it"
        scores.append(at_most(name, by_table[SOURCES[0].label], "m", undamped))
    return Loop(tuple(scores), tuple(observed["best"]), best, paper, tuple(found), tuple(flown), by_table)


def fly_by_table(found: Sequence[Compared], disc: Disc, environment: Environment) -> dict[str, float]:
    """Return by source how far off (m) `INSIDE` touches down with its table (28) and the true release.

    Empty where the disc's flight leaves the table.
    """
    tables = {item.source.label: item.paper.table for item in found if item.paper is not None}
    try:
        return {
            label: _lands_off(replace(disc, yaw_damping_table=table), disc, environment)
            for label, table in tables.items()
        }
    except InputError:
        return {}


def _lands_off(flown: Disc, disc: Disc, environment: Environment) -> float:
    ends = [predict(one, environment, INSIDE.release).landing for one in (flown, disc)]
    return float(np.linalg.norm(ends[0] - ends[1]))


def _slopes(results: Sequence[ThrowResult], paper: PaperTable) -> float:
    """Return by how much (%) the table's slopes differ in sum from lines through the true spin at the same times.

    The table is their sum times 1/(r V), whatever the disc, so that this is the error of each of its nodes.
    """
    true = 0.0
    for result, line in zip(results, paper.slopes, strict=True):
        t = np.linspace(float(line.t[0]), float(line.t[-1]), TRUE_INSTANTS)
        true += float(np.polyfit(t, np.abs(result.motion.at(t).rate[:, 2]), 1)[0])
    return 100 * (sum(line.slope for line in paper.slopes) / true - 1)
