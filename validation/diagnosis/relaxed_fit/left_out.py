"""One sensor left out of a fit: the others tell the motion, and its readings are judged by that.

In a fit to all sensors one that is wrong would bend the motion towards itself.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.recording import Recording
from discsim.validation.diagnosis.first_trajectory import first_trajectory, nodes_of
from discsim.validation.diagnosis.relaxed_fit.further_steps import fitted_further
from discsim.validation.identification.gauss_newton import Fit, linearised, merit_of
from discsim.validation.identification.noise import estimate_noise
from discsim.validation.identification.segments import Trajectory

__all__ = ["fitted_without", "in_noise_left", "with_all_readings"]


def fitted_without(fit: Fit, sensor: str, count: int) -> Fit:
    """Return a fit, begun anew from the data, to recordings as if they had no such sensor.

    ``count`` is as in `fitted_further`.
    """
    trajectories = tuple(_trajectory_without(one.recording, sensor) for one in fit.trajectories)
    at = np.array([q.stated for q in fit.parameters])
    return fitted_further(replace(fit, trajectories=trajectories, at=at), count)


def _trajectory_without(recording: Recording, sensor: str) -> Trajectory:
    """Return a recording's first trajectory as if it had no such sensor."""
    samples = {name: own for name, own in recording.samples.items() if name != sensor}
    return first_trajectory(replace(recording, samples=samples), nodes=nodes_of(recording))


def with_all_readings(led: Fit, fit: Fit) -> tuple[Trajectory, ...]:
    """Return the trajectories of a fit ``led`` by some sensors, with the readings of all sensors of another fit."""
    pairs = zip(led.trajectories, fit.trajectories, strict=True)
    return tuple(replace(new, recording=old.recording, readings=old.readings) for new, old in pairs)


def in_noise_left(led: Fit, sensor: str) -> Fit:
    """Return a fit ``led`` by the other sensors, with one in the noise that its residuals about that motion show.

    The motion stays as it is.
    """
    linears = linearised(led)
    level = estimate_noise(linears, [linear.residual for linear in linears], coloured=False)[sensor]
    led = replace(led, linears=linears, noise={**led.noise, sensor: level})
    return replace(led, merit=merit_of(led, linears))
