"""Same input, same output: parameters and results are frozen, so that nobody changes them under somebody else."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("discsim", "estimators", "validation")
#: classes that change, and why
CHANGING = {
    "validation/reporting/run.py:Run": "a run that goes on: its steps and its files",
    "validation/reporting/written.py:Written": "what a run has written so far",
}


def changing(source: str) -> list[str]:
    """Return the names of the dataclasses of a source that are not frozen."""
    found = []
    for node in ast.walk(ast.parse(source)):
        for decorator in node.decorator_list if isinstance(node, ast.ClassDef) else ():
            name = decorator.func if isinstance(decorator, ast.Call) else decorator
            if ast.unparse(name).rpartition(".")[2] != "dataclass":
                continue
            told = {word.arg: word.value for word in getattr(decorator, "keywords", ())}
            if not getattr(told.get("frozen"), "value", False):
                found.append(node.name)
    return found


def test_every_dataclass_is_frozen_but_for_those_that_are_named():
    found = set()
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            if not any(part.is_symlink() for part in path.parents):
                where = path.relative_to(ROOT).as_posix()
                found |= {f"{where}:{name}" for name in changing(path.read_text(encoding="utf-8"))}
    assert found == set(CHANGING)


@pytest.mark.parametrize(
    ("decorator", "said"),
    [
        ("@dataclass", ["A"]),
        ("@dataclass()", ["A"]),
        ("@dataclass(frozen=False)", ["A"]),
        ("@dataclasses.dataclass(eq=False)", ["A"]),
        ("@dataclass(frozen=True)", []),
        ("@other", []),
    ],
)
def test_one_that_is_not_is_noticed(decorator, said):
    assert changing(f"{decorator}\nclass A:\n    a: int\n") == said
