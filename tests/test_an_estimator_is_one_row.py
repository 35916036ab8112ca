"""An estimator is one file and one row: the diff of docs/architecture.md is all that it takes."""

from __future__ import annotations

import numpy as np
import pytest
from support.page_diff import told_with_diff

ASKED = """
import json, sys
from pathlib import Path
import numpy as np
import discsim
from discsim import estimators, validation
from discsim.estimators import zero_crossings
from discsim.validation.commands.estimate import command as estimate

t = np.arange(0.0, 3.0, 0.005)
rate = 40.0 - 2.0 * t
psi = 40.0 * t - t**2
noise = np.random.default_rng(1).normal(0.0, 0.3, (t.size, 3))
field = np.column_stack([20.0 * np.cos(psi), -20.0 * np.sin(psi), np.full(t.size, 45.0)]) + noise
recording = discsim.recording_from_arrays({"magnetometer": (t, field)})
found = estimators.estimate(recording, "zero_crossings")
off = (found.rate - (40.0 - 2.0 * found.t)) / found.sd
discsim.write_recording(recording, sys.argv[1] + "/recording")
folder = Path(sys.argv[1])
estimate(folder / "recording", method="zero_crossings", out=folder / "spin")
told = {"known": len(found), "rms": float(np.sqrt(np.mean(off**2))), "file": zero_crossings.__file__}
told["checked"] = "zero_crossings" in str(validation.check(recording).to_json())
print("TOLD" + json.dumps(told))
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the program says, to which the diff of the page was applied."""
    folder = tmp_path_factory.mktemp("estimator")
    return folder, told_with_diff("An estimator", folder, ASKED)


def test_the_estimator_of_the_page_tells_the_spin_with_an_honest_deviation(told):
    folder, found = told
    assert found["file"].startswith(str(folder))
    assert found["known"] > 15
    assert 0.5 < found["rms"] < 1.5


def test_commands_know_the_estimator_of_the_page_by_its_name(told):
    folder, found = told
    rows = np.genfromtxt(folder / "spin" / "rate.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    assert set(rows["method"]) == {"zero_crossings"}
    assert found["checked"]
