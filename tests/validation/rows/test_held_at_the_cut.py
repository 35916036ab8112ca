"""A magnetometer slower than its log, in a throw cut out of it: its first reading stands since before the cut."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.validation.rows.own_times import own_times

#: s between rows; the two clocks run apart by two rows in a throw
ROW = 0.002


@pytest.mark.parametrize("since", [0.0, 0.004, 0.011, 0.017])
@pytest.mark.parametrize("period", [0.02004, 0.02031])
def test_the_first_reading_has_its_own_time_and_not_that_of_the_first_row(since, period):
    """It was clamped to that row: half a second of a spin at 1600 deg/s came out 1 % off."""
    made = -since + period * np.arange(150)
    made += 4e-3 * np.sin(2 * np.pi * np.arange(150) / 150)
    rows = np.ceil(np.maximum(made, 0.0) / ROW) * ROW
    found = own_times(rows, np.round(np.diff(rows) / ROW), period / ROW, ROW)
    assert found.time == pytest.approx(made, abs=ROW)
    assert found.time[1] - found.time[0] == pytest.approx(period, abs=0.6 * ROW)
