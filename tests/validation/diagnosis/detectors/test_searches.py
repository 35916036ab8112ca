"""Searches for touches, knocks, gusts, ripples, limits and lost samples: on MuJoCo's motions, and on clean ones."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from discsim.disc import Release
from discsim.effects.catalogue import Effect, catalogued, effect
from discsim.effects.sensors import ClockRate
from discsim.engine import fly
from discsim.motion import Motion
from discsim.recording import Recording, Samples
from discsim.rig import turn_table
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.detectors import dropped_samples
from discsim.validation.diagnosis.detectors.dropped_samples import (
    begun_later,
    dropped_accelerometer,
    dropped_magnetometer,
    loses_samples,
    recounted,
)
from discsim.validation.diagnosis.detectors.events import events
from discsim.validation.diagnosis.detectors.gusts import gusts
from discsim.validation.diagnosis.detectors.local_problem import LocalProblems, local_problems
from discsim.validation.diagnosis.detectors.sample_alignment import (
    Alignment,
    alignment_of,
    lost_along,
    lost_and_turned,
    lost_in_own_noise,
    phase_counts,
    told_of,
    viterbi_counts,
)
from discsim.validation.diagnosis.detectors.saturation import saturation
from discsim.validation.diagnosis.detectors.speed_ripple import ripple
from discsim.validation.diagnosis.detectors.time_offsets import time_offsets
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.identification.clipping import clipping_level_of, equal_beyond_chance
from discsim.validation.identification.gauss_newton import Fit, refit
from discsim.validation.identification.noise import estimate_noise, stated_noise
from discsim.validation.identification.plants.rate_table import RATE_TABLE
from discsim.validation.identification.prediction import shown
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.stated_parameters import stated_parameters

DRIVER, FIELD = load_disc("driver")
MODULE = Instruments.from_parts("mpu9250", "neo_m8n")
PROFILE = Samples(np.array([0.0, 2.0, 3.0, 6.0]), np.array([12.0, 12.0, 55.0, 55.0]))
RIPPLE = effect("rig.speed_ripple", order=2.06, amplitude_rad_s=0.05, phase_rad=0.4)


@cache
def flight(*hidden: Effect, heading: float = 0.0) -> Motion:
    """Two and a half seconds of a throw."""
    c, s = np.cos(heading), np.sin(heading)
    release = Release(
        np.array([0.0, 0.0, -1.3]),
        np.array([22.0 * c, 22.0 * s, -3.5]),
        np.radians(-12.0),
        np.radians(8.0),
        0.3,
        np.array([0.5, -0.4, 70.0]),
    )
    return fly(DRIVER, FIELD, release, hidden, duration=2.5)


def measured(motion: Motion, *errors: Effect, seed: int = 1) -> Recording:
    module = MODULE.with_effects(errors)
    return record(motion, module, np.random.default_rng(seed), plant="flight", name="throw", disc=DRIVER)


@cache
def throws(hidden: tuple[Effect, ...] = (), errors: tuple[Effect, ...] = ()) -> tuple[Recording, ...]:
    """Two throws, an event in the second; errors of sensors in both."""
    return (
        measured(flight(heading=0.5), *errors, seed=1),
        measured(flight(*hidden, heading=-0.8), *errors, seed=2),
    )


@cache
def relaxed_fit(hidden: tuple[Effect, ...] = (), errors: tuple[Effect, ...] = ()) -> Fit:
    return relaxed(throws(hidden, errors))


def questions(hidden: tuple[Effect, ...] = ()) -> LocalProblems:
    fit = relaxed_fit(hidden)
    return local_problems(fit, shown_noise(fit), (), Hypothesis())


def shown_noise(fit: Fit):  # type: ignore[no-untyped-def]
    return estimate_noise(fit.linears, [linear.residual for linear in fit.linears])


def table(*hidden: Effect, errors: tuple[Effect, ...] = ()) -> Recording:
    motion = turn_table(PROFILE, FIELD, hidden)
    module = Instruments.from_parts("mpu9250").with_effects(errors)
    return record(motion, module, np.random.default_rng(4), plant="rate_table", name="table", command=PROFILE)


# what makes a screened candidate worth a refit; with nothing hidden the best of some dozen boundaries gains 18 at most
LEAST = 25.0


@pytest.mark.parametrize(
    ("hidden", "sizes"),
    [
        (
            effect("event.impulse", t_s=1.237, dv_north_m_s=0.1, dv_east_m_s=-0.2, dv_down_m_s=0.05),
            {"dv_north_m_s": 0.1, "dv_east_m_s": -0.2, "dv_down_m_s": 0.05},
        ),
        (effect("event.spin_step", t_s=1.237, dr_rad_s=0.4), {"dr_rad_s": 0.4}),
    ],
)
def test_an_event_is_found_in_its_recording_at_its_instant_with_its_size(
    hidden: Effect, sizes: dict[str, float]
) -> None:
    best = events(questions((hidden,)))[0]
    assert best.candidate.id == hidden.id
    assert best.candidate.recordings == frozenset([1])
    fitted = continuous_fit(
        relaxed_fit((hidden,)), Hypothesis((best.candidate,)), (), shown_noise(relaxed_fit((hidden,))), best.start
    )
    found = {
        q.name: (v, s)
        for q, v, s in zip(fitted.fit.parameters, fitted.fit.at, np.sqrt(np.diag(fitted.fit.covariance)), strict=True)
    }
    assert found["t_s"][0] == pytest.approx(1.237, abs=0.02)
    for name, size in sizes.items():
        value, sd = found[name]
        assert value == pytest.approx(size, abs=4.0 * sd)
        assert sd < 0.2 * max(abs(v) for v in sizes.values())


def test_a_touch_that_only_an_accelerometer_feels_is_found_at_its_instant() -> None:
    """Two hundredths of a metre per second: nothing after it shows the velocity, which a look for steps asks for."""
    hidden = effect("event.impulse", t_s=1.163, dv_north_m_s=-0.001, dv_east_m_s=-0.017, dv_down_m_s=-0.009)
    best = events(questions((hidden,)))[0]
    assert best.candidate.id == hidden.id
    assert best.candidate.recordings == frozenset([1])
    assert best.candidate.shape_grid["t_s"] == pytest.approx(1.163, abs=0.005)
    assert best.start[("event.impulse", "dv_east_m_s"), best.candidate.recordings] == pytest.approx(-0.017, abs=0.003)


def test_a_gust_is_found_in_its_recording_near_its_instant() -> None:
    hidden = effect("air.gust", t_s=1.1, width_s=0.3, w_north_m_s=0.9, w_east_m_s=-0.5)
    best = gusts(questions((hidden,)))[0]
    assert best.candidate.recordings == frozenset([1])
    assert best.candidate.shape_grid["t_s"] == pytest.approx(1.1, abs=0.25)
    assert best.start[("air.gust", "w_north_m_s"), best.candidate.recordings] > 0.3


def test_nothing_is_proposed_for_throws_that_hide_nothing() -> None:
    problems = questions()
    assert events(problems, LEAST + 20.0) == []
    assert gusts(problems, LEAST) == []
    assert saturation(relaxed_fit(), shown_noise(relaxed_fit())) == []
    assert dropped_accelerometer(relaxed_fit(), shown_noise(relaxed_fit())) == []


def test_steps_of_the_phase_tell_how_many_samples_were_lost() -> None:
    motion = flight(heading=0.5)
    whole = measured(motion)
    short = measured(motion, effect("mag.dropped_samples", fraction=0.04))
    gone = len(whole.samples["magnetometer"]) - len(short.samples["magnetometer"])
    assert gone > 3
    # losses among the first and the last few samples have no neighbours to be judged by
    assert phase_counts(short)[-1] == pytest.approx(gone, abs=2)
    assert phase_counts(whole)[-1] == 0


def test_a_wrong_clock_is_not_taken_for_lost_samples() -> None:
    assert phase_counts(measured(flight(heading=0.5), effect("mag.clock_rate", ratio=1.02)))[-1] == 0


def test_lost_samples_of_the_accelerometer_are_counted_by_the_motion_of_the_others() -> None:
    errors = (effect("accel.dropped_samples", fraction=0.02),)
    fit = relaxed_fit((), errors)
    (found,) = dropped_accelerometer(fit, shown_noise(fit))
    whole, short = throws(), throws((), errors)
    for trajectory, a, b in zip(found.trajectories, whole, short, strict=True):
        gone = len(a.samples["accelerometer"]) - len(b.samples["accelerometer"])
        assert trajectory.lost["accelerometer"][-1] == pytest.approx(gone, abs=1)
    ((name, share, sd),) = found.screened.candidate.fixed_values
    assert name == "fraction"
    assert share == pytest.approx(0.02, abs=4.0 * sd)


def test_what_is_lost_while_a_rate_is_held_to_the_end_is_not_told() -> None:
    rng = np.random.default_rng(8)
    course = np.column_stack([np.minimum(np.arange(1008) * 0.02, 10.0), np.full(1008, 9.8)])
    own = Alignment(course[:1000] + 0.1 * rng.standard_normal((1000, 2)), course, np.arange(1000), 7, range(0))
    counts, sd = np.zeros(1000, dtype=np.int64), np.full(2, 0.1)
    # it takes so many samples of the slope for one more loss to say more than its price against it
    assert told_of(own, counts, sd) == pytest.approx(500, abs=2.0 * np.log(100.0) / (0.02 / 0.2) ** 2)
    assert told_of(own, counts, sd) < 500
    held = replace(own, shown=np.full_like(course, 9.8))
    assert told_of(held, counts, sd) == 0
    # more cannot have been lost than there is room for
    assert told_of(replace(own, most=0), counts, sd) == 1000


def test_the_share_of_lost_samples_is_of_those_among_which_a_loss_would_show() -> None:
    held = Samples(np.array([0.0, 1.0, 2.0, 6.0]), np.array([12.0, 12.0, 35.0, 35.0]))
    lost = Instruments.from_parts("mpu9250").with_effects([effect("accel.dropped_samples", fraction=0.03)])
    motion = turn_table(held, FIELD)
    fit = relaxed([record(motion, lost, np.random.default_rng(5), plant="rate_table", name="table", command=held)])
    (found,) = dropped_accelerometer(fit, shown_noise(fit))
    [(_, share, sd)] = found.screened.candidate.fixed_values
    counted = float(found.trajectories[0].lost["accelerometer"][-1])
    # of what was lost after the last one found nothing tells
    assert counted / share < len(fit.trajectories[0].recording.samples["accelerometer"])
    assert abs(share - 0.03) < 3.0 * sd


@pytest.mark.slow
def test_lost_samples_are_counted_where_segments_have_followed_the_sensor_through_them() -> None:
    """Ten samples of 2000: by the motion that followed them none seemed lost, and a set was left unexplained."""
    fit = relaxed(recordings(draw_case(627025)))
    (found,) = dropped_accelerometer(fit, shown_noise(fit))
    assert [trajectory.lost["accelerometer"][-1] for trajectory in found.trajectories] == [3.0, 2.0, 5.0]


@cache
def lost_in_other_air() -> tuple[Fit, list[dropped_samples.Shifted]]:
    """Two throws in air that is thinner than stated, whose accelerometer lost samples, and what is found of them."""
    air, lost = effect("air.density", ratio=0.93), effect("accel.dropped_samples", fraction=0.03)
    motions = [flight(air, heading=heading) for heading in (0.5, -0.8)]
    fit = relaxed([measured(motion, lost, seed=seed) for seed, motion in enumerate(motions, 1)])
    return fit, dropped_accelerometer(fit, shown_noise(fit))


def test_lost_samples_are_counted_where_the_air_is_thinner_than_stated() -> None:
    """What the motion then tells of an accelerometer is off by many times its noise, and so is that noise."""
    _, (found,) = lost_in_other_air()
    for trajectory in found.trajectories:
        own, gyroscope = (trajectory.recording.samples[sensor] for sensor in ("accelerometer", "gyroscope"))
        rate_hz = trajectory.recording.sheets["accelerometer"].rate_hz
        missing = round((gyroscope.t[-1] - own.t[-1]) * rate_hz)
        assert missing > 3
        assert trajectory.lost["accelerometer"][-1] == pytest.approx(missing, abs=1)


def assert_mended(
    anew: tuple[dropped_samples.Shifted, float] | None,
    right: tuple[Trajectory, ...],
    wrong: tuple[Trajectory, ...],
    sensor: str,
) -> None:
    """Fail unless a sensor's losses were counted anew, and nine in ten of the wrong counts are right."""
    assert anew is not None
    for trajectory, own, bent in zip(anew[0].trajectories, right, wrong, strict=True):
        counts, truth, mistaken = (one.lost[sensor] for one in (trajectory, own, bent))
        assert np.mean(counts != truth) < 0.1 * np.mean(mistaken != truth)


