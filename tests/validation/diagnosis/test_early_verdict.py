"""Recordings that no motion follows end early, with the sensors that contradict one another."""

import json
from dataclasses import replace

import numpy as np
import pytest
from support.made import throws

from discsim.effects import effect
from discsim.environment import Environment
from discsim.frames import C2
from discsim.recording import Samples
from discsim.rig import default_profile, turn_table
from discsim.sensors import Instruments, record
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.consistency.followed import left_of, left_when_shifted, true_noise
from discsim.validation.diagnosis.contradicted import contradicted_outcome
from discsim.validation.diagnosis.early_verdict import contradiction_in
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.settings import CONSISTENCY
from discsim.validation.identification.observations import readings_of


@pytest.fixture(scope="module")
def sound():
    return throws()


def exchanged(recordings, sensor):
    """Return recordings each of which has a sensor of the next."""
    nexts = [*recordings[1:], recordings[0]]
    return [
        replace(one, samples={**one.samples, sensor: other.samples[sensor]})
        for one, other in zip(recordings, nexts, strict=True)
    ]


@pytest.fixture(scope="module")
def mixed(sound):
    return exchanged(sound, "magnetometer")


@pytest.fixture(scope="module")
def contradiction(mixed):
    return contradiction_in(mixed, ())


def test_sound_throws_are_followed_and_nothing_is_said(sound):
    assert contradiction_in(sound, ()) is None


def test_throws_whose_velocity_nothing_tells_but_the_air_are_followed():
    """No path, and no release stated: a start at the guess of a throw to the north left 40 times the noise."""
    case = draw_case(547, "flight", kind="nothing")
    short = replace(case, runs=case.runs[:2], stated_releases=case.stated_releases[:2], longest=2.0)
    blind = [
        replace(one, release=None, samples={name: own for name, own in one.samples.items() if name != "gps"})
        for one in recordings(short)
    ]
    assert contradiction_in(blind, ()) is None


@pytest.mark.slow
def test_a_magnetometer_of_another_throw_contradicts_the_rest(contradiction):
    assert contradiction is not None
    assert "magnetometer" in contradiction.blamed
    assert any("magnetometer" in one and "contradict" in one for one in contradiction.sentences)


def test_the_outcome_is_unexplained_located_by_sensor_and_finite(mixed, contradiction):
    answer = contradicted_outcome(contradiction, mixed, ["mixed"], ["01", "02"], 0).diagnosis.to_json()
    assert answer["verdict"] == "unexplained"
    assert answer["effects"] == []
    assert {place["sensor"] for place in answer["located"]} == set(contradiction.blamed)
    assert answer["fit"]["final"]["chi2_per_sample"] > CONSISTENCY.astray
    json.dumps(answer, allow_nan=False)


def test_noise_is_seen_below_a_signal_that_turns_where_none_is_stated(sound):
    """The k-th difference of noise s has the level s sqrt(C(2k, k)), a field at 0.7 rad a row 0.69^k of it."""
    sheets = {
        **sound[0].sheets,
        "magnetometer": replace(sound[0].sheets["magnetometer"], noise_rms=None, resolution=None),
    }
    unstated = readings_of(replace(sound[0], sheets=sheets))
    stated = true_noise(readings_of(sound[0]))["magnetometer"].sd
    assert true_noise(unstated)["magnetometer"].sd == pytest.approx(stated, rel=0.3)


def test_a_part_of_a_fit_leaves_what_the_whole_left_of_it(sound):
    fit = relaxed(sound)
    noise = true_noise(readings_of(sound[0]))
    assert left_of(fit.part([1]), noise)[0] == left_of(fit, noise)[1]


@pytest.mark.parametrize("sensor", ["magnetometer", "accelerometer"])
def test_a_delay_and_lost_samples_are_reconciled_and_another_throw_is_not(sound, sensor):
    fit = relaxed(sound)
    own, other = (next(r for r in readings_of(one) if r.sensor == sensor) for one in sound)
    noise = true_noise([own])

    def left(readings):
        return left_when_shifted(fit.trajectories[0], fit.values(0), readings, noise)

    kept = np.sort(np.random.default_rng(1).choice(own.t.size, int(0.95 * own.t.size), replace=False))
    lost = replace(own, t=own.t[: kept.size], value=own.value[kept], good=own.good[kept], clipped=own.clipped[kept])
    assert left(replace(own, t=own.t + 0.05)) < CONSISTENCY.reconciled
    assert left(lost) < CONSISTENCY.reconciled
    assert left(other) > CONSISTENCY.reconciled


@pytest.mark.parametrize("sensor", [pytest.param("gyroscope", marks=pytest.mark.slow), "magnetometer"])
def test_a_sensor_that_is_turned_in_its_board_by_a_degree_is_no_contradiction(sound, sensor):
    """Such a gyroscope shows more than 1 rad/s of the spin on its other axes: a hundred times its noise."""
    turned = [
        replace(one, samples={**one.samples, sensor: Samples(own.t, own.value @ C2(0.02).T)})
        for one in sound
        for own in (one.samples[sensor],)
    ]
    assert contradiction_in(turned, ()) is None


@pytest.mark.parametrize(
    ("order", "amplitude"),
    [(1.0, 0.05), pytest.param(3.0, 0.6, marks=pytest.mark.slow), pytest.param(6.0, 1.2, marks=pytest.mark.slow)],
)
def test_a_table_whose_speed_ripples_is_no_contradiction(order, amplitude):
    """Of a strong one the accelerometer tells, too: it and the reference each contradict a table without a ripple."""
    profile = default_profile((1000, 3000, 5000), hold=3.0)
    ripples = effect("rig.speed_ripple", order=order, amplitude_rad_s=amplitude)
    motion = turn_table(profile, Environment(), (ripples,), yaw=0.3)
    parts = Instruments.from_parts("mpu9250", "ac1120s")
    run = record(motion, parts, np.random.default_rng(3), plant="rate_table", name="run", command=profile)
    assert contradiction_in([run], ()) is None
    # the reference of a table that turns at another rate is no ripple
    other = Samples(run.need("rate_reference").t, 0.8 * run.need("rate_reference").value)
    assert contradiction_in([replace(run, samples={**run.samples, "rate_reference": other})], ()) is not None
