"""Mutated inputs: what ever failed stays mended, and some two thousand cases of a seed are tried."""

from __future__ import annotations

import os
import random
import time
from pathlib import Path

import pytest
from fuzz.campaign import campaign, run_case, warm_up, warm_up_one
from fuzz.corpus import CORPUS, read_case, write_case
from fuzz.judge import FaultFound, judge
from fuzz.mutate import mutated
from fuzz.seeds import RECORDINGS, recording_files
from fuzz.targets import CHEAP, TARGETS

from discsim.errors import InputError

#: cases of a run, as far as they fit into its time
CASES, SECONDS = 2000, 60.0
#: cases of what takes a tenth of a second each, and their time
DEARER, DEARER_SECONDS = 30, 40.0
#: the same in every run, so that a change is judged by itself; DISCSIM_FUZZ_SEED=N tries others
SEED = int(os.environ.get("DISCSIM_FUZZ_SEED", "20261122"))


def faults(targets: list[str], cases: int, seconds: float, seed: int) -> list[str]:
    """Return a line for each fault of a campaign that ends after some seconds, whatever is left."""
    print(f"python -m tests.fuzz --mutations {cases} --seed {seed} {' '.join(f'--target {name}' for name in targets)}")
    started, found = time.monotonic(), []
    for tried in campaign(targets, cases, random.Random(seed)):
        if not tried.outcome.sound:
            found.append(f"{tried.target}: {tried.outcome}, seed {seed}")
        if time.monotonic() - started > seconds:
            break
    return found


def test_no_mutation_crashes_hangs_or_lies():
    assert not faults(list(CHEAP), CASES, SECONDS, SEED)


def test_no_mutation_leads_estimate_or_a_run_down_astray():
    assert not faults(["spin-down", "estimate"], DEARER, DEARER_SECONDS, SEED)


def test_no_mutation_of_a_log_of_messages_crashes_its_reader():
    assert not faults(["logs"], DEARER, DEARER_SECONDS, SEED)


@pytest.mark.parametrize("path", sorted(CORPUS.glob("*.toml")), ids=lambda path: path.stem)
def test_what_once_failed_is_right_or_refused(path):
    case = read_case(path)
    warm_up_one(case.target, case.seed)
    outcome = run_case(case).outcome
    assert outcome.sound, outcome


@pytest.mark.parametrize("name", CHEAP)
def test_the_sound_files_of_a_target_are_right(name):
    warm_up(name)


def test_the_same_seed_gives_the_same_mutations():
    files = recording_files("flight")
    first, second = (mutated(files, random.Random(7)) for _ in range(2))
    assert first == second
    assert first != files


def test_rows_of_uneven_length_are_mutated_like_others():
    """An earlier mutation may have taken a cell from any row."""
    uneven = {"log.csv": "a,b,c\n" + "1,2,3\n" * 3 + "1\n" + "1,2,3\n"}
    for seed in range(300):
        mutated(uneven, random.Random(seed))


def test_a_case_written_into_the_corpus_is_the_same_case_again(tmp_path):
    rng = random.Random(3)
    for number in range(40):
        plant = RECORDINGS[number % len(RECORDINGS)]
        case = next(iter(campaign_of("recording", plant, rng)))
        again = read_case(write_case(tmp_path, case))
        assert again.files == case.case.files


def campaign_of(target: str, seed: str, rng: random.Random):
    from fuzz.campaign import Case, Found
    from fuzz.judge import Outcome

    case = Case(target, seed, TARGETS[target].mutate(TARGETS[target].seeds[seed](), rng))
    yield Found(target, case, Outcome("internal", "made up"), 0.0)


@pytest.mark.parametrize(
    ("run", "kind"),
    [
        (lambda folder: None, "right"),
        (lambda folder: (_ for _ in ()).throw(InputError("a.toml:1: 'x' is 1, expected 2")), "refused"),
        (lambda folder: (_ for _ in ()).throw(InputError("a.toml:1: no")), "vague"),
        (lambda folder: (_ for _ in ()).throw(InputError("two\nlines, expected one")), "vague"),
        (lambda folder: [][0], "internal"),
        (lambda folder: (_ for _ in ()).throw(FaultFound("a rate of 1e9")), "nonsense"),
        (lambda folder: sum(number % 7 for number in range(10**9)), "slow"),
        (lambda folder: bytearray(1 << 33), "memory"),
    ],
)
def test_a_case_is_judged_by_what_it_did(tmp_path: Path, run, kind):
    assert judge(run, tmp_path, longest=0.5).kind == kind
