"""From what a search found to the answer: verdict, effects with evidence, places, noise, held-out figures, model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from scipy.stats import chi2 as chi2_law

from discsim.arrays import FloatArray
from discsim.disc import Aero, aero_key
from discsim.effects.catalogue import effect as catalogued
from discsim.effects.rig import AxisTilt
from discsim.model_file import Model, ModelEffect
from discsim.recording import Recording
from discsim.validation.diagnosis.answer.misstated import sentence
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect, in_parameters, parameters_of
from discsim.validation.diagnosis.candidates.continuous_fit import ContinuousFit, standard_errors
from discsim.validation.diagnosis.candidates.evidence import price
from discsim.validation.diagnosis.command_followed import not_as_commanded
from discsim.validation.diagnosis.consistency.driven import turning_of
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement
from discsim.validation.diagnosis.contradicted import contradicted_outcome
from discsim.validation.diagnosis.design.next_recording import BY_HAND, advise, confusions, in_words
from discsim.validation.diagnosis.detectors.even_losses import beside_losses, lost_as_well, rather_lost
from discsim.validation.diagnosis.leftovers import pure_noise
from discsim.validation.diagnosis.localisation import located_effect, located_unmodelled
from discsim.validation.diagnosis.partly import partly_explained
from discsim.validation.diagnosis.relaxed_fit.out_of_balance import moves_out
from discsim.validation.diagnosis.report.wording import telling_apart
from discsim.validation.diagnosis.result import (
    SMALLEST_P_VALUE,
    Advice,
    Candidate,
    Confusion,
    Diagnosis,
    Evidence,
    FitFigures,
    HeldOut,
    Law,
    Located,
    NamedEffect,
    NoiseNote,
    Outcome,
    Outlier,
    ParameterValue,
    Recalibration,
    Residuals,
)
from discsim.validation.diagnosis.selection.all_at_once import worth_of_each
from discsim.validation.diagnosis.selection.exchange import tried_without
from discsim.validation.diagnosis.selection.held_out import Choice, choices_without_each, heldout_chi2, heldout_gain
from discsim.validation.diagnosis.selection.search_state import Considered, Search, chi2_in
from discsim.validation.diagnosis.selection.uninflated_noise import capped, spoilt_groups, uninflated_noise
from discsim.validation.diagnosis.settings import settings_told
from discsim.validation.diagnosis.setup import suspected_fault
from discsim.validation.diagnosis.setup_effects import SetupAnswer, answer_of_setup
from discsim.validation.diagnosis.stages import Judged, Question
from discsim.validation.diagnosis.unknown_law.find import FoundLaw
from discsim.validation.diagnosis.verdict import recalibrations
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.noise import NoiseModel, chi_squared
from discsim.validation.identification.plants import plant_of
from discsim.validation.identification.stated_parameters import STATED_NAMES

__all__ = ["outcome_of", "reason_for"]

#: what tells lost samples from a slow clock where no motion does
_COUNT_THEM = "a number written beside each sample: one that was lost leaves a gap in them, and a slow clock none"
#: a parameter whose error is this share of the room it was given is not determined by the data
_UNDETERMINED = 0.2


def _named(
    found: Search,
    candidate: CandidateEffect,
    less: ContinuousFit,
    names: Sequence[str],
    choices: Sequence[Choice],
    advice: Mapping[tuple[str, str], Advice],
    errors: FloatArray,
) -> NamedEffect:
    """Return an effect as the answer has it; ``less`` is the fit without it, ``choices`` what others choose for it.

    ``errors`` (p,) are those of the final fit's numbers.
    """
    final = found.final
    values = {}
    width = {q.key: q.sigma for q in parameters_of(candidate)}
    for q, value, error in zip(final.fit.parameters, final.fit.at, errors, strict=True):
        if q.group != candidate.id or q.recordings != candidate.recordings:
            continue
        room = width.get(q.key, np.inf)
        known = np.isfinite(error) and error <= _UNDETERMINED * room
        if not known and abs(value - q.stated) < 3.0 * error:
            # where nothing shows it, a fit leaves it anywhere within its prior: the baseline says as much
            value = q.stated
        values[q.name] = ParameterValue(float(value), float(error) if known else None)
    if candidate.row.regular is not None:
        values = _of_regular(final, candidate)
    if _leans_unseen(found, candidate):
        values = {name: ParameterValue(one.value, None) for name, one in values.items()}
    values.update({name: ParameterValue(value, sd) for name, value, sd in candidate.fixed_values})
    for name, value in candidate.shape_grid.items():
        values.setdefault(name, ParameterValue(float(value), None))
    for name in candidate.row.untold.get(final.fit.plant.name, ()):
        values.setdefault(name, ParameterValue(candidate.row.sizes[name], None))
    gain = max(final.gain_upon(less), 0.0)
    k = len(parameters_of(candidate))
    bic = gain - k * float(np.log(max(final.fit.count, 2)))
    p = float(max(chi2_law.sf(gain, max(k, 1)), SMALLEST_P_VALUE))
    held = heldout_gain(found, candidate, choices)
    confused = []
    for rival in confusions(found, candidate):
        rival_bic = gain - rival.worse - len(parameters_of(rival.candidate)) * float(np.log(max(final.fit.count, 2)))
        told = advice.get((candidate.name, rival.candidate.name))
        words = BY_HAND if found.at_once else in_words(candidate.id, told)
        confused.append(Confusion(rival.candidate.id, float(rival_bic), words, told))
    instead = rather_lost(final.fit, candidate)
    if instead is None and (lost := lost_as_well(final.fit, candidate)) is not None:
        id, share, sd = lost
        confused.append(Confusion(id, bic, _COUNT_THEM, parameters={"fraction": ParameterValue(share, sd)}))
    where = None if candidate.recordings is None else tuple(names[i] for i in sorted(candidate.recordings))
    if instead is not None:
        id, share, sd = instead
        clock = Confusion(candidate.id, bic, _COUNT_THEM, parameters=values)
        sizes = {"fraction": ParameterValue(share, sd)}
        return NamedEffect(id, sizes, Evidence(bic, held, p), where, (clock, *confused))
    return NamedEffect(candidate.id, values, Evidence(bic, held, p), where, tuple(confused))


def _told_as(fit: Fit, candidate: CandidateEffect) -> str:
    """Return the id under which an effect of a fit is told: of a clock that stands for lost samples, theirs."""
    instead = rather_lost(fit, candidate)
    return candidate.id if instead is None else instead[0]


def _of_regular(final: ContinuousFit, candidate: CandidateEffect) -> dict[str, ParameterValue]:
    """Return an effect's parameters from the numbers that the fit moved in their place, errors to first order.

    None is determined where one that is infinite at the baseline is known to no better than half of itself.
    """
    row, fit = candidate.row, final.fit
    some = [k for k, q in enumerate(fit.parameters) if (q.group, q.recordings) == (candidate.id, candidate.recordings)]
    names, at = [fit.parameters[k].name for k in some], fit.at[some]
    covariance = np.full((len(some), len(some)), np.nan)
    if fit.covariance.shape[0] == len(fit.parameters):
        covariance = fit.covariance[np.ix_(some, some)]

    def sizes(numbers: FloatArray) -> FloatArray:
        return np.array([*in_parameters(row, dict(zip(names, numbers.tolist(), strict=True))).values()])

    steps = np.array([fit.parameters[k].step for k in some])
    slopes = np.stack([(sizes(at + d) - sizes(at - d)) for d in np.diag(steps)], axis=1) / (2.0 * steps)
    value, sd = sizes(at), np.sqrt(np.diag(slopes @ covariance @ slopes.T))
    infinite = [k for k, none in enumerate(row.sizes.values()) if not np.isfinite(none)]
    known = bool(np.all(sd[infinite] <= 0.5 * np.abs(value[infinite])))
    return {
        name: ParameterValue(float(v), float(e) if known else None)
        for name, v, e in zip(row.sizes, value, sd, strict=True)
    }


def _noise_notes(linears: Sequence[Linear], found: NoiseModel) -> list[NoiseNote]:
    """Return the sensors whose noise is not as stated: that of the fit which leaves the least beside noise."""
    notes = []
    for group, noise in found.items():
        channel = next(((linear, c) for linear in linears for c in linear.channels if c.group == group), None)
        if channel is None:  # what explains the mismatch leaves no reading of it
            continue
        stated = float(channel[0].sd[channel[1].rows][0])
        interval = float(np.median(np.diff(channel[0].t[channel[1].rows]))) if channel[1].index.size > 1 else 0.0
        n = sum(c.index.size for linear in linears for c in linear.channels if c.group == group)
        surprising = abs(noise.sd / stated - 1.0) > max(0.1, 5.0 / np.sqrt(2.0 * n)) if np.isfinite(stated) else True
        if surprising or noise.correlation > 0.15:
            slow = noise.memory(interval)
            notes.append(NoiseNote(group, stated if np.isfinite(stated) else None, float(noise.sd), slow))
    return notes


def _noise_beside(found: Search) -> list[NoiseNote]:
    """Return the sensors whose noise is not as stated where nothing explains the mismatch.

    The relaxed fit follows the data; a sensor that it leaves more than noise on says nothing of its noise.
    """
    spoilt = spoilt_groups(found)
    told = {group: noise for group, noise in found.relaxed_noise.items() if group not in spoilt}
    return _noise_notes(found.relaxed_fit.linears, told)


def _with_law(found: Search, law: FoundLaw) -> tuple[FitFigures, FitFigures, tuple[HeldOut, ...]]:
    """Return the figures of the baseline and of the fit with a law, and what recordings gain that were set aside."""
    left = {group: noise._replace(correlation=0.0) for group, noise in law.fitted.fit.noise.items()}
    reference = capped(left, uninflated_noise(found))
    rows = [linear.raw.size for linear in law.fitted.fit.linears]
    before, after = chi2_in(found.base, reference), chi2_in(law.fitted, reference)
    held = tuple(
        HeldOut(str(i), old / rows[i], new / rows[i], law.heldout[i]) for i, (old, new) in sorted(law.chi2.items())
    )
    sides = [sum(pair[side] for pair in law.chi2.values()) / sum(rows) if held else None for side in (0, 1)]
    return (
        FitFigures(before / found.base.fit.count, sides[0]),
        FitFigures(after / law.fitted.fit.count, sides[1]),
        held,
    )


def _leaves(law: FoundLaw, names: Sequence[str]) -> str:
    """Return in words how often what swings does so, and what is left once a law is in."""
    left = law.fitted.unmodelled()
    swinging = f"{law.swinging} " if law.swinging else ""
    if not left:
        return f"{swinging}With it nothing but noise is left."
    places = []
    for item in left:
        where = item.group.replace("gps.", "gps ")
        if item.recording is not None:
            where = f"{where} {item.axis} in {names[item.recording]} from {item.from_s:.2f} to {item.to_s:.2f} s"
        places.append(where)
    listed = "; ".join(dict.fromkeys(places[:3]))
    more = f" and {len(left) - 3} more places" if len(left) > 3 else ""
    return (
        f"{swinging}It explains {100.0 * law.share:.0f} % of the excess, and more than noise is left: {listed}{more}."
    )


def _reference(found: Search, unexplained: bool, counted: Agreement | None) -> NoiseModel:
    """Return the noise in which baseline and final fit stand; that of the rows themselves where these were ``counted``.

    What a misfit has inflated would make a good fit of a bad one.
    """
    final = {group: level._replace(correlation=0.0) for group, level in found.final.fit.noise.items()}
    white = uninflated_noise(found) if unexplained else final
    return white if counted is None else pure_noise(counted, white)


def _without_each(found: Search, candidates: Sequence[CandidateEffect]) -> dict[str, ContinuousFit]:
    """Return the fits without each named effect, by its name; what was found at once was weighed by algebra."""
    if not found.at_once:
        return {candidate.name: tried_without(found, candidate) for candidate in candidates}
    worth = worth_of_each(found.equations, candidates, found.own)
    return {name: replace(found.final, score=found.final.score + gain) for name, gain in worth.items()}


def _choices(found: Search, less: Mapping[str, ContinuousFit]) -> list[Choice]:
    """Return for each recording what the others choose."""
    if not found.at_once:
        return choices_without_each(found, less)
    return [{t.name: t for t in found.final.hypothesis.candidates} for _ in found.recordings]


def _figures(
    found: Search, unexplained: bool, choices: Sequence[Choice], reference: NoiseModel, set_aside: Sequence[Fit] = ()
) -> tuple[FitFigures, FitFigures, tuple[HeldOut, ...]]:
    final, equations = found.final, found.equations
    n = final.fit.count
    base = chi2_in(found.base, reference) / found.base.fit.count
    last = chi2_in(found.base if unexplained else final, reference) / n
    if equations.recordings < 2 or unexplained:
        return FitFigures(base, None), FitFigures(last, None), ()
    held = []
    before = after = 0.0
    for i in range(equations.recordings):
        rows = final.fit.linears[i].raw.size
        if set_aside:
            alone = set_aside[i].linears[0]
            new = chi_squared(alone, reference, alone.residual)
        else:
            new = max(heldout_chi2(found, final.hypothesis, i, choices[i]), 0.0)
        old = chi_squared(found.base.fit.linears[i], reference, found.base.residuals[i])
        before, after = before + old, after + new
        chosen = tuple(_told_as(final.fit, candidate) for candidate in choices[i].values() if candidate is not None)
        held.append(HeldOut(str(i), old / rows, new / rows, 0.5 * (old - new), chosen))
    return FitFigures(base, before / n), FitFigures(last, after / n), tuple(held)


def _residuals(found: Search, names: Sequence[str], unexplained: bool) -> list[Residuals]:
    shown = []
    after_fit = found.final
    noise = uninflated_noise(found) if unexplained else after_fit.fit.noise
    for i, name in enumerate(names):
        before_linear, after_linear = found.base.fit.linears[i], after_fit.fit.linears[i]
        for channel in after_linear.channels:
            other = next(
                (c for c in before_linear.channels if (c.sensor, c.axis) == (channel.sensor, channel.axis)), None
            )
            if other is None:
                continue
            sd = noise[channel.group].sd if channel.group in noise else 1.0
            count = int(max(channel.index[-1], other.index[-1])) + 1
            before, after, t = np.full(count, np.nan), np.full(count, np.nan), np.full(count, np.nan)
            before[other.index] = found.base.residuals[i][other.rows] / sd
            after[channel.index] = after_fit.residuals[i][channel.rows] / sd
            t[other.index], t[channel.index] = before_linear.t[other.rows], after_linear.t[channel.rows]
            some = np.isfinite(t)
            shown.append(Residuals(name, channel.sensor, channel.axis, t[some], before[some], after[some]))
    return shown


def _model(found: Search, effects: Sequence[NamedEffect], law: Law | None) -> Model:
    """Return the improved model: stated numbers as the final fit has them, effects, laws."""
    first = found.recordings[0]
    environment, disc, rig = first.environment, first.disc, first.rig
    values = {
        q.key: (float(v), float(e))
        for q, v, e in zip(found.final.fit.parameters, found.final.fit.at, standard_errors(found.final), strict=True)
        if q.recordings is None
    }
    if disc is not None and disc.aero is not None:
        aero = {name: values["aero", name][0] for name in Aero._fields if ("aero", name) in values}
        sigma = dict(disc.sigma)
        sigma.update({aero_key(name): values["aero", name][1] for name in aero})
        places = {"mass": "mass", "Ixx": "Ixx", "Izz": "Izz", "d": "diameter"}
        fields = {places[name]: values["disc", name][0] for name in places if ("disc", name) in values}
        disc = replace(disc, aero=disc.aero._replace(**aero), sigma=sigma, **fields)  # type: ignore[arg-type]
    if rig is not None:
        fields = {name: values["rig", name][0] for name in ("Izz", "viscous") if ("rig", name) in values}
        keys = {name: STATED_NAMES["rig", name] for name in fields}
        rig = replace(rig, **fields, sigma={**rig.sigma, **{keys[n]: values["rig", n][1] for n in fields}})
    if ("environment", "air_density") in values:
        environment = replace(environment, air_density=values["environment", "air_density"][0])
    carried = []
    for effect in effects:
        sizes = {name: item.value for name, item in effect.parameters.items()}
        sds = {name: item.sd for name, item in effect.parameters.items() if item.sd is not None}
        own = found.relaxed_fit.effects.user_effect(effect.id)
        sized = catalogued(effect.id, **sizes, **effect.setting) if own is None else own.sized(sizes)
        carried.append(ModelEffect(sized, sds, effect.recordings))
    return Model(
        environment,
        disc,
        rig,
        tuple(carried),
        () if law is None else tuple(one.for_model() for one in (law, *law.also)),
    )


def _next_recordings(found: Search, unexplained: bool, effects: Sequence[NamedEffect]) -> tuple[str, ...]:
    """Return what to record next, as sentences; what needs no further recording is said, too."""
    told = [telling_apart(effect.id, other) for effect in effects for other in effect.confused_with]
    if unexplained:
        told.append("Recordings that reach further in what the mismatch grows with: they settle the form of a law.")
    elif found.at_once:
        told.append(
            "What else could stand in for these effects was weighed by algebra alone. A throw that spins the other way "
            "tells a gyroscope's bias from its cross-axis error, one upside down a magnet's z from the field's."
        )
    elif not told and effects:
        told.append("Nothing more is needed to tell what is named from the other effects that were tried.")
    elif not told:
        told.append("Nothing more is needed: no effect is in doubt.")
    if len(found.recordings) == 1:
        told.append("A second recording, unlike the first: with one alone nothing can be set aside to test the answer.")
    return tuple(dict.fromkeys(told))


def reason_for(
    considered: Considered, named: Sequence[CandidateEffect], told: Mapping[str, str] = MappingProxyType({})
) -> str:
    """Return why a candidate that was refitted is ``named``, or is not; ``told`` are the ids under which some are."""
    id = considered.candidate.id
    if (instead := told.get(id, id)) != id:
        return f"named as {instead}"
    if id in told.values():
        return "named"
    if any(considered.candidate.id == candidate.id for candidate in named):
        return "named"
    return "worth less than its price" if considered.gain <= price(considered.candidate) else "another explains more"


def _candidates(found: Search, named: Sequence[CandidateEffect], names: Sequence[str]) -> tuple[Candidate, ...]:
    """Return what was refitted in the order of its gain, and why it is named or not."""
    return tuple(
        Candidate(
            c.candidate.id,
            float(c.gain),
            c.values,
            None if c.candidate.recordings is None else tuple(names[i] for i in sorted(c.candidate.recordings)),
            reason_for(c, named, {t.id: _told_as(found.final.fit, t) for t in named}),
        )
        for c in sorted(found.considered, key=lambda c: -c.gain)
        if np.isfinite(c.gain) and all(np.isfinite(v) for v in c.values.values())
    )


def outcome_of(judged: Judged, question: Question) -> Outcome:
    """Return the outcome of what was tried and judged."""
    tried = judged.tried
    ready, found = tried.prepared, tried.found
    setup = answer_of_setup(ready.setup, question.recordings, tried.fit, judged.verdict)
    rows, agreement = ready.rows, ready.agreement
    unsaid = () if rows is None or judged.verdict != "unexplained" else rows.sentences
    searched_for = _speed_searched_for(ready.meant) if judged.verdict == "unexplained" else ()
    perhaps = suspected_fault(ready.setup) if judged.verdict == "unexplained" else None
    suspicion = () if perhaps is None else (f"P{perhaps.sentence[1:]}.",)
    warnings = (*suspicion, *setup.warnings, *unsaid, *searched_for, *ready.notes)
    turning = None
    # where rows have to be counted, what sensors say of one another at the times as written is not so
    even = rows is None and (agreement is None or agreement.own_clock is None)
    if judged.verdict == "unexplained" and even and not plant_of(ready.meant[0]).path_known:
        turning = turning_of(question.recordings, question.names)
    if found is not None:
        told = () if turning is None else turning.sentences
        told += not_as_commanded(found, question.names) if judged.verdict == "unexplained" else _leaning(found)
        told += _out_of_balance(found)
        outcome = _outcome_of_search(judged, question, found, setup, (*told, *warnings), agreement)
    else:
        assert tried.contradiction is not None
        datasets, names, seed = question.datasets, question.names, question.seed
        outcome = contradicted_outcome(
            tried.contradiction, ready.meant, datasets, names, seed, warnings, agreement, turning
        )
    return _with_misstated(outcome, judged)


def _with_misstated(outcome: Outcome, judged: Judged) -> Outcome:
    """Return an outcome that says first which stated numbers would explain all were they others."""
    diagnosis, numbers = outcome.diagnosis, judged.misstated
    if not numbers:
        return outcome
    told = [sentence(some, instead=diagnosis.verdict != "unexplained") for some in numbers]
    return replace(outcome, diagnosis=replace(diagnosis, warnings=(*told, *diagnosis.warnings), misstated=numbers))


def _leans_unseen(found: Search, candidate: CandidateEffect) -> bool:
    """Tell whether an effect is a lean of a rig's axis to a side that no magnetometer tells, but by its size."""
    return candidate.row.type is AxisTilt and not any("magnetometer" in one.samples for one in found.recordings)


