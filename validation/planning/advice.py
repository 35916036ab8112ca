"""What would tell more: the next recordings, and what better parts, faster sensors and wider ranges buy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from discsim.recording import SENSORS
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.readings import group_of
from discsim.validation.planning.information import Information, information_of
from discsim.validation.planning.limits import Limits, coefficients_of, limits_of
from discsim.validation.planning.recordings import Bench, planned_trajectory

__all__ = ["Bought", "NextThrow", "bought", "next_throws"]

#: what is asked of a sensor: its noise by half, and its rate doubled, which is as noise over the root of two where the
#: noise is white and the motion slow beside the samples
_HALF, _DOUBLE_RATE = 0.5, 1.0 / np.sqrt(2.0)
#: noise that leaves a sensor without a say
_ABSENT = 1e6


class NextThrow(NamedTuple):
    """A recording that could be added: by what it divides sds and sizes.

    ``coefficients`` is the factor for the geometric mean of the coefficients' sds with all of them free (D-optimal:
    the largest is the best), ``CNr`` that for C_Nr, ``effects`` that for the sizes that are named, ``pairs`` that for
    the sizes at which the closest pairs are told apart.
    """

    text: str
    coefficients: float
    CNr: float
    effects: float
    pairs: float


class Bought(NamedTuple):
    """A change of the hardware: by what it divides the sd of C_Nr and the sizes of effects that are named.

    ``most`` is the effect that it helps most, ``by`` the factor there. NaN where the change makes all unknown.
    """

    text: str
    CNr: float
    effects: float
    most: str
    by: float


def next_throws(information: Information, limits: Limits, plans: Sequence[Plan], bench: Bench) -> list[NextThrow]:
    """Return what each further recording would tell, the D-optimal first; those that cannot be made are left out."""
    found = []
    before = coefficients_of(information)
    for plan in plans:
        made = planned_trajectory(plan, bench)
        if made is None:
            continue
        gram = information_of([made], information.questions, information.noise).grams[0]
        more = information.plus(gram)
        after = limits_of(more)
        now = coefficients_of(more)
        ratios = [b.together / a.together for a, b in zip(now, before, strict=True) if np.isfinite(b.together)]
        CNr = [b.together / a.together for a, b in zip(now, before, strict=True) if b.name == "CNr"]
        found.append(
            NextThrow(
                plan.text,
                float(np.exp(np.mean(np.log(ratios)))) if ratios else np.nan,
                CNr[0] if CNr else np.nan,
                _ratio(limits, after),
                _apart(limits) / _apart(after) * _ratio(limits, after),
            )
        )
    return sorted(found, key=lambda one: -(one.coefficients if np.isfinite(one.coefficients) else one.effects))


def _apart(limits: Limits) -> float:
    """Return the geometric mean of what the pairs need beyond the size that is named; 1 where all are told apart."""
    sizes = [pair.apart for pair in limits.pairs if np.isfinite(pair.apart)]
    return float(np.exp(np.mean(np.log(sizes)))) if sizes else 1.0


def _sizes(limits: Limits) -> dict[tuple[str, str], float]:
    return {
        (one.id, name): size for one in limits.effects for name, size in zip(one.parameters, one.named, strict=True)
    }


def _ratios(before: Limits, after: Limits) -> dict[tuple[str, str], float]:
    """Return by what sizes are divided, of those that are finite before and after."""
    old, new = _sizes(before), _sizes(after)
    return {key: old[key] / new[key] for key in old if np.isfinite(old[key]) and np.isfinite(new.get(key, np.inf))}


def _ratio(before: Limits, after: Limits) -> float:
    ratios = list(_ratios(before, after).values())
    return float(np.exp(np.mean(np.log(ratios)))) if ratios else np.nan


def bought(information: Information, limits: Limits, others: Sequence[tuple[str, Information]] = ()) -> list[Bought]:
    """Return what each sensor's noise by half, its rate doubled and its absence change, and what other parts do.

    ``others`` are the same recordings with other parts, by what they are called.
    """
    groups: dict[str, list[str]] = {}
    for name in information.noise:
        sensor = next(s for s in SENSORS if name in {group_of(s, axis) for axis in range(6)})
        groups.setdefault(sensor, []).append(name)
    variants = list(others)
    for sensor, names in groups.items():
        for text, factor in ((f"{sensor} with half the noise", _HALF), (f"{sensor} twice as fast", _DOUBLE_RATE)):
            variants.append((text, information.quieter(dict.fromkeys(names, factor))))
        if len(groups) > 1:
            variants.append((f"no {sensor}", information.quieter(dict.fromkeys(names, _ABSENT))))
    return [_bought(text, information, limits, other) for text, other in variants]


def _bought(text: str, information: Information, limits: Limits, other: Information) -> Bought:
    CNr = [
        before.together / after.together
        for before, after in zip(coefficients_of(information), coefficients_of(other), strict=True)
        if before.name == "CNr"
    ]
    ratios = _ratios(limits, limits_of(other))
    # what a sensor's absence hides counts for nothing seen, however large
    sensible = {key: ratio for key, ratio in ratios.items() if ratio > 1e-3}
    most = max(sensible, key=lambda key: abs(np.log(sensible[key])), default=("", ""))
    mean = float(np.exp(np.mean(np.log(list(sensible.values()))))) if sensible else np.nan
    return Bought(text, CNr[0] if CNr else np.nan, mean, most[0], sensible.get(most, np.nan))
