"""What a plan foretells, against closed forms, another code's information, and what must hold of any information."""

from __future__ import annotations

import json
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import ncx2

from discsim.disc import Release
from discsim.effects.catalogue import CATALOGUE
from discsim.errors import InputError
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import release_state
from discsim.validation.challenge.cases.detection_limit import noncentrality
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.cli import main
from discsim.validation.diagnosis.design.plans import read_plans
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.planning.advice import NextThrow, bought, next_throws
from discsim.validation.planning.information import Information, information_of, questions_of
from discsim.validation.planning.limits import coefficients_of, limits_of, needed
from discsim.validation.planning.planned import Planned, throws_about
from discsim.validation.planning.recordings import Bench, planned_trajectory

DISC, FIELD = load_disc("driver")
TABLE = """
[[recording]]
text = "up and hold"
time_s = [0.0, 1.0, 5.0]
rate_rad_s = [20.0, 60.0, 60.0]
"""


def information(bench: Bench, plans: list[Plan]) -> Information:
    trajectories = [planned_trajectory(item, bench) for item in plans]
    assert None not in trajectories
    return information_of(trajectories, questions_of([one.recording for one in trajectories], 1.0))


@pytest.fixture(scope="module")
def table_plans(tmp_path_factory) -> list[Plan]:
    path = tmp_path_factory.mktemp("plan") / "plan.toml"
    path.write_text(TABLE)
    return read_plans(path, "rate_table")


@pytest.fixture(scope="module")
def table(table_plans) -> Information:
    return information(Bench.of("rate_table", FIELD, ["mpu9250"]), table_plans)


@pytest.fixture(scope="module")
def flights() -> Information:
    return information(Bench.of("flight", FIELD, ["mpu9250", "neo_m8n"], DISC), throws_about(load_throw("driver"), 2))


def size(found: Information, id: str, name: str, kind: str = "seen") -> float:
    one = next(limit for limit in limits_of(found).effects if limit.id == id)
    return dict(zip(one.parameters, getattr(one, kind), strict=True))[name]


@pytest.mark.parametrize(("price", "parameters"), [(28.0, 1), (36.0, 3), (60.0, 4)])
def test_half_of_the_gains_exceed_the_price_at_the_size_that_is_needed(price, parameters):
    assert ncx2.sf(price, parameters, needed(price, parameters)) == pytest.approx(0.5, abs=1e-9)


def test_iron_along_the_axis_of_a_table_is_seen_as_the_mean_of_its_readings_allows(table):
    """Nothing else of three axes moves z of a steady table: the sd of its mean is sigma over the root of n."""
    (one,) = table.trajectories
    count = len(one.recording.samples["magnetometer"])
    sheet = one.recording.sheets["magnetometer"]
    sigma = np.hypot(sheet.noise_rms, sheet.resolution / np.sqrt(12.0))
    expected = sigma / np.sqrt(count) * np.sqrt(needed(24.0 + 4.0 * 3, 3))
    assert size(table, "mag.hard_iron", "bz_uT") == pytest.approx(expected, rel=1e-3)


def test_twice_as_many_recordings_and_half_the_noise_are_worth_what_statistics_says(table):
    once = size(table, "mag.hard_iron", "bx_uT")
    assert size(table.times(2), "mag.hard_iron", "bx_uT") == pytest.approx(once / np.sqrt(2), rel=1e-4)
    half = table.quieter(dict.fromkeys(table.noise, 0.5))
    assert size(half, "mag.hard_iron", "bx_uT") == pytest.approx(once / 2, rel=1e-4)


def test_what_happens_once_is_told_by_its_own_recording_alone(flights):
    assert size(flights.times(3), "event.impulse", "dv_north_m_s") > 0.9 * size(
        flights, "event.impulse", "dv_north_m_s"
    )
    assert size(flights.times(3), "air.density", "ratio") < 0.6 * size(flights, "air.density", "ratio")


def test_a_lag_and_an_offset_of_time_are_never_told_apart(flights):
    pairs = {(pair.id, pair.rival): pair for pair in limits_of(flights).pairs}
    assert pairs["mag.lag", "mag.time_offset"].apart == np.inf
    assert ("air.wind", "mag.hard_iron") not in pairs


def test_only_what_takes_all_of_a_trace_is_never_told_from_it(flights):
    """A parameter that a simpler effect takes whole, as a turn of the axis of spin, says nothing of other rivals."""
    found = limits_of(flights)
    never = [pair for pair in found.pairs if np.isinf(pair.apart)]
    assert ("gyro.cross_axis", "gyro.mount") in {(pair.id, pair.rival) for pair in never}
    assert min(pair.taken for pair in never) > 0.999
    assert not [pair for pair in found.pairs if pair.id == "gyro.cross_axis" and np.isfinite(pair.apart)]


def test_a_pair_comes_apart_at_so_many_times_the_size_that_is_named(flights):
    found = limits_of(flights)
    sizes = {one.id: one for one in found.effects if len(one.parameters) == 1}
    some = [pair for pair in found.pairs if pair.id in sizes and np.isfinite(pair.apart)]
    assert len(some) > 10
    for pair in some:
        one = sizes[pair.id]
        scale = CATALOGUE[one.id].fitted_scale[one.parameters[0]]
        assert pair.visible == pytest.approx(pair.apart * one.named[0] / scale, rel=1e-9)