def _leaning(found: Search) -> tuple[str, ...]:
    """Return what to say of an axis that leans where no magnetometer tells which way."""
    lean = next((one for one in found.final.hypothesis.candidates if _leans_unseen(found, one)), None)
    if lean is None:
        return ()
    fit, errors = found.final.fit, standard_errors(found.final)
    # of the two parts one takes all of the lean, and the other stays as it began
    k = min((k for k, q in enumerate(fit.parameters) if q.group == lean.id), key=lambda k: errors[k])
    size, sd = np.degrees([abs(fit.at[k]), errors[k]])
    return (
        f"no magnetometer tells where north is: the rig's axis leans by {size:.3g} ± {sd:.1g} deg, and nobody knows "
        "which way. It is written as a tilt to the north whose parts nothing determines.",
    )


def _out_of_balance(found: Search) -> tuple[str, ...]:
    """Return what to say of a body that moments fixed in it turn, about which the catalogue of its plant is silent."""
    if not all(one.unbalanced for one in found.final.fit.trajectories):
        return ()
    moves = " and moves" if moves_out(found.relaxed_fit) else ""
    return (
        "the gyroscope's x and y lean as only a body out of balance does, otherwise in each throw: its centre of mass "
        f"lies beside the middle{moves}. Moments fixed in the body are followed and have no name here; look for a "
        "battery or a board that is off the middle or loose, and compare accel.position_offset.",
    )


