"""What a step of the truth costs: MuJoCo's bare loop against the same loop with a callback on it.

Usage: ``python benchmarks/step_cost.py [--steps 4000] [--rounds 15]``

All variants step the same model from the same state, interleaved round by round so that a change of the machine's
clock falls on all of them. Time is the thread's own CPU time, which leaves out the turns of other processes. The
median over rounds is printed with the quartiles, and the ratio to the bare loop is the median of the rounds' ratios.
"""

from __future__ import annotations

import argparse
import os
import platform
from collections.abc import Callable
from time import thread_time
from typing import Any

import mujoco
import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from discsim.callbacks import passive_force
from discsim.engine import FlyingDisc, fly
from discsim.shipped import load_disc, load_throw

DISC, ENVIRONMENT = load_disc("driver")
THROW = load_throw("driver")


def nothing(model: Any, data: Any) -> None:
    """Be called four times per RK4 step, and do nothing."""


def native_loop(flying: FlyingDisc, steps: int) -> float:
    """Seconds for the steps inside one call into MuJoCo: the cost without Python's loop (no callback possible)."""
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


def with_callback(apply: Callable[[Any, Any], None]) -> Callable[[FlyingDisc, int], float]:
    """Return the Python loop with a passive-force callback installed."""

    def run(flying: FlyingDisc, steps: int) -> float:
        with passive_force(flying.model, apply):
            return python_loop(flying, steps)

    return run


def with_air(flying: FlyingDisc, steps: int, python: bool) -> float:
    """Seconds for the steps with our air, called by MuJoCo in C or in Python."""
    with flying.air(python):
        return python_loop(flying, steps)


def whole_flight(steps: int, python: bool = False) -> float:
    """Seconds per ``steps`` steps of `fly`, which builds the disc, looks for the ground and keeps every state."""
    start = thread_time()
    motion = fly(DISC, ENVIRONMENT, THROW, duration=steps * 1e-3, python=python)
    return (thread_time() - start) * steps / (motion.t.size - 1)


def measure(steps: int, rounds: int) -> dict[str, np.ndarray]:
    """Return microseconds per step (rounds,) of each variant."""
    flying = FlyingDisc(DISC, ENVIRONMENT)
    variants: dict[str, Callable[[], float]] = {
        "bare loop, no callback": lambda: python_loop(flying, steps),
        "bare loop inside MuJoCo": lambda: native_loop(flying, steps),
        "empty Python callback": lambda: with_callback(nothing)(flying, steps),
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


def main() -> None:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description="Cost of an RK4 step of the truth, by what hangs on it.")
    parser.add_argument("--steps", type=int, default=4000, help="steps per measurement (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=15, help="measurements of each variant (default %(default)s)")
    given = parser.parse_args()
    if not 1 <= given.steps <= 6000 or given.rounds < 1:
        parser.error("expected 1 to 6000 steps (the throw lasts 6.9 s of 1 ms) and at least one round")
    cost = measure(given.steps, given.rounds)
    bare = cost["bare loop, no callback"]
    table = Table(
        title=f"us of CPU per RK4 step of 1 ms, {given.rounds} rounds of {given.steps} steps",
        caption=f"MuJoCo {mujoco.__version__}, numba {numba.__version__}, Python {platform.python_version()}, "
        f"{platform.machine()}, {os.cpu_count()} cores",
    )
    for heading in ("variant", "median", "quartiles", "ratio to bare", "s per simulated s"):
        table.add_column(heading, justify="left" if heading == "variant" else "right")
    for name, values in cost.items():
        low, middle, high = np.percentile(values, [25, 50, 75])
        ratio = float(np.median(values / bare))
        table.add_row(name, f"{middle:.2f}", f"{low:.2f} .. {high:.2f}", f"{ratio:.2f}", f"{middle * 1e-3:.4f}")
    Console(width=110).print(table)


if __name__ == "__main__":
    main()
