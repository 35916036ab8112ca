"""Recordings: the one type for measurements, simulated, on a rate table or flown, and data sets of them.

A recording is a folder with ``recording.toml`` and one CSV file per sensor (format ``discsim-recording/1``,
docs/recording-format.md). The reader is strict and names file, line and what it expected; the writer is atomic:
the folder appears whole or not at all.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import BoolArray, FloatArray, readonly
from discsim.disc import Aero, Disc, Release, Rig, aero_key
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.files import write_text
from discsim.toml_table import TomlTable, read_toml

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
        t, value = readonly(self.t), readonly(self.value)
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

    @property
    def interval(self) -> float:
        """Median spacing of the time stamps, s (NaN for a single sample)."""
        return float(np.median(np.diff(self.t))) if self.t.size > 1 else float("nan")

    def between(self, start: float, stop: float) -> Samples:
        """Return the samples with start <= t <= stop."""
        chosen = (self.t >= start) & (self.t <= stop)
        return Samples(self.t[chosen], self.value[chosen])


@dataclass(frozen=True)
class SensorSheet:
    """What a sensor's data sheet states, in the sensor's unit; None where it states nothing.

    ``noise_rms`` for gps is that of position (m), ``velocity_noise_rms`` that of velocity (m/s). ``position`` is
    the accelerometer's place in the body frame, (3,) m.
    """

    rate_hz: float
    noise_rms: float | None = None
    resolution: float | None = None
    range: float | None = None
    velocity_noise_rms: float | None = None
    position: FloatArray | None = None
    sigma: Mapping[str, float | FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.position is not None:
            object.__setattr__(self, "position", readonly(self.position))
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))

    def clipped(self, value: FloatArray) -> BoolArray:
        """Tell which readings stand at the stated range (within one and a half steps of resolution)."""
        if self.range is None:
            return np.zeros(value.shape, dtype=np.bool_)
        margin = 1.5 * (self.resolution or 0.0) + 1e-9 * self.range
        return np.abs(value) >= self.range - margin


@dataclass(frozen=True)
class Recording:
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

    def __post_init__(self) -> None:
        for sensor, samples in self.samples.items():
            if sensor not in SENSORS:
                raise ValueError(f"unknown sensor {sensor!r}; expected one of {', '.join(SENSORS)}")
            if sensor not in self.sheets:
                raise ValueError(f"{sensor} has samples but no sheet that states its rate")
            width = len(SENSORS[sensor].columns)
            if samples.value.shape[1:] != ((width,) if width > 1 else ()):
                raise ValueError(
                    f"{sensor}: got values {samples.value.shape}, expected (n{f', {width}' * (width > 1)})"
                )
        object.__setattr__(self, "sheets", MappingProxyType(dict(self.sheets)))
        object.__setattr__(self, "samples", MappingProxyType(dict(self.samples)))

    def __contains__(self, sensor: str) -> bool:
        return sensor in self.samples

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
        return max((float(samples.t[-1]) for samples in self.samples.values()), default=0.0)


# ---------------------------------------------------------------------------------------------- reading


def read_recording(folder: Path | str) -> Recording:
    """Read a recording folder; raises `InputError` naming file, line and what was expected."""
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError.at(folder, None, "no such folder; expected a recording (a folder with recording.toml)")
    top = read_toml(folder / "recording.toml")
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

    samples = {}
    for sensor, kind in SENSORS.items():
        file = folder / f"{sensor}.csv"
        if not file.exists():
            continue
        if sensor not in sheets:
            raise InputError.at(
                file, None, f"a sensor file without its table; expected [sensors.{sensor}] in recording.toml"
            )
        samples[sensor] = read_csv(file, kind.header)
    command = folder / "command.csv"
    knots = read_csv(command, COMMAND_HEADER, gaps_allowed=False) if command.exists() else None
    if knots is not None and plant != "rate_table":
        raise InputError.at(command, None, f"a command in a {plant} recording; expected it in rate_table only")
    if not samples:
        raise InputError.at(
            folder, None, f"no sensor file; expected at least one of {', '.join(f'{s}.csv' for s in SENSORS)}"
        )
    return Recording(plant, name, environment, disc, rig, release, sheets, samples, knots, folder)


def read_dataset(folder: Path | str) -> list[Recording]:
    """Read a data set: its sub-folders with a ``recording.toml``, in name order (or one recording's own folder)."""
    folder = Path(folder)
    if (folder / "recording.toml").exists():
        return [read_recording(folder)]
    if not folder.is_dir():
        raise InputError.at(folder, None, "no such folder; expected a recording or a data set of recordings")
    members = sorted(child for child in folder.iterdir() if (child / "recording.toml").exists())
    if not members:
        raise InputError.at(folder, None, "no recording in it; expected sub-folders with a recording.toml")
    return [read_recording(member) for member in members]


def _read_sheets(table: TomlTable | None, *, strict: bool) -> dict[str, SensorSheet]:
    assert table is not None
    sheets = {}
    for sensor in table:
        if sensor not in SENSORS:
            raise table.error(sensor, f"unknown sensor '{sensor}'; expected one of {', '.join(SENSORS)}")
        sheet = table.table(sensor)
        assert sheet is not None
        sheets[sensor] = _read_sheet(sheet, sensor, strict=strict)
    table.finish()
    return sheets


def _read_sheet(table: TomlTable, sensor: str, *, strict: bool) -> SensorSheet:
    unit = SENSORS[sensor].unit
    rate_hz = table.need("rate", "hz", positive=True)
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


_EMPTY_CELL = re.compile(r"(?<=,)[ \t]*(?=,|$)", re.MULTILINE)


def read_csv(path: Path, header: str, *, gaps_allowed: bool = True) -> Samples:
    """Read a CSV file of the format; numpy's parser first, line by line only to say where it failed."""
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError.at(path, None, f"cannot be read as UTF-8 text ({error})") from None
    text = text.replace("\r\n", "\n")
    first, _, body = text.partition("\n")
    if first.strip() != header:
        raise InputError.at(path, 1, f"header is '{first.strip()[:120]}', expected '{header}'")
    body = body.rstrip("\n \t")
    if not body:
        raise InputError.at(path, 2, "no samples; expected at least one row (or leave the file out)")
    width = header.count(",") + 1
    try:
        table = np.loadtxt(io.StringIO(_EMPTY_CELL.sub("nan", body)), delimiter=",", comments=None, ndmin=2)
        # numpy's reader passes over blank lines, and a text of one width may have the wrong one
        sound = table.shape == (body.count("\n") + 1, width)
    except ValueError:
        sound = False
    if (
        not sound
        or np.any(np.isinf(table))
        or not np.all(np.isfinite(table[:, 0]))
        or np.any(np.diff(table[:, 0]) <= 0)
    ):
        raise _first_fault(path, body.split("\n"), header)
    if not gaps_allowed and np.any(np.isnan(table)):
        row = int(np.argmax(np.any(np.isnan(table), axis=1)))
        raise InputError.at(path, row + 2, "a cell is empty; expected a number in every cell of a command")
    value = table[:, 1] if width == 2 else table[:, 1:]
    return Samples(table[:, 0], value)


def _first_fault(path: Path, lines: list[str], header: str) -> InputError:
    columns = header.split(",")
    previous = -np.inf
    for number, line in enumerate(lines, start=2):
        cells = line.split(",")
        if len(cells) != len(columns):
            return InputError.at(
                path, number, f"{len(cells)} cells in '{line[:80]}', expected {len(columns)}: {header}"
            )
        for column, cell in zip(columns, cells, strict=True):
            cell = cell.strip()
            try:
                value = float(cell) if cell and "_" not in cell else float("nan")
            except ValueError:
                value = float("inf")
            if np.isinf(value) or "_" in cell:
                return InputError.at(
                    path, number, f"{column} is '{cell[:40]}', expected a finite number or an empty cell"
                )
            if column == "time_s" and np.isnan(value):
                return InputError.at(path, number, f"time_s is '{cell}', expected a finite number")
        time = float(cells[0])
        if time <= previous:
            return InputError.at(path, number, f"time {time:.9g} s follows {previous:.9g} s; expected ascending time")
        previous = time
    return InputError.at(path, None, "no table of numbers; expected " + header)


# ---------------------------------------------------------------------------------------------- writing


def write_recording(recording: Recording, folder: Path | str) -> None:
    """Write ``recording`` as a folder of the format; values survive a round trip to the last bit.

    Every file appears whole or not at all, ``recording.toml`` last, so a folder that has it is complete.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "recording.toml").unlink(missing_ok=True)
    for sensor, kind in SENSORS.items():
        file = folder / f"{sensor}.csv"
        if sensor in recording.samples:
            write_text(file, _csv(recording.samples[sensor], kind.header))
        else:
            file.unlink(missing_ok=True)
    if recording.command is not None:
        write_text(folder / "command.csv", _csv(recording.command, COMMAND_HEADER))
    else:
        (folder / "command.csv").unlink(missing_ok=True)
    write_text(folder / "recording.toml", recording_toml(recording))


def _csv(samples: Samples, header: str) -> str:
    table = np.column_stack((samples.t, samples.value)).tolist()
    lines = [",".join("" if x != x else repr(x) for x in row) for row in table]  # x != x: NaN
    return "\n".join([header, *lines, ""])


def recording_toml(recording: Recording) -> str:
    """Return the text of ``recording.toml``."""
    lines = [
        f"format = {_toml(FORMAT)}",
        f"plant = {_toml(recording.plant)}",
        f"name = {_toml(recording.name)}",
    ]
    lines += environment_toml(recording.environment)
    if recording.disc is not None:
        lines += disc_toml(recording.disc)
    if recording.rig is not None:
        lines += _table(
            "rig",
            {"Izz_kg_m2": recording.rig.Izz, "viscous_N_m_s": recording.rig.viscous},
            recording.rig.sigma,
        )
    if recording.release is not None:
        lines += release_toml(recording.release)
    lines += ["", "[sensors]"]
    for sensor, sheet in recording.sheets.items():
        lines += _table(f"sensors.{sensor}", _sheet_keys(sensor, sheet), sheet.sigma)
    return "\n".join([*lines, ""])


def environment_toml(environment: Environment) -> list[str]:
    """Return the lines of an ``[environment]`` table."""
    return _table(
        "environment",
        {
            "gravity_m_s2": environment.gravity,
            "magnetic_field_ned_uT": environment.magnetic_field,
            "air_density_kg_m3": environment.air_density,
            "wind_ned_m_s": environment.wind
            if np.any(environment.wind) or "wind_ned_m_s" in environment.sigma
            else None,
        },
        environment.sigma,
    )


def disc_toml(disc: Disc) -> list[str]:
    """Return the lines of a ``[disc]`` table and its sub-tables."""
    aero_keys = {aero_key(name) for name in Aero._fields}
    body = {key: value for key, value in disc.sigma.items() if key not in aero_keys}
    lines = _table(
        "disc",
        {"mass_kg": disc.mass, "diameter_m": disc.diameter, "Ixx_kg_m2": disc.Ixx, "Izz_kg_m2": disc.Izz},
        body,
    )
    if disc.aero is not None:
        lines += _table("disc.aero", {aero_key(k): v for k, v in disc.aero._asdict().items()}, {})
    if aero_sigma := {key: value for key, value in disc.sigma.items() if key in aero_keys}:
        lines += _table("disc.aero_sigma", aero_sigma, {})
    if (table := disc.aero_table) is not None:
        lines += _table(
            "disc.aero_table", {"alpha_rad": table.alpha, "CL": table.CL, "CD": table.CD, "CM": table.CM}, {}
        )
    if (damping := disc.yaw_damping_table) is not None:
        lines += _table(
            "disc.CNr_table",
            {"rate_deg_s": np.degrees(damping.rate), "speed_m_s": damping.speed, "CNr": damping.CNr},
            {},
        )
    return lines


def release_toml(release: Release, name: str = "release") -> list[str]:
    """Return the lines of a ``[release]`` table."""
    return _table(
        name,
        {
            "position_ned_m": release.position,
            "velocity_ned_m_s": release.velocity,
            "roll_rad": release.roll,
            "pitch_rad": release.pitch,
            "yaw_rad": release.yaw,
            "body_rate_rad_s": release.body_rate,
        },
        release.sigma,
    )


def _sheet_keys(sensor: str, sheet: SensorSheet) -> dict[str, Any]:
    if sensor == "gps":
        return {
            "rate_hz": sheet.rate_hz,
            "position_noise_rms_m": sheet.noise_rms,
            "velocity_noise_rms_m_s": sheet.velocity_noise_rms,
        }
    unit = SENSORS[sensor].unit
    return {
        "rate_hz": sheet.rate_hz,
        f"noise_rms_{unit}": sheet.noise_rms,
        f"resolution_{unit}": sheet.resolution,
        f"range_{unit}": sheet.range,
        "position_m": sheet.position,
    }


_UNITS = ("kg_m2", "kg_m3", "N_m_s", "rad_s", "m_s2", "m_s", "uT", "kg", "rad", "hz", "m")


def sigma_key(key: str) -> str:
    """Return the key of a quantity's uncertainty: ``sigma`` before the unit, without the frame."""
    for unit in _UNITS:
        if key.endswith(f"_{unit}"):
            return f"{key.removesuffix(f'_{unit}').removesuffix('_ned')}_sigma_{unit}"
    return f"{key}_sigma"


def _table(name: str, values: Mapping[str, Any], sigma: Mapping[str, Any]) -> list[str]:
    lines = ["", f"[{name}]"] if name else []
    for key, value in values.items():
        if value is None:
            continue
        lines.append(f"{key} = {_toml(value)}")
        if key in sigma:
            lines.append(f"{sigma_key(key)} = {_toml(sigma[key])}")
    return lines


def _toml(value: ArrayLike | str | bool) -> str:
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in escaped) + '"'
    if isinstance(value, bool):
        return "true" if value else "false"
    array = np.asarray(value, dtype=float)
    if array.ndim == 0:
        return repr(float(array))
    return "[" + ", ".join(_toml(item) for item in array) + "]"
