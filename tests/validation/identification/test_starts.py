"""Starts for a fit, from data alone: near the truth of MuJoCo's flights, whatever sensor errs, clips or is missing."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import combinations

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from support.places import PRACTICE

from discsim.disc import Release, Rig
from discsim.effects.catalogue import Effect, effect
from discsim.engine import fly
from discsim.frames import (
    C3,
    attitude_matrix,
    body_to_ned,
    euler_angles,
    quaternion_from_matrix,
    rotation_error,
    to_body,
)
from discsim.motion import Motion
from discsim.recording import Recording, Samples, SensorSheet, read_dataset
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc
from discsim.validation.identification.initial.flight import (
    InitialStates,
    flight_initial_states,
    flight_starts,
    spin_initial_states,
)
from discsim.validation.identification.initial.spin_phase import rig_initial_states

DRIVER, FIELD = load_disc("driver")
MODULE = Instruments.from_parts("mpu9250", "neo_m8n")

# what a fit of segments of 0.5 s converges from: well inside a third of a turn, and of the order of a throw's own
# change
ATTITUDE_RAD, RATE, TRANSVERSE_RAD_S, VELOCITY_M_S, POSITION_M = np.radians(10.0), 0.01, 0.3, 1.5, 1.0
# one axis tells a parabola, which lies 2 % off the decay of a spin at its ends
ONE_AXIS_RATE = 0.03


@cache
def flight(
    spin_deg_s: float = 4200.0, heading_deg: float = 40.0, wobble: tuple[float, float] = (0.8, -0.5), knocks: int = 0
) -> Motion:
    """A throw towards a heading (deg from north), disc and all turned with it; with a knock at 1.4 s."""
    heading = np.radians(heading_deg)
    lean = -12.0 * np.sign(spin_deg_s)
    C_NB = C3(heading).T @ attitude_matrix(np.radians(lean), np.radians(8.0), 1.0).T
    roll, pitch, yaw = (float(angle) for angle in euler_angles(quaternion_from_matrix(C_NB)))
    velocity = C3(heading).T @ np.array([23.6, 0.0, -4.2])
    rate = np.array([*wobble, np.radians(spin_deg_s)])
    knock = [effect("event.impulse", t_s=1.4, dv_north_m_s=1.0, dv_down_m_s=0.8)] * knocks
    return fly(
        DRIVER, FIELD, Release(np.array([0.0, 0.0, -1.3]), velocity, roll, pitch, yaw, rate), knock, duration=5.0
    )


def measured(motion: Motion, *errors: Effect, without: tuple[str, ...] = (), plant: str = "flight") -> Recording:
    module = MODULE.without(*without).with_effects(errors)
    return record(motion, module, np.random.default_rng(3), plant=plant, name="throw", disc=DRIVER)


def instants(motion: Motion) -> np.ndarray:
    return np.arange(0.0, motion.end - 0.2, 0.5)


def errors_of(starts: InitialStates, motion: Motion) -> dict[str, float]:
    truth = motion.at(starts.t)
    return {
        "attitude": float(np.max(rotation_error(starts.attitude, truth.attitude))),
        "rate": float(np.max(np.abs(starts.rate[:, 2] / truth.rate[:, 2] - 1))),
        "transverse": float(np.max(np.abs(starts.rate[:, :2] - truth.rate[:, :2]))),
        "velocity": float(np.max(np.linalg.norm(starts.velocity - truth.velocity, axis=1))),
        "position": float(np.max(np.linalg.norm(starts.position - truth.position, axis=1))),
    }


def assert_near(starts: InitialStates, motion: Motion) -> None:
    found = errors_of(starts, motion)
    allowed = dict(
        zip(found, (ATTITUDE_RAD, RATE, TRANSVERSE_RAD_S, VELOCITY_M_S, POSITION_M), strict=True),
    )
    assert all(found[key] < allowed[key] for key in found), found


@pytest.mark.parametrize("spin_deg_s", [4200.0, -3500.0, 7000.0, 1500.0])
def test_a_throw_is_found_from_its_own_sensors_for_either_hand_and_any_spin(spin_deg_s):
    """At 7000 deg/s the accelerometer's x is clipped throughout; z of the gyroscope is clipped above 2000 deg/s."""
    motion = flight(spin_deg_s, heading_deg=-150.0 if spin_deg_s < 0 else 40.0)
    starts = flight_initial_states(measured(motion), instants(motion))
    assert_near(starts, motion)
    assert starts.ambiguous == ()


