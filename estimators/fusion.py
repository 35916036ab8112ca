"""Spin rate from magnetometer, accelerometer and gyroscope together, each with its faults estimated along.

The magnetometer counts turns and needs no calibration, so it leads (`discsim.estimators.tracking`). The accelerometer's
centripetal part is separated from gravity and translation, which turn with the spin and average out over a turn; its
mount offset, scale and bias are unknowns with priors. The gyroscope's z counts where it does not clip, with unknown
scale and bias. A sensor that contradicts the magnetometer beyond its faults' priors is named with numbers and never
averaged with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray, sd_by_median
from discsim.errors import InputError
from discsim.estimators.centripetal import centripetal
from discsim.estimators.likelihood import LEAST, span_of
from discsim.estimators.rate import YawRate
from discsim.estimators.tracking import RateRows, Track, TrackingSettings, joined, plain_tracks, tracks_of
from discsim.estimators.usable import remembered
from discsim.recording import Recording, Samples, SensorSheet

__all__ = [
    "FASTEST_THROW",
    "Agreement",
    "FusionSettings",
    "accelerometer_calibrated",
    "by_slow_field",
    "compare_sensors",
    "contradictions",
    "fusion",
    "mostly_clipped",
    "slow_field",
    "unfolding",
]


@dataclass(frozen=True)
class FusionSettings:
    """Settings of `fusion`; the priors are standard deviations.

    Attributes
    ----------
    tracking : TrackingSettings
        Of the smoother.
    mount : float
        Of the accelerometer's place where the recording states none, m; scale and cross-axis faults count in it.
    accelerometer_bias : float
        m/s^2; 60 mg is an MPU-9250's.
    gyroscope_scale, gyroscope_bias : float
        Relative and rad/s, along z.
    turns, shortest : float
        Turns, and at least seconds, over which the accelerometer is averaged.
    contradiction : float
        A sensor whose calibration must leave its prior by more than this many sigma, or whose residual exceeds its
        noise as many times, contradicts.
    tolerance : float
        A residual below this share of the rate is no contradiction, however small the noise.
    """

    tracking: TrackingSettings = field(default_factory=TrackingSettings)
    mount: float = 0.003
    accelerometer_bias: float = 0.6
    gyroscope_scale: float = 0.03
    gyroscope_bias: float = 0.1
    turns: float = 2.0
    shortest: float = 0.1
    contradiction: float = 4.0
    tolerance: float = 0.003

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if name != "tracking" and not value > 0:
                raise InputError(f"fusion {name}: got {value}, expected a positive number")


@dataclass(frozen=True)
class Agreement:
    """How a sensor compares with the magnetometer's spin rate once its calibration has been estimated.

    ``difference`` and ``scatter`` are mean and rms of its rate less the magnetometer's with the data sheet's
    calibration, rad/s; ``residual`` the rms left after calibration, and ``chi2`` its square over the expected, per
    reading; ``calibration`` and ``covariance`` what was found, ``departure`` the largest departure of one from
    its prior in prior sigma; ``readings`` the number used.
    """

    sensor: str
    agrees: bool
    readings: int
    difference: float
    scatter: float
    residual: float
    chi2: float
    departure: float
    calibration: FloatArray
    covariance: FloatArray

    def __str__(self) -> str:
        """One line for a person, in deg/s."""
        degrees = np.degrees([self.difference, self.scatter, self.residual])
        verdict = "agrees with" if self.agrees else "CONTRADICTS"
        return (
            f"{self.sensor} {verdict} the magnetometer: as stated it differs by {degrees[0]:+.2f} deg/s on average"
            f" (rms {degrees[1]:.2f}), calibrated by rms {degrees[2]:.2f} deg/s; chi-square {self.chi2:.2f} per reading"
            f" over {self.readings} readings, calibration {self.departure:.1f} sigma from what was expected"
        )


def _accelerometer_rows(
    recording: Recording, t: FloatArray, rate: FloatArray, settings: FusionSettings
) -> RateRows | None:
    if "accelerometer" not in recording:
        return None
    sheet = recording.sheets["accelerometer"]
    if sheet.position is None or float(np.hypot(*sheet.position[:2])) < 1e-4:
        return None
    block = centripetal(
        recording.need("accelerometer"), sheet, t, rate, turns=settings.turns, shortest=settings.shortest
    )
    if block.t.size == 0:
        return None
    stated = sheet.sigma.get("position_m")
    mount = np.full(2, settings.mount)
    if stated is not None:
        # scale and cross-axis faults of a per cent or two count in the place
        mount = np.hypot(np.broadcast_to(stated, (3,))[:2], 0.02 * float(np.hypot(*sheet.position[:2])))
    calibration = np.array([sheet.position[0], sheet.position[1], 0.0, 0.0])
    prior = np.array([mount[0], mount[1], settings.accelerometer_bias, settings.accelerometer_bias])
    return RateRows("centripetal", block.t, block.value, block.sd, calibration, prior)


def _gyroscope_rows(recording: Recording, settings: FusionSettings) -> RateRows | None:
    """Means of the unclipped z readings over blocks of 0.05 s."""
    gyroscope = recording.get("gyroscope")
    if gyroscope is None:
        return None
    sheet = recording.sheets["gyroscope"]
    z = gyroscope.value[:, 2]
    # beside a clipped reading the sensor's own filter may still be held
    clipped = sheet.clipped(gyroscope.value)[:, 2]
    beside = clipped | np.roll(clipped, 1) | np.roll(clipped, -1)
    good: BoolArray = np.isfinite(z) & ~beside
    if np.count_nonzero(good) < 4:
        return None
    t, z = gyroscope.t[good], z[good]
    length = 0.05
    label = np.floor((t - t[0]) / length).astype(int)
    _, first, count = np.unique(label, return_index=True, return_counts=True)
    mean_t, mean_z = np.add.reduceat(t, first) / count, np.add.reduceat(z, first) / count
    # noise from second differences of the readings: motion is smooth
    rough = np.diff(z, 2)
    noise = float(sd_by_median(rough) / np.sqrt(6)) if rough.size else 0.0
    noise = max(noise, float(np.hypot(sheet.noise_rms or 0.0, (sheet.resolution or 0.0) / np.sqrt(12))), 1e-4)
    return RateRows(
        "linear",
        mean_t,
        mean_z,
        noise / np.sqrt(count),
        np.zeros(2),
        np.array([settings.gyroscope_scale, settings.gyroscope_bias]),
    )


# ---------------------------------------------------------------------------------------------- agreement


@dataclass(frozen=True)
class _Reference:
    """The magnetometer's rate: t, rate and sd (n,), slope of the rate, and the blur of its knots."""

    t: FloatArray
    rate: FloatArray
    sd: FloatArray
    slope: FloatArray
    blur: FloatArray


