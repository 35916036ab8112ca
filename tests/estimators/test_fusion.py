"""All sensors together: better than the magnetometer alone, calibrated on the way, no contradiction averaged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.spinning_sensor import MPU9250, Faults, Spin, move, record, without

from discsim.errors import InputError
from discsim.estimators import estimate
from discsim.estimators.centripetal import centripetal
from discsim.estimators.fusion import (
    FusionSettings,
    accelerometer_calibrated,
    compare_sensors,
    contradictions,
    fusion,
    unfolding,
)
from discsim.estimators.tracking import tracking
from discsim.estimators.tracking.recordings import plain_tracks, tracks_of
from discsim.estimators.tracking.track import RateRows, TrackingSettings
from discsim.recording import Recording, Samples, SensorSheet

FAULTS = Faults(
    hard_iron=(11.0, 4.0, -12.0),
    mount_error=(0.0011, -0.0006),
    accelerometer_bias=(0.3, -0.2),
    gyroscope_bias=(0.01, -0.02, 0.0),
)


@pytest.fixture(scope="module")
def thrown():
    spin = Spin()
    return spin, move(spin)


def rms(value):
    return float(np.sqrt(np.nanmean(np.square(value))))


def exchanged(recording, **samples):
    """The recording with some sensors' samples exchanged."""
    return Recording(
        recording.plant, recording.name, recording.environment, sheets=recording.sheets,
        samples={**recording.samples, **samples},
    )  # fmt: skip


def test_a_throw_is_known_to_half_a_degree_per_second(thrown):
    """The goal, with mount, bias, iron and precession on; and the accelerometer helps although it is not calibrated."""
    spin, truth = thrown
    fused, tracked, normal = [], [], []
    for seed in range(6):
        recording, _ = record(spin, np.random.default_rng(seed), FAULTS, truth=truth)
        found, plain = fusion(recording), tracking(recording)
        fused.append(np.degrees(found.rate - truth.r(found.t)))
        tracked.append(np.degrees(plain.rate - truth.r(plain.t)))
        normal.append(fused[-1] / np.degrees(found.sd))
    assert rms(fused) < 0.5
    assert rms(fused) < 0.9 * rms(tracked)
    assert 0.5 < rms(normal) < 1.3


def test_gravity_and_translation_average_out_over_a_turn(thrown):
    """5 m/s^2 that turns with the spin is 35 % of the centripetal force's change that one deg/s makes a thousand of."""
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(1), truth=truth)
    sheet = replace(MPU9250["accelerometer"])
    block = centripetal(recording.need("accelerometer"), sheet, truth.t, truth.w[:, 2])
    expected = 0.0161 * truth.r(block.t) ** 2
    assert np.all(np.abs(block.value[:, 0] - expected) < 5 * block.sd)
    assert np.median(block.sd) < 0.03  # 0.08 m/s^2 over some 30 readings


def test_a_table_that_stands_still_first_is_averaged_over_turns_once_it_turns():
    """Two turns at the 1 deg/s that an estimate wavers by at rest would last 12 minutes: longer than the recording."""
    t = np.arange(0.0, 12.0, 0.005)
    rate = np.radians(np.interp(t, [4.0, 5.0], [0.0, 1000.0]))
    wavering = rate + np.radians(1.0) * np.cos(2 * np.pi * t / 0.9)
    force = Samples(t, np.column_stack([0.0161 * rate**2, np.zeros_like(t), np.full_like(t, -9.8)]))
    block = centripetal(force, MPU9250["accelerometer"], t, wavering)
    fast = block.t > 5.8
    # two turns at 1000 deg/s are 0.72 s
    assert np.count_nonzero(fast) >= 8
    np.testing.assert_allclose(block.value[fast, 0], 0.0161 * np.radians(1000.0) ** 2, rtol=1e-9)


