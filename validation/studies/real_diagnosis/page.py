"""The page of the documentation on what a diagnosis says of measured recordings: what its templates are filled with."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.model_file import Model
from discsim.recording import Samples
from discsim.validation.diagnosis.consistency.spin_agreement import agreement_of
from discsim.validation.diagnosis.report.consistency_tables import tables_of
from discsim.validation.diagnosis.track_ends import flight_of
from discsim.validation.importing import find_map, import_recording, read_map
from discsim.validation.reporting import markdown
from discsim.validation.reporting.run import package_version
from discsim.validation.studies.golf_throws.prediction import THROWS
from discsim.validation.studies.real_diagnosis.charts import draw_fields, draw_golf, draw_rows
from discsim.validation.studies.real_diagnosis.flatball import Rows, rows_of
from discsim.validation.studies.real_diagnosis.golf_causes import (
    APART,
    GROUND,
    LEFT,
    LITTLE,
    CauseHeldOut,
    Throw,
    held_out,
    likely_pairs,
    without_cause,
)
from discsim.validation.studies.real_diagnosis.golf_decision import decided
from discsim.validation.studies.real_diagnosis.golf_flight import flown
from discsim.validation.studies.real_diagnosis.golf_worlds import CAUSES, pair
from discsim.validation.studies.real_diagnosis.runs import diagnosed, diagnosis_digest
from discsim.validation.studies.real_diagnosis.sensors import (
    Checked,
    Linear,
    against_cameras,
    checked_log,
    field_in_body,
)
from discsim.validation.studies.real_recordings.sources import SOURCES, Source, load, raw_columns

__all__ = ["write_page"]

Say = Callable[[str], None]
#: what a part of the page is filled with, by the names in its template
Content = dict[str, Any]
GOLF = "shotshaper-dd2-drone-tracked-throws"
#: pairs of causes that are fitted in full, the likeliest by algebra
PAIRS = 3
#: a field this far from its usual size is disturbed
DISTURBED = 0.1
#: sources whose sensors are looked at one by one
LOOKED_AT = ("flatball", "aris-euler", "srp", "broad", "lynx")
UNITS = {"magnetometer": ("uT", 1.0), "accelerometer": ("m/s^2", 1.0), "gyroscope": ("deg/s", float(np.degrees(1.0)))}


def write_page(real: Path, page: Path, work: Path, seed: int = 0, say: Say = lambda text: None) -> Path:
    """Write ``page`` and its figures, into the folder of its name, from the measured sources in ``real``.

    ``work`` keeps the diagnoses. The same recordings and seed give the same bytes. Raises `InputError` as importing
    does.
    """
    figures = page.parent / page.stem
    markdown.write_page(
        page,
        Path(__file__).with_name("page.md.j2"),
        seed=seed,
        version=package_version(),
        digest=diagnosis_digest()[:12],
        flatball=_flatball(real, figures, work, seed, say),
        golf=_golf(real, figures, work, seed, say),
        sensors=_sensors(real, figures, say),
    )
    return page


# --------------------------------------------------------------------------------------------------- flatball


def _flatball(real: Path, figures: Path, work: Path, seed: int, say: Say) -> Content:
    source = next(one for one in SOURCES if one.key == "flatball")
    throws = {cut.label.split(",")[0]: load(source, cut, real).recording for cut in source.cuts}
    found = diagnosed(throws, work / "flatball", say, seed)
    rows = {name: rows_of(throw) for name, throw in throws.items()}
    draw_rows(throws, rows, figures / "flatball.png")
    disc = next(iter(throws.values())).disc
    assert disc is not None
    literature = disc.Izz / disc.Ixx
    agreement = agreement_of(list(throws.values()), list(throws))
    law = found.answer["law"]
    return {
        "answer": found,
        "rows": rows,
        "cells": [_row_cells(name, one) for name, one in rows.items()],
        "effects": [_effect_cells(one) for one in found.answer["effects"]],
        "heldout": [_held_cells(one) for one in found.answer["heldout"]],
        "coefficients": _sizes(law["coefficients"], " = ") if law else "",
        "agreement": agreement,
        "tables": [] if agreement is None else tables_of(agreement),
        "literature": literature,
        "as_filed": [1.0 + (literature - 1.0) * one.by_wobble for one in rows.values()],
        "as_turned": [1.0 + (literature - 1.0) * one.by_wobble / one.by_field for one in rows.values()],
        "decays": [one.spin["gyroscope"] / one.by_field for one in rows.values()],
    }


def _row_cells(name: str, one: Rows) -> list[str]:
    return [
        name,
        f"{1e3 * one.usual:.2f}",
        f"{100.0 * one.late:.0f} %",
        f"{10.0 * one.by_field:.2f}",
        f"{10.0 * one.by_wobble:.2f}",
        f"{one.wobble:.1f}",
        f"{one.wobble_decay:.2f}, {one.wobble_decay / one.by_field:.2f}",
        *(
            f"{one.spin[sensor]:.4f}, {one.spin[sensor] / one.by_field:.4f}"
            for sensor in ("gyroscope", "accelerometer", "magnetometer")
        ),
    ]


def _effect_cells(one: Mapping[str, Any]) -> list[str]:
    where = one["recordings"] if isinstance(one["recordings"], str) else ", ".join(one["recordings"])
    return [f"`{one['id']}`", where, _sizes(one["parameters"], " "), f"{one['evidence']['delta_bic']:.0f}"]


def _held_cells(one: Mapping[str, Any]) -> list[str]:
    return [
        one["recording"],
        f"{one['baseline_chi2_per_sample']:.3g}",
        f"{one['final_chi2_per_sample']:.3g}",
        f"{one['delta_log_likelihood']:+.0f}",
    ]


def _sizes(sizes: Mapping[str, Mapping[str, Any]], between: str) -> str:
    return ", ".join(f"{name}{between}{_pm(one)}" for name, one in sizes.items())


def _pm(value: Mapping[str, Any]) -> str:
    return f"{value['value']:.4g}" + ("" if value["sd"] is None else f" ± {value['sd']:.1g}")


# ------------------------------------------------------------------------------------------------------- golf


def _golf(real: Path, figures: Path, work: Path, seed: int, say: Say) -> Content:
    shipped = read_map(find_map("shotshaper"))
    whole = {name: import_recording(real / GOLF / f"{name}.tsv", shipped).recording for name in THROWS}
    answer = diagnosed(whole, work / "golf", say, seed)
    cuts = {name: flight_of(one.need("track"), one.sheets["track"].noise_rms) for name, one in whole.items()}
    throws = {
        name: Throw(replace(one, samples={"track": cuts[name].flight}), shipped.throws[name])
        for name, one in whole.items()
    }
    stated = {
        name: flown(throw.recording, Model(throw.recording.environment, throw.recording.disc))
        for name, throw in throws.items()
    }
    say("golf throws: without any cause")
    plain, found = without_cause(throws), []
    for cause in CAUSES:
        say(f"golf throws: {cause.name}")
        found.append(held_out(cause, throws, plain))
    say("golf throws: pairs")
    likely = likely_pairs(CAUSES[1:], throws, plain[tuple(throws)])
    pairs = [held_out(pair(*one.causes), throws, plain) for one in likely[:PAIRS]]
    free = sorted(found[1:], key=lambda one: (one.worsens, -sum(one.gains.values())))
    draw_golf(throws, stated, found[0], free[0], figures / "golf.png")
    noise = max(throw.recording.sheets["track"].noise_rms or 0.0 for throw in throws.values())
    return {
        "answer": answer,
        "partly": answer.answer.get("partly_explained", []),
        "cuts": [(name, cut.before, cut.after) for name, cut in cuts.items() if cut.before or cut.after],
        "noise": noise,
        "stated": stated,
        "APART": APART,
        "LEFT": LEFT,
        "GROUND": GROUND,
        "LITTLE": LITTLE,
        "named": ", ".join(f"`{one['id']}`" for one in answer.answer["effects"]),
        "names": list(throws),
        "without": found[0],
        "causes": [_cause_cells(one, list(throws)) for one in free],
        "pairs": [_cause_cells(one, list(throws)) for one in pairs],
        "asked": len(likely),
        "free": free,
        "better_pairs": [one for one in pairs if max(one.left.values()) < max(free[0].left.values())],
        "decided": decided(throws, free[0].together, free[1].together),
        "off": lambda flights: ", ".join(f"{flights[name].distance:.1f}" for name in throws),
    }


def _cause_cells(one: CauseHeldOut, names: Sequence[str]) -> list[str]:
    fit = one.together
    return [
        fit.cause.name,
        fit.cause.told(fit.x),
        "; ".join(fit.cause.told(one.others[name].x) for name in names),
        ", ".join(f"{one.tried[name].rms[name]:.2f}" for name in names),
        ", ".join(f"{100.0 * (one.left[name] - 1.0):+.0f} %" for name in names),
        ", ".join(f"{one.tried[name].touch_down[name]:.1f}" for name in names),
        ", ".join(f"{one.gains[name]:+.1f}" for name in names),
    ]


# ---------------------------------------------------------------------------------------------------- sensors


def _sensors(real: Path, figures: Path, say: Say) -> Content:
    rows: list[Checked] = []
    repairs: dict[str, int] = {}
    logs: set[Path] = set()
    fields: list[tuple[str, FloatArray, float | None]] = []
    for source in (one for one in SOURCES if one.key in LOOKED_AT):
        for cut in source.cuts:
            say(f"sensors: {cut.label}")
            name = cut.label if source.key == "aris-euler" else cut.label.split(",")[0]
            raw = real / source.folder / cut.raw
            looked, repairs[name] = checked_log(name, raw, cut.map)
            again = raw in logs  # another IMU of the same log: its magnetometer is the same
            logs.add(raw)
            rows += [one for one in looked if one.sensor != "magnetometer" or not again]
            if not again:
                recording = import_recording(raw, read_map(find_map(cut.map))).recording
                size = float(np.linalg.norm(recording.environment.magnetic_field))
                fields.append((name, recording.need("magnetometer").value, size))
    draw_fields(fields, figures / "fields.png")
    broad = next(one for one in SOURCES if one.key == "broad")
    say("sensors: against the cameras")
    cameras = {cut.label.split(",")[0]: _cameras(broad, number, real) for number, cut in enumerate(broad.cuts)}
    return {
        "logs": [_sensor_cells(one) for one in rows],
        "repairs": ", ".join(f"{name} {count}" for name, count in repairs.items() if count),
        "cameras": [row for name, pair in cameras.items() for row in _camera_cells(name, pair)],
        "DISTURBED": DISTURBED,
        **_camera_findings(cameras, load(broad, broad.cuts[1], real).whole.need("magnetometer")),
    }


def _cameras(source: Source, number: int, real: Path) -> dict[str, Linear]:
    """Return gyroscope and magnetometer of a trial against the cameras."""
    cut = source.cuts[number]
    measured = load(source, cut, real)
    assert measured.vector is not None
    attitude = raw_columns(real / source.folder / cut.raw, ["opt_qw", "opt_qx", "opt_qy", "opt_qz"])
    seen = {
        "gyroscope": measured.vector,
        "magnetometer": field_in_body(measured.whole.environment.magnetic_field, attitude),
    }
    # the cameras have a row for each of the gyroscope's; the magnetometer is slower
    rows = measured.whole.need("gyroscope").t
    found = {}
    for sensor, each in seen.items():
        samples = measured.whole.need(sensor)
        expected = np.column_stack([np.interp(samples.t, rows, column) for column in each.T])
        found[sensor] = against_cameras(samples.value, expected, samples.interval)
    return found


def _sensor_cells(one: Checked) -> list[str]:
    unit, scale = UNITS[one.sensor]
    stated = "not stated" if one.stated_noise is None else f"{one.stated_noise * scale:.2g}"
    return [
        one.log,
        one.sensor,
        str(one.rows),
        f"{one.rate:.4g}",
        str(one.lost),
        str(one.clipped),
        f"{one.noise * scale:.2g} {unit}, {stated}",
        "; ".join(one.lacks) or "nothing that shows here",
    ]


def _camera_cells(name: str, pair: Mapping[str, Linear]) -> list[list[str]]:
    rows = []
    for sensor, one in pair.items():
        unit, scale = UNITS[sensor]
        gain = np.diag(one.matrix)
        rows.append(
            [
                name,
                sensor,
                ", ".join(f"{each:.3f}" for each in gain),
                f"{np.max(np.abs(one.matrix - np.diag(gain))):.3f}",
                f"{', '.join(f'{each:+.1f}' for each in one.offset * scale)} {unit}",
                f"{1000.0 * one.late:.1f} ms",
                *(f"{each * scale:.1f} {unit}" for each in (one.apart, one.at_once, one.left)),
            ]
        )
    return rows


def _camera_findings(cameras: Mapping[str, Mapping[str, Linear]], field_of: Samples) -> Content:
    """Return what the cameras tell; ``field_of`` are the disturbed trial's readings of the field."""
    size = np.linalg.norm(field_of.value, axis=1)
    off = np.abs(size / np.median(size) - 1.0) > DISTURBED
    when = field_of.t[off] if off.any() else np.zeros(1)
    clean, disturbed = cameras.values()
    return {
        "names": list(cameras),
        "clean": clean,
        "disturbed": disturbed,
        "disturbed_share": float(np.mean(off)),
        "disturbed_span": (float(when[0]), float(when[-1])),
        "iron": [float(np.linalg.norm(pair["magnetometer"].offset)) for pair in (clean, disturbed)],
        "gains": [gain for pair in (clean, disturbed) for gain in np.diag(pair["gyroscope"].matrix)],
    }
