"""Laws read from text: the same numbers in plain Python, over arrays and compiled, in whatever frame."""

from __future__ import annotations

from math import copysign, cos, exp, hypot, sin, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.flights import DRIVER, FIELD, throw

from discsim.aerodynamics import air_wrench, total_wrench
from discsim.engine import fly
from discsim.errors import InputError
from discsim.law import SYMBOLS, WIND_TARGETS, WRENCH_TARGETS, Law, law_wind, law_wrench
from discsim.parameters import PARAMETERS, parameters, tables
from discsim.trajectory import predict

STATE = {"t": 1.5, "h": 2.0, "V": 17.0, "alpha": -0.1, "p_H": 2.0, "q_H": -3.0, "r": -60.0}
COEFFICIENTS = {"c": 3e-6, "n": 1.5, "b": -2e-3, "tau": 3.0}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("c * |r|^n * sign(r)", -3e-6 * 60.0**1.5),
        ("-c |r|^n sign(r) + b·V^2", 3e-6 * 60.0**1.5 - 2e-3 * 17.0**2),
        ("b r V", 2e-3 * 60.0 * 17.0),
        ("b * r**2", -2e-3 * 3600.0),
        ("b r^3 / V^2", 2e-3 * 60.0**3 / 17.0**2),
        ("b |r| |alpha|^0.5", -2e-3 * 60.0 * sqrt(0.1)),
        ("b * alpha^2 q_H - 2.5e-1 p_H", -2e-3 * 0.01 * -3.0 - 0.5),
        ("b h^(-1) + c t", -1e-3 + 4.5e-6),
        ("c^2 * r", -9e-12 * 60.0),
        ("b sign(r) sign(alpha)", -2e-3),
        ("b", -2e-3),
        ("b exp(-t/tau)", -2e-3 * exp(-0.5)),
        ("b * V / exp(-t/tau) + exp(-t / 0.5)", -2e-3 * 17.0 * exp(0.5) + exp(-3.0)),
        ("b V sin(tau t - 1)", -2e-3 * 17.0 * sin(3.5)),
        ("2 cos(1) + cos(t)", 2.0 * cos(1.0) + cos(1.5)),
    ],
)
def test_a_law_is_what_its_text_says(text, expected):
    law = Law(text, "moment_z_N_m", COEFFICIENTS)
    assert float(law.evaluate(STATE)) == pytest.approx(expected, rel=1e-13)


@given(V=st.floats(1.0, 40.0), beta=st.floats(-3.1, 3.1), alpha=st.floats(-1.0, 1.0), r=st.floats(-120.0, 120.0))
def test_the_compiled_law_acts_in_the_heading_frame_whatever_the_frame_it_is_asked_in(V, beta, alpha, r):
    u, v, w = V * cos(alpha) * cos(beta), V * cos(alpha) * sin(beta), V * sin(alpha)
    p_H, q_H = 2.0, -3.0
    P, Q = p_H * cos(beta) - q_H * sin(beta), p_H * sin(beta) + q_H * cos(beta)
    state = {"t": 1.5, "h": 2.0, "V": V, "alpha": alpha, "p_H": p_H, "q_H": q_H, "r": r}
    for place, target in enumerate(WRENCH_TARGETS):
        law = Law("b |r|^0.7 V q_H + 0.1 alpha p_H cos(tau t + 1)", target, COEFFICIENTS)
        out = np.array(law_wrench(law.rows, 1.5, 2.0, u, v, w, P, Q, r)[:6]).reshape(2, 3)
        in_heading = np.stack(
            [out[:, 0] * cos(beta) + out[:, 1] * sin(beta), -out[:, 0] * sin(beta) + out[:, 1] * cos(beta), out[:, 2]],
            axis=1,
        ).ravel()
        expected = np.zeros(6)
        expected[place] = law.evaluate(state)
        # rounding of the angles; the law itself is of order one
        np.testing.assert_allclose(in_heading, expected, rtol=1e-10, atol=1e-11)


