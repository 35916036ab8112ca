"""The rate-table run: what it scores, that each check can fail, and the table it writes."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from discsim.effects import effect
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.recording import Samples
from discsim.rig import default_profile
from discsim.validation.reporting.options import parse_vector
from discsim.validation.reporting.scores import Score
from discsim.validation.scenarios.rate_table import (
    MARGIN_S,
    Bench,
    Plateau,
    RateTableRun,
    errors_within,
    fft_delay,
    plateau_table,
    plateaus,
    rate_table_checks,
    run_rate_table,
    write_plateaus,
)

# one ramp of 1000 deg/s^2, which the window can follow
PROFILE = default_profile((0, 1500, 2500, 5000), hold=2.2, ramp=1.0)
SHORT = Samples(np.array([0.0, 1.5]), np.radians([900.0, 900.0]))
FIELD = Environment()


@pytest.fixture(scope="module")
def run() -> RateTableRun:
    return run_rate_table(PROFILE, FIELD, np.random.default_rng(0))


def scored(run: RateTableRun) -> dict[str, Score]:
    return {item.name.removeprefix("rate table: "): item for item in rate_table_checks(run, plateau_table(run))}


def altered(run: RateTableRun, method: str, change: Callable[[YawRate], YawRate]) -> RateTableRun:
    return replace(run, rates={**run.rates, method: change(run.rates[method])})


def test_every_check_is_ok_on_a_specimen_within_its_data_sheet(run):
    scores = scored(run)
    assert [item.text for item in scores.values() if not item.ok] == []
    assert len(scores) == 13


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_other_specimens_pass_too_and_their_envelopes_hold_the_truth(seed):
    """Every error drawn anew, and 1 mm of mount error along x and y that the envelopes allow for."""
    profile = Samples(np.array([0.0, 0.8, 3.2]), np.radians([2500.0, 4500.0, 4500.0]))
    run = run_rate_table(profile, FIELD, np.random.default_rng(seed), bench=Bench(mount=np.array([0.001, -0.001, 0.0])))
    scores = scored(run)
    assert [item.text for item in scores.values() if not item.ok] == []
    assert scores["share of truth outside the envelopes"].value == 0.0


class TestEachCheckCanFail:
    """The run's own estimates, made worse by about what the check should notice."""

    @staticmethod
    def fails(run: RateTableRun, name: str) -> None:
        assert not scored(run)[name].ok

    def test_a_bias_of_the_fft(self, run):
        self.fails(
            altered(run, "fft", lambda x: replace(x, rate=x.rate + np.radians(40.0))),
            "largest bias of fft on a plateau",
        )

    def test_a_relative_bias_of_the_fft(self, run):
        self.fails(
            altered(run, "fft", lambda x: replace(x, rate=1.003 * x.rate)), "largest relative bias of fft at high rates"
        )

    def test_a_distortion_that_is_too_large_or_not_there(self, run):
        """The paper sees a small one even at a static rate; none at all would mean that nothing was measured."""
        name = "largest distortion of fft at a static rate"
        shaken = np.radians(12.0) * np.sin(40 * run.rates["fft"].t)
        self.fails(altered(run, "fft", lambda x: replace(x, rate=x.rate + shaken)), name)
        exact = np.abs(run.motion.at(run.rates["fft"].t).rate[:, 2])
        known = np.isfinite(run.rates["fft"].rate)
        self.fails(altered(run, "fft", lambda x: replace(x, rate=np.where(known, exact, np.nan))), name)

    def test_an_fft_that_speaks_below_its_threshold(self, run):
        self.fails(
            altered(run, "fft", lambda x: replace(x, rate=np.nan_to_num(x.rate), sd=np.nan_to_num(x.sd, nan=1.0))),
            "share of fft values below its threshold",
        )

    def test_an_fft_that_knows_nothing_of_one_plateau(self, run):
        """Neither its share, nor its bias, nor its distortion may pass because the other plateaus are fine."""

        def silent(x: YawRate) -> YawRate:
            start, stop, _ = plateaus(PROFILE)[2]
            inside = (x.t >= start) & (x.t <= stop)
            return replace(x, rate=np.where(inside, np.nan, x.rate), sd=np.where(inside, np.nan, x.sd))

        failing = altered(run, "fft", silent)
        self.fails(failing, "smallest share of a plateau that fft knows")
        self.fails(failing, "largest bias of fft on a plateau")
        self.fails(failing, "largest distortion of fft at a static rate")
        self.fails(failing, "largest relative bias of fft at high rates")
        self.fails(failing, "fft error over the next best method's at high rates")

    def test_a_gyroscope_that_does_not_clip(self, run):
        limit = run.recording.sheets["gyroscope"].range

        def unclipped(x: YawRate) -> YawRate:
            return replace(x, rate=np.nan_to_num(x.rate, nan=limit), sd=np.nan_to_num(x.sd, nan=0.1))

        self.fails(altered(run, "gyroscope", unclipped), "share of gyroscope values beyond its range")

    @pytest.mark.parametrize("factor", [0.5, 2.0])
    def test_a_wide_range_gyroscope_of_another_noise(self, run, factor):
        def noisier(x: YawRate) -> YawRate:
            mean = np.interp(x.t, run.motion.t, run.motion.rate[:, 2])
            return replace(x, rate=mean + factor * (x.rate - mean))

        self.fails(altered(run, "adxrs649", noisier), "noise of the wide-range gyroscope")

    def test_an_fft_that_is_worse_than_the_next_best(self, run):
        name = "fft error over the next best method's at high rates"
        self.fails(altered(run, "fft", lambda x: replace(x, rate=x.rate + np.radians(700.0))), name)

    def test_an_envelope_that_misses_the_truth(self, run):
        low = {mount: replace(x, lower=1.05 * x.upper, upper=1.1 * x.upper) for mount, x in run.envelopes.items()}
        self.fails(replace(run, envelopes=low), "share of truth outside the envelopes")

    @pytest.mark.parametrize("factor", [0.7, 1.3])
    def test_an_envelope_of_another_width(self, run, factor):
        def wider(x: YawRate) -> YawRate:
            middle, half = (x.upper + x.lower) / 2, (x.upper - x.lower) / 2
            return replace(x, lower=middle - factor * half, upper=middle + factor * half)

        failing = replace(run, envelopes={mount: wider(x) for mount, x in run.envelopes.items()})
        self.fails(failing, "envelope width for 1 mm at 5000 deg/s over (9)")
        self.fails(failing, "envelope width for 5 mm at 5000 deg/s over (9)")

    def test_an_envelope_that_does_not_grow_with_the_mount_error(self, run):
        small = run.envelopes[0.001]
        self.fails(replace(run, envelopes={0.001: small, 0.005: small}), "envelope width of 5 mm over that of 1 mm")

    def test_a_delay_of_another_length(self, run):
        """Stamps that run 50 ms late: half the paper's window is 640 ms, and 5 % of it are 32 ms."""
        late = run.recording.need("magnetometer")
        samples = {**run.recording.samples, "magnetometer": Samples(late.t + 0.05, late.value)}
        self.fails(replace(run, recording=replace(run.recording, samples=samples)), "delay of the unshifted fft")


