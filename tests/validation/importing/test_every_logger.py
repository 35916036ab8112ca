"""Every shipped import map, from a raw file of that logger to estimates that hold the truth, and to a diagnosis."""

from __future__ import annotations

import csv
import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.logger_files import LOGGERS
from support.places import ROOT

from discsim.errors import InputError
from discsim.recording import read_recording
from discsim.validation.checking import check_recording
from discsim.validation.cli import main
from discsim.validation.commands.diagnose import command as diagnose
from discsim.validation.commands.estimate import command as estimate
from discsim.validation.commands.import_ import command as import_

MAPS = sorted(path.stem for path in (ROOT / "models" / "imports").glob("*.toml"))
ROTATING = [name for name in MAPS if LOGGERS[name].methods]

#: Maps of which `diagnose` finds the iron of their made logs; a magnetometer alone, the lynx's, does not tell enough.
IRON = [name for name in ROTATING if name != "lynx"]

#: Seconds of each made log that are diagnosed: the time a diagnosis takes grows with them. The srp reads at 10 Hz.
DIAGNOSED_S = {name: 5.0 if name == "srp" else 1.5 for name in ROTATING}


def test_every_shipped_map_has_a_made_logger():
    assert set(LOGGERS) == set(MAPS)


def imported(name: str, tmp_path: Path, seconds: float | None = None) -> Path:
    raw = tmp_path / "raw"
    raw.mkdir()
    made = LOGGERS[name]
    motion = made.motion if seconds is None else replace(made.motion, duration=seconds)
    file = made.write(raw, motion, np.random.default_rng(5))
    import_(file, name, out=tmp_path / "recording")
    return tmp_path / "recording"


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """Import and estimate by every method, once for each map that is asked for."""
    known = {}

    def answer(name: str):
        if name not in known:
            folder = tmp_path_factory.mktemp(name)
            recording = imported(name, folder)
            estimate(recording, method="all", out=folder / "spin", pad=None, threshold=200.0)
            known[name] = recording, folder / "spin"
        return known[name]

    return answer


def rates(out: Path) -> dict[str, np.ndarray]:
    """Return (n, 3) time, rate and sd of each method where it knows the rate."""
    with (out / "rate.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["rate_rad_s"]]
    names = dict.fromkeys(row["method"] for row in rows)
    columns = ("time_s", "rate_rad_s", "sd_rad_s")
    return {n: np.array([[float(row[c]) for c in columns] for row in rows if row["method"] == n]) for n in names}


@pytest.mark.parametrize("name", ROTATING)
def test_import_keeps_what_the_sensors_measured(name, answers):
    """The field's size is that of the motion about the hard iron, and at the start all units are right."""
    recording = read_recording(answers(name)[0])
    motion = LOGGERS[name].motion
    if "magnetometer" in recording:
        value = recording.need("magnetometer").value
        across = np.ptp(value[:, :2], axis=0) / 2
        x, y, _ = motion.turned(np.zeros(1), np.array(motion.field))[0]
        np.testing.assert_allclose(across, np.hypot(x, y), rtol=0.1)  # noise of 0.7 uT on 20 uT at both ends
    if "gyroscope" in recording:
        z = recording.need("gyroscope").value[:, 2]
        limit = 34.90659 if name == "csv" else np.inf
        assert np.max(np.abs(z)) == pytest.approx(min(motion.rate, limit), rel=0.01)


@pytest.mark.parametrize("name", ROTATING)
def test_every_method_that_can_tells_the_rate_within_its_deviation(name, answers):
    """Three deviations at the root mean square, as the errors of a smoother are alike over seconds and few of them
    independent; and the sign is right. The size of an error is bounded as well: an accelerometer's mount and bias are
    a few per cent, and an fft answers to a quarter of a bin, the sampling rate over its 128 readings."""
    folder, out = answers(name)
    made, found = LOGGERS[name], rates(out)
    report = json.loads((out / "estimate.json").read_text())
    assert set(made.methods) <= set(found), report["left_out"]
    for method, table in found.items():
        t, rate, sd = table.T
        signed = report["methods"][method]["signed"]
        truth = made.motion.r(t)
        error = (rate if signed else np.abs(rate)) - truth
        assert np.sqrt(np.mean((error / sd) ** 2)) < 3.0, method
        assert np.all(sd > 0)
        field = read_recording(folder).get("magnetometer")
        bin_rad_s = np.inf if field is None else 2 * np.pi / field.interval / 128
        largest = bin_rad_s / 4 if method == "fft" else 0.03 * made.motion.rate
        assert np.median(np.abs(error)) < largest, method
    for method, reason in report["left_out"].items():
        assert reason, method
        assert "\n" not in reason, method


@pytest.mark.parametrize("name", ROTATING)
def test_check_promises_the_methods_that_estimate_runs_and_leaves_out_none_of_them(name, answers):
    """Which sensors and statements a method needs is told twice; the readings may still refuse one that can run."""
    folder, out = answers(name)
    check = check_recording(read_recording(folder))
    assert not set(rates(out)) & set(check.methods_left_out)
    assert set(LOGGERS[name].methods) <= set(check.methods)


def test_a_recording_that_shows_no_spin_is_refused_in_one_sentence(tmp_path):
    recording = imported("shotshaper", tmp_path)
    with pytest.raises(InputError, match=r"no sensor that shows a spin .*none of magnetometer, accel.*diagnose"):
        estimate(recording, method="all", out=tmp_path / "spin", pad=None)


def test_a_gyroscope_at_its_limit_is_left_out_and_named_though_no_range_is_stated(answers):
    """The plain map states no range, and 60 rad/s is beyond the 34.9 rad/s at which this gyroscope stops."""
    report = json.loads((answers("csv")[1] / "estimate.json").read_text())
    assert "gyroscope" in report["left_out"]
    assert "stands at its limit in every reading" in report["left_out"]["gyroscope"]
    assert any("gyroscope z: every one of its readings stands at a limit of 2000 deg/s" in n for n in report["notes"])


def test_the_readmes_rows_on_a_log_of_ones_own_run_as_they_stand(tmp_path, monkeypatch, capsys):
    """`import` and `estimate` typed as in the table "Where to go", RAW being the log's file."""
    made = LOGGERS["csv"]
    raw = made.write(tmp_path, made.motion, np.random.default_rng(5))
    table = (ROOT / "README.md").read_text()
    for name in ("import RAW", "estimate"):
        (typed,) = re.findall(rf"`discsim ({name} [^`]*)`", table)
        words = typed.replace("RAW", raw.name).split()
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "argv", ["discsim", *words])
        with pytest.raises(SystemExit) as stop:
            main()
        said = capsys.readouterr().err
        assert not stop.value.code, said
        assert "Traceback" not in said
        assert "Warning" not in said
    found = rates(tmp_path / "spin")
    t, rate, sd = found["fusion"].T
    assert np.sqrt(np.mean(((rate - made.motion.r(t)) / sd) ** 2)) < 3.0