def test_a_fit_with_lost_samples_goes_on_in_the_time_in_which_they_were_counted() -> None:
    """Before they were, a clock took them up; the motion with them is not one that this clock has stretched."""
    module = MODULE.fitted("gyroscope", range=104.72).with_effects([effect("mag.dropped_samples", fraction=0.08)])
    made = [
        record(flight(heading=heading), module, np.random.default_rng(seed), plant="flight", name="throw", disc=DRIVER)
        for seed, heading in enumerate((0.5, -0.8), 1)
    ]
    fit = relaxed(made)
    clock = [q.group for q in fit.parameters].index(catalogued(ClockRate, "clock").id)
    assert abs(float(fit.at[clock]) - 1.0) > 0.02
    (found,) = dropped_magnetometer(fit, ())
    start, hypothesis = found.in_place_of(fit), Hypothesis((found.screened.candidate,))
    fitted = continuous_fit(start, hypothesis, (), shown_noise(fit), {})
    stated = stated_noise(fitted.fit.linears)["magnetometer"].sd
    assert fitted.fit.noise["magnetometer"].sd < 1.2 * stated


def test_counts_that_are_right_stay_and_others_are_mended_by_the_motion() -> None:
    fit, (found,) = lost_in_other_air()
    right = replace(fit, trajectories=found.trajectories)
    early = tuple(
        replace(one, lost={"accelerometer": np.minimum(one.lost["accelerometer"] + 1.0, one.lost["accelerometer"][-1])})
        for one in found.trajectories
    )
    anew = recounted(replace(right, trajectories=early), "accelerometer")
    assert_mended(anew, found.trajectories, early, "accelerometer")
    assert recounted(relaxed_fit(), "accelerometer") is None


