"""Dates with a time. Takes a cell; gives seconds from an origin of its own."""

from __future__ import annotations

from datetime import UTC, datetime

__all__ = ["stamp_seconds"]


def stamp_seconds(cell: str) -> float:
    """Return the seconds of a date with a time, or of a time of day; NaN for anything else."""
    text = cell.strip().replace(",", ".")
    try:
        if "-" not in text:
            text = f"2000-01-01T{text}"
        moment = datetime.fromisoformat(text)
    except ValueError:
        return float("nan")
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
