"""Error of every spin-rate method over the Cramer-Rao bound, and on whole throws: one page by one command.

    python benchmarks/estimators.py [--quick] [--seed 0] [--write]

``--write`` puts tables and figures into docs/estimator-accuracy.md and docs/images. A full run takes about ten minutes
on two cores, ``--quick`` one. Data come from closed-form motion (tests/support/spinning_sensor.py), not from MuJoCo.
"""

from __future__ import annotations

import argparse
import itertools
import os
import platform
import sys
import time
from collections.abc import Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

# the matrices are small: threads of the linear algebra library would only wait for each other
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy
import scipy.fft

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from support.spinning_sensor import Spin, record, without  # noqa: E402

from discsim.estimators.fft_fast import padded_peak  # noqa: E402
from discsim.estimators.streaming import StreamingRate  # noqa: E402
from discsim.files import write_text  # noqa: E402
from discsim.validation.reporting import markdown  # noqa: E402
from discsim.validation.reporting.run import package_version  # noqa: E402

# isort: split
from estimator_throws import Flown, draw_throws, fly, pooled, throws_table  # noqa: E402
from estimator_windows import (  # noqa: E402
    CASES,
    DECIBELS,
    EVERYTHING,
    RATES,
    SETTINGS,
    WINDOWS,
    Cell,
    Kind,
    bias,
    draw_windows,
    honesty_table,
    over_bound,
    window_cell,
    windows_tables,
)

PAGE = ROOT / "docs" / "estimator-accuracy.md"
IMAGES = ROOT / "docs" / "images"


def cost_table() -> list[str]:
    """Return the lines of the table of costs, by the thread's processor time: other work on the cores is none of it."""
    rng = np.random.default_rng(5)
    spin = without(Spin(duration=8.0), precession=False)
    recording, _ = record(spin, rng, sensors=("magnetometer",), plant="spin_down")
    samples = recording.need("magnetometer")
    lines = ["| what | processor time |", "|---|---|"]
    for _ in range(2):  # the first round compiles
        live = StreamingRate(100.0, fixed_axis=True)
        spent = []
        for t, field in zip(samples.t, samples.value, strict=True):
            start = time.thread_time()
            live.update(t, field)
            spent.append(time.thread_time() - start)
    lines.append(
        f"| streaming, 128 samples in the window, latency {live.latency:.2f} s | median {1e6 * np.median(spent):.0f}"
        f" us per sample, 99 % below {1e6 * np.percentile(spent, 99):.0f} us |"
    )
    x = 12 + 30 * np.cos(rng.uniform(0.1, 1.4, (2048, 1)) * np.arange(128)) + rng.normal(0, 0.6, (2048, 128))
    first, last = np.full(2048, 228), np.full(2048, 8192)
    fast, padded = [], []
    for _ in range(7):
        start = time.thread_time()
        order, _ = padded_peak(x, 2**14, first, last)
        fast.append(time.thread_time() - start)
        start = time.thread_time()
        expected = np.empty(2048, dtype=int)
        for i in range(0, 2048, 256):
            spectrum = scipy.fft.rfft(x[i : i + 256], 2**14, axis=1)
            power = spectrum.real**2 + spectrum.imag**2
            expected[i : i + 256] = 228 + np.argmax(power[:, 228:], axis=1)
        padded.append(time.thread_time() - start)
    if not np.array_equal(order, expected):
        raise AssertionError("the fast search and the padded transform differ")
    quick, slow = 1e6 * min(fast) / 2048, 1e6 * min(padded) / 2048
    lines.append(f"| padded transform of (P-4), 2^14 points, and its peak | {slow:.0f} us per window |")
    lines.append(
        f"| the same peak by `discsim.estimators.fft_fast` | {quick:.1f} us per window, {slow / quick:.1f} times less |"
    )
    return lines


def goals_table(cells: Sequence[Cell], throws: Sequence[dict[str, Flown]]) -> list[str]:
    """Return the lines of the table of goals and what was found."""
    own = [cell for cell in cells if cell.kind.case == EVERYTHING]
    ratio = over_bound(own, "best")
    rows: dict[tuple[float, float], list[Cell]] = {}
    for cell in own:
        rows.setdefault((cell.kind.window, cell.kind.decibels), []).append(cell)
    found = {key: over_bound(row, "best") for key, row in rows.items()}
    runs = own[0].bounds.size
    # an rms of n normal errors scatters by 1/sqrt(2 n)
    above = {key: value for key, value in found.items() if value > 1.1 * (1 + 2 / np.sqrt(2 * runs * len(rows[key])))}
    listed = "; ".join(f"{value:.2f} at {window:g} s, {level:g} dB" for (window, level), value in above.items())
    all_runs = bias(own, "best")
    offsets = {key: bias(row, "best") for key, row in rows.items() if np.isfinite(found[key])}
    beyond = {key: one for key, one in offsets.items() if abs(one.mean) - 3 * one.error > 0.1}
    sure = {key: one for key, one in offsets.items() if one.error < 0.05}
    largest = "no row knows its own to 0.05"
    if sure:
        most = max(abs(one.mean) for one in sure.values())
        largest = f"largest {most:.3f} of the {len(sure)} rows that know it to 0.05"
    flown, paper = pooled(throws, "best (fusion)"), pooled(throws, "fft (paper)")
    means = [float(np.mean(throw["best (fusion)"].errors)) for throw in throws]
    scatter = float(np.std(means, ddof=1) / np.sqrt(len(means)))

    def verdict(met: bool) -> str:
        return "met" if met else "**missed**"

    return [
        "| goal, everything on | found | |",
        "|---|---|---|",
        f"| best: error at most 1.1 times the bound | {ratio:.2f} over all windows; rows surely above 1.1:"
        f" {listed or 'none'} | {verdict(ratio <= 1.1 and not above)} |",
        f"| best: bias at most 0.1 deg/s | {all_runs.mean:+.3f} +- {all_runs.error:.3f} over all windows;"
        f" {largest}; rows surely beyond 0.1: {len(beyond)} of"
        f" {len(offsets)} | {verdict(abs(all_runs.mean) <= 0.1 and not beyond)} |",
        f"| throws, best: rms of r at most 0.5 deg/s | {flown.rms:.2f} (median throw {np.median(flown.each):.2f};"
        f" {100 * np.mean(flown.each <= 0.5):.0f} % of the throws) | {verdict(flown.rms <= 0.5)} |",
        f"| throws, the paper's method, to compare | {paper.rms:.2f} (median throw {np.nanmedian(paper.each):.2f}) | |",
        f"| throws, best: bias at most 0.1 deg/s | {flown.bias:+.3f} +- {scatter:.3f} |"
        f" {verdict(abs(flown.bias) <= 0.1)} |",
    ]


