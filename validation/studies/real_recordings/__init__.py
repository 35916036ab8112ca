"""The methods on measured recordings, as a page: ``discsim study real-recordings``."""

from discsim.validation.studies.real_recordings.page import write_page
from discsim.validation.studies.real_recordings.sources import SOURCES, find_recordings

__all__ = ["SOURCES", "find_recordings", "write_page"]
