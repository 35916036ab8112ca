"""How many screened candidates a step of the search refits: few near the data, more where algebra is led astray far
from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from support.made import coasts, throws

from discsim.effects.catalogue import CATALOGUE, effect
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, free_candidate, stand_ins
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.score_tests import ScreenedCandidate, hinted
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.selection import exchange, stepwise
from discsim.validation.diagnosis.selection import next_effect as searching
from discsim.validation.diagnosis.selection import search_state as finding
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import on_the_disc
from discsim.validation.identification.gauss_newton import Bars, Fit, linearised, merit_of
from discsim.validation.identification.noise import NoiseModel, stated_noise
from discsim.validation.identification.plants.flight import FLIGHT
from discsim.validation.identification.plants.spin_down import SPIN_DOWN

#: what algebra ranks, best first; none but the seventh comes near the data
RANKED = [
    CandidateEffect(id, ()) for id, row in CATALOGUE.items() if id.startswith(("mag.", "gyro.")) and not row.event
]
RIGHT = RANKED[6]
#: the normal equations about the relaxed fit, about another, and which: nothing asks them here
UNASKED = (None, None, None)
#: readings of the run-downs
COUNT = 1812
#: stands for the noise of most readings, in which detectors ask
STEADY: NoiseModel = {}


class Promised(NamedTuple):
    """Candidates as algebra about the relaxed fit, and about the present one, has them, where other than `RANKED`.

    ``shown`` is what detectors show in a noise in which ten times as much is left.
    """

    of_relaxed: Sequence[ScreenedCandidate] = ()
    of_present: Sequence[ScreenedCandidate] = ()
    shown: Sequence[ScreenedCandidate] = ()


def step(
    monkeypatch: pytest.MonkeyPatch,
    *,
    far: bool,
    right: CandidateEffect,
    hints: Sequence[ScreenedCandidate] = (),
    promised: Promised = Promised(),  # noqa: B008 - frozen
    gaining: bool = True,
    unmodelled: bool = True,
) -> tuple[str, list[str], list[float]]:
    """Return what one step of the search adds, and what it refitted, where fits are not made but told.

    Beside it how much below the present fit's merit each had to come, per reading, or be given up. Unless
    ``gaining`` none but the right one gains, and the present fit leaves noise alone unless
    ``unmodelled``.
    """
    recordings = coasts(seconds=1.0)
    fit = Fit(tuple(first_trajectory(one) for one in recordings), (), np.empty(0), SPIN_DOWN.sizes.continuous, {})
    linears = linearised(fit)
    fit = Fit(fit.trajectories, (), np.empty(0), fit.defects, stated_noise(linears), linears=linears)
    assert fit.count == COUNT
    # what a motion leaves that is none, or noise
    rng = np.random.default_rng(3)
    residuals = [linear.residual if unmodelled else rng.normal(0.0, linear.sd) for linear in linears]
    base = ContinuousFit(Hypothesis(), fit, 1e6, tuple(residuals))
    refitted, asked_for = [], []

    def told(fit: Fit, hypothesis: Hypothesis, *others: object, bars: Bars) -> ContinuousFit:
        refitted.append(hypothesis.candidates[-1].id)
        asked_for.append((merit_of(fit, fit.linears) - bars.free) / fit.count)
        score = 0.0 if hypothesis.candidates[-1] == right else 5e5 if gaining else 1e6
        return ContinuousFit(hypothesis, fit, score, tuple(one.residual for one in fit.linears), fit.noise)

    def chi2(fitted: ContinuousFit, noise: object) -> float:
        left = 20.0 if far else 1.1
        for candidate in fitted.hypothesis.candidates:
            left = 1.0 if candidate == right else 0.9 * left
        return (left if noise is not STEADY else 10.0 * left) * fit.count

    monkeypatch.setattr(searching, "continuous_fit", told)
    monkeypatch.setattr(searching, "chi2_in", chi2)
    monkeypatch.setattr(finding, "chi2_in", chi2)
    monkeypatch.setattr(finding, "normal_equations_of", lambda *_, **__: None)
    monkeypatch.setattr(searching, "searched", lambda *_: list(promised.shown))
    monkeypatch.setattr(searching, "steady_noise", lambda _: STEADY)
    monkeypatch.setattr(searching, "screened_candidates", lambda *_: [])
    ranked = [ScreenedCandidate(candidate, 1e6 - rank, {}) for rank, candidate in enumerate(RANKED)]
    asked = iter([list(promised.of_relaxed) or ranked, list(promised.of_present) or ranked])
    monkeypatch.setattr(searching, "one_per_effect", lambda _: next(asked))
    found = finding.Search(
        tuple(recordings), (), fit, fit.noise, tuple(RANKED), base, base, *UNASKED, hints=tuple(hints)
    )
    _, best = searching.next_effect(found, base, 0)
    return "" if best is None else best.hypothesis.candidates[-1].id, refitted, asked_for


def test_far_from_the_data_more_is_refitted_until_something_comes_near(monkeypatch):
    best, refitted, bars = step(monkeypatch, far=True, right=RIGHT)
    assert best == RIGHT.id
    assert refitted == [candidate.id for candidate in RANKED[:7]]
    # ten times what was left before the first, and by the best of the others since
    np.testing.assert_allclose(np.diff(bars), [20.0, *5 * [0.0]], atol=1e-9)


def test_what_comes_near_the_data_early_ends_the_search_at_four(monkeypatch):
    best, refitted, _ = step(monkeypatch, far=True, right=RANKED[1])
    assert best == RANKED[1].id
    assert len(refitted) == 4


def test_near_the_data_four_are_refitted(monkeypatch):
    _, refitted, bars = step(monkeypatch, far=False, right=RIGHT)
    assert len(refitted) == 4
    # half of what an effect must gain, as algebra said of each
    half = [0.5 * price(candidate) for candidate in RANKED[:4]]
    np.testing.assert_allclose(bars, np.array(half) / COUNT)


def test_near_the_data_more_are_refitted_where_none_of_four_gains_and_more_than_noise_is_left(monkeypatch):
    """A ground effect was the eighth beside an accelerometer's clock, in noise that was 2.4 times too loud."""
    best, refitted, _ = step(monkeypatch, far=False, right=RIGHT, gaining=False)
    assert best == RIGHT.id
    # with it four have been refitted, and more, so that it is the last
    assert refitted == [candidate.id for candidate in RANKED[:7]]
    best, refitted, _ = step(monkeypatch, far=False, right=RANKED[8], gaining=False, unmodelled=False)
    assert best == ""
    assert refitted == [candidate.id for candidate in RANKED[:8]]


