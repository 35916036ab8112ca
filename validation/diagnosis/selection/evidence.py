"""What evidence costs: gains in likelihood that an effect needs, bounds and signs of parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from validation.diagnosis.selection.candidates import Trial, parameters_of
from validation.identification.competing_effects import row_of

__all__ = ["price"]

#: what evidence costs: twice the log likelihood that an effect must gain, and more for each of its parameters
ENTRY, PER_PARAMETER, EVENT_ENTRY = 24.0, 4.0, 42.0


#: a gust may pass at any time, in any recording, at any width: more places to look at
GUST_ENTRY = 60.0


#: what it costs more that a disc's aerodynamics or build should differ in some recordings only
OTHER_DISC = 40.0


#: what a parameter costs when hypotheses are compared with one another
RIVAL = 8.0


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
    row = row_of(trial.id)
    assert row is not None
    if row.event:
        return (EVENT_ENTRY if row.brief else GUST_ENTRY) + PER_PARAMETER * count
    odd = trial.recordings is not None and row.of_disc
    return ENTRY + PER_PARAMETER * count + (OTHER_DISC if odd else 0.0)
