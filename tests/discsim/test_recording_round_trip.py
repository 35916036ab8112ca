"""Recordings that are written are read back to the last bit, and a write that fails leaves no recording."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from support.places import PRACTICE
from support.recording_folder import CSV, make, refusal

from discsim import recording as module
from discsim.disc import Aero, AeroTable, Disc, Release, Rig, RollingTable, YawDampingTable, aero_key
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.limits import LARGEST_READING, limit_of
from discsim.recording import (
    FORMAT,
    SENSORS,
    Recording,
    Samples,
    SensorSheet,
    read_dataset,
    read_recording,
    write_recording,
)
from discsim.toml_table import obeyed_by_terminals


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    return make(tmp_path / "flight")


def reals(key: str) -> st.SearchStrategy[float]:
    """Return numbers that a key may have, however small."""
    largest = limit_of(key).largest
    return st.floats(-largest, largest)


def positives(key: str) -> st.SearchStrategy[float]:
    return st.floats(limit_of(key).smallest, limit_of(key).largest)


def sizes(key: str) -> st.SearchStrategy[float]:
    return st.just(0.0) | positives(key)


def vectors(key: str) -> st.SearchStrategy[np.ndarray]:
    return npst.arrays(np.float64, 3, elements=reals(key))


sigma_values = st.one_of(sizes("any"), npst.arrays(np.float64, 3, elements=sizes("any")))


@st.composite
def samples_of(draw: st.DrawFn, width: int, gaps: bool = True) -> Samples:
    """Return up to six rows at times within the limits: a hundredth of a second apart or more, and to the last bit."""
    steps = draw(npst.arrays(np.float64, st.integers(1, 6), elements=st.floats(0.01, 100.0)))
    t = draw(st.floats(-1e5, 1e5)) + np.cumsum(steps)
    readings = st.floats(-LARGEST_READING, LARGEST_READING)
    elements = readings | st.just(float("nan")) if gaps else readings
    return Samples(t, draw(npst.arrays(np.float64, t.shape if width == 1 else (t.size, width), elements=elements)))


@st.composite
def maybe_sigma(draw: st.DrawFn, keys: dict[str, bool]) -> dict[str, object]:
    """Return uncertainties of some of ``keys`` (key -> whether it is a vector)."""
    chosen = draw(st.lists(st.sampled_from(sorted(keys)), unique=True)) if keys else []
    return {key: draw(sigma_values if keys[key] else sizes("any")) for key in chosen}


#: nodes of a table, ascending once they are sorted
angles = npst.arrays(np.float64, st.integers(2, 5), elements=st.floats(-np.pi, np.pi), unique=True)


@st.composite
def discs(draw: st.DrawFn) -> Disc:
    Ixx = draw(st.floats(1e-11, 1e3))
    aero = Aero(*(draw(reals(aero_key(name))) for name in Aero._fields))
    table = None
    if draw(st.booleans()):
        alpha = np.sort(draw(angles))
        table = AeroTable(alpha, *(draw(npst.arrays(np.float64, alpha.size, elements=reals("CL"))) for _ in range(3)))
    damping = None
    if draw(st.booleans()):
        rate = np.radians(4500.0 + 50.0 * np.arange(draw(st.integers(4, 51))))
        speed = 6.0 + 0.5 * np.arange(5)
        damping = YawDampingTable(rate, speed, draw(npst.arrays(np.float64, (rate.size, 5), elements=reals("CNr"))))
    keys = dict.fromkeys(("mass_kg", "diameter_m", "Ixx_kg_m2", "Izz_kg_m2", "CL0", "alpha0_rad", "CNr"), False)
    return Disc(
        draw(positives("mass_kg")),
        draw(positives("diameter_m")),
        Ixx,
        Ixx * draw(st.floats(0.1, 2.0)),
        aero,
        table,
        damping,
        draw(maybe_sigma(keys)),
        draw(st.none() | rolling_tables()),
    )


@st.composite
def rolling_tables(draw: st.DrawFn) -> RollingTable:
    alpha = np.sort(draw(angles))
    ratio = np.cumsum(draw(npst.arrays(np.float64, st.integers(1, 4), elements=st.floats(0.01, 1.0))))
    CR = draw(st.none() | npst.arrays(np.float64, (alpha.size, ratio.size), elements=reals("CR")))
    columns = npst.arrays(np.float64, alpha.size, elements=reals("CRp"))
    CRp = draw(columns if CR is None else st.none() | columns)
    return RollingTable(alpha, None if CR is None else ratio, CR, CRp)


@st.composite
def recordings(draw: st.DrawFn) -> Recording:
    plant = draw(st.sampled_from(module.PLANTS))
    sensors = draw(st.lists(st.sampled_from(sorted(SENSORS)), min_size=1, unique=True))
    maybe = lambda strategy: draw(st.one_of(st.none(), strategy))  # noqa: E731
    sheets = {}
    for sensor in sensors:
        gps, unit = sensor == "gps", SENSORS[sensor].unit or "m"
        sheets[sensor] = SensorSheet(
            draw(positives("rate_hz")),
            maybe(sizes(f"noise_rms_{unit}")),
            None if gps else maybe(sizes(f"resolution_{unit}")),
            None if gps else maybe(positives(f"range_{unit}")),
            maybe(sizes("noise_rms_m_s")) if gps else None,
            draw(vectors("position_m")) if sensor == "accelerometer" else None,
            draw(maybe_sigma({"rate_hz": False} | ({"position_m": True} if sensor == "accelerometer" else {}))),
        )
    fields = {key: maybe(vectors(key)) for key in ("position_ned_m", "velocity_ned_m_s")}
    fields |= {key: maybe(reals(key)) for key in ("roll_rad", "pitch_rad", "yaw_rad")}
    fields |= {"body_rate_rad_s": maybe(vectors("body_rate_rad_s"))}
    known = {key: isinstance(value, np.ndarray) for key, value in fields.items() if value is not None}
    environment = Environment(
        draw(positives("gravity_m_s2")),
        draw(vectors("magnetic_field_ned_uT")),
        draw(positives("air_density_kg_m3")),
        draw(vectors("wind_ned_m_s")),
        draw(maybe_sigma({"gravity_m_s2": False, "magnetic_field_ned_uT": True, "wind_ned_m_s": True})),
    )
    return Recording(
        plant,
        draw(st.text(st.characters(exclude_categories=["Cs"]).filter(lambda one: not obeyed_by_terminals(one)))),
        environment,
        draw(discs()) if plant == "flight" else maybe(discs()),
        Rig(draw(positives("Izz_kg_m2")), draw(sizes("viscous_N_m_s")), draw(maybe_sigma({"viscous_N_m_s": False})))
        if plant == "spin_down"
        else None,
        maybe(st.just(Release(*fields.values(), sigma=draw(maybe_sigma(known))))),
        sheets,
        {sensor: draw(samples_of(len(SENSORS[sensor].columns))) for sensor in sensors},
        draw(samples_of(1, gaps=False)) if plant == "rate_table" and draw(st.booleans()) else None,
    )


def assert_same(ours: object, theirs: object) -> None:
    """Assert that two parts of recordings are equal to the last bit (but for a NaN's payload)."""
    if hasattr(ours, "__dataclass_fields__"):
        assert type(ours) is type(theirs)
        for name in ours.__dataclass_fields__:
            if name != "path":
                assert_same(getattr(ours, name), getattr(theirs, name))
    elif hasattr(ours, "keys"):
        assert set(ours) == set(theirs)  # type: ignore[call-overload]
        for key in ours:  # type: ignore[attr-defined]
            assert_same(ours[key], theirs[key])  # type: ignore[index]
    elif isinstance(ours, np.ndarray | float):
        ours, theirs = np.asarray(ours, dtype=float), np.asarray(theirs, dtype=float)
        np.testing.assert_array_equal(ours, theirs)
        np.testing.assert_array_equal(np.signbit(ours)[~np.isnan(ours)], np.signbit(theirs)[~np.isnan(theirs)])
    else:
        assert ours == theirs


@settings(max_examples=60, deadline=None)
@given(recording=recordings())
def test_writing_and_reading_gives_the_same_bits(tmp_path_factory, recording):
    folder = tmp_path_factory.mktemp("round") / "trip"
    write_recording(recording, folder)
    assert_same(recording, read_recording(folder))
    second = folder.with_name("again")
    write_recording(read_recording(folder), second)
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == {
        f.name: f.read_bytes() for f in second.iterdir()
    }


def test_a_folder_of_the_format_is_what_is_written(flight, tmp_path):
    write_recording(read_recording(flight), tmp_path / "copy")
    assert sorted(file.name for file in (tmp_path / "copy").iterdir()) == [*sorted(CSV), "recording.toml"]
    assert (tmp_path / "copy" / "magnetometer.csv").read_text() == CSV["magnetometer.csv"]
    assert FORMAT in (tmp_path / "copy" / "recording.toml").read_text()
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "copy").stat().st_mode & 0o777 == 0o777 & ~umask
    assert (tmp_path / "copy" / "recording.toml").stat().st_mode & 0o777 == 0o666 & ~umask


