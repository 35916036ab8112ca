"""Whether a rate table turned as it was commanded: its read-out against its command, once the search is over.

Takes a search; gives sentences for an answer that explains nothing. A commanded plant has no motion of its own, so that
what a drive's loop, a belt or a motor at its limit adds is missing from every sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.identification.residual_tests import RESIDUAL_TESTS

__all__ = ["not_as_commanded"]

_READ_OUT = "rate_reference"


def not_as_commanded(found: Search, names: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence for each recording (called ``names``) whose table's read-out the final fit does not follow.

    It does not where the read-out is off by more than any noise is louder than stated (`RESIDUAL_TESTS.loud`).
    """
    if not found.relaxed_fit.plant.commanded:
        return ()
    told = []
    for name, linear, residual in zip(names, found.final.fit.linears, found.final.residuals, strict=True):
        for channel in linear.channels:
            if channel.sensor != _READ_OUT:
                continue
            off, stated = float(np.sqrt(np.mean(residual[channel.rows] ** 2))), float(linear.sd[channel.rows][0])
            if off > RESIDUAL_TESTS.loud * stated:
                told.append(
                    f"{name}: the table's own read-out is off its command by {np.degrees(off):.3g} deg/s (rms), "
                    f"{off / stated:.0f} times its noise: it did not turn as it was asked to. A diagnosis takes the "
                    "command for the motion. Score the sensors against the read-out instead: "
                    "discsim rate-table --recording FOLDER."
                )
    return tuple(told)
