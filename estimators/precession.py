"""What precession does to the magnetometer's phase, and what is needed to undo it.

A field fixed in N obeys ``dm/dt = -w x m`` in the body. With ``z = m_x + i m_y`` its parts are
``dz/dt = -i r z + i m_z (p + i q)`` and ``dm_z/dt = Im(conj(z) (p + i q))``, so the phase turns at
``-r + m_z (p m_x + q m_y)/(m_x^2 + m_y^2)``: derivation in docs/spin-phase.md. The paper takes it as -r.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import make_interp_spline

from discsim.arrays import ComplexArray, FloatArray
from discsim.errors import InputError
from discsim.estimators.usable import unclipped
from discsim.recording import Recording, Samples

__all__ = ["AxialField", "axial_field", "phase_rate", "tipping", "transverse_gyroscope", "transverse_rates"]

#: Moment of the air over Izz, rad^2/s^2, rms: what the spin times the turning of a disc's axis is. Flown at random (six
#: discs, 12 to 27 m/s, any heading) it is 5.5, 5.3, 7.1, 6.7 and 6.5 across the field from 1200, 2000, 2800, 4000 and
#: 5200 deg/s on (tests/estimators/test_slow_throws.py flies some).
MOMENT = 6.4
#: Slowest spin, rad/s, of a disc that flies; a slower one tumbles, and the air's moment no longer tips it steadily.
SLOWEST_FLYING = 15.0


def phase_rate(m: FloatArray, w: FloatArray) -> FloatArray:
    """Return the rate (...,), rad/s, at which the phase of the field turns, from m (..., 3) and w (..., 3) in B."""
    across = m[..., 0] ** 2 + m[..., 1] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(-w[..., 2] + m[..., 2] * (w[..., 0] * m[..., 0] + w[..., 1] * m[..., 1]) / across)


def tipping(least: float, rate: ArrayLike) -> FloatArray:
    """Return how fast a disc's axis may turn in flight at a spin ``rate`` (...,), rad/s rms: (...,), ``least`` or more.

    A moment M of the air turns the axis of a spinning disc by ``M/(Izz r)``: a slow spin precesses faster.
    """
    return np.asarray(np.maximum(least, MOMENT / np.maximum(np.abs(rate), SLOWEST_FLYING)))


@dataclass(frozen=True)
class AxialField:
    """Hard iron along z, which a steady spin does not show, and its standard deviation, uT."""

    offset: float
    sd: float


def axial_field(amplitude: FloatArray, axial: FloatArray, strength: float | None) -> AxialField:
    """Find the hard iron along z from the field's strength: ``amplitude^2 + (axial - offset)^2 = strength^2``.

    ``amplitude`` (n,) is the field across the spin axis and ``axial`` (n,) the mean reading along it, uT, NaN where
    unknown. Of the two solutions the one with the smaller offset is taken unless the precession of the axis tells;
    its standard deviation supposes that the strength is known to ``STRENGTH_SD``. Without a strength, or where
    the field is nearly across the axis and both solutions merge, the offset stays near zero with a wide deviation.
    """
    known = np.isfinite(amplitude) & np.isfinite(axial)
    if not np.any(known):
        return AxialField(0.0, HARD_IRON_SD)
    a, z = amplitude[known], axial[known]
    offsets = np.linspace(-2 * HARD_IRON_SD, 2 * HARD_IRON_SD, 2001)
    # by least squares over (offset, strength), the strength drawn to the one stated and the offset to zero
    mean, variance = np.empty(offsets.size), np.empty(offsets.size)
    rows = max(1, LENGTHS // a.size)
    for start in range(0, offsets.size, rows):
        part = slice(start, start + rows)
        lengths = np.sqrt(a[None, :] ** 2 + (z[None, :] - offsets[part, None]) ** 2)
        mean[part], variance[part] = np.mean(lengths, axis=1), np.var(lengths, axis=1)
    # neighbours overlap and share the errors of soft iron: a window counts as knowing its length to 0.3 uT
    cost = variance * max(1.0, 0.1 * a.size) / 0.3**2 + (offsets / HARD_IRON_SD) ** 2
    if strength is not None:
        cost += ((mean - strength) / (STRENGTH_SD * strength)) ** 2
    weight = np.exp(-0.5 * (cost - np.min(cost)))
    weight /= np.sum(weight)
    best = float(offsets[np.argmin(cost)])
    return AxialField(best, float(np.sqrt(np.sum(weight * (offsets - best) ** 2))))


#: Lengths of the field, of a window and an offset each, that are held at once: 8 MB, whatever the length of a log.
LENGTHS = 1 << 20
#: Prior standard deviation of hard iron along z, uT.
HARD_IRON_SD = 20.0
#: Relative standard deviation of the strength of the field that the sensor should show: its own scale, mostly.
STRENGTH_SD = 0.01


#: A gyroscope shows p and q where it has both for this share of its readings at least.
SHOWN = 0.5


def transverse_gyroscope(recording: Recording) -> Samples | None:
    """Return a recording's gyroscope, with gaps where it clips, or None where it does not show p and q."""
    gyroscope = unclipped(recording, "gyroscope")
    if gyroscope is None or len(gyroscope) < 6:
        return None
    both = np.isfinite(gyroscope.value[:, 0]) & np.isfinite(gyroscope.value[:, 1])
    return gyroscope if np.count_nonzero(both) >= max(6, SHOWN * both.size) else None


