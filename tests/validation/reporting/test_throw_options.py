"""A throw and a wind as people say them on the command line."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.environment import Environment
from discsim.errors import InputError
from discsim.launch import launch_of
from discsim.shipped import load_throw
from discsim.validation.reporting.options import at_wind, throw_as_said

THROW = load_throw("driver")


def test_what_is_said_of_a_throw_takes_the_place_of_its_own_and_the_rest_stays():
    words = launch_of(throw_as_said(THROW, {"speed": 26.0, "launch": 12.0, "spin": 900.0, "hyzer": None}))
    own = launch_of(THROW)
    assert words.speed == pytest.approx(26.0)
    assert np.degrees(words.launch) == pytest.approx(12.0)
    assert words.spin == pytest.approx(900.0 / 60.0 * 2 * np.pi)
    assert (words.hyzer, words.nose, words.height) == pytest.approx((own.hyzer, own.nose, own.height))
    assert throw_as_said(THROW, {"speed": None}) is THROW


def test_a_wind_blows_from_where_it_is_said_to_come_from():
    np.testing.assert_allclose(at_wind(Environment(), "3,270").wind, [0.0, 3.0, 0.0], atol=1e-12)  # from the west
    np.testing.assert_allclose(at_wind(Environment(), "2,0").wind, [-2.0, 0.0, 0.0], atol=1e-12)  # a head wind


@pytest.mark.parametrize("text", ["3", "3,west", "-1,0", "99,0", "nan,0"])
def test_what_is_no_wind_is_refused(text):
    with pytest.raises(InputError, match="--wind"):
        at_wind(Environment(), text)
