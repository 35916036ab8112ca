"""A gyroscope's unit by how often its readings swing. Takes readings as written and their times; gives a unit.

What is fixed in the room goes round once in a turn of a spinning thing, and its wobble about as often: a disc's or a
wheel's rates across the axis swing by Izz/Ixx - 1 of the spin, 0.6 to 1 of it. A log of a throw alone in no stated unit
so says itself how fast it turns: readings of 30 that swing 30/(2 pi) times a second are rad/s.
"""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.validation.importing.import_map import UNITS
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.magnitudes import Unit
from discsim.validation.importing.sniffing.pull import POSSIBLE
from discsim.validation.importing.sniffing.spin_axis import Reading3

__all__ = ["swings_once_a_turn", "unit_by_swings"]

#: Fewest turns and rows that show a swing: a line of the spectrum is three bins wide under a Hann window.
TURNS, ROWS = 4.0, 30
#: Swings a turn. On four measured throws whose clock is a quarter slow they are 1.23 to 1.26, on made ones 0.9 to 1.
BAND = (0.6, 1.4)
#: Share of what swings that lies in the band: 0.95 on made throws, and where the readings are noise the band's own.
SHARE = 0.5
#: A guess gives way where this share of a log turns so at a stretch, as in a throw alone: a hand turns by fits.
AT_A_STRETCH = 0.5
#: The highest frequency that the rows hold, in swings a turn: up to it noise has less than a third in the band.
HIGHEST = 2.5


def unit_by_swings(unit: Unit, gyro: Reading3, arm: float | None) -> Unit | None:
    """Return rad/s in place of a guess where the rates (n, 3) across the axis swing once a turn of readings in rad/s.

    Readings are as written, times in s. A header's deg/s gives way where the accelerometer's ``arm`` by rad/s, m, is
    one that a disc can have, too; a guess where none shows, as the pull to the centre tells more than a swing.
    """
    guessed = unit.decision.sure == "guess"
    if unit.scale != 1.0 or unit.unit not in ("deg/s", *["rad/s"] * guessed):
        return None
    if guessed == (arm is not None and POSSIBLE[0] < arm < POSSIBLE[1]):
        return None
    seen = _swings(gyro)
    if seen is None:
        return None
    turns, share, stretch = seen
    if share < SHARE or (guessed and stretch < AT_A_STRETCH):
        return None
    why = f"in rad/s it makes {turns:.0f} turns, and what swings across the axis does so once a turn"
    if guessed:
        why = f"{why}; in deg/s it would turn by {360 * turns * UNITS['rad_s']['deg/s']:.0f} deg in all"
    elif arm is not None:
        why = f"{why}, and the pull to the centre is that of {1000 * arm:.3g} mm, although the header says deg/s"
    return Unit("rad/s", 1.0, Decision("gyroscope unit", "rad/s", "likely", why))


def swings_once_a_turn(gyro: Reading3) -> bool:
    """Tell whether rates (n, 3) across the axis swing once a turn of readings in rad/s, so that they are that."""
    seen = _swings(gyro)
    return seen is not None and seen[1] > SHARE


def _swings(gyro: Reading3) -> tuple[float, float, float] | None:
    """Return the turns of the longest fast stretch, what share of its swing is once a turn, and its share of the rows.

    Rates are read as rad/s. None where they do not turn steadily enough to tell.
    """
    size = np.linalg.norm(gyro.value, axis=1)
    sound = np.isfinite(size)
    if sound.sum() < ROWS:
        return None
    fast = np.concatenate([[False], sound & (size > 0.5 * np.percentile(size[sound], 99.5)), [False]])
    edges = np.flatnonzero(fast[1:] != fast[:-1]).reshape(-1, 2)
    first, last = edges[np.argmax(np.diff(edges, axis=1))]
    t, rate = gyro.t[first:last], gyro.value[first:last]
    if len(t) < ROWS or not np.all(np.diff(t) > 0):
        return None
    axis = rate.mean(axis=0)
    axis /= np.linalg.norm(axis)
    along = rate @ axis
    steps = 0.5 * (along[1:] + along[:-1]) * np.diff(t)
    turns = float(np.sum(steps)) / (2 * np.pi)
    if not turns > TURNS or np.any(steps <= 0) or len(t) < 2 * HIGHEST * turns:
        return None
    share = _once_a_turn(np.concatenate([[0.0], np.cumsum(steps)]), rate - along[:, None] * axis)
    return turns, share, len(t) / int(sound.sum())


def _once_a_turn(phase: FloatArray, across: FloatArray) -> float:
    """Return the share of the swing of vectors (n, 3) that is once a turn of a ``phase`` (n,) rad, to `BAND`."""
    even = np.linspace(0.0, phase[-1], len(phase))
    swing = np.column_stack([np.interp(even, phase, one) for one in across.T])
    x = np.linspace(-1.0, 1.0, len(even))
    swing -= np.polynomial.polynomial.polyval(x, np.polynomial.polynomial.polyfit(x, swing, 2)).T
    power = np.sum(np.abs(np.fft.rfft(swing * np.hanning(len(even))[:, None], axis=0)) ** 2, axis=1)
    a_turn = np.arange(len(power)) * 2 * np.pi / phase[-1]
    within = (a_turn > BAND[0]) & (a_turn < BAND[1])
    return float(power[within].sum() / max(float(power.sum()), 1e-300))
