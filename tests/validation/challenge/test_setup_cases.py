"""Faults of the setup in the challenge: which are drawn, and which recordings cannot tell apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from discsim.effects import effect
from discsim.effects.setup import axes_of, permutation
from discsim.errors import InputError
from discsim.recording import PLANTS, Plant
from discsim.validation.challenge.cases.case import Case, Coast, Concealed, Turning
from discsim.validation.challenge.cases.conceal import Answer, read_answer, recordings
from discsim.validation.challenge.cases.detection_limit import sizes
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.challenge.cases.setups import draw_fault, equivalents, possible_faults
from discsim.validation.challenge.cases.sizes import HIDING, ordinary
from discsim.validation.diagnosis.early_verdict import contradiction_in
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.stepwise import search
from discsim.validation.diagnosis.setup import SetupFindings, find_setup_faults, with_likeliest_fault
from discsim.written import corrected

CASES = {plant: draw_case(3, plant, kind="nothing") for plant in PLANTS}


def on_board(plant: Plant, *sensors: str) -> Case:
    whole = next(case for seed in range(99) if set(sensors) <= set((case := drawn(seed, plant)).instruments.sensors))
    return replace(whole, instruments=whole.instruments.without(*(set(whole.instruments.sensors) - set(sensors))))


def drawn(seed: int, plant: Plant) -> Case:
    return draw_case(seed, plant, kind="nothing")


def brief(case: Case) -> Case:
    run = case.runs[0]
    if isinstance(run, Coast):
        run = replace(run, duration=2.0)
    return replace(case, runs=(run,), stated_releases=case.stated_releases[:1], longest=1.5)


def test_a_setup_case_conceals_one_fault_and_in_half_of_them_a_physical_effect_beside_it():
    cases = [draw_case(seed, kind="setup") for seed in range(80)]
    beside = 0
    for case in cases:
        fault, *rest = case.concealed
        assert case.verdict == "explained"
        assert fault.effect.row.setup
        assert fault.effect.id in possible_faults(case)
        assert (fault.effect.setting or fault.effect.sizes) != (fault.effect.row.sizes or None)
        beside += len(rest)
        for item in rest:
            assert not item.effect.row.setup
            assert ordinary(item.effect, case.plant)
    assert 25 <= beside <= 55  # three standard deviations of a half of 80
    assert {case.plant for case in cases} == set(PLANTS)
    assert len({case.concealed[0].effect.id for case in cases}) > 9


def test_no_fault_of_a_setup_is_drawn_unless_it_is_asked_for():
    for seed in range(60):
        assert not any(item.effect.row.setup for item in draw_case(seed).concealed)


def test_a_fault_may_be_asked_for_with_an_effect_beside_it():
    case = draw_case(5, "flight", ["accel.units", "air.wind"])
    assert case.kind == "setup"
    assert [item.effect.id for item in case.concealed] == ["accel.units", "air.wind"]
    assert [item.effect.id for item in draw_case(5, "flight", ["mag.axes"]).concealed] == ["mag.axes"]


@pytest.mark.parametrize(
    ("plant", "ids", "message"),
    [
        ("free_spin", ["accel.time_offset"], "does not show on a free_spin"),
        ("flight", ["mag.axes", "gyro.axes"], "expected one fault of the setup"),
        ("spin_down", ["gps.axes"], "acts on flight; this is a spin_down"),
    ],
)
def test_a_fault_that_cannot_show_is_refused(plant, ids, message):
    with pytest.raises(InputError, match=message):
        draw_case(4, plant, ids)


@pytest.mark.parametrize("plant", PLANTS)
def test_sizes_are_those_of_mistakes_that_are_made(plant):
    rng = np.random.default_rng(0)
    case = CASES[plant]
    for id in possible_faults(case):
        for _ in range(30):
            fault = draw_fault(id, case, rng)
            drawn_sizes = np.abs(list(fault.sizes.values()))
            if id.endswith("time_offset"):
                assert 0.005 <= drawn_sizes[0] <= 0.1
            if id == "board.rotation":
                assert np.radians(2.0) * (1 - 1e-6) <= np.linalg.norm(drawn_sizes) <= np.pi * (1 + 1e-6)
            if id == "site.field":
                assert drawn_sizes[0] <= np.radians(40.0) * (1 + 1e-6)
                assert drawn_sizes[1] <= np.radians(20.0) * (1 + 1e-6)
                assert 0.9 <= drawn_sizes[2] <= 1.1
            if fault.setting:
                assert fault.value != fault.row.baseline


def test_nothing_is_put_over_a_fault_of_the_setup():
    with pytest.raises(InputError, match="expected no mask with a fault of the setup"):
        draw_case(1, "flight", kind="setup", mask="clipped")
    with pytest.raises(InputError, match="expected no mask with a fault of the setup"):
        draw_case(1, "flight", ["mag.axes"], mask="short")


def test_only_physical_effects_have_a_detection_limit():
    case = brief(draw_case(2, "rate_table", ["mag.units", "gyro.bias"]))
    assert list(sizes(case)) == ["gyro.bias"]


def test_an_answer_with_a_setting_survives_its_file(tmp_path):
    for seed in range(40):
        answer = Answer.of(draw_case(seed, kind="setup"))
        (tmp_path / "answer.toml").write_text(answer.text)
        assert read_answer(tmp_path / "answer.toml") == answer


@pytest.mark.parametrize("seed", range(8))
def test_a_concealed_fault_is_in_the_recordings_and_nothing_else_is(seed):
    case = brief(draw_case(seed, kind="setup"))
    fault = case.concealed[0]
    (sound,) = recordings(replace(case, concealed=case.concealed[1:]))
    (faulty,) = recordings(case)
    assert faulty.environment.magnetic_field.tolist() == sound.environment.magnetic_field.tolist()
    assert faulty.sheets.keys() == sound.sheets.keys()
    if fault.effect.setting:
        meant = corrected(faulty, [fault.effect])
        for name, samples in sound.samples.items():
            np.testing.assert_allclose(meant.need(name).value, samples.value, rtol=1e-12, atol=1e-12)
            np.testing.assert_allclose(meant.need(name).t, samples.t, atol=1e-12)
    assert any(
        len(samples) != len(faulty.need(name))
        or not np.array_equal(samples.value, faulty.need(name).value, equal_nan=True)
        or not np.array_equal(samples.t, faulty.need(name).t)
        for name, samples in sound.samples.items()
    )


class TestEquivalents:
    """A rig's magnetometer by hand: readings (H cos, -H sin, D) of the angle turned from an unknown phase."""

    def test_on_a_rig_a_magnetometer_may_be_turned_about_the_axis(self):
        case = on_board("rate_table", "magnetometer", "rate_reference")
        found = equivalents(case, effect("mag.axes", axes="x -y z"))
        assert {axes for _, axes in found} == {"-x y z", "y x z", "-y -x z"}

    def test_a_turn_of_the_phase_is_what_they_differ_by(self):
        t = np.linspace(0.0, 1.0, 50)
        sound = [
            np.stack([20 * np.cos(30 * t + a), -20 * np.sin(30 * t + a), 40 + 0 * t]) for a in np.arange(4) * np.pi / 2
        ]
        case = on_board("rate_table", "magnetometer", "rate_reference")
        fault = effect("mag.axes", axes="z x y")
        written = permutation(fault.value) @ sound[0]
        for _, axes in equivalents(case, fault):
            meant = permutation(effect("mag.axes", axes=axes).value).T @ written
            assert any(np.allclose(meant, other) for other in sound)

    def test_a_rig_s_gyroscope_feels_z_alone(self):
        case = on_board("rate_table", "gyroscope", "rate_reference")
        assert len(equivalents(case, effect("gyro.axes", axes="z x y"))) == 7
        rng = np.random.default_rng(1)
        seen = {draw_fault("gyro.axes", case, rng).value.axes for _ in range(100)}
        assert seen <= {"x y -z", "z y x", "x z y", "-x -y -z", "y z x", "z x y"}

    def test_a_flipped_magnetometer_is_a_disc_that_spins_the_other_way(self):
        case = on_board("spin_down", "magnetometer", "gyroscope")
        twins = equivalents(case, effect("mag.axes", axes="x -y z"))
        assert ("gyro.axes", "x y -z") in twins
        assert ("mag.axes", "x -y z") in equivalents(case, effect("gyro.axes", axes="x y -z"))
        told = on_board("spin_down", "magnetometer", "gyroscope", "rate_reference")
        assert all(id == "mag.axes" for id, _ in equivalents(told, effect("mag.axes", axes="x -y z")))

    def test_with_nothing_else_on_board_such_a_flip_shows_nowhere(self):
        case = on_board("spin_down", "magnetometer")
        rng = np.random.default_rng(2)
        seen = {draw_fault("mag.axes", case, rng).value.axes for _ in range(100)}
        assert not seen & {"x -y z", "-x y z", "y x z"}
        assert "x y -z" in seen

    def test_in_a_flight_every_axis_shows(self):
        case = on_board("flight", "magnetometer", "accelerometer", "gps")
        for id in ("mag.axes", "accel.axes"):
            assert equivalents(case, effect(id, axes="y x z")) == ()

    def test_without_a_magnetometer_a_gps_may_be_turned_about_the_vertical(self):
        case = on_board("flight", "accelerometer", "gps")
        found = equivalents(case, effect("gps.axes", axes="east north up"))
        assert set(found) == {("gps.axes", text) for text in ("north west up", "west south up", "south east up")}
        assert equivalents(on_board("flight", "magnetometer", "gps"), effect("gps.axes", axes="east north up")) == ()

    def test_a_free_spin_s_accelerometer_shows_only_the_pull_to_the_axis(self):
        case = on_board("free_spin", "magnetometer", "gyroscope", "accelerometer")
        place = case.instruments.sensors["accelerometer"].position  # type: ignore[union-attr]
        flat = place * [1.0, 1.0, 0.0]
        for _, axes in equivalents(case, effect("accel.axes", axes="-x y z")):
            P = permutation(effect("accel.axes", axes=axes).value)
            np.testing.assert_array_equal(P @ flat, [-flat[0], flat[1], 0.0])

    def test_faults_that_are_no_axes_have_none(self):
        for plant in PLANTS:
            assert equivalents(CASES[plant], effect("mag.units", written_in="G")) == ()
            assert equivalents(CASES[plant], effect("board.rotation", rx_rad=1.0)) == ()

    def test_the_axes_of_a_matrix_are_those_that_made_it(self):
        for axes in ("y x -z", "-z x y", "x y z"):
            assert axes_of(permutation(effect("mag.axes", axes=axes).value)) == axes
        ENU = effect("gps.axes", axes="east north up").value
        assert axes_of(permutation(ENU), "gps") == "east north up"


