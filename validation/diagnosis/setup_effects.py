"""Faults of the setup in a diagnosis: numbers that the fit refines, and effects of the answer.

The recordings are corrected before the fit (`discsim.validation.diagnosis.setup`). What of a fault is a number (an
offset, a rotation, a field) stays free about its first value in every fit, so that it gets its error beside everything
else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import approx_fprime
from scipy.spatial.transform import Rotation

from discsim.arrays import FloatArray
from discsim.effects.catalogue import Effect, catalogued, effect, row
from discsim.effects.sensors import Scale, SoftIron, soft_iron
from discsim.effects.setup import BoardRotation, ClockUnit, SiteField, TimeOffset
from discsim.recording import Recording
from discsim.validation.diagnosis.result import (
    SMALLEST_P_VALUE,
    Confusion,
    Evidence,
    Located,
    NamedEffect,
    ParameterValue,
    Verdict,
)
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.diagnosis.setup import SetupFault, SetupFindings, said, with_axes_as_read
from discsim.validation.diagnosis.setup.hypotheses import PERMUTATIONS, SNAP
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.other_side import at_limits
from discsim.validation.identification.parameters import Parameter
from discsim.written import corrected

__all__ = [
    "SetupAnswer",
    "answer_of_setup",
    "free_parameters",
    "with_other_sensor",
    "with_reversed_axes",
    "with_those_borne_out",
    "without_faults",
]

#: how far a number of a fault may be from its first value, one sigma: s; rad; rad and share. Offsets are found to a few
#: ms, rotations to a tenth of a radian (an accelerometer's place may be 3 mm of 16 off), fields to a few per cent
_SIGMA: Mapping[type[Any], float] = {TimeOffset: 0.01, BoardRotation: 0.2, SiteField: 0.2}
#: a number whose error is this share of that was not determined by the recordings
_UNDETERMINED = 0.3
#: scale error beyond which an axis reads rather -1 times what it should than nothing
_REVERSED = -1.5


def free_parameters(findings: SetupFindings) -> tuple[Parameter, ...]:
    """Return the numbers of the faults found, about the corrected recordings, for a fit to refine."""
    free = []
    for fault in findings.effects:
        kind = row(fault.id)
        for name, scale, none in zip(kind.parameters, kind.scale, _numbers(kind.baseline), strict=True):
            free.append(Parameter(fault.id, name, none, 0.1 * scale, _SIGMA[kind.type]))
    return tuple(free)


def with_reversed_axes(findings: SetupFindings, fit: Fit) -> SetupFindings | None:
    """Return findings with the axes that a fit has found to read about -1 times what they should; None if it has none.

    A scale error of -2 is a reversed column, and so is one whose readings at a limit stand at the other one. Soft iron
    that makes one axis another, or its reverse, is that. Where an axis hardly shows, as one along which a sensor lies
    near the spin axis, relations between sensors do not tell it before the fit.
    """
    sd = np.sqrt(np.maximum(np.diag(fit.covariance), 0.0))
    at = {(q.group, q.name): v + 3.0 * e for q, v, e in zip(fit.parameters, fit.at, sd, strict=True)}
    limits = at_limits(fit)
    reads = {}
    for sensor in ("accelerometer", "gyroscope"):
        back = [at.get((catalogued(Scale, sensor).id, name), 0.0) < _REVERSED for name in Scale._fields]
        # errors are along the axes of the board, limits along those of the corrected readings
        turned = np.diag(_along_body(np.diag(np.where(back, -1.0, 1.0)), findings))
        beyond = [(sensor, axis) in limits and limits[sensor, axis].reversed for axis in range(3)]
        # a fit with a scale of -1 has what stands at a limit on the right side
        reads[sensor] = np.diag(np.where(beyond, -1.0, turned))
    reads["magnetometer"] = _along_body(_read_by_iron(fit), findings)
    if all(np.array_equal(own, np.eye(3)) for own in reads.values()):
        return None
    return with_axes_as_read(findings, reads)


def _along_body(reads: FloatArray, findings: SetupFindings) -> FloatArray:
    """Return a signed permutation (3, 3) of a board's axes as one of body axes; none of a board that is askew."""
    C = findings.recordings[0].turned_back if findings.recordings else None
    if C is None:
        return reads
    turned = C @ reads @ C.T
    return np.round(turned) if np.linalg.norm(turned - np.round(turned)) < SNAP else np.eye(3)


