"""A rate-table run as in the paper's section 3: all methods on one profile, scored on its plateaus."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discsim.arrays import BoolArray, FloatArray, readonly
from discsim.effects.catalogue import Effect
from discsim.effects.sensors import PositionOffset
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.estimators.accelerometer import AccelerometerErrors, accelerometer
from discsim.estimators.fft import FftSettings, fft
from discsim.estimators.gyroscope import gyroscope
from discsim.estimators.rate import YawRate
from discsim.files import write_text
from discsim.law import Law
from discsim.motion import Motion
from discsim.rate_tables import RateTable
from discsim.recording import Recording, Samples
from discsim.sensors import Instruments, Sensor, record
from discsim.validation.reporting.scores import Score, at_most, score

__all__ = [
    "MOUNT_ERRORS",
    "Bench",
    "Plateau",
    "RateTableRun",
    "envelope_on",
    "fft_delay",
    "papers_rates",
    "plateau_rows",
    "plateau_table",
    "rate_table_checks",
    "run_rate_table",
    "true_rate",
    "with_all_methods",
    "write_plateaus",
]

#: margin kept from a plateau's ends: half the paper's window of 128 samples at 100 Hz, and a little
MARGIN_S = 0.7
#: mount errors of the paper's Fig. 7, m
MOUNT_ERRORS = (0.001, 0.005)


@dataclass(frozen=True)
class Plateau:
    """Errors of one method on one plateau, rad/s; NaN where the method says nothing."""

    method: str
    rate: float
    known: float
    bias: float
    sd: float
    worst: float


@dataclass(frozen=True)
class Bench:
    """What turns and what sits on it: a rate table, the parts on board and where their accelerometer sits.

    ``parts`` None is the paper's module: an MPU-9250 with an ADXRS649 beside it. The accelerometer is stated to sit
    ``radius`` m from the axis on the negative x axis (None: where its part says), and sits ``mount`` (3,) m off that.
    A module without a rate reference gets the AC1120S's. ``stated`` takes the place of parts: instruments as they are,
    of which no specimen is drawn.
    """

    table: RateTable = field(default_factory=RateTable)
    parts: tuple[str, ...] | None = None
    radius: float | None = None
    mount: FloatArray = field(default_factory=lambda: readonly([0.0, 0.0, 0.0]))
    stated: Instruments | None = None

    @property
    def has_papers_module(self) -> bool:
        """Whether the paper's module is on it, with the wide-range rate sensor beside it."""
        return self.parts is None and self.stated is None

    @property
    def is_papers(self) -> bool:
        """Whether the claims of the paper's Fig. 7 can be asked of it: its module, on a table that obeys."""
        follows = self.table.drive.is_ideal and self.table.second is None
        return self.has_papers_module and self.radius is None and follows

    @property
    def sensors(self) -> Mapping[str, Sensor]:
        """The sensors on board, as their data sheets say."""
        return self._module().sensors

    def _module(self) -> Instruments:
        if self.stated is not None:
            return self.stated
        return Instruments.from_parts("ac1120s", *(("mpu9250",) if self.parts is None else self.parts))

    def module(self, rng: np.random.Generator) -> Instruments:
        """Return a specimen of the module, drawn within its data sheets, where and how it sits; before effects."""
        module = self._module().drawn(rng)
        if self.radius is not None or np.any(self.mount):
            if "accelerometer" not in module.sensors:
                found = ", ".join(module.sensors)
                raise InputError(f"no accelerometer among {found}; expected one, to be put where you say")
            if self.radius is not None:
                z = float(module.sensors["accelerometer"].position[2])  # type: ignore[union-attr]
                module = module.fitted("accelerometer", position=readonly([-self.radius, 0.0, z]))
            if np.any(self.mount):
                offset = PositionOffset(*(float(x) for x in self.mount))
                module = module.fitted("accelerometer", offset=offset)
        return self.table.fit_out(module)


