"""What is attacked: each target has sound files to mutate and a function that runs a program's part on a case."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from discsim.disc import Rig
from discsim.effects.catalogue import CATALOGUE, Effect, effect
from discsim.engine import fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.methods import Options
from discsim.estimators.rate import YawRate
from discsim.estimators.usable import FASTEST
from discsim.model_file import read_model, write_model
from discsim.motion import Motion
from discsim.recording import Recording, read_recording, write_recording
from discsim.rig import read_profile, spin_down
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_site, load_throw
from discsim.trajectory import predict
from discsim.validation.checking import check_recording
from discsim.validation.diagnosis.design.plans import read_plans
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.estimating.method_disagreement import disagreements
from discsim.validation.estimating.spin_estimates import all_notes, estimate_all, estimate_json, rate_csv
from discsim.validation.importing import import_recording, read_map, read_readings
from discsim.validation.importing.sniffing import map_text, opened, sniff, stretches
from discsim.validation.reporting.run import json_text
from discsim.validation.scenarios.rate_table import plateau_table, rate_table_checks, run_rate_table
from discsim.validation.sweeps.plan import read_plan

from . import analyses
from .judge import possible
from .logs import LOGS, mutated_log
from .mutate import ODD_NUMBERS, mutated
from .seeds import FILES, RAW, RECORDINGS, recording_files

__all__ = ["CHEAP", "DEAR", "TARGETS", "Target"]

Files = Mapping[str, str]


class Target(NamedTuple):
    """``seeds`` are sound files to mutate, by a name; ``run`` takes the folder that holds a case's files."""

    seeds: Mapping[str, Callable[[], Files]]
    run: Callable[[Path], None]
    #: share of the mutations of a run of all targets
    weight: float
    #: where the files hold no numbers that mutations of text would reach: what a case consists of
    mutate: Callable[[Files, random.Random], dict[str, str]] = mutated


# --------------------------------------------------------------------------------------------- recordings


def _read(folder: Path) -> Recording:
    """Read a recording; what is read can be written, and is the same again."""
    recording = read_recording(folder)
    for samples in recording.samples.values():
        possible(not np.any(np.isinf(samples.value)) and bool(np.all(np.diff(samples.t) > 0)), "readings or times")
    return recording


def _read_and_write(folder: Path) -> None:
    recording = _read(folder)
    write_recording(recording, folder / "again")
    again = read_recording(folder / "again")
    for sensor, samples in recording.samples.items():
        same = np.array_equal(samples.value, again.samples[sensor].value, equal_nan=True)
        possible(same and np.array_equal(samples.t, again.samples[sensor].t), f"{sensor} differs once written")


def _check(folder: Path) -> None:
    recording = _read(folder)
    text = json_text(check_recording(recording, find_setup_faults([recording]).faults).to_json())
    possible("Infinity" not in text, "a number that JSON does not have")


def _estimate(folder: Path) -> None:
    recording = find_setup_faults([_read(folder)]).recordings[0]
    rates, left_out = estimate_all(recording, "all", Options())
    best, _ = estimate_all(recording, "best", Options())
    for rate in [*rates, *best]:
        _rate_that_can_be(rate, recording)
    "".join(rate_csv(rates))
    json_text(estimate_json(recording, "all", rates, left_out, disagreements(rates), all_notes(recording)))


def _rate_that_can_be(rate: YawRate, recording: Recording) -> None:
    """No infinite number, no rate beyond every sensor's and every machine's, no uncertainty below zero or missing."""
    known = np.isfinite(rate.rate)
    possible(bool(np.all(np.isfinite(rate.t))), f"{rate.method}: a time that is no number")
    possible(not np.any(np.isinf(rate.rate)), f"{rate.method}: an infinite rate")
    possible(bool(np.all(np.abs(rate.rate[known]) <= FASTEST)), f"{rate.method}: a rate beyond {FASTEST:g} rad/s")
    possible(bool(np.all(rate.sd[known] >= 0)), f"{rate.method}: a standard deviation below zero, or none")
    # rates are told of times that were measured, or half a window from them
    first = min(float(samples.t[0]) for samples in recording.samples.values())
    inside = bool(np.all((rate.t >= first - 1.0) & (rate.t <= recording.end + 1.0)))
    possible(inside, f"{rate.method}: a rate of a time that was not measured")


def _import(folder: Path) -> None:
    result = import_recording(folder / "log.csv", read_map(folder / "map.toml"))
    write_recording(result.recording, folder / "imported")
    read_recording(folder / "imported")
    possible(all("\n" not in text for text in (*result.notes, result.summary)), "a note of two lines")


