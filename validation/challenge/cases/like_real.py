"""Free spins as a real logger on a thrown disc wrote them, with all that its parts did to them concealed at once.

The pattern is that of four measured throws (docs/real-diagnosis.md): a loop of 10 ms that writes no time and loses or
delays rows, a magnetometer that free-runs beside it and may hand over means of two samples, an accelerometer behind a
slow low-pass that still holds the acceleration of the hand, iron near the magnetometer, and a board or a chip that sits
turned. Sizes are drawn around the measured ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Release
from discsim.effects.catalogue import Effect, effect, row
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import Plant, Recording, Samples
from discsim.sensors import Accelerometer, Gyroscope, Instruments, Magnetometer, Noise, Sampling
from discsim.shipped import load_disc
from discsim.validation.challenge.cases.case import Case, Concealed, Mask
from discsim.validation.challenge.cases.off_catalogue import log_uniform
from discsim.validation.scenarios.throws import Throw

__all__ = ["check_asked", "cut_in_flight", "like_real"]

#: rows a second of the logger's loop, and the shipped disc that carried it
_LOOP_HZ, _DISC = 100.0, "ultrastar"
#: by how much less a wobble of the real disc is damped than the rate derivatives of the shipped one say
#: (models/discs/ultrastar.toml)
_LESS_DAMPED = 13.0
#: throws of a case, m/s, deg/s, rad/s of wobble at release, and s recorded: those of the four measured throws
_THROWS, _SPEED, _SPIN, _WOBBLE, _RECORDED = 4, (13.0, 20.0), (3000.0, 3900.0), (2.5, 14.0), (2.6, 3.2)
#: rows that are cut off after the release
_CUT = 3
#: what a low-pass holds of the hand beyond what acts on the disc at release, m/s^2, across the axis and along it
_HAND, _HAND_ALONG = (20.0, 110.0), 4.0
#: share of steps that wrote no row; tick and share of rows that came late: measured are 18 to 24 % lost
_LOST, _TICK, _LATE = (0.15, 0.29), (1e-3, 5e-3), (0.2, 0.4)
#: periods of parts that free-run, s: measured 9.43 and 9.07 ms; nearer to the loop's 10 ms they are the loop
_MAG_PERIOD, _IMU_PERIOD = (8.8e-3, 9.7e-3), (8.8e-3, 9.6e-3)
#: time constant of the accelerometer's low-pass, s: measured 0.14
_LAG = (0.05, 0.3)
#: hard iron, uT: measured 29; soft iron as a share
_HARD, _SOFT = (5.0, 30.0), (0.01, 0.05)
#: how far one chip, or the whole board, is turned, rad: a chip is soldered by eye, a board glued anyhow
_CHIP, _BOARD = (0.02, 0.1), (0.05, 3.1)
#: how often what need not be there is: late rows in place of lost ones, means, a clock of gyroscope and
#: accelerometer's own, soft iron
_OFTEN_LATE, _OFTEN_MEAN, _OFTEN_CHIP, _OFTEN_SOFT = 0.25, 0.75, 0.5, 0.25


def check_asked(plant: Plant | None, effects: Sequence[str], mask: Mask | None) -> None:
    """Refuse what does not go with this kind of case; raises `InputError`."""
    if plant not in (None, "free_spin"):
        raise InputError(f"kind like_real: is a free spin; expected no plant {plant}")
    if effects:
        raise InputError("kind like_real: conceals what a real logger did, all together; expected no effect by name")
    if mask is not None:
        raise InputError(f"kind like_real: hides its effects in one another; expected no mask {mask} over them")


def like_real(seed: int, environment: Environment, rng: np.random.Generator) -> Case:
    """Return the case of a seed at a place: throws, the sensors' board, what a hand left, what is concealed."""
    disc, start = _disc(), float(rng.uniform(0.0, 360.0))
    instruments = _board(rng)
    return Case(
        seed,
        "free_spin",
        "like_real",
        environment,
        tuple(_throw(number, start, rng) for number in range(_THROWS)),
        instruments,
        instruments,
        concealed=tuple(Concealed(item) for item in _concealed(rng)),
        disc=disc,
        stated_disc=disc,
        longest=round(float(rng.uniform(*_RECORDED)), 2),
        hands=tuple(_hand(rng) for _ in range(_THROWS)),
    )


def _disc() -> Disc:
    disc, _ = load_disc(_DISC)
    assert disc.aero is not None
    calmer = disc.aero._replace(CMq=disc.aero.CMq / _LESS_DAMPED, CRp=disc.aero.CRp / _LESS_DAMPED)
    return replace(disc, aero=calmer)


