"""A unit that a header states stands against a clock that is a guess; a counter under a name of time is told."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, LANDING, RATE, RELEASE, made_log, three, write_table

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.magnitudes import gyroscope_unit
from discsim.validation.importing.sniffing.units import Reading

LOG = made_log()
COUNT = np.arange(LOG.t.size)


def log(path, stamp, *, field=True, before=""):
    columns = [
        stamp,
        *three(["gx_dps", "gy_dps", "gz_dps"], LOG.gyro / DEG),
        *three(["ax", "ay", "az"], LOG.accel / G0),
    ]
    columns += three(["mx", "my", "mz"], LOG.mag) if field else []
    return write_table(path, columns, before=before)


@pytest.mark.parametrize("name", ["time", "timestamp", "t"])
@pytest.mark.parametrize("first", [0, 407])
def test_a_counter_of_rows_under_a_name_of_time_is_told_and_overrides_no_unit(tmp_path, name, first):
    """At 200 Hz it was taken for milliseconds, and deg/s for rpm: every spin was six times too fast."""
    found = import_log(log(tmp_path / "log.csv", (name, COUNT + first)))
    said = found.summary()
    assert "gyroscope unit: deg/s (certain: the header says so" in said
    assert f"WARNING: '{name}' goes up by one a row: it counts the rows and tells no time; " in said
    gyro = found.recordings[0].samples["gyroscope"]
    assert gyro.interval == pytest.approx(1 / RATE, rel=0.05)  # by the turning of the field
    (throw,) = found.throws
    assert throw.spin == pytest.approx(32, rel=0.05)


def test_a_counter_with_nothing_that_turns_is_a_guess_that_asks_for_the_rate(tmp_path):
    found = import_log(log(tmp_path / "log.csv", ("time", COUNT), field=False))
    assert "time: 0.01 s a row (guess: 'time' goes up by one a row: it counts the rows and tells no time; " in (
        found.summary()
    )
    assert "write the rate above the header (# Sampling rate: 200 Hz) or step_s into the map; where it is in ms" in (
        found.summary()
    )


@pytest.mark.parametrize(
    ("file", "name", "before", "step"),
    [
        ("log.csv", "time", "# Sampling rate: 200 Hz\n", 0.005),
        ("log_200Hz.csv", "time", "", 0.005),
        ("log.csv", "time_ms", "", 0.001),
    ],
)
def test_what_the_warning_of_a_counter_asks_for_is_taken_and_silences_it(tmp_path, file, name, before, step):
    found = import_log(log(tmp_path / file, (name, COUNT), field=False, before=before))
    assert "counts the rows and tells no time" not in found.summary()
    assert_allclose(found.recordings[0].samples["gyroscope"].t, COUNT * step, atol=1e-9)


def test_a_map_with_the_step_is_taken(tmp_path):
    raw = log(tmp_path / "log.csv", ("time", COUNT), field=False)
    lines = import_log(raw).map_text.splitlines()
    lines = ["step_s = 0.005" if line.startswith("step_s") else line for line in lines if "step_sigma_s" not in line]
    (tmp_path / "map.toml").write_text("\n".join(lines), encoding="utf-8")
    found = import_log(raw, str(tmp_path / "map.toml"))
    assert_allclose(found.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-9)


def test_milliseconds_at_a_kilohertz_that_repeat_a_stamp_are_a_clock(tmp_path):
    stamps = COUNT.copy()
    stamps[50::100] -= 1
    found = import_log(log(tmp_path / "log.csv", ("time", stamps), field=False))
    assert "time: 'time' in ms (likely" in found.summary()


def test_minutes_are_read_where_the_header_states_them(tmp_path):
    cells = [f"{t / 60:.9f}" for t in LOG.t]
    found = import_log(log(tmp_path / "log.csv", ("Time [min]", cells)))
    assert "time: 'Time [min]' in min (certain: the header says so, and a row every 5 ms fits)" in found.summary()
    assert_allclose(found.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)
    (throw,) = found.throws
    assert RELEASE <= throw.start < throw.end <= LANDING + 0.1


def test_minutes_that_nothing_states_are_told_by_what_turns(tmp_path):
    cells = [f"{t / 60:.9f}" for t in LOG.t]
    found = import_log(log(tmp_path / "log.csv", ("time", cells)))
    assert "gyroscope unit: deg/s (certain: the header says so" in found.summary()
    assert "time: 'time' in counts of 60 s (likely: " in found.summary()
    assert "as fast as the gyroscope says: the rows are" not in found.summary()
    assert_allclose(found.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)


@pytest.mark.parametrize(
    ("clock", "turned", "unit"),
    [
        ("certain", np.pi / 30, "rpm"),
        ("likely", np.pi / 30, "deg/s"),
        ("guess", np.pi / 30, "deg/s"),
        ("certain", 1.0, "rad/s"),
        ("likely", 1.0, "rad/s"),
        ("guess", 1.0, "deg/s"),
    ],
)
def test_what_turns_overrides_a_stated_unit_as_far_as_the_clock_is_sure(clock, turned, unit):
    value = np.column_stack([0 * COUNT, 0 * COUNT, np.linspace(0.0, 30.0, COUNT.size)])
    assert gyroscope_unit(value, Reading("gyroscope", "deg/s"), turned, clock=clock).unit == unit


def test_seconds_with_decimals_of_a_slow_log_are_no_milliseconds(tmp_path):
    rng = np.random.default_rng(3)
    t = np.cumsum(rng.normal(0.51, 0.02, 70))
    turn = np.sin(0.2 * t)[:, None] * [3.0, 5.0, 24.0] + rng.normal(0.0, 0.1, (70, 3))
    rows = np.column_stack([t, rng.normal([0.0, 0.6, -9.8], 0.02, (70, 3)), turn])
    np.savetxt(tmp_path / "log.csv", rows, delimiter=",", header="Time,AccX,AccY,AccZ,GyrX,GyrY,GyrZ", comments="")
    found = import_log(tmp_path / "log.csv")
    assert found.recordings[0].samples["gyroscope"].t[-1] > 30.0
    assert "'Time' in s (guess: stamps with decimals 0.508 apart; in ms the log would last 0.035 s)" in found.summary()
