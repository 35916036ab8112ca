"""A raw logger file as columns of cells: what is damaged is mended or left out, and every such line is listed."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discsim.arrays import BoolArray, IntArray
from discsim.errors import InputError, printable
from discsim.validation.importing.cell_texts import CellTexts, number, packed
from discsim.validation.importing.labelled import RecordLines, labelled_cells, stamped
from discsim.validation.importing.stamps import stamp_seconds
from discsim.validation.importing.text_lines import TextLines

__all__ = ["REPAIRS", "Layout", "RawTable", "Repair", "RepairList", "read_raw"]

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


#: what is done with a row that cannot be read
LEFT_OUT = "row left out"


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

    def told(self, path: Path, sensor: str) -> str:
        """Return why rows of a sensor were left out of a file: the first of them, and where all are listed."""
        gone = (LEFT_OUT, f"{LEFT_OUT} of {sensor}")
        mine = [repair for repair in self.listed() if repair.file == path.name and repair.action in gone]
        first = f"the first at line {mine[0].line} ({printable(mine[0].what)}); " if mine else ""
        return f"{first}repairs.csv lists them with the reasons"

    def listed(self) -> list[Repair]:
        """Return the repairs, each once, by file and line."""
        return sorted(self._found, key=lambda repair: (repair.file, repair.line))


#: blanks of ASCII beside the end of a line
_BLANKS = " \t\x0b\x0c\x1c\x1d\x1e\x1f"


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
    labelled : bool
        Whether each cell has its name before it (``gx:1.0 gy:2.0``), as for Arduino's serial plotter; a record may go
        over several lines.
    sorted_by : str
        Column of time in whose order the rows are put, where they stand in another one; empty where they stay.
    """

    separator: str = ","
    decimal: str = "."
    skip_lines: int = 0
    columns: tuple[str, ...] = ()
    comment: str = ""
    lists: bool = False
    encoding: str = "utf-8"
    thousands: str = ""
    labelled: bool = False
    sorted_by: str = ""

    def cells(self, line: str) -> list[str]:
        """Return the cells of one line, without the blanks around them."""
        if self.labelled:
            return [cell for _, cell in labelled_cells(line)]
        if (begun := stamped(line)) is not None:
            line = f"{begun[1]}{' ' if self.separator == 'blank' else self.separator}{begun[2]}"
        if self.separator == "blank":
            cells = line.split()
        else:
            try:
                cells = next(csv.reader([line], delimiter=self.separator, skipinitialspace=True), [])
            except csv.Error:
                return [line]
        if self.lists and _closed(line):
            cells = [item for cell in cells for item in _spread(cell)]
        if self.separator == "blank":
            return cells
        cells = [cell.strip() for cell in cells]
        return [self._ungrouped(cell) for cell in cells] if self.thousands else cells

    def _ungrouped(self, cell: str) -> str:
        mark, point = re.escape(self.thousands), re.escape(self.decimal)
        grouped = re.fullmatch(rf"[+-]?[1-9]\d{{0,2}}({mark}\d{{3}})+({point}\d*)?([eE][+-]?\d+)?", cell)
        return cell.replace(self.thousands, "") if grouped else cell


@dataclass(frozen=True)
class RawTable:
    """The sound rows of a raw file, column by column; ``total`` counts the data rows with those left out.

    ``number`` (n,) are the rows' numbers among the data rows, ``line`` (n,) their lines in the file, from 1.
    """

    path: Path
    columns: tuple[str, ...]
    header_line: int
    number: IntArray
    line: IntArray
    texts: tuple[CellTexts, ...]
    total: int

    def __len__(self) -> int:
        return self.number.size

    def line_of(self, number: int) -> int:
        """Return the line in the file of a row, by its number among the data rows."""
        return int(self.line[np.searchsorted(self.number, number)])

    def column(self, name: str) -> CellTexts:
        """Return the cells (n,) of the first column of a name."""
        return self.texts[self.columns.index(name)]

    def cells(self, row: int) -> list[str]:
        """Return the cells of a row, by its place in the table."""
        return [column[row] for column in self.texts]

    def emptied(self) -> RawTable:
        """Return the table without its cells."""
        return replace(self, texts=())

    def select(self, rows: BoolArray) -> RawTable:
        """Return the table of some rows (n,)."""
        columns = tuple(column.select(rows) for column in self.texts)
        return replace(self, number=self.number[rows], line=self.line[rows], texts=columns)

    def in_order_of(self, name: str, decimal: str) -> RawTable:
        """Return the table with its rows in the order of a column of numbers or dates, numbered anew.

        Rows at the same time stay as they stand; where most of them go back in time, that is turned round as well.
        """
        cells = self.column(name)
        time, _ = cells.numbers(decimal)
        if not np.isfinite(time).any():
            time, _ = stamp_seconds(cells)
        known = np.flatnonzero(np.isfinite(time))
        if not known.size:
            return self
        # a row without a time stays behind the one that it stands behind
        time = time[known[np.maximum(np.searchsorted(known, np.arange(time.size), side="right") - 1, 0)]]
        steps = np.diff(time)
        turned = np.arange(time.size)[:: -1 if np.sum(steps < 0.0) > np.sum(steps > 0.0) else 1]
        order = turned[np.argsort(time[turned], kind="stable")]
        texts = tuple(column.select(order) for column in self.texts)
        return replace(self, line=self.line[order], texts=texts)


