"""Methods by name, and the choice of the best."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators import METHODS, best, estimate
from discsim.estimators.methods import all_methods
from discsim.estimators.notes import clock_notes, folding_notes, sampling_notes
from discsim.recording import Recording, Samples, SensorSheet

SHEETS = {
    "magnetometer": SensorSheet(100.0, 0.6, 0.15, 4912.0),
    "accelerometer": SensorSheet(200.0, 0.08, 0.005, 156.9, position=np.array([-0.0161, 0.0, 0.0])),
    "gyroscope": SensorSheet(200.0, 0.003, 0.001, np.radians(2000.0)),
    "rate_reference": SensorSheet(100.0, 0.0006),
}


def spinning(rate_deg_s, sensors, duration=3.0, plant="rate_table"):
    """A level steady spin as every sensor sees it, with less noise than is looked at: none at all is a dead sensor."""
    rng = np.random.default_rng(1)
    rate = np.radians(rate_deg_s)
    t, fast = np.arange(round(100 * duration)) / 100, np.arange(round(200 * duration)) / 200
    one = np.ones_like(fast)
    values = {
        "magnetometer": Samples(t, np.stack([30 * np.cos(rate * t), -30 * np.sin(rate * t), 0 * t + 39], axis=1)),
        "accelerometer": Samples(fast, np.stack([one * rate**2 * 0.0161, 0 * fast, -9.8 * one], axis=1)),
        "gyroscope": Samples(fast, np.clip(np.outer(one, [0, 0, rate]), -np.radians(2000.0), np.radians(2000.0))),
        "rate_reference": Samples(t, np.full(t.size, rate)),
    }
    values = {name: Samples(v.t, v.value + rng.normal(0.0, 1e-10, v.value.shape)) for name, v in values.items()}
    chosen = {name: values[name] for name in sensors}
    return Recording(plant, "spin", Environment(), sheets={n: SHEETS[n] for n in sensors}, samples=chosen)


@pytest.mark.parametrize("name", ["rate_reference", "gyroscope", "fft", "accelerometer"])
def test_every_method_finds_a_steady_spin_and_bears_its_name(name):
    """6 deg/s is the leakage of the negative frequency for the fft at 1800 deg/s; the others are exact."""
    found = estimate(spinning(1800.0, SHEETS), name)
    assert found.method == name
    np.testing.assert_allclose(np.degrees(found.rate), 1800.0, atol=8.0 if name == "fft" else 1e-6)


@pytest.mark.parametrize(
    ("rate", "sensors", "expected"),
    [
        (4000.0, SHEETS, "rate_reference"),
        (4000.0, ("magnetometer", "accelerometer", "gyroscope"), "fusion"),
        (1800.0, ("accelerometer", "gyroscope"), "gyroscope"),
        (4000.0, ("accelerometer", "gyroscope"), "accelerometer_calibrated"),
        (300.0, ("magnetometer", "accelerometer"), "fusion"),
    ],
)
def test_the_best_is_the_first_that_knows_the_rate(rate, sensors, expected):
    """A clipped gyroscope gives way."""
    recording = spinning(rate, sensors)
    order = [name for name in METHODS if name in ("rate_reference", "fusion", "gyroscope", "fft", "accelerometer")]
    assert order == ["rate_reference", "fusion", "gyroscope", "fft", "accelerometer"]
    assert best(recording).method == expected


def test_where_nothing_can_be_used_each_reason_is_given():
    with pytest.raises(InputError, match=r"gyroscope: no gyroscope.*a window needs 128 samples"):
        best(spinning(4000.0, ("magnetometer",), duration=0.1))


def test_an_unknown_name_is_answered_with_those_there_are():
    with pytest.raises(InputError, match=r"no method 'ftt'; expected one of best, .*fft"):
        estimate(spinning(4000.0, SHEETS), "ftt")


def test_a_missing_sensor_is_named():
    with pytest.raises(InputError, match="needs magnetometer samples; this recording has gyroscope"):
        estimate(spinning(4000.0, ("gyroscope",)), "fft")


def test_the_accelerometer_knows_less_in_flight_than_on_a_table():
    """There the body's own acceleration turns with the spin."""
    on_table = estimate(spinning(4000.0, ("accelerometer",)), "accelerometer")
    in_flight = estimate(spinning(4000.0, ("accelerometer",), plant="free_spin"), "accelerometer")
    assert in_flight.sd[0] > 1.5 * on_table.sd[0]


def test_time_stamps_that_contradict_the_sheet_are_noted():
    recording = spinning(4000.0, ("gyroscope", "rate_reference"))
    assert sampling_notes(recording) == []
    slow = Samples(recording.need("gyroscope").t * 1.04, recording.need("gyroscope").value)
    off = Recording("rate_table", "x", Environment(), sheets=recording.sheets, samples={"gyroscope": slow})
    assert sampling_notes(off) == [
        "gyroscope: time stamps say 192.3 Hz, rate_hz of recording.toml 200 Hz; the stamps are used"
    ]


