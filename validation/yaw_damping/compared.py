"""C_Nr from several sources of spin rate side by side: the paper's two methods, mount errors, and the best there is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from discsim.errors import InputError
from discsim.recording import Recording
from discsim.validation.yaw_damping.observations import misplaced, observe
from discsim.validation.yaw_damping.output_error import Fit, fit_yaw_damping
from discsim.validation.yaw_damping.paper_table import PaperTable, paper_table

__all__ = ["SOURCES", "Compared", "Source", "as_mounted", "compare_sources"]


@dataclass(frozen=True)
class Source:
    """Where a spin rate comes from: a method of `estimate`, and how far off its mount the accelerometer is taken, m."""

    method: str
    mount: float = 0.0

    @property
    def label(self) -> str:
        """Name for tables and figures."""
        return f"{self.method}, {1000 * self.mount:g} mm" if self.method == "accelerometer" else self.method


#: the paper's comparison, with its two mount errors and none, and the best of all methods
SOURCES = (
    Source("best"),
    Source("fft"),
    Source("accelerometer"),
    Source("accelerometer", 0.001),
    Source("accelerometer", 0.005),
)


@dataclass(frozen=True)
class Compared:
    """What one source of spin rate makes of a data set; both None where it cannot, with the reason."""

    source: Source
    fit: Fit | None
    paper: PaperTable | None
    reason: str = ""


def as_mounted(recording: Recording, source: Source) -> Recording:
    """Return a recording as the source takes it: with the accelerometer stated off its place."""
    return misplaced(recording, source.mount) if source.mount else recording


def compare_sources(
    recordings: Sequence[Recording], first: Fit | None = None, sources: Sequence[Source] = SOURCES
) -> Iterator[Compared]:
    """Yield for each source its C_Nr; a fit of the same recordings spares the search for their releases."""
    start = None if first is None else [throw.state for throw in first.throws]
    for source in sources:
        try:
            throws = [observe(as_mounted(recording, source), source.method) for recording in recordings]
            yield Compared(source, fit_yaw_damping(throws, start), paper_table(throws))
        except InputError as error:
            yield Compared(source, None, None, str(error))
