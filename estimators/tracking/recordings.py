"""Tracks of whole recordings: cut into segments, each tracked from the windows' fits, and joined."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from math import sqrt

import numpy as np

from discsim.arrays import BoolArray, FloatArray, runs
from discsim.estimators.likelihood import (
    LEAST,
    LikelihoodSettings,
    ToneFit,
    fit_windows,
    span_of,
    usable_field,
    window_centres,
)
from discsim.estimators.precession import AxialField, axial_field, transverse_gyroscope
from discsim.estimators.rate import YawRate
from discsim.estimators.tracking.problem import Segment
from discsim.estimators.tracking.smoother import track_spin
from discsim.estimators.tracking.track import RateRows, Track, TrackingSettings
from discsim.estimators.usable import remembered, unclipped
from discsim.recording import Recording, Samples
from discsim.threads import side_by_side

__all__ = ["joined", "plain_tracks", "tracking", "tracks_of"]


def _segments(t: FloatArray, settings: TrackingSettings) -> list[tuple[float, float]]:
    """Cut start..stop into pieces of at most ``segment`` that share ``overlap`` with their neighbours."""
    start, stop = float(t[0]), float(t[-1])
    count = max(1, int(np.ceil((stop - start - settings.overlap) / (settings.segment - settings.overlap))))
    length = (stop - start + (count - 1) * settings.overlap) / count
    return [
        (start + i * (length - settings.overlap), start + i * (length - settings.overlap) + length)
        for i in range(count)
    ]


#: Readings whose first rate is made at once: memory does not grow with the recording.
_BLOCK = 1 << 18

#: Longest span, s, of which every step has an answer, be it that nothing is known: a day, which is 1.7 million.
LONGEST = 86400.0


def tracking(recording: Recording, settings: TrackingSettings | None = None) -> YawRate:
    """Spin rate, signed, of a whole recording from its magnetometer, and p, q of its gyroscope where it has one.

    Raises `InputError` if the recording has no magnetometer.
    """
    settings = settings or TrackingSettings()
    span = span_of(recording)
    return joined("tracking", plain_tracks(recording, settings, 0), settings, span)


@remembered
def plain_tracks(recording: Recording, settings: TrackingSettings, unfold: int) -> list[Track]:
    """Return `tracks_of` the magnetometer, without other sensors' readings of the rate."""
    return tracks_of(recording, settings, unfold=unfold)


def tracks_of(
    recording: Recording,
    settings: TrackingSettings,
    rows: list[RateRows] | None = None,
    unfold: int = 0,
    near: Sequence[Track] = (),
) -> list[Track]:
    """Return the segments' tracks, in time order; none where no window shows a spin.

    ``rows`` are other sensors' readings of the rate. ``unfold`` turns more per sampling interval than the field shows
    are made by a spin faster than half the sampling rate; only another sensor can tell (`discsim.estimators.fusion`).
    ``near`` are the tracks without those rows, from which the fits go on.
    """
    magnetometer = recording.need("magnetometer")
    sheet = recording.sheets.get("magnetometer")
    t, m = usable_field(magnetometer, sheet)
    gyroscope = transverse_gyroscope(recording)
    fixed_axis = recording.plant in ("rate_table", "spin_down")
    strength = recording.environment.field_strength
    if t.size < LEAST:
        return []
    fits, axial = _window_fits(recording, settings.window, turning=unfold == 0)
    fold = 2 * np.pi / float(np.median(np.diff(t))) * unfold
    size = float(np.median(np.linalg.norm(m, axis=1))) if strength is None else strength
    noise = None
    if sheet is not None and sheet.noise_rms is not None:
        noise = float(np.hypot(sheet.noise_rms, (sheet.resolution or 0.0) / np.sqrt(12)))
    pieces: list[tuple[Segment, FloatArray]] = []
    unfolded = replace(fits, phase_rate=fits.phase_rate - fold)
    for first, last, rate in _runs(t, unfolded, unclipped(recording, "gyroscope")):
        for start, stop in _segments(t[first:last], settings):
            chosen = slice(
                first + int(np.searchsorted(t[first:last], start - 1e-9)),
                first + int(np.searchsorted(t[first:last], stop + 1e-9)),
            )
            if chosen.stop - chosen.start < LEAST:
                continue
            segment = Segment(
                t[chosen],
                m[chosen],
                settings,
                gyroscope=None if fixed_axis else gyroscope,
                strength=strength,
                fixed_axis=fixed_axis,
                decaying=recording.plant != "rate_table",
                rows=_between(rows or [], float(t[chosen][0]), float(t[chosen][-1])),
                walk=_walk(recording, noise, size, stop - start),
            )
            pieces.append((segment, rate[chosen.start - first : chosen.stop - first]))

    known = {(one.start, one.stop): one for one in near}

    def track(piece: tuple[Segment, FloatArray]) -> Track | None:
        span = tuple(piece[0].t[[0, -1]].tolist())
        # readings so unlike a turning field that nothing can be solved have no track
        with suppress(np.linalg.LinAlgError):
            return track_spin(*piece, axial=axial, noise=noise, near=known.get(span))
        return None

    return [one for one in side_by_side(track, pieces) if one is not None]


