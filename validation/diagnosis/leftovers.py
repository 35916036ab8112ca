"""What each recording keeps of its sensors with the numbers that the others have, against what no physics could take.

Takes a fit of effects and what was counted of recordings; gives, per recording and sensor, the rms that its baseline
leaves, that the effects leave with shared numbers from the other recordings, and the pure error: what a motion so
flexible that it knows no physics leaves of the same rows. Where a fit leaves little more than that, what is left is how
well the rows' instants are known, and not a missing effect (lack of fit against pure error: Draper and Smith, "Applied
Regression Analysis", 1998, 2.1).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit
from discsim.validation.diagnosis.candidates.evidence import BOUNDS
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.settings import CONSISTENCY
from discsim.validation.identification.gauss_newton import Fit, reduced_each, refit
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.linearisation import moved
from discsim.validation.identification.noise import GroupNoise, NoiseModel
from discsim.validation.identification.normal_equations import Reduced, common_step, nuisance_step

__all__ = ["heldout_fits", "leftovers_of", "nothing_but_pure_error", "pure_noise"]

#: the axes of a sensor whose pure error is known: the wobble tells nothing of the spin itself
_AXES = {
    "magnetometer": ("x_uT", "y_uT", "z_uT"),
    "gyroscope": ("x_rad_s", "y_rad_s"),
    "accelerometer": ("x_m_s2", "y_m_s2"),
}


def leftovers_of(
    found: Search, set_aside: Sequence[Fit], names: Sequence[str], agreement: Agreement
) -> tuple[Leftover, ...]:
    """Return what each of the recordings (called ``names``) keeps of each sensor.

    ``set_aside`` are the fits of each alone with shared numbers from the others (`heldout_fits`).
    """
    pure = _pure_errors(agreement)
    result = []
    for i, name in enumerate(names):
        for sensor, axes in _AXES.items():
            before = _rms(found.base.fit.linears[i], found.base.residuals[i], sensor, axes)
            after = _rms(set_aside[i].linears[0], set_aside[i].linears[0].residual, sensor, axes)
            if before is not None and after is not None:
                result.append(Leftover(name, sensor, before, after, pure.get((name, sensor))))
    return tuple(result)


def nothing_but_pure_error(left: Sequence[Leftover]) -> bool:
    """Tell whether effects leave little more than pure error, of every sensor on every recording set aside."""
    much = _most_beyond_pure(len({one.recording for one in left}))
    return bool(left) and all(one.pure is not None and one.left <= much * one.pure for one in left)


def _most_beyond_pure(recordings: int) -> float:
    """Return how many times its pure error one of so many recordings may keep by the numbers of the others.

    What those and it do not have in common adds to the square: its own part, and that of a mean over the others, which
    is one over their number (the variance of a prediction: Draper and Smith, 3.1).
    """

    def unshared(others: int) -> float:
        return 1.0 + 1.0 / max(others, 1)

    excess = CONSISTENCY.beyond_pure**2 - 1.0
    return float(np.sqrt(1.0 + excess * unshared(recordings - 1) / unshared(CONSISTENCY.beyond_pure_others)))


def pure_noise(agreement: Agreement, otherwise: NoiseModel) -> dict[str, GroupNoise]:
    """Return the noise that the rows themselves show, white, and ``otherwise`` where nothing tells it.

    It is what a flexible motion leaves of the same rows, over all recordings: no fit of physics enters it.
    """
    levels: dict[str, list[float]] = {}
    for (_, sensor), level in _pure_errors(agreement).items():
        levels.setdefault(sensor, []).append(level)
    found = {group: noise._replace(correlation=0.0) for group, noise in otherwise.items()}
    found.update({s: GroupNoise(float(np.sqrt(np.mean(np.square(some))))) for s, some in levels.items() if s in found})
    return found


def _pure_errors(agreement: Agreement) -> dict[tuple[str, str], float]:
    """Return what a flexible motion leaves of an axis, rms, by recording and sensor."""
    found = {}
    if agreement.own_clock is not None:
        # what is counted there is the size of a complex number
        found.update({(one.recording, "magnetometer"): one.left[1] / 2**0.5 for one in agreement.own_clock.shown})
    if agreement.imu_clock is not None:
        found.update({(one.recording, "gyroscope"): one.left[1] for one in agreement.imu_clock.shown})
    if agreement.settling is not None:
        proofs = agreement.settling.heldout
        found.update({(one.recording, "accelerometer"): one.left_m_s2_after for one in proofs})
    return found


def _rms(linear: Linear, residual: FloatArray, sensor: str, axes: Sequence[str]) -> float | None:
    """Return the rms of residuals (n,) of some axes of a sensor, None where there are none."""
    some = [residual[c.rows] for c in linear.channels if c.sensor == sensor and c.axis in axes]
    return float(np.sqrt(np.mean(np.concatenate(some) ** 2))) if some else None


#: steps of a recording's own unknowns with shared numbers as the others have them: algebra begins them near their end
_STEPS = 6
#: what holds a shared number where the others have it, as a share of the step by which its slopes are taken
_FIXED = 1e-3


def heldout_fits(fitted: ContinuousFit) -> list[Fit]:
    """Return fits of each recording alone, what it shares fixed as the others have it, its own unknowns free."""
    fit = fitted.fit
    reduced = reduced_each(fit)
    total = np.sum([r.gram for r in reduced], axis=0)
    result = []
    for i, own in enumerate(reduced):
        step = common_step(total - own.gram, fit.parameters, fit.at)[0]
        alone = np.array([q.recordings == frozenset([i]) for q in fit.parameters], dtype=bool)
        step[alone] = _own_step(own, step, alone, fit)
        start = moved(fit.trajectories[i], fit.linears[i], nuisance_step(own, step), step)
        begun = replace(fit, at=fit.at + step).part([i])
        parameters = tuple(
            q if q.recordings is not None else replace(q, stated=float(value), sigma=_FIXED * q.step, offsets=())
            for q, value in zip(begun.parameters, begun.at, strict=True)
        )
        begun = replace(begun, parameters=parameters, trajectories=(start,), linears=())
        result.append(refit(begun, iterations=_STEPS, bounds=BOUNDS))
    return result


def _own_step(reduced: Reduced, step: FloatArray, alone: BoolArray, fit: Fit) -> FloatArray:
    """Return the step of what is a recording's alone (a,), that of what it shares being as it is in ``step`` (p,)."""
    G = reduced.gram
    prior = np.array([q.precision for q in fit.parameters])[alone]
    off = np.array([q.stated for q in fit.parameters])[alone] - fit.at[alone]
    H = G[:-1, :-1][np.ix_(alone, alone)] + np.diag(prior)
    right = G[:-1, -1][alone] + prior * off - G[:-1, :-1][np.ix_(alone, ~alone)] @ step[~alone]
    return np.asarray(np.linalg.lstsq(H, right, rcond=1e-12)[0])
