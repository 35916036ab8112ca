"""The disc and the spin-down rig: mass, inertia, aerodynamic coefficients, each with its stated uncertainty."""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field
from math import pi
from types import MappingProxyType, NoneType
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.errors import InputError, require_number, require_type
from discsim.frames import attitude_matrix
from discsim.limits import ANY_NUMBER, limit_of
from discsim.toml_table import TomlTable

__all__ = ["RELEASE_HEIGHT", "Aero", "AeroTable", "Disc", "Release", "Rig", "RollingTable", "YawDampingTable"]

#: a disc is left to itself this high above the ground where a release states no position, m
RELEASE_HEIGHT = 1.3


class Aero(NamedTuple):
    """Coefficients of the baseline, (14)-(17); angles in rad, rates made dimensionless with d/(2 V)."""

    CL0: float = 0.0
    CLa: float = 0.0
    CD0: float = 0.0
    CDa: float = 0.0
    alpha0: float = 0.0
    CM0: float = 0.0
    CMa: float = 0.0
    CMq: float = 0.0
    CRr: float = 0.0
    CRp: float = 0.0
    CNr: float = 0.0


STATIC = ("CL0", "CLa", "CD0", "CDa", "alpha0", "CM0", "CMa")


def _require_radians(alpha: FloatArray, what: str) -> None:
    """Raise ValueError for angles of attack (n,) rad that no flow has: it comes from pi at the most, from behind.

    The margin is for a half turn rounded to four digits, 3.142.
    """
    if np.any(np.abs(alpha) > np.pi * (1 + 1e-3)):
        least, most = float(np.min(alpha)), float(np.max(alpha))
        raise ValueError(
            f"{what}: alpha_rad runs from {least:g} to {most:g}, expected angles of attack in radians, within +-pi; "
            f"of degrees multiply each by pi/180 = 0.0174533: {np.radians(least):.4g} to {np.radians(most):.4g}"
        )


@dataclass(frozen=True)
class AeroTable:
    """C_L, C_D, C_M at nodes of alpha (rad, ascending): linear between them, constant outside; all (n,)."""

    alpha: FloatArray
    CL: FloatArray
    CD: FloatArray
    CM: FloatArray

    def __post_init__(self) -> None:
        for name in ("alpha", "CL", "CD", "CM"):
            object.__setattr__(self, name, readonly(getattr(self, name)))
            if not np.all(np.isfinite(getattr(self, name))):
                raise ValueError(f"coefficient table: {name} has a number that is not finite, expected finite ones")
        sizes = {name: getattr(self, name).size for name in ("alpha", "CL", "CD", "CM")}
        if len(set(sizes.values())) != 1 or self.alpha.size < 2:
            raise ValueError(f"coefficient table: columns of one length, at least 2, expected; got {sizes}")
        if np.any(np.diff(self.alpha) <= 0):
            raise ValueError("coefficient table: expected alpha_rad to ascend")
        _require_radians(self.alpha, "coefficient table")


@dataclass(frozen=True)
class RollingTable:
    """The rolling moment of (16) at nodes of alpha (na,) rad: C_Rr(alpha, gamma) and C_Rp(alpha), one of them or both.

    ``advance_ratio`` (ng,) are the nodes of |gamma|, above zero, and ``CR`` (na, ng) is the coefficient of a disc that
    does not roll, for r > 0. By symmetry it is zero at gamma = 0 and turns its sign with r. ``CRp`` (na,) takes the
    place of that of `Aero`. Linear between the nodes, constant outside.
    """

    alpha: FloatArray
    advance_ratio: FloatArray | None = None
    CR: FloatArray | None = None
    CRp: FloatArray | None = None

    def __post_init__(self) -> None:
        for name in ("alpha", "advance_ratio", "CR", "CRp"):
            if getattr(self, name) is None:
                continue
            object.__setattr__(self, name, readonly(getattr(self, name)))
            if not np.all(np.isfinite(getattr(self, name))):
                raise ValueError(f"CR table: {name} has a number that is not finite, expected finite ones")
        if self.alpha.size < 2 or np.any(np.diff(self.alpha) <= 0):
            raise ValueError("CR table: expected alpha_rad to ascend, at least 2 of them")
        _require_radians(self.alpha, "CR table")
        if (self.advance_ratio is None) != (self.CR is None):
            raise ValueError("CR table: expected advance_ratio and CR, both or neither")
        if self.CR is None and self.CRp is None:
            raise ValueError("CR table: neither CR nor CRp; expected advance_ratio and CR, or CRp, or all three")
        if self.CRp is not None and self.CRp.shape != self.alpha.shape:
            raise ValueError(f"CR table: {self.CRp.size} values of CRp, expected one per alpha_rad ({self.alpha.size})")
        if self.CR is None or self.advance_ratio is None:
            return
        if self.CR.shape != (self.alpha.size, self.advance_ratio.size):
            raise ValueError(
                f"CR table: CR is {' x '.join(map(str, self.CR.shape))}, expected angles x advance ratios = "
                f"{self.alpha.size} x {self.advance_ratio.size}"
            )
        if self.advance_ratio[0] <= 0 or np.any(np.diff(self.advance_ratio) <= 0):
            raise ValueError(
                "CR table: expected advance_ratio to ascend from above zero (at zero C_R is zero by symmetry: leave "
                "that node out; of a spin r < 0 the table holds mirrored)"
            )


