"""What a lag gains is asked on the readings that take part with it and without it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support.made import DRIVER, MODULE, flight

from discsim.recording import Samples
from discsim.sensors import record
from discsim.validation.diagnosis.candidates.candidate import free_candidate
from discsim.validation.diagnosis.candidates.continuous_fit import continuous_fit
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.relaxed_fit.parameters import unknowns
from discsim.validation.identification.noise import estimate_noise


def test_first_readings_that_a_lag_leaves_out_are_no_gain_of_it():
    """In a free spin of noise alone they made 13 of the 40 by which a lag of 95 us was named."""
    module = MODULE.without("gps").fitted("gyroscope", range=104.72)
    motion = flight(seconds=0.5)
    recording = record(motion, module, np.random.default_rng(4), plant="free_spin", name="noise", disc=DRIVER)
    samples, sd = recording.samples["gyroscope"], recording.sheets["gyroscope"].noise_rms
    value = samples.value.copy()
    value[0, 2] += 12.0 * sd
    recording = replace(recording, samples={**recording.samples, "gyroscope": Samples(samples.t, value)})
    fit, own = relaxed([recording]), unknowns([recording])
    noise = estimate_noise(fit.linears, [linear.residual for linear in fit.linears])
    start = {(q.key, q.recordings): float(v) for q, v in zip(fit.parameters, fit.at, strict=True)}
    lag = free_candidate("gyro.lag")
    base, lagging = (continuous_fit(fit, Hypothesis(some), own, noise, start) for some in ((), (lag,)))
    assert base.score - lagging.score > 20.0
    assert lagging.gain_upon(base) < 10.0
    assert lagging.gain_upon(base) == -base.gain_upon(lagging)
