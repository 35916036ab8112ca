"""Spin rate from recordings: what an experimenter has goes in, a `YawRate` comes out; no truth is seen here."""

from estimators.rate import YawRate

__all__ = ["YawRate"]
