"""A receiver's file beside the disc's own log: the proposed map reads it, or says why it does not."""

from __future__ import annotations

import re
from datetime import UTC, datetime, timedelta
from functools import reduce
from operator import xor

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
T = np.arange(0.0, LOG.t[-1], 0.2)
#: 3 m/s to the north and 1 m/s up; one degree at 47.4 deg north on WGS 84 is 111 178 m
NORTH, HEIGHT = 3.0 * T, 440.0 + T


def folder(tmp_path, name, text):
    """Write a board's log, its times in ms from its start, and a receiver's file beside it."""
    raw = tmp_path / "raw"
    raw.mkdir()
    cells = np.column_stack([1000 * LOG.t, LOG.gyro, LOG.accel, LOG.mag])
    rows = [",".join(f"{cell:.6g}" for cell in row) for row in cells]
    (raw / "disc.csv").write_text("\n".join(["time_ms,gx,gy,gz,ax,ay,az,mx,my,mz", *rows, ""]))
    (raw / name).write_text(text)
    return raw


def table(head, stamp, height=HEIGHT):
    rows = [
        f"{stamp(t)},{47.4 + n / 111178.0:.9f},8.55,{h:.3f},3.0,0.0" for t, n, h in zip(T, NORTH, height, strict=True)
    ]
    return "\n".join([head, *rows, ""])


def gpx(inside="", head='<?xml version="1.0"?>'):
    points = [
        f'<trkpt lat="{47.4 + n / 111178.0:.9f}" lon="8.55"><ele>{h:.3f}</ele>{inside}'
        f"<time>2026-05-01T12:{int(t // 60):02d}:{t % 60:06.3f}Z</time></trkpt>"
        for t, n, h in zip(T, NORTH, HEIGHT, strict=True)
    ]
    return f'{head}<gpx xmlns="http://www.topografix.com/GPX/1/1"><trk><trkseg>{"".join(points)}</trkseg></trk></gpx>'


def nmea():
    lines = []
    for t, n, h in zip(T, NORTH, HEIGHT, strict=True):
        minutes = 60 * (0.4 + n / 111178.0)
        text = f"GPGGA,1207{t:05.2f},47{minutes:09.6f},N,00833.000000,E,1,11,0.8,{h:.2f},M,47.0,M,,"
        lines.append(f"${text}*{reduce(xor, text.encode()):02X}")
    return "\r\n".join([*lines, ""])


def dated_nmea(start, kinds=("RMC", "GGA")):
    """Return the sentences from a date and time on."""
    lines = []
    for t, n, h in zip(T, NORTH, HEIGHT, strict=True):
        now = start + timedelta(seconds=round(float(t), 3))
        time, place = (
            f"{now:%H%M%S}.{now.microsecond // 10000:02d}",
            f"47{60 * (0.4 + n / 111178.0):09.6f},N,00833.000000,E",
        )
        texts = {
            "RMC": f"GPRMC,{time},A,{place},5.83,0.0,{now:%d%m%y},,,A",
            "GGA": f"GPGGA,{time},{place},1,11,0.8,{h:.2f},M,47.0,M,,",
        }
        lines += [f"${texts[kind]}*{reduce(xor, texts[kind].encode()):02X}" for kind in kinds]
    return "\r\n".join([*lines, ""])


def assert_flies_north(gps):
    assert_allclose(gps.value[:, 0], 3.0 * (gps.t - gps.t[0]), atol=0.02)
    assert_allclose(gps.value[:, 2], -(gps.t - gps.t[0]), atol=0.02)


def assert_whole_by_its_map(tmp_path, raw, log):
    """Every fix is there, and the proposed map brings the same again."""
    gps = log.recordings[0].samples["gps"]
    assert len(gps) == T.size
    assert_flies_north(gps)
    (tmp_path / "map.toml").write_text(log.map_text)
    again = import_log(raw, str(tmp_path / "map.toml")).recordings[0].samples["gps"]
    np.testing.assert_array_equal(again.value, gps.value)


@pytest.mark.parametrize(
    ("head", "stamp", "height", "lines"),
    [
        ("time_ms,latitude,longitude,altitude_m,v,w", lambda t: 1000 * t, HEIGHT, []),
        ("t_s,lat,lon,alt,v,w", lambda t: t, HEIGHT, ['time = "t_s"', 'time_unit = "s"']),
        (
            "ts_us,gps_lat,gps_lng,gps_alt_ft,v,w",
            lambda t: round(1e6 * t),
            HEIGHT / 0.3048,
            ['height_unit = "ft"', 'time = "ts_us"', 'time_unit = "us"'],
        ),
    ],
)
def test_a_table_of_fixes_is_read_by_the_proposed_map(tmp_path, head, stamp, height, lines):
    raw = folder(tmp_path, "tracker.csv", table(head, stamp, height))
    log = import_log(raw)
    proposed = log.map_text.partition("[sensors.gps]")[2]
    assert 'file = "tracker.csv"' in proposed
    assert 'unit = "deg"' in proposed
    assert all(line in proposed for line in lines)
    assert_whole_by_its_map(tmp_path, raw, log)


