"""A user's own effect on a sensor, hidden in MuJoCo's data, is named with its size; where it is absent it is not."""

from __future__ import annotations

import re
import shlex
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.places import ROOT

from discsim.disc import Rig
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.own import UserEffect, load_user_effect
from discsim.engine import fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.frames import turn
from discsim.law import Law
from discsim.model_file import read_model, write_model
from discsim.recording import Recording, Samples
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.cli import main
from discsim.validation.diagnosis.candidates.candidate import available, candidates_for, parameters_of
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.result import Diagnosis
from discsim.validation.identification.competing_effects import Competing
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import trajectory_of
from discsim.validation.identification.sensor_model import is_motion, predicted

FIELD, RIG = Environment(air_density=None), Rig(1e-3, 8e-5)
MODULE = Instruments.from_parts("mpu9250")
PAGE = ROOT / "docs" / "your-own-effect.md"
#: a law of no size, which stands behind a user's own numbers
LAW = {("law", "0.target"): 5.0, ("law", "0.coefficient"): 0.0}

SUPPLY = '''from typing import NamedTuple

import numpy as np


class Supply(NamedTuple):
    """A supply current that grows with the square of the spin shows in x."""

    k_uT_s2: float = 0.0


ID, ACTS_ON, SCALE = "my.supply", "magnetometer", (1e-4,)


def apply(effect, readings, t, motion):
    return readings + effect.k_uT_s2 * motion.rate[:, 2:] ** 2 * np.array([1.0, 0.0, 0.0])
'''
#: warms from the moment it is switched on; tau_s shapes it and is no lag
WARMTH = '''from typing import NamedTuple

import numpy as np


class Warmth(NamedTuple):
    """The module warms, b = a (1 - exp(-t/tau)) in y."""

    a_uT: float = 0.0
    tau_s: float = 2.0


ID, ACTS_ON, SCALE = "my.warmth", "magnetometer", (0.2, 0.2)


def apply(effect, readings, t, motion):
    grown = effect.a_uT * -np.expm1(-t / effect.tau_s)
    return readings + grown[:, None] * np.array([0.0, 1.0, 0.0])
'''
#: a brake that no effect of the catalogue is
BRAKE = '''from typing import NamedTuple


class Brake(NamedTuple):
    """A fan on the axis, M = -k r^3."""

    k_N_m_s3: float = 0.0


ID, ACTS_ON, SCALE, PLANTS = "my.brake", "motion", (1e-10,), ("flight", "spin_down")


def apply(effect, t, h, u, v, w, P, Q, r):
    return 0.0, 0.0, 0.0, 0.0, 0.0, -effect.k_N_m_s3 * r**3
'''
#: a ribbon at the centre, and a brake about the axis: every number of a wrench counts, and so does each parameter
BOTH = '''from typing import NamedTuple


class Both(NamedTuple):
    """Drag and brake."""

    k: float = 0.0
    c: float = 1.0


ID, ACTS_ON, SCALE = "my.both", "motion", (1e-4, 1e-4)


def apply(effect, t, h, u, v, w, P, Q, r):
    k, c = effect.k, effect.c - 1.0
    return -k * u, -k * v, -k * w + 1e-3 * c * h, c * P, c * Q, -c * r
'''


def loaded(folder: Path, text: str) -> UserEffect:
    path = folder / "mine.py"
    path.write_text(text, encoding="utf-8")
    return load_user_effect(path)


@cache
def run_down(rate: float, supply: float = 0.0, warmth: float = 0.0) -> Recording:
    """A rig that runs down for eight seconds, with a supply's field (uT s^2) in x and a warming (uT) in y."""
    motion = spin_down(RIG, FIELD, rate, 8.0)
    rng = np.random.default_rng(int(rate))
    whole = record(motion, MODULE, rng, plant="spin_down", name=f"from {rate:g} rad/s", rig=RIG)
    read = whole.samples["magnetometer"]
    r = np.interp(read.t, motion.t, motion.rate[:, 2])
    added = np.stack([supply * r**2, warmth * -np.expm1(-read.t / 3.0), np.zeros_like(r)], axis=1)
    return replace(whole, samples={**whole.samples, "magnetometer": Samples(read.t, read.value + added)})


def answer(effect: UserEffect, supply: float = 0.0, warmth: float = 0.0) -> Diagnosis:
    recordings = [run_down(rate, supply, warmth) for rate in (60.0, 40.0)]
    return diagnose([recordings], ["rig"], user_effects=[effect]).diagnosis


