"""The verdict: explained, consistent, recalibrated or unexplained, by the one rule that decides it."""

from __future__ import annotations

from collections import Counter

import numpy as np

from discsim.disc import aero_key
from discsim.effects.catalogue import CATALOGUE
from discsim.effects.kind import BOARD
from discsim.effects.sensors import ClockRate
from discsim.recording import Recording
from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.answer.misstated import Misstated
from discsim.validation.diagnosis.candidates.continuous_fit import standard_errors
from discsim.validation.diagnosis.leftovers import heldout_fits, leftovers_of, nothing_but_pure_error
from discsim.validation.diagnosis.misstated import misstated
from discsim.validation.diagnosis.progress import Progress
from discsim.validation.diagnosis.result import (
    Recalibration,
    Verdict,
)
from discsim.validation.diagnosis.selection.search_state import Search, misses
from discsim.validation.diagnosis.settings import SELECTION, UNKNOWN_LAW
from discsim.validation.diagnosis.stages import Judged, Tried
from discsim.validation.diagnosis.unknown_law.find import find_law, left_to_gain
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.residual_tests import RESIDUAL_TESTS, UnmodelledResidual
from discsim.validation.identification.stated_parameters import ON_BOARD, STATED_NAMES

__all__ = [
    "judged",
    "leaves_more_than_noise",
    "may_be_the_air",
    "recalibrations",
]


#: axes of a gyroscope on which a wobble shows
_TRANSVERSE = ("x_rad_s", "y_rad_s")


def judged(tried: Tried, progress: Progress) -> Judged:
    """Return what was tried with its verdict, and the law that stands for all that the catalogue leaves unexplained.

    Unexplained is what no motion follows, what leaves more than noise, and what a law explains better than a stack of
    effects does. Else effects, or faults of the setup, explain it. Else it is the baseline, recalibrated or not.
    Of rows that had to be counted nobody knows the instants to within the noise of the sensors: there more is left than
    pure error, or not.
    """
    found, law = tried.found, None
    if found is None or tried.law is not None:
        return Judged(tried, "unexplained", tried.law, misstated=tried.misstated)
    rows, agreement = tried.prepared.rows, tried.prepared.agreement
    set_aside: tuple[Fit, ...] = ()
    leftovers: tuple[Leftover, ...] = ()
    if found.at_once and rows is not None and agreement is not None:
        set_aside = tuple(heldout_fits(found.final))
        leftovers = leftovers_of(found, set_aside, rows.names, agreement)
    left = leaves_more_than_noise(found) and not nothing_but_pure_error(leftovers)
    numbers = _misstated(found, left=left, progress=progress)
    if not numbers and (left or _may_be_a_copy(found)):
        progress("looking for a law", 4, 5)
        law = find_law(found, instead=not left)
    verdict: Verdict
    if left or law is not None:
        verdict = "unexplained"
    elif found.final.hypothesis.candidates or tried.prepared.setup.faults or tried.prepared.rows is not None:
        verdict = "explained"
    else:
        moved = any(item.beyond for item in recalibrations(found).values())
        verdict = "recalibrated" if moved else "consistent"
    return Judged(tried, verdict, law, leftovers, set_aside, numbers)


def _misstated(found: Search, *, left: bool, progress: Progress) -> tuple[tuple[Misstated, ...], ...]:
    """Return sets of stated numbers of which each explains all where more than noise is ``left``, were they others.

    In flights effects on the motion may stand for one: beside a mass that is 2 % off, drag and a stall. There one
    number is told that does better than they do for what it costs.
    """
    lasting = [c for c in found.final.hypothesis.candidates if c.row.acts_on == "motion" and not c.row.brief]
    if not left and not (found.relaxed_fit.plant.air_modelled and lasting):
        return ()
    progress("asking what is stated", 4, 5)
    bar = np.inf if left else found.final.score + found.final.charged - SELECTION.rival
    cost = SELECTION.entry + SELECTION.per_parameter

    def explains(other: Search) -> bool:
        return other.final.score + cost < bar and not leaves_more_than_noise(other)

    return tuple(numbers for numbers in misstated(found, explains) if left or len(numbers) == 1)


