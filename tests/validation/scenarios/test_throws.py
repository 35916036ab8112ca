"""Throws as a person says them, and what the methods' scores on them notice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from discsim.estimators.accelerometer import STANDARD_GRAVITY, AccelerometerErrors
from discsim.estimators.rate import YawRate
from discsim.frames import C3, attitude_matrix
from discsim.shipped import load_disc, load_throw
from discsim.validation.scenarios.throws import (
    ACCELEROMETER_PERCENT,
    EDGE_S,
    FULL_SET,
    MOUNT_ERROR,
    QUICK_SET,
    SCORED,
    StatedThrow,
    Throw,
    ThrowResult,
    fly_throws,
    rms,
    throw_checks,
)

DISC, FIELD = load_disc("driver")


def body_axes(throw: Throw) -> np.ndarray:
    """C_BN of the release: its rows are x_B, y_B, z_B in N."""
    release = throw.release
    return attitude_matrix(release.roll, release.pitch, release.yaw)


def ahead(throw: Throw) -> np.ndarray:
    heading = np.radians(throw.heading_deg)
    return np.array([np.cos(heading), np.sin(heading), 0.0])


def to_the_right(throw: Throw) -> np.ndarray:
    heading = np.radians(throw.heading_deg)
    return np.array([-np.sin(heading), np.cos(heading), 0.0])


def slope(direction: np.ndarray, throw: Throw) -> float:
    """How many degrees the disc's edge lies below the middle in a horizontal direction."""
    z_B = body_axes(throw)[2]
    along_plane = direction - (direction @ z_B) * z_B
    return float(np.degrees(np.arcsin(along_plane[2] / np.linalg.norm(along_plane))))


class TestRelease:
    @pytest.mark.parametrize("heading", [0.0, 112.0, 270.0])
    def test_bank_lowers_the_right_edge_seen_along_the_flight(self, heading):
        throw = Throw(20.0, heading, 4000.0, bank_deg=15.0, nose_deg=0.0)
        assert slope(to_the_right(throw), throw) == pytest.approx(15.0, abs=1e-9)
        assert slope(ahead(throw), throw) == pytest.approx(0.0, abs=1e-9)

    @pytest.mark.parametrize("heading", [0.0, 112.0, 270.0])
    def test_nose_lifts_the_leading_edge(self, heading):
        throw = Throw(20.0, heading, 4000.0, bank_deg=0.0, nose_deg=8.0)
        assert slope(ahead(throw), throw) == pytest.approx(-8.0, abs=1e-9)
        assert slope(to_the_right(throw), throw) == pytest.approx(0.0, abs=1e-9)

    @given(
        heading=st.floats(0.0, 360.0),
        bank=st.floats(-60.0, 60.0),
        nose=st.floats(-40.0, 40.0),
        elevation=st.floats(-10.0, 40.0),
    )
    def test_the_heading_turns_attitude_and_velocity_together(self, heading, bank, nose, elevation):
        """Whatever way it is thrown the disc meets the air alike: the velocity in B is the one of a throw to the north,
        whose roll and pitch are bank and nose themselves."""
        throw = Throw(20.0, heading, 4000.0, elevation, bank, nose)
        north = replace(throw, heading_deg=0.0)
        np.testing.assert_allclose(
            [north.release.roll, north.release.pitch, north.release.yaw],
            np.radians([bank, nose, 0.0]),
            atol=1e-12,
        )
        np.testing.assert_allclose(body_axes(throw), body_axes(north) @ C3(np.radians(heading)), atol=1e-12)
        np.testing.assert_allclose(
            body_axes(throw) @ throw.release.velocity, body_axes(north) @ north.release.velocity, atol=1e-11
        )

    def test_speed_elevation_height_and_spin_are_the_release_s(self):
        release = Throw(22.0, 112.0, -3600.0, elevation_deg=14.0, height=1.7).release
        assert np.linalg.norm(release.velocity) == pytest.approx(22.0)
        assert -release.velocity[2] == pytest.approx(22.0 * np.sin(np.radians(14.0)))
        assert np.degrees(np.arctan2(release.velocity[1], release.velocity[0])) == pytest.approx(112.0)
        np.testing.assert_array_equal(release.position, [0.0, 0.0, -1.7])
        np.testing.assert_allclose(release.body_rate, [0.0, 0.0, np.radians(-3600.0)])

    def test_the_first_throw_is_the_shipped_one(self):
        """models/throws/driver.toml, whose numbers have six decimals."""
        ours, shipped = QUICK_SET[0].release, load_throw("driver")
        for name in ("position", "velocity", "roll", "pitch", "yaw", "body_rate"):
            np.testing.assert_allclose(getattr(ours, name), getattr(shipped, name), atol=1e-6, err_msg=name)

    def test_its_name_says_what_it_is(self):
        assert Throw(24.0, 0.0, 4200.0).name == "24 m/s to 0 deg, 4200 deg/s"


