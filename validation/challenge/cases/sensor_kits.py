"""The sensors on board of a case: parts, rates, ranges and noise as drawn from its seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import readonly
from discsim.effects.catalogue import CATALOGUE
from discsim.recording import Plant
from discsim.sensors import (
    Accelerometer,
    Gps,
    Gyroscope,
    Instruments,
    Magnetometer,
    Noise,
    RateReference,
    Sampling,
    Tracker,
)
from discsim.sensors.instruments import Sensor
from discsim.validation.challenge.cases.case import Case

__all__ = ["module", "sensors_wanted", "with_sensors"]


def sensors_wanted(effects: Sequence[str]) -> set[str]:
    """Return the sensors that effects act on, or off-catalogue physics by name."""
    acting = {CATALOGUE[id].acts_on for id in effects if id in CATALOGUE}
    if "rotating_magnet" in effects:
        acting.add("magnetometer")
    return acting - {"motion", "clock", "board"}


def with_sensors(case: Case, wanted: set[str], rng: np.random.Generator) -> Case:
    """Put sensors on board; all of ``wanted`` are there."""
    sensors = module(case.plant, rng)
    for name in sorted(_missing(case.plant, rng) - wanted):
        sensors.pop(name, None)
    if "track" not in wanted and case.plant == "flight" and "gps" in sensors and rng.random() < 0.8:
        sensors.pop("track")
    instruments = Instruments(sensors)
    return replace(case, instruments=instruments, sheets_of=instruments)


def _missing(plant: Plant, rng: np.random.Generator) -> set[str]:
    """Draw which sensors are not there: none in two thirds."""
    if rng.random() < 2 / 3:
        return set()
    if plant == "flight":
        choices = [{"gps"}, {"gyroscope"}, {"accelerometer"}, {"magnetometer"}]
        return choices[int(rng.choice(4, p=[0.35, 0.35, 0.15, 0.15]))]
    if plant == "free_spin":
        return set()
    choices = [{"gyroscope"}, {"rate_reference"}, {"magnetometer"}, {"accelerometer"}]
    return choices[int(rng.integers(4))]


def module(plant: Plant, rng: np.random.Generator) -> dict[str, Sensor]:
    """Draw every sensor that a plant can have."""
    fast = float(rng.choice([200.0, 200.0, 100.0, 400.0 if plant in ("flight", "free_spin") else 250.0]))
    wide = 104.72 if rng.random() < (0.8 if plant == "free_spin" else 0.25) else 34.9066
    position = [-0.0161, 0.0, 0.0]
    if rng.random() < 0.4:
        position = np.round(rng.uniform([-0.0175, -0.004, -0.002], [-0.009, 0.004, 0.002]), 4).tolist()
    module: dict[str, Sensor] = {
        "magnetometer": Magnetometer(
            Sampling(float(rng.choice([100.0, 100.0, 100.0, 80.0, 50.0]))),
            noise=Noise(round(float(rng.uniform(0.3, 0.9)), 2)),
            resolution=float(rng.choice([0.15, 0.15, 0.6])),
            range=4912.0,
        ),
        "accelerometer": Accelerometer(
            Sampling(fast),
            position=readonly(position),
            noise=Noise(round(float(rng.uniform(0.03, 0.12)), 3)),
            resolution=0.0047884,
            range=156.9064,
        ),
        "gyroscope": Gyroscope(
            Sampling(fast), noise=Noise(round(float(rng.uniform(0.002, 0.006)), 4)), resolution=0.0010653, range=wide
        ),
    }
    if plant == "flight":
        module["gps"] = Gps(
            Sampling(float(rng.choice([10.0, 10.0, 5.0, 18.0]))),
            position_noise=Noise(round(float(rng.uniform(0.08, 0.3)), 2)),
            velocity_noise=Noise(round(float(rng.uniform(0.04, 0.1)), 3)),
        )
        module["track"] = Tracker(
            Sampling(float(rng.choice([30.0, 60.0]))),
            Noise(round(float(rng.uniform(0.02, 0.08)), 3)),
            unseen=float(rng.choice([0.0, 0.05])),
        )
    if plant in ("rate_table", "spin_down"):
        module["rate_reference"] = RateReference(Sampling(100.0), noise=Noise(0.0006))
    return module
