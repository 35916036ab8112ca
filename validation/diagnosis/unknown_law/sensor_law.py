"""Laws on a sensor: warming, drift, rate, reading, turning and swinging terms, screened by score tests and fitted."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from discsim.arrays import ComplexArray, FloatArray, IntArray
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, noise_of, scored
from discsim.validation.diagnosis.candidates.hypothesis import Hypothesis
from discsim.validation.diagnosis.candidates.screening import NormalEquations, column_of
from discsim.validation.diagnosis.candidates.to_stated import to_baseline
from discsim.validation.diagnosis.unknown_law.terms import SENSORS, SHAPES, SensorTerm
from discsim.validation.identification.dynamics import FASTEST
from discsim.validation.identification.gauss_newton import Fit, linearised, mapped, reduced_each, refit, whole_step
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import chi_squared
from discsim.validation.identification.normal_equations import common_step, reduce
from discsim.validation.identification.parameters import Parameter
from discsim.validation.identification.propagation import Column
from discsim.validation.identification.segments import Trajectory

__all__ = [
    "SettledTerm",
    "asked_of_sensors",
    "coefficients_of",
    "fitted_sensor_law",
    "further_sensor_terms",
    "sensor_library",
    "settled_terms",
]

#: half the difference by which the slope in a shape is taken, as a share of it
_SHAPE_STEP = 1e-4


#: that of a play: where it turns lies between two samples, so that its slope jumps; 3 % is some samples of a turn
_PLAY_STEP = 0.03


#: rounds after which the noise is that which a term leaves; a fit ends in that noise
_SETTLED = 3


#: one sigma of a coefficient, so wide that it holds none but one that no reading tells
_ANY = 1e6


#: times that a fit in held steps finds its noise anew, and its first steps
_LEVELS, _STEPS = 3, 16


#: orders of the spin that are looked at, peaks of the spectrum that are tried
_ORDERS, _PEAKS = (0.15, 4.0), 3


#: that of a swing, so that it moves no phase by more than milliradians within a minute
_SWING_STEP = 1e-7


#: how far a swing may be from the peak of a spectrum, rad/s: lines of a recording of ten seconds are 0.6 wide
_SWING_SD = 0.3


#: swings nearer than this are one, rad/s
_SAME_SWING = 1.0


#: slower swings than so many in a recording are its drifts; a peak stands out from the median power by this factor,
#: where the highest of noise, of five lines in each of three recordings, by 2.5; a channel needs so many readings
_LONGEST_SWINGS, _STANDS_OUT, _FEWEST = 0.5, 5.0, 50


#: orders of the spin nearer than this are one
_SAME_ORDER = 0.02


#: a play is told by a coefficient of 1 to within this, where it is these standard deviations from 0; readings at even
#: instants see its turns late, which costs some per cent
_PLAY_OFF, _TOLD = 0.2, 4.0


@dataclass(frozen=True)
class Turned:
    """Spin and the angle turned since the recording began, as functions of time."""

    rate: CubicSpline | CubicHermiteSpline
    angle: CubicSpline | CubicHermiteSpline


def turned(trajectory: Trajectory) -> Turned:
    """Return how a trajectory turns, from the states at the starts of its segments."""
    t, spin, command = trajectory.nodes[:-1], trajectory.plant.layout.spin, trajectory.recording.command
    if command is not None:
        # piecewise linear, so its integral is exact on its knots and parabolas between
        grid = np.union1d(
            np.linspace(0.0, trajectory.nodes[-1], 20 * t.size), np.clip(command.t, 0.0, trajectory.nodes[-1])
        )
        r = np.interp(grid, command.t, command.value)
        psi = cumulative_trapezoid(r, grid, initial=0)
        rate = CubicHermiteSpline(grid, r, np.gradient(r, grid))
        return Turned(rate, CubicHermiteSpline(grid, psi, r))
    r = np.zeros(t.size) if spin is None else trajectory.states[:, spin]
    if t.size < 3:
        t, r = np.append(t, trajectory.nodes[-1]), np.append(r, r[-1])
    rate = CubicSpline(t, r)
    return Turned(rate, rate.antiderivative())


def _seen(
    linear: Linear, trajectory: Trajectory, term: SensorTerm, shape: float
) -> list[tuple[slice, int, FloatArray]]:
    """Return rows, axis and basis (n, size) of a term on each of its sensor's axes."""
    spin = turned(trajectory)
    found = []
    axes = next((readings.axes for readings in trajectory.readings if readings.sensor == term.sensor), ())
    for channel in linear.channels:
        if channel.sensor == term.sensor:
            t = linear.t[channel.rows]
            x = _reading(linear, trajectory, channel.rows, channel.index, term.sensor, axes.index(channel.axis))
            basis = term.basis(t, spin.rate(t), spin.angle(t), x, shape)
            found.append((channel.rows, axes.index(channel.axis), basis))
    return found


