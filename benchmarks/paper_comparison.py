"""The paper's comparison of magnetometer and accelerometer, repeated with what each can know.

    python benchmarks/paper_comparison.py [--throws N] [--write]

``--write`` puts the table between the marks in docs/estimators.md. The throws are those of benchmarks/estimators.py:
closed-form motion with precession and nutation, an MPU-9250's noise, rounding and clipping; hard and soft iron, bias
and gyroscope scale drawn per throw. Only the mount error is set here: 0, 1 or 5 mm in a drawn direction of the plane,
and `accelerometer` is told how large it may be.
"""

from __future__ import annotations

import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests"), str(ROOT / "benchmarks")]

from estimator_throws import random_throw  # noqa: E402
from support.spinning_sensor import move, record  # noqa: E402

from discsim.estimators import AccelerometerErrors, Options, YawRate, estimate  # noqa: E402
from discsim.recording import Recording  # noqa: E402

#: Installation errors, m.
MOUNTS = (0.0, 0.001, 0.005)
MARKS = ("<!-- comparison: benchmarks/paper_comparison.py -->", "<!-- end of comparison -->")

# name, sensors it is given, method, mount error of the table's row
ROWS: tuple[tuple[str, tuple[str, ...], str, float], ...] = (
    ("`fft`, as published", ("magnetometer",), "fft", 0.001),
    *((f"`accelerometer`, {1000 * mount:g} mm off", ("accelerometer",), "accelerometer", mount) for mount in MOUNTS),
    (
        "`accelerometer_calibrated` by the magnetometer, 5 mm off",
        ("magnetometer", "accelerometer"),
        "accelerometer_calibrated",
        0.005,
    ),
    (
        "`accelerometer_calibrated`, gyroscope for precession, 1 mm off",
        ("magnetometer", "accelerometer", "gyroscope"),
        "accelerometer_calibrated",
        0.001,
    ),
    (
        "`accelerometer_calibrated`, gyroscope for precession, 5 mm off",
        ("magnetometer", "accelerometer", "gyroscope"),
        "accelerometer_calibrated",
        0.005,
    ),
    ("`best`, magnetometer alone", ("magnetometer",), "best", 0.001),
    ("`best`, all sensors, 1 mm off", ("magnetometer", "accelerometer", "gyroscope"), "best", 0.001),
    ("`best`, all sensors, 5 mm off", ("magnetometer", "accelerometer", "gyroscope"), "best", 0.005),
)


def only(recording: Recording, sensors: tuple[str, ...]) -> Recording:
    """Return a recording with some of its sensors."""
    return Recording(
        recording.plant,
        recording.name,
        recording.environment,
        sheets={name: recording.sheets[name] for name in sensors},
        samples={name: recording.samples[name] for name in sensors},
    )


def table(throws: int) -> list[str]:
    """Return the lines of the table."""
    rng = np.random.default_rng(12)
    errors: list[list[np.ndarray]] = [[] for _ in ROWS]
    scaled: list[list[np.ndarray]] = [[] for _ in ROWS]
    shares: list[list[float]] = [[] for _ in ROWS]
    for number in range(throws):
        spin, faults = random_throw(rng)
        truth, direction, seed = move(spin), rng.uniform(0, 2 * np.pi), int(rng.integers(2**31))
        recordings = {}
        for mount in MOUNTS:
            off = replace(faults, mount_error=(mount * np.cos(direction), mount * np.sin(direction)))
            recordings[mount] = record(spin, np.random.default_rng(seed), off, truth=truth)[0]
        for row, (_, sensors, method, mount) in enumerate(ROWS):
            told = Options(accelerometer=AccelerometerErrors(mount=mount))
            found: YawRate = estimate(only(recordings[mount], sensors), method, told)
            r = truth.r(found.t)
            error = found.rate - (r if found.signed else np.abs(r))
            known = np.isfinite(error)
            errors[row].append(np.degrees(error[known]))
            scaled[row].append(error[known] / found.sd[known])
            shares[row].append(float(np.mean(known)))
        print(f"{number + 1} of {throws}", file=sys.stderr, flush=True)
    lines = [
        f"{throws} throws of 3 to 8 s at 2500 to 6500 deg/s, errors in deg/s over all instants answered:",
        "",
        "| method | rms | median throw's mean error, size | error over stated sd, rms | answered |",
        "|---|---|---|---|---|",
    ]
    for row, (name, *_) in enumerate(ROWS):
        everything, normal = np.concatenate(errors[row]), np.concatenate(scaled[row])
        means = [abs(float(np.mean(each))) for each in errors[row] if each.size]
        lines.append(
            f"| {name} | {np.sqrt(np.mean(everything**2)):.2f} | {np.median(means):.2f} |"
            f" {np.sqrt(np.mean(normal**2)):.2f} | {100 * np.mean(shares[row]):.0f} % |"
        )
    return lines


def main() -> None:
    """Run the comparison."""
    parser = argparse.ArgumentParser(description="The paper's comparison of magnetometer and accelerometer, repeated.")
    parser.add_argument("--throws", type=int, default=40)
    parser.add_argument("--write", action="store_true", help="put the table into docs/estimators.md")
    options = parser.parse_args()
    text = "\n".join(table(options.throws))
    print(text)
    if options.write:
        page = ROOT / "docs" / "estimators.md"
        before, rest = page.read_text(encoding="utf-8").split(MARKS[0])
        after = rest.split(MARKS[1])[1]
        page.write_text(f"{before}{MARKS[0]}\n{text}\n{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
