"""The catalogue: one row per effect that a baseline leaves out.

Engines, sensors, model files, documentation and diagnosis all know the effects through these rows: a new row is a new
term, a new hypothesis and a new line of the docs. Forms and parameters are those of docs/physics.md.
"""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from discsim.effects import aero, air, body, events, rig, sensors, setup
from discsim.errors import InputError

if TYPE_CHECKING:
    from discsim.effects.own import UserEffect

__all__ = ["CATALOGUE", "Effect", "Row", "effect", "row"]

FLIGHT = ("flight",)
AIRBORNE = ("flight", "free_spin")
RIGS = ("rate_table", "spin_down")
EVERYWHERE = ("flight", "rate_table", "spin_down", "free_spin")
#: the sensors that share one board
BOARD = frozenset({"magnetometer", "accelerometer", "gyroscope"})


class Row(NamedTuple):
    """One effect of the catalogue.

    ``acts_on`` is "motion", the sensor it belongs to, "clock" for all of a recording's sensors or "board" for those
    that share one; ``scale`` gives a small but visible size of each parameter, in its unit; an ``event`` happens in
    one recording; a ``setup`` fault is one of what was set up or stated, and no physics.
    """

    id: str
    type: type[Any]
    acts_on: str
    plants: tuple[str, ...]
    scale: tuple[float, ...]
    event: bool = False
    setup: bool = False

    @property
    def key(self) -> str:
        """The id as an identifier (``air_wind``)."""
        return self.id.replace(".", "_")

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which are numbers, units in the name."""
        return tuple(self.sizes)

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of the settings, which are texts; no fit can move one."""
        return tuple(name for name, none in self.baseline._asdict().items() if isinstance(none, str))

    @property
    def sizes(self) -> dict[str, float]:
        """The parameters at the baseline, by name."""
        return {name: none for name, none in self.baseline._asdict().items() if not isinstance(none, str)}

    @property
    def baseline(self) -> Any:
        """The effect at its baseline: no effect."""
        return self.type()

    def acts_with(self, sensors: Collection[str]) -> bool:
        """Tell whether it can act on a recording that has these sensors."""
        if self.acts_on == "board":
            return not BOARD.isdisjoint(sensors)
        return self.acts_on in ("motion", "clock") or self.acts_on in sensors


