"""A slower sensor that a logger wrote again with every row of a faster one is diagnosed by its own readings."""

from dataclasses import replace

import numpy as np
import pytest
from test_prepared import NOISE, RATE, spinning

from discsim.recording import Samples
from discsim.validation.diagnosis.prepared import prepared
from discsim.validation.diagnosis.repeats import fresh


def repeated(samples, every):
    """Readings every so many rows of which each stands on the rows until the next."""
    rows = np.arange(len(samples)) // every * every
    return Samples(samples.t, samples.value[rows])


@pytest.mark.parametrize("every", [2, 4, 10])
def test_readings_that_stand_on_several_rows_are_left_once_at_the_times_of_their_first_rows(every):
    whole = spinning().samples["magnetometer"]
    own, rate, said = fresh("magnetometer", repeated(whole, every))
    np.testing.assert_allclose(own.t, whole.t[::every], atol=1e-9)
    np.testing.assert_array_equal(own.value, whole.value[::every])
    assert rate == pytest.approx(RATE / every)
    assert said.startswith("magnetometer: ")


def test_gaps_among_repeats_stay_out_and_the_readings_beside_them_stay():
    whole = spinning().samples["magnetometer"]
    value = repeated(whole, 4).value.copy()
    value[100:108] = np.nan
    own, rate, _ = fresh("magnetometer", Samples(whole.t, value))
    expected = np.setdiff1d(np.arange(0, len(whole), 4), [100, 104])
    np.testing.assert_allclose(own.t, whole.t[expected], atol=1e-9)
    assert rate == pytest.approx(RATE / 4)


def test_fixes_that_stand_until_the_next_come_at_their_own_rate():
    t = np.arange(0.0, 4.0, 1.0 / RATE)
    fixes = np.column_stack([20.0 * t, 3.0 * t, -t, 20.0 + 0.0 * t, 3.0 + 0.0 * t, -1.0 + 0.0 * t])
    fixes += 0.05 * np.random.default_rng(3).standard_normal(fixes.shape)
    own, rate, _ = fresh("gps", repeated(Samples(t, fixes), 40))
    assert rate == pytest.approx(5.0)
    # of a receiver's own clock a row tells that the fix was there, and the row before that it was not
    assert own.t[0] == 0.0
    np.testing.assert_allclose(own.t, t[::40] - 0.5 / RATE, atol=0.5 / RATE + 1e-9)


def test_a_coarse_sensor_at_rest_repeats_by_chance_and_is_left_as_it_is():
    rng = np.random.default_rng(5)
    for step in (1.0, 3.0):
        t = np.arange(0.0, 5.0, 1.0 / RATE)
        still = Samples(t, step * np.round((np.array([1.3, -0.2, 9.8]) + rng.standard_normal((t.size, 3))) / step))
        same, rate, said = fresh("accelerometer", still)
        assert same is still
        assert rate is None
        assert said == ""


def test_a_diagnosis_takes_the_readings_at_their_own_rate_and_says_so():
    whole = spinning()
    held = replace(whole, samples={**whole.samples, "magnetometer": repeated(whole.samples["magnetometer"], 4)})
    usable, said = prepared([held, spinning(seed=1)], ["01", "02"])
    assert usable[0].sheets["magnetometer"].rate_hz == pytest.approx(RATE / 4)
    assert len(usable[0].samples["magnetometer"]) == len(whole.samples["magnetometer"]) // 4
    assert usable[0].sheets["gyroscope"].noise_rms == NOISE
    (note,) = said
    assert note.startswith("01: magnetometer: its readings stand on 4.03 rows each")
