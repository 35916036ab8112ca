"""What is shipped, by kind and name: discs, parts, throws, sites, rate tables, import maps, sweep plans, effects."""

from __future__ import annotations

import itertools
import re
import textwrap
from difflib import get_close_matches

from discsim.effects.catalogue import CATALOGUE, Row
from discsim.errors import InputError
from discsim.files import model_file, model_names, read_text

__all__ = ["KINDS", "listed", "namesakes", "shown"]

#: kind -> folder in ``models``; effects are rows of the catalogue
KINDS = {
    "discs": "discs",
    "parts": "parts",
    "throws": "throws",
    "sites": "sites",
    "tables": "tables",
    "maps": "imports",
    "sweeps": "sweeps",
    "effects": "",
}


def listed(kind: str) -> dict[str, str]:
    """Return what is shipped of a kind: name, and a line on it; raises `InputError` for another kind."""
    if kind not in KINDS:
        raise InputError(f"no list of '{kind}'; expected one of {', '.join(KINDS)}")
    if kind == "effects":
        return {row.id: row.title for row in CATALOGUE.values()}
    folder = KINDS[kind]
    return {name: _first_line(_text(folder, name)) for name in model_names(folder)}


def shown(name: str) -> str:
    """Return what is shipped by a name: a file as it is, an effect as its row tells.

    A disc and a throw may share a name, which is the disc's: ``throws/driver`` is the throw (`namesakes`). Raises
    `InputError` for an unknown name, with the nearest ones.
    """
    kind, _, own = name.rpartition("/")
    kinds = [kind] if kind else list(KINDS)
    found = next((each for each in kinds if own in listed(each)), None)
    if found is None:
        known = [other for each in kinds for other in listed(each)]
        near = ", ".join(get_close_matches(own, known, n=3)) or "what `discsim list` gives"
        raise InputError(f"nothing is called '{name}'; expected {near}")
    return _one(found, own)


def namesakes(name: str) -> list[str]:
    """Return what else is shipped by a name, each with its kind before it."""
    kind, _, own = name.rpartition("/")
    return [] if kind else [f"{each}/{own}" for each in KINDS if own in listed(each)][1:]


def _one(kind: str, name: str) -> str:
    if kind == "effects":
        return _effect(CATALOGUE[name])
    return f"# {kind}/{name}\n{_text(KINDS[kind], name)}"


def _effect(row: Row) -> str:
    lines = [f"# effects/{row.id}", row.title]
    lines += [f"  {label}: {text}" for label, text in (("grows with", row.grows_with), ("seen as", row.trace)) if text]
    lines.append(f"  acts on: {row.acts_on}, in {', '.join(row.plants)}")
    for name in row.parameters:
        lines.append(f"  parameter: {name}" + (f", {row.units[name]}" if name in row.units else ""))
    lines += [f"  setting: {name}" for name in row.settings]
    if row.example and not row.settings:
        lines.append(f"  example: --effect {row.id}:{row.example}")
    return "\n".join(lines) + "\n"


def _text(folder: str, name: str) -> str:
    return read_text(model_file(f"{folder}/{name}.toml"))


def _first_line(text: str) -> str:
    """Return the first sentence of the comment that a file begins with, or as much of it as a line holds."""
    comment = itertools.takewhile(lambda line: line.startswith("#"), text.splitlines())
    sentence = re.split(r"(?<=\w\w\.) (?=[A-Z])", " ".join(line.lstrip("# ") for line in comment))[0]
    return textwrap.shorten(sentence.removesuffix("."), 100, placeholder=" ...")
