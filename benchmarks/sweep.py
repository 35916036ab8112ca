"""A sweep of mounts against one simulation for each of them: time per mount, in one run, and that both agree.

Usage: ``python benchmarks/sweep.py [--mounts 10000] [--simulations 10]``

Both sides turn the same table and score the accelerometer's rate on the same plateaus. A simulation of its own turns
the table in MuJoCo for its mount, lets the accelerometer measure, estimates and scores. The sweep turns it once. Both
work in this one process; times are wall times. Simulations are spread over the sweep's, so that a change of the
machine's clock falls on both.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

# in place of this folder, whose estimators.py would stand for the package
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from discsim.arrays import FloatArray  # noqa: E402
from discsim.effects.sensors import PositionOffset  # noqa: E402
from discsim.estimators.accelerometer import accelerometer  # noqa: E402
from discsim.rig import turn_table  # noqa: E402
from discsim.sensors import Accelerometer  # noqa: E402
from discsim.validation.scenarios.rate_table import errors_within, true_rate  # noqa: E402
from discsim.validation.sweeps.chunks import Sweep, chunk_tasks, fly_truth, motion_from, score_chunk, segments  # noqa: E402
from discsim.validation.sweeps.plan import Plan, plan_file, read_plan  # noqa: E402


def one_simulation(plan: Plan, number: int, mount: FloatArray) -> FloatArray:
    """Turn the table for one mount alone and return its mean error on each plateau, deg/s."""
    case = plan.cases[0]
    yaw = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(1, 0))).uniform(0, 2 * np.pi)
    assert plan.profile is not None
    motion = turn_table(plan.profile, plan.environment(case.settings), yaw=float(yaw))
    module = plan.instruments(case)
    if plan.drawn:
        module = module.drawn(np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(2, 0, 1, number))))
    sensor = module.sensors["accelerometer"]
    assert isinstance(sensor, Accelerometer)
    sensor = replace(sensor, offset=PositionOffset(*mount[:3].tolist()), misalignment=mount[3:])
    stream = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(2, 0, 0, number))).spawn(2)[1]
    rate = accelerometer(sensor.measure(motion, stream), sensor.sheet)
    errors = [errors_within(rate, true_rate(motion), *span) for span in segments(plan, motion, case.settings)]
    return np.array([np.degrees(error[known].mean()) if known.any() else np.nan for error, known in errors])


def main() -> None:
    """Time both and print their ratio."""
    parser = argparse.ArgumentParser(description="A sweep of mounts against one simulation for each.")
    parser.add_argument("--mounts", type=int, default=10_000)
    parser.add_argument("--simulations", type=int, default=10)
    given = parser.parse_args()
    whole = read_plan(plan_file("installation"), count=given.mounts)
    axes = tuple(axis._replace(values=axis.values[1:2], loaded=axis.loaded[1:2]) for axis in whole.axes[:1])
    plan = replace(whole, axes=axes, estimators={"accelerometer": given.mounts})
    mounts = plan.mounts.mounts(plan.seed)
    one_simulation(plan, 0, mounts[0])  # compiles what is compiled at first use
    tasks = chunk_tasks(plan)

    chosen = np.linspace(0, given.mounts - 1, given.simulations).round().astype(int)
    apart: list[float] = []
    alone: list[FloatArray] = []
    start = perf_counter()
    sweep = Sweep(plan, mounts, (motion_from(fly_truth(0, plan), plan, 0),))
    swept = perf_counter() - start
    scores = []
    for number, task in enumerate(tasks):
        while len(alone) * len(tasks) < given.simulations * (number + 1) and len(alone) < given.simulations:
            start = perf_counter()
            alone.append(one_simulation(plan, int(chosen[len(alone)]), mounts[chosen[len(alone)]]))
            apart.append(perf_counter() - start)
        start = perf_counter()
        scores.append(score_chunk(task.argument, sweep)["scores"][0])
        swept += perf_counter() - start
    bias = np.concatenate(scores)[chosen, :, 0]
    each = float(np.mean(apart))
    difference = np.nanmax(np.abs(bias - np.array(alone)))
    print(f"one simulation for each mount: {each * 1e3:.1f} ms (median {np.median(apart) * 1e3:.1f} ms)")
    print(f"{given.mounts} mounts in one sweep: {swept:.2f} s, {swept / given.mounts * 1e3:.3f} ms each")
    print(f"ratio: {each * given.mounts / swept:.0f} times faster; both agree to {difference:.1e} deg/s")


if __name__ == "__main__":
    main()
