"""What the commands do is there from Python: results that can be read, and the same files as the commands write."""

from __future__ import annotations

import doctest
import json
import pkgutil
import subprocess
import sys
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import discsim
from discsim import estimators, validation
from discsim.errors import InputError
from discsim.estimators import estimate, fft
from discsim.recording import Recording, SensorSheet
from discsim.threads import limited, one_thread
from discsim.validation.cli import main
from discsim.validation.diagnosis import pipeline
from discsim.validation.reporting.run import start_run
from discsim.validation.running.tasks import Task, run_tasks
from discsim.validation.studies.catalogue import STUDIES, run_study

#: modules with examples: each is run as it stands
EXAMPLES = (
    *(
        "discsim",
        "discsim.plain_arrays",
        "discsim.estimators.plain_arrays",
        "validation",
        "discsim.validation.checking.checked",
    ),
)
RATE = 30.0


def field_of(rate: float, seconds: float = 3.0, noise: float = 0.05) -> tuple[np.ndarray, np.ndarray]:
    """Return time (n,) s and the field (n, 3) uT that a magnetometer sees which turns about z, rad/s."""
    t = np.arange(0.0, seconds, 0.01)
    field = np.column_stack([40 * np.cos(rate * t), -40 * np.sin(rate * t), np.full(t.size, 20.0)])
    return t, field + np.random.default_rng(0).normal(0.0, noise, field.shape)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return discsim.recording_from_arrays({"magnetometer": field_of(RATE)}, name="turning")


def command(monkeypatch: pytest.MonkeyPatch, *words: str) -> None:
    monkeypatch.setattr(sys, "argv", ["discsim", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code


@pytest.mark.parametrize("module", EXAMPLES)
def test_the_examples_of_the_docstrings_give_what_they_say(module, recording, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found = doctest.testmod(import_module(module), extraglobs={"recording": recording})
    assert found.attempted > 0
    assert found.failed == 0


def test_the_examples_of_all_other_docstrings_give_what_they_say():
    """But for the engine's, which needs a disc at hand."""
    run, wrong = 0, []
    for module in pkgutil.walk_packages(discsim.__path__, "discsim."):
        if module.name in {*EXAMPLES, "discsim.validation", "discsim.engine"} or module.name.endswith("__main__"):
            continue
        found = doctest.testmod(import_module(module.name))
        run += found.attempted
        wrong += [module.name] * (found.failed > 0)
    assert wrong == []
    assert run > 50


@pytest.mark.parametrize("package", [discsim, validation])
def test_every_name_that_a_package_offers_is_there(package):
    for name in package.__all__:
        assert getattr(package, name) is not None, name
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        package.nothing  # noqa: B018


def test_importing_discsim_loads_neither_mujoco_nor_numpy():
    code = "import discsim, sys; print([name for name in ('mujoco', 'numpy', 'numba') if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_arrays_are_enough_for_a_spin_rate(recording):
    assert np.median(np.abs(estimate(recording, "fft").rate)) == pytest.approx(RATE, rel=0.01)
    assert np.median(np.abs(fft(discsim.Samples(*field_of(RATE))).rate)) == pytest.approx(RATE, rel=0.01)


def test_arrays_keep_what_a_sheet_states_and_take_the_rate_from_the_times():
    sheet = SensorSheet(float("nan"), position=np.array([-0.0161, 0.0, 0.0]))
    t = np.arange(0.0, 1.0, 0.002)
    made = discsim.recording_from_arrays({"accelerometer": (t, np.zeros((t.size, 3)))}, sheets={"accelerometer": sheet})
    assert made.sheets["accelerometer"].rate_hz == pytest.approx(500.0)
    np.testing.assert_array_equal(made.sheets["accelerometer"].position, sheet.position)
    assert not made.environment.field_known


@pytest.mark.parametrize(
    ("readings", "said"),
    [
        ({"compass": ([0, 1], [[1, 2, 3]] * 2)}, "unknown sensor 'compass'; expected one of magnetometer"),
        ({"magnetometer": ([0, 1], [[1, 2]] * 2)}, r"magnetometer: got values \(2, 2\), expected \(n, 3\)"),
        ({"magnetometer": ([0, 0], [[1, 2, 3]] * 2)}, "time runs from 0 to 0 s; expected ascending"),
        ({"magnetometer": ([0], [[1, 2, 3]])}, "1 rows tell no sampling rate; expected two or more"),
        ({"magnetometer": (["a"], [[1, 2, 3]])}, "magnetometer: got texts, expected numbers"),
    ],
)
def test_arrays_that_are_no_recording_are_refused_in_a_sentence(readings, said):
    with pytest.raises(discsim.InputError, match=said):
        discsim.recording_from_arrays(readings)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: SensorSheet("100"), "rate_hz is '100', of type str; expected a number, Hz"),
        (
            lambda: SensorSheet(100.0, noise_rms="low"),
            "noise_rms is 'low', of type str; expected a number in the sensor",
        ),
        (
            lambda: SensorSheet(100.0, position="here"),
            "position is 'here'; expected three numbers in the body frame, m",
        ),
        (lambda: SensorSheet(100.0, position=[0.1, 0.0]), r"position is \[0.1, 0.0\]; expected three numbers"),
        (lambda: SensorSheet(100.0, sigma=3), "sigma is 3, of type int; expected a mapping from a field's name"),
        (lambda: discsim.challenge("two"), "cases is 'two', of type str; expected a whole number"),
        (lambda: discsim.challenge(2, seed=0.5), "seed is 0.5, of type float; expected a whole number"),
        (
            lambda: discsim.recording_from_arrays({"magnetometer": field_of(RATE)}, sheets={"magnetometer": 100.0}),
            "the sheet of magnetometer is 100.0, of type float; expected a SensorSheet",
        ),
    ],
)
def test_an_argument_of_another_type_is_refused_in_a_sentence(call, said):
    """They ended deep inside as Python's own errors, or went unsaid."""
    with pytest.raises(InputError, match=said):
        call()


