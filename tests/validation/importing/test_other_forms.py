"""Arrays that a program kept, a data base, InfluxDB's points and cells with their units are read as tables."""

from __future__ import annotations

import errno
import gzip
import pickle
import sqlite3
import tarfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.io import savemat
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
MS = (1000 * LOG.t).round().astype(int)
SENSORS = {"acc": (LOG.accel / G0).round(4), "gyro": (LOG.gyro / DEG).round(3), "mag": LOG.mag.round(2)}
ARRAYS = {"t": LOG.t, **SENSORS}
NAMES = [f"{name}_{axis}" for name in SENSORS for axis in "xyz"]
ROWS = [(int(ms), *row) for ms, row in zip(MS, np.column_stack(list(SENSORS.values())).tolist(), strict=True)]
UNITS = [unit for unit in ("g", "deg/s", "uT") for _ in "xyz"]
HEADER = ["time (ms)", *(f"{name} ({unit})" for name, unit in zip(NAMES, UNITS, strict=True))]


def a_data_base(path: Path) -> None:
    with closing(sqlite3.connect(path)) as base:
        columns = ", ".join(f"{name} REAL" for name in NAMES)
        base.execute(f"CREATE TABLE readings (time_ms INTEGER, {columns})")
        base.executemany(f"INSERT INTO readings VALUES ({', '.join('?' * 10)})", ROWS)
        base.execute("CREATE TABLE device (name TEXT)")
        base.commit()


def points(path: Path) -> None:
    lines = ["# throws of a Sunday"]
    for ms, *row in ROWS:
        fields = ",".join(f"{name}={value}" for name, value in zip(NAMES, row, strict=True))
        lines.append(rf"imu\ 1,disc=red,hand=left {fields},count=3i {1640207340 * 10**9 + ms * 10**6}")
    path.write_text("\n".join([*lines, "imu gx=broken", ""]), encoding="utf-8")


def points_by_sensor(path: Path) -> None:
    lines = [
        f"{sensor} x={x},y={y},z={z} {1640207340 * 10**6 + ms * 1000}"
        for sensor, value in SENSORS.items()
        for ms, (x, y, z) in zip(MS, value.tolist(), strict=True)
    ]
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def with_units(gap: str, separator: str, encoding: str = "utf-8") -> Callable[[Path], None]:
    def write(path: Path) -> None:
        units = [unit.replace("deg", "°") if encoding != "utf-8" else unit for unit in ("ms", *UNITS)]
        lines = [separator.join(["Time", *NAMES])]
        for row in ROWS:
            lines.append(separator.join(f"{cell}{gap}{unit}" for cell, unit in zip(row, units, strict=True)))
        path.write_text("\n".join([*lines, ""]), encoding=encoding)

    return write


def quoted(before: str, after: str, separator: str = ",", decimal: str = ".") -> Callable[[Path], None]:
    def write(path: Path) -> None:
        names = [f'="{name}"' if before == '="' else name for name in HEADER]
        lines = [separator.join(f"{before}{cell}{after}".replace(".", decimal) for cell in row) for row in ROWS]
        path.write_text("\n".join([separator.join(names), *lines, ""]), encoding="utf-8")

    return write


def a_page(path: Path) -> None:
    """As a microcontroller writes one: end tags of rows and cells left out, a table of settings before the log."""
    head = "".join(f"<th>{name}" for name in HEADER)
    rows = "\n".join("<tr>" + "".join(f"<td> {cell}" for cell in row) for row in ROWS)
    settings = "<table><tr><td>range<td>2000 <b>dps</b></table><script>var t = '<td>1';</script>"
    page = f"<!DOCTYPE html>\n<html><body><h1>Disc</h1>{settings}\n<table border=1><tr>{head}\n{rows}</table></html>"
    path.write_text(page, encoding="utf-8")


def in_a_structure() -> dict[str, object]:
    return {"log": {"time": LOG.t, "imu": {name: value.T for name, value in SENSORS.items()}}, "note": "backhand"}


def packed(path: Path) -> None:
    lines = [",".join(HEADER), *(",".join(map(str, row)) for row in ROWS), ""]
    path.write_bytes(gzip.compress("\n".join(lines).encode()))


def printed_arrays(path: Path) -> None:
    """As numpy prints them, with blanks between numbers, under a name for seconds of the minute."""
    lines = ["second acc[g] gyro[deg/s] mag[uT]"]
    lines += [f"{ms / 1000:.3f} [{a} {b} {c}] [ {d} {e} {f}] [{g} {h} {i} ]" for ms, a, b, c, d, e, f, g, h, i in ROWS]
    path.write_text("\n".join([*lines, ""]))


