"""Progress of long work, as whoever calls it wants to see it: an iterator passed through."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Protocol, TypeVar

__all__ = ["Progress", "silent"]

T = TypeVar("T")


class Progress(Protocol):
    """Yields the items handed in and shows how far it is."""

    def __call__(self, items: Iterable[T], total: int, what: str) -> Iterator[T]:
        """Yield ``items``, of which there are ``total``, each of them ``what``."""
        ...


def silent(items: Iterable[T], total: int, what: str) -> Iterator[T]:
    """Pass items through and show nothing."""
    del total, what
    return iter(items)
