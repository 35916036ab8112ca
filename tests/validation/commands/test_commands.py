"""The commands as a person types them: files, exit statuses, one clear line for every error, the same bytes again."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from discsim.effects import effect
from discsim.model_file import Model, ModelEffect, write_model
from discsim.recording import read_recording
from discsim.shipped import load_disc
from discsim.validation.cli import main
from discsim.validation.commands import COMMANDS
from discsim.validation.experiments import validation_run as headless
from discsim.validation.reporting.limits import shipped_limits
from discsim.validation.reporting.scores import at_most
from discsim.written import as_written

ROOT = Path(__file__).resolve().parents[3]


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    """Call the command line in this process and return its exit status."""
    monkeypatch.setattr(sys, "argv", ["discsim", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


@pytest.fixture
def short_profile(tmp_path: Path) -> Path:
    path = tmp_path / "profile.csv"
    path.write_text("time_s,rate_deg_s\n0,0\n1,1500\n3.5,1500\n4.5,3000\n7,3000\n")
    return path


def test_the_help_says_of_each_command_what_the_command_itself_says():
    """Its first lines stand in a table, so that the commands need not be loaded to be listed."""
    for module, line in COMMANDS.values():
        command = import_module(f"discsim.validation.commands.{module}").command
        assert line == command.__doc__.strip().splitlines()[0]
        assert len(line) <= 63, f"{line}: cut off on a terminal of 80 columns"


def test_a_command_loads_neither_the_others_nor_what_it_does_not_need(tmp_path):
    """`discsim --help` and `import discsim` need no numpy, and a flight no scipy, which takes a third of a second.

    Numba loads scipy's linear algebra with the first compiled function unless it is kept from it, and that in turn
    numpy.f2py and all of numpy's tests (`discsim.compiled`): a sixth of a flight's start.
    """

    def loaded(code: str) -> set[str]:
        line = f"import sys\n{code}\nprint(*sys.modules)"
        out = subprocess.run([sys.executable, "-c", line], capture_output=True, text=True, check=True).stdout
        return set(out.splitlines()[-1].split())

    assert "numpy" not in loaded("import discsim; discsim.InputError")
    shown = loaded(
        "sys.argv = ['discsim', '--help']\ntry:\n import discsim.validation.cli as c; c.main()\nexcept SystemExit: pass"
    )
    assert "discsim.validation.commands" in shown
    assert not shown & {"numpy", "discsim.validation.commands.fly"}
    arguments = ["discsim", "fly", "--duration", "0.5", "--out", str(tmp_path / "flight")]
    flown = loaded(
        f"sys.argv = {arguments}\nimport discsim.many_flights\n"
        "try:\n import discsim.validation.cli as c; c.main()\nexcept SystemExit: pass"
    )
    assert {"mujoco", "discsim.engine", "discsim.validation.commands.fly"} <= flown
    assert (tmp_path / "flight" / "recording.toml").exists()
    heavy = {"scipy.linalg", "scipy.interpolate", "scipy.optimize", "scipy.special", "matplotlib", "rich", "jinja2"}
    assert not flown & (heavy | {"numpy.f2py", "numpy.testing", "pandas", "xarray", "mujoco.viewer"})


@pytest.mark.parametrize("module", ["typer", "mujoco"])
def test_an_interrupt_while_python_still_loads_is_one_line(tmp_path, module):
    """Half a second of a command's start is loading: an interrupt then showed a traceback, an ImportError, or nothing.

    What loads may make another error of it: MuJoCo says that its initialization failed.
    """
    interrupt = "import signal\ntry:\n    signal.raise_signal(signal.SIGINT)\nexcept BaseException as error:\n    "
    then = {"typer": "pass", "mujoco": "raise ImportError('initialization failed') from error"}[module]
    (tmp_path / f"{module}.py").write_text(f"{interrupt}{then}\n")
    code = "import sys; sys.path.insert(0, sys.argv[1]); from discsim.validation.start import main; "
    code += "sys.argv[:] = ['discsim', 'fly', '--out', sys.argv[1]]; main()"
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True)
    assert (done.returncode, done.stderr, done.stdout) == (130, "discsim: interrupted\n", "")
    script = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["scripts"]["discsim"]
    assert script == "discsim.validation.start:main"


@pytest.mark.slow
def test_an_interrupt_where_python_drops_errors_is_heard_all_the_same():
    """One that fell into a collection of garbage was told by a traceback, and the command went on to its end."""
    code = """