@dataclass(frozen=True)
class YawDampingTable:
    """C_Nr over spin rate and airspeed, (27)-(28): rate (nr,) rad/s, speed (nv,) m/s, CNr (nr, nv).

    Between the nodes a bicubic spline (as in the paper's Fig. 11b); outside them an error.
    """

    rate: FloatArray
    speed: FloatArray
    CNr: FloatArray

    def __post_init__(self) -> None:
        for name in ("rate", "speed", "CNr"):
            object.__setattr__(self, name, readonly(getattr(self, name)))
            if not np.all(np.isfinite(getattr(self, name))):
                raise ValueError(f"CNr table: {name} has a number that is not finite, expected finite ones")
        if self.CNr.shape != (self.rate.size, self.speed.size) or min(self.CNr.shape) < 4:
            raise ValueError(
                f"CNr table: CNr is {' x '.join(map(str, self.CNr.shape))}, expected rates x speeds = "
                f"{self.rate.size} x {self.speed.size}, at least 4 of each"
            )
        if np.any(np.diff(self.rate) <= 0) or np.any(np.diff(self.speed) <= 0):
            raise ValueError("CNr table: expected rate_deg_s and speed_m_s to ascend")


@dataclass(frozen=True)
class Disc:
    """A disc; SI units. ``aero`` is None where no aerodynamics are stated (a free spin needs none)."""

    mass: float
    diameter: float
    Ixx: float
    Izz: float
    aero: Aero | None = None
    aero_table: AeroTable | None = None
    yaw_damping_table: YawDampingTable | None = None
    sigma: Mapping[str, float | FloatArray] = field(default_factory=dict)
    rolling_table: RollingTable | None = None

    def __post_init__(self) -> None:
        for name in ("mass", "diameter", "Ixx", "Izz"):
            require_number(getattr(self, name), f"disc {name}", "SI", positive=True)
        require_type(self.aero, (Aero, NoneType), "disc aero", "Aero(CL0=..., CLa=..., ...)")
        if self.Izz > 2 * self.Ixx * (1 + 1e-9):
            raise ValueError(
                f"disc: Izz = {self.Izz:g} exceeds Ixx + Iyy = {2 * self.Ixx:g} kg m^2, expected at most that"
            )
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))

    @property
    def area(self) -> float:
        """Planform area A = pi d^2/4, m^2."""
        return pi * self.diameter**2 / 4

    @classmethod
    def from_toml(cls, table: TomlTable, *, aero_required: bool) -> Disc:
        """Read a ``[disc]`` table with its sub-tables ``aero``, ``aero_sigma`` and those of coefficients."""
        mass = table.need("mass", "kg", positive=True)
        diameter = table.need("diameter", "m", positive=True)
        Ixx = table.need("Ixx", "kg_m2", positive=True)
        Izz = table.need("Izz", "kg_m2", positive=True)
        lookup = _aero_table(table.table("aero_table"))
        damping = _yaw_damping_table(table.table("CNr_table"))
        rolling = _rolling_table(table.table("CR_table"))
        tabulated = set(STATIC) if lookup is not None else set()
        tabulated |= {"CNr"} if damping is not None else set()
        tabulated |= {"CRr"} if rolling is not None and rolling.CR is not None else set()
        tabulated |= {"CRp"} if rolling is not None and rolling.CRp is not None else set()
        aero, sigma = _aero(table, tabulated, aero_required)
        table.finish()
        try:
            return cls(mass, diameter, Ixx, Izz, aero, lookup, damping, {**table.sigma, **sigma}, rolling)
        except ValueError as error:
            raise table.error(None, str(error)) from None


