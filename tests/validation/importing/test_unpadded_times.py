"""Seconds and milliseconds joined by a point without leading zeros (`1.5` for 1.005 s) are read as meant, aloud."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, LANDING, RELEASE, made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.cell_texts import CellTexts, packed
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.unpadded import unpadded

LOG = made_log()
MS = np.round(1000 * LOG.t).astype(int).tolist()
#: whole seconds and milliseconds to what a careless program prints
PRINTED = {
    "seconds": ("time_s", lambda s, ms: f"{s}.{ms}"),
    "seconds without a unit": ("time", lambda s, ms: f"{48 + s}.{ms}"),
    "a decimal comma": ("time_s", lambda s, ms: f"{s},{ms}"),
    "a time of day": ("Time", lambda s, ms: f"12:00:{s:02d}.{ms}"),
    "a date with a zone": ("Time", lambda s, ms: f"2025-06-01 12:00:{s:02d}.{ms}+02:00"),
    "afternoon": ("Time", lambda s, ms: f"6/1/2025 2:00:{s:02d}.{ms} PM"),
    "microseconds": ("time_s", lambda s, ms: f"{s}.{1000 * ms}"),
}


def log(path, name, cells, rows=slice(None)):
    columns = [(name, cells), *three(["gx_dps", "gy_dps", "gz_dps"], LOG.gyro[rows] / DEG)]
    columns += three(["ax_g", "ay_g", "az_g"], LOG.accel[rows] / G0)
    comma = "," in cells[0]
    return write_table(path, columns, separator=";" if comma else ",", decimal="," if comma else ".")


@pytest.mark.parametrize("form", PRINTED)
def test_counted_parts_of_a_second_are_read_as_meant_and_it_is_said(tmp_path, form):
    """They were called certain; the clock "started anew" each second, and no throw was found."""
    name, printed = PRINTED[form]
    found = import_log(log(tmp_path / "log.csv", name, [printed(ms // 1000, ms % 1000) for ms in MS]))
    assert_allclose(found.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)
    said = found.summary()
    assert "(likely: " in next(line for line in said.splitlines() if line.startswith("time: "))
    assert "without zeros before it" in said
    (throw,) = found.throws
    assert RELEASE <= throw.start < throw.end <= LANDING + 0.1
    repair = found.imported[0].repairs[0]
    assert (repair.line, repair.action) == (4, "read so from the first row on")


@pytest.mark.parametrize("digits", [3, 4, 5])
@pytest.mark.parametrize("form", ["12:00:{:02d}.{}", "{}.{}"])
def test_microseconds_cut_to_their_first_digits_are_read_as_meant(tmp_path, form, digits):
    """A CanSat's log was twice as long as it had lasted, 912 rows "lost"; the clock "went on by 1 s" each second."""
    cells = [form.format(ms // 1000, str(1000 * (ms % 1000))[:digits]) for ms in MS]
    found = import_log(log(tmp_path / "log.csv", "Time", cells))
    assert_allclose(found.recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert f"the beginning ({digits} digits) of a count of 1000000, without zeros before it" in found.summary()
    (throw,) = found.throws
    assert RELEASE <= throw.start < throw.end <= LANDING + 0.1


def test_a_clock_that_is_set_back_is_no_cut_count():
    times = np.concatenate([np.arange(0.0, 4.0, 0.01), np.arange(3.5, 7.0, 0.01), np.arange(6.0, 9.0, 0.01)])
    cells = [repr(round(t, 4)) for t in times.tolist()]
    assert unpadded(CellTexts(packed(cells)), np.array(cells, dtype=float)) is None


def test_a_map_that_does_not_allow_it_refuses_with_the_line(tmp_path):
    raw = log(tmp_path / "log.csv", "time_s", [f"{ms // 1000}.{ms % 1000}" for ms in MS])
    text = import_log(raw).map_text.replace(', "time"]', "]")
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    with pytest.raises(
        InputError, match=r"log.csv:4: 'time_s': behind the point of '0.10' stands a count of 10 of 1000"
    ):
        import_recording(raw, read_map(tmp_path / "map.toml"))


@pytest.mark.parametrize("printed", [lambda t: f"{t:.3f}", lambda t: repr(round(t, 3)), lambda t: f"{t:.2f}"])
def test_decimals_are_decimals_also_where_some_rows_are_out_of_order(tmp_path, printed):
    order = np.arange(LOG.t.size)
    order[100::200] -= 7
    cells = [printed(t) for t in LOG.t[order].tolist()]
    assert unpadded(CellTexts(packed(cells)), np.array(cells, dtype=float)) is None
    assert "zeros before" not in import_log(log(tmp_path / "log.csv", "time_s", cells, order)).summary()


def test_a_log_that_begins_again_and_again_is_no_count():
    cells = [f"{k % 60}.{9 - k % 7}" for k in range(600)]
    assert unpadded(CellTexts(packed(cells)), np.array(cells, dtype=float)) is None
