"""Readings that failed and stand in a folder as a number: an estimate tells them as a check does, and does without."""

from __future__ import annotations

import numpy as np

from discsim.plain_arrays import recording_from_arrays
from discsim.validation.checking.failed_readings import failed_findings
from discsim.validation.estimating.spin_estimates import estimate_spin


def spinning(failed):
    """Return a gyroscope's recording of a spin of 20 rad/s, a number on all axes in every fiftieth row."""
    t = np.arange(0.0, 6.0, 0.01)
    rates = np.array([0.0, 0.0, 20.0]) + 0.02 * np.random.default_rng(4).standard_normal((t.size, 3))
    rates[25::50] = failed
    return recording_from_arrays({"gyroscope": (t, rates)})


def test_an_estimate_tells_failed_readings_in_the_words_of_a_check():
    recording = spinning(-1.0)
    (finding,) = failed_findings(recording)
    found = estimate_spin(recording)
    assert f"{finding.sentence}; the estimates are of the rest" in found.notes
    (rate,) = found.rates
    np.testing.assert_allclose(rate.rate[np.isfinite(rate.rate)], 20.0, atol=0.1)


def test_of_sound_readings_nothing_is_told():
    assert not any("stands for no reading" in note for note in estimate_spin(spinning([0.0, 0.0, 20.0])).notes)
