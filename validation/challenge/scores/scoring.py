"""Score diagnoses against opened answers: verdict, set, place, parameters, and what they add up to over many cases.

Everything here is told by two documents, an `Answer` and the content of a ``diagnosis.json``; nothing is simulated.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import inf, isfinite, pi
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import beta

from discsim.effects.catalogue import CATALOGUE, row
from discsim.errors import InputError
from discsim.validation.challenge.cases.conceal import Answer

__all__ = [
    "NOTHING",
    "CaseScore",
    "Deviation",
    "Rate",
    "clustered_rate",
    "confusion",
    "has_power_law",
    "rate",
    "score_case",
    "summary",
]

#: an event is in the right place within this, s (docs/diagnosis contract)
INSTANT_S = 0.1
#: kinds of case in which the baseline, with what it states, explains the recordings
NOTHING = ("nothing", "noise", "within_sigma", "beyond_sigma")
#: what stands for an effect where a stated number was moved
RECALIBRATED = "recalibrated"
#: the verdicts that claim that something is missing
_ALARMS = ("explained", "unexplained")
#: keys under which a rig's friction may stand in ``recalibrated``
_RIG_KEYS = {"viscous_N_m_s": ("viscous_N_m_s", "viscous")}
#: the power of the spin rate in a law's text: a number, or the name of a coefficient
_POWER_OF_RATE = re.compile(r"\|r\|\^([\w.]+)")


class Deviation(NamedTuple):
    """One parameter: what was concealed, what was found, its standard deviation (None: not determined)."""

    effect: str
    name: str
    true: float
    value: float
    sd: float | None

    @property
    def in_sd(self) -> float | None:
        """The error in standard deviations; None where the data do not determine the parameter."""
        return None if self.sd is None else (self.value - self.true) / self.sd

    def to_json(self) -> dict[str, Any]:
        """Return what ``challenge.json`` keeps of it."""
        return {**self._asdict(), "in_sd": self.in_sd}


@dataclass(frozen=True)
class CaseScore:
    """How one diagnosis compares with its answer.

    ``right_place`` is None where no effect was concealed. ``named`` are the ids that the diagnosis names, each once;
    ``right_set`` tells that each concealed effect is named once and nothing else is; ``within_confusion`` that each is
    named or listed as indistinguishable from one that is, and nothing else is named. ``right_setting`` is None where no
    setting was concealed; a setting that no recording could tell from it counts as right where the concealed one is
    listed beside it. ``law_given`` tells that the
    diagnosis has a law, ``exponent`` how its power of the spin rate compares with the concealed one, if there is one.
    """

    named: tuple[str, ...]
    right_verdict: bool
    right_set: bool
    within_confusion: bool
    right_place: bool | None
    deviations: tuple[Deviation, ...]
    heldout_before: float | None
    heldout_after: float | None
    crashed: bool = False
    law_given: bool = False
    exponent: Deviation | None = None
    right_setting: bool | None = None

    @property
    def right(self) -> bool:
        """Verdict, set, setting and place are all right."""
        told = self.right_place is not False and self.right_setting is not False
        return self.right_verdict and self.right_set and told

    def to_json(self) -> dict[str, Any]:
        """Return what ``challenge.json`` keeps of it."""
        kept = asdict(self)
        kept["deviations"] = [item.to_json() for item in self.deviations]
        kept["exponent"] = self.exponent.to_json() if self.exponent is not None else None
        return kept


def score_case(answer: Answer, diagnosis: Mapping[str, Any] | None) -> CaseScore:
    """Compare a diagnosis (the content of ``diagnosis.json``; None where there is none) with its answer.

    Raises `InputError` where the diagnosis breaks its contract.
    """
    if diagnosis is None:
        return CaseScore((), False, False, False, None, (), None, None, crashed=True)
    try:
        effects = [_as_concealed(answer, effect) for effect in diagnosis["effects"]]
        named = tuple(sorted({effect["id"] for effect in effects}))
        found = diagnosis["verdict"]
        fit = diagnosis["fit"]
        before, after = (fit[stage]["heldout_chi2_per_sample"] for stage in ("baseline", "final"))
        hidden = set(answer.effects)
        deviations = tuple(_deviations(answer, effects, diagnosis["recalibrated"]))
        if surely := [item.name for item in deviations if item.sd is not None and not item.sd > 0.0]:
            raise ValueError(f"sd of {surely[0]} is not positive")
        return CaseScore(
            named=named,
            right_verdict=found in answer.verdict.split("|"),
            right_set=sorted(effect["id"] for effect in effects) == sorted(hidden)
            and (bool(hidden) or found not in _ALARMS or answer.verdict == found),
            within_confusion=_within_confusion(hidden, effects),
            right_place=_right_place(answer, effects, diagnosis["located"]),
            deviations=deviations,
            heldout_before=before,
            heldout_after=after,
            law_given=diagnosis["law"] is not None,
            exponent=_exponent(answer, diagnosis["law"]),
            right_setting=_right_setting(answer, effects),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            f"the diagnosis of seed {answer.seed} is not as its contract says ({type(error).__name__}: {error}); "
            "expected the content of a diagnosis.json"
        ) from None


def _as_concealed(answer: Answer, effect: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return a named fault of axes as the concealed one where no recording tells them apart and it lists that one."""
    if (effect["id"], effect.get("setting", {}).get("axes")) not in answer.equivalents:
        return effect
    for other in effect["confused_with"]:
        if other["id"] in answer.effects and other.get("setting") == answer.setting:
            return {**effect, "id": other["id"], "setting": other["setting"]}
    return effect


