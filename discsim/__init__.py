"""The simulated world: a spinning disc in MuJoCo, its sensors, and recordings of both simulated and real ones.

A whole throw, from a disc and a release to what its sensors write:

>>> import discsim
>>> disc, environment = discsim.load_disc("driver")
>>> flight = discsim.predict(disc, environment, discsim.load_throw("driver"))
>>> flight.motion().touched_down
True

Each name is loaded when it is first asked for: the import itself takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from discsim.disc import Disc, Release
    from discsim.effects.catalogue import effect
    from discsim.engine import fly
    from discsim.environment import Environment
    from discsim.errors import InputError
    from discsim.model_file import read_model, write_model
    from discsim.motion import Motion
    from discsim.plain_arrays import recording_from_arrays
    from discsim.recording import Recording, Samples, SensorSheet, read_dataset, read_recording, write_recording
    from discsim.sensors.instruments import Instruments, record
    from discsim.sensors.instruments import read_part as load_part
    from discsim.shipped import load_disc, load_site, load_throw
    from discsim.trajectory import predict

    __version__: str

__all__ = [
    "Disc",
    "Environment",
    "InputError",
    "Instruments",
    "Motion",
    "Recording",
    "Release",
    "Samples",
    "SensorSheet",
    "__version__",
    "effect",
    "fly",
    "load_disc",
    "load_part",
    "load_site",
    "load_throw",
    "predict",
    "read_dataset",
    "read_model",
    "read_recording",
    "record",
    "recording_from_arrays",
    "write_model",
    "write_recording",
]

#: name -> where it is, "module" or "module:its name there"
_HOMES = {
    "Disc": "disc",
    "Environment": "environment",
    "InputError": "errors",
    "Instruments": "sensors.instruments",
    "Motion": "motion",
    "Recording": "recording",
    "Release": "disc",
    "Samples": "recording",
    "SensorSheet": "recording",
    "effect": "effects.catalogue",
    "fly": "engine",
    "load_disc": "shipped",
    "load_part": "sensors.instruments:read_part",
    "load_site": "shipped",
    "load_throw": "shipped",
    "predict": "trajectory",
    "read_dataset": "recording",
    "read_model": "model_file",
    "read_recording": "recording",
    "record": "sensors.instruments",
    "recording_from_arrays": "plain_arrays",
    "write_model": "model_file",
    "write_recording": "recording",
}


def __getattr__(name: str) -> Any:
    """Return one of the names above, loaded when it is first asked for."""
    if name == "__version__":
        from importlib.metadata import PackageNotFoundError, version

        try:
            return version("discsim")
        except PackageNotFoundError:
            return "unknown"  # run from a bare source tree
    if name not in _HOMES:
        raise AttributeError(f"module 'discsim' has no attribute '{name}'")
    module, _, own = _HOMES[name].partition(":")
    return getattr(import_module(f"discsim.{module}"), own or name)


def __dir__() -> list[str]:
    return __all__
