"""Cases like a real logger's throws: what is drawn, that each of it is in the recordings, and how it is scored."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from discsim.disc import Release
from discsim.effects.catalogue import CATALOGUE
from discsim.engine import fly
from discsim.errors import InputError
from discsim.motion import Motion
from discsim.recording import Recording
from discsim.sensors import Noise
from discsim.validation.challenge.blind import Request
from discsim.validation.challenge.cases.case import Case
from discsim.validation.challenge.cases.conceal import Answer, read_answer, recordings
from discsim.validation.challenge.cases.detection_limit import sizes
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.challenge.report.page import fault_of
from discsim.validation.challenge.scores.result import Scored, rates_of
from discsim.validation.challenge.scores.scoring import score_case
from discsim.validation.cli import main

SEEDS = range(60)
#: a step of the loop, s, and rows that are cut off at the beginning
LOOP, CUT = 0.01, 3
#: cases that hide one thing each that the other does not
LOST, LATE = 4, 8


@cache
def drawn(seed: int) -> Case:
    return draw_case(seed, kind="like_real")


def ids(case: Case) -> tuple[str, ...]:
    return tuple(item.effect.id for item in case.concealed)


def size(case: Case, id: str) -> tuple[float, ...]:
    return tuple(next(item.effect for item in case.concealed if item.effect.id == id).value)


def quiet(seed: int, *kept: str) -> Case:
    """Return one run of a case without noise and rounding, with nothing concealed but what is ``kept``."""
    case = drawn(seed)
    instruments = case.instruments
    for name in instruments.sensors:
        instruments = instruments.fitted(name, noise=Noise(), resolution=0.0, range=np.inf)
    concealed = tuple(item for item in case.concealed if item.effect.id in kept)
    assert len(concealed) == len(kept)
    return replace(case, runs=case.runs[:1], hands=case.hands[:1], instruments=instruments, concealed=concealed)


def made(seed: int, *kept: str) -> tuple[Recording, Motion]:
    """Return that run as it is recorded, and its motion."""
    case = quiet(seed, *kept)
    (recording,) = recordings(case)
    (run,) = case.runs
    assert case.disc is not None
    assert isinstance(run, Release)
    return recording, fly(case.disc, case.environment, run, duration=case.longest)


def phase_times(recording: Recording, sensor: str, motion: Motion) -> np.ndarray:
    """Return when each reading of a sensor was made: the instant of the motion whose true reading is nearest."""
    t = np.arange(motion.start, motion.end, 1e-4)
    state = motion.at(t)
    true = state.in_body(motion.environment.magnetic_field) if sensor == "magnetometer" else state.rate
    value = recording.samples[sensor].value
    found, near = [], 0.0
    for row in value:
        ahead = (t > near - 0.02) & (t < near + 0.09)  # less than a turn
        found.append(t[ahead][np.argmin(np.linalg.norm(true[ahead] - row, axis=1))])
        near = found[-1]
    return np.array(found)


def test_what_is_always_there_is_there_and_what_need_not_be_is_there_at_times():
    found = [ids(drawn(seed)) for seed in SEEDS]
    for case in found:
        assert {"mag.own_clock", "accel.lag", "mag.hard_iron"} <= set(case)
        assert len({"clock.lost_rows", "clock.late_rows"} & set(case)) == 1
        assert len({"board.rotation", "mag.mount", "gyro.mount"} & set(case)) == 1
        assert len(set(case)) == len(case)
    share = {id: np.mean([id in case for case in found]) for id in CATALOGUE}
    # three standard deviations of a share of 60
    assert share["clock.late_rows"] == pytest.approx(0.25, abs=0.17)
    assert share["mag.average"] == pytest.approx(0.75, abs=0.17)
    assert share["imu.own_clock"] == pytest.approx(0.5, abs=0.2)
    assert share["mag.soft_iron"] == pytest.approx(0.25, abs=0.17)
    for id in ("board.rotation", "mag.mount", "gyro.mount"):
        assert share[id] == pytest.approx(1 / 3, abs=0.19)


def test_sizes_are_near_those_of_the_measured_throws():
    for seed in SEEDS:
        case = drawn(seed)
        assert (case.plant, case.verdict, len(case.runs), len(case.hands)) == ("free_spin", "explained", 4, 4)
        assert 0.05 <= size(case, "accel.lag")[0] <= 0.3
        assert 8.8e-3 <= size(case, "mag.own_clock")[0] <= 9.7e-3
        assert 5.0 <= np.linalg.norm(size(case, "mag.hard_iron")) <= 30.0 * (1 + 1e-6)
        for run in case.runs:
            assert 2.5 <= np.linalg.norm(run.body_rate[:2]) <= 14.0 * (1 + 1e-6)
            assert 3000.0 <= np.degrees(abs(run.body_rate[2])) <= 3900.0 + 1e-6


def test_rows_last_whole_steps_of_the_loop_and_the_stated_share_is_lost():
    recording, motion = made(LOST, "clock.lost_rows")
    steps = np.diff(phase_times(recording, "gyroscope", motion)) / LOOP
    assert steps == pytest.approx(np.rint(steps), abs=0.05)
    assert set(np.rint(steps)) >= {1.0, 2.0}
    lost = 1.0 - steps.size / np.sum(np.rint(steps))
    # three standard deviations of a share of some 250 steps
    assert lost == pytest.approx(size(drawn(LOST), "clock.lost_rows")[0], abs=0.09)
    assert {len(own) for own in recording.samples.values()} == {steps.size + 1}
    assert np.diff(recording.samples["gyroscope"].t) == pytest.approx(LOOP)


def test_late_rows_come_a_tick_late_and_none_is_lost():
    recording, motion = made(LATE, "clock.late_rows")
    tick, share = size(drawn(LATE), "clock.late_rows")
    off = phase_times(recording, "gyroscope", motion) - recording.samples["gyroscope"].t - CUT * LOOP
    assert np.minimum(np.abs(off), np.abs(off - tick))[:-1].max() < 4e-4
    assert np.mean(off > 0.5 * tick) == pytest.approx(share, abs=0.1)


def test_the_magnetometer_shows_whole_periods_of_its_own_in_lost_rows():
    recording, motion = made(LOST, "clock.lost_rows", "mag.own_clock")
    period = size(drawn(LOST), "mag.own_clock")[0]
    steps = np.diff(phase_times(recording, "magnetometer", motion)[1:]) / period
    assert steps == pytest.approx(np.rint(steps), abs=0.05)
    # beside a loop of 10 ms a sample is skipped at times even where no row was lost
    assert np.mean(steps) == pytest.approx(LOOP / period / (1.0 - size(drawn(LOST), "clock.lost_rows")[0]), abs=0.15)


def test_a_mean_of_two_samples_makes_the_field_smaller():
    mean, sound = made(LOST, "mag.average")[0], made(LOST)[0]
    turning = [np.std(one.samples["magnetometer"].value[:, 0]) for one in (mean, sound)]
    spin = abs(drawn(LOST).runs[0].body_rate[2])
    assert turning[0] / turning[1] == pytest.approx(np.cos(0.5 * spin * LOOP), abs=0.01)


def test_a_lag_holds_the_hand_and_lets_it_go_within_its_time_constant():
    late = made(LOST, "accel.lag")[0].samples["accelerometer"]
    (tau,), hand = size(drawn(LOST), "accel.lag"), drawn(LOST).hands[0]
    along = late.value @ hand / np.linalg.norm(hand)
    left = along - np.mean(along[late.t > 6.0 * tau])
    for k in (0.5, 1.0, 2.0):
        # what turns with the spin comes through the lag, too, smaller
        held = np.linalg.norm(hand) * np.exp(-k - CUT * LOOP / tau)
        assert np.interp(k * tau, late.t, left) == pytest.approx(held, abs=6.0)


def test_without_a_lag_no_hand_is_felt():
    case = quiet(LOST)
    (with_hand,), (without,) = recordings(case), recordings(replace(case, hands=()))
    assert with_hand.samples["accelerometer"].value == pytest.approx(without.samples["accelerometer"].value)


@pytest.mark.parametrize("id", ["mag.hard_iron", "mag.soft_iron", "mag.mount", "gyro.mount", "board.rotation"])
def test_iron_and_turns_are_in_the_recordings(id):
    seed = next(seed for seed in SEEDS if id in ids(drawn(seed)))
    sensor = "gyroscope" if id == "gyro.mount" else "magnetometer"
    turned, sound = (made(seed, *kept)[0].samples[sensor].value for kept in ((id,), ()))
    noise = drawn(seed).instruments.sensors[sensor].noise.white
    assert np.sqrt(np.mean((turned - sound) ** 2)) > 3.0 * noise


def test_nothing_of_it_is_stated():
    case = replace(drawn(LOST), runs=drawn(LOST).runs[:1], hands=drawn(LOST).hands[:1])
    bare = replace(case, concealed=(), hands=())
    (one,), (other,) = recordings(case), recordings(bare)
    assert one.disc is not None
    assert one.disc.aero is None
    assert one.sheets == other.sheets
    assert one.disc == other.disc


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"plant": "flight"}, "is a free spin"),
        ({"effects": ["mag.lag"]}, "expected no effect by name"),
        ({"mask": "short"}, "expected no mask short"),
    ],
)
def test_what_does_not_go_with_it_is_refused(asked, message):
    with pytest.raises(InputError, match=message):
        draw_case(1, kind="like_real", **asked)
    assert draw_case(1, "free_spin", kind="like_real").concealed == drawn(1).concealed


def told(case: Case) -> str:
    answer = Answer.of(case)
    numbers = {name: f"{value:.5g}" for name, value in {**answer.parameters, **answer.moved}.items()}
    sensors = {name: f"{sensor.sampling.rate_hz:g}" for name, sensor in case.instruments.sensors.items()}
    here = (answer.plant, answer.kind, answer.effects, numbers, answer.setting, answer.recordings)
    return repr((*here, len(case.runs), sensors))


def test_the_seeds_of_all_other_kinds_draw_what_they_drew_before_this_kind_came():
    """The digest was taken of the code as it was before; of no catalogue more kinds of physics are drawn since."""
    kinds = ("nothing", "noise", "within_sigma", "beyond_sigma", "one", "two", "setup")
    masks = ("short", "second_effect", "clipped", "coloured_noise")
    named = ("clock.lost_rows", "clock.late_rows", "mag.own_clock", "mag.average", "gyro.mount")
    cases = [draw_case(seed) for seed in range(40)]
    cases += [draw_case(seed, kind=kind) for kind in kinds for seed in range(40, 46)]
    cases += [draw_case(seed, mask=mask) for mask in masks for seed in range(50, 54)]
    cases += [draw_case(seed, "free_spin", [id]) for seed, id in enumerate(named)]
    listed = [case for case in cases if case.kind != "off_catalogue"]
    assert len(listed) == 91
    digest = hashlib.sha256("\n".join(map(told, listed)).encode()).hexdigest()
    assert digest == "de5ad8a02b749ed55476abd0caa4e715fb5f3419b16bfea381cf26ed97d11568"


# ---------------------------------------------------------------------------------------------- answers and scores


def both_clocks() -> Case:
    """Return a case in which two effects have a ``period_s``."""
    return next(drawn(seed) for seed in SEEDS if "imu.own_clock" in ids(drawn(seed)))


def test_names_that_two_effects_share_have_the_id_before_them_and_no_others(tmp_path):
    answer = Answer.of(both_clocks())
    assert "period_s" not in answer.parameters
    assert answer.parameters["mag.own_clock.period_s"] == answer.size("mag.own_clock", "period_s")
    assert answer.parameters["imu.own_clock.period_s"] == answer.size("imu.own_clock", "period_s")
    assert answer.size("mag.own_clock", "period_s") != answer.size("imu.own_clock", "period_s")
    assert answer.parameters["tau_s"] == answer.size("accel.lag", "tau_s")
    assert answer.size("mag.hard_iron", "nothing_m") is None
    (tmp_path / "answer.toml").write_text(answer.text)
    assert read_answer(tmp_path / "answer.toml") == answer


def diagnosis(answer: Answer, *left_out: str, beside: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return a diagnosis that names what was concealed, each parameter one standard deviation off."""
    effects = []
    for id in (*answer.effects, *beside):
        if id in left_out:
            continue
        parameters = {}
        for name in CATALOGUE[id].parameters:
            true = answer.size(id, name) or 0.0
            sd = 0.01 * abs(true) + 1e-6
            parameters[name] = {"value": true + sd, "sd": sd}
        effects.append({"id": id, "recordings": "all", "parameters": parameters, "confused_with": []})
    fit = {"chi2_per_sample": 1.0, "heldout_chi2_per_sample": 1.0}
    return {
        "verdict": "explained",
        "effects": effects,
        "located": [{"sensor": "all"}],
        "recalibrated": {},
        "law": None,
        "fit": {"baseline": fit, "final": fit},
    }


