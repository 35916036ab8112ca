"""What is doubtful before flights are fitted: setup faults are mended, numbers that cannot be are told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.effects import effect
from discsim.recording import Recording, Samples
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.checking import check_recording
from discsim.validation.checking.doubts import mended_flights, reading_doubts
from discsim.validation.diagnosis.diagnosed import diagnose_recordings
from discsim.written import as_written

DISC, AIR = load_disc("driver")
POSITION, VELOCITY = slice(0, 3), slice(3, 6)


@pytest.fixture(scope="module")
def throws() -> list[Recording]:
    motion = predict(DISC, AIR, load_throw("driver")).motion()
    module = Instruments.from_parts("mpu9250", "neo_m8n")
    return [
        record(motion, module, np.random.default_rng(seed), plant="flight", name=f"throw-{seed}", disc=DISC)
        for seed in range(2)
    ]


def with_path(recording: Recording, change) -> Recording:
    gps = recording.need("gps")
    value = np.array(gps.value)
    change(value)
    return replace(recording, samples={**recording.samples, "gps": Samples(gps.t, value)})


def scaled(columns: slice, factor: float):
    def change(value):
        value[:, columns] *= factor

    return change


def exchanged(value):
    value[:] = value[:, [1, 0, 2, 4, 3, 5]]


def test_sound_flights_come_back_as_they_are_and_nothing_is_said(throws):
    mended, said = mended_flights(throws, done="fitted")
    assert said == ()
    for before, after in zip(throws, mended, strict=True):
        assert all(after.samples[name] is samples for name, samples in before.samples.items())


def test_east_and_north_exchanged_are_put_right_aloud(throws):
    mended, (said,) = mended_flights([with_path(one, exchanged) for one in throws], done="fitted")
    assert said.startswith("the GPS's columns north, east, down hold east, north, down")
    assert said.endswith("fitted are the readings so corrected")
    np.testing.assert_array_equal(mended[0].need("gps").value, throws[0].need("gps").value)


@pytest.mark.parametrize(
    ("columns", "factor", "words"),
    [
        (POSITION, 100.0, "the position in cm?"),
        (POSITION, 1 / 0.3048, "the position in feet?"),
        (VELOCITY, 3.6, 'the velocity in km/h?; then write velocity_unit = "km/h" below [sensors.gps]'),
        (VELOCITY, 1 / 0.514444, 'the velocity in knots?; then write velocity_unit = "kn" below'),
        (VELOCITY, 1000.0, "the velocity in mm/s"),
        (POSITION, 9.0, "one of the two is in another unit"),
    ],
)
def test_positions_and_velocities_in_units_that_do_not_belong_together_are_told(throws, columns, factor, words):
    (found,) = (one for one in check_recording(with_path(throws[0], scaled(columns, factor))).findings
                if one.where == "gps")  # fmt: skip
    assert (found.id, found.severity) == ("gps.unit", "error")
    assert words in found.sentence


def test_a_stated_number_that_cannot_be_is_told_once_and_of_some_throws_with_their_names(throws):
    heavy = [replace(one, disc=replace(DISC, mass=179.0)) for one in throws]
    _, (said,) = mended_flights(heavy, done="fitted")
    assert said.startswith("[disc]: mass_kg is 179; expected 0.08 to 0.22 kg")
    _, (said,) = mended_flights([throws[0], heavy[1]], done="fitted")
    assert said.startswith("throw-1: [disc]: mass_kg is 179")
    assert mended_flights(heavy, done="fitted", passed=("disc.mass",))[1] == ()


def test_a_diagnosis_says_of_a_path_what_a_check_says_once_for_all_recordings(throws):
    """A user who went straight to the diagnosis got no word of positions in another unit."""
    wrong = 2 * [with_path(throws[0], scaled(POSITION, 1 / 0.3048))]
    (sentence,) = reading_doubts(wrong, ["a", "b"])
    assert "the position in feet?" in sentence
    assert sentence in [one.sentence for one in check_recording(wrong[0]).findings]
    assert reading_doubts([wrong[0], throws[1]], ["a", "b"]) == (f"a: {sentence}",)
    assert reading_doubts(throws, ["a", "b"]) == ()


def test_a_diagnosis_says_of_a_stated_number_what_a_check_says(throws):
    """A mass in grams came out as physics that no effect accounts for, without a word of it."""
    heavy = [replace(one, disc=replace(DISC, mass=179.0)) for one in throws]
    (said,) = reading_doubts(heavy, ["a", "b"])
    assert said == "[disc]: mass_kg is 179; expected 0.08 to 0.22 kg; that is a disc in grams: write 0.179"
    assert reading_doubts([throws[0], heavy[1]], ["a", "b"]) == (f"b: {said}",)


def test_what_a_path_is_doubted_for_is_among_the_warnings_of_a_diagnosis(throws):
    short = {name: throws[0].need(name).between(0.0, 2.0) for name in ("gyroscope", "gps")}
    wrong = [with_path(replace(throws[0], samples=short), scaled(POSITION, 1 / 0.3048))]
    found = diagnose_recordings(wrong)
    assert found.doubts == reading_doubts(wrong, ["recordings"])
    assert found.doubts
    assert found.diagnosis.warnings[: len(found.doubts)] == found.doubts


def test_of_a_path_in_another_unit_of_time_its_times_alone_are_told(throws):
    late = [as_written(one, [effect("clock.units", written_in="ms")]) for one in throws]
    assert reading_doubts(late, ["a", "b"]) == ()
