"""Faults of the setup, found before anything is fitted: `find_setup_faults`."""

from discsim.validation.diagnosis.setup.faults import SetupFault, SetupFindings, said, with_fault
from discsim.validation.diagnosis.setup.find import (
    find_setup_faults,
    setup_notes,
    suspected_fault,
    with_likeliest_fault,
    with_turned_board,
)
from discsim.validation.diagnosis.setup.told_by_fit import with_axes_as_read

__all__ = [
    "SetupFault",
    "SetupFindings",
    "find_setup_faults",
    "said",
    "setup_notes",
    "suspected_fault",
    "with_axes_as_read",
    "with_fault",
    "with_likeliest_fault",
    "with_turned_board",
]