class TestOtherProfiles:
    def test_a_table_may_turn_backwards_and_come_back(self):
        """Methods without a sign are held against the magnitude; a rate that comes twice counts twice."""
        profile = Samples(
            np.array([0.0, 2.0, 3.0, 5.0, 7.0, 9.0]), np.radians([-3000.0, -3000.0, -4000.0, -4000.0, -3000.0, -3000.0])
        )
        run = run_rate_table(profile, FIELD, np.random.default_rng(0))
        scores = scored(run)
        assert [item.text for item in scores.values() if not item.ok] == []
        assert "share of fft values below its threshold" not in scores
        table = plateau_table(run)
        assert sum(row.method == "fft" for row in table) == 3
        # a fault on the first visit of a rate is not hidden by the second
        bad = [
            replace(row, bias=np.radians(50.0)) if k == 0 and row.method == "fft" else row
            for k, row in enumerate(table)
        ]
        failed = [item.name for item in rate_table_checks(run, bad) if not item.ok]
        assert "rate table: largest bias of fft on a plateau" in failed

    def test_beyond_the_accelerometer_s_range_the_envelope_is_scored_where_it_knows(self):
        """16 g at 16.1 mm are 5656 deg/s, less what a bad specimen's scale takes; the table goes to 7000."""
        profile = Samples(np.array([0.0, 2.2, 3.2, 5.4]), np.radians([4000.0, 4000.0, 7000.0, 7000.0]))
        run = run_rate_table(profile, FIELD, np.random.default_rng(0))
        rows = {(row.method, round(np.degrees(row.rate))): row for row in plateau_table(run)}
        assert rows["accelerometer", 7000].known == 0.0
        assert np.isnan(rows["accelerometer", 7000].bias)
        scores = scored(run)
        assert "envelope width for 1 mm at 4000 deg/s over (9)" in scores
        assert [item.text for item in scores.values() if not item.ok] == []

    def test_the_envelope_of_a_slow_table_is_not_held_against_the_paper_s(self):
        """There bias makes the envelope of 1 mm a quarter wider than the mount error of (9) alone does."""
        profile = Samples(np.array([0.0, 2.2, 2.7, 4.9]), np.radians([1000.0, 1000.0, 3000.0, 3000.0]))
        scores = scored(run_rate_table(profile, FIELD, np.random.default_rng(0)))
        assert not [name for name in scores if name.startswith("envelope")]
        assert [item.text for item in scores.values() if not item.ok] == []

    def test_a_mount_error_beyond_an_envelope_s_is_not_held_against_it(self):
        profile = Samples(np.array([0.0, 2.2]), np.radians([4000.0, 4000.0]))
        run = run_rate_table(profile, FIELD, np.random.default_rng(0), bench=Bench(mount=np.array([0.004, 0.0, 0.0])))
        assert run.mount == 0.004
        scores = scored(run)
        assert scores["share of truth outside the envelopes"].ok
        # (9): 4 mm nearer the axis of 16.1 mm, sqrt(1 - 4/16.1) of the rate
        bias = next(row.bias for row in plateau_table(run) if row.method == "accelerometer")
        assert bias / np.radians(4000.0) == pytest.approx(np.sqrt(1 - 4 / 16.1) - 1, abs=0.006)
        truth = np.radians(4000.0)
        assert np.all(run.envelopes[0.001].upper < truth)

    def test_slow_plateaus_alone_give_the_checks_that_they_can(self):
        run = run_rate_table(default_profile((0, 200), hold=2.0), FIELD, np.random.default_rng(0))
        assert set(scored(run)) == {"share of fft values below its threshold"}

    def test_an_effect_reaches_the_module(self, run):
        profile = Samples(np.array([0.0, 2.2]), np.radians([3000.0, 3000.0]))
        plain, shifted = (
            run_rate_table(profile, FIELD, np.random.default_rng(0), effects=effects)
            for effects in ((), (effect("mag.hard_iron", bz_uT=30.0),))
        )
        difference = shifted.recording.need("magnetometer").value - plain.recording.need("magnetometer").value
        # both are rounded to 0.15 uT
        np.testing.assert_allclose(difference, np.tile([0.0, 0.0, 30.0], (221, 1)), atol=0.151)

    @pytest.mark.parametrize("text", ["nan,0,0", "0,0,inf", "0.06,0,0", "1,2", "a,b,c"])
    def test_a_mount_that_is_no_place_on_the_board_is_refused(self, text):
        with pytest.raises(InputError, match=f"--mount {text}: expected"):
            parse_vector(text, "--mount", "m", 0.05)

    def test_two_places_for_one_accelerometer_are_refused(self):
        moved = (effect("accel.position_offset", dx_m=0.001),)
        with pytest.raises(InputError, match="both move the accelerometer"):
            run_rate_table(
                PROFILE, FIELD, np.random.default_rng(0), bench=Bench(mount=np.array([0.001, 0, 0])), effects=moved
            )


