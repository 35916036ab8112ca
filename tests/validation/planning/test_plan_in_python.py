"""A plan from Python: the same as the command's, as a table, a figure and text."""

from __future__ import annotations

import pytest

import discsim as ds
from discsim.errors import InputError
from discsim.validation.planning.planned import Planned


@pytest.mark.slow
def test_a_plan_is_a_result_like_the_others():
    found = ds.plan(2, "driver", ["mpu9250"])
    assert isinstance(found, Planned)
    table = found.table()
    assert len({len(column) for column in table.values()}) == 1
    assert set(table["effect"]) == {one.id for one in found.limits.effects}
    # what is named is seen, too
    assert all(named >= seen * 0.999 for seen, named in zip(table["seen"], table["named"], strict=True))
    assert found.plot().axes[0].get_xscale() == "log"
    frame, arrays = found.to_dataframe(), found.to_xarray()
    assert len(frame) == len(table["effect"])
    assert "named" in arrays
    assert "2 recordings" in found._repr_html_()


@pytest.mark.parametrize("plans", [0, []], ids=["no throw", "no plan"])
def test_a_plan_of_no_recording_is_refused(plans):
    with pytest.raises(InputError, match="no recording is planned; expected at least one"):
        ds.plan(plans)
