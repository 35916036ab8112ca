"""A magnetometer that is turned in its board, or soft iron near it: of a spin about z each shows what the other does.

Takes what was found beside counted rows, all effects at once; gives it with the one in the place of the other where
that explains more, and with the other beside it where the recordings cannot tell the two apart. Along the axis of the
spin the field stands still, so that the part of it which either adds to x and y is one more hard iron; what is left of
both is a share of x and y in z. Soft iron alone makes an ellipse of the circle that x and y run.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.effects.catalogue import catalogued
from discsim.effects.mount_rows import Mount
from discsim.effects.sensors import SoftIron
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.evidence import lead, price
from discsim.validation.diagnosis.selection.all_at_once import worth_of_each
from discsim.validation.diagnosis.selection.exchange import rival_of
from discsim.validation.diagnosis.selection.search_state import Search, possible, values_of_fit
from discsim.validation.diagnosis.settings import SELECTION

__all__ = ["with_iron_weighed"]

_TURNED, _IRON = (catalogued(kind, "magnetometer").id for kind in (Mount, SoftIron))
_IN_PLACE = {_TURNED: _IRON, _IRON: _TURNED}


def with_iron_weighed(found: Search) -> Search:
    """Return a search of which a turned magnetometer or soft iron has the other as its rival, or gives way to it.

    The fit that begins with few effects, and turned chips among them, may end beside its optimum with soft iron. The
    six numbers of that must gain more than single rows that are miscounted leave. Where both are, both are named.
    """
    for _ in _IN_PLACE:
        found = found.about(found.final.fit)
        present = {one.id: one for one in found.final.hypothesis.candidates if one.id in _IN_PLACE}
        if len(present) != 1:
            break
        (candidate,) = present.values()
        rival = rival_of(found, candidate, _IN_PLACE[candidate.id])
        if rival is None or not possible(rival.fitted):
            break
        found = replace(found, rivals={**found.rivals, candidate.name: [rival]})
        told = rival.fitted.told(rival.candidate), found.final.told(candidate)
        odd = SELECTION.miscounted if rival.candidate.id == _IRON else 0.0
        if rival.worse + lead(rival.candidate, candidate, *told) + odd >= 0.0:
            break
        found = replace(found, final=rival.fitted, rivals={})
    return _with_the_other(found)


def _with_the_other(found: Search) -> Search:
    """Return a search with the other one beside a turned magnetometer or soft iron, where it is worth its price there.

    Of ten sets of throws like real ones with one of the two the other gained 20 at most; where both were, 18 to 79.
    """
    final = found.final
    missing = [other for id, other in _IN_PLACE.items() if any(one.id == id for one in final.hypothesis.candidates)]
    if len(missing) != 1 or all(one.id != missing[0] for one in found.candidates):
        return found
    other = free_candidate(missing[0])
    both = continuous_fit(final.fit, final.hypothesis.plus(other), found.own, final.fit.noise, values_of_fit(final))
    both = found.with_cost(both)
    if not possible(both) or both.gain_upon(final) <= price(other):
        return found
    # a fit that goes on may gain elsewhere, by what it had not yet found
    about = found.about(both.fit)
    worth = worth_of_each(about.equations, both.hypothesis.candidates, found.own)[other.name]
    return replace(found, final=both, rivals={}) if worth > price(other) else found
