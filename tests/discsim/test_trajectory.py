from __future__ import annotations

import dataclasses
import itertools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.flights import BARE, DRIVER, FIELD, throw, turned

from discsim.disc import YawDampingTable
from discsim.effects import effect
from discsim.engine import fly
from discsim.errors import InputError
from discsim.frames import rotation_error
from discsim.sensitivity import RELEASE_COLUMNS, sensitivities
from discsim.shipped import load_disc
from discsim.trajectory import Flight, predict, predict_many, release_state
from discsim.validation.scenarios.engine_comparison import DISCS, compare_engines, strong_throw

WOBBLING = throw(wobble=(4.0, -3.0))


def farthest(one: Flight, two: Flight) -> float:
    """Largest distance on the way, m."""
    t = np.linspace(0.0, min(one.end, two.end), 1500)
    return float(np.linalg.norm(one.at(t).position - two.at(t).position, axis=1).max())


@pytest.mark.parametrize("number", range(8))
def test_both_engines_fly_the_same_strong_flight(number):
    """Four discs, both directions of spin, every effect large: 1 mm and 0.01 deg, stated; half a second of each."""
    pair = compare_engines(strong_throw(np.random.default_rng(number), number), timestep=1e-3, duration=0.5)
    assert pair.position < 1e-3
    assert np.degrees(pair.attitude) < 0.01


def test_both_engines_land_the_driver_together():
    """RK4 at 1 ms lands 1e-7 s and 2e-6 m off; the standalone model is better than that."""
    truth, flight = fly(DRIVER, FIELD, WOBBLING), predict(DRIVER, FIELD, WOBBLING)
    assert flight.touched_down
    assert flight.end == pytest.approx(truth.end, abs=1e-6)
    np.testing.assert_allclose(flight.landing, truth.position[-1], atol=1e-5)
    motion = flight.motion()
    np.testing.assert_allclose(motion.t, truth.t, atol=1e-6)
    assert np.degrees(rotation_error(motion.attitude[:-1], truth.attitude[:-1]).max()) < 1e-3
    np.testing.assert_allclose(motion.acceleration[:-1], truth.acceleration[:-1], atol=1e-4)
    # the rates wobble at 5 rad/s and 68 rad/s: 1e-5 rad of phase are 4e-3 rad/s^2
    np.testing.assert_allclose(motion.angular_acceleration[:-1], truth.angular_acceleration[:-1], atol=4e-3)


def test_in_vacuum_it_touches_down_when_the_parabola_does():
    """Within the 1e-9 s stated; the sums of 12 stages round at 1e-14."""
    flight = predict(BARE, FIELD, throw())
    up = -flight.state[0, 5]
    landing = (up + np.sqrt(up**2 + 2 * FIELD.gravity * 1.3)) / FIELD.gravity
    assert flight.touch_down == pytest.approx(landing, abs=1e-9)
    assert abs(flight.landing[2]) < 1e-9