def leaves_more_than_noise(found: Search) -> bool:
    """Tell whether what was found leaves residuals that no noise has, or is far from data that a motion follows."""
    final, settled = found.final, found.relaxed_fit.plant.durations.settled
    left = [item for item in final.unmodelled(settled) if not may_be_the_air(item, final.fit)]
    return bool(left) or misses(found, final)


def may_be_the_air(item: UnmodelledResidual, fit: Fit) -> bool:
    """Tell whether a window of a gyroscope leaves no more of a wobble than its plant's model of the air may.

    The excess of a window is told by its z: of n readings of unit variance the squares scatter by the root of 2 n.
    """
    share = fit.plant.sizes.of_wobble
    if not share or item.kind != "window" or item.recording is None or item.axis not in _TRANSVERSE:
        return False
    one = fit.trajectories[item.recording]
    wobble = fit.plant.grows_with(one.nodes[:-1], one.states)["wobble"]
    about = (one.nodes[1:] > item.from_s) & (one.nodes[:-1] < item.to_s)
    excess = fit.noise[item.group].sd * float(np.sqrt(item.z * np.sqrt(2.0 / RESIDUAL_TESTS.window)))
    return excess < share * float(np.max(wobble[about], initial=0.0))


def _may_be_a_copy(found: Search) -> bool:
    """Tell whether what was found may copy something that is none of it, so that one law is worth comparing.

    Several effects on the motion may, and any beside which a law about the same has more to gain than an effect costs:
    a disc that dries passes for thin air, a bias that settles for one that drifts. (Beside samples that were lost a
    motion ends beside its best.) Of those on a sensor several do in a free spin, where much that nobody knows stands in
    for what a wrong effect leaves: a bias that settles passes for a bias beside a sensitivity to what dies away, too.
    Where all ordinary errors are fitted at once, several of a sensor are no stack; nor are lost samples, without which
    no law would be fitted.
    """
    candidates = found.final.hypothesis.candidates
    lasting = [c.row for c in candidates if not c.row.brief and not c.fixed_values]
    weak = found.relaxed_fit.plant.weakly_identified
    acted_on = Counter(row.acts_on for row in lasting)
    stacked = {"motion", *BOARD} if weak and not found.at_once else {"motion"}
    if any(acted_on[about] >= UNKNOWN_LAW.stack for about in stacked):
        return True
    if found.at_once or any(c.fixed_values for c in candidates):
        return False
    return left_to_gain(found.final.fit, acted_on) > SELECTION.entry


def recalibrations(found: Search) -> dict[str, Recalibration]:
    """Return the stated numbers that may move, and where the recordings move them."""
    fit = found.final.fit
    sd = standard_errors(found.final)
    result = {}
    for q, value, error in zip(fit.parameters, fit.at, sd, strict=True):
        if q.group in CATALOGUE and CATALOGUE[q.group].type is ClockRate and any(q is p for p in found.own):
            result.update(_rates(found.recordings[0], q, float(value), float(error)))
        if (
            q.key in fit.plant.own_keys
            or q.group in CATALOGUE
            or not any(q.key == p.key and q.recordings == p.recordings for p in found.own)
        ):
            continue
        if q.group == "disc" and found.recordings[0].disc is None:
            continue  # it stands for a ratio that nobody stated
        sigma = next(p.sigma for p in found.own if q.key == p.key and q.recordings == p.recordings)
        name = aero_key(q.name) if q.group == "aero" else STATED_NAMES.get(q.key, f"{q.group}.{q.name}")
        if q.recordings is not None:
            name = f"{name} ({','.join(str(i + 1) for i in sorted(q.recordings))})"
        result[name] = Recalibration(q.stated, sigma, float(value), float(error))
    return result


def _rates(recording: Recording, clock: Parameter, ratio: float, error: float) -> dict[str, Recalibration]:
    """Return the sampling rates of the sensors of a stated clock as a fit has it, at ``ratio`` +- ``error``."""
    of, sheets = CATALOGUE[clock.group].acts_on, recording.sheets
    rates = {
        s: sheets[s].rate_hz for s in ON_BOARD if s in recording and of in (s, "clock") and sheets[s].rate_uncertainty
    }
    return {
        f"{sensor}.rate_hz": Recalibration(rate, rate * clock.sigma, rate * ratio, rate * error)
        for sensor, rate in rates.items()
    }
