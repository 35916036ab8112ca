"""Lines between marks, as firmware frames what it sends: the first and the last number are numbers all the same."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import ImportedLog, import_log
from discsim.validation.importing.sniffing.other_forms.framed_lines import begins

LOG = made_log()
START = "ets Jan  8 2013\nSD card ok\n"


def cells(k: int) -> list[str]:
    """Return milliseconds, g, deg/s and uT of a row."""
    values = [*LOG.accel[k] / G0, *LOG.gyro[k] / DEG, *LOG.mag[k]]
    return [f"{1000 * LOG.t[k]:.0f}", *(f"{x:.4f}" for x in values)]


def assert_read(found: ImportedLog) -> None:
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].t - samples["gyroscope"].t[0], LOG.t, atol=1e-9)
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-3)


@pytest.mark.parametrize(
    ("before", "separator", "behind"),
    [
        ("$", ",", "#"),
        ("<", ",", ">"),
        ("{", ";", "}"),
        ("*", "\t", ""),
        (">> ", " ", ""),
        ("IMU: ", ",", ""),
        ("", ",", ";"),
        ("$IMU,", ",", "*5A"),
        ("!DATA:", ", ", " !"),
    ],
)
def test_marks_about_a_line_take_no_number_away(tmp_path, before, separator, behind):
    """The accelerometer was found one column further on, in y, z and the gyroscope's x, and nothing was said."""
    raw = tmp_path / "log.txt"
    lines = [f"{before}{separator.join(cells(k))}{behind}" for k in range(LOG.t.size)]
    raw.write_text(START + "\n".join([*lines, ""]))
    assert_read(import_log(raw))


@pytest.mark.parametrize("end", ["\n", "\n\r"])
def test_a_line_of_names_loses_its_marks_as_well(tmp_path, end):
    raw = tmp_path / "log.txt"
    names = "$time_ms,ax,ay,az,gx,gy,gz,mx,my,mz#"
    lines = [names, *(f"${','.join(cells(k))}#" for k in range(LOG.t.size)), ""]
    raw.write_bytes(end.join(lines).encode())
    found = import_log(raw)
    assert_read(found)
    assert "log.txt: its lines stand between marks ('$' and '#'); they are taken off" in found.summary()


def test_the_stamps_of_a_serial_monitor_stand_before_the_marks(tmp_path):
    raw = tmp_path / "monitor.txt"
    raw.write_text("".join(f"14:03:{20 + LOG.t[k]:06.3f} -> <{','.join(cells(k)[1:])}>\n" for k in range(LOG.t.size)))
    assert_read(import_log(raw))


def test_the_colours_of_a_terminal_about_a_line_take_nothing_away(tmp_path):
    """ESP-IDF's log puts them before its stamp and behind the line: the rest of it was cut as many signs too early."""
    raw = tmp_path / "esp.txt"
    lines = [f"<{','.join(cells(k)[1:])}>" for k in range(LOG.t.size)]
    stamps = [f"I ({1000 * t:.0f}) imu: " for t in LOG.t]
    raw.write_text("".join(f"\x1b[0;32m{a}{b}\x1b[0m\n" for a, b in zip(stamps, lines, strict=True)))
    assert_read(import_log(raw))


def test_sensors_in_turn_behind_a_mark_are_records(tmp_path):
    """The attitude reference system for Razor boards prints counts as numbers with decimals."""
    raw = tmp_path / "razor.txt"
    razor = (LOG.accel / G0 * 256, LOG.mag * 10.9, LOG.gyro / DEG * 14.375)
    with raw.open("w") as stream:
        for rows in zip(*razor, strict=True):
            for letter, row in zip("AMG", rows, strict=True):
                stream.write(f"#{letter}-C={','.join(f'{x:.2f}' for x in row)}\r\n")
    found = import_log(raw)
    units = {one.what: one for one in found.decisions if one.what.endswith("unit")}
    assert units["accelerometer unit"].choice == "1/256 g a count"
    assert units["accelerometer unit"].sure == "guess"
    assert units["gyroscope unit"].why.startswith("beyond any gyroscope in deg/s")
    assert_allclose(found.recordings[0].samples["accelerometer"].value, LOG.accel, atol=1e-2)


@pytest.mark.parametrize("line", ["gx:1.0 gy:2.0 gz:3.0", "Accel: 0.1, 0.2, 9.8", "0.1,0.2,9.8,1.0", "1;2;3;4;"])
def test_names_before_cells_and_plain_rows_are_no_frame(tmp_path, line):
    raw = tmp_path / "log.txt"
    raw.write_text(f"{line}\n" * 40)
    assert not begins(raw)


def test_cells_with_units_need_no_line_of_names(tmp_path):
    """ "No rows of numbers in it", where every cell told its unit."""
    raw = tmp_path / "log.txt"
    units = ["ms", *["g"] * 3, *["dps"] * 3, *["uT"] * 3]
    rows = (", ".join(map(str.__add__, cells(k), units)) for k in range(LOG.t.size))
    raw.write_text("\n".join([*rows, ""]))
    assert_read(import_log(raw))
