"""Many throws in MuJoCo at once: those flown alone, whatever the number of threads."""

from __future__ import annotations

import dataclasses
from threading import Event, Thread

import mujoco
import numpy as np
import pytest
from support.flights import DRIVER, FIELD, throw

from discsim import many_flights
from discsim.callbacks import passive_force
from discsim.disc import YawDampingTable
from discsim.effects import effect
from discsim.engine import FlyingDisc, fly
from discsim.errors import InputError
from discsim.many_flights import Ends, fly_many

SPEEDS = (6.0, 8.0, 9.0, 11.0, 12.0)
THROWS = [throw(speed=speed, wobble=(1.0, -2.0)) for speed in SPEEDS]


def assert_same(ends: Ends, flown: list) -> None:
    for name, values in ends.state._asdict().items():
        np.testing.assert_array_equal(values, np.stack([getattr(motion, name)[-1] for motion in flown]))
    np.testing.assert_array_equal(ends.touched_down, [motion.touched_down for motion in flown])


@pytest.fixture(scope="module")
def alone() -> list:
    return [fly(DRIVER, FIELD, release) for release in THROWS]


@pytest.mark.parametrize("threads", [1, 2, 3, None])
def test_they_end_as_flown_one_by_one_to_the_last_bit(alone, threads):
    assert_same(fly_many(DRIVER, FIELD, THROWS, threads=threads), alone)


def test_the_ground_is_found_whatever_the_length_of_a_round(alone, monkeypatch):
    """A flight may land in the first step of a round, or in its last."""
    for length in (1, 7, 10**6):
        monkeypatch.setattr(many_flights, "ROUND", length * 2)
        monkeypatch.setattr(many_flights, "LONGEST", length)
        assert_same(fly_many(DRIVER, FIELD, THROWS[:2], threads=2), alone[:2])


def test_what_is_left_out_of_a_baseline_acts_on_all():
    given = [effect("air.gust", t_s=0.2, w_east_m_s=4.0), effect("body.mass_imbalance", ex_m=0.002)]
    ends = fly_many(DRIVER, FIELD, THROWS, given, threads=2)
    assert_same(ends, [fly(DRIVER, FIELD, release, given) for release in THROWS])


def test_flights_end_after_their_duration():
    ends = fly_many(DRIVER, FIELD, THROWS, duration=0.25, threads=2)
    assert_same(ends, [fly(DRIVER, FIELD, release, duration=0.25) for release in THROWS])
    assert not ends.touched_down.any()


def test_no_throws_are_no_ends():
    ends = fly_many(DRIVER, FIELD, [])
    assert ends.state.position.shape == (0, 3)
    assert ends.touched_down.shape == (0,)


def test_a_flight_that_diverges_is_nan_and_leaves_no_log(alone, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    mad = dataclasses.replace(throw(), body_rate=np.array([4900.0, 0.0, 4900.0]))
    ends = fly_many(DRIVER, FIELD, [THROWS[0], mad, THROWS[1]], threads=2)
    for values in ends.state:
        assert np.isnan(values[1]).all()
    np.testing.assert_array_equal(ends.touched_down, [True, False, True])
    for k, motion in ((0, alone[0]), (2, alone[1])):
        np.testing.assert_array_equal(ends.state.position[k], motion.position[-1])
    assert not any(tmp_path.iterdir())
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("in_c", [True, False])
def test_a_flight_that_leaves_its_table_is_nan_and_the_others_fly_on(in_c):
    rate, speed = np.radians([1000.0, 3000.0, 6000.0, 9000.0]), np.array([1.0, 5.0, 9.0, 14.0])
    disc = dataclasses.replace(DRIVER, yaw_damping_table=YawDampingTable(rate, speed, np.full((4, 4), -0.003)))
    throws = [THROWS[0], throw(speed=13.9, climb_deg=-80.0, pitch_deg=-80.0, height=30.0), THROWS[1]]
    with pytest.raises(InputError, match="outside its C_Nr table"):
        fly(disc, FIELD, throws[1])
    if in_c:
        ends = fly_many(disc, FIELD, throws, threads=2)
    else:
        other = FlyingDisc(DRIVER, FIELD)
        with passive_force(other.model, other.apply):
            ends = fly_many(disc, FIELD, throws, threads=2)
    np.testing.assert_array_equal(np.isnan(ends.state.t), [False, True, False])
    for k in (0, 2):
        np.testing.assert_array_equal(ends.state.position[k], fly(disc, FIELD, throws[k]).position[-1])


def test_while_another_block_needs_python_they_fly_on_one_thread_and_the_same(alone, monkeypatch):
    def refused(*given: object, **more: object) -> None:
        raise AssertionError("a callback in Python on several threads")

    other = FlyingDisc(DRIVER, FIELD)
    monkeypatch.setattr(many_flights.Batch, "rollout", refused)
    with passive_force(other.model, lambda model, data: None):
        assert_same(fly_many(DRIVER, FIELD, THROWS[:2], threads=2), alone[:2])
    assert mujoco.get_mjcb_passive() is None


def test_a_block_in_python_waits_until_a_round_is_over(alone, monkeypatch):
    """It opens while flights are under way; the rounds after it are flown on one thread, to the same ends."""
    other, opened, rounds = FlyingDisc(DRIVER, FIELD), Event(), []
    whole = many_flights.Batch.rollout

    def open_block() -> None:
        with passive_force(other.model, lambda model, data: None):
            opened.set()
            done.wait(30.0)

    def rollout(batch, *given, **more):
        if not rounds:
            thread.start()
            assert not opened.wait(0.1)
        rounds.append(None)
        return whole(batch, *given, **more)

    done, thread = Event(), Thread(target=open_block)
    monkeypatch.setattr(many_flights, "ROUND", 100 * len(THROWS))
    monkeypatch.setattr(many_flights.Batch, "rollout", rollout)
    real = many_flights.advance

    def advance(*given):
        path = real(*given)
        opened.wait(5.0)
        return path

    monkeypatch.setattr(many_flights, "advance", advance)
    try:
        assert_same(fly_many(DRIVER, FIELD, THROWS, threads=2), alone)
    finally:
        done.set()
        thread.join()
    assert len(rounds) == 1


def test_a_throw_needs_its_spin():
    with pytest.raises(InputError, match="a throw needs body_rate"):
        fly_many(DRIVER, FIELD, [dataclasses.replace(throw(), body_rate=None)])
