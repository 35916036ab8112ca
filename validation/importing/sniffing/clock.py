"""The time of a row. Takes a table; gives the column of time stamps (or the counter), its unit and how sure that is."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.clock import mended
from discsim.validation.importing.row_clock import added_up
from discsim.validation.importing.shared_stamps import evened, repeats
from discsim.validation.importing.sniffing.coarse_stamps import Counted, counted_rows
from discsim.validation.importing.sniffing.decision import Decision, Sureness
from discsim.validation.importing.sniffing.groups import Numbers
from discsim.validation.importing.sniffing.names import (
    is_spacing_name,
    is_time_name,
    read_name,
    sensor_of,
    timeless,
    words_of,
)
from discsim.validation.importing.sniffing.preamble import stated_rate
from discsim.validation.importing.sniffing.units import readings_of, split_unit
from discsim.validation.importing.stamps import DATED, is_stamp, stamp_seconds
from discsim.validation.importing.stamps import EPOCH as YEAR_2000
from discsim.validation.importing.unpadded import unpadded

__all__ = ["Clock", "clocks_of", "counter_note", "moment_of", "seconds", "with_shared_stamps", "written_unit"]

SCALES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
#: A unit that is taken where the header states it, and never guessed.
STATED_SCALES = {**SCALES, "min": 60.0, "d": 86400.0}
#: What a spreadsheet holds of a date is days since 1899-12-30 (here 2000 to 2099), and of a time a part of a day.
SHEET_DAYS = ((36526.0, 73050.0), (0.0, 1.0))
#: Time since 1970 in 2001 to 2065, in seconds: a stamp of 1e9 to 3e9 s (or as many ms, us, ns) is the time of day.
EPOCH = (1e9, 3e9)
#: Logs of motion are written at 2 Hz to 20 kHz; outside that no unit is believed.
SPACING = (5e-5, 0.5)
#: ... and fixes of a satellite receiver come twenty times a second to once a minute.
SLOWEST_FIX = 60.0
#: A log that lasts less than a second is none: where stamps make one, and rows in seconds come at 0.5 Hz at least.
SHORTEST_LOG, SLOWEST_ROWS = 1.0, 2.0
#: Few loggers of motion write more than 1000 rows a second: a unit by which one does is a guess.
FASTEST_USUAL = 1e-3
#: Loggers without time stamps write 100 rows a second more often than any other number; all rates scale with it.
STEP = 0.01
#: Steps that differ by no more than this share are the usual one, rounded; the mean is of these.
ROUNDED = 0.5
#: Share of steps that ascend in a column of time: a log has some doubled or swapped rows, never every tenth.
ASCENDING = 0.9
#: Share of rows at which a column of time goes on: several sensors' rows share a stamp, a second's rows are no time;
#: what a sensor's own column may have stood at, at 1 Hz in a log of 500 Hz. Radio links send packets of 10 to 25 rows
#: under one stamp, which only a column that is called a time may be.
STEPS, PACKETS, OWN_STEPS = 0.1, 0.03, 0.002
#: Steps that must be even before a column with a name that is not known is a clock's: a trend keeps that up for fewer.
LEAST_EVEN = 100
#: What a step without stamps may be off by: a guess by a factor of two either way (loggers write 25 to 400 rows a
#: second), a stated rate by what oscillators in sensors are (1 % to several per cent over parts and temperature).
OFF_GUESSED, OFF_STATED = 0.7, 0.03
#: Share of a sensor's rows at the stamp of its row before, with other readings, above which its clock is coarser than
#: its rows: as many as are left out by themselves without a warning.
SHARED = 0.05
#: Bytes of a row in a memory, at least.
LEAST_PLACE = 16
#: What is said of a counter under a name of time.
COUNTING = "goes up by one a row: it counts the rows and tells no time"


@dataclass(frozen=True)
class Clock:
    """Time of a row: a column with its unit, or a step (with a counter where there is one), and why.

    ``off`` is the share of a step, or of ``scale``, that it may be off by (one sigma). ``spacings``: the column holds
    what went by since the row before. ``scale``: what one count of the column is worth in ``unit``. ``shared``: several
    rows share a stamp, and are even between stamps.
    """

    column: str | None
    unit: str
    counter: str | None
    step: float | None
    decision: Decision
    off: float = 0.0
    spacings: bool = False
    scale: float = 1.0
    shared: bool = False

    def with_step(self, step: float, decision: Decision, off: float) -> Clock:
        """Return the clock with another step, that may be off by that share of it."""
        return replace(self, step=step, decision=decision, off=off)


def clocks_of(numbers: Numbers) -> list[Clock]:
    """Return the possible clocks of a table, the best first; the last is a step that is guessed."""
    found: list[tuple[float, int, Clock]] = []
    for k, name in enumerate(numbers.table.columns):
        clock = _clock(numbers, k, name)
        if clock is not None:
            found.append((_rank(numbers, k, clock), k, clock))
    if not found:
        steps = [clock for k in range(len(numbers.names)) if (clock := _added_up(numbers, k)) is not None]
        found += [(0, k, clock) for k, clock in enumerate(steps)]
    if len(found) > 1:
        # of columns that are about as sure the one that tells more rows apart: u-blox's iTOW, not its sec
        found = [(rank + 1.25 * _repeats(clock, numbers), k, clock) for rank, k, clock in found]
    return [clock for *_, clock in sorted(found, key=lambda item: item[:2])] + [_without(numbers)]


def _repeats(clock: Clock, numbers: Numbers) -> bool:
    """Tell a column of time that stands at many rows where it stood."""
    return float(np.mean(repeats(seconds(clock, numbers)))) > SHARED


def seconds(clock: Clock, numbers: Numbers) -> FloatArray:
    """Return the time of each row, (n,) s from an origin that tables with the same clock share."""
    if clock.column is None:
        assert clock.step is not None
        count = numbers.table.number.astype(np.float64)
        if clock.counter is not None:
            count = numbers.values[:, numbers.table.columns.index(clock.counter)]
        return count * clock.step
    k = numbers.table.columns.index(clock.column)
    value, _ = _as_meant(numbers, k, _stamps(numbers.cells(k)) if clock.unit == "iso" else numbers.values[:, k])
    if clock.unit != "iso":
        value = added_up(value, numbers.table.number) if clock.spacings else value
        value = value * clock.scale * STATED_SCALES[clock.unit]
    value = _going_on(value, clock.scale * STATED_SCALES.get(clock.unit, 1.0))
    return evened(value) if clock.shared else value


def _going_on(time: FloatArray, scale: float) -> FloatArray:
    """Return the times (n,) s of a column in units of ``scale`` s with its wraps taken out, as the import will."""
    known = np.isfinite(time)
    if not np.any(np.diff(time[known]) < 0):
        return time
    whole = time.copy()
    whole[known] = mended(time[known], scale).time
    return whole


def with_shared_stamps(clock: Clock, readings: Sequence[tuple[Numbers, FloatArray]]) -> Clock:
    """Return a clock that several rows of one sensor share a stamp of as such; one whose rows have their own as it is.

    ``readings`` are the table and the values (n, k) of each sensor that is read in all of its rows. Rows that stand
    twice hold the same readings.
    """
    if clock.column is None:
        return clock
    # sensors of one table share its stamps, whose dates are read once
    tables = {id(numbers): numbers for numbers, _ in readings}
    repeated = {key: repeats(seconds(clock, numbers)) for key, numbers in tables.items()}
    for numbers, value in readings:
        again = repeated[id(numbers)]
        fresh = again & np.any(np.abs(np.diff(value, axis=0, prepend=np.nan)) > 0.0, axis=1)
        if np.mean(fresh) > SHARED and np.sum(fresh) > 0.5 * np.sum(again):
            each = 1.0 / (1.0 - float(np.mean(again)))
            why = f"{clock.decision.why}; {each:.3g} rows SHARE a stamp, and are taken as even between stamps"
            return replace(clock, shared=True, decision=clock.decision._replace(why=why))
    return clock


def moment_of(clock: Clock, numbers: Numbers) -> float | None:
    """Return when a log began, s since 1970, where its stamps are dates or count from then; else None."""
    if clock.column not in numbers.table.columns:
        return None
    t = seconds(clock, numbers)
    began = float(t[np.isfinite(t)][0]) if np.isfinite(t).any() else 0.0
    if clock.unit == "iso":
        return YEAR_2000.timestamp() + began if began > DATED else None
    return began if EPOCH[0] < began < EPOCH[1] else None


def counter_note(clock: Clock) -> str | None:
    """Return a warning where the time of a row rests on a counter under a name of time, and nothing states a rate."""
    if clock.counter is None or not is_time_name(clock.counter) or clock.off <= OFF_STATED:
        return None
    return (
        f"WARNING: '{clock.counter}' {COUNTING}; {clock.step:g} s a row is taken: write the rate above the header "
        f"(# Sampling rate: 200 Hz) or step_s into the map; where it is in ms, call it '{clock.counter}_ms'"
    )


def _as_meant(numbers: Numbers, k: int, value: FloatArray) -> tuple[FloatArray, str]:
    """Return a column's times (n,) with parts of a second that are counted without leading zeros, and what to say."""
    joined = unpadded(numbers.cells(k), value)
    return (value, "") if joined is None else (joined.time, f"; {joined.text}")


