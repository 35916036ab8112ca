"""Shows a `Replay`: in MuJoCo's interactive viewer, as a video, or as a picture, drawn off screen.

Positions are North-East-Down; MuJoCo draws them in its own axes through `discsim.frames`.
"""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from itertools import chain, pairwise
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.files import model_file, write_bytes
from discsim.frames import C3, FLIP, flip_yz
from discsim.validation.viewing.offscreen import Pixels, canvas, has_display
from discsim.validation.viewing.replay import DRIVER_DIAMETER, Replay

__all__ = [
    "CAMERAS",
    "Look",
    "Scene",
    "draw_stills",
    "draw_whole",
    "frame_times",
    "show",
    "write_picture",
    "write_video",
]

#: the first three follow the disc and stand in the model files; ``path`` sees the whole flight from its right
CAMERAS = ("track", "side", "top", "path")
#: longest GIF: its frames are held in memory
GIF_FRAMES = 2000
#: knots of the drawn path
TRAIL_KNOTS = 240
TRAIL_RGBA = (0.10, 0.20, 0.70, 0.9)
SHADOW_RGBA = (0.05, 0.12, 0.05, 0.45)
MARK_RGBA = (1.0, 1.0, 1.0, 0.75)
#: the camera ``path`` looks down on a flight by so much
PATH_ELEVATION_DEG = -14.0
#: share of a picture's width and height that a whole flight fills
FILL = 0.90


@dataclass(frozen=True)
class Look:
    """How a replay is drawn: size in pixels, camera, and times the disc is drawn larger than it is."""

    width: int = 640
    height: int = 360
    camera: str = "track"
    enlarge: float = 1.0

    def __post_init__(self) -> None:
        if self.camera not in CAMERAS:
            raise InputError(f"no camera '{self.camera}'; expected one of {', '.join(CAMERAS)}")
        if not (64 <= self.width <= 4096 and 64 <= self.height <= 4096):
            raise InputError(f"{self.width}x{self.height}: expected 64 to 4096 pixels each way")
        if not 1.0 <= self.enlarge <= 100.0:
            raise InputError(f"disc enlarged {self.enlarge:g} times, expected 1 to 100")


