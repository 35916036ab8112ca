"""Made logs of strangers: one motion (rest, a throw, rest again) that tests write in many shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

G0 = 9.80665
DEG = np.pi / 180
FIELD = np.array([19.2, 1.1, 45.0])  # uT, North-East-Down
RATE = 200.0
RELEASE, LANDING = 4.0, 7.0
SPIN = 40.0  # rad/s at release, clockwise seen from above


@dataclass(frozen=True)
class Log:
    """Time (n,) s and readings (n, 3) in body axes, z down: rad/s, m/s^2, uT."""

    t: np.ndarray
    gyro: np.ndarray
    accel: np.ndarray
    mag: np.ndarray

    def shown(self, up: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the readings on a board whose z points up (x forward, y left), or down as they are."""
        sign = np.array([1.0, -1.0, -1.0]) if up else np.ones(3)
        return self.gyro * sign, self.accel * sign, self.mag * sign


def rates(t: float) -> np.ndarray:
    """Return the body rates: handled about all axes, spun up in 0.1 s, decaying in flight with a wobble, caught."""
    handled = np.exp(-(((t - 2.2) / 0.5) ** 2)) * np.array([1.9, -2.3, 1.4]) * np.sin(9.0 * (t - 2.2))
    if t < RELEASE - 0.1 or t > LANDING + 0.05:
        return handled
    if t < RELEASE:
        return np.array([0.0, 0.0, SPIN * (t - RELEASE + 0.1) / 0.1])
    if t > LANDING:
        return np.array([0.0, 0.0, SPIN * np.exp(-0.15 * 3.0) * (LANDING + 0.05 - t) / 0.05])
    r = SPIN * np.exp(-0.15 * (t - RELEASE))
    wobble = 1.2 * np.exp(-(t - RELEASE))
    return np.array([wobble * np.cos(0.92 * SPIN * t), wobble * np.sin(0.92 * SPIN * t), r])


@cache
def made_log() -> Log:
    """Return ten seconds of it at 200 Hz with the noise of ordinary parts."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 10.0, 1 / RATE)
    attitude, fine = np.eye(3), 8
    gyro, accel, mag = (np.empty((t.size, 3)) for _ in range(3))
    down = np.array([0.0, 0.0, G0])
    for k, time in enumerate(t):
        w = rates(time)
        flying = RELEASE <= time <= LANDING
        # in flight lift carries 0.9 of the weight, along -z of the disc
        force = np.array([0.0, 0.0, -0.9 * G0]) if flying else -attitude @ down
        arm = np.array([-0.0161, 0.0, 0.0])
        accel[k] = force + np.cross(w, np.cross(w, arm))
        if LANDING < time < LANDING + 0.03:
            accel[k] += [60.0, 40.0, -90.0]
        gyro[k], mag[k] = w, attitude @ FIELD
        for part in range(fine):
            turn = rates(time + (part + 0.5) / RATE / fine) / RATE / fine
            angle = np.linalg.norm(turn)
            x, y, z = turn / max(angle, 1e-15)
            cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            attitude = (np.eye(3) - np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross) @ attitude
    gyro += 0.003 * rng.standard_normal(gyro.shape)
    accel += 0.03 * rng.standard_normal(accel.shape)
    mag += 0.3 * rng.standard_normal(mag.shape)
    return Log(t, gyro, accel, mag)


def write_table(
    path: Path,
    columns: Sequence[tuple[str, Sequence[object] | np.ndarray]],
    *,
    separator: str = ",",
    decimal: str = ".",
    encoding: str = "utf-8",
    before: str = "",
    header: bool = True,
    digits: int = 6,
    mark: str = "",
) -> Path:
    """Write columns as a table of text; ``before`` stands above the header, ``mark`` between thousands."""

    def cell(value: object) -> str:
        if isinstance(value, str):
            return value
        text = (
            f"{value:{mark and ','}.{digits}f}"
            if not isinstance(value, int | np.integer)
            else f"{value:{mark and ','}}"
        )
        return text.replace(",", "\0").replace(".", decimal).replace("\0", mark)

    lines = [separator.join(name for name, _ in columns)] if header else []
    lines += [separator.join(map(cell, row)) for row in zip(*(values for _, values in columns), strict=True)]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((before + "\n".join(lines) + "\n").encode(encoding))
    return path


def three(names: Sequence[str], value: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """Return three named columns."""
    return [(name, value[:, k]) for k, name in enumerate(names)]