def test_a_rigs_axis_needs_its_spin_alone():
    law = Law("-c |r|^n sign(r)", "moment_z_N_m", COEFFICIENTS)
    for r in (-80.0, 0.0, 80.0):
        wrench = law_wrench(law.rows, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, r)
        assert wrench[:5] == (0.0, 0.0, 0.0, 0.0, 0.0)
        assert wrench[5] == pytest.approx(copysign(3e-6 * abs(r) ** 1.5, -r) if r else 0.0, rel=1e-13)


def test_a_rigs_axis_may_hold_its_own_angle_and_nothing_else_may():
    law = Law("c * cos(3 yaw + n)", "moment_z_N_m", COEFFICIENTS)
    assert law_wrench(law.rows, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 50.0, 0.7)[5] == pytest.approx(3e-6 * cos(3.6))
    assert float(law.evaluate({"yaw": 0.7})) == pytest.approx(3e-6 * cos(3.6))
    for text, target in (
        ("c cos(yaw)", "magnetometer.x_uT"),
        ("c cos(yaw)", "moment_x_N_m"),
        ("c yaw", "moment_z_N_m"),
    ):
        with pytest.raises(InputError, match="yaw"):
            Law(text, target, COEFFICIENTS)
    with pytest.raises(InputError, match="yaw is the angle of a rig"):
        fly(DRIVER, FIELD, throw(), duration=1.0, law=law)


def test_a_law_about_a_sensor_may_hold_its_reading():
    law = Law("b * x * |x|", "accelerometer.x_m_s2", COEFFICIENTS)
    x = np.array([-10.0, 0.0, 5.0])
    np.testing.assert_allclose(law.evaluate({"x": x}), -2e-3 * x * np.abs(x), rtol=1e-13)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("b cos(psi)", -2e-3 * cos(7.0)),
        ("b cos(n psi + tau) - c sin(2 * psi)", -2e-3 * cos(1.5 * 7.0 + 3.0) - 3e-6 * sin(14.0)),
        ("b r sin(0.5psi - 1) exp(-t/tau)", 0.12 * sin(2.5) * exp(-0.5)),
        ("b cos(psi - n * t + tau)", -2e-3 * cos(7.0 - 2.25 + 3.0)),
        ("sin(-tau t + 2 psi)", sin(14.0 - 4.5)),
    ],
)
def test_a_law_about_a_sensor_may_repeat_as_the_disc_turns(text, expected):
    law = Law(text, "magnetometer.x_uT", COEFFICIENTS)
    assert float(law.evaluate({**STATE, "psi": 7.0})) == pytest.approx(expected, rel=1e-12)


def test_what_a_reading_shows_behind_a_play():
    """It stands still until it has turned by twice the play; up and down again it comes back by that much late."""
    x = np.concatenate([np.linspace(0.0, 5.0, 51), np.linspace(5.0, -5.0, 101)])
    law = Law("2 play(x, w) - x", "accelerometer.x_m_s2", {"w": 1.0})
    shown = 0.5 * (law.evaluate({"x": x}) + x)
    assert shown[50] == pytest.approx(4.0)
    # at rest from 5 down to 3, then as far above as it was below before
    np.testing.assert_allclose(shown[50:71], 4.0, atol=1e-12)
    np.testing.assert_allclose(shown[71:], x[71:] + 1.0, atol=1e-12)
    # the same of one number: a play that has not turned yet shows what there is
    assert float(law.evaluate({"x": 3.0})) == 3.0


def test_both_engines_fly_a_law():
    """One second, in which the law takes two metres; RK4 at 1 ms keeps to 1e-5 m."""
    law = Law("c |V|^1.5 |r|^0.5 sign(r)", "force_y_N", {"c": 2e-3})
    truth, flight = (
        fly(DRIVER, FIELD, throw(), duration=1.0, law=law),
        predict(DRIVER, FIELD, throw(), duration=1.0, law=law),
    )
    np.testing.assert_allclose(flight.at(1.0).position[0], truth.position[-1], atol=1e-5)
    without = predict(DRIVER, FIELD, throw(), duration=1.0)
    assert np.linalg.norm(flight.at(1.0).position - without.at(1.0).position) > 2.0


