"""What evidence costs: the penalty that a candidate's gain in likelihood must exceed, bounds and signs of parameters.

Takes a candidate; gives its penalty in twice the log likelihood (an information criterion: Schwarz, 1978, raised by the
number of candidates and instants that were tried).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.effects.mount_rows import ROWS as MOUNTS
from discsim.effects.sensors import CrossAxis
from discsim.effects.setup import TimeOffset
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, parameters_of
from discsim.validation.diagnosis.settings import SELECTION

__all__ = ["charge", "holds_itself", "lead", "price", "price_of_oddity"]

#: within which parameters make sense, the effects' and a rig's own
BOUNDS: Mapping[tuple[str, str], tuple[float, float]] = {
    **{(row.id, name): bounds for row in CATALOGUE.values() for name, bounds in row.bounds.items()},
    ("rig", "viscous"): (0.0, np.inf),
}


#: parameters whose sign physics fixes: friction brakes, a lag is late
ONE_SIDED: Mapping[tuple[str, str], float] = {
    (row.id, name): sign for row in CATALOGUE.values() for name, sign in row.sign.items()
}


#: how a sensor that turns with the spin sits in its board: what else explains as much, as a delay, is likelier
TURNED = frozenset(row.id for row in MOUNTS if row.acts_on != "accelerometer")


#: a turned sensor -> the cross-axis error that holds it: a small turn is one whose numbers are opposite in pairs
_HOLDS: Mapping[str, str] = {
    turned.id: cross.id
    for turned in MOUNTS
    for cross in CATALOGUE.values()
    if cross.type is CrossAxis and cross.acts_on == turned.acts_on
}
#: those of which a fit of all effects at once weighs both, and those that stand one in the place of the other
NESTED: Mapping[str, str] = {turned: cross for turned, cross in _HOLDS.items() if turned in TURNED}
IN_PLACE: Mapping[str, str] = {turned: cross for turned, cross in _HOLDS.items() if turned not in TURNED}


#: times that are off by as much all along: a part that is late has a filter, mostly
MISTIMED = frozenset(row.id for row in CATALOGUE.values() if row.type is TimeOffset)


def charge(candidate: CandidateEffect, told: int | None = None) -> float:
    """Return what an effect is charged where it stands against others: its parameters, and that it is unusual.

    ``told`` is how many of its parameters the readings tell, all by default: one that no reading shows serves none.
    """
    # a turn about the axis of spin stands in for an offset, too: it stays as far behind that as behind anything else
    unusual = SELECTION.mistimed if candidate.id in MISTIMED | TURNED else 0.0
    # an accelerometer shares its chip with the gyroscope: it alone is turned as seldom as either
    unusual += SELECTION.turned if candidate.id in _HOLDS else 0.0
    return SELECTION.rival * (len(parameters_of(candidate)) if told is None else told) + unusual


def lead(
    rival: CandidateEffect, candidate: CandidateEffect, rival_told: int | None = None, told: int | None = None
) -> float:
    """Return by how much more a rival is charged than an effect, each for what readings tell of it, as in `charge`.

    Of nested effects the simpler one is named: six numbers that are opposite in pairs are no chance, however unusual a
    turn is.
    """
    if NESTED.get(rival.id) == candidate.id:
        return SELECTION.rival * (len(parameters_of(rival)) - len(parameters_of(candidate)))
    return charge(rival, rival_told) - charge(candidate, told)


def holds_itself(candidates: Iterable[CandidateEffect]) -> bool:
    """Tell a turned sensor beside the cross-axis error that holds it: of the two together only squares of angles count.

    Large ones that cancel each other are a scale then, of a sensor that nobody built so.
    """
    ids = {candidate.id for candidate in candidates}
    return any(turned in ids and cross in ids for turned, cross in IN_PLACE.items())


def price(candidate: CandidateEffect) -> float:
    """Return what a candidate must gain to be believed."""
    count = len(parameters_of(candidate))
    row = candidate.row
    if row.event:
        return (SELECTION.event_entry if row.brief else SELECTION.gust_entry) + SELECTION.per_parameter * count
    return SELECTION.entry + SELECTION.per_parameter * count + price_of_oddity(candidate)


def price_of_oddity(candidate: CandidateEffect) -> float:
    """Return what a candidate costs beside that, as what all recordings of a disc or a sensor have, and some have not.

    It is zero of all that may come and go.
    """
    odd = candidate.recordings is not None and candidate.row.in_all and not candidate.row.event
    return SELECTION.other_disc if odd else 0.0
