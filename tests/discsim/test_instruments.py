"""Modules of sensors: shipped parts, specimens within their data sheets, effects upon them, and their recording."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.flights import DRIVER, FIELD, throw
from support.turning import turning

from discsim.disc import Rig
from discsim.effects import CATALOGUE, Effect, Row, effect
from discsim.effects.kind import BOARD
from discsim.effects.sensors import ClockRate, PositionOffset
from discsim.effects.timing_rows import ImuClock
from discsim.engine import fly
from discsim.errors import InputError
from discsim.files import model_file, model_names
from discsim.motion import Motion
from discsim.recording import SENSORS, Recording, Samples, read_recording, write_recording
from discsim.rig import spin_down
from discsim.sensors import (
    Accelerometer,
    Gps,
    Gyroscope,
    Instruments,
    Magnetometer,
    Noise,
    RateReference,
    Sampling,
    Tracker,
    record,
)

FLIGHT = fly(DRIVER, FIELD, throw(wobble=(3.0, -2.0)), duration=0.8)
MODULE = Instruments.from_parts("mpu9250", "neo_m8n", "ac1120s")
IDEAL = Instruments.from_parts("ideal")
ON_SENSORS = [row for row in CATALOGUE.values() if row.acts_on != "motion"]


def recorded(
    module: Instruments, motion: Motion = FLIGHT, seed: int = 3, effects: tuple[Effect, ...] = (), **stated: Any
) -> Recording:
    fitted = module.with_effects(effects)
    stated = {"plant": "flight", "name": "test", "disc": DRIVER} | stated
    return record(motion, fitted, np.random.default_rng(seed), **stated)


#: another setting than the sound one, by the end of the effect's id or by the whole of it
FAULTS = {
    "axes": "y x -z",
    "gps.axes": "east north up",
    "mag.units": "G",
    "accel.units": "g",
    "gyro.units": "rpm",
    "clock.units": "ms",
}


def sized(row: Row, times: float) -> Effect:
    """An effect of so many times its scale, or of another setting; a saturation and a stray field that show."""
    given = {name: none + times * scale for (name, none), scale in zip(row.sizes.items(), row.scale, strict=True)}
    if row.id == "accel.saturation":
        given = {"limit_m_s2": 30.0}
    if row.id == "track.camera":
        given["height_m"] = 60.0
    if row.id == "mag.stray_field":
        given["height_m"] = 1.0
    faulty = FAULTS.get(row.id) or FAULTS.get(row.id.split(".")[1], "")
    return effect(row.id, **given, **dict.fromkeys(row.settings, faulty))


def same(a: Recording, b: Recording, *sensors: str) -> bool:
    return all(
        np.array_equal(a.need(name).t, b.need(name).t)
        and np.array_equal(a.need(name).value, b.need(name).value, equal_nan=True)
        for name in sensors or SENSORS
        if sensors or name in a
    )


class TestParts:
    @pytest.mark.parametrize("name", model_names("parts"))
    def test_every_shipped_part_reads_and_measures(self, name):
        part = Instruments.from_parts(name)
        recording = recorded(part)
        assert set(recording.samples) == set(part.sensors)
        for sensor, samples in recording.samples.items():
            assert len(samples) == 1 + np.floor(0.8 * part.sensors[sensor].sampling.rate_hz + 1e-9)

    def test_the_parts_of_the_physics_reference_are_there(self):
        assert {"mpu9250", "adxrs649", "neo_m8n", "ideal"} <= set(model_names("parts"))

    def test_an_mpu_9250_is_what_the_reference_says(self):
        """+-16 g and +-2000 deg/s at 16 bit, 0.3 % of g, +-4912 uT in steps of 0.15 uT, 16.1 mm from the axis."""
        accelerometer, gyroscope, magnetometer = (
            MODULE.sensors[name].sheet for name in ("accelerometer", "gyroscope", "magnetometer")
        )
        assert accelerometer.range == pytest.approx(16 * 9.80665, rel=1e-6)
        assert accelerometer.resolution == pytest.approx(16 * 9.80665 / 2**15, rel=1e-4)
        assert accelerometer.noise_rms == pytest.approx(0.003 * 9.80665, rel=1e-3)
        np.testing.assert_array_equal(accelerometer.position, [-0.0161, 0.0, 0.0])
        assert np.degrees(gyroscope.range) == pytest.approx(2000.0, rel=1e-5)
        assert gyroscope.resolution == pytest.approx(np.radians(2000.0) / 2**15, rel=1e-4)
        assert (magnetometer.rate_hz, magnetometer.range, magnetometer.resolution) == (100.0, 4912.0, 0.15)

    def test_an_adxrs649_has_one_axis_and_a_wide_range(self):
        gyroscope = Instruments.from_parts("adxrs649").sensors["gyroscope"]
        assert gyroscope.axes == (False, False, True)
        assert np.degrees(gyroscope.range) == pytest.approx(20000.0, rel=1e-6)

    def test_ideal_sensors_have_no_error(self):
        got = recorded(IDEAL, turning(50.0, 0.2), plant="rate_table", disc=None)
        np.testing.assert_array_equal(got.need("gyroscope").value, np.tile([0.0, 0.0, 50.0], (201, 1)))
        np.testing.assert_array_equal(got.need("rate_reference").value, 50.0)

    def test_of_two_parts_with_one_sensor_the_later_counts(self):
        both = Instruments.from_parts("mpu9250", "adxrs649")
        assert both.sensors["gyroscope"].axes == (False, False, True)
        assert both.worst_case["gyroscope"].scale == 0.05
        assert set(both.sensors) == {"accelerometer", "gyroscope", "magnetometer"}
        assert Instruments.from_parts("mpu9250", "ideal").worst_case["accelerometer"].cross_axis == 0.0

    def test_a_part_may_be_a_file(self, tmp_path):
        path = tmp_path / "mine.toml"
        path.write_text('name = "mine"\n[magnetometer]\nrate_hz = 155.0\nnoise_rms_uT = 0.3\n[track]\nrate_hz = 60.0\n')
        mine = Instruments.from_parts(str(path)).sensors
        assert mine["magnetometer"].sheet.rate_hz == 155.0
        assert mine["magnetometer"].noise == Noise(0.3)
        assert mine["track"] == Tracker(Sampling(60.0))

    @pytest.mark.parametrize(
        ("old", "new", "place", "message"),
        [
            ("noise_rms_uT", "noise_rms_ut", "noise_rms_ut", "unknown key 'magnetometer.noise_rms_ut'; did you mean"),
            ("[magnetometer]", "[magnetometre]", "[magnetometre]", "unknown key 'magnetometre'"),
            ("cross_axis", "cross_axes", "cross_axes", "unknown key 'accelerometer.worst_case.cross_axes'"),
            ("rate_hz = 100.0", "rate_hz = 0.0", "rate_hz = 0.0", "is 0.0, expected a number above zero"),
            ("nonlinearity = 0.005", "nonlinearity = -1", "nonlinearity = -1", "is -1, expected at least 0"),
            ("position_m = [-0.0161, 0.0, 0.0]", "", "[accelerometer]", "missing key 'position_m'"),
            ('name = "MPU-9250 with AK8963"', "", None, "missing key 'name'"),
        ],
    )
    def test_a_damaged_part_is_refused_with_its_line(self, tmp_path, old, new, place, message):
        text = model_file("parts/mpu9250.toml").read_text()
        assert old in text
        path = tmp_path / "mine.toml"
        path.write_text(text.replace(old, new, 1))
        line = [k for k, row in enumerate(path.read_text().splitlines(), 1) if place and row.startswith(place)]
        with pytest.raises(InputError) as caught:
            Instruments.from_parts(str(path))
        assert message in str(caught.value)
        assert str(caught.value).startswith(f"{path}:{line[0]}:" if line else f"{path}: ")

    def test_axes_that_are_none_are_refused(self, tmp_path):
        path = tmp_path / "mine.toml"
        path.write_text('name = "mine"\n[gyroscope]\nrate_hz = 155.0\naxes = "w"\n')
        with pytest.raises(InputError, match=r"mine\.toml:4: axes is 'w', expected letters out of 'xyz'"):
            Instruments.from_parts(str(path))

    def test_a_part_without_a_sensor_and_a_part_that_is_not_there_are_refused(self, tmp_path):
        path = tmp_path / "mine.toml"
        path.write_text('name = "mine"\n')
        with pytest.raises(InputError, match="no sensor in this part"):
            Instruments.from_parts(str(path))
        with pytest.raises(
            InputError, match=r"no shipped file 'parts/mpu\.toml'; expected one of ac1120s, adxl375, adxrs649"
        ):
            Instruments.from_parts("mpu")
        with pytest.raises(InputError, match=r"gone\.toml: no such file"):
            Instruments.from_parts(str(tmp_path / "gone.toml"))


class TestSpecimens:
    drawn = tuple(MODULE.drawn(np.random.default_rng(seed)) for seed in range(300))

    @pytest.mark.parametrize(
        ("sensor", "field", "bound"),
        [
            ("accelerometer", "scale", [0.005] * 3),
            ("accelerometer", "cross_axis", [0.02] * 6),
            ("accelerometer", "bias", [0.588, 0.588, 0.785]),
            ("gyroscope", "scale", [0.03] * 3),
            ("gyroscope", "bias", [0.0873] * 3),
            ("gyroscope", "g_sensitivity", [0.000178] * 3),
        ],
    )
    def test_errors_are_drawn_evenly_within_the_data_sheet(self, sensor, field, bound):
        """Of 300 draws none beyond its bound, each axis reaches nine tenths of it (but for 2e-14), and the mean square
        is bound^2/3 (4 sigma: 4 sqrt(4/45/300) = 7 % of bound^2)."""
        drawn = np.array([getattr(module.sensors[sensor], field) for module in self.drawn]) / np.array(bound)
        assert np.abs(drawn).max() <= 1.0
        assert np.all(np.abs(drawn).max(axis=0) > 0.9)
        assert np.all(drawn.min(axis=0) < 0)
        np.testing.assert_allclose(np.mean(drawn**2, axis=0), 1 / 3, atol=0.07)

    def test_axes_differ_from_each_other(self):
        cross = np.array([module.sensors["accelerometer"].cross_axis for module in self.drawn])
        correlation = np.corrcoef(cross.T) - np.eye(6)
        assert np.abs(correlation).max() < 4.5 / np.sqrt(300)

    def test_what_a_sheet_does_not_bound_stays_exact(self):
        assert self.drawn[0].sensors["magnetometer"] is MODULE.sensors["magnetometer"]
        assert IDEAL.drawn(np.random.default_rng(0)).sensors["accelerometer"].scale == (0.0, 0.0, 0.0)

    def test_the_same_seed_draws_the_same_specimen(self):
        again = MODULE.drawn(np.random.default_rng(5)).sensors
        assert again["accelerometer"].bias == self.drawn[5].sensors["accelerometer"].bias
        assert again["accelerometer"].bias != self.drawn[6].sensors["accelerometer"].bias


class TestModule:
    def test_an_unknown_sensor_is_refused(self):
        with pytest.raises(InputError, match="unknown sensor 'magnetometre'; expected one of magnetometer"):
            Instruments({"magnetometre": Magnetometer()})

    def test_fitting_what_is_not_there_is_refused(self):
        with pytest.raises(InputError, match="no track in this module; it has magnetometer, accelerometer"):
            MODULE.fitted("track", unseen=0.1)

    def test_sensors_can_be_left_out(self):
        assert set(MODULE.without("gps", "rate_reference").sensors) == {"magnetometer", "accelerometer", "gyroscope"}

    def test_a_gyroscope_feels_the_force_where_the_accelerometer_sits(self):
        """Moving the accelerometer moves the place whose force fakes rates; its unknown offset does not."""
        place = np.array([-0.03, 0.01, 0.0])
        moved = IDEAL.fitted("accelerometer", position=place, offset=PositionOffset(0.005))
        got = recorded(moved, effects=(effect("gyro.g_sensitivity", kx=0.001, ky=0.002, kz=0.003),))
        still = IDEAL.fitted("accelerometer", position=place)
        f = recorded(still).need("accelerometer").value
        expected = recorded(IDEAL).need("gyroscope").value + f * [0.001, 0.002, 0.003]
        np.testing.assert_allclose(got.need("gyroscope").value, expected, atol=2e-9)


class TestEffects:
    @pytest.mark.parametrize("row", ON_SENSORS, ids=lambda row: row.id)
    def test_an_effect_at_its_baseline_changes_no_bit(self, row):
        """On a noisy specimen, whose own errors of that kind are zero."""
        assert same(recorded(MODULE), recorded(MODULE, effects=(Effect(row.id, row.baseline),)))

    @pytest.mark.parametrize("row", ON_SENSORS, ids=lambda row: row.id)
    def test_an_effect_changes_its_own_sensor_and_no_other(self, row):
        changed = recorded(IDEAL, effects=(sized(row, 20.0),))
        plain = recorded(IDEAL)
        # the chip that free-runs is that of gyroscope and accelerometer; the field has a part of its own
        board = BOARD - {"magnetometer"} if row.type is ImuClock else BOARD
        for name in plain.samples:
            touched = row.acts_on in (name, "clock") or (row.acts_on == "board" and name in board)
            assert same(plain, changed, name) is not touched, name

    def test_all_baselines_together_change_no_bit(self):
        everything = tuple(Effect(row.id, row.baseline) for row in CATALOGUE.values())
        assert same(recorded(MODULE), recorded(MODULE, effects=everything))

    def test_effects_of_absent_sensors_are_passed_over(self):
        magnetometer = IDEAL.without(*(name for name in IDEAL.sensors if name != "magnetometer"))
        got = recorded(magnetometer, effects=(effect("accel.bias", bx_m_s2=1.0), effect("air.wind", w_north_m_s=1.0)))
        assert same(got, recorded(magnetometer))

    @pytest.mark.parametrize("sensor", ["mag", "accel", "gyro", "gps"])
    def test_a_sensor_s_wrong_clock_writes_ratio_times_true_time(self, sensor):
        name = {"mag": "magnetometer", "accel": "accelerometer", "gyro": "gyroscope", "gps": "gps"}[sensor]
        got = recorded(IDEAL, effects=(effect(f"{sensor}.clock_rate", ratio=1.25),))
        fast = recorded(
            IDEAL.fitted(name, sampling=Sampling(IDEAL.sensors[name].sampling.rate_hz * 1.25)),
        )
        np.testing.assert_allclose(got.need(name).t, 1.25 * fast.need(name).t, rtol=1e-14)
        np.testing.assert_allclose(got.need(name).value, fast.need(name).value, atol=1e-8)
        assert got.sheets[name].rate_hz == IDEAL.sensors[name].sampling.rate_hz

    def test_the_shared_clock_is_every_sensor_s(self):
        """It multiplies a sensor's own; 0.8 s of truth are written as 0.8 s x 1.25 (x 0.8)."""
        got = recorded(IDEAL, effects=(effect("clock.rate", ratio=1.25), effect("mag.clock_rate", ratio=0.8)))
        for name, samples in got.samples.items():
            ends = 0.8 if name == "magnetometer" else 1.0
            assert samples.t[-1] == pytest.approx(ends, abs=1e-9), name
        assert np.array_equal(got.need("magnetometer").value, recorded(IDEAL).need("magnetometer").value)

    @pytest.mark.parametrize(
        ("given", "message"),
        [
            (("mag.dropped_samples", {"fraction": 1.5}), r"lost \(dropped\) is 1.5"),
            (("accel.dropped_samples", {"fraction": -0.1}), r"lost \(dropped\) is -0.1"),
            (("gyro.clock_rate", {"ratio": 0.0}), "clock rate is 0"),
            (("clock.rate", {"ratio": -1.0}), "clock rate is -1"),
            (("mag.lag", {"tau_s": -0.1}), "lag is -0.1 s"),
            (("gps.latency", {"delay_s": -0.1}), "latency is -0.1 s"),
            (("mag.stray_field", {"height_m": 0.0}), "dies out over 0 m"),
            (("accel.saturation", {"limit_m_s2": -1.0}), "saturates at -1"),
        ],
    )
    def test_a_size_that_cannot_be_is_refused(self, given, message):
        with pytest.raises(InputError, match=message):
            recorded(IDEAL, effects=(effect(given[0], **given[1]),))

    @pytest.mark.parametrize("size", [float("nan"), float("inf")])
    def test_a_size_that_is_no_number_is_refused(self, size):
        with pytest.raises(InputError, match=r"mag\.hard_iron: by_uT is not finite"):
            effect("mag.hard_iron", by_uT=size)
        assert effect("accel.saturation", limit_m_s2=float("inf")).value.limit_m_s2 == float("inf")


