"""What disagrees in each source, and by how much: sentences whose every number is computed from the recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.estimators.fft import FftSettings
from discsim.estimators.methods import estimate
from discsim.estimators.rate import YawRate
from discsim.recording import Samples
from discsim.validation.studies.real_recordings.agreement import LOWERED, PHASE_WINDOW, Agreement, run_fft
from discsim.validation.studies.real_recordings.sources import Measured, Source
from discsim.validation.studies.real_recordings.turns import field_phase, phase_rate, turned, turned_by_rate

__all__ = ["FINDINGS", "SHIFTS", "Findings", "Turns", "shifted_rms", "turns_of"]

#: Shifts of the optical rate against the gyroscope that are tried, s.
SHIFTS = readonly(np.arange(-12, 13) * 0.5e-3)
#: How long after the first row of a throw the accelerometer is looked at by itself, s.
EARLY = 0.5
#: Stretch at the end of Lynx's span that is looked at by itself, s.
LATE = 5.0
#: Lynx hangs on its parachutes from here on, s after lift-off (the source's log of states).
SWINGING_FROM = 22.8
#: Differences that are called wrong in a steady spin, rad/s.
WRONG = float(np.radians(100.0))


@dataclass(frozen=True)
class Turns:
    """Turns over a span, signed: by the field's phase about a circle and an ellipse, and by the reference (or NaN)."""

    start: float
    stop: float
    circle: float
    ellipse: float
    reference: float

    @property
    def duration(self) -> float:
        """Length of the span, s."""
        return self.stop - self.start


@dataclass(frozen=True)
class Findings:
    """Sentences, and a table where there is something to list."""

    sentences: Sequence[str]
    header: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()


def turns_of(measured: Measured) -> Turns:
    """Count the turns of a span by its magnetometer and by the reference."""
    field = measured.recording.need("magnetometer")
    start, stop = float(field.t[0]), float(field.t[-1])
    by_rate = float("nan") if measured.reference is None else turned_by_rate(measured.reference, start, stop)
    circle, ellipse = turned(field_phase(field.value)), turned(field_phase(field.value, "ellipse"))
    return Turns(start, stop, circle, ellipse, by_rate)


def shifted_rms(gyroscope: Samples, vector: FloatArray) -> FloatArray:
    """Root mean square size of optical body rate less gyroscope, rad/s, for each of `SHIFTS`.

    A shift s compares the optical rate at t + s with the gyroscope's at t; a minimum at s < 0 means that the optical
    time stamps are early against the gyroscope's.
    """
    known = np.all(np.isfinite(vector), axis=1)
    t = gyroscope.t
    middle = (t >= t[known][0] - SHIFTS[0]) & (t <= t[known][-1] - SHIFTS[-1])
    rms = []
    for shift in SHIFTS:
        moved = [np.interp(t[middle] + shift, t[known], vector[known, k]) for k in range(3)]
        rms.append(np.sqrt(np.mean(np.sum((np.stack(moved, axis=1) - gyroscope.value[middle]) ** 2, axis=1))))
    return np.array(rms)


def _flatball(_: Source, cuts: Sequence[Measured], agreements: Sequence[Sequence[Agreement]]) -> Findings:
    counts = [turns_of(cut) for cut in cuts]
    names = [cut.cut.label.split(",")[0] for cut in cuts]
    intervals = [1000 * cut.recording.need("magnetometer").interval for cut in cuts]
    ratios = [count.circle / count.reference for count in counts]
    needed = [interval * ratio for interval, ratio in zip(intervals, ratios, strict=True)]
    force, fft = _ratios(agreements, "accelerometer"), _ratios(agreements, "fft")
    early = [_early(cut) for cut in cuts]
    odd = int(np.argmax(ratios))
    rest = [k for k in range(len(cuts)) if k != odd]
    sentences = (
        f"**The magnetometer turns {_range([ratios[k] for k in rest], '.2f')} times as far as the gyroscope's "
        f"integral** at {_range(intervals, '.0f')} ms a row, and {ratios[odd]:.2f} times in {names[odd]}. `fft` says "
        f"the same of the rate: {_range(fft, '.2f')} times the gyroscope's.",
        f"Gyroscope and accelerometer, which need no time base, agree: the median ratio is {_range(force, '.3f')}.",
        f"Not so just after release: in the first {EARLY} s the accelerometer's rate falls short of the gyroscope's "
        f"by as much as {_range([one[0] for one in early], '.0f')} deg/s, depending on the throw, or is unknown. "
        f"After that it stays within {_range([one[1] for one in early], '.1f')} % of it.",
        f"Rows of {_range([needed[k] for k in rest], '.1f')} ms ({needed[odd]:.1f} ms in {names[odd]}) would "
        "reconcile magnetometer and gyroscope. Whether rows last that long is not known: the files have no time "
        "column, and nothing outside the disc was recorded.",
    )
    header = (
        "throw",
        "turns, magnetometer",
        "turns, gyroscope",
        "ratio",
        "accelerometer / gyroscope",
        "row that would reconcile",
    )
    rows = [
        [name, f"{count.circle:+.2f}", f"{count.reference:+.2f}", f"{ratio:.3f}", f"{inward:.3f}", f"{step:.2f} ms"]
        for name, count, ratio, inward, step in zip(names, counts, ratios, force, needed, strict=True)
    ]
    return Findings(sentences, header, rows)


