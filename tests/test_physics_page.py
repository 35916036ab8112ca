"""The page on physics lists the effects that the program has."""

from __future__ import annotations

import re
from pathlib import Path

from page_table import with_table

from discsim.effects import CATALOGUE

PAGE = Path(__file__).parents[1] / "docs" / "physics.md"


def catalogue_table() -> str:
    """The table of effects as the catalogue has it; `python tests/test_physics_page.py` writes it into the page."""
    rows = ["| id | parameters | what |", "|---|---|---|"]
    for row in CATALOGUE.values():
        what = re.sub(r"\s+", " ", (row.type.__doc__ or "").partition("\n")[0])
        what = re.sub(r" \([a-z, _.]*\)\.$", "", what).rstrip(".").replace("``", "`").replace("|", "\\|")
        rows.append(f"| {row.id} | {', '.join((*row.parameters, *row.settings))} | {what} |")
    return "\n".join(rows)


def test_the_page_on_physics_lists_every_effect_of_the_catalogue():
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_table(page, "catalogue", catalogue_table()), (
        "run `python tests/test_physics_page.py` to renew the table"
    )


if __name__ == "__main__":
    page = with_table(PAGE.read_text(encoding="utf-8"), "catalogue", catalogue_table())
    PAGE.write_text(page, encoding="utf-8")
