"""Conceal: simulate a case in MuJoCo, write plain recordings, and seal the answer away from them.

``discsim study conceal`` does so for cases by their seeds.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from discsim.disc import Release
from discsim.effects.catalogue import Effect
from discsim.engine import follow
from discsim.files import digest, write_text
from discsim.motion import Motion
from discsim.recording import Plant, Recording, write_recording
from discsim.rig import turn_table
from discsim.sensors import Instruments, record
from discsim.toml_table import read_toml
from discsim.toml_text import toml_lines
from discsim.validation.challenge.cases.case import Case, Coast, Kind, Run, Turning
from discsim.validation.challenge.cases.hidden_physics import HiddenDisc, coast, haunted
from discsim.validation.challenge.cases.like_real import cut_in_flight
from discsim.validation.challenge.cases.setups import equivalents

__all__ = ["Answer", "conceal", "read_answer", "recordings", "run_time", "write_recordings"]


@dataclass(frozen=True)
class Answer:
    """What was concealed.

    ``verdict`` is one of the contract's, ``effects`` the ids; ``recordings`` (folder names) those an event is in, None
    where no event is hidden. ``parameters`` holds the sizes by name, with the id before it (``mag.own_clock.period_s``)
    where two of the effects have a parameter of that name; ``moved`` the true values of stated coefficients that have a
    sigma, ``law`` the physics of no catalogue in words. ``setting`` is that of the fault of a setup, by
    name; ``equivalents`` are the faults (id, axes) that no recording of the case can tell from it.
    """

    seed: int
    plant: Plant
    kind: Kind
    verdict: str
    effects: tuple[str, ...] = ()
    recordings: tuple[str, ...] | None = None
    parameters: dict[str, float] = field(default_factory=dict)
    moved: dict[str, float] = field(default_factory=dict)
    law: str | None = None
    setting: dict[str, str] = field(default_factory=dict)
    equivalents: tuple[tuple[str, str], ...] = ()

    @classmethod
    def of(cls, case: Case) -> Answer:
        """Return the answer of a case."""
        parameters = _sizes_of([item.effect for item in case.concealed])
        if case.secret is not None:
            numbers = {name: value for name, value in vars(case.secret).items() if isinstance(value, float)}
            parameters.update(numbers)
        setting = {name: text for item in case.concealed for name, text in item.effect.setting.items()}
        alike = tuple(one for item in case.concealed for one in equivalents(case, item.effect))
        only = tuple(f"{item.recording + 1:02d}" for item in case.concealed if item.recording is not None)
        return cls(
            case.seed,
            case.plant,
            case.kind,
            case.verdict,
            tuple(item.effect.id for item in case.concealed),
            only or None,
            parameters,
            dict(case.moved),
            case.secret.law if case.secret is not None else None,
            setting,
            alike,
        )

    def size(self, id: str, name: str) -> float | None:
        """Return the size of a concealed effect's parameter; None where it stands at its baseline."""
        return self.parameters.get(f"{id}.{name}", self.parameters.get(name))

    @property
    def text(self) -> str:
        """The answer as TOML."""
        top: dict[str, Any] = {"verdict": self.verdict, "effects": list(self.effects)}
        if self.recordings is not None:
            top["recordings"] = list(self.recordings)
        if self.law is not None:
            top["law"] = self.law
        lines = toml_lines({**top, "plant": self.plant, "kind": self.kind})
        lines.append(f"seed = {self.seed}")
        for name, given in (("parameters", self.parameters), ("moved", self.moved), ("setting", self.setting)):
            if given:
                lines += ["", f"[{name}]", *toml_lines({_key(key): value for key, value in given.items()})]
        for id, axes in self.equivalents:
            lines += ["", "[[equivalents]]", *toml_lines({"id": id, "axes": axes})]
        return "\n".join([*lines, ""])


def _sizes_of(effects: Sequence[Effect]) -> dict[str, float]:
    """Return the sizes that are not at their baseline; a name that two effects share has the id before it."""
    times = Counter(name for item in effects for name in item.sizes)
    return {
        f"{item.id}.{name}" if times[name] > 1 else name: size
        for item in effects
        for name, size in item.sizes.items()
        if size != item.row.sizes[name]
    }


def _key(name: str) -> str:
    """Return a name as a key of TOML, in which a dot would open a table."""
    return f'"{name}"' if "." in name else name