def test_the_mount_is_calibrated_by_the_magnetometer(thrown):
    """Eq. (9): 1.1 mm of 16.1 mm is 3.5 % of rate, 140 deg/s; calibrated, the accelerometer is within its noise."""
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(2), FAULTS, truth=truth)
    calibrated = accelerometer_calibrated(recording)
    error = np.degrees(calibrated.rate - truth.r(calibrated.t))
    assert calibrated.signed
    assert rms(error) < 1.5
    assert rms(error / np.degrees(calibrated.sd)) < 1.7
    (agreement,) = compare_sensors(recording)
    assert agreement.sensor == "accelerometer"
    assert agreement.agrees
    assert abs(np.degrees(agreement.difference)) > 80.0
    np.testing.assert_allclose(agreement.calibration[:2], [-0.0150, -0.0006], atol=2e-4)


def test_alone_the_accelerometer_says_how_little_it_knows_of_its_mount(thrown):
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(3), FAULTS, truth=truth, sensors=("accelerometer",))
    alone = accelerometer_calibrated(recording)
    error = alone.rate - truth.r(alone.t)
    assert not alone.signed
    assert rms(error / alone.sd) < 1.5
    # 3 mm of 16.1 mm: 9 % of the rate
    assert 0.06 < np.nanmedian(alone.sd / alone.rate) < 0.13


def test_the_calibrated_accelerometer_owns_up_to_a_drawn_gyroscope(thrown):
    """Gain of p and q of 1 % turns up as a steady false spin of the magnetometer and so in the calibration: an error
    of a whole throw, which its own readings do not show. It must be within the standard deviation that is stated."""
    spin, truth = thrown
    means, normal = [], []
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)
        faults = replace(FAULTS, gyroscope_scale=tuple(rng.normal(0, 0.02, 3)))
        recording, _ = record(spin, rng, faults, truth=truth)
        found = accelerometer_calibrated(recording)
        error = found.rate - truth.r(found.t)
        normal.append(error / found.sd)
        means.append(np.mean(error) / np.median(found.sd))
    assert 0.3 < rms(normal) < 1.2
    assert rms(means) < 1.0


@pytest.mark.parametrize("yaw", [30.0, 210.0, 330.0])
def test_without_a_gyroscope_the_precession_is_in_the_calibration(yaw):
    """Precession along the field looks like spin (5 to 15 deg/s) for the whole throw, and averaging does not help."""
    spin = Spin(yaw=yaw, duration=3.0)
    recording, truth = record(spin, np.random.default_rng(5), FAULTS, sensors=("magnetometer", "accelerometer"))
    found = accelerometer_calibrated(recording)
    error = np.degrees(found.rate - truth.r(found.t))
    assert abs(np.mean(error)) > 1.0
    assert np.median(np.degrees(found.sd)) > 3.0
    assert rms(error / np.degrees(found.sd)) < 2.0


def test_a_calibration_that_another_sensor_contradicts_is_no_calibration():
    """A magnetometer whose clock is 20 % off would put the accelerometer 7 mm elsewhere; a gyroscope in range knows."""
    spin = Spin(rate=1500.0, duration=4.0)
    recording, _ = record(spin, np.random.default_rng(6), FAULTS)
    assert np.isfinite(accelerometer_calibrated(recording).rate).all()
    field = recording.need("magnetometer")
    off = exchanged(recording, magnetometer=Samples(field.t / 1.2, field.value))
    assert np.isnan(accelerometer_calibrated(off).rate).all()
    assert any("gyroscope CONTRADICTS" in line for line in contradictions(off))


def test_a_mount_beyond_belief_is_a_contradiction_and_no_calibration(thrown):
    """20 mm where 3 mm are believed; without the magnetometer nothing would tell."""
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(7), replace(FAULTS, mount_error=(-0.02, 0.0)), truth=truth)
    assert np.isnan(accelerometer_calibrated(recording).rate).all()
    (line,) = contradictions(recording)
    assert line.startswith("accelerometer CONTRADICTS")
    assert "deg/s" in line


