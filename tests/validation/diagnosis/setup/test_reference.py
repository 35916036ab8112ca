"""A rate reference that the sensors beside it contradict is told itself, and its mistake is not put on them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.made import FIELD, RIG

from discsim.arrays import FloatArray
from discsim.effects import Effect, effect
from discsim.errors import InputError
from discsim.profiles import trapezoids
from discsim.recording import Recording, Samples
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, record
from discsim.validation.checking.checked import check
from discsim.validation.diagnosis.diagnosed import diagnose_recordings
from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes
from discsim.validation.diagnosis.setup.reference import reference_doubts

PROFILE = trapezoids(np.array([18.0, 32.0]), 3.0, 1.0)
Change = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def table(errors: tuple[Effect, ...] = (), *, command: bool = False) -> Recording:
    """Return a run of a rate table, with its reference or, if so, with what was commanded alone."""
    motion = turn_table(PROFILE, FIELD, yaw=0.4)
    parts = ("mpu9250",) if command else ("mpu9250", "ac1120s")
    module = Instruments.from_parts(*parts).with_effects(errors)
    told = PROFILE if command else None
    return record(motion, module, np.random.default_rng(4), plant="rate_table", name="mine", command=told)


def coast(errors: tuple[Effect, ...] = ()) -> Recording:
    """Return a rig that coasts down from 30 rad/s, with its reference."""
    motion = spin_down(RIG, FIELD, 30.0, 8.0, yaw=0.5)
    module = Instruments.from_parts("mpu9250", "ac1120s").with_effects(errors)
    return record(motion, module, np.random.default_rng(5), plant="spin_down", name="mine", rig=RIG)


def changed(recording: Recording, change: Change) -> Recording:
    """Return a recording whose reference was written otherwise; what was before 0 s is left out."""
    reference = recording.need("rate_reference")
    t, rate = change(reference.t, reference.value)
    samples = {**recording.samples, "rate_reference": Samples(t[t >= 0], rate[t >= 0])}
    return replace(recording, samples=samples)


MISTAKES: dict[str, tuple[Change, str]] = {
    "deg/s": (lambda t, r: (t, np.degrees(r)), "multiply its rates by 0.0174533"),
    "rpm": (lambda t, r: (t, r * 30.0 / np.pi), "multiply its rates by 0.10472"),
    "turns per second": (lambda t, r: (t, r / (2.0 * np.pi)), "multiply its rates by 6.28319"),
    "the other way": (lambda t, r: (t, -r), "turn the sign of its rates"),
    "milliseconds": (lambda t, r: (1e3 * t, r), "are the times of one of them milliseconds"),
}
LATE: dict[str, tuple[Change, str]] = {
    "0.30 s late": (lambda t, r: (t + 0.3, r), "from its times"),
    "0.70 s early": (lambda t, r: (t - 0.7, r), "to its times"),
}


@pytest.mark.parametrize("made", [table, coast])
@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_told_with_what_mends_it(made, mistake):
    change, mended_by = MISTAKES[mistake]
    (doubt,) = reference_doubts(changed(made(), change))
    assert mistake in doubt.sentence
    assert mended_by in doubt.sentence


@pytest.mark.parametrize("mistake", LATE)
def test_another_zero_of_time_is_told_where_the_rate_changes(mistake):
    change, mended_by = LATE[mistake]
    (doubt,) = reference_doubts(changed(table(), change))
    assert mistake in doubt.sentence
    assert mended_by in doubt.sentence


@pytest.mark.parametrize("made", [table, coast])
@pytest.mark.parametrize(
    "error",
    [
        effect("gyro.scale", sx=0.0, sy=0.0, sz=0.05),
        effect("mag.time_offset", offset_s=0.3),
        effect("board.rotation", rx_rad=np.pi, ry_rad=0.0, rz_rad=0.0),
        effect("gyro.axes", axes="x y -z"),
        effect("gyro.units", written_in="deg/s"),
        effect("accel.units", written_in="g"),
        effect("accel.position_offset", dx_m=0.003),
        effect("clock.units", written_in="us"),
    ],
    ids=lambda error: error.id,
)
def test_no_error_of_a_sensor_is_put_on_the_reference(made, error):
    """A board upside down turns the other way than its reference; one sensor's times may themselves be late."""
    assert list(reference_doubts(made())) == []
    assert list(reference_doubts(made((error,)))) == []


def test_a_command_in_another_unit_is_told_as_well():
    right = table(command=True)
    assert list(reference_doubts(right)) == []
    wrong = replace(right, command=Samples(PROFILE.t, np.degrees(PROFILE.value)))
    (doubt,) = reference_doubts(wrong)
    assert doubt.sentence.startswith("command.csv is in deg/s, by magnetometer")


def test_three_sensors_are_not_mixed_up_because_an_encoder_counts_the_other_way():
    """All three came out with other axes, and the diagnosis was `explained` with them."""
    wrong = changed(coast(), MISTAKES["the other way"][0])
    found = find_setup_faults([wrong])
    assert found.faults == ()
    (note,) = setup_notes(found, "estimated are")
    assert "rate_reference.csv turns the other way" in note
    with pytest.raises(InputError, match=r"mine: rate_reference\.csv turns the other way"):
        diagnose_recordings([wrong])


def test_check_tells_it_as_an_error():
    (checked,) = check([changed(coast(), MISTAKES["rpm"][0])]).checks
    (error,) = checked.of("error")
    assert error.id == "rate_reference.units"
    assert error.where == "rate_reference"
    assert "it is in rpm, by " in error.sentence
