"""The column that tells a rate table's rate, as its encoder or its controller wrote it beside the sensors' readings.

Takes a proposed map of a rate table; gives the column as its rate reference. A gyroscope that turns as fast tells which
of several columns it is, and whether it counts the other way round.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Numbers, Triple
from discsim.validation.importing.sniffing.proposal import Proposal, ProposedReference
from discsim.validation.importing.sniffing.unused import rate_columns

__all__ = ["with_reference"]

#: a gyroscope's scale is off by 3 % at most, and a table is fast where it turns at more than this share of its fastest
_ALIKE, _FAST = 0.1, 0.2
#: what a table was told to do, and did more or less
_ASKED = re.compile(r"command|cmd|set[ _-]?point|target|demand|desired|soll", re.IGNORECASE)


class _Found(NamedTuple):
    """A column of a rate: its name, unit and sign, and whether a gyroscope turns as fast."""

    column: str
    unit: str
    sign: float
    seen: bool


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
    shown = _about_z(proposal) if first.sensor == "gyroscope" else None
    columns = [_seen(numbers, column, unit, shown) for column, unit in rate_columns(numbers, used)]
    measured = [one for one in columns if one.seen] or [one for one in columns if shown is None]
    if len(measured) > 1:
        measured = [one for one in measured if not _ASKED.search(one.column)]
    if len(measured) != 1:
        return proposal
    (found,) = measured
    return replace(
        proposal, reference=ProposedReference(numbers, found.column, found.unit, found.sign, _decided(found))
    )


def _about_z(proposal: Proposal) -> FloatArray:
    """Return the rate about the body's z (n,) rad/s that the gyroscope of a proposed map shows, row by row."""
    (gyro,) = (one for one in proposal.sensors if one.sensor == "gyroscope")
    shown = np.full(len(gyro.triple.numbers.values), np.nan)
    shown[gyro.triple.rows] = gyro.triple.values @ gyro.axes[2] * gyro.unit.factor("rad_s")
    return shown


def _seen(numbers: Numbers, column: str, unit: str, shown: FloatArray | None) -> _Found:
    """Return a column of a rate beside what the gyroscope has ``shown`` (n,) rad/s, NaN where it was silent."""
    if shown is None:
        return _Found(column, unit, 1.0, seen=False)
    rate = numbers.values[:, numbers.table.columns.index(column)] * UNITS["rad_s"][unit]
    both = np.isfinite(rate) & np.isfinite(shown)
    fast = both & (np.abs(rate) > _FAST * np.max(np.abs(rate[both]), initial=0.0))
    ratio = float(np.median(shown[fast] / rate[fast])) if np.any(fast) else 0.0
    return _Found(column, unit, float(np.copysign(1.0, ratio)), seen=abs(abs(ratio) - 1.0) < _ALIKE)


def _decided(found: _Found) -> Decision:
    why = (
        "the gyroscope turns as fast" if found.seen else "no gyroscope tells its sign: scale = -1 where it is the other"
    )
    why += ", the other way round" * (found.sign < 0.0)
    why += "; what a table was told it has not quite done" * bool(_ASKED.search(found.column))
    return Decision("rate reference", f"'{found.column}' in {found.unit}", "likely" if found.seen else "guess", why)
