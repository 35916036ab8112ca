"""JSON as a table: records of numbers, one in a line or all in a list, as phones, web pages and brokers write them.

Takes a file; gives a file of comma-separated text, or a folder of them where each sensor has a list of its own. What is
nested has the names above it before its own (``accel_x``); numbers stay as they are written.
"""

from __future__ import annotations

import ast
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from discsim.errors import InputError, printable
from discsim.validation.importing.sniffing.other_forms.written import comma_separated, first_bytes, write_named

__all__ = ["begins", "write_tables"]

#: A record as it stands: an object of JSON, or a dictionary as Python prints it.
_Record: TypeAlias = Mapping[str, Any]

_BEGINS = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:\[\s*)?\{\s*[\"']")
#: Bytes of a file that is read whole: ten hours of ten channels at 100 rows a second come to half of that.
MAX_BYTES = 1 << 29
#: A table of more columns is none of readings: keys that count, as times, make one.
MAX_COLUMNS = 500
#: Records without which a list is no log of a sensor.
FEWEST = 4
#: Keys that count rows (pandas' {"ax": {"0": 1.0, "1": 2.0}}) are at least so many.
_ROWS = 16
#: Names of three numbers in a list.
_AXES = "xyz"
_DECODER = json.JSONDecoder(parse_float=str, parse_int=str, parse_constant=str)


def begins(path: Path) -> bool:
    """Tell a file that begins as an object of JSON, or as a list of such."""
    return _BEGINS.match(first_bytes(path, 1 << 12)) is not None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the records of a file as ``target``, or as a folder of that name, and return what to say of them.

    Raises `InputError` for a file without records of numbers, one that is too large and one that cannot be read.
    """
    try:
        size = raw.stat().st_size
        text = raw.read_text(encoding="utf-8-sig", errors="replace") if size <= MAX_BYTES else ""
    except OSError as error:
        raise InputError.at(raw, None, f"cannot be read ({error.strerror}); expected what a logger wrote") from None
    if size > MAX_BYTES:
        raise InputError.at(raw, None, f"is JSON of {size >> 20} MB; expected at most {MAX_BYTES >> 20} MB, or CSV")
    objects, broken = _objects(text)
    tables = {name: rows for name, rows in _tables(objects).items() if len(rows) >= FEWEST}
    if not tables:
        raise InputError.at(
            raw, None, "is JSON without records of numbers in it; expected a list of them, or one in each line"
        )
    texts = {name: _text(raw, rows) for name, rows in tables.items()}
    write_named(target, texts)
    counted = ", ".join(
        f"{len(rows)} of {printable(name)}" if name else str(len(rows)) for name, rows in tables.items()
    )
    said = [f"{raw.name}: JSON, read as a table of its records: {counted}"]
    pieces = "1 piece that is no JSON is" if broken == 1 else f"{broken} pieces that are no JSON are"
    return said + [f"{raw.name}: {pieces} LEFT OUT"] * (broken > 0)


def _objects(text: str) -> tuple[list[_Record], int]:
    """Return the objects of a text, whatever stands between them, and how many pieces were none."""
    found: list[_Record] = []
    broken, at = 0, 0
    while (at := text.find("{", at)) >= 0:
        try:
            one, at = _DECODER.raw_decode(text, at)
        except (ValueError, RecursionError):
            end = text.find("\n", at)
            end = len(text) if end < 0 else end
            printed = _printed(text[at:end])
            broken += printed is None
            one, at = printed, end
        if isinstance(one, Mapping):
            found.append(one)
    return found, broken


def _printed(line: str) -> Any:
    """Return what Python printed as a dictionary, or None."""
    try:
        return ast.literal_eval(line.strip().rstrip(","))
    except (ValueError, SyntaxError, TypeError, RecursionError, MemoryError):
        return None


def _tables(objects: Sequence[_Record]) -> dict[str, list[_Record]]:
    """Return records by the name of the list that they stand in; those of no list have none."""
    inner: dict[str, list[_Record]] = {}
    for one in objects:
        for name, rows in _lists(one):
            inner.setdefault(name, []).extend(rows)
    if any(len(rows) >= FEWEST for rows in inner.values()):
        return inner
    if len(objects) == 1 and (columns := _columns(objects[0])):
        return {"": columns}
    return {"": list(objects)}


def _lists(value: Any, name: str = "") -> Iterator[tuple[str, list[_Record]]]:
    """Yield the lists of objects in a value, with the keys above them."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _lists(part, f"{name}_{key}" if name else str(key))
    elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
        yield name, value


def _columns(one: _Record) -> list[_Record]:
    """Return the records of an object that holds a list for each column, or rows under the names of their columns."""
    names, rows = one.get("columns"), one.get("data")
    if isinstance(names, list) and isinstance(rows, list) and all(isinstance(row, list) for row in rows):
        return [dict(zip(map(str, names), row, strict=False)) for row in rows]
    lists = dict(_lists_of_numbers(one))
    if not lists:
        return []
    longest = max(map(len, lists.values()))
    even = {name: column for name, column in lists.items() if len(column) == longest}
    return [dict(zip(even, row, strict=True)) for row in zip(*even.values(), strict=True)]


def _lists_of_numbers(value: _Record, name: str = "") -> Iterator[tuple[str, list[Any]]]:
    for key, part in value.items():
        full = f"{name}_{key}" if name else str(key)
        if isinstance(part, Mapping) and len(part) >= _ROWS and all(str(row).isdecimal() for row in part):
            yield full, list(part.values())
        elif isinstance(part, Mapping):
            yield from _lists_of_numbers(part, full)
        elif isinstance(part, list) and len(part) >= FEWEST:
            yield full, part


def _text(raw: Path, records: Sequence[_Record]) -> str:
    """Return records as comma-separated text, a column for each name in the order in which they come."""
    rows = [dict(_flat(record)) for record in records]
    names = list(dict.fromkeys(name for row in rows for name in row))
    if len(names) > MAX_COLUMNS:
        raise InputError.at(raw, None, f"is JSON of {len(names)} columns; expected a record for each reading")
    return comma_separated([names, *([row.get(name, "") for name in names] for row in rows)])


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield the cells of a record with their names; three numbers in a list are x, y and z.

    >>> dict(_flat({"t": "5", "gyro": {"x": "1"}, "acc": ["1", "2", "3"], "ok": True, "note": None}))
    {'t': '5', 'gyro_x': '1', 'acc_x': '1', 'acc_y': '2', 'acc_z': '3', 'ok': '1', 'note': ''}
    """
    parts: Iterable[tuple[Any, Any]]
    if isinstance(value, Mapping):
        parts = value.items()
    elif isinstance(value, list | tuple):
        parts = zip(_AXES if len(value) == len(_AXES) else range(len(value)), value, strict=True)
    else:
        text = "" if value is None else str(int(value)) if isinstance(value, bool) else str(value)
        yield name, " ".join(text.split())
        return
    for key, part in parts:
        yield from _flat(part, f"{name}_{key}" if name else str(key))