def _reference(recording: Recording, tracks: list[Track], settings: TrackingSettings) -> _Reference:
    whole = joined("tracking", tracks, settings, span_of(recording))
    slope = np.gradient(whole.rate, whole.t) if len(whole) > 1 else np.zeros(len(whole))
    blur = np.zeros(len(whole))
    for track in tracks:
        own = slice(*np.searchsorted(whole.t, [track.t[0] - 1e-9, track.t[-1] + 1e-9]))
        blur[own] = np.maximum(blur[own], np.interp(whole.t[own], track.t, track.blur))
    return _Reference(whole.t, whole.rate, whole.sd, slope, blur)


class _Calibrating(NamedTuple):
    """A sensor's readings y (k,) as ``design @ calibration``, (k, m), with their sd (k,).

    ``lean`` (k,) is what one sd of the magnetometer's rate does to them, ``difference`` (n,) the sensor's rate as
    stated less the magnetometer's, and ``rate_left`` the rms rate, rad/s, of what a calibration (m,) leaves, (k,).
    """

    design: FloatArray
    y: FloatArray
    sd: FloatArray
    lean: FloatArray
    difference: FloatArray
    rate_left: Callable[[FloatArray, FloatArray], float]


def _linear(row: RateRows, inside: BoolArray, r: FloatArray, sd_r: FloatArray) -> _Calibrating:
    """Return a gyroscope's readings, (1 + a) r + b."""
    y = row.value[inside] - r
    sd = np.hypot(row.sd[inside], sd_r)
    design = np.column_stack([r, np.ones_like(r)])
    return _Calibrating(design, y, sd, -sd_r, y, lambda found, error: float(np.sqrt(np.mean(error**2))))