def _throw(number: int, start: float, rng: np.random.Generator) -> Release:
    """Draw a throw; headings go round the compass, spins both ways, and all wobble as real ones do."""
    sense = -1.0 if number % 2 else 1.0
    throw = Throw(
        speed=rng.uniform(*_SPEED),
        heading_deg=start + 360.0 * number / _THROWS + rng.normal(0.0, 12.0),
        spin_deg_s=sense * rng.uniform(*_SPIN),
        elevation_deg=rng.uniform(8.0, 15.0),
        bank_deg=-sense * rng.uniform(4.0, 16.0),
        nose_deg=rng.uniform(3.0, 10.0),
        height=rng.uniform(1.2, 1.7),
    )
    release, towards = throw.release, rng.uniform(-np.pi, np.pi)
    assert release.body_rate is not None
    wobble = log_uniform(rng, *_WOBBLE) * np.array([np.cos(towards), np.sin(towards), 0.0])
    return replace(release, body_rate=release.body_rate + wobble)


def _board(rng: np.random.Generator) -> Instruments:
    """Draw the board: the parts of models/imports/flatball.toml, read in the steps of one loop."""
    loop = Sampling(_LOOP_HZ)
    place = np.round([0.0196 + rng.normal(0.0, 0.002), 0.0068 + rng.normal(0.0, 0.002), 0.0], 4)
    magnetometer, accelerometer, gyroscope = (
        Noise(round(float(rng.uniform(*span)), 4)) for span in ((0.05, 0.3), (0.03, 0.12), (0.002, 0.006))
    )
    return Instruments(
        {
            "magnetometer": Magnetometer(loop, noise=magnetometer, resolution=0.00305, range=800.0),
            "accelerometer": Accelerometer(
                loop, position=readonly(place), noise=accelerometer, resolution=0.004786, range=156.906
            ),
            "gyroscope": Gyroscope(loop, noise=gyroscope, resolution=0.0024435, range=69.813),
        }
    )


def _hand(rng: np.random.Generator) -> FloatArray:
    towards = rng.uniform(-np.pi, np.pi)
    pull = rng.uniform(*_HAND)
    return readonly([pull * np.cos(towards), pull * np.sin(towards), rng.normal(0.0, _HAND_ALONG)])


def cut_in_flight(recording: Recording) -> Recording:
    """Return a recording as it is cut out of a log: without its first rows, its written time beginning anew.

    They show samples from before the release, which a motion that begins there does not have.
    """
    samples = {name: Samples(own.t[:-_CUT], own.value[_CUT:]) for name, own in recording.samples.items()}
    return replace(recording, samples=samples)


# ---------------------------------------------------------------------------------------------- what is concealed


def _concealed(rng: np.random.Generator) -> list[Effect]:
    """Draw what the logger and its parts did, all of it at once."""
    late, mean, chip, soft = rng.random(4) < (_OFTEN_LATE, _OFTEN_MEAN, _OFTEN_CHIP, _OFTEN_SOFT)
    found = [
        _sized("clock.late_rows", rng.uniform(*_TICK), rng.uniform(*_LATE))
        if late
        else _sized("clock.lost_rows", rng.uniform(*_LOST)),
        _sized("mag.own_clock", rng.uniform(*_MAG_PERIOD)),
    ]
    if chip:
        found.append(_sized("imu.own_clock", rng.uniform(*_IMU_PERIOD)))
    if mean:
        found.append(_sized("mag.average", 0.5))
    found += [_sized("accel.lag", log_uniform(rng, *_LAG)), _sized("mag.hard_iron", *_somewhere(rng, 3, *_HARD))]
    if soft:
        found.append(_sized("mag.soft_iron", *_somewhere(rng, 6, *_SOFT)))
    turned = str(rng.choice(["board.rotation", "mag.mount", "gyro.mount"]))
    span = _BOARD if turned == "board.rotation" else _CHIP
    return [*found, _sized(turned, *_somewhere(rng, 3, *span))]


def _somewhere(rng: np.random.Generator, count: int, low: float, high: float) -> list[float]:
    """Draw a vector (count,) of any direction, its length log-uniform."""
    way = rng.standard_normal(count)
    return (log_uniform(rng, low, high) * way / np.linalg.norm(way)).tolist()  # type: ignore[no-any-return]


def _sized(id: str, *sizes: float) -> Effect:
    return effect(id, **{name: float(f"{size:.7g}") for name, size in zip(row(id).parameters, sizes, strict=True)})
