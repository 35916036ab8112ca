"""The drive of a rate table: how the rate that it turns with differs from the one that was asked for."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, log, pi, sqrt
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.compiled import compiled
from discsim.errors import InputError
from discsim.recording import Samples
from discsim.toml_table import TomlTable

__all__ = ["Ripple", "TableDrive", "Wow", "read_drive"]

#: spacing of the instants at which the driven rate is told, s: the table's own step, and the finest for a fast ripple
STEP, FINEST = 1e-3, 2.5e-4
#: steps in a period of a ripple: lines between them leave 5 % of its amplitude, (2 pi / 10)^2 / 8
_PER_PERIOD = 10.0
#: steps of the loop in the time constant of its bandwidth (in radians): Runge-Kutta is then exact to 1e-6
_FINE = 20.0
#: a ripple fades where the table turns slower than this many amplitudes: a table that stands has none, none turns back
_FADE = 3.0


class Ripple(NamedTuple):
    """Speed that pulses with the angle psi: amplitude sin(order psi + phase), as poles and gears make it."""

    order: float
    amplitude_rad_s: float
    phase_rad: float = 0.0


class Wow(NamedTuple):
    """Speed that comes and goes over time, in proportion to the rate: r -> r (1 + share sin(2 pi f t + phase))."""

    frequency_hz: float
    share: float
    phase_rad: float = 0.0


@dataclass(frozen=True)
class TableDrive:
    """What stands between the rate asked for and the rate of the table; the defaults follow any command exactly.

    The speed loop is one of second order, ``r'' + 2 zeta w r' + w^2 r = w^2 c``: an integrator of the error c - r and
    a brake in proportion to the rate, whose answer to a step overshoots by ``overshoot`` of the step and falls to
    1/sqrt(2) at ``bandwidth_hz``. The command c is the profile within ``largest_rate`` (rad/s), no steeper than
    ``largest_acceleration`` (rad/s^2). The motor gives at most ``largest_torque`` (N m) against ``inertia`` (kg m^2)
    and ``friction`` (N m s); where it saturates the integrator stands still.
    """

    bandwidth_hz: float = inf
    overshoot: float = 0.0
    largest_rate: float = inf
    largest_acceleration: float = inf
    largest_torque: float = inf
    inertia: float = 1.1e-3
    friction: float = 0.0
    ripples: tuple[Ripple, ...] = ()
    wows: tuple[Wow, ...] = ()

    @property
    def is_ideal(self) -> bool:
        """Whether the table turns as it is asked to."""
        limits = (self.bandwidth_hz, self.largest_rate, self.largest_acceleration, self.largest_torque)
        return all(limit == inf for limit in limits) and not self.ripples and not self.wows

    @property
    def damping_ratio(self) -> float:
        """zeta of the loop: overshoot = exp(-pi zeta / sqrt(1 - zeta^2)); 1 where it does not overshoot."""
        if self.overshoot <= 0.0:
            return 1.0
        decay = log(1.0 / self.overshoot)
        return decay / sqrt(pi * pi + decay * decay)

    @property
    def natural_frequency(self) -> float:
        """w of the loop, rad/s, from the frequency at which its answer falls to 1/sqrt(2)."""
        spread = 1.0 - 2.0 * self.damping_ratio**2
        return 2.0 * pi * self.bandwidth_hz / sqrt(spread + sqrt(spread * spread + 1.0))

    @property
    def delay(self) -> float:
        """By how much the table lags behind a steady ramp, s: 2 zeta / w."""
        return 0.0 if self.bandwidth_hz == inf else 2.0 * self.damping_ratio / self.natural_frequency

    def follow(self, profile: Samples) -> Samples:
        """Return the rate of the table, each millisecond, for a profile: t (n,) s, rate (n,) rad/s, linear between.

        Starts settled on the profile's first rate; finer where a ripple is fast. An ideal drive returns the profile as
        it is. Raises `InputError` for a ripple that is too fast to be shown.
        """
        if self.is_ideal:
            return profile
        step = self._step(float(np.max(np.abs(profile.value))))
        t = np.append(np.arange(0.0, float(profile.t[-1]) - 0.5 * step, step), profile.t[-1])
        loop = np.inf if self.bandwidth_hz == inf else self.natural_frequency
        parts = 1 if loop == np.inf else max(1, int(np.ceil(step * loop * _FINE / (2.0 * pi))))
        numbers = np.array(
            [
                loop,
                self.damping_ratio,
                self.largest_rate,
                self.largest_acceleration,
                self.largest_torque,
                self.inertia,
                self.friction,
            ]
        )
        ripples, wows = (np.array(some, dtype=float).reshape(-1, 3) for some in (self.ripples, self.wows))
        knots = np.stack([profile.t, profile.value])
        return Samples(t, _follow(knots, t, parts, numbers, ripples, wows))

    def _step(self, fastest: float) -> float:
        """Return the spacing of instants that shows every ripple up to a rate, rad/s."""
        rate = min(fastest, self.largest_rate)
        step = STEP
        for ripple in self.ripples:
            if ripple.amplitude_rad_s and rate:
                step = min(step, 2.0 * pi / (ripple.order * rate * _PER_PERIOD))
        if step < FINEST:
            order = max(ripple.order for ripple in self.ripples if ripple.amplitude_rad_s)
            raise InputError(
                f"a ripple of order {order:g} at {np.degrees(rate):.0f} deg/s is {order * rate / (2 * pi):.0f} Hz; "
                f"expected at most {1 / (FINEST * _PER_PERIOD):.0f} Hz (a table's inertia leaves little of more)"
            )
        return step

    def torque(self, rate: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return the motor's torque, N m, of rates (rad/s) and angular accelerations (rad/s^2)."""
        return self.inertia * acceleration + self.friction * rate