def _pulled(row: RateRows, inside: BoolArray, r: FloatArray, sd_r: FloatArray, slope: FloatArray) -> _Calibrating:
    """Return an accelerometer's centripetal readings, (-r^2 + i r') d + b, real parts above imaginary ones."""
    shape = -(r**2) + 1j * slope
    columns = np.column_stack([shape, 1j * shape, np.ones_like(shape), 1j * np.ones_like(shape)])
    measured = row.value[inside, 0] + 1j * row.value[inside, 1]
    d = complex(row.calibration[0], row.calibration[1])
    own = np.hypot(row.sd[inside], 2 * np.abs(r) * abs(d) * sd_r * np.abs(d.real) / abs(d))
    other = np.hypot(row.sd[inside], 2 * np.abs(r) * abs(d) * sd_r * np.abs(d.imag) / abs(d))
    radial = -(measured * np.conj(d)).real / abs(d)

    def rate_left(found: FloatArray, error: FloatArray) -> float:
        half, d = error.size // 2, complex(found[0], found[1])
        radial_error = (error[:half] * d.real + error[half:] * d.imag) / abs(d)
        return float(np.sqrt(np.mean((radial_error / (2 * np.abs(r) * abs(d))) ** 2)))

    return _Calibrating(
        np.concatenate([columns.real, columns.imag]),
        np.concatenate([measured.real, measured.imag]),
        np.concatenate([own, other]),
        np.concatenate([2 * r * sd_r * d.real, 2 * r * sd_r * d.imag]),
        np.sqrt(np.maximum(radial, 0.0) / abs(d)) - np.abs(r),
        rate_left,
    )


def _compare(
    sensor: str, row: RateRows, reference: _Reference, settings: FusionSettings
) -> tuple[Agreement, RateRows] | None:
    """Calibrate a sensor against the magnetometer and judge what is left; return it with noise as large as found."""
    known = np.isfinite(reference.rate)
    if np.count_nonzero(known) < 2:
        return None
    at = reference.t[known]
    r = np.interp(row.t, at, reference.rate[known], left=np.nan, right=np.nan)
    index = np.clip(np.searchsorted(at, row.t), 1, at.size - 1)
    r[np.diff(at)[index - 1] > 0.5] = np.nan
    inside = np.isfinite(r)
    if np.count_nonzero(inside) < 4:
        return None
    # at the ends the smoother knows little
    sd_r = np.interp(row.t, at, reference.sd[known])[inside]
    slope = np.interp(row.t, at, reference.slope[known])[inside]
    r = r[inside]
    told = _linear(row, inside, r, sd_r) if row.kind == "linear" else _pulled(row, inside, r, sd_r, slope)
    precision = np.diag(1 / row.prior**2)
    weighted = told.design / told.sd[:, None]
    covariance = np.linalg.inv(weighted.T @ weighted + precision)
    found = covariance @ (weighted.T @ (told.y / told.sd) + precision @ row.calibration)
    error = told.y - told.design @ found
    # the noise that was found may exceed the sensor's own: unmodelled motion; a robust measure of it
    chi2 = float(np.mean((error / told.sd) ** 2))
    departure = float(np.max(np.abs(found - row.calibration) / row.prior))
    residual = told.rate_left(found, error)
    # The magnetometer's error (precession, the gain of p and q) may hold throughout: it passes into the calibration.
    drift = covariance @ (weighted.T @ (told.lean / told.sd))
    alike = chi2 <= settings.contradiction**2 or residual <= settings.tolerance * float(np.mean(np.abs(r)))
    agreement = Agreement(
        sensor=sensor,
        agrees=alike and departure <= settings.contradiction,
        readings=int(np.count_nonzero(inside)),
        difference=float(np.mean(told.difference)),
        scatter=float(np.sqrt(np.mean(told.difference**2))),
        residual=residual,
        chi2=chi2,
        departure=departure,
        calibration=found,
        covariance=np.asarray(covariance * max(1.0, chi2) + np.outer(drift, drift), dtype=np.float64),
    )
    blur = np.interp(row.t, reference.t, reference.blur)
    if row.kind == "centripetal":
        blur = blur * 2 * np.abs(np.interp(row.t, at, reference.rate[known])) * np.hypot(found[0], found[1])
    return agreement, replace(row, sd=np.hypot(row.sd * max(1.0, np.sqrt(chi2)), blur))


