"""Windows of `estimators.py`: every method's error over the Cramer-Rao bound, its tables and its figure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy
import scipy.fft
import scipy.optimize
import scipy.signal
from matplotlib.ticker import FixedLocator, NullFormatter, NullLocator, ScalarFormatter
from support.spinning_sensor import MPU9250, Faults, Spin, Truth, move, record, without

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.estimators.bound import tone_bound
from discsim.estimators.fft_fast import padded_peak
from discsim.estimators.likelihood import LikelihoodSettings, likelihood
from discsim.estimators.methods import best as best_of_recording
from discsim.estimators.tracking import Segment, TrackingSettings, track_bound
from discsim.recording import Recording, Samples
from discsim.validation.reporting.figures import new_figure, save_figure

WINDOWS = (0.25, 0.5, 1.0, 2.0, 4.0)
DECIBELS = (20.0, 40.0, 60.0)
RATES = (500.0, 2500.0, 7000.0)
CASES = {
    "steady": (False, False),
    "spin-down": (False, True),
    "precession": (True, False),
    "spin-down and precession": (True, True),
}
EVERYTHING = "spin-down and precession"
THRESHOLD = np.radians(250.0)
SETTINGS = TrackingSettings()
#: What the noise of p and q adds to the attitude, rad per root second.
WALK = (MPU9250["gyroscope"].noise_rms or 0.0) / np.sqrt(MPU9250["gyroscope"].rate_hz)


def wider_axis(samples: Samples) -> FloatArray:
    """Return x or y, whichever varies more."""
    return samples.value[:, int(np.argmax(np.var(samples.value[:, :2], axis=0)))]


class Answer(NamedTuple):
    """A rate and its standard deviation, rad/s; NaN where the method gives none."""

    rate: float
    sd: float = np.nan


def padded_fft(samples: Samples, recording: Recording) -> Answer:
    """(P-1) to (P-7): the argument of the largest padded amplitude above the threshold."""
    x, h = wider_axis(samples), samples.interval
    total = 2**14
    first = int(np.ceil(THRESHOLD * total * h / (2 * np.pi)))
    order, _ = padded_peak(x[None], total, np.array([first]), np.array([total // 2]))
    return Answer(2 * np.pi * float(order[0]) / (total * h))


def hann_parabola(samples: Samples, recording: Recording) -> Answer:
    """Hann window, spectrum padded fourfold, parabola through the logarithms of the three highest values."""
    x, h = wider_axis(samples), samples.interval
    size = 4 * scipy.fft.next_fast_len(x.size)
    amplitude = np.log(np.abs(scipy.fft.rfft((x - x.mean()) * np.hanning(x.size + 2)[1:-1], size)) + 1e-300)
    first = int(np.ceil(THRESHOLD * size * h / (2 * np.pi)))
    k = first + int(np.argmax(amplitude[first:-1]))
    a, b, c = amplitude[k - 1 : k + 2]
    return Answer(2 * np.pi * (k + 0.5 * (a - c) / (a - 2 * b + c)) / (size * h))


def sine_fit(samples: Samples, recording: Recording) -> Answer:
    """Least squares of an offset and a sinusoid to one axis, from the estimate above."""
    x, t = wider_axis(samples), samples.t - samples.t.mean()

    def left(rate: float) -> float:
        columns = np.column_stack([np.ones_like(t), np.cos(rate * t), np.sin(rate * t)])
        return float(np.sum((x - columns @ np.linalg.lstsq(columns, x, rcond=None)[0]) ** 2))

    guess, width = hann_parabola(samples, recording).rate, np.pi / (t[-1] - t[0])
    low, high = max(guess - width, 0.5), guess + width
    grid = np.linspace(low, high, 15)
    best = grid[int(np.argmin([left(rate) for rate in grid]))]
    step = grid[1] - grid[0]
    found = scipy.optimize.minimize_scalar(
        left, bounds=(best - step, best + step), method="bounded", options={"xatol": 1e-7}
    )
    return Answer(float(found.x))


def scipy_periodogram(samples: Samples, recording: Recording) -> Answer:
    """The highest bin of ``scipy.signal.periodogram``."""
    frequency, power = scipy.signal.periodogram(wider_axis(samples), 1 / samples.interval)
    power[frequency < THRESHOLD / (2 * np.pi)] = 0.0
    return Answer(2 * np.pi * float(frequency[np.argmax(power)]))


def scipy_lombscargle(samples: Samples, recording: Recording) -> Answer:
    """The highest value of ``scipy.signal.lombscargle`` with floating mean on a grid of 2000 frequencies."""
    grid = np.linspace(THRESHOLD, 0.45 * 2 * np.pi / samples.interval, 2000)
    power = scipy.signal.lombscargle(samples.t, wider_axis(samples), grid, floating_mean=True)
    return Answer(float(grid[np.argmax(power)]))


def window_likelihood(samples: Samples, recording: Recording) -> Answer:
    """The project's likelihood window, with p, q of the gyroscope."""
    length = len(samples) * samples.interval
    # a chirp is all that changes in half a second of a spin-down; beyond, curvature must be known as well
    degree = 1 if length < 0.99 else 2
    found = likelihood(recording, LikelihoodSettings(window=length, longest_window=length, degree=degree, turns=0.01))
    return Answer(float(found.rate[0]), float(found.sd[0]))


