"""A raw file, folder, zip, gzip or log of messages as files of text. Takes a path; gives one that can be read."""

from __future__ import annotations

import gzip
import lzma
import re
import shutil
import stat
import struct
import tarfile
import tempfile
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from typing import IO

from discsim.errors import InputError
from discsim.files import endless
from discsim.validation.importing.logs import kind_of, write_tables
from discsim.validation.importing.sniffing.other_forms import writer_of
from discsim.validation.importing.sniffing.other_forms.written import first_bytes
from discsim.validation.importing.sniffing.receiver_lines import between, parted

__all__ = ["BESIDE", "MAX_BYTES", "MAX_FILES", "opened"]

#: A zip may hold this many files and bytes unpacked: ten hours of nine channels at 1 kHz as text are below 4 GB, and
#: no reader of text could hold more than that; a phone's export has some ten files.
MAX_FILES = 1000
MAX_BYTES = 4 << 30
#: ... and this many bytes for each packed one: numbers shrink by 3 to 20, a constant column by some hundreds.
MAX_RATIO = 1000
_CHUNK = 1 << 20
_GZIP = b"\x1f\x8b"
#: What damage makes of a zip: errors of the system, of zipfile, and of the libraries that unpack it. zipfile takes
#: numbers and texts of the archive for sound and fails on them as any code does.
_DAMAGED = (
    *(OSError, EOFError, NotImplementedError, zipfile.BadZipFile, zlib.error, lzma.LZMAError),
    *(LookupError, UnicodeError, struct.error, OverflowError),
)
#: What lies beside the folder of a log: words to read and pictures.
BESIDE = re.compile(r"^(readme|license|licence|notes?)\b|\.(md|pdf|png|jpe?g|html?)$", re.IGNORECASE)


@contextmanager
def opened(raw: Path, say: Callable[[str], None] = lambda note: None) -> Iterator[Path]:
    """Give ``raw`` itself, or a folder of that name with the files of a zip or a log's tables, gone afterwards.

    What is in gzip stands there without that ending. In a folder a receiver's track (NMEA, GPX) becomes a table under
    its own name beside the other files; so does what is JSON, there and by itself, and sentences that a log has between
    its lines. ``say`` is told what was left out of a log of messages, and of JSON. Raises `InputError` for no such
    file, a damaged zip or gzip, one with a password, one with paths that lead out of it or links, one above the limits,
    a log that cannot be read.
    """
    if not raw.exists():
        raise InputError.at(raw, None, "no such file or folder; expected what a logger wrote")
    if endless(raw):
        raise InputError.at(raw, None, "is a device or a pipe; expected a file or folder that a logger wrote")
    with tempfile.TemporaryDirectory(prefix="discsim-") as place:
        logged = raw
        if raw.is_file() and first_bytes(raw, len(_GZIP)) == _GZIP:
            logged = _gunzip(raw, Path(place))
        elif raw.is_file() and raw.suffix.lower() == ".zip":
            folder = Path(place) / raw.stem
            folder.mkdir()
            _unpack(raw, folder)
            logged = _inner(folder, raw)
        kind = kind_of(logged)
        if kind is not None:
            tables = Path(place) / "tables" / logged.name
            tables.mkdir(parents=True)
            for note in write_tables(logged, kind, tables):
                say(note)
            logged = tables
        elif logged.is_file() and between(logged):
            apart = Path(place) / "apart" / logged.name
            apart.mkdir(parents=True)
            for note in parted(logged, apart):
                say(note)
            logged = _with_tracks(apart, Path(place) / "beside" / logged.name, say)
        elif logged.is_file():
            logged = _as_tables(logged, Path(place), say)
        elif logged.is_dir():
            logged = _with_tracks(logged, Path(place) / "beside" / (logged.resolve().name or "log"), say)
        try:
            yield logged
        except InputError as error:  # speaks of the archive that the user knows, not of where it was unpacked
            raise InputError(str(error).replace(str(logged), str(raw))) from None


def _as_tables(logged: Path, place: Path, say: Callable[[str], None]) -> Path:
    """Return a file that is a table as it is, or what it holds as a table, or a folder of them, in ``place``."""
    for again in (False, True):
        write = writer_of(logged, again=again) if logged.is_file() else None
        if write is None:
            break
        table = place / f"tables-{int(again)}" / logged.name
        table.parent.mkdir()
        for note in write(logged, table):
            say(note)
        logged = table
    return logged


