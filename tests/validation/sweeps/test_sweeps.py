"""Sweeps: what every mount reads from one truth run is what it reads in a simulation of its own."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from discsim.effects.catalogue import effect
from discsim.effects.sensors import AccelerometerBias, BiasDrift, CrossAxis, Lag, PositionOffset, Scale
from discsim.engine import fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.accelerometer import accelerometer
from discsim.estimators.fft import FftSettings, fft
from discsim.motion import Motion
from discsim.rig import default_profile, turn_table
from discsim.sensors import Accelerometer, Instruments, Magnetometer, Noise, Sampling, record
from discsim.shipped import load_disc, load_throw
from discsim.validation.scenarios.rate_table import errors_within, true_rate
from discsim.validation.sweeps import chunks as chunks_module
from discsim.validation.sweeps.chunks import Sweep, chunk_tasks, fly_truth, motion_from, score_chunk, segments
from discsim.validation.sweeps.figures import draw_sweep
from discsim.validation.sweeps.mounts import (
    MountDesign,
    closed_form,
    look_with_accelerometer,
    look_with_magnetometer,
    stretched,
)
from discsim.validation.sweeps.plan import Plan, plan_file, read_plan
from discsim.validation.sweeps.result import labelled, write_netcdf
from discsim.validation.sweeps.swept import sweep

SMALL = """
name = "small"
seed = 3
drawn = true
[truth]
plant = "rate_table"
rates_deg_s = [1200, 2600]
hold_s = 2.0
ramp_s = 0.5
[axes]
radius_m = [0.01, 0.02]
[mounts]
design = "sobol"
count = 6
x_m = [-0.002, 0.002]
y_m = [-0.002, 0.002]
about_y_deg = [-3, 3]
[estimators]
accelerometer = "all"
fft = 2
"""


def plan_of(folder: Path, text: str) -> Plan:
    path = folder / "plan.toml"
    path.write_text(text)
    return read_plan(path)


def swept(plan: Plan) -> tuple[Sweep, xr.Dataset]:
    motions = tuple(motion_from(fly_truth(number, plan), plan, number) for number in range(len(plan.truths)))
    sweep = Sweep(plan, plan.mounts.mounts(plan.seed), motions)
    return sweep, labelled(sweep, [score_chunk(task.argument, sweep)["scores"] for task in chunk_tasks(plan)])


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> tuple[Sweep, xr.Dataset]:
    return swept(plan_of(tmp_path_factory.mktemp("small"), SMALL))


@pytest.fixture(scope="module")
def wobbly_flight() -> Motion:
    """A throw that wobbles, of a disc whose centre of mass is off its centre: every term of Eq. (1) is there."""
    disc, environment = load_disc("driver")
    release = replace(load_throw("driver"), body_rate=np.array([6.0, -4.0, 70.0]))
    return fly(disc, environment, release, [effect("body.mass_imbalance", ex_m=0.001)], duration=1.0)


def test_the_specific_force_of_any_mount_follows_from_one_look_at_the_truth(wobbly_flight):
    looked = Accelerometer(Sampling(400.0), drift=BiasDrift(0.5, -0.3, 0.2), lag=Lag(0.002))
    view = look_with_accelerometer(wobbly_flight, looked, np.random.default_rng(0))
    mounted = replace(
        looked,
        position=np.array([-0.03, 0.01, 0.002]),
        offset=PositionOffset(0.004, -0.003, 0.002),
        misalignment=np.array([0.05, -0.03, 0.08]),
        scale=Scale(0.01, -0.02, 0.005),
        cross_axis=CrossAxis(0.02, -0.01, 0.015, 0.005, -0.02, 0.01),
        bias=AccelerometerBias(0.3, -0.5, 0.2),
        noise=Noise(0.03),
    )
    ours = view.measure(mounted, np.random.default_rng(5))
    whole = mounted.measure(wobbly_flight, np.random.default_rng(5))
    np.testing.assert_array_equal(ours.t, whole.t)
    # readings are rounded to 1e-9; the gradient, of some 5000 m/s^2 per m, is a difference good to 1e-12 of that
    np.testing.assert_allclose(ours.value, whole.value, atol=1e-8, rtol=0)


def test_the_field_of_any_mounting_angle_follows_from_one_look_at_the_truth(wobbly_flight):
    looked = Magnetometer(Sampling(100.0), lag=Lag(0.003), noise=Noise(0.6), range=40.0)
    view = look_with_magnetometer(wobbly_flight, looked, np.random.default_rng(0))
    mounted = replace(looked, misalignment=np.array([0.05, -0.03, 0.08]))
    whole = mounted.measure(wobbly_flight, np.random.default_rng(5))
    assert np.any(np.abs(whole.value) == 40.0)
    np.testing.assert_allclose(view.measure(mounted, np.random.default_rng(5)).value, whole.value, atol=2e-9, rtol=0)


def test_a_mount_of_a_sweep_scores_as_in_a_simulation_of_its_own(small):
    sweep, result = small
    plan, number, case = sweep.plan, 1, sweep.plan.cases[1]
    seed = lambda *key: np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(2, 1, *key)))  # noqa: E731
    yaw = np.random.default_rng(np.random.SeedSequence(plan.seed, spawn_key=(1, 0))).uniform(0, 2 * np.pi)
    motion = turn_table(plan.profile, Environment(), yaw=yaw)
    module = Instruments.from_parts("mpu9250").fitted("accelerometer", position=[-case.settings["radius_m"], 0, 0])
    module = module.drawn(seed(1, number))
    mount = sweep.mounts[number]
    for name in module.sensors:
        module = module.fitted(name, misalignment=mount[3:])
    module = module.fitted("accelerometer", offset=PositionOffset(*mount[:3]))
    recording = record(motion, module, seed(0, number), plant="rate_table", name="one")
    rates = {
        "accelerometer": accelerometer(recording.need("accelerometer"), recording.sheets["accelerometer"]),
        "fft": fft(recording.need("magnetometer"), FftSettings(step=plan.fft_step)),
    }
    for name, rate in rates.items():
        for k, (start, stop) in enumerate(segments(plan, motion, case.settings)):
            error, known = errors_within(rate, true_rate(motion), start, stop)
            place = {"estimator": name, "radius_m": 0.02, "mount": number, "segment": k}
            # a reading next to the edge of a converter's step may fall on its other side: one of 200 samples by 2e-5
            assert float(result.bias_deg_s.sel(place)) == pytest.approx(np.degrees(error[known].mean()), rel=1e-5)
            assert float(result.known.sel(place)) == pytest.approx(known.mean())
            rms = np.degrees(np.sqrt(np.mean(error[known] ** 2)))
            assert float(result.rms_deg_s.sel(place)) == pytest.approx(rms, rel=1e-5)


@given(rate=st.floats(10.0, 120.0), x=st.floats(-0.005, 0.005), y=st.floats(-0.005, 0.005), z=st.floats(-0.005, 0.005))
def test_an_ideal_sensor_errs_by_the_closed_form_whatever_its_offset(rate, x, y, z):
    """Eq. (9) with e_n = 0 on a steady table: only the part of the offset along the stated arm matters."""
    motion = steady(rate)
    sensor = Accelerometer(offset=PositionOffset(x, y, z), position=np.array([-0.0161, 0.004, 0.0]))
    estimate = accelerometer(sensor.measure(motion, np.random.default_rng(0)), sensor.sheet)
    predicted = closed_form(np.array([rate]), sensor.position, np.array([[x, y, z]]))[0, 0]
    # readings are rounded to 1e-9 m/s^2 of the 1.1 that the slowest rate and shortest arm leave
    np.testing.assert_allclose(estimate.rate - rate, predicted, atol=2e-9 * rate, rtol=0)


def steady(rate: float) -> Motion:
    t = np.array([0.0, 0.01, 0.02])
    still, along = np.zeros((3, 3)), np.tile([0.0, 0.0, rate], (3, 1))
    attitude = np.column_stack((np.cos(rate * t / 2), np.zeros((3, 2)), np.sin(rate * t / 2)))
    return Motion(t, still, still, still, attitude, along, still, Environment())


def test_the_error_by_the_closed_form_is_unknown_where_the_offset_leads_beyond_the_axis():
    error = closed_form(np.array([50.0]), np.array([-0.01, 0, 0]), np.array([[0.009, 0, 0], [0.011, 0, 0]]))
    assert error[0, 0] == pytest.approx(50 * (np.sqrt(0.1) - 1))
    assert np.isnan(error[1, 0])


def test_the_score_of_a_mount_does_not_depend_on_how_mounts_are_cut_into_chunks(small, monkeypatch):
    sweep, result = small
    monkeypatch.setattr(chunks_module, "CHUNK", 4)
    parts = [score_chunk(task.argument, sweep)["scores"] for task in chunk_tasks(sweep.plan)]
    assert len(parts) == 2 * len(sweep.plan.cases)
    xr.testing.assert_identical(labelled(sweep, parts), result)


def test_the_result_is_labelled_and_comes_back_from_its_file(small, tmp_path):
    sweep, result = small
    write_netcdf(tmp_path / "sweep.nc", result)
    with xr.open_dataset(tmp_path / "sweep.nc", engine="scipy") as read:
        assert read.rms_deg_s.dims == ("estimator", "radius_m", "mount", "segment")
        one = read.sel(estimator="accelerometer", radius_m=0.02, mount=5)
        np.testing.assert_allclose(one.rate_deg_s, [1200, 2600], rtol=1e-9)
        np.testing.assert_array_equal(read.x_m, sweep.mounts[:, 0])
        np.testing.assert_array_equal(
            np.isfinite(read.known.sel(estimator="fft", radius_m=0.01))[:, 0], [1, 1, 0, 0, 0, 0]
        )
        xr.testing.assert_allclose(read, result)


def test_errors_grow_with_offset_over_radius_and_end_where_the_sensor_leaves_its_range(tmp_path):
    """The paper's statement: as far from the centre as the accelerometer's range allows."""
    plan = plan_of(
        tmp_path,
        SMALL.replace("[0.01, 0.02]", "[0.008, 0.016, 0.032, 0.064]")
        .replace("count = 6", "count = 64")
        .replace("drawn = true", "")
        .replace("fft = 2", ""),
    )
    _, result = swept(plan)
    one = result.isel(segment=1).sel(estimator="accelerometer")  # 2600 deg/s: 16 g at 76 mm
    size = np.sqrt((one.bias_deg_s**2).mean("mount")).values
    # halving offset over radius halves the error, but for (9)'s curvature and 3 deg of tilt
    np.testing.assert_allclose(size[:-1] / size[1:], 2.0, rtol=0.1)
    faster = plan_of(tmp_path, SMALL.replace("2600", "3200").replace("[0.01, 0.02]", "[0.016, 0.064]"))
    known = swept(faster)[1].known.isel(segment=1).sel(estimator="accelerometer").mean("mount")  # 16 g at 50 mm
    assert known.values.tolist() == [1.0, 0.0]


def test_a_table_at_rest_and_a_method_that_knows_nothing_are_reported(tmp_path):
    """At rest there is no relative error, and a field across no window's line leaves a method without any value."""
    plan = plan_of(
        tmp_path,
        'name = "rest"\nseed = 3\nfft_step = 64\n[truth]\nplant = "rate_table"\nrates_deg_s = [0.0, 1500.0]\n'
        'hold_s = 2.0\nramp_s = 0.5\n[axes]\ndip_deg = [0.0, 60.0]\n[mounts]\ndesign = "random"\ncount = 4\n'
        'x_m = [-0.001, 0.001]\n[estimators]\naccelerometer = "all"\nfft = 1\n',
    )
    found = sweep(plan, workers=1)
    assert float(found.scores.known.sel(estimator="fft").sum()) == 0.0
    found.report(tmp_path / "out")
    lines = (tmp_path / "out" / "cases.csv").read_text().splitlines()
    at_rest = [line.split(",") for line in lines[1:] if line.split(",")[2] == "0"]
    assert [cells[4:] for cells in at_rest] == [["0", "", "", "", "", ""]] * 4
    ran = [line.split(",") for line in lines[1:] if line.split(",")[1:3] == ["accelerometer", "1500"]]
    assert all(float(cells[4]) == 1.0 and 0.0 < float(cells[6]) < 10.0 for cells in ran)
    assert len(ran) == 2


