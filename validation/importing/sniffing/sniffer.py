"""From a raw file or folder to a proposed map. Takes a path; gives a `Proposal`, or one sentence why there is none."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.files import model_names
from discsim.recording import SENSORS, Plant
from discsim.validation.importing.raw_table import Layout
from discsim.validation.importing.sniffing.archive import BESIDE, MAX_FILES
from discsim.validation.importing.sniffing.axes import BodyAxes, body_axes
from discsim.validation.importing.sniffing.behaviour import TELLING, WORTHS, by_behaviour, lines_of_a_record
from discsim.validation.importing.sniffing.by_each_other import by_each_other, in_si
from discsim.validation.importing.sniffing.clock import (
    SPACING,
    Clock,
    clocks_of,
    counter_note,
    moment_of,
    seconds,
    with_shared_stamps,
)
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.exchanged import exchanged
from discsim.validation.importing.sniffing.fixes import fixes_of
from discsim.validation.importing.sniffing.full_scale import full_scale
from discsim.validation.importing.sniffing.groups import FEWEST_ROWS, Numbers, Triple
from discsim.validation.importing.sniffing.held_gravity import (
    GRAVITY_ITSELF,
    linear_with_gravity,
    rests,
    shows_gravity,
    weightless,
)
from discsim.validation.importing.sniffing.late_clock import late_clock, moved
from discsim.validation.importing.sniffing.log_files import LogFile, laid_out, log_file, own_layout
from discsim.validation.importing.sniffing.magnitudes import (
    Unit,
    accelerometer_unit,
    gyroscope_unit,
    magnetometer_unit,
)
from discsim.validation.importing.sniffing.moved_names import refuse_moved_names
from discsim.validation.importing.sniffing.names import NO_READING, is_time_name, sensor_of, timeless
from discsim.validation.importing.sniffing.own_clock import OwnClocks, clocks_of_files, own_clocks
from discsim.validation.importing.sniffing.own_place import own_place
from discsim.validation.importing.sniffing.preamble import stated_rate, stated_worths
from discsim.validation.importing.sniffing.proposal import Proposal, ProposedSensor
from discsim.validation.importing.sniffing.pull import doubted
from discsim.validation.importing.sniffing.reference_column import with_reference
from discsim.validation.importing.sniffing.seen_turns import (
    OFF_FITTED,
    OFF_LOOSE,
    SeenTurns,
    clock_note,
    rate_note,
    seen_turns,
    ticking,
)
from discsim.validation.importing.sniffing.spin_axis import Reading3
from discsim.validation.importing.sniffing.suggestion import either_gyroscope, suggested
from discsim.validation.importing.sniffing.swings import swings_once_a_turn
from discsim.validation.importing.sniffing.track import track_of
from discsim.validation.importing.sniffing.turning import Fit, best_worth, steps_between
from discsim.validation.importing.sniffing.units import COUNTS, Reading
from discsim.validation.importing.sniffing.unused import missing_axes, one_axis_rate, unused_columns
from discsim.validation.importing.sniffing.wider_range import wider_range

__all__ = ["sniff"]

#: In this order they stand in the map; rows are counted in the first one's file.
ORDER = ("gyroscope", "accelerometer", "magnetometer")
#: Steps of rows that are tried, over the one that is guessed (0.01 s): 10 to 1000 rows a second, each within a factor
#: of two of the next, as far as a search goes from it.
FACTORS = tuple(np.geomspace(0.1, 10.0, 9).tolist())
#: Files of a folder that are no tables and named one by one.
MOST_UNREAD = 4


def sniff(raw: Path, plant: Plant = "free_spin", down: float | None = None) -> Proposal:
    """Propose a map for a raw file, or a folder with one file per sensor.

    ``down`` is the share of the field that points down at the place, None where that is not known. Raises `InputError`
    where nothing can be read or no three columns look like a sensor of motion.
    """
    files, failures = _read(raw)
    layout, files, aside, notes = laid_out(files)
    notes = [*notes, *_unread(raw, failures)]
    found, left, exchanges = _assigned(files)
    tables = [file.numbers for file in files]
    fixes = [numbers for numbers in tables if numbers.tells_positions]
    clock = _one_clock([triple.numbers for triple, _ in found.values()] or fixes or tables)
    unknown = [t for t in left if t.sensor is None and t.penalty < NO_READING and _on(clock, t.numbers)]
    missing = [sensor for sensor in ORDER if sensor not in found]
    if unknown and missing:
        seen = by_behaviour(unknown, [seconds(clock, triple.numbers)[triple.rows] for triple in unknown])
        found |= {sensor: (triple, decision) for triple, sensor, decision in seen if sensor in missing}
    either = "" if "gyroscope" in found else either_gyroscope(unknown, _triples(found).get("accelerometer"))
    apart = clocks_of_files(clock, _triples(found))
    found = {s: found[s] for s in ORDER if s in found and (s in apart.clocks or _on(clock, found[s][0].numbers))}
    sensors = [triple for triple, _ in found.values() if _on(clock, triple.numbers)]
    read_whole = [(triple.numbers, triple.values) for triple in sensors if triple.where is None]
    clock = with_shared_stamps(clock, read_whole)
    refuse_moved_names(clock, sensors)
    tables += aside
    fixed, said = fixes_of(tables, clock, [triple.numbers for triple in sensors])
    if fixed is not None and any(fixed.numbers is numbers for numbers in aside):
        fixed = fixed._replace(layout=fixed.numbers.dialect.layout)
    if not found and fixed is None:
        path = track_of(tables, clock)
        if path is None:
            raise _nothing(raw, files, failures, either)
        notes = [*notes, *path.notes]
        return Proposal(_name(raw), raw, "flight", layout, clock, (), (), tuple(notes), track=path)
    found, exchanges = _turned_about(clock, found, exchanges)
    others = _others(found, left)
    own = clocks_of_files(clock, _triples(found)).beside(own_clocks(clock, _triples(found)))
    place = own_place(tables)
    place = place and place.on(moment_of(clock, files[0].numbers))
    notes += [either] * bool(either)
    notes += [*said, *(note for _, note in others), *apart.notes, *own.notes, *([place.note] if place else [])]
    notes = [*exchanges, *notes]
    down = place.down if down is None and place is not None else down
    sniffed = _Sniffed(raw, plant, layout, own, found, notes, down)
    proposal = _proposal(sniffed, clock, {})
    if offsets := _offsets(proposal, own, found):
        proposal = _proposal(sniffed, clock, offsets)
    proposal = replace(proposal, fixes=fixed, place=place).in_field(place and place.field)
    named = [*(triple for triple, _ in found.values()), *(triple for triple, _ in others)]
    return _with_unused(with_reference(proposal, named), tables, named, own)


# --------------------------------------------------------------------------------------------------- reading


def _read(raw: Path) -> tuple[list[LogFile], list[InputError]]:
    """Read the file, or every file of a folder that is a table; what failed in a folder is left for the last word."""
    if raw.is_file():
        return [log_file(raw, alone=True)], []
    paths = sorted(path for path in raw.iterdir() if path.is_file() and not path.name.startswith("."))
    if len(paths) > MAX_FILES:
        raise InputError.at(raw, None, f"holds {len(paths)} files; expected one folder of a logger's export")
    files, failures = [], []
    for path in paths:
        try:
            files.append(log_file(path, alone=len(paths) == 1))
        except InputError as error:
            failures.append(error)
    if not files:
        names = ", ".join(path.name for path in paths[:8]) or "nothing"
        folders = ", ".join(sorted(path.name for path in raw.iterdir() if path.is_dir())[:8])
        also = f"; there are folders in it ({folders}): import one of them, unpacked" if folders else ""
        first = "".join(f" ({line})" for line in _said(raw, failures)[:1])
        what = f"no table of numbers in the files there ({names}){also}; expected a logger's export{first}"
        raise InputError.at(raw, None, what)
    return files, failures


def _said(raw: Path, failures: Sequence[InputError]) -> list[str]:
    """Return why each file of a folder is no table, but for words to read and pictures."""
    said = [str(failure).removeprefix(f"{raw}/").removeprefix(f"{raw}\\") for failure in failures]
    return [line for line in said if not BESIDE.search(line.partition(":")[0])]


def _unread(raw: Path, failures: Sequence[InputError]) -> list[str]:
    """Return a line for each file of a folder that is left out, the first of many alone."""
    said = _said(raw, failures)
    more = [f"left out: {len(said) - MOST_UNREAD} more files that are no tables"] * (len(said) > MOST_UNREAD)
    return [*(f"left out: {line}" for line in said[:MOST_UNREAD]), *more]


# --------------------------------------------------------------------------------------------------- sensors


def _assigned(files: Sequence[LogFile]) -> tuple[dict[str, tuple[Triple, Decision]], list[Triple], list[str]]:
    """Return the best triple of each sensor by names, the rest, and a note where names are exchanged."""
    triples = [triple for file in files for triple in file.triples]
    named: dict[str, Triple] = {}
    alive = [triple for triple in triples if not _dead(triple)]
    for sensor in ORDER:
        mine = [t for t in alive or triples if t.sensor == sensor and t.penalty < NO_READING]
        mine = mine or [t for t in alive if t.sensor == sensor == "accelerometer" and linear_with_gravity(t)]
        if not mine:
            continue
        # of several one that moves, the one with gravity in it, then the plainest name, then the first
        light = sensor == "accelerometer"
        named[sensor] = min(mine, key=lambda t: (_still(t), light and weightless(t), t.penalty, triples.index(t)))
    wider = {sensor: wider_range(first, _like(first, alive)) for sensor, first in named.items()}
    named |= {sensor: item[0] for sensor, item in wider.items() if item is not None}
    meant, decisions, notes = exchanged(named)
    said = {item[1].what: item[1] for item in wider.values() if item is not None}
    said |= {decision.what: decision for decision in decisions}
    accel = meant.get("accelerometer")
    several = sum(t.sensor == "accelerometer" and t.penalty < NO_READING for t in triples) > 1
    if accel is not None and weightless(accel) and (several or not rests(accel)):
        del meant["accelerometer"], named["accelerometer"]  # no sensor's reading, and nothing here could use it
    found = {
        sensor: (triple, said.get(sensor) or Decision(sensor, triple.label, "certain", f"{triple.source} says so"))
        for sensor, triple in meant.items()
    }
    return found, [triple for triple in triples if triple not in named.values()], notes


def _like(first: Triple, triples: Sequence[Triple]) -> list[Triple]:
    """Return the others of a triple's kind that are a sensor's readings."""
    alike = [t for t in triples if t is not first and t.sensor == first.sensor and t.penalty < NO_READING]
    return [t for t in alike if t.sensor != "accelerometer" or not weightless(t)]


def _turned_about(
    clock: Clock, found: dict[str, tuple[Triple, Decision]], notes: list[str]
) -> tuple[dict[str, tuple[Triple, Decision]], list[str]]:
    """Return the sensors, gyroscope and accelerometer exchanged where the field turns as the other one says."""
    if notes or set(ORDER) - set(found):
        return found, notes
    times = _times(clock, clocks_of_files(clock, _triples(found)), found)
    fit = _turned(found, times)
    if fit is None or (fit.ratio < TELLING and _keeps_axis(fit, found["gyroscope"][0])):
        return found, notes
    field = found["magnetometer"][0]
    accel = found["accelerometer"][0]
    steps = steps_between(times["accelerometer"], accel.values, times["magnetometer"], field.values)
    other = best_worth(steps, WORTHS)
    if other is None or other.ratio >= TELLING or not _keeps_axis(other, accel):
        return found, notes
    why = f"it says how {field.label} turns ({100 * other.ratio:.0f} % of the changes left)"
    seen = {"gyroscope": ("accelerometer", f"{accel.label} is the gyroscope"), "accelerometer": ("gyroscope", why)}
    meant, decisions, said = exchanged({sensor: found[sensor][0] for sensor in seen}, seen)
    return {**found, **{one.what: (meant[one.what], one) for one in decisions}}, said


def _keeps_axis(fit: Fit, triple: Triple) -> bool:
    """Tell whether the field turns about the axis on which a triple reads most: a steady pull is like a rate on x."""
    axis = int(np.argmax(np.nanmean(triple.values**2, axis=0)))
    return bool(abs(fit.axes[axis, axis]) > 0.5)


def _dead(triple: Triple) -> bool:
    """Tell a sensor that reads exactly zero, or another number on all axes, throughout."""
    value = triple.values[np.isfinite(triple.values)]
    return value.size == 0 or bool(np.ptp(value) == 0)


def _still(triple: Triple) -> bool:
    """Tell a sensor each of whose axes reads one number throughout."""
    return bool(np.all(np.nanmax(triple.values, axis=0) == np.nanmin(triple.values, axis=0)))


def _others(found: dict[str, tuple[Triple, Decision]], left: Sequence[Triple]) -> list[tuple[Triple, str]]:
    """Return the triples that are a sensor's and are left out, each with a line that says why."""
    notes = []
    chosen = [triple for triple, _ in found.values()]
    for triple in left:
        sensor = triple.sensor
        if sensor is None:  # the same columns of another part tell the same
            sensor = next((name for name, (one, _) in found.items() if one.is_beside(triple)), None)
        if triple in chosen or sensor not in SENSORS:
            continue
        if _dead(triple):
            number = float(np.nanmax(triple.values, initial=-np.inf))
            why = f"all its rows are {f'{number:.9g}' if number else 'zero'}: it was not connected or not read"
        elif triple.sensor == "accelerometer" and (triple.penalty >= NO_READING or weightless(triple)):
            why = "worked out from other readings, or without gravity"
        else:
            why = "a second one" if sensor in found else "worked out from other readings"
        note = f"left out: {sensor} in {triple.label} of {triple.numbers.path.name} ({why})"
        notes.append((triple, note))
    return notes[:6]


