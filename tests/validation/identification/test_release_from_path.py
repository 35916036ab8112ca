"""Throws of which a camera's track is all there is: where they start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER, flight, release_of

from discsim.frames import body_to_ned
from discsim.recording import Recording
from discsim.sensors import Instruments, Noise, Sampling, Tracker, record
from discsim.validation.identification.initial.release_from_path import release_from_path

NOISE = 0.005


def track_of(heading: float = 0.4, spin: float = 70.0, unseen: int | None = None, points: int = 1000) -> Recording:
    """Return a throw of 2 s that cameras saw, all but one coordinate where that is ``unseen``; nothing is stated."""
    motion = flight(heading=heading, spin=spin, seconds=2.0)
    module = Instruments({"track": Tracker(Sampling(120.0), Noise(NOISE))})
    made = record(motion, module, np.random.default_rng(7), plant="flight", name="throw", disc=DRIVER)
    track = made.need("track")
    value = np.array(track.value)
    if unseen is not None:
        value[:, unseen] = np.nan
    value[points:] = np.nan
    return replace(made, release=None, samples={"track": replace(track, value=value)})


@pytest.mark.parametrize(("heading", "spin"), [(0.4, 70.0), (-2.0, 55.0), (1.3, -80.0)])
def test_a_path_tells_velocity_axis_and_spin_at_its_start(heading, spin):
    """The best flight left 33 times the noise of a track: nothing told how the disc stood, and which way it spun."""
    best = release_from_path(track_of(heading, spin), np.zeros(1))[0]
    truth = release_of(heading, spin)
    assert np.linalg.norm(best.velocity[0] - truth.velocity) < 0.1
    assert best.rate[0, 2] == pytest.approx(spin, rel=0.1)
    roll, pitch = truth.roll, truth.pitch
    axis = np.array([np.sin(pitch), -np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    assert body_to_ned(best.attitude)[0, :, 2] @ axis > np.cos(np.radians(2.0))


def test_a_view_from_the_side_tells_no_side_and_both_spins_are_offered():
    """The mirrored throw is seen alike: what it does to the side is not seen."""
    found = release_from_path(track_of(heading=0.0, unseen=1), np.zeros(1))
    assert {np.sign(one.rate[0, 2]) for one in found} == {1.0, -1.0}
    truth = np.asarray(release_of(0.0, 70.0).velocity)
    for one in found:
        assert np.linalg.norm((one.velocity[0] - truth)[[0, 2]]) < 1.0


def test_states_at_later_instants_are_those_of_the_same_flight():
    recording = track_of()
    best = release_from_path(recording, np.array([0.0, 1.5]))[0]
    track = recording.need("track")
    assert np.linalg.norm(best.position[1] - track.value[180]) < 0.05
    assert np.linalg.norm(best.velocity[1]) < np.linalg.norm(best.velocity[0])


def test_nothing_is_told_without_the_discs_air_or_enough_points():
    recording = track_of()
    assert release_from_path(replace(recording, disc=None), np.zeros(1)) == ()
    assert release_from_path(track_of(points=7), np.zeros(1)) == ()
    thin = replace(recording, environment=replace(recording.environment, air_density=None))
    assert release_from_path(thin, np.zeros(1)) == ()
