"""The instruments on board: parts from their parameter files, the effects upon them, and the recording they make."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Rig
from discsim.effects.catalogue import CATALOGUE, Effect, by_id
from discsim.effects.kind import BOARD
from discsim.effects.sensors import AccelerometerBias, ClockRate, CrossAxis, GSensitivity, GyroscopeBias, Scale
from discsim.effects.timing_rows import ImuClock, LateRows, LostRows
from discsim.errors import InputError, require_path, require_type
from discsim.files import model_file
from discsim.law import Law
from discsim.motion import Motion
from discsim.recording import SENSORS, Plant, Recording, Samples, require_plant
from discsim.sensors.accelerometer import Accelerometer
from discsim.sensors.additions import Addition, by_effect, by_law
from discsim.sensors.gyroscope import Gyroscope
from discsim.sensors.magnetometer import Magnetometer
from discsim.sensors.position import Gps, Tracker
from discsim.sensors.rate_reference import RateReference
from discsim.sensors.sampling import Noise, Sampling
from discsim.toml_table import TomlTable, read_toml
from discsim.written import as_written

__all__ = ["FIELDS", "KINDS", "Instruments", "Sensor", "read_part", "record"]

Sensor: TypeAlias = Accelerometer | Gyroscope | Magnetometer | Gps | RateReference | Tracker

#: sensor -> its type
KINDS: Mapping[str, type[Sensor]] = MappingProxyType(
    {
        "magnetometer": Magnetometer,
        "accelerometer": Accelerometer,
        "gyroscope": Gyroscope,
        "gps": Gps,
        "rate_reference": RateReference,
        "track": Tracker,
    }
)


def _field_for(kind: type[Any], effect: type[Any]) -> str | None:
    """Return the field of a sensor's type, or of its sampling's, that holds an effect of a type."""
    held: dict[Any, str] = {item.default_factory: item.name for item in fields(kind)}
    return held.get(effect)


#: where an effect of the catalogue sits in its sensor: id -> field (clocks, losses and offsets are the sampling's)
FIELDS: Mapping[str, str] = MappingProxyType(
    {
        row.id: place
        for row in CATALOGUE.values()
        if row.acts_on in KINDS and (place := _field_for(KINDS[row.acts_on], row.type))
    }
)


@dataclass(frozen=True)
class WorstCase:
    """Largest errors a data sheet allows; SI, relative where no unit is said. Zero where it says nothing."""

    nonlinearity: float = 0.0
    cross_axis: float = 0.0
    scale: float = 0.0
    bias: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    g_sensitivity: float = 0.0

    def draw(self, sensor: str, rng: np.random.Generator) -> dict[str, Any]:
        """Return the fields of one specimen of ``sensor``, each error even within its bounds."""
        diagonal = (self.nonlinearity + self.scale) * rng.uniform(-1, 1, 3)
        off_diagonal = self.cross_axis * rng.uniform(-1, 1, 6)
        bias = self.bias * rng.uniform(-1, 1, 3)
        faked = self.g_sensitivity * rng.uniform(-1, 1, 3)
        if sensor == "accelerometer":
            return {
                "scale": Scale(*diagonal.tolist()),
                "cross_axis": CrossAxis(*off_diagonal.tolist()),
                "bias": AccelerometerBias(*bias.tolist()),
            }
        return {
            "scale": Scale(*diagonal.tolist()),
            "bias": GyroscopeBias(*bias.tolist()),
            "g_sensitivity": GSensitivity(*faked.tolist()),
        }


@dataclass(frozen=True)
class Instruments:
    """The sensors of one module by name (`discsim.recording.SENSORS`), and the clock they share.

    ``worst_case`` holds, by sensor, what the data sheets allow of errors that differ from part to part; ``written``
    the faults of what the logger writes, which act on the finished recording.
    """

    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    clock: ClockRate = field(default_factory=ClockRate)
    worst_case: Mapping[str, WorstCase] = field(default_factory=dict)
    written: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        require_type(self.sensors, Mapping, "sensors", 'them by name, or Instruments.from_parts("mpu9250")')
        for name, sensor in self.sensors.items():
            if name not in SENSORS:
                raise InputError(f"unknown sensor '{name}'; expected one of {', '.join(SENSORS)}")
            require_type(sensor, KINDS[name], name, f"a {KINDS[name].__name__}(...) of discsim.sensors")
        sensors = dict(self.sensors)
        accelerometer, gyroscope = sensors.get("accelerometer"), sensors.get("gyroscope")
        if isinstance(accelerometer, Accelerometer) and isinstance(gyroscope, Gyroscope):
            # both sit on one chip: what fakes a rate is the specific force there, wherever it was moved to
            sensors["gyroscope"] = replace(gyroscope, position=accelerometer.position)
        object.__setattr__(self, "sensors", MappingProxyType(sensors))

    @classmethod
    def from_parts(cls, *names: str | PathLike[str]) -> Instruments:
        """Put together shipped parts or part files; of two that have the same sensor the later one counts."""
        sensors: dict[str, Sensor] = {}
        worst: dict[str, WorstCase] = {}
        for name in names:
            require_type(name, (str, PathLike), "a part", 'names one by one, from_parts("mpu9250", "neo_m8n")')
            part = read_part(name)
            sensors.update(part.sensors)
            worst.update(part.worst_case)
        return cls(sensors, worst_case=worst)

    def drawn(self, rng: np.random.Generator) -> Instruments:
        """Return one specimen: part-to-part errors drawn evenly within what the data sheets allow."""
        _require_generator(rng)
        module = self
        for name, worst in self.worst_case.items():
            if name in module.sensors:
                module = module.fitted(name, **worst.draw(name, rng))
        return module

    def without(self, *names: str) -> Instruments:
        """Return the module less some sensors."""
        return replace(self, sensors={name: sensor for name, sensor in self.sensors.items() if name not in names})

    def fitted(self, name: str, **changes: Any) -> Instruments:
        """Return the module with fields of one sensor changed (``fitted("accelerometer", position=...)``)."""
        if name not in self.sensors:
            raise InputError(f"no {name} in this module; it has {', '.join(self.sensors) or 'no sensor'}")
        known = [item.name for item in fields(self.sensors[name])]
        if unknown := [change for change in changes if change not in known]:
            rate = "; a rate is that of sampling=Sampling(rate_hz)" if unknown[0].startswith("rate") else ""
            raise InputError(f"{name} has no '{unknown[0]}'; expected one of {', '.join(known)}{rate}")
        return replace(self, sensors={**self.sensors, name: replace(self.sensors[name], **changes)})

    def with_effects(self, effects: Sequence[Effect]) -> Instruments:
        """Return the module with the effects that act on sensors; those of absent sensors are passed over."""
        module = self
        by_id(effects)
        for item in effects:
            id, value, target = item.id, item.value, item.row.acts_on
            if item.row.settings:
                module = replace(module, written=(*(one for one in module.written if one.id != id), item))
            elif isinstance(value, LostRows | LateRows | ImuClock):
                for name, sensor in module.sensors.items():
                    if not isinstance(value, ImuClock) or name in ("gyroscope", "accelerometer"):
                        timed: dict[str, Any] = {str(_field_for(Sampling, type(value))): value}
                        module = module.fitted(name, sampling=replace(sensor.sampling, **timed))
            elif target == "clock":
                module = replace(module, clock=value)
            elif target == "board":
                for name in BOARD & module.sensors.keys():
                    module = module.fitted(name, board=value)
            elif target in module.sensors:
                if item.applied is not None:
                    module = module.adding(target, by_effect(item))
                elif id in FIELDS:
                    module = module.fitted(target, **{FIELDS[id]: value})
                else:
                    place = _field_for(Sampling, type(value))
                    assert place is not None
                    sampling = replace(module.sensors[target].sampling, **{place: value})
                    module = module.fitted(target, sampling=sampling)
        return module

    def with_laws(self, laws: Sequence[Law]) -> Instruments:
        """Return the module with the laws about its sensors; those about motion or absent sensors are passed over."""
        module = self
        for law in laws:
            sensor = law.target.partition(".")[0]
            if sensor in module.sensors:
                module = module.adding(sensor, by_law(law))
        return module

    def adding(self, sensor: str, addition: Addition) -> Instruments:
        """Return the module with one thing more that is added to a sensor's readings, before lag and noise."""
        return self.fitted(sensor, additions=(*self.sensors[sensor].additions, addition))


