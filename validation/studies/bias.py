"""``discsim study bias``: the bias of the paper's way to C_Nr, measured against the truth."""

from __future__ import annotations

import numpy as np

from discsim.shipped import load_disc
from discsim.validation.scenarios.throws import FULL_SET
from discsim.validation.yaw_damping.bias import paper_biases

__all__ = ["command"]


def command(disc: str = "driver") -> None:
    """Fly the throws of `discsim validate` without sensors and print what (26) and the table (27) err by."""
    body, environment = load_disc(disc)
    print("| throw | R sin(alpha) left out | one slope | both | table (27) on the flight |")
    print("| --- | --- | --- | --- | --- |")
    for bias in paper_biases(body, environment, FULL_SET):
        low, high = bias.table
        table = f"{100 * low:+.0f} to {100 * high:+.0f} %" if np.isfinite(low) else "outside"
        parts = " | ".join(f"{100 * value:+.1f} %" for value in (bias.rolling, bias.slope, bias.both))
        print(f"| {bias.name} | {parts} | {table} |")
