"""TOML read strictly: every key is placed, typed and has its unit in its name; errors name file and line.

A key is ``stem_unit``. Any number may carry a one-sigma uncertainty under ``stem_sigma_unit``; vectors drop
their frame there (``velocity_ned_m_s`` has ``velocity_sigma_m_s``).
"""

from __future__ import annotations

import difflib
import math
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from discsim.arrays import FloatArray, readonly
from discsim.errors import InputError
from discsim.files import read_text
from discsim.limits import ANY_NUMBER, Limit, in_another_unit, limit_of

__all__ = ["TomlTable", "obeyed_by_terminals", "parse_toml", "read_toml"]

# a table's name, not a row of a matrix that is written over several lines
_HEADER = re.compile(r"""^\s*\[+\s*(["'A-Za-z_][\w\-.\s"']*?)\s*\]+\s*(?:#.*)?$""")
#: a key or a value without blanks that no line of an error should hold whole
_LONG_WORD = re.compile(r"\S{120,}")
#: control characters but tabs and line ends, and marks that turn the direction of what follows (Unicode's Bidi_Control)
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")
_KEY = re.compile(r"""^\s*(["']?)([A-Za-z0-9_\-.]+)\1\s*=""")


def obeyed_by_terminals(text: str) -> bool:
    """Tell whether a text holds control characters, which a terminal would obey; tabs and line ends are none."""
    return _CONTROL.search(text) is not None


