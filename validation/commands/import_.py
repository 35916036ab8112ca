"""``discsim import``: a raw logger file to a recording, by a map of columns, units and repairs, or without one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple

import typer

from validation.reporting.options import DateOption, OutOption, PlaceOption

if TYPE_CHECKING:
    from validation.importing import Imported, ImportMap
    from validation.importing.sniffing import Decision, Proposal, Stretch
    from validation.reporting.run import Run

__all__ = ["command"]


def command(
    raw: Annotated[
        Path, typer.Argument(help="What the logger wrote: a file, a zip, or a folder with one file per sensor.")
    ],
    map_: Annotated[
        str,
        typer.Option(
            "--map",
            help="A shipped map's name, a map of your own (a .toml file), 'sniff': propose one, or 'auto': the shipped "
            "map that was made for this logger, else propose one.",
        ),
    ] = "auto",
    rows: Annotated[
        str | None, typer.Option(help="0-based data rows A up to B of the first sensor's file. Default: all.")
    ] = None,
    throw: Annotated[int | None, typer.Option(min=1, help="Take this one of the throws found, counted from 1.")] = None,
    all_throws: Annotated[
        bool, typer.Option("--all-throws", help="Write a data set: a recording of each throw found.")
    ] = False,
    plant: Annotated[
        Literal["free_spin", "rate_table"], typer.Option(help="What a proposed map takes the log for.")
    ] = "free_spin",
    write_map: Annotated[
        Path | None, typer.Option(help="Where a proposed map is written. Default: map.toml in --out.")
    ] = None,
    out: OutOption = Path("imported"),
    place: PlaceOption = None,
    date: DateOption = None,
) -> None:
    """Turn a raw logger file into a recording folder.

    Writes recording.toml, one CSV file per sensor, repairs.csv (what was repaired or left out, by line) and raw.html
    (all traces, the throws found, the map with its reasons) into --out; without --map also the map that it proposes,
    map.toml. Ends with what `discsim check` finds wrong in the recording.

    Example: discsim import my-log.csv --throw 1 --out throw-1
    or, with a map: discsim import 2025-08-31-001-rb.csv --map flatball --rows 1590:1830 --out throw-1
    """
    from validation.importing import find_map, read_map
    from validation.importing.sniffing import opened, recognised, sniff
    from validation.reporting.options import at_place
    from validation.reporting.run import start_run

    part = _part(rows, throw, all_throws)
    named = None if map_ in ("auto", "sniff") else read_map(find_map(map_))
    _leave_alone(raw, out)
    said: list[str] = []
    with opened(raw, said.append) as logged:
        known = recognised(logged) if map_ == "auto" else named
        proposal = sniff(logged, plant) if known is None else None
        decisions = [] if proposal is None else proposal.all_decisions
        with start_run(out, None, [raw, *([known.path] if known else [])]) as run:
            if known is not None and named is None:
                said.append(f"taken: the shipped map '{known.name}', made for these columns (--map sniff asks anew)")
            _tell(run, said)
            import_map = known or _proposed(run, proposal, write_map or out / "map.toml")
            proposal = None  # its table is as large as the one that is read now
            import_map = replace(import_map, environment=at_place(import_map.environment, place, date))
            _say(*_imported(run, raw.name, logged, import_map, part, decisions), whole=part.whole)


class _Part(NamedTuple):
    """What of a log is taken: rows, a throw by its number, every throw as a recording of its own, or all of it."""

    rows: slice | None
    throw: int | None
    every: bool

    @property
    def whole(self) -> bool:
        return self.rows is None and self.throw is None and not self.every


def _tell(run: Run, notes: list[str]) -> None:
    for note in notes:
        run.step(note)


def _part(rows: str | None, throw: int | None, all_throws: bool) -> _Part:
    from discsim.errors import InputError
    from validation.importing import parse_rows

    if sum((rows is not None, throw is not None, all_throws)) > 1:
        raise InputError("--rows, --throw and --all-throws: expected one of them at most")
    return _Part(None if rows is None else parse_rows(rows), throw, all_throws)


def _leave_alone(raw: Path, out: Path) -> None:
    """Refuse to write where the raw files are."""
    from discsim.errors import InputError

    if out.resolve() == (raw if raw.is_dir() else raw.parent).resolve():
        raise InputError(f"--out {out}: the raw files are in it; expected another folder, to leave them as they are")


def _proposed(run: Run, proposal: Proposal | None, target: Path) -> ImportMap:
    """Write a proposed map, say what was decided, and return the map as it is read."""
    from discsim.files import write_text
    from validation.importing import read_map
    from validation.importing.sniffing import map_text

    assert proposal is not None
    write_text(target, map_text(proposal))
    for decision in proposal.all_decisions:
        run.step(decision.text)
    for remark in (*proposal.notes, f"the map with its reasons: {target}"):
        run.step(remark)
    return read_map(target)


def _imported(
    run: Run, name: str, logged: Path, import_map: ImportMap, part: _Part, decisions: list[Decision]
) -> tuple[list[Imported], list[Stretch]]:
    """Read a log by a map, write the part that is asked for with the page of all traces; return it and the throws."""
    from validation.importing import read_readings
    from validation.importing.sniffing import stretches, write_raw_page
    from validation.importing.sniffing.chosen import chosen_recordings

    read = read_readings(logged, import_map, part.rows)
    throws = stretches(read)
    recordings = chosen_recordings(read, throws, part.rows, part.throw, every=part.every)
    write_raw_page(run.out / "raw.html", name, read, throws, decisions)
    _write(run, recordings, import_map, one_folder=not part.every)
    return recordings, throws


def _write(run: Run, recordings: list[Imported], import_map: ImportMap, *, one_folder: bool) -> None:
    from discsim.files import write_text
    from discsim.recording import write_recording
    from validation.checking import check_recording
    from validation.diagnosis.setup import find_setup_faults
    from validation.importing import repairs_csv

    write_text(run.out / "repairs.csv", repairs_csv(recordings[0].repairs))
    for number, result in enumerate(recordings, start=1):
        write_recording(result.recording, run.out if one_folder else run.out / f"{number:02d}")
    for note in dict.fromkeys(note for result in recordings for note in result.notes):
        run.step(note)
    run.step(recordings[0].summary)
    advice = [advice for result in recordings for advice in check_recording(result.recording).advice]
    for text in dict.fromkeys(advice):
        run.step(text)
    axes = {sensor: own.axes for sensor, own in import_map.sensors.items()}
    for fault in find_setup_faults([result.recording for result in recordings]).faults:
        run.step(f"warning: {fault.id}: {fault.advice(axes)}")


def _say(recordings: list[Imported], throws: list[Stretch], *, whole: bool) -> None:
    for number, result in enumerate(recordings, start=1):
        name = f"{number:02d} " if len(recordings) > 1 else ""
        for sensor, samples in result.recording.samples.items():
            span = f"{samples.t[0]:.3f} to {samples.t[-1]:.3f} s"
            typer.echo(f"{name}{sensor}: {len(samples)} samples, {span}, {samples.gaps} gaps")
    for number, found in enumerate(throws, start=1):
        typer.echo(f"throw {number}: {found.text}")
    if whole and throws:
        typer.echo(f"the whole log was taken; --throw {'1' if len(throws) == 1 else 'N'} takes one throw")
