"""MAVLink telemetry (.tlog) as tables: each message behind the time at which the ground station received it.

Units are those of MAVLink's common message set (mavlink.io, "common.xml"): SCALED_IMU, SCALED_IMU2 and SCALED_IMU3 mG,
mrad/s, mgauss and ms since boot; HIGHRES_IMU m/s^2, rad/s, gauss and us; GPS_RAW_INT 1e-7 degrees, mm above the sea,
cm/s, 0.01 degrees. RAW_IMU has no unit there; ArduPilot fills it in SCALED_IMU's (GCS_MAVLINK::send_raw_imu).
Stamps are the vehicle's: those of the ground station come late by what the radio takes.
"""

from __future__ import annotations

import struct
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from discsim.validation.importing.import_map import G0
from discsim.validation.importing.logs.tables import Log, Rows, Table, chosen, course_velocity

__all__ = ["MESSAGES", "begins", "read"]

MESSAGES = ("HIGHRES_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3", "RAW_IMU", "GPS_RAW_INT")
#: Worth of one in the tables' units, of the gyroscope, accelerometer and magnetometer.
MILLI = (1e-3, 1e-3 * G0, 0.1)
WORTH = {"HIGHRES_IMU": (1.0, 1.0, 100.0), "RAW_IMU": (1.0, 1.0, 1.0)}
FIELDS = {"gyroscope": "gyro", "accelerometer": "acc", "magnetometer": "mag"}
#: Bits of HIGHRES_IMU's fields_updated by sensor (HIGHRES_IMU_UPDATED_FLAGS).
UPDATED = {"accelerometer": 0x007, "gyroscope": 0x038, "magnetometer": 0x1C0}
#: MAV_AUTOPILOT_ARDUPILOTMEGA, and what GPS_RAW_INT has for a speed or course that is not known.
ARDUPILOT, UNKNOWN = 3, 0xFFFF
#: First byte of a packet, version 1 and 2, and its bytes beside the payload; a signature has 13 more.
OVERHEAD, SIGNED, SIGNATURE = {0xFE: 8, 0xFD: 12}, 0x01, 13
STAMP = 8  # bytes of the time of reception, us since 1970, the highest first
#: Times of reception that are believed: 2001 to 2100. Before the ground station has a clock there is none of flights.
SPAN = (0.98e15, 4.1e15)
#: A stamp above this is us since 1970 (in 2001 and later), one below since boot (30 years of it).
SINCE_1970 = 1e15


def begins(head: bytes) -> bool:
    """Tell a telemetry log: two packets with their stamps one behind the other, or one that is all."""
    size = _size(head, 0)
    return size > 0 and (_size(head, size) > 0 or len(head) == size)


def read(raw: Path) -> Log:
    """Return the tables of the vehicle with the most readings."""
    content = raw.read_bytes()
    vehicles: dict[int, Rows] = defaultdict(Rows)
    counts: Counter[int] = Counter()
    pilots: dict[tuple[int, int], int] = {}
    wrong = total = 0
    for message in _messages(content):
        total += 1
        wrong += message is None
        if message is None or message.get_type() not in (*MESSAGES, "HEARTBEAT"):
            continue
        vehicle = message.get_srcSystem()
        if message.get_type() == "HEARTBEAT":
            pilots.setdefault((vehicle, message.get_srcComponent()), message.autopilot)
        else:
            counts[vehicle] += _add(message, vehicles[vehicle])
    notes = [f"{wrong} of {total} messages have a wrong checksum or break off; they are left out"] * (wrong > 0)
    telling = [vehicle for vehicle, count in counts.most_common() if count]
    if not telling:
        return Log({}, tuple(notes), wrong > 0)
    vehicle, *others = telling
    if others:
        notes.append(f"vehicle {vehicle} is taken; left out: {'; '.join(map(str, others))}")
    sources = vehicles[vehicle].sources(counts=("RAW_IMU",))
    if "RAW_IMU" in sources and ARDUPILOT in (pilot for (one, _), pilot in pilots.items() if one == vehicle):
        sources["RAW_IMU"] = _milli(sources["RAW_IMU"])
    tables, said = chosen(sources)
    tables, other = _one_clock(tables)
    return Log(tables, (*notes, *said, *other), wrong > 0)