class TestRecord:
    def test_the_same_seed_gives_the_same_bits_and_another_seed_others(self):
        first = recorded(MODULE)
        assert same(first, recorded(MODULE))
        assert not same(first, recorded(MODULE, seed=4), "magnetometer")

    def test_each_sensor_draws_from_a_stream_of_its_own(self):
        """A sensor more or less, or another error of one, leaves the noise of all others."""
        whole = recorded(MODULE)
        for name in MODULE.sensors:
            rest = [other for other in MODULE.sensors if other != name]
            assert same(whole, recorded(MODULE.without(name)), *rest)
            sampling = replace(MODULE.sensors[name].sampling, jitter_s=1e-4)
            assert same(whole, recorded(MODULE.fitted(name, sampling=sampling)), *rest)

    def test_sheets_state_no_hidden_error(self):
        """The sheet of a bad specimen with every effect on it is the data sheet's."""
        bad = tuple(sized(row, 1.0) for row in ON_SENSORS)
        stated = recorded(MODULE.drawn(np.random.default_rng(1)), effects=bad).sheets
        for name, sheet in recorded(MODULE).sheets.items():
            for what in ("rate_hz", "noise_rms", "resolution", "range", "velocity_noise_rms"):
                assert getattr(stated[name], what) == getattr(sheet, what), (name, what)
            assert np.array_equal(stated[name].position, sheet.position) or sheet.position is None

    def test_it_carries_what_is_stated_and_no_truth(self):
        got = recorded(MODULE)
        assert (got.plant, got.name, got.disc, got.rig, got.release) == ("flight", "test", DRIVER, None, None)
        assert got.environment is FLIGHT.environment

    @pytest.mark.parametrize(
        ("given", "says"),
        [
            ({"rng": 7}, "rng is 7, of type int; expected a generator of random numbers: np.random.default_rng(7)"),
            ({"rng": None}, "rng is None, of type NoneType; expected a generator"),
            ({"motion": "driver"}, "motion is 'driver', of type str; expected a Motion: fly(...) returns one"),
            ({"instruments": "mpu9250"}, 'expected sensors: Instruments.from_parts("mpu9250")'),
            ({"plant": "Flight"}, "plant is 'Flight', expected one of 'flight', "),
            ({"name": None}, "name is None, of type NoneType; expected a text"),
        ],
    )
    def test_what_it_cannot_use_is_refused_at_the_door(self, given, says):
        arguments = {"motion": FLIGHT, "instruments": MODULE, "rng": np.random.default_rng(0), "plant": "flight"}
        with pytest.raises(InputError, match=re.escape(says)):
            record(**({**arguments, "name": "x"} | given))

    def test_a_seed_is_no_generator_of_specimens(self):
        with pytest.raises(InputError, match=r"expected a generator of random numbers: np\.random\.default_rng\(3\)"):
            MODULE.drawn(3)  # type: ignore[arg-type]

    def test_a_sensor_that_saw_nothing_is_left_out(self):
        late = recorded(MODULE, effects=(effect("gps.latency", delay_s=2.0),))
        assert "gps" not in late
        assert "gps" not in late.sheets

    @pytest.mark.parametrize("plant", ["flight", "spin_down", "rate_table"])
    def test_written_and_read_back_it_is_the_same_to_the_last_bit(self, tmp_path, plant):
        rig = Rig(1.1e-3, 3e-5) if plant == "spin_down" else None
        motion = spin_down(rig, FIELD, 60.0, 0.5) if rig else FLIGHT
        knots = Samples(np.array([0.0, 0.7]), np.array([0.1, 0.3])) if plant == "rate_table" else None
        sensors = {**MODULE.sensors, "track": Tracker(noise=Noise(0.01), unseen=0.3)}
        module = Instruments(sensors, worst_case=MODULE.worst_case).drawn(np.random.default_rng(2))
        disc = DRIVER if plant == "flight" else None
        written = recorded(module, motion, plant=plant, disc=disc, rig=rig, command=knots)
        write_recording(written, tmp_path / "recording")
        read = read_recording(tmp_path / "recording")
        assert set(read.samples) == set(written.samples) == set(SENSORS)
        assert same(written, read)
        assert (read.plant, read.name) == (plant, "test")
        np.testing.assert_array_equal(read.environment.magnetic_field, FIELD.magnetic_field)
        for name, sheet in written.sheets.items():
            for what in ("rate_hz", "noise_rms", "resolution", "range", "velocity_noise_rms"):
                assert getattr(read.sheets[name], what) == getattr(sheet, what), (name, what)
            np.testing.assert_array_equal(read.sheets[name].position, sheet.position)
        if knots is not None:
            np.testing.assert_array_equal(read.command.value, knots.value)

    def test_the_axes_an_adxrs649_lacks_are_gaps_of_its_file(self, tmp_path):
        write_recording(recorded(Instruments.from_parts("adxrs649")), tmp_path / "wide")
        gyroscope = read_recording(tmp_path / "wide").need("gyroscope")
        assert gyroscope.gaps == 2 * len(gyroscope)

    def test_every_sensor_can_be_bare(self):
        bare = Instruments(
            {
                "magnetometer": Magnetometer(),
                "accelerometer": Accelerometer(),
                "gyroscope": Gyroscope(),
                "gps": Gps(),
                "rate_reference": RateReference(),
                "track": Tracker(),
            },
            clock=ClockRate(),
        )
        assert set(recorded(bare).samples) == set(SENSORS)
