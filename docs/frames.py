"""Draw the frames of docs/physics.md from the code's own rotations: ``python docs/frames.py``.

Writes ``docs/images/frames.png``. Each arrow is a column of a matrix that the simulation uses; down is drawn down.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from discsim.frames import C2, C3, attitude_matrix, flip_yz, heading_angles

PICTURE = Path(__file__).resolve().parent / "images" / "frames.png"
#: roll, pitch, yaw and the velocity relative to the air in B, large enough for every angle to be seen
ATTITUDE, VELOCITY = np.radians((-12.0, 15.0, 25.0)), np.array([0.75, -0.55, 0.33])
#: axes that two frames share have one label
_SHARED = {("BHW", "$z_B$"): "", ("BHW", "$z_H$"): "$z_B = z_H$", ("BHW", "$y_H$"): "", ("BHW", "$y_W$"): "$y_H = y_W$"}
_SHADES = {"N": "#888888", "B": "#0072b2", "H": "#009e73", "W": "#d55e00"}


def frames() -> dict[str, np.ndarray]:
    """Return the axes of each frame as columns (3, 3) of N components."""
    C_BN = attitude_matrix(*ATTITUDE)
    cos_beta, sin_beta, alpha = heading_angles(*VELOCITY)
    C_HB = C3(np.arctan2(sin_beta, cos_beta))
    C_WH = C2(alpha).T  # to wind axes H turns by -alpha about y: F_H = C2(alpha) F_W, (20)
    return {"N": np.eye(3), "B": C_BN.T, "H": (C_HB @ C_BN).T, "W": (C_WH @ C_HB @ C_BN).T}


def draw() -> Figure:
    """Draw the body axes in N on the left, and heading and wind axes on the disc on the right."""
    found = {frame: flip_yz(matrix.T).T for frame, matrix in frames().items()}  # matplotlib's z is up, as MuJoCo's
    figure = Figure(figsize=(11.0, 5.0), layout="constrained")
    around = np.linspace(0, 2 * np.pi, 100)
    rim = found["B"][:, :2] @ np.array([np.cos(around), np.sin(around)]) * 0.6
    titles = {"NB": "B in N: roll, then pitch, then yaw (A1)", "BHW": "H and W on the disc (A2)"}
    for place, (shown, title) in enumerate(titles.items()):
        axes = figure.add_subplot(1, 2, place + 1, projection="3d")
        axes.plot(*rim, color="#444444", lw=1.2)
        for frame, length in zip(shown, (1.0, 1.0, 1.25), strict=False):
            names = ("north", "east", "down") if frame == "N" else tuple(f"${axis}_{frame}$" for axis in "xyz")
            for name, column in zip(names, found[frame].T, strict=True):
                axes.quiver(0, 0, 0, *(length * column), color=_SHADES[frame], lw=1.8, arrow_length_ratio=0.08)
                text = _SHARED.get((shown, name), name)
                axes.text(*(1.1 * length * column), text, color=_SHADES[frame], fontsize=12)
        if "W" in shown:
            wind = found["B"] @ VELOCITY / np.linalg.norm(VELOCITY)
            axes.quiver(0, 0, 0, *(1.55 * wind), color="black", lw=1.0, arrow_length_ratio=0.06)
            axes.text(*(1.6 * wind), "$V$", fontsize=12)
        axes.set(xlim=(-0.7, 0.9), ylim=(-0.8, 0.8), zlim=(-0.9, 0.7), title=title)
        axes.set_axis_off()
        axes.set_box_aspect(None, zoom=1.4)
        axes.view_init(elev=24, azim=-150)
    return figure


if __name__ == "__main__":
    draw().savefig(PICTURE, dpi=110, metadata={"Software": None})
