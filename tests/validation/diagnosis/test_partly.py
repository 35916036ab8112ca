"""What explains a mismatch in part: a camera over plans of throws, with its share on each throw set aside."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, flight, release_of

from discsim.effects import Effect, effect
from discsim.recording import Recording
from discsim.sensors import Instruments, Noise, Sampling, Tracker, record
from discsim.validation.diagnosis.answer.named import ParameterValue
from discsim.validation.diagnosis.answer.partly import PartlyExplained
from discsim.validation.diagnosis.partly import partly_explained
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.stepwise import search

CAMERA = effect("track.camera", height_m=30.0, north_m=10.0, east_m=-8.0)
SPREAD = {"position_ned_m": 1.0, "velocity_ned_m_s": 0.1, "roll_rad": 0.01, "pitch_rad": 0.01, "body_rate_rad_s": 0.2}


def plans(*hidden: Effect) -> list[Recording]:
    """Two throws that a camera has seen in plan alone, their release stated within its uncertainty."""
    made = []
    for k, (heading, spin) in enumerate(((0.4, 70.0), (-0.9, 62.0))):
        module = Instruments({"track": Tracker(Sampling(30.0), Noise(0.02))}).with_effects([CAMERA])
        motion = flight(hidden, heading=heading, spin=spin, seconds=2.5)
        one = record(motion, module, np.random.default_rng(k), plant="flight", name=f"throw-{k}", disc=DRIVER)
        track = one.need("track")
        plan = np.column_stack((track.value[:, :2], np.full(len(track), np.nan)))
        release = replace(release_of(heading, spin), yaw=None, sigma=SPREAD)
        made.append(replace(one, release=release, samples={"track": replace(track, value=plan)}))
    return made


def test_a_camera_over_plans_of_throws_is_asked_and_takes_most_away_on_each():
    found = screened(SearchProblem(plans()))
    assert [hint.candidate.id for hint in found.hints] == ["track.camera"]
    (part,) = partly_explained(found, ["throw-0", "throw-1"])
    assert part.id == "track.camera"
    assert set(part.parameters) == {"height_m", "north_m", "east_m"}
    assert all(after < 0.5 * before for before, after in part.heldout.values())
    assert partly_explained(replace(found, hints=()), ["throw-0", "throw-1"]) == ()


def test_it_is_named_where_it_explains_all_that_the_paths_show():
    found = diagnose([plans()], ["plans"]).diagnosis
    assert found.verdict == "explained"
    assert [one.id for one in found.effects] == ["track.camera"]
    for name, size in CAMERA.sizes.items():
        told = found.effects[0].parameters[name]
        assert abs(told.value - size) < 4.0 * told.sd


def test_it_is_told_with_what_it_leaves_and_is_plain_json():
    part = PartlyExplained(
        "track.camera", {"height_m": ParameterValue(90.0, 8.0), "east_m": ParameterValue(1.0, None)}, {"a": (4.0, 1.0)}
    )
    assert "leaves 0.50 of the rms in a" in part.text
    told = json.loads(json.dumps(part.to_json()))
    assert told["heldout"][0]["share_of_excess"] == pytest.approx(0.75)
    assert told["parameters"]["east_m"]["sd"] is None


def test_one_plan_alone_bears_out_no_more_than_one_effect():
    """Of a real throw from the air, one of three, a camera and a wind of 12 m/s that grows with height took up all."""
    sheared = effect("air.wind_shear", w_north_m_s=6.0, w_east_m_s=-4.0, exponent=0.3)
    assert len(search(SearchProblem(plans(sheared)[:1])).final.hypothesis.candidates) <= 1
