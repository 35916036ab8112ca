"""What a recording can tell: methods of `estimate` that can run, and what a diagnosis cannot ask of it."""

from __future__ import annotations

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.estimators.methods import METHODS, missing_sensors
from discsim.recording import Recording

__all__ = ["methods_that_run", "not_told"]

#: rows of a window of the fft (P-1 of the paper)
WINDOW = 128
#: what is not known without a sensor, beside its own faults
LACKS = {
    "magnetometer": "the attitude and the spin's phase have no reference",
    "gyroscope": "nutation and the direction of the axis come from the field and the force alone",
    "accelerometer": "forces are seen in the path alone, and not at all without one",
}


def methods_that_run(recording: Recording) -> tuple[dict[str, str], dict[str, str]]:
    """Return the methods whose sensors are there, with a remark, and those that cannot run, with the reason."""
    run: dict[str, str] = {}
    left_out: dict[str, str] = {}
    for name in METHODS:
        if absent := missing_sensors(recording, name):
            left_out[name] = f"no {', '.join(absent)}"
        elif reason := _hindered(recording, name):
            left_out[name] = reason
        else:
            run[name] = ""
    return run, left_out


def _hindered(recording: Recording, name: str) -> str:
    if name == "fft" and len(recording.samples["magnetometer"]) < WINDOW:
        return f"{len(recording.samples['magnetometer'])} readings, a window needs {WINDOW}"
    position = recording.sheets["accelerometer"].position if "accelerometer" in recording.sheets else None
    if name.startswith("accelerometer") and (position is None or not np.any(position[:2])):
        what = "is not stated" if position is None else "lies on the axis"
        return f"position_m {what}; state it below [sensors.accelerometer] of the import map, or of recording.toml"
    return ""


def not_told(recording: Recording) -> tuple[str, ...]:
    """Return a line for each thing that is absent: which effects of the catalogue cannot be looked for without it."""
    lines = []
    for sensor, lack in LACKS.items():
        if sensor in recording:
            continue
        own = [id for id, row in CATALOGUE.items() if row.acts_on == sensor and recording.plant in row.plants]
        lines.append(f"no {sensor}: {lack}; not looked for: {', '.join(own)}")
    if recording.plant == "flight" and not {"gps", "track"} & set(recording.samples):
        lines.append("no gps and no track: wind, lift and drag are seen through the accelerometer alone, and weakly")
    if recording.plant == "flight" and recording.release is None:
        lines.append("no [release]: how it was thrown is fitted with everything else")
    if recording.plant == "free_spin" and recording.disc is None:
        lines.append("no [disc]: the ratio of inertias, which sets how fast it nutates, is not known")
    if "magnetometer" in recording and not recording.environment.field_known:
        lines.append("no field stated: the attitude has no reference, and no fault of a magnetometer's scale shows")
    return tuple(lines)
