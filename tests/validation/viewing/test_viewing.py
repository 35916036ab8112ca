"""`discsim view`: what is shown of a motion, where it is drawn, and the files it writes.

Pictures need OpenGL; where there is none those tests are skipped, and all that leads up to a picture is still tested.
"""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from PIL import Image

from discsim.effects.catalogue import effect
from discsim.engine import fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.rate import YawRate
from discsim.files import model_file
from discsim.frames import body_to_ned, flip_yz, rotation_error, rotation_vector, turn
from discsim.recording import Recording, Samples, SensorSheet, read_recording, write_recording
from discsim.rig import turn_table
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.validation.cli import main
from discsim.validation.diagnosis.setup.reference import believed, reference_doubts
from discsim.validation.reporting.truth import write_flight_truth, write_rate_truth
from discsim.validation.viewing import offscreen
from discsim.validation.viewing import replay as replays
from discsim.validation.viewing import scene as viewing
from discsim.validation.viewing.offscreen import opengl
from discsim.validation.viewing.replay import Replay, replay_motion, replay_recording
from discsim.validation.viewing.scene import (
    Look,
    Scene,
    draw_stills,
    draw_whole,
    frame_times,
    show,
    write_gif,
    write_mp4,
)

DRIVER, FIELD = load_disc("driver")
ULTRASTAR, _ = load_disc("ultrastar")
Z = np.array([0.0, 0.0, 1.0])


def replayed(folder: Path) -> Replay:
    """Return what the recording in a folder tells of its motion."""
    return replay_recording(read_recording(folder))


def level(rate: float = 10.0, heading: float = 0.0, speed: float = 20.0, duration: float = 2.0) -> Replay:
    """A disc that flies level and straight on at 5 m, spinning steadily."""
    t = np.linspace(0.0, duration, 401)
    way = speed * np.array([np.cos(heading), np.sin(heading), 0.0])
    position = t[:, None] * way + [0.0, 0.0, -5.0]
    return Replay("disc.xml", t, position, turn(rate * t[:, None] * Z), np.full(t.size, rate), 0.212, ("made up",))


def spun(angle: float) -> Replay:
    """A level disc at rest, turned by an angle about z_B."""
    still = np.array([[0.0, 0.0, -2.0]] * 2)
    return Replay(
        "disc.xml", np.array([0.0, 1.0]), still, turn(angle * np.array([Z, Z])), np.zeros(2), 0.212, ("still",)
    )


@pytest.fixture(scope="module")
def flight():
    return fly(DRIVER, FIELD, load_throw("driver"), duration=0.4)


def write(folder: Path, plant: str, samples: dict[str, Samples], command: Samples | None = None) -> Path:
    """Write a recording; a flight is the driver disc's."""
    place = {"accelerometer": np.array([-0.0161, 0.0, 0.0])}  # the paper's
    sheets = {name: SensorSheet(100.0, position=place.get(name)) for name in samples}
    disc = DRIVER if plant == "flight" else None
    write_recording(
        Recording(plant, folder.name, FIELD, disc=disc, sheets=sheets, samples=samples, command=command), folder
    )
    return folder


def needs_opengl(test):
    """Skip a test, with the reason, where nothing can be drawn."""
    try:
        opengl()
    except InputError as error:
        return pytest.mark.skip(reason=str(error))(test)
    return test


# ---------------------------------------------------------------------------------------------- what is shown


def test_a_truth_file_brings_back_position_and_attitude_between_its_rows(tmp_path, flight):
    """Rows are 1 ms apart: linear in position errs by a dt^2/8, some 4e-6 m at 30 m/s^2, attitude by less than that."""
    folder = write(tmp_path / "throw", "flight", {"gyroscope": Samples(flight.t, flight.rate)})
    write_flight_truth(folder / "truth.csv", flight)
    replay = replayed(folder)
    t = np.linspace(0.0101, 0.3997, 97)
    truth = flight.at(t)
    np.testing.assert_allclose(replay.position_at(t), truth.position, atol=1e-5)
    assert rotation_error(replay.attitude_at(t), truth.attitude).max() < 1e-5
    np.testing.assert_allclose(replay.rate_at(t), truth.rate[:, 2], rtol=1e-6)
    assert replay.diameter == DRIVER.diameter
    assert replay.notes == ("true motion of throw",)