NO_ARGUMENTS = [[], [[]], (), None, 3, {}, np.zeros(3), b"x"]


@pytest.mark.parametrize("given", NO_ARGUMENTS, ids=repr)
def test_what_is_no_recording_and_no_path_is_refused_in_a_sentence(recording, given):
    """Lists, numbers and a recording in the place of its path ended as Python's own errors from the inside."""
    sheet = SensorSheet(100.0, position=[0.01, 0.0, 0.0])
    calls = [
        discsim.check, discsim.diagnose, discsim.fit, discsim.estimate,
        discsim.read_recording, discsim.read_dataset, discsim.read_model, discsim.import_log,
        discsim.load_disc, discsim.load_throw, discsim.load_site, discsim.load_part, discsim.sweep,
        estimators.best, lambda one: estimate(one, "fft"), estimators.fft,
        lambda one: estimators.gyroscope(one, sheet), lambda one: estimators.accelerometer(one, sheet),
        lambda one: estimators.rate_reference(one, sheet),
        lambda one: estimators.rate_with_known_terms(one, [0.01, 0.0, 0.0]),
        lambda one: discsim.fit(recording, one), lambda one: validation.score_rates([one], estimate(recording, "fft")),
    ]  # fmt: skip
    for call in calls:
        with pytest.raises(InputError, match="expected"):
            call(given)


