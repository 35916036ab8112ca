"""The page on diagnosed recordings: what its tables are computed by, on data made here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from discsim.model_file import Model
from discsim.recording import Recording, Samples, SensorSheet
from discsim.shipped import load_disc
from discsim.validation.importing import find_map, read_map
from discsim.validation.studies.golf_throws.prediction import drawn
from discsim.validation.studies.real_diagnosis.flatball import decay, restamped, rows_of, wobble_rate
from discsim.validation.studies.real_diagnosis.golf_causes import (
    Throw,
    fit_cause,
    held_out,
    known,
    likely_pairs,
    positions,
    without_cause,
)
from discsim.validation.studies.real_diagnosis.golf_decision import decided
from discsim.validation.studies.real_diagnosis.golf_flight import flown
from discsim.validation.studies.real_diagnosis.golf_worlds import CAMERA, CAUSES, NONE, Cause, World, pair
from discsim.validation.studies.real_diagnosis.sensors import (
    against_cameras,
    check,
    field_in_body,
    iron_of,
    lost_samples,
    quiet_noise,
    repeated_share,
    rest_of,
)

DISC, AIR = load_disc("dd2")
MEASURED = read_map(find_map("shotshaper")).throws
DRAG = next(one for one in CAUSES if one.name.startswith("drag, factor"))


# ---------------------------------------------------------------------------------------------------- sensors


def test_samples_that_the_stamps_leave_out_are_counted():
    t = np.delete(np.arange(100) * 0.01, [20, 50, 51])
    assert lost_samples(t) == 3
    assert lost_samples(np.arange(5.0)) == 0


def test_noise_is_read_off_where_the_body_moves_least():
    """Over 97 readings of three axes a median's scatter gives the noise to about 8 %; 25 % is three of that."""
    rng, t = np.random.default_rng(1), np.arange(1000) * 0.01
    moving = np.where(t < 4.0, 30.0 * np.sin(60.0 * t), 5.0)
    value = moving[:, None] + rng.normal(0.0, 0.2, (1000, 3))
    assert quiet_noise(Samples(t, value)) == pytest.approx(0.2, rel=0.25)


def test_a_row_repeats_only_where_the_body_moves():
    value = np.column_stack((np.arange(100.0), np.zeros(100)))
    value[31] = value[30]
    value[70:] = value[70]
    # of 67 rows with a change on both sides one is a repeat
    assert repeated_share(value, 0.0) == pytest.approx(1 / 67, rel=0.05)
    assert repeated_share(np.ones((50, 3)), 0.0) == 0.0


def test_a_sphere_finds_hard_iron_and_tells_when_it_saw_only_a_plane():
    directions = np.random.default_rng(2).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    found = iron_of(48.0 * directions + [15.0, -9.0, 30.0])
    assert_allclose(found.centre, [15.0, -9.0, 30.0], atol=1e-9)
    assert found.radius == pytest.approx(48.0)
    assert found.after < 1e-9 < found.before
    assert found.reach > 0.8
    flat = directions * [1.0, 1.0, 0.05]
    flat /= np.linalg.norm(flat, axis=1)[:, None]
    assert iron_of(48.0 * flat).reach < 0.1


def made(**sheet: float) -> Recording:
    """Return a log at rest but for its middle, with a gyroscope's bias of 2 deg/s."""
    t = np.arange(400) * 0.01
    rate = np.zeros((400, 3)) + np.radians([2.0, 0.0, 0.0])
    rate[150:250, 2] += 20.0
    rate += np.random.default_rng(3).normal(0.0, 1e-3, rate.shape)
    return Recording(
        "free_spin", "log", AIR, None, None, None,
        {"gyroscope": SensorSheet(100.0, **sheet)}, {"gyroscope": Samples(t, np.minimum(rate, 15.0))},
    )  # fmt: skip


def test_a_log_says_what_its_gyroscope_lacks():
    (bare,) = check("log", made(), stamps=False)
    assert bare.clipped == 100  # a quarter of the readings stand at one extreme
    assert "no time stamps: a step is assumed" in bare.lacks
    assert "noise not stated" in bare.lacks
    assert "range not stated: clipping is told by the readings alone" in bare.lacks
    assert any("(+2.0," in text for text in bare.lacks)
    (stated,) = check("log", made(noise_rms=1e-3, range=15.0))
    assert stated.clipped == 100
    assert stated.lacks[0] == "100 readings at the range"


