"""How the text of a raw file is laid out. Takes a path; gives a `Dialect`: separators, header, units, first record."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import islice, product
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.cell_texts import GAPS
from discsim.validation.importing.labelled import names_of_list, names_of_records
from discsim.validation.importing.raw_table import Layout, RepairList, read_raw
from discsim.validation.importing.sniffing.text import encoding_of
from discsim.validation.importing.stamps import is_stamp
from discsim.validation.importing.text_lines import TextLines

__all__ = ["Dialect", "dialect_of"]

#: Lines looked at for separators: the first ones (after a preamble) and as many spread over the file.
HEAD_LINES = 200
#: A line is a record where this share of its cells are numbers or stamps: a record of a long table (sensor, time, x, y,
#: z) has four of five, a logged event beside numbers two of five; a header has none.
RECORD_SHARE = 0.4
#: Names stand before the cells of a log where they do in this share of its lines: some break off, some are messages.
LABELLED = 0.8
#: The axes of three columns in the name of the first.
_ORDER = re.compile(r"\(([xyz]), ?([xyz]), ?([xyz])\)", re.IGNORECASE)
#: Between the lines of a record over several there may be blank ones and headings: up to three to two of names.
WITH_NAMES = 0.4
#: Of hexadecimal numbers of four digits five in six have a letter; an identifier may have one in each row.
HEXADECIMAL = 0.25
_HEXADECIMAL = re.compile(r"(?:0[xX])?(?=[0-9A-Fa-f]*[A-Fa-f])(?=[0-9A-Fa-f]*\d|[Ff]+$)[0-9A-Fa-f]{2,8}")
#: What the last column is called where the header has a name too few.
UNNAMED = "unnamed"
_COMMENTS = ("#", "%", "//", "!")
#: numbers in brackets, which Python prints of a list, a tuple or an array
_LIST = re.compile(r"[\[(]\s*[-+.\d][^\[\]()]*[\s,][^\[\]()]*[\])]")


@dataclass(frozen=True)
class Dialect:
    """A layout the reader of raw tables takes, the names it gives, units from a line of their own, and remarks.

    ``record`` is the index of the first record's line; ``width`` the cells of a record; ``preamble`` the lines above
    the table, names and units with them.
    """

    layout: Layout
    names: tuple[str, ...]
    units: tuple[str, ...]
    has_header: bool
    record: int
    width: int
    remarks: tuple[str, ...]
    preamble: tuple[str, ...] = ()


def dialect_of(path: Path) -> Dialect:
    """Find the layout of a text file; raises `InputError` where it has no rows of numbers."""
    encoding = encoding_of(path)
    lines = TextLines(path, encoding)
    comment = _comment(lines)
    sample = _sample(lines, comment)
    _refuse_pointer(path, sample[0])
    _refuse_echo(path, sample)
    head = list(islice(lines, HEAD_LINES))
    if (labelled := _labelled(head, encoding) or _labelled(sample, encoding)) is not None:
        return labelled
    layout, width = _separators(path, sample, Layout(comment=comment, encoding=encoding))
    _refuse_hexadecimal(path, [cell for line in sample for cell in layout.cells(line)])
    records = [index for index, _ in islice(_records(_bare(lines, comment), width, layout), 2)]
    if len(records) < 2:
        raise InputError.at(path, None, _no_rows(sample[0]))
    head = list(islice(lines, records[1] + 1))
    above = tuple(line.strip() for line in head[: records[0]] if line.strip())
    return replace(_named(path, head, layout, records[0], width, _remarks(layout)), preamble=above)


def _refuse_pointer(path: Path, line: str) -> None:
    """Refuse what a repository holds in a large file's place."""
    if line.startswith("version https://git-lfs.github.com/"):
        raise InputError.at(
            path,
            None,
            "is a pointer of Git LFS, which stands in the place of the file; expected the file itself: run `git lfs "
            "pull` where it was cloned, or take it by 'Download raw file' of its web page",
        )