class TestError:
    @pytest.mark.parametrize("wobble", [(0.0, 0.0), (4.0, -3.0)])
    @pytest.mark.parametrize("disc", DISCS)
    def test_the_default_tolerance_keeps_the_path_to_a_micrometre(self, disc, wobble):
        """The goal, 1e-6 m, against tolerances of 1e-12; tables have a kink in every few degrees of incidence."""
        given, (body, field) = throw(wobble=wobble), load_disc(disc)
        assert farthest(predict(body, field, given), predict(body, field, given, rtol=1e-12, atol=1e-12)) < 1e-6

    def test_steps_end_on_the_kinks_of_a_table_and_of_the_stall(self):
        """Each node that the incidence passes is met by a step's end, also where the nutation only reaches over it.

        1e-7 rad is how near a step ends; what is passed is read off the dense output at 0.05 ms.
        """
        body, field = load_disc("dd2")
        flight = predict(body, field, throw(wobble=(4.0, -3.0)), [effect("aero.stall", k=0.3, alpha_stall_rad=0.2)])
        assert body.aero_table is not None
        nodes = np.append(body.aero_table.alpha, 0.2)

        def incidence(t):
            at = flight.at(t)
            u, v, w = at.in_body(at.velocity).T
            return np.arctan2(w, np.hypot(u, v))

        fine, ends = incidence(np.arange(0.0, flight.end, 5e-5)), incidence(flight.t)
        met = np.abs(ends[:, None] - nodes).min(axis=1) < 2e-7
        passed = sum(int(np.sum(np.diff(np.sign(fine - node)) != 0)) for node in nodes)
        assert passed > 40
        assert met.sum() >= passed

    def test_a_tenth_of_the_tolerance_is_about_a_tenth_of_the_error(self):
        best = predict(DRIVER, FIELD, WOBBLING, rtol=1e-13, atol=1e-13)
        errors = [farthest(predict(DRIVER, FIELD, WOBBLING, rtol=tol, atol=tol), best) for tol in (1e-6, 1e-8, 1e-10)]
        assert all(10.0 < first / second < 1e4 for first, second in itertools.pairwise(errors))

    def test_the_spin_does_not_limit_the_steps_of_an_axisymmetric_disc(self):
        """24 turns of nutation a second remain; 1 ms steps, as MuJoCo takes, would be 6900."""
        assert predict(DRIVER, FIELD, throw(), rtol=1e-8, atol=1e-8).t.size < 530

    @pytest.mark.parametrize("heading_deg", [37.0, 150.0])
    def test_the_steps_do_not_depend_on_where_north_is(self, heading_deg):
        """The error norm is the same in turned axes but for the quaternion's rounding."""
        straight = predict(DRIVER, FIELD, throw())
        other = predict(DRIVER, FIELD, turned(throw(), np.radians(heading_deg)))
        assert other.t.size == straight.t.size
        assert np.linalg.norm(other.landing[:2]) == pytest.approx(np.linalg.norm(straight.landing[:2]), abs=1e-9)


class TestEvents:
    @pytest.mark.parametrize("t_s", [0.011, 0.5, 3.3337])
    def test_a_pulse_of_ten_milliseconds_is_not_stepped_over(self, t_s):
        """In vacuum the whole dv arrives (t_s = 0.011 s: what lies after release, all but 0.136)."""
        release = throw(height=200.0)
        given = [effect("event.impulse", t_s=t_s, dv_east_m_s=0.7), effect("event.spin_step", t_s=t_s, dr_rad_s=5.0)]
        flight = predict(BARE, FIELD, release, given, duration=4.0)
        share = 1.0 - 0.1356661 if t_s == 0.011 else 1.0
        assert flight.state[-1, 4] == pytest.approx(0.7 * share, abs=1e-7)
        assert flight.state[-1, 12] - flight.state[0, 12] == pytest.approx(5.0 * share, abs=1e-6)

    def test_a_narrow_gust_is_not_stepped_over(self):
        given = [effect("air.gust", t_s=3.0, width_s=0.003, w_east_m_s=20.0)]
        coarse = predict(DRIVER, FIELD, throw(), given)
        fine = predict(DRIVER, FIELD, throw(), given, rtol=1e-12, atol=1e-12)
        assert farthest(coarse, predict(DRIVER, FIELD, throw())) > 1e-3
        assert farthest(coarse, fine) < 1e-6


AWKWARD = {
    "straight up": throw(speed=15.0, climb_deg=90.0, roll_deg=0.0, pitch_deg=0.0),
    "straight down": throw(speed=15.0, climb_deg=-90.0, roll_deg=0.0, pitch_deg=0.0, height=20.0),
    "edge on, the axis level and across": throw(roll_deg=90.0, pitch_deg=0.0),
    "edge on, the axis along the flight": throw(climb_deg=0.0, roll_deg=0.0, pitch_deg=90.0),
    "hammer": throw(climb_deg=35.0, roll_deg=170.0, pitch_deg=0.0),
    "pitch beyond the vertical": throw(roll_deg=180.0, pitch_deg=100.0),
    "dropped from rest": throw(speed=0.0, roll_deg=0.0, pitch_deg=0.0),
    "without spin": throw(spin_deg_s=0.0, roll_deg=0.0, pitch_deg=2.0),
}