def test_a_body_that_never_rests_has_no_rest():
    recording = made()
    assert rest_of(recording) is not None
    t = recording.samples["gyroscope"].t
    turning = Samples(t, np.column_stack((np.sin(9.0 * t), np.cos(9.0 * t), np.sin(5.0 * t))))
    assert rest_of(replace(recording, samples={"gyroscope": turning})) is None


def test_cameras_tell_iron_gain_and_lateness_of_a_magnetometer():
    t, field = np.arange(900) * 0.0035, np.array([16.0, 2.0, 42.0])
    turned = Rotation.from_rotvec(np.column_stack((np.sin(3.0 * t), np.cos(2.0 * t), 2.0 * np.sin(1.3 * t))))
    in_body = field_in_body(field, turned.as_quat()[:, [3, 0, 1, 2]])
    assert_allclose(np.linalg.norm(in_body, axis=1), np.linalg.norm(field))
    assert_allclose(turned.apply(in_body)[:, 2], -field[2])  # up in East-North-Up
    late = np.vstack((np.repeat(in_body[:1], 3, axis=0), in_body[:-3]))
    found = against_cameras(late * [1.1, 0.9, 1.0] + [8.0, 0.0, -3.0], in_body, 0.0035)
    assert found.late == pytest.approx(3 * 0.0035)
    assert_allclose(found.matrix, np.diag([1.1, 0.9, 1.0]), atol=1e-9)
    assert_allclose(found.offset, [8.0, 0.0, -3.0], atol=1e-9)
    assert found.left < 1e-9 < found.at_once < found.apart


# --------------------------------------------------------------------------------------------------- flatball


@pytest.mark.parametrize("row", [1.0, 1.22])
@pytest.mark.parametrize("spin", [60.0, -55.0])
def test_the_wobble_of_a_free_disc_tells_how_long_a_row_is(row, spin):
    """p + i q turns by (Izz/Ixx - 1) times the true angle; the grid of ratios is 0.0005, a dying line is wider."""
    excess, tilt = 0.93, 0.4 - 0.2j
    filed = np.arange(240) * 0.01
    t = filed * row
    r = spin * np.exp(-0.03 * t)
    angle = spin * (1.0 - np.exp(-0.03 * t)) / 0.03
    across = 6.0 * np.exp(-1.2 * t) * np.exp(1j * excess * angle) + tilt
    gyroscope = Samples(filed, np.column_stack((across.real, across.imag, r)))
    ratio, size, dies = wobble_rate(gyroscope, excess)
    assert ratio == pytest.approx(row, rel=0.005)
    assert dies == pytest.approx(1.2 * row, rel=0.1)
    assert 2.0 < size < 6.0


def test_each_row_tells_its_own_length_by_the_field():
    """Every fourth row is late by one step of 9.6 ms; the file says 10 ms throughout."""
    true = np.cumsum(np.where(np.arange(240) % 4 == 3, 0.0192, 0.0096))
    filed = np.arange(240) * 0.01
    angle = 55.0 * true
    field = np.column_stack((20.0 * np.cos(angle) - 12.0, -20.0 * np.sin(angle) + 5.0, np.full(240, 40.0)))
    wobble = 3.0 * np.exp(1j * (DISC.Izz / DISC.Ixx - 1.0) * angle)
    rate = np.column_stack((wobble.real, wobble.imag, np.full(240, 55.0)))
    sheet = SensorSheet(100.0, position=np.array([0.02, 0.0, 0.0]))
    alive = 1e-6 * np.sin(np.arange(240.0))  # readings that are all the same are those of a dead sensor
    force = np.column_stack((-(55.0**2) * 0.02 + alive, alive, alive))
    sheets = {"magnetometer": SensorSheet(100.0), "accelerometer": sheet, "gyroscope": SensorSheet(100.0)}
    samples = {name: Samples(filed, value) for name, value in zip(sheets, (field, force, rate), strict=True)}
    found = rows_of(Recording("free_spin", "throw", AIR, DISC, None, None, sheets, samples))
    assert found.usual == pytest.approx(0.0096, rel=1e-6)
    assert found.late == pytest.approx(0.25, abs=0.01)
    assert found.by_field == pytest.approx(1.2, rel=0.01)
    assert found.spin["accelerometer"] == pytest.approx(0.0, abs=1e-6)


def test_rows_made_longer_slow_a_decay_by_as_much():
    t = np.arange(200) * 0.01
    value = 50.0 * np.exp(-0.05 * t)
    value[7] = np.nan
    assert decay(t, value) == pytest.approx(0.05)
    recording = restamped(made(), 1.25)
    assert recording.samples["gyroscope"].interval == pytest.approx(0.0125)


