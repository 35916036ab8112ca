"""A release in the words of who throws, and back."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from discsim.disc import Release
from discsim.errors import InputError
from discsim.frames import body_to_ned
from discsim.launch import Launch, launch_of, launch_states, released
from discsim.shipped import load_throw
from discsim.trajectory import release_state

WORDS = st.builds(
    Launch,
    speed=st.floats(5.0, 35.0),
    launch=st.floats(-0.3, 0.7),
    heading=st.floats(-3.0, 3.0),
    hyzer=st.floats(-1.2, 1.2),
    nose=st.floats(-0.4, 0.4),
    spin=st.sampled_from([-90.0, -30.0, 30.0, 90.0]),
    height=st.floats(0.5, 2.0),
)


@given(WORDS)
def test_a_release_says_of_itself_the_words_that_it_was_made_of(words):
    np.testing.assert_allclose(launch_of(released(words)), words, atol=1e-12)


def test_the_shipped_throw_is_what_its_comments_say():
    words = launch_of(load_throw("driver"))
    assert words.speed == pytest.approx(24.0, abs=1e-6)
    assert np.degrees([words.launch, words.heading, words.hyzer]) == pytest.approx([10.0, 0.0, 12.0], abs=1e-4)
    assert np.degrees(words.nose) == pytest.approx(8.0 - 10.0, abs=1e-4)  # pitch of the plane less launch


@given(WORDS)
def test_the_edge_that_hyzer_puts_down_is_the_left_one_of_a_disc_that_turns_clockwise(words):
    """Seen along the heading, whatever it is; the right one of a disc that turns the other way."""
    disc = body_to_ned(release_state(released(words))[6:10])[:, 2]
    right = np.array([-np.sin(words.heading), np.cos(words.heading), 0.0])
    lean_right = -float(disc @ right)  # the disc's down axis leans away from the lower edge's side
    assert np.sign(lean_right) == np.sign(-words.hyzer * words.spin) or abs(lean_right) < 1e-12


@given(WORDS, st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_states_of_many_throws_are_those_of_each(words, p, yaw):
    like = Release(np.array([3.0, -2.0, -1.0]), np.array([1.0, 0.0, 0.0]), yaw=yaw, body_rate=np.array([p, 0.5, 1.0]))
    one = release_state(released(words, like))
    twice = Launch(*(np.array([value, value]) for value in words))
    many = launch_states(twice, np.array([[p, 0.5], [p, 0.5]]), like)
    turned = np.sign(one[6:10] @ many[0, 6:10])  # q and -q are one attitude
    many[:, 6:10] *= turned
    np.testing.assert_allclose(many, [one, one], atol=1e-12)


@pytest.mark.parametrize("words", [{"speed": 0.0}, {"height": -1.0}, {"spin": 1e4}, {"launch": np.nan}])
def test_what_nobody_throws_is_refused(words):
    with pytest.raises(InputError, match="expected"):
        released(launch_of(load_throw("driver"))._replace(**words))
