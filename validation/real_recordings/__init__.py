"""The methods on measured recordings, as a page of the documentation: ``python -m validation.real_recordings``."""

from validation.real_recordings.page import write_page
from validation.real_recordings.sources import SOURCES, find_recordings

__all__ = ["SOURCES", "find_recordings", "write_page"]
