"""Units as loggers spell them. Takes a spelling; gives what sensors have that unit, and the map's word for it."""

from __future__ import annotations

import re
import unicodedata
from typing import NamedTuple

__all__ = ["COUNTS", "OTHER", "Reading", "readings_of", "split_unit"]


class Reading(NamedTuple):
    """What a spelling may mean: a sensor, the map's unit, and the worth of one in that unit."""

    sensor: str
    unit: str
    scale: float = 1.0


COUNTS = "counts"
OTHER = "other"
_ACCELERATION = {
    "m/s^2": "m/s2 m/(s2) m/s/s m/s**2 ms-2 ms2 mps2 mpss m/sec2 mss ms^-2 m_s2 m_s_2 m_s^2 meterpersecond2 м/с2 m/s² "
    "meter/second2 meters/second2 metre/second2 metres/second2",
    "g": "g gn gee gravity gforce",
    "mg": "mg millig mgee",
}
_RATE = {
    "rad/s": "rad/s rads-1 rads^-1 rad_s rads radps rad/sec rad/second radian/s radians/s rad_sec рад/с",
    "deg/s": "deg/s dps deg_s degs degps deg/sec deg_sec degree/s degrees/s degree/sec degrees/sec degs-1 grad/s gr/s "
    "degree/second degrees/second",
    "mdeg/s": "mdeg/s mdps mdeg_s",
    "mrad/s": "mrad/s mrad_s mrads",
    "rpm": "rpm u/min 1/min tr/min rev/min r/min min-1",
    "Hz": "hz rev/s rps u/s turns/s",
}
_FIELD = {
    "uT": "ut microt microtesla microteslas utesla мкт мктл",
    "nT": "nt nanotesla",
    "mT": "millitesla",
    "gauss": "gauss gs ga g",
    "mgauss": "mgauss mgs mga mg milligauss",
}
_CASED = {
    "G": [Reading("magnetometer", "gauss"), Reading("accelerometer", "g")],
    "mG": [Reading("magnetometer", "mgauss"), Reading("accelerometer", "mg")],
    "mT": [Reading("magnetometer", "mT")],
    "T": [Reading("magnetometer", "uT", 1e6)],
}
_COUNTS = "lsb raw count counts digit digits adc int16 bits"
_OTHER = "deg rad degc c k v mv a ma m km cm mm ft pa hpa kpa mbar bar % db mah h °c degrees utc v/v lx lux"
#: A velocity's units, by the map's word.
_SPEED = {
    "m/s": "m/s m_s mps m/sec meterpersecond meter/second meters/second",
    "cm/s": "cm/s cm_s",
    "mm/s": "mm/s mm_s",
    "km/h": "km/h km_h kmh kph",
    "ft/s": "ft/s ft_s fps",
    "mph": "mph",
    "kn": "kn kt kts knot knots",
}
_TIME_SPELLINGS = {
    "min": "min mins minute minutes minuten minuti minutos мин 分",
    "s": "s sec secs second seconds sekunde sekunden seconde secondes segundos secondi sekundy с сек 秒 초",
    "ms": "ms msec millis milli millisecond milliseconds millisekunden millisecondes мс 毫秒 밀리초",
    "us": "us usec micros microsecond microseconds mikrosekunden мкс 微秒",
    "ns": "ns nsec nanos nanosecond nanoseconds",
}
_TABLE: dict[str, list[Reading]] = {}
for _sensor, _words in (("accelerometer", _ACCELERATION), ("gyroscope", _RATE), ("magnetometer", _FIELD)):
    for _unit, _spellings in _words.items():
        for _spelling in _spellings.split():
            _TABLE.setdefault(_spelling, []).append(Reading(_sensor, _unit))
for _spelling, _scale in (("cm/s2", 0.01), ("mm/s2", 0.001), ("ft/s2", 0.3048)):
    _TABLE[_spelling] = [Reading("accelerometer", "m/s^2", _scale)]
for _spelling in _COUNTS.split():
    _TABLE[_spelling] = [Reading(COUNTS, COUNTS)]
for _spelling in _OTHER.split():
    _TABLE.setdefault(_spelling, []).append(Reading(OTHER, _spelling))
for _unit, _spellings in _SPEED.items():
    for _spelling in _spellings.split():
        _TABLE.setdefault(_spelling, []).append(Reading(OTHER, _unit))