@remembered
def _window_fits(recording: Recording, window: float, *, turning: bool) -> tuple[ToneFit, AxialField]:
    """Fit the field's tone in windows, s, that start the search, and the hard iron along z that they show.

    With ``turning`` the gyroscope's p and q, where they are there, are part of the model.
    """
    t, m = usable_field(recording.need("magnetometer"), recording.sheets.get("magnetometer"))
    gyroscope = transverse_gyroscope(recording)
    windows = LikelihoodSettings(window=window, step=window / 4, degree=1)
    centres = window_centres(t, windows)
    fits = fit_windows(t, m, centres, windows)
    axial = axial_field(fits.amplitude, fits.axial, recording.environment.field_strength)
    if gyroscope is not None and recording.plant not in ("rate_table", "spin_down") and turning:
        turned = fit_windows(t, m, centres, windows, gyroscope=gyroscope, axial=axial, start=fits)
        fits = turned if np.any(np.isfinite(turned.phase_rate)) else fits
    return fits, axial


def _walk(recording: Recording, noise: float | None, strength: float, length: float) -> float:
    """Return what the gyroscope's noise adds to the attitude, rad per root second; 0 where it cannot matter.

    It is left out where, summed over ``length`` s, it stays below a third of the magnetometer's own noise: the usual.
    """
    sheet = recording.sheets.get("gyroscope")
    if sheet is None or sheet.noise_rms is None or noise is None:
        return 0.0
    walk = sheet.noise_rms / sqrt(sheet.rate_hz)
    return walk if walk * strength * sqrt(length) > noise / 3 else 0.0


def _between(rows: list[RateRows], start: float, stop: float) -> list[RateRows]:
    """Return what each sensor has to say from start to stop, leaving out those that say nothing."""
    out = []
    for row in rows:
        chosen = (row.t >= start) & (row.t <= stop)
        if np.any(chosen):
            out.append(replace(row, t=row.t[chosen], value=row.value[chosen], sd=row.sd[chosen]))
    return out


def _runs(t: FloatArray, fits: ToneFit, gyroscope: Samples | None) -> list[tuple[int, int, FloatArray]]:
    """Return stretches of the readings, as index ranges, over which the turns can be counted, with a first rate.

    Between windows that are less than a second apart, or where the gyroscope's z is within its range, the rate is
    known well enough to carry the phase; elsewhere the turns are lost and a new stretch begins.
    """
    known = np.isfinite(fits.phase_rate)
    times, rates = fits.t[known], -fits.phase_rate[known]
    lengths = fits.length[known]
    shown = None if gyroscope is None else _known(gyroscope.t, gyroscope.value[:, 2])
    fold = 2 * np.pi / float(np.median(np.diff(t)))
    covered, rate = np.empty(t.size, dtype=bool), np.empty(t.size)
    for start in range(0, t.size, _BLOCK):
        part = slice(start, start + _BLOCK)
        covered[part], rate[part] = _first_rate(t[part], times, rates, shown, fold)
    reach = 0.5 * lengths + 0.25
    for first, last in zip(np.searchsorted(t, times - reach), np.searchsorted(t, times + reach, "right"), strict=True):
        covered[first:last] = True
    found = []
    for first, last in runs(covered):
        # a hole in the time stamps loses the turns as well
        holes = first + 1 + np.flatnonzero(np.diff(t[first:last]) > 1.0)
        for a, b in zip([first, *holes], [*holes, last], strict=True):
            found.append((int(a), int(b), rate[a:b]))
    return found