def test_a_field_that_points_steeply_down_is_worth_less_to_the_fft(tmp_path):
    plan = plan_of(
        tmp_path,
        'name = "dip"\n[truth]\nplant = "flight"\nduration_s = 3.0\n[axes]\ndip_deg = [0, 80]\n'
        '[mounts]\ndesign = "random"\ncount = 2\n[estimators]\nfft = "all"\n',
    )
    sweep, result = swept(plan)
    assert len(sweep.motions) == 1, "the field does not move the disc"
    level, steep = result.rms_deg_s.sel(estimator="fft").mean("mount").isel(segment=0).values
    # precession turns the phase by m_z / m_xy of itself beside the spin: tan(80 deg) = 5.7 times as much and more
    assert steep > 3 * level
    draw_sweep(result, sweep, tmp_path / "dip.png")
    assert (tmp_path / "dip.png").stat().st_size > 10_000


def test_axes_that_move_the_disc_are_flown_once_for_each_combination(tmp_path):
    plan = plan_of(
        tmp_path,
        'name = "two"\n[truth]\nplant = "flight"\nduration_s = 1.5\n[axes]\ndisc = ["driver", "cd1"]\n'
        'dip_deg = [10, 60]\n[axes.effect]\n"air.wind.w_north_m_s" = [0.0, 5.0]\n"accel.bias.bx_m_s2" = [0.0, 2.0]\n'
        '[mounts]\ndesign = "grid"\nx_m = [-0.001, 0.001]\nx_points = 3\n[estimators]\naccelerometer = 2\n',
    )
    assert len(plan.truths) == 4
    sweep, result = swept(plan)
    assert dict(result.sizes) == {
        "estimator": 1,
        "disc": 2,
        "dip_deg": 2,
        "air.wind.w_north_m_s": 2,
        "accel.bias.bx_m_s2": 2,
        "mount": 3,
        "segment": 1,
    }
    np.testing.assert_allclose(sweep.mounts[:, 0], [-0.001, 0.0, 0.001])
    one = result.bias_deg_s.isel(estimator=0, segment=0)
    assert np.isnan(one.sel(mount=1)).all(), "of a grid, mounts spread evenly are scored: here its ends"
    np.testing.assert_array_equal(one.sel(dip_deg=10).isnull(), one.sel(dip_deg=60).isnull())
    # a bias towards the axis adds to r^2 d: 2 m/s^2 at 16.1 mm and 4200 deg/s are 1.15 % of the rate
    shift = one.sel({"accel.bias.bx_m_s2": 2.0}) - one.sel({"accel.bias.bx_m_s2": 0.0})
    np.testing.assert_allclose(shift.sel(mount=0), 0.0115 * 4200, rtol=0.1)
    wind = result.rate_deg_s.sel({"air.wind.w_north_m_s": 5.0}) - result.rate_deg_s.sel({"air.wind.w_north_m_s": 0.0})
    assert (np.abs(wind) > 0.1).all(), "a tail wind brakes the spin less"