@pytest.mark.parametrize("missing", [(), ("accelerometer",), ("magnetometer",)])
def test_what_the_air_does_tells_a_velocity_that_nothing_else_does(missing):
    """Within what a fit converges from; where a sensor is missing, one of the starts that are offered is.

    Without a magnetometer nothing tells the heading, and what is compared is in the disc's own frame.
    """
    motion = flight()
    recording = replace(measured(motion, without=("gps", *missing)), release=None)
    first = np.zeros(1)
    offered = list(flight_starts(recording, first))
    if missing:
        assert len(offered) > 1
    apart, turned = [], []
    for one in offered:
        assert np.all(np.isfinite(one.velocity))
        felt, true = (
            to_body(a, v)[0] for a, v in ((one.attitude, one.velocity), (motion.attitude[:1], motion.velocity[:1]))
        )
        apart.append(float(np.linalg.norm(felt - true)))
        turned.append(rotation_error(one.attitude[0], motion.attitude[0]))
    assert min(apart) < 5.0
    if not missing:
        assert apart[0] < 5.0
        assert np.linalg.norm(offered[0].velocity[0] - motion.velocity[0]) < 6.0
        assert turned[0] < np.radians(25.0)


@pytest.mark.parametrize(("spin_deg_s", "heading_deg"), [(4200.0, 40.0), (-3500.0, -150.0), (2500.0, 110.0)])
def test_a_flight_that_the_magnetometer_alone_has_read_begins_where_the_air_explains_the_field(spin_deg_s, heading_deg):
    """How fast and which way a disc flew shows only by what the air does to its axis and its spin.

    Among the few flights that are offered is one from which a fit converges: several explain the field about as well.
    """
    motion = flight(spin_deg_s, heading_deg)
    recording = replace(measured(motion, without=("gps", "accelerometer", "gyroscope")), release=None)
    offered = list(flight_starts(recording, instants(motion)))
    apart = [float(np.linalg.norm(one.velocity[0] - motion.velocity[0])) for one in offered]
    nearest = offered[int(np.argmin(apart))]
    assert min(apart) < VELOCITY_M_S, apart
    assert np.max(rotation_error(nearest.attitude, motion.at(nearest.t).attitude)) < ATTITUDE_RAD
    assert len(offered) <= 5


def test_a_stated_velocity_leaves_the_turn_about_the_field_to_the_air():
    motion = flight()
    recording = measured(motion, without=("gps", "accelerometer", "gyroscope"))
    stated = Release(
        motion.position[0], motion.velocity[0] + [0.5, -0.4, 0.3], sigma={"velocity_ned_m_s": np.full(3, 0.5)}
    )
    first = next(flight_starts(replace(recording, release=stated), instants(motion)))
    assert np.linalg.norm(first.velocity[0] - motion.velocity[0]) < VELOCITY_M_S
    assert np.max(rotation_error(first.attitude, motion.at(first.t).attitude)) < ATTITUDE_RAD


def test_a_tumbling_disc_is_followed_by_its_gyroscope():
    motion = flight(spin_deg_s=-50.0)
    assert_near(flight_initial_states(measured(motion), instants(motion)), motion)


def test_a_throw_that_only_a_camera_saw_from_above_starts_as_its_release_says():
    """Also past the ground, where the recorded disc did not end but the predicted one does."""
    motion = flight()
    release = Release(
        motion.position[0], motion.velocity[0], *(float(a[0]) for a in motion.euler_angles), motion.rate[0]
    )
    seen = Samples(motion.t[::33], motion.position[::33] * [1.0, 1.0, np.nan])
    sheet = SensorSheet(30.0, 0.03)
    recording = Recording("flight", "throw", FIELD, DRIVER, None, release, {"track": sheet}, {"track": seen})
    assert_near(flight_initial_states(recording, instants(motion)), motion)
    past = flight_initial_states(recording, np.array([30.0]))
    assert past.position[0, 2] > 1.0
    assert np.all(np.isfinite(np.concatenate([past.velocity[0], past.attitude[0], past.rate[0]])))