def test_near_the_data_what_the_present_fit_asks_for_is_not_kept_waiting_by_what_segments_promise():
    """Beside a clock of a magnetometer they had promised 450 of an accelerometer that gained 4: it was the eighth."""
    promised = [ScreenedCandidate(candidate, 1900.0 - rank, {}) for rank, candidate in enumerate(RANKED[7:15])]
    found = [ScreenedCandidate(RIGHT, 210.0, {})]
    for gaining in (True, False):
        with pytest.MonkeyPatch.context() as patched:
            best, refitted, _ = step(
                patched, far=False, right=RIGHT, promised=Promised(promised, found), gaining=gaining
            )
        assert best == RIGHT.id
        assert refitted[:2] == [RANKED[7].id, RIGHT.id]


def test_near_the_data_nothing_is_refitted_that_promises_more_than_is_left(monkeypatch):
    """Segments that one recording has wrong had promised a million; fixes that came late were not among the first."""
    absurd = [ScreenedCandidate(candidate, 1e7 - rank, {}) for rank, candidate in enumerate(RANKED[7:11])]
    best, refitted, _ = step(monkeypatch, far=False, right=RANKED[1], promised=Promised(absurd))
    assert best == RANKED[1].id
    assert refitted == [candidate.id for candidate in RANKED[:4]]


def test_near_the_data_what_a_detector_shows_is_held_against_what_is_left_in_its_own_noise(monkeypatch):
    """A touch of a free spin of 0.6 rad/s had made the noise of its fit loud: a tenth of the touch was left in that."""
    touch = CandidateEffect("event.spin_step", (), frozenset({0}))
    best, refitted, _ = step(
        monkeypatch,
        far=False,
        right=touch,
        promised=Promised(shown=[ScreenedCandidate(touch, 5.0 * COUNT, {})]),
        gaining=False,
    )
    assert best == touch.id
    assert refitted[0] == touch.id


