"""Numbers that stand for failed readings in a folder are told by place and count, and what is left is judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.plain_arrays import recording_from_arrays
from discsim.recording import Recording, Samples, read_recording, write_recording
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.checking import check_recording
from discsim.validation.checking.doubts import mended_flights, reading_doubts
from discsim.validation.checking.failed_readings import failed_findings, without_failed

DISC, AIR = load_disc("driver")
DEG, G0 = np.pi / 180, 9.80665


@pytest.fixture(scope="module")
def throw() -> Recording:
    motion = predict(DISC, AIR, load_throw("driver")).motion()
    module = Instruments.from_parts("mpu9250", "neo_m8n")
    return record(motion, module, np.random.default_rng(3), plant="flight", name="throw", disc=DISC)


def failing(recording: Recording, sensor: str, number, axes=slice(None), every=60) -> Recording:
    """Put a number, or one for each axis, into every so many rows of a sensor."""
    value = np.array(recording.need(sensor).value)
    value[7::every, axes] = number
    return replace(recording, samples={**recording.samples, sensor: Samples(recording.need(sensor).t, value)})


WHOLE = [("magnetometer", -999.0), ("magnetometer", -1.0), ("accelerometer", 65535.0), ("accelerometer", -999 * G0),
         ("gyroscope", -999.0), ("gyroscope", -999 * DEG), ("gyroscope", 32767 * DEG)]  # fmt: skip


@pytest.mark.parametrize("signs", [(1, 1, 1), (1, -1, -1), (-1, -1, 1)])
@pytest.mark.parametrize(("sensor", "number"), WHOLE)
def test_a_number_on_all_axes_is_told_with_place_and_count(throw, sensor, number, signs):
    """As it was or in SI, whichever way round the board lies; a check was silent, or took it for a clipped reading."""
    given = failing(throw, sensor, number * np.array(signs, float))
    (found,) = failed_findings(given)
    rows = len(throw.need(sensor))
    count = len(range(7, rows, 60))
    assert found.severity == "error"
    assert f"on all axes in {count} of {rows} rows amid other readings, the first at" in found.sentence
    left = {one.id for one in check_recording(given).findings} - {one.id for one in check_recording(throw).findings}
    assert left == {f"{sensor}.failed"}


@pytest.mark.parametrize(("sensor", "number"), [*WHOLE[:1], *WHOLE[2:], ("accelerometer", -G0)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_number_on_one_axis_is_told_with_that_axis(throw, sensor, number, axis):
    found = next(iter(failed_findings(failing(throw, sensor, number, axis))))
    column = {"magnetometer": "uT", "accelerometer": "m_s2", "gyroscope": "rad_s"}[sensor]
    assert f"{number:.9g} in {'xy'[axis]}_{column} in " in found.sentence


def test_the_remedy_that_is_told_mends_the_folder(throw, tmp_path):
    write_recording(failing(throw, "magnetometer", -999.0, 1), tmp_path / "throw")
    sentence = check_recording(read_recording(tmp_path / "throw")).advice[0]
    assert "(line 9 of magnetometer.csv)" in sentence
    assert "leave these cells of magnetometer.csv empty" in sentence
    file = tmp_path / "throw" / "magnetometer.csv"
    lines = file.read_text().splitlines()
    assert "-999" in lines[8]
    file.write_text("\n".join(lines).replace("-999.0", "").replace("-999", "") + "\n")
    assert not list(failed_findings(read_recording(tmp_path / "throw")))


def test_a_diagnosis_and_a_fit_are_told_what_a_check_tells(throw):
    given = failing(throw, "gyroscope", -999 * DEG)
    (sentence,) = (one.sentence for one in failed_findings(given))
    assert sentence in reading_doubts([given], ["throw"])
    assert sentence in mended_flights([given], done="fitted")[1]


def test_sound_throws_and_a_sensor_at_rest_have_no_failed_readings(throw):
    assert without_failed(throw) is throw
    t = np.arange(0, 20, 0.01)
    rng = np.random.default_rng(0)
    for bias in (-0.8, 0.0, 0.4):
        # whole deg/s of a gyroscope at rest; tenths of g of a board that is knocked about
        rates = np.round(rng.normal(bias, 0.6, (t.size, 3))) * DEG
        force = rng.normal([0, 0, -1], 0.03, (t.size, 3))
        force[rng.integers(0, t.size, 60)] += rng.normal(0, 1.0, (60, 3))
        for step in (0.1, 0.01):
            readings = {"gyroscope": (t, rates), "accelerometer": (t, np.round(force / step) * step * G0)}
            assert not list(failed_findings(recording_from_arrays(readings)))
