"""The page on measured recordings: its numbers from the real files, and its tools against closed forms."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from support.places import REAL, RECORDINGS, real

from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.recording import Samples
from discsim.validation.cli import main
from discsim.validation.studies.catalogue import run_study
from discsim.validation.studies.real_recordings import road
from discsim.validation.studies.real_recordings.agreement import LOWERED, Attempt, agreement, attempts, mean_between
from discsim.validation.studies.real_recordings.findings import SHIFTS, shifted_rms, turns_of
from discsim.validation.studies.real_recordings.optical import HALF, optical_rate
from discsim.validation.studies.real_recordings.page import write_page
from discsim.validation.studies.real_recordings.road import LOGS, Answers, Log, Said, road_section
from discsim.validation.studies.real_recordings.sources import SOURCES, find_recordings, load
from discsim.validation.studies.real_recordings.turns import field_phase, phase_rate, turned, turned_by_rate

SOURCE = {source.key: source for source in SOURCES}
DEG = np.pi / 180


def measured(key: str, number: int = 0):
    return load(SOURCE[key], SOURCE[key].cuts[number], REAL)


def agreements(key: str, number: int = 0):
    cut = measured(key, number)
    return {one.method: agreement(one, cut.reference) for one in attempts(SOURCE[key], cut, also=())}


# ------------------------------------------------------------------------------------------ the tools, on closed forms


def test_a_steady_turn_seen_by_cameras_gives_its_rate_about_the_bodys_axes():
    t = np.arange(200) * 0.0035
    rate = np.array([3.0, -8.0, 14.0])
    # the body's rate stands on the right: C(t) = C(0) exp(rate t)
    attitude = Rotation.from_rotvec([0.3, 0.1, -0.5]) * Rotation.from_rotvec(t[:, None] * rate)
    found, sd = optical_rate(t, attitude.as_quat()[:, [3, 0, 1, 2]])
    assert np.isnan(found[:HALF]).all()
    assert np.isnan(found[-HALF:]).all()
    assert_allclose(found[HALF:-HALF], np.tile(rate, (200 - 2 * HALF, 1)), atol=1e-9)
    assert np.nanmax(sd) < 1e-9


def test_an_oscillation_seen_by_cameras_keeps_its_amplitude_where_a_chord_would_lose_it():
    """At 3 Hz a chord over +-14 ms loses (w T)^2 / 6 = 1.2 %, twelve times the tolerance."""
    t, w = np.arange(600) * 0.0035, 2 * np.pi * 3.0
    angle = 0.5 * np.sin(w * t)
    attitude = Rotation.from_rotvec(np.outer(angle, [0.0, 0.6, 0.8]))
    found, _ = optical_rate(t, attitude.as_quat()[:, [3, 0, 1, 2]])
    expected = np.outer(0.5 * w * np.cos(w * t), [0.0, 0.6, 0.8])[HALF:-HALF]
    assert np.max(np.abs(found[HALF:-HALF] - expected)) < 1e-3 * 0.5 * w


@pytest.mark.parametrize("turns", [-2.3, 1.6, 7.0])
def test_the_phase_of_a_field_counts_turns_about_its_hard_iron_against_the_spin(turns):
    angle = 2 * np.pi * turns * np.linspace(0, 1, 400)
    field = np.column_stack((200 + 30 * np.cos(angle), -150 - 30 * np.sin(angle), np.full(400, 40.0)))
    assert turned(field_phase(field)) == pytest.approx(turns, abs=1e-9)
    assert turned(field_phase(field, "ellipse")) == pytest.approx(turns, abs=1e-9)
    t = np.linspace(0, 10, 400)
    rate = phase_rate(Samples(t, field), 1.5)
    known = np.isfinite(rate.rate)
    assert_allclose(rate.rate[known], 2 * np.pi * turns / 10, rtol=1e-9)
    assert known.sum() == np.count_nonzero((t >= 0.75) & (t <= 9.25))


def test_soft_iron_spoils_part_turns_about_a_circle_and_not_about_an_ellipse():
    angle = -2 * np.pi * 1.6 * np.linspace(0, 1, 300)
    stretch = Rotation.from_rotvec([0, 0, 0.4]).as_matrix()[:2, :2] @ np.diag([1.3, 0.8])
    # symmetric soft iron: a stretch along two axes, which turns neither of them
    soft = stretch @ Rotation.from_rotvec([0, 0, -0.4]).as_matrix()[:2, :2]
    field = np.column_stack((np.cos(angle), np.sin(angle))) @ soft.T * 30 + [5.0, -9.0]
    assert turned(field_phase(field, "ellipse")) == pytest.approx(1.6, abs=1e-6)
    assert abs(turned(field_phase(field)) - 1.6) > 0.01


def test_readings_on_no_ellipse_have_no_phase():
    x = np.linspace(-1, 1, 50)
    hyperbola = np.column_stack((np.append(np.cosh(x), -np.cosh(x)), np.append(np.sinh(x), np.sinh(x))))
    assert np.isnan(field_phase(hyperbola, "ellipse")).all()


def test_the_mean_of_a_rate_over_a_window_is_exact_for_a_ramp_and_unknown_over_a_gap():
    t = np.linspace(0, 10, 101)
    ramp = 3.0 * t
    rate = YawRate("ramp", t, ramp, np.zeros(101), signed=True)
    assert_allclose(mean_between(rate, np.array([1.03, 4.0]), np.array([2.03, 8.0])), [4.59, 18.0], rtol=1e-12)
    assert turned_by_rate(rate, 2.0, 4.0) == pytest.approx(18.0 / (2 * np.pi), rel=1e-12)
    holed = np.where(np.arange(101) == 50, np.nan, ramp)
    gap = YawRate("gap", t, holed, np.where(np.isnan(holed), np.nan, 0.0), signed=True)
    found = mean_between(gap, np.array([1.0, 4.5, 9.0]), np.array([2.0, 5.5, 20.0]))
    assert found[0] == pytest.approx(4.5)
    assert np.isnan(found[1:]).all()


def test_a_method_without_a_sign_is_held_against_the_magnitude():
    t = np.linspace(0, 1, 11)
    reference = YawRate("gyroscope", t, np.full(11, -10.0), np.full(11, 0.1), signed=True)
    method = YawRate("fft", t, np.where(t < 0.5, np.nan, 11.0), np.where(t < 0.5, np.nan, 0.2))
    found = agreement(Attempt("fft", method, window=0.2), reference)
    assert found.values == 11
    assert found.known == pytest.approx(6 / 11)
    assert found.ratio == pytest.approx(1.1)
    assert found.rms == pytest.approx(1.0)
    assert found.beyond == 1.0
    signed = agreement(Attempt("own", replace(method, signed=True)), reference)
    assert signed.ratio == pytest.approx(-1.1)


def test_a_late_stamp_shows_as_the_shift_with_the_least_difference():
    t = np.arange(2000) * 0.0035
    vector = np.column_stack([np.sin(9 * t + phase) for phase in (0.0, 1.0, 2.0)])
    late = np.column_stack([np.sin(9 * (t - 0.002) + phase) for phase in (0.0, 1.0, 2.0)])
    rms = shifted_rms(Samples(t, late), vector)
    assert SHIFTS[np.argmin(rms)] == pytest.approx(-0.002)


# ----------------------------------------------------------------------------------------------- the measured files


@real
def test_the_rocket_under_its_parachute_turns_at_0_96_hz_and_the_papers_threshold_hides_it():
    cut = measured("aris-euler")
    count = turns_of(cut)
    assert (count.start, count.stop) == pytest.approx((9.8, 14.4), abs=0.02)
    # the source's README has 0.958 Hz by phase: circle and ellipse differ by 0.001 Hz, an eighth of a turn by 0.027
    assert abs(count.circle) / count.duration == pytest.approx(0.958, abs=0.01)
    found = agreements("aris-euler")
    assert found["fft"].values > 300
    assert found["fft"].known == 0
    assert found[LOWERED].known == 1
    # a bin of 2.56 s is 141 deg/s; its leakage is what the estimate's own deviation, 6 deg/s or 1.7 %, stands for
    assert found[LOWERED].ratio == pytest.approx(1.0, abs=0.02)
    assert found["accelerometer"].known == 0  # nobody says where it sits
    speeds = [np.linalg.norm(measured("aris-euler", k).recording.samples["gyroscope"].value, axis=1) for k in (0, 1)]
    # the README's figures to their last digit
    assert np.mean(speeds[0]) / (2 * np.pi) == pytest.approx(0.967, abs=0.001)
    assert np.mean(speeds[1]) / (2 * np.pi) == pytest.approx(0.958, abs=0.001)


@real
def test_the_small_rocket_turns_less_than_twice_which_is_no_window():
    count = turns_of(measured("srp"))
    # the README has 1.593 by gyroscope and 1.589 by phase over its 10.5 s; a tenth of a second at 60 deg/s is 0.017
    assert abs(count.reference) == pytest.approx(1.59, abs=0.02)
    # circle and ellipse, of which less than two turns cannot choose one, lie on either side
    assert abs(count.circle) == pytest.approx(1.59, abs=0.03)
    assert abs(count.ellipse) == pytest.approx(1.59, abs=0.03)
    assert np.sign(count.circle) == np.sign(count.reference)
    found = agreements("srp")
    assert found["fft"].values == 0
    assert "a window needs 128 samples" in found["fft"].reason


@real
@pytest.mark.parametrize(("number", "ratio"), [(0, 1.222), (1, 1.327), (2, 1.222), (3, 1.222)])
def test_the_throws_magnetometer_turns_faster_than_gyroscope_and_accelerometer_which_agree(number, ratio):
    count = turns_of(measured("flatball", number))
    # an eighth of a turn in 21 to 26 is 0.005, wobble at release about as much
    assert count.circle / count.reference == pytest.approx(ratio, abs=0.01)
    found = agreements("flatball", number)
    assert found["fft"].known == 1
    # the FFT leaves out half a window at either end, where the ratio need not be the same
    assert found["fft"].ratio == pytest.approx(ratio, abs=0.015)
    # 0.1 mm of a radius of 20.7 mm is 0.25 %, zero-g offset 0.2 %, gyroscope scale 1 %
    assert found["accelerometer"].ratio == pytest.approx(1.0, abs=0.015)


@real
@pytest.mark.parametrize(("number", "mean", "largest"), [(0, 534, 1286), (1, 139, 373)])
def test_gyroscope_and_cameras_agree_in_size_and_the_fft_is_silent_where_nothing_spins_steadily(number, mean, largest):
    cut = measured("broad", number)
    size = np.linalg.norm(cut.recording.samples["gyroscope"].value, axis=1)
    assert np.degrees(size.mean()) == pytest.approx(mean, abs=1)
    assert np.degrees(size.max()) == pytest.approx(largest, abs=1)
    ratio = np.nanmedian(np.linalg.norm(cut.vector, axis=1) / size)
    # the README has 1.003 and 1.000; by how the attitude is differentiated (1 to 29 samples) it moves by 0.003
    assert ratio == pytest.approx(1.0015, abs=0.004)
    found = agreements("broad", number)
    assert found["gyroscope"].ratio == pytest.approx(1.0, abs=0.01)  # about z alone, the axes' alignment counts too
    # no steady spin about z, as the gyroscope shows: a line in the field's spectrum is none
    assert found["fft"].known == 0


@real
def test_the_rolling_rocket_makes_seven_turns_by_its_field():
    count = turns_of(measured("lynx"))
    assert abs(count.circle) == pytest.approx(7.1, abs=0.1)  # the README's figure; a circle about 37 % of scatter
    assert np.isnan(count.reference)


@pytest.mark.slow
@real
def test_the_command_writes_the_page_with_every_figure(tmp_path):
    out = tmp_path / "real-recordings"
    arguments = ["--recordings", str(RECORDINGS), "--out", str(out), "--also", "accelerometer", "--no-walk"]
    run_study("real-recordings", arguments)
    text = (tmp_path / "real-recordings.md").read_text(encoding="utf-8")
    assert sorted(file.name for file in out.iterdir()) == sorted(f"{key}.png" for key in SOURCE)
    assert max(file.stat().st_size for file in out.iterdir()) < 150_000
    assert re.findall(r"\]\((real-recordings/[\w.-]+)\)", text) == [f"real-recordings/{key}.png" for key in SOURCE]
    for words in ("Copyright 2025 Michael V. Schaefer", "CC BY 4.0", "10.3390/data6070072", "MIT", "GPL-3.0"):
        assert words in text
    assert re.findall(r"\bnan\b|\binf\b", text) == []
    for cut in (cut for source in SOURCES for cut in source.cuts):
        assert f"**{cut.label}**" in text
        assert f"| [{cut.label}](#" in text
    assert str(RECORDINGS) not in text


@real
def test_the_same_recordings_give_the_same_bytes(tmp_path):
    chosen = [SOURCE["flatball"], SOURCE["phyphox"]]
    pages = []
    for name in ("first", "second"):
        page = write_page(REAL, tmp_path / name / "page", (), sources=chosen)
        pages.append({file.name: file.read_bytes() for file in sorted(page.parent.rglob("*.*"))})
    assert len(pages[0]) == 3
    assert pages[0] == pages[1]


# ------------------------------------------------------------------------------------------------------ bad input


def test_recordings_that_are_not_there_are_named_with_the_way_to_give_them(tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"no folder 'real' in it; expected the recordings \(--recordings DIR\)"):
        find_recordings(tmp_path)
    monkeypatch.setenv("DISCSIM_RECORDINGS", str(tmp_path / "nowhere"))
    with pytest.raises(InputError, match="nowhere"):
        find_recordings()
    (tmp_path / "real").mkdir()
    assert find_recordings(tmp_path) == tmp_path / "real"
    with pytest.raises(InputError, match="nowhere"):
        run_study("real-recordings", ["--out", str(tmp_path / "page")])
    assert not (tmp_path / "page.md").exists()


@real
def test_a_method_that_does_not_exist_is_refused_with_those_that_do():
    with pytest.raises(InputError, match=r"no method 'magic'; expected one of .*fft"):
        attempts(SOURCE["flatball"], measured("flatball"), also=("magic",))


# ------------------------------------------------------------------------------------------- what the commands say

SPUN = Log("spun", "spun", "spun.csv", (), (3228.0, 32.0), "3228 deg/s by its gyroscope")
METHODS = {
    "fusion": {"share_unknown": 0.9, "median_rate_rad_s": 1.0, "median_sd_rad_s": 1.0},
    "gyroscope": {"share_unknown": 0.0, "median_rate_rad_s": -3230.0 * DEG, "median_sd_rad_s": 1.5 * DEG},
}


def said_of(status: int | None = 0, text: str = "", rate: float = -3230.0, verdict: str = "unexplained") -> Answers:
    methods = {**METHODS, "gyroscope": {**METHODS["gyroscope"], "median_rate_rad_s": rate * DEG}}
    said = {step: Said(0, 2.4, "") for step in ("import", "check", "estimate")} | {"diagnose": Said(status, 7.0, text)}
    diagnosis = {"verdict": verdict, "effects": []} if status == 0 else None
    return Answers(SPUN, said, {"methods": methods, "disagreements": []}, diagnosis)


def test_a_row_of_the_table_holds_the_first_method_that_knows_the_rate_and_the_time():
    row = road_section([said_of()])[2]
    assert "| gyroscope: -3230 ± 1.5 deg/s |" in row
    assert row.endswith("| unexplained | 2 + 2 + 2 + 7 | yes |")


@pytest.mark.parametrize(
    ("answers", "told"),
    [
        (said_of(rate=3950.0), "**no: estimate**"),
        (said_of(verdict="consistent"), "**no: diagnose**"),
        (said_of(3, "discsim: internal error, ZeroDivisionError"), "**no: diagnose**"),
        (said_of(None), "**no: diagnose**"),
        (said_of(2, "discsim: no field stated; expected --place"), "| yes |"),
    ],
)
def test_a_wrong_rate_a_wrong_verdict_and_a_fault_are_told_in_the_table_and_a_refusal_is_none(answers, told):
    assert told in road_section([answers])[2]


def test_a_walk_that_was_broken_off_goes_on_where_it_stopped(tmp_path, monkeypatch):
    ran = []

    def run(command, home):
        ran.append(command[1])
        return Said(0 if command[1] == "import" else 3, 1.0, "")

    monkeypatch.setattr(road, "run_command", run)
    first = road.walk(SPUN, tmp_path, tmp_path / "logs")
    again = road.walk(SPUN, tmp_path, tmp_path / "logs")
    assert ran == ["import", "check", "estimate", "diagnose"]
    assert first == again


def test_a_log_that_cannot_be_imported_is_walked_no_further(tmp_path):
    found = road.walk(Log("absent", "absent", "absent.csv", (), None, ""), tmp_path, tmp_path / "logs")
    assert list(found.said) == ["import"]
    assert found.said["import"].status == 2
    assert "refused: " in road_section([found])[2]


@real
def test_a_track_alone_is_imported_with_its_page(tmp_path, monkeypatch):
    raw = str(REAL / "shotshaper-dd2-drone-tracked-throws" / "throw1.tsv")
    monkeypatch.setattr("sys.argv", ["discsim", "import", raw, "--map", "shotshaper", "--out", str(tmp_path / "track")])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    assert (tmp_path / "track" / "raw.html").is_file()
    assert (tmp_path / "track" / "recording.toml").is_file()


@real
def test_every_log_of_the_table_is_there_and_has_a_name_of_its_own():
    assert len({log.key for log in LOGS}) == len(LOGS)
    for log in LOGS:
        assert (REAL / log.raw).exists()
