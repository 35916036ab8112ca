"""Which sensors of a recording agree about its spin, and which single cause would reconcile those that do not.

Some sensors show a rate and need no time: a gyroscope, an accelerometer by its pull towards the axis. Others show an
angle, and turn it into a rate by the time that is written: the field in the disc's plane, the wobble. Each is compared
with the rate of the gyroscope (or a reference). The pattern of what disagrees tells a clock from a sensitivity, and a
cause found in the other recordings is put to the proof on the one that was left out.

Nothing here decides a verdict: sensors that contradict one another are told of, whatever the search makes of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from discsim.effects.catalogue import catalogued
from discsim.effects.sensors import ClockRate, Scale
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.imu_clock import FoundImuClock, imu_clock_of
from discsim.validation.diagnosis.consistency.low_pass_transient import LowPassTransient, low_pass_transient_of
from discsim.validation.diagnosis.consistency.own_clock import MOST_ROWS, FoundOwnClock, own_clock_of, too_many
from discsim.validation.diagnosis.consistency.time_stamp_recovery import Rows, rows_of
from discsim.validation.diagnosis.signals.phase_regression import (
    REACH,
    angle_turned,
    centripetal,
    explained,
    left_of,
    rate_of,
    signal_of,
    signals_of,
    steps,
    tone,
)

__all__ = ["Agreement", "Cause", "Comparison", "Proof", "RowProof", "agreement_of", "compared", "written_ratios"]

#: how far apart, in its logarithm, what is compared may be in a sound recording: precession bends the field's phase by
#: up to 15 deg/s, a mount that is 1 mm off moves the pull by 3 %, an inertia without its electronics the wobble by 5 %
TOLERANCE: Mapping[str, float] = {
    "field": 0.01,
    "wobble": 0.05,
    "pull to the axis": 0.03,
}
#: further apart than this many standard deviations, tolerance included, is a contradiction
CONTRADICTION = 3.0
#: a signal of which less than this share turns with the spin says nothing about it
_TURNING = 0.5
#: most that a step of a large wobble counts over a usual one
_LARGE = 10.0
#: a correlation above this is said to tell the same
_TELLING = 0.4


class _Claim(NamedTuple):
    """A cause in words, its parameter, and by how much each comparison grows with that one's logarithm."""

    words: str
    parameter: str
    grows: Mapping[str, float]


#: single causes, by the ids of effects
_CAUSES: Mapping[str, _Claim] = {
    catalogued(kind, acts_on).id: claim
    for kind, acts_on, claim in (
        (ClockRate, "clock", _Claim("one wrong clock for all sensors", "ratio", {"field": -1.0, "wobble": -1.0})),
        (
            Scale,
            "gyroscope",
            _Claim(
                "a wrong sensitivity of the gyroscope about z",
                "sz",
                {"field": -1.0, "wobble": -1.0, "pull to the axis": -1.0},
            ),
        ),
        (ClockRate, "magnetometer", _Claim("a wrong clock of the magnetometer alone", "ratio", {"field": -1.0})),
        (ClockRate, "gyroscope", _Claim("a wrong clock of the gyroscope alone", "ratio", {"wobble": -1.0})),
        (
            Scale,
            "accelerometer",
            _Claim("a wrong sensitivity, or place, of the accelerometer", "sx = sy", {"pull to the axis": 0.5}),
        ),
    )
}


@dataclass(frozen=True)
class Comparison:
    """What one signal says of the spin over what the sensor of the rate says: 1 where they agree.

    ``needs_time`` tells that the written time enters; ``share_that_turns`` is how much of the signal turns with the
    spin.
    """

    recording: str
    signal: str
    sensor: str
    ratio: float
    sd: float
    share_that_turns: float
    needs_time: bool

    @property
    def off(self) -> float:
        """How far apart they are, in standard deviations, what sound recordings show included."""
        return float(np.log(self.ratio) / np.hypot(self.sd / self.ratio, TOLERANCE[self.signal]))

    @property
    def agrees(self) -> bool:
        """Whether both agree."""
        return abs(self.off) < CONTRADICTION


