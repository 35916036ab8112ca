"""Which sensors agree: clocks, sensitivities, late rows and slow sensors are told apart, on recordings set aside."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from support.made import MODULE, throws
from support.places import REAL

from discsim.effects import Effect, effect
from discsim.environment import Environment
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.diagnosis import diagnose
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement, agreement_of, compared, written_ratios
from discsim.validation.diagnosis.datasets import recording_names
from discsim.validation.diagnosis.report.consistency_tables import tables_of
from discsim.validation.importing import find_map, import_recording, read_map

#: a gyroscope that shows the spin, which an MPU-9250 does not
BOARD = MODULE.without("gps").fitted("gyroscope", range=100.0)
FLATBALL = REAL / "flatball-ins-ultimate-disc"
FLIGHTS = {"001-rb": (1590, 1830), "003-rf": (860, 1125), "004-rf": (680, 908), "005-rh": (735, 988)}


@cache
def spins(*errors: Effect) -> list[Recording]:
    return throws(errors=errors, module=BOARD, plant="free_spin", seconds=1.5)


def told(recordings: list[Recording]) -> Agreement:
    found = agreement_of(recordings, [recording.name for recording in recordings])
    assert found is not None
    return found


def test_sensors_that_agree_are_not_said_to_contradict():
    found = told(spins())
    assert not found.contradiction
    assert found.causes == ()
    assert found.sentences == ()
    # the tolerances are those of the comparisons: 1 % for a field, whose phase precession bends
    assert all(abs(item.ratio - 1.0) < 0.01 for item in found.comparisons)
    assert written_ratios(compared(spins(), ["a", "b"])) == [1.0, 1.0]


@pytest.mark.parametrize("ratio", [0.82, 1.15])
def test_a_wrong_time_leaves_the_pull_to_the_axis_alone_and_bends_what_turns(ratio):
    found = told(spins(effect("clock.rate", ratio=ratio)))
    assert found.contradiction
    agrees = {item.signal: item.agrees for item in found.comparisons}
    assert agrees["pull to the axis"]
    assert not agrees["field"]
    # the magnetometer's own clock would do the same where no wobble can be heard
    assert {cause.id for cause in found.causes[:2]} == {"clock.rate", "mag.clock_rate"}
    assert found.causes[0].value == pytest.approx(ratio, rel=0.01)
    for proof in found.causes[0].heldout:
        assert proof.value_of_others == pytest.approx(ratio, rel=0.01)
        assert proof.chi2_after < 0.01 * proof.chi2_before
        assert proof.field_left_uT_after is not None
        assert proof.field_left_uT_before is not None
        assert proof.field_left_uT_after < 0.2 * proof.field_left_uT_before
    assert found.rows is None


def test_a_gyroscope_of_wrong_sensitivity_contradicts_the_accelerometer_too():
    found = told(spins(effect("gyro.scale", sz=-0.16)))
    assert found.causes[0].id == "gyro.scale"
    # 1 % of the field, 3 % of a mount: what sound recordings show
    assert found.causes[0].value == pytest.approx(-0.16, abs=0.02)
    assert written_ratios(compared(spins(effect("gyro.scale", sz=-0.16)), ["a", "b"])) == [1.0, 1.0]


def late(recording: Recording, seed: int) -> Recording:
    """Return a recording of which a quarter of the rows was lost, the rest written as if they were all."""
    rng = np.random.default_rng(seed)
    rows = recording.samples["magnetometer"].t
    kept = np.sort(rng.choice(rows.size, int(0.75 * rows.size), replace=False))
    samples = {}
    for name, own in recording.samples.items():
        value = np.column_stack([np.interp(rows[kept], own.t, column) for column in own.value.T])
        samples[name] = Samples(rows[: kept.size], value)
    return replace(recording, samples=samples)


def test_lost_rows_are_counted_in_ticks_and_the_others_tick_puts_them_right():
    recordings = [late(recording, k) for k, recording in enumerate(spins())]
    found = told(recordings)
    assert found.rows is not None
    # 100 rows a second
    assert found.rows.tick_s == pytest.approx(0.01, rel=0.01)
    for proof in found.row_proofs:
        written, _, counted, _ = proof.left
        assert counted < 0.2 * written
    missing = [found.rows.unwritten(recording.name) for recording in recordings]
    assert missing == pytest.approx([0.25, 0.25], abs=0.02)


def test_an_accelerometer_that_still_holds_the_throw_is_found_by_the_others_time_constant():
    recordings = []
    for k, recording in enumerate(spins()):
        own = recording.samples["accelerometer"]
        hand = np.exp(-own.t / 0.14)[:, None] * np.array([80.0, -30.0 * (k + 1), 0.0])
        slow = Samples(own.t, own.value + hand)
        recordings.append(replace(recording, samples={**recording.samples, "accelerometer": slow}))
    found = told(recordings)
    assert found.settling is not None
    # what turns with the spin blurs it by a few per cent
    assert found.settling.tau_s == pytest.approx(0.14, rel=0.1)
    assert all(proof.left_m_s2_after < 0.5 * proof.left_m_s2_before for proof in found.settling.heldout)
    assert told(spins()).settling is None


def test_a_quick_low_pass_is_found_beside_the_air_that_it_does_not_hide():
    """Behind 50 ms a third of what turns with the spin is left, as much as the hand leaves in all readings."""
    recordings = []
    for k, recording in enumerate(spins()):
        own, turned = recording.samples["accelerometer"], recording.samples["gyroscope"]
        psi = np.interp(own.t, turned.t, np.cumsum(turned.value[:, 2]) * float(np.median(np.diff(turned.t))))
        hand = np.exp(-own.t / 0.05)[:, None] * np.array([20.0, -8.0 * (k + 1), 0.0])
        air = 4.0 * np.stack([np.cos(psi), -np.sin(psi), np.zeros_like(psi)], axis=1)
        quick = Samples(own.t, own.value + hand + air)
        recordings.append(replace(recording, samples={**recording.samples, "accelerometer": quick}))
    found = told(recordings)
    assert found.settling is not None
    assert found.settling.tau_s == pytest.approx(0.05, rel=0.1)


def test_what_is_told_is_plain_json_and_stands_in_tables():
    found = told([late(recording, k) for k, recording in enumerate(spins(effect("clock.rate", ratio=0.9)))])
    assert json.loads(json.dumps(found.to_json(), allow_nan=False))["contradiction"] is True
    for _, header, rows in tables_of(found):
        assert rows
        assert all(len(row) == len(header) for row in rows)


def test_recordings_without_a_sensor_of_the_rate_cannot_be_compared():
    assert agreement_of(throws(module=MODULE, plant="free_spin", seconds=1.0), ["a", "b"]) is None


@pytest.mark.slow
def test_a_time_base_that_is_a_fifth_wrong_is_found_as_the_clock():
    answer = diagnose([spins(effect("clock.rate", ratio=0.82))], ["made"]).diagnosis
    assert answer.verdict == "explained"
    assert [item.id for item in answer.effects] == ["clock.rate"]
    found = answer.effects[0].parameters["ratio"]
    assert found.sd is not None
    assert abs(found.value - 0.82) < 3.0 * found.sd
    assert answer.agreement is not None
    assert answer.agreement.contradiction


@pytest.mark.slow
@pytest.mark.skipif(not FLATBALL.is_dir(), reason="the recordings are not there")
def test_the_throws_of_an_ultimate_disc_agree_once_their_rows_are_counted():
    recordings = []
    for name, (first, last) in FLIGHTS.items():
        raw = next(FLATBALL.glob(f"*{name}.csv"))
        recordings.append(import_recording(raw, read_map(find_map("flatball")), slice(first, last)).recording)
    found = agreement_of(recordings, list(FLIGHTS))
    assert found is not None
    signals = {(item.recording, item.signal): item for item in found.comparisons}
    for name in FLIGHTS:
        assert signals[name, "pull to the axis"].agrees
        assert not signals[name, "field"].agrees
    assert found.causes[0].id == "clock.rate"
    assert found.rows is not None
    # four throws, one tick: its own in each within 0.3 %
    assert all(own == pytest.approx(found.rows.tick_s, rel=3e-3) for own, _ in found.rows.own.values())
    for proof in found.row_proofs:
        written, even, counted, _ = proof.left
        # a magnetometer that free-runs beside the loop leaves more than noise: its own clock is found next
        assert counted < 0.6 * even < 0.3 * written
        assert proof.wobble is not None
        assert proof.wobble > 0.5
    assert found.settling is not None
    for settled in found.settling.heldout:
        assert settled.left_m_s2_after < 0.1 * settled.left_m_s2_before
    # a part with a clock of its own, of which each row shows the mean of two samples: what is left is near its noise
    assert found.own_clock is not None
    assert found.own_clock.period_s == pytest.approx(0.00943, rel=2e-3)
    for shown in found.own_clock.shown:
        counted, here = shown.left
        assert here < min(0.25, 0.3 * counted)
        # the maker takes every row as 10 ms: that is the loop, a fifth of whose steps write no row
        assert shown.loop_s == pytest.approx(0.01, rel=0.01)


def slow_field(rate_hz: float, *, noise_only: bool, lost: float = 0.0) -> list[Recording]:
    """Return spins of 25 and 26 rad/s before a magnetometer of few readings a second; the gyroscope goes with it."""

    def one(k: int) -> Recording:
        rng = np.random.default_rng(k)
        true = np.arange(round(6 * rate_hz)) / rate_hz
        true = true[rng.random(true.size) > lost]
        t, turned = np.arange(true.size) / rate_hz, (25.0 + k) * true
        field = np.column_stack([20 * np.cos(turned), -20 * np.sin(turned), np.full(t.size, 40.0)])
        field = (0.0 if noise_only else 1.0) * field + rng.normal(0.0, 0.3, field.shape)
        spin = np.column_stack([np.zeros((t.size, 2)), np.full(t.size, 25.0 + k)]) + rng.normal(0.0, 0.01, (t.size, 3))
        sheets = {"magnetometer": SensorSheet(rate_hz, 0.3), "gyroscope": SensorSheet(rate_hz, 0.01)}
        samples = {"magnetometer": Samples(t, field), "gyroscope": Samples(t, spin)}
        return Recording(plant="spin_down", name=f"spin-{k}", environment=Environment(), sheets=sheets, samples=samples)

    return [one(k) for k in range(2)]


@pytest.mark.parametrize("rate_hz", [20.0, 25.0, 29.0, 31.0])
def test_the_noise_of_a_slow_magnetometer_contradicts_nothing(rate_hz):
    """Its segments had too few readings: with none looked at, all of it was said to turn, 1.4 times as fast."""
    assert not [item for one in compared(slow_field(rate_hz, noise_only=True), ["a", "b"]) for item in one]


@pytest.mark.parametrize("rate_hz", [20.0, 29.0])
def test_rows_that_a_slow_logger_lost_are_told_in_numbers(rate_hz):
    recordings = slow_field(rate_hz, noise_only=False, lost=0.15)
    found = told(recordings)
    assert found.rows is not None
    assert found.rows.tick_s == pytest.approx(1.0 / rate_hz, rel=0.02)
    for proof in found.row_proofs:
        written, _, counted, _ = proof.left
        assert counted < 0.1 * written
    assert json.loads(json.dumps(found.to_json()))["rows"]["heldout"]


def test_recordings_of_one_name_are_told_apart():
    """Recordings of arrays are all called so: what was counted of one had been taken for the other's."""
    alike = [replace(one, name="arrays") for one in slow_field(29.0, noise_only=False)]
    assert recording_names([alike], ["set"]) == [["arrays", "arrays-2"]]
    other = [*alike, replace(alike[0], name="arrays-2")]
    assert len(set(recording_names([other], ["set"])[0])) == 3
