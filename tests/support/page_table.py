"""A table in a page of the docs that the program itself writes, between two marks."""

from __future__ import annotations


def with_table(page: str, name: str, table: str) -> str:
    """Return the page with ``table`` between its marks ``<!-- name -->`` and ``<!-- /name -->``."""
    start, end = f"<!-- {name} -->\n", f"<!-- /{name} -->"
    before, _, rest = page.partition(start)
    _, _, after = rest.partition(end)
    return f"{before}{start}{table}\n{end}{after}"