def _size(content: bytes, at: int) -> int:
    """Return the bytes of a stamp and its packet, 0 where there is none."""
    head = content[at : at + STAMP + 3]
    if len(head) < STAMP + 3 or head[STAMP] not in OVERHEAD:
        return 0
    if not SPAN[0] < struct.unpack_from(">Q", head)[0] < SPAN[1]:
        return 0
    signed = head[STAMP] == 0xFD and head[STAMP + 2] & SIGNED
    return STAMP + OVERHEAD[head[STAMP]] + head[STAMP + 1] + (SIGNATURE if signed else 0)


def _messages(content: bytes) -> Iterator[Any]:
    """Yield the messages; None for each one that is damaged, or bytes that are none."""
    from pymavlink.dialects.v20 import ardupilotmega as dialect

    known = {number for number, kind in dialect.mavlink_map.items() if kind.msgname in (*MESSAGES, "HEARTBEAT")}
    link = dialect.MAVLink(None)

    def decoded(packet: bytes) -> Any:
        number = packet[5] if packet[0] == 0xFE else int.from_bytes(packet[7:10], "little")
        if number not in known:
            return _Unused  # stepped over: its checksum would take most of the time
        try:
            return link.decode(bytearray(packet))
        except dialect.MAVError:
            return None

    at, lost = 0, False
    while at < len(content):
        size = _size(content, at)
        whole = size > 0 and at + size <= len(content)
        message = decoded(content[at + STAMP : at + size]) if whole else None
        if message is not None or not lost:  # a stretch of bytes that are none counts once
            yield message
        # of a damaged message the length may be right: then the next one follows it
        follows = whole and (at + size == len(content) or _size(content, at + size) > 0)
        lost = message is None and not follows
        at += 1 if lost else size


class _Unused:
    @staticmethod
    def get_type() -> str:
        return ""


def _add(message: Any, rows: Rows) -> int:
    """Add a message's readings and return their number."""
    kind = message.get_type()
    if kind == "GPS_RAW_INT":
        if message.fix_type < 3:  # GPS_FIX_TYPE_3D_FIX
            return 0
        speed = np.nan if message.vel == UNKNOWN else 0.01 * message.vel
        course = np.nan if message.cog == UNKNOWN else 0.01 * message.cog
        fix = (1e-7 * message.lat, 1e-7 * message.lon, 1e-3 * message.alt, *course_velocity(speed, course), np.nan)
        rows.add(kind, "gps", message.time_usec, fix)
        return 1
    time = message.time_usec if hasattr(message, "time_usec") else 1e3 * message.time_boot_ms
    updated = getattr(message, "fields_updated", 0) & 0x1FF
    added = 0
    for (sensor, name), worth in zip(FIELDS.items(), WORTH.get(kind, MILLI), strict=True):
        values = [worth * getattr(message, f"{axis}{name}") for axis in "xyz"]
        fresh = not updated or updated & UPDATED[sensor] == UPDATED[sensor]
        if fresh:
            rows.add(kind, sensor, time, values)
            added += 1
    return added


def _milli(tables: Mapping[str, Table]) -> dict[str, Table]:
    """Return tables of counts as mrad/s, mG and mgauss, in the tables' units."""
    worths = dict(zip(FIELDS, zip(MILLI, ("rad/s", "m/s^2", "uT"), strict=True), strict=True))
    return {
        sensor: Table(table.time, worths[sensor][0] * table.value, worths[sensor][1])
        for sensor, table in tables.items()
    }


def _one_clock(tables: dict[str, Table]) -> tuple[dict[str, Table], list[str]]:
    """Return the tables on the first one's clock: since boot or since 1970, which the size of a stamp tells."""
    if not tables:
        return tables, []
    first = next(iter(tables.values()))
    dated = bool(np.median(first.time) > SINCE_1970)
    other = [name for name, table in tables.items() if bool(np.median(table.time) > SINCE_1970) != dated]
    clocks = ("since boot", "since 1970")
    notes = [f"{name}: left out; its stamps count {clocks[not dated]} and the rest {clocks[dated]}" for name in other]
    return {name: table for name, table in tables.items() if name not in other}, notes
