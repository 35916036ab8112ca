"""A sensor is one file and a line in each list of sensors: the diff of docs/architecture.md is all that it takes."""

from __future__ import annotations

import pytest
from support.page_diff import told_with_diff

ASKED = """
import json, sys
from dataclasses import replace
from pathlib import Path
import numpy as np
from discsim import engine
from discsim.recording import read_recording, write_recording
from discsim.sensors.instruments import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.validation.checking.check import check_recording
from discsim.validation.diagnosis.relaxed_fit import relaxed

folder = Path(sys.argv[1])
part = "[barometer]\\nrate_hz = 25\\nnoise_rms_m = 0.1\\n"
(folder / "part.toml").write_text('name = "bmp390"\\n' + part)
disc, environment = load_disc("driver")
release = load_throw("driver")
motion = engine.fly(disc, environment, release, duration=1.5)
instruments = Instruments.from_parts("mpu9250", "neo_m8n", str(folder / "part.toml"))
made = record(motion, instruments, np.random.default_rng(1), plant="flight", name="up", disc=disc)
write_recording(replace(made, release=release), folder / "up")
back = read_recording(folder / "up")
height = np.interp(back.samples["barometer"].t, motion.t, -motion.position[:, 2])
fit = relaxed([back])
(linear,) = fit.linears
rows = [channel.rows for channel in linear.channels if channel.sensor == "barometer"]
left = linear.residual[rows[0]]
told = {
    "read": float(np.std(back.samples["barometer"].value - height)),
    "left": float(np.std(left)),
    "count": int(left.size),
    "checked": "barometer" in json.dumps(check_recording(back).to_json()),
}
print("TOLD" + json.dumps(told))
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the program with it says of a throw with the page's barometer on board."""
    return told_with_diff("A sensor", tmp_path_factory.mktemp("sensor"), ASKED)


def test_the_sensor_of_the_page_is_flown_written_and_read_again(told):
    assert told["read"] == pytest.approx(0.1, rel=0.4)
    assert told["checked"]


def test_a_fit_follows_the_sensor_of_the_page(told):
    assert told["count"] > 30
    assert told["left"] == pytest.approx(0.1, rel=0.4)
