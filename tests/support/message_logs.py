"""Made logs of messages: one motion and one straight path as the protocols' own libraries write them."""

from __future__ import annotations

import io
import json
import struct
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from support.made_logs import G0, Log, made_log

DEG = np.pi / 180
ARM = np.array([-0.0161, 0.0, 0.0])
START = 1_700_000_000_000_000_000  # ns since 1970
LATITUDE, LONGITUDE, HEIGHT = 47.4, 8.5, 400.0
VELOCITY = np.array([8.0, -6.0, 1.0])  # m/s, North-East-Down


def slowed() -> Log:
    """Return the made log at half the speed: the sixteen bits of mrad/s and 2^-12 deg/s hold its rates.

    Gravity and lift stay, the centripetal part falls to a quarter, and with it the impact.
    """
    log = made_log()
    whirl = np.cross(log.gyro, np.cross(log.gyro, ARM))
    return Log(2 * log.t, log.gyro / 2, log.accel - 0.75 * whirl, log.mag)


@dataclass(frozen=True)
class Path:
    """Fixes of a straight path: t (n,) s; latitude, longitude (n,) degrees; height (n,) m; ned (n, 3) m."""

    t: np.ndarray
    latitude: np.ndarray
    longitude: np.ndarray
    height: np.ndarray
    ned: np.ndarray


def path(seconds: float = 10.0) -> Path:
    """Return five fixes a second, by the radii of curvature of WGS 84."""
    t = np.arange(0.0, seconds, 0.2)
    ned = t[:, None] * VELOCITY
    sine2 = np.sin(LATITUDE * DEG) ** 2
    normal = 6378137.0 / np.sqrt(1 - 0.00669437999014 * sine2)
    meridian = normal * (1 - 0.00669437999014) / (1 - 0.00669437999014 * sine2)
    latitude = LATITUDE + ned[:, 0] / (meridian + HEIGHT) / DEG
    longitude = LONGITUDE + ned[:, 1] / (normal + HEIGHT) / np.cos(latitude * DEG) / DEG
    return Path(t, latitude, longitude, HEIGHT - ned[:, 2], ned)


# --------------------------------------------------------------------------------------------------------- NMEA


def nmea(fixes: Path, start: float = 86395.0, kinds: tuple[str, ...] = ("RMC", "VTG", "GGA")) -> bytes:
    """Return the sentences, the first ``start`` s after midnight."""
    from pynmeagps import NMEAMessage

    text = b""
    speed, course = float(np.hypot(*VELOCITY[:2])), float(np.degrees(np.arctan2(VELOCITY[1], VELOCITY[0])) % 360)
    for t, latitude, longitude, height in zip(fixes.t, fixes.latitude, fixes.longitude, fixes.height, strict=True):
        time = datetime.fromtimestamp(round((start + t) % 86400, 3), UTC).time()
        place = {"time": time, "lat": latitude, "NS": "N", "lon": longitude, "EW": "E"}
        made = {
            "RMC": {**place, "status": "A", "spd": round(speed * 3600 / 1852, 4), "cog": round(course, 3)},
            "VTG": {"cogt": round(course, 3), "cogtUnit": "T", "sogn": round(speed * 3600 / 1852, 4), "sognUnit": "N"},
            "GGA": {**place, "quality": 1, "numSV": 8, "HDOP": 0.9, "alt": round(height, 3), "altUnit": "M"},
        }
        for kind in kinds:
            text += NMEAMessage("GN", kind, 0, hpnmeamode=1, **made[kind]).serialize()
    return text


# ---------------------------------------------------------------------------------------------------------- UBX


def ubx_fixes(fixes: Path, week_ms: int = 604_795_000, split: bool = False) -> bytes:
    """Return NAV-PVT, or NAV-POSLLH with NAV-VELNED; the GPS week ends on the way."""
    from pyubx2 import UBXMessage

    north, east, down = VELOCITY
    whole = b""
    for t, latitude, longitude, height in zip(fixes.t, fixes.latitude, fixes.longitude, fixes.height, strict=True):
        place = {"iTOW": round(week_ms + 1000 * t) % 604_800_000, "lat": latitude, "lon": longitude}
        place["height"] = round(1000 * height)
        if split:
            velocity = {"velN": round(100 * north), "velE": round(100 * east), "velD": round(100 * down)}
            whole += UBXMessage("NAV", "NAV-POSLLH", 0, **place).serialize()
            whole += UBXMessage("NAV", "NAV-VELNED", 0, iTOW=place["iTOW"], **velocity).serialize()
        else:
            velocity = {"velN": round(1000 * north), "velE": round(1000 * east), "velD": round(1000 * down)}
            whole += UBXMessage("NAV", "NAV-PVT", 0, fixType=3, gnssFixOk=1, **place, **velocity).serialize()
    return whole


