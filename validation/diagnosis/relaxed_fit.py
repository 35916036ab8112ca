"""The fit with relaxed continuity: motion that follows the data whatever physics is missing.

Takes recordings; gives a `Fit`. Segments may part from one another and the sensors may be wrong by anything ordinary,
each within a wide prior, so that the fit stays beside the truth under any hidden effect (weak-constraint estimation, as
in data assimilation: Tremolet, 2006). What is learned there is not the effect but a point about which the questions
that decide are nearly linear.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray, sd_by_median
from discsim.effects.catalogue import CATALOGUE, Effect, catalogued
from discsim.effects.catalogue import effect as made
from discsim.effects.sensors import ClockRate, GSensitivity
from discsim.effects.setup import TimeOffset
from discsim.frames import conjugate, multiply
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.followed import true_noise
from discsim.validation.diagnosis.consistency.spin_agreement import Comparison, compared, written_ratios
from discsim.validation.diagnosis.first_trajectory import (
    CLOCK,
    beginning,
    begun_again,
    first_trajectory,
    nodes_of,
    trajectory_in_true_time,
    within_range,
)
from discsim.validation.diagnosis.settings import CONSISTENCY, RELAXED_FIT
from discsim.validation.identification.from_afar import fitted_from_afar
from discsim.validation.identification.gauss_newton import Fit, linearised, merit_of, refit
from discsim.validation.identification.noise import estimate_noise, robust_noise, stated_noise, whitened
from discsim.validation.identification.ordinary_errors import ordinary_errors
from discsim.validation.identification.parameters import Parameter, Values
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.readings import Readings
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import delay

__all__ = [
    "clock_of_accelerometer",
    "from_other_initial_states",
    "left_across",
    "moves_out",
    "relaxed",
    "unbalanced",
    "without_outliers",
]

#: times of one sensor that are off by as much all along
_OFFSETS = frozenset(row.id for row in CATALOGUE.values() if row.type is TimeOffset)


def ordinary(sensors: set[str], plant: str, *, small: bool = False) -> tuple[Parameter, ...]:
    """Return the parameters that a relaxed fit sets free within a prior, of the sensors that are there."""
    chosen = list[Parameter]()
    uses = ("relaxed fit", "relaxed fit of free-running parts") if small else ("relaxed fit",)
    for id, name, sigma, _ in [error for use in uses for error in ordinary_errors(use)]:
        row = CATALOGUE[id]
        if plant in row.plants and (row.acts_on == "motion" or row.acts_on in sensors):
            size = row.scale[row.parameters.index(name)]
            chosen.append(Parameter(id, name, float(getattr(row.baseline, name)), 0.1 * size, sigma))
    return tuple(chosen)


def unknowns(recordings: Sequence[Recording]) -> tuple[Parameter, ...]:
    """Return what each recording leaves open beside its states: how the wobble of a free spin dies and turns."""
    plant = plant_of(recordings[0])
    return tuple(
        replace(q, recordings=frozenset([i]))
        for i, recording in enumerate(recordings)
        for q in (
            *plant.own,
            *(plant.held if "accelerometer" in recording else ()),
            *(plant.zeros if "magnetometer" in recording.averaged else ()),
        )
    )


def relaxed_parameters(
    recordings: Sequence[Recording], sensors: set[str], *, small: bool = False
) -> tuple[Parameter, ...]:
    """Return all that a relaxed fit of recordings with some sensors sets free beside stated numbers."""
    return (*unknowns(recordings), *ordinary(sensors, recordings[0].plant, small=small))


# far from the data a motion may run beyond all numbers: such a step is not finite, and is not taken
@np.errstate(over="ignore", invalid="ignore")
def relaxed(
    recordings: Sequence[Recording],
    known: Sequence[Parameter] = (),
    iterations: int = 12,
    agreeing: Sequence[Sequence[Comparison]] | None = None,
    supposed: Sequence[Effect] = (),
) -> Fit:
    """Fit recordings of one plant so loosely that any effect of ordinary size finds room.

    ``agreeing`` is what their sensors say of one another (`compared`), where that is known; ``supposed`` are effects of
    about the right size that they ask for, whose numbers are free beside the ordinary ones.
    """
    plant = plant_of(recordings[0])
    ratio = _wrong_time(recordings, agreeing)
    trajectories = tuple(
        first_trajectory(one) if ratio == 1.0 else trajectory_in_true_time(one, ratio) for one in recordings
    )
    sensors = {readings.sensor for one in trajectories for readings in one.readings}
    clock = () if ratio == 1.0 else (Parameter(*CLOCK, 1.0, 1e-6, RELAXED_FIT.time_sigma),)
    ordinary_ones = relaxed_parameters(recordings, sensors, small=bool(supposed))
    if any(q.group in _OFFSETS for q in known):
        # two sensors' times beside a third's: one of them is known to be open
        ordinary_ones = tuple(q for q in ordinary_ones if q.group not in _OFFSETS)
    parameters = (*known, *ordinary_ones, *clock, *_supposed(supposed))
    at = np.array([ratio if q.key == CLOCK else q.stated for q in parameters])
    fit = Fit(trajectories, parameters, at, plant.sizes.relaxed, {})
    bare = linearised(fit, ())
    seen = true_noise([readings for trajectory in trajectories for readings in trajectory.readings])
    fit = replace(fit, noise=stated_noise(bare, {group: level.sd for group, level in seen.items()}))
    few = 1e-4 * sum(linear.raw.size for linear in bare)
    if fit.from_release:
        return fitted_from_afar(fit)
    fit = _reweighted(fit, iterations, few) if supposed else refit(fit, iterations=iterations, tolerance=few)
    fit = from_other_initial_states(fit if supposed else _out_of_balance(fit))
    if not plant.airborne:
        fit = _with_own_clock(fit)
    if ratio == 1.0:
        fit = _with_clocks(_led_by_others(fit))
    trajectories = tuple(
        within_range(trajectory, linear) for trajectory, linear in zip(fit.trajectories, fit.linears, strict=True)
    )
    fit = replace(fit, trajectories=trajectories)
    linears = linearised(fit)
    return replace(fit, linears=linears, merit=merit_of(fit, linears))


#: rounds in which what a fit leaves weighs the sensors anew, and steps in each
_ROUNDS, _EACH = 3, 5


def _reweighted(fit: Fit, iterations: int, tolerance: float) -> Fit:
    """Fit in rounds, each in the noise that the one before has left, where that is above what is stated.

    Of sensors whose errors are many the one with the least noise would bend the motion until the others are lost.
    """
    stated = fit.noise
    for k in range(_ROUNDS):
        fit = refit(fit, iterations=iterations if k == 0 else _EACH, tolerance=tolerance)
        left = robust_noise(fit.linears, [linear.residual for linear in fit.linears])
        fit = replace(fit, noise={g: level if level.sd > stated[g].sd else stated[g] for g, level in left.items()})
    return replace(fit, merit=merit_of(fit, fit.linears))


#: one sigma of what is supposed, as a share of its size: what dies away within a recording is told to a tenth
_SUPPOSED = 0.3


def _supposed(effects: Sequence[Effect]) -> tuple[Parameter, ...]:
    """Return the numbers of supposed effects, about their sizes."""
    found = []
    for effect in effects:
        row = effect.row
        for name, scale in zip(row.parameters, row.scale, strict=True):
            value = float(getattr(effect.value, name))
            found.append(Parameter(effect.id, name, value, 0.1 * scale, _SUPPOSED * abs(value)))
    return tuple(found)


def _wrong_time(recordings: Sequence[Recording], agreeing: Sequence[Sequence[Comparison]] | None) -> float:
    """Return the ratio of written to true time where most recordings say that it is far from 1, else 1."""
    if not plant_of(recordings[0]).airborne:
        return 1.0
    each = compared(recordings, [one.name for one in recordings]) if agreeing is None else agreeing
    ratio = float(np.median(written_ratios(each)))
    return ratio if abs(ratio - 1.0) > RELAXED_FIT.least_wrong else 1.0


def _astray(fit: Fit) -> list[int]:
    """Return the recordings whose fit is far from their data while others' is not, worst first."""
    chi2 = [
        float(np.sum(np.minimum(whitened(linear, fit.noise, linear.residual[:, None])[:, 0] ** 2, 1e4)))
        / max(linear.raw.size, 1)
        for linear in fit.linears
    ]
    return [i for i in np.argsort(chi2)[::-1].tolist() if chi2[i] > RELAXED_FIT.astray]