def _read_by_iron(fit: Fit) -> FloatArray:
    """Return the signed permutation (3, 3) of axes that a magnetometer's soft iron stands for; none for iron."""
    values = fit.values(0)
    iron = SoftIron(*(values.get((catalogued(SoftIron).id, name), 0.0) for name in SoftIron._fields))
    matrix = soft_iron(iron, np.eye(3))
    nearest = min(PERMUTATIONS, key=lambda one: float(np.linalg.norm(matrix - one)))
    return nearest if np.linalg.norm(matrix - nearest) < SNAP else np.eye(3)


def with_other_sensor(findings: SetupFindings, written: Sequence[Recording]) -> SetupFindings | None:
    """Return findings with the first fault that another sensor's would do as well for put down to that sensor.

    None where there is no such fault. ``written`` are the recordings as they stand in their files.
    """
    for fault in findings.faults:
        others = [twin for twin in fault.twins if twin.row.acts_on != fault.effect.row.acts_on]
        if others:
            rest = tuple(twin for twin in fault.twins if twin is not others[0])
            other = replace(fault, effect=others[0], twins=(*rest, fault.effect), place=None)
            faults = tuple(other if one is fault else one for one in findings.faults)
            return replace(findings, faults=faults, recordings=_as_meant(faults, written))
    return None


def with_those_borne_out(findings: SetupFindings, written: Sequence[Recording], fit: Fit) -> SetupFindings | None:
    """Return findings without the faults whose numbers a fit has brought back to none; None if there are no such.

    Relations between sensors may take a large error of one sensor for another field, as they cannot fit it; beside that
    error the field is the stated one. ``written`` are the recordings as they stand in their files.
    """
    return _with_only([fault for fault in findings.faults if _borne_out(fault.effect, fit)], findings, written)


def without_faults(findings: SetupFindings, written: Sequence[Recording], *types: type[Any]) -> SetupFindings | None:
    """Return findings without the faults of some types of effect; None if there are no such.

    Relations between sensors take samples that were lost, or a clock that steps, for times that are off, and a magnet
    by which the field turns over along a path for a board that is turned. ``written`` are the recordings as they stand
    in their files.
    """
    kept = [fault for fault in findings.faults if fault.effect.row.type not in types]
    return _with_only(kept, findings, written)


def _with_only(
    kept: Sequence[SetupFault], findings: SetupFindings, written: Sequence[Recording]
) -> SetupFindings | None:
    """Return findings with some of their faults, None if those are all; ``written`` are the recordings of the files."""
    if len(kept) == len(findings.faults):
        return None
    return replace(findings, faults=tuple(kept), recordings=_as_meant(kept, written))


def _as_meant(faults: Sequence[SetupFault], written: Sequence[Recording]) -> tuple[Recording, ...]:
    """Return recordings as they were meant, of those ``written`` with some faults."""
    meant = tuple(written)
    for fault in faults:
        meant = tuple(corrected(one, [fault.effect]) for one in meant)
    return meant


def _borne_out(fault: Effect, fit: Fit) -> bool:
    """Tell whether a fault's numbers, as a fit has them, are further from none than what an effect must gain.

    By their covariance (Wald), in which numbers that no reading tells are as uncertain as they were before the fit.
    """
    names = fault.row.parameters
    covariance = _covariance_of(fit, fault.id, names) if fault.row.type in _SIGMA else None
    if covariance is None or not np.all(np.isfinite(covariance)):
        return True
    away = np.array(_numbers(_refined(fault, fit).effect.value)) - _numbers(fault.row.baseline)
    return bool(away @ np.linalg.lstsq(covariance, away)[0] > SELECTION.entry + SELECTION.per_parameter * len(names))


