"""Recordings: the one type for measurements, simulated, on a rate table or flown, and data sets of them.

A recording is a folder with ``recording.toml`` and one CSV file per sensor (format ``discsim-recording/1``,
docs/recording-format.md). The reader is strict and names file, line and what it expected; the writer is atomic:
a new folder appears whole or not at all.
"""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from itertools import chain
from pathlib import Path
from types import MappingProxyType, NoneType
from typing import Literal, NamedTuple, cast

import numpy as np

from discsim.arrays import FloatArray, readonly, require_reals, sealed
from discsim.disc import Disc, Release, Rig
from discsim.environment import Environment
from discsim.errors import InputError, require_path, require_type
from discsim.files import beside, named_in_errors, read_pieces, replacing, write_pieces
from discsim.limits import MOST_ROWS, reading_fault, written_time_fault
from discsim.recorded import Recorded
from discsim.sensor_sheet import SensorSheet
from discsim.toml_table import TomlTable, obeyed_by_terminals, parse_toml, read_toml
from discsim.toml_text import disc_toml, environment_toml, release_toml, rig_toml, sheet_toml, toml_value

__all__ = [
    "FORMAT",
    "PLANTS",
    "SENSORS",
    "Plant",
    "Recording",
    "Samples",
    "SensorSheet",
    "read_dataset",
    "read_recording",
    "require_plant",
    "write_recording",
]

FORMAT = "discsim-recording/1"
Plant = Literal["flight", "rate_table", "spin_down", "free_spin"]
PLANTS: tuple[Plant, ...] = ("flight", "rate_table", "spin_down", "free_spin")


class SensorKind(NamedTuple):
    """What the format says of one kind of sensor: CSV columns after ``time_s``, its unit, keys of its table."""

    columns: tuple[str, ...]
    unit: str

    @property
    def header(self) -> str:
        """The CSV file's first line."""
        return ",".join(("time_s", *self.columns))


SENSORS: Mapping[str, SensorKind] = MappingProxyType(
    {
        "magnetometer": SensorKind(("x_uT", "y_uT", "z_uT"), "uT"),
        "accelerometer": SensorKind(("x_m_s2", "y_m_s2", "z_m_s2"), "m_s2"),
        "gyroscope": SensorKind(("x_rad_s", "y_rad_s", "z_rad_s"), "rad_s"),
        "gps": SensorKind(("north_m", "east_m", "down_m", "v_north_m_s", "v_east_m_s", "v_down_m_s"), ""),
        "rate_reference": SensorKind(("rate_rad_s",), "rad_s"),
        "track": SensorKind(("north_m", "east_m", "down_m"), "m"),
    }
)
COMMAND_HEADER = "time_s,rate_rad_s"


@dataclass(frozen=True)
class Samples:
    """Time-stamped readings: t (n,) s, strictly ascending and finite; value (n,) or (n, k) in SI (field in uT).

    NaN in ``value`` is a gap. Both arrays are read-only copies. Raises ValueError on other shapes or times.
    """

    t: FloatArray
    value: FloatArray

    def __post_init__(self) -> None:
        t, value = (
            readonly(require_reals(getattr(self, name), f"samples: {name}", expected))
            for name, expected in (("t", "times (n,) in s"), ("value", "readings (n,) or (n, k)"))
        )
        if t.ndim != 1 or value.ndim not in (1, 2) or value.shape[0] != t.size:
            raise ValueError(f"samples: got t {t.shape} and value {value.shape}, expected (n,) and (n,) or (n, k)")
        if not np.all(np.isfinite(t)):
            raise ValueError(f"samples: time stamp {int(np.argmin(np.isfinite(t)))} is not finite")
        if np.any(np.diff(t) <= 0):
            index = int(np.argmax(np.diff(t) <= 0))
            raise ValueError(f"samples: time runs from {t[index]:.9g} to {t[index + 1]:.9g} s; expected ascending")
        if np.any(np.isinf(value)):
            raise ValueError("samples: a value is infinite; expected finite numbers, or NaN for a gap")
        object.__setattr__(self, "t", t)
        object.__setattr__(self, "value", value)

    def __len__(self) -> int:
        return int(self.t.size)

    @property
    def gaps(self) -> int:
        """Number of missing scalar readings (NaN)."""
        return int(np.count_nonzero(np.isnan(self.value)))

    @cached_property
    def interval(self) -> float:
        """Median spacing of the time stamps, s (NaN for a single sample)."""
        return float(np.median(np.diff(self.t))) if self.t.size > 1 else float("nan")

    def between(self, start: float, stop: float) -> Samples:
        """Return the samples with start <= t <= stop."""
        chosen = (self.t >= start) & (self.t <= stop)
        return Samples(self.t[chosen], self.value[chosen])


