"""The way of recordings through a diagnosis can be read aloud, and nothing on it is changed once it is made."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Sequence
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from support.made import FIELD, RIG, tables

from discsim.effects.catalogue import effect
from discsim.recording import Recording
from discsim.sensors import Instruments, record
from discsim.validation.challenge.cases.hidden_physics import coast, haunted
from discsim.validation.challenge.cases.off_catalogue import MainsField
from discsim.validation.diagnosis import pipeline, stages
from discsim.validation.diagnosis.early_verdict import contradiction_in
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


def test_a_board_is_turned_only_where_that_leaves_no_more_than_noise(monkeypatch):
    made, fault = tables(), effect("board.rotation", rx_rad=np.pi, ry_rad=0.0, rz_rad=0.0)
    taken = SetupFindings((SetupFault(fault, 60.0, None),), tuple(corrected(one, [fault]) for one in made))
    monkeypatch.setattr(pipeline, "find_setup_faults", lambda _: taken)
    diagnosis = pipeline.diagnose([made], ["tables"]).diagnosis
    assert (diagnosis.verdict, diagnosis.effects) == ("consistent", ())


def mains_beside_a_rig(frequencies: Sequence[float]) -> list[Recording]:
    """Return run-downs beside a cable whose field is half of the earth's, at a frequency in each."""
    made = []
    for number, (rate, frequency) in enumerate(zip((75.0, 55.0), frequencies, strict=True)):
        secret = MainsField(25.0, frequency, (0.6, -0.64, 0.48))
        motion = coast(RIG, FIELD, rate, 4.0, secret=secret, yaw=0.3 + number)
        module, rng = haunted(Instruments.from_parts("mpu9250"), secret), np.random.default_rng(number)
        made.append(record(motion, module, rng, plant="spin_down", name=f"run-{number}", rig=RIG))
    return made


def test_a_field_so_strong_that_a_magnetometer_contradicts_all_others_is_a_law() -> None:
    made = mains_beside_a_rig([60.3, 60.3])
    contradiction = contradiction_in(made, ())
    assert contradiction is not None
    assert set(contradiction.against) == {"magnetometer"}
    diagnosis = pipeline.diagnose([made], ["beside a cable"]).diagnosis
    assert diagnosis.verdict == "unexplained"
    assert diagnosis.law is not None
    assert diagnosis.law.target.startswith("magnetometer.")
    w = diagnosis.law.coefficients["w"]
    assert w.value == pytest.approx(2.0 * np.pi * (100.0 - 60.3), abs=4.0 * w.sd)


@pytest.mark.slow
def test_a_sensor_that_follows_no_formula_contradicts_the_others() -> None:
    diagnosis = pipeline.diagnose([mains_beside_a_rig([60.3, 57.1])], ["beside two cables"]).diagnosis
    assert diagnosis.law is None
    assert "contradicts" in diagnosis.located[0].text
