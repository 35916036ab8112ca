"""Fixes of a receiver in the table of the disc's sensors: the proposed map reads them, each once."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from support.made_logs import RATE, made_log

from discsim.validation.importing.imported_log import import_log

LOG = made_log()
HEAD = "time_ms,gx,gy,gz,ax,ay,az,mx,my,mz"
BASE = np.column_stack([1000 * LOG.t, LOG.gyro, LOG.accel, LOG.mag])
GPS = "lat,lon,alt,speed,heading"


def fix(t, more=(3.0, 0.0)):
    """Return the cells of a place that goes north with 3 m/s and up with 1 m/s; see `test_tracker_beside`."""
    return ",".join([f"{47.4 + 3.0 * t / 111178.0:.9f}", "8.55", f"{440 + t:.3f}", *(f"{one:g}" for one in more)])


def log(tmp_path, cells, head=GPS):
    """Write the board's log; ``cells`` gives the receiver's of a row."""
    rows = [",".join(f"{cell:.6g}" for cell in base) + "," + cells(k) for k, base in enumerate(BASE)]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([f"{HEAD},{head}", *rows, ""]))
    return path


def assert_flies_north(gps):
    t = gps.t - gps.t[0]
    assert_allclose(gps.value[:, 0] - gps.value[0, 0], 3.0 * t, atol=0.02)
    assert_allclose(gps.value[:, 2] - gps.value[0, 2], -t, atol=0.02)


@pytest.mark.parametrize("every", [20, 40, 200])
@pytest.mark.parametrize("empty", [",,,,", "NaN,NaN,NaN,NaN,NaN", None])
def test_fixes_between_empty_or_repeated_rows_are_read_once_each(tmp_path, every, empty):
    """Empty cells were 5850 gaps in repairs.csv, and one fix a second stood there with 200 Hz."""
    raw = log(tmp_path, lambda k: fix(LOG.t[k // every * every]) if empty is None or k % every == 0 else empty)
    done = import_log(raw)
    assert 'columns = ["lat", "lon", "alt"]\nunit = "deg"' in done.map_text.partition("[sensors.gps]")[2]
    (recording,) = done.recordings
    assert_allclose(recording.samples["gps"].t, LOG.t[::every], atol=1e-6)
    assert recording.sheets["gps"].rate_hz == pytest.approx(200 / every)
    assert_flies_north(recording.samples["gps"])
    assert len(done.imported[0].repairs) == (empty is None)
    assert [note for note in done.notes if note.startswith("left out: 'speed', 'heading' of log.csv")]


def test_a_rotation_velocity_is_a_gyroscopes_and_no_gap_is_counted_where_nothing_is_told(tmp_path):
    """A flight simulator's turned out to be a speed of the receiver, whose empty velocities made three gaps a row."""
    rows = [
        f"{2.2 * k:.1f},{0.1 * np.sin(k):.5f},{0.1 * np.cos(k):.5f},0.02,{fix(2.2 * k, (250.0,))}" for k in range(300)
    ]
    names = ",".join(f"ROTATION VELOCITY BODY {axis}" for axis in "XYZ")
    path = tmp_path / "log.csv"
    path.write_text("\n".join([f"t,{names},LATITUDE,LONGITUDE,ALTITUDE,GROUND VELOCITY", *rows, ""]))
    done = import_log(path)
    assert done.recordings[0].samples["gyroscope"].value.shape == (300, 3)
    (left,) = [note for note in done.notes if note.startswith("left out")]
    assert left.startswith("left out: 'GROUND VELOCITY' of log.csv")
    assert [line for line in done.lines if line.startswith("gps: 300 samples") and line.endswith(" 0 gaps")]


