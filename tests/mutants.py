"""Mutation testing: change one operator, comparison or number of some files, run tests, and list what nobody noticed.

``python -m tests.mutants discsim/frames.py --tests tests/discsim/test_frames.py --count 40 --seed 1``. Each mutant is
made in a copy of the checkout and killed where a test fails or hangs. Functions that are compiled run as plain Python,
a hundred times as fast as compiling them anew; tests that fly are left out then, unless ``--compiled`` is given.
"""

from __future__ import annotations

import argparse
import ast
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
#: compiled code reads a record's fields as attributes, plain Python those of this type of numpy's alone
_RECORD = """
PARAMETERS = np.dtype((np.record, PARAMETERS))
"""
#: nothing compiled is changed: what is compiled once serves all mutants
_KEPT = """

def _cache_folder() -> Path:
    return Path({folder!r})
"""
_OPERATORS: dict[type[ast.AST], type[ast.AST]] = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Pow: ast.Mult,
    ast.Lt: ast.GtE,
    ast.LtE: ast.Gt,
    ast.Gt: ast.LtE,
    ast.GtE: ast.Lt,
    ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq,
    ast.And: ast.Or,
    ast.Or: ast.And,
    ast.USub: ast.UAdd,
}


def _places(tree: ast.Module) -> list[tuple[int, int]]:
    """Return the line of each node that can be changed, and its number in a walk; docstrings and types are none."""
    skipped = {
        id(inner)
        for node in ast.walk(tree)
        for outer in (getattr(node, "annotation", None), getattr(node, "returns", None))
        if outer is not None
        for inner in ast.walk(outer)
    }
    found = []
    for number, node in enumerate(ast.walk(tree)):
        if id(node) in skipped or not hasattr(node, "lineno"):
            continue
        changes = [getattr(node, "op", None), *getattr(node, "ops", [])]
        numeric = isinstance(node, ast.Constant) and isinstance(node.value, int | float)
        if numeric or any(type(one) in _OPERATORS for one in changes):
            found.append((number, node.lineno))
    return found


def _mutant(source: str, number: int) -> tuple[str, str]:
    """Return the source with node ``number`` of a walk changed, and what was changed."""
    tree = ast.parse(source)
    node = list(ast.walk(tree))[number]
    before = ast.unparse(node)
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        node.value = not node.value
    elif isinstance(node, ast.Constant):
        node.value = node.value + 1 if isinstance(node.value, int) else node.value * 1.1 + 0.1 * (node.value == 0.0)
    elif isinstance(node, ast.Compare):
        node.ops[0] = _OPERATORS[type(node.ops[0])]() if type(node.ops[0]) in _OPERATORS else node.ops[0]
    else:
        node.op = _OPERATORS[type(node.op)]()  # type: ignore[attr-defined]
    return ast.unparse(tree), f"line {node.lineno}: {before}  ->  {ast.unparse(node)}"  # type: ignore[attr-defined]


class _Copy:
    """A copy of the checkout in which mutants are made and tested."""

    def __init__(self, root: Path, compiled: bool, kept: bool) -> None:
        self.root, self._words = root, [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider"]
        # links stay links: discsim/validation leads to validation, where the mutants of its files are made
        shutil.copytree(ROOT, root, symlinks=True, ignore=shutil.ignore_patterns(".git", "__pycache__", ".*_cache"))
        self._environment = {
            **os.environ,
            "PYTHONPATH": str(root),
            "NUMBA_DISABLE_JIT": str(int(not compiled)),
            "CI": "1",
        }
        if not compiled:
            self._append("discsim/parameters.py", _RECORD)
        elif kept:
            self._append("discsim/compiled.py", _KEPT.format(folder=str(root / "kept")))

    def _append(self, name: str, text: str) -> None:
        with (self.root / name).open("a", encoding="utf-8") as file:
            file.write(text)

    def failing(self, tests: list[str]) -> list[str]:
        """Return the tests that fail without any change."""
        said = self._run(["-rfE", *tests], 1800.0)
        return [line.split()[1] for line in said.splitlines() if line.startswith(("FAILED ", "ERROR "))]

    def notices(self, tests: list[str], longest: float) -> bool:
        """Return whether a test fails, or hangs."""
        try:
            self._run(["-x", *tests], longest)
        except (subprocess.TimeoutExpired, subprocess.CalledProcessError):
            return True
        return False

    def _run(self, words: list[str], longest: float) -> str:
        done = subprocess.run(
            [*self._words, *words], cwd=self.root, env=self._environment, capture_output=True, text=True,
            timeout=longest, check="-x" in words,
        )  # fmt: skip
        return done.stdout


def main() -> int:
    """Run mutants and print the survivors and the score."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("files", type=Path, nargs="+")
    parser.add_argument("--tests", nargs="+", required=True)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--compiled", action="store_true", help="compile each mutant, about a minute")
    given = parser.parse_args()
    sources = {file: (ROOT / file).read_text(encoding="utf-8") for file in given.files}
    places = [(file, *place) for file, text in sources.items() for place in _places(ast.parse(text))]
    chosen = sorted(random.Random(given.seed).sample(places, min(given.count, len(places))))
    plain = not any(word in text for text in sources.values() for word in ("@compiled", "@inlined"))
    with tempfile.TemporaryDirectory() as folder:
        copy = _Copy(Path(folder) / "copy", given.compiled or plain, plain)
        left_out = copy.failing(given.tests)
        if left_out:
            print(f"left out, for they fail without any change or without compiling: {', '.join(left_out)}", flush=True)
        tests = [*given.tests, *(word for one in left_out for word in ("--deselect", one))]
        started = time.monotonic()
        if copy.notices(tests, 1800.0):
            raise SystemExit("the tests fail without any change; expected them to pass")
        longest, killed = 10 * (time.monotonic() - started) + 60.0, 0
        for file, number, _ in chosen:
            changed, what = _mutant(sources[file], number)
            (copy.root / file).write_text(changed, encoding="utf-8")
            if copy.notices(tests, longest):
                killed += 1
            else:
                print(f"survived, {file}, {what}", flush=True)
            (copy.root / file).write_text(sources[file], encoding="utf-8")
        low, high = _interval(killed, len(chosen))
        share = f"{100 * killed / len(chosen):.0f} %, 95 % of such samples: {100 * low:.0f} to {100 * high:.0f} %"
        print(f"{killed} of {len(chosen)} mutants killed ({share}), {len(places)} places, seed {given.seed}")
    return 0


def _interval(killed: int, count: int) -> tuple[float, float]:
    """Return Wilson's interval of a share, at 95 %."""
    z, share = 1.96, killed / count
    middle, half = share + z**2 / (2 * count), z * math.sqrt(share * (1 - share) / count + z**2 / (4 * count**2))
    return (middle - half) / (1 + z**2 / count), (middle + half) / (1 + z**2 / count)


if __name__ == "__main__":
    sys.exit(main())
