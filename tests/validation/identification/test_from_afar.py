"""A throw of which only its path and its release are known: a fit that starts metres away comes to where it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, flight, release_of

from discsim.effects import effect
from discsim.recording import Recording
from discsim.sensors import Instruments, Noise, Sampling, Tracker, record
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.identification.from_afar import fitted_from_afar
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.plants import plant_of

#: what nobody models here
WIND = effect("air.wind", w_north_m_s=2.0, w_east_m_s=3.0)
NOISE = 0.02
SPREAD = {"position_ned_m": 0.5, "velocity_ned_m_s": 2.0, "roll_rad": 0.1, "pitch_rad": 0.1, "body_rate_rad_s": 3.0}


def path_of(hidden: tuple = (), off: float = 2.0) -> Recording:
    """Return a throw that a tracker has seen in plan, its stated release ``off`` m/s wrong along each axis."""
    motion = flight(hidden, seconds=3.0)
    module = Instruments({"track": Tracker(Sampling(30.0), Noise(NOISE))})
    made = record(motion, module, np.random.default_rng(5), plant="flight", name="throw", disc=DRIVER)
    track = made.need("track")
    plan = np.column_stack((track.value[:, :2], np.full(len(track), np.nan)))
    stated = release_of(0.4, 70.0)
    release = replace(stated, velocity=np.asarray(stated.velocity) + off, yaw=None, sigma=SPREAD)
    return replace(made, release=release, samples={"track": replace(track, value=plan)})


def fit_of(recording: Recording) -> Fit:
    """Return a fit of nothing but the throw's own motion, in the noise of its readings."""
    plant = plant_of(recording)
    return Fit((first_trajectory(recording),), (), np.empty(0), plant.sizes.continuous, {"track": GroupNoise(NOISE)})


def test_a_release_that_is_metres_a_second_off_is_found_from_the_path():
    found = fitted_from_afar(fit_of(path_of()))
    assert found.noise["track"].sd == pytest.approx(NOISE, rel=0.15)
    truth = np.asarray(release_of(0.4, 70.0).velocity)
    assert np.max(np.abs(found.trajectories[0].states[0, 3:5] - truth[:2])) < 0.1


def test_what_the_path_has_beyond_its_noise_stays_noise():
    found = fitted_from_afar(fit_of(path_of((WIND,), off=0.0)))
    left = float(np.sqrt(np.mean(found.linears[0].residual ** 2)))
    assert left > 2.0 * NOISE
    assert found.noise["track"].sd == pytest.approx(left, rel=0.1)
    # stated numbers keep their say: none is sent to where no one throws
    assert abs(float(np.linalg.norm(found.trajectories[0].states[0, 3:6])) - 20.0) < 6.0


def test_such_a_throw_is_one_segment_whose_turn_about_its_axis_is_held():
    recording = path_of()
    plant = plant_of(recording)
    first = first_trajectory(recording)
    assert plant.path_alone(recording)
    assert len(first.states) == 1
    assert first.trust_radius is plant.sizes.of_path
    with_gyroscope = record(
        flight(seconds=3.0),
        Instruments.from_parts("mpu9250"),
        np.random.default_rng(1),
        plant="flight",
        name="logged",
        disc=DRIVER,
    )
    assert not plant.path_alone(replace(with_gyroscope, release=recording.release))
    assert not plant.path_alone(replace(recording, release=replace(recording.release, roll=None)))
    # of which no velocity is stated, the path tells how it begins (`release_from_path`)
    assert plant.path_alone(replace(recording, release=replace(recording.release, velocity=None)))