@dataclass(frozen=True)
class Proof:
    """A cause on a recording that took no part: its size there and elsewhere, chi-squared of what is compared.

    ``field_left_uT_...`` are what is left of the field's turning, rms, None without a magnetometer.
    """

    recording: str
    own_value: float
    own_sd: float
    value_of_others: float
    sd_of_others: float
    chi2_before: float
    chi2_after: float
    field_left_uT_before: float | None
    field_left_uT_after: float | None


@dataclass(frozen=True)
class Cause:
    """A single cause, its size, and the chi-squared of all comparisons before and after."""

    id: str
    parameter: str
    value: float
    sd: float
    chi2_before: float
    chi2_after: float
    heldout: tuple[Proof, ...]

    @property
    def heldout_after(self) -> float:
        """Chi-squared of the recordings, each when it took no part."""
        return sum(proof.chi2_after for proof in self.heldout) if self.heldout else self.chi2_after

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        kept = asdict(self)
        heldout = kept.pop("heldout")
        return {**kept, "heldout_chi2_after": self.heldout_after, "heldout": heldout}


@dataclass(frozen=True)
class RowProof:
    """Rows counted in ticks of the other recordings: what that does to the field, and what the wobble says of it.

    ``left`` are uT rms of the field's turning: as written, with even rows of the right mean, with counted rows, and
    what counted rows leave in the others. ``wobble`` is the correlation of the rows' durations by the gyroscope's x
    and y with those by the field, which they know nothing of, ``turns`` how far the wobble turns over the gyroscope's
    angle in counted rows, with its error; None where there is too little wobble.
    """

    recording: str
    tick_s: float
    left: tuple[float, float, float, float]
    wobble: float | None
    turns: tuple[float, float] | None

    @property
    def chi2(self) -> tuple[float, float, float]:
        """Chi-squared per reading of the field, in the noise of the others: as written, even rows, counted rows."""
        written, even, counted, others = self.left
        return (written / others) ** 2, (even / others) ** 2, (counted / others) ** 2

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "tick_of_others_s": self.tick_s,
            "field_left_uT": dict(
                zip(("as_written", "even_rows", "counted_rows", "counted_rows_of_others"), self.left, strict=True)
            ),
            "field_chi2_per_reading": dict(zip(("as_written", "even_rows", "counted_rows"), self.chi2, strict=True)),
            "correlation_with_wobble": self.wobble,
            "wobble_ratio": None if self.turns is None else self.turns[0],
            "wobble_ratio_sd": None if self.turns is None else self.turns[1],
        }


@dataclass(frozen=True)
class Agreement:
    """Which sensors agree, in numbers, and what reconciles them; causes come best first by recordings set aside."""

    reference: str
    comparisons: tuple[Comparison, ...]
    causes: tuple[Cause, ...] = ()
    rows: Rows | None = None
    row_proofs: tuple[RowProof, ...] = ()
    settling: LowPassTransient | None = None
    own_clock: FoundOwnClock | None = None
    imu_clock: FoundImuClock | None = None

    @property
    def contradiction(self) -> bool:
        """Whether any sensors contradict one another, rows are not evenly spaced, or a sensor settles slowly."""
        apart = any(not item.agrees for item in self.comparisons)
        return apart or self.rows is not None or self.settling is not None

    @property
    def sentences(self) -> tuple[str, ...]:
        """What there is to say, in words."""
        return tuple(_sentences(self)) if self.contradiction else ()

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "reference": self.reference,
            "contradiction": self.contradiction,
            "text": list(self.sentences),
            "comparisons": [{**asdict(item), "agrees": item.agrees} for item in self.comparisons],
            "causes": [item.to_json() for item in self.causes],
            "rows": None
            if self.rows is None
            else {**self.rows.to_json(), "heldout": [item.to_json() for item in self.row_proofs]},
            "own_clock": None if self.own_clock is None else self.own_clock.to_json(),
            "imu_clock": None if self.imu_clock is None else self.imu_clock.to_json(),
            "settling": None if self.settling is None else self.settling.to_json(),
        }


