"""Dropped samples: a sensor whose sample numbers have run ahead, by Viterbi alignment and phases.

Takes a relaxed fit; gives candidates with trajectories in the time that the counts say.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, sd_of_share
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import DroppedSamples
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.detectors.sample_alignment import (
    ROOM,
    Alignment,
    Losses,
    alignment_of,
    first_yaw,
    lost_along,
    lost_and_turned,
    lost_in_own_noise,
    phase_counts,
    repaired,
    told_of,
)
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import Fit, mapped, refit
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import Values

__all__ = [
    "LostSamples",
    "Shifted",
    "begun_later",
    "dropped_accelerometer",
    "dropped_magnetometer",
    "loses_samples",
    "price_of_places",
    "recounted",
    "uncounted",
    "with_losses",
    "without_losses",
]


@dataclass(frozen=True)
class Shifted:
    """A screened candidate that changes what the readings mean, and the fit to go on from.

    The numbers of that fit go with its trajectories: where nobody knew of the losses a clock took them up.
    ``screened.gain`` is in chi-squared where the search stood, less the price of each sample that it takes
    for lost. ``cost`` is that price: twice the logarithm of the ways to lose as many.
    """

    screened: ScreenedCandidate
    fit: Fit
    cost: float = 0.0

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The trajectories of its fit, which hold the losses."""
        return self.fit.trajectories

    def in_place_of(self, fit: Fit) -> Fit:
        """Return a fit with the trajectories and the numbers of this one."""
        return replace(fit, trajectories=self.fit.trajectories, parameters=self.fit.parameters, at=self.fit.at)


def _id_of(sensor: str) -> str:
    return catalogued(DroppedSamples, sensor).id


def price_of_places(lost: float, share: float) -> float:
    """Return what it costs to choose where samples were lost, a share of all: twice the logarithm of the choices."""
    return float(2.0 * lost * (1.0 - np.log(share)))


def _alignment(fit: Fit, i: int, sensor: str) -> Alignment | None:
    """Return a sensor's readings in a recording beside what a fit's motion shows of it; None where it has none."""
    trajectory = fit.trajectories[i]
    readings = next((r for r in trajectory.readings if r.sensor == sensor), None)
    if readings is None:
        return None
    return alignment_of(trajectory, fit.values(i), readings, trajectory.recording.sheets[sensor].rate_hz)


def _losses(fit: Fit, sensor: str) -> tuple[CandidateEffect, float]:
    """Return the candidate of a sensor's lost samples as a fit holds them, and the price of where they are.

    Samples in which one more loss would not have shown are none of those whose share was lost.
    """
    sd = _stated_sd(fit, sensor, fit.noise)

    def one(i: int) -> tuple[float, float]:
        trajectory = fit.trajectories[i]
        counts = trajectory.lost.get(sensor)
        if counts is None:
            return 0.0, 0.0
        own = _alignment(fit, i, sensor)
        if own is None or len(own.measured) != counts.size:
            return float(counts[-1]), float(counts.size + counts[-1])
        told = max(told_of(own, counts.astype(np.int64), sd), int(np.searchsorted(counts, counts[-1])))
        return float(counts[-1]), float(told + counts[-1])

    lost, sampled = np.sum(mapped(one, range(len(fit.trajectories))), axis=0)
    sampled = max(sampled, 1.0)
    share = float(lost / sampled)
    cost = price_of_places(float(lost), share) if lost else 0.0
    return CandidateEffect(_id_of(sensor), (), None, (("fraction", share, sd_of_share(share, sampled)),)), cost


@dataclass(frozen=True)
class LostSamples:
    """Lost samples of the sensors as a relaxed fit tells them; of none before it is asked."""

    fit: Fit | None = None
    found: tuple[Shifted, ...] = ()

    def about(
        self, fit: Fit, known: Sequence[Parameter], noise: Callable[[], NoiseModel], taken: Collection[str] = ()
    ) -> LostSamples:
        """Return what is found about a fit with its noise, which is worked out once: it takes fits of its own.

        ``taken`` are the ids of effects that the fit has counted already.
        """
        if self.fit is fit:
            return self
        found = [] if _id_of("magnetometer") in taken else dropped_magnetometer(fit, known)
        # of a path that is not known an accelerometer counts by its means over turns
        if fit.plant.path_known and _id_of("accelerometer") not in taken:
            found += dropped_accelerometer(fit, noise())
        return LostSamples(fit, tuple(found))


