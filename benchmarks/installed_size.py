"""Time of ``import discsim`` and size of what an installation takes, by package: what a user waits for and stores.

    python benchmarks/installed_size.py [--rounds 5] [--least 1]

Run it by the interpreter of the environment that is to be measured. Sizes are those of the files that each
distribution lists, compiled byte code included, in MB of 10^6 bytes; the import is timed in processes of its own, from
the second on, beside that of numpy. ``import discsim`` loads names when they are asked for: the goal is 0.3 s at most.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
from importlib.metadata import Distribution, PackageNotFoundError, distribution
from pathlib import Path
from time import perf_counter

#: distributions that pip brings itself
_PIP = ("pip", "setuptools", "wheel")
LIMIT_S = 0.3


def size_mb(found: Distribution) -> float:
    """Return the size of all files of a distribution, MB."""
    paths = [Path(str(found.locate_file(file))) for file in found.files or ()]
    return sum(path.stat().st_size for path in paths if path.is_file()) / 1e6


def needed_by(name: str, extras: frozenset[str] = frozenset()) -> dict[str, Distribution]:
    """Return the distributions that an installed one needs, itself included, by lower-case name."""
    reached: dict[str, Distribution] = {}
    ahead = [(name, extras)]
    while ahead:
        name, wanted = ahead.pop()
        key = re.sub(r"[-_.]+", "-", name).lower()
        if key in reached and not wanted:
            continue
        try:
            reached[key] = distribution(name)
        except PackageNotFoundError:
            continue
        for line in reached[key].requires or ():
            requirement, _, marker = line.partition(";")
            extra = re.search(r"extra\s*==\s*['\"]([\w-]+)['\"]", marker)
            if extra is None or extra[1] in wanted:
                parsed = re.match(r"\s*([\w.-]+)\s*(?:\[([\w,\s-]+)\])?", requirement)
                assert parsed, line
                own = frozenset(filter(None, re.split(r"[,\s]+", parsed[2] or "")))
                ahead.append((parsed[1], own))
    return reached


def import_s(module: str, rounds: int) -> float:
    """Return the least time of several imports in fresh processes, s, less that of a process that imports nothing."""

    def least(code: str) -> float:
        times = []
        for _ in range(rounds + 1):
            start = perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            times.append(perf_counter() - start)
        return min(times[1:])

    return least(f"import {module}") - least("pass")


def main() -> None:
    """Measure and print; exit status 1 where the import takes longer than its limit."""
    parser = argparse.ArgumentParser(description="Import time and installed size.")
    parser.add_argument("--rounds", type=int, default=5, help="imports of each kind (default %(default)s)")
    parser.add_argument("--least", type=float, default=1.0, help="packages below this size, MB, are added up")
    given = parser.parse_args()
    core = needed_by("discsim")
    extras = ("cluster", "tables", "video", "logs", "docs", "test", "dev")
    sizes = {name: size_mb(found) for name, found in core.items() if name not in _PIP}
    print("MB     package, of `pip install discsim`")
    for name, size in sorted(sizes.items(), key=lambda item: -item[1]):
        if size >= given.least:
            print(f"{size:5.0f}  {name}")
    print(f"{sum(size for size in sizes.values() if size < given.least):5.0f}  others")
    print(f"{sum(sizes.values()):5.0f}  all")
    for extra in extras:
        more = {name: one for name, one in needed_by("discsim", frozenset({extra})).items() if name not in core}
        if more:
            print(
                f"{sum(map(size_mb, more.values())):5.0f}  more of the extra {extra}, as installed: {', '.join(more)}"
            )
    taken = import_s("discsim", given.rounds)
    print(f"import discsim: {taken:.3f} s (at most {LIMIT_S} s); import numpy: {import_s('numpy', given.rounds):.3f} s")
    if taken > LIMIT_S:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
