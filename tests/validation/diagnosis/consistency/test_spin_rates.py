"""Spin rates of sensors that no clock, delay or lost sample sets apart tell a contradiction before any fit."""

from dataclasses import replace

import numpy as np
import pytest
from support.made import throws

from discsim.recording import Samples
from discsim.validation.diagnosis.consistency.spin_rates import APART, rates_apart
from discsim.validation.diagnosis.early_verdict import contradiction_in


@pytest.fixture(scope="module")
def spins():
    return throws(plant="free_spin")


def changed(recordings, sensor, change):
    """Return recordings with one sensor's times and readings changed."""
    return [replace(one, samples={**one.samples, sensor: change(one.samples[sensor])}) for one in recordings]


def backwards(samples):
    return Samples(samples.t, samples.value * [1.0, 1.0, -1.0])


def slow(samples):
    return Samples(0.96 * samples.t, samples.value)


def late(samples):
    return Samples(samples.t + 0.05, samples.value)


def losing(samples):
    kept = np.sort(np.random.default_rng(1).choice(len(samples), int(0.95 * len(samples)), replace=False))
    return Samples(samples.t[: kept.size], samples.value[kept])


def test_sound_spins_tell_one_rate(spins):
    assert rates_apart(spins) is None


@pytest.mark.parametrize("change", [slow, late, losing])
@pytest.mark.parametrize("sensor", ["magnetometer", "gyroscope"])
def test_a_slow_clock_a_delay_and_lost_samples_set_no_rates_apart(spins, sensor, change):
    assert rates_apart(changed(spins, sensor, change)) is None


def test_rates_of_opposite_sign_are_apart_by_twice_the_spin(spins):
    """70 and 62 rad/s: 2 r over 1.5 rad/s + 5 % of r is 28 and 27, a little less where precession takes a share."""
    found = rates_apart(changed(spins, "gyroscope", backwards))
    assert found is not None
    assert found.sensors == ("magnetometer", "gyroscope")
    assert found.times == pytest.approx(27.5, rel=0.1)
    assert found.times > APART


def test_a_free_spin_whose_rates_are_apart_ends_with_both_sensors_named(spins):
    found = contradiction_in(changed(spins, "gyroscope", backwards), ())
    assert found is not None
    assert set(found.blamed) == {"magnetometer", "gyroscope"}
    assert "tell different spin rates" in found.sentences[0]
