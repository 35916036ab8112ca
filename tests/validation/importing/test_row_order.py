"""Rows in another order than their times are put in it: an export with the newest first, rows of several threads."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.raw_table import Layout, RepairList, read_raw

LOG = made_log()
SIZE = LOG.t.size
HEADER = "time_s,gx,gy,gz,ax,ay,az"


def written(path, order, stamps=None):
    rows = np.column_stack([LOG.gyro / DEG, LOG.accel / G0])
    stamps = [f"{t:.4f}" for t in LOG.t] if stamps is None else stamps
    lines = [f"{stamp},{','.join(f'{cell:.5f}' for cell in row)}" for stamp, row in zip(stamps, rows, strict=True)]
    path.write_text("\n".join([HEADER, *(lines[k] for k in order), ""]))
    return path


def mixed() -> np.ndarray:
    """Return an order in which rows stand up to five places off."""
    return np.argsort(np.arange(SIZE) + np.random.default_rng(1).integers(0, 6, SIZE), kind="stable")


@pytest.mark.parametrize(
    ("order", "said"),
    [(np.arange(SIZE)[::-1], "rows run BACKWARDS, the newest first"), (mixed(), "rows stand out of order")],
)
def test_rows_are_put_in_the_order_of_their_times(tmp_path, order, said):
    log = import_log(written(tmp_path / "log.csv", order))
    read = log.recordings[0].samples["gyroscope"]
    assert_allclose(read.t, LOG.t, atol=1e-4)
    assert_allclose(read.value[:, 2], LOG.gyro[:, 2], atol=1e-6)
    assert said in log.summary()
    assert "put in the order of 'time_s'" in log.summary()


def test_dates_with_the_newest_first_are_put_in_order_too(tmp_path):
    stamps = [f"2025-06-01 12:00:{t:09.6f}" for t in LOG.t]
    read = import_log(written(tmp_path / "log.csv", np.arange(SIZE)[::-1], stamps)).recordings[0].samples["gyroscope"]
    assert_allclose(read.t, LOG.t, atol=1e-5)
    assert_allclose(read.value[:, 2], LOG.gyro[:, 2], atol=1e-6)


def test_rows_that_share_a_stamp_of_a_log_turned_round_are_turned_round_with_it(tmp_path):
    stamps = [f"{np.floor(t * 50) / 50:.2f}" for t in LOG.t]
    read = import_log(written(tmp_path / "log.csv", np.arange(SIZE)[::-1], stamps)).recordings[0].samples["gyroscope"]
    assert_allclose(read.value[:, 2], LOG.gyro[: len(read.t), 2], atol=1e-6)


def test_the_map_of_such_a_log_gives_the_same_again(tmp_path):
    raw = written(tmp_path / "log.csv", mixed())
    first = import_log(raw)
    first.report(tmp_path / "first")
    again = import_log(raw, str(tmp_path / "first" / "map.toml"))
    for sensor, samples in first.recordings[0].samples.items():
        assert_array_equal(samples.t, again.recordings[0].samples[sensor].t)
        assert_array_equal(samples.value, again.recordings[0].samples[sensor].value)


def test_a_log_that_began_again_is_not_mixed(tmp_path):
    """Its times are those of two logs: of both the longer stretch is kept, as ever."""
    raw = written(tmp_path / "log.csv", np.concatenate([np.arange(SIZE), np.arange(100, SIZE - 300)]))
    log = import_log(raw)
    assert "the clock starts anew" in log.summary()
    assert_allclose(log.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-4)


def test_a_column_that_is_not_there_is_asked_for_by_its_name(tmp_path):
    raw = written(tmp_path / "log.csv", np.arange(SIZE))
    with pytest.raises(InputError, match="no column 'when' to put rows in order by"):
        read_raw(raw, Layout(sorted_by="when"), RepairList(()))


def test_rows_that_were_sorted_by_the_letters_of_their_stamps_fill_the_gaps_that_they_left(tmp_path):
    """Milliseconds without zeros before them: 39-90 stands behind 39-871."""
    at = [f"2024-3-23--13-41-{39 + ms // 1000}-{ms % 1000}" for ms in (1000 * LOG.t).round().astype(int).tolist()]
    log = import_log(written(tmp_path / "log.csv", np.argsort(at), at))
    read = log.recordings[0].samples["gyroscope"]
    assert_allclose(read.t, LOG.t, atol=1e-5)
    assert_allclose(read.value[:, 2], LOG.gyro[:, 2], atol=1e-6)
    assert "rows stand out of order" in log.summary()


def test_wild_stamps_of_a_log_that_stands_in_order_move_no_row(tmp_path):
    stamps = [f"{t:.4f}" for t in LOG.t]
    for k in range(20, SIZE - 20, 40):
        stamps[k] = f"{0.7 * LOG.t[k]:.4f}"
    log = import_log(written(tmp_path / "log.csv", np.arange(SIZE), stamps))
    assert "out of order" not in log.summary().partition("WARNING")[0]
    kept = log.recordings[0].samples["gyroscope"]
    assert_allclose(kept.value[:, 2], np.interp(kept.t, LOG.t, LOG.gyro[:, 2]), atol=1e-6)


@pytest.mark.parametrize(("late", "begun"), [(0.0012, 0.0), (0.0025, 0.0), (0.0041, 0.0), (0.013, 48.2), (0.013, 3.0)])
def test_a_clock_that_began_anew_is_no_other_order(tmp_path, late, begun):
    """Its second stretch lies between the rows of the first, before it, or partly either."""
    half = SIZE // 2
    stamps = [f"{begun + LOG.t[k] if k < half else LOG.t[k] - LOG.t[half] + late:.4f}" for k in range(SIZE)]
    log = import_log(written(tmp_path / "log.csv", np.arange(SIZE), stamps))
    assert "out of order" not in log.summary()
    assert "the clock starts anew" in log.summary()