def _import_unknown(folder: Path) -> None:
    with opened(folder / "log.csv") as logged:
        (folder / "proposed.toml").write_text(map_text(sniff(logged, "free_spin")), encoding="utf-8")
        read = read_readings(logged, read_map(folder / "proposed.toml"))
    for throw in stretches(read):
        possible(bool(throw.text.isprintable()), "a throw that cannot be shown")


def _messages(folder: Path) -> None:
    (raw,) = folder.iterdir()
    said: list[str] = []
    with opened(raw, said.append) as logged:
        (folder / "map.toml").write_text(map_text(sniff(logged)), encoding="utf-8")
        result = import_recording(logged, read_map(folder / "map.toml"))
    write_recording(result.recording, folder / "imported")
    read_recording(folder / "imported")
    possible(all(note.isprintable() and len(note) < 2000 for note in said), "a note that cannot be shown")


# ------------------------------------------------------------------------------------- files that people write


def _model(folder: Path) -> None:
    model = read_model(folder / "model.toml")
    write_model(model, folder / "again.toml")
    again = read_model(folder / "again.toml")
    possible([item.effect for item in again.effects] == [item.effect for item in model.effects], "another model")


def _plan(folder: Path) -> None:
    plan = read_plan(folder / "plan.toml")
    possible(bool(plan.cases), "a plan without a case")
    for case in plan.cases[:4]:
        plan.instruments(case)
        plan.environment(case.settings)


def _profile(folder: Path) -> None:
    possible(len(read_profile(folder / "profile.csv")) > 1, "a profile of one knot")


def _candidates(plant: Any) -> Callable[[Path], None]:
    def run(folder: Path) -> None:
        for plan in read_plans(folder / "candidates.toml", plant):
            possible(bool(np.all(np.isfinite(plan.state))) and plan.duration > 0, "a plan of no numbers")

    return run


# ---------------------------------------------------------------------------------------------- simulation


def _odd_effects(files: Files, rng: random.Random) -> dict[str, str]:
    """Put one to three effects of the catalogue, with odd sizes, into the place of a model's own."""
    changed = dict(files) if rng.random() < 0.6 else mutated(files, rng)
    name = "model.toml"
    if name not in changed:
        return changed
    lines = [changed[name].partition("[[effects]]")[0]]
    for row in rng.sample([row for row in CATALOGUE.values() if row.parameters], rng.choice((1, 1, 2, 3))):
        lines += ["[[effects]]", f'id = "{row.id}"', "[effects.parameters]"]
        for parameter, size in row.sizes.items():
            lines.append(f"{parameter} = {_odd_size(size, rng)}")
    changed[name] = "\n".join([*lines, ""])
    return changed


def _odd_size(size: float, rng: random.Random) -> str:
    if rng.random() < 0.3:
        return rng.choice([text for text in ODD_NUMBERS if len(text) < 30])
    if rng.random() < 0.3:
        return repr(size)
    return f"{rng.choice((-1, 1)) * rng.random():.6g}e{rng.choice((rng.randint(-3, 3), rng.randint(-3, 9)))}"


def _motion_that_can_be(motion: Motion) -> None:
    for name in ("t", "position", "velocity", "attitude", "rate"):
        possible(bool(np.all(np.isfinite(getattr(motion, name)))), f"{name} is not finite")


def _recorded(motion: Motion, effects: Sequence[Effect], plant: Any, parts: str) -> None:
    instruments = Instruments.from_parts(*parts.split(",")).with_effects(effects)
    recording = record(motion, instruments, np.random.default_rng(0), plant=plant, name="fuzzed")
    for samples in recording.samples.values():
        possible(not np.any(np.isinf(samples.value)), "a reading is not finite")


def _effects(folder: Path, plant: str) -> tuple[Any, list[Effect]]:
    model = read_model(folder / "model.toml")
    return model, [item.effect for item in model.effects if plant in item.effect.row.plants]


def _fly(folder: Path) -> None:
    model, effects = _effects(folder, "flight")
    release = load_throw(folder / "throw.toml")
    if model.disc is None:
        return
    for motion in (
        predict(model.disc, model.environment, release, effects, duration=5.0).motion(),
        fly(model.disc, model.environment, release, effects, duration=5.0),
    ):
        _motion_that_can_be(motion)
    _recorded(motion, effects, "flight", "mpu9250,neo_m8n")


