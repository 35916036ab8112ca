"""Rates that something else computed, against a truth: figures in closed form, limits, files that are wrong."""

from __future__ import annotations

import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.validation.cli import main
from discsim.validation.estimating.rate_files import read_rates, read_truth
from discsim.validation.estimating.scored import score_rates

T = np.linspace(0.0, 10.0, 1001)
SPIN = 50.0 + 5.0 * np.sin(T)


def rate(t: np.ndarray, value: np.ndarray, sd: float = 0.0, signed: bool = True) -> YawRate:
    return YawRate("firmware", t, value, np.full(t.size, sd), signed=signed)


TRUTH = rate(T, SPIN)


def command(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", "score", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def write(path: Path, header: str, *columns: np.ndarray) -> Path:
    rows = "\n".join(",".join(f"{x:.9g}" for x in row) for row in np.column_stack(columns))
    path.write_text(f"{header}\n{rows}\n")
    return path


def test_a_bias_and_a_noise_are_told_in_degrees_per_second():
    noise = np.random.default_rng(0).normal(0.0, 0.02, T.size)
    (found,) = score_rates([rate(T, SPIN + 0.01 + noise, sd=0.02)], TRUTH).errors
    assert found.bias == pytest.approx(np.degrees(0.01), abs=np.degrees(3 * 0.02 / np.sqrt(T.size)))
    assert found.rms == pytest.approx(np.degrees(np.hypot(0.01, 0.02)), rel=0.05)
    assert 0.9 < found.within < 0.97  # a bias of half an sd: 92.9 %
    assert found.known == 1.0


def test_a_rate_that_is_late_is_told_by_how_much():
    (found,) = score_rates([rate(T, 50.0 + 5.0 * np.sin(T - 0.02))], TRUTH).errors
    assert found.delay == pytest.approx(0.02, rel=1e-2)  # to first order in the delay
    (steady,) = score_rates([rate(T, np.full(T.size, 50.1))], rate(T, np.full(T.size, 50.0))).errors
    assert np.isnan(steady.delay)


def test_of_a_rate_that_falls_along_a_line_no_delay_is_told():
    """A rate that is late by a second and one that is too large by the slope are the same then."""
    line = 70.0 - T
    (found,) = score_rates([rate(T, line + 0.1)], rate(T, line)).errors
    assert found.bias == pytest.approx(np.degrees(0.1))
    assert np.isnan(found.delay)


def test_a_delay_that_noise_hides_is_not_told():
    """Slopes of 0.2 rad/s^2 rms beside errors of 1 rad/s at 500 instants: an sd of 0.2 s."""
    noise = np.random.default_rng(1).normal(0.0, 1.0, T.size)
    (found,) = score_rates([rate(T, 50.0 + 0.3 * np.sin(T) + noise)], rate(T, 50.0 + 0.3 * np.sin(T))).errors
    assert np.isnan(found.delay)


def test_a_rate_without_a_sign_is_compared_by_its_magnitude():
    backwards = rate(T, -SPIN)
    (found,) = score_rates([rate(T, SPIN, signed=False)], backwards).errors
    assert found.worst == 0.0
    (wrong,) = score_rates([rate(T, SPIN)], backwards).errors
    assert wrong.bias == pytest.approx(np.degrees(2 * SPIN.mean()))


def test_values_that_are_unknown_count_against_what_is_known_and_nothing_else():
    value = SPIN.copy()
    value[::4] = np.nan
    gaps = YawRate("firmware", T, value, np.where(np.isfinite(value), 0.0, np.nan), signed=True)
    (found,) = score_rates([gaps], TRUTH).errors
    assert found.known == pytest.approx(0.75, abs=1e-3)
    assert found.rms == 0.0
    (none,) = score_rates([YawRate("firmware", T, T * np.nan, T * np.nan)], TRUTH, {"rms": 1.0}).errors
    assert none.known == 0.0
    assert np.isnan(none.rms)


def test_a_figure_that_is_not_known_is_within_no_limit():
    found = score_rates([YawRate("firmware", T, T * np.nan, T * np.nan)], TRUTH, {"rms": 1.0})
    assert not found.ok


@pytest.mark.parametrize(("header", "factor"), [("rate_deg_s", 180 / np.pi), ("rate_rpm", 30 / np.pi), ("r_rad_s", 1)])
def test_a_file_may_be_in_the_units_of_who_wrote_it(tmp_path, header, factor):
    (found,) = read_rates(write(tmp_path / "mine.csv", f"time_s,{header}", T, factor * SPIN))
    np.testing.assert_allclose(found.rate, SPIN, rtol=1e-7)
    assert found.method == "mine"


def test_each_method_of_a_file_is_scored_and_the_paper_s_have_no_sign(tmp_path):
    path = tmp_path / "rate.csv"
    path.write_text("time_s,method,rate_rad_s,sd_rad_s\n0,fft,50,0.1\n1,fft,,\n0,best,-50,0.1\n1,best,-51,0.1\n")
    fft, best = read_rates(path)
    assert (fft.signed, best.signed) == (False, True)
    assert np.isnan(fft.rate[1])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,rate\n0,1\n", r":1: .*expected time_s and one of"),
        ("time_s,rate_rad_s\n0,1\n0,2\n", r":3: time 0 s follows 0 s; expected ascending time"),
        ("time_s,rate_rad_s\n0,x\n", r":2: 'x' is no number"),
        ("time_s,rate_rad_s\n0,inf\n", r":2: 'inf' is not finite"),
        ("time_s,rate_rad_s\n0\n", r":2: has 1 cells; expected 2"),
        ("time_s,rate_rad_s\n", "holds no row"),
    ],
)
def test_a_file_that_is_wrong_is_refused_by_its_line(tmp_path, text, said):
    path = tmp_path / "rate.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=said):
        read_rates(path)