def _reading(
    linear: Linear, trajectory: Trajectory, rows: slice, index: IntArray, sensor: str, axis: int
) -> FloatArray:
    """Return what the model expects an axis to read, (n,), the closing of gaps included."""
    readings = next(r for r in trajectory.readings if r.sensor == sensor)
    return np.asarray(readings.value[index, axis] - linear.residual[rows])


def _columns_of(
    linear: Linear, trajectory: Trajectory, term: SensorTerm, shape: float, width: int, recording: int
) -> FloatArray:
    """Return the columns (n, width) of a sensor term's coefficients, zero where a recording lacks the sensor.

    Each axis has its own; where each recording has its own, too, those of the others stay zero.
    """
    columns = np.zeros((linear.raw.size, width))
    axes = len(_axes(trajectory, term.sensor))
    first = recording * axes * term.size if term.own else 0
    for rows, axis, basis in _seen(linear, trajectory, term, shape) if axes else ():
        at = first + axis * term.size
        columns[rows, at : at + term.size] = basis
    return columns


def _axes(trajectory: Trajectory, sensor: str) -> tuple[str, ...]:
    return next((readings.axes for readings in trajectory.readings if readings.sensor == sensor), ())


def _widened(linear: Linear, columns: FloatArray) -> Linear:
    """Return a linearisation with more shared columns (n, c), of the readings alone."""
    more = columns.shape[1]
    return replace(
        linear,
        own=np.hstack([linear.own, columns]),
        whole=np.hstack([linear.whole, columns[linear.segment < 0]]) if linear.whole.size else linear.whole,
        sensitivities=np.concatenate([linear.sensitivities, np.zeros((*linear.sensitivities.shape[:2], more))], axis=2),
        transitions=np.concatenate([linear.transitions, np.zeros((*linear.transitions.shape[:2], more))], axis=2),
    )


def orders(fit: Fit, sensor: str) -> list[float]:
    """Return the orders of the spin at which a sensor's residuals of a relaxed fit have their highest lines."""
    length = 0.0
    parts = []
    most = FASTEST * max(float(trajectory.nodes[-1]) for trajectory in fit.trajectories)
    for linear, trajectory in zip(fit.linears, fit.trajectories, strict=True):
        spin = turned(trajectory)
        for channel in linear.channels:
            if channel.sensor == sensor:
                psi = spin.angle(linear.t[channel.rows])
                e = linear.residual[channel.rows]
                parts.append((psi, e - e.mean()))
                length = max(length, float(np.ptp(psi)))
    if not 20.0 < length < most:
        return []  # hardly a turn, or a motion that has run beyond all numbers
    step = 1.0 / length
    tried = np.arange(_ORDERS[0], _ORDERS[1], step)
    return _peaks(tried, _spectrum(parts, tried, step), 12.0 * step)


def _spectrum(
    parts: Sequence[tuple[FloatArray, FloatArray | ComplexArray]], tried: FloatArray, step: float
) -> FloatArray:
    """Return the power (k,) of all parts, each of angles and values (n,), at orders ``tried`` (k,), a step apart."""
    power = np.zeros(tried.size)
    for x, e in parts:
        turning, by = np.exp(-1j * tried[0] * x), np.exp(-1j * step * x)
        for j in range(tried.size):
            power[j] += abs(np.sum(e * turning)) ** 2 / e.size
            turning = turning * by
    return power


def _peaks(tried: FloatArray, power: FloatArray, apart: float, least: float = 0.0) -> list[float]:
    """Return where a spectrum has its highest peaks of at least a power, the highest first, so far ``apart``."""
    found: list[float] = []
    for j in np.argsort(power)[::-1]:
        if power[j] < least or len(found) == _PEAKS:
            break
        if all(abs(tried[j] - other) > apart for other in found):
            found.append(float(tried[j]))
    return found


