"""Spreadsheets as tables of text: a phone's export to Excel, or a log that somebody opened and saved there.

Takes a file of Excel's (.xlsx, .xls, .xlsb) or of OpenDocument (.ods); gives a file of comma-separated text, or a
folder with one for each sheet that holds rows of numbers. A well-kept reader opens it (`python-calamine`).
"""

from __future__ import annotations

import datetime
import zipfile
from pathlib import Path
from typing import Any

from discsim.errors import InputError
from discsim.validation.importing.sniffing.other_forms.written import (
    comma_separated,
    first_bytes,
    holds_log,
    read_and_left,
    write_named,
)

__all__ = ["begins", "write_tables"]

#: First bytes of Excel's files up to 2003, which are those of an old Word document, too.
_OLD = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
#: Rows of a sheet are at most 2^20; more bytes than this in a packed file are no log's.
MAX_BYTES = 1 << 29


def begins(path: Path) -> bool:
    """Tell a spreadsheet by its first bytes, and one that is packed as a zip by what is in it."""
    head = first_bytes(path, len(_OLD))
    if head == _OLD:
        return path.suffix.lower() == ".xls"
    if not head.startswith(b"PK\x03\x04"):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            names = {member.filename for member in archive.infolist()}
            within = sum(member.file_size for member in archive.infolist()) <= MAX_BYTES
    except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError):
        return False
    return within and bool({"xl/workbook.xml", "xl/workbook.bin", "content.xml"} & names)


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the sheets with rows of numbers as ``target``, or into a folder of that name, and return what to say.

    Raises `InputError` where the reader is not installed, the file cannot be read, or holds no rows of numbers.
    """
    try:
        from python_calamine import CalamineError, CalamineWorkbook
    except ImportError:
        raise InputError.at(
            raw,
            None,
            'is a spreadsheet, whose reader is not installed; get it: pip install "discsim[logs]", or save it as CSV',
        ) from None
    try:
        book = CalamineWorkbook.from_path(raw)
        sheets = {name: book.get_sheet_by_name(name).to_python() for name in book.sheet_names}
    except (CalamineError, OSError, ValueError) as error:
        raise InputError.at(raw, None, f"is a damaged spreadsheet ({error}); expected one that opens") from None
    logged = {name: rows for name, rows in sheets.items() if holds_log(rows)}
    if not logged:
        raise InputError.at(raw, None, "is a spreadsheet without rows of numbers in it; expected those of a log")
    texts = {name: comma_separated([_cell(cell) for cell in row] for row in rows) for name, rows in logged.items()}
    write_named(target, texts)
    left = [name for name in sheets if name not in logged]
    return [read_and_left(raw, "a spreadsheet", ", ".join(logged), left)]


def _cell(value: Any) -> str:
    """Return a cell as text: whole numbers without a point, dates and times as ISO has them, what went by in s.

    >>> _cell(5.0), _cell(0.25), _cell(True), _cell(datetime.datetime(2026, 8, 11, 14, 3, 20, 250000))
    ('5', '0.25', '1', '2026-08-11 14:03:20.250000')
    """
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return str(int(value)) if value.is_integer() and abs(value) < 1e15 else repr(value)
    if isinstance(value, datetime.datetime):
        return value.isoformat(sep=" ", timespec="microseconds")
    if isinstance(value, datetime.timedelta):
        return repr(value.total_seconds())
    return value.isoformat() if isinstance(value, datetime.date | datetime.time) else str(value)
