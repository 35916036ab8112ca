"""Pieces of work side by side: in order, in the caller's context, and an error is the caller's."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from discsim import threads
from discsim.threads import side_by_side


@pytest.fixture(autouse=True)
def four_cores(monkeypatch):
    monkeypatch.setattr(threads, "cores", lambda: 4)


def test_results_come_in_the_order_of_the_pieces_whichever_ends_first():
    later = threading.Event()

    def waiting(piece: int) -> int:
        if piece == 0:
            assert later.wait(10.0)
        if piece == 1:
            later.set()
        return piece

    assert side_by_side(waiting, range(8)) == list(range(8))


def test_each_piece_sees_the_error_state_of_the_caller():
    with np.errstate(divide="raise"), pytest.raises(FloatingPointError):
        side_by_side(lambda piece: np.ones(1) / np.array([piece]), [1.0, 0.0])
    with np.errstate(divide="ignore"):
        assert np.isinf(side_by_side(lambda piece: np.ones(1) / np.array([piece]), [1.0, 0.0])[1])


def test_an_error_ends_the_work_that_has_not_begun():
    done = []

    def failing(piece: int) -> None:
        if piece == 0:
            raise ValueError("the first")
        time.sleep(0.001)  # a piece of work: of ones that last no time a busy machine ends all before the error is seen
        done.append(piece)

    with pytest.raises(ValueError, match="the first"):
        side_by_side(failing, range(10_000))
    assert len(done) < 9_999