def test_near_the_data_what_a_detector_shows_beyond_all_that_is_left_in_its_own_noise_is_not_refitted(monkeypatch):
    touch = CandidateEffect("event.spin_step", (), frozenset({0}))
    _, refitted, _ = step(
        monkeypatch, far=False, right=RIGHT, promised=Promised(shown=[ScreenedCandidate(touch, 20.0 * COUNT, {})])
    )
    assert touch.id not in refitted


def test_near_the_data_a_limit_at_which_readings_stand_is_refitted_whatever_they_ask_for_beyond_it(monkeypatch):
    """Clipped readings are no part of what is left: with a gain of 5e8 a limit of 30 m/s^2 was dropped, and missed."""
    limit = CandidateEffect("accel.saturation", (), None, (("limit_m_s2", 30.32, 0.0014),))
    best, _, _ = step(monkeypatch, far=False, right=limit, promised=Promised([ScreenedCandidate(limit, 5e8, {})]))
    assert best == limit.id


def test_what_recordings_have_in_common_over_time_is_asked_about_in_noise_that_has_not_taken_it_up():
    """A recorder's clock beside a kick in a free spin: noise with a memory of 2 s left of its gain of 1017 only 6."""
    recordings = coasts(seconds=4.0)
    fit = Fit(tuple(first_trajectory(one) for one in recordings), (), np.empty(0), SPIN_DOWN.sizes.continuous, {})
    linears = linearised(fit)
    fit = replace(fit, noise=stated_noise(linears), linears=linears)
    rng = np.random.default_rng(3)
    residuals = [rng.normal(0.0, linear.sd) if len(linear.sd) else linear.residual for linear in linears]
    bent = [residual.copy() for residual in residuals]
    for linear, residual in zip(linears, bent, strict=True):
        channel = next(one for one in linear.channels if one.group == "accelerometer")
        residual[channel.rows] += 2.0 * linear.sd[channel.rows] * linear.t[channel.rows]
    told = {
        **fit.noise,
        "accelerometer": fit.noise["accelerometer"]._replace(sd=5.0 * fit.noise["accelerometer"].sd, correlation=0.94),
    }
    fit = replace(fit, noise=told)
    found = finding.Search(
        tuple(recordings),
        (),
        replace(fit, noise=stated_noise(linears)),
        stated_noise(linears),
        (),
        *2 * (None,),
        *UNASKED,
    )
    quiet = stepwise.without_swallowed(found, ContinuousFit(Hypothesis(), fit, 0.0, tuple(bent), told))
    assert quiet is not None
    assert quiet.fit.noise == stated_noise(linears)


def test_a_fit_with_one_more_effect_that_is_worse_begins_again_where_the_present_one_is(monkeypatch):
    """Algebra asked for a number far off; from no effect at all the same fit comes to what it gains."""
    recordings = coasts(seconds=1.0)
    fit = Fit(tuple(first_trajectory(one) for one in recordings), (), np.empty(0), SPIN_DOWN.sizes.continuous, {})
    linears = linearised(fit)
    fit = Fit(fit.trajectories, (), np.empty(0), fit.defects, stated_noise(linears), linears=linears)
    base = ContinuousFit(Hypothesis(), fit, 1e4, tuple(linear.residual for linear in linears))
    tilt = free_candidate("rig.axis_tilt")
    size = (("rig.axis_tilt", "tilt_north_rad"), None)

    def told(fit: Fit, hypothesis: Hypothesis, own: object, noise: object, start: dict, *, bars: Bars) -> ContinuousFit:
        return ContinuousFit(hypothesis, fit, 2e4 if size in start else 0.0)

    monkeypatch.setattr(searching, "continuous_fit", told)
    monkeypatch.setattr(searching, "chi2_in", lambda fitted, noise: 1.1 * fitted.fit.count)
    monkeypatch.setattr(finding, "chi2_in", lambda fitted, noise: 1.1 * fitted.fit.count)
    monkeypatch.setattr(finding, "normal_equations_of", lambda *_, **__: None)
    monkeypatch.setattr(searching, "searched", lambda *_: [])
    monkeypatch.setattr(searching, "screened_candidates", lambda *_: [])
    monkeypatch.setattr(searching, "one_per_effect", lambda _: [ScreenedCandidate(tilt, 1e6, {size: 0.3})])
    found = finding.Search(tuple(recordings), (), fit, fit.noise, (tilt,), base, base, *UNASKED)
    _, best = searching.next_effect(found, base, 0)
    assert best is not None
    assert best.hypothesis.candidates == (tilt,)


