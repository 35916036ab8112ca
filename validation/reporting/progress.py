"""How far long work has come: a bar on a terminal, one line per stage elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

__all__ = ["Left", "Pace", "Progress", "in_words", "nobody_knows", "shown"]

#: called with what is being done, how much of it is done, and how much there is: ("screening", 3, 44)
Progress: TypeAlias = Callable[[str, int, int], None]

#: called as `Progress`, it gives the seconds that are left of all, or None where nobody knows (`TimeLeft`)
Left: TypeAlias = Callable[[str, int, int], float | None]


def nobody_knows(stage: str, done: int, total: int) -> float | None:
    """Return None: of work whose stages nobody has timed."""
    del stage, done, total
    return None


@contextmanager
def shown(whole: Left = nobody_knows) -> Iterator[Progress]:
    """Show on stderr how far work is while the block runs; ``whole`` tells how long all of it still takes."""
    if not sys.stderr.isatty():
        yield _Lines(whole)
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}/{task.total}"))
    with Bars(*columns, TimeElapsedColumn(), console=Console(stderr=True), transient=True) as bars:
        task, pace = bars.add_task("", total=None), Pace()

        def report(stage: str, done: int, total: int) -> None:
            left = ", ".join(filter(None, (pace(stage, done, total), in_words(whole(stage, done, total)))))
            bars.update(task, description=f"{stage}{f' ({left})' if left else ''}", completed=done, total=total)

        yield report


def in_words(seconds: float | None) -> str:
    """Return the time that is left of the whole in words, to one figure or two: empty where nobody knows."""
    if seconds is None or seconds < 1.0:
        return ""
    return f"about {seconds:.0f} s left in all" if seconds < 90.0 else f"about {seconds / 60.0:.0f} min left in all"


class Pace:
    """Tells how long the rest of a round takes: "refitting with: wind" is one of the round "refitting with".

    What is left takes as long as what is done took for each; ``now`` gives seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._round, self._began, self._first = "", 0.0, 0

    def __call__(self, stage: str, done: int, total: int) -> str:
        """Return the time left in words; empty for what is no round, and before one of it is done."""
        round_, colon, _ = stage.partition(": ")
        if not colon:
            self._round = ""
            return ""
        if round_ != self._round or done < self._first:
            self._round, self._began, self._first = round_, self._now(), done
            return ""
        if done == self._first:
            return ""
        left = (self._now() - self._began) / (done - self._first) * (total - done)
        return f"about {left:.0f} s left of these" if left >= 1 else ""


class _Lines:
    """Writes a line when a stage begins: what is done, which step of how many it is, and the time so far."""

    def __init__(self, whole: Left) -> None:
        self._stage = ""
        self._whole = whole
        self._started = time.monotonic()
        self._pace = Pace()

    def __call__(self, stage: str, done: int, total: int) -> None:
        if stage != self._stage:
            self._stage = stage
            kind = "" if ": " in stage else "step "
            step = f" ({kind}{min(done + 1, total)} of {total})" if total > 1 else ""
            spent = time.monotonic() - self._started
            so_far = f", {spent:.0f} s so far" if spent >= 1 else ""
            left = "".join(
                f", {words}"
                for words in (self._pace(stage, done, total), in_words(self._whole(stage, done, total)))
                if words
            )
            print(f"{stage}{step}{so_far}{left}", file=sys.stderr, flush=True)
