"""The paper's loop closed: C_Nr from each source of spin rate, the flight that it predicts, the flight that was."""

from discsim.validation.experiments.feedback.scoring import (
    Damping,
    Predicted,
    dampings,
    feed_back,
    feedback_checks,
    rate_at_release,
)

__all__ = ["Damping", "Predicted", "dampings", "feed_back", "feedback_checks", "rate_at_release"]
