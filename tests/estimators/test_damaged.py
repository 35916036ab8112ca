"""Whatever a recording holds, each method gives estimates, or NaN, or one sentence: quickly, and in little memory."""

from __future__ import annotations

import resource
from dataclasses import replace

import numpy as np
import pytest
from support.spinning_sensor import Spin, record

from discsim.errors import InputError
from discsim.estimators import gyroscope
from discsim.estimators.methods import all_methods, best_of, estimate
from discsim.estimators.usable import FASTEST, usable
from discsim.recording import Samples, SensorSheet

SENSORS = ("magnetometer", "accelerometer", "gyroscope")


@pytest.fixture(scope="module")
def sound():
    """Three seconds at 1500 deg/s of a disc in a field that nobody states."""
    made, truth = record(Spin(rate=1500.0, duration=3.0), np.random.default_rng(1))
    return replace(made, environment=replace(made.environment, magnetic_field=np.zeros(3))), truth


def _column(axis, number):
    def damage(t, value):
        value = value.copy()
        value[:, axis] = number
        return t, value

    return damage


def _spikes(t, value):
    value = value.copy()
    value[::50] = 1e300
    return t, value


def _instants_apart(share):
    def damage(t, value):
        rng = np.random.default_rng(0)
        stamps = [1.0]
        for _ in t[1:]:
            stamps.append(np.nextafter(stamps[-1], np.inf) if rng.random() < share else stamps[-1] + 0.01)
        return np.array(stamps), value

    return damage


def _spread(low, high):
    return lambda t, value: (np.cumsum(10 ** np.random.default_rng(2).uniform(low, high, t.size)), value)


DAMAGES = {
    "dead": lambda t, value: (t, 0 * value),
    "constant": lambda t, value: (t, 0 * value + 3.0),
    "no numbers": lambda t, value: (t, np.nan * value),
    "no x": _column(0, np.nan),
    "no z": _column(2, np.nan),
    "x dead": _column(0, 0.0),
    "z dead": _column(2, 0.0),
    "a single row": lambda t, value: (t[:1], value[:1]),
    "five rows": lambda t, value: (t[:5], value[:5]),
    "a jump of hours": lambda t, value: (np.where(t < 1.5, t, t + 1e4), value),
    "a jump of the epoch": lambda t, value: (np.where(t < 1.5, t, t + 1.7e9), value),
    "six jumps": lambda t, value: (t + np.floor(t / 0.5) * 4000.0, value),
    "one ulp apart": _instants_apart(1.0),
    "half one ulp apart": _instants_apart(0.5),
    "uneven": _spread(-5, 0),
    "wildly uneven": _spread(-9, 3),
    "ten thousand times too fast": lambda t, value: (t * 1e-4, value),
    "a thousand times too slow": lambda t, value: (t * 1e3, value),
    "noise of 1e300": lambda t, value: (t, value + 1e300 * np.random.default_rng(2).normal(size=value.shape)),
    "noise of 1e30": lambda t, value: (t, value + 1e30 * np.random.default_rng(2).normal(size=value.shape)),
    "noise alone": lambda t, value: (t, np.random.default_rng(2).normal(size=value.shape)),
    "spikes of 1e300": _spikes,
    "nothing near": lambda t, value: (t, value * 1e-300),
}


def damaged(recording, damage, sensors):
    made = {n: Samples(*DAMAGES[damage](s.t, s.value)) if n in sensors else s for n, s in recording.samples.items()}
    return replace(recording, samples=made)


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("sensors", [*[(sensor,) for sensor in SENSORS], SENSORS], ids="+".join)
def test_no_damage_ends_in_anything_but_estimates_or_a_sentence(sound, damage, sensors):
    """Within 2 GB beyond what is there: a clock that jumps by years must not be given an answer for every step."""
    recording = damaged(sound[0], damage, sensors)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    refusal = ""
    try:
        rates, left_out = all_methods(recording)
    except InputError as error:
        rates, left_out, refusal = [], {}, str(error)
    assert "\n" not in refusal
    assert rates or refusal
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 2 * 2**20  # kB
    for method, reason in left_out.items():
        assert reason, method
    for found in rates:
        known = np.isfinite(found.rate)
        assert np.all(np.abs(found.rate[known]) <= FASTEST), found.method
        assert np.all(found.sd[known] > 0), found.method


