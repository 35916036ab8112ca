"""Pages in Markdown from templates: prose may break anywhere in a template, and is wrapped in the page."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from discsim.files import write_text

__all__ = ["literal", "page_text", "span", "table", "wrapped", "write_page"]

_WIDTH = 118
#: what begins a line that stays as it is: a heading, a table, a picture, a tag
_AS_IT_IS = ("#", "|", "![", "<")
#: what begins an element, a link, a code or a cell of a table
_MARKS = re.compile(r"([\\`*<\[\]|])")


def write_page(path: Path, template: Path, **content: Any) -> None:
    """Write the page that a template makes of some content to ``path``; see `page_text`."""
    write_text(path, page_text(template, **content))


def page_text(template: Path, **content: Any) -> str:
    """Return the page that a template makes of some content; raises where the template asks for what is not given.

    Beside what Jinja knows a template has the filters ``f`` (a number in Python's format), ``span`` (see `span`) and
    ``degrees``, and the function ``table(header, rows)``. It may include other templates of its folder.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(template.parent),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,  # else what is included would run into what follows
    )
    environment.filters |= {"f": format, "span": span, "degrees": math.degrees}
    environment.globals["table"] = table
    return wrapped(environment.get_template(template.name).render(**content))


def span(values: Iterable[float], form: str, scale: float = 1.0) -> str:
    """Return "smallest to largest" of some values times ``scale``, or one number where both read alike."""
    scaled = [scale * value for value in values]
    low, high = f"{min(scaled):{form}}", f"{max(scaled):{form}}"
    return low if low == high else f"{low} to {high}"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return the lines of a table; a cell stays on its line, and in its column whatever stands in it."""
    cells = ([" ".join(cell.split()).replace("|", "\\|") for cell in row] for row in rows)
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, ["---"] * len(header), *cells))


def literal(text: str) -> str:
    """Return a name of somebody else's for a page in Markdown: on one line, and every character as it is."""
    return _MARKS.sub(r"\\\1", " ".join(text.split()).replace("&", "&amp;"))


def wrapped(text: str) -> str:
    """Return Markdown with its paragraphs and entries of lists wrapped, and one blank line between blocks.

    Code between fences, headings, tables, pictures and tags stay as they are.
    """
    pieces = re.split(r"^(```.*?^```)$", text, flags=re.MULTILINE | re.DOTALL)
    blocks = []
    for number, piece in enumerate(pieces):
        if number % 2:  # between fences
            blocks.append(piece)
            continue
        for block in filter(None, (part.strip() for part in re.split(r"\n[ \t]*\n", piece))):
            blocks.append(block if block.startswith(_AS_IT_IS) else _filled(block))
    return "\n\n".join(blocks) + "\n"


def _filled(block: str) -> str:
    """Return a paragraph, or the entries of a list, each wrapped."""
    return "\n".join(
        textwrap.fill(
            " ".join(entry.split()),
            _WIDTH,
            subsequent_indent="  " if entry.startswith("- ") else "",
            break_long_words=False,
            break_on_hyphens=False,
        )
        for entry in re.split(r"\n\s*(?=- )", block)
    )