def opened(answer: Answer, found: dict[str, Any]) -> Scored:
    return Scored.opened(answer, found, error=None, seconds=1.0, recordings_sha256="0" * 64)


def test_each_parameter_is_compared_with_that_of_its_own_effect():
    answer = Answer.of(both_clocks())
    score = score_case(answer, diagnosis(answer))
    assert score.right
    assert [item.in_sd for item in score.deviations] == pytest.approx([1.0] * len(score.deviations), rel=1e-6)
    periods = [item.true for item in score.deviations if item.name == "period_s"]
    assert sorted(periods) == sorted(answer.size(id, "period_s") for id in ("mag.own_clock", "imu.own_clock"))


def test_every_concealed_effect_is_demanded_and_none_beside_them():
    answer = Answer.of(both_clocks())
    some = opened(answer, diagnosis(answer, "imu.own_clock"))
    more = opened(answer, diagnosis(answer, beside=("gyro.bias",)))
    assert not some.score.right
    assert not more.score.right
    assert fault_of(some) == "some of the effects not named"
    assert fault_of(more) == "effects named beside the right ones"
    rates = rates_of([some, more, opened(answer, diagnosis(answer))])
    assert (rates["right_like_real_rate"].hits, rates["right_like_real_rate"].of) == (1, 3)
    count = len(answer.effects)
    assert (rates["found_like_real_rate"].hits, rates["found_like_real_rate"].of) == (3 * count - 1, 3 * count)


