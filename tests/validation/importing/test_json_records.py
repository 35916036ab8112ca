"""Logs of JSON (a record a line, a list of them, a list for each sensor, columns) are read as tables of records."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from typing import Any

import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
ROWS = list(zip((1000 * LOG.t).round().astype(int).tolist(), (LOG.gyro / DEG).round(3).tolist(),
                (LOG.accel / G0).round(4).tolist(), LOG.mag.round(2).tolist(), strict=True))  # fmt: skip
NESTED = [
    {"ms": t, "gyro": dict(zip("xyz", gyro, strict=True)), "accel": dict(zip("xyz", accel, strict=True)), "mag": mag}
    for t, gyro, accel, mag in ROWS
]
KINDS = ("gyroscope", "accelerometer", "magnetometer")
LONG = [
    {"sensor": kind, "time_ms": t, **dict(zip("xyz", map(str, value), strict=True))}
    for t, *values in ROWS
    for kind, value in zip(KINDS, values, strict=True)
]
COLUMNS = {"time_ms": [t for t, *_ in ROWS]} | {
    f"{kind}_{axis}": [row[1 + k][j] for row in ROWS] for k, kind in enumerate(KINDS) for j, axis in enumerate("xyz")
}


def lines(records: list[Any]) -> str:
    return "\n".join([*map(json.dumps, records), ""])


FORMS: dict[str, Callable[[], str]] = {
    "a record a line": lambda: lines(NESTED),
    "a list": lambda: json.dumps(NESTED),
    "a list, indented": lambda: json.dumps(NESTED, indent=2),
    "a list under a heading": lambda: json.dumps({"device": "disc-3", "session": {"hz": 200}, "data": NESTED}),
    "dictionaries as Python prints them": lambda: "\n".join(map(str, NESTED)),
    "lists of a time and an object": lambda: json.dumps(
        [[t, {"g": dict(zip("xyz", gyro, strict=True)), "a": accel, "m": mag}] for t, gyro, accel, mag in ROWS],
        indent=2,
    ),
    "a list of a time and objects a line": lambda: lines(
        [[str(t), {"gyro": gyro}, {"accel": accel}, {"mag": mag}] for t, gyro, accel, mag in ROWS]
    ),
    "a row for each sensor": lambda: json.dumps(LONG),
    "messages of several rows": lambda: lines(
        [{"id": k, "payload": LONG[k : k + 60]} for k in range(0, len(LONG), 60)]
    ),
    "a list for each sensor": lambda: json.dumps({kind: [r for r in LONG if r["sensor"] == kind] for kind in KINDS}),
    "columns": lambda: json.dumps(COLUMNS),
    "columns as pandas writes them": lambda: json.dumps(
        {name: {str(row): value for row, value in enumerate(column)} for name, column in COLUMNS.items()}
    ),
    "rows under the names of their columns": lambda: json.dumps(
        {"columns": [*COLUMNS], "data": [list(row) for row in zip(*COLUMNS.values(), strict=True)]}
    ),
    "rows beside a header with their names": lambda: json.dumps(
        {"header": {"hz": 200, "names": [*COLUMNS]}, "samples": list(zip(*COLUMNS.values(), strict=True))}
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_log_is_the_same_in_each_form(tmp_path, form):
    raw = tmp_path / "log.json"
    raw.write_text(FORMS[form]())
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)
    assert_allclose(samples["accelerometer"].value[:, 0], LOG.accel[:, 0], atol=1e-3)
    assert "magnetometer" in samples
    assert "log.json: JSON, read as a table of its records" in found.summary()
    assert len(found.throws) == 1


def columns_of_each(every_mag: int) -> dict[str, dict[str, list[float]]]:
    """Return a log as columns under each sensor's name, the magnetometer at fewer rows."""
    parts = {kind: ROWS[:: every_mag if kind == "magnetometer" else 1] for kind in KINDS}
    return {
        kind: {"t": [row[0] for row in rows]} | {axis: [row[1 + k][j] for row in rows] for j, axis in enumerate("xyz")}
        for k, (kind, rows) in enumerate(parts.items())
    }


def one_clock_for_two() -> dict[str, Any]:
    columns = columns_of_each(2)
    time = columns["gyroscope"].pop("t")
    assert columns["accelerometer"].pop("t") == time
    return {**columns, "time_ms": time}