import signal, time, weakref
from discsim.validation.start import heard_anywhere
class Figure: pass
with heard_anywhere():
    figure = Figure()
    end = weakref.ref(figure, lambda _: signal.raise_signal(signal.SIGINT))
    try:
        del figure
        time.sleep(20)
        print("ran on")
    except KeyboardInterrupt:
        print("heard")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr, done.stdout) == (0, "", "heard\n")


def test_a_flight_leaves_a_recording_and_its_truth_which_ends_on_the_ground(monkeypatch, tmp_path, capsys):
    out = tmp_path / "flight"
    assert run(monkeypatch, "fly", "--out", str(out), "--seed", "3") == 0
    recording = read_recording(out)
    assert recording.plant == "flight"
    assert set(recording.samples) == {"magnetometer", "accelerometer", "gyroscope", "gps"}
    truth = np.genfromtxt(out / "truth.csv", delimiter=",", names=True)
    assert truth.dtype.names[:4] == ("time_s", "north_m", "east_m", "down_m")
    assert abs(truth["down_m"][-1]) < 1e-6
    assert recording.end <= truth["time_s"][-1]
    assert "touches down" in capsys.readouterr().out
    left = json.loads((out / "run.json").read_text())
    assert left["seed"] == 3
    assert left["command"][:2] == ["discsim", "fly"]


def test_the_same_seed_gives_the_same_bytes_and_another_one_does_not(monkeypatch, tmp_path, short_profile):
    for name, seed in (("a", "1"), ("b", "1"), ("c", "2")):
        arguments = [
            "rate-table",
            "--profile",
            str(short_profile),
            "--out",
            str(tmp_path / name / "run"),
            "--seed",
            seed,
        ]
        assert run(monkeypatch, *arguments) == 0
    names = sorted(path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file())
    assert Path("run/adxrs649/recording.toml") in names
    assert Path("run/methods.png") in names
    assert Path("run/report.html") in names
    for name in names:
        if name.name not in ("run.json", "report.html"):  # these name the command, and with it the folder
            assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    first, other = ((tmp_path / name / "run" / "magnetometer.csv").read_bytes() for name in ("a", "c"))
    assert first != other


def test_an_effect_without_a_size_is_refused_with_an_example(monkeypatch, tmp_path, capsys):
    assert run(monkeypatch, "fly", "--out", str(tmp_path), "--effect", "air.wind") == 2
    assert "does nothing without a size; expected air.wind:w_north_m_s=0.1" in capsys.readouterr().err


def test_an_effect_on_the_command_line_reaches_flight_and_sensors(monkeypatch, tmp_path):
    for name, effects in (
        ("plain", []),
        ("windy", ["--effect", "air.wind:w_north_m_s=3", "--effect", "mag.hard_iron:bz_uT=25"]),
    ):
        assert run(monkeypatch, "fly", "--out", str(tmp_path / name), *effects) == 0
    plain, windy = (read_recording(tmp_path / name) for name in ("plain", "windy"))
    shift = windy.need("magnetometer").value[:100, 2].mean() - plain.need("magnetometer").value[:100, 2].mean()
    assert shift == pytest.approx(25.0, abs=1.0)
    # less airspeed is less lift: a tail wind of 3 m/s ends this flight more than a second sooner
    assert windy.end < plain.end - 1.0
    # what is concealed is not stated
    assert "hard_iron" not in (tmp_path / "windy" / "recording.toml").read_text()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--speed", "80"], "thrown at 80 m/s; expected up to 45; in km/h?"),
        (["--spin", "4000"], "expected up to 250 rad/s; in deg/s?"),
        (["--module", "mass_kg=15"], "mass_kg is 15.179"),
        ([], ""),
    ],
)
def test_a_throw_or_a_disc_that_cannot_be_is_said_aloud(monkeypatch, tmp_path, capsys, words, said):
    flown = ["fly", "--engine", "trajectory", "--duration", "0.2", "--out", str(tmp_path / "flight"), *words]
    assert run(monkeypatch, *flown) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + bool(said)
    assert said in lines[0]


def test_a_launch_beyond_straight_up_is_refused(monkeypatch, tmp_path):
    assert run(monkeypatch, "fly", "--launch", "120", "--out", str(tmp_path / "flight")) == 2