def dropped_magnetometer(fit: Fit, known: Sequence[Parameter], least: float = DETECTORS.least_dropped) -> list[Shifted]:
    """Return lost samples of the magnetometer as a screened candidate where its phase shows steps.

    The motion of a relaxed fit follows the magnetometer; with steps found it is fitted anew with the samples at their
    own times, and the counts are then read once more off the motion that all sensors agree on.
    """
    trajectories = fit.trajectories
    sensor = "magnetometer"
    counts = [
        phase_counts(trajectory.recording) if trajectory.recording.get(sensor) is not None else np.zeros(0)
        for trajectory in trajectories
    ]
    steps = sum(float(c[-1]) for c in counts if c.size)
    if steps < DETECTORS.fewest_steps:
        return []
    fixed = [
        repaired(trajectory.recording, sensor, c) if c.size else trajectory.recording
        for trajectory, c in zip(trajectories, counts, strict=True)
    ]
    anew = relaxed(fixed, known)
    gain = fit.merit - anew.merit
    if gain < least:
        return []
    new = tuple(
        _own_times(one, trajectory, {sensor: c})
        for one, trajectory, c in zip(anew.trajectories, trajectories, counts, strict=True)
    )
    # what was lost while the phase stood still shows in what comes after, by a motion that is continuous
    plant = anew.plant
    found = replace(anew, trajectories=new)
    if plant.commanded:
        whole = tuple(
            _begun(replace(c, nodes=c.nodes[[0, -1]], states=c.states[:1]), anew, i) for i, c in enumerate(new)
        )
        counted = _counted(replace(found, trajectories=whole), sensor, _stated_sd(found, sensor, anew.noise))
        standing = replace(found, trajectories=whole).cut_at([one.nodes for one in new])
        found = with_losses(standing, counted, sensor)
    for _ in range(2):
        fitted = refit(replace(found, defects=plant.sizes.continuous), iterations=4)
        counted = _counted(fitted, sensor, _stated_sd(found, sensor, anew.noise))
        same = all(
            np.array_equal(a.lost.get(sensor, 0.0), b.lost.get(sensor, 0.0))
            for a, b in zip(found.trajectories, counted.trajectories, strict=True)
        )
        found = with_losses(fitted, counted, sensor)
        if same:
            break
    candidate, cost = _losses(found, sensor)
    return [Shifted(ScreenedCandidate(candidate, gain - cost, {}), found, cost)]


def _begun(whole: Trajectory, fit: Fit, i: int) -> Trajectory:
    """Return a table's motion in one segment from the yaw that its first readings show."""
    yaw = whole.plant.layout.yaw
    if yaw is None or whole.recording.get("magnetometer") is None:
        return whole
    whole = replace(whole, states=np.zeros_like(whole.states))
    turned = whole.states.copy()
    turned[:, yaw] = first_yaw(whole, fit.values(i))
    return replace(whole, states=turned)


def with_losses(fit: Fit, counted: Fit, sensor: str) -> Fit:
    """Return a fit with the losses that the trajectories of another hold."""
    trajectories = tuple(
        replace(trajectory, lost={**trajectory.lost, sensor: other.lost[sensor]})
        if sensor in other.lost
        else trajectory
        for trajectory, other in zip(fit.trajectories, counted.trajectories, strict=True)
    )
    return replace(fit, trajectories=trajectories)


def _own_times(anew: Trajectory, old: Trajectory, lost: Mapping[str, FloatArray]) -> Trajectory:
    """Return the segments of a fit to repaired recordings as segments of the recording itself, its losses beside it.

    Only what lost samples was written at other times. Means over turns of another sensor may be one more or less: they
    go by the turns that the readings show.
    """
    some = {sensor: counts for sensor, counts in lost.items() if counts.size}
    written = {readings.sensor: readings.t for readings in old.readings}
    readings = tuple(replace(r, t=written[r.sensor]) if r.sensor in some else r for r in anew.readings)
    return replace(anew, recording=old.recording, readings=readings, lost={**old.lost, **some}, effects=old.effects)


