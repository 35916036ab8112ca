"""Ordinary errors of parts stand in one table, each with its source, and nowhere else."""

from __future__ import annotations

import pytest

from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import AccelerometerBias, HardIron
from discsim.estimators.precession import HARD_IRON_SD
from discsim.estimators.tracking import TrackingSettings
from discsim.validation.diagnosis.relaxed_fit.parameters import ordinary
from discsim.validation.identification.ordinary_errors import ordinary_errors, ordinary_sigma

IRON = catalogued(HardIron).id


def test_a_relaxed_fit_allows_for_the_errors_of_the_table_in_its_order():
    errors = ordinary_errors("relaxed fit")
    free = ordinary({"magnetometer", "accelerometer", "gyroscope"}, "flight")
    kept = [error for error in errors if not error.effect.startswith("rig.")]
    assert [(q.group, q.name, q.sigma) for q in free] == [(e.effect, e.name, e.sigma) for e in kept]
    assert [e.sigma for e in errors if e.effect == catalogued(AccelerometerBias).id] == [1.0, 1.0, 1.0]


def test_each_ordinary_error_says_where_it_is_from():
    assert all(len(error.source) > 20 for error in ordinary_errors("relaxed fit"))


@pytest.mark.parametrize(
    ("use", "taken"),
    [("discsim.estimators.precession", HARD_IRON_SD), ("discsim.estimators.tracking", TrackingSettings().hard_iron)],
)
def test_the_estimators_take_the_iron_that_the_table_says(use, taken):
    assert {error.effect for error in ordinary_errors(use)} == {IRON}
    assert ordinary_sigma(use) == taken
