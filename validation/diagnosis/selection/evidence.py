"""What evidence costs: gains in likelihood that an effect needs, bounds and signs of parameters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from validation.diagnosis.selection.candidates import Trial, parameters_of

__all__ = ["price"]

#: what evidence costs: twice the log likelihood that an effect must gain, and more for each of its parameters
ENTRY, PER_PARAMETER, EVENT_ENTRY = 24.0, 4.0, 42.0


#: a gust may pass at any time, in any recording, at any width: more places to look at
GUST_ENTRY = 60.0


#: what it costs more that a disc's aerodynamics or build should differ in some recordings only
OTHER_DISC = 40.0


#: what a parameter costs when hypotheses are compared with one another
RIVAL = 8.0


BOUNDS: Mapping[tuple[str, str], tuple[float, float]] = {
    ("air.wind_shear", "exponent"): (-0.5, 3.0),
    ("aero.stall", "alpha_stall_rad"): (-0.2, 0.8),
    ("mag.stray_field", "height_m"): (0.05, 100.0),
    ("air.gust", "width_s"): (0.03, 6.0),
    ("air.density", "ratio"): (0.2, 5.0),
    **{(f"{s}.lag", "tau_s"): (0.0, 0.2) for s in ("mag", "accel", "gyro")},
    **{(f"{s}.clock_rate", "ratio"): (0.7, 1.4) for s in ("mag", "accel", "gyro", "gps")},
    ("clock.rate", "ratio"): (0.7, 1.4),
    ("gps.latency", "delay_s"): (0.0, 2.0),
    **{(f"{s}.time_offset", "offset_s"): (-2.0, 2.0) for s in ("mag", "accel", "gyro")},
    ("site.field", "ratio"): (0.2, 5.0),
    ("rig", "viscous"): (0.0, np.inf),
    ("rig.speed_ripple", "order"): (0.02, 200.0),
    ("accel.saturation", "limit_m_s2"): (0.5, np.inf),
}


#: parameters whose sign physics fixes: friction brakes, a lag is late
ONE_SIDED: Mapping[tuple[str, str], float] = {
    ("rig.coulomb_friction", "torque_N_m"): 1.0,
    ("rig.quadratic_drag", "coefficient_N_m_s2"): 1.0,
    ("gps.latency", "delay_s"): 1.0,
    **{(f"{s}.lag", "tau_s"): 1.0 for s in ("mag", "accel", "gyro")},
}


def price(trial: Trial) -> float:
    """Return what a trial must gain to be believed."""
    count = len(parameters_of(trial))
    if trial.id == "air.gust":
        return GUST_ENTRY + PER_PARAMETER * count
    if trial.id.startswith("event."):
        return EVENT_ENTRY + PER_PARAMETER * count
    odd = trial.recordings is not None and trial.id.startswith(("aero.", "body."))
    return ENTRY + PER_PARAMETER * count + (OTHER_DISC if odd else 0.0)