FORMS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "MATLAB": ("log.mat", lambda path: savemat(path, ARRAYS)),
    "MATLAB, a structure with axes in rows": ("log.mat", lambda path: savemat(path, in_a_structure())),
    "numpy, one array": ("log.npy", lambda path: np.save(path, np.column_stack(list(ARRAYS.values())))),
    "numpy, several": ("log.npz", lambda path: np.savez(path, **ARRAYS)),
    "numpy, packed": ("log.npz", lambda path: np.savez_compressed(path, **ARRAYS, device=np.array(["red"]))),
    "numpy, records": ("log.npy", lambda path: np.save(path, np.rec.fromrecords(ROWS, names=["time_ms", *NAMES]))),
    "SQLite": ("log.db", a_data_base),
    "line protocol": ("log.lp", points),
    "line protocol, a measurement for each sensor": ("log.txt", points_by_sensor),
    "units in the cells": ("log.csv", with_units(" ", ",")),
    "units glued to numbers": ("log.txt", with_units("", "\t")),
    "formulas": ("log.csv", quoted('="', '"')),
    "formulas with decimal commas": ("log.csv", quoted('="', '"', ";", ",")),
    "apostrophes": ("log.csv", quoted("'", "")),
    "quoted by apostrophes": ("log.txt", quoted("'", "'", "\t")),
    "a web page": ("log.html", a_page),
    "gzip": ("log.csv.gz", packed),
    "gzip without its ending": ("log.csv", packed),
    "arrays as they are printed": ("log.txt", printed_arrays),
    "units with a degree sign": ("log.csv", with_units(" ", ";", "cp1252")),
}


@pytest.mark.parametrize("form", FORMS)
def test_a_log_in_another_form_is_read_as_a_table(tmp_path, form):
    name, write = FORMS[form]
    write(tmp_path / name)
    samples = import_log(tmp_path / name).recordings[0].samples
    assert_allclose(samples["gyroscope"].t - samples["gyroscope"].t[0], LOG.t - LOG.t[0], atol=1e-3)
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-3 * DEG)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-4 * G0)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=0.01)


def test_what_was_read_and_what_was_not_is_said(tmp_path):
    a_data_base(tmp_path / "log.db")
    points(tmp_path / "log.lp")
    savemat(tmp_path / "log.mat", {**ARRAYS, "gains": np.ones((2, 2))})
    with_units(" ", ",")(tmp_path / "log.csv")
    said = {name: import_log(tmp_path / name).summary() for name in ("log.db", "log.lp", "log.mat", "log.csv")}
    assert "log.db: a data base; read: readings; not read: device" in said["log.db"]
    assert f"read as a table of its points: {LOG.t.size} of imu 1,disc=red,hand=left" in said["log.lp"]
    assert "log.lp: 1 lines that are no point are LEFT OUT" in said["log.lp"]
    assert "not read: gains" in said["log.mat"]
    assert "units stand in its cells (ms, g, deg/s, uT); moved to the names of the columns" in said["log.csv"]


def test_registers_in_hex_are_read_as_counts(tmp_path):
    """16 bits of each axis as they stand in the chip, their signs among them."""
    counts = np.hstack([np.round(LOG.accel / G0 * 2048), np.round(LOG.gyro / DEG * 10)]).astype(int) % 65536
    lines = [
        f"{ms}," + ",".join(f"0x{count:04X}" for count in row) for ms, row in zip(MS, counts.tolist(), strict=True)
    ]
    names = ",".join(["ms", *(f"{name}{axis}" for name in "ag" for axis in "xyz")])
    (tmp_path / "log.csv").write_text("\n".join([names, *lines, ""]), encoding="utf-8")
    found = import_log(tmp_path / "log.csv")
    assert "log.csv: numbers stand in its cells as formulas, with apostrophes or in hex" in found.summary()
    assert_allclose(found.recordings[0].samples["accelerometer"].value, LOG.accel, atol=0.6 / 2048 * G0 + 1e-9)


def test_of_a_page_is_said_which_tables_hold_no_log(tmp_path):
    a_page(tmp_path / "log.html")
    assert "log.html: a web page; read: table 2; not read: table 1" in import_log(tmp_path / "log.html").summary()


def test_a_cell_with_another_unit_is_no_number(tmp_path):
    with_units(" ", ",")(tmp_path / "log.csv")
    lines = (tmp_path / "log.csv").read_text(encoding="utf-8").split("\n")
    lines[90] = lines[90].replace(" g,", " m,", 1)
    (tmp_path / "log.csv").write_text("\n".join(lines), encoding="utf-8")
    found = import_log(tmp_path / "log.csv")
    assert len(found.recordings[0].samples["accelerometer"].t) == LOG.t.size - 1


