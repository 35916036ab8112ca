"""docs/your-own-log.md shows what a stranger sees: its commands are run, and its lines and its rate are there."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys

import numpy as np
import pytest
from support.places import ROOT

from discsim.validation.cli import main
from discsim.validation.scenarios.example_log import write_example_log

PAGE = (ROOT / "docs" / "your-own-log.md").read_text(encoding="utf-8")


def commands() -> list[tuple[str, list[str]]]:
    """Return the commands of the page and the lines that are shown of each."""
    blocks = re.findall(r"^```console\n\$ discsim (.*?)\n(.*?)^```", PAGE, re.M | re.S)
    return [(command, shown.splitlines()) for command, shown in blocks]


def test_the_three_commands_of_the_page_give_the_lines_it_shows_and_the_true_rate(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(os.environ, "COLUMNS", "80")
    (truth,) = write_example_log(tmp_path / "LOG_0042.CSV")
    assert (tmp_path / "LOG_0042.CSV").read_text().splitlines()[:3] == PAGE.split("```\n")[1].splitlines()[:3]
    assert len(commands()) == 3
    for command, shown in commands():
        monkeypatch.setattr(sys, "argv", ["discsim", *shlex.split(command)])
        with pytest.raises(SystemExit) as stop:
            main()
        assert not stop.value.code
        captured = capsys.readouterr()
        said = [line.rstrip() for line in (captured.err + captured.out).splitlines()]
        for line in shown:
            if "│" in line:  # the estimate's figures are compared with the truth below
                continue
            start = line.removesuffix("...").rstrip()
            assert any(one == start or (line.endswith("...") and one.startswith(start)) for one in said), line
    method = json.loads((tmp_path / "spin" / "estimate.json").read_text())["methods"]
    (figures,) = method.values()
    rate, sd = np.degrees([figures["median_rate_rad_s"], figures["median_sd_rad_s"]])
    assert abs(rate - truth) < 3 * sd
    shown_rate = re.search(r"│ (\w+) +│ \d+ +│ 0 % +│ [\d.]+ to [\d.]+ +│ ([\d.]+) +│ ([\d.]+)", PAGE)
    assert shown_rate
    assert shown_rate[1] in method
    # optimisers end elsewhere within their tolerance on another machine: a tenth of the standard deviation
    assert abs(float(shown_rate[2]) - rate) < 0.1 * sd
    assert f"the truth is {truth:.0f}" in PAGE
