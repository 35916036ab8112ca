"""What a plant is to a fit: everything in which a throw, a free spin, a run-down and a rate table differ.

A plant is one value of `Plant`, in a file of its own beside this one, and one line of the registry
(`discsim.validation.identification.plants`). Numbers and functions of its file are all that the packages ask it for;
none of them asks for a plant by its name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from discsim.arrays import FloatArray
from discsim.frames import conjugate, multiply, rotation_vector, turn
from discsim.law import AIR_SHARE, WIND_TARGETS
from discsim.parameters import Tables
from discsim.recording import Recording
from discsim.toml_table import TomlTable
from discsim.validation.identification.dynamics import ROW
from discsim.validation.identification.parameters import AllowedDefects, Parameter, Values
from discsim.validation.identification.plants.law_terms import Term
from discsim.validation.identification.plants.plan import Plan
from discsim.validation.identification.readings import Readings

__all__ = [
    "Design",
    "Durations",
    "Dynamics",
    "Given",
    "Initial",
    "Layout",
    "MotionLaws",
    "Plant",
    "Sizes",
    "even_nodes",
    "propagated_by",
]

# ------------------------------------------------------------------------------------------ states and their motion


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a state stand that others ask for by name; None for what a state does not hold.

    A state has ``size`` numbers. The four of an attitude (quaternion from B to N) move by small turns in B, in three
    directions; each other number moves by itself. The last ``still`` numbers do not move: they follow from the others,
    or stay. Of a state without an attitude the columns of ``moves`` (s, d) may say which numbers a direction moves.
    ``position`` and ``velocity`` are in N, m and m/s, ``rate`` in B, rad/s; ``spin`` is the rate about the spin axis,
    ``yaw`` a rig's angle about its own, rad. ``per_time`` are the numbers that come out smaller by a ratio where all
    times are written larger by it.
    """

    size: int
    position: slice | None = None
    velocity: slice | None = None
    attitude: slice | None = None
    rate: slice | None = None
    spin: int | None = None
    yaw: int | None = None
    per_time: tuple[int, ...] = ()
    still: int = 0
    moves: tuple[tuple[float, ...], ...] | None = None

    def __post_init__(self) -> None:
        if self.attitude is not None and self.still > self.size - self.attitude.stop:
            raise ValueError(
                f"the last {self.still} of a state's {self.size} numbers do not move, some of its attitude among them; "
                f"expected at most {self.size - self.attitude.stop}"
            )

    @property
    def directions(self) -> int:
        """Number of directions in which a state moves, d."""
        if self.moves is not None:
            return len(self.moves[0])
        return self.size - self.still - (self.attitude is not None)

    def moved(self, states: FloatArray, tangents: FloatArray) -> FloatArray:
        """Return states (..., s) moved by tangents (..., d)."""
        shape = (*np.broadcast_shapes(states.shape[:-1], tangents.shape[:-1]), states.shape[-1])
        new = np.array(np.broadcast_to(states, shape))
        if self.moves is not None:
            return np.asarray(new + tangents @ np.array(self.moves).T)
        if self.attitude is None:
            new[..., : self.directions] += tangents
            return new
        first, last, end = self.attitude.start, self.attitude.stop, self.directions + 1
        new[..., :first] += tangents[..., :first]
        new[..., first:last] = multiply(new[..., first:last], turn(tangents[..., first : last - 1]))
        new[..., last:end] += tangents[..., last - 1 :]
        return new

    def difference(self, a: FloatArray, b: FloatArray) -> FloatArray:
        """Return the tangents (..., d) that move states b (..., s) to a."""
        if self.moves is not None:
            return np.asarray((a - b) @ np.linalg.inv(np.array(self.moves)).T)
        if self.attitude is None:
            return np.asarray(a[..., : self.directions] - b[..., : self.directions])
        first, last, end = self.attitude.start, self.attitude.stop, self.directions + 1
        turned = rotation_vector(multiply(conjugate(b[..., first:last]), a[..., first:last]))
        before, after = a[..., :first] - b[..., :first], a[..., last:end] - b[..., last:end]
        return np.concatenate([before, turned, after], axis=-1)

    def directions_of(self, places: slice | int) -> tuple[int, ...]:
        """Return the directions that move the numbers at some places of a state, or its attitude, and no others."""
        numbers = range(places, places + 1) if isinstance(places, int) else range(places.start, places.stop)
        if self.moves is not None:
            columns = zip(*self.moves, strict=True)
            return tuple(j for j, c in enumerate(columns) if all(bool(x) == (n in numbers) for n, x in enumerate(c)))
        if self.attitude is None or numbers.stop <= self.attitude.start:
            return tuple(numbers)
        if numbers.start == self.attitude.start:
            return tuple(numbers[:-1])
        return tuple(number - 1 for number in numbers)