@compiled
def _asked(knots: FloatArray, t: float, largest: float) -> float:
    """Return the rate that a profile (2, n) asks for at time t, within what the table can turn."""
    n = knots.shape[1]
    k = min(max(np.searchsorted(knots[0], t, side="right") - 1, 0), n - 2)
    share = min(max((t - knots[0, k]) / (knots[0, k + 1] - knots[0, k]), 0.0), 1.0)
    rate = knots[1, k] + share * (knots[1, k + 1] - knots[1, k])
    return float(min(max(rate, -largest), largest))


@compiled
def _loop(r: float, x: float, c: float, numbers: FloatArray) -> tuple[float, float]:
    """Return the derivatives of the rate r and the loop's integrator x for a command c."""
    w, zeta = numbers[0], numbers[1]
    wanted = w * w * x - 2.0 * zeta * w * r
    top = (numbers[4] - numbers[6] * r) / numbers[5]
    bottom = (-numbers[4] - numbers[6] * r) / numbers[5]
    given = min(max(wanted, bottom), top)
    winds = (wanted > top and c > r) or (wanted < bottom and c < r)
    return given, 0.0 if winds else c - r


@compiled
def _unsteady(r: float, psi: float, t: float, ripples: FloatArray, wows: FloatArray) -> float:
    """Return the rate of a table whose drive turns it by r at angle psi: with its ripples and wows."""
    total = r
    for k in range(wows.shape[0]):
        total += r * wows[k, 1] * np.sin(2.0 * np.pi * wows[k, 0] * t + wows[k, 2])
    for k in range(ripples.shape[0]):
        size = abs(ripples[k, 1])
        if size > 0.0:
            fade = min(1.0, abs(r) / (_FADE * size))
            total += fade * ripples[k, 1] * np.sin(ripples[k, 0] * psi + ripples[k, 2])
    return total