# ------------------------------------------------------------------------------------------------------- golf


def thrown(name: str, cause: Cause = NONE, x: tuple[float, ...] = ()) -> Throw:
    """Return a throw as its map states it, tracked without noise to its touch-down, in a world with a cause."""
    world = cause.apply(World(DISC), np.array(x))
    release = MEASURED[name].release(0.0, 0.0, 0.0)
    t = np.arange(0.0, 9.0, 1 / 30)
    blank = Recording(
        "flight", name, AIR, DISC, None, release,
        {"track": SensorSheet(30.0, 0.025)}, {"track": Samples(t, np.zeros((t.size, 3)))},
    )  # fmt: skip
    every = Throw(blank, MEASURED[name])
    every.__dict__["kept"] = np.arange(t.size)  # each row, and not only those that a fit looks at
    path = positions(every, world, np.zeros((1, 12)))[0]
    flying = world.above(path) >= 0.0
    seen = world.seen(path, np.zeros(2))[flying]
    track = np.column_stack((seen, np.full(len(seen), np.nan)))
    return Throw(replace(blank, samples={"track": Samples(t[flying], track)}), MEASURED[name])


def test_a_throw_flown_in_its_own_world_comes_down_at_its_tracks_end():
    throw = thrown("throw1")
    found = flown(throw.recording, Model(AIR, DISC))
    # the track ends less than a frame, 1/30 s at 15 m/s, before the touch-down
    assert found.distance < 0.5
    assert found.on_the_way < 1e-3


@pytest.mark.slow
def test_a_camera_is_found_by_two_throws_and_tried_on_the_third():
    """Among the causes it alone leaves little of the throw left out, and its size is what was put in."""
    parallax = (1.0 / 60.0, 0.5, -0.2)
    throws = {name: thrown(name, CAMERA, parallax) for name in ("throw1", "throw6", "throw15")}
    plain = without_cause(throws)
    camera, drag = (held_out(cause, throws, plain) for cause in (CAMERA, DRAG))
    assert camera.helps
    assert not camera.worsens
    assert max(camera.left.values()) < 0.3 * min(1.0, max(drag.left.values()))
    assert np.all(np.abs(camera.together.x - parallax) < 3.0 * camera.together.sd + 1e-3)
    assert CAMERA.told(np.array(parallax)) == "60 m high at 30 m north, -12 m east"
    best = likely_pairs([CAMERA, DRAG, CAUSES[2]], throws, plain[tuple(throws)])[0]
    assert CAMERA in best.causes
    high = next(one for one in decided(throws, camera.together, drag.together) if one.throw.startswith("high"))
    assert high.track > 0.5


def test_a_cause_that_is_known_is_fitted_no_more():
    throws = {"throw1": thrown("throw1", DRAG, (-0.2,))}
    none = fit_cause(NONE, throws)
    found = fit_cause(DRAG, throws, none)
    assert found.merit < none.merit
    again = known(found)
    assert again.steps == ()
    table = again.apply(World(DISC), np.zeros(0)).disc.aero_table
    assert table is not None
    assert DISC.aero_table is not None
    assert_allclose(table.CD, DISC.aero_table.CD * (1.0 + found.x[0]))


def test_every_cause_changes_a_throw_and_two_act_at_once():
    throw = thrown("throw6")
    world = World(DISC)

    def said(other: World) -> np.ndarray:
        path = positions(throw, other, np.zeros((1, 12)))[0]
        return np.append(other.seen(path, throw.place).ravel(), other.above(path)[-1])

    plain = said(world)
    assert len({one.name for one in CAUSES}) == len(CAUSES)
    for cause in CAUSES[1:]:
        x = np.array(cause.steps)
        assert np.max(np.abs(said(cause.apply(world, x)) - plain)) > 1e-4, cause.name
    both = pair(DRAG, CAMERA)
    x = np.array(both.steps)
    one_by_one = CAMERA.apply(DRAG.apply(world, x[:1]), x[1:])
    assert_allclose(said(both.apply(world, x)), said(one_by_one))
    assert both.bounds.shape == (2, 4)


def test_the_inputs_of_a_throw_as_stated_are_its_stated_release():
    states, _ = drawn(MEASURED["throw6"], DISC, AIR, np.zeros(2), np.zeros(3), np.zeros((1, 12)))
    release = MEASURED["throw6"].release(0.0, 0.0, 0.0)
    assert_allclose(states[0, 3:6], release.velocity)
