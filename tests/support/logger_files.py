"""Raw files as the loggers of the shipped maps write them, made from one simulated motion whose rate is known.

A body turns about its z axis, tilted and hardly wobbling, and slows down. Each logger's columns, units, axes and quirks
are written out here from the sources' own descriptions, not taken from the maps that are to be tested.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import attitude_matrix

G = 9.80665


@dataclass(frozen=True)
class Turning:
    """Spin about z_B (rad/s at the start, time constant s) of a body tilted by roll and pitch, in a field (NED, uT)."""

    rate: float
    decay: float
    duration: float
    field: tuple[float, float, float]
    roll: float = 0.15
    pitch: float = -0.1

    def r(self, t: FloatArray) -> FloatArray:
        return self.rate * np.exp(-t / self.decay)

    def turned(self, t: FloatArray, v: FloatArray) -> FloatArray:
        """Return a vector fixed in N in body axes at times t, (n, 3)."""
        x, y, z = attitude_matrix(self.roll, self.pitch, 0.4) @ v
        psi = self.rate * self.decay * (1 - np.exp(-t / self.decay))
        c, s = np.cos(psi), np.sin(psi)
        return np.stack([c * x + s * y, -s * x + c * y, z + 0 * t], axis=1)

    def magnetometer(self, t: FloatArray, rng: np.random.Generator, noise: float, iron: FloatArray) -> FloatArray:
        return self.turned(t, np.array(self.field)) + iron + rng.normal(0.0, noise, (t.size, 3))

    def gyroscope(self, t: FloatArray, rng: np.random.Generator, noise: float) -> FloatArray:
        return np.stack([0 * t, 0 * t, self.r(t)], axis=1) + rng.normal(0.0, noise, (t.size, 3))

    def accelerometer(
        self, t: FloatArray, rng: np.random.Generator, noise: float, place: tuple[float, float] = (0.0, 0.0)
    ) -> FloatArray:
        r, slope = self.r(t), -self.r(t) / self.decay
        centripetal = np.stack(
            [-(r**2) * place[0] - slope * place[1], -(r**2) * place[1] + slope * place[0], 0 * t], axis=1
        )
        return self.turned(t, np.array([0.0, 0.0, -G])) + centripetal + rng.normal(0.0, noise, (t.size, 3))


def _lines(path: Path, header: str, rows: list[str]) -> None:
    path.write_text("\n".join([*([header] if header else []), *rows, ""]), encoding="utf-8")


def _joined(*columns: FloatArray, form: str = ".6f") -> list[str]:
    table = np.column_stack(columns)
    return [",".join(f"{x:{form}}" for x in row) for row in table]


def _steps(value: FloatArray, step: float, limit: float = np.inf) -> FloatArray:
    return np.asarray(np.clip(np.rint(value / step) * step, -limit, limit))


def flatball(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """One file, no time: idx counts rows of 10 ms; g, deg/s, uT; the magnetometer turned by half a turn about z."""
    t = np.arange(0.0, motion.duration, 0.01)
    mag = motion.magnetometer(t, rng, 0.05, np.array([-15.6, 0.0, 25.0])) * [-1, -1, 1]
    acc = motion.accelerometer(t, rng, 0.02, (0.019575, 0.00675)) / G
    gyro = np.degrees(motion.gyroscope(t, rng, 0.002))
    header = "idx,batt-v,acc-x,acc-y,acc-z,gx,gy,gz,mag-x,mag-y,mag-z"
    rows = _joined(0 * t + 4.1, _steps(acc, 4.88e-4, 16.0), _steps(gyro, 0.14, 4000.0), _steps(mag, 0.003051))
    path = folder / "2025-08-31-009-rb.csv"
    _lines(path, header, [f"{k},{row}" for k, row in enumerate(rows)])
    return path


def cats(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """imu.csv of two IMUs in turn (g, deg/s) and magneto.csv (gauss, left-handed); the spin axis is the board's y."""
    t = np.arange(0.0, motion.duration, 0.01)
    imu = []
    for number in range(2):
        w = np.degrees(motion.gyroscope(t, rng, 0.003))[:, [1, 2, 0]]  # board x, y, z = body y, z, x
        f = motion.accelerometer(t, rng, 0.05)[:, [1, 2, 0]] / G
        table = _joined(_steps(w, 1 / 16.4, 2000.0), _steps(f, 1 / 1024, 32.0), form=".10f")
        imu.append([f"{time:.3f},IMU{number},{row}" for time, row in zip(t - 0.331, table, strict=True)])
    both = [row for pair in zip(*imu, strict=True) for row in pair]
    _lines(folder / "imu.csv", ",ts,id,Gx,Gy,Gz,Ax,Ay,Az", [f"{k},{row}" for k, row in enumerate(both)])
    m = motion.magnetometer(t, rng, 0.05, np.array([-34.0, 5.0, -15.0]))
    board = np.stack([m[:, 1], m[:, 2], -m[:, 0]], axis=1) / 100.0
    rows = [f"{time:.3f},{row}" for time, row in zip(t - 0.331, _joined(board, form=".10f"), strict=True)]
    _lines(folder / "magneto.csv", ",ts,mx,my,mz", [f"{k},{row}" for k, row in enumerate(rows)])
    return folder


