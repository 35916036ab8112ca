"""Logs of hours: cells are held packed, columns of any kind, and lines are read as they are asked for."""

import tracemalloc

import numpy as np
import pytest

from discsim.validation.importing.cell_texts import CellTexts, number, packed
from discsim.validation.importing.raw_table import REPAIRS, Layout, RepairList, read_raw
from discsim.validation.importing.text_lines import TextLines

ODD = ("", "nan", "-1.5e3", "1_000", "1e999", "x", "µ", "  ", "0x10", "١", "+.5", "1.", "inf", "#NUM!", "1\0", "3,5")


@pytest.mark.parametrize("decimal", [".", ","])
def test_a_packed_column_reads_each_cell_as_one_alone_is_read(decimal):
    plain = [f"{k / 7:.4f}".replace(".", decimal) for k in range(1000)]
    for odd in (plain, plain + list(ODD), ["7", "", "8"], ["1_0", "2"], ["long" * 30, "1"]):
        column = CellTexts.joined([packed(odd[: len(odd) // 2]), packed(odd[len(odd) // 2 :])])
        assert list(column) == odd
        assert [column[k] for k in range(len(odd))] == odd
        value, wrong = column.numbers(decimal)
        alone = [number(cell, decimal) for cell in odd]
        np.testing.assert_array_equal(wrong, [one is None for one in alone])
        np.testing.assert_array_equal(value, [np.nan if one is None else one for one in alone])
        for text in ("", "µ", odd[0]):
            np.testing.assert_array_equal(column.equal(text), [cell == text for cell in odd])


def test_the_different_cells_of_a_column_come_in_their_order_or_not_at_all_where_there_are_many():
    column = CellTexts(packed(["mag", "acc", "mag", "gyr"] * 50_000))
    assert column.few(3) == ("mag", "acc", "gyr")
    assert column.few(2) is None


def row(k: int) -> str:
    return ",".join([str(k), *(f"{np.sin(k * j):.4f}" for j in range(1, 10))])


def test_a_log_takes_as_much_memory_as_its_cells_have_signs(tmp_path):
    """As strings of Python's ten cells and their list take 800 bytes a row, and an hour at 1 kHz 3 GB."""
    path, rows = tmp_path / "log.csv", 60_000
    path.write_text("\n".join(["t," + ",".join(f"c{j}" for j in range(9)), *map(row, range(rows)), ""]))
    tracemalloc.start()
    table = read_raw(path, Layout(), RepairList(REPAIRS))
    held, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(table) == rows
    assert table.cells(rows - 1) == row(rows - 1).split(",")
    assert held < 110 * rows  # ten cells of up to seven signs, two numbers of its place
    assert most < 250 * rows + 30e6  # and a block of lines while it is read


def test_rows_that_are_read_at_once_are_those_that_are_read_one_by_one(tmp_path):
    """A quote in a block, blanks about cells, a short row: the block's lines are then looked at one by one."""
    lines = ["t,a,b,c,d,e,f,g,h,i", *map(row, range(50_000))]
    plain, odd = tmp_path / "plain.csv", tmp_path / "odd.csv"
    plain.write_text("\n".join(lines) + "\n")
    odd.write_text(
        "\r\n".join([lines[0], *(f'"{line.replace(",", " , ", 1)}'.replace(" ,", '" ,') for line in lines[1:])])
    )
    read = read_raw(plain, Layout(), RepairList(REPAIRS))
    spelled = read_raw(odd, Layout(), RepairList(REPAIRS))
    assert read.columns == spelled.columns
    for one, other in zip(read.texts, spelled.texts, strict=True):
        assert np.array_equal(one.cells, other.cells)
    lines[40_000], lines[45_000] = "1,2,3", ""
    plain.write_text("\n".join(lines))
    repairs = RepairList(REPAIRS)
    left = read_raw(plain, Layout(), repairs)
    assert [(one.line, one.action) for one in repairs.listed()] == [(40_001, "row left out"), (45_001, "line left out")]
    assert left.total == len(read) - 1  # a blank line has no number
    assert (len(left), int(left.line[-1]), int(left.number[-1])) == (len(read) - 2, len(lines), left.total - 1)


def test_lines_that_end_twice_are_one_repair_and_a_few_blank_ones_are_listed_each(tmp_path):
    """Arduino programs write LF CR: 1001 repairs of one log hid the one that mattered."""
    path = tmp_path / "log.csv"
    path.write_bytes("\n\r".join(["t,a,b,c,d,e,f,g,h,i", *map(row, range(300)), ""]).encode())
    repairs = RepairList(())
    assert len(read_raw(path, Layout(), repairs)) == 300
    assert [(one.line, one.action) for one in repairs.listed()] == [(2, "lines left out")]
    path.write_text("\n".join(["t,a,b,c,d,e,f,g,h,i", *map(row, range(300)), "", row(300), "", ""]))
    repairs = RepairList(())
    assert len(read_raw(path, Layout(), repairs)) == 301
    assert [(one.line, one.what) for one in repairs.listed()] == [(302, "blank line"), (304, "blank line")]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "cp932", "latin-1"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_are_those_of_the_whole_text_wherever_a_piece_of_it_ends(tmp_path, encoding, end, monkeypatch):
    monkeypatch.setattr("discsim.validation.importing.text_lines.PIECE", 7)
    text = end.join(
        ["time,加速度" if encoding == "cp932" else "time,°/s", "", "1,2", "µ" if encoding != "cp932" else "角", ""]
    )
    path = tmp_path / "log.csv"
    path.write_bytes(text.encode(encoding))
    lines = TextLines(path, encoding)
    assert list(lines) == text.split(end)
    assert lines.count == 5
    assert [lines.find(k) for k in range(6)] == [*text.split(end), None]