def test_a_flight_is_shown_where_its_geometric_centre_is(flight):
    heavy = fly(DRIVER, FIELD, load_throw("driver"), [effect("body.mass_imbalance", ex_m=0.002)], duration=0.05)
    replay = replay_motion(heavy, DRIVER.diameter, "")
    forward = np.einsum("nij,j->ni", body_to_ned(heavy.attitude), [0.002, 0.0, 0.0])
    np.testing.assert_allclose(heavy.position - replay.position, forward, atol=1e-12)
    np.testing.assert_array_equal(replay_motion(flight, DRIVER.diameter, "").position, flight.position)


def test_a_rig_s_true_rate_is_integrated_to_its_angle(tmp_path):
    knots = Samples(np.array([0.0, 0.2, 1.0]), np.array([0.0, 40.0, 40.0]))
    motion = turn_table(knots, Environment())
    folder = write(tmp_path / "table", "rate_table", {"rate_reference": Samples(motion.t, motion.rate[:, 2])}, knots)
    write_rate_truth(folder / "truth.csv", motion)
    replay = replayed(folder)
    t = np.array([0.1, 0.5, 0.93])
    expected = turn(np.where(t < 0.2, 100 * t**2, 4 + 40 * (t - 0.2))[:, None] * Z)
    # the table follows its ramps without error; trapezoids of 1 ms rows resampled each 2 ms leave 1e-4 rad at knots
    assert rotation_error(replay.attitude_at(t), expected).max() < 2e-4
    assert "angle at the start unknown" in replay.notes[0]


def test_without_truth_a_rig_turns_by_its_read_out_and_only_then_by_its_command(tmp_path):
    t = np.linspace(0.0, 1.0, 101)
    command = Samples(np.array([0.0, 1.0]), np.array([5.0, 5.0]))
    gaps = np.where((t > 0.3) & (t < 0.4), np.nan, 6.0)
    read = replayed(write(tmp_path / "a", "rate_table", {"rate_reference": Samples(t, gaps)}, command))
    accelerometer = {"accelerometer": Samples(t, np.zeros((t.size, 3)))}
    told = replayed(write(tmp_path / "b", "rate_table", accelerometer, command))
    np.testing.assert_allclose(rotation_vector(read.attitude_at(np.array([0.5])))[0], 3.0 * Z, atol=1e-9)
    np.testing.assert_allclose(rotation_vector(told.attitude_at(np.array([0.5])))[0], 2.5 * Z, atol=1e-9)
    assert read.notes[0].startswith("rate_reference of a")
    assert "not a measurement" in told.notes[0]


def test_a_measured_flight_is_drawn_level_on_its_track_and_says_what_is_unknown(tmp_path):
    t = np.linspace(0.0, 2.0, 41)
    track = np.column_stack((10 * t, 0 * t, -2 - t))
    track[7, 2] = np.nan
    gps = np.column_stack((track + 1.0, np.zeros((t.size, 3))))
    # readings that are all the same are those of a dead sensor
    alive = 1e-10 * np.sin(np.arange(201.0))
    gyroscope = Samples(np.linspace(0.0, 2.0, 201), np.tile([0.0, 0.0, -12.0], (201, 1)) + alive[:, None])
    samples = {"gps": Samples(t, gps), "track": Samples(t, track), "gyroscope": gyroscope}
    replay = replayed(write(tmp_path / "seen", "flight", samples))
    np.testing.assert_allclose(replay.position_at(np.array([0.35, 1.0])), [[3.5, 0, -2.35], [10, 0, -3]], atol=1e-9)
    z_ned = body_to_ned(replay.attitude_at(t))[:, :, 2]
    np.testing.assert_allclose(z_ned, np.tile(Z, (t.size, 1)), atol=1e-12)
    np.testing.assert_allclose(rotation_vector(replay.attitude_at(np.array([0.2])))[0], -2.4 * Z, atol=1e-9)
    assert replay.notes == ("position: track of seen", "attitude unknown: drawn level", "spin: gyroscope")