@remembered
def _judged(
    recording: Recording, settings: FusionSettings
) -> tuple[list[Track], list[Agreement], list[RateRows], tuple[int, bool]]:
    """Return the magnetometer's tracks, every other sensor's agreement, the rows of those that agree, the folding."""
    turns, known = unfolding(recording, settings)
    tracks = plain_tracks(recording, settings.tracking, turns) if known else []
    reference = _reference(recording, tracks, settings.tracking)
    agreements, rows = [], []
    gyroscope = _gyroscope_rows(recording, settings)
    accelerometer = _accelerometer_rows(recording, reference.t, reference.rate, settings)
    for sensor, row in (("gyroscope", gyroscope), ("accelerometer", accelerometer)):
        result = _compare(sensor, row, reference, settings) if row is not None else None
        if result is not None:
            agreements.append(result[0])
            if result[0].agrees:
                rows.append(result[1])
    return tracks, agreements, rows, (turns, known)


def compare_sensors(recording: Recording, settings: FusionSettings | None = None) -> list[Agreement]:
    """Say of each other sensor whether it agrees with the magnetometer, with numbers (``str`` of each is a line)."""
    return _judged(recording, settings or FusionSettings())[1]


def contradictions(recording: Recording) -> list[str]:
    """Return a line for each sensor that contradicts the magnetometer; none where there is nothing to compare."""
    if "magnetometer" not in recording or len(recording.need("magnetometer")) < LEAST:
        return []
    return [str(agreement) for agreement in compare_sensors(recording) if not agreement.agrees]


@remembered
def unfolding(recording: Recording, settings: FusionSettings | None = None) -> tuple[int, bool]:
    """Tell how many whole turns per sampling interval the magnetometer misses, and whether that is known.

    Above half its sampling rate the field shows r - 2 pi f_s k. The gyroscope's z, or the centripetal force, tells k;
    a clipped one only bounds it, and then a free spin has to slow down, too. Without another sensor k is taken as zero,
    as far as that is known; where a sensor excludes zero and cannot choose among the rest the answer is unknown. Where
    the direction that a clipped gyroscope shows leaves no spin of a throw it is no folding that the sensors differ by.
    """
    settings = settings or FusionSettings()
    magnetometer = recording.need("magnetometer")
    if len(magnetometer) < 16:
        return 0, True
    fold = 2 * np.pi / magnetometer.interval
    outside, alone = _may_fold(recording, fold), by_slow_field(recording)
    sought = outside or mostly_clipped(recording) or alone
    plain = tracks_of(recording, replace(settings.tracking, knots=KNOTS), unfold=0) if sought else []
    if not plain:
        return 0, True
    middle = float(np.median(np.concatenate([track.rate for track in plain])))
    rates = {k: middle + k * fold for k in (0, -1, 1, -2, 2)}
    longest = max(plain, key=lambda track: len(track.t))
    votes = _by_gyroscope(recording, rates, fold, longest)
    votes += [_slowing(longest, rates, _slope_sd(longest))] if alone else []
    if votes and not set.intersection(*votes):
        return 0, True  # no throw turns so that the field would show this: an axis is reversed, or readings are lost
    # a mount that is wrong shows any rate: it is asked where it shows one that the field cannot
    votes += _by_pull(recording, rates, settings) if outside else []
    possible = set(rates)
    for vote in votes:
        possible &= vote
    if not votes or 0 in possible:
        return 0, True
    if len(possible) == 1:
        return possible.pop(), True
    return 0, False


