"""The answer of a diagnosis: what ``diagnosis.json`` holds, and what its report shows beside it.

Every type here refuses what may not be written: a number that is no number, a verdict that its effects contradict.
``recordings`` is None for what all recordings share, else the names of those that have it, as in a model file.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import Any, Literal, TypeAlias, get_args

import discsim.law
from discsim.arrays import FloatArray, readonly
from discsim.effects.catalogue import CATALOGUE, effect
from discsim.model_file import Model
from discsim.recording import PLANTS, Plant
from validation.diagnosis.consistency.spin_agreement import Agreement

__all__ = [
    "DIAGNOSIS_FORMAT",
    "MOVE_LIMIT",
    "SMALLEST_P_VALUE",
    "Advice",
    "Candidate",
    "Confusion",
    "Diagnosis",
    "Evidence",
    "FitFigures",
    "HeldOut",
    "Law",
    "Located",
    "NamedEffect",
    "NoiseNote",
    "Outcome",
    "Outlier",
    "ParameterValue",
    "Recalibration",
    "Residuals",
    "Separation",
    "Verdict",
]

DIAGNOSIS_FORMAT = "discsim-diagnosis/1"
Verdict = Literal["consistent", "recalibrated", "explained", "unexplained"]
#: a probability below this is written as this: the logarithm of zero is no number
SMALLEST_P_VALUE = 1e-300
#: stated standard deviations within which a parameter's move leaves the verdict "consistent"
MOVE_LIMIT = 3.0

Recordings: TypeAlias = tuple[str, ...] | None


def _finite(owner: str, **numbers: float | None) -> None:
    for name, number in numbers.items():
        if number is not None and not isfinite(number):
            raise ValueError(f"{owner}: {name} is {number}, expected a finite number")


def _not_negative(owner: str, **numbers: float | None) -> None:
    _finite(owner, **numbers)
    for name, number in numbers.items():
        if number is not None and number < 0:
            raise ValueError(f"{owner}: {name} is {number:g}, expected zero or more")


def _plain(number: float | None) -> float | None:
    """Return a number as JSON takes it, also one of numpy's."""
    return None if number is None else float(number)


def _shared(recordings: Recordings) -> str | list[str]:
    return "all" if recordings is None else list(recordings)


@dataclass(frozen=True)
class ParameterValue:
    """A value with one standard deviation; an ``sd`` of None, NaN or infinity: the data do not determine it."""

    value: float
    sd: float | None

    def __post_init__(self) -> None:
        _finite("parameter", value=self.value)
        if self.sd is not None and not isfinite(self.sd):
            object.__setattr__(self, "sd", None)
        _not_negative("parameter", sd=self.sd)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {"value": _plain(self.value), "sd": _plain(self.sd)}


def _values(values: Mapping[str, ParameterValue]) -> dict[str, Any]:
    return {name: value.to_json() for name, value in values.items()}


def _setting(id: str, setting: Mapping[str, str]) -> Mapping[str, str]:
    """Return settings in their one spelling; raises ValueError where the catalogue has none such."""
    if not setting:
        return MappingProxyType({})
    return MappingProxyType(effect(id, **setting).setting)


@dataclass(frozen=True)
class Located:
    """A place where the recordings part from the baseline.

    ``recording``, ``sensor`` and ``axis`` may be "all"; the axis is a column of the sensor's file. The times are
    seconds of the recording; ``share_of_excess`` (0 to 1) is its part of the excess of chi2 over its expectation;
    ``grows_with`` names the state that the mismatch grows with, where there is one.
    """

    recording: str
    sensor: str
    axis: str
    from_s: float
    to_s: float
    share_of_excess: float
    text: str
    grows_with: str | None = None

    def __post_init__(self) -> None:
        _finite("located", from_s=self.from_s, to_s=self.to_s)
        if self.to_s < self.from_s:
            raise ValueError(f"located: from {self.from_s:g} to {self.to_s:g} s; expected ascending times")
        if not 0.0 <= self.share_of_excess <= 1.0:
            raise ValueError(f"located: share_of_excess is {self.share_of_excess:g}, expected 0 to 1")

    def covers(self, recording: str, sensor: str, axis: str) -> bool:
        """Tell whether this place is on the named recording, sensor and axis."""
        named = ((self.recording, recording), (self.sensor, sensor), (self.axis, axis))
        return all(mine in ("all", other) for mine, other in named)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "sensor": self.sensor,
            "axis": self.axis,
            "from_s": _plain(self.from_s),
            "to_s": _plain(self.to_s),
            "share_of_excess": _plain(self.share_of_excess),
            "grows_with": self.grows_with,
            "text": self.text,
        }


