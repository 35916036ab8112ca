"""Scores of spin rates for any profile, and a measured rate-table run beside its emulation."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from discsim.effects.sensors import PositionOffset
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.profiles import sine, trapezoids
from discsim.rate_tables import load_table
from discsim.recording import Samples, read_recording, write_recording
from discsim.rig import read_profile, turn_table
from discsim.sensors import Instruments, record
from discsim.validation.cli import main
from discsim.validation.experiments.table_recording import compare, differences, lines_through, read_run
from discsim.validation.scenarios.rate_table import Bench, plateaus, rate_table_checks, run_rate_table, with_all_methods
from discsim.validation.scenarios.table_scores import delay_of, score_rates

FIELD = Environment()
SINE = sine(30.0, 10.0, 0.25, 8.0)


def truth(t):
    return np.interp(t, SINE.t, SINE.value)


def told(delay: float = 0.0, bias: float = 0.0, noise: float = 0.0, seed: int = 0) -> YawRate:
    t = np.arange(0.0, 8.0, 0.01)
    rate = truth(np.clip(t - delay, 0, 8)) + bias + noise * np.random.default_rng(seed).standard_normal(t.size)
    return YawRate("made", t, rate, np.full(t.size, 0.1), signed=True)


class TestScores:
    @given(delay=st.floats(-0.5, 0.8), bias=st.floats(-2.0, 2.0))
    @settings(max_examples=25, deadline=None)
    def test_a_delay_is_found_whatever_the_bias(self, delay, bias):
        found, _ = delay_of(told(delay, bias), truth, (0.0, 8.0))
        assert found == pytest.approx(delay, abs=2e-4)

    def test_its_deviation_is_that_of_its_scatter(self):
        pairs = np.array([delay_of(told(0.05, 0.0, 0.5, seed), truth, (0.0, 8.0)) for seed in range(40)])
        # forty runs tell a scatter to 11 %
        assert pairs[:, 0].std() == pytest.approx(np.median(pairs[:, 1]), rel=0.35)

    def test_a_rate_that_hardly_changes_tells_no_delay(self):
        t = np.arange(0.0, 8.0, 0.01)
        steady = YawRate("made", t, 30.0 + np.sin(70 * t), np.ones(t.size), signed=True)
        assert np.isnan(delay_of(steady, lambda t: np.full(t.shape, 30.0), (0.0, 8.0))).all()

    def test_bias_and_rms_over_the_run_and_by_band(self):
        scores = score_rates({"made": told(0.0, 0.5)}, truth, (0.0, 8.0))
        whole = scores["made"]
        assert (whole.known, whole.bias, whole.rms, whole.worst) == pytest.approx((1.0, 0.5, 0.5, 0.5))
        assert {round(np.degrees(band.low)) for band in scores.bands} == {1000, 2000}
        assert sum(band.count for band in scores.bands) == 800
        assert all(band.bias == pytest.approx(0.5) for band in scores.bands)

    def test_where_a_method_says_nothing_its_band_is_empty(self):
        rate = told()
        fast = truth(rate.t) > np.radians(2000.0)
        silent = replace(rate, rate=np.where(fast, np.nan, rate.rate), sd=np.where(fast, np.nan, rate.sd))
        bands = {round(np.degrees(band.low)): band for band in score_rates({"made": silent}, truth, (0.0, 8.0)).bands}
        assert bands[2000].known == 0.0
        assert np.isnan(bands[2000].rms)
        assert bands[1000].known == 1.0

    def test_the_tables_are_written_in_degrees_with_empty_cells(self, tmp_path):
        score_rates({"made": told(0.0, np.radians(1.5))}, truth, (0.0, 8.0)).write(tmp_path)
        lines = (tmp_path / "methods.csv").read_text().splitlines()
        assert lines[0] == "method,known_share,bias_deg_s,rms_deg_s,worst_deg_s,delay_s,delay_sd_s"
        assert lines[1].startswith("made,1,1.5,1.5,1.5,")
        assert len((tmp_path / "bands.csv").read_text().splitlines()) == 3


class TestPlateaus:
    def test_a_noisy_log_has_the_plateaus_of_its_command(self):
        command = trapezoids(np.array([10.0, 20.0, 35.0]), 4.0, 1.0)
        t = np.arange(0.0, command.t[-1], 0.01)
        noise = 0.01 * np.random.default_rng(0).standard_normal(t.size)
        log = Samples(t, np.interp(t, command.t, command.value) + noise)
        found = plateaus(log, 0.05)
        assert [round(rate) for _, _, rate in found] == [10, 20, 35]
        for (start, stop, _), (first, last, _) in zip(found, plateaus(command), strict=True):
            assert start == pytest.approx(first, abs=0.02)
            assert stop == pytest.approx(last, abs=0.02)

    def test_a_swing_has_none_and_one_within_the_tolerance_is_one(self):
        assert plateaus(SINE, np.radians(3.0)) == []
        assert len(plateaus(sine(30.0, 0.01, 0.5, 8.0), 0.02)) == 1

    @given(seed=st.integers(0, 50), tolerance=st.floats(0.0, 2.0))
    @settings(deadline=None)
    def test_they_stay_within_the_tolerance_and_do_not_overlap(self, seed, tolerance):
        walk = np.cumsum(np.random.default_rng(seed).standard_normal(60))
        profile = Samples(0.5 * np.arange(60.0), walk)
        found = plateaus(profile, tolerance)
        for start, stop, rate in found:
            inside = (profile.t >= start - 0.7 - 1e-9) & (profile.t <= stop + 0.7 + 1e-9)
            assert np.ptp(walk[inside]) <= 2 * tolerance
            assert rate == np.median(walk[inside])
        assert all(a[1] <= b[0] for a, b in pairwise(found))


class TestBench:
    def test_any_part_sits_where_it_is_stated_to(self):
        bench = Bench(parts=("adxl375", "ac1120s"), radius=0.04, mount=np.array([0.002, 0.0, 0.0]))
        profile = trapezoids(np.radians([3000.0, 4000.0]), 2.0, 1.0)
        run = run_rate_table(profile, FIELD, np.random.default_rng(0), bench=bench)
        assert run.recording.sheets["accelerometer"].position[0] == -0.04
        assert set(run.rates) == {"accelerometer"}
        assert run.wide is None
        assert rate_table_checks(run, []) == []
        # (9): 2 mm nearer the axis of 40 mm; its scale and bias leave 0.2 % and 0.3 %
        bias = score_rates(run.rates, run.truth, run.span)["accelerometer"].bias
        assert bias / np.radians(3500.0) == pytest.approx(np.sqrt(1 - 2 / 40) - 1, abs=0.006)

    def test_a_place_without_an_accelerometer_is_refused(self):
        with pytest.raises(InputError, match="no accelerometer among rate_reference, gyroscope"):
            Bench(parts=("adxrs649",), radius=0.02).module(np.random.default_rng(0))

    def test_all_methods_join_the_paper_s(self):
        run = with_all_methods(run_rate_table(SINE, FIELD, np.random.default_rng(0)))
        assert {"fft", "accelerometer", "gyroscope", "adxrs649", "likelihood", "tracking", "fusion"} <= set(run.rates)
        assert "rate_reference" not in run.rates
        scores = score_rates(run.rates, run.truth, run.span)
        assert scores["fusion"].rms < scores["fft"].rms


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A run whose accelerometer sits 1.5 mm nearer the axis than stated, and which states no command."""
    profile = trapezoids(np.radians([1000.0, 1800.0]), 3.0, 1.0)
    motion = turn_table(profile, FIELD, yaw=0.4)
    module = Instruments.from_parts("mpu9250", "ac1120s").fitted("accelerometer", offset=PositionOffset(dx_m=0.0015))
    recording = record(motion, module, np.random.default_rng(3), plant="rate_table", name="mine")
    folder = tmp_path_factory.mktemp("run") / "mine"
    write_recording(recording, folder)
    return folder