@pytest.mark.slow
def test_counts_of_a_magnetometer_are_mended_by_the_motion_too() -> None:
    """Where the gyroscope clips, segments that follow the field take a loss for a turn: 2 of 240 blind cases."""
    fit = relaxed_fit((), (effect("mag.dropped_samples", fraction=0.03),))
    (found,) = dropped_magnetometer(fit, stated_parameters(throws()))
    late = tuple(
        replace(one, lost={"magnetometer": np.maximum(one.lost["magnetometer"] - 1.0, 0.0)})
        for one in found.trajectories
    )
    followed = refit(replace(fit, trajectories=found.trajectories), iterations=6)
    wrong = tuple(replace(one, lost=other.lost) for one, other in zip(followed.trajectories, late, strict=True))
    anew = recounted(replace(followed, trajectories=wrong), "magnetometer")
    assert_mended(anew, found.trajectories, late, "magnetometer")
    assert recounted(relaxed_fit(), "magnetometer") is None


def test_samples_lost_before_the_first_reading_count_in_that_recording_and_have_their_price() -> None:
    fit = relaxed_fit()
    shifted, dearer = begun_later(fit, "magnetometer", 0, 2)
    first, *others = shifted.trajectories
    assert np.all(first.lost["magnetometer"] == 2.0)
    assert all("magnetometer" not in one.lost for one in others)
    count = len(fit.trajectories[0].recording.samples["magnetometer"])
    [(name, share, _)] = shifted.screened.candidate.fixed_values
    assert (name, share) == ("fraction", pytest.approx(2.0 / (count + 2.0)))
    assert dearer == pytest.approx(2.0 * 2.0 * (1.0 - np.log(share)))
    again, dearer = begun_later(replace(fit, trajectories=shifted.trajectories), "magnetometer", 0, 1)
    assert np.all(again.trajectories[0].lost["magnetometer"] == 3.0)
    assert dearer > 0.0


