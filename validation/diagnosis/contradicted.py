"""The outcome where the early look at recordings found that their sensors contradict one another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.model_file import Model
from discsim.recording import Recording
from discsim.validation.diagnosis.consistency.driven import Turning
from discsim.validation.diagnosis.consistency.spin_agreement import Agreement
from discsim.validation.diagnosis.early_verdict import Contradiction, Look
from discsim.validation.diagnosis.result import Diagnosis, FitFigures, Located, Outcome, Residuals
from discsim.validation.diagnosis.settings import settings_told

__all__ = ["contradicted_outcome"]

#: a residual beyond this many times the noise is shown and counted as this: beyond it a number says nothing more
_MOST = 1e6
#: what is to be recorded where sensors contradict one another, and where they agree and nothing turns freely
_AGAIN = "The same again once these sensors agree: until then no effect can be looked for."
_FREE = (
    "A stretch in which nothing drives the body: its sensors agree, and no law of motion here is of one that is driven."
)
#: the same where rows were counted, and what that comes to, of one recording
_ANOTHER = (
    "Another throw with the same logger, diagnosed together with this one: where two recordings agree on how their "
    "rows are to be counted, the count is believed."
)
_ALONE = (
    "The rows are not evenly spaced, as told under which sensors agree: no motion follows them as they are written, "
    "and one recording alone does not prove how they are to be counted."
)


def contradicted_outcome(
    found: Contradiction,
    recordings: Sequence[Recording],
    datasets: Sequence[str],
    names: Sequence[str],
    seed: int,
    warnings: Sequence[str] = (),
    agreement: Agreement | None = None,
    turning: Turning | None = None,
) -> Outcome:
    """Return the outcome of recordings that no motion follows: unexplained, located by sensor.

    ``recordings`` (called ``names``) are those of the data sets ``datasets``. Baseline and final figures are those of
    the look at all sensors together, in noise that no misfit has inflated. ``warnings`` come after what contradicts
    what, ``agreement`` is that of the spin, ``turning`` what rates and field say where no law of motion holds.
    """
    look = found.whole
    squares = _excess(look)
    total = sum(squares.values()) or 1.0
    end = max(float(trajectory.nodes[-1]) for trajectory in look.fit.trajectories)
    located = tuple(
        Located("all", sensor, "all", 0.0, end, min(squares[sensor] / total, 1.0), _text(found, sensor))
        for sensor in sorted(found.blamed, key=lambda one: -squares[one])
    )
    shown = _residuals(look, names)
    chi2 = float(np.mean(np.concatenate([one.after for one in shown]) ** 2)) if shown else 0.0
    figures = FitFigures(chi2, None)
    first = recordings[0]
    alone = len(recordings) == 1 and agreement is not None and agreement.own_clock is not None
    diagnosis = Diagnosis(
        tuple(datasets),
        first.plant,
        seed,
        "unexplained",
        figures,
        figures,
        located,
        next_recordings=(_ANOTHER if alone else _AGAIN if turning is None or not turning.reconciled else _FREE,),
        warnings=(*((_ALONE,) if alone else ()), *_sentences(found, turning), *warnings),
        agreement=agreement,
        partly=() if turning is None else turning.partly,
    )
    return Outcome(
        diagnosis, Model(first.environment, first.disc, first.rig, (), ()), tuple(shown), (), settings_told()
    )


def _sentences(found: Contradiction, turning: Turning | None) -> tuple[str, ...]:
    """Return what contradicts what, and what turning says: where sensors agree on it no column is to be compared."""
    if turning is None or not turning.sentences:
        return found.sentences
    told = found.sentences[:-1] if turning.reconciled else found.sentences
    return (*told, *turning.sentences)


def _text(found: Contradiction, sensor: str) -> str:
    others = found.against.get(sensor, ())
    if others:
        return f"it contradicts {', '.join(others)}: no motion follows them together"
    return "no such motion follows it, even alone" if sensor in found.lost else "no motion follows it with the others"


def _left(look: Look, i: int, group: str, rows: slice) -> FloatArray:
    """Return the residuals (n,) of one channel in its noise, bounded."""
    left = look.fit.linears[i].residual[rows] / look.noise[group].sd
    return np.clip(np.nan_to_num(left, nan=_MOST, posinf=_MOST, neginf=-_MOST), -_MOST, _MOST)


def _excess(look: Look) -> dict[str, float]:
    """Return by how much the squares of what is left of each sensor exceed noise."""
    squares = dict.fromkeys(look.sensors, 0.0)
    for i, linear in enumerate(look.fit.linears):
        for channel in linear.channels:
            left = _left(look, i, channel.group, channel.rows)
            squares[channel.sensor] += max(float(left @ left) - left.size, 0.0)
    return squares


def _residuals(look: Look, names: Sequence[str]) -> list[Residuals]:
    shown = []
    for i, linear in enumerate(look.fit.linears):
        for channel in linear.channels:
            left = _left(look, i, channel.group, channel.rows)
            name = names[look.places[i]]
            shown.append(Residuals(name, channel.sensor, channel.axis, linear.t[channel.rows], left, left))
    return shown