def _require_generator(rng: object) -> None:
    seed = rng if isinstance(rng, int) else 0
    require_type(rng, np.random.Generator, "rng", f"a generator of random numbers: np.random.default_rng({seed})")


def record(
    motion: Motion,
    instruments: Instruments,
    rng: np.random.Generator,
    *,
    plant: Plant,
    name: str,
    disc: Disc | None = None,
    rig: Rig | None = None,
    command: Samples | None = None,
) -> Recording:
    """Let the instruments measure a motion, and write it as their logger does.

    Each sensor draws from a random stream of its own. ``dataclasses.replace`` adds what is stated besides, a release.
    A recording that is to be written states what its plant needs: a flight its disc, a spin-down its rig. Raises
    `InputError` for an argument of another type and a plant that is none.
    """
    require_type(motion, Motion, "motion", "a Motion: fly(...) returns one, and so does predict(...).motion()")
    require_type(instruments, Instruments, "instruments", 'sensors: Instruments.from_parts("mpu9250")')
    _require_generator(rng)
    require_plant(plant)
    streams = dict(zip(SENSORS, rng.spawn(len(SENSORS)), strict=True))
    samples, sheets = {}, {}
    seed = int(rng.spawn(1)[0].integers(2**32))  # of the pattern of rows, which is one for all
    for sensor_name in SENSORS:
        sensor = instruments.sensors.get(sensor_name)
        if sensor is None:
            continue
        own = sensor.sampling
        shared = replace(own, clock=ClockRate(own.clock.ratio * instruments.clock.ratio), rows_seed=seed)
        taken = replace(sensor, sampling=shared).measure(motion, streams[sensor_name])
        if len(taken):
            samples[sensor_name], sheets[sensor_name] = taken, sensor.sheet
    sound = Recording(plant, name, motion.environment, disc, rig, None, sheets, samples, command)
    return as_written(sound, instruments.written)


