"""From a raw logger file to a recording: columns, units, axes, time base, and a list of what was repaired."""

from __future__ import annotations

import csv
import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from pathlib import Path

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.clipping import clipping_notes
from discsim.disc import Release
from discsim.errors import InputError
from discsim.glitches import FASTEST_SPIN
from discsim.limits import time_fault
from discsim.recording import SENSORS, Recording, Samples, SensorSheet
from discsim.validation.importing.apart import apart
from discsim.validation.importing.fixes_once import fixes_once
from discsim.validation.importing.import_map import ImportMap, SensorMap, TimeBase
from discsim.validation.importing.overflow import without_overflow
from discsim.validation.importing.raw_table import Layout, RawTable, Repair, RepairList, read_raw
from discsim.validation.importing.row_clock import RowClock, row_clock
from discsim.validation.importing.sensor_rows import chosen_rows, hollow_rows, sensor_rows
from discsim.validation.importing.wild import without_wild
from discsim.validation.rows.cleaning import cleaned, without_glitches
from discsim.validation.rows.even_rows import at_even_times
from discsim.validation.rows.failed import dead_axis, failed_at_once, failed_on_one_axis, on_all_axes
from discsim.validation.rows.readings import Readings
from discsim.validation.rows.timing import row_timing

__all__ = [
    "Imported",
    "RawReadings",
    "import_recording",
    "parse_rows",
    "read_readings",
    "recording_of",
    "repairs_csv",
]

#: Share of a sensor's rows that may be left out before the import says that the file is in a bad state.
MUCH_LOST = 0.05
#: A sensor's own rate is said to be another than the map's from this on, as of time stamps
#: (discsim.estimators.methods).
OTHER_RATE = 0.01
#: Share of rows that may come late before the import says so.
LATE_SHARE = 0.01
#: Time stamps are kept to this many decimals: what is below is rounding of the subtraction, not a clock.
TIME_DECIMALS = 9


@dataclass(frozen=True)
class Imported:
    """A recording from a raw file, what was repaired on the way, and what a user should know of it."""

    recording: Recording
    repairs: tuple[Repair, ...]
    notes: tuple[str, ...]

    @property
    def summary(self) -> str:
        """One line on the repairs."""
        if not self.repairs:
            return "repairs: none"
        counts = Counter(repair.action for repair in self.repairs)
        listed = ", ".join(f"{action} ({count})" for action, count in counts.most_common(6))
        return f"repairs: {len(self.repairs)} in repairs.csv: {listed}{', ...' * (len(counts) > 6)}"


def parse_rows(text: str) -> slice:
    """Return the slice that ``A:B`` means (either may be left out or count from the end); raises `InputError`."""
    start, colon, stop = text.partition(":")
    try:
        if not colon:
            raise ValueError
        return slice(int(start) if start.strip() else None, int(stop) if stop.strip() else None)
    except ValueError:
        raise InputError(f"--rows {text}: expected A:B, two whole numbers such as 1590:1830") from None


@dataclass(frozen=True)
class RawReadings:
    """All that a map finds in a raw file, before rows are chosen; ``main`` is the table whose rows are counted."""

    raw: Path
    import_map: ImportMap
    tables: dict[str, RawTable]
    main: RawTable
    readings: dict[str, Readings]
    repairs: tuple[Repair, ...]
    notes: tuple[str, ...]


