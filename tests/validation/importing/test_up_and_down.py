"""Which way is down: an accelerometer that shows gravity itself, and a field that points up at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import G0, made_log, three, write_table

from discsim.environment import Environment
from discsim.validation.estimating.spin_estimates import estimate_spin
from discsim.validation.importing.imported_log import Imported, import_log

LOG = made_log()
#: of the board whose x is to the right, y ahead and z up
BOARD = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
SYDNEY = Environment(magnetic_field=np.array([24.0, 5.0, -51.0]))
OF_PHONES = {"accel": "accelerometerAcceleration{}(G)", "gyro": "gyroRotation{}(rad/s)", "field": "magnetometer{}(µT)"}


def imported(
    place: Path, pull: float = 1.0, field: float = 1.0, *, phone: bool = False, environment: Environment | None = None
) -> Imported:
    """Import a log whose accelerometer and magnetometer are of some sign, as an iPhone calls them perhaps."""
    columns: list[tuple[str, np.ndarray]] = [("t", LOG.t)]
    values = {"accel": pull * LOG.accel @ BOARD / G0, "gyro": LOG.gyro @ BOARD, "field": field * LOG.mag @ BOARD}
    for kind, value in values.items():
        plain = {"accel": "a{}_g", "gyro": "g{}_rad_s", "field": "m{}_uT"}[kind]
        name = OF_PHONES[kind] if phone else plain
        columns += [(name.format("XYZ"[k] if phone else "xyz"[k]), value[:, k]) for k in range(3)]
    if phone:
        columns += [(f"motionUserAcceleration{axis}(G)", np.zeros(LOG.t.size)) for axis in "XYZ"]
    raw = write_table(place / "log.csv", columns)
    return import_log(raw, environment=environment)


def spin(found: Imported) -> float:
    """Return the fastest rate about z, rad/s."""
    rate = found.recordings[0].samples["gyroscope"].value[:, 2]
    return float(rate[np.argmax(np.abs(rate))])


def test_an_iphone_shows_gravity_itself(tmp_path):
    """Its accelerometer reads -1 g along the axis that points up: the spin had come out of the other sense."""
    plain, phone = imported(tmp_path), imported(tmp_path, pull=-1.0, phone=True)
    assert spin(phone) == pytest.approx(spin(plain), rel=0.01)
    assert spin(plain) > 0.0
    assert_allclose(
        phone.recordings[0].samples["accelerometer"].value,
        plain.recordings[0].samples["accelerometer"].value,
        atol=1e-4,
    )
    assert "accelerometer sign: turned" in phone.summary()
    assert "accelerometer sign" not in plain.summary()


def test_a_field_that_points_up_at_rest_is_told_where_the_place_is_not_known(tmp_path):
    told = "the field points up while the log lies still"
    assert told not in imported(tmp_path).summary()
    assert told in imported(tmp_path, pull=-1.0).summary()
    assert told in imported(tmp_path, field=-1.0).summary()
    # south of the equator it does
    assert told not in imported(tmp_path, field=-1.0, environment=SYDNEY).summary()


@pytest.mark.parametrize("south", [True, False])
def test_a_place_tells_which_way_its_field_points(tmp_path, south):
    """Of a part's axes and all three reversed the one was taken that points down, whatever --place said."""
    part = np.diag([1.0, -1.0, -1.0])
    sign = -1.0 if south else 1.0
    columns: list[tuple[str, np.ndarray]] = [("t", LOG.t)]
    for name, value in (("a{}_g", LOG.accel / G0), ("g{}_rad_s", LOG.gyro), ("m{}_uT", sign * LOG.mag @ part)):
        columns += [(name.format(axis), (value @ BOARD)[:, k]) for k, axis in enumerate("xyz")]
    raw = write_table(tmp_path / "log.csv", columns)
    found = import_log(raw, environment=SYDNEY if south else None)
    field = found.recordings[0].samples["magnetometer"].value
    # in the axes of the disc it points down or up, and about the axis of the spin it lies as it may
    assert np.sign(np.median(field[:, 2])) == sign
    assert ("as it does there" in found.summary()) is south


BOULDER = Environment(magnetic_field=np.array([21.0, 3.0, 47.0]))


@pytest.mark.parametrize("there", [BOULDER, SYDNEY, None])
@pytest.mark.parametrize("gyro", [True, False])
def test_the_field_of_the_place_tells_up_from_down_without_an_accelerometer(tmp_path, there, gyro):
    """The board's z points up, where the field reads what is up of it: it was a guess, and half of them wrong."""
    field = LOG.mag if there is not SYDNEY else LOG.mag * np.array([1.0, 1.0, -1.0])
    columns = [("t", LOG.t), *three(["mx", "my", "mz"], field @ BOARD)]
    if gyro:
        turned = LOG.gyro if there is not SYDNEY else LOG.gyro * np.array([-1.0, -1.0, 1.0])
        columns += three(["gx_rad_s", "gy_rad_s", "gz_rad_s"], turned @ BOARD)
    found = import_log(write_table(tmp_path / "log.csv", columns), environment=there)
    if there is None:
        assert "the direction of spin is open; --place and --date would tell it" in found.summary()
        return
    assert "body z: along z, which points up and is reversed (likely: the field points" in found.summary()
    if gyro:
        rate = found.recordings[0].samples["gyroscope"].value[:, 2]
        assert float(rate[np.argmax(np.abs(rate))]) > 0.0


def test_what_an_import_guessed_stands_by_the_rate(tmp_path):
    """A direction of spin that was open at the import was certain in the estimate."""
    columns = [("t", LOG.t), *three(["mx", "my", "mz"], LOG.mag @ BOARD)]
    found = import_log(write_table(tmp_path / "log.csv", columns))
    found.report(tmp_path / "recording")
    (note,) = [one for one in estimate_spin(tmp_path / "recording").notes if "guessed by the import" in one]
    assert "body z" in note
    import_log(write_table(tmp_path / "log.csv", columns), environment=BOULDER).report(tmp_path / "recording")
    assert not any("guessed by the import" in one for one in estimate_spin(tmp_path / "recording").notes)


@pytest.mark.parametrize("reversed_axis", [0, 1, 2])
def test_an_axis_of_the_gyroscope_that_is_reversed_is_turned_back(tmp_path, reversed_axis):
    """No axes of a magnetometer make up for it: of those that left least, fusion was 1.2 % off and sure of it."""
    flip = np.ones(3)
    flip[reversed_axis] = -1.0
    columns = [("t_s", LOG.t), *three(["gx_rad_s", "gy_rad_s", "gz_rad_s"], LOG.gyro * flip)]
    columns += three(["ax_m_s2", "ay_m_s2", "az_m_s2"], LOG.accel) + three(["mx_uT", "my_uT", "mz_uT"], LOG.mag)
    found = import_log(write_table(tmp_path / "log.csv", columns))
    assert_allclose(found.recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(found.recordings[0].samples["magnetometer"].value, LOG.mag, atol=1e-4)
    assert "gyroscope axes: " in found.summary()
    assert "mirror images of one another" in found.summary()
