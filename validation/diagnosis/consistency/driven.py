"""What can be said of a body that is no free spin: that something drives it, what its sensors show, what they lack.

Takes recordings; gives sentences, and what kinematics alone explains. A hand, a wheel, fins or lines put moments on a
body that no law here describes; its sensors may still be held against one another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discsim.recording import Recording
from discsim.validation.diagnosis.answer.partly import PartlyExplained
from discsim.validation.diagnosis.consistency.turned_field import turned_field

__all__ = ["Turning", "turning_of"]

#: a rate that grows by this share of the largest is driven: a wobble moves the size of a disc's rate by some per cent,
#: and air only takes from it
_GROWN = 0.2
#: rates are medians over this long, s
_OVER = 0.2


@dataclass(frozen=True)
class Turning:
    """What there is to say of recordings beside any law of motion.

    ``reconciled`` tells that gyroscope and magnetometer agree, once what ``partly`` has is allowed for.
    """

    sentences: tuple[str, ...]
    partly: tuple[PartlyExplained, ...] = ()
    reconciled: bool = False


def turning_of(recordings: Sequence[Recording], names: Sequence[str]) -> Turning:
    """Return what can be said of free spins (called ``names``) by their rates and fields alone."""
    said: list[str] = []
    partly: tuple[PartlyExplained, ...] = ()
    reconciled = []
    for recording, name in zip(recordings, names, strict=True):
        place = f"{name}: " if len(names) > 1 else ""
        said += [place + text for text in (_driven(recording), _alone(recording)) if text]
        found = turned_field(recording)
        if found is not None:
            said.append(place + found.text)
            reconciled.append(found.holds)
            partly = found.found if found.holds and len(names) == 1 else ()
    return Turning(tuple(said), partly, bool(reconciled) and all(reconciled))


def _driven(recording: Recording) -> str:
    """Return in words that the rate grows as no free spin's does, or nothing."""
    samples = recording.get("gyroscope")
    if samples is None or not np.isfinite(samples.interval):
        return ""
    size = np.linalg.norm(np.nan_to_num(samples.value), axis=1)
    rows = max(round(_OVER / samples.interval), 1)
    count = size.size // rows
    if count < 3:
        return ""
    rate = np.median(size[: count * rows].reshape(count, rows), axis=1)
    t = samples.t[: count * rows : rows] + 0.5 * _OVER
    least = np.minimum.accumulate(rate)
    end = int(np.argmax(rate - least))
    start = int(np.argmin(rate[: end + 1]))
    if rate[end] - rate[start] <= _GROWN * float(np.max(rate)):
        return ""
    return (
        f"Something drives this body: its rate grows from {rate[start]:.3g} to {rate[end]:.3g} rad/s between "
        f"{t[start]:.1f} and {t[end]:.1f} s, and a free spin only loses rate. No law here describes what drives it; "
        "for a free spin import the rows in which nothing does (--rows A:B)."
    )


def _alone(recording: Recording) -> str:
    """Return in words that one sensor alone shows the turning, or nothing."""
    placed = recording.sheets["accelerometer"].position if "accelerometer" in recording.sheets else None
    showing = [
        sensor
        for sensor in recording.samples
        if sensor in ("magnetometer", "gyroscope", "rate_reference")
        or (sensor == "accelerometer" and placed is not None)
    ]
    if len(showing) != 1:
        return ""
    return (
        f"The {showing[0]} alone shows how the body turns: nothing else on board can bear it out or contradict it, so "
        "neither an error of it nor a cause can be told. A second sensor of the turning is lacking."
    )