def from_other_initial_states(fit: Fit) -> Fit:
    """Try other attitudes at release, or other starts, for recordings whose fit went astray, each by itself."""
    if fit.plant.layout.attitude is None:
        return fit
    better = dict[int, Trajectory]()
    for i in _astray(fit)[: CONSISTENCY.few]:
        ratio = fit.values(i).get(CLOCK, 1.0)
        alone = part_of(fit, [i])
        alone = replace(alone, merit=merit_of(alone, alone.linears))
        for states in _other_states(fit.trajectories[i], ratio):
            candidate = replace(alone, trajectories=(replace(fit.trajectories[i], states=states),))
            candidate = refit(candidate, iterations=6, tolerance=1e-3 * fit.count)
            if candidate.merit < RELAXED_FIT.rescued * alone.merit:
                alone, better[i] = candidate, candidate.trajectories[0]
    if not better:
        return fit
    together = replace(fit, trajectories=tuple(better.get(i, one) for i, one in enumerate(fit.trajectories)))
    together = refit(together, iterations=6, tolerance=1e-3 * fit.count)
    return together if together.merit < fit.merit else fit


def _other_states(trajectory: Trajectory, ratio: float) -> list[FloatArray]:
    """Return other states (k, s) at a trajectory's starts that are worth trying; times are ``ratio`` the true ones."""
    recording, plant, count = trajectory.recording, trajectory.plant, len(trajectory.states)
    found = list(plant.initial.other_states(recording, ratio * trajectory.nodes[:-1], 1.0))
    for states in found:
        states[:, list(plant.layout.per_time)] *= ratio
    others = plant.initial.other_attitudes(recording)[:3]
    if not others:
        return found
    attitude = plant.layout.attitude
    first = (
        first_trajectory(recording, nodes=trajectory.nodes)
        if ratio == 1.0
        else trajectory_in_true_time(recording, ratio)
    )
    for other in others:
        turned = multiply(other, conjugate(first.states[0, attitude]))
        states = first.states[:count].copy()
        states[:, attitude] = multiply(np.broadcast_to(turned, (count, 4)), states[:, attitude])
        found.append(states)
    return found


