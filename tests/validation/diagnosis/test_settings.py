"""Every limit of a diagnosis stands with where it comes from."""

from __future__ import annotations

import ast
import re
from dataclasses import fields
from pathlib import Path

import pytest

from discsim.validation.diagnosis import settings
from discsim.validation.diagnosis.settings import settings_told
from discsim.validation.identification.residual_tests import RESIDUAL_TESTS

ROOT = Path(__file__).parents[3] / "validation"
STAGES = [
    settings.CONSISTENCY,
    settings.RELAXED_FIT,
    settings.SELECTION,
    settings.DETECTORS,
    settings.UNKNOWN_LAW,
    RESIDUAL_TESTS,
]
SOURCES = [path for room in ("diagnosis", "identification") for path in (ROOT / room).rglob("*.py")]


@pytest.mark.parametrize("stage", STAGES, ids=lambda stage: type(stage).__name__)
def test_each_limit_of_a_stage_has_a_sentence(stage):
    told = type(stage).__doc__ or ""
    names = re.findall(r"^    ([a-z_, ]+) : (?:float|int)$", told, re.M)
    assert [name for line in names for name in line.split(", ")] == [field.name for field in fields(stage)]


def test_a_report_shows_the_limits_of_every_stage():
    told = settings_told()
    assert len(told) == len(STAGES)
    shown = " ".join(told.values())
    for stage in STAGES:
        for field in fields(stage):
            assert f"{field.name} {getattr(stage, field.name):g}" in shown


def numbers_without_a_reason(source: str) -> list[str]:
    """Names of the numbers that stand at the top of a module without a comment on the block of lines they are in."""
    lines, found = source.splitlines(), []
    for node in ast.parse(source).body:
        if not isinstance(node, ast.Assign) or node.value is None:
            continue
        parts = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value]
        if not any(isinstance(part, ast.Constant) and type(part.value) in (int, float) for part in parts):
            continue
        above = node.lineno - 2
        while above >= 0 and lines[above] and not lines[above].startswith("#:"):
            above -= 1
        if not lines[above].startswith("#:"):
            found.append(ast.unparse(node.targets[0]))
    return found


def test_a_number_beside_its_one_use_has_a_comment():
    assert numbers_without_a_reason("#: of their own\nA = 1.0\nB = 2.0\n\nC = 'text'\nD, E = 3, 4.0\n") == ["(D, E)"]
    found = {path.relative_to(ROOT): numbers_without_a_reason(path.read_text(encoding="utf-8")) for path in SOURCES}
    assert {path: names for path, names in found.items() if names} == {}