class Scene:
    """A replay in MuJoCo: the model of its drawing, posed by `pose`, and what is drawn besides.

    Attributes
    ----------
    model, data : mujoco.MjModel, mujoco.MjData
        Only posed, never stepped.
    heading : float
        Where the motion goes, clockwise from north, rad; zero where it stays. The cameras are turned there.
    """

    def __init__(self, replay: Replay, enlarge: float = 1.0) -> None:
        self.replay = replay
        across = replay.position[-1, :2] - replay.position[0, :2]
        self.heading = float(np.arctan2(across[1], across[0])) if replay.travels else 0.0
        spec = mujoco.MjSpec.from_file(str(model_file(replay.model)))
        if (body := spec.body("disc")) is not None:
            grow = replay.diameter / DRIVER_DIAMETER
            for geom in body.geoms:  # the drawing is the driver's
                geom.size = np.asarray(geom.size) * [grow, grow, 1.0] * enlarge
                geom.pos = np.asarray(geom.pos) * [grow, grow, 1.0] * enlarge
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        turned = FLIP[:, None] * C3(self.heading).T * FLIP  # about MuJoCo's z, which points up
        for camera in range(self.model.ncam):
            self.model.cam_pos0[camera] = turned @ self.model.cam_pos0[camera]
            self.model.cam_mat0[camera] = (turned @ self.model.cam_mat0[camera].reshape(3, 3)).ravel()
        knots = np.linspace(replay.start, replay.end, TRAIL_KNOTS if replay.travels else 0)
        self._trail_times, self._trail = knots, flip_yz(replay.position_at(knots))

    def pose(self, t: float) -> None:
        """Put the model where the replay is at an instant."""
        now = np.array([t])
        q = self.replay.attitude_at(now)[0]
        if self.model.nq == 1:
            self.data.qpos[0] = 2 * np.arctan2(q[3], q[0])  # a hinge about z_B
        else:
            self.data.qpos[:3] = flip_yz(self.replay.position_at(now)[0])
            self.data.qpos[3:7] = [q[0], *flip_yz(q[1:])]
        self.data.time = t
        mujoco.mj_forward(self.model, self.data)

    def camera(self, name: str, aspect: float) -> Any:
        """Return a camera of `CAMERAS` for a picture of that width over height."""
        camera = mujoco.MjvCamera()
        if name == "path":
            self._frame(camera, aspect)
        else:
            camera.type = mujoco.mjtCamera.mjCAMERA_FIXED
            camera.fixedcamid = self.model.camera(name).id
        return camera

    def _frame(self, camera: Any, aspect: float) -> None:
        """Aim a free camera so that the whole path, and the ground below it, fill the picture."""
        if not self.replay.travels:
            raise InputError("the camera 'path' sees a whole flight; this motion stays in one place")
        ground = self._trail * [1.0, 1.0, 0.0]
        points = np.vstack((self._trail, ground))
        azimuth, elevation = np.pi / 2 - self.heading, np.radians(PATH_ELEVATION_DEG)
        forward = np.array(
            [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
        )
        right = np.array([np.sin(azimuth), -np.cos(azimuth), 0.0])
        up = np.cross(right, forward)
        middle = (points.max(axis=0) + points.min(axis=0)) / 2
        high = np.tan(np.radians(self.model.vis.global_.fovy) / 2) * FILL
        offset = points - middle
        depth = offset @ forward
        needed = np.maximum(np.abs(offset @ right) / (high * aspect), np.abs(offset @ up) / high) - depth
        camera.lookat[:] = middle
        camera.distance = float(needed.max())
        camera.azimuth, camera.elevation = np.degrees(azimuth), np.degrees(elevation)

    def decorate(self, scene: Any, until: float, *, labels: bool = False) -> None:
        """Add the path up to an instant, its shadow at noon, and marks on the ground each 10 m, to an MjvScene."""
        passed = self._trail_times < until
        here = flip_yz(self.replay.position_at(np.array([until])))
        points = np.vstack((self._trail[passed], here)) if passed.any() else here
        for a, b in pairwise(points):
            _line(scene, a, b, 3.0, TRAIL_RGBA)
            _line(scene, a * [1, 1, 0] + [0, 0, 0.01], b * [1, 1, 0] + [0, 0, 0.01], 2.0, SHADOW_RGBA)
        if not self.replay.travels:
            return
        along = np.array([np.cos(self.heading), -np.sin(self.heading), 0.0])
        beside = np.array([np.sin(self.heading), np.cos(self.heading), 0.0])
        start = flip_yz(self.replay.position[0]) * [1, 1, 0] + [0, 0, 0.01]
        reach = float(np.linalg.norm(self.replay.position[-1, :2] - self.replay.position[0, :2]))
        for metres in range(0, int(reach) + 10, 10):
            at = start + metres * along
            _line(scene, at - 2 * beside, at + 2 * beside, 2.0, MARK_RGBA, f"{metres} m" if labels else "")

    def caption(self, t: float) -> str:
        """Say when it is, and what is known of the motion then."""
        now, parts = np.array([t]), [f"{t:.2f} s"]
        rate = float(self.replay.rate_at(now)[0])
        if np.isfinite(rate):
            parts.append(f"{np.degrees(rate):.0f} deg/s")
        if self.replay.travels:
            here = self.replay.position_at(now)[0]
            far = np.linalg.norm(here[:2] - self.replay.position[0, :2])
            parts.append(f"{far:.1f} m away")
            parts.append(f"{-here[2]:.1f} m high")
        return "   ".join(parts)


def _line(scene: Any, a: FloatArray, b: FloatArray, width: float, rgba: Sequence[float], label: str = "") -> None:
    """Add a line of a width in pixels to an MjvScene, where it has room."""
    if scene.ngeom >= scene.maxgeom:
        return
    geom = scene.geoms[scene.ngeom]
    kind = mujoco.mjtGeom.mjGEOM_LINE
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(rgba, dtype=np.float32))
    mujoco.mjv_connector(geom, kind, width, a, b)
    geom.label = label
    scene.ngeom += 1


