"""The page of the documentation on what a diagnosis says of measured recordings."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.files import write_text
from discsim.model_file import Model
from discsim.recording import Recording, Samples
from validation.diagnosis.consistency.spin_agreement import agreement_of
from validation.diagnosis.report.consistency_tables import tables_of
from validation.importing import find_map, import_recording, read_map
from validation.reporting.run import package_version
from validation.studies.golf_throws.prediction import THROWS
from validation.studies.real_diagnosis.charts import draw_fields, draw_golf, draw_rows
from validation.studies.real_diagnosis.flatball import Rows, rows_of
from validation.studies.real_diagnosis.golf_causes import (
    APART,
    CAUSES,
    GROUND,
    LEFT,
    NONE,
    CauseHeldOut,
    Throw,
    held_out,
    without_cause,
)
from validation.studies.real_diagnosis.golf_flight import flown
from validation.studies.real_diagnosis.runs import Found, diagnosed, diagnosis_digest
from validation.studies.real_diagnosis.sensors import Checked, Linear, against_cameras, checked_log, field_in_body
from validation.studies.real_recordings.sources import SOURCES, Source, load, raw_columns

__all__ = ["write_page"]

Say = Callable[[str], None]
GOLF = "shotshaper-dd2-drone-tracked-throws"
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
    sections = [_flatball(real, figures, work, seed, say), _golf(real, figures, work, seed, say)]
    sections.append(_sensors(real, figures, say))
    write_text(page, "\n".join([_lead(seed), *sections]))
    return page


def _lead(seed: int) -> str:
    return "\n".join(
        [
            "# Real recordings, diagnosed",
            "",
            _wrapped(
                "What [a diagnosis](diagnosing.md) can say of measured data, and what such data lack for it. Every "
                "number in tables and findings is computed by the command below from the recordings in "
                "`DISCSIM_RECORDINGS` (or `--recordings DIR`). What spin rate the methods see in the same recordings "
                "stands in [Real recordings](real-recordings.md)."
            ),
            "",
            "```sh",
            "discsim study real-diagnosis" + (f" --seed {seed}" if seed else ""),
            "```",
            "",
            f"Made with discsim {package_version()}, diagnosis `{diagnosis_digest()[:12]}`, seed {seed}.",
            "",
        ]
    )


# --------------------------------------------------------------------------------------------------- flatball


def _flatball(real: Path, figures: Path, work: Path, seed: int, say: Say) -> str:
    source = next(one for one in SOURCES if one.key == "flatball")
    throws = {cut.label.split(",")[0]: load(source, cut, real).recording for cut in source.cuts}
    answer = diagnosed(throws, work / "flatball", say, seed)
    rows = {name: rows_of(throw) for name, throw in throws.items()}
    draw_rows(throws, rows, figures / "flatball.png")
    disc = next(iter(throws.values())).disc
    assert disc is not None
    literature = disc.Izz / disc.Ixx
    as_filed = [1.0 + (literature - 1.0) * one.by_wobble for one in rows.values()]
    as_turned = [1.0 + (literature - 1.0) * one.by_wobble / one.by_field for one in rows.values()]
    decays = [one.spin["gyroscope"] / one.by_field for one in rows.values()]
    entries = (
        "Nothing says how long a row is; the source's software and the import take 10 ms. Gyroscope and centripetal "
        "force need no time and agree with one another ([Real recordings](real-recordings.md)); the field turns by the "
        "rate times the time between two rows, so each single row tells its own length.",
        f"**Rows do not last longer, some of them are late.** Most last "
        f"{_range([1e3 * one.usual for one in rows.values()], '.1f')} ms, close to the IMU's stated 104 Hz (9.6 ms), "
        f"in all throws: two of the ticks above. {_range([100.0 * one.late for one in rows.values()], '.0f')} % are "
        "late, most of these by one or two ticks more (figure, right). The means of "
        f"{_range([10.0 * one.by_field for one in rows.values()], '.1f')} ms follow, and 003-rf differs from the "
        f"others by its share of late rows alone ({100.0 * rows['003-rf'].late:.0f} %). So a rate of the clock, the "
        "same in all rows, mends the count of turns and not the phase: at this spin one late row is a tenth of a turn. "
        "Whether the rows are late or only the field's readings in them, a steady spin cannot tell.",
        f"The wobble, with the literature's Izz/Ixx of {literature:.3f} (a bare disc), asks for rows of "
        f"{_range([10.0 * one.by_wobble for one in rows.values()], '.1f')} ms: also longer than 10 ms in each throw. "
        f"At 10 ms it would need Izz/Ixx of {_range(as_filed, '.2f')}, and no rigid body has more than 2; at the mean "
        f"row by the field {_range(as_turned, '.2f')}. It is a weak witness: the line of a wobble that dies within a "
        "second is wide, and a longer or shorter span moves it by a tenth and more.",
        f"The spin then decays by {_range(decays, '.3f')} 1/s (gyroscope), where rows of 10 ms would say "
        f"{_range([one.spin['gyroscope'] for one in rows.values()], '.3f')} 1/s: any C_Nr fitted to the file as it is "
        "comes out too large by the length of a row. The magnetometer's own decay scatters more, since the field's "
        "phase takes up how the axis turns.",
    )
    lines = [
        "## The throws of an instrumented Ultimate disc",
        "",
        *_answer_lines(answer, list(throws)),
        "",
        *_agreement_lines(throws),
        "### How long is a row?",
        "",
        _table(
            (
                "throw",
                "most rows, ms",
                "late rows",
                "mean row by the field, ms",
                "by the wobble, ms",
                "wobble, rad/s",
                "it dies by, 1/s: at 10 ms, corrected",
                "spin dies by, 1/s: gyroscope",
                "accelerometer",
                "magnetometer",
            ),
            [_row_cells(name, one) for name, one in rows.items()],
        ),
        "",
        _wrapped(
            "Decays are given for rows of 10 ms and, after the comma, for the mean row by the field; those of "
            "the spin leave out the first half second."
        ),
        "",
        "![Spin by three sensors for rows as filed and corrected, and each row's length](real-diagnosis/flatball.png)",
        "",
        *(_wrapped(entry, "- ") for entry in entries),
        "",
    ]
    return "\n".join(lines)


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


def _answer_lines(answer: Found, names: Sequence[str]) -> list[str]:
    """Return what `discsim diagnose` says of all throws together, and on those set aside."""
    effects, law = answer.answer["effects"], answer.answer["law"]
    before, after = answer.chi2("baseline"), answer.chi2("final")
    said = (
        f"`discsim diagnose` on all {len(names)} throws together says **{answer.verdict}**; χ² per reading is "
        f"{before:.3g} for the baseline and {after:.3g} for the final model."
    )
    if not effects:
        said += " No effect is named"
        said += "." if law is not None else ", and no law that would hold on throws set aside."
    lines = [_wrapped(said), ""]
    if effects:
        lines += [
            _table(("effect", "recordings", "parameters", "gain in BIC"), [_effect_cells(e) for e in effects]),
            "",
        ]
    if law is not None:
        sizes = ", ".join(f"{name} = {_pm(one)}" for name, one in law["coefficients"].items())
        lines += [
            _wrapped(
                f"Its law for what remains: `{law['text']}` on `{law['target']}` ({sizes}), with a gain in log "
                f"likelihood of {law['heldout_delta_log_likelihood']} on throws that did not make it."
            ),
            "",
        ]
    if answer.answer["heldout"]:
        header = ("throw set aside", "χ² per reading, baseline", "final", "gain in log likelihood")
        lines += [_table(header, [_held_cells(one) for one in answer.answer["heldout"]]), ""]
    places = [one["text"] for one in answer.answer["located"][:3]]
    if places:
        lines += ["Where they part most:", "", *(_wrapped(text, "- ") for text in places), ""]
    return lines[:-1]


def _agreement_lines(throws: Mapping[str, Recording]) -> list[str]:
    """Return which sensors agree, and what reconciles them on throws that took no part."""
    found = agreement_of(list(throws.values()), list(throws))
    if found is None or not found.contradiction:
        return []
    lines = ["### Which sensors agree", "", *(_wrapped(text, "- ") for text in found.sentences), ""]
    for caption, header, rows in tables_of(found):
        lines += [f"*{caption}*", "", _table(header, rows), ""]
    return lines


def _effect_cells(one: Mapping[str, Any]) -> list[str]:
    where = one["recordings"] if isinstance(one["recordings"], str) else ", ".join(one["recordings"])
    sizes = ", ".join(f"{name} {_pm(value)}" for name, value in one["parameters"].items())
    return [f"`{one['id']}`", where, sizes, f"{one['evidence']['delta_bic']:.0f}"]


def _held_cells(one: Mapping[str, Any]) -> list[str]:
    return [
        one["recording"],
        f"{one['baseline_chi2_per_sample']:.3g}",
        f"{one['final_chi2_per_sample']:.3g}",
        f"{one['delta_log_likelihood']:+.0f}",
    ]


def _pm(value: Mapping[str, Any]) -> str:
    return f"{value['value']:.4g}" + ("" if value["sd"] is None else f" ± {value['sd']:.1g}")


# ------------------------------------------------------------------------------------------------------- golf


def _golf(real: Path, figures: Path, work: Path, seed: int, say: Say) -> str:
    shipped = read_map(find_map("shotshaper"))
    throws = {
        name: Throw(import_recording(real / GOLF / f"{name}.tsv", shipped).recording, shipped.throws[name])
        for name in THROWS
    }
    answer = diagnosed({name: throw.recording for name, throw in throws.items()}, work / "golf", say, seed)
    stated = {
        name: flown(throw.recording, Model(throw.recording.environment, throw.recording.disc))
        for name, throw in throws.items()
    }
    say("golf throws: without any cause")
    plain, found = without_cause(throws), []
    for cause in CAUSES:
        say(f"golf throws: {cause.name}")
        found.append(held_out(cause, throws, plain))
    none = found[0]
    best = min((one for one in found if one.together.cause is not NONE), key=lambda one: one.together.merit)
    draw_golf(throws, stated, none.together, best, figures / "golf.png")
    names = list(throws)
    nearer = [name for name in names if best.landings[name].distance < stated[name].distance]
    sizes = [best.others[name].x for name in names]
    moves = none.together
    apart = (max(sizes) - min(sizes)) / max(one.sd for one in best.others.values())
    lands_nearer = [none.landings[name].distance < stated[name].distance for name in names]
    farther = [name for name in names if name not in nearer]
    worst = max(names, key=lambda name: best.landings[name].distance - stated[name].distance)
    lines = [
        "## Three tracked golf throws",
        "",
        _wrapped(
            "A drone filmed three throws of a distance driver in plan; release and wind were measured with stated "
            "uncertainties ([how far the baseline is off](golf-throws.md)). No sensor flew along. Three throws of one "
            "evening by one thrower are few: what follows can refute a cause, hardly establish one."
        ),
        "",
        *_answered(answer, _scatter(throws), max(none.together.rms.values())),
        "",
        "### Single causes, one by one",
        "",
        _wrapped(
            "A plain least-squares fit beside the diagnosis. Free are, each with its stated uncertainty as a prior, "
            "speed, pitch, yaw, roll, nose, spin, wobble and height of each throw and the wind they share; and one "
            f"cause that all three share. Track points every {APART:g} s count with {LEFT:g} m each (what no such "
            f"cause describes is far larger than the track's noise), and the track's end as a height of 0 m within "
            f"{GROUND:g} m."
        ),
        "",
        *(
            _wrapped(entry, "- ")
            for entry in (
                "*gain*: by how much the cause lowers the sum of squares, in which each move of a stated number "
                "counts by its sigma. A number drawn by chance gains about 1 if what is left is independent; along a "
                "track it is not, so these gains overstate the evidence.",
                "*from the other two*: its size without throw1, throw6 and throw15. A cause that is real has one size.",
                "*lands off*: that throw's touch-down less its track's end, flown from the release as stated with what "
                "the other two throws say of the cause and the wind.",
                "*held-out gain*: the same as *gain* on the throw that took no part, with its own release fitted to "
                "it and the cause as the other two have it. Negative: it does better without.",
            )
        ),
        "",
        _table(
            ("cause", "size, all three", "gain", "from the other two", "lands off, m", "held-out gain"),
            [_cause_cells(one, none, names) for one in sorted(found, key=lambda one: one.together.merit)],
        ),
        "",
        "As stated, with nothing fitted, they land "
        + ", ".join(f"{stated[name].distance:.1f}" for name in names)
        + f" m off ({', '.join(names)}).",
        "",
        "![Tracks and flights of the three throws](real-diagnosis/golf.png)",
        "",
        "What is found:",
        "",
        *(
            _wrapped(entry, "- ")
            for entry in (
                "**Release and wind alone can bring all three flights onto their tracks**: with no cause at all the "
                f"fitted flights stay within {_range([moves.rms[name] for name in names], '.1f')} m (rms in plan), "
                f"and the largest move of a release condition is {max(moves.moves.values()):.1f} of its sigma. So the "
                "misses of ten metres are not proof of missing physics; but the wind has to move by "
                f"{moves.wind[0]:+.1f} and {moves.wind[1]:+.1f} of its sigmas (along and across), the second of which "
                "is stated as 0.17 m/s, and hardly is that small.",
                f"The cause that gains most is *{best.together.cause.name}*: {best.together.x:+.3g} ± "
                f"{best.together.sd:.1g}. Two throws at a time put it at {', '.join(f'{x:+.2g}' for x in sizes)}: "
                + ("that is not one number." if apart > 3.0 else "within their errors these agree."),
                f"Flown with it, {', '.join(nearer) or 'no throw'} would land nearer than as stated"
                + (f", and {', '.join(farther)} farther" if farther else "")
                + f"; the worst is {worst}, {best.landings[worst].distance:.1f} m off instead of "
                f"{stated[worst].distance:.1f} m. "
                + (
                    "Leave-one-throw-out does not support it, and so nothing is named."
                    if farther or min(best.gains.values()) < 0.0
                    else "Leave-one-throw-out supports it; three throws of one evening are too few to name it."
                ),
                "The wind as the other two throws have it, with no cause and the release as stated, lands them "
                + ", ".join(f"{none.landings[name].distance:.1f}" for name in names)
                + " m off: what two throws say of it carries over to the third "
                + ("in each case." if all(lands_nearer) else f"in {sum(lands_nearer)} of {len(names)} cases."),
                "What would decide: heights (a second camera), a logger on board for spin and attitude at release, "
                "the wind where the disc flies; and ten throws, half of them against the wind.",
            )
        ),
        "",
    ]
    return "\n".join(lines)


def _answered(answer: Found, noise: float, reached: float) -> list[str]:
    """Return what `discsim diagnose` says of the golf throws.

    ``noise`` is the scatter of the tracks as stated, ``reached`` what a plain fit leaves, m.
    """
    named = ", ".join(f"`{one['id']}`" for one in answer.answer["effects"])
    law = answer.answer["law"]
    said = f"`discsim diagnose` on all three says **{answer.verdict}**"
    said += f": {named}." if named else ", and names nothing."
    if answer.verdict == "unexplained" and law is None:
        said += " It offers no law either: none holds on the throws that did not make it."
    before, after = answer.chi2("baseline"), answer.chi2("final")
    left = noise * after**0.5
    said += (
        f" χ² per reading is {before:.0f} for the baseline and {after:.0f} for the final model, in the {noise:g} m "
        f"that the tracks scatter by: {left:.1f} m are left."
    )
    if left > 2.0 * reached:
        said += (
            f" That is no verdict to rely on: the plain fit below moves the same releases and the same wind and leaves "
            f"{reached:.1f} m. It asks for less: {LEFT:g} m at each point instead of the scatter of the track, every "
            f"{APART:g} s, with the track's end on the ground. So the diagnosis has not found where the stated "
            "releases would fit best. Its search expects a sensor on board that tells attitude and spin; from two "
            "coordinates of a track it stops short. It errs on the silent side: nothing false is named."
        )
    elif not named:
        said += (
            " That is more than twenty times what the tracks scatter by, and no effect of the catalogue, common to all "
            "three, takes it away: what is left differs from throw to throw."
            if left > 20.0 * noise
            else " What is left no effect of the catalogue takes away."
        )
    return [_wrapped(said)]


def _scatter(throws: Mapping[str, Throw]) -> float:
    """Return the largest stated noise of the tracks, m."""
    return max(throw.recording.sheets["track"].noise_rms or 0.0 for throw in throws.values())


def _cause_cells(one: CauseHeldOut, none: CauseHeldOut, names: Sequence[str]) -> list[str]:
    fit, free = one.together, one.together.cause is not NONE
    return [
        fit.cause.name,
        f"{fit.x:+.3g} ± {fit.sd:.1g}" if free else "",
        f"{none.together.merit - fit.merit:.1f}" if free else "",
        ", ".join(f"{one.others[name].x:+.2g}" for name in names) if free else "",
        ", ".join(f"{one.landings[name].distance:.1f}" for name in names),
        ", ".join(f"{one.gains[name]:+.1f}" for name in names) if free else "",
    ]


# ---------------------------------------------------------------------------------------------------- sensors


def _sensors(real: Path, figures: Path, say: Say) -> str:
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
    lines = [
        "## What each sensor lacks",
        "",
        _wrapped(
            "Whole logs, by the shipped maps, judged from the readings and the stated sheet alone. *Noise* is the "
            "scatter of single readings in the quietest second (robust third differences, rms over the axes; 0 is "
            "below the resolution), beside what the map states. A diagnosis estimates what is not stated, but then "
            "cannot tell a noisy sensor from a small effect, and weighs one sensor against another by guess."
        ),
        "",
        _table(
            ("log", "sensor", "samples", "rate, Hz", "lost", "at range", "noise, stated", "lacks"),
            [_sensor_cells(one) for one in rows],
        ),
        "",
        _wrapped(
            "Repairs on import: " + ", ".join(f"{name} {count}" for name, count in repairs.items() if count) + ". "
            "Lynx has neither gyroscope nor accelerometer, so nothing on board can contradict its magnetometer; in no "
            "log has any sensor a stated position but the Ultimate disc's accelerometer."
        ),
        "",
        "![How often a magnetometer's readings have which size](real-diagnosis/fields.png)",
        "",
        _wrapped(
            "A calibrated magnetometer reads one size whatever its attitude: a narrow peak at the dashed line. None "
            "of these rockets and discs carries one; only the undisturbed BROAD trial comes near. The program's "
            "methods fit the iron as they go; for a diagnosis it is a shared unknown (`mag.hard_iron`, "
            "`mag.soft_iron`) that the throws themselves must fix."
        ),
        "",
        "### Motion capture: sensors against cameras",
        "",
        _wrapped(
            "The BROAD trials are turned by hand, which no plant describes (a hand's moments are unknown), so "
            "`discsim diagnose` has nothing to say there. The cameras allow a direct check: the gyroscope as a linear "
            "function of the optical rate, the magnetometer of the map's field turned into the sensor."
        ),
        "",
        _table(
            (
                "trial",
                "sensor",
                "gain, x y z",
                "largest cross term",
                "offset",
                "late by",
                "off as read",
                "linear",
                "linear and late",
            ),
            [row for name, pair in cameras.items() for row in _camera_cells(name, pair)],
        ),
        "",
        *_camera_findings(cameras, load(broad, broad.cuts[1], real).whole.need("magnetometer")),
        "",
    ]
    return "\n".join(lines)


def _cameras(source: Source, number: int, real: Path) -> dict[str, Linear]:
    """Return gyroscope and magnetometer of a trial against the cameras."""
    cut = source.cuts[number]
    measured = load(source, cut, real)
    assert measured.vector is not None
    attitude = raw_columns(real / source.folder / cut.raw, ["opt_qw", "opt_qx", "opt_qy", "opt_qz"])
    expected = {
        "gyroscope": measured.vector,
        "magnetometer": field_in_body(measured.whole.environment.magnetic_field, attitude),
    }
    return {
        sensor: against_cameras(measured.whole.need(sensor).value, each, measured.whole.need(sensor).interval)
        for sensor, each in expected.items()
    }


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


def _camera_findings(cameras: Mapping[str, Mapping[str, Linear]], field_of: Samples) -> list[str]:
    """Return what the cameras tell; ``field_of`` are the disturbed trial's readings of the field."""
    size = np.linalg.norm(field_of.value, axis=1)
    off = np.abs(size / np.median(size) - 1.0) > DISTURBED
    disturbed_share, when = float(np.mean(off)), field_of.t[off] if off.any() else np.zeros(1)
    span = (float(when[0]), float(when[-1]))
    (clean, first), (disturbed, second) = cameras.items()
    field, other = first["magnetometer"], second["magnetometer"]
    gyros = [first["gyroscope"], second["gyroscope"]]
    iron = [float(np.linalg.norm(one.offset)) for one in (field, other)]
    explained = other.left < 0.5 * other.apart
    entries = (
        f"The magnetometer of {clean} is best explained {1000.0 * field.late:.1f} ms late, its gyroscope "
        f"{1000.0 * gyros[0].late:.1f} ms; in {disturbed} {1000.0 * other.late:.1f} and {1000.0 * gyros[1].late:.1f} "
        "ms (to 3.5 ms, one row). A lateness that the stamps do not tell costs "
        f"{np.degrees(gyros[0].at_once):.0f} deg/s of {clean}'s gyroscope, and {np.degrees(gyros[0].left):.1f} deg/s "
        "are left without it.",
        f"The magnet of {disturbed} shows as an offset of {iron[1]:.1f} uT ({clean}: {iron[0]:.1f} uT). Offset, matrix "
        f"and lateness together leave {other.left:.1f} of {other.apart:.1f} uT"
        + (
            "."
            if explained
            else ": **no constant iron explains it**. A magnet fixed to the sensor would be a constant offset, but the "
            f"field's size is off by more than {100 * DISTURBED:.0f} % in {100.0 * disturbed_share:.1f} % of the "
            f"rows only, between {span[0]:.1f} and {span[1]:.1f} s of the cut: the magnet comes and goes. "
            "`mag.hard_iron` would be the wrong name."
        ),
        f"Gyroscope over optical rate is {_range([g for one in gyros for g in np.diag(one.matrix)], '.3f')} on the six "
        "axes; a smaller error of scale than that spread cannot be told against these cameras.",
    )
    return [_wrapped(entry, "- ") for entry in entries]


# ------------------------------------------------------------------------------------------------------- text


def _range(values: Sequence[float], form: str) -> str:
    low, high = f"{min(values):{form}}", f"{max(values):{form}}"
    return low if low == high else f"{low} to {high}"


def _wrapped(text: str, bullet: str = "") -> str:
    return textwrap.fill(
        text,
        118,
        initial_indent=bullet,
        subsequent_indent=" " * len(bullet),
        break_long_words=False,
        break_on_hyphens=False,
    )


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(f"| {' | '.join(line)} |" for line in (header, ["---"] * len(header), *rows))
