"""A fitted law in words and as a formula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from discsim.arrays import FloatArray
from discsim.law import AIR_SHARE, WIND_TARGETS
from discsim.validation.diagnosis.result import Law, ParameterValue
from discsim.validation.diagnosis.settings import SELECTION
from discsim.validation.diagnosis.unknown_law.motion_law import PLACE
from discsim.validation.diagnosis.unknown_law.terms import SIDES, SensorTerm
from discsim.validation.identification.gauss_newton import Fit
from discsim.validation.identification.normal_equations import inverse_of
from discsim.validation.identification.plants.law_terms import Term

__all__ = ["as_laws", "as_sensor_laws", "swinging_in_words"]


def as_sensor_laws(terms: Sequence[SensorTerm], fit: Fit, heldout: float | None) -> tuple[tuple[Law, ...], str]:
    """Return sensor terms as laws, that of the strongest axis first, and their shapes in words.

    None of them is a law where no reading tells one, as where the fit's covariance is not known.
    """
    place = {q.name: j for j, q in enumerate(fit.parameters) if q.group == "term"}
    parts: dict[str, list[_Part]] = {}
    notes = []
    for i, term in enumerate(terms):
        s = place[f"{i}.shape"]
        notes.append(f"{term.kind} of the {term.sensor}, {fit.at[s]:.4g} ± {float(np.sqrt(fit.covariance[s, s])):.2g}")
        prefix = f"{i}."
        axes = dict.fromkeys(name[len(prefix) :].partition(".")[0] for name in place if name.startswith(prefix))
        for axis in axes:
            if axis != "shape" and (part := _part(term, i, axis, place, fit)) is not None:
                parts.setdefault(f"{term.sensor}.{axis}", []).append(part)
    if not parts:
        return (), ""
    significant = 4.0 * SELECTION.per_parameter
    strongest = max(max(part.chi2 for part in mine) for mine in parts.values())
    laws = []
    for target, mine in sorted(parts.items(), key=lambda item: -max(part.chi2 for part in item[1])):
        kept = [part for part in mine if part.chi2 > significant or part.chi2 == strongest]
        if not kept:
            continue
        coefficients: dict[str, ParameterValue] = {}
        text = ""
        for k, part in enumerate(kept):
            mark = str(k + 1) if len(kept) > 1 else ""
            coefficients |= {name + mark: value for name, value in part.coefficients.items()}
            text += (" + " if text else "") + part.text.format(**{name: name + mark for name in part.coefficients})
        laws.append(Law(text, target, coefficients, heldout))
    return tuple(laws), "; ".join(notes)


@dataclass(frozen=True)
class _Part:
    """What one term does to one axis: its text with names of coefficients in braces, and how far it is from nothing."""

    text: str
    coefficients: Mapping[str, ParameterValue]
    chi2: float


def _part(term: SensorTerm, i: int, axis: str, place: Mapping[str, int], fit: Fit) -> _Part | None:
    """Return what the i-th term does to an axis, or None where no reading tells it."""
    C, s = fit.covariance, place[f"{i}.shape"]
    shape, shape_sd = float(fit.at[s]), float(np.sqrt(C[s, s]))
    of = ".0" if term.own else ""  # of the first recording, where each has its own
    js = [place[f"{i}.{axis}.{j}{of}"] for j in range(term.size)]
    values, block = fit.at[js], C[np.ix_(js, js)]
    if not np.any(np.diag(block) > 0):
        return None
    chi2 = float(values @ inverse_of(block) @ values)
    sds = [float(sd) for sd in np.sqrt(np.diag(block))]
    c = float(values[0])
    if term.kind == "turning":
        coefficients = {
            "a": ParameterValue(c, sds[0]),
            "b": ParameterValue(float(values[1]), sds[1]),
            "k": ParameterValue(shape, shape_sd),
        }
        return _Part("{a} * cos({k} * psi) + {b} * sin({k} * psi)", coefficients, chi2)
    if term.kind == "swinging":
        return _swing(values, block, ParameterValue(shape, shape_sd), chi2)
    if term.kind in ("warming", "settling", "play"):
        symbol = axis.partition("_")[0]
        scale = term.unit**-2 if term.kind == "settling" else 1.0
        name, text = {
            "warming": ("tau", "{c} - {c} * exp(-t/{tau})"),
            "settling": ("tau", "{c} * r^2 - {c} * r^2 * exp(-t/{tau})"),
            "play": ("w", f"{{c}} * play({symbol}, {{w}}) - {{c}} * {symbol}"),
        }[term.kind]
        coefficients = {"c": ParameterValue(c * scale, sds[0] * scale), name: ParameterValue(shape, shape_sd)}
        return _Part(text, coefficients, chi2)
    symbol = {"drift": "t", "rate": "r", "reading": axis.partition("_")[0]}[term.kind]
    scale = term.unit**-shape
    row = np.array([scale, -c * scale * log(term.unit)])
    pair = C[np.ix_([js[0], s], [js[0], s])]
    text = f"{{c}} * |{symbol}|^{{n}}" + (f" * sign({symbol})" if symbol != "t" else "")
    coefficients = {
        "c": ParameterValue(c * scale, float(np.sqrt(row @ pair @ row))),
        "n": ParameterValue(shape, shape_sd),
    }
    return _Part(text, coefficients, chi2)


def _swing(values: FloatArray, block: FloatArray, w: ParameterValue, chi2: float) -> _Part:
    """Return what swings as a sum of those of its lines that are told, the strongest where none is."""
    pairs = [slice(2 * k, 2 * k + 2) for k in range(len(SIDES))]
    told = [float(values[pair] @ inverse_of(block[pair, pair]) @ values[pair]) for pair in pairs]
    coefficients: dict[str, ParameterValue] = {}
    texts = []
    for k, side in enumerate(SIDES):
        if told[k] < min(4.0 * SELECTION.per_parameter, max(told)):
            continue
        angle = {1: "({w} * t + psi)", -1: "({w} * t - psi)", 0: "({w} * t)"}[side]
        for j, (letter, wave) in enumerate((("a", "cos"), ("b", "sin"))):
            name, at = f"{letter}{k + 1}", 2 * k + j
            coefficients[name] = ParameterValue(float(values[at]), float(np.sqrt(block[at, at])))
            texts.append(f"{{{name}}} * {wave}{angle}")
    return _Part(" + ".join(texts), {**coefficients, "w": w}, chi2)


def swinging_in_words(terms: Sequence[SensorTerm], fit: Fit) -> str:
    """Return how often what swings does so, and what readings at these instants cannot tell from it; else nothing."""
    place = {q.name: j for j, q in enumerate(fit.parameters) if q.group == "term"}
    at = [(term.sensor, place[f"{i}.shape"]) for i, term in enumerate(terms) if term.kind == "swinging"]
    return " ".join(_in_hertz(float(fit.at[s]), float(np.sqrt(fit.covariance[s, s])), fit, sensor) for sensor, s in at)


def _in_hertz(w: float, sd: float, fit: Fit, sensor: str) -> str:
    hertz = w / (2.0 * np.pi)
    gaps = [np.diff(r.t) for each in fit.trajectories for r in each.readings if r.sensor == sensor]
    rate = 1.0 / float(np.median(np.concatenate(gaps)))
    return (
        f"It swings at {hertz:.6g} ± {sd / (2.0 * np.pi):.2g} Hz, in another phase in each recording (the coefficients "
        f"are those of the first); at {rate:.4g} readings a second {rate - hertz:.6g} and {rate + hertz:.6g} Hz read "
        "the same."
    )


def _unit(target: str) -> str:
    """Return the unit of what a law about motion gives, after a blank."""
    if target in WIND_TARGETS:
        return " m/s"
    return "" if target == AIR_SHARE else " N" if target.endswith("_N") else " N m"


def _factor(symbol: str, power: str) -> str:
    return f"|{symbol}|^{power}"


def as_laws(
    terms: Sequence[Term], fit: Fit, at: Mapping[str, float], heldout: float | None
) -> tuple[tuple[Law, ...], str]:
    """Return a fit's terms as laws, one for each target, and as values at the reference state."""
    by_target: dict[str, list[int]] = {}
    for i, term in enumerate(terms):
        by_target.setdefault(term.target, []).append(i)
    found = [_as_law({i: terms[i] for i in mine}, fit, at, heldout) for mine in by_target.values()]
    return tuple(law for law, _ in found), "; ".join(note for _, note in found)


