"""Segments of a free spin are halved where the moment of the air bends within them, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from support.made import MODULE, throws

from discsim.disc import Release
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import Lag
from discsim.engine import fly
from discsim.recording import Recording
from discsim.sensors import record
from discsim.shipped import load_disc
from discsim.validation.diagnosis.bent_segments import with_bends_followed
from discsim.validation.diagnosis.relaxed_fit import relaxed
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.identification.gauss_newton import refit
from discsim.validation.identification.plants.free_spin import FREE_SPIN

BLIND = MODULE.without("gps").fitted("gyroscope", range=104.72)

#: the angle of attack goes from -4 to 8 degrees, and a wobble of half a degree over corners of a table at every other
ACROSS = Release(
    np.array([0.0, 0.0, -1.4]), np.array([-7.2, 12.2, -3.2]), -0.02, -0.124, 2.1, np.array([0.8, 0.5, 32.5])
)


def spinning(name: str, seconds: float) -> Recording:
    """Return a free spin of a disc whose moments are a table."""
    disc, field = load_disc(name)
    motion = fly(disc, field, ACROSS, duration=seconds)
    bare = replace(disc, aero=None, aero_table=None, yaw_damping_table=None, sigma={})
    return record(motion, BLIND, np.random.default_rng(3), plant="free_spin", name=name, disc=bare)


def test_a_segment_with_a_corner_is_halved_and_its_fit_is_the_better_for_it():
    recordings = [spinning("dd2", 1.8)]
    followed = relaxed(recordings)
    found = screened(SearchProblem(recordings, followed=followed))
    fit = with_bends_followed(found, followed)
    assert fit is not None
    before, after = followed.trajectories[0].nodes, fit.trajectories[0].nodes
    new = np.setdiff1d(after, before)
    assert 0 < new.size < before.size - 1
    np.testing.assert_allclose(new, [0.5 * (before[k - 1] + before[k]) for k in np.searchsorted(before, new)])
    again = screened(SearchProblem(recordings, followed=fit))
    assert again.base.score < found.base.score - 20.0 * new.size


def test_readings_that_another_lag_has_not_forgotten_gain_no_segment_anything():
    recordings = [spinning("dd2", 1.8)]
    followed = relaxed(recordings)
    found = screened(SearchProblem(recordings, followed=followed))
    usual = with_bends_followed(found, followed)
    slow = catalogued(Lag, "magnetometer").id, "tau_s"
    fit = replace(found.final.fit, fixed={**found.final.fit.fixed, slow: 1e-4})
    fewer = refit(fit, iterations=1).linears[0].t.size
    assert fewer < found.final.fit.linears[0].t.size
    moved = with_bends_followed(replace(found, final=replace(found.final, fit=fit)), followed)
    assert usual is not None
    assert moved is not None
    np.testing.assert_array_equal(moved.trajectories[0].nodes, usual.trajectories[0].nodes)


def test_where_no_moment_bends_no_segment_is_halved():
    recordings = throws(module=BLIND, plant=FREE_SPIN.name)
    followed = relaxed(recordings)
    assert with_bends_followed(screened(SearchProblem(recordings, followed=followed)), followed) is None
