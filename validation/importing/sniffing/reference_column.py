"""The column that tells a rate table's rate, as its encoder or its controller wrote it beside the sensors' readings.

Takes a proposed map of a rate table; gives the column as its rate reference. A gyroscope that turns as fast tells which
of several columns it is, and whether it counts the other way round.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.decision import Decision, Sureness
from discsim.validation.importing.sniffing.groups import Numbers, Triple
from discsim.validation.importing.sniffing.proposal import Proposal, ProposedReference, ProposedSensor
from discsim.validation.importing.sniffing.unused import rate_columns

__all__ = ["with_reference"]

#: a gyroscope's scale is off by 3 % at most, and a table is fast where it turns at more than this share of its fastest
_ALIKE, _FAST = 0.1, 0.2
#: what a table was told to do, and did more or less
_ASKED = re.compile(r"command|cmd|set[ _-]?point|target|demand|desired|soll", re.IGNORECASE)


def with_reference(proposal: Proposal, named: Sequence[Triple]) -> Proposal:
    """Return the map of a rate table with the one column that tells its rate; as it is where none or several do.

    ``named`` are the sensors' columns, whether the map takes them or not. A column in a file without sensors is told
    and not taken: nothing says that the two clocks are one.
    """
    if proposal.plant != "rate_table" or not proposal.sensors:
        return proposal
    first = next((one for one in proposal.sensors if one.sensor == "gyroscope"), proposal.sensors[0])
    numbers = first.triple.numbers
    if first.triple.where is not None or first.clock is not None:
        return proposal
    used = {(triple.numbers.path, name) for triple in named for name in triple.names}
    shown = _about_z(first) if first.sensor == "gyroscope" else None
    told = [_told(numbers, column, unit, shown) for column, unit in rate_columns(numbers, used)]
    found = [one for one in told if one is not None]
    if len(found) > 1:
        found = [one for one in found if not _ASKED.search(one.column)]
    return replace(proposal, reference=found[0]) if len(found) == 1 else proposal


def _about_z(gyro: ProposedSensor) -> FloatArray:
    """Return the rate about the body's z (n,) rad/s that a gyroscope shows, row by row of its table."""
    shown = np.full(len(gyro.triple.numbers.values), np.nan)
    shown[gyro.triple.rows] = gyro.triple.values @ gyro.axes[2] * gyro.unit.factor("rad_s")
    return shown


def _told(numbers: Numbers, column: str, unit: str, shown: FloatArray | None) -> ProposedReference | None:
    """Return a column of a rate as the reference; None where a gyroscope has ``shown`` (n,) rad/s another rate."""
    sure: Sureness
    if shown is None:
        sign, sure, why = 1.0, "guess", "no gyroscope tells its sign: scale = -1 where it is the other"
    else:
        rate = numbers.values[:, numbers.table.columns.index(column)] * UNITS["rad_s"][unit]
        both = np.isfinite(rate) & np.isfinite(shown)
        fast = both & (np.abs(rate) > _FAST * np.max(np.abs(rate[both]), initial=0.0))
        ratio = float(np.median(shown[fast] / rate[fast])) if np.any(fast) else 0.0
        if abs(abs(ratio) - 1.0) >= _ALIKE:
            return None
        sign, sure, why = float(np.copysign(1.0, ratio)), "likely", "the gyroscope turns as fast"
        why += ", the other way round" * (sign < 0.0)
    why += "; what a table was told it has not quite done" * bool(_ASKED.search(column))
    return ProposedReference(
        numbers, column, unit, sign, Decision("rate reference", f"'{column}' in {unit}", sure, why)
    )
