"""A field that stands on some rows of a log only: when it was read, by its own clock or by the log's."""

import numpy as np
import pytest
from support.made_logs import made_log, three, write_table

from discsim.validation.importing.imported_log import import_log

ROW = 0.01  # s


def written(path, rate: float, *, read_by_the_log: bool):
    """Write a log of 100 rows a second whose magnetometer has a reading on ``rate`` of them; return when each was."""
    log = made_log()
    rows = np.arange(0.0, log.t[-1], ROW)
    sampled = np.arange(0.003, log.t[-1], 1.0 / rate)
    latest = np.searchsorted(sampled, rows + 1e-9) - 1
    fresh = np.concatenate([[False], np.diff(latest) > 0])
    read = rows if read_by_the_log else sampled[latest]
    shown = np.column_stack([np.interp(read, log.t, log.mag[:, k]) for k in range(3)])
    cells = [[f"{value:.2f}" if there else "" for value, there in zip(axis, fresh, strict=True)] for axis in shown.T]
    every = np.searchsorted(log.t, rows)
    columns = [
        ("time", rows),
        *three(["gx", "gy", "gz"], log.gyro[every]),
        *three(["ax", "ay", "az"], log.accel[every]),
    ]
    write_table(path, [*columns, *zip(["mx", "my", "mz"], cells, strict=True)])
    return read[fresh]


@pytest.mark.parametrize("rate", [40.0, 62.3, 75.0, 90.0])
def test_a_field_on_some_rows_bears_the_times_of_its_own_clock(tmp_path, rate):
    true = written(tmp_path / "log.csv", rate, read_by_the_log=False)
    found = import_log(tmp_path / "log.csv")
    [recording] = found.recordings
    field = recording.samples["magnetometer"]
    assert f"at {rate:.4g} Hz in a log of 100 Hz: they bear the even times of its own clock" in found.summary()
    assert recording.sheets["magnetometer"].rate_hz == pytest.approx(rate, rel=2e-3)
    assert field.gaps == 0
    assert len(field) == true.size
    late = field.t - true
    # by the rows that they stand on they would be late by anything from nothing to a row: 2.9 ms about the mean
    assert np.std(late) < 0.03 * ROW
    assert np.ptp(late) < 0.1 * ROW


@pytest.mark.parametrize("rate", [62.3, 75.0])
def test_a_field_that_the_log_s_loop_reads_keeps_the_times_of_the_rows(tmp_path, rate):
    true = written(tmp_path / "log.csv", rate, read_by_the_log=True)
    found = import_log(tmp_path / "log.csv")
    field = found.recordings[0].samples["magnetometer"]
    present = np.all(np.isfinite(field.value), axis=1)
    np.testing.assert_allclose(np.diff(field.t[present]), np.diff(true), atol=1e-9)
    assert "its readings come every" not in found.summary()