def read_answer(path: Path) -> Answer:
    """Read an answer; raises `InputError` naming file, line and what was expected."""
    table = read_toml(path)
    verdict, plant, kind = (table.text(name) for name in ("verdict", "plant", "kind"))
    seed = table.raw("seed")
    effects, only = table.raw("effects"), table.raw("recordings")
    numbers = {}
    for name in ("parameters", "moved"):
        part = table.table(name)
        numbers[name] = {key: float(part.raw(key)) for key in part} if part is not None else {}
    law = table.text("law", required=False)
    texts = table.table("setting")
    setting = {name: str(texts.raw(name)) for name in texts} if texts is not None else {}
    alike = tuple((str(one.text("id")), str(one.text("axes"))) for one in table.tables("equivalents"))
    table.finish()
    assert verdict is not None
    return Answer(
        int(seed),
        plant,  # type: ignore[arg-type]
        kind,  # type: ignore[arg-type]
        verdict,
        tuple(effects),
        None if only is None else tuple(only),
        numbers["parameters"],
        numbers["moved"],
        law,
        setting,
        alike,
    )


# ---------------------------------------------------------------------------------------------- simulation


def recordings(case: Case) -> list[Recording]:
    """Simulate every run of a case and return what its instruments recorded and what is stated."""
    made = []
    for number, run in enumerate(case.runs):
        effects = [item.effect for item in case.concealed if item.recording in (None, number)]
        motion = _motion(case, run, effects, number)
        stated = replace(case.environment, air_density=case.environment.air_density if case.plant == "flight" else None)
        motion = replace(motion, environment=stated)
        instruments = haunted(_thrown_by(case, number), case.secret).with_effects(effects)
        taken = record(
            motion,
            instruments,
            np.random.default_rng([case.seed, 1, number]),
            plant=case.plant,
            name=f"concealed-{number + 1:02d}",
            disc=_stated_disc(case),
            rig=case.stated_rig,
            command=run.profile if isinstance(run, Turning) else None,
        )
        if case.kind == "like_real":
            taken = cut_in_flight(taken)
        sheets = {name: case.sheets_of.sensors[name].sheet for name in taken.samples}
        release = case.stated_releases[number] if case.stated_releases else None
        made.append(replace(taken, sheets=sheets, release=release))
    return made


def _thrown_by(case: Case, number: int) -> Instruments:
    """Return the instruments of a run, with what a lag of the accelerometer still holds of the hand."""
    return case.instruments.fitted("accelerometer", held=case.hands[number]) if case.hands else case.instruments


def _stated_disc(case: Case) -> Any:
    if case.plant == "free_spin" and case.stated_disc is not None:
        return replace(
            case.stated_disc, aero=None, aero_table=None, yaw_damping_table=None, rolling_table=None, sigma={}
        )
    return case.stated_disc


def run_time(case: Case, number: int) -> float:
    """Return how long a run lasts when nothing is concealed, s."""
    return _motion(case, case.runs[number], [], number).end


def _motion(case: Case, run: Run, effects: Sequence[Effect], number: int) -> Motion:
    if isinstance(run, Turning):
        return turn_table(run.profile, case.environment, effects, yaw=run.yaw)
    if isinstance(run, Coast):
        assert case.rig is not None
        return coast(case.rig, case.environment, run.rate, run.duration, effects, case.secret, yaw=run.yaw)
    return _flight(case, run, effects, number)


def _flight(case: Case, release: Release, effects: Sequence[Effect], number: int) -> Motion:
    """Fly one throw.

    Wind and density do not go through the catalogue's formulas: a steady wind is a flight in still air seen by
    somebody who moves (Galileo), other air is another stated density.
    """
    environment, rest, drift = case.environment, [], np.zeros(3)
    for item in effects:
        if item.id == "air.wind":
            drift = np.array([item.value.w_north_m_s, item.value.w_east_m_s, 0.0])
        elif item.id == "air.density":
            assert environment.air_density is not None
            environment = replace(environment, air_density=environment.air_density * item.value.ratio)
        else:
            rest.append(item)
    assert case.disc is not None
    assert release.velocity is not None
    flying = HiddenDisc(case.disc, environment, rest, case.secret, number)
    motion = follow(flying, replace(release, velocity=release.velocity - drift), duration=case.longest)
    if not np.any(drift):
        return motion
    return replace(
        motion, position=motion.position + np.outer(motion.t - motion.start, drift), velocity=motion.velocity + drift
    )


# ---------------------------------------------------------------------------------------------- writing


def write_recordings(case: Case, folder: Path) -> None:
    """Write a case's recordings into ``folder``, numbered from 01."""
    for number, recording in enumerate(recordings(case), start=1):
        write_recording(recording, folder / f"{number:02d}")


def conceal(case: Case, folder: Path, answer: Path) -> dict[str, str]:
    """Write a case's recordings into ``folder`` and its answer to the file ``answer``; return the digests of both."""
    write_recordings(case, folder)
    write_text(answer, Answer.of(case).text)
    return {"recordings": digest(folder), "answer": digest(answer)}
