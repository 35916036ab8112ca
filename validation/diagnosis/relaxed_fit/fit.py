"""The fit with relaxed continuity: motion that follows the data whatever physics is missing.

Takes recordings; gives a `Fit`. Segments need not be continuous, and each sensor may have any ordinary error, within a
wide prior. So the fit stays beside the truth under any hidden effect (weak-constraint estimation, as in data
assimilation: Tremolet, 2006). It does not tell the effect. It gives a point about which the questions that do are
nearly linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.effects.catalogue import CATALOGUE, Effect
from discsim.effects.setup import TimeOffset
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.followed import true_noise
from discsim.validation.diagnosis.consistency.spin_agreement import Comparison, compared, written_ratios
from discsim.validation.diagnosis.first_trajectory import CLOCK, trajectory_in_true_time, within_range
from discsim.validation.diagnosis.relaxed_fit.astray import from_other_initial_states
from discsim.validation.diagnosis.relaxed_fit.clocks import (
    led_by_other_sensors,
    with_clock_of_gyroscope,
    with_free_clocks,
)
from discsim.validation.diagnosis.relaxed_fit.coarse_steps import as_far_as_steps_tell
from discsim.validation.diagnosis.relaxed_fit.further_steps import STEPS, TOLERANCE, fitted_further
from discsim.validation.diagnosis.relaxed_fit.out_of_balance import followed_out_of_balance
from discsim.validation.diagnosis.relaxed_fit.parameters import relaxed_parameters, supposed_parameters
from discsim.validation.diagnosis.settings import RELAXED_FIT
from discsim.validation.identification.from_afar import fitted_from_afar
from discsim.validation.identification.gauss_newton import Fit, linearised, merit_of, refit
from discsim.validation.identification.noise import estimate_noise, robust_noise, stated_noise
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of

__all__ = ["relaxed"]

#: offsets of one sensor's times, the same all along
_OFFSETS = frozenset(row.id for row in CATALOGUE.values() if row.type is TimeOffset)


# far from the data a motion may run beyond all numbers: such a step is not finite, and is not taken
@np.errstate(over="ignore", invalid="ignore")
def relaxed(
    recordings: Sequence[Recording],
    known: Sequence[Parameter] = (),
    agreeing: Sequence[Sequence[Comparison]] | None = None,
    supposed: Sequence[Effect] = (),
) -> Fit:
    """Fit recordings of one plant so loosely that any effect of ordinary size finds room.

    ``known`` are the numbers that they state, with how well each is known. ``agreeing`` is what their sensors say of
    one another (`compared`), where that was worked out already. ``supposed`` are effects of about the right size that
    the sensors ask for: their numbers are free beside the ordinary errors.
    """
    plant = plant_of(recordings[0])
    ratio = _wrong_time(recordings, agreeing)
    trajectories = tuple(trajectory_in_true_time(one, ratio) for one in recordings)
    sensors = {readings.sensor for one in trajectories for readings in one.readings}
    right = ratio == 1.0 or any(q.key == CLOCK for q in known)
    clock = () if right else (Parameter(*CLOCK, 1.0, 1e-6, RELAXED_FIT.time_sigma),)
    loose = relaxed_parameters(recordings, sensors, free_running=bool(supposed))
    if any(q.group in _OFFSETS for q in known):
        # only differences between the times of sensors show, and the setup has found which one is off
        loose = tuple(q for q in loose if q.group not in _OFFSETS)
    parameters = (*known, *loose, *clock, *supposed_parameters(supposed))
    at = np.array([ratio if q.key == CLOCK else q.stated for q in parameters])
    fit = Fit(trajectories, parameters, at, plant.sizes.relaxed, {})
    bare = linearised(fit, ())
    seen = true_noise([readings for trajectory in trajectories for readings in trajectory.readings])
    fit = replace(fit, noise=stated_noise(bare, {group: level.sd for group, level in seen.items()}))
    if fit.path_alone:
        return fitted_from_afar(fit)
    count = sum(linear.raw.size for linear in bare)
    fit = _reweighted(fit, count) if supposed else fitted_further(fit, count)
    fit = from_other_initial_states(fit if supposed else followed_out_of_balance(fit))
    if not plant.airborne:
        fit = with_clock_of_gyroscope(fit)
    if ratio == 1.0:
        fit = with_free_clocks(led_by_other_sensors(fit))
    left = estimate_noise(fit.linears, [linear.residual for linear in fit.linears], coloured=False)
    trajectories = tuple(
        as_far_as_steps_tell(within_range(trajectory, linear), linear, left)
        for trajectory, linear in zip(fit.trajectories, fit.linears, strict=True)
    )
    fit = replace(fit, trajectories=trajectories)
    linears = linearised(fit)
    return replace(fit, linears=linears, merit=merit_of(fit, linears))


def _wrong_time(recordings: Sequence[Recording], agreeing: Sequence[Sequence[Comparison]] | None) -> float:
    """Return the ratio of written to true time where most recordings say that it is far from 1, else 1."""
    if not plant_of(recordings[0]).airborne:
        return 1.0
    each = compared(recordings, [one.name for one in recordings]) if agreeing is None else agreeing
    ratio = float(np.median(written_ratios(each)))
    return ratio if abs(ratio - 1.0) > RELAXED_FIT.least_wrong else 1.0


#: rounds in which the residuals of a fit weigh the sensors anew, and steps in each but the first
_ROUNDS, _STEPS_OF_ROUND = 3, 5


def _reweighted(fit: Fit, count: int) -> Fit:
    """Fit in rounds, each in the noise that the one before has left, where that is above what is stated.

    Where sensors have many errors, the one with the least noise would otherwise bend the motion towards itself until
    the others are far from it. ``count`` is as in `fitted_further`.
    """
    stated = fit.noise
    for k in range(_ROUNDS):
        fit = refit(fit, iterations=STEPS if k == 0 else _STEPS_OF_ROUND, tolerance=TOLERANCE * count)
        left = robust_noise(fit.linears, [linear.residual for linear in fit.linears])
        fit = replace(fit, noise={g: level if level.sd > stated[g].sd else stated[g] for g, level in left.items()})
    return replace(fit, merit=merit_of(fit, fit.linears))
