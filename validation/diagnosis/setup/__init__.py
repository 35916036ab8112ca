"""Faults of the setup, found before anything is fitted: `find_setup_faults`."""

from discsim.validation.diagnosis.setup.find import (
    SetupFault,
    SetupFindings,
    find_setup_faults,
    said,
    setup_notes,
    suspected_fault,
    with_fault,
    with_likeliest_fault,
    with_turned_board,
)

__all__ = [
    "SetupFault",
    "SetupFindings",
    "find_setup_faults",
    "said",
    "setup_notes",
    "suspected_fault",
    "with_fault",
    "with_likeliest_fault",
    "with_turned_board",
]