def swings(fit: Fit, sensor: str) -> list[float]:
    """Return the rates, rad/s, of what swings in a frame that does not turn, as a sensor's residuals have it.

    A field that alternates outside stands across the spin axis at lines beside it, by the spin to either side. Only
    peaks that stand out from the spectrum are told, the highest first.
    """
    if fit.plant.airborne and not fit.plant.weakly_identified:
        return []  # far from any cable, and about no axis that keeps its direction
    length, fastest = 0.0, np.inf
    parts: list[tuple[FloatArray, FloatArray | ComplexArray]] = []
    for linear, trajectory in zip(fit.linears, fit.trajectories, strict=True):
        spin = turned(trajectory)
        for channel in linear.channels:
            if channel.sensor == sensor and channel.rows.stop - channel.rows.start > _FEWEST:
                t, e = linear.t[channel.rows], linear.residual[channel.rows]
                psi, e = spin.angle(t), e - e.mean()
                sides = (0.0,) if channel.axis.startswith("z") else (1.0, -1.0)
                parts += [(t, e * np.exp(-1j * side * psi)) for side in sides]
                length = max(length, float(np.ptp(t)))
                fastest = min(fastest, np.pi / float(np.median(np.diff(t))))
    if not parts:
        return []
    step = 0.5 * np.pi / length
    # at half the rate of the readings itself a sine is nothing at every reading
    tried = np.arange(_LONGEST_SWINGS * 2.0 * np.pi / length, fastest - 0.5 * step, step)
    if not tried.size:
        return []
    power = _spectrum(parts, tried, step)
    return _peaks(tried, power, 12.0 * step, _STANDS_OUT * float(np.median(power)))


def sensor_library(
    fit: Fit, about: Collection[str] = tuple(SENSORS), without: Collection[str] = ()
) -> list[SensorTerm]:
    """Return the terms about sensors, or some of them, that are asked for first, ``without`` some kinds."""
    terms = []
    length = 0.5 * max(float(trajectory.nodes[-1]) for trajectory in fit.trajectories)
    spin = max(float(np.max(np.abs(turned(trajectory).rate(trajectory.nodes[:-1])))) for trajectory in fit.trajectories)
    for sensor in filter(about.__contains__, SENSORS):
        values = [r.value[r.good] for trajectory in fit.trajectories for r in trajectory.readings if r.sensor == sensor]
        if not values or not any(v.size for v in values):
            continue
        spread = float(np.std(np.concatenate(values)))
        units = {"drift": length, "rate": spin, "settling": spin, "reading": spread}
        for kind in [kind for kind in SENSORS[sensor] if kind not in without]:
            spectral = {"turning": orders, "swinging": swings}
            shape_grid = spectral[kind](fit, sensor) if kind in spectral else SHAPES[kind]
            if kind == "play":
                shape_grid = [spread * share for share in shape_grid if spread > 0.0]
            unit = float(f"{max(units.get(kind, 1.0), 1e-6):.1g}")
            terms += [SensorTerm(sensor, kind, shape, unit) for shape in shape_grid]
    return terms


@dataclass(frozen=True)
class SettledTerm:
    """A term of the shape that a fit gave it, with its coefficients (axes size,)."""

    term: SensorTerm
    coefficients: FloatArray


def _shape_step(term: SensorTerm) -> float:
    return {"play": _PLAY_STEP, "swinging": _SWING_STEP}.get(term.kind, _SHAPE_STEP)


def _shape_sd(term: SensorTerm) -> float:
    """Return how far a shape may be from where it starts: an order of the spin or a swing by less than a line."""
    return {"turning": 0.01, "swinging": _SWING_SD}.get(term.kind, 0.3 * term.shape)


def _coefficients(trajectories: Sequence[Trajectory], term: SensorTerm, number: int = 0) -> list[Parameter]:
    """Return the coefficients of a term, called NUMBER.AXIS.PLACE, with .RECORDING behind where each has its own."""
    axes = max((_axes(trajectory, term.sensor) for trajectory in trajectories), key=len)
    names = [f"{number}.{axis}.{j}" for axis in axes for j in range(term.size)]
    if not term.own:
        return [Parameter("term", name, 0.0, 1.0, _ANY) for name in names]
    return [
        Parameter("term", f"{name}.{k}", 0.0, 1.0, _ANY, recordings=frozenset({k}))
        for k in range(len(trajectories))
        for name in names
    ]


def coefficients_of(trajectories: Sequence[Trajectory], term: SensorTerm) -> int:
    """Return the number of a term's coefficients."""
    return len(_coefficients(trajectories, term))