def test_an_accelerometer_that_recovers_from_the_jerk_of_a_throw_is_left_out_meanwhile(thrown):
    """As measured on thrown discs: 70 m/s^2 missing at release, a twentieth of it 0.3 s later."""
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(8), FAULTS, truth=truth)
    whole = recording.need("accelerometer")
    value = whole.value.copy()
    value[:, 0] -= 70.0 * np.exp(-whole.t / 0.1)
    found = accelerometer_calibrated(exchanged(recording, accelerometer=Samples(whole.t, value)))
    assert 0.2 < found.t[0] < 0.8
    error = np.degrees(found.rate - truth.r(found.t))
    assert rms(error[found.t > 1.0]) < 5.0  # what is left after 0.5 s, 0.5 m/s^2, is 14 deg/s
    assert rms(error / np.degrees(found.sd)) < 2.0


def test_a_gyroscope_in_range_counts_with_its_scale_estimated():
    spin = Spin(rate=1500.0, decay=5.0)
    truth = move(spin)
    faults = Faults(gyroscope_scale=(0.0, 0.0, 0.02), gyroscope_bias=(0.0, 0.0, 0.03))
    recording, _ = record(spin, np.random.default_rng(4), faults, truth=truth, sensors=("magnetometer", "gyroscope"))
    found, plain = fusion(recording), tracking(recording)
    assert rms(np.degrees(found.rate - truth.r(found.t))) < 0.8 * rms(np.degrees(plain.rate - truth.r(plain.t)))
    (agreement,) = compare_sensors(recording)
    assert agreement.agrees
    assert agreement.calibration[0] == pytest.approx(0.02, abs=4 * np.sqrt(agreement.covariance[0, 0]) + 1e-3)


def test_a_contradiction_is_named_with_numbers_and_left_out(thrown):
    """An accelerometer whose force is that of another spin: 30 % too large and falling twice as fast."""
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(5), FAULTS, truth=truth)
    accelerometer = recording.need("accelerometer")
    false = accelerometer.value * (1.6 - 0.1 * accelerometer.t[:, None])
    wrong = exchanged(recording, accelerometer=Samples(accelerometer.t, false))
    (agreement,) = compare_sensors(wrong)
    assert not agreement.agrees
    assert "CONTRADICTS" in str(agreement)
    assert "deg/s" in str(agreement)
    found, plain = fusion(wrong), tracking(wrong)
    np.testing.assert_allclose(found.rate, plain.rate, rtol=1e-12)


def test_a_gyroscope_and_an_accelerometer_outvote_a_magnetometer_with_wrong_time_stamps():
    """Stamps that run slow make the magnetometer's rate 30 % too large; without the accelerometer: no answer."""
    spin = Spin(rate=1700.0, duration=4.0)
    recording, truth = record(spin, np.random.default_rng(13), FAULTS)
    samples = recording.need("magnetometer")
    # what was taken over four seconds is stamped as if it had been over three
    hurried = exchanged(recording, magnetometer=Samples(samples.t / 1.3, samples.value))
    assert not compare_sensors(hurried)[0].agrees
    found = fusion(hurried)
    error = found.rate - truth.r(found.t)
    assert rms(error / found.sd) < 1.5
    alone = Recording(
        "flight", "two", recording.environment, sheets=recording.sheets,
        samples={name: hurried.samples[name] for name in ("magnetometer", "gyroscope")},
    )  # fmt: skip
    assert np.all(np.isnan(fusion(alone).rate))


def test_clipped_readings_are_no_readings():
    """Above 5660 deg/s this accelerometer clips; what is left must not draw the rate down."""
    spin = Spin(rate=6400.0, decay=12.0)
    truth = move(spin)
    recording, _ = record(spin, np.random.default_rng(6), truth=truth)
    assert np.any(recording.sheets["accelerometer"].clipped(recording.need("accelerometer").value[:, 0]))
    found = fusion(recording)
    assert rms(np.degrees(found.rate - truth.r(found.t))) < 0.6
    assert abs(np.degrees(np.nanmean(found.rate - truth.r(found.t)))) < 0.4


