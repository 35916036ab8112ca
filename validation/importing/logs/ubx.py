"""u-blox's UBX protocol as tables: the fixes of a receiver, or the inertial sensors in it.

Units are those of u-blox's protocol (UBX-13003221, "UBX Protocol" and "ESF Measurement Data"). NAV-PVT and NAV-POSLLH:
degrees, mm; velocities mm/s in NAV-PVT, cm/s in NAV-VELNED; time of the GPS week in ms. ESF-MEAS: gyroscope 2^-12
deg/s and accelerometer 2^-10 m/s^2, with a time tag whose unit is stated only where it is calibrated: receiver local
time, ms. ESF-RAW is not read: neither the unit nor the width of its tags is stated.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.logs import nmea
from discsim.validation.importing.logs.tables import Log, Rows, Table, chosen

__all__ = ["begins", "read"]

SYNC = b"\xb5\x62"
#: What is read, by class and identity of the message.
PVT, POSLLH, VELNED, ESF_MEAS, ESF_RAW = b"\x01\x07", b"\x01\x02", b"\x01\x12", b"\x10\x02", b"\x10\x03"
#: Sensor, axis and worth of one of the 24-bit fields of ESF-MEAS, by its data type.
FIELDS = {
    14: ("gyroscope", 0, np.pi / 180 * 2.0**-12),
    13: ("gyroscope", 1, np.pi / 180 * 2.0**-12),
    5: ("gyroscope", 2, np.pi / 180 * 2.0**-12),
    16: ("accelerometer", 0, 2.0**-10),
    17: ("accelerometer", 1, 2.0**-10),
    18: ("accelerometer", 2, 2.0**-10),
}
#: Bits of ESF-MEAS: a calibrated tag follows the fields, and how many fields there are (the upper five).
TAGGED, COUNT = 1 << 3, 11
WEEK = 604_800_000.0  # ms
#: The accuracy (mm) that NAV-POSLLH states where there is no fix: all its 32 bits.
NO_FIX = 0xFFFFFFFF
LARGEST = 1 << 13  # bytes: the longest messages (raw measurements of some 90 signals) have 3 kB


class _Frame(NamedTuple):
    """A message: class and identity, payload, all of its bytes."""

    kind: bytes
    payload: bytes
    whole: bytes


def begins(head: bytes) -> bool:
    """Tell a log of UBX: it begins with the protocol's two signs, or has a sound message near its beginning."""
    return head.startswith(SYNC) or any(isinstance(frame, _Frame) for frame in _frames(head))


def read(raw: Path) -> Log:
    """Return the tables of a log; its NMEA sentences are read where no message of UBX tells a position."""
    content = raw.read_bytes()
    rows, wrong, total, untagged, fixes = Rows(), 0, 0, 0, _Fixes()
    for frame in _frames(content):
        total += 1
        if frame is None:
            wrong += 1
        elif frame.kind in (PVT, POSLLH, VELNED):
            fixes.add(frame)
        elif frame.kind in (ESF_MEAS, ESF_RAW):
            untagged += not (frame.kind == ESF_MEAS and _measured(frame.payload, rows))
    notes = [f"{wrong} of {total} UBX messages have a wrong checksum or break off; they are left out"] * (wrong > 0)
    if untagged:
        notes.append(f"{untagged} messages of inertial sensors have no time in a stated unit; they are left out")
    tables, _ = chosen(rows.sources())
    tables = {sensor: table._replace(time=_unwrapped(table.time, 2.0**32 * 1e3)) for sensor, table in tables.items()}
    found, said = fixes.tables()
    if tables and found:
        notes.append("gps: left out; its time of the week and the inertial sensors' local time are different clocks")
    elif not tables and not found:
        log = nmea.read_sentences(content)
        return log._replace(notes=(*notes, *log.notes), damaged=log.damaged or wrong > 0)
    return Log(tables or found, (*notes, *(said if not tables else ())), wrong > 0)


def _frames(content: bytes) -> Iterator[_Frame | None]:
    """Yield the messages; None for each stretch of bytes that begins as one and is none."""
    at = content.find(SYNC)
    broken = False
    while at >= 0:
        frame = _frame(content, at)
        if frame is None:
            if not broken:
                yield None
            broken = True
            at = content.find(SYNC, at + 1)
        else:
            broken = False
            yield frame
            at = content.find(SYNC, at + len(frame.whole))


