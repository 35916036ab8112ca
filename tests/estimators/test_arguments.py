"""Arguments of another type or shape: each is refused by its name, with what it is and what was expected."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.estimators import (
    AccelerometerErrors,
    FftSettings,
    Options,
    YawRate,
    accelerometer,
    best,
    envelope,
    estimate,
    rate_with_known_terms,
)
from discsim.plain_arrays import recording_from_arrays
from discsim.recording import Samples, SensorSheet

T = np.arange(0.0, 2.0, 0.01)
FORCE = Samples(T, np.tile([10.0, 0.0, -9.8], (T.size, 1)))
PLACE = (-0.016, 0.0, 0.0)
FIELD = recording_from_arrays({"magnetometer": (T, 40.0 * np.column_stack([np.cos(30 * T), -np.sin(30 * T), 0 * T]))})

WRONG = {
    "text": (lambda: envelope("10.0", PLACE, AccelerometerErrors()), "towards_axis is '10.0', of type str"),
    "texts": (lambda: envelope(["1", "2"], PLACE, AccelerometerErrors()), "towards_axis is .*list; expected"),
    "2-D": (lambda: envelope(FORCE.value, PLACE, AccelerometerErrors()), r"towards_axis has shape \(200, 3\)"),
    "errors": (lambda: envelope([1.0], PLACE, "paper"), "errors is 'paper', of type str; expected Acc"),
    "place": (
        lambda: envelope([1.0], "middle", AccelerometerErrors()),
        "position .*is 'middle', of type str; expected three",
    ),
    "two": (lambda: rate_with_known_terms(FORCE, PLACE[:2]), "position .*expected three finite numbers"),
    "matrix": (
        lambda: rate_with_known_terms(FORCE, PLACE, sensitivity=[1.0, 1.0, 1.0]),
        r"sensitivity has shape \(3,\)",
    ),
    "length": (lambda: rate_with_known_terms(FORCE, PLACE, origin=np.zeros((7, 3))), r"origin has shape \(7, 3\).*200"),
    "origin": (lambda: rate_with_known_terms(FORCE, PLACE, origin=["a", "b", "c"]), "origin is .*list; expected"),
    "own": (lambda: accelerometer(FORCE, SensorSheet(100.0), {"mount": 1e-3}), "errors is .*dict; expected Acc"),
    "figure": (lambda: AccelerometerErrors(mount="1 mm"), "accelerometer mount is '1 mm', of type str"),
    "window": (lambda: FftSettings(window="128"), "fft window is '128', of type str; expected a whole"),
    "options": (lambda: best(FIELD, FftSettings()), "options is FftSettings.*expected Options"),
    "by name": (lambda: estimate(FIELD, "fft", {"window": 64}), "options is .*dict; expected Options"),
    "in options": (lambda: Options(fft=64), "options fft is 64, of type int; expected FftSettings"),
    "rates": (lambda: YawRate("mine", T, T[1:], T), r"mine: rate has shape \(199,\); expected \(200,\)"),
    "words": (lambda: YawRate("mine", T[:2], ["a", "b"], T[:2]), "mine: rate is .*list; expected"),
    "readings": (lambda: Samples(T[:2], ["1.0", "2.0"]), "samples: value is .*list; expected"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_argument_is_named_with_what_was_expected(name):
    wrong, said = WRONG[name]
    with pytest.raises(InputError, match=said):
        wrong()