@dataclass(frozen=True)
class Evidence:
    """What speaks for an effect: BIC gained, log likelihood gained on held-out recordings, chance of a false alarm.

    The held-out gain is None where nothing could be held out.
    """

    delta_bic: float
    heldout_delta_log_likelihood: float | None
    p_value: float

    def __post_init__(self) -> None:
        _finite("evidence", delta_bic=self.delta_bic, heldout=self.heldout_delta_log_likelihood)
        if not 0.0 <= self.p_value <= 1.0:
            raise ValueError(f"evidence: p_value is {self.p_value}, expected 0 to 1")

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "delta_bic": _plain(self.delta_bic),
            "heldout_delta_log_likelihood": _plain(self.heldout_delta_log_likelihood),
            "p_value": max(float(self.p_value), SMALLEST_P_VALUE),
        }


@dataclass(frozen=True)
class Separation:
    """A recording that could be made, and how much chi-squared it is expected to say for one of two effects."""

    recording: str
    expected_chi2: float

    def __post_init__(self) -> None:
        _not_negative(f"separated by {self.recording}", expected_chi2=self.expected_chi2)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {"recording": self.recording, "expected_chi2": _plain(self.expected_chi2)}


@dataclass(frozen=True)
class Advice:
    """The recording that says most about which of two effects it is, the next best, and one as those in hand again."""

    best: Separation
    runner_up: Separation | None = None
    again: Separation | None = None


@dataclass(frozen=True)
class Confusion:
    """An effect that these recordings cannot tell from a named one, and the recording that would.

    ``next_recording`` says in a sentence what to record; ``advice`` is what was computed for that, None where no
    recording can be advised. ``setting`` and ``parameters`` tell which of an id's settings it is, or what sizes.
    """

    id: str
    delta_bic: float
    next_recording: str | None = None
    advice: Advice | None = None
    setting: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, ParameterValue] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _finite(f"confused with {self.id}", delta_bic=self.delta_bic)
        object.__setattr__(self, "setting", _setting(self.id, self.setting))
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        told = self.advice
        return {
            "id": self.id,
            **({"setting": dict(self.setting)} if self.setting else {}),
            **({"parameters": _values(self.parameters)} if self.parameters else {}),
            "delta_bic": _plain(self.delta_bic),
            "next_recording": self.next_recording,
            "separated_by": None if told is None else told.best.to_json(),
            "runner_up": None if told is None or told.runner_up is None else told.runner_up.to_json(),
            "same_again": None if told is None or told.again is None else told.again.to_json(),
        }


@dataclass(frozen=True)
class NamedEffect:
    """An effect that was added: its parameters by their names in the catalogue, and what speaks for it.

    ``setting`` holds what is no number, such as the axes that a sensor's columns hold; an effect has either or both.
    """

    id: str
    parameters: Mapping[str, ParameterValue]
    evidence: Evidence
    recordings: Recordings = None
    confused_with: tuple[Confusion, ...] = ()
    setting: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.parameters and not self.setting:
            raise ValueError(f"{self.id}: no parameters; expected at least one, or a setting")
        if self.recordings is not None and not self.recordings:
            raise ValueError(f"{self.id}: in no recording; expected None for all of them, or names")
        if self.id in CATALOGUE:
            known = CATALOGUE[self.id].parameters
            for name in self.parameters:
                if name not in known:
                    raise ValueError(f"{self.id}: unknown parameter '{name}'; expected {', '.join(known)}")
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))
        object.__setattr__(self, "setting", _setting(self.id, self.setting))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "id": self.id,
            "recordings": _shared(self.recordings),
            "parameters": _values(self.parameters),
            **({"setting": dict(self.setting)} if self.setting else {}),
            "evidence": self.evidence.to_json(),
            "confused_with": [other.to_json() for other in self.confused_with],
        }


