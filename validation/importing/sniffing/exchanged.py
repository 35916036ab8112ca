"""Sensors whose names are exchanged. Takes the triples by their names; gives them as their readings show.

`gx` over the accelerometer's readings and `ax` over the gyroscope's is a slip of a line in a logger's program.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

from discsim.validation.importing.sniffing.behaviour import looks_like
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.groups import Triple

__all__ = ["exchanged"]


def exchanged(
    named: Mapping[str, Triple], seen: Mapping[str, tuple[str, str]] | None = None
) -> tuple[dict[str, Triple], list[Decision], list[str]]:
    """Return the triples by the sensors that they are, a decision for each that is not as its name says, and notes.

    A name is not believed where its readings are another sensor's, and those of that name are this one's. The units
    of exchanged names are not believed either. ``seen`` is what each one's readings are, and why; by default what
    `looks_like` says of them.
    """
    seen = seen or {sensor: looks_like(triple.values) for sensor, triple in named.items()}
    wrong = {sensor: (meant, why) for sensor, (meant, why) in seen.items() if meant and meant != sensor}
    if not wrong or {meant for meant, _ in wrong.values()} != set(wrong):
        return dict(named), [], []
    found, decisions, lines = dict(named), [], []
    for sensor, (meant, why) in wrong.items():
        triple = replace(named[sensor], sensor=meant, source="its readings", units=())
        found[meant] = triple
        said = f"{why}, although {named[sensor].source} says {sensor}"
        decisions.append(Decision(meant, triple.label, "likely", said))
        stated = json.dumps(list(triple.names), ensure_ascii=False)
        lines.append(f"[sensors.{sensor}] columns = {stated}")
    note = (
        f"WARNING: the names of {' and '.join(sorted(wrong))} are EXCHANGED in the log and are taken by their "
        f"readings; rename its columns; if the names are right, write in a map: {'; '.join(sorted(lines))}"
    )
    return found, decisions, [note]
