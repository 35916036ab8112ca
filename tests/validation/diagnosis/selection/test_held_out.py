"""Evidence on recordings held out: neither the choice nor the size of an effect saw them."""

from __future__ import annotations

from functools import cache

import pytest
from support.made import coasts

from discsim.effects import effect
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.result import Diagnosis

FRICTION = "rig.coulomb_friction"


@cache
def rubbed(torque: float) -> Diagnosis:
    """The answer about two run-downs with dry friction: one from 60 rad/s, which shows it well, and one from 25."""
    return diagnose([coasts([effect(FRICTION, torque_N_m=torque)])], ["rubbed"]).diagnosis


def test_each_recording_says_what_the_others_choose_without_it():
    """Plain friction is chosen by either run alone; of a weak one the second run, from 25 rad/s, does not tell."""
    assert [item.chosen for item in rubbed(1e-4).heldout] == [(FRICTION,), (FRICTION,)]
    assert [item.chosen for item in rubbed(4e-6).heldout] == [(), (FRICTION,)]
    assert [item["chosen_by_others"] for item in rubbed(4e-6).to_json()["heldout"]] == [[], [FRICTION]]


def test_what_the_others_do_not_choose_gains_nothing_on_the_one_held_out():
    weak = rubbed(4e-6)
    (named,) = weak.effects
    assert named.id == FRICTION
    # the first run would gain 26 by it, with a choice that had seen it
    first, second = (item.delta_log_likelihood for item in weak.heldout)
    assert first < 1.0
    assert second > 2.0
    assert named.evidence.heldout_delta_log_likelihood == pytest.approx(second, abs=1.5)
