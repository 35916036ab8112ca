"""The pages say what the program does."""

from __future__ import annotations

import re
from pathlib import Path

from discsim.effects import CATALOGUE

DOCS = Path(__file__).parents[1] / "docs"


def catalogue_table() -> str:
    """The table of effects as the catalogue has it; `python tests/test_docs.py` writes it into the page."""
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
    page = (DOCS / "physics.md").read_text(encoding="utf-8")
    assert page == with_table(page), "run `python tests/test_docs.py` to renew the table"


def test_links_between_pages_lead_somewhere():
    for page in [*DOCS.glob("*.md"), DOCS.parent / "README.md"]:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if not target.startswith("http"):
                assert (page.parent / target).exists(), f"{page.name} links to {target}"


if __name__ == "__main__":
    path = DOCS / "physics.md"
    path.write_text(with_table(path.read_text(encoding="utf-8")), encoding="utf-8")
