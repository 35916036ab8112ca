"""Hypotheses that relations between sensors cannot tell apart, told by a short fit of the flight's physics.

A board upside down on a disc that spins the other way reads the same as a sound one in every relation between its
sensors; the air knows the difference, for a disc has a top. So a second or so of a flight is followed under each
hypothesis, loosely (`discsim.validation.diagnosis.relaxed_fit`), and the one that leaves least is taken.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import Recording
from discsim.validation.diagnosis.first_trajectory import beginning, first_trajectory
from discsim.validation.diagnosis.relaxed_fit.parameters import ordinary, unknowns
from discsim.validation.diagnosis.setup.faults import effect_of_hypothesis
from discsim.validation.diagnosis.setup.hypotheses import Hypothesis, chosen
from discsim.validation.identification.gauss_newton import Fit, linearised, refit
from discsim.validation.identification.noise import stated_noise
from discsim.validation.identification.other_side import at_limits
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.stated_parameters import stated_parameters
from discsim.written import corrected

__all__ = ["REFUTED", "ShortFit", "left_by_short_fit", "short_fit", "told_apart"]

#: how much of a flight is followed, s, in how many recordings, with how many steps
_LENGTH, _RECORDINGS, _STEPS = 1.5, 2, 5
#: readings later than this, s, are left aside: no throw takes so long, nor does a start that is followed for _LENGTH
#: depend on them; a clock that jumped by a day would have the path looked for at every tenth of a second of that day
_LATEST = 60.0
#: most hypotheses that short fits are made of; a twin is refuted where it leaves this many times more
_FITTED, REFUTED = 6, 2.0


class ShortFit(NamedTuple):
    """What a relaxed fit to the beginnings of flights leaves: its merit, of how many readings, and where it ended.

    The merit is infinite where the fit fails. ``at`` holds the numbers that were free beside those of a relaxed fit.
    """

    merit: float
    readings: int
    at: Mapping[str, float]

    @property
    def left(self) -> float:
        """The merit per reading."""
        return self.merit / max(self.readings, 1)


def left_by_short_fit(recordings: Sequence[Recording]) -> float:
    """Return the merit per reading that a relaxed fit to the beginnings of flights leaves; infinite where it fails."""
    return short_fit(recordings).left


@np.errstate(over="ignore", invalid="ignore")
def short_fit(recordings: Sequence[Recording], free: Sequence[Parameter] = ()) -> ShortFit:
    """Return a relaxed fit to the beginnings of flights; ``free`` are numbers that may move beside its own.

    Readings at a limit take no part in a fit, and count here where they stand on the other side than the motion.
    """
    some = [_early(one) for one in list(recordings)[:_RECORDINGS]]
    trajectories = tuple(beginning(first_trajectory(one), _LENGTH) for one in some)
    sensors = {readings.sensor for one in trajectories for readings in one.readings}
    parameters = (*stated_parameters(some), *unknowns(some), *ordinary(sensors, some[0].plant), *free)
    at = np.array([q.stated for q in parameters])
    fit = Fit(trajectories, parameters, at, trajectories[0].plant.sizes.relaxed, {})
    bare = linearised(fit, ())
    fit = refit(replace(fit, noise=stated_noise(bare)), iterations=_STEPS, tolerance=1e-3 * fit.count)
    merit = float(fit.merit + sum(one.chi2 for one in at_limits(fit).values()))
    asked = {q.key for q in free}
    ended = {q.name: float(v) for q, v in zip(fit.parameters, fit.at, strict=True) if q.key in asked}
    return ShortFit(merit if np.isfinite(merit) else float("inf"), fit.count, ended)


def _early(recording: Recording) -> Recording:
    """Return a recording without what was read more than `_LATEST` after its first reading."""
    start = min((float(one.t[0]) for one in recording.samples.values() if len(one)), default=0.0)
    if recording.end <= start + _LATEST:
        return recording
    samples = {name: one.between(start, start + _LATEST) for name, one in recording.samples.items()}
    return replace(recording, samples={name: one for name, one in samples.items() if len(one)})


def told_apart(
    tied: Sequence[Hypothesis], recordings: Sequence[Recording], site: FloatArray
) -> tuple[Hypothesis, list[Hypothesis]]:
    """Return the best of hypotheses that cost the same, and those that cannot be told from it.

    In a flight the air tells them apart. A magnetometer with all columns reversed is a field of the other direction:
    of those two the columns are named.
    """
    tied = sorted(tied, key=lambda item: _turned_round(item, site))
    if len(tied) == 1 or not plant_of(recordings[0]).air_modelled:
        return tied[0], list(tied[1:])
    some = chosen(recordings)
    meant = [[corrected(one, [effect_of_hypothesis(item, site)]) for one in some] for item in tied[:_FITTED]]
    left = [left_by_short_fit(one) for one in meant]
    alike = [k for k in range(len(left)) if left[k] < REFUTED * min(left)]
    best = min(alike, key=lambda k: (_turned_round(tied[k], site), left[k]))
    return tied[best], [tied[k] for k in alike if k != best]


def _turned_round(item: Hypothesis, stated: FloatArray) -> bool:
    """Tell whether a hypothesis is a field that points the other way than the stated one: no place on a map has it."""
    return item.columns.site is not None and float(item.columns.site @ stated) < 0.0
