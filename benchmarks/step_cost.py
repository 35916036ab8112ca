"""What a step of the truth costs: MuJoCo's bare loop against the same loop with our air, a flight, and many flights.

Usage: ``python benchmarks/step_cost.py [step] [batch] [--steps 1000 2000 4000] [--rounds 15] [--flights 10 100 1000]``;
without names, both parts.

All variants step the same model from the same state, interleaved round by round so that a change of the machine's
clock falls on all of them. Time is the thread's own CPU time, which leaves out the turns of other processes; what other
work on the machine does to caches and clock only adds, so each ratio is that of the least of all rounds, and the
quartiles of the rounds' ratios stand beside it.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import platform
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, process_time, thread_time
from typing import Any

import mujoco
import numba
import numpy as np
from rich.box import MARKDOWN
from rich.console import Console
from rich.table import Table

from discsim.callbacks import passive_force
from discsim.disc import Release
from discsim.engine import FlyingDisc, fly, follow
from discsim.many_flights import fly_many
from discsim.shipped import load_disc, load_throw

DISC, ENVIRONMENT = load_disc("driver")
THROW = load_throw("driver")
BARE = "bare loop, no callback"


def nothing(model: Any, data: Any) -> None:
    """Be called four times per RK4 step, and do nothing."""


def native_loop(flying: FlyingDisc, steps: int) -> float:
    """Seconds for the steps inside one call into MuJoCo: the cost without Python's loop."""
    start = thread_time()
    mujoco.mj_step(flying.model, flying.data, nstep=steps)
    return thread_time() - start


def python_loop(flying: FlyingDisc, steps: int) -> float:
    """Seconds for the steps called one by one from Python."""
    model, data = flying.model, flying.data
    start = thread_time()
    for _ in range(steps):
        mujoco.mj_step(model, data)
    return thread_time() - start


def with_nothing(flying: FlyingDisc, steps: int) -> float:
    """Seconds for the steps with a callback in Python that does nothing."""
    with passive_force(flying.model, nothing):
        return python_loop(flying, steps)


def with_air(flying: FlyingDisc, steps: int, python: bool) -> float:
    """Seconds for the steps with our air, called by MuJoCo in C or in Python."""
    with flying.air(python):
        return python_loop(flying, steps)


def whole_flight(steps: int, python: bool = False) -> float:
    """Seconds per ``steps`` steps of a flight, which builds the disc, looks for the ground and keeps every state."""
    start = thread_time()
    motion = follow(FlyingDisc(DISC, ENVIRONMENT), THROW, duration=steps * 1e-3, python=python)
    return (thread_time() - start) * steps / (motion.t.size - 1)


def measure(steps: int, rounds: int) -> dict[str, np.ndarray]:
    """Return microseconds per step (rounds,) of each variant."""
    flying = FlyingDisc(DISC, ENVIRONMENT)
    variants: dict[str, Callable[[], float]] = {
        BARE: lambda: python_loop(flying, steps),
        "bare loop inside MuJoCo": lambda: native_loop(flying, steps),
        "empty Python callback": lambda: with_nothing(flying, steps),
        "our air, callback in C": lambda: with_air(flying, steps, python=False),
        "our air, callback in Python": lambda: with_air(flying, steps, python=True),
        "fly(): air, ground, states kept": lambda: whole_flight(steps),
        "the same, callback in Python": lambda: whole_flight(steps, python=True),
    }
    cost: dict[str, list[float]] = {name: [] for name in variants}
    for turn in range(rounds + 1):
        for name, run in variants.items():
            flying.release(THROW)
            seconds = run()
            if turn:  # the first round compiles and warms up
                cost[name].append(seconds / steps * 1e6)
    return {name: np.array(values) for name, values in cost.items()}


def step(sizes: list[int], rounds: int) -> None:
    """Print the cost of a step by what hangs on it, for loops of several lengths."""
    table = Table(
        title=f"CPU time per RK4 step of 1 ms over the bare loop's, {rounds} rounds",
        caption=f"MuJoCo {mujoco.__version__}, numba {numba.__version__}, Python {platform.python_version()}, "
        f"{platform.machine()}, {os.cpu_count()} cores",
        box=MARKDOWN,
    )
    table.add_column("steps")
    for heading in ("variant", "us", "over the bare loop", "quartiles"):
        table.add_column(heading, justify="left" if heading == "variant" else "right")
    for steps in sizes:
        cost = measure(steps, rounds)
        for name, values in cost.items():
            low, high = np.percentile(values / cost[BARE], [25, 75])
            ratio = values.min() / cost[BARE].min()
            shown = str(steps) if name == BARE else ""
            table.add_row(shown, name, f"{values.min():.2f}", f"{ratio:.2f}", f"{low:.2f} .. {high:.2f}")
    Console(width=110).print(table)