def ubx_frame(kind: bytes, payload: bytes) -> bytes:
    """Return a message as u-blox describes it: Fletcher's checksum over class, identity, length and payload."""
    body = kind + struct.pack("<H", len(payload)) + payload
    a = b = 0
    for byte in body:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return b"\xb5\x62" + body + bytes((a, b))


def ubx_inertial(log: Log, tagged: bool = True) -> bytes:
    """Return ESF-MEAS with six fields and the calibrated time tag, or without it."""
    whole = b""
    for t, w, f in zip(log.t, log.gyro, log.accel, strict=True):
        fields = [*zip((14, 13, 5), w / DEG * 2**12, strict=True), *zip((16, 17, 18), f * 2**10, strict=True)]
        words = [kind << 24 | round(value) & 0xFFFFFF for kind, value in fields]
        flags = 6 << 11 | (1 << 3) * tagged
        payload = struct.pack("<IHH6I", 7 * round(1e3 * t), flags, 0, *words)
        payload += struct.pack("<I", round(1e3 * t) + 5000) if tagged else b""
        whole += ubx_frame(b"\x10\x02", payload)
    return whole


# ------------------------------------------------------------------------------------------------------ MAVLink


def tlog(messages: list[tuple[float, object]], version: int = 2, system: int = 1) -> bytes:
    """Return packets behind their times of reception, 30 ms late; messages are of the library, with a time in s."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    link = dialect.MAVLink(None, srcSystem=system, srcComponent=1)
    whole = b""
    for t, message in sorted(messages, key=lambda item: item[0]):
        stamp = struct.pack(">Q", START // 1000 + round(1e6 * (t + 0.03)))
        whole += stamp + bytes(message.pack(link, force_mavlink1=version == 1))
        link.seq = (link.seq + 1) % 256
    return whole


def highres(log: Log) -> list[tuple[float, object]]:
    """Return HIGHRES_IMU; the magnetometer is fresh on every fourth."""
    from pymavlink.dialects.v20.ardupilotmega import MAVLink_highres_imu_message as Message

    rows = enumerate(zip(log.t, log.accel, log.gyro, log.mag / 100, strict=True))
    return [
        (t, Message(3_000_000 + round(1e6 * t), *f, *w, *m, 1013.0, 0.0, 400.0, 20.0, 0x3F | 0x1C0 * (k % 4 == 0)))
        for k, (t, f, w, m) in rows
    ]


def scaled(log: Log) -> list[tuple[float, object]]:
    """Return SCALED_IMU."""
    from pymavlink.dialects.v20.ardupilotmega import MAVLink_scaled_imu_message as Message

    return [(t, Message(3000 + round(1e3 * t), *values)) for t, values in zip(log.t, _milli(log), strict=True)]


def raw_imu(log: Log, autopilot: int = 3) -> list[tuple[float, object]]:
    """Return RAW_IMU as ArduPilot fills it, and a heartbeat of that autopilot."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    beat = (0.0, dialect.MAVLink_heartbeat_message(1, autopilot, 0, 0, 4, 3))
    rows = zip(log.t, _milli(log), strict=True)
    return [beat, *((t, dialect.MAVLink_raw_imu_message(3_000_000 + round(1e6 * t), *v)) for t, v in rows)]


def _milli(log: Log) -> np.ndarray:
    """Return mG, mrad/s and mgauss, (n, 9)."""
    values = np.column_stack([log.accel / G0 * 1e3, log.gyro * 1e3, log.mag * 10])
    return np.clip(np.round(values), -32768, 32767).astype(int).tolist()


