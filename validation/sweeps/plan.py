"""A sweep's plan: what is varied, over which truths, mounts and instruments, and who is scored; read from TOML."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import product
from os import PathLike, fspath
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from discsim.arrays import FloatArray, readonly
from discsim.effects.catalogue import Effect, catalogued, effect, row
from discsim.effects.sensors import HardIron, PositionOffset
from discsim.environment import Environment
from discsim.errors import InputError, require_path
from discsim.estimators.methods import METHODS
from discsim.files import digest, model_file, model_names
from discsim.limits import limit_of
from discsim.recording import Samples
from discsim.rig import default_profile, profile_fault
from discsim.sensors import Instruments
from discsim.sensors.sampling import Noise
from discsim.shipped import load_disc, load_site, load_throw
from discsim.toml_table import TomlTable, read_toml
from discsim.validation.scenarios.profile_files import read_knots
from discsim.validation.sweeps.doubts import plan_notes
from discsim.validation.sweeps.mounts import MOUNT_FIELDS, MountDesign

__all__ = ["Axis", "Case", "Plan", "plan_file", "read_plan"]

#: what a magnet at the sensor is
_IRON = catalogued(HardIron).id

#: values of one result, beyond which a plan is refused: netCDF-3 holds 2 GiB in one array of 8-byte numbers
LARGEST = 2**28 - 1
#: sensors that a mount moves and that estimators of a sweep may use
MOUNTED = ("accelerometer", "magnetometer", "gyroscope")
#: mounts scored in one chunk: a few seconds of work
CHUNK = 256


class Axis(NamedTuple):
    """One thing that is varied: its values as the plan names them, and what they stand for."""

    name: str
    values: tuple[str, ...] | tuple[float, ...]
    loaded: tuple[Any, ...]
    #: whether another value needs another truth run, not only another look at the same
    moves: bool


class Case(NamedTuple):
    """One combination of the axes: its place in them, the truth it looks at, and its setting of each axis."""

    number: int
    truth: int
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Plan:
    """A sweep: every combination of ``axes`` with every mount.

    ``estimators`` maps a method of `discsim.estimators.methods` (or ``best``) to the number of mounts that it is scored
    on. ``drawn`` gives every mount a specimen of its own, with errors within what the data sheets allow. ``profile`` is
    the rate table's where no axis names others; ``duration`` the longest flight, s. Holds no open file and no path:
    a worker elsewhere needs nothing but this.
    """

    name: str
    plant: Literal["rate_table", "flight"]
    axes: tuple[Axis, ...]
    mounts: MountDesign
    estimators: Mapping[str, int]
    seed: int = 0
    drawn: bool = False
    fft_step: int = 16
    profile: Samples | None = None
    duration: float = 30.0
    files: Mapping[str, str] = field(default_factory=dict)
    #: what is odd in what the plan names, a line each
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        size = len(self.estimators) * self.mounts.count
        for axis in self.axes:
            size *= len(axis.values)
        if size > LARGEST // 16:  # a few plateaus each
            raise InputError(f"sweep '{self.name}': {size:.3g} scores in all; expected at most {LARGEST // 16:.3g}")

    @cached_property
    def truths(self) -> tuple[Mapping[str, Any], ...]:
        """The settings that need a truth run each, in the order of their axes."""
        moving = [axis for axis in self.axes if axis.moves]
        combinations = product(*(axis.loaded for axis in moving))
        return tuple(
            dict(zip((axis.name for axis in moving), combination, strict=True)) for combination in combinations
        )

    def called(self, truth: int) -> str:
        """Return what a truth run is about, for errors in it: the plan's own names of what moves it."""
        moving = [axis for axis in self.axes if axis.moves]
        names = list(product(*(axis.values for axis in moving)))[truth]
        told = ", ".join(f"{axis.name} {name}" for axis, name in zip(moving, names, strict=True))
        return f"sweep '{self.name}'{', ' * bool(told)}{told}"

    @cached_property
    def cases(self) -> tuple[Case, ...]:
        """Every combination of the axes, the last one running fastest."""
        moving = [len(axis.values) for axis in self.axes if axis.moves]
        cases = []
        for number, place in enumerate(product(*(range(len(axis.values)) for axis in self.axes))):
            settings = {axis.name: axis.loaded[k] for axis, k in zip(self.axes, place, strict=True)}
            own = [k for axis, k in zip(self.axes, place, strict=True) if axis.moves]
            truth = int(np.ravel_multi_index(own, moving)) if own else 0
            cases.append(Case(number, truth, settings))
        return tuple(cases)

    def instruments(self, case: Case) -> Instruments:
        """Return the module of a case as its data sheets say, before specimen, effects and mount."""
        settings = case.settings
        module: Instruments = settings.get("parts") or Instruments.from_parts("mpu9250")
        module = module.without(*(name for name in module.sensors if name not in MOUNTED))
        if "radius_m" in settings:
            z = float(module.sensors["accelerometer"].position[2])  # type: ignore[union-attr]
            module = module.fitted("accelerometer", position=readonly([-settings["radius_m"], 0.0, z]))
        for key, sensor in (("accelerometer_hz", "accelerometer"), ("magnetometer_hz", "magnetometer")):
            if key in settings:
                sampling = replace(module.sensors[sensor].sampling, rate_hz=settings[key])
                module = module.fitted(sensor, sampling=sampling)
        if "noise_ratio" in settings:
            for sensor in module.sensors:
                noise = cast(Noise, module.sensors[sensor].noise)  # type: ignore[union-attr]
                module = module.fitted(sensor, noise=replace(noise, white=settings["noise_ratio"] * noise.white))
        return module

    def environment(self, settings: Mapping[str, Any]) -> Environment:
        """Return the surroundings of a case or a truth; on a rate table those of a recording by default."""
        environment: Environment = settings["disc"][1] if "disc" in settings else self._surroundings
        if "site" in settings:
            environment = replace(environment, magnetic_field=settings["site"])
        if "dip_deg" in settings:
            environment = replace(environment, magnetic_field=_dipped(environment.magnetic_field, settings["dip_deg"]))
        return environment

    @cached_property
    def _surroundings(self) -> Environment:
        return load_disc("driver")[1] if self.plant == "flight" else Environment()

    def effects(self, settings: Mapping[str, Any], *, moving: bool) -> tuple[Effect, ...]:
        """Return the effects among the settings that act on the motion, or those that act on sensors and clocks."""
        sizes: dict[str, dict[str, float]] = {}
        for key, size in settings.items():
            if "." in key:
                id, name = key.rsplit(".", 1)
                if (row(id).acts_on == "motion") == moving:
                    sizes.setdefault(id, {})[name] = size
        if "magnet_m" in settings and not moving:
            iron = sizes.setdefault(_IRON, {})
            iron["bx_uT"] = iron.get("bx_uT", 0.0) + dipole_field(settings["magnet_A_m2"], settings["magnet_m"])
        return tuple(effect(id, **parameters) for id, parameters in sizes.items())

    def scored(self, estimator: str) -> NDArray[np.int64]:
        """Return the numbers of the mounts that an estimator is scored on, ascending.

        The first ones of a random or Sobol' design, which are spread as the whole is; of a grid evenly spaced ones.
        """
        count = min(self.estimators[estimator], self.mounts.count)
        if self.mounts.design == "grid":
            return np.unique(np.linspace(0, self.mounts.count - 1, count).round()).astype(np.int64)
        return np.arange(count)

    @property
    def identity(self) -> dict[str, Any]:
        """All that the results depend on, of JSON; what is inside files by their digests."""
        return {
            "name": self.name,
            "plant": self.plant,
            "axes": {axis.name: list(axis.values) for axis in self.axes},
            "mounts": {
                "design": self.mounts.design,
                "count": self.mounts.count,
                "lower": self.mounts.lower.tolist(),
                "upper": self.mounts.upper.tolist(),
                "points": list(self.mounts.points),
                **({"base": self.mounts.base} if self.mounts.base else {}),
            },
            "estimators": dict(self.estimators),
            "seed": self.seed,
            "drawn": self.drawn,
            "fft_step": self.fft_step,
            "profile": None if self.profile is None else [self.profile.t.tolist(), self.profile.value.tolist()],
            "duration_s": self.duration,
            "files": dict(self.files),
            "chunk": CHUNK,
        }