def require_plant(plant: str) -> None:
    """Raise `InputError` for a plant that the format has not."""
    if plant not in PLANTS:
        raise InputError(f"plant is {plant!r}, expected one of {', '.join(map(repr, PLANTS))}")


@dataclass(frozen=True)
class Recording(Recorded):
    """One recording: what is stated about it and a `Samples` per sensor; it never carries the truth."""

    plant: Plant
    name: str
    environment: Environment
    disc: Disc | None = None
    rig: Rig | None = None
    release: Release | None = None
    sheets: Mapping[str, SensorSheet] = field(default_factory=dict)
    samples: Mapping[str, Samples] = field(default_factory=dict)
    command: Samples | None = None
    path: Path | None = None
    #: sensor -> times (w, n) s and weights (w, n) of the samples that its n readings are means of, where that is known
    averaged: Mapping[str, tuple[FloatArray, FloatArray]] = field(default_factory=dict)
    #: C (3, 3) by which readings of a turned board were turned back to body axes (`discsim.written.corrected`): their
    #: errors are along the board's own; None where it was not turned
    turned_back: FloatArray | None = None

    def __post_init__(self) -> None:
        require_type(self.name, str, "name", "a text")
        require_type(self.environment, Environment, "environment", "Environment(...)")
        require_type(self.disc, (Disc, NoneType), "disc", "a Disc: load_disc(NAME) returns one with its environment")
        if unknown := sorted({*self.samples, *self.sheets} - SENSORS.keys()):
            raise ValueError(f"unknown sensor {unknown[0]!r}; expected one of {', '.join(SENSORS)}")
        for sensor, samples in self.samples.items():
            if sensor not in self.sheets:
                raise ValueError(f"{sensor} has samples but no sheet that states its rate")
            require_type(samples, Samples, sensor, "Samples(t, value)")
            width, got = len(SENSORS[sensor].columns), samples.value.shape
            if got[1:] != ((width,) if width > 1 else ()):
                raise ValueError(f"{sensor}: got values {got}, expected (n{f', {width}' * (width > 1)})")
        object.__setattr__(self, "sheets", MappingProxyType(dict(self.sheets)))
        object.__setattr__(self, "samples", MappingProxyType(dict(self.samples)))

    def __contains__(self, sensor: str) -> bool:
        return sensor in self.samples

    def __repr__(self) -> str:
        sensors = ", ".join(f"{sensor} {len(samples)} rows" for sensor, samples in self.samples.items())
        return f"<Recording '{self.name}': {self.plant}, {self.end:.6g} s, {sensors or 'no sensors'}>"

    def get(self, sensor: str) -> Samples | None:
        """Return a sensor's samples, or None where the recording has none."""
        return self.samples.get(sensor)

    def need(self, sensor: str) -> Samples:
        """Return a sensor's samples; raises `InputError` naming the recording where it has none."""
        if sensor not in self.samples:
            present = ", ".join(self.samples) or "none"
            raise InputError(f"{self.path or self.name}: needs {sensor} samples; this recording has {present}")
        return self.samples[sensor]

    @property
    def end(self) -> float:
        """Time of the last sample of any sensor, s."""
        return max((float(samples.t[-1]) for samples in self.samples.values() if len(samples)), default=0.0)


# ---------------------------------------------------------------------------------------------- reading


def read_recording(folder: Path | str) -> Recording:
    """Read a recording folder; raises `InputError` naming file, line and what was expected."""
    require_path(folder, "folder", "the path of a recording, one at a time; read_dataset reads all in a folder")
    folder = Path(folder)
    try:
        _refuse_file(folder)
        return _read_folder(folder)
    except OSError as error:  # a folder that may not be looked into, a name that is too long
        raise InputError.at(folder, None, f"cannot be read ({error.strerror}); expected a recording") from None


