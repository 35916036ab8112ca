"""What one sensor's file holds: rate, gaps, repeats, late and lost rows, clipping, resolution, noise, dead axes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from discsim.arrays import BoolArray
from discsim.glitches import glitches
from discsim.recording import SENSORS, Recording
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.noise import noise_of
from discsim.validation.rows.cleaning import CONSTANT, frozen_runs
from discsim.validation.rows.held import find_held, step_of
from discsim.validation.rows.readings import Readings
from discsim.validation.rows.timing import row_timing

__all__ = ["SensorCheck", "check_sensor", "clipped", "sensor_findings"]

#: a rate from time stamps further than this from the sheet's is worth a word (as in discsim.estimators.methods)
RATE_TOLERANCE = 0.01
#: rows that came late or were lost are worth a word from this share on
SHARE = 0.01
#: a stretch without rows is silent from this many intervals on
SILENT = 10.0
#: noise found is another than the stated from this factor on; found noise scatters by 10 % in a second of 100 Hz, data
#: sheets state typical values that single parts exceed by half
NOISE = 2.5
#: steps of resolution that were found agree with the stated within this (sheets print three digits)
STEP = 0.02


@dataclass(frozen=True)
class SensorCheck:
    """What the file of one sensor holds, in the sensor's unit; None where the readings do not tell.

    Attributes
    ----------
    rate_hz, stated_rate_hz : float
        By the time stamps between rows where none is missing, and by the sheet.
    rows, gaps : int
        Rows, and empty cells.
    held, late, lost, doubled : int
        Rows that repeat a held reading, came late, are missing, are written twice.
    even : bool
        Stamps are even to the last digit: of a rule and not of a clock, so that they show no lateness.
    clipped_share : float
        Share of rows with a reading at the end of the range.
    clipped_axes : mapping
        The same of each column that has any.
    resolution, stated_resolution, noise, stated_noise : float or None
        Step of the readings; rms of what is white in them.
    silent : tuple of pairs
        Start and length (s) of stretches without a row.
    frozen : tuple of pairs
        Start and end (s) of stretches in which it stands while another sensor shows that the body moves.
    dead_axes : tuple of str
        Columns that hold no number, or one value throughout.
    """

    sensor: str
    rows: int
    gaps: int
    rate_hz: float
    stated_rate_hz: float
    held: int
    late: int
    lost: int
    doubled: int
    even: bool
    clipped_share: float
    clipped_axes: dict[str, float]
    resolution: float | None
    stated_resolution: float | None
    noise: float | None
    stated_noise: float | None
    silent: tuple[tuple[float, float], ...]
    frozen: tuple[tuple[float, float], ...]
    dead_axes: tuple[str, ...]


def clipped(recording: Recording, sensor: str) -> BoolArray:
    """Tell which readings stand at the end of the sensor's range, glitches of the log aside."""
    value = recording.samples[sensor].value
    return recording.sheets[sensor].clipped(np.where(glitches(sensor, value), np.nan, value))


def check_sensor(recording: Recording, sensor: str) -> SensorCheck:
    """Return what the file of a sensor holds."""
    samples, sheet = recording.samples[sensor], recording.sheets[sensor]
    timing = row_timing(samples.t)
    table = samples.value.reshape(len(samples), -1)
    held = find_held(table) if sensor != "track" else None
    repeats = int(np.count_nonzero(np.all(table[1:] == table[:-1], axis=1))) if held is not None else 0
    steps = np.diff(samples.t)
    # a sensor of six columns in two units has no one resolution or noise
    one_unit = sensor != "gps"
    found_steps = [step for column in table.T if one_unit and (step := step_of(column)) is not None]
    long = np.flatnonzero(steps > SILENT * timing.interval)
    return SensorCheck(
        sensor,
        len(samples),
        samples.gaps,
        1 / timing.interval if timing.interval > 0 else float("nan"),
        sheet.rate_hz,
        repeats,
        timing.late,
        timing.lost,
        timing.twice,
        timing.exact,
        *_clipped_shares(recording, sensor),
        float(np.median(found_steps)) if found_steps else None,
        sheet.resolution,
        noise_of(np.where(glitches(sensor, samples.value), np.nan, samples.value))
        if one_unit and sensor != "track"
        else None,
        sheet.noise_rms if one_unit else None,
        tuple((float(samples.t[k]), float(steps[k])) for k in long),
        _frozen(recording, sensor, 1.0 if held is None else held.rows_per_reading),
        _dead(recording, sensor),
    )


def _clipped_shares(recording: Recording, sensor: str) -> tuple[float, dict[str, float]]:
    """Return the share of rows in which a reading clips, and that of each column where it is not zero."""
    samples = recording.samples[sensor]
    numbers = np.isfinite(samples.value).reshape(len(samples), -1)
    at_end = clipped(recording, sensor).reshape(len(samples), -1) & numbers
    shares = np.sum(at_end, axis=0) / np.maximum(np.sum(numbers, axis=0), 1)
    axes = {name: float(share) for name, share in zip(SENSORS[sensor].columns, shares, strict=True) if share > 0}
    return float(np.sum(np.any(at_end, axis=1))) / max(int(np.sum(np.any(numbers, axis=1))), 1), axes


def _frozen(recording: Recording, sensor: str, standing: float) -> tuple[tuple[float, float], ...]:
    readings = {
        name: Readings(np.arange(len(samples)), samples.t, samples.value.reshape(len(samples), -1))
        for name, samples in recording.samples.items()
    }
    runs = frozen_runs(sensor, readings[sensor], readings, standing)
    t = recording.samples[sensor].t
    return tuple((float(t[first]), float(t[after - 1])) for first, after in runs)


