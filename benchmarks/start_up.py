"""CPU seconds and wall time of commands that do little: what a person waits for before anything happens.

    python benchmarks/start_up.py [--rounds 5]

Each runs in a process of its own, from the second time on, so that the compiled code and Python's bytecode are in
their caches, whatever the environment says about bytecode; what is printed is the least of several, beside that of
`import numpy`, `import numba` and `import mujoco` in the same run.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).resolve().parent.parent


def used(arguments: list[str], bytecode: Path) -> tuple[float, float]:
    """Return CPU seconds and wall time of a Python process; raises SystemExit where it fails."""
    start = perf_counter()
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONPYCACHEPREFIX": str(bytecode)}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"python {' '.join(arguments)}: status {status}")
    return usage.ru_utime + usage.ru_stime, perf_counter() - start


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description="CPU seconds and wall time of the start of commands.")
    parser.add_argument("--rounds", type=int, default=5, help="processes of each kind (default %(default)s)")
    given = parser.parse_args()
    if given.rounds < 1:
        parser.error("expected at least one round")
    command = ["-m", "discsim.validation.cli"]
    with tempfile.TemporaryDirectory() as scratch:
        out = str(Path(scratch) / "flight")
        kinds = {
            "python -c pass": ["-c", "pass"],
            "import numpy": ["-c", "import numpy"],
            "import numba": ["-c", "import numba"],
            "import mujoco": ["-c", "import mujoco"],
            "import discsim": ["-c", "import discsim"],
            "discsim --help": [*command, "--help"],
            "discsim fly --help": [*command, "fly", "--help"],
            **{
                f"discsim fly --duration {seconds}": [*command, "fly", "--duration", str(seconds), "--out", out]
                for seconds in (1, 3, 6)
            },
        }
        bytecode = Path(scratch) / "bytecode"
        used(kinds["discsim fly --duration 1"], bytecode)  # compiles, the first time on a machine
        spent: dict[str, list[tuple[float, float]]] = {name: [] for name in kinds}
        for _ in range(given.rounds):
            for name, arguments in kinds.items():
                spent[name].append(used(arguments, bytecode))
    print("                            CPU s   by the clock, s")
    for name, pairs in spent.items():
        print(f"{name:26s} {min(cpu for cpu, _ in pairs):6.2f} {min(wall for _, wall in pairs):10.2f}")


if __name__ == "__main__":
    main()
