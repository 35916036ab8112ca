"""Flights predicted with a C_Nr and a spin at release from one source, and how far they are from the truth.

As in the paper's section 4.4, every prediction has the true release but for its spin, which is the source's own, like
its C_Nr. Each is flown once more with the true spin, so that what C_Nr alone is worth can be told from what the spin
at release is worth.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.disc import Disc, Release, YawDampingTable
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.motion import Motion
from discsim.trajectory import Flight, predict
from discsim.validation.reporting.scores import Score, at_most
from discsim.validation.yaw_damping.compared import Compared
from discsim.validation.yaw_damping.observations import Throw

__all__ = ["OUTPUT_ERROR", "Damping", "Predicted", "dampings", "feed_back", "feedback_checks", "rate_at_release"]

#: the three ways from spin to C_Nr
OUTPUT_ERROR, LINE, TABLE = "output error", "line and (26)", "table (28)"
#: the goal: with the best spin, errors of at most this share of the accelerometer's with 1 mm mount error
SHARE = 0.2
#: instants at which tracks are compared, from release to the first touch-down
_INSTANTS = 200


@dataclass(frozen=True)
class Damping:
    """A C_Nr from one source of spin: by which way, and its value or table."""

    source: str
    way: str
    CNr: float = float("nan")
    table: YawDampingTable | None = None

    def on(self, disc: Disc) -> Disc:
        """Return the disc with this C_Nr."""
        assert disc.aero is not None
        if self.table is not None:
            return replace(disc, yaw_damping_table=self.table)
        return replace(disc, aero=disc.aero._replace(CNr=self.CNr), yaw_damping_table=None)


@dataclass(frozen=True)
class Predicted:
    """One predicted flight against the truth.

    Attributes
    ----------
    damping : Damping
        What it was flown with.
    rate : float
        Spin at release, rad/s.
    flight : Flight or None
        None where it could not be flown, with the reason.
    landing, track, end_rate : float
        Distance between the touch-downs (m), root mean square distance at equal times (m), and error of the spin at
        the end (rad/s).
    damping_only : float
        Distance between the touch-downs, m, where only C_Nr is the source's and the spin at release is true.
    """

    damping: Damping
    rate: float
    flight: Flight | None
    landing: float = float("nan")
    track: float = float("nan")
    end_rate: float = float("nan")
    damping_only: float = float("nan")
    reason: str = ""


def dampings(found: Iterable[Compared]) -> list[Damping]:
    """Return every C_Nr of every source: by output error, by a line and (26), and by the paper's table."""
    listed = []
    for item in found:
        if item.fit is None or item.paper is None:
            continue
        label = item.source.label
        listed.append(Damping(label, OUTPUT_ERROR, item.fit.CNr))
        listed.append(Damping(label, LINE, item.fit.by_26))
        listed.append(Damping(label, TABLE, table=item.paper.table))
    return listed


def rate_at_release(throw: Throw, flight: Flight) -> float:
    """Return the spin at t = 0, rad/s, from all spin rates of a throw and a model flight's decay since release.

    Each value over what is left of the spin in ``flight`` by then is one of the release; they are averaged with their
    weights. No polynomial can do that: the decay slackens as the disc slows down.
    """
    t = np.clip(throw.spin_t, 0.0, flight.end)
    left = flight.at(t).rate[:, 2] / flight.at(0.0).rate[0, 2]
    return float(np.average(throw.spin / left, weights=(left / throw.spin_sd) ** 2))


def feed_back(
    truth: Motion,
    release: Release,
    disc: Disc,
    environment: Environment,
    given: Sequence[Damping],
    throws: Mapping[str, Throw],
) -> list[Predicted]:
    """Predict the flight with each C_Nr, and the spin at release by the source's own rates of this throw."""
    assert release.body_rate is not None
    predicted = []
    for damping in given:
        turning = damping.on(disc)
        try:
            other = predict(turning, environment, release)
            rate = rate_at_release(throws[damping.source], other)
            flight = predict(turning, environment, replace(release, body_rate=np.array([*release.body_rate[:2], rate])))
        except InputError as error:
            predicted.append(Predicted(damping, float("nan"), None, reason=str(error)))
            continue
        t = np.linspace(0.0, min(truth.end, flight.end), _INSTANTS)
        apart = flight.at(t).position - truth.at(t).position
        touched = truth.position[-1]
        predicted.append(
            Predicted(
                damping,
                rate,
                flight,
                landing=float(np.linalg.norm(flight.landing - touched)),
                track=float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))),
                end_rate=float(flight.at(t[-1]).rate[0, 2] - truth.at(t[-1:]).rate[0, 2]),
                damping_only=float(np.linalg.norm(other.landing - touched)),
            )
        )
    return predicted


def feedback_checks(name: str, predicted: Sequence[Predicted]) -> list[Score]:
    """Score the best spin's errors against the accelerometer's with 1 mm mount error, both by output error."""
    found = {item.damping.source: item for item in predicted if item.damping.way == OUTPUT_ERROR}
    best, other = found["best"], found["accelerometer, 1 mm"]
    return [
        at_most(
            f"feedback: {what} of best over accelerometer's, {name}",
            getattr(best, key) / getattr(other, key),
            "1",
            SHARE,
        )
        for what, key in (("landing error", "landing"), ("track error", "track"))
    ]
