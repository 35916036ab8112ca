"""Fig. 3: the magnetometer of a whole flight, and one spectrum of all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc
from discsim.environment import Environment
from discsim.recording import Samples
from discsim.sensors import Instruments, record
from discsim.validation.studies.paper.releases import PaperThrow, carry

__all__ = ["WholeFlight", "whole_flight"]

#: the paper's dominant line, Hz, and the spin at release that begins at its upper end, deg/s
PAPER_HZ, SPIN_DEG_S = (9.0, 10.0), 3600.0
#: share of the line's power that counts as dominant: between where 5 and 95 % of it are reached
INNER = (0.05, 0.95)
#: zeros make the spectrum this many times finer
FINER = 8


@dataclass(frozen=True)
class WholeFlight:
    """The samples of a flight, the amplitude (k,) uT of all its x axis over frequency (k,) Hz, and the true line."""

    magnetometer: Samples
    frequency: FloatArray
    amplitude: FloatArray
    true_hz: tuple[float, float]
    dominant_hz: tuple[float, float]

    @property
    def numbers(self) -> dict[str, Any]:
        """What the page states."""
        return {
            "spin_deg_s": SPIN_DEG_S,
            "true_hz": self.true_hz,
            "dominant_hz": self.dominant_hz,
            "peak_hz": self.frequency[np.argmax(self.amplitude)],
            "s": self.magnetometer.t[-1],
        }


def whole_flight(disc: Disc, environment: Environment, rng: np.random.Generator) -> WholeFlight:
    """Record the paper's release at the spin of its Fig. 3, and transform all of the field's x axis at once."""
    _, flight = carry(disc, environment, PaperThrow(spin=SPIN_DEG_S).release)
    recording = record(flight.motion(), Instruments.from_parts("mpu9250"), rng, plant="flight", name="fig-3", disc=disc)
    magnetometer = recording.need("magnetometer")
    still = magnetometer.value[:, 0] - magnetometer.value[:, 0].mean()
    total = FINER * still.size
    frequency = np.fft.rfftfreq(total, magnetometer.interval)
    amplitude = 2 * np.abs(np.fft.rfft(still, total)) / still.size
    line = np.where(frequency > 4.0, amplitude**2, 0.0)  # below: the field that turns with the path
    share = np.cumsum(line) / line.sum()
    r = flight.at(np.array([0.0, flight.end])).rate[:, 2] / (2 * np.pi)
    low, high = (float(np.interp(edge, share, frequency)) for edge in INNER)
    return WholeFlight(
        magnetometer,
        np.asarray(frequency, dtype=np.float64),
        np.asarray(amplitude),
        (float(r[1]), float(r[0])),
        (low, high),
    )
