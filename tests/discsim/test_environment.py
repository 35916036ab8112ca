"""The Earth's field against the published test values of its models, and what has no field."""

from __future__ import annotations

from datetime import date, timedelta

import numpy as np
import pytest

from discsim.environment import Environment, world_magnetic_field
from discsim.errors import InputError

# NOAA NCEI and BGS, test values published with the models WMM2020 and WMM2025:
# year, height km, latitude deg, longitude deg, north nT, east nT, down nT
PUBLISHED = [
    (2020, 0, 80, 0, 6570.4, -146.3, 54606.0),
    (2020, 0, 0, 120, 39624.3, 109.9, -10932.5),
    (2020, 0, -80, 240, 5940.6, 15772.1, -52480.8),
    (2020, 100, 80, 0, 6261.8, -185.5, 52429.1),
    (2020, 100, 0, 120, 37636.7, 104.9, -10474.8),
    (2020, 100, -80, 240, 5744.9, 14799.5, -49969.4),
    (2025, 0, 80, 0, 6521.6, 145.9, 54791.5),
    (2025, 0, 0, 120, 39677.8, -109.6, -10580.2),
    (2025, 0, -80, 240, 6117.5, 15751.9, -52022.5),
    (2025, 100, 80, 0, 6216.0, 92.4, 52598.8),
    (2025, 100, 0, 120, 37688.6, -96.2, -10152.1),
    (2025, 100, -80, 240, 5907.6, 14780.3, -49540.7),
]


@pytest.mark.parametrize("row", PUBLISHED, ids=lambda row: "-".join(map(str, row[:4])))
def test_the_field_is_the_published_one(row):
    """Tolerance: half a unit of the last digit printed, 0.05 nT."""
    year, height_km, latitude, longitude, *nT = row
    field = world_magnetic_field(latitude, longitude, date(year, 1, 1), height_km * 1000.0)
    np.testing.assert_allclose(1000.0 * field, nT, rtol=0, atol=0.0501)


def test_the_field_changes_by_the_secular_variation_within_an_epoch():
    """WMM2025 at 2027.5 on the ground at 80 N, 0 E: published 6500.8, 294.5, 54869.4 nT.

    2 July 2027 is 2027.498 here; at up to 60 nT a year that is 0.12 nT, and half a unit of the last digit adds 0.05.
    """
    field = world_magnetic_field(80.0, 0.0, date(2027, 7, 2))
    np.testing.assert_allclose(1000.0 * field, [6500.8, 294.5, 54869.4], rtol=0, atol=0.2)


@pytest.mark.parametrize("year", [2015, 2020, 2025])
def test_the_field_hardly_jumps_where_one_model_follows_another(year):
    """Each model states 0.15 uT (one sigma) per component, so a difference is sqrt(6) 0.15 = 0.37 uT long."""
    before = world_magnetic_field(47.0, 8.0, date(year, 1, 1) - timedelta(days=1))
    after = world_magnetic_field(47.0, 8.0, date(year, 1, 1))
    assert 0.0 < np.linalg.norm(after - before) < 0.37


def test_longitude_may_be_counted_either_way():
    day = date(2024, 6, 1)
    np.testing.assert_allclose(world_magnetic_field(10, -120, day), world_magnetic_field(10, 240, day), rtol=1e-12)


@pytest.mark.parametrize(
    ("latitude", "longitude", "day", "height", "says"),
    [
        (90.1, 0, date(2024, 1, 1), 0, r"no place at latitude 90\.1 deg.*expected -90 to 90"),
        (0, 361, date(2024, 1, 1), 0, r"longitude 361 deg; expected .*-180 to 360"),
        (float("nan"), 0, date(2024, 1, 1), 0, "no place at latitude nan deg"),
        (0, 0, date(2009, 12, 31), 0, r"no world magnetic model for 2009-12-31; expected a day from 2010-01-01 to"),
        (0, 0, date(2030, 1, 1), 0, r"no world magnetic model for 2030-01-01; expected .* 2029-12-31"),
        (0, 0, date(2024, 1, 1), 9e5, r"no field model at 900000 m.*expected -10 km to 850 km"),
        (0, 0, date(2024, 1, 1), float("nan"), r"no field model at nan m"),
    ],
)
def test_a_place_or_day_without_a_model_is_refused(latitude, longitude, day, height, says):
    with pytest.raises(InputError, match=says):
        world_magnetic_field(latitude, longitude, day, height)


def test_the_first_and_the_last_day_have_a_field():
    for day in (date(2010, 1, 1), date(2029, 12, 31)):
        assert 25.0 < np.linalg.norm(world_magnetic_field(47.0, 8.0, day)) < 65.0  # the Earth's range, uT


@pytest.mark.parametrize("field", [[1.0, 2.0], [1.0, 2.0, np.nan], 3.0])
def test_an_environment_has_three_finite_components(field):
    with pytest.raises(ValueError, match=r"magnetic field .*expected three finite numbers"):
        Environment(magnetic_field=field)
    with pytest.raises(ValueError, match=r"wind .*expected three finite numbers"):
        Environment(wind=field)