def page(
    cells: Sequence[Cell], throws: Sequence[dict[str, Flown]], cost: list[str], command: str, seconds: float
) -> str:
    """Return the page."""
    return markdown.page_text(
        Path(__file__).with_name("estimator-accuracy.md.j2"),
        command=command,
        version=package_version(),
        numpy=np.__version__,
        scipy=scipy.__version__,
        python=platform.python_version(),
        minutes=seconds / 60,
        settings=SETTINGS,
        runs=cells[0].bounds.size,
        scatter=100 / np.sqrt(2 * cells[0].bounds.size),
        rates=", ".join(f"{rate:g}" for rate in sorted({cell.kind.rate for cell in cells})),
        count=len(throws),
        goals=goals_table(cells, throws),
        throws=throws_table(throws),
        honesty=honesty_table(cells),
        windows=windows_tables(cells),
        cost=cost,
    )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description="Error of every spin-rate method over the Cramer-Rao bound.")
    parser.add_argument("--quick", action="store_true", help="fewer runs, two windows, two cases, twelve throws")
    parser.add_argument("--runs", type=int, help="windows in a cell; default 10, with --quick 8")
    parser.add_argument("--throws", type=int, help="whole throws; default 40, with --quick 12")
    parser.add_argument("--jobs", type=int, help="processes; default one for each core")
    parser.add_argument("--seed", type=int, default=0, help="of all that is drawn")
    parser.add_argument("--write", action="store_true", help="write docs/estimator-accuracy.md and its figures")
    options = parser.parse_args()
    command = " ".join(["python benchmarks/estimators.py", *sys.argv[1:]])
    command += "" if any(word.startswith("--seed") for word in sys.argv[1:]) else f" --seed {options.seed}"
    start = time.perf_counter()
    if options.quick:
        combinations = itertools.product(("steady", EVERYTHING), (0.5, 1.0), (20.0, 40.0), RATES)
    else:
        combinations = itertools.product(CASES, WINDOWS, DECIBELS, RATES)
    runs, count = options.runs or (8 if options.quick else 10), options.throws or (12 if options.quick else 40)
    kinds = [Kind(window, level, rate, case) for case, window, level, rate in combinations]
    cost = cost_table()  # alone, before the cores are busy
    with ProcessPoolExecutor(options.jobs) as pool:
        # the longest first, so that no core is idle at the end
        order = sorted(range(len(kinds)), key=lambda i: -kinds[i].window)
        waiting: dict[Future[Any], tuple[str, int]] = {
            pool.submit(window_cell, kinds[i], runs, options.seed): ("window", i) for i in order
        }
        waiting |= {pool.submit(fly, number, options.seed): ("throw", number) for number in range(count)}
        cells: dict[int, Cell] = {}
        throws: dict[int, dict[str, Flown]] = {}
        for done, future in enumerate(as_completed(waiting), 1):
            what, number = waiting[future]
            if what == "window":
                cells[number] = future.result()
            else:
                throws[number] = future.result()
            if done % 10 == 0 or done == len(waiting):
                spent = time.perf_counter() - start
                print(f"{done} of {len(waiting)} parts, {spent:.0f} s", file=sys.stderr, flush=True)
    all_cells = [cells[i] for i in range(len(kinds))]
    all_throws = [throws[i] for i in range(count)]
    text = page(all_cells, all_throws, cost, command, time.perf_counter() - start)
    if options.write:
        IMAGES.mkdir(exist_ok=True)
        draw_windows(all_cells, IMAGES / "estimator-accuracy-windows.png")
        draw_throws(all_throws, IMAGES / "estimator-accuracy-throws.png")
        write_text(PAGE, text)
        print(f"wrote {PAGE.relative_to(ROOT)}", file=sys.stderr)
    else:
        print(text)


if __name__ == "__main__":
    main()
