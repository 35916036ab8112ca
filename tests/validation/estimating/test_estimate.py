"""``discsim estimate`` on recordings made here, and the comparison of methods."""

from __future__ import annotations

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators import YawRate
from discsim.recording import Recording, Samples, SensorSheet, read_recording, write_recording
from discsim.validation.commands.estimate import command
from discsim.validation.estimating.method_disagreement import compare
from discsim.validation.estimating.spin_estimates import estimate_spin


@pytest.fixture
def folder(tmp_path):
    """Three seconds of 3000 deg/s: a magnetometer, and an accelerometer mounted 3 mm off its stated place."""
    rng = np.random.default_rng(0)
    rate, t, fast = np.radians(3000.0), np.arange(300) / 100, np.arange(600) / 200
    field = np.stack([30 * np.cos(rate * t), -30 * np.sin(rate * t), 0 * t + 39], axis=1)
    force = np.outer(np.ones(600), [rate**2 * 0.0191, 0.0, -9.8])
    sheets = {
        "magnetometer": SensorSheet(100.0, 0.6, 0.15, 4912.0),
        "accelerometer": SensorSheet(200.0, 0.08, 0.005, 156.9, position=np.array([-0.0161, 0.0, 0.0])),
    }
    samples = {
        "magnetometer": Samples(t, field + rng.normal(0, 0.6, field.shape)),
        "accelerometer": Samples(fast, force + rng.normal(0, 0.08, force.shape)),
    }
    write_recording(Recording("rate_table", "made", Environment(), sheets=sheets, samples=samples), tmp_path / "made")
    return tmp_path / "made"


def rows(out):
    with (out / "rate.csv").open() as stream:
        return list(csv.DictReader(stream))


def test_what_a_check_calls_an_error_and_readings_written_twice_are_told(folder, tmp_path):
    """The place in millimetres gave 3000 deg/s as 95 without a word; a held field was folded by fft."""
    recording = read_recording(folder)
    field = recording.samples["magnetometer"]
    held = Samples(field.t, np.repeat(field.value[::4], 4, axis=0))
    place = replace(recording.sheets["accelerometer"], position=np.array([-16.1, 0.0, 0.0]))
    spoilt = replace(
        recording,
        sheets={**recording.sheets, "accelerometer": place},
        samples={**recording.samples, "magnetometer": held},
    )
    found = estimate_spin(spoilt)
    assert any("16.1 m from the centre" in note for note in found.notes)
    assert any("rows each (sample and hold): it runs at 25 Hz" in note for note in found.notes)
    assert len(found.recording.samples["magnetometer"]) == 75


def test_all_methods_leave_out_what_the_limit_of_a_gyroscope_refutes(tmp_path):
    """`all` had the folded rate of a slow field as its headline, which `best` refuses."""
    rng, rate = np.random.default_rng(1), np.radians(3973.0)
    t, fast = np.arange(30) / 10, np.arange(600) / 200
    field = np.stack([30 * np.cos(rate * t), -30 * np.sin(rate * t), 0 * t + 39], axis=1)
    limit = np.radians(2000.0)
    sheets = {
        "magnetometer": SensorSheet(10.0, 0.6, 0.15, 4912.0),
        "gyroscope": SensorSheet(200.0, 0.003, 0.001, limit),
    }
    across = rng.normal(0, 0.003, (600, 2))
    samples = {
        "magnetometer": Samples(t, field + rng.normal(0, 0.6, field.shape)),
        "gyroscope": Samples(fast, np.column_stack([across, np.full(600, limit)])),
    }
    made = Recording("rate_table", "made", Environment(), sheets=sheets, samples=samples)
    with pytest.raises(InputError, match=r"likelihood, fft: by the limit of the gyroscope it spins faster"):
        estimate_spin(made, "all")
    asked = estimate_spin(made, "tracking").notes
    assert any(one.startswith("tracking: by the limit of the gyroscope it spins faster than 10") for one in asked)
    (note,) = (one for one in asked if "above half" in one)
    assert note.startswith("gyroscope: at least 2000 deg/s for 100 %")
    assert note.endswith("folded, as what rate its limit does not tell")


