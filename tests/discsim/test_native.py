"""The callback that MuJoCo calls in C: the same flights as by the one in Python, and the same guarantees."""

from __future__ import annotations

import ctypes
import dataclasses
from _ctypes import CFuncPtr
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from support.flights import DRIVER, FIELD, throw

from discsim import native
from discsim.callbacks import passive_force, stepped_by_c
from discsim.disc import Disc, YawDampingTable
from discsim.effects import effect
from discsim.effects.own import load_user_effect
from discsim.engine import FlyingDisc, fly, follow
from discsim.errors import InputError
from discsim.law import Law
from discsim.motion import Motion
from discsim.native import NativeCallback, native_callback
from discsim.shipped import load_disc

OWN = """
from typing import NamedTuple
class Push(NamedTuple):
    size: float = 0.0
ID, ACTS_ON, SCALE = "my.push", "motion", (0.01,)
def apply(effect, t, h, u, v, w, P, Q, r):
    return 0.0, effect.size * u, 0.0, 0.0, 0.0, effect.size * r * 1e-4
"""
EFFECTS = {
    "baseline": [],
    "gust, stall, imbalance": [
        effect("air.gust", t_s=0.5, width_s=0.2, w_east_m_s=3.0),
        effect("aero.stall", k=0.5, alpha_stall_rad=0.1),
        effect("body.mass_imbalance", ex_m=0.002),
    ],
    "a blow and a kick": [effect("event.impulse", t_s=0.4, dv_east_m_s=2.0), effect("event.spin_step", dr_rad_s=-5.0)],
}


