"""Where the command ``discsim`` begins: loads the command line and runs it, and is quiet where that is interrupted.

Takes nothing; ends the process with the command's exit status, 130 for an interrupt while Python still loads.
"""

from __future__ import annotations

import sys

__all__ = ["main"]


def main() -> None:
    """Load the command line and run it."""
    try:
        from discsim.validation.cli import main as run
    except KeyboardInterrupt:
        print("discsim: interrupted", file=sys.stderr)
        sys.exit(130)
    run()
