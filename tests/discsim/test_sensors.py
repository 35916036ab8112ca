"""Sensors: ideal ones against MuJoCo's and closed forms, every error against the form of docs/effects.md."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from support.flights import BARE, DRIVER, FIELD, in_wind, throw
from support.readings import FAST, FLIGHT, IMU, MAG, RATE, SPECIFIC, WOBBLING, WRITTEN, in_body, measured, rng
from support.turning import field_at, turning

from discsim.disc import Release
from discsim.effects import effect
from discsim.effects.sensors import (
    AccelerometerBias,
    AccelerometerSaturation,
    BiasDrift,
    ClockRate,
    CrossAxis,
    DroppedSamples,
    GSensitivity,
    GyroscopeBias,
    HardIron,
    Lag,
    Latency,
    PositionOffset,
    Scale,
    SoftIron,
    StrayField,
)
from discsim.effects.track_rows import Camera, Parallax, camera_of, parallax_of, pictured
from discsim.engine import FlyingDisc, fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.files import model_file
from discsim.frames import body_to_ned
from discsim.law import Law
from discsim.recording import Samples
from discsim.rig import turn_table
from discsim.sensors import Accelerometer, Gps, Gyroscope, Magnetometer, Noise, RateReference, Sampling, Tracker
from discsim.sensors.additions import by_law

FLU = np.array([1.0, -1.0, -1.0])
G = FIELD.gravity
FIELD_B = Environment().magnetic_field


class TestAgainstMuJoCo:
    """MuJoCo's own sensors at site imu, forward-left-up axes, at the instants themselves (mj_forward first).

    Both derive their readings from one state; what differs is rounding, and our acceleration of the centre of mass,
    which MuJoCo never forms. 1e-9 of the largest reading is well above the one and far below any error of physics.
    """

    @staticmethod
    def flown(release: Release, effects: list[Any], steps: int = 300) -> dict[str, np.ndarray]:
        flying = FlyingDisc(DRIVER, FIELD, effects)
        flying.release(release)
        rows: dict[str, list[np.ndarray]] = {}
        with flying.air():
            for _ in range(steps + 1):
                mujoco.mj_forward(flying.model, flying.data)
                for k in range(flying.model.nsensor):
                    name = flying.model.sensor(k).name
                    rows.setdefault(name, []).append(flying.data.sensor(name).data * FLU)
                mujoco.mj_step(flying.model, flying.data)
        return {name: np.array(values) for name, values in rows.items()}

    @staticmethod
    def hold(ours: np.ndarray, theirs: np.ndarray) -> None:
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * np.abs(theirs).max())

    @pytest.mark.parametrize("imbalance", [0.0, 0.003])
    def test_ideal_sensors_read_what_mujoco_s_read_in_flight(self, imbalance):
        """With an off-centre mass too: the sensors keep their place in the disc, gps follows the centre of mass."""
        unbalanced = [effect("body.mass_imbalance", ex_m=imbalance, ey_m=-imbalance / 2)]
        theirs = self.flown(WOBBLING, unbalanced)
        motion = fly(DRIVER, FIELD, WOBBLING, unbalanced, duration=0.3)
        t = motion.t
        self.hold(Accelerometer().ideal(motion, t), theirs["accelerometer"])
        self.hold(Gyroscope().ideal(motion, t), theirs["gyroscope"])
        self.hold(Magnetometer().ideal(motion, t), theirs["magnetometer"])
        # MuJoCo's position and velocity of a body are those of its inertial frame, the centre of mass
        fixes = Gps(Sampling(1000.0)).measure(motion, rng()).value
        np.testing.assert_allclose(fixes, np.hstack((theirs["position"], theirs["velocity"])), rtol=1e-9, atol=1e-9)

    def test_an_off_centre_mass_is_felt_by_the_accelerometer(self):
        """The disc turns about its centre of mass: the sensor's arm is IMU - e, so 73^2 x 3 mm = 16 m/s^2 more."""
        moved = self.flown(WOBBLING, [effect("body.mass_imbalance", ex_m=0.003)], steps=1)["accelerometer"]
        assert moved[0, 0] - self.flown(WOBBLING, [], steps=1)["accelerometer"][0, 0] == pytest.approx(16.1, abs=0.2)

    def test_after_a_step_sensordata_is_one_step_old(self):
        """3.4 deg of spin phase at 60 rad/s and 1 ms; so comparisons call mj_forward first."""
        spinning = throw(spin_deg_s=float(np.degrees(60.0)))
        flying = FlyingDisc(BARE, FIELD)
        flying.release(spinning)
        motion = fly(BARE, FIELD, spinning, duration=0.011)
        with flying.air():
            for _ in range(10):
                mujoco.mj_step(flying.model, flying.data)
        stale = flying.data.sensor("magnetometer").data * FLU
        before, now = Magnetometer().ideal(motion, motion.t[[9, 10]])
        np.testing.assert_allclose(stale, before, rtol=1e-9)
        phase = np.degrees(np.arctan2(now[1], now[0]) - np.arctan2(stale[1], stale[0]))
        assert abs(phase) == pytest.approx(np.degrees(60.0 * 1e-3), rel=1e-9)

    def test_ideal_sensors_read_what_mujoco_s_read_on_a_tilted_ramping_table(self):
        """The table's model is put into each state of ours, with the torque of its angular acceleration applied."""
        n, e = 0.03, -0.02
        profile = Samples(np.array([0.0, 0.2, 0.5]), np.array([0.0, 20.0, -10.0]))
        tilt = effect("rig.axis_tilt", tilt_north_rad=n, tilt_east_rad=e)
        motion = turn_table(profile, FIELD, [tilt], yaw=0.4)
        spec = mujoco.MjSpec.from_file(str(model_file("rate_table.xml")))
        spec.option.gravity, spec.option.magnetic = [0, 0, -G], FIELD.magnetic_field * FLU
        # the shortest turn from straight down to the axis, in MuJoCo's North-West-Up
        down, axis = np.array([0, 0, -1.0]), np.array([n, -e, -1.0]) / np.sqrt(n**2 + e**2 + 1)
        across = np.cross(down, axis)
        turn = Rotation.from_rotvec(across / np.linalg.norm(across) * np.arccos(down @ axis))
        spec.body("axis").quat = turn.as_quat(scalar_first=True)
        model = spec.compile()
        data = mujoco.MjData(model)
        yaw = 0.4 + np.concatenate(
            [[0.0], np.cumsum(np.diff(motion.t) * (motion.rate[1:, 2] + motion.rate[:-1, 2]) / 2)]
        )
        ours = [sensor.ideal(motion, motion.t) for sensor in (Accelerometer(), Gyroscope(), Magnetometer())]
        theirs = np.empty((3, motion.t.size, 3))
        for k in range(motion.t.size):
            data.qpos[0], data.qvel[0] = yaw[k], motion.rate[k, 2]
            data.qfrc_applied[0] = 1.1e-3 * motion.angular_acceleration[k, 2]
            mujoco.mj_forward(model, data)
            for i, name in enumerate(("accelerometer", "gyroscope", "magnetometer")):
                theirs[i, k] = data.sensor(name).data * FLU
        for i in range(3):
            self.hold(ours[i], theirs[i])


