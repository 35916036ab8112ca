"""How far a diagnosis is: which refit, how many are left, and how long they take."""

from __future__ import annotations

import pytest

from discsim.validation.reporting.progress import Pace, shown


def test_what_is_left_takes_as_long_as_what_is_done():
    clock = iter((10.0, 14.0, 16.0))
    pace = Pace(lambda: next(clock))
    assert pace("following the data", 1, 5) == ""
    assert pace("refitting with: air.wind", 0, 4) == ""
    assert pace("refitting with: mag.lag", 1, 4) == "about 12 s left of these"
    assert pace("refitting with: gps.latency", 2, 4) == "about 6 s left of these"


def test_another_round_begins_anew():
    clock = iter((0.0, 100.0, 103.0))
    pace = Pace(lambda: next(clock))
    assert pace("refitting with: air.wind", 0, 4) == ""
    assert pace("refitting in place of air.wind: mag.lag", 0, 3) == ""
    assert pace("refitting in place of air.wind: mag.bias", 1, 3) == "about 6 s left of these"


def test_a_line_names_what_is_refitted_and_how_many_there_are(capsys: pytest.CaptureFixture[str]):
    with shown() as progress:
        progress("fitting the baseline", 2, 4)
        progress("effect 1, refitting with: air.wind", 0, 3)
        progress("effect 1, refitting with: mag.lag", 1, 3)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [
        "fitting the baseline (step 3 of 4)",
        "effect 1, refitting with: air.wind (1 of 3)",
        "effect 1, refitting with: mag.lag (2 of 3)",
    ]