@dataclass(frozen=True)
class Given:
    """What the motion of one recording depends on beside states and parameters.

    ``tables`` are coefficients and laws, ``knots`` (2, n) times and rates of a command; ``order`` is the highest order
    of a speed ripple, and an ``uneven`` body makes the motion follow the spin.
    """

    recording: Recording
    tables: Tables
    knots: FloatArray
    order: float = 0.0
    uneven: bool = False


#: given, flats (c, k) with the parameters of the physics, those of the plant's own (c, o), states (c, s), the steps of
#: the integrator (n,), the place of a segment's end in them, instants (m,); gives rows (c, m, 19) of the motion at the
#: instants, as `discsim.validation.identification.dynamics` has them, and the states (c, s) at the end
Propagate: TypeAlias = Callable[
    [Given, FloatArray, FloatArray, FloatArray, FloatArray, int, FloatArray], tuple[FloatArray, FloatArray]
]


def _tables(given: Given, own: FloatArray) -> Tables:
    del own
    return given.tables


def propagated_by(segments: Callable[..., None], beside: Callable[[Given, FloatArray], Any] = _tables) -> Propagate:
    """Return a plant's motion by its compiled loop over states, which fills rows (c, m, 19) and ends (c, s).

    ``beside`` gives what the loop takes beside the parameters of the physics, of what is given and the plant's own.
    """

    def propagate(
        given: Given,
        flats: FloatArray,
        own: FloatArray,
        states: FloatArray,
        times: FloatArray,
        last: int,
        out: FloatArray,
    ) -> tuple[FloatArray, FloatArray]:
        rows, ends = np.empty((states.shape[0], out.size, ROW)), np.empty(states.shape)
        segments(flats, beside(given, own), states, times, last, out, rows, ends)
        return rows, ends

    return propagate


def _no_corners(given: Given, start: float, stop: float) -> list[float]:
    del given, start, stop
    return []


def _itself(states: FloatArray) -> FloatArray:
    return states


@dataclass(frozen=True)
class Dynamics:
    """How states move.

    ``longest_step`` gives the longest step (s) of the integrator from a state (s,) on between two instants, ``corners``
    the instants there over which no step may leap; ``consistent`` gives states (k, s) of which some were moved with the
    numbers that follow from others put right.
    """

    propagate: Propagate
    longest_step: Callable[[Given, FloatArray, float, float], float]
    corners: Callable[[Given, float, float], list[float]] = _no_corners
    consistent: Callable[[FloatArray], FloatArray] = _itself


def _no_attitudes(recording: Recording) -> tuple[FloatArray, ...]:
    del recording
    return ()


def _no_states(recording: Recording, t: FloatArray, ratio: float) -> tuple[FloatArray, ...]:
    del recording, t, ratio
    return ()


@dataclass(frozen=True)
class Initial:
    """Where a fit starts, from the data alone.

    ``states`` (k, s) at instants (k,) s where times are written as a ratio of the true ones; ``other_attitudes`` (4,)
    at release are worth trying, too, and so are ``other_states``, as ``states``.
    """

    states: Callable[[Recording, FloatArray, float], FloatArray]
    other_attitudes: Callable[[Recording], tuple[FloatArray, ...]] = _no_attitudes
    other_states: Callable[[Recording, FloatArray, float], tuple[FloatArray, ...]] = _no_states


# -------------------------------------------------------------------------------------------------- sizes and times


@dataclass(frozen=True)
class Sizes:
    """Sizes in each direction of a state (d,), in its units.

    ``differences`` are half the differences by which slopes are taken; ``unknown`` is what is known of a state without
    any reading, one sigma. ``continuous`` are the defects of continuity that a fit allows whose segments are
    continuous, ``counted`` the same of recordings whose rows were counted one by one, where they are others;
    ``relaxed`` are those that it allows to stay beside the data whatever physics is missing. ``of_path`` is ``unknown``
    where readings tell a path alone, of which a turn of the body about its own axis changes nothing. ``of_wobble`` is
    the share of a wobble to which its model of the air follows it for a turn or two.
    """

    differences: FloatArray
    unknown: FloatArray
    continuous: AllowedDefects
    relaxed: AllowedDefects
    counted: AllowedDefects | None = None
    of_path: FloatArray | None = None
    of_wobble: float = 0.0


