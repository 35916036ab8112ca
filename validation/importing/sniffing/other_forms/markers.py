"""The middle that markers on a spinning disc turn about. Takes their places; gives its path.

A marker on the rim circles about the disc's centre by metres a second. Markers that keep their distances are one body:
each frame tells its turn (Kabsch, Acta Crystallographica A32:922, 1976), and the point of the body whose path bends
least, as that of the centre of mass does, is where it spins about.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import nearest_rotations

__all__ = ["Middle", "middle_of"]

#: Frames in which all markers were seen, without which no body is told.
_FRAMES = 12
#: Markers of one body keep their distances to this share: cameras see a disc's to some tenths of a millimetre of 10 cm.
_RIGID = 0.03
#: Singular values below this share of the largest tell nothing: of the place along the axis of the spin no path does.
_TOLD = 0.05


class Middle(NamedTuple):
    """The path (n, 3) of the middle, NaN where fewer than three markers were seen, and how far the first one is off."""

    path: FloatArray
    arm: float


def middle_of(places: FloatArray) -> Middle | None:
    """Return the middle that markers (n frames, m, 3) turn about, in their unit; None where they are no one body."""
    whole = np.isfinite(places).all(axis=(1, 2))
    if places.shape[1] < 3 or np.count_nonzero(whole) < _FRAMES:
        return None
    apart = np.linalg.norm(places[whole][:, :, None] - places[whole][:, None], axis=-1)
    mean = apart.mean(axis=0)
    if np.any(apart.std(axis=0) > _RIGID * max(float(mean.max()), np.finfo(float).tiny)):
        return None
    body = places[np.argmax(whole)]
    turns = np.full((len(places), 3, 3), np.nan)
    origins = np.full((len(places), 3), np.nan)
    for k, frame in enumerate(places):
        seen = np.isfinite(frame).all(axis=1)
        if np.count_nonzero(seen) > 2:
            own = body[seen].mean(axis=0)
            turns[k] = nearest_rotations((frame[seen] - frame[seen].mean(axis=0)).T @ (body[seen] - own))
            origins[k] = frame[seen].mean(axis=0) - turns[k] @ own
    bends = np.diff(turns, 2, axis=0)
    told = np.isfinite(bends).all(axis=(1, 2))
    centre = body.mean(axis=0)
    left = np.diff(origins, 2, axis=0)[told] + bends[told] @ centre
    off = np.linalg.lstsq(bends[told].reshape(-1, 3), -left.reshape(-1), rcond=_TOLD)[0]
    middle = centre + off
    return Middle(origins + turns @ middle, float(np.linalg.norm(body[0] - middle)))
