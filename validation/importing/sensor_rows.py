"""The rows of one sensor in a raw table, as numbers in the recording's unit and axes; every damaged cell is listed."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Sequence

import numpy as np

from discsim.arrays import BoolArray, FloatArray, IntArray
from discsim.errors import InputError
from discsim.limits import LARGEST_READING
from discsim.recording import SENSORS
from discsim.validation.importing.cell_texts import CellTexts, number
from discsim.validation.importing.import_map import ImportMap, SensorMap
from discsim.validation.importing.logs.tables import positions
from discsim.validation.importing.raw_table import RawTable, RepairList
from discsim.validation.importing.row_clock import RowClock
from discsim.validation.importing.unsigned import signed
from discsim.validation.rows.held import come_evenly
from discsim.validation.rows.readings import Readings

__all__ = ["chosen_rows", "hollow_rows", "sensor_rows"]

#: A name that says feet: altitude (ft), alt_ft, GPS Alt [feet].
_FEET = re.compile(r"(?<![a-z])(?:ft|feet|foot)(?![a-z])", re.IGNORECASE)

#: Least share of rows that are empty where every second one is: some readings at the start may stand on all.
NEARLY_HALF = 0.45


def chosen_rows(table: RawTable, sensor_map: SensorMap, hollow: BoolArray) -> int:
    """Return how many rows of a table are a sensor's; in ``hollow`` ones (n,) nothing of it stands."""
    if sensor_map.time is not None:
        return len(table)
    if sensor_map.where is None:
        return table.total - int(np.count_nonzero(hollow))
    return int(np.count_nonzero(table.column(sensor_map.where[0]).equal(sensor_map.where[1]) & ~hollow))


def hollow_rows(table: RawTable, names: Sequence[str], sensor_map: SensorMap, decimal: str) -> BoolArray:
    """Tell the rows (n,) of a faster log in which all cells of a slower sensor are empty.

    A sensor is slower where that is so in most of its rows, or in every second one; gaps of one that is as fast as the
    log are no such rows.
    """
    here = np.ones(len(table), dtype=np.bool_)
    if sensor_map.where is not None:
        here &= table.column(sensor_map.where[0]).equal(sensor_map.where[1])
    hollow, all_of_it = here.copy(), np.count_nonzero(here)
    for name in names:
        value, wrong = table.column(name).numbers(decimal)
        hollow &= np.isnan(value) & ~wrong
        if np.count_nonzero(hollow) < NEARLY_HALF * all_of_it:
            return np.zeros_like(here)
    slower = np.count_nonzero(hollow) > all_of_it / 2 or come_evenly(hollow[here])
    return hollow if slower and np.count_nonzero(hollow) < all_of_it else np.zeros_like(here)


def sensor_rows(
    table: RawTable,
    sensor: str,
    names: list[str],
    sensor_map: SensorMap,
    import_map: ImportMap,
    clock: RowClock,
    cut: slice | None,
    repairs: RepairList,
) -> Readings:
    """Return the rows of one sensor that hold numbers and whose time ascends, of one stretch of the clock.

    ``names`` are its columns, ``cut`` the rows that are asked for: of a clock that starts anew the stretch with most of
    them is taken, with all its rows. Raises `InputError` for damage that the map does not allow to repair.
    """
    here = clock.known
    if sensor_map.where is not None:
        here &= table.column(sensor_map.where[0]).equal(sensor_map.where[1])
    if clock.starts and here.any():
        wanted = np.zeros(table.total, dtype=np.bool_)
        wanted[slice(None) if cut is None else cut] = True
        counted = here & wanted[table.number]
        counted[np.argmax(here)] |= not counted.any()
        here &= clock.stretch == clock.longest(counted)
    rows = np.flatnonzero(here)
    value, sound = _values(table, rows, sensor, names, import_map, repairs)
    if (meant := signed(value)) is not None:
        line = int(table.line[rows[int(np.argmax(np.any(meant != value, axis=1)))]])
        what = f"{sensor}: counts of 16 bits without their sign"
        repairs.add(None, table.path, line, what, f"65536 taken off where {sensor} is above 32767")
        value = meant
    kept = np.flatnonzero(sound)
    kept = kept[_ascending(table, rows[kept], clock.time[rows[kept]], repairs)]
    read = sensor_map.factor * value[kept]
    if len(SENSORS[sensor].columns) == 3:
        unseen = np.full(len(kept), np.nan)
        # + 0.0 turns the -0.0 of a reversed zero into 0.0
        columns = [unseen if axis is None else axis[1] * read[:, axis[0]] + 0.0 for axis in sensor_map.axes]
        read = np.column_stack(columns)
    elif sensor == "gps":
        read = _fixes(read, sensor_map)
        if sensor_map.degrees and sensor_map.height is None and _FEET.search(names[2]):
            what = f"the height's column '{names[2]}' is in feet by its name, and the map takes it for m"
            remedy = 'write height_unit = "ft" below [sensors.gps] of the map, or "m" where the name is wrong'
            raise InputError.at(import_map.path, None, f"{what}; {remedy}")
    if sensor_map.offset:
        return Readings(table.number[rows[kept]], clock.time[rows[kept]] + sensor_map.offset, read)
    if kept.size == len(table):  # sensors of one table share what they have in common
        return Readings(table.number, clock.time, read)
    return Readings(table.number[rows[kept]], clock.time[rows[kept]], read)


