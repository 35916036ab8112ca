"""What went by as pandas writes it, a spreadsheet's count of days, and a column without a name."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from support.made_logs import LANDING, RATE, RELEASE, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.stamps import iso_seconds

LOG = made_log()
READINGS = [
    *three(["gyro_x", "gyro_y", "gyro_z"], LOG.gyro),
    *three(["acc_x", "acc_y", "acc_z"], LOG.accel),
    *three(["mag_x", "mag_y", "mag_z"], LOG.mag),
]


@pytest.mark.parametrize(
    ("cell", "seconds"),
    [
        ("0 days 00:00:05.250000", 5.25),
        ("0 days 00:00:05", 5.0),
        ("1 day, 0:00:01.5", 86401.5),
        ("2 days", None),
        ("0 days 00:61:00", None),
    ],
)
def test_days_and_a_time_are_what_went_by(cell, seconds):
    assert iso_seconds(cell) == seconds


TIMES = {
    "what went by, of pandas": [f"0 days 00:00:{at:09.6f}" for at in LOG.t],
    "a date, of a spreadsheet": [f"{46145.5856481481 + at / 86400:.10f}" for at in LOG.t],
    "a time of day, of a spreadsheet": [f"{0.585648148 + at / 86400:.9f}" for at in LOG.t],
}


@pytest.mark.parametrize("kind", TIMES)
def test_times_in_days_are_read(tmp_path, kind):
    found = import_log(write_table(tmp_path / "log.csv", [("timestamp", TIMES[kind]), *READINGS]))
    (throw,) = found.throws
    assert RELEASE <= throw.start < RELEASE + 0.2
    assert LANDING - 0.6 < throw.end <= LANDING + 0.1
    assert found.recordings[0].samples["gyroscope"].t[-1] == pytest.approx(LOG.t[-1], abs=1e-3)


def test_a_column_of_time_that_tells_none_is_named_where_the_field_tells_the_step(tmp_path):
    raw = write_table(tmp_path / "log.csv", [("timestamp", ["1.77781E+12"] * LOG.t.size), *READINGS])
    (said,) = [line for line in import_log(raw).summary().splitlines() if line.startswith("time:")]
    assert "'timestamp' tells no time here (its first cell is '1.77781E+12'); with this step the field turns" in said


def test_an_index_without_a_name_is_called_by_its_place(tmp_path):
    index = ("", np.arange(LOG.t.size))
    said = import_log(write_table(tmp_path / "log.csv", [index, ("time_s", LOG.t), *READINGS])).summary()
    assert "not used: column 1 (no name)" in said.splitlines()
    name = tmp_path / f"log_{RATE:.0f}Hz.csv"
    assert "; column 1 (no name) counts the rows" in import_log(write_table(name, [index, *READINGS])).summary()


@pytest.mark.parametrize("bare", [slice(None, 900), slice(900, None), slice(300, 700), slice(None, None, 2)])
def test_times_of_the_day_among_dates_take_their_date(tmp_path, bare):
    """A log over midnight, written as a time of the day in a part of its rows: it was two logs."""
    start = datetime(2026, 5, 1, 23, 59, 56, tzinfo=UTC)
    times = [start + timedelta(seconds=round(float(at), 3)) for at in LOG.t]
    cells = [f"{now:%d.%m.%Y %H:%M:%S}.{now.microsecond // 1000:03d}" for now in times]
    without = [cell.partition(" ")[2] for cell in cells]
    cells[bare] = without[bare]
    done = import_log(write_table(tmp_path / "log.csv", [("timestamp", cells), *READINGS]))
    (recording,) = done.recordings
    np.testing.assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=1e-6)
    (repair,) = done.imported[0].repairs
    assert repair.what == f"'timestamp' is a time of the day among dates, in {len(cells[bare])} rows"
    assert repair.action == "they take the date of the rows beside them"
