"""Whether effects of the size that `discsim plan` foretells are named: cases of the challenge, diagnosed blind.

Usage: ``python benchmarks/plan.py [--seed 300] [--effects air.wind ...] [--factors 0.8 1.3]``

Each case is a drawn set of throws with one effect, brought to so many times the size that the information of its throws
foretells: at that size half of the diagnoses should name it. Motions are MuJoCo's, the information is the other
model's. Far from one the answer is plain: of a noncentrality chi-squared with one parameter and a price of 28, 14 % of
the gains exceed the price at 0.8 of the size, and 94 % at 1.3 of it.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

# in place of this folder, whose estimators.py would stand for the package
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from discsim.disc import Release  # noqa: E402
from discsim.trajectory import release_state  # noqa: E402
from discsim.validation.challenge.cases.case import Case, Concealed  # noqa: E402
from discsim.validation.challenge.cases.conceal import recordings  # noqa: E402
from discsim.validation.challenge.cases.draw import draw_case  # noqa: E402
from discsim.validation.challenge.cases.sizes import hiding_of, scaled  # noqa: E402
from discsim.validation.diagnosis.pipeline import diagnose  # noqa: E402
from discsim.validation.identification.plants.plan import Plan  # noqa: E402
from discsim.validation.planning.information import information_of, questions_of  # noqa: E402
from discsim.validation.planning.limits import limits_of  # noqa: E402
from discsim.validation.planning.recordings import Bench, planned_trajectory  # noqa: E402

EFFECTS = ("air.wind", "aero.spin_lift", "aero.yaw_reynolds", "mag.hard_iron", "accel.bias", "gps.latency")


def foretold(case: Case) -> float:
    """Return the concealed effect's size over the one at which half of the diagnoses name it."""
    sheets = {name: part.sheet for name, part in case.sheets_of.sensors.items()}
    bench = Bench(case.plant, case.environment, case.stated_disc, case.stated_rig, sheets)
    trajectories = []
    for run in case.runs:
        assert isinstance(run, Release)
        made = planned_trajectory(Plan("", release_state(run)[:13], case.longest), bench)
        assert made is not None
        trajectories.append(made)
    asked = questions_of([one.recording for one in trajectories], 1.0)
    limits = limits_of(information_of(trajectories, asked))
    hidden = case.concealed[0].effect
    limit = next(one for one in limits.effects if one.id == hidden.id)
    about = hiding_of(hidden.id).about
    way = np.array([getattr(hidden.value, name) - about for name in limit.parameters])
    # what a simpler rival asks for is taken as it is shared by the direction of the effect
    power = way**2 * np.diag(limit.information)
    need = float(power @ np.array(limit.need) / power.sum())
    return float(np.sqrt(way @ limit.information @ way / need))


def main() -> None:
    """Diagnose the cases and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=300)
    parser.add_argument("--effects", nargs="*", default=EFFECTS)
    parser.add_argument("--factors", nargs="*", type=float, default=[0.8, 1.3])
    given = parser.parse_args()
    for number, id in enumerate(given.effects):
        case = draw_case(given.seed + number, "flight", [id])
        case = replace(case, instruments=case.sheets_of)  # the noise is what the sheets state
        ratio = foretold(case)
        for factor in given.factors:
            hidden = scaled(case.concealed[0].effect, factor / ratio, "flight")
            concealed = replace(case, concealed=(Concealed(hidden),))
            started = process_time()
            found = diagnose([recordings(concealed)], ["case"]).diagnosis
            named = ", ".join(effect.id for effect in found.effects) or "-"
            print(
                f"{id} seed {case.seed}, {len(case.runs)} throws: {factor:g} of the size foretold: {found.verdict}, "
                f"{named} ({process_time() - started:.0f} s)",
                flush=True,
            )


if __name__ == "__main__":
    main()
