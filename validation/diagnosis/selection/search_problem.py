"""What a search is asked: recordings of one plant, with all that is known of them before an effect is tried."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from discsim.effects import Effect
from discsim.recording import Recording
from discsim.validation.diagnosis.progress import Progress, silent
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import Parameter

if TYPE_CHECKING:
    from discsim.validation.diagnosis.selection.search_state import Search

__all__ = ["SearchProblem"]


@dataclass(frozen=True, eq=False)
class SearchProblem:
    """Recordings of one plant whose effects are searched, with all that is known of them before.

    Attributes
    ----------
    recordings : sequence of Recording
        As they are fitted: with a number in the place of each that they do not state.
    as_stated : sequence of Recording or None
        The same without such numbers; None where nothing had to stand in for any.
    followed : Fit or None
        Their relaxed fit, where it is known already.
    free : sequence of Parameter
        Numbers that every fit may move beside what is stated.
    hints : sequence of Effect
        Effects of about the right size that sensors asked of one another before any fit. From far away no slope leads
        to a clock by whose error phases run away.
    effects : Competing
        Those that compete.
    progress : function
        Told of the stages of the search.
    law : function or None
        Tells whether a law explains all that a search has before it, where one effect leaves much of that. It is given
        the search and asked once.
    """

    recordings: Sequence[Recording]
    as_stated: Sequence[Recording] | None = None
    followed: Fit | None = None
    free: Sequence[Parameter] = ()
    hints: Sequence[Effect] = ()
    effects: Competing = CATALOGUED
    progress: Progress = silent
    law: Callable[[Search], bool] | None = None