def test_physical_effects_beside_a_fault_are_none_that_it_resembles():
    for seed in range(60):
        case = draw_case(seed, kind="setup")
        ids = [item.effect.id for item in case.concealed]
        if ids[0] == "site.field":
            assert not set(ids) & {"mag.hard_iron", "mag.soft_iron"}
        if ids[0].endswith("time_offset"):
            assert not any(id.endswith(("lag", "clock_rate", "latency", "dropped_samples")) for id in ids)
    assert all(id in HIDING for id in ids[1:])
    assert Concealed(effect("mag.axes", axes="y x z")).effect.row.setup


def test_a_table_s_profile_is_no_sensor_and_keeps_its_seconds():
    case = draw_case(2, "rate_table", ["clock.units"])
    (faulty, *_) = recordings(replace(case, runs=case.runs[:1]))
    run = case.runs[0]
    assert isinstance(run, Turning)
    assert faulty.command is not None
    np.testing.assert_array_equal(faulty.command.t, run.profile.t)
    assert faulty.end > 100.0 * run.profile.t[-1]


def test_no_gyroscope_that_feels_acceleration_is_drawn_where_its_place_is_not_stated():
    """It feels the pull at the accelerometer's chip; without one its size is nobody's to tell."""
    drawn = [draw_case(seed, "rate_table", kind="setup") for seed in range(91040, 91060)]
    drawn += [draw_case(seed, kind="two") for seed in range(310010, 310110)]
    felt = [case for case in drawn if any(item.effect.id == "gyro.g_sensitivity" for item in case.concealed)]
    assert len(felt) > 2
    assert all("accelerometer" in case.instruments.sensors for case in felt)
    bare = [case for case in drawn if "accelerometer" not in case.instruments.sensors and len(case.concealed) > 1]
    assert bare


