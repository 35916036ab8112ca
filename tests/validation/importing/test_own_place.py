"""A log with a receiver's columns knows where it was made: that is said, and another --place is doubted."""

from __future__ import annotations

import sys
from datetime import date, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from support.made_logs import made_log

from discsim.environment import world_magnetic_field
from discsim.validation.cli import main
from discsim.validation.importing.imported_log import import_log

LOG = made_log()


def written(folder: Path, names: str, place: tuple[float, float]) -> Path:
    """Write a log with two columns of a receiver, which has no fix in its first second."""
    fix = np.where(LOG.t[:, None] < 1.0, 0.0, place)
    cells = np.column_stack([LOG.t, LOG.gyro, LOG.accel, LOG.mag, fix])
    raw = folder / "log.csv"
    rows = [",".join(f"{cell:.10g}" for cell in row) for row in cells]
    raw.write_text("\n".join([f"time_s,gx,gy,gz,ax,ay,az,mx,my,mz,{names}", *rows, ""]))
    return raw


@pytest.mark.parametrize(
    ("names", "place"),
    [
        ("lat,lon", (47.4, 8.5)),
        ("GPS_Latitude (deg),GPS_Longitude (deg)", (47.4, 8.5)),
        ("lat,lng", (474000000, 85000000)),
    ],
)
def test_where_a_log_says_that_it_was_made_is_told(tmp_path, names, place):
    log = import_log(written(tmp_path, names, place))
    (said,) = [note for note in log.notes if note.startswith("made at")]
    assert said.startswith("made at 47.4000,8.5000 (degrees north, east)")
    assert "# latitude_deg = 47.40000\n# longitude_deg = 8.50000\n" in log.map_text
    assert not [note for note in log.notes if note.startswith("not used")]


def test_zeros_and_what_is_no_place_say_nothing(tmp_path):
    for place in ((0.0, 0.0), (4724.1, 830.2)):
        assert not [note for note in import_log(written(tmp_path, "lat,lon", place)).notes if "made at" in note]


@pytest.mark.parametrize(("place", "doubted"), [("47.5,8.45", False), ("37.5,127.0", True)])
def test_another_place_is_doubted(tmp_path, monkeypatch, capsys, place, doubted):
    raw = written(tmp_path, "lat,lon", (47.4, 8.5))
    words = ["import", str(raw), "--out", str(tmp_path / "out"), "--place", place, "--date", "2023-05-01"]
    monkeypatch.setattr(sys, "argv", ["discsim", *words])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 0
    said = capsys.readouterr()
    assert ("km from where the log says that it was made, 47.4000,8.5000" in said.out + said.err) == doubted


@pytest.mark.parametrize(
    ("first", "day"),
    [("2026-05-01T12:00:00.000", "2026-05-01"), ("1777629600.000", "2026-05-01"), ("2041-05-01T12:00:00.000", "")],
)
def test_a_log_that_tells_its_place_and_its_day_has_the_field_where_a_model_does(tmp_path, first, day):
    raw = written(tmp_path, "lat,lon", (47.4, 8.5))
    head, *rows = raw.read_text().splitlines()
    begins = datetime.fromisoformat(first) if "T" in first else float(first)

    def stamp(row: str) -> str:
        t, _, rest = row.partition(",")
        at = begins + (timedelta(seconds=float(t)) if isinstance(begins, datetime) else float(t))
        return f"{at.isoformat(timespec='milliseconds') if isinstance(at, datetime) else f'{at:.3f}'},{rest}"

    raw.write_text("\n".join([head.replace("time_s", "time"), *map(stamp, rows), ""]))
    log = import_log(raw)
    (said,) = [note for note in log.notes if note.startswith("made at")]
    field = log.recordings[0].environment.magnetic_field
    assert ("latitude_deg = 47.40000\nlongitude_deg = 8.50000\ndate = 2026-05-01\n" in log.map_text) is bool(day)
    if day:
        assert said.endswith("on 2026-05-01 by its stamps: the field is that of the model")
        np.testing.assert_allclose(field, world_magnetic_field(47.4, 8.5, date(2026, 5, 1)), atol=1e-6)
    else:
        assert not np.any(field)