def part_of(fit: Fit, chosen: Sequence[int]) -> Fit:
    """Return a fit of some of its recordings alone, with the parameters that act in them where they stand."""
    place = {i: k for k, i in enumerate(chosen)}
    kept = [
        (
            j,
            q
            if q.recordings is None
            else replace(q, recordings=frozenset(place[i] for i in q.recordings if i in place)),
        )
        for j, q in enumerate(fit.parameters)
        if any(q.acts_in(i) for i in chosen)
    ]
    columns = [j for j, _ in kept]
    return replace(
        fit,
        trajectories=tuple(fit.trajectories[i] for i in chosen),
        parameters=tuple(q for _, q in kept),
        at=fit.at[columns],
        linears=tuple(fit.linears[i] for i in chosen) if fit.linears else (),
        merit=np.inf,
        covariance=np.empty((0, 0)),
    )


#: sensors without which the motion of a flight can still be followed, with the effect that is their clock
_LED = {sensor: (catalogued(ClockRate, sensor).id, "ratio") for sensor in ("accelerometer", "gyroscope")}
#: clocks that are tried on a motion that the other sensors tell
_CLOCKS_STEP = 1e-4
_CLOCKS_TRIED = 1.0 + _CLOCKS_STEP * np.arange(-300, 301)
#: clocks that are tried by the corners of a rig's rate, within what a free clock may be: a second wide, they move by a
#: hundredth of that in half a minute
_CORNERS_TRIED = 1.0 + 5e-4 * np.arange(-60, 61)
#: a clock that leaves less than this share is tried, and named only if its fit is the best: a bar low enough for 3 s
_WORTH_TRYING = 0.5
#: clocks this far apart at a recording's end, rad, lie in one valley, and no more than so many are passed over
_ALIKE, _FEW_CLOCKS = 0.5, 20


def _led_by_others(fit: Fit) -> Fit:
    """Follow flights that went astray without one sensor: its clock may be wrong, or samples of it lost.

    Its clock is read off the motion that the others tell. Where that reconciles it, all are fitted together; where it
    does not, the motion is left as the others tell it, for a search to find what the sensor has.
    """
    there = {readings.sensor for one in fit.trajectories for readings in one.readings}
    if not fit.plant.follows_path or not _astray(fit):
        return fit
    few = 1e-4 * fit.count
    for sensor, clock in _LED.items():
        if sensor not in there or not (there - {sensor}) & {"magnetometer", "gyroscope"}:
            continue
        some = part_of(fit, _astray(fit)[: CONSISTENCY.few])
        if len(some.trajectories) < len(fit.trajectories) and _astray(_without(some, sensor, few)):
            continue
        led = _without(fit, sensor, few)
        if _astray(led):
            continue
        ratio = _clock_read(led, [one.readings for one in fit.trajectories], sensor, clock)
        trajectories = _with_readings(led, fit)
        free = Parameter(*clock, 1.0, 1e-6, RELAXED_FIT.clock_sigma)
        both = replace(led, trajectories=trajectories, parameters=(*fit.parameters, free), at=np.append(led.at, ratio))
        both = refit(both, iterations=12, tolerance=few)
        return _beside(replace(led, trajectories=trajectories), sensor) if _astray(both) else both
    return fit


