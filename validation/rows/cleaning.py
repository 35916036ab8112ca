"""What a sensor's rows hold besides fresh readings: nothing, one value, a frozen stretch, straight lines, repeats.

Each is said in a sentence; the rows that hold no reading of their own are left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discsim.arrays import IntArray
from discsim.glitches import FASTEST_SPIN, glitches
from discsim.validation.rows.held import (
    Held,
    find_held,
    find_interpolated,
    fresh_rows,
    step_of,
    with_holes_filled,
)
from discsim.validation.rows.own_times import between_rows, in_step, own_times
from discsim.validation.rows.readings import Readings
from discsim.validation.rows.timing import row_timing

__all__ = ["Cleaned", "body_moves", "cleaned", "frozen_runs", "without_glitches", "without_repeats"]

#: a sensor that shows one value on this many rows, while the body moves, is dead
CONSTANT = 50
#: fewest rows, and times the usual standing of a reading, for which a sensor that moved before stands when it froze
FROZEN_ROWS, FROZEN_TIMES = 20, 10.0
#: what moves: a rate (rad/s) above any gyroscope's bias; a span of the field (uT) of a quarter turn of the weakest on
#: Earth; a span of the specific force (m/s^2) of half a g
MOVES = {"gyroscope": 0.5, "magnetometer": 20.0, "accelerometer": 5.0}


@dataclass(frozen=True)
class Cleaned:
    """The rows that are left, None where none is; the sensor's own rate where it is not the log's; sentences."""

    readings: Readings | None
    rate_hz: float | None
    notes: tuple[str, ...]


def without_glitches(sensor: str, found: Readings) -> tuple[Readings, IntArray, list[str]]:
    """Return readings with gaps for those apart that no throw has, the numbers of their rows, and what to say."""
    alone = glitches(sensor, found.value)
    if not np.any(alone):
        return found, found.number[:0], []
    number = found.number[np.any(alone, axis=1)]
    axes = " and ".join("xyz"[axis] for axis in np.flatnonzero(np.any(alone, axis=0))) if alone.shape[1] > 1 else ""
    note = (
        f"{f'{sensor} {axes}'.rstrip()}: readings beyond {FASTEST_SPIN:g} rad/s, apart from those before and "
        f"after, in {number.size} rows of the log, the first row {number[0]}: glitches of the log (a lost decimal "
        "point?); they become gaps"
    )
    return Readings(found.number, found.time, np.where(alone, np.nan, found.value)), number, [note]


def cleaned(sensor: str, found: Readings, others: Mapping[str, Readings], stamped: bool) -> Cleaned:
    """Return the fresh readings of a sensor.

    ``others`` are all sensors of the import, which tell whether the body moved; ``stamped`` whether times come from the
    file's own time stamps.
    """
    if problem := nothing_in(sensor, found, others):
        return Cleaned(None, None, (problem,))
    notes = [
        f"{sensor}: {axis} holds no number in any row; that axis is a gap throughout"
        for axis, column in zip("xyz", found.value.T, strict=False)
        if found.value.shape[1] == 3 and sensor != "track" and np.all(np.isnan(column))
    ]
    total = len(found.time)
    rate = None
    line = find_interpolated(found.value)
    if line is not None:
        every, first = line
        found = found.select(np.arange(total) % every == first)
        notes.append(
            f"{sensor}: only every {_ordinal(every)} row is a reading, the rows between lie on straight lines: they "
            f"were interpolated; {total - len(found.time)} of {total} rows are left out"
        )
        rate = 1 / row_timing(found.time).interval
    total = len(found.time)
    held = find_held(found.value)
    if held is not None and np.any(np.isnan(found.value)):
        found = Readings(found.number, found.time, with_holes_filled(found.value))
        held = find_held(found.value)
    if held is not None and (gap := np.all(np.isnan(found.value), axis=1)).any():
        # a row without a reading is as one that was lost: what stood on it goes on behind it
        found = found.select(~gap)
        held = find_held(found.value)
    standing = 1.0 if held is None else held.rows_per_reading
    found, said = _thawed(sensor, found, others, standing)
    notes += said
    if held is None:
        between = between_rows(found, others) if sensor == "magnetometer" else None
        if between is None:
            return Cleaned(found, rate, tuple(notes))
        found, own, row = between
        notes.append(
            f"{sensor}: its readings come every {own.period / row:.2f} rows, at {1 / own.period:.4g} Hz in a log of "
            f"{1 / row:.4g} Hz: they bear {own.even}, at most a row before the row on which they stand"
        )
        return Cleaned(found, 1 / own.period, tuple(notes))
    readings, period, said_of_it = without_repeats(sensor, found, held, total, stamped)
    return Cleaned(readings, 1 / period, (*notes, said_of_it))


def without_repeats(sensor: str, found: Readings, held: Held, total: int, stamped: bool) -> tuple[Readings, float, str]:
    """Return the fresh readings of a sensor that is held over rows, its period (s), and what to say.

    ``total`` rows were there before gaps and frozen stretches were taken out.
    """
    before = len(found.time)
    row = row_timing(found.time).interval
    is_fresh = fresh_rows(found.value, held)
    fresh, written = found.select(is_fresh), np.diff(np.flatnonzero(is_fresh))
    stands = held.rows_per_reading
    if before < total:
        apart = np.diff(fresh.time) / row
        stands = float(np.mean(apart[apart < 2 * np.median(apart)]))
    if (every := in_step(fresh.time / row, written, stands)) is not None:
        period, time = every * row, fresh.time.copy()
        time[0] = min(time[0], time[1] - period)  # it may stand since before the first row
        bear = f"it is read every {_ordinal(every)} row, in step with the log, and has the time of that row"
    else:
        own = own_times(fresh.time, written.astype(float), stands, row)
        period, time = own.period, own.time
        bear = f"what is left bears {own.even}, at most a row before the row at which it first shows"
    per_row = "" if stamped else f" (rows taken as {1 / row:.4g} Hz)"
    said = (
        f"{sensor}: its readings stand on {stands:.2f} rows each (sample and hold): it runs at "
        f"{1 / period:.4g} Hz in a log of {1 / row:.4g} Hz{per_row}; {before - len(fresh.time)} of {before} rows "
        f"repeat and are left out; {bear}"
    )
    return Readings(fresh.number, time, fresh.value), period, said


def _ordinal(number: int) -> str:
    return {2: "second", 3: "third"}.get(number, f"{number}th")


def nothing_in(sensor: str, found: Readings, others: Mapping[str, Readings]) -> str | None:
    """Return why a sensor is left out of the recording: no number, one on all axes, one value while the body moves."""
    value = found.value
    rows = len(value)
    if np.all(np.isnan(value)):
        return f"no {sensor}: none of its {rows} rows holds a number; it is left out"
    if sensor not in MOVES or rows < CONSTANT or not np.all((value == value[0]) | np.isnan(value)):
        return None
    zero = np.all((value == 0) | np.isnan(value))
    # a field may stand still on three axes alike; neither gravity nor the noise of a gyroscope does
    if zero or (sensor != "magnetometer" and np.ptp(np.abs(value[np.isfinite(value)])) == 0):
        shown = "are zero" if zero else "are one number on all axes"
        return f"no {sensor}: all its {rows} rows {shown}, so it was not connected or not read; it is left out"
    moving = [other for other in MOVES if other != sensor and other in others and body_moves(other, others[other])]
    if sensor == "magnetometer" and moving:
        return (
            f"no {sensor}: it shows one value on all {rows} rows while the {moving[0]} shows that the body moves: "
            "it is dead; it is left out"
        )
    return None


def body_moves(
    sensor: str, found: Readings, start: float = -np.inf, stop: float = np.inf, *, unsteadily: bool = False
) -> bool:
    """Tell whether a sensor shows, between two times, that the body moves (`MOVES`); or that its motion changes.

    A steady spin turns the field, but leaves a gyroscope and an accelerometer with one reading each.
    """
    value = found.value[(found.time >= start) & (found.time <= stop)]
    value = value[np.all(np.isfinite(value), axis=1)]
    if len(value) < 3:
        return False
    if sensor == "gyroscope":
        size = np.linalg.norm(value, axis=1)
        return float(np.ptp(size) if unsteadily else np.median(size)) > MOVES[sensor]
    if unsteadily and sensor == "magnetometer":
        return False
    return bool(np.max(np.ptp(value, axis=0)) > MOVES[sensor])


def frozen_runs(
    sensor: str, found: Readings, others: Mapping[str, Readings], standing: float = 1.0
) -> list[tuple[int, int]]:
    """Return the first row and the row after the last of each run in which all axes stand while the body moves.

    Another sensor must show the motion. Where none is, nothing is called frozen: a body at rest reads like that.
    """
    if sensor not in MOVES or found.value.shape[1] < 2:
        return []
    value = found.value
    same = np.all((value[1:] == value[:-1]) | np.isnan(value[1:]), axis=1) & ~np.all(np.isnan(value[1:]), axis=1)
    edges = np.flatnonzero(~np.concatenate([[False], same, [False]]))
    long = np.diff(edges) >= max(FROZEN_ROWS, FROZEN_TIMES * standing)
    # a resolution too coarse for the motion makes readings stand, too, and go on by a step; a sensor that thaws leaps
    steps = np.array([step_of(column) or 0.0 for column in value.T])
    thaw = edges[1:][long & (edges[1:] < len(value))]
    if np.any(np.all(np.abs(value[thaw] - value[thaw - 1]) <= 2.01 * steps, axis=1)):
        return []
    runs = []
    for first, after in zip(edges[:-1][long], edges[1:][long], strict=True):
        span = (float(found.time[first]), float(found.time[after - 1]))
        seen_by = [name for name in MOVES if name != sensor and name in others]
        if any(body_moves(name, others[name], *span, unsteadily=sensor != "magnetometer") for name in seen_by):
            runs.append((int(first), int(after)))
    return runs


def _thawed(
    sensor: str, found: Readings, others: Mapping[str, Readings], standing: float
) -> tuple[Readings, Sequence[str]]:
    """Return a sensor's rows without those in which it stood frozen, and what to say."""
    kept = np.ones(len(found.time), dtype=np.bool_)
    notes = []
    zero = min(other.time[0] for other in others.values())
    runs = frozen_runs(sensor, found, others, standing)
    for first, after in runs[:5]:
        ends = "to the end" if after == len(kept) else f"to {found.time[after - 1] - zero:.3f} s"
        notes.append(
            f"{sensor}: it shows one value from {found.time[first] - zero:.3f} s {ends} while the body moves: frozen; "
            f"{after - first - 1} rows become a gap"
        )
    if len(runs) > 5:
        notes.append(f"{sensor}: {len(runs) - 5} more frozen stretches become gaps")
    for first, after in runs:
        kept[first + 1 : after] = False
    return found.select(kept), notes
