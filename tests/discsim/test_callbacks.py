"""MuJoCo's one slot for a passive force, shared by all flights and rigs of a process."""

from __future__ import annotations

import ctypes
import dataclasses
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Barrier
from typing import Any

import mujoco
import numpy as np
import pytest
from support.flights import DRIVER, FIELD, throw

from discsim.callbacks import compile_model, own_warnings, passive_force
from discsim.disc import Rig
from discsim.engine import FlyingDisc, fly, follow
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.motion import Motion
from discsim.recording import Samples
from discsim.rig import spin_down, turn_table

OTHER_MODEL = "<mujoco><worldbody><body><freejoint/><geom size='0.1'/></body></worldbody></mujoco>"
NO_AIR = Environment(air_density=None)
#: three throws that land far apart
THROWS = [throw(), throw(speed=18.0), throw(spin_deg_s=-4200.0, roll_deg=12.0)]


@pytest.fixture(autouse=True)
def _left_as_found() -> Iterator[None]:
    assert mujoco.get_mjcb_passive() is None
    assert mujoco.get_mju_user_warning() is None
    yield
    left = mujoco.get_mjcb_passive(), mujoco.get_mju_user_warning()
    mujoco.set_mjcb_passive(None)
    mujoco.set_mju_user_warning(None)
    assert left == (None, None)


@contextmanager
def installed(callback: Any) -> Iterator[None]:
    """Have a callback of somebody else in the slot."""
    mujoco.set_mjcb_passive(callback)
    try:
        yield
        assert mujoco.get_mjcb_passive() is callback
    finally:
        mujoco.set_mjcb_passive(None)


def foreign() -> tuple[Any, Any]:
    model = mujoco.MjModel.from_xml_string(OTHER_MODEL)
    return model, mujoco.MjData(model)


def released(release: Any = None) -> FlyingDisc:
    flying = FlyingDisc(DRIVER, FIELD)
    flying.release(release or throw())
    return flying


def step(flying: FlyingDisc) -> Any:
    """Step a disc once and return its passive force."""
    mujoco.mj_step(flying.model, flying.data)
    return flying.data.qfrc_passive


def assert_same(one: Motion, other: Motion) -> None:
    np.testing.assert_array_equal(one.position, other.position)
    np.testing.assert_array_equal(one.rate, other.rate)


@pytest.fixture(scope="module")
def serial() -> list[Motion]:
    """The throws flown one by one."""
    return [fly(DRIVER, FIELD, release) for release in THROWS]


class TestThreads:
    def test_discs_built_first_fly_in_a_pool_as_they_fly_one_by_one(self, serial):
        """Three throws, each twice, on three threads that start together: the same to the last bit."""
        built = [FlyingDisc(DRIVER, FIELD) for _ in range(6)]
        together = Barrier(3)

        def one(k: int) -> Motion:
            if k < 3:
                together.wait()
            return follow(built[k], THROWS[k % 3])

        with ThreadPoolExecutor(3) as pool:
            for k, motion in enumerate(pool.map(one, range(6))):
                assert_same(motion, serial[k % 3])

    def test_discs_that_are_built_in_the_pool_fly_as_well(self, serial):
        """A disc is compiled in one thread while another flies."""
        with ThreadPoolExecutor(3) as pool:
            flights = list(pool.map(lambda k: fly(DRIVER, FIELD, THROWS[k % 3]), range(6)))
        for k, motion in enumerate(flights):
            assert_same(motion, serial[k % 3])

    def test_a_block_of_one_thread_serves_a_step_in_another(self):
        flying, alone = released(), released()
        with alone.air():
            expected = step(alone).copy()
        with flying.air(), ThreadPoolExecutor(1) as pool:
            np.testing.assert_array_equal(pool.submit(step, flying).result(), expected)

    def test_a_flight_that_fails_does_not_disturb_the_others(self, serial):
        """Its rate is beyond what a step can follow; the others land where they land alone."""
        mad = dataclasses.replace(throw(), body_rate=np.array([4900.0, 0.0, 4900.0]))
        with ThreadPoolExecutor(3) as pool:
            jobs = [pool.submit(fly, DRIVER, FIELD, release) for release in (mad, *THROWS, mad)]
            for job in (jobs[0], jobs[-1]):
                with pytest.raises(InputError, match="rad in a step"):
                    job.result()
            for job, alone in zip(jobs[1:-1], serial, strict=True):
                assert_same(job.result(), alone)

    def test_rigs_and_flights_run_beside_each_other(self):
        profile = Samples(np.array([0.0, 0.5, 1.0]), np.array([0.0, 30.0, 30.0]))
        jobs: list[Callable[[], Motion]] = [
            lambda: turn_table(profile, FIELD),
            lambda: spin_down(Rig(Izz=1.15e-3, viscous=2e-5), NO_AIR, 60.0, 1.0),
            lambda: fly(DRIVER, FIELD, throw(), duration=1.0),
        ]
        alone = [job() for job in jobs]
        with ThreadPoolExecutor(3) as pool:
            for together, one in zip(pool.map(lambda job: job(), 2 * jobs), 2 * alone, strict=True):
                assert_same(together, one)


