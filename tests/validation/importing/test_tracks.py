"""Tracks of cameras and of motion capture, of which a map is proposed: they were refused, or taken for sensors."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made import flight

from discsim.errors import InputError
from discsim.frames import body_to_ned
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.other_forms.markers import middle_of

T = np.arange(0.0, 1.0, 1.0 / 120.0)
MOTION = flight(seconds=1.0)
NED = np.column_stack([np.interp(T, MOTION.t, column) for column in MOTION.position.T])
#: as a person draws it: x ahead, y left, z up
XYZ = NED * (1.0, -1.0, -1.0)


def rows(values, separator=","):
    return "".join(separator.join(f"{cell:.6f}" for cell in row) + "\n" for row in values)


def motive() -> str:
    """Return a take of OptiTrack's: y up, the rigid body's turn and a marker beside its place."""
    head = "Format Version,1.23,Take Name,Take 1,Capture Frame Rate,120.000000,Rotation Type,Quaternion,Length Units,"
    kinds = ",Rotation" * 4 + ",Position" * 3 + ",Mean Marker Error" + ",Position" * 3
    types = ",Rigid Body" * 8 + ",Rigid Body Marker" * 3
    lines = [f"{head}Meters,Coordinate Space,Global", "", f",Type{types}", ",Name" + ",Disc" * 8 + ",Disc:1" * 3]
    lines += [",ID" + ',"1"' * 11, f",{kinds}", "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z"]
    x, y, z = XYZ.T
    still = np.tile([0.0, 0.0, 0.0, 1.0], (T.size, 1))
    body = np.column_stack([x, z, -y])
    table = np.column_stack([np.arange(T.size), T, still, body, np.full(T.size, 3e-4), body + 0.1])
    return "\n".join(lines) + "\n" + rows(table).replace(".000000,", ",", 1)


def vicon() -> str:
    """Return the trajectories of Nexus: mm, no times, a second marker."""
    head = "Trajectories\n120\n,,Disc:M1,,,Disc:M2,,\nFrame,Sub Frame,X,Y,Z,X,Y,Z\n,,mm,mm,mm,mm,mm,mm\n"
    return head + "".join(
        f"{k + 1},0,{x:.3f},{y:.3f},{z:.3f},{x + 130:.3f},{y:.3f},{z:.3f}\n" for k, (x, y, z) in enumerate(1000 * XYZ)
    )


def qualisys() -> str:
    """Return a file of QTM: mm, a marker that was not seen in one row."""
    head = f"NO_OF_FRAMES\t{T.size}\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t2\nFREQUENCY\t120\nNO_OF_ANALOG\t0\n"
    head += "DESCRIPTION\t--\nDATA_INCLUDED\t3D\nMARKER_NAMES\ta\tb\nFrame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\n"
    points = 1000 * XYZ
    points[50] = 0.0
    return head + "".join(
        f"{k + 1}\t{T[k]:.5f}\t{x:.3f}\t{y:.3f}\t{z:.3f}\t{x + 130:.3f}\t{y:.3f}\t{z:.3f}\n"
        for k, (x, y, z) in enumerate(points)
    )


def trc() -> str:
    """Return a TRC file: mm, names over the first of three columns each, a row without a marker."""
    head = "PathFileType\t4\t(X/Y/Z)\trun.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n"
    head += f"120\t120\t{T.size}\t2\tmm\n"
    head += "Frame#\tTime\ta\t\t\tb\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n"
    lines = [
        f"{k + 1}\t{T[k]:.5f}\t{x:.3f}\t{y:.3f}\t{z:.3f}\t{x + 130:.3f}\t{y:.3f}\t{z:.3f}"
        for k, (x, y, z) in enumerate(1000 * XYZ)
    ]
    lines[50] = f"51\t{T[50]:.5f}\t\t\t\t\t\t"
    return head + "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("name", "written"),
    [
        ("run.trc", trc),
        ("take.csv", motive),
        ("trial.csv", vicon),
        ("run.tsv", qualisys),
        ("track.csv", lambda: "t,x,y,z\n" + rows(np.column_stack([T, XYZ]))),
        ("track.csv", lambda: "time (s),x (ft),y (ft),z (ft)\n" + rows(np.column_stack([T, XYZ / 0.3048]))),
        ("track.csv", lambda: "t_ms,pos_x,pos_y,pos_z\n" + rows(np.column_stack([1000 * T, 1000 * XYZ]))),
        ("track_120Hz.csv", lambda: "frame,x_m,y_m,z_m\n" + rows(np.column_stack([np.arange(T.size), XYZ]))),
    ],
)
def test_a_path_is_read_as_a_flights_track(tmp_path, name: str, written: Callable[[], str]):
    (tmp_path / name).write_text(written())
    found = import_log(tmp_path / name)
    (recording,) = found.recordings
    assert recording.plant == "flight"
    assert set(recording.samples) == {"track"}
    track = recording.need("track")
    whole = np.delete(np.arange(T.size), 50) if name in ("run.tsv", "run.trc") else np.arange(T.size)
    assert_allclose(track.value[whole], NED[whole], atol=1e-5)
    assert_allclose(track.t, T, atol=1e-5)
    assert recording.disc is not None
    assert "disc: ultrastar (guess" in found.summary()
    # the map that was proposed reads it again, and may be changed
    (tmp_path / "map.toml").write_text(found.map_text)
    again = import_log(tmp_path / name, str(tmp_path / "map.toml")).recordings[0]
    assert_allclose(again.need("track").value, track.value)
    assert again.release is not None
    assert again.release.velocity is None
    assert again.environment.sigma["gravity_m_s2"] == 0.015


#: where markers sit on the disc, m: unevenly about its middle, and above it
MARKERS = np.array([[0.12, 0.0, -0.02], [-0.03, 0.11, -0.02], [-0.05, -0.1, -0.02], [0.02, 0.06, -0.025]])


def markers(noise: float = 0.0) -> str:
    """Return the trajectories of markers on a spinning disc, one of them not seen in some rows, in mm."""
    attitude = np.stack([np.interp(T, MOTION.t, column) for column in MOTION.attitude.T], axis=1)
    attitude /= np.linalg.norm(attitude, axis=1, keepdims=True)
    places = NED[:, None] + np.einsum("nij,mj->nmi", body_to_ned(attitude), MARKERS)
    places += noise * np.random.default_rng(1).standard_normal(places.shape)
    lines = ["Trajectories", "120", "," + "".join(f",D:M{k},," for k in range(4)), "Frame,Sub Frame" + ",X,Y,Z" * 4]
    lines.append("," + ",mm,mm,mm" * 4)
    for k, row in enumerate(1000 * places * (1.0, -1.0, -1.0)):
        cells = [f"{cell:.4f}" for cell in row.ravel()]
        lines.append(",".join([str(k), "0", *(["", "", ""] if 30 <= k < 40 else cells[:3]), *cells[3:]]))
    return "\n".join([*lines, ""])


@pytest.mark.parametrize(("noise", "off"), [(0.0, 3e-4), (2e-4, 2e-3)])
def test_of_markers_on_a_spinning_disc_the_middle_is_the_track(tmp_path, noise, off):
    """A marker circles: taken for the centre of mass it is off by 12 cm to all sides."""
    (tmp_path / "trial.csv").write_text(markers(noise))
    found = import_log(tmp_path / "trial.csv")
    track = found.recordings[0].need("track")
    # how far above the middle they sit a spin about one axis does not tell
    axis = np.linalg.norm(track.value - NED, axis=1)
    assert axis.max() < 0.03
    level = np.linalg.norm((track.value - NED)[:, :2], axis=1)
    assert level.max() < 0.02 * 0.3 + off
    said = found.summary()
    assert "its points are one body; what they turn about is 'middle', 120" in said
    assert "left out: 4 more tracked points" in said


def test_markers_that_move_apart_are_no_body(tmp_path):
    places = np.random.default_rng(3).standard_normal((40, 4, 3))
    assert middle_of(places) is None
    assert middle_of(np.zeros((40, 2, 3))) is None


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("\tmass A\t\nt\tx\ty\n" + rows(np.column_stack([T, XYZ[:, [0, 2]]]), "\t"), [0, 2]),
        ("Time (ms);X (m);Y (m)\n" + rows(np.column_stack([1000 * T, XYZ[:, [0, 2]]]), ";").replace(".", ","), [0, 2]),
    ],
)
def test_two_coordinates_are_a_view_from_the_side(tmp_path, text, columns):
    """As Tracker and Kinovea write them."""
    (tmp_path / "video.txt").write_text(text)
    found = import_log(tmp_path / "video.txt")
    value = found.recordings[0].need("track").value
    assert_allclose(value[:, columns], NED[:, columns], atol=1e-5)
    assert np.isnan(value[:, 1]).all()
    assert "from above it is ['x', '-y', 'none']" in found.map_text


def test_throws_in_a_folder_are_tracks_each(tmp_path):
    folder = tmp_path / "throws"
    folder.mkdir()
    for name in ("throw1.csv", "throw2.csv"):
        (folder / name).write_text("t,x,y,z\n" + rows(np.column_stack([T, XYZ])))
    with pytest.raises(InputError, match=r"2 logs of the same columns in it \(throw1.csv, throw2.csv\)"):
        import_log(folder)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("t,x_px,y_px\n" + rows(np.column_stack([T, 100 * XYZ[:, :2]])), "'x_px', 'y_px' are in pixels"),
        ("frame,x,y\n" + rows(np.column_stack([np.arange(T.size), XYZ[:, :2]])), "no column tells the time"),
        ("t,x,y,z\n" + rows(np.column_stack([T, np.sin(60 * T), np.cos(60 * T), T])), "no sensor of motion found"),
        ("Trajectories\nrate\nFrame,Sub Frame\n", "breaks off in its head"),
        ("NO_OF_FRAMES\t0\nFREQUENCY\t120\n", "breaks off in its head"),
        (vicon().replace("\n120\n", "\n0\n"), "0 frames a second"),
    ],
)
def test_what_is_no_path_in_metres_is_refused_by_what_it_lacks(tmp_path, text, said):
    (tmp_path / "log.csv").write_text(text)
    with pytest.raises(InputError, match=said):
        import_log(tmp_path / "log.csv")


def test_positions_beside_sensors_stay_what_a_program_worked_out(tmp_path):
    turning = np.column_stack([np.cos(60 * T), np.sin(60 * T), np.full(T.size, 3000.0)])
    text = "t,gx (deg/s),gy (deg/s),gz (deg/s),x (m),y (m),z (m)\n" + rows(np.column_stack([T, turning, XYZ]))
    (tmp_path / "log.csv").write_text(text)
    assert set(import_log(tmp_path / "log.csv").recordings[0].samples) == {"gyroscope"}


def test_kinovea_s_times_of_hundredths_are_no_milliseconds(tmp_path):
    """`0:00:01:05` was 1.005 s, and the throw ten times as fast as it was."""
    every = 6
    stamps = [f"0:00:{int(t):02d}:{round(100 * (t % 1)):02d}" for t in T[::every]]
    lines = [f"{stamp} {x:.4f} {z:.4f}" for stamp, (x, _, z) in zip(stamps, XYZ[::every], strict=True)]
    raw = tmp_path / "kinovea.txt"
    raw.write_text("\n".join(["#Kinovea Trajectory data export", "#T X Y", *lines, ""]))
    track = import_log(raw).recordings[0].samples["track"]
    assert_allclose(track.t, T[::every], atol=0.0051)
