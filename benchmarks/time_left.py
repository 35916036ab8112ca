"""Whether the time that a diagnosis says it still takes comes true: seven drawn cases, timed in CPU seconds.

Usage: ``python benchmarks/time_left.py [CASE ...]`` with cases as ``flight/403`` or ``flight/407/air.wind/mag.lag``

A line for each case: the seconds it took, and what was told at a quarter, half and three quarters of it over what was
then left. Between 0.5 and 2 it came true within a factor of two.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from time import process_time

# in place of this folder, whose estimators.py would stand for the package
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from discsim.validation.challenge.cases.conceal import recordings  # noqa: E402
from discsim.validation.challenge.cases.draw import draw_case  # noqa: E402
from discsim.validation.diagnosis.pipeline import diagnose  # noqa: E402
from discsim.validation.reporting.time_left import TimeLeft  # noqa: E402

CASES = (
    "spin_down/405/rig.coulomb_friction",
    "spin_down/412",
    "rate_table/404",
    "rate_table/408",
    "flight/403",
    "flight/409",
    "flight/410/gps.latency",
)
PARTS = (0.25, 0.5, 0.75)


def told(plant: str, events: list[tuple[float, str, int, int]], whole: float) -> list[float | None]:
    """Return what was told at each of `PARTS` over what was left; None before anything was."""
    found: list[float | None] = []
    for part in PARTS:
        clock = iter([0.0, *(at for at, *_ in events)])
        left, last = TimeLeft(table=plant == "rate_table", now=clock.__next__), None
        for at, stage, done, total in events:
            if at > part * whole:
                break
            seconds = left(stage, done, total)
            last = None if seconds is None else (at, seconds)
        # what was told counts down until the next report
        found.append(None if last is None else max(last[0] + last[1] - part * whole, 0.0) / (whole * (1.0 - part)))
    return found


def main() -> None:
    """Diagnose the cases and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", default=CASES)
    for case in parser.parse_args().cases:
        plant, seed, *ids = case.split("/")
        drawn = draw_case(int(seed), plant, ids)
        runs, started = recordings(drawn), process_time()
        events: list[tuple[float, str, int, int]] = []

        def report(stage: str, done: int, total: int, events=events, started=started) -> None:  # type: ignore[no-untyped-def]
            events.append((process_time() - started, stage, done, total))

        diagnose([runs], ["case"], progress=report)
        whole = process_time() - started
        shares = ", ".join("nothing" if share is None else f"{share:.2f}" for share in told(plant, events, whole))
        print(f"{case}: {whole:.0f} s; told over left at a quarter, half, three quarters: {shares}", flush=True)


if __name__ == "__main__":
    main()
