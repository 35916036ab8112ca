"""What a diagnosis takes of recordings as they come: what is of no use is left out aloud, or refused in a sentence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.clipping import constant_axes, step_of
from discsim.effects.kind import BOARD
from discsim.errors import InputError
from discsim.recording import SENSORS, Recording, Samples, SensorSheet
from discsim.rounded_stamps import evened, unit_of
from discsim.validation.checking.track_path import holds_height
from discsim.validation.diagnosis.candidates.candidate import unplaced
from discsim.validation.diagnosis.late_stamps import with_even_rows
from discsim.validation.diagnosis.repeats import without_held_readings
from discsim.validation.diagnosis.throw_ends import coasting_part, free_part
from discsim.validation.diagnosis.track_ends import flight_of
from discsim.validation.identification.coarse_steps import stands
from discsim.validation.identification.initial.smoothing import FEWEST
from discsim.validation.identification.plants import plant_of
from discsim.written import require_seconds

__all__ = ["prepared"]

#: fastest readings that are looked at, Hz: eighty of a turn of the fastest disc (80 rad/s), more would only take time
FASTEST = 1000.0
#: fewest fixes of a path that are used at all
_FIXES = 4
#: a sensor is silent for a while where nothing comes for this long, s, and for as many of its intervals
_SILENT, _INTERVALS = 0.25, 5.0
#: shares of readings above which it is worth saying that they stand at the range, or repeat the one before
_CLIPPED, _HELD = 0.05, 0.3
#: what is said of stamps that were rounded
_EVENED = "the stamps of the {} are rounded to {:g} ms, and even but for that: its readings are taken at even times."


def prepared(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[list[Recording], list[str]]:
    """Return recordings (called ``names``) as a diagnosis can use them, and what the reader must know of them.

    Sensors without a reading go, axes that stand still become gaps, what is too long or too fast is shortened. Raises
    `InputError` where nothing is left of a recording, or its plant needs something that it does not state.
    """
    usable: list[Recording] = []
    notes: dict[str, list[str]] = {}
    for recording, name in zip(recordings, names, strict=True):
        _refuse(recording, name)
        kept = {}
        for change in (without_held_readings, _free, _downwards, _in_flight, _evened, with_even_rows, _on_steps):
            recording, told = change(recording)
            for note in told:
                notes.setdefault(note, []).append(name)
        sheets = dict(recording.sheets)
        for sensor, samples in recording.samples.items():
            left, step = _shortened(samples, sheets[sensor], _longest(recording))
            for note in _notes(recording, sensor, samples, left, step):
                notes.setdefault(note, []).append(name)
            if left is not None:
                kept[sensor] = left
                sheets[sensor] = replace(sheets[sensor], rate_hz=sheets[sensor].rate_hz / step)
        usable.append(replace(recording, samples=kept, sheets=sheets))
        _enough(usable[-1], name)
    said = [note if len(where) == len(names) else f"{', '.join(where)}: {note}" for note, where in notes.items()]
    return usable, [*_absent(usable, names), *_unplaced(usable), *said]


def _free(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a throw without the hand that began or ended it, a rig's run without its spin-up, and what was cut off."""
    plant = plant_of(recording)
    if plant.commanded:
        return recording, []
    if not plant.airborne:
        run = coasting_part(recording)
        spun = f"the run is cut: its first {run.before:.2f} s, in which it is spun up (time counts from there)."
        return run.recording, [spun] if run.before else []
    cut = free_part(recording)
    said = []
    if cut.before:
        said.append(f"its first {cut.before:.2f} s, in which a hand still holds the disc (time counts from there)")
    if cut.after:
        said.append(f"its last {cut.after:.2f} s, in which it is caught or on the ground")
    return cut.recording, [f"the throw is cut: {' and '.join(said)}."] if said else []


