"""A recording as faults of the setup leave it in its files, and what it was meant to say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.flights import FIELD

from discsim.effects import CATALOGUE, Effect, effect
from discsim.effects.setup import board_axes, field_there, on_board, permutation
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.recording import Recording, Samples, SensorSheet
from discsim.written import as_written, corrected

RNG = np.random.default_rng(7)
TIME = np.linspace(0.0, 1.0, 21)
#: every fault at once, of sizes that are not small
EVERY = (
    effect("mag.axes", axes="y x -z"),
    effect("accel.axes", axes="-x -y -z"),
    effect("gyro.axes", axes="z x y"),
    effect("gps.axes", axes="east north up"),
    effect("mag.units", written_in="mG"),
    effect("accel.units", written_in="mg"),
    effect("gyro.units", written_in="rpm"),
    effect("mag.time_offset", offset_s=0.03),
    effect("accel.time_offset", offset_s=-0.02),
    effect("gyro.time_offset", offset_s=0.1),
    effect("track.time_offset", offset_s=0.15),
    effect("gps.time_offset", offset_s=-0.2),
    effect("board.rotation", rx_rad=0.5, ry_rad=-1.0, rz_rad=2.0),
    effect("site.field", declination_rad=0.3, inclination_rad=-0.1, ratio=0.95),
    effect("clock.units", written_in="ms"),
)


def sound(limit: float | None = None, **given: np.ndarray) -> Recording:
    values = {
        "magnetometer": 40.0 * RNG.standard_normal((21, 3)),
        "accelerometer": 30.0 * RNG.standard_normal((21, 3)),
        "gyroscope": 10.0 * RNG.standard_normal((21, 3)),
        "gps": RNG.standard_normal((21, 6)),
        "track": RNG.standard_normal((21, 3)),
        "rate_reference": RNG.standard_normal(21),
        **given,
    }
    sheets = {name: SensorSheet(20.0, 0.1, 0.01, limit) for name in values}
    samples = {name: Samples(TIME, value) for name, value in values.items()}
    return Recording("flight", "sound", FIELD, sheets=sheets, samples=samples)


def assert_same(a: Recording, b: Recording) -> None:
    """To the rounding of a few products of numbers below 1e5."""
    for name, samples in a.samples.items():
        np.testing.assert_allclose(samples.t, b.need(name).t, rtol=0, atol=1e-14)
        np.testing.assert_allclose(samples.value, b.need(name).value, rtol=1e-13, atol=1e-12)


def test_every_fault_of_the_setup_is_tried_here():
    assert [item.id for item in EVERY] == [
        id for id in CATALOGUE if id.endswith((".axes", ".units", ".time_offset", ".rotation", "site.field"))
    ]


@pytest.mark.parametrize("faults", [*((one,) for one in EVERY), EVERY], ids=lambda faults: faults[0].id)
def test_what_is_corrected_is_the_sound_recording_again(faults):
    recording = sound()
    written = as_written(recording, faults)
    assert_same(corrected(written, faults), recording)
    assert (written.sheets, written.name, written.environment) == (recording.sheets, "sound", FIELD)


@pytest.mark.parametrize("fault", [one for one in EVERY if one.id != "site.field"], ids=lambda fault: fault.id)
def test_a_fault_changes_what_it_acts_on_and_no_other_sensor(fault):
    recording = sound()
    written = as_written(recording, [fault])
    for name, samples in recording.samples.items():
        same = np.array_equal(samples.value, written.need(name).value) and np.array_equal(
            samples.t, written.need(name).t
        )
        on_it = fault.row.acts_on in (name, "clock")
        on_board = fault.row.acts_on == "board" and name in ("magnetometer", "accelerometer", "gyroscope")
        assert same is not (on_it or on_board), name


def test_column_x_holds_body_y_where_the_axes_begin_with_y():
    value = np.tile([1.0, 2.0, 3.0], (21, 1))
    written = as_written(sound(magnetometer=value), [effect("mag.axes", axes="y x -z")])
    np.testing.assert_array_equal(written.need("magnetometer").value[0], [2.0, 1.0, -3.0])
    cyclic = as_written(sound(magnetometer=value), [effect("mag.axes", axes="z x y")])
    np.testing.assert_array_equal(cyclic.need("magnetometer").value[0], [3.0, 1.0, 2.0])
    np.testing.assert_array_equal(permutation(effect("mag.axes", axes="z x y").value) @ [1, 2, 3], [3, 1, 2])


def test_a_gps_in_east_north_up_has_its_velocities_so_too():
    fix = np.tile([1.0, 2.0, 3.0, 4.0, 5.0, 6.0], (21, 1))
    written = as_written(sound(gps=fix), [effect("gps.axes", axes="east north up")])
    np.testing.assert_array_equal(written.need("gps").value[0], [2.0, 1.0, -3.0, 5.0, 4.0, -6.0])


@pytest.mark.parametrize(
    ("id", "unit", "sensor", "one", "number"),
    [
        ("gyro.units", "deg/s", "gyroscope", np.pi, 180.0),
        ("gyro.units", "rpm", "gyroscope", 2 * np.pi, 60.0),
        ("accel.units", "g", "accelerometer", 9.80665, 1.0),
        ("accel.units", "mg", "accelerometer", 9.80665, 1000.0),
        ("mag.units", "mG", "magnetometer", 50.0, 500.0),
        ("mag.units", "G", "magnetometer", 50.0, 0.5),
        ("mag.units", "nT", "magnetometer", 50.0, 50000.0),
        ("mag.units", "T", "magnetometer", 50.0, 5e-5),
    ],
)
def test_another_unit_stands_for_the_same_quantity(id, unit, sensor, one, number):
    written = as_written(sound(**{sensor: np.full((21, 3), one)}), [effect(id, written_in=unit)])
    np.testing.assert_allclose(written.need(sensor).value, number, rtol=1e-15)


@pytest.mark.parametrize(("unit", "last"), [("ms", 1e3), ("us", 1e6)])
def test_a_clock_in_another_unit_is_that_of_every_sensor(unit, last):
    written = as_written(sound(), [effect("clock.units", written_in=unit)])
    assert {samples.t[-1] for samples in written.samples.values()} == {last}


def test_times_are_shifted_before_they_are_written_in_milliseconds():
    faults = [effect("mag.time_offset", offset_s=0.02), effect("clock.units", written_in="ms")]
    written = as_written(sound(), faults)
    np.testing.assert_allclose(written.need("magnetometer").t, 20.0 + 1000.0 * TIME, rtol=1e-15)


def test_a_board_turned_by_a_quarter_about_z_reads_body_y_on_its_x():
    """The board's x axis points along body y then: C^T (0, 1, 0) = (1, 0, 0)."""
    along_y = np.tile([0.0, 1.0, 0.0], (21, 1))
    written = as_written(sound(gyroscope=along_y), [effect("board.rotation", rz_rad=np.pi / 2)])
    np.testing.assert_allclose(written.need("gyroscope").value[0], [1.0, 0.0, 0.0], atol=1e-15)