def test_a_spin_without_direction_or_with_gaps_says_so(tmp_path, monkeypatch):
    t = np.linspace(0.0, 1.0, 101)
    rate = np.where((t > 0.395) & (t < 0.495), np.nan, 60.0)
    monkeypatch.setattr(replays, "best", lambda recording: YawRate("accelerometer", t, rate, rate / 100))
    gyroscope = {"gyroscope": Samples(t, np.zeros((101, 3)))}
    replay = replayed(write(tmp_path / "blind", "free_spin", gyroscope))
    np.testing.assert_allclose(replay.rate_at(t), 60.0, rtol=1e-9)
    assert not replay.travels
    assert replay.notes[0] == "position unknown: drawn in one place"
    assert replay.notes[2] == "spin: accelerometer, direction unknown, 10 % of it bridged"


def test_a_track_alone_is_shown_without_spin(tmp_path):
    t = np.linspace(0.0, 1.0, 11)
    track = {"track": Samples(t, np.column_stack((9 * t, 0 * t, 0 * t - 2)))}
    replay = replayed(write(tmp_path / "far", "flight", track))
    assert np.all(np.isnan(replay.rate))
    assert replay.notes[2] == "spin unknown: not drawn"
    assert "deg/s" not in Scene(replay).caption(0.5)


def beyond_its_end(monkeypatch, folder: Path) -> None:
    """View a recording's folder over a span that no motion has: all is said and nothing drawn."""
    monkeypatch.setattr(sys, "argv", ["discsim", "view", str(folder), "--span", "0:2000"])
    with pytest.raises(SystemExit):
        main()


def test_times_in_milliseconds_are_mended_aloud_before_anything_is_drawn(monkeypatch, tmp_path, capsys):
    """Three seconds at a table were drawn as an hour in which it turned at random."""
    profile = Samples(np.array([0.0, 1.0, 3.0]), np.array([0.0, 30.0, 30.0]))
    parts = Instruments.from_parts("mpu9250", "ac1120s")
    run = record(turn_table(profile, FIELD), parts, np.random.default_rng(3), plant="rate_table", name="slow")
    slow = {name: Samples(1000 * one.t, one.value) for name, one in run.samples.items()}
    write_recording(dataclasses.replace(run, samples=slow), tmp_path / "slow")
    beyond_its_end(monkeypatch, tmp_path / "slow")
    said = capsys.readouterr()
    assert "the times of all sensors are in ms" in said.out
    assert "expected a span in 0:3" in said.err or "expected a span in 0:2.99" in said.err


def test_a_reference_that_its_sensors_refute_is_not_drawn(monkeypatch, tmp_path, capsys):
    profile = Samples(np.array([0.0, 1.0, 6.0]), np.array([20.0, 30.0, 30.0]))
    parts = Instruments.from_parts("mpu9250", "ac1120s")
    run = record(turn_table(profile, FIELD), parts, np.random.default_rng(3), plant="rate_table", name="mine")
    told = run.need("rate_reference")
    wrong = {**run.samples, "rate_reference": Samples(told.t, 0.5 * told.value)}
    write_recording(dataclasses.replace(run, samples=wrong), tmp_path / "wrong")
    beyond_its_end(monkeypatch, tmp_path / "wrong")
    assert "rate_reference.csv is 0.5 times the rate" in capsys.readouterr().out
    read = read_recording(tmp_path / "wrong")
    shown = replay_recording(believed(read, reference_doubts(read)))
    assert shown.rate_at(np.array([4.0])) == pytest.approx([30.0], rel=0.01)


def test_a_recording_that_tells_no_motion_is_refused(tmp_path):
    nothing = {"track": Samples(np.array([0.0, 1.0]), np.full((2, 3), np.nan))}
    with pytest.raises(InputError, match=r"motion \(no two numbers in a column of track.csv, no gps\); expected two"):
        replayed(write(tmp_path / "dark", "flight", nothing))