@pytest.mark.parametrize("companion", ["gyroscope", "accelerometer"])
@pytest.mark.parametrize("rate", [2600.0, -2600.0])
def test_a_spin_above_half_the_sampling_rate_is_unfolded(companion, rate):
    """At 10 Hz the field shows 2600 deg/s as -1000. The gyroscope, in range, or the centripetal force tells better."""
    sheets = {
        "magnetometer": SensorSheet(10.0, 0.6, 0.15, 4912.0),
        "accelerometer": MPU9250["accelerometer"],
        "gyroscope": SensorSheet(200.0, 0.003, 0.001, np.radians(4000.0)),
    }
    spin = without(Spin(rate=rate, duration=8.0, decay=200.0), precession=False)
    truth = move(spin)
    sensors = ("magnetometer", companion)
    recording, _ = record(spin, np.random.default_rng(7), sheets=sheets, sensors=sensors, truth=truth)
    # a gyroscope in range gives the smoother its first guess, so that nothing is left to unfold
    assert unfolding(recording) == (int(np.sign(rate)) if companion == "accelerometer" else 0, True)
    found = fusion(recording)
    inner = (found.t > 1.0) & (found.t < 7.0)
    assert rms(np.degrees(found.rate - truth.r(found.t))[inner]) < 3.0


def test_a_folded_spin_that_cannot_be_unfolded_is_nan():
    """A gyroscope that clips at 2000 deg/s excludes what the field shows but not what it is: 2600 or 6200 deg/s."""
    sheets = {
        "magnetometer": SensorSheet(10.0, 0.6, 0.15, 4912.0),
        "gyroscope": SensorSheet(200.0, 0.003, 0.001, np.radians(2000.0)),
    }
    spin = without(Spin(rate=2600.0, duration=6.0, decay=200.0), precession=False)
    recording, _ = record(spin, np.random.default_rng(8), sheets=sheets, sensors=("magnetometer", "gyroscope"))
    assert unfolding(recording)[1] is False
    assert np.all(np.isnan(fusion(recording).rate))


def test_standing_still_is_no_spin():
    spin = without(Spin(rate=0.001, duration=3.0), precession=False)
    recording, _ = record(spin, np.random.default_rng(9), sensors=("magnetometer", "accelerometer"))
    assert np.all(np.isnan(fusion(recording).rate))
    assert np.all(np.isnan(accelerometer_calibrated(recording, FusionSettings()).rate))


def test_a_fit_that_goes_on_from_the_magnetometers_ends_where_one_from_the_start_does(thrown):
    """Both end where a step is worth less than a hundredth of a standard deviation."""
    spin, truth = thrown
    recording, _ = record(spin, np.random.default_rng(3), FAULTS, truth=truth)
    gyroscope, settings = recording.need("gyroscope"), TrackingSettings()
    reading = gyroscope.value[:, 2]
    rows = [RateRows("linear", gyroscope.t, reading, np.full(reading.size, 0.02), np.zeros(2), np.array([0.03, 0.1]))]
    plain = plain_tracks(recording, settings, 0)
    anew = tracks_of(recording, settings, rows)
    on = tracks_of(recording, settings, rows, near=plain)
    assert len(anew) == len(on) == len(plain) > 0
    for alone, one, other in zip(plain, anew, on, strict=True):
        assert np.max(np.abs(one.rate - alone.rate) / one.sd) > 0.05  # the rows say something
        assert np.max(np.abs(one.rate - other.rate) / one.sd) < 1e-2
        assert np.max(np.abs(other.sd / one.sd - 1.0)) < 1e-2


@pytest.mark.parametrize("seed", range(4))
def test_a_decay_that_is_exponential_all_but_exactly_leads_no_fit_away(seed):
    """Of few readings steps were judged by a bend that no longer held: scales of -0.4, no answer, or one 18 % off."""
    spin = Spin(
        rate=740.0, decay=4.5, decay_change=0.0, duration=3.25, precession=(0.0, 0.0), precession_change=(0.0, 0.0)
    )
    sheets = {"magnetometer": SensorSheet(12.5, 0.4, 0.01, 4912.0), "gyroscope": MPU9250["gyroscope"]}
    told, truth = record(spin, np.random.default_rng(seed), sheets=sheets, sensors=tuple(sheets), plant="free_spin")
    found = fusion(told)
    known = np.isfinite(found.rate)
    assert np.mean(known) > 0.9
    # five standard deviations of what the field of 41 readings tells
    assert np.median(np.abs(found.rate[known] - truth.r(found.t[known]))) < np.radians(1.0)


