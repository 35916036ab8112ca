"""What a diagnosis costs: CPU seconds of `diagnose` on data sets made as the blind test makes them.

    python benchmarks/diagnosis.py [sets] [growth] [many] [--each 3] [--only WORD] [--seed 500]

``sets`` diagnoses sets of each kind that has a goal and prints the median and the longest of each kind beside it;
``growth`` prints how the cost of one set grows with recordings, with their length and with the sensors on board;
``many`` how cost and memory grow to 200 recordings. Time is CPU time of the process with all its threads, after one
diagnosis that compiles what is not in the cache yet; so other work on the machine counts little. Each line tells
whether the answer was right, too.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.recording import Plant, Recording
from discsim.validation.challenge.cases.case import Case, Kind
from discsim.validation.challenge.cases.conceal import Answer
from discsim.validation.challenge.cases.conceal import recordings as simulated
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.pipeline import diagnose


@dataclass(frozen=True)
class Wanted:
    """A kind of set: its plant, what is hidden, how many recordings, and what it may cost, CPU s.

    ``longest`` may cost the longest of its sets, where that has a goal of its own.
    """

    words: str
    plant: Plant
    kind: Kind | None
    count: int
    goal: float
    longest: float | None = None


SETS = (
    Wanted("nothing hidden, six throws", "flight", "nothing", 6, 8.0),
    Wanted("one effect, six throws", "flight", "one", 6, 12.0),
    Wanted("two effects, eight throws", "flight", "two", 8, 40.0),
    Wanted("a law of no catalogue, six throws", "flight", "off_catalogue", 6, 40.0),
    Wanted("free spin, four throws", "free_spin", None, 4, 20.0, 120.0),
)


def drawn(wanted: Wanted, seed: int) -> Iterator[Case]:
    """Draw the cases from a seed on that have as many recordings as wanted."""
    while True:
        case = draw_case(seed, wanted.plant, kind=wanted.kind)
        if len(case.runs) == wanted.count:
            yield case
        seed += 1


@dataclass(frozen=True)
class Cost:
    """What one diagnosis took, CPU s, and whether its answer is right: verdict and effects."""

    seconds: float
    right: bool
    said: str
    hidden: str


def cost_of(case: Case, given: Sequence[Recording]) -> Cost:
    """Diagnose a set and return what that took."""
    answer = Answer.of(case)
    begun = time.process_time()
    found = diagnose([list(given)], ["set"]).diagnosis
    spent = time.process_time() - begun
    said = " + ".join(sorted({effect.id for effect in found.effects})) or found.verdict
    hidden = " + ".join(sorted(answer.effects)) or (answer.law or answer.verdict)
    right = found.verdict == answer.verdict and (
        answer.verdict != "explained" or {effect.id for effect in found.effects} == set(answer.effects)
    )
    return Cost(spent, right, said, hidden)


def show(case: Case, cost: Cost) -> None:
    """Print one set's line."""
    print(f"    seed {case.seed}: {cost.seconds:6.1f} s  {cost.hidden} -> {cost.said}", flush=True)


def sets(each: int, seed: int, only: str) -> None:
    """Print what sets of each kind cost."""
    for wanted in SETS:
        if only not in wanted.words:
            continue
        cases = drawn(wanted, seed)
        costs = []
        print(wanted.words)
        for _ in range(each):
            case = next(cases)
            costs.append(cost_of(case, simulated(case)))
            show(case, costs[-1])
        spent = np.array([cost.seconds for cost in costs])
        right = sum(cost.right for cost in costs)
        limit = f", longest {spent.max():.1f} s (goal {wanted.longest:g})" if wanted.longest else ""
        longest = limit or f", longest {spent.max():.1f} s"
        print(f"  median {np.median(spent):.1f} s (goal {wanted.goal:g}){longest}, {right} of {each} right", flush=True)


def shorter(case: Case, seconds: float) -> Case:
    """Return a case whose throws are recorded no longer than this."""
    return replace(case, longest=seconds)


def without(recording: Recording, sensors: Sequence[str]) -> Recording:
    """Return a recording as if it had only these sensors."""
    return replace(recording, samples={name: own for name, own in recording.samples.items() if name in sensors})


def growth(seed: int) -> None:
    """Print how the cost of a set with one effect grows."""
    case = next(drawn(Wanted("", "flight", "one", 8, 0.0), seed))
    print("one effect: with recordings")
    for count in (2, 4, 8):
        some = replace(case, runs=case.runs[:count], stated_releases=case.stated_releases[:count])
        show(some, cost_of(some, simulated(some)))
    four = replace(case, runs=case.runs[:4], stated_releases=case.stated_releases[:4])
    print("  with their length, four throws of 0.75, 1.5 and 3 s")
    for seconds in (0.75, 1.5, 3.0):
        some = shorter(four, seconds)
        show(some, cost_of(some, simulated(some)))
    print("  with the sensors on board, four throws")
    given = simulated(four)
    there = [name for name in ("magnetometer", "gyroscope", "accelerometer") if name in given[0].samples]
    for number in range(1, len(there) + 1):
        part = [without(recording, there[:number]) for recording in given]
        print(f"   {', '.join(there[:number])}")
        show(four, cost_of(four, part))


#: how often eight throws are thrown again, each with noise of its own
MANY = (1, 5, 25)


def many(seed: int) -> None:
    """Print what sets of many throws cost and hold in memory."""
    case = next(drawn(Wanted("", "flight", "one", 8, 0.0), seed))
    print("one effect: many throws")
    for times in MANY:
        some = replace(case, runs=case.runs * times, stated_releases=case.stated_releases * times)
        given = simulated(some)
        held = sum(own.t.nbytes + own.value.nbytes for recording in given for own in recording.samples.values())
        cost = cost_of(some, given)
        highest = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        print(
            f"  {len(given):4d} throws, {held / 1e6:.1f} MB of readings: {cost.seconds:6.1f} s, "
            f"{cost.seconds / len(given):.2f} s each, at most {highest / 1e6:.0f} MB; {cost.hidden} -> {cost.said}",
            flush=True,
        )


def main() -> None:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("parts", nargs="*", metavar="sets|growth|many", default=["sets"])
    parser.add_argument("--each", type=int, default=3, help="sets of each kind")
    parser.add_argument("--only", default="", help="only kinds whose name has this in it")
    parser.add_argument("--seed", type=int, default=500)
    options = parser.parse_args()
    warm = next(drawn(Wanted("", "flight", "one", 3, 0.0), 0))
    diagnose([simulated(shorter(warm, 1.0))], ["warm-up"])
    parts = {
        "sets": lambda: sets(options.each, options.seed, options.only),
        "growth": lambda: growth(options.seed),
        "many": lambda: many(options.seed),
    }
    if unknown := [part for part in options.parts if part not in parts]:
        parser.error(f"no part '{unknown[0]}'; expected some of {', '.join(parts)}")
    for part in options.parts:
        parts[part]()


if __name__ == "__main__":
    main()
