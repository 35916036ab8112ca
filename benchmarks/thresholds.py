"""What chance alone reaches against each limit of a diagnosis: data sets in which nothing is hidden.

    python benchmarks/thresholds.py --sets 400 --seed 0 --out docs/thresholds --write

Each set has two or three short recordings of one plant, drawn and simulated as the blind test draws them: in half of
the sets all is as stated, in a quarter the noise of some sensors is louder, quieter or slower than stated, in a quarter
stated numbers are off within their sigma where a plant has such numbers. Asked is what the first step of a diagnosis
asks about the fitted baseline: the largest gain of any effect, event, gust or ripple against its price (by a score
test; what comes near its price is refitted, as in a diagnosis), and what the tests of the residuals reach against their
limits. Where one goes beyond its limit the whole diagnosis is made and its verdict noted. Each set is a row of
``sets.csv`` as soon as it is done: an interrupted run goes on from there.

``--write`` puts the table of rates between the marks in docs/thresholds.md.
"""

from __future__ import annotations

import argparse
import csv
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.stats import beta

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.arrays import FloatArray
from discsim.files import write_text
from discsim.recording import PLANTS, Recording, Samples
from discsim.validation.challenge.cases.case import Case, Coast, Kind, Run, Turning
from discsim.validation.challenge.cases.conceal import recordings as simulated
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.candidates.candidate import parameters_of
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate, screened_candidates
from discsim.validation.diagnosis.detectors.events import events
from discsim.validation.diagnosis.detectors.gusts import gusts
from discsim.validation.diagnosis.detectors.local_problem import local_problems
from discsim.validation.diagnosis.detectors.speed_ripple import ripple
from discsim.validation.diagnosis.detectors.time_offsets import time_offsets
from discsim.validation.diagnosis.inertia import with_inertia
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.prepared import prepared
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Search, chi2_in, values_of_fit
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.settings import RELAXED_FIT, SELECTION
from discsim.validation.identification.noise import robust_noise, stated_noise, whitened
from discsim.validation.identification.residual_tests import RESIDUAL_TESTS, unmodelled_residuals
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.progress import shown

PAGE = Path(__file__).resolve().parent.parent / "docs" / "thresholds.md"
MARKS = ("<!-- rates: benchmarks/thresholds.py -->", "<!-- end of rates -->")
#: what is recorded of a flight or a free spin, of a run-down and of a table, s
FLIGHT, RUN, TABLE = 1.2, 4.0, 6.0
#: kinds of set with nothing hidden, in turn
KINDS: Sequence[Kind] = ("nothing", "noise", "nothing", "within_sigma")
#: what comes this near its price by algebra is refitted
NEAR = 12.0
#: a set's first columns
HEAD = ("set", "plant", "kind", "recordings", "readings")


@dataclass(frozen=True)
class Limit:
    """A column of the table, what it is in words, and the limit that a diagnosis has for it.

    Beyond it an ``alarm`` may follow; else other starts are tried, which takes time alone.
    """

    column: str
    words: str
    limit: float
    plants: tuple[str, ...] = PLANTS
    alarm: bool = True


#: gains are twice the log likelihood, less what is charged for each parameter
LIMITS = (
    Limit("effect", "an effect", SELECTION.entry),
    Limit(
        "other_disc",
        "a disc's effect in one recording",
        SELECTION.entry + SELECTION.other_disc,
        ("flight", "free_spin"),
    ),
    Limit("event", "an event", SELECTION.event_entry, ("flight", "free_spin", "spin_down")),
    Limit("gust", "a gust", SELECTION.gust_entry, ("flight",)),
    Limit("ripple", "a ripple of a table's speed", SELECTION.entry, ("rate_table",)),
    Limit("time_offset", "an offset of time on a rig", SELECTION.entry, ("spin_down", "rate_table")),
    Limit("band", "a band of frequency", RESIDUAL_TESTS.band_z),
    Limit("window", "a window of time", RESIDUAL_TESTS.window_z),
    Limit("course", "a course in common", RESIDUAL_TESTS.course_gain),
    Limit("loudness", "a loud and slow noise", RESIDUAL_TESTS.loud),
    Limit("far", "χ² per reading, baseline", SELECTION.far),
    Limit("astray", "χ² per reading, relaxed fit", RELAXED_FIT.astray, alarm=False),
)
COLUMNS = (*HEAD, *(limit.column for limit in LIMITS), *(f"{limit.column}_is" for limit in LIMITS[:6]), "verdict")