@dataclass(frozen=True)
class Recalibration:
    """A stated parameter with a sigma, and where the recordings move it."""

    stated: float
    stated_sd: float
    value: float
    sd: float | None

    def __post_init__(self) -> None:
        _finite("recalibrated", stated=self.stated, stated_sd=self.stated_sd, value=self.value)
        if self.stated_sd <= 0:
            raise ValueError(f"recalibrated: stated_sd is {self.stated_sd:g}; a parameter without one never moves")
        object.__setattr__(self, "sd", ParameterValue(self.value, self.sd).sd)

    @property
    def sigmas(self) -> float:
        """The move in stated standard deviations, with its sign."""
        return (self.value - self.stated) / self.stated_sd

    @property
    def beyond(self) -> bool:
        """Whether it moved by more than its statement allows."""
        return abs(self.sigmas) > MOVE_LIMIT

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "stated": _plain(self.stated),
            "stated_sd": _plain(self.stated_sd),
            "value": _plain(self.value),
            "sd": _plain(self.sd),
        }


@dataclass(frozen=True)
class Law:
    """A missing force, torque or sensor term as an explicit formula of the state, ``target = text``.

    Text and target are those of `discsim.law.Law`, so that the law can be flown. ``also`` are the laws of the same
    physics about other targets, such as a sensor's other axes; ``leaves`` says what is left with all of them in.
    """

    text: str
    target: str
    coefficients: Mapping[str, ParameterValue]
    heldout_delta_log_likelihood: float | None = None
    also: tuple[Law, ...] = ()
    leaves: str = ""

    def __post_init__(self) -> None:
        _finite("law", heldout=self.heldout_delta_log_likelihood)
        if not self.text or not self.target or not self.coefficients:
            raise ValueError("law: expected a text, a target and coefficients")
        object.__setattr__(self, "coefficients", MappingProxyType(dict(self.coefficients)))
        self.for_model()

    def for_model(self) -> discsim.law.Law:
        """Return the law as a model file carries it; raises `InputError` where text or target are no law's."""
        values = {name: float(item.value) for name, item in self.coefficients.items()}
        sigma = {name: float(item.sd) for name, item in self.coefficients.items() if item.sd is not None}
        return discsim.law.Law(self.text, self.target, values, sigma)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "text": self.text,
            "target": self.target,
            "coefficients": _values(self.coefficients),
            "heldout_delta_log_likelihood": _plain(self.heldout_delta_log_likelihood),
            "also": [
                {"text": law.text, "target": law.target, "coefficients": _values(law.coefficients)} for law in self.also
            ],
            "leaves": self.leaves,
        }


@dataclass(frozen=True)
class NoiseNote:
    """A sensor's noise as stated and as it is, in the sensor's unit; "gps.position" and "gps.velocity" are apart."""

    sensor: str
    stated_rms: float | None
    observed_rms: float
    correlation_s: float = 0.0

    def __post_init__(self) -> None:
        _not_negative(
            f"noise of {self.sensor}",
            stated_rms=self.stated_rms,
            observed_rms=self.observed_rms,
            correlation_s=self.correlation_s,
        )

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "sensor": self.sensor,
            "stated_rms": _plain(self.stated_rms),
            "observed_rms": _plain(self.observed_rms),
            "correlation_s": _plain(self.correlation_s),
        }


@dataclass(frozen=True)
class FitFigures:
    """chi2 per scalar reading of a model, in the fit and on held-out recordings (None: nothing held out)."""

    chi2_per_sample: float
    heldout_chi2_per_sample: float | None

    def __post_init__(self) -> None:
        _not_negative("fit", chi2_per_sample=self.chi2_per_sample, heldout=self.heldout_chi2_per_sample)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "chi2_per_sample": _plain(self.chi2_per_sample),
            "heldout_chi2_per_sample": _plain(self.heldout_chi2_per_sample),
        }


