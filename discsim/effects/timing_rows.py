"""Effects of when a reading was made: rows that a logger lost or wrote late, parts with a clock of their own, means.

A logger that writes no time makes a row in each step of its loop. What happens to those steps is one pattern for all
sensors; a part that free-runs hands over its newest sample, so that the age of a reading is a sawtooth. No smooth
parameter tells the pattern: it is counted row by row before any motion is fitted (docs/diagnosing-method.md).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray
from discsim.effects.kind import EVERYWHERE, Row

__all__ = ["ROWS", "Average", "ImuClock", "LateRows", "LostRows", "OwnClock", "held_since", "late_by", "written_rows"]

#: who finds these: the count of the samples that rows show (`discsim.validation.diagnosis.detectors.row_times`)
_COUNTED = "row_times"


class LostRows(NamedTuple):
    """Steps of the logger's loop that wrote no row, of all sensors together (clock.lost_rows)."""

    fraction: float = 0.0


def written_rows(effect: LostRows, steps: int, rng: np.random.Generator) -> BoolArray:
    """Return which of the loop's steps (n,) wrote a row; the first did."""
    kept = rng.random(steps) >= effect.fraction
    kept[:1] = True
    return np.asarray(kept)


class LateRows(NamedTuple):
    """Rows that came a tick late while no step was lost (clock.late_rows)."""

    tick_s: float = 0.0
    fraction: float = 0.0


def late_by(effect: LateRows, steps: int, rng: np.random.Generator) -> FloatArray:
    """Return by how much each of the loop's steps (n,) came late, s."""
    return np.asarray(effect.tick_s * (rng.random(steps) < effect.fraction))


class OwnClock(NamedTuple):
    """A magnetometer that free-runs beside the logger's loop (mag.own_clock)."""

    period_s: float = 0.0


class ImuClock(NamedTuple):
    """A chip of gyroscope and accelerometer that free-runs beside the logger's loop (imu.own_clock)."""

    period_s: float = 0.0


def held_since(effect: OwnClock | ImuClock, t: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Return when the newest sample at each of the instants t (n,) s was made, ``phi + P floor((t - phi)/P)``."""
    phi = effect.period_s * float(rng.random())
    return np.asarray(phi + effect.period_s * np.floor((t - phi) / effect.period_s))


class Average(NamedTuple):
    """A row shows ``(1 - w) x_k + w x_(k-1)`` of the part's readings at the loop's steps (mag.average)."""

    weight: float = 0.0


ROWS = (
    Row(
        "clock.lost_rows",
        LostRows,
        "clock",
        EVERYWHERE,
        (0.01,),
        title="rows that the logger lost",
        form="a share of {fraction} of the logger's steps wrote no row, the rest written as if none were lost",
        grows_with="time, in steps",
        trace="every sensor's phase steps ahead where a row is lost, all by the same whole number of steps",
        bounds={"fraction": (0.0, 0.9)},
        sign={"fraction": 1.0},
        detector=_COUNTED,
    ),
    Row(
        "clock.late_rows",
        LateRows,
        "clock",
        EVERYWHERE,
        (0.0005, 0.01),
        title="rows that came late",
        form="a share of {fraction} of the rows came {tick_s} later than written",
        grows_with="rate",
        trace="every sensor's phase is ahead in some rows by one and the same time, and back in the next",
        bounds={"tick_s": (0.0, 1.0), "fraction": (0.0, 1.0)},
        sign={"tick_s": 1.0, "fraction": 1.0},
        detector=_COUNTED,
    ),
    Row(
        "mag.own_clock",
        OwnClock,
        "magnetometer",
        EVERYWHERE,
        (0.0005,),
        title="a magnetometer with a clock of its own",
        form="a row read at t shows the field at φ + P ⌊(t − φ)/P⌋, P = {period_s}",
        grows_with="rate",
        trace="its phase lags by a sawtooth, from nothing to a period of the part",
        bounds={"period_s": (0.0, 1.0)},
        sign={"period_s": 1.0},
        detector=_COUNTED,
    ),
    Row(
        "imu.own_clock",
        ImuClock,
        "board",
        EVERYWHERE,
        (0.0005,),
        title="a gyroscope and accelerometer with a clock of their own",
        form="a row read at t shows both at φ + P ⌊(t − φ)/P⌋, P = {period_s}",
        grows_with="rate",
        trace="both lag by one sawtooth, from nothing to a period of the chip",
        bounds={"period_s": (0.0, 1.0)},
        sign={"period_s": 1.0},
        detector=_COUNTED,
    ),
    Row(
        "mag.average",
        Average,
        "magnetometer",
        EVERYWHERE,
        (0.02,),
        title="a magnetometer whose rows are means of two samples",
        form="y<sub>k</sub> = (1 − {weight}) x<sub>k</sub> + {weight} x<sub>k−1</sub>",
        grows_with="rate",
        trace="the field is late by a share of a step and smaller, more so across a step that was skipped",
        bounds={"weight": (0.0, 1.0)},
        sign={"weight": 1.0},
        detector=_COUNTED,
    ),
)
