"""What became of one case: an answer, a refusal, or a fault; with a limit of time and of memory, in this process."""

from __future__ import annotations

import faulthandler
import resource
import signal
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from discsim.errors import InputError

__all__ = ["LONGEST_S", "MOST_BYTES", "FaultFound", "Outcome", "Unanswered", "judge", "possible"]

#: no answer to a small input within this long is a fault, s of this process's own time, whatever else is running
LONGEST_S = 20.0
#: nor is one that needs more memory than this beyond what the process has
MOST_BYTES = 2 << 30
#: compiled code is not interrupted, and what waits takes no time: the process says where it hangs and ends after
#: this long by the clock, s
_HUNG_S = 30 * LONGEST_S


#: one of these says what to do: what was expected, what there is, or what a map would have to allow
_REMEDIES = ("expected", "needs", "the columns there are", "does not allow the repair")


class Unanswered(BaseException):
    """The time is up; no code under test catches it."""


class FaultFound(AssertionError):
    """An answer that cannot be."""


def possible(condition: bool, what: str) -> None:
    """Raise `FaultFound` for an answer that cannot be."""
    if not condition:
        raise FaultFound(what)


class Outcome(NamedTuple):
    """``kind``: right, refused, or a fault (internal, vague, nonsense, slow, memory); what was said, and where."""

    kind: str
    said: str = ""
    place: str = ""

    @property
    def sound(self) -> bool:
        """Whether this is what a user may be shown."""
        return self.kind in ("right", "refused")


def judge(run: Callable[[Path], None], folder: Path, longest: float = LONGEST_S) -> Outcome:
    """Run a case that lies in ``folder`` and say what became of it.

    ``run`` raises `FaultFound` for an answer that cannot be. A refusal names the folder's file, or what is stated in
    it, in one line, and what was expected.
    """
    try:
        with _limited(longest):
            run(folder)
    except InputError as error:
        return _refusal(str(error).replace(f"{folder}/", ""))
    except FaultFound as error:
        return Outcome("nonsense", str(error), _place(error))
    except Unanswered as error:
        return Outcome("slow", f"no answer in {longest:g} s", _place(error))
    except MemoryError as error:
        return Outcome("memory", str(error)[:200], _place(error))
    except Exception as error:
        return Outcome("internal", f"{type(error).__name__}: {error}"[:300], _place(error))
    return Outcome("right")


def _refusal(message: str) -> Outcome:
    if "\n" in message or not message.isprintable():
        return Outcome("vague", f"not one printable line: {message!r}"[:300])
    if not any(word in message for word in _REMEDIES):
        return Outcome("vague", f"says nothing of what was expected: {message}"[:300])
    if len(message) > 2000:
        return Outcome("vague", f"{len(message)} characters: {message}"[:300])
    return Outcome("refused", message)


def _place(error: BaseException) -> str:
    """Return the innermost frames of the project's own code, the last one first."""
    frames = [
        f"{Path(frame.filename).name}:{frame.lineno} {frame.name}"
        for frame in traceback.extract_tb(error.__traceback__)
        if any(f"/{package}/" in frame.filename for package in ("discsim", "estimators", "validation"))
        and "/site-packages/" not in frame.filename
    ]
    return " < ".join(reversed(frames[-3:]))


@contextmanager
def _limited(longest: float) -> Iterator[None]:
    def stop(signum: int, frame: Any) -> None:
        raise Unanswered

    before = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    handler = signal.signal(signal.SIGPROF, stop)
    resource.setrlimit(resource.RLIMIT_AS, (used + MOST_BYTES, before[1]))
    faulthandler.dump_traceback_later(longest + _HUNG_S, exit=True)
    # again and again: one that comes in a callback of compiled code is swallowed there
    signal.setitimer(signal.ITIMER_PROF, longest, 1.0)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        faulthandler.cancel_dump_traceback_later()
        resource.setrlimit(resource.RLIMIT_AS, before)
        signal.signal(signal.SIGPROF, handler)
