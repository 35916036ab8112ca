"""The lines of a raw file, read when they are asked for: a long log is never held whole.

Takes a path and an encoding; gives lines as they stand in the file, one after another, in blocks, or by number.
"""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterator
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import TextIO

from discsim.errors import InputError

__all__ = ["TextLines"]

#: signs of a text that are split into lines at once: some MB as lines
PIECE = 1 << 20
#: lines at the beginning that are kept once they are read: where a table begins is asked again and again
_HEAD = 2048


#: what spreadsheets and web pages print -> what it is in a table of numbers: a minus, and a mark between thousands
_TYPESET = str.maketrans({"\N{MINUS SIGN}": "-", "\N{RIGHT SINGLE QUOTATION MARK}": "'"})


def _plain(text: str) -> str:
    return text if text.isascii() else text.translate(_TYPESET)


class TextLines:
    """Lines of a text file; ends of lines may be LF, CR LF or CR.

    A byte that is no text becomes a sign that no number has, so that its cell is found later. ``marked`` tells whether
    the file begins with UTF-8's byte-order mark, which is left out. After a last end of line comes an empty line.
    Raises `InputError` where the file cannot be read.
    """

    def __init__(self, path: Path, encoding: str) -> None:
        self.path, self.encoding = path, encoding
        try:
            with path.open("rb") as stream:
                self.marked = stream.read(3) == codecs.BOM_UTF8
        except OSError as error:
            raise self._unread(error) from None

    def blocks(self) -> Iterator[list[str]]:
        """Yield the lines in blocks."""
        left = ""
        try:
            with self._opened() as stream:
                left = _plain(stream.read(PIECE)).removeprefix("\ufeff")
                *whole, left = left.split("\n")
                yield whole
                while piece := stream.read(PIECE):
                    *whole, left = (left + _plain(piece)).split("\n")
                    if whole:
                        yield whole
        except UnicodeError as error:  # of a whole text, such as one in UTF-16 that does not say in which order
            raise InputError.at(self.path, None, f"{error}; expected text in {self.encoding}, as was said") from None
        except OSError as error:
            raise self._unread(error) from None
        yield [left]

    def __iter__(self) -> Iterator[str]:
        for block in self.blocks():
            yield from block

    def find(self, at: int) -> str | None:
        """Return the line of an index, from 0; None where the file has ended before."""
        return self._head[at] if at < len(self._head) else next(islice(self, at, None), None)

    @cached_property
    def count(self) -> int:
        """How many lines there are."""
        return sum(map(len, self.blocks()))

    def _opened(self) -> TextIO:
        stream = self.path.open("rb")
        stream.seek(3 if self.marked else 0)
        return io.TextIOWrapper(stream, self.encoding, errors="replace", newline=None)

    def _unread(self, error: OSError) -> InputError:
        return InputError.at(self.path, None, f"cannot be read ({error.strerror}); expected what a logger wrote")

    @cached_property
    def _head(self) -> list[str]:
        return list(islice(self, _HEAD))
