"""A table that does not turn as it is commanded is told, one that does is not."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.environment import Environment
from discsim.rate_tables import RateTable
from discsim.recording import Recording
from discsim.rig import default_profile
from discsim.sensors import Instruments, record
from discsim.table_drive import TableDrive
from discsim.validation.diagnosis.command_followed import not_as_commanded
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened


def run(drive: TableDrive) -> Recording:
    profile = default_profile((500, 2000), hold=1.0)
    motion = RateTable(drive=drive).run(profile, Environment(), (), yaw=0.3)
    board = Instruments.from_parts("ac1120s", "mpu9250")
    return record(motion, board, np.random.default_rng(1), plant="rate_table", name="run", command=profile)


@pytest.mark.parametrize("bandwidth", [8.0, np.inf])
def test_a_loop_that_trails_its_ramps_is_told(bandwidth: float):
    """A ramp of 26 rad/s^2 is trailed by 2 zeta/w, 26 ms at 8 Hz without overshoot: 0.6 rad/s, a third of the time."""
    told = not_as_commanded(screened(SearchProblem([run(TableDrive(bandwidth_hz=bandwidth))])), ["bench"])
    assert len(told) == int(np.isfinite(bandwidth))
    assert all(sentence.startswith("bench: the table's own read-out is off its command by 2") for sentence in told)