class TestSets:
    def test_they_go_all_round_at_several_speeds_and_spin_both_ways(self):
        quadrants = {int(throw.heading_deg // 90) for throw in FULL_SET}
        assert quadrants == {0, 1, 2, 3}
        assert len({throw.speed for throw in FULL_SET}) >= 4
        for throws in (QUICK_SET, FULL_SET):
            assert {np.sign(throw.spin_deg_s) for throw in throws} == {-1.0, 1.0}

    def test_the_full_set_holds_the_quick_one(self):
        assert FULL_SET[: len(QUICK_SET)] == QUICK_SET

    def test_every_throw_starts_well_above_the_gyroscope_s_range(self):
        """10 to 20 % of the spin is lost in flight, so 2500 deg/s at release stays above 2000."""
        assert min(abs(throw.spin_deg_s) for throw in FULL_SET) > 2500.0


@pytest.fixture(scope="module")
def results() -> list[ThrowResult]:
    return list(fly_throws(QUICK_SET, DISC, FIELD, np.random.default_rng(0)))


class TestFlown:
    def test_every_score_is_ok(self, results):
        assert [item.text for item in throw_checks(results) if not item.ok] == []

    def test_each_throw_is_flown_to_the_ground_and_estimated_by_each_method(self, results):
        assert [result.throw for result in results] == list(QUICK_SET)
        for result in results:
            assert result.motion.touched_down
            assert set(result.rates) == set(SCORED)
            assert result.recording.plant == "flight"
            assert result.recording.name == result.throw.name

    def test_one_module_1_mm_off_is_on_all_of_them(self, results):
        """(9): 1 mm nearer the axis reads sqrt(1 - 1/16.1) of the rate, 0.5 % of nonlinearity more or less.

        The sheet still states the intended place.
        """
        for result in results:
            np.testing.assert_array_equal(result.recording.sheets["accelerometer"].position, [-0.0161, 0.0, 0.0])
            share = np.nanmedian(result.error("accelerometer")) / abs(np.radians(result.throw.spin_deg_s))
            assert share == pytest.approx(np.sqrt(1 - 1000 * MOUNT_ERROR / 16.1) - 1, abs=0.01)

    def test_errors_are_of_the_magnitude_where_a_method_has_no_sign(self, results):
        """The second throw spins backwards: fft and accelerometer give its magnitude, the truth is negative."""
        backwards = results[1]
        rate = backwards.rates["fft"]
        assert backwards.motion.rate[0, 2] < 0
        assert not rate.signed
        assert rms(backwards.error("fft")) < np.radians(20.0)
        truth = backwards.motion.at(rate.t).rate[:, 2]
        signed = replace(backwards, rates={"fft": replace(rate, rate=truth, sd=np.ones(rate.t.size), signed=True)})
        assert rms(signed.error("fft")) < 1e-9

    def test_the_ends_of_a_flight_are_not_scored(self, results):
        result = results[0]
        rate = result.rates["accelerometer"]
        near_end = (rate.t < EDGE_S) | (rate.t > result.motion.end - EDGE_S)
        spoilt = replace(rate, rate=np.where(near_end, 1e3, rate.rate))
        changed = replace(result, rates={"accelerometer": spoilt})
        np.testing.assert_array_equal(changed.error("accelerometer"), result.error("accelerometer"))
        inner = (rate.t >= EDGE_S) & (rate.t <= result.motion.end - EDGE_S)
        assert changed.error("accelerometer").size == inner.sum() > 100


def test_the_accelerometer_s_limit_is_its_worst_case():
    """(9) alone, with (13) at the driver's spin, and with the zero-g offset at the slowest spin of the set."""
    worst, d, slowest = AccelerometerErrors(), 0.0161, min(abs(throw.spin_deg_s) for throw in FULL_SET)

    def too_small(spin_deg_s: float, *, scale: float, cross: float, bias: float) -> float:
        felt = (1 - scale) * (d - MOUNT_ERROR) - cross * MOUNT_ERROR
        square = felt / d - (cross * STANDARD_GRAVITY + bias) / (d * np.radians(spin_deg_s) ** 2)
        return float(100 * (1 - np.sqrt(square)))

    by_13 = {"scale": worst.nonlinearity, "cross": worst.cross_axis}
    assert too_small(4200.0, scale=0.0, cross=0.0, bias=0.0) == pytest.approx(3.2, abs=0.05)
    assert too_small(4200.0, **by_13, bias=0.0) == pytest.approx(3.6, abs=0.05)
    assert too_small(slowest, **by_13, bias=worst.bias) == pytest.approx(ACCELEROMETER_PERCENT, abs=0.05)


class TestEachCheckCanFail:
    @staticmethod
    def failed(results: list[ThrowResult], method: str, change: Callable[[YawRate], YawRate]) -> set[str]:
        """The checks that fail where the last throw's estimate is changed."""
        spoilt = replace(results[-1], rates={**results[-1].rates, method: change(results[-1].rates[method])})
        scores = throw_checks([*results[:-1], spoilt])
        return {item.name.removeprefix("throws: ") for item in scores if not item.ok}

    @staticmethod
    def silent(rate: YawRate) -> YawRate:
        nothing = np.full(len(rate), np.nan)
        return replace(rate, rate=nothing, sd=nothing)

    def test_an_fft_that_is_off(self, results):
        failed = self.failed(results, "fft", lambda x: replace(x, rate=x.rate + np.radians(25.0)))
        assert failed == {"worst rms error of fft"}

    def test_an_fft_that_knows_half_of_one_flight(self, results):
        def late(x: YawRate) -> YawRate:
            early = x.t < 3.0
            return replace(x, rate=np.where(early, np.nan, x.rate), sd=np.where(early, np.nan, x.sd))

        assert self.failed(results, "fft", late) == {"smallest share of a flight that fft knows"}

    def test_an_fft_that_says_nothing_of_one_throw(self, results):
        failed = self.failed(results, "fft", self.silent)
        assert failed == {"worst rms error of fft", "smallest share of a flight that fft knows"}

    def test_an_accelerometer_that_is_off_or_says_nothing(self, results):
        name = "worst rms error of accelerometer, 1 mm off"
        assert self.failed(results, "accelerometer", lambda x: replace(x, rate=1.11 * x.rate)) == {name}
        assert self.failed(results, "accelerometer", self.silent) == {name}

    def test_a_best_that_is_off_or_says_nothing(self, results):
        name = "worst rms error of best"
        assert self.failed(results, "best", lambda x: replace(x, rate=x.rate + np.radians(0.6))) == {name}
        assert self.failed(results, "best", self.silent) == {name}

    def test_a_gyroscope_that_speaks_beyond_its_range(self, results):
        def speaking(x: YawRate) -> YawRate:
            return replace(x, rate=np.nan_to_num(x.rate, nan=-34.9), sd=np.nan_to_num(x.sd, nan=0.1))

        assert self.failed(results, "gyroscope", speaking) == {"share of gyroscope values beyond its range"}

    def test_a_flight_too_short_to_score(self, results):
        """Nothing is left between the edges: no figure, so no check passes."""
        short = results[-1].motion
        first = short.t <= 1.0
        names = ("t", "position", "velocity", "acceleration", "attitude", "rate", "angular_acceleration")
        cut = replace(short, touched_down=False, **{name: getattr(short, name)[first] for name in names})
        scores = throw_checks([*results[:-1], replace(results[-1], motion=cut)])
        assert not any(item.ok for item in scores)


def test_the_root_mean_square_is_of_what_is_known():
    assert rms(np.array([3.0, np.nan, 4.0])) == pytest.approx(np.sqrt(12.5))
    assert np.isnan(rms(np.array([np.nan, np.nan])))
    assert np.isnan(rms(np.array([])))


def test_parts_without_accelerometer_and_gyroscope_are_scored_by_what_is_left(tmp_path):
    """The throw is a stated one: `discsim validate --parts --throws` has such."""
    part = tmp_path / "field-only.toml"
    part.write_text('name = "AK8963 alone"\n[magnetometer]\nrate_hz = 100.0\nnoise_rms_uT = 0.6\n', encoding="utf-8")
    throw = StatedThrow("mine", load_throw("driver"))
    assert throw.spin_deg_s == pytest.approx(4200.0)
    [result] = fly_throws([throw], DISC, FIELD, np.random.default_rng(0), (str(part), "neo_m8n"))
    assert set(result.rates) == {"fft", "best"}
    scores = {item.name: item for item in throw_checks([result])}
    assert not [name for name in scores if "accelerometer" in name or "gyroscope" in name]
    assert scores["throws: worst rms error of fft"].ok
