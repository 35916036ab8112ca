"""What the forms share: a file's first bytes, which tables hold a log, tables as files, and what to say of them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

__all__ = ["FEWEST", "comma_separated", "first_bytes", "holds_log", "read_and_left", "write_named"]

#: Rows of two numbers or more without which a table holds no log: a description of the phone has fewer.
FEWEST = 10


def first_bytes(path: Path, most: int) -> bytes:
    """Return the first bytes of a file, none where it cannot be read: the reader of text says why."""
    try:
        with path.open("rb") as stream:
            return stream.read(most)
    except OSError:
        return b""


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
