"""The tracked golf throws: what the band is made of, and the page that one command writes."""

from __future__ import annotations

import numpy as np
import pytest
from support.places import REAL

from discsim.frames import body_to_ned
from discsim.shipped import load_disc
from discsim.validation.importing import find_map, read_map
from discsim.validation.studies.golf_throws.page import write_page
from discsim.validation.studies.golf_throws.prediction import INPUTS, THROWS, predict_throw
from discsim.validation.studies.golf_throws.prediction import drawn as drawn_inputs

FOLDER = REAL / "shotshaper-dd2-drone-tracked-throws"
tracked = pytest.mark.skipif(not FOLDER.is_dir(), reason="needs the measured recordings (DISCSIM_RECORDINGS)")

DISC, AIR = load_disc("dd2")
MAP = read_map(find_map("shotshaper"))


def drawn(column: int, sigmas: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the release state and flat parameters with one input moved, less those as stated."""
    z = np.zeros((2, 12))
    z[1, column] = sigmas
    states, flats = drawn_inputs(MAP.throws["throw1"], DISC, AIR, np.zeros(2), np.array([1.0, 0.17, 0.0]), z)
    return states[1] - states[0], flats[1] - flats[0]


class TestDraws:
    def test_one_sigma_of_speed_changes_the_speed_by_that_and_nothing_else(self):
        state, flat = drawn(0)
        assert np.linalg.norm(state[3:6]) == pytest.approx(0.6)
        np.testing.assert_allclose(np.delete(state, [3, 4, 5]), 0.0, atol=1e-12)
        assert not np.any(flat)

    def test_yaw_turns_velocity_and_attitude_together(self):
        """The source's yaw turns the whole throw: the angle between velocity and axis stays."""
        z = np.zeros((2, 12))
        z[1, 2] = 3.0
        states, _ = drawn_inputs(MAP.throws["throw1"], DISC, AIR, np.zeros(2), np.zeros(3), z)
        axes = [body_to_ned(state[6:10])[:, 2] for state in states]
        angles = [axis @ state[3:6] for axis, state in zip(axes, states, strict=True)]
        assert angles[0] == pytest.approx(angles[1], abs=1e-9)
        assert np.linalg.norm(axes[1] - axes[0]) > 0.01

    def test_wind_is_drawn_from_its_own_sigmas(self):
        state, flat = drawn(9, 2.0)
        assert flat[np.nonzero(flat)] == pytest.approx([2.0])
        assert not np.any(state)


@tracked
class TestThrows:
    def test_every_input_is_shown_and_the_stated_flight_is_not_in_the_band(self):
        throw = predict_throw("throw1", FOLDER, 65, np.random.default_rng(0))
        assert set(throw.shifts) == set(INPUTS)
        assert throw.ends.shape == (64, 3)
        assert 1.0 < throw.band[0] < 20.0

    def test_the_first_second_is_inside_what_the_camera_and_the_sigmas_allow(self):
        """0.6 m/s over 1 s and 2 deg at 24 m are 1.0 m (one sigma)."""
        for name in THROWS:
            throw = predict_throw(name, FOLDER, 2, np.random.default_rng(0))
            k = int(np.argmin(np.abs(throw.t - 1.0)))
            assert np.linalg.norm(throw.nominal[k] - throw.track[k]) < 2.0

    def test_the_same_seed_gives_the_same_page(self, tmp_path, monkeypatch):
        monkeypatch.setattr("discsim.validation.studies.golf_throws.page.DRAWS", 33)
        texts = []
        for folder in ("a", "b"):
            write_page(REAL, tmp_path / folder / "golf-throws.md", seed=3)
            texts.append((tmp_path / folder / "golf-throws.md").read_bytes())
            assert (tmp_path / folder / "golf-throws" / "tracks.png").stat().st_size > 1000
        assert texts[0] == texts[1]