@dataclass(frozen=True)
class RateTableRun:
    """What one run gave.

    ``recording`` is the module's (and the table's read-out), ``wide`` that of the wide-range rate sensor beside the
    paper's module; ``rates`` holds each method's estimate by name, ``envelopes`` the accelerometer's by mount error in
    m. ``bench`` is what turned, ``mount`` how far off its stated place the accelerometer truly sits, the larger of x
    and y, m.
    """

    profile: Samples
    motion: Motion
    recording: Recording
    wide: Recording | None
    rates: Mapping[str, YawRate]
    envelopes: Mapping[float, YawRate]
    mount: float = 0.0
    bench: Bench = field(default_factory=Bench)

    def truth(self, t: FloatArray) -> FloatArray:
        """Return the true rate about z_B, rad/s, at times t (n,) s."""
        return true_rate(self.motion)(t)

    @property
    def span(self) -> tuple[float, float]:
        """First and last instant of the truth, s."""
        return self.motion.start, self.motion.end


def run_rate_table(
    profile: Samples,
    environment: Environment,
    rng: np.random.Generator,
    *,
    bench: Bench | None = None,
    effects: tuple[Effect, ...] = (),
    laws: tuple[Law, ...] = (),
    name: str = "rate-table",
    progress: Callable[[Sequence[range]], Iterable[range]] = iter,
) -> RateTableRun:
    """Turn the table through ``profile`` and estimate its rate by each method of the paper that the parts allow.

    The module is one specimen drawn within its data sheet; the yaw phase at the start is drawn too. An effect on a
    sensor takes the place of what was drawn of its kind; ``laws`` about sensors come on top. ``progress`` is
    `turn_table`'s. Raises `InputError` where both the bench's mount and ``effects`` move the accelerometer.
    """
    bench = bench or Bench()
    if np.any(bench.mount) and any(isinstance(item.value, PositionOffset) for item in effects):
        raise InputError("a mount error and accel.position_offset both move the accelerometer; expected one of them")
    draw_module, draw_wide, draw_yaw, noise_module, noise_wide = rng.spawn(5)
    yaw = float(draw_yaw.uniform(0, 2 * np.pi))
    module = bench.module(draw_module).with_effects(effects).with_laws(laws)
    motion = bench.table.run(profile, environment, effects, yaw=yaw, progress=progress)
    recording = record(motion, module, noise_module, plant="rate_table", name=name, command=profile)
    wide = None
    if bench.has_papers_module:
        wide_module = Instruments.from_parts("adxrs649").drawn(draw_wide)
        wide = record(motion, wide_module, noise_wide, plant="rate_table", name=f"{name}-adxrs649", command=profile)
    rates = papers_rates(recording, fixed_axis=bench.table.second is None)
    if wide is not None:
        rates["adxrs649"] = replace(gyroscope(wide.need("gyroscope"), wide.sheets["gyroscope"]), method="adxrs649")
    off = 0.0
    if "accelerometer" in rates:
        off = float(np.abs(module.sensors["accelerometer"].offset[:2]).max())  # type: ignore[union-attr]
    return RateTableRun(profile, motion, recording, wide, rates, _envelopes(recording, rates), off, bench)


def papers_rates(recording: Recording, *, fixed_axis: bool = True) -> dict[str, YawRate]:
    """Return the rate by each of the paper's methods for which the recording has the sensor."""
    rates = {}
    if "magnetometer" in recording:
        rates["fft"] = fft(recording.need("magnetometer"), fixed_axis=fixed_axis)
    if "accelerometer" in recording and np.hypot(*np.asarray(recording.sheets["accelerometer"].position)[:2]) > 0:
        rates["accelerometer"] = accelerometer(recording.need("accelerometer"), recording.sheets["accelerometer"])
    if "gyroscope" in recording:
        rates["gyroscope"] = gyroscope(recording.need("gyroscope"), recording.sheets["gyroscope"])
    return rates


def _envelopes(recording: Recording, rates: Mapping[str, YawRate]) -> dict[float, YawRate]:
    if "accelerometer" not in rates:
        return {}
    samples, sheet = recording.need("accelerometer"), recording.sheets["accelerometer"]
    return {error: accelerometer(samples, sheet, AccelerometerErrors(mount=error)) for error in MOUNT_ERRORS}