class TestAccelerometer:
    def test_at_rest_it_reads_minus_gravity(self):
        """Specific force a - g: the paper's (1) adds g."""
        reading = measured(Accelerometer(), turning(0.0)).value
        np.testing.assert_array_equal(reading, np.tile([0.0, 0.0, -9.80665], (201, 1)))

    def test_in_free_fall_it_reads_nothing(self):
        motion = fly(BARE, FIELD, throw(spin_deg_s=0.0), duration=0.3)
        np.testing.assert_allclose(measured(Accelerometer(), motion).value, 0.0, atol=1e-8)

    @given(
        rate=st.floats(-120.0, 120.0),
        d=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.02, 0.02)),
    )
    def test_a_steady_turn_pulls_it_inwards_by_r_squared_d(self, rate, d):
        """w x (w x d) = -r^2 d in the plane, nothing along the axis; -122^2 x 0.14 m = 2100 m/s^2 has 12 digits."""
        reading = measured(Accelerometer(Sampling(50.0), np.array(d)), turning(rate, 0.2)).value
        expected = np.array([-(rate**2) * d[0], -(rate**2) * d[1], -9.80665])
        np.testing.assert_allclose(reading, np.tile(expected, (11, 1)), atol=3e-9)

    def test_a_ramp_adds_the_tangential_acceleration(self):
        """wdot x d = rdot (-d_y, d_x, 0)."""
        d, rdot = np.array([-0.0161, 0.004, 0.002]), 25.0
        samples = measured(Accelerometer(Sampling(333.0), d), turning(10.0, 1.0, acceleration=rdot))
        r = 10.0 + rdot * samples.t
        expected = np.column_stack(
            (-(r**2) * d[0] - rdot * d[1], -(r**2) * d[1] + rdot * d[0], np.full(r.size, -9.80665))
        )
        np.testing.assert_allclose(samples.value, expected, atol=WRITTEN)

    def test_on_a_wobbling_disc_it_reads_equation_6_without_errors(self):
        """Written out for x: R''_x - (q^2 + r^2) d_x + (pq - rdot) d_y + (pr + qdot) d_z, less gravity."""
        d = np.array([-0.0161, 0.003, 0.005])
        got = Accelerometer(position=d).ideal(FLIGHT, FLIGHT.t)[:, 0]
        p, q, r = FLIGHT.rate.T
        _, qdot, rdot = FLIGHT.angular_acceleration.T
        origin = np.einsum("nji,nj->ni", body_to_ned(FLIGHT.attitude), FLIGHT.acceleration - [0, 0, G])[:, 0]
        expected = origin - (q**2 + r**2) * d[0] + (p * q - rdot) * d[1] + (p * r + qdot) * d[2]
        np.testing.assert_allclose(got, expected, atol=1e-10)


