"""What ``discsim import``, ``check``, ``estimate`` and ``diagnose`` make of measured logs, typed as a stranger would.

Each command runs in a process of its own, so that its processor time is that of a user. What it printed and wrote is
kept in a folder; a run that is broken off goes on from there.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from discsim.files import write_text
from discsim.validation.reporting.markdown import table

__all__ = ["LOGS", "Answers", "Log", "Said", "answers", "road_section", "walk"]

#: longest that a command may take, s by the wall; ten times what any should on an idle machine
PATIENCE = 600.0

Step = Literal["import", "check", "estimate", "diagnose"]


@dataclass(frozen=True)
class Log:
    """A log as a stranger has it.

    Attributes
    ----------
    key, label : str
        Name of its folder, and what the page calls it.
    raw : str
        File or folder below ``real``.
    options : sequence of str
        What is typed after ``discsim import RAW``.
    rate_deg_s : (float, float) or None
        What the source's README, or a reference sensor, knows of the median rate's size, and within what; None where
        nothing is known, or nothing spins.
    truth : str
        The same in words.
    verdicts : sequence of str
        What `diagnose` may rightly say: verdicts, or "refused".
    """

    key: str
    label: str
    raw: str
    options: Sequence[str]
    rate_deg_s: tuple[float, float] | None
    truth: str
    verdicts: Sequence[str] = ("unexplained", "refused")


_FLATBALL = "flatball-ins-ultimate-disc/2025-08-31-"
_DISC = "gyroscope and accelerometer agree on it within 1 %; rows are not 10 ms apart, so nothing may explain the field"


def _throw(name: str, rate: float) -> tuple[Log, Log]:
    """Return a throw of the Ultimate disc by its shipped map and by none, with its gyroscope's median rate, deg/s."""
    known = (rate, 0.01 * rate)
    mapped = Log(f"flatball-{name}", f"flatball {name}", f"{_FLATBALL}{name}.csv", ("--throw", "1"), known, _DISC)
    bare = ("--map", "sniff", "--throw", "1")
    return mapped, Log(f"flatball-{name}-bare", f"flatball {name}, no map", mapped.raw, bare, known, _DISC)


_BROAD = "broad-mocap-rotation/"
_WANDERS = "no steady spin: the axis wanders; the rate about z reverses several times a second"
_TUMBLES = "spins steadily for 4.6 s of its 22 s; its rate about y is 348 deg/s there"
_EULER, _LYNX, _SRP = "cats-euroc21-aris-euler-rocket", "cats-euroc21-skyward-lynx-rocket", "srp-sa-rocket"
_PONTE_DE_SOR = ("--place", "39.21,-8.06", "--date", "2021-10-14")
_TRACK = "shotshaper-dd2-drone-tracked-throws/"

LOGS = (
    Log("phyphox-acc", "phyphox z_acc", "ubsuny-phyphox-roller/z_acc.csv", (), None, "spun up from 0 to 20 rad/s"),
    Log("phyphox-cir", "phyphox z_cir", "ubsuny-phyphox-roller/z_cir.csv", (), None, "about 4 rad/s, stops at 17 s"),
    Log("euler", "Euler", _EULER, (), None, _TUMBLES),
    Log("euler-bare", "Euler, no map", _EULER, ("--map", "sniff", *_PONTE_DE_SOR), None, _TUMBLES),
    Log("lynx", "Lynx", _LYNX, (), None, "7.1 turns in 21 s of 205 s; then it swings"),
    Log("lynx-bare", "Lynx, no map", _LYNX, ("--map", "sniff", *_PONTE_DE_SOR), None, "7.1 turns in 21 s of 205 s"),
    Log("srp", "SRP", _SRP, (), None, "1.6 turns in 10.5 s of 90 s; then it tumbles"),
    Log("srp-bare", "SRP, no map", _SRP, ("--map", "sniff"), None, "1.6 turns in 10.5 s of 90 s; then it tumbles"),
    Log("broad-07", "BROAD 07", f"{_BROAD}07_undisturbed_fast_rotation_B_30s.csv", (), None, _WANDERS),
    Log("broad-32", "BROAD 32", f"{_BROAD}32_disturbed_attached_magnet_1cm_30s.csv", (), None, _WANDERS),
    *_throw("001-rb", 3228.0),
    *_throw("003-rf", 3552.0),
    *_throw("004-rf", 3744.0),
    *_throw("005-rh", 3169.0),
    *(
        Log(f"track-{n}", f"drone track {n}", f"{_TRACK}throw{n}.tsv", ("--map", "shotshaper"), None, "a path alone")
        for n in (1, 6, 15)
    ),
)