def test_a_fault_of_the_setup_is_flown_by_command_and_by_model(monkeypatch, tmp_path):
    """Same seed, so what was meant is the same: only what is written differs."""
    faults = [effect("mag.axes", axes="x -y z"), effect("gyro.units", written_in="deg/s")]
    disc, environment = load_disc("driver")
    write_model(Model(environment, disc, effects=tuple(ModelEffect(item) for item in faults)), tmp_path / "model.toml")
    given = {
        "sound": [],
        "typed": ["--effect", "mag.axes:axes=x -y z", "--effect", "gyro.units:written_in=deg/s"],
        "modelled": ["--model", str(tmp_path / "model.toml")],
    }
    for name, more in given.items():
        assert run(monkeypatch, "fly", "--out", str(tmp_path / name), *more) == 0
    sound, typed, modelled = (read_recording(tmp_path / name) for name in given)
    expected = as_written(sound, faults)
    for name, samples in expected.samples.items():
        np.testing.assert_allclose(typed.need(name).value, samples.value, rtol=1e-14)
        np.testing.assert_array_equal(modelled.need(name).value, typed.need(name).value)
    assert typed.sheets["gyroscope"].range == sound.sheets["gyroscope"].range


def test_a_site_replaces_the_field(monkeypatch, tmp_path):
    assert run(monkeypatch, "fly", "--out", str(tmp_path / "flight"), "--site", "berlin") == 0
    north, _, down = read_recording(tmp_path / "flight").environment.magnetic_field
    assert 18.0 < north < 20.0
    assert 45.0 < down < 47.0


def test_both_engines_fly_the_same_throw_from_the_command_line(monkeypatch, tmp_path):
    """RK4 of 1 ms is 1e-5 m and 1e-3 deg from the standalone model on the driver's throw."""
    truths = []
    for engine in ("mujoco", "trajectory"):
        assert run(monkeypatch, "fly", "--engine", engine, "--out", str(tmp_path / engine), "--seed", "1") == 0
        truth = np.genfromtxt(tmp_path / engine / "truth.csv", delimiter=",", names=True)
        truths.append(np.column_stack([truth[name] for name in truth.dtype.names]))
    n = min(len(truth) for truth in truths) - 1
    difference = np.abs(truths[0][:n] - truths[1][:n])
    assert difference[:, 1:4].max() < 1e-4
    assert np.degrees(difference[:, 7:10].max()) < 0.01
    ends = [truth[-1] for truth in truths]
    np.testing.assert_allclose(ends[0][:4], ends[1][:4], atol=1e-4)


