"""Write the page of the effects from the rows of the catalogue: ``python docs/effects.py``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from discsim.effects import CATALOGUE, Row
from discsim.validation.diagnosis.report.wording import form

PAGE = Path(__file__).resolve().parent / "effects.md"
HEAD = """# The effects

What a baseline leaves out, and faults of a setup. `python docs/effects.py` writes this page from the rows of the
catalogue (`discsim/effects/*_rows.py`); [Architecture](architecture.md#an-effect) tells how to add one. All effects are
off by default; [the physics](physics.md) says what they act upon. On the command line:
`--effect ID:name=value,name=value`. A parameter's name ends with its unit; where it does not, the unit stands behind
it. The *form* is what the effect adds to the baseline. The *trace* is what an experimenter sees of it.
"""
#: heading of a part of the page, and which rows belong there
PARTS = (
    ("The motion", lambda row: row.acts_on == "motion"),
    ("Sensors and clocks", lambda row: row.acts_on != "motion" and not row.setup),
    ("Faults of the setup", lambda row: row.setup),
)


def table(rows: Sequence[Row]) -> str:
    """Return the table of some rows in Markdown."""
    lines = ["| id | what | form | parameters | plants | trace |", "|---|---|---|---|---|---|"]
    for row in rows:
        names = [f"{name} ({row.units[name]})" if name in row.units else name for name in row.parameters]
        plants = ", ".join(plant.replace("_", " ") for plant in row.plants)
        said = [f"`{row.id}`", row.title, form(row.id), ", ".join((*names, *row.settings)), plants, row.trace]
        lines.append(f"| {' | '.join(text.replace('|', '&#124;') for text in said)} |")
    return "\n".join(lines)


def page() -> str:
    """Return the page."""
    parts = [HEAD]
    for heading, belongs in PARTS:
        parts += [f"## {heading}\n", f"{table([row for row in CATALOGUE.values() if belongs(row)])}\n"]
    return "\n".join(parts)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
