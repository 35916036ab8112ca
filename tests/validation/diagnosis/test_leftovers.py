"""What is left of recordings whose rows were counted, against what no physics could take."""

from __future__ import annotations

import pytest
from support import logger_loop as loop

from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.consistency.spin_agreement import agreement_of, written_ratios
from discsim.validation.diagnosis.leftovers import nothing_but_pure_error, pure_noise
from discsim.validation.diagnosis.pipeline import prepared_under
from discsim.validation.diagnosis.settings import CONSISTENCY
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.diagnosis.stages import Question
from discsim.validation.identification.noise import GroupNoise

NAMES = tuple(loop.NAMES)


def throws():
    return tuple(
        loop.logged(one, 1 + k, own_clock=True, weight=0.5, chip=0.0091)[0] for k, one in enumerate(loop.motions())
    )


def left(sensor: str, level: float, pure: float | None) -> Leftover:
    return Leftover("a", sensor, 10.0, level, pure)


def test_every_sensor_of_every_recording_must_come_near_its_pure_error():
    near, far = CONSISTENCY.beyond_pure * 0.99, CONSISTENCY.beyond_pure * 1.01
    assert nothing_but_pure_error([left("magnetometer", near, 1.0), left("gyroscope", near, 1.0)])
    assert not nothing_but_pure_error([left("magnetometer", near, 1.0), left("gyroscope", far, 1.0)])
    assert not nothing_but_pure_error([left("magnetometer", 0.1, None)])
    assert not nothing_but_pure_error([])


def test_the_noise_of_both_fits_is_that_of_the_rows_and_not_of_the_misfit():
    recordings = throws()
    agreement = agreement_of(recordings, NAMES)
    assert agreement is not None
    assert agreement.own_clock is not None
    assert agreement.imu_clock is not None
    inflated = {sensor: GroupNoise(50.0, 0.9) for sensor in ("magnetometer", "accelerometer", "gyroscope")}
    noise = pure_noise(agreement, inflated)
    # the readings' own noise is 0.1 uT and 0.0015 rad/s
    assert noise["magnetometer"].sd < 0.3
    assert noise["gyroscope"].sd < 0.01
    assert noise["accelerometer"].sd == (50.0 if agreement.settling is None else pytest.approx(1.0, abs=1.0))
    assert all(level.correlation == 0.0 for level in noise.values())


def test_rates_of_the_times_as_written_do_not_undo_what_was_counted():
    recordings = throws()
    question = Question(recordings, NAMES, ("made",))
    ready = prepared_under(find_setup_faults(recordings), question)
    assert ready.rows is not None
    assert [effect.id for effect in ready.rows.effects()][-1] == "imu.own_clock"
    # a fifth of the rows is lost: as written the field turns 1.25 times too fast
    assert ready.agreement is not None
    assert min(item.ratio for item in ready.agreement.comparisons if item.signal == "field") > 1.1
    assert written_ratios(ready.agreeing) == pytest.approx([1.0, 1.0], abs=0.02)
