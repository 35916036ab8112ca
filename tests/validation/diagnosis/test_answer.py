"""diagnosis.json: the keys of its contract, plain numbers throughout, and no answer that contradicts itself."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.validation.diagnosis.result import (
    Confusion,
    Diagnosis,
    Evidence,
    FitFigures,
    Law,
    Located,
    NamedEffect,
    NoiseNote,
    ParameterValue,
    Recalibration,
    Residuals,
)

STRONG = Evidence(5120.0, 640.2, 0.0)
WIND = NamedEffect(
    "air.wind",
    {"w_north_m_s": ParameterValue(1.09, 0.02), "w_east_m_s": ParameterValue(-0.71, float("nan"))},
    STRONG,
    confused_with=(Confusion("gps.latency", 4801.0),),
)
LAW = Law("a |r|^1.5 sign(r)", "moment_z_N_m", {"a": ParameterValue(1e-6, None)}, 55.0)


@pytest.fixture
def explained() -> Diagnosis:
    return Diagnosis(
        ("open-field",),
        "flight",
        0,
        "explained",
        FitFigures(2.96, 3.02),
        FitFigures(1.00, None),
        located=(Located("all", "gps", "v_north_m_s", 0.0, 7.0, 0.61, "velocity drifts", "time aloft"),),
        effects=(WIND,),
        recalibrated={"CL0": Recalibration(0.13, 0.0026, 0.1327, 0.0004)},
        noise=(NoiseNote("gps.position", 0.15, 0.15, 1.5),),
    )


def test_an_effect_with_a_setting_carries_it_and_so_do_its_twins(explained):
    value = {"rz_rad": ParameterValue(1.57, None)}
    twin = Confusion("gyro.axes", 90.0, "Turn it by hand.", setting={"axes": "x y -z"})
    turned = Confusion("board.rotation", 80.0, parameters=value)
    flipped = NamedEffect("mag.axes", {}, STRONG, confused_with=(twin, turned), setting={"axes": " +x  -y z"})
    entry = replace(explained, effects=(flipped,)).to_json()["effects"][0]
    assert (entry["parameters"], entry["setting"]) == ({}, {"axes": "x -y z"})
    assert [other.get("setting") for other in entry["confused_with"]] == [{"axes": "x y -z"}, None]
    assert entry["confused_with"][1]["parameters"] == {"rz_rad": {"value": 1.57, "sd": None}}
    assert "setting" not in explained.to_json()["effects"][0]


def test_an_effect_with_neither_size_nor_setting_is_refused():
    with pytest.raises(ValueError, match="no parameters; expected at least one, or a setting"):
        NamedEffect("mag.axes", {}, STRONG)
    with pytest.raises(InputError, match="expected x, y and z once each"):
        NamedEffect("mag.axes", {}, STRONG, setting={"axes": "x y"})


def test_the_json_has_the_contracts_keys_and_values(explained):
    content = explained.to_json()
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert content["format"] == "discsim-diagnosis/1"
    assert content["dataset"] == "open-field"
    assert content["located"] == [
        {
            "recording": "all",
            "sensor": "gps",
            "axis": "v_north_m_s",
            "from_s": 0.0,
            "to_s": 7.0,
            "share_of_excess": 0.61,
            "grows_with": "time aloft",
            "text": "velocity drifts",
        }
    ]
    (effect,) = content["effects"]
    assert effect["id"] == "air.wind"
    assert effect["recordings"] == "all"
    assert effect["evidence"] == {"delta_bic": 5120.0, "heldout_delta_log_likelihood": 640.2, "p_value": 1e-300}
    assert effect["confused_with"][0]["id"] == "gps.latency"
    assert content["recalibrated"] == {"CL0": {"stated": 0.13, "stated_sd": 0.0026, "value": 0.1327, "sd": 0.0004}}
    assert content["law"] is None
    assert content["noise"] == [
        {"sensor": "gps.position", "stated_rms": 0.15, "observed_rms": 0.15, "correlation_s": 1.5}
    ]
    assert content["fit"]["baseline"] == {"chi2_per_sample": 2.96, "heldout_chi2_per_sample": 3.02}


def test_a_parameter_that_the_data_cannot_determine_has_no_sd(explained):
    parameters = explained.to_json()["effects"][0]["parameters"]
    assert parameters == {
        "w_north_m_s": {"value": 1.09, "sd": 0.02},
        "w_east_m_s": {"value": -0.71, "sd": None},
    }


def test_numbers_of_numpy_become_plain_ones(explained):
    content = replace(explained, baseline=FitFigures(np.float64(2.5), np.float32(2.0)), seed=np.int64(3)).to_json()
    assert type(content["fit"]["baseline"]["heldout_chi2_per_sample"]) is float
    assert type(content["seed"]) is int
    json.dumps(content, allow_nan=False)


def test_several_data_sets_are_a_list(explained):
    assert replace(explained, datasets=("a", "b")).to_json()["dataset"] == ["a", "b"]


def test_effects_stand_in_the_order_of_their_evidence(explained):
    weaker = NamedEffect("mag.hard_iron", {"bx_uT": ParameterValue(1.0, 0.1)}, Evidence(50.0, 20.0, 1e-9), ("02",))
    both = replace(explained, effects=(weaker, WIND))
    assert [effect["id"] for effect in both.to_json()["effects"]] == ["air.wind", "mag.hard_iron"]
    assert both.to_json()["effects"][1]["recordings"] == ["02"]


def test_an_unexplained_rest_names_no_effect_and_only_it_has_a_law(explained):
    with pytest.raises(ValueError, match="1 effects with the verdict unexplained"):
        replace(explained, verdict="unexplained")
    assert replace(explained, verdict="unexplained", effects=(), law=LAW).to_json()["law"]["coefficients"] == {
        "a": {"value": 1e-6, "sd": None}
    }
    with pytest.raises(ValueError, match="a law with the verdict explained"):
        replace(explained, law=LAW)


def test_a_law_is_one_that_a_model_file_can_carry():
    carried = LAW.for_model()
    assert float(carried.evaluate({"r": -4.0})) == pytest.approx(-8e-6, rel=1e-13)
    assert dict(carried.sigma) == {}
    with pytest.raises(InputError, match="unknown 'b'"):
        Law("b r", "moment_z_N_m", {"a": ParameterValue(1e-6, 1e-8)})


def test_explained_without_an_effect_is_refused(explained):
    with pytest.raises(ValueError, match="0 effects"):
        replace(explained, effects=())


@pytest.mark.parametrize(("value", "verdict"), [(0.1379, "recalibrated"), (0.1377, "consistent")])
def test_three_stated_sigmas_part_recalibrated_from_consistent(explained, value, verdict):
    moved = {"CL0": Recalibration(0.13, 0.0026, value, 0.0004)}
    assert replace(explained, verdict=verdict, effects=(), recalibrated=moved).verdict == verdict
    other = {"recalibrated": "consistent", "consistent": "recalibrated"}[verdict]
    with pytest.raises(ValueError, match=f"verdict {other}"):
        replace(explained, verdict=other, effects=(), recalibrated=moved)


def test_an_effect_appears_twice_only_in_disjoint_recordings_and_events_as_often_as_they_happen(explained):
    iron = {"bx_uT": ParameterValue(1.0, 0.1)}
    first, second = (NamedEffect("mag.hard_iron", iron, STRONG, names) for names in (("01",), ("02", "03")))
    assert len(replace(explained, effects=(first, second)).effects) == 2
    with pytest.raises(ValueError, match="twice"):
        replace(explained, effects=(first, replace(second, recordings=None)))
    touch = NamedEffect("event.impulse", {"t_s": ParameterValue(1.0, 0.001)}, STRONG, ("01",))
    assert len(replace(explained, effects=(touch, touch)).effects) == 2


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: ParameterValue(float("inf"), 0.1),
        lambda: ParameterValue(1.0, -0.1),
        lambda: Evidence(float("nan"), 1.0, 0.5),
        lambda: Evidence(1.0, 1.0, float("nan")),
        lambda: Located("all", "gps", "all", 2.0, 1.0, 0.5, ""),
        lambda: Located("all", "gps", "all", 0.0, 1.0, 1.5, ""),
        lambda: NamedEffect("air.wind", {"w_up_m_s": ParameterValue(1.0, 0.1)}, STRONG),
        lambda: NamedEffect("air.wind", {}, STRONG),
        lambda: Recalibration(0.13, 0.0, 0.13, 0.1),
        lambda: FitFigures(float("nan"), None),
        lambda: NoiseNote("gps.position", 0.1, float("nan")),
        lambda: Residuals("01", "gps", "north_m", np.arange(3.0), np.zeros(3), np.zeros(2)),
    ],
)
def test_what_may_not_be_written_is_refused_where_it_is_made(wrong):
    with pytest.raises(ValueError, match=r"expected|never moves"):
        wrong()


def test_a_place_covers_what_it_names():
    place = Located("02", "gps", "all", 0.0, 1.0, 0.5, "")
    assert place.covers("02", "gps", "north_m")
    assert not place.covers("01", "gps", "north_m")
    assert not place.covers("02", "magnetometer", "x_uT")
