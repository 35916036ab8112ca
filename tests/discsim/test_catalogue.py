"""Rows of the catalogue: every one says what a reader and a fit must know, of parameters that it has."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.effects import CATALOGUE
from discsim.effects.kind import EVERYWHERE


@pytest.mark.parametrize("row", CATALOGUE.values(), ids=lambda row: row.id)
def test_a_row_tells_a_reader_its_name_its_form_and_its_trace(row):
    assert row.title
    assert row.form
    assert row.grows_with
    assert row.trace
    assert row.trace[0].islower()
    assert not row.trace.endswith(".")


@pytest.mark.parametrize("row", CATALOGUE.values(), ids=lambda row: row.id)
def test_rules_for_a_fit_are_of_parameters_that_the_effect_has(row):
    assert {*row.units, *row.positive} <= set(row.parameters)
    assert {*row.bounds, *row.sign, *row.grid, *row.grid_sigma} <= set(row.fitted)
    assert len(row.scale) == len(row.parameters)
    assert list(row.fitted_scale) == list(row.fitted)
    assert all(np.isfinite(none) for none in row.fitted.values()) or row.detector
    assert set(row.plants) <= set(EVERYWHERE)
    assert set(row.unseen_on) < set(row.plants) | {""}


@pytest.mark.parametrize("row", [row for row in CATALOGUE.values() if row.bounds], ids=lambda row: row.id)
def test_bounds_hold_the_sign_and_the_values_that_are_tried_first(row):
    for name, (low, high) in row.bounds.items():
        assert low < high
        assert all(low < value < high for value in row.grid.get(name, ()))
        assert max(row.sign.get(name, 1.0) * bound for bound in (low, high)) > 0.0


def test_what_only_moves_time_has_one_number():
    """A slope in time by one column: what moves instants otherwise would need more."""
    moving = [row for row in CATALOGUE.values() if row.moves_time]
    assert len(moving) == 11
    assert all(len(row.parameters) == 1 for row in moving)