@pytest.mark.parametrize(
    ("text", "hidden", "sizes"),
    [
        (SUPPLY, {"supply": 1e-3}, {"k_uT_s2": 1e-3}),
        (WARMTH, {"warmth": 3.0}, {"a_uT": 3.0, "tau_s": 3.0}),
    ],
)
def test_a_hidden_effect_of_the_users_own_is_named_with_its_size(tmp_path, text, hidden, sizes):
    effect = loaded(tmp_path, text)
    found = answer(effect, **hidden)
    assert found.verdict == "explained"
    (named,) = found.effects
    assert named.id == effect.id
    assert named.recordings is None
    assert set(named.parameters) == set(sizes)
    for name, size in sizes.items():
        item = named.parameters[name]
        assert item.sd is not None
        assert item.sd < 0.2 * size
        assert item.value == pytest.approx(size, abs=3.0 * item.sd)
    assert found.located[0].sensor == "magnetometer"
    assert effect.text in found.located[0].text


def test_an_effect_that_is_not_there_is_not_named(tmp_path):
    found = answer(loaded(tmp_path, SUPPLY))
    assert found.verdict == "consistent"
    assert found.effects == ()


def test_an_effect_competes_beside_the_catalogue_s(tmp_path):
    effect = loaded(tmp_path, SUPPLY)
    recordings, effects = [run_down(60.0)], Competing((effect,))
    assert effects.row("my.supply") is effect.row
    assert [effects.row(id) is not None for id in ("mag.lag", "law")] == [True, False]
    assert [row.id for row in effects.rows] == [*CATALOGUE, "my.supply"]
    assert not is_motion("my.supply", effects)
    assert effect.row in available(recordings, effects)
    assert effect.row not in available(recordings)
    (candidate,) = (candidate for candidate in candidates_for(recordings, effects) if candidate.id == "my.supply")
    assert [(q.name, q.stated) for q in parameters_of(candidate)] == [("k_uT_s2", 0.0)]


