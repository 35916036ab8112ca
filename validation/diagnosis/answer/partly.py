"""What explains a mismatch in part: an effect, its numbers, and what it takes away of each recording set aside."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from discsim.validation.diagnosis.answer.checked import plain
from discsim.validation.diagnosis.answer.named import ParameterValue

__all__ = ["PartlyExplained"]


@dataclass(frozen=True)
class PartlyExplained:
    """An effect that takes most of a mismatch away on recordings set aside.

    ``parameters`` have the standard deviations of the jackknife (Tukey, 1958), which hold whatever is left;
    ``heldout`` has chi-squared per reading of each recording before and with it, its numbers those of the others.
    """

    id: str
    parameters: Mapping[str, ParameterValue]
    heldout: Mapping[str, tuple[float, float]]

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "id": self.id,
            "parameters": {
                name: {"value": plain(item.value), "sd": plain(item.sd)} for name, item in self.parameters.items()
            },
            "heldout": [
                {
                    "recording": name,
                    "baseline_chi2_per_sample": plain(before),
                    "with_chi2_per_sample": plain(after),
                    "share_of_excess": plain(1.0 - after / before),
                }
                for name, (before, after) in self.heldout.items()
            ],
        }

    @property
    def text(self) -> str:
        """A sentence for the reader."""
        sizes = ", ".join(
            f"{name} = {item.value:.3g}" + ("" if item.sd is None else f" ± {item.sd:.1g}")
            for name, item in self.parameters.items()
        )
        left = ", ".join(
            f"{np.sqrt(after / before):.2f} of the rms in {name}" for name, (before, after) in self.heldout.items()
        )
        return (
            f"{self.id} ({sizes}) explains most of the mismatch in part: with the numbers of the other recordings it "
            f"leaves {left}. More than noise is left, so it is not named as the explanation."
        )
