"""The files of a log, and how they are laid out. Takes paths; gives tables with their clocks and triples, and layouts.

A map states one layout for all files of a folder, and one of its own for a sensor whose file has another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from discsim.validation.importing.raw_table import REPAIRS, Layout, RepairList, read_raw
from discsim.validation.importing.sniffing.clock import Clock, clocks_of
from discsim.validation.importing.sniffing.dialect import dialect_of
from discsim.validation.importing.sniffing.groups import Numbers, Triple, triples_of
from discsim.validation.importing.sniffing.names import NO_READING
from discsim.validation.importing.sniffing.row_order import order_of

__all__ = ["LaidOut", "LogFile", "laid_out", "log_file", "own_layout"]


@dataclass(frozen=True)
class LogFile:
    """A table with its possible clocks and triples."""

    numbers: Numbers
    clocks: tuple[Clock, ...]
    triples: tuple[Triple, ...]

    @property
    def readings(self) -> list[Triple]:
        """Those of its triples that are a sensor's readings."""
        return [triple for triple in self.triples if triple.penalty < NO_READING]

    @property
    def alike(self) -> Layout:
        """What of its layout files share that one layout of a map reads."""
        return replace(self.numbers.dialect.layout, comment="", encoding="", decimal=".")


def log_file(path: Path, *, alone: bool) -> LogFile:
    """Read a table, its rows in the order of its clock; ``alone`` where no other file is beside it.

    Raises `InputError` where it is none.
    """
    dialect = dialect_of(path)
    table = read_raw(path, dialect.layout, RepairList(REPAIRS))
    numbers = Numbers(table, dialect, alone)
    clocks = clocks_of(numbers)
    if (order := order_of(numbers, clocks[0])) is not None:
        layout = replace(dialect.layout, sorted_by=order.column)
        dialect = replace(dialect, layout=layout, remarks=(*dialect.remarks, order.remark))
        table = table.in_order_of(order.column, layout.decimal)
        numbers = Numbers(table, dialect, alone)
        clocks = clocks_of(numbers)
    names = table.columns
    taken = [names.index(name) for clock in clocks for name in (clock.column, clock.counter) if name is not None]
    return LogFile(numbers, tuple(clocks), tuple(triples_of(numbers, taken)))


class LaidOut(NamedTuple):
    """The layout of most files, the files that are read, receivers' tables in other layouts, and what was left out."""

    layout: Layout
    files: list[LogFile]
    aside: list[Numbers]
    notes: list[str]


def laid_out(files: Sequence[LogFile]) -> LaidOut:
    """Return the layout that most sensors' files share; one of another is read where it has a sensor that they lack."""
    classes: dict[Layout, list[LogFile]] = {}
    for file in files:
        classes.setdefault(file.alike, []).append(file)
    best = max(classes.values(), key=lambda members: (sum(len(file.readings) for file in members), len(members)))
    layouts = [file.numbers.dialect.layout for file in best]
    layout = replace(
        layouts[0],
        comment=next((one.comment for one in layouts if one.comment), ""),
        encoding=next((one.encoding for one in layouts if one.encoding != "utf-8"), "utf-8"),
        decimal="," if any(one.decimal == "," for one in layouts) else ".",
    )
    apart = [file for file in files if file not in best]
    aside = [file.numbers for file in apart if file.numbers.tells_positions]
    others = [file for file in apart if file.readings and not file.numbers.tells_positions]
    read = list(best)
    for file in others:
        known = {triple.sensor for one in read for triple in one.readings}
        if {triple.sensor for triple in file.readings if triple.sensor is not None} - known:
            read.append(file)
    words = [remark for file in best[:1] for remark in file.numbers.dialect.remarks]
    notes = [*_left_out(best[0], [file for file in others if file not in read]), *_text(words)]
    return LaidOut(layout, read, aside, notes)


def _text(words: Sequence[str]) -> list[str]:
    return [f"text: {', '.join(words)}"] if words else []


def _left_out(first: LogFile, others: Sequence[LogFile]) -> list[str]:
    """Return a line for those files that are named otherwise than the ``first``, and for those laid out otherwise."""
    spelt = [file for file in others if replace(file.alike, columns=()) == replace(first.alike, columns=())]
    wrongs = (
        ("named", spelt, "give each of its columns a name of its own in the first line, or import it alone"),
        (
            "laid out",
            [file for file in others if file not in spelt],
            "save it with the same separator and decimal mark",
        ),
    )
    return [
        f"left out, {how} in another way than {first.numbers.path.name}: "
        f"{', '.join(file.numbers.path.name for file in some)}; to have it read, {remedy}"
        for how, some, remedy in wrongs
        if some
    ]


def own_layout(numbers: Numbers, shared: Layout) -> Layout | None:
    """Return the layout of a table that is not laid out as the others are; None of one that is."""
    own = numbers.dialect.layout
    alike = replace(own, comment=shared.comment, encoding=shared.encoding, decimal=shared.decimal) == shared
    return None if alike else own