def test_overwriting_removes_sensors_that_are_gone_and_keeps_other_files(flight, tmp_path):
    recording = read_recording(flight)
    (flight / "truth.csv").write_text("kept")
    (flight / "command.csv").write_text("stale")
    write_recording(
        Recording(
            "free_spin",
            "new",
            Environment(),
            sheets=recording.sheets,
            samples={"magnetometer": recording.need("magnetometer")},
        ),
        flight,
    )
    assert sorted(file.name for file in flight.iterdir()) == ["magnetometer.csv", "recording.toml", "truth.csv"]
    assert read_recording(flight).name == "new"
    assert [child.name for child in tmp_path.iterdir()] == ["flight"]


@pytest.mark.parametrize("fails_at", [1, 2, 3])
@pytest.mark.parametrize("kill", [OSError("disk full"), KeyboardInterrupt()], ids=["disk full", "interrupt"])
def test_a_write_that_fails_leaves_nothing_behind(flight, tmp_path, monkeypatch, fails_at, kill):
    recording = read_recording(flight)
    before = {file.name: file.read_bytes() for file in flight.iterdir()}
    written = 0

    def failing(path: Path, pieces: Iterable[str]) -> None:
        nonlocal written
        written += 1
        if written == fails_at:
            raise kill
        path.write_text("".join(pieces))

    monkeypatch.setattr(module, "write_pieces", failing)
    for folder in (tmp_path / "new", flight):
        written = 0
        with pytest.raises(type(kill)):
            write_recording(recording, folder)
    assert [child.name for child in tmp_path.iterdir()] == ["flight"]
    assert {file.name: file.read_bytes() for file in flight.iterdir()} == before


