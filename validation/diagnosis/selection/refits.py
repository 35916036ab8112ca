"""Which refit a search is at: the effect's name and how many are left, for whoever shows how far a diagnosis is.

Takes a listener for a block; gives it a line for each refit within. Nobody listens outside of such a block.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

__all__ = ["refitting", "told_to"]

#: called with what is being done, how much of it is done, and how much there is at most
Listener = Callable[[str, int, int], None]

_LISTENER: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def told_to(listener: Listener) -> Iterator[None]:
    """Tell ``listener`` of each refit within the block."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)


def refitting(what: str, name: str, done: int, total: int) -> None:
    """Say that a refit begins: of which kind, with which effect, how many of the kind are done, of how many at most."""
    listener = _LISTENER.get()
    if listener is not None:
        listener(f"{what}: {name}", done, total)
