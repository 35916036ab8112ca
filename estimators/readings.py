"""What an estimator of one sensor is given: its readings, and its sheet."""

from __future__ import annotations

from discsim.errors import InputError, require_type
from discsim.recording import SENSORS, Samples, SensorSheet

__all__ = ["require_readings", "require_sheet"]


def require_readings(samples: Samples, sensor: str) -> None:
    """Raise `InputError` for readings of another type, or of another shape than the sensor's.

    >>> require_readings(3.0, "gyroscope")
    Traceback (most recent call last):
    discsim.errors.InputError: samples is 3.0, of type float; expected recording.samples["gyroscope"]
    """
    require_type(samples, Samples, "samples", f'recording.samples["{sensor}"]')
    columns = len(SENSORS[sensor].columns)
    if samples.value.shape[1:] != ((columns,) if columns > 1 else ()):
        expected = f"(n, {columns})" if columns > 1 else "(n,)"
        raise InputError(f"samples have values of shape {samples.value.shape}; expected {expected} of a {sensor}")


def require_sheet(sheet: SensorSheet, sensor: str) -> None:
    """Raise `InputError` for a sensor's sheet of another type."""
    require_type(sheet, SensorSheet, "sheet", f'recording.sheets["{sensor}"]')
