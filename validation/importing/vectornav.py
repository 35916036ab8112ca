"""Sentences of VectorNav's units, as their serial port and their Control Center write them.

Takes a line; gives names with their units, and cells. What the sentences hold and their units are those of the VN-100's
interface control document ("ASCII Output Measurements"): magnetometer in gauss, accelerometer in m/s^2, gyroscope in
rad/s, angles in degrees. None holds a time.
"""

from __future__ import annotations

import re
from binascii import crc_hqx
from functools import reduce
from operator import xor

__all__ = ["BEGINS", "sentence_cells"]

#: What such a line begins with.
BEGINS = "$VN"

_ANGLES = ("yaw (deg)", "pitch (deg)", "roll (deg)")
_UNITS = {"mag": "gauss", "accel": "m/s^2", "gyro": "rad/s"}
_MOTION = tuple(f"{name}_{axis} ({unit})" for name, unit in _UNITS.items() for axis in "xyz")
#: sentence -> names of its cells
_SENTENCES = {
    "VNIMU": (*_MOTION, "temperature (C)", "pressure (kPa)"),
    "VNMAR": _MOTION,
    "VNYMR": (*_ANGLES, *_MOTION),
    "VNQMR": (*(f"quaternion_{k}" for k in range(4)), *_MOTION),
    "VNMAG": _MOTION[:3],
    "VNACC": _MOTION[3:6],
    "VNGYR": _MOTION[6:],
}
_SENTENCE = re.compile(r"\$((VN[A-Z]{3}),([^*]*))\*(XX|[0-9A-F]{4}|[0-9A-F]{2})$")


def sentence_cells(line: str) -> list[tuple[str, str]]:
    """Return names and cells of a sentence; empty where it is broken off, has a wrong checksum or holds no motion.

    >>> sentence_cells("$VNGYR,+00.001222,-00.000450,+00.000986*7E")
    [('gyro_x (rad/s)', '+00.001222'), ('gyro_y (rad/s)', '-00.000450'), ('gyro_z (rad/s)', '+00.000986')]
    """
    match = _SENTENCE.match(line.strip())
    if match is None:
        return []
    text, kind, cells, written = match[1].encode(), match[2], match[3].split(","), match[4]
    names = _SENTENCES.get(kind, ())
    if len(cells) != len(names) or not _sound(text, written):
        return []
    return list(zip(names, cells, strict=True))


def _sound(text: bytes, written: str) -> bool:
    """Tell whether a checksum is that of a sentence: of 8 bits or 16, or switched off (XX)."""
    if written == "XX":
        return True
    return int(written, 16) == (reduce(xor, text) if len(written) == 2 else crc_hqx(text, 0))