@dataclass(frozen=True)
class HeldOut:
    """One recording while it took no part: chi2 per scalar reading before and after, log likelihood gained."""

    recording: str
    baseline: float
    final: float
    delta_log_likelihood: float

    def __post_init__(self) -> None:
        _not_negative(f"held out {self.recording}", baseline=self.baseline, final=self.final)
        _finite(f"held out {self.recording}", delta_log_likelihood=self.delta_log_likelihood)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "baseline_chi2_per_sample": _plain(self.baseline),
            "final_chi2_per_sample": _plain(self.final),
            "delta_log_likelihood": _plain(self.delta_log_likelihood),
        }


@dataclass(frozen=True)
class Outlier:
    """A reading that was weighed down: ``deviation`` is its residual in standard deviations of the noise."""

    recording: str
    sensor: str
    axis: str
    t_s: float
    deviation: float

    def __post_init__(self) -> None:
        _finite("outlier", t_s=self.t_s, deviation=self.deviation)

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "recording": self.recording,
            "sensor": self.sensor,
            "axis": self.axis,
            "t_s": _plain(self.t_s),
            "deviation": _plain(self.deviation),
        }


@dataclass(frozen=True)
class Diagnosis:
    """The whole answer; `to_json` is the content of ``diagnosis.json``.

    Attributes
    ----------
    datasets : tuple of str
        Names of the data sets; with several, a recording is named ``set/folder``.
    plant : str
        One of `discsim.recording.PLANTS`.
    seed : int
        Seed of everything random.
    verdict : str
        "consistent", "recalibrated", "explained" or "unexplained".
    baseline, final : FitFigures
        The fit before and after; a baseline has its release states and phases fitted, too.
    located, effects, recalibrated, law, noise
        The contract's entries; the effects are put in order of evidence, strongest first.
    heldout : tuple of HeldOut
        Before and after, recording by recording.
    outliers : tuple of Outlier
        Readings that were weighed down.
    next_recordings : tuple of str
        What to record next, as sentences.
    warnings : tuple of str
        What the reader must know: a sensor that is absent or cannot be used, sensors that contradict one another.
    agreement : Agreement or None
        Which sensors agree about the spin, and what single causes reconcile them; None where none can be compared.
    """

    datasets: tuple[str, ...]
    plant: Plant
    seed: int
    verdict: Verdict
    baseline: FitFigures
    final: FitFigures
    located: tuple[Located, ...] = ()
    effects: tuple[NamedEffect, ...] = ()
    recalibrated: Mapping[str, Recalibration] = field(default_factory=dict)
    law: Law | None = None
    noise: tuple[NoiseNote, ...] = ()
    heldout: tuple[HeldOut, ...] = ()
    outliers: tuple[Outlier, ...] = ()
    next_recordings: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    agreement: Agreement | None = None

    def __post_init__(self) -> None:
        if not self.datasets:
            raise ValueError("diagnosis: no data set named; expected at least one")
        if self.plant not in PLANTS:
            raise ValueError(f"diagnosis: plant is {self.plant!r}, expected one of {', '.join(PLANTS)}")
        if self.verdict not in get_args(Verdict):
            raise ValueError(f"diagnosis: verdict is {self.verdict!r}, expected one of {', '.join(get_args(Verdict))}")
        object.__setattr__(self, "recalibrated", MappingProxyType(dict(self.recalibrated)))
        by_evidence = sorted(self.effects, key=lambda effect: -effect.evidence.delta_bic)
        object.__setattr__(self, "effects", tuple(by_evidence))
        if bool(self.effects) != (self.verdict == "explained"):
            raise ValueError(
                f"diagnosis: {len(self.effects)} effects with the verdict {self.verdict}; "
                "expected effects where it is explained, and nowhere else"
            )
        if self.law is not None and self.verdict != "unexplained":
            raise ValueError(f"diagnosis: a law with the verdict {self.verdict}; expected one only where unexplained")
        if self.verdict in ("consistent", "recalibrated") and bool(self.moved) != (self.verdict == "recalibrated"):
            raise ValueError(
                f"diagnosis: verdict {self.verdict} with {len(self.moved)} parameters moved by more than "
                f"{MOVE_LIMIT:g} of their sigma; expected none where consistent, some where recalibrated"
            )
        _each_once(self.effects)

    @property
    def moved(self) -> dict[str, Recalibration]:
        """The parameters that moved by more than their statement allows."""
        return {name: item for name, item in self.recalibrated.items() if item.beyond}

    def to_json(self) -> dict[str, Any]:
        """Return the content of ``diagnosis.json``: plain numbers, texts, lists and null, no NaN or Infinity."""
        return {
            "format": DIAGNOSIS_FORMAT,
            "dataset": self.datasets[0] if len(self.datasets) == 1 else list(self.datasets),
            "plant": self.plant,
            "seed": int(self.seed),
            "verdict": self.verdict,
            "located": _list(self.located),
            "effects": _list(self.effects),
            "recalibrated": {name: item.to_json() for name, item in self.recalibrated.items()},
            "law": None if self.law is None else self.law.to_json(),
            "noise": _list(self.noise),
            "fit": {"baseline": self.baseline.to_json(), "final": self.final.to_json()},
            "heldout": _list(self.heldout),
            "outliers": _list(self.outliers),
            "next_recordings": list(self.next_recordings),
            "warnings": list(self.warnings),
            "agreement": None if self.agreement is None else self.agreement.to_json(),
        }


