"""Searches for effects that one linear question about whole recordings does not find: events, gusts, ripples, slips.

Each returns proposals with values to start from; fits with all parameters free decide.
"""

from __future__ import annotations

from collections.abc import Sequence

from validation.diagnosis.detectors.dropped_samples import Shifted, dropped_accelerometer
from validation.diagnosis.detectors.events import events
from validation.diagnosis.detectors.gusts import gusts
from validation.diagnosis.detectors.local_problem import asked_of
from validation.diagnosis.detectors.saturation import saturation
from validation.diagnosis.detectors.speed_ripple import ripple
from validation.diagnosis.detectors.time_offsets import time_offsets
from validation.diagnosis.selection.constrained_fit import Tied
from validation.diagnosis.selection.proposals import Proposal
from validation.diagnosis.settings import DETECTORS
from validation.identification.gauss_newton import Fit
from validation.identification.noise import NoiseModel
from validation.identification.parameters import Parameter

__all__ = ["searched"]


# ---------------------------------------------------------------------------------------------------- all of it


def searched(
    loose: Fit,
    tied: Tied,
    own: Sequence[Parameter],
    noise: NoiseModel,
    lost: Sequence[Shifted] = (),
    least: float = DETECTORS.least,
) -> list[Proposal | Shifted]:
    """Return what all searches propose upon a hypothesis, best first.

    ``loose`` is the relaxed fit with its ``noise``, ``tied`` the fit under the hypothesis so far, ``own`` the stated
    parameters and each recording's unknowns, ``lost`` the magnetometer's lost samples as its phase tells them. Without
    a hypothesis what is missing may have bent the tied fit, and events are looked for from the relaxed one.
    """
    taken = tied.hypothesis.trials
    fit, level = (loose, noise) if not taken else (tied.fit, tied.fit.noise)
    found: list[Proposal | Shifted] = []
    if not loose.plant.commanded:
        asked = asked_of(fit, level, own, tied.hypothesis)
        found += events(asked, least)
        found += gusts(asked, least)
    found += ripple(tied.fit, tied.fit.noise, taken, least)
    found += lost
    found += saturation(tied.fit, tied.fit.noise, taken)
    found += time_offsets(tied.fit, tied.fit.noise, taken)
    if loose.plant.path_known:  # else an accelerometer counts by its means over turns
        found += dropped_accelerometer(loose, noise, taken)
    return sorted(found, key=lambda p: p.proposal.gain if isinstance(p, Shifted) else p.gain, reverse=True)