@compiled
def _follow(
    knots: FloatArray, t: FloatArray, parts: int, numbers: FloatArray, ripples: FloatArray, wows: FloatArray
) -> FloatArray:
    """Return the rate (n,) at instants t (n,), each step between them in so many ``parts``."""
    rate = np.empty(t.size)
    w, zeta, largest, steepest = numbers[0], numbers[1], numbers[2], numbers[3]
    loop = w < np.inf
    c = _asked(knots, 0.0, largest)
    r, psi = c, 0.0
    x = 2.0 * zeta * r / w if loop else 0.0
    rate[0] = _unsteady(r, psi, 0.0, ripples, wows)
    for k in range(t.size - 1):
        h = (t[k + 1] - t[k]) / parts
        for j in range(parts):
            start = t[k] + j * h
            asked = _asked(knots, start + h, largest)
            before = c
            c = c + min(max(asked - c, -steepest * h), steepest * h)
            old = r
            if loop:
                middle = 0.5 * (before + c)
                r1, x1 = _loop(r, x, before, numbers)
                r2, x2 = _loop(r + 0.5 * h * r1, x + 0.5 * h * x1, middle, numbers)
                r3, x3 = _loop(r + 0.5 * h * r2, x + 0.5 * h * x2, middle, numbers)
                r4, x4 = _loop(r + h * r3, x + h * x3, c, numbers)
                r += h / 6.0 * (r1 + 2.0 * r2 + 2.0 * r3 + r4)
                x += h / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4)
            else:
                top = (numbers[4] - numbers[6] * r) / numbers[5]
                bottom = (-numbers[4] - numbers[6] * r) / numbers[5]
                r += min(max(c - r, bottom * h), top * h)
            # the angle by the middle of the step, so that a ripple stands where the table does
            guess = psi + 0.5 * h * _unsteady(old, psi, start, ripples, wows)
            psi += h * _unsteady(0.5 * (old + r), guess, start + 0.5 * h, ripples, wows)
        rate[k + 1] = _unsteady(r, psi, t[k + 1], ripples, wows)
    return rate


def read_drive(table: TomlTable | None) -> TableDrive:
    """Read a ``[drive]`` table (docs/rate-table.md); raises `InputError` naming key, line and what was expected."""
    if table is None:
        return TableDrive()
    degrees = pi / 180.0

    def limit(stem: str, unit: str, factor: float = 1.0) -> float:
        value = table.number(stem, unit, required=False, positive=True)
        return inf if value is None else factor * value

    overshoot = table.number("overshoot", required=False, minimum=0.0) or 0.0
    if not overshoot < 1.0:
        raise table.error("overshoot", f"'drive.overshoot' is {overshoot:g}, expected a share of a step, below 1")
    inertia = table.number("inertia", "kg_m2", required=False, positive=True)
    torque = limit("largest_torque", "N_m")
    if torque < inf and inertia is None:
        raise table.error("largest_torque_N_m", "drive.largest_torque_N_m needs drive.inertia_kg_m2, of table and load")
    drive = TableDrive(
        bandwidth_hz=limit("bandwidth", "hz"),
        overshoot=overshoot,
        largest_rate=limit("largest_rate", "deg_s", degrees),
        largest_acceleration=limit("largest_acceleration", "deg_s2", degrees),
        largest_torque=torque,
        inertia=TableDrive.inertia if inertia is None else inertia,
        friction=table.number("friction", "N_m_s", required=False, minimum=0.0) or 0.0,
        ripples=tuple(_ripple(one) for one in table.tables("ripple")),
        wows=tuple(_wow(one) for one in table.tables("wow")),
    )
    if overshoot > 0.0 and drive.bandwidth_hz == inf:
        raise table.error(
            "overshoot", "drive.overshoot needs drive.bandwidth_hz: a loop without one does not overshoot"
        )
    table.finish()
    return drive


def _phase(table: TomlTable) -> float:
    return float(np.radians(table.number("phase", "deg", required=False) or 0.0))


def _ripple(table: TomlTable) -> Ripple:
    ripple = Ripple(
        table.need("order", positive=True), float(np.radians(table.need("amplitude", "deg_s"))), _phase(table)
    )
    table.finish()
    return ripple


def _wow(table: TomlTable) -> Wow:
    wow = Wow(table.need("frequency", "hz", positive=True), table.need("share"), _phase(table))
    if not abs(wow.share) < 1.0:
        raise table.error("share", f"'{table.name}.share' is {wow.share:g}, expected a share of the rate below 1")
    table.finish()
    return wow