def test_an_effect_acts_on_every_neighbour_of_a_motion_by_its_own_state(tmp_path):
    """What a batch of motions reads is what each reads alone, and a field in N is turned into B as the sensor's is."""
    text = SUPPLY.replace("motion.rate[:, 2:] ** 2 * np.array([1.0, 0.0, 0.0])", "motion.in_body([20.0, 1.0, 45.0])")
    effect = loaded(tmp_path, text.replace(" * motion.in_body", " * t[:, None] * motion.in_body"))
    rng = np.random.default_rng(3)
    t, motions = np.array([0.5, 2.0, 4.0]), rng.normal(size=(2, 3, 19))
    motions[..., 9:13] = turn(rng.normal(size=(2, 3, 3)))
    base = run_down(60.0)
    recording = replace(base, environment=replace(base.environment, magnetic_field=np.array([20.0, 1.0, 45.0])))
    bare = predicted("magnetometer", recording, {}, t, motions)
    effects, values = Competing((effect,)), {("my.supply", "k_uT_s2"): 0.1}
    read = predicted("magnetometer", recording, values, t, motions, effects)
    alone = predicted("magnetometer", recording, values, t, motions[1], effects)
    assert predicted("gyroscope", recording, {}, t, motions[1], effects).shape == (3, 3)
    np.testing.assert_allclose(read, bare * (1.0 + 0.1 * t[:, None]), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(read[1], alone)


def test_the_column_of_an_effects_shape_is_that_of_its_form_whatever_its_name(tmp_path):
    effect = loaded(tmp_path, WARMTH)
    current = replace(first_trajectory(run_down(60.0)), effects=Competing((effect,)))
    values = {("my.warmth", "a_uT"): 3.0, ("my.warmth", "tau_s"): 4.0}
    columns = [Column("my.warmth", name, 1e-3) for name in ("a_uT", "tau_s")]
    linear = linearise(current, values, columns, np.ones(current.plant.layout.directions, dtype=np.bool_))
    for channel in linear.channels:
        t, warms = linear.t[channel.rows], (channel.sensor, channel.axis) == ("magnetometer", "y_uT")
        expected = np.stack([-np.expm1(-t / 4.0), -3.0 * t / 16.0 * np.exp(-t / 4.0)], axis=1)
        # central differences of 1e-3 s err by 1e-8 of the slope
        np.testing.assert_allclose(linear.common[channel.rows], expected if warms else 0.0 * expected, atol=1e-6)


def braked(effect: UserEffect, rate: float, k: float) -> Recording:
    """A rig that runs down in MuJoCo with a brake on its axis."""
    motion = spin_down(RIG, FIELD, rate, 8.0, [effect.sized({"k_N_m_s3": k})])
    rng = np.random.default_rng(int(rate))
    return record(motion, MODULE, rng, plant="spin_down", name=f"braked from {rate:g} rad/s", rig=RIG)


@pytest.mark.slow
def test_a_brake_of_the_users_own_is_named_where_it_acts_and_not_where_it_does_not(tmp_path):
    effect = loaded(tmp_path, BRAKE)
    outcome = diagnose([[braked(effect, rate, 2e-9) for rate in (60.0, 40.0)]], ["rig"], user_effects=[effect])
    (named,) = outcome.diagnosis.effects
    assert (named.id, named.recordings) == ("my.brake", None)
    item = named.parameters["k_N_m_s3"]
    assert item.sd is not None
    assert item.sd < 0.02 * 2e-9
    assert item.value == pytest.approx(2e-9, abs=3.0 * item.sd)
    assert effect.text in outcome.diagnosis.located[0].text
    # and the model carries it
    path = tmp_path / "model.toml"
    write_model(outcome.model, path)
    (carried,) = read_model(path, [effect]).effects
    assert carried.effect == effect.sized({"k_N_m_s3": item.value})
    with pytest.raises(
        InputError, match=r"effect 'my\.brake' is the user's own; expected its file with it: --with mine"
    ):
        read_model(path)
    still = diagnose([[run_down(rate) for rate in (60.0, 40.0)]], ["rig"], user_effects=[effect]).diagnosis
    assert still.verdict == "consistent"


def test_the_brake_of_a_rig_follows_its_closed_form(tmp_path):
    """rdot = -k r^3 / Izz alone gives r^-2 = r0^-2 + 2 k t / Izz."""
    effect, rig, k = loaded(tmp_path, BRAKE), Rig(1e-3, 0.0), 2e-8
    for acting in ({"effects": [effect.sized({"k_N_m_s3": k})]}, {"law": Law("-k * r^3", "moment_z_N_m", {"k": k})}):
        motion = spin_down(rig, FIELD, 60.0, 5.0, **acting)
        expected = (60.0**-2 + 2.0 * k * motion.t / rig.Izz) ** -0.5
        np.testing.assert_allclose(motion.rate[:, 2], expected, rtol=1e-9)


def test_both_engines_and_the_pieces_of_a_fit_fly_one_wrench(tmp_path):
    effect = loaded(tmp_path, BOTH)
    acting = effect.sized({"k": 2e-3, "c": 1.0 + 2e-5})
    disc, field = load_disc("driver")
    release = replace(load_throw("driver"), body_rate=np.array([0.5, -0.3, 30.0]))  # below the gyroscope's range
    truth = fly(disc, field, release, [acting], duration=1.0)
    other = predict(disc, field, release, [acting], duration=1.0)
    end = other.at(truth.end)
    # the engines agree to 1e-6 m and 1e-5 rad/s over a second of this throw without it
    np.testing.assert_allclose(end.position[0], truth.position[-1], atol=1e-5)
    np.testing.assert_allclose(end.rate[0], truth.rate[-1], atol=1e-4)
    bare = predict(disc, field, release, duration=1.0).at(truth.end)
    assert np.linalg.norm(end.position - bare.position) > 0.01
    assert abs(end.rate[0, 2] - bare.rate[0, 2]) > 0.1

    recording = record(truth, MODULE, np.random.default_rng(1), plant="flight", name="throw", disc=disc)
    state = np.concatenate([*(getattr(truth, name)[0] for name in ("position", "velocity", "attitude", "rate"))])
    whole = trajectory_of(recording, np.array([0.0, 1.0]), state[None], Competing((effect,)))
    values = {("my.both", "k"): 2e-3, ("my.both", "c"): 1.0 + 2e-5, **LAW}
    t = np.array([1.0])
    np.testing.assert_allclose(shown(whole, values, "gyroscope", t), truth.rate[-1:], atol=1e-3)
    linear = linearise(whole, values, [Column("my.both", "c", 1e-7)], np.ones(12, dtype=np.bool_))
    # more brake, less spin: dr/dc = -int r dt / Izz, but for what the air makes of it
    rows = next(channel.rows for channel in linear.channels if channel.axis == "z_rad_s")
    spin = np.trapezoid(truth.rate[:, 2], truth.t) / disc.Izz
    assert linear.common[rows, 0][-1] == pytest.approx(-spin, rel=0.05)


@pytest.mark.parametrize("name", ["nonlinear", pytest.param("ribbon", marks=pytest.mark.slow)])
def test_the_worked_examples_of_the_documents_find_what_they_hide(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```(python|sh)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    code = next(text for kind, text in blocks if kind == "python" and f"class {name.capitalize()}" in text)
    Path(f"{name}.py").write_text(code, encoding="utf-8")
    commands = next(text for kind, text in blocks if kind == "sh" and f"--effect my.{name}" in text).splitlines()
    for line in commands:
        monkeypatch.setattr(sys, "argv", shlex.split(line))
        with pytest.raises(SystemExit) as stop:
            main()
        assert not stop.value.code
    said = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("explained"))
    hidden = float(re.search(r"=([\d.e-]+) ", commands[0])[1])
    value, sd = (float(number) for number in re.search(rf"my\.{name}\w* \(([\d.]+) ± ([\d.]+) ", said).groups())
    assert value == pytest.approx(hidden, abs=3.0 * sd)
    assert sd < 0.05 * hidden