def aero_key(name: str) -> str:
    """Return a coefficient's key in a file (``alpha0`` has a unit)."""
    return "alpha0_rad" if name == "alpha0" else name


def _aero(table: TomlTable, tabulated: Set[str], required: bool) -> tuple[Aero | None, dict[str, float]]:
    stated = table.table("aero")
    if stated is None and required:
        raise table.error(
            None,
            "[disc.aero] is missing, the coefficients of a flight; expected those of the disc, or of a published one "
            "like it (`discsim list discs`), which `discsim show ultrastar` prints to copy",
        )
    sigma_table = table.table("aero_sigma")
    sigma: dict[str, float] = {}
    absent: set[str] = set()
    aero = None
    if stated is not None:
        values = {}
        for name in Aero._fields:
            unit = "rad" if name == "alpha0" else ""
            values[name] = stated.number(name, unit, required=name not in tabulated)
        stated.finish()
        aero = Aero(**{name: 0.0 if value is None else value for name, value in values.items()})
        sigma.update({key: float(value) for key, value in stated.sigma.items()})
        absent = {aero_key(name) for name, value in values.items() if value is None}
    if sigma_table is not None:
        if aero is None:
            raise sigma_table.error(
                None, "[disc.aero_sigma] without [disc.aero]; expected the coefficients it is about"
            )
        for key in map(aero_key, Aero._fields):
            value = sigma_table.number(key, required=False, minimum=0.0, limit=ANY_NUMBER)
            if value is None:
                continue
            if key in absent:
                raise sigma_table.error(
                    key, f"uncertainty of '{key}', which [disc.aero] lacks; expected both or neither"
                )
            if key in sigma:
                raise sigma_table.error(
                    key, f"uncertainty of '{key}' is stated twice; expected it here or in [disc.aero]"
                )
            sigma[key] = value
        if sigma_table.sigma:
            raise sigma_table.error(None, "uncertainty of an uncertainty; expected names of coefficients as keys")
        sigma_table.finish()
    return aero, sigma


def _aero_table(table: TomlTable | None) -> AeroTable | None:
    if table is None:
        return None
    alpha, CL, CD, CM = (table.numbers(key) for key in ("alpha_rad", "CL", "CD", "CM"))
    table.finish()
    assert alpha is not None
    assert CL is not None
    assert CD is not None
    assert CM is not None
    try:
        return AeroTable(alpha, CL, CD, CM)
    except ValueError as error:
        raise table.error(None, str(error)) from None


def _rolling_table(table: TomlTable | None) -> RollingTable | None:
    if table is None:
        return None
    alpha = table.numbers("alpha_rad")
    ratio, CRp = table.numbers("advance_ratio", required=False), table.numbers("CRp", required=False)
    CR = table.numbers("CR", required=False, dimensions=2)
    table.finish()
    assert alpha is not None
    try:
        return RollingTable(alpha, ratio, CR, CRp)
    except ValueError as error:
        raise table.error(None, str(error)) from None


def _yaw_damping_table(table: TomlTable | None) -> YawDampingTable | None:
    if table is None:
        return None
    rate_deg, speed = table.numbers("rate_deg_s"), table.numbers("speed_m_s")
    matrix = table.numbers("CNr", dimensions=2)
    table.finish()
    assert rate_deg is not None
    assert speed is not None
    assert matrix is not None
    try:
        return YawDampingTable(np.radians(rate_deg), speed, matrix)
    except ValueError as error:
        raise table.error(None, str(error)) from None


@dataclass(frozen=True)
class Rig:
    """The spin-down rig: ``Izz rdot = -viscous r``; Izz in kg m^2, viscous in N m s."""

    Izz: float
    viscous: float
    sigma: Mapping[str, float | FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.Izz) and self.Izz > 0 and np.isfinite(self.viscous) and self.viscous >= 0):
            raise ValueError(
                f"rig: got Izz = {self.Izz!r} kg m^2, viscous = {self.viscous!r} N m s; "
                "expected Izz above zero and viscous not below it"
            )
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))

    @classmethod
    def from_toml(cls, table: TomlTable) -> Rig:
        """Read a ``[rig]`` table."""
        Izz = table.need("Izz", "kg_m2", positive=True)
        viscous = table.need("viscous", "N_m_s", minimum=0.0)
        table.finish()
        return cls(Izz, viscous, table.sigma)


