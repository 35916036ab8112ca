"""Candidate effects: which numbers of an effect a linear problem can free, and on which grid of the others.

Takes recordings; gives candidates. Parameters that enter a reading in proportion are freed; those that shape it (an
exponent, a height, an instant) are tried on a grid first and freed once the effect is taken up (variable projection:
Golub and Pereyra, 1973).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from discsim.effects.catalogue import CATALOGUE, Row
from discsim.effects.mount_rows import Mount
from discsim.effects.own import UserEffect
from discsim.effects.sensors import PositionOffset
from discsim.recording import Recording
from discsim.validation.identification.competing_effects import CATALOGUED, Competing
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import PLANTS
from discsim.validation.identification.propagation import Column

__all__ = [
    "CandidateEffect",
    "candidates_for",
    "free_candidate",
    "in_parameters",
    "parameters_of",
    "stand_ins",
    "unplaced",
]


@dataclass(frozen=True)
class CandidateEffect:
    """An effect as a hypothesis: free columns, and the recordings it acts in (None: all).

    ``fixed_values`` are parameters (name, value, sd) that a search has found and that no fit moves; ``user`` is an
    effect of the user's own, None for one of the catalogue. ``told_by_one`` is whether one recording alone may tell it.
    """

    id: str
    columns: tuple[Column, ...]
    recordings: frozenset[int] | None = None
    fixed_values: tuple[tuple[str, float, float], ...] = ()
    user: UserEffect | None = field(default=None, compare=False, repr=False)
    told_by_one: bool = field(default=True, compare=False, repr=False)

    @property
    def row(self) -> Row:
        """What is known of the effect."""
        return CATALOGUE[self.id] if self.user is None else self.user.row

    @property
    def name(self) -> str:
        """A name that tells its recordings, too."""
        return self.id if self.recordings is None else f"{self.id}@{','.join(map(str, sorted(self.recordings)))}"

    @property
    def shape_grid(self) -> dict[str, float]:
        """Values of the parameters that shape the effect."""
        return dict(self.columns[0].given) if self.columns else {}


#: a parameter is held this many steps wide, so that one without a trace in the readings stays where it is
_PRIOR_SIGMA = 1e5
#: and an angle of the motion, rad: a rig's axis is plumb to within a few degrees. Of its two tilts the one square to
#: the field hardly shows, and would wander off. So would two chips turned alike about the axis of a round disc,
#: each soldered by eye
_ANGLE = 0.1
#: share of an effect's scale that a difference is taken over
_STEP = 0.1


def _step(row: Row, name: str) -> float:
    if name == row.per_turn:
        return 1e-6  # times the angle turned, hundreds of turns, this is what moves the phase
    return _STEP * row.fitted_scale[name]


def _prior_sigma(row: Row, column: Column) -> float:
    """Return how loosely a parameter is held at its baseline, one sigma."""
    held = (row.acts_on == "motion" or row.type is Mount) and column.name.endswith("_rad")
    return min(_PRIOR_SIGMA * column.step, _ANGLE if held else float("inf"))


def available(recordings: Sequence[Recording], effects: Competing = CATALOGUED) -> list[Row]:
    """Return the effects that can act on these recordings and have a size that a fit can move."""
    plant = recordings[0].plant
    sensors = {sensor for recording in recordings for sensor in recording.samples}
    found = []
    for row in effects.rows:
        if plant not in row.plants or plant in row.unseen_on:
            continue
        if not row.settings and row.acts_with(sensors):
            found.append(row)
    return found


def detected(recordings: Sequence[Recording], detector: str) -> list[Row]:
    """Return the effects that can act on these recordings and that a detector is named for."""
    return [row for row in available(recordings) if row.detector == detector]


def candidates_for(recordings: Sequence[Recording], effects: Competing = CATALOGUED) -> tuple[CandidateEffect, ...]:
    """Return the candidates of all effects that enter linearly, at each of their shapes."""
    candidates = []
    for row in available(recordings, effects):
        if row.detector or any(sensor not in recordings[0].sheets for sensor in row.needs):
            continue
        shape_grid: list[tuple[tuple[str, float], ...]] = [()]
        for name, values in row.grid.items():
            shape_grid = [(*shape, (name, value)) for shape in shape_grid for value in values]
        plant = recordings[0].plant
        candidates += [free_candidate(row.id, shape, effects.user_effect(row.id), plant) for shape in shape_grid]
    return tuple(candidates)


def unplaced(recordings: Sequence[Recording]) -> bool:
    """Tell whether nobody states where the accelerometer of some recording sits."""
    return any("accelerometer" in one.samples and one.sheets["accelerometer"].position is None for one in recordings)


def stand_ins(recordings: Sequence[Recording]) -> tuple[CandidateEffect, ...]:
    """Return the candidates that stand for what nobody stated, and are no errors: where the accelerometer sits."""
    rows = [row for row in available(recordings) if row.type is PositionOffset] if unplaced(recordings) else []
    return tuple(free_candidate(row.id, plant=recordings[0].plant) for row in rows)


def free_candidate(
    id: str, shape: tuple[tuple[str, float], ...] = (), user: UserEffect | None = None, plant: str = ""
) -> CandidateEffect:
    """Return the candidate of an effect in all recordings with every parameter free but those of its ``shape``.

    Nor are those free that no reading of its ``plant`` tells. Where nobody knows the air's moments, what they do to one
    throw may look like another disc: then only all throws together tell one.
    """
    row = CATALOGUE[id] if user is None else user.row
    air_unknown = plant in PLANTS and PLANTS[plant].weakly_identified
    held = {name for name, _ in shape}.union(row.untold.get(plant, ()))
    free = [name for name in row.fitted if name not in held]
    return CandidateEffect(
        id,
        tuple(Column(id, name, _step(row, name), shape) for name in free),
        user=user,
        told_by_one=not (air_unknown and row.in_all and row.acts_on == "motion"),
    )


def parameters_of(candidate: CandidateEffect, *, shaped: bool = True) -> tuple[Parameter, ...]:
    """Return the parameters of a candidate for a fit, its shapes among them where ``shaped``."""
    row = candidate.row
    baseline = row.fitted
    found = [
        Parameter(c.group, c.name, float(baseline[c.name]), c.step, _prior_sigma(row, c), candidate.recordings)
        for c in candidate.columns
    ]
    if shaped:
        for name, value in candidate.shape_grid.items():
            sigma = row.grid_sigma.get(name, float("inf"))
            found.append(Parameter(candidate.id, name, value, _step(row, name), sigma, candidate.recordings))
    return tuple(found)


def in_parameters(row: Row, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return an effect's parameters by name from the numbers that a fit moves, which are the same for most."""
    if row.regular is None or set(numbers) != set(row.fitted):
        return dict(numbers)
    sizes: dict[str, float] = row.regular.effect(row.regular.type(**numbers))._asdict()
    return sizes