PLACE = {"w": 1.5, "a": 12.0, "b": -3.0, "s": 8.0}
RISING = "w * exp(-((north - a)^2 + (east - b)^2) / (2 s^2))"


@pytest.mark.parametrize("text", [RISING, "w exp(-((north-12)**2+(east+3)**2)/(2*s^2))"])
@pytest.mark.parametrize("target", WIND_TARGETS)
def test_a_wind_may_blow_about_a_place(text, target):
    law = Law(text, target, PLACE)
    for north, east in ((12.0, -3.0), (0.0, 4.0), (20.0, -3.0)):
        expected = 1.5 * exp(-((north - 12.0) ** 2 + (east + 3.0) ** 2) / 128.0)
        assert float(law.evaluate({"north": north, "east": east})) == pytest.approx(expected, rel=1e-13)
        blown = dict(zip(WIND_TARGETS, np.array(law_wind(law.rows, 0.0, 2.0, north, east)) * (1, 1, -1), strict=True))
        assert blown.pop(target) == pytest.approx(expected, rel=1e-13)
        assert set(blown.values()) == {0.0}
    # it moves the air, and no force is added to what the air does
    assert law_wrench(law.rows, 0.0, 2.0, 20.0, 1.0, 1.0, 0.0, 0.0, 60.0) == (0.0,) * 7


def test_a_wind_may_change_with_time_and_height():
    law = Law("w |h|^0.5 exp(-t/s) cos(2 t + 1) - 2 t sign(t)", "wind_east_m_s", PLACE)
    expected = 1.5 * sqrt(4.0) * exp(-0.25) * cos(5.0) - 4.0
    assert law_wind(law.rows, 2.0, 4.0, 0.0, 0.0)[1] == pytest.approx(expected, rel=1e-13)
    assert float(law.evaluate({"t": 2.0, "h": 4.0})) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(
    ("text", "target", "expected"),
    [
        (RISING, "force_z_N", "only in a law about the wind"),
        ("w V", "wind_up_m_s", "the same for every disc"),
        ("w sign(r)", "wind_up_m_s", "the same for every disc"),
        ("w exp(-((north - a)^2 + (east - b)^2) / (2 b^2))", "wind_up_m_s", "-3 m wide"),
        ("w exp(-((east - a)^2 + (north - b)^2) / (2 s^2))", "wind_up_m_s", "where north belongs"),
        ("w north", "wind_up_m_s", "unknown 'north'"),
        (f"{RISING} exp(-((north - 1)^2 + (east - 1)^2) / (2 s^2))", "wind_up_m_s", "a second place"),
    ],
)
def test_a_wind_that_is_none_is_refused(text, target, expected):
    with pytest.raises(InputError, match=expected):
        Law(text, target, PLACE)