def _rank(numbers: Numbers, k: int, clock: Clock) -> float:
    """Return how far a column stands back; one of a message's header is when it was measured, not when it came."""
    named = is_time_name(numbers.names[k])
    measured = {"header", "stamp"} <= words_of(numbers.names[k])
    value = numbers.values[:, k]
    place = not named and _is_place(value)
    # a count whose worth is guessed stands behind seconds with decimals
    guessed = clock.unit != "iso" and clock.decision.sure == "likely" and not np.any(value[np.isfinite(value)] % 1)
    sure = {"certain": 0, "likely": 1, "guess": 2}[clock.decision.sure]
    return sure + (0 if named else 3) - 0.25 * measured + place + 0.1 * guessed


def _is_place(value: FloatArray) -> bool:
    """Tell where each row stands in a memory: whole numbers that go up by one and the same power of two from 16 on."""
    step = np.diff(value[np.isfinite(value)])
    same = step.size > 0 and bool(np.all(step == step[0])) and step[0] >= LEAST_PLACE
    return same and float(step[0]).is_integer() and int(step[0]) & (int(step[0]) - 1) == 0


def _clock(numbers: Numbers, k: int, name: str) -> Clock | None:
    cells = numbers.cells(k)
    if _are_stamps(cells):
        time, joined = _as_meant(numbers, k, _stamps(cells))
        why = f"its cells are dates with a time{joined}"
        told = Decision("time", f"'{name}', date and time", "likely" if joined else "certain", why)
        return Clock(name, "iso", None, None, told) if _ascends(time) else None
    value, joined = _as_meant(numbers, k, numbers.values[:, k])
    spoken = numbers.names[k]
    named = is_time_name(spoken)
    # a slow sensor's own stamps stand on the rows of a fast one
    own = named and sensor_of(timeless(spoken)) is not None
    if not _ascends(value, OWN_STEPS if own else PACKETS if named else STEPS):
        return None
    # what has another name is another thing; of columns without a name the first two may count unevenly
    header, even = numbers.dialect.has_header, named or _evenly(value, spoken)
    if not named and ((header and k > 1) or ((header or k > 1) and not even)):
        return None
    slowest = SLOWEST_FIX if numbers.tells_positions and not numbers.names_motion else SPACING[1]
    unit, sure, why_unit = _unit(value, spoken, slowest, _of_one_sensor(numbers, value))
    if unit is None:
        return None
    if not named and numbers.dialect.has_header:
        sure, why_unit = "guess", f"its name says nothing known here, but it ascends as a clock does: {why_unit}"
    sure = "likely" if joined and sure == "certain" else sure
    if sure != "certain" and (ticks := _counted_by_rate(numbers, value, spoken)) is not None:
        scale, why_unit = ticks
        said = Decision("time", f"'{name}' in counts of {scale:g} ms", "likely", f"{why_unit}{joined}")
        return Clock(name, "ms", None, None, said, scale=scale)
    said = Decision("time", f"'{name}' in {unit}", sure, f"{why_unit}{joined}")
    return Clock(name, unit, None, None, said)