def _with_readings(led: Fit, fit: Fit) -> tuple[Trajectory, ...]:
    """Return the motions of a fit that was led by some sensors with the readings of all."""
    pairs = zip(led.trajectories, fit.trajectories, strict=True)
    return tuple(replace(new, recording=old.recording, readings=old.readings) for new, old in pairs)


def _beside(led: Fit, sensor: str) -> Fit:
    """Return a fit that the others lead with a sensor in the noise that this motion leaves of it."""
    linears = linearised(led)
    level = estimate_noise(linears, [linear.residual for linear in linears], coloured=False)[sensor]
    led = replace(led, linears=linears, noise={**led.noise, sensor: level})
    return replace(led, merit=merit_of(led, linears))


#: what else writes into x and y of a gyroscope what goes with the spin
_BY_PULL = tuple((catalogued(GSensitivity, "gyroscope").id, name) for name in ("kx", "ky"))


def _out_of_balance(fit: Fit) -> Fit:
    """Follow free spins as of bodies out of balance where a gyroscope shows that they are.

    The air's force about a centre of mass beside the middle is a moment fixed in the body: its rates lean as the force
    comes and goes, otherwise in each throw, as no error of a gyroscope does. What has moved out so far may move on: the
    pull on the accelerometer is then no measure of the spin, and the motion is left as the others tell it.
    """
    if fit.plant.unbalanced is None or not left_across(fit) > RELAXED_FIT.across:
        return fit
    few, sensor, least = 1e-4 * fit.count, "accelerometer", RELAXED_FIT.reconciled * left_across(fit)
    free = tuple(Parameter(*key, 0.0, 1e-6, 1e-2) for key in _BY_PULL)
    pulled = replace(fit, parameters=(*fit.parameters, *free), at=np.append(fit.at, [0.0, 0.0]))
    if left_across(refit(pulled, iterations=12, tolerance=few)) < least:
        return fit
    led = _without(fit, sensor, few) if _astray(fit) else fit
    moved = unbalanced(led)
    turned = refit(replace(led, trajectories=moved, defects=moved[0].plant.sizes.relaxed), iterations=12, tolerance=few)
    if _astray(turned) or not left_across(turned) < least:
        return fit
    return turned if led is fit else _beside(replace(turned, trajectories=_with_readings(turned, fit)), sensor)


def unbalanced(fit: Fit) -> tuple[Trajectory, ...]:
    """Return the trajectories of a fit as of bodies out of balance."""
    return tuple(replace(one, unbalanced=True) for one in fit.trajectories)


def moves_out(fit: Fit) -> bool:
    """Tell whether what is out of balance in a body moves: its accelerometer is far from the motion of the others."""
    return all(one.unbalanced for one in fit.trajectories) and _misfit(fit, "accelerometer") > RELAXED_FIT.lost


def left_across(fit: Fit) -> float:
    """Return what a fit leaves of a gyroscope's x and y, mean square in its noise; NaN without one."""
    left = [
        linear.residual[c.rows] / fit.noise[c.group].sd
        for linear in fit.linears
        for c in linear.channels
        if c.sensor == "gyroscope" and c.axis[0] in "xy"
    ]
    return float(np.mean(np.concatenate(left) ** 2)) if left else np.nan


def _with_own_clock(fit: Fit) -> Fit:
    """Fit again with a free clock of the gyroscope on a rig where the motion contradicts it and a clock reconciles it.

    A rig's motion is told by others. Half a second off, a sensor's own readings would pass for noise that is slow. An
    accelerometer is left to the search for lost samples, which look like a slow clock.
    """
    sensor, clock = "gyroscope", _LED["gyroscope"]
    before = _misfit(fit, sensor)
    if not before > RELAXED_FIT.lost:
        return fit
    ratio = _clock_read(fit, [one.readings for one in fit.trajectories], sensor, clock)
    free = Parameter(*clock, 1.0, 1e-6, RELAXED_FIT.clock_sigma)
    timed = replace(fit, parameters=(*fit.parameters, free), at=np.append(fit.at, ratio))
    timed = refit(timed, iterations=8, tolerance=1e-4 * fit.count)
    return timed if _misfit(timed, sensor) < RELAXED_FIT.reconciled * before else fit