@pytest.mark.parametrize("sensor", ["rate_reference", "gyroscope", "accelerometer"])
def test_a_spin_that_folds_is_named_with_what_the_field_shows(sensor):
    """20000 deg/s at 100 Hz: 200 deg from sample to sample look like 160 deg the other way."""
    recording = spinning(20000.0, ("magnetometer", sensor))
    found = estimate(recording, "fft")
    np.testing.assert_allclose(np.degrees(found.rate), 16000.0, atol=8.0)  # leakage of its mirror
    wide = {name: SensorSheet(sheet.rate_hz, position=sheet.position) for name, sheet in SHEETS.items()}
    samples = dict(recording.samples)
    if sensor == "gyroscope":
        t = np.arange(600) / 200
        samples[sensor] = Samples(t, np.outer(np.ones(t.size), [0, 0, np.radians(20000.0)]))
    recording = Recording("rate_table", "x", Environment(), sheets=wide, samples=samples)
    (note,) = folding_notes(recording)
    assert note.startswith(f"{sensor}: ")
    assert "above half the magnetometer's sampling rate (18000 deg/s)" in note
    if sensor != "accelerometer":  # whose mount is known to two standard deviations, 4 % of the rate
        assert note.endswith("20000 deg/s for 100 % of its readings, above half the magnetometer's sampling rate "
                             "(18000 deg/s); fft and likelihood see it folded, as 16000 deg/s")  # fmt: skip


def test_a_spin_within_half_the_sampling_rate_is_no_matter_for_a_note():
    assert folding_notes(spinning(7000.0, SHEETS)) == []
    assert folding_notes(spinning(7000.0, ("gyroscope",))) == []


def test_the_fft_is_silent_where_a_gyroscope_shows_no_steady_spin_about_z():
    """The same field, which alone looks like a spin: the body turns half of the time about x at the same rate."""
    steady = spinning(1500.0, ("magnetometer", "gyroscope"))
    assert np.isfinite(estimate(steady, "fft").rate).all()
    rates = steady.samples["gyroscope"].value.copy()
    across = steady.samples["gyroscope"].t >= 1.5
    rates[across] = rates[across][:, [2, 0, 1]]
    wandering = replace(steady, samples={**steady.samples, "gyroscope": Samples(steady.samples["gyroscope"].t, rates)})
    found = estimate(wandering, "fft")
    # the square of the mean about z is half of the whole where sqrt(1/2) of the window turns about z
    silent = found.t > 1.5 + 1.28 * (0.5 - np.sqrt(0.5)) + 0.02
    assert np.isnan(found.rate[silent]).all()
    assert np.isfinite(found.rate[found.t < 1.5 + 1.28 * (0.5 - np.sqrt(0.5)) - 0.02]).all()


def test_all_methods_say_why_the_fft_is_silent_on_a_body_that_tumbles():
    steady = spinning(1500.0, ("magnetometer", "gyroscope"))
    turned = Samples(steady.samples["gyroscope"].t, steady.samples["gyroscope"].value[:, [2, 0, 1]])
    _, left_out = all_methods(replace(steady, samples={**steady.samples, "gyroscope": turned}))
    assert "no steady spin about z" in left_out["fft"]


def test_a_gyroscope_that_the_magnetometer_contradicts_is_not_stated_closer_than_they_differ():
    """Rows 20 % further apart than their stamps say: which of the two is right nothing tells."""
    recording = spinning(1800.0, ("magnetometer", "gyroscope"))
    field = recording.need("magnetometer")
    slow = replace(recording, samples={**recording.samples, "magnetometer": Samples(field.t / 1.2, field.value)})
    alike, apart = best(recording), best(slow)
    assert (alike.method, apart.method) == ("fusion", "gyroscope")
    assert np.all(np.degrees(alike.sd) < 1.0)
    assert np.all(np.degrees(apart.sd) > 0.9 * 0.2 * 1800.0)


@pytest.mark.parametrize("rows", [1, 2])
def test_a_reading_or_two_of_a_gyroscope_without_stated_noise_are_no_estimate(rows):
    whole = spinning(1800.0, ("gyroscope",))
    gyroscope = whole.need("gyroscope")
    short = Samples(gyroscope.t[:rows], gyroscope.value[:rows] + np.arange(rows)[:, None])
    bare = replace(SHEETS["gyroscope"], noise_rms=None)
    recording = replace(whole, samples={"gyroscope": short}, sheets={"gyroscope": bare})
    with pytest.raises(InputError, match=r"show no noise; expected 3 at least, or noise_rms_rad_s"):
        best(recording)
    assert best(replace(recording, sheets=SHEETS)).method == "gyroscope"


