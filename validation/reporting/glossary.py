"""Terms of the field in reports: each is linked, where a page first uses it, to its line of the glossary on that page.

Takes the text of a page and docs/glossary.md, which is part of an installation; gives the page with links and lines.
"""

from __future__ import annotations

import html
import re
from functools import cache
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import NamedTuple

__all__ = ["Term", "glossary", "with_terms"]

#: shorter names ("B", "r") are symbols: one cannot tell where a text means them
_SHORTEST = 4
#: what is no running text, or leads somewhere already
_KEPT = ("script", "style", "title", "h1", "a", "code", "dt", "th", "button")


class Term(NamedTuple):
    """A line of the glossary: the names of a term, and what it is."""

    names: tuple[str, ...]
    meaning: str

    @property
    def anchor(self) -> str:
        """The name of its line on a page."""
        return "term-" + re.sub(r"\W+", "-", self.names[0].lower())


def _page() -> Traversable:
    installed = files("discsim") / "glossary.md"  # in a wheel
    return installed if installed.is_file() else files("discsim") / ".." / "docs" / "glossary.md"  # in a checkout


@cache
def glossary() -> tuple[Term, ...]:
    """Return the terms of the glossary's page, those of old reports left out; none where the page is not there."""
    try:
        text = _page().read_text(encoding="utf-8").partition("\n## Words of old reports")[0]
    except OSError:
        return ()
    found = []
    for names, meaning in re.findall(r"^\| ([^|]+) \| ([^|]+) \|$", text, re.M):
        known = tuple(name.strip() for name in names.split(",") if len(name.strip()) >= _SHORTEST)
        if known and not meaning.startswith("is"):
            plain = re.sub(r"\[([^\]]+)\]\([^)]*\)", r"\1", meaning).replace("`", "")
            found.append(Term(known, plain))
    return tuple(found)


def with_terms(page: str) -> str:
    """Return a page of HTML whose terms lead to their lines, which stand above its footer; unchanged without any."""
    head, body, rest = page.partition("<body>")
    main, footer, end = rest.partition("<footer>")
    by_name = {name.lower(): term for term in glossary() for name in term.names}
    if not (body and footer and by_name):
        return page
    names = "|".join(re.escape(html.escape(name)) for name in sorted(by_name, key=len, reverse=True))
    used: dict[str, Term] = {}

    def link(match: re.Match[str]) -> str:
        term = by_name[html.unescape(match[1]).lower()]
        if term.anchor in used:
            return match[0]
        used[term.anchor] = term
        return f'<a class="term" href="#{term.anchor}">{match[0]}</a>'

    pattern = re.compile(rf"(?<![\w-])({names})(?:s|es)?(?![\w-])", re.I)
    inside = 0
    done = []
    for piece in re.split(r"(<[^>]+>)", main):
        tag = re.match(r"<(/?)(\w+)", piece)
        if tag and tag[2] in _KEPT:
            inside += -1 if tag[1] else 1
        done.append(piece if tag or inside else pattern.sub(link, piece))
    if not used:
        return page
    lines = "\n".join(
        f'<dt id="{term.anchor}">{html.escape(", ".join(term.names))}</dt><dd>{html.escape(term.meaning)}</dd>'
        for term in glossary()
        if term.anchor in used
    )
    words = f'<section class="terms">\n<h2>Terms</h2>\n<dl>\n{lines}\n</dl>\n</section>\n'
    return head + body + "".join(done) + words + footer + end
