"""Tables of a web page as text: what a logger's own page shows, saved from a browser.

Takes a file of HTML; gives a file of comma-separated text, or a folder with one for each table that holds a log.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.cell_texts import number
from discsim.validation.importing.sniffing.other_forms.written import (
    check_size,
    comma_separated,
    first_bytes,
    holds_log,
    read_and_left,
    write_named,
)

__all__ = ["begins", "write_tables"]

#: First bytes in which a page shows itself, and the most of one that is read.
_HEAD, MAX_BYTES = 4096, 1 << 28


def begins(path: Path) -> bool:
    """Tell a page by its first bytes: a tag, and one of those that a page or a table begins with."""
    head = first_bytes(path, _HEAD).removeprefix(b"\xef\xbb\xbf").lstrip().lower()
    if b"<!doctype html" in head or b"<html" in head:
        return head.startswith(b"<")
    # programs of spreadsheets write XML with tables, too
    return re.match(rb"<(?!\?xml)", head) is not None and re.search(rb"<table[\s>]", head) is not None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the tables with rows of numbers as ``target``, or into a folder of that name, and return what to say.

    Raises `InputError` where the page is too large, or holds no rows of numbers.
    """
    check_size(raw, "a web page", MAX_BYTES)
    page = _Tables()
    page.feed(raw.read_text("utf-8", "replace"))
    page.close()
    texts, left = {}, []
    for k, rows in enumerate(page.tables, 1):
        name = f"table {k}"
        if not holds_log(_numbers(row) for row in rows):
            left.append(name)
            continue
        texts[name] = comma_separated(row for row in rows if any(row))
    if not texts:
        raise InputError.at(
            raw, None, "is a web page without a table of readings; expected rows of two numbers or more"
        )
    write_named(target, texts)
    return [read_and_left(raw, "a web page", ", ".join(texts), left)]


def _numbers(row: Sequence[str]) -> list[float]:
    found = (number(cell, ",") for cell in row)
    return [value for value in found if value is not None and value == value]


class _Tables(HTMLParser):
    """The cells of a page's tables, a table within a cell by itself."""

    def __init__(self) -> None:
        super().__init__()
        #: tables of rows of cells, in the order in which they begin
        self.tables: list[list[list[str]]] = []
        self._open: list[list[list[str]]] = []
        self._within = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Begin a table, a row or a cell; end tags of the last two may be missing."""
        if tag == "table":
            self._open.append([])
            self.tables.append(self._open[-1])
        elif tag in ("script", "style"):
            self._within += 1
        elif not self._open:
            return
        elif tag == "tr":
            self._open[-1].append([])
        elif tag in ("td", "th"):
            if not self._open[-1]:
                self._open[-1].append([])
            self._open[-1][-1].append("")

    def handle_endtag(self, tag: str) -> None:
        """End a table, or what is no text."""
        if tag == "table" and self._open:
            self._open.pop()
        elif tag in ("script", "style"):
            self._within = max(0, self._within - 1)

    def handle_data(self, data: str) -> None:
        """Take text into the cell that is open."""
        if self._open and self._open[-1] and self._open[-1][-1] and not self._within:
            row = self._open[-1][-1]
            row[-1] = " ".join(f"{row[-1]} {data}".split())
