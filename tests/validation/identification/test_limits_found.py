"""A sensor that clips below its stated range says nothing of motions beyond where its readings stand."""

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, FIELD

from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.identification.observations import readings_of

LIMIT, RANGE = 34.9, 104.72


def spun(clip_at: float, stated: float | None) -> Recording:
    """A disc whose spin decays through a gyroscope's limit."""
    t = np.arange(0.0, 3.0, 0.005)
    rates = np.column_stack([0.3 * np.sin(50.0 * t), 0.3 * np.cos(50.0 * t), 50.0 * np.exp(-0.3 * t)])
    rates += 0.01 * np.random.default_rng(0).standard_normal(rates.shape)
    sheet = SensorSheet(200.0, 0.01, range=stated)
    samples = {"gyroscope": Samples(t, np.clip(rates, -clip_at, clip_at))}
    return Recording("free_spin", "spin", FIELD, disc=DRIVER, sheets={"gyroscope": sheet}, samples=samples)


@pytest.mark.parametrize("stated", [RANGE, None])
def test_a_limit_below_the_range_is_where_readings_stand(stated):
    (readings,) = readings_of(spun(LIMIT, stated))
    assert readings.limit == pytest.approx(LIMIT)
    at = readings.value[:, 2] >= LIMIT - 1e-9
    assert 0.3 < np.mean(at) < 0.7
    np.testing.assert_array_equal(readings.clipped[:, 2], at)
    assert not np.any(readings.good[at, 2])


def test_a_sensor_that_is_within_its_range_has_the_range_for_a_limit():
    (readings,) = readings_of(spun(RANGE, RANGE))
    assert readings.limit == RANGE
    assert np.all(readings.good)
    bare = spun(RANGE, None)
    (readings,) = readings_of(replace(bare, name="bare"))
    assert readings.limit is None