def test_both_engines_fly_through_air_that_rises_about_a_place():
    """RK4 at 1 ms keeps to 1e-5 m of what the other engine says; the rising air lifts the disc by decimetres."""
    law = Law(RISING, "wind_up_m_s", PLACE)
    truth = fly(DRIVER, FIELD, throw(), duration=1.0, law=law)
    flight = predict(DRIVER, FIELD, throw(), duration=1.0, law=law)
    np.testing.assert_allclose(flight.at(1.0).position[0], truth.position[-1], atol=1e-5)
    without = predict(DRIVER, FIELD, throw(), duration=1.0)
    assert without.at(1.0).position[0, 2] - truth.position[-1, 2] > 0.2


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("b exp(t/tau)", "belongs"),
        ("b exp(-t/0)", "a time constant of zero"),
        ("b cos(r)", "unknown .r."),
        ("c cos(psi)", "only in a law about a sensor"),
        ("c *", "found the end where a factor belongs"),
        ("", "found the end"),
        ("c r^n", r"write \|r\|\^1.5"),
        ("c |r", r"found the end where \| belongs"),
        ("c * q", "unknown 'q'"),
        ("c $ r", "cannot read"),
        ("c + * r", r"unknown '\*'"),
        ("c x", "only in a law about a sensor"),
        ("b^n r", "to the power"),
        ("c sign r", r"found 'r' where \( belongs"),
        ("c (r + V)", r"unknown '\('"),
        ("10^400 r", "10 to the power 400"),
        ("1e999 r", "not finite"),
        ("nan r", "not finite"),
        ("|r|^99", "a power above 30"),
        ("b * " * 3000 + "r", "12001 characters, at most 5000 are read"),
        ("|" * 4000, "belongs"),
        ("r^1e400", "to a power that is no integer"),
        ("2^1e400", "not finite"),
        ("|r|^1e400", "not finite"),
        ("r \x1b[31m", r"cannot read '\\x1b\[31m'"),
        ("r \u202e", r"cannot read '\\u202e'"),
        ("play(x, 1)", "only in a law about a sensor"),
        ("play(r, 1)", "found 'r' where x or y or z belongs"),
        ("play(x, 0)", "a play of 0"),
        ("play(x, -1)", "unknown '-'"),
        ("play(x)", r"found '\)' where , belongs"),
        ("play(x, 1) play(y, 1)", "a second play"),
        ("r / play(x, 1)", "below a stroke"),
        ("x play(x, 1)", "a play times a reading"),
    ],
)
def test_a_text_that_is_no_law_is_refused_with_the_place(text, expected):
    with pytest.raises(InputError, match=expected) as refused:
        Law(text, "moment_z_N_m", COEFFICIENTS)
    assert str(refused.value).isprintable()


@pytest.mark.parametrize("target", WRENCH_TARGETS)
def test_a_law_is_added_to_what_the_air_does(target):
    """Straight ahead the heading frame is that of the arguments; the sum differs by rounding."""
    p = parameters(FIELD, DRIVER).view(PARAMETERS)[0]
    given = (30.0, 20.0, 0.0, 1.0, 0.5, -0.7, 70.0)
    air = np.array(air_wrench(p, tables(DRIVER), *given))
    for coefficient in (0.25, -0.125):
        law = Law("c", target, {"c": coefficient})
        total = np.array(total_wrench(p, tables(DRIVER, law), 0.0, *given))
        np.testing.assert_allclose(total - air, coefficient * (np.array(WRENCH_TARGETS) == target), atol=1e-14)


def test_a_share_of_the_air_multiplies_what_it_does():
    p = parameters(FIELD, DRIVER).view(PARAMETERS)[0]
    given = (30.0, 20.0, 0.0, 1.0, 0.5, -0.7, 70.0)
    air = np.array(air_wrench(p, tables(DRIVER), *given))
    law = Law("c exp(-t/tau)", "air_share", {"c": -0.1, "tau": 2.0})
    total = np.array(total_wrench(p, tables(DRIVER, law), 2.0, *given))
    np.testing.assert_allclose(total, air * (1.0 - 0.1 * exp(-1.0)), rtol=1e-12)


@pytest.mark.parametrize("name", ["r", "sign", "exp", "psi", "north", "a b", "2"])
def test_a_coefficient_may_not_be_called_as_something_else(name):
    with pytest.raises(InputError, match=r"a name that is no symbol"):
        Law("1.0 r", "moment_z_N_m", {name: 1.0})


def test_symbols_are_told_from_coefficients_by_name():
    assert len(set(SYMBOLS)) == len(SYMBOLS)
    assert hypot(*Law("r + rr", "moment_z_N_m", {"rr": 2.0}).evaluate({"r": [3.0, -2.0]})) == 5.0