#: Readings before and after those asked for that a spline goes through: what lies beyond moves a spline of fifth degree
#: by 0.43 of it per knot, over 64 by 1e-23.
BESIDE = 64


def _around(gyroscope: Samples, t: FloatArray) -> slice:
    """Return which readings of the gyroscope tell of times t (n,): a long log has many segments."""
    w, count = gyroscope.value, len(gyroscope)
    if t.size == 0:
        return slice(0, count)
    first, after = (int(place) for place in np.searchsorted(gyroscope.t, t[[0, -1]]))

    def known(part: slice) -> int:
        return int(np.count_nonzero(np.isfinite(w[part, 0]) & np.isfinite(w[part, 1])))

    start, stop = max(first - BESIDE, 0), min(after + BESIDE, count)
    while start > 0 and known(slice(start, first)) < BESIDE:
        start = max(first - 2 * (first - start), 0)
    while stop < count and known(slice(after, stop)) < BESIDE:
        stop = min(after + 2 * (stop - after), count)
    return slice(start, stop)


def transverse_rates(gyroscope: Samples, t: FloatArray, step: float = 0.0025) -> tuple[ComplexArray, int]:
    """Return p + i q, (n - 1, substeps), at the middle of equal sub-steps between neighbouring times t (n,).

    Body rates wobble at about the spin rate, so they are interpolated by a spline of fifth degree. Gaps longer than
    five readings, and times more than two readings outside the gyroscope's, give NaN.
    """
    w = gyroscope.value
    if w.ndim != 2 or w.shape[1] != 3:
        raise InputError(f"gyroscope: got values {w.shape}, expected (n, 3)")
    around = _around(gyroscope, t)
    w = w[around]
    good = np.isfinite(w[:, 0]) & np.isfinite(w[:, 1])
    times = gyroscope.t[around][good]
    interval = float(np.median(np.diff(t))) if t.size > 1 else step
    substeps = max(2, int(np.ceil(interval / step)))
    if times.size < 6 or t.size < 2:
        return np.full((max(0, t.size - 1), substeps), complex(np.nan, np.nan)), substeps
    fraction = (np.arange(substeps) + 0.5) / substeps
    middle = t[:-1, None] + np.diff(t)[:, None] * fraction
    spline = make_interp_spline(times, w[good, :2], k=5)
    spacing = float(np.median(np.diff(times)))
    inside = np.clip(middle, times[0], times[-1])
    value = spline(inside)
    index = np.clip(np.searchsorted(times, middle), 1, times.size - 1)
    gap = (times[index] - times[index - 1] > 5.5 * spacing) | (np.abs(middle - inside) > 2.5 * spacing)
    rates = np.where(gap, np.nan, value[..., 0]) + 1j * np.where(gap, np.nan, value[..., 1])
    return np.asarray(rates, dtype=complex), substeps