def test_a_motion_that_is_known_to_a_line_tells_what_was_lost_and_the_noise() -> None:
    rng = np.random.default_rng(3)
    turned = 2.0 * np.pi * np.arange(330.0)[:, None] / 17.0 + np.array([0.0, 1.6])
    motion = np.column_stack([np.sin(turned), 0.01 * np.arange(330.0)])
    lost = np.repeat([0, 1, 2, 4], [60, 90, 70, 80])
    place = np.arange(lost.size)
    measured = 0.9 * motion[place + lost] + np.array([3.0, -1.0, 0.5]) + 0.05 * rng.standard_normal((lost.size, 3))
    own = Alignment(measured, motion, place, most=20, missing=range(0))
    found = lost_in_own_noise(own, np.full(3, 0.02), np.full(3, 2.0))
    assert np.count_nonzero(found.counts != lost) <= 3
    assert found.noise == pytest.approx(np.full(3, 0.05), rel=0.2)
    assert found.gain > 1000.0
    sound = lost_in_own_noise(replace(own, measured=measured[:60], place=place[:60]), np.full(3, 0.02), np.full(3, 2.0))
    assert sound.counts[-1] == 0.0
    assert sound.gain == pytest.approx(0.0, abs=1e-9)


def test_losses_of_a_pull_that_dies_away_are_counted_though_all_slip_to_one_side() -> None:
    """Counts began about the median of what no loss leaves, and three of forty were found: the rest passed for it."""
    rng = np.random.default_rng(5)
    rate, sampled = 100.0, 2500
    grid = np.arange(sampled + 60) / rate
    shown = np.column_stack([40.0 * np.exp(-grid / 9.0), 0.0 * grid, np.full(grid.size, -9.8)])
    kept = np.flatnonzero(rng.random(sampled) > 0.017)
    measured = shown[kept] + 0.035 * rng.normal(size=(kept.size, 3))
    own = Alignment(measured, shown, np.arange(kept.size), 60, range(0))
    found = lost_in_own_noise(own, np.full(3, 0.035), np.full(3, 0.05))
    off = found.counts - (kept - np.arange(kept.size))
    # in ten seconds a loss still moves the readings by half of their noise; a few later its place is not told
    assert np.median(off[:1000]) == 0.0
    assert np.max(np.abs(off[:1000])) <= 2.0
    assert found.noise[0] == pytest.approx(0.035, rel=0.05)


