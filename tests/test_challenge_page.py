"""The page on the blind test lists the sizes that are drawn."""

from __future__ import annotations

from pathlib import Path

from support.page_table import with_table

from discsim.validation.challenge.cases.case import MASKS
from discsim.validation.challenge.cases.sizes import HIDING

PAGE = Path(__file__).parents[1] / "docs" / "challenge.md"
METHOD = PAGE.with_name("challenge-method.md")


def sizes_table() -> str:
    """The table of sizes as the test draws them; `python tests/test_challenge_page.py` writes it into the page."""
    rows = ["| effect | size of | from | to | elsewhere |", "|---|---|---|---|---|"]
    for id, hiding in HIDING.items():
        size = ", ".join(hiding.sized) + (" less 1" if hiding.about else "")
        elsewhere = "; ".join(f"{plant}: {low:g} to {high:g}" for plant, (low, high) in hiding.by_plant.items())
        rows.append(f"| {id} | {size} | {hiding.smallest:g} | {hiding.largest:g} | {elsewhere.replace('_', ' ')} |")
    return "\n".join(rows)


def test_the_page_on_the_blind_test_lists_every_size():
    page = METHOD.read_text(encoding="utf-8")
    assert page == with_table(page, "sizes", sizes_table()), (
        "run `python tests/test_challenge_page.py` to renew the table"
    )


def test_the_page_on_the_blind_test_lists_every_mask():
    page = PAGE.read_text(encoding="utf-8")
    assert all(f"| `{mask}` |" in page for mask in MASKS)


if __name__ == "__main__":
    page = with_table(METHOD.read_text(encoding="utf-8"), "sizes", sizes_table())
    METHOD.write_text(page, encoding="utf-8")