def test_all_writes_every_method_and_says_which_are_left_out_and_which_contradict(folder, tmp_path, capsys):
    out = tmp_path / "out"
    command(folder, method="all", out=out, pad=None, step=5)
    written = {"rate.csv", "rate.png", "estimate.json", "report.html", "run.json"}
    assert {path.name for path in out.iterdir()} == written
    page = (out / "report.html").read_text()
    assert page.index("contradiction") < page.index("By method") < page.index("Methods left out")
    table = rows(out)
    assert list(table[0]) == ["time_s", "method", "rate_rad_s", "sd_rad_s"]
    rates = np.degrees([float(row["rate_rad_s"]) for row in table if row["method"] == "fft"])
    np.testing.assert_allclose(rates, 3000.0, atol=12.0)  # four standard deviations
    report = json.loads((out / "estimate.json").read_text())
    assert {"gyroscope", "rate_reference"} <= set(report["left_out"])
    pairs = [(item["first"], item["second"]) for item in report["disagreements"]]
    assert ("fft", "accelerometer") in pairs
    # (9): 3 mm of 16.1 mm is 8.9 % of the rate, five times its one sigma of 1.8 % for a mount error of 1 mm
    assert "fft and accelerometer differ by 8.2 %" in capsys.readouterr().out


def test_a_mount_error_as_large_as_the_real_one_ends_the_contradiction(folder, tmp_path):
    command(folder, method="all", out=tmp_path / "out", pad=None, step=5, mount_error=5.0)
    report = json.loads((tmp_path / "out" / "estimate.json").read_text())
    pairs = [(item["first"], item["second"]) for item in report["disagreements"]]
    assert ("fft", "accelerometer") not in pairs


def test_unknown_values_are_empty_cells(folder, tmp_path):
    command(folder, method="fft", out=tmp_path / "out", pad=None, threshold=5000.0)
    table = rows(tmp_path / "out")
    assert table
    assert all(row["rate_rad_s"] == row["sd_rad_s"] == "" for row in table)
    report = json.loads((tmp_path / "out" / "estimate.json").read_text())
    assert report["methods"]["fft"]["share_unknown"] == 1.0
    assert report["methods"]["fft"]["median_rate_rad_s"] is None


def test_a_gyroscope_that_mostly_clips_is_told_to_be_beyond_its_limit(tmp_path, capsys):
    """3200 deg/s seen by a part that ends at 2000: the 6 % of readings before it span up are no spin of the throw."""
    t, rng = np.arange(500) / 100, np.random.default_rng(0)
    rate = np.minimum(np.radians(3200.0) * t / 0.48, np.radians(3200.0)) + rng.normal(0.0, 0.02, t.size)
    limit = np.radians(2000.0)
    value = np.stack([rng.normal(0, 0.02, t.size), rng.normal(0, 0.02, t.size), np.clip(rate, -limit, limit)], axis=1)
    made = Recording(
        "free_spin",
        "clipped",
        Environment(),
        sheets={"gyroscope": SensorSheet(100.0, 0.02, None, limit)},
        samples={"gyroscope": Samples(t, value)},
    )
    write_recording(made, tmp_path / "clipped")
    command(tmp_path / "clipped", out=tmp_path / "out", pad=None)
    assert "beyond 2000.00" in capsys.readouterr().out
    page = (tmp_path / "out" / "report.html").read_text()
    assert "beyond 2,000 deg/s, the limit of the sensor, by gyroscope: most" in page
    figures = json.loads((tmp_path / "out" / "estimate.json").read_text())["methods"]["gyroscope"]
    assert figures["median_is_beyond"]
    assert figures["median_sd_rad_s"] is None