def _rate_table(folder: Path) -> None:
    model, effects = _effects(folder, "rate_table")
    knots = read_profile(folder / "profile.csv")
    result = run_rate_table(knots, model.environment, np.random.default_rng(0), effects=tuple(effects))
    _motion_that_can_be(result.motion)
    rate_table_checks(result, plateau_table(result))


def _spin_down(folder: Path) -> None:
    model, effects = _effects(folder, "spin_down")
    motion = spin_down(model.rig or Rig(1.1e-3, 6e-5), model.environment, 70.0, 5.0, effects)
    _motion_that_can_be(motion)
    _recorded(motion, effects, "spin_down", "mpu9250")


def _call(folder: Path) -> None:
    """Call the simulation as a Python program does, with odd numbers that no file's reader has seen."""
    rng = random.Random((folder / "call.txt").read_text(encoding="utf-8"))

    def odd(value: float) -> float:
        texts = [text for text in ODD_NUMBERS if len(text) < 30 and text[:2] not in ("0x", "1,")]
        return (
            float(rng.choice(texts)) if rng.random() < 0.3 else value * 10.0 ** rng.choice((0, 0, rng.randint(-9, 9)))
        )

    name = rng.choice([row.id for row in CATALOGUE.values() if row.parameters])
    sizes = {key: odd(size) for key, size in CATALOGUE[name].sizes.items()}
    try:
        rig, environment = Rig(odd(1.1e-3), odd(6e-5)), Environment(odd(9.8), air_density=odd(1.2))
        motion = spin_down(rig, environment, odd(70.0), 5.0, [effect(name, **sizes)])
    except ValueError as error:  # what a type says to a programmer
        raise InputError(str(error)) from error
    _motion_that_can_be(motion)


# --------------------------------------------------------------------------------------------- the targets


def _recordings(duration: float = 2.0) -> dict[str, Callable[[], Files]]:
    return {plant: lambda plant=plant: recording_files(plant, duration) for plant in RECORDINGS}  # type: ignore[misc]


def _with(*names: str) -> dict[str, Callable[[], Files]]:
    return {"files": lambda: {key: text for name in names for key, text in FILES[name]().items()}}


def _one(name: str, run: Callable[[Path], Any], weight: float = 1.0) -> Target:
    def run_and_forget(folder: Path) -> None:
        run(folder)

    return Target({name: FILES[name]}, run_and_forget, weight)


TARGETS: Mapping[str, Target] = MappingProxyType(
    {
        "recording": Target(_recordings(), _read_and_write, 6.0),
        "import": Target({"log": RAW}, _import, 4.0),
        "sniff": Target({"log": RAW}, _import_unknown, 1.0),
        "disc": _one("disc", lambda folder: load_disc(folder / "disc.toml")),
        "throw": _one("throw", lambda folder: load_throw(folder / "throw.toml").start()),
        "site": _one("site", lambda folder: load_site(folder / "site.toml")),
        "part": _one("part", lambda folder: Instruments.from_parts(str(folder / "part.toml"))),
        "model": _one("model", _model),
        "plan": _one("plan", _plan),
        "profile": _one("profile", _profile),
        **{f"candidates-{plant}": _one(f"candidates-{plant}", _candidates(plant), 0.5) for plant in RECORDINGS},
        "check": Target(_recordings(), _check, 1.0),
        "estimate": Target(_recordings(), _estimate, 1.0),
        "fly": Target(_with("model", "throw"), _fly, 1.0, _odd_effects),
        "rate-table": Target(_with("model", "profile"), _rate_table, 0.1, _odd_effects),
        "spin-down": Target(_with("model"), _spin_down, 1.0, _odd_effects),
        "logs": Target(LOGS, _messages, 2.0, mutated_log),
        "score": Target(analyses.RATES, analyses.score, 1.0),
        "fit": Target({"flight": analyses.SETS["flight"]}, analyses.fit, 0.3),
        "diagnose": Target(analyses.SETS, analyses.diagnose, 0.3),
        "sweep": Target(analyses.SWEEPS, analyses.swept, 0.3),
        "call": Target({"any": lambda: {"call.txt": ""}}, _call, 0.5, lambda _, rng: {"call.txt": str(rng.random())}),
    }
)
#: targets of milliseconds a case
CHEAP = ("recording", "import", *FILES, "score")
#: targets of seconds a case: a few in each run of the suite, thousands by the command
DEAR = ("fit", "diagnose", "sweep")
