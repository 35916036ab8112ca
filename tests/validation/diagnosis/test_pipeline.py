"""The way of recordings through a diagnosis can be read aloud, and nothing on it is changed once it is made."""

from __future__ import annotations

import ast
import inspect
from dataclasses import FrozenInstanceError, fields

import pytest
from support.made import tables

from discsim.effects.catalogue import effect
from discsim.validation.diagnosis import pipeline, stages
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.setup import SetupFault, SetupFindings
from discsim.written import corrected


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


@pytest.mark.parametrize(
    "error",
    [
        # of few losses an offset takes away the most, and what is left of them is named beside it, as is a lag
        effect("mag.dropped_samples", fraction=0.01),
        effect("mag.dropped_samples", fraction=0.02),
        effect("mag.time_offset", offset_s=0.03),
    ],
    ids=["few losses", "losses", "an offset"],
)
def test_times_that_relations_take_to_be_off_are_so_only_where_they_explain_more_than_losses(monkeypatch, error):
    made, fault = tables(errors=[error]), effect("mag.time_offset", offset_s=0.03)
    taken = SetupFindings((SetupFault(fault, 60.0, None),), tuple(corrected(one, [fault]) for one in made))
    monkeypatch.setattr(pipeline, "find_setup_faults", lambda _: taken)
    diagnosis = pipeline.diagnose([made], ["tables"]).diagnosis
    assert diagnosis.verdict == "explained"
    assert [named.id for named in diagnosis.effects] == [error.id]
