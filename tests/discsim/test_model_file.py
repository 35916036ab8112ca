"""model.toml: what is written is read back, and what does not belong there is refused by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.disc import Rig
from discsim.effects import effect
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.law import Law
from discsim.model_file import Model, ModelEffect, read_model, write_model
from discsim.shipped import load_disc


@pytest.fixture
def model() -> Model:
    disc, environment = load_disc("dd2")
    return Model(
        environment,
        disc,
        effects=(
            ModelEffect(effect("air.wind", w_north_m_s=1.1, w_east_m_s=-0.7), {"w_north_m_s": 0.02}),
            ModelEffect(effect("event.impulse", t_s=1.4, dv_east_m_s=-0.6), recordings=("02",)),
        ),
    )


def test_a_model_survives_a_round_trip_to_the_last_bit(model, tmp_path):
    write_model(model, tmp_path / "model.toml")
    again = read_model(tmp_path / "model.toml")
    assert again.effects == model.effects
    assert again.disc is not None
    assert model.disc is not None
    assert again.disc.aero == model.disc.aero
    np.testing.assert_array_equal(again.disc.aero_table.CL, model.disc.aero_table.CL)
    np.testing.assert_array_equal(again.environment.magnetic_field, model.environment.magnetic_field)


def test_a_rig_is_a_model_too(tmp_path):
    rig = Rig(1.1e-3, 3e-5, {"viscous_N_m_s": 3e-6})
    write_model(Model(Environment(air_density=None), rig=rig), tmp_path / "model.toml")
    again = read_model(tmp_path / "model.toml")
    assert again.disc is None
    assert again.rig == rig


def test_a_law_is_carried_with_its_coefficients_and_their_deviations(model, tmp_path):
    law = Law("-c * |r|^n * sign(r)", "moment_z_N_m", {"c": 3.1e-6, "n": 1.503}, {"c": 4e-8})
    write_model(replace(model, laws=(law,)), tmp_path / "model.toml")
    assert read_model(tmp_path / "model.toml").laws == (law,)
    write_model(model, tmp_path / "model.toml")
    assert read_model(tmp_path / "model.toml").laws == ()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("|r|^n", "|s|^n", r"model.toml:\d+: law .*found 's' where .* belongs"),
        ("moment_z_N_m", "moment_z", "target is 'moment_z', expected one of force_x_N"),
        ("\nn = ", "\nm = ", "unknown 'n' \\(known are c, m"),
        ("[law.sigma]\nc", "[law.sigma]\nb", "sigma of 'b', which is no coefficient"),
        ("text = ", "txt = ", "did you mean 'text'"),
    ],
)
def test_a_law_that_cannot_be_read_is_refused_at_its_line(model, tmp_path, old, new, expected):
    law = Law("-c * |r|^n * sign(r)", "moment_z_N_m", {"c": 3.1e-6, "n": 1.503}, {"c": 4e-8})
    path = tmp_path / "model.toml"
    write_model(replace(model, laws=(law,)), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=expected):
        read_model(path)


FAULTS = (
    ModelEffect(effect("mag.axes", axes="x -y z")),
    ModelEffect(effect("gps.axes", axes="east north up"), recordings=("02",)),
    ModelEffect(effect("gyro.units", written_in="deg/s")),
    ModelEffect(effect("board.rotation", rx_rad=0.1, rz_rad=-2.0), {"rx_rad": 0.01}),
)


def test_a_fault_of_the_setup_is_carried_with_its_setting(model, tmp_path):
    write_model(replace(model, effects=(*model.effects, *FAULTS)), tmp_path / "model.toml")
    assert read_model(tmp_path / "model.toml").effects == (*model.effects, *FAULTS)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (
            'axes = "x -y z"',
            'axes = "x x z"',
            r"model.toml:\d+: mag\.axes: axes is 'x x z', expected x, y and z once each",
        ),
        ('axes = "x -y z"', "axes = 3", r"model.toml:\d+: .*axes"),
        ('axes = "x -y z"', 'written_in = "G"', "missing key 'axes'"),
        ('written_in = "deg/s"', 'written_in = "deg"', "'deg', expected one of rad/s, deg/s, rpm"),
        ("[effects.setting]", "[effects.settings]", "setting"),
    ],
)
def test_a_setting_that_cannot_be_is_refused_at_its_line(model, tmp_path, old, new, expected):
    path = tmp_path / "model.toml"
    write_model(replace(model, effects=FAULTS), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=expected):
        read_model(path)


def test_an_effect_of_one_recording_is_not_in_the_others(model):
    assert [item.id for item in model.effects_in("02")] == ["air.wind", "event.impulse"]
    assert [item.id for item in model.effects_in("01")] == ["air.wind"]
    assert [item.id for item in model.effects_in()] == ["air.wind"]


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('id = "air.wind"', 'id = "air.wnd"', "did you mean 'air.wind'"),
        ("w_north_m_s = 1.1", "w_nort_m_s = 1.1", "unknown key 'effects.parameters.w_nort_m_s'"),
        ("w_north_m_s = 0.02", "w_north_m_s = -0.02", "at least 0"),
        ('recordings = "all"', "recordings = 3", "list of names"),
        ("discsim-model/1", "discsim-model/9", "discsim-model/1"),
        ("mass_kg", "mass_g", "missing key 'mass_kg'"),
        ("[disc.aero]", "[disc.air]", "aero"),
    ],
)
def test_what_does_not_belong_is_refused_by_name(model, tmp_path, old, new, expected):
    path = tmp_path / "model.toml"
    write_model(model, path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=expected) as refusal:
        read_model(path)
    assert str(path) in str(refusal.value)