def gps_raw(fixes: Path) -> list[tuple[float, object]]:
    """Return GPS_RAW_INT."""
    from pymavlink.dialects.v20.ardupilotmega import MAVLink_gps_raw_int_message as Message

    speed, course = float(np.hypot(*VELOCITY[:2])), float(np.degrees(np.arctan2(VELOCITY[1], VELOCITY[0])) % 360)
    rows = zip(fixes.t, fixes.latitude, fixes.longitude, fixes.height, strict=True)
    motion = (round(100 * speed), round(100 * course), 9)
    return [
        (t, Message(3_000_000 + round(1e6 * t), 3, round(1e7 * a), round(1e7 * b), round(1e3 * h), 90, 90, *motion))
        for t, a, b, h in rows
    ]


# ---------------------------------------------------------------------------------------------------- DataFlash

#: Messages of ArduPilot's log: name, type, format, its struct, columns.
DATAFLASH = {
    "IMU": (0x81, "QBffffffIIfBBHH", "<QBffffffIIfBBHH", 
            "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz"),
    "MAG": (0x82, "QBhhhhhhhhhBI", "<QBhhhhhhhhhBI", "TimeUS,I,MagX,MagY,MagZ,OfsX,OfsY,OfsZ,MOX,MOY,MOZ,Health,S"),
    "GPS": (0x83, "QBBIHBcLLeffffB", "<QBBIHBhiiiffffB", 
            "TimeUS,I,Status,GMS,GWk,NSats,HDop,Lat,Lng,Alt,Spd,GCrs,VZ,Yaw,U"),
}  # fmt: skip


#: what a count is worth of the formats that are scaled: hundredths, and degrees of a place
_SCALED = {"c": 0.01, "L": 1e-7}