def clock_of_accelerometer(fit: Fit) -> Effect | None:
    """Return the clock by which the accelerometer on a rig follows the motion that others tell; None without need.

    A rig's rate changes at corners, which a clock that is off by a per cent moves by a third of a second: from there no
    slope leads to it.
    """
    sensor = "accelerometer"
    clock = _LED[sensor]
    if fit.plant.airborne or not _misfit(fit, sensor) > RELAXED_FIT.lost:
        return None

    values = [_ideal(fit.values(i), sensor) for i in range(len(fit.trajectories))]
    misfit = _misfit_by(fit.trajectories, [one.readings for one in fit.trajectories], values, sensor, clock)
    found = {ratio: misfit(ratio) for ratio in _CORNERS_TRIED.tolist()}
    best = min(found, key=lambda ratio: found[ratio])
    return made(clock[0], ratio=best) if found[best] < _WORTH_TRYING * found[1.0] else None


def _ideal(values: Values, sensor: str) -> Values:
    """Return a fit's values without a sensor's own errors: beside a wrong clock they stand for what it does."""
    return {key: v for key, v in values.items() if key[0] not in CATALOGUE or CATALOGUE[key[0]].acts_on != sensor}


def _misfit(fit: Fit, sensor: str) -> float:
    """Return what a fit leaves of a sensor, root mean square in stated deviations; NaN where nothing is stated."""
    left = [
        linear.residual[c.rows] / linear.sd[c.rows]
        for linear in fit.linears
        for c in linear.channels
        if c.sensor == sensor
    ]
    return float(np.sqrt(np.mean(np.concatenate(left) ** 2))) if left else np.nan


def _silenced(recording: Recording, sensor: str) -> Trajectory:
    """Return a recording's first trajectory as if it had not a sensor."""
    samples = {name: own for name, own in recording.samples.items() if name != sensor}
    return first_trajectory(replace(recording, samples=samples), nodes=nodes_of(recording))


def _without(fit: Fit, sensor: str, tolerance: float) -> Fit:
    """Return a fit from the start to recordings as if they had not a sensor."""
    trajectories = tuple(_silenced(one.recording, sensor) for one in fit.trajectories)
    at = np.array([q.stated for q in fit.parameters])
    return refit(replace(fit, trajectories=trajectories, at=at), iterations=12, tolerance=tolerance)


def _clock_read(led: Fit, readings: Sequence[Sequence[Readings]], sensor: str, clock: tuple[str, str]) -> float:
    """Return the clock by which a sensor's readings fit a motion best.

    Between clocks apart by less than a radian at the end of the longest recording the misfit has no other minimum: of
    those tried each is looked at only about the best of a few.
    """
    turned = max(
        float(one.nodes[-1] * np.max(np.abs(one.states[:, one.plant.layout.spin])))
        if one.plant.layout.spin is not None
        else np.inf
        for one in led.trajectories
    )
    apart = int(np.clip(_ALIKE / max(turned * _CLOCKS_STEP, 1e-9), 1, _FEW_CLOCKS))

    values = [led.values(i) for i in range(len(led.trajectories))]
    misfit = _misfit_by(led.trajectories, readings, values, sensor, clock)
    rough = _CLOCKS_TRIED[::apart]
    best = apart * int(np.argmin([misfit(float(ratio)) for ratio in rough]))
    near = _CLOCKS_TRIED[max(best - apart, 0) : best + apart + 1]
    return float(near[int(np.argmin([misfit(float(ratio)) for ratio in near]))])


def _misfit_by(
    motions: Sequence[Trajectory],
    readings: Sequence[Sequence[Readings]],
    values: Sequence[Values],
    sensor: str,
    clock: tuple[str, str],
) -> Callable[[float], float]:
    """Return how far a sensor's readings are from motions under their values, as a function of its clock."""
    every = zip(motions, values, readings, strict=True)
    own = [(one, at, told) for one, at, some in every for told in some if told.sensor == sensor]
    return lambda ratio: sum(_misfit_at(one, told, {**at, clock: ratio}, sensor) for one, at, told in own)