def _by_gyroscope(recording: Recording, rates: Mapping[int, float], fold: float, track: Track) -> list[set[int]]:
    """Return which of some rates (rad/s, by their k) a gyroscope's z allows, and where it is clipped a free spin."""
    z, _ = _spin_readings(recording)
    if not z.size:
        return []
    level = float(np.median(z))
    if not mostly_clipped(recording):
        return [{k for k, rate in rates.items() if abs(rate - level) < 0.1 * fold}]
    votes = [{k for k, rate in rates.items() if rate * np.sign(level) > 0.9 * abs(level)}]
    return [*votes, _slowing(track, rates)] if recording.plant in ("flight", "free_spin") else votes


def _by_pull(recording: Recording, rates: Mapping[int, float], settings: FusionSettings) -> list[set[int]]:
    """Return which of some rates (rad/s, by their k) the centripetal force at a known place allows."""
    pull = _pull(recording)
    if pull is None:
        return []
    force, radius, clipped = pull
    bias = settings.accelerometer_bias + 0.05 * force
    low = np.sqrt(max(force - 3 * bias, 0.0) / (radius + 2 * settings.mount))
    high = np.sqrt((force + 3 * bias) / max(radius - 2 * settings.mount, 0.2 * radius))
    high = np.inf if clipped > 0.05 else high
    return [{k for k, rate in rates.items() if low <= abs(rate) <= high}] if force > 0 else []


def _pull(recording: Recording) -> tuple[float, float, float] | None:
    """Return an accelerometer's mean force across z, m/s^2, its radius, m, and the share of readings at a limit.

    None where there is no reading, or no place off the axis is stated.
    """
    accelerometer = recording.get("accelerometer")
    if accelerometer is None:
        return None
    sheet = recording.sheets["accelerometer"]
    radius = float(np.hypot(*sheet.position[:2])) if sheet.position is not None else 0.0
    present = np.all(np.isfinite(accelerometer.value[:, :2]), axis=1)
    if not radius > 1e-4 or not np.any(present):
        return None
    clipped = np.any(sheet.clipped(accelerometer.value)[present, :2], axis=1)
    force = float(np.hypot(*np.mean(accelerometer.value[present, :2], axis=0)))
    return force, radius, float(np.mean(clipped))


#: Knots of the track by which turns that are missed are sought, s.
KNOTS = 0.4
#: No disc is thrown with more spin, rad/s (docs/checking.md).
FASTEST_THROW = 200.0
#: A free spin slows down, but with a time constant above two seconds, and what grows by less than this share in a
#: second may be steady.
STEEPEST, STEADY = 0.5, 0.02


def _slowing(track: Track, rates: Mapping[int, float], off: float = 0.0) -> set[int]:
    """Return which of some rates at the middle of a track (rad/s, by their k) are those of a free spin that slows.

    The track's slope may be ``off`` by so much, rad/s^2.
    """
    slope = float(np.polyfit(track.t, track.rate, 1)[0]) if len(track.t) > 2 else 0.0
    change = {k: (slope / rate, off / abs(rate)) for k, rate in rates.items() if 0.0 < abs(rate) < FASTEST_THROW}
    return {k for k, (share, room) in change.items() if -STEEPEST - room < share < STEADY + room}


def _slope_sd(track: Track) -> float:
    """Return what the slope of a track may be off by, rad/s^2: three sd of a line through its knots."""
    lasts = float(track.t[-1] - track.t[0]) if len(track.t) > 2 else 0.0
    knots = max(lasts / KNOTS, 1.0)
    return float(3.0 * np.median(track.sd) * np.sqrt(12.0 / knots) / lasts) if lasts > 0.0 else np.inf


def slow_field(recording: Recording) -> bool:
    """Tell a magnetometer that shows the fastest throws folded."""
    field = recording.get("magnetometer")
    return field is not None and np.pi / field.interval < FASTEST_THROW


def by_slow_field(recording: Recording) -> bool:
    """Tell a throw of which nothing but a magnetometer shows the direction of spin, too slow a one for any throw."""
    airborne = recording.plant in ("flight", "free_spin")
    return airborne and not _spin_readings(recording)[0].size and slow_field(recording)


