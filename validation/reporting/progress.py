"""How far a diagnosis has come: a bar on a terminal, one line per stage elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

__all__ = ["Progress", "shown"]

#: called with what is being done, how much of it is done, and how much there is: ("screening", 3, 44)
Progress: TypeAlias = Callable[[str, int, int], None]


@contextmanager
def shown() -> Iterator[Progress]:
    """Show progress on stderr while the block runs."""
    if not sys.stderr.isatty():
        yield _Lines()
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}/{task.total}"))
    with Bars(*columns, TimeElapsedColumn(), console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task("", total=None)

        def report(stage: str, done: int, total: int) -> None:
            bars.update(task, description=stage, completed=done, total=total)

        yield report


class _Lines:
    """Writes a line when a stage begins: what is done, which step of how many it is, and the time so far."""

    def __init__(self) -> None:
        self._stage = ""
        self._started = time.monotonic()

    def __call__(self, stage: str, done: int, total: int) -> None:
        if stage != self._stage:
            self._stage = stage
            step = f" (step {min(done + 1, total)} of {total})" if total > 1 else ""
            spent = time.monotonic() - self._started
            so_far = f", {spent:.0f} s so far" if spent >= 1 else ""
            print(f"{stage}{step}{so_far}", file=sys.stderr, flush=True)
