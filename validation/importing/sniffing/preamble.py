"""What the lines above a table say. Takes lines; gives the rate of the rows, and what a sensor's count is worth."""

from __future__ import annotations

import re
from collections.abc import Sequence

from discsim.validation.importing.sniffing.units import COUNTS, Reading, readings_of

__all__ = ["stated_rate", "stated_worths"]

_NUMBER = r"(\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
_HERTZ = re.compile(rf"{_NUMBER}\s*_?(k?)Hz(?![A-Za-z])", re.IGNORECASE)
#: Words before a number of rows a second where the unit is not written.
_RATE = re.compile(
    rf"(?:sampl\w*[ _-]*(?:rate|freq\w*)|(?:data|output|measurement)[ _-]*rate|\bodr\b)"
    rf"\W{{0,4}}(?:(k?)Hz\W{{0,4}}(?:[_.]+ *)?)?{_NUMBER}(?![\d.,]*\s*k?(?:baud|bps|bits?\b))(?:\s*_?(k)Hz)?",
    re.IGNORECASE,
)
#: A frequency that stands beside these is another one.
_OTHER = re.compile(r"baud|filter|cut-?off|bandwidth|\bd?lpf\b|cpu|clock|i2c|spi\b|mains", re.IGNORECASE)
#: ... but not one that comes before them: "at 30 Hz  Filter Normal" (ActiGraph).
_AT = re.compile(rf"\bat\s+{_NUMBER}\s*(k?)Hz\b", re.IGNORECASE)
_COUNT = r"(?:LSB|digit|count|bit)s?"
_WORTH = re.compile(rf"{_NUMBER}\s*([^\s\d,;:=()]+)\s*(?:/|\bper\b)\s*{_COUNT}\b", re.IGNORECASE)
_PER_UNIT = re.compile(rf"{_NUMBER}\s*{_COUNT}\s*(?:/|\bper\b)\s*\(?([^\s\d,;:=()]+)", re.IGNORECASE)
#: A line of Gyroflow's logs (gcsv), whose readings are counts: worth so much of the sensor's unit.
_GYROFLOW = re.compile(rf"^\s*([agm])scale\s*[,;=:]\s*{_NUMBER}\s*$", re.IGNORECASE)
_SCALED = {"a": ("accelerometer", "g"), "g": ("gyroscope", "rad/s"), "m": ("magnetometer", "gauss")}


def stated_rate(lines: Sequence[str]) -> tuple[float, str] | None:
    """Return the rows a second that the lines state, and the line; None where they state none, or several.

    >>> stated_rate(["# Device: X, I2C 400 kHz", "# Sampling rate: 200 Hz"])
    (200.0, '# Sampling rate: 200 Hz')
    >>> stated_rate(["Measurement rate, Hz ___________ 1000"])
    (1000.0, 'Measurement rate, Hz ___________ 1000')
    >>> stated_rate(["# Config: data_rate = 2000.0 Hz, filter = 488 Hz"])
    (2000.0, '# Config: data_rate = 2000.0 Hz, filter = 488 Hz')
    >>> stated_rate(["Created by ActiGraph at 30 Hz  Filter Normal"])
    (30.0, 'Created by ActiGraph at 30 Hz  Filter Normal')
    """
    found = {}
    for line in lines:
        if (other := _OTHER.search(line)) is not None:
            before = line[: other.start()]
            found.update({_value(m[1]) * (1000 if m[2] else 1): line.strip() for m in _AT.finditer(before)})
            continue
        rates = [_value(m[1]) * (1000 if m[2] else 1) for m in _HERTZ.finditer(line)]
        rates = rates or _rates_by_words(line)
        found.update({rate: line.strip() for rate in rates if rate > 0})
    if not found:  # beside other frequencies the one that its words call the rate of the rows
        found = {rate: line.strip() for line in lines for rate in _rates_by_words(line) if rate > 0}
    return next(iter(found.items())) if len(found) == 1 else None


def _rates_by_words(line: str) -> list[float]:
    return [_value(m[2]) * (1000 if m[1] or m[3] else 1) for m in _RATE.finditer(line)]


def stated_worths(lines: Sequence[str]) -> dict[str, Reading]:
    """Return what one count of a sensor is worth, by the sensor, where the lines state it ("70 mdps/LSB").

    >>> stated_worths(["# gyro: 16.4 LSB/dps"])["gyroscope"].unit
    'deg/s'
    >>> stated_worths(["GYROFLOW IMU LOG", "gscale,0.00122173047"])["gyroscope"].scale
    0.00122173047
    """
    scaled = [(_SCALED[m[1].lower()], _value(m[2])) for m in map(_GYROFLOW.match, lines) if m is not None]
    found: dict[str, Reading | None] = {sensor: Reading(sensor, unit, worth) for (sensor, unit), worth in scaled}
    for line in lines:
        worths = [(m[2], _value(m[1])) for m in _WORTH.finditer(line)]
        worths += [(m[2], 1 / _value(m[1])) for m in _PER_UNIT.finditer(line) if _value(m[1]) > 0]
        for spelling, worth in worths:
            meant = readings_of(spelling)
            if meant and meant[0].sensor not in (COUNTS, "other", "time"):
                reading = meant[0]._replace(scale=meant[0].scale * worth)
                same = found.setdefault(reading.sensor, reading) == reading
                found[reading.sensor] = reading if same else None  # two parts of a kind: which is meant is open
    return {sensor: reading for sensor, reading in found.items() if reading is not None}


def _value(text: str) -> float:
    return float(text.replace(",", "."))
