"""Mutation testing: change one operator, comparison or number of a file, run its tests, and list what nobody noticed.

``python -m tests.mutants discsim/frames.py --tests tests/discsim/test_frames.py --count 40 --seed 1``. Each mutant is
made in a copy of the checkout and killed where a test fails or hangs. Functions run as plain Python, a hundred times as
fast as compiling them anew; tests that fly need ``--compiled``.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[1]
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


def main() -> int:
    """Run mutants and print the survivors and the score."""
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--tests", nargs="+", required=True)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--compiled", action="store_true", help="compile each mutant, about a minute")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "copy"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns(".git", "__pycache__", ".*_cache"))
        target = copy / given.file
        source = target.read_text(encoding="utf-8")
        places = _places(ast.parse(source))
        chosen = sorted(random.Random(given.seed).sample(places, min(given.count, len(places))))
        words = [sys.executable, "-m", "pytest", "-q", "-x", "-n", "0", "-p", "no:cacheprovider", *given.tests]
        environment = {
            **os.environ,
            "PYTHONPATH": str(copy),
            "NUMBA_DISABLE_JIT": str(int(not given.compiled)),
            "CI": "1",
        }

        def passes(longest: float) -> bool:
            try:
                done = subprocess.run(
                    words, cwd=copy, env=environment, capture_output=True, timeout=longest, check=False
                )
            except subprocess.TimeoutExpired:
                return False
            return done.returncode == 0

        started = time.monotonic()
        if not passes(1800.0):
            raise SystemExit("the tests fail without any change, or without compiling; expected them to pass")
        longest, killed = 10 * (time.monotonic() - started) + 60.0, 0
        for number, _ in chosen:
            changed, what = _mutant(source, number)
            target.write_text(changed, encoding="utf-8")
            if passes(longest):
                print(f"survived, {what}", flush=True)
            else:
                killed += 1
        print(f"{given.file}: {killed} of {len(chosen)} mutants killed ({len(places)} places), seed {given.seed}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