class TestNestedBlocks:
    def test_each_disc_flies_in_its_own_air(self):
        """The outer disc in the inner block, too."""
        one, two, alone = released(), released(THROWS[1]), [released(), released(THROWS[1])]
        expected = []
        for flying in alone:
            with flying.air():
                expected.append(step(flying).copy())
        with one.air(), two.air():
            np.testing.assert_array_equal(step(one), expected[0])
            np.testing.assert_array_equal(step(two), expected[1])
        assert np.all(step(one) == 0.0)

    def test_the_outer_block_goes_on_after_the_inner_one(self):
        one, two = released(), released()
        with one.air():
            with two.air():
                pass
            assert np.any(step(one) != 0.0)
            assert np.all(step(two) == 0.0)

    def test_the_same_disc_twice_feels_its_air_once(self):
        flying, alone = released(), released()
        with alone.air():
            expected = step(alone).copy()
        with flying.air(), flying.air():
            np.testing.assert_array_equal(step(flying), expected)

    def test_of_two_forces_on_one_model_the_last_acts(self):
        flying = released()

        def push(model: Any, data: Any) -> None:
            data.qfrc_passive[0] += 7.0

        with flying.air():
            with passive_force(flying.model, push):
                np.testing.assert_array_equal(step(flying), [7.0, 0, 0, 0, 0, 0])
            assert np.any(step(flying)[1:] != 0.0)

    def test_a_disc_built_inside_a_block_flies_as_one_built_before(self):
        before = released()
        with before.air():
            inside = released()
            expected = step(before).copy()
            with inside.air():
                np.testing.assert_array_equal(step(inside), expected)

    def test_a_rig_built_inside_a_block_turns_as_one_built_before(self):
        profile = Samples(np.array([0.0, 0.2]), np.array([10.0, 20.0]))
        alone = turn_table(profile, FIELD)
        with released().air():
            assert_same(turn_table(profile, FIELD), alone)


