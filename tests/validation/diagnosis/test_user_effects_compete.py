"""A user's own effect on a sensor, hidden in MuJoCo's data, is named with its size; where it is absent it is not."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from discsim.disc import Rig
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.own import UserEffect, load_user_effect
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.frames import turn
from discsim.recording import Recording, Samples
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from validation.diagnosis.answer import Diagnosis
from validation.diagnosis.diagnosing import diagnose
from validation.diagnosis.fitting import mapped
from validation.diagnosis.readings import is_motion, predicted, value
from validation.diagnosis.relaxed import first_chain
from validation.diagnosis.rows import competing, row_of, rows
from validation.diagnosis.trajectory_pieces import Column, linearise
from validation.diagnosis.trials import available, parameters_of, trials_for

FIELD, RIG = Environment(air_density=None), Rig(1e-3, 8e-5)
MODULE = Instruments.from_parts("mpu9250")

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
RIBBON = '''from typing import NamedTuple


class Ribbon(NamedTuple):
    """A ribbon at the centre, F = -k V."""

    k_N_s_m: float = 0.0


ID, ACTS_ON, SCALE = "my.ribbon", "motion", (1e-4,)


def apply(effect, t, h, u, v, w, P, Q, r):
    k = effect.k_N_s_m
    return -k * u, -k * v, -k * w, 0.0, 0.0, 0.0
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
    assert any(f"does not carry {effect.id}" in warning for warning in found.warnings)


def test_an_effect_that_is_not_there_is_not_named(tmp_path):
    found = answer(loaded(tmp_path, SUPPLY))
    assert found.verdict == "consistent"
    assert found.effects == ()


def test_an_effect_competes_within_its_call_only(tmp_path):
    effect = loaded(tmp_path, SUPPLY)
    recordings = [run_down(60.0)]
    with competing([effect]):
        assert row_of("my.supply") is effect.row
        assert [row.id for row in rows()] == [*CATALOGUE, "my.supply"]
        assert not is_motion("my.supply")
        assert value({}, "my.supply", "k_uT_s2") == 0.0
        assert "my.supply" in available(recordings)
        (trial,) = (trial for trial in trials_for(recordings) if trial.id == "my.supply")
        assert [(q.name, q.stated) for q in parameters_of(trial)] == [("k_uT_s2", 0.0)]
        # and in the threads that share the work
        assert mapped(lambda id: row_of(id) is not None, ["my.supply", "mag.lag", "law"]) == [True, True, False]
    with pytest.raises(ZeroDivisionError), competing([effect]):
        _ = 1 / 0
    assert row_of("my.supply") is None
    assert "my.supply" not in available(recordings)


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
    with competing([effect]):
        read = predicted("magnetometer", recording, {("my.supply", "k_uT_s2"): 0.1}, t, motions)
        alone = predicted("magnetometer", recording, {("my.supply", "k_uT_s2"): 0.1}, t, motions[1])
        assert predicted("gyroscope", recording, {}, t, motions[1]).shape == (3, 3)
    np.testing.assert_allclose(read, bare * (1.0 + 0.1 * t[:, None]), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(read[1], alone)


def test_the_column_of_an_effects_shape_is_that_of_its_form_whatever_its_name(tmp_path):
    effect = loaded(tmp_path, WARMTH)
    current = first_chain(run_down(60.0))
    values = {("my.warmth", "a_uT"): 3.0, ("my.warmth", "tau_s"): 4.0}
    columns = [Column("my.warmth", name, 1e-3) for name in ("a_uT", "tau_s")]
    with competing([effect]):
        linear = linearise(current, values, columns, np.ones(current.tangent, dtype=np.bool_))
    for channel in linear.channels:
        t, warms = linear.t[channel.rows], (channel.sensor, channel.axis) == ("magnetometer", "y_uT")
        expected = np.stack([-np.expm1(-t / 4.0), -3.0 * t / 16.0 * np.exp(-t / 4.0)], axis=1)
        # central differences of 1e-3 s err by 1e-8 of the slope
        np.testing.assert_allclose(linear.shared[channel.rows], expected if warms else 0.0 * expected, atol=1e-6)


def test_an_effect_on_motion_is_refused_before_anything_is_fitted(tmp_path):
    effect = loaded(tmp_path, RIBBON)
    with pytest.raises(InputError, match=r"mine\.py: my\.ribbon acts on motion; expected an effect on a sensor"):
        diagnose([[run_down(60.0)]], ["rig"], user_effects=[effect])
