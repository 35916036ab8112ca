"""What each recording keeps of its sensors with the numbers that the others have, against what no physics could take.

Takes a fit of effects and what was counted of recordings; gives, per recording and sensor, the rms that its baseline
leaves, that the effects leave with shared numbers from the other recordings, and the pure error: what a motion so
flexible that it knows no physics leaves of the same rows. Where a fit leaves little more than that, what is left is how
well the rows' instants are known, and not a missing effect (lack of fit against pure error: Draper and Smith, "Applied
Regression Analysis", 1998, 2.1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement
from discsim.validation.diagnosis.selection.continuous_fit import ContinuousFit
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.settings import CONSISTENCY
from discsim.validation.identification.gauss_newton import mapped
from discsim.validation.identification.noise import GroupNoise, NoiseModel
from discsim.validation.identification.normal_equations import Reduced, common_step, nuisance_step, reduce
from discsim.validation.identification.parameters import Parameter

__all__ = ["heldout_residuals", "leftovers_of", "nothing_but_pure_error", "pure_noise"]

#: the axes of a sensor whose pure error is known: the wobble tells nothing of the spin itself
_AXES = {
    "magnetometer": ("x_uT", "y_uT", "z_uT"),
    "gyroscope": ("x_rad_s", "y_rad_s"),
    "accelerometer": ("x_m_s2", "y_m_s2"),
}


def leftovers_of(found: Search, names: Sequence[str], agreement: Agreement) -> tuple[Leftover, ...]:
    """Return what each of the recordings (called ``names``) keeps of each sensor, shared numbers from the others."""
    final = found.final
    pure = _pure_errors(agreement)
    heldout = heldout_residuals(final)
    result = []
    for i, name in enumerate(names):
        for sensor, axes in _AXES.items():
            before = _rms(found.base, i, found.base.residuals[i], sensor, axes)
            after = _rms(final, i, heldout[i], sensor, axes)
            if before is not None and after is not None:
                result.append(Leftover(name, sensor, before, after, pure.get((name, sensor))))
    return tuple(result)


def nothing_but_pure_error(left: Sequence[Leftover]) -> bool:
    """Tell whether effects leave little more than pure error, of every sensor on every recording set aside."""
    much = CONSISTENCY.beyond_pure
    return bool(left) and all(one.pure is not None and one.left <= much * one.pure for one in left)


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


def _rms(fitted: ContinuousFit, i: int, residual: FloatArray, sensor: str, axes: Sequence[str]) -> float | None:
    """Return the rms of residuals (n,) of some axes of a sensor, None where there are none."""
    some = [residual[c.rows] for c in fitted.fit.linears[i].channels if c.sensor == sensor and c.axis in axes]
    return float(np.sqrt(np.mean(np.concatenate(some) ** 2))) if some else None


def heldout_residuals(fitted: ContinuousFit) -> list[FloatArray]:
    """Return residuals (n,) of each recording, what it shares from the others and its own unknowns from itself."""
    fit = fitted.fit
    reduced = mapped(
        lambda linear, trajectory: reduce(linear, trajectory, fit.noise, fit.defects), fit.linears, fit.trajectories
    )
    total = np.sum([r.gram for r in reduced], axis=0)
    result = []
    for i, (linear, own) in enumerate(zip(fit.linears, reduced, strict=True)):
        step = common_step(total - own.gram, fit.parameters, fit.at)[0]
        alone = np.array([q.recordings == frozenset([i]) for q in fit.parameters], dtype=bool)
        step[alone] = _own_step(own, step, alone, fit.parameters, fit.at)
        result.append(linear.after(nuisance_step(own, step), step))
    return result


def _own_step(
    reduced: Reduced, step: FloatArray, alone: BoolArray, parameters: Sequence[Parameter], at: FloatArray
) -> FloatArray:
    """Return the step of what is a recording's alone (a,), that of what it shares being as it is in ``step`` (p,)."""
    G = reduced.gram
    prior = np.array([q.precision for q in parameters])[alone]
    off = np.array([q.stated for q in parameters])[alone] - at[alone]
    H = G[:-1, :-1][np.ix_(alone, alone)] + np.diag(prior)
    right = G[:-1, -1][alone] + prior * off - G[:-1, :-1][np.ix_(alone, ~alone)] @ step[~alone]
    return np.asarray(np.linalg.lstsq(H, right, rcond=1e-12)[0])