@given(count=st.integers(1, 70), design=st.sampled_from(["random", "sobol"]), seed=st.integers(0, 5))
def test_mounts_lie_in_their_ranges_and_the_same_seed_gives_the_same(count, design, seed):
    low, high = np.array([-1e-3, 0, 2e-3, 0, -0.1, 0]), np.array([1e-3, 0, 2e-3, 0.2, 0.1, 0])
    mounts = MountDesign(design, count, low, high).mounts(seed)
    assert mounts.shape == (count, 6)
    assert np.all((mounts >= low) & (mounts <= high))
    np.testing.assert_array_equal(mounts, MountDesign(design, count, low, high).mounts(seed))


def test_sobol_points_fill_a_range_more_evenly_than_random_ones():
    def unevenness(design):
        x = np.sort(MountDesign(design, 256, np.zeros(6), np.ones(6)).mounts(1), axis=0)
        return np.abs(x - (np.arange(256)[:, None] + 0.5) / 256).max()

    # in each coordinate 256 scrambled Sobol' points have one in every 256th of the range
    assert unevenness("sobol") < 1 / 256 < unevenness("random")


@pytest.mark.parametrize("name", ["installation", "field_dip"])
def test_a_shipped_plan_can_be_read(name):
    plan = read_plan(plan_file(name), count=5)
    assert plan.name == name
    assert plan.mounts.count == 5
    assert max(plan.estimators.values()) == 5


