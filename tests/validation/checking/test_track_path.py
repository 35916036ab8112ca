"""What a track says against what a thrown disc does: units, columns, signs, times and points that are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.disc import Release
from discsim.environment import Environment
from discsim.launch import Launch, released
from discsim.recording import Recording, Samples, SensorSheet
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.paths import path_findings

AIR = Environment(9.81, np.zeros(3), 1.2)
THROW = load_throw("driver")
MIDDLE = 60


def track_of(t, position, release: Release | None = None, rate: float | None = None, wind=(0.0, 0.0, 0.0)):
    return Recording(
        name="seen",
        plant="flight",
        environment=replace(AIR, wind=np.array(wind)),
        samples={"track": Samples(t, position)},
        sheets={"track": SensorSheet(rate or 1.0 / (t[1] - t[0]), 0.02)},
        release=release,
    )


def flown(throw: Release = THROW, disc: str = "driver", wind=(0.0, 0.0, 0.0), hz: float = 30.0, noise: float = 0.02):
    """Return times (n,) and positions (n, 3) of a throw as a camera of noise sees them."""
    body, there = load_disc(disc)[:2]
    flight = predict(body, replace(there, wind=np.array(wind)), throw, rtol=1e-6, atol=1e-6)
    t = np.arange(0.0, flight.end, 1.0 / hz)
    return t, flight.at(t).position + noise * np.random.default_rng(1).standard_normal((t.size, 3))


@pytest.fixture(scope="module")
def seen():
    return flown()


def found(*arguments, **named) -> list[Finding]:
    return list(path_findings(track_of(*arguments, **named)))


@pytest.mark.parametrize("stated", [None, THROW])
@pytest.mark.parametrize("axes", [(1, 1, 1), (1, 1, 0), (1, 0, 1), (0, 0, 1)])
def test_of_a_sound_track_nothing_is_said_whatever_is_seen_of_it(seen, stated, axes):
    t, position = seen
    assert found(t, np.where(axes, position, np.nan), stated) == []


@pytest.mark.parametrize(
    ("words", "disc", "wind"),
    [
        (Launch(3.0, 1.4, 0.3, 0.0, 0.0, 10.0, 0.3), "ultrastar", (0, 0, 0)),  # a hop, nearly straight up
        (Launch(4.0, 0.4, 0.0, 1.57, 0.0, 20.0, 0.2), "ultrastar", (0, -12, 0)),  # a roller, before it lands
        (Launch(24.0, 0.44, 2.0, 2.6, 0.0, 60.0, 2.0), "driver", (0, 0, 0)),  # overhead
        (Launch(40.0, 0.87, 1.0, 0.0, 0.1, 120.0, 1.3), "dd2", (-18, 12, 0)),  # a lob into a gale
        (Launch(24.0, 0.17, 2.4, -1.57, 0.26, 80.0, 2.0), "ultrastar", (18, 0, 0)),  # a disc on edge in a gale
        (Launch(32.0, -0.09, 0.0, 0.0, 0.1, 100.0, 2.5), "cd5", (0, -12, 0)),  # it is thrown down, and floats
    ],
)
@pytest.mark.parametrize("hz", [10.0, 240.0])
def test_of_no_throw_anything_is_said(words, disc, wind, hz):
    throw = released(words)
    t, position = flown(throw, disc, wind, hz)
    for shown in (position, np.where([1, 1, 0], position, np.nan)):
        if t.size > 6:
            assert found(t, shown, throw, wind=wind) == []
            assert found(t, shown, wind=wind) == []


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (100.0, "cm (multiply them by 0.01, or write unit = 'cm'"),
        (1000.0, "mm (multiply them by 0.001, or write unit = 'mm'"),
        (1 / 0.3048, "feet (multiply them by 0.3048, or write unit = 'ft'"),
    ],
)
def test_positions_in_another_unit_are_named_with_the_factor(seen, factor, words):
    [one] = found(seen[0], seen[1] * factor)
    assert (one.id, one.severity) == ("track.speed", "error")
    assert one.what.startswith("north_m goes at")
    assert words in one.remedy


def test_pixels_are_told_with_their_size_where_the_speed_is_stated(seen):
    t, position = seen
    [one] = found(t, 12.0 * position + [0.0, 0.0, 480.0], THROW)
    assert "pixels, by the stated speed 0.08" in one.remedy


def test_feet_that_are_no_faster_than_a_throw_are_told_by_the_stated_speed():
    throw = released(Launch(11.0, 0.2, 0.0, 0.0, 0.0, 50.0, 1.3))
    t, position = flown(throw)
    assert found(t, position, throw) == []
    [one] = found(t, position / 0.3048, throw)
    assert (one.id, one.severity) == ("track.speed", "warning")
    assert "feet" in one.remedy


def test_times_in_frames_and_in_slow_motion_are_named(seen):
    t, position = seen
    [frames] = found(np.arange(t.size) * 1.0, position)
    assert "numbers of frames? Divide them by the camera's frames per second" in frames.remedy
    [stated] = found(np.arange(t.size) * 1.0, position, THROW)
    assert "about 30 by the stated speed" in stated.remedy or "about 29 by" in stated.remedy
    [slow] = found(8.0 * t, position, rate=30.0)
    assert (slow.id, slow.remedy) == (
        "track.duration",
        "rate_hz states 30 Hz: are its times those of slow motion? Divide them by 8",
    )
    t, position = flown(hz=240.0)
    [unstated] = found(8.0 * t, position, THROW)
    assert "slow motion, by 8" in unstated.remedy or "slow motion, by 7." in unstated.remedy


def test_a_height_that_is_positive_upwards_is_an_error(seen):
    t, position = seen
    [one] = found(t, position * [1, 1, -1])
    assert (one.id, one.severity) == ("track.height", "error")
    assert one.remedy.endswith("turn its sign")
    [from_zero] = found(t, (position - position[0]) * [1, 1, -1])
    assert from_zero.id == "track.height"


@pytest.mark.parametrize(("sign", "word"), [(1.0, "as minus a height does"), (-1.0, "as a height does")])
def test_a_height_in_the_east_column_is_named(seen, sign, word):
    t, position = seen
    [one] = found(t, position[:, [0, 2, 1]] * [1, sign, 1])
    assert one.id == "track.axes"
    assert one.what.startswith("east_m begins at")
    assert word in one.what


def test_a_plan_that_sets_out_another_way_than_stated_is_told_with_the_columns_that_would_not(seen):
    t, position = seen
    [swapped] = found(t, position[:, [1, 0, 2]], THROW)
    assert "north_m and east_m exchanged" in swapped.remedy
    [back] = found(t, position * [-1, 1, 1], THROW)
    assert "north_m with the other sign" in back.remedy


def test_a_frame_that_is_mistracked_is_named_with_its_time(seen):
    t, position = seen
    leapt = position.copy()
    leapt[MIDDLE] += [0.0, 6.0, 0.0]
    [one] = found(t, leapt)
    assert (one.id, one.severity) == ("track.leap", "warning")
    assert f"at {t[MIDDLE]:.3f} s" in one.what
    leapt[MIDDLE] = np.nan
    assert found(t, leapt) == []  # the remedy: cells made empty


@pytest.mark.parametrize(
    ("rows", "word"), [(slice(-20, None), "the disc lies"), (slice(0, 20), "before the throw"), (slice(50, 70), "lost")]
)
def test_points_that_stand_are_named(seen, rows, word):
    t, position = seen
    stale = position.copy()
    stale[rows] = stale[rows][0]
    one = found(t, stale)[0]
    assert one.id == "track.still"
    assert "one point in 20 rows" in one.what
    assert word in one.remedy


def test_a_track_that_begins_elsewhere_than_stated_is_told_with_the_way(seen):
    t, position = seen
    [one] = found(t, position + np.array([5.0, 0.0, 0.0]), THROW)
    assert one.id == "track.start"
    assert "north_m by +" in one.what
    [high] = found(t, position - [0.0, 0.0, 430.0])
    assert high.id == "track.origin"
    assert "m above the ground" in high.what
