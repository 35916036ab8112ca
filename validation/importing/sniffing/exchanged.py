"""Sensors whose names are exchanged. Takes the triples by their names; gives them as their readings show.

`gx` over the accelerometer's readings and `ax` over the gyroscope's is a slip of a line in a logger's program. `GX` may
stand for g where no other sensor of a logger tells forces.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace

from discsim.validation.importing.sniffing.behaviour import looks_like, rests_aslant
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
    if (forces := _forces_called_g(named)) is not None:
        return forces
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


def _forces_called_g(named: Mapping[str, Triple]) -> tuple[dict[str, Triple], list[Decision], list[str]] | None:
    """Return the accelerometer that a bare `GX`, `GY`, `GZ` is beside no other, as `exchanged` does; else None.

    It is where its readings rest on gravity, or keep one size most of the time in directions that differ.
    """
    bare = named.get("gyroscope")
    if bare is None or "accelerometer" in named or bare.base.casefold() != "g" or bare.units:
        return None
    meant, why = looks_like(bare.values)
    if meant != "accelerometer":
        why = rests_aslant(bare.values)
    if not why:
        return None
    triple = replace(bare, sensor="accelerometer", source="its readings")
    others = {sensor: one for sensor, one in named.items() if sensor != "gyroscope"}
    stated = json.dumps(list(bare.names), ensure_ascii=False)
    note = (
        f"WARNING: {bare.label} reads as an accelerometer ({why}) and is taken as one; if it is a gyroscope, write in "
        f"a map: [sensors.gyroscope] columns = {stated}"
    )
    said = Decision("accelerometer", bare.label, "likely", f"{why}, and no other sensor of the log tells forces")
    return {**others, "accelerometer": triple}, [said], [note]
