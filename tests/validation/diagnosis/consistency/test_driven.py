"""Bodies that a hand turns: what rates and field say of iron and lateness, and what is said where nothing can be."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.made import FIELD

from discsim.arrays import FloatArray
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.diagnosis.consistency.driven import turning_of
from discsim.validation.diagnosis.consistency.turned_field import turned_field

RATE = 100.0


def by_hand(
    iron: tuple[float, float, float] = (0.0, 0.0, 0.0), late: float = 0.0, moving: float = 0.0, seconds: float = 16.0
) -> Recording:
    """A body that a hand turns about all axes, as the sensors on it read it, finely integrated.

    ``iron`` (uT) turns with it, the magnetometer is ``late`` (s), and the field about it sways by ``moving`` uT.
    """
    fine = np.arange(0.0, seconds, 1.0 / 2000.0)
    w = np.column_stack([3.0 * np.sin(1.7 * fine + k) + 2.0 * np.cos(0.9 * fine * (k + 1)) for k in range(3)])
    q = Rotation.identity()
    places, step, turned = np.arange(0, fine.size, 20), 1.0 / 2000.0, []
    for k in range(fine.size):
        if k % 20 == 0:
            turned.append(q.as_quat())
        q = q * Rotation.from_rotvec(step * w[k])
    t = fine[places]
    swaying = moving * np.column_stack((np.sin(3.0 * t), np.cos(5.0 * t), np.sin(2.0 * t)))
    field = Rotation.from_quat(np.array(turned)).inv().apply(FIELD.magnetic_field + swaying)
    rng = np.random.default_rng(3)
    seen = np.column_stack([np.interp(t - late, t, column) for column in field.T]) + np.array(iron)
    samples = {
        "magnetometer": Samples(t, seen + 0.2 * rng.standard_normal(seen.shape)),
        "gyroscope": Samples(t, w[places] + 0.005 * rng.standard_normal(seen.shape)),
    }
    sheets = {"magnetometer": SensorSheet(RATE), "gyroscope": SensorSheet(RATE)}
    return Recording("free_spin", "hand", FIELD, None, None, None, sheets, samples)


def found_in(recording: Recording) -> dict[str, tuple[FloatArray, FloatArray]]:
    """By effect: its numbers and their standard deviations."""
    told = turned_field(recording)
    assert told is not None
    return {
        one.id: (
            np.array([v.value for v in one.parameters.values()]),
            np.array([v.sd for v in one.parameters.values()]),
        )
        for one in told.found
    }


def test_iron_and_lateness_are_found_in_a_body_that_a_hand_turns():
    found = found_in(by_hand((20.0, -12.0, 5.0), 0.02))
    assert set(found) == {"mag.hard_iron", "mag.time_offset"}
    iron, sd = found["mag.hard_iron"]
    assert np.all(np.abs(iron - (20.0, -12.0, 5.0)) < np.maximum(3.0 * sd, 0.1))
    assert found["mag.time_offset"][0][0] == pytest.approx(0.02, abs=1e-3)


def test_sensors_that_agree_are_said_to_and_nothing_is_made_up():
    recording = by_hand()
    told = turned_field(recording)
    assert told is not None
    assert not told.holds
    assert "agree on how it turns" in told.text
    assert "no constant iron" not in told.text


def test_a_field_that_sways_is_no_iron():
    told = turned_field(by_hand(moving=25.0))
    assert told is not None
    assert not told.holds
    assert "the field around it changes" in told.text


def test_a_body_that_speeds_up_is_driven_and_its_lone_sensor_says_so():
    t = np.arange(0.0, 10.0, 0.01)
    rate = np.column_stack((0.1 * np.sin(t), 0.1 * np.cos(t), 2.0 * t))
    sheet, samples = {"gyroscope": SensorSheet(100.0)}, {"gyroscope": Samples(t, rate)}
    wheel = Recording("free_spin", "wheel", FIELD, None, None, None, sheet, samples)
    driven, alone = turning_of([wheel], ["wheel"]).sentences
    assert driven.startswith("Something drives this body: its rate grows from 0.2")
    assert alone.startswith("The gyroscope alone shows how the body turns")
    free = Samples(t, rate[::-1].copy())
    assert (
        len(
            turning_of(
                [Recording("free_spin", "s", FIELD, None, None, None, sheet, {"gyroscope": free})], ["s"]
            ).sentences
        )
        == 1
    )


def test_a_body_that_hardly_turns_shows_neither_iron_nor_agreement():
    t = np.arange(0.0, 5.0, 0.01)
    still = {"gyroscope": Samples(t, np.full((500, 3), 1e-3)), "magnetometer": Samples(t, np.full((500, 3), 30.0))}
    sheets = dict.fromkeys(still, SensorSheet(100.0))
    assert turned_field(Recording("free_spin", "still", FIELD, None, None, None, sheets, still)) is None
