"""An early end where no motion of the plant follows the readings: which sensors contradict which.

Takes recordings; gives None, or a `Contradiction` (fault isolation by leaving each sensor out). A search among effects
is of use beside a fit that follows the data. Where not even short beginnings of recordings are followed, with all that
a relaxed fit sets free and free clocks besides, nothing that comes after would help: it would only take minutes. Here
each sensor is left out in turn, then each is looked at alone and in pairs, and what can be followed together and what
cannot is the answer.

All limits are counts (recordings, seconds of them, steps): the same recordings give the same answer on any machine.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from types import MappingProxyType

import numpy as np

from discsim.effects.catalogue import CATALOGUE
from discsim.effects.sensors import Lag
from discsim.recording import SENSORS, Recording
from discsim.validation.diagnosis.candidates.evidence import BOUNDS
from discsim.validation.diagnosis.consistency.followed import left_of, left_when_shifted, left_when_turned, true_noise
from discsim.validation.diagnosis.consistency.spin_rates import RatesApart, rates_apart
from discsim.validation.diagnosis.detectors.dropped_samples import loses_samples
from discsim.validation.diagnosis.detectors.speed_ripple import ripple
from discsim.validation.diagnosis.first_trajectory import beginning, first_trajectory
from discsim.validation.diagnosis.relaxed_fit.astray import from_other_initial_states
from discsim.validation.diagnosis.relaxed_fit.parameters import free_clocks, relaxed_parameters
from discsim.validation.diagnosis.settings import CONSISTENCY
from discsim.validation.identification.gauss_newton import Fit, refit
from discsim.validation.identification.noise import GroupNoise
from discsim.validation.identification.observations import readings_of
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.readings import Readings, group_of
from discsim.validation.identification.segments import Trajectory
from discsim.validation.identification.sensor_model import Values

__all__ = [
    "Contradiction",
    "Look",
    "contradiction_after",
    "contradiction_in",
    "look_at",
]

#: most steps of one look, and of one that serves for figures alone
_STEPS, _STEPS_OF_FIGURES = 8, 2


@dataclass(frozen=True)
class Look:
    """A fit of the beginnings of a few recordings to some of their sensors, and what it leaves of each.

    ``places`` are the recordings' numbers; ``left`` is by recording and sensor, in ``noise`` that no misfit inflates.
    """

    sensors: tuple[str, ...]
    places: tuple[int, ...]
    fit: Fit
    noise: Mapping[str, GroupNoise]
    left: tuple[Mapping[str, float], ...]

    def level(self, sensor: str) -> float:
        """Return what is left of a sensor in the median recording that has it; 0 where none has."""
        return float(np.median([one[sensor] for one in self.left if sensor in one] or [0.0]))

    @property
    def follows(self) -> bool:
        """Whether the sensors are followed, all of them in half of the recordings or more."""
        lost = [any(level > CONSISTENCY.astray for level in one.values()) for one in self.left]
        return 2 * sum(lost) <= len(lost)


@dataclass(frozen=True)
class Contradiction:
    """Sensors that no motion follows together.

    ``whole`` is the look at all of them; ``together`` the largest sets that one motion follows; ``against`` maps a
    sensor to those that it contradicts, ``lost`` holds sensors that no motion follows even alone. ``rates`` is the
    contradiction between spin rates, where that alone decided.
    """

    whole: Look
    together: tuple[tuple[str, ...], ...]
    against: Mapping[str, tuple[str, ...]]
    lost: tuple[str, ...] = ()
    rates: RatesApart | None = None

    @property
    def sentences(self) -> tuple[str, ...]:
        """What there is to say, in words."""
        plant = self.whole.fit.plant
        length = float(np.median([trajectory.nodes[-1] for trajectory in self.whole.fit.trajectories]))
        said = [
            f"No motion of a {plant.name} follows the first {length:.2g} s of these recordings, whatever the "
            f"ordinary errors of the sensors are: the best {plant.motion} leaves "
            + ", ".join(f"{self.whole.level(s):.3g} times the noise of the {_said(s)}" for s in self.whole.sensors)
            + "."
        ]
        if self.rates is not None:
            said = [_said_of_rates(self.rates)]
        if self.lost:
            said.append(
                f"Nor does one follow the {_listed(self.lost)}, each alone: wrong columns or units, something else "
                "that was recorded, or another kind of motion than stated (plant in recording.toml)."
            )
        told: set[frozenset[str]] = set()
        for sensor, others in self.against.items():
            pair = frozenset((sensor, *others))
            if others and pair not in told:
                told.add(pair)
                verb = "contradicts" if len(others) > 1 or len(self.whole.sensors) > 2 else "and"
                said.append(
                    f"The {_said(sensor)} {verb} the {_listed(others)}"
                    + (": no motion follows them together." if verb != "and" else " contradict each other.")
                )
        for some in self.together:
            if len(some) > 1:
                said.append(f"One motion follows the {_listed(some)} together.")
        said.append(
            "Compare columns, axes, units and times of these sensors, and whether they belong to the same throw."
        )
        return tuple(said)

    @property
    def blamed(self) -> tuple[str, ...]:
        """The sensors to look at first: those that contradict others, or follow nothing."""
        return tuple(dict.fromkeys([*self.lost, *self.against])) or self.whole.sensors


def _said(sensor: str) -> str:
    return {"gps": "GPS", "rate_reference": "rate reference"}.get(sensor, sensor)


def _said_of_rates(rates: RatesApart) -> str:
    return (
        f"The {_listed(rates.sensors)} tell different spin rates: they are {rates.times:.3g} times as far apart as "
        f"ordinary errors of sensors leave them (median of {rates.recordings} recordings), and no clock, delay or lost "
        "sample does that."
    )


def _listed(sensors: Sequence[str]) -> str:
    words = [_said(sensor) for sensor in sensors]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


# far from the data a motion may run beyond all numbers: such a step is not finite, and is not taken
@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def contradiction_in(recordings: Sequence[Recording], known: Sequence[Parameter]) -> Contradiction | None:
    """Return which sensors contradict which, or None where some motion follows them, or may with a sensor's delay.

    ``known`` are the stated numbers that may move. Of free spins, whose beginnings follow anything, only their rates
    are asked here, what follows their readings later (`contradiction_after`). Flights seen from outside alone have
    no beginning that follows them whatever is missing.
    """
    sensors, plant = [name for name in SENSORS if any(name in one for one in recordings)], plant_of(recordings[0])
    if all(plant.path_alone(one) for one in recordings):
        return None
    if plant.weakly_identified:
        apart_by = rates_apart(recordings)
        figures = None if apart_by is None else look_at(recordings, known, sensors, CONSISTENCY.few)
        if apart_by is None or figures is None:
            return None
        pairs = {s: tuple(o for o in apart_by.sensors if o != s) for s in apart_by.sensors}
        return Contradiction(figures, (), pairs, rates=apart_by)
    whole = look_at(recordings, known, sensors, CONSISTENCY.few)
    if whole is None or whole.follows:
        return None
    sensors = [name for name in sensors if name in whole.sensors]
    if len(sensors) == 1:
        return Contradiction(whole, (), {}, tuple(sensors))
    lost = tuple(sensor for sensor in sensors if not _follows(recordings, known, (sensor,)))
    if len(lost) >= len(sensors) - 1:
        # one sensor alone may want a start that only another tells; all but one do not
        return Contradiction(whole, (), {}, lost)
    apart: dict[str, tuple[str, ...]] = {}
    for sensor in sensors:
        others = tuple(other for other in sensors if other != sensor)
        look = look_at(recordings, known, others, CONSISTENCY.again)
        if look is None or not look.follows:
            continue
        if _reconciled(recordings, look, sensor) or _follows_lagging(recordings, known, sensors, sensor):
            return None
        if _turned(recordings, look, sensor) or _loses(recordings, look, sensor):
            return None
        if _pulses(recordings, whole, sensor):
            return None
        apart[sensor] = others
    if _follows_pulsing(recordings, known, whole):
        return None
    if apart:
        # each of several may be left out: it is they that contradict one another
        guilty = tuple(apart)
        against = {s: tuple(o for o in guilty if o != s) if len(guilty) > 1 else apart[s] for s in guilty}
        return Contradiction(whole, tuple(apart.values()), against)
    return _by_pairs(recordings, known, whole, sensors)


def _follows(recordings: Sequence[Recording], known: Sequence[Parameter], sensors: Sequence[str]) -> bool:
    """Tell whether a motion follows some of the sensors, or none of them has a reading."""
    look = look_at(recordings, known, sensors, CONSISTENCY.again)
    return look is None or look.follows


#: where the time constant of a lag starts, s, its one sigma, and half the width of its differences: a low-pass of 20 Hz
_LAG, _LAG_SIGMA, _LAG_STEP = 8e-3, 0.05, 1e-4


def _follows_lagging(
    recordings: Sequence[Recording], known: Sequence[Parameter], sensors: Sequence[str], lagging: str
) -> bool:
    """Tell whether a motion follows all sensors where one of them may lag.

    A gyroscope's noise is so low that the others' motion, however right, does not tell its readings to within it.
    """
    lags = {row.acts_on: row.id for row in CATALOGUE.values() if row.type is Lag}
    if lagging not in lags:
        return False
    lag = Parameter(lags[lagging], "tau_s", 0.0, _LAG_STEP, _LAG_SIGMA)
    look = look_at(recordings, known, sensors, CONSISTENCY.again, {lag: _LAG})
    return look is not None and look.follows


def _beside(recordings: Sequence[Recording], look: Look, sensor: str) -> Iterator[tuple[Trajectory, Values, Readings]]:
    """Yield the motions of a look and their numbers, and beside each what a sensor read that took no part in it."""
    for i, trajectory in enumerate(look.fit.trajectories):
        readings = next((r for r in readings_of(recordings[look.places[i]]) if r.sensor == sensor), None)
        if readings is not None:
            yield trajectory, look.fit.values(i), readings


def _turned(recordings: Sequence[Recording], look: Look, sensor: str) -> bool:
    """Tell whether a motion that others tell is that of a sensor, too, if it is turned in its board by a few degrees.

    Of a disc at 75 rad/s a degree puts 1.3 rad/s of its spin on the other axes of a gyroscope. What others tell is not
    told to within its noise: it is enough that a turn leaves little of the contradiction, or of the noise.
    """
    told = []
    for trajectory, values, readings in _beside(recordings, look, sensor):
        before, after = left_when_turned(trajectory, values, readings, true_noise([readings]))
        told.append(after <= max(CONSISTENCY.reconciled, CONSISTENCY.left_of_turn * before))
    return 2 * sum(told) > len(told)


def _loses(recordings: Sequence[Recording], look: Look, sensor: str) -> bool:
    """Tell whether a motion that others tell is that of an accelerometer, too, if it lost samples in each recording.

    Air other than stated changes what it feels by many times its noise: no shift alone reconciles it then.
    """
    if sensor != "accelerometer":
        return False
    found = []
    for trajectory, values, readings in _beside(recordings, look, sensor):
        noise = true_noise([readings])
        sd = np.array([noise[group_of(sensor, axis)].sd for axis in range(readings.value.shape[1])])
        rate_hz = trajectory.recording.sheets[sensor].rate_hz
        found.append(loses_samples(trajectory, values, readings, rate_hz, sd))
    return bool(found) and all(found)


#: half the widths of a ripple's differences: of its order, amplitude (rad/s) and phase (rad)
_RIPPLE_STEPS = {"order": 1e-6, "amplitude_rad_s": 1e-3, "phase_rad": 1e-4}


def _follows_pulsing(recordings: Sequence[Recording], known: Sequence[Parameter], whole: Look) -> bool:
    """Tell whether a motion follows all sensors of a table where its speed may ripple.

    Of a strong ripple not the rate reference alone tells: the accelerometer feels how it turns faster and slower, so
    that each contradicts what the others tell of a table without one.
    """
    for screened in ripple(whole.fit, whole.noise)[: CONSISTENCY.ripples]:
        starts = {name: number for ((_, name), _), number in screened.start.items()}
        free = {
            Parameter(screened.candidate.id, name, 0.0, step): float(starts[name])
            for name, step in _RIPPLE_STEPS.items()
        }
        look = look_at(recordings, known, whole.sensors, CONSISTENCY.few, free)
        if look is not None and all(
            look.level(sensor) <= max(CONSISTENCY.astray, CONSISTENCY.left_of_ripple * whole.level(sensor))
            for sensor in whole.sensors
        ):
            return True
    return False


def contradiction_after(fit: Fit) -> Contradiction | None:
    """Return that no motion follows free spins, of which a relaxed fit to all of their readings is ``fit``, or None.

    One sensor alone may be late, lag or have lost samples: where that would reconcile it, a search finds what it is.
    """
    if not fit.plant.weakly_identified:
        return None
    noise = true_noise([readings for trajectory in fit.trajectories for readings in trajectory.readings])
    flown = {readings.sensor for trajectory in fit.trajectories for readings in trajectory.readings}
    sensors = tuple(name for name in SENSORS if name in flown)
    look = Look(sensors, tuple(range(len(fit.trajectories))), fit, noise, tuple(left_of(fit, noise)))
    if look.follows:
        return None
    astray = [sensor for sensor in look.sensors if look.level(sensor) > CONSISTENCY.astray]
    if len(astray) < 2 or max(map(look.level, astray)) < CONSISTENCY.lost:
        return None
    return Contradiction(look, (), {}, ())


def _by_pairs(
    recordings: Sequence[Recording], known: Sequence[Parameter], whole: Look, sensors: Sequence[str]
) -> Contradiction:
    """Return what contradicts what among sensors of which none alone is to blame: each pair is looked at."""
    against: dict[str, tuple[str, ...]] = {}
    together = []
    for pair in combinations(sensors, 2):
        if _follows(recordings, known, pair):
            together.append(pair)
        else:
            for sensor, other in (pair, pair[::-1]):
                against[sensor] = (*against.get(sensor, ()), other)
    return Contradiction(whole, tuple(together), against)


def _pulses(recordings: Sequence[Recording], whole: Look, sensor: str) -> bool:
    """Tell whether a rate reference stays so near the rate of the others' motion that a ripple of the speed does it."""
    if sensor != "rate_reference":
        return False
    left, rate = [], []
    for place, level in zip(whole.places, whole.left, strict=True):
        if sensor in level and sensor in recordings[place]:
            left.append(level[sensor] * whole.noise[group_of(sensor, 0)].sd)
            rate.append(float(np.nanmedian(np.abs(recordings[place].samples[sensor].value))))
    return bool(left) and float(np.median(left)) < CONSISTENCY.ripple * float(np.median(rate))


