"""What is supposed of a setup after an answer is there: it may be tried, and may fail."""

from __future__ import annotations

import pytest
from support.made import throws

from discsim.errors import InputError
from discsim.validation.diagnosis import pipeline
from discsim.validation.diagnosis.setup import SetupFindings
from discsim.validation.diagnosis.stages import Question, Tried
from discsim.validation.diagnosis.suppositions import Supposition


def test_a_supposition_under_which_nothing_is_left_leaves_the_answer_that_is_there(monkeypatch: pytest.MonkeyPatch):
    """The error had ended the diagnosis, with words about data that no user had supplied."""

    def nothing_left(*_: object) -> Tried:
        raise InputError("no readings are left")

    tried = object.__new__(Tried)
    supposed = object.__new__(SetupFindings)
    question = Question(tuple(throws(plant="free_spin", seconds=0.5)), ("a", "b"), ("set",))
    monkeypatch.setattr(pipeline, "tried_under", nothing_left)
    assert pipeline.under_suppositions(tried, question, [Supposition(lambda *_: supposed, lambda *_: True)]) is tried
