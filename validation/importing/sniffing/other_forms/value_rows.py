"""A row for each value, with its name beside it (``time,name,value``), as databases and brokers write: as records.

Takes a table; gives one with a column for each name, and a row for each time. InfluxDB's annotated export is such a
table, with the points of each field below one another.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.cell_texts import number
from discsim.validation.importing.sniffing.names import is_time_name, read_name
from discsim.validation.importing.stamps import iso_seconds

__all__ = ["begins", "write_tables"]

#: What the column of the values is called, and those of their names, the wider one first.
_VALUE = {"value", "val", "reading", "payload"}
_NAMES = ("device", "deviceid", "measurement", "entityid", "topic", "sensor", "series", "metric", "name", "variable",
          "parameter", "key", "signal", "channel", "field", "axis")  # fmt: skip
#: Times that are never when a reading was taken: the span of a query.
_SPAN = {"start", "stop"}
#: Names of values at most: more are no sensors' axes.
MOST = 100
#: Bytes of a table that is read whole, and of a header at most.
MAX_BYTES, LONGEST = 1 << 30, 1 << 16


@dataclass(frozen=True)
class _Layout:
    """Where a table of one value a row has what: the separator, and the columns of time, value and names."""

    separator: str
    time: int
    time_name: str
    value: int
    names: tuple[int, ...]

    def row(self, cells: Sequence[str]) -> tuple[str, str, str] | None:
        """Return the time, name and value of a row, numbers with a point; None for what is none."""
        if len(cells) <= max(self.time, self.value, *self.names):
            return None
        time, value = (self._pointed(cells[k].strip()) for k in (self.time, self.value))
        return None if number(value) is None else (time, self.name_of(cells), value)

    def _pointed(self, cell: str) -> str:
        """Return a cell with a decimal comma as one with a point: where commas part no cells."""
        pointed = cell.replace(",", ".")
        return pointed if self.separator != "," and number(pointed) is not None else cell

    def name_of(self, cells: Sequence[str] | Mapping[int, str]) -> str:
        """Return the name of a row's value; of a topic the last level is the name."""
        words = (cells[k].strip().strip("/").rsplit("/", 1)[-1] for k in self.names)
        return "_".join(word for word in words if word)


def begins(path: Path) -> bool:
    """Tell a table with one value a row: by its header, and three names among its rows that end in an axis."""
    return _layout(path) is not None


def _layout(path: Path) -> _Layout | None:
    """Return where a table with one value a row has what; None where it is none. Fields may stand below one another."""
    try:
        with path.open("rb") as stream:
            head = stream.read(LONGEST)
        if b"\0" in head or b"\n" not in head:
            return None
        with path.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
            lines = (line for line in stream if line.strip() and not line.startswith("#"))
            header = next(lines, "")
            for separator in ",;\t|":
                if (plain := _of_header(header, separator)) is not None:
                    return _with_names(plain, csv.reader(lines, delimiter=separator))
    except (OSError, csv.Error):
        return None
    return None


def _of_header(header: str, separator: str) -> _Layout | None:
    """Return the columns of a header by their names, all that may name a value among them."""
    row = next(csv.reader([header], delimiter=separator), [])
    words = ["".join(c for c in name.casefold() if c.isalnum()) for name in row]
    values = [k for k, word in enumerate(words) if word in _VALUE]
    times = [k for k, name in enumerate(row) if is_time_name(name.strip(" _")) and words[k] not in _SPAN]
    named = [k for known in _NAMES for k, word in enumerate(words) if word == known and k not in times]
    if len(values) != 1 or not times or not named:
        return None
    return _Layout(separator, times[0], row[times[0]].strip(" _") or "time", values[0], tuple(named))


def _with_names(plain: _Layout, rows: Iterable[Sequence[str]]) -> _Layout | None:
    """Return the layout with those columns of names that tell values apart; None where these are no sensor's axes."""
    seen: set[tuple[str, ...]] = set()
    for cells in rows:
        if len(cells) > max(plain.names) and plain.row(cells) is not None:
            seen.add(tuple(cells[k] for k in plain.names))
        if len(seen) > MOST:
            return None
    # what is the same in all rows is no part of a name
    telling = [k for k, words in zip(plain.names, zip(*seen, strict=True), strict=False) if len(set(words)) > 1]
    found = replace(plain, names=tuple(telling or plain.names[-1:]))
    names = {found.name_of(dict(zip(plain.names, words, strict=True))) for words in seen}
    return found if sum(read_name(name).axis is not None for name in names) > 2 else None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the records of a table as ``target``, and return what to say.

    Values at one time are a record. Where each has a time of its own a record goes on until a name comes again, and has
    the time of its first. Raises `InputError` for a table that is too large.
    """
    layout, size = _layout(raw), raw.stat().st_size
    if layout is None or size > MAX_BYTES:
        raise InputError.at(raw, None, f"is a table of {size >> 20} MB with a value a row; expected at most 1024 MB")
    with raw.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
        lines = (line for line in stream if not line.startswith("#"))
        told = (layout.row(cells) for cells in csv.reader(lines, delimiter=layout.separator))
        rows = [(time, *row) for row in told if row is not None and (time := _seconds(row[0])) is not None]
    rows.sort(key=lambda row: row[0])
    names = list(dict.fromkeys(row[2] for row in rows))
    together = sum(a[0] == b[0] for a, b in pairwise(rows)) > 0.5 * len(rows)
    count = 0
    with target.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([layout.time_name, *names])
        for stamp, cells in _records(rows, together=together):
            writer.writerow([stamp, *(cells.get(name, "") for name in names)])
            count += 1
    return [f"{raw.name}: a row for each value of {', '.join(names[:12])}: {len(rows)} rows are {count} records"]


def _seconds(cell: str) -> float | None:
    """Return a time to sort by; None where a cell is none."""
    found = number(cell)
    if found is None:
        return iso_seconds(cell)
    return found if found == found else None


def _records(rows: Sequence[tuple[float, str, str, str]], *, together: bool) -> Iterator[tuple[str, dict[str, str]]]:
    """Yield the stamp and the cells of each record, from rows (time, stamp, name, value) in the order of time."""
    cells: dict[str, str] = {}
    begun, stamp = 0.0, ""
    for time, written, name, value in rows:
        if cells and ((together and time != begun) or name in cells):
            yield stamp, cells
            cells = {}
        if not cells:
            begun, stamp = time, written
        cells[name] = value
    if cells:
        yield stamp, cells