@pytest.mark.parametrize(
    ("change", "line", "expected"),
    [
        (("radius_m", "radius_mm"), 11, "unknown key 'axes.radius_mm'; did you mean 'radius_m'?"),
        (("seed = 3", "sede = 3"), 3, "unknown key 'sede'; did you mean 'seed'?"),
        (("fft = 2", "fftt = 2"), 20, "unknown estimator 'fftt'"),
        (("fft = 2", "fft = 0"), 20, "a number of mounts from 1"),
        (("seed = 3", "seed = 1.5"), 3, "a whole number"),
        (("[0.01, 0.02]", "[0.01, 0.01]"), 11, "a value twice"),
        (("[0.01, 0.02]", "[10, 20]"), 11, "from 0.0001 to 0.5"),
        (("[0.01, 0.02]", "[]"), 11, "at least one value"),
        (('"sobol"', '"halton"'), 13, "one of grid, random, sobol"),
        (("x_m = [-0.002, 0.002]", "x_m = [2, 1]"), 15, "the smaller one first"),
        (("x_m = [-0.002, 0.002]", "x_m = [-2, 2]"), 15, "at most 0.5"),
        (('"rate_table"', '"spin_down"'), 6, "one of rate_table, flight"),
        (("radius_m = [0.01, 0.02]", 'disc = "driver"'), 11, "belongs to a flight"),
        (("radius_m = [0.01, 0.02]", 'parts = "mpu6050"'), 11, "mpu9250"),
        (("radius_m = [0.01, 0.02]", 'parts = "neo_m8n"'), None, "needs accelerometer"),
        (("radius_m = [0.01, 0.02]", 'profile = "missing.csv"'), 11, "no such file"),
        (("radius_m = [0.01, 0.02]", '[axes.effect]\n"air.wnd.w" = [1]'), 12, "did you mean 'air.wind'"),
        (("radius_m = [0.01, 0.02]", '[axes.effect]\n"air.wind.w_north_m_s" = [1]'), 12, "acts on flight"),
        (("radius_m = [0.01, 0.02]", '[axes.effect]\n"accel.bias.bx" = [1]'), 12, "bx_m_s2"),
        (("radius_m = [0.01, 0.02]", '[axes.effect]\n"accel.position_offset.dx_m" = [1]'), 12, "[mounts]"),
        (("hold_s = 2.0", "hold_s = 1.0"), None, "long enough to be scored"),
    ],
)
def test_a_plan_that_cannot_be_followed_is_refused_by_name_and_line(tmp_path, change, line, expected):
    assert SMALL.count(change[0]) == 1
    with pytest.raises(InputError) as refused:
        plan_of(tmp_path, SMALL.replace(*change))
    assert expected in str(refused.value)
    assert str(refused.value).startswith(f"{tmp_path / 'plan.toml'}:" + (f"{line}: " if line else " "))


