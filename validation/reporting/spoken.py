"""Standard output and error for as long as a command runs. Takes nothing; gives streams that do not end a run.

A run goes on and leaves its files whole whoever listens: a reader that leaves, as ``head`` does, a terminal that knows
no Greek, a program that was started without the two streams.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO, cast

__all__ = ["speaking"]


class _Unheard:
    """A stream whose reader may leave: from then on what is written goes nowhere."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        #: raised by the next flush: who only tried whether a stream takes text passes over what `write` raises
        self._failed: OSError | None = None

    def write(self, text: str) -> int:
        with self._turned_away():
            self._stream.write(text)
        return len(text)

    def flush(self) -> None:
        with self._turned_away():
            self._stream.flush()
        if self._failed is not None:
            failed, self._failed = self._failed, None
            raise failed

    @contextmanager
    def _turned_away(self) -> Iterator[None]:
        """Let a stream that failed write to nowhere, what it holds already, too: the interpreter flushes it at its end.

        What is no reader's leaving, as of a full disk, is raised by `flush`.
        """
        try:
            yield
        except OSError as error:
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, self._stream.fileno())
            os.close(nowhere)
            if not isinstance(error, BrokenPipeError):
                self._failed = error

    def __getattr__(self, name: str) -> Any:
        if name == "buffer":  # who finds it writes there, past all this
            raise AttributeError(name)
        return getattr(self._stream, name)


@contextmanager
def speaking() -> Iterator[None]:
    """Give the process streams that take every text and outlive their reader, until the block ends."""
    before = sys.stdout, sys.stderr
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        for name, stream in zip(("stdout", "stderr"), before, strict=True):
            if stream is None:  # closed by whoever started the program
                setattr(sys, name, nowhere)
                continue
            with suppress(AttributeError):  # a stream of a test's
                cast(Any, stream).reconfigure(errors="backslashreplace")
            setattr(sys, name, _Unheard(stream))
        try:
            yield
        finally:
            for stream in (sys.stdout, sys.stderr):
                stream.flush()
            sys.stdout, sys.stderr = before
