"""What a row of the catalogue says of an effect: its type, what it acts on, how people read it, how a fit treats it."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

__all__ = ["AIRBORNE", "BOARD", "EVERYWHERE", "FLIGHT", "RIGS", "UNSEEN_IN_MEANS", "Regular", "Row", "with_article"]

FLIGHT = ("flight",)
AIRBORNE = ("flight", "free_spin")
RIGS = ("rate_table", "spin_down")
EVERYWHERE = ("flight", "rate_table", "spin_down", "free_spin")
#: the sensors that share one board
BOARD = frozenset({"magnetometer", "accelerometer", "gyroscope"})
#: sensor -> plants on which it counts by its means over turns alone: what moves or loses samples does not show in them
UNSEEN_IN_MEANS = MappingProxyType({"accelerometer": ("free_spin",)})

_NOTHING: Mapping[str, Any] = MappingProxyType({})


def with_article(sensor: str) -> str:
    """Return a sensor's name behind its article: "an accelerometer"."""
    return f"{'an' if sensor[0] in 'aeiou' else 'a'} {sensor}"


class Regular(NamedTuple):
    """Numbers that a fit moves in place of an effect's parameters, where these are not regular at the baseline.

    ``type`` has them, the baseline by default; ``scale`` is a small but visible size of each; ``effect`` returns the
    effect of such numbers. Whatever reads the effect takes either.
    """

    type: type[Any]
    scale: tuple[float, ...]
    effect: Callable[..., Any]


class Row(NamedTuple):
    """One effect of the catalogue.

    ``acts_on`` is "motion", the sensor it belongs to, "clock" for all of a recording's sensors or "board" for those
    that share one; ``scale`` gives a small but visible size of each parameter, in its unit; an ``event`` happens in
    one recording; a ``setup`` fault is one of what was set up or stated, and no physics.

    For a reader: ``title`` is what the effect is called, ``form`` its form as HTML with parameters in braces,
    ``grows_with`` the state that its trace grows with, ``trace`` what an experimenter sees; ``units`` are those of
    parameters whose names do not tell.

    For a fit, by a parameter's name: ``bounds`` within which it makes sense, the ``sign`` that physics gives it,
    ``positive`` those that have no meaning at or below zero, ``grid`` the values at which a parameter that shapes the
    effect is tried first, and ``grid_sigma`` how uncertain it is before it is fitted. A ``detector`` is named where one
    finds the effect and no linear question about whole recordings does. It ``moves_time`` where it moves nothing but
    the instants at which samples were taken; its parameters are places ``on_disc``; on the plants of ``unseen_on`` no
    reading shows it, nor where a sheet of the sensors it ``needs`` is absent; on a plant some parameters may be
    ``untold`` by any reading.

    On its nature: an event ``lasts`` some seconds, or as long as the parameter that is named there says; what comes
    with a disc, with how a sensor is made or with a place is ``in_all`` of its recordings, what is done by hand for
    each has sizes that are ``each_its_own``; one that ``follows_spin`` makes the motion pulse with the turns, one
    ``per_turn`` so many times as that parameter says; one of the motion that is ``also_read`` changes what a sensor
    reads of a given motion, too; one that ``hides_readings`` leaves no reading behind that a fit could use; parameters
    ``in_percent`` are shares; it ``becomes`` (another effect's id, by its parameter, at a value).

    Where a parameter is infinite at the baseline, ``regular`` tells what a fit moves instead; rules for a fit are then
    of those numbers.

    ``apply`` is all that an effect with no place in the engines and sensors needs: a function of the forms that
    `discsim.effects.applied` tells.
    """

    id: str
    type: type[Any]
    acts_on: str
    plants: tuple[str, ...]
    scale: tuple[float, ...]
    event: bool = False
    setup: bool = False
    title: str = ""
    form: str = ""
    grows_with: str = ""
    trace: str = ""
    units: Mapping[str, str] = _NOTHING
    bounds: Mapping[str, tuple[float, float]] = _NOTHING
    sign: Mapping[str, float] = _NOTHING
    positive: tuple[str, ...] = ()
    grid: Mapping[str, tuple[float, ...]] = _NOTHING
    grid_sigma: Mapping[str, float] = _NOTHING
    detector: str = ""
    moves_time: bool = False
    on_disc: bool = False
    unseen_on: tuple[str, ...] = ()
    untold: Mapping[str, tuple[str, ...]] = _NOTHING
    needs: tuple[str, ...] = ()
    lasts: float | str = 0.0
    in_all: bool = False
    each_its_own: bool = False
    follows_spin: bool = False
    per_turn: str = ""
    also_read: bool = False
    hides_readings: bool = False
    in_percent: bool = False
    becomes: tuple[str, str, float] | None = None
    regular: Regular | None = None
    apply: Callable[..., Any] | None = None

    @property
    def key(self) -> str:
        """The id as an identifier (``air_wind``)."""
        return self.id.replace(".", "_")

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, which are numbers, units in the name."""
        return tuple(self.sizes)

    @property
    def settings(self) -> tuple[str, ...]:
        """Names of the settings, which are texts; no fit can move one."""
        return tuple(name for name, none in self.baseline._asdict().items() if isinstance(none, str))

    @property
    def example(self) -> str:
        """Its parameters at a small but visible size, as ``--effect`` takes them behind the id and a colon."""
        return ",".join(f"{name}={size:g}" for name, size in zip(self.parameters, self.scale, strict=False))

    @property
    def brief(self) -> bool:
        """Whether it is an event of a length that is known: a blow, not a gust."""
        return self.event and not isinstance(self.lasts, str)

    @property
    def sizes(self) -> dict[str, float]:
        """The parameters at the baseline, by name."""
        return {name: none for name, none in self.baseline._asdict().items() if not isinstance(none, str)}

    @property
    def fitted(self) -> dict[str, float]:
        """What a fit moves, at the baseline, by name: the parameters, or the regular numbers in their place."""
        return self.sizes if self.regular is None else self.regular.type()._asdict()

    @property
    def fitted_scale(self) -> dict[str, float]:
        """A small but visible size of each number that a fit moves, by name."""
        scale = self.scale if self.regular is None else self.regular.scale
        return dict(zip(self.fitted, scale, strict=True))

    @property
    def baseline(self) -> Any:
        """The effect at its baseline: no effect."""
        return self.type()

    def acts_with(self, sensors: Collection[str]) -> bool:
        """Tell whether it can act on a recording that has these sensors."""
        if self.acts_on == "board":
            return not BOARD.isdisjoint(sensors)
        return self.acts_on in ("motion", "clock") or self.acts_on in sensors