def _downwards(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a flight whose track counts downwards, where it held the height, and that its sign was turned."""
    if not holds_height(recording):
        return recording, []
    track = recording.samples["track"]
    turned = Samples(track.t, track.value * np.array([1.0, 1.0, -1.0]))
    said = (
        "down_m of the track holds the height, positive upwards: its sign is turned. To mend it, turn it in the file."
    )
    return replace(recording, samples={**recording.samples, "track": turned}), [said]


def _in_flight(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording whose track is that of the flight alone, and what was cut off; time zero is its release.

    Other sensors tell when the release was: only where there are none the first point that moves does.
    """
    track = recording.get("track")
    if track is None or not plant_of(recording).follows_path:
        return recording, []
    cut = flight_of(track, recording.sheets["track"].noise_rms)
    if not cut.before and not cut.after:
        return recording, []
    flight, said = cut.flight, []
    if cut.before:
        said.append(f"its first {cut.before:.2f} s, before the disc moves")
        if len(recording.samples) == 1:
            flight = Samples(flight.t - flight.t[0], flight.value)
            said[-1] += " (time counts from there)"
    if cut.after:
        said.append(f"its last {cut.after:.2f} s, in which it is too slow to fly: it has come down")
    samples = {**recording.samples, "track": flight}
    return replace(recording, samples=samples), [f"the track is cut: {' and '.join(said)}."]


def _evened(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording whose rounded stamps, where rows come evenly, are their times, and what is said."""
    samples, said = dict(recording.samples), []
    for sensor, one in recording.samples.items():
        t = evened(one.t)
        if t is not one.t:
            samples[sensor] = Samples(t, one.value)
            said.append(_EVENED.format(sensor, 1e3 * unit_of(one.t)))
    return (replace(recording, samples=samples), said) if said else (recording, [])


def _on_steps(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording that states the steps on which sensors stand, where these hide their noise, and what is said.

    A log of too few decimals has coarser steps than its sensor.
    """
    sheets, said = dict(recording.sheets), []
    for sensor in [one for one in recording.samples if one in BOARD]:
        value, sheet = recording.samples[sensor].value, sheets[sensor]
        step, noise = step_of(value), sheet.noise_rms
        if not stands(value, step, noise):
            continue
        sheets[sensor] = replace(sheet, resolution=step)
        unit = {"rad_s": "rad/s", "m_s2": "m/s^2"}.get(SENSORS[sensor].unit, SENSORS[sensor].unit)
        said.append(
            f"the {sensor} stands on steps of {step:.4g} {unit}, {f'{step / noise:.0f}' if noise else 'many'} times "
            "its noise: only where it goes on by a step do its readings count. Expected decimals that show its noise."
        )
    return (replace(recording, sheets=sheets), said) if said else (recording, [])


def _refuse(recording: Recording, name: str) -> None:
    """Refuse a recording that lacks what its plant cannot do without, or whose time does not begin near zero."""
    place = recording.path or name
    lacks = plant_of(recording).lacks(recording)
    if lacks is not None:
        raise InputError(f"{place}: {lacks}")
    require_seconds(recording)
    first = min((float(s.t[0]) for s in recording.samples.values() if len(s)), default=0.0)
    if first > _longest(recording):
        raise InputError(
            f"{place}: its first reading is at {first:.6g} s; expected time to count from the release or the start of "
            "the run, in seconds (import the rows of one throw, --rows A:B)"
        )


def _enough(recording: Recording, name: str) -> None:
    """Refuse a recording of which too few readings are left to tell a motion."""
    counts = {sensor: _rows(samples) for sensor, samples in recording.samples.items()}
    if any(count >= (_FIXES if sensor in ("gps", "track") else FEWEST) for sensor, count in counts.items()):
        return
    told = ", ".join(f"{sensor} {count}" for sensor, count in counts.items()) or "none"
    raise InputError(
        f"{recording.path or name}: too few readings for a diagnosis (whole rows within "
        f"{_longest(recording):g} s: {told}); expected at least {FEWEST} of one sensor, in seconds"
    )


def _longest(recording: Recording) -> float:
    """Return how much of a recording is looked at, s."""
    return plant_of(recording).durations.longest


def _rows(samples: Samples) -> int:
    """Return how many rows hold a number on some axis."""
    return int(np.count_nonzero(np.isfinite(_table(samples)).any(axis=1)))


def _table(samples: Samples) -> FloatArray:
    return samples.value if samples.value.ndim == 2 else samples.value[:, None]


def _shortened(samples: Samples, sheet: SensorSheet, longest: float) -> tuple[Samples | None, int]:
    """Return what is used of a sensor, None for nothing, and of how many of its readings one is looked at."""
    end = float(samples.t[0]) + longest if len(samples) else 0.0
    own = samples.between(-np.inf, min(end, longest)) if len(samples) and float(samples.t[-1]) > longest else samples
    interval = own.interval
    step = max(1, int(1.0 / (interval * FASTEST) + 1e-6)) if np.isfinite(interval) else 1
    value = _table(own).copy()[::step]
    value[:, _standing(value, sheet)] = np.nan
    if not np.any(np.isfinite(value)):
        return None, 1
    return Samples(own.t[::step], value.reshape(-1, *own.value.shape[1:])), step


def _standing(value: FloatArray, sheet: SensorSheet) -> BoolArray:
    """Tell of which axes (k,) readings (n, k) are one and the same number where noise would have moved them.

    Steps of resolution that are coarser than the noise, and sensors without noise, may stand still on a steady motion;
    what stands at its range all along says that the motion was beyond it.
    """
    if sheet.noise_rms == 0.0 or (sheet.resolution or 0.0) > (sheet.noise_rms or 0.0):
        return np.zeros(value.shape[1], dtype=np.bool_)
    clipped = np.any(sheet.clipped(value) & np.isfinite(value), axis=0)
    return np.asarray(constant_axes(value, FEWEST) & ~clipped)


def _absent(recordings: Sequence[Recording], names: Sequence[str]) -> Iterator[str]:
    """Yield which sensors only some recordings have."""
    for sensor in SENSORS:
        without = [name for one, name in zip(recordings, names, strict=True) if sensor not in one]
        if 0 < len(without) < len(names):
            yield f"{', '.join(without)}: no {sensor}; what only it shows cannot be said of them."


def _unplaced(recordings: Sequence[Recording]) -> Iterator[str]:
    """Yield what is taken for the accelerometer's place where nobody states it."""
    if unplaced(recordings):
        yield (
            "where the accelerometer sits (position_m) is not stated: the centre is taken, and where it does sit shows "
            "as accel.position_offset."
        )


def _notes(recording: Recording, sensor: str, samples: Samples, left: Samples | None, step: int) -> Iterator[str]:
    """Yield what there is to say of one sensor of a recording."""
    columns = SENSORS[sensor].columns
    value, sheet = _table(samples), recording.sheets[sensor]
    finite = np.isfinite(value)
    if left is None:
        dead = "holds no reading" if not np.any(finite) else "stands still at one value"
        yield f"the {sensor} {dead}: it is left out, and nothing is said of it."
        return
    standing = _standing(value, sheet)
    for axis, column in enumerate(columns):
        if not np.any(finite[:, axis]):
            yield f"{column} of the {sensor} holds no reading: nothing is said of that axis."
        elif standing[axis]:
            yield f"{column} of the {sensor} stands still at {value[finite[:, axis], axis][0]:g}: it is left out."
    if float(samples.t[-1]) > _longest(recording):
        yield (
            f"the {sensor} goes on to {samples.t[-1]:.4g} s, longer than any {recording.plant} lasts: its first "
            f"{_longest(recording):g} s are looked at."
        )
    if step > 1:
        yield f"the {sensor} is faster than {FASTEST:g} Hz: one of {step} of its readings is looked at."
    if _rows(left) < FEWEST and sensor not in ("gps", "track"):
        yield f"the {sensor} has {_rows(left)} readings only: it says little."
    yield from _silences(left, recording, sensor)
    at_range = sheet.clipped(value) & finite
    for axis, column in enumerate(columns):
        share = float(np.sum(at_range[:, axis])) / max(float(np.sum(finite[:, axis])), 1.0)
        if share > _CLIPPED:
            yield (
                f"{column} of the {sensor} stands at its range in {100.0 * share:.0f} % of its readings: they say only "
                "that the motion was beyond it."
            )
    if stands(value, sheet.resolution or 0.0, sheet.noise_rms):
        return  # `_on_steps` has said so
    rows = value[finite.all(axis=1)]
    same = np.all(np.diff(rows, axis=0) == 0.0, axis=1) if len(rows) > FEWEST else np.zeros(1)
    if np.mean(same) > _HELD and np.any(np.ptp(rows, axis=0) > 0.0):
        yield (
            f"the {sensor} repeats {100.0 * np.mean(same):.0f} % of its readings, as a slower sensor does that is "
            "written with every row of a faster log: such repeats count as readings, and their noise looks wrong."
        )


def _silences(samples: Samples, recording: Recording, sensor: str) -> Iterator[str]:
    """Yield where a sensor says nothing for a while, at its start, in between or to its end."""
    t = samples.t[np.isfinite(_table(samples)).any(axis=1)]
    ends = [s.t[-1] for s in recording.samples.values() if len(s)]
    end = min(float(max(ends)), _longest(recording))
    long = max(_SILENT, _INTERVALS * (samples.interval if len(samples) > 1 else 0.0))
    marks = np.concatenate([[0.0], t, [end]])
    for k in np.flatnonzero(np.diff(marks) > long):
        yield (
            f"the {sensor} is silent from {marks[k]:.2f} to {marks[k + 1]:.2f} s: what happened then is told by the "
            "other sensors alone."
        )
