"""A rate table as it is: the drive's loop and limits, encoder, stray field, second axis, shapes of profiles."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from discsim.environment import Environment
from discsim.errors import InputError
from discsim.files import model_names
from discsim.frames import multiply, rotation_vector
from discsim.limits import LONGEST_RUN
from discsim.motion import Motion
from discsim.profiles import KNOTS, read_shape, sine, sweep, trapezoids
from discsim.rate_tables import RateTable, load_table
from discsim.recording import Samples
from discsim.rig import measured_profile, read_profile, turn_table
from discsim.second_axis import SecondAxis
from discsim.sensors import Instruments, Magnetometer, Noise, RateReference, Sampling, record
from discsim.table_drive import Ripple, TableDrive, Wow
from discsim.table_field import TableField

STEP = Samples(np.array([0.0, 1.0, 1.0001, 4.0]), np.array([10.0, 10.0, 20.0, 20.0]))
RAMP = Samples(np.array([0.0, 1.0, 5.0]), np.array([0.0, 0.0, 40.0]))
PLATEAU = Samples(np.array([0.0, 3.0]), np.array([30.0, 30.0]))


def still(duration: float) -> Samples:
    return Samples(np.array([0.0, duration]), np.zeros(2))


class TestDrive:
    @given(bandwidth=st.floats(2.0, 30.0), overshoot=st.floats(0.01, 0.4))
    @settings(max_examples=20, deadline=None)
    def test_a_step_overshoots_by_the_share_that_is_stated(self, bandwidth, overshoot):
        driven = TableDrive(bandwidth_hz=bandwidth, overshoot=overshoot).follow(STEP)
        # told each millisecond: the peak lies within half of one, the ramp of 0.1 ms moves it no more
        missed = 10.0 * (2 * np.pi * bandwidth * 1e-3) ** 2
        assert driven.value.max() - 20.0 == pytest.approx(10.0 * overshoot, abs=missed + 1e-3)

    @pytest.mark.parametrize("overshoot", [0.0, 0.1, 0.3])
    def test_at_its_bandwidth_a_swing_comes_out_smaller_by_the_square_root_of_two(self, overshoot):
        drive = TableDrive(bandwidth_hz=5.0, overshoot=overshoot)
        t = np.arange(0.0, 6.0, 1e-3)
        driven = drive.follow(Samples(t, np.sin(2 * np.pi * 5.0 * t)))
        assert np.abs(driven.value[-1000:]).max() == pytest.approx(np.sqrt(0.5), abs=1e-3)

    def test_it_trails_a_ramp_by_its_delay(self):
        drive = TableDrive(bandwidth_hz=8.0, overshoot=0.05)
        driven = drive.follow(RAMP)
        assert 10.0 * (driven.t[-1] - 1.0) - driven.value[-1] == pytest.approx(10.0 * drive.delay, rel=1e-6)

    def test_acceleration_and_rate_end_at_their_limits(self):
        drive = TableDrive(largest_rate=18.0, largest_acceleration=4.0)
        driven = drive.follow(STEP)
        assert driven.value.max() == 18.0
        assert np.diff(driven.value).max() / 1e-3 == pytest.approx(4.0)

    def test_a_motor_at_its_torque_accelerates_by_that_over_the_inertia_and_overshoots_little(self):
        """The integrator stands still meanwhile: wound up it would carry the table far beyond."""
        drive = TableDrive(bandwidth_hz=5.0, overshoot=0.1, largest_torque=0.02, inertia=0.01)
        long = Samples(np.array([0.0, 1.0, 1.0001, 12.0]), STEP.value)
        driven = drive.follow(long)
        assert np.diff(driven.value).max() / 1e-3 == pytest.approx(2.0, rel=1e-6)
        assert driven.value.max() < 20.0 + 1.0  # ten per cent of the step, and no more

    def test_friction_sets_the_fastest_rate_that_a_torque_holds(self):
        drive = TableDrive(largest_torque=0.15, inertia=1e-3, friction=0.01)
        assert drive.follow(STEP).value[-1] == pytest.approx(15.0, rel=1e-6)

    def test_an_ideal_one_returns_the_command_itself(self):
        assert TableDrive().follow(STEP) is STEP

    def test_ripple_goes_with_the_angle_and_wow_with_time(self):
        rate = np.full(2, 4 * np.pi)
        steady = Samples(np.array([0.0, 4.0]), rate)
        for drive, frequency in (
            (TableDrive(ripples=(Ripple(3.0, 0.05),)), 6.0),  # three in a turn, two turns a second
            (TableDrive(wows=(Wow(1.5, 0.004),)), 1.5),
        ):
            driven = drive.follow(steady)
            off = driven.value - rate[0]
            spectrum = np.abs(np.fft.rfft(off[:4000])) * 2 / 4000
            assert np.argmax(spectrum) / 4.0 == frequency
            assert spectrum.max() == pytest.approx(0.05, rel=0.01)

    def test_a_table_that_stands_has_no_ripple(self):
        driven = TableDrive(ripples=(Ripple(2.0, 0.5),)).follow(still(0.5))
        np.testing.assert_array_equal(driven.value, 0.0)

    def test_a_ripple_too_fast_for_the_table_s_steps_is_refused(self):
        with pytest.raises(InputError, match="order 100 at 5000 deg/s is 1389 Hz; expected at most 400 Hz"):
            TableDrive(ripples=(Ripple(100.0, 0.1),)).follow(Samples(np.array([0.0, 1.0]), np.radians([0, 5000.0])))

    def test_the_table_turns_as_its_drive_makes_it(self):
        table = RateTable(drive=TableDrive(bandwidth_hz=8.0, overshoot=0.2))
        motion = table.run(STEP, Environment())
        driven = table.drive.follow(STEP)
        np.testing.assert_allclose(motion.at(driven.t).rate[:, 2], driven.value, atol=2e-3)


class TestEncoder:
    def test_a_reading_is_a_number_of_counts_over_its_interval(self):
        motion = turn_table(PLATEAU, Environment(), yaw=0.3)
        samples = RateReference(Sampling(100.0), counts_per_turn=1000).measure(motion, np.random.default_rng(0))
        counts = samples.value[1:-1] * 0.01 / (2 * np.pi / 1000)
        np.testing.assert_allclose(counts, np.round(counts), atol=1e-5)
        assert np.mean(samples.value) == pytest.approx(30.0, abs=0.01)

    def test_its_steps_scatter_as_its_sheet_states(self):
        profile = Samples(np.array([0.0, 20.0]), np.array([20.0, 31.0]))  # counts begin anywhere
        motion = turn_table(profile, Environment())
        encoder = RateReference(Sampling(100.0), counts_per_turn=3600)
        samples = encoder.measure(motion, np.random.default_rng(0))
        error = (samples.value - motion.at(samples.t).rate[:, 2])[1:-1]
        # 2000 readings: 1.6 % of themselves, and neighbours share a rounding
        assert error.std() == pytest.approx(encoder.sheet.noise_rms, rel=0.06)

    def test_noise_in_proportion_grows_with_the_rate(self):
        t = np.array([0.0, 20.0, 21.0, 41.0])
        motion = turn_table(Samples(t, np.array([10.0, 10.0, 80.0, 80.0])), Environment())
        encoder = RateReference(Sampling(100.0), noise_share=1e-5, largest_rate=80.0)
        samples = encoder.measure(motion, np.random.default_rng(1))
        error = samples.value - motion.at(samples.t).rate[:, 2]
        slow, fast = error[samples.t < 20.0].std(), error[samples.t > 21.0].std()
        assert slow == pytest.approx(1e-4, rel=0.1)
        assert fast == pytest.approx(8e-4, rel=0.1)
        assert encoder.sheet.noise_rms == pytest.approx(8e-4)


class TestField:
    @staticmethod
    def seen(stray: TableField, profile: Samples, drive: TableDrive | None = None) -> Samples:
        """The field of the table alone, in B."""
        table = RateTable(drive=drive or TableDrive(), stray=stray)
        motion = table.run(profile, Environment(magnetic_field=np.zeros(3)))
        module = table.fit_out(Instruments({"magnetometer": Magnetometer()}))
        return record(motion, module, np.random.default_rng(0), plant="rate_table", name="x").need("magnetometer")

    def test_that_of_the_frame_turns_in_the_sensor_and_that_of_the_table_does_not(self):
        still_field = self.seen(TableField(still=np.array([3.0, 0.0, 1.0])), PLATEAU)
        angle = 30.0 * still_field.t
        np.testing.assert_allclose(still_field.value[:, 0], 3.0 * np.cos(angle), atol=1e-5)
        np.testing.assert_allclose(still_field.value[:, 1], -3.0 * np.sin(angle), atol=1e-5)
        np.testing.assert_allclose(still_field.value[:, 2], 1.0)
        turning = self.seen(TableField(turning=np.array([1.0, 2.0, 3.0])), PLATEAU)
        np.testing.assert_allclose(turning.value, np.tile([1.0, 2.0, 3.0], (len(turning), 1)), atol=1e-9)

    def test_that_of_the_current_is_there_while_the_motor_pulls(self):
        profile = Samples(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 0.0, 20.0, 20.0]))
        drive = TableDrive(inertia=0.01, friction=2e-3)
        seen = self.seen(TableField(per_torque=np.array([0.0, 0.0, 50.0])), profile, drive)

        def mean(start: float) -> float:
            return float(np.mean(seen.between(start + 0.3, start + 0.7).value[:, 2]))

        assert mean(0.0) == pytest.approx(0.0, abs=1e-6)
        assert mean(1.0) == pytest.approx(50.0 * (0.01 * 20.0 + 2e-3 * 10.0), rel=1e-3)
        assert mean(2.0) == pytest.approx(50.0 * 2e-3 * 20.0, rel=1e-3)

    def test_that_of_the_poles_turns_by_their_number_less_one(self):
        seen = self.seen(TableField(poles=0.5, pole_pairs=4), PLATEAU)
        np.testing.assert_allclose(seen.value[:, 0], 0.5 * np.cos(3 * 30.0 * seen.t), atol=1e-5)


SECOND = SecondAxis(
    np.array([1.0, 1.0, 0.5]),
    Samples(np.array([0.0, 1.0, 2.0]), np.array([0.5, 2.0, 1.0])),
    np.array([0.2, 0.0, 0.1]),
)


@pytest.fixture(scope="module")
def motion() -> Motion:
    """A table that turns on an axis which turns."""
    profile = Samples(np.array([0.0, 2.0]), np.array([4.0, 9.0]))
    return RateTable(second=SECOND).run(profile, Environment(), yaw=0.7)


class TestSecondAxis:
    def test_rates_are_those_of_the_attitude(self, motion):
        first, second = motion.attitude[:-1], motion.attitude[1:]
        conjugate = first * [1.0, -1.0, -1.0, -1.0]
        step = rotation_vector(multiply(conjugate, second)) / np.diff(motion.t)[:, None]
        middle = 0.5 * (motion.rate[1:] + motion.rate[:-1])
        np.testing.assert_allclose(step, middle, atol=2e-5)

    def test_accelerations_are_the_derivatives_of_rates_and_places(self, motion):
        inside = (motion.t > 0.01) & (np.abs(motion.t - 1.0) > 0.01) & (motion.t < 1.99)
        for value, slope in ((motion.rate, motion.angular_acceleration), (motion.velocity, motion.acceleration)):
            found = np.gradient(value, motion.t, axis=0)
            np.testing.assert_allclose(found[inside], slope[inside], atol=2e-3)
        found = np.gradient(motion.position, motion.t, axis=0)
        np.testing.assert_allclose(found[inside], motion.velocity[inside], atol=1e-5)

    def test_the_encoder_does_not_see_it_and_the_gyroscope_does(self, motion):
        table = RateTable(second=SECOND)
        module = table.fit_out(Instruments.from_parts("ac1120s", "ideal").fitted("rate_reference", noise=Noise()))
        told = record(motion, module, np.random.default_rng(0), plant="rate_table", name="x").need("rate_reference")
        np.testing.assert_allclose(told.value, 4.0 + 2.5 * told.t, atol=1e-6)
        # the axis leans by atan(sqrt(2)/0.5) from the table's: a third of its rate adds to the spin about z
        spin = motion.at(told.t).rate[:, 2]
        _, rate, _ = SECOND.turned(told.t)
        np.testing.assert_allclose(spin - told.value, rate / 3.0, atol=1e-6)


class TestProfiles:
    def test_trapezoids_hold_each_rate(self):
        profile = trapezoids(np.array([1.0, 5.0]), 2.0, 0.5)
        np.testing.assert_array_equal(profile.t, [0.0, 2.0, 2.5, 4.5])
        np.testing.assert_array_equal(profile.value, [1.0, 1.0, 5.0, 5.0])

    @given(frequency=st.floats(0.05, 4.0))
    @settings(deadline=None)
    def test_lines_between_knots_leave_the_stated_share_of_a_sine(self, frequency):
        profile = sine(1.0, 3.0, frequency, 5.0)
        t = np.linspace(0.0, 5.0, 5003)
        off = np.abs(np.interp(t, profile.t, profile.value) - 1.0 - 3.0 * np.sin(2 * np.pi * frequency * t))
        assert off.max() <= 3.0 * (2 * np.pi / KNOTS) ** 2 / 8 * 1.01

    def test_a_sweep_begins_and_ends_at_its_frequencies(self):
        profile = sweep(0.0, 1.0, 0.5, 4.0, 30.0)
        crossings = profile.t[1:][np.diff(np.sign(profile.value)) > 0]
        assert 1 / (crossings[1] - crossings[0]) == pytest.approx(0.5 * 8 ** (0.94 / 30), rel=0.01)
        assert 1 / (crossings[-1] - crossings[-2]) == pytest.approx(4.0, rel=0.02)

    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ('shape = "square"\n', "'shape' is 'square'"),
            ('shape = "sine"\namplitude_deg_s = 5\nfrequency_hz = 1\n', "missing key 'duration_s'"),
            ('shape = "sine"\namplitude_deg_s = 5\nfrequency_hz = 80\nduration_s = 3\n', "expected at most 50"),
            (
                'shape = "sine"\namplitude_deg_s = 5\nfrequency_hz = 1\nduration_s = 3\nphase = 1\n',
                "unknown key 'phase'",
            ),
            ('shape = "trapezoids"\nrates_deg_s = [1, 2]\nhold_s = 3000\nramp_s = 1\n', f"at most {LONGEST_RUN:g} s"),
            (
                'shape = "sine"\namplitude_deg_s = 4e5\nfrequency_hz = 1\nduration_s = 3\n',
                "expected at most 5000 rad/s",
            ),
        ],
    )
    def test_what_is_no_shape_is_refused_by_key(self, tmp_path, text, says):
        path = tmp_path / "shape.toml"
        path.write_text(text)
        with pytest.raises(InputError, match=says.replace("(", r"\(")):
            read_profile(path)

    def test_a_shape_is_read_in_degrees(self, tmp_path):
        path = tmp_path / "shape.toml"
        path.write_text('shape = "trapezoids"\nrates_deg_s = [0, 180]\nhold_s = 2\nramp_s = 1\n')
        np.testing.assert_allclose(read_shape(path).value, [0, 0, np.pi, np.pi])

    def test_a_log_with_gaps_and_a_late_start_becomes_a_profile_from_zero(self):
        motion = turn_table(PLATEAU, Environment())
        made = record(motion, Instruments.from_parts("ac1120s"), np.random.default_rng(0), plant="rate_table", name="x")
        log = made.need("rate_reference")
        value = log.value.copy()
        value[5] = np.nan
        profile = measured_profile(replace(made, samples={"rate_reference": Samples(log.t + 0.5, value)}))
        assert profile.t[0] == 0.0
        assert profile.value[0] == log.value[0]
        assert len(profile) == len(log)


class TestFiles:
    @pytest.mark.parametrize("name", model_names("tables"))
    def test_a_shipped_table_can_be_read(self, name):
        assert load_table(name).encoder is not None

    def test_a_table_without_a_name_has_that_of_its_file(self, tmp_path):
        (tmp_path / "bench.toml").write_text("[drive]\nbandwidth_hz = 8\n")
        assert load_table(tmp_path / "bench.toml").name == "bench"

    @pytest.mark.parametrize(
        ("text", "says"),
        [
            ("[drive]\novershoot = 1.2\nbandwidth_hz = 3\n", "expected a share of a step, below 1"),
            ("[drive]\novershoot = 0.2\n", "overshoot needs drive.bandwidth_hz"),
            ("[drive]\nlargest_torque_N_m = 2\n", "needs drive.inertia_kg_m2"),
            ("[drive]\nbandwith_hz = 3\n", "did you mean 'bandwidth_hz'"),
            ("[[drive.wow]]\nfrequency_hz = 1\nshare = 1.5\n", "expected a share of the rate below 1"),
            ("[encoder]\nrate_hz = 100\ncounts_per_turn = 0.5\n", "expected a whole number from 1"),
            ("[encoder]\nrate_hz = 100\nnoise_share = 1e-5\n", "needs encoder.largest_rate_deg_s"),
            ("[field]\nstill_uT = [1, 2]\n", "expected a list of 3 numbers"),
            ("[field]\npole_pairs = 0\n", "expected a whole number from 1"),
            ("[second_axis]\ndirection_ned = [1, 0, 0]\n", "expected one of profile"),
            ("[second_axis]\ndirection_ned = [0, 0, 0]\nrate_deg_s = 3\n", "is zero"),
            ("[motor]\n", "unknown key 'motor'"),
        ],
    )
    def test_what_cannot_be_is_refused_by_key_and_line(self, tmp_path, text, says):
        path = tmp_path / "table.toml"
        path.write_text('name = "mine"\n' + text)
        with pytest.raises(InputError, match=says) as found:
            load_table(path)
        assert str(path) in str(found.value)
