"""Scores of somebody's own recordings: is the spin known, do the methods agree, does C_Nr come out as it did."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.errors import InputError
from discsim.estimators.methods import METHODS, estimate, missing_sensors
from discsim.estimators.rate import YawRate
from discsim.recording import Recording
from discsim.validation.reporting.scores import Score, at_most, score
from discsim.validation.yaw_damping import fit_yaw_damping, observe

__all__ = ["recording_checks"]

#: methods that are held against the one that `best` takes: the paper's two, and what measures the rate itself
HELD = ("fft", "accelerometer", "gyroscope", "rate_reference")
#: a right standard deviation is exceeded threefold once in 370 times
SIGMAS = 3.0


def recording_checks(recordings: Sequence[Recording]) -> list[Score]:
    """Score recordings without a truth.

    Of each: the share of its time that `best` knows, and by how many of their joint standard deviations another method
    disagrees with it (the median over time, which one bad second does not move). Of all flights together: C_Nr against
    the stated one, and by how much the residuals of the path exceed what the sheets state. Raises `InputError` as the
    methods do where none can be used.
    """
    scores = []
    for recording in recordings:
        best = estimate(recording, "best")
        where = f"recordings: {recording.name or 'recording'}"
        share = float(np.mean(np.isfinite(best.rate)))
        scores.append(score(f"{where}, share of time that best knows", share, "1", 1.0, 0.1))
        for method in HELD:
            if method == best.method or method not in METHODS or missing_sensors(recording, method):
                continue
            try:
                other = estimate(recording, method)
            except InputError:  # such as a recording shorter than a window: best says what can be said
                continue
            disagreement = _disagreement(other, best)
            if np.isfinite(disagreement):
                scores.append(at_most(f"{where}, {method} against best", disagreement, "sd", SIGMAS))
    return scores + _damping([recording for recording in recordings if recording.plant == "flight"])


def _disagreement(other: YawRate, best: YawRate) -> float:
    """Return the median difference of two rates in joint standard deviations; NaN where they have nothing in common.

    Of magnitudes where one of the two has no sign.
    """
    middle = best.at(other.t)
    sd = np.interp(other.t, best.t, np.nan_to_num(best.sd, nan=np.inf))
    signed = other.signed and best.signed
    off = other.rate - middle if signed else np.abs(other.rate) - np.abs(middle)
    ratio = off / np.hypot(other.sd, sd)
    known = ratio[np.isfinite(ratio)]
    return float(np.median(known)) if known.size else float("nan")


def _damping(flights: Sequence[Recording]) -> list[Score]:
    """Return the scores of C_Nr; none where the flights state no aerodynamics."""
    if not flights or any(recording.disc is None or recording.disc.aero is None for recording in flights):
        return []
    fit = fit_yaw_damping([observe(recording) for recording in flights])
    disc = flights[0].disc
    assert disc is not None
    assert disc.aero is not None
    stated = float(np.max(disc.sigma.get("CNr", 0.0)))
    return [
        score("recordings: C_Nr", fit.CNr, "1", disc.aero.CNr, SIGMAS * float(np.hypot(fit.sd, stated))),
        # 0.02 where path and sheets agree, 0.32 with one throw of six touched on its way (docs/cnr.md)
        at_most("recordings: residuals of the path over what is stated", fit.path_scale - 1.0, "1", 0.3),
    ]
