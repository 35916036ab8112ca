"""A law in a model file: the commands fly it where it acts on motion, and say so where they cannot."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from discsim.arrays import FloatArray
from discsim.law import Law
from discsim.model_file import Model, write_model
from discsim.shipped import load_disc
from validation.cli import main

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


@pytest.mark.parametrize(
    ("command", "law", "said"),
    [
        ("fly", Law("c * t", "magnetometer.x_uT", {"c": 1.0}), "simulated readings carry no law"),
        ("rate-table", Law("-c * r", "moment_z_N_m", {"c": BRAKE}), "a rate table turns as commanded"),
    ],
)
def test_a_law_that_cannot_act_is_passed_over_aloud(monkeypatch, tmp_path, capsys, command, law, said):
    profile = tmp_path / "profile.csv"
    profile.write_text("time_s,rate_deg_s\n0,0\n1,1500\n3.5,1500\n4.5,3000\n7,3000\n")
    more = ["--duration", "0.3"] if command == "fly" else ["--profile", str(profile)]
    assert run(monkeypatch, command, *more, "--model", str(written(tmp_path, law)), "--out", str(tmp_path / "out")) == 0
    assert f"the model's law about {law.target} is passed over: {said}" in " ".join(capsys.readouterr().out.split())