class TestModel:
    @pytest.fixture
    def model(self, tmp_path: Path) -> Path:
        disc, environment = load_disc("dd2")
        path = tmp_path / "model.toml"
        shared = ModelEffect(effect("air.wind", w_north_m_s=3.0), {"w_north_m_s": 0.1})
        here = ModelEffect(effect("mag.hard_iron", bz_uT=25.0), {}, ("named",))
        rig = ModelEffect(effect("rig.axis_tilt", tilt_north_rad=0.01))
        write_model(Model(environment, replace(disc, sigma={"CNr": 1e-4}), effects=(shared, here, rig)), path)
        return path

    @pytest.mark.parametrize("engine", ["mujoco", "trajectory"])
    def test_a_model_is_flown_with_its_tables_and_effects(self, monkeypatch, tmp_path, capsys, model, engine):
        """The same as its disc and its effects named one by one, to the byte; what acts on a rig is passed over."""
        common = ["fly", "--engine", engine, "--duration", "1"]
        assert run(monkeypatch, *common, "--model", str(model), "--out", str(tmp_path / "a" / "flight")) == 0
        assert "rig.axis_tilt is passed over: acts on rate_table" in capsys.readouterr().out
        given = ["--disc", "dd2", "--effect", "air.wind:w_north_m_s=3"]
        assert run(monkeypatch, *common, *given, "--out", str(tmp_path / "b" / "flight")) == 0
        for name in ("truth.csv", "magnetometer.csv", "accelerometer.csv"):
            assert (tmp_path / "a" / "flight" / name).read_bytes() == (tmp_path / "b" / "flight" / name).read_bytes()
        stated = read_recording(tmp_path / "a" / "flight").disc
        assert stated is not None
        assert stated.sigma["CNr"] == 1e-4

    def test_an_effect_of_named_recordings_acts_on_those(self, monkeypatch, tmp_path, model):
        for name in ("named", "other"):
            arguments = ["fly", "--engine", "trajectory", "--duration", "1", "--model", str(model)]
            assert run(monkeypatch, *arguments, "--out", str(tmp_path / name)) == 0
        named, other = (read_recording(tmp_path / n).need("magnetometer").value[:, 2] for n in ("named", "other"))
        assert np.mean(named - other) == pytest.approx(25.0, abs=0.5)

    def test_a_rate_table_takes_its_surroundings_and_what_acts_on_it(self, monkeypatch, tmp_path, model, short_profile):
        out = tmp_path / "run"
        assert (
            run(monkeypatch, "rate-table", "--profile", str(short_profile), "--model", str(model), "--out", str(out))
            == 0
        )
        field = read_recording(out).environment.magnetic_field
        np.testing.assert_array_equal(field, load_disc("dd2")[1].magnetic_field)

    @pytest.mark.parametrize(
        ("old", "new", "expected"),
        [
            ("CNr =", "CNrr =", "CNrr"),
            ("mass_kg =", "weight_kg = 1.0\nmass_kg =", "weight_kg"),
            ("w_north_m_s = 3.0", "w_up_m_s = 3.0", "w_up_m_s"),
            ("[disc]", "[disk]\n[disc]", "disk"),
        ],
    )
    @pytest.mark.parametrize("command", ["fly", "view"])
    def test_an_unknown_key_is_refused_by_name(self, monkeypatch, tmp_path, capsys, model, command, old, new, expected):
        model.write_text(model.read_text().replace(old, new, 1))
        assert run(monkeypatch, command, "--model", str(model), "--out", str(tmp_path / "flight")) == 2
        assert expected in capsys.readouterr().err

    def test_a_disc_twice_and_an_effect_twice_are_refused(self, monkeypatch, tmp_path, capsys, model):
        for more, expected in (
            (["--disc", "dd2"], "both name a disc"),
            (["--effect", "air.wind:w_east_m_s=1"], "'air.wind' is given twice"),
        ):
            assert run(monkeypatch, "fly", "--model", str(model), "--out", str(tmp_path / "flight"), *more) == 2
            assert expected in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["fly", "--disc", "frizbee"], "driver"),
        (["fly", "--effect", "air.wnd:w_north_m_s=1"], "did you mean 'air.wind'"),
        (["fly", "--effect", "air.wind:north=1"], "w_north_m_s"),
        (["fly", "--effect", "air.wind:w_north_m_s=strong"], "no name=number"),
        (["fly", "--effect", "mag.axes:axes=x y"], "mag.axes: axes is 'x y', expected x, y and z once each"),
        (
            ["fly", "--parts", "neo_m8n", "--effect", "board.rotation:rx_rad=1"],
            "no magnetometer, accelerometer or gyroscope on board",
        ),
        (["fly", "--throw", "nowhere.toml"], "nowhere.toml"),
        (["fly", "--parts", "mpu6050"], "mpu9250"),
        (["fly", "--site", "atlantis"], "berlin"),
        (["fly", "--ground", "bounce"], "'--ground'"),
        (["rate-table", "--mount", "1,1,0"], "millimetres"),
        (["rate-table", "--mount", "0.001"], "three numbers"),
        (["rate-table", "--profile", "missing.csv"], "missing.csv"),
        (["fly", "--effect", "rig.axis_tilt:tilt_north_rad=0.1"], "acts on rate_table, spin_down; this is a flight"),
        (["fly", "--parts", "neo_m8n", "--effect", "mag.lag:tau_s=0.01"], "no magnetometer on board"),
        (["validate", "--junit", "."], "no place for a file"),
        (["validate", "--seed", "-1"], "--seed"),
        (["vaildate"], "vaildate"),
    ],
)
def test_a_wrong_call_is_one_line_and_status_2(monkeypatch, tmp_path, capsys, arguments, expected):
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, *arguments) == 2
    captured = capsys.readouterr()
    assert captured.err.startswith("discsim: ")
    assert captured.err.count("\n") == 1
    assert expected in captured.err
    assert "Traceback" not in captured.err
    assert not any(tmp_path.iterdir()), "a refused call leaves nothing behind"