def test_far_from_the_data_what_sensors_asked_of_one_another_is_refitted_first_and_beside_it_is_not(monkeypatch):
    hint = hinted(effect("gyro.clock_rate", ratio=1.014))
    assert step(monkeypatch, far=True, right=RIGHT, hints=[hint])[1][0] == "gyro.clock_rate"
    assert step(monkeypatch, far=False, right=RIGHT, hints=[hint])[1][0] == RANKED[0].id


def exchanged(monkeypatch: pytest.MonkeyPatch, without_scale: float) -> set[str] | None:
    """Return what an offset, a scale and a turned board give way to, where a place could be in place of the board.

    ``without_scale`` is the score of the offset and the place alone; that of the three is 40, with the place 42.
    """
    recordings = coasts(seconds=1.0)
    fit = Fit(tuple(first_trajectory(one) for one in recordings), (), np.empty(0), SPIN_DOWN.sizes.continuous, {})
    linears = linearised(fit)
    fit = Fit(fit.trajectories, (), np.empty(0), fit.defects, stated_noise(linears), linears=linears)
    offset, scale, board, place = map(
        free_candidate, ("accel.time_offset", "accel.scale", "board.rotation", "accel.position_offset")
    )

    def told(fit: Fit, hypothesis: Hypothesis, *others: object, bars: Bars) -> ContinuousFit:
        return ContinuousFit(hypothesis, fit, without_scale if set(hypothesis.candidates) == {offset, place} else 1e4)

    monkeypatch.setattr(exchange, "continuous_fit", told)
    monkeypatch.setattr(exchange, "possible", lambda _: True)
    final = ContinuousFit(Hypothesis((offset, scale, board)), fit, 40.0)
    base = ContinuousFit(Hypothesis(), fit, 1e6)
    found = finding.Search(tuple(recordings), (), fit, fit.noise, (), base, final, *UNASKED)
    with_place = ContinuousFit(Hypothesis((offset, scale, place)), fit, 42.0)
    rivals = {board.name: [finding.Rival(place, 2.0, with_place)]}
    better = exchange.exchanged(replace(found, rivals=rivals))
    return None if better is None else {candidate.id for candidate in better.hypothesis.candidates}


def test_a_rival_that_makes_another_effect_superfluous_takes_the_place_of_both(monkeypatch):
    assert exchanged(monkeypatch, without_scale=45.0) == {"accel.time_offset", "accel.position_offset"}


def test_a_rival_that_explains_no_more_than_the_named_effects_does_not(monkeypatch):
    """Three parameters fewer are worth 24; what they explained beyond that is missed."""
    assert exchanged(monkeypatch, without_scale=90.0) is None


def scope(monkeypatch: pytest.MonkeyPatch, everywhere: float) -> frozenset[int] | None:
    """Return the recordings of a stall that was proposed in the second of two and scores 40 there, or None for all.

    ``everywhere`` is its score in both.
    """
    recordings = coasts(seconds=1.0)
    fit = Fit(tuple(first_trajectory(one) for one in recordings), (), np.empty(0), SPIN_DOWN.sizes.continuous, {})
    linears = linearised(fit)
    fit = Fit(fit.trajectories, (), np.empty(0), fit.defects, stated_noise(linears), linears=linears)
    stall = replace(free_candidate("aero.stall"), recordings=frozenset([1]))
    monkeypatch.setattr(
        exchange, "continuous_fit", lambda fit, hypothesis, *_, bars: ContinuousFit(hypothesis, fit, everywhere)
    )
    monkeypatch.setattr(exchange, "possible", lambda _: True)
    monkeypatch.setattr(exchange, "unreliable", lambda *_: False)
    base, final = ContinuousFit(Hypothesis(), fit, 1e6), ContinuousFit(Hypothesis((stall,)), fit, 40.0)
    found = finding.Search(tuple(recordings), (), fit, fit.noise, (), base, final, *UNASKED)
    (candidate,) = exchange.widened(found, final).hypothesis.candidates
    return candidate.recordings


