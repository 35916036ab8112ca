"""Logs without times whose file states the rate elsewhere: LabVIEW, a number beside arrays, a first line."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import savemat
from support.made_logs import DEG, G0, RATE, made_log, three, write_table

from discsim.validation.importing.imported_log import ImportedLog, import_log

LOG = made_log()
VALUES = np.hstack([LOG.accel / G0, LOG.gyro / DEG, LOG.mag])
NAMES = [f"{sensor}_{axis}" for sensor in ("acc", "gyro", "mag") for axis in "xyz"]
UNITS = ["g"] * 3 + ["deg/s"] * 3 + ["uT"] * 3


def labview(columns: str = "One", separator: str = "\t", mark: str = ".", *, twice: bool = False) -> str:
    """The log as LabVIEW writes it, in two segments with a heading each perhaps."""
    step = f"{1 / RATE:.6f}"
    first = {"Separator": "Tab" if separator == "\t" else "Comma", "Decimal_Separator": mark, "X_Columns": columns}
    lines = ["LabVIEW Measurement", *(f"{key}{separator}{value}" for key, value in first.items())]
    lines += ["Time\t14:03:20.2500000", "***End_of_Header***", ""]
    heading = [["Channels", "9"], ["Samples", "1000"], ["Time", "14:03:20.25"], ["Y_Unit_Label", *UNITS]]
    heading += [["X_Dimension", *["Time"] * 9], ["X0", *["0.0E+0"] * 9], ["Delta_X", *[step] * 9]]
    above = [separator.join(cells) for cells in heading] + [f"***End_of_Header***{separator * 9}"]
    x = "" if columns == "No" else "X_Value"
    names = [x, *NAMES] if columns != "Multi" else [part for name in NAMES for part in (x, name)]
    above += [separator.join([*names, "Comment"])]
    rows = []
    for time, value in zip(LOG.t, VALUES, strict=True):
        stamp = "" if columns == "No" else f"{time:.6f}"
        cells = [f"{one:.6f}" for one in value]
        cells = [stamp, *cells] if columns != "Multi" else [part for one in cells for part in (stamp, one)]
        rows.append(separator.join(cells).replace(".", mark) + separator)
    half = len(rows) // 2
    return "\n".join([*lines, *above, *rows[:half], *(["", *above] if twice else []), *rows[half:], ""])


def check(found: ImportedLog) -> None:
    recording = found.recordings[0]
    assert_allclose(recording.samples["gyroscope"].t, LOG.t, atol=2e-5)
    assert_allclose(recording.samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)
    assert set(recording.samples) == {"gyroscope", "accelerometer", "magnetometer"}


@pytest.mark.parametrize(
    ("columns", "separator", "mark", "twice"),
    [
        ("One", "\t", ".", False),
        ("No", "\t", ".", False),
        ("Multi", "\t", ",", False),
        ("One", ",", ".", False),
        ("One", "\t", ".", True),
    ],
)
def test_labview_writes_two_headers(tmp_path, columns, separator, mark, twice):
    """They were taken for the table's, and no sensor was found in it."""
    raw = tmp_path / "log.lvm"
    raw.write_text(labview(columns, separator, mark, twice=twice), encoding="utf-8")
    found = import_log(raw)
    check(found)
    assert "gyroscope unit: deg/s (certain: the header says so" in found.summary()


@pytest.mark.parametrize(("name", "value"), [("fs", RATE), ("dt", 1 / RATE), ("sample_rate", RATE)])
def test_a_number_beside_arrays_is_their_rate(tmp_path, name, value):
    """100 rows a second were guessed."""
    arrays = {"accel_g": LOG.accel / G0, "gyro_dps": LOG.gyro / DEG, "mag_uT": LOG.mag, name: value}
    savemat(tmp_path / "log.mat", arrays)
    check(import_log(tmp_path / "log.mat"))


def test_the_rate_in_a_line_that_speaks_of_a_filter_too(tmp_path):
    """ActiGraph writes it: 100 rows a second were guessed, and the spin was twice what it was."""
    columns = [*three(["Accelerometer X", "Accelerometer Y", "Accelerometer Z"], LOG.accel / G0)]
    columns += three(["Gyroscope X", "Gyroscope Y", "Gyroscope Z"], LOG.gyro / DEG)
    columns += three(["Magnetometer X", "Magnetometer Y", "Magnetometer Z"], LOG.mag)
    raw = write_table(tmp_path / "log.csv", columns)
    first = f"------------ Data File Created By ActiGraph date format M/d/yyyy at {RATE:.0f} Hz  Filter Normal -----\n"
    raw.write_text(first + raw.read_text(encoding="utf-8"), encoding="utf-8")
    check(import_log(raw))