def _with_unused(proposal: Proposal, tables: Sequence[Numbers], named: Sequence[Triple], own: OwnClocks) -> Proposal:
    """Return the proposal with lines on the columns that neither it nor a line of it names, the gravest first."""
    clocks = (proposal.clock, *own.clocks.values())
    stamps = {name for clock in clocks for name in (clock.column, clock.counter) if name is not None}
    said = " ".join([*proposal.notes, *(decision.text for decision in proposal.all_decisions)])
    used = {(triple.numbers.path, name) for triple in named for name in triple.names}
    for numbers in tables:
        columns = numbers.table.columns
        used |= {(numbers.path, name) for name in columns if name in stamps or is_time_name(name)}
        used |= {(numbers.path, name) for name in columns if f"'{name}'" in said}
        used |= {(numbers.path, columns[numbers.ids[0]])} if numbers.ids is not None else set()
    if proposal.fixes is not None:
        used |= {(proposal.fixes.numbers.path, name) for name in proposal.fixes.columns}
    asked = missing_axes(tables, used, {sensor.sensor for sensor in proposal.sensors})
    return replace(proposal, notes=(*asked, *proposal.notes, *unused_columns(tables, used, proposal.plant)))


def _nothing(raw: Path, files: Sequence[LogFile], failures: Sequence[InputError], either: str) -> InputError:
    rows = max(len(file.numbers.table) for file in files)
    if rows < FEWEST_ROWS:
        return InputError.at(raw, None, f"{rows} rows of numbers in it; expected a log of {FEWEST_ROWS} at least")
    columns = ", ".join(f"'{name}'" for name in files[0].numbers.table.columns[:12])
    also = f" ({len(failures)} other files there are no tables)" if failures else ""
    guessed = files[0].numbers.dialect.layout.encoding in ("cp1252", "latin-1") and not columns.isascii()
    also += "; the text is no UTF-8 and its encoding could not be told (save it as UTF-8)" * guessed
    also += "".join(f"; {asked}" for asked in missing_axes([file.numbers for file in files], (), ()))
    for numbers in (file.numbers for file in files if file.numbers.orientations):
        four = ", ".join(f"'{numbers.table.columns[k]}'" for k in numbers.orientations[0])
        also += f"; {four} are an orientation that was worked out, not what a sensor read: log the gyroscope, too"
        break
    for numbers in (file.numbers for file in files if len(file.numbers.names) == 3):
        if lines := lines_of_a_record(numbers.values):
            also += f"; a record seems to go over {lines} lines: write each on one line"
            break
    if alone := one_axis_rate([file.numbers for file in files]):
        also += f"; {alone} (docs/importing.md)"
    also += f"; {either}" * bool(either)
    if not also and (names := suggested(files[0].numbers)):
        also = f"; {names}"
    return InputError.at(
        raw,
        None,
        f"no sensor of motion found in the columns {columns}{also}; expected three columns each of a gyroscope, "
        "accelerometer or magnetometer; a map says which they are, and reads tracks and positions too: --map FILE of "
        f"your own, or a shipped one ({', '.join(model_names('imports'))})",
    )


