"""A spinning flying disc: simulated, recorded, its spin estimated, its missing physics diagnosed; one package.

A whole throw, from a disc and a release to the spin that its magnetometer tells:

>>> import numpy as np
>>> import discsim as ds
>>> disc, environment = ds.load_disc("driver")
>>> motion = ds.predict(disc, environment, ds.load_throw("driver")).motion()
>>> motion.touched_down
True
>>> board = ds.Instruments.from_parts("mpu9250")
>>> throw = ds.record(motion, board, np.random.default_rng(0), plant="flight", name="first", disc=disc)
>>> ds.estimate(throw, "fft")
<SpinEstimates of 'first': fft>

Each name is loaded when it is first asked for: the import itself takes no time. Results have a short repr, a
``summary()``, ``plot()``, ``to_dataframe()``, ``to_xarray()`` and ``report(folder)``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from discsim.disc import Disc, Release
    from discsim.effects.catalogue import effect
    from discsim.environment import Environment
    from discsim.errors import InputError
    from discsim.estimators.plain_arrays import fft
    from discsim.estimators.rate import YawRate
    from discsim.model_file import read_model, write_model
    from discsim.motion import Motion
    from discsim.plain_arrays import recording_from_arrays
    from discsim.recording import Recording, Samples, SensorSheet, read_dataset, read_recording, write_recording
    from discsim.result import Result
    from discsim.sensors.instruments import Instruments, record
    from discsim.sensors.instruments import read_part as load_part
    from discsim.shipped import load_disc, load_site, load_throw
    from discsim.validation.challenge.challenged import blind_test as challenge
    from discsim.validation.checking.checked import check
    from discsim.validation.checking.flown import fly, predict
    from discsim.validation.diagnosis.diagnosed import diagnose_recordings as diagnose
    from discsim.validation.estimating.spin_estimates import estimate_spin as estimate
    from discsim.validation.importing.imported_log import import_log
    from discsim.validation.planning.planned import plan
    from discsim.validation.sweeps.swept import sweep
    from discsim.validation.yaw_damping.fitted import fit_recordings as fit

    __version__: str

__all__ = [
    "Disc",
    "Environment",
    "InputError",
    "Instruments",
    "Motion",
    "Recording",
    "Release",
    "Result",
    "Samples",
    "SensorSheet",
    "YawRate",
    "__version__",
    "challenge",
    "check",
    "diagnose",
    "effect",
    "estimate",
    "fft",
    "fit",
    "fly",
    "import_log",
    "load_disc",
    "load_part",
    "load_site",
    "load_throw",
    "plan",
    "predict",
    "read_dataset",
    "read_model",
    "read_recording",
    "record",
    "recording_from_arrays",
    "sweep",
    "write_model",
    "write_recording",
]

#: name -> where it is, "module" or "module:its name there"; the door knows the rooms above it by name alone
_HOMES = {
    "Disc": "discsim.disc",
    "Environment": "discsim.environment",
    "InputError": "discsim.errors",
    "Instruments": "discsim.sensors.instruments",
    "Motion": "discsim.motion",
    "Recording": "discsim.recording",
    "Release": "discsim.disc",
    "Result": "discsim.result",
    "Samples": "discsim.recording",
    "SensorSheet": "discsim.recording",
    "YawRate": "discsim.estimators.rate",
    "__version__": "discsim.version:version",
    "challenge": "discsim.validation.challenge.challenged:blind_test",
    "check": "discsim.validation.checking.checked",
    "diagnose": "discsim.validation.diagnosis.diagnosed:diagnose_recordings",
    "effect": "discsim.effects.catalogue",
    "estimate": "discsim.validation.estimating.spin_estimates:estimate_spin",
    "fft": "discsim.estimators.plain_arrays",
    "fit": "discsim.validation.yaw_damping.fitted:fit_recordings",
    "fly": "discsim.validation.checking.flown",
    "import_log": "discsim.validation.importing.imported_log",
    "load_disc": "discsim.shipped",
    "load_part": "discsim.sensors.instruments:read_part",
    "load_site": "discsim.shipped",
    "load_throw": "discsim.shipped",
    "plan": "discsim.validation.planning.planned",
    "predict": "discsim.validation.checking.flown",
    "read_dataset": "discsim.recording",
    "read_model": "discsim.model_file",
    "read_recording": "discsim.recording",
    "record": "discsim.sensors.instruments",
    "recording_from_arrays": "discsim.plain_arrays",
    "sweep": "discsim.validation.sweeps.swept",
    "write_model": "discsim.model_file",
    "write_recording": "discsim.recording",
}


def __getattr__(name: str) -> Any:
    """Return one of the names above, loaded when it is first asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module 'discsim' has no attribute '{name}'")
    module, _, own = _HOMES[name].partition(":")
    found = getattr(import_module(module), own or name)
    return found() if name == "__version__" else found


def __dir__() -> list[str]:
    return __all__
