"""Disturb runs of commands, half of them by SIGKILL and half by SIGINT, and say what went wrong."""

from __future__ import annotations

import argparse
import os
import random
import secrets
import signal
import sys
import tempfile
import time
from pathlib import Path

# before numpy is loaded, as in the command: forked processes have one thread
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parents[1]))

from faults.harness import COMMANDS, content, disturbed, doubled, prepare, run


def main() -> int:
    """Run the campaign; exit status 1 where anything went wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("--kills", type=int, default=50, help="of each signal and command (default 50)")
    parser.add_argument("--seed", type=int, default=None, help="of the moments (default: a new one)")
    parser.add_argument("--command", action="append", choices=sorted(COMMANDS), help="which (default: all)")
    given = parser.parse_args()
    seed = secrets.randbelow(10**9) if given.seed is None else given.seed
    rng, faults = random.Random(seed), 0
    print(f"seed {seed}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place / "given")
        for name in given.command or COMMANDS:
            words = COMMANDS[name](place / "given")
            for number in range(2):  # the first one compiles, and its time says nothing
                started = time.monotonic()
                # of the name that the disturbed ones write to: a recording bears that of its folder
                out = place / f"{name}-whole-{number}" / "out"
                if (status := run([*words, "--out", str(out)], place / "heard")) not in (0, 1):
                    raise SystemExit(f"{name}: exit status {status}: {(place / 'heard').read_text()[-500:]}")
            seconds, whole = time.monotonic() - started, content(out)
            found = []
            for number, kill in enumerate([signal.SIGKILL, signal.SIGINT] * given.kills):
                found += disturbed(words, whole, seconds, place / f"{name}-{number}", kill, rng)
            found += doubled(words, whole, place / f"{name}-twice")
            faults += len(found)
            print(f"{name}: {2 * given.kills} disturbed and one doubled, {len(found)} faults", flush=True)
            for line in found[:20]:
                print(f"  {line}", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
