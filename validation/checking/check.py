"""`check_recording`: what a recording holds, what is wrong with it, and what it can tell; nothing is fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol

from discsim.effects.catalogue import catalogued
from discsim.effects.setup import ClockUnit
from discsim.recording import Recording
from discsim.validation.checking.abilities import methods_that_run, not_told
from discsim.validation.checking.failed_readings import failed_findings, without_failed
from discsim.validation.checking.finding import SEVERITIES, Finding
from discsim.validation.checking.readings import reading_findings
from discsim.validation.checking.run_down import run_down_findings
from discsim.validation.checking.sensors import SensorCheck, check_sensor, sensor_findings
from discsim.validation.checking.statements import statement_findings
from discsim.validation.diagnosis.setup.reference import believed, reference_doubts
from discsim.validation.diagnosis.setup.units import clock_doubts

__all__ = ["Check", "SetupFault", "check_recording"]

#: times that are no seconds
_CLOCK = catalogued(ClockUnit).id


class SetupFault(Protocol):
    """A setup fault that was found: an axis, a unit, an offset in time."""

    @property
    def id(self) -> str:
        """The effect's id in the catalogue (``mag.axes``)."""

    @property
    def sentence(self) -> str:
        """What is wrong, and the line that mends it."""


@dataclass(frozen=True)
class Check:
    """What a recording holds, what is wrong with it (errors first) and what it can tell.

    Attributes
    ----------
    name, plant, duration
        Its name, its plant, and the time of its last row, s.
    sensors : tuple of SensorCheck
    findings : tuple of Finding
    methods, methods_left_out : mapping
        Methods of `estimate` that can run; those that cannot, with the reason.
    not_told : tuple of str
        What the recording cannot tell for want of something.
    """

    name: str
    plant: str
    duration: float
    sensors: tuple[SensorCheck, ...]
    findings: tuple[Finding, ...]
    methods: tuple[str, ...]
    methods_left_out: dict[str, str]
    not_told: tuple[str, ...]

    def of(self, severity: str) -> tuple[Finding, ...]:
        """Return the findings of a severity."""
        return tuple(finding for finding in self.findings if finding.severity == severity)

    @property
    def advice(self) -> tuple[str, ...]:
        """Errors and warnings, a line each."""
        return tuple(
            f"{finding.severity}: {finding.sentence}" for finding in self.findings if finding.severity != "note"
        )

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.name,
            "plant": self.plant,
            "duration_s": self.duration,
            "sensors": [asdict(sensor) for sensor in self.sensors],
            "findings": [finding.to_json() for finding in self.findings],
            "methods": list(self.methods),
            "methods_left_out": self.methods_left_out,
            "not_told": list(self.not_told),
        }


def check_recording(recording: Recording, faults: Sequence[SetupFault] = ()) -> Check:
    """Return what is to be said of a recording; ``faults`` are setup faults found in it, which join the findings."""
    failed, written = tuple(failed_findings(recording)), recording.samples
    recording = without_failed(recording)
    sensors = tuple(replace(check_sensor(recording, name), gaps=samples.gaps) for name, samples in written.items())
    clocks, doubts = clock_doubts(recording), list(reference_doubts(recording))
    clocked = {name for doubt in clocks for name in doubt.sensors}
    findings = [
        *statement_findings(recording),
        *(Finding(_CLOCK, "error", ", ".join(one.sensors), one.what, one.expected, one.remedy) for one in clocks),
        *(finding for found in sensors for finding in sensor_findings(found, clocked=found.sensor in clocked)),
        *failed,
        *reading_findings(recording, doubts),
        *run_down_findings(believed(recording, doubts)),
        # setup faults (axes, units, offsets in time) join here: anything with an id and a sentence
        *(Finding(fault.id, "error" if fault.id == _CLOCK else "warning", "setup", fault.sentence) for fault in faults),
    ]
    run, left_out = methods_that_run(recording)
    return Check(
        recording.path.resolve().name if recording.path is not None else recording.name,
        recording.plant,
        recording.end,
        sensors,
        tuple(sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity))),
        tuple(run),
        left_out,
        not_told(recording),
    )