def _line_index(text: str) -> dict[str, int]:
    """Map ``table.key`` and ``table`` to their 1-based lines (first occurrence)."""
    index: dict[str, int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if header := _HEADER.match(line):
            table = re.sub(r"[\s\"']", "", header.group(1))
            index.setdefault(table, number)
        elif key := _KEY.match(line):
            parts = f"{table}.{key.group(2)}".lstrip(".").split(".")
            for length in range(1, len(parts) + 1):  # a dotted key states the tables on its way, too
                index.setdefault(".".join(parts[:length]), number)
    return index


def _shown(value: Any) -> str:
    return _cut(str(value).lower() if isinstance(value, bool) else repr(value))


def _cut(text: str) -> str:
    return text if len(text) <= 80 else f"{text[:77]}..."


#: TOML's integers have 64 bits
_WHOLE = 2**63
#: integers of fewer digits are always printed, Python's limit being no lower
_PRINTED = sys.int_info.str_digits_check_threshold


def _too_long(content: Mapping[str, Any]) -> tuple[str, int] | None:
    """Return the place (``table.key``) of an integer beyond TOML's 64 bits, and the integer; None where none is.

    Such an integer is no float either where it has hundreds of digits, and no text where it has thousands.
    """
    left: list[tuple[str, Any]] = [("", content)]
    while left:
        place, value = left.pop()
        if isinstance(value, dict):
            left += [(f"{place}.{key}".lstrip("."), item) for key, item in value.items()]
        elif isinstance(value, list):
            left += [(place, item) for item in value]
        elif isinstance(value, int) and not -_WHOLE <= value < _WHOLE:
            return place, value
    return None


def read_toml(path: Path) -> TomlTable:
    """Read a TOML file (UTF-8); raises `InputError` where it is absent or is no TOML."""
    return parse_toml(read_text(path), path)


def parse_toml(text: str, path: Path) -> TomlTable:
    """Read TOML that stands, or will stand, in a file; raises `InputError` with its line where it is no TOML."""
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise InputError.at(path, None, "no valid TOML: nested too deeply; expected tables of plain values") from None
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        line = re.search(r"line (\d+)", str(error))
        raise InputError.at(
            path,
            int(line.group(1)) if line else (text.count("\n") + 1 if "end of document" in str(error) else None),
            f"no valid TOML: {error}; expected lines of `key = value`, each key once",
        ) from None
    table = TomlTable(content, path, "", _line_index(text))
    if found := _too_long(content):
        place, value = found
        digits = int(value.bit_length() * math.log10(2.0)) + 1
        shown = _cut(repr(value)) if digits < _PRINTED else f"an integer of {digits} digits"
        message = f"'{place}' is {shown}, expected a finite number (an integer of at most 64 bits, or 1e20)"
        raise table.error(place, message)
    return table


class TomlTable:
    """One table of a TOML file; each getter takes a key off it, `finish` refuses what is left.

    Attributes
    ----------
    sigma : dict
        One-sigma uncertainties found so far, by the full key of the quantity they belong to.
    """

    def __init__(self, content: Mapping[str, Any], path: Path, name: str, lines: Mapping[str, int]) -> None:
        self._left = dict(content)
        self.path = path
        self.name = name
        self._lines = lines
        self._known: list[str] = []
        self.sigma: dict[str, float | FloatArray] = {}

    def _full(self, key: str) -> str:
        return f"{self.name}.{key}" if self.name else key

    def _named(self, key: str) -> str:
        return _cut(self._full(key))

    def error(self, key: str | None, message: str) -> InputError:
        """Return an error at ``key``'s line, or its table's, or that of the table around it."""
        place = self._full(key) if key else self.name
        while place and place not in self._lines:
            place = place.rpartition(".")[0]
        return InputError.at(self.path, self._lines.get(place), _LONG_WORD.sub(lambda word: _cut(word[0]), message))

    def __contains__(self, key: str) -> bool:
        return key in self._left

    def __iter__(self) -> Iterator[str]:
        """Iterate over the keys not yet taken."""
        return iter(list(self._left))

    def _take(self, key: str, expected: str, required: bool) -> Any:
        self._known.append(key)
        if key not in self._left:
            if required:
                raise self._missing(key, expected)
            return None
        return self._left.pop(key)

    def _missing(self, key: str, expected: str) -> InputError:
        where = f"[{self.name}]" if self.name else "the top level"
        message = f"missing key '{key}' in {where}; expected {expected}"
        # 0.8 tells a misspelling (gravty_m_s2, mass_g) from a neighbour (Ixx_kg_m2 and Izz_kg_m2: 0.78)
        near = difflib.get_close_matches(key, [k for k in self._left if "sigma" not in k], n=1, cutoff=0.8)
        near = near or [k for k in self._left if k.casefold() == key.casefold()]
        if near:
            return self.error(near[0], f"{message} (there is '{near[0]}'; did you mean '{key}'?)")
        return self.error(None, message)

    def text(self, key: str, *, required: bool = True, choices: tuple[str, ...] = ()) -> str | None:
        """Take a string without control characters, which a terminal would obey; one of ``choices`` where given."""
        expected = f"one of {', '.join(choices)}" if choices else "a text"
        value = self._take(key, expected, required)
        if isinstance(value, str) and obeyed_by_terminals(value):
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, expected a text without control characters")
        if value is not None and (not isinstance(value, str) or (choices and value not in choices)):
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, expected {expected}")
        return value

    def flag(self, key: str, default: bool = False) -> bool:
        """Take true or false."""
        value = self._take(key, "true or false", False)
        if value is None:
            return default
        if not isinstance(value, bool):
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, expected true or false")
        return value

    def raw(self, key: str) -> Any:
        """Take whatever stands there (None if absent), unchecked."""
        return self._take(key, "a value", False)

    def table(self, key: str, *, required: bool = False) -> TomlTable | None:
        """Take a sub-table."""
        value = self._take(key, "a table", required)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, expected a table")
        return TomlTable(value, self.path, self._full(key), self._lines)

    def tables(self, key: str, *, single: bool = False) -> list[TomlTable]:
        """Take an array of tables (``[[key]]``); none where the key is absent. ``single`` allows one ``[key]``, too."""
        value = self._take(key, "an array of tables", False)
        if value is None:
            return []
        if single and isinstance(value, dict):
            value = [value]
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, expected an array of tables [[{key}]]")
        return [TomlTable(item, self.path, self._full(key), self._lines) for item in value]

    def _check(self, key: str, value: Any, positive: bool, minimum: float | None, limit: Limit | None = None) -> float:
        expected = ""
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= sys.float_info.max:
            expected = "expected a finite number"
        elif positive and value <= 0:
            expected = "expected a number above zero"
        elif minimum is not None and value < minimum:
            expected = f"expected at least {minimum:g}"
        else:
            # what may not be negative is a size, and divides others
            expected = (limit or limit_of(key)).fault(value, divides=positive or minimum == 0.0)
            expected += in_another_unit(key, value) if expected else ""
        if expected:
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, {expected}")
        return float(value)

    def number(
        self,
        stem: str,
        unit: str = "",
        *,
        required: bool = True,
        positive: bool = False,
        minimum: float | None = None,
        limit: Limit | None = None,
    ) -> float | None:
        """Take ``stem_unit`` and, if present, its uncertainty ``stem_sigma_unit``; ``limit`` takes the key's place."""
        key = f"{stem}_{unit}" if unit else stem
        value = self._take(key, "a number", required)
        self._take_sigma(stem, unit, key, present=value is not None, length=None)
        return None if value is None else self._check(key, value, positive, minimum, limit)

    def need(self, stem: str, unit: str = "", *, positive: bool = False, minimum: float | None = None) -> float:
        """Like `number`, for a key that must be there."""
        value = self.number(stem, unit, positive=positive, minimum=minimum)
        assert value is not None
        return value

    def vector(
        self,
        stem: str,
        unit: str,
        *,
        frame: str = "",
        required: bool = True,
        length: int = 3,
        default: Sequence[float] | None = None,
    ) -> FloatArray | None:
        """Take ``stem_frame_unit`` as (length,) and, if present, ``stem_sigma_unit`` (one number or as many).

        A vector with a ``default`` may be left out, and its uncertainty is then that of the default.
        """
        key = "_".join(part for part in (stem, frame, unit) if part)
        value = self._take(key, f"{length} numbers", required and default is None)
        self._take_sigma(stem, unit, key, present=value is not None or default is not None, length=length)
        if value is None:
            return None if default is None else readonly(default)
        if not isinstance(value, list) or len(value) != length:
            raise self.error(key, f"'{self._full(key)}' is {_shown(value)}, expected a list of {length} numbers")
        return readonly([self._check(key, item, False, None) for item in value])

    def numbers(self, key: str, *, required: bool = True, dimensions: int = 1) -> FloatArray | None:
        """Take a list of numbers (or a list of such lists, all of one length)."""
        expected = "a list of numbers" if dimensions == 1 else "a matrix (equally long lists of numbers)"
        value = self._take(key, expected, required)
        if value is None:
            return None
        rows = value if dimensions == 2 else [value]
        if (
            not isinstance(value, list)
            or not value
            or not all(isinstance(row, list) and row and len(row) == len(rows[0]) for row in rows)
        ):
            raise self.error(key, f"'{self._full(key)}': expected {expected}")
        checked = [[self._check(key, item, False, None) for item in row] for row in rows]
        return readonly(checked if dimensions == 2 else checked[0])

    def _take_sigma(self, stem: str, unit: str, key: str, *, present: bool, length: int | None) -> None:
        sigma_key = f"{stem}_sigma_{unit}" if unit else f"{stem}_sigma"
        value = self._take(sigma_key, "a number", False)
        if value is None:
            return
        if not present:
            raise self.error(
                sigma_key,
                f"'{self._full(sigma_key)}' is the uncertainty of '{key}', which is missing; expected both or neither",
            )
        if isinstance(value, list) and length is not None and len(value) == length:
            self.sigma[key] = readonly([self._check(sigma_key, item, False, 0.0, ANY_NUMBER) for item in value])
        else:
            self.sigma[key] = self._check(sigma_key, value, False, 0.0, ANY_NUMBER)

    def finish(self) -> None:
        """Raise `InputError` for the first key that was not taken, with the nearest known one."""
        for key in self._left:
            near = difflib.get_close_matches(key, self._known, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else ""
            known = ", ".join(k for k in self._known if "sigma" not in k)
            raise self.error(key, f"unknown key '{self._full(key)}'{hint} (expected {known or 'nothing here'})")
