"""The corpus: every failure ever found, as the changes that make it out of a sound input, in a small TOML file."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
import tomllib
from pathlib import Path

from .campaign import Case, Found
from .targets import TARGETS

__all__ = ["CORPUS", "read_case", "write_case"]

CORPUS = Path(__file__).parent / "corpus"
#: A character that stands this often or more in a row is written ``<c*times>``; a byte that is no text ``<byte ff>``.
_OFTEN = 40


def _short(text: str) -> str:
    text = re.sub("[\udc80-\udcff]", lambda byte: f"<byte {ord(byte[0]) - 0xDC00:x}>", text)
    return re.sub(rf"([^<>*])\1{{{_OFTEN - 1},}}", lambda run: f"<{run[1]}*{len(run[0])}>", text)


def _long(text: str) -> str:
    text = re.sub("<byte ([0-9a-f]{2})>", lambda byte: chr(0xDC00 + int(byte[1], 16)), text)
    return re.sub(r"<(.)\*(\d+)>", lambda run: run[1] * int(run[2]), text)


def write_case(folder: Path, found: Found) -> Path:
    """Write a case into ``folder``, named by its content."""
    case = found.case
    sound = TARGETS[case.target].seeds[case.seed]()
    lines = [
        f"# {found.outcome.kind}: {found.outcome.said.splitlines()[0] if found.outcome.said else ''}"[:200],
        f"# {found.outcome.place}",
        f"target = {json.dumps(case.target)}",
        f"seed = {json.dumps(case.seed)}",
        f"without = {json.dumps([name for name in sound if name not in case.files])}",
    ]
    for name, text in case.files.items():
        before, after = sound.get(name, "").split("\n"), text.split("\n")
        # from the end, so that line numbers hold while they are put in one after the other
        for kind, a, b, c, d in reversed(difflib.SequenceMatcher(None, before, after, autojunk=False).get_opcodes()):
            if kind != "equal":
                new = [_short(line) for line in after[c:d]]
                lines += [
                    "",
                    "[[change]]",
                    f"file = {json.dumps(name)}",
                    f"lines = [{a}, {b}]",
                    f"new = {json.dumps(new)}",
                ]
    text = "\n".join([*lines, ""])
    folder.mkdir(parents=True, exist_ok=True)
    path = (
        folder
        / f"{case.target.replace(' ', '-')}-{hashlib.sha256(text.encode('utf-8', 'replace')).hexdigest()[:8]}.toml"
    )
    path.write_text(text, encoding="utf-8")
    return path


def read_case(path: Path) -> Case:
    """Return the case of a file of the corpus.

    Of each ``change`` lines a up to b of a sound file give way to new ones (from 0, the header is line 0). Of each
    ``move`` the cells of a column, in lines a up to b, become ``scale`` times what they are, and ``offset`` more.
    """
    stated = tomllib.loads(path.read_text(encoding="utf-8"))
    files = dict(TARGETS[stated["target"]].seeds[stated["seed"]]())
    for name in stated["without"]:
        del files[name]
    for change in stated.get("change", ()):
        lines = files.get(change["file"], "").split("\n")
        first, after = change["lines"]
        lines[first:after] = [_long(line) for line in change["new"]]
        files[change["file"]] = "\n".join(lines)
    for move in stated.get("move", ()):
        lines = files[move["file"]].split("\n")
        for number in range(*move["lines"]):
            cells = lines[number].split(",")
            moved = float(cells[move["column"]]) * move.get("scale", 1.0) + move.get("offset", 0.0)
            lines[number] = ",".join([*cells[: move["column"]], repr(moved), *cells[move["column"] + 1 :]])
        files[move["file"]] = "\n".join(lines)
    return Case(stated["target"], stated["seed"], files)
