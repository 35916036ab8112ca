"""Records over several lines below one line of names are joined."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.validation.importing.imported_log import import_log
from discsim.validation.importing.sniffing.other_forms.folded_records import begins

LOG = made_log()
SENSORS = {"ax,ay,az": LOG.accel / G0, "gx,gy,gz": LOG.gyro / DEG, "mx,my,mz": LOG.mag}


def lines(sign: str, *, timed: bool, names: str = ",".join(SENSORS)) -> list[str]:
    """Return names in a line, and below them a line for each sensor, after one of the time perhaps."""
    text = [(f"t,{names}" if timed else names).replace(",", sign)]
    for k, t in enumerate(LOG.t):
        text += [f"{t:.4f}"] * timed
        text += [sign.join(f"{number:.5f}" for number in value[k]) for value in SENSORS.values()]
    return text


@pytest.mark.parametrize("sign", [",", ";", " ", "\t"])
@pytest.mark.parametrize("timed", [True, False])
def test_nine_names_over_three_lines_of_three_are_one_record(tmp_path, sign, timed):
    """It was refused: a record seemed to go over three lines."""
    raw = tmp_path / "log.txt"
    raw.write_text("\n".join([*lines(sign, timed=timed), ""]))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert_allclose(samples["gyroscope"].value, LOG.gyro, atol=1e-5)
    assert_allclose(samples["accelerometer"].value, LOG.accel, atol=1e-3)
    assert_allclose(samples["magnetometer"].value, LOG.mag, atol=1e-4)
    assert "log.txt: its " in found.summary()
    if timed:
        assert_allclose(samples["gyroscope"].t, LOG.t, atol=1e-9)


def test_a_line_that_broke_off_spoils_its_own_record_alone(tmp_path):
    """The lines of two sensors were taken for one gyroscope's."""
    text = lines(",", timed=True)
    text[1 + 4 * 30 + 2] = "0.1,2"
    raw = tmp_path / "log.txt"
    raw.write_text("\n".join(["board ready", *text[:-1], ""]))
    found = import_log(raw)
    samples = found.recordings[0].samples
    assert samples["gyroscope"].t.size == LOG.t.size - 2
    assert_allclose(samples["gyroscope"].value[30:200], LOG.gyro[31:201], atol=1e-5)
    assert "log.txt: 1 records with a line of another length LEFT OUT" in found.summary()


@pytest.mark.parametrize(
    "text",
    [
        "ax,ay,az,gx,gy,gz\n" + "1,2,3,4,5,6\n" * 40,
        "ax,ay,az,gx,gy,gz\n" + "1,2,3,4,5\n" * 40,
        "ax,ay,az\n" + "1\n2\n3\n" * 40,
        "one,two,three,four,five,six\n" + "1,2,3\n" * 40,
        # half of the columns have nothing to say, as those of a receiver without a fix: two rows had become one
        "ax,ay,az,gx,gy,gz,lat,lon,alt,speed,sats,fix\n" + "1,2,3,4,5,6,,,,,,\n" * 40,
        "ax\tay\taz\tgx\tgy\tgz\tlat\tlon\talt\tv\tsats\tfix\n" + "1\t2\t3\t4\t5\t6\t\t\t\t\t\t\n" * 40,
        "ax,ay,az,gx,gy,gz\n" + "1,2,3\n" * 6,
    ],
    ids=[
        "a record a line",
        "a name too many",
        "one sensor",
        "other names",
        "too few",
        "half empty",
        "half empty by tabs",
    ],
)
def test_other_texts_are_left_as_they_are(tmp_path, text):
    raw = tmp_path / "log.txt"
    raw.write_text(text)
    assert not begins(raw)