def _dead(recording: Recording, sensor: str) -> tuple[str, ...]:
    """Return the columns without a number, or with one value that is not the end of the range."""
    samples = recording.samples[sensor]
    at_end = clipped(recording, sensor).reshape(len(samples), -1)
    names = []
    for k, name in enumerate(SENSORS[sensor].columns):
        column = samples.value.reshape(len(samples), -1)[:, k]
        numbers = column[np.isfinite(column)]
        constant = numbers.size >= CONSTANT and np.all(numbers == numbers[0])
        if numbers.size == 0 or (constant and not np.all(at_end[np.isfinite(column), k])):
            names.append(name)
    return tuple(names)


# ------------------------------------------------------------------------------------------------------ findings


def sensor_findings(found: SensorCheck, *, clocked: bool = False) -> Iterator[Finding]:
    """Yield what is worth a word about the file of a sensor; nothing of its rate where its clock is told already."""
    where = found.sensor
    yield from _rate_findings(found, clocked=clocked)
    if found.held:
        yield Finding(
            f"{where}.held",
            "warning",
            where,
            f"{found.held} of {found.rows} rows repeat the row before on all axes, as evenly as a slower sensor's do",
            "one row per reading",
            "import the raw file again: the repeats then become gaps; counted as readings they make errors too small",
        )
    for start, end in found.frozen[:3]:
        yield Finding(
            f"{where}.frozen",
            "warning",
            where,
            f"it shows one value from {start:.3f} to {end:.3f} s while the body moves",
            "readings that move",
            "leave these rows out: they are no readings",
        )
    columns = len(SENSORS[where].columns)
    if found.dead_axes and not (where == "track" and len(found.dead_axes) == 1):
        whole = len(found.dead_axes) == columns and columns > 1
        yield Finding(
            f"{where}.dead",
            "warning" if whole else "note",
            where,
            f"{', '.join(found.dead_axes)} {'hold' if len(found.dead_axes) > 1 else 'holds'} no number or one value",
            "readings that change",
            "look at its wiring, or leave the sensor out" if whole else "an axis that is not there may be left empty",
        )
    if found.clipped_share > 0:
        axes = ", ".join(f"{name} in {100 * share:.3g} % of its rows" for name, share in found.clipped_axes.items())
        yield Finding(
            f"{where}.clipped",
            "warning" if found.clipped_share > SHARE else "note",
            where,
            f"it stands at the end of its range: {axes}",
            "readings within the range",
            "there it gives a lower bound only: take another sensor, or a part of wider range",
        )
    yield from _quality_findings(found)


def _rate_findings(found: SensorCheck, *, clocked: bool) -> Iterator[Finding]:
    where = found.sensor
    off = found.rate_hz / found.stated_rate_hz - 1
    if abs(off) > RATE_TOLERANCE and not found.held and not clocked:
        yield Finding(
            f"{where}.rate",
            "warning",
            where,
            f"time stamps say {found.rate_hz:.4g} Hz, rate_hz is {found.stated_rate_hz:.4g} Hz",
            "the same within 1 %",
            "the stamps are used; correct rate_hz, or the clock",
        )
    if found.late > SHARE * found.rows:
        yield Finding(
            f"{where}.late",
            "note",
            where,
            f"{found.late} of {found.rows} rows came late or early",
            "",
            "stamps are used",
        )
    if found.doubled:
        yield Finding(
            f"{where}.doubled",
            "warning",
            where,
            f"{found.doubled} rows follow the one before within a tenth of the usual step",
            "each reading once",
            "leave out the second of each pair",
        )
    if found.lost > SHARE * found.rows or found.silent:
        longest = max(found.silent, key=lambda pair: pair[1], default=None)
        silent = f"; silent for {longest[1]:.3g} s from {longest[0]:.3f} s on" if longest else ""
        yield Finding(
            f"{where}.lost",
            "warning" if found.silent else "note",
            where,
            f"{found.lost} rows are missing{silent}",
            "rows at even times",
            "methods use the stamps; fft is silent across the gaps" if where == "magnetometer" else "",
        )
    if found.gaps > SHARE * found.rows and not found.dead_axes:
        yield Finding(f"{where}.gaps", "note", where, f"{found.gaps} cells are empty in {found.rows} rows")


def _quality_findings(found: SensorCheck) -> Iterator[Finding]:
    where, unit = found.sensor, SENSORS[found.sensor].unit.replace("_", "/")
    if found.resolution and found.stated_resolution:
        ratio = found.resolution / found.stated_resolution
        if abs(ratio - 1) > STEP and not (ratio < 1 and found.noise is None):
            yield Finding(
                f"{where}.resolution",
                "note",
                where,
                f"its readings come in steps of {found.resolution:.4g} {unit}, stated is {found.stated_resolution:.4g}",
                "the same",
                "state what the readings show, if nothing rounds them on the way",
            )
    if found.noise is None or not found.stated_noise:
        return
    rounding = (found.resolution or found.stated_resolution or 0.0) / np.sqrt(12)
    stated = float(np.hypot(found.stated_noise, rounding))
    if not stated / NOISE < found.noise < stated * NOISE:
        more = found.noise > stated
        yield Finding(
            f"{where}.noise",
            "note",
            where,
            f"noise of {found.noise:.3g} {unit} rms is in its readings, stated is {found.stated_noise:.3g}",
            "",
            _cause(found, more=more),
        )


def _cause(found: SensorCheck, *, more: bool) -> str:
    if not more:
        return "a filter smooths its readings, or its sheet is cautious"
    # the field of a fast spin, read at uneven times and written at even ones, looks noisy
    uneven = ", or its rows came unevenly while their stamps are even" if found.even else ""
    return f"something shakes it{uneven}, or the part is noisier than its sheet"
