"""The standalone model: its error, its speed against FrisPy on the same throw, bulk runs, and MuJoCo beside it.

Usage: ``python benchmarks/trajectory.py [errors] [frispy] [bulk] [mujoco] [--frispy PYTHON] [--rounds 25]
[--throws 100 300 1000] [--pairs 50]``; without names, all four parts.

FrisPy (``pip install frispy``, which wants its own environment) runs in the interpreter given, or in this one. Rounds
of both alternate, so that a change of the machine's clock falls on both; times are each process's own CPU time.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from time import perf_counter, process_time, thread_time

import numpy as np

from discsim.parameters import flight_parameters, tables
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import Flight, integrate, predict, predict_many, release_state
from discsim.validation.scenarios.engine_comparison import DISCS, compare_engines, strong_throw

DISC, ENVIRONMENT = load_disc("driver")
THROW = load_throw("driver")
FLIGHT_S = 3.0

#: our flights in a round, which last as long together as one of FrisPy's: after it the first finds its memory cold
REPEATED = 20

#: FrisPy's own error of 1e-6 m needs these (its method is RK45); it has no inertia and so no nutation to resolve
TIGHT = {"rtol": 1e-6, "atol": 1e-6}

#: flies the driver's release once for every line it reads, a dictionary of options, and answers with the milliseconds
#: it took and how far it is from a tight flight
FRISPY = """
import ast, sys, time
import numpy as np
from frispy.disc import Disc
from frispy.model import Model
disc = Disc(model=Model(PL0=0.13, PLa=2.1, PD0=0.062, PDa=1.35, alpha_0=-0.05, PTy0=-0.012, PTya=0.12),
            z=1.3, vx=23.635386, vz=4.167556, phi=-0.20944, theta=-0.139626, dgamma=-73.303829,
            area=0.0352989, mass=0.179, air_density=1.204, g=9.798)
path = lambda flown: np.array([flown[0][k] for k in "xyz"])
best = path(disc.compute_trajectory(flight_time=3.0, method="DOP853", rtol=1e-12, atol=1e-12))
print("ready", flush=True)
for line in sys.stdin:
    options = ast.literal_eval(line)
    start = time.process_time()
    flown = disc.compute_trajectory(flight_time=3.0, **options)
    took = (time.process_time() - start) * 1e3
    print(took, np.linalg.norm(path(flown) - best, axis=0).max(), flush=True)
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
        for tolerance in (1e-6, 1e-7, 1e-8, 1e-9):
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

    def ask(options: Mapping[str, object]) -> tuple[float, float]:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(f"{options}\n")
        process.stdin.flush()
        took, error = map(float, process.stdout.readline().split())
        return took, error

    best = predict(DISC, ENVIRONMENT, THROW, rtol=1e-12, atol=1e-12, duration=FLIGHT_S)
    instants, state = np.linspace(0.0, FLIGHT_S, 100), release_state(THROW)
    flat, lookup = flight_parameters(DISC, ENVIRONMENT), tables(DISC)
    ways: dict[str, Callable[[float], object]] = {
        "its path": lambda tol: predict(DISC, ENVIRONMENT, THROW, rtol=tol, atol=tol, duration=FLIGHT_S),
        "its path at 100 instants": lambda tol: predict(
            DISC, ENVIRONMENT, THROW, rtol=tol, atol=tol, duration=FLIGHT_S
        ).at(instants),
        "where it ends": lambda tol: integrate(flat, lookup, state, 0.0, FLIGHT_S, tol, tol, False),
    }
    for tolerance in (1e-6, 1e-8):
        flight = predict(DISC, ENVIRONMENT, THROW, rtol=tolerance, atol=tolerance, duration=FLIGHT_S)
        print(f"3 s of the driver's throw at {tolerance:.0e}, error {farthest(flight, best):.1e} m")
        for what, fly in ways.items():
            rows = []
            for turn in range(rounds + 1):
                (loose, loose_error), (tight, tight_error) = ask({}), ask(TIGHT)
                start = process_time()
                for _ in range(REPEATED):
                    fly(tolerance)
                if turn:
                    rows.append((loose, tight, (process_time() - start) * 1e3 / REPEATED))
            loose, tight, own = (statistics.median(column) for column in zip(*rows, strict=True))
            ratios = [statistics.median(row[k] / row[2] for row in rows) for k in (0, 1)]
            print(
                f"  {what}: {own:.3f} ms; FrisPy as it comes {loose:.1f} ms, error {loose_error:.0e} m: "
                f"{ratios[0]:.0f} times; at {tight_error:.0e} m {tight:.1f} ms: {ratios[1]:.0f} times"
            )
    process.stdin.close()
    process.wait()


