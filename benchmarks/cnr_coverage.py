"""How far a fitted C_Nr is from the truth, and how often it is inside two of its own standard deviations.

    python benchmarks/cnr_coverage.py --sets 200 --throws 2

Each data set has a C_Nr, a specimen of the paper's module and throws of its own, all drawn from the seed. The truth is
the standalone model's flight (it agrees with MuJoCo to a millimetre: docs/trajectory.md) seen by the sensors of
`discsim.sensors`; the fit sees the recordings only, and a C_Nr stated in them that is wrong.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

# the matrices are small: threads of the linear algebra library would only wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.stats import beta

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.sensors import Instruments, record
from discsim.shipped import load_disc
from discsim.trajectory import predict
from discsim.validation.scenarios.throws import Throw
from discsim.validation.yaw_damping import fit_yaw_damping, observe

#: C_Nr of a data set is even between these; the recordings state the driver's -0.0045
LEAST, MOST = -0.0060, -0.0030


def draw_throw(rng: np.random.Generator) -> Throw:
    """Draw a throw as hands make them: any heading, either spin."""
    side = rng.choice([-1.0, 1.0])
    return Throw(
        speed=rng.uniform(18.0, 26.0),
        heading_deg=rng.uniform(0.0, 360.0),
        spin_deg_s=side * rng.uniform(3000.0, 5500.0),
        elevation_deg=rng.uniform(6.0, 14.0),
        bank_deg=side * rng.uniform(-18.0, 0.0),
        nose_deg=rng.uniform(3.0, 9.0),
    )


def one_set(seed: Sequence[int], throws: int, method: str) -> tuple[float, float, float, float, float]:
    """Simulate and fit one data set; return true C_Nr, fitted value, its sd, scales of spin and path."""
    rng = np.random.default_rng(list(seed))
    stated, environment = load_disc("driver")
    assert stated.aero is not None
    truth = rng.uniform(LEAST, MOST)
    disc = replace(stated, aero=stated.aero._replace(CNr=truth))
    module = Instruments.from_parts("mpu9250", "neo_m8n").drawn(rng)
    observed = []
    for number in range(throws):
        motion = predict(disc, environment, draw_throw(rng).release).motion()
        recording = record(motion, module, rng, plant="flight", name=f"{number:02d}", disc=stated)
        observed.append(observe(recording, method))
    fit = fit_yaw_damping(observed)
    return truth, fit.CNr, fit.sd, fit.spin_scale, fit.path_scale


def main() -> None:
    """Simulate, fit, print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--throws", type=int, default=2)
    parser.add_argument("--method", default="best")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--processes", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--lines", type=Path, help="write every set's figures there, and go on from those it has")
    options = parser.parse_args()

    rows = []
    if options.lines is not None and options.lines.exists():
        rows = [json.loads(line) for line in options.lines.read_text(encoding="utf-8").splitlines()][: options.sets]
    with ProcessPoolExecutor(options.processes) as pool:
        jobs = [
            pool.submit(one_set, (options.seed, number), options.throws, options.method)
            for number in range(len(rows), options.sets)
        ]
        for job in jobs:
            rows.append(job.result())
            if options.lines is not None:
                with options.lines.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(rows[-1]) + "\n")
            if len(rows) % 20 == 0:
                print(f"{len(rows)}/{options.sets}", flush=True)
    truth, value, sd, spin_scale, path_scale = np.array(rows).T
    z, relative = (value - truth) / sd, 100 * (value / truth - 1)
    inside, n = int(np.sum(np.abs(z) <= 2)), len(rows)
    low, high = (beta.ppf(q, a, b) for q, a, b in ((0.025, inside, n - inside + 1), (0.975, inside + 1, n - inside)))
    high = 1.0 if inside == n else high
    print(
        f"{n} data sets of {options.throws} throws, {options.method}: inside 2 sd {inside} ({100 * inside / n:.1f} %, "
        f"95 % interval {100 * low:.1f} to {100 * high:.1f} %)"
    )
    rms, largest = np.sqrt(np.mean(relative**2)), np.abs(relative).max()
    print(f"error: rms {rms:.3f} %, largest {largest:.3f} %, mean {relative.mean():+.3f} %")
    print(f"sd: median {np.median(100 * sd / np.abs(truth)):.3f} %; rms of error over sd {np.sqrt(np.mean(z**2)):.2f}")
    print(f"raised by (median): spin {np.median(spin_scale):.2f}, path {np.median(path_scale):.2f}")


if __name__ == "__main__":
    main()
