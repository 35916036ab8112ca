"""Independent tasks on Dask, each result kept in a file of its own, so that whatever stopped a run it goes on.

A task's function is named by its module and called as ``function(argument, shared)`` in a worker process; what it
returns is written here, by the process that asked, whole or not at all. Workers need no common file system.
"""

from __future__ import annotations

import io
import json
import logging
import signal
import threading
import zipfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from multiprocessing import resource_tracker
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TypeVar

import numpy as np

from discsim.errors import InputError
from discsim.files import read_text, write_bytes, write_text
from discsim.result import installed, require
from discsim.threads import cores, limited

if TYPE_CHECKING:
    from distributed import Client

__all__ = ["Progress", "Task", "claim", "discard", "idle_cores", "run_tasks"]

T = TypeVar("T")

IDENTITY = "identity.json"
#: tasks handed to the scheduler ahead of need, per worker thread
AHEAD = 3
#: a scheduler that is there answers, and has its first worker, within this, s
PATIENCE_S = 20

#: a flight's force callback is Python, which threads can only take in turns: a worker takes one task at a time
_one_at_a_time = threading.Lock()


class Task(NamedTuple):
    """One piece of work: ``name`` names its result's file, ``argument`` is what its function gets."""

    name: str
    argument: Any


class Progress(Protocol):
    """Yields the items handed in and shows how far it is: `Run.progress` with its text given."""

    def __call__(self, items: Iterator[T], total: int) -> Iterator[T]:
        """Yield ``items``, of which there are ``total``."""
        ...


def claim(folder: Path, identity: Mapping[str, Any]) -> None:
    """Make ``folder`` the place of this work, or go on in it where it already is.

    ``identity`` (of JSON) is everything that the results depend on. Raises `InputError`, naming the entries that
    differ, where the folder holds results of something else.
    """
    mine = json.loads(json.dumps(identity))
    file = folder / IDENTITY
    if not file.exists():
        if folder.is_dir() and any(not item.name.startswith(".") for item in folder.iterdir()):
            raise InputError(f"{folder}: has files but no {IDENTITY}; expected an empty folder or one of a sweep")
        write_text(file, json.dumps(mine, indent=1) + "\n")
        return
    try:
        theirs = json.loads(read_text(file))
    except ValueError:
        theirs = None
    if not isinstance(theirs, dict):
        raise InputError.at(file, None, "cannot be read; expected what a sweep left (--anew starts over)")
    if theirs != mine:
        other = [key for key in sorted({*mine, *theirs}) if mine.get(key) != theirs.get(key)]
        raise InputError(
            f"{folder}: holds results of another run ({', '.join(other)} differ); "
            "expected another --out, or --anew to throw them away"
        )


def discard(folder: Path) -> None:
    """Throw away what `claim` and `run_tasks` left in a folder, and nothing else."""
    if not (folder / IDENTITY).exists():
        return
    for file in (*folder.glob("*.npz"), *folder.glob("*.json"), *_unfinished(folder)):
        if file.name != IDENTITY:
            file.unlink()
    (folder / IDENTITY).unlink()  # last: a folder half emptied is still known
    if not any(folder.iterdir()):
        folder.rmdir()


def _unfinished(folder: Path) -> list[Path]:
    """Return what a process left that was killed while it wrote a result."""
    return [*folder.glob(".*.npz.*"), *folder.glob(".*.json.*")]


def run_tasks(
    tasks: Sequence[Task],
    function: Callable[[Any, Any], Any],
    folder: Path,
    *,
    shared: Any = None,
    scheduler: str | None = None,
    workers: int | None = None,
    progress: Progress | None = None,
) -> list[Any]:
    """Return ``function(task.argument, shared)`` of each task, in the order of ``tasks``.

    A result is a mapping of names to arrays (kept as ``NAME.npz``) or anything of JSON (``NAME.json``); what is in
    ``folder`` from an earlier call is read, not done again. `claim` the folder first. Every result returned has been
    through its file, so that a run that was stopped and one that was not return the same.

    ``scheduler`` is the address of a Dask scheduler; without one there are as many local processes as cores, or
    ``workers``; one worker works in this process, and so does all where Dask (the extra cluster) is missing. ``shared``
    goes once to each worker. Raises what a task raises, and `InputError` where no scheduler answers, or Dask is asked
    for and missing. An interrupt leaves the results that are there.
    """
    names = [task.name for task in tasks]
    if len(set(names)) != len(names):
        raise ValueError("two tasks have one name; expected each its own")
    for unfinished in _unfinished(folder):
        unfinished.unlink(missing_ok=True)
    done = {name: result for name in names if (result := _read(folder, name)) is not None}
    left = [task for task in tasks if task.name not in done]
    if left:
        count = workers or (cores() if installed("distributed") else 1)
        results = _results(left, function, shared, scheduler, count)
        for name, result in progress(results, len(left)) if progress else results:
            done[name] = _write(folder, name, result)
    return [done[name] for name in names]