# ---------------------------------------------------------------------------------------------- pictures


@contextmanager
def _painter(scene: Scene, look: Look) -> Iterator[Callable[[float], Image.Image]]:
    """Give a function that draws the scene at an instant, without words."""
    with canvas(scene.model, look.width, look.height) as draw:
        options, content = mujoco.MjvOption(), mujoco.MjvScene(scene.model, maxgeom=4000)
        camera = scene.camera(look.camera, look.width / look.height)

        def paint(t: float) -> Image.Image:
            scene.pose(t)
            _update(scene, options, camera, content)
            scene.decorate(content, t)
            return _image(draw(content))

        yield paint


def _update(scene: Scene, options: Any, camera: Any, content: Any) -> None:
    everything = mujoco.mjtCatBit.mjCAT_ALL.value
    mujoco.mjv_updateScene(scene.model, scene.data, options, None, camera, everything, content)


def _image(pixels: Pixels) -> Image.Image:
    return Image.fromarray(pixels)


def _write(image: Image.Image, phrases: Sequence[str], place: str = "top") -> Image.Image:
    """Write phrases into a picture's upper or lower left corner, in as few lines as its width allows."""
    size = max(10, min(17, image.width // 42))
    font = ImageFont.load_default(size)
    lines = [phrases[0]]
    for phrase in phrases[1:]:
        longer = f"{lines[-1]}   |   {phrase}"
        if font.getlength(longer) < image.width - 2 * size:
            lines[-1] = longer
        else:
            lines.append(phrase)
    height = round(1.35 * size)
    above = 0 if place == "top" else image.height - height * len(lines) - size // 2
    widest = max(font.getlength(line) for line in lines)
    shade = Image.new("L", image.size, 0)
    box = (0, above, round(widest) + 2 * size, above + height * len(lines) + size // 2)
    ImageDraw.Draw(shade).rectangle(box, fill=120)
    image.paste((15, 25, 35), mask=shade)
    pen = ImageDraw.Draw(image)
    for number, line in enumerate(lines):
        pen.text((size, above + size // 4 + number * height), line, fill="white", font=font)
    return image


def draw_stills(replay: Replay, look: Look, times: Sequence[float]) -> Image.Image:
    """Draw the replay at instants (s), side by side, each ``look``'s size, with words below the strip.

    Raises `InputError` for an instant outside the replay, or where there is no OpenGL.
    """
    for t in times:
        if not replay.start <= t <= replay.end:
            raise InputError(f"no picture at {t:g} s; expected {replay.start:g} to {replay.end:.6g} s")
    scene = Scene(replay, look.enlarge)
    strip = Image.new("RGB", (look.width * len(times), look.height))
    with _painter(scene, look) as paint:
        for number, t in enumerate(times):
            strip.paste(_write(paint(t), [scene.caption(t)]), (number * look.width, 0))
    return _write(strip, _said(replay, look.enlarge), "bottom")


def draw_whole(replay: Replay, look: Look, stills: int = 6, exposures: int = 15) -> Image.Image:
    """Draw a whole flight in one picture: many exposures along its path, and below stills by the look's camera.

    Along the path the disc is drawn larger than it is, by a factor that the picture states: the look's, or where that
    is one, such that its diameter becomes 1/25 of the flight's length.
    """
    length = np.linalg.norm(np.ptp(replay.position, axis=0))
    larger = look.enlarge if look.enlarge > 1 else float(np.clip(round(length / 25 / replay.diameter), 1, 100))
    near = Look(look.width // stills, round(look.height * 0.36), look.camera)
    path = Look(look.width, look.height - near.height, "path", larger)
    scene = Scene(replay, path.enlarge)
    with canvas(scene.model, path.width, path.height) as draw:
        options, content = mujoco.MjvOption(), mujoco.MjvScene(scene.model, maxgeom=4000)
        times = np.linspace(replay.start, replay.end, exposures)
        scene.pose(times[0])
        _update(scene, options, scene.camera("path", path.width / path.height), content)
        for t in times[1:]:
            scene.pose(t)
            mujoco.mjv_addGeoms(
                scene.model,
                scene.data,
                options,
                mujoco.MjvPerturb(),
                mujoco.mjtCatBit.mjCAT_DYNAMIC.value,
                content,
            )
        scene.decorate(content, replay.end, labels=True)
        upper = _image(draw(content))
    gap = (replay.end - replay.start) / (exposures - 1)
    words = [
        *_said(replay, path.enlarge),
        f"{exposures} exposures, {gap:.2f} s apart; end: {scene.caption(replay.end)}",
    ]
    picture = Image.new("RGB", (look.width, look.height))
    picture.paste(_write(upper, words), (0, 0))
    near_scene = Scene(replay)
    with _painter(near_scene, near) as paint:
        moments = replay.start + (np.arange(stills) + 0.5) / stills * (replay.end - replay.start)
        for number, t in enumerate(moments):
            still = _write(paint(t), [near_scene.caption(t).rsplit("   ", 2)[0]])
            picture.paste(still, (number * look.width // stills, path.height))
    return picture


def _said(replay: Replay, enlarge: float) -> list[str]:
    larger = [f"disc drawn {enlarge:g} times its size"] if enlarge != 1.0 else []
    return [*replay.notes, *larger]


def write_picture(path: Path, picture: Image.Image) -> None:
    """Write a PNG, whole or not at all."""
    stream = io.BytesIO()
    picture.save(stream, format="PNG", optimize=True)
    write_bytes(path, stream.getvalue())


# ---------------------------------------------------------------------------------------------- videos


def frame_times(path: Path, replay: Replay, fps: float, speed: float) -> FloatArray:
    """Return the instants (n,) of a video's frames, s; the last frame is the replay's end.

    Raises `InputError` where fps or speed (times real time) make no video, or one too long for a GIF.
    """
    if not 0 < fps <= 100:
        raise InputError(f"--fps {fps:g}: expected more than 0 and at most 100 frames per second")
    _check_speed(speed)
    count = int(np.ceil((replay.end - replay.start) / speed * fps - 1e-9)) + 1
    if path.suffix == ".gif" and count > GIF_FRAMES:
        raise InputError(
            f"--video {path}: {count} frames are too many for a GIF, expected at most {GIF_FRAMES}; show less with "
            "--span, fewer with --fps, or write an .mp4"
        )
    return np.minimum(replay.start + np.arange(count) / fps * speed, replay.end)


def _check_speed(speed: float) -> None:
    if not 0 < speed <= 100:
        raise InputError(f"--speed {speed:g}: expected more than 0 and at most 100 times real time")


def write_video(path: Path, replay: Replay, look: Look, times: Iterable[float], fps: float) -> None:
    """Write a replay at instants (s), one frame each, as ``.mp4`` or else as a GIF, whole or not at all.

    Raises `InputError`: an MP4 where there is no ffmpeg, no OpenGL.
    """
    scene = Scene(replay, look.enlarge)
    words = _said(replay, look.enlarge)
    with _painter(scene, look) as paint:
        frames = (_write(_write(paint(t), [scene.caption(t)]), words, "bottom") for t in times)
        if path.suffix == ".mp4":
            write_mp4(path, frames, fps)
        else:
            write_gif(path, frames, fps)


def write_gif(path: Path, frames: Iterable[Image.Image], fps: float) -> None:
    """Write frames as an animation that repeats for ever, in 128 colours each."""
    pictures = [frame.quantize(128, dither=Image.Dither.NONE) for frame in frames]
    # a GIF counts hundredths of a second: rounding the instants, not the gaps, keeps the video's length
    ends = np.round(100 * np.arange(1, len(pictures) + 1) / fps).astype(int)
    gaps = (10 * np.diff(ends, prepend=0)).tolist()
    stream = io.BytesIO()
    pictures[0].save(stream, format="GIF", save_all=True, append_images=pictures[1:], duration=gaps, loop=0)
    write_bytes(path, stream.getvalue())


def write_mp4(path: Path, frames: Iterator[Image.Image], fps: float) -> None:
    """Write frames as H.264 by ffmpeg; raises `InputError` where there is none or it fails."""
    tool = _ffmpeg(path)
    first = next(frames)
    width, height = first.size
    if width % 2 or height % 2:
        raise InputError(f"--video {path}: {width}x{height} pixels, expected even numbers for an MP4")
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "video.mp4"
        source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-"]
        coding = ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-movflags", "+faststart"]
        with tempfile.TemporaryFile() as said:
            order = [tool, "-loglevel", "error", *source, *coding, str(result)]
            with subprocess.Popen(order, stdin=subprocess.PIPE, stderr=said) as process:
                assert process.stdin is not None
                with suppress(BrokenPipeError), process.stdin as pipe:  # an ffmpeg that gives up says why
                    for frame in chain((first,), frames):
                        pipe.write(frame.tobytes())
            said.seek(0)
            if process.returncode != 0:
                reason = " ".join(said.read().decode(errors="replace").split())
                raise InputError(f"--video {path}: ffmpeg failed ({reason}); a .gif needs no ffmpeg")
        write_bytes(path, result.read_bytes())


def _ffmpeg(path: Path) -> str:
    if found := shutil.which("ffmpeg"):
        return found
    if find_spec("imageio_ffmpeg") is not None:
        imageio_ffmpeg = import_module("imageio_ffmpeg")

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    raise InputError(
        f"--video {path}: an MP4 needs ffmpeg, from the system or by `pip install 'discsim[video]'`; a .gif needs none"
    )


# ---------------------------------------------------------------------------------------------- interactive


def show(replay: Replay, look: Look, speed: float) -> None:
    """Replay over and over in MuJoCo's interactive viewer until its window is closed.

    Raises `InputError` where no window can be opened.
    """
    _check_speed(speed)
    remedy = "use --video FILE to draw without a window"
    if not has_display():
        raise InputError(f"no display to show on (DISPLAY and WAYLAND_DISPLAY are not set); {remedy}")
    import glfw

    with _quiet(glfw):
        opened = glfw.init()
    if not opened:  # the viewer would start a thread that fails, and wait for it for ever
        raise InputError(f"no window can be opened on this display; {remedy}")
    import mujoco.viewer

    scene = Scene(replay, look.enlarge)
    scene.pose(replay.start)
    try:
        window = mujoco.viewer.launch_passive(scene.model, scene.data, show_left_ui=False, show_right_ui=False)
    except RuntimeError as error:
        if sys.platform == "darwin":
            raise InputError(f"on macOS it needs `mjpython -m discsim.validation.cli view ...`, or {remedy}") from error
        raise
    with window as viewer:
        with viewer.lock():
            _aim(viewer, scene.camera(look.camera, look.width / look.height))
        started = time.monotonic()
        length = replay.end - replay.start
        while viewer.is_running():
            # a second of rest at the end, then again
            passed = (time.monotonic() - started) * speed % (length + speed)
            t = replay.start + min(passed, length)
            with viewer.lock():
                scene.pose(t)
                viewer.user_scn.ngeom = 0
                scene.decorate(viewer.user_scn, t)
            words = "\n".join((scene.caption(t), *_said(replay, look.enlarge)))
            viewer.set_texts((None, mujoco.mjtGridPos.mjGRID_TOPLEFT, words, None))
            viewer.sync()
            time.sleep(1 / 60)


def _aim(viewer: Any, camera: Any) -> None:
    for name in ("type", "fixedcamid", "distance", "azimuth", "elevation"):
        setattr(viewer.cam, name, getattr(camera, name))
    viewer.cam.lookat[:] = camera.lookat


@contextmanager
def _quiet(glfw: Any) -> Iterator[None]:
    """Let glfw say that it fails by its answer alone, not by a warning too."""
    previous = glfw.ERROR_REPORTING
    glfw.ERROR_REPORTING = False
    try:
        yield
    finally:
        glfw.ERROR_REPORTING = previous