def compared(recordings: Sequence[Recording], names: Sequence[str]) -> tuple[tuple[Comparison, ...], ...]:
    """Return each recording's comparisons of its sensors (called ``names``); none where no rate is known."""
    return tuple(
        () if rate_of(recording) is None else tuple(_compared(recording, name))
        for recording, name in zip(recordings, names, strict=True)
    )


def agreement_of(
    recordings: Sequence[Recording], names: Sequence[str], known_already: Sequence[Sequence[Comparison]] | None = None
) -> Agreement | None:
    """Compare the sensors of recordings (called ``names``) with one another; None where none shows the spin itself.

    ``known_already`` is what `compared` says of them, where that is known.
    """
    each = compared(recordings, names) if known_already is None else known_already
    comparisons = tuple(item for one in each for item in one)
    if not comparisons:
        return None
    some = [(r, n) for r, n in zip(recordings, names, strict=True) if rate_of(r) is not None]
    known = rate_of(some[0][0])
    assert known is not None
    rows = rows_of([recording for recording, _ in some], [name for _, name in some])
    own_clock = None if rows is None else own_clock_of([r for r, _ in some], [n for _, n in some], rows)
    imu = None if own_clock is None else imu_clock_of([r for r, _ in some], [n for _, n in some], own_clock)
    # in the times that counted rows give, where there are such
    timed = [r if rows is None else _in_true_time(r, n, rows, own_clock) for r, n in some]
    settling = low_pass_transient_of(timed, [name for _, name in some])
    found = Agreement(known[0], comparisons, (), rows, (), settling, own_clock, imu)
    if not found.contradiction:
        return found
    causes = [cause for id in _CAUSES if (cause := _cause(id, comparisons, {n: r for r, n in some})) is not None]
    causes.sort(key=lambda cause: cause.heldout_after)
    return replace(found, causes=tuple(causes), row_proofs=_row_proofs(rows, some))


def _in_true_time(recording: Recording, name: str, rows: Rows, own_clock: FoundOwnClock | None) -> Recording:
    """Return a recording in the times that counted rows give, by the magnetometer's own clock where it has one."""
    counted = None if own_clock is None else own_clock.counted(recording, name)
    return counted or rows.counted(recording, name, rows.tick_s) or recording


def _compared(recording: Recording, name: str) -> list[Comparison]:
    found = []
    for signal in signals_of(recording):
        heard = tone(signal, angle_turned(recording, signal.t))
        if heard.share > _TURNING and abs(np.log(max(heard.ratio, 1e-3))) < REACH:
            found.append(Comparison(name, signal.name, signal.sensor, heard.ratio, heard.sd, heard.share, True))
    pull = centripetal(recording)
    if pull is not None:
        found.append(Comparison(name, "pull to the axis", "accelerometer", pull.ratio, pull.sd, 1.0, False))
    return found


# ---------------------------------------------------------------------------------------------- single causes


def _size(comparisons: Sequence[Comparison], grows: Mapping[str, float]) -> tuple[float, float, float]:
    """Return the logarithm of a cause's size that fits comparisons, its error, and the chi-squared that it leaves."""
    y = np.array([np.log(item.ratio) for item in comparisons])
    sd = np.array([np.hypot(item.sd / item.ratio, TOLERANCE[item.signal]) for item in comparisons])
    g = np.array([grows.get(item.signal, 0.0) for item in comparisons])
    weight = float(np.sum((g / sd) ** 2))
    if weight == 0.0:
        return 0.0, float("inf"), float(np.sum((y / sd) ** 2))
    size = float(np.sum(g * y / sd**2)) / weight
    return size, weight**-0.5, _left(comparisons, grows, size)


def _left(comparisons: Sequence[Comparison], grows: Mapping[str, float], size: float) -> float:
    return sum(
        float(
            (np.log(item.ratio) - grows.get(item.signal, 0.0) * size)
            / np.hypot(item.sd / item.ratio, TOLERANCE[item.signal])
        )
        ** 2
        for item in comparisons
    )


