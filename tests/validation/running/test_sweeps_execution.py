"""Tasks on Dask: the same bytes from one process, from two workers elsewhere, and after a kill at any moment."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

import dask
import numpy as np
import pytest

from discsim.errors import InputError
from discsim.validation.cli import main
from discsim.validation.running import tasks as execution
from discsim.validation.running.tasks import Task, claim, discard, run_tasks

#: twelve chunks of some tenth of a second each
PLAN = """
name = "kill"
drawn = true
[truth]
plant = "rate_table"
rates_deg_s = [1500, 2800]
hold_s = 2.0
ramp_s = 0.5
[axes]
radius_m = [0.008, 0.01, 0.012, 0.014, 0.016, 0.018, 0.02, 0.022, 0.024, 0.026, 0.028, 0.03]
[mounts]
design = "sobol"
count = 24
x_m = [-0.002, 0.002]
about_x_deg = [-5, 5]
[estimators]
accelerometer = "all"
fft = "all"
"""
CHUNKS = 12
COMMAND = [sys.executable, "-m", "discsim.validation.cli", "sweep"]
#: a process of ours starts, and works, within this, s
PATIENCE = 120.0


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("plan") / "plan.toml"
    path.write_text(PLAN)
    return path


@pytest.fixture(scope="module")
def undisturbed(plan: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What one process makes of the plan without any interruption."""
    out = tmp_path_factory.mktemp("one") / "sweep"
    assert sweep(plan, out, "--workers", "1") == 0
    return data_files(out)


def sweep(plan: Path, out: Path, *options: str) -> int:
    """Call the command in this process and return its exit status."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["discsim", "sweep", str(plan), "--out", str(out), *options])
        with pytest.raises(SystemExit) as stop:
            main()
    return int(stop.value.code or 0)


def data_files(out: Path) -> dict[str, bytes]:
    """Return the bytes of all that a sweep leaves, checkpoints included, less what tells the command itself.

    That is run.json, with its duration, and the report's foot, with the command line.
    """
    found = {str(path.relative_to(out)): path.read_bytes() for path in out.rglob("*") if path.is_file()}
    found.pop("run.json", None)
    if "report.html" in found:
        found["report.html"], feet = re.subn(rb"<footer>discsim sweep [^<]*</footer>", b"", found["report.html"])
        assert feet <= 1
    return found


def finished(out: Path) -> int:
    return len(list(out.glob("checkpoints/case-*.npz")))


def wait_until(condition, what: str) -> None:
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"waited {PATIENCE:g} s for {what}"
        time.sleep(0.005)


@pytest.mark.parametrize(
    ("stop", "workers"), [(signal.SIGKILL, "2"), pytest.param(signal.SIGINT, "2", marks=pytest.mark.slow)]
)
def test_a_sweep_that_was_stopped_goes_on_and_gives_the_same_bytes(plan, undisturbed, tmp_path, capsys, stop, workers):
    out = tmp_path / "sweep"
    process = subprocess.Popen(
        [*COMMAND, str(plan), "--out", str(out), "--workers", workers],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
        # where the tests themselves run in the background, an interrupt is ignored, and that would be inherited
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    wait_until(lambda: finished(out) >= 2 or process.poll() is not None, "two chunks")
    if stop is signal.SIGINT:  # a terminal interrupts all processes of a command
        os.killpg(process.pid, stop)
    else:
        process.send_signal(stop)
    _, errors = process.communicate(timeout=PATIENCE)
    before = finished(out)
    assert 2 <= before < CHUNKS, errors
    assert not (out / "sweep.nc").exists()
    if stop is signal.SIGINT:
        assert process.returncode == 130
        assert errors.endswith("discsim: interrupted\n")
        assert "Traceback" not in errors
    assert sweep(plan, out, "--workers", "1") == 0
    assert f"{before} of {CHUNKS} chunks are there from an earlier run" in capsys.readouterr().err
    assert data_files(out) == undisturbed


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """Run a scheduler and two workers as processes of their own; yield the scheduler's address."""
    file, processes = folder / "scheduler.json", []
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": folder}
    local = ["--host", "127.0.0.1", "--no-dashboard"]
    try:
        options = ["--port", "0", "--scheduler-file", str(file)]
        processes.append(subprocess.Popen([*dask, "scheduler", *local, *options], **quiet))
        # the file appears before its content does
        wait_until(lambda: file.exists() and file.read_text().rstrip().endswith("}"), "the scheduler")
        address = json.loads(file.read_text())["address"]
        for name in ("one", "two"):
            options = ["--nthreads", "2", "--no-nanny", "--name", name, "--local-directory", str(folder / name)]
            processes.append(subprocess.Popen([*dask, "worker", address, *local, *options], **quiet))
        yield address
    finally:
        for process in reversed(processes):
            process.terminate()
            process.wait(PATIENCE)


