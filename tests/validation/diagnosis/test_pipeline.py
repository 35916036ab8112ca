"""The way of recordings through a diagnosis can be read aloud, and nothing on it is changed once it is made."""

from __future__ import annotations

import ast
import inspect
from dataclasses import FrozenInstanceError, fields

import pytest

from discsim.validation.diagnosis import pipeline, stages
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.setup import SetupFindings


def test_the_whole_way_is_a_few_lines():
    (function,) = ast.parse(inspect.getsource(pipeline.diagnose)).body
    assert isinstance(function, ast.FunctionDef)
    told = function.body[1:]
    assert told[-1].end_lineno - told[0].lineno + 1 <= 15


@pytest.mark.parametrize(
    "stage",
    [SetupFindings, stages.Question, stages.Prepared, stages.Tried, Search, stages.Judged],
    ids=lambda stage: stage.__name__,
)
def test_what_passes_from_stage_to_stage_cannot_be_changed(stage):
    made = object.__new__(stage)
    for field in fields(stage):
        with pytest.raises(FrozenInstanceError):
            setattr(made, field.name, None)
    assert not any(str(field.type).startswith(("list", "dict")) for field in fields(stage))