def _with_tracks(logged: Path, folder: Path, say: Callable[[str], None]) -> Path:
    """Return the folder itself, or where receivers' tracks or JSON are in it ``folder``, their tables and all else."""
    children = [child for child in sorted(logged.iterdir())[:MAX_FILES] if child.is_file()]
    tracks = {child: kind for child in children if (kind := kind_of(child)) is not None and kind.fixes}
    others = (child for child in children if child not in tracks)
    rewritten = {child: write for child in others if (write := writer_of(child)) is not None}
    if not rewritten and (not tracks or len(children) == len(tracks)):
        return logged
    folder.mkdir(parents=True)
    for child in logged.iterdir():
        if child not in tracks and child not in rewritten:
            _linked(child, folder / child.name)
    for child, write in rewritten.items():
        try:
            notes = write(child, folder / child.name)
        except InputError:  # a description beside the readings: it is named with what else could not be read
            _linked(child, folder / child.name)
            continue
        _flattened(folder / child.name)
        for note in notes:
            say(note)
    for child, kind in tracks.items():
        tables = folder.parent / f"{child.name}-tables"
        tables.mkdir()
        try:
            for note in write_tables(child, kind, tables):
                say(note)
        except InputError as error:
            say(f"left out: {error}")
            continue
        (tables / "gps.csv").rename(folder / child.name)
    return folder


def _flattened(tables: Path) -> None:
    """Move the files of a folder of tables up, under its name and theirs; a table stays where it is."""
    if tables.is_dir():
        for table in tables.iterdir():
            table.rename(tables.parent / f"{tables.stem}-{table.name}")
        tables.rmdir()


def _linked(source: Path, target: Path) -> None:
    """Put a link to a file or folder, or a copy where the system lets none be made."""
    try:
        target.symlink_to(source.resolve(), target_is_directory=source.is_dir())
    except OSError:
        shutil.copytree(source, target) if source.is_dir() else shutil.copy2(source, target)


def _gunzip(raw: Path, place: Path) -> Path:
    """Unpack a file of gzip, as pandas and loggers write it, under its own name without the ending."""
    target = place / (raw.stem if raw.suffix.lower() in (".gz", ".gzip") else raw.name)
    try:
        with gzip.open(raw) as source:
            _written(raw, source, target, _most(raw))
    except _DAMAGED as error:
        raise _damaged(raw, error, "a whole file of gzip") from None
    if tarfile.is_tarfile(target):
        raise InputError.at(raw, None, "is a tar archive in gzip; unpack it first; expected a file or folder of a log")
    return target


def _most(raw: Path) -> int:
    """Return how many bytes an archive may unpack to."""
    return min(MAX_BYTES, MAX_RATIO * max(raw.stat().st_size, 1 << 10))


def _unpack(raw: Path, folder: Path) -> None:
    try:
        with zipfile.ZipFile(raw) as archive:
            members = [member for member in archive.infolist() if not member.is_dir()]
            if len(members) > MAX_FILES:
                raise InputError.at(raw, None, f"holds {len(members)} files; expected at most {MAX_FILES}")
            left = _most(raw)
            for member in members:
                target = folder / _checked(raw, member)
                target.parent.mkdir(parents=True, exist_ok=True)
                left -= _copy(raw, archive, member, target, left)
    except _DAMAGED as error:
        raise _damaged(raw, error, "a whole zip archive") from None
    except RuntimeError as error:  # zipfile's word for a password
        raise _damaged(raw, error, "a zip without a password") from None


def _damaged(raw: Path, error: Exception, expected: str) -> InputError:
    what = str(error) or type(error).__name__
    return InputError.at(raw, None, f"cannot be unpacked ({what}); expected {expected}")


def _checked(raw: Path, member: zipfile.ZipInfo) -> PurePosixPath:
    name = member.orig_filename.replace("\\", "/").partition("\0")[0]
    path = PurePosixPath(name)
    linked = stat.S_ISLNK(member.external_attr >> 16)
    if linked or path.is_absolute() or ".." in path.parts or ":" in name or not path.parts:
        what = "is a link" if linked else "leads out of it"
        raise InputError.at(raw, None, f"'{name[:80]}' in it {what}; expected plain files within the archive")
    return path


def _copy(raw: Path, archive: zipfile.ZipFile, member: zipfile.ZipInfo, target: Path, left: int) -> int:
    """Unpack one file of a zip."""
    with archive.open(member) as source:
        return _written(raw, source, target, left)


def _written(raw: Path, source: IO[bytes] | gzip.GzipFile, target: Path, left: int) -> int:
    """Write what is unpacked, counting the bytes that come: what the archive says of its size may be wrong."""
    written = 0
    with target.open("wb") as sink:
        while chunk := source.read(_CHUNK):
            written += len(chunk)
            if written > left:
                limit = f"{MAX_BYTES >> 30} GB and {MAX_RATIO} times its size"
                raise InputError.at(raw, None, f"unpacks to more than {limit}; expected a logger's export")
            sink.write(chunk)
    return written


def _inner(folder: Path, raw: Path) -> Path:
    """Return the folder that holds the files: the only one inside, moved up under the archive's own name."""
    shutil.rmtree(folder / "__MACOSX", ignore_errors=True)
    children = [child for child in folder.iterdir() if not child.name.startswith(".")]
    logged = [child for child in children if child.is_dir() or not BESIDE.search(child.name)]
    children = logged or children
    if len(children) == 1 and children[0].is_dir():
        inner = folder.parent / "inner" / folder.name
        inner.parent.mkdir()
        children[0].rename(inner)
        return inner
    if len(children) == 1:
        return children[0]
    if not children:
        raise InputError.at(raw, None, "holds no file; expected a logger's export")
    return folder
