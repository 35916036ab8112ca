"""Benchmarks whose tables stand in the documentation run, one case each: what makes a page stays able to make it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.mark.parametrize(
    ("arguments", "row"),
    [
        (["paper_comparison.py", "--throws", "1"], "| `best`, all sensors, 1 mm off |"),
        # a magnet beside a module on a table: its law in some seconds
        (["laws.py", "--cases", "1", "--seed", "150003"], "| rotating_magnet | 1 | 1 | 1 of 1 |"),
    ],
)
def test_a_benchmark_of_a_page_runs(arguments, row, tmp_path):
    command = [sys.executable, str(ROOT / "benchmarks" / arguments[0]), *arguments[1:]]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert row in done.stdout
