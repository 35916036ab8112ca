"""Whether the two numbers of a place were swapped: what a magnetometer reads, against the fields of both places."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import Recording
from discsim.validation.reporting.coordinates import coordinates
from discsim.validation.reporting.options import at_place

__all__ = ["field_read", "swapped_place"]

#: Sizes that differ by less than this share agree: a scale of 5 % over parts (LIS3MDL, BMM150) and 3 % of soft iron.
AGREES = 0.08
#: From this share on they contradict one another: twice that, and a hard iron of 2 uT that no turn took off.
CONTRADICTS = 0.2
#: Readings go round all axes where the least of the three spreads is this share of the largest: then they lie on a
#: sphere about the hard iron, known to about the noise over this share.
ALL_ROUND = 0.2
#: Fewest readings that show a size.
FEWEST = 16
#: Dips in degrees that differ by less agree (soft iron, an accelerometer's offset of 80 mg: 5 each); that differ by
#: more contradict one another: a hard iron of 20 uT turns a field of 45 by 26.
DIP_AGREES, DIP_CONTRADICTS = 10.0, 30.0


def swapped_place(
    place: str | None, day: str | None, recordings: Sequence[Recording], dip_deg: float | None = None
) -> str | None:
    """Return a warning where the field read contradicts that of ``--place`` and agrees with that of LON,LAT.

    Its size is compared, and where ``dip_deg`` is known, its dip below the horizon in degrees. None where nothing is
    stated, no magnetometer reads, or the fields of both are alike.
    """
    sizes = [size for one in recordings if "magnetometer" in one and (size := field_read(one)) is not None]
    if place is None or day is None or not sizes:
        return None
    found = coordinates(place)
    if found is None:
        return None
    other = f"{found[1]:g},{found[0]:g}"
    try:
        fields = [at_place(Environment(), one, day).magnetic_field for one in (place, other)]
    except InputError:  # the other is no place
        return None
    stated, swapped = (float(np.linalg.norm(field)) for field in fields)
    size = float(np.median(sizes))
    ask = "are latitude and longitude swapped? Expected LAT,LON, degrees north and east"
    if abs(size / stated - 1) >= CONTRADICTS and abs(size / swapped - 1) <= AGREES:
        return (
            f"WARNING: --place {place}: the field there is of {stated:.3g} uT, the magnetometer reads {size:.3g} uT, "
            f"as at --place {other} ({swapped:.3g} uT): {ask}"
        )
    here, there = (float(np.degrees(np.arcsin(field[2] / np.linalg.norm(field)))) for field in fields)
    if dip_deg is None or abs(size / swapped - 1) >= CONTRADICTS:
        return None
    if abs(dip_deg - here) < DIP_CONTRADICTS or abs(dip_deg - there) > DIP_AGREES:
        return None
    return (
        f"WARNING: --place {place}: the field there dips by {here:.0f} deg, at rest it dips by {dip_deg:.0f} deg, as "
        f"at --place {other} ({there:.0f} deg): {ask}"
    )


def field_read(recording: Recording) -> float | None:
    """Return the size of the field that a magnetometer reads, uT; None of too few readings.

    Where its readings go round all axes it is the radius of the sphere through them, else their median size, in which
    a hard iron is.
    """
    value: FloatArray = recording.samples["magnetometer"].value
    value = value[np.all(np.isfinite(value), axis=1)]
    if len(value) < FEWEST:
        return None
    centred = value - value.mean(axis=0)
    spread = np.sqrt(np.linalg.eigvalsh(centred.T @ centred / len(value)))
    if spread[0] > ALL_ROUND * spread[2]:
        design = np.column_stack([2 * centred, np.ones(len(value))])
        centre = np.linalg.lstsq(design, np.sum(centred**2, axis=1), rcond=None)[0]
        return float(np.sqrt(max(centre[3] + np.sum(centre[:3] ** 2), 0.0)))
    return float(np.median(np.linalg.norm(value, axis=1)))
