"""What a run writes into its folder, so that nothing there is overwritten that discsim did not write."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from glob import escape
from pathlib import Path

from discsim.errors import InputError
from discsim.files import digest, guarding, write_text

__all__ = ["OVERWRITE", "Written", "alone_in", "watching"]

#: whether files may be overwritten whoever wrote them: what --force says
OVERWRITE: ContextVar[bool] = ContextVar("overwrite", default=False)
#: what a run that did not end has written, in place of the run.json that it would have left
_UNFINISHED = ".discsim-unfinished.json"
#: names of what is not yet whole
_BEGUN = re.compile(r"\..+\.[0-9a-f]{8}")
#: kept by their own rules: results of single tasks, which another run refuses or goes on with
_OWN_RULES = ("checkpoints",)


@dataclass
class Written:
    """The files of a folder by their digests: those of an earlier run (None: it kept no list), and of this one."""

    out: Path
    before: dict[str, str | None] | None
    now: set[str] = field(default_factory=set)

    def __call__(self, path: Path) -> None:
        """Take note of a file that is about to be written; raises `InputError` where somebody else wrote it."""
        try:
            name = path.resolve().relative_to(self.out.resolve()).as_posix()
        except ValueError:
            return  # it was asked for by its own name
        if name.split("/")[0] in _OWN_RULES or name in (_UNFINISHED, "run.json"):
            return
        if name not in self.now and path.is_file() and not self._ours(name, path):
            raise InputError(
                f"{path}: is there, and discsim did not write it, or it was changed since; expected another --out, or "
                "--force to overwrite it"
            )
        if name not in self.now:
            self.now.add(name)
            self.note()

    def note(self) -> None:
        """Say in the folder what is being written, for a run that is killed cannot say it later."""
        unknown = [name for name, value in (self.before or {}).items() if value is None]
        marked = json.dumps(dict.fromkeys(sorted({*unknown, *self.now})))
        write_text(self.out / _UNFINISHED, marked + "\n")

    def _ours(self, name: str, path: Path) -> bool:
        if OVERWRITE.get() or self.before is None:
            return True
        # of what a killed run was writing only the name is known
        return name in self.before and self.before[name] in (None, digest(path))

    def listed(self) -> None:
        """Take away what stood in the place of a run.json, which has the list now."""
        (self.out / _UNFINISHED).unlink(missing_ok=True)

    def without_earlier(self, marker: str) -> list[Path]:
        """Take away what an earlier run wrote beside a file called ``marker`` that this one has not written anew.

        Returns the folders. What was changed since, or written by somebody else, stays in its folder: an `InputError`
        names it, unless --force was given.
        """
        earlier = self.before or {}
        folders = {Path(name).parent for name in earlier if Path(name).name == marker and name not in self.now}
        stale = [name for name in earlier if Path(name).parent in folders and name not in self.now]
        there = [(name, self.out / name) for name in stale if (self.out / name).is_file()]
        for name, path in there:
            if not self._ours(name, path):
                raise InputError(
                    f"{path}: is of an earlier run, and was changed since; expected another --out, or --force to take "
                    "it away"
                )
        for _, path in there:
            path.unlink()
        found = sorted({path.parent for _, path in there})
        for folder in found:
            if folder != self.out and not any(folder.iterdir()):
                folder.rmdir()
        return found

    def digests(self) -> dict[str, str]:
        """Return the digests of what this run has written, and of what an earlier one had and is as it was."""
        kept = {
            name: value
            for name, value in (self.before or {}).items()
            if value is not None and name not in self.now and (self.out / name).is_file()
        }
        mine = {name: digest(self.out / name) for name in self.now if (self.out / name).is_file()}
        return dict(sorted({**kept, **mine}.items()))


@contextmanager
def watching(out: Path) -> Iterator[Written]:
    """Take note of what is written into a folder while the block runs, and refuse what must stay as it is.

    What a killed run had begun is taken away first: nobody else writes into the folder (`alone_in`).
    """
    written = Written(out, _before(out))
    if (out / _UNFINISHED).exists():
        _sweep(out)
    written.note()
    try:
        with guarding(written):
            yield written
    except BaseException:
        if written.now:
            write_text(out / _UNFINISHED, json.dumps(written.digests()) + "\n")
        elif not (written.before or {}):
            written.listed()
        raise


def _sweep(out: Path) -> None:
    """Take away files and folders that were to become others by a rename (`discsim.files.beside`)."""
    for left in (*out.rglob(".*"), *out.parent.glob(f"{escape(f'.{out.name}.')}*")):
        if _BEGUN.fullmatch(left.name):
            if left.is_dir():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink(missing_ok=True)


@contextmanager
def alone_in(out: Path) -> Iterator[None]:
    """Keep other runs out of a folder while the block runs; one that is killed keeps nobody out.

    The lock is on the folder itself, so that no file is left of it, and is the process's: it goes with it. Raises
    `InputError` where another run holds it. Without locks (Windows, some network disks) the block runs unguarded.
    """
    try:
        import fcntl
    except ImportError:
        yield
        return
    handle = os.open(out, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"--out {out}: another run is writing into it; expected another folder, or to wait for that run's end"
            ) from None
        except OSError:
            pass
        yield
    finally:
        os.close(handle)


def _before(out: Path) -> dict[str, str | None] | None:
    """Return what earlier runs wrote; None where one did that kept no list."""
    found: dict[str, str | None] = {}
    for name in ("run.json", _UNFINISHED):
        try:
            content = json.loads((out / name).read_bytes())
        except (OSError, ValueError):
            continue
        files = content.get("files") if name == "run.json" and isinstance(content, dict) else content
        if not isinstance(files, dict):
            return None
        found |= files
    return found