def _speed_searched_for(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """Return what to state where a flight's velocity had to be searched for: a search may end beside the true one."""
    if not plant_of(recordings[0]).air_modelled:
        return ()
    blind = [
        one.name
        for one in recordings
        if not {"gps", "track"} & set(one.samples) and (one.release is None or one.release.velocity is None)
    ]
    if not blind:
        return ()
    return (
        f"{', '.join(blind)}: neither GPS, a track nor a stated release tells how fast the disc was. Its velocity was "
        "searched for and may have been missed: state velocity_ned_m_s with its sigma in [release] of recording.toml, "
        "as a radar or a video tells it.",
    )


def _outcome_of_search(
    judged: Judged,
    question: Question,
    found: Search,
    setup: SetupAnswer,
    warnings: tuple[str, ...],
    agreement: Agreement | None,
) -> Outcome:
    names, law, unexplained = question.names, judged.law, judged.verdict == "unexplained"
    candidates = () if unexplained else found.final.hypothesis.candidates
    if candidates:
        question.progress("asking what to record next", 4, 5)
    advice = advise(found, names, question.plans) if candidates else {}
    less = _without_each(found, candidates)
    choices = [] if unexplained else _choices(found, less)
    # where nothing explains it, the answer is about the baseline, or about the law that stands for all
    best = found if not unexplained else found.at_base() if law is None else replace(found, final=law.fitted)
    errors = beside_losses(found.final.fit, candidates, standard_errors(found.final))
    named = tuple(_named(found, one, less[one.name], names, choices, advice, errors) for one in candidates)
    partly = partly_explained(found, names) if unexplained and law is None else ()
    rows = None if unexplained else judged.tried.prepared.rows
    counted = () if rows is None else rows.refined(found.final.fit).effects()
    places = () if rows is None else rows.located(max(float(one.nodes[-1]) for one in found.final.fit.trajectories))
    reference = _reference(found, unexplained, None if judged.tried.prepared.rows is None else agreement)
    missed = 0.0 if rows is None else rows.excess(reference, found.final.fit.count)
    moved = recalibrations(best)
    aside = judged.set_aside
    baseline, final, held = (
        _figures(found, unexplained, choices, reference, aside) if law is None else _with_law(found, law)
    )
    diagnosis = Diagnosis(
        question.datasets,
        found.recordings[0].plant,
        question.seed,
        judged.verdict,
        _raised(baseline, setup.excess + missed),
        final,
        (*setup.located, *places, *_located(found, candidates, names, unexplained, moved)),
        (*setup.effects, *counted, *named),
        # what is missing, or put into a law that only resembles it, moves them by more than any noise
        {name: replace(item, sd=None) for name, item in moved.items()} if unexplained else moved,
        None if law is None else replace(law.law, also=law.also, leaves=_leaves(law, names)),
        tuple(
            _noise_beside(found)
            if unexplained and law is None
            else _noise_notes(best.final.fit.linears, best.final.fit.noise)
        ),
        tuple(replace(item, recording=names[int(item.recording)]) for item in held),
        tuple(Outlier(names[i], s, a, t, d) for i, s, a, t, d in found.outliers),
        tuple(dict.fromkeys((*setup.next_recordings, *_next_recordings(found, unexplained, named)))),
        (*warnings, *(one.text for one in partly)),
        agreement,
        partly,
        judged.left,
    )
    model = _model(best, (*named, *counted, *setup.effects), diagnosis.law)
    shown = _residuals(best, names, unexplained and law is None)
    return Outcome(diagnosis, model, tuple(shown), _candidates(found, candidates, names), settings_told())


def _raised(fit: FitFigures, excess: float) -> FitFigures:
    """Return the figures of a baseline of which every reading misses more of what is written."""
    held = fit.heldout_chi2_per_sample
    return FitFigures(fit.chi2_per_sample + excess, None if held is None else held + excess)


def _located(
    found: Search,
    candidates: Sequence[CandidateEffect],
    names: Sequence[str],
    unexplained: bool,
    moved: Mapping[str, Recalibration],
) -> list[Located]:
    """Return where the recordings part from the baseline: by each effect, by a stated number that is off, or by all."""
    if unexplained:
        return located_unmodelled(found, names)
    if not candidates and any(item.beyond for item in moved.values()):
        worst = located_unmodelled(found, names)[:1]
        return [replace(place, text=f"{place.text}; a stated number is off") for place in worst]
    return [place for candidate in candidates for place in located_effect(found, candidate, names)]