def with_all_methods(run: RateTableRun) -> RateTableRun:
    """Return the run with the rates of every method that its sensors allow, the paper's ones as they are."""
    from discsim.estimators.methods import all_methods

    found, _ = all_methods(run.recording)
    others = {rate.method: rate for rate in found if rate.method not in (*run.rates, "rate_reference")}
    return replace(run, rates={**run.rates, **others})


def plateaus(profile: Samples, tolerance: float = 0.0) -> list[tuple[float, float, float]]:
    """Return (start s, stop s, rate rad/s) of the level stretches of a profile that outlast their margins.

    A stretch is level where no two of its rates are further apart than twice the tolerance (rad/s); its rate is their
    median. Of stretches that overlap the longest is taken.
    """
    t, rate = profile.t, profile.value
    reach = _level_until(rate, 2.0 * tolerance)
    found = []
    ranges = [(0, t.size - 1)]
    while ranges:
        first, last = ranges.pop()
        if t[last] - t[first] <= 2 * MARGIN_S:
            continue
        ends = np.minimum(reach[first : last + 1], last)
        start = first + int(np.argmax(t[ends] - t[first : last + 1]))
        stop = int(ends[start - first])
        if t[stop] - t[start] <= 2 * MARGIN_S:
            continue
        level = float(np.median(rate[start : stop + 1]))
        found.append((float(t[start]) + MARGIN_S, float(t[stop]) - MARGIN_S, level))
        ranges += [(first, start), (stop, last)]
    return sorted(found)


def _level_until(rate: FloatArray, width: float) -> NDArray[np.int64]:
    """Return for each of rates (n,) the last index up to which all that follow lie within ``width`` of one another."""
    highest: deque[int] = deque()
    lowest: deque[int] = deque()
    reach = np.empty(rate.size, dtype=np.int64)
    values = rate.tolist()
    first = 0
    for k, value in enumerate(values):
        while highest and values[highest[-1]] <= value:
            highest.pop()
        highest.append(k)
        while lowest and values[lowest[-1]] >= value:
            lowest.pop()
        lowest.append(k)
        while values[highest[0]] - values[lowest[0]] > width:
            reach[first] = k - 1
            first += 1
            if highest[0] < first:
                highest.popleft()
            if lowest[0] < first:
                lowest.popleft()
    reach[first:] = rate.size - 1
    return reach


def true_rate(motion: Motion) -> Callable[[FloatArray], FloatArray]:
    """Return the function that tells a motion's rate about z_B, rad/s, at times (n,) s."""
    return lambda t: motion.at(t).rate[:, 2]


def errors_within(
    rate: YawRate, truth: Callable[[FloatArray], FloatArray], start: float, stop: float
) -> tuple[FloatArray, BoolArray]:
    """Return errors (n,) rad/s against truth of the estimates from start to stop, and which of them are known.

    Of magnitudes where the method tells no direction.
    """
    chosen = (rate.t >= start) & (rate.t <= stop)
    true = truth(rate.t[chosen])
    error = rate.rate[chosen] - (true if rate.signed else np.abs(true))
    return error, np.isfinite(error)


def plateau_table(run: RateTableRun, tolerance: float = 0.0) -> list[Plateau]:
    """Return the errors of each method on each plateau of the profile."""
    return plateau_rows(run.rates, run.truth, plateaus(run.profile, tolerance))


def plateau_rows(
    rates: Mapping[str, YawRate],
    truth: Callable[[FloatArray], FloatArray],
    spans: Sequence[tuple[float, float, float]],
) -> list[Plateau]:
    """Return the errors of each method against a truth on stretches (start s, stop s, rate rad/s)."""
    table = []
    for start, stop, rate in spans:
        for method, estimate in rates.items():
            error, known = errors_within(estimate, truth, start, stop)
            share = float(np.mean(known)) if known.size else 0.0
            seen = error[known]
            figures = (seen.mean(), seen.std(), np.abs(seen).max()) if seen.size else (np.nan,) * 3
            table.append(Plateau(method, rate, share, *(float(figure) for figure in figures)))
    return table


