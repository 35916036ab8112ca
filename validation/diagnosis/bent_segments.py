"""Segments in which the moment of the air bends: where a search leaves such, it is asked anew with them in halves.

Takes a search of recordings whose nuisances are straight in time within a segment; gives their relaxed fit with nodes
where that is not enough. A disc crosses bends of its coefficients within some hundredths of a second, more often where
it wobbles, and what a segment then leaves passes for an error of a sensor or for physics that nobody knows.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.validation.diagnosis.candidates.evidence import BOUNDS
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.identification.gauss_newton import Fit, refit

__all__ = ["with_bends_followed"]

#: what a segment's readings must gain in chi-squared by its halves, for five numbers more: 285 segments of five sound
#: sets of throws gained 14 at most, those in which a table's corner is crossed 50 to 280
_BENT = 25.0
#: no segment is halved that is shorter, s: about a turn, so that a touch or a step of a few milliseconds is no bend
_SHORTEST = 0.09
#: steps of the fit that is asked, and of the relaxed fit with new nodes
_STEPS = 8


def with_bends_followed(found: Search, followed: Fit) -> Fit | None:
    """Return a relaxed fit with segments halved where the search's best fit gains by it; None where none does."""
    final = found.final.fit
    halved = final.cut_at([np.union1d(one.nodes, _middles(one.nodes)) for one in final.trajectories])
    fine = refit(halved, iterations=_STEPS, bounds=BOUNDS)
    if not np.isfinite(fine.merit):
        return None
    bent = [_gains(final, fine, i) > _BENT for i in range(len(final.trajectories))]
    if not any(np.any(some) for some in bent):
        return None
    new = [_middles(one.nodes, some) for one, some in zip(final.trajectories, bent, strict=True)]
    again = followed.cut_at(
        [np.union1d(one.nodes, nodes) for one, nodes in zip(followed.trajectories, new, strict=True)]
    )
    count = sum(r.good.sum() for one in again.trajectories for r in one.readings)
    return refit(again, iterations=_STEPS, tolerance=1e-4 * count)


def _middles(nodes: FloatArray, some: BoolArray | bool = True) -> FloatArray:
    """Return the middles of some of the segments between nodes (k + 1,), by default of all, but of no short ones."""
    middles = 0.5 * (nodes[1:] + nodes[:-1])
    return np.asarray(middles[some & (np.diff(nodes) > _SHORTEST)])


def _gains(final: Fit, fine: Fit, recording: int) -> FloatArray:
    """Return what the readings of each segment (k,) gain in chi-squared; means over turns belong to none.

    Each fit leaves out what its own lag has not forgotten, and what its own motion says is clipped: readings that one
    of them lacks gain nothing.
    """
    before, after = final.linears[recording], fine.linears[recording]
    others = {(channel.sensor, channel.axis): channel for channel in after.channels}
    nodes = final.trajectories[recording].nodes
    gains = np.zeros(nodes.size - 1)
    for channel in before.channels:
        other = others.get((channel.sensor, channel.axis))
        if channel.worth > 1.0 or other is None:
            continue
        _, own, same = np.intersect1d(channel.index, other.index, return_indices=True)
        left = before.residual[channel.rows][own], after.residual[other.rows][same]
        squares = (left[0] ** 2 - left[1] ** 2) / final.noise[channel.group].sd ** 2
        segment = np.clip(np.searchsorted(nodes, before.t[channel.rows][own], side="right") - 1, 0, gains.size - 1)
        np.add.at(gains, segment, squares)
    return gains