#: what a release states, its key in a file, by which it is limited, and its unit
_RELEASE_KEYS = (
    ("position", "position_ned_m", "m"),
    ("velocity", "velocity_ned_m_s", "m/s"),
    ("body_rate", "body_rate_rad_s", "rad/s"),
    ("roll", "roll_rad", "rad"),
    ("pitch", "pitch_rad", "rad"),
    ("yaw", "yaw_rad", "rad"),
)


@dataclass(frozen=True)
class Release:
    """State at release, or what was measured of it; None where unknown.

    Position and velocity (3,) of the centre of mass in North-East-Down (m, m/s); roll, pitch, yaw in rad in the
    order ``C_BN = C3(yaw) C2(pitch) C1(roll)`` (A1); body rate (3,) rad/s. ``sigma`` by the file's key. Raises
    `InputError` for what a file's reader refuses: no finite numbers, or beyond `discsim.limits`.
    """

    position: FloatArray | None = None
    velocity: FloatArray | None = None
    roll: float | None = None
    pitch: float | None = None
    yaw: float | None = None
    body_rate: FloatArray | None = None
    sigma: Mapping[str, float | FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("position", "velocity", "body_rate"):
            value = getattr(self, name)
            if value is not None:
                array = readonly(value)
                if array.shape != (3,) or not np.all(np.isfinite(array)):
                    raise InputError(f"release {name}: got {value!r}, expected three finite numbers")
                object.__setattr__(self, name, array)
        for name in ("roll", "pitch", "yaw"):
            if getattr(self, name) is not None:
                require_number(getattr(self, name), f"release {name}", "rad")
        for name, key, unit in _RELEASE_KEYS:
            value = getattr(self, name)
            size = 0.0 if value is None else float(np.max(np.abs(value)))
            if fault := limit_of(key).fault(size, divides=False):
                raise InputError(f"release {name} is {size:g} {unit} in size; {fault} ({unit})")
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))

    def start(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return position, velocity (3,), C_NB (3, 3) and body rate (3,) of a throw.

        Position defaults to `RELEASE_HEIGHT` above the origin, attitude to level. Raises `InputError` where velocity
        or body rate is unknown, for a position that is not above the ground, and for an angle of more than a whole
        turn: no hand gives one, and 90 or -12 are what people write of degrees.
        """
        for name in ("roll", "pitch", "yaw"):
            angle = getattr(self, name) or 0.0
            if abs(angle) > 2 * pi:
                raise InputError(
                    f"release {name} is {angle:g} rad, more than a whole turn; expected radians: of {angle:g} degrees "
                    f"{np.radians(angle):.4g}"
                )
        for name, key in (("velocity", "velocity_ned_m_s"), ("body_rate", "body_rate_rad_s")):
            if getattr(self, name) is None:
                raise InputError(f"a throw needs {key}; expected three numbers")
        assert self.velocity is not None
        assert self.body_rate is not None
        position = np.array([0.0, 0.0, -RELEASE_HEIGHT]) if self.position is None else self.position
        if position[2] >= 0.0:
            raise InputError(f"release position is {-position[2]:g} m high, expected above the ground (down < 0)")
        C_NB = attitude_matrix(self.roll or 0.0, self.pitch or 0.0, self.yaw or 0.0).T
        return position, self.velocity, C_NB, self.body_rate

    @staticmethod
    def require(release: object) -> None:
        """Raise `InputError` for what is no release."""
        require_type(release, Release, "release", "a Release: load_throw(NAME), or Release(velocity=V, body_rate=W)")

    @classmethod
    def from_toml(cls, table: TomlTable) -> Release:
        """Read a ``[release]`` table (or a throw file, which has the same keys)."""
        position = table.vector("position", "m", frame="ned", required=False)
        velocity = table.vector("velocity", "m_s", frame="ned", required=False)
        angles = [table.number(name, "rad", required=False) for name in ("roll", "pitch", "yaw")]
        body_rate = table.vector("body_rate", "rad_s", required=False)
        table.finish()
        return cls(position, velocity, angles[0], angles[1], angles[2], body_rate, table.sigma)