def test_a_recording_or_a_list_in_the_place_of_another_is_refused_in_a_sentence(recording, tmp_path):
    rate = estimate(recording, "fft")
    field, sheet = recording.samples["magnetometer"], recording.sheets["magnetometer"]
    for call, said in (
        (lambda: discsim.read_recording([tmp_path]), "expected the path of a recording, one at a time"),
        (lambda: estimators.best([recording]), "expected one Recording"),
        (lambda: estimators.best(tmp_path), "expected one Recording"),
        (lambda: estimators.gyroscope(recording, sheet), r"expected recording.samples\["),
        (lambda: estimators.gyroscope(field, None), r"expected recording.sheets\["),
        (lambda: estimators.rate_reference(field, sheet), r"of shape \(300, 3\); expected \(n,\) of a rate_reference"),
        (lambda: validation.score_rates(rate, rate), "rates is .* expected a list of rates"),
        (lambda: validation.score_rates([rate], recording), "truth is .* expected a YawRate"),
        (lambda: discsim.plan(None), "plans is None, .* expected a number of throws"),
        (lambda: pipeline.diagnose([[]], ["a"]), "no recordings were given; expected data sets"),
        (lambda: pipeline.diagnose([], []), "no recordings were given; expected data sets"),
        (lambda: pipeline.diagnose([recording], ["a"]), "one of the data sets is .* expected a list of recordings"),
    ):
        with pytest.raises(InputError, match=said):
            call()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"velocity": [2e4, 0.0, 0.0]}, r"release velocity is 20000 m/s in size; expected at most 10000 in size"),
        ({"body_rate": [0.0, 0.0, 7200.0]}, r"release body_rate is 7200 rad/s in size; expected at most 5000"),
        ({"position": [0.0, 0.0, -1e9]}, "release position is 1e"),
        ({"yaw": 1e7}, "release yaw is 1e"),
    ],
)
def test_a_release_from_python_has_the_limits_of_one_in_a_file(given, said):
    """A velocity was refused as a spin of the disc that nobody had stated, or where a step failed."""
    with pytest.raises(InputError, match=said):
        discsim.Release(**given)


def test_a_list_of_methods_is_refused_in_a_sentence(recording):
    with pytest.raises(InputError, match=r"method is \['fft'\], of type list; expected the name of one: best, all, "):
        discsim.estimate(recording, ["fft"])
    with pytest.raises(InputError, match=r"name is \['fft'\], of type list; expected the name of a method: best, "):
        estimate(recording, ["fft"])


def test_plain_arrays_of_another_shape_are_refused_in_a_sentence():
    t, field = field_of(RATE)
    with pytest.raises(discsim.InputError, match=r"got readings \(300, 2\), expected \(n, 3\)"):
        discsim.fft(t, field[:, :2])
    with pytest.raises(discsim.InputError, match="fft: samples: got t"):
        discsim.fft(t[1:], field)


def results(recording: Recording) -> list[discsim.Result]:
    """One result of each kind that takes no minute to make."""
    disc, environment = discsim.load_disc("driver")
    flown = discsim.predict(disc, environment, discsim.load_throw("driver"), duration=0.2).motion()
    return [recording, flown, discsim.fft(*field_of(RATE)), discsim.estimate(recording), discsim.check(recording)]


def test_every_result_reads_in_a_line_in_a_table_in_arrays_and_in_a_figure(recording):
    for result in results(recording):
        assert repr(result).startswith("<")
        assert "\n" not in repr(result)
        assert len(repr(result)) < 200
        assert result._repr_html_().startswith("<pre>")
        table = {name: np.asarray(values) for name, values in result.table().items()}
        frame = result.to_dataframe()
        assert list(frame) == list(table)
        assert {len(values) for values in table.values()} == {len(frame)}
        assert sum(variable.size for variable in result.to_xarray().variables.values()) > 0
        assert result.plot().axes[0].has_data()


def test_labelled_arrays_hold_the_readings_over_the_times_of_their_sensor(recording):
    arrays = recording.to_xarray()
    np.testing.assert_array_equal(arrays.magnetometer_y_uT, recording.samples["magnetometer"].value[:, 1])
    np.testing.assert_array_equal(arrays.magnetometer_time_s, recording.samples["magnetometer"].t)
    rate = discsim.fft(*field_of(RATE))
    assert rate.to_xarray().sd_rad_s.dims == ("time_s",)


