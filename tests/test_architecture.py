"""The page of the architecture shows the rooms and arrows that the imports make."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
DRAWING = runpy.run_path(str(ROOT / "docs" / "architecture.py"))


def test_the_table_of_rooms_is_that_of_the_imports():
    assert DRAWING["table"]() in PAGE, "run: python docs/architecture.py"


@pytest.mark.parametrize(("file", "name"), re.findall(r"`([\w/]+\.py)`: `(\w+)`", PAGE))
def test_each_stop_on_the_way_of_a_recording_is_where_the_page_says(file, name):
    assert re.search(rf"^(def {name}\(|{name}\b.* = )", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)


def test_a_room_stands_above_what_it_imports_alone():
    level = DRAWING["floors"]({"a": {"b", "c"}, "b": {"c"}, "c": set(), "d": {"e"}, "e": {"d", "c"}})
    assert (level["c"], level["b"], level["a"]) == (0, 1, 2)
    assert level["d"] == level["e"] == 1