def _right_setting(answer: Answer, effects: Sequence[Mapping[str, Any]]) -> bool | None:
    """Tell whether the setting of a fault is the concealed one; None where no setting is concealed."""
    if not answer.setting:
        return None
    return any(effect["id"] in answer.effects and effect.get("setting") == answer.setting for effect in effects)


def _within_confusion(hidden: set[str], effects: Sequence[Mapping[str, Any]]) -> bool:
    """Tell whether the named effects can be matched with the concealed ones, each by id or by a listed confusion."""
    groups = {effect["id"]: {effect["id"], *(other["id"] for other in effect["confused_with"])} for effect in effects}
    if len(groups) != len(hidden):
        return False
    left = set(hidden)
    for id in [*(id for id in groups if id in hidden), *(id for id in groups if id not in hidden)]:
        match = {id} & left or groups[id] & left
        if not match:
            return False
        left.discard(min(match))
    return not left


def _right_place(
    answer: Answer, effects: Sequence[Mapping[str, Any]], located: Sequence[Mapping[str, Any]]
) -> bool | None:
    """Tell whether effects are named where they are; None where none is concealed.

    An event in its recording at its instant, anything else in all recordings, a sensor's fault at that sensor.
    """
    if not answer.effects:
        return None
    for id in answer.effects:
        kind = row(id)
        entries = [effect for effect in effects if effect["id"] == id]
        if kind.event and not any(_at_instant(answer, effect) for effect in entries):
            return False
        if not kind.event and not any(effect["recordings"] == "all" for effect in entries):
            return False
        where = {place["sensor"] for place in located}
        if "all" not in where and not kind.acts_with(where):
            return False
    return True


def _at_instant(answer: Answer, effect: Mapping[str, Any]) -> bool:
    if effect["recordings"] == "all" or tuple(effect["recordings"]) != answer.recordings:
        return False
    instant = effect["parameters"].get("t_s")
    return instant is not None and abs(instant["value"] - answer.parameters["t_s"]) <= INSTANT_S


def _deviations(
    answer: Answer, effects: Sequence[Mapping[str, Any]], recalibrated: Mapping[str, Mapping[str, Any]]
) -> Iterable[Deviation]:
    """Yield every parameter that was concealed and found; one that is not in the answer stands at its baseline."""
    for effect in effects:
        id = effect["id"]
        if id not in answer.effects:
            continue
        if row(id).event and not _at_instant(answer, effect):
            continue  # another event: its numbers have no true ones
        if _is_the_other(answer, effect):
            continue  # of two ways to say it that no recording tells apart the other one is concealed
        none = row(id).sizes
        found = {name: (item["value"], item["sd"]) for name, item in effect["parameters"].items()}
        for name, (value, sd) in _one_way_to_say_it(id, found).items():
            size = answer.size(id, name)
            true = none[name] if size is None else size
            if isfinite(true):
                yield Deviation(id, name, true, _near(name, value, true), sd)
    for name, true in answer.moved.items():
        for key in _RIG_KEYS.get(name, (name,)):
            if key in recalibrated:
                yield Deviation(RECALIBRATED, name, true, recalibrated[key]["value"], recalibrated[key]["sd"])


def _is_the_other(answer: Answer, effect: Mapping[str, Any]) -> bool:
    """Tell whether the concealed numbers are nearer to those of another way that an effect lists for itself."""

    def off(parameters: Mapping[str, Mapping[str, Any]]) -> float:
        sizes = {name: answer.size(effect["id"], name) for name in parameters}
        known = [float(parameters[name]["value"]) - size for name, size in sizes.items() if size is not None]
        return sum(one**2 for one in known) if known else inf

    alike = [other.get("parameters", {}) for other in effect["confused_with"] if other["id"] == effect["id"]]
    return min(map(off, alike), default=inf) < off(effect["parameters"])