class Durations(NamedTuple):
    """Lengths of time, s.

    Attributes
    ----------
    segment : float
        A segment of motion.
    first_look : float
        The beginning that is asked whether any motion follows all sensors.
    window : float
        A window within which a sensor that is late by anything is compared with a motion.
    longest : float
        What is looked at of a recording at most.
    setup : float
        What is judged of a recording for faults of its setup.
    event_near : float
        How far about the best node the instant of an event is looked for.
    event_from : float
        An event before this instant is not told from where the motion started.
    settled : float
        What is left before this instant is not asked whether it is noise.
    """

    segment: float
    first_look: float
    window: float
    longest: float
    setup: float
    event_near: float = 0.0
    event_from: float = 0.0
    settled: float = -np.inf


def even_nodes(recording: Recording, segment: float) -> FloatArray:
    """Return the nodes (k + 1,) of segments of one length, about ``segment`` s."""
    count = max(1, round(recording.end / segment))
    return np.linspace(0.0, max(recording.end, 1e-3) + 1e-6, count + 1)


# ------------------------------------------------------------------------------------------------ laws and designs


def _time_alone(recording: Recording, t: FloatArray, states: FloatArray, values: Values) -> dict[str, FloatArray]:
    del recording, states, values
    return {"t": t}


def _nowhere(states: Sequence[Mapping[str, FloatArray]]) -> tuple[Term, ...]:
    del states
    return ()


#: half the differences in a share of what the air does, and in a wind, m/s
_SHARE_STEP, _WIND_STEP = 1e-3, 0.05


@dataclass(frozen=True)
class MotionLaws:
    """What an unknown law about the motion may be made of.

    ``terms`` are asked for first, and those that ``places`` makes of the symbols of all recordings, each (k,);
    ``symbols`` gives what they are made of, each (k,), at instants (k,) s with states (k, s); ``force_step`` and
    ``moment_step`` are half the differences in a force and a moment, N and N m.
    """

    terms: tuple[Term, ...] = ()
    symbols: Callable[[Recording, FloatArray, FloatArray, Values], dict[str, FloatArray]] = _time_alone
    force_step: float = 2e-2
    moment_step: float = 2e-5
    places: Callable[[Sequence[Mapping[str, FloatArray]]], tuple[Term, ...]] = _nowhere

    def step(self, target: str) -> float:
        """Return half the difference in a force, a moment, a share or a wind."""
        if target == AIR_SHARE:
            return _SHARE_STEP
        if target in WIND_TARGETS:
            return _WIND_STEP
        return self.force_step if target.endswith("_N") else self.moment_step


def _as_planned(planned: FloatArray, states: FloatArray) -> FloatArray:
    del states
    return planned


@dataclass(frozen=True)
class Design:
    """Recordings that could be made next.

    ``about`` lists them about one in hand, first the same again: from the recording, its first state (s,), its end and
    the length of the longest in hand, both in s; ``read`` takes one of a person's own list. ``as_in_hand`` gives a
    planned first state (s,) with what it cannot say as the states (k, s) of one in hand have it.
    """

    about: Callable[[Recording, FloatArray, float, float], list[Plan]]
    read: Callable[[TomlTable], Plan]
    as_in_hand: Callable[[FloatArray, FloatArray], FloatArray] = _as_planned


# ------------------------------------------------------------------------------------------------------- the plant


def _nothing_lacks(recording: Recording) -> str | None:
    del recording
    return None


def _readings_tell(recording: Recording) -> bool:
    del recording
    return False


def _as_read(recording: Recording, readings: Readings) -> Sequence[Readings]:
    del recording
    return (readings,)


def _against_time(t: FloatArray, states: FloatArray) -> dict[str, FloatArray]:
    del states
    return {"time": t}


