"""GPX tracks of a satellite receiver, a watch or a phone as a table of positions.

A `trkpt` has latitude and longitude in degrees (WGS 84), its `ele` the height above the sea in m, its `time` is UTC, as
the schema has it (topografix.com/GPX/1/1). Version 1.1 has no place for a speed or a course.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree.ElementTree import Element, iterparse

import numpy as np

from discsim.files import BLOCK
from discsim.validation.importing.logs.tables import Log, Rows, chosen
from discsim.validation.importing.stamps import iso_seconds

__all__ = ["begins", "read"]


def begins(head: bytes) -> bool:
    """Tell XML whose first element is a gpx."""
    start = head.lstrip(b"\xef\xbb\xbf \t\r\n")
    return start.startswith((b"<?xml", b"<gpx")) and b"<gpx" in head


def read(raw: Path) -> Log:
    """Return the points of all tracks in the order in which they stand; those without a time are left out and counted.

    Times are seconds since 2000 (UTC), as those of a log that writes dates. Raises `ValueError` for a document that
    declares entities, and what the parser raises for XML that is damaged.
    """
    rows = Rows()
    timeless = 0
    others: set[str] = set()
    for point in _points(raw):
        cells = {_name(part): part.text or "" for part in point}
        time = iso_seconds(cells.get("time", ""))
        others |= {_name(part) for part in point.iter()} & {"speed", "course", "heading"}
        if time is None:
            timeless += 1
            continue
        place = [_number(cell) for cell in (point.get("lat"), point.get("lon"), cells.get("ele"))]
        rows.add("GPX", "gps", 1e6 * time, (*place, np.nan, np.nan, np.nan))
    tables, _ = chosen(rows.sources())
    notes = [f"{timeless} points of the track have no time; they are left out"] * (timeless > 0)
    notes += ["gps: a track of GPX holds no velocity north, east and down; it is a gap"] * bool(tables)
    left = f"gps: {', '.join(sorted(others))} left out: a recording holds the velocity north, east and down"
    notes += [left] * bool(others)
    return Log(tables, tuple(notes), dated=True)


def _points(raw: Path) -> Iterator[Element]:
    with raw.open("rb") as stream:
        if b"<!DOCTYPE" in stream.read(BLOCK).partition(b"<gpx")[0]:  # an entity in it may stand for gigabytes
            raise ValueError("it declares a document type, as no receiver does")
        stream.seek(0)
        for _, element in iterparse(stream):
            if _name(element) == "trkpt":
                yield element
                element.clear()


def _name(element: Element) -> str:
    return element.tag.rpartition("}")[2]


def _number(text: str | None) -> float:
    try:
        return float(text or "nan")
    except ValueError:
        return float("nan")