def _counted_by_rate(numbers: Numbers, value: FloatArray, name: str) -> tuple[float, str] | None:
    """Return what a count (n,) in no stated unit is worth, ms, and why, by the rows a second that the log states.

    None where that makes no power of ten of counts a second, or those of a unit that is tried anyway.
    """
    stated = stated_rate((*numbers.dialect.preamble, numbers.path.stem))
    sound = value[np.isfinite(value)]
    if stated is None or written_unit(name) is not None or np.any(sound % 1 != 0):
        return None
    step = _usual_step(_of_one_sensor(numbers, value))
    power = 10.0 ** round(float(np.log10(step * stated[0])))
    if abs(step * stated[0] / power - 1) > OFF_STATED or 1 / power in SCALES.values():
        return None
    why = f"whole numbers {step:.4g} apart, and '{stated[1][:60]}' says {stated[0]:.6g} rows a second"
    return 1e3 / power, f"{why}: {power:g} counts a second"


def _usual_step(value: FloatArray) -> float:
    """Return the mean of the steps of stamps (n,) that are the usual one: whole ms at 80 Hz are 12 or 13 apart."""
    steps = np.diff(value[np.isfinite(value)])
    usual = float(np.median(steps[steps > 0]))
    return float(np.mean(steps[np.abs(steps / usual - 1) <= ROUNDED]))