def test_a_running_cluster_of_two_workers_gives_the_same_bytes_as_one_process(plan, undisturbed, tmp_path):
    with cluster(tmp_path) as address:
        assert sweep(plan, tmp_path / "sweep", "--scheduler", address) == 0
    assert data_files(tmp_path / "sweep") == undisturbed


def test_a_changed_plan_is_refused_until_it_is_told_to_start_anew(plan, undisturbed, tmp_path, capsys):
    out = tmp_path / "sweep"
    for name, content in undisturbed.items():
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_bytes(content)
    (out / "run.json").write_text("{}")  # of a version that kept no list of its files
    assert sweep(plan, out, "--workers", "1", "--mounts", "2") == 2
    message = capsys.readouterr().err
    assert "holds results of another run (estimators, mounts differ)" in message
    assert "--anew" in message
    assert data_files(out) == undisturbed
    assert sweep(plan, out, "--workers", "1", "--mounts", "2", "--anew") == 0
    assert len(data_files(out)["sweep.nc"]) < len(undisturbed["sweep.nc"])


def test_no_scheduler_at_the_address_is_one_clear_line(plan, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(execution, "PATIENCE_S", 1)
    assert sweep(plan, tmp_path / "sweep", "--scheduler", "tcp://127.0.0.1:9") == 2
    error = capsys.readouterr().err
    assert error.startswith("discsim: --scheduler tcp://127.0.0.1:9: no scheduler answers")
    assert error.count("\n") == 1


# ------------------------------------------------------------------------------------------------ the executor


def square(argument, shared):
    (shared["folder"] / f"called-{argument}").touch(exist_ok=False)
    if argument == shared.get("bad"):
        raise InputError(f"{argument} has no square here")
    return {"square": argument**2, "known": float("nan")}


def addresses(argument, shared):
    from distributed import get_worker

    worker = get_worker()
    return [worker.address, worker.scheduler.address]


def test_local_processes_listen_on_this_machine_alone(tmp_path):
    """Whoever reaches a scheduler or a worker runs what he likes."""
    told = run_tasks([Task("one", 1), Task("two", 2)], addresses, tmp_path, workers=2)
    assert len(told) == 2
    assert all(address.startswith("tcp://127.0.0.1:") for pair in told for address in pair)


def sleeping(argument, shared):
    """Stop this process, as a machine does that is put to sleep, until another one has it go on."""
    if argument == 1:
        (Path(shared) / "sleeps").write_text(str(os.getpid()))
        os.kill(os.getpid(), signal.SIGSTOP)
    return argument


def test_processes_that_are_stopped_for_a_while_go_on(tmp_path):
    """Longer than a worker may say nothing, here 2 s, by the scheduler's ordinary settings 5 minutes."""
    note, woken = tmp_path / "sleeps", []

    def wake() -> None:
        for _ in range(int(PATIENCE / 0.1)):
            time.sleep(0.1)
            if note.exists() and note.read_text():
                break
        time.sleep(8.0)
        woken.append(int(note.read_text()))
        os.kill(woken[0], signal.SIGCONT)

    Thread(target=wake, daemon=True).start()
    with dask.config.set({"distributed.scheduler.worker-ttl": "2s"}):
        told = run_tasks(tasks(6), sleeping, tmp_path / "kept", shared=str(tmp_path), workers=2)
    assert told == [0, 1, 2, 3, 4, 5]
    assert woken


def spectrum(argument, shared):
    return {"squares": np.arange(argument) ** 2 / shared}


def tasks(count: int) -> list[Task]:
    return [Task(f"task-{number}", number) for number in range(count)]


def test_results_come_in_the_order_of_their_tasks_and_are_not_worked_out_twice(tmp_path):
    shared = {"folder": tmp_path}
    first = run_tasks(tasks(3), square, tmp_path / "kept", shared=shared, workers=1)
    assert [item["square"] for item in first] == [0, 1, 4]
    # `square` refuses to be called twice for one argument
    again = run_tasks(list(reversed(tasks(5))), square, tmp_path / "kept", shared=shared, workers=1)
    assert [item["square"] for item in again] == [16, 9, 4, 1, 0]
    assert np.isnan(again[0]["known"])


def test_a_damaged_result_is_worked_out_again(tmp_path):
    whole = run_tasks(tasks(3), spectrum, tmp_path, shared=7.0, workers=1)
    file = tmp_path / "task-2.npz"
    content = file.read_bytes()
    file.write_bytes(content[: len(content) // 2])
    (tmp_path / ".task-1.npz.abc").write_bytes(b"left by a process that was killed")
    again = run_tasks(tasks(3), spectrum, tmp_path, shared=7.0, workers=1)
    np.testing.assert_array_equal(again[2]["squares"], whole[2]["squares"])
    assert file.read_bytes() == content
    assert sorted(path.name for path in tmp_path.iterdir()) == ["task-0.npz", "task-1.npz", "task-2.npz"]


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_task_raises_reaches_the_caller_and_what_was_done_before_is_kept(tmp_path, workers):
    with pytest.raises(InputError, match="1 has no square here"):
        run_tasks(tasks(2), square, tmp_path / "kept", shared={"folder": tmp_path, "bad": 1}, workers=workers)
    if workers == 1:
        assert [path.name for path in (tmp_path / "kept").iterdir()] == ["task-0.json"]


def test_progress_counts_what_is_left_to_do(tmp_path):
    seen = []

    def progress(items, total):
        for item in items:
            seen.append(total)
            yield item

    run_tasks(tasks(2), spectrum, tmp_path, shared=1.0, workers=1, progress=progress)
    run_tasks(tasks(5), spectrum, tmp_path, shared=1.0, workers=1, progress=progress)
    assert seen == [2, 2, 3, 3, 3]


def test_a_folder_belongs_to_one_piece_of_work(tmp_path):
    folder = tmp_path / "kept"
    claim(folder, {"plan": [1.5, "a"], "seed": 0})
    claim(folder, {"seed": 0, "plan": (1.5, "a")})
    with pytest.raises(InputError, match=r"\(seed differ\)"):
        claim(folder, {"plan": [1.5, "a"], "seed": 1})
    run_tasks(tasks(1), spectrum, folder, shared=1.0, workers=1)
    discard(folder)
    assert not folder.exists()
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="expected an empty folder"):
        claim(folder, {})
    discard(folder)
    assert (folder / "notes.txt").exists()


@pytest.mark.parametrize(("asked", "has_dask", "count"), [(None, False, 1), (None, True, 4), (2, False, 4)])
def test_whose_other_cores_stay_idle_for_want_of_a_package_is_told_so(monkeypatch, asked, has_dask, count):
    monkeypatch.setattr(execution, "installed", lambda package: has_dask)
    monkeypatch.setattr(execution, "cores", lambda: count)
    assert execution.idle_cores(None, asked) is None
    monkeypatch.setattr(execution, "cores", lambda: 4)
    told = execution.idle_cores(None, asked)
    if asked or has_dask:
        assert told is None
    else:
        assert told is not None
        assert "discsim[cluster]" in told
        assert "4 cores" in told
    assert execution.idle_cores("tcp://127.0.0.1:8786", None) is None