class TestTable:
    def test_plateaus_are_the_level_stretches_less_their_margins(self):
        profile = Samples(np.array([0.0, 3.0, 4.0, 5.0, 6.0, 9.0]), np.array([1.0, 1.0, 5.0, 5.0, 7.0, 7.0]))
        assert plateaus(profile) == [(MARGIN_S, 3.0 - MARGIN_S, 1.0), (6.0 + MARGIN_S, 9.0 - MARGIN_S, 7.0)]

    def test_errors_are_against_the_truth_at_the_estimates_times(self, run):
        t = np.array([2.5, 2.9, 3.3, 8.0])
        exact = run.motion.at(t).rate[:, 2]
        rate = YawRate(
            "made", t, exact + np.array([0.1, -0.2, np.nan, 9.0]), np.array([1.0, 1.0, np.nan, 1.0]), signed=True
        )
        error, known = errors_within(rate, run.truth, 2.4, 3.4)
        np.testing.assert_allclose(error, [0.1, -0.2, np.nan], atol=1e-12)
        np.testing.assert_array_equal(known, [True, True, False])

    def test_bias_scatter_and_worst_error_are_per_plateau_and_method(self, run):
        table = plateau_table(run)
        assert [(round(np.degrees(row.rate)), row.method) for row in table] == [
            (rate, method)
            for rate in (0, 1500, 2500, 5000)
            for method in ("fft", "accelerometer", "gyroscope", "adxrs649")
        ]
        row = next(row for row in table if row.method == "accelerometer" and row.rate > 80)
        start, stop, rate = plateaus(PROFILE)[-1]
        estimate = run.rates["accelerometer"]
        error = estimate.rate[(estimate.t >= start) & (estimate.t <= stop)] - rate
        assert row.bias == pytest.approx(error.mean(), abs=1e-9)
        assert row.sd == pytest.approx(error.std(), abs=1e-9)
        assert row.worst == pytest.approx(np.abs(error).max(), abs=1e-9)
        assert row.known == 1.0

    def test_a_method_that_says_nothing_has_no_figures(self, run):
        row = next(row for row in plateau_table(run) if row.method == "gyroscope" and row.rate > 80)
        assert row.known == 0.0
        assert np.isnan([row.bias, row.sd, row.worst]).all()

    def test_it_is_written_in_deg_s_and_per_cent(self, tmp_path):
        rate = np.radians(2000.0)
        table = [
            Plateau("fft", rate, 0.75, -0.01 * rate, 0.002 * rate, 0.03 * rate),
            Plateau("adxrs649", -rate, 1.0, 0.01 * rate, 0.002 * rate, 0.03 * rate),
            Plateau("gyroscope", rate, 0.0, np.nan, np.nan, np.nan),
            Plateau("fft", 0.0, 1.0, 0.1, 0.2, 0.3),
        ]
        write_plateaus(tmp_path / "plateaus.csv", table)
        text = (tmp_path / "plateaus.csv").read_text()
        assert text.splitlines()[0] == (
            "rate_deg_s,method,known_share,bias_deg_s,sd_deg_s,worst_deg_s,bias_percent,sd_percent,worst_percent"
        )
        rows = list(csv.DictReader(text.splitlines()))
        assert [rows[0][key] for key in ("rate_deg_s", "method", "known_share")] == ["2000", "fft", "0.750"]
        assert [float(rows[0][key]) for key in ("bias_deg_s", "sd_deg_s", "worst_deg_s")] == [-20.0, 4.0, 60.0]
        assert [float(rows[0][key]) for key in ("bias_percent", "sd_percent", "worst_percent")] == [-1.0, 0.2, 3.0]
        assert [float(rows[1][key]) for key in ("bias_percent", "sd_percent", "worst_percent")] == [1.0, 0.2, 3.0]
        assert set(list(rows[2].values())[3:]) == {""}
        assert list(rows[3].values())[6:] == ["", "", ""]
        assert float(rows[3]["bias_deg_s"]) == pytest.approx(np.degrees(0.1), abs=5e-5)