def _known(t: FloatArray, value: FloatArray) -> tuple[FloatArray, FloatArray] | None:
    """Return times and readings (n,) without gaps, or None of fewer than two."""
    good = np.isfinite(value)
    if np.count_nonzero(good) < 2:
        return None
    return (t, value) if np.all(good) else (t[good], value[good])


def _first_rate(
    t: FloatArray,
    times: FloatArray,
    rates: FloatArray,
    shown: tuple[FloatArray, FloatArray] | None,
    fold: float,
) -> tuple[BoolArray, FloatArray]:
    """Return at which of times t (n,) a gyroscope is near, and a first rate there (n,).

    ``rates`` (w,) are the windows' at ``times``, ``shown`` times and rates of the gyroscope; ``fold`` is the rate,
    rad/s, of a turn per reading.
    """
    smooth, near = np.full(t.size, np.nan), np.zeros(t.size, dtype=bool)
    if shown is not None:
        at, z = shown
        smooth = np.interp(t, at, z)
        index = np.clip(np.searchsorted(at, t), 1, at.size - 1)
        near = (at[index] - at[index - 1] < 0.1) & (t >= at[0] - 0.02) & (t <= at[-1] + 0.02)
    if times.size == 0:
        return near, np.where(near, smooth, 0.0)
    after = np.clip(np.searchsorted(times, t), min(1, times.size - 1), times.size - 1)
    distance = np.minimum(np.abs(t - times[after]), np.abs(t - times[np.maximum(after - 1, 0)]))
    rate = np.interp(t, times, rates)
    # where no window tells, the gyroscope does; where both do, it tells how many turns a slow sampling missed
    missed = np.where(near, np.rint((np.nan_to_num(smooth) - rate) / fold), 0.0)
    return near, np.where(near & (distance > 0.5), smooth, rate + fold * missed)


def joined(method: str, tracks: list[Track], settings: TrackingSettings, span: tuple[float, float]) -> YawRate:
    """Join segments where they overlap, each up to the middle of the overlap; NaN between them and where they misfit.

    ``span`` is the recording's first and last time, s; the answers stand at whole steps within it.
    """
    steps = _answers(tracks, settings, span)
    grid = settings.step * steps
    rate, sd = np.full(grid.size, np.nan), np.full(grid.size, np.nan)
    for index, track in enumerate(tracks):
        good = _trusted(track, settings)
        if index > 0:
            good &= track.t > 0.5 * (tracks[index - 1].stop + track.start)
        if index + 1 < len(tracks):
            good &= track.t <= 0.5 * (track.stop + tracks[index + 1].start)
        place = np.searchsorted(steps, np.rint(track.t[good] / settings.step))
        rate[place], sd[place] = track.rate[good], track.sd[good]
    return YawRate(method, grid, rate, sd, signed=True)


def _answers(tracks: list[Track], settings: TrackingSettings, span: tuple[float, float]) -> FloatArray:
    """Return which whole steps are answered: all of the span, or, where that is longer than `LONGEST`, the tracks'."""
    first, last = np.ceil(span[0] / settings.step - 1e-9), np.floor(span[1] / settings.step + 1e-9)
    if span[1] - span[0] <= LONGEST:
        return np.asarray(np.arange(first, last + 1, dtype=np.float64))
    # a clock that jumps by years: no answers by the billion that say nothing
    told = [np.rint(track.t / settings.step) for track in tracks]
    return np.unique(np.concatenate([[first, last], *told]))


def _trusted(track: Track, settings: TrackingSettings) -> BoolArray:
    good = (track.sd <= settings.largest_sd) & np.isfinite(track.rate)
    good &= (track.left <= settings.misfit**2 * max(track.usual, 1e-12)) & (track.count >= 3)
    field = float(np.linalg.norm(track.field))
    if track.noise > 0.2 * field:
        good[:] = False
    return np.asarray(good)