@dataclass(frozen=True, eq=False)
class Plant:
    """One kind of experiment.

    Attributes
    ----------
    name : str
        As ``plant`` in recording.toml has it.
    motion : str
        What one of its motions is called: the best *flight*.
    layout, dynamics, initial, sizes, durations
        See these types.
    nodes : function
        The nodes (k + 1,) of a recording's segments, s, of about a given length.
    path_alone : function
        Whether a recording has a path and no reading of how the body turns.
    own : tuple of Parameter
        Parameters of its motion that neither the catalogue nor a recording's hardware has, with what is known of them
        before any reading; their group is its name. Each recording has its own, unless a fit says otherwise.
    held : tuple of Parameter
        What an accelerometer that lags still holds along x, y, z when a recording begins, beyond what it would read
        had it been there for long, m/s^2; of their group, and each recording's own, too. Where there are none, what
        such a lag remembers is left out.
    zeros : tuple of Parameter
        What a magnetometer that free-runs beside its logger reads along x, y, z beyond the iron on board in one
        recording, uT, as it warms; of their group, and each recording's own.
    hardware : tuple of str
        The groups of stated numbers that its motion depends on: "disc", "aero", "rig".
    lacks : function
        What a recording lacks that its motion cannot do without, in words; None for nothing.
    observed : function
        What counts of a sensor's usable readings.
    path_known : bool
        Whether its rows hold how the place of the sensors moves, so that an accelerometer's every reading is told.
    commanded : bool
        Whether a command prescribes its motion, which no event disturbs.
    weakly_identified : bool
        Whether readings of ordinary quality leave so much of its motion open that its beginning follows anything, and
        free Gauss-Newton steps may hop about.
    base_steps : int
        Most Gauss-Newton steps of a fit of the baseline.
    grows_with : function
        What a mismatch may grow with, by name, each (k,), from instants (k,) s and states (k, s).
    laws : MotionLaws
    design : Design or None
        None where no next recording can be proposed.
    unbalanced : Plant or None
        The same of a body that moments fixed in it turn, such as of the air's force about a centre of mass beside the
        middle; None where the plant's effects tell of them, or where its motion has no room for one.
    """

    name: str
    motion: str
    layout: Layout
    dynamics: Dynamics
    initial: Initial
    sizes: Sizes
    durations: Durations
    nodes: Callable[[Recording, float], FloatArray] = even_nodes
    path_alone: Callable[[Recording], bool] = _readings_tell
    own: tuple[Parameter, ...] = ()
    held: tuple[Parameter, ...] = ()
    zeros: tuple[Parameter, ...] = ()
    hardware: tuple[str, ...] = ()
    lacks: Callable[[Recording], str | None] = _nothing_lacks
    observed: Callable[[Recording, Readings], Sequence[Readings]] = _as_read
    path_known: bool = True
    commanded: bool = False
    weakly_identified: bool = False
    base_steps: int = 8
    grows_with: Callable[[FloatArray, FloatArray], Mapping[str, FloatArray]] = _against_time
    laws: MotionLaws = field(default_factory=MotionLaws)
    design: Design | None = None
    unbalanced: Plant | None = None

    @property
    def airborne(self) -> bool:
        """Whether its body turns freely in the air, so that its attitude is part of its states."""
        return self.layout.attitude is not None

    @property
    def follows_path(self) -> bool:
        """Whether its states hold a path through the air."""
        return self.layout.position is not None

    @property
    def air_modelled(self) -> bool:
        """Whether the forces of the air act on it as its disc states them: they know a disc's top from its bottom."""
        return "aero" in self.hardware

    @cached_property
    def own_keys(self) -> tuple[tuple[str, str], ...]:
        """Group and name of its own parameters, those of the motion first."""
        return tuple(parameter.key for parameter in (*self.own, *self.held, *self.zeros))

    @cached_property
    def motion_keys(self) -> tuple[tuple[str, str], ...]:
        """Group and name of its own parameters that act on the motion."""
        return self.own_keys[: len(self.own)]

    @cached_property
    def held_keys(self) -> tuple[tuple[str, str], ...]:
        """Group and name of what a lag holds when a recording begins."""
        return self.own_keys[len(self.own) : len(self.own) + len(self.held)]

    @cached_property
    def zero_keys(self) -> tuple[tuple[str, str], ...]:
        """Group and name of what a magnetometer's zero is off by in a recording."""
        return self.own_keys[len(self.own) + len(self.held) :]

    def continuous_defects(self, recordings: Sequence[Recording]) -> AllowedDefects:
        """Return the defects of continuity that a fit of recordings allows whose segments are continuous."""
        if self.sizes.counted is not None and any(recording.averaged for recording in recordings):
            return self.sizes.counted
        return self.sizes.continuous

    def own_values(self, values: Values) -> FloatArray:
        """Return its own parameters (o,), as given or as they stand without a fit."""
        return np.array([values.get(parameter.key, parameter.stated) for parameter in self.own])
