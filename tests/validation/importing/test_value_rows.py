"""A row for each value (`time,name,value`), as databases and brokers write: read as records."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.archive import opened

LOG = made_log()
NAMES = ["ax", "ay", "az", "gx", "gy", "gz"]
CELLS = np.column_stack([LOG.accel / G0, LOG.gyro / DEG])


def values(apart: float = 0.0):
    """Yield the time (s), the name and the value of every reading in the order in which they came."""
    for t, row in zip(LOG.t, CELLS, strict=True):
        for k, (name, cell) in enumerate(zip(NAMES, row, strict=True)):
            yield t + k * apart, name, f"{cell:.5f}"


@pytest.mark.parametrize(("separator", "point"), [(",", "."), (";", "."), ("\t", "."), (";", ",")])
def test_values_at_one_time_are_a_record(tmp_path, separator, point):
    raw = tmp_path / "log.csv"
    lines = [f"{t:.4f}{separator}{name}{separator}{cell}".replace(".", point) for t, name, cell in values()]
    raw.write_text("\n".join([separator.join(["time_s", "name", "value"]), *lines, ""]))
    log = import_log(raw)
    read = log.recordings[0].samples["gyroscope"]
    assert_allclose(read.t, LOG.t, atol=1e-4)
    assert_allclose(np.abs(read.value[:, 2]), np.abs(LOG.gyro[:, 2]), atol=1e-4)
    assert f"a row for each value of {', '.join(NAMES)}: 12000 rows are 2000 records" in log.summary()


def test_what_influxdb_exports_with_its_remarks_is_read(tmp_path):
    """The points of each field stand below one another, between lines that say what the columns are."""
    raw = tmp_path / "query.csv"
    lines = ["#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,double,string,string", "#default,_result,,,,,,"]
    lines += [",result,table,_start,_time,_value,_field,_measurement"]
    for k, name in enumerate("xyzxyz"):
        of = ("accelerometer", "gyroscope")[k // 3]
        for t, row in zip(LOG.t, CELLS, strict=True):
            time = f"2025-06-01T12:00:{t:09.6f}Z"
            lines.append(f",,{k},2025-06-01T11:00:00Z,{time},{row[k]:.5f},{name},{of}")
    raw.write_text("\r\n".join([*lines, ""]))
    read = import_log(raw).recordings[0].samples
    assert_allclose(read["gyroscope"].t, LOG.t, atol=1e-5)
    assert_allclose(np.abs(read["gyroscope"].value[:, 2]), np.abs(LOG.gyro[:, 2]), atol=1e-4)
    assert_allclose(np.linalg.norm(read["accelerometer"].value, axis=1), np.linalg.norm(LOG.accel, axis=1), atol=1e-3)


def test_what_a_broker_sends_each_at_its_own_time_is_a_record_until_a_topic_comes_again(tmp_path):
    raw = tmp_path / "broker.jsonl"
    sent = [{"ts": round(1.7e9 + t, 6), "topic": f"disc/imu/{name}", "payload": float(cell)}
            for t, name, cell in values(apart=3e-4)]  # fmt: skip
    raw.write_text("\n".join(map(json.dumps, sent)))
    read = import_log(raw).recordings[0].samples["gyroscope"]
    assert_allclose(read.t, LOG.t, atol=1e-5)
    assert_allclose(np.abs(read.value[:, 2]), np.abs(LOG.gyro[:, 2]), atol=1e-4)


def test_a_value_that_is_missing_is_a_gap_and_takes_none_of_the_next_record(tmp_path):
    raw = tmp_path / "log.csv"
    lines = [f"{t:.4f},{name},{cell}" for t, name, cell in values()]
    del lines[6 * 700 + 5]  # gz of a record in the throw
    raw.write_text("\n".join(["time_s,name,value", *lines, ""]))
    read = import_log(raw).recordings[0].samples["gyroscope"]
    here = np.isfinite(read.value[:, 2])
    at = np.searchsorted(LOG.t, read.t[here] - 1e-6)
    assert_allclose(np.abs(read.value[here, 2]), np.abs(LOG.gyro[at, 2]), atol=1e-4)
    assert 700 not in at


@pytest.mark.parametrize("header", ["time_s,name,state", "time_s,sensor,x,y,z", "row,name,value"])
def test_another_table_is_left_as_it_is(tmp_path, header):
    raw = tmp_path / "log.csv"
    cells = "0.5" if header.count(",") == 2 else "0.1,0.2,9.8"
    name = "gx" if header.count(",") == 2 else "accelerometer"
    raw.write_text("\n".join([header, *(f"{k},{name},{cells}" for k in range(100)), ""]))
    with opened(raw) as logged:
        assert logged == raw
