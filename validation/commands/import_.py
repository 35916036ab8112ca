"""``discsim import``: a raw logger file to a recording, by a map of columns, units and repairs, or without one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, NamedTuple, TypeAlias

import typer

from discsim.validation.reporting.options import DateOption, OutOption, PlaceOption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from discsim.environment import Environment
    from discsim.validation.importing import ImportMap
    from discsim.validation.importing.imported_log import LogPart
    from discsim.validation.importing.sniffing import Proposal
    from discsim.validation.reporting.run import Run

__all__ = ["command"]


MapOption: TypeAlias = Annotated[
    str,
    typer.Option(
        "--map",
        help="A shipped map's name, a map of your own (a .toml file), 'sniff': propose one, or 'auto': the shipped "
        "map that was made for this logger, else propose one.",
    ),
]


def command(
    raw: Annotated[
        Path,
        typer.Argument(
            help="What the logger wrote: a file, a zip, a folder with one file per sensor, or one per throw."
        ),
    ],
    map_: MapOption = "auto",
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
    """Turn a logger's file or a camera's track into a recording.

    Writes recording.toml, one CSV file per sensor, repairs.csv (what was repaired or left out, by line) and raw.html
    (all traces, the throws found, the map with its reasons) into --out; without --map also the map that it proposes,
    map.toml. Ends with what `discsim check` finds wrong in the recording.

    Example: discsim import my-log.csv --throw 1 --out throw-1
    or, with a map: discsim import 2025-08-31-001-rb.csv --map flatball --rows 1590:1830 --out throw-1
    """
    from discsim.environment import Environment
    from discsim.validation.importing import find_map, parse_rows, read_map
    from discsim.validation.importing.imported_log import LogPart
    from discsim.validation.importing.sniffing import listed, opened, several_logs
    from discsim.validation.reporting.options import at_place

    part = LogPart(None if rows is None else parse_rows(rows), throw, all_throws)
    part.check()
    there = at_place(Environment(), place, date)  # what is wrong with them is said before a long log is read
    named = None if map_ in ("auto", "sniff") else read_map(find_map(map_))
    _leave_alone(raw, out)
    asked = _Asked(raw, map_, named, part, plant, write_map, place, date, there)
    said: list[str] = []
    with opened(raw, said.append) as logged:
        logs = several_logs(logged)
        if not logs:
            _import(asked, logged, raw.name, out, said)
            return
        typer.echo(f"{len(logs)} logs of the same columns in {raw.name}: {listed(logs)}; each is imported by itself")
        done = _each(asked, logs, out)
    kind = "a data set each" if all_throws else "recordings of one data set"
    typer.echo(f"{kind}: discsim diagnose {' '.join(map(str, done)) if all_throws else out}")


class _Asked(NamedTuple):
    """What was asked of an import, for each log of a folder.

    ``named`` is the map of that name; ``there`` an environment at ``place`` of which nothing else is known.
    """

    raw: Path
    map_: str
    named: ImportMap | None
    part: LogPart
    plant: Literal["free_spin", "rate_table"]
    write_map: Path | None
    place: str | None
    date: str | None
    there: Environment


def _each(asked: _Asked, logs: Sequence[Path], out: Path) -> list[Path]:
    """Import each of several logs into a folder of its own, and return these; one that fails is told and left out."""
    from discsim.errors import InputError

    done: list[Path] = []
    failures: list[InputError] = []
    twice = len({log.stem for log in logs}) < len(logs)
    for log in logs:
        target = out / (log.name if twice else log.stem)
        typer.echo(f"{log.name}:")
        try:
            _import(asked, log, log.name, target, [])
            done.append(target)
        except InputError as error:
            typer.echo(f"LEFT OUT: {error}", err=True)
            failures.append(error)
    if not done:
        raise failures[0]
    return done


def _import(asked: _Asked, logged: Path, name: str, out: Path, said: list[str]) -> None:
    """Import one log that is `opened` into ``out``; ``said`` are notes on how it was read."""
    from discsim.validation.importing.imported_log import take
    from discsim.validation.importing.resting import dip_at_rest
    from discsim.validation.importing.sniffing import recognised, sniff
    from discsim.validation.reporting.options import at_place
    from discsim.validation.reporting.place import swapped_place
    from discsim.validation.reporting.run import start_run

    place, date = asked.place, asked.date
    known = recognised(logged) if asked.map_ == "auto" else asked.named
    down = None if place is None else asked.there.field_down  # the usual field of an environment is of no place
    proposal = sniff(logged, asked.plant, down) if known is None else None
    if proposal is not None and place is not None:
        proposal = proposal.in_field(asked.there.field_strength)
    if known is not None and asked.named is None:
        said.append(f"taken: the shipped map '{known.name}', made for these columns (--map sniff asks anew)")
    with start_run(out, None, [asked.raw, *([known.path] if known else [])]) as run:
        _tell(run, said)
        decisions = proposal.all_decisions if proposal else []
        doubt = proposal.place.doubt(place) if proposal and proposal.place and place else None
        import_map = known or _proposed(run, proposal, asked.write_map or out / "map.toml")
        proposal = None  # its table is as large as the one that is read now
        import_map = replace(import_map, environment=at_place(import_map.environment, place, date))
        found = take(logged, name, import_map, asked.part, decisions)
        found.report(out)
        run.replace_recordings()
        dip = dip_at_rest(found.read.readings, import_map.environment.gravity)
        _tell(run, [*found.remarks, *filter(None, [doubt, swapped_place(place, date, found.recordings, dip)])])
    for line in found.lines:
        typer.echo(line)


def _tell(run: Run, notes: Sequence[str]) -> None:
    for note in notes:
        run.step(note)


def _leave_alone(raw: Path, out: Path) -> None:
    """Refuse to write where the raw files are."""
    from discsim.errors import InputError

    if out.resolve() == (raw if raw.is_dir() else raw.parent).resolve():
        raise InputError(f"--out {out}: the raw files are in it; expected another folder, to leave them as they are")


def _proposed(run: Run, proposal: Proposal | None, target: Path) -> ImportMap:
    """Write a proposed map, say what was decided, and return the map as it is read."""
    from discsim.files import write_text
    from discsim.validation.importing import read_map
    from discsim.validation.importing.sniffing import map_text

    assert proposal is not None
    write_text(target, map_text(proposal))
    for decision in proposal.all_decisions:
        run.step(decision.text)
    for remark in (*proposal.notes, f"the map with its reasons: {target}"):
        run.step(remark)
    return read_map(target)
