"""Figs. 11 and 13: the paper's way from eight throws to a table (28), and from it to a flight, on our truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.methods import estimate
from discsim.motion import Motion
from discsim.recording import Recording
from discsim.sensors import Instruments, record
from discsim.trajectory import Flight, predict, predict_many, release_state
from discsim.validation.studies.paper.releases import PaperThrow, carry
from discsim.validation.yaw_damping import PaperTable, Source, Throw, observe, paper_table
from discsim.validation.yaw_damping.compared import as_mounted
from discsim.validation.yaw_damping.paper_table import RATES_DEG_S, SPEEDS_M_S

__all__ = ["FLOWN", "SOURCES", "Predicted", "Prediction", "predict_by_table"]

#: a release whose flight stays inside the paper's table from hand to ground
FLOWN = PaperThrow(speed=22.9, spin=5800.0)
#: the throws that the table is from: like the paper's, all much alike, speed m/s and spin deg/s
SET = tuple(
    PaperThrow(speed=speed, spin=spin)
    for speed, spin in (
        (22.9, 5200.0), (22.6, 6500.0), (22.3, 5600.0), (22.0, 6100.0),
        (22.8, 5400.0), (22.5, 6300.0), (22.2, 5900.0), (21.9, 5700.0),
    )
)  # fmt: skip
#: the paper's two sources of spin, the second also with its two mount errors
SOURCES = (Source("fft"), Source("accelerometer"), Source("accelerometer", 0.001), Source("accelerometer", 0.005))
#: a release by GPS: so many receivers, whose first fix comes within a spacing of the release
RECEIVERS = 400


@dataclass(frozen=True)
class Predicted:
    """One predicted flight, and how far from the truth it touches down and runs (rms at equal times), m."""

    label: str
    flight: Flight | None
    spin: float = float("nan")
    landing: float = float("nan")
    track: float = float("nan")
    reason: str = ""

    @property
    def numbers(self) -> dict[str, Any]:
        """What the page states."""
        spin = np.degrees(self.spin)
        return {"spin_deg_s": spin, "landing_m": self.landing, "track_m": self.track, "reason": self.reason}


@dataclass(frozen=True)
class Prediction:
    """The throws and the table by the FFT's spin, and the flights that each source predicts of one more throw.

    ``gps_ends`` (n, 2) m, north and east, are the touch-downs of flights whose release has a receiver's velocity.
    """

    throws: tuple[Throw, ...]
    paper: PaperTable
    truth: Flight
    gps_ends: FloatArray
    predicted: tuple[Predicted, ...]
    numbers: dict[str, Any]


def predict_by_table(disc: Disc, environment: Environment, rng: np.random.Generator) -> Prediction:
    """Go the paper's way: spin by each method, lines, (27), (28); then fly one more throw with what came of it."""
    module_stream, flown_stream, gps_stream, *streams = rng.spawn(3 + len(SET))
    module = Instruments.from_parts("mpu9250", "neo_m8n").drawn(module_stream)

    def recorded(throw: PaperThrow, name: str, stream: np.random.Generator) -> Recording:
        motion = carry(disc, environment, throw.release)[1].motion()
        return record(motion, module, stream, plant="flight", name=name, disc=disc)

    set_of = [recorded(throw, f"throw {n + 1}", s) for n, (throw, s) in enumerate(zip(SET, streams, strict=True))]
    truth, release = carry(disc, environment, FLOWN.release)[1], FLOWN.release
    motion, seen = truth.motion(), recorded(FLOWN, "flown", flown_stream)
    tables, predicted = {}, []
    for source in SOURCES:
        throws = [_observed(recording, source) for recording in set_of]
        tables[source.label] = (throws, paper_table([throw for throw in throws if throw is not None]))
        this = _observed(seen, source)
        assert this is not None
        spin = paper_table([this]).slopes[0].start  # the line of this throw at t = 0
        predicted.append(
            _fly(f"{source.label}, (28)", disc, environment, tables[source.label][1], release, spin, motion)
        )
    fft_table, fft_spin = tables["fft"][1], predicted[0].spin
    receivers = _by_receivers(disc, environment, release, truth, gps_stream)
    given = replace(release, velocity=receivers.median_velocity)
    predicted.append(_fly("fft, (28), velocity by GPS", disc, environment, fft_table, given, fft_spin, motion))
    plain = _fly("fft, true C_Nr", disc, environment, None, release, fft_spin, motion)
    by_fft = [throw for throw in tables["fft"][0] if throw is not None]
    numbers = {
        "predicted": {item.label: item.numbers for item in (*predicted, plain)},
        "table": _table_numbers(disc, environment, tables, truth),
        "gps": receivers.numbers,
        "moves_m": _moves(disc, environment, release),
    }
    return Prediction(tuple(by_fft), fft_table, truth, receivers.ends, tuple(predicted), numbers)


def _observed(recording: Recording, source: Source) -> Throw | None:
    """Return a throw as a source sees it; None where it knows too little of the spin."""
    seen = as_mounted(recording, source)
    try:
        return observe(seen, source.method, estimate(seen, source.method))
    except InputError:
        return None


