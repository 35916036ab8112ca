"""Where a flight or a rig run happens: gravity, air, known wind and the local magnetic field."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import date
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray, readonly, vector3
from discsim.errors import InputError, require_number
from discsim.toml_table import TomlTable

__all__ = ["FIELD_MODEL_SIGMA", "Environment", "world_magnetic_field"]

#: Uncertainty of the World Magnetic Model, uT per component.
FIELD_MODEL_SIGMA = 0.15


@dataclass(frozen=True)
class Environment:
    """Surroundings of a recording.

    Attributes
    ----------
    gravity : float
        m/s^2.
    magnetic_field : (3,) array
        Field in North-East-Down, uT; zeros where it is not known (nowhere on Earth is it below 20 uT).
    air_density : float or None
        kg/m^3; None where no air acts (rigs) or it is unknown.
    wind : (3,) array
        Known steady wind in North-East-Down, m/s.
    sigma : mapping
        One-sigma uncertainty by key of the file (``air_density_kg_m3``); absent means exact.
    """

    gravity: float = 9.80665
    magnetic_field: FloatArray = field(default_factory=lambda: readonly([30.1, -4.3, 39.2]))
    air_density: float | None = 1.204
    wind: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    sigma: Mapping[str, float | FloatArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, unit in (("gravity", "m/s^2"), ("air_density", "kg/m^3")):
            if (value := getattr(self, name)) is not None:
                require_number(value, name, unit, minimum=0.0)
        object.__setattr__(self, "magnetic_field", vector3(self.magnetic_field, "magnetic field (uT)"))
        object.__setattr__(self, "wind", vector3(self.wind, "wind (m/s)"))
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))

    @property
    def field_known(self) -> bool:
        """Whether the magnetic field is stated."""
        return bool(np.any(self.magnetic_field))

    @property
    def field_strength(self) -> float | None:
        """Strength of the field, uT, or None where it is not known."""
        return float(np.linalg.norm(self.magnetic_field)) if self.field_known else None

    @property
    def field_down(self) -> float | None:
        """The share of the magnetic field that points down, the sine of its dip; None where it is not known."""
        return float(self.magnetic_field[2] / self.field_strength) if self.field_known else None

    @classmethod
    def from_toml(cls, table: TomlTable, *, air_required: bool) -> Environment:
        """Read an ``[environment]`` table."""
        gravity = table.need("gravity", "m_s2", positive=True)
        magnetic_field = table.vector("magnetic_field", "uT", frame="ned")
        density = table.number("air_density", "kg_m3", required=air_required, positive=True)
        wind = table.vector("wind", "m_s", frame="ned", default=(0.0, 0.0, 0.0))
        table.finish()
        assert magnetic_field is not None
        assert wind is not None
        return cls(gravity, magnetic_field, density, wind, table.sigma)


def world_magnetic_field(latitude_deg: float, longitude_deg: float, day: date, height_m: float = 0.0) -> FloatArray:
    """Return the Earth's field from the World Magnetic Model, (3,) North-East-Down, uT.

    Takes the model of the five-year epoch that ``day`` falls in, as shipped with `pygeomag`. Uncertainty of the
    model is about 0.15 uT per component; buildings, cars and iron in the ground add more.
    Height is above the WGS-84 ellipsoid. Raises `InputError` outside the epochs shipped, and for no place on Earth.
    """
    import pygeomag

    if not (abs(latitude_deg) <= 90 and abs(longitude_deg) <= 360):
        raise InputError(
            f"no place at latitude {latitude_deg:g} deg, longitude {longitude_deg:g} deg; "
            "expected -90 to 90 and -180 to 360"
        )
    if not -10e3 <= height_m <= 850e3:
        raise InputError(f"no field model at {height_m:g} m above the ellipsoid; expected -10 km to 850 km")
    year = day.year + (day.timetuple().tm_yday - 1) / 365.25
    epoch = int(year // 5) * 5
    if not 2010 <= epoch <= 2025:
        raise InputError(f"no world magnetic model for {day}; expected a day from 2010-01-01 to 2029-12-31")
    name = {2010: "WMM_2010", 2015: "WMM_2015v2", 2020: "WMM_2020", 2025: "WMM_2025"}[epoch]
    model = pygeomag.GeoMag(coefficients_file=f"wmm/{name}.COF")
    result = model.calculate(glat=latitude_deg, glon=longitude_deg, alt=height_m / 1000.0, time=year)
    return readonly([result.x / 1000.0, result.y / 1000.0, result.z / 1000.0])
