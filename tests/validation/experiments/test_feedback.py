"""C_Nr fed back into flights: what a right one gives, what a wrong one costs, and what the scores notice."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.recording import Recording
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.experiments.feedback.scoring import (
    LINE,
    OUTPUT_ERROR,
    TABLE,
    Damping,
    Predicted,
    feed_back,
    feedback_checks,
    rate_at_release,
)
from discsim.validation.experiments.feedback.sensitivity import touch_down_shifts
from discsim.validation.yaw_damping import Throw, paper_table

DISC, AIR = load_disc("driver")
RELEASE = load_throw("driver")
FLIGHT = predict(DISC, AIR, RELEASE)
TRUTH = FLIGHT.motion()
assert DISC.aero is not None
CNR = DISC.aero.CNr


def seen(factor: float = 1.0) -> Throw:
    """Return the truth's spin, scaled, as a throw."""
    t = np.linspace(0.1, 6.0, 60)
    spin = factor * FLIGHT.at(t).rate[:, 2]
    nothing = np.empty((0, 6))
    return Throw(Recording("flight", "seen", AIR, DISC), "given", t, spin, np.full(60, 0.01), t[:0], nothing, nothing)


def fed(damping: Damping, factor: float = 1.0) -> Predicted:
    [predicted] = feed_back(TRUTH, RELEASE, DISC, AIR, [damping], {damping.source: seen(factor)})
    return predicted


def test_the_right_damping_and_the_right_spin_give_the_true_flight():
    """The truth is on a grid of 1 ms and both flights at 1e-10: what is left is a micrometre."""
    predicted = fed(Damping("best", OUTPUT_ERROR, CNR))
    assert predicted.landing < 1e-6
    assert predicted.track < 1e-6
    assert predicted.rate == pytest.approx(RELEASE.body_rate[2], rel=1e-9)


def test_the_spin_at_release_is_that_of_all_rates_with_the_decay_taken_off():
    assert rate_at_release(seen(0.97), FLIGHT) == pytest.approx(0.97 * RELEASE.body_rate[2], rel=1e-9)


def test_a_wrong_damping_alone_costs_less_than_the_spin_that_comes_with_it():
    """15 % of C_Nr, as straight lines leave, are worth centimetres; the spin at release that follows, far more."""
    predicted = fed(Damping("fft", LINE, 0.85 * CNR))
    assert 0.02 < predicted.damping_only < 0.2
    assert predicted.landing > 3 * predicted.damping_only


@pytest.mark.parametrize("name", ["paper", "driver"])
def test_a_touch_down_depends_on_the_spin_at_release_far_more_than_on_its_damping(name):
    """The finding of docs/cnr.md: an error of 10 % in C_Nr is worth a twentieth of one in the spin, or less."""
    shifts = touch_down_shifts(DISC, AIR, load_throw(name), np.array([0.1]))
    assert 0.01 < shifts.damping[0] < 0.1
    assert shifts.spin[0] > 20 * shifts.damping[0]


def test_a_flight_that_leaves_the_table_is_no_flight_but_a_reason():
    """The driver's 4200 deg/s lie below the table's 4500."""
    predicted = fed(Damping("best", TABLE, table=paper_table([seen()]).table))
    assert predicted.flight is None
    assert "outside its C_Nr table" in predicted.reason
    assert np.isnan(predicted.landing)


def test_the_score_notices_a_best_that_is_no_better_than_the_accelerometer():
    right, wrong = fed(Damping("best", OUTPUT_ERROR, CNR)), fed(Damping("best", OUTPUT_ERROR, CNR), 0.98)
    other = replace(wrong, damping=Damping("accelerometer, 1 mm", OUTPUT_ERROR, CNR))
    assert all(item.ok for item in feedback_checks("", [right, other]))
    assert not any(item.ok for item in feedback_checks("", [wrong, other]))
