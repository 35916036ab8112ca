"""A detector is one file and one line: the diff of docs/architecture.md is all that it takes."""

from __future__ import annotations

import pytest
from support.page_diff import told_with_diff

ASKED = """
import json, sys
from dataclasses import replace
import numpy as np
from discsim.disc import Rig
from discsim.effects.catalogue import effect
from discsim.environment import Environment
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.sensors.sampling import Noise
from discsim.validation.diagnosis import diagnose

rig = Rig(Izz=0.0025, viscous=1.5e-5)
part = Instruments.from_parts("mpu9250").without("accelerometer")
part = part.fitted("gyroscope", range=100.0, noise=Noise(0.01))
stepping = part.with_effects([effect("gyro.bias_step", t_s=2.2, step_rad_s=0.04)])
environment = Environment(magnetic_field=np.array([20.0, 0.0, 45.0]))
runs = []
for k in range(3):
    motion = spin_down(rig, environment, 40.0 + 5.0 * k, 5.0, (), yaw=0.5 + k)
    module = stepping if k == 1 else part
    runs.append(record(motion, module, np.random.default_rng(k), plant="spin_down", name=f"run-{k}", rig=rig))
answer = diagnose([runs], ["made"]).diagnosis
told = {
    "verdict": answer.verdict,
    "named": [[e.id, list(e.recordings or ()), {n: v.value for n, v in e.parameters.items()}] for e in answer.effects],
}
print("TOLD" + json.dumps(told))
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the program with it says of three run-downs, in one of which the gyroscope's bias steps."""
    return told_with_diff("A detector", tmp_path_factory.mktemp("detector"), ASKED)


def test_the_detector_of_the_page_finds_what_it_is_for(told):
    assert told["verdict"] == "explained"
    ((id, recordings, values),) = told["named"]
    assert id == "gyro.bias_step"
    assert len(recordings) == 1
    assert recordings[0].endswith("run-1")
    assert values["t_s"] == pytest.approx(2.2, abs=0.05)
    assert values["step_rad_s"] == pytest.approx(0.04, abs=0.005)
