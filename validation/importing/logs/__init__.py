"""Logs that are no text, or text of sentences: read by well-kept libraries, given as one table per sensor.

`kind_of` tells by a file's first bytes what log it is, `write_tables` writes its tables as the text that import reads:
one file per sensor, each with its own times on the log's one clock.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.logs import dataflash, gpx, mavlink, mcap, nmea, ubx, ulog
from discsim.validation.importing.logs.tables import Log, write_table

__all__ = ["Kind", "kind_of", "write_tables"]

#: Bytes of a file's beginning that tell what it is.
HEAD = 1 << 16


class Kind(NamedTuple):
    """A kind of log: its name with its article, how its first bytes are told, its reader, and what it should hold.

    ``fixes``: it is a receiver's and holds positions alone, and so it may stand beside another log.
    """

    name: str
    begins: Callable[[bytes], bool]
    read: Callable[[Path], Log]
    holds: str
    tool: str
    fixes: bool = False


#: UBX comes before NMEA: receivers mix both in one log.
KINDS = (
    Kind("a PX4 ULog", ulog.begins, ulog.read, f"one of the topics {', '.join(ulog.TOPICS)}", "ulog_info"),
    Kind("an ArduPilot DataFlash log", dataflash.begins, dataflash.read, "messages IMU, MAG or GPS", "mavlogdump.py"),
    Kind("an MCAP log", mcap.begins, mcap.read, f"sensor_msgs {', '.join(mcap.MESSAGES)}", "`mcap doctor`"),
    Kind("a MAVLink telemetry log", mavlink.begins, mavlink.read, ", ".join(mavlink.MESSAGES), "mavlogdump.py"),
    Kind("a u-blox UBX log", ubx.begins, ubx.read, "NAV-PVT, NAV-POSLLH or ESF-MEAS with times", "pyubx2"),
    Kind(
        "a log of NMEA sentences", nmea.begins, nmea.read, f"{', '.join(nmea.SENTENCES)} with a fix", "pynmeagps", True
    ),
    Kind("a GPX track", gpx.begins, gpx.read, "points of a track with times", "a viewer of maps", True),
)


def kind_of(path: Path) -> Kind | None:
    """Return what log a file is, None where it is none of these (or cannot be read: the reader of text says why)."""
    if not path.is_file():
        return None
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD)
    except OSError:
        return None
    return next((kind for kind in KINDS if kind.begins(head)), None)


def write_tables(raw: Path, kind: Kind, folder: Path) -> tuple[str, ...]:
    """Write a file per sensor that a log has into ``folder``, and return what to say of the log.

    Raises `InputError` where the reader is not installed, the log cannot be read or holds no sensor.
    """
    damaged = f"a damaged {kind.name.partition(' ')[2]}"
    try:
        log = kind.read(raw)
    except ImportError:
        raise InputError.at(
            raw, None, f'is {kind.name}, whose reader is not installed; get it by: pip install "discsim[logs]"'
        ) from None
    except Exception as error:  # whatever a parser of bytes stumbles on in a damaged file
        what = str(error) or type(error).__name__
        raise InputError.at(raw, None, f"is {damaged} ({what}); expected one that {kind.tool} reads") from None
    if not log.tables:
        name = damaged if log.damaged else kind.name
        said = f" ({'; '.join(log.notes)})" if log.notes else ""
        raise InputError.at(raw, None, f"is {name} without readings of motion in it{said}; expected {kind.holds}")
    notes = tuple(f"{raw.name}: {note}" for note in log.notes)
    for sensor, table in log.tables.items():
        write_table(folder / f"{sensor}.csv", sensor, table, notes, dated=log.dated)
    return notes