def null_set(number: int, seed: int) -> tuple[Case, list[Recording]]:
    """Return a set with nothing hidden, its plant and kind by its number, and its recordings."""
    plant, kind = PLANTS[number % len(PLANTS)], KINDS[(number // len(PLANTS)) % len(KINDS)]
    case = draw_case(100_000 * seed + number, plant, kind=kind)
    runs = [_cut(run) for run in case.runs[: 3 if number // (len(PLANTS) * len(KINDS)) % 4 == 3 else 2]]
    case = replace(case, runs=tuple(runs), stated_releases=case.stated_releases[: len(runs)], longest=FLIGHT)
    return case, simulated(case)


def _cut(run: Run) -> Run:
    if isinstance(run, Coast):
        return replace(run, duration=RUN)
    if isinstance(run, Turning):
        inside = run.profile.t < TABLE
        return replace(run, profile=Samples(run.profile.t[inside], run.profile.value[inside]))
    return run


def asked(case: Case, recordings: Sequence[Recording]) -> dict[str, str]:
    """Return a set's row: what chance reaches in it."""
    names = [recording.name for recording in recordings]
    fitted, _ = with_inertia(prepared(recordings, names)[0])
    found = screened(SearchProblem(fitted))
    base = found.base
    near = screened_candidates(found.about(base.fit).equations, found.candidates, Hypothesis(), found.own)
    odd = [p for p in near if p.candidate.recordings is not None and p.candidate.row.in_all]
    best: dict[str, Sequence[ScreenedCandidate]] = {
        "effect": [p for p in near if p not in odd],
        "other_disc": odd,
        "ripple": ripple(base.fit, base.fit.noise, (), 0.0),
        "time_offset": time_offsets(base.fit, base.fit.noise, (), 0.0),
    }
    if not found.relaxed_fit.plant.commanded:
        linears = found.relaxed_fit.linears
        steady = robust_noise(linears, [linear.residual for linear in linears])
        ground = local_problems(found.relaxed_fit, steady, found.own, Hypothesis())
        best |= {"event": events(ground, 0.0), "gust": gusts(ground, 0.0)}
    row = dict(zip(HEAD, (str(case.seed), case.plant, case.kind, str(len(names)), str(base.fit.count)), strict=True))
    for limit in LIMITS:
        if some := best.get(limit.column, ()):
            top = max(some, key=_less)
            row[limit.column] = f"{_reached(found, top, limit):.3f}"
            row[f"{limit.column}_is"] = top.candidate.name
    row |= {name: f"{value:.3f}" for name, value in _left(found).items()}
    return row


def beyond_any(row: Mapping[str, str]) -> bool:
    """Tell whether chance went beyond a limit after which an alarm may follow."""
    return any(limit.alarm and float(row[limit.column] or 0.0) > limit.limit for limit in LIMITS)


def verdict_on(number: int, seed: int) -> str:
    """Return the verdict of a whole diagnosis on a set."""
    return diagnose([null_set(number, seed)[1]], ["null"]).diagnosis.verdict


def _less(screened: ScreenedCandidate) -> float:
    return screened.gain - SELECTION.per_parameter * len(parameters_of(screened.candidate))


def _reached(found: Search, top: ScreenedCandidate, limit: Limit) -> float:
    """Return the gain of a proposal less what its parameters cost; by a refit where that comes near the limit."""
    if limit.column != "ripple" and _less(top) < limit.limit - NEAR:
        return _less(top)
    base = found.base
    refitted = continuous_fit(
        found.relaxed_fit if limit.column in ("event", "gust") else base.fit,
        Hypothesis((top.candidate,)),
        found.own,
        base.fit.noise,
        {**values_of_fit(base), **top.start},
    )
    return base.score - refitted.score - SELECTION.per_parameter * len(parameters_of(top.candidate))


def _left(found: Search) -> dict[str, float]:
    """Return what the tests of residuals reach of the fitted baseline, whatever their limits."""
    base = found.base
    least = replace(RESIDUAL_TESTS, band_z=-np.inf, band_share=-1.0, window_z=-np.inf, course_gain=0.0, loud=0.0)
    reached: dict[str, float] = {}
    settled = found.relaxed_fit.plant.durations.settled
    for item in unmodelled_residuals(base.fit.linears, base.residuals, base.fit.noise, least, settled):
        kind = {"course": "course", "window": "window", "swallowed": "loudness"}.get(item.kind, "band")
        size = item.z**2 if kind == "course" else item.z
        reached[kind] = max(reached.get(kind, -np.inf), size)
    reached["far"] = chi2_in(base, found.relaxed_noise) / base.fit.count
    noise = stated_noise(found.relaxed_fit.linears)
    reached["astray"] = max(
        float(np.sum(whitened(linear, noise, linear.residual[:, None]) ** 2)) / linear.raw.size
        for linear in found.relaxed_fit.linears
    )
    return reached


# ------------------------------------------------------------------------------------------------ rates


def excess(reached: FloatArray, limit: float) -> tuple[int, float, float]:
    """Return how many of the sets (n,) went beyond a limit, the 95 % bound of that rate, and the rate by the tail.

    The excess over a high level falls off exponentially (peaks over a threshold: S. Coles, An Introduction to
    Statistical Modeling of Extreme Values, 2001, section 4), here over what one set in ten reaches.
    """
    n, over = reached.size, int(np.sum(reached > limit))
    bound = float(beta.ppf(0.95, over + 1, n - over)) if over < n else 1.0
    level = float(np.quantile(reached, 0.9))
    scale = float(np.mean(reached[reached > level] - level))
    return over, bound, min(0.1 * float(np.exp(-(limit - level) / scale)), 1.0)


def columns_of(rows: Sequence[Mapping[str, str]]) -> dict[str, FloatArray]:
    """Return what the sets reached (n,) by column, of the plants in which it is asked; 0 where nothing was proposed."""
    return {
        limit.column: np.array([float(row[limit.column] or 0.0) for row in rows if row["plant"] in limit.plants])
        for limit in LIMITS
    }


def rates_table(rows: Sequence[Mapping[str, str]]) -> str:
    """Return the table of rates as the page has it."""
    lines = [
        "| what chance may pass for | limit | sets | half of the sets reach | one in a hundred | largest | beyond the "
        "limit | at most (95 %) | by the tail |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for limit in LIMITS:
        reached = columns_of(rows)[limit.column]
        if reached.size < 20:
            continue
        over, bound, tail = excess(reached, limit.limit)
        half, late = np.quantile(reached, [0.5, 0.99])
        lines.append(
            f"| {limit.words} | {limit.limit:g} | {reached.size} | {half:.1f} | {late:.1f} | {reached.max():.1f} | "
            f"{over} | {100 * bound:.1f} % | {_share(tail)} |"
        )
    far = [row["verdict"] for row in rows if beyond_any(row)]
    false = sum(verdict not in ("consistent", "recalibrated") for verdict in far)
    bound = float(beta.ppf(0.95, false + 1, len(rows) - false))
    waiting = f" ({far.count('')} of them still to be diagnosed)" if "" in far else ""
    lines += [
        "",
        f"In {len(far)} of the {len(rows)} sets chance went beyond a limit. {false} of these come out as explained or "
        f"unexplained{waiting}: false alarms in {100.0 * false / len(rows):.1f} % of the sets, at most "
        f"{100.0 * bound:.1f} % (95 %).",
    ]
    return "\n".join(lines)


def _share(rate: float) -> str:
    return f"1 in {float(f'{1.0 / rate:.1g}'):,.0f}" if rate > 1e-9 else "less than 1 in 1e9"


def draw(rows: Sequence[Mapping[str, str]], path: Path) -> None:
    """Draw the share of sets beyond each size, and the limits."""
    reached = columns_of(rows)
    some = [limit for limit in LIMITS if reached[limit.column].size >= 20]
    lines = -(-len(some) // 4)
    figure, axes = new_figure(lines, 4, width=11.0, height=2.4 * lines, squeeze=False)
    for panel, limit in zip(axes.flat, some, strict=False):
        x = np.sort(reached[limit.column])
        panel.step(x, 1.0 - np.arange(x.size) / x.size, where="post", color="#0072b2")
        level = float(np.quantile(x, 0.9))
        far = np.linspace(level, max(limit.limit, x[-1]), 20)
        panel.plot(far, 0.1 * np.exp(-(far - level) / np.mean(x[x > level] - level)), ":", color="#0072b2")
        panel.axvline(limit.limit, color="#d55e00")
        panel.set_yscale("log")
        panel.set_ylim(1e-4, 1.2)
        panel.set_xlim(left=max(float(x[0]), -0.5 * limit.limit))
        panel.set_title(limit.words)
    for panel in axes.flat[len(some) :]:
        panel.set_visible(False)
    for panel in axes[:, 0]:
        panel.set_ylabel("share of sets beyond")
    save_figure(figure, path)


# ------------------------------------------------------------------------------------------------ running


def known_rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table that is there, less a last one that was cut off while it was written."""
    if not path.exists():
        return []
    text = path.read_text(encoding="utf-8")
    rows = csv.DictReader(text[: text.rfind("\n") + 1].splitlines())
    return [{name: row.get(name) or "" for name in COLUMNS} for row in rows]


def _write(rows: Sequence[Mapping[str, str]], path: Path) -> None:
    write_text(path, "\n".join([",".join(COLUMNS), *(",".join(row[name] for name in COLUMNS) for row in rows), ""]))


def main() -> None:
    """Simulate, ask, write."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--sets", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, required=True, help="folder of sets.csv and thresholds.png")
    parser.add_argument("--write", action="store_true", help="put the table into docs/thresholds.md")
    options = parser.parse_args()
    path = options.out / "sets.csv"
    options.out.mkdir(parents=True, exist_ok=True)
    rows = known_rows(path)
    _write(rows, path)
    for number, row in enumerate(rows):
        if not row["verdict"] and beyond_any(row):
            row["verdict"] = verdict_on(number, options.seed)
            _write(rows, path)
    with shown() as report, path.open("a", encoding="utf-8") as stream:
        for number in range(len(rows), options.sets):
            report(f"{20 * (number // 20)} of {options.sets} sets", number, options.sets)
            row = asked(*null_set(number, options.seed))
            rows.append({name: row.get(name, "") for name in COLUMNS})
            if beyond_any(rows[-1]):
                rows[-1]["verdict"] = verdict_on(number, options.seed)
            stream.write(",".join(rows[-1].values()) + "\n")
            stream.flush()
    text = rates_table(rows)
    print(text)
    draw(rows, options.out / "thresholds.png")
    if options.write:
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(MARKS[0])
        write_text(PAGE, f"{before}{MARKS[0]}\n\n{text}\n\n{MARKS[1]}{rest.partition(MARKS[1])[2]}")


if __name__ == "__main__":
    main()
