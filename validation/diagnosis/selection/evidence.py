"""What evidence costs: gains in likelihood that an effect needs, bounds and signs of parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from validation.diagnosis.selection.candidates import Trial, parameters_of
from validation.diagnosis.settings import SELECTION

__all__ = ["price"]

#: within which parameters make sense, the effects' and a rig's own
BOUNDS: Mapping[tuple[str, str], tuple[float, float]] = {
    **{(row.id, name): bounds for row in CATALOGUE.values() for name, bounds in row.bounds.items()},
    ("rig", "viscous"): (0.0, np.inf),
}


#: parameters whose sign physics fixes: friction brakes, a lag is late
ONE_SIDED: Mapping[tuple[str, str], float] = {
    (row.id, name): sign for row in CATALOGUE.values() for name, sign in row.sign.items()
}


def price(trial: Trial) -> float:
    """Return what a trial must gain to be believed."""
    count = len(parameters_of(trial))
    row = trial.row
    if row.event:
        return (SELECTION.event_entry if row.brief else SELECTION.gust_entry) + SELECTION.per_parameter * count
    odd = trial.recordings is not None and row.of_disc
    return SELECTION.entry + SELECTION.per_parameter * count + (SELECTION.other_disc if odd else 0.0)
