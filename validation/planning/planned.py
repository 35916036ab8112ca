"""`plan` and what it gives: what recordings that are planned could show, before anybody goes out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discsim.disc import Disc, Release, Rig
from discsim.environment import Environment
from discsim.errors import InputError, require_type
from discsim.files import write_text
from discsim.frames import quaternion_from_matrix
from discsim.launch import launch_of, released
from discsim.recording import Plant, Recording
from discsim.result import Result
from discsim.shipped import load_disc, load_throw
from discsim.validation.diagnosis.design.plans import plans_about
from discsim.validation.identification.plants.plan import Plan, towards
from discsim.validation.identification.segments import Trajectory
from discsim.validation.planning.advice import Bought, NextThrow, bought, next_throws
from discsim.validation.planning.information import Information, Questions, information_of, questions_of
from discsim.validation.planning.limits import Coefficient, Limits, coefficients_of, limits_of
from discsim.validation.planning.recordings import Bench, planned_trajectory, plans_like
from discsim.validation.reporting.run import json_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Planned", "plan", "throws_about"]

#: a throw ends on the ground, at the latest after this long, s
_LONGEST_THROW = 15.0


@dataclass(frozen=True, repr=False)
class Planned(Result):
    """What planned recordings could show.

    Attributes
    ----------
    plans : tuple of Plan
        The recordings, and ``times``, how often each is made.
    bench : Bench
        What they are made with.
    information : Information
        What they tell, as normal equations.
    limits : Limits
        The size of each effect that is seen and named, and pairs that are not told apart.
    coefficients : tuple of Coefficient
        The sd of each coefficient.
    next_throws : tuple of NextThrow
        Further recordings, the D-optimal first.
    bought : tuple of Bought
        What other hardware would change.
    """

    plans: tuple[Plan, ...]
    times: int
    bench: Bench
    information: Information
    limits: Limits
    coefficients: tuple[Coefficient, ...]
    next_throws: tuple[NextThrow, ...]
    bought: tuple[Bought, ...]

    def __repr__(self) -> str:
        return f"<Planned: {self.headline}>"

    @property
    def count(self) -> int:
        """Number of recordings."""
        return len(self.plans) * self.times

    @property
    def headline(self) -> str:
        """What matters most, in one line."""
        named = sum(any(np.isfinite(size) for size in one.named) for one in self.limits.effects)
        never = {frozenset((p.id, p.rival)) for p in self.limits.pairs if not np.isfinite(p.apart)}
        told = f"{named} of {len(self.limits.effects)} effects can be named; {len(never)} pairs cannot be told apart"
        recordings = f"{self.count} recording{'s' * (self.count > 1)}"
        CNr = next((one for one in self.coefficients if one.name == "CNr"), None)
        if CNr is None or not np.isfinite(CNr.alone):
            return f"{recordings}: {told}"
        return f"{recordings}: C_Nr to {CNr.alone:.1g} ({CNr.together:.1g} with all coefficients free); {told}"

    def summary(self) -> str:
        """Return the headline, the best next recording and the best change of hardware: a line each."""
        lines = [self.headline]
        if self.next_throws:
            best = self.next_throws[0]
            lines.append(f"best next: {best.text}")
        if self.bought:
            sensible = [one for one in self.bought if np.isfinite(one.effects)]
            if sensible:
                most = max(sensible, key=lambda one: one.effects)
                lines.append(
                    f"best hardware: {most.text}, which divides the sizes that are named by {most.effects:.2f}"
                )
        return "\n".join(lines)

    def table(self) -> dict[str, list[Any]]:
        """Return a row for each parameter of each effect: the sizes that are seen and named, and what is nearest."""
        rows = [
            (one.id, name, seen, named, one.rival, one.taken)
            for one in self.limits.effects
            for name, seen, named in zip(one.parameters, one.seen, one.named, strict=True)
        ]
        names = ("effect", "parameter", "seen", "named", "nearest", "share")
        return {name: [row[k] for row in rows] for k, name in enumerate(names)}

    def plot(self) -> Figure:
        """Return the figure of the sizes that are seen and named."""
        from discsim.validation.planning.figures import limits_figure

        return limits_figure(self.limits)

    def to_json(self) -> dict[str, Any]:
        """Return the content of plan.json."""
        return {
            "format": "discsim-plan/1",
            "plant": self.bench.plant,
            "recordings": [item.text for item in self.plans],
            "times": self.times,
            "sensors": {name: {"noise": sheet.noise_rms, "rate_hz": sheet.rate_hz, "range": sheet.range}
                        for name, sheet in self.bench.sheets.items()},
            "effects": [
                {
                    "id": one.id,
                    "seen": dict(zip(one.parameters, one.seen, strict=True)),
                    "named": dict(zip(one.parameters, one.named, strict=True)),
                    "nearest": {"id": one.rival, "share": one.taken},
                    "shape": one.shape,
                }
                for one in self.limits.effects
            ],
            "not_foretold": list(self.information.questions.silent),
            "pairs": [pair._asdict() for pair in self.limits.pairs],
            "coefficients": [one._asdict() for one in self.coefficients],
            "next": [one._asdict() for one in self.next_throws],
            "hardware": [one._asdict() for one in self.bought],
        }  # fmt: skip

    def report(self, folder: Path | str) -> Path:
        """Write plan.json, plan.png and report.html into ``folder``; return the path of the page."""
        from discsim.validation.planning.page import write_plan_page

        out = Path(folder)
        write_text(out / "plan.json", json_text(self.to_json()))
        return write_plan_page(self, out)


def throws_about(throw: Release, count: int) -> list[Plan]:
    """Return ``count`` throws like one, their headings round the compass."""
    words, plans = launch_of(throw), []
    for number in range(count):
        heading = float(words.heading) + 2 * np.pi * number / count
        release = released(words._replace(heading=heading), throw)
        position, velocity, C_NB, rate = release.start()
        state = np.concatenate([position, velocity, quaternion_from_matrix(C_NB), rate])
        plans.append(Plan(f"the throw {towards(heading)}", state, _LONGEST_THROW))
    return plans


def plan(
    plans: Sequence[Plan] | Sequence[Recording] | int = 6,
    disc: Disc | str = "driver",
    parts: Sequence[str] = ("mpu9250", "neo_m8n"),
    *,
    environment: Environment | None = None,
    throw: Release | None = None,
    plant: Plant = "flight",
    rig: Rig | None = None,
    times: int = 1,
    candidates: Sequence[Plan] | None = None,
    instead: Sequence[Sequence[str]] = (),
    say: Callable[[str], None] = lambda text: None,
) -> Planned:
    """Tell what recordings that are planned could show: effects, pairs of them, coefficients, and what to do better.

    Raises `InputError` where no recording can be made, or parts or plant are unknown.

    Parameters
    ----------
    plans
        The recordings (`discsim.validation.diagnosis.design.plans.read_plans`); or recordings in hand, to be made again
        with their own hardware; or a number of throws like ``throw`` with headings round the compass.
    disc, environment, rig
        The hardware, and where it is; a disc by name brings its place.
    parts
        Sensor parts on board, shipped names or TOML files.
    throw : Release, optional
        What a number of throws are like; by default the shipped driver's.
    times : int
        How often each is made.
    candidates : sequence of Plan, optional
        Recordings that could be added; by default such as are made easily about the first.
    instead : sequence of parts
        Other sets of parts, to be compared with these.
    """
    require_type(plans, (int, Sequence), "plans", "a number of throws, or a list of plans or of recordings")
    in_hand = [] if isinstance(plans, int) else [one for one in plans if isinstance(one, Recording)]
    if in_hand:
        bench, asked = Bench.like(in_hand[0]), plans_like(in_hand)
    else:
        body, place = load_disc(disc) if isinstance(disc, str) else (disc, Environment())
        bench = Bench.of(plant, environment or place, parts, body if rig is None else None, rig)
        like = throw or load_throw("driver")
        asked = throws_about(like, plans) if isinstance(plans, int) else [p for p in plans if isinstance(p, Plan)]
    if not asked:
        raise InputError("no recording is planned; expected at least one")
    say(f"simulating {len(asked)} recording{'s' * (len(asked) > 1)}")
    trajectories = _trajectories(asked, bench)
    questions = _questions(trajectories)
    say(f"asking {len(questions.candidates)} hypotheses of them")
    once = information_of(trajectories, questions)
    information = once.times(times)
    limits = limits_of(information)
    offered = (
        plans_about(trajectories[0], float(max(one.nodes[-1] for one in trajectories)))
        if candidates is None
        else candidates
    )
    say(f"trying {len(offered)} further recordings")
    further = next_throws(information, limits, offered, bench)
    others = []
    for other in instead:
        say(f"trying {'+'.join(other)}")
        swapped = Bench.of(bench.plant, bench.environment, other, bench.disc, bench.rig)
        again = _trajectories(asked, swapped)
        others.append(("+".join(other), information_of(again, _questions(again)).times(times)))
    say("asking what better sensors would buy")
    return Planned(
        tuple(asked),
        times,
        bench,
        information,
        limits,
        tuple(coefficients_of(information)),
        tuple(further),
        tuple(bought(information, limits, others)),
    )


def _trajectories(plans: Sequence[Plan], bench: Bench) -> list[Trajectory]:
    trajectories = []
    for item in plans:
        made = planned_trajectory(item, bench)
        if made is None:
            raise InputError(f"'{item.text}' cannot be recorded; expected a motion that lasts, from above the ground")
        trajectories.append(made)
    return trajectories


def _questions(trajectories: Sequence[Trajectory]) -> Questions:
    return questions_of([one.recording for one in trajectories], float(trajectories[0].nodes[-1]) / 2)
