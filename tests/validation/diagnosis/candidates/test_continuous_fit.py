"""The fit of a hypothesis whose segments are continuous: it ends where it is best, not on its way."""

from __future__ import annotations

import numpy as np

from discsim.effects.catalogue import catalogued, effect
from discsim.effects.sensors import ClockRate
from discsim.recording import Samples
from discsim.rig import turn_table
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc
from discsim.validation.diagnosis.candidates.candidate import candidates_for
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.identification.noise import estimate_noise, stated_noise


def test_a_fit_that_is_still_on_its_way_when_its_steps_are_used_up_goes_on() -> None:
    """A clock that is 2e-4 off leaves the corners of a command 2 ms away, which noise with a memory would take up."""
    _, field = load_disc("driver")
    clock = catalogued(ClockRate, "accelerometer").id
    module = Instruments.from_parts("mpu9250").fitted("accelerometer", position=np.array([-0.0161, 0.0, 0.0]))
    module = module.with_effects([effect(clock, ratio=0.996)])
    command = Samples(np.array([0.0, 3.0, 4.0, 7.0, 8.0, 12.0]), np.array([20.0, 20.0, 60.0, 60.0, 25.0, 25.0]))
    made = [
        record(
            turn_table(command, field, yaw=0.3 + number),
            module,
            np.random.default_rng(number),
            plant="rate_table",
            name=f"table-{number}",
            command=command,
        )
        for number in range(2)
    ]
    fit = relaxed(made)
    noise = estimate_noise(fit.linears, [linear.residual for linear in fit.linears])
    (candidate,) = (one for one in candidates_for(made) if one.id == clock)
    fitted = continuous_fit(fit, Hypothesis((candidate,)), (), noise, {}, iterations=1)
    left, stated = fitted.fit.noise["accelerometer"], stated_noise(fitted.fit.linears)["accelerometer"]
    assert left.correlation == 0.0
    assert left.sd < 1.05 * stated.sd