def test_an_effect_that_one_recording_shows_is_named_in_all_where_the_others_do_not_contradict_it(monkeypatch):
    """Of two recordings one alone is worth 2 ln 2 + 6 = 7.4: what choosing it costs."""
    assert scope(monkeypatch, everywhere=47.3) is None


def test_an_effect_that_the_others_contradict_stays_in_its_recording(monkeypatch):
    assert scope(monkeypatch, everywhere=47.5) == {1}


def test_a_centre_of_mass_off_the_disc_is_not_refitted_and_a_sensor_s_unknown_place_is():
    """Where a path alone is recorded algebra asks for metres of the one; along the axis nothing shows the other."""
    recordings = throws(seconds=0.3)
    base = ContinuousFit(Hypothesis(), Fit((), (), np.empty(0), FLIGHT.sizes.continuous, {}), 0.0)
    found = finding.Search(tuple(recordings), (), base.fit, {}, (), base, base, *UNASKED)
    radius = 0.5 * recordings[0].disc.diameter

    def tried(id: str, name: str, value: float) -> bool:
        return on_the_disc(found, {((id, name), None): value})

    assert tried("body.mass_imbalance", "ex_m", 0.9 * radius)
    assert not tried("body.mass_imbalance", "ex_m", -1.1 * radius)
    assert tried("accel.position_offset", "dz_m", 3.0 * radius)
    assert tried("air.wind", "w_north_m_s", 30.0)


@pytest.mark.parametrize(
    ("was", "left", "further", "stops"),
    [
        # of a bearing that holds in places of a turn a kick explains next to nothing
        (2910.7, 2910.2, 6, True),
        # six equal effects, of which the second is found: each took as much as is left for one
        (5.0, 4.0, 4, False),
        # three times as much as six such steps take is left
        (20.1, 19.1, 6, True),
        (18.9, 17.9, 6, False),
        # beside the data the search goes on until nothing is worth its price
        (1.16, 1.15, 1, False),
    ],
)
def test_the_search_ends_where_all_further_effects_cannot_take_what_is_left(monkeypatch, was, left, further, stops):
    recordings = coasts(seconds=1.0)
    fit = Fit(tuple(first_trajectory(one) for one in recordings), (), np.empty(0), SPIN_DOWN.sizes.continuous, {})
    linears = linearised(fit)
    fit = Fit(fit.trajectories, (), np.empty(0), fit.defects, stated_noise(linears), linears=linears)
    before, after = ContinuousFit(Hypothesis(), fit, 1e4), ContinuousFit(Hypothesis(), fit, 0.0)
    found = finding.Search(tuple(recordings), (), fit, fit.noise, tuple(RANKED), before, before, *UNASKED)

    def chi2(fitted: ContinuousFit, noise: object) -> float:
        return (was if fitted is before else left) * fit.count

    monkeypatch.setattr(stepwise, "chi2_in", chi2)
    assert stepwise.past_hope(found, before, after, further) is stops


@pytest.mark.slow
def test_a_search_that_comes_to_more_effects_than_are_of_use_is_given_up_as_it_stands():
    """Rivals of a stack that nobody takes, and fits without each of it, are most of the time that it takes."""
    errors = [
        effect("accel.scale", sx=0.02, sy=0.02, sz=0.0),
        effect("mag.hard_iron", bx_uT=2.0, by_uT=-1.0, bz_uT=0.0),
    ]
    recordings = coasts((), errors)
    whole, given_up, of_use = (
        stepwise.search(SearchProblem(recordings), anew=stepwise.Anew(most)) for most in (None, 0, 1)
    )
    assert [len(found.final.hypothesis.candidates) for found in (whole, given_up, of_use)] == [2, 2, 2]
    assert whole.rivals
    assert of_use.rivals.keys() == whole.rivals.keys()
    assert given_up.rivals == {}


def test_only_an_accelerometer_whose_place_nobody_states_may_sit_anywhere():
    """Where it sits is then no error: it counts in no stack of effects, and no law stands for it."""
    stated = throws(seconds=0.5)[0]
    sheet = replace(stated.sheets["accelerometer"], position=None)
    unstated = replace(stated, sheets={**stated.sheets, "accelerometer": sheet})
    assert stand_ins([stated]) == ()
    [candidate] = stand_ins([stated, unstated])
    assert candidate.id == "accel.position_offset"
    assert len(candidate.columns) == 3