def test_a_profile_from_a_file_counts_from_the_plans_folder(tmp_path):
    (tmp_path / "slow.csv").write_text("time_s,rate_deg_s\n0,0\n0.5,900\n2.5,900\n")
    (tmp_path / "fast.csv").write_text("time_s,rate_deg_s\n0,0\n0.5,900\n2.5,900\n3,1800\n5,1800\n")
    text = SMALL.replace("radius_m = [0.01, 0.02]", 'profile = ["slow.csv", "fast.csv"]').replace("fft = 2", "")
    with pytest.raises(InputError, match=r"plan.toml:7: .* both give a profile"):
        plan_of(tmp_path, text)
    text = text.replace("rates_deg_s = [1200, 2600]\nhold_s = 2.0\nramp_s = 0.5\n", "")
    _, result = swept(plan_of(tmp_path, text))
    np.testing.assert_allclose(result.rate_deg_s, [[900, np.nan], [900, 1800]], rtol=1e-9)
    assert np.isfinite(result.bias_deg_s.sel(profile="fast.csv")).all()
    assert result.known.sel(profile="slow.csv").isel(segment=1).isnull().all()


def test_the_default_profile_is_swept_where_the_plan_names_none(tmp_path):
    text = SMALL.replace("rates_deg_s = [1200, 2600]\nhold_s = 2.0\nramp_s = 0.5\n", "")
    np.testing.assert_array_equal(plan_of(tmp_path, text).profile.t, default_profile().t)