@pytest.mark.parametrize(
    "error",
    [
        effect("mag.hard_iron", bx_uT=11.0, by_uT=-8.0, bz_uT=12.0),
        effect("mag.soft_iron", sxx=0.2, sxy=0.1, sxz=-0.15, syy=-0.1, szz=-0.2),
        effect("accel.position_offset", dx_m=0.003, dy_m=0.003, dz_m=0.003),
        effect("accel.bias", bx_m_s2=1.0, by_m_s2=-1.0, bz_m_s2=1.0),
        effect("accel.scale", sx=0.05, sy=-0.05, sz=0.05),
        effect("accel.saturation", limit_m_s2=60.0),
        effect("gyro.bias", bx_rad_s=0.3, by_rad_s=-0.3, bz_rad_s=0.3),
        effect("gyro.scale", sx=0.05, sy=-0.05, sz=0.05),
        effect("gps.clock_rate", ratio=1.01),
    ],
    ids=lambda error: error.id,
)
def test_a_sensor_that_errs_does_not_lead_the_start_astray(error):
    motion = flight()
    assert_near(flight_initial_states(measured(motion, error), instants(motion)), motion)


def test_a_common_clock_turns_written_times_and_nothing_else():
    """Where every sensor writes 2 % too much time, the state at written time t is the true one at t/1.02."""
    motion = flight()
    written = instants(motion)
    starts = flight_initial_states(measured(motion, effect("clock.rate", ratio=1.02)), written)
    found = errors_of(starts._replace(t=written / 1.02), motion)
    assert found["attitude"] < ATTITUDE_RAD
    # every rate is read in written time: 2 % less turn per second, and no more wrong than that
    assert found["rate"] < 0.02 + RATE


@pytest.mark.parametrize(
    "error",
    [
        effect("mag.clock_rate", ratio=1.02),
        effect("accel.clock_rate", ratio=1.02),
        effect("gyro.clock_rate", ratio=1.02),
        effect("mag.dropped_samples", fraction=0.05),
        effect("accel.dropped_samples", fraction=0.05),
    ],
    ids=lambda error: error.id,
)
def test_sensors_that_slip_against_one_another_leave_the_spin_axis_where_it_is(error):
    """The phase slips by turns over a flight; untold, the drag would pull the axis to every side in turn."""
    motion = flight()
    starts = flight_initial_states(measured(motion, error), instants(motion))
    truth = motion.at(starts.t)
    cosine = np.sum(body_to_ned(starts.attitude)[:, :, 2] * body_to_ned(truth.attitude)[:, :, 2], axis=1)
    assert np.arccos(np.min(cosine)) < ATTITUDE_RAD


def test_lost_magnetometer_readings_make_no_spin():
    """Each of 5 % lost readings looks like 0.7 rad of turn, and the rate like 5 % more."""
    motion = flight()
    starts = flight_initial_states(measured(motion, effect("mag.dropped_samples", fraction=0.05)), instants(motion))
    assert errors_of(starts, motion)["rate"] < RATE


def test_a_field_along_the_spin_axis_for_a_while_makes_no_other_spin():
    """Nothing of the field is left in the disc's plane then, and the gyroscope is at its limit all along."""
    motion = flight()
    along = body_to_ned(motion.attitude[np.searchsorted(motion.t, 2.5)])[:, 2]
    field = replace(motion.environment, magnetic_field=50.0 * along)
    module = MODULE.fitted("gyroscope", range=np.radians(2000.0))
    thrown = replace(motion, environment=field)
    throw = record(thrown, module, np.random.default_rng(3), plant="flight", name="throw", disc=DRIVER)
    across = np.hypot(*throw.samples["magnetometer"].value[:, :2].T)
    assert np.min(across) < 0.5 < np.median(across)
    found = errors_of(flight_initial_states(throw, instants(motion)), motion)
    assert found["rate"] < 0.1


def test_late_fixes_move_the_path_and_leave_the_attitude():
    motion = flight()
    starts = flight_initial_states(measured(motion, effect("gps.latency", delay_s=0.2)), instants(motion))
    found = errors_of(starts, motion)
    assert found["attitude"] < ATTITUDE_RAD
    assert found["position"] < 0.2 * 24.0 + POSITION_M


def test_a_knock_and_wild_fixes_are_no_velocity():
    motion = flight(knocks=1)
    recording = measured(motion)
    fixes = recording.need("gps").value.copy()
    fixes[10, :3] += 25.0
    fixes[31, 3:] -= 12.0
    fixes[20] = np.nan
    samples = {**recording.samples, "gps": Samples(recording.need("gps").t, fixes)}
    wild = Recording("flight", "wild", recording.environment, DRIVER, None, None, recording.sheets, samples)
    assert_near(flight_initial_states(wild, instants(motion)), motion)


