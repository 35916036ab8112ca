"""What a reader must know of a recording before believing a spin rate from it: one line for each thing, `notes_on`."""

from __future__ import annotations

import numpy as np

from discsim.arrays import BoolArray, FloatArray, sd_by_median
from discsim.estimators.fusion import contradictions
from discsim.estimators.methods import METHODS, Options
from discsim.estimators.tracking import tracking
from discsim.estimators.usable import unclipped
from discsim.glitches import FASTEST_SPIN
from discsim.recording import Recording, Samples

__all__ = ["axis_notes", "clock_notes", "field_notes", "folding_notes", "notes_on", "sampling_notes"]

#: A rate above half the magnetometer's sampling rate is worth a note where this share of a sensor's readings shows it.
FOLDED_SHARE = 0.01

#: From this rate on, rad/s, and over as many answers, a gyroscope's ratio to the field's rate is looked at; a ratio off
#: by more than this is beyond the scale of any gyroscope (3 % over parts and temperature).
SPINNING, FEWEST_SHARES, OFF_CLOCK = 3.0, 8, 0.05

#: Where the spacing of the rows is known roughly only, a ratio off by this many of its scatters is worth a note.
OFF_SCATTERS = 2.0

#: From this share of the rate about z on, rates across it are no wobble (a disc's is a tenth at most).
ACROSS = 0.5

#: A sampling rate from time stamps further than this from the sheet's is worth a note.
RATE_TOLERANCE = 0.01


def notes_on(recording: Recording) -> list[str]:
    """Return a line for all that a reader must know of a recording that holds what an estimator may use."""
    about = (sampling_notes, folding_notes, field_notes, axis_notes, contradictions, clock_notes)
    return [line for notes in about for line in notes(recording)]


def sampling_notes(recording: Recording) -> list[str]:
    """Say where a sensor's time stamps contradict the sampling rate that is stated, and where rows are missing.

    The stamps are used; `fft`, which needs an even grid, is silent where the magnetometer's is not.
    """
    notes = []
    field = recording.sheets.get("magnetometer")
    if field is not None and "rate_hz" in field.sigma:
        notes.append(
            f"the spacing of the rows is known to {100 * field.rate_uncertainty:.2g} % "
            "only: rates from the field scale with it, and their standard deviations hold that; where it is known, "
            "write it into the import map as step_s, without step_sigma_s"
        )
    for sensor, samples in recording.samples.items():
        stated = recording.sheets[sensor].rate_hz
        if len(samples) < 2:
            continue
        found = 1 / _mean_step(samples)
        if abs(found / stated - 1) > RATE_TOLERANCE:
            notes.append(
                f"{sensor}: time stamps say {found:.4g} Hz, rate_hz of recording.toml {stated:.4g} Hz; the stamps are "
                "used"
            )
        gaps = int(np.count_nonzero(np.diff(samples.t) > 1.5 * samples.interval))
        if gaps:
            silent = "; fft is silent across them" if sensor == "magnetometer" else ""
            notes.append(
                f"{sensor}: {gaps} steps longer than one and a half of the usual {samples.interval:.4g} s{silent}"
            )
    return notes


def _mean_step(samples: Samples) -> float:
    """Return the mean step of the stamps, s, where no row is missing: of whole milliseconds the median is off."""
    steps = np.diff(samples.t)
    return float(np.mean(steps[np.abs(steps - samples.interval) <= samples.interval / 2]))


def folding_notes(recording: Recording) -> list[str]:
    """Say where another sensor shows a spin of more than half the magnetometer's sampling rate.

    Whole turns from sample to sample leave no trace in the field: at 100 Hz a spin of 20000 deg/s (180 deg a sample is
    18000) shows as one of 16000. `fft` and `likelihood` give that; `tracking` and `fusion` are told the missing turns
    by the other sensor. A gyroscope that clips above the limit counts, and an accelerometer by two standard deviations.
    """
    if "magnetometer" not in recording:
        return []
    half = np.pi / recording.need("magnetometer").interval
    notes = []
    for name in ("rate_reference", "gyroscope", "accelerometer"):
        if name not in recording or (name == "accelerometer" and not _may_show(recording, half)):
            continue
        shown = np.abs(_shown(recording, name))
        above = shown > half
        share = float(np.mean(above)) if above.size else 0.0
        if share < FOLDED_SHARE:
            continue
        rate = float(np.median(shown[above]))
        folded = abs((rate + half) % (2 * half) - half)
        least, seen = "", f"as {np.degrees(folded):.0f} deg/s"
        if name == "gyroscope" and 2 * np.count_nonzero(_at_limit(recording)[above]) > np.count_nonzero(above):
            least, seen = "at least ", "as what rate its limit does not tell"
        notes.append(
            f"{name}: {least}{np.degrees(rate):.0f} deg/s for {100 * share:.0f} % of its readings, above half the "
            f"magnetometer's sampling rate ({np.degrees(half):.0f} deg/s); fft and likelihood see it folded, {seen}"
        )
    return notes or _unseen(recording, half)


def _at_limit(recording: Recording) -> BoolArray:
    """Tell at which readings (n,) of the gyroscope its z stands at its limit."""
    return np.asarray(recording.sheets["gyroscope"].clipped(recording.need("gyroscope").value)[:, 2])


