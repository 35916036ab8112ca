"""What Teleplot writes: a row for each moment at which it received anything, with the columns that came, as records.

Its device prints `>gx:1.0` and so on in turn; what came within a millisecond stands in one row, so that three axes of a
sensor are often in two. A record goes on until one of its columns comes again.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.cell_texts import number
from discsim.validation.importing.sniffing.other_forms.written import first_bytes

__all__ = ["begins", "write_tables"]

#: Milliseconds since 1970 are more than this from March 1973 on, and seconds for 3000 years not.
MS = 1e11
_BEGINS = re.compile(rb'(?:\xef\xbb\xbf)?timestamp\(ms\),[^\r\n]*,\r?\n"\d+(?:\.\d+)?",')


def begins(path: Path) -> bool:
    """Tell a table of Teleplot's by its first two lines: names, and numbers in quotes."""
    return _BEGINS.match(first_bytes(path, 1 << 16)) is not None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table's records as ``target``, and return what to say.

    Its time is that of the day; where it is too small for ms it is in s, whatever its name says. Raises `InputError`
    where the file cannot be read.
    """
    try:
        with raw.open(encoding="utf-8-sig", errors="replace", newline="") as stream:
            lines = csv.reader(stream)
            names = next(lines)
            rows = [row for row in lines if row and number(row[0])]
    except (OSError, csv.Error) as error:
        raise InputError.at(raw, None, f"cannot be read ({error}); expected what Teleplot wrote") from None
    records = list(_joined(rows))
    unit = "s" if records and float(records[0][0]) < MS else "ms"
    with target.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow([f"time ({unit})", *(name.strip() for name in names[1:] if name.strip())])
        width = sum(bool(name.strip()) for name in names[1:])
        for time, cells in records:
            writer.writerow([time, *(cells.get(k, "") for k in range(1, width + 1))])
    return [f"{raw.name}: written by Teleplot: {len(rows)} rows joined to {len(records)} records"]


def _joined(rows: list[list[str]]) -> Iterator[tuple[str, dict[int, str]]]:
    """Yield records: the time at which most of one came, and its cells by column."""
    cells: dict[int, str] = {}
    time, most = "", 0
    for row in rows:
        found = {k: cell for k, cell in enumerate(row) if k and cell}
        if not found.keys().isdisjoint(cells):
            yield time, cells
            cells, most = {}, 0
        cells |= found
        if len(found) > most:
            time, most = row[0], len(found)
    if cells:
        yield time, cells