def _dipped(magnetic_field: FloatArray, dip_deg: float) -> FloatArray:
    """Return the field (3,) uT turned to another dip (positive down), its size and declination kept."""
    size, declination = np.linalg.norm(magnetic_field), np.arctan2(magnetic_field[1], magnetic_field[0])
    dip = np.radians(dip_deg)
    level = size * np.cos(dip)
    return readonly([level * np.cos(declination), level * np.sin(declination), size * np.sin(dip)])


def dipole_field(moment: float, distance: float) -> float:
    """Return the field, uT, of a dipole (A m^2) on its axis at a distance (m): mu0/(4 pi) 2 m/d^3."""
    return 0.2 * moment / distance**3


# ------------------------------------------------------------------------------------------------------ reading


class _Kind(NamedTuple):
    """A kind of axis: which plants have it, whether it moves, and how a text of it is loaded (None: a number)."""

    plants: tuple[str, ...]
    moves: bool
    load: Callable[[str, Path], Any] | None = None
    lowest: float = -np.inf
    highest: float = np.inf


def _profile(text: str, folder: Path) -> Samples:
    return read_knots(folder / text).knots


def _parts(text: str, folder: Path) -> Instruments:
    return Instruments.from_parts(*(_shipped_or_beside("parts", name, folder) for name in text.split("+")))


