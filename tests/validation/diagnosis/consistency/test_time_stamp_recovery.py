"""How long rows lasted that a logger wrote as if evenly spaced: counted whatever iron stands beside the field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discsim.effects.catalogue import effect
from discsim.environment import Environment
from discsim.motion import Motion
from discsim.recording import Recording, Samples
from discsim.sensors import Gyroscope, Instruments, Magnetometer, Noise, Sampling, record
from discsim.validation.diagnosis.consistency.time_stamp_recovery import durations, rows_of

SPIN, LOOP, PERIOD = 60.0, 0.01, 0.0088
HIDDEN = (effect("mag.hard_iron", bx_uT=9.0, by_uT=-12.0), effect("clock.lost_rows", fraction=0.27))
FREE = (*HIDDEN, effect("mag.own_clock", period_s=PERIOD), effect("mag.average", weight=0.5))


def spun(*hidden, seed: int = 1) -> Recording:
    """Return a steady spin of 2.5 s as a loop of 100 Hz writes it."""
    t = np.linspace(0.0, 2.5, 5001)
    zero = np.zeros((t.size, 3))
    attitude = np.column_stack([np.cos(0.5 * SPIN * t), 0 * t, 0 * t, np.sin(0.5 * SPIN * t)])
    rate = np.column_stack([0 * t, 0 * t, np.full(t.size, SPIN)])
    site = Environment(magnetic_field=np.array([20.0, 0.0, 45.0]))
    motion = Motion(t, zero, zero, zero, attitude, rate, zero, site)
    loop = Sampling(1.0 / LOOP)
    board = Instruments({"magnetometer": Magnetometer(loop, noise=Noise(0.1)), "gyroscope": Gyroscope(loop)})
    return record(motion, board.with_effects(hidden), np.random.default_rng(seed), plant="free_spin", name="spun")


@pytest.mark.parametrize("seed", range(1, 7))
@pytest.mark.parametrize(("hidden", "tick"), [(HIDDEN, LOOP), (FREE, 0.5 * PERIOD)])
def test_rows_that_were_lost_beside_iron_last_whole_ticks(hidden, tick, seed):
    """A field's noise of 0.1 uT in 20 turns a step by 0.4 degrees, a hundredth of a step."""
    lasted = durations(spun(*hidden, seed=seed), "spun")
    assert lasted is not None
    ticks = lasted.lasted / tick
    # means of the first two rows take part of a sample from before the recording, which is none
    assert np.abs(ticks - np.rint(ticks))[2:].max() < 0.15


def test_a_tick_is_found_where_every_seventh_sample_is_skipped():
    rows = rows_of([spun(*FREE, seed=seed) for seed in (1, 2)], ["a", "b"])
    assert rows is not None
    assert rows.tick_s == pytest.approx(0.5 * PERIOD, rel=5e-3)
    assert rows.gathered > 0.9


def nodding(recording: Recording, rad: float) -> Recording:
    """Return a recording whose field nods, as that of a disc that wobbles, by an angle that dies in the first half."""
    own = recording.samples["magnetometer"]
    nod = 45.0 * rad * np.exp(-own.t / 0.5) * np.exp(0.93j * SPIN * own.t)
    value = own.value + np.column_stack([nod.real, nod.imag, np.zeros(own.t.size)])
    return replace(recording, samples={**recording.samples, "magnetometer": Samples(own.t, value)})


def test_a_tick_is_found_by_the_second_halves_where_a_wobble_blurs_the_first():
    nod = [nodding(spun(*FREE, seed=seed), 0.15) for seed in (1, 2)]
    rows = rows_of(nod, ["a", "b"])
    assert rows is not None
    assert rows.tick_s == pytest.approx(0.5 * PERIOD, rel=5e-3)