def _list(items: Iterable[Any]) -> list[dict[str, Any]]:
    return [item.to_json() for item in items]


def _each_once(effects: Sequence[NamedEffect]) -> None:
    """Refuse one effect twice in one recording; only events repeat."""
    seen: dict[str, list[Recordings]] = {}
    for item in effects:
        if item.id in CATALOGUE and CATALOGUE[item.id].event:
            continue
        for other in seen.setdefault(item.id, []):
            if other is None or item.recordings is None or set(other) & set(item.recordings):
                raise ValueError(f"diagnosis: {item.id} twice in one recording; expected disjoint recordings")
        seen[item.id].append(item.recordings)


@dataclass(frozen=True)
class Residuals:
    """What is left of one axis of one sensor in one recording, in standard deviations of its noise.

    ``t``, ``before`` (of the baseline) and ``after`` (of the final model) are (n,); NaN where a reading was left out.
    ``marks`` are spans (from, to) in s that deserve the eye, beside those of `Located`.
    """

    recording: str
    sensor: str
    axis: str
    t: FloatArray
    before: FloatArray
    after: FloatArray
    marks: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for name in ("t", "before", "after"):
            array = readonly(getattr(self, name))
            if array.ndim != 1 or array.size != len(self.t):
                raise ValueError(f"residuals: {name} is {array.shape}, expected ({len(self.t)},) as t")
            object.__setattr__(self, name, array)


@dataclass(frozen=True)
class Candidate:
    """A hypothesis in the ranking: what it takes off chi2 when it alone is added, and why it was kept or not.

    ``note`` is a short text for the reader ("named", "no better than chance", "worse on held-out recordings").
    """

    id: str
    gain: float
    parameters: Mapping[str, float] = field(default_factory=dict)
    recordings: Recordings = None
    note: str = ""

    def __post_init__(self) -> None:
        _finite(f"candidate {self.id}", gain=self.gain, **self.parameters)
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "id": self.id,
            "recordings": _shared(self.recordings),
            "gain": _plain(self.gain),
            "parameters": {name: _plain(value) for name, value in self.parameters.items()},
            "note": self.note,
        }


@dataclass(frozen=True)
class Outcome:
    """What a diagnosis returns: the answer, and what its report, ``model.toml`` and figures are made of.

    ``candidates`` are in the order of the ranking; ``settings`` are shown as they are.
    """

    diagnosis: Diagnosis
    model: Model
    residuals: tuple[Residuals, ...] = ()
    candidates: tuple[Candidate, ...] = ()
    settings: Mapping[str, str] = field(default_factory=dict)