def read_readings(raw: Path, import_map: ImportMap, rows: slice | None = None) -> RawReadings:
    """Read ``raw`` (a file, or a folder with one file per sensor) by a map.

    All rows are read; of a clock that starts anew in the file the longest stretch is kept (of ``rows`` if given).
    Raises `InputError`: no such file or column, a damage that the map does not allow to repair, nothing usable left.
    """
    repairs = RepairList(import_map.repairs)
    tables = _read_tables(raw, import_map, repairs)
    readings, notes = _read_sensors(raw, tables, import_map, rows, repairs)
    readings, said = fixes_once(readings, tables, import_map, repairs)
    notes += said
    readings, said = _without_failed(readings, import_map, tables, repairs)
    notes += said
    readings, said = without_wild(readings, tables, repairs)
    notes += said
    readings, said = _without_glitches(readings, tables, repairs)
    notes += said
    readings, import_map, said = _over_the_ends(readings, import_map, tables, repairs)
    notes += said
    # what was read as numbers is no longer needed as text
    emptied = {id(table): table.emptied() for table in tables.values()}
    tables = {sensor: emptied[id(table)] for sensor, table in tables.items()}
    notes += apart(readings)
    main = tables[next(iter(readings))]
    return RawReadings(raw, import_map, tables, main, readings, tuple(repairs.listed()), tuple(notes))


def import_recording(raw: Path, import_map: ImportMap, rows: slice | None = None) -> Imported:
    """Read ``raw`` by a map and return the recording of ``rows``: `read_readings`, then `recording_of`."""
    return recording_of(read_readings(raw, import_map, rows), rows)


def recording_of(read: RawReadings, rows: slice | None = None) -> Imported:
    """Return the recording of some rows of what was read.

    ``rows`` are 0-based data rows of the file of the map's first sensor, as numbered in that file: the header,
    comments and blank lines have no number, a row that was left out keeps its own. Sensors in other files are cut to
    the same span of time. Time zero is the first sample that is used. Raises `InputError`: rows out of range, or
    nothing usable among them.
    """
    raw, import_map, readings = read.raw, read.import_map, read.readings
    notes = list(read.notes)
    if rows is not None:
        whole, readings = readings, _cut(read, rows)
        notes += [f"no {sensor} in these rows" for sensor in whole if sensor not in readings]
    repairs = RepairList(import_map.repairs)
    rows_of = {sensor: (read.tables[sensor].path, import_map.sensors[sensor].time) for sensor in readings}
    readings, said = at_even_times(readings, rows_of)
    notes += said
    readings, rates, said = _fresh(raw, readings, import_map, read.tables, repairs)
    notes += said
    lone = [sensor for sensor, found in readings.items() if found.time.size == 1]
    unknown = [sensor for sensor in lone if len(lone) < len(readings) and not _has_rate(read, sensor)]
    notes += [f"no {sensor}: one row of it, which shows no rate; it is left out" for sensor in unknown]
    readings = {sensor: found for sensor, found in readings.items() if sensor not in unknown}
    zero = min(found.time[0] for found in readings.values())
    samples = {sensor: _samples(sensor, found, zero, read.tables[sensor].path) for sensor, found in readings.items()}
    # of a throw with one fix in it, the rate is that of the whole log
    alone = all(len(one) == 1 for one in samples.values())
    shown = {s: one.t if alone or len(one) > 1 else read.readings[s].time for s, one in samples.items()}
    release = _release(raw, import_map, readings)
    if release is None and (import_map.release is not None or import_map.throws):
        notes.append("no release conditions: the map has none for this file, or the first row is not used")
    if not import_map.environment.field_known and "magnetometer" in samples:
        notes.append(
            "magnetic field not known: zeros stand in recording.toml; --place LAT,LON --date YYYY-MM-DD looks it up, "
            "or give it in the map"
        )
    recording = Recording(
        import_map.plant,
        f"{import_map.name}-{raw.resolve().stem}",
        import_map.environment,
        import_map.disc,
        None,
        release,
        {
            sensor: _clocked(
                _sheet(import_map.sensors[sensor], shown[sensor], rates.get(sensor)),
                import_map.time_of(sensor),
            )
            for sensor in samples
        },
        samples,
    )
    listed = (*read.repairs, *repairs.listed())
    return Imported(recording, listed, (*notes, *clipping_notes(recording)))