def assert_same(one: Motion, other: Motion) -> None:
    for name in ("t", "position", "velocity", "acceleration", "attitude", "rate", "angular_acceleration"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def in_slot() -> Any:
    return mujoco.get_mjcb_passive()


def spinning_out(disc: Disc = DRIVER) -> FlyingDisc:
    """A disc whose C_Nr table ends just above the speed it is released at, thrown downwards so that it gains some."""
    rate, speed = np.radians([1000.0, 3000.0, 6000.0, 9000.0]), np.array([2.0, 10.0, 18.0, 24.05])
    table = YawDampingTable(rate, speed, np.full((4, 4), -0.003))
    flying = FlyingDisc(dataclasses.replace(disc, yaw_damping_table=table), FIELD)
    flying.release(throw(speed=24.0, climb_deg=-60.0, pitch_deg=-60.0, height=100.0))
    return flying


class TestTheSameFlight:
    @pytest.mark.parametrize("name", EFFECTS)
    @pytest.mark.parametrize("disc", ["driver", "dd2"])
    def test_c_and_python_fly_the_same_to_the_last_bit(self, disc, name):
        """1e-10 is promised; it is one compiled function, reached by two ways."""
        disc, field = load_disc(disc)
        flights = [
            follow(FlyingDisc(disc, field, EFFECTS[name]), throw(), duration=1.5, python=python)
            for python in (False, True)
        ]
        assert_same(*flights)

    def test_so_do_a_law_and_an_effect_of_the_user_s_own(self, tmp_path):
        path = Path(tmp_path / "push.py")
        path.write_text(OWN)
        law = Law("-c * r", "moment_z_N_m", {"c": 1e-5})
        push = load_user_effect(path).sized({"size": 0.02})
        plain = fly(DRIVER, FIELD, throw(), duration=1.0)
        flights = [
            follow(FlyingDisc(DRIVER, FIELD, [push], law=law), throw(), duration=1.0, python=way)
            for way in (False, True)
        ]
        assert_same(*flights)
        assert np.abs(flights[0].position[-1] - plain.position[-1]).max() > 0.1

    @pytest.mark.parametrize("ground", ["stop", "skip"])
    def test_a_flight_is_that_of_mujoco_s_own_step(self, ground):
        """`fly` evaluates each state once; `mj_step`, asked step by step, gives the same states to the last bit."""
        release = throw(speed=14.0, climb_deg=2.0, roll_deg=0.0, pitch_deg=6.0)
        motion = fly(DRIVER, FIELD, release, ground=ground, duration=3.0)
        flying = FlyingDisc(DRIVER, FIELD, contacts=ground == "skip")
        flying.release(release)
        touched = 0
        with flying.air():
            for t, position in zip(motion.t[1:-1], motion.position[1:-1], strict=True):
                mujoco.mj_step(flying.model, flying.data)
                touched += flying.data.ncon > 0
                assert flying.data.time == t
                np.testing.assert_array_equal(flying.data.qpos[:3] * [1, -1, -1], position)
        assert (touched > 100) == (ground == "skip")

    def test_parameters_may_be_changed_between_steps(self):
        flying, other = FlyingDisc(DRIVER, FIELD), FlyingDisc(DRIVER, FIELD, [effect("air.wind", w_east_m_s=4.0)])
        for each in (flying, other):
            each.release(throw())
        with flying.air(), other.air():
            mujoco.mj_step(flying.model, flying.data)
            assert not np.array_equal(flying.data.qfrc_passive, 0.0)
            flying.release(throw())
            flying.parameters[:] = other.parameters
            for each in (flying, other):
                mujoco.mj_step(each.model, each.data)
            np.testing.assert_array_equal(flying.data.qpos, other.data.qpos)


class TestWhichCallback:
    def test_a_flight_is_called_in_c(self):
        with FlyingDisc(DRIVER, FIELD).air(), stepped_by_c() as in_c:
            assert in_c
            assert isinstance(in_slot(), CFuncPtr)

    def test_python_is_taken_where_it_is_asked_for(self):
        with FlyingDisc(DRIVER, FIELD).air(python=True), stepped_by_c() as in_c:
            assert not in_c
            assert in_slot().__name__ == "_dispatch"

    def test_and_where_a_disc_has_a_force_of_its_own(self):
        class Pushed(FlyingDisc):
            def apply(self, model: Any, data: Any) -> None:
                super().apply(model, data)
                data.qfrc_passive[1] += 0.2

        plain, pushed = (follow(kind(DRIVER, FIELD), throw(), duration=0.5) for kind in (FlyingDisc, Pushed))
        # 0.2 N to the left of 0.179 kg for half a second: 0.14 m, and the air turns it on
        assert plain.position[-1, 1] - pushed.position[-1, 1] == pytest.approx(0.14, rel=0.1)

    def test_while_one_block_needs_python_all_go_through_it_and_back(self):
        flying, pushed = FlyingDisc(DRIVER, FIELD), FlyingDisc(DRIVER, FIELD)
        alone = follow(FlyingDisc(DRIVER, FIELD), throw(), duration=0.2)
        with flying.air():
            with passive_force(pushed.model, lambda model, data: None):
                assert not isinstance(in_slot(), CFuncPtr)
                assert_same(follow(flying, throw(), duration=0.2), alone)
            assert isinstance(in_slot(), CFuncPtr)
        assert in_slot() is None

    def test_a_force_in_python_on_top_of_one_in_c_acts_alone_and_the_other_returns(self):
        flying = FlyingDisc(DRIVER, FIELD)
        flying.release(throw())

        def push(model: Any, data: Any) -> None:
            data.qfrc_passive[0] += 7.0

        with flying.air():
            with passive_force(flying.model, push):
                mujoco.mj_forward(flying.model, flying.data)
                np.testing.assert_array_equal(flying.data.qfrc_passive, [7.0, 0, 0, 0, 0, 0])
            mujoco.mj_forward(flying.model, flying.data)
            assert flying.data.qfrc_passive[0] != 7.0
            assert np.any(flying.data.qfrc_passive)

    def test_a_foreign_callback_in_python_keeps_python_s_and_is_reached(self):
        seen = []
        mujoco.set_mjcb_passive(lambda model, data: seen.append(model))
        flying = FlyingDisc(DRIVER, FIELD)
        try:
            with flying.air():
                assert not isinstance(in_slot(), CFuncPtr)
                mujoco.mj_forward(flying.model, flying.data)
            mujoco.mj_forward(flying.model, flying.data)
        finally:
            mujoco.set_mjcb_passive(None)
        assert seen == [flying.model]

    def test_a_foreign_callback_in_c_is_forgotten_after_the_last_block(self):
        """Who then puts back what they found in a block, ours, must not have theirs called."""
        seen = []
        foreign = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda model, data: seen.append(model))
        flying = FlyingDisc(DRIVER, FIELD)
        mujoco.set_mjcb_passive(foreign)
        try:
            with FlyingDisc(DRIVER, FIELD).air():
                ours = in_slot()
                assert isinstance(ours, CFuncPtr)
                mujoco.mj_forward(flying.model, flying.data)
            assert seen == [flying.model._address]
            mujoco.set_mjcb_passive(ours)
            mujoco.mj_forward(flying.model, flying.data)
        finally:
            mujoco.set_mjcb_passive(None)
        assert len(seen) == 1

    def test_flights_in_threads_of_both_kinds_are_those_flown_alone(self):
        def flown(python: bool) -> Motion:
            return follow(FlyingDisc(DRIVER, FIELD), throw(), duration=0.5, python=python)

        alone = fly(DRIVER, FIELD, throw(), duration=0.5)
        with ThreadPoolExecutor(4) as pool:
            jobs = [pool.submit(flown, k % 3 == 0) for k in range(12)]
            for job in jobs:
                assert_same(job.result(), alone)


