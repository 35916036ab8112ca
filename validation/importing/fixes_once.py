"""A receiver's fixes in a faster log, where each stands until the next. Takes all rows; gives each fix once."""

from __future__ import annotations

import numpy as np

from discsim.validation.importing.import_map import ImportMap
from discsim.validation.importing.raw_table import RawTable, RepairList
from discsim.validation.rows.readings import Readings

__all__ = ["fixes_once"]


def fixes_once(
    readings: dict[str, Readings], tables: dict[str, RawTable], import_map: ImportMap, repairs: RepairList
) -> tuple[dict[str, Readings], list[str]]:
    """Return readings with each fix of a receiver once, where a log of other sensors writes it again until the next.

    That is so where most rows repeat the fix before to the last digit. They are told in the whole log: of a throw three
    fixes may be in it, which show no even spacing.
    """
    gps = readings.get("gps")
    faster = any(tables[sensor] is tables["gps"] for sensor in readings if sensor != "gps") if gps else False
    if gps is None or not faster or import_map.sensors["gps"].time is not None:
        return readings, []
    known = np.isfinite(gps.value[:, :3]).any(axis=1)
    before, after = gps.value[:-1], gps.value[1:]
    same = np.all((before == after) | (np.isnan(before) & np.isnan(after)), axis=1)
    fresh = np.concatenate([[True], ~same]) & known
    count, rows = np.count_nonzero(fresh), fresh.size
    if not 1 < count < rows / 2:
        return readings, []
    table = tables["gps"]
    line = table.line_of(gps.number[np.argmin(fresh)])
    what = "gps: a fix stands on many rows"
    repairs.add(None, table.path, line, what, f"{rows - count} rows left out of gps, the first here")
    said = f"gps: {count} fixes in {rows} rows: the log is faster than the receiver; the rows that repeat a fix, or "
    return {**readings, "gps": gps.select(fresh)}, [f"{said}hold none, are left out: a fix bears its first row's time"]
