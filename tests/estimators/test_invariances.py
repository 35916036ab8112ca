"""What no estimate may depend on: where north lies, how the board sits, which hand one writes with, units, the clock.

A recording is changed in such a way, estimated anew, and compared in standard deviations. Searches end where the next
step gains little, so a fiftieth of one is equal.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.spinning_sensor import Faults, Spin, move, record

from discsim.estimators import estimate
from discsim.recording import Recording, Samples

#: of the field and its turning, of all sensors, and of those that the field does not reach
BY_FIELD = ("fusion", "tracking", "likelihood", "fft")
METHODS = (*BY_FIELD, "accelerometer_calibrated", "gyroscope", "accelerometer")
#: a spectrum and a centripetal force alone know no sense of turning
UNSIGNED = ("fft", "accelerometer")
SPIN = Spin(rate=1500.0, duration=3.0)
MIRROR = {"magnetometer": (-1, 1, -1), "gyroscope": (-1, 1, -1), "accelerometer": (1, -1, 1)}
few = settings(max_examples=4)


@cache
def thrown():
    faults = Faults(hard_iron=(8.0, 3.0, -9.0), mount_error=(0.0008, -0.0004), gyroscope_bias=(0.01, -0.02, 0.0))
    return record(SPIN, np.random.default_rng(1), faults, truth=move(SPIN))[0]


@cache
def known(method):
    """The rates of a method for the recording as it is."""
    return estimate(thrown(), method)


def about_z(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def changed(recording, maps, field=1.0, place=lambda t: t):
    """The recording with readings through a matrix for each sensor, another field, other times; sheets follow."""
    samples, sheets = {}, {}
    for name, found in recording.samples.items():
        by, sheet = np.asarray(maps[name], dtype=float), recording.sheets[name]
        size = float(abs(np.linalg.det(by))) ** (1 / 3)
        samples[name] = Samples(place(found.t), found.value @ by.T)
        limits = {key: getattr(sheet, key) * size for key in ("noise_rms", "resolution", "range")}
        sheets[name] = replace(sheet, **limits, position=None if sheet.position is None else by / size @ sheet.position)
    magnetic = np.dot(field, recording.environment.magnetic_field)
    around = replace(recording.environment, magnetic_field=magnetic)
    return Recording(recording.plant, recording.name, around, sheets=sheets, samples=samples)


def alike(found, sound, within=0.02, factor=1.0):
    """The same times have an answer, as far off as ``within`` standard deviations, which are the same to 1 in 100."""
    np.testing.assert_array_equal(np.isnan(found.rate), np.isnan(sound.rate))
    assert np.count_nonzero(np.isfinite(sound.rate)) > 4
    off = np.abs(found.rate - factor * sound.rate) / (abs(factor) * sound.sd)
    assert np.nanmax(off) < within
    np.testing.assert_allclose(found.sd, abs(factor) * sound.sd, rtol=max(0.01, within))


SAME = {name: np.eye(3) for name in MIRROR}


@pytest.mark.parametrize("method", METHODS)
@given(angle=st.floats(-np.pi, np.pi))
@few
def test_where_north_lies_does_not_matter(method, angle):
    """Exactly: no estimator reads a heading."""
    alike(estimate(changed(thrown(), SAME, about_z(angle)), method), known(method), within=1e-9)


@pytest.mark.parametrize("method", sorted({*METHODS} - {"fft"}))
@given(angle=st.floats(-np.pi, np.pi))
@few
def test_how_the_board_is_turned_about_the_axis_of_spin_does_not_matter(method, angle):
    """The spectrum is that of one axis of the two. A stated place is uncertain by as much along x as along y, and a
    quarter more across the corner of the square, which moves a calibrated accelerometer by 0.05 deviations."""
    board = dict.fromkeys(MIRROR, about_z(angle))
    within = 0.1 if method.startswith("accelerometer") else 0.02
    alike(estimate(changed(thrown(), board), method), known(method), within)


@pytest.mark.parametrize("method", METHODS)
def test_the_mirrored_throw_spins_the_other_way(method):
    """In a mirror fields and rates turn as axial vectors, forces as polar ones."""
    found = estimate(changed(thrown(), {name: np.diag(signs) for name, signs in MIRROR.items()}), method)
    alike(found, known(method), factor=1.0 if method in UNSIGNED else -1.0)


@pytest.mark.parametrize("method", METHODS)
@given(factor=st.floats(0.7, 2.0))
@few
def test_the_unit_of_the_field_does_not_matter(method, factor):
    scaled = {**SAME, "magnetometer": factor * np.eye(3)}
    alike(estimate(changed(thrown(), scaled, factor), method), known(method))


@pytest.mark.parametrize("method", METHODS)
@given(halves=st.integers(-200, 200_000))
@few
def test_when_the_clock_began_does_not_matter(method, halves):
    """By half seconds: some methods answer at whole twentieths of a second, which then are the same instants."""
    later = halves / 2
    found = estimate(changed(thrown(), SAME, place=lambda t: t + later), method)
    np.testing.assert_allclose(found.t - later, known(method).t, atol=1e-9)
    alike(found, known(method))


@pytest.mark.parametrize("method", ["fft", "gyroscope", "tracking", "fusion"])
@given(longer=st.floats(0.9, 1.1))
@few
def test_a_clock_that_runs_slower_shows_a_spin_as_much_faster(method, longer):
    """A spin's roughness is stated in seconds, which moves what is smoothed by half a deviation at most."""
    slower = {**SAME, "gyroscope": np.eye(3) / longer, "accelerometer": np.eye(3) / longer**2}
    found, sound = estimate(changed(thrown(), slower, place=lambda t: t * longer), method), known(method)
    off = (np.interp(sound.t, found.t / longer, found.rate * longer) - sound.rate) / sound.sd
    within = (sound.t >= found.t[0] / longer) & (sound.t <= found.t[-1] / longer)
    assert np.count_nonzero(within & np.isfinite(off)) > 30
    assert np.nanmax(np.abs(off[within])) < (1e-6 if method in ("fft", "gyroscope") else 0.5)