class TestALooseMount:
    def test_it_lets_the_module_out_as_far_as_a_spring_in_the_turning_frame_does(self):
        """Centrifugal, Coriolis and elastic force with some damping, integrated until it is at rest."""
        from scipy.integrate import solve_ivp

        r, hz, place = np.radians(3000.0), 40.0, np.array([-0.0161, 0.003])
        w = 2 * np.pi * hz

        def slopes(_: float, y: np.ndarray) -> np.ndarray:
            p, v = y[:2], y[2:]
            force = r**2 * p - w**2 * (p - place) + 2 * r * np.array([v[1], -v[0]]) - 0.2 * w * v
            return np.concatenate([v, force])

        end = solve_ivp(slopes, (0.0, 2.0), np.concatenate([place, np.zeros(2)]), rtol=1e-9, atol=1e-12).y[:2, -1]
        np.testing.assert_allclose(end, place * stretched(np.array([r]), hz), rtol=1e-6)

    def test_the_rate_errs_by_half_the_square_of_spin_over_vibration_and_more(self):
        """(9) with what the mount lets the sensor out: r (1/sqrt(1 - (r/w)^2) - 1)."""
        rate, sensor = 80.0, Accelerometer(position=np.array([-0.0161, 0.0, 0.0]))
        view = look_with_accelerometer(steady(rate), sensor, np.random.default_rng(0), 50.0)
        estimate = accelerometer(view.measure(sensor, np.random.default_rng(0)), sensor.sheet)
        share = (rate / (100 * np.pi)) ** 2
        np.testing.assert_allclose(estimate.rate / rate - 1, 1 / np.sqrt(1 - share) - 1, atol=1e-9)
        assert estimate.rate[0] / rate - 1 > share / 2

    def test_a_sweep_over_it_moves_the_accelerometer_alone_in_a_whole_recording_as_well(self, tmp_path):
        text = SMALL.replace("radius_m = [0.01, 0.02]", "mount_hz = [50.0]").replace("count = 6", "count = 1")
        text = text.replace("drawn = true", "").replace("about_y_deg = [-3, 3]", "")  # a tilt brings gravity in
        text = text.replace("fft = 2", "accelerometer_calibrated = 1")
        _, result = swept(plan_of(tmp_path, text))
        one = result.isel(mount=0, mount_hz=0)
        spin = np.radians(one.rate_deg_s.values)
        offset = np.array([[float(one.x_m), float(one.y_m), 0.0]])
        away = 1 + closed_form(np.ones(2), np.array([-0.0161, 0.0, 0.0]), offset)[0]
        expected = np.degrees(spin) * (away * np.sqrt(stretched(spin, 50.0)) - 1)
        # 0.03 m/s^2 of noise over 1 s, of some 7 and 33 m/s^2
        np.testing.assert_allclose(one.bias_deg_s.sel(estimator="accelerometer"), expected, atol=2.0)
        # the calibration by the field takes a share of the rate for a place, and leaves what grows with the rate
        calibrated = one.bias_deg_s.sel(estimator="accelerometer_calibrated").values
        assert 0.1 < np.abs(calibrated).max() < np.abs(expected).max()

    def test_a_mount_that_cannot_hold_the_module_is_refused(self):
        with pytest.raises(InputError, match="tears off"):
            stretched(np.array([100.0]), 15.0)


