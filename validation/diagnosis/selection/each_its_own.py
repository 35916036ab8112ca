"""What is done by hand for each recording, as a film is begun: its size is each recording's own, or the same in all.

Takes a fit whose last effect is such a one; gives the fit with a size for each recording where that explains more.
"""

from __future__ import annotations

from dataclasses import replace

from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, continuous_fit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.selection.search_state import Search, possible, values_of_fit

__all__ = ["with_own_sizes"]


def with_own_sizes(found: Search, current: ContinuousFit) -> ContinuousFit:
    """Return a fit whose last effect, where that is done by hand for each recording, has its own size in each.

    It stays as it is where the sizes of all are not worth their price.
    """
    last, count = current.hypothesis.candidates[-1], len(found.recordings)
    whose = [i for i in range(count) if last.row.acts_on in found.recordings[i].samples]
    if not last.row.each_its_own or len(whose) < 2:
        return current
    each = tuple(replace(last, recordings=frozenset([i])) for i in whose)
    others = tuple(one for one in current.hypothesis.candidates if one.id != last.id)
    present = values_of_fit(current)
    shared = {key: size for (key, some), size in present.items() if key[0] == last.id and some is None}
    start = {(key, one.recordings): size for one in each for key, size in shared.items()}
    hypothesis = Hypothesis((*others, *each))
    apart = found.with_cost(
        continuous_fit(current.fit, hypothesis, found.own, found.relaxed_noise, {**start, **present})
    )
    asked = sum(map(price, each)) - sum(price(one) for one in current.hypothesis.candidates if one.id == last.id)
    return apart if possible(apart) and apart.gain_upon(current) > asked else current