class TestSamplingInstants:
    @given(rate_hz=st.floats(20.0, 2000.0), phase=st.floats(0.0, 0.05), spin=st.floats(-120.0, 120.0))
    def test_values_are_those_of_the_sampling_instants(self, rate_hz, phase, spin):
        """Not of the nearest step, which at 120 rad/s and 1 ms would be up to 3 % of the field off."""
        motion = turning(spin, 0.2)
        samples = measured(Magnetometer(Sampling(rate_hz, phase)), motion)
        np.testing.assert_allclose(samples.t, phase + np.arange(len(samples)) / rate_hz, rtol=1e-15)
        assert 0.2 - 1 / rate_hz < samples.t[-1] <= 0.2 + 1e-9
        np.testing.assert_allclose(samples.value, field_at(spin * samples.t, FIELD_B), atol=WRITTEN)

    def test_a_sensor_between_the_steps_of_a_real_table_reads_the_sine_of_its_instants(self):
        """100 Hz, 3.7 ms late; the engine's yaw after 1 s at constant speed is rounding."""
        motion = turn_table(Samples(np.array([0.0, 1.0]), np.array([87.0, 87.0])), FIELD, yaw=0.3)
        samples = measured(Magnetometer(Sampling(100.0, phase_s=0.0037)), motion)
        np.testing.assert_allclose(samples.t, 0.0037 + np.arange(100) / 100.0, rtol=1e-15)
        np.testing.assert_allclose(samples.value, field_at(0.3 + 87.0 * samples.t, FIELD.magnetic_field), atol=1e-8)

    def test_a_phase_beyond_the_end_leaves_no_sample(self):
        assert len(measured(Magnetometer(Sampling(100.0, phase_s=0.3)), turning(10.0, 0.2))) == 0

    @pytest.mark.parametrize("ratio", [0.98, 1.0, 1.03])
    def test_a_wrong_clock_writes_its_nominal_grid(self, ratio):
        """Sample k is written as k/rate and was taken at k/(rate ratio): written time = ratio x true time."""
        motion = turning(40.0, 1.0)
        samples = measured(Magnetometer(Sampling(100.0, clock=ClockRate(ratio))), motion)
        k = np.arange(int(np.floor(100 * ratio + 1e-9)) + 1)
        np.testing.assert_array_equal(samples.t, k / 100.0)
        true = k / (100.0 * ratio)
        np.testing.assert_allclose(samples.value, field_at(40.0 * true, FIELD_B), atol=WRITTEN)

    def test_dropped_samples_are_gone_and_the_rest_closes_up(self):
        """On a ramp the reading tells when it was taken. 4 sigma of a binomial share of 20001."""
        motion = turning(10.0, 20.0, acceleration=2.0, step=1e-2)
        samples = measured(Accelerometer(Sampling(1000.0, dropped=DroppedSamples(0.3))), motion)
        lost = 1 - len(samples) / 20001
        assert lost == pytest.approx(0.3, abs=4 * np.sqrt(0.3 * 0.7 / 20001))
        np.testing.assert_array_equal(samples.t, np.arange(len(samples)) / 1000.0)
        taken = (np.sqrt(samples.value[:, 0] / 0.0161) - 10.0) / 2.0
        k = np.round(taken * 1000.0)
        np.testing.assert_allclose(taken, k / 1000.0, atol=1e-7)
        assert np.all(np.diff(k) >= 1)
        # at random: a loss follows a loss as often as any other sample
        assert np.mean(np.diff(k) > 1) == pytest.approx(0.3, abs=4 * np.sqrt(0.3 * 0.7 / 14000))

    def test_gaps_keep_their_time_stamps(self):
        motion = turning(10.0, 5.0, acceleration=2.0, step=1e-2)
        samples = measured(RateReference(Sampling(1000.0, gaps=0.2)), motion)
        assert 1 - len(samples) / 5001 == pytest.approx(0.2, abs=4 * np.sqrt(0.2 * 0.8 / 5001))
        np.testing.assert_allclose(samples.value, 10.0 + 2.0 * samples.t, atol=WRITTEN)

    def test_jitter_moves_the_instants_and_not_the_stamps(self):
        """A rate that grows by 200 rad/s^2 shows each instant to 3e-12 s; 4 sigma of an rms of 2001."""
        motion = turning(10.0, 2.0, acceleration=200.0)
        samples = measured(RateReference(Sampling(1000.0, jitter_s=2e-4)), motion)
        np.testing.assert_array_equal(samples.t, np.arange(2001) / 1000.0)
        moved = (samples.value - 10.0) / 200.0 - samples.t
        assert np.std(moved[10:-10]) == pytest.approx(2e-4, rel=4 / np.sqrt(2 * 1981))
        assert abs(np.mean(moved)) < 4 * 2e-4 / np.sqrt(2001)

    @pytest.mark.parametrize(
        ("wrong", "message"),
        [
            ({"rate_hz": 0.0}, "rate is 0 Hz, expected above zero"),
            ({"rate_hz": float("nan")}, "rate is nan Hz"),
            ({"rate_hz": 10.0, "phase_s": -0.1}, "phase is -0.1 s, expected zero or more"),
            ({"rate_hz": 10.0, "jitter_s": -1.0}, "jitter is -1 s"),
            ({"rate_hz": 10.0, "gaps": 1.0}, r"lost \(gaps\) is 1, expected 0 to below 1"),
            ({"rate_hz": 10.0, "dropped": DroppedSamples(1.5)}, r"lost \(dropped\) is 1.5"),
            ({"rate_hz": 10.0, "clock": ClockRate(0.0)}, "clock rate is 0, expected above zero"),
        ],
    )
    def test_a_sampling_that_cannot_be_is_refused(self, wrong, message):
        with pytest.raises(InputError, match=message):
            Sampling(**wrong)