def test_the_page_lists_pairs_by_effect_and_only_such_as_somebody_could_see(flights, tmp_path):
    limits = limits_of(flights)
    bench = Bench.like(flights.trajectories[0].recording)
    plans = tuple(throws_about(load_throw("driver"), 2))
    helpful = NextThrow("a slow throw", 1.1, 1.1, 1.1, 1.6)
    made = Planned(plans, 1, bench, flights, limits, tuple(coefficients_of(flights)), (helpful,), ())
    page = made.report(tmp_path).read_text()
    section = re.sub("<[^>]+>", " ", page[page.index("What could not be told apart") :].split("</section>")[0])
    listed = re.findall(r"^ *(\w+\.\w+) ", section, re.M)
    assert len(set(listed)) == len(listed) < 25 < len(limits.pairs)
    assert "body.mass_imbalance" not in listed  # told apart at half of a visible size
    assert re.search(r"mag.lag\s+mag.time_offset\s+mag.mount \(", section)
    assert re.search(r"\d+ further pairs are in plan.json", section)
    assert "divides such sizes by 1.60: a slow throw." in section
    assert "gyro.scale sz" in page  # nothing shows it, for the axis clips
    assert "at the range throughout show nothing: z of the gyroscope." in page


@pytest.mark.parametrize("id", ["air.wind", "aero.yaw_reynolds"])
def test_the_information_is_that_of_the_challenges_own_code(id):
    """Which takes differences of whole flights, one by one, and a singular value decomposition in place of blocks."""
    case = draw_case(77, "flight", [id])
    case = replace(
        case, instruments=case.sheets_of, runs=case.runs[:2], stated_disc=replace(case.stated_disc, sigma={})
    )
    sheets = {name: part.sheet for name, part in case.sheets_of.sensors.items()}
    bench = Bench(case.plant, case.environment, case.stated_disc, None, sheets)
    states = [release_state(run)[:13] for run in case.runs if isinstance(run, Release)]
    found = information(bench, [Plan("", state, case.longest) for state in states])
    limit = next(one for one in limits_of(found).effects if one.id == id)
    hidden = case.concealed[0].effect.value
    way = np.array([getattr(hidden, name) for name in limit.parameters])
    # to 5 %: they count the last readings of a flight and those near a range not quite alike
    assert way @ limit.information @ way == pytest.approx(noncentrality(case, case.concealed[0]), rel=0.05)


def test_coefficients_free_together_are_known_less_than_each_alone_and_more_throws_tell_more(flights):
    once, twice = coefficients_of(flights), coefficients_of(flights.times(2))
    assert [one.name for one in once] == list(DISC.aero._fields)
    for one, other in zip(once, twice, strict=True):
        assert one.together >= one.alone
        assert other.alone == pytest.approx(one.alone / np.sqrt(2), rel=1e-4)
        assert other.together == pytest.approx(one.together / np.sqrt(2), rel=1e-3)


def test_a_further_throw_never_takes_knowledge_away_and_the_best_is_first(flights):
    bench = Bench.like(flights.trajectories[0].recording)
    offered = throws_about(load_throw("driver"), 2)
    ranked = next_throws(flights, limits_of(flights), offered, bench)
    assert len(ranked) == 2
    assert ranked[0].coefficients >= ranked[1].coefficients > 1.0
    assert all(one.effects > 1.0 and one.CNr > 1.0 for one in ranked)


def test_a_sensor_with_half_the_noise_helps_and_its_absence_hurts(flights):
    told = {one.text: one for one in bought(flights, limits_of(flights))}
    assert told["gps with half the noise"].CNr > 1.0 > told["no gps"].CNr
    assert told["accelerometer with half the noise"].effects > 1.0 > told["no accelerometer"].effects


def test_a_throw_from_the_ground_is_no_recording():
    state = throws_about(load_throw("driver"), 1)[0].state.copy()
    state[2] = 0.1
    assert planned_trajectory(Plan("", state, 5.0), Bench.of("flight", FIELD, ["mpu9250"], DISC)) is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--plant", "sailing"], "--plant sailing: unknown"),
        (["--plant", "spin_down", "plan.toml"], "needs a rig"),
        (["--plant", "rate_table"], "with time_s and rate_rad_s, lists of knots, in each [[recording]]"),
        (["--plant", "free_spin"], "expected recordings in hand as --like DATASET, or a TOML file"),
        (["plan.toml", "--like", "set"], "both say what is recorded"),
        (["--parts", "neo_m8n", "--plant", "rate_table", "plan.toml"], "no sensor of these works"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_in_a_sentence(words, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("plan.toml").write_text(TABLE)
    monkeypatch.setattr(sys, "argv", ["discsim", "plan", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 2
    assert said in capsys.readouterr().err


def test_the_command_writes_what_a_table_could_show(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("plan.toml").write_text(TABLE)
    words = ["plan", "plan.toml", "--plant", "rate_table", "--parts", "mpu9250", "--candidates", "plan.toml"]
    monkeypatch.setattr(sys, "argv", ["discsim", *words, "--out", "out"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert not stop.value.code
    told = json.loads(Path("out/plan.json").read_text())
    assert told["recordings"] == ["up and hold"]
    assert {"mag.hard_iron", "rig.axis_tilt"} <= {one["id"] for one in told["effects"]}
    assert "Before going out" in Path("out/report.html").read_text()


def test_an_effect_that_nothing_shows_has_no_size_and_one_without_a_disc_no_coefficients(table):
    assert coefficients_of(table) == []
    with pytest.raises(InputError, match="no_such_part"):
        Bench.of("rate_table", FIELD, ["no_such_part"])
