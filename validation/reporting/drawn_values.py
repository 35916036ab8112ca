"""The numbers behind a picture, kept in it, so that a page shows them where the pointer is.

A PNG takes texts beside its pixels. What is kept: for each curve its label, and for points of it where they are in the
picture (shares of its width and height, from the top left) and what they are worth on their axes.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from discsim.arrays import FloatArray

__all__ = ["KEY", "drawn_values"]

#: the name of the text in the picture
KEY = "discsim"
#: points kept of a curve, and of a picture: some hundred bytes a dozen, and a screen has no more places to point at
_CURVE, _PICTURE = 400, 4000


def drawn_values(figure: Figure) -> str:
    """Return the numbers behind a figure as JSON in ASCII, empty where there are none."""
    figure.draw_without_rendering()  # places are known once the layout is
    width, height = figure.bbox.width, figure.bbox.height
    curves: list[dict[str, Any]] = []
    for axes in figure.axes:
        for label, points in _curves(axes):
            kept = points[np.isfinite(points).all(axis=1)]
            pixels = axes.transData.transform(kept) if len(kept) else np.empty((0, 2))
            inside = np.all((pixels >= axes.bbox.min) & (pixels <= axes.bbox.max), axis=1)
            kept, pixels = kept[inside], pixels[inside]
            if not len(kept):
                continue
            some = np.unique(np.linspace(0, len(kept) - 1, min(len(kept), _CURVE)).astype(int))
            curves.append(
                {
                    "name": label,
                    "x": axes.get_xlabel(),
                    "y": axes.get_ylabel(),
                    "at": [
                        [round(float(px / width), 4), round(float(1.0 - py / height), 4), f"{x:.6g}", f"{y:.6g}"]
                        for (px, py), (x, y) in zip(pixels[some], kept[some], strict=True)
                    ],
                }
            )
    count = sum(len(curve["at"]) for curve in curves)
    step = -(-count // _PICTURE)
    for curve in curves:
        curve["at"] = curve["at"][:: max(step, 1)]
    return json.dumps(curves, separators=(",", ":")) if curves else ""


def _curves(axes: Axes) -> list[tuple[str, FloatArray]]:
    """Return labels and points (n, 2) of the lines, dots and bars of a panel."""
    found = []
    for line in axes.get_lines():
        if line.get_transform() == axes.transData:  # a line across the panel has no values
            found.append((_name(line.get_label()), np.asarray(line.get_xydata(), dtype=float)))
    for collection in axes.collections:
        offsets = np.asarray(collection.get_offsets(), dtype=float)
        if offsets.ndim == 2 and len(offsets) > 1:
            found.append((_name(collection.get_label()), offsets))
    bars = [patch for patch in axes.patches if isinstance(patch, Rectangle) and patch.get_transform() != axes.transAxes]
    for container in axes.containers:
        ends = [_end(bar) for bar in container if isinstance(bar, Rectangle) and bar in bars]
        if ends:
            found.append((_name(container.get_label()), np.array(ends, dtype=float)))
    return found


def _end(bar: Rectangle) -> tuple[float, float]:
    """Return the end of a bar, in the middle of its shorter side: of one that lies its right one, else its top."""
    (x, y), width, height = bar.get_xy(), bar.get_width(), bar.get_height()
    lies = y != 0.0 or abs(x) < 1e-12
    return (x + width, y + height / 2) if lies and x == 0.0 else (x + width / 2, y + height)


def _name(label: object) -> str:
    text = str(label)
    return "" if text.startswith("_") else text