# ----------------------------------------------------------------------------------------------------- clock


def _on(clock: Clock, numbers: Numbers) -> bool:
    needed = [name for name in (clock.column, clock.counter) if name is not None]
    return set(needed) <= set(numbers.table.columns)


def _triples(found: dict[str, tuple[Triple, Decision]]) -> dict[str, Triple]:
    return {sensor: triple for sensor, (triple, _) in found.items()}


def _one_clock(tables: Sequence[Numbers]) -> Clock:
    """Return the best clock that most of the tables have, or the first one's where each calls its time otherwise."""
    of_each = [clocks_of(numbers) for numbers in tables]
    clocks = [clock for found in of_each for clock in found]
    ranks = {"certain": 0, "likely": 1, "guess": 2}
    shared = [clock for clock in clocks if sum(_on(clock, numbers) for numbers in tables) > len(tables) / 2]
    if all(clock.column is None for clock in shared) and all(found[0].column is not None for found in of_each):
        shared = of_each[0]

    def order(clock: Clock) -> tuple[bool, float, int]:
        # a column that is one sensor's own stands behind the file's, but for one that is a guess
        own = clock.column is not None and sensor_of(timeless(clock.column)) is not None
        return clock.column is None, ranks[clock.decision.sure] + 1.5 * own, clocks.index(clock)

    return min(shared, key=order)