def mostly_clipped(recording: Recording) -> bool:
    """Tell a gyroscope whose z stands at its limit in half of its readings or more: it bounds the spin alone."""
    z, clipped = _spin_readings(recording)
    return z.size > 0 and bool(np.mean(clipped) >= 0.5)


def _spin_readings(recording: Recording) -> tuple[FloatArray, BoolArray]:
    """Return what a gyroscope reads of z (n,), rad/s, gaps left out, and which readings are at its limit."""
    gyroscope = recording.get("gyroscope")
    if gyroscope is None:
        return np.zeros(0), np.zeros(0, dtype=np.bool_)
    z, clipped = gyroscope.value[:, 2], recording.sheets["gyroscope"].clipped(gyroscope.value)[:, 2]
    return z[np.isfinite(z)], clipped[np.isfinite(z)]


def _may_fold(recording: Recording, fold: float) -> bool:
    """Tell whether another sensor shows a rate that the magnetometer cannot show plainly."""
    z, _ = _spin_readings(recording)
    if z.size and float(np.median(np.abs(z))) > 0.45 * fold:
        return True
    pull = _pull(recording)
    return pull is not None and float(np.sqrt(pull[0] / pull[1])) > 0.4 * fold


# ---------------------------------------------------------------------------------------------- methods


def fusion(recording: Recording, settings: FusionSettings | None = None) -> YawRate:
    """Spin rate, signed, from all sensors that agree. Raises `InputError` if the recording has no magnetometer.

    An accelerometer alone against the magnetometer is left out: its mount is the likelier fault. A gyroscope in range
    against it is believed if the accelerometer agrees with the gyroscope; else nothing can tell which of them is wrong
    and the answer is NaN, as it is where the magnetometer's sampling is too slow for the spin and no other sensor tells
    by how much.
    """
    settings = settings or FusionSettings()
    tracks, agreements, rows, (turns, _) = _judged(recording, settings)
    verdict = {agreement.sensor: agreement for agreement in agreements}
    if "gyroscope" in verdict and not verdict["gyroscope"].agrees:
        return _without_magnetometer(recording, settings, verdict)
    if rows and tracks:
        tracks = tracks_of(recording, settings.tracking, rows, unfold=turns, near=tracks)
    return joined("fusion", tracks, settings.tracking, span_of(recording))


def _without_magnetometer(recording: Recording, settings: FusionSettings, verdict: dict[str, Agreement]) -> YawRate:
    """Return the gyroscope's rate where the accelerometer bears it out, else NaN."""
    gyroscope = _gyroscope_rows(recording, settings)
    assert gyroscope is not None
    blank = np.full(gyroscope.t.size, np.nan)
    unknown = YawRate("fusion", gyroscope.t, blank, blank, signed=True)
    if "accelerometer" not in verdict:
        return unknown
    force = _accelerometer_rows(recording, gyroscope.t, gyroscope.value, settings)
    if force is None:
        return unknown
    alone = _centripetal_rate(force, force.calibration, np.diag(force.prior**2), 1.0, None)
    if not np.any(np.isfinite(alone.rate)):
        return unknown
    by_gyroscope = np.abs(np.interp(alone.t, gyroscope.t, gyroscope.value))
    sd = float(np.nanmean(np.hypot(alone.sd, settings.gyroscope_scale * by_gyroscope)))
    from_gyroscope = abs(float(np.nanmean(alone.rate - by_gyroscope)))
    from_magnetometer = abs(verdict["accelerometer"].difference)
    # within two sigma of the one, and beyond that of the other at more than twice the distance
    if not (from_gyroscope < 2 * sd and from_magnetometer > max(2 * sd, 2 * from_gyroscope)):
        return unknown
    own = np.hypot(settings.gyroscope_scale * gyroscope.value, settings.gyroscope_bias)
    return YawRate("fusion", gyroscope.t, gyroscope.value, np.hypot(own, gyroscope.sd), signed=True)