#: most rounds in which the motion says more of the counts and they of the motion; what share the noise has to fall by
_ROUNDS, _FALLEN = 4, 0.9
#: times the stated noise that a motion leaves of a sensor which it follows through its losses, and more: some hundred
#: readings of noise as stated scatter by 10 % at most. Time alone
_LOUDER = 1.2
#: noises that a motion which others tell may leave of a sensor, and more
_ANY = 100.0
#: fewest readings of a motion's beginning that tell what was lost: some turns of a disc
_FEWEST = 40


def dropped_accelerometer(fit: Fit, noise: NoiseModel, least: float = DETECTORS.least_dropped) -> list[Shifted]:
    """Return lost samples of the accelerometer as a screened candidate where the motion tells of them."""
    sensor = "accelerometer"
    if sensor not in {r.sensor for trajectory in fit.trajectories for r in trajectory.readings}:
        return []
    if sensor not in noise:  # all of its readings are beyond its range, and none takes part
        return []
    _, gain, left = _counted_in_own_noise(fit, sensor, noise)
    if gain < least and left < _LOUDER * float(np.max(_stated_sd(fit, sensor, noise))):
        return []
    # what is lost has bent the motion, to where it shows no loss but more than noise: once more without the sensor
    without = replace(
        fit,
        trajectories=tuple(
            replace(c, readings=tuple(r for r in c.readings if r.sensor != sensor)) for c in fit.trajectories
        ),
    )
    free = refit(without, iterations=4)
    again = replace(
        free,
        trajectories=tuple(
            replace(c, readings=old.readings) for c, old in zip(free.trajectories, fit.trajectories, strict=True)
        ),
    )
    level = np.inf
    # with its samples counted the sensor tells more of the motion, and the motion more of the counts
    for _ in range(_ROUNDS):
        whole, gain, lower = _counted_in_own_noise(again, sensor, noise)
        if gain < least:
            return []
        if lower > _FALLEN * level:
            break
        level = lower
        again = refit(replace(whole, noise={**noise, sensor: noise[sensor]._replace(sd=level)}), iterations=3)
    candidate, cost = _losses(whole, sensor)
    if candidate.fixed_values[0][1] == 0.0:
        return []
    return [Shifted(ScreenedCandidate(candidate, gain, {}), whole, cost)]


def recounted(fit: Fit, sensor: str) -> tuple[Shifted, float] | None:
    """Return the losses of a sensor by the motion of a fit that has some; None where they are as before.

    Beside them stands by how much their price grows. What was missing when they were counted had bent the motion, or
    segments that followed the sensor had taken a loss for a turn.
    """
    if all(sensor not in trajectory.lost for trajectory in fit.trajectories):
        return None
    if sensor == "magnetometer":
        whole, gain = _counted(fit, sensor, _stated_sd(fit, sensor, fit.noise)), 0.0
    else:
        whole, gain, _ = _counted_in_own_noise(fit, sensor, fit.noise)
    counts = [[t.lost[sensor] for t in some.trajectories if sensor in t.lost] for some in (fit, whole)]
    if len(counts[0]) == len(counts[1]) and all(np.array_equal(a, b) for a, b in zip(*counts, strict=True)):
        return None
    return _shifted(fit, whole, sensor, gain)


def begun_later(fit: Fit, sensor: str, recording: int, count: int) -> tuple[Shifted, float]:
    """Return the losses of a sensor, and so many before the first reading of a recording; how much their price grows.

    A motion that goes by the sensor does not tell that its first reading is the second one that was taken.
    """
    some = list(fit.trajectories)
    known = some[recording].lost.get(sensor, np.zeros(len(some[recording].recording.samples[sensor])))
    some[recording] = replace(some[recording], lost={**some[recording].lost, sensor: known + count})
    return _shifted(fit, replace(fit, trajectories=tuple(some)), sensor, 0.0)


