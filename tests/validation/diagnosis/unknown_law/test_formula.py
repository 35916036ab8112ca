"""A fitted law as a formula: what no reading tells is none."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.validation.diagnosis.unknown_law.formula import as_sensor_laws
from discsim.validation.diagnosis.unknown_law.terms import SensorTerm
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import AllowedDefects, Parameter

TERM = SensorTerm("gyroscope", "drift", 1.5)
NUMBERS = {"0.z_rad_s.0": 0.02, "0.shape": 1.5}


def fitted(variance: float) -> Fit:
    """Return a fit whose drift of the gyroscope's z has a variance."""
    parameters = tuple(Parameter("term", name, 0.0, 1e-3, np.inf) for name in NUMBERS)
    at = np.array([*NUMBERS.values()])
    return Fit((), parameters, at, AllowedDefects(np.zeros(2)), {}, covariance=np.diag([variance, 0.01]))


def test_a_drift_that_readings_tell_is_a_law():
    (law,), words = as_sensor_laws([TERM], fitted(1e-6), None)
    assert law.target == "gyroscope.z_rad_s"
    assert law.coefficients["c"].value == pytest.approx(0.02)
    assert words.startswith("drift of the gyroscope, 1.5")


@pytest.mark.parametrize("variance", [np.nan, 0.0], ids=["a fit that ran away", "no reading of it"])
def test_what_no_reading_tells_is_no_law(variance: float):
    """Three real logs, of a plant that was not theirs, ended in a traceback here."""
    assert as_sensor_laws([TERM], fitted(variance), None) == ((), "")
