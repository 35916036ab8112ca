"""Diffs that a page of the docs shows, applied to a copy of the program, and what that copy says."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "architecture.md"


def diff_of(heading: str) -> str:
    """Return the one diff of the section of docs/architecture.md under a heading."""
    page = PAGE.read_text(encoding="utf-8")
    section = page[page.index(f"### {heading}\n") + 4 :]
    (diff,) = re.findall(r"^```diff\n(.*?)^```", section.partition("\n### ")[0], re.MULTILINE | re.DOTALL)
    return diff


def applied(diff: str, folder: Path) -> None:
    """Apply a diff of new files and of hunks whose old lines stand once in their file."""
    for part in re.split(r"(?m)^--- ", diff)[1:]:
        target = re.search(r"^\+\+\+ b/(.*)$", part, re.MULTILINE)
        assert target is not None
        path = folder / target[1]
        hunks = re.split(r"(?m)^@@.*\n", part.split("\n", 2)[2])
        if part.startswith("/dev/null"):
            path.write_text("".join(line[1:] + "\n" for line in hunks[0].splitlines()), encoding="utf-8")
            continue
        text = path.read_text(encoding="utf-8")
        for hunk in hunks[1:]:
            lines = hunk.splitlines()
            before = "\n".join(line[1:] for line in lines if not line.startswith("+"))
            after = "\n".join(line[1:] for line in lines if not line.startswith("-"))
            assert text.count(before) == 1, before
            text = text.replace(before, after)
        path.write_text(text, encoding="utf-8")


def told_by_a_copy(heading: str, folder: Path, asked: str, *, compiled: bool = True) -> dict[str, Any]:
    """Return what a program prints as JSON behind ``TOLD``, run in a copy to which a section's diff was applied.

    The program gets the folder of the copy as its argument. Where it computes little, compiling takes longer than all
    of it without being ``compiled``.
    """
    for package in ("discsim", "estimators", "validation", "models"):
        shutil.copytree(ROOT / package, folder / package, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    applied(diff_of(heading), folder)
    answer = subprocess.run(
        [sys.executable, "-c", asked, str(folder)],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "NUMBA_DISABLE_JIT": str(int(not compiled))},
    )
    assert answer.returncode == 0, answer.stdout[-500:] + answer.stderr[-2000:]
    found: dict[str, Any] = json.loads(answer.stdout.partition("TOLD")[2])
    return found
