"""A law in a model file: the commands fly it where it acts on motion, and say so where they cannot."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from discsim.arrays import FloatArray
from discsim.law import Law
from discsim.model_file import Model, read_model, write_model
from discsim.shipped import load_disc
from discsim.validation.cli import main

DISC, FIELD = load_disc("driver")
#: a brake that takes a tenth of the spin in a second beside what the air takes
BRAKE = 0.1 * DISC.Izz


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["discsim", *arguments])
    with pytest.raises(SystemExit) as stop:
        main()
    return int(stop.value.code or 0)


def written(folder: Path, law: Law | None) -> Path:
    path = folder / ("bare.toml" if law is None else f"{law.target}.toml")
    write_model(Model(FIELD, DISC, laws=() if law is None else (law,)), path)
    return path


def truth(folder: Path) -> dict[str, FloatArray]:
    table = np.genfromtxt(folder / "truth.csv", delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names}


def test_both_engines_fly_the_law_of_a_model(monkeypatch, tmp_path):
    law = Law("-c * |r|^n * sign(r)", "moment_z_N_m", {"c": BRAKE, "n": 1.0})
    spins = {}
    for engine in ("mujoco", "trajectory"):
        for model in (written(tmp_path, law), written(tmp_path, None)):
            out = tmp_path / engine / model.stem
            arguments = ["--engine", engine, "--duration", "1", "--model", str(model), "--out", str(out)]
            assert run(monkeypatch, "fly", *arguments) == 0
            spins[engine, model.stem] = truth(out)["r_rad_s"]
        # d(log r) = -(C_Nr's part + c / Izz) dt, and the path, which the first depends on, hardly knows the spin
        kept = spins[engine, law.target][-1] / spins[engine, "bare"][-1]
        assert kept == pytest.approx(np.exp(-0.1), rel=2e-3)
    # the engines agree to 1e-4 m and 0.01 deg on this throw, on spin far better
    np.testing.assert_allclose(spins["mujoco", law.target], spins["trajectory", law.target], rtol=1e-5)


def readings(folder: Path, sensor: str) -> dict[str, FloatArray]:
    table = np.genfromtxt(folder / f"{sensor}.csv", delimiter=",", names=True)
    return {name: table[name] for name in table.dtype.names}


@pytest.mark.parametrize("command", ["fly", "rate-table"])
def test_laws_about_a_sensor_are_added_to_its_readings(monkeypatch, tmp_path, command):
    """Noise draws from streams of their own, so that the same seed gives the same noise with and without."""
    laws = (
        Law("b - b * exp(-t/tau)", "magnetometer.x_uT", {"b": 12.0, "tau": 0.7}),
        Law("a * cos(k * psi)", "magnetometer.y_uT", {"a": 9.0, "k": 1.37}),
        Law("c * |x| * r", "accelerometer.x_m_s2", {"c": 1e-3}),
    )
    path, bare = tmp_path / "sensors.toml", written(tmp_path, None)
    write_model(Model(FIELD, DISC, laws=laws), path)
    assert read_model(path).laws == laws
    more = ["--duration", "2"] if command == "fly" else ["--profile", str(profile(tmp_path))]
    for model in (path, bare):
        assert run(monkeypatch, command, *more, "--model", str(model), "--out", str(tmp_path / model.stem)) == 0
    truth_of = truth(tmp_path / "sensors")
    time, spin = truth_of["time_s"], truth_of["r_rad_s" if command == "fly" else "rate_rad_s"]
    angle = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (spin[1:] + spin[:-1]))])
    there, without = (readings(tmp_path / name, "magnetometer") for name in ("sensors", "bare"))
    t = there["time_s"]
    # rounding to 0.6 uT of both readings; the angle by the trapezoidal rule errs by 1e-5 rad
    for axis, expected in (
        ("x_uT", 12.0 * -np.expm1(-t / 0.7)),
        ("y_uT", 9.0 * np.cos(1.37 * np.interp(t, time, angle))),
        ("z_uT", 0.0 * t),
    ):
        np.testing.assert_allclose(there[axis] - without[axis], expected, atol=0.61)
    there, without = (readings(tmp_path / name, "accelerometer") for name in ("sensors", "bare"))
    added = 1e-3 * np.abs(without["x_m_s2"]) * np.interp(there["time_s"], time, spin)
    inside = np.abs(there["x_m_s2"]) < 156.0
    # noise of 0.03 m/s^2 in what is multiplied by less than 0.1
    np.testing.assert_allclose((there["x_m_s2"] - without["x_m_s2"])[inside], added[inside], atol=0.03)
    np.testing.assert_array_equal(there["y_m_s2"], without["y_m_s2"])


def profile(folder: Path) -> Path:
    path = folder / "profile.csv"
    path.write_text("time_s,rate_deg_s\n0,0\n1,1500\n3.5,1500\n4.5,3000\n7,3000\n")
    return path


@pytest.mark.parametrize(
    ("command", "law", "said"),
    [
        ("fly", Law("c * t", "rate_reference.rate_rad_s", {"c": 1.0}), "there is no rate_reference on board"),
        ("rate-table", Law("-c * r", "moment_z_N_m", {"c": BRAKE}), "a rate table turns as commanded"),
    ],
)
def test_a_law_that_cannot_act_is_passed_over_aloud(monkeypatch, tmp_path, capsys, command, law, said):
    more = ["--duration", "0.3"] if command == "fly" else ["--profile", str(profile(tmp_path))]
    assert run(monkeypatch, command, *more, "--model", str(written(tmp_path, law)), "--out", str(tmp_path / "out")) == 0
    assert f"the model's law about {law.target} is passed over: {said}" in " ".join(capsys.readouterr().out.split())
