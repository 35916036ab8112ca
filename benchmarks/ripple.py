"""Whether the diagnosis names a rate table's speed ripple beside the errors of a whole module.

Run: ``python benchmarks/ripple.py [--orders 1 2 3 4 5 6] [--amplitudes 0.05 0.3 1.2] [--seed 1] [--sheet]``. One run a
case: plateaus of 1000 to 5000 deg/s from rest, as `discsim rate-table` makes it, the module a specimen drawn within its
data sheets (errors of five kinds beside the ripple) or, with ``--sheet``, as its sheets say. For each case it prints
verdict, processor time, what is named, and the errors of amplitude (rad/s) and phase (rad); the last line counts.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.effects import effect
from discsim.environment import Environment
from discsim.rig import default_profile
from discsim.sensors import Instruments
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.scenarios.rate_table import Bench, run_rate_table

ID = "rig.speed_ripple"
PROFILE = default_profile((0, 1000, 2000, 3000, 4000, 5000), hold=4.0)


def explained(order: float, amplitude: float, seed: int, *, sheet: bool) -> bool:
    """Hide a ripple (amplitude rad/s), diagnose the run, print what was said, and tell whether it was right."""
    rng = np.random.default_rng(seed)
    phase = float(rng.uniform(-np.pi, np.pi))
    bench = Bench(stated=Instruments.from_parts("ac1120s", "mpu9250")) if sheet else Bench()
    hidden = effect(ID, order=order, amplitude_rad_s=amplitude, phase_rad=phase)
    run = run_rate_table(PROFILE, Environment(), rng, bench=bench, effects=(hidden,))
    begun = time.process_time()
    found = diagnose([[run.recording]], ["bench"]).diagnosis
    named = {one.id: one.parameters for one in found.effects}
    off = ""
    if ID in named:
        value = {name: item.value for name, item in named[ID].items()}
        turned = (value["phase_rad"] - phase + np.pi) % (2.0 * np.pi) - np.pi
        off = f", off by {value['amplitude_rad_s'] - amplitude:+.1e} rad/s and {turned:+.1e} rad"
    print(
        f"order {order:g}, {amplitude:g} rad/s: {found.verdict}, {time.process_time() - begun:.0f} s: "
        f"{', '.join(named) or 'nothing'}{off}",
        flush=True,
    )
    return found.verdict == "explained" and ID in named


def main() -> None:
    """Run every order with every amplitude."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--orders", type=float, nargs="+", default=[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    parser.add_argument("--amplitudes", type=float, nargs="+", default=[0.05, 0.3, 1.2], help="rad/s")
    parser.add_argument("--seed", type=int, default=1, help="of the first case; the next have the next ones")
    parser.add_argument("--sheet", action="store_true", help="a module as its data sheets say")
    given = parser.parse_args()
    cases = [(order, amplitude) for order in given.orders for amplitude in given.amplitudes]
    right = [explained(*case, given.seed + number, sheet=given.sheet) for number, case in enumerate(cases)]
    print(f"{sum(right)} of {len(right)} explained by their ripple and errors of sensors")


if __name__ == "__main__":
    main()