class TestForeignModels:
    def test_a_foreign_model_stepped_meanwhile_feels_nothing(self):
        model, alone = foreign()
        beside = mujoco.MjData(model)
        for data in (alone, beside):
            data.qvel[:] = [10.0, 0, 0, 0, 0, 50.0]
        for _ in range(5):
            mujoco.mj_step(model, alone)
        with released().air():
            for _ in range(5):
                mujoco.mj_step(model, beside)
        np.testing.assert_array_equal(beside.qpos, alone.qpos)
        assert np.all(beside.qfrc_passive == 0.0)

    def test_it_reaches_the_callback_that_was_installed_before_ours(self):
        """Our disc does not: its forces are those of our air alone."""
        model, data = foreign()
        seen = []

        def push(stepped: Any, its_data: Any) -> None:
            seen.append(stepped)
            its_data.qfrc_passive[0] += 3.0

        flying, alone = released(), released()
        with alone.air():
            expected = step(alone).copy()
        with installed(push), flying.air(), released().air():
            mujoco.mj_step(model, data)
            np.testing.assert_array_equal(step(flying), expected)
        np.testing.assert_array_equal(data.qfrc_passive, [3.0, 0, 0, 0, 0, 0])
        assert seen
        assert all(stepped is model for stepped in seen)

    def test_it_reaches_a_native_callback_with_the_addresses_of_model_and_data(self):
        model, data = foreign()
        seen = []
        native = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)(lambda m, d: seen.append((m, d)))
        with installed(native), released().air():
            mujoco.mj_step(model, data)
        assert set(seen) == {(model._address, data._address)}

    def test_an_error_of_its_callback_comes_out_as_itself(self):
        model, data = foreign()

        def broken(stepped: Any, its_data: Any) -> None:
            raise KeyError("a foreign force")

        with installed(broken), pytest.raises(KeyError, match="a foreign force"), released().air():
            mujoco.mj_step(model, data)

    def test_a_second_data_of_the_same_model_flies_too(self):
        flying = released()
        copy = mujoco.MjData(flying.model)
        copy.qpos[:], copy.qvel[:] = flying.data.qpos, flying.data.qvel
        with flying.air():
            for _ in range(3):
                mujoco.mj_step(flying.model, flying.data)
                mujoco.mj_step(flying.model, copy)
        np.testing.assert_array_equal(copy.qpos, flying.data.qpos)

    @pytest.mark.parametrize("compile_it", [mujoco.MjModel.from_xml_string, None], ids=["from_xml", "spec"])
    def test_a_model_compiled_inside_the_block_is_a_clear_error_where_the_callback_is_python_s(self, compile_it):
        flying = FlyingDisc(DRIVER, FIELD)
        compile_it = compile_it or (lambda text: mujoco.MjSpec.from_string(text).compile())
        with flying.air():
            assert compile_it(OTHER_MODEL).nv == 6
        refusal = pytest.raises(RuntimeError, match="compile every model before entering the block")
        with refusal, flying.air(python=True):
            compile_it(OTHER_MODEL)

    def test_compile_model_works_inside_a_block_and_changes_nothing(self):
        def sprung() -> Any:
            spec = mujoco.MjSpec.from_string(OTHER_MODEL.replace("<freejoint/>", "<joint stiffness='5' damping='1'/>"))
            spec.option.disableflags = int(mujoco.mjtDisableBit.mjDSBL_DAMPER)
            return spec

        plain = sprung().compile()
        with released().air():
            spec = sprung()
            model = compile_model(spec)
        assert spec.option.disableflags == model.opt.disableflags == plain.opt.disableflags
        data, expected = mujoco.MjData(model), mujoco.MjData(plain)
        for each, its in ((model, data), (plain, expected)):
            its.qpos[0] = 0.3
            mujoco.mj_step(each, its, nstep=10)
        assert data.qpos[0] != pytest.approx(0.3)
        np.testing.assert_array_equal(data.qpos, expected.qpos)


class TestNothingIsLeft:
    """The fixture looks at the slot after each test."""

    def test_an_exception_in_the_block(self):
        with pytest.raises(ZeroDivisionError), released().air(), released().air():
            _ = 1 / 0

    def test_an_exception_in_the_callback_comes_out_as_itself(self):
        flying = released()

        def broken(model: Any, data: Any) -> None:
            raise KeyError("a broken force")

        with pytest.raises(KeyError, match="a broken force"), passive_force(flying.model, broken):
            mujoco.mj_step(flying.model, flying.data)
        mujoco.mj_step(flying.model, flying.data)  # and MuJoCo still works

    def test_other_value_errors_in_the_block_are_left_alone(self):
        with pytest.raises(ValueError, match="something else"), released().air():
            raise ValueError("something else")

    def test_a_flight_that_fails(self):
        with pytest.raises(InputError):
            fly(DRIVER, FIELD, throw(height=-1.0))

    def test_exceptions_in_threads(self):
        def fail(k: int) -> None:
            with released().air():
                raise KeyError(k)

        with ThreadPoolExecutor(3) as pool:
            for job in [pool.submit(fail, k) for k in range(9)]:
                with pytest.raises(KeyError):
                    job.result()


