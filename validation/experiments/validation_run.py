"""The validation run: closed forms, rate table, throws, C_Nr fed back, concealed cases; scores, pictures, a page."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from discsim.errors import InputError
from discsim.files import write_text
from discsim.recording import Recording
from discsim.validation.experiments.concealed import FULL_CASES, QUICK_CASES, concealed_cases, concealed_checks
from discsim.validation.experiments.feedback.figures import draw_fig_13
from discsim.validation.experiments.feedback.loop import Loop, close_loop
from discsim.validation.experiments.recorded import recording_checks
from discsim.validation.experiments.subject import Subject, shipped_subject
from discsim.validation.experiments.validation_report import draw_throws, write_validation_report
from discsim.validation.reporting.limits import Limit, limited, limits_text, read_limits, unguarded
from discsim.validation.reporting.regression import Change, compare_scores, read_scores, write_regression
from discsim.validation.reporting.run import Run
from discsim.validation.reporting.scores import Score, write_junit
from discsim.validation.scenarios.closed_forms import closed_form_checks
from discsim.validation.scenarios.rate_table import (
    Plateau,
    RateTableRun,
    plateau_table,
    plateaus,
    rate_table_checks,
    run_rate_table,
    write_plateaus,
)
from discsim.validation.scenarios.rate_table_figures import draw_methods, draw_waveform
from discsim.validation.scenarios.throws import ThrowResult, fly_throws, throw_checks
from discsim.validation.yaw_damping.figures import draw_fit, draw_sources, draw_surface

__all__ = ["Judging", "Validated", "validate"]


@dataclass(frozen=True)
class Judging:
    """What scores are held against: limits and an earlier run; and what is recorded into a file of limits.

    ``margin`` is in standard deviations, None for what `limits_text` takes. `read` reads limits and the earlier run, so
    that what is wrong with them is said before the work.
    """

    limits: Mapping[str, Limit] = field(default_factory=dict)
    before: Sequence[Score] | None = None
    record: Path | None = None
    seeds: int = 5
    margin: float | None = None
    against: Path | None = None

    @classmethod
    def read(cls, shipped: Mapping[str, Limit], limits: Path | None, against: Path | None) -> Judging:
        """Read a file of limits, which go before shipped ones, and earlier scores; raises `InputError` as they do."""
        known = {**shipped, **({} if limits is None else read_limits(limits))}
        return cls(known, None if against is None else read_scores(against), against=against)


@dataclass(frozen=True)
class Validated:
    """The scores of a run as judged, and what has changed against an earlier one."""

    scores: list[Score]
    changes: list[Change] = field(default_factory=list)


@dataclass(frozen=True)
class _Measured:
    """What one seed gave: the scores of all that draws random numbers, and what the pictures show."""

    scores: list[Score]
    table_run: RateTableRun
    table: list[Plateau]
    results: list[ThrowResult]
    loop: Loop


def validate(
    run: Run,
    *,
    quick: bool,
    junit: Path | None = None,
    subject: Subject | None = None,
    judging: Judging | None = None,
    recordings: Sequence[Recording] = (),
) -> Validated:
    """Run everything, write ``scores.json``, ``report.html`` and figures into the run's folder, return the scores.

    With an earlier run in ``judging`` also ``against.html``.
    """
    started = time.monotonic()
    subject, judging = subject or shipped_subject(quick), judging or Judging()

    requests = QUICK_CASES if quick else FULL_CASES
    with concealed_cases(requests) as cases:
        run.step("engine against closed forms")
        scores = closed_form_checks(subject.disc, subject.environment)
        measured = _measure(run, run.rng, subject)
        scores += measured.scores
        _draw(run, measured)
        concealed = list(run.progress(cases, len(requests), "concealed case"))
    scores += concealed_checks(concealed)
    if recordings:
        run.step("recordings")
        scores += recording_checks(recordings)

    if judging.record is not None:
        _record(run, judging, subject, scores)
    for line in unguarded(scores, judging.limits):
        run.step(line)
    scores = limited(scores, judging.limits)
    run.step("report")
    run.write_json("scores.json", [item.as_dict() for item in scores])
    if junit is not None:
        write_junit(junit, scores, time.monotonic() - started)
    changes = [] if judging.before is None else compare_scores(judging.before, scores)
    if judging.before is not None:
        write_regression(run.out, changes, str(judging.against))
    write_validation_report(run, scores, measured.results, measured.loop, concealed)
    return Validated(scores, changes)


def _measure(run: Run, rng: np.random.Generator, subject: Subject) -> _Measured:
    """Turn the table, fly the throws, fit C_Nr and feed it back, all with one stream of random numbers."""
    table_stream, throw_stream = rng.spawn(2)
    run.step("rate table")
    table_run = run_rate_table(subject.profile, subject.environment, table_stream)
    table = plateau_table(table_run)
    scores = rate_table_checks(table_run, table)
    flown = fly_throws(subject.throws, subject.disc, subject.environment, throw_stream, subject.parts)
    results = list(run.progress(flown, len(subject.throws), "throw"))
    scores += throw_checks(results)
    run.step("C_Nr and the flights that it predicts")
    loop = close_loop(results, subject.disc, subject.environment)
    return _Measured([*scores, *loop.scores], table_run, table, results, loop)


def _draw(run: Run, measured: _Measured) -> None:
    write_plateaus(run.out / "plateaus.csv", measured.table)
    draw_methods(measured.table_run, run.out / "rate-table.png")
    if plateaus(measured.table_run.profile):
        draw_waveform(measured.table_run, run.out / "waveform.png")
    else:
        (run.out / "waveform.png").unlink(missing_ok=True)  # of an earlier run into this folder
    draw_throws(measured.results, run.out / "throws.png")
    loop = measured.loop
    draw_fit(loop.throws, loop.fit, loop.paper, run.out / "cnr.png")
    draw_sources(loop.found, run.out / "cnr-sources.png")
    draw_surface(loop.paper, loop.fit, run.out / "cnr-table.png")
    draw_fig_13(loop.flown[0], run.out / "feedback.png")


def _record(run: Run, judging: Judging, subject: Subject, scores: Sequence[Score]) -> None:
    """Write limits from this run and as many more seeds as asked for."""
    assert judging.record is not None
    if run.seed is None:
        raise InputError("--record-limits needs a seed to count on from")
    runs = [list(scores)]
    for number in range(1, judging.seeds):
        run.step(f"seed {run.seed + number}, {number + 1} of {judging.seeds}")
        runs.append(_measure(run, np.random.default_rng(run.seed + number), subject).scores)
    write_text(judging.record, limits_text(runs, " ".join(["discsim", *run.command]), judging.margin))
