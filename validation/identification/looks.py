"""Where the segments of a trajectory are looked at: which readings of which sensor fall into each, at which instants.

Takes the instants at which sensors show a motion, with the segment of each; gives them segment by segment.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, IntArray

__all__ = ["Look", "looks_at", "of_each"]


class Look(NamedTuple):
    """Where a segment is looked at: readings of each sensor in it (m,), their places (n,) in its instants (k,), s."""

    own: list[IntArray]
    place: IntArray
    out: FloatArray


def looks_at(instants: Sequence[FloatArray], segment_of: Sequence[IntArray], count: int) -> list[Look]:
    """Return where each of so many segments is looked at; instants that sensors of one board share stand once."""
    out, place = np.unique(np.concatenate([np.empty(0), *instants]), return_inverse=True)
    everyone = np.concatenate([np.empty(0, dtype=np.int64), *segment_of])
    # later segments hold later instants
    segment = np.empty(out.size, dtype=np.int64)
    segment[place] = everyone
    firsts = np.searchsorted(segment, np.arange(count + 1))
    places = [place[a:b] for a, b in pairwise(np.cumsum([0, *(t.size for t in instants)]))]
    parts = [of_each(segment, count) for segment in segment_of]
    looks = []
    for i in range(count):
        own = [part[i] for part in parts]
        mine = [there[o] - firsts[i] for there, o in zip(places, own, strict=True)]
        looks.append(Look(own, np.concatenate([np.empty(0, dtype=np.int64), *mine]), out[firsts[i] : firsts[i + 1]]))
    return looks


def of_each(segment: IntArray, count: int) -> list[IntArray]:
    """Return the places (m,) of what lies in each of so many segments, in order."""
    order = np.argsort(segment, kind="stable")
    return np.split(order, np.searchsorted(segment[order], np.arange(1, count)))