def write_plateaus(path: Path, table: list[Plateau]) -> None:
    """Write the table as CSV, in deg/s and per cent of the plateau's rate."""
    lines = ["rate_deg_s,method,known_share,bias_deg_s,sd_deg_s,worst_deg_s,bias_percent,sd_percent,worst_percent"]
    for row in table:
        degrees = [np.degrees(x) for x in (row.bias, row.sd, row.worst)]
        percent = [100 * x / abs(row.rate) if row.rate else np.nan for x in (row.bias, row.sd, row.worst)]
        cells = ["" if np.isnan(x) else f"{x:.4f}" for x in (*degrees, *percent)]
        lines.append(f"{np.degrees(row.rate):.6g},{row.method},{row.known:.3f}," + ",".join(cells))
    write_text(path, "\n".join([*lines, ""]))


#: rate from which the paper's mount errors outweigh its accelerometer's bias, deg/s: that fades with the rate's square
_MOUNT_OUTWEIGHS = 3900.0


def rate_table_checks(run: RateTableRun, table: list[Plateau]) -> list[Score]:
    """Turn what the paper says of its Fig. 7 into figures that can be off.

    Its words: the gyroscope saturates; the wide-range one is noisy; the FFT is the most accurate at high rates, with
    a small distortion even at a static rate, a delay of half its window, and nothing below its threshold; the
    accelerometer's envelope widens with the mount error, and holds the truth. Of other modules and tables it says
    nothing.
    """
    if not run.bench.is_papers:
        return []

    def of(method: str, above: float, below: float = np.inf) -> list[Plateau]:
        """Return the method's plateaus with a rate between, either way round, deg/s."""
        return [row for row in table if row.method == method and above <= abs(np.degrees(row.rate)) < below]

    threshold = float(np.degrees(FftSettings().threshold))
    # beyond what a gyroscope that reads 3 % and 5 deg/s low still shows
    high = max(2000.0, 1.04 * float(np.degrees(run.recording.sheets["gyroscope"].range or np.inf)))
    interval = run.recording.need("magnetometer").interval
    scores = []
    if low := of("fft", 0.0, threshold - 150):
        scores.append(at_most("rate table: share of fft values below its threshold", _most(low, "known"), "1", 0.0))
    if middle := of("fft", threshold + 50):
        share = min(row.known for row in middle)
        scores.append(score("rate table: smallest share of a plateau that fft knows", share, "1", 1.0, 0.02))
        # leakage from the negative frequency shifts the peak by up to a tenth of the window's resolution
        worst, resolution = np.degrees(_most(middle, "bias")), 360.0 / (FftSettings().window * interval)
        scores.append(at_most("rate table: largest bias of fft on a plateau", worst, "deg/s", 0.1 * resolution))
        # leakage ripples with the window's phase: never nothing, never more than a few deg/s once it turns twice
        distortion = np.degrees(_most(middle, "sd"))
        scores.append(score("rate table: largest distortion of fft at a static rate", distortion, "deg/s", 2.5, 2.45))
    if fast := of("fft", high):
        worst = np.max([abs(row.bias / row.rate) for row in fast])
        scores.append(at_most("rate table: largest relative bias of fft at high rates", 100 * worst, "%", 0.15))
        share = _most(of("gyroscope", high), "known")
        scores.append(at_most("rate table: share of gyroscope values beyond its range", share, "1", 0.0))
        noise = float(np.median([np.degrees(row.sd) for row in of("adxrs649", high)]))
        scores.append(score("rate table: noise of the wide-range gyroscope", noise, "deg/s", 14.0, 1.4))
        # a single accelerometer may by chance be a good one; what it can be trusted to is its envelope, and beyond its
        # range nothing, where the wide-range gyroscope is the next best
        trusted = np.array([envelope_on(run, MOUNT_ERRORS[0], row.rate)[0] / 2 for row in fast])
        ratio = np.max(_rms(fast) / np.fmin(_rms(of("adxrs649", high)), trusted))
        scores.append(score("rate table: fft error over the next best method's at high rates", ratio, "1", 0.0, 1.0))
    # slower, the accelerometer's bias counts for more in its envelope than a mount error of 1 mm does in (9)
    if known := [row for row in of("accelerometer", max(high, _MOUNT_OUTWEIGHS)) if row.known > 0.5]:
        scores.extend(_envelope_checks(run, max(known, key=lambda row: abs(row.rate)).rate))
    lag = fft_delay(run)
    if np.isfinite(lag):
        expected = (FftSettings().window - 1) / 2 * interval
        scores.append(score("rate table: delay of the unshifted fft", lag, "s", expected, 0.05 * expected))
    return scores


