"""How often held readings are found, and chance repeats taken for them: made logs of many rates, resolutions, motions.

    python benchmarks/held_rows.py [--logs 1000] [--seed 0]

Each log is that of a sensor with three axes (a field, or a specific force) on a body that spins at 0 to 7000 deg/s, at
rest for none to nine tenths of the time, with noise of 0.05 to 20 steps of resolution. Sound logs have a reading a row;
held ones stand by a sensor of 5 to 95 % of the log's rate, whose clock runs by itself. Rows come evenly, or stutter.
Prints one table: what share of logs is called held, and how far the rate found is from the true one.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from discsim.arrays import FloatArray
from discsim.validation.rows.held import find_held


def motion(t: FloatArray, rest: float, rng: np.random.Generator) -> FloatArray:
    """Return a vector (n, 3) of length 50 that spins about a tilted, nutating axis, and rests for a while."""
    rate = np.radians(rng.choice([0.0, 30.0, 400.0, 2000.0, 7000.0])) * rng.uniform(0.7, 1.3)
    start = rng.uniform(0, 1 - rest) * t[-1]
    going = (t < start) | (t > start + rest * t[-1])
    phase = np.cumsum(np.where(going, rate, 0.0) * np.diff(t, prepend=t[0]))
    tilt = rng.uniform(0.2, 1.3) + 0.1 * np.sin(0.9 * phase)
    if rng.random() < 0.15:  # no motion that a resolution shows: a slow wander, as of a temperature
        return np.cumsum(rng.standard_normal((t.size, 3)), axis=0) * np.sqrt(np.diff(t, prepend=t[0]))[:, None]
    return 50 * np.stack([np.sin(tilt) * np.cos(phase), -np.sin(tilt) * np.sin(phase), np.cos(tilt)], axis=1)


def log(held: bool, seconds: float, rng: np.random.Generator) -> tuple[FloatArray, float, bool]:
    """Return the readings (n, 3) that a logger wrote, the rows per reading, and whether noise moves each reading."""
    rate = rng.choice([50.0, 104.0, 250.0, 500.0])
    stutter = rng.choice([0.0, 0.0, 0.02, 0.2])
    t = np.cumsum(np.maximum(1 + stutter * rng.standard_normal(int(seconds * rate)), 0.05)) / rate
    rest = rng.choice([0.0, 0.0, 0.3, 0.9])
    ratio = 1 / rng.uniform(0.05, 0.95) if held else 1.0
    sampled = t if not held else (np.arange(t.size / ratio + 2) + rng.uniform(-1, 0)) * ratio / rate
    true = motion(sampled - min(sampled[0], 0.0), rest, rng)
    step = 10 ** rng.uniform(-2.5, 0.5)
    noise = step * 10 ** rng.uniform(np.log10(0.05), np.log10(20))
    # a board that is carried shakes in bursts
    shaking = 1 + 3 * (rng.random(sampled.size) < 0.1) if rng.random() < 0.3 else np.ones(sampled.size)
    read = step * np.round((true + noise * shaking[:, None] * rng.standard_normal(true.shape)) / step)
    if not held:
        return read, 1.0, noise > step
    return read[np.searchsorted(sampled, t, side="right") - 1], ratio, bool(noise > step)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    print("seconds  sound logs called held  held logs found: all  noise above a step  error of the rate: median  95 %")
    for seconds in (0.6, 3.0, 12.0, 60.0):
        rng = np.random.default_rng(given.seed)
        false = sum(find_held(log(False, seconds, rng)[0]) is not None for _ in range(given.logs))
        errors, hits = [], []
        for _ in range(given.logs):
            value, ratio, noisy = log(True, seconds, rng)
            found = find_held(value)
            hits += [found is not None] if noisy else []
            if found is not None:
                errors.append(abs(found.rows_per_reading / ratio - 1))
        share = 100 * len(errors) / given.logs
        print(
            f"{seconds:7.1f}  {false:6d} of {given.logs:4d}          {share:14.1f} %  {100 * np.mean(hits):14.1f} %  "
            f"{100 * np.median(errors):17.2f} %  {100 * np.quantile(errors, 0.95):10.2f} %"
        )


if __name__ == "__main__":
    main()