def _as_law(terms: Mapping[int, Term], fit: Fit, at: Mapping[str, float], heldout: float | None) -> tuple[Law, str]:
    """Return a fit's terms about one target, by their number, as a law of plain SI coefficients, and as values.

    The coefficient of |x|^n is that at x = 1, far from where a disc ever is; its standard deviation holds the
    exponent's share, ln(x / 1) times its own.
    """
    place = {q.name: j for j, q in enumerate(fit.parameters) if q.group == "law"}
    C = fit.covariance
    coefficients, parts, notes = {}, [], []
    for i, term in terms.items():
        mark = "" if len(terms) == 1 else str(i + 1)
        j = place[f"{i}.coefficient"]
        c = float(fit.at[j])
        row = np.zeros(len(fit.parameters))
        row[j] = 1.0 / c if c else 0.0
        logarithm, factors, where = 0.0, [], []
        for symbol, n in term.powers:
            name = f"{i}.power_{symbol}"
            own = "n" if len(term.powers) == 1 else f"n_{symbol}"
            if name in place:
                power = float(fit.at[place[name]])
                row[place[name]] -= log(at[symbol])
                coefficients[own + mark] = ParameterValue(power, float(np.sqrt(C[place[name], place[name]])))
                factors.append(_factor(symbol, own + mark))
            else:
                power = n
                factors.append(_factor(symbol, f"{n:g}"))
            logarithm -= power * log(at[symbol])
            where.append(f"|{symbol}| = {at[symbol]:g}")
        factors += [f"sign({symbol})" for symbol in term.odd]
        if term.decay:
            name = f"{i}.decay"
            decay = float(fit.at[place[name]])
            sd = float(np.sqrt(C[place[name], place[name]]))
            coefficients["tau" + mark] = ParameterValue(1.0 / decay, sd / decay**2)
            factors.append(f"exp(-t/tau{mark})")
        if term.order:
            phase = place[f"{i}.phase"]
            coefficients["phase" + mark] = ParameterValue(float(fit.at[phase]), float(np.sqrt(C[phase, phase])))
            factors.append(f"cos({term.order} * yaw + phase{mark})")
            where.append(f"{term.order} times in a turn")
        if term.place is not None:
            names = dict(zip(PLACE, (f"{name}{mark}" for name in ("a", "b", "s")), strict=True))
            for key, name in names.items():
                j_key = place[f"{i}.{key}"]
                coefficients[name] = ParameterValue(float(fit.at[j_key]), float(np.sqrt(C[j_key, j_key])))
            a, b, s = names.values()
            factors.append(f"exp(-((north - {a})^2 + (east - {b})^2) / (2 {s}^2))")
            where.append("the middle of its place")
        scale = exp(logarithm)
        sd = abs(c) * scale * float(np.sqrt(max(float(row @ C @ row), 0.0)))
        coefficients["c" + mark] = ParameterValue(c * scale, sd)
        parts.append(" * ".join(["c" + mark, *factors]))
        notes.append(
            f"{c:.4g} ± {float(np.sqrt(C[j, j])):.2g}{_unit(term.target)}"
            + (f" at {', '.join(where)}" if where else "")
        )
    target = next(iter(terms.values())).target
    return Law(" + ".join(parts), target, coefficients, heldout), "; ".join(notes)