@pytest.mark.parametrize("disc", ["dd2", "driver", "ultrastar"])
@pytest.mark.parametrize("name", AWKWARD)
def test_no_attitude_is_singular(disc, name):
    """It lands, every state is finite, and the steps do not pile up: 1e-4 s a step while nothing can be resolved."""
    body, field = load_disc(disc)
    flight = predict(body, field, AWKWARD[name], duration=20.0)
    assert flight.touched_down
    assert np.all(np.isfinite(flight.motion().angular_acceleration))
    assert flight.t.size < 2_000 + flight.end / 5e-5


ANGLES = st.one_of(
    st.sampled_from([0.0, 45.0, 90.0, -90.0, 180.0, 90.0 + 1e-9, -90.0 + 1e-4]), st.floats(-180.0, 180.0)
)


@settings(max_examples=60, deadline=None)
@given(
    disc=st.sampled_from(["driver", "dd2", "ultrastar", "cd1", "cd5", "fd2"]),
    roll=ANGLES,
    pitch=ANGLES,
    climb=ANGLES,
    speed=st.sampled_from([0.0, 5.0, 15.0, 30.0]),
    spin=st.sampled_from([0.0, 1.0, -3000.0, 4200.0, 7000.0]),
    wobble=st.sampled_from([(0.0, 0.0), (5.0, 0.0), (-30.0, 30.0)]),
)
def test_no_throw_hangs(disc, roll, pitch, climb, speed, spin, wobble):
    """The budget of the test above, on its axis, edge-on, upside down, at rest, spinning or not."""
    body, field = load_disc(disc)
    release = throw(speed, climb, roll, pitch, 0.0, spin, wobble)
    flight = predict(body, field, release, duration=10.0)
    assert np.all(np.isfinite(flight.state))
    assert flight.t.size < 2_000 + flight.end / 5e-5


def test_a_throw_straight_up_is_mujocos_until_it_falls():
    """The stated 1 mm and 0.01 deg while the air holds the wind to the axis: both engines chatter, neither goes astray.

    On its way down the disc tumbles off its axis, from whatever little it is then off.
    """
    body, field = load_disc("dd2")
    truth, flight = (each(body, field, AWKWARD["straight up"], duration=1.0) for each in (fly, predict))
    at = flight.at(truth.t[:-1])
    np.testing.assert_allclose(at.position, truth.position[:-1], atol=1e-3)
    assert np.degrees(rotation_error(at.attitude, truth.attitude[:-1]).max()) < 0.01


@pytest.mark.parametrize("name", ["edge on, the axis level and across", "hammer", "pitch beyond the vertical"])
def test_awkward_flights_are_mujocos(name):
    """The stated 1 mm and 0.01 deg, on half a second of the tabulated disc."""
    body, field = load_disc("dd2")
    truth, flight = fly(body, field, AWKWARD[name], duration=0.5), predict(body, field, AWKWARD[name], duration=0.5)
    at = flight.at(truth.t[:-1])
    np.testing.assert_allclose(at.position, truth.position[:-1], atol=1e-3)
    assert np.degrees(rotation_error(at.attitude, truth.attitude[:-1]).max()) < 0.01