def _shipped_or_beside(kind: str, name: str, folder: Path) -> str:
    """Return a shipped file's name as it is, and that of another file as its path, counted from the plan."""
    return name if name in model_names(kind) or not name.endswith(".toml") else str(folder / name)


BOTH = ("rate_table", "flight")
_KINDS: Mapping[str, _Kind] = MappingProxyType(
    {
        "profile": _Kind(("rate_table",), True, _profile),
        "disc": _Kind(("flight",), True, lambda text, folder: load_disc(_shipped_or_beside("discs", text, folder))),
        "throw": _Kind(("flight",), True, lambda text, folder: load_throw(_shipped_or_beside("throws", text, folder))),
        "site": _Kind(
            BOTH,
            False,
            lambda text, folder: load_site(_shipped_or_beside("sites", text, folder)).environment.magnetic_field,
        ),
        "dip_deg": _Kind(BOTH, False, lowest=-90.0, highest=90.0),
        "parts": _Kind(BOTH, False, _parts),
        "radius_m": _Kind(BOTH, False, lowest=1e-4, highest=0.5),
        "accelerometer_hz": _Kind(BOTH, False, lowest=1.0, highest=1e5),
        "magnetometer_hz": _Kind(BOTH, False, lowest=1.0, highest=1e5),
        "mount_hz": _Kind(BOTH, False, lowest=1.0, highest=1e5),
        "magnet_m": _Kind(BOTH, False, lowest=1e-3, highest=10.0),
        "magnet_A_m2": _Kind(BOTH, False, lowest=-100.0, highest=100.0),
        "noise_ratio": _Kind(BOTH, False, lowest=0.0, highest=1e6),
    }
)
_FOLDERS = {"disc": "discs", "throw": "throws", "site": "sites", "parts": "parts"}


def plan_file(name_or_path: str | PathLike[str]) -> Path:
    """Return the file of a shipped plan's name, or the path given; raises `InputError` where it is neither."""
    require_path(name_or_path, "a sweep", "a shipped plan's name, the path of a TOML plan, or a Plan")
    name = fspath(name_or_path)
    if name in model_names("sweeps"):
        return model_file(f"sweeps/{name}.toml")
    path = Path(name)
    if not path.is_file():
        shipped = ", ".join(model_names("sweeps"))
        raise InputError(f"no sweep '{name}'; expected one of {shipped}, or the path of a TOML plan")
    return path


def read_plan(path: Path, *, count: int | None = None, seed: int | None = None) -> Plan:
    """Read a plan (docs/sweeps.md), with another number of mounts or another seed where they are given.

    Raises `InputError` naming file, line and what was expected.
    """
    top = read_toml(path)
    name = top.text("name")
    stated_seed = _whole(top, "seed", 0, default=0)
    drawn = top.flag("drawn")
    fft_step = _whole(top, "fft_step", 1, default=16)
    plant, stated, duration = _read_truth(_need(top, "truth"))
    profile = stated
    files: dict[str, str] = {}
    axes = _read_axes(top.table("axes"), plant, path.parent, files)
    named = {axis.name for axis in axes}
    if len(named & {"magnet_m", "magnet_A_m2"}) == 1:
        raise top.error("axes", "a magnet needs both axes.magnet_m (its distance) and axes.magnet_A_m2 (its moment)")
    if "profile" in named:
        if profile is not None:
            raise top.error("truth.rates_deg_s", "truth.rates_deg_s and the axis 'profile' both give a profile")
    elif plant == "rate_table" and profile is None:
        profile = default_profile()
    mounts = _read_mounts(top.table("mounts"))
    if count is not None:
        if mounts.design == "grid":
            raise InputError.at(path, None, f"--mounts {count}: a grid's mounts are counted by its points")
        mounts = replace(mounts, base=count) if mounts.design == "saltelli" else replace(mounts, count=count)
    estimators = _read_estimators(_need(top, "estimators"), mounts.count)
    top.finish()
    assert name is not None
    if profile is not None and not _level(profile):
        raise InputError.at(path, None, "truth: no plateau is long enough to be scored; expected hold_s above 1.4")
    seed = stated_seed if seed is None else seed
    notes = plan_notes(axes, stated, path.parent)
    plan = Plan(name, plant, axes, mounts, estimators, seed, drawn, fft_step, profile, duration, files, notes)
    for case in plan.cases:
        _check_case(plan, case, path)
    return plan


