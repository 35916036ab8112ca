"""JSON as a table: records of numbers, one in a line or all in a list, as phones, web pages and brokers write them.

A record is an object, a list of a time and objects (`[0.01, {"a": {"x": 0.1}}]`), or a list of numbers in a list
(`[[0, 0.1, 9.8], [10, 0.2, 9.7]]`), whose first may be names.

Takes a file; gives a file of comma-separated text, or a folder of them where each sensor has a list of its own. What is
nested has the names above it before its own (``accel_x``); numbers stay as they are written.
"""

from __future__ import annotations

import ast
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

from discsim.errors import InputError, printable
from discsim.validation.importing.cell_texts import number
from discsim.validation.importing.labelled import stamped
from discsim.validation.importing.sniffing.names import is_time_name, sensor_of
from discsim.validation.importing.sniffing.other_forms.written import comma_separated, first_bytes, write_named
from discsim.validation.importing.stamps import is_stamp

__all__ = ["begins", "write_tables"]

#: A record as it stands: an object of JSON, or a dictionary as Python prints it.
_Record: TypeAlias = Mapping[str, Any]

_BEGINS = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:\[\s*)?\{\s*[\"']")
#: What a program's log has before each record: brackets and words, no brace and no more than a line.
_LOGGED = re.compile(rb"(?:\xef\xbb\xbf)?[^\n{}]{0,120}\{\s*[\"'][^\n]*\}\r?\n")
#: So many bytes of a file are looked at for these, and lines that a board prints as it starts; from the first record on
#: this share of lines are records, others are messages.
_LOOKED_AT, _BOOT, _RECORDS = 1 << 16, 200, 0.8
#: A list of lists, and one of those in it; numpy prints no commas.
_LISTS = re.compile(rb"(?:\xef\xbb\xbf)?\s*\[\s*\[[^\[\]{}]*,[^\[\]{}]*\]")
_LIST = re.compile(r"\[[^\[\]{}]*\]")
#: A list of a time and an object, at the beginning of a file and in it, and what stands before one more object.
_TIMED = re.compile(rb"(?:\xef\xbb\xbf)?\s*(?:\[\s*)?\[\s*\"?[^\[\]{},\"]+\"?\s*,\s*\{")
_TIME = re.compile(r"\[\s*\"?([^\[\]{},\"]+)\"?\s*,\s*(?=\{)")
_NEXT = re.compile(r"\s*,\s*(?=\{)")
#: Bytes of a file that is read whole: ten hours of ten channels at 100 rows a second come to half of that.
MAX_BYTES = 1 << 29
#: A table of more columns is none of readings: keys that count, as times, make one.
MAX_COLUMNS = 500
#: Records without which a list is no log of a sensor.
FEWEST = 4
#: Keys that count rows (pandas' {"ax": {"0": 1.0, "1": 2.0}}) are at least so many.
_ROWS = 16
#: What stands in a line before its record is no longer, begins with a number where that is its time, and is told in
#: this share of records: some lines break off.
_LONGEST, _TOLD = 120, 0.9
_LEVELS = ("DEBUG", "INFO", "WARN", "WARNING", "ERROR")
_COUNTED = re.compile(r"\s*[\[(]?(\d+(?:\.\d+)?)\s*([mun]?s)?[\])]?(?:\s*(?:[,;:|>=]|->?)|\s+|$)")
#: Names of three numbers in a list.
_AXES = "xyz"
_DECODER = json.JSONDecoder(parse_float=str, parse_int=str, parse_constant=str)


def begins(path: Path) -> bool:
    """Tell a file that begins as an object of JSON, or as a list of such or of lists."""
    head = first_bytes(path, 1 << 12)
    if any(form.match(head) is not None for form in (_BEGINS, _LISTS, _TIMED)):
        return True
    logged = [
        _LOGGED.fullmatch(line) is not None for line in first_bytes(path, _LOOKED_AT).splitlines(keepends=True)[:-1]
    ]
    records = logged[logged.index(True) :] if any(logged[:_BOOT]) else []
    return sum(records) >= max(FEWEST, _RECORDS * len(records))


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
    head = first_bytes(raw, 1 << 12)
    if _LISTS.match(head) is not None:
        return _write_lists(raw, target, text)
    objects, broken = _timed(text) if _TIMED.match(head) is not None else _objects(text)
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


def _write_lists(raw: Path, target: Path, text: str) -> list[str]:
    """Write the lists in a list as rows of a table, those of the usual length, and return what to say of them."""
    rows = []
    for found in _LIST.finditer(text):
        try:
            rows.append(_DECODER.decode(found[0]))
        except ValueError:
            rows.append([])
    usual = Counter(map(len, rows)).most_common(1)[0][0]
    kept = [["" if cell is None else str(cell) for cell in row] for row in rows if len(row) == usual]
    if len(kept) < FEWEST or usual < 2:
        raise InputError.at(raw, None, "is JSON of lists without rows of numbers; expected a list for each reading")
    target.write_text(comma_separated(kept), encoding="utf-8")
    said = [f"{raw.name}: JSON, read as a table of its lists: {len(kept)} of {usual}"]
    lost = len(rows) - len(kept)
    return said + [f"{raw.name}: {lost} of another length LEFT OUT"] * (lost > 0)


def _timed(text: str) -> tuple[list[_Record], int]:
    """Return the objects of each list that begins with a time, joined, with that time; and how many broke off."""
    found: list[_Record] = []
    broken, at = 0, 0
    while (begun := _TIME.search(text, at)) is not None:
        record: dict[str, Any] = {"t": begun[1]}
        at = begun.end()
        try:
            one, at = _DECODER.raw_decode(text, at)
            record |= one
            while (more := _NEXT.match(text, at)) is not None:
                one, at = _DECODER.raw_decode(text, more.end())
                record |= one
        except (ValueError, RecursionError):
            broken += 1
            continue
        found.append(record)
    return found, broken


def _objects(text: str) -> tuple[list[_Record], int]:
    """Return the objects of a text, whatever stands between them, and how many pieces were none."""
    found: list[_Record] = []
    stamps: list[tuple[str, str] | None] = []
    broken, at = 0, 0
    while (at := text.find("{", at)) >= 0:
        begun = at
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
            stamps.append(_stamp_before(text[text.rfind("\n", 0, begun) + 1 : begun]))
    return _stamped(found, stamps), broken


def _stamp_before(prefix: str) -> tuple[str, str] | None:
    """Return the time that stands in a line before its record, with what it is called; None where none does.

    >>> _stamp_before("12:01:33.456 -> "), _stamp_before("[2025-06-01T14:03:20.5] imu: "), _stamp_before("1748.25, ")
    (('time', '12:01:33.456'), ('time', '2025-06-01T14:03:20.5'), ('time', '1748.25'))
    >>> _stamp_before("2025-06-01 14:03:20,123 INFO "), _stamp_before("120 ms: "), _stamp_before("imu 3: ")
    (('time', '2025-06-01 14:03:20.123'), ('time_ms', '120'), None)
    """
    if len(prefix) > _LONGEST:
        return None
    if (begun := stamped(prefix)) is not None:
        return begun[0], begun[1]
    words = [word for word in prefix.split() if word.strip("[]:") not in _LEVELS]  # which could pass for a zone
    for count in (4, 3, 2, 1):
        text = " ".join(words[:count]).strip("[]()<>,;:|- ")
        if len(words) >= count and is_stamp(text):
            return "time", re.sub(r"(?<=\d),(?=\d{1,9}$)", ".", text)
    counted = _COUNTED.match(prefix)
    return None if counted is None else (f"time_{counted[2]}" if counted[2] else "time", counted[1])


def _stamped(records: list[_Record], stamps: Sequence[tuple[str, str] | None]) -> list[_Record]:
    """Return records with the times that stand before them; as they are where most have none, or one of their own."""
    told = sum(stamp is not None for stamp in stamps)
    own = any(is_time_name(name) for one in records[:1] for name, _ in _flat(one))
    if own or told < max(FEWEST, _TOLD * len(records)):
        return records
    return [
        one if stamp is None else {stamp[0]: stamp[1]} | dict(one) for one, stamp in zip(records, stamps, strict=True)
    ]


def _printed(line: str) -> Any:
    """Return what Python printed as a dictionary, or None."""
    try:
        return ast.literal_eval(line.strip().rstrip(","))
    except (ValueError, SyntaxError, TypeError, RecursionError, MemoryError):
        return None


def _tables(objects: Sequence[_Record]) -> dict[str, list[_Record]]:
    """Return records by the name of the list that they stand in; those of no list have none."""
    if sensors := _sensors_of_messages(objects):
        return sensors
    inner: dict[str, list[_Record]] = {}
    for one in objects:
        for name, rows in _lists(one):
            inner.setdefault(name, []).extend(rows)
    if any(len(rows) >= FEWEST for rows in inner.values()):
        return inner
    if len(objects) == 1 and (columns := _columns(objects[0])):
        return columns
    return {"": list(objects)}


def _sensors_of_messages(objects: Sequence[_Record]) -> dict[str, list[_Record]]:
    """Return the samples of messages that have several each, by what their lists are called; empty for others."""
    batches = [batch for one in objects for batch in _batch(one)]
    named: dict[str, list[_Record]] = {}
    for batch in batches if len(batches) >= FEWEST else ():
        name = "_".join(key for key, part in batch[0].items() if isinstance(part, Mapping))
        named.setdefault(name, []).extend(batch)
    return named


def _batch(value: Any) -> Iterator[list[_Record]]:
    """Yield the samples of each message that has a time and several samples of each sensor, as Movesense sends them.

    All samples of a message have its time. Lists of samples with times of their own, or of unlike lengths, are none.
    """
    if isinstance(value, list):
        for one in value:
            yield from _batch(one)
    if not isinstance(value, Mapping):
        return
    times = {key: part for key, part in value.items() if is_time_name(str(key)) and isinstance(part, str)}
    lists = {key: part for key, part in value.items() if _are_samples(part)}
    if times and lists and len({*map(len, lists.values())}) == 1:
        count = len(next(iter(lists.values())))
        yield [times | {key: rows[k] for key, rows in lists.items()} for k in range(count)]
        return
    for part in value.values():
        yield from _batch(part)


def _are_samples(value: Any) -> bool:
    """Tell a list of objects of numbers in which there is no time."""
    if not isinstance(value, list) or not value or not all(isinstance(one, Mapping) for one in value):
        return False
    return all(isinstance(part, str) and not is_time_name(str(key)) for one in value for key, part in one.items())


def _lists(value: Any, name: str = "") -> Iterator[tuple[str, list[_Record]]]:
    """Yield the lists of objects in a value, with the keys above them."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _lists(part, f"{name}_{key}" if name else str(key))
    elif isinstance(value, list) and value and all(isinstance(one, Mapping) for one in value):
        yield name, value


def _columns(one: _Record) -> dict[str, list[_Record]]:
    """Return the records of an object that holds a list for each column, or rows under the names of their columns.

    Where lists are not of one length, each sensor has its own rate: what stands under one name is a table of its own.
    """
    lists = dict(_lists_of_numbers(one))
    for rows in filter(_is_table, lists.values()):
        named = (names for names in lists.values() if _is_names(names, len(rows[0])))
        if (names := next(named, None)) is not None:
            return {"": [dict(zip(names, row, strict=False)) for row in rows]}
    if len({*map(len, lists.values())}) < 2:
        return {"": _records({"_".join(path): column for path, column in lists.items()})} if lists else {}
    times = {path[0]: column for path, column in lists.items() if len(path) == 1 and is_time_name(path[0])}
    tables: dict[str, dict[str, list[Any]]] = {}
    for path, column in lists.items():
        if path[0] not in times:
            above, columns = (path, _axes(path[-1], column)) if _is_table(column) else (path[:-1], {path[-1]: column})
            tables.setdefault("_".join(above) or f"columns_{len(column)}", {}).update(columns)
    for table in tables.values():
        length = len(next(iter(table.values())))
        table.update({name: column for name, column in times.items() if len(column) == length})
    return {name: _records(table) for name, table in tables.items()}


def _records(columns: Mapping[str, list[Any]]) -> list[_Record]:
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=False)]


def _axes(name: str, rows: list[list[Any]]) -> dict[str, list[Any]]:
    """Return the rows that stand under a name as columns."""
    return dict(zip(_places(name, len(rows[0])), map(list, zip(*rows, strict=False)), strict=False))


def _places(name: str, size: int) -> Sequence[str]:
    """Return what the numbers in a list are called: three are x, y and z, four of a sensor have the time in front."""
    if size == len(_AXES):
        return _AXES
    timed = size == len(_AXES) + 1 and sensor_of(name) is not None
    return f"t{_AXES}" if timed else [str(place) for place in range(size)]


def _is_table(value: Any) -> bool:
    """Tell a list of records that are lists."""
    return isinstance(value, list) and bool(value) and all(isinstance(row, list) for row in value)


def _is_names(value: Any, width: int) -> bool:
    """Tell a list of names for so many columns: numbers stand as text, too, as long as a file is read."""
    named = isinstance(value, list) and len(value) == width and all(isinstance(name, str) for name in value)
    return named and sum(number(name) is None for name in value) > width / 2


def _lists_of_numbers(value: _Record, above: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], list[Any]]]:
    """Yield the lists in an object, with the keys above each."""
    for key, part in value.items():
        path = (*above, str(key))
        if isinstance(part, Mapping) and len(part) >= _ROWS and all(str(row).isdecimal() for row in part):
            yield path, list(part.values())
        elif isinstance(part, Mapping):
            yield from _lists_of_numbers(part, path)
        elif isinstance(part, list) and len(part) >= FEWEST:
            yield path, part


def _text(raw: Path, records: Sequence[_Record]) -> str:
    """Return records as comma-separated text, a column for each name in the order in which they come."""
    rows = [dict(_flat(record)) for record in records]
    names = list(dict.fromkeys(name for row in rows for name in row))
    if len(names) > MAX_COLUMNS:
        raise InputError.at(raw, None, f"is JSON of {len(names)} columns; expected a record for each reading")
    return comma_separated([names, *([row.get(name, "") for name in names] for row in rows)])


def _flat(value: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Yield the cells of a record with their names; three numbers in a list are x, y and z, four of a sensor t as well.

    >>> dict(_flat({"t": "5", "gyro": {"x": "1"}, "acc": ["1", "2", "3"], "ok": True, "note": None}))
    {'t': '5', 'gyro_x': '1', 'acc_x': '1', 'acc_y': '2', 'acc_z': '3', 'ok': '1', 'note': ''}
    >>> [name for name, _ in _flat({"mag": [0, 1, 2, 3], "q": [1, 0, 0, 0]})]
    ['mag_t', 'mag_x', 'mag_y', 'mag_z', 'q_0', 'q_1', 'q_2', 'q_3']
    """
    parts: Iterable[tuple[Any, Any]]
    if isinstance(value, Mapping):
        parts = value.items()
    elif isinstance(value, list | tuple):
        parts = zip(_places(name, len(value)), value, strict=True)
    else:
        text = "" if value is None else str(int(value)) if isinstance(value, bool) else str(value)
        yield name, " ".join(text.split())
        return
    for key, part in parts:
        yield from _flat(part, f"{name}_{key}" if name else str(key))
