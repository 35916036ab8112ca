"""The streaming estimator: the batch's numbers, in bounded memory, at once."""

from __future__ import annotations

import sys
import time

import numpy as np
import pytest
from support.spinning_sensor import Faults, Spin, move, record, without

from discsim.errors import InputError
from discsim.estimators.likelihood import LikelihoodSettings, fit_windows, usable_field
from discsim.estimators.streaming import StreamingRate


@pytest.fixture(scope="module")
def rig():
    spin = without(Spin(duration=6.0), precession=False)
    recording, truth = record(
        spin, np.random.default_rng(1), Faults(hard_iron=(11.0, 4.0, 0.0)), sensors=("magnetometer",), plant="spin_down"
    )
    return recording.need("magnetometer"), truth


def stream(samples, **options):
    live = StreamingRate(100.0, **options)
    return live, [live.update(t, field) for t, field in zip(samples.t, samples.value, strict=True)]


def test_it_gives_the_numbers_of_the_batch(rig):
    """Both minimise the same sum; the steps end below a ten-thousandth of a standard deviation."""
    samples, _ = rig
    _, answers = stream(samples, fixed_axis=True)
    known = [answer for answer in answers if np.isfinite(answer.rate)]
    assert len(known) > 400
    t, m = usable_field(samples)
    settings = LikelihoodSettings()
    chosen = known[:: len(known) // 15]
    batch = fit_windows(t, m, np.array([answer.t for answer in chosen]), settings)
    for i, answer in enumerate(chosen):
        assert answer.rate == pytest.approx(-batch.phase_rate[i], abs=1e-3 * answer.sd)
        assert answer.sd == pytest.approx(batch.phase_rate_sd[i], rel=1e-3)


def test_the_newest_rate_is_honest_about_being_extrapolated(rig):
    samples, truth = rig
    _, answers = stream(samples, settings=LikelihoodSettings(degree=1, window=0.6), fixed_axis=True)
    known = np.array([answer for answer in answers if np.isfinite(answer.rate)])
    middle = (known[:, 1] - truth.r(known[:, 0])) / known[:, 2]
    newest = (known[:, 4] - truth.r(known[:, 3])) / known[:, 5]
    assert np.all(known[:, 5] > 1.5 * known[:, 2])
    for normal in (middle, newest):
        # some nine independent windows
        assert np.sqrt(np.mean(normal**2)) == pytest.approx(1.0, abs=0.5)


def test_memory_and_latency_are_those_of_a_window(rig):
    samples, _ = rig
    live, answers = stream(samples, fixed_axis=True)
    assert live.latency == pytest.approx(0.635)
    assert answers[-1].newest - answers[-1].t == pytest.approx(live.latency, abs=0.006)
    held = live.held_bytes + sum(sys.getsizeof(v) for v in vars(live).values())
    assert held < 60_000
    again, _ = stream(samples, fixed_axis=True)
    for t in 6.0 + np.arange(200) / 100:
        again.update(t, samples.value[0])
    assert again.held_bytes == live.held_bytes


def test_the_gyroscope_removes_precession_as_it_comes():
    spin = Spin(duration=5.0)
    truth = move(spin)
    recording, _ = record(spin, np.random.default_rng(2), truth=truth, sensors=("magnetometer", "gyroscope"))
    magnetometer, gyroscope = recording.need("magnetometer"), recording.need("gyroscope")
    live = StreamingRate(100.0, strength=49.6)
    errors, normal, j = [], [], 0
    for t, field in zip(magnetometer.t, magnetometer.value, strict=True):
        while j < len(gyroscope) and gyroscope.t[j] <= t + 1e-9:
            live.update_gyroscope(gyroscope.t[j], gyroscope.value[j])
            j += 1
        answer = live.update(t, field)
        if np.isfinite(answer.rate):
            errors.append(np.degrees(answer.rate - truth.r(np.array([answer.t]))[0]))
            normal.append(errors[-1] / np.degrees(answer.sd))
    assert len(errors) > 300
    assert np.sqrt(np.mean(np.square(errors))) < 1.3
    assert np.sqrt(np.mean(np.square(normal))) < 2.0


def test_losing_the_signal_gives_nan_and_finding_it_again_an_answer(rig):
    samples, truth = rig
    value = samples.value.copy()
    value[200:300, :2] = np.random.default_rng(3).normal(0, 0.6, (100, 2))
    live = StreamingRate(100.0, fixed_axis=True)
    answers = [live.update(t, field) for t, field in zip(samples.t, value, strict=True)]
    assert np.all(np.isnan([answer.rate for answer in answers[270:320]]))
    late = answers[-1]
    assert late.rate == pytest.approx(truth.r(np.array([late.t]))[0], abs=5 * late.sd)


def test_gaps_and_time_that_runs_backwards(rig):
    samples, truth = rig
    live = StreamingRate(100.0, fixed_axis=True)
    for i, (t, field) in enumerate(zip(samples.t, samples.value, strict=True)):
        answer = live.update(t, np.full(3, np.nan) if i % 9 == 4 else field)
    assert answer.rate == pytest.approx(truth.r(np.array([answer.t]))[0], abs=5 * answer.sd)
    with pytest.raises(InputError, match="expected ascending time"):
        live.update(1.0, samples.value[0])


def test_a_sample_takes_a_fraction_of_the_sampling_interval(rig):
    """10 ms at 100 Hz; a tenth of it, of the processor's time, is ten times the figure of benchmarks/cost.py."""
    samples, _ = rig
    stream(samples, fixed_axis=True)
    start = time.thread_time()
    stream(samples, fixed_axis=True)
    assert (time.thread_time() - start) / len(samples) < 1e-3
