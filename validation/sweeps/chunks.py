"""The work of a sweep in pieces: truth runs first, then chunks of mounts, each a function that a worker can call."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.sensors import PositionOffset
from discsim.engine import fly
from discsim.errors import InputError
from discsim.estimators.accelerometer import accelerometer
from discsim.estimators.fft import FftSettings, fft
from discsim.estimators.methods import Options, estimate
from discsim.estimators.rate import YawRate
from discsim.motion import Motion
from discsim.recording import SENSORS, Recording
from discsim.rig import turn_table
from discsim.sensors import Accelerometer, Instruments, Magnetometer, record
from discsim.shipped import load_disc, load_throw
from discsim.validation.running.tasks import Task
from discsim.validation.scenarios.rate_table import plateaus
from discsim.validation.scenarios.throws import EDGE_S
from discsim.validation.sweeps.mounts import look_with_accelerometer, look_with_magnetometer
from discsim.validation.sweeps.plan import CHUNK, Case, Plan

__all__ = ["SCORES", "Sweep", "chunk_tasks", "fly_truth", "motion_from", "score_chunk", "segments", "truth_tasks"]

#: what is scored of an estimate on a segment, deg/s and a share
SCORES = ("bias_deg_s", "rms_deg_s", "worst_deg_s", "known")

_MOTION = ("t", "position", "velocity", "acceleration", "attitude", "rate", "angular_acceleration")


class Chunk(NamedTuple):
    """Mounts ``first`` to ``last`` (not included) of one case."""

    case: int
    first: int
    last: int


class Sweep(NamedTuple):
    """What every worker has: the plan, its mounts (count, 6), and the truth of each of its truth runs."""

    plan: Plan
    mounts: FloatArray
    motions: tuple[Motion, ...]


def truth_tasks(plan: Plan) -> list[Task]:
    """Return one task per truth run, for `fly_truth`."""
    return [Task(f"truth-{number:04d}", number) for number in range(len(plan.truths))]


def fly_truth(number: int, plan: Plan) -> dict[str, FloatArray]:
    """Return the arrays of a truth run's motion, in MuJoCo: of a rate table or a flight.

    Raises `InputError` where it cannot be, or is too short to be scored, with what the plan calls it.
    """
    try:
        motion = _flown(number, plan)
        segments(plan, motion, plan.truths[number])
    except InputError as error:
        raise InputError(f"{plan.called(number)}: {error}") from None
    arrays = {name: np.asarray(getattr(motion, name)) for name in _MOTION}
    return {**arrays, "centre_of_mass": np.asarray(motion.centre_of_mass)}


def _flown(number: int, plan: Plan) -> Motion:
    settings = plan.truths[number]
    effects = plan.effects(settings, moving=True)
    environment = plan.environment(settings)
    if plan.plant == "rate_table":
        profile = settings.get("profile", plan.profile)
        rng = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(1, number)))
        return turn_table(profile, environment, effects, yaw=float(rng.uniform(0, 2 * np.pi)))
    disc = settings["disc"][0] if "disc" in settings else load_disc("driver")[0]
    release = settings.get("throw") or load_throw("driver")
    return fly(disc, environment, release, effects, duration=plan.duration)


def motion_from(arrays: Mapping[str, FloatArray], plan: Plan, number: int) -> Motion:
    """Return the motion of which `fly_truth` gave the arrays."""
    columns = {name: arrays[name] for name in _MOTION}
    environment = plan.environment(plan.truths[number])
    return Motion(environment=environment, centre_of_mass=arrays["centre_of_mass"], **columns)  # type: ignore[arg-type]


def chunk_tasks(plan: Plan) -> list[Task]:
    """Return the chunks of all cases, for `score_chunk`."""
    tasks = []
    for case in plan.cases:
        for first in range(0, plan.mounts.count, CHUNK):
            chunk = Chunk(case.number, first, min(first + CHUNK, plan.mounts.count))
            tasks.append(Task(f"case-{case.number:05d}-mounts-{first:08d}", chunk))
    return tasks


def segments(plan: Plan, motion: Motion, settings: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Return start and stop (s) of what is scored: a rate table's plateaus, or a flight less its ends."""
    if plan.plant == "rate_table":
        return [(start, stop) for start, stop, _ in plateaus(settings.get("profile", plan.profile))]
    if motion.end - motion.start <= 2 * EDGE_S:
        raise InputError(f"a flight of {motion.end - motion.start:.2f} s; expected more than {2 * EDGE_S} s to score")
    return [(motion.start + EDGE_S, motion.end - EDGE_S)]


def score_chunk(chunk: Chunk, sweep: Sweep) -> dict[str, FloatArray]:
    """Return ``scores`` (estimators, mounts, segments, `SCORES`), NaN where a mount is not scored or nothing known."""
    plan = sweep.plan
    case = plan.cases[chunk.case]
    moved = sweep.motions[case.truth]
    motion = replace(moved, environment=plan.environment(case.settings))
    spans = segments(plan, motion, case.settings)
    bench = _Bench(plan, case, motion)
    truth = _Truth(motion)
    scores = np.full((len(plan.estimators), chunk.last - chunk.first, len(spans), len(SCORES)), np.nan)
    for place, name in enumerate(plan.estimators):
        wanted = plan.scored(name)
        for mount in wanted[(wanted >= chunk.first) & (wanted < chunk.last)].tolist():
            rate = bench.estimate(name, mount, sweep.mounts[mount])
            scores[place, mount - chunk.first] = truth.scores(rate, spans)
    return {"scores": scores}


