"""The relaxed fit: motion that stays beside the data whatever physics is missing, `relaxed`."""

from discsim.validation.diagnosis.relaxed_fit.fit import relaxed

__all__ = ["relaxed"]