def best(samples: Samples, recording: Recording) -> Answer:
    """What `discsim estimate` takes, told nothing but the recording; NaN of a window too short to show a spin."""
    try:
        found = best_of_recording(recording)
    except InputError:
        return Answer(float("nan"), float("nan"))
    middle = np.array([0.5 * (samples.t[0] + samples.t[-1])])
    return Answer(float(found.at(middle)[0]), float(np.interp(middle[0], found.t, found.sd)))


METHODS: dict[str, Callable[[Samples, Recording], Answer]] = {
    "padded FFT (paper)": padded_fft,
    "Hann + parabola": hann_parabola,
    "sine fit": sine_fit,
    "scipy periodogram": scipy_periodogram,
    "scipy lombscargle": scipy_lombscargle,
    "likelihood": window_likelihood,
    "best": best,
}


class Kind(NamedTuple):
    """One cell of the table: window s, quality dB, rate deg/s and case."""

    window: float
    decibels: float
    rate: float
    case: str


@dataclass(frozen=True)
class Cell:
    """Errors and standard deviations (runs,) of each method, rad/s, and the bounds (runs,)."""

    kind: Kind
    errors: dict[str, FloatArray]
    sds: dict[str, FloatArray]
    bounds: FloatArray


def rms(values: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def over_bound(cells: Sequence[Cell], method: str) -> float:
    """Return the rms of error over bound; NaN where the method answered in less than half of the runs."""
    ratios = np.concatenate([cell.errors[method] / cell.bounds for cell in cells])
    known = ratios[np.isfinite(ratios)]
    return rms(known) if known.size >= ratios.size / 2 else np.nan


def over_sd(cells: Sequence[Cell], method: str) -> float:
    """Return the rms of error over stated standard deviation."""
    ratios = np.concatenate([cell.errors[method] / cell.sds[method] for cell in cells])
    return rms(ratios[np.isfinite(ratios)])


def field_strength(recording: Recording) -> float:
    """Return the strength of the field that the recording states, uT."""
    return float(np.linalg.norm(recording.environment.magnetic_field))


def drawn_bound(spin: Spin, truth: Truth, noise: float, middle: float) -> float:
    """Return the bound with precession: all that undoes it unknown within its prior, and p, q noisy."""
    quiet = {
        "magnetometer": replace(MPU9250["magnetometer"], noise_rms=1e-9, resolution=None),
        "gyroscope": replace(MPU9250["gyroscope"], noise_rms=1e-12, resolution=None),
    }
    recording, _ = record(spin, np.random.default_rng(0), None, quiet, ("magnetometer", "gyroscope"), truth=truth)
    samples = recording.need("magnetometer")
    segment = Segment(
        samples.t,
        samples.value,
        SETTINGS,
        gyroscope=recording.get("gyroscope"),
        strength=field_strength(recording),
        decaying=False,
        walk=WALK,
    )
    return track_bound(segment, truth.r(samples.t), noise, middle)


def walk_share(t: FloatArray, noise: float, walk: float) -> float:
    """Return what a random walk of the phase adds to the variance of its slope at the centre, (rad/s)^2.

    The phase, offset, slope and chirp unknown, is read with white noise of ``noise`` rad; p and q, each read with white
    noise and integrated, make it walk by ``walk`` rad per root second. Difference of the two bounds.
    """
    tau = t - t.mean()
    columns = np.column_stack([np.ones_like(tau), tau, tau**2])
    white = noise**2 * np.eye(t.size)
    walked = white + walk**2 * np.minimum.outer(t - t[0], t - t[0])
    without_walk, with_walk = (np.linalg.inv(columns.T @ np.linalg.solve(c, columns))[1, 1] for c in (white, walked))
    return float(with_walk - without_walk)


def flawed(recording: Recording, rng: np.random.Generator, precession: bool) -> Recording:
    """Return the recording with faults drawn from the priors, and without the gyroscope's z.

    z would tell the rate directly wherever it does not clip, which is not what the bound is of.
    """
    gyroscope, magnetometer = recording.need("gyroscope"), recording.need("magnetometer")
    w = gyroscope.value[:, 0] + 1j * gyroscope.value[:, 1]
    m = magnetometer.value
    if precession:
        gain = complex(*rng.normal(0, SETTINGS.gyroscope_gain, 2))
        w = w / (1 + gain) + complex(*rng.normal(0, SETTINGS.gyroscope_bias, 2))
    samples = {
        "magnetometer": magnetometer,
        "gyroscope": Samples(gyroscope.t, np.column_stack([w.real, w.imag, np.full(w.size, np.nan)])),
    }
    return replace(recording, samples={**samples, "magnetometer": Samples(magnetometer.t, m)})


def window_cell(kind: Kind, runs: int, seed: int) -> Cell:
    """Run every method on ``runs`` windows of one kind."""
    precession, spin_down = CASES[kind.case]
    index = (WINDOWS.index(kind.window), DECIBELS.index(kind.decibels), RATES.index(kind.rate))
    rng = np.random.default_rng([seed, *index, list(CASES).index(kind.case)])
    spins = [
        without(
            Spin(
                rate=kind.rate, duration=kind.window, yaw=float(rng.uniform(0, 360)), nutation=5.0, decay_change=0.0,
                roll=float(rng.normal(0, 10)), pitch=float(rng.normal(5, 8)),
            ),
            precession=precession, spin_down=spin_down,
        )
        for _ in range(min(runs, 2))
    ]  # fmt: skip
    truths = [move(spin) for spin in spins]
    errors: dict[str, list[float]] = {name: [] for name in METHODS}
    sds: dict[str, list[float]] = {name: [] for name in METHODS}
    bounds: list[float] = []
    drawn: dict[int, float] = {}
    for run in range(runs):
        spin, truth = spins[run % len(spins)], truths[run % len(truths)]
        field = np.asarray(spin.magnetic_field)
        body = truth.attitude @ field
        across, along = float(np.mean(np.hypot(body[:, 0], body[:, 1]))), float(np.mean(np.abs(body[:, 2])))
        noise = across * 10 ** (-kind.decibels / 20)
        sheets = {**MPU9250, "magnetometer": replace(MPU9250["magnetometer"], noise_rms=noise, resolution=None)}
        soft = np.triu(rng.normal(0, SETTINGS.soft_iron, (3, 3)))
        strength = float(rng.normal(0, SETTINGS.strength))
        faults = Faults(
            hard_iron=(12.0, -7.0, 5.0),
            # the whole sensor's scale is how the field's strength departs from the one stated
            soft_iron=soft + np.triu(soft, 1).T + strength * np.eye(3) if precession else np.zeros((3, 3)),
        )
        recording, _ = record(spin, rng, faults, sheets, ("magnetometer", "gyroscope"), truth=truth)
        recording = flawed(recording, rng, precession)
        samples = recording.need("magnetometer")
        middle = 0.5 * (samples.t[0] + samples.t[-1])
        r = float(truth.r(np.array([middle]))[0])
        tone = tone_bound(samples.t, across, noise, r, ellipse_sd=0.05, phase=float(rng.uniform(0, 2 * np.pi))).rate
        # every method of this project takes p and q into account, whether or not there is precession
        bound = float(np.sqrt(tone**2 + walk_share(samples.t, noise / across, WALK * along / across)))
        if precession:
            if run % len(truths) not in drawn:
                drawn[run % len(truths)] = drawn_bound(spin, truth, noise, middle)
            bound = max(bound, drawn[run % len(truths)])
        bounds.append(bound)
        for name, method in METHODS.items():
            answer = method(samples, recording)
            errors[name].append(answer.rate - r)
            sds[name].append(answer.sd)
    return Cell(
        kind,
        {name: np.array(values) for name, values in errors.items()},
        {name: np.array(values) for name, values in sds.items()},
        np.array(bounds),
    )


def windows_tables(cells: Sequence[Cell]) -> list[str]:
    """Return the lines of the tables of windows, one for each case."""
    lines = []
    for case in dict.fromkeys(cell.kind.case for cell in cells):
        own = [cell for cell in cells if cell.kind.case == case]
        lines += ["", f"### {case[0].upper()}{case[1:]}", ""]
        lines += ["| window s | dB | bound deg/s | " + " | ".join(METHODS) + " |", "|---" * (3 + len(METHODS)) + "|"]
        for window, level in sorted({(cell.kind.window, cell.kind.decibels) for cell in own}):
            row = [cell for cell in own if (cell.kind.window, cell.kind.decibels) == (window, level)]
            texts = []
            for name in METHODS:
                each = np.array([over_bound([cell], name) for cell in row])
                if np.all(np.isnan(each)):
                    texts.append("NaN")
                    continue
                unknown = f", {np.count_nonzero(np.isnan(each))} NaN" if np.any(np.isnan(each)) else ""
                texts.append(f"{np.nanmedian(each):.3g} ({np.nanmax(each):.3g}){unknown}")
            bound = np.degrees(np.median(np.concatenate([cell.bounds for cell in row])))
            lines.append(f"| {window:g} | {level:g} | {bound:.2g} | " + " | ".join(texts) + " |")
    return lines


def honesty_table(cells: Sequence[Cell]) -> list[str]:
    """Return the lines of the table of pooled ratios and standard deviations of the project's window methods."""
    lines = [
        "| case | likelihood: error over bound | over stated sd | best: error over bound | over stated sd |",
        "|---|---|---|---|---|",
    ]
    for case in dict.fromkeys(cell.kind.case for cell in cells):
        own = [cell for cell in cells if cell.kind.case == case]
        parts = [f"{f(own, name):.2f}" for name in ("likelihood", "best") for f in (over_bound, over_sd)]
        lines.append(f"| {case} | " + " | ".join(parts) + " |")
    return lines


class Bias(NamedTuple):
    """Mean error and its standard error, deg/s."""

    mean: float
    error: float


def bias(cells: Sequence[Cell], method: str) -> Bias:
    """Return the mean error of all runs, weighed by their bounds; its error from how they scatter over their bounds."""
    errors = np.concatenate([cell.errors[method] for cell in cells])
    bounds = np.concatenate([cell.bounds for cell in cells])
    known = np.isfinite(errors)
    weights = 1 / bounds[known] ** 2
    mean = float(np.sum(weights * errors[known]) / np.sum(weights))
    return Bias(float(np.degrees(mean)), float(np.degrees(rms(errors[known] / bounds[known]) / np.sqrt(weights.sum()))))


WINDOW_COLOURS = ("#d55e00", "#e69f00", "#cc79a7", "#999999", "#0072b2", "#56b4e9", "#009e73")


def draw_windows(cells: Sequence[Cell], path: Path) -> None:
    """Draw error over bound against the window, a panel for each quality, everything on."""
    own = [cell for cell in cells if cell.kind.case == EVERYTHING]
    levels = sorted({cell.kind.decibels for cell in own})
    windows = sorted({cell.kind.window for cell in own})
    figure, grid = new_figure(1, len(levels), width=10.0, height=4.2, sharey=True, squeeze=False)
    for axes, level in zip(grid[0], levels, strict=True):
        for name, shade in zip(METHODS, WINDOW_COLOURS, strict=True):
            ratios = [
                over_bound([c for c in own if (c.kind.window, c.kind.decibels) == (window, level)], name)
                for window in windows
            ]
            ours = name in ("likelihood", "best")
            axes.plot(windows, ratios, color=shade, marker="o", ms=3.5, lw=2.0 if ours else 1.1, label=name)
        axes.axhline(1.0, color="black", lw=0.8)
        axes.axhline(1.1, color="black", lw=0.8, ls=":")
        axes.set(xscale="log", yscale="log", title=f"{level:g} dB", xlabel="window, s")
        axes.xaxis.set_major_locator(FixedLocator(windows))
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.xaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_major_formatter(ScalarFormatter())
        axes.yaxis.set_minor_formatter(NullFormatter())
    grid[0][0].set_ylabel("rms error over the bound")
    handles, labels = grid[0][0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(METHODS))
    save_figure(figure, path)
