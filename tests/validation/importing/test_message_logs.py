"""Logs of messages (NMEA, UBX, MAVLink, DataFlash, MCAP): units, times, and one sentence for what is damaged."""

import builtins
import csv
import functools
import struct
import sys
from collections.abc import Mapping
from functools import reduce
from importlib.util import find_spec
from operator import xor
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support import message_logs as made
from support.made_logs import DEG, G0, LANDING, RELEASE, SPIN, Log, made_log

from discsim.errors import InputError
from discsim.recording import Recording, read_recording
from discsim.validation.cli import main
from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.logs import kind_of
from discsim.validation.importing.logs.tables import Table
from discsim.validation.importing.sniffing import map_text, opened, sniff

LIBRARIES = ("pynmeagps", "pyubx2", "pymavlink", "mcap", "mcap_ros2")
needs_readers = pytest.mark.skipif(
    not all(map(find_spec, LIBRARIES)), reason='no readers of these logs here: pip install "discsim[logs]"'
)


def run(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", *map(str, words)])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def imported(place: Path, name: str, content: bytes) -> tuple[Recording, str]:
    """Return the recording that import makes of a log, and what it says of the log and of the map."""
    (place / name).write_bytes(content)
    said: list[str] = []
    with opened(place / name, said.append) as tables:
        proposal = sniff(tables)
        (place / "map.toml").write_text(map_text(proposal), encoding="utf-8")
        result = import_recording(tables, read_map(place / "map.toml"))
    said += [decision.text for decision in proposal.all_decisions]
    return result.recording, "\n".join([*said, *proposal.notes])


def tables_of(place: Path, name: str, content: bytes) -> Mapping[str, Table]:
    """Return the tables that the reader of a log gives."""
    (place / name).write_bytes(content)
    kind = kind_of(place / name)
    assert kind is not None
    return kind.read(place / name).tables


@functools.cache
def logs() -> dict[str, tuple[bytes, float]]:
    """Logs of the made throw, and how much slower it went."""
    whole, slow = made_log(), made.slowed()
    return {
        "highres.tlog": (made.tlog([*made.highres(whole), *made.gps_raw(made.path())]), 1.0),
        "first-version.tlog": (made.tlog(made.highres(whole), version=1), 1.0),
        "scaled.tlog": (made.tlog(made.scaled(slow)), 2.0),
        "ardupilot.tlog": (made.tlog(made.raw_imu(slow)), 2.0),
        "flight.bin": (made.dataflash(made.ardupilot(whole, made.path())), 1.0),
        "flight.log": (made.dataflash_text(made.ardupilot(whole, made.path())), 1.0),
        "receiver.ubx": (made.ubx_inertial(slow), 2.0),
        "ros.mcap": (made.mcap_cdr(made.ros(whole, made.path())), 1.0),
        "lz4.mcap": (made.mcap_cdr(made.ros(whole, made.path()), "LZ4"), 1.0),
        "json.mcap": (made.mcap_json(made.ros(whole, made.path())), 1.0),
    }


NAMES = ("highres.tlog", "first-version.tlog", "scaled.tlog", "ardupilot.tlog", "flight.bin", "flight.log",
         "receiver.ubx", "ros.mcap", "lz4.mcap", "json.mcap")  # fmt: skip


@needs_readers
@pytest.mark.parametrize("name", ["highres.tlog", "flight.bin", "flight.log", "receiver.ubx", "ros.mcap"])
def test_a_throw_in_a_log_of_messages_gives_its_rate(monkeypatch, tmp_path, capsys, name):
    """Import, check and estimate, as a stranger would; the truth is a rate that decays by 0.15 a second."""
    content, slower = logs()[name]
    (tmp_path / name).write_bytes(content)
    assert run(monkeypatch, "import", tmp_path / name, "--throw", 1, "--out", tmp_path / "out") == 0
    assert "by the gyroscope" in capsys.readouterr().out
    assert run(monkeypatch, "check", tmp_path / "out") == 0
    words = ("--method", "gyroscope", "--out", tmp_path / "spin")
    assert run(monkeypatch, "estimate", tmp_path / "out", *words) == 0
    with (tmp_path / "spin" / "rate.csv").open() as stream:
        rows = [(float(row["time_s"]), float(row["rate_rad_s"])) for row in csv.DictReader(stream) if row["rate_rad_s"]]
    t, rate = np.array(rows).T
    # time zero is the first row of the throw, a tenth of a second at most after the release: 1.5 % of the rate
    truth = SPIN / slower * np.exp(-0.15 * t / slower)
    assert np.all(np.abs(rate / truth - 1) < 0.02)
    gyro = read_recording(tmp_path / "out").samples["gyroscope"]
    assert gyro.t[-1] == pytest.approx(slower * (LANDING - RELEASE), abs=0.2 * slower)


@needs_readers
@pytest.mark.parametrize("name", NAMES)
def test_every_sensor_of_a_log_of_messages_keeps_its_unit_and_its_own_times(tmp_path, name):
    content, slower = logs()[name]
    log = made_log() if slower == 1 else made.slowed()
    recording, _ = imported(tmp_path, name, content)
    # half a step of the sixteen bits (mrad/s, mG, mgauss) and of the ms, us or ns of a stamp, at the steepest edge
    steps = {"gyroscope": 5e-4, "accelerometer": 5e-4 * G0, "magnetometer": 0.05}
    truths = {"gyroscope": log.gyro, "accelerometer": log.accel, "magnetometer": log.mag}
    sensors = [sensor for sensor in truths if not (name == "receiver.ubx" and sensor == "magnetometer")]
    for sensor in sensors:
        samples, truth = recording.samples[sensor], truths[sensor]
        expected = np.column_stack([np.interp(samples.t, log.t, truth[:, k]) for k in range(3)])
        if name == "receiver.ubx" or "scaled" in name:
            assert_allclose(np.median(np.abs(samples.value - expected)), 0.0, atol=2 * steps[sensor], err_msg=sensor)
        assert_allclose(samples.value, expected, atol=2e-4 * np.abs(truth).max() + steps[sensor], err_msg=sensor)
    held = name not in ("scaled.tlog", "ardupilot.tlog", "receiver.ubx")
    if held:
        assert len(recording.samples["magnetometer"]) == log.t[::4].size
    assert ("gps" in recording.samples) == (held and name != "first-version.tlog")


# ------------------------------------------------------------------------------------------------------------- GPS


def fix_logs() -> dict[str, tuple[bytes, tuple[int, ...]]]:
    """Logs of the straight path, and which components of the velocity each tells."""
    fixes = made.path()
    sentences = made.nmea(fixes)
    return {
        "midnight.nmea": (sentences, (0, 1)),
        "course.txt": (made.nmea(fixes, kinds=("GGA", "VTG")), (0, 1)),
        "week.ubx": (made.ubx_fixes(fixes), (0, 1, 2)),
        "split.ubx": (made.ubx_fixes(fixes, split=True), (0, 1, 2)),
        "mixed.ubx": (made.ubx_fixes(fixes) + sentences, (0, 1, 2)),
        "acknowledged.ubx": (made.ubx_frame(b"\x05\x01", b"\x06\x08") + sentences, (0, 1)),
        "telemetry.tlog": (made.tlog(made.gps_raw(fixes)), (0, 1)),
        "navsat.mcap": (made.mcap_cdr([row for row in made.ros(made_log(), fixes) if row[1] == "/fix"]), ()),
    }


@needs_readers
def test_a_damaged_log_adds_no_lines_of_its_reader_to_the_terminal(tmp_path, capfd):
    """Its index is made by C, which writes a line for each byte that begins no message."""
    content = logs()["flight.bin"][0]
    tables_of(tmp_path, "holed.bin", content[:4000] + bytes(300) + content[4000:])
    print("still heard", file=sys.stderr)
    assert capfd.readouterr() == ("", "still heard\n")


@needs_readers
@pytest.mark.parametrize("name", ["midnight.nmea", "course.txt", "week.ubx", "split.ubx", "mixed.ubx",
                                  "acknowledged.ubx", "telemetry.tlog", "navsat.mcap"])  # fmt: skip
def test_fixes_become_metres_north_east_down_of_the_first(tmp_path, name):
    """Steps of 1e-7 degrees are 11 mm, of NMEA's 1e-7 minutes less; mm of height; the earth curves 1 mm in 100 m."""
    content, told = fix_logs()[name]
    gps = imported(tmp_path, name, content)[0].samples["gps"]
    fixes = made.path()
    assert_allclose(gps.t, fixes.t, atol=1e-6)
    assert_allclose(gps.value[:, :3], fixes.ned, atol=0.015)
    for k in range(3):
        expected = made.VELOCITY[k] if k in told else np.nan
        assert_allclose(gps.value[:, 3 + k], expected, atol=6e-3, err_msg=f"velocity {k}")


@needs_readers
def test_fixes_alone_show_no_spin_and_the_estimate_says_so(monkeypatch, tmp_path, capsys):
    (tmp_path / "walk.nmea").write_bytes(made.nmea(made.path()))
    assert run(monkeypatch, "import", tmp_path / "walk.nmea", "--out", tmp_path / "out") == 0
    said = capsys.readouterr().err
    assert "walk.nmea: gps: NMEA sentences hold no velocity downwards; it is a gap" in said
    assert "warning" not in said
    repairs = (tmp_path / "out" / "repairs.csv").read_text()
    assert "comment: # walk.nmea: gps: NMEA" in repairs
    assert "'v_down_m_s' is empty in every row" in repairs
    assert repairs.count("\n") == 3  # a column without a number is one line, not one for each row
    assert run(monkeypatch, "check", tmp_path / "out") == 0
    assert run(monkeypatch, "estimate", tmp_path / "out", "--out", tmp_path / "spin") == 2
    assert "no sensor that shows a spin" in capsys.readouterr().err


@needs_readers
def test_a_receiver_that_stands_keeps_every_fix(tmp_path):
    fixes = made.path()
    standing = made.Path(fixes.t, *(np.full(fixes.t.size, v) for v in (47.4, 8.5, 400.0)), fixes.ned)
    gps = imported(tmp_path, "standing.ubx", made.ubx_fixes(standing))[0].samples["gps"]
    assert len(gps) == fixes.t.size


@needs_readers
def test_sentences_without_a_fix_are_no_place(tmp_path):
    lost = made.nmea(made.path()).replace(b"\r\n", b"\n").split(b"\n")
    text = []
    for k, line in enumerate(lost[:-1]):
        body = line[1:].partition(b"*")[0]
        if k // 3 in (3, 4):  # no fix at the fourth and fifth times
            body = body.replace(b",A,", b",V,") if b"RMC" in body else body.replace(b",E,1,", b",E,0,")
        text.append(b"$%s*%02X\r\n" % (body, functools.reduce(int.__xor__, body)))
    gps = imported(tmp_path, "lost.nmea", b"".join(text))[0].samples["gps"]
    assert_allclose(gps.t, np.delete(made.path().t, [3, 4]), atol=1e-6)


@needs_readers
def test_fixes_of_another_clock_than_the_inertial_sensors_are_left_out_aloud(tmp_path):
    content = made.ubx_inertial(made.slowed()) + made.ubx_fixes(made.path())
    recording, said = imported(tmp_path, "both.ubx", content)
    assert set(recording.samples) == {"gyroscope", "accelerometer"}
    assert "gps: left out; its time of the week and the inertial sensors' local time" in said


# -------------------------------------------------------------------------------------- messages assembled by hand


@needs_readers
def test_sentences_of_the_textbook_are_read_as_it_says(tmp_path):
    """The examples that descriptions of NMEA 0183 print: 48 deg 07.038' N, 22.4 knots at 84.4 degrees, 545.4 m."""
    first = (
        b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n"
        b"$GPRMC,123519,A,4807.038,N,01131.000,E,022.4,084.4,230394,003.1,W*6A\r\n"
    )
    second = (
        b"$GPGGA,123520,4807.138,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*4C\r\n"
        b"$GPVTG,054.7,T,034.4,M,005.5,N,010.2,K*48\r\n"
    )
    gps = tables_of(tmp_path, "book.nmea", first + second)["gps"]
    speed = 22.4 * 1852 / 3600
    expected = [0, 0, 0, speed * np.cos(84.4 * DEG), speed * np.sin(84.4 * DEG), np.nan]
    assert_allclose(gps.value[0], expected, atol=1e-6)
    # 0.1 minutes of latitude at 48 degrees: 111 200 m a degree
    assert gps.value[1, 0] == pytest.approx(0.1 / 60 * 111_200, rel=1e-3)
    knots = 5.5 * 1852 / 3600
    assert_allclose(gps.value[1, 3:5], [knots * np.cos(54.7 * DEG), knots * np.sin(54.7 * DEG)], atol=1e-6)
    # 23 March 1994 is 2110 days before 2000
    noon = 12 * 3600 + 35 * 60 - 2110 * 86400
    assert_allclose(gps.time, [1e6 * (noon + 19), 1e6 * (noon + 20)], rtol=0, atol=1)


@needs_readers
def test_a_fix_assembled_by_the_receivers_manual_is_read(tmp_path):
    """NAV-PVT, 92 bytes: iTOW at 0, fixType 20, flags 21, lon 24, lat 28, height 32, velN, velE, velD 48 on."""

    def frame(week_ms: int, latitude: int) -> bytes:
        payload = bytearray(92)
        struct.pack_into("<I", payload, 0, week_ms)
        payload[20:22] = b"\x03\x01"
        struct.pack_into("<iii", payload, 24, 85_000_000, latitude, 400_000)
        struct.pack_into("<iii", payload, 48, 1200, -340, 56)
        return made.ubx_frame(b"\x01\x07", bytes(payload))

    content = frame(1000, 474_000_000) + frame(1250, 474_000_900)
    gps = tables_of(tmp_path, "hand.ubx", content)["gps"]
    assert_allclose(gps.time, [1e6, 1.25e6])
    assert_allclose(gps.value[:, 3:], [[1.2, -0.34, 0.056]] * 2)
    assert gps.value[1, 0] == pytest.approx(9e-5 * 111_180, rel=1e-3)


def x25(data: bytes) -> int:
    """Return the checksum of MAVLink (CRC-16/MCRF4XX, as its documentation gives it)."""
    crc = 0xFFFF
    for byte in data:
        mixed = (byte ^ crc) & 0xFF
        mixed = (mixed ^ mixed << 4) & 0xFF
        crc = crc >> 8 ^ mixed << 8 ^ mixed << 3 ^ mixed >> 4
    return crc


def scaled_packet(boot_ms: int, values: tuple[int, ...]) -> bytes:
    """Return a stamp and SCALED_IMU (26) of MAVLink 1: 22 bytes, its CRC_EXTRA is 170."""
    body = struct.pack("<BBBBB", 22, boot_ms & 0xFF, 1, 1, 26) + struct.pack("<I9h", boot_ms, *values)
    return (
        struct.pack(">QB", 1_700_000_000_000_000 + 1000 * boot_ms, 0xFE) + body + struct.pack("<H", x25(body + b"\xaa"))
    )


@needs_readers
def test_a_packet_assembled_by_the_documentation_is_read_in_its_units(tmp_path):
    """1000 mG along -z at rest; 500 + k mrad/s; 210, -15, 430 mgauss."""
    packets = [scaled_packet(100 + 10 * k, (3, -2, -1000, 1, 2, 500 + k, 210, -15, 430)) for k in range(40)]
    tables = tables_of(tmp_path, "hand.tlog", b"".join(packets))
    for table in tables.values():
        assert_allclose(table.time, 1e5 + 1e4 * np.arange(40))
    assert_allclose(tables["gyroscope"].value[7], [0.001, 0.002, 0.507])
    assert_allclose(tables["accelerometer"].value[7], [3e-3 * G0, -2e-3 * G0, -G0])
    assert_allclose(tables["magnetometer"].value[7], [21.0, -1.5, 43.0])
    assert [table.unit for table in tables.values()] == ["rad/s", "m/s^2", "uT"]


def record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def text(value: str) -> bytes:
    return struct.pack("<I", len(value)) + value.encode()


@needs_readers
def test_a_record_assembled_by_the_specification_of_mcap_is_read(tmp_path):
    """Header, schema, channel, messages in CDR (little endian, aligned to 8 behind its four bytes), end and footer."""
    schema = struct.pack("<H", 1) + text("sensor_msgs/msg/Imu") + text("ros2msg") + text(made.IMU + made.COMMON)
    channel = struct.pack("<HH", 1, 1) + text("/imu") + text("cdr") + struct.pack("<I", 0)
    whole = b"\x89MCAP0\r\n" + record(1, text("ros2") + text("by hand"))
    whole += record(
        3, struct.pack("<H", 1) + text("sensor_msgs/msg/Imu") + text("ros2msg") + text(made.IMU + made.COMMON)
    )
    assert whole.endswith(schema)
    whole += record(4, channel)
    for k in range(20):
        # sec, nanosec, a name of four bytes with its zero: 4 + 4 + 4 + 4 = 16, so the numbers are aligned
        head = struct.pack("<iII4s", 1_700_000_000, 10_000_000 * k, 4, b"imu\0")
        numbers = [0.0, 0, 0, 1, *[0.0] * 9, 0.01, 0.02, 3 + 0.1 * k, *[0.0] * 9, 0.1, 0.2, -9.8, *[0.0] * 9]
        data = b"\x00\x01\x00\x00" + head + struct.pack("<37d", *numbers)
        whole += record(5, struct.pack("<HIQQ", 1, k, 5, 5) + data)
    whole += record(0x0F, struct.pack("<I", 0)) + record(0x02, struct.pack("<QQI", 0, 0, 0)) + b"\x89MCAP0\r\n"
    tables = tables_of(tmp_path, "hand.mcap", whole)
    assert_allclose(tables["gyroscope"].time, 1e4 * np.arange(20))
    assert_allclose(tables["gyroscope"].value, np.column_stack([[0.01] * 20, [0.02] * 20, 3 + 0.1 * np.arange(20)]))
    assert_allclose(tables["accelerometer"].value, [[0.1, 0.2, -9.8]] * 20)


# ------------------------------------------------------------------------------------------------ damage, refusals


def sentence_of(capsys: pytest.CaptureFixture[str]) -> str:
    said = capsys.readouterr()
    assert said.err.count("\n") == 1
    assert said.out == ""
    return said.err


CUT = {
    "walk.nmea": "1 of 136 NMEA sentences have a wrong checksum or break off",
    "week.ubx": "1 of 46 UBX messages have a wrong checksum or break off",
    "highres.tlog": "1 of 1801 messages have a wrong checksum or break off",
    "flight.bin": "breaks off",
    "flight.log": "lines that break off or are damaged: 1; left out",
    "ros.mcap": "it breaks off or is damaged",
}


@needs_readers
@pytest.mark.parametrize("name", CUT)
def test_a_log_of_messages_that_breaks_off_is_read_up_to_there_and_said(tmp_path, name):
    made_here = {
        "walk.nmea": made.nmea(made.path()),
        "week.ubx": made.ubx_fixes(made.path()),
        "highres.tlog": made.tlog(made.highres(made_log())),
    }
    whole = made_here[name] if name in made_here else logs()[name][0]
    recording, said = imported(tmp_path, name, whole[: int(0.9 * len(whole)) + 20])
    assert CUT[name] in said
    sensor = "gyroscope" if "gyroscope" in recording.samples else "gps"
    assert 8.5 < recording.samples[sensor].t[-1] < 9.6


@needs_readers
@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("walk.nmea", "1 of 150 NMEA sentences have a wrong checksum"),
        ("week.ubx", "1 of 50 UBX messages have a wrong checksum"),
        ("highres.tlog", "1 of 2000 messages have a wrong checksum"),
    ],
)
def test_a_message_with_a_wrong_checksum_is_left_out_and_counted(tmp_path, name, sentence):
    fixes = made.path()
    contents = {
        "walk.nmea": (made.nmea(fixes, kinds=("GGA", "GGA", "GGA")), 50),
        "week.ubx": (made.ubx_fixes(fixes), 50),
        "highres.tlog": (made.tlog(made.highres(made_log())), 2000),
    }
    content, messages = contents[name]
    damaged = bytearray(content)
    size = len(content) // messages
    # within a number of the message at the middle, not in what marks its beginning or length
    damaged[size * (messages // 2) + 30] ^= 0x01
    recording, said = imported(tmp_path, name, bytes(damaged))
    assert sentence in said
    sensor, total = ("gyroscope", 2000) if name == "highres.tlog" else ("gps", 50)
    missing = total - len(recording.samples[sensor])
    assert missing == (0 if name == "walk.nmea" else 1)  # each time is told by three sentences there


@needs_readers
def test_bytes_between_messages_do_not_end_a_log(tmp_path):
    """Noise as long as a page, in a DataFlash log and in telemetry, costs the messages under it alone."""
    noise = np.random.default_rng(3).integers(0, 256, 600, dtype=np.uint8).tobytes()
    log = made_log()
    for name, content in (("holed.bin", logs()["flight.bin"][0]), ("holed.tlog", made.tlog(made.highres(log)))):
        middle = len(content) // 2
        place = tmp_path / name.partition(".")[2]
        place.mkdir()
        recording, said = imported(place, name, content[:middle] + noise + content[middle:])
        assert "are left out" in said
        gyro = recording.samples["gyroscope"]
        assert log.t.size - 20 < len(gyro) <= log.t.size
        assert gyro.t[-1] == pytest.approx(log.t[-1], abs=1e-6)


def empty() -> dict[str, tuple[bytes, str]]:
    """Logs without a sensor in them, and what is said."""
    from pymavlink.dialects.v20.ardupilotmega import MAVLink_gps_raw_int_message, MAVLink_heartbeat_message

    fixless = MAVLink_gps_raw_int_message(9, 1, *[0] * 8)
    beats = [(0.1 * k, MAVLink_heartbeat_message(1, 3, 0, 0, 4, 3)) for k in range(20)]
    battery = [(t, k.replace("imu", "battery"), "sensor_msgs/msg/BatteryState", c)
               for t, k, _, c in made.ros(made_log(), made.path())[:9]]  # fmt: skip
    log = made_log()
    untagged = made.ubx_inertial(Log(log.t[:20], log.gyro[:20], log.accel[:20], log.mag[:20]), tagged=False)
    return {
        "sky.nmea": (b"$GPGSV,1,1,00*79\r\n" * 9, "is a log of NMEA sentences without readings of motion in it"),
        "unchecked.nmea": (b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,,M,,*00\r\n" * 9,
                           "is a damaged log of NMEA sentences without readings of motion in it (9 of 9 NMEA"),
        "acknowledged.ubx": (made.ubx_frame(b"\x05\x01", b"\x06\x08") * 5, "is a u-blox UBX log without readings"),
        "untagged.ubx": (untagged, "20 messages of inertial sensors have no time in a stated unit"),
        "begun.ubx": (b"\xb5\x62\x01\x07" + bytes(100), "is a damaged u-blox UBX log without readings of motion"),
        "beats.tlog": (made.tlog(beats), "is a MAVLink telemetry log without readings of motion in it;"),
        "fixless.tlog": (made.tlog([(0.1 * k, fixless) for k in range(9)]), "is a MAVLink telemetry log without"),
        "formats.bin": (made.dataflash([]), "is an ArduPilot DataFlash log without readings of motion in it"),
        "formats.log": (made.dataflash_text([]), "is an ArduPilot DataFlash log without readings of motion in it"),
        "battery.mcap": (made.mcap_json(battery), "is an MCAP log without readings of motion in it; expected"),
        "ros1.mcap": (made.mcap_json(made.ros(made_log(), made.path())[:50], "ros1"), "its encoding is ros1"),
        "magic.mcap": (b"\x89MCAP1\r\n" + bytes(range(1, 32)) * 9, "is binary, no text"),
        "magic.tlog": (bytes([0x55]) + made.tlog(beats)[1:], "is binary, no text"),
        "head.mcap": (b"\x89MCAP0\r\n" + bytes(40), "is a damaged MCAP log without readings of motion in it"),
    }  # fmt: skip


EMPTY = ("sky.nmea", "unchecked.nmea", "acknowledged.ubx", "untagged.ubx", "begun.ubx", "beats.tlog",
         "fixless.tlog", "formats.bin", "formats.log", "battery.mcap", "ros1.mcap", "magic.mcap", "magic.tlog",
         "head.mcap")  # fmt: skip


@needs_readers
@pytest.mark.parametrize("name", EMPTY)
def test_a_log_of_messages_without_a_reading_is_refused_in_one_sentence(monkeypatch, tmp_path, capsys, name):
    content, sentence = empty()[name]
    (tmp_path / name).write_bytes(content)
    assert run(monkeypatch, "import", tmp_path / name, "--out", tmp_path / "out") == 2
    assert sentence in sentence_of(capsys)


@needs_readers
def test_two_logs_glued_together_are_read_as_the_first_and_the_rest_is_counted(tmp_path):
    content = made.tlog(made.highres(made_log())) + made.ubx_fixes(made.path())
    recording, said = imported(tmp_path, "glued.tlog", content)
    assert "1 of 2001 messages have a wrong checksum or break off" in said
    assert set(recording.samples) == {"gyroscope", "accelerometer", "magnetometer"}


@needs_readers
def test_of_two_vehicles_and_of_two_sensors_one_is_taken_and_the_other_named(tmp_path):
    log = made_log()
    short = Log(log.t[::3], 1.2 * log.gyro[::3], log.accel[::3], log.mag[::3])
    content = made.tlog(made.highres(log)) + made.tlog(made.highres(short), system=7)
    recording, said = imported(tmp_path, "two.tlog", content)
    assert "vehicle 1 is taken; left out: 7" in said
    assert len(recording.samples["gyroscope"]) == log.t.size
    _, said = imported(tmp_path, "flight.bin", logs()["flight.bin"][0])
    assert "gyroscope: IMU 0 is taken (2000 readings); left out: IMU 1 (250)" in said


@needs_readers
def test_a_board_without_a_magnetometer_has_none_and_a_rest_at_zero_stays(tmp_path):
    log = made.slowed()
    still = log.gyro * (log.t > 6.0)[:, None]  # an autopilot takes the bias off: at rest it writes zeros
    content = made.tlog(made.scaled(Log(log.t, still, log.accel, 0 * log.mag)))
    recording, said = imported(tmp_path, "flight.tlog", content)
    assert "magnetometer: all its readings are zero; left out" in said
    assert set(recording.samples) == {"gyroscope", "accelerometer"}
    assert len(recording.samples["gyroscope"]) == log.t.size


@needs_readers
def test_raw_readings_of_another_autopilot_are_counts(tmp_path):
    """RAW_IMU has no unit by the protocol: that of ArduPilot is known, else readings are taken for counts."""
    _, said = imported(tmp_path, "raw.tlog", made.tlog(made.raw_imu(made.slowed(), autopilot=12)))
    assert "the header says so; up to" not in said
    assert "a count" in said


@pytest.mark.parametrize(
    ("name", "library", "kind"),
    [
        ("walk.nmea", "pynmeagps", "a log of NMEA sentences"),
        ("walk.ubx", "pyubx2", "a u-blox UBX log"),
        ("hand.tlog", "pymavlink", "a MAVLink telemetry log"),
        ("hand.bin", "pymavlink", "an ArduPilot DataFlash log"),
        ("hand.mcap", "mcap", "an MCAP log"),
    ],
)
def test_without_its_reader_the_sentence_names_the_extra(monkeypatch, tmp_path, capsys, name, library, kind):
    contents = {
        "walk.nmea": b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n",
        "walk.ubx": made.ubx_frame(b"\x01\x07", bytes(92)),
        "hand.tlog": scaled_packet(100, (1,) * 9) * 2,
        "hand.bin": made.dataflash([]),
        "hand.mcap": b"\x89MCAP0\r\n" + record(1, text("ros2") + text("by hand")),
    }
    found = builtins.__import__

    def absent(module, *rest, **more):
        if module.split(".")[0] == library:
            raise ImportError(module)
        return found(module, *rest, **more)

    (tmp_path / name).write_bytes(contents[name])
    monkeypatch.setattr(builtins, "__import__", absent)
    assert run(monkeypatch, "import", tmp_path / name, "--out", tmp_path / "out") == 2
    said = sentence_of(capsys)
    assert f'is {kind}, whose reader is not installed; get it by: pip install "discsim[logs]"' in said


@needs_readers
def test_the_checksum_of_a_chunk_is_held_against_what_is_in_it(tmp_path):
    """A chunk that is not packed and has one bit turned: it is not read, and neither is what comes after it."""
    content = bytearray(made.mcap_cdr(made.ros(made_log(), made.path()), "NONE"))
    at = content.index(b"imu\0", len(content) // 2)
    content[at + 200] ^= 0x10
    recording, said = imported(tmp_path, "bit.mcap", bytes(content))
    assert "crc" in said.lower()
    assert 3.0 < recording.samples["gyroscope"].t[-1] < 5.5


@needs_readers
def test_a_makers_own_sentences_that_may_hold_motion_are_named_with_a_table_of_them(tmp_path):
    """They were left out in silence, and a log of them alone was said to hold no motion."""

    def sentence(text: str) -> str:
        return f"${text}*{reduce(xor, text.encode()):02X}"

    lines = [sentence(f"GTIMU,2315,{387263 + 0.01 * k:.3f},0.1,0.2,{k},0.01,0.02,1.0,38.2") for k in range(200)]
    raw = tmp_path / "unit.log"
    for fixes in (0, 2):
        more = [sentence(f"GPGGA,1235{k:02d},4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,") for k in range(fixes)]
        raw.write_text("\n".join([*more, *lines, ""]))
        said: list[str] = []
        try:
            with opened(raw, said.append):
                assert fixes
        except InputError as error:
            assert not fixes
            said.append(str(error))
        assert "GTIMU: 200 sentences that are not read; a table of them: sed -n 's/^[$]GTIMU,//p'" in " ".join(said)
