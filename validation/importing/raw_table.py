"""A raw logger file as rows of cells: what is damaged is mended or left out, and every such line is listed."""

from __future__ import annotations

import codecs
import csv
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError

__all__ = ["REPAIRS", "Layout", "RawRow", "RawTable", "Repair", "RepairList", "number", "read_raw"]

#: What a map may allow, and what is then done.
REPAIRS = {
    "header": "a header broken off with a stale record glued to it is put together again",
    "comment": "comment lines, and comments glued to a record, are left out",
    "width": "a row with too few or too many cells is left out",
    "number": "an empty cell becomes a gap; a row with a cell that is no number is left out",
    "time": "a counter that wrapped goes on; of a log that began again the longest stretch is kept; "
    "of what is left the fewest rows are left out that make time ascend",
    "counter": "a row counter that jumps leaves a gap in time",
}


class Repair(NamedTuple):
    """One damaged line: where it stands, what is wrong with it and what was done."""

    file: str
    line: int
    what: str
    action: str


class RepairList:
    """Repairs in one import; refuses those that the map does not allow."""

    def __init__(self, allowed: Iterable[str]) -> None:
        self._allowed = frozenset(allowed)
        self._found: dict[Repair, None] = {}

    def add(self, kind: str | None, path: Path, line: int, what: str, action: str) -> None:
        """List a repair of ``kind`` (None: harmless, always allowed); raises `InputError` where it is not allowed."""
        if kind is not None and kind not in self._allowed:
            raise InputError.at(path, line, f"{what}; the map does not allow the repair '{kind}' ({REPAIRS[kind]})")
        self._found[Repair(path.name, line, what, action)] = None

    def listed(self) -> list[Repair]:
        """Return the repairs, each once, by file and line."""
        return sorted(self._found, key=lambda repair: (repair.file, repair.line))


#: What Arduino's serial monitor puts before a line.
_MONITOR = re.compile(r"^(\d\d?:\d\d:\d\d(?:\.\d+)?) -> ")


@dataclass(frozen=True)
class Layout:
    """How the text of a raw file is laid out.

    Attributes
    ----------
    separator : str
        One character, or ``blank`` for any run of blanks and tabs.
    decimal : str
        ``.`` or ``,``.
    skip_lines : int
        Lines before the header (or before the first record).
    columns : tuple of str
        Names of the columns of a file without a header; empty where there is one.
    comment : str
        What starts a comment; empty where there are none.
    lists : bool
        Whether a cell may hold a list in brackets, which is spread over as many columns.
    encoding : str
        Name of the text's encoding, as Python knows it.
    thousands : str
        Mark between thousands (``1.234,56`` has ``.``); empty where there is none. A number has no zero before it.
    """

    separator: str = ","
    decimal: str = "."
    skip_lines: int = 0
    columns: tuple[str, ...] = ()
    comment: str = ""
    lists: bool = False
    encoding: str = "utf-8"
    thousands: str = ""

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line, without the blanks around them."""
        if "-> " in line:
            line = _MONITOR.sub(rf"\1{' ' if self.separator == 'blank' else self.separator}", line)
        if self.separator == "blank":
            return line.split()
        try:
            cells = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True), [])
        except csv.Error:
            return [line]
        if self.lists:
            cells = [item for cell in cells for item in _spread(cell)]
        cells = [cell.strip() for cell in cells]
        return [self._ungrouped(cell) for cell in cells] if self.thousands else cells

    def _ungrouped(self, cell: str) -> str:
        mark, point = re.escape(self.thousands), re.escape(self.decimal)
        grouped = re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}({mark}\d{{3}})+({point}\d*)?([eE][+-]?\d+)?", cell)
        return cell.replace(self.thousands, "") if grouped else cell


class RawRow(NamedTuple):
    """A record: its number among the data rows, its line in the file (1-based) and its cells."""

    number: int
    line: int
    cells: list[str]


@dataclass(frozen=True)
class RawTable:
    """The sound rows of a raw file; ``total`` counts the data rows with those left out."""

    path: Path
    columns: tuple[str, ...]
    header_line: int
    rows: tuple[RawRow, ...]
    total: int


def _spread(cell: str) -> list[str]:
    text = cell.strip()
    if not (text.startswith("[") and text.endswith("]")):
        return [cell]
    try:
        items = json.loads(text)
    except json.JSONDecodeError:
        return [cell]
    return [str(item) for item in items]


#: what tools write where there is no number (pandas, R, spreadsheets, C libraries), and for one that is too large
GAPS = frozenset(
    {
        "nan",
        "-nan",
        "+nan",
        "na",
        "n/a",
        "#n/a",
        "null",
        "none",
        "nil",
        "-",
        "--",
        "?",
        "#num!",
        "#value!",
        "#div/0!",
        "1.#qnan",
        "-1.#ind",
        "1.#ind",
        "nan(ind)",
        "-nan(ind)",
        "inf",
        "-inf",
        "+inf",
        "infinity",
        "-infinity",
        "+infinity",
        "1.#inf",
        "-1.#inf",
        "ovf",
        "ovfl",
        "overflow",
    }
)


def number(cell: str, decimal: str = ".") -> float | None:
    """Return a cell's finite number, NaN where it is empty or one of `GAPS`, None where it is neither."""
    text = cell.replace(",", ".") if decimal == "," else cell
    if text == "" or text.lower() in GAPS:
        return float("nan")
    try:
        value = float(text)
    except ValueError:
        return None
    # float() takes 1_000, and 1e999 as infinite; no logger means a number by them
    return value if "_" not in text and abs(value) < float("inf") else None


