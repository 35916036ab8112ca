"""Spin rate from recordings: what an experimenter has goes in, a `YawRate` comes out; no truth is seen here."""

from discsim.estimators.accelerometer import AccelerometerErrors, accelerometer, envelope, rate_with_known_terms
from discsim.estimators.fft import FftSettings, fft
from discsim.estimators.gyroscope import gyroscope, rate_reference
from discsim.estimators.methods import METHODS, Options, best, estimate
from discsim.estimators.rate import YawRate

__all__ = [
    "METHODS",
    "AccelerometerErrors",
    "FftSettings",
    "Options",
    "YawRate",
    "accelerometer",
    "best",
    "envelope",
    "estimate",
    "fft",
    "gyroscope",
    "rate_reference",
    "rate_with_known_terms",
]
