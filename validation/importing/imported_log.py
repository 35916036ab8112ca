"""`import_log` and what it gives: the recordings of a raw log, the throws found in it, and the files of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from discsim.environment import Environment
from discsim.errors import InputError, require_path
from discsim.files import write_text
from discsim.recording import Recording, write_recording
from discsim.result import Result
from discsim.threads import one_thread
from discsim.validation.checking import check_recording
from discsim.validation.diagnosis.setup import find_setup_faults, suspected_fault
from discsim.validation.importing.conversion import Imported, RawReadings, read_readings, repairs_csv
from discsim.validation.importing.guesses import write_guesses
from discsim.validation.importing.import_map import ImportMap, find_map, read_map
from discsim.validation.importing.raw_table import Repair
from discsim.validation.importing.resting import rest_notes
from discsim.validation.importing.sniffing import (
    Decision,
    Stretch,
    listed,
    map_text,
    opened,
    recognised,
    several_logs,
    sniff,
    stretches,
    write_raw_page,
)
from discsim.validation.importing.sniffing.chosen import chosen_recordings

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["ImportedLog", "LogPart", "import_log", "take"]


class LogPart(NamedTuple):
    """What of a log is taken: rows, a throw by its number, every throw as a recording of its own, or all of it."""

    rows: slice | None = None
    throw: int | None = None
    every: bool = False

    def check(self) -> None:
        """Raise `InputError` where more than one part is asked for."""
        if sum((self.rows is not None, self.throw is not None, self.every)) > 1:
            raise InputError("--rows, --throw and --all-throws: expected one of them at most")

    @property
    def whole(self) -> bool:
        """Whether all of the log is taken."""
        return self.rows is None and self.throw is None and not self.every


@dataclass(frozen=True, repr=False)
class ImportedLog(Result):
    """A raw log as recordings.

    Attributes
    ----------
    name : str
        The raw file's.
    imported : tuple of Imported
        Each recording with what was repaired and noted.
    throws : tuple of Stretch
        The throws found in the whole log.
    import_map : ImportMap
        The map that it was read by.
    part : LogPart
        What of the log was taken.
    read : RawReadings
        All readings in SI and body axes, before any row was chosen.
    decisions : tuple of Decision
        What a proposed map decided, with reasons; empty with a map that was given.
    map_text : str
        The proposed map as TOML; empty with a map that was given.
    notes : tuple of str
        What a proposed map leaves out, and what was asked about names; empty with a map that was given.
    """

    name: str
    imported: tuple[Imported, ...]
    throws: tuple[Stretch, ...]
    import_map: ImportMap
    part: LogPart
    read: RawReadings
    decisions: tuple[Decision, ...] = ()
    map_text: str = ""
    notes: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"<ImportedLog '{self.name}': {len(self.imported)} recordings, {len(self.throws)} throws found>"

    @property
    def recordings(self) -> list[Recording]:
        """The recordings."""
        return [one.recording for one in self.imported]

    @property
    def remarks(self) -> list[str]:
        """What was repaired and noted, and what `check` finds wrong: a line each."""
        lines = list(dict.fromkeys(note for one in self.imported for note in one.notes))
        lines += rest_notes(self.read.readings, self.import_map.environment)
        lines.append(self.imported[0].summary)
        lines += dict.fromkeys(advice for one in self.recordings for advice in check_recording(one).advice)
        axes = {sensor: own.axes for sensor, own in self.import_map.sensors.items()}
        setup = find_setup_faults(self.recordings)
        faults = [*setup.faults, *filter(None, [suspected_fault(setup)])]
        return lines + [f"warning: {fault.id}: {fault.advice(axes)}" for fault in faults]

    @property
    def lines(self) -> list[str]:
        """The rows of each sensor and the throws found: a line each."""
        lines = []
        for number, recording in enumerate(self.recordings, start=1):
            label = f"{number:02d} " if len(self.imported) > 1 else ""
            for sensor, samples in recording.samples.items():
                span = f"{samples.t[0]:.3f} to {samples.t[-1]:.3f} s"
                missing = np.isnan(samples.value)
                gaps = np.count_nonzero(missing[..., ~missing.all(axis=0)])  # a velocity that no receiver tells is none
                lines.append(f"{label}{sensor}: {len(samples)} samples, {span}, {gaps} gaps")
        lines += [f"throw {number}: {found.text}" for number, found in enumerate(self.throws, start=1)]
        if self.part.whole and self.throws:
            lines.append(f"the whole log was taken; --throw {'1' if len(self.throws) == 1 else 'N'} takes one throw")
        return lines

    def summary(self) -> str:
        """Return what was decided and left out, the rows of each sensor, the throws, and the remarks: a line each."""
        return "\n".join([*(decision.text for decision in self.decisions), *self.notes, *self.lines, *self.remarks])

    def table(self) -> dict[str, list[Any]]:
        """Return a row for each repair: recording, and what repairs.csv has."""
        rows = [(one.recording.name, repair) for one in self.imported for repair in one.repairs]
        columns = {key: [getattr(repair, key) for _, repair in rows] for key in Repair._fields}
        return {"recording": [name for name, _ in rows], **columns}

    def to_xarray(self) -> xr.Dataset:
        """Return the readings of the first recording (`Recording.to_xarray`)."""
        return self.recordings[0].to_xarray()

    def plot(self) -> Figure:
        """Return a figure of the readings of the first recording."""
        return self.recordings[0].plot()

    def report(self, folder: Path | str) -> Path:
        """Write the recording (of every throw: a data set), repairs.csv, raw.html and a proposed map into ``folder``.

        What the map guessed stands in guesses.txt beside each recording, where `discsim estimate` reads it. Returns the
        path of raw.html.
        """
        out = Path(folder)
        out.mkdir(parents=True, exist_ok=True)
        read = self.read
        if self.map_text:
            write_text(out / "map.toml", self.map_text)
            read = replace(read, import_map=replace(read.import_map, path=out / "map.toml"))
        write_raw_page(out / "raw.html", self.name, read, self.throws, self.decisions)
        write_text(out / "repairs.csv", repairs_csv(self.imported[0].repairs))
        for number, recording in enumerate(self.recordings, start=1):
            own = out / f"{number:02d}" if self.part.every else out
            write_recording(recording, own)
            write_guesses(own, self.decisions)
        return out / "raw.html"


def take(
    logged: Path, name: str, import_map: ImportMap, part: LogPart, decisions: Sequence[Decision] = ()
) -> ImportedLog:
    """Read a log that is `opened` by a map and take a part of it; ``name`` is what its page calls it."""
    read = read_readings(logged, import_map, part.rows)
    throws = stretches(read)
    imported = chosen_recordings(read, throws, part.rows, part.throw, every=part.every)
    return ImportedLog(name, tuple(imported), tuple(throws), import_map, part, read, tuple(decisions))


@one_thread
def import_log(
    raw: Path | str,
    map: str = "auto",
    *,
    rows: slice | None = None,
    throw: int | None = None,
    every_throw: bool = False,
    plant: Literal["free_spin", "rate_table"] = "free_spin",
    environment: Environment | None = None,
) -> ImportedLog:
    """Read a raw logger file as recordings.

    Parameters
    ----------
    raw
        What the logger wrote: a file, a zip, or a folder with one file per sensor.
    map : str
        A shipped map's name, a .toml file, ``sniff`` (propose one), or ``auto``: the shipped map that was made for this
        logger, else a proposed one.
    rows, throw, every_throw
        One of them at most: rows of the first sensor's file, the throw of that number (from 1), or a recording of each
        throw. By default all of the log is one recording.
    plant : str
        What a proposed map takes the log for.
    environment : Environment, optional
        Where it was recorded, in the place of what the map states.

    Raises
    ------
    InputError
        With the file, its line, and what was expected.
    """
    require_path(raw, "raw", "the path of what a logger wrote; recording_from_arrays takes arrays")
    path, part = Path(raw), LogPart(rows, throw, every_throw)
    part.check()
    named = None if map in ("auto", "sniff") else read_map(find_map(map))
    # a proposed map is a file as any other while the log is read: what is read of it is named and digested
    said: list[str] = []
    with opened(path, said.append) as logged, TemporaryDirectory() as place:
        if logs := several_logs(logged):
            what = f"{len(logs)} logs of the same columns in it ({listed(logs)})"
            raise InputError.at(
                path, None, f"{what}; expected one: import each, or all by `discsim import {path.name}`"
            )
        known = recognised(logged) if map == "auto" else named
        text = ""
        decisions: tuple[Decision, ...] = ()
        notes: tuple[str, ...] = ()
        if known is None:
            screened = sniff(logged, plant, None if environment is None else environment.field_down)
            screened = screened if environment is None else screened.in_field(environment.field_strength)
            text, decisions, notes = map_text(screened), tuple(screened.all_decisions), tuple(screened.notes)
            write_text(Path(place) / "map.toml", text)
            known = read_map(Path(place) / "map.toml")
        if environment is not None:
            known = replace(known, environment=environment)
        found = take(logged, path.name, known, part, decisions)
    return replace(found, map_text=text, notes=(*said, *notes))
