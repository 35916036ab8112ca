"""A receiver beside the board: its clock may be another zone's, its heights in feet; both are told and mended."""

from __future__ import annotations

import re
from datetime import datetime, timedelta

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import LANDING, RELEASE, made_log

from discsim.errors import InputError
from discsim.validation.importing.apart import apart
from discsim.validation.importing.imported_log import import_log
from discsim.validation.rows.readings import Readings

LOG = made_log()
START = datetime(2026, 5, 3, 12, 3, 20)
MAP = """
[sensors.gps]
file = "gps.csv"
columns = ["lat", "lon", "altitude (ft)"]
unit = "deg"
"""


def stamped(seconds):
    return (START + timedelta(seconds=float(seconds))).isoformat(timespec="milliseconds")


def two_devices(folder, late):
    """Write a receiver's fixes, which rise by 1 m/s from 440 m, and a board's readings, ``late`` s after them."""
    folder.mkdir()
    t = np.arange(0.0, 10.0, 0.1)
    fixes = [f"{stamped(at)}Z,{47.4 + 1e-6 * at:.8f},8.55,{(440 + at) / 0.3048:.3f}" for at in t]
    (folder / "gps.csv").write_text("\n".join(["timestamp,lat,lon,altitude (ft)", *fixes, ""]))
    cells = np.column_stack([LOG.gyro, LOG.accel, LOG.mag])
    rows = [
        f"{stamped(at + late)},{','.join(f'{cell:.6g}' for cell in row)}" for at, row in zip(LOG.t, cells, strict=True)
    ]
    (folder / "imu.csv").write_text("\n".join(["timestamp,gx,gy,gz,ax,ay,az,mx,my,mz", *rows, ""]))
    return folder


def with_gps(raw, path, *lines):
    text = re.sub(r"(?m)^(# )?\[sensors\.gps\]$(.*\n)*", "", import_log(raw).map_text)
    path.write_text("\n".join([text + MAP, *lines, ""]))
    return str(path)


def test_a_height_in_feet_is_refused_until_the_map_says_so(tmp_path):
    raw = two_devices(tmp_path / "raw", 0.0)
    with pytest.raises(InputError, match=r"'altitude \(ft\)' is in feet by its name.*height_unit = \"ft\""):
        import_log(raw, with_gps(raw, tmp_path / "mine.toml"))
    found = import_log(raw, with_gps(raw, tmp_path / "feet.toml", 'height_unit = "ft"'))
    gps = found.recordings[0].samples["gps"]
    assert_allclose(gps.value[:, 2], -gps.t, atol=1e-3)
    metres = import_log(raw, with_gps(raw, tmp_path / "metres.toml", 'height_unit = "m"')).recordings[0]
    assert_allclose(metres.samples["gps"].value[:, 2] * 0.3048, -gps.t, atol=1e-3)


def test_the_unit_of_a_height_is_a_receivers_in_degrees(tmp_path):
    raw = two_devices(tmp_path / "raw", 0.0)
    text = import_log(raw).map_text.replace("[sensors.gyroscope]", '[sensors.gyroscope]\nheight_unit = "ft"')
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(InputError, match="'height_unit' is for a gps"):
        import_log(raw, str(tmp_path / "mine.toml"))


def test_a_clock_of_another_zone_is_told_and_the_line_mends_it(tmp_path):
    raw = two_devices(tmp_path / "raw", 3600.0)
    found = import_log(raw, with_gps(raw, tmp_path / "mine.toml", 'height_unit = "ft"'), throw=1)
    (told,) = [note for note in found.summary().splitlines() if "no time in common" in note]
    assert "gps begins 3600 s before the gyroscope" in told
    assert "state time_offset_s = 3600 below [sensors.gps] of the map" in told
    assert "gps" not in found.recordings[0].samples
    mine = with_gps(raw, tmp_path / "mended.toml", 'height_unit = "ft"', "time_offset_s = 3600")
    found = import_log(raw, mine, throw=1)
    assert "no time in common" not in found.summary()
    assert len(found.recordings[0].samples["gps"]) == pytest.approx(10 * (LANDING - RELEASE), abs=2)


@pytest.mark.parametrize(
    ("late", "told"),
    [
        (0.0, None),
        (-9.0, None),
        (7200.0 - 20, "state time_offset_s = -7200 "),
        (-19800.0, "state time_offset_s = 19800 "),
        (400.0, "two clocks, or another log's file"),
    ],
)
def test_times_that_have_nothing_in_common_are_those_of_two_clocks(late, told):
    t = np.arange(0.0, 10.0, 0.1)
    value, number = np.zeros((t.size, 3)), np.arange(t.size)
    said = apart({"gyroscope": Readings(number, t, value), "gps": Readings(number, t + late, value)})
    assert len(said) == (told is not None)
    assert told is None or told in said[0]