@dataclass(frozen=True)
class Said:
    """A command: its exit status (None: stopped by `PATIENCE`), processor time, s, and what it printed."""

    status: int | None
    cpu: float
    text: str

    @property
    def crashed(self) -> bool:
        """Whether it ended by a fault of the program, or not at all."""
        return self.status is None or self.status not in (0, 1, 2)


@dataclass(frozen=True)
class Answers:
    """What each step said of a log, and the contents of the files that estimate and diagnose wrote."""

    log: Log
    said: Mapping[str, Said]
    estimate: Mapping[str, Any] | None
    diagnosis: Mapping[str, Any] | None


def walk(log: Log, real: Path, folder: Path, say: Callable[[str], None] = lambda _: None) -> Answers:
    """Run the four commands on a log, or read what an earlier run left in ``folder``."""
    home = folder / log.key
    for step in _steps(log, real, home):
        note = home / f"{step[1]}.json"
        if not note.is_file():
            say(f"{log.key}: {step[1]}")
            write_text(note, json.dumps(asdict(run_command(step, home)), indent=1) + "\n")
        if step[1] == "import" and json.loads(note.read_text(encoding="utf-8"))["status"] != 0:
            break
    return answers(log, folder)


def answers(log: Log, folder: Path) -> Answers:
    """Return what a folder holds of a log's commands."""
    home = folder / log.key
    said = {}
    for step in ("import", "check", "estimate", "diagnose"):
        note = home / f"{step}.json"
        if note.is_file():
            said[step] = Said(**json.loads(note.read_text(encoding="utf-8")))
    return Answers(
        log, said, _content(home / "spin" / "estimate.json"), _content(home / "diagnosis" / "diagnosis.json")
    )


def _content(path: Path) -> dict[str, Any] | None:
    return dict(json.loads(path.read_text(encoding="utf-8"))) if path.is_file() else None


def _steps(log: Log, real: Path, home: Path) -> list[list[str]]:
    recording = str(home / "recording")
    return [
        ["discsim", "import", str(real / log.raw), *log.options, "--out", recording],
        ["discsim", "check", recording],
        ["discsim", "estimate", recording, "--method", "all", "--out", str(home / "spin")],
        ["discsim", "diagnose", recording, "--out", str(home / "diagnosis")],
    ]


def run_command(command: Sequence[str], home: Path) -> Said:
    home.mkdir(parents=True, exist_ok=True)
    if "--out" in command:
        shutil.rmtree(command[-1], ignore_errors=True)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    # wide enough that no sentence is broken
    environment = {**os.environ, "COLUMNS": "1000"}
    program = [sys.executable, "-m", "discsim.validation.cli", *command[1:]]
    try:
        done = subprocess.run(program, capture_output=True, text=True, timeout=PATIENCE, env=environment, check=False)
        status, text = done.returncode, done.stdout + done.stderr
    except subprocess.TimeoutExpired:
        status, text = None, ""
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return Said(status, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, text)


# ------------------------------------------------------------------------------------------------------ the table

_HEADER = ("log", "import", "check", "estimate: best of its methods", "diagnose", "CPU, s", "right?")


