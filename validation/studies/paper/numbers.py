"""All that the page on the paper states, computed in one go, and the figures that go with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from discsim.shipped import load_disc
from discsim.validation.scenarios.rate_table_figures import draw_methods
from discsim.validation.studies.paper.distance import distances
from discsim.validation.studies.paper.figures import draw_distances, draw_fig_3, draw_fig_9, draw_fig_11, draw_fig_13
from discsim.validation.studies.paper.modules import compare_modules
from discsim.validation.studies.paper.prediction import predict_by_table
from discsim.validation.studies.paper.spectrum import whole_flight
from discsim.validation.studies.paper.table_run import run_fig_7, table_numbers

__all__ = ["compute", "rounded"]

#: significant digits of what is kept: one more than the page prints
DIGITS = 4


def compute(seed: int, figures: Path | None = None, say: Callable[[str], None] = lambda _: None) -> dict[str, Any]:
    """Return the numbers of all parts, rounded; write the figures into a folder where one is given."""
    disc, environment = load_disc("driver")
    streams = np.random.default_rng(seed).spawn(4)
    say("Fig. 3: the spectrum of a whole flight")
    spectrum = whole_flight(disc, environment, streams[0])
    say("Fig. 7: the rate table")
    table = run_fig_7(environment, streams[1])
    say("Fig. 9: two modules")
    modules = compare_modules(disc, environment)
    say("Figs. 11 and 13: eight throws, a table, a flight")
    prediction = predict_by_table(disc, environment, streams[2])
    say("72 m: one unknown at a time")
    far = distances(disc, environment)
    if figures is not None:
        draw_fig_3(spectrum, figures / "fig-3.png")
        draw_methods(table, figures / "fig-7.png")
        draw_fig_9(disc, environment, modules, streams[3], figures / "fig-9.png")
        draw_fig_11(prediction, figures / "fig-11.png")
        draw_fig_13(prediction, figures / "fig-13.png")
        draw_distances(far, figures / "distances.png")
    parts = {
        "fig_3": spectrum.numbers,
        "fig_7": table_numbers(table),
        "fig_9": modules,
        "fig_13": prediction.numbers,
        "distance": far,
    }
    return {name: rounded(part) for name, part in parts.items()}


def rounded(value: Any) -> Any:
    """Return JSON content with its numbers cut to `DIGITS` significant ones, NaN as None."""
    if isinstance(value, Mapping):
        return {str(key): rounded(one) for key, one in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [rounded(one) for one in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
    return value