def test_times_that_have_nothing_in_common_are_told():
    with pytest.raises(InputError, match="expected times in common"):
        score_rates([rate(T + 100.0, SPIN)], TRUTH)


def test_the_command_keeps_limits_in_junit_and_in_its_exit_status(tmp_path, monkeypatch, capsys):
    truth = write(tmp_path / "truth.csv", "time_s,rate_rad_s", T, SPIN)
    mine = write(tmp_path / "mine.csv", "time_s,rate_rad_s", T, SPIN + np.radians(0.3))
    out, junit = str(tmp_path / "out"), tmp_path / "score.xml"
    words = [str(mine), "--against", str(truth), "--out", out, "--junit", str(junit), "--limit"]
    assert command(monkeypatch, *words, "rms=0.5") == 0
    assert command(monkeypatch, *words, "rms=0.2", "--limit", "known=0.9") == 1
    suite = ElementTree.parse(junit).getroot()[0]
    assert (suite.get("name"), suite.get("tests"), suite.get("failures")) == ("discsim score", "2", "1")
    assert "&lt;= 0.2 deg/s" in (tmp_path / "out" / "report.html").read_text()
    assert "FAIL rms: 0.3 deg/s" in capsys.readouterr().out
    assert command(monkeypatch, *words, "rsm=1") == 2
    assert "--limit rsm: unknown" in capsys.readouterr().err


def test_a_truth_is_one_rate_over_time(tmp_path):
    path = tmp_path / "truth.csv"
    path.write_text("time_s,rate_rad_s\n0,1\n")
    with pytest.raises(InputError, match="fewer than two"):
        read_truth(path)


@pytest.mark.parametrize(
    ("text", "t", "spin"),
    [
        ("Time (ms), Spin rate (deg/s)\n0,90\n500,180\n", 0.5, np.pi),
        ("t_us;spin_dps\n0;90,0\n500000;180,0\n", 0.5, np.pi),
        ("t_s,spin_rev_per_s\n0,0.25\n0.5,0.5\n", 0.5, np.pi),
        ("t_s,spin (rps)\n0,0.25\n0.5,0.5\n", 0.5, np.pi),
        ("timestamp\tyaw_rate_rpm\n0\t30\n0.5\t60\n", 0.5, 2 * np.pi),
        ("ms,rpm\n48000,30\n48500,60\n", 48.5, 2 * np.pi),
        ("micros,dps\n0,90\n500000,180\n", 0.5, np.pi),
    ],
)
def test_other_names_units_and_separators_that_say_the_same_are_read(tmp_path, text, t, spin):
    path = tmp_path / "mine.csv"
    path.write_text(text)
    (found,) = read_rates(path)
    assert (found.t[1], found.rate[1]) == pytest.approx((t, spin))


def test_a_file_of_excel_s_unicode_is_read(tmp_path):
    path = tmp_path / "rates.txt"
    path.write_text("time_s\trate_deg_s\n0\t90\n0.5\t180\n", encoding="utf-16")
    (rates,) = read_rates(path)
    assert rates.rate[1] == pytest.approx(np.pi)
    path.write_bytes(path.read_bytes()[:-1])
    with pytest.raises(InputError, match=r"is no text of UTF-16"):
        read_rates(path)


@pytest.mark.parametrize(
    ("factor", "said"), [(180 / np.pi, "deg/s under a name of rad/s"), (1 / 6, "rpm"), (-1.0, "the other sign")]
)
def test_a_unit_or_a_sign_that_is_likely_wrong_is_noted(factor, said):
    found = score_rates([rate(T, factor * (SPIN + 0.1))], TRUTH)
    assert said in found.errors[0].note
    assert said in found.summary()


def test_no_note_where_rates_are_merely_wrong():
    found = score_rates([rate(T, 1.1 * SPIN), rate(T, SPIN - 100.0), rate(T, np.full(T.size, 8.0))], TRUTH)
    assert [one.note for one in found.errors] == ["", "", ""]


def test_values_outside_the_truth_s_time_are_counted_and_noted_where_most_are():
    t = np.linspace(0.0, 30.0, 301)
    found = score_rates([rate(t, np.full(t.size, 50.0))], TRUTH).errors[0]
    assert (found.values, found.outside) == (101, 200)
    assert "200 of 301 values lie outside" in found.note


def test_milliseconds_under_the_name_of_seconds_are_refused():
    with pytest.raises(InputError, match="look like milliseconds: name the column time_ms"):
        score_rates([rate(1000 * T, SPIN)], TRUTH)


def test_folders_that_commands_wrote_stand_for_their_files(tmp_path, monkeypatch):
    for name in ("rate", "truth"):
        (tmp_path / name).mkdir()
        write(tmp_path / name / f"{name}.csv", "time_s,rate_rad_s", T, SPIN)
    words = [str(tmp_path / "rate"), "--against", str(tmp_path / "truth"), "--out", str(tmp_path / "out")]
    assert command(monkeypatch, *words) == 0
