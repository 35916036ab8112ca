"""Axes below a line that names their sensor (`Gyroscope`, then `X: 1 Y: 2 Z: 3`): the name is put before each.

Without it the sensors, which have the same names, were taken for one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

from discsim.validation.importing.labelled import split_stamp
from discsim.validation.importing.sniffing.names import sensor_of
from discsim.validation.importing.sniffing.other_forms.written import (
    FIRST_ROWS,
    NUMBER,
    first_lines,
    rewrite_lines,
)
from discsim.validation.importing.sniffing.units import split_unit

__all__ = ["begins", "write_tables"]

_AXIS = re.compile(rf"\s*[xyzXYZ]\s*[:=]\s*{NUMBER}")
#: A name alone, between marks of any kind: `--- Gyroscope (deg/s): ---`.
_HEAD = re.compile(r"[^\w]*([^\W\d][^\d:=]*?)[\s:=*#-]*")
#: Lines under a name among the first ones without which nothing is joined: two records of two sensors.
_FEWEST = 4


def begins(path: Path) -> bool:
    """Tell a text in which lines of axes stand below the names of two sensors or more."""
    _, lines = first_lines(path)
    heads = [head for head, _ in islice(_headed(lines), FIRST_ROWS) if head]
    return len(heads) >= _FEWEST and len(set(heads)) > 1


def _headed(lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield the name of the sensor that stands above a line's axes, empty where none does, and the line with it.

    A line of a name alone is not yielded; what a serial monitor put before a line stays there.
    """
    owner = ""
    for line in lines:
        stamp, text = split_stamp(line)
        if _AXIS.match(text):
            yield owner, f"{stamp}{owner} {text.strip()}" if owner else line
            continue
        found = _HEAD.fullmatch(text.strip())
        owner = found[1] if found is not None and sensor_of(split_unit(found[1])[0]) is not None else ""
        if not owner:
            yield "", line


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the lines with the names before their axes, and return what to say.

    Raises `InputError` where the file cannot be read.
    """
    named: dict[str, None] = {}

    def joined(lines: Iterable[str]) -> Iterator[str]:
        for owner, line in _headed(lines):
            named.update({owner: None} if owner else {})
            yield line

    rewrite_lines(raw, target, joined)
    return [f"{raw.name}: the names of its sensors stand above their axes ({', '.join(named)}); put before them"]