def test_units_in_brackets_in_a_line_of_their_own_may_lack_those_of_the_last_columns(tmp_path):
    """As FlySight writes them: that line was taken for the names, and the file refused."""
    head = "time,lat,lon,hMSL,v,numSV\n(s),(deg),(deg),(m),(m/s),"
    raw = folder(tmp_path, "track.csv", table(head, lambda t: t))
    log = import_log(raw)
    assert 'columns = ["lat", "lon", "hMSL"]' in log.map_text
    assert_whole_by_its_map(tmp_path, raw, log)


def test_speed_and_heading_are_left_out_aloud(tmp_path):
    raw = folder(tmp_path, "gps.csv", table("time_ms,lat,lon,alt,speed_m_s,heading (deg)", lambda t: 1000 * t))
    (said,) = [note for note in import_log(raw).notes if "velocity north, east and down" in note]
    assert said.startswith("left out: 'speed_m_s', 'heading (deg)' of gps.csv: ")


@pytest.mark.parametrize("ours", [(",", "."), (";", ","), ("\t", ".")])
@pytest.mark.parametrize("theirs", [(",", "."), (";", "."), (";", ","), ("\t", ",")])
def test_a_table_that_is_laid_out_in_another_way_is_read(tmp_path, ours, theirs):
    """It was named, with the request to save it with the same separator."""

    def written(text, separator, decimal):
        return text.replace(",", "\0").replace(".", decimal).replace("\0", separator)

    text = table("t_s,lat,lon,alt,v,w", lambda t: f"{t:.3f}")
    raw = folder(tmp_path, "tracker.csv", written(text, *theirs))
    board = (raw / "disc.csv").read_text()
    (raw / "disc.csv").write_text(written(board, *ours))
    log = import_log(raw)
    assert ("[sensors.gps.layout]" in log.map_text) == (ours[0] != theirs[0])
    assert not [note for note in log.notes if "another way" in note]
    assert_whole_by_its_map(tmp_path, raw, log)


@pytest.mark.parametrize("semicolons", [False, True])
@pytest.mark.parametrize(("name", "text", "first"), [("t.gpx", gpx(), 830952000.0), ("t.nmea", nmea(), 43620.0)])
def test_a_track_by_another_clock_stands_in_the_map_as_comments_that_an_offset_makes_lines(
    tmp_path, name, text, first, semicolons
):
    if name.endswith("nmea"):
        pytest.importorskip("pynmeagps")
    raw = folder(tmp_path, name, text)
    if semicolons:
        (raw / "disc.csv").write_text((raw / "disc.csv").read_text().replace(",", ";").replace(".", ","))
    log = import_log(raw)
    assert "gps" not in log.recordings[0].samples
    (said,) = [note for note in log.notes if "its lines stand in the map as comments" in note]
    assert f"left out: the fixes in {name}: its clock is another one (it runs from {first:.9g} to" in said
    assert f"time_offset_s = {LOG.t[0] - first:.3f} lets both begin together" in said
    assert any("velocity" in note and note.startswith(f"{name}: gps") for note in log.notes)
    before, _, lines = log.map_text.partition("# [sensors.gps]")
    mended = re.sub(r"(?m)^# ", "", lines).replace("time_offset_s = 0.0", f"time_offset_s = {LOG.t[0] - first:.3f}")
    (tmp_path / "map.toml").write_text(f"{before}[sensors.gps]{mended}")
    gps = import_log(raw, str(tmp_path / "map.toml")).recordings[0].samples["gps"]
    assert len(gps) == T.size
    assert_flies_north(gps)


START = datetime(2026, 4, 30, 23, 59, 57, tzinfo=UTC)


