"""A disturbed run leaves nothing half-written, and the next one the same bytes; odd surroundings cost one clear line.

``python -m tests.faults`` disturbs every command at many more moments.
"""

from __future__ import annotations

import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import replace
from pathlib import Path

import pytest
from faults.harness import COMMANDS, content, disturbed, doubled, prepare, run

from discsim.errors import InputError
from discsim.files import write_text
from discsim.validation.challenge.cases.conceal import Answer
from discsim.validation.challenge.scores.result import Scored
from discsim.validation.challenge.scores.scoring import score_case
from discsim.validation.reporting.run import start_run
from discsim.validation.reporting.written import alone_in

#: moments tried of each signal: the command tries fifty
MOMENTS = 1


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """The inputs, the words of an import, what it writes, and how long that takes."""
    place = tmp_path_factory.mktemp("faults")
    prepare(place / "given")
    words = COMMANDS["import"](place / "given")
    for name in ("warm", "whole"):
        started = time.monotonic()
        assert run([*words, "--out", str(place / name)], place / "heard") == 0, (place / "heard").read_text()
    return place, words, content(place / "whole"), time.monotonic() - started


def test_a_run_that_is_killed_or_interrupted_anywhere_is_made_good_by_the_next(undisturbed, tmp_path):
    _, words, whole, seconds = undisturbed
    rng, found = random.Random(5), []
    for number, kill in enumerate([signal.SIGKILL, signal.SIGINT] * MOMENTS):
        found += disturbed(words, whole, seconds, tmp_path / f"{number}", kill, rng)
    assert not found


def test_of_two_runs_into_one_folder_one_is_refused_or_follows_the_other(undisturbed, tmp_path):
    _, words, whole, _ = undisturbed
    assert not list(doubled(words, whole, tmp_path / "twice"))


def test_two_results_of_a_challenge_that_differ_in_times_alone_count_as_the_same(tmp_path):
    """How long a diagnosis took, by the clock and of the processor, no two runs share; what it said they do."""
    answer = Answer(5, "spin_down", "off_catalogue", "unexplained", law="a torque")
    case = Scored(answer, None, score_case(answer, None), None, 1.0, "0" * 64, cpu_seconds=0.5)
    other = replace(case, seconds=2.0, cpu_seconds=1.5)
    left = []
    for number, one in enumerate((case, other, replace(other, error="killed"))):
        (tmp_path / f"{number}").mkdir()
        (tmp_path / f"{number}" / "challenge.json").write_text(json.dumps({"cases": [one.to_json()]}))
        left.append(content(tmp_path / f"{number}"))
    assert left[0] == left[1] != left[2]


@pytest.mark.parametrize("largest", [1000, 3000, 9000])
def test_a_full_disk_is_said_in_one_line_and_leaves_no_half_of_a_file(undisturbed, tmp_path, largest):
    """A limit on the size of files stands for the disk: the system refuses the byte that is one too many."""
    _, words, whole, _ = undisturbed
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, before[1]))
    try:
        status = run([*words, "--out", str(tmp_path / "out")], tmp_path / "heard")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    said = (tmp_path / "heard").read_text().splitlines()
    assert status == 2, said
    assert "the system says 'File too large'" in said[-1]
    assert not [line for line in said if "Traceback" in line]
    left = content(tmp_path / "out")
    assert all(left[name] == whole[name] for name in left)
    assert run([*words, "--out", str(tmp_path / "out")], tmp_path / "heard") == 0
    assert content(tmp_path / "out") == whole


def test_a_place_that_cannot_be_written_is_named(undisturbed, tmp_path):
    place, words, _, _ = undisturbed
    (tmp_path / "file").write_text("mine")
    for out in (tmp_path / "file" / "below", Path("/proc/nowhere")):
        assert run([*words, "--out", str(out)], tmp_path / f"heard-{out.name}") == 2
        said = (tmp_path / f"heard-{out.name}").read_text().splitlines()
        assert said[-1].startswith(f"discsim: {out}: the system says ")
    assert run([*COMMANDS["estimate"](place / "given"), "--out", f"{place}/given/rate_table/new"], tmp_path / "in") == 2
    assert "lies in the input" in (tmp_path / "in").read_text()
    assert not (place / "given" / "rate_table" / "new").exists()


def test_a_folder_that_vanishes_while_a_run_writes_is_made_again(tmp_path):
    with start_run(tmp_path / "out"):
        write_text(tmp_path / "out" / "one.txt", "lost")
        shutil.rmtree(tmp_path / "out")
        write_text(tmp_path / "out" / "two.txt", "there")
    assert {file.name for file in (tmp_path / "out").iterdir()} == {"two.txt", "run.json"}


def test_no_folder_for_temporary_files_is_said_in_one_line(undisturbed, tmp_path, monkeypatch):
    _, words, _, _ = undisturbed
    monkeypatch.setattr(tempfile, "tempdir", "/proc/nowhere")
    assert run([*words, "--out", str(tmp_path / "out")], tmp_path / "heard") == 2
    assert "/proc/nowhere" in (tmp_path / "heard").read_text().splitlines()[-1]


def test_a_folder_is_one_run_s_until_it_ends_or_dies(tmp_path):
    with alone_in(tmp_path), pytest.raises(InputError, match="another run is writing into it"), alone_in(tmp_path):
        pass
    pid = os.fork()
    if pid == 0:
        with alone_in(tmp_path):
            os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(pid, 0)
    with alone_in(tmp_path):
        assert not list(tmp_path.iterdir())


def test_runs_in_two_threads_list_each_its_own_files(tmp_path):
    """What a run knows belongs to its thread: neither guards, nor lists, what the other writes."""
    both = threading.Barrier(2)

    def one(name: str) -> None:
        with start_run(tmp_path / name):
            both.wait()
            for number in range(20):
                write_text(tmp_path / name / f"{name}-{number}.txt", name)
            both.wait()

    threads = [threading.Thread(target=one, args=(name,)) for name in ("first", "second")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for name in ("first", "second"):
        assert {file.name for file in (tmp_path / name).iterdir()} == {
            "run.json",
            *(f"{name}-{number}.txt" for number in range(20)),
        }


DISCSIM = f"{sys.executable} -m discsim.validation.cli"


@pytest.mark.parametrize(
    ("line", "status", "said"),
    [
        (f"{DISCSIM} list effects | head -1; exit ${{PIPESTATUS[0]}}", 0, ""),
        (f"{DISCSIM} list effects > /dev/full", 2, "discsim: the system says 'No space left on device'"),
        (f"{DISCSIM} list effects >&- 2>&-", 0, ""),
        (f"LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0 {DISCSIM} show air.wind", 0, ""),
        (f"TERM= HOME=/proc/nowhere DISPLAY= {DISCSIM} list discs < /dev/null", 0, ""),
    ],
    ids=["a reader that leaves", "a full disk", "no streams", "a C locale", "no home, terminal or display"],
)
def test_odd_surroundings_cost_one_line_at_most(line, status, said):
    done = subprocess.run(["bash", "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == status, done.stderr
    assert done.stderr.startswith(said)
    assert done.stderr.count("\n") == bool(said)


def test_what_is_compiled_needs_no_place_to_be_kept():
    """Without a cache each process compiles anew."""
    code = "from discsim.compiled import compiled\nprint(compiled(lambda x: x + 1)(1))"
    environment = {**os.environ, "HOME": "/proc/nowhere"}
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        environment.pop(name, None)
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout == "2\n", done.stderr