def _closed(line: str) -> bool:
    """Tell a line whose brackets are all closed; else a list broke off, perhaps within its last number."""
    return sum(map(line.count, "[(")) == sum(map(line.count, "])"))


def _spread(cell: str) -> list[str]:
    """Return the numbers of a list in brackets, as Python prints a list, a tuple or an array; else the cell.

    Where a separator parts the numbers of a list already, its brackets are taken off.

    >>> _spread("[1, 2.5]"), _spread("(1, 2)"), _spread("[ 1. -2.]"), _spread("(0.5"), _spread("3)"), _spread("m(a)")
    (['1', '2.5'], ['1', '2'], ['1.', '-2.'], ['0.5'], ['3'], ['m(a)'])
    """
    text = cell.strip()
    bare = text.lstrip("[(").rstrip("])")
    numbers = [one for one in re.split(r"[\s,'\"]+", bare) if one]
    if bare == text or any(number(one, ".") is None for one in numbers):
        return [cell]
    return numbers


def read_raw(path: Path, layout: Layout, repairs: RepairList) -> RawTable:
    """Read a raw file into columns of cells, all as wide as the header.

    Data rows are numbered from 0 in the order of the file; the header, blank lines, comments and pieces of a
    broken header have no number, a row that is left out keeps its own. Raises `InputError` where the file cannot
    be read, has no row, or has a damage that may not be repaired.
    """
    lines = TextLines(path, layout.encoding)
    if lines.marked:
        repairs.add(None, path, 1, "byte-order mark", "mark left out")
    at = layout.skip_lines
    columns, header_line = layout.columns, 0
    if not columns:
        at, header_line, columns = _header(path, lines, at, layout, repairs)
    rows = _Rows(path, layout, len(columns), repairs)
    before = 0
    for block in lines.blocks():
        rows.add(block, max(at - before, 0), before)
        before += len(block)
    table = rows.table(columns, header_line)
    if not len(table):
        raise InputError.at(path, None, f"no usable row; expected rows of {len(columns)} cells: {', '.join(columns)}")
    if not layout.sorted_by:
        return table
    if layout.sorted_by not in columns:
        raise InputError.at(path, None, f"no column '{layout.sorted_by}' to put rows in order by: {', '.join(columns)}")
    return table.in_order_of(layout.sorted_by, layout.decimal)