def _read_folder(folder: Path) -> Recording:
    if not folder.is_dir():
        raise InputError.at(folder, None, "no such folder; expected a recording (a folder with recording.toml)")
    if not _there(folder / "recording.toml") and (members := sorted(folder.glob("*/recording.toml"))):
        raise InputError.at(folder, None, f"is a data set; expected one of its recordings, such as {members[0].parent}")
    stated = _stated(read_toml(folder / "recording.toml"))
    sheets, plant = stated.sheets, stated.plant
    samples: dict[str, Samples] = {}
    for sensor, kind in SENSORS.items():
        file = folder / f"{sensor}.csv"
        if not _there(file):
            continue
        if sensor not in sheets:
            expected = f"expected [sensors.{sensor}] in recording.toml"
            raise InputError.at(file, None, f"a sensor file without its table; {expected}")
        found = read_csv(file, kind.header)
        # sensors of one log have one time: it is held once
        same = next((one.t for one in samples.values() if np.array_equal(one.t, found.t)), found.t)
        samples[sensor] = Samples(same, found.value)
    command = folder / "command.csv"
    knots = read_csv(command, COMMAND_HEADER, gaps_allowed=False) if _there(command) else None
    if knots is not None and plant != "rate_table":
        raise InputError.at(command, None, f"a command in a {plant} recording; expected it in rate_table only")
    if not samples:
        names = ", ".join(f"{sensor}.csv" for sensor in SENSORS)
        raise InputError.at(folder, None, f"no sensor file; expected at least one of {names}")
    return replace(stated, samples=samples, command=knots, path=folder)


def _stated(top: TomlTable) -> Recording:
    """Return what ``recording.toml`` states: a recording without samples."""
    top.text("format", choices=(FORMAT,))
    plant = cast(Plant, top.text("plant", choices=PLANTS))
    name = top.text("name")
    assert name is not None
    strict = plant != "free_spin"
    flying = plant == "flight"
    environment_table = top.table("environment", required=True)
    assert environment_table is not None
    environment = Environment.from_toml(environment_table, air_required=flying)
    disc_table = top.table("disc", required=flying)
    disc = Disc.from_toml(disc_table, aero_required=flying) if disc_table is not None else None
    release_table = top.table("release")
    release = Release.from_toml(release_table) if release_table is not None else None
    rig_table = top.table("rig", required=plant == "spin_down")
    if rig_table is not None and plant != "spin_down":
        raise rig_table.error(None, f"[rig] in a {plant} recording; expected it in spin_down only")
    rig = Rig.from_toml(rig_table) if rig_table is not None else None
    sheets = _read_sheets(top.table("sensors", required=True), strict=strict)
    top.finish()
    return Recording(plant, name, environment, disc, rig, release, sheets)


def read_dataset(folder: Path | str) -> list[Recording]:
    """Read a data set: its sub-folders with a ``recording.toml``, in name order (or one recording's own folder)."""
    require_path(folder, "folder", "the path of a folder of recordings")
    folder = Path(folder)
    try:
        _refuse_file(folder)
        if (folder / "recording.toml").exists():
            return [read_recording(folder)]
        if not folder.is_dir():
            raise InputError.at(folder, None, "no such folder; expected a recording or a data set of recordings")
        # a hidden folder is one that was being written when its writer was killed
        members = sorted(
            child
            for child in folder.iterdir()
            if not child.name.startswith(".") and (child / "recording.toml").exists()
        )
    except OSError as error:
        raise InputError.at(folder, None, f"cannot be read ({error.strerror}); expected recordings") from None
    if not members:
        expected = "no recording in it; expected sub-folders with a recording.toml"
        raise InputError.at(folder, None, expected + _what_else(folder))
    return [read_recording(member) for member in members]


def _refuse_file(path: Path) -> None:
    """Raise `InputError` for a path that is a file, with the command that makes a recording of a log."""
    if not path.is_file():
        return
    folder = "this is a file; expected the folder of a recording"
    if path.name == "recording.toml":
        raise InputError.at(path, None, f"{folder}: {path.parent}")
    raise InputError.at(path, None, f"{folder}: bring it in first, discsim import {path} --out DIR")


