"""A gyroscope that stands at a full scale of parts. Takes its readings; gives the range to state, and why.

Where a sensor's noise shows, readings at its limit are told by themselves (`discsim.clipping`). A log of whole deg/s
hides the noise, and a rate that stands still at 2000 deg/s passes for a steady motion.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.clipping import step_of
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.magnitudes import PER_DEG_S
from discsim.validation.importing.sniffing.spin_axis import Reading3

__all__ = ["full_scale"]

#: Counts per deg/s as data sheets round them (MPU-6050, ICM-20948, BMI160) and programs divide by.
ROUNDED = (131.0, 131.2, 65.5, 65.6, 32.8, 16.4)
#: What 16 bits span at the counts of usual parts, deg/s: 250 to 4000, 287 to 4587, and 250.14 of 131 counts.
FULL_SCALES = np.array(sorted(2.0**15 / per for per in (*PER_DEG_S, *ROUNDED)))
#: Steps of resolution within which a full scale is met, as of a stated range: 16 bits end a step below it.
MET = 1.5
#: A reading stands at a limit for this long at least, s, and for longer than a free spin takes for a step: the best
#: bearings slow it by 2 % a second (a time constant of 50 s), air by more.
STANDS, SLOWING = 0.1, 0.02
#: A largest rate that does not clip lies anywhere within this share of a full scale; chance below which two ends of
#: motion do not both come to lie at one.
ANYWHERE, NO_CHANCE = 0.1, 1e-3


def full_scale(gyro: Reading3) -> tuple[float, Decision] | None:
    """Return the range (rad/s) at which readings of a gyroscope stand and that none exceeds; None where none is."""
    value = np.degrees(gyro.value)
    size, step = np.abs(value), step_of(value)
    largest = float(np.nanmax(size, initial=0.0))
    near = float(FULL_SCALES[np.argmin(np.abs(FULL_SCALES - largest))])
    if step == 0 or abs(near - largest) > MET * step:
        return None
    why = "a full scale that parts have; "
    if _both_ends(value, near, MET * step):
        why += "readings meet both its ends, and none is beyond"
    else:
        stands = _longest(gyro.t, np.where(np.isfinite(size), size, 0.0) > largest - 0.5 * step)
        if stands < max(STANDS, step / (SLOWING * near)):
            return None
        why += f"readings stand at it for {stands:.2g} s on end, and none is beyond"
    return float(np.radians(near)), Decision("gyroscope range", f"{near:.6g} deg/s", "likely", why)


def _both_ends(value: FloatArray, near: float, within: float) -> bool:
    """Tell whether rates (n, 3) deg/s reach a full scale of either sign, to ``within`` deg/s and not by chance."""
    met = np.nanmax(value, initial=0.0) >= near - within and np.nanmin(value, initial=0.0) <= within - near
    return bool(met) and FULL_SCALES.size * (2.0 * within / (ANYWHERE * near)) ** 2 < NO_CHANCE


def _longest(t: FloatArray, at_top: BoolArray) -> float:
    """Return for how long, s, an axis stands at the largest reading; ``at_top`` (n, 3) tells where."""
    spans = [t[stop - 1] - t[first] for axis in at_top.T for first, stop in runs(axis)]
    return max((float(span) for span in spans if np.isfinite(span)), default=0.0)
