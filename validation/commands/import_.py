"""``discsim import``: a raw logger file to a recording, by a map of columns, units, rates and repairs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from validation.options import DateOption, OutOption, PlaceOption

__all__ = ["command"]


def command(
    raw: Annotated[Path, typer.Argument(help="What the logger wrote: a file, or a folder with one file per sensor.")],
    map_: Annotated[str, typer.Option("--map", help="A shipped map's name, or a map of your own (a .toml file).")],
    rows: Annotated[
        str | None, typer.Option(help="0-based data rows A up to B of the first sensor's file. Default: all.")
    ] = None,
    out: OutOption = Path("imported"),
    place: PlaceOption = None,
    date: DateOption = None,
) -> None:
    """Turn a raw logger file into a recording folder.

    Writes recording.toml, one CSV file per sensor and repairs.csv (what was repaired or left out, by line) into --out.
    Ends with what `discsim check` finds wrong in the recording.

    Example: discsim import 2025-08-31-001-rb.csv --map flatball --rows 1590:1830 --out throw-1
    """
    from dataclasses import replace

    from discsim.errors import InputError
    from discsim.files import write_text
    from discsim.recording import write_recording
    from validation.checking import check_recording
    from validation.diagnosis.setup import find_setup_faults
    from validation.importing import find_map, import_recording, parse_rows, read_map, repairs_csv
    from validation.options import at_place
    from validation.run import start_run

    import_map = read_map(find_map(map_))
    chosen = None if rows is None else parse_rows(rows)
    source = (raw if raw.is_dir() else raw.parent).resolve()
    if out.resolve() == source:
        raise InputError(f"--out {out}: the raw files are in it; expected another folder, to leave them as they are")
    import_map = replace(import_map, environment=at_place(import_map.environment, place, date))
    result = import_recording(raw, import_map, chosen)
    with start_run(out, None, [raw, import_map.path]) as run:
        write_text(out / "repairs.csv", repairs_csv(result.repairs))
        write_recording(result.recording, out)
        for note in result.notes:
            run.step(note)
        run.step(result.summary)
        for advice in check_recording(result.recording).advice:
            run.step(advice)
        axes = {sensor: own.axes for sensor, own in import_map.sensors.items()}
        for fault in find_setup_faults([result.recording]).faults:
            run.step(f"warning: {fault.id}: {fault.advice(axes)}")
    for sensor, samples in result.recording.samples.items():
        typer.echo(
            f"{sensor}: {len(samples)} samples, {samples.t[0]:.3f} to {samples.t[-1]:.3f} s, {samples.gaps} gaps"
        )
