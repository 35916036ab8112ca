"""An ArduPilot DataFlash log, packed (.bin) or as text (.log), as tables.

Units are those of ArduPilot's "Onboard Message Log Messages": time in us since boot (ms in old ones); IMU (and GYR,
ACC, the fast ones) rad/s and m/s^2; MAG milligauss, offsets applied; GPS degrees, m above the sea, m/s, degrees of
course, and VZ m/s down.
Messages have no checksum: bytes that are none are seen, a number that was damaged is not.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from discsim.validation.importing.logs.tables import Log, Rows, chosen, course_velocity

__all__ = ["MESSAGES", "begins", "read"]

MAGIC = b"\xa3\x95"
#: Messages by their names; old logs number the second and third unit in the name, later ones in the field I.
MESSAGES = ("IMU", "IMU2", "IMU3", "GYR", "ACC", "MAG", "MAG2", "MAG3", "GPS", "GPS2")
#: Sensors of a message: their fields, worth of one in the tables' units, and the field that says whether it is sound.
FIELDS = {
    "IMU": (("gyroscope", "Gyr", 1.0, "GH"), ("accelerometer", "Acc", 1.0, "AH")),
    "GYR": (("gyroscope", "Gyr", 1.0, ""),),
    "ACC": (("accelerometer", "Acc", 1.0, ""),),
    "MAG": (("magnetometer", "Mag", 0.1, "Health"),),
}
FAST = "GYR and ACC"
#: The description of a message in a log as text.
_DESCRIBED = re.compile(rb"(?:^|\n)FMT, ?\d+, ?\d+, ?\w+, ?\w+, ?\w+,")
#: Status of GPS from which on there is a height: 3 is a fix in three dimensions.
FIX_3D = 3
#: Bytes at most that pad a page of a log of blocks: 256, less a header of 6 and one byte (pymavlink's DFReader).
PADDING = 249
#: of two threads that read logs, the second would take the silence of the first for the standard error to go back to
_ONE_BLOCK = threading.Lock()


def begins(head: bytes) -> bool:
    """Tell a DataFlash log: it begins with a message, and the description of one (FMT) is near its beginning."""
    return (head.startswith(MAGIC) and MAGIC + b"\x80" in head) or _is_text(head)


def _is_text(head: bytes) -> bool:
    """Tell a log as text by its beginning, a description of a message; notes of a ground station may stand before."""
    return b"\0" not in head and _DESCRIBED.search(head) is not None


def read(raw: Path) -> Log:
    """Return the tables of a log; bytes that are no message are stepped over and counted."""
    from pymavlink.DFReader import DFReader_binary, DFReader_text

    with raw.open("rb") as stream:
        text = stream.read(len(MAGIC)) != MAGIC
    said = io.StringIO()  # it prints what it finds damaged, and its part in C a line for each such byte
    rows, got = Rows(), 0
    with (
        contextlib.redirect_stdout(said),
        contextlib.redirect_stderr(said),
        _unheard(),
        (DFReader_text if text else DFReader_binary)(str(raw)) as log,
    ):
        wanted = list(MESSAGES)
        while (message := log.recv_match(type=wanted)) is not None:
            got += message.get_type() in wanted
            _add(message, rows)
        if text:
            lost, total = sum(log.counts.get(kind, 0) for kind in wanted) - got, 0
        else:
            lost = log.data_len - sum(log.counts[kind] * form.len for kind, form in log.formats.items())
            total = log.data_len
    notes = []
    if text and lost > 0:
        notes.append(f"lines that break off or are damaged: {lost}; left out")
    elif lost > PADDING:
        notes.append(f"{lost} of {total} bytes are no message and are left out")
    elif lost < 0:
        notes.append("it breaks off within a message; read up to there")
    tables, others = chosen(rows.sources())
    return Log(tables, (*notes, *others), bool(notes))


@contextlib.contextmanager
def _unheard() -> Iterator[None]:
    """Let what C writes to this process's standard error go nowhere inside the block; one block at a time."""
    with _ONE_BLOCK:
        try:
            before = os.dup(2)
        except OSError:  # there is none
            yield
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(before, 2)
            os.close(before)
            os.close(nowhere)


def _add(message: Any, rows: Rows) -> None:
    name = re.sub(r"\d$", "", message.get_type())
    at = re.search(r"\d$", message.get_type())
    unit = int(at[0]) - 1 if at else getattr(message, "I", 0)
    if name == "GPS":
        _add_fix(message, rows, f"GPS {unit}")
        return
    source = f"{FAST if name in ('GYR', 'ACC') else name} {unit}"
    # the fast ones carry the time of the reading apart from that of writing
    time = getattr(message, "SampleUS", 0) or _time(message)
    for sensor, field, worth, sound in FIELDS[name]:
        if not sound or getattr(message, sound, True):
            rows.add(source, sensor, time, [worth * getattr(message, f"{field}{axis}") for axis in "XYZ"])


def _time(message: Any) -> float:
    """Return when a message was written, us since boot."""
    return float(message.TimeUS if hasattr(message, "TimeUS") else 1000 * message.TimeMS)


def _add_fix(message: Any, rows: Rows, source: str) -> None:
    if message.Status < FIX_3D:
        return
    north, east = course_velocity(message.Spd, message.GCrs)
    down = getattr(message, "VZ", np.nan)
    rows.add(source, "gps", _time(message), (message.Lat, message.Lng, message.Alt, north, east, down))
