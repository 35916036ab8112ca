"""Spin rate from recordings: what an experimenter has goes in, a `YawRate` comes out; no truth is seen here."""

from estimators.accelerometer import AccelerometerErrors, accelerometer, envelope, rate_with_known_terms
from estimators.fft import FftSettings, fft
from estimators.gyroscope import gyroscope, rate_reference
from estimators.methods import METHODS, Options, best, estimate
from estimators.rate import YawRate

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