def uncounted(fit: Fit, sensor: str) -> tuple[Fit, float]:
    """Return a fit whose trajectories hold no losses of a sensor, and what theirs had cost."""
    _, cost = _losses(fit, sensor)
    return without_losses(fit, sensor), cost


def without_losses(fit: Fit, sensor: str) -> Fit:
    """Return a fit whose trajectories hold no losses of a sensor."""
    trajectories = tuple(
        replace(one, lost={other: counts for other, counts in one.lost.items() if other != sensor})
        for one in fit.trajectories
    )
    return replace(fit, trajectories=trajectories)


def _shifted(before: Fit, after: Fit, sensor: str, gain: float) -> tuple[Shifted, float]:
    """Return the losses of a fit as a candidate, with a gain, and how much dearer than those of one before they are."""
    _, was = _losses(before, sensor)
    candidate, cost = _losses(after, sensor)
    return Shifted(ScreenedCandidate(candidate, gain, {}), after, cost), cost - was


def _counted_in_own_noise(fit: Fit, sensor: str, noise: NoiseModel) -> tuple[Fit, float, float]:
    """Return a fit with the likeliest losses of a sensor, each recording's in the noise that they leave.

    Beside it stand their gain, and the loudest axis of the median recording.
    """
    stated = _stated_sd(fit, sensor, noise)

    def one(i: int) -> tuple[Trajectory, Losses | None]:
        trajectory = fit.trajectories[i]
        own = _alignment(fit, i, sensor)
        if own is None:
            return trajectory, None
        losses = lost_in_own_noise(own, stated, np.full_like(stated, noise[sensor].sd))
        return replace(trajectory, lost={**trajectory.lost, sensor: losses.counts}), losses

    done = mapped(one, range(len(fit.trajectories)))
    found = [losses for _, losses in done if losses is not None]
    level = float(np.median([np.max(losses.noise) for losses in found]))
    return replace(fit, trajectories=tuple(t for t, _ in done)), sum(losses.gain for losses in found), level


def loses_samples(trajectory: Trajectory, values: Values, readings: Readings, rate_hz: float, sd: FloatArray) -> bool:
    """Tell whether lost samples bring a sensor to a motion that others tell, and that ends before its readings do.

    ``sd`` (k,) is the sensor's noise. Few readings tell nothing.
    """
    if np.count_nonzero(readings.t < (1.0 - ROOM) * float(trajectory.nodes[-1])) < _FEWEST:
        return False
    own = alignment_of(trajectory, values, readings, rate_hz, cut=True)
    return lost_in_own_noise(own, sd, _ANY * sd).gain >= DETECTORS.least_dropped


def _stated_sd(fit: Fit, sensor: str, noise: NoiseModel) -> FloatArray:
    """Return the noise of a sensor's axes: as stated, or where nothing is stated as a fit shows it."""
    readings = next(r for trajectory in fit.trajectories for r in trajectory.readings if r.sensor == sensor)
    return np.where(np.isfinite(readings.sd), readings.sd, noise[sensor].sd)


def _counted(fit: Fit, sensor: str, sd: FloatArray) -> Fit:
    """Return a fit whose trajectories hold the likeliest losses of a sensor by its motion in a noise ``sd`` (k,).

    The yaw of a rig, which no other sensor tells, is where the magnetometer is nearest to it.
    """
    yaw = fit.plant.layout.yaw if sensor == "magnetometer" else None

    def one(i: int) -> Trajectory:
        trajectory = fit.trajectories[i]
        own = _alignment(fit, i, sensor)
        if own is None:
            return trajectory
        losses, turn = (lost_along(own, sd), 0.0) if yaw is None else lost_and_turned(own, sd)
        states = trajectory.states.copy()
        if yaw is not None:
            states[:, yaw] += turn
        return replace(trajectory, states=states, lost={**trajectory.lost, sensor: losses.counts})

    return replace(fit, trajectories=tuple(mapped(one, range(len(fit.trajectories)))))
