"""Is what is left noise: silent on noise of any level and first-order correlation, loud on physics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_noise import coloured, rows

from discsim.arrays import FloatArray
from discsim.validation.identification.noise import estimate_noise
from discsim.validation.identification.residual_tests import UnmodelledResidual, loudest, unmodelled_residuals

N, AXES, RECORDINGS = 600, 3, 4


def left(residuals: list[FloatArray]) -> list[UnmodelledResidual]:
    """What remains of the residuals of recordings of a three-axis sensor, the noise estimated from them."""
    linears = [rows(*[("gyroscope", N)] * AXES) for _ in residuals]
    return unmodelled_residuals(linears, residuals, estimate_noise(linears, residuals))


def noise(seed: int, sd: float = 1.0, phi: float = 0.0) -> list[FloatArray]:
    rng = np.random.default_rng(seed)
    return [np.concatenate([coloured(rng, N, sd, phi) for _ in range(AXES)]) for _ in range(RECORDINGS)]


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.95])
def test_noise_of_any_level_and_memory_is_noise(phi: float):
    """A false alarm in one of a hundred data sets is allowed, and this test would see one in fifty."""
    for seed in range(100):
        assert left(noise(seed, 0.37, phi)) == []


def test_a_transient_before_the_instant_asked_is_neither_a_band_nor_a_window():
    """What a wobble just after release leaves stands in a window and in a band; later it is told in both."""
    burst = np.where(np.arange(N) < 40, 8.0 * np.sin(0.8 * np.arange(N)), 0.0)
    linears = [rows(*[("gyroscope", N)] * AXES) for _ in range(RECORDINGS)]
    residuals = [e + np.tile(burst, AXES) for e in noise(3)]
    level = estimate_noise(linears, noise(3))
    end = float(linears[0].t[40])
    kinds = {item.kind.split()[0] for item in unmodelled_residuals(linears, residuals, level)}
    assert kinds == {"band", "window"}
    assert unmodelled_residuals(linears, residuals, level, settled=end) == []
    late = [e + np.tile(burst[::-1], AXES) for e in noise(3)]
    kinds = {item.kind.split()[0] for item in unmodelled_residuals(linears, late, level, settled=end)}
    assert kinds == {"band", "window"}


def test_rounding_is_noise():
    assert left([np.round(e / 1.5) * 1.5 for e in noise(1)]) == []


def test_a_drift_that_is_the_same_in_all_recordings_is_not_slow_noise():
    """A gyroscope that warms up: 1 - exp(-t/2 s), of the size of the noise."""
    drift = np.tile(1.0 - np.exp(-np.arange(N) / 200.0), AXES)
    found = left([e + drift for e in noise(5)])
    assert [item.kind for item in found] == ["course"]
    assert found[0].recording is None


def test_drifts_that_differ_from_recording_to_recording_are_slow_noise():
    drift = np.tile(1.0 - np.exp(-np.arange(N) / 200.0), AXES)
    residuals = [sign * drift + e for sign, e in zip((1.0, -1.0, 1.0, -1.0), noise(5), strict=True)]
    assert [item for item in left(residuals) if item.kind == "course"] == []


@pytest.mark.parametrize("frequency", [0.07, 0.2, 0.43])
def test_a_sine_of_the_size_of_the_noise_is_not_noise(frequency: float):
    """Half of its power would do: what turns with the spin stands in one band."""
    wave = np.tile(np.sin(2.0 * np.pi * frequency * np.arange(N)), AXES)
    found = left([e + wave for e in noise(2)])
    assert found
    assert found[0].kind.startswith("band")
    assert found[0].group == "gyroscope"


def test_a_burst_is_located_in_its_recording_axis_and_time():
    residuals = noise(3)
    start = N + 250  # the second axis
    residuals[2][start : start + 24] += 5.0 * np.sign(np.sin(np.arange(24)))
    found = left(residuals)
    (window,) = [item for item in found if item.kind == "window"]
    assert (window.recording, window.group, window.axis) == (2, "gyroscope", "1")
    assert window.from_s == pytest.approx(2.5, abs=0.1)
    assert window.to_s == pytest.approx(2.74, abs=0.1)


def test_one_or_two_wild_readings_are_outliers_and_three_are_not():
    residuals = noise(4)
    residuals[0][100] = 12.0
    assert left(residuals) == []
    residuals[0][110] = -12.0
    assert left(residuals) == []
    residuals[0][115] = 12.0
    assert [item.kind for item in left(residuals)] == ["window"]


def test_the_strongest_remainder_comes_first():
    wave = np.tile(np.sin(0.5 * np.arange(N)), AXES)
    residuals = [e + 3.0 * wave for e in noise(5)]
    residuals[1][300:324] += 20.0
    strengths = [item.z for item in left(residuals)]
    assert strengths == sorted(strengths, reverse=True)


@pytest.mark.parametrize(("sd", "phi", "kinds"), [(30.0, 0.995, ["swallowed"]), (30.0, 0.9, []), (3.0, 0.995, [])])
def test_what_is_many_times_as_loud_as_stated_and_hardly_changes_is_no_noise(sd: float, phi: float, kinds: list[str]):
    """Loud noise is noise, and slow noise is; what is both has swallowed something that is missing."""
    assert [item.kind for item in left(noise(3, sd, phi))] == kinds


def test_noise_of_a_mean_may_be_as_slow_as_the_mean_and_then_is_as_loud_as_of_a_sample():
    """Means of 80 samples state a ninth of a sample's noise; noise of 1.4 times that, a second long, was no noise."""
    one = rows(("accelerometer", 100))
    mean = replace(one, sd=one.sd / 9.0, channels=tuple(replace(channel, worth=81.0) for channel in one.channels))
    assert loudest("accelerometer", [one]) == pytest.approx(10.0)
    assert loudest("accelerometer", [mean]) == pytest.approx(3.0)
    assert loudest("accelerometer", [replace(mean, channels=one.channels)]) == pytest.approx(10.0 / 9.0)