def test_the_same_command_gives_the_same_bytes(folder, tmp_path):
    for name in ("one", "two"):
        command(folder, method="all", out=tmp_path / name, pad=None, step=20)
    for file in ("rate.csv", "rate.png", "estimate.json"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"method": "fourier"}, "expected one of best, all, .*fft"),
        ({"method": "gyroscope"}, "needs gyroscope samples"),
        ({"method": "fft", "window": 1000}, "a window needs 1000 samples"),
    ],
)
def test_what_cannot_be_done_leaves_no_output(folder, tmp_path, options, message):
    with pytest.raises(InputError, match=message):
        command(folder, out=tmp_path / "out", pad=None, **options)
    assert not (tmp_path / "out").exists()


def constant(method, rate, sd, t, signed=False):
    return YawRate(method, t, np.full(t.size, rate), np.full(t.size, sd), signed)


def test_methods_within_their_deviations_do_not_contradict_each_other():
    t = np.linspace(0, 3, 31)
    assert compare(constant("a", 50.0, 0.5, t), constant("b", 51.0, 0.5, t)) is None
    assert compare(constant("a", 50.0, 0.1, t), constant("b", 51.0, 0.1, t)) is not None


def test_a_direction_counts_only_where_both_have_one():
    t = np.linspace(0, 3, 31)
    left, right = constant("a", -50.0, 0.1, t, signed=True), constant("b", 50.0, 0.1, t)
    assert compare(left, right) is None
    found = compare(left, constant("b", 50.0, 0.1, t, signed=True))
    assert found is not None
    assert found.difference == pytest.approx(-100.0)


def test_a_contradiction_is_placed_and_sized():
    t = np.arange(0.0, 4.0, 0.1)
    second = YawRate("b", t, np.where((t > 0.95) & (t < 2.05), 49.0, 50.0), np.full(t.size, 0.1))
    found = compare(constant("a", 50.0, 0.0, np.arange(0.0, 3.9, 0.02)), second)
    assert found is not None
    assert (found.start, found.stop) == (pytest.approx(1.0), pytest.approx(2.0))
    assert found.sigmas == pytest.approx(10.0)
    assert found.relative == pytest.approx(1 / 49)
    assert "a and b differ by 2 % (+57.3 deg/s, 10.0 sd)" in found.text


def test_times_that_only_one_method_knows_are_not_compared():
    """A gap of 2 s in one of them is not bridged."""
    t = np.concatenate([np.arange(0, 1, 0.1), np.arange(3, 4, 0.1)])
    gap = YawRate("a", t, np.where(t < 2, 40.0, 60.0), np.full(t.size, 0.01))
    ramp = np.arange(0.0, 4.0, 0.09)
    truth = YawRate("b", ramp, np.where(ramp < 2, 40.0, 60.0), np.full(ramp.size, 0.01))
    assert compare(gap, truth) is None


def test_of_a_data_set_each_recording_is_estimated_into_a_folder_of_its_own(folder, tmp_path, capsys):
    again = tmp_path / "again"
    write_recording(read_recording(folder), again)
    (tmp_path / "set").mkdir()
    folder.rename(tmp_path / "set" / "01")
    again.rename(tmp_path / "set" / "02")
    command(tmp_path / "set", method="fft", out=tmp_path / "out", pad=None, step=5)
    assert (tmp_path / "out" / "01" / "rate.csv").read_bytes() == (tmp_path / "out" / "02" / "rate.csv").read_bytes()
    shown = capsys.readouterr()
    assert "recording 2 of 2: 02" in shown.err
    assert "02:" in shown.out


def test_all_prints_the_times_that_each_median_is_of(folder, tmp_path, capsys):
    """A window's centre is never within half of it of an end: the median is of other times than a gyroscope's."""
    command(folder, method="all", out=tmp_path / "out")
    lines = capsys.readouterr().out.splitlines()
    rates = estimate_spin(read_recording(folder), "all")
    for rate in rates.rates:
        row = next(line for line in lines if line.startswith(f"│ {rate.method} "))
        known = rate.t[np.isfinite(rate.rate)]
        assert f"{abs(round(known[0], 1)):.1f} to {known[-1]:.1f}" in row
