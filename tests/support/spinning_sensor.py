"""Recordings of a spinning symmetric body with known truth, independent of the simulator.

Rates are closed forms of time: spin-down, a slowly changing precession in the frame that does not spin, and a nutation
at r Izz/Ixx in that frame that dies out. The attitude integrates them by rotation vectors at the middle of
steps of 0.25 ms; halving the step changes the field by less than 1e-4 uT.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.environment import Environment
from discsim.recording import Recording, Samples, SensorSheet

MPU9250 = {
    "magnetometer": SensorSheet(100.0, 0.6, 0.15, 4912.0),
    "accelerometer": SensorSheet(200.0, 0.08, 0.0047884, 156.9064, position=np.array([-0.0161, 0.0, 0.0])),
    "gyroscope": SensorSheet(200.0, 0.003, 0.0010653, 34.9066),
}


@dataclass(frozen=True)
class Spin:
    """Motion: rates in deg/s and seconds, angles in deg; the field in NED, uT."""

    rate: float = 4200.0
    decay: float = 18.0  # s, time constant of the spin
    decay_change: float = 0.15  # relative, over 5 s
    duration: float = 5.0
    precession: tuple[float, float] = (8.0, -5.0)
    precession_change: tuple[float, float] = (-2.0, 3.0)  # deg/s^2
    nutation: float = 15.0
    nutation_decay: float = 0.5
    inertia_ratio: float = 1.15 / 0.6
    roll: float = -12.0
    pitch: float = 8.0
    yaw: float = 30.0
    force: tuple[float, float, float] = (-4.0, 1.5, -9.0)  # m/s^2, specific force in N at half time
    magnetic_field: tuple[float, float, float] = (30.1, -4.3, 39.2)


@dataclass(frozen=True)
class Faults:
    """What is wrong with the sensors."""

    hard_iron: tuple[float, float, float] = (0.0, 0.0, 0.0)
    soft_iron: FloatArray = field(default_factory=lambda: np.zeros((3, 3)))
    mount_error: tuple[float, float] = (0.0, 0.0)  # m
    accelerometer_bias: tuple[float, float] = (0.0, 0.0)
    gyroscope_bias: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gyroscope_scale: tuple[float, float, float] = (0.0, 0.0, 0.0)
    dropped: float = 0.0
    jitter: float = 0.0


@dataclass(frozen=True)
class Truth:
    """Rates (n, 3), rad/s, and C_BN (n, 3, 3) on a fine grid t."""

    t: FloatArray
    w: FloatArray
    attitude: FloatArray

    def r(self, t: FloatArray) -> FloatArray:
        return np.interp(t, self.t, self.w[:, 2])


def _skew_exp(v: FloatArray) -> FloatArray:
    """exp(-[v x]) (..., 3, 3) by Rodrigues' formula."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    zero = np.zeros(v.shape[:-1])
    k = -np.stack(
        [
            np.stack([zero, -v[..., 2], v[..., 1]], -1),
            np.stack([v[..., 2], zero, -v[..., 0]], -1),
            np.stack([-v[..., 1], v[..., 0], zero], -1),
        ],
        -2,
    )
    return np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / 2 / np.pi) ** 2 * (k @ k)


def turn_z(angle: FloatArray) -> FloatArray:
    c, s, o = np.cos(angle), np.sin(angle), np.zeros_like(angle)
    return np.stack([np.stack([c, s, o], -1), np.stack([-s, c, o], -1), np.stack([o, o, o + 1], -1)], -2)


def move(spin: Spin, step: float = 2.5e-4) -> Truth:
    from discsim.frames import attitude_matrix

    t = np.arange(-0.05, spin.duration + 0.05, step)

    def rate_and_phase(t: FloatArray) -> tuple[FloatArray, FloatArray]:
        # r = r0 exp(-s - k s^2), s = t/decay; the phase by Simpson's rule on the grid it is asked for
        k = spin.decay_change * spin.decay / 10.0
        r0 = np.radians(spin.rate)

        def rate(t: FloatArray) -> FloatArray:
            s = t / spin.decay
            return r0 * np.exp(-s - k * s * s)

        h = np.diff(t, prepend=t[0])
        increments = h / 6 * (rate(t - h) + 4 * rate(t - h / 2) + rate(t))
        return rate(t), np.cumsum(increments)

    def transverse(t: FloatArray, psi: FloatArray) -> FloatArray:
        slow = complex(*spin.precession) + complex(*spin.precession_change) * (t - 0.5 * spin.duration)
        fade = np.exp(-np.maximum(t, -0.05) / spin.nutation_decay)
        return np.asarray(np.pi / 180 * (slow + spin.nutation * fade * np.exp(1j * spin.inertia_ratio * psi)))

    fine = np.arange(2 * t.size - 1) * step / 2 + t[0]
    r, psi = rate_and_phase(fine)
    despun = transverse(fine, psi)
    middle = despun[1::2]
    steps = _skew_exp(np.stack([middle.real, middle.imag, np.zeros(middle.size)], -1) * step)
    D = np.empty((t.size, 3, 3))
    D[0] = attitude_matrix(*np.radians([spin.roll, spin.pitch, spin.yaw]))
    for i in range(t.size - 1):
        D[i + 1] = steps[i] @ D[i]
    r, psi, w = r[::2], psi[::2], despun[::2] * np.exp(-1j * psi[::2])
    return Truth(t, np.stack([w.real, w.imag, r], -1), turn_z(psi) @ D)