def _level(profile: Samples) -> bool:
    from discsim.validation.scenarios.rate_table import plateaus

    return bool(plateaus(profile))


def _check_case(plan: Plan, case: Case, path: Path) -> None:
    """Refuse a combination that cannot be measured before anything is flown."""
    try:
        module = plan.instruments(case)
        upon_sensors = plan.effects(case.settings, moving=False)
        for one in (*upon_sensors, *plan.effects(case.settings, moving=True)):
            kind = row(one.id)
            if not kind.acts_with(module.sensors):
                given = ", ".join(module.sensors)
                raise InputError(f"{one.id}: there is no {kind.acts_on} among the parts, only {given}")
        module.with_effects(upon_sensors)
        for name in plan.estimators:
            absent = () if name == "best" else tuple(s for s in METHODS[name].sensors if s not in module.sensors)
            if absent:
                raise InputError(f"estimator '{name}' needs {', '.join(absent)}; the parts have none")
    except InputError as error:
        shown = ", ".join(f"{axis.name}" for axis in plan.axes) or "no axis"
        raise InputError.at(path, None, f"combination {case.number} of {shown}: {error}") from None


def _need(table: TomlTable, name: str) -> TomlTable:
    part = table.table(name, required=True)
    assert part is not None
    return part


def _whole(table: TomlTable, key: str, lowest: int, *, default: int | None = None) -> int:
    value = table.raw(key)
    if value is None and default is not None:
        return default
    if value is None:
        where = f"[{table.name}]" if table.name else "the top level"
        raise table.error(None, f"missing key '{key}' in {where}; expected a whole number from {lowest}")
    if isinstance(value, bool) or not isinstance(value, int) or value < lowest:
        raise table.error(key, f"'{key}' is {value!r}, expected a whole number from {lowest}")
    return value


def _read_truth(table: TomlTable) -> tuple[Literal["rate_table", "flight"], Samples | None, float]:
    plant = cast(Literal["rate_table", "flight"], table.text("plant", choices=BOTH))
    profile, duration = None, 30.0
    if plant == "rate_table":
        rates = table.numbers("rates_deg_s", required=False)
        if rates is not None:
            if not np.any(rates):
                raise table.error("rates_deg_s", "'truth.rates_deg_s' holds no rate but zero; expected some to score")
            hold, ramp = table.need("hold", "s", positive=True), table.need("ramp", "s", positive=True)
            profile = default_profile(rates.tolist(), hold, ramp)
            if found := profile_fault(profile):
                raise table.error("rates_deg_s", found[1])
    else:
        longest = table.number("duration", "s", required=False, positive=True)
        duration = 30.0 if longest is None else longest
    table.finish()
    return plant, profile, duration


def _read_axes(table: TomlTable | None, plant: str, folder: Path, files: dict[str, str]) -> tuple[Axis, ...]:
    axes: list[Axis] = []
    if table is None:
        return ()
    for key in table:
        if key == "effect":
            continue
        if key not in _KINDS:
            continue  # finish() names it, with the nearest one known
        kind = _KINDS[key]
        if plant not in kind.plants:
            raise table.error(key, f"'axes.{key}' belongs to a {' or '.join(kind.plants)}; this is a {plant}")
        axes.append(_read_axis(table, key, kind, folder, files))
    for key in _KINDS:
        table.raw(key)  # taken above where it is there; known to finish() where it is not
    effects = table.table("effect")
    table.finish()
    if effects is not None:
        axes.extend(_read_effect(effects, key, plant) for key in effects)
        effects.finish()
    return tuple(axes)


def _listed(table: TomlTable, key: str) -> list[Any]:
    value = table.raw(key)
    values = value if isinstance(value, list) else [value]
    if not values:
        raise table.error(key, f"'{table.name}.{key}' is empty, expected at least one value")
    if len({repr(item) for item in values}) != len(values):
        raise table.error(key, f"'{table.name}.{key}' names a value twice, expected each once")
    return values


def _number(table: TomlTable, key: str, value: Any, lowest: float = -np.inf, highest: float = np.inf) -> float:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not (number and np.isfinite(value) and lowest <= value <= highest):
        bounds = f" from {lowest:g} to {highest:g}" if np.isfinite(lowest) else ""
        raise table.error(key, f"'{table.name}.{key}' has {value!r}, expected numbers{bounds}")
    return float(value)


