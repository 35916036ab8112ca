"""Time-stamp recovery: how long each row lasted that a logger wrote as if evenly spaced, and in which ticks.

Takes recordings; gives the tick and each row's duration. Where a field turns steadily, the angle between two rows tells
the time between them, once a gyroscope tells the rate. Rows that were lost, or came late, last several ticks of the
sensor's own clock. Whole numbers of a common tick, found in every recording alike, are what no clock that merely runs
wrong would make.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import Recording
from discsim.validation.diagnosis.signals.phase_regression import (
    angle_turned,
    retimed,
    signal_of,
    steps,
)
from discsim.validation.identification.circle import circle_centre

__all__ = ["Durations", "Rows", "durations", "rows_of"]

#: a row differs from the ordinary one where its duration does by this share
_UNLIKE = 0.2
#: rows are uneven where at least this share of them is
_SHARE = 0.05
#: how sharply durations must gather at whole ticks: mean cosine of their phase (1: exactly), and by how much less a
#: longer tick may do so to be the one
_GATHERED, _AS_WELL = 0.6, 0.97
#: a duration this far from a whole number of ticks is not counted when the tick is measured
_NEAR = 0.25
#: a row must turn the field by this much, rad, for its duration to be told
_LEAST = 0.1


@dataclass(frozen=True)
class Durations:
    """True durations (n - 1,) s between the magnetometer's n rows, by its field and the rate; t (n,) as written."""

    name: str
    t: FloatArray
    lasted: FloatArray

    @property
    def uneven(self) -> float:
        """Share of the rows that last unlike the ordinary one."""
        ratio = self.lasted / np.diff(self.t)
        return float(np.mean(np.abs(ratio / np.median(ratio) - 1.0) > _UNLIKE))


def durations(recording: Recording, name: str) -> Durations | None:
    """Return how long each row lasted, None where the field does not tell.

    Iron is the centre of the circle that the field runs: what a regression on the turns of uneven rows makes of it is
    off by some of the field, which blurs durations by a tenth of a row and more.
    """
    field = signal_of(recording, "field")
    if field is None:
        return None
    psi = angle_turned(recording, field.t)
    turned = np.diff(psi)
    slowest, fastest = np.quantile(np.abs(turned), [0.05, 1.0])
    if slowest < _LEAST or fastest > np.pi:
        return None
    return Durations(name, field.t, steps(field, psi, circle_centre(field.value))[0] * np.diff(field.t))


