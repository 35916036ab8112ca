"""What the forms share: a file's first bytes, which tables hold a log, tables as files, and what to say of them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from discsim.errors import InputError

__all__ = [
    "FEWEST",
    "FIRST_ROWS",
    "NUMBER",
    "all_rows",
    "check_size",
    "comma_separated",
    "first_bytes",
    "first_lines",
    "first_rows",
    "holds_log",
    "joined_time",
    "read_and_left",
    "rewrite_lines",
    "write_named",
]

#: Rows of two numbers or more without which a table holds no log: a description of the phone has fewer.
FEWEST = 10
#: Rows below a line of names that a form looks at, and how a number is written, whatever its decimal mark.
FIRST_ROWS = 50
NUMBER = r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][-+]?\d+)?"
#: Bytes of a table that is read whole, and of its beginning.
MAX_BYTES, _HEAD = 1 << 29, 1 << 16
_ENDS = re.compile(r"\r\n?|\n")


def first_bytes(path: Path, most: int) -> bytes:
    """Return the first bytes of a file, none where it cannot be read: the reader of text says why."""
    try:
        with path.open("rb") as stream:
            return stream.read(most)
    except OSError:
        return b""


def check_size(raw: Path, what: str, most: int) -> None:
    """Raise `InputError` where a file that is ``what`` has more bytes than are read whole."""
    size = raw.stat().st_size
    if size > most:
        raise InputError.at(raw, None, f"is {what} of {size >> 20} MB; expected at most {most >> 20} MB")


def first_lines(path: Path) -> tuple[str, list[str]]:
    """Return a text's encoding and the whole lines of its beginning; none where it holds zeros, as no text does."""
    head = first_bytes(path, _HEAD)
    encoding = _encoding(head)
    if b"\0" in head:
        return encoding, []
    return encoding, _ENDS.split(head.decode(encoding, "replace"))[:-1]


def first_rows(path: Path, most: int = FIRST_ROWS) -> Iterator[tuple[str, str, list[list[str]]]]:
    """Yield encoding, separator and first rows of cells by each separator that makes rows of one length of a file.

    A line of names is among them, and at most ``most`` others. Nothing where the file holds zeros, as no text does.
    """
    encoding, lines = first_lines(path)
    lines = [line for line in lines if line.strip()][: most + 1]
    for separator in ";\t|,":
        try:
            rows = list(csv.reader(lines, delimiter=separator))
        except csv.Error:  # a cell that is longer than any number
            return
        if rows and len({len(row) for row in rows}) == 1:
            yield encoding, separator, rows


def _encoding(head: bytes) -> str:
    """Return UTF-8 where the whole lines of a beginning are that, else Windows' Latin-1: units have degree signs."""
    try:
        head[: head.rfind(b"\n")].decode("utf-8")
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def all_rows(raw: Path, encoding: str, separator: str) -> list[list[str]]:
    """Return all rows of a table, empty lines left out; raises `InputError` where it is too large or no table."""
    check_size(raw, "a table", MAX_BYTES)
    try:
        with raw.open(encoding=encoding, errors="replace") as stream:
            return list(csv.reader((line for line in stream if line.strip()), delimiter=separator))
    except csv.Error as error:
        raise InputError.at(raw, None, f"cannot be read as a table ({error}); expected cells of numbers") from None


def rewrite_lines(raw: Path, target: Path, change: Callable[[Iterable[str]], Iterable[str]]) -> None:
    """Write the lines of a text as they are after a ``change``, one by one: a long log is never held whole.

    Raises `InputError` where the file cannot be read.
    """
    encoding, _ = first_lines(raw)
    try:
        with raw.open(encoding=encoding, errors="replace") as lines, target.open("w", encoding="utf-8") as written:
            written.writelines(f"{line}\n" for line in change(line.rstrip("\n") for line in lines))
    except OSError as error:
        raise InputError.at(raw, None, f"cannot be read ({error}); expected lines of text") from None


def joined_time(seconds: str, nanos: str) -> str:
    """Return whole seconds and nanoseconds as one time in s, no digit lost; empty where either is no whole number.

    >>> joined_time("1721381710", "3441477"), joined_time("5", "")
    ('1721381710.003441477', '')
    """
    return f"{seconds}.{nanos:0>9}" if seconds.isdecimal() and nanos.isdecimal() else ""


def holds_log(rows: Iterable[Sequence[Any]]) -> bool:
    """Tell whether rows of a log are among some: of two numbers each at least."""
    return sum(sum(isinstance(cell, float | int) for cell in row) >= 2 for row in rows) >= FEWEST


def read_and_left(raw: Path, what: str, read: str, left: Collection[str]) -> str:
    """Return the sentence on what was read of a file that is ``what``, and on the names of what was left out."""
    return f"{raw.name}: {what}; read: {read}" + f"; not read: {', '.join(left)}" * bool(left)


def comma_separated(rows: Iterable[Sequence[str]]) -> str:
    """Return rows of cells as comma-separated text."""
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerows(rows)
    return written.getvalue()


def write_named(target: Path, texts: Mapping[str, str]) -> None:
    """Write a table's text as ``target``, several as files in a folder of that name, by their own names."""
    if len(texts) == 1:
        target.write_text(next(iter(texts.values())), encoding="utf-8")
        return
    target.mkdir()
    for name, text in texts.items():
        plain = re.sub(r"[^\w.-]+", "-", name)
        (target / f"{plain}.csv").write_text(text, encoding="utf-8")