def beyond_the_gyroscope(rate_hz: float, decay: float = 8.0):
    """A spin of 5000 deg/s, beyond a gyroscope's 2000 deg/s, with a magnetometer of a few readings a second."""
    spin = Spin(rate=5000.0, decay=decay, decay_change=0.0, duration=4.0, nutation=0.0)
    sheets = {"magnetometer": SensorSheet(rate_hz, 0.4, 0.01, 4912.0), "gyroscope": MPU9250["gyroscope"]}
    return record(spin, np.random.default_rng(2), sheets=sheets, sensors=tuple(sheets), plant="free_spin")


def test_a_free_spin_beyond_the_gyroscope_that_seems_to_quicken_the_other_way_is_unfolded():
    """87 rad/s at 25 readings a second look like -70 rad/s that grow, which no air does."""
    told, truth = beyond_the_gyroscope(25.0, decay=60.0)
    assert unfolding(told) == (1, True)
    found = fusion(told)
    known = np.isfinite(found.rate)
    assert np.mean(known) > 0.9
    assert np.median(np.abs(found.rate[known] - truth.r(found.t[known]))) < np.radians(3.0)


def test_where_two_spins_are_beyond_the_gyroscope_none_of_them_is_told():
    """At 12.5 readings a second 87 and 165 rad/s show the same; the field alone was believed, with 8 rad/s."""
    told, _ = beyond_the_gyroscope(12.5)
    assert unfolding(told) == (0, False)
    assert np.isnan(fusion(told).rate).all()
    with pytest.raises(InputError, match=r"by the limit of the gyroscope it spins faster than 12\.5 readings"):
        estimate(told, "best")


def of_a_field_alone(rate_hz: float, rate: float, decay: float, *others: str):
    """A free spin with a magnetometer of a few readings a second, and perhaps an accelerometer in its place."""
    spin = Spin(rate=rate, decay=decay, decay_change=0.0, duration=7.0, nutation=0.0)
    sheets = {"magnetometer": SensorSheet(rate_hz, 0.4, 0.01, 4912.0), "accelerometer": MPU9250["accelerometer"]}
    sensors = ("magnetometer", *others)
    return record(spin, np.random.default_rng(2), sheets=sheets, sensors=sensors, plant="free_spin")


def test_a_throw_that_seems_to_spin_up_by_a_slow_field_alone_has_no_rate():
    """At 20 readings a second 3900 deg/s show as -3300 that grow: they were told with a deviation of 8."""
    told, _ = of_a_field_alone(20.0, 3900.0, 30.0)
    assert unfolding(told)[1] is False
    assert np.isnan(fusion(told).rate).all()
    with pytest.raises(InputError, match=r"as it would spin up in the air else, .* it spins faster than 20 readings"):
        estimate(told, "best")


def test_an_accelerometer_tells_by_how_much_it_is_folded():
    """Its place is known to a millimetre: the pull alone leaves both 3300 and 3900 deg/s."""
    told, truth = of_a_field_alone(20.0, 3900.0, 30.0, "accelerometer")
    found = estimate(told, "best")
    known = np.isfinite(found.rate)
    assert np.mean(known) > 0.9
    assert np.median(np.abs(found.rate[known] - truth.r(found.t[known]))) < np.radians(20.0)


@pytest.mark.parametrize("seed", range(3))
def test_a_slow_field_that_is_not_folded_is_believed(seed):
    spin = Spin(rate=1500.0, decay=30.0, decay_change=0.0, duration=3.0, nutation=0.0)
    sheets = {"magnetometer": SensorSheet(20.0, 0.4, 0.01, 4912.0)}
    told, truth = record(spin, np.random.default_rng(seed), sheets=sheets, sensors=("magnetometer",), plant="free_spin")
    assert unfolding(told) == (0, True)
    found = estimate(told, "best")
    known = np.isfinite(found.rate)
    assert np.mean(known) > 0.9
    assert np.median(np.abs(found.rate[known] - truth.r(found.t[known]))) < np.radians(20.0)