def drawn(count: int, share: slice = slice(None)) -> list[Release]:
    """Return some of ``count`` releases of speeds drawn anew for each count."""
    rng = np.random.default_rng(count)
    return [dataclasses.replace(THROW, velocity=THROW.velocity * k) for k in rng.uniform(0.25, 0.35, count)][share]


def alone(count: int, cores: int) -> float:
    """Return the CPU seconds of the busiest of processes that fly a share of the flights each and share nothing.

    That is what the machine allows: cores share caches, memory and their clock's speed.
    """
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from step_cost import *\n"
        "count, first, cores = map(int, sys.argv[2:])\n"
        "some = drawn(count, slice(first, None, cores)); fly_many(DISC, ENVIRONMENT, [THROW], duration=0.01)\n"
        "print(flush=True); input(); start = process_time()\n"
        "fly_many(DISC, ENVIRONMENT, some, threads=1); print(process_time() - start)"
    )
    words = [sys.executable, "-c", code, str(Path(__file__).parent), str(count)]
    processes = [
        subprocess.Popen([*words, str(k), str(cores)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        for k in range(cores)
    ]
    for process in processes:
        assert process.stdout is not None
        process.stdout.readline()
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    return max(float(process.communicate()[0]) for process in processes)


def batch(sizes: list[int]) -> None:
    """Print how many flights at once compare with one after another.

    By the clock, which other work on the machine spoils, and by the processor time of the busiest thread, with all that
    one thread does alone, which it spoils less: on a quiet machine that thread is the clock. Beside it what processes
    that share nothing but the machine reach.
    """
    cores = len(os.sched_getaffinity(0))
    fly_many(DISC, ENVIRONMENT, [THROW], duration=0.01)
    print(f"flights until they land, by mujoco.batch on one thread and on {cores}")
    for count in sizes:
        releases = drawn(count)
        clock, busiest, total = {}, {}, {}
        for threads in (1, cores):
            start, process, own = perf_counter(), process_time(), thread_time()
            ends = fly_many(DISC, ENVIRONMENT, releases, threads=threads)
            own = thread_time() - own
            total[threads] = process_time() - process
            busiest[threads] = max(own, (total[threads] - own) / max(threads - 1, 1))
            clock[threads] = perf_counter() - start
        start = thread_time()
        some = releases[:20]
        for release in some:
            fly(DISC, ENVIRONMENT, release)
        singly = (thread_time() - start) / len(some) * count
        ratio, apart = busiest[1] / busiest[cores], busiest[1] / alone(count, cores)
        print(
            f"{count:5d} flights of {ends.state.t.mean():.2f} s: {total[1]:.2f} s of CPU on one thread "
            f"({singly:.2f} s by fly() one after another), {total[cores]:.2f} s on {cores}, its busiest thread "
            f"{busiest[cores]:.2f} s: {ratio:.2f} times less, {ratio / cores:.2f} of the cores; "
            f"by the clock {clock[1] / clock[cores]:.2f}; {cores} processes that share nothing: {apart:.2f}, "
            f"{apart / cores:.2f} of the cores"
        )


def main() -> None:
    """Run the parts."""
    parser = argparse.ArgumentParser(description="Cost of the truth: of an RK4 step, of a flight, of many flights.")
    parser.add_argument("parts", nargs="*", help="step, batch; none: both")
    parser.add_argument("--steps", type=int, nargs="+", default=[1000, 2000, 4000], help="steps per measurement")
    parser.add_argument("--rounds", type=int, default=15, help="measurements of each variant (default %(default)s)")
    parser.add_argument("--flights", type=int, nargs="+", default=[10, 100, 1000], help="flights at once")
    given = parser.parse_args()
    if not all(1 <= steps <= 6000 for steps in given.steps) or given.rounds < 1 or min(given.flights) < 1:
        parser.error("expected 1 to 6000 steps (the throw lasts 6.9 s of 1 ms), and at least one round and one flight")
    parts: dict[str, Callable[[], None]] = {
        "step": lambda: step(given.steps, given.rounds),
        "batch": lambda: batch(given.flights),
    }
    if unknown := [name for name in given.parts if name not in parts]:
        parser.error(f"no part '{unknown[0]}'; expected some of {', '.join(parts)}")
    for name in given.parts or parts:
        parts[name]()


if __name__ == "__main__":
    main()
