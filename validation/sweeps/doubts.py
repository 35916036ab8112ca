"""What is odd in what a sweep's plan names: profiles by other names, rates no table turns, flights that cannot be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discsim.environment import Environment
from discsim.rate_tables import RateTable
from discsim.recording import Samples
from discsim.validation.checking.statements import unlikely_flight
from discsim.validation.scenarios.profile_files import Profile, read_knots, speed_note

if TYPE_CHECKING:
    from discsim.validation.sweeps.plan import Axis

__all__ = ["plan_notes"]

#: plateaus that are slower than this altogether, deg/s, are doubted: a thrown disc turns ten times as fast, and as many
#: rad/s are 6900 deg/s
SLOW_DEG_S = 120.0


def plan_notes(axes: Sequence[Axis], stated: Samples | None, folder: Path) -> tuple[str, ...]:
    """Return what is odd, a line each; ``stated`` is the profile of [truth], ``folder`` that of the plan."""
    named = {axis.name: axis for axis in axes}
    notes: list[str] = [] if stated is None else [*_of_rates(stated)]
    for text in named["profile"].values if "profile" in named else ():
        profile = read_knots(folder / str(text))
        notes += [*profile.notes, *filter(None, [speed_note(profile, RateTable(), f"profile {text}")])]
    for name in ("disc", "throw"):
        axis = named.get(name)
        for text, loaded in [] if axis is None else zip(map(str, axis.values), axis.loaded, strict=True):
            said = unlikely_flight(*loaded) if name == "disc" else unlikely_flight(None, Environment(), loaded)
            notes += [f"{name} {text}: {one}" for one in said]
    return tuple(notes)


def _of_rates(stated: Samples) -> Iterator[str]:
    """Yield what is odd about plateaus that a plan states in deg/s."""
    fast = speed_note(Profile(stated, in_radians=False), RateTable(), "truth.rates_deg_s")
    if fast is not None:
        yield fast
    most = float(np.degrees(np.abs(stated.value).max()))
    if most <= SLOW_DEG_S:
        yield (
            f"truth.rates_deg_s reaches {most:.4g} deg/s only, slower than any throw; were rad/s meant? "
            f"Then it is {np.degrees(most):.4g}"
        )