class TestSensitivity:
    groups = (slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12))
    parameters = (("aero", "CNr"), ("aero", "CL0"), ("disc", "mass"), ("environment", "gravity"))

    def test_it_is_the_difference_of_two_adaptive_flights(self):
        """Flights of tolerance 1e-13 with their own steps, a wider step and Richardson's extrapolation: 1e-6."""
        flight = predict(DRIVER, FIELD, WOBBLING, duration=2.0)
        t = np.linspace(0.1, 2.0, 20)
        found = sensitivities(flight, self.parameters, t)
        assert found.columns[12:] == ("aero.CNr", "aero.CL0", "disc.mass", "environment.gravity")

        def path(column: str, change: float) -> np.ndarray:
            release, disc = WOBBLING, DRIVER
            if column in ("p", "q", "r"):
                release = dataclasses.replace(
                    release, body_rate=release.body_rate + change * np.eye(3)["pqr".index(column)]
                )
            elif column.startswith("velocity"):
                axis = "ned".index(column[-1])
                release = dataclasses.replace(release, velocity=release.velocity + change * np.eye(3)[axis])
            else:
                name = column.removeprefix("aero.")
                disc = dataclasses.replace(
                    DRIVER, aero=DRIVER.aero._replace(**{name: getattr(DRIVER.aero, name) + change})
                )
            state = predict(disc, FIELD, release, duration=2.0, rtol=1e-13, atol=1e-13).at(t)
            return np.hstack([state.position, state.velocity])

        for column, size in (("velocity_n", 1e-2), ("q", 1e-2), ("r", 1e-2), ("aero.CNr", 1e-5), ("aero.CL0", 1e-4)):
            half, whole = ((path(column, k * size) - path(column, -k * size)) / (2 * k * size) for k in (1, 2))
            expected = (4 * half - whole) / 3
            mine = found.derivative[:, :6, found.columns.index(column)]
            for rows in self.groups[:2]:
                scale = np.abs(expected[:, rows]).max()
                assert np.abs(mine[:, rows] - expected[:, rows]).max() < 2e-6 * scale, column

    @pytest.mark.parametrize(
        ("id", "name", "size"),
        [
            ("air.wind", "w_north_m_s", 1e-2),
            ("air.wind", "w_east_m_s", 1e-2),
            ("air.gust", "w_east_m_s", 1e-2),
            ("aero.spin_lift", "CLr", 1e-4),
            ("aero.yaw_quadratic", "CNrr", 1e-5),
            ("body.mass_imbalance", "ex_m", 1e-5),
            ("body.inertia_asymmetry", "dIyy_kg_m2", 1e-7),
            ("event.impulse", "dv_east_m_s", 1e-2),
        ],
    )
    def test_an_effect_is_a_column_too(self, id, name, size):
        """Central differences over two widths, extrapolated, of adaptive flights; 1e-5 of the largest derivative."""
        timing = {"air.gust": {"t_s": 0.5, "width_s": 0.2}, "event.impulse": {"t_s": 0.5}}.get(id, {})

        def effects(value):
            return [effect(id, **timing, **{name: value})]

        def path(value):
            flight = predict(DRIVER, FIELD, WOBBLING, effects(value), duration=1.5, rtol=1e-13, atol=1e-13)
            return flight.at(t).position

        t, start = np.linspace(0.1, 1.4, 6), 2.0 * size
        flight = predict(DRIVER, FIELD, WOBBLING, effects(start), duration=1.5, rtol=1e-10, atol=1e-10)
        mine = sensitivities(flight, [(id, name)], t).derivative[:, :3, -1]
        half, whole = ((path(start + k * size) - path(start - k * size)) / (2 * k * size) for k in (1, 2))
        expected = (4 * half - whole) / 3
        assert np.abs(expected).max() > 0.0
        np.testing.assert_allclose(mine, expected, atol=1e-5 * np.abs(expected).max())

    def test_in_vacuum_it_is_the_identity_and_time(self):
        flight = predict(BARE, FIELD, throw())
        found = sensitivities(flight, [("environment", "gravity")])
        last, t = found.derivative[-1], flight.end
        np.testing.assert_allclose(last[:3, :3], np.eye(3), atol=1e-9)
        np.testing.assert_allclose(last[:3, 3:6], t * np.eye(3), rtol=1e-8, atol=1e-8)
        np.testing.assert_allclose(last[:3, 12], [0.0, 0.0, t**2 / 2], rtol=1e-8, atol=1e-8)
        assert found.columns[:12] == RELEASE_COLUMNS
        # a metre higher is later by 1/v_down and farther by the way of that time
        landing, v = found.landing(flight), flight.state[-1, 3:6]
        np.testing.assert_allclose(landing[:, 2], [-v[0] / v[2], 0.0, 0.0, -1.0 / v[2]], atol=1e-8)