def road_section(found: Sequence[Answers]) -> list[str]:
    """Return the lines of the table, and a list of what is known of each log."""
    known = [f"- *{one.log.label}*: {one.log.truth}." for one in found]
    return [*table(_HEADER, map(_row, found)).splitlines(), "", "What is known of them:", "", *known]


def _row(one: Answers) -> list[str]:
    cells = [one.log.label, _imported(one), _checked(one), _estimated(one), _diagnosed(one)]
    cpu = " + ".join(f"{said.cpu:.0f}" for said in one.said.values())
    return [*(cell.replace("|", "/") for cell in cells), cpu, _judged(one)]


def _imported(one: Answers) -> str:
    said = one.said.get("import")
    if said is None or said.status != 0:
        return _failed(said)
    typed = "--map" in one.log.options and "sniff" not in one.log.options
    shipped = typed or "taken: the shipped map" in said.text
    guesses = said.text.count("(guess:")
    return "by its shipped map" if shipped else f"by a proposed map, {guesses} of it guessed"


def _checked(one: Answers) -> str:
    said = one.said.get("check")
    if said is None or said.status != 0:
        return _failed(said)
    return next((line.split(" in ")[0] for line in said.text.splitlines() if re.match(r"\d+ errors?, ", line)), "")


def _estimated(one: Answers) -> str:
    if one.estimate is None:
        return _failed(one.said.get("estimate"))
    best = _best(one)
    contradicted = len(one.estimate["disagreements"])
    also = f"; {contradicted} contradictions named" if contradicted else ""
    if best is None:
        return f"no method knows the rate half of the time{also}"
    name, figures = best
    rate, sd = np.degrees([figures["median_rate_rad_s"], figures["median_sd_rad_s"]])
    return f"{name}: {round(rate)} ± {sd:.2g} deg/s{also}"


def _best(one: Answers) -> tuple[str, Mapping[str, Any]] | None:
    """Return the first method, in the order in which `best` prefers them, that knows the rate half of the time."""
    assert one.estimate is not None
    for name, figures in one.estimate["methods"].items():
        if figures["share_unknown"] <= 0.5:
            return name, figures
    return None


def _diagnosed(one: Answers) -> str:
    if one.diagnosis is None:
        return _failed(one.said.get("diagnose"))
    effects = ", ".join(f"`{effect['id']}`" for effect in one.diagnosis["effects"])
    return f"{one.diagnosis['verdict']}{f': {effects}' if effects else ''}"


def _failed(said: Said | None) -> str:
    """Say how a command ended that gave no answer."""
    if said is None:
        return "not run"
    if said.status is None:
        return f"**no answer within {PATIENCE:.0f} s**"
    line = next((line for line in said.text.splitlines() if line.startswith("discsim: ")), "")
    # without the folder of this machine; what is refused may have a slash of its own, as in rad/s
    sentence = re.sub(r"^\S*/(recording: )?", "", line.removeprefix("discsim: "))
    return f"**fault of the program**: {sentence}" if said.crashed else f"refused: {sentence}"


def _judged(one: Answers) -> str:
    """Say whether it is right by what is known: no fault, the known median rate if there is one, a possible verdict."""
    wrong = [step for step, said in one.said.items() if said.crashed]
    if one.log.rate_deg_s is not None and one.estimate is not None:
        best, (rate, within) = _best(one), one.log.rate_deg_s
        if best is not None and abs(abs(np.degrees(best[1]["median_rate_rad_s"])) - rate) > within:
            wrong.append("estimate")
    verdict = "refused" if one.diagnosis is None else str(one.diagnosis["verdict"])
    if "diagnose" in one.said and verdict not in one.log.verdicts:
        wrong.append("diagnose")
    if wrong:
        return f"**no: {', '.join(dict.fromkeys(wrong))}**"
    return "no fault; no rate is known" if one.log.rate_deg_s is None else "yes"
