"""A log's latitude, longitude and height become a recording's north, east and down."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discsim import import_log
from discsim.errors import InputError
from discsim.recording import Recording, read_recording
from discsim.validation.checking import check_recording

MAP = """
name = "receiver"
plant = "flight"
[time]
column = "t"
unit = "s"
[environment]
gravity_m_s2 = 9.81
magnetic_field_ned_uT = [20.0, 0.0, 40.0]
air_density_kg_m3 = 1.2
[disc]
name = "driver"
[sensors.gps]
columns = {columns}
unit = "{unit}"
rate_hz = 10.0
"""
T = np.arange(60) / 10


def imported(tmp_path: Path, columns: list[str], unit: str = "deg", rows: tuple[int, ...] = ()) -> Recording:
    """Import fixes of a throw to the north at 22 m/s at first, 3 m/s to the east; ``rows`` have no fix."""
    north, east, height = 22 * T - T**2, 3 * T, 401.3 + 3 * T - 0.45 * T**2
    lines = ["t,lat,lon,alt,vn,ve,vd"]
    for k, t in enumerate(T):
        # one degree at 47.4 deg north on WGS 84: 111 178 m and 75 487 m
        place = (47.4 + north[k] / 111178.0, 8.5 + east[k] / 75487.0, height[k]) if k not in rows else (0, 0, 0)
        lines.append(
            f"{t:.1f},{place[0]:.9f},{place[1]:.9f},{place[2]:.3f},{22 - 2 * t},{3 + 0.002 * (k % 3)},{-3 + 0.9 * t}"
        )
    (tmp_path / "log.csv").write_text("\n".join([*lines, ""]))
    (tmp_path / "map.toml").write_text(MAP.format(columns=str(columns).replace("'", '"'), unit=unit))
    import_log(tmp_path / "log.csv", str(tmp_path / "map.toml")).report(tmp_path / "out")
    return read_recording(tmp_path / "out")


@pytest.mark.parametrize("columns", [["lat", "lon", "alt"], ["lat", "lon", "alt", "vn", "ve", "vd"]])
def test_degrees_become_metres_from_the_first_fix(tmp_path, columns):
    gps = imported(tmp_path, columns).need("gps")
    np.testing.assert_allclose(gps.value[-1, :2], [22 * 5.9 - 5.9**2, 17.7], rtol=1e-3)
    np.testing.assert_allclose(gps.value[:, 2], -(3 * T - 0.45 * T**2), atol=5e-3)
    assert np.all(np.isnan(gps.value[:, 3:])) == (len(columns) == 3)


def test_the_remedy_of_degrees_under_metres_names_leaves_nothing_to_say(tmp_path):
    wrong = imported(tmp_path, ["lat", "lon", "alt", "vn", "ve", "vd"], "SI")
    assert [one.id for one in check_recording(wrong).of("error")] == ["gps.degrees"]
    right = imported(tmp_path, ["lat", "lon", "alt", "vn", "ve", "vd"])
    assert [one.id for one in check_recording(right).findings if one.where == "gps"] == []


def test_zeros_for_no_fix_become_gaps(tmp_path):
    gps = imported(tmp_path, ["lat", "lon", "alt"], rows=(0, 1, 30)).need("gps")
    assert np.flatnonzero(np.isnan(gps.value[:, 0])).tolist() == [0, 1, 30]
    assert np.nanmax(np.abs(gps.value[:, :3])) < 200.0


def test_two_columns_are_no_place(tmp_path):
    with pytest.raises(InputError, match="expected 3 or 6 names of columns"):
        imported(tmp_path, ["lat", "lon"])