class TestRun:
    def test_it_records_the_module_the_table_and_the_wide_range_gyroscope(self, run):
        assert set(run.recording.samples) == {"magnetometer", "accelerometer", "gyroscope", "rate_reference"}
        assert set(run.wide.samples) == {"gyroscope"}
        assert run.recording.plant == run.wide.plant == "rate_table"
        np.testing.assert_array_equal(run.recording.command.value, PROFILE.value)

    def test_the_table_s_read_out_is_the_truth_to_its_accuracy(self, run):
        """0.001 % of 60 rad/s as noise: 5 sigma of 1300 values."""
        read = run.recording.need("rate_reference")
        inside = read.t <= run.motion.end
        error = read.value[inside] - run.motion.at(read.t[inside]).rate[:, 2]
        assert np.abs(error).max() < 5 * 0.0006

    def test_the_yaw_phase_at_the_start_is_drawn(self):
        yaw = [run_rate_table(SHORT, FIELD, np.random.default_rng(seed)).motion.euler_angles[2][0] for seed in range(3)]
        assert np.ptp(yaw) > 0.1

    def test_the_same_seed_gives_the_same_run(self):
        first, again = (run_rate_table(SHORT, FIELD, np.random.default_rng(4)) for _ in range(2))
        for name, samples in first.recording.samples.items():
            np.testing.assert_array_equal(again.recording.need(name).value, samples.value)
        np.testing.assert_array_equal(again.rates["adxrs649"].rate, first.rates["adxrs649"].rate)

    def test_the_paper_s_delay_is_half_its_window(self, run):
        assert fft_delay(run) == pytest.approx(127 / 2 * 0.01, rel=0.05)