@pytest.mark.parametrize("missing", ["magnetometer", "accelerometer", "gyroscope"])
def test_the_path_and_the_lift_stand_in_for_a_missing_sensor(missing):
    """Without the gyroscope nutation is not seen: of p and q only their size, 1 rad/s, bounds the error."""
    motion = flight()
    starts = flight_initial_states(measured(motion, without=(missing,)), instants(motion))
    found = errors_of(starts, motion)
    assert found["attitude"] < ATTITUDE_RAD
    assert found["velocity"] < VELOCITY_M_S
    assert found["transverse"] < (1.5 if missing == "gyroscope" else TRANSVERSE_RAD_S)


@pytest.mark.parametrize("spin_deg_s", [4200.0, -3100.0])
def test_the_pull_to_the_axis_shows_a_spin_that_no_other_sensor_does(spin_deg_s):
    """No field, and the gyroscope's z clipped: the force across the axis alone loses count where it vanishes."""
    motion = flight(spin_deg_s)
    recording = measured(motion, without=("magnetometer",))
    assert recording.sheets["gyroscope"].clipped(recording.need("gyroscope").value[:, 2]).all()
    # at the very start nothing before it is there to be smoothed with
    assert errors_of(flight_initial_states(recording, instants(motion)[1:]), motion)["rate"] < RATE


@pytest.mark.parametrize("spin_deg_s", [4200.0, -3100.0])
@pytest.mark.parametrize("clipped", ["x_m_s2", "y_m_s2"])
def test_one_axis_of_an_accelerometer_shows_a_spin_whose_pull_clips_the_other(spin_deg_s, clipped):
    """No field, and the gyroscope's z clipped, too: nothing started it, and sensors seemed to contradict each other."""
    motion = flight(spin_deg_s)
    recording = measured(motion, without=("magnetometer",))
    samples = recording.need("accelerometer")
    value = samples.value.copy()
    value[:, ("x_m_s2", "y_m_s2").index(clipped)] = np.nan
    lacking = replace(recording, samples={**recording.samples, "accelerometer": replace(samples, value=value)})
    # the first three seconds are those that a fit begins with
    assert errors_of(flight_initial_states(lacking, instants(motion)[:7]), motion)["rate"] < ONE_AXIS_RATE


SENSORS = ("magnetometer", "accelerometer", "gyroscope", "gps")


@pytest.mark.parametrize("plant", ["flight", "free_spin"])
def test_whatever_is_missing_the_answer_is_finite(plant):
    motion = flight()
    t = np.array([-0.1, 0.0, 1.0, motion.end + 0.3])
    for count in range(1, 5):
        for missing in combinations(SENSORS, count):
            if len(missing) == 4:
                continue
            recording = measured(motion, without=missing, plant=plant)
            starts = (flight_initial_states if plant == "flight" else spin_initial_states)(recording, t)
            for part in (*starts[:5], *starts.ambiguous):
                assert np.all(np.isfinite(part)), missing
            np.testing.assert_allclose(np.linalg.norm(starts.attitude, axis=1), 1.0, atol=1e-9)


def test_a_recording_of_a_few_readings_is_answered():
    motion = flight()
    whole = measured(motion)
    samples = {name: part.between(0.0, 0.03) for name, part in whole.samples.items()}
    short = Recording("flight", "short", whole.environment, DRIVER, None, None, whole.sheets, samples)
    starts = flight_initial_states(short, np.zeros(1))
    assert all(np.all(np.isfinite(part)) for part in starts[:5])


@pytest.mark.parametrize("iron", [0.0, 9.0])
def test_a_free_spin_is_found_but_for_a_turn_about_the_field(iron):
    motion = flight()
    hidden = effect("mag.hard_iron", bx_uT=iron, by_uT=-iron, bz_uT=-0.5 * iron)
    starts = spin_initial_states(measured(motion, hidden, without=("gps",), plant="free_spin"), instants(motion))
    truth = motion.at(starts.t)
    apart = to_body(starts.attitude, FIELD.magnetic_field) - truth.in_body(FIELD.magnetic_field)
    # a tenth of a radian of the field's 50 uT
    assert np.max(np.linalg.norm(apart, axis=1)) < 5.0
    assert np.max(np.abs(starts.rate[:, 2] / truth.rate[:, 2] - 1)) < RATE
    # one turn about the field serves all instants: C_true C_found^T is the same throughout
    turns = body_to_ned(truth.attitude) @ np.swapaxes(body_to_ned(starts.attitude), 1, 2)
    between = [rotation_error(quaternion_from_matrix(C), quaternion_from_matrix(turns[0])) for C in turns]
    assert np.max(between) < ATTITUDE_RAD
    assert not np.any(starts.position)
    assert not np.any(starts.velocity)


