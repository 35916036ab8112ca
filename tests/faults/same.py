"""The same command gives the same bytes: in another folder, with other workers, hash seeds and compile caches.

``python -m tests.faults.same [--command NAME] [--cold]`` says which files differ from those of a first run. ``--cold``
also compiles anew, a minute of one core for each command.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from faults.harness import COMMANDS, content, prepare

__all__ = ["differing", "run_again"]

ROOT = Path(__file__).parents[2]
#: commands that share their work among processes: the number of them changes nothing
_SHARED = ("sweep", "challenge")


def run_again(words: Sequence[str], out: Path, desk: Path, **environment: str) -> dict[str, bytes]:
    """Run a command in a new process that works in the folder ``desk``; return what it wrote."""
    desk.mkdir(parents=True, exist_ok=True)
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    done = subprocess.run(
        [sys.executable, "-m", "discsim.validation.cli", *words, "--out", str(out)],
        cwd=desk,
        env={**os.environ, "PYTHONPATH": path, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 1):
        raise AssertionError(f"{' '.join(words)}: exit status {done.returncode}: {done.stderr[-500:]}")
    return content(out)


def differing(one: Mapping[str, bytes], other: Mapping[str, bytes]) -> list[str]:
    """Return the names of files that two runs do not share, byte for byte; pages and run.json say who made them."""
    return [name for name in sorted({*one, *other}) if one.get(name) != other.get(name)]


def _variations(
    name: str, words: list[str], place: Path, cold: bool
) -> Iterator[tuple[str, list[str], dict[str, str]]]:
    yield "once more, in another folder", words, {"PYTHONHASHSEED": "0"}
    yield "with another hash seed", words, {"PYTHONHASHSEED": "12345"}
    if name in _SHARED:
        at = words.index("--workers")
        for count in ("2", "4"):
            yield f"with {count} workers", [*words[: at + 1], count, *words[at + 2 :]], {}
    if cold:
        yield "with nothing compiled", words, {"NUMBA_CACHE_DIR": str(place / "compiled")}


def main() -> int:
    """Compare all commands; exit status 1 where a file differs."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults.same", description=__doc__)
    parser.add_argument("--command", action="append", choices=sorted(COMMANDS), help="which (default: all)")
    parser.add_argument("--cold", action="store_true", help="compile anew, too")
    given = parser.parse_args()
    faults = 0
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        prepare(place / "given")
        for name in given.command or COMMANDS:
            words = COMMANDS[name](place / "given")
            # every folder is called the same: a recording bears the name of its own
            first = run_again(words, place / name / "out", place / name)
            for number, (what, other, environment) in enumerate(_variations(name, words, place / name, given.cold)):
                desk = place / name / f"desk-{number}"
                found = differing(first, run_again(other, desk / "out", desk, **environment))
                faults += len(found)
                print(f"{name} {what}: {len(first)} files, {', '.join(found) or 'the same bytes'}", flush=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
