"""Seeded mutations of small text files: TOML, tables of numbers, anything."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Mapping

__all__ = ["mutated"]

#: what people, loggers and programs write where a number belongs, and what only an enemy would write
ODD_NUMBERS = (
    *("0", "-0.0", "-1", "1", "2", "1e308", "-1e308", "1e-320", "1e300", "-1e300", "1e-300", "5e-324", "1e155"),
    *("nan", "inf", "-inf", "1e400", "99999999999999999999", "-99999999999999999999", "9" * 400, "9" * 5000),
    *("0x" + "f" * 5000, "0o" + "7" * 5000, "0b" + "1" * 20000, "0x10", "1_000", "1,5", "1.", ".5", "+3", "1e5", "1e6"),
    *("1e7", "1e9", "1e12", "1e15", "1e30", "1e-6", "1e-9", "1e-12", "1e-30", "3.4028235e38", "65535", "-32768"),
)
ODD_VALUES = (
    *("", "true", '"text"', "''", "[]", "[1]", "[1, 2, 3]", "[[1, 2], [3, 4]]", "[1e308, -1e308, 0]", "{a = 1}"),
    *("1979-05-27", "1979-05-27T07:32:00", "07:32:00", '"\\u0000"', '"\u202e"', '"' + "x" * 3000 + '"', "[" * 300),
    *('"<script>alert(1)</script>"', '"../../etc/passwd"', '"/etc/passwd"', '"nan"', "[1, 2, [3]]", '"a\\nb"'),
)
ODD_CELLS = ("", " ", "NaN", "null", "-", "--", "1.5.2", "0x1p3", "١", "1 000", '"1"', "#", "1e", "TRUE", "\x00", "é")
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")


def mutated(files: Mapping[str, str], rng: random.Random) -> dict[str, str]:
    """Return the files with one to three mutations; now and then with more."""
    changed = dict(files)
    for _ in range(rng.choice((1, 1, 1, 2, 2, 3, 6))):
        name = rng.choice(sorted(changed))
        toml = name.endswith(".toml")
        if rng.random() < 0.03:
            changed[name] = _any(changed[name], rng)
        elif rng.random() < 0.01 and len(changed) > 1:
            del changed[name]
        else:
            changed[name] = (_toml if toml else _table)(changed[name], rng)
    return changed


def _odd_number(rng: random.Random) -> str:
    if rng.random() < 0.5:
        return rng.choice(ODD_NUMBERS)
    reach = 310 if rng.random() < 0.3 else 9
    return f"{rng.choice((-1, 1)) * rng.random():.6g}e{rng.randint(-reach, reach)}"


# ------------------------------------------------------------------------------------------------ any text


def _any(text: str, rng: random.Random) -> str:
    place = rng.randrange(len(text) + 1)
    match rng.randrange(5):
        case 0:  # a byte that is no UTF-8, or a control character
            return (
                text[:place]
                + rng.choice(("\udcff", "\udc80", "\x00", "\x1b[31m", "\r", "\ufeff", "\u2028"))
                + text[place:]
            )
        case 1:
            return text[:place]
        case 2:
            return text[: place // 2] + text[place:]
        case 3:
            return text[:place] + text[place // 2 : place] + text[place:]
        case _:
            return text.replace("\n", rng.choice(("\r\n", "\r", "\n\n")))


# ------------------------------------------------------------------------------------------------ TOML


def _toml(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    stated = [k for k, line in enumerate(lines) if "=" in line]
    if not stated:
        return _any(text, rng)
    k = rng.choice(stated)
    key, _, value = lines[k].partition("=")
    what = rng.random()
    if what < 0.45 and _NUMBER.search(value):
        numbers = list(_NUMBER.finditer(value))
        one = rng.choice(numbers)
        value = value[: one.start()] + _other_number(one.group(), rng) + value[one.end() :]
        lines[k] = f"{key}={value}"
    elif what < 0.65:
        lines[k] = f"{key}= {rng.choice((rng.choice(ODD_VALUES), _odd_number(rng)))}"
    elif what < 0.73:
        del lines[k]
    elif what < 0.78:
        lines.insert(rng.randrange(len(lines) + 1), lines[k])
    elif what < 0.84:
        lines[k] = f"{_other_word(key, rng)}={value}"
    elif what < 0.88:
        other = rng.choice(stated)
        lines[k], lines[other] = lines[other], lines[k]
    elif what < 0.92:
        heads = [line for line in lines if line.startswith("[")]
        lines.insert(rng.randrange(len(lines) + 1), rng.choice([*heads, "[x]", "[[x]]", "[a.b]", "x = 1"]))
    elif what < 0.96:
        other = rng.choice(stated)
        lines[k] = f"{key}={lines[other].partition('=')[2]}"
    else:
        lines[k] = _any(lines[k], rng)
    return "\n".join(lines)


def _other_number(text: str, rng: random.Random) -> str:
    match rng.randrange(4):
        case 0:
            return f"{float(text) * 10.0 ** rng.randint(-12, 12):.9g}"
        case 1:
            return "-" + text.lstrip("+-")
        case _:
            return _odd_number(rng)


def _other_word(word: str, rng: random.Random) -> str:
    if not word.strip():
        return "x"
    place = rng.randrange(len(word))
    return rng.choice(
        (word[:place] + word[place + 1 :], word[:place] + "x" + word[place:], word.swapcase(), "x" * 2000)
    )


# ------------------------------------------------------------------------------------------------ tables


def _table(text: str, rng: random.Random) -> str:
    lines = text.split("\n")
    separator = "\t" if "\t" in lines[0] else ","
    head, rows = lines[0], [line.split(separator) for line in lines[1:] if line]
    if len(rows) < 4:
        return _any(text, rng)
    if rng.random() < 0.05:
        head = _other_head(head, separator, rng)
    else:
        rng.choices(*zip(*_ON_ROWS, strict=True))[0](rows, rng)
    return "\n".join([head, *(separator.join(row) for row in rows), ""])


def _other_head(head: str, separator: str, rng: random.Random) -> str:
    names = head.split(separator)
    k = rng.randrange(len(names))
    names[k] = rng.choice((_other_word(names[k], rng), "", names[0], "time"))
    rng.choice((lambda: None, lambda: rng.shuffle(names), names.pop, lambda: names.append("x")))()
    return separator.join(names)


def _one_cell(rows: list[list[str]], rng: random.Random) -> None:
    row = rng.choice(rows)
    k = rng.randrange(len(row))
    row[k] = rng.choice((_odd_number(rng), _odd_number(rng), rng.choice(ODD_CELLS)))


def _one_row(rows: list[list[str]], rng: random.Random) -> None:
    k = rng.randrange(len(rows))
    match rng.randrange(5):
        case 0:
            del rows[k]
        case 1:
            rows.insert(k, list(rows[k]))
        case 2:
            other = rng.randrange(len(rows))
            rows[k], rows[other] = rows[other], rows[k]
        case 3:
            rng.choice((rows[k].pop, lambda: rows[k].append("0")))()
        case _:
            rows[k] = [rng.choice(("", "nan", "0", "x"))] * len(rows[k])


def _fewer_rows(rows: list[list[str]], rng: random.Random) -> None:
    match rng.randrange(4):
        case 0:
            del rows[rng.choice((0, 1, 2, 3, 5, 9, 17, 40)) :]
        case 1:
            first = rng.randrange(len(rows))
            del rows[first : first + rng.randrange(1, len(rows))]
        case 2:
            del rows[:: rng.choice((2, 3))]
        case _:
            rows[:] = rows[:: rng.choice((2, 5, 20, 50))]


def _column(rows: list[list[str]], rng: random.Random) -> None:
    """Blank, hold, scale, offset or swap a column, in all rows or from some row on."""
    k, other = rng.randrange(len(rows[0])), rng.randrange(len(rows[0]))
    start = rng.choice((0, 0, rng.randrange(len(rows))))
    factor, shift = (
        10.0 ** rng.choice((rng.randint(-3, 3), rng.randint(-12, 12), rng.randint(-320, 308))),
        10.0 ** rng.randint(-9, 9),
    )
    kind = rng.choice(("blank", "hold", "scale", "offset", "swap", "turn", "odd"))
    held = rows[start][k] if k < len(rows[start]) else ""  # an earlier mutation may have shortened that row
    odd = _odd_number(rng)
    for row in rows[start:]:
        if max(k, other) >= len(row):
            continue
        match kind:
            case "blank":
                row[k] = ""
            case "hold":
                row[k] = held
            case "swap":
                row[k], row[other] = row[other], row[k]
            case "odd":
                row[k] = odd
            case _:
                row[k] = _moved(row[k], kind, factor, shift)


def _moved(cell: str, kind: str, factor: float, shift: float) -> str:
    try:
        value = float(cell)
    except ValueError:
        return cell
    return repr(value * factor if kind == "scale" else -value if kind == "turn" else value + shift)


def _clock(rows: list[list[str]], rng: random.Random) -> None:
    """Let the clock jump, run at another pace, stand nearly still, or be coarse."""
    start = rng.randrange(len(rows))
    jump, pace = 10.0 ** rng.randint(-12, 12), 10.0 ** rng.choice((rng.randint(-6, 6), rng.randint(-320, 305)))
    kind = rng.choice(("jump", "jump", "back", "pace", "still", "coarse", "epoch"))
    t0: float | None = None
    for number, row in enumerate(rows):
        try:
            t = float(row[0])
        except ValueError:
            continue
        t0 = t if t0 is None else t0
        match kind:
            case "jump" | "back":
                t += (jump if kind == "jump" else -jump) if number >= start else 0.0
            case "pace":
                t = t * pace
            case "still":  # as close as numbers get
                t = t0 + number * 2.0**-52 * max(1.0, abs(t0))
            case "coarse":
                t = round(t, rng.choice((0, 1, 2)))
            case _:
                t += 1.7e9
        row[0] = repr(t)


_ON_ROWS: tuple[tuple[Callable[[list[list[str]], random.Random], None], float], ...] = (
    (_one_cell, 3.0),
    (_one_row, 1.0),
    (_fewer_rows, 1.0),
    (_column, 2.0),
    (_clock, 2.0),
)