@pytest.mark.parametrize("initial", [85.0, -60.0])
@pytest.mark.parametrize("iron", [0.0, 10.0])
def test_a_rig_that_runs_down_shows_its_angle(initial, iron):
    rig = Rig(1.1e-3, 6e-5)
    motion = spin_down(rig, FIELD, initial, 10.0, yaw=2.0)
    module = MODULE.without("gps").with_effects([effect("mag.hard_iron", bx_uT=iron, by_uT=-iron)])
    recording = record(motion, module, np.random.default_rng(4), plant="spin_down", name="rig", rig=rig)
    t = np.arange(0.0, 9.9, 0.5)
    psi, r = rig_initial_states(recording, t)
    truth = motion.at(t)
    ahead = to_body(truth.attitude, FIELD.magnetic_field)
    turned = np.arctan2(FIELD.magnetic_field[1], FIELD.magnetic_field[0]) - np.arctan2(ahead[:, 1], ahead[:, 0])
    assert np.max(np.abs(np.angle(np.exp(1j * (psi - turned))))) < 0.1
    np.testing.assert_allclose(r, truth.rate[:, 2], rtol=RATE)
    # unwrapped: it turns by what the rate says
    np.testing.assert_allclose(np.diff(psi), 0.25 * (r[1:] + r[:-1]), rtol=0.02)


def turned(profile: Samples, t: np.ndarray) -> np.ndarray:
    """Return the angle (k,) that a commanded rate has turned at t (k,), rad."""
    grid = np.linspace(0.0, profile.t[-1], 6001)
    rate = np.interp(grid, profile.t, profile.value)
    return np.interp(t, grid, cumulative_trapezoid(rate, grid, initial=0))


@pytest.mark.parametrize("leans", [True, False])
def test_without_a_magnetometer_all_runs_of_a_leaning_table_start_where_it_leans(leans):
    """Else a lean that all share is another one in each, and each was named."""
    tilt = [effect("rig.axis_tilt", tilt_north_rad=-0.013, tilt_east_rad=0.04)] * leans
    profile = Samples(np.array([0.0, 1.0, 2.0, 6.0]), np.array([0.0, 0.0, 20.0, 20.0]))
    module = MODULE.without("gps", "magnetometer")
    t = np.arange(0.0, 5.9, 0.25)
    apart = []
    for seed, yaw in enumerate((0.3, 1.9)):
        motion = turn_table(profile, FIELD, tilt, yaw=yaw)
        rng = np.random.default_rng(seed)
        recording = record(motion, module, rng, plant="rate_table", name="table", command=profile)
        psi, _ = rig_initial_states(recording, t)
        apart.append(np.exp(1j * (psi - turned(profile, t) - yaw)))
    if leans:
        np.testing.assert_allclose(np.angle(apart[0] * np.conj(apart[1])), 0.0, atol=0.05)
    else:
        np.testing.assert_allclose(np.angle(apart[0] * np.conj(apart[1])), 1.6, atol=0.05)


def test_a_table_that_stands_still_and_turns_both_ways_shows_its_angle():
    profile = Samples(np.array([0.0, 2.0, 3.0, 6.0, 7.0, 9.0]), np.array([0.0, 0.0, 70.0, 70.0, -20.0, -20.0]))
    motion = turn_table(profile, FIELD, yaw=-1.0)
    recording = record(
        motion, MODULE.without("gps"), np.random.default_rng(5), plant="rate_table", name="table", command=profile
    )
    t = np.arange(0.0, 8.9, 0.25)
    psi, r = rig_initial_states(recording, t)
    truth = motion.at(t)
    _, _, yaw = euler_angles(truth.attitude)
    assert np.max(np.abs(np.angle(np.exp(1j * (psi - yaw))))) < 0.2
    # the corners of a ramp of 90 rad/s^2 are rounded over a tenth of a second
    np.testing.assert_allclose(r, truth.rate[:, 2], atol=5.0)


@pytest.mark.skipif(not PRACTICE.is_dir(), reason="no practice recordings: set DISCSIM_RECORDINGS")
@pytest.mark.parametrize("name", ["calm-evening", "no-path", "open-field"])
def test_the_field_of_a_recorded_throw_is_where_the_starts_put_it(name):
    for recording in read_dataset(PRACTICE / name):
        magnetometer = recording.need("magnetometer")
        starts = (flight_initial_states if recording.plant == "flight" else spin_initial_states)(
            recording, magnetometer.t
        )
        apart = magnetometer.value - to_body(starts.attitude, recording.environment.magnetic_field)
        # the readings' own noise is 0.6 uT per axis
        assert np.sqrt(np.mean(apart**2)) < 1.2
