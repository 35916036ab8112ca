"""Make docs/performance.md: run the benchmarks of speed one after another and put what they print into the page.

    python benchmarks/performance.py [--write] [--quick] [--section NAME ...] [--frispy PYTHON]

Without ``--write`` the page is only printed. ``--quick`` takes few rounds and short logs. Sections that are not
measured anew stay as they are.
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

#: what the page says first
HEAD = """# What it costs

Made by `python benchmarks/performance.py --write`; each section tells when it was measured and beside how much other
work (load), which adds to every time and takes part in none of the ratios of CPU time, whose terms alternate in one
run. `--section NAME` measures one anew.
"""

#: under each heading
MEASURED = """Measured on {day} on {machine} with {cores} cores at a load of {load:.0f} at the end; MuJoCo {mujoco},
numba {numba}, numpy {numpy}, Python {python}."""

#: section -> its heading and what is said of the measurement, before and after what the benchmark printed
SECTIONS: dict[str, tuple[str, str]] = {
    "step": (
        "A step of the truth, and a flight",
        """`{command}`. An RK4 step evaluates forces four times. MuJoCo calls the air in C, one
compiled function for all discs that it reaches by address; the callback in Python calls the same function and gives
the same states to the last bit. `fly` adds a fixed 2 to 4 ms for building the disc and the result, which the shorter
loops show.

{printed}

Goals: our air in C over the bare loop at most 1.15, in Python 2.3, and `fly` with its states kept 1.5 over a flight
of 4000 steps.""",
    ),
    "batch": (
        "Many flights at once",
        """`{command}`. `fly_many` steps all flights by `mujoco.batch`, whose threads need no
interpreter. The busiest thread's CPU time, with all that is serial in it, is what the clock shows on a machine with
nothing else to do; the ratio by the clock below it was taken beside other work.

{printed}

Goal: at least 0.9 of the cores for 1000 flights.""",
    ),
    "start": (
        "Start",
        """`{command}`: the least of several processes, with bytecode and compiled code in their caches. A
flight loads numpy, numba and MuJoCo, whose own start stands beside it; scipy is loaded by what needs it.

{printed}

Goals: `import discsim` and `discsim --help` 0.3 s, `discsim fly` of a 3 s throw 1.5 s from the second time on.
The three imports take half of a flight's start; the rest is numba's own registries, a seventh, the command line and our
modules, a fifth, and the flight with its files.""",
    ),
    "trajectory": (
        "The standalone model",
        """`{command}`.

{printed}

Goals on one core: 10 000 landings a second at 1 cm, 2000 at 1e-6 m. A looser tolerance gains little: above 1e-5 the
table hardly changes, for the nutation, r Izz/Ixx or 140 rad/s of a driver, holds an explicit pair to steps of a
fraction of its turn, beyond which it is unstable whatever error is allowed.""",
    ),
    "diagnosis": (
        "A diagnosis",
        """`{command}`: CPU seconds of a whole diagnosis, all threads, of sets that
are drawn and simulated as the blind test's, and whether the answer was right.

{printed}

The motion of each segment is flown exactly once a step of a fit; the neighbours of that motion, by which slopes are
taken, some 25 in a refit and 80 where every effect is asked, are flown in steps of 1.4 rad of nutation
(`validation/identification/plants/flight_neighbours.py`). What is left is half numpy: what sensors show, normal
equations, tests of residuals.""",
    ),
    "log": (
        "A long log",
        """`{command}`:
commands on a log of three sensors at 1 kHz, start included; what a minute more costs is the same at every length where
time is linear.

{printed}

Goal: an hour in 60 s and 1 GB. The work is shared by all cores: on two, half the CPU seconds pass by the clock where
nothing else runs. [What each method costs](estimators.md) says which methods take it. Of a free spin a diagnosis looks
at the first 20 s, of a rig at the first ten minutes.""",
    ),
    "throws": (
        "Many throws",
        """`{command}`:
commands on data sets of throws of three seconds, start included; what a throw more costs is the same at every size
where time is linear. A diagnosis holds the readings of all, and what its fits say of each.

{printed}""",
    ),
}


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


def benchmark(section: str, given: argparse.Namespace) -> list[str]:
    """Return the benchmark of a section with its arguments, as told on the page but for an interpreter's place."""
    quick = given.quick
    rounds, flights = ("3", ["10", "30", "100"]) if quick else ("15", ["10", "100", "1000"])
    minutes = ["0.5", "1", "2"] if quick else ["1", "10", "60"]
    throws = ["5", "10", "20"] if quick else ["10", "50", "200"]
    long_log = ["benchmarks/long_log.py", "--minutes"]
    return {
        "step": ["benchmarks/step_cost.py", "step", "--rounds", rounds],
        "batch": ["benchmarks/step_cost.py", "batch", "--flights", *flights],
        "start": ["benchmarks/start_up.py", "--rounds", "2" if quick else "7"],
        "trajectory": [
            *("benchmarks/trajectory.py", "bulk"),
            *(("frispy", "--frispy", given.frispy) if given.frispy else ()),
        ],
        "diagnosis": ["benchmarks/diagnosis.py", "sets", "growth", "--each", "2" if quick else "9"],
        "log": [*long_log, *minutes, "--throws", "--commands", "import", "check", "estimate"],
        "throws": [*long_log, "--throws", *throws, "--commands", "check", "diagnose"],
    }[section]


def measured(section: str, given: argparse.Namespace) -> str:
    """Return a section of the page, measured now."""
    heading, text = SECTIONS[section]
    arguments = benchmark(section, given)
    output = printed(arguments)
    when = MEASURED.format(
        day=date.today(),
        mujoco=mujoco.__version__,
        numba=numba.__version__,
        numpy=np.__version__,
        python=platform.python_version(),
        machine=platform.machine(),
        cores=os.cpu_count(),
        load=os.getloadavg()[0],
    )
    body = text.format(command=" ".join(["python", *_told(arguments)]), printed=output)
    return f"{heading}\n\n{when}\n\n{body}\n"


def main() -> None:
    """Run the benchmarks and make the page."""
    parser = argparse.ArgumentParser(description="Make the page of what things cost.")
    parser.add_argument("--write", action="store_true", help="write docs/performance.md")
    parser.add_argument("--quick", action="store_true", help="few rounds, few flights, short logs")
    parser.add_argument("--section", nargs="+", choices=SECTIONS, default=list(SECTIONS), help="what is measured anew")
    parser.add_argument("--frispy", help="interpreter that has FrisPy; without it that comparison is left out")
    given = parser.parse_args()
    known = {part.partition("\n")[0]: part for part in PAGE.read_text(encoding="utf-8").split("\n## ")[1:]}
    sections = [
        measured(name, given) if name in given.section else known[heading]
        for name, (heading, _) in SECTIONS.items()
        if name in given.section or heading in known
    ]
    page = "\n## ".join([HEAD, *sections])
    print(page)
    if given.write:
        PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
