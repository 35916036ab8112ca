"""An accelerometer's unit by what it reads along the axis of a spin. Takes both sensors' readings; gives a unit.

In flight that is lift, on a level table gravity: a third of g to two g. A log that holds no rest shows its unit so.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.spin_axis import FAST
from discsim.validation.importing.import_map import G0, UNITS
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.magnitudes import PER_G, Unit
from discsim.validation.importing.sniffing.spin_axis import MOST_LIFT, Reading3

__all__ = ["along", "unit_by_lift"]

#: Least that lift carries over a flight, m/s^2: a third of the weight.
LEAST_LIFT = G0 / 3
#: Rows of a fast spin without which none tells.
ROWS = 20
#: A unit of the header is wrong where by it the reading is this many times `MOST_LIFT`: the pull to the centre of a
#: chip 16 mm from the axis leaks in with 2 % a degree of tilt, half a g at 40 rad/s.
BEYOND = 5.0


def along(gyro: Reading3, t: FloatArray, accel: FloatArray) -> float | None:
    """Return the median size of an accelerometer's readings (n, 3) along the axis of the spin, as they are written.

    ``gyro`` is in rad/s, ``t`` (n,) s the time of the accelerometer's rows. None where nothing spins fast.
    """
    sound, there = np.isfinite(gyro.value).all(axis=1), np.isfinite(accel).all(axis=1) & np.isfinite(t)
    if sound.sum() < ROWS or there.sum() < ROWS:
        return None
    rate = np.column_stack([np.interp(t[there], gyro.t[sound], column) for column in gyro.value[sound].T])
    size = np.linalg.norm(rate, axis=1)
    fast = (size > 0.5 * float(np.percentile(size, 99.5))) & (size > FAST)
    if fast.sum() < ROWS:
        return None
    return abs(float(np.median(np.sum(accel[there][fast] * rate[fast], axis=1) / size[fast])))


def unit_by_lift(unit: Unit, seen: float | None, *, stated: bool, counts: bool) -> Unit | None:
    """Return the unit by which the reading along the spin is lift, where it is not by the one that was taken.

    ``seen`` is that reading as written. A unit that the header has (``stated``) is given up only where by it no thing
    could fly so; ``counts``: they are whole numbers, which may be counts of a part. None where nothing tells.
    """
    if seen is None or seen == 0:
        return None
    now = seen * unit.factor("m_s2")
    if LEAST_LIFT < now <= MOST_LIFT or (stated and now < BEYOND * MOST_LIFT):
        return None
    worths = {name: (name, 1.0) for name in ("m/s^2", "g", "mg")}
    worths |= {f"1/{per:.0f} g a count": ("g", 1 / per) for per in PER_G if counts and seen > 10}
    fits = {
        text: one for text, one in worths.items() if LEAST_LIFT < seen * UNITS["m_s2"][one[0]] * one[1] <= MOST_LIFT
    }
    if not fits:
        return None
    # parts' counts lie a factor of two apart, lift does not: of several the one nearest to g
    text = min(fits, key=lambda name: abs(np.log(seen * UNITS["m_s2"][fits[name][0]] * fits[name][1] / G0)))
    name, scale = fits[text]
    size = seen * UNITS["m_s2"][name] * scale / G0
    why = f"nothing rests in it; along the axis of the spin it reads {size:.2g} g in it, as lift or gravity does"
    why += ", although the header says otherwise" * stated
    others = ", ".join(other for other in fits if other != text)
    why += f"; it may be {others} as well" if others else ""
    return Unit(name, scale, Decision("accelerometer unit", text, "guess" if others else "likely", why))
