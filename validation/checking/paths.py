"""Where a recording's path cannot be one: what a GPS and a track say against themselves, a throw and the release."""

from __future__ import annotations

from collections.abc import Iterator

from discsim.recording import Recording
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.gps_path import gps_findings
from discsim.validation.checking.track_path import track_findings

__all__ = ["path_findings"]


def path_findings(recording: Recording) -> Iterator[Finding]:
    """Yield what cannot be, or is unlikely, about the positions of a GPS and of a track."""
    yield from gps_findings(recording)
    yield from track_findings(recording)
