"""Tables whose time stands in two columns, whole seconds and nanoseconds (`stamp.secs, stamp.nsecs`), as ROS has it.

Takes such a table; gives it with one column of time in front. Where another column of time stands beside the two it is
a table as it is.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from discsim.errors import InputError
from discsim.validation.importing.sniffing.names import is_time_name
from discsim.validation.importing.sniffing.other_forms.written import (
    all_rows,
    comma_separated,
    first_rows,
    joined_time,
    write_named,
)

__all__ = ["begins", "write_tables"]

_SECONDS = re.compile(r"(.*?)(?:secs?|seconds)\d?", re.IGNORECASE)
_NANOS = re.compile(r"(.*?)(?:nsecs?|nanosecs?|nanoseconds|nanos)\d?", re.IGNORECASE)
#: Rows below the names without which two columns are not told to be the parts of a time.
_FEWEST = 3


class _Layout(NamedTuple):
    encoding: str
    separator: str
    seconds: int
    nanos: int


def begins(path: Path) -> bool:
    """Tell a table with seconds and nanoseconds in whole numbers, and no other time."""
    return _layout(path) is not None


def _layout(path: Path) -> _Layout | None:
    for encoding, separator, (header, *rows) in first_rows(path):
        names = [name.strip() for name in header]
        nanos = {match[1]: k for k, name in enumerate(names) if (match := _NANOS.fullmatch(name)) is not None}
        for k, name in enumerate(names):
            match = _SECONDS.fullmatch(name)
            if match is None or match[1] not in nanos or k in nanos.values() or len(rows) < _FEWEST:
                continue
            other = nanos[match[1]]
            whole = all(row[k].strip().isdecimal() and row[other].strip().isdecimal() for row in rows)
            others = [one for j, one in enumerate(names) if j not in (k, other) and is_time_name(one)]
            if whole and not others and any(len(row[other].strip()) > 6 for row in rows):
                return _Layout(encoding, separator, k, other)
    return None


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write a table with one time in the place of two and return what to say; a row without both has none.

    Raises `InputError` for a table that is too large.
    """
    layout = _layout(raw)
    if layout is None:
        raise InputError.at(raw, None, "has no seconds and nanoseconds any more; expected the file that it was")
    names, *rows = all_rows(raw, layout.encoding, layout.separator)
    pair = (layout.seconds, layout.nanos)

    def joined(row: list[str]) -> list[str]:
        seconds, nanos = (row[k].strip() if k < len(row) else "" for k in pair)
        return [joined_time(seconds, nanos), *(cell for k, cell in enumerate(row) if k not in pair)]

    kept = [name for k, name in enumerate(names) if k not in pair]
    write_named(target, {raw.stem: comma_separated([["time_s", *kept], *map(joined, rows)])})
    told = " and ".join(f"'{names[k].strip()}'" for k in pair)
    return [f"{raw.name}: the time stands in two columns, {told}; read as one"]