def _numbers(value: tuple[float | str, ...]) -> list[float]:
    return [float(item) for item in value if not isinstance(item, str)]


@dataclass(frozen=True)
class SetupAnswer:
    """What the faults of a setup put into an answer: effects, places, what to record, warnings.

    ``excess`` is the chi-squared per reading by which the baseline misses what is written.
    """

    effects: tuple[NamedEffect, ...] = ()
    located: tuple[Located, ...] = ()
    next_recordings: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    excess: float = 0.0


def answer_of_setup(
    findings: SetupFindings, written: Sequence[Recording], fit: Fit | None, verdict: Verdict
) -> SetupAnswer:
    """Return the faults of a setup as the answer has them.

    ``written`` are the recordings as they stand in their files, ``fit`` the final one, of the corrected recordings, or
    None where nothing follows them. The baseline's figures become those of the written readings against the motion that
    the fit found. Where something unexplained is left, the faults stand among the warnings, as the answer names no
    effect then.
    """
    if verdict == "unexplained" or fit is None:
        told = (f"corrected before the fit: {fault.id}, {fault.sentence}" for fault in findings.faults)
        return SetupAnswer(warnings=tuple(told))
    excess = [_excess(fault.effect, written, findings.recordings, fit) for fault in findings.faults]
    total = sum(excess)
    named = tuple(
        _named(fault, _refined(fault.effect, fit), more, fit, len(written))
        for fault, more in zip(findings.faults, excess, strict=True)
    )
    located = tuple(
        _located(one, fault, more / max(total, 1e-300), written)
        for one, fault, more in zip(named, findings.faults, excess, strict=True)
    )
    told = (other.next_recording for one in named for other in one.confused_with[:1] if other.next_recording)
    return SetupAnswer(named, located, tuple(told), (), total / max(fit.count, 1))


_TURNED = catalogued(BoardRotation).id


def _covariance_of(fit: Fit, id: str, names: Sequence[str]) -> FloatArray | None:
    """Return the covariance (k, k) of an effect's parameters; None where the fit has none."""
    places = {q.name: k for k, q in enumerate(fit.parameters) if q.group == id}
    if fit.covariance.shape[0] != len(fit.parameters) or not set(names) <= set(places):
        return None
    at = [places[name] for name in names]
    return np.asarray(fit.covariance[np.ix_(at, at)])


@dataclass(frozen=True)
class _Refined:
    """A fault with its numbers as the fit has them; an error of None where the recordings do not determine it."""

    effect: Effect
    errors: tuple[float | None, ...]


#: over which the slopes of a fault's numbers are taken, rad: halfway between round-off and their curvature
_STEP = 1e-6


def _refined(fault: Effect, fit: Fit) -> _Refined:
    """Return a fault with its numbers as a fit has them, and the errors of these.

    A turn goes on from the one that was corrected: its error about one axis is an error of all three numbers.
    """
    places = {q.name: k for k, q in enumerate(fit.parameters) if q.group == fault.id}
    names = row(fault.id).parameters
    if not names or not places:
        return _Refined(fault, ())
    at = [places[name] for name in names]
    moved = fit.at[at]
    first = np.array(_numbers(fault.value))

    def composed(more: FloatArray) -> FloatArray:
        """Return the numbers of the fault with what the fit had of it beside the corrected recordings."""
        if fault.id == _TURNED:
            # the fit turned what was corrected: readings = (R_fit C)^T (vector in B)
            return np.asarray((Rotation.from_rotvec(more) * Rotation.from_rotvec(first)).as_rotvec())
        if fault.row.type is SiteField:
            return np.array([first[0] + more[0], first[1] + more[1], first[2] * more[2]])
        return np.asarray(first + more)

    total = composed(moved)
    covariance = _covariance_of(fit, fault.id, names)
    sd = np.full(len(at), np.inf)
    if covariance is not None:
        slopes = np.reshape(approx_fprime(moved, composed, _STEP), 2 * moved.shape)
        sd = np.sqrt(np.maximum(np.diag(slopes @ covariance @ slopes.T), 0.0))
    room = _SIGMA[fault.row.type]
    errors = tuple(float(one) if one < _UNDETERMINED * room else None for one in sd)
    return _Refined(effect(fault.id, **dict(zip(names, total.tolist(), strict=True))), errors)


