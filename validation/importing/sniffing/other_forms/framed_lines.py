"""Lines that stand between marks (`$1,2,3#`, `<1,2,3>`, `IMU: 1,2,3;`), as firmware frames what it sends: taken off.

A mark beside a number makes its cell none: the first and last column were lost, and their neighbours taken for theirs.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.labelled import labelled_cells, split_stamp
from discsim.validation.importing.sniffing.other_forms.written import (
    FEWEST,
    FIRST_ROWS,
    NUMBER,
    first_lines,
    rewrite_lines,
)
from discsim.validation.importing.vectornav import BEGINS

__all__ = ["begins", "write_tables"]

#: Marks before a line and behind it; there also a checksum as of NMEA's sentences (`*5A`).
_BEFORE, _BEHIND = "$<{*!#@%&~^>", ">}*;!#$&%@~^"
_CHECKSUM = re.compile(r"\*[0-9A-Fa-f]{2}")
#: A name before all of a line's numbers: `IMU: 1,2,3`.
_NAME = re.compile(r"[^\W\d][^,;:=\t|]*[:=]\s*")
_PARTS = re.compile(r"\s*[,;\t|]\s*|\s+")
_CELL = re.compile(rf"{NUMBER}|[^\W\d]\w*")
#: The sensors of the attitude reference system for Razor boards, which prints `#A-C=1,2,3` (R: raw, C: calibrated).
_RAZOR = {"A": "Accel", "M": "Mag", "G": "Gyro"}
_OF_RAZOR = re.compile(r"([AMG])-([RC])=")
#: The fewest numbers in a line with a name before them: three are the axes of a sensor, whose name is then needed.
_NUMBERS = 4
#: The share of lines, from the first framed one on, that are framed alike: others are what a board prints as it starts.
_SHARE = 0.9


class _Frame(NamedTuple):
    """What stands about the numbers of a line: marks before and behind, a name."""

    before: str
    name: str
    behind: str

    @property
    def text(self) -> str:
        """How it is told of."""
        begins = f"{self.before}{self.name}".strip()
        return " and ".join(f"'{mark}'" for mark in (begins, self.behind) if mark)


def begins(path: Path) -> bool:
    """Tell a text whose first lines stand between the same marks, or behind the same name, with numbers in between."""
    return _frame(path) is not None


def _frame(path: Path) -> _Frame | None:
    """Return the frame of a text's lines; None where they have none."""
    _, lines = first_lines(path)
    framed = list(map(_taken_off, islice((line for line in lines if line.strip()), FIRST_ROWS)))
    first = next((k for k, one in enumerate(framed) if one is not None), len(framed))
    frames = Counter(one[0] for one in framed[first:] if one is not None)
    if not frames:
        return None
    frame, count = frames.most_common(1)[0]
    return frame if count >= max(FEWEST, _SHARE * (len(framed) - first)) else None


def _taken_off(line: str) -> tuple[_Frame, str] | None:
    """Return the frame of a line of numbers, and the line without it; None where it has none, or no numbers.

    VectorNav's sentences are read by their names, with their checksums.
    """
    stamp, text = split_stamp(line)
    text = text.strip()
    if text.startswith(BEGINS):
        return None
    inner = text.lstrip(_BEFORE)
    before = text[: len(text) - len(inner)]
    behind = inner[-3:] if _CHECKSUM.fullmatch(inner[-3:]) else inner[len(inner.rstrip(_BEHIND)) :]
    middle = inner.removesuffix(behind).strip()
    if behind == ";" and ";" in middle:
        behind = ""  # a separator behind the last cell
    middle = _OF_RAZOR.sub(lambda razor: f"{_RAZOR[razor[1]]}{' raw' * (razor[2] == 'R')}: ", middle)
    name = found[0] if (found := _NAME.match(middle)) is not None else ""
    cells = [cell for cell in _PARTS.split(middle[len(name) :]) if cell]
    numbers = sum(re.fullmatch(NUMBER, cell) is not None for cell in cells)
    if not all(map(_CELL.fullmatch, cells)) or 2 * numbers < len(cells) or numbers < 3:
        return None
    if name and numbers < _NUMBERS:
        name = ""  # a sensor's: its cells have their names before them
    if not before and not name and (not behind or labelled_cells(middle)):
        return None
    frame = _Frame(before, name, "*" if behind.startswith("*") else behind)
    return frame, f"{stamp}{middle[len(name) :]}"


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the lines without their frame, and return what to say.

    A line that is not framed so stays as it is, but for the marks about a line of names. Raises `InputError` where the
    file cannot be read.
    """
    frame = _frame(raw)
    if frame is None:
        raise InputError.at(raw, None, "has no framed lines any more; expected the file that it was")
    rewrite_lines(raw, target, lambda lines: _bare(lines, frame))
    return [f"{raw.name}: its lines stand between marks ({frame.text}); they are taken off"]


def _bare(lines: Iterable[str], frame: _Frame) -> Iterator[str]:
    """Yield lines without their frame."""
    for line in lines:
        found = _taken_off(line)
        if found is not None and found[0] == frame:
            yield found[1]
        else:
            yield line.strip().removeprefix(frame.before).removesuffix(frame.behind)