def _beside_terms(
    linear: Linear, trajectory: Trajectory, settled: Sequence[SettledTerm], widths: Sequence[int], recording: int
) -> Linear:
    """Return a linearisation less what terms do, with columns for their coefficients, and last for their shapes."""
    less, columns, slopes = np.zeros(linear.raw.size), [], []
    for one, width in zip(settled, widths, strict=True):
        shape, h = one.term.shape, _shape_step(one.term) * one.term.shape
        here, above, below = (
            _columns_of(linear, trajectory, one.term, x, width, recording) for x in (shape, shape + h, shape - h)
        )
        columns.append(here)
        slopes.append(((above - below) @ one.coefficients) / (2.0 * h))
        less += here @ one.coefficients
    return _widened(replace(linear, raw=linear.raw - less), np.column_stack([*columns, *slopes]))


@dataclass(frozen=True)
class TermsBeside:
    """The last parameters of a fit, those of sensor terms: ``widths`` coefficients of each, then their shapes."""

    terms: tuple[SensorTerm, ...]
    widths: tuple[int, ...]

    @property
    def count(self) -> int:
        """Number of parameters."""
        return sum(self.widths) + len(self.terms)

    def __call__(self, fit: Fit, recording: int, linear: Linear) -> Linear:
        """Return a recording's linearisation less what the terms do, with columns for their numbers."""
        first, shapes = len(fit.at) - self.count, fit.at[len(fit.at) - len(self.terms) :]
        parts = np.split(fit.at[first : first + sum(self.widths)], np.cumsum(self.widths)[:-1])
        here = zip(self.terms, shapes.tolist(), parts, strict=True)
        settled = [SettledTerm(replace(term, shape=shape), c) for term, shape, c in here]
        return _beside_terms(linear, fit.trajectories[recording], settled, self.widths, recording)


def asked_of_sensors(
    fit: Fit, own: Sequence[Parameter], terms: Sequence[SensorTerm], settled: Sequence[SettledTerm] = ()
) -> list[float]:
    """Return what each sensor term would gain in chi2 beside ``settled`` ones, segments jumping as they may."""
    if not terms:
        return []
    defects, p = fit.defects, len(fit.parameters)
    known = [coefficients_of(fit.trajectories, one.term) for one in settled]
    wide: list[Linear] = []
    places, at = [], p + sum(known) + len(settled)
    first = at
    for term in terms:
        width = coefficients_of(fit.trajectories, term)
        places.append(range(at, at + width))
        at += width
    for i, (bare, trajectory) in enumerate(zip(linearised(fit), fit.trajectories, strict=True)):
        linear = _beside_terms(bare, trajectory, settled, known, i) if settled else bare
        parts = [
            _columns_of(bare, trajectory, term, term.shape, len(place), i)
            for term, place in zip(terms, places, strict=True)
        ]
        wide.append(_widened(linear, np.hstack(parts)))
    reduced = mapped(lambda linear, trajectory: reduce(linear, trajectory, fit.noise, defects), wide, fit.trajectories)
    columns = (*map(column_of, fit.parameters), *(Column("term", str(j), 1.0) for j in range(at - p)))
    equations = NormalEquations(
        columns,
        to_baseline(np.stack([r.gram for r in reduced]), fit),
        {column: j for j, column in enumerate(columns)},
    )

    def free(place: Sequence[int]) -> list[tuple[Column, Parameter]]:
        return [(columns[j], Parameter("term", columns[j].name, 0.0, 1.0)) for j in place]

    taken = [*((column_of(q), q) for q in own), *free(range(p, first))]
    base = equations.solve(taken).chi2
    return [base - equations.solve([*taken, *free(place)]).chi2 for place in places]


def further_sensor_terms(library: Sequence[SensorTerm], settled: Sequence[SettledTerm]) -> list[SensorTerm]:
    """Return the terms that may stand beside settled ones: of another sensor or another kind, or of another order."""

    def one_of(term: SensorTerm, known: SensorTerm) -> bool:
        alike = (term.sensor, term.kind) == (known.sensor, known.kind)
        near = {"turning": _SAME_ORDER, "swinging": _SAME_SWING}.get(term.kind, np.inf)
        return alike and abs(term.shape - known.shape) < near

    return [term for term in library if not any(one_of(term, one.term) for one in settled)]