def _unseen(recording: Recording, half: float) -> list[str]:
    """Say that nothing beside a slow magnetometer tells whether a throw spins faster than it shows."""
    others = [name for name in ("rate_reference", "gyroscope") if name in recording]
    placed = "accelerometer" in recording and recording.sheets["accelerometer"].position is not None
    if others or placed or recording.plant not in ("flight", "free_spin") or half >= FASTEST_SPIN:
        return []
    return [
        f"the magnetometer alone tells the spin, with {half / np.pi:.3g} readings a second: one faster than "
        f"{np.degrees(half):.0f} deg/s, as throws may have, would show as a slower one, or the other way round"
    ]


def _may_show(recording: Recording, rate: float) -> bool:
    """Tell whether any reading of the accelerometer is as large as a spin of that rate, rad/s, makes it."""
    samples, position = recording.need("accelerometer"), recording.sheets["accelerometer"].position
    if position is None or len(samples) == 0:
        return False
    lowest, highest = (float(pick.reduce(samples.value[:, :2], axis=None, initial=0.0)) for pick in (np.fmin, np.fmax))
    return bool(np.sqrt(2.0) * max(highest, -lowest) >= rate**2 * np.hypot(*position[:2]))


def _shown(recording: Recording, sensor: str) -> FloatArray:
    """Return the rate that a sensor surely shows, rad/s; a clipped one has its range, which is a lower bound."""
    samples = recording.need(sensor)
    if sensor == "rate_reference":
        return samples.value
    if sensor == "gyroscope":
        return np.asarray(samples.value[:, 2])
    found = METHODS["accelerometer"].estimate(recording, Options())
    return found.rate - 2 * found.sd


def field_notes(recording: Recording) -> list[str]:
    """Say what is lost where the magnetic field of the place is not stated."""
    if "magnetometer" not in recording or recording.environment.field_known:
        return []
    return [
        "the magnetic field of the place is not stated: hard iron along the spin axis is then hardly known, and of the "
        "magnetometer's methods the standard deviation is larger; --place LAT,LON --date YYYY-MM-DD looks it up"
    ]


def axis_notes(recording: Recording) -> list[str]:
    """Say where a gyroscope shows that the body turns across the z axis as well: then it is no spin about z."""
    gyroscope = unclipped(recording, "gyroscope")
    if gyroscope is None or not np.any(known := np.all(np.isfinite(gyroscope.value), axis=1)):
        return []
    x, y, z = np.sqrt(np.mean(gyroscope.value[known] ** 2, axis=0))
    across = float(np.hypot(x, y))
    if across < ACROSS * z or across < SPINNING:
        return []
    return [
        f"the gyroscope turns by {np.degrees(across):.0f} deg/s (rms) about axes across z and by {np.degrees(z):.0f} "
        "about z: what is told is the rate about z, which likelihood and the accelerometer's take for the only one; "
        "fft is silent where less than half of the turning is a steady spin about z"
    ]


def clock_notes(recording: Recording) -> list[str]:
    """Say where the gyroscope turns by one and the same share faster or slower than the field: a wrong clock, or scale.

    Rates from the field go by the time stamps, a gyroscope's own do not.
    """
    if "magnetometer" not in recording or "gyroscope" not in recording or not contradictions(recording):
        return []
    field, turning = tracking(recording), METHODS["gyroscope"].estimate(recording, Options())
    with np.errstate(invalid="ignore", divide="ignore"):
        shares = turning.at(field.t) / field.rate
        shares = shares[np.isfinite(shares) & (np.abs(field.rate) > SPINNING)]
    if shares.size < FEWEST_SHARES:
        return []
    share = float(np.median(shares))
    scatter = float(sd_by_median(shares - share))
    far = OFF_SCATTERS * scatter if _spacing_sigma(recording) else OFF_CLOCK
    if not (share > 0 and abs(share - 1) > far and scatter < OFF_CLOCK / 3):
        return []
    return [
        f"the gyroscope turns {share:.3f} times as fast as the field, always (within {scatter:.3f}): "
        f"{_spacing(recording, share)}, would explain it (then the gyroscope is right), and so would a scale of the "
        "gyroscope (then the magnetometer is)"
    ]


def _spacing(recording: Recording, share: float) -> str:
    """Say what spacing of the rows makes the field turn ``share`` times as fast.

    Rows are the log's, which are those of its fastest sensor: a slower one's reading stands on several of them.
    """
    row = 1000 * min(samples.interval for samples in recording.samples.values() if len(samples) > 1)
    own = 1000 * recording.need("magnetometer").interval
    said = "the time stamps say" if not _spacing_sigma(recording) else "they were taken as"
    held = f" (a reading of the magnetometer every {own / row:.3g} rows)" if own > 1.5 * row else ""
    return f"rows of {row / share:.4g} ms, where {said} {row:.4g} ms{held}"


def _spacing_sigma(recording: Recording) -> float:
    """Return what share of itself the spacing of the rows is stated to be off by, one sigma; 0 where none is."""
    field = recording.sheets.get("magnetometer")
    return 0.0 if field is None else field.rate_uncertainty
