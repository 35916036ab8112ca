"""The page on physics lists the effects that the program has."""

from __future__ import annotations

import re
from pathlib import Path

from discsim.effects import CATALOGUE

PAGE = Path(__file__).parents[1] / "docs" / "physics.md"


def catalogue_table() -> str:
    """The table of effects as the catalogue has it; `python tests/test_physics_page.py` writes it into the page."""
    rows = ["| id | parameters | what |", "|---|---|---|"]
    for row in CATALOGUE.values():
        what = re.sub(r"\s+", " ", (row.type.__doc__ or "").partition("\n")[0])
        what = re.sub(r" \([a-z, _.]*\)\.$", "", what).rstrip(".").replace("``", "`").replace("|", "\\|")
        rows.append(f"| {row.id} | {', '.join(row.parameters)} | {what} |")
    return "\n".join(rows)


def with_table(page: str) -> str:
    start, end = "<!-- catalogue -->\n", "<!-- /catalogue -->"
    before, _, rest = page.partition(start)
    _, _, after = rest.partition(end)
    return f"{before}{start}{catalogue_table()}\n{end}{after}"


def test_the_page_on_physics_lists_every_effect_of_the_catalogue():
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_table(page), "run `python tests/test_physics_page.py` to renew the table"


if __name__ == "__main__":
    PAGE.write_text(with_table(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
