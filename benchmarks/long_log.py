"""CPU seconds and memory of `discsim estimate --method all` and `discsim check` on long logs at 1 kHz.

    python benchmarks/long_log.py [--minutes 1 10 60] [--keep FOLDER]

A body spins between 5 and 60 rad/s, its axis precesses slowly; magnetometer, accelerometer and gyroscope are read at
1 kHz with an MPU-9250's noise. Each command runs in a process of its own; what is printed is all that it uses, of one
core, start-up included. The code is compiled before, on a log of ten seconds.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from discsim.arrays import FloatArray  # noqa: E402
from discsim.recording import SENSORS  # noqa: E402

SLOWEST, FASTEST = 5.0, 60.0  # rad/s
PERIOD = 47.0  # s, of the spin's rise and fall: no whole number of them is a segment
PRECESSION = 0.05  # rad/s, of the axis about north
FIELD, GRAVITY = np.array([20.0, 1.0, 44.0]), np.array([0.0, 0.0, -9.81])  # in N; what an accelerometer reads
HARD_IRON = np.array([12.0, -7.0, 5.0])
ARM = 0.02  # m, of the accelerometer along -x
NOISE = {"magnetometer": 0.6, "accelerometer": 0.08, "gyroscope": 0.003}
TOML = """format = "discsim-recording/1"
plant = "free_spin"
name = "long-log"

[environment]
gravity_m_s2 = 9.81
air_density_kg_m3 = 1.2
magnetic_field_ned_uT = [20.0, 1.0, 44.0]

[sensors]

[sensors.magnetometer]
rate_hz = 1000.0
noise_rms_uT = 0.6
range_uT = 4912.0

[sensors.accelerometer]
rate_hz = 1000.0
noise_rms_m_s2 = 0.08
range_m_s2 = 156.9
position_m = [-0.02, 0.0, 0.0]

[sensors.gyroscope]
rate_hz = 1000.0
noise_rms_rad_s = 0.003
range_rad_s = 69.8
"""


def spin_rate(t: FloatArray) -> FloatArray:
    """Return the true rate, rad/s."""
    middle, swing = 0.5 * (FASTEST + SLOWEST), 0.5 * (FASTEST - SLOWEST)
    return middle + swing * np.sin(2 * np.pi * t / PERIOD)


def readings(t: FloatArray) -> dict[str, FloatArray]:
    """Return what noiseless sensors show at times t (n,): (n, 3) each, uT, m/s^2 and rad/s in B."""
    middle, swing = 0.5 * (FASTEST + SLOWEST), 0.5 * (FASTEST - SLOWEST)
    turn = 2 * np.pi / PERIOD
    psi, rate = middle * t - swing / turn * (np.cos(turn * t) - 1), spin_rate(t)
    slope = swing * turn * np.cos(turn * t)

    def in_body(vector: FloatArray) -> FloatArray:
        # first about north by the precession, then about z by the spin
        c, s = np.cos(PRECESSION * t), np.sin(PRECESSION * t)
        x, y, z = vector[0], c * vector[1] + s * vector[2], -s * vector[1] + c * vector[2]
        return np.stack([np.cos(psi) * x + np.sin(psi) * y, -np.sin(psi) * x + np.cos(psi) * y, z], axis=1)

    p, q = PRECESSION * np.cos(psi), -PRECESSION * np.sin(psi)
    force = in_body(GRAVITY) + ARM * np.stack([q**2 + rate**2, -slope - p * q, -2 * p * rate], axis=1)
    return {
        "magnetometer": in_body(FIELD) + HARD_IRON,
        "accelerometer": force,
        "gyroscope": np.stack([p, q, rate], axis=1),
    }


def write_log(folder: Path, seconds: float, seed: int = 0) -> None:
    """Write the log as a recording, ten seconds at a time."""
    rng = np.random.default_rng(seed)
    folder.mkdir(parents=True, exist_ok=True)
    streams = {sensor: (folder / f"{sensor}.csv").open("w") for sensor in NOISE}
    for sensor, stream in streams.items():
        stream.write(f"{SENSORS[sensor].header}\n")
    for start in range(0, round(1000 * seconds), 10_000):
        t = np.arange(start, min(start + 10_000, round(1000 * seconds))) / 1000
        for sensor, value in readings(t).items():
            table = np.column_stack([t, value + rng.normal(0.0, NOISE[sensor], value.shape)])
            streams[sensor].writelines("%.3f,%.4f,%.4f,%.4f\n" % tuple(row) for row in table.tolist())  # noqa: UP031
    for stream in streams.values():
        stream.close()
    (folder / "recording.toml").write_text(TOML)


def used(arguments: Sequence[str]) -> tuple[float, float]:
    """Run the command and return its CPU seconds and its largest memory, MB."""
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); from validation.cli import main; main()"
    process = subprocess.Popen([sys.executable, "-c", code, str(ROOT), *arguments], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"discsim {' '.join(arguments)}: status {status}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def error(rates: Path) -> str:
    """Return each method's share of known values and its error over sd, rms, by its rate.csv."""
    squares: dict[str, list[float]] = {}
    with rates.open() as stream:
        next(stream)
        for line in stream:
            t, method, rate, sd = line.rstrip("\n").split(",")
            row = squares.setdefault(method, [0.0, 0.0, 0.0])
            row[0] += 1
            if rate:
                truth = float(spin_rate(np.array(float(t))))
                row[1] += 1
                row[2] += ((abs(float(rate)) - truth) / float(sd)) ** 2
    return "; ".join(
        f"{method} {100 * known / count:.0f} %, {(total / max(known, 1)) ** 0.5:.2f} sd"
        for method, (count, known, total) in squares.items()
    )


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description="CPU seconds and memory of estimate and check on long logs.")
    parser.add_argument("--minutes", type=float, nargs="+", default=[1.0, 10.0, 60.0], help="lengths of the logs")
    parser.add_argument("--keep", type=Path, help="folder for the logs, which stay there and are not made anew")
    parser.add_argument("--errors", action="store_true", help="compare each rate.csv with the truth")
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}")
    with tempfile.TemporaryDirectory() as scratch:
        place = options.keep or Path(scratch)
        for minutes in (1 / 6, *options.minutes):
            log = place / f"{60 * minutes:.0f}-s"
            if not (log / "recording.toml").exists():
                write_log(log, 60 * minutes)
            out = place / f"{log.name}-rate"
            start = time.perf_counter()
            checked, _ = used(["check", str(log)])
            spent, memory = used(["estimate", str(log), "--method", "all", "--out", str(out)])
            if minutes == 1 / 6:
                continue  # it compiled
            print(
                f"{minutes:4.0f} min, {60 * minutes:.0f} 000 rows of each sensor: check {checked:6.1f} s of CPU;"
                f" estimate --method all {spent:6.1f} s, {memory:5.0f} MB;"
                f" {time.perf_counter() - start:.0f} s by the clock",
                flush=True,
            )
            if options.errors:
                print(f"  known, and rms of error over sd: {error(out / 'rate.csv')}", flush=True)


if __name__ == "__main__":
    main()
