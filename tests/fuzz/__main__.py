"""Mutate, run, judge, and say what failed; exit status 1 where anything did."""

from __future__ import annotations

import argparse
import random
import secrets
import sys
import time
from collections import Counter
from pathlib import Path

from .campaign import Found, campaign, warm_up
from .corpus import write_case
from .targets import TARGETS


def main() -> int:
    """Run a campaign and print one line per kind of fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--mutations", type=int, default=2000, help="how many cases (default 2000)")
    parser.add_argument("--seed", type=int, default=None, help="of everything random (default: a new one)")
    parser.add_argument("--target", action="append", choices=sorted(TARGETS), help="what is attacked (default: all)")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after this long, whatever is left")
    parser.add_argument("--keep", type=Path, default=None, help="a folder for one case of each fault, as the corpus's")
    given = parser.parse_args()
    seed = secrets.randbelow(10**9) if given.seed is None else given.seed
    print(f"seed {seed}", flush=True)
    counts: Counter[tuple[str, str]] = Counter()
    faults: Counter[tuple[str, str, str]] = Counter()
    slowest: dict[str, float] = {}
    targets = given.target or list(TARGETS)
    for name in targets:
        warm_up(name)
    started = time.monotonic()
    for found in campaign(targets, given.mutations, random.Random(seed)):
        counts[found.target, found.outcome.kind] += 1
        slowest[found.target] = max(slowest.get(found.target, 0.0), found.seconds)
        if not found.outcome.sound:
            _tell(found, faults, given.keep)
        if time.monotonic() - started > given.seconds:
            break
    for target in dict.fromkeys(target for target, _ in counts):
        listed = ", ".join(f"{count} {kind}" for (name, kind), count in sorted(counts.items()) if name == target)
        print(f"{target}: {listed}; the longest took {slowest[target]:.2f} s")
    tried = f"{sum(counts.values())} cases in {time.monotonic() - started:.0f} s"
    print(f"{sum(faults.values())} faults of {len(faults)} kinds in {tried}, seed {seed}")
    if faults:
        words = "".join(f" --target {name}" for name in given.target or ())
        print(f"once more: python -m tests.fuzz --mutations {sum(counts.values())} --seed {seed}{words}")
    return 1 if faults else 0


def _tell(found: Found, faults: Counter[tuple[str, str, str]], keep: Path | None) -> None:
    """Print a fault, and keep its case, the first time that its kind is met."""
    key = (found.target, found.outcome.kind, found.outcome.place or found.outcome.said[:60])
    faults[key] += 1
    if faults[key] == 1:
        print(f"{found.target}: {found.outcome.kind}: {found.outcome.said}\n    {found.outcome.place}", flush=True)
        if keep is not None:
            write_case(keep, found)


if __name__ == "__main__":
    sys.exit(main())