def test_a_board_is_turned_before_its_columns_are_mixed_up():
    fault = effect("board.rotation", rx_rad=0.4, rz_rad=-0.7)
    value = RNG.standard_normal((21, 3))
    written = as_written(sound(magnetometer=value), [fault, effect("mag.axes", axes="y x -z")])
    expected = (value @ board_axes(fault.value))[:, [1, 0, 2]] * [1.0, 1.0, -1.0]
    np.testing.assert_allclose(written.need("magnetometer").value, expected, atol=1e-15)


class TestClippedOnATurnedBoard:
    """A reading at the range says only "at least so much": what is mixed with it is unknown."""

    clipped = np.tile([1.0, 2.0, 35.0], (21, 1))

    def test_the_axes_that_it_takes_part_in_are_gaps(self):
        turned = [effect("board.rotation", rx_rad=0.1)]
        meant = corrected(sound(limit=35.0, gyroscope=self.clipped), turned).need("gyroscope").value
        np.testing.assert_allclose(meant[:, 0], 1.0)
        assert np.all(np.isnan(meant[:, 1:]))

    def test_a_right_angle_only_renames_it(self):
        turned = [effect("board.rotation", rx_rad=np.pi)]
        meant = corrected(sound(limit=35.0, gyroscope=self.clipped), turned).need("gyroscope").value
        np.testing.assert_allclose(meant, [[1.0, -2.0, -35.0]] * 21, rtol=1e-15)

    def test_the_range_is_that_of_the_right_unit(self):
        """2000 deg/s are 34.9 rad/s: written as 2000 they are clipped, written as 40 they are not."""
        faults = [effect("board.rotation", rx_rad=0.1), effect("gyro.units", written_in="deg/s")]
        value = np.tile([1.0, 2.0, 40.0], (21, 1))
        value[0, 2] = 2000.0
        meant = corrected(sound(limit=np.radians(2000.0), gyroscope=value), faults).need("gyroscope").value
        assert np.all(np.isnan(meant[0, 1:]))
        assert np.all(np.isfinite(meant[1:]))

    def test_an_absent_axis_leaves_gaps_in_those_that_it_takes_part_in(self):
        value = self.clipped.copy()
        value[:, 1] = np.nan
        meant = corrected(sound(gyroscope=value), [effect("board.rotation", rz_rad=0.1)]).need("gyroscope").value
        assert np.all(np.isnan(meant[:, :2]))
        np.testing.assert_allclose(meant[:, 2], 35.0)