def _fitted(
    clock: Clock, unit: Unit, found: dict[str, tuple[Triple, Decision]], times: dict[str, FloatArray]
) -> tuple[Clock, float]:
    """Return a clock without stamps with the step that the gyroscope and the field's turning give, and their ratio."""
    if clock.decision.sure != "guess" or unit.decision.sure == "guess":
        return clock, 1.0
    fit = _turned(found, times, [float(unit.factor("rad_s") * factor) for factor in FACTORS])
    if fit is None or fit.ratio > TELLING:
        return clock, 1.0
    ratio = fit.worth / unit.factor("rad_s")
    assert clock.step is not None
    step = float(f"{clock.step * ratio:.3g}")
    if not SPACING[0] <= step <= SPACING[1]:
        return clock, 1.0
    # a column of time that tells none is named still
    none = clock.decision.why.partition("; rows taken as")[0]
    why = f"{none}; with this step the field turns as fast as the gyroscope says ({unit.unit})"
    why += f"; '{clock.counter}' counts the rows" * bool(clock.counter)
    why += "; only small turns tell it, to a fifth or so: state step_s" * (not fit.sharp)
    told = Decision("time", f"{step} s a row", "likely" if fit.sharp else "guess", why)
    return clock.with_step(step, told, OFF_FITTED if fit.sharp else OFF_LOOSE), step / clock.step


