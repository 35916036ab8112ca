"""What is left of recordings whose rows were counted, against what no physics could take."""

from __future__ import annotations

import numpy as np
import pytest
from support import logger_loop as loop

from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.consistency.spin_agreement import agreement_of, written_ratios
from discsim.validation.diagnosis.leftovers import nothing_but_pure_error, pure_noise
from discsim.validation.diagnosis.pipeline import diagnose, prepared_under
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.diagnosis.stages import Question
from discsim.validation.identification.noise import GroupNoise

NAMES = tuple(loop.NAMES)


def throws():
    return tuple(
        loop.logged(one, 1 + k, own_clock=True, weight=0.5, chip=0.0091)[0] for k, one in enumerate(loop.motions())
    )


def left(sensor: str, level: float, pure: float | None, recording: str = "a") -> Leftover:
    return Leftover(recording, sensor, 10.0, level, pure)


@pytest.mark.parametrize(
    ("recordings", "most"),
    # of n others: 4 pure errors squared, and of the 3 beyond the one that the noise makes (1 + 1 / n) over (1 + 1 / 3)
    [("ab", np.sqrt(5.5)), ("abc", np.sqrt(4.375)), ("abcd", 2.0)],
)
def test_every_sensor_of_every_recording_must_come_near_its_pure_error(recordings: str, most: float):
    others = [left("gyroscope", 1.0, 1.0, name) for name in recordings]
    assert nothing_but_pure_error([*others, left("magnetometer", 0.99 * most, 1.0)])
    assert not nothing_but_pure_error([*others, left("magnetometer", 1.01 * most, 1.0)])
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


@pytest.mark.slow
def test_of_one_recording_whose_rows_could_be_counted_another_is_asked_for():
    """Times as written had told of iron and a gyroscope's bias of -12 rad/s, and of a stretch that nothing drives."""
    diagnosis = diagnose([throws()[:1]], ["one"]).diagnosis
    assert diagnosis.verdict == "unexplained"
    assert [text.split(",")[0] for text in diagnosis.next_recordings] == ["Another throw with the same logger"]
    assert "rows are not evenly spaced" in diagnosis.warnings[0]
    assert diagnosis.partly == ()
