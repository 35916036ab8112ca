"""Rows whose spacing nobody wrote down: their rate is a stated number with an uncertainty, which a fit may move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from support.made import MODULE, throws

from discsim.recording import Recording
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, standard_errors
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.pipeline import diagnose
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.stated_parameters import stated_parameters

BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)


def guessed(recording: Recording, ratio: float, off: float) -> Recording:
    """Return a recording as if its rows had been taken as ``ratio`` times as far apart, known to ``off``."""
    rates = {sensor: sheet.rate_hz / ratio for sensor, sheet in recording.sheets.items()}
    sheets = {
        sensor: replace(sheet, rate_hz=rates[sensor], sigma={**sheet.sigma, "rate_hz": off * rates[sensor]})
        for sensor, sheet in recording.sheets.items()
    }
    samples = {sensor: replace(own, t=own.t * ratio) for sensor, own in recording.samples.items()}
    return replace(recording, sheets=sheets, samples=samples)


def spins(ratio: float, off: float, without: str | None = None) -> list[Recording]:
    """Return free spins whose rows are guessed."""
    module = BLIND if without is None else BLIND.without(without)
    return [guessed(one, ratio, off) for one in throws(module=module, plant="free_spin")]


def clocks(recordings: list[Recording]) -> Mapping[tuple[str, str], Parameter]:
    return {q.key: q for q in stated_parameters(recordings) if q.name == "ratio"}


def test_rows_known_to_some_per_cent_are_a_clock_of_all_sensors():
    (clock,) = clocks(spins(1.0, 0.2)).values()
    assert (clock.group, clock.stated, clock.sigma) == ("clock.rate", 1.0, pytest.approx(0.2))


def test_a_sensor_whose_rate_alone_is_uncertain_has_a_clock_of_its_own():
    recordings = [
        replace(one, sheets={**one.sheets, "magnetometer": replace(one.sheets["magnetometer"], sigma={"rate_hz": 1.0})})
        for one in throws(module=BLIND, plant="free_spin")
    ]
    (clock,) = clocks(recordings).values()
    assert clock.group == "mag.clock_rate"
    assert clock.sigma == pytest.approx(1.0 / recordings[0].sheets["magnetometer"].rate_hz)


def test_rates_without_an_uncertainty_are_exact():
    assert not clocks(throws(module=BLIND, plant="free_spin"))


@pytest.mark.slow
def test_a_gyroscope_beside_a_field_tells_the_spacing_of_rows():
    """Rows taken as 0.93 of their true spacing, known to 20 %: no effect is named, and the rate is put right."""
    recordings = spins(0.93, 0.2)
    found = diagnose([recordings], ["throws"]).diagnosis
    assert found.verdict == "consistent"
    told = found.recalibrated["gyroscope.rate_hz"]
    assert told.stated == pytest.approx(200.0 / 0.93)
    assert told.stated_sd == pytest.approx(0.2 * told.stated)
    assert told.value == pytest.approx(200.0, abs=max(3.0 * told.sd, 0.05))
    assert told.sd < 0.5


def of_time(recordings: list[Recording]) -> np.ndarray:
    """Return the errors of a clock and of a place that goes with it, of a fit in which both have 0.001."""
    trajectories = (first_trajectory(recordings[0]),)
    place = Parameter("accel.position_offset", "dx_m", 0.0, 1e-6)
    parameters = (Parameter("clock.rate", "ratio", 1.0, 1e-6, 0.2), place)
    covariance = 1e-6 * np.array([[1.0, 0.9], [0.9, 1.0]])
    fit = Fit(trajectories, parameters, np.zeros(2), trajectories[0].plant.sizes.continuous, {}, covariance=covariance)
    return standard_errors(ContinuousFit(Hypothesis(), fit, 0.0))


def test_without_a_gyroscope_a_free_spin_tells_no_time_and_lengths_go_with_it():
    """The air's moments, which nobody knows, are all that has a size in time there."""
    assert of_time(spins(1.0, 0.2)).tolist() == pytest.approx([0.001, 0.001])
    blind = of_time(spins(1.0, 0.2, without="gyroscope"))
    assert blind[0] == pytest.approx(0.2)
    assert blind[1] == pytest.approx(0.9 * 0.2, rel=1e-3)
    exact = throws(module=BLIND.without("gyroscope"), plant="free_spin")
    assert of_time(exact).tolist() == pytest.approx([0.001, 0.001])