# ------------------------------------------------------------------------------------------------ part files


def read_part(name: str | PathLike[str]) -> Instruments:
    """Read a part: the name of a shipped one (``mpu9250``) or a TOML file."""
    require_path(name, "a part", 'a shipped name ("mpu9250"), or the path of a TOML file')
    name = fspath(name)
    path = Path(name) if name.endswith(".toml") else model_file(f"parts/{name}.toml")
    top = read_toml(path)
    top.text("name")
    sensors: dict[str, Sensor] = {}
    worst: dict[str, WorstCase] = {}
    for sensor_name, read in _READERS.items():
        table = top.table(sensor_name)
        if table is not None:
            sensors[sensor_name] = read(table)
            if sensor_name in ("accelerometer", "gyroscope"):
                worst[sensor_name] = _worst_case(table.table("worst_case"), SENSORS[sensor_name].unit)
            table.finish()
    top.finish()
    if not sensors:
        raise InputError.at(path, None, f"no sensor in this part; expected one of {', '.join(_READERS)}")
    return Instruments(sensors, worst_case=worst)


def _worst_case(table: TomlTable | None, unit: str) -> WorstCase:
    if table is None:
        return WorstCase()
    relative = {
        name: table.number(name, required=False, minimum=0.0) or 0.0 for name in ("nonlinearity", "cross_axis", "scale")
    }
    bias = table.vector("bias", unit, required=False)
    faked = table.number("g_sensitivity", "rad_s_per_m_s2", required=False, minimum=0.0) or 0.0
    table.finish()
    return WorstCase(**relative, bias=readonly([0, 0, 0]) if bias is None else bias, g_sensitivity=faked)


def _common(table: TomlTable, unit: str) -> dict[str, Any]:
    return {
        "sampling": Sampling(table.need("rate", "hz", positive=True)),
        "noise": _noise(table, "noise_rms", unit),
        "resolution": table.number("resolution", unit, required=False, minimum=0.0) or 0.0,
    }


def _noise(table: TomlTable, stem: str, unit: str) -> Noise:
    return Noise(table.number(stem, unit, required=False, minimum=0.0) or 0.0)


def _range(table: TomlTable, unit: str) -> float:
    return table.number("range", unit, required=False, positive=True) or float("inf")


def _accelerometer(table: TomlTable) -> Accelerometer:
    position = table.vector("position", "m")
    assert position is not None
    return Accelerometer(**_common(table, "m_s2"), range=_range(table, "m_s2"), position=position)


def _gyroscope(table: TomlTable) -> Gyroscope:
    axes = table.text("axes", required=False) or "xyz"
    if not axes or set(axes) - set("xyz"):
        raise table.error("axes", f"axes is '{axes}', expected letters out of 'xyz'")
    present = ("x" in axes, "y" in axes, "z" in axes)
    return Gyroscope(**_common(table, "rad_s"), range=_range(table, "rad_s"), axes=present)


def _magnetometer(table: TomlTable) -> Magnetometer:
    return Magnetometer(**_common(table, "uT"), range=_range(table, "uT"))


def _gps(table: TomlTable) -> Gps:
    return Gps(
        Sampling(table.need("rate", "hz", positive=True)),
        position_noise=_noise(table, "position_noise_rms", "m"),
        velocity_noise=_noise(table, "velocity_noise_rms", "m_s"),
    )


def _rate_reference(table: TomlTable) -> RateReference:
    return RateReference(**_common(table, "rad_s"))


def _track(table: TomlTable) -> Tracker:
    return Tracker(Sampling(table.need("rate", "hz", positive=True)), _noise(table, "noise_rms", "m"))


_READERS: Mapping[str, Callable[[TomlTable], Sensor]] = MappingProxyType(
    {
        "magnetometer": _magnetometer,
        "accelerometer": _accelerometer,
        "gyroscope": _gyroscope,
        "gps": _gps,
        "rate_reference": _rate_reference,
        "track": _track,
    }
)
