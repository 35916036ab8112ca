"""A recording made of plain arrays, for who has readings in memory and no folder of files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import real
from discsim.disc import Disc
from discsim.environment import Environment
from discsim.errors import InputError, require_type
from discsim.recording import SENSORS, Plant, Recording, Samples, SensorSheet

__all__ = ["recording_from_arrays"]

#: nothing is known of the place: zeros stand for a magnetic field that is not stated
_SOMEWHERE = Environment(magnetic_field=np.zeros(3), air_density=None)


def recording_from_arrays(
    readings: Mapping[str, tuple[ArrayLike, ArrayLike]],
    *,
    plant: Plant = "free_spin",
    name: str = "arrays",
    environment: Environment = _SOMEWHERE,
    disc: Disc | None = None,
    sheets: Mapping[str, SensorSheet] | None = None,
) -> Recording:
    """Make a recording of plain arrays.

    Parameters
    ----------
    readings : mapping
        Sensor to a pair of arrays: time (n,) in s, ascending, and readings (n, k) as in the recording format:
        magnetometer (n, 3) uT, accelerometer (n, 3) m/s^2, gyroscope (n, 3) rad/s, gps (n, 6) m and m/s,
        rate_reference (n,) rad/s, track (n, 3) m. NaN is a gap.
    plant : str
        One of `discsim.recording.PLANTS`; a free spin needs to state nothing.
    environment, disc
        Where it was recorded and what was thrown; by default the magnetic field is not known.
    sheets : mapping, optional
        What data sheets state, such as the accelerometer's place. A sensor without one gets its sampling rate from the
        times; a rate of NaN is replaced in the same way.

    Raises
    ------
    InputError
        For an unknown sensor and for arrays of other shapes, of times that do not ascend, or of fewer than two rows
        where no sheet states the rate.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0, 2, 0.01)
    >>> field = 40 * np.column_stack([np.cos(30 * t), -np.sin(30 * t), 0 * t])
    >>> recording_from_arrays({"magnetometer": (t, field)})
    <Recording 'arrays': free_spin, 1.99 s, magnetometer 200 rows>
    """
    require_type(readings, Mapping, "readings", '{SENSOR: (t, values)}, such as {"magnetometer": (t, xyz)}')
    stated = dict(sheets or {})
    samples = {}
    for sensor, pair in readings.items():
        samples[sensor] = _samples(sensor, pair)
        sheet = stated.get(sensor, SensorSheet(float("nan")))
        require_type(sheet, SensorSheet, f"the sheet of {sensor}", "a SensorSheet, such as SensorSheet(100.0)")
        if np.isnan(sheet.rate_hz):
            if len(samples[sensor]) < 2:
                raise InputError(f"{sensor}: {len(samples[sensor])} rows tell no sampling rate; expected two or more")
            sheet = replace(sheet, rate_hz=1 / samples[sensor].interval)
        stated[sensor] = sheet
    try:
        return Recording(plant, name, environment, disc, sheets=stated, samples=samples)
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None


def _samples(sensor: str, pair: tuple[ArrayLike, ArrayLike]) -> Samples:
    """Return one sensor's readings; raises `InputError` for what is no pair of arrays that belong together."""
    if sensor not in SENSORS:
        raise InputError(f"unknown sensor '{sensor}'; expected one of {', '.join(SENSORS)}")
    if not isinstance(pair, Sequence) or len(pair) != 2:
        raise InputError(f"readings of {sensor} are of type {type(pair).__name__}; expected a pair (t, values)")
    try:
        return Samples(real(pair[0]), real(pair[1]))
    except (ValueError, TypeError) as error:
        raise InputError(f"{sensor}: {error}") from None
