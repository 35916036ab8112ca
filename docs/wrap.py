"""Wrap the prose of hand-written pages at 120 characters: ``python docs/wrap.py`` rewrites those that need it.

Tables, blocks of code, headings and comments stay as they are, and so does all that stands between two marks of a page,
which a program writes. A test asks that nothing is left to wrap.
"""

from __future__ import annotations

import re
import textwrap
from pathlib import Path

DOCS = Path(__file__).resolve().parent
WIDTH = 120
#: pages that programs write; their width is the programs' business
MADE = ("effects.md", "estimator-accuracy.md", "golf-throws.md", "paper.md", "performance.md", "real-diagnosis.md")
MADE += ("real-recordings.md", "thresholds.md")
_ITEM = re.compile(r"^(\s*)([-*+]|\d+\.)(\s+)")
#: lines that stand as they are: tables, headings, comments, HTML, figures, options of the reference, definitions
_KEPT = re.compile(r"^\s*(\||#|<|!\[|:::|\[\^)")


def pages() -> list[Path]:
    """Return the hand-written pages."""
    return [page for page in sorted(DOCS.rglob("*.md")) if page.name not in MADE]


def wrapped(text: str) -> str:
    """Return a page with each paragraph that has a line of more than `WIDTH` characters filled anew."""
    done: list[str] = []
    paragraph: list[str] = []
    fence, marked = "", ""

    def close() -> None:
        if any(len(line) > WIDTH for line in paragraph):
            done.extend(_filled(paragraph))
        else:
            done.extend(paragraph)
        paragraph.clear()

    for line in text.split("\n"):
        opened = re.match(r"^\s*(```|~~~)", line)
        mark = re.match(r"^<!-- (/?)([\w-]+)(: (begin|end))? -->$", line)
        if mark and not fence:
            close()
            name = mark[2]
            marked = "" if mark[1] or mark[4] == "end" else name if f"<!-- /{name} -->" in text or mark[4] else marked
            done.append(line)
        elif fence or opened or marked or not line.strip() or _KEPT.match(line) or line.startswith("    "):
            close()
            if opened:
                fence = "" if fence else opened[1]
            done.append(line)
        else:
            if _ITEM.match(line):
                close()
            paragraph.append(line)
    close()
    return "\n".join(done)


def _filled(lines: list[str]) -> list[str]:
    """Return the lines of one paragraph or item at the width, code in it never broken."""
    first = _ITEM.match(lines[0])
    indent = " " * (first.end() if first else len(lines[0]) - len(lines[0].lstrip()))
    head = lines[0][: first.end()] if first else indent
    body = " ".join([lines[0][first.end() if first else 0 :].strip(), *(line.strip() for line in lines[1:])])
    held = re.sub(r"`[^`]+`|\]\([^)]*\)", lambda found: found[0].replace(" ", "\0"), body)
    filled = textwrap.wrap(held, WIDTH - len(indent), break_long_words=False, break_on_hyphens=False)
    lines = [(head if k == 0 else indent) + line.replace("\0", " ") for k, line in enumerate(filled)]
    # a line that begins like a list or a heading would become one
    assert not any(_ITEM.match(line.strip()) or line.strip().startswith("#") for line in lines[1:]), lines
    return lines


if __name__ == "__main__":
    for page in pages():
        text = page.read_text(encoding="utf-8")
        if (new := wrapped(text)) != text:
            page.write_text(new, encoding="utf-8")
            print(page.relative_to(DOCS))
