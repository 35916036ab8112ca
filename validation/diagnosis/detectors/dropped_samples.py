"""Dropped samples: a sensor whose sample numbers have run ahead, by Viterbi alignment and phases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import DroppedSamples
from validation.diagnosis.detectors.sample_alignment import first_yaw, lost_along, phase_counts, repaired
from validation.diagnosis.relaxed_fit import relaxed
from validation.diagnosis.selection.candidates import Trial
from validation.diagnosis.selection.proposals import Proposal
from validation.diagnosis.settings import DETECTORS
from validation.identification.gauss_newton import Fit, mapped, refit
from validation.identification.noise import NoiseModel
from validation.identification.parameters import Parameter
from validation.identification.segments import Chain, recut

__all__ = ["Shifted", "Slips", "dropped_accelerometer", "dropped_magnetometer"]


@dataclass(frozen=True)
class Shifted:
    """A proposal that changes what the readings mean: the chains to fit it from, instead of the loose fit's.

    ``proposal.gain`` is in chi-squared where the search stood, less the price of each sample that it takes for lost.
    ``cost`` is that price: twice the logarithm of the ways to lose as many.
    """

    proposal: Proposal
    chains: tuple[Chain, ...]
    cost: float = 0.0


def _losses(id: str, chains: Sequence[Chain], sensor: str) -> tuple[Trial, float]:
    """Return the trial of lost samples as chains hold them, and the price of where they are."""
    lost = sampled = 0.0
    cost = 0.0
    for chain in chains:
        counts = chain.lost.get(sensor)
        if counts is None:
            continue
        n, gone = float(counts.size), float(counts[-1])
        lost, sampled = lost + gone, sampled + n + gone
    share = lost / sampled
    # where each one is lost is chosen: twice the logarithm of the choices
    if lost:
        cost = 2.0 * lost * (1.0 - np.log(share))
    sd = float(np.sqrt(max(share * (1.0 - share), 1.0 / sampled) / sampled))
    return Trial(id, (), None, (("fraction", share, sd),)), cost


@dataclass(frozen=True)
class Slips:
    """Lost samples of the magnetometer as its phase tells them about a relaxed fit; about none before it is asked."""

    fit: Fit | None = None
    found: tuple[Shifted, ...] = ()

    def about(self, fit: Fit, known: Sequence[Parameter]) -> Slips:
        """Return what is found about a fit, which is worked out once."""
        return self if self.fit is fit else Slips(fit, tuple(dropped_magnetometer(fit, known)))


def dropped_magnetometer(fit: Fit, known: Sequence[Parameter], least: float = DETECTORS.least_dropped) -> list[Shifted]:
    """Return lost samples of the magnetometer as a proposal where its phase shows steps.

    The motion of a loose fit follows the magnetometer; with steps found it is fitted anew with the samples at their
    own times, and the counts are then read once more off the motion that all sensors agree on.
    """
    chains = fit.chains
    sensor = "magnetometer"
    id = catalogued(DroppedSamples, sensor).id
    counts = [
        phase_counts(chain.recording) if chain.recording.get(sensor) is not None else np.zeros(0) for chain in chains
    ]
    steps = sum(float(c[-1]) for c in counts if c.size)
    if steps < DETECTORS.fewest_steps:
        return []
    fixed = [
        repaired(chain.recording, sensor, c) if c.size else chain.recording
        for chain, c in zip(chains, counts, strict=True)
    ]
    anew = relaxed(fixed, known)
    gain = fit.merit - anew.merit
    if gain < least:
        return []
    new = tuple(_own_times(one, chain, {sensor: c}) for one, chain, c in zip(anew.chains, chains, counts, strict=True))
    # what was lost while the phase stood still shows in what comes after, by a motion that hangs together
    plant = anew.plant
    found = replace(anew, chains=new)
    if plant.commanded:
        whole = tuple(
            _begun(replace(c, edges=c.edges[[0, -1]], states=c.states[:1]), anew, i) for i, c in enumerate(new)
        )
        counted, _ = _counted(replace(found, chains=whole), sensor, _stated_sd(found, sensor, anew.noise))
        standing = tuple(
            recut(one, found.values(i), chain.edges) for i, (one, chain) in enumerate(zip(whole, new, strict=True))
        )
        found = _with_losses(replace(found, chains=standing), counted, sensor)
    for _ in range(2):
        tied = refit(replace(found, jumps=plant.sizes.continuous), iterations=4)
        counted, _ = _counted(tied, sensor, _stated_sd(found, sensor, anew.noise))
        same = all(
            np.array_equal(a.lost.get(sensor, 0.0), b.lost.get(sensor, 0.0))
            for a, b in zip(found.chains, counted.chains, strict=True)
        )
        found = _with_losses(tied, counted, sensor)
        if same:
            break
    trial, cost = _losses(id, found.chains, sensor)
    return [Shifted(Proposal(trial, gain - cost, {}), found.chains, cost)]


def _begun(whole: Chain, fit: Fit, i: int) -> Chain:
    """Return a table's motion in one piece from the yaw that its first readings show."""
    yaw = whole.plant.layout.yaw
    if yaw is None or whole.recording.get("magnetometer") is None:
        return whole
    whole = replace(whole, states=np.zeros_like(whole.states))
    turned = whole.states.copy()
    turned[:, yaw] = first_yaw(whole, fit.values(i))
    return replace(whole, states=turned)


