"""All detectors in turn: events, gusts, ripples, dropped samples, clipping, offsets of time.

Takes a fit and what was found so far; gives candidates with values to start from. Fits with all parameters free decide.
"""

from __future__ import annotations

from collections.abc import Sequence

from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.diagnosis.detectors.dropped_samples import Shifted
from discsim.validation.diagnosis.detectors.events import events
from discsim.validation.diagnosis.detectors.gusts import gusts
from discsim.validation.diagnosis.detectors.local_problem import local_problems
from discsim.validation.diagnosis.detectors.saturation import saturation
from discsim.validation.diagnosis.detectors.speed_ripple import ripple
from discsim.validation.diagnosis.detectors.time_offsets import time_offsets
from discsim.validation.diagnosis.settings import DETECTORS
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.parameters import Parameter

__all__ = ["searched"]


# ---------------------------------------------------------------------------------------------------- all of it


def searched(
    relaxed_fit: Fit,
    fitted: ContinuousFit,
    own: Sequence[Parameter],
    noise: NoiseModel,
    lost: Sequence[Shifted] = (),
    least: float = DETECTORS.least,
) -> list[ScreenedCandidate | Shifted]:
    """Return what all searches propose upon a hypothesis, best first.

    ``relaxed_fit`` is the relaxed fit with its ``noise``, ``fitted`` the fit under the hypothesis so far, ``own`` the
    stated parameters and each recording's unknowns, ``lost`` what sensors lost as the relaxed fit tells it.
    Without a hypothesis what is missing may have bent the continuous fit, and events are looked for from the relaxed
    one.
    """
    taken = fitted.hypothesis.candidates
    fit, level = (relaxed_fit, noise) if not taken else (fitted.fit, fitted.fit.noise)
    found: list[ScreenedCandidate | Shifted] = []
    if not relaxed_fit.plant.commanded:
        problems = local_problems(fit, level, own, fitted.hypothesis)
        found += events(problems, least)
        found += gusts(problems, least)
    found += ripple(fitted.fit, fitted.fit.noise, taken, least)
    present = {candidate.id for candidate in taken}
    found += [item for item in lost if item.screened.candidate.id not in present]
    found += saturation(fitted.fit, fitted.fit.noise, taken)
    found += time_offsets(fitted.fit, fitted.fit.noise, taken)
    return sorted(found, key=lambda p: p.screened.gain if isinstance(p, Shifted) else p.gain, reverse=True)
