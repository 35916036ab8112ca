"""A rate reference that the sensors beside it contradict is told itself, and its mistake is not put on them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from support.made import FIELD, RIG
from support.thinned import one_in

from discsim.arrays import FloatArray
from discsim.effects import Effect, effect
from discsim.errors import InputError
from discsim.profiles import trapezoids
from discsim.rate_tables import RateTable
from discsim.recording import Recording, Samples, read_recording, write_recording
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, record
from discsim.table_drive import TableDrive
from discsim.validation.checking.checked import check
from discsim.validation.diagnosis.diagnosed import diagnose_recordings
from discsim.validation.diagnosis.setup import find_setup_faults, setup_notes
from discsim.validation.diagnosis.setup.reference import reference_doubts
from discsim.validation.estimating.spin_estimates import estimate_spin

PROFILE = trapezoids(np.array([18.0, 32.0]), 3.0, 1.0)
Change = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


def table(errors: tuple[Effect, ...] = (), *, command: bool = False) -> Recording:
    """Return a run of a rate table, with its reference or, if so, with what was commanded alone."""
    motion = turn_table(PROFILE, FIELD, yaw=0.4)
    parts = ("mpu9250",) if command else ("mpu9250", "ac1120s")
    module = Instruments.from_parts(*parts).with_effects(errors)
    told = PROFILE if command else None
    return record(motion, module, np.random.default_rng(4), plant="rate_table", name="mine", command=told)


def bench(drive: TableDrive | None = None) -> Recording:
    """Return a run of a rate table with its reference and what was commanded."""
    motion = RateTable(drive=drive or TableDrive()).run(PROFILE, FIELD, (), yaw=0.4)
    module = Instruments.from_parts("mpu9250", "ac1120s")
    return record(motion, module, np.random.default_rng(6), plant="rate_table", name="mine", command=PROFILE)


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
    one_in(
        2,
        [
            effect("gyro.scale", sx=0.0, sy=0.0, sz=0.05),
            effect("mag.time_offset", offset_s=0.3),
            effect("board.rotation", rx_rad=np.pi, ry_rad=0.0, rz_rad=0.0),
            effect("gyro.axes", axes="x y -z"),
            effect("gyro.units", written_in="deg/s"),
            effect("accel.units", written_in="g"),
            effect("accel.position_offset", dx_m=0.003),
            effect("clock.units", written_in="us"),
            effect("gyro.scale", sx=0.0, sy=0.0, sz=0.1),
            effect("mag.clock_rate", ratio=0.9),
            effect("clock.rate", ratio=1.02),
        ],
    ),
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


@pytest.mark.parametrize("made", [table, coast])
@pytest.mark.parametrize("times", one_in(2, [0.5, 2.0, 1.1, 0.25]))
@pytest.mark.parametrize("stated", [True, False], ids=["field stated", "field not stated"])
def test_a_factor_that_is_no_unit_is_told_by_two_sensors_and_its_remedy_mends_it(made, times, stated):
    """Edges per turn counted wrongly, or a wheel: such a reference was the best estimate of the spin without a word."""
    wrong = changed(made(), lambda t, r: (t, times * r))
    if not stated:
        wrong = replace(wrong, environment=replace(wrong.environment, magnetic_field=np.zeros(3)))
    (doubt,) = reference_doubts(wrong)
    assert (doubt.kind, doubt.sure) == ("factor", True)
    assert f"is {times:.3g} times the rate that the magnetometer" in doubt.sentence
    found = re.search(r"multiply its rates by ([0-9.]+)", doubt.remedy)
    assert found is not None
    by = float(found[1])
    assert by == pytest.approx(1.0 / times, rel=0.01)
    assert list(reference_doubts(changed(wrong, lambda t, r: (t, by * r)))) == []


def test_a_noisy_encoder_is_no_wrong_one():
    """An edge more or less in 10 ms is a tenth of 60 edges a second; a factor of 1.1 still shows in the mean."""
    noise = 3.0 * np.random.default_rng(8).standard_normal(100_000)
    right = changed(coast(), lambda t, r: (t, r + noise[: t.size]))
    assert list(reference_doubts(right)) == []
    (doubt,) = reference_doubts(changed(right, lambda t, r: (t, 1.1 * r)))
    assert doubt.kind == "factor"


@pytest.mark.parametrize("sensor", ["magnetometer", "gyroscope"])
def test_one_sensor_alone_contradicts_a_reference_and_either_may_be_wrong(sensor):
    """Rows of half the spacing turn the field twice as fast, a gyroscope of half the range reads twice the rate."""
    wrong = changed(coast(), lambda t, r: (t, 0.5 * r))
    alone = replace(wrong, samples={name: wrong.samples[name] for name in (sensor, "rate_reference")})
    (doubt,) = reference_doubts(alone)
    assert (doubt.kind, doubt.sure) == ("factor", False)
    assert "wrong is either rate_reference.csv" in doubt.sentence
    found = find_setup_faults([alone])
    assert found.doubts == ()
    (note,) = setup_notes(found, "estimated are")
    assert doubt.sentence in note
    (checked,) = check([alone]).checks
    assert [one.id for one in checked.of("warning")] == ["rate_reference.factor"]


def test_a_reference_of_another_run_is_told():
    other = trapezoids(np.array([35.0, 10.0]), 3.0, 1.0)
    wrong = changed(table(), lambda t, r: (t, np.interp(t, other.t, other.value)))
    (doubt,) = reference_doubts(wrong)
    assert (doubt.kind, doubt.sure) == ("another", True)
    assert "is it the file of another run?" in doubt.sentence


COMMANDS: dict[str, tuple[Change, str]] = {
    "units": (lambda t, r: (t, np.degrees(r)), "multiply its rates by 0.0174533"),
    "clock": (lambda t, r: (1e3 * t, r), "multiply its times by 0.001"),
    "factor": (lambda t, r: (t, 0.5 * r), "multiply its rates by 2 "),
    "late": (lambda t, r: (t + 1.0, r), "subtract 1.0"),
    "another": (lambda t, r: (t, r[::-1] ** 2 / 20.0), "is it the profile of another run?"),
}


@pytest.mark.parametrize("kind", COMMANDS)
def test_a_wrong_command_is_told_beside_a_reference_that_is_right(kind):
    """A command was held against the sensors only where there was no reference."""
    right, (change, mended_by) = bench(), COMMANDS[kind]
    wrong = replace(right, command=Samples(*change(PROFILE.t, PROFILE.value)))
    (doubt,) = reference_doubts(wrong)
    assert (doubt.file, doubt.kind) == ("command.csv", kind)
    assert mended_by in doubt.sentence
    (checked,) = check([wrong]).checks
    assert f"command.{kind}" in [one.id for one in checked.findings]


@pytest.mark.parametrize("drive", [TableDrive(), TableDrive(bandwidth_hz=4.0, overshoot=0.2)])
def test_a_table_that_trails_its_command_a_little_is_no_wrong_command(drive):
    assert list(reference_doubts(bench(drive))) == []


def test_a_wrong_reference_does_not_put_its_mistake_on_a_right_command():
    (doubt,) = reference_doubts(changed(bench(), lambda t, r: (t, 2.0 * r)))
    assert (doubt.file, doubt.kind) == ("rate_reference.csv", "factor")


def test_the_best_estimate_passes_over_a_reference_that_two_sensors_refute():
    wrong = changed(coast(), lambda t, r: (t, 0.5 * r))
    found = estimate_spin(wrong)
    assert found.rates[0].method == "fusion"
    assert "is 0.5 times the rate that the magnetometer" in found.left_out["rate_reference"]
    assert estimate_spin(wrong, "rate_reference").rates[0].method == "rate_reference"
    assert estimate_spin(coast()).rates[0].method == "rate_reference"


# ------------------------------------------------------------------------------------ zeros, and the clock of a command


def at_zero(recording: Recording, file: str) -> Recording:
    """Return a recording whose command, or reference, is zero throughout."""
    if file == "command.csv":
        return replace(recording, command=Samples(PROFILE.t, 0.0 * PROFILE.value))
    return changed(recording, lambda t, r: (t, 0.0 * r))


@pytest.mark.parametrize(
    ("file", "mended_by"), [("command.csv", "write its knots"), ("rate_reference.csv", "leave it out")]
)
def test_a_rate_of_zero_while_two_sensors_turn_is_told_and_refused(file, mended_by):
    """Nothing was said: a file of zeros was taken for one that tells nothing."""
    wrong = at_zero(bench(), file)
    (doubt,) = reference_doubts(wrong)
    assert (doubt.file, doubt.kind, doubt.sure) == (file, "still", True)
    assert "is 0 throughout while the magnetometer, gyroscope" in doubt.sentence
    assert mended_by in doubt.sentence
    (checked,) = check([wrong]).checks
    assert [one.id for one in checked.of("error")] == [f"{file.removesuffix('.csv')}.still"]
    with pytest.raises(InputError, match="is 0 throughout while the magnetometer"):
        diagnose_recordings([wrong])


def test_an_encoder_that_was_not_connected_is_not_the_best_estimate():
    found = estimate_spin(at_zero(bench(), "rate_reference.csv"))
    assert found.rates[0].method == "fusion"
    assert "is 0 throughout" in found.left_out["rate_reference"]


@pytest.mark.parametrize(("sensor", "kinds"), [("gyroscope", ["still"]), ("magnetometer", []), ("accelerometer", [])])
def test_a_gyroscope_alone_contradicts_a_command_of_zeros_and_a_phase_or_a_pull_does_not(sensor, kinds):
    wrong = at_zero(table(command=True), "command.csv")
    alone = replace(wrong, samples={sensor: wrong.samples[sensor]})
    doubts = list(reference_doubts(alone))
    assert [doubt.kind for doubt in doubts] == kinds
    assert not any(doubt.sure for doubt in doubts)


@pytest.mark.parametrize("bias", [0.0, 0.3])
def test_a_table_that_stands_as_it_was_asked_to_is_not_doubted(bias):
    still = Samples(PROFILE.t, 0.0 * PROFILE.value)
    module = Instruments.from_parts("mpu9250").with_effects(
        [effect("gyro.bias", bx_rad_s=0.0, by_rad_s=0.0, bz_rad_s=bias)]
    )
    motion = turn_table(still, FIELD, yaw=0.4)
    run = record(motion, module, np.random.default_rng(4), plant="rate_table", name="mine", command=still)
    assert list(reference_doubts(run)) == []


EVEN = trapezoids(np.array([18.0, 20.0]), 9.0, 1.0)


@pytest.mark.parametrize(("factor", "name"), [(1e3, "milliseconds"), (1e6, "microseconds")])
def test_a_command_of_a_few_knots_in_another_unit_is_read_and_told_by_its_end_where_its_rate_is_even(
    tmp_path, factor, name
):
    """A file of knots beyond any time was refused without a word on its unit; another passed for a steady rate."""
    motion = turn_table(EVEN, FIELD, yaw=0.4)
    module = Instruments.from_parts("mpu9250")
    right = record(motion, module, np.random.default_rng(4), plant="rate_table", name="mine", command=EVEN)
    assert list(reference_doubts(right)) == []
    write_recording(right, tmp_path)
    rows = [f"{factor * t!r},{rate!r}" for t, rate in zip(EVEN.t.tolist(), EVEN.value.tolist(), strict=True)]
    (tmp_path / "command.csv").write_text("\n".join(["time_s,rate_rad_s", *rows]) + "\n")
    (doubt,) = reference_doubts(read_recording(tmp_path))
    assert (doubt.file, doubt.kind) == ("command.csv", "clock")
    found = re.search(r"multiply its times by ([0-9.e-]+)", doubt.remedy)
    assert found is not None
    assert float(found[1]) * factor == pytest.approx(1.0)
    assert name in doubt.sentence


def test_a_long_command_of_which_a_part_was_recorded_is_not_doubted():
    run = table(command=True)
    hour = Samples(np.append(PROFILE.t, 3600.0), np.append(PROFILE.value, 0.0))
    assert not [doubt for doubt in reference_doubts(replace(run, command=hour)) if doubt.kind == "clock"]


def test_a_board_on_its_side_refutes_no_reference():
    """Its z shows 1/57 of the rate by chance, and a sound reference was refused as one in deg/s."""
    tilt = effect("board.rotation", ry_rad=np.pi / 2 - 1 / 57.3)
    module = Instruments.from_parts("mpu9250").fitted("gyroscope", range=104.72).with_effects([tilt])
    run = record(
        spin_down(RIG, FIELD, 60.0, 20.0, yaw=0.3), module, np.random.default_rng(4), plant="spin_down", name="a"
    )
    rate = run.samples["gyroscope"].value
    told = Samples(run.samples["gyroscope"].t, np.linalg.norm(rate, axis=1))
    sheet = replace(run.sheets["gyroscope"], range=np.inf)
    samples, sheets = {**run.samples, "rate_reference": told}, {**run.sheets, "rate_reference": sheet}
    assert list(reference_doubts(replace(run, samples=samples, sheets=sheets))) == []