def _samples(sensor: str, found: Readings, zero: float, path: Path) -> Samples:
    """Return a sensor's readings by the time since ``zero`` s; raises `InputError` for times that no recording has."""
    t = np.round(found.time - zero, TIME_DECIMALS)
    if np.any(np.diff(t) <= 0):
        raise InputError.at(
            path,
            None,
            f"the {sensor}'s {t.size} rows span {t[-1] - t[0]:.3g} s, less than a nanosecond from one to the next; "
            "expected stamps in the unit that the map states: name another unit in [time], or step_s",
        )
    if fault := time_fault(t):
        raise InputError.at(path, None, f"the {sensor}'s times: {fault[1]}; --rows A:B takes a part")
    return Samples(t, found.value[:, 0] if len(SENSORS[sensor].columns) == 1 else found.value)


def _read_sensors(
    raw: Path, tables: dict[str, RawTable], import_map: ImportMap, rows: slice | None, repairs: RepairList
) -> tuple[dict[str, Readings], list[str]]:
    """Return the sound rows of each sensor that is there, that of the first file first, and what to say of the rest."""
    notes: list[str] = []
    clocks: dict[tuple[Path, str | None, str], RowClock] = {}
    readings: dict[str, Readings] = {}
    first: tuple[Path, str | None] | None = None
    for sensor, sensor_map in import_map.sensors.items():
        table = tables.get(sensor)
        names = None if table is None else _columns(table, sensor_map, import_map.time_of(sensor))
        if table is None or names is None:
            notes.append(f"no {sensor} in it")
            continue
        base, its = import_map.time_of(sensor), import_map.laid_out(sensor)
        if sensor_map.time is not None:
            table = _own_rows(table, [*names, sensor_map.time])
        first = first or (table.path, sensor_map.time)
        cut = rows if first == (table.path, sensor_map.time) else None
        key = (table.path, sensor_map.time, "" if sensor_map.time is None else sensor)
        if key not in clocks:
            clocks[key] = row_clock(table, its, base, repairs)
            notes += _stretches(table, clocks[key], cut)
        clock = clocks[key]
        hollow = hollow_rows(table, names, sensor_map, its.layout.decimal)
        if hollow.any():
            clock = replace(clock, time=np.where(hollow, np.nan, clock.time))
        found = sensor_rows(table, sensor, names, sensor_map, its, clock, cut, repairs)
        notes += _slower(sensor, hollow)
        chosen = chosen_rows(table, sensor_map, hollow)
        lost = chosen - found.time.size
        if found.time.size == 0:
            raise InputError.at(table.path, None, f"no usable row of the {sensor}; expected numbers in {names}")
        if found.time.size == 1 and chosen > 2 and sensor_map.where is None:
            raise InputError.at(table.path, None, _no_time(sensor, chosen, base, clock))
        if lost > MUCH_LOST * chosen and not clock.starts:
            stamps = clock.time[clock.known]
            times = np.unique(stamps).size
            coarse = sensor_map.where is None and times < (1 - MUCH_LOST) * stamps.size
            why = (
                f"the file has {times} different times in {stamps.size} rows: rows stand twice, or the stamps are "
                "coarser than the rows (then write shared = true, or take another column, or step_s)"
                if coarse
                else repairs.told(table.path, sensor)
            )
            notes.append(f"WARNING: {lost} of the {sensor}'s {chosen} rows were left out; {why}")
        readings[sensor] = found
    if not readings:
        wanted = "; or ".join(_quoted(sensor_map.columns[0]) for sensor_map in import_map.sensors.values())
        raise InputError.at(
            raw, None, f"no sensor of the map '{import_map.name}' in it; expected {wanted}; {_there(tables, raw)}"
        )
    return readings, notes


