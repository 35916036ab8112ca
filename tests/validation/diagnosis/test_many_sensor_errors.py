"""Errors of several sensors beside a motion's effect: each is named, and what is left of none inflates the noise."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from discsim.effects import effect
from discsim.environment import Environment
from discsim.recording import Recording
from discsim.rig import default_profile, turn_table
from discsim.sensors import Instruments, record
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.search_state import chi2_in
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.selection.uninflated_noise import capped, spoilt_groups, uninflated_noise
from discsim.validation.identification.noise import GroupNoise

RIPPLE = effect("rig.speed_ripple", order=6.0, amplitude_rad_s=1.2, phase_rad=0.7)
FAULTS = (
    effect("gyro.scale", sz=0.01),
    effect("accel.scale", sx=0.01, sy=-0.01, sz=0.005),
    effect("gyro.bias", bx_rad_s=0.05, by_rad_s=0.02),
    effect("mag.hard_iron", bx_uT=5.0, by_uT=-4.0),
)


@cache
def run() -> Recording:
    """Return a run of a rippling table by a module of four errors."""
    profile = default_profile((1000, 3000, 5000), hold=2.0)
    motion = turn_table(profile, Environment(), (RIPPLE,), yaw=0.3)
    module = Instruments.from_parts("mpu9250", "ac1120s").with_effects(FAULTS)
    return record(motion, module, np.random.default_rng(3), plant="rate_table", name="run", command=profile)


@pytest.mark.slow
def test_a_strong_ripple_and_four_errors_of_sensors_are_named_together():
    """The bias is nothing but a noise that is slow enough: noise estimated without it has swallowed it."""
    found = diagnose([[run()]], ["bench"]).diagnosis
    assert found.verdict == "explained"
    named = {one.id: one.parameters for one in found.effects}
    assert named.keys() == {RIPPLE.id, *(fault.id for fault in FAULTS)}
    assert named[RIPPLE.id]["amplitude_rad_s"].value == pytest.approx(1.2, rel=1e-4)
    assert named["gyro.bias"]["bx_rad_s"].value == pytest.approx(0.05, abs=1e-3)
    assert found.final.chi2_per_sample == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_a_scale_that_clipping_and_slow_noise_hide_is_found():
    """A plateau at the gyroscope's very range: its noise swallows the scale, until that is asked in stated noise."""
    faults = (
        effect("gyro.scale", sz=0.017),
        effect("gyro.bias", bx_rad_s=0.004, by_rad_s=-0.075, bz_rad_s=-0.056),
        effect("accel.scale", sx=-0.001, sy=0.003, sz=-0.06),
    )
    ripple = effect("rig.speed_ripple", order=2.0, amplitude_rad_s=0.3, phase_rad=0.6)
    profile = default_profile((0, 1000, 2000, 3000, 4000), hold=2.0)
    motion = turn_table(profile, Environment(), (ripple,), yaw=0.3)
    module = Instruments.from_parts("mpu9250", "ac1120s").with_effects(faults)
    clipped = record(motion, module, np.random.default_rng(3), plant="rate_table", name="run", command=profile)
    found = diagnose([[clipped]], ["bench"]).diagnosis
    assert found.verdict == "explained"
    named = {one.id: one.parameters for one in found.effects}
    assert named.keys() == {ripple.id, *(fault.id for fault in faults)}
    assert named["gyro.scale"]["sz"].value == pytest.approx(0.017, abs=5e-4)


@pytest.mark.slow
def test_two_plateaus_tell_three_errors_of_a_module_of_which_two_lead_near_but_not_to_the_data():
    faults = (
        effect("gyro.scale", sz=-0.0296),
        effect("gyro.bias", bx_rad_s=-0.0485, by_rad_s=0.065, bz_rad_s=0.045),
        effect("accel.position_offset", dx_m=0.0012),
    )
    profile = default_profile((1000, 3000), hold=3.0)
    motion = turn_table(profile, Environment(), yaw=0.3)
    module = Instruments.from_parts("mpu9250", "ac1120s").with_effects(faults)
    short = record(motion, module, np.random.default_rng(3), plant="rate_table", name="run", command=profile)
    found = diagnose([[short]], ["bench"]).diagnosis
    assert found.verdict == "explained"
    named = {one.id: one for one in found.effects}
    # a place nearer the axis and a smaller scale are one to an accelerometer that only ever feels the spin
    (third,) = named.keys() - {"gyro.scale", "gyro.bias"}
    assert third in {"accel.position_offset", "accel.scale"}
    if third == "accel.scale":
        assert "accel.position_offset" in {rival.id for rival in named[third].confused_with}
    assert named["gyro.scale"].parameters["sz"].value == pytest.approx(-0.0296, abs=5e-4)
    assert found.final.chi2_per_sample == pytest.approx(1.0, abs=0.1)


def test_a_mismatch_is_told_in_noise_that_it_has_not_inflated():
    """The relaxed fit does not follow a strong ripple: what it leaves of the rate reference is no noise of it."""
    found = screened(SearchProblem([run()]))
    assert {"rate_reference", "accelerometer"} <= spoilt_groups(found)
    noise = uninflated_noise(found)
    stated = {c.group: float(linear.sd[c.rows][0]) for linear in found.relaxed_fit.linears for c in linear.channels}
    for group, level in noise.items():
        assert level.sd == pytest.approx(stated[group], rel=0.1), group
    count = found.base.fit.count
    assert chi2_in(found.base, noise) > 1e4 * count
    assert chi2_in(found.base, found.relaxed_noise) < 10.0 * count


def test_noise_is_capped_where_a_level_is_known():
    noise = {"gyroscope": GroupNoise(2.0, correlation=0.5), "magnetometer": GroupNoise(0.3), "track": GroupNoise(9.0)}
    most = {"gyroscope": GroupNoise(0.5), "magnetometer": GroupNoise(0.6)}
    found = capped(noise, most)
    assert {group: level.sd for group, level in found.items()} == {"gyroscope": 0.5, "magnetometer": 0.3, "track": 9.0}
