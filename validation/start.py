"""Where the command ``discsim`` begins: loads the command line and runs it, and is quiet where that is interrupted.

Takes nothing; ends the process with the command's exit status, 130 for an interrupt while Python still loads.
"""

from __future__ import annotations

import _thread
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["heard_anywhere", "loading", "main"]

_AGAIN_S = 0.01  # after which a swallowed interrupt comes again: by then what swallowed it is over, and nobody waits


def main() -> None:
    """Load the command line and run it."""
    try:
        with loading():
            from discsim.validation.cli import main as run
        with heard_anywhere():
            run()
    except KeyboardInterrupt:
        _end()


@contextmanager
def loading() -> Iterator[None]:
    """Let an interrupt end the process at once: modules that load make other errors of a `KeyboardInterrupt`, or none.

    Nothing is written while they load. An interrupt that somebody else deals with, or nobody, is left to them.
    """
    try:
        heard = signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if heard:
            signal.signal(signal.SIGINT, _end)
    except ValueError:  # not the main thread, which alone hears signals
        heard = False
    try:
        yield
    finally:
        if heard:
            signal.signal(signal.SIGINT, signal.default_int_handler)


@contextmanager
def heard_anywhere() -> Iterator[None]:
    """Raise an interrupt again that fell where Python drops errors, with a traceback and nothing more.

    Such places are what it calls when an object ends. The collection of garbage after large figures is a long one.
    """
    before = sys.unraisablehook

    def told(error: sys.UnraisableHookArgs) -> None:
        if isinstance(error.exc_value, KeyboardInterrupt):
            # raised here it would be dropped as well: not before this has returned, however busy the machine is
            returned = threading.Event()
            threading.Thread(target=_again, args=(returned,), daemon=True).start()
            returned.set()
        else:
            before(error)

    sys.unraisablehook = told
    try:
        yield
    finally:
        sys.unraisablehook = before


def _again(returned: threading.Event) -> None:
    """Interrupt the main thread a moment after it has ``returned`` from where errors are dropped."""
    returned.wait()
    time.sleep(_AGAIN_S)
    _thread.interrupt_main()


def _end(*_: object) -> None:
    sys.stderr.flush()
    os.write(2, b"discsim: interrupted\n")
    os._exit(130)
