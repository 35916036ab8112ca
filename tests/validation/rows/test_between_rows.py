"""A field that stands on some rows of a log only: when it was read, by its own clock or by the log's."""

import numpy as np
import pytest
from support.made_logs import made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.rows.own_times import between_rows
from discsim.validation.rows.readings import Readings

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


@pytest.mark.parametrize("read_by_the_log", [False, True])
@pytest.mark.parametrize("spin", [21.0, 38.3, 46.4, 55.2, 63.5, 72.0])
def test_whose_clock_a_field_s_times_are_is_told_at_any_spin(spin, read_by_the_log):
    rng = np.random.default_rng(round(spin))
    rows = np.arange(0.0, 3.0, ROW)
    sampled = np.arange(0.0, 3.0, 1.0 / 80.0)
    latest = np.searchsorted(sampled, rows + 1e-9) - 1
    number = np.flatnonzero(np.diff(latest, prepend=-1))[3:]
    read = rows[number] if read_by_the_log else sampled[latest[number]]
    phase = spin * (read - 0.002 * read**2)
    field = np.stack([20.0 * np.cos(phase), -20.0 * np.sin(phase), np.full(read.size, 40.0)], axis=1)
    field += 0.5 * rng.standard_normal(field.shape)
    others = {"gyroscope": Readings(np.arange(rows.size), rows, np.zeros((rows.size, 3)))}
    found = between_rows(Readings(number, rows[number], field), others)
    assert (found is None) == read_by_the_log
    if found is not None:
        np.testing.assert_allclose(np.diff(found[0].time), np.diff(read), atol=1e-4)


def test_single_cells_that_are_lost_leave_a_held_field_its_rate(tmp_path):
    """Rows with a hole were passed over: a field at 100 Hz in a log of 200 came in at 120, most of it late."""
    rng = np.random.default_rng(8)
    log = made_log()
    held = np.repeat(log.mag[::2], 2, axis=0)[: log.t.size]
    held[rng.random(held.shape) < 0.05] = np.nan
    cells = [
        (f"m{axis}_uT", ["" if np.isnan(one) else f"{one:.3f}" for one in held[:, k]]) for k, axis in enumerate("xyz")
    ]
    columns = [("t_s", log.t), *three(["gx_rad_s", "gy_rad_s", "gz_rad_s"], log.gyro), *cells]
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert whole.recordings[0].sheets["magnetometer"].rate_hz == pytest.approx(100.0, rel=0.01)
    # 5 % of the cells were lost; two rows of one reading share two axes in 97 of 100
    value = whole.recordings[0].samples["magnetometer"].value
    assert np.mean(np.isnan(value)) < 0.02
