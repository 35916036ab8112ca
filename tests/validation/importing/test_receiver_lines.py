"""A log with a satellite receiver's sentences between its lines: both are read, and neither breaks the other."""

from __future__ import annotations

from functools import reduce
from operator import xor
from pathlib import Path

import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.receiver_lines import between

LOG = made_log()
NAMES = "millis,ax,ay,az,gx,gy,gz,mx,my,mz"


def sentence(t: float) -> str:
    """Return where a receiver that stands still was, with its checksum."""
    body = f"GPRMC,1403{t:05.2f},A,4722.2720,N,00832.5920,E,0.00,0.0,110524,,,A"
    return f"${body}*{reduce(xor, body.encode()):02X}"


def written(place: Path, before: str = "", every: int = 20) -> Path:
    lines = [NAMES] if not before else []
    for k, t in enumerate(LOG.t):
        stamp = before.format(t)
        lines += [f"{stamp}{sentence(t)}"] * (k % every == 0)
        values = (*LOG.accel[k] / G0, *LOG.gyro[k] / DEG, *LOG.mag[k])
        lines.append(f"{stamp}{5000 + 1000 * t:.0f},{','.join(f'{x:.5f}' for x in values)}")
    raw = place / "serial.csv"
    raw.write_text("\n".join([*lines, ""]))
    return raw


@pytest.mark.parametrize("before", ["", "14:03:{:06.3f} -> "])
def test_sentences_between_the_lines_are_read_apart(tmp_path, before):
    """They were rows with too many cells, and nobody was told that they were sentences."""
    found = import_log(written(tmp_path, before))
    samples = found.recordings[0].samples
    assert len(samples["gyroscope"]) == LOG.t.size
    assert_allclose(samples["gyroscope"].value[:, 2], LOG.gyro[:, 2], atol=1e-4)
    text = found.summary()
    assert f"{LOG.t.size // 20} sentences of a satellite receiver (NMEA) stand between its lines" in text
    # the receiver's clock is the day's, a board's counts from its start: what lets both begin together is told
    assert "the fixes in serial.nmea" in text


def test_a_text_of_sentences_and_one_without_are_no_log_with_some(tmp_path):
    assert between(written(tmp_path))
    (tmp_path / "track.txt").write_text("\n".join(sentence(t) for t in LOG.t[:200]))
    assert not between(tmp_path / "track.txt")
    (tmp_path / "plain.csv").write_text(f"{NAMES}\n" + "1,2,3,4,5,6,7,8,9,10\n" * 50)
    assert not between(tmp_path / "plain.csv")
