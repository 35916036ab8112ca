"""Axes below a line that names their sensor (`Gyroscope`, then `X: 1 Y: 2 Z: 3`): the name is put before each.

Without it the sensors, which have the same names, were taken for one.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.labelled import stamped
from discsim.validation.importing.sniffing.names import sensor_of
from discsim.validation.importing.sniffing.other_forms.written import (
    FIRST_ROWS,
    NUMBER,
    encoding_of,
    first_bytes,
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
    head = first_bytes(path, 1 << 16)
    if b"\0" in head:
        return False
    lines = head.decode(encoding_of(head), "replace").splitlines()
    heads = [head for head, _ in islice(_headed(lines), FIRST_ROWS) if head]
    return len(heads) >= _FEWEST and len(set(heads)) > 1


def _headed(lines: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Yield each line with the name of the sensor that stands above its axes, empty where none does.

    A line of a name alone is not yielded; what a serial monitor put before a line stays there.
    """
    owner = ""
    for line in lines:
        begun = stamped(line)
        text = line if begun is None else begun[2]
        if _AXIS.match(text):
            yield owner, line
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
    try:
        encoding = encoding_of(first_bytes(raw, 1 << 16))
        with raw.open(encoding=encoding, errors="replace") as lines, target.open("w", encoding="utf-8") as written:
            for owner, line in _headed(line.rstrip("\n") for line in lines):
                text = line if not owner or (begun := stamped(line)) is None else begun[2]
                written.write(f"{line[: len(line) - len(text)]}{owner}{' ' * bool(owner)}{text.strip()}\n")
                named |= dict.fromkeys([owner] if owner else [])
    except OSError as error:
        raise InputError.at(raw, None, f"cannot be read ({error}); expected lines of text") from None
    return [f"{raw.name}: the names of its sensors stand above their axes ({', '.join(named)}); put before them"]
