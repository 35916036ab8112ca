"""InfluxDB's line protocol: `imu,host=disc gx=1.0,gy=2.0 1640207340000000000`, a point a line.

What stands behind the measurement's name tells whose point it is, and no reading; each series becomes a table. The
stamp is in ns but where it is too small to be: then in us, ms or s since 1970 (InfluxDB's "precision").
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.sniffing.other_forms.written import comma_separated, first_bytes, write_named

__all__ = ["begins", "write_tables"]

#: A number as a field's value, whole ones with an i or u behind them; a truth; a text in quotes.
_VALUE = r'(?:[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?[iu]?|[tTfF](?:rue|RUE|alse|ALSE)?|"(?:[^"\\]|\\.)*")'
_KEY = r"(?:[^\s,=\\]|\\.)+"
_FIELD = re.compile(rf"({_KEY})=({_VALUE})")
_POINT = re.compile(rf"({_KEY})((?:,{_KEY}={_KEY})*) ({_KEY}={_VALUE}(?:,{_KEY}={_VALUE})*) (\d{{9,19}})\s*")
#: Lines at the beginning that must be points, if there are as many.
_LOOKED_AT = 5
#: Digits that a stamp since 1970 has at least in each unit (1e9 s were over in 2001).
_UNITS = ((19, "ns"), (16, "us"), (13, "ms"), (0, "s"))


def begins(path: Path) -> bool:
    """Tell the line protocol by its first lines, each a point; comments may stand before them."""
    head = first_bytes(path, 1 << 16)
    lines = [line for line in head.decode("utf-8", "replace").split("\n")[:-1] if line.strip() and line[0] != "#"]
    return bool(lines) and all(_POINT.fullmatch(line) for line in lines[:_LOOKED_AT])


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the points of each measurement as a table, and return what to say.

    Raises `InputError` where the file cannot be read.
    """
    tables: dict[str, list[Mapping[str, str]]] = {}
    broken = 0
    try:
        with raw.open(encoding="utf-8", errors="replace") as stream:
            for line in stream:
                found = _POINT.fullmatch(line)
                if found is None:
                    broken += bool(line.strip()) and not line.startswith("#")
                    continue
                measurement, tags, fields, stamp = found.groups()
                cells = {_plain(name): _number(value) for name, value in _FIELD.findall(fields)}
                tables.setdefault(_plain(measurement + tags), []).append({_time(stamp): stamp, **cells})
    except OSError as error:
        raise InputError.at(raw, None, f"cannot be read ({error.strerror}); expected what a logger wrote") from None
    texts = {}
    for name, points in tables.items():
        columns = list(dict.fromkeys(column for point in points for column in point))
        texts[name] = comma_separated([columns, *([point.get(column, "") for column in columns] for point in points)])
    write_named(target, texts)
    counted = ", ".join(f"{len(points)} of {name}" for name, points in tables.items())
    said = [f"{raw.name}: InfluxDB's line protocol, read as a table of its points: {counted}"]
    return said + [f"{raw.name}: {broken} lines that are no point are LEFT OUT"] * (broken > 0)


def _time(stamp: str) -> str:
    return f"time ({next(unit for digits, unit in _UNITS if len(stamp) >= digits)})"


def _plain(name: str) -> str:
    return re.sub(r"\\(.)", r"\1", name)


def _number(value: str) -> str:
    return value.rstrip("iu") if value[-1] in "iu" else value