def _early(cut: Measured) -> tuple[float, float]:
    """Largest shortfall of the accelerometer early on, deg/s, and its largest difference after, %."""
    rate = estimate(cut.recording, "accelerometer")
    reference = np.abs(_reference(cut).at(rate.t))
    early = rate.t < rate.t[0] + EARLY
    shortfall = float(np.degrees(np.nanmax((reference - rate.rate)[early])))
    return shortfall, float(100 * np.nanmax(np.abs(rate.rate / reference - 1)[~early]))


def _euler(source: Source, cuts: Sequence[Measured], _: Sequence[Sequence[Agreement]]) -> Findings:
    counts = [turns_of(cut) for cut in cuts]
    first = counts[0]
    hertz, threshold = abs(first.circle) / first.duration, np.degrees(FftSettings().threshold)
    value = [cut.recording.need("gyroscope").value for cut in cuts]
    axial = [float(np.mean(one[:, 2])) / (2 * np.pi) for one in value]
    size = [float(np.mean(np.linalg.norm(one, axis=1))) / (2 * np.pi) for one in value]
    assert source.lowered is not None
    fft, reference = run_fft(cuts[0].whole, source.lowered, LOWERED), _reference(cuts[0])
    beside = reference.at(fft.t)
    off = np.abs(fft.rate - np.abs(beside))
    worst = int(np.nanargmax(off))
    share, wrong = np.mean(np.isfinite(off)), np.mean(off[np.isfinite(off)] > WRONG)
    sentences = (
        f"From {first.start:.1f} to {first.stop:.1f} s the field's phase makes {abs(first.circle):.2f} turns about a "
        f"circle's centre: {hertz:.3f} Hz (about an ellipse's {abs(first.ellipse) / first.duration:.3f} Hz). That is "
        f"{360 * hertz:.0f} deg/s, and `fft` with the paper's threshold of {threshold:.0f} deg/s says nothing.",
        f"The two gyroscopes are of one type and differ: IMU 1 over IMU 0 is {axial[1] / axial[0]:.3f} about z and "
        f"{size[1] / size[0]:.3f} in the vector's size.",
        f"Over the whole log the lowered settings give a rate for {100 * share:.0f} % of the windows. Of these "
        f"{100 * wrong:.0f} % differ from the gyroscope at the window's centre by more than {np.degrees(WRONG):.0f} "
        f"deg/s; the worst says {np.degrees(fft.rate[worst]):.0f} deg/s at {fft.t[worst]:.1f} s, where the gyroscope "
        f"has {np.degrees(beside[worst]):.0f} deg/s. Settings this low are for someone who knows that there is a "
        "steady spin.",
    )
    rows = [
        [cut.cut.label, f"{about:.3f}", f"{length:.3f}", f"{abs(count.circle) / count.duration:.3f}"]
        for cut, about, length, count in zip(cuts, axial, size, counts, strict=True)
    ]
    header = ("IMU", "gyroscope z, Hz", "gyroscope, size of the vector, Hz", "field's phase, Hz")
    return Findings(sentences, header, rows)


