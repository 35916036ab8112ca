"""A board that is turned in the disc, its readings turned back: its errors stay along its own axes."""

from __future__ import annotations

import numpy as np
import pytest
from support.made import DRIVER, MODULE, flight, noiseless, rows_of

from discsim.effects import Effect, effect
from discsim.effects.setup import board_axes
from discsim.recording import Recording
from discsim.sensors import record
from discsim.validation.identification.sensor_model import predicted
from discsim.written import corrected

TURN = effect("board.rotation", rx_rad=-2.19, ry_rad=1.32, rz_rad=0.09)
ERRORS = [
    effect("accel.scale", sx=0.02, sy=-0.03, sz=0.01),
    effect("accel.cross_axis", sxy=0.01, sxz=-0.02, syx=0.0, syz=0.03, szx=0.01, szy=0.0),
    effect("accel.saturation", limit_m_s2=60.0),
    effect("gyro.scale", sx=0.02, sy=-0.03, sz=0.01),
    effect("gyro.g_sensitivity", kx=1e-3, ky=-2e-3, kz=5e-4),
    effect("gyro.mount", rx_rad=0.03, ry_rad=-0.02, rz_rad=0.01),
    effect("mag.hard_iron", bx_uT=5.0, by_uT=-7.0, bz_uT=3.0),
]
SENSORS = ("magnetometer", "accelerometer", "gyroscope")
MOTION = flight(seconds=0.4)
T = np.linspace(0.05, 0.35, 31)


def recorded(*effects: Effect) -> Recording:
    module = noiseless(MODULE).with_effects(effects)
    return record(MOTION, module, np.random.default_rng(1), plant="flight", name="throw", disc=DRIVER)


def values_of(*effects: Effect) -> dict[tuple[str, str], float]:
    return {(one.id, name): number for one in effects for name, number in one.value._asdict().items()}


@pytest.mark.parametrize("error", ERRORS, ids=lambda one: one.id)
def test_errors_act_before_the_readings_are_turned_back(error):
    """Three scales of a board that is turned askew were nine numbers along the axes of the disc."""
    written = recorded(TURN, error)
    back = corrected(written, [TURN])
    C = board_axes(TURN.value)
    for sensor in SENSORS:
        on_board = predicted(sensor, written, values_of(TURN, error), T, rows_of(MOTION, T))
        shown = predicted(sensor, back, values_of(error), T, rows_of(MOTION, T))
        assert shown == pytest.approx(on_board @ C.T, abs=1e-9)


def test_a_turn_that_is_found_beside_goes_on_from_the_first():
    more = effect("board.rotation", rx_rad=0.01, ry_rad=-0.02, rz_rad=0.005)
    back = corrected(recorded(TURN), [TURN])
    C = board_axes(TURN.value)
    for sensor in SENSORS:
        straight = predicted(sensor, recorded(), {}, T, rows_of(MOTION, T))
        shown = predicted(sensor, back, values_of(more), T, rows_of(MOTION, T))
        # readings = (R C)^T v, which C takes back to axes of the disc
        assert shown == pytest.approx(straight @ board_axes(more.value) @ C @ C.T, abs=1e-9)


def test_the_reading_of_a_board_that_is_turned_back_is_the_one_of_a_straight_board():
    back = corrected(recorded(TURN), [TURN])
    samples = back.samples["accelerometer"]
    shown = predicted("accelerometer", back, {}, samples.t, rows_of(MOTION, samples.t))
    assert shown == pytest.approx(samples.value, abs=1e-9)
