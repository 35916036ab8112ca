"""Cost of the paper's transform, of the method `fft`, and of the streaming estimator, measured in one run.

    python benchmarks/cost.py [--quick]

Times are of the thread's own processor time, so that other work on the machine counts little: the least of several
repetitions for the transforms, which are alike, and percentiles for the stream. Ratios are of times of the same run.
Exit status 1 if `fft` and the padded transforms differ in any window.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path

# one thread, as a logger has it
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import scipy.fft
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from discsim.arrays import FloatArray  # noqa: E402
from discsim.estimators.fft import FftSettings, fft  # noqa: E402
from discsim.estimators.fft_fast import padded_peak  # noqa: E402
from discsim.estimators.streaming import StreamingRate  # noqa: E402
from discsim.recording import Samples  # noqa: E402


def spin(seconds: float, seed: int = 0) -> Samples:
    """Return a magnetometer at 100 Hz on a spin between 1000 and 6000 deg/s that changes by 50 deg/s^2."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(100 * seconds)) / 100
    rate = np.radians(3500 + 2500 * np.sin(2 * np.pi * t / 314))
    phase = np.cumsum(rate) / 100
    field = np.stack([12 + 30 * np.cos(phase), -7 - 30 * np.sin(phase), np.full(t.size, 39.0)], axis=1)
    return Samples(t, field + rng.normal(0, 0.6, field.shape))


def least(work: Callable[[], object], repetitions: int) -> float:
    """Return the least time of some repetitions, s."""
    spent = []
    for _ in range(repetitions):
        start = time.thread_time()
        work()
        spent.append(time.thread_time() - start)
    return min(spent)


def whole_transforms(x: FloatArray, total: int, first: int) -> NDArray[np.int64]:
    """Return the orders of the peaks by (P-2) to (P-5) as written, 256 windows at once."""
    orders = np.empty(len(x), dtype=np.int64)
    for start in range(0, len(x), 256):
        spectrum = scipy.fft.rfft(x[start : start + 256], total, axis=1)
        power = spectrum.real**2 + spectrum.imag**2
        orders[start : start + 256] = first + np.argmax(power[:, first:], axis=1)
    return orders


def transforms(repetitions: int) -> bool:
    """Print what the transforms cost; return whether the fast search found the same peaks."""
    samples, total = spin(120.0), 2**14
    block = sliding_window_view(samples.value[:, :2], 128, axis=0)
    axis = np.argmax(np.var(block, axis=2), axis=1)
    x = np.ascontiguousarray(block[np.arange(axis.size), axis])
    count = len(x)
    first = int(np.ceil(np.radians(500.0) * total * 0.01 / (2 * np.pi)))
    low, high = np.full(count, first), np.full(count, total // 2)
    expected = whole_transforms(x, total, first)
    order, _ = padded_peak(x, total, low, high)
    rate = fft(samples).rate
    same = bool(np.array_equal(order, expected))
    grid = np.rint(rate * total * samples.interval / (2 * np.pi))
    same &= bool(np.all(grid[np.isfinite(rate)] == expected[np.isfinite(rate)]))

    whole = least(lambda: whole_transforms(x, total, first), repetitions) / count
    fast = least(lambda: padded_peak(x, total, low, high), repetitions) / count
    method = least(lambda: fft(samples), repetitions) / count
    print(f"padded transform (2^14) and its peak  {1e6 * whole:7.1f} us per window")
    print(f"the same peak by `fft_fast`            {1e6 * fast:7.1f} us per window, {whole / fast:.1f} times less")
    print(
        f"method fft, all of it                 {1e6 * method:7.1f} us per window, {whole / method:.1f} times less"
        " (peak, noise and leakage tests, standard deviation)"
    )
    print(f"same orders in all {count} windows: {'yes' if same else 'NO'}; known {np.isfinite(rate).mean():.1%}")
    return same


def hour(seconds: float) -> None:
    """Print time and memory of `fft` over a long recording, window by window."""
    samples = spin(seconds)
    start = time.thread_time()
    found = fft(samples)
    spent = time.thread_time() - start
    tracemalloc.start()
    fft(samples, FftSettings(step=7))  # fewer windows: tracing costs time, memory is that of the samples
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    print(
        f"{seconds / 60:.0f} min at 100 Hz, every window      {spent:7.1f} s for {len(found)} windows; beside"
        f" the samples ({samples.value.nbytes / 1e6:.1f} MB) {peak / 1e6:.1f} MB of memory at step 7"
    )


def streaming(seconds: float) -> None:
    """Print what a sample costs the streaming estimator, alone and with a gyroscope at 200 Hz."""
    samples = spin(seconds)
    wobble = np.radians(8.0) * np.exp(-1j * np.radians(3500.0) * np.arange(0, seconds, 0.005))
    for gyroscope in (False, True):
        for _ in range(2):  # the first round compiles
            live = StreamingRate(100.0, strength=50.0 if gyroscope else None, fixed_axis=not gyroscope)
            spent, known = [], 0
            for k, (t, field) in enumerate(zip(samples.t, samples.value, strict=True)):
                start = time.thread_time()
                if gyroscope:
                    for j in (2 * k - 1, 2 * k):
                        if j >= 0:
                            live.update_gyroscope(0.005 * j, np.array([wobble[j].real, wobble[j].imag, 0.0]))
                answer = live.update(t, field)
                spent.append(time.thread_time() - start)
                known += bool(np.isfinite(answer.rate))
        used = 1e6 * np.array(spent[200:])
        name = "stream with gyroscope at 200 Hz" if gyroscope else "stream, magnetometer alone"
        print(
            f"{name:38s}{np.median(used):7.0f} us per sample (99 %: {np.percentile(used, 99):.0f}, largest"
            f" {used.max():.0f}); latency {live.latency:.3f} s; {live.held_bytes / 1e3:.0f} kB held; known"
            f" {known / len(samples):.0%} of {len(samples)} samples"
        )


def main() -> int:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description="Cost of the padded transform, of the method fft and of streaming.")
    parser.add_argument("--quick", action="store_true", help="two minutes of data for the long recording, not an hour")
    options = parser.parse_args()
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}")
    fft(spin(2.0))  # compiled before anything is timed
    same = transforms(3 if options.quick else 9)
    hour(120.0 if options.quick else 3600.0)
    streaming(20.0 if options.quick else 60.0)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
