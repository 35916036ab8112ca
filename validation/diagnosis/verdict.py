"""From a search to its verdict: explained, consistent or unexplained, and what is recalibrated."""

from __future__ import annotations

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import aero_key
from discsim.effects.catalogue import CATALOGUE
from validation.diagnosis.result import (
    Recalibration,
    Verdict,
)
from validation.diagnosis.selection.constrained_fit import Tied
from validation.diagnosis.selection.found import Search, misses
from validation.identification.residual_tests import remainders

__all__ = ["RECALIBRATED_NAMES", "standard_errors"]


RECALIBRATED_NAMES = {
    ("disc", "mass"): "mass_kg",
    ("disc", "d"): "diameter_m",
    ("disc", "Ixx"): "Ixx_kg_m2",
    ("disc", "Izz"): "Izz_kg_m2",
    ("rig", "Izz"): "Izz_kg_m2",
    ("rig", "viscous"): "viscous_N_m_s",
    ("environment", "air_density"): "air_density_kg_m3",
    ("environment", "gravity"): "gravity_m_s2",
}


def verdict_of(found: Search) -> tuple[Verdict, bool]:
    """Return the verdict, and whether something is left that is not noise."""
    final = found.final
    left = remainders(final.fit.linears, final.residuals, final.fit.noise)
    plant = found.loose.plant
    left = [item for item in left if item.kind != "window" or item.from_s > plant.durations.settled]
    if left or misses(found, final):
        return "unexplained", True
    if final.hypothesis.trials:
        return "explained", False
    moved = any(item.beyond for item in recalibrations(found).values())
    return ("recalibrated" if moved else "consistent"), False


def recalibrations(found: Search) -> dict[str, Recalibration]:
    """Return the stated numbers that may move, and where the recordings move them."""
    fit = found.final.fit
    sd = standard_errors(found.final)
    result = {}
    for q, value, error in zip(fit.parameters, fit.at, sd, strict=True):
        if (
            q.key in fit.plant.own_keys
            or q.group in CATALOGUE
            or not any(q.key == p.key and q.recordings == p.recordings for p in found.own)
        ):
            continue
        if q.group == "disc" and found.recordings[0].disc is None:
            continue  # it stands for a ratio that nobody stated
        sigma = next(p.sigma for p in found.own if q.key == p.key and q.recordings == p.recordings)
        name = aero_key(q.name) if q.group == "aero" else RECALIBRATED_NAMES.get(q.key, f"{q.group}.{q.name}")
        if q.recordings is not None:
            name = f"{name} ({','.join(str(i + 1) for i in sorted(q.recordings))})"
        result[name] = Recalibration(q.stated, sigma, float(value), float(error))
    return result


def standard_errors(tied: Tied) -> FloatArray:
    """Return the standard errors (p,) of a fit's parameters, NaN where it has no covariance."""
    covariance = tied.fit.covariance
    if covariance.shape[0] != len(tied.fit.parameters):
        return np.full(len(tied.fit.parameters), np.nan)
    return np.sqrt(np.maximum(np.diag(covariance), 0.0))
