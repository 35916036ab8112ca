"""Free spins of bodies out of balance, which moments fixed in the body turn: whether a gyroscope shows that they are.

The air's force about a centre of mass beside the middle is such a moment.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import GSensitivity
from discsim.validation.diagnosis.relaxed_fit.astray import astray
from discsim.validation.diagnosis.relaxed_fit.further_steps import fitted_further
from discsim.validation.diagnosis.relaxed_fit.left_out import fitted_without, in_noise_left, with_all_readings
from discsim.validation.diagnosis.relaxed_fit.sensor_residuals import left_across, misfit
from discsim.validation.diagnosis.settings import RELAXED_FIT
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.segments import Trajectory

__all__ = ["followed_out_of_balance", "moves_out", "unbalanced"]

#: what else adds a part to x and y of a gyroscope that goes with the spin: its sensitivity to acceleration
_G_SENSITIVITY = tuple((catalogued(GSensitivity, "gyroscope").id, name) for name in ("kx", "ky"))


def followed_out_of_balance(fit: Fit) -> Fit:
    """Return the fit of free spins as of bodies out of balance, where a gyroscope shows that they are.

    A moment fixed in the body makes the rates about x and y lean as the air's force comes and goes. It does so
    differently in each throw, as no error of a gyroscope does. What has moved out so far may move on: the centripetal
    acceleration is then no measure of the spin, and the motion is left as the other sensors tell it.
    """
    if fit.plant.unbalanced is None or not left_across(fit) > RELAXED_FIT.across:
        return fit
    sensor, count, wanted = "accelerometer", fit.count, RELAXED_FIT.reconciled * left_across(fit)
    free = tuple(Parameter(*key, 0.0, 1e-6, 1e-2) for key in _G_SENSITIVITY)
    pulled = replace(fit, parameters=(*fit.parameters, *free), at=np.append(fit.at, [0.0, 0.0]))
    if left_across(fitted_further(pulled, count)) < wanted:
        return fit
    led = fitted_without(fit, sensor, count) if astray(fit) else fit
    moved = unbalanced(led)
    turned = fitted_further(replace(led, trajectories=moved, defects=moved[0].plant.sizes.relaxed), count)
    if astray(turned) or not left_across(turned) < wanted:
        return fit
    return turned if led is fit else in_noise_left(replace(turned, trajectories=with_all_readings(turned, fit)), sensor)


def unbalanced(fit: Fit) -> tuple[Trajectory, ...]:
    """Return the trajectories of a fit as of bodies out of balance."""
    return tuple(replace(one, unbalanced=True) for one in fit.trajectories)


def moves_out(fit: Fit) -> bool:
    """Tell whether what is out of balance in a body moves: its accelerometer is far from the motion of the others."""
    return all(one.unbalanced for one in fit.trajectories) and misfit(fit, "accelerometer") > RELAXED_FIT.lost