def _frame(content: bytes, at: int) -> _Frame | None:
    """Return the message that begins at a byte: two signs, class, identity, length, payload, Fletcher's checksum."""
    length = int.from_bytes(content[at + 4 : at + 6], "little")
    whole = content[at : at + length + 8]
    if length > LARGEST or len(whole) < length + 8:
        return None
    summed = np.frombuffer(whole[2:-2], dtype=np.uint8).astype(np.int64)
    first = int(summed.sum()) & 0xFF
    second = int((summed * np.arange(summed.size, 0, -1)).sum()) & 0xFF
    return _Frame(whole[2:4], whole[6:-2], whole) if whole[-2:] == bytes((first, second)) else None


# ------------------------------------------------------------------------------------------------------- fixes


class _Fixes:
    """Gathers fixes: of NAV-PVT, or of NAV-POSLLH and NAV-VELNED of the same time."""

    def __init__(self) -> None:
        self._whole = Rows()
        self._places: dict[float, tuple[float, ...]] = {}
        self._velocities: dict[float, tuple[float, ...]] = {}

    def add(self, frame: _Frame) -> None:
        from pyubx2 import UBXReader

        found: Any = UBXReader.parse(frame.whole)
        week = struct.unpack_from("<I", frame.payload)[0]
        if frame.kind == VELNED:
            self._velocities[week] = (0.01 * found.velN, 0.01 * found.velE, 0.01 * found.velD)
        elif frame.kind == POSLLH and found.hAcc < NO_FIX:
            self._places[week] = (found.lat, found.lon, 0.001 * found.height)
        elif frame.kind == PVT and found.gnssFixOk and found.fixType in (2, 3, 4):  # 2D, 3D, 3D with dead reckoning
            height = np.nan if found.fixType == 2 else 0.001 * found.height
            velocity = (0.001 * found.velN, 0.001 * found.velE, 0.001 * found.velD)
            self._whole.add("NAV-PVT", "gps", 1e3 * week, (found.lat, found.lon, height, *velocity))

    def tables(self) -> tuple[dict[str, Table], list[str]]:
        """Return the fixes on a clock without a step at the end of the week."""
        rows = self._whole
        for week, place in self._places.items():
            rows.add("NAV-POSLLH", "gps", 1e3 * week, (*place, *self._velocities.get(week, (np.nan,) * 3)))
        tables, notes = chosen(rows.sources())
        return {name: table._replace(time=_unwrapped(table.time, 1e3 * WEEK)) for name, table in tables.items()}, notes


def _unwrapped(time: FloatArray, width: float) -> FloatArray:
    """Return times without the steps back by ``width`` of a counter that begins anew."""
    return np.asarray(time + width * np.cumsum(np.diff(time, prepend=time[0]) < -width / 2))


# ----------------------------------------------------------------------------------------------------- inertial


def _measured(payload: bytes, rows: Rows) -> bool:
    """Add the fields of an ESF-MEAS; False where it has inertial ones without a time in a stated unit."""
    flags = struct.unpack_from("<H", payload, 4)[0]
    count = (flags >> COUNT) or (len(payload) - 8) // 4
    seen: dict[str, dict[int, float]] = {}
    for word, *_ in struct.iter_unpack("<I", payload[8 : 8 + 4 * count]):
        kind = (word >> 24) & 0x3F
        if kind in FIELDS:
            sensor, axis, worth = FIELDS[kind]
            field = word & 0xFFFFFF
            seen.setdefault(sensor, {})[axis] = worth * (field - (1 << 24) * (field >> 23))
    whole = {sensor: axes for sensor, axes in seen.items() if len(axes) == 3}
    if not whole:
        return True
    if not flags & TAGGED or len(payload) < 12 + 4 * count:
        return False
    time = 1e3 * struct.unpack_from("<I", payload, 8 + 4 * count)[0]
    for sensor, axes in whole.items():
        rows.add("ESF-MEAS", sensor, time, [axes[k] for k in range(3)])
    return True
