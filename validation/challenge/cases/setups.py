"""Faults of the setup: how one is drawn, and which of them no recording of a case can tell apart.

A column that holds another axis shows only against something: the other sensors, gravity and field, a command, the
place of the accelerometer. What moves freely takes in the rest: a phase that nobody measured, a field whose direction
in the disc is unknown, a spin whose sense nothing tells. `equivalents` counts these.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import permutations, product
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE, Effect, catalogued, effect, row
from discsim.effects.setup import UNITS, axes_of, permutation
from discsim.effects.track_rows import Camera
from discsim.recording import Plant
from discsim.validation.challenge.cases.case import Case

__all__ = ["draw_fault", "equivalents", "possible_faults"]

#: all signed permutations of three axes
_SIGNED = tuple(
    np.diag(signs) @ np.eye(3)[list(order)]
    for order in permutations(range(3))
    for signs in product((1.0, -1.0), repeat=3)
)
_AXES: Mapping[str, str] = MappingProxyType(
    {"mag.axes": "magnetometer", "accel.axes": "accelerometer", "gyro.axes": "gyroscope"}
)
#: the mistakes that are made: one axis flipped, two swapped, all reversed, all moved on by one
_MISTAKES = (
    ("-x y z", "x -y z", "x y -z"),
    ("y x z", "z y x", "x z y"),
    ("-x -y -z",),
    ("y z x", "z x y"),
)
#: the mirrored motion spins the other way: true vectors change side, rates about x and z their sign
_MIRROR, _MIRROR_RATE = np.diag([1.0, -1.0, 1.0]), np.diag([-1.0, 1.0, -1.0])
#: where a sensor's offset in time is a wrong sensitivity or a phase, as the spin decays in proportion to itself; and
#: where an accelerometer counts by its means over turns alone
_NO_OFFSET: Mapping[Plant, tuple[str, ...]] = MappingProxyType(
    {"spin_down": ("mag", "accel", "gyro"), "free_spin": ("mag", "accel", "gyro")}
)


def possible_faults(case: Case) -> list[str]:
    """Return the ids of the setup faults that can act, and show, on a plant with the sensors that are on board."""
    found = []
    for fault in CATALOGUE.values():
        if not fault.setup or case.plant not in fault.plants or not fault.acts_with(case.instruments.sensors):
            continue
        prefix, _, kind = fault.id.partition(".")
        if kind == "time_offset" and prefix in _NO_OFFSET.get(case.plant, ()):
            continue
        if fault.id not in _AXES or any(_mistakes(fault.id, case)):
            found.append(fault.id)
    return found


def draw_fault(id: str, case: Case, rng: np.random.Generator) -> Effect:
    """Draw the setting, or the sizes, of a fault that shows in a case.

    Offsets run from 5 to 100 ms, a board is turned by 2 to 180 degrees about any line; a field is off by 2 to 40
    degrees in declination, 2 to 20 in dip and 2 to 10 per cent in size. A camera is 30 to 120 m high, as drones are
    that film throws, above a place within 40 m north and east of the release.
    """
    if id in _AXES:
        kinds = [kind for kind in _mistakes(id, case) if kind]
        return effect(id, axes=str(rng.choice(kinds[int(rng.integers(len(kinds)))])))
    if id == "gps.axes":
        return effect(id, axes="east north up")
    if row(id).settings:
        others = [unit for unit in UNITS[row(id).type] if unit != row(id).baseline.written_in]
        return effect(id, written_in=str(rng.choice(others)))
    if id == "board.rotation":
        line = rng.standard_normal(3)
        turned = np.radians(rng.uniform(2.0, 180.0)) * line / np.linalg.norm(line)
        return _sized(id, turned.tolist())
    if id == "site.field":
        declination, dip, size = _off(rng, 2.0, 40.0), _off(rng, 2.0, 20.0), _off(rng, 0.02, 0.1)
        return _sized(id, [np.radians(declination), np.radians(dip), 1.0 + size])
    if id == catalogued(Camera).id:
        return _sized(id, [float(np.exp(rng.uniform(np.log(30.0), np.log(120.0)))), *rng.uniform(-40.0, 40.0, 2)])
    size, drawn = float(np.exp(rng.uniform(np.log(0.005), np.log(0.1)))), rng.choice([-1.0, 1.0])
    return _sized(id, [size * row(id).sign.get("offset_s", drawn)])


def _off(rng: np.random.Generator, least: float, most: float) -> float:
    return float(rng.uniform(least, most) * rng.choice([-1.0, 1.0]))


def _sized(id: str, sizes: Sequence[float]) -> Effect:
    return effect(id, **{name: float(f"{size:.7g}") for name, size in zip(row(id).parameters, sizes, strict=True)})


def _mistakes(id: str, case: Case) -> list[list[str]]:
    """Return the settings of a sensor's axes that show in a case, by the kind of mistake."""
    sound = effect(id, axes="x y z")
    hidden = {sound.value.axes, *(axes for other, axes in equivalents(case, sound) if other == id)}
    return [[axes for axes in kind if axes not in hidden] for kind in _MISTAKES]


