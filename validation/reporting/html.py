"""Reports: one self-contained HTML page that a person reads from top to bottom."""

from __future__ import annotations

import base64
import platform
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from discsim.files import write_text
from discsim.validation.reporting.glossary import with_terms
from discsim.validation.reporting.run import current_run, package_version
from discsim.version import commit

__all__ = ["Section", "Tone", "write_page", "write_report"]

#: what stands at the right of its cell: a number, or the dash in the place of one
_NUMBER = re.compile(r"^([-+\u2212]?\d[\d,.]*(e[-+]?\d+)?( ?%)?|–)$")


@dataclass(frozen=True)
class Section:
    """One part of a report: paragraphs, a table, figures (caption, PNG file)."""

    title: str
    text: Sequence[str] = ()
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    figures: Sequence[tuple[str, Path]] = field(default=())

    @property
    def images(self) -> list[tuple[str, str]]:
        """The figures with their files as base64 text."""
        return [(caption, base64.b64encode(path.read_bytes()).decode()) for caption, path in self.figures]


#: how the banner of a page looks: neither good nor bad, as hoped, to be heeded, outside what was asked
Tone = Literal["plain", "good", "heed", "bad"]


def write_report(path: Path, title: str, lead: str, sections: Sequence[Section], tone: Tone = "plain") -> None:
    """Write the page to ``path``, figures embedded; ``lead``, its banner, is the answer."""
    write_page(path, "report.html", title=title, lead=lead, sections=sections, tone=tone)


def write_page(path: Path, template: str, **content: Any) -> None:
    """Write a page to ``path`` from one of ``validation/templates``; raises where the template lacks some content."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("discsim.validation"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.tests["number_cell"] = _is_number
    environment.tests["number_column"] = _is_number_column
    loader = environment.loader
    assert loader is not None
    script = Markup(loader.get_source(environment, "page.js")[0].rstrip())
    page = environment.get_template(template).render(footer=made_by(), script=script, **{"tone": "plain", **content})
    write_text(path, with_terms(page))


def _is_number(cell: object) -> bool:
    return bool(_NUMBER.match(str(cell)))


def _is_number_column(rows: Sequence[Sequence[str]], column: int) -> bool:
    """Return whether a column's cells stand at the right, so that its head does, too; blank ones do not count."""
    cells = [row[column] for row in rows if column < len(row) and str(row[column])]
    return bool(cells) and all(map(_is_number, cells))


def made_by() -> str:
    """Return by what a page was made: command and seed of the run if there is one, version, commit if known."""
    run = current_run()
    made = [f"discsim {package_version()}", f"commit {commit()}"]
    if run is not None:
        made.insert(0, f"discsim {' '.join(run.command)}")
        if run.seed is not None:
            made.append(f"seed {run.seed}")
        made.append(f"on {platform.node()} ({platform.machine()}, Python {platform.python_version()})")
    return " · ".join(made)
