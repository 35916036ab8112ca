"""Means over turns of an accelerometer on a disc that spins free, where few of them are whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import throws

from discsim.recording import Samples
from discsim.validation.identification.observations import readings_of


def means(lacking: float, every: int | None = None):
    """Return the means over turns of a throw whose first readings lack, by share of its time, and of the rest some."""
    (recording, _) = throws(plant="free_spin", seconds=2.0)
    samples = recording.samples["accelerometer"]
    value = np.where(samples.t[:, None] < lacking * recording.end, np.nan, samples.value)
    if every is not None:
        value[::every] = np.nan
    recording = replace(recording, samples={**recording.samples, "accelerometer": Samples(samples.t, value)})
    return [one for one in readings_of(recording) if one.sensor == "accelerometer"]


@pytest.mark.parametrize("lacking", [0.4, 0.7])
def test_the_stated_noise_of_means_is_that_of_the_whole_ones(lacking):
    """It was zero where more than half of them were not whole."""
    (whole,), (some,) = means(0.0), means(lacking)
    assert 1 < np.sum(some.good[:, 0]) < (1.05 - lacking) * some.t.size
    np.testing.assert_allclose(some.sd, whole.sd, rtol=0.1)


def test_an_accelerometer_without_a_whole_turn_is_not_observed():
    """A disc that spun too fast for it ended in a division by zero."""
    assert means(1.01) == []


def test_means_of_which_none_is_whole_have_a_noise():
    """It was zero where no reading took part in most; such an accelerometer keeps its place, to be asked why."""
    (some,) = means(0.7, every=9)
    assert not some.good.any()
    assert np.all(some.sd > 0.0)
