"""The standalone model: its error, its speed against FrisPy on the same throw, bulk runs, and MuJoCo beside it.

Usage: ``python benchmarks/trajectory.py [--frispy PYTHON] [--rounds 25] [--throws 1000] [--pairs 50]``

FrisPy (``pip install frispy``, which wants its own environment) runs in the interpreter given, or in this one. Rounds
of both alternate, so that a change of the machine's clock falls on both; times are each process's own CPU time.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from time import perf_counter, process_time

import numpy as np

from discsim.shipped import load_disc, load_throw
from discsim.trajectory import Flight, predict, predict_many
from validation.engine_comparison import DISCS, compare_engines, strong_throw

DISC, ENVIRONMENT = load_disc("driver")
THROW = load_throw("driver")
FLIGHT_S = 3.0

#: flies the driver's release once for every line it reads, and answers with the milliseconds it took
FRISPY = """
import sys, time
import numpy as np
from frispy.disc import Disc
from frispy.model import Model
disc = Disc(model=Model(PL0=0.13, PLa=2.1, PD0=0.062, PDa=1.35, alpha_0=-0.05, PTy0=-0.012, PTya=0.12),
            z=1.3, vx=23.635386, vz=4.167556, phi=-0.20944, theta=-0.139626, dgamma=-73.303829,
            area=0.0352989, mass=0.179, air_density=1.204, g=9.798)
print("ready", flush=True)
for line in sys.stdin:
    start = time.process_time()
    disc.compute_trajectory(flight_time=3.0)
    print((time.process_time() - start) * 1e3, flush=True)
"""


def farthest(flight: Flight, best: Flight) -> float:
    """Largest distance between two flights on the way, m."""
    t = np.linspace(0.0, min(flight.end, best.end), 2000)
    return float(np.linalg.norm(flight.at(t).position - best.at(t).position, axis=1).max())


def errors() -> None:
    """Print steps, error and time of whole flights of each disc at several tolerances."""
    print("disc        tolerance  steps  error m    ms per flight (CPU)")
    for name in DISCS:
        disc, environment = load_disc(name)
        best = predict(disc, environment, THROW, rtol=1e-12, atol=1e-12)
        for tolerance in (1e-7, 1e-8, 1e-9, 1e-10):
            times = []
            for _ in range(15):
                start = process_time()
                flight = predict(disc, environment, THROW, rtol=tolerance, atol=tolerance)
                times.append((process_time() - start) * 1e3)
            print(
                f"{name:10s} {tolerance:10.0e} {flight.t.size - 1:6d} {farthest(flight, best):9.1e} "
                f"{statistics.median(times):8.2f}"
            )


def against_frispy(python: str, rounds: int) -> None:
    """Print the median ratio of FrisPy's time to ours over alternating rounds, and our error."""
    process = subprocess.Popen(
        [python, "-c", FRISPY], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    if process.stdout.readline().strip() != "ready":
        print(f"FrisPy: not installed in {python}, this part is skipped; pip install frispy, or name its interpreter")
        return
    best = predict(DISC, ENVIRONMENT, THROW, rtol=1e-12, atol=1e-12, duration=FLIGHT_S)
    for tolerance in (1e-7, 1e-8):
        theirs, ours = [], []
        for turn in range(rounds + 1):
            process.stdin.write("\n")
            process.stdin.flush()
            other = float(process.stdout.readline())
            start = process_time()
            flight = predict(DISC, ENVIRONMENT, THROW, rtol=tolerance, atol=tolerance, duration=FLIGHT_S)
            own = (process_time() - start) * 1e3
            if turn:
                theirs.append(other)
                ours.append(own)
        ratio = statistics.median(a / b for a, b in zip(theirs, ours, strict=True))
        print(
            f"3 s of the driver's throw: FrisPy {statistics.median(theirs):.1f} ms, ours at {tolerance:.0e} "
            f"{statistics.median(ours):.3f} ms: {ratio:.0f} times faster, error {farthest(flight, best):.1e} m"
        )
    process.stdin.close()
    process.wait()


def bulk(count: int) -> None:
    """Print the wall time of many throws on one thread and on all cores."""
    rng = np.random.default_rng(0)
    some = predict(DISC, ENVIRONMENT, THROW).state[0]
    states = np.tile(some, (count, 1))
    states[:, 3:6] *= rng.uniform(0.8, 1.1, (count, 1))
    predict_many(DISC, ENVIRONMENT, states[:2])
    for threads in (1, len(os.sched_getaffinity(0))):
        start = perf_counter()
        predict_many(DISC, ENVIRONMENT, states, threads=threads)
        print(f"{count} landings on {threads} thread(s): {perf_counter() - start:.2f} s")


def against_mujoco(count: int) -> None:
    """Print the worst differences over random strong throws."""
    rng = np.random.default_rng(0)
    pairs = []
    for number in range(count):
        throw = strong_throw(rng, number)
        pairs.append((compare_engines(throw), throw.name))
    for name, unit, factor in (("landing", "mm", 1e3), ("position", "mm", 1e3), ("attitude", "deg", 180 / np.pi)):
        value, where = max((getattr(pair, name), where) for pair, where in pairs)
        middle = statistics.median(getattr(pair, name) for pair, _ in pairs)
        print(f"{name}: worst {value * factor:.2g} {unit} ({where}), median {middle * factor:.2g} {unit}")


def main() -> None:
    """Run all parts."""
    parser = argparse.ArgumentParser(description="Error and speed of the standalone model.")
    parser.add_argument("--frispy", default=sys.executable, help="interpreter that has FrisPy")
    parser.add_argument("--rounds", type=int, default=25)
    parser.add_argument("--throws", type=int, default=1000)
    parser.add_argument("--pairs", type=int, default=50)
    given = parser.parse_args()
    errors()
    against_frispy(given.frispy, given.rounds)
    bulk(given.throws)
    against_mujoco(given.pairs)


if __name__ == "__main__":
    main()
