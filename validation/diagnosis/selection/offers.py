"""Further effects that are offered to a search, and in which turn they are refitted."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import zip_longest
from typing import TypeAlias

from discsim.validation.diagnosis.candidates.evidence import charge, price
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate
from discsim.validation.identification.gauss_newton import Fit

__all__ = ["Offer", "begun_as_tried", "in_chi2", "in_turn"]

#: what is proposed, the fit whose motion a fit of it starts from, and what choosing lost samples costs
Offer: TypeAlias = tuple[ScreenedCandidate, Fit, float]


def in_turn(*offers: Sequence[Offer]) -> list[Offer]:
    """Return offers that may be worth their price, from each list the best in turn."""

    def later(offer: Offer) -> tuple[bool, float]:
        # lost samples first: they bend what algebra says of everything else
        return offer[2] <= 0.0, charge(offer[0].candidate) - offer[0].gain

    worth = [sorted((o for o in some if o[0].gain > 0.5 * price(o[0].candidate)), key=later) for some in offers]
    return [offer for turn in zip_longest(*worth) for offer in turn if offer is not None]


def begun_as_tried(offers: Sequence[Offer], tried: Sequence[Offer]) -> list[Offer]:
    """Return offers in their turn, each with the size at which a detector has ``tried`` the same numbers, if one has.

    A linear question is right about small sizes: of an offset over the corners of a ramp it tells a part, and a fit
    that begins there may end there.
    """
    sizes = {_numbers(one): one for one in reversed(tried)}
    return [sizes.get(_numbers(one), one) for one in offers]


def _numbers(offer: Offer) -> tuple[object, ...]:
    """Return what two offers of the same numbers have in common: the effect, its recordings, what has a start."""
    screened = offer[0]
    return screened.candidate.id, screened.candidate.recordings, frozenset(screened.start)


def in_chi2(offer: Offer) -> float:
    """Return what an offer promises of the readings that a fit counts: nothing where it explains why some are out."""
    screened, _, cost = offer
    return 0.0 if cost > 0.0 or screened.candidate.row.hides_readings else screened.gain
