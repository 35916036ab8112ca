"""Run a diagnosis blind: answers are sealed first, and another process gets a folder of recordings and nothing else."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

if sys.platform == "linux":
    import resource

from discsim.errors import InputError
from discsim.files import digest, write_text
from discsim.recording import Plant
from discsim.validation.challenge.cases.case import Kind, Mask
from discsim.validation.challenge.cases.conceal import Answer, read_answer, write_recordings
from discsim.validation.challenge.cases.draw import draw_case

__all__ = ["DIAGNOSE", "Request", "diagnose_blind", "open_answers", "seal_answers"]

#: the command that is put to the test; the folder of recordings and ``--out DIR`` are appended
DIAGNOSE = (sys.executable, "-m", "discsim.validation.cli", "diagnose")
#: what a diagnosis gets of the environment: where programs and compiled code are, how many threads it may use
_PASSED_ON = ("PATH", "HOME", "LANG", "TMPDIR", "NUMBA_CACHE_DIR", "OMP_NUM_THREADS", "VIRTUAL_ENV")
#: a diagnosis that takes longer has failed, s of the processors: other work may take these from it for hours ...
PATIENCE_S = 1800.0
#: ... but by the clock no longer than this many times as much
BUSY = 10.0


class Request(NamedTuple):
    """What a case is drawn from; see `discsim.validation.challenge.cases.draw.draw_case`."""

    seed: int
    plant: Plant | None = None
    effects: tuple[str, ...] = ()
    kind: Kind | None = None
    mask: Mask | None = None

    @property
    def name(self) -> str:
        """The case's name in files."""
        return f"case-{self.seed:05d}"

    @property
    def command(self) -> str:
        """The command line that does this case alone."""
        words = ["discsim challenge", f"--seed {self.seed} --cases 1"]
        words += [f"--plant {self.plant}"] if self.plant else []
        words += [f"--effect {id}" for id in self.effects]
        words += [f"--kind {self.kind}"] if self.kind else []
        words += [f"--mask {self.mask}"] if self.mask else []
        return " ".join(words)

    def draw(self) -> Any:
        """Return the case."""
        return draw_case(self.seed, self.plant, self.effects, self.kind, self.mask)


def seal_answers(requests: Sequence[Request], out: Path) -> dict[str, str]:
    """Write each answer to ``out/answers`` and the digests of all to ``out/sealed.json``; return the digests.

    This comes before any diagnosis. Where it was done before the digests must be the same; more cases may join them.
    """
    texts = {request.name: Answer.of(request.draw()).text for request in requests}
    digests = {name: hashlib.sha256(text.encode()).hexdigest() for name, text in texts.items()}
    file = out / "sealed.json"
    known = json.loads(file.read_text("utf-8")) if file.exists() else {}
    if changed := [name for name, sealed in known.items() if digests.get(name, sealed) != sealed]:
        raise InputError(
            f"{file}: the answers are sealed, and {', '.join(changed[:3])} would differ; "
            "expected the same command, or another --out"
        )
    for name, text in texts.items():
        write_text(out / "answers" / f"{name}.toml", text)
    write_text(file, json.dumps({**known, **digests}, indent=2) + "\n")
    return digests


def open_answers(requests: Sequence[Request], out: Path) -> list[Answer]:
    """Return the sealed answers in order; raises `InputError` where one is not what was sealed."""
    digests = json.loads((out / "sealed.json").read_text("utf-8"))
    answers = []
    for request in requests:
        file = out / "answers" / f"{request.name}.toml"
        if digest(file) != digests[request.name]:
            raise InputError(f"{file}: is not the answer that was sealed; expected digest {digests[request.name]}")
        answers.append(read_answer(file))
    return answers


def _run(command: Sequence[str], desk: Path) -> str | None:
    """Run a command in a folder and a bare environment; return what went wrong, None where nothing did."""
    with subprocess.Popen(
        command,
        cwd=desk,
        env={name: os.environ[name] for name in _PASSED_ON if name in os.environ},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        longest = PATIENCE_S
        if sys.platform == "linux":
            with contextlib.suppress(ProcessLookupError):
                resource.prlimit(process.pid, resource.RLIMIT_CPU, (int(PATIENCE_S), int(PATIENCE_S) + 5))
            longest = BUSY * PATIENCE_S
        try:
            _, said = process.communicate(timeout=longest)
        except BaseException as stopped:
            process.kill()
            if isinstance(stopped, subprocess.TimeoutExpired):
                return f"no answer within {longest:g} s"
            raise
    if sys.platform == "linux" and process.returncode == -signal.SIGXCPU:
        return f"no answer within {PATIENCE_S:g} s of the processors"
    return None if process.returncode == 0 else f"exit status {process.returncode}: {said.strip()[-600:]}"


def diagnose_blind(request: tuple[Any, ...], command: Sequence[str] | None) -> dict[str, Any]:
    """Conceal a case in a folder of its own, let another process diagnose it, and return what that wrote.

    The process gets the folder's name (which tells nothing), an empty folder to write to, and a bare environment; its
    working folder is empty too. No file with an answer is in reach by these. Returns ``diagnosis`` (None where there
    is none), ``error``, ``seconds`` by the clock and of the processors, and the digest of the recordings.
    """
    case = Request(*request).draw()
    with tempfile.TemporaryDirectory(prefix="recordings-") as place:
        dataset, out, desk = (Path(place) / name for name in ("concealed", "out", "desk"))
        desk.mkdir()
        write_recordings(case, dataset)
        fingerprint = digest(dataset)
        started, before = time.monotonic(), os.times()
        error = _run([*(command or DIAGNOSE), str(dataset), "--out", str(out)], desk)
        seconds, after = round(time.monotonic() - started, 2), os.times()
        cpu = after.children_user + after.children_system - before.children_user - before.children_system
        diagnosis = None
        if error is None:
            try:
                diagnosis = json.loads((out / "diagnosis.json").read_text("utf-8"))
            except (OSError, ValueError) as fault:
                error = f"no diagnosis.json that can be read ({fault})"
    return {
        "diagnosis": diagnosis,
        "error": error,
        "seconds": seconds,
        "cpu_seconds": round(cpu, 2),
        "recordings_sha256": fingerprint,
    }