class TestFieldThatIsThere:
    def test_declination_turns_it_about_down_dip_tips_it_and_the_ratio_scales_it(self):
        there = field_there(effect("site.field", declination_rad=0.2).value, np.array([20.0, 0.0, 40.0]))
        np.testing.assert_allclose(there, [20.0 * np.cos(0.2), 20.0 * np.sin(0.2), 40.0], rtol=1e-14)
        there = field_there(effect("site.field", inclination_rad=0.1, ratio=2.0).value, np.array([30.0, 0.0, 0.0]))
        np.testing.assert_allclose(there, [60.0 * np.cos(0.1), 0.0, 60.0 * np.sin(0.1)], rtol=1e-14)

    def test_no_fault_leaves_every_bit(self):
        assert field_there(effect("site.field").value, FIELD.magnetic_field) is FIELD.magnetic_field

    def test_a_correction_states_the_field_that_is_there_and_leaves_the_readings(self):
        fault = effect("site.field", declination_rad=0.3, ratio=1.1)
        recording = sound()
        meant = corrected(recording, [fault])
        np.testing.assert_array_equal(meant.environment.magnetic_field, field_there(fault.value, FIELD.magnetic_field))
        assert isinstance(meant.environment, Environment)
        assert_same(meant, recording)


class TestSettings:
    def test_they_have_one_spelling(self):
        assert effect("mag.axes", axes=" +y   x  -z").value.axes == "y x -z"

    @pytest.mark.parametrize(
        ("id", "given", "message"),
        [
            ("mag.axes", {"axes": "x x z"}, r"mag\.axes: axes is 'x x z', expected x, y and z once each"),
            ("mag.axes", {"axes": "x y"}, "expected x, y and z once each"),
            ("mag.axes", {"axes": "x y w"}, "expected x, y and z once each"),
            ("gps.axes", {"axes": "east west up"}, "expected three directions once each, such as 'east north up'"),
            ("gyro.units", {"written_in": "degrees"}, r"'degrees', expected one of rad/s, deg/s, rpm"),
            ("clock.units", {"written_in": "min"}, "expected one of s, ms, us"),
            ("gyro.units", {"written_in": 3.0}, "written_in is 3.0, expected a text"),
            ("mag.axes", {"written_in": "G"}, "unknown setting 'written_in'; expected axes"),
            ("site.field", {"ratio": "1.1"}, "ratio is '1.1', expected a number"),
            ("site.field", {"ratio": 0.0}, "ratio is 0; expected a number above zero"),
            ("mag.time_offset", {"offset_s": float("nan")}, "offset_s is not finite"),
        ],
    )
    def test_what_cannot_be_is_refused(self, id, given, message):
        with pytest.raises(InputError, match=message):
            effect(id, **given)

    def test_a_fault_given_twice_is_refused(self):
        with pytest.raises(InputError, match="given twice"):
            as_written(sound(), [effect("mag.axes"), effect("mag.axes")])

    def test_an_effect_tells_its_numbers_and_its_texts_apart(self):
        assert (EVERY[0].sizes, EVERY[0].setting) == ({}, {"axes": "y x -z"})
        assert (EVERY[7].sizes, EVERY[7].setting) == ({"offset_s": 0.03}, {})
        assert CATALOGUE["mag.axes"].settings == ("axes",)
        assert CATALOGUE["mag.axes"].parameters == ()


def test_readings_of_no_fault_are_untouched():
    recording = sound()
    nothing = [Effect(item.id, item.row.baseline) for item in EVERY]
    for made in (as_written(recording, nothing), corrected(recording, nothing)):
        for name, samples in recording.samples.items():
            np.testing.assert_array_equal(made.need(name).value, samples.value)
            np.testing.assert_array_equal(made.need(name).t, samples.t)


def test_vectors_on_a_turned_board_turn_back_by_its_axes():
    fault = effect("board.rotation", rx_rad=1.0, ry_rad=2.0, rz_rad=-0.5).value
    vector = RNG.standard_normal((5, 3))
    np.testing.assert_allclose(on_board(fault, vector) @ board_axes(fault).T, vector, atol=1e-14)


@pytest.mark.parametrize(("unit", "ticks"), [("ms", 1e3), ("us", 1e6)])
def test_a_command_in_the_unit_of_the_sensors_is_mended_with_them_and_one_in_seconds_stays(unit, ticks):
    """A drive has a clock of its own: its profile may be in seconds where the logger's times are not."""
    fault = [effect("clock.units", written_in=unit)]
    right = sound()
    end = max(one.t[-1] for one in right.samples.values())
    knots = Samples(np.array([0.0, 0.4, 1.0]) * end, np.array([18.0, 18.0, 32.0]))
    written = as_written(replace(right, command=knots), fault)
    as_well = replace(written, command=Samples(ticks * knots.t, knots.value))
    for one in (written, as_well):
        command = corrected(one, fault).command
        assert command is not None
        np.testing.assert_allclose(command.t, knots.t, rtol=1e-12)