def test_what_the_sampling_rate_is_stated_to_be_off_by_is_in_every_rate_from_the_field():
    """2 % of the rows' spacing is 2 % of a rate that is a turning over time, and nothing of a gyroscope's."""
    whole = spinning(1800.0, ("magnetometer", "gyroscope"))
    sheet = replace(SHEETS["magnetometer"], sigma={"rate_hz": 2.0})
    rates, _ = all_methods(replace(whole, sheets={**whole.sheets, "magnetometer": sheet}))
    for found in rates:
        by_the_clock = found.method != "gyroscope"
        assert (np.degrees(np.nanmedian(found.sd)) > 0.02 * 1790.0) == by_the_clock, found.method
    assert {found.method for found in rates} == {"fusion", "gyroscope", "tracking", "likelihood", "fft"}


def test_a_sampling_rate_that_is_not_known_well_is_noted():
    whole = spinning(1800.0, ("magnetometer",))
    sheet = replace(SHEETS["magnetometer"], sigma={"rate_hz": 4.0})
    (line,) = sampling_notes(replace(whole, sheets={"magnetometer": sheet}))
    assert line.startswith("the spacing of the rows is known to 4 % only: rates from the field scale with it")
    assert sampling_notes(whole) == []


def test_stamps_of_whole_milliseconds_do_not_contradict_the_rate_that_is_their_mean():
    """Rows of 12.4 ms are stamped 12, 12, 13: their median says 83.3 Hz, their mean the true 80.6 Hz."""
    t = np.round(0.0124 * np.arange(300), 3)
    lost = np.delete(t, slice(100, 140))
    sheets = {"gyroscope": SensorSheet(1 / 0.0124)}
    for stamps, gaps in ((t, 0), (lost, 1)):
        samples = {"gyroscope": Samples(stamps, np.zeros((stamps.size, 3)))}
        made = Recording("free_spin", "x", Environment(), sheets=sheets, samples=samples)
        notes = sampling_notes(made)
        assert len(notes) == gaps, notes
        assert not any("rate_hz" in note for note in notes)


def as_if_rows_were(whole, factor, sigma):
    """Return a recording whose stamps are off by a factor, with a magnetometer that is stated to be so unsure."""
    samples = {name: Samples(factor * one.t, one.value) for name, one in whole.samples.items()}
    sheets = {name: replace(sheet, rate_hz=sheet.rate_hz / factor) for name, sheet in whole.sheets.items()}
    rate = sheets["magnetometer"].rate_hz
    sheets["magnetometer"] = replace(sheets["magnetometer"], sigma={"rate_hz": sigma * rate} if sigma else {})
    return replace(whole, samples=samples, sheets=sheets)


def test_the_spacing_that_explains_a_gyroscope_is_that_of_the_logs_rows_not_of_a_slower_magnetometer():
    """Rows of 5 ms that are taken as 10: the magnetometer, of every second row, seems to have 20."""
    whole = spinning(1800.0, ("magnetometer", "gyroscope"))
    assert clock_notes(whole) == []
    (note,) = clock_notes(as_if_rows_were(whole, 2.0, 0.7))
    assert "rows of 5 ms, where they were taken as 10 ms (a reading of the magnetometer every 2 rows)" in note


def test_a_spacing_known_roughly_is_named_from_where_the_gyroscope_shows_that_it_is_off():
    """3 % may be a gyroscope's scale where time stamps say the spacing, and is the spacing where that was guessed."""
    whole = spinning(1800.0, ("magnetometer", "gyroscope"))
    gyroscope = whole.samples["gyroscope"]
    # rows that come late, which no calibration takes up: then the two contradict one another
    uneven = gyroscope.value * (1 + 0.006 * np.sin(np.linspace(0, 25, len(gyroscope))))[:, None]
    whole = replace(whole, samples=whole.samples | {"gyroscope": Samples(gyroscope.t, uneven)})
    (note,) = clock_notes(as_if_rows_were(whole, 1.03, 0.04))
    assert re.search(r"the gyroscope turns 1\.03\d times as fast as the field, always \(within 0\.00\d\)", note)
    assert re.search(r"rows of (4\.9\d*|5(\.0\d*)?) ms, where they were taken as 5\.15 ms", note)
    assert clock_notes(as_if_rows_were(whole, 1.03, 0.0)) == []


def test_fft_says_that_gaps_leave_it_no_window():
    """Every fiftieth reading lost at 100 Hz: it was said that --threshold looks lower, for a spin of 2000 deg/s."""
    whole = spinning(2000.0, ("magnetometer",))
    field = whole.samples["magnetometer"]
    kept = np.arange(len(field)) % 50 != 0
    value = field.value + np.random.default_rng(2).normal(0.0, 0.6, field.value.shape)
    gappy = replace(whole, samples={"magnetometer": Samples(field.t[kept], value[kept])})
    _, left_out = all_methods(gappy)
    assert "no window of 128 samples is without gaps" in left_out["fft"]
    assert "at most 49 come on end" in left_out["fft"]
    assert "--threshold" not in left_out["fft"]