# ------------------------------------------------------------------------------------------- what cannot be told


def equivalents(case: Case, fault: Effect) -> tuple[tuple[str, str], ...]:
    """Return the faults of axes (id, axes) that leave just the recordings that ``fault`` leaves; none of other faults.

    On a rig nothing measures the phase of the magnetometer, and a gyroscope feels z alone. In a free spin the same
    holds but for the wobble, which counts for the sense of its turning only; the field points anywhere, and the
    accelerometer shows only the pull to the axis. In flight a sensor that alone tells the attitude may be turned about
    the axis of the round disc, and without a magnetometer a GPS about the vertical. Where only one sensor tells the
    sense of the spin, a flipped magnetometer is a gyroscope flipped about z.
    """
    sensors = case.instruments.sensors
    if fault.id == "gps.axes":
        if "magnetometer" in sensors:
            return ()
        return tuple(("gps.axes", axes_of(permutation(fault.value) @ turn, "gps")) for turn in _QUARTERS[1:])
    if fault.id not in _AXES:
        return ()
    P = permutation(fault.value)
    own = [P @ g for g in _SIGNED if _unseen(_AXES[fault.id], case)(g)]
    found = [(fault.id, axes_of(Q)) for Q in own]
    if _sense_is_free(case) and fault.id in ("mag.axes", "gyro.axes"):
        here, there = (_MIRROR, _MIRROR_RATE) if fault.id == "mag.axes" else (_MIRROR_RATE, _MIRROR)
        other = "gyro.axes" if fault.id == "mag.axes" else "mag.axes"
        if _AXES[other] not in sensors:
            found += [(fault.id, axes_of(Q @ here)) for Q in own]
        elif any(np.array_equal(Q, here) for Q in own):
            found += [(other, axes_of(there @ g)) for g in _SIGNED if _unseen(_AXES[other], case)(g)]
    return tuple(one for one in dict.fromkeys(found) if one != (fault.id, fault.value.axes))


#: turns about z by whole quarters
_QUARTERS = tuple(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1)))


def _unseen(sensor: str, case: Case) -> Callable[[FloatArray], bool]:
    """Tell of changes of a sensor's axes whether sound readings remain sound ones, other sensors as they are."""
    alone = not {"magnetometer", "accelerometer", "gyroscope"} & set(case.instruments.sensors) - {sensor}
    about_z = _among(_QUARTERS)
    if sensor == "accelerometer":
        if case.plant != "free_spin":
            return _among(_QUARTERS[:1])
        place = case.instruments.sensors[sensor].position * [1.0, 1.0, 0.0]  # type: ignore[union-attr]
        return lambda g: np.array_equal(g @ place, place)
    if case.plant == "flight":
        return about_z if alone else _among(_QUARTERS[:1])
    if sensor == "gyroscope":
        return about_z if case.plant == "free_spin" else lambda g: g[2, 2] == 1.0
    if case.plant == "free_spin":
        return lambda g: about_z(g) or about_z(np.diag([1.0, 1.0, -1.0]) @ g)
    return about_z


def _among(some: Sequence[FloatArray]) -> Callable[[FloatArray], bool]:
    return lambda g: any(np.array_equal(g, one) for one in some)


def _sense_is_free(case: Case) -> bool:
    """Tell whether nothing but magnetometer and gyroscope tells which way the disc spins."""
    if case.plant == "spin_down":
        return "rate_reference" not in case.instruments.sensors
    return case.plant == "free_spin"
