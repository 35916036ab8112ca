"""A sweep's result: labelled arrays, and their file, netCDF-3, whose bytes depend on nothing but the plan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discsim.arrays import FloatArray
from discsim.files import write_bytes
from discsim.validation.sweeps.chunks import SCORES, Sweep, segments
from discsim.validation.sweeps.mounts import MOUNT_FIELDS, closed_form

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["labelled", "write_netcdf"]

_MEANING = {
    "bias_deg_s": "mean error of the spin rate",
    "rms_deg_s": "root mean square error of the spin rate",
    "worst_deg_s": "largest error of the spin rate",
    "known": "share of the estimates that are known",
}


def labelled(sweep: Sweep, chunks: Sequence[FloatArray]) -> xr.Dataset:
    """Return the scores of all chunks (in the order of `chunk_tasks`) as labelled arrays.

    Each score has the dimensions estimator, one per axis of the plan, mount, segment. ``rate_deg_s`` is the mean true
    magnitude of each segment, ``closed_form_deg_s`` the accelerometer's error by (9). Where truths have unlike numbers
    of segments the missing ones are NaN.
    """
    plan = sweep.plan
    shape = tuple(len(axis.values) for axis in plan.axes)
    spans = [
        segments(plan, sweep.motions[case.truth], case.settings) for case in plan.cases
    ]  # a few floats each; the scores dominate
    most = max(len(span) for span in spans)
    count = plan.mounts.count
    scores = np.full((len(plan.estimators), len(plan.cases), count, most, len(SCORES)), np.nan)
    rate = np.full((len(plan.cases), most), np.nan)
    predicted = np.full((len(plan.cases), count, most), np.nan)
    parts = iter(chunks)
    magnitude: dict[int, list[float]] = {}
    for case, span in zip(plan.cases, spans, strict=True):
        first = 0
        while first < count:
            part = next(parts)
            scores[:, case.number, first : first + part.shape[1], : part.shape[2]] = part
            first += part.shape[1]
        if case.truth not in magnitude:
            motion = sweep.motions[case.truth]
            instants = [np.linspace(start, stop, 101) for start, stop in span]
            magnitude[case.truth] = [float(np.degrees(np.abs(motion.at(t).rate[:, 2]).mean())) for t in instants]
        rate[case.number, : len(span)] = magnitude[case.truth]
        sensor = plan.instruments(case).sensors.get("accelerometer")
        if sensor is not None:
            position = np.asarray(sensor.position)  # type: ignore[union-attr]
            if np.hypot(*position[:2]) > 0:
                predicted[case.number] = closed_form(rate[case.number], position, sweep.mounts[:, :3])
    axes = tuple(axis.name for axis in plan.axes)
    full = ("estimator", *axes, "mount", "segment")
    scores = scores.reshape(len(plan.estimators), *shape, count, most, len(SCORES))
    variables = {
        name: (full, scores[..., k], {"long_name": _MEANING[name], "units": "1" if name == "known" else "deg/s"})
        for k, name in enumerate(SCORES)
    }
    coordinates = {
        "estimator": list(plan.estimators),
        **{axis.name: list(axis.values) for axis in plan.axes},
        "mount": np.arange(count, dtype=np.int32),
        "segment": np.arange(most, dtype=np.int32),
        "rate_deg_s": ((*axes, "segment"), rate.reshape(*shape, most), {"long_name": "mean true spin rate"}),
    }
    for k, name in enumerate(MOUNT_FIELDS):
        angle = name.startswith("about")
        values = np.degrees(sweep.mounts[:, k]) if angle else sweep.mounts[:, k]
        what = f"misalignment {name.replace('_', ' ')}" if angle else f"offset along {name}"
        coordinates[f"{name}_{'deg' if angle else 'm'}"] = ("mount", values, {"long_name": what})
    import xarray as xr

    return xr.Dataset(
        {
            **variables,
            "closed_form_deg_s": (
                (*axes, "mount", "segment"),
                predicted.reshape(*shape, count, most),
                {"long_name": "error of the accelerometer's rate by Eq. (9)", "units": "deg/s"},
            ),
        },
        coordinates,
        {"title": f"discsim sweep {plan.name}", "plant": plan.plant, "seed": np.int32(plan.seed)},
    )


def write_netcdf(path: Path, result: xr.Dataset) -> None:
    """Write a result as netCDF-3, whole or not at all."""
    write_bytes(path, bytes(result.to_netcdf(engine="scipy")))
