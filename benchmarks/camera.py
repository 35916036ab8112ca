"""Whether the diagnosis finds a track's camera: three made throws a set, with one thing hidden in each kind of set.

Run: ``python benchmarks/camera.py [SETS [KIND ...]]``. Throws are flown in MuJoCo's full spinning body and seen by a
tracker with noise of 0.1 to 0.5 m beside an ordinary module. For each set it prints what is named, and for a camera by
how many standard deviations its numbers are off; the last lines are counts.
"""

from __future__ import annotations

import os
import sys
import time
from collections import Counter
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.effects import Effect, effect
from discsim.engine import fly
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


def made(kind: str, seed: int) -> tuple[list[Recording], tuple[Effect, ...]]:
    """Return three throws with one thing hidden."""
    rng = np.random.default_rng((KINDS.index(kind), seed))
    effects, noise = hidden(kind, rng), float(rng.uniform(0.1, 0.5))
    motion = [one for one in effects if one.row.acts_on == "motion"]
    ordinary = Instruments.from_parts("mpu9250")
    sensors = {**ordinary.sensors, "track": Tracker(Sampling(30.0), Noise(noise))}
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
        throws.append(record(flight, module, own, plant="flight", name=f"throw-{k}", disc=DISC))
    return throws, effects


def main(sets: int, kinds: list[str]) -> None:
    """Diagnose so many sets of each kind, and print what is named."""
    counts: Counter[str] = Counter()
    for kind in kinds:
        for seed in range(sets):
            recordings, effects = made(kind, seed)
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
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4, sys.argv[2:] or list(KINDS))