class TestAMagnet:
    PLAN = SMALL.replace("radius_m = [0.01, 0.02]", "magnet_m = [0.03, 0.1, 0.3]\nmagnet_A_m2 = 0.05")

    def test_it_adds_its_field_to_that_of_the_iron_and_falls_with_the_cube_of_its_distance(self, tmp_path):
        text = self.PLAN.replace("[mounts]", '[axes.effect]\n"mag.hard_iron.bx_uT" = [2.0]\n[mounts]')
        plan = plan_of(tmp_path, text)
        added = [plan.effects(case.settings, moving=False)[0].value.bx_uT - 2.0 for case in plan.cases]
        # 1e-7 * 2 m/d^3 T; by Biot and Savart a loop of radius a and moment m has 2e-7 m/(d^2 + a^2)^1.5 on its axis
        loop = [1e6 * 2e-7 * 0.05 / (d**2 + 1e-8) ** 1.5 for d in (0.03, 0.1, 0.3)]
        np.testing.assert_allclose(added, loop, rtol=1e-4)
        assert plan.effects(plan.cases[0].settings, moving=True) == ()

    def test_the_nearest_silences_the_magnetometer_and_the_figure_says_so(self, tmp_path):
        text = self.PLAN.replace("drawn = true", "").replace("rates_deg_s = [1200, 2600]", "rates_deg_s = [1000, 2600]")
        done, result = swept(plan_of(tmp_path, text))
        known = result.known.sel(estimator="fft").mean(("mount", "segment", "magnet_A_m2")).values
        assert known[0] < 0.75 < known[1]
        error = result.rms_deg_s.sel(estimator="fft").isel(segment=0).mean(("mount", "magnet_A_m2")).values
        assert error[1] > error[2]
        figure = draw_sweep(result, done)
        said = [text.get_text() for axes in figure.axes for text in axes.texts]
        assert any("% known" in text for text in said)
        assert figure.axes[0].get_xscale() == "log"

    def test_a_distance_without_a_moment_is_refused_and_so_is_a_magnet_by_no_magnetometer(self, tmp_path):
        with pytest.raises(InputError, match="needs both"):
            plan_of(tmp_path, self.PLAN.replace("magnet_A_m2 = 0.05", ""))
        alone = self.PLAN.replace("magnet_A_m2 = 0.05", 'magnet_A_m2 = 0.05\nparts = ["adxl375"]')
        with pytest.raises(InputError, match="no magnetometer among the parts"):
            plan_of(tmp_path, alone.replace("fft = 2\n", ""))
