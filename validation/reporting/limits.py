"""Limits of scores: read from a file, laid upon scores, and written from the spread of repeated runs."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.stats import chi2, norm

from discsim.errors import InputError
from discsim.files import model_file, model_names, read_text
from discsim.validation.reporting.scores import Score, score

__all__ = ["Limit", "limited", "limits_text", "margin", "read_limits", "shipped_limits", "unguarded"]

#: a limit is to hold this share of all further runs, and that with this confidence: of 25 scores of a run that draw
#: random numbers one in 400 runs then fails by chance
SHARE, CONFIDENCE = 0.9999, 0.95
#: scatter below this share of a score's size is rounding and no spread
ROUNDING = 1e-6


class Limit(NamedTuple):
    """How far a score may be from what is expected of it; ``expected`` None leaves that as it is."""

    tolerance: float
    expected: float | None = None


def read_limits(path: Path) -> dict[str, Limit]:
    """Read a file of limits: ``[limits]``, the names of scores as keys, a tolerance or a table each.

    A table has ``tolerance`` and, where it is to be another one, ``expected``. Raises `InputError` for anything else.
    """
    text = read_text(path)
    try:
        content = tomllib.loads(text)
    except ValueError as error:
        raise InputError.at(
            path, None, f"no valid TOML: {error}; expected [limits] and lines of name = number"
        ) from None
    listed = content.pop("limits", None)
    if content or not isinstance(listed, dict):
        raise InputError.at(path, None, "expected one table, [limits], of scores' names and tolerances")
    return {name: _limit(path, name, value) for name, value in listed.items()}


def _limit(path: Path, name: str, value: object) -> Limit:
    entry = value if isinstance(value, dict) else {"tolerance": value}
    numbers = {key: item for key, item in entry.items() if isinstance(item, int | float) and not isinstance(item, bool)}
    if "tolerance" not in entry or set(entry) - {"tolerance", "expected"} or len(numbers) < len(entry):
        what = f'"{name}" is {value!r}'
        raise InputError.at(path, None, f"{what}; expected a number, or {{tolerance = ..., expected = ...}}")
    if not (np.isfinite(list(numbers.values())).all() and numbers["tolerance"] >= 0):
        raise InputError.at(path, None, f'"{name}" is {value!r}; expected finite numbers, a tolerance of zero or more')
    expected = numbers.get("expected")
    return Limit(float(numbers["tolerance"]), None if expected is None else float(expected))


def shipped_limits(quick: bool) -> dict[str, Limit]:
    """Return the limits that come with the program, of the full run or the quick one; the files say how they came.

    Empty where none were recorded: the scores then keep their own tolerances.
    """
    name = "quick" if quick else "full"
    return read_limits(model_file(f"limits/{name}.toml")) if name in model_names("limits") else {}


def limited(scores: Sequence[Score], limits: Mapping[str, Limit]) -> list[Score]:
    """Return the scores judged by the limits that there are for them; the others as they are.

    A limit of no score, misspelt or of one that is gone, would guard nothing: it is a score that nothing is known of.
    """
    judged = []
    for item in scores:
        limit = limits.get(item.name, Limit(item.tolerance))
        expected = item.expected if limit.expected is None else limit.expected
        judged.append(score(item.name, item.value, item.unit, expected, limit.tolerance))
    names = {item.name for item in scores}
    lost = [(name, limit) for name, limit in limits.items() if name not in names]
    return judged + [score(name, np.nan, "", limit.expected or 0.0, limit.tolerance) for name, limit in lost]


def unguarded(scores: Sequence[Score], limits: Mapping[str, Limit]) -> list[str]:
    """Return a line for each limit that no score is held against, with the score that may be meant."""
    names = [item.name for item in scores]
    lines = []
    for name in limits:
        if name not in names:
            near = get_close_matches(name, names, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            lines.append(f"a limit of '{name}', which is no score of this run{hint}")
    return lines


def margin(count: int) -> float:
    """Return how many standard deviations of ``count`` values hold `SHARE` of all, with `CONFIDENCE`.

    The two-sided tolerance factor of a normal distribution by Howe's formula. Raises ValueError below two values.
    """
    if count < 2:
        raise ValueError(f"{count} run tells no spread; expected at least two")
    z = float(norm.ppf((1 + SHARE) / 2))
    return z * float(np.sqrt((count - 1) * (1 + 1 / count) / chi2.ppf(1 - CONFIDENCE, count - 1)))


def limits_text(runs: Sequence[Sequence[Score]], made_by: str, factor: float | None = None) -> str:
    """Return a file of limits from runs that differ in their seed alone.

    A tolerance is the distance of the mean from what is expected, and ``factor`` standard deviations (None: `margin`).
    A score that does not scatter keeps its own tolerance, and so does one that some run did not know or have.
    """
    how = f"# tolerance = |mean - expected| + {margin(len(runs)) if factor is None else factor:.2f} standard deviations"
    if factor is None:
        how += f", which hold {100 * SHARE:g} % of further\n# runs with {100 * CONFIDENCE:g} % confidence"
    lines = [
        f"# Limits of `{made_by}`, from {len(runs)} seeds.",
        f"{how};\n# scores that do not scatter keep their own.",
        "",
        "[limits]",
    ]
    values = [{item.name: item.value for item in run} for run in runs]
    for item in runs[0]:
        seen = np.array([run[item.name] for run in values if item.name in run])
        all_known = len(seen) == len(runs) and bool(np.isfinite(seen).all())
        spread = float(seen.std(ddof=1)) if all_known else 0.0
        found = f"seen {seen.min():.4g} to {seen.max():.4g}" if len(seen) > 1 else f"in one run {item.value:.4g}"
        if all_known and spread > ROUNDING * float(np.abs(seen).max()):
            mean = float(seen.mean())
            beyond = (margin(len(runs)) if factor is None else factor) * spread
            tolerance, found = f"{abs(mean - item.expected) + beyond:.6g}", f"{found}, mean {mean:.4g}, sd {spread:.3g}"
        else:
            tolerance = f"{item.tolerance!r}"
        lines.append(f"{json.dumps(item.name)} = {tolerance}  # {found}, expected {item.expected:.6g}")
    return "\n".join([*lines, ""])