def has_power_law(answer: Answer) -> bool:
    """Tell whether what is concealed is a torque with a power law."""
    return answer.kind == "off_catalogue" and "exponent" in answer.parameters


def _exponent(answer: Answer, law: Mapping[str, Any] | None) -> Deviation | None:
    """Return the power of the spin rate in a law against the concealed one; None where either has none.

    The law must be one steady term about the spin axis; a power that the law states and did not fit has no sd.
    """
    if law is None or not has_power_law(answer) or law["target"] != "moment_z_N_m" or "exp(" in law["text"]:
        return None
    powers = _POWER_OF_RATE.findall(law["text"])
    if len(powers) != 1:
        return None
    found = law["coefficients"].get(powers[0])
    value, sd = (found["value"], found["sd"]) if found is not None else (float(powers[0]), None)
    return Deviation("law", "exponent", answer.parameters["exponent"], value, sd)


def _one_way_to_say_it(id: str, found: dict[str, tuple[float, float | None]]) -> dict[str, tuple[float, float | None]]:
    """Turn a ripple of negative amplitude into one of positive amplitude half a turn on: they are the same."""
    if id == "rig.speed_ripple" and "amplitude_rad_s" in found and found["amplitude_rad_s"][0] < 0:
        value, sd = found["amplitude_rad_s"]
        found["amplitude_rad_s"] = (-value, sd)
        if "phase_rad" in found:
            value, sd = found["phase_rad"]
            found["phase_rad"] = (value + pi, sd)
    return found


def _near(name: str, value: float, true: float) -> float:
    """Return a phase as the one of its turns nearest to the true one, anything else as it is."""
    if name != "phase_rad":
        return value
    return true + (value - true + pi) % (2 * pi) - pi


# ---------------------------------------------------------------------------------------------- over many cases


class Rate(NamedTuple):
    """A share of cases: ``hits`` of ``of``, with Clopper and Pearson's exact interval of 95 %."""

    hits: int
    of: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """The share; NaN of no cases."""
        return self.hits / self.of if self.of else float("nan")

    def to_json(self) -> dict[str, Any]:
        """Return the entry of ``challenge.json``."""
        return {"value": self.value, "interval_95": [self.low, self.high], "count": self.hits, "of": self.of}


def rate(outcomes: Iterable[bool]) -> Rate:
    """Return the share of outcomes that are true; of none the interval is 0 to 1."""
    list_ = list(outcomes)
    count, of = sum(list_), len(list_)
    low = float(beta.ppf(0.025, count, of - count + 1)) if count else 0.0
    high = float(beta.ppf(0.975, count + 1, of - count)) if count < of else 1.0
    return Rate(count, of, low, high)


def clustered_rate(groups: Iterable[Sequence[bool]]) -> Rate:
    """Return the share of true outcomes among those of all groups, whose outcomes depend on each other within a group.

    The interval is Clopper and Pearson's of as many independent outcomes as give the scatter between groups (Korn and
    Graubard, Survey Methodology 24, 1998, p. 193); it is never narrower than that of independent ones.
    """
    lists = [list(group) for group in groups if len(group)]
    plain = rate(outcome for group in lists for outcome in group)
    if len(lists) < 2 or plain.hits in (0, plain.of):
        return plain
    share = plain.value
    apart = np.array([sum(group) - share * len(group) for group in lists])
    scatter = len(lists) / (len(lists) - 1) * float(np.sum(apart**2)) / plain.of**2
    independent = min(share * (1.0 - share) / scatter, plain.of) if scatter > 0 else plain.of
    hits = share * independent
    low = float(beta.ppf(0.025, hits, independent - hits + 1.0))
    high = float(beta.ppf(0.975, hits + 1.0, independent - hits))
    return Rate(plain.hits, plain.of, low, high)


