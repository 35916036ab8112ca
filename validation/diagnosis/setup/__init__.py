"""Faults of the setup, found before anything is fitted: `find_setup_faults`."""

from validation.diagnosis.setup.find import SetupFault, SetupFindings, find_setup_faults, said

__all__ = ["SetupFault", "SetupFindings", "find_setup_faults", "said"]
