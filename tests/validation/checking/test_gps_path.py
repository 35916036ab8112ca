"""Fixes that are none: degrees under metres' names, a fix that is repeated, zeros for no fix, another origin."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.environment import Environment
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.checking import check_recording
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.paths import path_findings
from discsim.validation.diagnosis.setup import find_setup_faults

T = np.arange(70) / 10
#: metres of a degree of latitude and of longitude at 47.4 deg north
DEGREES = 1 / np.array([111.2e3, 75.4e3])


def fixes(noise: float = 0.05) -> np.ndarray:
    """Return positions and velocities (70, 6) of a throw of 7 s, m and m/s."""
    position = np.stack([22 * T - T**2, 3 * T, -1.3 - 3 * T + 0.45 * T**2], 1)
    velocity = np.stack([22 - 2 * T, 3 + 0 * T, -3 + 0.9 * T], 1)
    return np.hstack([position, velocity]) + noise * np.random.default_rng(0).standard_normal((70, 6))


def of(value: np.ndarray, t: np.ndarray = T) -> Recording:
    return Recording(
        name="fixes",
        plant="flight",
        environment=Environment(9.81, np.zeros(3), 1.2),
        samples={"gps": Samples(t, value)},
        sheets={"gps": SensorSheet(10.0, 0.05)},
    )


def found(value: np.ndarray, t: np.ndarray = T) -> list[Finding]:
    return list(path_findings(of(value, t)))


def in_degrees(value: np.ndarray, digits: int = 7) -> np.ndarray:
    place = value.copy()
    place[:, :2] = np.round([47.4, 8.5] + value[:, :2] * DEGREES, digits)
    place[:, 2] = 400.0 - value[:, 2]
    return place


def test_of_sound_fixes_nothing_is_said():
    assert found(fixes()) == []
    without = fixes()
    without[:, 3:] = np.nan
    assert found(without) == []


@pytest.mark.parametrize("digits", [7, 5])
@pytest.mark.parametrize("velocities", [True, False])
def test_degrees_under_metres_names_are_named_and_no_column_is_called_exchanged(digits, velocities):
    value = in_degrees(fixes(), digits)
    if not velocities:
        value[:, 3:] = np.nan
    [one] = found(value)
    assert (one.id, one.severity) == ("gps.degrees", "error")
    assert 'unit = "deg" below [sensors.gps]' in one.remedy
    assert not find_setup_faults([of(value)]).faults


def test_whole_numbers_of_a_receiver_are_told_apart_from_centimetres():
    value = in_degrees(fixes(), 7)
    value[:, :2] *= 1e7
    [one] = found(value)
    assert "1e-7 degrees" in one.what
    cm = fixes()
    cm[:, :3] *= 100.0
    assert [one.id for one in found(cm)] == ["gps.unit"]


def test_a_fix_that_is_repeated_while_the_disc_flies_is_an_error_with_its_times():
    frozen = fixes()
    frozen[20:] = frozen[20]
    [one] = found(frozen)
    assert (one.id, one.severity) == ("gps.frozen", "error")
    assert "in 50 rows, from 2.000 to 6.900 s" in one.what
    assert found(frozen[:21], T[:21]) == []  # the remedy: the rows left out


def test_a_receiver_that_is_slower_than_the_log_is_not_called_frozen():
    value = fixes()
    assert "gps.frozen" not in [one.id for one in found(value[np.arange(70) // 10 * 10])]


@pytest.mark.parametrize("rows", [[35], list(range(9)), [20, 21, 22, 50]])
def test_zeros_for_no_fix_are_an_error_and_empty_cells_are_not(rows):
    value = fixes()
    value[rows] = 0.0
    [one] = found(value)
    assert (one.id, one.severity) == ("gps.no_fix", "error")
    assert f"({len(rows)} of 70)" in one.what
    value[rows] = np.nan
    assert found(value) == []


def test_a_path_that_counts_from_its_first_fix_begins_with_zeros():
    value = fixes(0.0)
    value[:, :3] -= value[0, :3]
    assert found(value) == []


def test_a_fix_that_leaps_and_a_path_from_another_origin_are_named():
    leaps = fixes()
    leaps[30, 1] += 80.0
    [one] = found(leaps)
    assert (one.id, one.what) == ("gps.leap", "fixes leap (1 of 70): at 3.000 s")
    far = fixes()
    far[:, :3] += [5.25e6, 465e3, -400.0]
    [origin] = found(far)
    assert origin.id == "gps.origin"
    assert "401" in origin.what
    assert [one.id for one in check_recording(of(far)).of("warning")] == ["gps.origin"]
