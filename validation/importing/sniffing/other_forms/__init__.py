"""Files that are no table of text as loggers write it, rewritten as one.

A form is a module that tells such a file by its beginning (`begins`) and writes it as comma-separated text, or as a
folder of several (`write_tables`), and returns what to say of it. `writer_of` chooses.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from discsim.validation.importing.sniffing.other_forms import (
    array_file,
    database,
    folded_records,
    framed_lines,
    headed_lines,
    html_tables,
    json_records,
    labview,
    line_protocol,
    motion_capture,
    pair_cells,
    quoted_cells,
    record_kinds,
    ros_echo,
    sections,
    split_seconds,
    spreadsheet,
    teleplot,
    unit_cells,
    value_rows,
)

__all__ = ["writer_of"]

_FORMS = (
    json_records,
    labview,
    spreadsheet,
    array_file,
    database,
    html_tables,
    line_protocol,
    motion_capture,
    value_rows,
    teleplot,
    ros_echo,
    split_seconds,
    record_kinds,
    headed_lines,
    folded_records,
    sections,
    framed_lines,
    quoted_cells,
    unit_cells,
    pair_cells,
)
#: What a table of another form may be once more: a row for each value, or cells with quotes, units or two numbers.
_AGAIN = (value_rows, quoted_cells, unit_cells, pair_cells)


def writer_of(path: Path, *, again: bool = False) -> Callable[[Path, Path], list[str]] | None:
    """Return what writes a file as tables and says what it did; None where it is a table as it is.

    ``again``: the file was written by another form.
    """
    return next((form.write_tables for form in (_AGAIN if again else _FORMS) if form.begins(path)), None)