class _Bench:
    """The module of one case before its truth: gives any mount's estimate by any method.

    Accelerometer and magnetometer are looked with once. A method that needs but one of them gets its samples from
    that view; another gets a whole recording. Where no sample is lost or jitters both have the same samples.
    """

    def __init__(self, plan: Plan, case: Case, motion: Motion) -> None:
        self.plan, self.case, self.motion = plan, case, motion
        self.sheet_module = plan.instruments(case)
        self.effects = plan.effects(case.settings, moving=False)
        module = self.sheet_module.with_effects(self.effects)
        self.options = Options(fft=FftSettings(step=plan.fft_step))
        accelerometer_rng, magnetometer_rng = (self._rng(2, k) for k in (0, 1))
        felt, seen = _timed(module, "accelerometer"), _timed(module, "magnetometer")
        self.yields = "mount_hz" in case.settings
        mount_hz = case.settings.get("mount_hz", np.inf)
        self.felt = look_with_accelerometer(motion, felt, accelerometer_rng, mount_hz) if felt is not None else None
        self.seen = look_with_magnetometer(motion, seen, magnetometer_rng) if seen is not None else None

    def _rng(self, *key: int) -> np.random.Generator:
        """A stream that depends on the plan's seed, the case and ``key`` alone, whoever works on it."""
        return np.random.default_rng(np.random.SeedSequence(self.plan.seed, spawn_key=(2, self.case.number, *key)))

    def module(self, number: int, mount: FloatArray) -> Instruments:
        """Return a mount's module: its specimen, the effects, where and how it sits."""
        own = self._rng(1, self.plan.mounts.module_of(number))
        module = self.sheet_module.drawn(own) if self.plan.drawn else self.sheet_module
        module = module.with_effects(self.effects)
        for name in module.sensors:
            module = module.fitted(name, misalignment=mount[3:])
        if "accelerometer" in module.sensors:
            module = module.fitted("accelerometer", offset=PositionOffset(*mount[:3].tolist()))
        return module

    def estimate(self, name: str, number: int, mount: FloatArray) -> YawRate:
        """Return a mount's rate by the method of that name; all NaN where the method cannot be used."""
        module = self.module(number, mount)
        try:
            return self._estimate(name, number, module)
        except InputError:  # as where a flight is shorter than a window
            none = np.zeros(0)
            return YawRate(name, none, none, none)

    def _estimate(self, name: str, number: int, module: Instruments) -> YawRate:
        streams = self._streams(number)
        if name == "accelerometer":
            felt = module.sensors["accelerometer"]
            assert isinstance(felt, Accelerometer)
            assert self.felt is not None
            samples = self.felt.measure(felt, streams["accelerometer"])
            return accelerometer(samples, felt.sheet, self.options.accelerometer)
        if name == "fft":
            seen = module.sensors["magnetometer"]
            assert isinstance(seen, Magnetometer)
            assert self.seen is not None
            shown = self.seen.measure(seen, streams["magnetometer"])
            return fft(shown, self.options.fft, fixed_axis=self.plan.plant != "flight")
        return estimate(self.recording(module, number), name, self.options)

    def _streams(self, number: int) -> dict[str, np.random.Generator]:
        """Return each sensor's stream of noise, as `record` has them."""
        noise = self._rng(0, self.plan.mounts.module_of(number))
        return dict(zip(SENSORS, noise.spawn(len(SENSORS)), strict=True))

    def recording(self, module: Instruments, number: int) -> Recording:
        """Return the whole recording of a mount's module."""
        disc = None
        if self.plan.plant == "flight":
            disc = self.case.settings["disc"][0] if "disc" in self.case.settings else load_disc("driver")[0]
        noise = self._rng(0, self.plan.mounts.module_of(number))
        made = record(self.motion, module, noise, plant=self.plan.plant, name=f"mount {number}", disc=disc)
        felt = module.sensors.get("accelerometer")
        if not self.yields or not isinstance(felt, Accelerometer):
            return made
        assert self.felt is not None
        moved = self.felt.measure(felt, self._streams(number)["accelerometer"])
        return replace(made, samples={**made.samples, "accelerometer": moved})


def _timed(module: Instruments, name: str) -> Any:
    """Return a sensor with the clock of its module as its own, as `record` reads it; None where it is absent."""
    sensor = module.sensors.get(name)
    if sensor is None:
        return None
    clock = sensor.sampling.clock._replace(ratio=sensor.sampling.clock.ratio * module.clock.ratio)
    return replace(sensor, sampling=replace(sensor.sampling, clock=clock))


class _Truth:
    """The true rate about z_B, looked up once for each set of instants that estimates come at."""

    def __init__(self, motion: Motion) -> None:
        self.motion = motion
        self.known: dict[bytes, tuple[FloatArray, FloatArray]] = {}

    def scores(self, rate: YawRate, spans: Sequence[tuple[float, float]]) -> FloatArray:
        """Return the `SCORES` of an estimate on each span, (spans, 4); magnitudes where it has no sign."""
        inside, truth = self._at(rate.t, spans)
        rows = []
        for span in range(len(spans)):
            chosen = inside[span]
            true = truth[chosen]
            error = np.degrees(rate.rate[chosen] - (true if rate.signed else np.abs(true)))
            seen = error[np.isfinite(error)]
            known = seen.size / error.size if error.size else 0.0
            if seen.size:
                rows.append((seen.mean(), np.sqrt(np.mean(seen**2)), np.abs(seen).max(), known))
            else:
                rows.append((np.nan, np.nan, np.nan, known))
        return np.array(rows)

    def _at(self, t: FloatArray, spans: Iterable[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
        key = t.tobytes()
        if key not in self.known:
            inside = np.array([(t >= start) & (t <= stop) for start, stop in spans])
            truth = np.full(t.size, np.nan)
            some = inside.any(axis=0)
            truth[some] = self.motion.at(t[some]).rate[:, 2]
            self.known[key] = inside, truth
        return self.known[key]
