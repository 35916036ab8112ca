"""The ratio of inertias of a free spin that states no disc: a nuisance with a prior, or read off the wobble.

A free symmetric body turns its transverse rates in its own frame by (Izz/Ixx - 1) r. Of the inertias a free spin shows
their ratio alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.arrays import ComplexArray, FloatArray
from discsim.disc import Disc
from discsim.errors import InputError
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.driven import turning_of
from discsim.validation.diagnosis.signals.phase_regression import angle_turned, rate_of
from discsim.validation.identification.plants import plant_of

__all__ = ["with_inertia"]


#: Izz/Ixx of bare discs and how it spreads: golf discs and Ultimate discs as measured lie between 1.85 and 2
DISC, DISC_SD = 1.93, 0.05
#: how much faster or slower air may turn a wobble, rad/s: as the prior of a free spin's fit has it, one sigma
_AIR = 5.0
#: ratios that are tried: anything that a body may have, but for 0 and 1, where a force or a bias stands
_TRIED = np.concatenate([np.arange(0.05, 0.9501, 0.005), np.arange(1.05, 2.0501, 0.005)])
#: a wobble is read where it explains this share of the transverse rates
_READ = 0.5
#: and where the ratio is the same within this, with drifts beside it and without: a course of the wobble hides half a
#: radian of what it turns by, which is ten or more in a second
_ALIKE = 0.05
#: and a body tumbles, for which no ratio stands in, where they are this share of the spin
_TUMBLES = 0.3
#: stands in for the moment of inertia, kg m^2, mass, kg, and size, m, none of which a free spin shows
_IXX, _MASS, _DIAMETER = 6e-4, 0.175, 1.0


def with_inertia(recordings: Sequence[Recording]) -> tuple[list[Recording], list[str]]:
    """Return recordings of which each free spin has a disc, and what the reader must know of it.

    A recording without one takes that of another; without any the ratio of inertias is free within what bare discs
    have, or about what the wobble shows where that is none of a disc. Raises `InputError` where a body tumbles and its
    rates show no ratio.
    """
    if "disc" not in plant_of(recordings[0]).hardware or all(one.disc is not None for one in recordings):
        return list(recordings), []
    known = next((one.disc for one in recordings if one.disc is not None), None)
    if known is not None:
        note = "some recordings state no [disc]: that of the others is taken for them."
        return [one if one.disc is not None else replace(one, disc=known) for one in recordings], [note]
    ratio, sd, note = _ratio(recordings)
    disc = Disc(_MASS, _DIAMETER, _IXX, ratio * _IXX, sigma={"Izz_kg_m2": sd * _IXX})
    return [replace(one, disc=disc) for one in recordings], [note]


def _ratio(recordings: Sequence[Recording]) -> tuple[float, float, str]:
    """Return Izz/Ixx, how well it is known, and that in words."""
    read = [found for one in recordings if (found := _wobble(one)) is not None]
    told = [(ratio, air) for ratio, air, share, _ in read if share > _READ]
    tumbling = [size for _, _, share, size in read if share <= _READ and size > _TUMBLES]
    if len(tumbling) > len(told):
        turning = turning_of(recordings, [one.name for one in recordings]).sentences
        raise InputError(
            f"{recordings[0].path or recordings[0].name}: a free spin without [disc] whose transverse rates "
            f"({100.0 * float(np.median(tumbling)):.0f} % of the spin) are not the wobble of one symmetric body; add "
            "[disc] with Ixx_kg_m2 and Izz_kg_m2 to recording.toml, or import the rows of the free spin alone "
            "(--throw N, or --rows A:B)" + "".join(f". {sentence.rstrip('.')}" for sentence in turning)
        )
    if told:
        ratio, air = (float(x) for x in np.median(told, axis=0))
        if abs(ratio - DISC) > 4.0 * float(np.hypot(DISC_SD, air)):
            note = f"no [disc] is stated: Izz/Ixx is fitted, from {ratio:.3f} ± {air:.3f} as the wobble shows it."
            return min(ratio, 2.0), air, note
    note = f"no [disc] is stated: Izz/Ixx is fitted, with the prior {DISC:g} ± {DISC_SD:g} of a bare disc."
    return DISC, DISC_SD, note


def _wobble(recording: Recording) -> tuple[float, float, float, float] | None:
    """Return the ratio that a gyroscope's transverse rates turn by, its error by air, the share that it explains.

    Last is the size of the transverse rates over the spin. None without a gyroscope that shows all three rates.
    """
    samples, known = recording.get("gyroscope"), rate_of(recording)
    if samples is None or known is None:
        return None
    good = np.isfinite(samples.value).all(axis=1)
    if np.count_nonzero(good) < 4 * _FEWEST:
        return None
    t, w = samples.t[good], samples.value[good]
    y, spin = w[:, 0] + 1j * w[:, 1], float(np.median(np.abs(known[2])))
    size = float(np.sqrt(np.mean(np.abs(y) ** 2))) / max(spin, 1e-9)
    psi = angle_turned(recording, t)
    x = (t - t.mean()) / max(0.5 * (t[-1] - t[0]), 1e-9)
    course = np.vander(x, 3).astype(complex)
    turning = np.exp(-1j * psi)
    # what stands still in the body, and what stands still beside it
    ratio, share = _best(np.column_stack([np.ones_like(y), turning]), course, psi, y)
    # what drifts there turns as a wobble of a ratio near 1 or 0 does, which is none beside such drifts
    if share > _READ:
        beside, _ = _best(np.column_stack([course, course * turning[:, None]]), course, psi, y)
        share = share if abs(ratio - beside) < _ALIKE else 0.0
    return ratio, _AIR / max(spin, 1e-9), share, size


def _best(still: ComplexArray, course: ComplexArray, psi: FloatArray, y: ComplexArray) -> tuple[float, float]:
    """Return the ratio at which a wobble of a slow ``course`` (n, k) explains most of y (n,), and the share of it.

    ``still`` (n, m) is what else may be there, and ``psi`` (n,) the angle turned, rad.
    """
    before = _left(still, y)
    after = [_left(np.column_stack([still, course * np.exp(1j * (one - 1.0) * psi)[:, None]]), y) for one in _TRIED]
    best = int(np.argmin(after))
    return float(_TRIED[best]), 1.0 - after[best] / before if before > 0.0 else 0.0


#: fewest readings per number that is fitted to them
_FEWEST = 6


def _left(columns: ComplexArray, y: ComplexArray) -> float:
    """Return the squares of y (n,) that columns (n, k) leave."""
    solution, *_ = np.linalg.lstsq(columns, y, rcond=None)
    return float(np.sum(np.abs(y - columns @ solution) ** 2))
