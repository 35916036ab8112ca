"""Counts of 16 bits that lost their sign (65533 for -3) are read with it, aloud; counts that have none stay."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, LANDING, RELEASE, made_log, three, write_table

from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.magnitudes import gyroscope_unit
from discsim.validation.importing.unsigned import signed

LOG = made_log()
GYRO, ACCEL = (np.round(value).astype(int) for value in (LOG.gyro / DEG * 10, LOG.accel / G0 * 2048))


def log(path):
    columns = [("ms", np.round(1000 * LOG.t).astype(int)), *three(["gx", "gy", "gz"], GYRO % 65536)]
    return write_table(path, [*columns, *three(["ax", "ay", "az"], ACCEL % 65536)])


def test_counts_without_their_sign_are_read_with_it_and_listed(tmp_path):
    """The accelerometer was in m/s^2 with 65 000 at rest, and no throw was found."""
    found = import_log(log(tmp_path / "log.csv"))
    said = found.summary()
    assert "accelerometer unit: 1/2048 g a count" in said
    assert "65536 taken off where gyroscope is above 32767 (1), 65536 taken off where accelerometer is" in said
    assert_allclose(found.recordings[0].samples["accelerometer"].value, LOG.accel, atol=0.6 / 2048 * G0 + 1e-9)
    (throw,) = found.throws
    assert RELEASE <= throw.start < throw.end <= LANDING + 0.1


def test_a_map_reads_them_as_well(tmp_path):
    raw = log(tmp_path / "log.csv")
    (tmp_path / "map.toml").write_text(import_log(raw).map_text, encoding="utf-8")
    recording = import_recording(raw, read_map(tmp_path / "map.toml")).recording
    assert_allclose(recording.samples["accelerometer"].value, LOG.accel, atol=0.6 / 2048 * G0 + 1e-9)


@pytest.mark.parametrize(
    "value",
    [
        GYRO,
        LOG.gyro,
        np.abs(GYRO),
        GYRO + 32768,  # zero in the middle of an unsigned range
        np.where(np.arange(len(GYRO))[:, None] % 300 < 3, 65535, 100 + np.abs(GYRO)),  # ends of the range now and then
        (GYRO % 65536) + 0.5,
        np.full_like(LOG.gyro, np.nan),
        GYRO[:0],
    ],
    ids=["signed", "decimals", "sizes", "offset", "at the end", "no whole numbers", "nothing", "empty"],
)
def test_what_has_its_sign_or_never_had_one_stays(value):
    assert signed(np.asarray(value, dtype=float)) is None


@pytest.mark.parametrize(("clock", "unit"), [("certain", "rpm"), ("likely", "rad/s"), ("guess", "rad/s")])
def test_rpm_without_a_header_is_told_by_a_certain_clock_alone(clock, unit):
    """Ticks of 0.1 ms under a name without a unit were taken for milliseconds, and rad/s for rpm."""
    value = LOG.gyro
    assert gyroscope_unit(value, None, 0.1, clock=clock).unit == unit
