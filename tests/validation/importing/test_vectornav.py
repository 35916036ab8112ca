"""Sentences of a VectorNav's serial port are read: units by the sentence, checksums asked, broken ones left out."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable
from functools import reduce
from operator import xor

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.logs import kind_of

LOG = made_log()
SUMS: dict[str, Callable[[bytes], str]] = {
    "8 bits": lambda text: f"{reduce(xor, text):02X}",
    "16 bits": lambda text: f"{crc_hqx(text, 0):04X}",
    "off": lambda text: "XX",
}


def sentences(kind: str, before: str, after: str, told: Callable[[bytes], str]) -> list[str]:
    lines = []
    for mag, accel, gyro in zip(LOG.mag / 100.0, LOG.accel, LOG.gyro, strict=True):
        text = f"{kind},{before}" + ",".join(f"{value:+.6f}" for value in (*mag, *accel, *gyro)) + after
        lines.append(f"${text}*{told(text.encode())}")
    return lines


@pytest.mark.parametrize("told", SUMS.values(), ids=SUMS)
@pytest.mark.parametrize(
    ("kind", "before", "after"),
    [("VNIMU", "", ",+24.1,+101.325"), ("VNYMR", "+008.5,-001.0,+000.2,", ""), ("VNMAR", "", ""),
     ("VNQMR", "+0.1,+0.2,+0.3,+0.9,", "")],
)  # fmt: skip
def test_its_sentences_are_read(tmp_path, kind, before, after, told):
    lines = sentences(kind, before, after, told)
    lines[50] = lines[50][:40]
    raw = tmp_path / "vn.txt"
    raw.write_text("\r\n".join([*lines, ""]))
    assert kind_of(raw) is None  # no receiver's sentences
    log = import_log(raw)
    samples = log.recordings[0].samples
    for sensor, values in (("gyroscope", LOG.gyro), ("accelerometer", LOG.accel), ("magnetometer", LOG.mag)):
        assert_allclose(samples[sensor].value, np.delete(values, 50, axis=0), atol=1e-3)
    assert "magnetometer unit: gauss (certain: the header says so" in log.summary()
    assert len(log.throws) == 1
    assert any("row left out" in repair.action for repair in log.imported[0].repairs)


def test_a_wrong_checksum_leaves_the_sentence_out(tmp_path):
    lines = sentences("VNIMU", "", ",+24.1,+101.325", SUMS["8 bits"])
    lines[70] = lines[70].replace(",+24.1", ",+24.2")
    raw = tmp_path / "vn.txt"
    raw.write_text("\n".join([*lines, ""]))
    assert len(import_log(raw).recordings[0].samples["gyroscope"]) == len(LOG.t) - 1
