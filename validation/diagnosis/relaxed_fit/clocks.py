"""Clocks so far from right that no slope leads to them: tried one by one on a motion, or found from its beginning.

A sensor whose clock is off by a per cent is out of phase with the spin by turns after a few seconds. A free clock then
ends in the nearest minimum, a turn or more from the right one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from discsim.effects.catalogue import CATALOGUE, Effect
from discsim.effects.catalogue import effect as made
from discsim.validation.diagnosis.first_trajectory import beginning, begun_again
from discsim.validation.diagnosis.relaxed_fit.astray import astray
from discsim.validation.diagnosis.relaxed_fit.further_steps import TOLERANCE, fitted_further
from discsim.validation.diagnosis.relaxed_fit.left_out import fitted_without, in_noise_left, with_all_readings
from discsim.validation.diagnosis.relaxed_fit.parameters import free_clock, free_clocks
from discsim.validation.diagnosis.relaxed_fit.sensor_residuals import misfit
from discsim.validation.diagnosis.settings import CONSISTENCY, RELAXED_FIT
from discsim.validation.identification.gauss_newton import Fit, refit
from discsim.validation.identification.parameters import Values
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import delay

__all__ = ["clock_of_accelerometer", "led_by_other_sensors", "with_clock_of_gyroscope", "with_free_clocks"]

#: sensors without which the motion of a flight can still be followed
_DISPENSABLE = ("accelerometer", "gyroscope")
#: clocks that are tried on a motion that the other sensors tell
_CLOCKS_STEP = 1e-4
_CLOCKS_TRIED = 1.0 + _CLOCKS_STEP * np.arange(-300, 301)
#: clocks that are tried by the corners of a rig's rate, within what a free clock may be. A corner is a second wide: in
#: half a minute a step moves it by a hundredth of that
_CORNERS_TRIED = 1.0 + 5e-4 * np.arange(-60, 61)
#: a clock is offered where it leaves less than this share; it is named only if its fit is the best. The bar is low
#: enough for recordings of 3 s
_WORTH_TRYING = 0.5
#: clocks whose phases are this far apart at a recording's end, rad, lie in one valley of the misfit; at most so many
#: steps at once
_ALIKE, _FEW_CLOCKS = 0.5, 20


def led_by_other_sensors(fit: Fit) -> Fit:
    """Return the fit of flights that went astray as it is without one sensor: its clock may be wrong, or samples lost.

    Its clock is found on the motion that the others tell. Where that reconciles it, all are fitted together. Where it
    does not, the motion stays as the others tell it, for a search to find what is wrong with the sensor.
    """
    there = {readings.sensor for one in fit.trajectories for readings in one.readings}
    if not fit.plant.follows_path or not astray(fit):
        return fit
    for sensor in _DISPENSABLE:
        if sensor not in there or not (there - {sensor}) & {"magnetometer", "gyroscope"}:
            continue
        some = fit.part(astray(fit)[: CONSISTENCY.few])
        if len(some.trajectories) < len(fit.trajectories) and astray(fitted_without(some, sensor, fit.count)):
            continue
        led = fitted_without(fit, sensor, fit.count)
        if astray(led):
            continue
        whole = replace(led, trajectories=with_all_readings(led, fit))
        timed = fitted_further(_with_clock(whole, sensor, _clock_by_trial(whole, sensor)), fit.count)
        return in_noise_left(whole, sensor) if astray(timed) else timed
    return fit


def with_clock_of_gyroscope(fit: Fit) -> Fit:
    """Return the fit of a rig with a free clock of the gyroscope, where the motion contradicts it and a clock serves.

    The other sensors tell a rig's motion. What a gyroscope half a second late leaves would pass for slow noise. An
    accelerometer is left to the search for lost samples, which look like a slow clock.
    """
    sensor = "gyroscope"
    before = misfit(fit, sensor)
    if not before > RELAXED_FIT.lost:
        return fit
    timed = _with_clock(fit, sensor, _clock_by_trial(fit, sensor))
    timed = refit(timed, iterations=8, tolerance=TOLERANCE * fit.count)
    return timed if misfit(timed, sensor) < RELAXED_FIT.reconciled * before else fit


def _with_clock(fit: Fit, sensor: str, ratio: float) -> Fit:
    """Return a fit with one parameter more: the clock of a sensor, at ``ratio``."""
    return replace(fit, parameters=(*fit.parameters, free_clock(sensor)), at=np.append(fit.at, ratio))


def clock_of_accelerometer(fit: Fit) -> Effect | None:
    """Return the clock by which the accelerometer on a rig follows the motion that others tell; None where none does.

    A rig's rate changes at corners, which a clock that is off by a per cent moves by a third of a second: from there no
    slope leads to it.
    """
    sensor = "accelerometer"
    if fit.plant.airborne or not misfit(fit, sensor) > RELAXED_FIT.lost:
        return None
    values = [_ideal(fit.values(i), sensor) for i in range(len(fit.trajectories))]
    distance = _distance_by_clock(fit.trajectories, values, sensor)
    found = {ratio: distance(ratio) for ratio in _CORNERS_TRIED.tolist()}
    best = min(found, key=lambda ratio: found[ratio])
    return made(free_clock(sensor).group, ratio=best) if found[best] < _WORTH_TRYING * found[1.0] else None


def _ideal(values: Values, sensor: str) -> Values:
    """Return a fit's values without a sensor's own errors, which a wrong clock has bent to stand for what it does."""
    return {key: v for key, v in values.items() if key[0] not in CATALOGUE or CATALOGUE[key[0]].acts_on != sensor}


def with_free_clocks(fit: Fit) -> Fit:
    """Return a fit with free clocks where recordings went astray: sensors' phases may have run away from one another.

    A first look at the beginning, where no phase is off by a turn, gives the clocks; then the whole is fitted.
    """
    if not fit.plant.airborne or not astray(fit):
        return fit
    clocks = free_clocks({readings.sensor for one in fit.trajectories for readings in one.readings})
    parameters = (*fit.parameters, *clocks)
    at = np.array([q.stated for q in parameters])
    free = replace(fit, parameters=parameters, at=at)
    some = free.part(astray(fit)[: CONSISTENCY.few])
    if len(some.trajectories) < len(fit.trajectories) and len(astray(_first_look(some))) == len(some.trajectories):
        return fit
    look = _first_look(free)
    if len(astray(look)) == len(look.trajectories):
        return fit
    ratio = look.values(0).get(free_clock("magnetometer").key, 1.0)
    trajectories = tuple(begun_again(one, ratio) for one in fit.trajectories)
    # what the first look says of the rest is little: only the clocks are taken over
    known = {q.key for q in clocks}
    at = np.array([v if q.key in known else q.stated for q, v in zip(parameters, look.at, strict=True)])
    whole = fitted_further(replace(fit, trajectories=trajectories, parameters=parameters, at=at), fit.count)
    return whole if whole.merit < RELAXED_FIT.rescued * fit.merit else fit


def _first_look(fit: Fit) -> Fit:
    """Return a fit to the beginnings of recordings alone, begun anew from the data."""
    short = tuple(beginning(begun_again(one), RELAXED_FIT.first_look) for one in fit.trajectories)
    return refit(replace(fit, trajectories=short), iterations=10)


def _clock_by_trial(fit: Fit, sensor: str) -> float:
    """Return the clock by which a sensor's readings are nearest to the motion of a fit.

    Between clocks whose phases are apart by less than a radian at the end of the longest recording the distance has no
    other minimum. So a few are tried first, and all others only about the best of these.
    """
    turned = max(
        float(one.nodes[-1] * np.max(np.abs(one.states[:, one.plant.layout.spin])))
        if one.plant.layout.spin is not None
        else np.inf
        for one in fit.trajectories
    )
    apart = int(np.clip(_ALIKE / max(turned * _CLOCKS_STEP, 1e-9), 1, _FEW_CLOCKS))
    distance = _distance_by_clock(fit.trajectories, [fit.values(i) for i in range(len(fit.trajectories))], sensor)
    rough = _CLOCKS_TRIED[::apart]
    best = apart * int(np.argmin([distance(float(ratio)) for ratio in rough]))
    near = _CLOCKS_TRIED[max(best - apart, 0) : best + apart + 1]
    return float(near[int(np.argmin([distance(float(ratio)) for ratio in near]))])


def _distance_by_clock(
    trajectories: Sequence[Trajectory], values: Sequence[Values], sensor: str
) -> Callable[[float], float]:
    """Return how far a sensor's readings are from the motion of their trajectories, as a function of its clock."""
    clock = free_clock(sensor).key
    pairs = zip(trajectories, values, strict=True)
    own = [(one, at, told) for one, at in pairs for told in one.readings if told.sensor == sensor]
    return lambda ratio: sum(_distance(one, told, {**at, clock: ratio}) for one, at, told in own)


def _distance(one: Trajectory, told: Readings, values: Values) -> float:
    """Return the mean distance of a sensor's readings from a motion, in their unit, about each axis's median."""
    sensor = told.sensor
    at = told.t - delay(values, sensor, told.t)
    inside = (at > 0.0) & (at < one.nodes[-1])
    left = np.where(told.good, told.value, np.nan)[inside] - shown(one, values, sensor, at[inside])
    left = left[:, np.isfinite(left).any(axis=0)]
    return float(np.nanmean(np.abs(left - np.nanmedian(left, axis=0)))) if left.size else 0.0