_ROWS = (
    Row("air.wind", air.Wind, "motion", FLIGHT, (0.1, 0.1)),
    Row("air.wind_shear", air.WindShear, "motion", FLIGHT, (0.1, 0.1, 0.1)),
    Row("air.gust", air.Gust, "motion", FLIGHT, (0.1, 0.1, 0.1, 0.1), event=True),
    Row("air.density", air.Density, "motion", FLIGHT, (0.01,)),
    Row("air.ground_effect", air.GroundEffect, "motion", FLIGHT, (0.05,)),
    Row("aero.spin_side_force", aero.SpinSideForce, "motion", FLIGHT, (0.002,)),
    Row("aero.spin_lift", aero.SpinLift, "motion", FLIGHT, (0.002,)),
    Row("aero.spin_drag", aero.SpinDrag, "motion", FLIGHT, (0.002,)),
    Row("aero.spin_pitching_moment", aero.SpinPitchingMoment, "motion", FLIGHT, (0.0002,)),
    Row("aero.stall", aero.Stall, "motion", FLIGHT, (0.05, 0.01)),
    Row("aero.yaw_reynolds", aero.YawReynolds, "motion", FLIGHT, (0.02,)),
    Row("aero.yaw_quadratic", aero.YawQuadratic, "motion", FLIGHT, (0.0001,)),
    Row("aero.yaw_alpha", aero.YawAlpha, "motion", FLIGHT, (0.005,)),
    Row("body.mass_imbalance", body.MassImbalance, "motion", FLIGHT, (1e-4, 1e-4)),
    Row("body.inertia_asymmetry", body.InertiaAsymmetry, "motion", AIRBORNE, (1e-6,)),
    Row("event.impulse", events.Impulse, "motion", FLIGHT, (0.01, 0.05, 0.05, 0.05), event=True),
    Row("event.spin_step", events.SpinStep, "motion", ("flight", "spin_down", "free_spin"), (0.01, 0.1), event=True),
    Row("rig.coulomb_friction", rig.CoulombFriction, "motion", ("spin_down",), (1e-6,)),
    Row("rig.quadratic_drag", rig.QuadraticDrag, "motion", ("spin_down",), (1e-8,)),
    Row("rig.axis_tilt", rig.AxisTilt, "motion", RIGS, (0.002, 0.002)),
    Row("rig.speed_ripple", rig.SpeedRipple, "motion", ("rate_table",), (0.1, 0.05, 0.1)),
    Row("mag.hard_iron", sensors.HardIron, "magnetometer", EVERYWHERE, (0.5, 0.5, 0.5)),
    Row("mag.soft_iron", sensors.SoftIron, "magnetometer", EVERYWHERE, (0.005,) * 6),
    Row("mag.lag", sensors.Lag, "magnetometer", EVERYWHERE, (1e-4,)),
    Row("mag.stray_field", sensors.StrayField, "magnetometer", FLIGHT, (0.5, 0.5, 0.5, 0.1)),
    Row("mag.clock_rate", sensors.ClockRate, "magnetometer", EVERYWHERE, (1e-5,)),
    Row("mag.dropped_samples", sensors.DroppedSamples, "magnetometer", EVERYWHERE, (0.001,)),
    Row("accel.lag", sensors.Lag, "accelerometer", EVERYWHERE, (1e-4,)),
    Row("accel.clock_rate", sensors.ClockRate, "accelerometer", EVERYWHERE, (1e-5,)),
    Row("accel.dropped_samples", sensors.DroppedSamples, "accelerometer", EVERYWHERE, (0.001,)),
    Row("accel.position_offset", sensors.PositionOffset, "accelerometer", EVERYWHERE, (5e-5, 5e-5, 5e-5)),
    Row("accel.bias", sensors.AccelerometerBias, "accelerometer", EVERYWHERE, (0.02, 0.02, 0.02)),
    Row("accel.bias_drift", sensors.BiasDrift, "accelerometer", EVERYWHERE, (0.01, 0.01, 0.01)),
    Row("accel.scale", sensors.Scale, "accelerometer", EVERYWHERE, (0.002, 0.002, 0.002)),
    Row("accel.cross_axis", sensors.CrossAxis, "accelerometer", EVERYWHERE, (0.002,) * 6),
    Row("accel.saturation", sensors.AccelerometerSaturation, "accelerometer", EVERYWHERE, (1.0,)),
    Row("gyro.lag", sensors.Lag, "gyroscope", EVERYWHERE, (1e-4,)),
    Row("gyro.clock_rate", sensors.ClockRate, "gyroscope", EVERYWHERE, (1e-5,)),
    Row("gyro.bias", sensors.GyroscopeBias, "gyroscope", EVERYWHERE, (1e-3, 1e-3, 1e-3)),
    Row("gyro.scale", sensors.Scale, "gyroscope", EVERYWHERE, (0.002, 0.002, 0.002)),
    Row("gyro.g_sensitivity", sensors.GSensitivity, "gyroscope", EVERYWHERE, (1e-5, 1e-5, 1e-5)),
    Row("gps.clock_rate", sensors.ClockRate, "gps", FLIGHT, (1e-4,)),
    Row("gps.latency", sensors.Latency, "gps", FLIGHT, (0.002,)),
    Row("clock.rate", sensors.ClockRate, "clock", EVERYWHERE, (1e-5,)),
    Row("mag.axes", setup.Axes, "magnetometer", EVERYWHERE, (), setup=True),
    Row("accel.axes", setup.Axes, "accelerometer", EVERYWHERE, (), setup=True),
    Row("gyro.axes", setup.Axes, "gyroscope", EVERYWHERE, (), setup=True),
    Row("gps.axes", setup.GpsAxes, "gps", FLIGHT, (), setup=True),
    Row("mag.units", setup.MagnetometerUnit, "magnetometer", EVERYWHERE, (), setup=True),
    Row("accel.units", setup.AccelerometerUnit, "accelerometer", EVERYWHERE, (), setup=True),
    Row("gyro.units", setup.GyroscopeUnit, "gyroscope", EVERYWHERE, (), setup=True),
    Row("mag.time_offset", setup.TimeOffset, "magnetometer", EVERYWHERE, (1e-4,), setup=True),
    Row("accel.time_offset", setup.TimeOffset, "accelerometer", EVERYWHERE, (1e-4,), setup=True),
    Row("gyro.time_offset", setup.TimeOffset, "gyroscope", EVERYWHERE, (1e-4,), setup=True),
    Row("board.rotation", setup.BoardRotation, "board", EVERYWHERE, (0.002, 0.002, 0.002), setup=True),
    Row("site.field", setup.SiteField, "magnetometer", EVERYWHERE, (0.002, 0.002, 0.002), setup=True),
    Row("clock.units", setup.ClockUnit, "clock", EVERYWHERE, (), setup=True),
)