def _named(fault: SetupFault, refined: _Refined, excess: float, fit: Fit, recordings: int) -> NamedEffect:
    names = row(fault.effect.id).parameters
    values = _numbers(refined.effect.value)
    errors = refined.errors or (None,) * len(names)
    parameters = {name: ParameterValue(value, sd) for name, value, sd in zip(names, values, errors, strict=True)}
    bic = excess - max(len(names), 1) * float(np.log(max(fit.count, 2)))
    confused = tuple(_confusion(twin, fault, bic) for twin in fault.twins)
    held = fault.heldout_gain if recordings > 1 else None
    evidence = Evidence(bic, 0.5 * excess if held is None and recordings > 1 and not names else held, SMALLEST_P_VALUE)
    return NamedEffect(fault.effect.id, parameters, evidence, None, confused, dict(fault.effect.setting))


def _confusion(twin: Effect, fault: SetupFault, bic: float) -> Confusion:
    names = row(twin.id).parameters
    parameters = {name: ParameterValue(value, None) for name, value in zip(names, _numbers(twin.value), strict=True)}
    text = f"{said(twin)} would do as well; to tell: {_telling(twin, fault.effect)}"
    return Confusion(twin.id, bic, text, None, dict(twin.setting), parameters)


def _telling(twin: Effect, fault: Effect) -> str:
    """Return what tells two faults of a setup apart, in words."""
    if {twin.id, fault.id} == {_TURNED}:
        return "note which way the disc spins, or log it lying still with its top up, where gravity shows the z axis"
    return (
        "lay the disc still with its top up, then stand it on its edge with x up, then with y up, logging all the "
        "time: gravity and the field show every axis"
    )


def _excess(fault: Effect, written: Sequence[Recording], meant: Sequence[Recording], fit: Fit) -> float:
    """Return the chi-squared of what the written readings of a fault's sensors are off the corrected ones."""
    total = 0.0
    for before, after in zip(written, meant, strict=True):
        for sensor, samples in before.samples.items():
            if not fault.row.acts_with((sensor,)):
                continue
            if fault.row.type is SiteField:
                if sensor == "magnetometer":
                    apart = after.environment.magnetic_field - before.environment.magnetic_field
                    total += len(samples) * float(apart @ apart) / _variance(fit, sensor)
                continue
            there = after.samples[sensor]
            value, meant_value = _columns(samples.value), _columns(there.value)
            if fault.row.type in (TimeOffset, ClockUnit):
                meant_value = np.column_stack([_at(samples.t, there.t, column) for column in meant_value.T])
            left = (value - meant_value) ** 2
            total += float(np.nansum(left)) / _variance(fit, sensor)
    return total


def _columns(value: FloatArray) -> FloatArray:
    return value if value.ndim == 2 else value[:, None]


def _at(t: FloatArray, known: FloatArray, value: FloatArray) -> FloatArray:
    good = np.isfinite(value)
    return np.interp(t, known[good], value[good]) if good.any() else np.full(t.size, np.nan)


def _variance(fit: Fit, sensor: str) -> float:
    sd = [noise.sd for group, noise in fit.noise.items() if group.partition(".")[0] == sensor]
    return float(np.mean(np.square(sd))) if sd else 1.0


def _located(named: NamedEffect, fault: SetupFault, share: float, written: Sequence[Recording]) -> Located:
    whose = fault.effect.row
    sensor = "all" if whose.acts_on in ("board", "clock") or whose.type is SiteField else whose.acts_on
    end = max(float(samples.t[-1]) for one in written for samples in one.samples.values())
    return Located("all", sensor, "all", 0.0, end, float(np.clip(share, 0.0, 1.0)), said(fault.effect))