def _added_up(numbers: Numbers, k: int) -> Clock | None:
    """Return the clock that a column of spacings of the rows makes, or None where it is none."""
    name, value = numbers.names[k], numbers.values[:, k]
    sound = value[np.isfinite(value)]
    # the first row has none before it: loggers write zero, or the time since they were switched on
    if not is_spacing_name(name) or sound.size < 2 or not np.all(sound[1:] >= 0) or not np.mean(sound > 0) > ASCENDING:
        return None
    time = added_up(value, numbers.table.number)
    unit, sure, why = _unit(time, name, SPACING[1])
    if unit is None:
        return None
    span = float(np.nanmax(time)) * SCALES[unit]
    why = f"spacings of the rows, ADDED UP to {span:.4g} s; a row that is lost takes its time with it; {why}"
    column = numbers.table.columns[k]
    return Clock(column, unit, None, None, Decision("time", f"'{column}' in {unit}", sure, why), spacings=True)


def _ascends(value: FloatArray, rising: float = STEPS) -> bool:
    """Tell time from readings: its own rows ascend; rows of several sensors may share a stamp."""
    steps = np.diff(value[np.isfinite(value)])
    return steps.size > 1 and bool(np.mean(steps >= 0) > ASCENDING and np.mean(steps > 0) > rising)


def _evenly(value: FloatArray, name: str) -> bool:
    """Tell a clock under a name that is not known: no sensor's, no unit, and even steps that are no count of rows."""
    parts = read_name(name)
    steps = np.diff(value[np.isfinite(value)])
    if sensor_of(parts.base) is not None or readings_of(parts.unit) or steps.size < LEAST_EVEN:
        return False
    low, usual, high = np.percentile(steps, (5, 50, 95))
    return bool(low > 0 and usual != 1 and high - low < 0.5 * usual)


def _of_one_sensor(numbers: Numbers, value: FloatArray) -> FloatArray:
    """Return the times of the sensor with most rows, where a column says whose row each is; else all.

    Rows of two sensors may be microseconds apart.
    """
    if numbers.ids is None:
        return value
    cells = numbers.cells(numbers.ids[0])
    own = [value[cells.equal(text) & np.isfinite(value)] for text in numbers.ids[1]]
    longest = max(own, key=len)
    return longest if np.any(np.diff(longest) > 0) else value


