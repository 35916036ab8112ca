"""Stamps that come early or late of rows that come evenly, sensor by sensor: the even times.

A logger that waits, or a host that stamps what arrives, writes another time than a reading's. Takes a recording; gives
it with even times where readings turn more evenly by these, by the rule with which logs are imported.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.kind import BOARD
from discsim.recording import Recording, Samples
from discsim.validation.rows.even_rows import even_times, left_beside_stamps
from discsim.validation.rows.own_times import LESS
from discsim.validation.rows.readings import Readings

__all__ = ["with_even_rows"]


def with_even_rows(recording: Recording) -> tuple[Recording, list[str]]:
    """Return a recording with even times of the sensors on a board whose stamps come early or late, and what is said.

    One sensor's motion must tell it; the others, stamped by the same logger, are taken so unless theirs contradicts.
    """
    times: dict[str, FloatArray] = {}
    left: dict[str, float] = {}
    for sensor in [one for one in recording.samples if one in BOARD]:
        one = recording.samples[sensor]
        number = np.arange(len(one))
        if (even := even_times(number, one.t)) is not None:
            times[sensor], left[sensor] = even, left_beside_stamps(Readings(number, one.t, one.value), even)
    if not min(left.values(), default=1.0) < LESS:
        return recording, []
    late = [sensor for sensor in times if left[sensor] < 1.0 / LESS]
    own = {sensor: recording.samples[sensor] for sensor in late}
    off = max(float(np.sqrt(np.mean((one.t - times[sensor]) ** 2))) for sensor, one in own.items())
    said = (
        f"the stamps of {' and '.join(late)} are {1e3 * off:.2g} ms (rms) early or late of even rows, by which "
        "readings turn more evenly: they are taken at even times."
    )
    mended = {sensor: Samples(times[sensor], one.value) for sensor, one in own.items()}
    return replace(recording, samples={**recording.samples, **mended}), [said]
