"""The simulated world: a spinning disc in MuJoCo, its sensors, and recordings of both simulated and real ones."""

from discsim.errors import InputError
from discsim.recording import Recording, Samples, read_dataset, read_recording, write_recording

__all__ = ["InputError", "Recording", "Samples", "read_dataset", "read_recording", "write_recording"]
