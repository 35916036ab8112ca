"""Noise and digits of sensors: their level, their memory, and the steps in which readings are written."""

from __future__ import annotations

import numpy as np
import pytest
from support.readings import FAST, FLIGHT, IMU, MAG, WRITTEN, measured, rng
from support.turning import turning

from discsim.effects.sensors import (
    AccelerometerBias,
    AccelerometerSaturation,
    ClockRate,
    PositionOffset,
    Scale,
)
from discsim.errors import InputError
from discsim.sensors import Accelerometer, Magnetometer, Noise, Sampling


class TestNoise:
    t = np.arange(4000) * 5e-3
    wide = 50

    def test_white_noise_has_its_rms_and_no_memory(self):
        """4 sigma over 200 000 values: rms to 0.6 %, correlation of neighbours to 0.009."""
        x = Noise(white=0.6).sample(self.t, self.wide, rng())
        n = x.size
        assert np.sqrt(np.mean(x**2)) == pytest.approx(0.6, rel=4 / np.sqrt(2 * n))
        assert abs(np.mean(x[1:] * x[:-1])) < 0.36 * 4 / np.sqrt(n)

    def test_correlated_noise_has_its_rms_and_forgets_over_its_time(self):
        """exp(-lag/tau). 50 series of 20 s hold 50 x 20/(2 x 0.05) = 10 000 independent values: 4 sigma are 4 %."""
        x = Noise(correlated=2.0, correlation_s=0.05).sample(self.t, self.wide, rng())
        assert np.mean(x**2) == pytest.approx(4.0, rel=4 * np.sqrt(2 / 10000))
        for samples in (1, 5, 10, 30):
            correlation = np.mean(x[samples:] * x[:-samples]) / np.mean(x**2)
            assert correlation == pytest.approx(np.exp(-samples * 5e-3 / 0.05), abs=0.04)

    def test_correlated_noise_is_stationary_from_its_first_value(self):
        """4 sigma of the variance of 20 000 first values."""
        x = Noise(correlated=2.0, correlation_s=0.05).sample(self.t[:2], 20000, rng())
        np.testing.assert_allclose(np.mean(x**2, axis=1), 4.0, rtol=4 * np.sqrt(2 / 20000))

    def test_correlated_noise_forgets_over_the_time_that_passed_not_the_samples(self):
        x = Noise(correlated=1.0, correlation_s=0.05).sample(np.array([0.0, 0.005, 0.105]), 20000, rng())
        correlation = np.mean(x[1] * x[2])
        assert correlation == pytest.approx(np.exp(-2.0), abs=4 / np.sqrt(20000))

    def test_a_walking_bias_grows_with_the_root_of_time(self):
        """rms walk sqrt(t), from zero; 4 sigma of the variance of 20 000 walks."""
        t = np.array([0.0, 0.1, 0.4, 1.6, 6.4])
        x = Noise(walk=0.3).sample(t, 20000, rng())
        np.testing.assert_array_equal(x[0], 0.0)
        np.testing.assert_allclose(np.var(x, axis=1)[1:], 0.09 * t[1:], rtol=4 * np.sqrt(2 / 20000))

    def test_the_kinds_add_up(self):
        """Variances of independent noises add; the last instant of 20 000 series, 4 sigma."""
        x = Noise(0.5, 0.4, 0.1, 0.3).sample(np.array([0.0, 2.0]), 20000, rng())
        assert np.var(x[1]) == pytest.approx(0.25 + 0.16 + 0.09 * 2.0, rel=4 * np.sqrt(2 / 20000))

    def test_without_noise_nothing_is_drawn(self):
        generator = rng()
        np.testing.assert_array_equal(Noise().sample(self.t, 3, generator), 0.0)
        assert generator.random() == rng().random()

    def test_the_same_seed_gives_the_same_bits(self):
        noise = Noise(0.6, 0.3, 0.1, 0.2)
        np.testing.assert_array_equal(noise.sample(self.t, 3, rng()), noise.sample(self.t, 3, rng()))

    @pytest.mark.parametrize(
        "wrong", [{"white": -1.0}, {"correlated": float("nan")}, {"walk": -0.1}, {"correlation_s": 0.0}]
    )
    def test_noise_that_cannot_be_is_refused(self, wrong):
        with pytest.raises(InputError, match="noise is"):
            Noise(**wrong)


class TestDigits:
    def test_readings_are_multiples_of_the_resolution(self):
        got = measured(Magnetometer(FAST, resolution=0.15), FLIGHT).value
        np.testing.assert_allclose(got / 0.15, np.round(got / 0.15), atol=1e-7)
        assert np.abs(got - MAG).max() <= 0.075 + WRITTEN

    def test_noise_comes_before_rounding_and_clipping(self):
        """Rounded noise has the quantiser's variance on top; nothing leaves the range."""
        sensor = Magnetometer(Sampling(20000.0), noise=Noise(0.6), resolution=0.5, range=40.0)
        got = measured(sensor, turning(0.0)).value
        np.testing.assert_array_equal(got * 2, np.round(got * 2))
        assert got.max() == 40.0
        # x stays away from the range: 60003/3 values, 4 sigma of a variance
        assert np.var(got[:, 0]) == pytest.approx(0.36 + 0.25 / 12, rel=4 * np.sqrt(2 / 20001))

    def test_a_sheet_states_the_specification_and_no_hidden_error(self):
        sensor = Accelerometer(
            Sampling(200.0, phase_s=0.001, jitter_s=1e-5, clock=ClockRate(1.01)),
            offset=PositionOffset(0.001),
            scale=Scale(0.1),
            bias=AccelerometerBias(1.0),
            noise=Noise(0.03, correlated=0.2),
            resolution=0.005,
            range=150.0,
            saturation=AccelerometerSaturation(100.0),
        )
        plain = Accelerometer(Sampling(200.0), noise=Noise(0.03), resolution=0.005, range=150.0)
        for name in ("rate_hz", "noise_rms", "resolution", "range", "velocity_noise_rms"):
            assert getattr(sensor.sheet, name) == getattr(plain.sheet, name)
        np.testing.assert_array_equal(sensor.sheet.position, IMU)
