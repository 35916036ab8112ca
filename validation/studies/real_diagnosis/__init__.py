"""Measured recordings diagnosed, as a page of the documentation: ``discsim study real-diagnosis``."""

from discsim.validation.studies.real_diagnosis.page import write_page

__all__ = ["write_page"]