class _Rows:
    """The rows of a file as they are read, block by block."""

    def __init__(self, path: Path, layout: Layout, width: int, repairs: RepairList) -> None:
        self.path, self.layout, self.width, self.repairs = path, layout, width, repairs
        self.total = 0
        self.number: list[IntArray] = []
        self.line: list[IntArray] = []
        self.texts: list[list[NDArray[Any]]] = [[] for _ in range(width)]
        self.blank: list[int] = []
        self.last = 0
        self.records = RecordLines(layout.columns) if layout.labelled else None

    def add(self, lines: list[str], start: int, before: int) -> None:
        """Add the lines of a block from ``start`` on; ``before`` lines stand above the block."""
        if start >= len(lines):
            return
        lines = lines[start:]
        first = before + start + 1
        self.last = first + len(lines) - 1
        cells = self._even(lines)
        if cells is not None:
            number, line = np.arange(self.total, self.total + len(lines)), np.arange(first, first + len(lines))
            self.total += len(lines)
        else:
            number, line, cells = self._one_by_one(lines, first)
        if number.size:
            self.number.append(number)
            self.line.append(line)
            for texts, column in zip(self.texts, zip(*cells, strict=True), strict=True):
                texts.append(packed(column))

    def _even(self, lines: list[str]) -> list[list[str]] | None:
        """Return the cells of lines that are all sound rows, plainly written; None where one may be otherwise."""
        layout, text = self.layout, "\n".join(lines)
        marks = ('"', "> ", "]", ": ", *([layout.comment] if layout.comment else []))
        if self.width < 2 or layout.lists or layout.thousands or layout.labelled or any(mark in text for mark in marks):
            return None
        if layout.separator == "blank":
            cells = [line.split() for line in lines]
        elif not text.isascii() or any(blank in text for blank in _BLANKS if blank != layout.separator):
            return None  # blanks about cells are taken off one by one
        else:
            cells = [line.split(layout.separator) for line in lines]
        return cells if all(len(row) == self.width for row in cells) else None

    def _one_by_one(self, lines: list[str], first: int) -> tuple[IntArray, IntArray, list[list[str]]]:
        """Return numbers, lines and cells of the sound rows; what is damaged is listed."""
        numbers, places, rows = [], [], []
        for line, text in enumerate(lines, start=first):
            sound = self._alone(line, text) if self.records is None else self._ended(line, text, self.records)
            if sound is not None:
                numbers.append(self.total)
                places.append(sound[0])
                rows.append(sound[1])
                self.total += 1
        return np.array(numbers, dtype=np.int64), np.array(places, dtype=np.int64), rows

    def _alone(self, line: int, whole: str) -> tuple[int, list[str]] | None:
        """Return the line and cells of a row in a line of its own; None for what is none, or damaged."""
        text = _without_comment(self.path, line, whole, self.layout, self.repairs, self.width)
        if not text.strip():
            self.blank += [] if whole.strip() else [line]
            return None
        cells = self.layout.cells(text)
        if len(cells) == self.width:
            return line, cells
        self._leave_out(line, f"{len(cells)} cells")
        return None

    def _ended(self, line: int, text: str, records: RecordLines) -> tuple[int, list[str]] | None:
        """Return the first line and the cells of the row that a line of names and numbers ends; None if none."""
        ended, broken = records.add(line, text)
        for place, count in broken:
            self._leave_out(place, f"{count} cells under names of its columns")
        return ended

    def _leave_out(self, line: int, has: str) -> None:
        """List a row that is left out, which keeps its number."""
        what = f"data row {self.total} has {has}, expected {self.width}"
        self.repairs.add("width", self.path, line, what, "row left out")
        self.total += 1

    def _tell_blank(self) -> None:
        r"""List blank lines but the last; where lines end twice (``\n\r``), as many as rows, they are one repair."""
        blank = [line for line in self.blank if line != self.last]
        if len(blank) > 1 and len(blank) >= self.total - 1:
            what = f"{len(blank)} blank lines, the first here: each line ends twice"
            self.repairs.add(None, self.path, blank[0], what, "lines left out")
            return
        for line in blank:
            self.repairs.add(None, self.path, line, "blank line", "line left out")

    def table(self, columns: tuple[str, ...], header_line: int) -> RawTable:
        """Return the table of all rows; the blocks are let go column by column."""
        self._tell_blank()
        empty = np.empty(0, dtype=np.int64)
        number, line = np.concatenate([empty, *self.number]), np.concatenate([empty, *self.line])
        texts = []
        while self.texts:
            texts.append(CellTexts.joined(self.texts.pop(0)))
        return RawTable(self.path, columns, header_line, number, line, tuple(texts), self.total)


def _without_comment(
    path: Path, line: int, text: str, layout: Layout, repairs: RepairList, width: int | None = None
) -> str:
    """Return a line without its comment, which is listed; records have ``width`` cells, None above the header."""
    if not layout.comment or layout.comment not in text:
        return text
    record, _, comment = text.partition(layout.comment)
    quoted = f"{layout.comment}{comment}"[:60]
    if record.strip():
        repairs.add("comment", path, line, f"comment glued to a record: {quoted}", "comment left out")
    elif width is not None and _ends_in_record(comment, width, layout):
        repairs.add("comment", path, line, f"comment with a record glued to it: {quoted}", "both left out")
    else:
        repairs.add("comment", path, line, f"comment: {quoted}", "comment left out")
    return record


def _ends_in_record(comment: str, width: int, layout: Layout) -> bool:
    """Tell a comment that a record is glued to: numbers stand in the last cells, as many as the first leaves of one."""
    cells = layout.cells(comment)
    last = cells[len(cells) - width + 1 :]
    return len(cells) >= width > 1 and all(cell and number(cell, layout.decimal) is not None for cell in last)


def _header(
    path: Path, lines: TextLines, at: int, layout: Layout, repairs: RepairList
) -> tuple[int, int, tuple[str, ...]]:
    """Return the index of the first line after the header, the header's line (1-based) and its names."""
    while (line := lines.find(at)) is not None:
        if _without_comment(path, at + 1, line, layout, repairs).strip():
            break
        at += 1
    if line is None:
        raise InputError.at(path, None, "the file is empty; expected a header line")
    cells = layout.cells(line)
    stale = len(cells)
    while stale > 0 and number(cells[stale - 1], layout.decimal) is not None and cells[stale - 1]:
        stale -= 1
    rest, record = lines.find(at + 1) or "", lines.find(at + 2)
    goes_on = any(number(cell, layout.decimal) is None for cell in layout.cells(rest))
    if not 0 < stale < len(cells) or not goes_on:
        return at + 1, at + 1, tuple(cells)
    # the last name has the first number of the stale record glued to it
    name, first = _split_name(cells[stale - 1])
    separator = "\t" if layout.separator == "blank" else layout.separator
    whole = layout.cells(separator.join([*cells[: stale - 1], name]) + rest)
    width = 0 if record is None else len(layout.cells(record))
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
