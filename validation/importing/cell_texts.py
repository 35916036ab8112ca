"""One column of a raw table: its cells as text, packed, and as numbers.

Takes the cells in blocks; gives them back one by one, all at once as numbers, or compared with one another. A log of
hours has tens of millions of cells: as strings of Python's each takes 60 bytes, packed as many as its longest sign.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discsim.arrays import BoolArray, FloatArray, IntArray

__all__ = ["GAPS", "CellTexts", "number", "packed"]

#: cells that are read at once
_BLOCK = 1 << 16
#: longest cell that the others are padded to: a string of Python's takes as much
_LONGEST = 56

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


def packed(cells: Sequence[str]) -> NDArray[Any]:
    """Return cells (n,) as bytes of equal length where they are short and ASCII, else as strings."""
    try:
        found = np.array(cells, dtype=np.bytes_)
    except UnicodeEncodeError:
        found = None
    # numpy takes zeros at the end for padding
    if found is None or found.itemsize > _LONGEST or "\0" in "".join(cells):
        found = np.empty(len(cells), dtype=object)
        found[:] = cells
    return found


@dataclass(frozen=True)
class CellTexts:
    """The cells of one column, (n,)."""

    cells: NDArray[Any]

    @classmethod
    def joined(cls, blocks: list[NDArray[Any]]) -> CellTexts:
        """Return the column of blocks that were `packed`."""
        if any(block.dtype == object for block in blocks):
            blocks = [_strings(block) for block in blocks]
        return cls(np.concatenate([np.empty(0, dtype="S1"), *blocks]) if blocks else np.empty(0, dtype="S1"))

    def __len__(self) -> int:
        return self.cells.size

    def __getitem__(self, at: int) -> str:
        cell = self.cells[at]
        return cell.decode("ascii") if isinstance(cell, bytes) else str(cell)

    def __iter__(self) -> Iterator[str]:
        for start in range(0, self.cells.size, _BLOCK):
            yield from _strings(self.cells[start : start + _BLOCK])

    def select(self, rows: BoolArray | IntArray) -> CellTexts:
        """Return the cells of some rows, chosen (n,) or in an order (m,)."""
        return CellTexts(self.cells[rows])

    def equal(self, text: str) -> BoolArray:
        """Tell which cells (n,) are this text."""
        if self.cells.dtype == object:
            return np.asarray(self.cells == text, dtype=np.bool_)
        return np.asarray(self.cells == text.encode(), dtype=np.bool_) if text.isascii() else np.zeros(len(self), bool)

    def repeated(self) -> BoolArray:
        """Tell which cells (n,) are as the one before."""
        same = np.asarray(self.cells[1:] == self.cells[:-1], dtype=np.bool_)
        return np.concatenate([np.zeros(min(1, len(self)), dtype=np.bool_), same])

    def few(self, most: int) -> tuple[str, ...] | None:
        """Return the different cells in the order of appearance; None where there are more than ``most``."""
        found: dict[str, None] = {}
        for start in range(0, self.cells.size, _BLOCK):
            different, first = np.unique(self.cells[start : start + _BLOCK], return_index=True)
            if different.size > most:
                return None
            found.update(dict.fromkeys(_strings(different[np.argsort(first)])))
            if len(found) > most:
                return None
        return tuple(found)

    def numbers(self, decimal: str = ".") -> tuple[FloatArray, BoolArray]:
        """Return the numbers (n,) as `number` gives them, NaN where there is none, and which cells (n,) are neither."""
        value, wrong = np.full(len(self), np.nan), np.zeros(len(self), dtype=np.bool_)
        for start in range(0, self.cells.size, _BLOCK):
            part = slice(start, start + _BLOCK)
            _read(self.cells[part], decimal, value[part], wrong[part])
        return value, wrong


def _strings(cells: NDArray[Any]) -> NDArray[Any]:
    return cells if cells.dtype == object else cells.astype(np.str_).astype(object)


def _read(cells: NDArray[Any], decimal: str, value: FloatArray, wrong: BoolArray) -> None:
    """Write the numbers of some cells, and which are none."""
    odd = np.arange(cells.size)
    if cells.dtype != object:
        text = cells.tobytes()
        if decimal == "," and b"," in text:
            text = text.replace(b",", b".")
        there = cells != b""
        try:
            value[there] = np.frombuffer(text, dtype=cells.dtype)[there].astype(np.float64)
            odd = np.flatnonzero(there & ~np.isfinite(value)) if b"_" not in text else odd
        except ValueError:  # a cell that is none is looked for among them one by one
            pass
    for k in odd:
        cell = cells[k]
        found = number(cell.decode("ascii") if isinstance(cell, bytes) else cell, decimal)
        value[k], wrong[k] = (np.nan, True) if found is None else (found, False)
