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
from discsim.compiled import compiled_nogil

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
        name: np.array([_log_mean(phases) for phases in _log_likelihoods(one, ratios)]) for name, one in shown.items()
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


def _log_likelihoods(shown: FloatArray, ratios: FloatArray) -> FloatArray:
    """Return the log likelihoods (k, phases) of samples (n,) beside loops, beyond that of rows lost at random alone.

    The loops' steps are ``ratios`` (k,) periods long. A sample within which no step falls was miscounted.
    """
    missed, steps = _steps_within(shown, ratios, _PHASES)
    sure = missed * np.log(_MISCOUNTED) + (shown.size - missed) * np.log1p(-_MISCOUNTED)
    rows = float(shown.size - 1)
    return np.asarray(_of_losses(rows, steps) + sure - _of_losses(rows, shown[-1]))


@compiled_nogil
def _steps_within(shown: FloatArray, ratios: FloatArray, phases: int) -> tuple[FloatArray, FloatArray]:
    """Return within how many samples (n,) no step of a loop falls, and its steps from first to last, (k, phases) each.

    A loop's step is one of ``ratios`` (k,) periods long, and falls at one of so many ``phases`` of it.
    """
    missed, steps = np.zeros((ratios.size, phases)), np.zeros((ratios.size, phases))
    for k in range(ratios.size):
        ratio = ratios[k]
        for j in range(phases):
            phase = ratio * j / phases
            for one in shown:
                if phase + ratio * np.ceil((one - phase) / ratio) >= one + 1.0:
                    missed[k, j] += 1.0
            steps[k, j] = np.ceil((shown[-1] - phase) / ratio) - np.ceil((shown[0] - phase) / ratio)
    return missed, steps


def _of_losses(rows: float, steps: ArrayLike) -> FloatArray:
    """Return the log likelihood of rows written in so many steps (k,), each lost with the likeliest chance."""
    share = rows / np.maximum(np.asarray(steps, dtype=np.float64), rows)
    lost = rows / share - rows
    return np.asarray(rows * np.log(share) + xlogy(lost, 1.0 - share))
