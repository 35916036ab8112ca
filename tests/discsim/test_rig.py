"""Rigs: a table that follows its profile, a spinner that runs down, and what a baseline leaves out of both."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.flights import FIELD
from support.turning import field_at

from discsim.disc import Rig
from discsim.effects import CATALOGUE, Effect, effect
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.frames import body_to_ned
from discsim.motion import Motion
from discsim.recording import Samples
from discsim.rig import PLATEAUS_DEG_S, default_profile, read_profile, spin_down, turn_table
from discsim.sensors import Accelerometer, Instruments, Magnetometer, RateReference, Sampling, record

RIG = Rig(Izz=1.1e-3, viscous=3e-5)
#: a bearing without friction of its own, for the effects
FREE = Rig(Izz=1.1e-3, viscous=0.0)
G = FIELD.gravity


def knots(*rows: tuple[float, float]) -> Samples:
    t, rate = zip(*rows, strict=True)
    return Samples(np.array(t), np.array(rate))


def yaw_of(motion: Motion) -> np.ndarray:
    return np.unwrap(2 * np.arctan2(motion.attitude[:, 3], motion.attitude[:, 0]))


class TestTable:
    profile = knots((0.0, 0.0), (0.2, 0.0), (0.55, 30.0), (0.8, 30.0), (1.1, -20.0), (1.3, -20.0))
    motion = turn_table(profile, FIELD, yaw=0.4)

    def commanded(self, t: np.ndarray) -> np.ndarray:
        return np.interp(t, self.profile.t, self.profile.value)

    def test_it_follows_ramps_and_plateaus(self):
        """Steps end on the knots and the drive knows the slope: rounding of 1300 steps is left."""
        np.testing.assert_allclose(self.motion.rate[:, 2], self.commanded(self.motion.t), atol=1e-9)
        np.testing.assert_array_equal(self.motion.rate[:, :2], 0.0)

    def test_its_angle_is_the_integral_of_the_command(self):
        """The trapezoids of a profile whose knots are steps are exact; rounding over 1300 steps."""
        t = self.motion.t
        turned = np.concatenate([[0.0], np.cumsum(np.diff(t) * (self.commanded(t)[1:] + self.commanded(t)[:-1]) / 2)])
        np.testing.assert_allclose(yaw_of(self.motion), 0.4 + turned, atol=1e-9)

    def test_its_angular_acceleration_is_the_slope(self):
        inside = (self.motion.t > 0.2005) & (self.motion.t < 0.55)
        np.testing.assert_allclose(self.motion.angular_acceleration[inside, 2], 30.0 / 0.35, rtol=1e-9)

    def test_its_angular_acceleration_jumps_at_a_corner(self):
        """It had run over within a step, and rung for some: a reading 70 us after a corner was ten deviations off."""
        ramp = 30.0 / 0.35
        t = np.array([0.198, 0.1995, 0.2 - 1e-6, 0.2 + 2e-6, 0.2005, 0.202, 0.5499, 0.5501])
        told = self.motion.at(t).angular_acceleration[:, 2]
        np.testing.assert_allclose(told, [0.0, 0.0, 0.0, ramp, ramp, ramp, ramp, 0.0], atol=1e-6)

    def test_every_knot_is_an_instant_of_the_motion(self):
        """Even where it is no whole number of steps from the last one; the last to the last bit."""
        motion = turn_table(knots((0.0, 1.0), (0.0123456, 2.0), (1 / 3, 2.0)), FIELD)
        assert set(np.array([0.0, 0.0123456, 1 / 3])) <= set(motion.t)
        assert np.diff(motion.t).max() <= 1e-3 + 1e-12

    def test_it_stays_where_it_is(self):
        for still in (self.motion.position, self.motion.velocity, self.motion.acceleration):
            np.testing.assert_array_equal(still, 0.0)

    @settings(max_examples=10)
    @given(
        rates=st.lists(st.floats(-122.0, 122.0), min_size=2, max_size=5),
        spans=st.lists(st.floats(0.005, 0.2), min_size=4, max_size=4),
    )
    def test_any_profile_to_7000_deg_s_is_followed(self, rates, spans):
        t = np.concatenate([[0.0], np.cumsum(spans[: len(rates) - 1])])
        motion = turn_table(Samples(t, np.array(rates)), FIELD)
        np.testing.assert_allclose(motion.rate[:, 2], np.interp(motion.t, t, rates), atol=1e-9)

    def test_the_same_command_gives_the_same_bits(self):
        np.testing.assert_array_equal(turn_table(self.profile, FIELD, yaw=0.4).attitude, self.motion.attitude)

    def test_its_inertia_is_the_drive_s_business(self):
        heavy = turn_table(self.profile, FIELD, yaw=0.4, inertia=0.5)
        np.testing.assert_allclose(heavy.rate, self.motion.rate, atol=1e-9)

    @pytest.mark.parametrize("row", [row for row in CATALOGUE.values() if row.acts_on == "motion"], ids=lambda r: r.id)
    def test_an_effect_at_its_baseline_changes_no_bit(self, row):
        short = knots((0.0, 5.0), (0.05, 20.0))
        plain, with_effect = (turn_table(short, FIELD, given) for given in ((), [Effect(row.id, row.baseline)]))
        np.testing.assert_array_equal(with_effect.attitude, plain.attitude)
        np.testing.assert_array_equal(with_effect.angular_acceleration, plain.angular_acceleration)

    @pytest.mark.parametrize(
        ("profile", "message"),
        [
            (Samples(np.array([0.0]), np.array([1.0])), "at least two knots"),
            (Samples(np.array([0.0, 1.0]), np.array([1.0, np.nan])), "without gaps"),
            (Samples(np.array([0.0, 1.0]), np.ones((2, 2))), "at least two knots"),
            (knots((0.5, 1.0), (1.0, 1.0)), r"first knot at 0\.5 s, expected 0 s"),
        ],
    )
    def test_what_is_no_profile_is_refused(self, profile, message):
        with pytest.raises(InputError, match=message):
            turn_table(profile, FIELD)


class TestTilt:
    """The axis along (tilt_north, tilt_east, 1) in N: gravity and field turn in the body once a turn."""

    n, e = 0.04, -0.025
    length = np.sqrt(n**2 + e**2 + 1)
    axis = np.array([n, e, 1.0]) / length
    tilted = effect("rig.axis_tilt", tilt_north_rad=n, tilt_east_rad=e)
    motion = turn_table(knots((0.0, 25.0), (0.5, 25.0)), FIELD, [tilted], yaw=0.3)
    fast = Sampling(1000.0)

    def seen(self, sensor: Accelerometer | Magnetometer) -> np.ndarray:
        return sensor.measure(self.motion, np.random.default_rng(0)).value

    def test_the_body_s_z_axis_is_the_rig_s(self):
        np.testing.assert_allclose(
            body_to_ned(self.motion.attitude)[:, :, 2], np.tile(self.axis, (501, 1)), rtol=0, atol=1e-12
        )

    def test_it_is_tilted_the_short_way(self):
        """At yaw 0 north stays above the axis' lean: the turn is about a horizontal line across it."""
        level = turn_table(knots((0.0, 0.0), (0.1, 0.0)), FIELD, [self.tilted])
        C_NB = body_to_ned(level.attitude[0])
        across = np.array([-self.e, self.n, 0.0]) / np.hypot(self.n, self.e)
        np.testing.assert_allclose(C_NB @ across, across, atol=1e-14)

    def test_the_accelerometer_sees_gravity_turn(self):
        """-g along the leaning axis is -g/length; the rest, g times the lean, turns in the plane against the spin."""
        d = np.array([-0.0161, 0.0, 0.0])
        f = self.seen(Accelerometer(self.fast, d)) - [25.0**2 * 0.0161, 0.0, 0.0]
        yaw = 0.3 + 25.0 * self.motion.t
        # in the axes that lean but do not turn, -g_N has the components g sin(lean) (n, e)/hypot(n, e)
        lean = G / self.length * np.array([self.n, self.e])
        expected = np.column_stack(
            (
                np.cos(yaw) * lean[0] + np.sin(yaw) * lean[1],
                -np.sin(yaw) * lean[0] + np.cos(yaw) * lean[1],
                np.full(yaw.size, -G / self.length),
            )
        )
        np.testing.assert_allclose(f, expected, atol=2e-8)

    def test_the_magnetometer_s_z_is_the_field_along_the_axis(self):
        m = self.seen(Magnetometer(self.fast))
        np.testing.assert_allclose(m[:, 2], FIELD.magnetic_field @ self.axis, atol=1e-8)
        assert abs(m[0, 2] - FIELD.magnetic_field[2]) > 1.0

    def test_the_rate_is_about_the_leaning_axis_and_as_commanded(self):
        np.testing.assert_allclose(self.motion.rate, np.tile([0.0, 0.0, 25.0], (501, 1)), atol=1e-9)

    def test_a_spinner_leans_too(self):
        run = spin_down(RIG, FIELD, 25.0, 0.2, [self.tilted])
        np.testing.assert_allclose(body_to_ned(run.attitude[-1])[:, 2], self.axis, atol=1e-12)


