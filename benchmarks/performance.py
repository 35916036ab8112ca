"""Make docs/performance.md: run the benchmarks of speed one after another and put what they print into the page.

    python benchmarks/performance.py [--write] [--quick] [--no-log] [--frispy PYTHON]

Without ``--write`` the page is only printed. ``--quick`` takes few rounds and short logs.
"""

from __future__ import annotations

import argparse
import os
import platform
import subprocess
import sys
from datetime import date
from pathlib import Path

import mujoco
import numba
import numpy as np

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "performance.md"
#: what is run on long logs; an import holds a log's text cell by cell, and a diagnosis looks at its first minutes
LOG_COMMANDS = ("estimate", "estimate all", "check")

#: what is said of each measurement, before its output; {name} is what the benchmark of that name printed
TEXT = """# What it costs

Made by `{command}` on {day} with MuJoCo {mujoco}, numba {numba}, numpy {numpy} on Python {python}, {machine} with
{cores} cores, load {load:.0f} at the end: other work on a machine adds to every time here and takes part in none of
the ratios of CPU time, whose terms alternate in one run.

## A step of the truth, and a flight

`python benchmarks/step_cost.py step`. An RK4 step evaluates forces four times. MuJoCo calls the air in C, one
compiled function for all discs that it reaches by address; the callback in Python calls the same function and gives
the same states to the last bit. `fly` adds a fixed 2 to 4 ms for building the disc and the result, which the shorter
loops show.

{step}

Goals: our air in C over the bare loop at most 1.15, in Python 2.3, and `fly` with its states kept 1.5 over a flight
of 4000 steps.

## Many flights at once

`python benchmarks/step_cost.py batch`. `fly_many` steps all flights by `mujoco.batch`, whose threads need no
interpreter. The busiest thread's CPU time, with all that is serial in it, is what the clock shows on a machine with
nothing else to do; the ratio by the clock below it was taken beside other work.

{batch}

Goal: at least 0.9 of the cores for 1000 flights.

## Start

`python benchmarks/start_up.py`: the least of several processes, with bytecode and compiled code in their caches. A
flight loads numpy, numba and MuJoCo, whose own start stands beside it; scipy is loaded by what needs it.

{start}

Goals: `import discsim` and `discsim --help` 0.3 s, `discsim fly` of a 3 s throw 1.5 s from the second time on.
The three imports take half of a flight's start; the rest is numba's own registries, a seventh, the command line and our
modules, a fifth, and the flight with its files.

## The standalone model

`python benchmarks/trajectory.py bulk{frispy_part}`.

{trajectory}

Goals on one core: 10 000 landings a second at 1 cm, 2000 at 1e-6 m. A looser tolerance gains little: above 1e-5 the
table hardly changes, for the nutation, r Izz/Ixx or 140 rad/s of a driver, holds an explicit pair to steps of a
fraction of its turn, beyond which it is unstable whatever error is allowed.

## A diagnosis

`python benchmarks/diagnosis.py sets growth --each {each}`: CPU seconds of a whole diagnosis, all threads, of sets that
are drawn and simulated as the blind test's, and whether the answer was right.

{diagnosis}

The motion of each segment is flown exactly once a step of a fit; the neighbours of that motion, by which slopes are
taken, some 25 in a refit and 80 where every effect is asked, are flown in steps of 1.4 rad of nutation
(`validation/identification/plants/flight_neighbours.py`). What is left is half numpy: what sensors show, normal
equations, tests of residuals.

## A long log

`python benchmarks/long_log.py --minutes {minutes} --commands {log_commands}`: commands on a log of three sensors at
1 kHz, and on data sets of throws, start included; what a minute, or a throw, more costs is the same at every size where
time is linear.

{log}

Goal: an hour in 60 s and 1 GB. The work is shared by all cores: on two, half the CPU seconds pass by the clock where
nothing else runs. [What each method costs](estimators.md) says which methods take it.
"""


def printed(arguments: list[str]) -> str:
    """Return what a benchmark prints, as a block of code; raises SystemExit where it fails."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "110"}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True, check=False
    )
    if done.returncode:
        raise SystemExit(f"python {' '.join(arguments)}: status {done.returncode}")
    lines = "\n".join(line.rstrip() for line in done.stdout.strip("\n").splitlines())
    return f"```\n{lines}\n```"


def _told(arguments: list[str]) -> list[str]:
    """Return arguments as a page tells them: where an interpreter lies is of this machine alone."""
    before = [None, *arguments[:-1]]
    return ["PYTHON" if last == "--frispy" else one for last, one in zip(before, arguments, strict=True)]


def main() -> None:
    """Run the benchmarks and make the page."""
    parser = argparse.ArgumentParser(description="Make the page of what things cost.")
    parser.add_argument("--write", action="store_true", help="write docs/performance.md")
    parser.add_argument("--quick", action="store_true", help="few rounds, few flights, short logs")
    parser.add_argument("--no-log", action="store_true", help="leave out the long log, which takes longest")
    parser.add_argument("--frispy", help="interpreter that has FrisPy; without it that comparison is left out")
    given = parser.parse_args()
    rounds, flights = ("3", ["10", "30", "100"]) if given.quick else ("15", ["10", "100", "1000"])
    minutes = ["0.5", "1", "2"] if given.quick else ["1", "10", "60"]
    each = "2" if given.quick else "9"
    frispy = ["frispy", "--frispy", given.frispy] if given.frispy else []
    text = TEXT.partition("## A long log")[0].rstrip() + "\n" if given.no_log else TEXT
    page = text.format(
        command=" ".join(["python benchmarks/performance.py", *_told(sys.argv[1:])]),
        day=date.today(),
        mujoco=mujoco.__version__,
        numba=numba.__version__,
        numpy=np.__version__,
        python=platform.python_version(),
        machine=platform.machine(),
        cores=os.cpu_count(),
        step=printed(["benchmarks/step_cost.py", "step", "--rounds", rounds]),
        batch=printed(["benchmarks/step_cost.py", "batch", "--flights", *flights]),
        start=printed(["benchmarks/start_up.py", "--rounds", "2" if given.quick else "7"]),
        trajectory=printed(["benchmarks/trajectory.py", "bulk", *frispy]),
        frispy_part=" frispy --frispy PYTHON" if frispy else "",
        each=each,
        diagnosis=printed(["benchmarks/diagnosis.py", "sets", "growth", "--each", each]),
        minutes=" ".join(minutes),
        log_commands=" ".join(f"'{name}'" if " " in name else name for name in LOG_COMMANDS),
        log=""
        if given.no_log
        else printed(["benchmarks/long_log.py", "--minutes", *minutes, "--commands", *LOG_COMMANDS]),
        load=os.getloadavg()[0],
    )
    print(page)
    if given.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
