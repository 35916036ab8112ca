"""What to record next: expected evidence against the evidence that a recording brings once it is made in MuJoCo."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from support.made import FIELD, RIG, coasting, coasts, tables, throws

from discsim.effects import effect
from discsim.errors import InputError
from discsim.rig import spin_down
from discsim.validation.diagnosis.assemble import outcome_of
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, candidates_for
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.design.next_recording import ENOUGH, advise, confusions, expected_evidence, in_words
from discsim.validation.diagnosis.design.plans import plans_about, read_plans
from discsim.validation.diagnosis.progress import silent
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.result import Advice, Diagnosis, Separation
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import Rival, Search, values_of_fit
from discsim.validation.diagnosis.selection.stepwise import search
from discsim.validation.diagnosis.setup import SetupFindings
from discsim.validation.diagnosis.stages import Prepared, Question, Tried
from discsim.validation.diagnosis.verdict import judged
from discsim.validation.identification.plants import PLANTS
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.plants.rig import LEAN

STRETCHED = effect("accel.scale", sx=0.02, sy=0.02, sz=0.0)


@cache
def stretched() -> Search:
    """Two run-downs with an accelerometer that reads 2 % too much: as if it sat 2 % further out."""
    return search(SearchProblem(coasts((), [STRETCHED])))


def answer_of(found: Search) -> Diagnosis:
    """What is answered where a search has found this in two recordings that were set up well."""
    ready = Prepared(SetupFindings((), found.recordings), found.recordings, found.recordings, (), ((), ()))
    question = Question(found.recordings, ("01", "02"), ("set",))
    return outcome_of(judged(Tried(ready, None, found), silent), question).diagnosis


def the_rival(found: Search) -> Rival:
    """Return the scale; a lag of a quarter of a second reads alike, too, where all decays in proportion to itself."""
    (candidate,) = found.final.hypothesis.candidates
    (rival, late) = confusions(found, candidate)
    assert late.candidate.id == "accel.lag"
    return rival


def trial_of(id: str, only: int | None = None) -> CandidateEffect:
    candidate = next(candidate for candidate in candidates_for(coasts()) if candidate.id == id)
    return CandidateEffect(candidate.id, candidate.columns, None if only is None else frozenset([only]))


def evidence_once_made(rate: float, lean: float) -> float:
    """How much a third run-down, made in MuJoCo, adds to what speaks for the offset and against the scale.

    Its accelerometer reads too much by what was found, since two run-downs determine dy to 0.3 mm only.
    """
    fit, rival = stretched().final.fit, the_rival(stretched())
    (named,) = stretched().final.hypothesis.candidates
    found = effect(named.id, **{q.name: float(value) for q, value in zip(fit.parameters, fit.at, strict=True)})
    hidden = [effect("rig.axis_tilt", tilt_north_rad=lean, tilt_east_rad=0.0)] if lean else []
    motion = spin_down(RIG, FIELD, rate, 4.0, hidden, yaw=1.1)
    recordings = [*coasts((), [STRETCHED]), coasting(motion, RIG, 2, [found])]
    relaxed_fit = relaxed(recordings)
    rest = (trial_of("rig.axis_tilt", 2),) if lean else ()
    noise = stretched().final.fit.noise
    start = {(("rig.axis_tilt", "tilt_north_rad"), frozenset([2])): lean}
    scores = [
        continuous_fit(relaxed_fit, Hypothesis((trial_of(id), *rest)), (), noise, start).score
        for id in (rival.candidate.id, named.id)
    ]
    return scores[0] - scores[1] - rival.worse


def test_run_downs_cannot_tell_a_scale_from_an_offset_along_the_radius_and_a_leant_axis_can():
    found = stretched()
    # the fewer numbers that readings tell: of an offset along the radius one, of a scale one for gravity, too
    assert [candidate.id for candidate in found.final.hypothesis.candidates] == ["accel.position_offset"]
    assert the_rival(found).candidate.id == "accel.scale"
    advice = advise(found, ["01", "02"])["accel.position_offset", "accel.scale"]
    assert "leant" in advice.best.recording
    assert advice.best.expected_chi2 > ENOUGH
    assert advice.again is not None
    assert advice.again.expected_chi2 < 2.0


def test_the_expected_evidence_is_what_the_recording_brings_once_it_is_made():
    plans = plans_about(stretched().final.fit.trajectories[0], 4.0)
    leant = next(plan for plan in plans if plan.lean == (LEAN, 0.0) and plan.state[1] == pytest.approx(60.0, rel=0.01))
    faster = next(plan for plan in plans if not any(plan.lean) and plan.state[1] > 100.0)
    like = int(np.argmax([trajectory.states[0, 1] for trajectory in stretched().final.fit.trajectories]))
    good, bad = expected_evidence(stretched(), the_rival(stretched()), [leant, faster], like)
    # noise moves a gain of G by a standard deviation of 2 sqrt(G)
    assert evidence_once_made(60.0, LEAN) == pytest.approx(good, abs=3.0 * 2.0 * np.sqrt(good))
    assert good > ENOUGH
    assert bad < 2.0
    assert evidence_once_made(float(faster.state[1]), 0.0) < 12.0


def test_longer_recordings_of_a_kind_are_expected_to_say_more():
    (short, long) = (Plan("", np.array([0.3, 60.0, *np.zeros(11)]), T, lean=(LEAN, 0.0)) for T in (2.0, 6.0))
    few, many = expected_evidence(stretched(), the_rival(stretched()), [short, long], 0)
    assert 1.5 * few < many < 6.0 * few


def test_the_answer_says_what_to_record_next():
    found = stretched()
    diagnosis = answer_of(found)
    told, late = diagnosis.to_json()["effects"][0]["confused_with"]
    assert (told["id"], late["id"]) == ("accel.scale", "accel.lag")
    assert set(told["separated_by"]) == {"recording", "expected_chi2"}
    assert (
        told["separated_by"]["expected_chi2"]
        >= told["runner_up"]["expected_chi2"]
        > told["same_again"]["expected_chi2"]
    )
    assert told["separated_by"]["recording"] in told["next_recording"]
    assert len(diagnosis.next_recordings) == 2
    for sentence in diagnosis.next_recordings:
        assert sentence.startswith("To tell")


def test_where_nothing_is_confused_the_answer_says_so():
    found = search(SearchProblem(coasts([effect("rig.coulomb_friction", torque_N_m=1e-4)])))
    assert advise(found, ["01", "02"]) == {}
    (sentence,) = answer_of(found).next_recordings
    assert sentence.startswith("Nothing more is needed")


@pytest.mark.parametrize(
    ("best", "words"), [(300.0, "settles it"), (5.0, "5 times"), (0.1, "no recording that was tried settles it")]
)
def test_weak_evidence_is_not_sold_as_strong(best: float, words: str):
    assert words in in_words("accel.scale", Advice(Separation("a run", best)))


def test_what_happened_once_has_no_next_recording():
    assert "happened once" in in_words("event.impulse", None)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("make", "hidden", "rival"),
    [
        (throws, effect("air.wind", w_north_m_s=1.0, w_east_m_s=-0.5), "aero.spin_side_force"),
        (tables, effect("rig.axis_tilt", tilt_north_rad=0.01, tilt_east_rad=0.0), "accel.bias"),
    ],
)
def test_every_built_in_recording_can_be_simulated(make, hidden, rival):  # type: ignore[no-untyped-def]
    recordings = make([hidden])
    found = search(SearchProblem(recordings))
    (candidate,) = found.final.hypothesis.candidates
    other = next(item for item in found.candidates if item.id == rival)
    fitted = continuous_fit(
        found.final.fit, Hypothesis((other,)), found.own, found.final.fit.noise, values_of_fit(found.final)
    )
    plans = plans_about(found.final.fit.trajectories[0], 1.5)
    assert 12 <= len(plans) <= 20
    assert len({plan.text for plan in plans}) == len(plans)
    assert plans[0].text.startswith("the same")
    evidence = expected_evidence(found, Rival(other, 0.0, fitted), plans, 0)
    assert np.all(np.isfinite(evidence))
    assert candidate.id == hidden.id
    assert max(evidence) > ENOUGH


def test_a_throw_that_starts_on_the_ground_has_no_evidence():
    found = search(SearchProblem(throws([effect("air.wind", w_north_m_s=1.0, w_east_m_s=-0.5)])))
    state = found.final.fit.trajectories[0].states[0].copy()
    state[2] = 0.1
    rival = Rival(found.final.hypothesis.candidates[0], 0.0, found.final)
    assert np.isnan(expected_evidence(found, rival, [Plan("", state, 2.0)], 0)[0])


OWN = {
    "flight": "velocity_ned_m_s = [14.0, 0.0, -2.0]\nroll_rad = 0.1\nbody_rate_rad_s = [0.0, 0.0, -40.0]",
    "spin_down": "rate_rad_s = 30.0\nduration_s = 60.0\ntilt_north_rad = 0.2",
    "rate_table": "time_s = [0.0, 1.0, 5.0]\nrate_rad_s = [0.0, 40.0, 40.0]",
    "free_spin": "duration_s = 3.0\nbody_rate_rad_s = [2.0, 0.0, 50.0]\npitch_rad = 0.5",
}


@pytest.mark.parametrize("plant", OWN)
def test_a_persons_own_list_is_read(plant, tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text(f'[[recording]]\ntext = "as I like it"\n{OWN[plant]}\n\n[[recording]]\n{OWN[plant]}\n')
    named, described = read_plans(file, plant)
    assert named.text == "as I like it"
    assert "turns" in described.text
    assert described.state.shape == (PLANTS[plant].layout.size,)
    assert described.duration > 0.0


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "[[recording]]"),
        ("[[recording]]\nrate_rad_s = 3.0", "duration_s"),
        ("[[recording]]\nrate_rad_s = 3.0\nduration_s = 1.0\nspeed = 2.0", "unknown key"),
    ],
)
def test_a_list_that_cannot_be_used_is_refused_with_what_was_expected(text, expected, tmp_path: Path):
    file = tmp_path / "mine.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=expected.replace("[", r"\[")):
        read_plans(file, "spin_down")