OWN_RATES: dict[str, Callable[[], Any]] = {
    "columns": lambda: columns_of_each(2),
    "rows of t, x, y, z": lambda: {
        kind: list(zip(*columns.values(), strict=True)) for kind, columns in columns_of_each(2).items()
    },
    "one clock for two of them": one_clock_for_two,
}


@pytest.mark.parametrize("form", OWN_RATES)
def test_sensors_of_unlike_rates_in_one_object_are_a_table_each(tmp_path, form):
    raw = tmp_path / "log.json"
    raw.write_text(json.dumps({"device": "disc-3", **OWN_RATES[form]()}))
    samples = import_log(raw).recordings[0].samples
    assert {*samples} == set(KINDS)
    assert samples["gyroscope"].t.size == len(ROWS)
    assert samples["magnetometer"].t.size == (len(ROWS) + 1) // 2
    assert_allclose(samples["magnetometer"].t[:9], LOG.t[:18:2], atol=1e-6)


LISTS = [[t, *gyro, *accel, *mag] for t, gyro, accel, mag in ROWS]


@pytest.mark.parametrize(
    "text",
    [json.dumps(LISTS), json.dumps(LISTS, indent=1), lines(LISTS)],
    ids=["one line", "indented", "a list a line"],
)
def test_lists_of_numbers_in_a_list_are_a_table_without_names(tmp_path, text):
    raw = tmp_path / "log.json"
    raw.write_text(text)
    samples = import_log(raw).recordings[0].samples
    assert {*samples} == set(KINDS)
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)


@pytest.mark.parametrize(
    "before",
    ["2025-06-01 14:03:{:06.3f} ", "[2025-06-01T14:03:{:06.3f}] imu: ", "14:03:{:06.3f} -> ", "{:.3f},", "{:.3f}: "],
)
@pytest.mark.parametrize("printed", [json.dumps, str])
def test_a_time_before_each_record_is_its_time(tmp_path, before, printed):
    """It was lost, and the rows were taken as 0.01 s apart."""
    raw = tmp_path / "log.txt"
    told = [{key: value for key, value in one.items() if key not in ("ms", "mag")} for one in NESTED]
    raw.write_text("".join(f"{before.format(t)}{printed(one)}\n" for t, one in zip(LOG.t, told, strict=True)))
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)


def test_a_record_s_own_time_stands_against_one_before_it(tmp_path):
    """A receiver's program prints when a record came in, in lumps."""
    raw = tmp_path / "log.txt"
    raw.write_text(
        "".join(
            f"14:03:{20 + t // 500 / 2:04.1f} {json.dumps(one)}\n" for (t, *_), one in zip(ROWS, NESTED, strict=True)
        )
    )
    assert_allclose(import_log(raw).recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)


@pytest.mark.parametrize("whole", [True, False])
def test_several_samples_of_a_message_are_a_row_each(tmp_path, whole):
    """Of Movesense's four samples a message one was read, or all of them without a time."""
    messages = []
    for k in range(0, len(ROWS), 4):
        lists = [[dict(zip("xyz", row[place], strict=True)) for row in ROWS[k : k + 4]] for place in (1, 2, 3)]
        names = ("ArrayGyro", "ArrayAcc", "ArrayMagn")
        messages.append({"Body": {"Timestamp": ROWS[k][0], **dict(zip(names, lists, strict=True))}, "Uri": "IMU9"})
    raw = tmp_path / "log.json"
    raw.write_text(json.dumps({"data": messages}) if whole else lines(messages))
    samples = import_log(raw).recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-4)
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-4)


def test_messages_of_one_sensor_each_keep_their_own_rows(tmp_path):
    """As Movesense sends them where each sensor was asked for by itself: both have the same stamps."""
    messages = []
    for k in range(0, len(ROWS), 4):
        for place, name in ((1, "ArrayGyro"), (2, "ArrayAcc")):
            samples = [dict(zip("xyz", row[place], strict=True)) for row in ROWS[k : k + 4]]
            messages.append({"Body": {"Timestamp": ROWS[k][0], name: samples}})
    raw = tmp_path / "log.json"
    raw.write_text(lines(messages))
    samples = import_log(raw).recordings[0].samples
    for sensor, truth, tolerance in (("gyroscope", LOG.gyro, 1e-4), ("accelerometer", LOG.accel, 1e-3)):
        assert_allclose(samples[sensor].value, truth, atol=tolerance)
        assert_allclose(samples[sensor].t, LOG.t, atol=1e-4)