def _refuse_echo(path: Path, sample: Sequence[str]) -> None:
    """Refuse what ROS prints of a topic, which is no table."""
    if any(re.match(r"\s*(angular_velocity|linear_acceleration|magnetic_field):\s*$", line) for line in sample):
        raise InputError.at(
            path,
            None,
            "is the YAML that `ros2 topic echo` (`rostopic echo`) prints, no table; expected the bag itself as .mcap, "
            "or a table: `rostopic echo -b BAG -p TOPIC > imu.csv`",
        )


def _refuse_hexadecimal(path: Path, cells: Sequence[str]) -> None:
    """Refuse registers as they are read, in hexadecimal: those without a letter in them would pass for numbers."""
    lettered = [cell for cell in cells if _HEXADECIMAL.fullmatch(cell)]
    if len(lettered) > HEXADECIMAL * len(cells):
        raise InputError.at(
            path,
            None,
            f"its numbers are hexadecimal ('{lettered[0][:20]}'); expected decimal ones: have the logger print such, "
            "or turn them (in Python: int(cell, 16), less 65536 where it is above 32767)",
        )


def _labelled(lines: Sequence[str], encoding: str) -> Dialect | None:
    """Return the dialect of lines whose cells have their names before them, or None where most lines are others.

    Between the lines of a record over several there may be blank ones and headings.
    """
    best, count, with_names = names_of_records(lines)
    if len(best) < 3 or count < LABELLED * with_names or with_names < WITH_NAMES * len(lines):
        return None
    unique = tuple(name if name not in best[:k] else f"{name}.{k + 1}" for k, name in enumerate(best))
    layout = Layout(separator="blank", columns=unique, encoding=encoding, labelled=True)
    return Dialect(layout, unique, (), True, 0, len(unique), ("each cell has its name before it", *_remarks(layout)))


def _no_rows(line: str) -> str:
    return (
        f"no rows of numbers in it (it begins '{line.strip()[:60]}'); expected a table that a logger wrote: "
        "numbers alone between separators, their names in a line above"
    )


def _remarks(layout: Layout) -> tuple[str, ...]:
    words = []
    if layout.decimal == ",":
        words.append("decimal comma")
    if layout.thousands:
        words.append(f"'{layout.thousands}' between thousands")
    if layout.encoding != "utf-8":
        words.append(f"text in {layout.encoding}")
    return tuple(words)


def _comment(lines: TextLines) -> str:
    """Return what starts a comment: a mark at the beginning of a line that holds no record's number at once."""
    counts: Counter[str] = Counter()
    for block in lines.blocks():
        text = "\n".join(block)
        marks = [mark for mark in _COMMENTS if mark in text]
        counts.update(mark for line in block if marks for mark in marks if line.lstrip().startswith(mark))
    return counts.most_common(1)[0][0] if counts else ""


def _is_comment(line: str, comment: str) -> bool:
    return bool(comment) and line.lstrip().startswith(comment)


def _bare(lines: TextLines, comment: str) -> Iterator[tuple[int, str]]:
    """Yield the lines that are no blanks and no comments, with their index."""
    return (
        (index, line)
        for index, line in enumerate(lines)
        if not (line.isspace() or not line or _is_comment(line, comment))
    )