class TestRipple:
    """r = r_cmd + amplitude sin(order psi + phase), psi the angle turned since the recording began.

    The drive feeds the ripple's own acceleration forward, so what is left is RK4's error, (order r h)^4/120 of the
    amplitude a radian of ripple: at order 3, 30 rad/s and 1 ms 6e-7 of it.
    """

    order, amplitude, phase, yaw = 3.0, 0.4, 0.7, 2.0
    ripple = effect("rig.speed_ripple", order=order, amplitude_rad_s=amplitude, phase_rad=phase)

    def turned(self, *rows: tuple[float, float]) -> Motion:
        return turn_table(knots(*rows), FIELD, [self.ripple], yaw=self.yaw)

    def expected(self, motion: Motion, command: np.ndarray) -> np.ndarray:
        psi = yaw_of(motion) - yaw_of(motion)[0]
        return command + self.amplitude * np.sin(self.order * psi + self.phase)

    @pytest.mark.parametrize("rate", [30.0, -30.0])
    def test_a_turning_table_ripples_from_the_start(self, rate):
        motion = self.turned((0.0, rate), (0.5, rate))
        assert yaw_of(motion)[0] == pytest.approx(self.yaw)
        np.testing.assert_allclose(motion.rate[:, 2], self.expected(motion, rate), atol=2e-6)

    def test_it_ripples_on_ramps(self):
        motion = self.turned((0.0, 10.0), (0.5, 30.0))
        np.testing.assert_allclose(motion.rate[:, 2], self.expected(motion, 10.0 + 40.0 * motion.t), atol=2e-6)

    def test_the_rate_reference_shows_it(self):
        motion = self.turned((0.0, 30.0), (0.5, 30.0))
        read = RateReference(Sampling(1000.0)).measure(motion, np.random.default_rng(0)).value
        assert np.ptp(read) == pytest.approx(2 * self.amplitude, rel=1e-3)
        np.testing.assert_allclose(read, self.expected(motion, 30.0), atol=2e-6)

    def test_it_sets_in_and_ends_with_the_turning(self):
        """The rates on the knots are those after them."""
        motion = self.turned((0.0, 0.0), (0.3, 0.0), (0.5, 20.0), (0.7, 0.0), (1.0, 0.0))
        moving = (motion.t >= 0.3) & (motion.t < 0.7)
        command = np.interp(motion.t, [0.3, 0.5, 0.7], [0.0, 20.0, 0.0])
        np.testing.assert_allclose(motion.rate[moving, 2], self.expected(motion, command)[moving], atol=2e-6)
        np.testing.assert_allclose(motion.rate[~moving, 2], 0.0, atol=2e-6)

    def test_a_table_that_starts_from_rest_ripples_from_its_first_instant(self):
        motion = self.turned((0.0, 0.0), (0.5, 20.0))
        np.testing.assert_allclose(motion.rate[:, 2], self.expected(motion, 40.0 * motion.t), atol=2e-6)