class TestMany:
    def test_many_throws_are_the_throws_one_by_one_whatever_the_threads(self):
        releases = [throw(speed=speed, wobble=(1.0, 0.0)) for speed in (14.0, 18.0, 22.0, 26.0, 28.0)]
        t = np.array([0.0, 0.5, 1.0, 20.0])
        one, two = (predict_many(DRIVER, FIELD, releases, times=t, threads=n) for n in (1, 2))
        for first, second in zip(one, two, strict=True):
            np.testing.assert_array_equal(first, second)
        for k, release in enumerate(releases):
            flight = predict(DRIVER, FIELD, release)
            assert one.end[k] == flight.end
            np.testing.assert_array_equal(one.state[k], flight.state[-1])
            np.testing.assert_array_equal(one.track[k, 1:3, :3], flight.at(t[1:3]).position)
            assert np.all(np.isnan(one.track[k, 3]))

    def test_each_throw_may_have_its_own_parameters(self):
        states = np.tile(release_state(throw()), (2, 1))
        flats = np.array([predict(d, FIELD, throw(), duration=0.1).parameters for d in (DRIVER, BARE)])
        many = predict_many(DRIVER, FIELD, states, parameters=flats)
        assert many.end.tolist() == [predict(d, FIELD, throw()).end for d in (DRIVER, BARE)]
        with pytest.raises(ValueError, match="parameters: got"):
            predict_many(DRIVER, FIELD, states, parameters=flats[:, 1:])


class TestRefusals:
    table = YawDampingTable(
        np.radians(np.arange(3000.0, 6001.0, 500.0)), np.arange(16.0, 31.0), np.full((7, 15), -0.0045)
    )

    def test_leaving_the_table_names_time_rate_and_airspeed(self):
        """With 4 m/s from ahead the disc is faster through the air than over the ground; both engines say so."""
        disc = dataclasses.replace(DRIVER, yaw_damping_table=self.table)
        wind = [effect("air.wind", w_north_m_s=-4.0)]
        message = (
            r"at 2\.\d{3} s the disc spins at 38\d\d deg/s and flies at 16\.0 m/s through the air, outside its C_Nr"
        )
        for engine in (predict, fly):
            with pytest.raises(InputError, match=message):
                engine(disc, FIELD, throw(), wind)
        many = predict_many(disc, FIELD, [throw(), throw(speed=29.9)], wind)
        assert np.all(np.isnan(many.end))

    def test_a_throw_needs_velocity_and_spin(self):
        with pytest.raises(InputError, match="a throw needs velocity"):
            predict(DRIVER, FIELD, dataclasses.replace(throw(), velocity=None))


@pytest.mark.parametrize("engine", [fly, predict])
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"disc": "driver"}, "disc is 'driver', of type str; expected a Disc: load_disc(NAME)"),
        (
            {"disc": (DRIVER, FIELD)},
            "of type tuple; expected a Disc: load_disc(NAME) returns a disc and",
        ),
        ({"environment": DRIVER}, "of type Disc; expected an Environment"),
        ({"release": "driver"}, "release is 'driver', of type str; expected a Release: load_throw(NAME)"),
        ({"effects": effect("air.density", ratio=1.1)}, "of type Effect; expected a list of effects"),
        ({"effects": ["air.density"]}, "one of effects is 'air.density', of type str; expected an effect as effect("),
    ],
)
def test_an_argument_of_another_type_is_refused_with_what_makes_a_right_one(engine, change, says):
    given = {"disc": DRIVER, "environment": FIELD, "release": throw()} | change
    with pytest.raises(InputError, match=re.escape(says)):
        engine(**given)
