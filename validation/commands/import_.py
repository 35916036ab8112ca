"""``discsim import``: a raw logger file to a recording, by a map of columns, units and repairs, or without one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from validation.options import OutOption

if TYPE_CHECKING:
    from validation.importing import Imported
    from validation.importing.sniffing import Stretch
    from validation.run import Run

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
) -> None:
    """Turn a raw logger file into a recording folder.

    Writes recording.toml, one CSV file per sensor, repairs.csv (what was repaired or left out, by line) and raw.html
    (all traces, the throws found, the map with its reasons) into --out; without --map also the map that it proposes,
    map.toml.

    Example: discsim import my-log.csv --throw 1 --out throw-1
    or, with a map: discsim import 2025-08-31-001-rb.csv --map flatball --rows 1590:1830 --out throw-1
    """
    from discsim.errors import InputError
    from discsim.files import write_text
    from validation.importing import find_map, parse_rows, read_map, read_readings
    from validation.importing.sniffing import opened, recognised, sniff, stretches
    from validation.importing.sniffing.chosen import chosen_recordings
    from validation.importing.sniffing.proposal import map_text
    from validation.importing.sniffing.raw_page import write_raw_page
    from validation.run import start_run

    if sum((rows is not None, throw is not None, all_throws)) > 1:
        raise InputError("--rows, --throw and --all-throws: expected one of them at most")
    chosen = None if rows is None else parse_rows(rows)
    named = None if map_ in ("auto", "sniff") else read_map(find_map(map_))
    source = (raw if raw.is_dir() else raw.parent).resolve()
    if out.resolve() == source:
        raise InputError(f"--out {out}: the raw files are in it; expected another folder, to leave them as they are")
    with opened(raw) as place:
        proposal = None
        if named is None:
            named = recognised(place) if map_ == "auto" else None
            proposal = sniff(place, plant) if named is None else None
        target = write_map or out / "map.toml"
        with start_run(out, None, [raw, *([named.path] if named else [])]) as run:
            if proposal is not None:
                write_text(target, map_text(proposal))
                named = read_map(target)
                for decision in proposal.all_decisions:
                    run.step(decision.text)
                for remark in (*proposal.notes, f"the map with its reasons is in {target}"):
                    run.step(remark)
            elif map_ == "auto":
                assert named is not None
                run.step(
                    f"the shipped map '{named.name}' was made for these columns: it is taken (--map sniff asks anew)"
                )
            assert named is not None
            read = read_readings(place, named)
            throws = stretches(read)
            recordings = chosen_recordings(read, throws, chosen, throw, every=all_throws)
            decisions = [] if proposal is None else proposal.all_decisions
            write_raw_page(out / "raw.html", raw.name, read, throws, decisions, named.path.read_text(encoding="utf-8"))
            _write(run, recordings, one_folder=not all_throws)
    _say(raw, recordings, throws, whole=rows is None and throw is None and not all_throws)


def _write(run: Run, recordings: list[Imported], *, one_folder: bool) -> None:
    from discsim.files import write_text
    from discsim.recording import write_recording
    from validation.importing import repairs_csv

    write_text(run.out / "repairs.csv", repairs_csv(recordings[0].repairs))
    for number, result in enumerate(recordings, start=1):
        write_recording(result.recording, run.out if one_folder else run.out / f"{number:02d}")
    for note in dict.fromkeys(note for result in recordings for note in result.notes):
        run.step(note)
    run.step(recordings[0].summary)


def _say(raw: Path, recordings: list[Imported], throws: list[Stretch], *, whole: bool) -> None:
    for number, result in enumerate(recordings, start=1):
        name = f"{number:02d} " if len(recordings) > 1 else ""
        for sensor, samples in result.recording.samples.items():
            span = f"{samples.t[0]:.3f} to {samples.t[-1]:.3f} s"
            typer.echo(f"{name}{sensor}: {len(samples)} samples, {span}, {samples.gaps} gaps")
    for number, found in enumerate(throws, start=1):
        typer.echo(f"throw {number}: {found.text}")
    if whole and throws:
        typer.echo(f"the whole log was taken; --throw {'1' if len(throws) == 1 else 'N'} takes one throw")