def relative(rate: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(rate / expected - 1).max())


class TestSpinDown:
    """RK4 at 1 ms and decays over seconds: its error is rounding over some thousand steps, 1e-12."""

    def test_it_decays_exponentially(self):
        motion = spin_down(RIG, FIELD, 60.0, 5.0)
        assert relative(motion.rate[:, 2], 60.0 * np.exp(-3e-5 / 1.1e-3 * motion.t)) < 1e-11

    def test_its_angle_is_the_exponential_s_integral(self):
        motion = spin_down(RIG, FIELD, 60.0, 5.0, yaw=1.2)
        k = 3e-5 / 1.1e-3
        np.testing.assert_allclose(yaw_of(motion), 1.2 + 60.0 / k * (1 - np.exp(-k * motion.t)), atol=1e-9)

    def test_backwards_it_is_the_mirror_image(self):
        forwards, backwards = (spin_down(RIG, FIELD, rate, 0.5).rate for rate in (60.0, -60.0))
        np.testing.assert_array_equal(backwards, -forwards)

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_dry_friction_adds_a_constant_torque(self, sign):
        """Izz rdot = -v r - c: r = (r0 + c/v) e^(-v t/Izz) - c/v while it turns."""
        c, v = 2e-4, 3e-5
        motion = spin_down(RIG, FIELD, sign * 60.0, 5.0, [effect("rig.coulomb_friction", torque_N_m=c)])
        expected = (60.0 + c / v) * np.exp(-v / 1.1e-3 * motion.t) - c / v
        assert relative(sign * motion.rate[:, 2], expected) < 1e-11

    def test_dry_friction_stops_it_and_does_not_turn_it_round(self):
        """2e-3 N m on 1.1e-3 kg m^2 stop 0.5 rad/s in 0.275 s; then one step's change is the most that is left."""
        motion = spin_down(FREE, FIELD, 0.5, 0.5, [effect("rig.coulomb_friction", torque_N_m=2e-3)])
        slowing = 2e-3 / 1.1e-3
        turning = motion.t < 0.27
        np.testing.assert_allclose(motion.rate[turning, 2], 0.5 - slowing * motion.t[turning], atol=1e-12)
        assert np.abs(motion.rate[motion.t > 0.28]).max() <= slowing * 1e-3

    @pytest.mark.parametrize("sign", [1.0, -1.0])
    def test_drag_of_the_air_decays_as_a_hyperbola(self, sign):
        """Izz rdot = -c r |r|: 1/r = 1/r0 + c t/Izz."""
        motion = spin_down(FREE, FIELD, sign * 60.0, 5.0, [effect("rig.quadratic_drag", coefficient_N_m_s2=1e-6)])
        assert relative(sign * motion.rate[:, 2], 1 / (1 / 60.0 + 1e-6 / 1.1e-3 * motion.t)) < 1e-11

    def test_viscous_and_quadratic_drag_together(self):
        """1/r = (1/r0 + c/v) e^(v t/Izz) - c/v (Bernoulli)."""
        c, v = 1e-6, 3e-5
        motion = spin_down(RIG, FIELD, 60.0, 5.0, [effect("rig.quadratic_drag", coefficient_N_m_s2=c)])
        expected = 1 / ((1 / 60.0 + c / v) * np.exp(v / 1.1e-3 * motion.t) - c / v)
        assert relative(motion.rate[:, 2], expected) < 1e-11

    @pytest.mark.parametrize("spin", [60.0, -60.0])
    @pytest.mark.parametrize("dr", [3.0, -3.0])
    def test_a_kick_changes_the_rate_along_the_spin(self, spin, dr):
        """The pulse has an area of one and the shape of a Gaussian of 10 ms."""
        motion = spin_down(FREE, FIELD, spin, 0.4, [effect("event.spin_step", t_s=0.2, dr_rad_s=dr)])
        change = (motion.rate[-1] - motion.rate[0]) * np.sign(spin)
        np.testing.assert_allclose(change, [0.0, 0.0, dr], atol=1e-8)
        pulse = np.exp(-(((motion.t - 0.2) / 0.01) ** 2) / 2) / (0.01 * np.sqrt(2 * np.pi))
        got = motion.angular_acceleration[:, 2] * np.sign(spin)
        np.testing.assert_allclose(got, dr * pulse, atol=1e-8)

    def test_its_magnetometer_turns_with_it(self):
        motion = spin_down(RIG, FIELD, 60.0, 1.0, yaw=1.2)
        samples = Magnetometer(Sampling(117.0, 0.002)).measure(motion, np.random.default_rng(0))
        k = 3e-5 / 1.1e-3
        yaw = 1.2 + 60.0 / k * (1 - np.exp(-k * samples.t))
        np.testing.assert_allclose(samples.value, field_at(yaw, FIELD.magnetic_field), atol=1e-7)

    def test_it_can_be_recorded(self):
        motion = spin_down(RIG, Environment(), 60.0, 1.0)
        module = Instruments.from_parts("mpu9250", "ac1120s")
        got = record(motion, module, np.random.default_rng(0), plant="spin_down", name="run", rig=RIG)
        assert got.rig is RIG
        assert len(got.need("rate_reference")) == 101