def idle_cores(scheduler: str | None, workers: int | None) -> str | None:
    """Return what to tell who asked for neither and whose other cores stay idle, as Dask is missing; else None."""
    if scheduler is not None or workers is not None or installed("distributed") or cores() < 2:
        return None
    return f"one process does the work; pip install 'discsim[cluster]' puts all {cores()} cores to it"


def _results(
    tasks: Sequence[Task], function: Callable[[Any, Any], Any], shared: Any, scheduler: str | None, workers: int
) -> Iterator[tuple[str, Any]]:
    """Yield names and results as they come."""
    if scheduler is None and min(workers, len(tasks)) == 1:
        for task in tasks:
            yield _call(function, task, shared)
        return
    require("distributed", f"--scheduler {scheduler}" if scheduler else f"--workers {workers}", "cluster")
    from distributed import as_completed

    with _client(scheduler, min(workers, len(tasks))) as client:
        held = client.scatter([shared], broadcast=True)[0]
        waiting = iter(tasks)
        threads = sum(client.nthreads().values())

        def submit(task: Task) -> Any:
            return client.submit(_call, function, task, held, pure=False)

        running = as_completed([submit(task) for task in islice(waiting, AHEAD * threads)], loop=client.loop)
        for future in running:
            outcome = future.result()
            future.release()
            for task in islice(waiting, 1):
                running.add(submit(task))
            yield outcome


def _call(function: Callable[[Any, Any], Any], task: Task, shared: Any) -> tuple[str, Any]:
    with _one_at_a_time, limited():
        return task.name, function(task.argument, shared)


#: how local processes are run. A machine that slept, or a command that was stopped for a while, hears nothing of its
#: processes for minutes. Nobody reads where each worker stands a hundred times a second: with fifty ticks a second that
#: takes three processes 2 s of 20 s, and 0.8 s with these
_LOCAL = {
    "distributed.scheduler.worker-ttl": None,
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "1s",
}


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Client]:
    """Connect to a running scheduler, or start local processes for as long as the block lasts."""
    from dask import config
    from distributed import Client, LocalCluster

    if scheduler is None:
        with _deaf_children(), config.set(_LOCAL):
            cluster = LocalCluster(
                n_workers=workers,
                host="127.0.0.1",  # whoever reaches a scheduler runs what he likes
                threads_per_worker=1,
                processes=True,
                dashboard_address="127.0.0.1:0",  # any free port: several runs may go on side by side
                silence_logs=logging.CRITICAL,
            )
        with cluster, Client(cluster, set_as_default=False) as client:
            yield client
        return
    if not scheduler.rpartition(":")[2].isdecimal():  # Dask would wait, and leave a traceback of what it waited for
        raise InputError(f"--scheduler {scheduler}: has no port; expected an address such as tcp://localhost:8786")
    try:
        client = Client(scheduler, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:  # nobody there; no address at all
        reason = str(error).partition("\n")[0] or type(error).__name__
        raise InputError(
            f"--scheduler {scheduler}: no scheduler answers ({reason}); expected the address of a running Dask "
            "scheduler, such as tcp://localhost:8786"
        ) from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE_S)
        except TimeoutError:
            raise InputError(
                f"--scheduler {scheduler}: it has no worker after {PATIENCE_S} s; expected at least one"
            ) from None
        yield client


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Let no process started in the block hear an interrupt: a terminal sends it to all, this process ends the others.

    What a thread blocks its threads and processes inherit; here an interrupt waits until the block is over.
    """
    resource_tracker.ensure_running()  # else the first process started brings it up, which ends the blocking
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _write(folder: Path, name: str, result: Any) -> Any:
    """Write a result and return it as `_read` does."""
    if isinstance(result, Mapping) and result and all(isinstance(value, np.ndarray) for value in result.values()):
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **result)
        write_bytes(folder / f"{name}.npz", buffer.getvalue())
        return dict(result)
    text = json.dumps(result)
    write_text(folder / f"{name}.json", text)
    return json.loads(text)


def _read(folder: Path, name: str) -> Any | None:
    """Return a result that is there; None where there is none, or a damaged one, which is then made again."""
    try:
        if (folder / f"{name}.npz").exists():
            content = io.BytesIO((folder / f"{name}.npz").read_bytes())
            with np.load(content, allow_pickle=False) as arrays:
                return dict(arrays)
        if (folder / f"{name}.json").exists():
            return json.loads((folder / f"{name}.json").read_bytes())
    except (ValueError, EOFError, OSError, zipfile.BadZipFile):
        return None
    return None
