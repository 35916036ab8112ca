"""A campaign: cases drawn from a seed, run one after the other."""

from __future__ import annotations

import random
import shutil
import tempfile
import time
import warnings
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from .judge import LONGEST_S, Outcome, judge
from .targets import TARGETS

__all__ = ["Case", "Found", "campaign", "run_case", "warm_up", "warm_up_one"]


class Case(NamedTuple):
    """Files to run a target on, which were mutated from those of one of its seeds."""

    target: str
    seed: str
    files: Mapping[str, str]


class Found(NamedTuple):
    """A case, what became of it, and how long that took."""

    target: str
    case: Case
    outcome: Outcome
    seconds: float


def campaign(targets: Sequence[str], mutations: int, rng: random.Random) -> Iterator[Found]:
    """Yield what became of ``mutations`` cases, spread over the targets by their weights."""
    for name in targets:
        warm_up(name)
    weights = [TARGETS[name].weight for name in targets]
    for _ in range(mutations):
        name = rng.choices(list(targets), weights)[0]
        target = TARGETS[name]
        seed = rng.choice(sorted(target.seeds))
        case = Case(name, seed, target.mutate(target.seeds[seed](), rng))
        yield run_case(case)


def warm_up(name: str) -> None:
    """Warm up all seeds of a target."""
    for seed in TARGETS[name].seeds:
        warm_up_one(name, seed)


@cache
def warm_up_one(name: str, seed: str) -> None:
    """Run a target on sound files, which must be right; what it needs is compiled then, and no case pays for it."""
    found = run_case(Case(name, seed, TARGETS[name].seeds[seed]()), longest=600.0)
    if found.outcome.kind != "right":
        raise AssertionError(f"{name}: the sound {seed} is not right: {found.outcome}")


def run_case(case: Case, longest: float = LONGEST_S) -> Found:
    """Write a case's files into a folder of its own, run its target there, and judge."""
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    try:
        for name, text in case.files.items():
            (folder / name).write_bytes(text.encode("utf-8", "surrogateescape"))
        started = time.monotonic()
        with warnings.catch_warnings():
            # numpy's of numbers that overflow are for the code to deal with; a person sees what comes of it
            warnings.simplefilter("ignore")
            outcome = judge(TARGETS[case.target].run, folder, longest)
        return Found(case.target, case, outcome, time.monotonic() - started)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