def _misfit_at(one: Trajectory, told: Readings, values: Values, sensor: str) -> float:
    """Return the mean distance of a sensor's readings from a motion under some values."""
    at = told.t - delay(values, sensor, told.t)
    inside = (at > 0.0) & (at < one.nodes[-1])
    left = np.where(told.good, told.value, np.nan)[inside] - shown(one, values, sensor, at[inside])
    left = left[:, np.isfinite(left).any(axis=0)]
    return float(np.nanmean(np.abs(left - np.nanmedian(left, axis=0)))) if left.size else 0.0


def free_clocks(sensors: set[str]) -> tuple[Parameter, ...]:
    """Return the clocks of sensors on board, free within a few per cent."""
    return tuple(
        Parameter(catalogued(ClockRate, sensor).id, "ratio", 1.0, 1e-6, RELAXED_FIT.clock_sigma)
        for sensor in ("magnetometer", "accelerometer", "gyroscope")
        if sensor in sensors
    )


def _with_clocks(fit: Fit) -> Fit:
    """Fit again with free clocks where recordings went astray: their phases may have run away from one another.

    A first look at the beginning, where no phase is off by a turn, gives the clocks; then all of it.
    """
    if not fit.plant.airborne or not _astray(fit):
        return fit
    clocks = free_clocks({readings.sensor for one in fit.trajectories for readings in one.readings})
    parameters = (*fit.parameters, *clocks)
    at = np.array([q.stated for q in parameters])
    free = replace(fit, parameters=parameters, at=at)
    some = part_of(free, _astray(fit)[: CONSISTENCY.few])
    if len(some.trajectories) < len(fit.trajectories) and len(_astray(_first_look(some))) == len(some.trajectories):
        return fit
    look = _first_look(free)
    if len(_astray(look)) == len(look.trajectories):
        return fit
    ratio = look.values(0).get((catalogued(ClockRate, "magnetometer").id, "ratio"), 1.0)
    trajectories = tuple(begun_again(one, ratio) for one in fit.trajectories)
    # what the first look says of the rest is little: only the clocks are taken over
    known = {q.key for q in clocks}
    at = np.array([v if q.key in known else q.stated for q, v in zip(parameters, look.at, strict=True)])
    whole = refit(
        replace(fit, trajectories=trajectories, parameters=parameters, at=at), iterations=12, tolerance=1e-4 * fit.count
    )
    return whole if whole.merit < RELAXED_FIT.rescued * fit.merit else fit


def _first_look(fit: Fit) -> Fit:
    """Return a fit to the beginnings of recordings alone, from the start."""
    short = tuple(beginning(begun_again(one), RELAXED_FIT.first_look) for one in fit.trajectories)
    return refit(replace(fit, trajectories=short), iterations=10)


def without_outliers(fit: Fit) -> tuple[Fit, list[tuple[int, str, str, float, float]]]:
    """Leave out single readings far from everything else, as bad GPS fixes are, and fit again.

    Returns the fit and what was left out: (recording, sensor, axis, time s, standard deviations).
    """
    found: list[tuple[int, str, str, float, float]] = []
    trajectories = []
    for index, (current, linear) in enumerate(zip(fit.trajectories, fit.linears, strict=True)):
        kept = {readings.sensor: readings.good.copy() for readings in current.readings}
        for channel in linear.channels:
            x = linear.residual[channel.rows]
            if x.size < 8:
                continue
            sd = max(float(sd_by_median(x)), 1e-12)
            z = np.abs(x) / sd
            padded = np.concatenate([[0.0], z, [0.0]])
            alone = (z > RELAXED_FIT.outlier) & (
                np.maximum(padded[:-2], padded[2:]) < np.maximum(RELAXED_FIT.neighbour, 0.2 * z)
            )
            if not 0 < np.count_nonzero(alone) <= max(2, RELAXED_FIT.most_outliers * x.size):
                continue
            readings = next(r for r in current.readings if r.sensor == channel.sensor)
            axis = readings.axes.index(channel.axis)
            for k in np.flatnonzero(alone):
                kept[channel.sensor][channel.index[k], axis] = False
                found.append((index, channel.sensor, channel.axis, float(linear.t[channel.rows][k]), float(z[k])))
        trajectories.append(replace(current, readings=tuple(replace(r, good=kept[r.sensor]) for r in current.readings)))
    if not found:
        return fit, found
    return refit(replace(fit, trajectories=tuple(trajectories)), iterations=4, tolerance=1e-4 * fit.count), found
