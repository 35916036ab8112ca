"""Diffs that a page of the docs shows, and what the program says with the files that they make."""

from __future__ import annotations

import json
import os
import re
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


#: has modules of the folder that a program is given first take the place of ours, before anything of ours is imported
BESIDE = """
import sys
from importlib.machinery import PathFinder
from pathlib import Path

_find_spec = PathFinder.find_spec
def widened(name, path=None, target=None):
    spec = _find_spec(name, path, target)
    if name.partition(".")[0] == "discsim" and spec is not None and spec.submodule_search_locations:
        linked = name.startswith(("discsim.estimators", "discsim.validation"))
        place = Path(sys.argv[1], *name.split(".")[linked:])
        if place.is_dir():
            spec.submodule_search_locations.insert(0, str(place))
    return spec
PathFinder.find_spec = widened
"""


def applied(diff: str, folder: Path) -> None:
    """Write into a folder what a diff of new files and of hunks, whose old lines stand once in their file, makes."""
    for part in re.split(r"(?m)^--- ", diff)[1:]:
        target = re.search(r"^\+\+\+ b/(.*)$", part, re.MULTILINE)
        assert target is not None
        path = folder / target[1]
        path.parent.mkdir(parents=True, exist_ok=True)
        hunks = re.split(r"(?m)^@@.*\n", part.split("\n", 2)[2])
        if part.startswith("/dev/null"):
            path.write_text("".join(line[1:] + "\n" for line in hunks[0].splitlines()), encoding="utf-8")
            continue
        text = (ROOT / target[1]).read_text(encoding="utf-8")
        for hunk in hunks[1:]:
            lines = hunk.splitlines()
            before = "\n".join(line[1:] for line in lines if not line.startswith("+"))
            after = "\n".join(line[1:] for line in lines if not line.startswith("-"))
            assert text.count(before) == 1, before
            text = text.replace(before, after)
        path.write_text(text, encoding="utf-8")


def told_with(folder: Path, asked: str, *given: str) -> dict[str, Any]:
    """Return what a program prints as JSON behind ``TOLD``, with the modules of a folder in the place of ours.

    It gets the folder as its first argument. What was compiled of ours serves it, too: none of these changes it.
    """
    answer = subprocess.run(
        [sys.executable, "-c", BESIDE + asked, str(folder), *given],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    assert answer.returncode == 0, answer.stdout[-500:] + answer.stderr[-2000:]
    found: dict[str, Any] = json.loads(answer.stdout.partition("TOLD")[2])
    return found


def told_with_diff(heading: str, folder: Path, asked: str) -> dict[str, Any]:
    """Return what a program says, as of `told_with`, to which the diff of a section was applied."""
    applied(diff_of(heading), folder)
    return told_with(folder, asked)