class TestErrorsOfTheMagnetometer:
    def held(self, expected: np.ndarray, **errors: Any) -> None:
        got = measured(Magnetometer(FAST, **errors), FLIGHT).value
        np.testing.assert_allclose(got, expected, atol=WRITTEN)
        assert np.abs(got - MAG).max() > 0.1  # the error is there to be seen

    def test_a_bare_one_reads_the_field_in_body_axes(self):
        np.testing.assert_allclose(measured(Magnetometer(FAST), FLIGHT).value, MAG, atol=WRITTEN)

    def test_hard_iron_is_constant_in_the_body(self):
        self.held(MAG + np.array([3.0, -5.0, 7.0]), hard_iron=HardIron(3.0, -5.0, 7.0))

    def test_soft_iron_is_a_symmetric_matrix(self):
        S = np.array([[0.05, 0.01, -0.02], [0.01, -0.03, 0.04], [-0.02, 0.04, 0.02]])
        self.held(MAG + MAG @ S.T, soft_iron=SoftIron(0.05, 0.01, -0.02, -0.03, 0.04, 0.02))

    def test_a_stray_field_stands_in_the_world_and_dies_out_with_height(self):
        stray = np.exp(FLIGHT.position[:, 2:] / 0.7) * np.array([4.0, -2.0, 6.0])  # down is negative
        self.held(MAG + in_body(FLIGHT, stray), stray_field=StrayField(4.0, -2.0, 6.0, 0.7))

    def test_a_stray_field_stops_growing_at_2_cm(self):
        got = measured(Magnetometer(stray_field=StrayField(4.0, -2.0, 6.0, 0.1)), turning(0.0)).value
        np.testing.assert_allclose(got[0], FIELD_B + np.exp(-0.2) * np.array([4.0, -2.0, 6.0]), atol=WRITTEN)

    def test_soft_iron_bends_the_field_before_hard_iron_and_stray_field_join(self):
        S = np.diag([0.1, 0.2, 0.3])
        stray = np.exp(FLIGHT.position[:, 2:] / 0.7) * np.array([4.0, -2.0, 6.0])
        self.held(
            MAG @ (np.eye(3) + S) + [3.0, -5.0, 7.0] + in_body(FLIGHT, stray),
            soft_iron=SoftIron(sxx=0.1, syy=0.2, szz=0.3),
            hard_iron=HardIron(3.0, -5.0, 7.0),
            stray_field=StrayField(4.0, -2.0, 6.0, 0.7),
        )

    def test_a_misaligned_one_reads_along_its_own_axes(self):
        """Turned 0.1 rad about z_B, clockwise from above, its x axis leans towards y."""
        c, s = np.cos(0.1), np.sin(0.1)
        expected = np.column_stack((c * MAG[:, 0] + s * MAG[:, 1], -s * MAG[:, 0] + c * MAG[:, 1], MAG[:, 2]))
        self.held(expected, misalignment=np.array([0.0, 0.0, 0.1]))

    def test_a_height_that_cannot_be_is_refused(self):
        with pytest.raises(InputError, match="dies out over 0 m"):
            Magnetometer(stray_field=StrayField(height_m=0.0))