def _read_axis(table: TomlTable, key: str, kind: _Kind, folder: Path, files: dict[str, str]) -> Axis:
    values = _listed(table, key)
    if kind.load is None:
        numbers = tuple(_number(table, key, value, kind.lowest, kind.highest) for value in values)
        return Axis(key, numbers, numbers, kind.moves)
    loaded = []
    for value in values:
        if not isinstance(value, str):
            raise table.error(key, f"'axes.{key}' has {value!r}, expected texts")
        try:
            loaded.append(kind.load(value, folder))
        except InputError as error:
            raise table.error(key, f"'axes.{key}': {error}") from None
        for name in value.split("+"):
            files[name] = digest(_source(key, name, folder))
    return Axis(key, tuple(values), tuple(loaded), kind.moves)


def _source(key: str, name: str, folder: Path) -> Path:
    """Return the file that a text of an axis stands for."""
    if key in _FOLDERS and name in model_names(_FOLDERS[key]):
        return model_file(f"{_FOLDERS[key]}/{name}.toml")
    return folder / name


def _read_effect(table: TomlTable, key: str, plant: str) -> Axis:
    """Read the sizes of one parameter of an effect, ``"accel.bias.bx_m_s2" = [0.0, 0.5]``."""
    id, _, name = key.rpartition(".")
    if not id:
        raise table.error(key, f"'axes.effect.{key}': expected one key in quotes, such as \"accel.bias.bx_m_s2\"")
    try:
        kind = row(id)
        effect(id, **{name: kind.sizes.get(name, 0.0)})
    except InputError as error:
        raise table.error(key, f"'{key}': {error}") from None
    if plant not in kind.plants:
        raise table.error(key, f"'{key}' acts on {', '.join(kind.plants)}; this is a {plant}")
    if kind.type is PositionOffset:
        raise table.error(key, f"'{key}': mounts move the accelerometer; expected [mounts] instead")
    values = tuple(_number(table, key, value) for value in _listed(table, key))
    limit = limit_of(name)
    for value in values:
        if beyond := limit.fault(value, divides=name in kind.positive):
            raise table.error(key, f"'{key}' has {value:g}, {beyond}")
    return Axis(key, values, values, kind.acts_on == "motion")


def _read_mounts(table: TomlTable | None) -> MountDesign:
    if table is None:
        return MountDesign()
    designs = ("grid", "random", "sobol", "saltelli")
    design = cast(Literal["grid", "random", "sobol", "saltelli"], table.text("design", choices=designs))
    count = _whole(table, "count", 1) if design != "grid" else 1
    if design == "saltelli" and (count < 2 or count & (count - 1)):
        raise table.error("count", f"'mounts.count' is {count}, expected a power of two for a saltelli design")
    lower, upper, points = np.zeros(6), np.zeros(6), [1] * 6
    for k, name in enumerate(MOUNT_FIELDS):
        angle = name.startswith("about")
        key, largest, factor = f"{name}_{'deg' if angle else 'm'}", 180.0 if angle else 0.5, np.pi / 180 if angle else 1
        ends = table.numbers(key, required=False)
        if ends is not None:
            if ends.size != 2 or ends[0] > ends[1]:
                raise table.error(key, f"'mounts.{key}': expected two numbers, the smaller one first")
            if np.abs(ends).max() > largest:
                raise table.error(key, f"'mounts.{key}' reaches {np.abs(ends).max():g}, expected at most {largest:g}")
            lower[k], upper[k] = ends * factor
        if design == "grid":
            points[k] = _whole(table, f"{name}_points", 1, default=1 if lower[k] == upper[k] else 5)
    table.finish()
    if design == "saltelli" and not np.any(upper > lower):
        raise table.error("design", "[mounts] varies nothing; expected a range for a saltelli design, such as x_m")
    return MountDesign(design, count, lower, upper, tuple(points), count if design == "saltelli" else 0)


def _read_estimators(table: TomlTable, count: int) -> dict[str, int]:
    limits = {}
    known = ("best", *METHODS)
    for name in table:
        if name not in known:
            raise table.error(name, f"unknown estimator '{name}' (expected some of {', '.join(known)})")
        value = table.raw(name)
        if value != "all" and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
            raise table.error(name, f"'estimators.{name}' is {value!r}, expected \"all\" or a number of mounts from 1")
        limits[name] = count if value == "all" else min(value, count)
    if not limits:
        raise table.error(None, f"[estimators] is empty; expected some of {', '.join(known)}")
    table.finish()
    return limits
