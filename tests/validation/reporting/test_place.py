"""A place whose two numbers are swapped is refused, or suspected aloud where the field that was read contradicts it."""

from __future__ import annotations

from datetime import date

import numpy as np
import pytest

from discsim.environment import Environment, world_magnetic_field
from discsim.errors import InputError
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.reporting.coordinates import coordinates
from discsim.validation.reporting.options import at_place
from discsim.validation.reporting.place import field_read, swapped_place

DAY = "2025-06-01"
ZURICH, SWAPPED = "47.4,8.5", "8.5,47.4"


def turned(size: float, iron: tuple[float, float, float] = (0.0, 0.0, 0.0), dip_deg: float | None = None) -> Recording:
    """Return a magnetometer turned all ways (or about z, with the field at a dip), 0.5 uT of noise, 300 readings."""
    rng = np.random.default_rng(4)
    ways = rng.standard_normal((300, 3))
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    if dip_deg is not None:
        turn, dip = np.linspace(0.0, 40.0, 300), np.radians(dip_deg)
        ways = np.column_stack([np.cos(dip) * np.cos(turn), -np.cos(dip) * np.sin(turn), np.full(300, np.sin(dip))])
    value = size * ways + np.array(iron) + 0.5 * rng.standard_normal((300, 3))
    sheet = SensorSheet(rate_hz=100.0)
    samples = {"magnetometer": Samples(np.arange(300) / 100, value)}
    return Recording("free_spin", "turned", Environment(), None, None, None, {"magnetometer": sheet}, samples)


def test_a_latitude_beyond_a_pole_is_refused_with_the_place_that_was_meant():
    with pytest.raises(InputError, match=r"are they swapped\? Then --place 37\.57,126\.98"):
        at_place(Environment(), "126.98,37.57", DAY)
    with pytest.raises(InputError, match="no place at latitude 126"):
        at_place(Environment(), "126.98,137.57", DAY)


@pytest.mark.parametrize("dip_deg", [None, 63.0])
def test_a_place_is_suspected_where_the_field_agrees_with_the_one_swapped(dip_deg):
    size = float(np.linalg.norm(world_magnetic_field(47.4, 8.5, date.fromisoformat(DAY))))
    read = [turned(size, dip_deg=dip_deg)]
    assert swapped_place(ZURICH, DAY, read) is None
    said = swapped_place(SWAPPED, DAY, read)
    assert said is not None
    assert f"as at --place {ZURICH}" in said


def test_a_place_is_suspected_by_the_dip_where_the_sizes_are_alike():
    """Cape Verde's field has 32 uT, and that of the place swapped 27; they dip by 9 and by -65 degrees."""
    right, wrong = "15.0,-23.5", "-23.5,15.0"
    here, there = (world_magnetic_field(*map(float, one.split(",")), date.fromisoformat(DAY)) for one in (right, wrong))
    size = float(np.linalg.norm(here))
    dips = [float(np.degrees(np.arcsin(field[2] / np.linalg.norm(field)))) for field in (here, there)]
    assert abs(dips[0] - dips[1]) > 40
    said = swapped_place(wrong, DAY, [turned(size, dip_deg=dips[0])], dips[0])
    assert said is not None
    assert "are latitude and longitude swapped? Expected LAT,LON" in said
    assert swapped_place(right, DAY, [turned(size, dip_deg=dips[0])], dips[0]) is None
    assert swapped_place(right, DAY, [turned(size)], dips[0] - 20) is None  # a hard iron


def test_a_field_that_agrees_with_neither_place_and_fields_that_are_alike_say_nothing_of_a_swap():
    assert swapped_place(SWAPPED, DAY, [turned(65.0)]) is None  # a wrong scale, or a magnet
    alike = float(np.linalg.norm(world_magnetic_field(-23.5, -46.6, date.fromisoformat(DAY))))
    assert swapped_place("-46.6,-23.5", DAY, [turned(alike)]) is None
    assert swapped_place(None, None, [turned(48.0)]) is None
    assert swapped_place("37.57,126.98", DAY, [turned(36.0)]) is None  # the other is no place


@pytest.mark.parametrize("iron", [(0.0, 0.0, 0.0), (14.0, -9.0, 20.0)])
def test_the_size_of_a_field_read_all_round_is_that_without_the_hard_iron(iron):
    """300 readings of 0.5 uT each put the radius within 0.1 uT, three of its sigmas."""
    assert field_read(turned(48.0, iron)) == pytest.approx(48.0, abs=0.15)


@pytest.mark.parametrize(
    ("written", "place"),
    {
        "37.57 126.98": (37.57, 126.98),
        "37,57; 126,98": (37.57, 126.98),
        "37.57° N, 126.98° E": (37.57, 126.98),
        "126.98E,37.57N": (37.57, 126.98),
        "33,86 S 151,2 E": (-33.86, 151.2),
        "37°34'12\"N 126°58'48″E": (37.57, 126.98),
        "N37 34.2 W126 58.8": (37.57, -126.98),
        "-33.86,151.2": (-33.86, 151.2),
    }.items(),
)
def test_a_place_is_read_as_maps_write_it(written, place):
    assert coordinates(written) == pytest.approx(place, abs=1e-9)


@pytest.mark.parametrize(
    "written",
    ["Seoul", "37.57", "37,57,126,98", "1e3,5", "nan,5", "52.5N 13.4O", "5N,6N", "-5S,6E", "37°61'N 5°E", "1,2,3"],
)
def test_what_is_no_place_is_refused(written):
    assert coordinates(written) is None
    with pytest.raises(InputError, match="expected LAT,LON"):
        at_place(Environment(), written, DAY)
