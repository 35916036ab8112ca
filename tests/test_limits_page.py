"""The page on the recording format shows the limits that the readers apply."""

from __future__ import annotations

from pathlib import Path

from support.page_table import with_table

from discsim import limits
from discsim.limits import ANY_NUMBER, BY_KEY, BY_UNIT, Limit

PAGE = Path(__file__).parents[1] / "docs" / "recording-format.md"


def limits_table() -> str:
    """The limits of numbers as the code has them; `python tests/test_limits_page.py` writes them into the page."""
    rows = ["| key | smallest | largest | the limits are |", "|---|---|---|---|"]
    alike: dict[Limit, list[str]] = {}
    for name, limit in BY_KEY.items():
        alike.setdefault(limit, []).append(f"`{name}`")
    rows += [_row(", ".join(names), limit) for limit, names in alike.items()]
    rows += [_row(f"other `..._{unit}`", limit) for unit, limit in BY_UNIT.items()]
    return "\n".join([*rows, _row("any other", ANY_NUMBER)])


def _row(name: str, limit: Limit) -> str:
    smallest = f"{limit.smallest:g}" if limit.smallest else ""
    return f"| {name} | {smallest} | {limit.largest:g} | {limit.origin} |"


def test_the_page_on_the_format_shows_the_limits_that_the_readers_apply():
    page = PAGE.read_text(encoding="utf-8")
    assert page == with_table(page, "limits", limits_table()), (
        "run `python tests/test_limits_page.py` to renew the table"
    )


def test_the_page_on_the_format_shows_the_limits_of_sensor_files():
    page = " ".join(PAGE.read_text(encoding="utf-8").split())
    for shown in (
        f"at most {limits.MOST_ROWS:,} rows".replace(",", " "),
        f"{limits.LATEST:,.0f} s from the start".replace(",", " "),
        f"longer than {limits.LONGEST_SPAN:,.0f} s".replace(",", " "),
        f"closer than {limits.SHORTEST_STEP:g} s".replace("1e-05", "0.00001"),
        f"{limits.GRID_ROWS:,} rows and {limits.GRID_PER_ROW} for each".replace(",", " "),
        f"beyond {limits.LARGEST_READING:,.0f}".replace(",", " "),
        f"{limits.FASTEST_SPIN:,.0f} rad/s".replace(",", " "),
        f"{limits.LONGEST_RUN:,.0f} s".replace(",", " "),
    ):
        assert shown in page, shown


if __name__ == "__main__":
    page = with_table(PAGE.read_text(encoding="utf-8"), "limits", limits_table())
    PAGE.write_text(page, encoding="utf-8")