def test_lists_may_have_names_in_the_first_and_break_off(tmp_path):
    whole = json.dumps([[*COLUMNS], *LISTS])
    raw = tmp_path / "log.json"
    raw.write_text(whole[: len(whole) - 20])
    found = import_log(raw)
    assert found.recordings[0].samples["accelerometer"].t.size == len(ROWS) - 1
    raw.write_text(json.dumps([[*COLUMNS], *LISTS[:5], [1, 2], *LISTS[5:]]))
    assert "log.json: 1 of another length LEFT OUT" in import_log(raw).summary()


def test_what_breaks_off_is_left_out_aloud(tmp_path):
    whole = json.dumps(NESTED)
    raw = tmp_path / "log.json"
    raw.write_text(whole[: len(whole) - 40])
    found = import_log(raw)
    assert found.recordings[0].samples["gyroscope"].t.size == len(ROWS) - 1
    assert "1 piece that is no JSON is LEFT OUT" in found.summary()


def test_lists_for_each_sensor_beside_a_description_are_one_log(tmp_path):
    (tmp_path / "readme.txt").write_text("the third throw\n")
    (tmp_path / "session.json").write_text(FORMS["a list for each sensor"]())
    found = import_log(tmp_path)
    assert {*found.recordings[0].samples} == set(KINDS)


def test_a_file_for_each_sensor_beside_a_description_is_one_log(tmp_path):
    folder = tmp_path / "export"
    folder.mkdir()
    for kind in KINDS:
        (folder / f"{kind}.json").write_text(json.dumps([row for row in LONG if row["sensor"] == kind]))
    (folder / "meta.json").write_text('{"device": "disc-3", "version": 2}')
    with zipfile.ZipFile(tmp_path / "export.zip", "w") as archive:
        for path in folder.iterdir():
            archive.write(path, f"export/{path.name}")
    for raw in (folder, tmp_path / "export.zip"):
        found = import_log(raw)
        assert {*found.recordings[0].samples} == set(KINDS)
        assert_allclose(found.recordings[0].samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ('{"name": "a disc", "mass_kg": 0.175}', "is JSON without records of numbers in it"),
        ('{"a": ' * 3000, "is JSON without records of numbers in it"),
        ('[{"x": 1},', "is JSON without records of numbers in it"),
        (lines([{f"k{k}_{j}": 1 for j in range(300)} for k in range(4)]), "is JSON of 1200 columns"),
        (lines([{"x": k, "name": "a"} for k in range(9)]), "no sensor of motion found"),
        ("[[1, 2, 3], [4, 5, 6]]", "is JSON of lists without rows of numbers"),
    ],
    ids=["description", "deep", "broken off", "wide", "other", "few lists"],
)
def test_json_without_a_log_in_it_is_refused_with_what_is_expected(tmp_path, text, what):
    raw = tmp_path / "log.json"
    raw.write_text(text)
    with pytest.raises(InputError, match=what):
        import_log(raw)


@pytest.mark.parametrize("stamp", ["14:03:2{:06.3f} -> ", "I ({:.0f}) imu: ", ""])
def test_lines_that_a_board_prints_between_its_records_are_none(tmp_path, stamp):
    """Each board prints one as it starts, and one of a network now and then: the log was refused."""
    lines = []
    for k, t in enumerate(LOG.t[:1200]):
        before = stamp.format(1000 * t + 300 if "imu" in stamp else t)
        lines += [before.replace("imu", "wifi") + "connected"] * (k % 25 == 0)
        values = zip(("a", "g", "m"), (LOG.accel[k], LOG.gyro[k] / DEG, LOG.mag[k]), strict=True)
        record = {
            f"{name}{axis}": round(float(x), 4) for name, three in values for axis, x in zip("xyz", three, strict=True)
        }
        lines.append(before + json.dumps(record))
    raw = tmp_path / "serial.log"
    raw.write_text("\n".join([*lines, ""]))
    read = import_log(raw)
    samples = read.recordings[0].samples
    assert set(samples) == {"accelerometer", "gyroscope", "magnetometer"}
    assert len(samples["gyroscope"]) == 1200
    assert "JSON, read as a table of its records: 1200" in read.summary()
