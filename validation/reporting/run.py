"""One run of a command: its output folder, its seed, progress, and the ``run.json`` it leaves."""

from __future__ import annotations

import hashlib
import json
import sys
import time
from collections.abc import Container, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from discsim.errors import InputError
from discsim.files import digest, write_text
from discsim.validation.reporting.written import Written, alone_in, watching
from discsim.version import commit, version

__all__ = ["Run", "current_run", "package_version", "source_digest", "start_run"]

T = TypeVar("T")


def package_version() -> str:
    """Return the installed version of discsim ("unknown" when run from a bare source tree)."""
    return version()


def source_digest(*places: Path, without: Container[Path] = ()) -> str:
    """Return the SHA-256 of Python files and of those in folders, with their names; some may be left out."""
    total = hashlib.sha256()
    for place in places:
        files = sorted(place.rglob("*.py")) if place.is_dir() else [place]
        for file in files:
            if file not in without:
                total.update(str(file.relative_to(place.parent)).encode() + b"\0" + file.read_bytes() + b"\0")
    return total.hexdigest()


def json_text(content: Any) -> str:
    """Return JSON with no NaN or Infinity in it: such numbers become null."""

    def clean(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {str(k): clean(v) for k, v in value.items()}
        if isinstance(value, list | tuple):
            return [clean(v) for v in value]
        if isinstance(value, np.ndarray):
            return clean(value.tolist())
        if isinstance(value, np.generic):
            return clean(value.item())
        if isinstance(value, float) and not np.isfinite(value):
            return None
        return str(value) if isinstance(value, Path) else value

    return json.dumps(clean(content), indent=2, allow_nan=False) + "\n"


@dataclass
class Run:
    """A run in progress: where it writes, what it was given, its random generator."""

    out: Path
    command: list[str]
    seed: int | None
    inputs: list[Path] = field(default_factory=list)
    written: Written | None = None

    @cached_property
    def rng(self) -> np.random.Generator:
        """The run's generator, from its seed."""
        return np.random.default_rng(self.seed)

    def write_json(self, name: str, content: Any) -> None:
        """Write ``out/name`` whole or not at all."""
        write_text(self.out / name, json_text(content))

    def replace_recordings(self) -> None:
        """Take away recordings that an earlier run left in the folder and this one did not write anew, aloud."""
        if self.written is not None:
            for folder in self.written.without_earlier("recording.toml"):
                self.step(f"taken away: the recording that an earlier run had written into {folder}")

    def step(self, text: str) -> None:
        """Say what happens now: one line on stderr."""
        print(text, file=sys.stderr, flush=True)

    def progress(self, items: Iterable[T], total: int, what: str) -> Iterator[T]:
        """Yield ``items`` with a bar on a terminal and one line per item elsewhere, both with the time left."""
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import track

            yield from track(items, description=what, total=total, console=Console(stderr=True), transient=True)
            return
        started = time.monotonic()
        for number, item in enumerate(items, start=1):
            left = (time.monotonic() - started) / number * (total - number)
            self.step(f"{what} {number}/{total}" + (f", {left:.0f} s left" if number > 1 and left >= 1 else ""))
            yield item


#: of the thread that opened the run: a page that another thread makes was not made by this run
_CURRENT: ContextVar[Run | None] = ContextVar("run", default=None)


def current_run() -> Run | None:
    """Return the run that is in progress; None where a page is made from Python."""
    return _CURRENT.get()


@contextmanager
def start_run(out: Path, seed: int | None = None, inputs: Iterable[Path] = ()) -> Iterator[Run]:
    """Open a run that writes into ``out``; ``run.json`` is written when the block ends without an error.

    What is there and was not written by discsim stays as it is: an `InputError` names it, unless --force was given.
    So does an input: ``out`` may not lie within one. Of two runs at once into one folder the second is refused.
    """
    if out.exists() and not out.is_dir():
        raise InputError(f"--out {out}: is a file; expected a folder (it is created where absent)")
    paths = list(inputs)
    for path in paths:
        if path.resolve() == out.resolve():
            raise InputError(f"--out {out}: is the input; expected another folder, to leave that as it is")
        if path.is_dir() and out.resolve().is_relative_to(path.resolve()):
            raise InputError(
                f"--out {out}: lies in the input {path}; expected a folder outside, to leave that as it is"
            )
    out.mkdir(parents=True, exist_ok=True)
    run = Run(out, sys.argv[1:], seed, paths)
    started = time.monotonic()
    digests = {str(path): digest(path) for path in run.inputs}
    _say_compiling(run)
    with alone_in(out):
        token = _CURRENT.set(run)
        try:
            with watching(out) as written:
                run.written = written
                yield run
        finally:
            _CURRENT.reset(token)
        run.write_json(
            "run.json",
            {
                "command": ["discsim", *run.command],
                "version": package_version(),
                "commit": commit(),
                "seed": seed,
                "inputs": digests,
                "duration_s": round(time.monotonic() - started, 3),
                "files": written.digests(),
            },
        )
        written.listed()


def _say_compiling(run: Run) -> None:
    """Say that the first call on an installation takes longer, where what is about to run is compiled."""
    if "numba" in sys.modules:
        from discsim.compiled import compiled_before

        if not compiled_before():
            run.step("compiling, once per installation: about a minute of one core")
