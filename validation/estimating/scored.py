"""`score_rates` and what it gives: how far rates are from the truth, and whether that is within limits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from discsim.arrays import FloatArray
from discsim.errors import InputError, require_type
from discsim.estimators.rate import YawRate
from discsim.files import write_text
from discsim.validation.reporting.figures import draw_differences, draw_rates, new_figure, save_figure
from discsim.validation.reporting.html import Section, Tone, write_report
from discsim.validation.reporting.run import json_text
from discsim.validation.reporting.scores import Score, at_most, score

__all__ = ["FIGURES", "RateErrors", "ScoredRates", "score_rates"]


class RateErrors(NamedTuple):
    """How far one rate is from the truth, deg/s where no unit is named.

    ``values`` are those within the truth's time, ``outside`` the others; ``known`` is the share of the former that are
    known, ``covered`` the share of the truth's time that known ones cover, each for a step; ``delay`` how late it
    follows changes of the truth, s (NaN where that does not change, or by one slope only). ``within`` is the share of
    its errors within two of its own standard deviations, NaN where it states none.
    """

    method: str
    values: int
    known: float
    bias: float
    rms: float
    worst: float
    p95: float
    delay: float
    within: float
    outside: int = 0
    note: str = ""
    covered: float = 1.0


#: figures that may be limited, and what each limit means
FIGURES: Mapping[str, str] = {
    "bias": "mean error, deg/s, either way",
    "rms": "root mean square error, deg/s",
    "worst": "largest error, deg/s",
    "p95": "error that 95 % stay below, deg/s",
    "delay": "delay, s, either way",
    "known": "share of values known, at least",
    "covered": "share of the truth's time with known values, at least",
    "within": "share of errors within two stated sds, at least",
}
_AT_LEAST = ("known", "covered", "within")
#: a rate that covers less of the truth's time is worth a note: windows at either end of a run of 20 s take 6 % of it
_MOSTLY = 0.9
#: exceeded limits that the banner of the page names
_NAMED = 4


@dataclass(frozen=True, repr=False)
class ScoredRates:
    """Rates against a truth: the errors of each, and the scores that limits make of them."""

    errors: tuple[RateErrors, ...]
    scores: tuple[Score, ...]
    rates: tuple[YawRate, ...]
    truth: YawRate

    def __repr__(self) -> str:
        failed = sum(not item.ok for item in self.scores)
        return f"<ScoredRates: {len(self.errors)} rates, {failed} of {len(self.scores)} limits exceeded>"

    @property
    def ok(self) -> bool:
        """Whether all is within the limits."""
        return all(item.ok for item in self.scores)

    @property
    def notes(self) -> tuple[str, ...]:
        """What looks wrong in how rates are written, not in the rates: a unit, a sign, times without a truth."""
        return tuple(f"note: {one.method}: {one.note}" for one in self.errors if one.note)

    def summary(self) -> str:
        """Return a line for each rate, and for each limit."""
        lines = [
            f"{one.method}: rms {one.rms:.4g} deg/s, bias {one.bias:+.4g}, 95 % below {one.p95:.4g}, worst "
            f"{one.worst:.4g}, {100 * one.known:.0f} % known"
            + (f", {1000 * one.delay:+.1f} ms late" if np.isfinite(one.delay) else "")
            for one in self.errors
        ]
        return "\n".join([*lines, *self.notes, *map(_line, self.scores)])

    def to_json(self) -> dict[str, Any]:
        """Return the content of score.json."""
        return {
            "format": "discsim-score/1",
            "rates": [one._asdict() for one in self.errors],
            "scores": [item.as_dict() for item in self.scores],
            "ok": self.ok,
        }

    def report(self, folder: Path | str) -> Path:
        """Write score.json, score.png and report.html into ``folder``; return the path of the page."""
        out = Path(folder)
        write_text(out / "score.json", json_text(self.to_json()))
        figure, axes = new_figure(2, 1, height=6.0, sharex=True)
        draw_rates(axes[0], [*self.rates, self.truth])
        axes[0].set_xlabel("")  # the lower one has it
        draw_differences(axes[1], self.rates, self.truth)
        save_figure(figure, out / "score.png")
        lead, tone = _answer(self)
        sections = [*_limits(self), _errors_told(self, out / "score.png")]
        write_report(out / "report.html", "Rates against the truth", lead, sections, tone)
        return out / "report.html"


def _line(item: Score) -> str:
    return f"{'ok  ' if item.ok else 'FAIL'} {item.name}: {item.value:.4g} {item.unit}".rstrip() + f" ({item.goal})"


def _answer(found: ScoredRates) -> tuple[str, Tone]:
    """Return the banner of the page and its look: what exceeds its limit, or the rate that errs least."""
    known = [one for one in found.errors if np.isfinite(one.rms)]
    if not known:
        return "No rate is known anywhere.", "bad"
    best = min(known, key=lambda one: one.rms)
    errs = f"{best.rms:.3g} deg/s rms, {best.worst:.3g} deg/s at worst, {100 * best.known:.0f} % known."
    errs = f"{best.method} errs {'by' if len(found.errors) == 1 else 'least:'} {errs}"
    exceeded = [item.name for item in found.scores if not item.ok]
    if not found.scores:
        return f"{errs} No limit was asked for.", "plain"
    if not exceeded:
        return f"All limits are kept. {errs}", "good"
    named = ", ".join(exceeded[:_NAMED]) + (f" and {len(exceeded) - _NAMED} more" if len(exceeded) > _NAMED else "")
    return f"{len(exceeded)} of {len(found.scores)} limits are exceeded: {named}. {errs}", "bad"


def _limits(found: ScoredRates) -> list[Section]:
    if not found.scores:
        return []
    rows = [
        (item.name, f"{item.value:.4g}" if np.isfinite(item.value) else "–", item.goal, "ok" if item.ok else "FAIL")
        for item in found.scores
    ]
    return [Section("Limits", (), ("figure", "value", "limit", ""), rows)]


def _errors_told(found: ScoredRates, figure: Path) -> Section:
    text = (
        "An error is the rate less the truth, in deg/s where no unit is named. Known: the share of values that are "
        "numbers. Delay: how late the rate follows changes of the truth. Within 2 sd: the share of errors within two "
        "of the rate's own standard deviations; honest ones give about 95 %."
    )
    header = ("rate", "values", "known", "bias", "rms", "95 % below", "worst", "delay, ms", "within 2 sd")
    rows = [
        (
            one.method,
            str(one.values),
            f"{100 * one.known:.1f} %",
            *(_or_dash(value, 3) for value in (one.bias, one.rms, one.p95, one.worst)),
            _or_dash(1000 * one.delay, 1),
            _or_dash(100 * one.within, 1, " %"),
        )
        for one in found.errors
    ]
    figures = [("Rates, and what they differ from the truth by", figure)]
    return Section("Errors", (text, *found.notes), header, rows, figures)


def _or_dash(value: float, decimals: int, unit: str = "") -> str:
    return f"{round(value, decimals) + 0.0:.{decimals}f}{unit}" if np.isfinite(value) else "–"


def score_rates(rates: Sequence[YawRate], truth: YawRate, limits: Mapping[str, float] | None = None) -> ScoredRates:
    """Compare rates with a truth, each where both are known.

    ``limits`` are by the names of `FIGURES`; each holds for every rate. Where a rate has no sign magnitudes are
    compared. Raises `InputError` for an unknown limit, and where a rate and the truth have no time in common.
    """
    a_rate = "a YawRate, as estimate(recording, method) of discsim.estimators returns it"
    require_type(rates, Sequence, "rates", f"a list of rates, each {a_rate}")
    for rate in rates:
        require_type(rate, YawRate, "one of rates", a_rate)
    require_type(truth, YawRate, "truth", a_rate)
    for name in limits or {}:
        if name not in FIGURES:
            raise InputError(f"--limit {name}: unknown; expected some of {', '.join(FIGURES)}")
    errors = tuple(_errors(rate, truth) for rate in rates)
    scores = tuple(
        _limited(one, name, limit, several=len(errors) > 1) for one in errors for name, limit in (limits or {}).items()
    )
    return ScoredRates(errors, scores, tuple(rates), truth)


def _limited(one: RateErrors, name: str, limit: float, *, several: bool) -> Score:
    label = f"{one.method}: {name}" if several else name
    value = float(getattr(one, name))
    if name in _AT_LEAST:
        return score(label, value, "", 1.0, 1.0 - limit)
    return at_most(label, value, "s" if name == "delay" else "deg/s", limit)


#: a delay is told where its standard deviation is below this, s: a thirtieth of the 0.64 s of the paper's method
_TOLD = 0.02
#: slopes that vary by this share are one: steps of 1e-6 of a rate and a time of 16 digits leave 1e-10
_ONE_SLOPE = 1e-9


def _delay(t: FloatArray, slope: FloatArray, error: FloatArray) -> float:
    """Return the delay, s, that errors (n,) rad/s at times t show beside slopes (n,) rad/s^2 of the truth, or NaN.

    None is told where the slope is one, and so a delay is a bias, where the delay's standard deviation is above
    `_TOLD`, or where it would be longer than the times are.
    """
    spread, varies = slope - slope.mean(), error - error.mean()
    if error.size < 3 or np.sqrt(np.mean(spread**2)) <= _ONE_SLOPE * np.abs(slope).max():
        return float("nan")
    moves = float(spread @ spread)
    delay = -float(spread @ varies) / moves
    sd = np.sqrt(np.sum((varies + delay * spread) ** 2) / (error.size - 2) / moves)
    return delay if sd < _TOLD and abs(delay) <= t[-1] - t[0] else float("nan")


def _errors(rate: YawRate, truth: YawRate) -> RateErrors:
    t, true = rate.t, truth.at(rate.t)
    covered = (t >= truth.t[0]) & (t <= truth.t[-1])
    outside = int(np.count_nonzero(~covered))
    _with_seconds(rate, truth)
    if not np.any(covered):
        raise InputError(
            f"{rate.method}: times {t[0]:g} to {t[-1]:g} s, the truth's {truth.t[0]:g} to {truth.t[-1]:g} s; "
            "expected times in common, from the same zero"
        )
    both = np.isfinite(rate.rate) & np.isfinite(true)
    known = float(np.count_nonzero(np.isfinite(rate.rate[covered])) / np.count_nonzero(covered))
    if not np.any(both):
        nothing = (np.nan,) * 6
        return RateErrors(rate.method, int(covered.sum()), known, *nothing, outside, covered=0.0)
    measured, actual = (rate.rate[both], true[both]) if rate.signed else (np.abs(rate.rate[both]), np.abs(true[both]))
    error = measured - actual
    size = np.degrees(np.abs(error))
    # e(t) = r(t - delay) - r(t) = -delay dr/dt to first order, beside a constant
    slope = np.gradient(truth.rate, truth.t)
    slope = np.interp(t[both], truth.t, slope if rate.signed else slope * np.sign(truth.rate))
    still = np.ptp(actual) < 1e-3 * max(float(np.abs(actual).max()), 1e-12)
    delay = float("nan") if still else _delay(t[both], slope, error)
    sd, share = rate.sd[both], _covered(t[both], truth)
    within = float(np.mean(np.abs(error)[sd > 0] <= 2 * sd[sd > 0])) if np.any(sd > 0) else float("nan")
    return RateErrors(
        rate.method,
        int(covered.sum()),
        known,
        float(np.degrees(error.mean())),
        float(np.sqrt(np.mean(size**2))),
        float(size.max()),
        float(np.percentile(size, 95)),
        delay,
        within,
        outside,
        "; ".join(filter(None, [_note(measured, actual, outside, t.size), _stops(t[both], truth, share)])),
        share,
    )


def _covered(t: FloatArray, truth: YawRate) -> float:
    """Return the share of a truth's time that known values at t (n,) s cover, each for the usual step between them."""
    lasts = float(truth.t[-1] - truth.t[0])
    if t.size < 2 or lasts <= 0.0:
        return float(t.size > 1)
    return float(min(1.0, t.size * np.median(np.diff(t)) / lasts))


