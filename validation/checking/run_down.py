"""A rig's stated friction and inertia against the run-down that was recorded: gross slips, as of a unit.

Takes a recording; gives a finding where the rate falls so fast, or so slowly, that no friction within a factor of the
stated one explains it, whatever dry friction and drag of the air are beside it. What is smaller is no slip of the pen:
`diagnose` finds it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.optimize import lsq_linear

from discsim.arrays import FloatArray
from discsim.disc import Rig
from discsim.limits import time_fault
from discsim.recording import Recording
from discsim.validation.checking.finding import Finding
from discsim.validation.diagnosis.setup.shown_rates import ShownRate, shown_rates

__all__ = ["run_down_findings"]

#: friction over inertia is a slip beyond this factor of what is stated: a power of ten, while friction itself is known
#: to a factor of two
_FACTOR = 5.0
#: standard deviations that are stated of them and count as known
_SIGMAS = 3.0
#: dry friction over viscous, rad/s, and drag with the square of the rate over viscous, s/rad, are allowed this large:
#: three times the largest that the blind test conceals (3e-4 N m and 3e-7 N m s^2 beside 3e-5 N m s)
_DRY, _DRAG = 30.0, 0.03
#: slower than this share of its fastest rate a rig comes to rest, where bearings stick
_SLOW = 0.1
#: fewest means over a quarter of a second
_FEWEST = 12
#: What is left (rms) with the stated friction is told from this multiple of what is left without, and from this share
#: of the fastest rate on. What a tilted axis, a ripple or another law of friction leaves is in both.
_WORSE, _LEAST = 3.0, 0.005
#: what units do to friction over inertia as it is stated, and the number's own mistake
_SLIPS = {
    1e9: "Izz_kg_m2 in g mm2",
    1e7: "Izz_kg_m2 in g cm2",
    1e6: "Izz_kg_m2 in kg mm2",
    1e4: "Izz_kg_m2 in kg cm2",
    1e3: "Izz_kg_m2 in g m2",
    60.0 / (2.0 * np.pi): "viscous_N_m_s in N m per rpm",
    1e-3: "viscous_N_m_s in mN m s",
    1e-6: "viscous_N_m_s in uN m s",
    1e-7: "viscous_N_m_s in dyn cm s",
}
#: such a slip is supposed within this factor: the friction itself is known no better
_NEAR = 2.0


def run_down_findings(recording: Recording) -> Iterator[Finding]:
    """Yield that a rig's stated friction or inertia cannot be, by how its rate falls.

    A rate reference is believed: one that is refuted is to be left out before (`reference.believed`).
    """
    rig, shown = recording.rig, _falling(recording)
    if rig is None or shown is None or not rig.viscous > 0.0:
        return
    t, rate = shown
    stated = rig.viscous / rig.Izz
    low, high = _known_within(rig)
    left, best = _left(t, rate, low, high, high / _FACTOR), _left(t, rate, 0.0, np.inf, np.inf)
    if left < max(_WORSE * best, _LEAST * float(np.max(rate))):
        return
    falls = float(np.log(rate[0] / rate[-1])) / float(t[-1] - t[0])
    if low < falls < high:
        return
    yield Finding(
        "rig.friction",
        "warning",
        "[rig]",
        f"the rate falls from {rate[0]:.3g} to {rate[-1]:.3g} rad/s in {t[-1] - t[0]:.3g} s, by {falls:.2g} of itself "
        f"a second; by viscous_N_m_s over Izz_kg_m2 it would fall by {stated:.2g}",
        f"the same within a factor of {_FACTOR:g}, with ordinary dry friction and drag of the air beside it",
        _remedy(falls, stated),
    )


def _remedy(falls: float, stated: float) -> str:
    """Say which mistake makes a rate fall as it does and not as is stated."""
    if not falls > 0.0:
        return "was the rig still driven? It is no slower at the end"
    factor = falls / stated
    slip = min(_SLIPS, key=lambda one: abs(float(np.log(factor / one))))
    unit = f" (is {_SLIPS[slip]}?)" if abs(float(np.log(factor / slip))) < np.log(_NEAR) else ""
    driven = "" if factor > 1.0 else ", or was the rig still driven?"
    return f"the ratio of the two is {factor:.2g} times that: one has a wrong unit, or power of ten{unit}{driven}"


def _falling(recording: Recording) -> tuple[FloatArray, FloatArray] | None:
    """Return means of the rate's size while a rig runs down: times (n,) s and rates (n,) rad/s; None for too few.

    By the rate reference, or by the first sensor that shows a rate where there is none.
    """
    if recording.rig is None or any(len(one) and time_fault(one.t) for one in recording.samples.values()):
        return None
    shown: ShownRate | None
    if (samples := recording.get("rate_reference")) is not None:
        known = np.isfinite(samples.value)
        shown = ShownRate(samples.t[known], samples.value[known], signed=True)
    else:
        shown = next(iter(shown_rates(recording).values()), None)
    if shown is None:
        return None
    t, rate = shown.slots()
    if t.size < _FEWEST:
        return None
    first = int(np.argmax(rate))
    slow = np.flatnonzero(rate[first:] < _SLOW * rate[first])
    after = first + int(slow[0]) if slow.size else t.size
    return (t[first:after], rate[first:after]) if after - first >= _FEWEST else None


def _known_within(rig: Rig) -> tuple[float, float]:
    """Return from what to what friction over inertia, 1/s, may be with what is stated."""
    friction, inertia = (_SIGMAS * float(np.max(rig.sigma.get(name, 0.0))) for name in ("viscous_N_m_s", "Izz_kg_m2"))
    low = max(rig.viscous - friction, 0.0) / (rig.Izz + inertia)
    high = (rig.viscous + friction) / max(rig.Izz - inertia, rig.Izz / _FACTOR)
    return low / _FACTOR, high * _FACTOR


def _left(t: FloatArray, rate: FloatArray, low: float, high: float, stated: float) -> float:
    """Return what rates (n,) leave (rms) beside the friction that explains them best, viscous from low to high, 1/s.

    Dry friction and drag are in proportion to what is ``stated``, 1/s. ``r(0) - r(t)`` is the integral of
    ``viscous r + dry + drag r^2``, linear in the three and in r(0).
    """
    angle, square = (cumulative_trapezoid(rate**power, t, initial=0) for power in (1, 2))
    columns = np.column_stack([np.ones(t.size), -angle, -(t - t[0]), -square])
    least, most = np.array([-np.inf, low, 0.0, 0.0]), np.array([np.inf, high, _DRY * stated, _DRAG * stated])
    size = np.linalg.norm(columns, axis=0)
    found = lsq_linear(columns / size, rate, (least * size, most * size))
    return float(np.sqrt(2.0 * found.cost / t.size))