def _without_failed(
    readings: dict[str, Readings], import_map: ImportMap, tables: dict[str, RawTable], repairs: RepairList
) -> tuple[dict[str, Readings], list[str]]:
    """Return readings with gaps where a number stands for failed ones, and what to say."""
    written = {
        sensor: found._replace(value=import_map.sensors[sensor].written(found.value))
        for sensor, found in readings.items()
        if found.value.shape[1] == 3
    }
    failed: dict[str, BoolArray] = {}
    for path in {tables[sensor].path for sensor in readings}:
        failed |= failed_at_once({s: found for s, found in written.items() if tables[s].path == path})
    notes = []
    for sensor in [sensor for sensor in readings if sensor in failed]:
        found, rows, common = readings[sensor], failed[sensor], on_all_axes(written[sensor].value)
        for number in np.unique(common[rows]):
            where = f"{sensor}: {f'{number:.9g}' if number else 'exactly 0'} on all axes"
            action = f"{f'{number:.9g}' if number else 'zeros'} of {sensor} made a gap"
            notes.append(_failed(where, action, found, rows & (common == number), tables[sensor], repairs))
        readings = {**readings, sensor: found._replace(value=np.where(rows[:, None], np.nan, found.value))}
    for sensor in written:
        found, value = readings[sensor], import_map.sensors[sensor].written(readings[sensor].value)
        cells = failed_on_one_axis(value)
        for name, column, failing in zip("xyz", value.T, cells.T, strict=True):
            for number in np.unique(column[failing]):
                where, action = f"{sensor} {name}: {number:.9g}", f"{number:.9g} of {sensor} made a gap"
                rows = failing & (column == number)
                notes.append(_failed(where, action, found, rows, tables[sensor], repairs))
        readings = {**readings, sensor: found._replace(value=np.where(cells, np.nan, found.value))}
    gyro = readings.get("gyroscope")
    if gyro is not None and (axis := dead_axis(gyro.value)) is not None:
        notes.append(f"WARNING: gyroscope {'xyz'[axis]}: 0 in every row while the other two turn: it was not read")
        readings = {**readings, "gyroscope": gyro._replace(value=np.where(np.arange(3) == axis, np.nan, gyro.value))}
    return readings, notes


def _failed(where: str, action: str, found: Readings, rows: BoolArray, table: RawTable, repairs: RepairList) -> str:
    """List the rows (n,) of a sensor in which a number stands for a failed reading, and say so.

    ``where`` names sensor and number, ``action`` what is done.
    """
    count, first = int(np.count_nonzero(rows)), int(found.number[np.argmax(rows)])
    for start, stop in runs(rows):
        line = table.line_of(found.number[start])
        listed = f"{where} in {stop - start} row{'s' * (stop - start > 1)}, a failed reading"
        repairs.add(None, table.path, line, listed, action)
    return (
        f"{'WARNING: ' * (count > MUCH_LOST * rows.size)}{where} in {count} of {rows.size} rows amid other readings, "
        f"the first row {first}: readings that failed; they become gaps"
    )


def _without_glitches(
    readings: dict[str, Readings], tables: dict[str, RawTable], repairs: RepairList
) -> tuple[dict[str, Readings], list[str]]:
    """Return readings with gaps for those apart that no throw has, and what to say."""
    notes: list[str] = []
    mended = {}
    for sensor, found in readings.items():
        mended[sensor], glitching, said = without_glitches(sensor, found)
        notes += said
        for row in glitching:
            line = tables[sensor].line_of(row)
            what = f"{sensor}: a single reading beyond {FASTEST_SPIN:g} rad/s"
            repairs.add(None, tables[sensor].path, line, what, f"glitch of {sensor} made a gap")
    return mended, notes


