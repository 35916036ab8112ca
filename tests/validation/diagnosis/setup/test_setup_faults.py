"""Faults of the setup that have a size compete like any effect; settings do not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import DRIVER, FIELD, MODULE, RIG, flight, tables, throws

from discsim.effects import CATALOGUE, Effect, effect
from discsim.recording import Recording
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_site
from discsim.trajectory import predict
from discsim.validation.checking.checked import check
from discsim.validation.diagnosis.candidates.candidate import available, candidates_for, parameters_of
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.stepwise import search
from discsim.validation.diagnosis.setup import SetupFault, SetupFindings, find_setup_faults, suspected_fault
from discsim.validation.diagnosis.setup.find import may_be_physics
from discsim.validation.diagnosis.setup.hypotheses import Hypothesis, Ranking, hypotheses
from discsim.validation.diagnosis.setup.remedy import place_instead
from discsim.validation.diagnosis.setup_effects import free_parameters, with_reversed_axes, with_those_borne_out
from discsim.validation.diagnosis.signals.relations import Columns
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import AllowedDefects, Parameter
from discsim.validation.scenarios.throws import Throw
from discsim.written import as_written, corrected


def test_a_setting_is_no_trial_of_the_search_and_a_size_is():
    recordings = throws(seconds=0.5)
    tried = {candidate.id for candidate in candidates_for(recordings)}
    setup = {id for id, row in CATALOGUE.items() if row.setup and row.acts_with(recordings[0].samples)}
    assert tried & setup == {id for id in setup if not CATALOGUE[id].settings}
    assert {"mag.time_offset", "board.rotation", "site.field"} <= tried


def test_a_turn_that_nothing_shows_is_held_where_it_is():
    """A prior of radians keeps normal equations regular where no sensor tells a direction."""
    candidate = next(candidate for candidate in candidates_for(tables()) if candidate.id == "board.rotation")
    for parameter in parameters_of(candidate):
        assert np.pi < parameter.sigma < 100.0


def test_what_needs_a_sensor_that_is_not_there_is_not_tried():
    bare = [
        replace(one, samples={name: samples for name, samples in one.samples.items() if name != "magnetometer"})
        for one in tables()
    ]
    there, left = ({row.id for row in available(some)} for some in (tables(), bare))
    assert "site.field" in there
    assert not {"site.field", "mag.time_offset"} & left
    assert "board.rotation" in left


@pytest.mark.parametrize(
    ("fault", "sd"),
    [
        (effect("mag.time_offset", offset_s=0.005), {"offset_s": 1e-4}),
        (effect("board.rotation", rx_rad=0.02, ry_rad=-0.02, rz_rad=0.02), {"rx_rad": 1e-3, "ry_rad": 1e-3}),
        (effect("site.field", inclination_rad=0.03, ratio=1.03), {"inclination_rad": 1e-3, "ratio": 1e-3}),
    ],
    ids=lambda item: item.id if isinstance(item, Effect) else "",
)
def test_a_small_fault_on_a_rate_table_is_named_alone_with_its_size(fault: Effect, sd: dict[str, float]):
    final = search(SearchProblem(tables(errors=[fault]))).final
    assert [candidate.id for candidate in final.hypothesis.candidates] == [fault.id]
    errors = np.sqrt(np.diag(final.fit.covariance))
    found = {q.name: (v, e) for q, v, e in zip(final.fit.parameters, final.fit.at, errors, strict=True)}
    for name, largest in sd.items():
        value, error = found[name]
        assert error < largest
        assert value == pytest.approx(fault.sizes[name], abs=4.0 * error)


def test_an_offset_of_time_beside_a_place_is_not_told_as_a_turned_board_and_a_scale():
    """Those two together do to an accelerometer what its place does: with the place in, one of them is superfluous."""
    errors = [
        effect("accel.time_offset", offset_s=-0.018),
        effect("accel.position_offset", dx_m=4e-5, dy_m=-3.6e-4),
    ]
    final = search(SearchProblem(tables(errors=errors))).final
    assert {candidate.id for candidate in final.hypothesis.candidates} == {error.id for error in errors}
    found = {q.name: v for q, v in zip(final.fit.parameters, final.fit.at, strict=True)}
    assert found["offset_s"] == pytest.approx(-0.018, abs=5e-4)
    assert found["dy_m"] == pytest.approx(-3.6e-4, abs=3e-5)


def test_an_axis_that_the_fit_finds_scaled_by_minus_one_is_a_reversed_column():
    fault = effect("gyro.axes", axes="x y -z")
    written = tuple(as_written(one, [fault]) for one in tables())
    fit = search(SearchProblem(written)).final.fit
    findings = with_reversed_axes(SetupFindings((), written), fit)
    assert findings is not None
    assert findings.effects == (fault,)
    assert findings.recordings[0].samples["gyroscope"].value[:, 2] == pytest.approx(
        tables()[0].samples["gyroscope"].value[:, 2]
    )


def test_a_small_scale_is_no_reversed_column():
    made = tuple(tables(errors=[effect("gyro.scale", sx=0.0, sy=0.0, sz=0.03)]))
    assert with_reversed_axes(SetupFindings((), made), search(SearchProblem(made)).final.fit) is None


def test_a_throw_whose_gyroscope_clips_all_through_leaves_the_others_to_be_looked_at():
    """Without a magnetometer it shows no rate at all; the diagnosis ended in a traceback then."""
    made = []
    for k, spin in enumerate((70.0, 30.0)):
        motion = flight((), heading=0.4 + k, spin=spin, seconds=1.5)
        whole = record(motion, MODULE, np.random.default_rng(k), plant="flight", name=f"throw-{k}", disc=DRIVER)
        samples = {name: samples for name, samples in whole.samples.items() if name != "magnetometer"}
        made.append(replace(whole, samples=samples))
    sheet, seen = made[0].sheets["gyroscope"], made[0].samples["gyroscope"].value
    assert np.all(sheet.clipped(seen)[:, 2])
    assert "rival" in {item.kind for item in hypotheses(made).found}


@pytest.mark.parametrize("there", [True, False])
def test_a_fault_that_the_fit_brings_back_to_nothing_is_none(there):
    """Relations between sensors had told another field where an accelerometer has a cross-axis error of 1 %."""
    fault = effect("site.field", ratio=0.97)
    written = tuple(tables(errors=[fault] if there else []))
    meant = tuple(corrected(one, [fault]) for one in written)
    findings = SetupFindings((SetupFault(fault, 100.0, None),), meant)
    fit = search(SearchProblem(meant, free=free_parameters(findings))).final.fit
    left = with_those_borne_out(findings, written, fit)
    if there:
        assert left is None
    else:
        assert left is not None
        assert left.faults == ()
        assert left.recordings == written


@cache
def short_throw(heading: float) -> Recording:
    """Return what a board records of two seconds in the air, with its place and the disc unknown."""
    disc, air = load_disc("driver")
    place = replace(air, magnetic_field=load_site("seoul").environment.magnetic_field)
    motion = predict(disc, place, Throw(24.0, heading, 1500.0).release, duration=2.3).motion()
    flight = record(motion, Instruments.from_parts("mpu9250"), np.random.default_rng(3), plant="flight", name="one")
    sheets = {name: replace(sheet, position=None) for name, sheet in flight.sheets.items()}
    return replace(flight, plant="free_spin", sheets=sheets, environment=place)


@pytest.mark.parametrize("fault", [effect("mag.axes", axes="x y -z"), effect("gyro.axes", axes="x -y z")])
def test_a_flipped_axis_of_one_short_throw_is_suspected_and_of_two_named(fault: Effect):
    one, other = (as_written(short_throw(heading), [fault]) for heading in (0.0, 180.0))
    alone = find_setup_faults([one])
    assert alone.faults == ()
    suspected = suspected_fault(alone)
    assert suspected is not None
    assert suspected.effect == fault
    assert suspected.sentence.startswith("perhaps the ")
    assert suspected.sentence.endswith("a second throw or spin would tell")
    told = [finding for finding in check(one).checks[0].findings if finding.id == fault.id]
    assert [finding.severity for finding in told] == ["warning"]
    both = find_setup_faults([one, other])
    assert fault.id in [found.id for found in both.faults]
    assert suspected_fault(both) is None


def test_nothing_is_suspected_of_a_sound_short_throw():
    assert suspected_fault(find_setup_faults([short_throw(0.0)])) is None


def test_of_a_rig_that_coasts_no_offset_of_time_is_supposed():
    """It loses a share of its rate each second: a clock of 0.9 % was taken for a magnetometer 0.14 s early."""
    module = Instruments.from_parts("mpu9250").with_effects([effect("clock.rate", ratio=0.985)])
    module = module.fitted("gyroscope", range=100.0)
    rng = np.random.default_rng(4)
    runs = [
        record(spin_down(RIG, FIELD, rate, 25.0, yaw=0.3), module, rng, plant="spin_down", name=f"{rate:g}")
        for rate in (60.0, 45.0)
    ]
    assert {item.kind for item in hypotheses(runs).found}.isdisjoint({"offset"})


def test_a_free_spin_tells_the_size_of_a_field_and_no_direction():
    spins = throws(plant="free_spin", seconds=1.0)
    (field,) = [candidate for candidate in candidates_for(spins) if candidate.id == "site.field"]
    assert [column.name for column in field.columns] == ["ratio"]
    (field,) = [candidate for candidate in candidates_for(throws(seconds=1.0)) if candidate.id == "site.field"]
    assert len(field.columns) == 3


def reversed_place(one: Recording) -> Recording:
    """Return a recording that states its accelerometer on the other side of the axis."""
    sheet = one.sheets["accelerometer"]
    assert sheet.position is not None
    return replace(one, sheets={**one.sheets, "accelerometer": replace(sheet, position=-sheet.position)})


def test_a_place_of_the_wrong_sign_stands_beside_the_turned_board_that_reads_the_same():
    """It was told as a board turned by half a turn alone, and three sensors' axes were to be mended for it."""
    sound = throws(plant="free_spin", seconds=3.0)
    (fault,) = find_setup_faults([reversed_place(one) for one in sound]).faults
    assert fault.id == "board.rotation"
    assert fault.place == pytest.approx(tuple(sound[0].sheets["accelerometer"].position), abs=1e-6)
    assert "position_m is stated wrongly" in fault.sentence