class TestErrorsOfTheAccelerometer:
    def held(self, expected: np.ndarray, **errors: Any) -> None:
        got = measured(Accelerometer(FAST, **errors), FLIGHT).value
        np.testing.assert_allclose(got, expected, atol=2 * WRITTEN)
        assert np.abs(got - SPECIFIC).max() > 1e-3

    def test_bias_is_constant(self):
        self.held(SPECIFIC + np.array([0.2, -0.1, 0.3]), bias=AccelerometerBias(0.2, -0.1, 0.3))

    def test_drift_grows_linearly_from_release(self):
        self.held(SPECIFIC + np.outer(FLIGHT.t, [0.2, -0.1, 0.3]), drift=BiasDrift(0.2, -0.1, 0.3))

    def test_drift_follows_true_time_whatever_the_clock_writes(self):
        motion = turning(0.0, 2.0)
        sensor = Accelerometer(Sampling(100.0, clock=ClockRate(1.1)), drift=BiasDrift(0.5))
        samples = measured(sensor, motion)
        np.testing.assert_allclose(samples.value[:, 0], 0.5 * samples.t / 1.1, atol=WRITTEN)

    def test_scale_and_cross_axis_are_the_matrix_of_equation_4_and_bias_comes_after(self):
        S_T = np.array([[1.01, 0.001, 0.002], [0.003, 1.02, 0.004], [0.005, 0.006, 0.97]])
        self.held(
            SPECIFIC @ S_T.T + [0.2, -0.1, 0.3] + np.outer(FLIGHT.t, [0.5, 0.0, 0.0]),
            scale=Scale(0.01, 0.02, -0.03),
            cross_axis=CrossAxis(0.001, 0.002, 0.003, 0.004, 0.005, 0.006),
            bias=AccelerometerBias(0.2, -0.1, 0.3),
            drift=BiasDrift(0.5),
        )

    def test_an_offset_moves_the_sensor(self):
        moved = measured(Accelerometer(FAST, position=IMU + np.array([0.001, -0.002, 0.003])), FLIGHT).value
        self.held(moved, offset=PositionOffset(0.001, -0.002, 0.003))

    def test_it_saturates_below_its_range_on_either_side(self):
        self.held(np.clip(SPECIFIC, -20.0, 20.0), range=156.9, saturation=AccelerometerSaturation(20.0))

    def test_saturation_above_the_range_changes_nothing(self):
        self.held(np.clip(SPECIFIC, -15.0, 15.0), range=15.0, saturation=AccelerometerSaturation(20.0))

    def test_a_misaligned_one_reads_along_its_own_axes(self):
        """Turned 0.05 rad about x_B its y axis leans towards z."""
        c, s = np.cos(0.05), np.sin(0.05)
        x, y, z = SPECIFIC.T
        self.held(np.column_stack((x, c * y + s * z, -s * y + c * z)), misalignment=np.array([0.05, 0.0, 0.0]))

    def test_clipping_comes_after_bias_and_rounding(self):
        step = 0.25
        rounded = np.round((SPECIFIC + np.array([5.0, 0.0, 0.0])) / step) * step
        self.held(np.clip(rounded, -30.1, 30.1), bias=AccelerometerBias(5.0), resolution=step, range=30.1)

    def test_it_may_saturate_below_one(self):
        small = Accelerometer(FAST, saturation=AccelerometerSaturation(0.5))
        assert np.abs(measured(small, FLIGHT).value).max() == 0.5

    @pytest.mark.parametrize("limit", [0.0, -3.0, float("nan")])
    def test_a_limit_that_cannot_be_is_refused(self, limit):
        with pytest.raises(InputError, match=r"saturates at .* expected above zero"):
            Accelerometer(saturation=AccelerometerSaturation(limit))


