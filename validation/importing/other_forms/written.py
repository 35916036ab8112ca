"""Tables as files: one as the file that was asked for, several as a folder of that name."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

__all__ = ["comma_separated", "write_named"]


def comma_separated(rows: Iterable[Sequence[str]]) -> str:
    """Return rows of cells as comma-separated text."""
    written = io.StringIO()
    csv.writer(written, lineterminator="\n").writerows(rows)
    return written.getvalue()


def write_named(target: Path, texts: Mapping[str, str]) -> None:
    """Write a table's text as ``target``, several as files in a folder of that name, by their own names."""
    if len(texts) == 1:
        target.write_text(next(iter(texts.values())), encoding="utf-8")
        return
    target.mkdir()
    for name, text in texts.items():
        plain = re.sub(r"[^\w.-]+", "-", name)
        (target / f"{plain}.csv").write_text(text, encoding="utf-8")
