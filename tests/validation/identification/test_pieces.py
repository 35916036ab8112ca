"""Segments of motion and their linearisation: against the engines, the sensors, and readings simulated anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import (
    DRIVER,
    FIELD,
    MODULE,
    PROFILES,
    RIG,
    coasting,
    coasts,
    flight,
    noiseless,
    release_of,
    rows_of,
    states_of,
    tables,
    throws,
)

from discsim.arrays import FloatArray
from discsim.effects import CATALOGUE, Effect, effect
from discsim.engine import fly
from discsim.frames import body_to_ned
from discsim.motion import Motion
from discsim.recording import Recording, Samples
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, record
from discsim.trajectory import predict
from discsim.validation.diagnosis.first_trajectory import beginning
from discsim.validation.identification import linearisation
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.observations import readings_of
from discsim.validation.identification.plants.flight import FLIGHT
from discsim.validation.identification.plants.free_spin import FREE_SPIN
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.propagation import Column, base_flat, runner_of
from discsim.validation.identification.segments import Trajectory, resegmented, trajectory_of
from discsim.validation.identification.sensor_model import is_motion, predicted

#: sizes that show well within half a second of flight
IN_THE_AIR = (
    effect("air.wind", w_north_m_s=2.0, w_east_m_s=-1.0),
    effect("air.wind_shear", w_north_m_s=2.0, w_east_m_s=1.0, exponent=0.25),
    effect("air.gust", t_s=0.2, width_s=0.1, w_north_m_s=2.0, w_east_m_s=1.0),
    effect("air.density", ratio=1.1),
    effect("air.ground_effect", k=0.5),
    effect("aero.spin_side_force", CYr=0.02),
    effect("aero.spin_lift", CLr=0.02),
    effect("aero.spin_drag", CDrr=0.02),
    effect("aero.spin_pitching_moment", CMr=0.002),
    effect("aero.stall", k=0.5, alpha_stall_rad=0.05),
    effect("aero.yaw_reynolds", exponent=0.3),
    effect("aero.yaw_quadratic", CNrr=-0.002),
    effect("aero.yaw_alpha", CNraa=-0.05),
    effect("body.mass_imbalance", ex_m=1e-3, ey_m=-5e-4),
    effect("body.inertia_asymmetry", dIyy_kg_m2=2e-5),
    effect("event.impulse", t_s=0.2, dv_north_m_s=0.3, dv_east_m_s=-0.2, dv_down_m_s=0.1),
    effect("event.spin_step", t_s=0.2, dr_rad_s=1.0),
)
ON_SENSORS = (
    effect("mag.hard_iron", bx_uT=3.0, by_uT=-2.0, bz_uT=1.0),
    effect("mag.soft_iron", sxx=0.05, sxy=0.02, sxz=-0.03, syy=-0.04, syz=0.01, szz=0.03),
    effect("mag.lag", tau_s=0.003),
    effect("mag.stray_field", bn_uT=10.0, be_uT=-5.0, bd_uT=8.0, height_m=1.5),
    effect("mag.clock_rate", ratio=1.002),
    effect("accel.lag", tau_s=0.002),
    effect("accel.clock_rate", ratio=0.998),
    effect("accel.position_offset", dx_m=0.001, dy_m=-0.002, dz_m=0.003),
    effect("accel.bias", bx_m_s2=0.3, by_m_s2=-0.2, bz_m_s2=0.1),
    effect("accel.bias_drift", bx_m_s3=0.3, by_m_s3=-0.2, bz_m_s3=0.1),
    effect("accel.scale", sx=0.02, sy=-0.03, sz=0.01),
    effect("accel.cross_axis", sxy=0.02, sxz=-0.01, syx=0.03, syz=0.01, szx=-0.02, szy=0.01),
    effect("accel.saturation", limit_m_s2=60.0),
    effect("gyro.lag", tau_s=0.002),
    effect("gyro.clock_rate", ratio=1.001),
    effect("gyro.bias", bx_rad_s=0.05, by_rad_s=-0.03, bz_rad_s=0.1),
    effect("gyro.scale", sx=0.02, sy=-0.01, sz=0.03),
    effect("gyro.g_sensitivity", kx=1e-3, ky=-5e-4, kz=2e-4),
    effect("gps.clock_rate", ratio=1.002),
    effect("gps.latency", delay_s=0.08),
    effect("clock.rate", ratio=1.001),
    effect("mag.mount", rx_rad=0.03, ry_rad=-0.05, rz_rad=0.1),
    effect("gyro.mount", rx_rad=0.03, ry_rad=-0.05, rz_rad=0.1),
    effect("accel.mount", rx_rad=0.03, ry_rad=-0.05, rz_rad=0.1),
    effect("gyro.cross_axis", sxy=0.02, sxz=-0.01, syx=0.03, syz=0.01, szx=-0.02, szy=0.01),
    effect("mag.time_offset", offset_s=0.006),
    effect("accel.time_offset", offset_s=-0.007),
    effect("gyro.time_offset", offset_s=0.012),
    effect("gps.time_offset", offset_s=-0.05),
    effect("board.rotation", rx_rad=0.3, ry_rad=-0.5, rz_rad=1.2),
    effect("site.field", declination_rad=0.2, inclination_rad=-0.1, ratio=1.05),
)
#: lost samples, and what happens to a logger's rows, are counted before the fit by searches of their own and enter no
#: prediction
COUNTED = {f"{sensor}.dropped_samples" for sensor in ("mag", "accel")} | {
    *("clock.lost_rows", "clock.late_rows", "mag.own_clock", "imu.own_clock", "mag.average")
}
#: the module has no track; `tests/validation/diagnosis/test_partly.py` fits one
TRACKED = {"track.camera", "track.time_offset"}


def values_of(*effects: Effect) -> dict[tuple[str, str], float]:
    return {(e.id, name): number for e in effects for name, number in e.value._asdict().items()}


def recorded(motion: Motion, module: Instruments = MODULE) -> Recording:
    return record(motion, noiseless(module), np.random.default_rng(1), plant="flight", name="throw", disc=DRIVER)


@cache
def clean() -> Motion:
    return flight(seconds=0.9)


def beside(motion: Motion, recording: Recording, segments: int = 3) -> Trajectory:
    """A trajectory that starts each segment where the true motion is."""
    nodes = np.linspace(0.0, recording.end + 1e-6, segments + 1)
    return trajectory_of(recording, nodes, states_of(motion, nodes[:-1]))


def test_every_effect_of_the_catalogue_takes_part_here():
    rigs = {id for id, row in CATALOGUE.items() if id.startswith("rig.")}
    settings = {id for id, row in CATALOGUE.items() if row.settings}  # no numbers, so no prediction has them
    assert {e.id for e in (*IN_THE_AIR, *ON_SENSORS)} | rigs | settings | COUNTED | TRACKED == set(CATALOGUE)


# ------------------------------------------------------------------------------------------------- motion


@pytest.mark.parametrize("hidden", IN_THE_AIR, ids=lambda e: e.id)
def test_a_piece_flies_as_the_standalone_model_does(hidden: Effect):
    release = release_of(0.4, 70.0)
    t = np.linspace(0.0, 0.45, 91)
    model = predict(DRIVER, FIELD, release, [hidden], duration=0.5).at(t)
    first = np.hstack([model.position[0], model.velocity[0], model.attitude[0], model.rate[0]])
    one = trajectory_of(recorded(clean()), np.array([0.0, 0.5]), first[None])
    values = values_of(hidden)
    # steps fixed for speed: what they leave stays a hundredth of what the sensors' noise is, and less
    gps = shown(one, values, "gps", t)
    assert gps == pytest.approx(np.hstack([model.position, model.velocity]), abs=2e-7)
    assert shown(one, values, "gyroscope", t) == pytest.approx(model.rate, abs=1e-5)
    turned = model.in_body(FIELD.magnetic_field)
    assert shown(one, values, "magnetometer", t) == pytest.approx(turned, abs=1e-5)


@pytest.mark.parametrize(
    "hidden",
    [
        (),
        (effect("rig.coulomb_friction", torque_N_m=2e-4),),
        (effect("rig.quadratic_drag", coefficient_N_m_s2=1e-6),),
        (effect("rig.axis_tilt", tilt_north_rad=0.05, tilt_east_rad=-0.03),),
        (effect("event.spin_step", t_s=0.7, dr_rad_s=2.0),),
    ],
    ids=lambda hidden: hidden[0].id if hidden else "none",
)
def test_a_rig_coasts_as_in_the_engine(hidden: Sequence[Effect]):
    motion = spin_down(RIG, FIELD, 40.0, 1.5, hidden, yaw=0.5)
    one = trajectory_of(coasting(motion, RIG), np.array([0.0, 1.5]), np.array([[0.5, 40.0]]))
    t = np.arange(0.003, 1.49, 0.01)
    # MuJoCo's fourth-order steps of 1 ms leave this much of a pulse of 10 ms
    assert shown(one, values_of(*hidden), "gyroscope", t) == pytest.approx(motion.at(t).rate, abs=1e-5)
    field = motion.at(t).in_body(FIELD.magnetic_field)
    assert shown(one, values_of(*hidden), "magnetometer", t) == pytest.approx(field, abs=2e-4)


@pytest.mark.parametrize(
    "hidden",
    [
        (),
        (effect("rig.axis_tilt", tilt_north_rad=0.05, tilt_east_rad=-0.03),),
        (effect("rig.speed_ripple", order=2.0, amplitude_rad_s=0.2, phase_rad=0.4),),
    ],
    ids=lambda hidden: hidden[0].id if hidden else "none",
)
def test_a_table_turns_as_in_the_engine(hidden: Sequence[Effect]):
    motion = turn_table(PROFILES[1], FIELD, hidden, yaw=0.5)
    recording = tables()[1]
    one = trajectory_of(recording, np.array([0.0, 3.0]), np.array([[0.5, 0.0]]))
    t = np.arange(0.003, 2.99, 0.01)
    # the engine's table follows its command by a loop of 100/s, which trails a ripple by some of its amplitude
    relaxed_fit = 1e-3 if hidden and hidden[0].id == "rig.speed_ripple" else 1e-6
    assert shown(one, values_of(*hidden), "gyroscope", t) == pytest.approx(motion.at(t).rate, abs=relaxed_fit)
    field = motion.at(t).in_body(FIELD.magnetic_field)
    assert shown(one, values_of(*hidden), "magnetometer", t) == pytest.approx(field, abs=100.0 * relaxed_fit)


def test_a_disc_in_no_air_spins_freely_as_in_the_engine():
    thin = replace(FIELD, air_density=1e-9)
    hidden = effect("body.inertia_asymmetry", dIyy_kg_m2=2e-5)
    motion = fly(DRIVER, thin, release_of(0.4, 70.0), [hidden], duration=0.45)
    state = np.zeros(FREE_SPIN.layout.size)
    state[FREE_SPIN.layout.attitude], state[FREE_SPIN.layout.rate] = motion.attitude[0], motion.rate[0]
    recording = record(
        motion, Instruments.from_parts("mpu9250"), np.random.default_rng(1), plant="free_spin", name="spin", disc=DRIVER
    )
    one = trajectory_of(recording, np.array([0.0, 0.5]), state[None])
    t = np.linspace(0.0, 0.44, 89)
    # steps of 0.07 rad of the spin, fourth order
    assert shown(one, values_of(hidden), "gyroscope", t) == pytest.approx(motion.at(t).rate, abs=2e-5)
    field = motion.at(t).in_body(FIELD.magnetic_field)
    assert shown(one, values_of(hidden), "magnetometer", t) == pytest.approx(field, abs=1e-3)
    momentum = one.recording.disc
    assert momentum is not None
    rate = shown(one, values_of(hidden), "gyroscope", t)
    inertia = np.array([momentum.Ixx, momentum.Ixx + 2e-5, momentum.Izz])
    in_space = np.einsum("nij,nj->ni", body_to_ned(motion.at(t).attitude), inertia * rate)
    assert np.ptp(in_space, axis=0) == pytest.approx(0.0, abs=1e-6 * np.linalg.norm(in_space[0]))


# ----------------------------------------------------------------------------------------------- readings


@pytest.mark.parametrize("error", ON_SENSORS, ids=lambda e: e.id)
def test_the_parameters_of_a_fit_act_on_a_sensor_as_the_effects_they_stand_for(error: Effect):
    """Lags and clocks aside, which are of the samples and not of a reading."""
    motion, t = clean(), np.linspace(0.05, 0.85, 41)
    module = noiseless(MODULE).with_effects([error])
    recording = recorded(motion)
    for name in ("magnetometer", "accelerometer", "gyroscope"):
        ideal = module.sensors[name].ideal(motion, t)  # type: ignore[union-attr]
        if error.id == "accel.saturation" and name == "accelerometer":
            assert np.max(np.abs(ideal)) > 60.0
            ideal = np.clip(ideal, -60.0, 60.0)
        values = values_of(error)
        assert predicted(name, recording, values, t, rows_of(motion, t)) == pytest.approx(ideal, abs=1e-9)


@pytest.mark.parametrize("error", ON_SENSORS, ids=lambda e: e.id)
def test_a_chain_reads_what_the_sensors_wrote(error: Effect):
    """Everything in one: MuJoCo's motion, lag, clock and latency, against the fit's own motion between its starts."""
    motion = clean()
    recording = recorded(motion, MODULE.with_effects([error]))
    linear = linearise(beside(motion, recording), values_of(error), (), np.zeros(12, dtype=np.bool_))
    # MuJoCo's steps of 1 ms and the splines through them, in the sensors' units: a hundredth of their noise;
    # a clipped accelerometer holds z, which a fit compares with the limit
    allowed = {"magnetometer": 3e-3, "accelerometer": 3e-3, "gyroscope": 2e-5, "gps": 1e-5}
    for channel in linear.channels:
        assert channel.index.size > 0
        worst = np.max(np.abs(linear.raw[channel.rows]))
        assert worst < allowed[channel.sensor], (channel, worst)


def test_readings_at_the_range_and_gaps_take_no_part():
    recording = throws(seconds=0.5)[0]
    gyroscope = recording.samples["gyroscope"]
    holes = gyroscope.value.copy()
    holes[7, 0] = np.nan
    recording = replace(recording, samples={**recording.samples, "gyroscope": Samples(gyroscope.t, holes)})
    readings = {one.sensor: one for one in readings_of(recording)}["gyroscope"]
    assert not readings.good[:, 2].any()  # 70 rad/s is twice the range
    assert readings.clipped[:, 2].all()
    assert not readings.good[7, 0]
    assert readings.good[:, 0].sum() == len(gyroscope) - 1


def test_a_clipped_reading_counts_where_the_fit_would_not_clip():
    """It is an inequality: silent as long as the motion is beyond the range, loud where it would be within."""
    motion = clean()
    one = beside(motion, throws(seconds=0.9)[0])
    slow = one.states.copy()
    slow[:, 12] = 20.0
    none = np.zeros(12, dtype=np.bool_)
    loud = linearise(replace(one, states=slow), {}, (), none)
    quiet = linearise(one, {}, (), none)
    assert ("gyroscope", "z_rad_s") not in {(c.sensor, c.axis) for c in quiet.channels}
    assert ("gyroscope", "z_rad_s") in {(c.sensor, c.axis) for c in loud.channels}


def test_a_chain_cut_anew_is_the_same_motion():
    motion = clean()
    one = trajectory_of(recorded(motion), np.array([0.0, 0.9]), states_of(motion, np.zeros(1)))
    cut = resegmented(one, {}, np.array([0.0, 0.2, 0.55, 0.9]))
    t = np.linspace(0.0, 0.88, 45)
    assert shown(cut, {}, "accelerometer", t) == pytest.approx(shown(one, {}, "accelerometer", t), abs=1e-4)


# ------------------------------------------------------------------------------------------ linearisation


def predictions(one: Trajectory, values: dict[tuple[str, str], float], after: float = -1.0) -> FloatArray:
    """Measured minus predicted of a trajectory as it stands, simulated anew."""
    linear = linearise(one, values, (), np.zeros(one.plant.layout.directions, dtype=np.bool_))
    return linear.raw[linear.t > after]


def slope_of(one: Trajectory, values: dict[tuple[str, str], float], key: tuple[str, str], h: float) -> FloatArray:
    at = values.get(key, 0.0)
    up, down = predictions(one, {**values, key: at + h}), predictions(one, {**values, key: at - h})
    return (down - up) / (2.0 * h)


#: where a segment begins, slopes in time are taken over the next 0.4 ms: the spin turns by half of that too much
ONE_SIDED = 70.0 * 2e-4
#: neighbours of a throw are flown in steps of 1.4 rad of nutation, whose quadrature is good to some parts in a thousand
NEIGHBOURS = 6e-3


def rows_at(linear: Linear, sensor: str) -> FloatArray:
    return np.concatenate([np.r_[c.rows] for c in linear.channels if c.sensor == sensor])


def assert_column(linear: Linear, found: FloatArray, expected: FloatArray, share: float, what: object) -> None:
    """Each channel's column within a share of the group's largest entry: axes of one sensor share a scale."""
    for group in {c.group for c in linear.channels}:
        rows = np.concatenate([np.r_[c.rows] for c in linear.channels if c.group == group])
        size = np.max(np.abs(expected[rows]))
        worst = np.max(np.abs(found[rows] - expected[rows]))
        assert worst <= share * size + 1e-9, (what, group, worst, size)


@cache
def tied() -> tuple[Trajectory, Trajectory]:
    """One flight as one segment and as three that are continuous."""
    motion = clean()
    one = trajectory_of(recorded(motion), np.array([0.0, 0.9]), states_of(motion, np.zeros(1)))
    return one, resegmented(one, {}, np.array([0.0, 0.25, 0.6, 0.9]))


def test_columns_of_the_first_state_are_those_of_the_whole_flight():
    one, three = tied()
    linear = linearise(three, {}, (), np.zeros(12, dtype=np.bool_))
    assert linear.residual == pytest.approx(linear.raw, abs=1e-6)
    for k, h in enumerate(FLIGHT.sizes.differences):
        tangent = h * np.eye(12)[k]
        moved = [
            predictions(replace(one, states=FLIGHT.layout.moved(one.states, s * tangent)), {}) for s in (1.0, -1.0)
        ]
        assert_column(linear, linear.nuisance[:, k], (moved[1] - moved[0]) / (2.0 * h), NEIGHBOURS, k)


def test_columns_of_a_jump_move_what_comes_after_it():
    _, three = tied()
    allowed = np.zeros(12, dtype=np.bool_)
    allowed[[3, 4, 5, 11]] = True
    linear = linearise(three, {}, (), allowed)
    assert linear.unknowns == 12 + 2 * 4
    two = resegmented(three, {}, np.array([0.0, 0.25, 0.9]))
    for place, direction in ((12, 3), (14, 5), (15, 11)):
        assert (linear.defect_kind[place], linear.defect_segment[place]) == (direction, 1)
        h = FLIGHT.sizes.differences[direction]
        ends = []
        for sign in (1.0, -1.0):
            states = two.states.copy()
            states[1] = FLIGHT.layout.moved(two.states[1], sign * h * np.eye(12)[direction])
            ends.append(predictions(replace(two, states=states), {}))
        assert_column(linear, linear.nuisance[:, place], (ends[1] - ends[0]) / (2.0 * h), NEIGHBOURS, direction)


def test_a_gap_that_may_not_be_is_closed_by_the_step():
    """Segments that stand apart: residuals are those of the motion from the first state, to first order of the gap."""
    one, three = tied()
    states = three.states.copy()
    states[1:, 0] += 1e-3
    states[2] = FLIGHT.layout.moved(states[2], np.array([0, 0, 0, 1e-3, 0, 0, 0, 0, 1e-5, 0, 0, 0.0]))
    linear = linearise(replace(three, states=states), {}, (), np.zeros(12, dtype=np.bool_))
    whole = predictions(one, {})
    assert np.max(np.abs(linear.raw - whole)) > 5e-4
    assert linear.residual == pytest.approx(whole, abs=1e-5)


@pytest.mark.parametrize(
    ("key", "h", "values"),
    [
        (("aero", "CLa"), 1e-3, {}),
        (("aero", "CNr"), 1e-5, {}),
        (("environment", "air_density"), 1e-3, {}),
        (("environment", "gravity"), 1e-3, {}),
        (("environment", "magnetic_east"), 0.1, {}),
        (("disc", "Izz"), 1e-8, {}),
        (("air.wind", "w_east_m_s"), 0.01, {("air.wind", "w_north_m_s"): 0.5}),
        (("body.mass_imbalance", "ey_m"), 1e-5, {}),
        (("event.impulse", "t_s"), 1e-4, values_of(IN_THE_AIR[-2])),
        (("mag.hard_iron", "by_uT"), 0.1, {}),
        (("mag.soft_iron", "sxy"), 1e-3, {}),
        (("mag.stray_field", "height_m"), 1e-2, values_of(effect("mag.stray_field", bn_uT=5.0, height_m=2.0))),
        (("accel.position_offset", "dx_m"), 1e-5, {}),
        (("accel.scale", "sy"), 1e-3, {}),
        (("accel.bias_drift", "bz_m_s3"), 1e-2, {}),
        (("gyro.g_sensitivity", "kx"), 1e-5, {}),
        (("mag.lag", "tau_s"), 1e-5, {("mag.lag", "tau_s"): 2e-3}),
        (("mag.clock_rate", "ratio"), 1e-6, {("mag.clock_rate", "ratio"): 1.001}),
        (("clock.rate", "ratio"), 1e-6, {("clock.rate", "ratio"): 1.0}),
        (("gyro.time_offset", "offset_s"), 1e-6, {("gyro.time_offset", "offset_s"): 0.002}),
        (("board.rotation", "ry_rad"), 1e-4, {("board.rotation", "rx_rad"): 0.4}),
        (("site.field", "declination_rad"), 1e-3, {}),
        (("site.field", "ratio"), 1e-3, {("site.field", "ratio"): 1.0}),
        (("gps.latency", "delay_s"), 1e-4, {("gps.latency", "delay_s"): 0.05}),
    ],
    ids=lambda item: ".".join(item) if isinstance(item, tuple) else "",
)
def test_columns_of_shared_parameters_are_those_of_the_whole_flight(
    key: tuple[str, str], h: float, values: dict[tuple[str, str], float]
):
    one, three = tied()
    one, three = resegmented(one, values, one.nodes), resegmented(one, values, three.nodes)
    stated = {
        ("aero", "CLa"): DRIVER.aero.CLa,  # type: ignore[union-attr]
        ("aero", "CNr"): DRIVER.aero.CNr,  # type: ignore[union-attr]
        ("disc", "Izz"): DRIVER.Izz,
        ("environment", "air_density"): FIELD.air_density,
        ("environment", "gravity"): FIELD.gravity,
        ("environment", "magnetic_east"): FIELD.magnetic_field[1],
    }
    if key in stated:
        values = {**values, key: float(stated[key])}  # type: ignore[arg-type]
    linear = linearise(three, values, [Column(*key, h)], np.zeros(12, dtype=np.bool_))
    found, expected = linear.common[:, 0], slope_of(one, values, key, h)
    if key[1] in ("delay_s", "offset_s"):  # there is nothing from before
        found, expected = np.where(linear.t > 0.06, found, 0.0), np.where(linear.t > 0.06, expected, 0.0)
    # second differences of the readings over h
    in_time = key[0] != "site.field" and key[1] in ("ratio", "tau_s", "delay_s", "offset_s")
    share = ONE_SIDED if in_time else NEIGHBOURS if is_motion(key[0]) or key[0] in ("aero", "disc") else 2e-3
    assert_column(linear, found, expected, share, key)


def test_a_lag_that_is_not_there_yet_has_the_slope_of_a_delay():
    one, three = tied()
    linear = linearise(three, {}, [Column("gyro.lag", "tau_s", 1e-5)], np.zeros(12, dtype=np.bool_))
    h = 2e-6
    # the first reading has not forgotten how the lag began
    later, none = predictions(one, {("gyro.lag", "tau_s"): h}, 1e-3), predictions(one, {}, 1e-3)
    some = (linear.t > 1e-3) & np.isin(np.arange(linear.t.size), rows_at(linear, "gyroscope"))
    found, expected = linear.common[some, 0], ((none - later) / h)[some[linear.t > 1e-3]]
    # a lag is a delay to first order; a slope in time is one-sided where a segment begins
    assert found == pytest.approx(expected, abs=ONE_SIDED * np.max(np.abs(expected)))


def rippling() -> Recording:
    """Return a run of a table whose speed ripples six times a turn."""
    profile = Samples(np.array([0.0, 1.5]), np.array([40.0, 55.0]))
    motion = turn_table(profile, FIELD, [effect("rig.speed_ripple", order=6.0, amplitude_rad_s=1.2, phase_rad=0.3)])
    module = Instruments.from_parts("mpu9250", "ac1120s")
    return record(motion, module, np.random.default_rng(5), plant="rate_table", name="ripples", command=profile)


@pytest.mark.parametrize(
    ("recording", "state", "keys"),
    [
        (
            lambda: coasts(seconds=1.5)[0],
            [0.5, 60.0],
            [
                (("rig", "viscous"), 1e-7, RIG.viscous),
                (("rig.coulomb_friction", "torque_N_m"), 1e-6, 1e-5),
                (("rig.axis_tilt", "tilt_east_rad"), 1e-4, 0.0),
                (("accel.position_offset", "dy_m"), 1e-5, 0.0),
                (("clock.rate", "ratio"), 1e-6, 1.0),
            ],
        ),
        (
            lambda: tables()[1],
            [0.5, 0.0],
            [
                (("rig.axis_tilt", "tilt_north_rad"), 1e-4, 0.0),
                (("gyro.scale", "sz"), 1e-4, 0.0),
                (("mag.clock_rate", "ratio"), 1e-6, 1.0),
            ],
        ),
        (
            lambda: rippling(),
            [0.5, 0.0],
            [
                (("rig.speed_ripple", "amplitude_rad_s"), 1e-4, 1.2),
                (("rig.speed_ripple", "phase_rad"), 1e-4, 0.3),
            ],
        ),
    ],
    ids=["spin_down", "rate_table", "a table that ripples: what turns it further moves it in its ripple"],
)
def test_columns_of_a_rig_are_those_of_the_whole_run(recording, state, keys):  # type: ignore[no-untyped-def]
    recording = recording()
    values = {key: at for key, _, at in keys}
    if "rig.speed_ripple" in {group for group, _ in values}:
        values["rig.speed_ripple", "order"] = 6.0  # sets the integrator's steps, so that no difference is taken over it
    nodes = np.array([0.0, recording.end + 1e-6])
    one = trajectory_of(recording, nodes, np.array([state]))
    three = resegmented(one, values, np.linspace(0.0, nodes[1], 4))
    d = one.plant.layout.directions
    columns = [Column(*key, h) for key, h, _ in keys]
    linear = linearise(three, values, columns, np.zeros(d, dtype=np.bool_))
    steps = one.plant.sizes.differences
    for k in range(d):
        moved = [
            predictions(replace(one, states=one.plant.layout.moved(one.states, s * steps[k] * np.eye(d)[k])), values)
            for s in (1.0, -1.0)
        ]
        # within a step of 0.3 rad of a ripple Hermite's cubic has slopes good to 0.3^3/(72 sqrt(3)), in both routes
        share = 2 * 2.2e-4 if ("rig.speed_ripple", "order") in values else 1e-4
        assert_column(linear, linear.nuisance[:, k], (moved[1] - moved[0]) / (2.0 * steps[k]), share, k)
    for j, (key, h, _) in enumerate(keys):
        assert_column(linear, linear.common[:, j], slope_of(one, values, key, h), 1e-3, key)


@pytest.mark.parametrize("unbalanced", [False, True])
def test_columns_of_a_free_spin_are_those_of_the_whole_motion(unbalanced: bool):
    motion = flight(seconds=0.6)
    module = Instruments.from_parts("mpu9250").without("accelerometer")
    recording = record(motion, module, np.random.default_rng(1), plant="free_spin", name="spin", disc=DRIVER)
    state = np.zeros((1, FREE_SPIN.layout.size))
    state[0, 14:16] = 0.3, -0.2
    state[0, :6] = [1.0, -2.0, 3.0, 1.0, -0.05, 0.01]
    state[0, 6:10], state[0, 10:13] = motion.attitude[0], motion.rate[0]
    # the wind's direction in the disc's plane is told by the segment, and so differs by the square of the tilt
    values = {key: 0.3 for key in FREE_SPIN.own_keys[:4]}
    if unbalanced:
        state[0, 16:] = 2.0, -1.0
    one = replace(trajectory_of(recording, np.array([0.0, 0.6]), state), unbalanced=unbalanced)
    plant = one.plant
    d = plant.layout.directions
    assert d == (17 if unbalanced else 15)
    three = resegmented(one, values, np.array([0.0, 0.2, 0.4, 0.6]))
    columns = [
        Column(*FREE_SPIN.own_keys[0], 1e-3),
        Column(*FREE_SPIN.own_keys[3], 1e-3),
        *(Column(*key, 1e-3) for key in FREE_SPIN.motion_keys[10:]),
        Column("body.inertia_asymmetry", "dIyy_kg_m2", 1e-7),
    ]
    linear = linearise(three, values, columns, np.zeros(d, dtype=np.bool_))
    # what wanders is told by the segment: its slope goes on, so that three segments are the same motion as one
    assert predictions(three, values) == pytest.approx(predictions(one, values), abs=1e-3)
    for k in (0, 2, 4, 6, 9, 11, 12, 13, 14, 15, 16)[: 11 if unbalanced else 9]:
        h = plant.sizes.differences[k]
        moved = [
            predictions(replace(one, states=plant.layout.moved(one.states, s * h * np.eye(d)[k])), values)
            for s in (1.0, -1.0)
        ]
        assert_column(linear, linear.nuisance[:, k], (moved[1] - moved[0]) / (2.0 * h), 1e-3, k)
    for j, column in enumerate(columns):
        # what the wobble does to the spin turns with it, 0.7 rad in a long step
        share = 1e-2 if column.name.startswith("spun_by") else 2e-3
        assert_column(linear, linear.common[:, j], slope_of(one, values, column.key, column.step), share, column)


def test_an_event_s_columns_are_the_same_whether_or_not_quiet_pieces_are_left_out(monkeypatch: pytest.MonkeyPatch):
    """A knock moves nothing in segments that it does not touch: there its neighbours are not run."""
    motion = clean()
    one = beside(motion, recorded(motion), 4)
    columns = [Column("event.impulse", f"dv_{axis}_m_s", 0.02, (("t_s", 0.4),)) for axis in ("north", "down")]
    columns.append(Column("event.spin_step", "dr_rad_s", 0.02, (("t_s", 0.7),)))
    defects = np.zeros(12, dtype=np.bool_)
    made = [linearise(one, {}, columns, defects, central=central) for central in (True, False)]
    monkeypatch.setattr(linearisation, "EVENT_REACH", 10.0)
    for linear, central in zip(made, (True, False), strict=True):
        every = linearise(one, {}, columns, defects, central=central)
        np.testing.assert_allclose(linear.own, every.own, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(linear.transitions, every.transitions, rtol=1e-9, atol=1e-9)
        assert np.any(linear.own[:, 12:] != 0.0, axis=0).all()


def test_a_look_at_the_beginning_holds_no_later_readings():
    """Later ones, clipped, would speak in the fit, and all would cost as much as a look at everything."""
    motion = clean()
    whole = beside(motion, recorded(motion), 3)
    short = beginning(replace(whole, lost={"gyroscope": np.arange(whole.readings[2].t.size, dtype=float)}), 0.3)
    assert short.readings[2].sensor == "gyroscope"
    for readings, before in zip(short.readings, whole.readings, strict=True):
        assert readings.t.max() < 0.3 < before.t.max()
        assert readings.good.shape == readings.clipped.shape == readings.value.shape
        assert readings.value.shape[0] == readings.t.size
    assert short.lost["gyroscope"].size == short.readings[2].t.size


def test_a_path_alone_is_flown_in_longer_steps_and_is_the_same_path():
    """Its steps need not follow the nutation of a body that is uneven, which no sensor shows."""
    motion = clean()
    values = values_of(effect("body.inertia_asymmetry", dIyy_kg_m2=2e-5))
    whole = recorded(motion)
    alone = replace(whole, samples={"gps": whole.samples["gps"]})
    runners = [runner_of(one, values) for one in (whole, alone)]
    state = beside(motion, whole, 1).states[0]
    steps = [runner.times(0.0, 0.9, 0.9, state)[0].size for runner in runners]
    assert steps[1] < 0.6 * steps[0]
    paths = []
    for runner in runners:
        times, last = runner.times(0.0, 0.9, 0.9, state)
        flat, wobble = base_flat(whole, values)[None], np.zeros((1, len(FREE_SPIN.motion_keys)))
        paths.append(runner.run(flat, wobble, state[None], times, last, np.linspace(0.0, 0.9, 30))[0][0, :, :3])
    np.testing.assert_allclose(*paths, atol=1e-4)
