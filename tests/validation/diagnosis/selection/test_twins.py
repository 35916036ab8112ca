"""Effects that recordings hardly tell apart: which of them is named."""

import pytest

from discsim.validation.diagnosis.selection.candidates import free_candidate
from discsim.validation.diagnosis.selection.evidence import charge


@pytest.mark.parametrize("sensor", ["mag", "accel", "gyro"])
@pytest.mark.parametrize(("better", "named"), [(7.0, "lag"), (30.0, "time_offset")])
def test_an_offset_of_time_is_named_before_a_lag_only_where_it_explains_clearly_more(sensor, better, named):
    """At one spin both turn a sensor's phase alike; every part has a filter, and few loggers write wrong times.

    A lag of 3.7 ms on a rate table lost by 7 to an offset: what its starts may have been was charged to it.
    """
    score = {"lag": 0.0, "time_offset": -better}
    assert min(score, key=lambda what: score[what] + charge(free_candidate(f"{sensor}.{what}"))) == named