class TestErrorsOfTheGyroscope:
    def held(self, expected: np.ndarray, **errors: Any) -> None:
        got = measured(Gyroscope(FAST, **errors), FLIGHT).value
        np.testing.assert_allclose(got, expected, atol=2 * WRITTEN)
        assert np.abs(got - RATE).max() > 1e-3

    def test_a_bare_one_reads_the_body_rate(self):
        np.testing.assert_allclose(RATE, FLIGHT.rate, atol=WRITTEN)

    def test_bias_is_constant(self):
        self.held(RATE + np.array([0.01, -0.02, 0.03]), bias=GyroscopeBias(0.01, -0.02, 0.03))

    def test_scale_is_per_axis_and_bias_is_not_scaled(self):
        self.held(RATE * [1.1, 0.9, 1.02] + [0.5, 0.0, 0.0], scale=Scale(0.1, -0.1, 0.02), bias=GyroscopeBias(0.5))

    def test_specific_force_at_the_accelerometer_s_position_fakes_rates(self):
        """w_i += k_i f_i, with the true f: not scaled, not biased."""
        self.held(
            RATE * [1.1, 1.0, 1.0] + SPECIFIC * [0.001, 0.002, -0.003],
            scale=Scale(0.1),
            g_sensitivity=GSensitivity(0.001, 0.002, -0.003),
        )

    def test_it_clips_at_its_range(self):
        """An MPU-9250 stands at 2000 deg/s in every flight."""
        limit = np.radians(2000.0)
        self.held(np.clip(RATE, -limit, limit), range=limit)
        assert np.all(measured(Gyroscope(FAST, range=limit), FLIGHT).value[:, 2] == np.round(limit, 9))

    def test_axes_that_are_not_there_read_nothing(self):
        got = measured(Gyroscope(FAST, axes=(False, False, True)), FLIGHT).value
        assert np.all(np.isnan(got[:, :2]))
        np.testing.assert_array_equal(got[:, 2], RATE[:, 2])


class TestLag:
    """tau y' = x - y of a turning field: amplitude 1/sqrt(1 + (w tau)^2), phase -atan(w tau) once ten tau have passed.

    The sensor's input is taken linearly over steps of h = 0.1 ms, whose amplitude is (w h)^2/12 = 6e-6 low at 87 rad/s.
    """

    @pytest.mark.parametrize("tau", [2e-4, 3e-3, 0.02])
    @pytest.mark.parametrize("rate", [87.0, -87.0])
    def test_a_lagging_magnetometer_turns_late_and_small(self, tau, rate):
        samples = measured(Magnetometer(Sampling(130.0, 0.0013), lag=Lag(tau)), turning(rate, 0.5))
        x, y = FIELD_B[:2]
        # x + i y of the field in B turns as exp(-i r t)
        expected = (x + 1j * y) * np.exp(-1j * rate * samples.t) / (1 - 1j * rate * tau)
        settled = samples.t > 10 * tau
        got = samples.value[:, 0] + 1j * samples.value[:, 1]
        size = np.hypot(x, y) / np.sqrt(1 + (rate * tau) ** 2)
        # e^-10 of the first transient is left
        np.testing.assert_allclose(got[settled], expected[settled], atol=(1e-5 + np.exp(-10.0)) * np.hypot(x, y))
        np.testing.assert_allclose(np.abs(got[settled]).mean(), size, rtol=1e-4)
        delay = np.angle(got[settled] / ((x + 1j * y) * np.exp(-1j * rate * samples.t[settled])))
        np.testing.assert_allclose(delay.mean(), np.sign(rate) * np.arctan(abs(rate) * tau), atol=1e-4)

    def test_it_starts_settled_on_the_first_reading(self):
        samples = measured(Magnetometer(lag=Lag(0.05)), turning(87.0, 0.2))
        np.testing.assert_allclose(samples.value[0], FIELD_B, atol=WRITTEN)

    def test_a_ramp_is_followed_by_tau_late(self):
        """A drift is x = b t, so y = b (t - tau (1 - e^(-t/tau))): exact for an input that is linear."""
        sensor = Accelerometer(Sampling(100.0), drift=BiasDrift(4.0), lag=Lag(0.03))
        samples = measured(sensor, turning(0.0))
        expected = 4.0 * (samples.t - 0.03 * (1 - np.exp(-samples.t / 0.03)))
        np.testing.assert_allclose(samples.value[:, 0], expected, atol=WRITTEN)

    def test_a_gyroscope_lags_too(self):
        samples = measured(Gyroscope(Sampling(100.0), lag=Lag(0.03)), turning(5.0, 1.0, acceleration=40.0))
        expected = 5.0 + 40.0 * (samples.t - 0.03 * (1 - np.exp(-samples.t / 0.03)))
        np.testing.assert_allclose(samples.value[:, 2], expected, atol=WRITTEN)

    def test_noise_does_not_lag(self):
        """White noise through a lag of 20 samples would lose most of its scatter; 4 sigma of an rms of 3000 values."""
        samples = measured(Magnetometer(Sampling(1000.0), lag=Lag(0.02), noise=Noise(0.6)), turning(0.0))
        assert np.std(samples.value - FIELD_B) == pytest.approx(0.6, rel=4 / np.sqrt(2 * 3003))

    @pytest.mark.parametrize("kind", [Magnetometer, Accelerometer, Gyroscope])
    @pytest.mark.parametrize("tau", [-1e-3, float("nan")])
    def test_a_lag_that_cannot_be_is_refused(self, kind, tau):
        with pytest.raises(InputError, match=r"lag is .* expected zero or more"):
            kind(lag=Lag(tau))


