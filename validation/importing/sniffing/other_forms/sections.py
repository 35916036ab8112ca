"""Tables of several sensors one below the other in a text, each with its own names above: a file for each.

Read as one table, the rows of a later sensor were taken for the first one's.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.sniffing.names import read_name, sensor_of
from discsim.validation.importing.sniffing.other_forms.written import (
    FEWEST,
    MAX_BYTES,
    NUMBER,
    check_size,
    first_lines,
    write_named,
)
from discsim.validation.importing.sniffing.units import split_unit

__all__ = ["begins", "write_tables"]

_PARTS, _BLANKS = re.compile(r"[,;\t|]"), re.compile(r"\s+")
_NUMBER = re.compile(NUMBER)
_ROW = re.compile(rf"\s*\"?{NUMBER}\"?\s*(?:[,;\t|]|\s).*\d.*")
#: A name alone, between marks of any kind: `--- Gyroscope (deg/s): ---`.
_TITLE = re.compile(r"[^\w]*([^\W\d][^:=,;\t|]*?)[\s:=*#,;-]*")


class _Section(NamedTuple):
    """A table of the text: what stands above its rows, the line of names last, and those."""

    head: list[str]
    rows: list[str]

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that the lines above the rows speak of, by a title or by three columns."""
        found = list[str]()
        for line in self.head:
            title = _TITLE.fullmatch(line.strip())
            named = [sensor_of(split_unit(title[1])[0])] if title is not None else []
            parts = _PARTS if _PARTS.search(line) else _BLANKS
            cells = [sensor_of(read_name(cell.strip(' "')).base) for cell in parts.split(line.strip())]
            found += [one for one in (*named, *(cell for cell in cells if cells.count(cell) > 2)) if one]
        return tuple(dict.fromkeys(found))

    @property
    def table(self) -> str:
        """Its names and its rows."""
        return "\n".join([*self.head[-1:], *self.rows, ""])


def begins(path: Path) -> bool:
    """Tell a text that begins with the table of one sensor, and in which a line names another one further below."""
    _, lines = first_lines(path)
    first = next(_sections(lines), None)
    if first is None or len(first.sensors) != 1 or path.stat().st_size > MAX_BYTES:
        return False
    return len({sensor for section in _whole(path) for sensor in section.sensors}) > 1


def _whole(path: Path) -> list[_Section]:
    encoding, _ = first_lines(path)
    with path.open(encoding=encoding, errors="replace") as lines:
        return list(_sections(line.rstrip("\n") for line in lines))


def _sections(lines: Iterable[str]) -> Iterator[_Section]:
    """Yield the tables of a text: rows below a line of names that has as many cells as they.

    Lines amid the rows that are no such head, as messages of a program, are left out.
    """
    head, rows, between = list[str](), list[str](), list[str]()
    for line in lines:
        if not _ROW.fullmatch(line):
            between += [line] * bool(line.strip())
            continue
        if between and _are_names(between[-1], line):
            if len(rows) >= FEWEST:
                yield _Section(head, rows)
            head, rows = between[-3:], []
        between = []
        rows.append(line)
    if len(rows) >= FEWEST:
        yield _Section(head, rows)


def _are_names(line: str, row: str) -> bool:
    """Tell a line of names by the row below it: as many cells, at least three, and no number."""
    parts = _PARTS if _PARTS.search(row) else _BLANKS
    names, cells = ([cell for cell in parts.split(text.strip()) if cell.strip()] for text in (line, row))
    return 3 <= len(names) == len(cells) and not any(_NUMBER.fullmatch(name.strip()) for name in names)


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write each table of a text as a file that is called after its sensor, and return what to say.

    Raises `InputError` for a text that is too large.
    """
    check_size(raw, "a text of several tables", MAX_BYTES)
    texts: dict[str, str] = {}
    for section in _whole(raw):
        name = "_".join(section.sensors) or "table"
        more = sum(known.rpartition("_")[0] == name or known == name for known in texts)
        texts[f"{name}_{more + 1}" if more else name] = section.table
    if len(texts) < 2:
        raise InputError.at(raw, None, "has no tables one below the other any more; expected the file that it was")
    write_named(target, texts)
    return [f"{raw.name}: a table for each of {', '.join(texts)}, one below the other; read as files of their own"]