def _over_the_ends(
    readings: dict[str, Readings], import_map: ImportMap, tables: dict[str, RawTable], repairs: RepairList
) -> tuple[dict[str, Readings], ImportMap, list[str]]:
    """Return readings and map with what a gyroscope's register that overflowed hid, or gaps there, and what to say.

    All rows are looked at: the leap stands in the spin-up, before a throw.
    """
    gyro = readings.get("gyroscope")
    if gyro is None:
        return readings, import_map, []
    found, beyond, said = without_overflow(gyro, readings)
    if not said:
        return readings, import_map, []
    table = tables["gyroscope"]
    line = table.line_of(gyro.number[np.argmax(beyond)])
    became = "continued" if np.array_equal(np.isnan(found.value), np.isnan(gyro.value)) else "made gaps"
    action = f"{np.count_nonzero(beyond)} rows of gyroscope {became}, the first here"
    repairs.add(None, table.path, line, "gyroscope: its register overflows", action)
    readings = {**readings, "gyroscope": found}
    own = import_map.sensors["gyroscope"]
    own = replace(own, sheet=replace(own.sheet, range=None))  # what is continued is no reading at a limit
    return readings, replace(import_map, sensors={**import_map.sensors, "gyroscope": own}), said


def _own_rows(table: RawTable, names: Sequence[str]) -> RawTable:
    """Return a table with the rows of a sensor that has its own stamps: not those that hold nothing of it, nor repeats.

    Where sensors of several rates stand side by side, a slower one's cells end earlier, or its reading stands with its
    stamp until the next one.
    """
    columns = [table.column(name) for name in names]
    table = table.select(~np.all([column.equal("") for column in columns], axis=0))
    return table.select(~np.all([table.column(name).repeated() for name in names], axis=0))


def _slower(sensor: str, hollow: BoolArray) -> list[str]:
    """Say that a sensor's cells are empty in most rows (n,) of the log."""
    count = np.count_nonzero(hollow)
    what = f"{sensor}: its cells are empty in {count} of {hollow.size} rows: it is slower than the log"
    return [f"{what}; these rows are none of it"] * bool(count)


def _no_time(sensor: str, rows: int, base: TimeBase, clock: RowClock) -> str:
    times = clock.time[clock.known]
    column = base.column or base.counter
    return (
        f"time does not go on over the {sensor}'s {rows} rows: '{column}' runs from {times[0]:.9g} s to "
        f"{times[-1]:.9g} s; expected stamps that ascend; name another column in [time], or step_s"
    )


def _fresh(
    raw: Path,
    readings: dict[str, Readings],
    import_map: ImportMap,
    tables: dict[str, RawTable],
    repairs: RepairList,
) -> tuple[dict[str, Readings], dict[str, float], list[str]]:
    """Return the readings without repeats and dead sensors, the rates of sensors that are not the log's, and notes."""
    stamped = import_map.time.column is not None
    notes: list[str] = []
    rates: dict[str, float] = {}
    fresh: dict[str, Readings] = {}
    for sensor, found in readings.items():
        result = cleaned(sensor, found, readings, stamped)
        notes += result.notes
        kept = np.isin(found.number, [] if result.readings is None else result.readings.number)
        if not np.all(kept):
            table = tables[sensor]
            line = table.line_of(found.number[~kept][0])
            what = f"{sensor}: {result.notes[0].removeprefix(f'{sensor}: ')}"
            action = f"{np.count_nonzero(~kept)} rows left out of {sensor}, the first here"
            repairs.add(None, tables[sensor].path, line, what, action)
        if result.readings is None:
            continue
        fresh[sensor] = result.readings
        if result.rate_hz is not None:
            rates[sensor] = result.rate_hz
            stated = import_map.sensors[sensor].sheet.rate_hz
            if abs(result.rate_hz / stated - 1) > OTHER_RATE:
                notes.append(
                    f"{sensor}: {result.rate_hz:.4g} Hz is written, not the {stated:.4g} Hz that the map states"
                )
        elif stamped:
            notes += _timing_notes(sensor, result.readings)
    if not fresh:
        raise InputError.at(raw, None, f"nothing to import: {'; '.join(notes)}")
    if not stamped:
        notes.append(
            f"no time column: rows are taken as {import_map.time.step:g} s apart; whether they came late or were lost "
            "cannot be told"
        )
    return fresh, rates, notes


