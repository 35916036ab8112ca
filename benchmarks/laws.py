"""Which law is found for physics that no catalogue holds, and how far its shape is off.

Run: ``python benchmarks/laws.py [--cases 40] [--seed 150000] [--kind power_law_torque]``. Cases are drawn as the blind
test draws those with physics of no catalogue. Each is followed by the relaxed fit and by the fit without any effect;
then the law is asked for at once, without the search of effects that a diagnosis makes before. For each case it prints
what is hidden, the law, its share of the excess, the error of its shape (exponent, time constant, order of the spin,
play) in its own standard deviations where the hidden physics has that shape, and the processor time; then a table by
kind of the blind test's page.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
import warnings
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from discsim.threads import limited
from discsim.validation.challenge.cases.conceal import recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.challenge.cases.off_catalogue import OFF_CATALOGUE, OffCatalogue
from discsim.validation.diagnosis.result import Law
from discsim.validation.diagnosis.selection.search_problem import SearchProblem
from discsim.validation.diagnosis.selection.starting_point import screened
from discsim.validation.diagnosis.unknown_law.find import find_law

#: field of a kind that is a shape of a law, and the coefficient's name there (a second term's has a 2 behind)
SHAPES = {
    "power_law_torque": ("exponent", "n"),
    "bearing_warmth": ("tau", "tau"),
    "rotating_magnet": ("ratio", "k"),
    "warming": ("tau", "tau"),
    "sensor_hysteresis": ("width", "w"),
}


@dataclass(frozen=True)
class Row:
    """What one case gave: whether a law was found, and its shape's error in standard deviations where it has one."""

    found: bool
    error: float | None


def told(law: Law) -> str:
    """Return a law as a line of text with its numbers."""
    numbers = ", ".join(f"{name} {one.value:.4g} ± {one.sd or 0.0:.1g}" for name, one in law.coefficients.items())
    return f"{law.target} = {law.text} ({numbers})"


def shape_error(kind: str, secret: OffCatalogue, law: Law) -> float | None:
    """Return the error of a law's shape in its standard deviations, None where there is none to compare."""
    if kind not in SHAPES:
        return None
    field, name = SHAPES[kind]
    item = law.coefficients.get(f"{name}2") or law.coefficients.get(name)
    if item is None or not item.sd:
        return None
    return (item.value - float(getattr(secret, field))) / item.sd


def asked(seed: int, kind: str | None) -> tuple[str, Row]:
    """Draw a case, ask for its law, print what was said, and return the kind of physics with what it gave."""
    case = draw_case(seed, None, [kind] if kind else [], "off_catalogue")
    assert case.secret is not None
    name = next(one for one, type in OFF_CATALOGUE.items() if isinstance(case.secret, type))
    made = recordings(case)
    begun = time.process_time()
    with limited():
        law = find_law(screened(SearchProblem(made)))
    error = shape_error(name, case.secret, law.law) if law is not None else None
    off = "" if error is None else f", shape off by {error:+.1f} sd"
    said = "no law" if law is None else f"{told(law.law)}, share {law.share:.3f}{off}"
    print(f"{seed} {case.plant} {name}: {case.secret.law}\n    {said}, {time.process_time() - begun:.0f} s", flush=True)
    return name, Row(law is not None, error)


def main() -> None:
    """Ask for the law of every case."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=150_000, help="of the first case; the next have the next ones")
    parser.add_argument("--kind", choices=list(OFF_CATALOGUE), help="only this physics")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    rows: dict[str, list[Row]] = defaultdict(list)
    for seed in range(given.seed, given.seed + given.cases):
        name, row = asked(seed, given.kind)
        rows[name].append(row)
    print("\n| physics | cases | a law | shape within 2 sd |\n|---|---|---|---|")
    for name, mine in [*rows.items(), ("all", [row for some in rows.values() for row in some])]:
        errors = np.array([row.error for row in mine if row.error is not None])
        within = f"{int(np.sum(np.abs(errors) < 2.0))} of {errors.size}" if errors.size else ""
        print(f"| {name} | {len(mine)} | {sum(row.found for row in mine)} | {within} |")


if __name__ == "__main__":
    main()
