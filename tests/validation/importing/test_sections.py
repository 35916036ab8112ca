"""Tables of several sensors one below the other in a text are a file for each."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.other_forms.sections import begins

LOG = made_log()
#: the first section breaks off, so that a later one is the longer stretch of time
ENDS = 1500


def rows(value: np.ndarray, sign: str = ",") -> list[str]:
    table = np.column_stack([LOG.t, value])
    return [sign.join(f"{cell:.5f}" for cell in row) for row in table]


FORMS = {
    "titles above the same names": lambda: [
        *["Exported by an app", "", "Accelerometer (m/s^2)", "t;x;y;z", *rows(LOG.accel, ";")[:ENDS], ""],
        *["Gyroscope", "t;x;y;z", *rows(LOG.gyro / DEG, ";")],
    ],
    "names of their own": lambda: [
        *["t,ax,ay,az", *rows(LOG.accel)[:ENDS], "", "t,gx,gy,gz", *rows(LOG.gyro / DEG)],
        *["", "t,mx,my,mz", *rows(LOG.mag)],
    ],
    "blanks between": lambda: [
        *["t ax ay az", *rows(LOG.accel, " ")[:ENDS], "t gx gy gz", *rows(LOG.gyro / DEG, " ")],
    ],
}


@pytest.mark.parametrize("form", FORMS)
def test_tables_one_below_the_other_are_a_sensor_each(tmp_path, form):
    """The clock began anew, the longest stretch was kept, and rates in deg/s were forces in m/s^2."""
    raw = tmp_path / "log.csv"
    raw.write_text("\n".join([*FORMS[form](), ""]))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(samples["accelerometer"].value, LOG.accel[:ENDS], atol=1e-4)
    assert "one below the other; read as files of their own" in found.summary()


@pytest.mark.parametrize(
    "between",
    [["gyro calibrated"], ["Gyroscope"], ["t,ax,ay,az"], ["", "gyro: all is well, go on"]],
    ids=["a message", "a word", "the names again", "a message with a comma"],
)
def test_a_line_amid_the_rows_of_one_sensor_parts_nothing(tmp_path, between):
    raw = tmp_path / "log.csv"
    table = rows(LOG.accel)
    raw.write_text("\n".join(["t,ax,ay,az", *table[:700], *between, *table[700:], ""]))
    assert not begins(raw)