class TestProfiles:
    def test_the_default_goes_from_rest_to_5000_deg_s_in_steps_with_ramps(self):
        profile = default_profile()
        assert (PLATEAUS_DEG_S[0], PLATEAUS_DEG_S[-1]) == (0, 5000)
        np.testing.assert_allclose(np.degrees(profile.value[::2]), PLATEAUS_DEG_S, rtol=1e-12)
        np.testing.assert_array_equal(profile.value[::2], profile.value[1::2])
        np.testing.assert_allclose(np.diff(profile.t)[::2], 5.0)
        np.testing.assert_allclose(np.diff(profile.t)[1::2], 1.0)

    def test_hold_ramp_and_plateaus_can_be_chosen(self):
        profile = default_profile((100, -200), hold=2.0, ramp=0.5)
        np.testing.assert_allclose(profile.t, [0.0, 2.0, 2.5, 4.5])
        np.testing.assert_allclose(np.degrees(profile.value), [100.0, 100.0, -200.0, -200.0])

    @pytest.mark.parametrize(
        ("text", "rates"),
        [
            ("time_s,rate_rad_s\n0,1.5\n2.5,-3\n", [1.5, -3.0]),
            ("time_s,rate_deg_s\n0,90\n2.5,-180\n", [np.pi / 2, -np.pi]),
            ("time_s,rate_deg_s\r\n0,90\r\n2.5,-180\r\n", [np.pi / 2, -np.pi]),
            ("\ufefftime_s,rate_deg_s\n0,90\n2.5,-180\n", [np.pi / 2, -np.pi]),
        ],
    )
    def test_a_file_may_be_in_either_unit(self, tmp_path, text, rates):
        path = tmp_path / "profile.csv"
        path.write_bytes(text.encode())
        profile = read_profile(path)
        np.testing.assert_array_equal(profile.t, [0.0, 2.5])
        np.testing.assert_allclose(profile.value, rates, rtol=1e-15)

    @pytest.mark.parametrize(
        ("text", "line", "message"),
        [
            (
                "time_s,rate_rpm\n0,1\n1,2\n",
                1,
                "header is 'time_s,rate_rpm', expected 'time_s,rate_deg_s' or 'time_s,rate_rad_s'",
            ),
            ("time_s,rate_deg_s\n0,1\n1,two\n", 3, "rate_deg_s is 'two', expected a finite number"),
            ("time_s,rate_deg_s\n0,1\n1,\n", 3, "a cell is empty"),
            ("time_s,rate_deg_s\n0,1\n0,2\n", 3, "expected ascending time"),
            ("time_s,rate_deg_s\n0,1\n", 2, "one knot only; expected at least two"),
            ("time_s,rate_deg_s\n1,1\n2,2\n", 2, "first knot at 1 s, expected 0 s"),
            ("time_s,rate_deg_s\n", 2, "no samples"),
        ],
    )
    def test_a_damaged_file_is_refused_with_its_line(self, tmp_path, text, line, message):
        path = tmp_path / "profile.csv"
        path.write_text(text)
        with pytest.raises(InputError) as caught:
            read_profile(path)
        assert message in str(caught.value)
        assert str(caught.value).startswith(f"{path}:{line}: ")

    def test_a_file_that_cannot_be_read_is_refused(self, tmp_path):
        with pytest.raises(InputError, match=r"gone\.csv: no such file"):
            read_profile(tmp_path / "gone.csv")
        with pytest.raises(InputError, match="cannot be read"):
            read_profile(tmp_path)
