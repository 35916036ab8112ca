"""Fig. 7: the rate table's run, and what the paper says of it, as numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from discsim.environment import Environment
from discsim.estimators.accelerometer import STANDARD_GRAVITY
from discsim.rig import default_profile
from discsim.validation.scenarios.rate_table import (
    MOUNT_ERRORS,
    RateTableRun,
    envelope_on,
    fft_delay,
    plateau_table,
    run_rate_table,
)

__all__ = ["PLATEAUS", "run_fig_7", "table_numbers"]

#: plateaus, deg/s: below the FFT's threshold, within the gyroscope's range and beyond it, up to the paper's throws
PLATEAUS = (0, 300, 1000, 2500, 4000, 5000)


def run_fig_7(environment: Environment, rng: np.random.Generator) -> RateTableRun:
    """Turn the table, with the paper's module on it."""
    return run_rate_table(default_profile(PLATEAUS, hold=3.0), environment, rng)


def table_numbers(run: RateTableRun) -> dict[str, Any]:
    """Return what the page states of the run."""
    rows = plateau_table(run)
    fast = float(np.radians(4000.0))

    def of(method: str) -> list[Any]:
        return [row for row in rows if row.method == method and np.isclose(row.rate, fast)]

    [fft], [accelerometer], [wide] = of("fft"), of("accelerometer"), of("adxrs649")
    place = run.recording.sheets["accelerometer"].position
    limit = run.recording.sheets["accelerometer"].range
    assert place is not None
    assert limit is not None
    distance = float(np.hypot(*place[:2]))
    widths = {}
    for mount in MOUNT_ERRORS:
        width, outside = envelope_on(run, mount, fast)
        widths[f"{1000 * mount:g} mm"] = {"percent": 100 * width / fast, "outside": outside}
    gyroscope = run.rates["gyroscope"].rate
    return {
        "gyroscope_last_deg_s": np.degrees(np.nanmax(gyroscope)),
        "fft": {"bias_deg_s": np.degrees(fft.bias), "sd_deg_s": np.degrees(fft.sd)},
        "accelerometer": {"bias_deg_s": np.degrees(accelerometer.bias), "sd_deg_s": np.degrees(accelerometer.sd)},
        "wide_sd_deg_s": np.degrees(wide.sd),
        "envelope": widths,
        "delay_s": fft_delay(run),
        "mount_percent": [100 * (np.sqrt(1 + sign * e / distance) - 1) for e in MOUNT_ERRORS for sign in (-1, 1)],
        "share_percent": [100 * e / distance for e in MOUNT_ERRORS],
        "accelerometer_limit_deg_s": np.degrees(np.sqrt(limit / distance)),
        "limit_g": limit / STANDARD_GRAVITY,
    }
