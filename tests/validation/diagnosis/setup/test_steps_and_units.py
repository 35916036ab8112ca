"""What the steps between a lone sensor's readings tell of its unit: their exact size, and no more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.environment import Environment
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.diagnosis.setup.units import sensor_units

STEP = 0.0010653  # rad/s: 16 bits over 2000 deg/s, as sheets round it


def spinning(count: int = 1000, resolution: float = STEP) -> Recording:
    """A gyroscope alone that reads 68 rad/s, in whole steps."""
    rng = np.random.default_rng(4)
    t = np.arange(count) / 200.0
    spin = np.column_stack([0.4 * np.cos(9.0 * t), 0.4 * np.sin(9.0 * t), 68.0 - 0.9 * t])
    value = np.round((spin + 0.004 * rng.standard_normal(spin.shape)) / STEP) * STEP
    sheets = {"gyroscope": SensorSheet(200.0, 0.004, resolution, 80.0)}
    return Recording("free_spin", "x", Environment(), sheets=sheets, samples={"gyroscope": Samples(t, value)})


def read_as(recording: Recording, change) -> Recording:  # type: ignore[no-untyped-def]
    samples = recording.samples["gyroscope"]
    return replace(recording, samples={"gyroscope": Samples(samples.t, change(samples.value))})


@pytest.mark.parametrize(("unit", "factor"), [("deg/s", 180.0 / np.pi), ("rpm", 30.0 / np.pi)])
def test_steps_that_are_a_units_own_tell_it(unit, factor):
    (found,) = sensor_units([read_as(spinning(), lambda value: factor * value)])
    assert found.value.written_in == unit


@pytest.mark.parametrize(
    "recording",
    [
        pytest.param(read_as(spinning(), lambda value: np.round(value, 2)), id="two decimals"),
        pytest.param(read_as(spinning(), lambda value: np.round(value, 1)), id="one decimal"),
        pytest.param(spinning(resolution=STEP / 10.0), id="a resolution stated ten times too fine"),
        pytest.param(spinning(count=20), id="twenty readings"),
    ],
)
def test_rounding_and_a_few_readings_tell_none(recording):
    """Steps near ten times the stated ones were taken for rpm: the spin came out 9.5 times too slow."""
    assert sensor_units([recording]) == []
