"""A proposed map. Takes what was decided; gives it as data and as the text of a TOML map with the reasons."""

from __future__ import annotations

import glob
import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from discsim.arrays import FloatArray
from discsim.recording import SENSORS, Plant
from discsim.validation.importing.raw_table import Layout
from discsim.validation.importing.sniffing.axes import letters
from discsim.validation.importing.sniffing.clock import Clock
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.fixes import ProposedFixes
from discsim.validation.importing.sniffing.groups import Numbers, Triple
from discsim.validation.importing.sniffing.magnitudes import Unit
from discsim.validation.importing.sniffing.own_place import OwnPlace
from discsim.validation.importing.sniffing.track import SPIN, WOBBLE, ProposedTrack

__all__ = ["Proposal", "ProposedReference", "ProposedSensor", "map_text"]

_COMMA = 'separator = ","'
_AIR = (
    "gravity_sigma_m_s2 = 0.015 # 9.780 at the equator to 9.832 at the poles: leave out where yours is written",
    "air_density_kg_m3 = 1.204 # dry air at 20 degC and 1013 hPa: write that of your day",
    "# wind_ned_m_s = [0.0, 0.0, 0.0] # where known",
)
MIRRORED = -0.5  # a signed permutation's determinant is 1 or -1


@dataclass(frozen=True)
class ProposedSensor:
    """A sensor of a proposed map.

    ``clock`` is that of its own column of time, None where it has the file's; ``full_scale`` the range in SI that its
    readings show, and why; ``time_offset`` what is to be added to its times, s; ``layout`` that of its file, where that
    is laid out otherwise than the log.
    """

    sensor: str
    triple: Triple
    decision: Decision
    unit: Unit
    axes: FloatArray
    clock: Clock | None = None
    full_scale: tuple[float, Decision] | None = None
    time_offset: float | None = None
    layout: Layout | None = None


@dataclass(frozen=True)
class ProposedReference:
    """A column that tells the rate of a rate table, ``sign`` -1 where it counts against the body's z."""

    numbers: Numbers
    column: str
    unit: str
    sign: float
    decision: Decision


@dataclass(frozen=True)
class Proposal:
    """A proposed map; ``decisions`` are those on the whole (axes), ``notes`` what else a user should know.

    ``fixes`` are a receiver's, ``track`` is a camera's, ``reference`` a rate table's and ``place`` where the log says
    that it was made, None where there is none.
    """

    name: str
    raw: Path
    plant: Plant
    layout: Layout
    clock: Clock
    sensors: tuple[ProposedSensor, ...]
    decisions: tuple[Decision, ...]
    notes: tuple[str, ...] = field(default=())
    fixes: ProposedFixes | None = None
    place: OwnPlace | None = None
    track: ProposedTrack | None = None
    reference: ProposedReference | None = None

    @property
    def all_decisions(self) -> list[Decision]:
        """Every decision, in the order of the map."""
        found = [self.clock.decision]
        for sensor in self.sensors:
            found += [sensor.decision, sensor.unit.decision]
            found += [sensor.full_scale[1]] if sensor.full_scale is not None else []
        return [
            *found,
            *self.decisions,
            *([self.reference.decision] if self.reference is not None else []),
            *([self.fixes.decision] if self.fixes is not None and not self.fixes.apart else []),
            *(self.track.decisions if self.track is not None else ()),
        ]

    def in_field(self, size: float | None) -> Proposal:
        """Return it with the unit of a magnetometer that a field of ``size`` uT tells; as it is for None."""
        sensors = tuple(replace(one, unit=one.unit.in_field(size)) for one in self.sensors)
        return replace(self, sensors=sensors)


def _text(value: str) -> str:
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


def _texts(values: Sequence[str]) -> str:
    return f"[{', '.join(map(_text, values))}]"


def _remark(decision: Decision) -> str:
    return "# " + "".join(c for c in f"{decision.sure}: {decision.why}" if c.isprintable())


