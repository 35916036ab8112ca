"""What a function of Python is given is checked at its door, and the error says what makes a right argument."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest
from support.flights import DRIVER, FIELD, throw

import discsim as ds
from discsim.disc import Aero
from discsim.errors import require_number, require_type
from discsim.sensors.sampling import Sampling

T = np.arange(0.0, 3.0, 0.01)
XYZ = 40.0 * np.column_stack([np.cos(30.0 * T), -np.sin(30.0 * T), 0.0 * T])


BOARD = ds.Instruments.from_parts("mpu9250")


def tilted(roll: float) -> ds.Release:
    return ds.Release(velocity=np.array([24.0, 0.0, -4.0]), body_rate=np.array([0.0, 0.0, 70.0]), roll=roll)


def headed(yaw: float) -> ds.Release:
    """Return a throw whose yaw is given, rad."""
    return ds.Release(velocity=[20.0, 0.0, 0.0], body_rate=[0.0, 0.0, 60.0], yaw=yaw)


def arrays(readings: object) -> ds.Recording:
    return ds.recording_from_arrays(readings)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: ds.Disc("0.175", 0.21, 6e-4, 1.15e-3), "disc mass is '0.175', of type str; expected a finite number"),
        (lambda: ds.Disc(0.175, -0.21, 6e-4, 1.15e-3), "disc diameter is -0.21; expected a finite number above zero"),
        (lambda: ds.Disc(0.175, 0.21, 6e-4, 1.15e-3, {"CL0": 0.1}), "of type dict; expected Aero(CL0=..., "),
        (lambda: ds.Environment(gravity=-9.8), "gravity is -9.8; expected a finite number, at least 0 (m/s^2)"),
        (lambda: ds.Environment(air_density="1.2"), "air_density is '1.2', of type str; expected a finite number"),
        (lambda: ds.Release(roll="10"), "release roll is '10', of type str; expected a finite number (rad)"),
        (lambda: ds.Release(pitch=float("nan")), "release pitch is nan; expected a finite number (rad)"),
        (lambda: ds.Instruments(["mpu9250"]), "of type list; expected them by name, or Instruments.from_parts("),
        (lambda: ds.Instruments({"gyroscope": "mpu9250"}), "expected a Gyroscope(...) of discsim.sensors"),
        (lambda: ds.Instruments.from_parts(["mpu9250", "neo_m8n"]), "of type list; expected names one by one"),
        (lambda: BOARD.fitted("magnetometer", rate_hz=50), "magnetometer has no 'rate_hz'; expected one of sampling, "),
        (lambda: BOARD.fitted("magnetometer", rate_hz=50), "a rate is that of sampling=Sampling(rate_hz)"),
        (
            lambda: ds.fly(DRIVER, FIELD, tilted(-12.0)),
            "release roll is -12 rad, more than a whole turn; expected radi",
        ),
        (lambda: ds.predict(DRIVER, FIELD, tilted(-12.0)), "radians: of -12 degrees -0.2094"),
        (
            lambda: ds.predict(DRIVER, FIELD, headed(90.0)),
            "release yaw is 90 rad, more than a whole turn; expected radi",
        ),
        (lambda: ds.effect(None), "an effect's id is None"),
        (
            lambda: ds.effect("air.wind", w_north_m_s=[1, 2]),
            "air.wind: w_north_m_s is [1, 2], expected a number",
        ),
        (
            lambda: ds.effect("air.wind", w_north_m_s="1"),
            "air.wind: w_north_m_s is '1', expected a number",
        ),
        (lambda: ds.fly(DRIVER, FIELD, throw(), ground="bounce"), "ground is 'bounce', expected 'stop' or 'skip'"),
        (
            lambda: ds.fly(DRIVER, FIELD, throw(), timestep=0.0),
            "timestep is 0; expected a finite number above zero (s)",
        ),
        (lambda: ds.fly(DRIVER, FIELD, throw(), duration=-1.0), "duration is -1; expected a finite number above zero"),
        (lambda: ds.fly(DRIVER, FIELD, throw(), law="moment_z_N_m = 1"), "law is 'm', of type str; expected a Law("),
        (lambda: ds.predict(DRIVER, FIELD, throw(), duration=float("nan")), "duration is nan; expected a finite"),
        (lambda: ds.predict(DRIVER, FIELD, throw(), rtol=0.0), "rtol is 0; expected a finite number above zero"),
        (lambda: arrays([T, XYZ]), "of type list; expected {SENSOR: (t, values)}, such as"),
        (lambda: arrays({"magnetometer": XYZ}), "readings of magnetometer are of type ndarray; expected a pair (t, "),
        (lambda: arrays({"magnetometer": (T.astype("M8[s]"), XYZ)}), "in seconds: (t - t[0]) / np.timedelta64(1, 's')"),
        (lambda: arrays({"magnetometer": (T, XYZ + 1j)}), "magnetometer: got complex numbers, expected real ones"),
        (lambda: ds.fft(T.astype("m8[s]"), XYZ), "expected numbers; of times in seconds: t / np.timedelta64(1, 's')"),
        (lambda: ds.fft(T, XYZ, 5), "settings is 5, of type int; expected FftSettings(...)"),
        (
            lambda: ds.write_model(DRIVER, "model.toml"),
            "of type Disc; expected a Model, as read_model(FILE) returns it",
        ),
        (
            lambda: ds.write_recording("folder", arrays({"magnetometer": (T, XYZ)})),
            "expected a Recording; write_record",
        ),
        (lambda: ds.Recording("flight", "x", None), "environment is None, of type NoneType; expected Environment(...)"),
        (lambda: ds.Recording("flight", "x", FIELD, "driver"), "disc is 'driver', of type str; expected a Disc: load_"),
    ],
)
def test_an_argument_that_is_none_of_its_kind_is_refused_by_name(call: Callable[[], object], says: str):
    with pytest.raises(ds.InputError, match=re.escape(says)):
        call()


def test_the_remedies_of_a_rate_and_of_a_tilt_work():
    assert BOARD.fitted("magnetometer", sampling=Sampling(50.0)).sensors["magnetometer"].sheet.rate_hz == 50.0
    assert ds.predict(DRIVER, FIELD, tilted(-0.2094)).touched_down


@pytest.mark.parametrize("number", [1, 1.0, np.float64(1.0), np.float32(1.0), np.int64(1), True])
def test_every_real_number_is_one(number: object):
    require_number(number, "mass", "kg", positive=True)


def test_a_long_argument_is_cut():
    with pytest.raises(ds.InputError, match=r"^aero is \[0, 0, .{20,60}\.\.\., of type list; expected Aero$"):
        require_type([0] * 1000, Aero, "aero", "Aero")
