"""The axis of the spin where a gyroscope clips: by the pull towards it, which grows with the square of the rate.

Takes recordings of one board; gives the axis in written columns. Of three rates that clip about one axis the two others
tell the direction of the spin but for one number x, u ~ (rates over one of them, x). Over recordings and windows the
accelerometer reads a = g^2 s + rest, g being a rate that never clips. What of s is across u is the pull, of length
d |u|^2 at a distance d from the axis (Eq. 12 of the paper): so much is |u|^2, and x with it. Lift is along u and takes
no part. That s is nearly across u tells the sign of x.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import Recording
from discsim.validation.diagnosis.signals.spin_signals import averages, mean_readings, usable

__all__ = ["OFF_AXIS", "axis_by_pull", "pointing_out"]

#: windows' spacing and width (one sigma), s, and what is left out at either end
_SPACING, _WIDTH, _ENDS = 0.1, 0.1, 0.3
#: a rate is known in a recording where this share of its readings is below the limit, and never clips where it is known
#: in all
_KNOWN = 0.9
#: an accelerometer nearer to the axis than this, m, shows no pull
OFF_AXIS = 2e-3
#: what never clips is a share of the spin, and no wobble, from this share of the limit on
_LEAST = 0.1
#: by how much, as a share, the square of the rate must change for the pull to be told from lift
_CHANGES = 0.1
#: steps to the number that agrees with the length of the pull, which take a few
_STEPS = 20


def axis_by_pull(recordings: Sequence[Recording]) -> FloatArray | None:
    """Return the axis (3,) of unit length about which a board spins; its larger part is positive. None where untold.

    The gyroscope must clip about one axis, and the accelerometer's place be stated.
    """
    sheet = recordings[0].sheets.get("accelerometer")
    place = None if sheet is None else sheet.position
    windows = [found for recording in recordings if (found := _windows(recording)) is not None]
    if place is None or np.hypot(*place[:2]) < OFF_AXIS or not windows:
        return None
    rate, force = (np.vstack(parts) for parts in zip(*windows, strict=True))
    known = np.isfinite(rate)
    always = [k for k in range(3) if known[:, k].all()]
    never = [k for k in range(3) if not known[:, k].any()]
    if not always or len(never) != 1:
        return None
    (clipped,) = never
    sure = max(always, key=lambda k: float(np.mean(np.abs(rate[:, k]))))
    square = rate[:, sure] ** 2
    limit = recordings[0].sheets["gyroscope"].range
    if limit is None or float(np.sqrt(np.min(square))) < _LEAST * limit:
        return None
    if float(np.ptp(square)) < _CHANGES * float(np.max(square)):
        return None
    u = np.array([np.nanmedian(rate[:, k] / rate[:, sure]) if k != clipped else 0.0 for k in range(3)])
    s = np.linalg.lstsq(np.column_stack([square, np.ones(square.size)]), force, rcond=None)[0][0]
    u[clipped] = -float(u @ s) / float(s[clipped])
    others = float(np.sum(np.delete(u, clipped) ** 2))
    for _ in range(_STEPS):
        across = s - (s @ u) / (u @ u) * u
        rest = float(np.linalg.norm(across) / np.hypot(*place[:2])) - others
        if rest <= 0.0:
            return None
        u[clipped] = np.copysign(np.sqrt(rest), u[clipped])
    if abs(u[clipped]) * float(np.min(np.abs(rate[:, sure]))) < _KNOWN * limit:
        return None  # it would not clip
    return pointing_out(u / np.linalg.norm(u))


def pointing_out(axis: FloatArray) -> FloatArray:
    """Return the one of an axis (3,) and its opposite of which the larger part is positive."""
    return np.asarray(axis * np.sign(axis[int(np.argmax(np.abs(axis)))]))


def _windows(recording: Recording) -> tuple[FloatArray, FloatArray] | None:
    """Return mean rates (m, 3) rad/s, NaN about axes that clip, and readings of the accelerometer (m, 3) m/s^2."""
    turned, felt = usable(recording, "gyroscope"), usable(recording, "accelerometer")
    if turned is None or felt is None:
        return None
    (t, w), (t_felt, f) = turned, felt
    grid = np.arange(max(t[0], t_felt[0]) + _ENDS, min(t[-1], t_felt[-1]) - _ENDS, _SPACING)
    if grid.size == 0:
        return None
    rate = np.full((grid.size, 3), np.nan)
    for k in range(3):
        good = np.isfinite(w[:, k])
        if np.mean(good) > _KNOWN:
            rate[:, k] = np.real(averages(t[good], w[good, k], grid, _WIDTH))
    force = mean_readings(t_felt, f, grid, _WIDTH)
    sound = np.all(np.isfinite(force), axis=1)
    return rate[sound], force[sound]