def _with_losses(fit: Fit, counted: Fit, sensor: str) -> Fit:
    """Return a fit with the losses that the chains of another hold."""
    chains = tuple(
        replace(chain, lost={**chain.lost, sensor: other.lost[sensor]}) if sensor in other.lost else chain
        for chain, other in zip(fit.chains, counted.chains, strict=True)
    )
    return replace(fit, chains=chains)


def _own_times(anew: Chain, old: Chain, lost: Mapping[str, FloatArray]) -> Chain:
    """Return the pieces of a fit to repaired recordings as pieces of the recording itself, its losses beside it."""
    some = {sensor: counts for sensor, counts in lost.items() if counts.size}
    written = {readings.sensor: readings.t for readings in old.readings}
    readings = tuple(replace(r, t=written[r.sensor]) for r in anew.readings)
    return replace(anew, recording=old.recording, readings=readings, lost={**old.lost, **some}, effects=old.effects)


def dropped_accelerometer(
    fit: Fit, noise: NoiseModel, taken: Sequence[Trial] = (), least: float = DETECTORS.least_dropped
) -> list[Shifted]:
    """Return lost samples of the accelerometer as a proposal where the motion tells that its readings slip."""
    sensor = "accelerometer"
    id = catalogued(DroppedSamples, sensor).id
    if sensor not in {r.sensor for chain in fit.chains for r in chain.readings}:
        return []
    if any(trial.id == id for trial in taken):
        return []
    sd = _stated_sd(fit, sensor, noise)
    if _counted(fit, sensor, sd)[1] < least:
        return []
    # what is lost has bent the motion: once more without the sensor in question
    without = replace(
        fit, chains=tuple(replace(c, readings=tuple(r for r in c.readings if r.sensor != sensor)) for c in fit.chains)
    )
    free = refit(without, iterations=4)
    whole = replace(
        free, chains=tuple(replace(c, readings=old.readings) for c, old in zip(free.chains, fit.chains, strict=True))
    )
    whole, gain = _counted(whole, sensor, sd)
    if gain < least:
        return []
    again = refit(replace(whole, noise=noise), iterations=3)
    again, _ = _counted(again, sensor, sd)
    trial, cost = _losses(id, again.chains, sensor)
    if trial.told[0][1] == 0.0:
        return []
    return [Shifted(Proposal(trial, gain, {}), again.chains, cost)]


def _stated_sd(fit: Fit, sensor: str, noise: NoiseModel) -> FloatArray:
    """Return the noise of a sensor's axes: as stated, or where nothing is stated as a fit shows it."""
    readings = next(r for chain in fit.chains for r in chain.readings if r.sensor == sensor)
    return np.where(np.isfinite(readings.sd), readings.sd, noise[sensor].sd)


def _counted(fit: Fit, sensor: str, sd: FloatArray) -> tuple[Fit, float]:
    """Return a fit whose chains hold the likeliest losses of a sensor by its motion, and their gain."""

    def one(i: int) -> tuple[Chain, float]:
        chain = fit.chains[i]
        if all(r.sensor != sensor for r in chain.readings):
            return chain, 0.0
        counts, gain = lost_along(chain, fit.values(i), sensor, 2.0 * sd)
        return replace(chain, lost={**chain.lost, sensor: counts}), gain

    done = mapped(one, range(len(fit.chains)))
    return replace(fit, chains=tuple(chain for chain, _ in done)), float(sum(gain for _, gain in done))