def _sample(lines: TextLines, comment: str) -> list[str]:
    """Return the first lines, and as many from all over the file, which outweigh a preamble."""
    count = sum(1 for _ in _bare(lines, comment))
    step = max(1, count // HEAD_LINES)
    first = [line for _, line in islice(_bare(lines, comment), HEAD_LINES)]
    return first + [line for _, line in islice(_bare(lines, comment), HEAD_LINES // 2, None, step)]


# ------------------------------------------------------------------------------------------------- separators


def _separators(path: Path, sample: list[str], base: Layout) -> tuple[Layout, int]:
    """Return the layout under which most lines are equally wide records of numbers; earlier candidates win ties."""
    lists = any(_LIST.search(line) for line in sample)
    best, best_score, width = base, 0.0, 0
    quoted = any(re.search(r"\"[+-]?\d+,\d", line) for line in sample)  # a comma within quotes is no separator
    marks = [mark for mark in (",", ".", "'", "\u00a0", "\u202f", " ") if _groups_digits(mark, sample)]
    candidates = product((",", ";", "\t", "|", "blank"), (".", ","), ("", *marks))
    for separator, decimal, thousands in candidates:
        if thousands == decimal or (separator in (decimal, thousands) and not quoted):
            continue
        if separator != "blank" and not any(separator in line for line in sample):
            continue
        if thousands == " " and separator == "blank":
            continue
        layout = replace(base, separator=separator, decimal=decimal, thousands=thousands, lists=lists)
        score, wide = _score(layout, sample)
        if score > best_score + 1e-9:
            best, best_score, width = layout, score, wide
    if best_score == 0.0:
        raise InputError.at(path, None, _no_rows(sample[0] if sample else ""))
    return best, width


def _groups_digits(mark: str, sample: list[str]) -> bool:
    """Tell whether three digits follow a digit and a mark in any line, as behind thousands."""
    grouped = re.compile(rf"\d{re.escape(mark)}\d{{3}}")
    return any(grouped.search(line) for line in sample)


def _score(layout: Layout, sample: list[str]) -> tuple[float, int]:
    cells = [layout.cells(line) for line in sample]
    records = [row for row in cells if len(row) > 1 and _share(row, layout) >= RECORD_SHARE]
    if not records:
        return 0.0, 0
    width, count = Counter(map(len, records)).most_common(1)[0]
    shares = [_share(row, layout) for row in records if len(row) == width]
    # squared: a wrong separator leaves cells of two glued numbers, which are none
    return count / len(sample) * (sum(shares) / len(shares)) ** 2, width


def _share(cells: Sequence[str], layout: Layout) -> float:
    """Return the share of cells that hold a number or a stamp; empty ones count for neither side."""
    full = [cell for cell in cells if cell and cell.lower() not in GAPS]
    return sum(_is_number(cell, layout) or is_stamp(cell) for cell in full) / len(full) if full else 0.0


def _is_number(cell: str, layout: Layout) -> bool:
    """Tell a number in this layout, strictly: a point is no number's where the decimal mark is a comma."""
    return _number(layout.decimal).fullmatch(cell) is not None


@cache
def _number(decimal: str) -> re.Pattern[str]:
    """Return what a number with this decimal mark looks like."""
    point = re.escape(decimal)
    return re.compile(rf"[+-]?(\d+({point}\d*)?|{point}\d+)([eE][+-]?\d+)?", re.ASCII)


def _records(bare: Iterable[tuple[int, str]], width: int, layout: Layout) -> Iterator[tuple[int, str]]:
    """Yield the lines that are records of this width."""
    for index, line in bare:
        cells = layout.cells(line)
        if len(cells) == width and _share(cells, layout) >= RECORD_SHARE:
            yield index, line


# --------------------------------------------------------------------------------------------------- header


def _named(path: Path, lines: list[str], layout: Layout, record: int, width: int, remarks: tuple[str, ...]) -> Dialect:
    """Find the line of names above the first record (and one of units between), or number the columns.

    ``lines`` are the file's up to its second record.
    """
    above = [index for index in range(record) if lines[index].strip()]
    texts = [_header_cells(lines[index], layout) for index in above]
    units: tuple[str, ...] = ()
    if len(texts) > 2 and _are_units(texts[-2], texts[-3], width, layout) and _repeated(texts[-1]):
        texts, above = texts[:-1], above[:-1]  # from where each column comes, as RaceChrono writes it
    if len(texts) > 1 and _are_units(texts[-1], texts[-2], width, layout):
        units, texts, above = tuple(texts.pop()), texts, above[:-1]
        units = (*units, *[""] * (len(texts[-1]) - len(units)))[:width]
    written = texts[-1] if texts else []
    if layout.lists and texts:
        texts[-1] = _spread_names(written, lines[record], layout)
    if texts:
        texts[-1] = _spread_axes(_bracketed(texts[-1], width))
    rows = [layout.cells(lines[record]), layout.cells(lines[-1])]
    names = _fitting(texts[-1], width, rows, layout) if texts else None
    if names is not None and names[-1] == UNNAMED:
        remarks = (*remarks, f"the header has {width - 1} names for {width} columns: the last is taken to have none")
    if names is None:
        joined = _joined(path, layout, above, width)
        if joined is not None:
            return Dialect(joined[0], joined[1], (), True, record, width, (*remarks, "header broken over two lines"))
        if texts and _names_sensors(texts[-1]):
            _refuse_broken_numbers(path, layout, above[-1] + 1, len(texts[-1]), width)
            fault = f"the line of names has {len(texts[-1])} for {width} columns and was not used: mend it"
            remarks = (*remarks, fault)
        columns = tuple(f"c{k + 1}" for k in range(width))
        start = record if not layout.comment and above else 0
        return Dialect(replace(layout, skip_lines=start, columns=columns), columns, (), False, record, width, remarks)
    at = above[-1]
    plain = tuple(written) == names and not units and not _is_comment(lines[at], layout.comment)
    if plain and len(set(names)) == len(names):
        before = [line for line in lines[:at] if line.strip() and not _is_comment(line, layout.comment)]
        return Dialect(replace(layout, skip_lines=at if before else 0), names, (), True, record, width, remarks)
    # names that stand in a comment, twice, above lists, or with a line of units below are written into the map
    unique = tuple(name if name not in names[:k] else f"{name}.{k + 1}" for k, name in enumerate(names))
    return Dialect(replace(layout, skip_lines=record, columns=unique), unique, units, True, record, width, remarks)


def _header_cells(line: str, layout: Layout) -> list[str]:
    text = line.strip("\n")
    if layout.comment and _is_comment(text, layout.comment):
        text = text.lstrip().removeprefix(layout.comment).lstrip(f"{layout.comment} ")
    cells = replace(layout, lists=False).cells(text)
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def _spread_names(cells: list[str], line: str, layout: Layout) -> list[str]:
    """Return the names of columns where a record's cells hold lists; as they are where there is not one for each."""
    joined = _LIST.sub(lambda found: "[" + "~".join(re.split(r"[\s,]+", found[0].strip("[]() "))) + "]", line)
    sizes = [cell.count("~") + 1 for cell in replace(layout, lists=False).cells(joined)]
    if len(sizes) != len(cells):
        return cells
    return [name for cell, size in zip(cells, sizes, strict=True) for name in names_of_list(cell, size)]


def _bracketed(cells: list[str], width: int) -> list[str]:
    """Return names that the separators within brackets parted as one again, where they are ``width`` names then.

    >>> _bracketed(["cts", "Gyroscope (z", "x", "y) [rad/s]", "1", "2"], 4)
    ['cts', 'Gyroscope (z,x,y) [rad/s]', '1', '2']
    """
    whole: list[str] = []
    for cell in cells:
        inside = bool(whole) and whole[-1].count("(") > whole[-1].count(")")
        whole = [*whole[:-1], f"{whole[-1]},{cell}"] if inside else [*whole, cell]
    return whole if len(cells) > width == len(whole) else cells


def _spread_axes(cells: list[str]) -> list[str]:
    """Return names of which one stands for three columns, the others being called 1 and 2, as a GoPro's are written.

    >>> _spread_axes(["cts", "Gyroscope (z,x,y) [rad/s]", "1", "2"])
    ['cts', 'Gyroscope z [rad/s]', 'Gyroscope x [rad/s]', 'Gyroscope y [rad/s]']
    """
    from discsim.validation.importing.sniffing.names import sensor_of
    from discsim.validation.importing.sniffing.units import split_unit

    found = list(cells)
    for k, cell in enumerate(cells[:-2]):
        if cells[k + 1 : k + 3] == ["1", "2"]:
            order = _ORDER.search(cell)
            base, unit = split_unit(_ORDER.sub("", cell))
            if sensor_of(base.strip()) is not None:
                behind = f" [{unit}]" if unit else ""
                found[k : k + 3] = [f"{base.strip()} {axis}{behind}" for axis in (order.groups() if order else "xyz")]
    return found


def _fitting(cells: list[str], width: int, rows: list[list[str]], layout: Layout) -> tuple[str, ...] | None:
    """Return names for ``width`` columns by the first two records.

    A record may have an empty last cell, or a row number without a name, which goes up by one; else the last column
    has none: names that are moved by one are another sensor's.
    """
    if _share(cells, layout) >= RECORD_SHARE or not any(re.search(r"[^\W\d_]", cell) for cell in cells):
        return None
    if len(cells) == width:
        return tuple(cells)
    if len(cells) == width - 1:
        if not rows[0][-1]:
            return (*cells, "")
        return ("", *cells) if _counts(rows) and not _begins_with_time(cells, rows) else (*cells, UNNAMED)
    return None


def _counts(rows: list[list[str]]) -> bool:
    """Tell a row number in the first cell of two records: a whole number that goes up by one, or any other text."""
    first, second = (row[0].strip().strip("\"'") for row in (rows[0], rows[-1]))
    if not (first.isdecimal() and second.isdecimal()):
        return not re.fullmatch(r"[+-]?\d*[.,]?\d+([eE][+-]?\d+)?", first)
    return int(second) - int(first) == 1


def _begins_with_time(cells: list[str], rows: list[list[str]]) -> bool:
    """Tell names whose first is called after time, above records that begin with a date, or with no count of rows."""
    from discsim.validation.importing.sniffing.names import is_time_name
    from discsim.validation.importing.stamps import is_stamp

    first = rows[0][0].strip().strip("\"'")
    return is_time_name(cells[0]) and (is_stamp(first) or (first.isdecimal() and int(first) > 1))


def _names_sensors(cells: list[str]) -> bool:
    from discsim.validation.importing.sniffing.names import read_name, sensor_of

    return sum(sensor_of(read_name(cell).base) is not None for cell in cells) > 2


def _are_units(cells: list[str], names: list[str], width: int, layout: Layout) -> bool:
    """Tell a line of units below one of names; those of the last columns may be empty where all stand in brackets."""
    if not len(cells) <= len(names) >= width - 1:
        return False
    bracketed = all(not cell or cell[0] in "([{<" for cell in cells)
    return (len(cells) == len(names) or bracketed) and _looks_like_units(cells, layout)


def _looks_like_units(cells: list[str], layout: Layout) -> bool:
    from discsim.validation.importing.sniffing.units import readings_of

    full = [cell.strip("()[]{}<> ") for cell in cells if cell.strip("()[]{}<>- ")]
    known = sum(bool(readings_of(cell)) for cell in full)
    units = known > len(full) / 2 or (known > 1 and _repeated(full))  # some may be of no unit known here
    return units and not any(_is_number(cell, layout) for cell in full)


def _repeated(cells: list[str]) -> bool:
    """Tell what repeats, as units do: names are other ones in each column."""
    full = [cell for cell in cells if cell]
    return len(set(full)) <= len(full) / 2


def _refuse_broken_numbers(path: Path, layout: Layout, first: int, names: int, width: int) -> None:
    """Refuse records whose decimal mark parts their cells, too: a comma in ``0,002,1,003`` is the one or the other.

    There are more cells than names then, and as many of them as there are more are digits of one length without a sign,
    some with zeros before them, in each record from the line ``first`` on.
    """
    more = width - names
    if layout.separator == "blank" or layout.decimal == layout.separator or not 0 < more <= names:
        return
    rows = [layout.cells(line) for line in islice(TextLines(path, layout.encoding), first, first + HEAD_LINES)]
    columns = list(zip(*[cells for cells in rows if len(cells) == width], strict=True))
    parts = [cells for cells in columns if all(cell.isdigit() for cell in cells) and len({*map(len, cells)}) == 1]
    zeros = [cells for cells in parts if len(cells[0]) > 1 and any(cell.startswith("0") for cell in cells)]
    if len(parts) >= more and 2 * len(zeros) >= more > names // 2:
        raise InputError.at(
            path,
            first + 1,
            f"has {width} cells for {names} names, and digits without a sign in every other one: the decimal mark "
            "parts cells, too; expected two signs for the two: save it anew with semicolons between cells",
        )


def _joined(path: Path, layout: Layout, above: list[int], width: int) -> tuple[Layout, tuple[str, ...]] | None:
    """Return the layout and names of a header that broke off and goes on below, as the reader joins it."""
    for start in above[-3:]:
        tried = replace(layout, skip_lines=start)
        try:
            table = read_raw(path, tried, RepairList(("header", "comment", "width")))
        except InputError:
            continue
        if len(table.columns) == width and _share(table.columns, layout) < RECORD_SHARE:
            return tried, table.columns  # else a remark above the first record, which is no header
    return None