def with_reference(folder, out, change):
    """Write the run with another rate reference, t (n,) s and rate (n,) rad/s; what was before 0 s is left out."""
    recording = read_recording(folder)
    reference = recording.need("rate_reference")
    t, rate = change(reference.t, reference.value)
    samples = {**recording.samples, "rate_reference": Samples(t[t >= 0], rate[t >= 0])}
    write_recording(replace(recording, samples=samples), out / "changed")
    return out / "changed"


class TestMeasuredRun:
    def test_the_sensor_that_is_not_as_stated_is_named_and_the_others_are_not(self, measured):
        real = read_run(measured)
        run = run_rate_table(
            real.profile, real.recording.environment, np.random.default_rng(0), bench=Bench(stated=real.instruments)
        )
        found = compare(real, run, "paper", 3.0)
        assert {one.measured.method for one in found.differences} == {"accelerometer"}
        assert found.sentences(Path("out"))[-1].endswith("discsim diagnose out/recording --out diagnosis")
        assert {round(np.degrees(row.rate), -2) for row in found.plateaus} == {1000, 1800}
        # (9) in the measured run, nothing in the emulated one
        fastest = max(found.differences, key=lambda one: one.measured.low)
        middle = np.radians(1700.0)
        assert fastest.measured.bias / middle == pytest.approx(np.sqrt(1 - 1.5 / 16.1) - 1, abs=0.01)
        assert abs(fastest.emulated.bias) < 0.002 * middle

    def test_a_sound_run_errs_as_its_emulation_does(self, measured):
        real = read_run(measured)
        fresh = [
            run_rate_table(
                real.profile,
                real.recording.environment,
                np.random.default_rng(seed),
                bench=Bench(stated=real.instruments),
            )
            for seed in (1, 2)
        ]
        sound = replace(real, recording=fresh[0].recording)
        found = compare(sound, fresh[1], "paper", 3.0)
        assert found.differences == ()
        assert found.sentences(Path()) == [
            "The emulation errs as the measured run does: what is stated of the sensors explains it."
        ]

    @pytest.mark.parametrize(("bias", "told_of"), [(1e-9, 0), (1e-3, 2)])
    def test_what_prints_as_nothing_is_no_difference(self, bias, told_of):
        """Sensors without noise: biases differ by rounding, which is many standard deviations. Two bands."""
        rates = {"gyroscope": told(bias=bias)}
        one, other = (score_rates({"gyroscope": rate}, truth, (0.0, 8.0)) for rate in (rates["gyroscope"], told()))
        assert len(differences(one, other, rates)) == told_of

    @pytest.mark.parametrize(
        ("factor", "unit"), [(180 / np.pi, "deg/s"), (30 / np.pi, "rpm"), (0.5 / np.pi, "turns per second")]
    )
    def test_a_reference_in_another_unit_is_refused_by_what_the_sensors_read(self, measured, tmp_path, factor, unit):
        """Scores were written beside it, of thousands of deg/s, and the sensors were to be diagnosed."""
        with pytest.raises(InputError, match=rf"rate_reference.csv is in {unit}, by magnetometer.*expected rad/s"):
            read_run(with_reference(measured, tmp_path, lambda t, rate: (t, factor * rate)))

    def test_a_reference_in_milliseconds_is_refused(self, measured, tmp_path):
        """An emulation of hours was begun."""
        with pytest.raises(InputError, match="milliseconds"):
            read_run(with_reference(measured, tmp_path, lambda t, rate: (1000 * t, rate)))

    @pytest.mark.parametrize(("late", "way"), [(1.7, "1.70 s late"), (-0.9, "0.90 s early")])
    def test_a_reference_on_a_clock_of_its_own_is_noted(self, measured, tmp_path, late, way):
        (note,) = read_run(with_reference(measured, tmp_path, lambda t, rate: (t + late, rate))).notes
        assert f"rate_reference.csv is {way} beside" in note

    def test_a_sound_reference_is_believed_without_a_word(self, measured):
        assert read_run(measured).notes == ()

    def test_a_reference_alone_is_refused(self, measured, tmp_path):
        whole = read_recording(measured)
        alone = replace(whole, samples={"rate_reference": whole.need("rate_reference")})
        write_recording(alone, tmp_path / "alone")
        with pytest.raises(InputError, match="no sensor that shows a spin"):
            read_run(tmp_path / "alone")

    def test_lines_through_a_log_leave_no_more_than_its_scatter(self, measured):
        log = read_run(measured).profile
        knots = lines_through(log)
        assert len(knots) < 12
        off = log.value - np.interp(log.t, knots.t, knots.value)
        assert np.abs(off).max() < 5 * 0.0006  # the read-out's noise

    def test_the_command_leaves_both_runs_and_a_recording_to_diagnose(self, measured, tmp_path, monkeypatch, capsys):
        out = tmp_path / "out"
        monkeypatch.setattr(sys, "argv", ["discsim", "rate-table", "--recording", str(measured), "--out", str(out)])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 0
        assert {"comparison.md", "comparison.png", "methods.csv", "bands.csv", "plateaus.csv"} <= {
            path.name for path in out.iterdir()
        }
        assert (out / "emulation" / "truth.csv").is_file()
        handed_on = read_recording(out / "recording")
        assert handed_on.command is not None
        assert f"discsim diagnose {out / 'recording'}" in capsys.readouterr().out
        assert json.loads((out / "scores.json").read_text()) == []

    def test_a_run_s_own_log_can_be_the_profile(self, measured):
        assert len(read_profile(measured)) == 701

    @pytest.mark.parametrize(
        ("arguments", "says"),
        [
            (["--recording", "{}", "--radius", "0.02"], "--recording states the parts"),
            (["--radius", "20"], "is it in millimetres"),
            (["--table", "no-such"], "no table 'no-such'"),
            (["--parts", "adxrs649", "--mount", "0.001,0,0"], "no accelerometer among"),
        ],
    )
    def test_what_does_not_go_together_is_refused(self, measured, tmp_path, monkeypatch, capsys, arguments, says):
        words = [word.format(measured) for word in arguments]
        monkeypatch.setattr(sys, "argv", ["discsim", "rate-table", *words, "--out", str(tmp_path / "out")])
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code == 2
        assert says in capsys.readouterr().err


def test_a_table_of_many_knots_tells_its_progress_in_few_lines():
    """A measured log of 800 knots: one line for each would drown all else."""
    parts = []

    def progress(ranges):
        for one in ranges:
            parts.append(one)
            yield one

    run_rate_table(SINE, FIELD, np.random.default_rng(0), bench=Bench(load_table("workshop")), progress=progress)
    assert 10 <= len(parts) <= 25
    assert parts[-1].stop >= 8000
