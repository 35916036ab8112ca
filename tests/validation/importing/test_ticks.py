"""Ticks of a timer in the place of a time: what one is worth, the field's turning beside a stated gyroscope tells."""

from __future__ import annotations

import numpy as np
import pytest
from support.made_logs import LANDING, RELEASE, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import ImportedLog, import_log

LOG = made_log()
HEAD = "Ticks;Gyro X [°/s];Gyro Y [°/s];Gyro Z [°/s];Acc X [g];Acc Y [g];Acc Z [g];Mag X [µT];Mag Y [µT];Mag Z [µT]"


def written(tmp_path, tick, head=HEAD):
    """Write a log with semicolons and decimal commas whose first column counts ticks of so many seconds."""
    cells = np.column_stack([np.degrees(LOG.gyro), LOG.accel / 9.80665, LOG.mag])
    rows = [
        ";".join([f"{round((t + 137.2) / tick)}", *(f"{cell:.5f}".replace(".", ",") for cell in row)])
        for t, row in zip(LOG.t, cells, strict=True)
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([head, *rows, ""]), "cp1252")
    return path


def assert_in_time(log: ImportedLog, within):
    (throw,) = log.throws
    assert throw.end - throw.start == pytest.approx(LANDING - RELEASE, rel=within, abs=0.15)


@pytest.mark.parametrize(("tick", "scale"), [(1e-5, "scale = 10 "), (1e-7, "scale = 0.1 ")])
def test_round_ticks_are_told(tmp_path, tick, scale):
    log = import_log(written(tmp_path, tick))
    assert_in_time(log, 0.0)
    assert "scale_sigma" not in log.map_text
    assert scale in log.map_text
    assert not [note for note in log.notes if "turns" in note and "WARNING" in note]


@pytest.mark.parametrize("frequency", [84e6, 32768.0])
def test_any_other_tick_is_known_as_well_as_the_gyroscope(tmp_path, frequency):
    log = import_log(written(tmp_path, 1 / frequency))
    assert_in_time(log, 0.08)
    assert "scale_sigma = " in log.map_text
    assert any("write what a count is worth" in decision.text for decision in log.decisions)
    sheet = log.recordings[0].sheets["magnetometer"]
    assert float(np.max(sheet.sigma["rate_hz"])) == pytest.approx(0.04 * sheet.rate_hz, rel=0.05)
    (tmp_path / "map.toml").write_text(log.map_text)
    again = import_log(tmp_path / "log.csv", str(tmp_path / "map.toml")).recordings[0]
    np.testing.assert_array_equal(again.samples["gyroscope"].t, log.recordings[0].samples["gyroscope"].t)


TIMED = HEAD.replace("Ticks", "time")


@pytest.mark.parametrize(
    ("tick", "scale"), [(1e-4, "scale = 0.1 "), (5e-5, "scale = 0.0"), (2.5e-6, "scale = 2."), (64e-6, "scale = 0.06")]
)
def test_ticks_under_a_name_of_time_with_a_usual_rate_are_told_by_the_pull_to_the_centre(tmp_path, tick, scale):
    """Taken for ms of 20 rows a second they were "likely": a throw of three seconds was one of thirty."""
    log = import_log(written(tmp_path, tick, TIMED))
    assert_in_time(log, 0.08)
    assert scale in log.map_text
    assert not [note for note in log.notes if "turns" in note and "WARNING" in note]


@pytest.mark.parametrize(
    "head", [TIMED.replace("time", "time (ms)"), TIMED.replace("Acc", "Tmp").replace("[g]", "[C]")]
)
def test_such_a_column_is_believed_where_it_states_its_unit_or_nothing_pulls(tmp_path, head):
    log = import_log(written(tmp_path, 1e-4, head))
    assert "scale = 0.1" not in log.map_text
    assert [note for note in log.notes if note.startswith("WARNING: the field turns 0.1 times as fast")]


def test_a_gyroscope_whose_header_is_wrong_leaves_the_stamps_as_they_are(tmp_path):
    """Counts of 16.4 per deg/s below a header of deg/s: the pull shows which of the two is wrong."""
    path = written(tmp_path, 1e-3, TIMED)
    head, *rows = path.read_text("cp1252").splitlines()
    cells = [row.replace(",", ".").split(";") for row in rows]
    counted = [[c[0], *(f"{16.384 * float(x):.0f}" for x in c[1:4]), *c[4:]] for c in cells]
    path.write_text("\n".join([head, *(";".join(row).replace(".", ",") for row in counted), ""]), "cp1252")
    log = import_log(path)
    assert log.decisions[0].text.startswith("time: 'time' in ms (likely")
    assert "scale" not in log.map_text.partition("[time]")[2].partition("[environment]")[0]


def test_stamps_in_a_stated_unit_are_taken_as_they_are(tmp_path):
    log = import_log(written(tmp_path, 1e-5, HEAD.replace("Ticks", "t [ms]")))
    assert "scale = " not in log.map_text.partition("[environment]")[0]
    assert [note for note in log.notes if note.startswith("WARNING: the field turns 0.01 times as fast")]


@pytest.mark.parametrize("time", ["step_s = 0.01\nscale = 2.0", 'column = "t"\nunit = "iso"\nscale = 2.0'])
def test_the_worth_of_a_count_needs_a_column_of_numbers(tmp_path, time):
    (tmp_path / "map.toml").write_text(f'name = "a"\nplant = "free_spin"\n[time]\n{time}\n')
    with pytest.raises(InputError, match="'scale' is the worth of one count"):
        import_log(written(tmp_path, 1e-5), str(tmp_path / "map.toml"))


@pytest.mark.parametrize(("tick", "said"), [(1e-4, "Update Rate: 200.0Hz"), (1e-5, "Sampling rate: 200")])
def test_a_rate_that_the_log_states_tells_what_a_count_is_worth(tmp_path, tick, said):
    """Nothing pulls here: counts of 0.1 ms were taken for ms, a throw of three seconds was one of thirty."""
    head = TIMED.replace("Acc", "Tmp").replace("[g]", "[C]")
    log = import_log(written(tmp_path, tick, f"// {said}\n{head}"))
    assert_in_time(log, 0.0)
    (clock,) = [one for one in log.decisions if one.what == "time"]
    assert clock.choice == f"'time' in counts of {1e3 * tick:g} ms"
    assert said in clock.why
    assert not [note for note in log.notes if "WARNING" in note and "time" in note]


def test_a_stated_rate_that_makes_no_round_count_is_a_warning(tmp_path):
    log = import_log(written(tmp_path, 1e-3, "// Sampling rate: 50 Hz\n" + TIMED))
    assert_in_time(log, 0.0)
    assert [note for note in log.notes if "makes 200 rows a second, but" in note]


def test_seconds_with_decimals_go_before_a_count_of_ticks(tmp_path):
    """As DatCon writes the log of a drone: of ticks, four a microsecond, it came out four times as long."""
    names = [f"IMU_ATTI(0):{sensor}{axis}" for sensor in ("accel", "gyro", "mag") for axis in "XYZ"]
    cells = np.column_stack([LOG.accel, np.degrees(LOG.gyro), 10.0 * LOG.mag])
    rows = [
        ",".join([f"{round(4e6 * t) + 800_000}", f"{t:.6f}", *(f"{cell:.5f}" for cell in row)])
        for t, row in zip(LOG.t, cells, strict=True)
    ]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([",".join(["Clock:Tick#", "Clock:offsetTime", *names]), *rows, ""]))
    assert_in_time(import_log(path), 0.0)