def _stops(t: FloatArray, truth: YawRate, share: float) -> str:
    """Say where known values cover a part of the truth's time only; empty where they cover most of it."""
    if share > _MOSTLY:
        return ""
    return (
        f"known values, {t[0]:g} to {t[-1]:g} s, cover {100 * share:.2g} % of the truth's time, {truth.t[0]:g} to "
        f"{truth.t[-1]:g} s: all figures are of that part"
    )


#: what rates are of the truth where they stand under a wrong name or with a wrong sign, and what is likely then
_MISTAKEN: Mapping[float, str] = {
    -1.0: "the truth's with the other sign; a sensor upside down? --magnitude compares without signs",
    180.0 / np.pi: "57.3 times the truth's: deg/s under a name of rad/s?",
    np.pi / 180.0: "1/57.3 of the truth's: rad/s under a name of deg/s?",
    30.0 / np.pi: "9.55 times the truth's: rpm under a name of rad/s?",
    np.pi / 30.0: "1/9.55 of the truth's: rad/s under a name of rpm?",
    6.0: "6 times the truth's: deg/s under a name of rpm?",
    1.0 / 6.0: "1/6 of the truth's: rpm under a name of deg/s?",
    0.5 / np.pi: "1/6.28 of the truth's: turns per second under a name of rad/s?",
    2.0 * np.pi: "6.28 times the truth's: rad/s under a name of turns per second?",
}
#: a rate is such a multiple to this share of it: less than half of what is between 1/6 and 1/6.28
_MULTIPLE = 0.02


