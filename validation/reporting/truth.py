"""Truth files: the motion behind a simulated recording, beside it and never in it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray
from discsim.files import write_text
from discsim.motion import COLUMNS, Motion

__all__ = ["write_csv", "write_flight_truth", "write_rate_truth"]

FLIGHT_HEADER = ",".join(COLUMNS)


def write_csv(path: Path, header: str, table: FloatArray) -> None:
    """Write a table (n, k) of numbers with a header; NaN becomes an empty cell."""
    rows = (",".join("" if x != x else repr(x) for x in row) for row in table.tolist())
    write_text(path, "\n".join([header, *rows, ""]))


def write_flight_truth(path: Path, motion: Motion) -> None:
    """Write every step of a flight; the last row is touch-down where the flight ended on the ground."""
    write_csv(path, FLIGHT_HEADER, np.column_stack(list(motion.table().values())))


def write_rate_truth(path: Path, motion: Motion) -> None:
    """Write every step of a rig's rate about z_B."""
    write_csv(path, "time_s,rate_rad_s", np.column_stack((motion.t, motion.rate[:, 2])))