def summary(
    scored: Sequence[tuple[Answer, Mapping[str, Any] | None, CaseScore]],
    strengths: Sequence[float | None] = (),
    told: Sequence[float | None] = (),
) -> dict[str, Rate]:
    """Return the shares that the challenge is judged by.

    ``strengths`` (where given) holds each case's smallest concealed size in units of its detection limit: the rate of
    right sets is also told for the cases above twice that; ``told`` the same in units of the size at which an effect
    is told from others of its sensor. A diagnosis that crashed is never right, and no false
    alarm. Parameters of one case depend on each other; the intervals of the coverage allow for it.
    """

    def above_twice(sizes: Sequence[float | None], plant: str | None = None) -> Rate:
        """Return the share of right sets of cases (of a plant) whose size is known and at least two."""
        pairs = zip(scored, sizes or [None] * len(scored), strict=True)
        large = [(a, s) for (a, _, s), size in pairs if a.effects and size is not None and size >= 2.0]
        return rate(s.right_set for a, s in large if plant in (None, a.plant))

    blank = [(d, s) for a, d, s in scored if a.kind in NOTHING]
    hidden = [s for a, _, s in scored if a.effects]
    unknown = [(d, s) for a, d, s in scored if a.kind == "off_catalogue"]
    real = [(a, s) for a, _, s in scored if a.kind == "like_real"]
    faulty = zip(scored, told or [None] * len(scored), strict=True)
    errors = [[(d.effect, abs(z)) for d in s.deviations if (z := d.in_sd) is not None] for _, _, s in scored]
    stated = [[z for effect, z in group if effect == RECALIBRATED] for group in errors]
    of_effects = [[z for effect, z in group if effect != RECALIBRATED] for group in errors]
    exponents = [z for _, _, s in scored if s.exponent is not None and (z := s.exponent.in_sd) is not None]
    placed = [s.right_place for s in hidden if s.right_set]
    gained = [
        s.heldout_after < s.heldout_before
        for s in hidden
        if s.right_set and s.heldout_before is not None and s.heldout_after is not None
    ]
    return {
        "false_alarm_rate": rate(d is not None and d["verdict"] in _ALARMS for d, _ in blank),
        "right_set_rate": rate(s.right_set for s in hidden),
        "right_set_rate_above_twice_the_limit": above_twice(strengths),
        "right_set_rate_above_twice_the_limit_in_free_spins": above_twice(strengths, "free_spin"),
        "right_set_rate_where_told_apart": above_twice(told),
        "right_set_or_listed_confusion_rate": rate(s.within_confusion for s in hidden),
        "right_verdict_rate": rate(s.right_verdict for _, _, s in scored),
        "right_place_rate": rate(bool(place) for place in placed),
        "coverage_1sd": clustered_rate([z <= 1.0 for _, z in group] for group in errors),
        "coverage_2sd": clustered_rate([z <= 2.0 for _, z in group] for group in errors),
        "coverage_2sd_effects": clustered_rate([z <= 2.0 for z in group] for group in of_effects),
        "coverage_2sd_recalibrated": clustered_rate([z <= 2.0 for z in group] for group in stated),
        "off_catalogue_misnamed_rate": rate(d is not None and d["verdict"] == "explained" for d, _ in unknown),
        "off_catalogue_noticed_rate": rate(d is not None and d["verdict"] == "unexplained" for d, _ in unknown),
        "law_given_rate": rate(s.law_given for d, s in unknown if d is not None and d["verdict"] == "unexplained"),
        "exponent_given_rate": rate(s.exponent is not None for a, _, s in scored if has_power_law(a)),
        "exponent_within_2sd_rate": rate(abs(z) <= 2.0 for z in exponents),
        "heldout_improved_rate": rate(gained),
        **_setup_rates([(s, size) for (a, _, s), size in faulty if a.kind == "setup"]),
        "right_verdict_like_real_rate": rate(s.right_verdict for _, s in real),
        "right_like_real_rate": rate(s.right for _, s in real),
        "found_like_real_rate": clustered_rate([id in s.named for id in a.effects] for a, s in real),
        "crash_rate": rate(s.crashed for _, _, s in scored),
    }


def _setup_rates(scored: Sequence[tuple[CaseScore, float | None]]) -> dict[str, Rate]:
    """Return how often faults of the setup are right, by the scores and the sizes of what is beside them.

    All of them, and those with nothing beside them (None) or with an effect above twice the size at which it is told.
    """
    return {
        "right_setup_rate": rate(s.right for s, _ in scored),
        "right_setup_rate_where_told_apart": rate(s.right for s, size in scored if size is None or size >= 2.0),
    }


def confusion(scored: Sequence[tuple[Answer, Mapping[str, Any] | None, CaseScore]]) -> dict[str, Counter[str]]:
    """Return, by what was concealed (an id, "nothing", "off-catalogue"), how often each thing was named.

    Of two concealed effects each is a row; one that is not named counts for whatever else was named in its place, or
    for the verdict where nothing was.
    """
    table: dict[str, Counter[str]] = {}
    for answer, diagnosis, score in scored:
        rows = answer.effects or ("off-catalogue" if answer.kind == "off_catalogue" else "nothing",)
        verdict = "no answer" if diagnosis is None else str(diagnosis["verdict"])
        wrong = [id for id in score.named if id not in answer.effects]
        for concealed in rows:
            cells = [concealed] if concealed in score.named else wrong or [verdict]
            table.setdefault(concealed, Counter()).update(cells)
    order = [*CATALOGUE, "nothing", "off-catalogue"]
    return {name: table[name] for name in order if name in table}


def median(values: Iterable[float]) -> float:
    """Return the median of what is finite; NaN of nothing."""
    finite = [value for value in values if isfinite(value)]
    return float(np.median(finite)) if finite else float("nan")