CATALOGUE: Mapping[str, Row] = MappingProxyType({row.id: row for row in _ROWS})


def row(id: str) -> Row:
    """Return the row of an effect; raises `InputError` naming the nearest ids."""
    if id not in CATALOGUE:
        near = difflib.get_close_matches(id, CATALOGUE, n=1)
        hint = f"; did you mean '{near[0]}'?" if near else ""
        raise InputError(f"unknown effect '{id}'{hint} (expected one of {', '.join(CATALOGUE)})")
    return CATALOGUE[id]


#: parameters of motion that have no meaning at or below zero; each sensor checks its own
_POSITIVE = frozenset({("air.density", "ratio"), ("air.gust", "width_s"), ("site.field", "ratio")})


@dataclass(frozen=True)
class Effect:
    """An effect with its size: an id of the catalogue and a value of that row's type; or one of the user's ``own``."""

    id: str
    value: Any
    own: UserEffect | None = None

    @property
    def row(self) -> Row:
        """What the catalogue, or the user's file, says of it."""
        return row(self.id) if self.own is None else self.own.row

    @property
    def sizes(self) -> dict[str, float]:
        """Its parameters, by name."""
        return {name: getattr(self.value, name) for name in self.row.parameters}

    @property
    def setting(self) -> dict[str, str]:
        """Its settings, by name; empty for most effects."""
        return {name: getattr(self.value, name) for name in self.row.settings}

    def __post_init__(self) -> None:
        kind = self.row
        if type(self.value) is not kind.type:
            raise InputError(f"{self.id}: got {type(self.value).__name__}, expected {kind.type.__name__}")
        try:
            object.__setattr__(self, "value", setup.checked(self.value))
        except InputError as error:
            raise InputError(f"{self.id}: {error}") from None
        for name, size in self.sizes.items():
            if not isfinite(size) and size != kind.sizes[name]:
                raise InputError(f"{self.id}: {name} is not finite ({size}); expected a finite number")
            if (self.id, name) in _POSITIVE and size <= 0:
                raise InputError(f"{self.id}: {name} is {size:g}; expected a number above zero")


def effect(id: str, **given: float | str) -> Effect:
    """Return an effect by id, parameters and settings; those left out stay at the baseline.

    >>> effect("air.wind", w_north_m_s=1.1).value
    Wind(w_north_m_s=1.1, w_east_m_s=0.0)
    >>> effect("mag.axes", axes="x -y z").value
    Axes(axes='x -y z')
    """
    kind = row(id)
    for name, value in given.items():
        if name not in (*kind.parameters, *kind.settings):
            what = "parameter" if kind.parameters else "setting"
            raise InputError(f"{id}: unknown {what} '{name}'; expected {', '.join((*kind.parameters, *kind.settings))}")
        if isinstance(value, str) != (name in kind.settings):
            expected = "a text" if name in kind.settings else "a number"
            raise InputError(f"{id}: {name} is {value!r}, expected {expected}")
    return Effect(
        id, kind.type(**{name: value if isinstance(value, str) else float(value) for name, value in given.items()})
    )


def by_id(effects: Sequence[Effect]) -> dict[str, Any]:
    """Return the values by id; raises `InputError` where one id appears twice."""
    values: dict[str, Any] = {}
    for item in effects:
        if item.id in values:
            raise InputError(f"effect '{item.id}' is given twice; expected each at most once in one recording")
        values[item.id] = item.value
    return values
