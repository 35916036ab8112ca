"""What is observed of one throw: its spin by a method of `estimate`, its path, and what is stated of its release."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc
from discsim.errors import InputError
from discsim.estimators.methods import estimate
from discsim.estimators.rate import YawRate
from discsim.recording import Recording
from discsim.validation.identification.plants.flight import FLIGHT

__all__ = ["SHARED_S", "Throw", "misplaced", "need_flight", "observe"]

#: neighbouring spin rates share data: windows of the paper's method span 1.28 s, and the errors of the smoothers keep
#: their sign for 0.3 to 2.4 s (measured on the throws of `discsim validate`). Values count as one per this time, s.
SHARED_S = 1.28
#: of the spin rate at least so many values must be known
FEWEST = 4


@dataclass(frozen=True)
class Throw:
    """One throw as a fit sees it; SI.

    Attributes
    ----------
    recording : Recording
        Where it comes from, with the disc and what is stated of its release.
    method : str
        The method that the spin rate is from (what `best` took, where that was asked for).
    spin_t, spin, spin_sd : (n,) arrays
        Known spin rates about z_B with the sign of the throw, and their standard deviations.
    path_t : (m,) array
        Times of the fixes.
    path, path_sd : (m, 6) arrays
        Position and velocity in N; NaN where a fix or a camera did not see it.
    """

    recording: Recording
    method: str
    spin_t: FloatArray
    spin: FloatArray
    spin_sd: FloatArray
    path_t: FloatArray
    path: FloatArray
    path_sd: FloatArray

    @property
    def disc(self) -> Disc:
        """The disc that the recording states."""
        assert self.recording.disc is not None
        return self.recording.disc

    @cached_property
    def spin_weight_sd(self) -> FloatArray:
        """Standard deviations (n,) rad/s that make independent values of correlated ones: one per `SHARED_S`."""
        spacing = float(np.median(np.diff(self.spin_t)))
        return readonly(self.spin_sd * np.sqrt(max(1.0, SHARED_S / spacing)))

    @property
    def end(self) -> float:
        """Time of the last value of any kind, s."""
        return float(max(self.spin_t[-1], self.path_t[-1] if self.path_t.size else 0.0))


def observe(recording: Recording, method: str = "best", rate: YawRate | None = None) -> Throw:
    """Return what a recording shows of a throw, with the spin rate by a method of `estimate`, or a given one.

    Raises `InputError` where the recording is no flight or longer than one, the method fails or knows too little, or
    nothing tells the direction of a spin whose method gives magnitudes only.
    """
    need_flight(recording)
    where = recording.path or recording.name
    rate = estimate(recording, method) if rate is None else rate
    known = np.isfinite(rate.rate) & (rate.sd > 0)
    if np.count_nonzero(known) < FEWEST:
        raise InputError(
            f"{where}: {method} knows the spin at {np.count_nonzero(known)} instants; expected at least {FEWEST}"
        )
    t, path, path_sd = _path(recording)
    end = max(float(rate.t[known][-1]), float(t[-1]) if t.size else 0.0)
    if end > (longest := FLIGHT.durations.longest):
        raise InputError(
            f"{where}: its spin or its path ends at {end:.6g} s; expected a throw of at most {longest:g} s from the "
            "release, in seconds (import the rows of one throw)"
        )
    sign = 1.0 if rate.signed else _direction(recording, rate)
    spin, sd = readonly(sign * rate.rate[known]), readonly(rate.sd[known])
    return Throw(recording, rate.method, readonly(rate.t[known]), spin, sd, t, path, path_sd)


def need_flight(recording: Recording) -> None:
    """Raise `InputError` for what is no flight."""
    if recording.plant != "flight":
        where = recording.path or recording.name
        raise InputError(
            f"{where}: is a {recording.plant}; expected a flight, for C_Nr needs an airspeed. Of a throw with fixes or "
            'a track, import the log with the map that a first import wrote, in which you state plant = "flight", the '
            "disc ([disc]) and air_density_kg_m3 in [environment]"
        )


def misplaced(recording: Recording, error: float) -> Recording:
    """Return a recording whose accelerometer is stated ``error`` (m) farther from the axis than it is, (9)."""
    sheet = recording.sheets.get("accelerometer")
    if sheet is None or sheet.position is None or not np.any(sheet.position[:2]):
        raise InputError(
            f"{recording.path or recording.name}: no accelerometer off the axis; expected one with a place"
        )
    away = np.array([sheet.position[0], sheet.position[1], 0.0])
    moved = sheet.position + error * away / np.linalg.norm(away)
    return replace(recording, sheets={**recording.sheets, "accelerometer": replace(sheet, position=moved)})


def _direction(recording: Recording, rate: YawRate) -> float:
    """Tell the direction of spin by the gyroscope, which shows it even where it clips, or by the stated release."""
    gyroscope = recording.get("gyroscope")
    if gyroscope is not None and np.isfinite(gyroscope.value[:, 2]).any():
        return float(np.sign(np.nanmedian(gyroscope.value[:, 2])))
    release = recording.release
    if release is not None and release.body_rate is not None and release.body_rate[2] != 0.0:
        return float(np.sign(release.body_rate[2]))
    raise InputError(
        f"{recording.path or recording.name}: {rate.method} gives the magnitude of the spin and nothing tells its "
        "direction; expected a gyroscope, a stated body_rate_rad_s, or --method best"
    )


def _path(recording: Recording) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times (m,), position and velocity (m, 6) and their standard deviations, of gps and track together."""
    rows: list[tuple[FloatArray, FloatArray, FloatArray]] = []
    if (gps := recording.get("gps")) is not None:
        sheet = recording.sheets["gps"]
        sd = np.repeat(
            [_noise(sheet.noise_rms, gps.value[:, :3]), _noise(sheet.velocity_noise_rms, gps.value[:, 3:])], 3
        )
        rows.append((gps.t, gps.value, np.broadcast_to(sd, gps.value.shape)))
    if (track := recording.get("track")) is not None:
        sd_track = _noise(recording.sheets["track"].noise_rms, track.value)
        value = np.hstack((track.value, np.full(track.value.shape, np.nan)))
        rows.append((track.t, value, np.full(value.shape, sd_track)))
    if not rows:
        return readonly(np.empty(0)), readonly(np.empty((0, 6))), readonly(np.empty((0, 6)))
    t, value, spread = (np.concatenate(part) for part in zip(*rows, strict=True))
    seen = np.isfinite(value).any(axis=1)
    return readonly(t[seen]), readonly(value[seen]), readonly(spread[seen])


def _noise(stated: float | None, values: FloatArray) -> float:
    """Return the stated rms of a sensor, or where none (or zero) is stated that of its third differences.

    Third differences of white noise have 20 times its variance; a flight's own are small at 10 Hz and more.
    """
    if stated:
        return stated
    third = np.diff(values, 3, axis=0)
    known = third[np.isfinite(third)]
    if known.size < FEWEST:
        raise InputError(
            "a path sensor states no noise and has too few fixes to show it; expected noise_rms in its sheet"
        )
    return max(float(1.4826 * np.median(np.abs(known)) / np.sqrt(20.0)), 1e-6)