_TIME = {spelling: unit for unit, spellings in _TIME_SPELLINGS.items() for spelling in spellings.split()}
#: A unit in brackets at the end, or behind a slash as German textbooks write it ("t / s").
_BRACKETED = re.compile(r"^(.*?)[\s_]*[(\[{<]\s*([^()\[\]{}<>]*[^\W\d_][^()\[\]{}<>]*|[°%])\s*[)\]}>]\s*(.*)$")
_SLASHED = re.compile(r"^(.*?)\s+/\s*(\S+)$")
#: A unit behind a comma (Gyro X, deg/s), or between bars as RaceCapture writes it (AccelX|"G"|-3.0|3.0|25).
_COMMA = re.compile(r"^(.*\S)\s*,\s*([^,]+)$")
_BARRED = re.compile(r"^\"?([^|\"]+)\"?\|\s*\"?([^|\"]*)\"?\s*(?:\|.*)?$")
#: A unit that only its capital parts from a letter for time or for an axis (tsMs, gyroXDps).
_CAPITAL = re.compile(r"^(ts?)(Ms|Us|Ns)$|^(.*[a-z]_?[XYZ])(Dps|Mdps|Rads|Mps2|UT|Gauss|Mgauss|Mg)$")
#: Words that only a unit has, behind a name whose blanks may be underscores.
_WORDED = re.compile(r"\bper\b|^in\b|\bsquared$")


def _plain(spelling: str) -> str:
    text = unicodedata.normalize("NFKC", spelling).strip()
    text = text.replace("\u2212", "-").replace("\u03bc", "u").replace("\u00b5", "u").replace("\u00b0", "deg")
    text = re.sub(r"\s+per\s+", "/", re.sub(r"^in\s+(?=\S)", "", text))
    return re.sub(r"[\s\u00b7*\u22c5.^]", "", text.replace(" squared", "2"))


def readings_of(spelling: str) -> list[Reading]:
    """Return what a spelling may mean, the likeliest first; empty where it is no unit known here.

    >>> [readings_of(text)[0].unit for text in ("in microteslas", "degrees per second", "meters per second squared")]
    ['uT', 'deg/s', 'm/s^2']
    """
    text = _plain(spelling)
    if text in _CASED:
        return _CASED[text]
    if text.lower() in _TIME:
        return [Reading("time", _TIME[text.lower()])]
    return _TABLE.get(text, _TABLE.get(text.lower(), []))


def split_unit(name: str) -> tuple[str, str]:
    """Return a column's name without its unit, and the unit (empty where there is none).

    Units stand in brackets, behind a slash with a blank before it, behind a comma, between bars, or as the last words
    after underscores or blanks.

    >>> split_unit("gyro_x [deg/s]"), split_unit("tsMs"), split_unit("gyroXDps")
    (('gyro_x', 'deg/s'), ('ts', 'Ms'), ('gyroX', 'Dps'))
    >>> split_unit("Gyro X, deg/s"), split_unit('AccelX|"G"|-3.0|3.0|25')
    (('Gyro X', 'deg/s'), ('AccelX', 'G'))
    >>> split_unit("X_ANGULAR_VELOCITY_DEGREES_PER_SECOND"), split_unit("X_IN_G")
    (('X_ANGULAR_VELOCITY', 'degrees per second'), ('X', 'in g'))
    >>> split_unit("velMs"), split_unit("status"), split_unit("accX")
    (('velMs', ''), ('status', ''), ('accX', ''))
    """
    bracketed = _BRACKETED.match(name)
    if bracketed and bracketed[2].strip().lower() not in ("x", "y", "z"):  # acc[x]
        return f"{bracketed[1]} {bracketed[3]}".strip(), bracketed[2].strip()
    for pattern in (_SLASHED, _COMMA):
        if (behind := pattern.match(name)) and readings_of(behind[2]):
            return behind[1].strip(), behind[2].strip()
    if barred := _BARRED.match(name):
        return barred[1].strip(), barred[2].strip()
    for gap in list(re.finditer(r"[_\s-]+", name))[-5:]:  # in_meters_per_second_squared is the longest
        last = name[gap.end() :]
        words = re.sub(r"[_\s]+", " ", last).lower()
        if gap.start() and _WORDED.search(words) and readings_of(words):
            return name[: gap.start()], words
        if gap.start() and readings_of(last):
            return name[: gap.start()], last
    if capital := _CAPITAL.match(name):
        base, unit = capital[1] or capital[3], capital[2] or capital[4]
        return base, unit
    return name, ""
