"""Logs in the encodings of other countries: what is read as what, and what is said where that cannot be told."""

import numpy as np
import pytest
from fuzz.seeds import RAW
from numpy.testing import assert_allclose
from support.made_logs import made_log, three, write_table

from discsim.errors import InputError
from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.sniffing import map_text, sniff
from discsim.validation.importing.sniffing.text import encoding_of

LOG = made_log()
#: Time, gyroscope and accelerometer as phones and loggers call them there.
HEADERS = {
    "cp949": ("시간 (s)", "자이로 {} (rad/s)", "가속도 {} (m/s²)"),
    "cp932": ("時間 (s)", "ジャイロ {} (rad/s)", "加速度 {} (m/s^2)"),
    "gb18030": ("时间 (s)", "陀螺仪 {} (rad/s)", "加速度 {} (m/s²)"),
    "big5": ("時間 (s)", "陀螺儀 {} (rad/s)", "加速度 {} (m/s^2)"),
    "cp1251": ("Время (с)", "Гироскоп {} (рад/с)", "Ускорение {} (м/с^2)"),
    "cp1252": ("Zeit (s)", "Kreisel gyro {} (°/s)", "Beschleunigung für {} (m/s²)"),
}


def table(path, encoding, header, before=""):
    time, gyro, accel = header
    worth = np.pi / 180 if "°" in gyro else 1.0
    columns = [
        (time, LOG.t),
        *three([gyro.format(axis) for axis in "xyz"], LOG.gyro / worth),
        *three([accel.format(axis) for axis in "xyz"], LOG.accel),
    ]
    return write_table(path, columns, encoding=encoding, before=before)


@pytest.mark.parametrize("encoding", HEADERS)
def test_names_are_read_in_the_encoding_of_their_country(tmp_path, encoding):
    raw = table(tmp_path / "log.csv", encoding, HEADERS[encoding])
    assert encoding_of(raw) == encoding
    proposal = sniff(raw)
    (tmp_path / "map.toml").write_text(map_text(proposal), encoding="utf-8")
    samples = import_recording(raw, read_map(tmp_path / "map.toml")).recording.samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-5)
    assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-6)


ASCII = ("t_s", "gyro_{}_rad_s", "acc_{}_m_s2")


@pytest.mark.parametrize("encoding", ["cp949", "cp932", "gb18030", "cp1251", "cp1252"])
def test_names_in_ascii_need_no_encoding_of_the_words_above_them(tmp_path, encoding):
    """A remark in words that nobody here knows, before a header in ASCII."""
    remark = {"cp949": "원판", "cp932": "円盤", "gb18030": "飞盘", "cp1251": "диск", "cp1252": "Müller"}[encoding]
    raw = table(tmp_path / "log.csv", encoding, ASCII, before=f"# {remark}\n")
    assert {sensor.sensor for sensor in sniff(raw).sensors} == {"gyroscope", "accelerometer"}


def test_a_line_of_rubbish_does_not_change_the_encoding(tmp_path):
    raw = table(tmp_path / "log.csv", "cp949", HEADERS["cp949"])
    lines = raw.read_bytes().split(b"\n")
    lines[500] = b"2.4\xff\xfe,\x80,1"
    raw.write_bytes(b"\n".join(lines))
    assert encoding_of(raw) == "cp949"


def test_the_signs_of_a_western_log_stay_what_they_are(tmp_path):
    """Degree, micro, squares and accents: all that such logs hold beside ASCII."""
    (tmp_path / "log.csv").write_bytes("Zeit;Größe [µT];α°;é²;Übergröße\n1;2;3;4;5\n".replace("α", "").encode("cp1252"))
    assert encoding_of(tmp_path / "log.csv") == "cp1252"


def test_where_the_encoding_cannot_be_told_the_sentence_says_so(tmp_path):
    columns = [(name, LOG.t + k) for k, name in enumerate(("원판", "던지", "바람", "높이"))]
    raw = write_table(tmp_path / "log.csv", columns, encoding="cp949")
    with pytest.raises(
        InputError, match=r"the text is no UTF-8 and its encoding could not be told \(save it as UTF-8\)"
    ):
        sniff(raw)


@pytest.mark.parametrize(
    ("named", "sentence"),
    [
        ("undefined", "'encoding' is 'undefined', expected one such as utf-8"),
        ("idna", "'encoding' is 'idna', expected one such as utf-8"),
        ("hex", "'encoding' is 'hex', expected one such as utf-8"),
        ("utf-16", r"log\.csv: .*BOM; expected text in utf-16, as was said"),
        ("cp500", r"log\.csv: no usable row; expected"),
    ],
)
def test_a_map_s_encoding_that_is_not_the_log_s_is_refused_in_one_line(tmp_path, named, sentence):
    given = RAW()
    text = given["map.toml"] + f'\n[layout]\nencoding = "{named}"\n'
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    (tmp_path / "log.csv").write_text(given["log.csv"], encoding="utf-8")
    with pytest.raises(InputError, match=sentence) as refused:
        import_recording(tmp_path / "log.csv", read_map(tmp_path / "map.toml"))
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < 2000


@pytest.mark.parametrize("at", [0.4, 1.0])
def test_zeros_that_a_power_cut_left_make_no_log_binary(tmp_path, at):
    """A card's file is laid out in blocks; those that no row was written to stay zeros."""
    raw = table(tmp_path / "log.csv", "utf-8", HEADERS["gb18030"])
    lines = raw.read_bytes().split(b"\n")
    place = round(at * len(lines))
    raw.write_bytes(b"\n".join([*lines[:place], bytes(1 << 15), *lines[place:]]))
    assert encoding_of(raw) == "utf-8"
    (tmp_path / "map.toml").write_text(map_text(sniff(raw)), encoding="utf-8")
    found = import_recording(raw, read_map(tmp_path / "map.toml"))
    assert found.recording.samples["gyroscope"].t.size >= LOG.t.size - 1
