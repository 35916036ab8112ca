"""docs/a-strangers-log.md shows what a newcomer sees of a log that others measured: its first two commands are run."""

from __future__ import annotations

import re
import shlex
import shutil
import sys

import pytest
from support.places import REAL, ROOT, real

from discsim.validation.cli import main

LOG = REAL / "flatball-ins-ultimate-disc" / "2025-08-31-001-rb.csv"
PAGE = (ROOT / "docs" / "a-strangers-log.md").read_text(encoding="utf-8")


@real
def test_the_first_commands_of_the_page_say_what_it_shows(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    shutil.copy(LOG, "my-log.csv")
    blocks = re.findall(r"^```console\n\$ discsim ((?:import|check) .*?)\n(.*?)^```", PAGE, re.M | re.S)
    assert len(blocks) == 2
    for command, shown in blocks:
        monkeypatch.setattr(sys, "argv", ["discsim", *shlex.split(command)])
        with pytest.raises(SystemExit) as stop:
            main()
        assert not stop.value.code
        captured = capsys.readouterr()
        said = {line.rstrip() for line in (captured.err + captured.out).splitlines()}
        assert set(shown.splitlines()) <= said