def _multiple_of(measured: FloatArray, actual: FloatArray) -> float | None:
    """Return which multiple of a truth (n,) rates (n,) are by a wrong unit or sign; None where they are none."""
    of_truth = float(actual @ actual)
    ratio = float(measured @ actual) / of_truth if of_truth > 0.0 else 1.0
    for multiple in _MISTAKEN:
        rest = measured - multiple * actual
        if abs(ratio / multiple - 1.0) < _MULTIPLE and rest @ rest < (_MULTIPLE * multiple) ** 2 * of_truth:
            return multiple
    return None


def _note(measured: FloatArray, actual: FloatArray, outside: int, values: int) -> str:
    """Return what looks wrong in how rates (n,) beside a truth (n,) are written; empty where nothing does."""
    if (multiple := _multiple_of(measured, actual)) is not None:
        return f"the rates are {_MISTAKEN[multiple]}"
    if 2 * outside > values:
        return f"{outside} of {values} values lie outside the truth's time and are not scored"
    return ""


#: spans of rates by the truth's that no log has beside its truth, and the unit that is likely then: an hour for 3.6 s
_SPANS: Mapping[tuple[str, str], tuple[float, float]] = {
    ("milliseconds", "time_ms"): (500.0, 2000.0),
    ("microseconds", "time_us"): (5e5, 2e6),
}


def _with_seconds(rate: YawRate, truth: YawRate) -> None:
    """Raise `InputError` where the times of a rate last so much longer than the truth's that they are no seconds."""
    span = float(rate.t[-1] - rate.t[0]) / max(float(truth.t[-1] - truth.t[0]), 1e-12)
    for (unit, column), (low, high) in _SPANS.items():
        if low < span < high:
            raise InputError(
                f"{rate.method}: times last {rate.t[-1] - rate.t[0]:g} s, the truth's {truth.t[-1] - truth.t[0]:g} s; "
                f"expected seconds (these look like {unit}: name the column {column})"
            )
