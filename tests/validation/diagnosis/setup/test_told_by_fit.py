"""Axes that no relation between sensors shows: fits of a flight tell them, and the side of what stands at a limit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.effects import Effect, effect
from discsim.recording import Recording, Samples
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.setup import SetupFindings, find_setup_faults, with_axes_as_read
from discsim.validation.diagnosis.setup.proof import left_by_short_fit
from discsim.validation.diagnosis.setup.told_by_fit import with_fault_that_follows
from discsim.validation.diagnosis.setup_effects import with_other_sensor
from discsim.written import as_written

#: rad/s: an ordinary gyroscope's 2000 deg/s, which a thrown disc turns faster than
RANGE = 34.9066


def clipped(recording: Recording) -> Recording:
    """Return a recording whose gyroscope stops at 2000 deg/s."""
    gyroscope, sheet = recording.samples["gyroscope"], recording.sheets["gyroscope"]
    samples = Samples(gyroscope.t, np.clip(gyroscope.value, -RANGE, RANGE))
    return replace(
        recording,
        samples={**recording.samples, "gyroscope": samples},
        sheets={**recording.sheets, "gyroscope": replace(sheet, range=RANGE)},
    )


def without(recording: Recording, *sensors: str) -> Recording:
    return replace(recording, samples={name: own for name, own in recording.samples.items() if name not in sensors})


@pytest.fixture(scope="module")
def flights() -> list[Recording]:
    """Two sound flights without a magnetometer, their gyroscope at its limit all the time about z."""
    case = draw_case(0, "flight", kind="nothing")
    case = replace(case, runs=case.runs[:2], stated_releases=case.stated_releases[:2], longest=3.0)
    made = [clipped(without(one, "magnetometer")) for one in recordings(case)]
    for one in made:
        assert np.all(np.abs(one.samples["gyroscope"].value[:, 2]) == RANGE)
    return made


def meant(findings: SetupFindings | None) -> tuple[Effect, ...]:
    assert findings is not None
    return findings.effects


def test_reversed_axes_are_told_beside_a_wrong_clock():
    """No motion follows them then, and what is left is a fortieth of what any other axes leave."""
    case = draw_case(2, "flight", kind="nothing")
    case = replace(case, runs=case.runs[:2], stated_releases=case.stated_releases[:2], longest=3.0)
    case = replace(case, instruments=case.instruments.with_effects([effect("gyro.clock_rate", ratio=1.004)]))
    fault = effect("gyro.axes", axes="x -y z")
    written = [as_written(clipped(one), [fault]) for one in recordings(case)]
    assert meant(with_fault_that_follows(SetupFindings((), tuple(written)), ["gyroscope"])) == (fault,)


def test_without_a_magnetometer_relations_do_not_see_a_reversed_gyroscope_and_a_flight_does(flights):
    fault = effect("gyro.axes", axes="-x -y -z")
    written = [as_written(one, [fault]) for one in flights]
    before = find_setup_faults(written)
    assert before.faults == ()
    findings = with_fault_that_follows(before, ["gyroscope"])
    assert meant(findings) == (fault,)
    assert findings is not None
    # z stands at its limit all the time: which limit that is tells its sign
    assert findings.faults[0].twins == ()
    gyroscope = flights[0].samples["gyroscope"]
    np.testing.assert_array_equal(findings.recordings[0].samples["gyroscope"].value, gyroscope.value)


def test_axes_are_asked_only_of_the_sensors_that_are_blamed(flights):
    written = [as_written(one, [effect("gyro.axes", axes="-x -y -z")]) for one in flights]
    assert with_fault_that_follows(find_setup_faults(written), ["accelerometer"]) is None


def test_a_short_fit_counts_readings_that_stand_at_the_other_limit(flights):
    other_side = [as_written(one, [effect("gyro.axes", axes="x y -z")]) for one in flights]
    assert left_by_short_fit(flights) < 2.0
    # by the whole of both sizes in a noise of a thousandth of them
    assert left_by_short_fit(other_side) > 1e4


def test_a_column_that_stands_at_the_other_limit_throughout_is_named(flights):
    fault = effect("gyro.axes", axes="x y -z")
    written = [as_written(one, [fault]) for one in flights]
    answer = diagnose([written], ["reversed"]).diagnosis
    assert answer.verdict == "explained"
    assert [(one.id, dict(one.setting)) for one in answer.effects] == [(fault.id, fault.setting)]
    assert diagnose([flights], ["sound"]).diagnosis.verdict == "consistent"


def test_of_two_setups_that_are_one_half_turn_apart_the_one_with_fewer_faults_is_told(flights):
    case = draw_case(0, "flight", kind="nothing")
    one = recordings(replace(case, runs=case.runs[:1], stated_releases=case.stated_releases[:1], longest=2.0))[0]
    signs = {"gyroscope": np.diag([-1.0, -1.0, 1.0]), "magnetometer": np.diag([1.0, 1.0, -1.0])}
    alone = SetupFindings((), (without(one, "accelerometer"),))
    assert meant(with_axes_as_read(alone, signs)) == (effect("mag.axes", axes="-x -y -z"),)
    # an accelerometer that shows which way x points has the gyroscope's columns wrong, too
    assert {fault.id for fault in meant(with_axes_as_read(SetupFindings((), (one,)), signs))} == {
        "mag.axes",
        "gyro.axes",
    }


def test_axes_that_a_rig_cannot_tell_stand_beside_those_that_a_fit_has_found():
    case = draw_case(0, "spin_down", kind="nothing")
    one = recordings(replace(case, runs=case.runs[:1]))[0]
    fault = effect("gyro.axes", axes="-x -y -z")
    findings = with_axes_as_read(
        SetupFindings((), (as_written(one, [fault]),)), {"gyroscope": np.diag([1.0, 1.0, -1.0])}
    )
    (named,) = findings.faults
    assert named.effect == effect("gyro.axes", axes="x y -z")
    assert fault in named.twins


def test_without_a_magnetometer_relations_do_not_see_late_times_and_a_flight_does(flights):
    written = [as_written(one, [effect("accel.time_offset", offset_s=0.031)]) for one in flights]
    before = find_setup_faults(written)
    assert before.faults == ()
    findings = with_fault_that_follows(before, ["gyroscope"])
    assert findings is not None
    (fault,) = findings.faults
    # the two are 31 ms apart, and either may be off: the path tells which, over a whole flight
    either = {one.id: float(one.value[0]) for one in (fault.effect, *fault.twins)}
    assert either == pytest.approx({"accel.time_offset": 0.031, "gyro.time_offset": -0.031}, abs=1e-3)
    other = with_other_sensor(findings, written)
    assert other is not None
    assert {one.id for one in other.effects} == set(either) - {fault.id}
    for one, sound in zip((other if fault.id == "gyro.time_offset" else findings).recordings, flights, strict=True):
        shift = one.samples["accelerometer"].t - sound.samples["accelerometer"].t
        assert np.abs(shift).max() < 1e-3


def test_a_fault_that_no_other_sensor_would_do_for_is_not_put_down_to_one(flights):
    written = [as_written(one, [effect("gyro.axes", axes="-x -y -z")]) for one in flights]
    findings = with_fault_that_follows(find_setup_faults(written), ["gyroscope"])
    assert findings is not None
    assert with_other_sensor(findings, written) is None