def map_text(proposal: Proposal) -> str:
    """Return the map as TOML; each decision stands above its key with how sure it is and why."""
    layout, clock = proposal.layout, proposal.clock
    repairs = ["header", "comment", "width", "number", "time"] + ["counter"] * (clock.counter is not None)
    lines = [
        f"# Proposed by `discsim import {''.join(c for c in proposal.raw.name if c.isprintable())}`: no map was named.",
        "# Read the reasons; what is a guess wants your eye. With this file in --map the import is the same again.",
        *[f"# {note}" for note in proposal.notes],
        "",
        f"name = {_text(proposal.name)}",
        f"plant = {_text(proposal.plant)}",
        f"repairs = {_texts(repairs)}",
        *(["", "[layout]", *keys] if (keys := _layout(layout)) else []),
        "",
        "[time]",
        _remark(clock.decision),
    ]
    if clock.column is not None:
        lines += [f"column = {_text(clock.column)}", f"unit = {_text(clock.unit)}"]
        lines += ["spacings = true # of each row from the one before"] * clock.spacings
        lines += ["shared = true # several rows share a stamp, and are even between stamps"] * clock.shared
        lines += [f"scale = {clock.scale:.9g} # the worth of one count in that unit"] * (clock.scale != 1.0)
        if clock.off:
            lines.append(f"scale_sigma = {clock.scale * clock.off:.2g} # leave out where the scale is known")
    else:
        lines += [f"step_s = {clock.step}"]
        if clock.step is not None and clock.off:
            lines.append(f"step_sigma_s = {clock.step * clock.off:.2g} # leave out where the step is known")
        lines += [f"counter = {_text(name)}" for name in [clock.counter] if name is not None]
    if proposal.track is not None:
        lines += ["", "[disc]", _remark(proposal.track.of_disc), f"name = {_text(proposal.track.of_disc.choice)}"]
    lines += [
        "",
        "[environment]",
        "gravity_m_s2 = 9.80665 # standard gravity",
        *(_AIR if proposal.track is not None else _place(proposal.place)),
    ]
    for sensor in proposal.sensors:
        lines += _sensor(proposal, sensor)
    if proposal.reference is not None:
        lines += ["", *_reference(proposal, proposal.reference)]
    if proposal.fixes is not None:
        lines += ["", *_fixes(proposal, proposal.fixes)]
    if proposal.track is not None:
        lines += ["", *_track(proposal, proposal.track)]
    return "\n".join([*lines, ""])


def _place(place: OwnPlace | None) -> list[str]:
    if place is None:
        return [
            "# The field of the place is not known: add latitude_deg, longitude_deg and date, or magnetic_field_ned_uT."
        ]
    if place.day is not None:
        return [
            "# By its own columns and stamps the log was made here and then, which tells the field.",
            f"latitude_deg = {place.latitude:.5f}",
            f"longitude_deg = {place.longitude:.5f}",
            f"date = {place.day}",
        ]
    return [
        "# By its own columns the log was made at the place below; with the date it tells the field.",
        f"# latitude_deg = {place.latitude:.5f}",
        f"# longitude_deg = {place.longitude:.5f}",
        "# date = YYYY-MM-DD",
    ]


def _layout(layout: Layout) -> list[str]:
    plain = Layout()
    keys = {
        "separator": layout.separator,
        "decimal": layout.decimal,
        "thousands": layout.thousands,
        "encoding": layout.encoding,
        "comment": layout.comment,
        "sorted_by": layout.sorted_by,
    }
    lines = [f"{key} = {_text(value)}" for key, value in keys.items() if value != getattr(plain, key)]
    lines += [f"skip_lines = {layout.skip_lines}"] * (layout.skip_lines > 0)
    lines += [f"columns = {_texts(layout.columns)}"] * bool(layout.columns)
    lines += ["lists = true"] * layout.lists
    lines += ["labelled = true"] * layout.labelled
    return lines


def _own_layout(sensor: str, layout: Layout | None) -> list[str]:
    if layout is None:
        return []
    return [f"[sensors.{sensor}.layout] # its file is laid out in another way", *(_layout(layout) or [_COMMA])]


def _file(proposal: Proposal, numbers: Numbers) -> list[str]:
    return [f"file = {_text(glob.escape(numbers.path.name))}"] * proposal.raw.is_dir()


