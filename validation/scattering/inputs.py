"""What is uncertain of a throw: release, disc, air and coefficients, as one normal distribution, and draws from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Aero, Disc, Release, aero_key
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.launch import Launch, launch_of, launch_states
from discsim.parameters import PARAMETERS, flight_parameters, parameter_index

__all__ = ["Drawn", "Fitted", "Input", "Inputs", "inputs_of"]

_DEG, _RPM = float(np.degrees(1.0)), 30.0 / np.pi
#: words of a release, with the unit in which people say them and how many of it one SI unit is
_RELEASE: Mapping[str, tuple[str, float]] = {
    "speed": ("m/s", 1.0),
    "launch": ("deg", _DEG),
    "heading": ("deg", _DEG),
    "hyzer": ("deg", _DEG),
    "nose": ("deg", _DEG),
    "spin": ("rpm", _RPM),
    "height": ("m", 1.0),
    "wobble_p": ("deg/s", _DEG),
    "wobble_q": ("deg/s", _DEG),
}
#: numbers of the surroundings and the disc: group and name in the flat parameters, unit, key of a stated sigma
_STATED: Mapping[str, tuple[str, str, str, str]] = {
    "wind_north": ("environment", "wind_north", "m/s", "wind_ned_m_s"),
    "wind_east": ("environment", "wind_east", "m/s", "wind_ned_m_s"),
    "air_density": ("environment", "air_density", "kg/m^3", "air_density_kg_m3"),
    "mass": ("disc", "mass", "kg", "mass_kg"),
    "Ixx": ("disc", "Ixx", "kg m^2", "Ixx_kg_m2"),
    "Izz": ("disc", "Izz", "kg m^2", "Izz_kg_m2"),
    **{name: ("aero", name, "", aero_key(name)) for name in Aero._fields},
}
#: names that stand for several
_SHORT: Mapping[str, tuple[str, ...]] = {"wind": ("wind_north", "wind_east"), "wobble": ("wobble_p", "wobble_q")}
#: what a fit calls a number that has another name here
_FITTED_AS = {"alpha0_rad": "alpha0", "environment.air_density": "air_density", "disc.mass": "mass"} | {
    f"{group}.{name}": name for group in ("disc", "environment") for name in ("Ixx", "Izz", "wind_north", "wind_east")
}
#: numbers above zero. An sd of more than twice such a number is one in another unit: 3 of 10 draws would be below zero
_POSITIVE, _MOST_OF_IT = frozenset({"speed", "height", "air_density", "mass", "Ixx", "Izz"}), 2.0
#: draws that no throw can have are drawn again, at most so often
_TRIES = 100


class Fitted(NamedTuple):
    """What a fit found: names, values (k,) and covariance (k, k), SI; ``source`` says from where."""

    names: tuple[str, ...]
    value: FloatArray
    covariance: FloatArray
    source: str


class Input(NamedTuple):
    """One uncertain number: mean and standard deviation in ``unit``, where that is stated, and its place.

    ``place`` is that in the flat parameters of the physics, None for a word of the release; ``factor`` how many units
    are one SI unit.
    """

    name: str
    unit: str
    mean: float
    sd: float
    source: str
    factor: float
    place: int | None


class Drawn(NamedTuple):
    """Throws that were drawn: inputs (n, k) in their units, states (n, 14), flat parameters (n, m).

    ``refused`` draws were no throw and were drawn again.
    """

    inputs: FloatArray
    states: FloatArray
    parameters: FloatArray
    refused: int


@dataclass(frozen=True)
class Inputs:
    """The uncertain numbers of a throw and their covariance (k, k), in their units; all else is as stated."""

    items: tuple[Input, ...]
    covariance: FloatArray
    release: Release
    flat: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(item.name for item in self.items)

    def groups(self) -> list[list[int]]:
        """Return the places of inputs that vary together: each group is independent of the others."""
        groups: list[list[int]] = []
        for k in range(len(self.items)):
            joined = [group for group in groups if np.any(self.covariance[k, group] != 0.0)]
            groups = [group for group in groups if group not in joined]
            groups.append(sorted([k, *(i for group in joined for i in group)]))
        return sorted(groups)

    def draw(self, count: int, rng: np.random.Generator) -> Drawn:
        """Draw ``count`` throws; raises `InputError` where hardly any draw is a throw."""
        mean = np.array([item.mean for item in self.items])
        root = _root(self.covariance)
        rows = mean + rng.standard_normal((count, mean.size)) @ root.T
        refused = 0
        for _ in range(_TRIES):
            again = np.flatnonzero(~self._possible(rows))
            if not again.size:
                return Drawn(rows, *self._made(rows), refused)
            refused += again.size
            rows[again] = mean + rng.standard_normal((again.size, mean.size)) @ root.T
        raise InputError(
            f"{again.size} of {count} draws are no throw even after {_TRIES} tries; expected smaller standard "
            "deviations of speed, height, mass and inertia"
        )

    def _made(self, rows: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return states (n, 14) and flat parameters (n, m) of inputs (n, k)."""
        n = rows.shape[0]
        nominal = launch_of(self.release)._asdict()
        words = {name: np.full(n, value) for name, value in nominal.items()}
        assert self.release.body_rate is not None
        wobble = np.tile(self.release.body_rate[:2], (n, 1))
        flats = np.tile(self.flat, (n, 1))
        for item, column in zip(self.items, rows.T, strict=True):
            if item.place is not None:
                flats[:, item.place] = column / item.factor
            elif item.name in ("wobble_p", "wobble_q"):
                wobble[:, item.name == "wobble_q"] = (column / item.factor)[:, None]
            else:
                words[item.name] = column / item.factor
        return launch_states(Launch(**words), wobble, self.release), flats

    def _possible(self, rows: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Tell which inputs (n, k) are a disc in the air: what divides is above zero, no inertia beyond a plate's."""
        states, flats = self._made(rows)
        view = flats.view(PARAMETERS)[:, 0]
        body, air = view["disc"], view["environment"]["air_density"]
        positive = (body["mass"] > 0) & (body["Ixx"] > 0) & (body["Izz"] > 0) & (air > 0) & (states[:, 2] < 0)
        speed = np.einsum("ni,ni->n", states[:, 3:6], states[:, 3:6])
        named = {item.name: column for item, column in zip(self.items, rows.T, strict=True)}
        forward = named["speed"] > 0.0 if "speed" in named else True
        return np.asarray(positive & (speed > 0) & forward & (body["Izz"] <= 2 * body["Ixx"] * (1 + 1e-9)))


def _root(covariance: FloatArray) -> FloatArray:
    """Return a root R of a covariance, R R^T = covariance; it may be singular."""
    sd = np.sqrt(np.diag(covariance))
    safe = np.where(sd > 0, sd, 1.0)
    w, V = np.linalg.eigh(covariance / np.outer(safe, safe))
    if w[0] < -1e-6 * max(float(w[-1]), 1.0):
        raise InputError("the covariance of the fit has a negative eigenvalue; expected that of a fit")
    return np.asarray(safe[:, None] * V * np.sqrt(np.maximum(w, 0.0)))


def inputs_of(
    disc: Disc,
    environment: Environment,
    release: Release,
    *,
    effects: Sequence[Effect] = (),
    sigma: Mapping[tuple[str, str], float] | None = None,
    fitted: Fitted | None = None,
    sd: Mapping[str, float] | None = None,
) -> Inputs:
    """Gather what is uncertain of a throw.

    Parameters
    ----------
    disc, environment, release
        Their stated sigmas count; those of the release are turned into the words of `discsim.launch`, to first order.
    effects, sigma
        Effects upon the flight, and one sigma of their parameters by (id, parameter).
    fitted : Fitted, optional
        Values and covariance of a fit, in the place of what the disc states.
    sd : mapping, optional
        Standard deviations by name, in the units that people use, in the place of any other; ``wind`` and ``wobble``
        stand for both of their components, zero takes an input out.

    Raises `InputError` for an unknown name, and where nothing is uncertain.
    """
    flat = flight_parameters(disc, environment, effects)
    items, blocks = _release_items(release)
    for name, (group, place, unit, key) in _STATED.items():
        held = (disc.sigma if group != "environment" else environment.sigma).get(key)
        size = 0.0 if held is None else _component(held, name)
        index = parameter_index(group, place)
        items[name] = Input(name, unit, float(flat[index]), size, "stated", 1.0, index)
    for (id, name), size in (sigma or {}).items():
        index = parameter_index(id, name)
        items[f"{id}.{name}"] = Input(f"{id}.{name}", "", float(flat[index]), size, "model", 1.0, index)
    if fitted is not None:
        _take_fit(items, blocks, flat, fitted)
    for given, size in (sd or {}).items():
        for name in _SHORT.get(given, (given,)):
            if name not in items:
                known = [*items, *_SHORT]
                near = {one.casefold(): one for one in known}.get(given.casefold())
                hint = f"; did you mean '{near}'?" if near else ""
                raise InputError(f"--sd {given}: unknown{hint} (expected some of {', '.join(known)})")
            if not (np.isfinite(size) and size >= 0.0):
                raise InputError(f"--sd {given}={size:g}: expected a standard deviation, zero or more")
            items[name] = items[name]._replace(sd=float(size), source="given")
            blocks = {pair: value for pair, value in blocks.items() if name not in pair}
    kept = [_in_its_unit(item) for item in items.values() if item.sd > 0.0]
    if not kept:
        raise InputError(
            "nothing is uncertain: expected sigmas in the throw, the disc or the model, --fit, or --sd such as "
            "--sd speed=0.5,launch=1,hyzer=2,nose=1,spin=50,wind=1"
        )
    covariance = np.diag([item.sd**2 for item in kept])
    for i, one in enumerate(kept):
        for j, other in enumerate(kept):
            covariance[i, j] = blocks.get((one.name, other.name), covariance[i, j])
    return Inputs(tuple(kept), covariance, replace(release, sigma={}), flat)


def _in_its_unit(item: Input) -> Input:
    """Return an input; raises `InputError` for an sd beside which a number above zero might as well be below."""
    if item.name in _POSITIVE and item.sd > _MOST_OF_IT * abs(item.mean):
        word = f"--sd {item.name}={item.sd:g}" if item.source == "given" else f"{item.name}: the sd {item.sd:g}"
        raise InputError(
            f"{word} is {item.sd / abs(item.mean):.0f} times the {item.mean:.3g} {item.unit} that it is about; "
            f"expected a standard deviation in {item.unit}"
        )
    return item


def _component(held: float | FloatArray, name: str) -> float:
    """Return the sigma of one number, or of the component of a vector that a name is about."""
    values = np.broadcast_to(np.asarray(held, dtype=float), 3)
    return float(values[1 if name.endswith("east") else 0])


def _release_items(release: Release) -> tuple[dict[str, Input], dict[tuple[str, str], float]]:
    """Return the words of a release with their sds, and the covariances that its stated sigmas give them."""
    place, velocity, _, rate = release.start()
    base = replace(
        release, position=place, velocity=velocity, roll=release.roll or 0.0, pitch=release.pitch or 0.0, sigma={}
    )

    def words(shift: FloatArray) -> FloatArray:
        moved = replace(
            base,
            position=place + np.array([0.0, 0.0, shift[0]]),
            velocity=velocity + shift[1:4],
            roll=(base.roll or 0.0) + shift[4],
            pitch=(base.pitch or 0.0) + shift[5],
            body_rate=rate + shift[6:9],
        )
        said = launch_of(moved)
        return np.array([*said, *(rate + shift[6:9])[:2]])

    stated = _stated_sd(release)
    step = 1e-4
    slopes = np.column_stack([(words(step * axis) - words(-step * axis)) / (2 * step) for axis in np.eye(9)])
    slopes[np.abs(slopes) < 1e-7] = 0.0  # what does not move but for rounding
    factors = np.array([factor for _, factor in _RELEASE.values()])
    covariance = (slopes * stated**2) @ slopes.T * np.outer(factors, factors)
    sd = np.sqrt(np.diag(covariance))
    mean = words(np.zeros(9)) * factors
    items = {
        name: Input(name, unit, float(mean[k]), float(sd[k]), "stated", factor, None)
        for k, (name, (unit, factor)) in enumerate(_RELEASE.items())
    }
    blocks = {
        (one, other): float(covariance[i, j])
        for i, one in enumerate(_RELEASE)
        for j, other in enumerate(_RELEASE)
        if i != j and covariance[i, j] != 0.0
    }
    return items, blocks


def _stated_sd(release: Release) -> FloatArray:
    """Return the stated sds (9,) of down, velocity, roll, pitch and body rate; zero where none is stated."""

    def of(key: str, size: int) -> FloatArray:
        return np.broadcast_to(np.asarray(release.sigma.get(key, 0.0), dtype=float), size)

    down = of("position_ned_m", 3)[2:]
    angles = (of("roll_rad", 1), of("pitch_rad", 1))
    return np.concatenate([down, of("velocity_ned_m_s", 3), *angles, of("body_rate_rad_s", 3)])


def _take_fit(items: dict[str, Input], blocks: dict[tuple[str, str], float], flat: FloatArray, fitted: Fitted) -> None:
    """Put a fit's values and covariance in the place of what is stated."""
    names = [_FITTED_AS.get(name, name) for name in fitted.names]
    for k, name in enumerate(names):
        if name not in items or items[name].place is None:
            raise InputError(f"{fitted.source}: '{fitted.names[k]}' is no number of a flight; expected coefficients")
        value, size = float(fitted.value[k]), float(np.sqrt(fitted.covariance[k, k]))
        items[name] = items[name]._replace(mean=value, sd=size, source=fitted.source)
        flat[items[name].place] = value
        for j, other in enumerate(names):
            if j != k and fitted.covariance[k, j] != 0.0:
                blocks[name, other] = float(fitted.covariance[k, j])
