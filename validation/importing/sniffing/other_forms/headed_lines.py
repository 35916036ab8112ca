"""Axes below a line that names their sensor (`Gyroscope`, then `X: 1 Y: 2 Z: 3`): the name is put before each.

They may stand without names of their own (`[IMUGyro]:`, then `1 2 3`), also one below the other. Without the name the
sensors were taken for one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import NamedTuple

from discsim.validation.importing.labelled import split_stamp
from discsim.validation.importing.sniffing.names import is_time_name, sensor_of
from discsim.validation.importing.sniffing.other_forms.written import (
    FIRST_ROWS,
    NUMBER,
    first_lines,
    rewrite_lines,
)
from discsim.validation.importing.sniffing.units import split_unit

__all__ = ["begins", "write_tables"]

_AXIS = re.compile(rf"\s*[xyzXYZ]\s*[:=]\s*{NUMBER}")
#: A name alone, between marks of any kind: `--- Gyroscope (deg/s): ---`, `[IMUGyro]:`.
_HEAD = re.compile(r"[^\w]*([^\W\d][^\d:=]*?)(?<!\])\]?[\s:=*#-]*")
#: One number to three on a line, between brackets perhaps, and a time beside its name: `[Time]: 120`.
_NUMBERS = re.compile(rf"[(\[<]?\s*({NUMBER}(?:(?:\s*[,;]\s*|\s+){NUMBER}){{0,2}})\s*[)\]>]?[,;]?")
_TIME = re.compile(rf"\W*([^\W\d][\w ()]*?)\]?\s*[:=]\s*({NUMBER})(?:\s*([mun]?s))?\s*")
#: Lines under a name among the first ones without which nothing is joined: two records of two sensors.
_FEWEST = 4
#: Numbers of a sensor, and what parts them.
_AXES = 3
_PARTS = re.compile(r"\s*[,;]\s*|\s+")


def begins(path: Path) -> bool:
    """Tell a text in which lines of axes stand below the names of two sensors or more, or bare numbers below each."""
    _, lines = first_lines(path)
    found = list(islice(_headed(lines), FIRST_ROWS))
    heads = [line.owner for line in found if line.owner]
    bare = sum(line.bare for line in found)
    return len(heads) >= _FEWEST and (len(set(heads)) > 1 or bare >= _FEWEST)


class _Line(NamedTuple):
    """A line with the name of the sensor put before its axes; empty where none does, and whether its axes are bare."""

    owner: str
    text: str
    bare: bool = False


def _headed(lines: Iterable[str]) -> Iterator[_Line]:
    """Yield each line with the name of the sensor that stands above its axes.

    A line of a name alone is not yielded; what a serial monitor put before a line stays there. Bare numbers are the
    sensor's as far as there are three of them: a heading above a table is none of these names.
    """
    owner, held = "", list[str]()
    for line in lines:
        stamp, text = split_stamp(line)
        if _AXIS.match(text):
            yield _Line(owner, f"{stamp}{owner} {text.strip()}" if owner else line)
            continue
        bare = _NUMBERS.fullmatch(text.strip())
        if owner and bare is not None:
            held += _PARTS.split(bare[1])
            if len(held) >= _AXES:
                yield _Line(owner, f"{stamp}{owner}: {', '.join(held)}", len(held) == _AXES)
                owner, held = "", []
            continue
        found = _HEAD.fullmatch(text.strip())
        owner = found[1] if found is not None and sensor_of(split_unit(found[1])[0]) is not None else ""
        held = []
        if not owner:
            timed = _TIME.fullmatch(text)
            known = timed is not None and is_time_name(timed[1])
            yield _Line("", f"{stamp}{timed[1]}: {timed[2]} {timed[3] or ''}" if timed and known else line)


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the lines with the names before their axes, and return what to say.

    Raises `InputError` where the file cannot be read.
    """
    named: dict[str, None] = {}

    def joined(lines: Iterable[str]) -> Iterator[str]:
        for line in _headed(lines):
            named.update({line.owner: None} if line.owner else {})
            yield line.text

    rewrite_lines(raw, target, joined)
    return [f"{raw.name}: the names of its sensors stand above their axes ({', '.join(named)}); put before them"]