def settled_terms(fitted: ContinuousFit, terms: Sequence[SensorTerm]) -> tuple[SettledTerm, ...]:
    """Return terms where a fit has them."""
    values = {q.name: float(v) for q, v in zip(fitted.fit.parameters, fitted.fit.at, strict=True) if q.group == "term"}
    return tuple(
        SettledTerm(
            replace(term, shape=values[f"{i}.shape"]),
            np.array([v for name, v in values.items() if name.startswith(f"{i}.") and name != f"{i}.shape"]),
        )
        for i, term in enumerate(terms)
    )


def fitted_sensor_law(
    start: Fit, own: Sequence[Parameter], own_at: FloatArray, terms: Sequence[SensorTerm]
) -> ContinuousFit | None:
    """Fit sensor terms and own parameters by output error, segments hanging together.

    The trajectories keep their readings; what the terms take off them is part of the residual.
    """
    numbers: list[Parameter] = []
    widths = []
    for i, term in enumerate(terms):
        mine = _coefficients(start.trajectories, term, i)
        numbers += mine
        widths.append(len(mine))
    shapes = tuple(
        Parameter("term", f"{i}.shape", t.shape, _shape_step(t) * t.shape, _shape_sd(t)) for i, t in enumerate(terms)
    )
    at = np.concatenate([own_at, np.zeros(len(numbers)), [term.shape for term in terms]])
    beside = TermsBeside(tuple(terms), tuple(widths))
    defects = start.plant.sizes.continuous
    fit = Fit(start.trajectories, (*own, *numbers, *shapes), at, defects, start.noise, beside=beside)
    fit = _in_held_steps(fit) if fit.plant.weakly_identified else _in_whole_steps(fit, beside)
    if not np.all(np.isfinite(fit.at)) or not fit.covariance.size or not _are_plays(fit, terms):
        return None
    return scored(Hypothesis(), fit)


def _in_held_steps(fit: Fit) -> Fit:
    """Return a fit of terms after steps held short where readings say little of a motion: whole ones hop about."""
    for done in range(_LEVELS):
        fit = refit(fit, iterations=_STEPS if done == 0 else 2, relinearise=done == 0)
        if not np.isfinite(fit.merit):
            break
        fit = replace(fit, noise={**fit.noise, **noise_of(fit)})
    return fit


def _in_whole_steps(fit: Fit, beside: TermsBeside) -> Fit:
    """Return a fit of terms, which are its last parameters, after whole steps that settle."""
    width, ends = len(fit.parameters), len(beside.terms)
    for round in range(12):
        linears = linearised(fit)
        fit = replace(fit, linears=linears)
        merit = sum(chi_squared(linear, fit.noise, linear.residual) for linear in linears)
        reduced = reduced_each(fit)
        gram = np.sum([r.gram for r in reduced], axis=0)
        told = np.any(fit.at[width - beside.count : width - ends])  # else no shape shows
        free = [*range(width if told else width - ends)]
        some = [*free, width]
        step, covariance, expected = common_step(
            gram[np.ix_(some, some)], [fit.parameters[j] for j in free], fit.at[free]
        )
        full = np.zeros(width)
        full[free] = step
        if told:
            # a shape moves by a third of itself at most, an order of the spin by less than its line is wide
            most = 0.3 * fit.at[-ends:]
            full[-ends:] = np.clip(full[-ends:], -most, most)
            fit = replace(fit, covariance=covariance)
        if round > _SETTLED and fit.merit - merit < 1e-3 * abs(fit.merit - expected) + 0.05 and merit - expected < 0.5:
            break
        if round == 11 or not np.all(np.isfinite(full)):
            break
        fit = replace(fit, merit=merit, noise=noise_of(fit) if round >= _SETTLED else fit.noise)
        fit = whole_step(fit, reduced, full)
    return fit


def _are_plays(fit: Fit, terms: Sequence[SensorTerm]) -> bool:
    """Tell whether every play is one: its coefficient is 1, or no reading tells it from 0."""
    place = {q.name: j for j, q in enumerate(fit.parameters) if q.group == "term"}
    for i, term in enumerate(terms):
        if term.kind != "play":
            continue
        for name, j in place.items():
            if name.startswith(f"{i}.") and name != f"{i}.shape":
                c, sd = float(fit.at[j]), float(np.sqrt(fit.covariance[j, j]))
                if abs(c) > _TOLD * sd and not abs(c - 1.0) < max(_PLAY_OFF, _TOLD * sd):
                    return False
    return True