def _cause(id: str, comparisons: Sequence[Comparison], recordings: Mapping[str, Recording]) -> Cause | None:
    """Return a cause as large as the comparisons make it, None where none of them would show it."""
    _, parameter, grows = _CAUSES[id]
    size, error, after = _size(comparisons, grows)
    if not np.isfinite(error):
        return None
    ratio = parameter == "ratio"

    def shown(log: float) -> float:
        return float(np.exp(log)) if ratio else float(np.expm1(log))

    names = list(dict.fromkeys(item.recording for item in comparisons))
    proofs = []
    for name in names if len(names) > 1 else []:
        mine = [item for item in comparisons if item.recording == name]
        others = [item for item in comparisons if item.recording != name]
        own, own_sd, _ = _size(mine, grows)
        elsewhere, elsewhere_sd, _ = _size(others, grows)
        if not np.isfinite(own_sd) or not np.isfinite(elsewhere_sd):
            continue
        fields = _field_left(recordings[name], grows.get("field", 0.0) * elsewhere)
        proofs.append(
            Proof(
                name,
                shown(own),
                own_sd * float(np.exp(own)),
                shown(elsewhere),
                elsewhere_sd * float(np.exp(elsewhere)),
                _left(mine, grows, 0.0),
                _left(mine, grows, elsewhere),
                *fields,
            )
        )
    before = _left(comparisons, grows, 0.0)
    return Cause(id, parameter, shown(size), error * float(np.exp(size)), before, after, tuple(proofs))


def _field_left(recording: Recording, size: float) -> tuple[float | None, float | None]:
    """Return what is left of the field's turning before and after a cause of a size (logarithm), uT rms."""
    field = signal_of(recording, "field")
    if field is None:
        return None, None
    psi = angle_turned(recording, field.t)
    before, after = (left_of(field, psi, ratio) for ratio in (1.0, float(np.exp(size))))
    return before, after


# ------------------------------------------------------------------------------------------------------- rows


def _row_proofs(rows: Rows | None, some: Sequence[tuple[Recording, str]]) -> tuple[RowProof, ...]:
    """Return what counted rows do to each recording, the tick coming from all others."""
    if rows is None or len(some) < 2:
        return ()
    left: dict[str, tuple[float, tuple[float, float, float]]] = {}
    turns: dict[str, tuple[float, float] | None] = {}
    for recording, name in some:
        elsewhere = rows.without(name)
        counted = None if elsewhere is None else rows.counted(recording, name, elsewhere)
        if elsewhere is not None and counted is not None:
            versions = (recording, rows.evenly(recording, name, elsewhere), counted)
            written, even, at_ticks = (_field_left(version, 0.0)[0] for version in versions)
            if written is None or even is None or at_ticks is None:
                continue
            left[name] = (elsewhere, (written, even, at_ticks))
            heard = next((item for item in _compared(counted, name) if item.signal == "wobble"), None)
            turns[name] = None if heard is None else (heard.ratio, heard.sd)
    proofs = []
    for recording, name in some:
        others = [own[2] for other, (_, own) in left.items() if other != name]
        if name in left and others:
            tick, own = left[name]
            proofs.append(
                RowProof(
                    name,
                    tick,
                    (*own, float(np.sqrt(np.mean(np.square(others))))),
                    _told(rows, recording, name),
                    turns[name],
                )
            )
    return tuple(proofs)


def _told(rows: Rows, recording: Recording, name: str) -> float | None:
    """Return how the rows' durations by the wobble go with those by the field, where the wobble is large."""
    wobble = signal_of(recording, "wobble")
    own = next((item for item in rows.durations if item.name == name), None)
    if wobble is None or own is None or not np.array_equal(wobble.t, own.t):
        return None
    psi = angle_turned(recording, wobble.t)
    if explained(wobble, psi, tone(wobble, psi).ratio) < _TURNING:
        return None
    ratios, weight = steps(wobble, psi)
    weight = np.minimum(weight / np.median(weight), _LARGE)
    x, y = own.lasted / np.diff(own.t), ratios
    x, y = x - np.average(x, weights=weight), y - np.average(y, weights=weight)
    spread = float(np.sqrt(np.sum(weight * x * x) * np.sum(weight * y * y)))
    return float(np.sum(weight * x * y)) / spread if spread > 0 else None