def test_a_folder_left_by_a_killed_writer_is_no_recording(flight, tmp_path):
    make(tmp_path / ".flight.abcdef")
    assert [recording.path for recording in read_dataset(tmp_path)] == [flight]


def test_a_write_that_is_cut_short_while_replacing_leaves_no_recording(flight, tmp_path, monkeypatch):
    """The one moment in which an older recording is lost: nothing half old, half new may be read afterwards."""
    recording = read_recording(flight)
    replace = Path.replace

    def failing(path: Path, target: Path) -> Path:
        if path.name == "accelerometer.csv" and target.parent == flight:
            raise OSError("disk full")
        return replace(path, target)

    monkeypatch.setattr(Path, "replace", failing)
    with pytest.raises(OSError, match="disk full"):
        write_recording(recording, flight)
    assert refusal(flight).startswith("recording.toml: no such file")


def test_what_the_reader_would_refuse_is_not_written(flight, tmp_path):
    recording = read_recording(flight)
    none = Samples(np.empty(0), np.empty((0, 3)))
    folder = tmp_path / "new"
    disc = Disc(0.2, 0.2, 1e-3, 1e-3, sigma={"CL0": 0.1})
    for broken, says in [
        (
            Recording("free_spin", "a\x1fb", Environment(), sheets=recording.sheets, samples=recording.samples),
            r"'a\\x1fb': a recording's name; expected a text without control characters",
        ),
        (Recording("free_spin", "x", Environment(), sheets=recording.sheets), "no sensor has samples"),
        (
            Recording("free_spin", "x", Environment(), sheets=recording.sheets, samples={"magnetometer": none}),
            "magnetometer has no samples",
        ),
        (
            Recording("free_spin", "x", Environment(), disc, sheets=recording.sheets, samples=recording.samples),
            r"\[disc.aero_sigma\] without \[disc.aero\]",
        ),
        (
            Recording(
                "free_spin", "x", Environment(sigma={"air": 1.0}), sheets=recording.sheets, samples=recording.samples
            ),
            r"\[environment\]: uncertainty of 'air', which is not stated",
        ),
        (
            Recording(
                "rate_table",
                "x",
                Environment(),
                sheets=recording.sheets,
                samples=recording.samples,
                command=Samples(np.array([0.0]), np.array([np.nan])),
            ),
            "the command has no knots or a gap",
        ),
    ]:
        with pytest.raises(InputError, match=says):
            write_recording(broken, folder)
    assert not folder.exists()


def test_a_recording_is_not_written_over_a_file(flight, tmp_path):
    (tmp_path / "file").write_text("kept")
    with pytest.raises(InputError, match=r"file: is a file; expected a folder"):
        write_recording(read_recording(flight), tmp_path / "file")
    assert (tmp_path / "file").read_text() == "kept"


# ------------------------------------------------------------------------------------------------- practice


def practice_recordings() -> list[Path]:
    return sorted(file.parent for file in PRACTICE.glob("**/recording.toml"))


def test_the_practice_recordings_are_read_and_survive_a_round_trip(tmp_path):
    folders = practice_recordings()
    if not folders:
        pytest.skip("no practice recordings; set DISCSIM_RECORDINGS to a folder that has practice/")
    for folder in folders:
        recording = read_recording(folder)
        assert recording.samples
        assert sum(samples.gaps for samples in recording.samples.values()) < recording.end * 1000
    write_recording(recording, tmp_path / "copy")
    assert_same(recording, read_recording(tmp_path / "copy"))