def _fly(
    label: str, disc: Disc, environment: Environment, table: PaperTable | None, release: Release, spin: float,
    truth: Motion,
) -> Predicted:  # fmt: skip
    flown = disc if table is None else replace(disc, yaw_damping_table=table.table)
    try:
        flight = predict(flown, environment, replace(release, body_rate=np.array([0.0, 0.0, spin])))
    except InputError as error:
        return Predicted(label, None, spin, reason=str(error))
    t = np.linspace(0.0, min(truth.end, flight.end), 200)
    apart = flight.at(t).position - truth.at(t).position
    landing = float(np.linalg.norm(flight.landing - truth.position[-1]))
    return Predicted(label, flight, spin, landing, float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))))


def _table_numbers(
    disc: Disc, environment: Environment, tables: Mapping[str, tuple[Sequence[Throw | None], PaperTable]], truth: Flight
) -> dict[str, Any]:
    """Return how the table compares with the one C_Nr that the disc has: over its nodes, and along the flight."""
    assert disc.aero is not None
    t = np.linspace(0.0, truth.end, 200)
    state = truth.at(t)
    V, r = np.linalg.norm(state.velocity - environment.wind, axis=1), state.rate[:, 2]
    found: dict[str, Any] = {"true_CNr": disc.aero.CNr}
    for label, (throws, paper) in tables.items():
        along = paper.at(r, V)
        # what the flight feels of C_Nr: each instant weighs with its yawing moment, V r (25)
        mean = float(np.average(along, weights=V * np.abs(r)))
        slopes = [line.slope for line in paper.slopes]
        found[label] = {
            "throws": sum(throw is not None for throw in throws),
            "nodes": [paper.table.CNr.max(), paper.table.CNr.min()],
            "along": [along.max(), along.min()],
            "mean_along": mean,
            "slope_deg_s2": np.degrees([min(slopes), max(slopes)]),
        }
    found["flight"] = {"rate_deg_s": np.degrees([r[-1], r[0]]), "speed_m_s": [V.min(), V.max()]}
    found["domain"] = {"rate_deg_s": [RATES_DEG_S[0], RATES_DEG_S[-1]], "speed_m_s": [SPEEDS_M_S[0], SPEEDS_M_S[-1]]}
    return found


@dataclass(frozen=True)
class _Receivers:
    """Touch-downs (n, 2) m by n receivers, the velocity (3,) that the median one gives, and what the page states."""

    ends: FloatArray
    median_velocity: FloatArray
    numbers: dict[str, Any]


def _by_receivers(
    disc: Disc, environment: Environment, release: Release, truth: Flight, rng: np.random.Generator
) -> _Receivers:
    """Fly with the velocity at release by the first fix of many receivers, everything else being true.

    A first fix comes up to 0.1 s after release (10 Hz), with 0.05 m/s rms on each axis (models/parts/neo_m8n.toml);
    the climb is the throwing angle, as in the paper, and here the true one.
    """
    state = truth.at(np.sort(rng.uniform(0.0, 0.1, RECEIVERS)))
    level = state.velocity[:, :2] + rng.normal(0.0, 0.05, (RECEIVERS, 2))
    speed = np.hypot(*level.T)
    states = np.tile(release_state(release), (RECEIVERS, 1))
    states[:, 3:6] = np.column_stack((level, -speed * np.tan(np.radians(FLOWN.climb))))
    ends = predict_many(disc, environment, states, threads=1).state[:, :2]
    missed = np.linalg.norm(ends - truth.landing[:2], axis=1)
    middle = int(np.argsort(missed)[RECEIVERS // 2])
    assert release.velocity is not None
    slow = speed - np.hypot(*release.velocity[:2])
    numbers = {
        "median_m": missed[middle],
        "worst_95_m": np.percentile(missed, 95),
        "speed_error_m_s": [slow.mean(), slow.std()],
        "outside_table": np.mean(np.linalg.norm(states[:, 3:6], axis=1) > SPEEDS_M_S[-1]),
    }
    return _Receivers(ends, states[middle, 3:6], numbers)


def _moves(disc: Disc, environment: Environment, release: Release) -> dict[str, float]:
    """Return by how much one unit of each part of the release, and of C_Nr, moves the touch-down, m."""
    assert disc.aero is not None
    assert release.body_rate is not None
    assert release.roll is not None
    assert release.pitch is not None
    degree = np.radians(1.0)
    changed = {
        "0.1 m/s of speed": replace(FLOWN, speed=FLOWN.speed - 0.1).release,
        "1 deg of climb": replace(FLOWN, climb=FLOWN.climb - 1).release,
        "1 deg of heading": replace(FLOWN, heading=FLOWN.heading - 1).release,
        "1 deg of roll": replace(release, roll=release.roll - degree),
        "1 deg of pitch": replace(release, pitch=release.pitch - degree),
        "1 % of spin": replace(release, body_rate=0.99 * release.body_rate),
    }
    place = carry(disc, environment, release)[1].landing
    moved = {name: carry(disc, environment, other)[1].landing for name, other in changed.items()}
    weaker = replace(disc, aero=disc.aero._replace(CNr=0.9 * disc.aero.CNr))
    moved["10 % of C_Nr"] = carry(weaker, environment, release)[1].landing
    return {name: float(np.linalg.norm(landing - place)) for name, landing in moved.items()}
