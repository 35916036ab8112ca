"""Magnetometers that are calibrated to the size of the field read shares of it: Xsens, x-io, Shimmer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made_logs import FIELD, made_log, three, write_table

from discsim.environment import Environment
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
SIZE = float(np.linalg.norm(FIELD))


def written(tmp_path, name, field):
    columns = [("time_ms", (1e3 * LOG.t).round().astype(int))]
    columns += [*three(("Gyr_X", "Gyr_Y", "Gyr_Z"), LOG.gyro), *three(("Acc_X", "Acc_Y", "Acc_Z"), LOG.accel)]
    return write_table(tmp_path / "log.csv", [*columns, *three([name.format(axis) for axis in "XYZ"], field)])


def unit_of(log):
    (unit,) = [decision for decision in log.decisions if decision.what == "magnetometer unit"]
    return unit


@pytest.mark.parametrize("name", ["Mag_{}", "Magnetometer {} (a.u.)"])
def test_shares_of_the_field_have_the_size_of_the_place(tmp_path, name):
    """They were taken for gauss: twice the earth's field."""
    raw = written(tmp_path, name, LOG.mag / SIZE)
    log = import_log(raw, environment=replace(Environment(), magnetic_field=FIELD))
    assert unit_of(log).sure == "likely"
    assert unit_of(log).choice == f"shares of a field of {SIZE:.4g} uT"
    np.testing.assert_allclose(log.recordings[0].samples["magnetometer"].value, LOG.mag, atol=0.02)


def test_without_a_place_the_size_of_the_field_is_a_guess(tmp_path):
    log = import_log(written(tmp_path, "Mag_{}", LOG.mag / SIZE))
    assert unit_of(log).sure == "guess"
    assert "give --place and --date, or write it as scale" in unit_of(log).why
    assert "scale = 45.0" in log.map_text


def test_gauss_that_a_header_states_stays_beside_iron_of_the_size_of_the_field(tmp_path):
    log = import_log(written(tmp_path, "Mag_{} (gauss)", (LOG.mag + np.array([0.0, 0.0, 50.0])) / 100))
    assert unit_of(log).choice == "gauss"