def _fixes(read: FloatArray, sensor_map: SensorMap) -> FloatArray:
    """Return positions and velocities (n, 6) of a GPS's columns (n, 3) or (n, 6), in North-East-Down, m and m/s.

    Of degrees the place is that from the first fix; zeros in all of latitude, longitude and height are no fix.
    """
    fixes = np.column_stack([read, np.full((len(read), 6 - read.shape[1]), np.nan)])
    fixes[:, 3:] *= sensor_map.speed
    if not sensor_map.degrees:
        return np.asarray(fixes)
    fixes[:, :2] *= sensor_map.degrees
    fixes[:, 2] *= sensor_map.height or 1.0
    fixes[np.all(fixes[:, :2] == 0.0, axis=1)] = np.nan
    return positions(fixes)


def _values(
    table: RawTable, rows: IntArray, sensor: str, names: list[str], import_map: ImportMap, repairs: RepairList
) -> tuple[FloatArray, BoolArray]:
    """Return a sensor's readings (n, k) in some rows (n,) as written, NaN for gaps, and which rows hold no other text.

    A column that is empty in every row is listed once.
    """
    decimal, factor = import_map.layout.decimal, import_map.sensors[sensor].factor
    value = np.empty((rows.size, len(names)))
    hollow = set()
    odd = np.zeros(rows.size, dtype=np.bool_)
    for k, name in enumerate(names):
        column = CellTexts(table.column(name).cells[rows])
        if rows.size and np.all(column.equal("")):
            hollow.add(name)
            what = f"'{name}' is empty in every row"
            repairs.add("number", table.path, int(table.line[rows[0]]), what, "gaps throughout")
        value[:, k], _ = column.numbers(decimal)
        with np.errstate(invalid="ignore"):
            odd |= ~(np.abs(value[:, k] * factor) <= LARGEST_READING) & (name not in hollow)
    sound = np.ones(rows.size, dtype=np.bool_)
    for row in np.flatnonzero(odd).tolist():
        found = _value(table, int(rows[row]), sensor, names, hollow, import_map, repairs)
        sound[row] = found is not None
        value[row] = np.nan if found is None else found
    return value, sound


def _value(
    table: RawTable,
    row: int,
    sensor: str,
    names: list[str],
    hollow: set[str],
    import_map: ImportMap,
    repairs: RepairList,
) -> list[float] | None:
    """Return a row's readings of a sensor, NaN for gaps; None where a cell is no number. Each is listed."""
    factor, line = import_map.sensors[sensor].factor, int(table.line[row])
    value = []
    for name in names:
        cell = table.column(name)[row]
        reading = number(cell, import_map.layout.decimal)
        if reading is None:
            what = f"'{name}' is '{cell[:40]}', no number"
            repairs.add("number", table.path, line, what, f"row left out of {sensor}")
            return None
        if np.isnan(reading) and name not in hollow:
            what = f"'{cell[:40]}'" if cell else "empty"
            repairs.add("number", table.path, line, f"'{name}' is {what}", "gap")
        elif abs(reading * factor) > LARGEST_READING:
            what = f"'{name}' is '{cell[:40]}', more than {LARGEST_READING:g} in the {sensor}'s unit"
            repairs.add("number", table.path, line, what, "gap")
            reading = float("nan")
        value.append(reading)
    return value


def _ascending(table: RawTable, rows: IntArray, times: FloatArray, repairs: RepairList) -> IntArray:
    """Return the indices to keep of times (n,) s of rows (n,) so that time ascends strictly and the fewest are lost."""
    if np.all(np.diff(times) > 0):
        return np.arange(times.size)
    # longest strictly ascending subsequence; of two equal stamps the first stays
    ends: list[float] = []
    chain: list[int] = []
    before: list[int] = []
    for index, time in enumerate(times.tolist()):
        place = bisect_left(ends, time)
        before.append(chain[place - 1] if place else -1)
        if place == len(ends):
            ends.append(time)
            chain.append(index)
        elif time < ends[place]:
            ends[place], chain[place] = time, index
    kept = []
    index = chain[-1] if chain else -1
    while index >= 0:
        kept.append(index)
        index = before[index]
    kept.reverse()
    first = {times[index]: index for index in reversed(kept)}
    for index in np.setdiff1d(np.arange(times.size), kept).tolist():
        what = f"time {times[index]:.9g} s is out of order"
        if times[index] in first:
            again = int(rows[first[times[index]]])
            whole = table.cells(int(rows[index])) == table.cells(again)
            what = f"time {times[index]:.9g} s is doubled" + ", and so is the row" * whole
        repairs.add("time", table.path, int(table.line[rows[index]]), what, "row left out")
    return np.array(kept)
