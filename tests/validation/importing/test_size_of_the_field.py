"""What the size of the field at a place tells of a magnetometer: of shares of it (Xsens, x-io, Shimmer), of counts."""

from __future__ import annotations

from dataclasses import replace
from datetime import date

import numpy as np
import pytest
from support.made_logs import FIELD, made_log, three, write_table

from discsim.environment import Environment, world_magnetic_field
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
SIZE = float(np.linalg.norm(FIELD))


def written(tmp_path, name, field, *, counts=False):
    gyro, accel = (np.round(np.degrees(LOG.gyro) * 16.384), np.round(LOG.accel / 9.80665 * 2048))
    gyro, accel = (gyro, accel) if counts else (LOG.gyro, LOG.accel)
    columns = [("time_ms", (1e3 * LOG.t).round().astype(int))]
    columns += [*three(("Gyr_X", "Gyr_Y", "Gyr_Z"), gyro), *three(("Acc_X", "Acc_Y", "Acc_Z"), accel)]
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


@pytest.mark.parametrize(("per", "sure"), [(22.81, "likely"), (17.11, "likely"), (10.0, "guess"), (10.9, "guess")])
def test_counts_are_those_of_the_part_that_reads_the_field_of_the_place(tmp_path, per, sure):
    """Of LIS3MDL's ranges the one was taken that reads 45 uT: the field of a place came out a third too large."""
    raw = written(tmp_path, "Mag_{}", np.round(per * LOG.mag), counts=True)
    log = import_log(raw, environment=replace(Environment(), magnetic_field=FIELD))
    unit = unit_of(log)
    assert (unit.choice, unit.sure) == (f"{1 / per:.4g} uT a count", sure)
    assert f"the field of the place is of {SIZE:.0f} uT" in unit.why
    np.testing.assert_allclose(log.recordings[0].samples["magnetometer"].value, LOG.mag, atol=0.6 / per)


def test_counts_without_a_place_are_a_guess_that_a_place_would_settle(tmp_path):
    unit = unit_of(import_log(written(tmp_path, "Mag_{}", np.round(17.11 * LOG.mag))))
    assert unit.sure == "guess"
    assert unit.why.endswith("as well: --place and --date would tell")


def test_a_log_that_tells_its_own_place_and_day_needs_no_other(tmp_path):
    """A receiver's columns and stamps since 1970 tell the field, and by it the range of the part."""
    there = world_magnetic_field(47.1, 8.2, date(2024, 6, 1))
    columns = [("timestamp_ms", (1717243200000 + 1e3 * LOG.t).round().astype(np.int64))]
    columns += [*three(("Gyr_X", "Gyr_Y", "Gyr_Z"), LOG.gyro), *three(("Acc_X", "Acc_Y", "Acc_Z"), LOG.accel)]
    counts = np.round(17.11 * LOG.mag * np.linalg.norm(there) / SIZE)
    place = [("latitude", np.full(len(LOG.t), 47.1)), ("longitude", np.full(len(LOG.t), 8.2))]
    log = import_log(write_table(tmp_path / "log.csv", [*columns, *three(("mx", "my", "mz"), counts), *place]))
    assert (unit_of(log).choice, unit_of(log).sure) == (f"{1 / 17.11:.4g} uT a count", "likely")
