"""What Arduino's serial monitor shows (`gx:1.0 gy:2.0`) is read; what ROS prints of a topic is refused by its name."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from support.made_logs import DEG, G0, made_log

from discsim.errors import InputError
from discsim.validation.importing.imported_log import import_log

LOG = made_log()
CELLS = np.column_stack([LOG.t * 1000, LOG.gyro / DEG, LOG.accel / G0])

SHORT = ["ms", "gx", "gy", "gz", "ax", "ay", "az"]
LONG = ["Time ms", "Gyro X", "Gyro Y", "Gyro Z", "Accel X", "Accel Y", "Accel Z"]


@pytest.mark.parametrize(
    ("names", "label", "between"),
    [(SHORT, ":", " "), (SHORT, ":", ","), (SHORT, "=", "\t"), (LONG, ": ", ", "), (LONG, " : ", " | ")],
)
def test_cells_with_their_names_before_them_are_read(tmp_path, names, label, between):
    lines = [between.join(f"{n}{label}{cell:.4f}" for n, cell in zip(names, row, strict=True)) for row in CELLS]
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join(["MPU6050 ready", *lines[:50], lines[50][:20], *lines[51:], ""]))
    whole = import_log(raw)
    read = whole.recordings[0].samples["gyroscope"]
    assert_allclose(read.value[:, 2], np.delete(LOG.gyro[:, 2], 50), atol=1e-5)
    assert_allclose(read.t, np.delete(LOG.t, 50), atol=1e-6)
    assert "text: each cell has its name before it" in whole.summary()
    assert len(whole.throws) == 1


def test_the_stamps_of_the_serial_monitor_are_the_time(tmp_path):
    stamp = [f"12:00:{t:06.3f} -> " for t in LOG.t]
    lines = [s + " ".join(f"{n}:{c:.4f}" for n, c in zip(SHORT[1:], row[1:], strict=True))
             for s, row in zip(stamp, CELLS, strict=True)]  # fmt: skip
    raw = tmp_path / "serial.txt"
    raw.write_text("\n".join([*lines, ""]))
    assert_allclose(import_log(raw).recordings[0].samples["gyroscope"].t, LOG.t, atol=1e-6)


def test_what_ros_prints_of_a_topic_is_refused_with_what_to_do(tmp_path):
    message = "header:\n  stamp:\n    sec: 1\nangular_velocity:\n  x: 0.1\n  y: 0.2\n  z: 0.3\n---\n"
    (tmp_path / "imu.yaml").write_text(message * 50)
    with pytest.raises(InputError, match=r"is the YAML that `ros2 topic echo` .* prints, no table; expected the bag"):
        import_log(tmp_path / "imu.yaml")
