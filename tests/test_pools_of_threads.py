"""Estimators and diagnosis in several threads at once give what they give alone, and leave nothing global behind."""

from __future__ import annotations

import os
import random
import signal
import sys
import threading
import warnings
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import matplotlib as mpl
import mujoco
import numpy as np
import pytest
from fuzz.analyses import SETS
from fuzz.seeds import recording_files
from threadpoolctl import threadpool_info

from discsim.errors import InputError
from discsim.estimators.methods import Options
from discsim.recording import Recording, read_recording
from discsim.validation.diagnosis.diagnosed import diagnose_recordings
from discsim.validation.estimating.spin_estimates import estimate_all
from discsim.validation.reporting.figures import new_figure, save_figure
from discsim.validation.reporting.run import json_text, start_run


def globals_of_the_process() -> dict[str, object]:
    return {
        "callback": mujoco.get_mjcb_passive(),
        "warnings of MuJoCo": mujoco.get_mju_user_warning(),
        "filters": list(warnings.filters),
        "numpy's errors": np.geterr(),
        "numpy's random state": str(np.random.get_state()),  # noqa: NPY002
        "random state": random.getstate(),
        "environment": dict(os.environ),
        "threads of linear algebra": sorted((pool["filepath"], pool["num_threads"]) for pool in threadpool_info()),
        "signals": [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)],
        "matplotlib": {key: str(value) for key, value in mpl.rcParams.items() if key != "backend"},
        "folder": os.getcwd(),
        "limit of recursion": sys.getrecursionlimit(),
        "threads": threading.active_count(),
    }


@contextmanager
def nothing_left_behind():
    before = globals_of_the_process()
    yield
    after = globals_of_the_process()
    assert [name for name in before if before[name] != after[name]] == []


@contextmanager
def short_turns():
    """Let threads take turns every ten microseconds instead of every five milliseconds."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        yield
    finally:
        sys.setswitchinterval(before)


def recordings(folder) -> list[Recording]:
    found = []
    for plant in ("rate_table", "spin_down", "free_spin"):
        (folder / plant).mkdir()
        for name, text in recording_files(plant, 2.0).items():
            (folder / plant / name).write_text(text, encoding="utf-8")
        found.append(read_recording(folder / plant))
    return found


def estimated(recording: Recording) -> list[tuple[str, bytes, bytes]]:
    rates, _ = estimate_all(recording, "all", Options())
    return [(rate.method, rate.rate.tobytes(), rate.sd.tobytes()) for rate in rates]


def test_estimators_in_a_pool_give_what_they_give_alone(tmp_path):
    given = recordings(tmp_path)
    alone = [estimated(one) for one in given]
    with nothing_left_behind(), short_turns(), ThreadPoolExecutor(4) as pool:
        assert list(pool.map(estimated, given * 2)) == alone * 2


def test_diagnoses_in_a_pool_give_what_they_give_alone(tmp_path):
    for name, text in SETS["rate_table"]().items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    recording = read_recording(tmp_path)

    def diagnosed(seed: int) -> str:
        return json_text(diagnose_recordings(recording, seed=seed).diagnosis.to_json())

    alone = [diagnosed(seed) for seed in (0, 1)]
    with nothing_left_behind(), short_turns(), ThreadPoolExecutor(2) as pool:
        assert list(pool.map(diagnosed, (0, 1, 0, 1))) == alone * 2


def test_an_error_in_the_middle_leaves_nothing_behind(tmp_path):
    flight = tmp_path / "flight"
    flight.mkdir()
    for name, text in recording_files("rate_table", 2.0).items():
        (flight / name).write_text(text, encoding="utf-8")
    recording = read_recording(flight)

    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    with nothing_left_behind():
        with pytest.raises(KeyboardInterrupt):
            diagnose_recordings(recording, progress=stop)
        with pytest.raises(InputError), start_run(tmp_path / "out"):
            raise InputError("nothing, expected something")


def test_a_saved_figure_leaves_matplotlib_as_it_was(tmp_path):
    with nothing_left_behind():
        first, _ = new_figure()
        second, _ = new_figure()
        save_figure(first, None)
        save_figure(second, tmp_path / "figure.png")
