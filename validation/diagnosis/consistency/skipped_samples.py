"""Samples that a logger's loop must skip: the pattern by which a part that free-runs shows beside a slower loop.

Takes which of a part's samples each row shows; gives the loop beside which no row shows a sample that it cannot. A loop
that is slower than the part skips a sample whenever it falls a whole period behind, at even distances, and no row ever
shows one of those: what looks like a lost row there is none. Rows that are lost at random show every sample alike.
The evidence is Bayes': the likelihood is averaged over all loops and phases that a sheet's rate allows, which charges
for having looked at so many.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlogy

from discsim.arrays import FloatArray, IntArray

__all__ = ["OFF", "Loop", "loop_beside"]

#: share of rows whose sample was miscounted
_MISCOUNTED = 0.005
#: how far a loop may be from its stated rate, and by how much slower than the part it must be to be told from it
OFF, _SLOWER = 0.02, 0.01
#: loops and phases that are tried: a loop of the next may shift by so many samples at the recording's end
_APART, _PHASES = 0.04, 150


class Loop(NamedTuple):
    """The likeliest step of a logger's loop, s, and twice the log of what loops are likelier than lost rows alone."""

    step_s: float
    gain: float


def loop_beside(newest: IntArray, period: float, stated: float) -> Loop | None:
    """Return the loop beside a part of some ``period``, s, whose samples ``newest`` (n,) rows show.

    The loop's step is ``stated`` to within its oscillator's error, s. None where none would be slower than the part.
    """
    shown = np.asarray(newest - newest[0], dtype=np.float64)
    least, most = max((1.0 - OFF) * stated / period, 1.0 + _SLOWER), (1.0 + OFF) * stated / period
    if least >= most or shown[-1] <= 0.0:
        return None
    ratios = np.linspace(least, most, 2 + int((most - least) * shown[-1] / _APART))
    log = np.stack([_log_likelihoods(shown, float(ratio)) for ratio in ratios])
    best = float(np.max(log))
    mean = best + float(np.log(np.mean(np.exp(log - best))))
    return Loop(float(ratios[int(np.argmax(np.max(log, axis=1)))]) * period, 2.0 * mean)


def _log_likelihoods(shown: FloatArray, ratio: float) -> FloatArray:
    """Return the log likelihoods (phases,) of samples (n,) beside a loop, beyond that of rows lost at random alone.

    The loop's step is ``ratio`` periods long. A sample within which no step falls can only have been miscounted.
    """
    phases = ratio * np.arange(_PHASES)[:, None] / _PHASES
    step = np.ceil((shown - phases) / ratio)
    missed = np.count_nonzero(phases + ratio * step >= shown + 1.0, axis=1)
    sure = missed * np.log(_MISCOUNTED) + (shown.size - missed) * np.log1p(-_MISCOUNTED)
    rows = float(shown.size - 1)
    return np.asarray(_of_losses(rows, step[:, -1] - step[:, 0]) + sure - _of_losses(rows, shown[-1]))


def _of_losses(rows: float, steps: ArrayLike) -> FloatArray:
    """Return the log likelihood of rows written in so many steps (k,), each lost with the likeliest chance."""
    share = rows / np.maximum(np.asarray(steps, dtype=np.float64), rows)
    lost = rows / share - rows
    return np.asarray(rows * np.log(share) + xlogy(lost, 1.0 - share))