@pytest.mark.parametrize("written", ["GPX", ("RMC", "GGA"), ("GGA", "RMC"), ("GGA",)])
@pytest.mark.parametrize("stamps", ["iso", "unix_s", "unix_ms"])
def test_a_track_over_midnight_is_laid_beside_a_log_with_dates(tmp_path, written, stamps):
    """NMEA's times were of the day alone, and a log since 1970 was another clock: the track was left out."""
    if written != "GPX":
        pytest.importorskip("pynmeagps")
    text = dated_nmea(START, written) if written != "GPX" else None
    name = "t.nmea"
    if text is None:
        text, name = gpx(), "t.gpx"
        for t in T:
            now = START + timedelta(seconds=round(float(t), 3))
            old = f"2026-05-01T12:{int(t // 60):02d}:{t % 60:06.3f}Z"
            text = text.replace(old, f"{now:%Y-%m-%dT%H:%M:%S}.{now.microsecond // 1000:03d}Z")
    raw = folder(tmp_path, name, text)
    lines = (raw / "disc.csv").read_text().splitlines()
    began = START + timedelta(seconds=1)
    cells = []
    for t in LOG.t.tolist():
        now = began + timedelta(seconds=round(t, 3))
        unix = now.timestamp()
        cells.append({"iso": f"{now.isoformat()}", "unix_s": f"{unix:.3f}", "unix_ms": f"{1000 * unix:.0f}"}[stamps])
    rows = [",".join([cell, *row.split(",")[1:]]) for cell, row in zip(cells, lines[1:], strict=True)]
    (raw / "disc.csv").write_text("\n".join(["time,gx,gy,gz,ax,ay,az,mx,my,mz", *rows, ""]))
    log = import_log(raw)
    (recording,) = log.recordings
    gps = recording.samples["gps"]
    assert_allclose(gps.t, T - 1.0 - min(0.0, T[0] - 1.0), atol=1e-5)
    assert recording.samples["gyroscope"].t[0] == pytest.approx(1.0, abs=1e-5)
    assert_flies_north(gps)
    since = 946684800 if stamps != "iso" else 0
    today = 9616 * 86400 if written == ("GGA",) else 0  # 30 April 2026, days after 2000
    offset = f"time_offset_s = {since + today} # added to its times"
    assert (offset in log.map_text) == bool(since + today)
    (tmp_path / "map.toml").write_text(log.map_text)
    assert_allclose(import_log(raw, str(tmp_path / "map.toml")).recordings[0].samples["gps"].t, gps.t)


def test_a_track_in_utc_beside_a_log_of_local_time_since_1970_says_the_zones(tmp_path):
    raw = folder(tmp_path, "t.gpx", gpx())
    local = 1777636800.0 + 7200.0  # 2026-05-01 12:00 UTC, two hours ahead
    lines = (raw / "disc.csv").read_text().splitlines()
    rows = [",".join([f"{local + t:.3f}", *row.split(",")[1:]]) for t, row in zip(LOG.t, lines[1:], strict=True)]
    (raw / "disc.csv").write_text("\n".join(["time,gx,gy,gz,ax,ay,az,mx,my,mz", *rows, ""]))
    said = " ".join(import_log(raw).notes)
    assert "2 h apart, as clocks of two time zones differ: time_offset_s = 946692000 lets both begin together" in said


def test_a_speed_in_a_track_is_left_out_aloud(tmp_path):
    raw = folder(tmp_path, "t.gpx", gpx("<extensions><speed>3.0</speed><course>0.0</course></extensions>"))
    assert [note for note in import_log(raw).notes if "gps: course, speed left out" in note]


def test_a_track_alone_is_read(tmp_path):
    (tmp_path / "t.gpx").write_text(gpx())
    assert_flies_north(import_log(tmp_path / "t.gpx").recordings[0].samples["gps"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (gpx(head='<!DOCTYPE gpx [<!ENTITY a "aaaa">]>'), "it declares a document type"),
        (gpx()[:-40], "is a damaged GPX track"),
        ("<gpx></gpx>", "is a GPX track without readings of motion in it"),
    ],
)
def test_a_track_that_cannot_be_read_is_said(tmp_path, text, said):
    if text.startswith("<!"):
        text = '<?xml version="1.0"?>' + text
    (tmp_path / "t.gpx").write_text(text)
    with pytest.raises(InputError, match=said):
        import_log(tmp_path / "t.gpx")
    raw = folder(tmp_path, "t.gpx", text)
    assert [note for note in import_log(raw).notes if note.startswith("left out: ") and said in note]


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("gps.csv", table("time_ms,lat,lon,a,v,w", lambda t: 1000 * t), "no column of a height"),
        (
            "gps.csv",
            table("time_ms,lat,lon,alt,v,w", lambda t: 1000 * t).replace("47.4", "4724.4"),
            "'lat' goes to 4724.4",
        ),
        ("gps.json", '{"lat": 47.4}', "left out: gps.json: is JSON"),
    ],
)
def test_a_track_that_no_map_reads_is_left_out_aloud(tmp_path, name, text, said):
    log = import_log(folder(tmp_path, name, text))
    assert [note for note in log.notes if said in note], log.notes
    assert "gps" not in log.recordings[0].samples


def test_the_unit_of_a_sensors_own_time_needs_its_column(tmp_path):
    raw = folder(tmp_path, "gps.csv", table("t_s,lat,lon,alt,v,w", lambda t: t))
    text = import_log(raw).map_text.replace('time = "t_s" # its own stamps\n', "")
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(InputError, match="expected 'time' beside it"):
        import_log(raw, str(tmp_path / "map.toml"))
