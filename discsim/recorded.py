"""`Recorded`: how a recording shows itself; `discsim.recording.Recording` holds the data."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discsim.result import Result, require

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from discsim.arrays import FloatArray
    from discsim.recording import Samples

__all__ = ["Recorded"]


class Recorded(Result):
    """Text, long table, labelled arrays and a figure of samples by sensor."""

    samples: Mapping[str, Samples]

    def _columns(self, sensor: str) -> dict[str, FloatArray]:
        """Return the columns of a sensor's file, each (n,), by name."""
        from discsim.recording import SENSORS

        value = self.samples[sensor].value
        return dict(zip(SENSORS[sensor].columns, value.reshape(len(value), -1).T, strict=True))

    def summary(self) -> str:
        """Return the rows, rate, span and gaps of each sensor: a line each."""
        return "\n".join(
            f"{sensor}: {len(own)} rows"
            + (
                f" at {1 / own.interval:.4g} Hz, {own.t[0]:.3f} to {own.t[-1]:.3f} s, {own.gaps} gaps"
                if len(own)
                else ""
            )
            for sensor, own in self.samples.items()
        )

    def table(self) -> dict[str, Any]:
        """Return all readings as one long table: time_s, sensor, column (as in the sensor's file), value."""
        parts = [
            (own.t, sensor, name, values)
            for sensor, own in self.samples.items()
            for name, values in self._columns(sensor).items()
        ]
        return {
            "time_s": np.concatenate([t for t, *_ in parts]) if parts else np.empty(0),
            "sensor": [sensor for t, sensor, *_ in parts for _ in t],
            "column": [name for t, _, name, _ in parts for _ in t],
            "value": np.concatenate([values for *_, values in parts]) if parts else np.empty(0),
        }

    def to_xarray(self) -> xr.Dataset:
        """Return a variable ``SENSOR_COLUMN`` of each column, over the times ``SENSOR_time_s`` of its sensor."""
        require("xarray", "to_xarray()", "tables")
        import xarray as xr

        variables = {
            f"{sensor}_{name}": (f"{sensor}_time_s", values)
            for sensor in self.samples
            for name, values in self._columns(sensor).items()
        }
        return xr.Dataset(variables, coords={f"{sensor}_time_s": own.t for sensor, own in self.samples.items()})

    def plot(self) -> Figure:
        """Return a figure with the readings of each sensor over time."""
        from matplotlib.figure import Figure

        count = max(len(self.samples), 1)
        figure = Figure(figsize=(9.0, 0.6 + 2.0 * count), layout="constrained")
        panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
        for axes, (sensor, own) in zip(panels, self.samples.items(), strict=False):
            for name, values in self._columns(sensor).items():
                axes.plot(own.t, values, lw=0.8, label=name)
            axes.set_title(sensor.replace("_", " "), loc="left")
            axes.legend(fontsize=7, ncols=3, frameon=False)
            axes.grid(color="#dddddd", lw=0.6)
        panels[-1].set_xlabel("time (s)")
        return figure

    def report(self, folder: Path | str) -> Path:
        """Write the recording as a folder that `read_recording` reads; return the folder."""
        from discsim.recording import Recording, write_recording

        assert isinstance(self, Recording)
        write_recording(self, Path(folder))
        return Path(folder)
