"""Rates and truths in CSV files, whoever wrote them: discsim, a firmware, a reference."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.files import read_text

__all__ = ["Told", "read_rates", "read_told", "read_truth"]

_DEG, _RPM = float(np.radians(1.0)), 2.0 * np.pi / 60.0
#: columns that hold a rate, and rad/s per unit of each; a flight's truth has its rate about z_B as r_rad_s
_RATES: Mapping[str, float] = MappingProxyType(
    {"rate_rad_s": 1.0, "r_rad_s": 1.0, "rate_deg_s": _DEG, "rate_rpm": _RPM, "yaw_rate_deg_s": _DEG}
)
_SDS: Mapping[str, float] = MappingProxyType({"sd_rad_s": 1.0, "sd_deg_s": _DEG, "sd_rpm": _RPM})
#: other names of a rate with its unit, as Rate (deg/s) or spin_dps, and rad/s per unit; Hz alone is no rate of turning
_RATE_NAME = re.compile(
    r"(?:yaw|spin|r|omega|table|target|command)?[ _]?(?:rate|speed|velocity)?[ _]?"
    r"[(\[]?((?:rad|deg|rev)(?:_|/|_per_)s|°/s|dps|rpm|rps|hz)[)\]]?",
    re.I,
)
_TURN = 2.0 * np.pi
_RATE_UNITS: Mapping[str, float] = MappingProxyType(
    {"rad/s": 1.0, "deg/s": _DEG, "°/s": _DEG, "dps": _DEG, "rpm": _RPM, "rps": _TURN, "rev/s": _TURN, "hz": _TURN}
)
#: other names of a time, as Time (s), t_ms, timestamp, or the unit alone as boards call their counter; s per unit
_TIME_NAME = re.compile(
    r"(?:timestamp|time|t)[ _]?[(\[]?(s|sec|seconds|ms|us|µs)?[)\]]?|(seconds|ms|millis|us|micros)(?:\(\))?", re.I
)
_TIME_UNITS: Mapping[str, float] = MappingProxyType(
    {"ms": 1e-3, "millis": 1e-3, "us": 1e-6, "µs": 1e-6, "micros": 1e-6}
)
#: what stands between cells, in the order in which it is looked for in a header; a comma is in numbers beside the first
_BETWEEN = (";", "\t", ",")
#: methods that give magnitudes, as `estimate` writes them
_UNSIGNED = ("fft", "accelerometer")


def read_rates(path: Path, *, magnitude: bool = False) -> list[YawRate]:
    """Read rates over time, one for each name in a column ``method`` if there is one.

    Columns: ``time_s``, one of ``rate_rad_s``, ``rate_deg_s``, ``rate_rpm``; if present ``method`` and ``sd_...``.
    Names that say the same, as ``Time (ms)`` and ``spin_dps``, are taken too; so are cells between semicolons, with
    decimal commas, and between tabs. An empty cell is a value that is not known. ``magnitude`` says that the rates have
    no sign. Raises `InputError` naming file, line and what was expected.
    """
    return [
        YawRate(name, t, rate, sd, signed=not (magnitude or name in _UNSIGNED)) for name, t, rate, sd in _groups(path)
    ]


def read_truth(path: Path) -> YawRate:
    """Read a true rate: truth.csv of a rate table or a flight, rate_reference.csv, or ``time_s`` with a rate.

    Raises `InputError` for several methods, for fewer than two values, and as `read_rates`.
    """
    found = list(_groups(path))
    if len(found) != 1:
        raise InputError.at(path, None, f"holds {len(found)} methods; expected one truth")
    _, t, rate, _ = found[0]
    if np.count_nonzero(np.isfinite(rate)) < 2:
        raise InputError.at(path, None, "holds fewer than two known rates; expected a truth over time")
    return YawRate("truth", t, rate, np.where(np.isfinite(rate), 0.0, np.nan), signed=True)


class Told(NamedTuple):
    """What a CSV file tells of rates: names of its columns, rad/s per unit, and the rows of each method with lines.

    A row is time s, rate rad/s and sd rad/s; NaN where a rate is not known. ``lines`` counts those of the whole file.
    """

    header: str
    time_name: str
    rate_name: str
    per_rate: float
    tables: Mapping[str, list[tuple[float, float, float]]]
    lines: Sequence[int]


def read_told(path: Path) -> Told:
    """Read the rates of a CSV file; raises `InputError` naming file, line and what was expected."""
    lines = _text(path).splitlines()
    between = next((one for one in _BETWEEN if lines and one in lines[0]), ",")
    rows = list(csv.reader(lines, delimiter=between))
    header = [cell.strip() for cell in rows[0]] if rows else []
    time_at, per_time = _time_column(header)
    rate_at, per_rate = _rate_column(header)
    if time_at is None or rate_at is None:
        raise InputError.at(
            path, 1, f"header {', '.join(header) or 'is empty'}; expected time_s and one of {', '.join(_RATES)}"
        )
    sd_column = next((name for name in _SDS if name in header), None)
    method = header.index("method") if "method" in header else None
    tables: dict[str, list[tuple[float, float, float]]] = {}
    at: list[int] = []
    for number, row in enumerate(rows[1:], start=2):
        if not row or not any(cell.strip() for cell in row):
            continue
        if len(row) != len(header):
            raise InputError.at(path, number, f"has {len(row)} cells; expected {len(header)}")
        name = path.stem if method is None else row[method].strip()
        if between == ";":
            row = [cell.replace(",", ".") for cell in row]
        time = _number(path, number, row[time_at]) * per_time
        if not np.isfinite(time):
            raise InputError.at(path, number, "has no time; expected a number of seconds")
        rate = _number(path, number, row[rate_at]) * per_rate
        sd = 0.0 if sd_column is None else _number(path, number, row[header.index(sd_column)]) * _SDS[sd_column]
        table = tables.setdefault(name, [])
        if table and time <= table[-1][0]:
            raise InputError.at(path, number, f"time {time:g} s follows {table[-1][0]:g} s; expected ascending time")
        table.append((time, rate, sd))
        at.append(number)
    if not tables:
        raise InputError.at(path, None, "holds no row; expected rates over time")
    return Told(lines[0], header[time_at], header[rate_at], per_rate, tables, at)


def _text(path: Path) -> str:
    """Return a file's text, also where its first bytes say UTF-16, as Excel's "Unicode text" and Windows' shell do."""
    try:
        with path.open("rb") as file:
            wide = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        return path.read_text(encoding="utf-16") if wide else read_text(path)
    except UnicodeError as error:
        raise InputError.at(path, None, f"is no text of UTF-16 ({error}); expected UTF-8") from None
    except OSError:
        return read_text(path)  # which says why


