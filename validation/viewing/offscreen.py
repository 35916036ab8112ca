"""Pictures of a MuJoCo scene without a display: which OpenGL to use, and one that draws into memory.

`mujoco.Renderer` fixes its OpenGL when MuJoCo is first imported; here it is chosen when the first picture is drawn.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from discsim.errors import InputError

__all__ = ["Pixels", "canvas", "has_display", "opengl"]

#: an RGB image, (height, width, 3)
Pixels: TypeAlias = NDArray[np.uint8]

_PROBE = """
import mujoco
from mujoco.{} import GLContext
context = GLContext(64, 64)
context.make_current()
mujoco.MjrContext(mujoco.MjModel.from_xml_string("<mujoco/>"), 100).free()
context.free()
"""
_REMEDY = (
    "on Debian or Ubuntu `apt-get install libegl1 libgl1-mesa-dri` gives egl, `apt-get install libosmesa6` gives "
    "osmesa; MUJOCO_GL=egl or MUJOCO_GL=osmesa chooses one"
)


def has_display() -> bool:
    """Tell whether a window could be opened."""
    return sys.platform != "linux" or bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def opengl() -> str:
    """Return the OpenGL that draws here: what MUJOCO_GL names, else the first that works of egl, osmesa, glfw.

    Raises `InputError` saying what to install where none works.
    """
    asked = os.environ.get("MUJOCO_GL", "").strip().lower()
    return working_opengl(asked)


@cache
def working_opengl(asked: str) -> str:
    candidates: tuple[str, ...]
    if asked in ("", "enable", "enabled", "on", "true", "1"):
        candidates = {"linux": ("egl", "osmesa"), "darwin": ("cgl",)}.get(sys.platform, ())
        if has_display():
            candidates += ("glfw",)
    elif asked in ("egl", "osmesa", "glfw", "glx", "wgl", "cgl"):
        candidates = ("glfw" if asked in ("glx", "wgl") else asked,)
    else:
        raise InputError(
            f"MUJOCO_GL is '{asked}', which draws nothing; expected egl, osmesa or glfw, or leave it unset"
        )
    # each is tried in a process of its own: PyOpenGL keeps the first platform that it was imported for
    for name in candidates:
        environment = {**os.environ, "MUJOCO_GL": name}
        probe = subprocess.run([sys.executable, "-c", _PROBE.format(name)], env=environment, capture_output=True)
        if probe.returncode == 0:
            return name
    raise InputError(f"no OpenGL to draw with (tried {', '.join(candidates)}); {_REMEDY}")


@contextmanager
def canvas(model: Any, width: int, height: int) -> Iterator[Callable[[Any], Pixels]]:
    """Give a function that draws an MjvScene of ``model`` and returns its pixels, (height, width, 3).

    Raises `InputError` where there is no OpenGL.
    """
    name = opengl()
    import mujoco

    context = import_module(f"mujoco.{name}").GLContext(width, height)
    context.make_current()
    model.vis.global_.offwidth, model.vis.global_.offheight = width, height
    renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100.value)
    mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, renderer)
    viewport = mujoco.MjrRect(0, 0, width, height)
    buffer = np.empty((height, width, 3), dtype=np.uint8)

    def draw(scene: Any) -> Pixels:
        context.make_current()
        mujoco.mjr_render(viewport, scene, renderer)
        mujoco.mjr_readPixels(buffer, None, viewport, renderer)
        return buffer[::-1].copy()  # OpenGL's first row is the lowest

    try:
        yield draw
    finally:
        context.make_current()
        renderer.free()
        context.free()