class TestGps:
    def test_it_sees_the_centre_of_mass(self):
        fixes = measured(Gps(FAST), FLIGHT).value
        np.testing.assert_allclose(fixes, np.hstack((FLIGHT.position, FLIGHT.velocity)), atol=WRITTEN)

    @pytest.mark.parametrize("delay", [0.035, 0.1])
    def test_a_late_fix_shows_what_was_and_there_is_none_before(self, delay):
        """Stamped t it shows the state at t - delay; the first is stamped no earlier than delay."""
        fixes = measured(Gps(Sampling(20.0), Latency(delay)), FLIGHT)
        assert fixes.t[0] == pytest.approx(np.ceil(delay * 20.0 - 1e-9) / 20.0)
        assert fixes.t[-1] == 0.4
        state = FLIGHT.at(fixes.t - delay)
        np.testing.assert_allclose(fixes.value, np.hstack((state.position, state.velocity)), atol=WRITTEN)

    def test_a_receiver_later_than_the_flight_is_long_gives_no_fix(self):
        assert len(measured(Gps(latency=Latency(1.0)), FLIGHT)) == 0

    def test_a_wrong_clock_and_a_late_fix_go_together(self):
        fixes = measured(Gps(Sampling(20.0, clock=ClockRate(1.05)), Latency(0.03)), FLIGHT)
        state = FLIGHT.at(fixes.t / 1.05 - 0.03)
        np.testing.assert_allclose(fixes.value[:, :3], state.position, atol=WRITTEN)

    def test_position_and_velocity_have_noise_of_their_own(self):
        """4 sigma of the rms of 3 x 4001 values."""
        sensor = Gps(Sampling(10000.0), position_noise=Noise(0.15), velocity_noise=Noise(0.05))
        exact = measured(Gps(Sampling(10000.0)), FLIGHT).value
        error = measured(sensor, FLIGHT).value - exact
        for columns, size in ((slice(0, 3), 0.15), (slice(3, 6), 0.05)):
            assert np.std(error[:, columns]) == pytest.approx(size, rel=4 / np.sqrt(2 * 12003))

    def test_fixes_from_the_future_are_refused(self):
        with pytest.raises(InputError, match=r"gps latency is -0\.1 s"):
            Gps(latency=Latency(-0.1))