def dataflash(rows: list[tuple[float, str, tuple[float, ...]]]) -> bytes:
    """Return a DataFlash log: descriptions of the messages (FMT, one of itself first), then time, name and values."""
    described = [(0x80, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns")]
    for name, (kind, form, packed, columns) in DATAFLASH.items():
        described.append((kind, 3 + struct.calcsize(packed), name.encode(), form.encode(), columns.encode()))
    whole = b"".join(b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", *one) for one in described)
    for t, name, values in sorted(rows, key=lambda row: row[0]):
        kind, _, packed, _ = DATAFLASH[name]
        whole += b"\xa3\x95" + bytes([kind]) + struct.pack(packed, 3_000_000 + round(1e6 * t), *values)
    return whole


def dataflash_text(rows: list[tuple[float, str, tuple[float, ...]]]) -> bytes:
    """Return the same as the text that ArduPilot's tools make of it: scaled numbers between commas and spaces."""
    lines = ["FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns"]
    for name, (kind, form, packed, columns) in DATAFLASH.items():
        lines.append(f"FMT, {kind}, {3 + struct.calcsize(packed)}, {name}, {form}, {columns}")
    for t, name, values in sorted(rows, key=lambda row: row[0]):
        scaled = [_SCALED.get(letter, 1.0) * v for letter, v in zip(DATAFLASH[name][1][1:], values, strict=True)]
        lines.append(f"{name}, {3_000_000 + round(1e6 * t)}, " + ", ".join(f"{value:.9g}" for value in scaled))
    return ("\n".join(lines) + "\n").encode()


def ardupilot(log: Log, fixes: Path) -> list[tuple[float, str, tuple[float, ...]]]:
    """Return rows of a flight: two IMUs, the second slower; the magnetometer at 50 Hz; the GPS."""
    speed, course = float(np.hypot(*VELOCITY[:2])), float(np.degrees(np.arctan2(VELOCITY[1], VELOCITY[0])) % 360)
    rest = (0, 0, 25.0, 1, 1, 1000, 1000)
    rows = [(t, "IMU", (0, *w, *f, *rest)) for t, w, f in zip(log.t, log.gyro, log.accel, strict=True)]
    rows += [
        (t, "IMU", (1, *w, *f, *rest)) for t, w, f in zip(log.t[::8], 1.1 * log.gyro[::8], log.accel[::8], strict=True)
    ]
    milligauss = np.round(10 * log.mag[::4]).astype(int).tolist()
    rows += [(t, "MAG", (0, *m, *(0,) * 6, 1, 0)) for t, m in zip(log.t[::4], milligauss, strict=True)]
    for t, a, b, h in zip(fixes.t, fixes.latitude, fixes.longitude, fixes.height, strict=True):
        place = (round(1e7 * a), round(1e7 * b), round(100 * h))
        rows.append((t, "GPS", (0, 3, 0, 0, 9, 90, *place, speed, course, VELOCITY[2], 0.0, 1)))
    return rows


# --------------------------------------------------------------------------------------------------------- MCAP

IMU = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
"""
FIELD = """std_msgs/Header header
geometry_msgs/Vector3 magnetic_field
float64[9] magnetic_field_covariance
"""
FIX = """std_msgs/Header header
sensor_msgs/NavSatStatus status
float64 latitude
float64 longitude
float64 altitude
float64[9] position_covariance
uint8 position_covariance_type
================================================================================
MSG: sensor_msgs/NavSatStatus
int8 status
uint16 service
"""
COMMON = """================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""


def ros(log: Log, fixes: Path) -> list[tuple[float, str, str, dict[str, object]]]:
    """Return time, topic, type and content of a flight; the magnetometer at 50 Hz, logged 2 ms after its reading."""

    def vector(value: np.ndarray) -> dict[str, float]:
        return dict(zip("xyz", map(float, value), strict=True))

    def header(t: float) -> dict[str, object]:
        stamp = START + round(1e9 * t)
        return {"stamp": {"sec": stamp // 10**9, "nanosec": stamp % 10**9}, "frame_id": "imu"}

    nothing = [0.0] * 9
    rows = []
    for t, w, f in zip(log.t, log.gyro, log.accel, strict=True):
        content = {
            "header": header(t),
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
            "orientation_covariance": [-1.0] + [0.0] * 8,
            "angular_velocity": vector(w),
            "angular_velocity_covariance": nothing,
            "linear_acceleration": vector(f),
            "linear_acceleration_covariance": nothing,
        }
        rows.append((t, "/imu/data_raw", "sensor_msgs/msg/Imu", content))
    for t, m in zip(log.t[::4], log.mag[::4] * 1e-6, strict=True):
        content = {"header": header(t), "magnetic_field": vector(m), "magnetic_field_covariance": nothing}
        rows.append((t + 0.002, "/imu/mag", "sensor_msgs/msg/MagneticField", content))
    for t, a, b, h in zip(fixes.t, fixes.latitude, fixes.longitude, fixes.height, strict=True):
        content = {"header": header(t), "status": {"status": 0, "service": 1}, "position_covariance": nothing}
        content |= {"latitude": a, "longitude": b, "altitude": h, "position_covariance_type": 0}
        rows.append((t, "/fix", "sensor_msgs/msg/NavSatFix", content))
    return sorted(rows, key=lambda row: row[0])


def mcap_cdr(rows: list[tuple[float, str, str, dict[str, object]]], compression: str = "ZSTD") -> bytes:
    """Return a log as ROS 2 writes it, in chunks of 64 kB."""
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream, chunk_size=1 << 16, compression=CompressionType[compression])
    texts = {"Imu": IMU, "MagneticField": FIELD, "NavSatFix": FIX}
    kinds = {kind for *_, kind, _ in rows}
    schemas = {kind: writer.register_msgdef(kind, texts[kind.rpartition("/")[2]] + COMMON) for kind in sorted(kinds)}
    for t, topic, kind, content in rows:
        writer.write_message(topic, schemas[kind], content, log_time=START + round(1e9 * t))
    writer.finish()
    return stream.getvalue()


def mcap_json(rows: list[tuple[float, str, str, dict[str, object]]], encoding: str = "json") -> bytes:
    """Return a log of JSON messages, or of bytes that are said to be in another encoding."""
    from mcap.writer import Writer

    stream = io.BytesIO()
    writer = Writer(stream)
    writer.start()
    channels: dict[str, int] = {}
    for t, topic, kind, content in rows:
        if topic not in channels:
            schema = writer.register_schema(kind, "jsonschema", b'{"type": "object"}')
            channels[topic] = writer.register_channel(topic, encoding, schema)
        stamp = START + round(1e9 * t)
        writer.add_message(channels[topic], stamp, json.dumps(content).encode(), stamp)
    writer.finish()
    return stream.getvalue()