def _timing_notes(sensor: str, found: Readings) -> list[str]:
    timing = row_timing(found.time)
    notes = []
    if timing.lost:
        notes.append(
            f"{sensor}: {timing.lost} rows are lost in {timing.breaks} places (steps of whole multiples of "
            f"{timing.interval:.4g} s, the longest {timing.longest:.4g} s)"
        )
    if timing.late > LATE_SHARE * len(found.time):
        notes.append(
            f"{sensor}: {timing.late} of {len(found.time)} rows came late or early by more than a fifth of the usual "
            f"{timing.interval:.4g} s, none lost there; their stamps are used"
        )
    return notes


def _stretches(table: RawTable, clock: RowClock, rows: slice | None) -> list[str]:
    """Say that a log holds several stretches of time, and which is kept."""
    if not clock.starts:
        return []
    lines = ", ".join(str(line) for line, _ in clock.starts[:5]) + ", ..." * (len(clock.starts) > 5)
    every = [np.flatnonzero(clock.known & (clock.stretch == one)) for one in np.unique(clock.stretch[clock.known])]
    spans = [f"{table.number[some[0]]}:{table.number[some[-1]] + 1}" for some in every[:6]]
    another = f"--rows takes another: {', '.join(spans)}" + ", ..." * (len(every) > len(spans))
    kept = f"the longest is kept; {another}" if rows is None else "of --rows the longest is kept"
    return [
        f"WARNING: {table.path.name}: the clock starts anew in line {lines}: {len(clock.starts) + 1} stretches; {kept}"
    ]


def repairs_csv(repairs: Sequence[Repair]) -> str:
    """Return the text of ``repairs.csv``."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Repair._fields)
    writer.writerows(repairs)
    return text.getvalue()


# ------------------------------------------------------------------------------------------- files and columns


def _read_tables(raw: Path, import_map: ImportMap, repairs: RepairList) -> dict[str, RawTable]:
    """Read each file once; a sensor whose file is absent has no table (which must be allowed)."""
    if not raw.exists():
        raise InputError.at(raw, None, "no such file or folder; expected what a logger wrote")
    read: dict[tuple[Path, Layout], RawTable] = {}
    tables = {}
    for sensor, sensor_map in import_map.sensors.items():
        path = _file(raw, sensor, sensor_map)
        if path is None:
            continue
        key = (path, import_map.laid_out(sensor).layout)
        if key not in read:
            read[key] = read_raw(*key, repairs)
        tables[sensor] = read[key]
    return tables


def _file(raw: Path, sensor: str, sensor_map: SensorMap) -> Path | None:
    if raw.is_file():
        return raw
    present = sorted(child for child in raw.iterdir() if child.is_file() and not child.name.startswith("."))
    pattern = sensor_map.file or "*.csv"
    matching = [child for child in present if fnmatch(child.name, pattern)]
    if len(matching) == 1:
        return matching[0]
    if not matching and sensor_map.optional:
        return None
    names = ", ".join(child.name for child in matching or present) or "nothing"
    raise InputError.at(raw, None, f"{sensor}: expected one file {pattern}, there is {names}; name one file as RAW")


def _columns(table: RawTable, sensor_map: SensorMap, time: TimeBase) -> list[str] | None:
    """Return the sensor's column names in this file, or None for an optional sensor that is not there."""
    known = set(table.columns)
    here = next((names for names in sensor_map.columns if known.issuperset(names)), None)
    if here is None and sensor_map.optional:
        return None
    needed = list(here or min(sensor_map.columns, key=lambda names: len(set(names) - known)))
    needed += [name for name in (time.column, time.counter) if name is not None]
    needed += [sensor_map.where[0]] if sensor_map.where is not None else []
    missing = [name for name in needed if name not in known]
    if missing:
        raise InputError.at(
            table.path,
            table.header_line or None,
            f"no column {_quoted(missing)}; the columns there are {_quoted(table.columns)}",
        )
    twice = [name for name in needed if table.columns.count(name) > 1]
    if twice:
        raise InputError.at(
            table.path, table.header_line or None, f"two columns are called {_quoted(twice)}; expected each once"
        )
    return list(here or ())


