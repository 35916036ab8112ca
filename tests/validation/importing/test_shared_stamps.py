"""Stamps of a clock that is coarser than the rows: rows are even between stamps, and pauses keep their length."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, RATE, made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing.import_map import read_map
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.shared_stamps import evened

LOG = made_log()


def log(path, *times):
    columns = [*times, *three(["gx", "gy", "gz"], LOG.gyro / DEG)]
    return write_table(path, columns + three(["ax", "ay", "az"], LOG.accel / G0))


def cut_off(t, step):
    return np.floor(t / step + 1e-9) * step


def hundredths(t):
    """Return times of the day with hundredths of a second, as OpenLog Artemis writes them."""
    counts = np.floor(t * 100 + 1e-6).astype(int) + 5233800
    return [f"{c // 360000:02d}:{c // 6000 % 60:02d}:{c // 100 % 60:02d}.{c % 100:02d}" for c in counts]


@pytest.mark.parametrize("rate", [110.0, 286.3, 430.0])
def test_even_rows_have_their_times_to_a_tenth_of_a_row(rate):
    t = np.arange(3000) / rate
    apart = evened(cut_off(t, 0.01)) - t
    assert np.ptp(apart) < 0.1 / rate


def test_pauses_keep_their_length_whether_a_stamp_tells_them_or_not():
    """Some are longer than a stamp's step and leap, others are seen by the line alone."""
    rng = np.random.default_rng(4)
    t = np.arange(4000) / 286.3
    for row in rng.integers(50, 4000, 20):
        t[row:] += rng.uniform(0.003, 0.03)
    apart = evened(cut_off(t, 0.01)) - t
    assert np.std(apart) < 1e-3


def test_a_row_without_a_stamp_has_no_time_and_a_clock_that_goes_back_begins_another_line():
    t = np.arange(400) / 200.0
    stamps = cut_off(t, 0.01)
    stamps[7] = np.nan
    stamps[200:] -= 0.8
    found = evened(stamps)
    assert np.isnan(found[7])
    assert_allclose(np.diff(found[10:200]), 0.005, atol=1e-4)
    assert_allclose(np.diff(found[200:]), 0.005, atol=1e-4)


@pytest.mark.parametrize("stamps", [("rtcTime", hundredths(LOG.t)), ("ms", (cut_off(LOG.t, 0.01) * 1e3).round())])
def test_no_row_is_left_out_and_it_is_said(tmp_path, stamps):
    whole = import_log(log(tmp_path / "log.csv", stamps))
    read = whole.recordings[0].samples["gyroscope"]
    assert read.t.size == LOG.t.size
    assert_allclose(np.diff(read.t), 1.0 / RATE, atol=0.05 / RATE)
    assert "2 rows SHARE a stamp, and are taken as even between stamps" in whole.summary()
    assert "shared = true" in whole.map_text


@pytest.mark.parametrize("rows", [10, 25])
def test_a_packet_of_rows_under_one_stamp_shares_it(tmp_path, rows):
    """As radio links send them: from ten rows on the column was no time, and 100 rows a second were guessed."""
    whole = import_log(log(tmp_path / "log.csv", ("time_ms", (cut_off(LOG.t, rows / RATE) * 1e3).round())))
    t = whole.recordings[0].samples["gyroscope"].t
    assert_allclose(np.median(np.diff(t)), 1.0 / RATE, rtol=0.01)
    assert "rows SHARE a stamp" in whole.summary()


def test_a_finer_column_of_time_is_taken_before_a_coarse_one(tmp_path):
    coarse, fine = ("rtcTime", hundredths(LOG.t)), ("time_ms", (LOG.t * 1e3).round())
    assert "time: 'time_ms' in ms" in import_log(log(tmp_path / "log.csv", coarse, fine)).summary()


def test_rows_that_stand_twice_share_no_stamp(tmp_path):
    """What holds the same readings is the same row once more."""
    times = np.repeat(LOG.t, 2)
    columns = [("t_s", times), *three(["gx", "gy", "gz"], np.repeat(LOG.gyro / DEG, 2, axis=0))]
    columns += three(["ax", "ay", "az"], np.repeat(LOG.accel / G0, 2, axis=0))
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert "SHARE" not in whole.summary()
    assert whole.recordings[0].samples["gyroscope"].t.size == LOG.t.size


def test_a_map_refuses_shared_stamps_without_a_column(tmp_path):
    whole = import_log(log(tmp_path / "log.csv", ("rtcTime", hundredths(LOG.t))))
    wrong = tmp_path / "wrong.toml"
    text = whole.map_text.replace('column = "rtcTime"', "step_s = 0.005").replace('unit = "iso"\n', "")
    wrong.write_text(text)
    with pytest.raises(InputError, match="'shared' is true, expected a 'column' of stamps that several rows share"):
        read_map(wrong)