@pytest.mark.parametrize("name", [name for name in MAPS if LOGGERS[name].place])
def test_without_a_field_diagnose_says_what_to_add(name, answers, tmp_path):
    with pytest.raises(InputError, match=r"recording.toml: .*not known.*--place LAT,LON --date"):
        diagnose([answers(name)[0]], out=tmp_path)


# of the two inertial units of a cats log, which lie in the same files, one stands for both
@pytest.mark.parametrize(
    "name",
    [
        name if name == "phyphox" else pytest.param(name, marks=pytest.mark.slow)
        for name in ROTATING
        if name != "cats_imu1"
    ],
)
def test_diagnose_answers(name, tmp_path):
    """Within seconds, of which a lag or an offset may leave a sensor no reading at all."""
    place, day = LOGGERS[name].place or (None, None)
    recording = imported(name, tmp_path, DIAGNOSED_S[name])
    diagnose([recording], out=tmp_path / "diagnosis", place=place, date=day)
    told = json.loads((tmp_path / "diagnosis" / "diagnosis.json").read_text())
    assert told["verdict"] in ("explained", "unexplained")
    if name in IRON:
        assert told["verdict"] == "explained"
        assert "mag.hard_iron" in [effect["id"] for effect in told["effects"]]


def test_a_place_and_a_date_give_the_field(tmp_path):
    """Rows 3 and 4 of the README, with the place added."""
    raw = tmp_path / "raw"
    raw.mkdir()
    made = LOGGERS["csv"]
    file = made.write(raw, made.motion, np.random.default_rng(5))
    import_(file, "csv", out=tmp_path / "recording", place="52.52,13.40", date="2025-08-31")
    environment = read_recording(tmp_path / "recording").environment
    np.testing.assert_allclose(environment.magnetic_field, made.motion.field, atol=0.5)
    assert environment.sigma["magnetic_field_ned_uT"] == 0.15


def test_without_a_place_the_plain_map_leaves_the_field_unknown(answers):
    assert not read_recording(answers("csv")[0]).environment.field_known


@pytest.mark.parametrize(
    ("place", "day", "message"),
    [
        ("52.52", "2025-08-31", "--place 52.52: expected LAT,LON"),
        ("52.52,13.4", None, "--date YYYY-MM-DD belong together"),
        (None, "2025-08-31", "belong together"),
        ("52.52,13.4", "31.8.2025", "--date 31.8.2025: expected YYYY-MM-DD"),
        ("95,13.4", "2025-08-31", "no place at latitude 95"),
    ],
)
def test_a_place_that_is_none_is_refused(place, day, message, answers, tmp_path):
    with pytest.raises(InputError, match=message):
        estimate(answers("lynx")[0], out=tmp_path, pad=None, place=place, date=day)