def test_zeros_before_the_first_fix_are_none(tmp_path):
    raw = log(tmp_path, lambda k: fix(LOG.t[k // 40 * 40]) if k > 400 else "0,0,0,0,0")
    gps = import_log(raw).recordings[0].samples["gps"]
    assert gps.t[0] == pytest.approx(LOG.t[401])
    assert np.isfinite(gps.value[:, :3]).all()


@pytest.mark.parametrize("every", [200, 580])
def test_a_throw_with_few_fixes_in_it_keeps_the_rate_that_the_log_shows(tmp_path, every):
    """The one that holds a single fix ended in "one sample and no rate_hz in the map"."""
    raw = log(tmp_path, lambda k: fix(LOG.t[k]) if k % every == 0 else ",,,,")
    (recording,) = import_log(raw, throw=1).recordings
    assert len(recording.samples["gps"]) == (2 if every == 200 else 1)
    assert recording.sheets["gps"].rate_hz == pytest.approx(200 / every, rel=1e-3)


def test_a_place_that_never_changes_is_left_out_aloud(tmp_path):
    done = import_log(log(tmp_path, lambda k: "47.4,8.55,440,0,0"))
    assert "gps" not in done.recordings[0].samples
    assert "left out: the fixes in log.csv: the same fix stands in every row" in done.notes


@pytest.mark.parametrize(
    "head",
    [
        "GPS_coord[0],GPS_coord[1],GPS_altitude,GPS_speed (m/s),GPS_ground_course",
        "locationLatitude(WGS84),locationLongitude(WGS84),locationAltitude(m),locationSpeed(m/s),locationCourse(°)",
    ],
)
def test_names_of_the_place_by_flight_controllers_and_phones_are_known(tmp_path, head):
    done = import_log(log(tmp_path, lambda k: fix(LOG.t[k // 40 * 40]), head))
    assert_flies_north(done.recordings[0].samples["gps"])
    speed, course = head.split(",")[3:]
    assert [note for note in done.notes if note.startswith(f"left out: '{speed}', '{course}'")]


@pytest.mark.parametrize(
    ("names", "worth", "line"),
    [
        ("vn,ve,vd", 1.0, ""),
        ("vel_n_m_s,vel_e_m_s,vel_d_m_s", 1.0, ""),
        ("velN (mm/s),velE (mm/s),velD (mm/s)", 1e-3, 'velocity_unit = "mm/s"'),
        ("north velocity [km/h],east velocity [km/h],down velocity [km/h]", 1 / 3.6, 'velocity_unit = "km/h"'),
        ("gps_vel_n_kn,gps_vel_e_kn,gps_vel_d_kn", 1852 / 3600, 'velocity_unit = "kn"'),
    ],
)
def test_a_velocity_north_east_and_down_is_read_with_its_unit(tmp_path, names, worth, line):
    """Such columns were listed as not used, and the recording had a gap in their place."""
    parts = np.array([3.0, 0.5, -1.0]) / worth
    raw = log(tmp_path, lambda k: fix(LOG.t[k // 40 * 40], parts), f"lat,lon,alt,{names}")
    done = import_log(raw)
    proposed = done.map_text.partition("[sensors.gps]")[2]
    assert line in proposed
    assert ("velocity_unit" in proposed) == bool(line)
    assert_allclose(done.recordings[0].samples["gps"].value[:, 3:], [[3.0, 0.5, -1.0]] * 50, rtol=1e-5)
    (tmp_path / "map.toml").write_text(done.map_text)
    again = import_log(raw, str(tmp_path / "map.toml")).recordings[0].samples["gps"]
    assert_array_equal(again.value, done.recordings[0].samples["gps"].value)


@pytest.mark.parametrize(("unit", "read"), [("", False), (" (cm/s)", True)])
def test_whole_numbers_of_a_receivers_protocol_are_degrees_and_mm(tmp_path, unit, read):
    """Ten millionths of a degree were refused with the request to write degrees."""

    def cells(k):
        t = LOG.t[k // 40 * 40]
        return f"{round(1e7 * (47.4 + 3.0 * t / 111178.0))},85500000,{round(1e3 * (440 + t))},300,0,-100"

    done = import_log(log(tmp_path, cells, ",".join(["lat", "lon", "alt", *(f"v{axis}{unit}" for axis in "ned")])))
    proposed = done.map_text.partition("[sensors.gps]")[2]
    assert 'unit = "degE7"\nheight_unit = "mm"' in proposed
    gps = done.recordings[0].samples["gps"]
    assert_flies_north(gps)
    assert np.isfinite(gps.value[:, 3:]).all() == read
    assert bool([note for note in done.notes if "their unit is not in their names" in note]) != read
    if read:
        assert_allclose(gps.value[:, 3:], [[3.0, 0.0, -1.0]] * 50)


@pytest.mark.parametrize("names", ["vn,ve", "vel_e,vel_n,vel_u"])
def test_a_velocity_that_is_not_of_those_three_is_left_out_in_a_sentence(tmp_path, names):
    raw = log(tmp_path, lambda k: fix(LOG.t[k // 40 * 40], (1.0,) * (names.count(",") + 1)), f"lat,lon,alt,{names}")
    done = import_log(raw)
    listed = ", ".join(f"'{name}'" for name in names.split(","))
    (said,) = [note for note in done.notes if note.startswith(f"left out: {listed} of log.csv")]
    assert "these are not those three" in said
    assert np.isnan(done.recordings[0].samples["gps"].value[:, 3:]).all()


def test_a_velocitys_unit_needs_a_velocity(tmp_path):
    from discsim.errors import InputError

    raw = log(tmp_path, lambda k: fix(LOG.t[k // 40 * 40]))
    (tmp_path / "map.toml").write_text(import_log(raw).map_text + 'velocity_unit = "kn"\n')
    with pytest.raises(InputError, match="'velocity_unit' is for a gps with six columns"):
        import_log(raw, str(tmp_path / "map.toml"))


def test_a_magnetometer_with_empty_cells_between_has_its_own_rate(tmp_path):
    """Its 1500 empty rows were gaps, and its rate that of the log."""
    rows = [[f"{cell:.6g}" for cell in base] for base in BASE]
    lines = [",".join(row if k % 4 == 0 else [*row[:7], "", "", ""]) for k, row in enumerate(rows)]
    (tmp_path / "log.csv").write_text("\n".join([HEAD, *lines, ""]))
    done = import_log(tmp_path / "log.csv")
    (recording,) = done.recordings
    assert_allclose(recording.samples["magnetometer"].t, LOG.t[::4], atol=1e-6)
    assert recording.sheets["magnetometer"].rate_hz == pytest.approx(50.0)
    assert recording.samples["magnetometer"].gaps == 0
    assert not done.imported[0].repairs


def test_a_sensor_on_every_second_row_is_one_of_half_the_rate(tmp_path):
    rows = [[f"{cell:.6g}" for cell in base] for base in BASE]
    lines = [",".join(row if k % 2 or k < 40 else [*row[:7], "", "", ""]) for k, row in enumerate(rows)]
    (tmp_path / "log.csv").write_text("\n".join([HEAD, *lines, ""]))
    recording = import_log(tmp_path / "log.csv").recordings[0]
    mag = recording.samples["magnetometer"]
    assert mag.gaps == 0
    assert recording.sheets["magnetometer"].rate_hz == pytest.approx(0.5 * RATE)


def test_gaps_of_a_sensor_that_is_as_fast_as_the_log_stay_gaps(tmp_path):
    rows = [[f"{cell:.6g}" for cell in base] for base in BASE]
    lines = [",".join(row if k % 3 else [*row[:7], "", "", ""]) for k, row in enumerate(rows)]
    (tmp_path / "log.csv").write_text("\n".join([HEAD, *lines, ""]))
    mag = import_log(tmp_path / "log.csv").recordings[0].samples["magnetometer"]
    assert len(mag) == LOG.t.size
    assert mag.gaps > 1900


def test_u_blox_s_time_of_the_week_is_in_ms_and_stands_before_its_seconds(tmp_path):
    """The whole seconds beside it were the time, and four fixes of five were left out."""
    lines = ["iTOW,hour,min,sec,lon,lat,hMSL"]
    for k in range(60):
        lines.append(
            f"{300000000 + 200 * k},14,3,{k // 5},{85000000 + 200 * k},{474000000 + 100 * k},{430000 + 10 * k}"
        )
    raw = tmp_path / "pvt.csv"
    raw.write_text("\n".join([*lines, ""]))
    gps = import_log(raw).recordings[0].samples["gps"]
    assert_allclose(gps.t, 0.2 * np.arange(60), atol=1e-6)