def measured(value: FloatArray, sheet: SensorSheet, rng: np.random.Generator, noise: float | None = None) -> FloatArray:
    value = value + rng.normal(0.0, sheet.noise_rms if noise is None else noise, value.shape)
    if sheet.resolution:
        value = np.rint(value / sheet.resolution) * sheet.resolution
    return np.clip(value, -sheet.range, sheet.range) if sheet.range else value


def record(
    spin: Spin,
    rng: np.random.Generator,
    faults: Faults | None = None,
    sheets: dict[str, SensorSheet] | None = None,
    sensors: tuple[str, ...] = ("magnetometer", "accelerometer", "gyroscope"),
    plant: str = "flight",
    truth: Truth | None = None,
) -> tuple[Recording, Truth]:
    """Return what the sensors wrote and the truth."""
    faults, sheets = faults or Faults(), sheets or MPU9250
    truth = truth or move(spin)
    samples = {}
    for sensor in sensors:
        sheet = sheets[sensor]
        t = np.arange(0.0, spin.duration, 1 / sheet.rate_hz)
        if sensor == "magnetometer":
            if faults.jitter:
                t = np.sort(t + rng.uniform(-faults.jitter, faults.jitter, t.size))
            t = t[rng.random(t.size) >= faults.dropped]
        # the truth at the instants themselves: attitude carried from the nearest grid point by the rates there
        index = np.clip(np.rint((t - truth.t[0]) / (truth.t[1] - truth.t[0])).astype(int), 0, truth.t.size - 1)
        w = np.stack([np.interp(t, truth.t, truth.w[:, i]) for i in range(3)], -1)
        C = _skew_exp(0.5 * (w + truth.w[index]) * (t - truth.t[index])[:, None]) @ truth.attitude[index]
        if sensor == "magnetometer":
            value = C @ np.asarray(spin.magnetic_field)
            value = value @ (np.eye(3) + faults.soft_iron).T + faults.hard_iron
        elif sensor == "gyroscope":
            value = w * (1 + np.asarray(faults.gyroscope_scale)) + faults.gyroscope_bias
        else:
            force = np.asarray(spin.force) * (1 - 0.1 * (t - spin.duration / 2)[:, None])
            d = np.asarray(sheet.position) + np.array([*faults.mount_error, 0.0])
            dw = np.stack([np.interp(t, truth.t, np.gradient(truth.w[:, i], truth.t)) for i in range(3)], -1)
            turned = np.einsum("nij,nj->ni", C, force)
            value = turned + np.cross(w, np.cross(w, d)) + np.cross(dw, d) + [*faults.accelerometer_bias, 0.0]
        samples[sensor] = Samples(t, measured(value, sheet, rng))
    environment = Environment(magnetic_field=np.asarray(spin.magnetic_field))
    stated = {name: sheets[name] for name in sensors}
    return Recording(plant, "synthetic", environment, sheets=stated, samples=samples), truth


def tone(
    rng: np.random.Generator,
    *,
    rate: float,
    window: float,
    decibels: float,
    interval: float = 0.01,
    chirp: float = 0.0,
    offset: complex = 12.0 - 7.0j,
    ellipse: complex = 0.0,
    amplitude: float = 30.0,
    t: FloatArray | None = None,
) -> tuple[Samples, float]:
    """A bare window: a tone of ``rate`` deg/s with signal to noise per axis in decibels; returns it and the noise."""
    t = np.arange(round(window / interval)) * interval if t is None else t
    tau = t - np.mean(t)
    noise = amplitude * 10 ** (-decibels / 20)
    phase = rng.uniform(0, 2 * np.pi) - np.radians(rate) * tau - 0.5 * chirp * tau**2
    E = np.exp(1j * phase)
    z = (
        offset
        + amplitude * (E + ellipse * np.conj(E))
        + rng.normal(0, noise, t.size)
        + 1j * rng.normal(0, noise, t.size)
    )
    return Samples(t, np.stack([z.real, z.imag, 40.0 + rng.normal(0, noise, t.size)], -1)), noise


def without(spin: Spin, *, precession: bool = True, spin_down: bool = True) -> Spin:
    """Return the motion with precession and nutation, or spin-down, switched off where asked for."""
    if not precession:
        spin = replace(spin, precession=(0.0, 0.0), precession_change=(0.0, 0.0), nutation=0.0)
    return spin if spin_down else replace(spin, decay=1e9, decay_change=0.0)