class TestTrackerAndReference:
    def test_a_tracker_loses_coordinates_one_by_one(self):
        """4 sigma of a binomial share of 3 x 4001."""
        got = measured(Tracker(Sampling(10000.0), unseen=0.25), FLIGHT).value
        exact = measured(Tracker(Sampling(10000.0)), FLIGHT).value
        lost = np.isnan(got)
        assert lost.mean() == pytest.approx(0.25, abs=4 * np.sqrt(0.25 * 0.75 / 12003))
        assert np.any(lost.any(axis=1) & ~lost.all(axis=1))
        np.testing.assert_array_equal(got[~lost], exact[~lost])

    def test_a_camera_sees_what_flies_too_far_out_from_the_point_under_it(self):
        """The form of the catalogue, by hand; a height measured otherwise stays, and on the ground all does."""
        true = measured(Tracker(Sampling(100.0)), FLIGHT).value
        seen = measured(Tracker(Sampling(100.0), camera=Camera(60.0, 20.0, -5.0)), FLIGHT).value
        nadir, h = np.array([20.0, -5.0]), -true[:, 2:]
        np.testing.assert_allclose(seen[:, :2], nadir + (true[:, :2] - nadir) / (1.0 - h / 60.0), atol=1e-8)
        np.testing.assert_array_equal(seen[:, 2], true[:, 2])
        ground = np.array([[3.0, 4.0, 0.0]])
        np.testing.assert_array_equal(pictured(Camera(60.0, 20.0, -5.0), ground), ground)

    def test_a_camera_is_the_same_in_the_numbers_that_a_fit_moves(self):
        """And they are regular where it is so far away that it sees everything in its place."""
        camera, position = Camera(45.0, 12.0, 7.0), np.array([[10.0, -3.0, -5.0], [80.0, 9.0, -1.0]])
        np.testing.assert_allclose(pictured(parallax_of(camera), position), pictured(camera, position), rtol=1e-12)
        np.testing.assert_allclose(camera_of(parallax_of(camera)), camera, rtol=1e-12)
        assert parallax_of(Camera()) == Parallax()
        small = pictured(Parallax(1e-9, 0.0, 0.0), position) - position
        np.testing.assert_allclose(small[:, :2], 1e-9 * -position[:, 2:] * position[:, :2], rtol=1e-6)

    def test_a_share_that_cannot_be_is_refused(self):
        with pytest.raises(InputError, match=r"unseen is 1.5, expected 0 to below 1"):
            Tracker(unseen=1.5)

    def test_a_rate_reference_is_off_by_its_scale(self):
        samples = measured(RateReference(scale=1e-3), turning(20.0, 1.0, acceleration=7.0))
        np.testing.assert_allclose(samples.value, 1.001 * (20.0 + 7.0 * samples.t), atol=WRITTEN)

    def test_it_tells_the_direction_and_rounds(self):
        samples = measured(RateReference(resolution=0.25), turning(-20.1))
        np.testing.assert_array_equal(samples.value, -20.0)

    def test_noise_in_proportion_to_the_rate_grows_with_it(self):
        """4 sigma of the rms of 4001 values at each rate; a table that stands still has none."""
        encoder = RateReference(Sampling(4000.0), noise_share=0.2, largest_rate=100.0)
        for rate in (10.0, -80.0):
            error = measured(encoder, turning(rate, 1.0)).value - rate
            assert np.std(error) == pytest.approx(0.2 * abs(rate), rel=4 / np.sqrt(2 * 4001))
        np.testing.assert_array_equal(measured(encoder, turning(0.0)).value, 0.0)
        assert encoder.sheet.noise_rms == pytest.approx(20.0, rel=1e-12)


class TestLawsAboutSensors:
    """A law adds to one column what its text says of the state; the symbols are worked out in another way here."""

    motion = fly(DRIVER, in_wind(2.0, -1.0, 0.0), WOBBLING, duration=0.3)
    t = np.linspace(0.05, 0.25, 11)

    def symbols(self, readings: np.ndarray) -> dict[str, np.ndarray]:
        state = self.motion.at(self.t)
        turned = Rotation.from_quat(state.attitude[:, [1, 2, 3, 0]]).inv()
        u, v, w = turned.apply(state.velocity - np.array([2.0, -1.0, 0.0])).T
        across, (P, Q, r) = np.hypot(u, v), state.rate.T
        fine = np.linspace(self.motion.start, self.t, 20001)
        spin = self.motion.at(fine.ravel()).rate[:, 2].reshape(fine.shape)
        return {
            "t": self.t - self.motion.start,
            "h": -state.position[:, 2],
            "V": np.linalg.norm(np.stack([u, v, w]), axis=0),
            "alpha": np.arcsin(w / np.sqrt(across**2 + w**2)),
            "p_H": (u * P + v * Q) / across,
            "q_H": (u * Q - v * P) / across,
            "r": r,
            "cos(psi)": np.cos(np.trapezoid(spin, fine, axis=0)),
            **dict(zip("xyz", readings.T, strict=True)),
        }

    @pytest.mark.parametrize("name", ["t", "h", "V", "alpha", "p_H", "q_H", "r", "cos(psi)", "x", "y", "z"])
    def test_each_symbol_is_that_of_the_motion(self, name):
        """An angle of twenty radians is told to 1e-6 by steps of a hundredth of a millisecond."""
        readings = Magnetometer().ideal(self.motion, self.t)
        state = self.motion.at(self.t)._replace(t=self.t - self.motion.start)
        changed = by_law(Law(f"0.5 {name}", "magnetometer.y_uT", {}))(readings, state, self.motion)
        expected = readings.copy()
        expected[:, 1] += 0.5 * self.symbols(readings)[name]
        np.testing.assert_allclose(changed, expected, rtol=1e-9, atol=1e-6)
