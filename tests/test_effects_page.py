"""The page of the effects is what the rows of the catalogue make of it."""

from __future__ import annotations

import runpy
from pathlib import Path

from discsim.effects import CATALOGUE

DOCS = Path(__file__).parents[1] / "docs"


def test_the_page_of_the_effects_is_made_from_the_catalogue():
    page = runpy.run_path(str(DOCS / "effects.py"))["page"]()
    assert (DOCS / "effects.md").read_text(encoding="utf-8") == page, "run: python docs/effects.py"
    assert [id for id in CATALOGUE if page.count(f"| `{id}` |") != 1] == []
