"""Which discsim this is: its version, and the commit of its sources."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError
from importlib.metadata import version as installed
from pathlib import Path

__all__ = ["commit", "version"]

_HERE = Path(__file__).resolve().parent
#: what a build writes into the package, for there is no history beside an installed one
_BUILT = _HERE / "commit.txt"


def version() -> str:
    """Return the installed version ("unknown" when run from a bare source tree)."""
    try:
        return installed("discsim")
    except PackageNotFoundError:
        return "unknown"


@cache
def commit() -> str:
    """Return the commit of these sources, twelve digits, with ``+`` where files were changed since; else "unknown".

    In a checkout git is asked, once in a process; a package that was built from one holds what git said then.
    """
    if _BUILT.is_file():
        return _BUILT.read_text(encoding="utf-8").strip()
    root = _HERE.parent
    if not (root / ".git").exists():  # a repository further up is somebody else's
        return "unknown"
    try:
        git = ["git", "-C", str(root)]
        head = subprocess.run([*git, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True)
        changed = subprocess.run([*git, "diff", "--quiet", "HEAD"], capture_output=True, check=False).returncode
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return head.stdout.strip() + ("+" if changed else "")