def read_raw(path: Path, layout: Layout, repairs: RepairList) -> RawTable:
    """Read a raw file into rows of cells, all as wide as the header.

    Data rows are numbered from 0 in the order of the file; the header, blank lines, comments and pieces of a
    broken header have no number, a row that is left out keeps its own. Raises `InputError` where the file cannot
    be read, has no row, or has a damage that may not be repaired.
    """
    lines = _lines(path, layout.encoding, repairs)
    at = layout.skip_lines
    columns, header_line = layout.columns, 0
    if not columns:
        at, header_line, columns = _header(path, lines, at, layout, repairs)
    rows: list[RawRow] = []
    total = 0
    for index in range(at, len(lines)):
        text = _without_comment(path, index + 1, lines[index], layout, repairs)
        if not text.strip():
            if index < len(lines) - 1 and not lines[index].strip():
                repairs.add(None, path, index + 1, "blank line", "line left out")
            continue
        cells = layout.cells(text)
        if len(cells) == len(columns):
            rows.append(RawRow(total, index + 1, cells))
        else:
            what = f"data row {total} has {len(cells)} cells, expected {len(columns)}"
            repairs.add("width", path, index + 1, what, "row left out")
        total += 1
    if not rows:
        raise InputError.at(path, None, f"no usable row; expected rows of {len(columns)} cells: {', '.join(columns)}")
    return RawTable(path, columns, header_line, tuple(rows), total)


def _lines(path: Path, encoding: str, repairs: RepairList) -> list[str]:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError.at(path, None, f"cannot be read ({error.strerror})") from None
    if content.startswith(codecs.BOM_UTF8):
        repairs.add(None, path, 1, "byte-order mark", "mark left out")
        content = content.removeprefix(codecs.BOM_UTF8)
    # a byte that is no text becomes a sign that no number has, so that its cell is found below
    text = content.decode(encoding, errors="replace").removeprefix("\ufeff")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _without_comment(path: Path, line: int, text: str, layout: Layout, repairs: RepairList) -> str:
    if not layout.comment or layout.comment not in text:
        return text
    record, _, comment = text.partition(layout.comment)
    quoted = f"{layout.comment}{comment}"[:60]
    if record.strip():
        repairs.add("comment", path, line, f"comment glued to a record: {quoted}", "comment left out")
    elif layout.separator in comment:
        repairs.add("comment", path, line, f"comment with a record glued to it: {quoted}", "both left out")
    else:
        repairs.add("comment", path, line, f"comment: {quoted}", "comment left out")
    return record


def _header(
    path: Path, lines: list[str], at: int, layout: Layout, repairs: RepairList
) -> tuple[int, int, tuple[str, ...]]:
    """Return the index of the first line after the header, the header's line (1-based) and its names."""
    while at < len(lines) and not _without_comment(path, at + 1, lines[at], layout, repairs).strip():
        at += 1
    if at == len(lines):
        raise InputError.at(path, None, "the file is empty; expected a header line")
    cells = layout.cells(lines[at])
    stale = len(cells)
    while stale > 0 and number(cells[stale - 1], layout.decimal) is not None and cells[stale - 1]:
        stale -= 1
    rest = lines[at + 1] if at + 1 < len(lines) else ""
    goes_on = any(number(cell, layout.decimal) is None for cell in layout.cells(rest))
    if not 0 < stale < len(cells) or not goes_on:
        return at + 1, at + 1, tuple(cells)
    # the last name has the first number of the stale record glued to it
    name, first = _split_name(cells[stale - 1])
    separator = "\t" if layout.separator == "blank" else layout.separator
    whole = layout.cells(separator.join([*cells[: stale - 1], name]) + rest)
    width = len(layout.cells(lines[at + 2])) if at + 2 < len(lines) else 0
    if len(whole) != width:
        raise InputError.at(
            path, at + 1, f"broken header: with the next line it has {len(whole)} names, the next row {width} cells"
        )
    repairs.add(
        "header",
        path,
        at + 1,
        f"header breaks off after '{name}' with a stale record ({first}, ...) glued to it",
        f"names joined with those of line {at + 2}; stale record left out",
    )
    return at + 2, at + 1, tuple(whole)


def _split_name(cell: str) -> tuple[str, str]:
    match = re.fullmatch(r"(.*?)(-?\d+(?:\.\d*)?)?", cell)
    assert match is not None
    return match.group(1), match.group(2) or ""
