"""Recordings that were cut out of a log imprecisely: a hand at a throw's beginning, the ground at its end, a spin-up.

Takes a recording; gives the free part of it, with time from there, and what was cut. The rule is the one by which
throws are found in a long log: over 0.1 s no air force changes the spin by twice its size per second, a hand that
spins a disc up, catches or drops it does. A rig that runs down is slower from then on: what comes before its fastest
is the spin-up.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.signal import savgol_filter

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.recording import Recording, Samples

__all__ = ["CHANGE", "HALF", "SHORTEST", "ThrowCut", "coasting_part", "free_part"]

#: Between half (the fastest decay on record, a rocket's roll: 0.56 1/s) and ten (4000 deg/s out of a hand in 0.1 s).
CHANGE = 2.0
#: Half of what the slope is taken over, s: a hand lets go within 0.1 s.
HALF = 0.05
#: A drop from knee height takes so long, s.
SHORTEST = 0.3

#: what is kept begins and ends where the spin changes by less than this, 1/s, twice the fastest decay: a slow hand is
#: told late
_SURE = 1.0
#: a disc in the air keeps more than this share of its usual spin: at a decay of 0.56 1/s, the fastest on record, a
#: throw whose middle has the usual spin keeps half of it for 1.2 s more
_SLOW = 0.5
#: what is cut off holds less free motion than this, s: a throw that a touch has parted in two is left whole
_FREE = 0.1
#: ... and its spin leaves that of the throw by more than this share of it: noise and wobble do not, a hand does
_OTHER = 0.1
#: a rig was spun up where it begins below this share of its fastest (no knock doubles a spin), and coasts once it is
#: below the second for good:
#: a motor holds a rate to a hundredth
_BEGUN, _COASTS = 0.5, 0.99
#: fewest rows of a window that tells a slope
_FEWEST = 5


@dataclass(frozen=True)
class ThrowCut:
    """The free part of a recording, and the time (s) cut off before and after it."""

    recording: Recording
    before: float = 0.0
    after: float = 0.0


def free_part(recording: Recording) -> ThrowCut:
    """Return the part of a throw in which nothing but the air holds the disc, by its gyroscope; time zero is its start.

    Nothing is cut without a gyroscope, or where no part of 0.3 s is free.
    """
    gyroscope = recording.get("gyroscope")
    seen = None if gyroscope is None else _spin(gyroscope)
    if seen is None:
        return ThrowCut(recording)
    t, spin = seen
    free = _free(t, spin, CHANGE)
    first, stop = max(runs(free), key=lambda run: run[1] - run[0], default=(0, 0))
    if stop <= first or t[stop - 1] - t[first] < SHORTEST:
        return ThrowCut(recording)
    sure = first + np.flatnonzero(_free(t, spin, _SURE)[first:stop])
    if sure.size == 0:
        return ThrowCut(recording)
    start = float(t[sure[0]]) if _held(t, spin, free, slice(0, first), first) else None
    end = float(t[sure[-1]]) if _held(t, spin, free, slice(stop, t.size), stop - 1) else None
    if start is None and end is None:
        return ThrowCut(recording)
    before = 0.0 if start is None else start - float(t[0])
    after = 0.0 if end is None else float(t[-1]) - end
    return ThrowCut(_between(recording, start, end), before, after)


def coasting_part(recording: Recording) -> ThrowCut:
    """Return the part of a rig's run in which nothing drives it, by its reference or gyroscope; time zero is its start.

    Nothing is cut where it begins near its fastest, or where no sensor in its range shows it.
    """
    seen = _run(recording)
    if seen is None:
        return ThrowCut(recording)
    t, spin = seen
    fastest = float(np.max(spin))
    if spin[0] > _BEGUN * fastest:
        return ThrowCut(recording)
    start = float(t[np.flatnonzero(spin >= _COASTS * fastest)[-1]])
    if t[-1] - start < SHORTEST:
        return ThrowCut(recording)
    return ThrowCut(_between(recording, start, None), start - float(t[0]))


def _run(recording: Recording) -> tuple[FloatArray, FloatArray] | None:
    """Return times (n,) s and sizes (n,) of the spin of a rig, rad/s, without noise; None where nothing shows it."""
    reference, gyroscope = recording.get("rate_reference"), recording.get("gyroscope")
    if reference is not None:
        seen = _spin(Samples(reference.t, reference.value.reshape(len(reference), -1)))
    elif gyroscope is not None and not np.any(recording.sheets["gyroscope"].clipped(gyroscope.value)):
        seen = _spin(gyroscope)
    else:
        seen = None
    if seen is None:
        return None
    t, spin = seen
    wide = max(_FEWEST, round(2.0 * HALF / float(np.median(np.diff(t)))))
    return t, np.asarray(uniform_filter1d(np.abs(spin), wide, mode="nearest"))


def _between(recording: Recording, start: float | None, end: float | None) -> Recording:
    """Return what a recording holds from ``start`` to ``end``, s, time counting from there; None: its own end."""
    zero = start or 0.0
    samples = {
        sensor: Samples(cut.t - zero, cut.value)
        for sensor, one in recording.samples.items()
        for cut in [one.between(-np.inf if start is None else start, np.inf if end is None else end)]
    }
    return replace(recording, samples=samples)


def _spin(gyroscope: Samples) -> tuple[FloatArray, FloatArray] | None:
    """Return times (n,) s and rates (n,) rad/s about the axis that turns fastest; None of too few readings."""
    usual = [float(np.nanmedian(np.abs(axis))) if np.isfinite(axis).any() else 0.0 for axis in gyroscope.value.T]
    rate = gyroscope.value[:, int(np.argmax(usual))]
    sound = np.isfinite(rate)
    if np.count_nonzero(sound) <= 2 * _FEWEST:
        return None
    return gyroscope.t[sound], median_filter(rate[sound], 3, mode="nearest")  # no single reading that is astray


def _free(t: FloatArray, spin: FloatArray, change: float) -> BoolArray:
    """Tell in which rows (n,) the spin changes by less than so much of itself per second, as of a disc in the air."""
    spacing = float(np.median(np.diff(t)))
    wide = min(max(_FEWEST, round(2.0 * HALF / spacing) | 1), (t.size - 1) | 1)
    slope = savgol_filter(spin, wide, 1, deriv=1, delta=spacing, mode="interp")
    size = np.abs(spin)
    return np.asarray((np.abs(slope) < change * size) & (size > _SLOW * np.median(size)))


def _held(t: FloatArray, spin: FloatArray, free: BoolArray, part: slice, beside: int) -> bool:
    """Tell whether in a part of the rows the disc was not free; ``beside`` is the row of the throw next to it."""
    if part.stop <= part.start:
        return False
    loose = np.count_nonzero(free[part]) * float(np.median(np.diff(t)))
    other = np.max(np.abs(spin[part] - spin[beside])) > _OTHER * abs(spin[beside])
    return bool(loose < _FREE and other)
