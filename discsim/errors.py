"""The one error for bad input: it says what, where, and what was expected."""

from __future__ import annotations

from math import isfinite
from numbers import Real
from os import PathLike
from pathlib import Path

__all__ = ["InputError", "printable", "require_number", "require_path", "require_type", "shown"]

#: characters of a message that are shown: a file may have names of thousands, and what was expected stands at the end
_HEAD, _TAIL = 800, 300


def printable(text: str) -> str:
    """Return a text in which what does not print (ends of lines, what a terminal would obey) is escaped."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class InputError(ValueError):
    """Input that cannot be used; the message names the file, the line where there is one, and the remedy."""

    @classmethod
    def at(cls, path: Path | str, line: int | None, message: str) -> InputError:
        """Return an error that starts with ``path:line:``, in one line: what does not print is escaped.

        Of a very long message the middle is left out.
        """
        where = f"{path}:{line}" if line else f"{path}"
        message = printable(message)
        if len(message) > _HEAD + _TAIL:
            message = f"{message[:_HEAD]} ... {message[-_TAIL:]}"
        return cls(f"{printable(where)}: {message}")


def require_number(
    value: object, name: str, unit: str, *, positive: bool = False, minimum: float | None = None
) -> None:
    """Raise `InputError` for what is no finite number, or not above zero, or below a minimum."""
    least = "" if minimum is None else f", at least {minimum:g}"
    expected = f"a finite number{' above zero' if positive else least} ({unit})"
    require_type(value, Real, name, expected)
    number = float(value)  # type: ignore[arg-type]
    if not isfinite(number) or (positive and number <= 0) or (minimum is not None and number < minimum):
        raise InputError(f"{name} is {number:g}; expected {expected}")


def require_type(value: object, kind: type | tuple[type, ...], name: str, expected: str) -> None:
    """Raise `InputError` for an argument of another type; ``expected`` says what it is and how to come by one."""
    if not isinstance(value, kind):
        raise InputError(f"{name} is {shown(value)}, of type {type(value).__name__}; expected {expected}")


def shown(value: object) -> str:
    """Return how a value is shown in a message: its repr, cut off after 60 characters."""
    text = repr(value)
    return printable(text if len(text) <= 60 else f"{text[:57]}...")


def require_path(value: object, name: str, expected: str) -> None:
    """Raise `InputError` for what is neither a text nor a path; ``expected`` says what stands at the path."""
    require_type(value, (str, PathLike), name, expected)
