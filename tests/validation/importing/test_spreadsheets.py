"""A log in a spreadsheet is read sheet by sheet; one that is damaged or has no reader is refused with what to do."""

from __future__ import annotations

import sys
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

pytest.importorskip("python_calamine", reason="the reader of spreadsheets comes with discsim[logs]")

LOG = made_log()
_MAIN = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_OF = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_PACKED = "http://schemas.openxmlformats.org/package/2006"


def workbook(path: Path, sheets: Mapping[str, Sequence[Sequence[object]]]) -> Path:
    """Write a workbook of Excel's with the least that one needs: texts and numbers in cells, by sheet."""

    def cell(value: object) -> str:
        if isinstance(value, str):
            return f'<c t="inlineStr"><is><t>{value}</t></is></c>'
        return f"<c><v>{value!r}</v></c>"

    numbered = list(enumerate(sheets, start=1))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        named = "".join(f'<sheet name="{name}" sheetId="{k}" r:id="r{k}"/>' for k, name in numbered)
        book = f'<workbook xmlns="{_MAIN}" xmlns:r="{_OF}"><sheets>{named}</sheets></workbook>'
        archive.writestr("xl/workbook.xml", book)
        links = "".join(f'<Relationship Id="r{k}" Type="{_OF}/worksheet" Target="worksheets/s{k}.xml"/>'
                        for k, _ in numbered)  # fmt: skip
        to_book = f'<Relationship Id="b" Type="{_OF}/officeDocument" Target="xl/workbook.xml"/>'
        archive.writestr("_rels/.rels", f'<Relationships xmlns="{_PACKED}/relationships">{to_book}</Relationships>')
        archive.writestr(
            "xl/_rels/workbook.xml.rels", f'<Relationships xmlns="{_PACKED}/relationships">{links}</Relationships>'
        )
        for k, name in numbered:
            rows = "".join(f"<row>{''.join(map(cell, row))}</row>" for row in sheets[name])
            archive.writestr(
                f"xl/worksheets/s{k}.xml", f'<worksheet xmlns="{_MAIN}"><sheetData>{rows}</sheetData></worksheet>'
            )
    return path


def rows(names: Sequence[str], *columns: np.ndarray) -> list[list[object]]:
    return [list(names), *np.column_stack([LOG.t, *columns]).tolist()]


ONE = rows(["Time (s)", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz"], LOG.gyro / DEG, LOG.accel / G0, LOG.mag)


def test_a_sheet_below_a_title_and_beside_notes_is_a_log(tmp_path):
    book = workbook(tmp_path / "log.xlsx", {"Throw 3": [["backhand"], [], *ONE], "Notes": [["windy", 3.0]]})
    found = import_log(book)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-9)
    assert_allclose(samples["magnetometer"].value[:, 2], LOG.mag[:, 2], atol=1e-9)
    assert "log.xlsx: a spreadsheet; read: Throw 3; not read: Notes" in found.summary()


@pytest.mark.parametrize("beside", [False, True])
def test_a_sheet_for_each_sensor_is_one_log_as_phyphox_exports_it(tmp_path, beside):
    """It is what the app offers first, and was refused."""
    units = {"Gyroscope": (LOG.gyro, "rad/s"), "Accelerometer": (LOG.accel, "m/s^2"), "Magnetometer": (LOG.mag, "uT")}
    sheets = {
        name: rows(["Time (s)", *(f"{axis} ({unit})" for axis in "XYZ")], value)
        for name, (value, unit) in units.items()
    }
    folder = tmp_path / "export"
    folder.mkdir()
    book = workbook(folder / "phyphox 2026-08-11.xlsx", {**sheets, "Metadata Device": [["version", "1.1.9"]]})
    (folder / "readme.txt").write_text("the third throw\n")
    samples = import_log(folder if beside else book).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-9)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-9)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-9)


def test_a_spreadsheet_without_a_log_is_refused(tmp_path):
    book = workbook(tmp_path / "plan.xlsx", {"Plan": [["what", "when"], ["throw", "Sunday"]]})
    with pytest.raises(InputError, match="is a spreadsheet without rows of numbers in it"):
        import_log(book)


def test_one_that_is_damaged_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "log.xlsx", "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook")
    old = tmp_path / "log.xls"
    old.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(500))
    for raw in (tmp_path / "log.xlsx", old):
        with pytest.raises(InputError, match=r"is a damaged spreadsheet .*; expected one that opens"):
            import_log(raw)


def test_without_its_reader_the_remedies_are_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "python_calamine", None)
    with pytest.raises(InputError, match=r'pip install "discsim\[logs\]", or save it as CSV'):
        import_log(workbook(tmp_path / "log.xlsx", {"Throw": ONE}))