def _unit(
    value: FloatArray, name: str, slowest: float, own: FloatArray | None = None
) -> tuple[str | None, Sureness, str]:
    """Return the unit of time stamps, how sure that is, and why; rows are at most ``slowest`` s apart.

    ``own`` are the stamps of one sensor's rows, by whose spacing the unit is judged.
    """
    steps = np.diff(value[np.isfinite(value)])
    step = _usual_step(value if own is None else own)
    largest = float(np.nanmax(value))
    fits = [unit for unit, scale in SCALES.items() if SPACING[0] <= step * scale <= slowest]
    written = written_unit(name)
    if written is not None:
        spacing = step * STATED_SCALES[written]
        if SPACING[0] <= spacing <= slowest:
            return written, "certain", f"the header says so, and a row every {spacing * 1e3:.3g} ms fits"
        for unit, scale in SCALES.items():
            if EPOCH[0] < largest * scale < EPOCH[1] and unit in fits:
                return unit, "likely", f"the header says {written}, but only {unit} since 1970 fit {largest:.4g}"
        lasts = (largest - float(np.nanmin(value))) * SCALES[fits[0]] if fits else 0.0
        if fits and spacing <= SLOWEST_ROWS and lasts < SHORTEST_LOG:
            why = f"the header says so: a row every {spacing:.3g} s; in {fits[0]} the log would last {lasts:.2g} s"
            return written, "likely", why
        if fits:
            unit = fits[0]
            why = f"the header says {written}, which is a row every {spacing:.3g} s; {unit} fits a log"
            return unit, "guess", why
        return None, "guess", ""
    for unit, scale in SCALES.items():
        if EPOCH[0] < largest * scale < EPOCH[1] and unit in fits:
            return unit, "certain", f"stamps of {largest:.4g} are {unit} since 1970"
    if not fits and _days(value, step):
        why = f"a spreadsheet's count of days: a row every {step * STATED_SCALES['d'] * 1e3:.3g} ms; no other unit fits"
        return "d", "likely", why
    if not fits or _counts_rows(steps):
        return None, "guess", ""
    whole = bool(np.all(np.abs(steps - np.round(steps)) < 1e-9))
    if not whole and "s" in fits:
        sure: Sureness = "likely" if step >= FASTEST_USUAL else "guess"
        return "s", sure, f"stamps with decimals, {1 / step:.4g} rows a second"
    if whole and "s" in fits and len(fits) == 1:
        return None, "guess", ""  # a counter, or one row a second: no motion shows in that
    fits = [unit for unit in fits if not (whole and unit == "s")]
    # of several the one whose rate is nearest 100 Hz on a logarithmic scale, where loggers are
    unit = min(fits, key=lambda unit: abs(np.log(step * SCALES[unit] / STEP)))
    lasts = (largest - float(np.nanmin(value))) * SCALES[unit]
    if not whole and step <= SLOWEST_ROWS and lasts < SHORTEST_LOG:
        return "s", "guess", f"stamps with decimals {step:.3g} apart; in {unit} the log would last {lasts:.2g} s"
    sure = "likely" if len(fits) == 1 or FASTEST_USUAL <= step * SCALES[unit] <= 0.1 else "guess"
    what = "whole numbers" if whole else "stamps with decimals"
    return unit, sure, f"{what} {step:.4g} apart: {1 / (step * SCALES[unit]):.4g} rows a second"


def _days(value: FloatArray, step: float) -> bool:
    """Tell dates or times of day (n,) as a spreadsheet counts them, in days, by their size and their ``step``."""
    low, high = float(np.nanmin(value)), float(np.nanmax(value))
    within = any(first <= low and high <= last for first, last in SHEET_DAYS)
    return within and SPACING[0] <= step * STATED_SCALES["d"] <= SPACING[1]


def _counts_rows(steps: FloatArray) -> bool:
    """Tell a count of the rows by its steps (n,): one each, more where rows were lost. A clock repeats a stamp too."""
    return steps.size > 1 and bool(np.mean(steps == 1) > ASCENDING and np.all(steps >= 1))


def written_unit(name: str) -> str | None:
    """Return the unit that a column's name states, or None."""
    rest, unit = split_unit(name.strip())
    if rest == "iTOW":  # u-blox's time of the week (UBX-13003221, "NAV-PVT")
        return "ms"
    for spelling in (unit, rest if not unit else ""):
        meant = readings_of(spelling)
        if meant and meant[0].sensor == "time":
            return meant[0].unit
    glued = re.search(r"(Ms|Us|Ns|Millis|Micros|Nanos|Seconds|_?seconds)(?=$|_|[A-Z])", name) or re.search(
        r"^(millis|micros|nanos|seconds)", name
    )
    if glued is not None and sensor_of(name) is None:
        meant = readings_of(glued[1].strip("_").lower())
        return meant[0].unit if meant else None
    return None


def _are_stamps(cells: Iterable[str]) -> bool:
    """Tell a column most of whose first cells are dates with a time."""
    first = list(islice(cells, 50))
    return sum(map(is_stamp, first)) > 0.5 * len(first)


