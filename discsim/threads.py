"""One thread for linear algebra while our own code runs, and as many as there are cores for pieces of our own work."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from functools import wraps
from typing import ParamSpec, TypeVar

__all__ = ["cores", "limited", "one_thread", "side_by_side"]

P = ParamSpec("P")
S = TypeVar("S")
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


def cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def side_by_side(function: Callable[[S], T], pieces: Sequence[S]) -> list[T]:
    """Return ``function`` of each piece, in their order, worked on by as many threads as there are cores.

    What it computes must let other threads run meanwhile (`discsim.compiled.compiled_nogil`, numpy on large arrays).
    Each piece sees the context of the caller, as numpy's error state is part of it.
    """
    count = min(cores(), len(pieces))
    if count < 2:
        return [function(piece) for piece in pieces]
    with ThreadPoolExecutor(count) as pool:
        waiting = [pool.submit(copy_context().run, function, piece) for piece in pieces]
        try:
            return [one.result() for one in waiting]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