def _srp(source: Source, cuts: Sequence[Measured], agreements: Sequence[Sequence[Agreement]]) -> Findings:
    (cut,) = cuts
    count, reference = turns_of(cut), _reference(cut)
    interval = cut.recording.need("magnetometer").interval
    paper, lowered = FftSettings(), source.lowered
    assert lowered is not None
    length, middle = lowered.window * interval, (count.start + count.stop) / 2
    held = turned_by_rate(reference, middle - length / 2, middle + length / 2)
    said = next(one for one in agreements[0] if one.method == LOWERED)
    off = [100 * (turns / count.reference - 1) for turns in (count.circle, count.ellipse)]
    sentences = (
        f"**The whole span holds {abs(count.reference):.2f} turns by the gyroscope**: fewer than two, useless for an "
        f"FFT window. The paper's {paper.window} samples are {paper.window * interval:.1f} s of this magnetometer, "
        f"longer than the span of {count.duration:.1f} s; `fft` cannot be run on it.",
        f"With {lowered.window} samples ({length:.1f} s, {abs(held):.2f} turns in the middle window) and a threshold "
        f"of {np.degrees(lowered.threshold):.0f} deg/s it gives a rate for {100 * said.known:.0f} % of {said.values} "
        f"windows, whose centres lie within {said.values * interval:.1f} s. The median ratio is {said.ratio:.3f}; but "
        "a number so made is one window's mean of a rate that falls to a fraction within it.",
        f"The phase counts {abs(count.circle):.3f} turns about a circle's centre and {abs(count.ellipse):.3f} about an "
        f"ellipse's, the gyroscope {abs(count.reference):.3f}: {off[0]:+.1f} and {off[1]:+.1f} %. As a rate over "
        f"{PHASE_WINDOW} s it differs more (table and figure).",
    )
    return Findings(sentences)


def _broad(_: Source, cuts: Sequence[Measured], __: Sequence[Sequence[Agreement]]) -> Findings:
    rows = []
    for cut in cuts:
        gyroscope = cut.recording.need("gyroscope")
        assert cut.vector is not None
        size, optical = np.linalg.norm(gyroscope.value, axis=1), np.linalg.norm(cut.vector, axis=1)
        rms = np.degrees(shifted_rms(gyroscope, cut.vector))
        best, stated = int(np.argmin(rms)), int(np.argmin(np.abs(SHIFTS)))
        about = cut.vector[np.isfinite(cut.vector[:, 2]), 2]
        reversals = int(np.count_nonzero(np.diff(np.sign(about))))
        low, high = np.nanpercentile(np.linalg.norm(cut.recording.need("magnetometer").value, axis=1), (1, 99))
        rows.append(
            [
                cut.cut.label,
                f"{np.degrees(np.mean(size)):.0f}, {np.degrees(np.max(size)):.0f}",
                f"{np.nanmedian(size / optical):.4f}",
                f"{rms[stated]:.1f}",
                f"{rms[best]:.1f} at {1000 * SHIFTS[best]:+.1f} ms",
                f"{about.size * gyroscope.interval / reversals:.2f} s" if reversals else "none",
                f"{low:.0f} to {high:.0f} uT",
            ]
        )
    sentences = (
        "Gyroscope and optical rate have nearly the same size; as vectors they differ by the rms in the table. It is "
        "smaller if the optical rate is taken at another time than its stamp says (figure, right). Which clock is "
        "off, or what delays what, the files do not tell; all else on this page takes the stamps as they are.",
        "The magnetometer's readings came at 100 Hz, stood on some rows of a log of 143 Hz and were then interpolated "
        "to 286 Hz: the import takes the rows between and the repeats out.",
        "The rate about z reverses after the mean time in the table: there is no steady spin that a line in a spectrum "
        "could show. The gyroscope tells so, and `fft` is silent there.",
    )
    header = (
        "trial",
        "gyroscope's size, mean and largest, deg/s",
        "gyroscope / optical, median of size",
        "rms of the vectors' difference, deg/s",
        "least rms, optical rate shifted",
        "mean time between reversals about z",
        "field, 1 to 99 % of readings",
    )
    return Findings(sentences, header, rows)


