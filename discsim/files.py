"""Files that appear whole or not at all, and where the shipped model files are."""

from __future__ import annotations

import codecs
import hashlib
import os
import secrets
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Protocol

from discsim.errors import InputError

__all__ = [
    "Guard",
    "beside",
    "digest",
    "endless",
    "guarding",
    "model_file",
    "model_names",
    "named_in_errors",
    "read_pieces",
    "read_text",
    "replacing",
    "write_bytes",
    "write_pieces",
    "write_text",
]


class Guard(Protocol):
    """Is asked before a file is written or taken away; raises `InputError` where it must stay."""

    def __call__(self, path: Path) -> None:
        """Refuse, or take note of a file that is written."""
        ...


#: Of the thread that opened the block, and of threads that are given its context (as those of the identification are):
#: two runs in two threads must not ask each other's guards, and a thread of the caller's own writes outside of both.
_GUARD: ContextVar[Guard | None] = ContextVar("guard", default=None)


@contextmanager
def guarding(guard: Guard) -> Iterator[None]:
    """Ask ``guard`` before each file that is written within the block."""
    token = _GUARD.set(guard)
    try:
        yield
    finally:
        _GUARD.reset(token)


def replacing(path: Path) -> None:
    """Say that a file is about to be written or taken away; raises `InputError` where it must stay."""
    guard = _GUARD.get()
    if guard is not None:
        guard(path)


#: bytes of a file that are read at a time where no more of it is to be held
BLOCK = 1 << 22


def read_text(path: Path) -> str:
    """Return a UTF-8 file's text with LF line ends and no byte order mark; raises `InputError` where it is none."""
    return "".join(read_pieces(path))


def endless(path: Path) -> bool:
    """Tell whether a path leads to a device or a pipe, which may never end, and not to a pipe that the shell opened.

    A folder of a stranger may hold a link to one. Raises OSError where the path leads nowhere.
    """
    mode = path.stat().st_mode
    piped = stat.S_ISFIFO(mode) and not path.is_relative_to("/dev") and not path.is_relative_to("/proc")
    return piped or stat.S_ISCHR(mode) or stat.S_ISBLK(mode) or stat.S_ISSOCK(mode)


def read_pieces(path: Path, size: int = BLOCK) -> Iterator[str]:
    """Yield the text of `read_text` in pieces of whole lines, of about ``size`` bytes each; raises as it does."""
    line = 1
    try:
        if endless(path):
            raise InputError.at(path, None, "is a device or a pipe; expected a readable UTF-8 file")
        with path.open("rb") as stream:
            while content := stream.read(size):
                content += stream.readline() if not content.endswith(b"\n") else b""
                content = content.removeprefix(codecs.BOM_UTF8) if line == 1 else content
                try:
                    yield content.decode("utf-8").replace("\r\n", "\n")
                except UnicodeDecodeError as error:
                    line += content.count(b"\n", 0, error.start)
                    found = f"byte 0x{content[error.start]:02x} is no UTF-8; expected UTF-8 text"
                    raise InputError.at(path, line, found) from None
                line += content.count(b"\n")
    except FileNotFoundError:
        raise InputError.at(path, None, "no such file; expected a readable UTF-8 file") from None
    except OSError as error:
        raise InputError.at(path, None, f"cannot be read ({error.strerror}); expected a readable UTF-8 file") from None


def write_bytes(path: Path, content: bytes) -> None:
    """Write ``path`` through a temporary file beside it and one rename."""
    _write(path, (content,))


def write_pieces(path: Path, pieces: Iterable[str]) -> None:
    """Write UTF-8 text with LF line ends as `write_text` does, a piece at a time: no more of it is held."""
    _write(path, (piece.encode("utf-8") for piece in pieces))


def _write(path: Path, pieces: Iterable[bytes]) -> None:
    replacing(path)
    with named_in_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = beside(path)
        # with the rights of any new file: asking for the process's mask would mean to change it, for all threads
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
        try:
            with os.fdopen(handle, "wb") as stream:
                stream.writelines(pieces)
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise


def beside(path: Path) -> Path:
    """Return a hidden name in the same folder that nothing has, for what becomes ``path`` by one rename."""
    return path.parent / f".{path.name}.{secrets.token_hex(4)}"


@contextmanager
def named_in_errors(path: Path) -> Iterator[None]:
    """Let an OSError of the block name ``path``: a full disk names nothing, a temporary file nothing known."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with LF line ends through `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def digest(path: Path) -> str:
    """Return the SHA-256 of a file, or of a folder's files with their names, as hex."""
    total = hashlib.sha256()
    if path.is_dir():
        for child in sorted(p for p in path.rglob("*") if p.is_file()):
            total.update(str(child.relative_to(path)).encode() + b"\0")
            _digest_file(child, total)
            total.update(b"\0")
    else:
        _digest_file(path, total)
    return total.hexdigest()


def _digest_file(path: Path, total: hashlib._Hash) -> None:
    with path.open("rb") as stream:
        while piece := stream.read(BLOCK):
            total.update(piece)


def _models() -> Traversable:
    installed = files("discsim") / "models"  # in a wheel
    return installed if installed.is_dir() else files("discsim") / ".." / "models"  # in a checkout


def model_names(folder: str) -> list[str]:
    """Return the names (without ending) of the shipped TOML files in ``models/folder``; empty where it is none."""
    place = _models() / folder
    if not place.is_dir():
        return []
    return sorted(entry.name.removesuffix(".toml") for entry in place.iterdir() if entry.name.endswith(".toml"))


def model_file(name: str) -> Path:
    """Return the path of a shipped model file such as ``discs/driver.toml``; raises `InputError` if there is none."""
    path = Path(str(_models() / name))
    if not path.is_file():
        folder = name.rpartition("/")[0]
        # beside the folders lie files of several kinds
        known = (", ".join(model_names(folder)) if folder else "") or "a file of models/"
        raise InputError(f"no shipped file '{name}'; expected one of {known}")
    return path.resolve()
