"""A decimal comma beside a comma between cells: numbers are broken, and no way to read them is right."""

from __future__ import annotations

from pathlib import Path

import pytest
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
NAMES = "t_ms,ax,ay,az,gx,gy,gz,mx,my,mz"


def rows(decimals: tuple[int, int, int]) -> list[list[str]]:
    """Return the cells of each row of a log whose sensors have so many decimals."""
    sensors = list(zip((LOG.accel / G0, LOG.gyro / DEG, LOG.mag), decimals, strict=True))
    return [
        [f"{1000 * t:.0f}", *(f"{x:.{places}f}" for value, places in sensors for x in value[k])]
        for k, t in enumerate(LOG.t)
    ]


def written(place: Path, cells: list[list[str]]) -> Path:
    raw = place / "log.csv"
    raw.write_text("\n".join([NAMES, *map(",".join, cells), ""]))
    return raw


@pytest.mark.parametrize("decimals", [(3, 2, 1), (4, 3, 2), (2, 2, 2)])
def test_numbers_that_their_own_mark_breaks_are_refused(tmp_path, decimals):
    """Whole parts and thousandths had been read as columns, and a unit was found for them."""
    raw = written(tmp_path, [[cell.replace(".", ",") for cell in row] for row in rows(decimals)])
    with pytest.raises(InputError, match=r"log.csv:2: has 19 cells for 10 names.*the decimal mark parts cells, too"):
        import_log(raw)


def test_cells_beyond_the_names_are_no_broken_numbers(tmp_path):
    raw = written(tmp_path, [[*row, f"{k % 10}", f"{k:04d}"] for k, row in enumerate(rows((3, 2, 1)))])
    assert set(import_log(raw).recordings[0].samples) == {"accelerometer", "gyroscope", "magnetometer"}
