"""Experiments, scores and reports: where the simulated world and the estimators meet; `discsim` starts here.

What the commands do, from Python: each function returns a result with a short repr, a ``summary()`` to read and a
``report(folder)`` that writes what the command of that name writes.

>>> import validation
>>> checked = validation.check(recording)
>>> checked.report("checked").name
'check.json'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from validation.challenge.challenged import blind_test as challenge
    from validation.checking.checked import check
    from validation.diagnosis.diagnosed import diagnose_recordings as diagnose
    from validation.estimating.scored import score_rates
    from validation.estimating.spin_estimates import estimate_spin as estimate
    from validation.importing.imported_log import import_log
    from validation.planning.planned import plan
    from validation.scattering.scattered import scatter
    from validation.sweeps.swept import sweep
    from validation.yaw_damping.fitted import fit_recordings as fit_yaw_damping

__all__ = [
    "challenge",
    "check",
    "diagnose",
    "estimate",
    "fit_yaw_damping",
    "import_log",
    "plan",
    "scatter",
    "score_rates",
    "sweep",
]

#: name -> module and its name there. `challenge` is a package, too, so that package is called (see there).
_HOMES = {
    "check": ("validation.checking.checked", "check"),
    "diagnose": ("validation.diagnosis.diagnosed", "diagnose_recordings"),
    "estimate": ("validation.estimating.spin_estimates", "estimate_spin"),
    "fit_yaw_damping": ("validation.yaw_damping.fitted", "fit_recordings"),
    "import_log": ("validation.importing.imported_log", "import_log"),
    "plan": ("validation.planning.planned", "plan"),
    "scatter": ("validation.scattering.scattered", "scatter"),
    "score_rates": ("validation.estimating.scored", "score_rates"),
    "sweep": ("validation.sweeps.swept", "sweep"),
}


def __getattr__(name: str) -> Any:
    """Return one of the functions above, loaded when it is first asked for."""
    if name == "challenge":
        return import_module("validation.challenge")
    if name not in _HOMES:
        raise AttributeError(f"module 'validation' has no attribute '{name}'")
    module, own = _HOMES[name]
    return getattr(import_module(module), own)
