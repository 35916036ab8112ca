"""What may be supposed of a setup once effects were searched, and the tests of whether a supposition stands.

Takes what was tried and the question; gives the setup that is to be tried next, or None. Relations between sensors take
some effects for faults of a setup, and miss faults that effects hide: only a fit tells which.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from discsim.effects.sensors import DroppedSamples
from discsim.effects.setup import Axes, BoardRotation, TimeOffset
from discsim.validation.diagnosis.setup import SetupFindings, with_likeliest_fault
from discsim.validation.diagnosis.setup_effects import (
    with_other_sensor,
    with_reversed_axes,
    with_those_borne_out,
    without_faults,
)
from discsim.validation.diagnosis.stages import Question, Tried
from discsim.validation.diagnosis.verdict import leaves_more_than_noise

__all__ = ["SUPPOSITIONS", "Supposition"]


class Supposition(NamedTuple):
    """What to suppose of a setup after what was tried, and whether it stands as tried, against what was before."""

    suppose: Callable[[Tried, Question], SetupFindings | None]
    stands: Callable[[Tried, Tried], bool]


def _follows(tried: Tried, before: Tried) -> bool:
    """Tell whether sensors do not contradict one another under a supposition, whatever was tried before."""
    del before
    return tried.contradiction is None


def _follows_as_well(tried: Tried, before: Tried) -> bool:
    """Tell whether sensors do not contradict one another, and no more than noise is left if nothing more was before."""
    return _follows(tried, before) and (_explains(tried) or not _explains(before))


def _explains(tried: Tried) -> bool:
    """Tell whether a supposition leaves no more than noise."""
    return tried.found is not None and not leaves_more_than_noise(tried.found)


def _explains_all(tried: Tried, before: Tried) -> bool:
    """Tell whether a supposition leaves no more than noise, whatever was tried before."""
    del before
    return _explains(tried)


def _explains_with_less(tried: Tried, before: Tried) -> bool:
    """Tell whether a supposition leaves no more than noise, with fewer effects than what does so already."""
    if not _explains(tried):
        return False
    sizes = [np.inf if one.found is None else one.found.final.hypothesis.size for one in (tried, before)]
    return sizes[0] < sizes[1] or not _explains(before)


def likeliest_fault(tried: Tried, question: Question) -> SetupFindings | None:
    """Suppose the likeliest fault where sensors contradict one another: other physics may hide it from relations.

    Whether a motion then follows the sensors tells whether it is there.
    """
    del question
    contradiction = tried.contradiction
    return None if contradiction is None else with_likeliest_fault(tried.prepared.setup, contradiction.blamed)


def times_as_written(tried: Tried, question: Question) -> SetupFindings | None:
    """Suppose that no sensor's times are off, where corrected times leave more than noise or ask for lost samples.

    Samples that were lost shift a sensor's times, and one offset may make up for most of them.
    """
    if tried.found is None:
        return None
    late = {fault.effect.row.acts_on for fault in tried.prepared.setup.faults if fault.effect.row.type is TimeOffset}
    named = [candidate.row for candidate in tried.found.final.hypothesis.candidates]
    losing = any(row.type is DroppedSamples and row.acts_on in late for row in named)
    return _without(tried, question, TimeOffset) if losing or not _explains(tried) else None


def other_sensor(tried: Tried, question: Question) -> SetupFindings | None:
    """Suppose that another sensor is at fault, where one was as likely before the fit and the fit asks for more.

    Of two sensors that are late against each other either may be the one, and of two that turn the other way: the
    fixes' times, or what an accelerometer shows of a run-down, tell which.
    """
    found = tried.found
    if found is None or (_explains(tried) and not found.final.hypothesis.candidates):
        return None
    return with_other_sensor(tried.prepared.setup, question.recordings)


def axes_as_written(tried: Tried, question: Question) -> SetupFindings | None:
    """Suppose that no board and no axes are turned, where turned ones leave more than noise, or reverse axes again.

    By a strong magnet beside it the field turns over along a low path, as if the board lay upside down. Scales of -1
    then turn it back.
    """
    undone = tried.fit is not None and with_reversed_axes(tried.prepared.setup, tried.fit) is not None
    return None if _explains(tried) and not undone else _without(tried, question, BoardRotation, Axes)


def _without(tried: Tried, question: Question, *types: type[Any]) -> SetupFindings | None:
    """Return the setup of what was tried without its faults of some types; None if there are no such."""
    return without_faults(tried.prepared.setup, question.recordings, *types)


def reversed_axes(tried: Tried, question: Question) -> SetupFindings | None:
    """Suppose axes reversed that a fit has found to read about -1 times what they should."""
    del question
    return None if tried.fit is None else with_reversed_axes(tried.prepared.setup, tried.fit)


def borne_out(tried: Tried, question: Question) -> SetupFindings | None:
    """Suppose only the faults of a setup that a fit bears out: an effect that it found may have looked like others."""
    return None if tried.fit is None else with_those_borne_out(tried.prepared.setup, question.recordings, tried.fit)


#: what is supposed of the setup once effects were searched, one after the other
SUPPOSITIONS = (
    Supposition(likeliest_fault, _follows),
    Supposition(other_sensor, _explains_with_less),
    Supposition(times_as_written, _explains_all),
    Supposition(axes_as_written, _explains_with_less),
    Supposition(reversed_axes, _follows_as_well),
    Supposition(borne_out, _follows),
)