def test_on_a_rig_a_turned_board_is_no_place():
    """Its place says where the rig's arm is; of a disc any side may be the front."""
    turned = effect("board.rotation", rz_rad=np.pi)
    table, spin = tables()[0], throws(plant="free_spin", seconds=0.2)[0]
    assert place_instead(turned, table) is None
    assert place_instead(turned, spin) is not None
    assert place_instead(effect("board.rotation", rx_rad=np.pi), spin) is None


@pytest.mark.parametrize(("scale", "reversed"), [(-1.97, True), (-1.39, False), (-1.0, False)])
def test_a_scale_that_is_nearer_to_no_reading_than_to_a_reversed_one_is_none(scale: float, reversed: bool):
    parameter = Parameter("gyro.scale", "sx", 0.0, 1e-3, 20.0)
    fit = Fit((), (parameter,), np.array([scale]), AllowedDefects(np.zeros(2)), {}, covariance=np.array([[4e-4]]))
    assert (with_reversed_axes(SetupFindings((), tuple(tables())), fit) is not None) == reversed


@pytest.mark.parametrize("what", ["clock", "losses", "lag"])
def test_a_shift_of_times_that_physics_explains_as_well_is_left_to_fits(what: str):
    shift = Hypothesis(
        "offset", "accelerometer", Columns({}, {"accelerometer": 0.02}), np.array([30.0, 34.5]), 290.0, 1.3, 6.0
    )
    rival = Hypothesis(
        "rival",
        "accelerometer",
        Columns({}, {}, None, {f"accelerometer.{what}": 0.01}),
        np.array([28.0, 31.9]),
        290.0,
        1.4,
        18.0,
    )
    assert may_be_physics(shift, [rival])
    assert not may_be_physics(shift, [replace(rival, sensor="gyroscope")])
    assert not may_be_physics(shift, [replace(rival, costs=rival.costs + 5.0)])
    assert not may_be_physics(replace(shift, kind="axes"), [rival])