@pytest.mark.parametrize(
    ("seen", "words", "end"),
    [
        ((1, 0, 1), "; east not seen: drawn at 0", [18.0, 0.0, -4.0]),
        ((1, 1, 0), "; height not seen: drawn 1.3 m above ground", [18.0, 2.0, -1.3]),
        ((0, 0, 1), "; north and east not seen: drawn at 0", [0.0, 0.0, -4.0]),
    ],
)
@pytest.mark.parametrize("sensor", ["track", "gps"])
def test_a_path_that_is_seen_from_one_side_is_drawn_as_far_as_it_was_seen(tmp_path, seen, words, end, sensor):
    t = np.linspace(0.0, 2.0, 21)
    path = np.where(seen, np.column_stack((9 * t, t, -2 - t)), np.nan)
    path[5, 2] = np.nan  # a gap of one axis is none of the others
    path = path if sensor == "track" else np.column_stack((path, np.full((21, 3), np.nan)))
    replay = replayed(write(tmp_path / "side", "flight", {sensor: Samples(t, path)}))
    assert replay.notes[0] == f"position: {sensor} of side{words}"
    np.testing.assert_allclose(replay.position_at(np.array([2.0]))[0], end, atol=1e-9)


def test_a_span_starts_and_ends_where_it_was_asked_to():
    replay = level(rate=30.0).between(0.5003, 1.2501)
    assert (replay.start, replay.end) == (0.5003, 1.2501)
    whole = level(rate=30.0)
    ends = np.array([0.5003, 1.2501])
    np.testing.assert_allclose(replay.position[[0, -1]], whole.position_at(ends), atol=1e-12)
    np.testing.assert_allclose(rotation_error(replay.attitude[[0, -1]], whole.attitude_at(ends)), 0.0, atol=1e-12)
    for start, stop in ((1.0, 1.0), (-0.1, 1.0), (0.0, 2.1), (float("nan"), 1.0)):
        with pytest.raises(InputError, match="expected a span in 0:2"):
            whole.between(start, stop)


# ---------------------------------------------------------------------------------------------- where it is drawn


@pytest.mark.parametrize("name", ["disc.xml", "rate_table.xml"])
def test_what_is_drawn_touches_nothing_and_weighs_nothing(name):
    spec = mujoco.MjSpec.from_file(str(model_file(name)))
    model = spec.compile()
    assert not model.geom_contype.any()
    assert not model.geom_conaffinity.any()
    assert all(body.explicitinertial for body in spec.bodies if body.name in ("disc", "table"))
    assert {model.camera(i).name for i in range(model.ncam)} == {"track", "side", "top"}


def test_the_drawn_disc_has_the_motion_s_place_and_attitude(flight):
    scene = Scene(replay_motion(flight, DRIVER.diameter, ""))
    scene.pose(0.25)
    truth = flight.at(np.array([0.25]))
    body = scene.data.body("disc")
    np.testing.assert_allclose(body.xpos, flip_yz(truth.position[0]), atol=1e-5)
    forward, right = body_to_ned(truth.attitude)[0].T[:2]
    axes = body.xmat.reshape(3, 3).T
    np.testing.assert_allclose(axes[0], flip_yz(forward), atol=1e-5)
    np.testing.assert_allclose(axes[1], flip_yz(-right), atol=1e-5)


def test_a_table_that_turns_clockwise_carries_its_mark_from_north_to_east():
    attitude = turn(np.array([0.0, np.pi / 2])[:, None] * Z)
    scene = Scene(Replay("rate_table.xml", np.array([0.0, 1.0]), np.zeros((2, 3)), attitude, np.ones(2), 0.2, ()))
    places = []
    for t in (0.0, 1.0):
        scene.pose(t)
        places.append(flip_yz(scene.data.geom("mark").xpos)[:2])
    np.testing.assert_allclose(places, [[0.095, 0.0], [0.0, 0.095]], atol=1e-9)