def test_a_loss_that_a_fit_overlooked_by_turning_all_is_found_by_turning_back() -> None:
    """A disc that runs down; a fit without the first loss has turned the yaw of all by what it makes on average."""
    rng = np.random.default_rng(6)
    yaw = 0.66 * 2000.0 * (1.0 - np.exp(-np.arange(2040.0) / 2000.0))
    motion = np.column_stack([22.0 * np.cos(yaw), -22.0 * np.sin(yaw), np.full(yaw.size, 39.0)])
    lost = np.repeat([0, 1, 2, 3], [170, 330, 700, 800])
    place = np.arange(lost.size)
    measured = motion[place + lost] + 0.8 * rng.standard_normal((lost.size, 3))
    sd = np.full(3, 0.8)
    own = Alignment(measured, motion, place, most=8, missing=range(3, 4)).turned(0.4)
    assert np.count_nonzero(lost_along(own, sd).counts != lost) > 100
    found, turn = lost_and_turned(own, sd)
    assert np.count_nonzero(found.counts != lost) <= 3
    assert turn == pytest.approx(-0.4, abs=0.01)


@pytest.mark.parametrize("ratio", [1.015, 0.985])
def test_a_flight_is_followed_by_the_others_where_the_clock_of_one_sensor_is_wrong(ratio: float) -> None:
    """With all at once the accelerometer's phase, off by turns, leads the fit astray."""
    fit = relaxed_fit((), (effect("accel.clock_rate", ratio=ratio),))
    assert fit.merit < 1.2 * fit.count
    assert fit.values(0)["accel.clock_rate", "ratio"] == pytest.approx(ratio, abs=2e-4)


