"""When rows were made, as counted before any motion is fitted: lost rows, a magnetometer's own clock, means of two.

Takes what the sensors of recordings say of one another (`Agreement`); gives the recordings in the times that their rows
were made, and the effects that stand for that in an answer. The counts stand fixed while the physics is fitted: if they
moved with a fit they would follow whatever it lacks. They are believed only where a sensor that took no part in them
gains by the same times.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, sd_of_share
from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import ClockRate
from discsim.effects.setup import TimeOffset
from discsim.effects.timing_rows import Average, ImuClock, LateRows, LostRows, OwnClock
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.answer.measured import Located
from discsim.validation.diagnosis.answer.named import SMALLEST_P_VALUE, Evidence, NamedEffect, ParameterValue
from discsim.validation.diagnosis.consistency.imu_clock import FoundImuClock
from discsim.validation.diagnosis.consistency.late_rows import FoundLateRows
from discsim.validation.diagnosis.consistency.own_clock import FoundOwnClock
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement, RowProof
from discsim.validation.diagnosis.signals.phase_regression import angle_turned, signal_of, slow_columns
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.noise import NoiseModel
from discsim.validation.identification.parameters import Parameter

__all__ = ["RowTimes", "row_times"]

#: what a second sensor must gain in twice the log likelihood by times that it took no part in: an effect's entry
_SECOND = 24.0
#: the scale of all times
_SCALE = (catalogued(ClockRate, "clock").id, "ratio")
#: the scale of the field's times beside those of gyroscope and accelerometer
_BESIDE = (catalogued(ClockRate, "magnetometer").id, "ratio")
#: how late the field's times are against those of gyroscope and accelerometer
_OFFSET = (catalogued(TimeOffset, "magnetometer").id, "offset_s")
#: how late a wobble's times are in one recording, beyond what is so in all
_OWN_OFFSET = (catalogued(TimeOffset, "gyroscope").id, "offset_s")
#: recordings of one logger have one period: their own ones may differ by this share
_ALIKE = 5e-3
#: by how much less of a spin a chip shows that is tilted by 0.1 rad, as one soldered by eye may be; precession bends
#: the phase of a field by a fifth of that, 4 deg/s of 3500
_TILTED = 5e-3
#: by which share two combs beside each other may be off: whole numbers hold the one to a quarter of a period of the
#: other from end to end, and 2.5 s are 250 rows
_HELD = 1e-3
#: by how much times of a chip's samples are off in one recording, s: of simulated throws, whose times are known, they
#: were within 0.1 ms, within 0.3 ms where rows came late, and off by up to 1.4 ms where a row was miscounted
_PLACED = 3e-4
#: rows at either end that take no part in a fit: of simulated throws up to three were miscounted there, which bent the
#: motion for a tenth of a second before them
_ENDS = 5
#: knots of the wobble's amplitude, s, as in the count itself by half: it halves in 0.3 s or more
_KNOTS_S = 0.15


@dataclass(frozen=True)
class RowTimes:
    """What was counted of recordings (called ``names``), and what each gains by it."""

    names: tuple[str, ...]
    clock: FoundOwnClock
    proofs: tuple[RowProof, ...]
    imu: FoundImuClock | None = None

    def applied(self, recordings: Sequence[Recording]) -> list[Recording]:
        """Return the recordings as a fit can use them: in the times of their rows, less what is not sure at the ends.

        There a flexible motion follows a row wherever it was counted, and a motion that obeys physics would have to.
        """
        return [_without_ends(one) for one in self.timed(recordings)]

    def timed(self, recordings: Sequence[Recording]) -> list[Recording]:
        """Return the recordings in the times that their rows were made, their fields as means of two samples."""
        return [self._timed(recording, name) for recording, name in zip(recordings, self.names, strict=True)]

    def _timed(self, recording: Recording, name: str) -> Recording:
        counted = self.clock.counted(recording, name)
        if counted is None or self.imu is None:
            return counted or recording
        shown = next(one for one in self.clock.shown if one.recording == name)
        return self.imu.counted(recording, counted, name, shown, self.clock.period_s)

    @property
    def late(self) -> FoundLateRows | None:
        """By how much rows came late where the logger lost none."""
        return self.imu.late if self.clock.none_lost and self.imu is not None else None

    @property
    def _gains(self) -> tuple[float, float]:
        """Twice the log likelihood of the field that counted rows gain, and the samples that they show beyond that."""
        rows = clock = 0.0
        for shown in self.clock.shown:
            proof = next((one for one in self.proofs if one.recording == shown.recording), None)
            if proof is not None:
                # x and y of each row; the pattern costs what its numbers are unlikely
                _, times = np.unique(np.diff(shown.newest), return_counts=True)
                price = -2.0 * float(np.sum(times * np.log(times / times.sum())))
                # the tick may come out as a whole period, in which means of samples that are no neighbours do not fit
                counted = proof.left[2] if proof.left[2] < proof.left[1] else shown.left[1]
                rows += 4.0 * shown.newest.size * float(np.log(proof.left[1] / counted)) - price
            clock += 4.0 * shown.newest.size * float(np.log(shown.left[0] / shown.left[1]))
        # single samples leave what counted rows do: there the pattern of those that were skipped tells the clock
        return rows, clock if self.clock.weight else self.clock.gain

    @property
    def free(self) -> tuple[Parameter, ...]:
        """What counting leaves open, for a fit to refine: the scale of all times, and the field's beside the others'.

        A period is counted as if nothing but the spin that a gyroscope shows turned the field: precession turns it,
        too, and a chip that is tilted shows less of the spin, which only a fit of the motion knows. Which of its
        samples each row shows is counted for each part by itself, so that the times of one may be off by as much all
        along, and where the chip has a comb of its own its period beside the field's is as sure as whole numbers hold
        it: a wobble that is free to follow tells no more, and one that obeys physics does. Its samples are placed in
        each recording for itself.
        """
        scale = Parameter(*_SCALE, 1.0, 1e-6, float(np.hypot(_TILTED, self.clock.sd_s / self.clock.period_s)))
        offset = Parameter(*_OFFSET, 0.0, 1e-5, 0.5 * self.clock.period_s)
        if self.imu is None:
            return scale, offset
        placed = (Parameter(*_OWN_OFFSET, 0.0, 1e-5, _PLACED, frozenset([i])) for i in range(len(self.names)))
        return scale, Parameter(*_BESIDE, 1.0, 1e-6, _HELD), offset, *placed

    def refined(self, fit: Fit) -> RowTimes:
        """Return what was counted with the scales of times that a fit has found, and their errors."""
        places = {q.key: j for j, q in enumerate(fit.parameters) if q.recordings is None}
        if _SCALE not in places or fit.covariance.shape[0] != len(fit.parameters):
            return self
        ratio, sd = float(fit.at[places[_SCALE]]), float(np.sqrt(fit.covariance[places[_SCALE], places[_SCALE]]))
        both = [places[key] for key in (_SCALE, _BESIDE) if key in places]
        field, own = float(np.prod(fit.at[both])), float(np.sqrt(np.sum(fit.covariance[np.ix_(both, both)])))
        clock = replace(self.clock, period_s=self.clock.period_s / field, sd_s=self.clock.period_s * own)
        imu = self.imu
        if imu is not None:
            late = imu.late
            if late is not None:
                late = replace(
                    late, tick_s=late.tick_s / ratio, tick_sd_s=float(np.hypot(late.tick_sd_s, late.tick_s * sd))
                )
            own_sd = float(np.hypot(imu.sd_s, imu.period_s * sd))
            imu = replace(imu, period_s=imu.period_s / ratio, sd_s=own_sd, late=late)
        return replace(self, clock=clock, imu=imu)

    def effects(self) -> tuple[NamedEffect, ...]:
        """Return what was counted as effects of an answer; figures of each recording are by the period of others."""
        rows, clock = self._gains
        lost = np.array([shown.lost for shown in self.clock.shown])
        steps = sum((shown.newest.size - 1) / (1.0 - shown.lost) for shown in self.clock.shown)
        share = float(np.mean(lost))
        # steps lose their rows by chance: a few recordings may agree better than so many steps can
        error = max(float(np.std(lost) / np.sqrt(max(lost.size - 1, 1))), sd_of_share(share, steps))
        held = len(self.clock.shown) > 1

        imu = self.imu if self.imu is not None and not self.imu.loops else None

        def named(kind: type, acts_on: str, gain: float, *sizes: tuple[float, float | None]) -> NamedEffect:
            row = catalogued(kind, acts_on)
            bic = gain - float(np.log(max(sum(shown.newest.size for shown in self.clock.shown), 2)))
            evidence = Evidence(bic, 0.5 * gain if held else None, SMALLEST_P_VALUE)
            parameters = {name: ParameterValue(*size) for name, size in zip(row.parameters, sizes, strict=True)}
            return NamedEffect(row.id, parameters, evidence, None, ())

        late = self.late
        return (
            named(LostRows, "clock", rows, (share, error))
            if late is None
            else named(
                LateRows, "clock", late.agreed, (late.tick_s, late.tick_sd_s), (late.fraction, late.fraction_sd)
            ),
            named(OwnClock, "magnetometer", clock, (self.clock.period_s, self.clock.sd_s)),
            *((named(Average, "magnetometer", clock, (self.clock.weight, None)),) if self.clock.weight else ()),
            *(() if imu is None else (named(ImuClock, "board", imu.gain, (imu.period_s, imu.sd_s)),)),
        )

    def located(self, end: float) -> tuple[Located, ...]:
        """Return where recordings that end by ``end`` s part from a baseline for it: in the field, all along."""
        rows, clock = self._gains
        share = float(np.clip(rows / max(rows + clock, 1e-300), 0.0, 1.0))
        row, own = (
            catalogued(LostRows if self.late is None else LateRows, "clock"),
            catalogued(OwnClock, "magnetometer"),
        )
        return (
            Located("all", "all", "all", 0.0, end, share, row.trace, row.grows_with),
            Located("all", "magnetometer", "all", 0.0, end, 1.0 - share, own.trace, own.grows_with),
        )

    def excess(self, noise: NoiseModel, count: int) -> float:
        """Return the chi-squared per reading, of ``count``, by which a baseline misses the field as it is written."""
        variance = noise["magnetometer"].sd ** 2
        left = {proof.recording: proof.left[0] for proof in self.proofs}
        squares = [
            shown.newest.size * max(left[shown.recording] ** 2 - shown.left[1] ** 2, 0.0)
            for shown in self.clock.shown
            if shown.recording in left
        ]
        return sum(squares) / variance / max(count, 1)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What was counted, for an answer that names no effect."""
        told = "; ".join(
            f"{effect.id} ({name} = {value.value:.4g})"
            for effect in self.effects()
            for name, value in effect.parameters.items()
        )
        return (f"counted before the fit, row by row: {told}. What is left beyond that is told below.",)