# -------------------------------------------------------------------------------------------------- proposal


@dataclass(frozen=True)
class _Sniffed:
    """What a raw log holds, before its times, units and axes are decided: its sensors, and clocks of their own.

    ``down`` is the share of the field that points down at the place, None where that is not known.
    """

    raw: Path
    plant: Plant
    layout: Layout
    own: OwnClocks
    found: dict[str, tuple[Triple, Decision]]
    notes: list[str]
    down: float | None = None


def _proposal(sniffed: _Sniffed, clock: Clock, offsets: Mapping[str, tuple[float, Decision]]) -> Proposal:
    """Return the map of a log by a clock, its sensors' times moved by ``offsets``, s."""
    own, found = sniffed.own, sniffed.found
    times = _times(clock, own, found)
    times |= {sensor: times[sensor] + offset for sensor, (offset, _) in offsets.items()}
    fit = _turned(found, times)
    turns = seen_turns(_triples(found), times, fit)
    units: dict[str, Unit] = {}
    for sensor in sorted(found):  # the accelerometer first: that one is counted is told by gravity
        triple, _ = found[sensor]
        sound = np.isfinite(triple.values).all(axis=1)
        value = triple.values if sound.all() else triple.values[sound]
        stated, above = _stated(sensor, triple, value)
        if sensor == "gyroscope":
            told = turns if clock.column is not None else None
            by = told.by if told else "the field"
            sure = clock.decision.sure
            units[sensor] = gyroscope_unit(
                value, stated, told and told.worth, by, clock=sure, beside=units.get("accelerometer")
            )
        elif sensor == "accelerometer":
            units[sensor] = accelerometer_unit(value, stated)
        else:
            counts = any("a count" in unit.decision.choice for unit in units.values())
            units[sensor] = magnetometer_unit(value, stated, counts=counts)
        if above and stated is not None and units[sensor].scale == stated.scale:
            text = f"{stated.scale:.6g} {stated.unit} a count"
            why = units[sensor].decision.why.replace("the header says so", "a line above the table says so")
            units[sensor] = units[sensor]._replace(decision=Decision(f"{sensor} unit", text, "certain", why))
    seen, pull = by_each_other(_triples(found), times, units, timed=clock.decision.sure != "guess")
    units = dict(seen)
    if "gyroscope" in found and turns is None and found["gyroscope"][0].units:
        gyro = found["gyroscope"][0].values
        if not swings_once_a_turn(Reading3(times["gyroscope"], gyro)):
            units = {**units, "gyroscope": doubted(units["gyroscope"], float(np.nanmax(np.abs(gyro))), pull)}
    if "gyroscope" in found and not own.clocks:
        ticks = ticking(clock, units["gyroscope"], turns, pull, _triples(found), times)
        if ticks is not None:
            return _proposal(sniffed, ticks, offsets)
    notes = [*_on_time(clock, found, times, units, turns, pull), *sniffed.notes]
    if clock.column is None and "gyroscope" in units:
        clock, slower = _fitted(clock, units["gyroscope"], found, times)
        times = {sensor: slower * time for sensor, time in times.items()}
        notes = [*filter(None, [counter_note(clock)]), *notes]
    readings = {sensor: in_si(sensor, triple, times[sensor], units[sensor]) for sensor, (triple, _) in found.items()}
    axes = _body_axes(readings, sniffed)
    sensors = [
        replace(
            one,
            layout=own_layout(one.triple.numbers, sniffed.layout),
            time_offset=offsets[one.sensor][0] if one.sensor in offsets else None,
        )
        for one in _sensors(sniffed, units, axes, readings)
    ]
    decided = (*own.decisions, *(told for _, told in offsets.values()), *axes.decisions)
    decisions = decided if found else ()  # positions alone have no axes of a board
    head = (_name(sniffed.raw), sniffed.raw, sniffed.plant, sniffed.layout, clock)
    return Proposal(*head, tuple(sensors), decisions, (*axes.notes, *notes))