def test_counts_never_fall_and_follow_the_cheapest_way() -> None:
    # samples 0 1 2 | 4 5 of a ramp: one was lost before the fourth
    ramp, taken = np.arange(7.0), np.array([0, 1, 2, 4, 5])
    cost = ((taken[:, None] - ramp[np.arange(5)[:, None] + np.arange(3)]) / 0.1) ** 2
    counts, least = viterbi_counts(cost, np.array([0, 1, 1, 1, 1]), each=9.0)
    assert counts.tolist() == [0, 0, 0, 1, 1]
    assert least == pytest.approx(9.0)


def test_readings_that_stand_still_below_the_range_are_a_limit() -> None:
    errors = (effect("accel.saturation", limit_m_s2=40.0),)
    fit = relaxed_fit((), errors)
    (found,) = saturation(fit, shown_noise(fit))
    ((name, limit, _),) = found.candidate.fixed_values
    assert name == "limit_m_s2"
    assert limit == pytest.approx(40.0, abs=1e-9)
    assert found.gain > 1000.0


def test_noise_alone_makes_no_plateau() -> None:
    rng = np.random.default_rng(3)
    for size in (50, 2000, 20000):
        steady = 60.0 + 0.08 * rng.standard_normal((size, 3))
        assert clipping_level_of(np.round(steady / 0.005) * 0.005, 0.005) is None
        assert clipping_level_of(np.minimum(np.round(steady / 0.005) * 0.005, 60.0), 0.005) == 60.0


def test_equal_readings_count_against_chance() -> None:
    def spun(top: float) -> Recording:
        made = throws()[0]
        felt = made.need("accelerometer")
        samples = {**made.samples, "accelerometer": Samples(felt.t, np.clip(felt.value, -top, top))}
        return replace(made, samples=samples)

    assert equal_beyond_chance(spun(1e3)) < 25.0
    assert equal_beyond_chance(spun(60.0)) > 100.0


def test_a_ripple_is_found_at_its_order_amplitude_and_phase() -> None:
    fit = relaxed([table(RIPPLE)])
    noise = shown_noise(fit)
    fitted = continuous_fit(fit, Hypothesis(), (), noise, {})
    best = ripple(fitted.fit, fitted.fit.noise)[0]
    refit = continuous_fit(fit, Hypothesis((best.candidate,)), (), noise, best.start)
    found = {q.name: v for q, v in zip(refit.fit.parameters, refit.fit.at, strict=True)}
    assert found["order"] == pytest.approx(2.06, abs=2e-3)
    assert found["amplitude_rad_s"] == pytest.approx(0.05, rel=0.05)
    assert found["phase_rad"] == pytest.approx(0.4, abs=0.15)


def test_a_steady_table_has_no_ripple() -> None:
    fit = relaxed([table()])
    fitted = continuous_fit(fit, Hypothesis(), (), shown_noise(fit), {})
    assert ripple(fitted.fit, fitted.fit.noise) == []


def test_a_table_that_stands_still_has_no_ripple() -> None:
    """A ripple repeats over the angle turned: none is turned, and there is nothing to ask."""
    still = Samples(np.array([0.0, 2.0]), np.zeros(2))
    made = record(
        turn_table(still, FIELD),
        Instruments.from_parts("mpu9250"),
        np.random.default_rng(4),
        plant="rate_table",
        name="still",
        command=still,
    )
    fit = relaxed([made])
    assert ripple(fit, shown_noise(fit)) == []


def test_a_table_with_ripple_turns_as_in_the_engine() -> None:
    motion = turn_table(PROFILE, FIELD, [RIPPLE])
    trajectory = first_trajectory(table(RIPPLE))
    assert trajectory.plant.layout.directions == RATE_TABLE.sizes.continuous.sd.size
    values = {("rig.speed_ripple", name): v for name, v in RIPPLE.value._asdict().items()}
    t = np.arange(0.003, 0.95, 0.01)
    rate = shown(trajectory, values, "gyroscope", t)[:, 2]
    # the first segment starts from nothing turned; its steps of 0.3 rad of the ripple leave some 1e-5 of its amplitude
    assert np.max(np.abs(rate - motion.at(t).rate[:, 2])) < 1e-4 * 0.05 + 1e-6


