"""Arrays that a program kept: MATLAB's .mat, numpy's .npy and .npz, as tables.

Arrays of one length are columns of one table: `acc` (n, 3) becomes acc_x, acc_y and acc_z, a structure's fields have
its name before theirs. A number `fs` or `dt` beside them stands above the table as its rate. Nothing in the file is
run: numpy's pickled objects and MATLAB's objects are left out.
"""

from __future__ import annotations

import re
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from discsim.errors import InputError
from discsim.validation.importing.sniffing.other_forms.written import (
    FEWEST,
    check_size,
    comma_separated,
    first_bytes,
    read_and_left,
    write_named,
)

__all__ = ["begins", "write_tables"]

_NPY, _MAT = b"\x93NUMPY", b"MATLAB 5.0 MAT-file"
#: Columns above which an array is none of a sensor's readings.
WIDEST = 40
#: Bytes of a file that is read whole.
MAX_BYTES = 1 << 30
_AXES = "xyz"
#: Names of a number of rows a second.
_RATE = re.compile(r"(?:^|_)fs(?:_?hz)?$|(?:sampl\w*|data|frame)[ _]?(?:rate|freq\w*)|^rate(?:_?hz)?$", re.IGNORECASE)


def begins(path: Path) -> bool:
    """Tell a file of arrays by its first bytes; a zip, by arrays alone that are in it."""
    head = first_bytes(path, len(_MAT))
    if head.startswith((_NPY, _MAT)):
        return True
    if not head.startswith(b"PK\x03\x04"):
        return False
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError, NotImplementedError):
        return False
    return bool(names) and all(name.endswith(".npy") for name in names)


def write_tables(raw: Path, target: Path) -> list[str]:
    """Write the arrays of a file as tables, and return what to say of them.

    Raises `InputError` for a damaged file, one that is too large and one without arrays of numbers.
    """
    check_size(raw, "a file of arrays", MAX_BYTES)
    try:
        found = dict(_arrays(_loaded(raw)))
    except Exception as error:  # whatever a parser of bytes stumbles on in a damaged file
        raise InputError.at(raw, None, f"is a damaged file of arrays ({error}); expected one that opens") from None
    columns = {name: array for name, array in found.items() if array.shape[0] >= FEWEST and array.shape[1] <= WIDEST}
    if not columns:
        raise InputError.at(
            raw,
            None,
            "is a file of arrays without columns of numbers in it (MATLAB's tables and objects cannot be read: write "
            "those by writetable, or writetimetable); expected arrays of one row per reading",
        )
    lengths = sorted({array.shape[0] for array in columns.values()}, reverse=True)
    tables = {rows: {name: array for name, array in columns.items() if array.shape[0] == rows} for rows in lengths}
    rate = _rate_line(found)
    write_named(target, {"-".join(table)[:80]: rate + _text(table) for table in tables.values()})
    read = "; ".join(f"{', '.join(table)} ({rows} rows)" for rows, table in tables.items())
    left = [name for name, array in found.items() if name not in columns and array.size > 1]
    return [read_and_left(raw, "a file of arrays", read, left)]


def _loaded(raw: Path) -> Mapping[str, Any]:
    if first_bytes(raw, len(_MAT)) == _MAT:
        from scipy.io import loadmat

        return {name: value for name, value in loadmat(raw, squeeze_me=False).items() if not name.startswith("__")}
    loaded = np.load(raw, allow_pickle=False)
    if isinstance(loaded, np.ndarray):
        return {"": loaded}
    with loaded:
        return {name: loaded[name] for name in loaded.files if loaded.zip.getinfo(f"{name}.npy").file_size <= MAX_BYTES}


def _arrays(value: Any, name: str = "") -> Iterator[tuple[str, np.ndarray[Any, Any]]]:
    """Yield the arrays (n, k) of numbers in a value with their names; one of more columns than rows is turned."""
    if isinstance(value, Mapping):
        for key, part in value.items():
            yield from _arrays(part, f"{name}_{key}" if name else str(key))
        return
    array = np.asarray(value)
    if array.dtype.names is not None:
        whole = array.reshape(-1)[0] if array.size == 1 else array
        yield from _arrays({field: whole[field] for field in array.dtype.names}, name)
    elif array.dtype.kind in "biuf" and array.size == 1:
        yield name, array.reshape(1, 1)
    elif array.dtype.kind in "biufM" and 1 <= array.ndim <= 2 and array.size > 1:
        table = array.reshape(-1, 1) if array.ndim == 1 else array
        yield name, table.T if table.shape[1] > table.shape[0] else table


def _text(table: Mapping[str, np.ndarray[Any, Any]]) -> str:
    """Return arrays (n, k) as columns; an array without a name makes numbers alone, as a table without a header."""
    names = [label for name, array in table.items() for label in _labels(name, array.shape[1])]
    columns = [_cells(array[:, k]) for array in table.values() for k in range(array.shape[1])]
    header = [names] if all(names) else []
    return comma_separated([*header, *zip(*columns, strict=True)])


def _rate_line(found: Mapping[str, np.ndarray[Any, Any]]) -> str:
    """Return a line above a table that states its rate, by a number that is called so; empty without one."""
    for name, array in found.items():
        value, last = float(array.flat[0]) if array.size == 1 else 0.0, name.rpartition("_")[2].casefold()
        if value > 0.0 and (_RATE.search(name) or last in ("dt", "ts")):
            return f"# Sampling rate: {1 / value if last in ('dt', 'ts') else value:.9g} Hz, by {name}\n"
    return ""


def _labels(name: str, width: int) -> list[str]:
    if width == 1 or not name:
        return [name] * width
    return [f"{name}_{_AXES[k] if width == len(_AXES) else k + 1}" for k in range(width)]


def _cells(column: np.ndarray[Any, Any]) -> list[str]:
    if column.dtype.kind == "M":
        return [str(cell) for cell in column]
    return ["" if cell != cell else repr(cell) for cell in column.tolist()]
