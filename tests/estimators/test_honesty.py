"""Standard deviations match the scatter: errors over stated deviations, pooled over throws with faults drawn anew."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from support.spinning_sensor import Faults, Spin, Truth, move, record

from discsim.estimators.fusion import fusion
from discsim.estimators.likelihood import likelihood
from discsim.estimators.rate import YawRate
from discsim.estimators.tracking import TrackingSettings, tracking
from discsim.recording import Recording

PRIORS = TrackingSettings()


def drawn_faults(rng: np.random.Generator) -> Faults:
    """Faults with the standard deviations that the methods are told to expect; a mount and bias as is usual."""
    soft = np.triu(rng.normal(0, PRIORS.soft_iron, (3, 3)))
    scale = float(rng.normal(0, PRIORS.gyroscope_gain))
    return Faults(
        hard_iron=tuple(rng.normal(0, 12, 3)),
        soft_iron=soft + np.triu(soft, 1).T + float(rng.normal(0, PRIORS.strength)) * np.eye(3),
        mount_error=tuple(rng.normal(0, 0.001, 2)),
        accelerometer_bias=tuple(rng.normal(0, 0.3, 2)),
        gyroscope_bias=tuple(rng.normal(0, 0.05, 3)),
        gyroscope_scale=(scale, scale, 0.0),
    )


@pytest.fixture(scope="module")
def throws() -> list[tuple[Recording, Truth]]:
    out = []
    for seed in range(12):
        rng = np.random.default_rng([seed, 31])
        spin = Spin(
            rate=float(rng.uniform(2500, 6500)),
            duration=2.5,
            decay_change=float(rng.uniform(0, 0.6)),
            yaw=float(rng.uniform(0, 360)),
            precession=(float(rng.normal(0, 5)), float(rng.normal(0, 5))),
        )
        out.append(record(spin, rng, drawn_faults(rng), truth=move(spin, step=5e-4)))
    return out


@pytest.mark.parametrize("method", [likelihood, tracking, fusion])
def test_standard_deviations_match_the_scatter(throws, method: Callable[[Recording], YawRate]):
    """Twelve throws hold some hundred independent errors: their rms scatters by 7 %; 25 % is three and a half of it."""
    scaled = []
    for recording, truth in throws:
        found = method(recording)
        scaled.append((found.rate - truth.r(found.t)) / found.sd)
    scaled = np.concatenate(scaled)
    assert np.mean(np.isfinite(scaled)) > 0.95
    assert np.sqrt(np.nanmean(scaled**2)) == pytest.approx(1.0, abs=0.25)