@pytest.mark.slow
def test_in_a_flight_the_air_tells_columns_apart_where_lost_samples_turn_the_phase():
    """A magnetometer that loses 1.4 % of its samples: turned by half a turn about the spin axis it costs less."""
    case = draw_case(92001, kind="setup")
    assert [item.effect.id for item in case.concealed] == ["mag.axes", "mag.dropped_samples"]
    found = find_setup_faults(recordings(case))
    assert found.effects == (case.concealed[0].effect,)


@pytest.mark.slow
def test_a_fault_that_other_physics_hides_from_the_sensors_relations_is_supposed_where_it_gains_most():
    """Stray iron at the ground spoils what the field says of a gyroscope whose columns are mixed up."""
    case = draw_case(93002, kind="setup")
    assert [item.effect.id for item in case.concealed] == ["gyro.axes", "mag.stray_field"]
    some = replace(case, runs=case.runs[:3], stated_releases=case.stated_releases[:3])
    findings = find_setup_faults(recordings(some))
    assert findings.faults == ()
    supposed = with_likeliest_fault(findings)
    assert supposed is not None
    assert supposed.effects == (case.concealed[0].effect,)


def test_of_sound_recordings_no_fault_is_supposed():
    sound = tuple(recordings(brief(CASES["flight"])))
    assert with_likeliest_fault(SetupFindings((), sound)) is None