def _what_else(folder: Path) -> str:
    """Return what to do with the files of a folder that holds no recording; empty where nothing in it is a log."""
    files = sorted(path.name for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
    known = [name for name in files if name.removesuffix(".csv") in SENSORS]
    if known:
        return f"; {', '.join(known)} without the recording.toml that states plant, place and parts"
    logs = [name for name in files if Path(name).suffix.lower() in _OF_LOGS]
    return f"; a raw log is brought in first, discsim import {folder} --out DIR" if logs else ""


def _there(file: Path) -> bool:
    return file.exists() or file.is_symlink()  # a link that leads nowhere is a missing file, not an absent sensor


def _read_sheets(table: TomlTable | None, *, strict: bool) -> dict[str, SensorSheet]:
    assert table is not None
    sheets = {}
    for sensor in table:
        if sensor not in SENSORS:
            near = get_close_matches(sensor, SENSORS, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            raise table.error(sensor, f"unknown sensor '{sensor}'{hint} (expected one of {', '.join(SENSORS)})")
        sheet = table.table(sensor)
        assert sheet is not None
        sheets[sensor] = read_sheet(sheet, sensor, strict=strict)
    table.finish()
    return sheets


def read_sheet(table: TomlTable, sensor: str, *, strict: bool, rate_required: bool = True) -> SensorSheet:
    """Read a ``[sensors.NAME]`` table; a rate that may be absent, and is, becomes NaN."""
    unit = SENSORS[sensor].unit
    stated_rate = table.number("rate", "hz", required=rate_required, positive=True)
    rate_hz = float("nan") if stated_rate is None else stated_rate
    if sensor == "gps":
        noise = table.number("position_noise_rms", "m", required=False, minimum=0.0)
        velocity_noise = table.number("velocity_noise_rms", "m_s", required=False, minimum=0.0)
        sheet = SensorSheet(rate_hz, noise, velocity_noise_rms=velocity_noise, sigma=table.sigma)
    else:
        noise = table.number("noise_rms", unit, required=False, minimum=0.0)
        resolution = table.number("resolution", unit, required=False, minimum=0.0)
        limit = table.number("range", unit, required=False, positive=True)
        position = table.vector("position", "m", required=strict) if sensor == "accelerometer" else None
        sheet = SensorSheet(rate_hz, noise, resolution, limit, None, position, table.sigma)
    table.finish()
    return sheet


#: how names of loggers' files end
_OF_LOGS = (".csv", ".txt", ".tsv", ".log", ".json", ".jsonl", ".bin", ".mat", ".xlsx")
_EMPTY_CELL = re.compile(r"(?<=,)[ \t]*(?=,|$)", re.MULTILINE)
_CELL = re.compile(r"[+-]?(?:(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?|nan)", re.ASCII | re.IGNORECASE)
BLOCK = 1 << 22  # bytes parsed at a time


def read_csv(path: Path, header: str, *, gaps_allowed: bool = True) -> Samples:
    """Read a CSV file of the format; raises `InputError` naming its first faulty line.

    Numpy's parser reads block by block; a block that it refuses is gone through line by line to say where and why.
    """
    pieces = read_pieces(path, BLOCK)
    first, _, start = next(pieces, "").partition("\n")
    if first != header:
        raise InputError.at(path, 1, f"header is '{first[:120]}', expected '{header}'")
    width = header.count(",") + 1
    times: list[FloatArray] = []
    values: list[FloatArray] = []
    line, previous = 2, -np.inf
    for block in _blocks(chain([start], pieces)):
        if line - 2 + (rows := block.count("\n") + 1) > MOST_ROWS:
            rows += line - 2 + sum(piece.count("\n") for piece in pieces)
            fault = f"{rows} rows; expected at most {MOST_ROWS}: cut it into recordings"
            raise InputError.at(path, 2 + MOST_ROWS, fault)
        table = _parse(block, width)
        if table is None or table[0, 0] <= previous:
            raise _first_fault(path, block, header, line, previous)
        if not gaps_allowed and np.any(np.isnan(table)):
            row = int(np.argmax(np.any(np.isnan(table), axis=1)))
            raise InputError.at(path, line + row, f"a cell is empty; expected a number in every cell of {path.name}")
        times.append(table[:, 0].copy())
        values.append(table[:, 1].copy() if width == 2 else table[:, 1:].copy())
        line, previous = line + len(table), float(table[-1, 0])
    if not times:
        raise InputError.at(path, 2, "no samples; expected at least one row (or leave the file out)")
    t = sealed(np.concatenate(times))
    times.clear()
    value = sealed(np.concatenate(values))
    values.clear()
    samples = Samples(t, value)
    if found := _beyond(samples, header):
        row, message = found
        raise InputError.at(path, 2 + row, message)
    return samples


def _beyond(samples: Samples, header: str) -> tuple[int, str] | None:
    """Return the row (from 0) at which samples leave the limits (`discsim.limits`), and what is wrong there."""
    # the sensors beside it tell the unit of a command, though it be of two knots
    found = written_time_fault(samples.t, among_others=header == COMMAND_HEADER)
    if found is None and (wild := reading_fault(samples.value.reshape(len(samples), -1))):
        row, column, message = wild
        found = row, f"{header.split(',')[1 + column]} {message}"
    return found


def _blocks(pieces: Iterable[str]) -> Iterator[str]:
    """Yield pieces of whole lines without the last line's end; blank lines at the end of all are none."""
    kept = ""
    for piece in pieces:
        text = kept + piece
        block = text.rstrip("\n \t")
        if not block:
            kept = text
            continue
        yield block
        # the end of the last row is no row
        kept = text[len(block) :].partition("\n")[2]


def _parse(block: str, width: int) -> FloatArray | None:
    """Return the block's rows (n, width), or None where a row breaks a rule."""
    rows = block.count("\n") + 1
    if not block.isascii() or not block.strip():
        return None
    if ",," in block or ",\n" in block or block.endswith(",") or " " in block or "\t" in block:
        block = _EMPTY_CELL.sub("nan", block)
    try:
        table = np.loadtxt(io.StringIO(block), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None
    # numpy's reader passes over blank lines, and rows of one width may have the wrong one
    if table.shape != (rows, width) or np.any(np.isinf(table)):
        return None
    t = table[:, 0]
    return table if np.all(np.isfinite(t)) and np.all(np.diff(t) > 0) else None


def _first_fault(path: Path, block: str, header: str, start: int, previous: float) -> InputError:
    columns = header.split(",")
    rows = block.split("\n")
    for number, row in enumerate(rows, start):
        cells = [cell.strip(" \t") for cell in row.split(",")]
        if not row.strip(" \t"):
            return InputError.at(path, number, f"a blank line between rows; expected {len(columns)} cells: {header}")
        if len(cells) != len(columns):
            return InputError.at(
                path,
                number,
                f"{len(cells)} cells in '{row[:80]}', expected {len(columns)} with commas between them and decimal "
                f"points: {header}",
            )
        for column, cell in zip(columns, cells, strict=True):
            if cell and not (_CELL.fullmatch(cell) and not np.isinf(float(cell))):
                return InputError.at(
                    path, number, f"{column} is '{cell[:40]}', expected a finite number or an empty cell"
                )
        time = float(cells[0] or "nan")
        if np.isnan(time):
            return InputError.at(path, number, f"time_s is '{cells[0]}', expected a finite number")
        if time <= previous:
            return InputError.at(path, number, f"time {time!r} s follows {previous!r} s; expected ascending time")
        previous = time
    return InputError.at(path, start, f"no table of numbers in the {len(rows)} lines from here; expected {header}")


# ---------------------------------------------------------------------------------------------- writing


def write_recording(recording: Recording, folder: Path | str) -> None:
    """Write ``recording`` as a folder of the format; values survive a round trip to the last bit.

    A new folder appears whole or not at all. In a folder that is there, the files of a recording are replaced one by
    one once all are written, ``recording.toml`` last: a folder that has it is complete. Other files stay.
    Raises `InputError` for what the reader would refuse (a flight without a disc, a sensor without samples, a name
    with control characters), and for a folder with files by the names of the format that are no recording: they are
    somebody else's.
    """
    require_type(recording, Recording, "recording", "a Recording; write_recording(recording, folder)")
    folder = Path(folder)
    texts = _texts(recording)
    if folder.exists() and not folder.is_dir():
        raise InputError.at(folder, None, "is a file; expected a folder (it is created where absent)")
    stage = beside(folder)
    with named_in_errors(folder):
        try:
            stage.mkdir(parents=True)
            for name, text in texts.items():
                write_pieces(stage / name, text)
            if folder.exists():
                _refuse_strangers(folder)
                _replace_files(stage, folder)
            else:
                for name in texts:
                    replacing(folder / name)
                stage.rename(folder)
        finally:
            shutil.rmtree(stage, ignore_errors=True)


def _refuse_strangers(folder: Path) -> None:
    """Raise `InputError` where a folder that no command has written holds files by the names of the format."""
    if any((folder / name).exists() for name in ("recording.toml", "run.json")):
        return
    names = [f"{name}.csv" for name in (*SENSORS, "command") if (folder / f"{name}.csv").exists()]
    if names:
        raise InputError(
            f"{folder}: holds {', '.join(names)} but no recording; expected an empty folder, or a recording"
        )


def _replace_files(stage: Path, folder: Path) -> None:
    names = [*(f"{sensor}.csv" for sensor in SENSORS), "command.csv", "recording.toml"]
    for name in names:
        if (stage / name).exists() or (folder / name).exists():
            replacing(folder / name)
    (folder / "recording.toml").unlink(missing_ok=True)
    for name in names:
        if (stage / name).exists():
            (stage / name).replace(folder / name)
        else:
            (folder / name).unlink(missing_ok=True)


def _texts(recording: Recording) -> dict[str, Iterable[str]]:
    """Return the text of every file of the folder by its name, in pieces."""
    if obeyed_by_terminals(recording.name):
        raise InputError(f"{recording.name!r}: a recording's name; expected a text without control characters")
    stated = recording_toml(recording)
    try:  # by the reader itself: what is written can be read
        _stated(parse_toml(stated, Path("recording.toml")))
    except InputError as error:
        raise InputError(f"{recording.name}: cannot be written, no reader would take its {error}") from None
    texts: dict[str, Iterable[str]] = {"recording.toml": [stated]}
    for sensor, samples in recording.samples.items():
        if len(samples) == 0:
            raise InputError(f"{recording.name}: {sensor} has no samples; expected some, or the sensor left out")
        texts[f"{sensor}.csv"] = _within(recording, sensor, samples, SENSORS[sensor].header)
    if not recording.samples:
        raise InputError(f"{recording.name}: no sensor has samples; expected at least one of {', '.join(SENSORS)}")
    if recording.command is not None:
        if recording.plant != "rate_table":
            raise InputError(f"{recording.name}: a command in a {recording.plant}; expected it in rate_table only")
        if len(recording.command) == 0 or recording.command.gaps:
            raise InputError(f"{recording.name}: the command has no knots or a gap; expected numbers throughout")
        texts["command.csv"] = _within(recording, "command", recording.command, COMMAND_HEADER)
    return texts


def _within(recording: Recording, name: str, samples: Samples, header: str) -> Iterator[str]:
    """Return a sensor's CSV in pieces; raises `InputError` where the reader would refuse it."""
    if found := _beyond(samples, header):
        row, message = found
        raise InputError(f"{recording.name}: {name}, row {row}: {message}")
    return _csv(samples, header)


#: rows put into words at once: their text, a few MB, is all that is held of it
_ROWS = 50_000


def _csv(samples: Samples, header: str) -> Iterator[str]:
    yield f"{header}\n"
    for first in range(0, len(samples), _ROWS):
        part = slice(first, first + _ROWS)
        table = np.column_stack((samples.t[part], samples.value[part])).tolist()
        yield "".join([",".join(["" if x != x else repr(x) for x in row]) + "\n" for row in table])  # x != x: NaN


def recording_toml(recording: Recording) -> str:
    """Return the text of ``recording.toml``."""
    lines = [
        f"format = {toml_value(FORMAT)}",
        f"plant = {toml_value(recording.plant)}",
        f"name = {toml_value(recording.name)}",
    ]
    lines += environment_toml(recording.environment)
    if recording.disc is not None:
        lines += disc_toml(recording.disc)
    if recording.rig is not None:
        lines += rig_toml(recording.rig)
    if recording.release is not None:
        lines += release_toml(recording.release)
    lines += ["", "[sensors]"]
    for sensor, sheet in recording.sheets.items():
        lines += sheet_toml(sensor, sheet, SENSORS[sensor].unit)
    return "\n".join([*lines, ""])
