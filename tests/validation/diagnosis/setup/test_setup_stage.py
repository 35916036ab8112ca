"""Faults of the setup, before anything is fitted: the right one is found, with its twins if any, else nothing."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support import logger_loop as loop
from support.places import ROOT
from support.thinned import one_in

from discsim.disc import Release
from discsim.effects import Effect, effect
from discsim.recording import PLANTS, Recording, Samples, read_recording, write_recording
from discsim.validation.challenge.cases.case import Case, Coast, Concealed
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.commands.import_ import command as import_
from discsim.validation.diagnosis.setup import SetupFault, find_setup_faults, with_turned_board
from discsim.validation.diagnosis.signals.spin_signals import turning_line
from discsim.written import as_written

MAP = ROOT / "models" / "imports" / "csv.toml"


def small(plant: str) -> Case:
    """Return a case with nothing concealed and every sensor on board: three throws, or one short run of a rig."""
    case = draw_case(5 if plant == "free_spin" else 0, plant, kind="nothing")  # type: ignore[arg-type]
    runs = case.runs[: 3 if plant == "flight" else 1]
    runs = tuple(replace(run, duration=8.0) if isinstance(run, Coast) else run for run in runs)
    return replace(case, runs=runs, stated_releases=case.stated_releases[: len(runs)], longest=4.0)


@pytest.fixture(scope="session")
def sound() -> dict[str, list[Recording]]:
    """Sound recordings by plant."""
    return {plant: recordings(small(plant)) for plant in PLANTS}


def found(made: list[Recording], *faults: Effect) -> tuple[SetupFault, ...]:
    return find_setup_faults([as_written(one, faults) for one in made]).faults


def right(faults: tuple[SetupFault, ...], fault: Effect) -> bool:
    """Tell whether one fault was found, which is the right one or has it among its twins."""
    return len(faults) == 1 and fault in (faults[0].effect, *faults[0].twins)


@pytest.mark.parametrize("plant", PLANTS)
def test_nothing_is_found_in_sound_recordings(plant, sound):
    findings = find_setup_faults(sound[plant])
    assert findings.faults == ()
    for one, other in zip(findings.recordings, sound[plant], strict=True):
        assert one is other


AXES = [
    effect(id, axes=axes)
    for id, axes in (
        ("mag.axes", "x -y z"),
        ("mag.axes", "z y x"),
        ("accel.axes", "-x -y -z"),
        ("accel.axes", "y x z"),
        ("gyro.axes", "x y -z"),
        ("gyro.axes", "y x z"),
        ("gps.axes", "east north up"),
    )
]
UNITS = [
    effect(id, written_in=unit)
    for id, unit in (
        ("mag.units", "mG"),
        ("mag.units", "G"),
        ("accel.units", "g"),
        ("accel.units", "mg"),
        ("gyro.units", "deg/s"),
        ("gyro.units", "rpm"),
        ("clock.units", "ms"),
        ("clock.units", "us"),
    )
]


def called(fault: Effect) -> str:
    return f"{fault.id} {' '.join(fault.setting.values())}"


@pytest.mark.parametrize("fault", AXES, ids=called)
def test_in_a_flight_columns_that_hold_other_axes_are_found_alone(fault, sound):
    """With a field, a path and the air there is one reading of every fault: no twin."""
    (one,) = found(sound["flight"], fault)
    assert one.effect == fault
    assert one.twins == ()


@pytest.mark.parametrize("fault", UNITS, ids=called)
@pytest.mark.parametrize("plant", PLANTS)
def test_a_unit_that_is_not_the_columns_is_found_and_taken_back(plant, fault, sound):
    written = [as_written(one, [fault]) for one in sound[plant]]
    findings = find_setup_faults(written)
    assert findings.effects == (fault,)
    for meant, one in zip(findings.recordings, sound[plant], strict=True):
        for name, samples in one.samples.items():
            np.testing.assert_allclose(meant.samples[name].value, samples.value, rtol=1e-12)
            np.testing.assert_allclose(meant.samples[name].t, samples.t, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("plant", "fault"),
    [
        ("rate_table", effect("mag.axes", axes="x -y z")),
        ("rate_table", effect("accel.axes", axes="x y -z")),
        ("rate_table", effect("gyro.axes", axes="x y -z")),
        ("spin_down", effect("mag.axes", axes="x y -z")),
        ("spin_down", effect("accel.axes", axes="y x z")),
        ("spin_down", effect("gyro.axes", axes="-x -y -z")),
        ("free_spin", effect("mag.axes", axes="x z y")),
    ],
    ids=lambda item: item if isinstance(item, str) else called(item),
)
def test_on_a_rig_and_in_a_free_spin_the_fault_is_found_or_stands_among_its_twins(plant, fault, sound):
    assert right(found(sound[plant], fault), fault)


def test_reversed_columns_of_a_magnetometer_are_named_before_a_field_that_points_the_other_way(sound):
    fault = effect("mag.axes", axes="-x -y -z")
    (one,) = found(sound["flight"], fault)
    assert one.effect == fault
    assert {twin.id for twin in one.twins} <= {"site.field"}


def test_in_a_long_log_the_fault_is_found_where_the_disc_turns(sound):
    """Ten minutes at rest before the throw: what is judged is the stretch that turns."""
    fault = effect("mag.axes", axes="x z y")
    written = as_written(sound["free_spin"][0], [fault])
    rng, samples = np.random.default_rng(0), {}
    for name, own in written.samples.items():
        t = np.arange(0.0, 600.0, 1.0 / 50.0)
        rest = np.median(own.value, axis=0) * (name != "gyroscope")
        noise = rng.normal(0.0, written.sheets[name].noise_rms or 0.01, (t.size, rest.size))
        samples[name] = Samples(np.concatenate([t, own.t + 600.0]), np.concatenate([rest + noise, own.value]))
    assert right(find_setup_faults([replace(written, samples=samples)]).faults, fault)


def test_without_a_rate_reference_a_flipped_magnetometer_is_a_gyroscope_flipped_about_z(sound):
    """Nothing tells which way the disc turns: either sensor may be the wrong one, and both are given."""
    bare = [without(one, "rate_reference") for one in sound["spin_down"]]
    (one,) = found(bare, effect("mag.axes", axes="x -y z"))
    both = {(item.id, item.setting["axes"]) for item in (one.effect, *one.twins)}
    assert {("mag.axes", "x -y z"), ("gyro.axes", "x y -z")} <= both
    assert "these recordings cannot tell that from" in one.sentence


def test_directions_of_a_path_are_found_where_no_sensor_shows_the_spin(sound):
    """No magnetometer, and a gyroscope that clips: heights and stated releases are all there is."""
    fault = effect("gps.axes", axes="east north up")
    bare = [replace(one, samples={"gps": one.samples["gps"]}) for one in sound["flight"]]
    stated = [replace(one, release=Release(velocity=one.samples["gps"].value[0, 3:])) for one in bare]
    for some in (bare, stated):
        assert find_setup_faults(some).faults == ()
    (told,) = found(stated, fault)
    assert (told.effect, told.twins) == (fault, ())


def without(recording: Recording, sensor: str) -> Recording:
    kept = {name: samples for name, samples in recording.samples.items() if name != sensor}
    return replace(recording, samples=kept)


def test_a_field_that_dips_less_is_found_with_its_size_and_direction():
    """Within half of what the fit may move it by (one sigma 0.2). A declination is left to the fit."""
    case = replace(small("flight"), concealed=(Concealed(effect("site.field", inclination_rad=np.radians(-25.0))),))
    (one,) = find_setup_faults(recordings(case)).faults
    assert one.id == "site.field"
    found = [one.effect.sizes[name] for name in ("declination_rad", "inclination_rad", "ratio")]
    np.testing.assert_allclose(found, [0.0, np.radians(-25.0), 1.0], atol=0.1)


# ------------------------------------------------------------------------------------------- what mends it


def mended_map(advice: str) -> str:
    """Return the csv map with what an advice says to write into it: ``[table] key = value and key = value``."""
    text = MAP.read_text()
    _, _, lines = advice.partition("write into the import map: ")
    for line in lines.split("; "):
        table, _, keys = line.partition("] ")
        for key in re.split(r" and (?=mirrored)", keys):
            name = key.partition(" = ")[0]
            head, mark, tail = text.partition(f"{table}]\n")
            assert mark, line
            own, blank, rest = tail.partition("\n\n")
            kept = "\n".join(row for row in own.split("\n") if not row.startswith(f"{name} ="))
            text = f"{head}{mark}{kept}\n{key}{blank}{rest}"
    return text


@pytest.mark.parametrize("fault", one_in(3, [a for a in AXES if a.id in ("mag.axes", "accel.axes")]), ids=called)
def test_the_line_that_an_advice_gives_mends_the_import(fault, sound, tmp_path):
    one = sound["flight"][0]
    write_recording(as_written(one, [fault]), tmp_path / "raw")
    (told,) = found(sound["flight"], fault)
    (tmp_path / "map.toml").write_text(mended_map(told.advice()))
    import_(tmp_path / "raw", str(tmp_path / "map.toml"), out=tmp_path / "recording")
    mended = read_recording(tmp_path / "recording")
    for sensor in ("magnetometer", "accelerometer", "gyroscope"):
        meant, own = one.samples[sensor], mended.samples[sensor]
        assert len(own) == len(meant)
        np.testing.assert_allclose(own.value, meant.value, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(own.t - own.t[0], meant.t - meant.t[0], atol=2e-6)


def test_a_noisy_field_that_hardly_turns_says_nothing_of_units(sound):
    """From reading to reading noise points anywhere, which is no fast spin that an accelerometer should feel."""
    rng, made = np.random.default_rng(3), []
    for one in sound["free_spin"]:
        still = {
            "magnetometer": one.environment.magnetic_field,
            "accelerometer": np.array([0.0, 0.0, -one.environment.gravity]),
            "gyroscope": np.array([0.0, 0.0, 2.0]),
        }
        samples = {}
        for name, value in still.items():
            t = one.samples[name].t
            samples[name] = Samples(t, value + rng.normal(0.0, 0.5, (t.size, 3)))
        made.append(replace(one, samples=samples))
    assert find_setup_faults(made).faults == ()


@pytest.mark.parametrize("axes", [[0], [0, 1, 2]], ids=["an axis that was never read", "one value throughout"])
def test_a_dead_sensor_is_no_fault_of_axes(sound: dict[str, list[Recording]], axes: list[int]) -> None:
    """Readings that are not there agree with any order of the axes, and with any turn of the board."""
    recording = sound["free_spin"][0]
    samples = recording.samples["gyroscope"]
    value = samples.value.copy()
    value[:, axes] = np.nan if len(axes) == 1 else 0.2
    dead = {**recording.samples, "gyroscope": Samples(samples.t, value)}
    assert find_setup_faults([replace(recording, samples=dead)]).faults == ()


def rows_lost() -> list[Recording]:
    """Return free spins as a logger wrote them that lost a fifth of its rows: no relation between sensors holds."""
    return [loop.logged(one, 1 + k, own_clock=True, weight=0.5)[0] for k, one in enumerate(loop.motions())]


@pytest.mark.parametrize("turn", [(0.3, -0.2, 0.5), (0.05, 0.03, 0.0)])
def test_a_turned_board_is_told_by_the_spins_axis_where_rows_are_lost(turn):
    fault = effect("board.rotation", **dict(zip(("rx_rad", "ry_rad", "rz_rad"), turn, strict=True)))
    findings = with_turned_board(find_setup_faults([as_written(one, [fault]) for one in rows_lost()]))
    assert findings is not None
    (found,) = findings.faults
    # the wobble and iron move both axes by some hundredths
    assert np.array(list(found.effect.sizes.values())) == pytest.approx(np.array(turn), abs=0.03)
    for made, meant in zip(rows_lost(), findings.recordings, strict=True):
        spin = meant.samples["gyroscope"].value[:, 2]
        assert np.mean(spin) == pytest.approx(np.mean(made.samples["gyroscope"].value[:, 2]), rel=2e-3)


def test_a_chip_that_is_turned_alone_is_no_turned_board():
    def tilted(one: Recording) -> Recording:
        rates = one.samples["gyroscope"]
        turned = rates.value @ Rotation.from_rotvec([0.08, -0.05, 0.0]).as_matrix()
        return replace(one, samples={**one.samples, "gyroscope": Samples(rates.t, turned)})

    assert with_turned_board(find_setup_faults(rows_lost())) is None
    assert with_turned_board(find_setup_faults([tilted(one) for one in rows_lost()])) is None


def losing(one: Recording, share: float) -> Recording:
    """Return a recording whose magnetometer lost a share of its samples and stamped the others evenly."""
    field = one.samples["magnetometer"]
    kept = np.random.default_rng(3).random(field.t.size) > share
    told = Samples(field.t[: int(np.count_nonzero(kept))], field.value[kept])
    return replace(one, samples={**one.samples, "magnetometer": told})


def test_a_turned_board_on_a_rig_is_told_by_its_axis_where_samples_are_lost(sound):
    """No phase holds then; the axis stands still, and gravity tells which of its ends points down."""
    fault = effect("board.rotation", rx_rad=-0.8, ry_rad=0.1, rz_rad=1.4)
    written = [as_written(losing(one, 0.04), [fault]) for one in sound["spin_down"]]
    before = find_setup_faults(written)
    assert before.faults == ()
    findings = with_turned_board(before)
    assert findings is not None
    (found,) = findings.faults
    assert np.array(list(found.effect.sizes.values())) == pytest.approx(np.array([-0.8, 0.1, 1.4]), abs=0.03)
    assert found.twins == ()


@pytest.mark.parametrize("plant", ["spin_down", "rate_table"])
def test_samples_that_are_lost_on_a_rig_are_no_turned_board(plant, sound):
    assert with_turned_board(find_setup_faults([losing(one, 0.04) for one in sound[plant]])) is None


def test_a_gyroscope_that_clips_on_a_rig_tells_the_axis_while_it_turns_slowly(sound):
    """Of a mean over readings of which one column stops at its range the other two would have made too much."""
    one, axis = sound["spin_down"][0], np.array([0.9, 0.24, 0.365])
    axis /= np.linalg.norm(axis)
    gyroscope = one.samples["gyroscope"]
    limit = one.sheets["gyroscope"].range
    rate = np.linspace(2.0 * limit, 0.0, gyroscope.t.size)
    clipped = np.clip(rate[:, None] * axis, -limit, limit)
    assert np.any(clipped == limit)
    turned = replace(one, samples={**one.samples, "gyroscope": Samples(gyroscope.t, clipped)})
    line = turning_line(turned, "gyroscope")
    assert line is not None
    np.testing.assert_allclose(line, axis, atol=1e-9)
