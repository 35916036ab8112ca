"""Whether the diagnosis finds a track's camera: three made throws a set, with one thing hidden in each kind of set.

Run: ``python benchmarks/camera.py [--alone] [SETS [KIND ...]]``. Throws are flown in MuJoCo's full spinning body and
seen by a tracker with noise of 0.1 to 0.5 m beside an ordinary module; with ``--alone`` in plan by a tracker alone,
with noise of 0.02 to 0.2 m, each release stated with the errors of high-speed cameras. For each set it prints what is
named, and for a camera by how many standard deviations its numbers are off; the last lines are counts.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import ArrayLike

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.arrays import FloatArray
from discsim.disc import Release
from discsim.effects import Effect, effect
from discsim.engine import fly
from discsim.frames import euler_angles, quaternion_from_matrix
from discsim.launch import Launch, released
from discsim.recording import Recording
from discsim.sensors import Instruments, Noise, Sampling, Tracker, record
from discsim.shipped import load_disc
from discsim.validation.diagnosis.pipeline import diagnose

DISC, FIELD = load_disc("driver")
KINDS = ("camera", "nothing", "wind", "lift")


def hidden(kind: str, rng: np.random.Generator) -> tuple[Effect, ...]:
    """Draw what is hidden in a kind of set: a camera 30 to 120 m high, a wind, another lift, or nothing."""
    if kind == "camera":
        height = float(np.exp(rng.uniform(np.log(30.0), np.log(120.0))))
        north, east = (float(x) for x in rng.uniform(-40.0, 40.0, 2))
        return (effect("track.camera", height_m=height, north_m=north, east_m=east),)
    if kind == "wind":
        north, east = (float(x) for x in rng.uniform(-2.0, 2.0, 2))
        return (effect("air.wind", w_north_m_s=north, w_east_m_s=east),)
    return (effect("aero.spin_lift", CLr=float(rng.uniform(0.02, 0.1))),) if kind == "lift" else ()


#: errors of a release that is read off high-speed cameras, one sigma
READ_OFF = {
    "position_ned_m": np.array([0.3, 0.3, 0.2]),
    "velocity_ned_m_s": np.full(3, 0.6),
    "roll_rad": np.radians(4.0),
    "pitch_rad": np.radians(2.0),
    "body_rate_rad_s": np.array([2.0, 2.0, 0.5]),
}


def in_plan(recording: Recording, release: Release, rng: np.random.Generator) -> Recording:
    """Return a throw of which nothing is known but its track in plan and its release, read off with errors."""
    position, velocity, C_NB, rate = release.start()
    roll, pitch, _ = (float(angle[0]) for angle in euler_angles(quaternion_from_matrix(C_NB)[None]))

    def read_off(key: str, true: ArrayLike) -> FloatArray:
        return np.asarray(true) + np.asarray(READ_OFF[key]) * rng.standard_normal(np.shape(true))

    stated = Release(
        position=read_off("position_ned_m", position),
        velocity=read_off("velocity_ned_m_s", velocity),
        roll=float(read_off("roll_rad", roll)),
        pitch=float(read_off("pitch_rad", pitch)),
        yaw=None,
        body_rate=read_off("body_rate_rad_s", rate),
        sigma=READ_OFF,
    )
    track = recording.need("track")
    plan = np.column_stack((track.value[:, :2], np.full(len(track), np.nan)))
    return replace(recording, release=stated, samples={"track": replace(track, value=plan)})


def made(kind: str, seed: int, alone: bool) -> tuple[list[Recording], tuple[Effect, ...]]:
    """Return three throws with one thing hidden."""
    rng = np.random.default_rng((KINDS.index(kind), seed))
    effects, noise = hidden(kind, rng), float(rng.uniform(0.02, 0.2) if alone else rng.uniform(0.1, 0.5))
    motion = [one for one in effects if one.row.acts_on == "motion"]
    ordinary = {} if alone else Instruments.from_parts("mpu9250").sensors
    sensors = {**ordinary, "track": Tracker(Sampling(30.0), Noise(noise))}
    module = Instruments(sensors).with_effects([one for one in effects if one.row.acts_on != "motion"])
    throws = []
    for k in range(3):
        thrown = Launch(
            speed=float(rng.uniform(18.0, 24.0)),
            launch=float(np.radians(rng.uniform(4.0, 14.0))),
            heading=float(rng.uniform(-0.6, 0.6)),
            hyzer=float(np.radians(rng.uniform(-5.0, 15.0))),
            nose=float(np.radians(rng.uniform(-3.0, 3.0))),
            spin=float(rng.uniform(56.0, 77.0)),
            height=1.3,
        )
        release = released(thrown)
        flight = fly(DISC, FIELD, release, motion, duration=4.0)
        own = np.random.default_rng((seed, k))
        throw = record(flight, module, own, plant="flight", name=f"throw-{k}", disc=DISC)
        throws.append(in_plan(throw, release, rng) if alone else throw)
    return throws, effects


def main(sets: int, kinds: list[str], alone: bool) -> None:
    """Diagnose so many sets of each kind, and print what is named."""
    counts: Counter[str] = Counter()
    for kind in kinds:
        for seed in range(sets):
            recordings, effects = made(kind, seed, alone)
            before = time.process_time()
            answer = diagnose([recordings], ["set"], seed=0).diagnosis
            named = [one.id for one in answer.effects]
            right = sorted(named) == sorted(one.id for one in effects)
            counts[f"{kind}: {'right' if right else 'wrong'}"] += 1
            off = [
                f"{name} {(item.value - effects[0].sizes[name]) / item.sd:+.1f} sd"
                for one in answer.effects
                if right
                for name, item in one.parameters.items()
                if item.sd
            ]
            cpu = time.process_time() - before
            print(kind, seed, [one.sizes for one in effects], answer.verdict, named, *off, f"{cpu:.0f} s", flush=True)
    for said, count in sorted(counts.items()):
        print(f"{said}: {count}")


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--alone"]
    main(int(words[0]) if words else 4, words[1:] or list(KINDS), "--alone" in sys.argv)