def _reconciled(recordings: Sequence[Recording], look: Look, sensor: str) -> bool:
    """Tell whether a motion that others tell is that of a sensor, too, if it is late, lags or lost samples."""
    found = [left_when_shifted(*one, true_noise([one[-1]])) for one in _beside(recordings, look, sensor)]
    levels = [level for level in found if np.isfinite(level)]
    return not levels or float(np.median(levels)) <= CONSISTENCY.reconciled


def look_at(
    recordings: Sequence[Recording],
    known: Sequence[Parameter],
    sensors: Collection[str],
    few: int,
    free: Mapping[Parameter, float] = MappingProxyType({}),
) -> Look | None:
    """Fit the beginnings of a ``few`` recordings to some of their sensors; None where no readings are there.

    ``free`` are parameters that may move beside the ordinary ones, and where they start.
    """
    plant = plant_of(recordings[0])
    trajectories: list[Trajectory] = []
    places: list[int] = []
    for i, one in enumerate(recordings):
        samples = {name: own for name, own in one.samples.items() if name in sensors}
        if len(trajectories) == few or not samples:
            continue
        trajectory = beginning(first_trajectory(replace(one, samples=samples)), plant.durations.first_look)
        if any(np.any(readings.good) for readings in trajectory.readings):
            trajectories.append(trajectory)
            places.append(i)
    if not trajectories:
        return None
    there = {readings.sensor for trajectory in trajectories for readings in trajectory.readings}
    stated = [q for q in known if any(q.acts_in(i) for i in places)]
    stated = [
        q
        if q.recordings is None
        else replace(q, recordings=frozenset(places.index(i) for i in q.recordings if i in places))
        for q in stated
    ]
    usual = (
        *stated,
        *relaxed_parameters([trajectory.recording for trajectory in trajectories], there),
        *free_clocks(there),
    )
    parameters = (*usual, *free)
    noise = true_noise([readings for trajectory in trajectories for readings in trajectory.readings])
    start = np.array([*(q.stated for q in usual), *free.values()])
    fit = Fit(tuple(trajectories), parameters, start, plant.sizes.relaxed, noise)
    count = sum(int(np.count_nonzero(r.good)) for trajectory in trajectories for r in trajectory.readings)
    steps = _STEPS_OF_FIGURES if plant.weakly_identified else _STEPS
    fit = refit(fit, iterations=steps, tolerance=1e-3 * count, bounds=BOUNDS)
    look = Look(tuple(name for name in SENSORS if name in there), tuple(places), fit, noise, tuple(left_of(fit, noise)))
    if look.follows or len(there) == 1 or plant.weakly_identified:
        return look
    # where no path is there, the attitude at the start may be any about the field
    fit = from_other_initial_states(fit)
    return replace(look, fit=fit, left=tuple(left_of(fit, noise)))
