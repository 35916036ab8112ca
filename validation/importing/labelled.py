"""Lines whose cells have their names before them, as examples for Arduino print them.

Takes lines; gives names and cells. A record may go over several lines, a sensor in each.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from discsim.validation.importing.vectornav import BEGINS, sentence_cells

__all__ = ["RecordLines", "labelled_cells", "names_of_list", "names_of_records", "split_stamp", "stamped"]

#: What serial monitors put before a line: "12:01:33.456 -> " (Arduino), "12:01:33.456 > " (PlatformIO), and a stamp in
#: brackets, with or without the date (Tera Term).
_MONITOR = re.compile(r"^\[?((?:\d{4}-\d\d-\d\d )?\d\d?:\d\d:\d\d(?:\.\d+)?)(?:\] ?| -?> )")
#: What ESP-IDF's log puts there: level, milliseconds since the start, and a tag ("I (412) imu: ").
_ESP_IDF = re.compile(r"^[EWIDV] \((\d+)\) [\w.-]+: ")
_COLOUR = re.compile(r"\x1b\[[\d;]*m")
#: How the time of such a stamp is called.
_TIMES = ("time", "time_ms")

_NAME = r"([^\W\d][^:=,;|\t\[]*?)"
#: a number, or what stands for none
_NUMBER = r"(?:[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|nan|NaN|null|--)"
_UNITS = (
    "m/s\\^?2|m/s²|m/s/s|rad/s|radians/s|deg/s|degrees/s|°/s|dps|DPS|uT|µT|nT|m?[gG]auss|mG|mg|G|g|ms|us|s|deg ?C|°C|C"
    "|Hz|deg|°|h?Pa|m"
)
#: behind a cell comes its unit, perhaps, then what parts it from the next, if not the next one's name
_END = rf"(?:\s*({_UNITS})(?=[\s,;|]|$))?(?:[\s,;|]+|$|(?=[^\W\d]\w*[:=]))"
_ONE = re.compile(rf"{_NAME}\s*[:=]\s*({_NUMBER}){_END}")
#: three numbers behind one name, in brackets or not
_THREE = re.compile(rf"{_NAME}\s*(?:[:=]\s*)?\[\s*({_NUMBER}(?:[\s,;]+{_NUMBER})*)\s*\]{_END}")
_BARE_THREE = re.compile(rf"{_NAME}\s*[:=]\s*[(<]?\s*({_NUMBER}(?:\s*[,;\t ]\s*{_NUMBER}){{2}})\s*[)>]?{_END}")
#: a sensor's name before axes that have each their own ("Gyro: x= 0.1 | y= 0.2")
_OWNER = re.compile(rf"{_NAME}\s*:\s*(?=[xyzXYZ]\s*[:=])")
#: a word of its own before the first name ("Scaled. Acc (mg)")
_WORD = re.compile(r"^[^\W\d]+\.\s+")
#: a unit in square brackets before its colon, as ST's examples print it ("Angular rate [mdps]:1.0\t-2.0\t0.5")
_SQUARE = re.compile(r"\s*\[([^\W\d][^\[\]]*)\]\s*(?=[:=])")
#: a time before the first name, with its unit perhaps ("120: ax=1", "0.5 s, Acc: 1 2 3"): three cells must follow
_FIRST = re.compile(r"^[\[(]?(\d+(?:\.\d+)?)(?:\s*([mun]?s)\b)?[\])]?(?:\s*[:,;|>]|\s*->?)?\s+(?=[^\W\d])")
_AFTER = 3
#: a name in square brackets before all of a line ("[Gyro]: 1 2 3")
_IN_BRACKETS = re.compile(r"^\[([^\W\d][\w ]*)\]\s*[:=]\s*")
#: names and numbers in turn with nothing but blanks between ("Mx -1 My -294 Mz 420")
_IN_TURN = re.compile(rf"(?:[^\W\d]\w*[ \t]+{_NUMBER}(?:[ \t]+|$)){{3,}}")
_UNIT = re.compile(r" \([^()]*\)$")
_AXIS = re.compile(r"(.*?)[\s_.]*\b([xyzXYZ])")
#: a name with its axis glued to it ("ax")
_GLUED = re.compile(r"(.+)[xyzXYZ]")


#: What Teleplot takes from a serial port: ">gx:1.0", also with ms since 1970 and a unit (">gx:1627551892437:1.0|dps").
_TELEPLOT = re.compile(rf"^>([^:|]+):(?:(\d{{9,}}(?:\.\d+)?):)?({_NUMBER})(?:[|\u00a7](.*))?$")


def stamped(line: str) -> tuple[str, str, str] | None:
    """Return what a serial monitor or ESP-IDF's log put before a line: the time's name, the stamp, and what follows.

    None where there is none. A date is joined to its time.

    >>> stamped("12:01:33.456 -> 1,2"), stamped("I (412) imu: 1 2"), stamped("1,2")
    (('time', '12:01:33.456', '1,2'), ('time_ms', '412', '1 2'), None)
    """
    line = _COLOUR.sub("", line) if "\x1b" in line else line
    if (monitor := _MONITOR.match(line)) is not None:
        return _TIMES[0], monitor[1].replace(" ", "T"), line[monitor.end() :]
    if (logged := _ESP_IDF.match(line)) is not None:
        return _TIMES[1], logged[1], line[logged.end() :]
    return None


def split_stamp(line: str) -> tuple[str, str]:
    """Return what a serial monitor or ESP-IDF's log put before a line, as it stands there, and what follows.

    Colours of a terminal are left out.

    >>> split_stamp("12:01:33.456 -> 1,2"), split_stamp("1,2")
    (('12:01:33.456 -> ', '1,2'), ('', '1,2'))
    """
    line = _COLOUR.sub("", line)
    rest = line if (begun := stamped(line)) is None else begun[2]
    return line[: len(line) - len(rest)], rest


def labelled_cells(line: str) -> list[tuple[str, str]]:
    """Return the names and cells of a line whose cells have their names before them; empty where it is none.

    Three numbers behind one name are its x, y and z; an axis alone is that of the name before it. A unit behind a cell
    comes to its name, and one behind the last of three axes to theirs.

    >>> labelled_cells("gx:1.0 gy:-2 gz:0.5"), labelled_cells("12:03:20.100 -> Gyro X: 1.0, t = 2")
    ([('gx', '1.0'), ('gy', '-2'), ('gz', '0.5')], [('time', '12:03:20.100'), ('Gyro X', '1.0'), ('t', '2')])
    >>> labelled_cells("Rotation X: 0.1, Y: 0, Z: 2 rad/s")
    [('Rotation X (rad/s)', '0.1'), ('Rotation Y (rad/s)', '0'), ('Rotation Z (rad/s)', '2')]
    >>> labelled_cells("ax = 1.0 ay = 2.0 az = 9.8 mg")
    [('ax (mg)', '1.0'), ('ay (mg)', '2.0'), ('az (mg)', '9.8')]
    >>> labelled_cells(">gx:1627551892437:1.0|dps")
    [('time_ms', '1627551892437'), ('gx (dps)', '1.0')]
    >>> labelled_cells("X:-0.5Y:1.2Z:9")
    [('X', '-0.5'), ('Y', '1.2'), ('Z', '9')]
    >>> labelled_cells("Mag (uT) [ 1, 2, 3 ]")
    [('Mag (uT) x', '1'), ('Mag (uT) y', '2'), ('Mag (uT) z', '3')]
    >>> labelled_cells("Gyro:  x= 0.1 | y= 2 | z= 3")
    [('Gyro x', '0.1'), ('Gyro y', '2'), ('Gyro z', '3')]
    >>> labelled_cells("Rate [dps]: 1 -2 3"), labelled_cells("Mx -1 My 2 Mz 3")
    ([('Rate (dps) x', '1'), ('Rate (dps) y', '-2'), ('Rate (dps) z', '3')], [('Mx', '-1'), ('My', '2'), ('Mz', '3')])
    >>> labelled_cells("[Gyro]: 1 2 3"), labelled_cells("120: ax=1 ay=2 az=3")[:2]
    ([('Gyro x', '1'), ('Gyro y', '2'), ('Gyro z', '3')], [('time', '120'), ('ax', '1')])
    """
    if line.startswith(BEGINS):
        return sentence_cells(line)
    if (told := _TELEPLOT.match(line.strip())) is not None:
        reading = (f"{told[1].strip()} ({told[4]})" if told[4] else told[1].strip(), told[3])
        return [(_TIMES[1], told[2]), reading] if told[2] else [reading]
    begun = stamped(line)
    found = [] if begun is None else [begun[:2]]
    text = _IN_BRACKETS.sub(r"\1: ", _WORD.sub("", (line if begun is None else begun[2]).strip()))
    if not text:
        return []
    if not found and (first := _FIRST.match(text)) is not None:
        cells = labelled_cells(text[first.end() :])
        known = len(cells) >= _AFTER and cells[0][0] not in _TIMES
        return [(f"time ({first[2]})" if first[2] else "time", first[1]), *cells] if known else []
    if _IN_TURN.fullmatch(text):
        words = text.split()
        return found + list(zip(words[::2], words[1::2], strict=True))
    cells = _one_after_another(_SQUARE.sub(r" (\1)", text))
    return found + cells if cells else []


def _one_after_another(text: str) -> list[tuple[str, str]]:
    """Return the names and cells of a text in which each cell follows its name; empty where it is none."""
    at, owner, units = 0, "", dict[str, str]()
    cells: list[tuple[str, str, str]] = []
    while at < len(text):
        if (match := _OWNER.match(text, at)) is not None:
            owner, at = match[1].strip(), match.end()
            continue
        if (match := _THREE.match(text, at) or _BARE_THREE.match(text, at)) is not None:
            numbers, owner = re.split(r"[\s,;]+", match[2].strip()), match[1].strip()
            named = names_of_list(owner, len(numbers))
        elif (match := _ONE.match(text, at)) is not None:
            numbers, name = [match[2]], match[1].strip()
            axis = _AXIS.fullmatch(name)
            if axis is not None and not axis[1] and owner:
                name = f"{owner} {name}"
            else:
                owner = name if axis is None else axis[1]
            named = [name]
        else:
            return []
        glued = _GLUED.fullmatch(named[0])
        shared = owner if glued is None else glued[1]
        if match[3]:
            units[shared] = match[3]
        cells += [(shared, name, number) for name, number in zip(named, numbers, strict=True)]
        at = match.end()
    return [(f"{name} ({units[shared]})" if shared in units else name, cell) for shared, name, cell in cells]


def names_of_list(name: str, count: int) -> list[str]:
    """Return the names of so many numbers under one name: of three x, y and z."""
    if count == 1:
        return [name]
    return [f"{name} {'xyz'[k] if count == 3 else k + 1}" for k in range(count)]


def names_of_records(lines: Sequence[str]) -> tuple[tuple[str, ...], int, int]:
    """Return the names of most records' cells, in how many of the ``lines`` they stand, and how many have any.

    A record begins anew with the line behind a blank one, else with that which was the first; the serial monitor's
    time is that of its first line.
    """
    named, after_blank, blank = [], Counter[tuple[str, ...]](), False
    for line in lines:
        if names := tuple(name for name, _ in labelled_cells(line)):
            named.append(names)
            after_blank[names] += blank
            blank = False
        else:
            blank = blank or not (line if (begun := stamped(line)) is None else begun[2]).strip()
    if not named:
        return (), 0, 0
    alone, count = Counter(named).most_common(1)[0]
    if 2 * count > len(named):
        return alone, count, len(named)
    first = after_blank.most_common(1)[0][0] if any(after_blank.values()) else named[0]
    records: list[list[tuple[str, ...]]] = []
    for names in named:
        if names == first:
            records.append([])
        if records:
            records[-1].append(names)
    lengths = Counter(tuple(record) for record in records)
    best, times = lengths.most_common(1)[0] if lengths else ((), 0)
    joined = (*best[0], *(name for names in best[1:] for name in _timeless(names))) if best else ()
    return joined, times * len(best), len(named)


def _timeless(names: tuple[str, ...]) -> tuple[str, ...]:
    return names[1:] if names and names[0] in _TIMES else names


class RecordLines:
    """Joins lines to records of some ``columns``, a record over one line or several."""

    def __init__(self, columns: Sequence[str]) -> None:
        # what stands twice is numbered
        self._names = tuple(re.sub(r"\.\d+$", "", name) for name in columns)
        self._cells: list[str] = []
        self._begun = 0
        self._several = False

    def add(self, number: int, line: str) -> tuple[tuple[int, list[str]] | None, list[tuple[int, int]]]:
        """Take a line; return the record that it ends, if any, and what is broken off.

        A record's first line comes with its cells, that of what is broken off with their count. Between the lines of
        records over several there may be any others, as blank ones and headings.
        """
        pairs = labelled_cells(line)
        if not pairs and (self._several or self._cells):
            return None, []
        broken = []
        if self._cells:
            more = pairs[1:] if pairs[0][0] in _TIMES else pairs
            if self._fits(more):
                pairs, self._several = more, True
            else:
                broken.append((self._begun, len(self._cells)))
                self._cells = []
        if not self._fits(pairs):
            return None, [*broken, (number, len(pairs))] if line.strip() else broken
        if not self._cells:
            self._begun = number
        self._cells += [cell for _, cell in pairs]
        if len(self._cells) < len(self._names):
            return None, broken
        record, self._cells = self._cells, []
        return (self._begun, record), broken

    def _fits(self, pairs: Sequence[tuple[str, str]]) -> bool:
        """Tell whether cells are the next ones of a record; the columns may leave out the units behind them."""
        own = self._names[len(self._cells) :][: len(pairs)]
        if not pairs or len(own) < len(pairs):
            return False
        return all(name in (written, _UNIT.sub("", written)) for name, (written, _) in zip(own, pairs, strict=True))
