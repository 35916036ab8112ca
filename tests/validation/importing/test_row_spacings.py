"""A column of what went by since the row before (`dt_us`) in the place of a clock is added up, aloud."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, RATE, made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing.import_map import read_map
from discsim.validation.importing.imported_log import import_log

LOG = made_log()


def log(path, name, spacing):
    columns = [(name, spacing), *three(["gx", "gy", "gz"], LOG.gyro / DEG)]
    return write_table(path, columns + three(["ax", "ay", "az"], LOG.accel / G0))


@pytest.mark.parametrize(("name", "scale"), [("dt_us", 1e6), ("delta_ms", 1e3), ("dt", 1.0), ("loopTime", 1e6)])
def test_spacings_are_added_up_and_it_is_said(tmp_path, name, scale):
    """They differ: a logger's loop is now and then a tenth longer, and the first is the time since it was on."""
    spacing = np.where(np.arange(LOG.t.size) % 7 == 3, 1.1, 1.0) / RATE
    time = np.cumsum(spacing) - spacing[0]
    spacing[0] = 48.2
    whole = import_log(log(tmp_path / "log.csv", name, spacing * scale))
    assert_allclose(whole.recordings[0].samples["gyroscope"].t, time, atol=1e-4)
    assert f"time: '{name}' in " in whole.summary()
    assert "spacings of the rows, ADDED UP to 10.14 s" in whole.summary()
    assert "spacings = true" in whole.map_text


def test_a_row_without_a_number_takes_the_usual_spacing(tmp_path):
    cells = ["5000"] * LOG.t.size
    cells[100] = "nan"
    read = import_log(log(tmp_path / "log.csv", "dt_us", cells)).recordings[0].samples["gyroscope"]
    assert_allclose(read.t, np.delete(LOG.t, 100), atol=1e-9)


def test_a_clock_beside_the_spacings_is_the_time(tmp_path):
    columns = [("dt_us", np.full(LOG.t.size, 7000)), ("t_s", LOG.t), *three(["gx", "gy", "gz"], LOG.gyro / DEG)]
    whole = import_log(write_table(tmp_path / "log.csv", columns))
    assert "time: 't_s' in s" in whole.summary()


def test_a_map_refuses_spacings_of_dates(tmp_path):
    whole = import_log(log(tmp_path / "log.csv", "dt_us", np.full(LOG.t.size, 5000)))
    wrong = tmp_path / "wrong.toml"
    wrong.write_text(whole.map_text.replace('unit = "us"', 'unit = "iso"'))
    with pytest.raises(
        InputError, match="'spacings' is true, expected a 'column' of numbers in s, ms, us, ns, min or d"
    ):
        read_map(wrong)