def test_a_scored_case_survives_the_file_of_results():
    answer = Answer.of(both_clocks())
    item = opened(answer, diagnosis(answer))
    again = Scored.from_json(json.loads(json.dumps(item.to_json())))
    assert again.answer == answer
    assert again.score == item.score


def test_what_is_counted_row_by_row_has_no_detection_limit_and_the_rest_lies_above_its_own():
    case = drawn(LOST)
    found = sizes(replace(case, runs=case.runs[:1], hands=case.hands[:1]))
    counted = {item.effect.id for item in case.concealed if item.effect.row.detector == "row_times"}
    setup = {item.effect.id for item in case.concealed if item.effect.row.setup}
    assert set(found) == set(ids(case)) - counted - setup
    assert all(value > 2.0 for value in found.values())
    # a lag that holds nothing all but hides in the means over turns
    without = sizes(replace(case, runs=case.runs[:1], hands=()))
    assert without["accel.lag"] < 0.1 * found["accel.lag"]


def test_the_command_knows_the_kind_and_says_what_does_not_go_with_it(tmp_path, monkeypatch, capsys):
    assert Request(3, kind="like_real").command == "discsim challenge --seed 3 --cases 1 --kind like_real"
    words = ["discsim", "challenge", "--kind", "like_real", "--plant", "flight", "--out", str(tmp_path / "out")]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as stopped:
        main()
    assert stopped.value.code == 2
    assert "kind like_real: is a free spin; expected no plant flight" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
