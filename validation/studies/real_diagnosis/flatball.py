"""The throws of the instrumented Ultimate disc: what its sensors say of the time between rows, one by one.

The rate of a gyroscope and the centripetal force need no time base. From one row to the next the field turns by the
rate times the time between them, so each row's length follows. The wobble of a free disc turns in the body at
(Izz/Ixx - 1) r, which its inertia fixes, and so tells the mean length of rows without any field.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid

from discsim.arrays import FloatArray
from discsim.estimators.methods import estimate
from discsim.recording import Recording, Samples
from discsim.validation.studies.real_recordings.turns import field_phase

__all__ = ["Rows", "decay", "restamped", "rows_of", "wobble_rate"]

#: the wobble is looked for in this much of a flight, when it is largest, s of the file
WOBBLE_SPAN = 1.0
#: frequencies of the wobble that are tried, over what the stated inertia and rows say
TRIED = np.linspace(0.6, 1.7, 2201)
#: a row this many times as long as usual is late
LATE = 1.3
#: what just after release is left out of decays, s of the file
SETTLED = 0.5


@dataclass(frozen=True)
class Rows:
    """What a throw says of its rows.

    Attributes
    ----------
    by_field : float
        Turns of the field over turns of the gyroscope: by how much longer than assumed a row is.
    steps : (n - 1,) array
        Length of each row by the field and the gyroscope, s.
    by_wobble : float
        The same from the wobble: its frequency per row over (Izz/Ixx - 1) r.
    wobble : float
        Root mean square of the transverse rate in the first `WOBBLE_SPAN`, its mean taken off, rad/s.
    wobble_decay : float
        Rate at which its size dies, per second of the file.
    spin : mapping
        Decay of the spin rate by each sensor, per second of the file.
    """

    by_field: float
    steps: FloatArray
    by_wobble: float
    wobble: float
    wobble_decay: float
    spin: dict[str, float]

    @property
    def usual(self) -> float:
        """Length of most rows, s: the median of those that are not late."""
        return float(np.median(self.steps[self.steps < LATE * np.median(self.steps)]))

    @property
    def late(self) -> float:
        """Share of rows that are longer than `LATE` of the usual ones."""
        return float(np.mean(self.steps > LATE * self.usual))


def rows_of(recording: Recording) -> Rows:
    """Return what a free flight's field, gyroscope, accelerometer and wobble say of its rows."""
    gyroscope, field = recording.need("gyroscope"), recording.need("magnetometer")
    phase = -field_phase(field.value, "ellipse")
    r = np.interp(field.t, gyroscope.t, gyroscope.value[:, 2])
    turned = float(np.sum((r[1:] + r[:-1]) / 2.0 * np.diff(field.t)))
    disc = recording.disc
    assert disc is not None
    ratio, size, decay_rate = wobble_rate(gyroscope, disc.Izz / disc.Ixx - 1.0)
    force = estimate(recording, "accelerometer")
    slope = np.gradient(phase, field.t)
    late = field.t > field.t[0] + SETTLED
    spin = {
        "magnetometer": decay(field.t[late], np.abs(slope)[late]),
        "gyroscope": decay(gyroscope.t[late], np.abs(gyroscope.value[late, 2])),
        "accelerometer": decay(force.t[force.t > force.t[0] + SETTLED], force.rate[force.t > force.t[0] + SETTLED]),
    }
    steps = np.diff(phase) / ((r[1:] + r[:-1]) / 2.0)
    return Rows(float((phase[-1] - phase[0]) / turned), steps, ratio, size, decay_rate, spin)


def wobble_rate(gyroscope: Samples, excess: float) -> tuple[float, float, float]:
    """Return the wobble's frequency over ``excess`` r, its size (rad/s) and the rate at which it dies (1/s).

    p + i q of a free disc turns by ``excess`` = Izz/Ixx - 1 times the angle turned. The angle is the gyroscope's
    integral over the times of the file; a mean, such as a tilted sensor makes, is taken off.
    """
    t = gyroscope.t - gyroscope.t[0]
    early = t <= WOBBLE_SPAN
    r = gyroscope.value[early, 2]
    angle = cumulative_trapezoid(r, t[early], initial=0)
    across = gyroscope.value[early, 0] + 1j * gyroscope.value[early, 1]
    across = across - np.mean(across)
    # a taper, for the wobble dies and a tilt's remainder at rate zero must not leak
    taper = np.hanning(2 * across.size)[across.size :]
    power = np.abs(np.exp(-1j * excess * TRIED[:, None] * angle) @ (across * taper))
    ratio = float(TRIED[int(np.argmax(power))])
    slow = across * np.exp(-1j * excess * ratio * angle)
    count = max(across.size // 5, 4)
    size = np.abs(np.convolve(slow, np.ones(count) / count, mode="valid"))
    middle = np.convolve(t[early], np.ones(count) / count, mode="valid")
    return ratio, float(np.sqrt(np.mean(np.abs(across) ** 2))), decay(middle, size)


def decay(t: FloatArray, value: FloatArray) -> float:
    """Return the rate at which a positive quantity (n,) dies, 1/s: minus the slope of its logarithm, NaN left out."""
    known = np.isfinite(value) & (value > 0.0)
    return float(-np.polyfit(t[known], np.log(value[known]), 1)[0])


def restamped(recording: Recording, ratio: float) -> Recording:
    """Return a recording whose rows are ``ratio`` as long."""
    return replace(
        recording, samples={name: Samples(one.t * ratio, one.value) for name, one in recording.samples.items()}
    )