def test_a_turned_board_is_told_by_what_all_sensors_say_though_physics_spoils_the_first_look_at_the_air():
    case = draw_case(93014, kind="setup")
    assert [item.effect.id for item in case.concealed] == ["board.rotation", "aero.spin_drag"]
    some = replace(case, runs=case.runs[:2], stated_releases=case.stated_releases[:2])
    (found,) = find_setup_faults(recordings(some)).effects
    true, told = (Rotation.from_rotvec([*one.value]) for one in (case.concealed[0].effect, found))
    assert (true.inv() * told).magnitude() < 0.1


@pytest.mark.slow
def test_where_the_field_alone_is_read_a_tilt_of_the_axis_and_another_field_stand_beside_each_other():
    case = draw_case(93006, kind="setup")
    assert case.concealed[1].effect.id == "rig.axis_tilt"
    made = [corrected(one, [case.concealed[0].effect]) for one in recordings(case)]
    found = search(SearchProblem(made))
    (candidate,) = found.final.hypothesis.candidates
    assert candidate.id == "rig.axis_tilt"
    assert "site.field" in [rival.candidate.id for rival in found.rivals["rig.axis_tilt"]]


def test_a_late_gyroscope_that_few_relations_show_is_borne_out_by_the_air():
    """No magnetometer, and an accelerometer whose x is cut off throughout."""
    case = draw_case(93029, kind="setup")
    assert [item.effect.id for item in case.concealed] == ["gyro.time_offset", "accel.saturation"]
    (found,) = find_setup_faults(recordings(case)).effects
    assert found.id == "gyro.time_offset"
    assert found.value.offset_s == pytest.approx(case.concealed[0].effect.value.offset_s, abs=2e-3)  # type: ignore[attr-defined]


@pytest.mark.slow
def test_lost_samples_of_an_accelerometer_are_no_offset_of_its_times():
    """One offset for all throws gains a fault's price by chance, and the motion follows it no better."""
    case = draw_case(511, "flight", kind="two")
    assert [item.effect.id for item in case.concealed] == ["accel.dropped_samples", "accel.scale"]
    assert find_setup_faults(recordings(case)).faults == ()


def test_a_clock_by_whose_error_phases_run_away_is_no_fault_of_the_setup_and_a_hint_to_the_fit():
    case = draw_case(92011, kind="setup")
    assert [item.effect.id for item in case.concealed] == ["accel.units", "gyro.clock_rate"]
    findings = find_setup_faults(recordings(replace(case, runs=case.runs[:3])))
    assert findings.effects == (case.concealed[0].effect,)
    hint = findings.hints[0]
    assert hint.id == "gyro.clock_rate"
    assert hint.value.ratio == pytest.approx(1.014078, abs=1.5e-3)  # type: ignore[attr-defined]


@pytest.mark.slow
def test_a_rate_reference_that_pulses_contradicts_nothing_and_that_of_another_run_does():
    """A ripple of the table's speed beside a turned board."""
    case = draw_case(93087, kind="setup")
    assert [item.effect.id for item in case.concealed] == ["board.rotation", "rig.speed_ripple"]
    made = [corrected(one, [case.concealed[0].effect]) for one in recordings(replace(case, runs=case.runs[:2]))]
    assert contradiction_in(made, ()) is None
    others = [
        replace(one, samples={**one.samples, "rate_reference": other.samples["rate_reference"]})
        for one, other in zip(made, made[::-1], strict=True)
    ]
    contradiction = contradiction_in(others, ())
    assert contradiction is not None
    assert "rate_reference" in contradiction.blamed
