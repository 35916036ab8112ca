"""Experiments, scores and reports: where the simulated world and the estimators meet; `discsim` starts here.

What the commands do, from Python: each function returns a result with a short repr, a ``summary()`` to read and a
``report(folder)`` that writes what the command of that name writes.

>>> from discsim import validation
>>> checked = validation.check(recording)
>>> checked.report("checked").name
'check.json'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from discsim.validation.challenge.challenged import blind_test as challenge
    from discsim.validation.checking.checked import check
    from discsim.validation.diagnosis.diagnosed import diagnose_recordings as diagnose
    from discsim.validation.estimating.scored import score_rates
    from discsim.validation.estimating.spin_estimates import estimate_spin as estimate
    from discsim.validation.importing.imported_log import import_log
    from discsim.validation.planning.planned import plan
    from discsim.validation.scattering.scattered import scatter
    from discsim.validation.sweeps.swept import sweep
    from discsim.validation.yaw_damping.fitted import fit_recordings as fit_yaw_damping

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
    "check": ("discsim.validation.checking.checked", "check"),
    "diagnose": ("discsim.validation.diagnosis.diagnosed", "diagnose_recordings"),
    "estimate": ("discsim.validation.estimating.spin_estimates", "estimate_spin"),
    "fit_yaw_damping": ("discsim.validation.yaw_damping.fitted", "fit_recordings"),
    "import_log": ("discsim.validation.importing.imported_log", "import_log"),
    "plan": ("discsim.validation.planning.planned", "plan"),
    "scatter": ("discsim.validation.scattering.scattered", "scatter"),
    "score_rates": ("discsim.validation.estimating.scored", "score_rates"),
    "sweep": ("discsim.validation.sweeps.swept", "sweep"),
}


def __getattr__(name: str) -> Any:
    """Return one of the functions above, loaded when it is first asked for."""
    if name == "challenge":
        return import_module("discsim.validation.challenge")
    if name not in _HOMES:
        raise AttributeError(f"module 'discsim.validation' has no attribute '{name}'")
    module, own = _HOMES[name]
    return getattr(import_module(module), own)