def test_files_that_are_no_recordings_are_left_alone(monkeypatch, tmp_path, capsys):
    (tmp_path / "track.csv").write_text("my notes")
    assert run(monkeypatch, "fly", "--out", str(tmp_path)) == 2
    assert "track.csv" in capsys.readouterr().err
    assert (tmp_path / "track.csv").read_text() == "my notes"


def test_a_recording_is_not_written_over_by_what_is_estimated_from_it(monkeypatch, tmp_path, capsys):
    assert run(monkeypatch, "fly", "--out", str(tmp_path / "flight")) == 0
    left = (tmp_path / "flight" / "run.json").read_bytes()
    assert run(monkeypatch, "estimate", str(tmp_path / "flight"), "--out", str(tmp_path / "flight")) == 2
    assert "is the input" in capsys.readouterr().err
    assert (tmp_path / "flight" / "run.json").read_bytes() == left


def test_debug_shows_the_traceback(monkeypatch, capsys):
    assert run(monkeypatch, "fly", "--disc", "frizbee", "--debug") == 2
    assert "Traceback" in capsys.readouterr().err


def test_validate_scores_everything_and_leaves_its_report(monkeypatch, tmp_path, capsys):
    """With the concealed case that has something in it; the other is drawn and scored the same way."""
    monkeypatch.setattr(headless, "QUICK_CASES", headless.QUICK_CASES[1:])
    kept = {name: limit for name, limit in shipped_limits(True).items() if not name.startswith("concealed, consistent")}
    monkeypatch.setattr("discsim.validation.reporting.limits.shipped_limits", lambda quick: kept)
    out, junit = tmp_path / "report", tmp_path / "scores.xml"
    assert run(monkeypatch, "validate", "--quick", "--out", str(out), "--junit", str(junit)) == 0
    scores = json.loads((out / "scores.json").read_text())
    assert len(scores) >= 10
    assert set(scores[0]) == {"name", "value", "unit", "expected", "tolerance", "ok"}
    assert all(score["ok"] for score in scores)
    assert {score["name"]: score["tolerance"] for score in scores} == {
        name: limit.tolerance for name, limit in kept.items()
    }
    assert sum("concealed" in score["name"] for score in scores) == 2
    page = (out / "report.html").read_text()
    assert page.count("data:image/png;base64,") == 7
    suite = ElementTree.parse(junit).getroot()[0]
    assert int(suite.get("tests")) == len(scores)
    assert suite.get("failures") == "0"
    assert f"{len(scores)} of {len(scores)} scores" in capsys.readouterr().out