@pytest.mark.parametrize(("package", "call"), [("pandas", "to_dataframe"), ("xarray", "to_xarray")])
def test_a_package_that_is_missing_is_named_with_the_extra_that_brings_it(recording, monkeypatch, package, call):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(discsim.InputError, match=rf"needs {package}, .* pip install 'discsim\[tables\]'"):
        getattr(discsim.fft(*field_of(RATE)), call)()


def test_a_sweep_and_workers_name_the_extra_that_they_need(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(discsim.InputError, match=r"sweep: needs xarray, .*discsim\[tables\]"):
        discsim.sweep("installation")
    monkeypatch.setitem(sys.modules, "distributed", None)
    tasks = [Task("a", 1), Task("b", 2)]
    with pytest.raises(discsim.InputError, match=r"--workers 2: needs distributed, .*discsim\[cluster\]"):
        run_tasks(tasks, lambda argument, shared: argument, tmp_path, workers=2)
    assert run_tasks(tasks, lambda argument, shared: argument, tmp_path) == [1, 2]


def test_linear_algebra_has_one_thread_inside_and_as_many_as_before_outside():
    def threads() -> set[int]:
        return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

    import scipy.linalg  # noqa: F401  # its library is limited, too

    with threadpool_limits(2, user_api="blas"):
        assert threads() == {2}
        with limited(), limited():
            assert threads() == {1}
        assert threads() == {2}
        with pytest.raises(ZeroDivisionError):
            one_thread(lambda: 1 / 0)()
        assert threads() == {2}
        assert one_thread(threads)() == {1}


def test_importing_sets_no_environment_variable():
    code = "import os; old = dict(os.environ); import discsim.estimators, discsim.validation; print(old == os.environ)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_a_run_names_the_commit_of_its_sources(tmp_path):
    root = Path(discsim.__file__).parents[1]
    asked = subprocess.run(
        ["git", "-C", str(root), "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=False
    )
    with start_run(tmp_path):
        pass
    written = json.loads((tmp_path / "run.json").read_text())["commit"]
    inside = (root / ".git").exists()
    assert written.removesuffix("+") == (asked.stdout.strip() if inside else "unknown")


def test_a_recording_and_a_rate_show_themselves_in_a_line(recording):
    assert repr(recording) == "<Recording 'turning': free_spin, 2.99 s, magnetometer 300 rows>"
    assert repr(estimate(recording, "fft")).startswith("<YawRate by fft: magnitude, ")


def test_an_estimate_from_python_writes_the_bytes_of_the_command(recording, tmp_path, monkeypatch):
    discsim.write_recording(recording, tmp_path / "turning")
    found = validation.estimate(tmp_path / "turning", "fft")
    assert repr(found) == "<SpinEstimates of 'turning': fft>"
    assert found.summary().startswith("by fft: magnitude")
    found.report(tmp_path / "mine")
    command(monkeypatch, "estimate", str(tmp_path / "turning"), "--method", "fft", "--out", str(tmp_path / "theirs"))
    for name in ("rate.csv", "estimate.json"):
        assert (tmp_path / "mine" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes()
    np.testing.assert_array_equal(found["fft"].rate, found.rates[0].rate)


def test_a_check_from_python_writes_the_bytes_of_the_command(recording, tmp_path, monkeypatch):
    discsim.write_recording(recording, tmp_path / "turning")
    found = validation.check(tmp_path / "turning")
    assert repr(found).startswith("<Checked: 1 recordings, ")
    assert "turning: free_spin" in found.summary()
    found.report(tmp_path / "mine")
    command(monkeypatch, "check", str(tmp_path / "turning"), "--out", str(tmp_path / "theirs"))
    assert (tmp_path / "mine" / "check.json").read_bytes() == (tmp_path / "theirs" / "check.json").read_bytes()


def test_a_log_imported_from_python_is_the_recording_of_the_command(tmp_path, monkeypatch):
    t, field = field_of(RATE)
    rows = "\n".join(f"{a:.3f},{x:.3f},{y:.3f},{z:.3f}" for a, (x, y, z) in zip(t, field, strict=True))
    raw = tmp_path / "log.csv"
    raw.write_text(f"time_s,mag_x_uT,mag_y_uT,mag_z_uT\n{rows}\n")
    found = validation.import_log(raw)
    found.report(tmp_path / "mine")
    command(monkeypatch, "import", str(raw), "--out", str(tmp_path / "theirs"))
    for name in ("recording.toml", "magnetometer.csv", "repairs.csv", "map.toml"):
        assert (tmp_path / "mine" / name).read_bytes() == (tmp_path / "theirs" / name).read_bytes()
    assert repr(found).startswith("<ImportedLog 'log.csv': 1 recordings, ")
    assert "magnetometer: 300 samples" in found.summary()


def test_recordings_are_taken_as_they_come(recording, tmp_path):
    from discsim.validation.running.given import given_recordings

    discsim.write_recording(recording, tmp_path / "01")
    given = given_recordings([recording, tmp_path, str(tmp_path / "01")])
    assert [one.name for one in given] == ["turning"] * 3
    with pytest.raises(discsim.InputError, match="no recordings were given"):
        given_recordings([])


def test_recordings_of_two_plants_are_not_diagnosed_together(recording):
    other = discsim.recording_from_arrays({"magnetometer": field_of(RATE)}, plant="rate_table")
    with pytest.raises(discsim.InputError, match="expected recordings of one plant"):
        validation.diagnose([recording, other])


@dataclass(frozen=True)
class Asked:
    """What a blind test was asked for."""

    given: tuple[object, ...]
    named: dict[str, object]


def test_the_package_of_the_blind_test_is_called_as_its_function(monkeypatch):
    import discsim.validation.challenge.challenged as home

    monkeypatch.setattr(home, "blind_test", lambda *given, **named: Asked(given, named))
    assert validation.challenge(3, seed=5) == Asked((3,), {"seed": 5})
    assert validation.challenge.challenged is home


def test_what_is_shipped_is_listed_and_shown_by_the_command(monkeypatch, capsys):
    command(monkeypatch, "list", "discs")
    assert "a sensible golf distance driver" in capsys.readouterr().out
    command(monkeypatch, "show", "mpu9250")
    assert capsys.readouterr().out.startswith("# parts/mpu9250\n")


def test_h_asks_for_help_as_the_long_option_does(monkeypatch, capsys):
    command(monkeypatch, "list", "-h")
    short = capsys.readouterr().out
    command(monkeypatch, "list", "--help")
    assert short == capsys.readouterr().out
    assert "Example: discsim list discs" in short


def test_a_study_is_run_by_its_name_with_its_own_options(monkeypatch, capsys):
    command(monkeypatch, "study")
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(STUDIES)
    command(monkeypatch, "study", "paper", "--help")
    assert "Usage: discsim study paper" in capsys.readouterr().out


@pytest.mark.parametrize("study", STUDIES.values(), ids=list(STUDIES))
def test_every_study_is_there_in_a_checkout(study):
    assert callable(import_module(study.module).command)


def test_a_study_that_is_unknown_or_not_installed_is_refused_in_a_sentence(monkeypatch):
    with pytest.raises(discsim.InputError, match="no study 'papre'; expected one of paper, "):
        run_study("papre", [])
    monkeypatch.setattr("discsim.validation.studies.catalogue.find_spec", lambda name: None)
    with pytest.raises(discsim.InputError, match=r"not part of an installed discsim; expected a checkout"):
        run_study("golf-throws", [])


@pytest.mark.parametrize("cases", [0, -3])
def test_a_blind_test_without_a_case_is_refused(cases):
    with pytest.raises(InputError, match=f"{cases} cases; expected at least one"):
        discsim.challenge(cases=cases)