class TestTheSlotIsGuarded:
    """Whoever takes the slot inside a block would have the disc fly on without air and without a word."""

    other = foreign()
    refusal = "another callback was put into MuJoCo's one slot for passive forces"

    @pytest.fixture(autouse=True)
    def _clean(self) -> Iterator[None]:
        yield
        mujoco.set_mjcb_passive(None)

    def test_a_block_that_lost_its_slot_says_so_and_leaves_the_other_callback(self):
        def other(model: Any, data: Any) -> None: ...

        with pytest.raises(RuntimeError, match=self.refusal), released().air():
            mujoco.set_mjcb_passive(other)
        assert mujoco.get_mjcb_passive() is other

    def test_a_flight_that_loses_its_slot_on_the_way_stops(self):
        """It is taken after a tenth of a second, and given back before the flight would end."""
        taken = []

        class Thief(FlyingDisc):
            def apply(self, model: Any, data: Any) -> None:
                super().apply(model, data)
                if data.time > 0.1 and not taken:
                    taken.append(data.time)
                    mujoco.set_mjcb_passive(None)

        with pytest.raises(RuntimeError, match=self.refusal):
            follow(Thief(DRIVER, FIELD), throw())

    def test_no_block_opens_while_the_slot_is_another_s(self):
        one, two = released(), released()
        with one.air():
            ours = mujoco.get_mjcb_passive()
            mujoco.set_mjcb_passive(lambda model, data: None)
            with pytest.raises(RuntimeError, match=self.refusal), two.air():
                pass
            mujoco.set_mjcb_passive(ours)
            assert np.any(step(one) != 0.0)

    def test_a_callback_of_ours_that_another_put_back_late_does_no_harm(self):
        """They stored what they found, ours, and restored it after our block."""
        with released().air():
            found = mujoco.get_mjcb_passive()
        mujoco.set_mjcb_passive(found)
        model, data = self.other
        mujoco.mj_step(model, data)
        assert np.all(data.qfrc_passive == 0.0)
        flying = released()
        with flying.air():
            assert np.any(step(flying) != 0.0)
        assert mujoco.get_mjcb_passive() is None


class TestWarnings:
    def test_those_of_a_silent_thread_are_swallowed_and_the_others_handed_on(self):
        model, _ = foreign()
        heard: list[str] = []

        def diverge() -> None:
            data = mujoco.MjData(model)
            data.qvel[0] = np.nan
            mujoco.mj_step(model, data)

        mujoco.set_mju_user_warning(heard.append)
        try:
            with own_warnings(), own_warnings():
                diverge()
                assert not heard
                with ThreadPoolExecutor(1) as pool:
                    pool.submit(diverge).result()
                assert len(heard) == 1
            diverge()
            assert len(heard) == 2
        finally:
            mujoco.set_mju_user_warning(None)

    def test_blocks_that_end_out_of_order_leave_nothing(self):
        first, second = own_warnings(), own_warnings()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        second.__exit__(None, None, None)
        assert mujoco.get_mju_user_warning() is None


def test_the_force_is_added_to_what_is_there():
    """``+=``: four evaluations a step start from MuJoCo's own passive forces, zero here."""
    flying = released()
    with flying.air():
        mujoco.mj_forward(flying.model, flying.data)
        once = flying.data.qfrc_passive.copy()
        flying.apply(flying.model, flying.data)
    np.testing.assert_allclose(flying.data.qfrc_passive, 2 * once, rtol=1e-15)