def _quoted(names: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def _there(tables: dict[str, RawTable], raw: Path) -> str:
    if not tables:
        return f"the files there are {_quoted(sorted(child.name for child in raw.iterdir()))}"
    return f"the columns there are {_quoted(next(iter(tables.values())).columns)}"


# --------------------------------------------------------------------------------------------- the recording


def _cut(read: RawReadings, rows: slice) -> dict[str, Readings]:
    """Return the readings of some rows of the first sensor, and of the others in the same span of time."""
    readings, main = read.readings, read.main
    own = {sensor: read.import_map.sensors[sensor].time for sensor in readings}
    here = {s for s in readings if read.tables[s] is main and own[s] == own[next(iter(readings))]}
    start = 0 if rows.start is None else rows.start + (main.total if rows.start < 0 else 0)
    stop = main.total if rows.stop is None else rows.stop + (main.total if rows.stop < 0 else 0)
    if not 0 <= start < stop <= main.total:
        asked = f"{'' if rows.start is None else rows.start}:{'' if rows.stop is None else rows.stop}"
        raise InputError.at(main.path, None, f"--rows {asked}: expected rows within 0:{main.total}, at least one")
    cut = {}
    spans = []
    for sensor, found in readings.items():
        if sensor in here:
            cut[sensor] = found.select((found.number >= start) & (found.number < stop))
            spans += [cut[sensor].time[:1], cut[sensor].time[-1:]]
    span = np.concatenate(spans)
    if span.size == 0:
        raise InputError.at(main.path, None, f"--rows {start}:{stop}: no usable row among them")
    for sensor, found in readings.items():
        if sensor not in here:
            cut[sensor] = found.select((found.time >= span.min()) & (found.time <= span.max()))
    return {sensor: cut[sensor] for sensor in readings if cut[sensor].time.size}


def _clocked(sheet: SensorSheet, time: TimeBase) -> SensorSheet:
    """Return a sheet with what its rate may be off by, where the map says that of the clock."""
    off = time.step_sigma / time.step if time.step and time.step_sigma else time.off
    if not off:
        return sheet
    return replace(sheet, sigma={**sheet.sigma, "rate_hz": float(f"{sheet.rate_hz * off:.3g}")})


def _has_rate(read: RawReadings, sensor: str) -> bool:
    """Tell whether a sensor's rate is stated, or shown by the whole log."""
    return bool(np.isfinite(read.import_map.sensors[sensor].sheet.rate_hz)) or read.readings[sensor].time.size > 1


def _sheet(sensor_map: SensorMap, t: FloatArray, own_rate: float | None) -> SensorSheet:
    """Return what the map states, with the rate of times (n,) s, or its own where readings stood on several rows."""
    if own_rate is not None:
        return replace(sensor_map.sheet, rate_hz=float(f"{own_rate:.5g}"))
    if np.isfinite(sensor_map.sheet.rate_hz):
        return sensor_map.sheet
    interval = row_timing(t).interval
    if not interval > 0:
        raise InputError("one sample and no rate_hz in the map; expected a rate or at least two samples")
    return replace(sensor_map.sheet, rate_hz=float(f"{1 / interval:.4g}"))


#: how well a release's place in plan is stated by the track's first row, m: that row counts as a reading itself, and
#: from a camera it is off by the disc's height over the camera's times the distance from under it: half a metre
_PLACE = 1.0


def _release(raw: Path, import_map: ImportMap, readings: dict[str, Readings]) -> Release | None:
    """Return what was measured of the release, which is the file's first row; None where that row is not used."""
    if any(found.number[0] > 0 for found in readings.values()):
        return None
    throw = import_map.throws.get(raw.stem)
    if throw is None:
        return import_map.release
    # the place in the plan is where the track begins
    north, east = readings["track"].value[0, :2]
    return throw.release(float(north), float(east), _PLACE)
