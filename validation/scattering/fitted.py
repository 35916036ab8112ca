"""Coefficients with their covariance from what `discsim fit` wrote."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from discsim.errors import InputError
from discsim.files import read_text
from discsim.validation.scattering.inputs import Fitted

__all__ = ["read_fitted"]


def read_fitted(place: Path) -> Fitted:
    """Read cnr.json, or that of a folder; without a covariance in it its numbers count as independent.

    Raises `InputError` where it is not what `discsim fit` writes.
    """
    path = place / "cnr.json" if place.is_dir() else place
    try:
        content = json.loads(read_text(path))
        found = {"CNr": content["CNr"], **content.get("refined", {})}
        names = tuple(found)
        value = np.array([float(item["value"]) for item in found.values()])
        sd = np.array([float(item["sd"]) for item in found.values()])
        told = content.get("covariance")
        covariance = np.diag(sd**2) if told is None else np.array(told["matrix"], dtype=float)
        if told is not None and tuple(told["names"]) != names:
            raise ValueError("names")
        if covariance.shape != (len(names), len(names)) or not np.all(np.isfinite([*value, *covariance.ravel()])):
            raise ValueError("covariance")
    except (ValueError, TypeError, KeyError, AttributeError):
        raise InputError.at(path, None, "holds no fit; expected the cnr.json that discsim fit wrote") from None
    return Fitted(names, value, covariance, str(path))
