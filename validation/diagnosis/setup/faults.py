"""Faults of a setup as effects of the catalogue, with what they gain and what else would do as well, and in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, within_half_turn
from discsim.effects.catalogue import Effect, effect_of
from discsim.effects.setup import Axes, BoardRotation, ClockUnit, GpsAxes, SiteField, TimeOffset, axes_of, permutation
from discsim.recording import Recording
from discsim.validation.diagnosis.setup.hypotheses import Hypothesis, board_effect
from discsim.validation.diagnosis.setup.late_sensor import LateSensor
from discsim.validation.diagnosis.setup.remedy import MapAxes, remedy
from discsim.written import corrected

__all__ = [
    "LateFault",
    "SetupFault",
    "SetupFindings",
    "SuspectedFault",
    "effect_of_hypothesis",
    "said",
    "told_fault",
    "with_fault",
]


@dataclass(frozen=True)
class SetupFault:
    """A fault as an effect of the catalogue, its gain (twice the log likelihood, and on recordings set aside), twins.

    ``twins`` are effects, in place of this one, that these recordings cannot tell from it. ``place`` is where the
    accelerometer would sit on a board that is not turned, m, where that would do as well.
    """

    effect: Effect
    gain: float
    heldout_gain: float | None
    twins: tuple[Effect, ...] = ()
    place: tuple[float, float, float] | None = None

    @property
    def id(self) -> str:
        """The effect's id."""
        return self.effect.id

    @property
    def of_axes(self) -> bool:
        """Whether it is a sensor whose columns hold other axes than they say."""
        return isinstance(self.effect.value, Axes)

    @property
    def sentence(self) -> str:
        """What is wrong, what else it could be, and what mends it."""
        return self.advice()

    def advice(self, axes: Mapping[str, MapAxes] | None = None) -> str:
        """Return the sentence with the line for an import map that now has these ``axes``."""
        text = said(self.effect)
        alike = [said(one) for one in self.twins]
        if self.place is not None:
            where = ", ".join(f"{axis:.4g}" for axis in self.place)
            alike.append(f"the accelerometer's position_m is stated wrongly (its sign, say), and is [{where}]")
        if alike:
            text += "; these recordings cannot tell that from: " + "; ".join(alike)
        return f"{text}; {remedy(self.effect, axes)}"


@dataclass(frozen=True)
class LateFault(SetupFault):
    """A sensor whose clock is another's, told by the spin that both show and not by the phase."""

    told: LateSensor | None = None

    def advice(self, axes: Mapping[str, MapAxes] | None = None) -> str:
        """Return the sentence with how sure the offset is."""
        assert self.told is not None
        return f"{self.told.what}: {self.told.why}; {remedy(self.effect, axes)}"


class SuspectedFault(SetupFault):
    """A fault that would make the sensors agree and gains too little to be named."""

    def advice(self, axes: Mapping[str, MapAxes] | None = None) -> str:
        """Return the sentence as a supposition."""
        return f"perhaps {super().advice(axes)}; too little turned here to be sure: a second throw or spin would tell"


@dataclass(frozen=True)
class SetupFindings:
    """The faults of a setup, and the recordings as they were meant, in the order in which they were given."""

    faults: tuple[SetupFault, ...]
    recordings: tuple[Recording, ...]
    #: physics that would make the sensors agree where no fault does: a lag, a clock, iron, of about this size
    hints: tuple[Effect, ...] = ()
    #: what is wrong with rate references and commands, by which nothing else is then judged
    doubts: tuple[str, ...] = ()
    #: what contradicts a rate reference, a command, or a clock by the stated rates, of which either may be wrong
    contradictions: tuple[str, ...] = ()

    @property
    def effects(self) -> tuple[Effect, ...]:
        """The faults as effects."""
        return tuple(fault.effect for fault in self.faults)

    def plus(self, fault: SetupFault) -> SetupFindings:
        """Return findings with one more fault, for which the recordings are corrected."""
        meant = tuple(corrected(one, [fault.effect]) for one in self.recordings)
        return replace(self, faults=tuple(with_fault(self.faults, fault)), recordings=meant)

    @property
    def without_hints(self) -> SetupFindings:
        """The same without the physics that does as well as a fault, where a fault is supposed in its place."""
        return replace(self, hints=())