def bulk(counts: Sequence[int]) -> None:
    """Print landings per second of CPU on one core, and their error, at several tolerances; and how the cost grows."""
    rng = np.random.default_rng(0)
    some = predict(DISC, ENVIRONMENT, THROW).state[0]
    states = np.tile(some, (max(counts), 1))
    states[:, 3:6] *= rng.uniform(0.8, 1.1, (max(counts), 1))
    few = states[: min(counts)]
    exact = predict_many(DISC, ENVIRONMENT, few, tolerance=1e-12, threads=1).state[:, :3]
    print(f"landings of {len(few)} throws on one thread: largest error m, landings per second of CPU")
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8):
        spent = []
        for _ in range(5):
            start = thread_time()
            found = predict_many(DISC, ENVIRONMENT, few, tolerance=tolerance, threads=1).state[:, :3]
            spent.append(thread_time() - start)
        error = np.linalg.norm(found - exact, axis=1).max()
        print(f"  tolerance {tolerance:.0e}: {error:8.1e} {len(few) / min(spent):8.0f}")
    cores = len(os.sched_getaffinity(0))
    for count in counts:
        start, own = perf_counter(), thread_time()
        predict_many(DISC, ENVIRONMENT, states[:count], threads=1)
        clock, one = perf_counter() - start, thread_time() - own
        start, process = perf_counter(), process_time()
        predict_many(DISC, ENVIRONMENT, states[:count], threads=cores)
        print(
            f"{count:6d} landings at 1e-8: {one:.3f} s of CPU on one thread, {one / count * 1e3:.2f} ms each, "
            f"{process_time() - process:.3f} s on {cores}; {clock / (perf_counter() - start):.2f} times less time"
        )


def against_mujoco(count: int) -> None:
    """Print the worst differences over random strong throws."""
    rng = np.random.default_rng(0)
    pairs = []
    for number in range(count):
        throw = strong_throw(rng, number)
        pairs.append((compare_engines(throw, timestep=1e-4), throw.name))
    for name, unit, factor in (("landing", "mm", 1e3), ("position", "mm", 1e3), ("attitude", "deg", 180 / np.pi)):
        value, where = max((getattr(pair, name), where) for pair, where in pairs)
        middle = statistics.median(getattr(pair, name) for pair, _ in pairs)
        print(f"{name}: worst {value * factor:.2g} {unit} ({where}), median {middle * factor:.2g} {unit}")


def main() -> None:
    """Run all parts."""
    parser = argparse.ArgumentParser(description="Error and speed of the standalone model.")
    parser.add_argument("parts", nargs="*", help="errors, frispy, bulk, mujoco; none: all")
    parser.add_argument("--frispy", default=sys.executable, help="interpreter that has FrisPy")
    parser.add_argument("--rounds", type=int, default=25)
    parser.add_argument("--throws", type=int, nargs="+", default=[100, 300, 1000])
    parser.add_argument("--pairs", type=int, default=50)
    given = parser.parse_args()
    parts: dict[str, Callable[[], None]] = {
        "errors": errors,
        "frispy": lambda: against_frispy(given.frispy, given.rounds),
        "bulk": lambda: bulk(given.throws),
        "mujoco": lambda: against_mujoco(given.pairs),
    }
    if unknown := [name for name in given.parts if name not in parts]:
        parser.error(f"no part '{unknown[0]}'; expected some of {', '.join(parts)}")
    for name in given.parts or parts:
        parts[name]()


if __name__ == "__main__":
    main()