@pytest.mark.parametrize("disc", [DRIVER, ULTRASTAR], ids=["driver", "ultrastar"])
@pytest.mark.parametrize("larger", [1.0, 10.0])
def test_the_drawing_is_as_large_as_the_disc_times_the_enlargement(disc, larger):
    replay = dataclasses.replace(level(), diameter=disc.diameter)
    radius = Scene(replay, larger).model.geom("edge").size[0]
    assert radius == pytest.approx(larger * disc.diameter / 2, rel=1e-12)


@pytest.mark.parametrize("heading_deg", [0.0, 90.0, -135.0])
def test_the_cameras_turn_to_where_the_flight_goes(heading_deg):
    """``track`` stands behind the disc, ``side`` to its right, and both look at it."""
    heading = np.radians(heading_deg)
    scene = Scene(level(heading=heading))
    scene.pose(1.0)
    along, right = np.array([np.cos(heading), np.sin(heading), 0]), np.array([-np.sin(heading), np.cos(heading), 0])
    disc = flip_yz(scene.data.body("disc").xpos)
    for name, way in (("track", -along), ("side", right)):
        camera = scene.data.camera(name)
        offset = flip_yz(camera.xpos) - disc
        assert offset @ way > 0.9 * np.linalg.norm(offset[:2])
        sight = flip_yz(-camera.xmat.reshape(3, 3)[:, 2])
        assert sight @ -offset > 0.99 * np.linalg.norm(offset)


@pytest.mark.parametrize("heading_deg", [0.0, 70.0, 200.0])
def test_the_path_camera_sees_the_whole_flight_and_no_more(heading_deg):
    aspect = 3.0
    replay = level(heading=np.radians(heading_deg))
    scene = Scene(replay)
    camera = scene.camera("path", aspect)
    content = mujoco.MjvScene(scene.model, maxgeom=100)
    mujoco.mjv_updateScene(
        scene.model, scene.data, mujoco.MjvOption(), None, camera, mujoco.mjtCatBit.mjCAT_ALL.value, content
    )
    eye = content.camera[0]  # the left of two eyes, 3 cm off; far below what is asked of it
    forward, up = np.array(eye.forward), np.array(eye.up)
    offset = flip_yz(replay.position) - np.array(eye.pos)
    high = np.tan(np.radians(scene.model.vis.global_.fovy) / 2) * (offset @ forward)
    across = (offset @ np.cross(forward, up)) / (high * aspect)
    assert np.abs(across).max() == pytest.approx(viewing.FILL, abs=0.01)
    assert np.abs((offset @ up) / high).max() < viewing.FILL
    assert np.all(np.diff(across) > 0)  # from left to right


