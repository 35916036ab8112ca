"""What a sensor senses of a motion, and how its readings follow the motion's neighbours."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.effects.catalogue import CATALOGUE
from discsim.validation.identification.sensitivities import (
    MOTION,
    followed,
    readings_and_slopes,
    readings_of_neighbours,
)
from discsim.validation.identification.sensor_model import predicted, sensed
from tests.support.made import throws

SENSORS = ("magnetometer", "accelerometer", "gyroscope", "gps", "rate_reference", "track")


def values_of_every_error(sensor: str) -> dict[tuple[str, str], float]:
    """Return values with every error of a sensor that a fit can move, at its usual size."""
    some = {}
    for row in CATALOGUE.values():
        if row.acts_on in (sensor, "board") and row.fitted_scale and not row.moves_time and not row.hides_readings:
            some |= {(row.id, name): row.fitted[name] + row.fitted_scale[name] for name in row.fitted}
    return some


def rows_of_motion(count: int) -> np.ndarray:
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(count, 19)) * np.repeat([5.0, 10.0, 5.0, 1.0, 30.0, 100.0], [3, 3, 3, 4, 3, 3])
    rows[:, 2] = -np.abs(rows[:, 2]) - 0.5
    rows[:, 9:13] /= np.linalg.norm(rows[:, 9:13], axis=1)[:, None]
    return rows


@pytest.mark.parametrize("plant", ["flight", "free_spin"])
@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("errors", [True, False])
def test_a_sensor_senses_nothing_but_what_it_says(sensor, plant, errors):
    """What is not among what it senses changes no reading, where the motion can change it at all."""
    made = throws(seconds=0.2, plant=plant)[0]
    values = values_of_every_error(sensor) if errors else {}
    rows, t = rows_of_motion(12), np.linspace(0.1, 1.0, 12)
    if plant == "free_spin":
        rows[:, :9] = 0.0  # it has no path

    def read(asked):
        return predicted(sensor, made, values, t, asked)

    _, slopes = readings_and_slopes(read, MOTION, rows)
    told = sensed(sensor, made, values)
    assert set(told) <= set(MOTION)
    free = {"position", "velocity", "acceleration", *(["attitude"] if sensor != "magnetometer" else [])}
    for k, name in enumerate(MOTION):
        if plant == "free_spin" and name in free:
            continue
        size = np.max(np.abs(slopes[:, :, 3 * k : 3 * k + 3]))
        assert (name in told) or size == 0.0, name


@pytest.mark.parametrize("central", [True, False])
def test_readings_follow_neighbours_as_they_are_read(central):
    made = throws(seconds=0.2)[0]
    values = values_of_every_error("accelerometer")
    base, t = rows_of_motion(9), np.linspace(0.1, 1.0, 9)
    rng = np.random.default_rng(3)
    spans = np.array([1e-4, 2e-4, 1e-5])
    move = rng.normal(size=(3, 9, 19)) * spans[:, None, None]
    rows = np.concatenate([base[None], base + move, base - move] if central else [base[None], base + move])
    rows[:, :, 9:13] /= np.linalg.norm(rows[:, :, 9:13], axis=2)[:, :, None]
    rows[1, 4, 9:13] *= -1.0  # the same attitude
    place = np.array([0, 3, 4, 8])
    for sensor in ("accelerometer", "magnetometer", "gyroscope"):
        senses = sensed(sensor, made, values)

        def read(asked, sensor=sensor):
            return predicted(sensor, made, values, t[place], asked)

        ideal, slopes = readings_and_slopes(read, senses, base[place])
        follows = followed(slopes, senses, rows, place, 2.0 * spans if central else spans, central)
        shown = predicted(sensor, made, values, t, rows)[:, place]
        np.testing.assert_allclose(ideal, shown[0], rtol=1e-12, atol=1e-12)
        wanted = (
            (shown[1:4] - shown[4:]) / (2.0 * spans)[:, None, None]
            if central
            else ((shown[1:] - shown[0]) / spans[:, None, None])
        )
        wanted = np.moveaxis(wanted, 0, 2)
        np.testing.assert_allclose(follows, wanted, rtol=1e-3, atol=1e-3 * np.abs(wanted).max())
        # neighbours that are fewer than what is sensed are read, each of them
        told = 2.0 * spans if central else spans
        read_each = readings_of_neighbours(read, MOTION, rows, place, told, central)
        np.testing.assert_allclose(read_each[1], wanted, rtol=1e-12, atol=1e-12 * np.abs(wanted).max())
