"""Which sensors agree, as tables for a reader: caption, header, rows of cells."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from discsim.validation.diagnosis.answer.leftover import Leftover
from discsim.validation.diagnosis.consistency.imu_clock import ImuRows
from discsim.validation.diagnosis.consistency.low_pass_transient import TransientProof
from discsim.validation.diagnosis.consistency.own_clock import SamplesShown
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement, Cause, RowProof
from discsim.validation.diagnosis.report.wording import plus_minus

__all__ = ["Table", "leftovers_of", "tables_of"]

Table: TypeAlias = tuple[str, tuple[str, ...], list[tuple[str, ...]]]


def tables_of(found: Agreement) -> list[Table]:
    """Return the comparisons, the single causes, and what each leaves of recordings that took no part."""
    tables = [_comparisons(found)]
    if any(not item.agrees for item in found.comparisons) and found.causes:
        tables.append(_causes(found.causes))
        if found.causes[0].heldout:
            tables.append(_proofs(found.causes[0]))
    if found.row_proofs:
        tables.append(_rows(found.row_proofs))
    if found.own_clock is not None:
        tables.append(_samples(found.own_clock.shown))
    if found.imu_clock is not None:
        tables.append(_chip(found.imu_clock.shown))
    if found.settling is not None:
        tables.append(_settling(found.settling.heldout))
    return tables


def _comparisons(found: Agreement) -> Table:
    reference = found.reference.replace("_", " ")
    rows: list[tuple[str, ...]] = [
        (
            item.recording,
            f"{item.signal} ({item.sensor})",
            plus_minus(item.ratio, item.sd),
            "the written time" if item.needs_time else "no time",
            "agrees" if item.agrees else "contradicts",
        )
        for item in found.comparisons
    ]
    return "The spin about z by each sensor", ("recording", "signal", f"over the {reference}'s", "rests on", ""), rows


def _samples(shown: tuple[SamplesShown, ...]) -> Table:
    rows: list[tuple[str, ...]] = [
        (
            item.recording,
            f"{1e3 * item.period_of_others_s:.3f} ms",
            "" if item.loop_s is None else f"{1e3 * item.loop_s:.2f} ms",
            f"{100.0 * item.lost:.0f} %",
            *(f"{value:.2f} µT" for value in item.left),
        )
        for item in shown
    ]
    header = (
        "recording",
        "period of the others",
        "logger's loop",
        "steps without a row",
        "field leaves in counted rows",
    )
    return "The magnetometer's own clock", (*header, "with the samples shown"), rows


def _chip(shown: tuple[ImuRows, ...]) -> Table:
    rows: list[tuple[str, ...]] = [
        (item.recording, f"{1e3 * item.period_s:.3f} ms", *(f"{value:.3f} rad/s" for value in item.left))
        for item in shown
    ]
    header = ("recording", "period", "wobble leaves at the field's times", "at the chip's own")
    return "The clock of gyroscope and accelerometer", header, rows


#: units of sensors as a reader has them, and rad/s in deg/s
_UNITS = {"magnetometer": (1.0, "µT"), "gyroscope": (180.0 / np.pi, "°/s"), "accelerometer": (1.0, "m/s²")}


def leftovers_of(left: Sequence[Leftover]) -> Table:
    """Return what each recording keeps of each sensor, rms of an axis, shared numbers being those of the others."""
    rows: list[tuple[str, ...]] = []
    for item in left:
        factor, unit = _UNITS[item.sensor]
        sizes = [item.baseline, item.left, *([] if item.pure is None else [item.pure])]
        cells = [f"{factor * size:.3g} {unit}" for size in sizes]
        rows.append((item.recording, item.sensor, *cells, *([""] if item.pure is None else [])))
    header = ("recording", "sensor", "baseline", "with the numbers of the others", "pure error of its rows")
    return "What is left of each sensor", header, rows


def _number(value: float) -> str:
    return f"{value:.2f}" if value < 99.5 else f"{value:,.0f}"


def _causes(causes: tuple[Cause, ...]) -> Table:
    rows: list[tuple[str, ...]] = [
        (
            cause.id,
            f"{cause.parameter} = {plus_minus(cause.value, cause.sd)}",
            _number(cause.chi2_before),
            _number(cause.chi2_after),
            _number(cause.heldout_after) if cause.heldout else "",
        )
        for cause in causes
    ]
    header = ("single cause", "size", "χ² before", "χ² after", "χ² after, each recording set aside in turn")
    return "What single causes reconcile", header, rows


def _proofs(cause: Cause) -> Table:
    rows: list[tuple[str, ...]] = [
        (
            proof.recording,
            plus_minus(proof.own_value, proof.own_sd),
            plus_minus(proof.value_of_others, proof.sd_of_others),
            f"{_number(proof.chi2_before)} → {_number(proof.chi2_after)}",
            ""
            if proof.field_left_uT_before is None or proof.field_left_uT_after is None
            else f"{proof.field_left_uT_before:.1f} → {proof.field_left_uT_after:.1f} µT",
        )
        for proof in cause.heldout
    ]
    header = ("recording set aside", "asks for", "value of the others", "χ² with that", "what the field leaves")
    return f"{cause.id} on recordings that took no part", header, rows


def _rows(proofs: tuple[RowProof, ...]) -> Table:
    rows: list[tuple[str, ...]] = [
        (
            proof.recording,
            f"{1e3 * proof.tick_s:.3f} ms",
            *(f"{left:.1f} µT" for left in proof.left[:3]),
            "" if proof.wobble is None else f"{proof.wobble:.2f}",
        )
        for proof in proofs
    ]
    header = (
        "recording set aside",
        "tick of the others",
        "field leaves as written",
        "with even rows",
        "with counted rows",
        "correlation with the wobble",
    )
    return "Rows counted in ticks, on recordings that took no part", header, rows


def _settling(proofs: tuple[TransientProof, ...]) -> Table:
    rows: list[tuple[str, ...]] = [
        (
            proof.recording,
            f"{plus_minus(1e3 * proof.tau_s, 1e3 * proof.tau_sd_s)} ms",
            f"{1e3 * proof.tau_of_others_s:.0f} ms",
            f"{proof.left_m_s2_before:.2f} → {proof.left_m_s2_after:.2f} m/s²",
        )
        for proof in proofs
    ]
    header = ("recording set aside", "own time constant", "that of the others", "accelerometer beyond the pull")
    return "The accelerometer's start, on recordings that took no part", header, rows
