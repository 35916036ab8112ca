"""One thread for linear algebra while our own code runs, and the caller's number of threads before and after."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from typing import ParamSpec, TypeVar

__all__ = ["limited", "one_thread"]

P = ParamSpec("P")
T = TypeVar("T")


class _Inside:
    """How many blocks are open in this process, of all threads, and what restores the number of threads after them."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.blocks = 0
        self.restore: Callable[[], None] = lambda: None


_inside = _Inside()


@contextmanager
def limited() -> Iterator[None]:
    """Limit the linear algebra of numpy and scipy to one thread inside the block; blocks may nest and overlap.

    The matrices here are small: on busy cores the threads of a product wait for one another a hundred times as long as
    they work. After the last block the process has as many threads as before.
    """
    with _inside.lock:
        if not _inside.blocks:
            import scipy.linalg  # noqa: F401  # brings a library of its own, which must be there to be limited
            from threadpoolctl import threadpool_limits

            _inside.restore = threadpool_limits(1, user_api="blas").restore_original_limits
        _inside.blocks += 1
    try:
        yield
    finally:
        with _inside.lock:
            _inside.blocks -= 1
            if not _inside.blocks:
                _inside.restore()


def one_thread(function: Callable[P, T]) -> Callable[P, T]:
    """Return ``function`` so that it runs inside `limited`."""

    @wraps(function)
    def inside(*given: P.args, **named: P.kwargs) -> T:
        with limited():
            return function(*given, **named)

    return inside
