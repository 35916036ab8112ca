"""The experiment behind the paper's Figs. 11 and 13 on our truth: eight throws give C_Nr, three are predicted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from discsim.disc import Disc, Release
from discsim.engine import fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.motion import Motion
from discsim.recording import Recording
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.validation.experiments.feedback.scoring import Predicted, dampings, feed_back
from discsim.validation.reporting.run import Run
from discsim.validation.scenarios.throws import FULL_SET
from discsim.validation.yaw_damping import (
    SOURCES,
    Compared,
    Fit,
    compare_sources,
    fit_yaw_damping,
    observe,
    paper_table,
)
from discsim.validation.yaw_damping.compared import as_mounted
from discsim.validation.yaw_damping.observations import Throw
from discsim.validation.yaw_damping.paper_table import PaperTable

__all__ = ["Experiment", "Flown", "run_experiment"]

#: the third prediction stays inside the paper's table, which neither the paper's release nor the driver's does
INSIDE = FULL_SET[-1]


@dataclass(frozen=True)
class Flown:
    """One throw that is predicted: its truth, and the predictions."""

    name: str
    motion: Motion
    predicted: tuple[Predicted, ...]


@dataclass(frozen=True)
class Experiment:
    """The throws that C_Nr is from, with fit and table by the best spin; C_Nr by every source; the predictions."""

    disc: Disc
    environment: Environment
    throws: tuple[Throw, ...]
    fit: Fit
    paper: PaperTable
    found: tuple[Compared, ...]
    flown: tuple[Flown, ...]


def run_experiment(run: Run) -> Experiment:
    """Fly, record, estimate, fit and predict; about a minute on one free core."""
    disc, environment = load_disc("driver")
    module_stream, *streams = run.rng.spawn(12)
    module = Instruments.from_parts("mpu9250", "neo_m8n").drawn(module_stream)

    def one(name: str, release: Release, stream: np.random.Generator) -> tuple[Motion, Recording]:
        motion = fly(disc, environment, release)
        return motion, record(motion, module, stream, plant="flight", name=name, disc=disc)

    run.step("flying the throws that C_Nr is from")
    recordings = [one(throw.name, throw.release, stream)[1] for throw, stream in zip(FULL_SET, streams, strict=False)]
    spins = (observe(recording) for recording in recordings)
    throws = list(run.progress(spins, len(recordings), "spin rate of throw"))
    fit, paper = fit_yaw_damping(throws), paper_table(throws)
    sources = SOURCES[1:]
    found = [Compared(SOURCES[0], fit, paper)]
    found += run.progress(compare_sources(recordings, fit, sources), len(sources), "C_Nr by other source")

    flown = []
    for name, release, stream in (
        ("paper's release", load_throw("paper"), streams[8]),
        ("driver's release", load_throw("driver"), streams[9]),
        ("inside the table", INSIDE.release, streams[10]),
    ):
        run.step(f"predicting: {name}")
        motion, recording = one(name, release, stream)
        observed = {}
        for item in found:
            seen = as_mounted(recording, item.source)
            try:
                observed[item.source.label] = observe(seen, item.source.method)
            except InputError:
                continue
        given = [damping for damping in dampings(found) if damping.source in observed]
        predicted = feed_back(motion, release, disc, environment, given, observed)
        flown.append(Flown(name, motion, tuple(predicted)))
    return Experiment(disc, environment, tuple(throws), fit, paper, tuple(found), tuple(flown))
