"""A gyroscope that stands at its limit for most of a throw leaves few turns, and small ones, to tell a log by."""

from __future__ import annotations

import numpy as np
import pytest
from support.made_logs import DEG, G0, LANDING, RELEASE, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.turning import best_worth, steps_between

LOG = made_log()


def test_small_turns_tell_a_worth_by_the_size_of_the_field_too():
    """They tell its product with the worth: 0.56 of the worth explained as much, with a field of 1.8 times the size."""
    gyro, slow = np.clip(LOG.gyro, -3.0, 3.0), slice(None, None, 4)
    steps = steps_between(LOG.t, gyro, LOG.t[slow], LOG.mag[slow] + [10.0, -10.0, 5.0])
    assert best_worth(steps, [0.25, 0.5, 1.0, 2.0, 4.0]).worth == pytest.approx(1.0, rel=0.1)


def test_a_throw_beyond_the_limit_is_one_though_a_slow_field_seems_to_stand_still(tmp_path):
    """The field of 6 readings a second was believed: it turns two thirds of a turn less between two than it does."""
    slow = LOG.mag.copy()
    slow[np.arange(len(slow)) % 32 > 0] = np.nan
    gyro = np.clip(LOG.gyro / DEG, -1000.0, 1000.0)
    columns = [("ms", 1000 * LOG.t), *three(["gx", "gy", "gz"], gyro), *three(["ax", "ay", "az"], LOG.accel / G0)]
    log = import_log(write_table(tmp_path / "log.csv", [*columns, *three(["mx", "my", "mz"], slow)]))
    (throw,) = log.throws
    assert throw.at_least
    assert throw.sensor == "gyroscope"
    assert throw.start == pytest.approx(RELEASE, abs=0.15)
    assert throw.end == pytest.approx(LANDING, abs=0.15)


def test_rows_without_stamps_are_spaced_by_the_few_turns_below_the_limit(tmp_path):
    """Half the spacing explained them as well, with twice the field."""
    slow = LOG.mag.copy()
    slow[np.arange(len(slow)) % 4 > 0] = np.nan
    gyro = np.clip(LOG.gyro / DEG, -500.0, 500.0)
    columns = [*three(["gx", "gy", "gz"], gyro), *three(["ax", "ay", "az"], LOG.accel / G0)]
    log = import_log(write_table(tmp_path / "log.csv", [*columns, *three(["mx", "my", "mz"], slow)]))
    assert log.recordings[0].samples["gyroscope"].t[-1] == pytest.approx(LOG.t[-1], rel=0.1)


def test_whole_numbers_that_no_part_counts_are_nanotesla_with_iron(tmp_path):
    """98 000 were taken for counts that make 600 uT of them."""
    field = np.round(1000 * (LOG.mag + np.array([40.0, 0.0, 40.0])))
    columns = [("ms", 1000 * LOG.t), *three(["gx", "gy", "gz"], np.round(LOG.gyro / DEG * 16.384))]
    log = import_log(write_table(tmp_path / "log.csv", [*columns, *three(["mx", "my", "mz"], field)]))
    assert "magnetometer unit: nT (guess" in log.summary()