def lynx(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """imu_compass.csv at 99 Hz, times from before lift-off; the spin axis is the board's x."""
    t = np.arange(0.0, motion.duration, 1 / 99.0) + rng.normal(0.0, 5e-5)
    m = motion.magnetometer(t, rng, 0.7, np.array([10.0, -20.0, 15.0]))[:, [2, 0, 1]]
    rows = [f"{time:.6f},{row}" for time, row in zip(t - 5.0, _joined(m, form=".7f"), strict=True)]
    _lines(folder / "imu_compass.csv", "time,mag_x,mag_y,mag_z", rows)
    return folder


def srp(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """One file per sensor, no header, counter,unix time,"[x, y, z]" in counts, comments between; z is up."""
    for name, rate_hz, make in (
        ("gyro", 25.0, lambda t: _steps(np.degrees(motion.gyroscope(t, rng, 0.003)), 0.035, 1146.845)),
        ("mag", 10.0, lambda t: np.rint(motion.magnetometer(t, rng, 0.4, np.array([190.0, -150.0, -31.0])) * 68.42)),
        ("acc", 10.0, lambda t: np.clip(np.rint(motion.accelerometer(t, rng, 0.05) / G / 0.000122), -32764, 32764)),
    ):
        t = np.arange(0.0, motion.duration, 1 / rate_hz)
        stamps = t + 1558681665.0 + rng.normal(0.0, 2e-4, t.size)
        rows = [
            f'{9000 + k},{time:.6f},"[{x:.10g}, {-y:.10g}, {-z:.10g}]"'
            for k, (time, (x, y, z)) in enumerate(zip(stamps, make(t), strict=True))
        ]
        rows.insert(20, "# autosave took 0.036823")
        _lines(folder / f"24-05-19_08-47-27_{name}_last90s.csv", "", rows)
    return folder


def broad(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """One file at 285.7 Hz from the middle of a trial, SI units, with the optical attitude behind."""
    t = np.arange(0.0, motion.duration, 0.0035)
    rows = _joined(
        t + 46.9315,
        motion.gyroscope(t, rng, 0.01),
        motion.accelerometer(t, rng, 0.05),
        motion.magnetometer(t, rng, 0.5, np.array([3.0, -2.0, 5.0])),
        np.zeros((t.size, 4)),
        form=".5f",
    )
    names = ["gyr_{}_rad_s", "acc_{}_m_s2", "mag_{}_uT"]
    header = ",".join(name.format(axis) for name in names for axis in "xyz")
    path = folder / "07_undisturbed.csv"
    _lines(path, f"t_s,{header},opt_qw,opt_qx,opt_qy,opt_qz", rows)
    return path


def phyphox(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """A folder with a file per sensor, quoted headers, numbers like 1.004E-2, no newline at the end, odd rates."""
    for name, rate_hz, column, make in (
        ("Gyroscope", 99.6, "Gyroscope {} (rad/s)", lambda t: motion.gyroscope(t, rng, 0.005)),
        ("Accelerometer", 100.3, "Acceleration {} (m/s^2)", lambda t: motion.accelerometer(t, rng, 0.05)),
        (
            "Magnetometer",
            99.1,
            "Magnetic field {} (µT)",
            lambda t: motion.magnetometer(t, rng, 0.6, np.array([30.0, 12.0, -20.0])),
        ),
    ):
        t = np.arange(0.0, motion.duration, 1 / rate_hz)
        header = ",".join(f'"{title}"' for title in ("Time (s)", *(column.format(axis) for axis in "xyz")))
        text = "\n".join([header, *_joined(t, make(t), form=".9E")])
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
    return folder


def csv(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """All sensors in one file, named as in a recording; the gyroscope stops at 2000 deg/s, five decimals."""
    t = np.arange(0.0, motion.duration, 0.01)
    gyro = np.clip(_steps(motion.gyroscope(t, rng, 0.003), np.radians(1 / 16.4)), -34.90659, 34.90659)
    rows = _joined(
        t + 12.0,
        motion.magnetometer(t, rng, 0.6, np.array([12.0, 5.0, -9.0])),
        motion.accelerometer(t, rng, 0.08, (-0.0161, 0.0)),
        gyro,
        form=".5f",
    )
    path = folder / "flight.csv"
    _lines(path, "time_s,x_uT,y_uT,z_uT,x_m_s2,y_m_s2,z_m_s2,x_rad_s,y_rad_s,z_rad_s", rows)
    return path


def shotshaper(folder: Path, motion: Turning, rng: np.random.Generator) -> Path:
    """A drone's plan view of a throw, t x y v in blanks and tabs, a line before the header; nothing shows the spin."""
    t = np.arange(0.0, motion.duration, 1 / 30.0)
    x, y = 60.0 * (1 - np.exp(-t / 3.0)), 0.5 * t**2
    rows = [f"{a:.3f}\t{b:.3f}\t {c:.5f} {0.0}" for a, b, c in zip(t + 0.4, x, y, strict=True)]
    path = folder / "throw1.tsv"
    _lines(path, "mass_A\nt\tx\ty\tv", rows)
    return path


@dataclass(frozen=True)
class Made:
    """A logger: what writes its raw files, the motion it was on, and the methods that tell its rate, with the sign.

    ``signed`` is what the map makes of a spin about +z of `Turning`; ``field`` arguments for the commands where the map
    states none.
    """

    write: Callable[[Path, Turning, np.random.Generator], Path]
    motion: Turning
    methods: tuple[str, ...]
    place: tuple[str, str] | None = None


#: World Magnetic Model at Ponte de Sor, October 2021; in Berlin, August 2025
PONTE_DE_SOR, BERLIN = (26.4, -0.8, 35.4), (18.6, 1.6, 46.4)

#: by the shipped map's name
LOGGERS: dict[str, Made] = {
    "flatball": Made(
        flatball,
        Turning(40.0, 20.0, 5.0, (19.2, 0.0, 50.3)),
        ("fusion", "gyroscope", "tracking", "likelihood", "fft", "accelerometer_calibrated", "accelerometer"),
    ),
    "cats": Made(cats, Turning(11.0, 40.0, 6.0, PONTE_DE_SOR), ("fusion", "gyroscope", "tracking", "likelihood")),
    "cats_imu1": Made(cats, Turning(11.0, 40.0, 6.0, PONTE_DE_SOR), ("fusion", "gyroscope", "tracking", "likelihood")),
    "lynx": Made(lynx, Turning(15.0, 40.0, 6.0, PONTE_DE_SOR), ("fusion", "tracking", "likelihood", "fft")),
    "srp": Made(srp, Turning(6.0, 60.0, 20.0, (23.4, 0.0, 41.3)), ("fusion", "gyroscope", "tracking", "likelihood")),
    "broad": Made(
        broad, Turning(12.0, 30.0, 5.0, (16.4, 0.1, 42.0)), ("fusion", "gyroscope", "tracking", "likelihood")
    ),
    "phyphox": Made(
        phyphox,
        Turning(18.0, 15.0, 5.0, BERLIN),
        ("fusion", "gyroscope", "tracking", "likelihood", "fft"),
        ("52.52,13.40", "2025-08-31"),
    ),
    "csv": Made(
        csv,
        Turning(60.0, 18.0, 5.0, BERLIN),
        ("fusion", "tracking", "likelihood", "fft"),
        ("52.52,13.40", "2025-08-31"),
    ),
    "shotshaper": Made(shotshaper, Turning(138.0, 20.0, 3.0, (0.0, 0.0, 0.0)), ()),
}