def _most(rows: list[Plateau], figure: str) -> float:
    """Return the largest size of a figure; NaN where one of them is, so that nothing unknown passes."""
    return float(np.max([abs(getattr(row, figure)) for row in rows]))


def _rms(rows: list[Plateau]) -> FloatArray:
    return np.array([np.hypot(row.bias, row.sd) for row in rows])


def envelope_on(run: RateTableRun, mount: float, rate: float) -> tuple[float, float]:
    """Return the envelope's median width on the plateau of a rate (rad/s) and the share of it that misses the truth.

    NaN where the accelerometer is beyond its range.
    """
    start, stop, _ = next(span for span in plateaus(run.profile) if span[2] == rate)
    estimate = run.envelopes[mount]
    assert estimate.lower is not None
    assert estimate.upper is not None
    chosen = (estimate.t >= start) & (estimate.t <= stop) & np.isfinite(estimate.lower)
    if not chosen.any():
        return float("nan"), float("nan")
    low, high = estimate.lower[chosen], estimate.upper[chosen]
    return float(np.median(high - low)), float(np.mean((low > abs(rate)) | (high < abs(rate))))


def _envelope_checks(run: RateTableRun, rate: float) -> list[Score]:
    """Score the envelopes on a plateau (rad/s) against (9); they hold the truth if they allow for the mount."""
    distance = float(np.hypot(*np.asarray(run.recording.sheets["accelerometer"].position)[:2]))
    scores, widths, missed = [], {}, []
    for mount in MOUNT_ERRORS:
        widths[mount], outside = envelope_on(run, mount, rate)
        if mount >= run.mount:
            missed.append(outside)
        # (9) at the corners of mount error and (13), at high rate; what bias and gravity add is in the margin
        spread = (1.005 + 0.02) * mount
        predicted = np.sqrt(distance / (0.995 * distance - spread)) - np.sqrt(distance / (1.005 * distance + spread))
        name = f"rate table: envelope width for {1000 * mount:g} mm at {abs(np.degrees(rate)):.0f} deg/s over (9)"
        scores.append(score(name, widths[mount] / abs(rate) / predicted, "1", 1.0, 0.15))
    ratio = widths[MOUNT_ERRORS[1]] / widths[MOUNT_ERRORS[0]]
    scores.append(score("rate table: envelope width of 5 mm over that of 1 mm", ratio, "1", 5.0, 1.5))
    if missed:
        scores.append(at_most("rate table: share of truth outside the envelopes", np.max(missed), "1", 0.0))
    return scores


def fft_delay(run: RateTableRun) -> float:
    """Return by how much the unshifted estimate lags on ramps, s: its error over the slope, median."""
    late = fft(run.recording.need("magnetometer"), FftSettings(stamp="unshifted"), fixed_axis=True)
    delays = []
    knots = list(zip(run.profile.t.tolist(), run.profile.value.tolist(), strict=True))
    for (t0, r0), (t1, r1) in pairwise(knots):
        if r0 == r1 or r0 * r1 < 0:  # level, or through zero, where the estimate has no sign
            continue
        r0, r1 = abs(r0), abs(r1)
        slope = (r1 - r0) / (t1 - t0)
        # the middle of the ramp reaches the stamp half a window later; take it where the window's centre is central
        window = FftSettings().window * run.recording.need("magnetometer").interval
        middle = (t0 + t1) / 2 + window / 2
        near = np.abs(late.t - middle) < 0.1
        # a ramp counts where fft follows it throughout, and where its lag stands well above fft's own errors
        followed = near.any() and np.all(np.isfinite(late.rate[np.abs(late.t - middle) < window / 2]))
        if not followed or abs(slope) * window / 2 < np.radians(50.0):
            continue
        command = r0 + slope * (late.t[near] - t0)
        delays.extend(((command - late.rate[near]) / slope).tolist())
    known = np.array(delays)[np.isfinite(delays)] if delays else np.array([])
    return float(np.median(known)) if known.size else float("nan")