def _sensors(
    sniffed: _Sniffed, units: Mapping[str, Unit], axes: BodyAxes, readings: Mapping[str, Reading3]
) -> list[ProposedSensor]:
    """Return the sensors with their units, axes and clocks, and the range at which a gyroscope's readings stand."""
    own, found = sniffed.own, sniffed.found
    # a table may be told to turn at just such a rate
    clips = "gyroscope" in found and sniffed.plant != "rate_table"
    limits = {"gyroscope": full_scale(readings["gyroscope"])} if clips else {}
    return [
        ProposedSensor(s, triple, decision, units[s], axes.matrix[s], own.clocks.get(s), limits.get(s))
        for s, (triple, decision) in found.items()
    ]


def _body_axes(readings: Mapping[str, Reading3], sniffed: _Sniffed) -> BodyAxes:
    """Return how the sensors lie in the body; an accelerometer that shows gravity itself is turned about first."""
    turned = "accelerometer" in readings and shows_gravity(sniffed.found["accelerometer"][0].numbers.table.columns)
    if not turned:
        return body_axes(readings, sniffed.down)
    pull = readings["accelerometer"]
    axes = body_axes({**readings, "accelerometer": replace(pull, value=-pull.value)}, sniffed.down)
    matrix = {**axes.matrix, "accelerometer": -axes.matrix["accelerometer"]}
    return replace(axes, matrix=matrix, decisions=(GRAVITY_ITSELF, *axes.decisions))