@pytest.mark.parametrize("damage", ["dead", "no numbers", "a single row", "noise of 1e300", "spikes of 1e300"])
def test_a_damaged_gyroscope_or_accelerometer_leaves_the_magnetometer_its_say(sound, damage):
    recording, truth = sound
    found = estimate(damaged(recording, damage, ("gyroscope", "accelerometer")), "tracking")
    known = np.isfinite(found.rate)
    assert known.mean() > 0.9
    error = found.rate - truth.r(found.t)
    assert np.sqrt(np.nanmean((error / found.sd) ** 2)) < 3.0


def test_the_reason_for_a_dead_sensor_is_that_it_is_dead(sound):
    recording = damaged(sound[0], "dead", ("gyroscope",))
    _, left_out = all_methods(recording)
    assert "readings are the same, as of a sensor that is dead" in left_out["gyroscope"]
    assert any("gyroscope left out" in note for note in usable(recording).notes)


def test_a_dead_z_axis_gives_no_rate_of_zero(sound):
    _, left_out = all_methods(damaged(sound[0], "z dead", ("gyroscope",)))
    assert left_out["gyroscope"] == "the gyroscope has no usable reading of z"


def test_a_clipped_gyroscope_is_passed_over_by_best_which_says_so(sound):
    """No range is stated; the gyroscope stops at 10 rad/s, the truth is 26."""
    recording = sound[0]
    turning = recording.samples["gyroscope"]
    only = {"gyroscope": Samples(turning.t, np.clip(turning.value, -10.0, 10.0))}
    only["accelerometer"] = recording.samples["accelerometer"]
    sheets = {**recording.sheets, "gyroscope": replace(recording.sheets["gyroscope"], range=None)}
    found, passed_over = best_of(replace(recording, samples=only, sheets=sheets))
    assert found.method.startswith("accelerometer")
    assert "stands at its limit in every reading" in passed_over["gyroscope"]


def test_rounding_alone_is_a_deviation():
    """A gyroscope that stands still half of the time has second differences of zero; its step is 0.01 rad/s."""
    rng = np.random.default_rng(0)
    k = np.arange(400)
    rate = np.where(k < 300, 0.0, 3.0 * np.sin((k - 300) / 37.0)) + rng.normal(0.0, 1e-4, 400)
    value = np.round(np.stack([0 * rate, 0 * rate, rate], axis=1), 2)
    found = gyroscope(Samples(np.arange(400) / 100, value), SensorSheet(100.0))
    np.testing.assert_allclose(found.sd, 0.01 / np.sqrt(12), rtol=1e-6)


def test_rows_that_a_faster_log_leaves_empty_are_no_rows(sound):
    """A magnetometer of 100 Hz in a log of 200 Hz: every second row is empty, and the fft still finds its even grid."""
    recording, truth = sound
    field = recording.samples["magnetometer"]
    t = np.sort(np.concatenate([field.t, field.t[:-1] + 0.005]))
    value = np.full((t.size, 3), np.nan)
    value[::2] = field.value
    found = estimate(replace(recording, samples={"magnetometer": Samples(t, value)}), "fft")
    known = np.isfinite(found.rate)
    assert known.mean() > 0.9
    # without a gyroscope the field's precession stays: up to 15 deg/s, and leakage at five turns a window
    assert np.degrees(np.median(np.abs(found.rate[known] - truth.r(found.t[known])))) < 20.0


def test_single_rates_that_no_throw_has_are_left_out_aloud(sound):
    made, _ = sound
    gyro = made.need("gyroscope")
    value = gyro.value.copy()
    value[40::97, 2] *= 100
    slipped = replace(made, samples={**made.samples, "gyroscope": Samples(gyro.t, value)})
    found = estimate(slipped, "gyroscope")
    assert np.nanmax(np.abs(found.rate)) < 250
    assert np.count_nonzero(np.isfinite(found.rate)) == len(gyro) - value[40::97].shape[0]
    assert any("readings beyond 250 rad/s" in note for note in usable(slipped).notes)
    assert best_of(slipped)[0].method == best_of(made)[0].method
