"""CPU seconds and memory of the commands on long logs at 1 kHz, and on data sets of many throws.

    python benchmarks/long_log.py [--minutes 1 3 10] [--throws 10 50 200] [--commands estimate check] [--keep FOLDER]

A body spins between 5 and 60 rad/s, its axis precesses slowly; magnetometer, accelerometer and gyroscope are read at
1 kHz with an MPU-9250's noise. The throws are one flight of three seconds, each with noise of its own. Each command
runs in a process of its own; what is printed is all that it uses of all cores, start-up included, and what a minute,
or a throw, more costs: the same at every size where time is linear. The code is compiled before, on the shortest log.
An hour is `--minutes 60`.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

import discsim as ds  # noqa: E402
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
            streams[sensor].write(("%.3f,%.4f,%.4f,%.4f\n" * len(table)) % tuple(table.ravel().tolist()))
    for stream in streams.values():
        stream.close()
    (folder / "recording.toml").write_text(TOML)


class Used(NamedTuple):
    """What a command used: CPU seconds of all cores, seconds by the clock, and its largest memory, MB."""

    cpu: float
    clock: float
    memory: float


def used(arguments: Sequence[str]) -> Used:
    """Run the command and return what it used."""
    code = "import sys; sys.path.insert(0, sys.argv.pop(1)); from discsim.validation.cli import main; main()"
    start = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-c", code, str(ROOT), *arguments], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"discsim {' '.join(arguments)}: status {status}")
    return Used(usage.ru_utime + usage.ru_stime, time.perf_counter() - start, usage.ru_maxrss / 1e3)


def write_raw(file: Path, seconds: float, seed: int = 0) -> None:
    """Write the log as a logger would, in one table: ms, uT, m/s^2 and deg/s."""
    rng = np.random.default_rng(seed)
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("w") as stream:
        stream.write(
            "time_ms,mag_x_uT,mag_y_uT,mag_z_uT,acc_x_m_s2,acc_y_m_s2,acc_z_m_s2,gyr_x_dps,gyr_y_dps,gyr_z_dps\n"
        )
        for start in range(0, round(1000 * seconds), 10_000):
            rows = np.arange(start, min(start + 10_000, round(1000 * seconds)))
            columns = [
                value + rng.normal(0.0, NOISE[sensor], value.shape) for sensor, value in readings(rows / 1000).items()
            ]
            columns[2] = np.degrees(columns[2])
            table = np.column_stack([rows, *columns])
            stream.write((("%d" + 9 * ",%.4f" + "\n") * len(table)) % tuple(table.ravel().tolist()))


def write_throws(folder: Path, count: int) -> None:
    """Write a data set of one throw, recorded so many times."""
    disc, environment = ds.load_disc("driver")
    motion = ds.predict(disc, environment, ds.load_throw("driver"), duration=3.0).motion()
    board = ds.Instruments.from_parts("mpu9250", "neo_m8n")
    for number in range(count):
        rng = np.random.default_rng(number)
        throw = ds.record(motion, board, rng, plant="flight", name=f"throw-{number:03d}", disc=disc)
        ds.write_recording(throw, folder / f"{number:03d}")


#: command -> its arguments, given the log's folder (its raw file) and a folder to write to
COMMANDS: dict[str, Callable[[Path, Path], list[str]]] = {
    "estimate": lambda log, out: ["estimate", str(log), "--out", str(out)],
    "estimate all": lambda log, out: ["estimate", str(log), "--method", "all", "--out", str(out)],
    "check": lambda log, out: ["check", str(log)],
    "diagnose": lambda log, out: ["diagnose", str(log), "--out", str(out)],
    "import": lambda log, out: ["import", str(log.with_suffix(".csv")), "--out", str(out)],
}


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


def measure(name: str, sizes: Sequence[tuple[float, Path]], unit: str, *, errors: bool = False) -> None:
    """Run a command on inputs of growing sizes and print what each used, and what a unit more costs."""
    before: tuple[float, Used] | None = None
    for size, log in sizes:
        out = log.parent / f"{log.name}-{name.replace(' ', '-')}"
        shutil.rmtree(out, ignore_errors=True)
        found = used(COMMANDS[name](log, out))
        grown = ""
        if before is not None:
            more = size - before[0]
            grown = (
                f"; {(found.cpu - before[1].cpu) / more:.2f} s and {(found.memory - before[1].memory) / more:.1f} MB"
            )
            grown += f" a {unit} more"
        print(
            f"{name:12s} {size:5g} {unit}s: {found.cpu:6.1f} s of CPU, {found.memory:5.0f} MB, {found.clock:.0f} s by "
            f"the clock{grown}",
            flush=True,
        )
        before = size, found
        if errors and (out / "rate.csv").exists():
            print(f"  known, and rms of error over sd: {error(out / 'rate.csv')}", flush=True)


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description="CPU seconds and memory of the commands on long and many logs.")
    parser.add_argument("--minutes", type=float, nargs="*", default=[1.0, 3.0, 10.0], help="lengths of the logs")
    parser.add_argument("--throws", type=int, nargs="*", default=[10, 50, 200], help="sizes of the data sets")
    parser.add_argument("--commands", nargs="+", choices=COMMANDS, default=list(COMMANDS), help="what is run")
    parser.add_argument("--keep", type=Path, help="folder for the logs, which stay there and are not made anew")
    parser.add_argument("--errors", action="store_true", help="compare each rate.csv with the truth")
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    print(f"{platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}, numpy {np.__version__}")
    with tempfile.TemporaryDirectory() as scratch:
        place = options.keep or Path(scratch)
        logs = {minutes: place / f"{60 * minutes:.0f}-s" for minutes in (1 / 6, *options.minutes)}
        for minutes, log in logs.items():
            if not (log / "recording.toml").exists():
                write_log(log, 60 * minutes)
            if "import" in options.commands and not log.with_suffix(".csv").exists():
                write_raw(log.with_suffix(".csv"), 60 * minutes)
        for name in options.commands if options.minutes else ():
            used(COMMANDS[name](logs[1 / 6], place / "first"))  # it compiles
            measure(name, [(minutes, logs[minutes]) for minutes in options.minutes], "minute", errors=options.errors)
        sets = {count: place / f"{count}-throws" for count in options.throws}
        for count, folder in sets.items():
            if not folder.exists():
                write_throws(folder, count)
        for name in ("estimate", "check", "diagnose") if sets else ():
            if name in options.commands:
                used(COMMANDS[name](sets[min(sets)], place / "first"))  # it compiles
                measure(name, list(sets.items()), "throw")


if __name__ == "__main__":
    main()
