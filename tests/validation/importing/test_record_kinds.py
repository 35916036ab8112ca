"""Records of several kinds in one log, each with its kind in front, as telemetry and flight computers write them."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.other_forms.record_kinds import begins

LOG = made_log()
NAMES = "IMU,time,ax,ay,az,gx,gy,gz,mx,my,mz\nBARO,time,p,T\nGPS,time,lat,lon,alt,nsat\n"


def records(names: str = NAMES, stamp: str = "", separator: str = ",") -> str:
    """Return a log whose readings stand beside a barometer's and a receiver's that lies still."""
    lines = names.splitlines()
    for k, t in enumerate(LOG.t):
        cells = [*(LOG.accel[k] / G0), *(LOG.gyro[k] / DEG), *LOG.mag[k]]
        lines.append(f"IMU,{t:.3f}," + ",".join(f"{cell:.5f}" for cell in cells))
        lines += [f"BARO,{t:.3f},1002.3,23.4"] * (k % 4 == 0) + [f"GPS,{t:.3f},47.4,8.5,450.2,12"] * (k % 40 == 0)
    return "".join(f"{stamp}{line}\n".replace(",", separator) for line in lines)


def assert_whole(samples):
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["gyroscope"].t - samples["gyroscope"].t[0], LOG.t, atol=1e-9)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-3)


@pytest.mark.parametrize("names", [NAMES, ""])
@pytest.mark.parametrize("separator", [",", ", ", "\t", ";"])
def test_each_kind_is_a_table_of_its_own(tmp_path, names, separator):
    """All but the kind with most cells were rows left out, and the place in them with these."""
    raw = tmp_path / "flight.txt"
    raw.write_text(records(names, separator=separator))
    found = import_log(raw)
    assert_whole(found.recordings[0].samples)
    said = found.summary()
    assert "its lines are records of several kinds, a table each; read: IMU, BARO, GPS" in said
    assert "left out (" not in said
    # a table with names tells where it was
    assert ("made at 47.4000,8.5000" in said) == bool(names)


def test_sensors_in_records_of_other_lengths_are_one_log(tmp_path):
    """Half of the log was left out: the packets with the gyroscope, which have more cells."""
    lines = []
    for k, t in enumerate(LOG.t):
        ms = round(1000 * t)
        lines.append(f"P1,{k},{ms}," + ",".join(f"{cell:.4f}" for cell in LOG.accel[k]) + ",23.5,1002.3")
        lines.append(f"P3,{k},{ms}," + ",".join(f"{cell:.4f}" for cell in [*(LOG.gyro[k] / DEG), *LOG.mag[k]]) + ",0.1")
    raw = tmp_path / "packets.txt"
    raw.write_text("\n".join(lines) + "\n")
    assert_whole(import_log(raw).recordings[0].samples)


def test_a_kind_that_is_rare_or_broken_off_is_named(tmp_path):
    raw = tmp_path / "flight.txt"
    raw.write_text("BOOT,1,0\n" + records() + "EVT,9.9,3\nIMU,9.99,0.1,0.")
    found = import_log(raw)
    assert_whole(found.recordings[0].samples)
    assert "not read: BOOT, EVT" in found.summary()


def flysight(sensors: bool) -> str:
    """Return a file of a FlySight 2: of its sensors, or of its receiver, which flies north by 3 m/s."""
    lines = ["$FLYS,1", "$VAR,FIRMWARE_VER,v2023.09.22"]
    if not sensors:
        lines += ["$COL,GNSS,time,lat,lon,hMSL,velN,velE,velD,numSV", "$UNIT,GNSS,,deg,deg,m,m/s,m/s,m/s,", "$DATA"]
        places = [(k, 47.4 + 3.0 * LOG.t[k] / 111178.0) for k in range(0, LOG.t.size, 20)]
        return "\n".join(
            [*lines, *(f"$GNSS,{LOG.t[k]:.3f},{lat:.8f},8.5,450.0,3.00,0.00,0.00,14" for k, lat in places), ""]
        )
    lines += ["$COL,IMU,time,wx,wy,wz,ax,ay,az,temperature", "$UNIT,IMU,s,deg/s,deg/s,deg/s,g,g,g,deg C"]
    lines += ["$COL,MAG,time,x,y,z,temperature", "$UNIT,MAG,s,gauss,gauss,gauss,deg C", "$DATA"]
    for k, t in enumerate(LOG.t):
        cells = [*(LOG.gyro[k] / DEG), *(LOG.accel[k] / G0)]
        lines.append(f"$IMU,{t:.3f}," + ",".join(f"{cell:.5f}" for cell in cells) + ",25.1")
        lines.append(f"$MAG,{t:.3f}," + ",".join(f"{cell / 100:.5f}" for cell in LOG.mag[k]) + ",25")
    return "\n".join([*lines, ""])


def test_columns_and_units_of_a_kind_stand_in_lines_of_their_own(tmp_path):
    """All of the magnetometer's rows were left out, and units guessed."""
    raw = tmp_path / "SENSOR.CSV"
    raw.write_text(flysight(sensors=True))
    found = import_log(raw)
    assert_whole(found.recordings[0].samples)
    said = found.summary()
    assert "read: IMU, MAG; not read: VAR" in said
    assert "gyroscope unit: deg/s (certain: the header says so" in said
    assert "magnetometer unit: gauss (certain: the header says so" in said


def test_a_single_kind_whose_columns_are_named_is_read(tmp_path):
    folder = tmp_path / "17-12-34"
    folder.mkdir()
    (folder / "SENSOR.CSV").write_text(flysight(sensors=True))
    (folder / "TRACK.CSV").write_text(flysight(sensors=False))
    samples = import_log(folder).recordings[0].samples
    assert_whole(samples)
    assert_allclose(samples["gps"].value[:, 3:], [[3.0, 0.0, 0.0]] * 100)
    assert_allclose(samples["gps"].value[:, 0], 3.0 * samples["gps"].t, atol=0.02)


def test_a_checksum_behind_a_record_is_no_part_of_its_last_cell(tmp_path):
    raw = tmp_path / "telemetry.txt"
    raw.write_text("".join(f"${line}*5A\n" for line in records("").splitlines()))
    assert_whole(import_log(raw).recordings[0].samples)


@pytest.mark.parametrize(
    "text",
    [
        "A,1,0.1,0.2,0.3\nG,1,4,5,6\n" * 40,  # of one length: the word is the id of a sensor
        "walking,1,0.1,0.2,0.3\n" * 40,
        "time,ax,ay,az\n" + "1,0.1,0.2,0.3\n" * 40,
        "ax,0.1,ay,0.2,az,0.3\ngx,1,gy,2\n" * 40,
        "IMU,1,0.1,0.2,0.3\nGPS,1,47.4,8.5\n",
    ],
)
def test_other_texts_are_left_as_they_are(tmp_path, text):
    raw = tmp_path / "log.txt"
    raw.write_text(text)
    assert not begins(raw)