@pytest.mark.parametrize("what", ["clock", "losses", "lag"])
def test_a_turned_board_that_leaves_half_unasked_gives_way_to_physics_that_does_as_well(what: str):
    """It made gaps of a gyroscope that clips, and lost samples of the magnetometer came out as `unexplained`."""
    board = Hypothesis("board", "board", Columns({"gyroscope": np.eye(3)}), np.array([2.0, 2.0]), 113.0, 0.2, 54.4)
    columns = Columns({}, {}, None, {f"magnetometer.{what}": 0.01})
    rival = Hypothesis("rival", "magnetometer", columns, np.array([21.0, 21.0]), 242.0, 1.8, 24.0)
    assert may_be_physics(board, [rival])
    assert not may_be_physics(replace(board, weight=200.0), [rival])
    assert not may_be_physics(board, [replace(rival, costs=rival.costs + 5.0)])


@pytest.mark.parametrize("ratio", [0.98, 1.02])
def test_mixed_up_axes_are_told_beside_a_clock_that_is_far_off(ratio: float):
    """Neither alone makes the sensors agree: such throws came out as `unexplained`."""
    fault = effect("gyro.axes", axes="x -y z")
    clock = effect("gyro.clock_rate", ratio=ratio)
    made = [one for seconds in (3.0, 2.8) for one in throws(errors=[clock], plant="free_spin", seconds=seconds)]
    findings = find_setup_faults([as_written(one, [fault]) for one in made])
    assert findings.effects == (fault,)
    (hint,) = [one for one in findings.hints if one.id == "gyro.clock_rate"]
    assert hint.value.ratio == pytest.approx(ratio, abs=1e-3)