def _groups(path: Path) -> Iterator[tuple[str, FloatArray, FloatArray, FloatArray]]:
    """Yield name, times, rates and sds (n,) of each method of a file, in the order of the file."""
    for name, table in read_told(path).tables.items():
        t, rate_rad_s, sd_rad_s = np.array(table).T
        known = np.isfinite(rate_rad_s)
        # an sd that is not told is none
        yield name, t, rate_rad_s, np.where(known, np.nan_to_num(sd_rad_s), np.nan)


def _time_column(header: Sequence[str]) -> tuple[int | None, float]:
    """Return where a header has the time, and seconds per unit: ``time_s``, else the first name that means a time."""
    if "time_s" in header:
        return header.index("time_s"), 1.0
    named = ((k, found) for k, cell in enumerate(header) if (found := _TIME_NAME.fullmatch(cell)))
    for k, found in named:
        return k, _TIME_UNITS.get((found[1] or found[2] or "s").lower(), 1.0)
    return None, 1.0


def _rate_column(header: Sequence[str]) -> tuple[int | None, float]:
    """Return where a header has the rate, and rad/s per unit: one of `_RATES`, else the first that tells its unit."""
    for name, per_unit in _RATES.items():
        if name in header:
            return header.index(name), per_unit
    named = (
        (k, found) for k, cell in enumerate(header) if (found := _RATE_NAME.fullmatch(cell)) and cell.lower() != "hz"
    )
    for k, found in named:
        return k, _RATE_UNITS[found[1].lower().replace("_per_", "/").replace("_", "/")]
    return None, 1.0


def _number(path: Path, line: int, cell: str) -> float:
    text = cell.strip()
    try:
        value = float(text) if text else np.nan
    except ValueError:
        raise InputError.at(path, line, f"'{text[:40]}' is no number; expected one, or nothing") from None
    if np.isinf(value):
        raise InputError.at(path, line, f"'{text[:40]}' is not finite; expected a number, or nothing")
    return value