def _name(raw: Path) -> str:
    return re.sub(r"[^\w.-]+", "-", raw.resolve().stem).strip("-") or "log"


def _offsets(
    proposal: Proposal, own: OwnClocks, found: dict[str, tuple[Triple, Decision]]
) -> dict[str, tuple[float, Decision]]:
    """Return by how much a sensor's times are to be moved (s) where files or columns of time are on clocks that differ.

    Empty where all is in one file and on its clock, and where nothing tells an offset.
    """
    files = {sensor: triple.numbers.path for sensor, (triple, _) in found.items()}
    if len(set(files.values())) == 1 and not own.clocks:
        return {}
    times = _times(proposal.clock, own, found)
    readings = {one.sensor: in_si(one.sensor, one.triple, times[one.sensor], one.unit) for one in proposal.sensors}
    late = late_clock(readings, {one.sensor: one.axes for one in proposal.sensors})
    if late is None:
        return {}
    return {late.sensor: moved(late, {sensor: path.name for sensor, path in files.items()})}


def _times(clock: Clock, own: OwnClocks, found: dict[str, tuple[Triple, Decision]]) -> dict[str, FloatArray]:
    """Return the times (n,) of each sensor's rows, s."""
    return {
        sensor: seconds(own.clocks.get(sensor, clock), triple.numbers)[triple.rows]
        for sensor, (triple, _) in found.items()
    }


def _on_time(
    clock: Clock,
    found: dict[str, tuple[Triple, Decision]],
    times: dict[str, FloatArray],
    units: dict[str, Unit],
    turns: SeenTurns | None,
    pull: float | None,
) -> list[str]:
    """Return what contradicts the stamps: the turning of what stands still in the room, a rate that is stated."""
    notes = [clock_note(clock, units["gyroscope"], turns, pull)] if "gyroscope" in units else []
    for sensor, (triple, _) in list(found.items())[:1]:
        above = (*triple.numbers.dialect.preamble, triple.numbers.path.stem)
        notes.append(rate_note(clock, times[sensor], stated_rate(above)))
    return [note for note in notes if note]


def _stated(sensor: str, triple: Triple, value: FloatArray) -> tuple[Reading | None, bool]:
    """Return the unit that names state, or of whole numbers the lines above the table, and whether these did."""
    stated = triple.units[0] if triple.units else None
    if (stated is None or stated.unit == COUNTS) and np.array_equal(value, np.round(value)):
        worth = stated_worths(triple.numbers.dialect.preamble).get(sensor)
        return worth or stated, worth is not None
    return stated, False


def _turned(
    found: dict[str, tuple[Triple, Decision]], times: dict[str, FloatArray], worths: Sequence[float] = WORTHS
) -> Fit | None:
    if "gyroscope" not in found or "magnetometer" not in found:
        return None
    gyro, field = found["gyroscope"][0], found["magnetometer"][0]
    steps = steps_between(times["gyroscope"], gyro.values, times["magnetometer"], field.values)
    return best_worth(steps, worths)