def test_a_clock_that_is_far_off_is_no_mixed_up_axis():
    made = throws(errors=[effect("gyro.clock_rate", ratio=0.98)], plant="free_spin", seconds=3.0)
    assert find_setup_faults(made).faults == ()


@pytest.mark.parametrize(("share", "named"), [(0.93, False), (0.3, True)])
def test_a_fault_that_leaves_most_of_what_is_wrong_is_not_named(monkeypatch, share: float, named: bool):
    """On a table whose board is turned by 4 degrees, and clips, a reversed gyroscope gained a tenth of it."""
    made = tables()

    def ranked(some: Sequence[Recording], price: float = 0.0) -> Ranking:
        sound = hypotheses(some)
        reversed_ = next(one for one in sound.found if one.kind == "axes" and one.sensor == "gyroscope")
        costs = np.full(len(some), 600.0)
        written = replace(reversed_, kind="", sensor="", costs=costs, weight=2600.0, worst=2.0, size=0.0)
        item = replace(reversed_, costs=share * costs, weight=2600.0, worst=2.0)
        return replace(sound, as_written=written, found=(item,))

    monkeypatch.setattr("discsim.validation.diagnosis.setup.find.hypotheses", ranked)
    assert bool(find_setup_faults(made).faults) is named


def test_lost_samples_in_each_throw_are_a_rival_of_a_shift_of_times():
    """Each throw has lost another share: one clock for all leaves more than its own course in each."""
    shares = (0.005, 0.035)
    made = [throws(errors=[effect("accel.dropped_samples", fraction=share)], seconds=3.0) for share in shares]
    rivals = [item for item in hypotheses([one[k] for k, one in enumerate(made)]).found if item.kind == "rival"]
    cost = {next(iter(item.columns.rival)): item.cost for item in rivals}
    sound = hypotheses(throws(seconds=3.0), 30.0)
    assert sound.as_written is not None
    assert sound.found == ()
    beyond = {name: each - sound.as_written.cost for name, each in cost.items()}
    assert beyond["accelerometer.losses"] < 0.5 * min(beyond["accelerometer.clock"], beyond["accelerometer.lag"])


@pytest.mark.parametrize("stepped", [False, True], ids=["slow", "one-step"])
def test_a_log_with_a_reading_every_two_seconds_is_looked_at(stepped):
    """One reading in half a second scatters about no mean: none turned fastest, and the command ended in an error."""
    (first, _) = throws(plant="free_spin")
    fast = first.samples["accelerometer"]
    value = np.where(np.arange(300)[:, None] < 37, 1.0, 1.1) * np.ones(3) if stepped else fast.value[:300]
    slow = replace(first, samples={"accelerometer": replace(fast, t=2.2 * np.arange(300.0), value=value)})
    assert find_setup_faults([slow]).faults == ()
