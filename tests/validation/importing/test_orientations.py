"""The orientation that a board worked out stands among its readings: four numbers of length 1 that are no sensor's."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
STEPS = np.gradient(LOG.t)[:, None] * LOG.gyro


def orientation(first: str) -> np.ndarray:
    """Return the quaternion (n, 4) that follows the gyroscope, its scalar first or last."""
    turned, rows = Rotation.from_euler("x", 5.0, degrees=True), []
    for step in STEPS:
        turned = turned * Rotation.from_rotvec(step)
        rows.append(turned.as_quat(scalar_first=first == "w"))
    return np.array(rows)


@pytest.mark.parametrize("names", ["qw,qx,qy,qz", "q0,q1,q2,q3", "orient_x,orient_y,orient_z,orient_w"])
def test_an_orientation_alone_is_no_gyroscope(tmp_path, names):
    raw = tmp_path / "fused.csv"
    rows = np.column_stack([LOG.t * 1000, orientation("w" if names.startswith("q") else "x")])
    np.savetxt(raw, rows, delimiter=",", fmt=["%.0f", *["%.4f"] * 4], header=f"time_ms,{names}", comments="")
    four = ", ".join(f"'{name}'" for name in names.split(","))
    with pytest.raises(InputError, match=f"{four} are an orientation that was worked out, .* log the gyroscope"):
        import_log(raw)


@pytest.mark.parametrize("header", ["", "c1,c2,c3,c4,c5,c6,c7,c8,c9,c10,c11"])
def test_columns_without_names_beside_an_orientation_are_the_sensors_that_they_are(tmp_path, header):
    raw = tmp_path / "log.csv"
    rows = np.column_stack([LOG.t, LOG.accel / G0, LOG.gyro / DEG, orientation("w")])
    np.savetxt(raw, rows, delimiter=",", fmt="%.5f", header=header, comments="")
    read = import_log(raw).recordings[0].samples
    assert set(read) == {"accelerometer", "gyroscope"}
    assert_allclose(read["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)


def test_a_pull_in_g_that_a_hand_turns_slowly_has_length_1_too_and_is_read(tmp_path):
    raw = tmp_path / "log.csv"
    tilt, noise = np.linspace(0.0, 1.5, 600), np.random.default_rng(1).normal(0.0, 2e-3, (600, 3))
    accel = np.column_stack([np.sin(tilt), 0.0 * tilt, np.cos(tilt)]) + noise
    rows = np.column_stack([np.arange(600) * 0.01, accel, np.zeros(600)])
    np.savetxt(raw, rows, delimiter=",", fmt="%.4f", header="t,ax,ay,az,button", comments="")
    assert set(import_log(raw).recordings[0].samples) == {"accelerometer"}


@pytest.mark.parametrize("names", ["q_w,q_x,q_y,q_z", "Q0(),Q1(),Q2(),Q3()", "quat.w,quat.x,quat.y,quat.z"])
def test_what_is_called_a_quaternion_is_no_magnetometer_before_it_turns(tmp_path, names):
    raw = tmp_path / "log.csv"
    accel = made_log().accel[:100] + np.array([3.0, 0.0, 0.0]) * np.sin(LOG.t[:100, None])
    still = Rotation.from_euler("xyz", [40.0, 5.0, 3.0], degrees=True).as_quat(scalar_first=True)
    rows = np.column_stack([LOG.t[:100], accel, still + 0.005 * np.sin(9 * LOG.t[:100, None] + np.arange(4))])
    np.savetxt(
        raw, rows, delimiter=",", fmt=["%.3f"] * 4 + ["%.2f"] * 4, header=f"time_s,ax,ay,az,{names}", comments=""
    )
    assert set(import_log(raw).recordings[0].samples) == {"accelerometer"}
