"""Tracks that run on after the touch-down or begin with points that stand still: what is cut, and what never is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, FIELD

from discsim.arrays import FloatArray
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.diagnosis.prepared import prepared
from discsim.validation.diagnosis.track_ends import flight_of

FRAME = 1.0 / 30.0


def plan(t: FloatArray, scatter: float = 0.02, seed: int = 0) -> Samples:
    """A disc that flies from 0.5 to 6.0 s, slowed from 22 to 9 m/s, and stands still before and after."""
    flown = np.clip(t - 0.5, 0.0, 5.5)
    x = 22.0 * flown - 1.2 * flown**2
    true = np.column_stack((x, 0.02 * flown**3, np.full(t.size, np.nan)))
    return Samples(t, true + scatter * np.random.default_rng(seed).standard_normal(true.shape))


def test_what_stands_still_before_and_after_the_flight_is_cut():
    cut = flight_of(plan(np.arange(0.0, 7.5, FRAME)), 0.02)
    assert cut.before == pytest.approx(0.5, abs=3.0 * FRAME)
    assert cut.after == pytest.approx(7.47 - 6.0, abs=3.0 * FRAME)
    assert cut.flight.t[0] == pytest.approx(cut.before)


@pytest.mark.parametrize("scatter", [0.005, 0.1, 0.5])
def test_a_flight_is_never_cut(scatter):
    """Whether or not its speeds can be told."""
    t = np.arange(0.5, 6.0, FRAME)
    for seed in range(20):
        track = plan(t, scatter, seed)
        assert flight_of(track, scatter).flight is track


def test_a_slide_after_the_touch_down_is_cut():
    """Half as fast from one frame to the next: no air does that."""
    t = np.arange(0.0, 4.3, FRAME)
    x = np.where(t < 4.0, 14.0 * t, 56.0 + 7.0 * (t - 4.0))
    cut = flight_of(Samples(t, np.column_stack((x, 0.0 * t, np.full(t.size, np.nan)))), 0.02)
    assert cut.before == 0.0
    assert cut.flight.t[-1] == pytest.approx(4.0, abs=2.0 * FRAME)


def test_a_diagnosis_says_what_it_cuts_and_counts_time_from_the_release():
    track = plan(np.arange(0.0, 7.5, FRAME))
    sheets, samples = {"track": SensorSheet(30.0, 0.02)}, {"track": track}
    recording = Recording("flight", "throw", FIELD, DRIVER, None, None, sheets, samples)
    (used,), notes = prepared([recording], ["throw"])
    assert used.need("track").t[0] == 0.0
    assert used.need("track").t[-1] == pytest.approx(5.5, abs=5.0 * FRAME)
    (note,) = [one for one in notes if "is cut" in one]
    assert "before the disc moves (time counts from there)" in note
    assert "too slow to fly" in note


def test_where_another_sensor_tells_the_release_its_time_stays():
    track = plan(np.arange(0.0, 6.0, FRAME))
    fixes = np.random.default_rng(1).standard_normal((60, 6))
    recording = Recording(
        "flight", "throw", FIELD, DRIVER, None, None,
        {"track": SensorSheet(30.0, 0.02), "gps": SensorSheet(10.0, 1.0, velocity_noise_rms=1.0)},
        {"track": track, "gps": Samples(np.arange(60) * 0.1, fixes)},
    )  # fmt: skip
    (used,), notes = prepared([recording], ["throw"])
    assert used.need("track").t[0] == pytest.approx(0.5, abs=3.0 * FRAME)
    assert not any("time counts" in note for note in notes)
    assert replace(used, samples={}).end == 0.0


def test_a_track_that_holds_the_height_is_turned_over_aloud_and_one_that_counts_downwards_is_not():
    t = np.arange(0.0, 3.0, FRAME)
    height = 1.3 + 5.6 * t - 2.0 * t**2
    north, east = 15.0 * t - t**2, 0.2 * t**2
    for down, count in ((height, 1), (-height, 0)):
        track = Samples(t, np.column_stack([north, east, down]))
        flight = Recording(
            "flight",
            "throw",
            FIELD,
            disc=DRIVER,
            sheets={"track": SensorSheet(30.0, 0.02)},
            samples={"track": track},
        )
        (usable,), said = prepared([flight], ["01"])
        np.testing.assert_allclose(usable.samples["track"].value[:, 2], -height)
        assert sum("positive upwards" in one for one in said) == count
