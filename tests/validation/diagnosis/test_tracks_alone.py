"""Throws that cameras alone saw, of which nothing is stated: explained, or what was left out is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import FIELD, release_of

from discsim.disc import Release
from discsim.effects import effect
from discsim.engine import fly
from discsim.errors import InputError
from discsim.recording import Recording
from discsim.sensors import Instruments, Noise, Sampling, Tracker, record
from discsim.shipped import load_disc
from discsim.validation.diagnosis.diagnosed import diagnose_recordings

DISC = load_disc("ultrastar")[0]
#: what a proposed map states of such throws: they wobble by some rad/s, and spin to either side
OPEN = Release(body_rate=np.zeros(3), sigma={"body_rate_rad_s": np.array([5.0, 5.0, 100.0])})


def tracks(hidden: tuple = (), unseen: int | None = None) -> list[Recording]:
    """Return three throws over all directions that cameras saw, all but one coordinate where that is ``unseen``."""
    made = []
    for k, (heading, spin, up) in enumerate(((0.1, 60.0, 3.5), (1.6, 65.0, 2.5), (3.0, 55.0, 4.0))):
        motion = fly(DISC, FIELD, release_of(heading, spin, up), hidden, duration=2.0)
        module = Instruments({"track": Tracker(Sampling(120.0), Noise(0.005))})
        one = record(motion, module, np.random.default_rng(k), plant="flight", name=f"throw-{k}", disc=DISC)
        track = one.need("track")
        value = np.array(track.value)
        if unseen is not None:
            value[:, unseen] = np.nan
        made.append(replace(one, release=OPEN, samples={"track": replace(track, value=value)}))
    return made


@pytest.mark.parametrize("unseen", [None, 2])
def test_nothing_is_missing_where_nothing_is_concealed(unseen):
    """Without a release such throws were said to follow no motion of a flight."""
    found = diagnose_recordings(tracks(unseen=unseen))
    assert found.diagnosis.verdict == "consistent"


@pytest.mark.parametrize(
    ("id", "sizes"),
    [("air.wind", {"w_north_m_s": -1.5, "w_east_m_s": 2.0}), ("air.density", {"ratio": 1.15})],
)
def test_what_was_left_out_is_named_with_its_size(id, sizes):
    (named,) = diagnose_recordings(tracks((effect(id, **sizes),))).diagnosis.effects
    assert named.id == id
    for name, number in sizes.items():
        found = named.parameters[name]
        assert found.value == pytest.approx(number, abs=4.0 * found.sd)
        assert found.sd < 0.05 * abs(number)


def test_a_free_spin_that_no_sensor_on_board_saw_is_refused_by_what_it_lacks():
    """It was consistent: nothing of it was compared."""
    seen = [replace(one, plant="free_spin", release=None) for one in tracks()]
    with pytest.raises(InputError, match='a path alone is told as plant = "flight"'):
        diagnose_recordings(seen)