# -------------------------------------------------------------------------------------------------- sentences

_SAID = {
    "field": "the magnetometer's field",
    "wobble": "the gyroscope's wobble (x and y)",
    "pull to the axis": "the accelerometer's pull towards the axis",
}


def _verdict_on(some: Sequence[Comparison], reference: str) -> str:
    """Return what one signal's comparisons with a reference come to, in words."""
    apart = [item.recording for item in some if not item.agrees]
    if not apart:
        return f"agrees with the {reference} about z"
    if len(apart) == len(some):
        return f"contradicts the {reference} about z"
    rest = ", ".join(item.recording for item in some if item.agrees)
    return f"contradicts the {reference} about z in {', '.join(apart)}, and agrees with it in {rest}"


def _sentences(found: Agreement) -> list[str]:
    said = []
    for signal, words in _SAID.items():
        some = [item for item in found.comparisons if item.signal == signal]
        if not some:
            continue
        verdict = _verdict_on(some, found.reference.replace("_", " "))
        timed = "over the written time" if some[0].needs_time else "and no time enters that"
        ratios = ", ".join(f"{item.ratio:.3f} ± {item.sd:.3f} in {item.recording}" for item in some)
        said.append(f"{words[:1].upper()}{words[1:]} {verdict}: spin over spin is {ratios}, {timed}.")
    if found.causes and any(not item.agrees for item in found.comparisons):
        best = found.causes[0]
        held = sum(proof.chi2_before for proof in best.heldout)
        own = ", ".join(f"{proof.own_value:.4f} ± {proof.own_sd:.4f} in {proof.recording}" for proof in best.heldout)
        said.append(
            f"The single cause that reconciles most is {_CAUSES[best.id].words} ({best.id}, {best.parameter} = "
            f"{best.value:.4f} ± {best.sd:.4f}): χ² of the comparisons falls from {best.chi2_before:.3g} to "
            f"{best.chi2_after:.3g}"
            + (f", on recordings set aside from {held:.3g} to {best.heldout_after:.3g}" if best.heldout else "")
            + (f". By themselves the recordings ask for {own}." if own else ".")
        )
        said += [
            f"{_CAUSES[other.id].words.capitalize()} ({other.id}) leaves {other.chi2_after:.3g}, "
            f"{other.heldout_after:.3g} on recordings set aside."
            for other in found.causes[1:3]
        ]
    if found.rows is not None:
        said += found.rows.sentences
        if too_many(found.rows):
            said.append(
                f"They are more than {MOST_ROWS}, so that it is not asked whether the magnetometer has a clock of its "
                "own: shorter recordings would tell."
            )
        said += [
            f"{proof.recording}, with the tick of the others: the field leaves {proof.left[0]:.1f} µT as written, "
            f"{proof.left[1]:.1f} with even rows of the right mean, {proof.left[2]:.1f} with counted rows"
            + (
                f"; the wobble, which took no part in the count, tells the same late rows (correlation "
                f"{proof.wobble:.2f})."
                if proof.wobble is not None and proof.wobble > _TELLING
                else "."
            )
            for proof in found.row_proofs
        ]
    if found.own_clock is not None:
        said += found.own_clock.sentences
    if found.imu_clock is not None:
        said += found.imu_clock.sentences
    if found.settling is not None:
        said += found.settling.sentences
    return said


def written_ratios(each: Sequence[Sequence[Comparison]]) -> list[float]:
    """Return each recording's ratio of written to true time by field and gyroscope, 1 where that is not in question.

    ``each`` is what `compared` says of the recordings.

    A place for a fit to start from: whether it is the clock that is wrong, and not a sensor, remains to be seen.
    """
    ratios = []
    for found in each:
        field = next((item for item in found if item.signal == "field"), None)
        pull = next((item for item in found if item.signal == "pull to the axis"), None)
        wrong = field is not None and not field.agrees and (pull is None or pull.agrees)
        ratios.append(1.0 / field.ratio if field is not None and wrong else 1.0)
    return ratios
