"""Samples that a logger's loop must skip: the pattern by which a part that free-runs shows beside a slower loop.

Takes which of a part's samples each row of recordings shows; gives the loop beside which no row shows a sample that it
cannot. A loop that is slower than the part skips a sample whenever it falls a whole period behind, at even distances,
and no row ever shows one of those: what looks like a lost row there is none. Rows that are lost at random show every
sample alike.
The evidence is Bayes': the likelihood is averaged over all loops and phases that a sheet's rate allows, which charges
for having looked at so many. Recordings of one logger share its loop, and so that charge.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import xlogy

from discsim.arrays import FloatArray, IntArray

__all__ = ["OFF", "Loops", "loops_beside"]

#: share of rows whose sample was miscounted
_MISCOUNTED = 0.005
#: how far a loop may be from its stated rate, and by how much slower than the part it must be to be told from it
OFF, _SLOWER = 0.02, 0.01
#: loops and phases that are tried: the next one is shifted by so many samples at the recording's end, and as far by a
#: phase; rows about a skipped sample hold a loop to a few hundredths
_APART, _PHASES = 0.01, 100


class Loops(NamedTuple):
    """The likeliest step of the logger's loop by recording, s, and twice the log of what loops are likelier by.

    They are likelier than rows that were lost alone.
    """

    step_s: Mapping[str, float]
    gain: float


def loops_beside(newest: Mapping[str, IntArray], periods: Mapping[str, float], stated: float) -> Loops | None:
    """Return the loop beside a part whose samples ``newest`` (n,) the rows of recordings show, by their names.

    The part's samples are ``periods`` apart, s, as each recording has it; the loop's step is ``stated`` to within its
    oscillator's error, s. All recordings are of one loop, unless loops of their own are likelier. None where none would
    be slower than the part.
    """
    period = float(np.mean(list(periods.values())))
    shown = {name: np.asarray(one - one[0], dtype=np.float64) for name, one in newest.items()}
    least, most = max((1.0 - OFF) * stated / period, 1.0 + _SLOWER), (1.0 + OFF) * stated / period
    if least >= most or min(one[-1] for one in shown.values()) <= 0.0:
        return None
    longest = max(float(one[-1]) for one in shown.values())
    ratios = np.linspace(least, most, 2 + int((most - least) * longest / _APART))
    each = {
        name: np.array([_log_mean(_log_likelihoods(one, float(ratio))) for ratio in ratios])
        for name, one in shown.items()
    }
    together = np.sum(list(each.values()), axis=0)
    apart = sum(_log_mean(one) for one in each.values())
    gain = _log_mean(together)
    best = {name: int(np.argmax(together if gain >= apart else one)) for name, one in each.items()}
    return Loops({name: float(ratios[k]) * periods[name] for name, k in best.items()}, 2.0 * max(gain, apart))


def _log_mean(log: FloatArray) -> float:
    """Return the log of the mean of what has the logs (n,)."""
    best = float(np.max(log))
    return best + float(np.log(np.mean(np.exp(log - best))))


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
