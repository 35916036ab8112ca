"""Model files from a fit: the disc of a recording with the C_Nr that was found, as a number or as the paper's table."""

from __future__ import annotations

from dataclasses import replace

from discsim.disc import Disc
from discsim.model_file import Model
from discsim.recording import Recording
from discsim.validation.yaw_damping.output_error import Fit
from discsim.validation.yaw_damping.paper_table import PaperTable

__all__ = ["fitted_model", "tabulated_model"]


def fitted_model(recording: Recording, fit: Fit) -> Model:
    """Return the recording's disc and surroundings with the fitted C_Nr and its standard deviation."""
    disc = _disc(recording)
    assert disc.aero is not None
    aero = disc.aero._replace(CNr=fit.CNr)
    return Model(
        recording.environment, replace(disc, aero=aero, yaw_damping_table=None, sigma={**disc.sigma, "CNr": fit.sd})
    )


def tabulated_model(recording: Recording, paper: PaperTable) -> Model:
    """Return the recording's disc and surroundings with the paper's table, outside which a flight is an error."""
    return Model(recording.environment, replace(_disc(recording), yaw_damping_table=paper.table))


def _disc(recording: Recording) -> Disc:
    assert recording.disc is not None
    return recording.disc
