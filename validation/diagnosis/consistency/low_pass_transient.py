"""The transient of a low-pass: what the throw has left in an accelerometer, dying away while the disc already flies.

Takes recordings; gives the time constant tau with proofs on recordings set aside. A low-pass hides most of what turns
with the spin and keeps the acceleration of the hand: what it reads beyond the pull towards the axis falls off as
exp(-t/tau), the same in every recording of one sensor (accel.lag). A quick one leaves some of what turns, which is
fitted beside it: the force of the air, which changes slowly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import Lag
from discsim.recording import Recording
from discsim.validation.diagnosis.signals.phase_regression import angle_turned, centripetal_of
from discsim.validation.identification.plants import plant_of

__all__ = ["LowPassTransient", "TransientProof", "low_pass_transient_of"]

_LAG = catalogued(Lag, "accelerometer").id
#: time constants that are tried, s
_TAUS = np.geomspace(0.02, 0.6, 240)
#: an accelerometer settles slowly where an exponential leaves less than this share of the squares in most recordings
_LEFT = 0.15
#: fewest readings of a recording
_FEWEST = 40


@dataclass(frozen=True)
class _Start:
    """What an accelerometer reads beyond the pull towards the axis: t (n,) s, x + i y (n,), the angle turned (n,)."""

    name: str
    t: FloatArray
    beyond: ComplexArray
    turned: FloatArray

    def left(self, tau: float | None) -> float:
        """Return the squares left by an exponential of a time constant, and what is there without one; of None by that.

        That is a constant, and what is fixed in the air and turns with the spin: a parabola in time.
        """
        air = np.exp(-1j * self.turned)
        columns = [np.ones(self.t.size), air, air * self.t, air * self.t**2]
        if tau is not None:
            columns.append(np.exp(-self.t / tau))
        Q, _ = np.linalg.qr(np.column_stack(columns).astype(complex))
        return float(np.sum(np.abs(self.beyond - Q @ (Q.conj().T @ self.beyond)) ** 2))


@dataclass(frozen=True)
class TransientProof:
    """A recording's own time constant, that of the others, and what that leaves of this one, rms m/s^2 of an axis."""

    recording: str
    tau_s: float
    tau_sd_s: float
    tau_of_others_s: float
    left_m_s2_before: float
    left_m_s2_after: float


@dataclass(frozen=True)
class LowPassTransient:
    """The time constant of all recordings, with an error from their scatter, and what it leaves of each."""

    tau_s: float
    sd_s: float
    heldout: tuple[TransientProof, ...]

    @property
    def sentences(self) -> list[str]:
        """What there is to say, in words."""
        proofs = "; ".join(
            f"{proof.recording}: own {1e3 * proof.tau_s:.0f} ± {1e3 * proof.tau_sd_s:.0f} ms, with that of the others "
            f"{proof.left_m_s2_before:.2f} m/s² become {proof.left_m_s2_after:.2f}"
            for proof in self.heldout
        )
        return [
            f"At first the accelerometer contradicts the gyroscope: what it reads beyond the pull towards the axis "
            f"dies away with a time constant of {1e3 * self.tau_s:.0f} ± {1e3 * self.sd_s:.0f} ms, as behind a "
            f"low-pass ({_LAG}) that still holds the acceleration of the hand, and that hides what turns with "
            f"the spin ({proofs})."
        ]

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {"id": _LAG, **asdict(self)}


def low_pass_transient_of(recordings: Sequence[Recording], names: Sequence[str]) -> LowPassTransient | None:
    """Return how slowly the accelerometer settles, None where it does not show that, or in one recording alone."""
    starts = [
        start
        for recording, name in zip(recordings, names, strict=True)
        if (start := _start(recording, name)) is not None
    ]
    if len(starts) < 2:
        return None
    squares = {start.name: np.array([start.left(float(tau)) for tau in _TAUS]) for start in starts}
    constant = {start.name: start.left(None) for start in starts}
    proofs = []
    for start in starts:
        own = squares[start.name]
        # every recording weighs alike, however hard it was thrown
        others = np.sum([np.log(squares[other.name]) for other in starts if other is not start], axis=0)
        place = int(np.argmin(others))
        best, sd = _lowest(own, start.t.size)
        numbers = 2.0 * start.t.size
        proofs.append(
            TransientProof(
                start.name,
                best,
                sd,
                float(_TAUS[place]),
                float(np.sqrt(constant[start.name] / numbers)),
                float(np.sqrt(own[place] / numbers)),
            )
        )
    if np.median([(proof.left_m_s2_after / proof.left_m_s2_before) ** 2 for proof in proofs]) > _LEFT:
        return None
    tau = float(_TAUS[int(np.argmin(np.sum([np.log(own) for own in squares.values()], axis=0)))])
    return LowPassTransient(
        tau, float(np.std([proof.tau_s for proof in proofs], ddof=1) / np.sqrt(len(proofs))), tuple(proofs)
    )


def _lowest(squares: FloatArray, readings: int) -> tuple[float, float]:
    """Return the time constant of least squares and its error, by where they have grown as noise would let them."""
    best = int(np.argmin(squares))
    allowed = squares[best] * (1.0 + 1.0 / max(2 * readings - 5, 1))
    inside = np.flatnonzero(squares <= allowed)
    low, high = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, squares.size - 1)
    return float(_TAUS[best]), float(0.5 * (_TAUS[high] - _TAUS[low]))


def _start(recording: Recording, name: str) -> _Start | None:
    found = centripetal_of(recording)
    if found is None or not plant_of(recording).airborne:
        return None
    t, felt, pull = found
    good = np.all(np.isfinite(felt), axis=1)
    if np.count_nonzero(good) < _FEWEST:
        return None
    beyond = felt[good] - pull[good]
    turned = angle_turned(recording, t[good])
    return _Start(name, t[good] - t[good][0], beyond[:, 0] + 1j * beyond[:, 1], turned)
