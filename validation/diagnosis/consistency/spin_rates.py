"""Sensors of one body that tell spin rates no motion reconciles, found from averages alone, before any fit.

How fast the field turns, what a gyroscope reads along the axis and what a reference says are one and the same rate. A
wrong clock, a delay or lost samples change each by a few per cent at most, however far they drive the phases apart: so
this speaks where the phases of sensors say nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discsim.recording import Recording
from discsim.validation.diagnosis.signals.relations import Columns, misfits
from discsim.validation.diagnosis.signals.spin_signals import spin_signals

__all__ = ["APART", "RatesApart", "rates_apart"]

#: how many times the ordinary error of two sensors (1.5 rad/s and 5 %) their rates differ by, in the median recording,
#: where no motion reconciles them: 30 rad/s at a spin of 60 rad/s. Of 71 sound sets, half of them with an effect of the
#: catalogue (``discsim study conceal --seed 70000 --cases 40``, and flights and free spins with
#: ``--effects`` of each clock, lag and loss of samples; thirteen others), the largest is 1.7, and 3.7 in one recording:
#: a table's ramps. Sensors of runs in the other direction, and random numbers, leave 17 and more
APART = 7.0


@dataclass(frozen=True)
class RatesApart:
    """Sensors whose spin rates differ: by how many times the ordinary error, in the median of some recordings."""

    sensors: tuple[str, ...]
    times: float
    recordings: int


def rates_apart(recordings: Sequence[Recording]) -> RatesApart | None:
    """Return the sensors that tell the most different rates, or None where all agree well enough for a fit.

    A sensor that contradicts a rig's reference stands beside it. Recordings without a spin say nothing.
    """
    found: dict[tuple[str, ...], list[float]] = {}
    for recording in recordings:
        signals = spin_signals(recording)
        for one in [] if signals is None else misfits(signals, Columns()):
            if one.relation == "spin rate":
                reference = ("rate_reference",) if "rate_reference" in recording else ()
                pair = one.sensors if len(one.sensors) > 1 else (*one.sensors, *reference)
                found.setdefault(pair, []).append(one.ratio)
    worst = max(found, key=lambda pair: float(np.median(found[pair])), default=None)
    if worst is None or 2 * len(found[worst]) < len(recordings):
        return None
    times = float(np.sqrt(np.median(found[worst])))
    return RatesApart(worst, times, len(found[worst])) if times > APART else None