def _sensor(proposal: Proposal, sensor: ProposedSensor) -> list[str]:
    triple, unit = sensor.triple, sensor.unit
    lines = ["", f"[sensors.{sensor.sensor}]"]
    lines += _file(proposal, triple.numbers)
    lines += [_remark(sensor.decision), f"columns = {_texts(triple.names)}"]
    if triple.where is not None:
        lines.append(f"where = {{ {_text(triple.where[0])} = {_text(triple.where[1])} }}")
    if sensor.clock is not None and sensor.clock.column is not None:
        lines.append(f"time = {_text(sensor.clock.column)} # its own stamps, in the unit of [time] without another")
        lines += [f"time_unit = {_text(sensor.clock.unit)}"] * (sensor.clock.unit != proposal.clock.unit)
    if sensor.time_offset is not None:
        lines.append(f"time_offset_s = {sensor.time_offset:g} # added to its times")
    lines += [_remark(unit.decision), f"unit = {_text(unit.unit)}"]
    lines += [f"scale = {unit.scale!r}"] * (unit.scale != 1.0)
    if sensor.full_scale is not None:
        limit, decision = sensor.full_scale
        lines += [_remark(decision), f"range_{SENSORS[sensor.sensor].unit} = {limit:.9g} # {decision.choice}"]
    named = letters(sensor.axes)
    lines += [f"# {decision.text}" for decision in proposal.decisions if _about(decision, sensor.sensor)]
    lines.append(f"axes = {_texts(named)}")
    if _determinant(sensor.axes) < MIRRORED:
        lines.append("mirrored = true")
    if sensor.sensor == "accelerometer":
        lines.append("# position_m = [0.0, 0.0, 0.0] # where it sits in the disc: needed for a rate from it")
    return lines + _own_layout(sensor.sensor, sensor.layout)


def _reference(proposal: Proposal, reference: ProposedReference) -> list[str]:
    lines = ["[sensors.rate_reference]", *_file(proposal, reference.numbers), _remark(reference.decision)]
    lines += [f"columns = {_texts([reference.column])}", f"unit = {_text(reference.unit)}"]
    return lines + [f"scale = {reference.sign}"] * (reference.sign < 0.0)


def _fixes(proposal: Proposal, fixes: ProposedFixes) -> list[str]:
    lines = ["[sensors.gps]", *_file(proposal, fixes.numbers)]
    lines += [_remark(fixes.decision), f"columns = {_texts(fixes.columns)}"]
    lines += [f"unit = {_text(fixes.unit)}"] * bool(fixes.unit)
    lines += [f"height_unit = {_text(fixes.height_unit)}"] * bool(fixes.height_unit)
    lines += [f"velocity_unit = {_text(fixes.velocity_unit)}"] * bool(fixes.velocity_unit)
    if fixes.clock is not None and fixes.clock.column is not None:
        lines += [f"time = {_text(fixes.clock.column)} # its own stamps", f"time_unit = {_text(fixes.clock.unit)}"]
    if fixes.offset:
        lines.append(f"time_offset_s = {fixes.offset:.0f} # added to its times")
    if fixes.apart:
        lines.append("time_offset_s = 0.0 # what is to be added to its times")
    lines += _own_layout("gps", fixes.layout)
    return [f"# {line}" for line in (fixes.apart, *lines)] if fixes.apart else lines


def _track(proposal: Proposal, track: ProposedTrack) -> list[str]:
    return [
        "[sensors.track]",
        *_file(proposal, track.numbers),
        *(_remark(track.of_columns), f"columns = {_texts(track.columns)}"),
        *(_remark(track.of_unit), f"unit = {_text(track.unit)}"),
        *(_remark(track.of_axes), f"axes = {_texts(track.axes)}"),
        f"noise_rms_m = {track.noise:g} # of a coordinate, by third differences",
        "",
        "[release]",
        "# guess: throws wobble by some rad/s and spin to either side; without bounds a path leaves both open.",
        "# What was measured goes here, or as [throws.NAME] for the file NAME (docs/importing.md).",
        "body_rate_rad_s = [0.0, 0.0, 0.0]",
        f"body_rate_sigma_rad_s = [{WOBBLE}, {WOBBLE}, {SPIN}]",
    ]


def _about(decision: Decision, sensor: str) -> bool:
    if decision.what.endswith(" time"):
        return decision.what == f"{sensor} time"
    return decision.what == f"{sensor} axes" or not decision.what.endswith(" axes")


def _determinant(matrix: FloatArray) -> float:
    import numpy as np

    return float(np.linalg.det(matrix))
