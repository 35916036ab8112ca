"""A gyroscope or an accelerometer on a rig whose clock is so far off that its readings would pass for slow noise."""

from __future__ import annotations

import pytest
from support.made import tables

from discsim.effects import effect
from discsim.recording import Recording
from discsim.validation.challenge.cases.conceal import recordings as concealed
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.clocks import clock_of_accelerometer
from discsim.validation.diagnosis.selection.next_effect import next_effect
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.stepwise import search
from discsim.validation.identification.stated_parameters import stated_parameters

FAST = effect("gyro.clock_rate", ratio=1.017)
KEY = ("gyro.clock_rate", "ratio")


def clock_in(recordings: list[Recording]) -> float | None:
    """Return the gyroscope's clock in a relaxed fit, None where it has none."""
    fit = relaxed(recordings, stated_parameters(recordings))
    return next((float(v) for q, v in zip(fit.parameters, fit.at, strict=True) if q.key == KEY), None)


def test_the_relaxed_fit_of_a_table_takes_the_clock_up():
    assert clock_in(tables(errors=[FAST])) == pytest.approx(1.017, abs=1e-4)


def test_a_clock_that_is_right_is_left_alone():
    assert clock_in(tables()) is None


def test_a_scale_is_not_taken_for_a_clock():
    assert clock_in(tables(errors=[effect("gyro.scale", sx=0.0, sy=0.0, sz=0.03)])) is None


def test_it_is_named_alone():
    final = search(SearchProblem(tables(errors=[FAST]))).final
    assert [candidate.id for candidate in final.hypothesis.candidates] == ["gyro.clock_rate"]
    place = [q.key for q in final.fit.parameters].index(KEY)
    assert final.fit.at[place] == pytest.approx(1.017, abs=3e-4)


def told(recordings: list[Recording]) -> float | None:
    """Return the accelerometer's clock that the corners of a rig's rate tell, None where they tell none."""
    found = clock_of_accelerometer(relaxed(recordings, stated_parameters(recordings)))
    return None if found is None else float(found.value.ratio)


def test_corners_tell_the_clock_of_an_accelerometer():
    assert told(tables(errors=[effect("accel.clock_rate", ratio=1.017)])) == pytest.approx(1.017, abs=6e-4)


@pytest.mark.parametrize(
    "error", [[], [effect("accel.scale", sx=0.03, sy=0.0, sz=0.0)], [effect("accel.lag", tau_s=0.2)]]
)
def test_corners_tell_no_clock_where_there_is_none(error):
    assert told(tables(errors=error)) is None


def test_the_clock_of_an_accelerometer_is_named_beside_a_bias():
    """Offsets in time, one recording's own clock and a bias came first, and nothing explained the rest."""
    errors = [
        effect("accel.clock_rate", ratio=1.0168),
        effect("gyro.bias", bx_rad_s=0.0046, by_rad_s=0.0014, bz_rad_s=-0.0002),
    ]
    final = search(SearchProblem(tables(errors=errors))).final
    assert {candidate.id for candidate in final.hypothesis.candidates} == {"accel.clock_rate", "gyro.bias"}


@pytest.mark.slow
def test_what_was_told_is_fitted_in_stated_noise():
    """Noise estimated without the clock had swallowed it: its fit stopped at once, and lost samples were named.

    That takes half a minute of a table; this case of the blind test was answered so.
    """
    found = screened(SearchProblem(concealed(draw_case(160003, "rate_table", ["accel.clock_rate"]))))
    assert [hint.candidate.id for hint in found.hints] == ["accel.clock_rate"]
    _, best = next_effect(found, found.base, 0)
    assert best is not None
    assert [candidate.id for candidate in best.hypothesis.candidates] == ["accel.clock_rate"]
    assert not best.unmodelled()
