"""What `rostopic echo` and `ros2 topic echo` print: messages as YAML, one below the other, parted by `---`.

Takes such a file; gives a table with a row for each message. Nested names are joined (`angular_velocity_x`), lists and
texts are left out, and a header's seconds and nanoseconds are one time. Units are those of ROS (REP 103).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.sniffing.other_forms.written import (
    FEWEST,
    NUMBER,
    check_size,
    comma_separated,
    first_lines,
    joined_time,
    write_named,
)

__all__ = ["begins", "write_tables"]

_MAX_BYTES = 1 << 29
_LINE = re.compile(r"(\s*)([A-Za-z_]\w*):\s*(.*)")
_NUMBER = re.compile(NUMBER)
_PART = "---"
#: The two parts of a time, ROS 1's and ROS 2's.
_SECONDS, _NANOS = ("secs", "sec"), ("nsecs", "nanosec")
#: What messages of sensors hold, and its unit (REP 103 and sensor_msgs).
_UNITS = {"angular_velocity": "rad/s", "linear_acceleration": "m/s^2", "magnetic_field": "T"}


def begins(path: Path) -> bool:
    """Tell a file whose first lines are a message's header, a stamp in it, and names with numbers below."""
    _, lines = first_lines(path)
    named = [_LINE.fullmatch(line) for line in lines if line.strip() and line.strip() != _PART]
    names = [line[2] for line in named[:40] if line is not None]
    return "header" in names[:2] and "stamp" in names and not {*_NANOS}.isdisjoint(names) and any(_UNITS.keys() & names)


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the messages of a file as ``target`` and return what to say of them.

    Raises `InputError` for a file that is too large and one that holds too few messages.
    """
    check_size(raw, "text of ROS", _MAX_BYTES)
    encoding, _ = first_lines(raw)
    rows = list(_messages(raw.read_text(encoding, errors="replace")))
    if len(rows) < FEWEST:
        raise InputError.at(raw, None, f"holds {len(rows)} messages of ROS; expected {FEWEST} at least")
    names = list(dict.fromkeys(name for row in rows for name in row))
    header = [f"{name} [{unit}]" if (unit := _unit(name)) else name for name in names]
    write_named(target, {raw.stem: comma_separated([header, *([row.get(name, "") for name in names] for row in rows)])})
    return [f"{raw.name}: {len(rows)} messages of ROS as `rostopic echo` prints them, read as a table"]


def _messages(text: str) -> Iterator[dict[str, str]]:
    """Yield the numbers of each message by their names, its time first; a message without a time is left out."""
    row: dict[str, str] = {}
    above: list[tuple[int, str]] = []
    for line in [*text.splitlines(), _PART]:
        if line.strip() == _PART:
            if (message := _timed(row)) is not None:
                yield message
            row, above = {}, []
        elif (match := _LINE.fullmatch(line)) is not None:
            depth = len(match[1])
            above = [one for one in above if one[0] < depth]
            if _NUMBER.fullmatch(value := match[3].strip()):
                row["_".join([*(name for _, name in above), match[2]])] = value
            elif not value:
                above.append((depth, match[2]))


def _timed(row: dict[str, str]) -> dict[str, str] | None:
    """Return a message with one time in the place of the two parts of its header's stamp; None where it has none."""
    ends = [(f"header_stamp_{one}", f"header_stamp_{other}") for one, other in zip(_SECONDS, _NANOS, strict=True)]
    pair = next((pair for pair in ends if set(pair) <= set(row)), None)
    time = "" if pair is None else joined_time(row[pair[0]], row[pair[1]])
    if pair is None or not time:
        return None
    rest = {name: value for name, value in row.items() if name not in pair}
    return {"time_s": time} | rest


def _unit(name: str) -> str | None:
    return next((unit for quantity, unit in _UNITS.items() if name.rpartition("_")[0].endswith(quantity)), None)