def told_fault(effect: Effect, twins: Sequence[Effect] = ()) -> SetupFault:
    """Return a fault that no relation tells but a fit, or an axis, which is as sure; ``twins`` do as well."""
    return SetupFault(effect, float("inf"), None, tuple(twins))


def with_fault(faults: Sequence[SetupFault], further: SetupFault) -> list[SetupFault]:
    """Return faults with one more, found in readings that are corrected for them: axes of one sensor become one fault.

    None is left where the second puts back what the first has taken.
    """
    before = next((one for one in faults if one.id == further.id), None)
    if before is None or not further.of_axes:
        return [*faults, further]
    both = permutation(before.effect.value) @ permutation(further.effect.value)
    rest = [one for one in faults if one is not before]
    if np.array_equal(both, np.eye(3)):
        return rest
    effect = effect_of(Axes(axes_of(both)), further.effect.row.acts_on)
    gain = max(before.gain, further.gain)
    return [*rest, replace(further, effect=effect, gain=gain, twins=(), place=None)]


def effect_of_hypothesis(item: Hypothesis, stated: FloatArray) -> Effect:
    """Return a hypothesis as an effect of the catalogue; ``stated`` (3,) is the stated field, uT."""
    if item.kind == "axes":
        kind = GpsAxes if item.sensor == "gps" else Axes
        return effect_of(kind(axes_of(item.columns.of(item.sensor).T, item.sensor)), item.sensor)
    if item.kind == "offset":
        return effect_of(TimeOffset(item.columns.offset[item.sensor]), item.sensor)
    if item.kind == "board":
        return board_effect(next(iter(item.columns.axes.values())))
    assert item.columns.site is not None
    return effect_of(SiteField(*_apart(item.columns.site, stated)))


def _apart(site: FloatArray, stated: FloatArray) -> tuple[float, float, float]:
    """Return by how much a field (3,) is turned about down, dips further, and is larger than another."""
    turned = np.arctan2(site[1], site[0]) - np.arctan2(stated[1], stated[0])
    dip = [float(np.arctan2(b[2], np.hypot(b[0], b[1]))) for b in (site, stated)]
    return float(within_half_turn(turned)), dip[0] - dip[1], float(np.linalg.norm(site) / np.linalg.norm(stated))


# ---------------------------------------------------------------------------------------------- in words


def said(fault: Effect) -> str:
    """Return what an effect of the setup means for the file that was written."""
    value = fault.value
    sensor = "GPS" if fault.row.acts_on == "gps" else fault.row.acts_on
    if isinstance(value, Axes | GpsAxes):
        columns = "north, east, down" if isinstance(value, GpsAxes) else "x, y, z"
        return f"the {sensor}'s columns {columns} hold {value.axes.replace(' ', ', ')} of the true axes"
    if isinstance(value, TimeOffset):
        return f"the {sensor}'s times are {1e3 * value.offset_s:+.1f} ms off"
    if isinstance(value, BoardRotation):
        degrees = ", ".join(f"{np.degrees(angle):+.1f}" for angle in value)
        return f"the sensor board is turned in the body by the rotation vector ({degrees}) deg"
    if isinstance(value, SiteField):
        return (
            f"the field that is there is turned by {np.degrees(value.declination_rad):+.1f} deg about down, dips "
            f"{np.degrees(value.inclination_rad):+.1f} deg further and is {value.ratio:.3f} times the stated one"
        )
    names = "times of all sensors" if isinstance(value, ClockUnit) else f"{sensor}'s numbers"
    return f"the {names} are in {value.written_in}"