def _lynx(source: Source, cuts: Sequence[Measured], _: Sequence[Sequence[Agreement]]) -> Findings:
    (cut,) = cuts
    field, count = cut.recording.need("magnetometer"), turns_of(cut)
    phase = phase_rate(field, PHASE_WINDOW)
    times = np.arange(count.start + PHASE_WINDOW, count.stop - PHASE_WINDOW / 2, PHASE_WINDOW)
    hertz = ", ".join(f"{value:.2f}" for value in np.abs(phase.at(times)) / (2 * np.pi))
    lowered = source.lowered
    assert lowered is not None
    threshold = np.degrees(lowered.threshold)
    late = run_fft(cut.recording, lowered, LOWERED)
    said = np.degrees(np.nanmedian(late.rate[late.t > count.stop - LATE]))
    turning = np.degrees(np.nanmedian(np.abs(phase.rate[phase.t > count.stop - LATE])))
    swinging = [_swinging(cut, settings) for settings in (lowered, FftSettings())]
    sentences = (
        f"From {count.start:.1f} to {count.stop:.1f} s the field's phase makes {abs(count.circle):.2f} turns about a "
        f"circle's centre ({abs(count.ellipse):.2f} about an ellipse's); every {PHASE_WINDOW} s from {times[0]:.1f} s "
        f"on its rate is {hertz} Hz. With nothing to hold this against it is a reading and no result.",
        f"In the last {LATE:.0f} s the phase turns at {turning:.0f} deg/s (median) and `{LOWERED}` says {said:.0f} "
        f"deg/s, close to its threshold of {threshold:.0f} deg/s: what is slower than the threshold is not always "
        "passed over in silence.",
        f"Negative control: from {SWINGING_FROM} s on it swings under parachutes and nothing spins steadily. "
        f"`{LOWERED}` gives a rate for {swinging[0][0]:.0f} % of the windows all the same (median "
        f"{swinging[0][1]:.0f} deg/s), and `fft` with the paper's settings for {swinging[1][0]:.1f} % (median "
        f"{swinging[1][1]:.0f} deg/s).",
    )
    return Findings(sentences)


def _swinging(cut: Measured, settings: FftSettings) -> tuple[float, float]:
    """Share of windows with an answer under the parachutes, %, and the answers' median, deg/s."""
    rate = run_fft(cut.whole, settings, "fft")
    after = rate.rate[rate.t > SWINGING_FROM + settings.window * cut.whole.need("magnetometer").interval / 2]
    return float(100 * np.mean(np.isfinite(after))), float(np.degrees(np.nanmedian(after)))


def _phyphox(_: Source, cuts: Sequence[Measured], __: Sequence[Sequence[Agreement]]) -> Findings:
    rows = []
    for cut in cuts:
        samples = cut.recording.need("gyroscope")
        start, stop = float(samples.t[0]), float(samples.t[-1])
        turns = turned_by_rate(_reference(cut), start, stop)
        about = np.degrees(np.max(np.abs(samples.value[:, 2])))
        across = np.degrees(np.max(np.linalg.norm(samples.value[:, :2], axis=1)))
        rows.append([cut.cut.label, f"{stop - start:.1f} s", f"{turns:+.1f}", f"{about:.0f}", f"{across:.0f}"])
    header = ("recording", "length", "turns about z", "largest rate about z, deg/s", "largest rate across z, deg/s")
    nothing = "Neither `fft` nor `accelerometer` has its sensor here, and nothing judges the gyroscope."
    return Findings((nothing,), header, rows)


def _reference(cut: Measured) -> YawRate:
    assert cut.reference is not None
    return cut.reference


def _ratios(agreements: Sequence[Sequence[Agreement]], method: str) -> list[float]:
    return [next(one for one in found if one.method == method).ratio for found in agreements]


def _range(values: Sequence[float], form: str) -> str:
    low, high = format(min(values), form), format(max(values), form)
    return low if low == high else f"{low} to {high}"


#: What to say of each source, by its key.
FINDINGS: Mapping[str, Callable[[Source, Sequence[Measured], Sequence[Sequence[Agreement]]], Findings]] = (
    MappingProxyType(
        {
            "flatball": _flatball,
            "aris-euler": _euler,
            "srp": _srp,
            "broad": _broad,
            "lynx": _lynx,
            "phyphox": _phyphox,
        }
    )
)
