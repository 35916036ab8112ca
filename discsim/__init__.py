"""The simulated world: a spinning disc in MuJoCo, its sensors, and recordings of both simulated and real ones."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from discsim.errors import InputError
    from discsim.recording import Recording, Samples, read_dataset, read_recording, write_recording

__all__ = ["InputError", "Recording", "Samples", "read_dataset", "read_recording", "write_recording"]


def __getattr__(name: str) -> Any:
    """Return one of the names above, loaded when it is first asked for: a command that needs none starts at once."""
    if name not in __all__:
        raise AttributeError(f"module 'discsim' has no attribute '{name}'")
    module = "discsim.errors" if name == "InputError" else "discsim.recording"
    return getattr(import_module(module), name)
