"""Logs that are no text: sound ones in every format, wrong readings as a logger writes them, and damaged bytes."""

from __future__ import annotations

import random
import struct
from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType

import numpy as np
from support import flight_log, message_logs
from support.made_logs import Log

__all__ = ["LOGS", "mutated_log"]

Files = Mapping[str, str]

#: every format as the library of its makers, or its description, writes it
_WRITERS: Mapping[str, Callable[[Log, message_logs.Path], bytes]] = MappingProxyType(
    {
        "px4.ulg": lambda log, fixes: flight_log.ulog(flight_log.flight(log)),
        "ardupilot.bin": lambda log, fixes: message_logs.dataflash(message_logs.ardupilot(log, fixes)),
        "highres.tlog": lambda log, fixes: message_logs.tlog(
            [*message_logs.highres(log), *message_logs.gps_raw(fixes)]
        ),
        "scaled.tlog": lambda log, fixes: message_logs.tlog(message_logs.scaled(log)),
        "inertial.ubx": lambda log, fixes: message_logs.ubx_inertial(log),
        "fixes.ubx": lambda log, fixes: message_logs.ubx_fixes(fixes),
        "fixes.nmea": lambda log, fixes: message_logs.nmea(fixes),
        "ros.mcap": lambda log, fixes: message_logs.mcap_cdr(message_logs.ros(log, fixes)),
        "json.mcap": lambda log, fixes: message_logs.mcap_json(message_logs.ros(log, fixes)),
    }
)


def _text(content: bytes) -> str:
    return content.decode("utf-8", "surrogateescape")


@cache
def _log() -> Log:
    """Return a second and a half around a release at 50 Hz, half as fast: what sixteen bits hold."""
    whole = message_logs.slowed()
    some = slice(700, 1000, 4)
    return Log(whole.t[some], whole.gyro[some], whole.accel[some], whole.mag[some])


@cache
def _sound(name: str) -> Files:
    return MappingProxyType({name: _text(_WRITERS[name](_log(), message_logs.path(3.0)))})


#: a sound log of each format, as text that stands for its bytes
LOGS: Mapping[str, Callable[[], Files]] = MappingProxyType(
    {name: lambda name=name: _sound(name) for name in _WRITERS}  # type: ignore[misc]
)


def mutated_log(files: Files, rng: random.Random) -> dict[str, str]:
    """Return a log with odd readings, times or places in it, with damaged bytes, or with both."""
    ((name, text),) = files.items()
    content = text.encode("utf-8", "surrogateescape")
    if odd := rng.random() < 0.5:
        # a number that the format has no room for is no log of it
        try:
            content = _WRITERS[name](_odd_log(rng), _odd_path(rng))
        except Exception:  # each library has words of its own for that
            odd = False
    for _ in range(0 if odd and rng.random() < 0.7 else rng.choice((1, 1, 2, 5))):
        content = _damaged(content, rng)
    if name.endswith(".nmea") and rng.random() < 0.5:
        content = _with_sums(content)
    return {name: _text(content)}


_ODD = (0.0, -1.0, 1e-30, 1e4, 1e9, 3e38, 1e300, float("nan"), float("inf"))


def _odd_column(value: np.ndarray, rng: random.Random) -> np.ndarray:
    changed = np.array(value, dtype=np.float64)
    column = changed if changed.ndim == 1 else changed[:, rng.randrange(changed.shape[1])]
    rows = slice(rng.randrange(len(column)), None) if rng.random() < 0.5 else slice(None)
    match rng.randrange(4):
        case 0:
            column[rows] = rng.choice(_ODD)
        case 1:
            column[rng.randrange(len(column))] = rng.choice(_ODD)
        case 2:
            column[rows] *= 10.0 ** rng.randint(-12, 12)
        case _:
            column[rows] += rng.choice((-1.0, 1.0)) * 10.0 ** rng.randint(-9, 9)
    return changed


def _odd_log(rng: random.Random) -> Log:
    log = _log()
    t, gyro, accel, mag = log.t, log.gyro, log.accel, log.mag
    for _ in range(rng.choice((1, 1, 2))):
        match rng.randrange(5):
            case 0:
                t = _odd_column(t, rng)
            case 1:
                gyro = _odd_column(gyro, rng)
            case 2:
                accel = _odd_column(accel, rng)
            case 3:
                mag = _odd_column(mag, rng)
            case _:
                keep = slice(rng.randrange(3), rng.choice((1, 2, 5, 20, None)), rng.choice((1, 1, -1, 7)))
                t, gyro, accel, mag = t[keep], gyro[keep], accel[keep], mag[keep]
        if len(t) == 0:
            return log
    return Log(t, gyro, accel, mag)


def _odd_path(rng: random.Random) -> message_logs.Path:
    fixes = message_logs.path(3.0)
    if rng.random() < 0.4:
        return fixes
    columns = [fixes.t, fixes.latitude, fixes.longitude, fixes.height]
    k = rng.randrange(4)
    columns[k] = _odd_column(columns[k], rng)
    return message_logs.Path(*columns, fixes.ned)


def _damaged(content: bytes, rng: random.Random) -> bytes:
    """Return bytes with one damage: flipped, lost, doubled, moved, cut off, or a number in them made extreme."""
    first = rng.randrange(len(content) + 1)
    last = min(first + rng.choice((1, 2, 4, 8, 60, 500)), len(content))
    piece = content[first:last]
    match rng.randrange(7):
        case 0:
            piece = bytes(byte ^ (1 << rng.randrange(8)) for byte in piece)
        case 1:
            piece = b""
        case 2:
            piece = piece * rng.choice((2, 3, 100))
        case 3:
            piece = rng.randbytes(len(piece))
        case 4:
            return content[:first]
        case 5:
            piece = struct.pack(*rng.choice((("<d", rng.choice(_ODD)), ("<I", 0xFFFFFFFF), ("<q", -1), ("<H", 0xFFFF))))
            last = min(first + len(piece), len(content))
        case _:
            other = rng.randrange(len(content) + 1)
            piece = content[other : other + len(piece)]
    return content[:first] + piece + content[last:]


def _with_sums(content: bytes) -> bytes:
    """Return sentences whose check sums are right whatever is in them."""
    lines = []
    for line in content.split(b"\r\n"):
        body, star, _ = line.partition(b"*")
        total = 0
        for byte in body.removeprefix(b"$"):
            total ^= byte
        lines.append(body + b"*%02X" % total if star else line)
    return b"\r\n".join(lines)