def accelerometer_calibrated(recording: Recording, settings: FusionSettings | None = None) -> YawRate:
    """Spin rate by the accelerometer alone, done well: averaged over turns, calibrated by the magnetometer if present.

    ``r = sqrt(-Re((c - bias) conj(d))/|d|^2)``, c the centripetal part. d (which holds the scale) and bias come from
    the comparison with the magnetometer's rate, and so does the sign; the standard deviation holds the noise, the
    uncertainty of that calibration, and the magnetometer's own error as far as it may be the same throughout. Where a
    sensor contradicts the magnetometer there is no calibration and every value is NaN; `contradictions` says why.
    Without a magnetometer that knows the rate d and bias are the data sheet's within their priors; there is no sign.
    """
    settings = settings or FusionSettings()
    accelerometer = recording.need("accelerometer")
    sheet = recording.sheets["accelerometer"]
    if sheet.position is None or float(np.hypot(*sheet.position[:2])) < 1e-4:
        raise InputError(
            "the accelerometer's place off the spin axis is not stated; add position_m = [x, y, z] to "
            "[sensors.accelerometer] of recording.toml, or to the import map"
        )
    blank = np.full(len(accelerometer), np.nan)
    unknown = YawRate("accelerometer_calibrated", accelerometer.t, blank, blank)
    if "magnetometer" in recording:
        tracks, agreements, _, _ = _judged(recording, settings)
        if any(not agreement.agrees for agreement in agreements):
            return unknown
        reference = _reference(recording, tracks, settings.tracking)
        row = _accelerometer_rows(recording, reference.t, reference.rate, settings)
        found = [agreement for agreement in agreements if agreement.sensor == "accelerometer"]
        if row is not None and found:
            sign = np.sign(np.interp(row.t, reference.t, np.nan_to_num(reference.rate)))
            return _centripetal_rate(row, found[0].calibration, found[0].covariance, found[0].chi2, sign)
    rate = _rough_rate(accelerometer, sheet)
    row = _accelerometer_rows(recording, accelerometer.t, rate, settings)
    if row is None:
        return unknown
    return _centripetal_rate(row, row.calibration, np.diag(row.prior**2), 1.0, None)


def _rough_rate(accelerometer: Samples, sheet: SensorSheet) -> FloatArray:
    """First guess from the force averaged over half a second."""
    assert sheet.position is not None
    if len(accelerometer) < 2:
        return np.zeros(len(accelerometer))
    present = np.all(np.isfinite(accelerometer.value[:, :2]), axis=1)
    value = np.where(present[:, None], accelerometer.value[:, :2], 0.0)
    width = min(max(3, round(0.5 / accelerometer.interval)), len(accelerometer))
    kernel = np.ones(width) / width
    count = np.maximum(np.convolve(present.astype(float), kernel, mode="same"), 1e-9)
    mean = np.stack([np.convolve(value[:, i], kernel, mode="same") / count for i in range(2)], axis=1)
    d = sheet.position[:2]
    return np.asarray(np.sqrt(np.maximum(-(mean @ d), 0.0)) / float(np.hypot(*d)))


def _centripetal_rate(
    row: RateRows, calibration: FloatArray, covariance: FloatArray, chi2: float, sign: FloatArray | None
) -> YawRate:
    d = complex(calibration[0], calibration[1])
    error = row.value[:, 0] + 1j * row.value[:, 1] - complex(calibration[2], calibration[3])
    square = -(error * np.conj(d)).real / abs(d) ** 2
    rate = np.sqrt(np.where(square > 0, square, np.nan))
    along = calibration[:2] / abs(d) ** 2
    # r^2 = -Re((c - b) conj(d))/|d|^2 and c - b = -r^2 d to first order
    gradient = np.concatenate([-np.outer(rate**2, along), np.tile(along, (rate.size, 1))], axis=1)
    variance = (row.sd * np.sqrt(max(1.0, chi2)) / abs(d)) ** 2 + np.einsum(
        "ij,jk,ik->i", gradient, covariance, gradient
    )
    sd = np.sqrt(variance) / (2 * rate)
    known = np.isfinite(rate) & (sd < 0.5 * rate)
    if sign is not None:
        rate = rate * sign
    return YawRate(
        "accelerometer_calibrated",
        row.t,
        np.where(known, rate, np.nan),
        np.where(known, sd, np.nan),
        signed=sign is not None,
    )
