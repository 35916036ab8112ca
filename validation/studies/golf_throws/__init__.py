"""Three drone-tracked golf throws against flights predicted from their measured release (docs/golf-throws.md)."""

from discsim.validation.studies.golf_throws.page import write_page
from discsim.validation.studies.golf_throws.prediction import Prediction, predict_throw

__all__ = ["Prediction", "predict_throw", "write_page"]