def _stamps(cells: Iterable[str]) -> FloatArray:
    """Return dates with a time (or times of day) as seconds; NaN where one is neither."""
    return stamp_seconds(cells)[0]


def _without(numbers: Numbers) -> Clock:
    """Return the clock of a table without time stamps: rows at one rate, counted by a column where one counts.

    The rate is the one that stamps of whole seconds count, or that the lines above the table or the file's name state,
    or a guess.
    """
    off = OFF_GUESSED
    step, sure, why = STEP, _sure("guess"), f"no time stamps; rows taken as {1 / STEP:.0f} a second: state step_s"
    unread = [
        k for k, name in enumerate(numbers.names) if is_time_name(name) and not np.all(numbers.cells(k).equal(""))
    ]
    if unread:
        why = f"'{numbers.table.columns[unread[0]]}' {_no_time(numbers, unread[0])}; {why[16:]}"
    stated = stated_rate((*numbers.dialect.preamble, numbers.path.stem))
    if stated is not None and SPACING[0] <= 1 / stated[0] <= SPACING[1]:
        off, step, sure = OFF_STATED, float(f"{1 / stated[0]:.12g}"), _sure("likely")
        why = f"no time stamps; '{stated[1][:60]}' says {stated[0]:.6g} rows a second"
    if (coarse := _coarse(numbers)) is not None:
        name, counted = coarse
        off, step, sure = counted.off, float(f"{1 / counted.rate:.6g}"), _sure("likely")
        why = f"'{name}' stands still over many rows, and counts {counted.rate:.6g} a second over {counted.span:.4g} s"
    for k, name in enumerate(numbers.table.columns):
        value = numbers.values[:, k]
        steps = np.diff(value[np.isfinite(value)])
        if steps.size > 1 and np.mean(steps == 1) > ASCENDING and np.nanmax(value) < 1e9 and not _restarts(value):
            # an index that pandas wrote has no name
            called = f"'{name}'" if name else f"column {k + 1} (no name)"
            why += f"; {called} counts the rows" * (COUNTING not in why)
            return Clock(None, "s", name, step, Decision("time", f"{step} s a row", sure, why), off)
    return Clock(None, "s", None, step, Decision("time", f"{step} s a row", sure, why), off)


def _restarts(value: FloatArray) -> bool:
    """Tell a count (n,) within stretches of a log, as windows: it falls again and again, and not from a byte's end."""
    sound = value[np.isfinite(value)]
    return bool(np.count_nonzero(np.diff(sound) < 0) > 1 and np.log2(np.max(sound) + 1) % 1)


def _no_time(numbers: Numbers, k: int) -> str:
    """Return why a column that is called after time tells none."""
    value = numbers.values[:, k]
    steps = np.diff(value)
    if _counts_rows(steps[np.isfinite(steps)]):
        return COUNTING
    cell = next(cell for cell in numbers.cells(k) if cell)
    return f"tells no time here (its first cell is '{cell[:30]}')"


def _coarse(numbers: Numbers) -> tuple[str, Counted] | None:
    """Return the column of time that goes on once in many rows, by whole seconds or minutes, and what it counts."""
    for k, name in enumerate(numbers.table.columns):
        cells = numbers.cells(k)
        if _are_stamps(cells):
            changed = ~cells.repeated()
            if np.mean(changed) > STEPS:
                continue  # a clock, or none
            stamps = np.full(len(changed), np.nan)
            stamps[changed] = _stamps(cells[row] for row in np.flatnonzero(changed).tolist())
            counted = counted_rows(stamps)
        elif is_time_name(numbers.names[k]) and _in_seconds(numbers.values[:, k], numbers.names[k]):
            counted = counted_rows(numbers.values[:, k])
        else:
            continue
        if counted is not None and SPACING[0] <= 1 / counted.rate <= SPACING[1]:
            return name, counted
    return None


def _in_seconds(value: FloatArray, name: str) -> bool:
    """Tell whole seconds, since 1970 or by the name's unit, from a count of anything else."""
    largest = float(np.nanmax(value, initial=0.0))
    return bool(np.all(value[np.isfinite(value)] % 1 == 0)) and (
        written_unit(name) == "s" or EPOCH[0] < largest < EPOCH[1]
    )


def _sure(sureness: Sureness) -> Sureness:
    return sureness
