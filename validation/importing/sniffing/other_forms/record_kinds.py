"""Lines of records of several kinds, each with its kind in front (`IMU,12,0.1,..`, `$GPS,12,47,..`): a table for each.

As one table only the records of the most usual length would be rows. A FlySight 2 names the columns of a kind in a line
of their own, and their units in another (`$COL,IMU,time,wx,..`, `$UNIT,IMU,s,deg/s,..`).
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.labelled import split_stamp
from discsim.validation.importing.sniffing.other_forms.written import (
    FEWEST,
    NUMBER,
    first_lines,
    read_and_left,
)

__all__ = ["begins", "write_tables"]

_KIND = re.compile(r"\$?[^\W\d][\w-]*")
#: A checksum behind a record, as of NMEA's sentences.
_CHECKSUM = re.compile(r"\*[0-9A-Fa-f]{2}$")
#: Records that name the columns of the kind which comes next in them, and their units.
_COLUMNS, _UNITS = "COL", "UNIT"
_NUMBER = re.compile(NUMBER)
_SEPARATORS = ",;\t|"
#: Share of a log's lines that must be records of its kinds, and of a kind's that must be as long as one another: a line
#: that broke off is no kind of its own.
_MOST = 0.9
#: Kinds of record in one log; ArduPilot's have some 150.
_MAX_KINDS = 200


class _Kind(NamedTuple):
    """What a log has of a kind of record: lines of each number of cells, and the names of the cells."""

    lengths: Counter[int]
    names: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """How many records it has."""
        return self.lengths.total()

    @property
    def length(self) -> int:
        """The number of cells of most of its records."""
        return max(self.lengths, key=lambda length: self.lengths[length], default=0)

    @property
    def regular(self) -> bool:
        """Whether nearly all of its records have as many cells."""
        return self.rows > 0 and self.lengths[self.length] >= _MOST * self.rows


def begins(path: Path) -> bool:
    """Tell a text of records of kinds that differ in how many cells they have, or whose columns it names."""
    _, lines = first_lines(path)
    return _separator_of(lines) is not None


def _separator_of(lines: Iterable[str]) -> str | None:
    """Return what parts the cells of records of several kinds; None where lines are no such records."""
    some = [line for line in lines if line.strip()]
    for separator in _SEPARATORS:
        kinds = _kinds(some, separator)
        tables = [kind for kind in kinds.values() if kind.regular and kind.rows > 1]
        read = sum(kind.rows + bool(kind.names) for kind in kinds.values())
        told = len({kind.length for kind in tables}) > 1 or (
            bool(tables) and any(word == _COLUMNS for _, word, _ in _records(some, separator))
        )
        if told and read >= _MOST * len(some) and max(kind.rows for kind in tables) >= FEWEST:
            return separator
    return None


def _kinds(lines: Iterable[str], separator: str) -> dict[str, _Kind]:
    """Return what is there of each kind of record, by its word; names stand above a kind's first record."""
    lengths: dict[str, Counter[int]] = {}
    names: dict[str, tuple[str, ...]] = {}
    units: dict[str, tuple[str, ...]] = {}
    for _, word, cells in _records(lines, separator):
        if word in (_COLUMNS, _UNITS) and _KIND.fullmatch(cells[0]):
            (names if word == _COLUMNS else units)[cells[0]] = tuple(cells[1:])
            continue
        if word not in lengths and len(lengths) >= _MAX_KINDS:
            continue
        seen = lengths.setdefault(word, Counter())
        numbers = sum(_NUMBER.fullmatch(cell) is not None for cell in cells)
        if numbers >= 2:
            seen[len(cells)] += 1
        elif not seen and not numbers and all(cells):
            names[word] = tuple(cells)
    return {word: _Kind(seen, _with_units(names.get(word, ()), units.get(word, ()))) for word, seen in lengths.items()}


def _with_units(names: tuple[str, ...], units: tuple[str, ...]) -> tuple[str, ...]:
    """Return names with their units in brackets, where as many are stated."""
    if len(units) != len(names):
        return names
    return tuple(f"{name} ({unit})" if unit else name for name, unit in zip(names, units, strict=True))


def _records(lines: Iterable[str], separator: str) -> Iterator[tuple[str, str, list[str]]]:
    """Yield what a serial monitor put before a record, the word of its kind, and its cells.

    A word before each number is that number's name, and no kind.
    """
    for line in lines:
        stamp, text = split_stamp(line)
        word, *cells = (cell.strip() for cell in _CHECKSUM.sub("", text.rstrip()).split(separator))
        named = len(cells) > 1 and all(_KIND.fullmatch(cell) for cell in cells[1::2])
        if len(cells) >= 2 and _KIND.fullmatch(word) and (not named or _KIND.fullmatch(cells[0])):
            yield stamp, word.removeprefix("$"), cells


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table for each kind of record, and return what to say.

    Raises `InputError` where the file cannot be read.
    """
    encoding, first = first_lines(raw)
    separator = _separator_of(first)
    assert separator is not None
    try:
        with raw.open(encoding=encoding, errors="replace") as lines:
            kinds = _kinds((line.rstrip("\n") for line in lines), separator)
        chosen = {word: kind for word, kind in kinds.items() if kind.regular and kind.rows >= FEWEST}
        with raw.open(encoding=encoding, errors="replace") as lines:
            _write(lines, separator, chosen, target)
    except OSError as error:
        raise InputError.at(raw, None, f"cannot be read ({error}); expected lines of text") from None
    left = [word for word in kinds if word not in chosen]
    return [read_and_left(raw, "its lines are records of several kinds, a table each", ", ".join(chosen), left)]


def _write(lines: Iterable[str], separator: str, kinds: dict[str, _Kind], target: Path) -> None:
    """Write the records of some kinds as they come, one table each; a single one is ``target`` itself."""
    if len(kinds) > 1:
        target.mkdir()
    places = {word: target / f"{word}.csv" if len(kinds) > 1 else target for word in kinds}
    with ExitStack() as files:
        tables = {word: files.enter_context(place.open("w", encoding="utf-8")) for word, place in places.items()}
        for word, kind in kinds.items():
            names = kind.names or [f"c{k + 1}" for k in range(kind.length)]
            tables[word].write(separator.join(names) + "\n")
        for stamp, word, cells in _records((line.rstrip("\n") for line in lines), separator):
            if word in tables and tuple(cells) != kinds[word].names:
                tables[word].write(stamp + separator.join(cells) + "\n")
