"""A disc that spins slowly is tipped faster by the air: what a magnetometer alone says of its spin must hold that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from discsim.estimators.methods import estimate
from discsim.estimators.precession import MOMENT, tipping
from discsim.frames import to_body
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_site
from discsim.trajectory import predict
from discsim.validation.scenarios.throws import Throw

SITE = load_site("seoul").environment
DISCS = ("driver", "fd2", "ultrastar", "cd1")
THROWS = 24
#: once in 1000 times normal errors of 24 throws, one instant of each, lie above this in units of their deviation
MOST = float(np.sqrt(chi2.ppf(1 - 1e-3, THROWS) / THROWS))  # 1.46


@pytest.fixture(scope="module")
def thrown():
    """Recordings of a magnetometer alone, and the true rate, rad/s, a second after the release."""
    module = Instruments.from_parts("mpu9250")
    made = []
    for number in range(2 * THROWS):
        rng = np.random.default_rng([number, 17])
        disc, air = load_disc(DISCS[number % len(DISCS)])
        release = Throw(rng.uniform(16, 26), rng.uniform(0, 360), rng.uniform(1200, 2200)).release
        environment = replace(air, magnetic_field=SITE.magnetic_field)
        motion = predict(disc, environment, release, duration=2.0).motion()
        if len(made) == THROWS or motion.end < 2.0:
            continue  # it was on the ground before
        whole = record(motion, module, rng, plant="flight", name="slow", disc=disc)
        one = replace(whole, samples={"magnetometer": whole.need("magnetometer")})
        made.append((one, float(np.interp(1.0, motion.t, motion.rate[:, 2]))))
    assert len(made) == THROWS
    return made


def turning_across(number: int, spin: float) -> list[float]:
    """Spin times the turning of the axis across the field, rad^2/s^2, means over 1.28 s of one throw."""
    rng = np.random.default_rng([number, 18])
    disc, air = load_disc(DISCS[number % len(DISCS)])
    release = Throw(rng.uniform(12, 27), rng.uniform(0, 360), spin).release
    motion = predict(disc, air, release, duration=3.0).motion()
    x, y, _ = to_body(motion.attitude, np.broadcast_to(SITE.magnetic_field, (motion.t.size, 3))).T
    p, q, r = motion.rate.T
    across = (p * y - q * x) / np.hypot(x, y) * r
    middles = np.arange(0.65, motion.end - 0.65, 0.6)
    return [float(np.mean(across[np.abs(motion.t - middle) < 0.64])) for middle in middles]


@pytest.mark.parametrize("spin", [1500.0, 3000.0, 6000.0])
def test_the_axis_turns_by_the_airs_moment_over_the_spin(spin):
    """30 throws of a few windows alike each: their rms scatters by a fifth, twice that is allowed."""
    found = [one for number in range(30) for one in turning_across(number, spin)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(MOMENT, rel=0.4)


@pytest.mark.parametrize("method", ["fft", "likelihood", "tracking"])
def test_a_slow_throw_is_within_the_stated_deviation(thrown, method):
    errors = []
    for recording, truth in thrown:
        rate = estimate(recording, method)
        known = np.isfinite(rate.rate)
        if not known.any():
            continue  # silent is no error
        index = np.flatnonzero(known)[np.argmin(np.abs(rate.t[known] - 1.0))]
        errors.append((abs(rate.rate[index]) - truth) / rate.sd[index])
    assert len(errors) >= 0.75 * THROWS
    assert np.sqrt(np.mean(np.square(errors))) < MOST


def test_an_axis_tips_as_the_inverse_of_the_spin():
    """From the least that is expected at any spin on, to that of the slowest that flies."""
    np.testing.assert_allclose(tipping(0.08, [160.0, -40.0, 20.0, 1.0]), [0.08, MOMENT / 40, MOMENT / 20, MOMENT / 15])