class TestWhereItCannotBe:
    def test_data_that_are_not_where_they_are_said_to_be_are_noticed(self):
        offsets = native.field_offsets()
        assert native.works(NativeCallback(offsets))
        for field in range(4):
            wrong = list(offsets)
            wrong[field] += 8
            assert not native.works(NativeCallback(wrong))

    def test_it_is_found_inside_a_block_in_python_too(self):
        """Looking for it compiles a model, which under a callback in Python MuJoCo does only of one without springs."""
        native_callback.cache_clear()
        other = FlyingDisc(DRIVER, FIELD)
        with passive_force(other.model, lambda model, data: None):
            assert native_callback() is not None

    def test_without_it_flights_are_the_same(self, monkeypatch):
        with_it = fly(DRIVER, FIELD, throw(), duration=0.3)
        monkeypatch.setattr(native, "field_offsets", lambda: 1 / 0)
        native_callback.cache_clear()
        try:
            assert native_callback() is None
            with FlyingDisc(DRIVER, FIELD).air():
                assert in_slot().__name__ == "_dispatch"
            assert_same(fly(DRIVER, FIELD, throw(), duration=0.3), with_it)
        finally:
            native_callback.cache_clear()

    def test_a_full_table_leaves_the_next_disc_to_python(self, monkeypatch):
        assert native_callback() is not None  # compiled for its full size
        monkeypatch.setattr(native, "CAPACITY", 1)
        alone = fly(DRIVER, FIELD, throw(), duration=0.2)
        first = FlyingDisc(DRIVER, FIELD)
        with first.air():
            assert isinstance(in_slot(), CFuncPtr)
            assert_same(fly(DRIVER, FIELD, throw(), duration=0.2), alone)
            assert_same(follow(first, throw(), duration=0.2), alone)


class TestALostAir:
    """A force that is not finite cannot be raised out of C: it is written down, and raised when Python has a say."""

    def test_a_flight_names_when_and_where_it_left_its_table(self):
        flying = spinning_out()
        release = throw(speed=24.0, climb_deg=-60.0, pitch_deg=-60.0, height=100.0)
        with pytest.raises(InputError, match=r"outside its C_Nr table; expected .* 2 to 24.05 m/s") as by_c:
            follow(flying, release)
        with pytest.raises(InputError) as by_python:
            follow(flying, release, python=True)
        assert str(by_c.value) == str(by_python.value)

    def test_steps_of_one_s_own_are_told_at_the_end_of_the_block_and_once(self):
        flying = spinning_out()
        with pytest.raises(InputError, match="outside its C_Nr table"), flying.air():
            mujoco.mj_step(flying.model, flying.data, nstep=300)
        assert np.isnan(flying.data.qpos).any()
        flying.release(throw(speed=12.0))
        with flying.air():
            mujoco.mj_step(flying.model, flying.data)


def test_the_c_function_may_be_called_from_python_too():
    """With addresses, or with MuJoCo's objects, which a thread brings along that was on its way into Python's."""
    callback = native_callback()
    assert callback is not None
    flying = FlyingDisc(DRIVER, FIELD)
    flying.release(throw())
    model, data = flying.model, flying.data
    callback.function(model, data)  # no block: nobody's model
    assert not np.any(data.qfrc_passive)
    forces = []
    with flying.air():
        for arguments in ((model, data), (model._address, data._address)):
            data.qfrc_passive[:] = 0.0
            callback.function(*arguments)
            forces.append(data.qfrc_passive.copy())
    assert np.any(forces[0])
    np.testing.assert_array_equal(*forces)
