"""A place as people write or paste it. Takes a text; gives latitude and longitude in degrees north and east."""

from __future__ import annotations

import re
from collections.abc import Iterator

__all__ = ["coordinates"]

_NUMBER = r"\d+(?:\.\d+)?"
#: Degrees, and perhaps minutes and seconds of an arc, with or without their signs; N, S, E or W on either side. O is
#: none of them: it is east in German, and west in French and Spanish.
_ANGLE = re.compile(
    rf"\s*([NSEW])?\s*([-+]?)({_NUMBER})\s*°?\s*(?:({_NUMBER})\s*['′’]?\s*)?(?:({_NUMBER})\s*(?:[\"″”]|'')?\s*)?"
    r"([NSEW])?\s*",
    re.IGNORECASE,
)
#: Two angles with a letter behind each, or before each, whatever stands between them.
_LETTERED = (
    re.compile(r"(.*[NSEW])[\s,;]*([^NSEW]*[NSEW])", re.IGNORECASE),
    re.compile(r"([NSEW][^NSEW]*?)[\s,;]*([NSEW].*)", re.IGNORECASE),
)


def coordinates(text: str) -> tuple[float, float] | None:
    r"""Return latitude and longitude of a place, degrees north and east; None where a text is none.

    Minutes and seconds and letters of the sky are read as maps write them; letters also tell which of the two comes
    first. Decimal commas need another mark than a comma between the two.

    >>> coordinates("37.57,126.98"), coordinates("126.98E, 37.57S"), coordinates("33°51'36\"S 151°12'0\"E")
    ((37.57, 126.98), (-37.57, 126.98), (-33.86, 151.2))
    """
    for one, other in _parted(text.strip()):
        first, second = _angle(one), _angle(other)
        if first is None or second is None:
            continue
        skies = (first[1], second[1])
        if skies[0] and skies[1] and (skies[0] in "NS") == (skies[1] in "NS"):
            return None
        turned = skies[0] in ("E", "W") or skies[1] in ("N", "S")
        return (second[0], first[0]) if turned else (first[0], second[0])
    return None


def _parted(text: str) -> Iterator[tuple[str, str]]:
    """Yield the ways in which a text may be two angles, the likelier ones first."""
    for pattern in _LETTERED:
        if (found := pattern.fullmatch(text)) is not None:
            yield found[1].replace(",", "."), found[2].replace(",", ".")
    for mark, decimal in ((",", "."), (";", ","), (None, ",")):
        parts = text.split(mark)
        if len(parts) == 2:
            yield parts[0].replace(decimal, "."), parts[1].replace(decimal, ".")


def _angle(text: str) -> tuple[float, str] | None:
    """Return an angle in degrees with the letter of the sky that stands at it, empty where none does."""
    found = _ANGLE.fullmatch(text)
    if found is None:
        return None
    before, sign, degrees, minutes, seconds, behind = found.groups()
    sky = (before or behind or "").upper()
    if (before and behind) or (sky and sign == "-") or float(minutes or 0) >= 60 or float(seconds or 0) >= 60:
        return None
    size = float(degrees) + float(minutes or 0) / 60 + float(seconds or 0) / 3600
    return -size if sign == "-" or sky in ("S", "W") else size, sky
