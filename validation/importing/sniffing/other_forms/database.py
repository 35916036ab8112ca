"""The tables of an SQLite file, as phones' loggers keep them; no other program is needed to read it."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.sniffing.other_forms.written import (
    check_size,
    comma_separated,
    first_bytes,
    holds_log,
    read_and_left,
    write_named,
)

__all__ = ["begins", "write_tables"]

_BEGINS = b"SQLite format 3\0"
#: Bytes of a file that is read whole.
MAX_BYTES = 1 << 30


def begins(path: Path) -> bool:
    """Tell an SQLite file by its first bytes."""
    return first_bytes(path, len(_BEGINS)) == _BEGINS


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the tables with rows of numbers, and return what to say.

    Raises `InputError` for a damaged file, one that is too large and one without such a table.
    """
    check_size(raw, "a data base", MAX_BYTES)
    texts, left = {}, []
    try:
        # opened so that nothing is written beside it, whoever else has it open
        with closing(sqlite3.connect(f"{raw.resolve().as_uri()}?mode=ro&immutable=1", uri=True)) as base:
            listed = base.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite_%'")
            for (name,) in listed.fetchall():
                quoted = name.replace('"', '""')
                rows = base.execute(f'SELECT * FROM "{quoted}"')
                header, cells = [column[0] for column in rows.description], rows.fetchall()
                if not holds_log(cells):
                    left.append(name)
                    continue
                texts[name] = comma_separated([header, *([_cell(cell) for cell in row] for row in cells)])
    except sqlite3.Error as error:
        raise InputError.at(raw, None, f"is a damaged SQLite data base ({error}); expected one that opens") from None
    if not texts:
        raise InputError.at(raw, None, "is an SQLite data base without rows of numbers in it; expected those of a log")
    write_named(target, texts)
    return [read_and_left(raw, "a data base", ", ".join(texts), left)]


def _cell(value: object) -> str:
    return "" if value is None or isinstance(value, bytes) else str(value)