def test_the_path_grows_as_the_disc_flies():
    scene = Scene(level())
    lines = []
    for t in (0.0, 1.0, 2.0):
        content = mujoco.MjvScene(scene.model, maxgeom=2000)
        scene.decorate(content, t)
        lines.append(content.ngeom)
    marks = 5  # at 0, 10, 20, 30 and 40 m
    assert lines[0] == marks
    # path and shadow have one line each for each of the intervals passed
    assert lines[1:] == [marks + 2 * (viewing.TRAIL_KNOTS // 2), marks + 2 * (viewing.TRAIL_KNOTS - 1)]


def test_the_path_camera_refuses_a_motion_that_goes_nowhere():
    with pytest.raises(InputError, match="stays in one place"):
        Scene(spun(0.0)).camera("path", 2.0)


# ---------------------------------------------------------------------------------------------- files and refusals


def test_a_video_s_frames_run_from_start_to_end_at_the_speed_asked():
    times = frame_times(Path("a.mp4"), level(), fps=30.0, speed=0.5)
    assert times[0] == 0.0
    assert times[-1] == 2.0
    np.testing.assert_allclose(np.diff(times), 0.5 / 30, atol=1e-12)


def test_a_gif_lasts_as_long_as_its_motion_though_it_counts_in_hundredths(tmp_path):
    frames = [Image.new("RGB", (8, 8), (k, 0, 0)) for k in range(91)]
    write_gif(tmp_path / "a.gif", frames, 30.0)
    with Image.open(tmp_path / "a.gif") as animation:
        durations = []
        for frame in range(animation.n_frames):
            animation.seek(frame)
            durations.append(animation.info["duration"])
    assert len(durations) == 91
    assert sum(durations) == pytest.approx(1000 * 91 / 30, abs=5.0)
    assert set(durations) == {30, 40}


def test_a_gif_too_long_to_hold_is_refused_before_it_is_drawn():
    with pytest.raises(InputError, match=r"6001 frames are too many for a GIF.*--span"):
        frame_times(Path("a.gif"), level(), fps=30.0, speed=0.01)


@pytest.mark.parametrize(("fps", "speed"), [(0.0, 1.0), (30.0, 0.0), (30.0, -1.0), (float("nan"), 1.0), (1e9, 1.0)])
def test_a_video_of_no_frames_or_backwards_is_refused(fps, speed):
    with pytest.raises(InputError, match="expected more than 0"):
        frame_times(Path("a.mp4"), level(), fps, speed)


def test_an_mp4_without_ffmpeg_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setattr(viewing.shutil, "which", lambda name: None)
    monkeypatch.setattr(viewing, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs ffmpeg.*discsim\[video\].*\.gif needs none"):
        write_mp4(tmp_path / "a.mp4", iter([Image.new("RGB", (8, 8))]), 30.0)


def test_an_ffmpeg_that_fails_is_quoted_and_leaves_no_file(tmp_path, monkeypatch):
    failing = tmp_path / "ffmpeg"
    failing.write_text("#!/bin/sh\necho 'no such codec' >&2\nexit 1\n")
    failing.chmod(0o755)
    monkeypatch.setattr(viewing.shutil, "which", lambda name: str(failing))
    frames = (Image.new("RGB", (256, 256)) for _ in range(20))  # more than a pipe holds
    with pytest.raises(InputError, match="no such codec"):
        write_mp4(tmp_path / "a.mp4", frames, 30.0)
    assert not (tmp_path / "a.mp4").exists()


def test_without_a_display_the_viewer_points_to_video(monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    with pytest.raises(InputError, match=r"no display to show on.*--video FILE"):
        show(level(), Look(), 1.0)


@pytest.fixture
def fresh_choice():
    offscreen.working_opengl.cache_clear()
    yield
    offscreen.working_opengl.cache_clear()


def test_without_opengl_it_says_what_to_install(monkeypatch, fresh_choice):
    tried = []

    def fail(command, env, **_):
        tried.append(env["MUJOCO_GL"])
        return subprocess.CompletedProcess(command, 1)

    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(offscreen.subprocess, "run", fail)
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(InputError, match=r"no OpenGL.*apt-get install libegl1.*libosmesa6.*MUJOCO_GL=egl"):
        opengl()
    assert tried == ["egl", "osmesa"]


def test_the_first_opengl_that_works_is_taken_and_mujoco_gl_is_obeyed(monkeypatch, fresh_choice):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(
        offscreen.subprocess, "run", lambda c, env, **_: subprocess.CompletedProcess(c, env["MUJOCO_GL"] == "egl")
    )
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    assert opengl() == "osmesa"
    monkeypatch.setenv("MUJOCO_GL", "egl")
    with pytest.raises(InputError, match="tried egl"):
        opengl()
    monkeypatch.setenv("MUJOCO_GL", "off")
    with pytest.raises(InputError, match="expected egl, osmesa or glfw"):
        opengl()


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ([], "expected either the folder of a recording or --disc NAME"),
        (["here", "--disc", "driver"], "expected either the folder of a recording or --disc NAME"),
        (["here", "--throw", "driver"], "expected --disc NAME"),
        (["--disc", "driver", "--video", "a.avi"], "ends in .gif, .mp4, .png"),
        (["--disc", "driver", "--video", "a.gif", "--at", "1"], "stills go into a .png"),
        (["--disc", "driver", "--video", "a.png", "--at", "soon"], "expected seconds"),
        (["--disc", "driver", "--video", "a.gif", "--size", "wide"], "expected WIDTHxHEIGHT"),
    ],
)
def test_a_wrong_call_is_one_line_and_status_2(monkeypatch, capsys, tmp_path, arguments, expected):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["discsim", "view", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    message = capsys.readouterr().err
    assert expected in message
    assert message.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("look", [{"camera": "front"}, {"width": 10}, {"enlarge": 0.5}, {"enlarge": float("nan")}])
def test_a_look_that_cannot_be_drawn_is_refused(look):
    with pytest.raises(InputError, match="expected"):
        Look(**look)


# ---------------------------------------------------------------------------------------------- pictures


def hue(picture: Image.Image, x: float, y: float) -> str:
    """Name the colour at a place given in shares of width and height."""
    red, green, blue = picture.getpixel((int(x * picture.width), int(y * picture.height)))
    if red > 150 and green < 0.5 * red:
        return "red"
    if red > 150 and blue < 0.5 * green:
        return "yellow"
    return "white" if min(red, green, blue) > 140 else "green" if green > 1.2 * max(red, blue) else "other"


@needs_opengl
@pytest.mark.parametrize(("turns", "left", "right"), [(0.0, "red", "yellow"), (0.5, "yellow", "red")])
def test_the_disc_s_halves_change_sides_in_half_a_turn(turns, left, right):
    """Seen from above, north up: the left half is red, the right one yellow, a white plate between, grass around."""
    picture = draw_stills(spun(2 * np.pi * turns), Look(320, 320, "top"), [0.0])
    # 0.212 m at 0.80 m in a field of view of 30 deg is half of the picture: the edge is 0.20 to 0.25 off the middle
    assert (hue(picture, 0.5 - 0.225, 0.5), hue(picture, 0.5 + 0.225, 0.5)) == (left, right)
    # 45 deg between the marks that point forward and right
    assert [hue(picture, 0.5 + x, 0.5 + y) for x in (-0.08, 0.08) for y in (-0.08, 0.08)] == ["white"] * 4
    assert hue(picture, 0.5, 0.2) == "green"


@needs_opengl
def test_stills_stand_side_by_side_in_the_order_asked():
    strip = draw_stills(level(rate=np.pi), Look(160, 160, "top"), [0.0, 1.0])
    assert strip.size == (320, 160)
    assert [hue(strip, x, 0.5) for x in (0.25 - 0.1125, 0.75 - 0.1125)] == ["red", "yellow"]
    with pytest.raises(InputError, match=r"no picture at 2\.5 s; expected 0 to 2 s"):
        draw_stills(level(), Look(160, 160), [2.5])


@needs_opengl
def test_a_whole_flight_shows_its_disc_at_both_ends_of_the_picture():
    picture = draw_whole(level(), Look(900, 400), exposures=3)
    assert picture.size == (900, 400)
    pixels = np.asarray(picture)[: int(400 * 0.64)].astype(int)
    disc = (pixels[..., 0] > 150) & (pixels[..., 2] < 0.5 * pixels[..., 0])
    columns = np.flatnonzero(disc.any(axis=0)) / 900
    assert columns.min() < 0.1
    assert columns.max() > 0.9
    assert np.any(np.abs(columns - 0.5) < 0.05)
    assert not np.any(np.abs(columns - 0.25) < 0.05)


@needs_opengl
def test_the_command_writes_a_video_and_its_run(monkeypatch, tmp_path, capsys):
    arguments = ["--disc", "driver", "--video", "a.gif", "--span", "0:0.2", "--size", "160x90", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", ["discsim", "view", *arguments])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    with Image.open(tmp_path / "a.gif") as animation:
        assert (animation.n_frames, animation.size) == (7, (160, 90))  # 0.2 s at 30 a second, and both ends
    assert json.loads((tmp_path / "run.json").read_text())["command"][:2] == ["discsim", "view"]
    assert "flown in MuJoCo: disc driver, throw driver" in capsys.readouterr().out


@needs_opengl
def test_the_same_picture_has_the_same_bytes():
    first, second = (draw_stills(level(), Look(160, 90), [0.5]).tobytes() for _ in range(2))
    assert first == second
    assert first != draw_stills(level(), Look(160, 90), [0.51]).tobytes()
