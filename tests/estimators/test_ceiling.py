"""A gyroscope's limit behind which noise is added or a filter sits, and sound gyroscopes that only look like one."""

from __future__ import annotations

import numpy as np
import pytest

import discsim
from discsim.errors import InputError
from discsim.estimators.ceiling import ceiling
from discsim.estimators.methods import best

T = np.arange(0.0, 3.0, 0.005)
FIELD_T = np.arange(0.0, 3.0, 0.01)


def seen(rate_deg_s, limit_deg_s, noise, seed, *, plant="free_spin", field=True, lag=0.0):
    """A gyroscope at 200 Hz with its limit first, then a low-pass of ``lag`` s and noise, rad/s; a field at 100 Hz."""
    rng = np.random.default_rng(seed)
    rate = np.radians(rate_deg_s(T))
    z = np.clip(rate, -np.radians(limit_deg_s), np.radians(limit_deg_s))
    for i in range(1, z.size):
        z[i] = z[i - 1] + (1.0 - np.exp(-0.005 / lag) if lag else 1.0) * (z[i] - z[i - 1])
    gyroscope = np.column_stack([0.0 * T, 0.0 * T, z]) + rng.normal(0.0, noise, (T.size, 3))
    told = {"gyroscope": (T, gyroscope)}
    if field:
        psi = np.interp(FIELD_T, T, np.cumsum(rate) * 0.005)
        m = np.column_stack([25.0 * np.cos(psi), -25.0 * np.sin(psi), np.full(psi.size, 40.0)])
        told["magnetometer"] = (FIELD_T, m + rng.normal(0.0, 0.6, m.shape))
    return discsim.recording_from_arrays(told, plant=plant)


def slowing(t):
    return 4200.0 - 240.0 * t


def through(t):
    return 2300.0 - 200.0 * t


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [0.002, 0.02, 0.2])
@pytest.mark.parametrize("lag", [0.0, 0.02])
@pytest.mark.parametrize("rate", [slowing, through])
@pytest.mark.parametrize("field", [True, False])
def test_a_limit_with_noise_or_a_filter_behind_it_is_seen(rate, field, lag, noise, seed):
    found = ceiling(seen(rate, 2000.0, noise, seed, field=field, lag=lag))
    assert found is not None
    assert np.degrees(found.level) == pytest.approx(2000.0, abs=10.0)


@pytest.mark.parametrize("limit", [500.0, 1000.0])
@pytest.mark.parametrize("plant", ["free_spin", "rate_table"])
def test_the_field_tells_a_limit_on_a_table_and_of_a_lower_range(plant, limit):
    assert ceiling(seen(lambda t: 1700.0 + 0.0 * t, limit, 0.02, 1, plant=plant)) is not None


def test_the_field_is_believed_and_the_limit_is_no_rate():
    """`best` told 2000 deg/s with a deviation of 1 without a field, and no sensor was right beside one."""
    found = best(seen(slowing, 2000.0, 0.02, 1))
    assert found.method == "fusion"
    np.testing.assert_allclose(np.degrees(found.rate), slowing(found.t), atol=5.0)
    with pytest.raises(InputError, match="z stands at its limit in every reading"):
        best(seen(slowing, 2000.0, 0.02, 1, field=False))
    assert best(seen(through, 2000.0, 0.02, 1, field=False)).median.beyond


SOUND = {
    "slows through a full scale": lambda t: 2060.0 - 40.0 * t,
    "slows hardly": lambda t: 2010.0 - 20.0 * t,
    "the other way": lambda t: 40.0 * t - 2000.0,
    "at a lower full scale": lambda t: 1000.0 + 0.0 * t,
    "steady": lambda t: 1873.0 + 0.0 * t,
}
TABLES = {
    "steady at a full scale": lambda t: 2000.0 + 0.0 * t,
    "a ramp to a full scale": lambda t: np.minimum(2000.0, 2000.0 * t),
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("noise", [0.002, 0.02, 0.2])
@pytest.mark.parametrize("field", [True, False])
def test_a_sound_gyroscope_has_no_such_limit(field, noise, seed):
    for name, rate in SOUND.items():
        assert ceiling(seen(rate, 4000.0, noise, seed, field=field)) is None, name
    for name, rate in (SOUND | TABLES).items():
        assert ceiling(seen(rate, 4000.0, noise, seed, field=field, plant="rate_table")) is None, name


@pytest.mark.parametrize("seed", range(3))
def test_a_field_that_turns_alike_clears_a_steady_spin_at_a_full_scale(seed):
    for name, rate in TABLES.items():
        assert ceiling(seen(rate, 4000.0, 0.02, seed)) is None, name
