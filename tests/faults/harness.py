"""One command run to its end, killed, interrupted, or twice at once, in a process that is forked from this one.

Everything is imported and compiled here already, so a child costs no more than its work, and the moment of a signal
falls into that.
"""

from __future__ import annotations

import json
import os
import random
import re
import signal
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

from fuzz.analyses import SETS, SWEEPS
from fuzz.seeds import RAW

from discsim.validation.start import main

__all__ = ["COMMANDS", "content", "disturbed", "doubled", "prepare", "run"]

#: the words of a command, given the folder of `prepare`; --out is appended
COMMANDS: Mapping[str, Callable[[Path], list[str]]] = MappingProxyType(
    {
        "import": lambda at: ["import", f"{at}/raw/log.csv", "--map", f"{at}/raw/map.toml"],
        "diagnose": lambda at: ["diagnose", f"{at}/rate_table"],
        "estimate": lambda at: ["estimate", f"{at}/rate_table", "--method", "all"],
        "fit": lambda at: ["fit", f"{at}/flight", "--no-compare"],
        "fly": lambda at: ["fly", "--seed", "3"],
        "sweep": lambda at: ["sweep", f"{at}/sweep/plan.toml", "--workers", "1"],
        "challenge": lambda at: ["challenge", "--cases", "1", "--plant", "rate_table", "--workers", "1"],
        "validate": lambda at: ["validate", "--quick"],
    }
)
#: what stands apart in run.json: when and where, not what
_APART = ("duration_s", "command")
#: kept by a sweep and a challenge for the next run, and the mark of a run that has not ended
_BETWEEN = ("checkpoints", ".discsim-unfinished.json")


def prepare(folder: Path) -> None:
    """Write the inputs of all commands."""
    places = {"raw": RAW, "sweep": SWEEPS["small"], **{plant: SETS[plant] for plant in ("rate_table", "flight")}}
    for name, files in places.items():
        (folder / name).mkdir(parents=True)
        for file, text in files().items():
            (folder / name / file).write_text(text, encoding="utf-8")


def _child(words: Sequence[str], heard: Path) -> None:
    """Be the command: never returns."""
    status = 99
    try:
        sink = os.open(heard, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        for stream in (1, 2):
            os.dup2(sink, stream)
        sys.stdout, sys.stderr = (os.fdopen(os.dup(stream), "w") for stream in (1, 2))
        signal.signal(signal.SIGINT, signal.default_int_handler)
        sys.argv = ["discsim", *words]
        main()
    except SystemExit as stop:
        status = int(stop.code or 0)
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)


def _start(words: Sequence[str], heard: Path) -> int:
    pid = os.fork()
    if pid == 0:
        _child(words, heard)
    return pid


def run(words: Sequence[str], heard: Path) -> int:
    """Run a command to its end; return its exit status, minus a signal's number; what it says goes to ``heard``."""
    return os.waitstatus_to_exitcode(os.waitpid(_start(words, heard), 0)[1])


def content(out: Path) -> dict[str, bytes]:
    """Return the files of a folder by their names, without what is between runs and what stands apart.

    Pages say by which command they were made: where it wrote to, and how many workers it had, is no result. How long
    its diagnoses took a challenge tells as a result, which no two runs share: challenge.json is compared without, and
    its page, which shows the same numbers, without any.
    """
    found, timed = {}, (out / "challenge.json").exists()
    for file in sorted(out.rglob("*")):
        name = file.relative_to(out).as_posix()
        if not file.is_file() or name.split("/")[0] in _BETWEEN:
            continue
        found[name] = file.read_bytes()
        if file.suffix in (".html", ".json"):
            found[name] = re.sub(rb"--workers \d+", b"--workers N", found[name].replace(str(out).encode(), b"OUT"))
        if timed and file.suffix == ".html":
            found[name] = re.sub(rb"[\d.]+", b"N", found[name])
        if name == "challenge.json":
            found[name] = json.dumps(_without_times(json.loads(found[name]))).encode()
        if name == "run.json":
            told = json.loads(found[name])
            compared = (key for key in told["files"] if not key.endswith(".html") and key != "challenge.json")
            told["files"] = {key: told["files"][key] for key in compared}
            found[name] = json.dumps({key: told[key] for key in told if key not in _APART}).encode()
    return found


def _without_times(told: Any) -> Any:
    if isinstance(told, list):
        return [_without_times(one) for one in told]
    if isinstance(told, dict):
        return {key: _without_times(one) for key, one in told.items() if key not in ("seconds", "cpu_seconds")}
    return told


def disturbed(
    words: Sequence[str], whole: Mapping[str, bytes], seconds: float, place: Path, kill: int, rng: random.Random
) -> Iterator[str]:
    """Send a signal at a random moment of a run of ``seconds``, run anew, and yield what is wrong with what is left."""
    out, heard = place / "out", place / "heard"
    place.mkdir()
    pid = _start([*words, "--out", str(out)], heard)
    after = rng.uniform(0.0, seconds)
    time.sleep(after)
    os.kill(pid, kill)
    status = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    when = f"signal {kill} after {after:.3f} of {seconds:.3f} s"
    if status not in (0, 1, -kill, 130):
        yield f"{when}: exit status {status}: {heard.read_text()[-300:]}"
    if kill == signal.SIGINT and "Traceback" in heard.read_text():
        yield f"{when}: a traceback: {heard.read_text()[-600:]}"
    for name, bytes_ in content(out).items() if out.exists() else ():
        hidden = any(part.startswith(".") for part in Path(name).parts)
        if not hidden and bytes_ != whole.get(name):
            yield f"{when}: {name} is not whole"
    heard.unlink(missing_ok=True)
    yield from _rerun(words, whole, out, heard, when)


def _rerun(words: Sequence[str], whole: Mapping[str, bytes], out: Path, heard: Path, when: str) -> Iterator[str]:
    status = run([*words, "--out", str(out)], heard)
    if status not in (0, 1):
        yield f"{when}: the run after it ends with {status}: {heard.read_text()[-300:]}"
        return
    left = content(out)
    for name in sorted({*whole, *left}):
        if whole.get(name) != left.get(name):
            yield f"{when}: {name} {'is no more' if name not in left else 'differs' if name in whole else 'is left'}"
    for file in out.parent.iterdir():
        if file.name.startswith("."):
            yield f"{when}: {file.name} is left beside the folder"


def doubled(words: Sequence[str], whole: Mapping[str, bytes], place: Path) -> Iterator[str]:
    """Run a command twice at once into one folder: one is refused or both end well, and the result is one run's."""
    place.mkdir()
    out, heard = place / "out", [place / "first", place / "second"]
    pids = [_start([*words, "--out", str(out)], one) for one in heard]
    ends = [os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]) for pid in pids]
    for status, one in zip(ends, heard, strict=True):
        if status not in (0, 1) and "another run is writing into it" not in one.read_text():
            yield f"two at once: exit status {status}: {one.read_text()[-300:]}"
    if not any(status in (0, 1) for status in ends):
        yield f"two at once: both were refused ({ends})"
    yield from _rerun(words, whole, out, place / "third", "two at once")