@dataclass(frozen=True)
class Rows:
    """The tick in which the rows of recordings come, s, with its error, and each recording's own with its rows."""

    tick_s: float
    sd_s: float
    gathered: float
    own: Mapping[str, tuple[float, float]]
    durations: tuple[Durations, ...]

    def counts(self, name: str, tick: float | None = None) -> FloatArray:
        """Return how many ticks each row (n - 1,) of a recording lasted; at least one."""
        mine = next(item for item in self.durations if item.name == name)
        return np.maximum(np.rint(mine.lasted / (self.tick_s if tick is None else tick)), 1.0)

    def without(self, name: str) -> float | None:
        """Return the tick of all other recordings."""
        others = [item for item in self.durations if item.name != name]
        return _measured(others, self.tick_s)[0] if others else None

    def counted(self, recording: Recording, name: str, tick: float | None) -> Recording | None:
        """Return a recording with its samples at the times that counted rows give, None where there is none."""
        mine = next((item for item in self.durations if item.name == name), None)
        if mine is None or tick is None:
            return None
        times = np.concatenate([[0.0], np.cumsum(self.counts(name, tick) * tick)])
        return retimed(recording, mine.t, mine.t[0] + times)

    def evenly(self, recording: Recording, name: str, tick: float) -> Recording:
        """Return a recording that lasts as long as counted rows say, its rows evenly spaced."""
        mine = next(item for item in self.durations if item.name == name)
        length = float(np.sum(self.counts(name, tick) * tick))
        return retimed(recording, mine.t, mine.t[0] + (mine.t - mine.t[0]) * length / float(mine.t[-1] - mine.t[0]))

    def shares(self, name: str) -> dict[int, float]:
        """Return the share of rows of a recording that last each number of ticks."""
        numbers, times = np.unique(self.counts(name).astype(int), return_counts=True)
        return {int(n): float(k) / float(np.sum(times)) for n, k in zip(numbers, times, strict=True)}

    def mean_row(self, name: str) -> float:
        """Return the mean duration of a row of a recording, s."""
        return float(np.mean(self.counts(name)) * self.tick_s)

    def unwritten(self, name: str) -> float:
        """Return the share of ordinary rows that a recording lacks, an ordinary row being the commonest."""
        counts = self.counts(name)
        numbers, times = np.unique(counts, return_counts=True)
        ordinary = float(numbers[np.argmax(times)])
        return max(0.0, 1.0 - ordinary * counts.size / float(np.sum(counts)))

    @property
    def sentences(self) -> list[str]:
        """What there is to say, in words."""
        names = [item.name for item in self.durations]
        mean = ", ".join(f"{1e3 * self.mean_row(name):.2f} ms in {name}" for name in names)
        lost = ", ".join(f"{100.0 * self.unwritten(name):.0f} % in {name}" for name in names)
        ordinary = max(self.shares(names[0]).items(), key=lambda pair: pair[1])[0]
        return [
            f"The rows are not evenly spaced: by the field's phase over the rate, row by row, they last whole numbers "
            f"of a tick of {1e3 * self.tick_s:.3f} ± {1e3 * self.sd_s:.3f} ms, the same in every recording. The "
            f"ordinary row lasts {1e3 * ordinary * self.tick_s:.2f} ms (ticks: {ordinary}); longer ones are rows that "
            f"came late or were lost. Of the rows that there should be these are missing: {lost}.",
            f"So the mean row lasts {mean}: where a recording's clock seems to differ from another's, it lacks more.",
        ]

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "tick_s": self.tick_s,
            "tick_sd_s": self.sd_s,
            "gathered": self.gathered,
            "recordings": [
                {
                    "recording": item.name,
                    "tick_s": self.own[item.name][0],
                    "tick_sd_s": self.own[item.name][1],
                    "mean_row_s": self.mean_row(item.name),
                    "missing": self.unwritten(item.name),
                    "ticks": {str(n): share for n, share in self.shares(item.name).items()},
                }
                for item in self.durations
            ],
        }


def rows_of(recordings: Sequence[Recording], names: Sequence[str]) -> Rows | None:
    """Return the tick in which rows come, None where they are evenly spaced or come in no common tick."""
    pairs = zip(recordings, names, strict=True)
    found = [own for recording, name in pairs if (own := durations(recording, name)) is not None]
    if not found or np.mean([own.uneven for own in found]) < _SHARE:
        return None
    ordinary = float(np.median(np.concatenate([own.lasted for own in found])))
    ticks = np.geomspace(0.25, 1.3, 1200) * ordinary
    # a wobble blurs the field's phase, and dies: rows of the second halves may gather where all do not
    scores = max(
        (np.mean([_gathered(own.lasted[own.lasted.size * k // 2 :], ticks) for own in found], axis=0) for k in (0, 1)),
        key=np.max,
    )
    if float(np.max(scores)) < _GATHERED:
        return None
    peaks = [k for k in range(1, ticks.size - 1) if scores[k] >= max(scores[k - 1], scores[k + 1])]
    tick = max((k for k in peaks if scores[k] > _AS_WELL * np.max(scores)), default=int(np.argmax(scores)))
    measured, sd = _measured(found, float(ticks[tick]))
    each = {item.name: _measured([item], measured) for item in found}
    rows = Rows(measured, sd, float(scores[tick]), each, tuple(found))
    # where all last the same number of ticks it was the phase's noise that made them look uneven
    unlike = np.mean([1.0 - max(rows.shares(item.name).values()) for item in found])
    return rows if unlike >= _SHARE else None


def _gathered(lasted: FloatArray, ticks: FloatArray) -> FloatArray:
    """Return how sharply durations (n,) gather at whole numbers of ticks (k,), the mean cosine of their phase."""
    return np.array([np.mean(np.cos(2.0 * np.pi * lasted / tick)) for tick in ticks])


def _measured(found: Sequence[Durations], tick: float) -> tuple[float, float]:
    """Return the tick that fits durations best, and its error, from one that is nearly right."""
    lasted = np.concatenate([own.lasted for own in found])
    counts = np.maximum(np.rint(lasted / tick), 1.0)
    near = np.abs(lasted / tick - counts) < _NEAR
    n, x = counts[near], lasted[near]
    best = float(n @ x / (n @ n))
    return best, float(np.std(x - n * best) / np.sqrt(n @ n))
