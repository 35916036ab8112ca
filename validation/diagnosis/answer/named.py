"""What an answer names: effects with their evidence and what they are confused with, recalibrated numbers, a law.

``recordings`` is None for what all recordings share, else the names of those that have it, as in a model file.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import Any

import discsim.law
from discsim.effects.catalogue import CATALOGUE, effect
from discsim.validation.diagnosis.answer.checked import Recordings, Told, finite, not_negative, plain, shared

__all__ = [
    "MOVE_LIMIT",
    "SMALLEST_P_VALUE",
    "Advice",
    "Confusion",
    "Evidence",
    "Law",
    "NamedEffect",
    "ParameterValue",
    "Recalibration",
    "Separation",
]

#: a probability below this is written as this: the logarithm of zero is no number
SMALLEST_P_VALUE = 1e-300
#: stated standard deviations within which a parameter's move leaves the verdict "consistent"
MOVE_LIMIT = 3.0


@dataclass(frozen=True)
class ParameterValue(Told):
    """A value with one standard deviation; an ``sd`` of None, NaN or infinity: the data do not determine it."""

    value: float
    sd: float | None

    def __post_init__(self) -> None:
        finite("parameter", value=self.value)
        if self.sd is not None and not isfinite(self.sd):
            object.__setattr__(self, "sd", None)
        not_negative("parameter", sd=self.sd)


def _values(values: Mapping[str, ParameterValue]) -> dict[str, Any]:
    return {name: value.to_json() for name, value in values.items()}


def _setting(id: str, setting: Mapping[str, str]) -> Mapping[str, str]:
    """Return settings in their one spelling; raises ValueError where the catalogue has none such."""
    if not setting:
        return MappingProxyType({})
    return MappingProxyType(effect(id, **setting).setting)


@dataclass(frozen=True)
class Evidence:
    """What speaks for an effect: BIC gained, log likelihood gained on held-out recordings, chance of a false alarm.

    The held-out gain is None where nothing could be held out.
    """

    delta_bic: float
    heldout_delta_log_likelihood: float | None
    p_value: float

    def __post_init__(self) -> None:
        finite("evidence", delta_bic=self.delta_bic, heldout=self.heldout_delta_log_likelihood)
        if not 0.0 <= self.p_value <= 1.0:
            raise ValueError(f"evidence: p_value is {self.p_value}, expected 0 to 1")

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        return {
            "delta_bic": plain(self.delta_bic),
            "heldout_delta_log_likelihood": plain(self.heldout_delta_log_likelihood),
            "p_value": max(float(self.p_value), SMALLEST_P_VALUE),
        }


@dataclass(frozen=True)
class Separation(Told):
    """A recording that could be made, and how much chi-squared it is expected to say for one of two effects."""

    recording: str
    expected_chi2: float

    def __post_init__(self) -> None:
        not_negative(f"separated by {self.recording}", expected_chi2=self.expected_chi2)


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
        finite(f"confused with {self.id}", delta_bic=self.delta_bic)
        object.__setattr__(self, "setting", _setting(self.id, self.setting))
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON object."""
        told = self.advice
        return {
            "id": self.id,
            **({"setting": dict(self.setting)} if self.setting else {}),
            **({"parameters": _values(self.parameters)} if self.parameters else {}),
            "delta_bic": plain(self.delta_bic),
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
            "recordings": shared(self.recordings),
            "parameters": _values(self.parameters),
            **({"setting": dict(self.setting)} if self.setting else {}),
            "evidence": self.evidence.to_json(),
            "confused_with": [other.to_json() for other in self.confused_with],
        }


@dataclass(frozen=True)
class Recalibration(Told):
    """A stated parameter with a sigma, and where the recordings move it."""

    stated: float
    stated_sd: float
    value: float
    sd: float | None

    def __post_init__(self) -> None:
        finite("recalibrated", stated=self.stated, stated_sd=self.stated_sd, value=self.value)
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
        finite("law", heldout=self.heldout_delta_log_likelihood)
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
            "heldout_delta_log_likelihood": plain(self.heldout_delta_log_likelihood),
            "also": [
                {"text": law.text, "target": law.target, "coefficients": _values(law.coefficients)} for law in self.also
            ],
            "leaves": self.leaves,
        }