def pickled(path: Path) -> None:
    path.write_bytes(pickle.dumps(ROWS, protocol=4) * 3)


REFUSED: dict[str, tuple[str, Callable[[Path], object], str]] = {
    "objects": ("log.npy", lambda path: np.save(path, np.array([{}, {}]), allow_pickle=True), "a damaged file of arr"),
    "cut off": ("log.mat", lambda path: path.write_bytes(b"MATLAB 5.0 MAT-file, made"), "a damaged file of arrays"),
    "no columns": ("log.mat", lambda path: savemat(path, {"gain": np.ones((2, 3))}), "writetimetable"),
    "MATLAB 7.3": ("log.mat", lambda path: path.write_bytes(b"MATLAB 7.3 MAT-file" + bytes(600)), "'-v7'"),
    "a pickle": ("log.pkl", pickled, "may run anything"),
    "a data base of notes": ("log.db", lambda path: notes(path), "without rows of numbers"),
    "a page without a table": ("log.html", lambda path: path.write_text("<html><p>403 Forbidden"), "without a table"),
    "a broken data base": ("log.db", lambda path: path.write_bytes(b"SQLite format 3\0" + bytes(90)), "a damaged SQL"),
}


def notes(path: Path) -> None:
    with closing(sqlite3.connect(path)) as base:
        base.execute("CREATE TABLE notes (name TEXT)")
        base.commit()


def test_xml_with_tables_is_no_web_page(tmp_path):
    """As Excel of 2003 writes it."""
    (tmp_path / "log.xml").write_text('<?xml version="1.0"?>\n<Workbook><Table><Row/></Table></Workbook>\n' * 9)
    with pytest.raises(InputError, match="XML"):
        import_log(tmp_path / "log.xml")


@pytest.mark.parametrize("form", REFUSED)
def test_what_holds_no_log_is_refused_with_what_to_do(tmp_path, form):
    name, write, said = REFUSED[form]
    write(tmp_path / name)
    with pytest.raises(InputError, match=said):
        import_log(tmp_path / name)


def test_forms_beside_one_another_are_one_log(tmp_path):
    """A folder with a file for each sensor, each in a form of its own."""
    folder = tmp_path / "throw"
    folder.mkdir()
    np.savez(folder / "gyroscope.npz", t=LOG.t, gyro=LOG.gyro / DEG)
    savemat(folder / "magnetometer.mat", {"t": LOG.t, "mag": LOG.mag})
    samples = import_log(folder).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-9)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-9)


@pytest.mark.parametrize("end", ["\r", "\r\n"])
def test_units_in_cells_are_moved_whatever_ends_a_line(tmp_path, end):
    with_units(" ", ",")(tmp_path / "log.csv")
    raw = tmp_path / "log.csv"
    raw.write_bytes(raw.read_bytes().replace(b"\n", end.encode()))
    assert_allclose(import_log(raw).recordings[0].samples["gyroscope"].value, LOG.gyro, atol=1e-3 * DEG)


def test_a_gzip_that_is_cut_and_one_of_many_files_are_refused(tmp_path):
    packed(tmp_path / "log.csv.gz")
    (tmp_path / "cut.csv.gz").write_bytes((tmp_path / "log.csv.gz").read_bytes()[:3000])
    with tarfile.open(tmp_path / "logs.tar.gz", "w:gz") as archive:
        archive.add(tmp_path / "log.csv.gz", "log.csv.gz")
    with pytest.raises(InputError, match=r"cut\.csv\.gz: cannot be unpacked .*expected a whole file of gzip"):
        import_log(tmp_path / "cut.csv.gz")
    with pytest.raises(InputError, match=r"logs\.tar\.gz: is a tar archive in gzip; unpack it first"):
        import_log(tmp_path / "logs.tar.gz")


def test_a_file_that_may_not_be_read_is_told(tmp_path, monkeypatch):
    raw, as_before = tmp_path / "log.csv", Path.open
    packed(raw)

    def refused(path: Path, *how: object, **more: object) -> object:
        if path == raw:
            raise PermissionError(errno.EACCES, "Permission denied")
        return as_before(path, *how, **more)

    monkeypatch.setattr(Path, "open", refused)
    with pytest.raises(InputError, match=r"log\.csv: cannot be read \(Permission denied\)"):
        import_log(tmp_path / "log.csv")