class TestValidateOnesOwn:
    """One throw, a short profile, no concealed case: what is passed through is looked at, not how well it does."""

    @pytest.fixture(autouse=True)
    def nothing_concealed(self, monkeypatch):
        monkeypatch.setattr(headless, "QUICK_CASES", ())
        monkeypatch.setattr(headless, "concealed_checks", lambda cases: [])
        monkeypatch.setattr(headless, "closed_form_checks", lambda *_: [at_most("engine: made up", 0.0, "m", 1.0)])
        for name in ("GITHUB_ACTIONS", "GITHUB_STEP_SUMMARY"):
            monkeypatch.delenv(name, raising=False)

    @pytest.fixture
    def short(self, tmp_path):
        short = tmp_path / "short.toml"
        short.write_text("velocity_ned_m_s = [14.0, 0.0, -4.0]\npitch_rad = 0.1\nbody_rate_rad_s = [0.0, 0.0, 70.0]\n")
        return short

    def test_it_exits_with_1_where_a_score_is_outside_its_tolerance(self, monkeypatch, tmp_path, short, short_profile):
        monkeypatch.setattr(headless, "throw_checks", lambda results: [at_most("throws: made up", 2.0, "m", 1.0)])
        subject = ["--throws", str(short), "--profile", str(short_profile)]
        assert run(monkeypatch, "validate", "--quick", *subject, "--out", str(tmp_path / "report")) == 1
        assert "FAIL" in (tmp_path / "report" / "report.html").read_text()

    @pytest.mark.slow
    def test_a_disc_throw_profile_and_recording_of_ones_own_with_limits_and_an_earlier_run(
        self, monkeypatch, tmp_path, capsys, short, short_profile
    ):
        thrown = ["--disc", "cd5", "--engine", "trajectory", "--throw", str(short)]
        assert run(monkeypatch, "fly", *thrown, "--out", str(tmp_path / "mine")) == 0
        subject = ["--quick", "--disc", "cd5", "--throws", str(short), "--profile", str(short_profile)]
        first = ["--recordings", str(tmp_path / "mine"), "--record-limits", str(tmp_path / "l.toml"), "--repeat", "2"]
        run(monkeypatch, "validate", *subject, *first, "--out", str(tmp_path / "first"))
        scores = {item["name"]: item for item in json.loads((tmp_path / "first" / "scores.json").read_text())}
        mine = {name for name in scores if name.startswith("recordings: ")}
        assert mine >= {"recordings: mine, share of time that best knows", "recordings: C_Nr"}
        assert all(scores[name]["ok"] for name in mine)
        assert scores["recordings: C_Nr"]["expected"] == load_disc("cd5")[0].aero.CNr
        limits = (tmp_path / "l.toml").read_text()
        assert '"throws: worst rms error of best" = ' in limits
        assert "from 2 seeds" in limits

        page = tmp_path / "page.md"
        monkeypatch.setenv("GITHUB_ACTIONS", "true")
        monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(page))
        (tmp_path / "tight.toml").write_text('[limits]\n"throws: worst rms error of best" = 1e-9\n')
        again = ["--limits", str(tmp_path / "tight.toml"), "--against", str(tmp_path / "first")]
        capsys.readouterr()
        assert run(monkeypatch, "validate", *subject, *again, "--out", str(tmp_path / "second")) == 1
        assert "::error title=throws%3A worst rms error of best::" in capsys.readouterr().out
        assert "throws: worst rms error of best" in page.read_text()
        regression = (tmp_path / "second" / "against.html").read_text()
        assert "FAIL now" in regression
        assert "gone" in regression  # the recordings' scores
        values = [
            next(
                item["value"]
                for item in json.loads((tmp_path / name / "scores.json").read_text())
                if "best" in item["name"]
            )
            for name in ("first", "second")
        ]
        assert values[0] == values[1], "the same seed gives the same scores, whatever else is asked for"

    @pytest.mark.parametrize(
        ("arguments", "expected"),
        [
            (["--parts", "neo_m8n"], "no magnetometer on board"),
            (["--parts", "mpu9250"], "no gps on board"),
            (["--throws", "driver,driver"], "one name"),
            (["--limits", "none.toml"], "none.toml: no such file"),
            (["--repeat", "20"], "--record-limits"),
            (["--margin", "3"], "--record-limits"),
            (["--against", "none"], "none"),
            (["--recordings", "none"], "none"),
            (["--record-limits", "."], "no place for a file"),
        ],
    )
    def test_what_cannot_be_is_said_before_the_work(self, monkeypatch, tmp_path, capsys, arguments, expected):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(headless, "validate", lambda *_, **__: pytest.fail("work has begun"))
        assert run(monkeypatch, "validate", "--quick", *arguments) == 2
        assert expected in capsys.readouterr().err


def test_a_module_on_board_is_in_the_disc_that_the_recording_states(monkeypatch, tmp_path, capsys):
    flown = ["fly", "--engine", "trajectory"]
    assert run(monkeypatch, *flown, "--module", "mass_kg=0.037,radius_m=0.03", "--out", str(tmp_path / "heavy")) == 0
    disc, _ = load_disc("driver")
    stated = read_recording(tmp_path / "heavy").disc
    assert stated.mass == pytest.approx(disc.mass + 0.037)
    assert stated.Izz == pytest.approx(disc.Izz + 0.037 * 0.03**2 / 2)
    capsys.readouterr()
    for text, what in (("x_m=0.01", "has no mass"), ("mass=0.01", "'mass=0.01'"), ("mass_kg=heavy", "with a number")):
        assert run(monkeypatch, *flown, "--module", text, "--out", str(tmp_path / "wrong")) == 2
        assert what in capsys.readouterr().err
    twice = ["--module", "mass_kg=0.01,x_m=0.01", "--effect", "body.mass_imbalance:ex_m=0.001"]
    assert run(monkeypatch, *flown, *twice, "--out", str(tmp_path / "wrong")) == 2
    assert "given twice" in capsys.readouterr().err