def row_times(recordings: Sequence[Recording], names: Sequence[str], agreement: Agreement | None) -> RowTimes | None:
    """Return when the rows of recordings (called ``names``) were made, None where nothing sure was counted."""
    if agreement is None or agreement.own_clock is None or len(recordings) < 2:
        return None
    clock = agreement.own_clock
    periods = np.array([shown.period_of_others_s for shown in clock.shown])
    if len(clock.shown) < len(recordings) or np.ptp(periods) > _ALIKE * float(np.mean(periods)):
        return None
    found = RowTimes(tuple(names), clock, agreement.row_proofs)
    if clock.none_lost:
        # the wobble goes by the rows themselves, not by the samples that they show: it must tell the same ones late
        found = replace(found, imu=agreement.imu_clock)
        return found if found.late is not None and min(found._gains[1], found.late.agreed) > _SECOND else None
    if min(found._gains) < _SECOND or _gained(recordings, found.timed(recordings)) < _SECOND:
        return None
    # the chip's own samples were chosen by the wobble: they cannot bear out what it is asked for
    return replace(found, imu=agreement.imu_clock)


def _without_ends(recording: Recording) -> Recording:
    """Return a recording without the first and last readings of the sensors that count its rows by their phase."""

    def cut(own: Samples) -> Samples:
        value = own.value.copy()
        value[:_ENDS] = value[-_ENDS:] = np.nan
        return Samples(own.t, value)

    phases = ("magnetometer", "gyroscope")
    return replace(recording, samples={s: cut(own) if s in phases else own for s, own in recording.samples.items()})


def _gained(before: Sequence[Recording], after: Sequence[Recording]) -> float:
    """Return what the wobble gains by other times, in twice the log likelihood."""
    gain = 0.0
    for one, other in zip(before, after, strict=True):
        left = [_left_of_wobble(recording) for recording in (one, other)]
        if left[0] is not None and left[1] is not None:
            size = one.samples["gyroscope"].t.size
            gain += 4.0 * size * float(np.log(left[0] / left[1]))
    return gain


def _left_of_wobble(recording: Recording) -> float | None:
    """Return what a smooth wobble leaves of the gyroscope's x and y, rms rad/s; None where there is none."""
    wobble = signal_of(recording, "wobble")
    if wobble is None:
        return None
    psi: FloatArray = angle_turned(recording, wobble.t)
    t = wobble.t - wobble.t[0]
    end = float(t[-1])
    slow = slow_columns(t, end, _KNOTS_S)
    columns = np.hstack([np.exp(1j * wobble.order * psi)[:, None] * slow, np.ones((t.size, 1))])
    x = np.linalg.lstsq(columns, wobble.value, rcond=None)[0]
    return float(np.sqrt(np.mean(np.abs(wobble.value - columns @ x) ** 2)))