def offsets_found(*errors: Effect) -> dict[str, float]:
    """Return what is proposed for a table: effect to its first value."""
    made = relaxed([table(errors=errors)])
    fitted = continuous_fit(made, Hypothesis(), (), shown_noise(made), {})
    return {p.candidate.id: next(iter(p.start.values())) for p in time_offsets(fitted.fit, fitted.fit.noise)}


@pytest.mark.parametrize("offset", [-0.08, -0.03, 0.05])
@pytest.mark.parametrize("sensor", ["accel", "gyro"])
def test_an_offset_of_time_on_a_table_is_found_on_either_side(sensor: str, offset: float) -> None:
    """A late sensor may lag instead: that is proposed, too, and fits decide."""
    found = offsets_found(effect(f"{sensor}.time_offset", offset_s=offset))
    assert found.pop(f"{sensor}.time_offset") == pytest.approx(offset, abs=0.006)
    late = {f"{sensor}.lag"} if offset > 0.0 else set()
    assert set(found) == late


def test_no_offset_of_time_is_proposed_for_a_sound_table() -> None:
    assert offsets_found() == {}


def test_what_a_fit_tells_of_lost_samples_is_worked_out_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []
    monkeypatch.setattr(dropped_samples, "dropped_magnetometer", lambda fit, known: calls.append(fit) or [])
    monkeypatch.setattr(dropped_samples, "dropped_accelerometer", lambda fit, noise: [])
    lost, one, other = dropped_samples.LostSamples(), relaxed_fit(), replace(relaxed_fit())
    assert calls == []
    for fit in (one, one, other):
        lost = lost.about(fit, (), lambda: {})
        assert lost.fit is fit
    assert calls == [one, other]


def test_a_sensor_that_speaks_only_at_the_end_is_not_late() -> None:
    """With an offset by which none of its readings lies in the motion nothing was left of them, which gained most."""
    whole = table()
    gyroscope = whole.samples["gyroscope"]
    late = gyroscope.t > gyroscope.t[-1] - 0.25
    cut = {**whole.samples, "gyroscope": Samples(gyroscope.t[late], gyroscope.value[late])}
    made = relaxed([replace(whole, samples=cut)])
    fitted = continuous_fit(made, Hypothesis(), (), shown_noise(made), {})
    assert time_offsets(fitted.fit, fitted.fit.noise) == []


def test_a_sensor_that_begins_at_the_end_of_a_look_tells_of_no_losses() -> None:
    fit = relaxed_fit()
    trajectory = fit.trajectories[0]
    readings = next(r for r in trajectory.readings if r.sensor == "accelerometer")
    end = float(trajectory.nodes[-1])
    t = np.linspace(0.95 * end, 1.1 * end, 300)
    some = np.arange(300) % readings.t.size
    begun = replace(readings, t=t, value=readings.value[some], good=readings.good[some])
    assert not loses_samples(trajectory, fit.values(0), begun, 1000.0, np.ones(3))


@pytest.mark.parametrize(("count", "most"), [(1000, 257), (6000, 666), (60000, 66)])
def test_so_many_losses_are_looked_for_as_a_table_of_them_holds(count: int, most: int) -> None:
    """A sensor of ten minutes that stopped after three quarters had asked for a table of 26 GB."""
    fit = relaxed_fit()
    trajectory = fit.trajectories[0]
    readings = next(r for r in trajectory.readings if r.sensor == "accelerometer")
    end, some = float(trajectory.nodes[-1]), np.arange(count) % readings.t.size
    t = np.arange(count) * 0.6 * end / count
    stopped = replace(readings, t=t, value=readings.value[some], good=readings.good[some])
    assert alignment_of(trajectory, fit.values(0), stopped, count / (0.6 * end)).most == most
